"""What belongs to the shapes follows them: paints, clip paths, texts; and documents as they are found."""

from __future__ import annotations

import io
import os
import re
import struct
import subprocess
import sys
import zlib
from pathlib import Path
from typing import Any, Callable, Sequence

import inkex
import numpy as np
import pytest
from lxml import etree

from alup import document, pathdata, pipeline
from alup.document import tree
from alup.document.motion import Points, axis_aligned, near, similarity
from alup.document.references import XLINK_HREF
from alup.errors import DocumentError

Array = np.ndarray
Point = Sequence[float]
Map = Callable[[Array], Array]

ROOT = Path(__file__).resolve().parents[1]
SVG = "http://www.w3.org/2000/svg"
INKSCAPE = "http://www.inkscape.org/namespaces/inkscape"
SODIPODI = "http://sodipodi.sourceforge.net/DTD/sodipodi-0.dtd"
STORED = {f"{{https://alup-reshape.github.io/ns}}{name}" for name in ("original", "written")}
HEAD = (
    f'<svg xmlns="{SVG}" xmlns:xlink="http://www.w3.org/1999/xlink" xmlns:inkscape="{INKSCAPE}" '
    f'xmlns:sodipodi="{SODIPODI}" width="400" height="300" viewBox="0 0 400 300">'
)
CORNERS = ((20, 20), (120, 20), (120, 80), (20, 80))
RECT = '<rect id="r" x="20" y="20" width="100" height="60" {}/>'
STOPS = '<stop offset="0" stop-color="#f00"/><stop offset="1" stop-color="#00f"/>'
STYLED = RECT.format('style="fill:url(#g)"')
FILLED = RECT.format('fill="url(#g)"')
GRADIENT = (
    '<linearGradient id="g" gradientUnits="userSpaceOnUse" x1="20" y1="50" x2="120" y2="50">'
    f"{STOPS}</linearGradient>"
)


def affine(scale: Point, shift: Point) -> Map:
    return lambda p: np.asarray(p, dtype=float) * scale + shift


WIDER = affine((3.0, 1.0), (-40.0, 0.0))  # x from 20..120 to 20..320
LARGER = affine((2.0, 2.0), (-20.0, -20.0))
AWAY = affine((1.0, 1.0), (150.0, 70.0))
STILL = affine((1.0, 1.0), (0.0, 0.0))


def handles(move: Map, points: Sequence[Point] = CORNERS) -> str:
    """Handles that carry points along a map."""
    found = []
    for n, point in enumerate(points):
        (x, y), (u, v) = point, move(np.array(point))
        labels = [("pin", x, y)] if (x, y) == (u, v) else [(f"from {n}", x, y), (f"to {n}", u, v)]
        found += [f'<circle inkscape:label="alup:{w}" cx="{a}" cy="{b}" r="2"/>' for w, a, b in labels]
    return "".join(found)


def load(body: str, move: Map = STILL, points: Sequence[Point] = CORNERS, head: str = HEAD) -> Any:
    text = f"{head}{body}{handles(move, points)}</svg>"
    return inkex.load_svg(io.BytesIO(text.encode())).getroot()


def get(root: Any, identity: str) -> Any:
    found = [element for element in root.iter() if element.get("id") == identity]
    assert len(found) == 1, f"{len(found)} elements {identity}"
    return found[0]


class Run:
    """A document through reading, reshaping and writing."""

    def __init__(self, root: Any, ids: str, tandem: bool = True):
        self.root = root
        selected = [get(root, identity) for identity in ids.split()]
        options = pipeline.Options(tandem=tandem)
        self.read = document.read(root, selected, False, tandem)
        result = pipeline.reshape(self.read.drawing, options)
        tolerance = options.fit_tolerance * float(self.read.drawing.size.max())
        self.changed = document.write(self.read, result.refitted, True, tolerance)

    def __getitem__(self, identity: str) -> Any:
        return get(self.root, identity)

    @property
    def skipped(self) -> list[str]:
        return [entry["id"] for entry in self.read.skipped]

    def control(self, element: Any) -> Array:
        """Control points in root user units, (s, 4, 2)."""
        matrix = (tree.parent_matrix(element) @ tree.own_matrix(element))[:2]
        return tree.read_shape(element, matrix).control


def run(body: str, ids: str = "r", move: Map = STILL, tandem: bool = True, **others: Any) -> Run:
    return Run(load(body, move, **others), ids, tandem)


