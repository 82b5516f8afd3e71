# SPDX-License-Identifier: GPL-2.0-or-later
"""Moved samples -> segments: what comes back exactly, what stays smooth, where nodes are added."""

from __future__ import annotations

from typing import Callable

import numpy as np
import pytest
from builders import BLOB, curve_points, drawing, rotation, sampled
from scipy.spatial import cKDTree

from alup.geometry.bezier import evaluate, subrange
from alup.model import Drawing, Refitted
from alup.network import weld
from alup.network.sampling import sample
from alup.refit import control_arms, refit

Map = Callable[[np.ndarray], np.ndarray]

PATHS = {
    "blob": (BLOB,),
    "circle": ("M0,0 C0,55 100,55 100,0 C100,-55 0,-55 0,0 Z",),
    "lines": ("M0,0 H100 V60 L20,80 Z",),
    "mixed": ("M0,0 L40,0 C60,0 80,20 80,40 L80,80 M10,30 C20,50 30,30 50,60",),
    "loop": ("M0,0 C80,80 -80,80 0,0 Z",),
    "shared": ("M0,0 H50 C60,20 40,40 50,60 H0 Z", "M50,0 H100 V60 H50 C40,40 60,20 50,0 Z"),
    "closer": ("M0,0 H100 V100 L0,0.003 Z",),
    "retracted": ("M0,0 C0,0 60,0 60,60 C60,120 120,90 120,90 Z",),
}


def wave(points: np.ndarray) -> np.ndarray:
    """A smooth map that is far from affine; angles change, smoothness does not."""
    x, y = points[..., 0], points[..., 1]
    return np.stack([x + 8 * np.sin(y / 25.0), y + 6 * np.sin(x / 30.0 + 1.0)], axis=-1)


def fitted(
    before: Drawing, by: Map, spacing: float = 1.0, tolerance: float = 0.05, held: tuple[int, ...] = ()
) -> Refitted:
    net, samples = sampled(before, spacing)
    moved = by(samples.points)
    return refit.refit(before, net, samples, moved, np.array(held, dtype=int), tolerance)


def slow_distance(found: Refitted, before: Drawing, by: Map) -> float:
    """Largest distance from the mapped input to the result and back, by dense points."""
    wanted = by(curve_points(before.control, 6000))
    got = curve_points(found.control, 3000)
    return float(max(cKDTree(got).query(wanted)[0].max(), cKDTree(wanted).query(got)[0].max()))


def direction(vectors: np.ndarray) -> np.ndarray:
    return vectors[:, 0] + 1j * vectors[:, 1]


