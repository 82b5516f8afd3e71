# SPDX-License-Identifier: GPL-2.0-or-later
"""The coarse level stands for the fine one: same places, same energies of even changes, same minima."""

from __future__ import annotations

import time
from dataclasses import replace

import networks
import numpy as np
import pytest
from builders import BLOB, drag, drawing, pin, stages

from alup.energy import terms
from alup.energy.objective import State
from alup.energy.problem import Problem
from alup.geometry.edges import edge_vectors
from alup.model import Ties
from alup.network.sampling import Samples
from alup.solver import descent, minimise, newton
from alup.solver.coarse_levels import MERGED, Level, coarsen
from alup.solver.descent import Stage
from alup.solver.outcome import Limits, Status
from alup.solver.straight_runs import StraightRuns

# A rectangle of lines with rounded ends, and a circle apart.
SLAB = "M0,0 L200,0 C230,0 230,40 200,40 L0,40 C-30,40 -30,0 0,0 Z"
CIRCLE = "M100,20 C100,25.5 95.5,30 90,30 S80,25.5 80,20 S84.5,10 90,10 S100,14.5 100,20 Z"
HANDLES = [pin(0, 0), pin(0, 40), pin(222.5, 20), drag((200, 0), (260, 0)), drag((200, 40), (260, 40))]


def problem(*paths: str, spacing: float = 1.0, handles: list | None = None, tied: bool = False) -> Problem:
    return stages(drawing(*paths, handles=handles or HANDLES), spacing=spacing, tied=tied).problem


def level(of: Problem) -> Level:
    found = coarsen(of)
    assert found is not None
    return found


def test_the_start_is_prolonged_to_the_start() -> None:
    for of in (problem(SLAB), problem(BLOB, handles=[pin(10, 80), drag((140, 60), (160, 60))])):
        coarse = level(of)
        assert coarse.prolongations(coarse.problem.start)[0] == pytest.approx(of.start, abs=1e-12)
        moved = coarse.problem.start + [3.0, -2.0]
        assert coarse.prolongations(moved)[0] == pytest.approx(of.start + [3.0, -2.0], abs=1e-12)


def test_lines_stay_lines_under_any_affine_map() -> None:
    of = problem("M0,0 L200,0 L150,90 L0,40 Z", handles=[pin(0, 0), drag((200, 0), (260, 0))])
    coarse = level(of)
    linear = np.array([[1.4, 0.3], [-0.2, 0.7]])
    prolonged = coarse.prolongations(coarse.problem.start @ linear)[0]
    assert prolonged == pytest.approx(of.start @ linear, abs=1e-11)


def test_curves_follow_a_similarity_closely() -> None:
    of = problem(SLAB, spacing=2.0)
    coarse = level(of)
    turned = np.array([[0.8, 0.6], [-0.6, 0.8]]) * 1.3
    off = coarse.prolongations(coarse.problem.start @ turned)[0] - of.start @ turned
    assert np.abs(off).max() < 0.1  # in edges


def test_a_curve_whose_chord_shrinks_is_scaled() -> None:
    """Else what bulges from the chord keeps its size, and stands across it: much of the energy."""
    of = problem(BLOB, spacing=2.0, handles=[pin(10, 80), drag((140, 60), (150, 60))])
    coarse = level(of)
    v = coarse.problem.start.copy()
    v = v[0] + (v - v[0]) * [0.01, 0.005]
    choices = coarse.prolongations(v)
    cubic, linear, scaled = (terms.edge(of, choice) for choice in choices)
    assert scaled < 0.6 * min(cubic, linear)
    for choice in choices:
        assert (choice[coarse.kept] == v).all()
    vectors = [
        edge_vectors(points, of.edges).view(np.complex128).ravel() for points in (of.start, choices[2])
    ]
    chords = [
        edge_vectors(points, coarse.problem.edges).view(np.complex128).ravel()[coarse._group]
        for points in (coarse.problem.start, v)
    ]
    shrunk = np.abs(chords[1]) < 0.5 * np.abs(chords[0])
    assert shrunk.sum() > 20
    assert (vectors[1] / chords[1])[shrunk] == pytest.approx((vectors[0] / chords[0])[shrunk], abs=1e-9)