def paint_of(element: Any, name: str = "fill") -> str:
    """The id that a property of the element itself refers to."""
    text = f"{name}:{element.get(name)};" if element.get(name) else ""
    found = re.findall(rf"(?:^|;)\s*{name}\s*:\s*url\(#([^)]+)\)", text + (element.attrib.get("style") or ""))
    assert found, etree.tostring(element)
    return found[-1]


def mapped(gradient: Any, *points: Point) -> Array:
    """Where a gradient's transform takes points of its coordinates."""
    name = "patternTransform" if "pattern" in str(gradient.tag) else "gradientTransform"
    matrix = tree.own_matrix(gradient, name)
    return np.array(points) @ matrix[:2, :2].T + matrix[:2, 2]


# --- fits ---------------------------------------------------------------------------------------


def points(move: Map, at: Sequence[Point]) -> Points:
    old = np.array(at, dtype=float)
    return Points(old, move(old), np.linspace(1.0, 3.0, len(old)))


def test_an_axis_aligned_map_is_found_exactly() -> None:
    fit = axis_aligned(points(affine((3.0, 0.25), (7.0, -9.0)), [*CORNERS, (50, 33)]))
    np.testing.assert_allclose(fit, [[3, 0, 7], [0, 0.25, -9], [0, 0, 1]], atol=1e-12)


def test_a_mirrored_and_a_flattened_shape_keep_an_invertible_map() -> None:
    mirrored = axis_aligned(points(affine((-1.0, 1.0), (0.0, 0.0)), CORNERS))
    np.testing.assert_allclose(mirrored[:2, :2], np.diag([-1.0, 1.0]), atol=1e-12)
    flat = axis_aligned(points(affine((1.0, 0.0), (0.0, 5.0)), CORNERS))
    assert 0.0 < abs(np.linalg.det(flat)) < 0.1


@pytest.mark.parametrize("at", [((0, 5), (50, 5), (80, 5)), ((7, 7), (7, 7))])
def test_what_has_no_extent_keeps_its_scale_there(at: Sequence[Point]) -> None:
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
    """Also by inheritance; the new id is one that is free."""
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


# --- clip paths and masks -----------------------------------------------------------------------

CLIP = '<clipPath id="c"><rect id="cr" x="40" y="10" width="60" height="80"/></clipPath>'
CLIPPED = RECT.format('clip-path="url(#c)"')
MASKED = RECT.format('style="mask:url(#m)"')


def clip_bounds(done: Run, identity: str, outer: Array | None = None) -> Array:
    """Bounds of all shapes in a clip path, in root units if it is used there."""
    shapes = [part for part in done[identity].iter() if part.tag in (f"{{{SVG}}}path", f"{{{SVG}}}rect")]
    points = []
    for part in shapes:
        shape = tree.read_shape(part, tree.own_matrix(part)[:2])
        points.append(shape.control.reshape(-1, 2))
    joined = np.concatenate(points)
    return np.array([joined.min(axis=0), joined.max(axis=0)])


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
    before = clip_bounds(Run(load(f"<defs>{clip}</defs>{CLIPPED}"), "r"), "c" if "use" not in clip else "cr")
    np.testing.assert_allclose(clip_bounds(done, "c"), before + [150, 70], atol=2e-3)
    assert done["r"].get("clip-path") == "url(#c)"
    if "use" in clip:
        assert done["cr"].get("x") == "40"


def test_a_clip_within_a_stretched_shape_is_stretched() -> None:
    inside = CLIP.replace('y="10"', 'y="30"').replace("80", "30")
    done = run(f"<defs>{inside}</defs>{CLIPPED}", move=WIDER)
    np.testing.assert_allclose(clip_bounds(done, "c"), [(80, 30), (260, 60)], atol=1e-3)
    assert [part.tag for part in done["c"]] == [f"{{{SVG}}}path"]
    assert set(done.changed) == {"r", "cr"}


def test_a_clip_that_crosses_keeps_its_place_on_the_curves() -> None:
    done = run(f"<defs>{CLIP}</defs>{CLIPPED}", move=WIDER)
    bounds = clip_bounds(done, "c")
    np.testing.assert_allclose(bounds[:, 0], [80, 260], rtol=0.05)
    assert bounds[0, 1] < 20 < 80 < bounds[1, 1]


