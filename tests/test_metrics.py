# SPDX-License-Identifier: GPL-2.0-or-later
"""The figures of merit against closed forms: what each is zero for, and known amounts of what it counts."""

from __future__ import annotations

import json

import networks
import numpy as np
import pytest
from builders import BLOB, drag, drawing, pin, rotation, sampled, stages

from alup.handles.binding import Anchors
from alup.network.sampling import Graph
from alup.session import metrics
from alup.ties.ties import surroundings

DIAGONAL = 7.0


def chain(count: int = 41, step: float = 0.5, straight: bool = False) -> Graph:
    """A horizontal line of `count` samples."""
    x = step * np.arange(count)
    turns = [[n, n - 1, n + 1] for n in range(1, count - 1)] if straight else []
    return networks.simple(np.stack([x, 0.0 * x], axis=1), [[n, n + 1] for n in range(count - 1)], turns)


def along(of: Graph, lengths: np.ndarray, degrees: float | np.ndarray = 0.0) -> np.ndarray:
    """A chain laid out anew with these lengths and directions of its edges."""
    angle = np.radians(degrees) + 0.0 * lengths
    steps = lengths[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.concatenate([[[0.0, 0.0]], np.cumsum(steps, axis=0)])


def blob() -> Graph:
    return sampled(drawing(BLOB))[1]


# --- turning ------------------------------------------------------------------------------------


@pytest.mark.parametrize("degrees", [-30.0, 0.0, 12.5, 180.0])
def test_a_rotation_turns_by_its_angle(degrees: float) -> None:
    of = blob()
    found = metrics.turning(of.points, 1.3 * of.points @ rotation(degrees).T + [5.0, 9.0], of.edges)
    assert found == pytest.approx({"mean": abs(degrees), "max": abs(degrees)}, abs=1e-9)


def test_mean_turning_is_weighted_by_the_inputs_lengths() -> None:
    before = np.array([[0.0, 0.0], [3.0, 0.0], [4.0, 0.0]])
    after = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 50.0]])
    found = metrics.turning(before, after, np.array([[0, 1], [1, 2]]))
    assert found == pytest.approx({"mean": 90.0 / 4.0, "max": 90.0})


# --- scale gradient -----------------------------------------------------------------------------


def test_a_similarity_has_no_scale_gradient() -> None:
    of = blob()
    found = metrics.scale_gradient(of, 2.7 * of.points @ rotation(40.0).T, DIAGONAL)
    assert found == pytest.approx({"rms": 0.0, "max": 0.0}, abs=1e-10)


def test_a_scale_that_grows_linearly_has_its_slope() -> None:
    slope = 0.03  # of the scale, per unit of length
    of = chain()
    step = np.diff(of.points[:, 0])
    middle = of.points[:-1, 0] + 0.5 * step
    after = along(of, step * (1.0 + slope * middle), 20.0)
    wanted = slope * DIAGONAL
    assert metrics.scale_gradient(of, after, DIAGONAL) == pytest.approx({"rms": wanted, "max": wanted})


def test_a_linear_change_of_scale_on_uneven_samples_has_the_same_slope() -> None:
    x = np.concatenate([[0.0], np.cumsum(1.0 + 0.7 * np.sin(np.arange(30.0)))])
    of = networks.simple(np.stack([x, 0 * x], axis=1), [[n, n + 1] for n in range(30)])
    after = np.stack([x + 0.5 * 0.1 * x**2, 0 * x], axis=1)  # s = 1 + 0.1 x in the middle of every edge
    wanted = {"rms": 0.1 * DIAGONAL, "max": 0.1 * DIAGONAL}
    assert metrics.scale_gradient(of, after, DIAGONAL) == pytest.approx(wanted)


