# SPDX-License-Identifier: GPL-2.0-or-later
"""Gradients and patterns follow the shapes that they paint, by the map that fits best."""

from __future__ import annotations

import re
from typing import Any, Sequence

import inkex
import numpy as np
import pytest
from builders import Array, Point
from companions import (
    AWAY,
    CORNERS,
    FILLED,
    GRADIENT,
    LARGER,
    RECT,
    STOPS,
    WIDER,
    Map,
    affine,
    mapped,
    paint_of,
    run,
)
from documents import SVG
from lxml import etree

from alup.document.followers.motion import Points, axis_aligned, near, similarity
from alup.document.tree.references import XLINK_HREF

STYLED = RECT.format('style="fill:url(#g)"')


# --- fits ---------------------------------------------------------------------------------------


def points(move: Map, at: Sequence[Point]) -> Points:
    old = np.array(at, dtype=float)
    return Points(old, move(old), np.linspace(1.0, 3.0, len(old)))


def test_an_axis_aligned_map_is_found_exactly() -> None:
    fit = axis_aligned(points(affine((3.0, 0.25), (7.0, -9.0)), [*CORNERS, (50, 33)]))
    assert fit == pytest.approx(np.array([[3, 0, 7], [0, 0.25, -9], [0, 0, 1]]), abs=1e-12)


def test_a_mirrored_and_a_flattened_shape_keep_an_invertible_map() -> None:
    mirrored = axis_aligned(points(affine((-1.0, 1.0), (0.0, 0.0)), CORNERS))
    np.testing.assert_allclose(mirrored[:2, :2], np.diag([-1.0, 1.0]), atol=1e-12)
    flat = axis_aligned(points(affine((1.0, 0.0), (0.0, 5.0)), CORNERS))
    assert 0.0 < abs(np.linalg.det(flat)) < 0.1


@pytest.mark.parametrize("at", [((0, 5), (50, 5), (80, 5)), ((7, 7), (7, 7))])
def test_points_without_extent_in_a_direction_keep_their_scale_in_it(at: Sequence[Point]) -> None:
    fit = axis_aligned(points(affine((2.0, 4.0), (3.0, 1.0)), at))
    assert fit[1, 1] == 1.0
    y = at[0][1]
    assert fit[1, 1] * y + fit[1, 2] == pytest.approx(4.0 * y + 1.0)


def test_a_similarity_is_found_exactly_and_near_points_count_more() -> None:
    there = points(LARGER, [*CORNERS, (300, 200)])
    np.testing.assert_allclose(similarity(there), [[2, 0, -20], [0, 2, -20], [0, 0, 1]], atol=1e-12)
    old = np.array([(0.0, 0.0), (10.0, 10.0), (1000.0, 1000.0), (1010.0, 1010.0)])
    new = old + np.array([(5.0, 0.0), (5.0, 0.0), (0.0, 90.0), (0.0, 90.0)])
    fit = similarity(near(Points(old, new, np.ones(4)), np.array([5.0, 5.0]), 1.0))
    np.testing.assert_allclose(fit[:2, 2], [5.0, 0.0], atol=0.01)


# --- gradients and patterns ---------------------------------------------------------------------


@pytest.mark.parametrize(
    "paint",
    ['fill="url(#g)"', 'style="stroke:none;fill:url(#g) red"', 'stroke="url(#g)" fill="none"', 'class="c"'],
)
@pytest.mark.parametrize(("move", "ends"), [(WIDER, ((20, 50), (320, 50))), (AWAY, ((170, 120), (270, 120)))])
def test_a_gradient_follows_the_shape_that_it_paints(paint: str, move: Map, ends: Any) -> None:
    style = "<style>.c { fill : url( '#g' ) }</style>"
    done = run(f"{style}<defs>{GRADIENT}</defs>{RECT.format(paint)}", move=move)
    np.testing.assert_allclose(mapped(done["g"], (20, 50), (120, 50)), ends, atol=1e-4)
    for name in ("x1", "x2", "gradientUnits"):
        assert done["g"].get(name) == etree.fromstring(GRADIENT).get(name)
    assert len(done.root.findall(f".//{{{SVG}}}linearGradient")) == 1


def test_a_gradient_that_a_group_hands_down_follows() -> None:
    done = run(f'<defs>{GRADIENT}</defs><g fill="url(#g)">{RECT.format("")}</g>', move=WIDER)
    np.testing.assert_allclose(mapped(done["g"], (120, 50)), [(320, 50)], atol=1e-4)


def test_geometry_and_transform_are_taken_over_along_the_chain() -> None:
    defs = (
        f'<linearGradient id="v">{STOPS}</linearGradient>'
        '<radialGradient id="b" xlink:href="#v" gradientUnits="userSpaceOnUse" cx="10" cy="10" r="5" '
        'gradientTransform="matrix(2,1,0,3,11.123456789,0)"/>'
        '<radialGradient id="g" href="#b"/>'
    )
    done = run(f"<defs>{defs}</defs>{FILLED}", move=WIDER)
    wanted = WIDER(np.array([(11.123456789, 0), (31.123456789, 40)]))
    np.testing.assert_allclose(mapped(done["g"], (0, 0), (10, 10)), wanted, atol=1e-4)
    assert done["b"].attrib.get("gradientTransform") == "matrix(2,1,0,3,11.123456789,0)"
    assert done["g"].get("href") == "#b"


