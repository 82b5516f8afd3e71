"""Place handles and Remove handles: what is in the tree afterwards, what a run makes of it, what is refused."""

# XML is read more easily on one line.
# ruff: noqa: E501

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import inkscape as harness
import numpy as np
import pytest
from inkex import load_svg
from lxml import etree

from alup.document import marks, placing
from alup.document.guides import guides
from alup.document.layer import LAYER_LABEL, MOVED, STAYS, is_moved
from alup.errors import AlupError

ROOT = Path(__file__).resolve().parents[1]
SVG = "http://www.w3.org/2000/svg"
INKSCAPE = "http://www.inkscape.org/namespaces/inkscape"
SODIPODI = "http://sodipodi.sourceforge.net/DTD/sodipodi-0.dtd"
ALUP = "https://alup-reshape.github.io/ns"
LABEL = f"{{{INKSCAPE}}}label"

HEAD = (
    f'<svg xmlns="{SVG}" xmlns:xlink="http://www.w3.org/1999/xlink" xmlns:inkscape="{INKSCAPE}" '
    f'xmlns:sodipodi="{SODIPODI}" '
)
BOX = '<path id="box" d="M20,30 H80 V70 H20 Z"/>'


def load(body: str, root: str = 'viewBox="0 0 100 100"') -> Any:
    return load_svg(f"{HEAD}{root}>{body}</svg>").getroot()


def find(svg: Any, identity: str) -> Any:
    return next(e for e in svg.iter() if e.get("id") == identity)


def place(svg: Any, where: str, *selected: str, nodes: tuple[str, ...] = ()) -> placing.Placed:
    return placing.place(svg, where, [find(svg, identity) for identity in selected], nodes)


def handles(svg: Any) -> list[marks.HandleObject]:
    return [marks.read_handle(element, label) for element, label in marks.labelled(svg)]


def centres(svg: Any) -> np.ndarray:
    return np.array([handle.centre for handle in handles(svg)])


def assert_placed(svg: Any, wanted: object, within: float = 1e-6) -> None:
    """The handles stand, at rest, on the wanted points, whatever their order."""
    found, points = centres(svg), np.asarray(wanted, dtype=float)
    assert len(found) == len(points), found
    away = np.linalg.norm(found[:, None] - points[None], axis=2)
    assert away.min(axis=0).max() <= within
    assert away.min(axis=1).max() <= within
    for handle in handles(svg):
        assert handle.rest == pytest.approx(handle.centre, abs=1e-9)
        assert handle.kind == "handle"


CORNERS = [[20, 30], [80, 30], [80, 70], [20, 70]]

# --- places in root user units --------------------------------------------------------------------------


def test_extremes_of_the_selection_as_a_whole() -> None:
    svg = load(BOX + '<path id="top" d="M40,30 L50,10 L60,30 Z"/><path id="far" d="M0,0 H99"/>')
    assert len(place(svg, "extremes", "box", "top").added) == 5
    assert_placed(svg, [*CORNERS, [50, 10]])


@pytest.mark.parametrize(
    ("root", "before"),
    [
        ('width="210mm" height="297mm" viewBox="0 0 210 297"', ""),
        ('width="400" height="100" viewBox="-50 20 200 50" preserveAspectRatio="none"', ""),
        ('width="10cm" height="10cm"', ""),
        ('viewBox="0 0 100 100"', "translate(5,6) rotate(90) scale(2,3)"),
        ('viewBox="0 0 100 100"', "matrix(1,.5,-.3,2,7,8)"),
    ],
)
def test_handles_are_in_the_units_of_the_root(root: str, before: str) -> None:
    """Whatever the page's units, and after all transforms of groups."""
    outer = f'<g transform="{before}"><g transform="scale(2) translate(1,-1)">' if before else "<g><g>"
    svg = load(f'{outer}<path id="box" transform="translate(3,4)" d="M20,30 L80,35 L50,70 Z"/></g></g>', root)
    place(svg, "corners", "box")
    matrix = np.eye(3)
    element = find(svg, "box")
    while element is not svg:
        matrix = marks.own_matrix(element) @ matrix
        element = element.getparent()
    points = np.array([[20, 30], [80, 35], [50, 70]])
    assert_placed(svg, points @ matrix[:2, :2].T + matrix[:2, 2])


def test_groups_are_walked_and_what_is_not_seen_is_left_out() -> None:
    svg = load(
        f'<g id="all"><path d="M0,0 H100 V100 H0 Z" fill="none" stroke="none"/>{BOX}</g>'
        '<path d="M-50,-50 H300" style="display:none"/>'
    )
    place(svg, "auto", "all")
    assert_placed(svg, CORNERS)
    assert handles(svg)[0].radius == pytest.approx(0.0075 * np.hypot(60, 40))


def test_what_is_selected_gets_handles_though_it_is_not_seen() -> None:
    svg = load(BOX.replace("/>", ' style="fill:none;stroke:black;stroke-opacity:0"/>'))
    place(svg, "auto", "box")
    assert_placed(svg, CORNERS)


