# SPDX-License-Identifier: GPL-2.0-or-later
"""The terms: against plain loops, what makes each zero, and independence of the units."""

from __future__ import annotations

from dataclasses import replace

import networks
import numpy as np
import pytest
import slow
from builders import BLOB, drag, drawing, pin, rotation, stages

from alup.energy import terms
from alup.energy.problem import Weights, analyse, core_problem
from alup.model import Ties
from alup.network.sampling import Graph

# A turn (2; 1, 3) is at a junction and (3; 4, 2) at a handle: not in the core round.
CORE_STRAIGHT = [(1, 0, 2)]


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_values_of_the_core_round(seed: int, noise: float) -> None:
    of = networks.graph(scale=7.0, noise=noise, seed=seed)
    problem = networks.core(of)
    v = networks.random_positions(problem, seed)
    wanted = slow.energies(networks.slow_round(of, of.points, CORE_STRAIGHT), v)
    found = terms.terms(problem, v)
    assert found.keys() >= wanted.keys()
    for term, value in wanted.items():
        assert found[term] == pytest.approx(value, rel=1e-10), term
    assert terms.alup(problem, v) == pytest.approx(wanted["alup"], rel=1e-10)
    assert terms.objective(problem, v) == pytest.approx(wanted["objective"], rel=1e-10)


@pytest.mark.parametrize("seed", range(3))
def test_curves_that_run_through_a_junction_are_no_corner_there(seed: int) -> None:
    of = networks.graph(scale=7.0, noise=0.01, seed=seed, through=True)
    problem = networks.core(of)
    assert problem.straight.tolist() == [[1, 0, 2], [2, 1, 3]]
    v = networks.random_positions(problem, seed)
    wanted = slow.energies(networks.slow_round(of, of.points, [(1, 0, 2), (2, 1, 3)]), v)
    found = terms.terms(problem, v)
    for term, value in wanted.items():
        assert found[term] == pytest.approx(value, rel=1e-10), term


@pytest.mark.parametrize("seed", range(5))
def test_values_of_the_final_round(seed: int) -> None:
    of = networks.graph(scale=0.3, noise=0.01, seed=seed)
    core = networks.core(of)
    # Nearly straight at the junction, visibly bent at the handle.
    result = of.points.copy()
    result[4] += 0.3 * np.array([-1.0, 2.0])
    result[5:] *= 1.3
    final = networks.final(core, result, of, networks.ties(of))
    v = networks.random_positions(final, seed)
    wanted = slow.energies(networks.slow_round(of, result, [(1, 0, 2), (2, 1, 3)]), v)
    found = terms.terms(final, v)
    for term, value in wanted.items():
        assert found[term] == pytest.approx(value, rel=1e-9), term


@pytest.mark.parametrize("round_", ["core", "final"])
def test_units_and_starts_of_both_rounds(round_: str) -> None:
    of = networks.graph(scale=7.0)
    first, second, result = networks.both_rounds(of)
    problem, start = (first, of.points) if round_ == "core" else (second, result)
    assert problem.lengths.mean() == pytest.approx(1.0)
    assert problem.to_user(problem.start) == pytest.approx(start)
    assert problem.from_user(start) == pytest.approx(problem.start)
    assert problem.to_user(problem.targets) == pytest.approx(networks.targets(of))
    reference = networks.slow_round(of, start, [])
    for n, (i, j) in enumerate(networks.EDGES):
        assert problem.lengths[n] == pytest.approx(reference.length0(i, j))
        assert problem.normals[n] == pytest.approx(reference.normal(i, j))  # of the input, always