def test_lines_that_are_to_bend_are_not_kept_straight_for_long(monkeypatch: pytest.MonkeyPatch) -> None:
    """A step that lowers F only with much damping is the last one of its stage."""
    steps = {True: 0, False: 0}
    step, quick = descent.damped_step, descent.STRAIGHT

    def counted(models: newton.Newton, now: State, stage: Stage, damping: float, limits: Limits) -> tuple:
        if stage is descent.STRAIGHT:
            steps[stage is quick] += 1
        return step(models, now, stage, damping, limits)

    monkeypatch.setattr(descent, "damped_step", counted)
    tee = "M0,0 H200 V100 H120 V60 H80 V100 H0 Z"
    moved = [drag((100, 60), (110, 80)), drag((200, 0), (230, 20)), drag((150, 0), (150, 10))]
    of = problem(tee, spacing=0.3, handles=[pin(0, 0), pin(0, 100), *moved])
    found = minimise.newton(of)
    assert found.status is Status.MINIMUM
    monkeypatch.setattr(descent, "STRAIGHT", replace(quick, hard=np.inf))
    slowly = minimise.newton(of)
    assert 0 < steps[True] < steps[False]
    assert terms.objective(of, found.positions) <= 1.001 * terms.objective(of, slowly.positions)


def test_what_matters_is_kept_and_every_edge_counted() -> None:
    of = problem(SLAB, CIRCLE, tied=True)
    coarse = level(of)
    assert set(of.handles) <= set(coarse.kept)
    assert len(coarse.problem.tie_samples) == len(of.tie_samples) > 0
    assert (coarse.kept[coarse.problem.handles] == of.handles).all()
    assert coarse.problem.mass.sum() == len(of.edges)
    assert coarse.problem.mass.max() <= 2 * MERGED
    valence = np.bincount(of.edges.ravel(), minlength=len(of.start))
    assert set(np.flatnonzero(valence != 2)) <= set(coarse.kept)


def test_samples_without_an_edge_are_kept() -> None:
    of = problem(SLAB)
    lone = replace(of, start=np.concatenate([of.start, [[0.0, 0.0]]]))
    assert len(of.start) in level(lone).kept


@pytest.mark.parametrize("stretch", [0.6, 1.0, 1.7])
def test_even_changes_have_the_energy_that_they_have_on_the_fine_level(stretch: float) -> None:
    """Lines, evenly stretched and turned: the merged edges stand exactly for theirs."""
    triangle = "M0,0 L200,0 L150,90 L0,40 Z"
    before = drawing(triangle, "M40,6 L140,6", handles=[pin(0, 0), drag((200, 0), (260, 0))])
    of = stages(before, spacing=1.0).problem
    assert len(of.tie_samples)
    of = replace(of, size=np.full(len(of.edges), 0.3))
    coarse = level(of)
    c, s = np.cos(0.2), np.sin(0.2)
    linear = stretch * np.array([[c, s], [-s, c]])
    fine, rough = (energy_of(one, one.start @ linear) for one in (of, coarse.problem))
    for term in ("normal", "edge", "size", "ties", "handle", "straight"):
        assert rough[term] == pytest.approx(fine[term], rel=1e-9, abs=1e-12), term


def energy_of(of: Problem, v: np.ndarray) -> dict[str, float]:
    """The terms with masses, which `energy` does not know."""
    from alup.energy.objective import Objective

    return Objective(of).state(v, 0.0).terms


def test_the_gradient_and_hessian_know_the_masses() -> None:
    """Around the start, where nothing is left over, against differences of the gradient and of F."""
    from alup.energy.objective import Objective

    of = level(problem(SLAB, spacing=4.0)).problem
    of = replace(of, targets=of.start[of.handles], size=np.full(len(of.edges), 0.3))
    assert (of.mass > 1.0).any()
    objective = Objective(of)

    def gradient(v: np.ndarray) -> np.ndarray:
        return objective.derivatives(objective.state(v, 0.1), 0.1)[0].ravel()

    values = objective.derivatives(objective.state(of.start, 0.1), 0.1)[1]
    upper = objective.structure.assembly.matrix(values).toarray()
    moves = 1e-5 * np.eye(of.start.size).reshape(-1, *of.start.shape)
    differences = [(gradient(of.start + move) - gradient(of.start - move)) / 2e-5 for move in moves]
    assert upper + np.triu(upper, 1).T == pytest.approx(np.array(differences), abs=1e-7 * np.abs(upper).max())
    away = of.start * [1.2, 0.9] + 0.05 * np.sin(of.start)
    slope = [
        (objective.state(away + move, 0.1).value - objective.state(away - move, 0.1).value) / 4e-5
        for move in moves
    ]
    scale = np.abs(gradient(away)).max()
    assert gradient(away) == pytest.approx(np.array(slope), abs=1e-6 * scale)


