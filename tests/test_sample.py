# SPDX-License-Identifier: GPL-2.0-or-later
"""Even sampling, chains and straight turns."""

from __future__ import annotations

import numpy as np
import pytest
from builders import BLOB, drawing, mapped, rotation, sampled

from alup.geometry.bezier import arc_lengths, evaluate, subrange
from alup.model import Drawing
from alup.network import weld
from alup.network.sampling import Samples, sample, turns

SHAPES = {
    "blob": (BLOB,),
    "line": ("M0,0 L103,7",),
    "two squares": ("M0,0 H10 V10 H0 Z", "M10,0 H20 V10 H10 Z"),
    "uneven speed": ("M0,0 C0,0 1,0 90,40",),
    "loop": ("M0,0 C80,80 -80,80 0,0",),
    "parts": ("M0,0 C10,20 30,20 40,0", "M0,50 L40,50"),
}


def chains(samples: Samples) -> list[np.ndarray]:
    return [samples.chain[a:b] for a, b in zip(samples.chain_start[:-1], samples.chain_start[1:])]


def fractions(samples: Samples) -> list[np.ndarray]:
    return [samples.fraction[a:b] for a, b in zip(samples.chain_start[:-1], samples.chain_start[1:])]


@pytest.mark.parametrize("tip", [(30.0, 30.0), (0.011, 0.0109)])
@pytest.mark.parametrize("spacing", [0.7, 5.0])
def test_no_edge_joins_the_two_sides_of_a_fold(tip: tuple[float, float], spacing: float) -> None:
    """A spike that leaves and comes back on itself, as smooth curves without a control point make them."""
    x, y = tip
    spike = f"M80,60 C80,60 {80 + x},{60 + y} 80,60 C80,70 60,90 50,90 L40,60 Z"
    _, samples = sampled(drawing(spike), spacing)
    for chain in chains(samples):
        chord = np.linalg.norm(np.diff(samples.points[chain], axis=0), axis=1)
        assert chord.min() > 0.02 * chord.mean()


def slow_points(control: np.ndarray, fraction: np.ndarray) -> np.ndarray:
    """Points at fractions of the arc length, by 20,000 chords."""
    points = evaluate(control, np.linspace(0, 1, 20_001))
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return np.stack([np.interp(fraction * s[-1], s, points[:, d]) for d in (0, 1)], axis=1)


@pytest.mark.parametrize("paths", SHAPES.values(), ids=SHAPES.keys())
@pytest.mark.parametrize("spacing", [0.7, 3.0, 1000.0])
def test_chains_are_consistent(paths: tuple[str, ...], spacing: float) -> None:
    net, samples = sampled(drawing(*paths), spacing)
    assert (samples.points[: len(net.vertices)] == net.vertices).all()
    used = []
    joined = set()
    for curve, (chain, fraction) in enumerate(zip(chains(samples), fractions(samples))):
        assert (chain[0], chain[-1]) == tuple(net.ends[curve])
        assert (fraction[0], fraction[-1]) == (0.0, 1.0)
        assert (np.diff(fraction) > 0).all()
        used += chain[1:-1].tolist()
        joined |= {frozenset(pair) for pair in zip(chain[:-1].tolist(), chain[1:].tolist())}
        wanted = slow_points(net.curves[curve], fraction)
        assert samples.points[chain] == pytest.approx(wanted, abs=1e-3 * min(spacing, 1.0))
    # Inner samples belong to one curve, once; all samples are vertices or inner.
    assert sorted(used) == list(range(len(net.vertices), len(samples.points)))
    edges = [frozenset(edge) for edge in samples.edges.tolist()]
    assert set(edges) == joined
    assert len(set(edges)) == len(edges)  # no edge twice
    assert all(len(edge) == 2 for edge in edges)  # and none from a sample to itself


