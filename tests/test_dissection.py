# SPDX-License-Identifier: GPL-2.0-or-later
"""Nested dissection, and a limit of time that no factorisation breaks.  Work is counted, never seconds."""

from __future__ import annotations

from functools import lru_cache
from types import SimpleNamespace

import builders
import numpy as np
import pytest
from builders import drag, drawing, pin
from scipy.sparse import csc_matrix

from alup.energy.problem import Problem
from alup.model import Array, Drawing
from alup.session import session
from alup.solver import minimise, newton, outcome
from alup.solver.alternation import Alternation
from alup.sparse import dissection, least_squares
from alup.sparse.dissection import dissect
from alup.sparse.least_squares import Factor


def grid(side: int) -> tuple[Array, Array]:
    """Points of a grid, (side^2, 2), and its sides, (n, 2)."""
    number = np.arange(side * side).reshape(side, side)
    across = np.stack([number[:, :-1], number[:, 1:]], axis=-1).reshape(-1, 2)
    along = np.stack([number[:-1], number[1:]], axis=-1).reshape(-1, 2)
    x, y = np.meshgrid(np.arange(side), np.arange(side))
    return np.stack([x.ravel(), y.ravel()], axis=1).astype(float), np.concatenate([across, along])


def filled(count: int, pairs: Array, order: Array) -> list[int]:
    """How many later points each point is coupled with when it is eliminated, in order."""
    beside: list[set[int]] = [set() for _ in range(count)]
    for a, b in pairs:
        beside[a].add(int(b))
        beside[b].add(int(a))
    left = []
    for point in order:
        later = beside[point]
        left.append(len(later))
        for other in later:
            beside[other] |= later
            beside[other] -= {other, int(point)}
    return left


def hatched(lines: int) -> Drawing:
    """Lines that end on a frame, so that all is one thing, which is joined at its crossings themselves."""
    at = np.linspace(1.0, 99.0, lines)
    paths = [f"M{x:g},0 V100" for x in at] + [f"M0,{y:g} H100" for y in at] + ["M0,0 H100 V100 H0 Z"]
    handles = [pin(1, 0), pin(1, 100), drag((99, 0), (129, 0)), drag((99, 100), (129, 110))]
    return drawing(*paths, handles=handles)


@lru_cache(maxsize=None)
def hatching(lines: int) -> Problem:
    made = session.Session(hatched(lines))
    targets = session.binding.anchors(made.drawing, made.held.grabbed, made.held.samples).targets
    assert made.held.rounds is not None
    return made.held.rounds.core(targets)[0]


@pytest.mark.parametrize("side", [1, 3, 12, 40])
def test_every_point_is_eliminated_once(side: int) -> None:
    points, pairs = grid(side)
    assert sorted(dissect(points, pairs).order) == list(range(side * side))


def test_points_in_one_place_are_halved_all_the_same() -> None:
    pairs = np.stack([np.arange(299), np.arange(1, 300)], axis=1)
    assert sorted(dissect(np.zeros((300, 2)), pairs).order) == list(range(300))


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_bounds_hold(seed: int) -> None:
    random = np.random.default_rng(seed)
    points = random.random((400, 2))
    distance = np.linalg.norm(points[:, None] - points, axis=2)
    pairs = np.argwhere((distance < 0.07) & (np.arange(400)[:, None] < np.arange(400)))
    found = dissect(points, pairs)
    left = np.array(filled(len(points), pairs, found.order))
    assert (left + 1).sum() <= found.entries <= 4.0 * (left + 1).sum()
    assert found.own.sum() == len(points)
    # The first point of a front is coupled with all of it at most.
    assert left.max() <= (found.own + found.border).max()


def test_a_factor_of_a_grid_has_little_more_entries_than_the_grid_points() -> None:
    """It has n log n, where row by row it is n^1.5."""
    entries = []
    for side in (20, 40, 80):
        points, pairs = grid(side)
        entries.append(dissect(points, pairs).entries / (side * side))
    assert entries[2] - entries[1] == pytest.approx(entries[1] - entries[0], rel=0.5)
    assert entries[2] < 60.0


