# SPDX-License-Identifier: GPL-2.0-or-later
"""Handles outlive *Save as plain SVG*, which takes their labels."""

# XML is read more easily on one line.
# ruff: noqa: E501

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any, Callable

import inkscape as harness
import numpy as np
import pytest
from lxml import etree
from placed import INKSCAPE, LABEL, SODIPODI, arrows, centres, find, handles, load, place

from alup.document import handle_marks, place_handles, reading, restore_original, writing
from alup.document.tree import own_objects
from alup.session import pipeline

BODY = (
    '<path id="p" d="M20,60 H130 V100 H20 Z"/><circle id="c" cx="45" cy="100" r="12"/>'
    '<circle id="mine" inkscape:label="alup:pin" cx="75" cy="60" r="1"/>'
    '<circle id="a" inkscape:label="alup:from the end" cx="75" cy="100" r="1"/>'
    '<circle id="b" inkscape:label="alup:to the end" cx="75" cy="110" r="1"/>'
)


def reshape(svg: Any) -> list[str]:
    read = reading.read(svg, [], True)
    result = pipeline.reshape(read.drawing, pipeline.Options())
    return writing.write(read, result.refitted, True, 1e-3, result.report["ignored_handles"])


def without_labels(svg: Any, _: Path) -> Any:
    """As Inkscape leaves it, which was looked at: all of its own namespaces is gone."""
    for element in svg.iter(etree.Element):
        for name in list(element.attrib):
            if INKSCAPE in name or SODIPODI in name:
                del element.attrib[name]
    return svg


def by_inkscape(svg: Any, folder: Path) -> Any:
    before, after = folder / "in.svg", folder / "plain.svg"
    svg.attrib[f"{{{INKSCAPE}}}version"] = "1.2"
    before.write_bytes(etree.tostring(svg))
    command = ["inkscape", "--export-plain-svg", f"--export-filename={after}", str(before)]
    environment = harness.clean_environment(HOME=folder, TMPDIR=folder, INKSCAPE_PROFILE_DIR=folder)
    subprocess.run(command, env=environment, stdin=subprocess.DEVNULL, capture_output=True, timeout=90)
    found = etree.parse(str(after)).getroot()
    assert LABEL not in {name for element in found.iter(etree.Element) for name in element.attrib}
    return found


@pytest.fixture(params=[without_labels, by_inkscape])
def plain(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[[], Any]:
    """A drawing that was reshaped by handles of every kind and saved as plain SVG, with what it was."""

    def made() -> tuple[Any, Any]:
        svg = load(BODY, 'viewBox="0 0 200 200"')
        place(svg, "extremes", "p")
        place(svg, "section", "c")
        find(svg, "alup-handle-2").attrib["cx"] = "30"
        assert reshape(svg)
        return svg, request.param(load_again(svg), tmp_path)

    return made


def load_again(svg: Any) -> Any:
    return etree.fromstring(etree.tostring(svg))


def test_every_handle_is_known_and_none_is_placed_again(plain: Callable[[], Any]) -> None:
    svg, saved = plain()
    wanted, found = handles(svg), handles(saved)
    assert [h.kind for h in found] == [h.kind for h in wanted]
    assert [h.pair for h in found] == [h.pair for h in wanted]
    assert {"handle", "section", "pin", "from", "to"} == {h.kind for h in found}
    np.testing.assert_allclose(centres(saved), centres(svg), atol=1e-4)
    added = place_handles.place(saved, "extremes", [find(saved, "p")], ())
    assert added.added == ()
    assert added.kept >= 4


def test_all_of_it_can_be_removed(plain: Callable[[], Any]) -> None:
    _, saved = plain()
    assert arrows(saved)
    handle_marks.remove(saved, [])
    left = [
        e.get("id") for e in saved.iter(etree.Element) if e is not saved and "defs" not in e.get("id", "")
    ]
    assert left == ["p", "c"]


def test_a_run_goes_on_from_the_original(plain: Callable[[], Any]) -> None:
    svg, saved = plain()
    for one in (svg, saved):
        find(one, "alup-handle-2").attrib["cx"] = "40"
        read = reading.read(one, [], True)
        assert read.from_original == ["p"]
        assert len(read.drawing.names) == 2
        reshape(one)
    assert len(arrows(saved)) == len(arrows(svg))
    np.testing.assert_allclose(numbers(find(saved, "p")), numbers(find(svg, "p")), atol=1e-3)


@pytest.mark.parametrize(
    "back", [lambda svg: restore_original.restore(svg, []), lambda svg: restore_original.forget(svg, [svg])]
)
def test_what_alone_says_that_it_is_a_handle_stays(back: Callable[[Any], Any]) -> None:
    """Where the label is there, restoring and forgetting leave nothing of a run."""
    svg = load(BODY, 'viewBox="0 0 200 200"')
    find(svg, "b").attrib["cy"] = "115"
    assert reshape(svg)
    saved = without_labels(load_again(svg), Path())
    kinds = [h.kind for h in handles(svg)]
    for one in (svg, saved):
        back(one)
        assert [h.kind for h in handles(one)] == kinds
    assert not [e for e in svg.iter(etree.Element) if own_objects.KIND in e.attrib]


def numbers(path: Any) -> np.ndarray:
    return np.array([float(word) for word in path.get("d").replace(",", " ").split() if word[-1].isdigit()])


def test_a_layer_of_older_files_is_known_by_its_id() -> None:
    svg = load(
        '<g id="alup-handles-1"/><g id="alup-arrows-12"/><g id="alup-handles-x"/><g id="alup-handles-3" inkscape:label="mine"/>'
    )
    assert [bool(own_objects.is_group(g, own_objects.LAYER_LABEL)) for g in svg] == [
        True,
        False,
        False,
        False,
    ]
    assert [own_objects.is_ours(g) for g in svg] == [False, True, False, False]


def test_a_label_of_ones_own_is_none_of_ours() -> None:
    svg = load(
        '<circle id="c" r="3" inkscape:label="mine" alup:rest="0 0" xmlns:alup="https://alup-reshape.github.io/ns"/>'
    )
    assert not own_objects.is_ours(find(svg, "c"))
    del find(svg, "c").attrib[LABEL]
    assert own_objects.is_ours(find(svg, "c"))


def test_an_arrow_without_its_group_is_still_ours() -> None:
    svg = load(BODY, 'viewBox="0 0 200 200"')
    place(svg, "extremes", "p")
    find(svg, "alup-handle-2").attrib["cx"] = "30"
    reshape(svg)
    (arrow,) = arrows(svg)
    svg.append(arrow)
    assert own_objects.is_ours(arrow)
    assert handle_marks.remove(svg, [])
    assert arrows(svg) == []