def corners(control: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Degrees that a path turns by where one segment ends and the next (index or -1) begins."""
    here = np.flatnonzero(after >= 0)
    a, b = control[here], control[after[here]]
    leaving = direction(b[:, 1] - b[:, 0])
    short = np.abs(leaving) < 1e-9
    leaving[short] = direction(b[:, 2] - b[:, 0])[short]
    arriving = direction(a[:, 3] - a[:, 2])
    short = np.abs(arriving) < 1e-9
    arriving[short] = direction(a[:, 3] - a[:, 1])[short]
    return np.degrees(np.angle(leaving / arriving))


def following_after(before: Drawing, found: Refitted) -> np.ndarray:
    """The segment that goes on from each new one's end, or -1."""
    result = []
    for n, source in enumerate(found.source):
        if n + 1 < len(found.source) and found.source[n + 1] == source:
            result.append(n + 1)
        else:
            goes = before.following[source]
            result.append(-1 if goes < 0 else int(np.searchsorted(found.source, goes)))
    return np.array(result)


# --- exact answers ------------------------------------------------------------------------------


@pytest.mark.parametrize("paths", PATHS.values(), ids=PATHS.keys())
@pytest.mark.parametrize("spacing", [0.5, 7.0, 1000.0])
def test_the_identity_is_exact(paths: tuple[str, ...], spacing: float) -> None:
    before = drawing(*paths)
    found = fitted(before, lambda points: points, spacing, 1e-9)
    assert found.control.shape == before.control.shape
    assert np.abs(found.control - before.control).max() < 1e-11 * before.diagonal
    assert (found.source == np.arange(len(before.control))).all()
    assert (found.line == before.line).all()
    assert not found.smooth_start.any()
    assert found.error < 1e-12


SIMILARITIES = {
    "translation": (np.eye(2), (30.0, -7.0)),
    "grow": (2.5 * np.eye(2), (1.0, 1.0)),
    "shrink": (0.01 * np.eye(2), (0.0, 0.0)),
    "turn": (rotation(37.0), (0.0, 0.0)),
    "turn and scale": (3.0 * rotation(-140.0), (4.0, 4.0)),
}


@pytest.mark.parametrize(("linear", "shift"), SIMILARITIES.values(), ids=SIMILARITIES.keys())
@pytest.mark.parametrize("name", list(PATHS))
@pytest.mark.parametrize(("spacing", "allowed"), [(0.5, 1e-6), (7.0, 1e-5), (1000.0, 1e-5)])
def test_similarities_come_back(
    name: str, linear: np.ndarray, shift: tuple[float, float], spacing: float, allowed: float
) -> None:
    """Tolerances are of the diagonal; where samples are few, on curves, they are where tables say."""
    before = drawing(*PATHS[name])
    found = fitted(before, lambda points: points @ linear.T + shift, spacing, 0.05)
    assert found.control.shape == before.control.shape
    size = max(1.0, float(np.sqrt(np.linalg.det(linear)))) * before.diagonal
    tolerance = allowed * size
    if name == "closer":  # the closing segment of rounding size is carried along as it is
        tolerance += 2 * 0.003 * max(1.0, size / before.diagonal)
    if name == "loop" and spacing == 1000.0:  # three samples and no chord
        tolerance = 1e-4 * size
    assert np.abs(found.control - (before.control @ linear.T + shift)).max() < tolerance


AFFINE = {
    "stretch": np.diag([2.0, 0.5]),
    "mirror": np.diag([-1.0, 1.0]),
    "skew": np.array([[1.0, 0.6], [0.0, 1.0]]),
    "general": np.array([[0.3, -1.1], [0.9, 0.5]]),
}


@pytest.mark.parametrize("linear", AFFINE.values(), ids=AFFINE.keys())
@pytest.mark.parametrize("name", [name for name in PATHS if name != "closer"])
def test_affine_maps_come_back_with_all_nodes(name: str, linear: np.ndarray) -> None:
    before = drawing(*PATHS[name])
    found = fitted(before, lambda points: points @ linear.T + [5.0, 5.0], 1.0, 0.01)
    assert found.control.shape == before.control.shape
    wanted = before.control @ linear.T + [5.0, 5.0]
    assert np.abs(found.control - wanted).max() < 1e-6 * before.diagonal
    assert found.error < 1e-6 * before.diagonal


# --- smooth nodes and corners -------------------------------------------------------------------


@pytest.mark.parametrize("spacing", [0.5, 2.0, 10.0])
@pytest.mark.parametrize("tolerance", [2.0, 0.05, 1e-3])
@pytest.mark.parametrize("name", ["blob", "circle", "mixed", "retracted"])
def test_smooth_nodes_keep_exactly_the_corner_they_had(name: str, spacing: float, tolerance: float) -> None:
    before = drawing(*PATHS[name])
    found = fitted(before, wave, spacing, tolerance)
    was = corners(before.control, before.following)
    smooth_ends = np.flatnonzero(before.following >= 0)[np.abs(was) < 1.0]
    assert len(smooth_ends)
    after = following_after(before, found)
    now = corners(found.control, after)
    ends = np.flatnonzero(after >= 0)
    for segment, angle in zip(smooth_ends, was[np.abs(was) < 1.0]):
        last = np.flatnonzero(found.source == segment)[-1]
        # A line beside a curve: after the line was divided they may be lines both.
        both_lines = found.line[last] and found.line[after[last]]
        assert both_lines or now[ends == last][0] == pytest.approx(angle, abs=1e-6)


@pytest.mark.parametrize("degrees", [0.3, -0.9, 2.0])
def test_a_small_corner_is_kept_to_its_size(degrees: float) -> None:
    turned = np.array([60.0, 0.0]) + rotation(degrees) @ [20.0, 0.0]
    before = drawing(f"M0,0 C20,30 40,0 60,0 C{turned[0]},{turned[1]} 100,20 120,60")
    assert corners(before.control, before.following)[0] == pytest.approx(degrees)
    found = fitted(before, wave, 1.0, 0.05)
    after = following_after(before, found)
    last = np.flatnonzero(found.source == 0)[-1]
    now = corners(found.control, after)[np.flatnonzero(after >= 0) == last][0]
    assert now == pytest.approx(degrees, abs=1e-6)


def test_added_nodes_of_curves_are_smooth_and_marked() -> None:
    before = drawing("M0,0 C30,60 70,-60 100,0")

    def bumps(points: np.ndarray) -> np.ndarray:
        return np.stack([points[..., 0], points[..., 1] + 9 * np.sin(points[..., 0] / 6)], axis=-1)

    found = fitted(before, bumps, 0.5, 0.05)
    assert len(found.control) > 3
    assert found.smooth_start.tolist() == [False] + [True] * (len(found.control) - 1)
    now = corners(found.control, following_after(before, found))
    assert np.abs(now).max() < 1e-6
    # The nodes there were are none of them, whichever segment they begin.
    twice = fitted(drawing("M0,0 C30,60 70,-60 100,0 C130,60 170,-60 200,0"), bumps, 0.5, 0.05)
    assert len(twice.control) > 6
    nodes = np.flatnonzero(~twice.smooth_start)
    assert nodes.tolist() == [0, int(np.searchsorted(twice.source, 1))]


@pytest.mark.parametrize("moved", [0, 1, 2])
def test_a_smooth_node_stays_one_beside_a_segment_that_does_not_move(moved: int) -> None:
    """What is left alone to the last bit is a subpath, not a segment of one."""
    path = "C10,20 30,20 40,0 C50,-20 70,-20 80,0 C90,20 110,20 120,0"
    before = drawing(f"M0,0 {path}", "M0,50 C40,70 80,30 120,50")

    def by(points: np.ndarray) -> np.ndarray:
        """Of one segment alone a slant bump, which would turn its ends by degrees."""
        x, y = points[..., 0] - 40 * moved, points[..., 1]
        bump = np.where((x > 0.0) & (x < 40.0) & (y < 25.0), 0.05 * np.minimum(x, 40.0 - x), 0.0)
        return np.stack([points[..., 0], y + bump], axis=-1)

    found = fitted(before, by, 1.0, 0.5)
    after = following_after(before, found)
    assert np.abs(corners(found.control, after)).max() < 1e-6
    assert np.array_equal(found.control[-1], before.control[-1])
    still = [n for n, source in enumerate(found.source) if source not in (moved, 3)]
    assert not any(np.array_equal(found.control[n], before.control[found.source[n]]) for n in still)


def test_corners_stay_corners_with_the_angles_of_the_map() -> None:
    before = drawing("M0,0 C20,30 40,30 60,0 C80,30 100,30 120,0 L120,50")
    found = fitted(before, wave, 0.5, 1e-3)
    h = 1e-6
    wanted = []
    for segment in (0, 1):
        p, a, b = before.control[segment, 3], before.control[segment], before.control[segment + 1]
        arriving = wave(p) - wave(p - h * (a[3] - a[2]))
        leaving = wave(p + h * (b[1] - b[0])) - wave(p)
        wanted.append(np.degrees(np.angle(direction(leaving[None]) / direction(arriving[None])))[0])
    assert np.abs(wanted).min() > 20
    after = following_after(before, found)
    ends = np.flatnonzero(after >= 0)
    now = corners(found.control, after)
    for segment, angle in zip((0, 1), wanted):
        last = np.flatnonzero(found.source == segment)[-1]
        assert now[ends == last][0] == pytest.approx(angle, abs=3.0)


def test_a_curve_beside_a_line_leaves_along_it() -> None:
    before = drawing("M0,0 L40,0 C60,0 80,20 80,40")

    # The line turns by 20 degrees about its start; what is right of it follows with a bend.
    def by(points: np.ndarray) -> np.ndarray:
        turned = points @ rotation(20.0).T
        beyond = np.maximum(points[:, :1] - 40.0, 0.0)
        return turned + beyond**2 * [0.002, -0.004]

    found = fitted(before, by, 1.0, 0.02)
    assert found.line[0]
    assert abs(corners(found.control, following_after(before, found))[0]) < 1e-6


# --- lines --------------------------------------------------------------------------------------


@pytest.mark.parametrize("linear", AFFINE.values(), ids=AFFINE.keys())
def test_lines_stay_lines(linear: np.ndarray) -> None:
    before = drawing(*PATHS["lines"])
    found = fitted(before, lambda p: p @ linear.T)
    assert found.line.all()
    thirds = found.control[:, :1] + np.linspace(0, 1, 4)[None, :, None] * (
        found.control[:, 3:] - found.control[:, :1]
    )
    assert found.control == pytest.approx(thirds, abs=1e-9)


def test_samples_that_slide_along_a_line_add_no_node() -> None:
    before = drawing("M0,0 L100,0")
    found = fitted(before, lambda p: np.stack([p[:, 0] ** 2 / 100, p[:, 1]], axis=1), 1.0, 1e-6)
    assert len(found.control) == 1
    assert found.control[0] == pytest.approx(before.control[0])


def test_a_line_bent_by_a_handle_gains_a_node_there() -> None:
    before = drawing("M0,0 L100,0 L100,50")
    net, _ = sampled(before)
    at = 0.3
    samples = sample(net, 1.0, np.array([0]), np.array([at]))
    held = int(samples.stops[0])
    x = samples.points[:, 0]
    moved = samples.points.copy()
    on = samples.points[:, 1] == 0.0
    moved[on, 1] = (np.minimum(x / 30, (100 - x) / 70) * 12)[on]
    found = refit.refit(before, net, samples, moved, np.array([held]), 0.05)
    assert found.source.tolist() == [0, 0, 1]
    assert found.line.all()
    assert found.control[0, 3] == pytest.approx([30.0, 12.0], abs=1e-9)
    assert not found.smooth_start.any()
    assert found.error < 1e-9


# --- details ------------------------------------------------------------------------------------


def test_retracted_handles_stay_retracted() -> None:
    before = drawing(*PATHS["retracted"])
    found = fitted(before, wave, 1.0, 0.05)
    first, last = found.control[found.source == 0][0], found.control[found.source == 1][-1]
    assert first[1] == pytest.approx(first[0], abs=1e-9)
    assert last[2] == pytest.approx(last[3], abs=1e-9)


@pytest.mark.parametrize("linear", [np.diag([2.0, 2.0]), rotation(50.0)])
def test_segments_shorter_than_the_spacing_keep_their_shape(linear: np.ndarray) -> None:
    # A notch of 1 x 2 in a box, sampled every 10.
    before = drawing("M0,0 H50 C50,2 51,2 51,0 H100 V40 H0 Z")
    found = fitted(before, lambda p: p @ linear.T, 10.0, 0.5)
    assert found.control.shape == before.control.shape
    assert found.control[1] == pytest.approx(before.control[1] @ linear.T, abs=1e-6)


def test_a_tiny_segment_is_carried_by_the_similarity_of_its_chord() -> None:
    before = drawing("M0,0 H50 C50,2 51,2 51,0 H100 V40 H0 Z")
    found = fitted(before, lambda p: p * [3.0, 1.0], 10.0, 0.5)
    chord = found.control[1, 3] - found.control[1, 0]
    assert chord == pytest.approx([3.0, 0.0])
    shape = (found.control[1] - found.control[1, 0]) / 3.0
    assert shape == pytest.approx(before.control[1] - before.control[1, 0], abs=0.2)


def test_segments_that_are_points_are_carried_along() -> None:
    before = drawing(*PATHS["closer"])
    found = fitted(before, lambda p: p * 2.0 + [3.0, 4.0], 5.0, 0.01)
    assert found.source.tolist() == [0, 1, 2, 3]
    assert found.control[3] - found.control[3, :1] == pytest.approx(
        before.control[3] - before.control[3, :1], abs=1e-12
    )
    assert np.linalg.norm(found.control[3, 0] - found.control[2, 3]) < 0.01
    assert np.linalg.norm(found.control[3, 3] - found.control[0, 0]) < 0.01


@pytest.mark.parametrize("spacing", [0.5, 3.0])
@pytest.mark.parametrize("name", list(PATHS))
def test_the_segments_of_a_subpath_hang_together(name: str, spacing: float) -> None:
    before = drawing(*PATHS[name])
    found = fitted(before, wave, spacing, 0.01)
    assert (np.diff(found.source) >= 0).all()
    assert set(found.source) == set(range(len(before.control)))
    after = following_after(before, found)
    ends = np.flatnonzero(after >= 0)
    gap = np.abs(found.control[ends, 3] - found.control[after[ends], 0]).max()
    assert gap < (1e-3 if name == "closer" else 1e-9)


@pytest.mark.parametrize("name", [n for n in PATHS if n not in ("lines", "closer")])
@pytest.mark.parametrize("tolerance", [1.0, 0.1, 0.02])
def test_the_error_is_below_the_tolerance_and_true(name: str, tolerance: float) -> None:
    before = drawing(*PATHS[name])
    found = fitted(before, wave, 0.5, tolerance)
    # ... or no more can be done: a segment is divided into 64 parts at most.
    assert found.error <= tolerance or np.bincount(found.source).max() == 64
    # The true image by dense points, whose own distance comes on top; between samples the curve may be
    # a little further off.
    assert slow_distance(found, before, wave) <= 1.2 * found.error + 0.05


def test_nodes_are_added_only_where_needed() -> None:
    before = drawing("M0,0 C20,20 40,20 60,0 C80,-20 100,-20 120,0 L160,0")
    by = lambda p: np.stack(  # noqa: E731
        [p[..., 0], p[..., 1] + 1 - np.cos(np.pi * np.clip(p[..., 0] - 60, 0, 60) / 15)], axis=-1
    )
    found = fitted(before, by, 0.5, 0.05)
    counts = np.bincount(found.source)
    assert counts[0] == 1
    assert counts[1] > 2
    assert counts[2] == 1


@pytest.mark.parametrize("name", list(PATHS))
def test_without_added_nodes_every_segment_stays_one_and_the_error_is_told(name: str) -> None:
    before = drawing(*PATHS[name])
    net, samples = sampled(before, 0.5)
    none = np.zeros(0, dtype=int)
    found = refit.refit(before, net, samples, wave(samples.points), none, 1e-3, add_nodes=False)
    assert found.source.tolist() == list(range(len(before.control)))
    assert (found.line == before.line).all()
    assert not found.smooth_start.any()
    assert found.error > 1e-3
    assert slow_distance(found, before, wave) <= 1.2 * found.error + 0.05


def test_a_tighter_tolerance_never_has_fewer_nodes() -> None:
    before = drawing(BLOB)
    counts = [len(fitted(before, wave, 0.5, t).control) for t in (2.0, 0.5, 0.1, 0.02, 0.005)]
    assert counts == sorted(counts)
    assert counts[0] == len(before.control)


@pytest.mark.parametrize(("height", "width"), [(3.0, 0.1), (0.4, 0.05)])
def test_a_held_point_within_a_segment_is_met(height: float, width: float) -> None:
    # The lower bump would be within the tolerance of what is not held.
    before = drawing("M0,0 C20,40 60,40 100,0")
    net, _ = sampled(before)
    samples = sample(net, 1.0, np.array([0]), np.array([0.4]))
    held = int(samples.stops[0])
    s = samples.fraction[np.argsort(samples.chain)]
    bump = height * np.exp(-(((s - 0.4) / width) ** 2))
    moved = samples.points + np.stack([np.zeros_like(bump), bump], axis=1)
    tolerance = 0.5
    found = refit.refit(before, net, samples, moved, np.array([held]), tolerance)
    points = curve_points(found.control, 2001)
    away = np.linalg.norm(points - moved[held], axis=1).min()
    assert away <= tolerance / 20.0 + 1e-2


@pytest.mark.parametrize("crosses", [False, True])
@pytest.mark.parametrize("reverse", [False, True])
def test_what_ends_on_a_segment_stays_on_it_and_what_crosses_need_not(crosses: bool, reverse: bool) -> None:
    arch, tolerance, height = "M0,0 C20,40 60,40 100,0", 0.5, 0.4
    x, y = evaluate(drawing(arch).control[0], np.array(0.4)).tolist()
    far, near = y + 30.0, y - 20.0 if crosses else y
    before = drawing(arch, f"M{x},{near} V{far}" if reverse else f"M{x},{far} V{near}")
    net, samples = sampled(before, 1.0)
    assert net.contacts["crossings" if crosses else "t_junctions"] > 0
    # A bump that the tolerance would let pass.
    bump = height * np.exp(-(((samples.points[:, 0] - x) / 3.0) ** 2))
    moved = samples.points + np.stack([0.0 * bump, bump], axis=1)
    found = refit.refit(before, net, samples, moved, np.zeros(0, dtype=int), tolerance)
    points = curve_points(found.control[found.source == 0], 4001)
    away = np.linalg.norm(points - [x, y + height], axis=1).min()
    assert (away > tolerance / 2.0) if crosses else (away < tolerance / 20.0)


def test_each_segment_has_its_samples_once_from_its_start_to_its_end() -> None:
    """Whatever cuts it: the parameters ascend from 0 to 1, exactly, and find their samples."""
    rays = [f"M{x},-30 L{x + 7},90" for x in np.linspace(3.0, 91.0, 23)]
    before = drawing("M100,0 H0 C20,40 60,40 100,0", *rays, "M0,50 C40,20 60,70 100,50")
    net, samples = sampled(before, 3.0)
    rows = refit.rows(before, net, samples)
    assert len(net.segment) > 4 * len(before.control)
    same = rows.segment[1:] == rows.segment[:-1]
    assert (np.diff(rows.t)[same] > 0.0).all()
    assert (rows.t[np.append(True, ~same)] == 0.0).all()
    assert (rows.t[np.append(~same, True)] == 1.0).all()
    assert set(rows.segment) == set(range(len(before.control)))
    assert evaluate(before.control[rows.segment], rows.t) == pytest.approx(
        samples.points[rows.sample], abs=1e-3
    )


@pytest.mark.parametrize(("low", "high"), [(0.323, 0.991), (0.44, 0.955), (0.067, 0.773)])
def test_two_pieces_share_the_sample_between_them_to_the_last_bit(low: float, high: float) -> None:
    """Although low + (high - low) need not be high."""
    before = drawing("M0,0 H1", f"M{low},0 V1 M{high},0 V1")
    net, samples = sampled(before, 0.05)
    assert net.span[1].tolist() == [low, high]
    assert low + (high - low) != high
    rows = refit.rows(before, net, samples)
    line = rows.segment == 0
    assert len(np.unique(rows.sample[line])) == line.sum()
    assert {low, high} <= set(rows.t[line])


@pytest.mark.parametrize("seed", range(10))
def test_the_next_segment_that_is_more_than_a_point(seed: int) -> None:
    following = np.array([1, 2, 3, 4, 5, 0, 7, 8, 9, 10, -1, 11])  # a ring, an open subpath, a loop
    alive = np.flatnonzero(np.random.default_rng(seed).random(12) < 0.4)
    found = refit._alive_following(following, alive, 12)
    for segment in alive:
        after = following[segment]
        while after >= 0 and after not in alive:
            after = following[after]
        assert found[segment] == after


def test_segments_of_a_part_of_a_drawing_find_their_places_in_it() -> None:
    found = fitted(drawing("M0,0 C30,60 70,-60 100,0 L100,50", "M0,100 H50"), wave, 0.5, 0.02)
    assert np.bincount(found.source)[0] > 1
    placed = found.of(np.array([5, 2, 9]))
    assert placed.source.tolist() == sorted([5, 2, 9][n] for n in found.source)
    for part, whole in ((0, 5), (1, 2), (2, 9)):
        mine, theirs = found.source == part, placed.source == whole
        assert (placed.control[theirs] == found.control[mine]).all()
        assert (placed.line[theirs] == found.line[mine]).all()
        assert (placed.smooth_start[theirs] == found.smooth_start[mine]).all()
    assert placed.error == found.error > 0.0


def test_both_copies_of_a_shared_border_get_the_same_curve() -> None:
    before = drawing(*PATHS["shared"])
    net = weld.build(before, weld.SNAP_DISTANCE * before.diagonal)
    assert net.curve[1] == net.curve[7]
    found = fitted(before, wave, 1.0, 1.0)
    one, two = found.control[found.source == 1][0], found.control[found.source == 7][-1]
    assert one == pytest.approx(two[::-1], abs=0.3)
    t = np.linspace(0, 1, 50)
    assert evaluate(one, t) == pytest.approx(evaluate(two, 1 - t), abs=0.3)


def test_tangents_look_past_retracted_handles() -> None:
    control = np.array(
        [
            [[0.0, 0.0], [1.0, 1.0], [2.0, 3.0], [4.0, 4.0]],
            [[0.0, 0.0], [0.0, 0.0], [2.0, 0.0], [4.0, 4.0]],
            [[0.0, 0.0], [0.0, 0.0], [4.0, 4.0], [4.0, 4.0]],
        ]
    )
    unit = lambda v: v / np.linalg.norm(v, axis=1, keepdims=True)  # noqa: E731
    half = np.sqrt(0.5)
    assert unit(control_arms.start_tangents(control)) == pytest.approx(
        np.array([[half, half], [1, 0], [half, half]])
    )
    assert unit(control_arms.end_tangents(control)) == pytest.approx(
        np.array([[2 / np.sqrt(5), 1 / np.sqrt(5)], [1 / np.sqrt(5), 2 / np.sqrt(5)], [half, half]])
    )


def test_parts_of_the_identity_are_the_curve_itself() -> None:
    """Wherever a curve is divided, the parts of an unmoved one would be de Casteljau's."""
    before = drawing("M0,0 C30,60 70,-60 100,0", "M0,100 C30,160 70,40 100,100")

    def by(points: np.ndarray) -> np.ndarray:
        far = points[:, 1] > 50
        return points + np.stack([0 * points[:, 0], far * 9 * np.sin(points[:, 0] / 6)], axis=1)

    found = fitted(before, by, 0.5, 0.05)
    assert (found.control[found.source == 0] == before.control[0]).all()
    assert np.count_nonzero(found.source == 1) > 2
    halves = subrange(before.control[0], np.array(0.0), np.array(1.0))
    assert halves == pytest.approx(before.control[0])