@pytest.mark.parametrize(("degrees", "back"), [(0.0, True), (4.5, True), (5.5, False), (180.0, False)])
def test_straight_turns_at_junctions_and_handles_come_back_if_still_straight(
    degrees: float, back: bool
) -> None:
    x = np.arange(5.0)
    points = np.concatenate([np.stack([x, 0 * x], axis=1), [[2.0, 1.0]]])
    of = networks.simple(points, [[0, 1], [1, 2], [2, 3], [3, 4], [2, 5]], [[1, 0, 2], [2, 1, 3], [3, 2, 4]])
    core = core_problem(analyse(of, np.array([3]), Weights()), points[[3]], Ties.none(), np.zeros(5))
    assert core.straight.tolist() == [[1, 0, 2]]
    for centre in (2, 3):
        result = points.copy()
        for n in range(centre + 1, 5):
            result[n] = points[centre] + rotation(degrees) @ (points[n] - points[centre])
        final = networks.final(core, result, of, Ties.none())
        assert ([centre, centre - 1, centre + 1] in final.straight.tolist()) is back
        assert [1, 0, 2] in final.straight.tolist()  # although the core round bent it


def bent(degrees: float) -> Graph:
    """Two edges with this angle between them."""
    angle = np.radians(degrees)
    points = np.array([[1.0, 0.0], [0.0, 0.0], [np.cos(angle), np.sin(angle)]])
    return networks.simple(points, [[0, 1], [1, 2]])


@pytest.mark.parametrize(
    ("degrees", "weight"),
    [
        (180.0, 1.0),
        (150.0, np.exp(-0.5)),
        (120.0, np.exp(-2.0)),
        (95.5, np.exp(-((84.5 / 30) ** 2) / 2)),
        (94.5, 1e-3),
        (20.0, 1e-3),
    ],
)
def test_turn_weights(degrees: float, weight: float) -> None:
    problem = networks.free(bent(degrees))
    assert problem.turn_weight == pytest.approx(weight, rel=1e-6)


# --- zero sets ----------------------------------------------------------------------------------


def zero(value: float) -> bool:
    return value < 1e-18


BOX = stages(
    drawing(
        "M0,0 H40 V20 H0 Z",
        "M10,5 C12,10 14,10 16,5",
        handles=[pin(0, 0), pin(40, 0), drag((40, 20), (50, 18))],
    )
).problem
SCALE = 1.7
UNIFORM = {"grow": SCALE * np.eye(2), "shrink": 0.4 * np.eye(2)}


def test_nothing_moved_is_zero_but_for_the_handles() -> None:
    found = terms.terms(BOX, BOX.start)
    assert found["handle"] > 1.0
    for term in ("normal", "tangent", "straight", "edge", "ties"):
        assert zero(found[term]), term


def test_translation_is_zero() -> None:
    found = terms.terms(BOX, BOX.start + [5.0, -3.0])
    for term in ("normal", "tangent", "straight", "edge", "ties"):
        assert zero(found[term]), term


@pytest.mark.parametrize("linear", UNIFORM.values(), ids=UNIFORM.keys())
def test_uniform_scale_is_zero_for_all_that_see_directions_and_ratios(linear: np.ndarray) -> None:
    found = terms.terms(BOX, BOX.start @ linear)
    for term in ("normal", "tangent", "straight", "edge"):
        assert zero(found[term]), term
    assert found["ties"] > 1e-6  # the distance between the parts has changed


def test_normal_is_zero_for_axis_scaling_of_an_axis_aligned_box_only() -> None:
    part = stages(drawing("M0,0 H40 V20 H0 Z", handles=[pin(0, 0)])).problem
    assert zero(terms.normal(part, part.start * [3.0, 0.5]))
    assert zero(terms.normal(part, part.start * [-1.0, 1.0]))  # it does not see an edge turned by 180 degrees
    assert terms.normal(part, part.start @ rotation(1.0)) > 1e-3
    assert terms.normal(BOX, BOX.start * [3.0, 0.5]) > 1e-3  # the curve beside it is not aligned
    assert zero(terms.straight(BOX, BOX.start * [3.0, 0.5]))