@pytest.mark.parametrize("paths", SHAPES.values(), ids=SHAPES.keys())
@pytest.mark.parametrize("spacing", [0.5, 2.0])
def test_samples_are_even_and_no_further_apart_than_the_spacing(
    paths: tuple[str, ...], spacing: float
) -> None:
    net, samples = sampled(drawing(*paths), spacing)
    lengths = arc_lengths(net.curves, 64)
    for length, fraction in zip(lengths, fractions(samples)):
        assert np.diff(fraction) == pytest.approx(1.0 / (len(fraction) - 1), rel=1e-9)
        step = length / (len(fraction) - 1)
        assert step <= spacing * (1 + 1e-5)
        # ... and no closer than needed: one sample less would be too few.
        if len(fraction) > 4:
            assert length / (len(fraction) - 2) > spacing * (1 - 1e-5)


@pytest.mark.parametrize("edges", [3, 7, 11, 14, 22, 28, 37])
def test_a_length_that_the_spacing_divides_needs_no_further_sample(edges: int) -> None:
    _, samples = sampled(drawing(f"M0,0 H{edges / 10!r}"), 0.1)  # 1.1 / 0.1 is 11.000000000000002
    assert len(samples.edges) == edges


@pytest.mark.parametrize("at", [0.013, 0.37, 0.5, 0.9])
def test_stops_are_samples_and_both_sides_are_even(at: float) -> None:
    before = drawing("M0,0 C0,40 60,40 100,0")
    net, _ = sampled(before)
    samples = sample(net, 2.0, np.array([0]), np.array([at]))
    stop = int(samples.stops[0])
    assert samples.points[stop] == pytest.approx(slow_points(net.curves[0], np.array([at]))[0], abs=2e-3)
    fraction = samples.fraction
    here = int(np.flatnonzero(samples.chain == stop)[0])
    assert fraction[here] == at
    for side in (fraction[: here + 1], fraction[here:]):
        assert np.diff(side) == pytest.approx(np.ptp(side) / (len(side) - 1), rel=1e-9)


def test_stops_beside_a_sample_are_that_sample() -> None:
    net, _ = sampled(drawing("M0,0 H100"))
    # A stop 1e-3 from the end is merged with the end, at a spacing of 2.  A stop 0.5 from it is a sample.
    samples = sample(net, 2.0, np.array([0, 0, 0, 0]), np.array([1e-5, 1 - 1e-5, 0.005, 0.0]))
    assert samples.points[samples.stops].round(6).tolist() == [[0, 0], [100, 0], [0.5, 0], [0, 0]]
    twice = sample(net, 2.0, np.array([0, 0]), np.array([0.33, 0.33 + 1e-5]))
    assert twice.stops[0] == twice.stops[1]
    apart = sample(net, 2.0, np.array([0, 0]), np.array([0.33, 0.34]))
    assert apart.stops[0] != apart.stops[1]
    edge = np.linalg.norm(np.diff(apart.points[apart.edges], axis=1)[:, 0], axis=1)
    assert edge.min() > 0.01


def test_stops_on_several_curves_come_back_in_their_order() -> None:
    net, _ = sampled(drawing("M0,0 H100", "M0,10 H100", "M0,20 H100"))
    curve, fraction = np.array([2, 0, 1, 0]), np.array([0.11, 0.77, 0.5, 0.23])
    samples = sample(net, 2.0, curve, fraction)
    wanted = np.stack([100 * fraction, 10.0 * curve], axis=1)
    assert samples.points[samples.stops] == pytest.approx(wanted, abs=1e-9)


def test_a_loop_encloses_something_and_short_parallels_differ() -> None:
    _, loop = sampled(drawing("M0,0 C20,20 -20,20 0,0"), 1000.0)
    assert len(loop.edges) >= 3
    _, pair = sampled(drawing("M0,0 C0,5 10,5 10,0 C10,-5 0,-5 0,0"), 1000.0)
    edges = [frozenset(edge) for edge in pair.edges.tolist()]
    assert len(set(edges)) == len(edges) >= 4


