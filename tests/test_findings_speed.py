# SPDX-License-Identifier: GPL-2.0-or-later
"""What made single drawings take minutes, bounded by counts of entries and operations, never by seconds."""

from __future__ import annotations

import time
from typing import Any

import builders
import networks
import numpy as np
import pytest
from scipy.sparse import csc_matrix, triu

from alup.network import overlaps, weld
from alup.solver import descent, minimise, newton, outcome
from alup.solver.alternation import Alternation
from alup.solver.coarse_levels import coarsen
from alup.sparse.least_squares import BlockAssembly

Array = np.ndarray


def path(points: Array) -> str:
    return "M" + " L".join(f"{x:.6f},{y:.6f}" for x, y in points)


def star(points: int, step: int) -> str:
    """A star polygon, a side of which crosses 2 (step - 1) others."""
    angle = 2.0 * np.pi * step / points * np.arange(points)
    return path(100.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)) + " Z"


def straight_lines(edges: Array, straight: Array) -> csc_matrix:
    """The upper triangle of what holds edges (E, 2) together and straight turns (T, 3) straight."""
    count = int(edges.max()) + 1
    blocks = BlockAssembly(count, 1)
    blocks.add_edges(edges, (np.zeros(len(edges), dtype=int),), (np.array([[2.0, 0.5], [0.5, 1.0]]),))
    times = (-2.0, 1.0, 1.0)
    for a in range(3):
        for b in range(a, 3):
            matrix = 10.0 * times[a] * times[b] * (0.5 if a == b else 1.0) * np.eye(2)
            blocks.add(straight[:, a], straight[:, b], (np.zeros(len(straight), dtype=int),), (matrix,))
    blocks.add(np.arange(count), np.arange(count), (np.zeros(count, dtype=int),), (0.5e-3 * np.eye(2),))
    return blocks.finish().matrix(np.ones(1))


def star_matrix(points: int = 72, step: int = 23) -> csc_matrix:
    """Of a star polygon's coarser level, with a sample or two between neighbouring crossings."""
    samples = builders.sampled(builders.drawing(star(points, step)), spacing=1.0)[1]
    problem = builders.untied(samples, np.array([0]), samples.points[:1] + 1.0)
    level = coarsen(problem)
    assert level is not None
    return straight_lines(level.problem.edges, level.problem.straight)