@pytest.mark.parametrize("degrees", [0.1, 10.0, 90.0])
@pytest.mark.parametrize("scale", [0.5, 1.0, 2.0])
def test_normal_and_edge_of_a_rotation(degrees: float, scale: float) -> None:
    """Every edge turns by the same angle: sum max(1, l^2) sin^2, and the chord of the unit circle."""
    angle = np.radians(degrees)
    v = scale * BOX.start @ rotation(degrees).T
    stretch = np.maximum(1.0, (scale * BOX.lengths) ** 2).sum()
    assert terms.normal(BOX, v) == pytest.approx(stretch * np.sin(angle) ** 2, rel=1e-8)
    assert terms.edge(BOX, v) == pytest.approx(stretch * (2 * np.sin(angle / 2)) ** 2, rel=1e-8)
    assert zero(terms.tangent(BOX, v))
    assert terms.straight(BOX, v) < 1e-15


def test_edge_sees_what_normal_does_not() -> None:
    turned = -BOX.start
    assert zero(terms.normal(BOX, turned))
    assert terms.edge(BOX, turned) == pytest.approx(4.0 * np.maximum(1.0, BOX.lengths**2).sum())


def test_tangent_sees_lengths_only() -> None:
    part = stages(drawing(BLOB, handles=[pin(10, 80)])).problem
    assert zero(terms.tangent(part, part.start * [1.0, -1.0]))
    # An arc opened to another curvature with the lengths it had.
    line = np.concatenate([[0.0], np.cumsum(np.tile(1.0, 8))])
    points = np.stack([8 * np.sin(line / 8), 8 * np.cos(line / 8)], axis=1) / (16 * np.sin(1 / 16))
    opened = networks.free(networks.simple(points, [[n, n + 1] for n in range(8)]))
    straightened = np.stack([line, 0 * line], axis=1)
    assert zero(terms.tangent(opened, straightened))
    assert terms.tangent(opened, straightened**1.1) > 1e-3
    # One edge grown by a tenth: a turn on each of its sides, in both orders.
    stretched = straightened.copy()
    stretched[4:, 0] += 0.1
    weight = opened.turn_weight[0]
    assert terms.tangent(opened, stretched) == pytest.approx(4 * weight * 0.1**2)


def test_tangent_allows_what_grows_in_proportion() -> None:
    points = np.array([[0.0, 0.0], [1.0, 0.0], [3.0, 0.0], [7.0, 0.0]])  # every edge twice the last
    problem = networks.free(networks.simple(points, [[0, 1], [2, 1], [2, 3]]))
    assert zero(terms.tangent(problem, problem.start))
    even = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]])
    # Ratios 1/2 and 2 in both orders: (1 - 1/2)^2 + (1 - 2)^2, twice.
    assert terms.tangent(problem, even) == pytest.approx(2 * (0.25 + 1.0))


def test_straight_is_zero_for_affine_maps_and_sees_a_bend() -> None:
    part = stages(drawing("M0,0 L40,20 L10,40 Z", handles=[pin(0, 0)])).problem
    assert len(part.straight)
    assert zero(1e-4 * terms.straight(part, part.start @ np.array([[2.0, 0.5], [-0.3, 0.4]])))
    i, j, _ = part.straight[3]
    v = part.start.copy()
    v[i] += 0.01 * np.array([1.0, -2.0])
    assert terms.straight(part, v) > 1.0
    # Sliding along the line is free.
    v = part.start.copy()
    v[i] += 0.2 * (part.start[j] - part.start[i])
    assert terms.straight(part, v) < 1e-18 * 1e4 * 10


def test_straight_of_a_known_bend() -> None:
    """Two unit vectors at an angle a differ by 2 sin(a/2); w_s and both orders."""
    points = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    problem = networks.free(networks.simple(points, [[0, 1], [1, 2]], [[1, 0, 2]]))
    for degrees in (1.0, 30.0, 180.0):
        v = points.copy()
        v[2] = v[1] + 3.0 * rotation(degrees) @ [1.0, 0.0]
        wanted = 2 * 1e4 * (2 * np.sin(np.radians(degrees) / 2)) ** 2
        assert terms.straight(problem, v) == pytest.approx(wanted)


def test_straight_keeps_the_bend_of_the_input() -> None:
    points = np.array([[0.0, 0.0], [1.0, 0.001], [2.0, 0.0]])
    problem = networks.free(networks.simple(points, [[0, 1], [1, 2]], [[1, 0, 2]]))
    assert zero(terms.straight(problem, problem.start))
    assert terms.straight(problem, problem.start * [1.0, 0.0]) > 1e-3