def test_nothing_selected_or_only_handles_is_everything() -> None:
    svg = load(BOX)
    place(svg, "auto")
    assert_placed(svg, CORNERS)
    svg.append(etree.fromstring(f'<path xmlns="{SVG}" d="M90,95 L91,96"/>'))
    place(svg, "auto", "alup-handle-1")
    assert len(centres(svg)) == 4 + 1  # the lowest point is the rightmost one


def test_the_radius_suits_the_drawing_and_what_is_selected() -> None:
    svg = load(BOX.replace("H80", "H60") + '<path id="dot" d="M5,5 h1 v1 Z"/>')
    place(svg, "auto", "box")
    whole = np.hypot(60 - 5, 70 - 5)
    assert handles(svg)[0].radius == pytest.approx(0.0075 * whole)
    placing.remove(svg, [])
    place(svg, "auto", "dot")
    assert handles(svg)[0].radius == pytest.approx(0.03 * np.sqrt(2.0))


def test_corners_that_a_handle_would_cover_get_one() -> None:
    svg = load('<path id="p" d="M0,0 H100 V99.5 L99.5,100 H0 Z"/>')
    place(svg, "corners")
    assert len(centres(svg)) == 4


def test_too_many_corners_are_refused() -> None:
    teeth = "".join(f'<path id="p{n}" d="M{n % 20},{n // 20} l.5,.5 v-.5"/>' for n in range(200))
    svg = load(teeth)
    with pytest.raises(AlupError, match=r"have \d\d\d corners.*Select fewer"):
        place(svg, "corners")


# --- guides ---------------------------------------------------------------------------------------------


def guide(position: str, orientation: str) -> str:
    return f'<sodipodi:guide id="g" position="{position}" orientation="{orientation}"/>'


def with_guides(*lines: str) -> str:
    return f"<sodipodi:namedview>{''.join(lines)}</sodipodi:namedview>{BOX}"


def test_guides_count_from_the_bottom_of_the_page() -> None:
    svg = load(with_guides(guide("0,60", "0,1"), guide("50,0", "1,0")), 'width="100" height="100"')
    place(svg, "guides")
    assert_placed(svg, [[20, 40], [80, 40], [50, 30], [50, 70]])


def test_a_slanted_guide() -> None:
    # through (20, 30), rising to the right on the page: x + y = 50 in root units
    svg = load(with_guides(guide("20,70", "-1,1")), 'width="100" height="100"')
    place(svg, "guides")
    assert_placed(svg, [[20, 30]])
    svg = load(with_guides(guide("50,50", "1,1")), 'width="100" height="100"')
    place(svg, "guides")  # falling to the right: y = x
    assert_placed(svg, [[30, 30], [70, 70]])


@pytest.mark.parametrize(
    "root",
    [
        'width="200mm" height="100mm" viewBox="0 0 200 100"',
        'width="400" height="200" viewBox="10 -20 200 100"',
        'viewBox="10 -20 200 100"',
        'width="100%" height="100%" viewBox="10 -20 200 100"',
    ],
)
def test_guides_are_in_units_of_the_view_box(root: str) -> None:
    x, y = (10, -20) if "10 -20" in root else (0, 0)
    svg = load(with_guides(guide(f"{50 - x},0", "1,0"), guide(f"0,{100 + y - 40}", "0,200")), root)
    place(svg, "guides")
    assert_placed(svg, [[50, 30], [50, 70], [20, 40], [80, 40]])


# Sides of a rectangle from (20, 30) to (60, 80), as the action object-to-guides of Inkscape 1.2.2 wrote them.
MADE_BY_INKSCAPE = {
    'width="210mm" height="297mm" viewBox="0 0 210 297"': [
        ("20,267", "188.97638,0"), ("20,217", "0,151.1811"), ("60,217", "-188.97638,0"), ("60,267", "0,-151.1811"),
    ],
    'width="400" height="300" viewBox="-50 20 200 150"': [
        ("70,140", "100,0"), ("70,90", "0,80"), ("110,90", "-100,0"), ("110,140", "0,-80"),
    ],
    'width="400" height="300" viewBox="10 -20 100 200"': [
        ("35,150", "75,0"), ("35,100", "0,60"), ("50,100", "-75,0"), ("50,150", "0,-60"),
    ],
    'width="400" height="300" viewBox="10 -20 100 200" preserveAspectRatio="none"': [
        ("10,150", "75,0"), ("10,100", "0,160"), ("50,100", "-75,0"), ("50,150", "0,-160"),
    ],
    'width="400" height="300" viewBox="10 -20 100 200" preserveAspectRatio="xMaxYMin slice"': [
        ("10,66.666667", "200,0"), ("10,-66.666667", "0,160"), ("50,-66.666667", "-200,0"), ("50,66.666667", "0,-160"),
    ],
}  # fmt: skip


