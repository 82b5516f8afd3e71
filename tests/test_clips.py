# SPDX-License-Identifier: GPL-2.0-or-later
"""What clip paths and masks may be made of, and which of it follows what they cut."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from builders import Array
from companions import AWAY, CLIP, CLIPPED, CORNERS, GRADIENT, RECT, WIDER, load, mapped, paint_of, run
from documents import SVG

from alup.document import reading
from alup.document.tree import elements
from alup.messages.errors import DocumentError

MASKED = RECT.format('style="mask:url(#m)"')
SHIFT = (150.0, 70.0)  # of AWAY


def clip_path(content: str) -> str:
    return f'<clipPath id="c">{content}</clipPath>'


def clone(of: str) -> str:
    return clip_path(f'<use id="u" xlink:href="#{of}"/>')


def bounds(element: Any, outer: Array | None = None) -> Array:
    """Of a shape, or of all shapes in a clip path or a mask, in the coordinates of what it is in."""
    outer = np.eye(3) if outer is None else outer
    shapes = [part for part in element.iter() if part.tag in (f"{{{SVG}}}path", f"{{{SVG}}}rect")]
    points = [elements.read_shape(part, (outer @ elements.own_matrix(part))[:2]).control for part in shapes]
    joined = np.concatenate(points).reshape(-1, 2)
    return np.array([joined.min(axis=0), joined.max(axis=0)])


def tags(element: Any) -> list[str]:
    return [part.tag.replace(f"{{{SVG}}}", "") for part in element]


# --- clips that follow --------------------------------------------------------------------------


@pytest.mark.parametrize("tandem", [True, False])
@pytest.mark.parametrize(
    "clip",
    [
        CLIP,
        CLIP.replace("40", "20").replace("60", "100").replace('y="10"', 'y="20"').replace("80", "60"),
        CLIP.replace('y="10"', 'y="30"').replace("80", "30"),
        '<rect id="cr" x="40" y="30" width="60" height="40"/>'
        '<clipPath id="c"><use id="cu" xlink:href="#cr"/></clipPath>',
        CLIP.replace('x="40"', 'x="-4000"').replace("60", "9000"),
    ],
    ids=["across", "same", "inside", "clone", "huge"],
)
def test_a_clip_follows_what_it_cuts(clip: str, tandem: bool) -> None:
    done = run(f"<defs>{clip}</defs>{CLIPPED}", move=AWAY, tandem=tandem)
    before = bounds(run(f"<defs>{clip}</defs>{CLIPPED}")["c" if "use" not in clip else "cr"])
    np.testing.assert_allclose(bounds(done["c"]), before + [150, 70], atol=2e-3)
    assert done["r"].get("clip-path") == "url(#c)"
    if "use" in clip:
        assert done["cr"].get("x") == "40"


def test_a_clip_within_a_stretched_shape_is_stretched() -> None:
    inside = CLIP.replace('y="10"', 'y="30"').replace("80", "30")
    done = run(f"<defs>{inside}</defs>{CLIPPED}", move=WIDER)
    np.testing.assert_allclose(bounds(done["c"]), [(80, 30), (260, 60)], atol=1e-3)
    assert [part.tag for part in done["c"]] == [f"{{{SVG}}}path"]
    assert set(done.changed) == {"r", "cr"}


def test_a_clip_that_crosses_keeps_its_place_on_the_curves() -> None:
    done = run(f"<defs>{CLIP}</defs>{CLIPPED}", move=WIDER)
    low, high = bounds(done["c"])
    np.testing.assert_allclose([low[0], high[0]], [80, 260], rtol=0.05)
    assert low[1] < 20 < 80 < high[1]


def test_a_clip_is_in_the_user_space_of_the_clipped_element() -> None:
    at = [(2 * x, 2 * y + 10) for x, y in CORNERS]
    body = f'<defs>{CLIP}</defs><g transform="translate(0,10)"><g transform="scale(2)">{CLIPPED}</g></g>'
    done = run(body, move=AWAY, points=at)
    np.testing.assert_allclose(bounds(done["c"]), [(115, 45), (175, 125)], atol=2e-3)


def test_a_clip_relative_to_the_bounding_box_stays() -> None:
    clip = CLIP.replace('id="c"', 'id="c" clipPathUnits="objectBoundingBox"')
    done = run(f"<defs>{clip}</defs>{CLIPPED}", move=WIDER)
    assert done["cr"].tag == f"{{{SVG}}}rect"
    assert len(done.read.shapes) == 1


def test_a_huge_clip_does_not_make_the_samples_coarse() -> None:
    huge = CLIP.replace('x="40" y="10"', 'x="-4000" y="50"').replace("60", "9000")
    assert [shape.name for shape in run(f"<defs>{huge}</defs>{CLIPPED}").read.shapes] == ["r"]
    assert [shape.name for shape in run(f"<defs>{CLIP}</defs>{CLIPPED}").read.shapes] == ["r", "cr"]


def test_the_clip_of_a_clip_follows() -> None:
    outer = '<clipPath id="d"><rect id="dr" x="50" y="15" width="20" height="70"/></clipPath>'
    clip = CLIP.replace('id="c"', 'id="c" clip-path="url(#d)"')
    done = run(f"<defs>{clip}{outer}</defs>{CLIPPED}", move=AWAY)
    np.testing.assert_allclose(bounds(done["d"]), [(200, 85), (220, 155)], atol=2e-3)


# --- masks --------------------------------------------------------------------------------------


def test_a_mask_its_region_and_its_paint_follow() -> None:
    mask = (
        '<mask id="m" maskUnits="userSpaceOnUse" x="40" y="30" width="60" height="40">'
        '<rect id="mr" x="40" y="30" width="60" height="40" fill="url(#g)"/></mask>'
    )
    done = run(f"<defs>{GRADIENT}{mask}</defs>{MASKED}", move=WIDER)
    np.testing.assert_allclose(bounds(done["m"]), [(80, 30), (260, 70)], atol=1e-3)
    moved = [float(done["m"].get(side)) for side in ("x", "y", "width", "height")]
    np.testing.assert_allclose(moved, [80, 30, 180, 40], atol=1e-3)
    np.testing.assert_allclose(mapped(done["g"], (120, 50)), [(320, 50)], atol=1e-3)


def test_a_mask_with_groups_in_it() -> None:
    inner = '<g transform="translate(10,0)"><g><rect id="mr" x="40" y="30" width="60" height="40"/></g></g>'
    region = 'maskUnits="userSpaceOnUse" x="0%" y="0" width="100%" height="300"'
    done = run(f'<defs><mask id="m" {region}>{inner}</mask></defs>{MASKED}', move=WIDER)
    outer = elements.own_matrix(done["m"][0]) @ elements.own_matrix(done["m"][0][0])
    np.testing.assert_allclose(bounds(done["mr"], outer), [(110, 30), (290, 70)], atol=1e-3)
    moved = [float(done["m"].get(side)) for side in ("x", "y", "width", "height")]
    np.testing.assert_allclose(moved, [-40, 0, 1200, 300], atol=1e-2)


# --- clones -------------------------------------------------------------------------------------


def test_a_clone_in_a_clip_becomes_what_it_shows() -> None:
    """With the place, the attributes and the id that it has there, and without a title that nobody sees."""
    shown = '<rect id="o" x="20" y="30" width="60" height="40" fill="red"><title>one</title></rect>'
    use = '<use id="u" xlink:href="#o" x="10" y="-5" transform="translate(10,5)" clip-rule="evenodd"/>'
    done = run(f"<defs>{shown}{clip_path(use)}</defs>{CLIPPED}", move=AWAY)
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
def test_a_clone_of_an_element_without_outline_stays_a_clone(defs: str) -> None:
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
    done = run(f"<defs>{clip_path(elsewhere)}</defs>{CLIPPED}", move=AWAY)
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
def test_a_clip_that_cuts_nothing_is_unchanged(still: str) -> None:
    cutting = '<rect id="cr" x="40" y="10" width="60" height="80"/>'
    body = f"<defs>{clip_path(still + cutting)}</defs>{CLIPPED}"
    before, done = run(body)["s"], run(body, move=AWAY)
    assert dict(done["s"].attrib) == dict(before.attrib)
    assert done["s"].tag == before.tag
    np.testing.assert_allclose(bounds(done["cr"]), np.array([(40, 10), (100, 90)]) + SHIFT, atol=2e-3)


def test_a_clip_of_a_text_alone_moves_the_text() -> None:
    text = '<text id="t" x="40" y="60" font-size="20">AB</text>'
    done = run(f"<defs>{clip_path(text)}</defs>{CLIPPED}", move=AWAY)
    np.testing.assert_allclose(elements.own_matrix(done["t"])[:2, 2], SHIFT, atol=2e-3)


# --- who cuts what ------------------------------------------------------------------------------


def test_a_clip_that_also_cuts_something_else_is_copied() -> None:
    other = '<rect id="o" y="200" width="9" height="9" style="clip-path:url(#c)"/>'
    done = run(f"<defs>{CLIP}</defs>{CLIPPED}{other}", move=AWAY)
    np.testing.assert_array_equal(bounds(done["c"]), [(40, 10), (100, 90)])
    assert done["o"].attrib.get("style") == "clip-path:url(#c)"
    copy = paint_of(done["r"], "clip-path")
    np.testing.assert_allclose(bounds(done[copy]), [(190, 80), (250, 160)], atol=2e-3)
    ids = [element.get("id") for element in done.root.iter() if element.get("id")]
    assert len(ids) == len(set(ids))


def test_shapes_in_one_place_go_on_sharing_their_clip() -> None:
    other = '<path id="s" d="M 30,30 H 90 V 70 H 30 Z" clip-path="url(#c)"/>'
    done = run(f"<defs>{CLIP}</defs>{CLIPPED}{other}", "r s", AWAY)
    assert paint_of(done["r"], "clip-path") == paint_of(done["s"], "clip-path") == "c"
    np.testing.assert_allclose(bounds(done["c"]), [(190, 80), (250, 160)], atol=2e-3)


def test_one_clip_in_two_places_becomes_two() -> None:
    again = CLIPPED.replace('id="r"', 'id="s"')
    body = f'<defs>{CLIP}</defs>{CLIPPED}<g transform="translate(0,100)">{again}</g>'
    done = run(body, "r s", AWAY)
    first, second = paint_of(done["r"], "clip-path"), paint_of(done["s"], "clip-path")
    assert first != second
    np.testing.assert_allclose(bounds(done[first]), [(190, 80), (250, 160)], atol=2e-3)
    assert bounds(done[second])[0, 0] > 100


@pytest.mark.parametrize(("inner", "follows"), [("", True), ('<path id="o" d="M 0,0 H 9"/>', False)])
def test_the_clip_of_a_group_follows_if_all_that_is_drawn_in_it_does(inner: str, follows: bool) -> None:
    hidden = '<path id="h" d="M 0,0 H 9" style="display:none"/>'
    body = f'<defs>{CLIP}</defs><g clip-path="url(#c)"><g>{RECT.format("")}</g>{hidden}{inner}</g>'
    done = run(body, move=AWAY)
    shift = (150, 70) if follows else (0, 0)
    np.testing.assert_allclose(bounds(done["c"]), np.array([(40, 10), (100, 90)]) + shift, atol=2e-3)


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


def test_a_clip_that_is_selected_itself_is_reshaped_once() -> None:
    done = run(f"<defs>{CLIP}</defs>{CLIPPED}", "r cr", AWAY)
    assert sorted(shape.name for shape in done.read.shapes) == ["cr", "r"]
    np.testing.assert_allclose(bounds(done["cr"]), np.array([(40, 10), (100, 90)]) + SHIFT, atol=2e-3)


def test_clips_do_not_count_as_selected() -> None:
    with pytest.raises(DocumentError, match="No path is selected"):
        run(f'<defs>{CLIP}</defs>{CLIPPED}<text id="t" clip-path="url(#c)">A</text>', "t", AWAY)
    whole = reading.read(load(f"<defs>{CLIP}</defs>{CLIPPED}"), [], False)
    assert [shape.name for shape in whole.shapes] == ["r", "cr"]
    assert [
        shape.name for shape in reading.read(load(f"<defs>{CLIP}</defs>{RECT.format('')}"), [], False).shapes
    ] == ["r"]
