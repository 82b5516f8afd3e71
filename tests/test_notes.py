# SPDX-License-Identifier: GPL-2.0-or-later
"""Notes beside the drawing name what a run did not take along; without such objects there are none."""

# XML is read more easily on one line.
# ruff: noqa: E501

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import inkscape as harness
import pytest
from documents import get
from inkex import load_svg
from lxml import etree
from placed import HEAD, load, place

import alup_reshape
from alup.document import handle_marks, notes, restore_original
from alup.document.tree import elements, own_objects
from alup.messages import language

INNER = '<svg id="inner"><path d="M0,0 h9"/></svg>'
TEXT = '<text id="t" x="30" y="50">text</text>'
BOX = '<path id="box" d="M20,30 H80 V70 H20 Z"/>'
FROM_TO = '<circle inkscape:label="alup:from a" cx="80" cy="30" r="1"/><circle inkscape:label="alup:to a" cx="90" cy="30" r="1"/><circle inkscape:label="alup:pin" cx="20" cy="70" r="1"/>'


def reshape(svg: Any, capsys: pytest.CaptureFixture[str], *options: str) -> Any:
    """The effect as a program; nothing may be said on the standard error."""
    out = io.BytesIO()
    effect = alup_reshape.AlupReshape()
    effect.run([*options, str(write(svg))], output=out)
    assert capsys.readouterr().err == ""
    return etree.fromstring(out.getvalue()) if out.getvalue() else svg


_FOLDER: list[Path] = []


def write(svg: Any) -> Path:
    file = _FOLDER[-1] / "in.svg"
    file.write_bytes(etree.tostring(svg))
    return file


@pytest.fixture(autouse=True)
def folder(tmp_path: Path) -> None:
    _FOLDER.append(tmp_path)


def lines(svg: Any) -> list[str]:
    return [
        "".join(text.itertext())
        for group in own_objects.groups(svg, own_objects.NOTES_LABEL)
        for text in group
    ]


def placed(body: str) -> Any:
    svg = load(body)
    place(svg, "extremes", "box")
    return svg


def drag(svg: Any, by: float = 10.0) -> None:
    circle = get(svg, "alup-handle-3")
    circle.attrib["cx"] = str(float(circle.attrib["cx"]) + by)


def test_objects_that_stay_behind_are_named_above_the_drawing(capsys: pytest.CaptureFixture[str]) -> None:
    svg = placed(BOX + INNER)
    drag(svg)
    svg = reshape(svg, capsys)
    assert lines(svg) == ["inner: a drawing inside the drawing; ungroup it."]
    (group,) = own_objects.groups(svg, own_objects.NOTES_LABEL)
    layer = group.getparent()
    assert layer is not None
    assert own_objects.is_group(layer, own_objects.LAYER_LABEL)
    assert own_objects.is_ours(group)
    ((line,),) = group
    assert 0.0 < float(line.attrib["y"]) < 30.0
    assert float(line.attrib["x"]) == pytest.approx(20.0)


def test_long_lines_are_wrapped_to_the_drawing(capsys: pytest.CaptureFixture[str]) -> None:
    name = "a-name-of-many-words-" * 3 + "x" * 99
    svg = placed(BOX + INNER.replace("inner", name))
    drag(svg)
    svg = reshape(svg, capsys)
    (group,) = own_objects.groups(svg, own_objects.NOTES_LABEL)
    ((*parts,),) = group
    assert len(parts) > 3
    texts = [part.text or "" for part in parts]
    assert "".join(texts).replace(" ", "") == (
        f"{name}: a drawing inside the drawing; ungroup it.".replace(" ", "")
    )
    down = [float(part.attrib["y"]) for part in parts]
    assert down == sorted(set(down))
    assert down[-1] < 30.0
    assert {part.attrib["x"] for part in parts} == {parts[0].attrib["x"]}
    size = float(group[0].attrib["style"].split("font-size:")[1].split("px")[0])
    assert 40 <= max(map(len, texts)) <= 60.0 / (0.6 * size)


def test_there_are_no_notes_if_all_objects_came_along(capsys: pytest.CaptureFixture[str]) -> None:
    svg = placed(BOX + TEXT)
    drag(svg)
    svg = reshape(svg, capsys)
    assert own_objects.groups(svg, own_objects.NOTES_LABEL) == []
    svg = reshape(svg, capsys)
    assert own_objects.groups(svg, own_objects.NOTES_LABEL) == []


def test_objects_that_were_asked_to_stay_are_not_named(capsys: pytest.CaptureFixture[str]) -> None:
    svg = placed(BOX + TEXT)
    drag(svg)
    assert lines(reshape(svg, capsys, "--hold=apart")) == []


def test_a_second_run_by_a_pair_says_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    svg = reshape(load(BOX + INNER + FROM_TO), capsys)
    assert len(lines(svg)) == 1
    before = etree.tostring(svg)
    assert etree.tostring(reshape(svg, capsys)) == before


def test_a_run_without_a_dragged_handle_has_a_note(capsys: pytest.CaptureFixture[str]) -> None:
    svg = reshape(placed(BOX), capsys)
    (line,) = lines(svg)
    assert line.startswith("Nothing has moved")
    drag(svg)
    assert lines(reshape(svg, capsys)) == []