def test_a_clip_that_also_cuts_something_else_is_copied() -> None:
    other = '<rect id="o" y="200" width="9" height="9" style="clip-path:url(#c)"/>'
    done = run(f"<defs>{CLIP}</defs>{CLIPPED}{other}", move=AWAY)
    np.testing.assert_array_equal(clip_bounds(done, "c"), [(40, 10), (100, 90)])
    assert done["o"].attrib.get("style") == "clip-path:url(#c)"
    copy = paint_of(done["r"], "clip-path")
    np.testing.assert_allclose(clip_bounds(done, copy), [(190, 80), (250, 160)], atol=2e-3)
    ids = [element.get("id") for element in done.root.iter() if element.get("id")]
    assert len(ids) == len(set(ids))


def test_shapes_in_one_place_go_on_sharing_their_clip() -> None:
    other = '<path id="s" d="M 30,30 H 90 V 70 H 30 Z" clip-path="url(#c)"/>'
    done = run(f"<defs>{CLIP}</defs>{CLIPPED}{other}", "r s", AWAY)
    assert paint_of(done["r"], "clip-path") == paint_of(done["s"], "clip-path") == "c"
    np.testing.assert_allclose(clip_bounds(done, "c"), [(190, 80), (250, 160)], atol=2e-3)


def test_a_clip_is_in_the_user_space_of_what_refers_to_it() -> None:
    at = [(2 * x, 2 * y + 10) for x, y in CORNERS]
    body = f'<defs>{CLIP}</defs><g transform="translate(0,10)"><g transform="scale(2)">{CLIPPED}</g></g>'
    done = run(body, move=AWAY, points=at)
    np.testing.assert_allclose(clip_bounds(done, "c"), [(115, 45), (175, 125)], atol=2e-3)


@pytest.mark.parametrize(("inner", "follows"), [("", True), ('<path id="o" d="M 0,0 H 9"/>', False)])
def test_the_clip_of_a_group_follows_if_all_that_is_drawn_in_it_does(inner: str, follows: bool) -> None:
    hidden = '<path id="h" d="M 0,0 H 9" style="display:none"/>'
    body = f'<defs>{CLIP}</defs><g clip-path="url(#c)"><g>{RECT.format("")}</g>{hidden}{inner}</g>'
    done = run(body, move=AWAY)
    shift = (150, 70) if follows else (0, 0)
    np.testing.assert_allclose(clip_bounds(done, "c"), np.array([(40, 10), (100, 90)]) + shift, atol=2e-3)


def test_a_clip_relative_to_the_bounding_box_stays() -> None:
    clip = CLIP.replace('id="c"', 'id="c" clipPathUnits="objectBoundingBox"')
    done = run(f"<defs>{clip}</defs>{CLIPPED}", move=WIDER)
    assert done["cr"].tag == f"{{{SVG}}}rect"
    assert len(done.read.shapes) == 1


def test_one_clip_in_two_places_becomes_two() -> None:
    again = CLIPPED.replace('id="r"', 'id="s"')
    body = f'<defs>{CLIP}</defs>{CLIPPED}<g transform="translate(0,100)">{again}</g>'
    done = run(body, "r s", AWAY)
    first, second = paint_of(done["r"], "clip-path"), paint_of(done["s"], "clip-path")
    assert first != second
    np.testing.assert_allclose(clip_bounds(done, first), [(190, 80), (250, 160)], atol=2e-3)
    assert clip_bounds(done, second)[0, 0] > 100


def test_a_huge_clip_does_not_make_the_samples_coarse() -> None:
    huge = CLIP.replace('x="40" y="10"', 'x="-4000" y="50"').replace("60", "9000")
    assert [shape.name for shape in run(f"<defs>{huge}</defs>{CLIPPED}").read.shapes] == ["r"]
    assert [shape.name for shape in run(f"<defs>{CLIP}</defs>{CLIPPED}").read.shapes] == ["r", "cr"]


def test_the_clip_of_a_clip_follows() -> None:
    outer = '<clipPath id="d"><rect id="dr" x="50" y="15" width="20" height="70"/></clipPath>'
    clip = CLIP.replace('id="c"', 'id="c" clip-path="url(#d)"')
    done = run(f"<defs>{clip}{outer}</defs>{CLIPPED}", move=AWAY)
    np.testing.assert_allclose(clip_bounds(done, "d"), [(200, 85), (220, 155)], atol=2e-3)