def test_the_map_is_one_of_the_elements_own_coordinates() -> None:
    turned = '<g transform="translate(200,10) rotate(30)">' + RECT.format('fill="url(#g)"') + "</g>"
    matrix = inkex.Transform("translate(200,10) rotate(30)")
    at = [matrix.apply_to_point(corner) for corner in CORNERS]
    corners = [(float(p.x), float(p.y)) for p in at]
    done = run(f"<defs>{GRADIENT}</defs>{turned}", move=LARGER, points=corners)
    inner = np.linalg.inv(np.vstack([matrix.matrix, (0, 0, 1)]))
    outer = np.vstack([matrix.matrix, (0, 0, 1)])
    for point in ((20, 50), (120, 50)):
        now = LARGER((outer @ [*point, 1])[:2])
        np.testing.assert_allclose(mapped(done["g"], point)[0], (inner @ [*now, 1])[:2], atol=1e-3)


def test_paints_of_the_bounding_box_and_plain_colours_stay() -> None:
    box = GRADIENT.replace("userSpaceOnUse", "objectBoundingBox")
    nothing = f'<linearGradient id="h">{STOPS}</linearGradient>'
    rect = RECT.format('fill="url(#g)" stroke="url(#h)"')
    done = run(f"<defs>{box}{nothing}</defs>{rect}", move=WIDER)
    assert done["g"].attrib.get("gradientTransform") is None
    assert done["h"].attrib.get("gradientTransform") is None


@pytest.mark.parametrize("href", ["", 'xlink:href="#v"'])
def test_a_gradient_that_also_paints_something_else_is_copied(href: str) -> None:
    """A reference by inheritance counts, too.  The copy gets an id that is free."""
    stops = f'<linearGradient id="v">{STOPS}</linearGradient>'
    gradient = GRADIENT if not href else re.sub(">.*", f" {href}/>", GRADIENT)
    other = '<g style="fill:url(#g)"><rect id="o" y="200" width="9" height="9"/></g><g id="g-1"/>'
    body = f"<defs>{stops}{gradient}</defs>{FILLED}{other}"
    done = run(body, move=WIDER)
    assert done["g"].attrib.get("gradientTransform") is None
    copy = done[paint_of(done["r"])]
    assert copy.get("id") == "g-2"
    np.testing.assert_allclose(mapped(copy, (120, 50)), [(320, 50)], atol=1e-4)
    assert copy.get(XLINK_HREF) == ("#v" if href else "#g")
    assert not len(copy)


def test_shapes_that_move_alike_go_on_sharing_their_gradient() -> None:
    other = '<path id="s" d="M 130,20 H 180 V 80 H 130 Z" fill="url(#g)"/>'
    body = f"<defs>{GRADIENT}</defs>{STYLED}{other}"
    at = (*CORNERS, (130, 20), (180, 20), (180, 80), (130, 80))
    done = run(body, "r s", AWAY, points=at)
    assert paint_of(done["r"]) == paint_of(done["s"]) == "g"
    np.testing.assert_allclose(mapped(done["g"], (20, 50)), [(170, 120)], atol=1e-3)


def test_shapes_that_move_apart_get_a_gradient_each() -> None:
    other = '<path id="s" d="M 20,120 H 120 V 180 H 20 Z" fill="url(#g)"/>'
    body = f"<defs>{GRADIENT}</defs>{FILLED}{other}"
    at = (*CORNERS, (20, 120), (120, 120), (120, 180), (20, 180))

    def move(p: Array) -> Array:
        return WIDER(p) if p[1] < 100 else AWAY(p)

    done = run(body, "r s", move, points=at)
    assert paint_of(done["r"]) != paint_of(done["s"])
    np.testing.assert_allclose(mapped(done[paint_of(done["r"])], (120, 50)), [(320, 50)], atol=1e-3)
    np.testing.assert_allclose(mapped(done[paint_of(done["s"])], (120, 50)), [(270, 120)], atol=1e-3)


def test_a_gradient_whose_transform_another_takes_over_is_copied() -> None:
    heir = '<linearGradient id="h" xlink:href="#g" x1="5"/><rect id="o" width="5" height="5" fill="url(#h)"/>'
    done = run(f"<defs>{GRADIENT}</defs>{FILLED}{heir}", move=WIDER)
    assert done["g"].attrib.get("gradientTransform") is None
    assert paint_of(done["r"]) == "g-1"


def test_a_pattern_follows() -> None:
    pattern = (
        '<pattern id="p" patternUnits="userSpaceOnUse" width="10" height="10">'
        '<rect width="5" height="5"/></pattern>'
        '<pattern id="g" xlink:href="#p" patternTransform="translate(20,20) scale(2)"/>'
    )
    done = run(f"<defs>{pattern}</defs>{FILLED}", move=WIDER)
    np.testing.assert_allclose(mapped(done["g"], (0, 0), (10, 10)), [(20, 20), (80, 40)], atol=1e-4)
    assert done["p"].attrib.get("patternTransform") is None


def test_transforms_are_written_with_all_their_digits() -> None:
    third = affine((1.0 + 1.0 / 3.0, 1.0), (1.0 / 7.0, 0.0))
    done = run(f"<defs>{GRADIENT}</defs>{FILLED}", move=third)
    numbers = re.findall(r"[\d.]+", done["g"].attrib.get("gradientTransform"))
    assert max(len(number) for number in numbers) > 9
    away = run(f"<defs>{GRADIENT}</defs>{FILLED}", move=affine((1.0, 1.0), (1000.0 / 7.0, 0.0)))
    assert abs(mapped(away["g"], (0, 0))[0, 0] - 1000.0 / 7.0) < 1e-5
    turned = run(RECT.format('transform="rotate(0.123456789012)"'), move=third)
    assert turned["r"].attrib.get("transform") == "rotate(0.123456789012)"