def test_a_line_is_retracted_through_the_handle_on_it() -> None:
    """The ends give way, the handle does not."""
    of = problem("M0,0 L200,0 L150,90 L0,40 Z", handles=[pin(0, 40), drag((80, 0), (90, 5))])
    of = networks.final(of, of.to_user(of.start), stages_graph("M0,0 L200,0 L150,90 L0,40 Z"), Ties.none())
    runs = StraightRuns(of)
    on_line = np.abs(of.start[:, 1] - of.start[of.handles[1], 1]) < 1e-9
    bent = of.start.copy()
    bent[of.handles[1]] += [0.3, 0.7]
    retracted = runs.retract(bent)
    assert (retracted[of.handles] == bent[of.handles]).all()
    line = retracted[on_line]
    direction = line[line[:, 0].argmax()] - line[line[:, 0].argmin()]
    across = (line - line[0]) @ np.array([-direction[1], direction[0]]) / np.linalg.norm(direction)
    assert np.abs(across).max() < 1e-9
    assert runs.retract(of.start) == pytest.approx(of.start, abs=1e-9)


def stages_graph(path: str) -> Samples:
    handles = [pin(0, 40), drag((80, 0), (90, 5))]
    return stages(drawing(path, handles=handles), spacing=1.0, tied=False).samples


def test_a_gradual_change_of_scale_has_the_energy_of_the_fine_one() -> None:
    of = problem("M0,0 L300,0", handles=[pin(0, 0), drag((300, 0), (400, 0))])
    coarse = level(of)

    def grown(v: np.ndarray) -> np.ndarray:
        x = v[:, 0] - v[:, 0].min()
        return np.stack([x + 1e-3 * x**2, v[:, 1]], axis=1)

    fine, rough = (energy_of(one, grown(one.start))["tangent"] for one in (of, coarse.problem))
    assert rough == pytest.approx(fine, rel=0.05)


def test_levels_reach_what_the_finest_reaches_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    of = problem(SLAB, spacing=1.0)
    by_levels = minimise.newton(of)
    assert by_levels.coarse > 0
    monkeypatch.setattr(minimise, "SMALLEST", 10**9)
    alone = minimise.newton(of)
    assert alone.coarse == 0
    least = terms.objective(of, alone.positions)
    assert terms.objective(of, by_levels.positions) == pytest.approx(least, rel=1e-2)
    assert by_levels.iterations < alone.iterations


def test_iterations_do_not_grow_with_the_samples() -> None:
    steps = [minimise.newton(problem(SLAB, spacing=spacing)).iterations for spacing in (2.0, 0.5, 0.125)]
    assert max(steps) <= 8


@pytest.mark.parametrize("solver", ["newton", "paper"])
def test_when_the_time_is_up_the_best_state_is_returned(solver: str) -> None:
    of = problem(SLAB)
    found = minimise.SOLVERS[solver](of, Limits(deadline=time.monotonic()), None)
    assert found.status is Status.TIME
    assert np.isfinite(found.positions).all()
    assert terms.objective(of, found.positions) < terms.objective(of, of.start)


def test_a_second_round_uses_the_structures_of_the_first() -> None:
    of = problem(SLAB)
    first = minimise.newton(of)
    second = minimise.newton(replace(of, targets=of.targets + 1.0), Limits(), first)
    assert [id(one) for one in second.structures] == [id(one) for one in first.structures]
    fresh = minimise.newton(replace(of, targets=of.targets + 1.0))
    assert second.positions == pytest.approx(fresh.positions, abs=1e-6)
    other = minimise.newton(problem(SLAB, spacing=1.5), Limits(), first)
    assert not set(map(id, other.structures)) & set(map(id, first.structures))