@pytest.mark.parametrize(("root", "written"), MADE_BY_INKSCAPE.items())
def test_guides_that_inkscape_has_made_of_a_rectangle(root: str, written: list[tuple[str, str]]) -> None:
    lines = "".join(guide(*line) for line in written)
    found = guides(load(f"<sodipodi:namedview>{lines}</sodipodi:namedview>", root))
    corners = np.array([[20, 30], [60, 30], [60, 80], [20, 80]])
    for start, end in zip(corners, np.roll(corners, -1, axis=0)):
        away = [
            np.abs((np.stack([start, end]) - point) @ [-direction[1], direction[0]]).max()
            / np.hypot(*direction)
            for point, direction in found
        ]
        assert min(away) < 1e-4


def test_guides_on_a_page_of_other_proportions() -> None:
    # the drawing is 100 x 200 in the middle of 400 x 300: scale 1.5, 125 pixels at the left
    svg = load(
        f"<sodipodi:namedview>{guide('35,0', '1,0')}</sodipodi:namedview>",
        'width="400" height="300" viewBox="10 -20 100 200"',
    )
    ((point, direction),) = guides(svg)
    assert point[0] == pytest.approx(10 + (35 * 4 - 125) / 1.5)
    assert direction[0] == 0.0
    svg.set("preserveAspectRatio", "none")
    assert guides(svg)[0][0][0] == pytest.approx(45.0)
    svg.set("preserveAspectRatio", "xMaxYMin slice")  # scale 4, the lower 500 of 800 pixels cut off
    assert guides(svg)[0][0] == pytest.approx([10 + 35 * 4 / 4.0, -20 + 300 / 4.0])
    svg.set("preserveAspectRatio", "xMaxYMin")
    assert guides(svg)[0][0] == pytest.approx([10 + (35 * 4 - 250) / 1.5, 180])


def test_crossings_of_near_guides_don_t_overlap() -> None:
    near = 1.5 * 0.0075 * np.hypot(60, 40)
    svg = load(with_guides(guide("50,0", "1,0"), guide(f"{50 + near},0", "1,0")), 'width="100" height="100"')
    place(svg, "guides")
    assert_placed(svg, [[50, 30], [50, 70]])


def test_old_guides() -> None:
    svg = load(with_guides(guide("60", "horizontal"), guide("50", "vertical")), 'width="100" height="100"')
    place(svg, "guides")
    assert_placed(svg, [[20, 40], [80, 40], [50, 30], [50, 70]])


@pytest.mark.parametrize(
    ("root", "line", "words"),
    [
        ("", ("0,60", "0,1"), ("page has no size", "Document Properties")),
        ('width="100"', ("0,60", "0,1"), ("page has no size",)),
        ('width="0" height="9" viewBox="0 0 9 9"', ("0,60", "0,1"), ("page has no size",)),
        ('height="100" viewBox="0 0 100"', ("0,60", "0,1"), ("viewBox", "0 0 100", "XML editor")),
        ('viewBox="0 0 0 100"', ("0,60", "0,1"), ("viewBox",)),
        ('viewBox="0 0 inf 100"', ("0,60", "0,1"), ("viewBox",)),
        ('viewBox="nan 0 9 100"', ("0,60", "0,1"), ("viewBox",)),
        ('viewBox="none"', ("0,60", "0,1"), ("viewBox",)),
        ('width="9" height="9"', ("0,60", "0,0"), ("orientation of the guide g", "Delete the guide")),
        ('width="9" height="9"', ("0", "0,1"), ("position of the guide g", "(0)")),
        ('width="9" height="9"', ("inf,0", "0,1"), ("position of the guide g",)),
        ('width="9" height="9"', ("one", "vertical"), ("position of the guide g", "(one)")),
    ],
)
def test_guides_that_lead_nowhere_are_refused(root: str, line: tuple[str, str], words: tuple[str]) -> None:
    svg = load(with_guides(guide(*line)), root)
    before = etree.tostring(svg)
    with pytest.raises(AlupError) as refused:
        place(svg, "guides")
    assert all(word in str(refused.value) for word in words)
    assert etree.tostring(svg) == before


# --- nodes ----------------------------------------------------------------------------------------------


def test_nodes_by_subpath_and_position() -> None:
    svg = load(
        '<g transform="scale(2)"><path id="a:b" d="M1,1 Z M10,10 H20 V20 H10 Z M12,12 L14,18 L13,12"/></g>'
    )
    place(svg, "auto", "a:b", nodes=("a:b:1:2", "a:b:0:3", "a:b:0:0"))
    assert_placed(svg, [[26, 24], [20, 40], [20, 20]])


def test_nodes_of_several_paths_whatever_is_selected() -> None:
    svg = load(BOX + '<path id="q" d="M0,0 L5,95"/>')
    place(svg, "nodes", nodes=("q:0:1", "box:0:2"))
    assert_placed(svg, [[5, 95], [80, 70]])


def test_nodes_of_a_live_effect_are_those_that_the_user_drew() -> None:
    """On the curve that the effect makes of them, where it is nearest."""
    drawn = 'inkscape:original-d="M20,20 L60,30 L20,60 Z" d="M15,15 H65 V65 H15 Z"'
    svg = load(f'<path id="p" inkscape:path-effect="#e" {drawn}/>')
    place(svg, "nodes", nodes=("p:0:1",))
    assert_placed(svg, [[65, 30]])
    svg = load(f'<path id="p" {drawn}/>')  # the effect was removed
    place(svg, "nodes", nodes=("p:0:1",))
    assert_placed(svg, [[65, 15]])


