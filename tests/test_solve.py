# SPDX-License-Identifier: GPL-2.0-or-later
"""One round: why it stops, which state it returns, which energies it reports."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, Callable

import networks
import numpy as np
import pytest
import slow
from builders import BLOB, drag, drawing, pin, stages

from alup.energy import terms
from alup.energy.objective import Objective
from alup.energy.problem import Problem
from alup.solver import descent, minimise, paper_scheme
from alup.solver.coarse_levels import coarsen
from alup.solver.newton import Newton
from alup.solver.outcome import Limits, Round, Status
from alup.solver.paper_scheme import paper

Solver = Callable[[Problem, Limits], Round]

solvers = pytest.mark.parametrize("solver", minimise.SOLVERS.values(), ids=minimise.SOLVERS.keys())


def blob(target: tuple[float, float] = (170.0, 60.0)) -> Problem:
    handles = [pin(10, 80), pin(60, 20), drag((150, 75), target)]
    return stages(drawing(BLOB, "M50,60 C60,80 80,80 90,60 Z", handles=handles)).problem


# --- every solver -------------------------------------------------------------------------------


@solvers
def test_without_a_moved_handle_nothing_is_done(solver: Solver) -> None:
    problem = blob(target=(150.0, 75.0))
    found = solver(problem, Limits())
    assert found.status is Status.UNMOVED
    assert found.iterations == 0
    assert (found.positions == problem.start).all()
    assert len(found.history) == 1


@solvers
def test_the_limit_of_iterations(solver: Solver) -> None:
    limits = Limits(iterations=3, decrease=-np.inf, step=0.0)
    found = solver(blob(), limits)
    assert found.status is Status.ITERATIONS
    assert found.iterations == 3
    assert len(found.history) == 4


@solvers
def test_the_history_begins_at_the_start_and_contains_the_result(solver: Solver) -> None:
    problem = blob()
    found = solver(problem, Limits(iterations=30))
    assert len(found.history) == found.iterations + 1
    assert found.history[0] == terms.terms(problem, problem.start)
    mine = terms.terms(problem, found.positions)
    assert mine["alup"] < found.history[0]["alup"]
    # The returned positions are one of the states of the history, in which strained ties have let go.
    same = set(mine) - {"ties", "objective"}
    assert any(
        all(entry[term] == pytest.approx(mine[term], rel=1e-9, abs=1e-15) for term in same)
        for entry in found.history
    )


@solvers
def test_the_last_energies_recomputed_from_the_positions_in_plain_loops(solver: Solver) -> None:
    of = networks.graph(scale=4.0, noise=0.01)
    core = networks.core(of)
    # Ties that never let go, because the slow program does not compute when they do.
    core = replace(core, tie_softness=np.zeros(len(core.tie_weight)))
    first = solver(core, Limits(iterations=40, decrease=1e-7))
    second_problem = networks.final(core, core.to_user(first.positions), of, networks.ties(of))
    second = solver(second_problem, Limits(iterations=40, decrease=1e-7))
    kept = [tuple(turn) for turn in second_problem.straight.tolist()]
    twins = (
        (first, networks.slow_round(of, of.points, [(1, 0, 2)])),
        (second, networks.slow_round(of, core.to_user(first.positions), kept)),
    )
    for found, twin in twins:
        wanted = slow.energies(twin, found.positions)
        close = [
            entry
            for entry in found.history
            if all(entry[t] == pytest.approx(wanted[t], rel=1e-6, abs=1e-9) for t in wanted)
        ]
        assert close, (found.status, wanted, found.history[-1])
        # The result is the best state of the history: by E_ALUP in the paper's scheme, by F in Newton's.
        # The second descent of Newton's core round raises F by up to the share keep_size, to keep sizes.
        rise = 1.0 + (core.weights.keep_size if solver is not paper and found is first else 1e-6)
        term = "alup" if solver is paper else "objective"
        assert wanted[term] <= min(e[term] for e in found.history[1:]) * rise


@solvers
def test_handles_are_met(solver: Solver) -> None:
    problem = blob()
    found = solver(problem, Limits())
    away = np.linalg.norm(found.positions[problem.handles] - problem.targets, axis=1)
    # w_c = 1e5 against forces of order 1, in edges.
    assert away.max() < 1e-2


@solvers
def test_the_problem_is_not_changed(solver: Solver) -> None:
    problem = blob()
    before = {name: np.copy(getattr(problem, name)) for name in ("start", "lengths", "targets", "normals")}
    solver(problem, Limits(iterations=10))
    for name, value in before.items():
        assert (getattr(problem, name) == value).all(), name


@solvers
def test_the_same_twice(solver: Solver) -> None:
    problem = blob()
    one, two = (solver(problem, Limits(iterations=20)) for _ in range(2))
    assert (one.positions == two.positions).all()
    assert one.history == two.history


def test_every_outcome_has_a_sentence() -> None:
    for status in Status:
        assert len(status.value.split()) > 3


# --- the paper's scheme -------------------------------------------------------------------------


def scripted(monkeypatch: pytest.MonkeyPatch, problem: Problem, moves: list[np.ndarray]) -> None:
    """An alternation that goes through given positions."""
    remaining = list(moves)

    class Script:
        seconds = 0.0

        def __init__(self, of: Problem):
            assert of is problem

        def positions(self, _v: np.ndarray, _l: np.ndarray) -> np.ndarray:
            return remaining.pop(0)

        def lengths(self, _v: np.ndarray) -> np.ndarray:
            return problem.lengths

    monkeypatch.setattr(paper_scheme, "Alternation", Script)


def between(problem: Problem, goal: np.ndarray, share: float) -> np.ndarray:
    return (1 - share) * problem.start + share * goal


def test_stops_when_the_energy_falls_by_less_than_the_tolerance(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = blob()
    goal = paper(problem, Limits()).positions
    scripted(monkeypatch, problem, [between(problem, goal, s) for s in (0.5, 0.9, 0.9001, 1.0)])
    energies = [terms.alup(problem, between(problem, goal, s)) for s in (0.0, 0.5, 0.9, 0.9001)]
    falls = -np.diff(energies)
    assert (falls > 0).all()
    found = paper(problem, Limits(decrease=2 * falls[2], step=0.0))
    assert found.status is Status.DECREASE
    assert found.iterations == 3
    assert (found.positions == between(problem, goal, 0.9001)).all()


def test_goes_on_while_the_energy_falls_by_more(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = blob()
    goal = paper(problem, Limits()).positions
    path = [between(problem, goal, s) for s in (0.5, 0.9, 0.9001, 0.95)]
    energies = [terms.alup(problem, v) for v in path]
    scripted(monkeypatch, problem, path)
    found = paper(problem, Limits(iterations=4, decrease=0.5 * (energies[1] - energies[2]), step=0.0))
    assert found.status is Status.ITERATIONS
    assert found.iterations == 4


def test_stops_when_no_vertex_moves_far(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = blob()
    goal = paper(problem, Limits()).positions
    path = [between(problem, goal, s) for s in (0.5, 0.6, 0.60001, 0.7)]
    scripted(monkeypatch, problem, path)
    move = np.abs(path[2] - path[1]).max()
    found = paper(problem, Limits(decrease=-np.inf, step=2 * move))
    assert found.status is Status.STEP
    assert found.iterations == 3


def test_a_rise_stops_and_the_best_state_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = blob()
    goal = paper(problem, Limits()).positions
    path = [between(problem, goal, s) for s in (0.5, 0.95, 0.7, 1.0)]
    scripted(monkeypatch, problem, path)
    found = paper(problem, Limits(decrease=0.0, step=0.0))
    assert found.status is Status.RISE
    assert found.iterations == 3
    assert (found.positions == path[1]).all()
    alup = [entry["alup"] for entry in found.history]
    assert alup[3] > alup[2] == min(alup)
    assert terms.alup(problem, found.positions) == alup[2]


def test_a_rise_at_once_leaves_the_start(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = blob()
    away = problem.start.copy()
    away[problem.handles] += 100.0
    scripted(monkeypatch, problem, [away])
    found = paper(problem, Limits())
    assert found.status is Status.RISE
    assert (found.positions == problem.start).all()


def test_the_papers_scheme_is_the_alternation() -> None:
    of = networks.graph(scale=4.0, noise=0.01)
    problem = networks.core(of)
    twin = networks.slow_round(of, of.points, [(1, 0, 2)])
    found = paper(problem, Limits(iterations=4, decrease=-np.inf, step=0.0))
    v, l = problem.start, problem.lengths
    history = [slow.energies(twin, v)]
    for _ in range(found.iterations):
        v = slow.positions(twin, l)
        l = slow.lengths(twin, v)
        history.append(slow.energies(twin, v))
    for mine, wanted in zip(found.history, history):
        for term, value in wanted.items():
            assert mine[term] == pytest.approx(value, rel=1e-5, abs=1e-7), term


# --- Newton's method ----------------------------------------------------------------------------


def newton_model(problem: Problem, v: np.ndarray, softness: float) -> Any:
    model = Newton(problem)
    model.model(model.objective.state(v, softness), softness)
    return model


@pytest.mark.parametrize("softness", [0.0, 0.1])
@pytest.mark.parametrize("size", [0.0, 0.3])
def test_the_fused_objective_has_the_terms_energies(softness: float, size: float) -> None:
    problem = networks.core(networks.graph(noise=0.01), size=size)
    v = networks.random_positions(problem, 0, 0.1)
    found = Objective(problem).state(v, softness)
    assert found.terms == pytest.approx(terms.terms(problem, v), rel=1e-12, abs=1e-15)
    assert found.value == pytest.approx(terms.objective(problem, v, softness), rel=1e-12)


@pytest.mark.parametrize("softness", [0.0, 0.1])
def test_the_terms_are_those_of_a_coarse_level_too(softness: float) -> None:
    """There an edge stands for several; `energy` has the sums written out."""
    level = coarsen(blob())
    assert level is not None
    coarse = level.problem
    assert coarse.mass.max() > 1.0
    v = networks.random_positions(coarse, 0, 0.3)
    found = Objective(coarse).state(v, softness)
    assert found.terms == pytest.approx(terms.terms(coarse, v), rel=1e-12, abs=1e-15)
    assert found.value == pytest.approx(terms.objective(coarse, v, softness), rel=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_the_models_matrix_has_no_negative_direction(seed: int) -> None:
    """Far from a minimum the Hessian has negative eigenvalues; a step along one could raise F."""
    problem = networks.core(networks.graph(noise=0.01))
    # Without handles and straight lines, whose weights would hide the negative eigenvalues.
    problem = replace(problem, weights=replace(problem.weights, straight=0.0, handle=0.0))
    matrix, differences = networks.hessian(Objective(problem), networks.random_positions(problem, seed, 0.8))
    least = np.linalg.eigvalsh(differences + differences.T).min()
    assert least < -1e-2 * np.abs(matrix).max()
    assert np.linalg.eigvalsh(matrix).min() > -1e-10 * np.abs(matrix).max()


def test_sizes_are_kept_in_the_core_round_alone() -> None:
    of = networks.graph(scale=4.0, noise=0.01)
    core = networks.core(of)
    first = minimise.newton(core, Limits())
    final = networks.final(core, core.to_user(first.positions), of, networks.ties(of))
    second = minimise.newton(final, Limits(), first)
    assert first.keep > 0.0
    assert second.keep == 0.0


def test_a_state_with_folds_is_not_the_best_for_its_energy() -> None:
    """An edge that is turned back may have little energy: that is why F is not E_ALUP."""
    line = stages(drawing("M0,0 H100", handles=[pin(0, 0), drag((100, 0), (96, 0))]), 2.0, False).problem
    models: Any = Leaper(line, int(line.handles[1]), np.zeros(2))
    folded = replace(models.objective.state(line.start, 0.0), sharp=1.0, value=3.0)
    folded = replace(folded, q=np.where(np.arange(len(folded.q)) == 3, -folded.q, folded.q))
    plain = replace(models.objective.state(line.start + 1e-9, 0.0), sharp=2.0, value=2.0)
    assert (folded.folds, plain.folds) == (1, 0)
    models.objective.state = lambda v, _softness: plain if v is plain.v else folded
    models.moved = lambda *_: plain.v
    models.model = lambda *_: None
    models.runs = SimpleNamespace(retract=lambda v: v)
    models.problem = line
    levels = minimise._Levels(Limits(), ())
    levels.steps.append(0)
    best, _ = levels._descent(models, line.start, (descent.RELEASED,), 0)
    assert best is plain


def test_the_models_matrix_is_the_hessian_at_zero_residuals() -> None:
    """There the Gauss-Newton parts are exact.  Compared with differences of the gradient."""
    problem = networks.core(networks.graph(noise=0.01), size=0.3)
    problem = replace(problem, targets=problem.start[problem.handles])
    objective = Objective(problem)
    matrix, differences = networks.hessian(objective, problem.start)
    assert matrix == pytest.approx(differences, abs=1e-8 * np.abs(matrix).max())


@pytest.mark.parametrize("softness", [0.1, 0.003])
def test_newtons_gradient_by_finite_differences(softness: float) -> None:
    problem = networks.core(networks.graph(noise=0.01))
    v = networks.random_positions(problem, 0, 0.1)
    gradient = newton_model(problem, v, softness).gradient
    scale = np.abs(gradient).max()
    for vertex in range(len(v)):
        for d in (0, 1):
            h = 1e-6
            forth, back = v.copy(), v.copy()
            forth[vertex, d] += h
            back[vertex, d] -= h
            slope = terms.objective(problem, forth, softness) - terms.objective(problem, back, softness)
            assert 2 * gradient[vertex, d] == pytest.approx(slope / (2 * h), abs=1e-6 * scale)


def test_newton_ends_where_no_small_move_lowers_the_objective() -> None:
    problem = blob()
    found = minimise.newton(problem, Limits(iterations=300))
    assert found.status is Status.MINIMUM
    least = terms.objective(problem, found.positions)
    assert least < terms.objective(problem, paper(problem, Limits()).positions)
    random = np.random.default_rng(0)
    for _ in range(30):
        # Smooth moves, because noise on single samples raises the stiff terms in any case.
        phase, wave = random.uniform(0, 6, 2), random.uniform(0.0, 0.1, (2, 2))
        move = 1e-3 * np.sin(problem.start @ wave + phase)
        move[problem.handles] = 0.0
        assert terms.objective(problem, found.positions + move) > least * (1 - 1e-4)


@pytest.mark.parametrize("softness", [0.1, 0.003])
def test_the_rounded_weight_and_its_derivatives(softness: float) -> None:
    l = np.linspace(0.2, 3.0, 57)
    weight, first, second = terms.stretch_weight_derivatives(l, softness)
    assert (weight >= np.maximum(1.0, l**2)).all()
    assert (weight <= np.maximum(1.0, l**2) + softness).all()
    h = 1e-5
    forth, back = (terms.stretch_weight_derivatives(l + e, softness) for e in (h, -h))
    assert first == pytest.approx((forth[0] - back[0]) / (2 * h), abs=1e-5)
    assert second == pytest.approx((forth[1] - back[1]) / (2 * h), rel=1e-3, abs=1e-3)


def folds(problem: Problem, v: np.ndarray) -> int:
    """Edges that point against the input's direction, found without the solver's own arrays."""
    vector = v[problem.edges[:, 1]] - v[problem.edges[:, 0]]
    direction = np.stack([problem.normals[:, 1], -problem.normals[:, 0]], axis=1)
    return int(((vector * direction).sum(axis=1) < 0.0).sum())


class Leaper:
    """A model whose undamped step moves a handle past the next sample, to its target."""

    seconds = 0.0

    def __init__(self, problem: Problem, sample: int, leap: np.ndarray):
        self.objective = Objective(problem)
        self.gradient = np.zeros_like(problem.start)
        self._leap = np.zeros_like(problem.start)
        self._leap[sample] = leap

    def step(self, damping: float) -> np.ndarray:
        return self._leap * (1.0 if damping < 1.0 else 0.25)

    def moved(self, v: np.ndarray, step: np.ndarray, _retract: bool) -> np.ndarray:
        return v + step


def test_a_step_that_folds_an_edge_back_is_refused() -> None:
    line = stages(drawing("M0,0 H100", handles=[pin(0, 0), drag((100, 0), (96, 0))]), 2.0, False).problem
    last = int(line.handles[1])
    models: Any = Leaper(line, last, np.array([-2.0, 0.0]))  # in edges
    start = models.objective.state(line.start, 0.0)
    leapt = models.objective.state(line.start + models.step(0.0), 0.0)
    assert (start.folds, leapt.folds) == (0, 1) == (folds(line, start.v), folds(line, leapt.v))
    assert leapt.value < start.value
    after, _, damping = descent.damped_step(models, start, descent.FINE[-1], 1e-3)
    assert after.folds == 0
    assert after.value < start.value
    assert damping > 1e-3
    # A step back from a folded state is accepted.
    models._leap *= -1.0
    assert descent.damped_step(models, leapt, descent.RELEASED, 1e8)[0].folds <= 1


@pytest.mark.parametrize("count", [1, 2])
def test_parts_whose_handles_move_alike_go_along_without_a_step(count: int) -> None:
    """Two parts without ties move independently."""
    square = "M 0,0 H 40 V 40 H 0 Z"
    move = ((7.0, -3.0), (7.0, -3.0), (-2.0, 11.0), (-2.0, 11.0))
    places = ((0.0, 0.0), (40.0, 40.0), (100.0, 0.0), (140.0, 40.0))[: 2 * count]
    shapes = [square, "M 100,0 H 140 V 40 H 100 Z"][:count]
    handles = [drag(place, (place[0] + m[0], place[1] + m[1])) for place, m in zip(places, move)]
    problem = stages(drawing(*shapes, handles=handles), tied=False).problem
    found = minimise.newton(problem)
    assert (found.status, found.iterations) == (Status.MINIMUM, 0)
    assert found.history[-1]["objective"] < 1e-18
    assert found.positions[problem.handles] == pytest.approx(problem.targets, abs=1e-12)