# --- turns --------------------------------------------------------------------------------------


def slow_turns(edges: np.ndarray) -> set[tuple[int, int, int, int, int]]:
    """(i, j, k, ij, ik) by going through all pairs of edges."""
    found = set()
    for a, (p, q) in enumerate(edges.tolist()):
        for b, (r, s) in enumerate(edges.tolist()):
            if a == b:
                continue
            for i, j in ((p, q), (q, p)):
                for i2, k in ((r, s), (s, r)):
                    if i == i2:
                        found.add((i, j, k, a, b))
    return found


@pytest.mark.parametrize(
    "edges",
    [
        [[0, 1], [1, 2], [2, 3]],
        [[0, 1], [2, 1], [1, 3], [4, 1]],  # a junction of four
        [[0, 1], [1, 2], [2, 0], [3, 4]],
        [[1, 0]],
    ],
)
def test_turns_are_all_ordered_pairs_at_each_sample(edges: list[list[int]]) -> None:
    array = np.array(edges)
    found = list(zip(*(x.tolist() for x in turns(array, 6))))
    assert len(found) == len(set(found))
    assert set(found) == slow_turns(array)


def test_no_edges_have_no_turns() -> None:
    assert [len(x) for x in turns(np.zeros((0, 2), dtype=int), 3)] == [0] * 5


def straight_at(samples: Samples) -> set[tuple[float, float]]:
    """Positions of the straight turns."""
    return {tuple(p) for p in samples.points[samples.straight_turns[:, 0]].round(3).tolist()}


def test_every_inner_sample_of_a_line_turns_straight() -> None:
    _, samples = sampled(drawing("M0,0 H10 V5"), 1.0)
    wanted = {(float(x), 0.0) for x in range(1, 10)} | {(10.0, float(y)) for y in range(1, 5)}
    assert straight_at(samples) == wanted  # not the corner, not the ends
    assert len(samples.straight_turns) == len(wanted)  # each pair once
    i, j, k = samples.straight_turns.T
    middle = (samples.points[j] + samples.points[k]) / 2
    assert samples.points[i] == pytest.approx(middle)


def test_collinear_cubics_are_lines_and_curves_are_not() -> None:
    _, samples = sampled(drawing("M0,0 C1,0 2,0 10,0"), 1.0)
    assert len(samples.straight_turns) == 9
    _, samples = sampled(drawing("M0,0 C1,0.01 2,0 10,0"), 1.0)
    assert len(samples.straight_turns) == 0
    _, samples = sampled(drawing(BLOB.replace("L140,60 L150,75 L120,100", "C140,60 150,75 120,100")), 1.0)
    assert len(samples.straight_turns) == 0


def test_a_node_within_a_line_turns_straight() -> None:
    _, samples = sampled(drawing("M0,0 L4,3 L8,6"), 1.0)
    assert (4.0, 3.0) in straight_at(samples)
    # Rounded to three decimals on the way: still straight; a visible bend is not.
    _, samples = sampled(drawing("M0,0 L3.333,2.5 L8,6"), 1.0)
    assert (3.333, 2.5) in straight_at(samples)
    _, samples = sampled(drawing("M0,0 L4,3.05 L8,6"), 1.0)
    assert (4.0, 3.05) not in straight_at(samples)


def test_a_line_turning_back_is_not_straight() -> None:
    _, samples = sampled(drawing("M0,0 L10,0 L5,0.0001"), 1.0)
    assert (10.0, 0.0) not in straight_at(samples)


def test_a_line_runs_on_straight_through_a_junction() -> None:
    _, samples = sampled(drawing("M0,0 H10 H20", "M10,0 V10"), 1.0)
    at = [t for t in samples.straight_turns.tolist() if samples.points[t[0]].tolist() == [10, 0]]
    assert len(at) == 1
    assert sorted(samples.points[at[0][1:]][:, 0].tolist()) == pytest.approx([9.0, 11.0])


