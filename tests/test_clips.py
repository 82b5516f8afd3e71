"""What clip paths and masks may be made of, and which of it follows what they cut."""

from __future__ import annotations

from typing import Any

import inkex
import numpy as np
import pytest
from test_companions import AWAY, CLIP, CLIPPED, MASKED, RECT, SVG, WIDER, run

from alup import document
from alup.document import tree
from alup.document.places import Places, original_points, pair
from alup.document.tree import Shape
from alup.pathdata import parse

Array = np.ndarray

SHIFT = (150.0, 70.0)  # of AWAY


def clip(content: str, name: str = "c") -> str:
    return f'<clipPath id="{name}">{content}</clipPath>'


def clone(of: str) -> str:
    return clip(f'<use id="u" xlink:href="#{of}"/>')


def bounds(element: Any, outer: Array | None = None) -> Array:
    """Of a shape, in the coordinates of what it is in."""
    matrix = tree.own_matrix(element) if outer is None else outer @ tree.own_matrix(element)
    points = tree.read_shape(element, matrix[:2]).control.reshape(-1, 2)
    return np.array([points.min(axis=0), points.max(axis=0)])


def tags(element: Any) -> list[str]:
    return [part.tag.replace(f"{{{SVG}}}", "") for part in element]


# --- clones -------------------------------------------------------------------------------------


def test_a_clone_in_a_clip_becomes_what_it_shows() -> None:
    """With the place, the attributes and the id that it has there, and without a title that nobody sees."""
    shown = '<rect id="o" x="20" y="30" width="60" height="40" fill="red"><title>one</title></rect>'
    use = '<use id="u" xlink:href="#o" x="10" y="-5" transform="translate(10,5)" clip-rule="evenodd"/>'
    done = run(f"<defs>{shown}{clip(use)}</defs>{CLIPPED}", move=AWAY)
    (own,) = done["c"]
    assert tags(done["c"]) == ["path"]
    assert dict(own.attrib)["id"] == "u"
    assert own.get("clip-rule") == "evenodd"
    assert own.get("fill") == "red"
    assert not len(own)
    np.testing.assert_allclose(bounds(own), np.array([(40, 30), (100, 70)]) + SHIFT, atol=2e-3)
    np.testing.assert_array_equal(bounds(done["o"]), [(20, 30), (80, 70)])


@pytest.mark.parametrize(
    "defs",
    [
        '<g id="o"><rect width="9" height="9"/></g>' + clone("o"),
        '<path id="o" d=""/>' + clone("o"),
        clone("nowhere"),
    ],
    ids=["group", "empty", "missing"],
)
def test_a_clone_of_what_has_no_outline_stays_one(defs: str) -> None:
    before = run(f"<defs>{defs}</defs>{CLIPPED}")["u"].attrib
    done = run(f"<defs>{defs}</defs>{CLIPPED}", move=AWAY)
    assert dict(done["u"].attrib) == dict(before)
    assert tags(done["c"]) == ["use"]


def test_a_clone_of_the_shape_itself_follows_by_itself() -> None:
    done = run(f"<defs>{clone('r')}</defs>{CLIPPED}", move=AWAY)
    assert tags(done["c"]) == ["use"]
    np.testing.assert_allclose(bounds(done["r"]), np.array([(20, 20), (120, 80)]) + SHIFT, atol=2e-3)


def test_a_clone_of_the_shape_in_another_place_is_one_of_its_own() -> None:
    elsewhere = '<use id="u" xlink:href="#r" transform="translate(30,0)"/>'
    done = run(f"<defs>{clip(elsewhere)}</defs>{CLIPPED}", move=AWAY)
    np.testing.assert_allclose(bounds(done["u"]), np.array([(50, 20), (150, 80)]) + SHIFT, atol=2e-3)


# --- other content ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "still",
    [
        '<rect id="s" x="50" y="30" width="20" height="20" style="display:none"/>',
        '<rect id="s" x="50" y="30" width="20" height="20" transform="scale(0)"/>',
        '<path id="s" d=""/>',
        '<!-- a word --><path id="s" d=" "/>',
    ],
    ids=["hidden", "flat", "empty", "comment"],
)
def test_what_cuts_nothing_stays_as_it_is(still: str) -> None:
    cutting = '<rect id="cr" x="40" y="10" width="60" height="80"/>'
    body = f"<defs>{clip(still + cutting)}</defs>{CLIPPED}"
    before, done = run(body)["s"], run(body, move=AWAY)
    assert dict(done["s"].attrib) == dict(before.attrib)
    assert done["s"].tag == before.tag
    np.testing.assert_allclose(bounds(done["cr"]), np.array([(40, 10), (100, 90)]) + SHIFT, atol=2e-3)


def test_a_clip_of_a_text_alone_moves_the_text() -> None:
    text = '<text id="t" x="40" y="60" font-size="20">AB</text>'
    done = run(f"<defs>{clip(text)}</defs>{CLIPPED}", move=AWAY)
    np.testing.assert_allclose(tree.own_matrix(done["t"])[:2, 2], SHIFT, atol=2e-3)