def test_the_order_changes_no_solution() -> None:
    points, pairs = grid(15)
    count = len(points)
    low, high = pairs.min(axis=1), pairs.max(axis=1)
    data = np.concatenate([-np.ones(len(pairs)), np.full(count, 4.5)])
    every = np.arange(count)
    rows, columns = np.concatenate([low, every]), np.concatenate([high, every])
    upper = csc_matrix((data, (rows, columns)), shape=(count, count))
    right = np.random.default_rng(0).standard_normal(count)
    ordered, own = Factor(upper, order=dissect(points, pairs).order), Factor(upper)
    assert ordered.solve(right) == pytest.approx(own.solve(right), abs=1e-12)
    ordered.update(2.0 * upper)
    assert ordered.solve(right) == pytest.approx(0.5 * own.solve(right), abs=1e-12)


def test_few_junctions_leave_the_order_to_the_library() -> None:
    plan = Alternation(hatching(12))._plan
    assert plan.order is None


def test_the_alternation_of_a_hatching_takes_the_work_of_a_net() -> None:
    """By qdldl's own order the factor of 40 by 40 lines has five times the entries."""
    problem = hatching(34)
    steps = Alternation(problem)
    assert steps._plan.order is not None
    entries = steps._for_lengths(problem.lengths)._solver._factor.L.nnz
    assert entries <= 100.0 * len(problem.start)


@pytest.mark.parametrize("solver", ["newton", "paper"])
@pytest.mark.parametrize("factors", [0.5, 1.5, 4.0, 10.0])
def test_no_factorisation_is_begun_that_would_end_behind_the_limit(
    solver: str, factors: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a clock that counts multiplications."""
    problem = hatching(34)
    clock = SimpleNamespace(now=0.0, begun=0)
    watch = SimpleNamespace(monotonic=lambda: clock.now)
    for module in (outcome, newton, least_squares):
        monkeypatch.setattr(module, "time", watch)
    monkeypatch.setattr(dissection, "RATE", 1.0)
    one = Alternation(problem).seconds
    factorised = least_squares._Ordered.factorised

    def counted(self: least_squares._Ordered, upper: csc_matrix) -> least_squares._OrderedFactor:
        clock.begun += 1
        clock.now += one
        return factorised(self, upper)

    monkeypatch.setattr(least_squares._Ordered, "factorised", counted)
    found = minimise.SOLVERS[solver](problem, outcome.Limits(deadline=factors * one), None)
    assert found.status is outcome.Status.TIME
    assert np.isfinite(found.positions).all()
    assert clock.now <= 1.1 * factors * one
    assert (clock.begun > 0) == (factors > 1.0)


def test_the_search_for_crossings_ends_with_the_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is found until then is no network of crossings; the drawing is reshaped without."""
    monkeypatch.setattr("alup.network.curve_intersections._PAIRS", 64)
    before = hatched(10)
    whole = session.Session(before)
    assert whole.net.complete and whole.net.contacts["crossings"] >= 100
    assert not whole._notes
    ended = session.Session(before, deadline=0.0)
    assert not ended.net.complete and ended.net.contacts["crossings"] == 0
    assert "the search for crossings ended" in str(ended._notes[0])
    assert np.isfinite(ended.solve().moved).all()


def test_the_search_for_crossings_ends_with_the_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    """A network of more pieces than there may be samples is not made first and thrown away then."""
    monkeypatch.setattr("alup.network.curve_intersections._PAIRS", 64)
    looked = [0]
    meet = session.weld.contacts.intersections.__globals__["_arc_intersections"]

    def counted(*given: object) -> object:
        looked[0] += 1
        return meet(*given)

    monkeypatch.setattr("alup.network.curve_intersections._arc_intersections", counted)
    options = session.Options(max_vertices=400)
    ended = session.Session(hatched(40), options)
    assert not ended.net.complete
    assert looked[0] * 64 < 40 * 40


def test_a_small_drawing_is_searched_whatever_the_time() -> None:
    net = session.Session(
        builders.drawing("M0,0 L10,10", "M0,10 L10,0", handles=[pin(0, 0)]), deadline=0.0
    ).net
    assert net.complete and net.contacts["crossings"] > 0
