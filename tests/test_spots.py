# SPDX-License-Identifier: GPL-2.0-or-later
"""Places for handles: exact points of curves, and nodes by Inkscape's numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from builders import BLOB, Array, curve_points, rotation
from hypothesis import given
from hypothesis import strategies as st

from alup.handles import candidates
from alup.svg import path_data


def curves(*paths: str) -> Array:
    """All segments of path data, (S, 4, 2)."""
    return np.concatenate([s.control for d in paths for s in path_data.parse(d)])


def same_points(found: Array, wanted: object, within: float = 1e-9) -> bool:
    """Whether two sets of points are the same, in whatever order."""
    a, b = np.asarray(found, dtype=float), np.asarray(wanted, dtype=float)
    away = np.linalg.norm(a[:, None] - b[None], axis=2)
    return len(a) == len(b) and bool(
        (away.min(axis=0) <= within).all() and (away.min(axis=1) <= within).all()
    )


# --- extremes -------------------------------------------------------------------------------------------


def test_the_extremes_of_a_cubic_are_exact() -> None:
    # x = 3 t - 2 t^3, y = 3 t (1 - t)
    found = candidates.extremes(np.array([[[0.0, 0], [1, 1], [2, 1], [1, 0]]]), 1e-9, 0.1)
    t = math.sqrt(0.5)
    rightmost, lowest = [3 * t - 2 * t**3, 3 * t * (1 - t)], [1.25, 0.75]
    assert same_points(found, [[0, 0], [0, 0], [1, 0], rightmost, lowest])


@pytest.mark.parametrize("turned", [0.0, 20.0, 45.0, 77.0])
def test_the_extremes_of_an_ellipse(turned: float) -> None:
    a, b, phi = 30.0, 10.0, math.radians(turned)
    ends = np.array([[a, 0.0], [-a, 0.0]]) @ rotation(turned).T + [100.0, 50.0]
    d = "M{} {} A30,10 {} 0 1 {} {} A30,10 {} 0 1 {} {} Z".format(
        *ends[0], turned, *ends[1], turned, *ends[0]
    )
    found = candidates.extremes(curves(d), 1e-9, 1.0)
    wide = math.hypot(a * math.cos(phi), b * math.sin(phi))
    high = math.hypot(a * math.sin(phi), b * math.cos(phi))
    slant = (a * a - b * b) * math.sin(phi) * math.cos(phi)
    wanted = np.array([[wide, slant / wide], [slant / high, high]])
    wanted = np.concatenate([wanted, -wanted]) + [100.0, 50.0]
    # Cubics are within 3e-4 of the ellipse.  An extreme may move along it by the square root of that.
    assert same_points(found, wanted, math.sqrt(3e-4) * a)
    assert np.ptp(found, axis=0) == pytest.approx(np.ptp(wanted, axis=0), rel=3e-4)


@given(st.lists(st.tuples(*[st.floats(-100, 100)] * 8), min_size=1, max_size=4))
def test_no_point_of_the_curves_is_further_out(numbers: list[tuple[float, ...]]) -> None:
    control = np.array(numbers).reshape(-1, 4, 2)
    found, box = candidates.extremes(control, 1e-9, 1e-6), candidates.bounds(control)
    points = curve_points(control, 201)
    assert (points >= box[0] - 1e-9).all()
    assert (points <= box[1] + 1e-9).all()
    assert np.abs(found.min(axis=0) - box[0]).max() <= 1e-6
    assert np.abs(found.max(axis=0) - box[1]).max() <= 1e-6
    steps = np.linalg.norm(np.diff(points.reshape(-1, 201, 2), axis=1), axis=2)
    assert np.linalg.norm(points[:, None] - found[None], axis=2).min(axis=0).max() <= steps.max() + 1e-9


def test_a_level_side_has_handles_at_both_ends() -> None:
    found = candidates.extremes(curves("M10,20 H50 V90 H10 Z"), 0.01, 5.0)
    assert same_points(found[candidates.thin(found, 1.0)], [[10, 20], [50, 20], [50, 90], [10, 90]])
    # Two feet of different objects, and a rounded top whose level part is a curve.
    found = candidates.extremes(
        curves("M0,0 H5 V40 H0 Z", "M45,5 H50 V40.001 H45 Z", "M10,0 C20,-0.001 30,-0.001 40,0"), 0.01, 5.0
    )
    assert same_points(found[candidates.thin(found, 1.0)], [[0, 0], [0, 40], [50, 5], [50, 40.001], [40, 0]])


def test_a_short_level_side_has_one_in_the_middle() -> None:
    house = curves("M0,40 L18,0 H22 L40,40 Z")
    assert same_points(candidates.extremes(house, 0.01, 5.0), [[0, 40], [20, 0], [40, 40], [0, 40], [40, 40]])
    # There is no curve between two feet that are near each other.
    feet = curves("M18,40 L20,0 L22,40 L20,30 Z")
    assert same_points(candidates.extremes(feet, 0.01, 5.0)[[-1]], [[22, 40]])


def test_lone_points_and_lines_are_no_obstacle() -> None:
    control = np.concatenate([np.tile([5.0, 5.0], (1, 4, 1)), curves("M0,0 L10,10")])
    assert same_points(candidates.extremes(control, 1e-9, 0.1), [[0, 0], [0, 0], [10, 10], [10, 10]])


# --- corners --------------------------------------------------------------------------------------------


def corners(d: str) -> tuple[Array, Array]:
    (subpath,) = path_data.parse(d)
    return candidates.corners(subpath.control, subpath.closed)


def polygon(count: int) -> tuple[str, Array]:
    angle = 2 * np.pi * np.arange(count) / count
    points = 50 + 40 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return "M" + " L".join(f"{x!r},{y!r}" for x, y in points.tolist()) + " Z", points


@pytest.mark.parametrize("count", [3, 4, 5, 11])
def test_all_corners_of_a_polygon(count: int) -> None:
    d, wanted = polygon(count)
    points, turns = corners(d)
    assert same_points(points, wanted)
    assert turns == pytest.approx(np.full(count, 360.0 / count))


def test_facets_of_something_round_are_no_corners() -> None:
    assert len(corners(polygon(13)[0])[0]) == 0
    assert len(corners("M0,50 A50,50 0 0 1 100,50 A50,50 0 0 1 0,50 Z")[0]) == 0


def test_open_curves_have_ends() -> None:
    points, turns = corners("M0,0 C10,0 20,0 30,0 L30,30")
    assert same_points(points, [[0, 0], [30, 0], [30, 30]])
    assert sorted(turns) == pytest.approx([90.0, 180.0, 180.0])


def test_retracted_arms_and_repeated_nodes_do_not_change_corners() -> None:
    square = [[0, 0], [10, 0], [10, 10], [0, 10]]
    assert same_points(corners("M0,0 C0,0 10,0 10,0 L10,0 V10 C10,10 5,10 0,10 H0 Z")[0], square)
    # The node is smooth, although one control arm is retracted.
    assert same_points(corners("M0,0 C0,0 5,0 10,0 C15,0 20,0 30,0")[0], [[0, 0], [30, 0]])
    assert len(candidates.corners(np.tile([1.0, 2.0], (3, 4, 1)), True)[0]) == 0


def test_a_curve_that_turns_back_has_a_corner() -> None:
    points, turns = corners("M0,0 L10,0 L0,0")
    assert same_points(points, [[0, 0], [10, 0], [0, 0]])
    assert turns.min() == pytest.approx(180.0)


# --- crossings ------------------------------------------------------------------------------------------


def crossings(d: str, point: object, direction: object) -> Array:
    return candidates.crossings(curves(d), np.asarray(point, float), np.asarray(direction, float), 1e-7)


@pytest.mark.parametrize("x", [0.0, 7.5, -3.0])
def test_a_line_crosses_a_polygon(x: float) -> None:
    square = "M-10,-10 H10 V10 H-10 Z"
    assert same_points(crossings(square, [x, 400], [0, -3]), [[x, -10], [x, 10]])
    slanted = [[x - 10, -10], [10, 10 - x]] if x > 0 else [[-10, -10 - x], [x + 10, 10]]
    if x == 0.0:
        found = crossings(square, [100, 100], [2, 2])
        assert same_points(found[candidates.thin(found, 1e-6)], [[-10, -10], [10, 10]])
    elif x > 0.0:
        assert same_points(crossings(square, [x, 0], [1, 1]), slanted)
    else:
        assert same_points(crossings(square, [x, 0], [1, 1]), [[-10, -10 - x], [10 + x, 10]])


def test_a_line_crosses_a_circle_at_its_chord() -> None:
    circle = "M50,0 A50,50 0 0 1 -50,0 A50,50 0 0 1 50,0 Z"
    found = crossings(circle, [0, 30], [1, 0])
    assert same_points(found, [[40, 30], [-40, 30]], 0.02)
    assert np.abs(found[:, 1] - 30).max() < 1e-12


def test_every_crossing_with_a_curve_is_found() -> None:
    s = "M0,0 C40,60 -20,-30 20,30"
    assert len(crossings(s, [0, 15], [1, 0])) == 3
    assert same_points(crossings(s, [0, 15], [1, 0])[[1]], [[10, 15]])


def test_a_line_that_only_touches_counts() -> None:
    assert same_points(crossings("M0,0 C0,4 4,4 4,0", [9, 3], [1, 0]), [[2, 3]], 1e-6)
    assert same_points(crossings("M0,0 L5,5 L10,0", [0, 5], [1, 0])[:1], [[5, 5]])
    assert len(crossings("M0,0 C0,4 4,4 4,0", [9, 3.0001], [1, 0])) == 0


def test_a_segment_on_the_line_gets_handles_at_its_ends() -> None:
    found = crossings("M0,0 H10 V5 H0 Z", [-7, 0], [1, 0])
    assert same_points(found[candidates.thin(found, 1e-6)], [[0, 0], [10, 0]])


@given(st.floats(0, 360), st.floats(-40, 40))
def test_crossings_are_on_both_and_none_is_left_out(angle: float, offset: float) -> None:
    control = curves(BLOB)
    direction = rotation(angle) @ [1.0, 0.0]
    normal = np.array([-direction[1], direction[0]])
    point = np.array([70.0, 85.0]) + offset * normal
    found = candidates.crossings(control, point, direction, 1e-9)
    assert np.abs((found - point) @ normal).max(initial=0.0) < 1e-8
    assert np.abs(candidates.nearest(control, found) - found).max(initial=0.0) < 1e-6
    height = (curve_points(control, 400).reshape(len(control), 400, 2) - point) @ normal
    changes = int((height[:, 1:] * height[:, :-1] < 0.0).sum())
    assert len(found) >= changes


# --- thinning, nearest points, arrows -------------------------------------------------------------------


def test_thinning_keeps_the_first_of_those_that_are_near() -> None:
    points = np.array([[0, 0], [1, 0], [2, 0], [10, 0], [10.5, 0]], dtype=float)
    assert candidates.thin(points, 1.0).tolist() == [0, 2, 3]
    assert candidates.thin(points[:0], 1.0).tolist() == []


@given(st.lists(st.tuples(st.floats(0, 10), st.floats(0, 10)), max_size=30))
def test_remaining_points_are_apart_and_cover_the_others(numbers: list[tuple[float, float]]) -> None:
    points = np.array(numbers).reshape(-1, 2)
    kept = points[candidates.thin(points, 2.0)]
    away = np.linalg.norm(kept[:, None] - kept[None], axis=2) + 9.0 * np.eye(len(kept))
    assert (away > 2.0).all()
    for point in points:
        assert np.linalg.norm(kept - point, axis=1).min() <= 2.0


def test_the_nearest_point_of_a_line_is_its_foot() -> None:
    control = curves("M0,0 L10,0", "M0,50 L10,50")
    found = candidates.nearest(control, np.array([[3.0, 4.0], [-2.0, 47.0], [12.0, 1.0]]))
    assert same_points(found, [[3, 0], [0, 50], [10, 0]])


def test_an_arrow_points_from_rest_to_the_edge_of_the_circle() -> None:
    start, end = np.array([1.0, 2.0]), np.array([4.0, 6.0])
    outline = candidates.arrow(start, end, 1.0, 0.1)
    assert outline is not None
    assert outline[3] == pytest.approx(end - 1.0 * (end - start) / 5.0)
    assert outline[[0, 6]].mean(axis=0) == pytest.approx(start)
    assert np.linalg.norm(outline[0] - outline[6]) == pytest.approx(0.1)
    across = (outline - start) @ [-0.8, 0.6]
    assert across == pytest.approx(-across[::-1])


@pytest.mark.parametrize("end", [(0.0, 0.0), (1.2, 0.0)])
def test_no_arrow_under_the_circle(end: tuple[float, float]) -> None:
    assert candidates.arrow(np.zeros(2), np.array(end), 1.0, 0.1) is None


# --- nodes as the node tool counts them -----------------------------------------------------------------

# Path data, and how many nodes of each subpath Inkscape 1.2.2 named when all were selected.
COUNTED = {
    "closed by a line": ("M10,10 L60,10 L60,60 L10,60 Z M20,20 L30,20 L30,30 L20,20 Z", [4, 3]),
    "closed where it began": ("M300,200 C310,180 330,180 340,200 C330,220 310,220 300,200 Z", [2]),
    "ends where it began": ("M300,200 C310,180 330,180 340,200 C330,220 310,220 300,200", [3]),
    "lone points don't count": (
        "M100,10 C120,0 130,30 150,10 M160,10 M160,20 L180,20 L180,20 L190,40 M200,10 Z "
        "M205,10 L215,10 L205,20 z l-3,-3",
        [2, 4, 3, 2],
    ),
    "quadratic": ("M10,100 Q30,80 50,100 T90,100 L90,130 z", [4]),
    "circle of arcs": (
        "m 300,150 a 20,20 0 0 1 -20,20 20,20 0 0 1 -20,-20 20,20 0 0 1 20,-20 20,20 0 0 1 20,20 z",
        [4],
    ),
    "relative, closed but for rounding": (
        "m 100,100 c 20,-20 100,0 100,100 -50,100 -100,0 -100.0000005,-100 z",
        [2],
    ),
    "closed but for the last bits": (
        "M46.854,0.018 c-1.476-0.144-4.104,0.108-7.74,0.9 c 5.1,0.3,9,1,15.045-0.9 H46.854 z",
        [4],
    ),
    "relative after an absolute start": (
        "M46.854,0.018 c-1.476-0.144-4.104,0.108-7.74,0.9 c 5.1,0.3,9,1,7.74-0.9 z",
        [2],
    ),
    "sums of decimals": ("m 100.1,100.2 l 0.3,0.3 0.3,0.1 -0.6,-0.4 z", [3]),
    "not quite closed": ("M100,100 C120,80 200,100 200,200 C150,300 100,200 100.000002,100 Z", [3]),
    "arc of four": ("M300,60 A50,50 0 1 1 220,60 L260,90 Z", [6]),
    "scaled arc of two": ("M10,250 A 180,40 20 0 1 350,250 L 360,280", [4]),
    "quarter, small": ("M10,0 A10,10 0 0 1 0,10", [2]),
    "arc of three": ("M2004.502100,1936.631497 A37.107613,63.840104 0.0000 1 1 1964.561906,2018.933553", [4]),
    "arc of three, rotated": (
        "M2877.198271,2061.976300 A929.634553,863.866760 124.4566 0 1 1187.989896,2418.651526",
        [4],
    ),
    "arc of five": ("M3636.156002,2000.000000 A1636.156002,1636.156002 0 1 1 2000.000000,363.843998", [6]),
    "arc of six": ("M2152.663514,2810.298886 A824.554688,824.554688 0 1 1 2755.509820,2330.295845", [7]),
    "arc of seven": ("M3837.930375,2000.000000 A1837.930375,1837.930375 0 1 1 2000.000000,162.069625", [8]),
    "arc of four, back": ("M1970.617726,2000.000000 A29.382274,29.382274 0 1 0 2000.000000,1970.617726", [5]),
}


@pytest.mark.parametrize(("d", "count"), COUNTED.values(), ids=COUNTED.keys())
def test_nodes_are_as_many_as_in_inkscape(d: str, count: list[int]) -> None:
    assert [len(found) for found in candidates.nodes(path_data.parse(d))] == count


def test_nodes_are_in_their_order() -> None:
    first, second = candidates.nodes(path_data.parse("M1,2 L3,4 H9 V0 Z M7,7 Z m5,5 Q1,1 2,3"))
    assert first.tolist() == [[1, 2], [3, 4], [9, 4], [9, 0]]
    assert second.tolist() == [[12, 12], [2, 3]]


def test_nodes_of_polylines_are_those_of_inkex() -> None:
    import inkex

    d = "M1,2 L3,4 9,4 9,0 M7,7 C1,1 2,2 3,3 S 5,5 6,1"
    mine = candidates.nodes(path_data.parse(d))
    theirs = inkex.Path(d).to_superpath()
    assert [[list(node[1]) for node in subpath] for subpath in theirs] == [found.tolist() for found in mine]


def test_an_arc_is_halved_again_and_again_by_its_angle() -> None:
    # Inkscape divides three quarters of a circle at 1/4, 1/2 and 3/4, and the rest once more.
    (found,) = candidates.nodes(
        path_data.parse("M3837.930375,2000 A1837.930375,1837.930375 0 1 1 2000,162.069625")
    )
    angle = np.degrees(np.unwrap(np.arctan2(found[:, 1] - 2000, found[:, 0] - 2000)))
    parts = angle / 270.0 * 8.0
    assert parts[[0, -1]] == pytest.approx([0.0, 8.0], abs=1e-6)
    assert parts == pytest.approx(np.round(parts), abs=1e-6)


@pytest.mark.parametrize("sweep", [0, 1])
@pytest.mark.parametrize("flag", [0, 1])
def test_nodes_of_an_arc_are_on_its_curve(flag: int, sweep: int) -> None:
    subpaths = path_data.parse(f"M0,0 A300,100 30 {flag} {sweep} 200,50 A10,10 0 0 0 1000,0")
    (found,) = candidates.nodes(subpaths)
    assert len(found) > 4
    assert np.abs(candidates.nearest(subpaths[0].control, found) - found).max() < 1e-9


def test_the_series_is_that_of_the_sine() -> None:
    t = np.linspace(0.0, 1.0, 7)
    series = candidates._sine(0.3, 1.4)
    assert candidates._terms(t) @ series.ravel() == pytest.approx(np.sin(0.3 + 1.1 * t), abs=1e-9)
    part = candidates._part(series[None], 0.25, 0.75)
    assert candidates._terms(t) @ part.ravel() == pytest.approx(np.sin(0.575 + 0.55 * t), abs=1e-9)
