# SPDX-License-Identifier: GPL-2.0-or-later
"""The layer of the handles: circles and frames in it, their colours and arrows, what removing them leaves."""

# XML is read more easily on one line.
# ruff: noqa: E501

from __future__ import annotations

import numpy as np
import pytest
from documents import ALUP, INKSCAPE, LABEL, SODIPODI, SVG, get
from lxml import etree
from placed import BOX, CORNERS, arrows, assert_placed, handles, layer_of, load, place

from alup.document import handle_marks, place_handles
from alup.document.handles.handle_layer import FRAME_MOVED, FRAME_STAYS, MOVED, STAYS
from alup.document.tree import elements
from alup.document.tree.own_objects import LAYER_LABEL

CURRENT_LAYER = f"{{{INKSCAPE}}}current-layer"

# --- objects in the tree ------------------------------------------------------------------------


def test_handles_lie_in_a_layer_on_top() -> None:
    svg = load(BOX + '<g id="later"/>')
    placed = place(svg, "auto")
    layer = layer_of(svg)
    assert list(svg)[-1] is layer
    assert layer.get(f"{{{INKSCAPE}}}groupmode") == "layer"
    assert "transform" not in layer.attrib
    assert [e.get("id") for e in layer] == list(placed.added) == [f"alup-handle-{n}" for n in range(1, 5)]
    for circle in layer:
        assert etree.QName(circle).localname == "circle"
        assert circle.get(f"{{{ALUP}}}rest") == f"{circle.get('cx')} {circle.get('cy')}"
        assert circle.get(f"{{{ALUP}}}at") == circle.get(f"{{{ALUP}}}rest")
        assert f"fill:{STAYS}" in circle.attrib["style"]
        assert not any("insensitive" in name for name in circle.attrib)


def test_an_id_that_is_taken_is_not_used_again() -> None:
    svg = load(BOX.replace('id="box"', 'id="alup-handle-2"'))
    place(svg, "auto")
    ids = [e.get("id") for e in svg.iter() if e.get("id")]
    assert len(ids) == len(set(ids))


@pytest.mark.parametrize("transform", ["", "translate(30,-20) rotate(20) scale(3,0.5)"])
def test_the_layer_is_used_again(transform: str) -> None:
    svg = load(
        f'<g id="in" transform="scale(2)"><g id="mine" inkscape:groupmode="layer" inkscape:label="{LAYER_LABEL}" '
        f'sodipodi:insensitive="true" style="display:none;opacity:1" transform="{transform}"/></g>{BOX}'
    )
    place(svg, "auto")
    assert_placed(svg, CORNERS, 1e-6)
    mine = get(svg, "mine")
    assert len(mine) == 4
    assert mine.attrib["style"] == "display:inline;opacity:1"
    assert not any("insensitive" in name for name in mine.attrib)
    assert [e.get(LABEL) for e in svg].count(LAYER_LABEL) == 0


def test_a_squashed_layer_is_not_used() -> None:
    svg = load(
        f'<g id="flat" transform="scale(0)" inkscape:groupmode="layer" inkscape:label="{LAYER_LABEL}"/>{BOX}'
    )
    place(svg, "auto")
    assert_placed(svg, CORNERS)
    assert len(get(svg, "flat")) == 0


LAYERS = '<g id="lower" inkscape:groupmode="layer"><g id="inner"/></g><g id="upper" inkscape:groupmode="layer"/><g id="group"/>'
OURS = f'<g id="ours" inkscape:groupmode="layer" inkscape:label="{LAYER_LABEL}"><g id="within"/></g>'


@pytest.mark.parametrize(
    ("named", "layers", "then"),
    [
        ("lower", LAYERS, "lower"),
        ("inner", LAYERS, "inner"),
        ("drawing", LAYERS, "drawing"),
        ("ours", LAYERS, "upper"),
        ("within", LAYERS, "upper"),
        ("gone", LAYERS, "upper"),  # Inkscape would take the topmost
        ("box", LAYERS, "upper"),  # Inkscape would take the topmost here, too
        ("ours", "", "drawing"),
        (None, LAYERS, "upper"),
        (None, "", "drawing"),
    ],
)
@pytest.mark.parametrize("there", [False, True])
@pytest.mark.parametrize("where", ["auto", "section"])
def test_the_current_layer_is_never_one_of_ours(
    named: str | None, layers: str, then: str, there: bool, where: str
) -> None:
    current = f'inkscape:current-layer="{named}"' if named else ""
    body = f"<sodipodi:namedview {current}/>{layers}{BOX}{OURS if there else ''}"
    svg = load(body, 'id="drawing" viewBox="0 0 100 100"')
    place(svg, where, "box")
    (view,) = svg.iter(f"{{{SODIPODI}}}namedview")
    assert view.get(CURRENT_LAYER) == then