def test_nodes_that_one_handle_would_cover_get_one() -> None:
    svg = load('<path id="p" d="M0,0 H100 V99.5 L99.5,100 H0 Z"/>')
    place(svg, "nodes", nodes=("p:0:2", "p:0:3", "p:0:4"))
    assert_placed(svg, [[100, 99.5], [0, 100]])
    svg = load('<path id="p" d="M0,0 H100 V98 L99.5,100 H0 Z"/>')  # near, but chosen, so that both count
    place(svg, "nodes", nodes=("p:0:2", "p:0:3"))
    assert_placed(svg, [[100, 98], [99.5, 100]])


# --- objects in the tree --------------------------------------------------------------------------------


def layer_of(svg: Any) -> Any:
    return next(e for e in svg.iter() if e.get(LABEL) == LAYER_LABEL)


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
    mine = find(svg, "mine")
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
    assert len(find(svg, "flat")) == 0


def test_a_file_without_namespace() -> None:
    svg = etree.fromstring('<svg viewBox="0 0 100 100"><path id="box" d="M20,30 H80 V70 H20 Z"/></svg>')
    placing.place(svg, "auto", [], [])
    assert [e.tag for e in svg[-1]] == ["circle"] * 4
    assert_placed(svg, CORNERS)


def test_placing_twice_keeps_the_handles() -> None:
    svg = load(BOX)
    assert place(svg, "extremes") == placing.Placed(tuple(f"alup-handle-{n}" for n in range(1, 5)), 0)
    before = etree.tostring(svg)
    assert place(svg, "corners") == placing.Placed((), 4)
    assert etree.tostring(svg) == before
    # one that was dragged away still holds its point; what is dragged onto a point doesn't hold that
    find(svg, "alup-handle-1").attrib["cx"] = "10"
    assert place(svg, "extremes") == placing.Placed((), 4)
    find(svg, "alup-handle-2").getparent().remove(find(svg, "alup-handle-2"))
    for attribute, value in (("cx", "80"), ("cy", "30")):
        find(svg, "alup-handle-1").attrib[attribute] = value
    assert place(svg, "extremes").kept == 3


def test_handles_drawn_by_hand_count() -> None:
    svg = load(BOX + '<circle id="h" inkscape:label="alup:pin" cx="20.3" cy="30" r="1"/>')
    assert place(svg, "extremes").kept == 1
    assert len(centres(svg)) == 4


def test_a_section_is_a_frame() -> None:
    svg = load(BOX + '<path id="q" d="M0,0 L5,95"/>')
    assert place(svg, "section", "box").added == ("alup-section-1",)
    (frame,) = handles(svg)
    margin = 0.5 * 0.0075 * np.hypot(80, 95)
    assert frame.bounds == pytest.approx(np.array([[20, 30], [80, 70]]) + np.array([[-margin], [margin]]))
    assert frame.rest == pytest.approx(frame.corners)
    assert "fill:none" in frame.element.attrib["style"]
    assert place(svg, "section", "box") == placing.Placed((), 1)


# --- colours and arrows ---------------------------------------------------------------------------------


def test_moved_handles_turn_blue_and_back() -> None:
    svg = load(BOX + '<circle id="mine" inkscape:label="alup:pin" cx="50" cy="30" r="1" style="fill:green"/>')
    place(svg, "auto")
    placing.recolour(handles(svg))
    assert etree.tostring(svg).count(STAYS.encode()) == 4
    circle = find(svg, "alup-handle-3")
    circle.attrib["transform"] = "translate(5,0)"
    placing.recolour(handles(svg))
    assert f"fill:{MOVED};stroke:#ffffff" in circle.attrib["style"]
    assert etree.tostring(svg).count(STAYS.encode()) == 3
    del circle.attrib["transform"]
    placing.recolour(handles(svg))
    assert etree.tostring(svg).count(STAYS.encode()) == 4
    assert find(svg, "mine").attrib["style"] == "fill:green"


def test_a_moved_section_turns_blue() -> None:
    svg = load(BOX)
    place(svg, "section", "box")
    placing.recolour(handles(svg))
    assert STAYS in find(svg, "alup-section-1").attrib["style"]
    find(svg, "alup-section-1").attrib["width"] = "70"
    placing.recolour(handles(svg))
    assert MOVED in find(svg, "alup-section-1").attrib["style"]


def arrows(svg: Any) -> list[Any]:
    return [e for e in svg.iter() if e.get(f"{{{ALUP}}}arrow") is not None]