def test_an_abrupt_change_of_scale_counts_for_more_than_a_gradual_one() -> None:
    """The same total change, all at one sample or over all n turns: rms greater by sqrt(n)."""
    of = chain()
    step = np.diff(of.points[:, 0])
    turns = len(step) - 1
    gradual = along(of, step * np.linspace(1.0, 2.0, len(step)))
    abrupt = along(of, step * np.repeat([1.0, 2.0], len(step) // 2))
    slow, fast = (metrics.scale_gradient(of, after, DIAGONAL) for after in (gradual, abrupt))
    assert fast["rms"] == pytest.approx(np.sqrt(turns) * slow["rms"])
    assert fast["max"] == pytest.approx(DIAGONAL / step[0])
    assert slow["max"] == pytest.approx(DIAGONAL / step[0] / turns)


def test_scale_gradients_do_not_depend_on_the_units() -> None:
    of = blob()
    after = of.points + 3.0 * np.sin(0.05 * of.points)
    large = networks.simple(1e3 * of.points, of.edges.tolist())
    one = metrics.scale_gradient(of, after, DIAGONAL)
    assert one["rms"] > 0.01
    assert metrics.scale_gradient(large, 1e3 * after, 1e3 * DIAGONAL) == pytest.approx(one)


@pytest.mark.parametrize(("degrees", "counts"), [(94.0, False), (96.0, True), (180.0, True)])
def test_the_scale_may_change_at_a_visible_corner(degrees: float, counts: bool) -> None:
    angle = np.radians(degrees)
    points = np.array([[2.0, 0.0], [1.0, 0.0], [0.0, 0.0]])
    points = np.concatenate(
        [points, [[np.cos(angle), np.sin(angle)], [2 * np.cos(angle), 2 * np.sin(angle)]]]
    )
    of = networks.simple(points, [[0, 1], [1, 2], [2, 3], [3, 4]])
    after = points.copy()
    after[3:] *= 3.0
    found = metrics.scale_gradient(of, after, DIAGONAL)["max"]
    assert found == pytest.approx(2.0 * DIAGONAL if counts else 0.0)


@pytest.mark.parametrize("through", [False, True])
def test_at_a_junction_only_what_runs_on_counts(through: bool) -> None:
    points = np.array([[-1.0, 0.0], [0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    pairs = np.array([[0, 1]] if through else []).reshape(-1, 2).astype(int)
    of = Graph(points, np.array([[0, 1], [1, 2], [1, 3]]), np.zeros((0, 3), dtype=int), pairs)
    after = points * [1.0, 5.0]
    after[2] *= 1.5
    assert metrics.scale_gradient(of, after, DIAGONAL)["max"] == pytest.approx(0.5 * DIAGONAL * through)


def test_edges_without_length_have_no_scale() -> None:
    points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0 + 1e-9, 0.0], [2.0, 0.0], [3.0, 0.0]])
    of = networks.simple(points, [[0, 1], [1, 2], [2, 3], [3, 4]])
    after = points * 2.0
    after[2:] += [0.5, 0.0]
    found = metrics.scale_gradient(of, after, DIAGONAL)
    assert found == pytest.approx({"rms": 0.0, "max": 0.0}, abs=1e-6)


# --- straightness -------------------------------------------------------------------------------


def test_lines_under_an_affine_map_stay_straight() -> None:
    of = sampled(drawing("M0,0 L40,20 L10,40 Z", "M60,0 V30"))[1]
    assert len(of.straight_turns)
    for linear in (np.array([[2.0, 0.5], [-0.3, 0.4]]), rotation(179.999), np.diag([1.0, -1.0])):
        found = metrics.straightness(of.points, of.points @ linear, of.straight_turns)
        assert found == pytest.approx({"mean": 0.0, "max": 0.0, "line": 0.0}, abs=1e-6)


@pytest.mark.parametrize("degrees", [0.5, 60.0, 170.0])
@pytest.mark.parametrize("turned", [0.0, 179.0])
def test_a_line_with_one_bend(degrees: float, turned: float) -> None:
    of = chain(5, straight=True)
    after = along(of, np.ones(4), turned + np.array([0.0, 0.0, degrees, degrees]))
    found = metrics.straightness(of.points, after, of.straight_turns)
    assert found == pytest.approx({"mean": degrees / 3.0, "max": degrees, "line": degrees})


@pytest.mark.parametrize("count", [11, 101])
def test_a_line_drawn_into_an_arc_is_as_bent_however_it_is_sampled(count: int) -> None:
    of = chain(count, 1.0, straight=True)
    edges = count - 1
    after = along(of, np.ones(edges), np.linspace(0.0, -90.0, edges))
    found = metrics.straightness(of.points, after, of.straight_turns)
    each = 90.0 / (edges - 1)
    assert found == pytest.approx({"mean": each, "max": each, "line": 90.0})


def test_lines_that_cross_at_a_sample_are_two_lines() -> None:
    points = np.array([[0.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]])
    turns = np.array([[0, 1, 2], [0, 3, 4]])
    after = points.copy()
    after[3:] = points[3:] @ rotation(25.0).T
    assert metrics.straightness(points, after, turns)["line"] == pytest.approx(0.0, abs=1e-9)


def test_the_bend_that_a_line_had_is_not_counted() -> None:
    of = chain(5, straight=True)
    before = along(of, np.ones(4), np.array([0.0, 0.1, 0.1, -0.1]))
    same = metrics.straightness(before, 2.0 * before, of.straight_turns)
    assert same == pytest.approx({"mean": 0.0, "max": 0.0, "line": 0.0}, abs=1e-9)
    straightened = metrics.straightness(before, of.points, of.straight_turns)
    assert straightened["max"] == pytest.approx(0.2)


def test_without_lines_nothing_bends() -> None:
    of = chain()
    found = metrics.straightness(of.points, along(of, np.ones(40), np.arange(40.0)), of.straight_turns)
    assert found == {"mean": 0.0, "max": 0.0, "line": 0.0}


# --- handles, crossings, exact solutions --------------------------------------------------------


def test_the_handle_error_is_the_worst_handles() -> None:
    of = chain()
    targets = of.points[[3, 8]] + [[0.0, 0.1], [0.3, 0.4]]
    found = metrics.handle_error(of.points, np.array([3, 8]), targets, DIAGONAL)
    assert found == pytest.approx(0.5 / DIAGONAL)
    assert metrics.handle_error(of.points, np.array([3, 8]), of.points[[3, 8]], DIAGONAL) == 0.0


def test_crossings_that_were_made_are_counted_and_others_are_not() -> None:
    # A zigzag, and a stroke that crosses its first leg from the beginning.
    before = np.array([[0.0, 0.0], [1.0, 4.0], [2.0, 0.0], [3.0, 4.0], [-1.0, 2.0], [1.0, 2.0]])
    edges = np.array([[0, 1], [1, 2], [2, 3], [4, 5]])
    assert metrics.new_crossings(before, 3.0 * before, edges) == 0
    for reach, made in ((1.0, 0), (2.0, 1), (5.0, 2)):
        after = before.copy()
        after[5, 0] = reach
        assert metrics.new_crossings(before, after, edges) == made
    apart = before.copy()
    apart[4:, 1] += 10.0  # one less is not one more
    assert metrics.new_crossings(before, apart, edges) == 0


def test_parts_that_cross_at_a_sample_of_each_may_do_so_beside_it() -> None:
    before = np.array([[0, 0], [1, 0], [2, 0], [1, -1], [1, 0], [1, 1]], dtype=float)
    edges = np.array([[0, 1], [1, 2], [3, 4], [4, 5]])
    beside = before + [[0, 0], [0, 0], [0, 0], [0.3, 0.2], [0.3, 0.2], [0.3, 0.2]]
    assert len(metrics.crossing_edges(beside, edges)) == 1
    assert metrics.new_crossings(before, beside, edges) == 0
    # Twice is once too often.
    twice = before + [[0, 0], [0, 0], [0, 0], [-0.5, 0], [0.5, -0.9], [-0.5, 0]]
    twice[4] = [1.5, 0.5]
    twice[3], twice[5] = [0.5, -1.0], [1.9, -0.5]
    assert len(metrics.crossing_edges(twice, edges)) == 2
    assert metrics.new_crossings(before, twice, edges) == 1


def test_the_distance_to_an_exact_shape() -> None:
    """Across the shape every part counts, along it none."""
    of = chain(5)
    assert metrics.distance_to_exact(of.points, of.points, of.edges, DIAGONAL) == {"rms": 0.0, "max": 0.0}
    line = np.stack([np.arange(6.0), np.zeros(6)], axis=1)
    edges = np.stack([np.arange(5), np.arange(1, 6)], axis=1)
    slid = line + [[0.0, 0.0], [0.3, 0.0], [0.4, 0.0], [-0.4, 0.0], [-0.9, 0.0], [0.0, 0.0]]
    assert metrics.distance_to_exact(slid, line, edges, DIAGONAL)["max"] == pytest.approx(0.0, abs=1e-15)
    slid[2] += [0.0, 3.0]
    slid[5] += [4.0, 3.0]
    found = metrics.distance_to_exact(slid, line, edges, DIAGONAL)
    assert found == pytest.approx({"rms": np.sqrt((9.0 + 25.0) / 6.0) / DIAGONAL, "max": 5.0 / DIAGONAL})


# --- bands --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("move", "kept"),
    [((0.0, 0.0), 1.0), ((30.0, 0.0), 1.0), ((0.0, 0.8), 1.0), ((0.0, 1.2), 0.0), ((0.0, -4.0), 0.0)],
)
def test_a_band_is_kept_while_its_width_changes_by_less_than_half(
    move: tuple[float, float], kept: float
) -> None:
    """Two lines of 200, 2 apart: the second one slides along the first, or leaves it, or crosses it."""
    _, of = sampled(drawing("M0,0 H200", "M0,2 H200"))
    second = of.points[:, 1] > 1.0
    after = of.points + second[:, None] * np.array(move)
    found = metrics.bands(of, after, surroundings(of).facing, 200.0)
    assert found == pytest.approx({"kept": kept, "length": 1.0}, abs=0.02)


# --- all together -------------------------------------------------------------------------------


def test_the_report_is_the_figures_and_json() -> None:
    made = stages(drawing(BLOB, handles=[pin(10, 80), drag((150, 75), (170, 60))]))
    anchors = Anchors(made.held, made.targets, np.arange(len(made.held)))
    of, diagonal = made.samples, made.drawing.diagonal
    after = of.points + 10.0 * np.sin(0.05 * of.points)
    found = metrics.report(of, after, anchors, surroundings(of).facing, diagonal)
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert found == {
        "handle_error_of_diagonal": metrics.handle_error(after, made.held, made.targets, diagonal),
        "turning_degrees": metrics.turning(of.points, after, of.edges),
        "scale_gradient": metrics.scale_gradient(of, after, diagonal),
        "straightness_degrees": metrics.straightness(of.points, after, of.straight_turns),
        "new_crossings": metrics.new_crossings(of.points, after, of.edges),
        "bands": metrics.bands(of, after, surroundings(of).facing, diagonal),
    }
    assert found["straightness_degrees"]["line"] > 1.0
    assert found["handle_error_of_diagonal"] > 0.01


def test_nothing_moved_is_zero_in_every_figure() -> None:
    made = stages(drawing(BLOB, "M200,0 L210,30", handles=[pin(10, 80)]))
    anchors = Anchors(made.held, made.targets, np.arange(len(made.held)))
    found = metrics.report(
        made.samples, made.samples.points, anchors, surroundings(made.samples).facing, made.drawing.diagonal
    )
    assert found.pop("bands")["kept"] == 1.0
    numbers = [
        value for one in found.values() for value in (one.values() if isinstance(one, dict) else [one])
    ]
    assert set(numbers) == {0}