def test_blocks_of_points_are_full() -> None:
    paired = star_matrix(20, 7).tocoo()
    size = paired.shape[0]
    pattern = csc_matrix((np.ones(paired.nnz), (paired.row, paired.col)), shape=paired.shape)
    pattern = (pattern + pattern.T).tocoo()
    block = (pattern.row // 2) * (size // 2) + pattern.col // 2
    assert (np.unique(block, return_counts=True)[1] == 4).all()


def test_a_star_of_crossing_lines_fills_the_factor_as_its_points_do() -> None:
    """The order of unknowns is as good as one of points, whose factor has a quarter of the entries."""
    qdldl = pytest.importorskip("qdldl")
    paired = star_matrix()
    entries = qdldl.Solver(paired, upper=True).factors()[0].nnz
    block = paired.tocoo()
    points = paired.shape[0] // 2
    graph = csc_matrix((np.ones(block.nnz), (block.row // 2, block.col // 2)), shape=(points, points))
    graph.data[:] = -1.0
    graph.setdiag(np.full(points, 100.0))
    of_points = qdldl.Solver(csc_matrix(triu(graph)), upper=True).factors()[0].nnz
    # Within each point's block one entry more; 2 leaves ordering its luck.
    assert entries <= 2.0 * (4 * of_points + points)


def test_lines_that_run_along_each_other_are_compared_without_feet(monkeypatch: pytest.MonkeyPatch) -> None:
    """60 strips of one line, each pair of which overlaps: no stretch needs Newton's method to be judged."""
    feet, compared = [0], [0]
    nearest, few = overlaps._nearest, overlaps._together

    def counted(curves: Any, s: Array, *others: Any) -> Array:
        feet[0] += len(s)
        return nearest(curves, s, *others)

    def judged(curves: Any, a: Array, *others: Any) -> tuple[Array, Array]:
        compared[0] += len(a)
        return few(curves, a, *others)

    monkeypatch.setattr(overlaps, "_nearest", counted)
    monkeypatch.setattr(overlaps, "_together", judged)
    strips = [path(np.array([[n, 0.0], [100.0 + n, 0.0]])) for n in range(60)]
    net = weld.build(builders.drawing(*strips), 0.01)
    assert len(net.curves) == 119  # between 120 ends
    assert compared[0] > 60 * 59 / 2
    assert feet[0] < compared[0] / 10


def test_stretches_are_judged_the_same_however_many_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    drawing = builders.drawing(
        "M0,0 C40,30 60,30 100,0",
        "M0,0.004 C40,30 60,30 100,0.004",
        "M0,0 C40,31 60,29 100,0",
        "M-5,0 L105,0",
    )
    whole = weld.build(drawing, 0.01)
    monkeypatch.setattr(overlaps, "_BATCH", 3)
    parts = weld.build(drawing, 0.01)
    assert whole.contacts == parts.contacts
    assert np.array_equal(whole.curves, parts.curves)


def test_a_drawing_that_only_shrinks_is_done_at_once() -> None:
    """What rounding leaves of thousands of straight turns is no energy that could still fall."""
    samples = builders.sampled(builders.drawing(star(20, 7)), spacing=0.2)[1]
    held = np.array([np.argmin(samples.points[:, 0]), np.argmax(samples.points[:, 0])])
    targets = 0.3 * samples.points[held]
    problem = builders.untied(samples, held, targets)
    assert len(problem.straight) > 5000
    found = minimise.newton(problem)
    assert found.status is outcome.Status.MINIMUM
    assert found.iterations + found.coarse <= 30
    assert np.allclose(problem.to_user(found.positions), 0.3 * samples.points, atol=1e-7)


def test_no_second_alternation_begins_when_the_time_is_up(monkeypatch: pytest.MonkeyPatch) -> None:
    begun = [0]

    class Counted(minimise.Alternation):
        def positions(self, v: Array, l: Array) -> Array:
            begun[0] += 1
            return super().positions(v, l)

    monkeypatch.setattr(minimise, "Alternation", Counted)
    samples = builders.sampled(builders.drawing("M0,0 L100,0 L100,60 L0,60 Z"))[1]
    target = samples.points[[0, 10]] + [[0.0, 0.0], [40.0, 20.0]]
    problem = builders.untied(samples, np.array([0, 10]), target)
    found = minimise.newton(problem, outcome.Limits(deadline=time.monotonic()))
    assert begun[0] == 1
    assert found.status is outcome.Status.TIME


def test_a_refused_step_is_not_tried_again_when_the_time_is_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each try factorises once; what was not tried is no minimum."""
    stage = descent.FINE[-1]
    samples = builders.sampled(builders.drawing("M0,0 L100,0 L100,60 L0,60 Z"))[1]
    target = samples.points[[0, 10]] + [[0.0, 0.0], [40.0, 20.0]]
    models = newton.Newton(builders.untied(samples, np.array([0, 10]), target))
    now = models.objective.state(models.problem.start, stage.softness)
    models.model(now, stage.softness)
    tried = [0]

    def uphill(_damping: float) -> Array:
        tried[0] += 1
        return 100.0 * models.gradient

    monkeypatch.setattr(models, "step", uphill)
    after, _, damping = descent.damped_step(
        models, now, stage, 1e-3, outcome.Limits(deadline=time.monotonic())
    )
    assert after is now
    assert damping <= descent.DAMPING[2]
    assert tried[0] == 1
    after, _, damping = descent.damped_step(models, now, stage, 1e-3)
    assert after is now
    assert damping > descent.DAMPING[2]


def test_the_alternation_orders_points() -> None:
    """All 2x2 blocks of its matrix are full, straight turns and all."""
    steps = Alternation(networks.core(networks.graph()))
    matrix = steps._assembly.matrix(np.ones(steps._assembly._map.shape[1]))
    column = np.repeat(np.arange(matrix.shape[1]), np.diff(matrix.indptr))
    entries = set(zip(matrix.indices.tolist(), column.tolist()))
    for row, col in list(entries):
        p, q = row - row % 2, col - col % 2
        assert {(p + r, q + c) for r in (0, 1) for c in (0, 1) if p + r <= q + c} <= entries