def test_a_mask_its_region_and_its_paint_follow() -> None:
    mask = (
        '<mask id="m" maskUnits="userSpaceOnUse" x="40" y="30" width="60" height="40">'
        '<rect id="mr" x="40" y="30" width="60" height="40" fill="url(#g)"/></mask>'
    )
    done = run(f"<defs>{GRADIENT}{mask}</defs>{MASKED}", move=WIDER)
    np.testing.assert_allclose(clip_bounds(done, "m"), [(80, 30), (260, 70)], atol=1e-3)
    region = [float(done["m"].get(side)) for side in ("x", "y", "width", "height")]
    np.testing.assert_allclose(region, [80, 30, 180, 40], atol=1e-3)
    np.testing.assert_allclose(mapped(done["g"], (120, 50)), [(320, 50)], atol=1e-3)


def test_clips_do_not_count_as_selected() -> None:
    with pytest.raises(DocumentError, match="No path is selected"):
        run(f'<defs>{CLIP}</defs>{CLIPPED}<text id="t" clip-path="url(#c)">A</text>', "t", AWAY)
    whole = document.read(load(f"<defs>{CLIP}</defs>{CLIPPED}"), [], False)
    assert [shape.name for shape in whole.shapes] == ["r", "cr"]
    assert [
        shape.name for shape in document.read(load(f"<defs>{CLIP}</defs>{RECT.format('')}"), [], False).shapes
    ] == ["r"]


# --- texts, images, clones ----------------------------------------------------------------------

TEXT = '<text id="t" x="50" y="55" font-size="12" {}>Label</text>'
IMAGE = '<image id="i" x="40" y="40" width="30" height="20" transform="rotate(10)"/>'


def placed(element: Any, *at: Point) -> Array:
    matrix = tree.parent_matrix(element) @ tree.own_matrix(element)
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
    below = '<path id="b" d="M 20,140 H 120 V 200 H 20 Z"/>'  # and not lifted by what lies below
    at = (*CORNERS, (20, 140), (120, 140), (120, 200), (20, 200))
    done = run(RECT.format("") + TEXT.format("") + below, "r t b", WIDER, points=at)
    box = done.read.carried[0].box
    middle = (box.min(axis=0) + box.max(axis=0)) / 2.0
    np.testing.assert_allclose(placed(done["t"], middle)[0], WIDER(middle), atol=1e-3)
    matrix = tree.own_matrix(done["t"])
    assert matrix[0, 0] == matrix[1, 1]
    assert 1.0 < matrix[0, 0] < 3.0
    assert not matrix[0, 1] and not matrix[1, 0]


def test_a_text_of_unknown_size_is_only_shifted() -> None:
    done = run(RECT.format("") + TEXT.replace("12", "2em").format(""), "r t", LARGER)
    matrix = tree.own_matrix(done["t"])
    np.testing.assert_array_equal(matrix[:2, :2], np.eye(2))
    np.testing.assert_allclose(matrix[:2, 2], LARGER(np.array([50, 55])) - (50, 55), atol=1e-2)


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
    assert done.skipped == ["v", "w"]
    assert all("Unlink Clone" in entry["why"] for entry in done.read.skipped)
    assert etree.tostring(done["u"]).count(b"transform") == 0


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


def test_what_a_style_sheet_hides_is_not_part_of_everything() -> None:
    style = "<style>.n {display:none} .h {visibility:hidden} .s {visibility:visible}</style>"
    shapes = (
        '<path id="a" class="n" d="M 0,0 H 9"/><g class="h"><path id="b" d="M 0,0 H 9"/>'
        '<path id="v" class="s" d="M 30,30 H 90"/></g>'
    )
    whole = document.read(load(style + RECT.format("") + shapes), [], False)
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
    np.testing.assert_allclose(done.control(drawn)[:, 0], np.array(CORNERS) + (150, 70), atol=1e-3)
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
    np.testing.assert_allclose(done.control(done["r"])[:, 0], np.array(CORNERS) + (150, 70), atol=1e-3)


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
    before, after = pathdata.parse(ODD), pathdata.parse(done["r"].get("d"))
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


# --- pictures -----------------------------------------------------------------------------------