def test_a_drawing_without_an_id_gets_one_to_be_the_current_layer() -> None:
    svg = load(f"<sodipodi:namedview/>{BOX}", 'viewBox="0 0 100 100"')
    svg.attrib.pop("id", None)
    place(svg, "auto")
    assert svg.get("id")
    assert svg[0].get(CURRENT_LAYER) == svg.get("id")


def test_a_file_without_namespace() -> None:
    svg = etree.fromstring('<svg viewBox="0 0 100 100"><path id="box" d="M20,30 H80 V70 H20 Z"/></svg>')
    place_handles.place(svg, "auto", [], [])
    assert [e.tag for e in svg[-1]] == ["circle"] * 4
    assert_placed(svg, CORNERS)


def test_a_section_is_a_frame() -> None:
    svg = load(BOX + '<path id="q" d="M0,0 L5,95"/>')
    assert place(svg, "section", "box").added == ("alup-section-1",)
    (frame,) = handles(svg)
    margin = 0.5 * 0.0075 * np.hypot(80, 95)
    assert frame.bounds == pytest.approx(np.array([[20, 30], [80, 70]]) + np.array([[-margin], [margin]]))
    assert frame.rest == pytest.approx(frame.corners)
    assert "fill:none" in frame.element.attrib["style"]
    assert place(svg, "section", "box") == place_handles.Placed((), 1)


# --- colours and arrows -------------------------------------------------------------------------


def test_a_frame_lies_below_the_circles() -> None:
    """Above them it would cover a circle that is to be dragged or deleted."""
    svg = load(BOX)
    place(svg, "auto")
    place(svg, "section", "box")
    tags = [etree.QName(element).localname for element in layer_of(svg)]
    assert tags == ["rect", *["circle"] * (len(tags) - 1)]
    handle_marks.arrows(svg, handles(svg))
    place(svg, "section", "box")
    assert etree.QName(layer_of(svg)[-1]).localname == "circle"


def test_moved_handles_turn_blue_and_back() -> None:
    svg = load(BOX + '<circle id="mine" inkscape:label="alup:pin" cx="50" cy="30" r="1" style="fill:green"/>')
    place(svg, "auto")
    handle_marks.recolour(handles(svg))
    assert etree.tostring(svg).count(STAYS.encode()) == 4
    circle = get(svg, "alup-handle-3")
    circle.attrib["transform"] = "translate(5,0)"
    handle_marks.recolour(handles(svg))
    assert f"fill:{MOVED};stroke:#ffffff" in circle.attrib["style"]
    assert etree.tostring(svg).count(STAYS.encode()) == 3
    del circle.attrib["transform"]
    handle_marks.recolour(handles(svg))
    assert etree.tostring(svg).count(STAYS.encode()) == 4
    assert get(svg, "mine").attrib["style"] == "fill:green"


def test_a_moved_frame_changes_its_colour() -> None:
    svg = load(BOX)
    place(svg, "section", "box")
    handle_marks.recolour(handles(svg))
    frame = get(svg, "alup-section-1")
    assert FRAME_STAYS in frame.attrib["style"]
    frame.attrib["width"] = "70"
    handle_marks.recolour(handles(svg))
    assert FRAME_MOVED in frame.attrib["style"]
    # As older versions drew it.
    frame.attrib["style"] = frame.attrib["style"].replace(FRAME_MOVED, STAYS)
    handle_marks.recolour(handles(svg))
    assert FRAME_MOVED in frame.attrib["style"]