def test_a_mask_with_groups_in_it() -> None:
    inner = '<g transform="translate(10,0)"><g><rect id="mr" x="40" y="30" width="60" height="40"/></g></g>'
    region = 'maskUnits="userSpaceOnUse" x="0%" y="0" width="100%" height="300"'
    done = run(f'<defs><mask id="m" {region}>{inner}</mask></defs>{MASKED}', move=WIDER)
    outer = tree.own_matrix(done["m"][0]) @ tree.own_matrix(done["m"][0][0])
    np.testing.assert_allclose(bounds(done["mr"], outer), [(110, 30), (290, 70)], atol=1e-3)
    # A part of the page, which did not change.
    assert [done["m"].get(side) for side in ("x", "y", "width", "height")] == ["0%", "0", "100%", "300"]


# --- who cuts what ------------------------------------------------------------------------------


def test_a_clip_that_is_selected_itself_is_reshaped_once() -> None:
    done = run(f"<defs>{CLIP}</defs>{CLIPPED}", "r cr", AWAY)
    assert sorted(shape.name for shape in done.read.shapes) == ["cr", "r"]
    np.testing.assert_allclose(bounds(done["cr"]), np.array([(40, 10), (100, 90)]) + SHIFT, atol=2e-3)


def test_two_groups_that_one_clip_cuts_share_it() -> None:
    groups = f'<g clip-path="url(#c)">{RECT.format("")}</g><g id="e" clip-path="url(#c)"/>'
    done = run(f"<defs>{CLIP}</defs>{groups}", move=AWAY)
    copies = [part for part in done.root.iter() if part.tag == f"{{{SVG}}}clipPath"]
    # The empty one is cut by it, too: what it will hold is not known.
    assert len(copies) == 2
    np.testing.assert_array_equal(bounds(done["cr"]), [(40, 10), (100, 90)])
    assert done["e"].get("clip-path") == "url(#c)"


def test_a_clip_that_cuts_a_group_and_a_shape_in_it() -> None:
    body = f'<defs>{CLIP}</defs><g id="g" clip-path="url(#c)">{CLIPPED}</g>'
    done = run(body, move=AWAY)
    assert [part.tag for part in done.root.iter()].count(f"{{{SVG}}}clipPath") == 1
    assert done["g"].get("clip-path") == done["r"].get("clip-path") == "url(#c)"
    np.testing.assert_allclose(bounds(done["cr"]), np.array([(40, 10), (100, 90)]) + SHIFT, atol=2e-3)


def test_a_hidden_part_does_not_hold_a_groups_clip() -> None:
    hidden = '<rect id="h" width="9" height="9" visibility="hidden"/><path id="n" d=""/><title>one</title>'
    done = run(f'<defs>{CLIP}</defs><g clip-path="url(#c)">{RECT.format("")}{hidden}</g>', move=AWAY)
    np.testing.assert_allclose(bounds(done["cr"]), np.array([(40, 10), (100, 90)]) + SHIFT, atol=2e-3)


# --- places on curves ---------------------------------------------------------------------------


def shape(data: str) -> Shape:
    element = inkex.PathElement()
    element.set("d", data)
    return Shape(element, "p", np.eye(2, 3), tuple(parse(data)))


def test_a_place_without_curves_is_the_point_itself() -> None:
    place = Places([]).locate(np.array([3.0, 4.0]))
    assert np.array_equal(place.was, [3.0, 4.0])
    assert np.array_equal(place.now, [3.0, 4.0])
    assert place.distance == np.inf


@pytest.mark.parametrize(
    ("now", "was", "wanted"),
    [
        # rounding opened what z closes: the line that z draws came from the end of the last segment
        ("M0,0 L8,0 L8,8 L0,0.001 Z", "M0,0 L4,0 L4,4 L0,0 Z", [(4, 0), (4, 4), (0, 0), (0, 0)]),
        # of four segments two are left
        ("M0,0 L8,0 L8,8", "M0,0 L4,0 L4,2 L4,4 L0,4", [(4, 0), (4, 4)]),
        ("M5,5", "M0,0 L4,0", []),
        ("", "", []),
    ],
    ids=["opened", "fewer", "point", "nothing"],
)
def test_segments_and_what_they_came_from(now: str, was: str, wanted: list[Any]) -> None:
    new, old = pair(shape(now), shape(was), {})
    assert len(new) == len(old) == len(wanted)
    np.testing.assert_allclose(old[:, 3], np.reshape(wanted, (-1, 2)), atol=1e-12)


def test_a_point_on_what_cannot_be_read_is_where_it_is() -> None:
    done = run(RECT.format("") + '<path id="p" d="M200,200 h50"/>', move=AWAY)
    at = np.array([[170.0, 90.0], [225.0, 200.0]])
    assert np.abs(document.original_points(done.root, at)[0] - (20, 20)).max() < 1e-2
    done["p"].set("d", "no path")
    np.testing.assert_allclose(original_points(done.root, at)[0], (20, 20), atol=1e-2)
