# SPDX-License-Identifier: GPL-2.0-or-later
"""Place handles: where they go, which points are held already, what is refused."""

# XML is read more easily on one line.
# ruff: noqa: E501

from __future__ import annotations

import numpy as np
import pytest
from documents import SVG, get
from lxml import etree
from placed import BOX, CORNERS, assert_placed, centres, guide, handles, load, place, with_guides

from alup.document import handle_marks, place_handles
from alup.document.tree import elements
from alup.messages.errors import AlupError

# --- places in root user units ------------------------------------------------------------------


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
    """For all units of the page, and under transforms of groups."""
    outer = f'<g transform="{before}"><g transform="scale(2) translate(1,-1)">' if before else "<g><g>"
    svg = load(f'{outer}<path id="box" transform="translate(3,4)" d="M20,30 L80,35 L50,70 Z"/></g></g>', root)
    place(svg, "corners", "box")
    matrix = np.eye(3)
    element = get(svg, "box")
    while element is not svg:
        matrix = elements.own_matrix(element) @ matrix
        element = element.getparent()
    points = np.array([[20, 30], [80, 35], [50, 70]])
    assert_placed(svg, points @ matrix[:2, :2].T + matrix[:2, 2])


def test_groups_are_walked_and_hidden_elements_left_out() -> None:
    svg = load(
        f'<g id="all"><path d="M0,0 H100 V100 H0 Z" fill="none" stroke="none"/>{BOX}</g>'
        '<path d="M-50,-50 H300" style="display:none"/>'
    )
    place(svg, "auto", "all")
    assert_placed(svg, CORNERS)
    assert handles(svg)[0].radius == pytest.approx(0.0075 * np.hypot(60, 40))


def test_hidden_elements_get_handles_when_selected() -> None:
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


def test_the_radius_suits_the_drawing_and_the_selection() -> None:
    svg = load(BOX.replace("H80", "H60") + '<path id="dot" d="M5,5 h1 v1 Z"/>')
    place(svg, "auto", "box")
    whole = np.hypot(60 - 5, 70 - 5)
    assert handles(svg)[0].radius == pytest.approx(0.0075 * whole)
    handle_marks.remove(svg, [])
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


# --- nodes --------------------------------------------------------------------------------------


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
    svg = load(
        '<path id="p" d="M0,0 H100 V98 L99.5,100 H0 Z"/>'
    )  # near each other, but chosen, so both count
    place(svg, "nodes", nodes=("p:0:2", "p:0:3"))
    assert_placed(svg, [[100, 98], [99.5, 100]])


# --- handles that are there ---------------------------------------------------------------------


def test_placing_twice_keeps_the_handles() -> None:
    svg = load(BOX)
    assert place(svg, "extremes") == place_handles.Placed(tuple(f"alup-handle-{n}" for n in range(1, 5)), 0)
    before = etree.tostring(svg)
    assert place(svg, "corners") == place_handles.Placed((), 4)
    assert etree.tostring(svg) == before
    # A handle that was dragged away still holds its point.  One that was dragged onto a point does not hold that.
    get(svg, "alup-handle-1").attrib["cx"] = "10"
    assert place(svg, "extremes") == place_handles.Placed((), 4)
    get(svg, "alup-handle-2").getparent().remove(get(svg, "alup-handle-2"))
    for attribute, value in (("cx", "80"), ("cy", "30")):
        get(svg, "alup-handle-1").attrib[attribute] = value
    assert place(svg, "extremes").kept == 3


def test_handles_drawn_by_hand_count() -> None:
    svg = load(BOX + '<circle id="h" inkscape:label="alup:pin" cx="20.3" cy="30" r="1"/>')
    assert place(svg, "extremes").kept == 1
    assert len(centres(svg)) == 4


# --- refusals -----------------------------------------------------------------------------------

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
def test_impossible_places_are_refused_and_nothing_is_changed(
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