def test_programs_get_an_unmoved_drawing_as_it_was(capsys: pytest.CaptureFixture[str]) -> None:
    svg = load(BOX + INNER + FROM_TO.replace("from a", "pin").replace("to a", "pin").replace('"90"', '"80"'))
    assert lines(reshape(svg, capsys)) == []
    pair = load(BOX + INNER + FROM_TO.replace('"90"', '"80"'))
    assert lines(reshape(pair, capsys)) == []


def test_a_layer_that_was_made_for_notes_goes_with_them(capsys: pytest.CaptureFixture[str]) -> None:
    svg = reshape(load(BOX + INNER + FROM_TO), capsys)
    assert len(lines(svg)) == 1
    restored = load_svg(etree.tostring(svg)).getroot()
    restore_original.restore(restored, [])
    assert own_objects.groups(restored, own_objects.LAYER_LABEL) == []
    assert b"alup:notes" not in etree.tostring(restored)


def test_a_limit_that_was_reached_and_a_handle_elsewhere(capsys: pytest.CaptureFixture[str]) -> None:
    svg = placed(BOX + '<path id="far" d="M0,90 H9"/>')
    place(svg, "extremes", "far")
    drag(svg)
    told = lines(reshape(svg, capsys, "--time_limit=0", "--id=box"))
    assert told[0].startswith("The time limit of 0 s was reached")
    assert len(told) == 3
    assert all("lies on nothing that was reshaped" in line for line in told[1:])


def tops(svg: Any) -> list[float]:
    (group,) = own_objects.groups(svg, own_objects.NOTES_LABEL)
    return [float(part.attrib["y"]) for text in group for part in text]


def test_many_notes_are_cut_short(capsys: pytest.CaptureFixture[str]) -> None:
    svg = placed(BOX + "".join(INNER.replace("inner", f"i{n}") for n in range(12)))
    drag(svg)
    svg = reshape(svg, capsys)
    told = lines(svg)
    assert [line.split(":")[0] for line in told[:-1]] == [f"i{n}" for n in range(len(told) - 1)]
    assert told[-1].startswith(f"And {12 - len(told) + 1} more")
    assert len(tops(svg)) == notes.MOST_LINES


@pytest.mark.parametrize("count", [1, 2, 9])
def test_long_notes_stay_within_reach(count: int, capsys: pytest.CaptureFixture[str]) -> None:
    inner = "".join(INNER.replace("inner", f"i{n}-" + "a-name-of-many-words-" * 30) for n in range(count))
    svg = placed(BOX + inner)
    drag(svg)
    svg = reshape(svg, capsys)
    told = lines(svg)
    assert len(tops(svg)) <= notes.MOST_LINES
    assert told[0].startswith("i0-a-name")
    assert told[0].endswith("\u2026")
    assert told[1:] == (
        [f"And {count - 1} more of such; a report from the command line has all."] * (count > 1)
    )


@pytest.mark.parametrize(("y", "above"), [(30, True), (2, False)], ids=["room above", "room below alone"])
def test_notes_are_on_the_page_where_it_has_room(
    y: float, above: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    box = f'<path id="box" d="M20,{y} H80 V{y + 40} H20 Z"/>'
    svg = placed(box + "".join(INNER.replace("inner", f"i{n}") for n in range(3)))
    drag(svg)
    (low, high) = (min(tops(reshape(svg, capsys))), max(tops(reshape(svg, capsys))))
    page = elements.page_of(svg)
    assert page is not None
    assert page[0, 1] < low
    assert high < page[1, 1]
    assert high < y if above else low > y + 40


def test_notes_go_with_the_next_run_with_restoring_and_with_the_handles(
    capsys: pytest.CaptureFixture[str],
) -> None:
    svg = placed(BOX + INNER)
    drag(svg)
    once = reshape(svg, capsys)
    again = reshape(once, capsys)
    assert len(lines(again)) == 1
    inner = get(again, "inner")
    inner.getparent().remove(inner)
    assert lines(reshape(again, capsys)) == []
    handle_marks.remove(once, [])
    assert (
        own_objects.groups(once, own_objects.NOTES_LABEL)
        == own_objects.groups(once, own_objects.LAYER_LABEL)
        == []
    )


def test_without_handles_there_are_no_notes(capsys: pytest.CaptureFixture[str]) -> None:
    svg = placed(BOX + INNER)
    drag(svg)
    assert b"alup:notes" not in etree.tostring(reshape(svg, capsys, "--keep_handles=false"))


def test_notes_are_in_the_users_language(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LANGUAGE", "de")
    language._catalogue.cache_clear()
    svg = placed(BOX + INNER)
    drag(svg)
    try:
        assert lines(reshape(svg, capsys, "--time_limit=0"))[1].startswith("Die Zeitgrenze")
    finally:
        language._catalogue.cache_clear()


def test_inkscape_opens_no_window_for_them(inkscape: harness.Inkscape) -> None:
    text = f'{HEAD}inkscape:version="1.2" viewBox="0 0 100 100">{BOX}{INNER}{FROM_TO}</svg>'
    run = inkscape.reshape(text)
    assert (run.code, run.stderr) == (0, "")
    assert lines(etree.parse(str(run.output)).getroot()) == [
        "inner: a drawing inside the drawing; ungroup it."
    ]