@pytest.mark.parametrize("transform", ["", "translate(30,-20) scale(3)"])
def test_an_arrow_leads_to_each_moved_handle(transform: str) -> None:
    svg = load(f'<g inkscape:groupmode="layer" inkscape:label="{LAYER_LABEL}" transform="{transform}"/>{BOX}')
    place(svg, "auto")
    before = etree.tostring(svg)
    placing.arrows(svg, handles(svg))
    assert etree.tostring(svg) == before  # nothing moved, nothing drawn
    circle = find(svg, "alup-handle-2")
    there = circle.attrib["cx"]
    circle.attrib["cx"] = str(float(there) + 10)
    for _ in range(2):  # drawn anew, not once more
        placing.arrows(svg, handles(svg))
        (arrow,) = arrows(svg)
    handle = next(h for h in handles(svg) if h.name.startswith("alup-handle-2"))
    assert arrow.get(f"{{{ALUP}}}arrow") == "alup-handle-2"
    shape = marks.read_shape(arrow, (marks.parent_matrix(arrow) @ marks.own_matrix(arrow))[:2])
    points = shape.control[:, 0]
    assert np.linalg.norm(points - handle.centre, axis=1).min() == pytest.approx(handle.radius, rel=1e-6)
    assert handle.rest is not None
    assert np.linalg.norm(points - handle.rest, axis=1).min() < 0.5 * handle.radius
    group = arrow.getparent()
    assert group.get(LABEL) == "alup:arrows"
    assert group.get(f"{{{SODIPODI}}}insensitive") == "true"
    assert list(layer_of(svg)).index(group) == 0  # below the circles
    circle.attrib["cx"] = there
    placing.arrows(svg, handles(svg))
    assert etree.tostring(svg) == before


def test_arrows_are_no_handles_and_get_none() -> None:
    svg = load(BOX)
    place(svg, "auto")
    find(svg, "alup-handle-2").attrib["cx"] = "95"
    placing.arrows(svg, handles(svg))
    assert len(arrows(svg)) == 1
    assert len(handles(svg)) == 4
    assert place(svg, "extremes") == placing.Placed((), 4)  # the arrow's tip is no extreme


# --- removing -------------------------------------------------------------------------------------------


def test_removing_leaves_what_was_there() -> None:
    svg = load(f"\n  {BOX}\n  <!-- a note -->\n")
    before = etree.tostring(svg)
    place(svg, "auto")
    place(svg, "section", "box")
    find(svg, "alup-handle-2").attrib["cx"] = "95"
    placing.arrows(svg, handles(svg))
    assert placing.remove(svg, []) == 5
    assert etree.tostring(svg) == before
    assert placing.remove(svg, []) == 0


def test_only_the_selected_ones_go_with_their_arrows_and_partners() -> None:
    pair = "".join(
        f'<circle id="{end}" inkscape:label="alup:{end} A" cx="50" cy="30" r="1"/>' for end in ("from", "to")
    )
    svg = load(BOX + pair)
    place(svg, "auto")
    for identity in ("alup-handle-2", "alup-handle-3"):
        find(svg, identity).attrib["cx"] = "95"
    placing.arrows(svg, handles(svg))
    assert placing.remove(svg, [find(svg, "alup-handle-2"), find(svg, "to"), find(svg, "box")]) == 3
    left = {e.get("id") for e in svg.iter()}
    assert {"alup-handle-1", "alup-handle-3", "alup-handle-4", "box"} <= left
    assert not {"alup-handle-2", "to", "from"} & left
    assert [e.get(f"{{{ALUP}}}arrow") for e in arrows(svg)] == ["alup-handle-3"]


def test_a_layer_that_holds_something_else_stays() -> None:
    svg = load(BOX)
    place(svg, "auto")
    layer_of(svg).append(etree.fromstring(f'<path xmlns="{SVG}" id="note" d="M1,1 H2"/>'))
    placing.remove(svg, [])
    assert [e.get("id") for e in layer_of(svg)] == ["note"]


def test_an_arrow_whose_handle_was_deleted_by_hand_goes_with_the_rest() -> None:
    svg = load(BOX)
    before = etree.tostring(svg)
    place(svg, "auto")
    circle = find(svg, "alup-handle-2")
    circle.attrib["cx"] = "95"
    placing.arrows(svg, handles(svg))
    circle.getparent().remove(circle)
    assert placing.remove(svg, []) == 3
    assert etree.tostring(svg) == before


def test_handles_of_any_label_can_be_removed() -> None:
    svg = load(BOX + '<text id="odd" inkscape:label="alup:what">x</text>')
    assert placing.remove(svg, []) == 1


# --- refusals -------------------------------------------------------------------------------------------