def pixels(png: bytes) -> Array:
    """(height, width, 4) of an 8-bit RGBA picture."""
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    at, data = 8, b""
    while at < len(png):
        length, kind = struct.unpack(">I4s", png[at : at + 8])
        chunk = png[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", chunk[:10])
            assert (depth, colour) == (8, 6)
        data += chunk if kind == b"IDAT" else b""
        at += length + 12
    rows = np.frombuffer(zlib.decompress(data), dtype=np.uint8).reshape(height, 1 + 4 * width)
    picture = np.zeros((height + 1, width + 1, 4), dtype=int)  # with an empty row above and column before
    for y in range(height):
        mode, line = rows[y, 0], rows[y, 1:].reshape(width, 4).astype(int)
        for x in range(width):
            left, up, corner = picture[y + 1, x], picture[y, x + 1], picture[y, x]
            guess = left + up - corner
            off = [np.abs(guess - one) for one in (left, up, corner)]
            nearest = np.where(
                (off[0] <= off[1]) & (off[0] <= off[2]), left, np.where(off[1] <= off[2], up, corner)
            )
            by = (0, left, up, (left + up) // 2, nearest)[mode]
            picture[y + 1, x + 1] = (line[x] + by) % 256
    return picture[1:, 1:]


def rendered(body: str, ids: Sequence[str], move: Map, folder: Path) -> Array:
    """The whole effect, and the drawing that comes of it as a picture."""
    before, after = folder / "before.svg", folder / "after.svg"
    before.write_text(f"{HEAD}{body}{handles(move)}</svg>")
    command = [sys.executable, str(ROOT / "alup_reshape.py"), "--keep_handles=false", f"--output={after}"]
    done = subprocess.run(
        [*command, *(f"--id={one}" for one in ids), str(before)], capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")
    return pixels(subprocess.run(["rsvg-convert", str(after)], capture_output=True, check=True).stdout)


def test_the_picture_of_a_stretched_gradient(tmp_path: Path) -> None:
    body = f"<defs>{GRADIENT}</defs>{FILLED}"
    picture = rendered(body, ["r"], WIDER, tmp_path)
    colours = [(254, 0, 1, 255), (127, 0, 128, 255), (1, 0, 254, 255)]
    np.testing.assert_allclose(picture[50, [21, 170, 318]], colours, atol=3)


def test_the_picture_of_a_stretched_clip(tmp_path: Path) -> None:
    inside = CLIP.replace('y="10"', 'y="30"').replace("80", "30")
    picture = rendered(f"<defs>{inside}</defs>{CLIPPED}", ["r"], WIDER, tmp_path)
    assert list(picture[45, [77, 83, 257, 263], 3]) == [0, 255, 255, 0]
    assert list(picture[[28, 32, 58, 62], 170, 3]) == [0, 255, 255, 0]


def test_the_picture_of_a_clone(tmp_path: Path) -> None:
    """The gradient of the original paints the clone, too, and its clip cuts it."""
    body = f'<defs>{GRADIENT}</defs>{RECT.format("")}<use id="u" xlink:href="#r" y="100"/>'
    style = "<style>rect {fill:url(#g)}</style>"
    picture = rendered(style + body, ["r", "u"], WIDER, tmp_path)
    np.testing.assert_array_equal(picture[150, 20:320], picture[50, 20:320])
    np.testing.assert_allclose(picture[150, 318], (1, 0, 254, 255), atol=3)


def test_inkscape_draws_an_arc_as_it_was_written(tmp_path: Path) -> None:
    """Not anew from the attributes that it was made of."""
    arc = (
        '<path id="r" sodipodi:type="arc" sodipodi:cx="70" sodipodi:cy="50" sodipodi:rx="50" sodipodi:ry="30"'
        ' d="M 120,50 A 50,30 0 1 1 20,50 A 50,30 0 1 1 120,50 Z"/>'
    )
    done = Run(load(arc, AWAY, points=((20, 50), (70, 20), (120, 50), (70, 80))), "r")
    output = tmp_path / "after.svg"
    etree.ElementTree(done.root).write(str(output))
    environment = {"PATH": os.environ["PATH"], "HOME": str(tmp_path), "INKSCAPE_PROFILE_DIR": str(tmp_path)}
    told = subprocess.run(
        ["inkscape", "--query-all", str(output)], capture_output=True, text=True, env=environment, timeout=60
    )
    lines = [line.split(",") for line in told.stdout.splitlines()]
    box = {name: [float(value) for value in values] for name, *values in lines}
    np.testing.assert_allclose(box["r"], [170, 90, 100, 60], atol=0.1)