def test_handle_is_the_squared_distance_to_the_targets() -> None:
    v = BOX.start.copy()
    v[BOX.handles] = BOX.targets
    assert zero(terms.handle(BOX, v))
    v[BOX.handles[0]] += [0.3, -0.4]
    assert terms.handle(BOX, v) == pytest.approx(1e5 * 0.25)


def test_the_scaffold_sees_parts_move_apart_only() -> None:
    of = networks.graph(noise=0.01)
    joined = networks.scaffold(of.points, networks.SCAFFOLD)
    problem = core_problem(
        analyse(of, np.array([0]), Weights()), of.points[[0]], joined, np.zeros(len(of.edges))
    )
    v = problem.start.copy()
    v[10:] += [0.5, 0.0]
    a, b = np.array(networks.SCAFFOLD).T
    lengths = np.linalg.norm(problem.start[b] - problem.start[a], axis=1)
    wanted = 0.01 / len(lengths) * np.sum(0.25 / lengths**2)
    assert terms.ties(problem, v) == pytest.approx(wanted)
    for term in ("normal", "tangent", "straight", "edge"):
        assert zero(terms.terms(problem, v)[term])


def test_ties_part_more_easily_along_their_curves_than_across() -> None:
    of = networks.simple(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 2.0], [1.0, 2.0]]), [[0, 1], [2, 3]])
    one = replace(networks.scaffold(of.points, [(0, 2)]), slide=np.array([0.25]), weight=np.array([3.0]))
    problem = core_problem(analyse(of, np.array([0]), Weights()), of.points[[0]], one, np.zeros(2))
    for shift, wanted in (((0.0, 0.5), 3.0 / 16), ((0.5, 0.0), 3.0 / 64), ((0.5, 0.5), 3.0 * 5 / 64)):
        v = problem.start.copy()
        v[2:] += shift
        assert terms.ties(problem, v) == pytest.approx(wanted)


def test_ties_of_no_length_count_as_a_tenth_of_an_edge() -> None:
    of = networks.graph()
    points = of.points.copy()
    points[10] = points[4]
    at_once = networks.simple(points, networks.EDGES)
    joined = networks.scaffold(points, [(4, 10)])
    problem = core_problem(
        analyse(at_once, np.array([0]), Weights()), points[[0]], joined, np.zeros(len(of.edges))
    )
    v = problem.start.copy()
    v[10] += [0.1, 0.0]
    assert terms.ties(problem, v) == pytest.approx(0.01)


# --- the rounded kink, sizes --------------------------------------------------------------------


@pytest.mark.parametrize("softness", [0.1, 0.7])
def test_the_rounded_weight_is_a_hyperbola_with_its_derivatives(softness: float) -> None:
    """Its asymptotes are the branches of max(1, l^2): (w - 1)(w - l^2) = s^2 / 4, above both."""
    length = np.array([0.0, 0.3, 0.9, 1.0, 1.1, 2.0, 5.0])
    weight, first, second = terms.stretch_weight_derivatives(length, softness)
    assert (weight > np.maximum(1.0, length**2)).all()
    assert (weight - 1.0) * (weight - length**2) == pytest.approx(np.full(7, softness**2 / 4.0), rel=1e-9)
    assert terms.stretch_weight(length, softness) == pytest.approx(weight, rel=1e-15)
    assert (terms.stretch_weight(length) == np.maximum(1.0, length**2)).all()
    h = 1e-5
    before = terms.stretch_weight_derivatives(length - h, softness)
    after = terms.stretch_weight_derivatives(length + h, softness)
    assert first == pytest.approx((after[0] - before[0]) / (2.0 * h), abs=1e-7)
    assert second == pytest.approx((after[1] - before[1]) / (2.0 * h), abs=1e-6)