TEXT = '<text id="t">Hello</text>'
# body, where, selected, nodes, words of the message
WRONG: dict[str, tuple[str, str, tuple[str, ...], tuple[str, ...], tuple[str, ...]]] = {
    "no nodes": (BOX, "nodes", ("box",), (), ("node tool",)),
    "no guides": (BOX, "guides", ("box",), (), ("no guides", "ruler")),
    "guides beside": (with_guides(guide("0,-10", "0,1")), "guides", ("box",), (), ("None of the 1 guides",)),
    "unreadable guide": (with_guides(guide("0,x", "0,1")), "guides", ("box",), (), ("position", "g ", "Delete")),
    "guide without direction": (with_guides(guide("0,1", "0,0")), "guides", (), (), ("orientation",)),
    "no corners": ('<circle id="c" r="9"/>', "corners", ("c",), (), ("no corner", "30 degrees")),
    "no section": (BOX, "section", (), (), ("Select the objects",)),
    "text": (BOX + TEXT, "auto", ("t",), (), ("t ", "text", "Object to Path")),
    "clone": (BOX + '<use id="u" xlink:href="#box"/>', "auto", ("u",), (), ("u ", "clone", "Unlink")),
    "empty drawing": (TEXT, "auto", (), (), ("no visible",)),
    "a point": ('<path id="p" d="M1,1 Z"/>', "auto", ("p",), (), ("p", "only a point")),
    "unreadable path": ('<path id="p" d="M1,1 L"/>', "auto", ("p",), (), ("p:", "can't be read")),
    "unknown node": (BOX, "nodes", (), ("box:0:4",), ("box", "doesn't have")),
    "unknown subpath": (BOX, "nodes", (), ("box:1:0",), ("box", "doesn't have")),
    "unknown path": (BOX, "nodes", (), ("x:0:0",), ("id x",)),
    "unreadable node": (BOX, "nodes", (), ("box",), ("id:subpath:position",)),
    "node of a clip path": (
        BOX + '<clipPath id="k"><path id="p" d="M0,0 H5"/></clipPath>', "nodes", (), ("p:0:0",), ("p lies in k",),
    ),
    "node of a rectangle": ('<rect id="r" width="9" height="9"/>', "nodes", (), ("r:0:0",), ("r is not a path",)),
    "wrong handle": (BOX + '<circle id="h" inkscape:label="alup:pni" r="1"/>', "auto", (), (), ("h ", "alup:pin")),
}  # fmt: skip


@pytest.mark.parametrize(("body", "where", "selected", "nodes", "words"), WRONG.values(), ids=WRONG.keys())
def test_what_cannot_be_is_refused_and_nothing_changed(
    body: str, where: str, selected: tuple[str, ...], nodes: tuple[str, ...], words: tuple[str, ...]
) -> None:
    svg = load(body)
    before = etree.tostring(svg)
    with pytest.raises(AlupError) as refused:
        place(svg, where, *selected, nodes=nodes)
    message = str(refused.value)
    assert message.endswith(".")
    for word in words:
        assert word in message
    assert etree.tostring(svg) == before


def test_texts_beside_paths_are_no_obstacle() -> None:
    svg = load(BOX + TEXT)
    place(svg, "auto", "box", "t")
    assert_placed(svg, CORNERS)


def test_an_unreadable_path_beside_is_no_obstacle() -> None:
    svg = load(BOX + '<path id="p" d="M1,1 L"/>')
    place(svg, "auto", "box")
    assert_placed(svg, CORNERS)


# --- the effects as programs, and what Reshape makes of the handles -------------------------------------