# --- invariances --------------------------------------------------------------------------------


def canonical(before: Drawing, spacing: float) -> tuple[list, list, list]:
    _, samples = sampled(before, spacing)
    position = [tuple(p) for p in samples.points.round(5)]
    edges = sorted(tuple(sorted((position[a], position[b]))) for a, b in samples.edges)
    straight = sorted(
        (position[i], *sorted((position[j], position[k]))) for i, j, k in samples.straight_turns
    )
    return sorted(position), edges, straight


def test_the_order_of_the_paths_only_changes_numbers() -> None:
    paths = [BLOB, "M10,80 L60,130", "M0,0 H50 V10 H0 Z", "M50,0 H90 V10 H50 Z", "M200,0 L200,50"]
    first = canonical(drawing(*paths), 3.0)
    for order in ([4, 3, 2, 1, 0], [2, 0, 4, 1, 3]):
        assert canonical(drawing(*[paths[n] for n in order]), 3.0) == first


def test_samples_turn_and_grow_with_the_drawing() -> None:
    before = drawing(BLOB, "M0,0 H50 V10 H0 Z")
    _, first = sampled(before, 3.0)
    for scale, linear in ((1.0, rotation(77.0)), (1e-3, 1e-3 * np.eye(2)), (1e4, 1e4 * np.diag([1.0, -1.0]))):
        _, second = sampled(mapped(before, linear, [1.0, 2.0]), 3.0 * scale)
        assert (first.edges == second.edges).all()
        assert (first.straight_turns == second.straight_turns).all()
        assert np.abs(first.points @ linear.T + [1, 2] - second.points).max() < 1e-9 * max(1.0, 200 * scale)


def test_a_reversed_path_has_the_same_samples() -> None:
    before = drawing("M0,0 C1,30 4,-10 50,20")
    after = drawing("M50,20 C4,-10 1,30 0,0")
    (_, first), (_, second) = sampled(before, 1.0), sampled(after, 1.0)
    a, b = first.points[first.chain], second.points[second.chain][::-1]
    assert a == pytest.approx(b, abs=1e-5)


def test_part_keeps_whole_components_in_their_order() -> None:
    _, samples = sampled(drawing("M0,0 H10", "M0,5 C3,9 7,9 10,5", "M0,20 H6"), 1.0)
    keep = samples.points[:, 1] != 0.0
    part = samples.part(keep)
    assert (part.points == samples.points[keep]).all()
    before = {
        frozenset(map(tuple, samples.points[edge].tolist())) for edge in samples.edges if keep[edge].all()
    }
    assert {frozenset(map(tuple, part.points[edge].tolist())) for edge in part.edges} == before
    assert len(part.straight_turns) == 5


def test_the_sampling_converges_to_the_curve_as_the_spacing_halves() -> None:
    before = drawing(BLOB)
    length = []
    for spacing in (8.0, 4.0, 2.0, 1.0):
        net, samples = sampled(before, spacing)
        vectors = samples.points[samples.edges[:, 1]] - samples.points[samples.edges[:, 0]]
        length.append(arc_lengths(net.curves, 64).sum() - np.linalg.norm(vectors, axis=1).sum())
    ratio = np.array(length[:-1]) / np.array(length[1:])
    assert (ratio > 3.0).all()  # second order: four times less each time
    assert (ratio < 5.5).all()


def test_network_pieces_and_samples_agree_on_part_of_a_curve() -> None:
    """`parameters` is what refit uses to find samples along a segment."""
    control = drawing("M0,0 C1,30 4,-10 50,20").control
    t = weld.parameters_at(control, np.array([[0.5]]))[0, 0]
    halves = np.stack([subrange(control[0], a, b) for a, b in np.array(((0.0, t), (t, 1.0)))])
    lengths = arc_lengths(halves, 64)
    assert lengths[0] == pytest.approx(lengths[1], rel=1e-4)