@pytest.mark.parametrize("transform", ["", "translate(30,-20) scale(3)"])
def test_an_arrow_leads_to_each_moved_handle(transform: str) -> None:
    svg = load(f'<g inkscape:groupmode="layer" inkscape:label="{LAYER_LABEL}" transform="{transform}"/>{BOX}')
    place(svg, "auto")
    before = etree.tostring(svg)
    handle_marks.arrows(svg, handles(svg))
    assert etree.tostring(svg) == before  # nothing moved, nothing drawn
    circle = get(svg, "alup-handle-2")
    there = circle.attrib["cx"]
    circle.attrib["cx"] = str(float(there) + 10)
    for _ in range(2):  # drawn again, not added
        handle_marks.arrows(svg, handles(svg))
        (arrow,) = arrows(svg)
    handle = next(h for h in handles(svg) if h.name.startswith("alup-handle-2"))
    assert arrow.get(f"{{{ALUP}}}arrow") == "alup-handle-2"
    shape = elements.read_shape(arrow, (elements.parent_matrix(arrow) @ elements.own_matrix(arrow))[:2])
    points = shape.control[:, 0]
    assert np.linalg.norm(points - handle.centre, axis=1).min() == pytest.approx(handle.radius, rel=1e-6)
    assert handle.rest is not None
    assert np.linalg.norm(points - handle.rest, axis=1).min() < 0.5 * handle.radius
    group = arrow.getparent()
    assert group.get(LABEL) == "alup:arrows"
    assert group.get(f"{{{SODIPODI}}}insensitive") == "true"
    assert list(layer_of(svg)).index(group) == 0  # below the circles
    circle.attrib["cx"] = there
    handle_marks.arrows(svg, handles(svg))
    assert etree.tostring(svg) == before


def test_arrows_are_no_handles_and_get_none() -> None:
    svg = load(BOX)
    place(svg, "auto")
    get(svg, "alup-handle-2").attrib["cx"] = "95"
    handle_marks.arrows(svg, handles(svg))
    assert len(arrows(svg)) == 1
    assert len(handles(svg)) == 4
    assert place(svg, "extremes") == place_handles.Placed((), 4)  # the arrow's tip is no extreme


# --- removing -----------------------------------------------------------------------------------


def test_removing_restores_the_drawing() -> None:
    svg = load(f"\n  {BOX}\n  <!-- a note -->\n")
    before = etree.tostring(svg)
    place(svg, "auto")
    place(svg, "section", "box")
    get(svg, "alup-handle-2").attrib["cx"] = "95"
    handle_marks.arrows(svg, handles(svg))
    assert handle_marks.remove(svg, []) == 5
    assert etree.tostring(svg) == before
    assert handle_marks.remove(svg, []) == 0


def test_only_the_selected_ones_go_with_their_arrows_and_partners() -> None:
    pair = "".join(
        f'<circle id="{end}" inkscape:label="alup:{end} A" cx="50" cy="30" r="1"/>' for end in ("from", "to")
    )
    svg = load(BOX + pair)
    place(svg, "auto")
    for identity in ("alup-handle-2", "alup-handle-3"):
        get(svg, identity).attrib["cx"] = "95"
    handle_marks.arrows(svg, handles(svg))
    assert handle_marks.remove(svg, [get(svg, "alup-handle-2"), get(svg, "to"), get(svg, "box")]) == 3
    left = {e.get("id") for e in svg.iter()}
    assert {"alup-handle-1", "alup-handle-3", "alup-handle-4", "box"} <= left
    assert not {"alup-handle-2", "to", "from"} & left
    assert [e.get(f"{{{ALUP}}}arrow") for e in arrows(svg)] == ["alup-handle-3"]


def test_a_layer_that_holds_something_else_stays() -> None:
    svg = load(BOX)
    place(svg, "auto")
    layer_of(svg).append(etree.fromstring(f'<path xmlns="{SVG}" id="note" d="M1,1 H2"/>'))
    handle_marks.remove(svg, [])
    assert [e.get("id") for e in layer_of(svg)] == ["note"]


def test_an_arrow_whose_handle_was_deleted_by_hand_goes_with_the_rest() -> None:
    svg = load(BOX)
    before = etree.tostring(svg)
    place(svg, "auto")
    circle = get(svg, "alup-handle-2")
    circle.attrib["cx"] = "95"
    handle_marks.arrows(svg, handles(svg))
    circle.getparent().remove(circle)
    assert handle_marks.remove(svg, []) == 3
    assert etree.tostring(svg) == before


def test_handles_of_any_label_can_be_removed() -> None:
    svg = load(BOX + '<text id="odd" inkscape:label="alup:what">x</text>')
    assert handle_marks.remove(svg, []) == 1