@pytest.mark.parametrize("degrees", [10.0, 90.0])
def test_normal_and_edge_of_a_rotation_with_the_rounded_weight(degrees: float) -> None:
    softness, angle = 0.3, np.radians(degrees)
    v = BOX.start @ rotation(degrees).T
    square = BOX.lengths**2
    stretch = 0.5 * np.sum(1.0 + square + np.sqrt((square - 1.0) ** 2 + softness**2))
    wanted = stretch * np.sin(angle) ** 2, stretch * (2 * np.sin(angle / 2)) ** 2
    assert terms.normal(BOX, v, softness) == pytest.approx(wanted[0], rel=1e-8)
    assert terms.edge(BOX, v, softness) == pytest.approx(wanted[1], rel=1e-8)
    still = terms.tangent(BOX, v) + terms.straight(BOX, v) + terms.handle(BOX, v)
    assert terms.alup(BOX, v, softness) == pytest.approx(wanted[0] + still, rel=1e-8)
    # Of the other terms only ties change under a rotation.  They have no weight of stretched edges.
    whole = sum(wanted) + still + terms.ties(BOX, v)
    assert terms.objective(BOX, v, softness) == pytest.approx(whole, rel=1e-8)


def test_without_the_weight_of_stretching_every_edge_counts_once() -> None:
    plain = replace(BOX, weights=replace(BOX.weights, stretch=False))
    v = SCALE * BOX.start @ rotation(10.0).T
    assert terms.normal(plain, v, 0.3) == pytest.approx(len(BOX.edges) * np.sin(np.radians(10.0)) ** 2)


def test_size_is_the_squared_change_of_the_lengths() -> None:
    of = networks.graph(noise=0.01)
    weighted = networks.core(of, size=0.3)
    v = SCALE * weighted.start
    wanted = 0.3 * (SCALE - 1.0) ** 2 * np.sum(weighted.lengths**2)
    assert terms.size(weighted, v) == pytest.approx(wanted)
    assert zero(terms.size(weighted, weighted.start @ rotation(50.0)))
    # It is a part of F in both functions that give F, and not of E_ALUP.
    plain, found = terms.terms(networks.core(of), v), terms.terms(weighted, v)
    assert found["objective"] - plain["objective"] == pytest.approx(wanted, rel=1e-6)
    assert terms.objective(weighted, v) == pytest.approx(found["objective"], rel=1e-12)
    assert terms.alup(weighted, v) == pytest.approx(plain["alup"], rel=1e-12)


# --- units, weights -----------------------------------------------------------------------------


@pytest.mark.parametrize("scale", [1e-4, 1e5])
@pytest.mark.parametrize("final", [False, True])
def test_energies_do_not_depend_on_the_units(scale: float, final: bool) -> None:
    first, second = (
        networks.both_rounds(networks.graph(s, noise=0.01))[:2][int(final)] for s in (1.0, scale)
    )
    v = networks.random_positions(first, 3)
    a, b = terms.terms(first, v), terms.terms(second, v)
    for term in a:
        assert a[term] == pytest.approx(b[term], rel=1e-7, abs=1e-12), term
    assert np.abs(first.start - second.start).max() < 1e-9


def test_weights_multiply_their_terms() -> None:
    of = networks.graph()
    v = networks.random_positions(networks.core(of), 2)
    plain = terms.terms(networks.core(of), v)
    factors = {"normal": 2.0, "tangent": 3.0, "edge": 5.0, "straight": 7.0, "handle": 11.0}
    usual = Weights()
    weights = Weights(**{name: factor * getattr(usual, name) for name, factor in factors.items()})
    weighted = terms.terms(networks.core(of, weights), v)
    for term, factor in factors.items():
        assert weighted[term] == pytest.approx(factor * plain[term]), term
    core = networks.core(of)
    heavy = replace(core, tie_weight=13.0 * core.tie_weight)
    assert terms.ties(heavy, v) == pytest.approx(13.0 * plain["ties"])


def test_edges_of_no_length_have_finite_energy() -> None:
    of = networks.graph()
    problem = networks.core(of)
    v = problem.start.copy()
    v[1] = v[0]
    found = terms.terms(problem, v)
    assert all(np.isfinite(value) for value in found.values())