def run(effect: str, folder: Path, drawing: Path, *arguments: str) -> tuple[int, str, Path]:
    """Exit code, standard error, output of an effect."""
    output = folder / f"{len(list(folder.iterdir()))}.svg"
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONWARNINGS")}
    done = subprocess.run(
        [sys.executable, str(ROOT / f"{effect}.py"), f"--output={output}", *arguments, str(drawing)],
        env=environment, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    return done.returncode, done.stderr, output


def succeed(effect: str, folder: Path, drawing: Path, *arguments: str) -> Path:
    code, stderr, output = run(effect, folder, drawing, *arguments)
    assert (code, stderr) == (0, "")
    return output


DRAWING = f"""{HEAD}width="100mm" height="100mm" viewBox="0 0 100 100">
  <g id="group" transform="translate(2,3) scale(0.5)" style="fill:#ffcc00">
    <path id="bottle" d="M 40,160 V 80 C 40,60 70,60 70,40 V 10 H 90 V 40 C 90,60 120,60 120,80 V 160 Z" />
    <rect id="label" x="50" y="90" width="60" height="40" rx="5" style="fill:#fff"/>
  </g>
  <!-- a note --> <text id="t" x="3" y="9">Hi</text>
</svg>
"""


@pytest.fixture
def drawing(tmp_path: Path) -> Path:
    file = tmp_path / "drawing.svg"
    file.write_text(DRAWING, encoding="utf-8")
    return file


def text_of(svg: Any) -> bytes:
    """The drawing to the letter, but for declarations of namespaces that nothing in it has."""
    return bytes(etree.tostring(svg, method="c14n", exclusive=True))


def without_layer(file: Path) -> bytes:
    root = etree.parse(str(file)).getroot()
    placing.remove(root, [])
    return text_of(root)


def test_reshape_leaves_the_drawing_if_no_handle_was_dragged(drawing: Path, tmp_path: Path) -> None:
    placed = succeed("alup_place_handles", tmp_path, drawing, "--where=extremes")
    section = succeed("alup_place_handles", tmp_path, placed, "--where=section", "--id=label")
    reshaped = succeed("alup_reshape", tmp_path, section)
    before = text_of(etree.parse(str(drawing)).getroot())
    assert without_layer(placed) == without_layer(section) == without_layer(reshaped) == before
    assert len(handles(etree.parse(str(reshaped)).getroot())) == 7
    removed = succeed("alup_remove_handles", tmp_path, reshaped)
    assert etree.tostring(etree.parse(str(removed))) == etree.tostring(etree.parse(str(drawing)))


def nearest_to(svg: Any, point: tuple[float, float]) -> Any:
    return min(handles(svg), key=lambda handle: float(np.linalg.norm(handle.centre - point)))


@pytest.mark.parametrize("how", ["cx", "transform"])
def test_reshape_moves_the_curve_to_the_dragged_handle(how: str, drawing: Path, tmp_path: Path) -> None:
    placed = succeed("alup_place_handles", tmp_path, drawing, "--where=corners", "--id=bottle")
    tree = etree.parse(str(placed))
    for corner in ((37.0, 8.0), (47.0, 8.0)):  # the mouth, which goes up by 6
        handle = nearest_to(tree.getroot(), corner)
        assert handle.centre == pytest.approx(np.array(corner))
        circle = handle.element
        if how == "cx":
            circle.attrib["cy"] = str(float(circle.attrib["cy"]) - 6.0)
        else:
            circle.attrib["transform"] = "translate(0,-6)"
    tree.write(str(placed))
    report = tmp_path / "report.json"
    reshaped = succeed("alup_reshape", tmp_path, placed, "--id=bottle", f"--report={report}")
    assert json.loads(report.read_text())["handle_error_of_diagonal"] < 5e-4
    svg = etree.parse(str(reshaped)).getroot()
    bottle = marks.read_shape(find(svg, "bottle"), marks.parent_matrix(find(svg, "bottle"))[:2])
    low, high = placing.placing.bounds(bottle.control)
    assert low[1] == pytest.approx(2.0, abs=0.02)
    assert high == pytest.approx([62.0, 83.0], abs=0.02)


def test_a_section_carries_what_is_in_it(drawing: Path, tmp_path: Path) -> None:
    placed = succeed("alup_place_handles", tmp_path, drawing, "--where=section", "--id=label")
    placed = succeed("alup_place_handles", tmp_path, placed, "--where=extremes", "--id=bottle")
    tree = etree.parse(str(placed))
    frame = next(h for h in handles(tree.getroot()) if h.kind == "section")
    frame.element.attrib["x"] = str(float(frame.element.attrib["x"]) + 3.0)
    tree.write(str(placed))
    svg = etree.parse(str(succeed("alup_reshape", tmp_path, placed, "--id=label"))).getroot()
    label = marks.read_shape(find(svg, "label"), marks.parent_matrix(find(svg, "label"))[:2])
    assert placing.placing.bounds(label.control) == pytest.approx(np.array([[30, 48], [60, 68]]), abs=0.02)


def dragged_mouth(placed: Path) -> None:
    """The bottle's mouth goes up by 6."""
    tree = etree.parse(str(placed))
    for corner in ((37.0, 8.0), (47.0, 8.0)):
        circle = nearest_to(tree.getroot(), corner).element
        circle.attrib["cy"] = str(float(circle.attrib["cy"]) - 6.0)
    tree.write(str(placed))


def curve_of(file: Path, identity: str) -> np.ndarray:
    element = find(etree.parse(str(file)).getroot(), identity)
    return marks.read_shape(element, (marks.parent_matrix(element) @ marks.own_matrix(element))[:2]).control


def test_handles_placed_after_a_run_hold_what_is_there_now(drawing: Path, tmp_path: Path) -> None:
    """Their rest is in the stored original, so that the next run finds them without a wish of their own."""
    placed = succeed("alup_place_handles", tmp_path, drawing, "--where=corners", "--id=bottle")
    dragged_mouth(placed)
    reshaped = succeed("alup_reshape", tmp_path, placed)
    more = succeed("alup_place_handles", tmp_path, reshaped, "--where=extremes", "--id=label")
    framed = succeed("alup_place_handles", tmp_path, reshaped, "--where=section", "--id=label")
    for new in (more, framed):
        again = succeed("alup_reshape", tmp_path, new)
        for identity in ("bottle", "label"):
            assert np.abs(curve_of(again, identity) - curve_of(reshaped, identity)).max() < 0.02
        assert all(handle.at is not None for handle in handles(etree.parse(str(new)).getroot()))
    assert [handle.kind for handle in handles(etree.parse(str(framed)).getroot())].count("section") == 1
    # and again: a place that is held is found by where it rests
    code, stderr, _ = run("alup_place_handles", tmp_path, reshaped, "--where=corners", "--id=bottle")
    assert code != 0
    assert "all 4 places" in stderr


def test_baking_leaves_nothing_but_the_drawing(drawing: Path, tmp_path: Path) -> None:
    placed = succeed("alup_place_handles", tmp_path, drawing, "--where=corners", "--id=bottle")
    dragged_mouth(placed)
    reshaped = succeed("alup_reshape", tmp_path, placed)
    kept = succeed("alup_remove_handles", tmp_path, reshaped)
    baked = succeed("alup_remove_handles", tmp_path, reshaped, "--bake=true")
    assert b"alup:original" in kept.read_bytes()
    assert b"alup" not in baked.read_bytes()
    assert np.array_equal(curve_of(baked, "bottle"), curve_of(reshaped, "bottle"))
    later = succeed("alup_remove_handles", tmp_path, kept, "--bake=true")
    assert later.read_bytes() == baked.read_bytes()
    code, stderr, _ = run("alup_remove_handles", tmp_path, baked, "--bake=true")
    assert code != 0
    assert "nothing was changed" in stderr


@pytest.mark.parametrize(
    ("effect", "arguments", "words"),
    [
        ("alup_place_handles", ("--where=nodes",), "node tool"),
        ("alup_place_handles", ("--id=nobody",), "nobody"),
        ("alup_place_handles", ("--id=t",), "Object to Path"),
        ("alup_remove_handles", (), "no handles"),
    ],
)
def test_wrong_use_is_one_sentence(
    effect: str, arguments: tuple[str, ...], words: str, drawing: Path, tmp_path: Path
) -> None:
    code, stderr, output = run(effect, tmp_path, drawing, *arguments)
    assert code != 0
    assert not output.exists()
    assert stderr.strip().count("\n") == 0
    assert re.search(words, stderr)


def test_placing_twice_says_that_nothing_was_added(drawing: Path, tmp_path: Path) -> None:
    placed = succeed("alup_place_handles", tmp_path, drawing, "--id=bottle")
    code, stderr, output = run("alup_place_handles", tmp_path, placed, "--id=bottle")
    assert code != 0
    assert not output.exists()
    assert "at all 6 places already" in stderr


def test_selected_nodes_reach_the_effect(drawing: Path, tmp_path: Path) -> None:
    nodes = [f"--selected-nodes=bottle:0:{n}" for n in (3, 4)]
    svg = etree.parse(str(succeed("alup_place_handles", tmp_path, drawing, "--id=bottle", *nodes))).getroot()
    assert_placed(svg, [[37, 8], [47, 8]])


# --- in Inkscape ----------------------------------------------------------------------------------------


def test_inkscape_places_and_removes(inkscape: harness.Inkscape, drawing: Path, tmp_path: Path) -> None:
    drawing.write_text(DRAWING.replace("<svg ", '<svg inkscape:version="1.2" ', 1), encoding="utf-8")
    done = inkscape.reshape(
        drawing, select=["bottle"], effect="alup_place_handles", params={"where": "extremes"}
    )
    assert (done.code, done.stderr) == (0, "")
    svg = etree.parse(str(done.output)).getroot()
    assert_placed(svg, [[22, 83], [62, 83], [37, 8], [47, 8], [22, 43], [62, 43]], 1e-4)
    assert len(layer_of(svg)) == 6
    gone = inkscape.reshape(done.output, effect="alup_remove_handles")
    assert (gone.code, gone.stderr) == (0, "")
    svg = etree.parse(str(gone.output)).getroot()
    assert handles(svg) == []
    assert LAYER_LABEL not in [e.get(LABEL) for e in svg.iter()]


def test_after_a_run_arrows_lead_from_rest_to_handle_until_the_original_is_restored(
    drawing: Path, tmp_path: Path
) -> None:
    placed = succeed("alup_place_handles", tmp_path, drawing, "--where=corners", "--id=bottle")
    dragged_mouth(placed)
    reshaped = etree.parse(str(succeed("alup_reshape", tmp_path, placed))).getroot()
    moved = {handle.element.attrib["id"] for handle in handles(reshaped) if is_moved(handle)}
    assert len(moved) == 2
    assert {arrow.get(f"{{{ALUP}}}arrow") for arrow in arrows(reshaped)} == moved
    blue = {handle.element.attrib["id"] for handle in handles(reshaped) if MOVED in style_of(handle)}
    assert blue == moved
    file = tmp_path / "reshaped.svg"
    etree.ElementTree(reshaped).write(str(file))
    restored = etree.parse(str(succeed("alup_restore_original", tmp_path, file))).getroot()
    assert not arrows(restored)
    assert not any(MOVED in style_of(handle) for handle in handles(restored))
    gone = succeed("alup_reshape", tmp_path, file, "--keep_handles=false")
    assert LAYER_LABEL not in gone.read_text(encoding="utf-8")


def style_of(handle: marks.HandleObject) -> str:
    return str(handle.element.attrib.get("style"))


def test_a_run_makes_no_layer_for_handles_drawn_by_hand(tmp_path: Path) -> None:
    file = tmp_path / "hand.svg"
    pins = "".join(f'<circle inkscape:label="alup:pin" cx="{x}" cy="30" r="1"/>' for x in (20, 80))
    drag = '<circle inkscape:label="alup:handle" alup:rest="50 70" cx="50" cy="80" r="1" xmlns:alup="{}"/>'
    etree.ElementTree(load(BOX + pins + drag.format(ALUP))).write(str(file))
    after = succeed("alup_reshape", tmp_path, file).read_text(encoding="utf-8")
    assert LAYER_LABEL not in after
