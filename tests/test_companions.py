# SPDX-License-Identifier: GPL-2.0-or-later
"""Texts, images and clones follow the shapes around them; everything else in a document is unchanged."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import inkex
import numpy as np
import pytest
from builders import Array, Point
from companions import (
    AWAY,
    CLIP,
    CLIPPED,
    CORNERS,
    FILLED,
    GRADIENT,
    HEAD,
    IMAGE,
    LARGER,
    RECT,
    TEXT,
    WIDER,
    Map,
    Run,
    handles,
    load,
    mapped,
    run,
)
from documents import INKSCAPE, SODIPODI, SVG, control_of, get
from lxml import etree

from alup.document import reading
from alup.document.tree import elements
from alup.messages.errors import DocumentError
from alup.svg import path_data

ROOT = Path(__file__).resolve().parents[1]
STORED = {f"{{https://alup-reshape.github.io/ns}}{name}" for name in ("original", "written")}


# --- texts, images, clones ----------------------------------------------------------------------


def placed(element: Any, *at: Point) -> Array:
    matrix = elements.parent_matrix(element) @ elements.own_matrix(element)
    return np.array(at) @ matrix[:2, :2].T + matrix[:2, 2]


@pytest.mark.parametrize("move", [LARGER, AWAY])
@pytest.mark.parametrize("what", [TEXT.format(""), TEXT.format('transform="rotate(7) scale(2,3)"'), IMAGE])
def test_texts_and_images_move_with_what_surrounds_them(what: str, move: Map) -> None:
    body = RECT.format("") + f'<g id="n" transform="translate(3,1) skewX(9)">{what}</g>'
    before = load(body, move)
    identity = "i" if "image" in what else "t"
    at = ((50, 55), (80, 45), (20, 11))
    wanted = move(placed(get(before, identity), *at))
    done = Run(before, f"r {identity}")
    np.testing.assert_allclose(placed(done[identity], *at), wanted, atol=1e-2)
    assert identity in done.changed
    assert done.skipped == []


def test_texts_and_images_stay_and_are_named_when_nothing_moves_along() -> None:
    done = run(RECT.format("") + TEXT.format("") + IMAGE, "r t i", AWAY, tandem=False)
    assert done.skipped == ["t", "i"]
    assert done["t"].attrib.get("transform") is None
    assert done["i"].attrib.get("transform") == "rotate(10)"


def test_a_text_in_a_stretched_shape_is_not_distorted() -> None:
    below = '<path id="b" d="M 20,140 H 120 V 200 H 20 Z"/>'  # this shape must not lift the text
    at = (*CORNERS, (20, 140), (120, 140), (120, 200), (20, 200))
    done = run(RECT.format("") + TEXT.format("") + below, "r t b", WIDER, points=at)
    box = done.read.carried[0].box
    middle = (box.min(axis=0) + box.max(axis=0)) / 2.0
    np.testing.assert_allclose(placed(done["t"], middle)[0], WIDER(middle), atol=1e-3)
    matrix = elements.own_matrix(done["t"])
    assert matrix[0, 0] == matrix[1, 1]
    assert 1.0 < matrix[0, 0] < 3.0
    assert not matrix[0, 1] and not matrix[1, 0]


def test_a_text_of_unknown_size_is_only_shifted() -> None:
    done = run(RECT.format("") + TEXT.replace("12", "2em").format(""), "r t", LARGER)
    matrix = elements.own_matrix(done["t"])
    np.testing.assert_array_equal(matrix[:2, :2], np.eye(2))
    np.testing.assert_allclose(matrix[:2, 2], LARGER(np.array([50, 55])) - (50, 55), atol=1e-2)


@pytest.mark.parametrize(("size", "known"), [("", 16.0), ("font-size:large", 19.2), ("font-size:12pt", 16.0)])
def test_a_text_without_a_size_in_numbers_grows_too(size: str, known: float) -> None:
    """Programs draw it at their default size, so it has a size."""
    done = run(RECT.format("") + f'<text id="t" x="50" y="55" style="{size}">word</text>', "r t", LARGER)
    matrix = elements.own_matrix(done["t"])
    assert np.ptp(done.read.carried[0].box[:, 1]) == pytest.approx(0.95 * known)
    grown = (LARGER(np.array([1.0, 0])) - LARGER(np.array([0.0, 0])))[0]
    assert matrix[0, 0] == matrix[1, 1] == pytest.approx(grown, abs=1e-4)


def test_a_text_along_a_reshaped_path_follows_by_itself() -> None:
    text = '<text id="t"><textPath xlink:href="#r">around</textPath></text>'
    done = run(RECT.format("") + text, "r t", AWAY)
    assert done["t"].attrib.get("transform") is None
    assert done.skipped == []


def test_clones_of_reshaped_originals_follow_and_others_are_named() -> None:
    clones = (
        '<use id="u" xlink:href="#r" y="100"/><use id="uu" xlink:href="#u" x="9"/>'
        '<path id="o" d="M 0,0 H 9"/><use id="v" xlink:href="#o"/><use id="w" xlink:href="#nothing"/>'
    )
    done = run(RECT.format("") + clones, "r u uu v w", AWAY)
    assert done.skipped == ["w"]
    assert all("Unlink Clone" in entry["why"] for entry in done.read.skipped)
    assert etree.tostring(done["u"]).count(b"transform") == 0
    np.testing.assert_allclose(elements.own_matrix(done["v"])[:2, 2], [150.0, 70.0], atol=1e-3)


# --- documents as they are ----------------------------------------------------------------------


def test_stars_become_plain_paths() -> None:
    star = (
        '<path id="r" sodipodi:type="star" sodipodi:sides="4" sodipodi:cx="70" inkscape:rounded="0" '
        'inkscape:flatsided="true" sodipodi:insensitive="true" d="M 20,20 H 120 V 80 H 20 Z"/>'
    )
    done = run(star, move=AWAY)
    assert set(done["r"].attrib) - STORED == {"id", "d", f"{{{SODIPODI}}}insensitive"}
    still = run(star)
    assert f"{{{SODIPODI}}}type" in still["r"].attrib


@pytest.mark.parametrize("on_group", [False, True])
def test_live_effects_are_flattened(on_group: bool) -> None:
    effect = 'inkscape:path-effect="#e"'
    mine, group = ("", effect) if on_group else (effect, "")
    body = (
        '<defs><inkscape:path-effect id="e" effect="skeletal"/></defs>'
        f'<g id="n" {group}><!-- a word -->'
        f'<path id="r" {mine} inkscape:original-d="M 0,0 H 9" d="M 20,20 H 120 V 80 H 20 Z"/>'
        f'<path id="o" {mine} inkscape:original-d="M 0,0 H 9" d="M 0,0 V 9"/></g>'
    )
    done = run(body, move=AWAY)
    assert set(done["r"].attrib) - STORED == {"id", "d"}
    assert f"{{{INKSCAPE}}}path-effect" not in done["n"].attrib
    # The other path loses the effect only if it was the group's.
    assert (f"{{{INKSCAPE}}}original-d" in done["o"].attrib) is not on_group
    assert done["e"].get("effect") == "skeletal"


@pytest.mark.parametrize(
    ("sheet", "attributes", "wanted"),
    [
        ("rect { fill: #0a0; stroke:red }", "", {"fill": "#0a0", "stroke": "red"}),
        ("rect { fill: #0a0 }", 'style="fill:blue"', {"fill": "blue"}),
        ("rect { fill: #0a0 ! important }", 'style="fill:blue"', {"fill": "#0a0 !important"}),
        ("path { fill: red } g { fill: green }", 'fill="blue"', {"fill": "blue"}),
        ("path { fill: red !important; opacity: 0.5 }", "", {"fill": "inherit !important", "opacity": "1"}),
        ("rect { fill: red } rect { fill: #0a0 }", "", {"fill": "#0a0"}),
        ("g rect { fill: #0a0 } rect { fill: red }", "", {"fill": "#0a0"}),
        ("g > rect, text { fill: #0a0 }", 'fill="blue"', {"fill": "#0a0"}),
        ("@media print { rect {fill: red} } /* rect {fill: red} */ rect.a:hover {fill:red}", 'class="a"', {}),
        ("#r { fill: #0a0 } .a { stroke: red } * { opacity: 0.5 }", 'class="b a"', {}),
    ],
)  # fmt: skip
def test_rules_for_the_old_tag_go_on_to_colour_the_path(sheet: str, attributes: str, wanted: dict) -> None:
    done = run(f"<style>{sheet}</style><g>{RECT.format(attributes)}</g>", move=WIDER)
    assert done["r"].tag == f"{{{SVG}}}path"
    style = done["r"].attrib.get("style") or ""
    found = dict(part.split(":") for part in style.split(";") if part)
    if attributes.startswith("fill"):
        found.setdefault("fill", done["r"].get("fill"))
    assert found == wanted


def test_rules_reach_elements_with_a_prefix() -> None:
    text = f"{HEAD}<style>rect {{fill:#0a0}}</style>{RECT.format('')}{handles(WIDER)}</svg>"
    text = re.sub(r"<(/?)(svg|rect|circle|style)", r"<\1s:\2", text.replace("xmlns=", "xmlns:s="))
    root = inkex.load_svg(io.BytesIO(text.encode())).getroot()
    done = Run(root, "r")
    assert (done["r"].tag, done["r"].attrib.get("style")) == (f"{{{SVG}}}path", "fill:#0a0")


def test_elements_hidden_by_a_style_sheet_are_not_reshaped() -> None:
    style = "<style>.n {display:none} .h {visibility:hidden} .s {visibility:visible}</style>"
    shapes = (
        '<path id="a" class="n" d="M 0,0 H 9"/><g class="h"><path id="b" d="M 0,0 H 9"/>'
        '<path id="v" class="s" d="M 30,30 H 90"/></g>'
    )
    whole = reading.read(load(style + RECT.format("") + shapes), [], False)
    assert [shape.name for shape in whole.shapes] == ["r", "v"]


@pytest.mark.parametrize("head", [HEAD, HEAD.replace(f'xmlns="{SVG}" ', "")], ids=["svg", "no namespace"])
def test_no_ids_and_no_namespace(head: str) -> None:
    body = f"<defs>{GRADIENT}{CLIP}</defs>" + CLIPPED.replace('id="r"', 'fill="url(#g)"')
    root = load(body, AWAY, head=head)
    done = Run(root, "")
    name = "path" if head is not HEAD else f"{{{SVG}}}path"
    # The handles are read and are no shapes.
    paths = [element for element in root.iter() if element.tag == name]
    assert len(paths) == 2
    drawn = next(path for path in paths if path.get("fill"))
    np.testing.assert_allclose(control_of(drawn)[:, 0], np.array(CORNERS) + (150, 70), atol=1e-3)
    np.testing.assert_allclose(mapped(done["g"], (20, 50)), [(170, 120)], atol=1e-3)


def test_of_two_elements_with_one_id_the_first_is_meant() -> None:
    second = GRADIENT.replace("userSpaceOnUse", "objectBoundingBox")
    root = load(f"<defs>{GRADIENT}{second}</defs>{FILLED}", WIDER)
    Run(root, "r")
    first, last = root.findall(f".//{{{SVG}}}linearGradient")
    assert first.attrib.get("gradientTransform") is not None
    assert last.attrib.get("gradientTransform") is None


def test_units_of_shapes() -> None:
    mm = 25.4 / 96.0
    rect = f'<rect id="r" x="5%" y="{20 * mm}mm" width="25%" height="20%"/><circle id="k" r="10%"/>'
    done = run(rect, "r k", AWAY, points=(*CORNERS, (0, -np.hypot(400, 300) / np.sqrt(2) / 10)))
    np.testing.assert_allclose(control_of(done["r"])[:, 0], np.array(CORNERS) + (150, 70), atol=1e-3)


BAD = 'gradientTransform="rotate(1)x"'
WRONG = 'gradientTransform="rotate(1,2,3,4)"'


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ('<rect id="r" x="2em" width="9" height="9"/>', "r: its x is '2em'"),
        ('<svg id="n" viewBox="0 0 9 9"><rect id="r" width="9" height="9"/></svg>', "r lies in n"),
        (f"<defs>{CLIP.replace('40', '2em')}</defs>{CLIPPED}", "cr: its x is '2em'"),
        (f"<defs>{GRADIENT.replace('x1', BAD + ' x1')}</defs>{FILLED}", "The gradientTransform of g"),
        (f"<defs>{GRADIENT.replace('x1', WRONG + ' x1')}</defs>{FILLED}", "The gradientTransform of g"),
    ],
)  # fmt: skip
def test_refusals_are_one_sentence_and_change_nothing(body: str, words: str) -> None:
    root = load(body, AWAY)
    before = etree.tostring(root)
    with pytest.raises(DocumentError) as raised:
        Run(root, "r")
    assert words in str(raised.value)
    assert etree.tostring(root) == before


def test_a_drawing_within_the_drawing_is_named() -> None:
    inner = '<svg id="n" viewBox="0 0 9 9"><rect width="9" height="9"/></svg>'
    done = Run(load(RECT.format("") + inner, AWAY), "")
    assert done.skipped == ["n"]
    assert "ungroup" in done.read.skipped[0]["why"]


# Open and closed subpaths in one path, a lone node, repeated nodes, z with and without a closing line.
ODD = (
    "M 20,20 L 120,20 L 120,20 L 120,80 L 20,80 L 20,20 Z M 30,30 M 40,40 C 50,30 60,50 70,40 L 70,40 "
    "M 90,40 h 10 v 10 z M 30,60 L 30.0000001,60 L 40,70 Z M 80,60 Z"
)


def test_structure_markers_dashes_and_widths_survive() -> None:
    style = "stroke-width:3;stroke-dasharray:4,2;marker-end:url(#k);vector-effect:non-scaling-stroke"
    types = "c" * 20
    path = f'<path id="r" style="{style}" d="{ODD}" sodipodi:nodetypes="{types}"/>'
    body = f'<defs><marker id="k"/></defs>{path}'
    done = run(body, move=AWAY)
    assert done["r"].attrib.get("style") == style
    before, after = path_data.parse(ODD), path_data.parse(done["r"].get("d"))
    assert [s.closed for s in after] == [s.closed for s in before]
    assert [list(s.kind) for s in after] == [list(s.kind) for s in before]
    for old, new in zip(before, after):
        np.testing.assert_allclose(new.start, old.start + (150, 70), atol=1e-4)
        np.testing.assert_allclose(new.control, old.control + (150, 70), atol=1e-4)


BOTH = RECT.format('class="c" style="stroke:url(#g)"')
EVERYTHING = (
    "<!-- made by hand --><style>rect {fill:#0a0} .c {clip-path:url(#c)}</style>"
    f'<defs>{GRADIENT}{CLIP}<mask id="m"><rect width="90" height="90" fill="url(#g)"/></mask></defs>'
    '<g id="n" mask="url(#m)" transform="rotate(0.12345678901)" style=" fill : red ;; ">'
    f"{BOTH} tail "
    f'<path id="o" d="{ODD}" inkscape:original-d="M 0,0" inkscape:path-effect="#e" fill="url(#g)"/>'
    f'</g>{TEXT.format("")}{IMAGE}<use id="u" xlink:href="#r"/>'
)


@pytest.mark.parametrize("ids", ["", "r", "n t i u"])
@pytest.mark.parametrize("tandem", [True, False])
def test_no_handle_moved_leaves_the_document_to_the_letter(ids: str, tandem: bool) -> None:
    turn = inkex.Transform("rotate(0.12345678901)")
    at = [(float(p.x), float(p.y)) for p in (turn.apply_to_point(corner) for corner in CORNERS)]
    root = load(EVERYTHING, points=at)
    before = etree.tostring(root)
    done = Run(root, ids, tandem)
    assert done.changed == []
    assert etree.tostring(root) == before


def test_a_failure_while_writing_leaves_the_document_to_the_letter(monkeypatch: pytest.MonkeyPatch) -> None:
    from alup.document import writing

    root = load(EVERYTHING, AWAY)
    before = etree.tostring(root)
    calls = []

    def fail_at_the_last(*given: Any) -> Any:
        calls.append(given)
        if len(calls) == 4:
            raise ZeroDivisionError
        return real(*given)

    real = writing._new_data
    monkeypatch.setattr(writing, "_new_data", fail_at_the_last)
    with pytest.raises(ZeroDivisionError):
        Run(root, "")
    assert etree.tostring(root) == before
