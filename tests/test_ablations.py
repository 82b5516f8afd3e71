# SPDX-License-Identifier: GPL-2.0-or-later
"""The paper's ablations (Sec. 4): each changes its own term, the same in every place that computes it."""

from __future__ import annotations

from dataclasses import replace

import networks
import numpy as np
import pytest
from builders import BLOB, Stages, drag, drawing, pin, reshaped, stages

from alup.energy import terms as energy
from alup.energy.objective import Objective
from alup.energy.problem import Problem, Weights
from alup.model import Ties
from alup.session import metrics
from alup.solver import minimise, outcome
from alup.solver.alternation import Alternation
from alup.solver.coarse_levels import coarsen
from alup.solver.straight_runs import StraightRuns

USUAL = Weights()
ABLATIONS = {
    "normal 100:1": Weights(normal=100.0),
    "normal 1:100": Weights(tangent=100.0),
    "w_n = 1": Weights(stretch=False),
    "w_t = 0.5": Weights(uniform_turns=0.5),
    "no E_edge": Weights(edge=0.0),
    "no straightness": Weights(straight=0.0),
}
EACH = pytest.mark.parametrize("weights", ABLATIONS.values(), ids=ABLATIONS.keys())
SOLVERS = pytest.mark.parametrize("solver", list(minimise.SOLVERS))

# A box with a rounded side, its right end pulled out and up.
BOX = "M0,0 H200 C230,0 230,40 200,40 H0 Z"
HANDLES = [pin(0, 0), pin(0, 40), drag((200, 0), (260, -10)), drag((200, 40), (260, 30))]


def small(weights: Weights) -> Problem:
    return networks.core(networks.graph(noise=0.01), weights)


def box(weights: Weights = USUAL, spacing: float = 2.0) -> Stages:
    return stages(drawing(BOX, handles=HANDLES), spacing, False, weights)


def level_of(weights: Weights) -> Problem:
    level = coarsen(box(weights, 1.0).problem)
    assert level is not None
    return level.problem


# --- every ablation, in every place -------------------------------------------------------------


@EACH
@pytest.mark.parametrize("softness", [0.0, 0.1])
def test_the_fused_objective_is_the_sum_of_the_terms(weights: Weights, softness: float) -> None:
    problem = small(weights)
    v = networks.random_positions(problem, 0, 0.3)
    found = Objective(problem).state(v, softness)
    assert found.terms == pytest.approx(energy.terms(problem, v), rel=1e-12, abs=1e-15)
    assert found.value == pytest.approx(energy.objective(problem, v, softness), rel=1e-12)
    assert found.sharp == pytest.approx(energy.objective(problem, v), rel=1e-12)


@EACH
@pytest.mark.parametrize("coarse", [False, True], ids=["fine", "coarse"])
def test_the_gradient_by_finite_differences(weights: Weights, coarse: bool) -> None:
    problem = level_of(weights) if coarse else small(weights)
    assert (problem.mass > 1.0).any() == coarse
    v = networks.random_positions(problem, 0, 0.1)
    objective = Objective(problem)
    half, _ = objective.derivatives(objective.state(v, 0.1), 0.1)
    steps = 1e-6 * np.eye(v.size).reshape(-1, *v.shape)
    slope = [(objective.state(v + h, 0.1).value - objective.state(v - h, 0.1).value) / 2e-6 for h in steps]
    assert 2.0 * half.ravel() == pytest.approx(np.array(slope), abs=1e-6 * np.abs(half).max())


@EACH
def test_the_hessian_where_nothing_is_left_over(weights: Weights) -> None:
    """At residuals of zero the Gauss-Newton parts are exact."""
    problem = small(weights)
    problem = replace(problem, targets=problem.start[problem.handles])
    objective = Objective(problem)
    matrix, differences = networks.hessian(objective, problem.start)
    assert matrix == pytest.approx(differences, abs=1e-8 * np.abs(matrix).max())


@EACH
def test_both_steps_of_the_alternation_leave_nothing_to_gain(weights: Weights) -> None:
    problem = small(weights)
    steps = Alternation(problem)
    random = np.random.default_rng(0)
    l = problem.lengths * random.uniform(0.4, 2.5, len(problem.lengths))
    v = problem.start
    for _ in range(4):
        v = steps.positions(v, l)
    force = np.abs(steps.gradient(networks.random_positions(problem, 1), l)).max()
    assert np.abs(steps.gradient(v, l)).max() < 1e-9 * force
    # Eq. 21, from its two sums.
    found, now = steps.lengths(v), np.linalg.norm(v[problem.edges[:, 1]] - v[problem.edges[:, 0]], axis=1)

    def lengths_energy(x: np.ndarray) -> float:
        uneven = x[problem.turn_ij] - problem.ratio * x[problem.turn_ik]
        gradual = problem.weights.tangent * np.sum(problem.turn_weight * uneven**2)
        return float(np.sum((x - now) ** 2) + gradual)

    for _ in range(10):
        assert lengths_energy(found + 1e-3 * random.standard_normal(len(found))) > lengths_energy(found)


@EACH
def test_the_positions_step_is_the_energy_at_these_lengths(weights: Weights) -> None:
    """At l = |v_j - v_i| the quadratic of the alternation is F but for E_tangent."""
    problem = small(weights)
    v = networks.random_positions(problem, 4)
    l = np.linalg.norm(v[problem.edges[:, 1]] - v[problem.edges[:, 0]], axis=1)
    wanted = energy.objective(problem, v) - energy.tangent(problem, v)
    assert networks.quadratic(problem, v, l) == pytest.approx(wanted, rel=1e-10)


@EACH
@SOLVERS
def test_both_solvers_solve_it(weights: Weights, solver: str) -> None:
    before = drawing(BOX, "M40,10 C60,10 60,30 40,30 Z", handles=HANDLES)
    found = reshaped(before, solver=solver, weights=weights, spacing=0.01)
    assert np.isfinite(found.refitted.control).all()
    assert found.report["handle_error_of_diagonal"] < 1e-4
    core = found.report["rounds"][0]["energy"]["alup"]
    assert min(core) < 0.01 * core[0]


@EACH
def test_newton_ends_in_a_minimum_below_the_usual_result(weights: Weights) -> None:
    """What an ablation minimises is lower at its own result than at that of the full energy."""
    mine, usual = box(weights).problem, box().problem
    limits = outcome.Limits(iterations=400)
    # Without a preference for sizes, that is F's own minimum.
    mine, usual = (replace(one, weights=replace(one.weights, keep_size=0.0)) for one in (mine, usual))
    found = minimise.newton(mine, limits)
    assert found.status is outcome.Status.MINIMUM
    other = minimise.newton(usual, limits).positions
    assert energy.objective(mine, found.positions) <= energy.objective(mine, other) * (1.0 + 1e-4)


# --- what each one does -------------------------------------------------------------------------


def test_emphasis_on_one_term_lowers_it_at_the_cost_of_the_other() -> None:
    handles = [pin(10, 80), pin(60, 20), drag((150, 75), (175, 60))]
    turning, gradient = {}, {}
    for name in ("usual", "normal 100:1", "normal 1:100"):
        made = stages(drawing(BLOB, handles=handles), 1.0, False, ABLATIONS.get(name, USUAL))
        after = made.problem.to_user(minimise.newton(made.problem).positions)
        turning[name] = metrics.turning(made.samples.points, after, made.samples.edges)["mean"]
        gradient[name] = metrics.scale_gradient(made.samples, after, made.drawing.diagonal)["rms"]
    assert 4.0 * turning["normal 100:1"] < turning["usual"] < 0.5 * turning["normal 1:100"]
    assert gradient["normal 100:1"] > gradient["usual"] > 1.1 * gradient["normal 1:100"]


@pytest.mark.parametrize("stretch", [0.5, 1.0, 2.0])
def test_without_eq_6_turning_a_stretched_edge_costs_no_more(stretch: float) -> None:
    angle = np.radians(20.0)
    turn = stretch * np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    for problem in (small(Weights(stretch=False)), level_of(Weights(stretch=False))):
        terms = Objective(problem).state(problem.start @ turn, 0.1).terms
        off = float(problem.mass.sum())
        tilt = np.abs(np.arctan2(*np.einsum("eab,eb->ae", _frames(problem), problem.directions)))
        assert terms["edge"] == pytest.approx(off * (2.0 * np.sin(angle / 2.0)) ** 2)
        wanted = float(problem.mass @ np.sin(angle + tilt) ** 2)
        assert terms["normal"] == pytest.approx(wanted, rel=0.05)


def _frames(problem: Problem) -> np.ndarray:
    """Rows n and d of each edge's input normal and direction, (E, 2, 2)."""
    n = problem.normals
    return np.stack([n, np.stack([n[:, 1], -n[:, 0]], axis=1)], axis=1)


@pytest.mark.parametrize("final", [False, True])
def test_uniform_turns_are_all_turns(final: bool) -> None:
    of = networks.graph()
    usual, mine = networks.core(of), networks.core(of, Weights(uniform_turns=0.5))
    if final:
        usual, mine = (networks.final(one, of.points * 1.1, of, networks.ties(of)) for one in (usual, mine))
    assert (mine.turn_weight == 0.5).all()
    assert len(mine.turn_weight) == len(usual.turn_weight)
    assert usual.turn_weight.min() == USUAL.corner  # corners and junctions, which count fully now


def test_without_their_weight_lines_are_curves() -> None:
    made = box(Weights(straight=0.0))
    core = made.problem
    final = networks.final(core, made.samples.points, made.samples, Ties.none())
    for problem in (core, final, level_of(Weights(straight=0.0))):
        assert len(problem.straight) == len(problem.bend) == 0
        assert len(StraightRuns(problem).inner) == 0
    assert len(StraightRuns(box().problem).inner) > 50  # what the retraction moves otherwise


def test_nothing_straightens_lines_without_their_weight() -> None:
    bends = []
    for weights in (USUAL, Weights(straight=0.0)):
        made = box(weights)
        after = made.problem.to_user(minimise.newton(made.problem).positions)
        turns = made.samples.straight_turns
        bends.append(metrics.straightness(made.samples.points, after, turns)["line"])
    assert bends[0] < 0.03
    assert bends[1] > 0.3


def test_without_their_weight_squashed_lines_are_not_prolonged_into_folds() -> None:
    """A cubic overshoots where the scale changes from 1 to next to nothing; lines were linear before."""
    problem = box(Weights(straight=0.0), 1.0).problem
    level = coarsen(problem)
    assert level is not None
    v = level.problem.start.copy()
    v[:, 0] = np.maximum(v[:, 0], 0.0) + 1e-3 * np.minimum(v[:, 0], 0.0)
    cubic, prolonged, _scaled = level.prolongations(v)
    assert Objective(level.problem).state(v, 0.0).folds == 0
    assert Objective(problem).state(cubic, 0.0).folds > 0
    assert Objective(problem).state(prolonged, 0.0).folds == 0
    assert (prolonged[level.kept] == v).all()


def test_without_e_edge_what_nothing_holds_stays() -> None:
    """A stroke with one handle: its other end is held by E_edge only."""
    made = stages(drawing(BLOB, handles=[drag((10, 80), (12, 79))]), 5.0, False, Weights(edge=0.0))
    steps = Alternation(made.problem)
    v, l = made.problem.start, made.problem.lengths
    for _ in range(5):
        v = steps.positions(v, l)
        l = steps.lengths(v)
        assert np.isfinite(v).all()
    assert np.abs(v[made.problem.handles] - made.problem.targets).max() < 1e-3
    assert (
        np.abs(v - made.problem.start).max()
        < 2.0 * np.abs(made.problem.targets - made.problem.start[0]).max()
    )


@SOLVERS
def test_the_second_round_can_be_left_out(solver: str) -> None:
    before = drawing(BOX, handles=HANDLES)
    one, two = (reshaped(before, solver=solver, rounds=count) for count in (1, 2))
    names = [[each["round"] for each in result.report["rounds"]] for result in (one, two)]
    assert names == [["core"], ["core", "final"]]
    first, second = (result.report["rounds"][0] for result in (one, two))
    assert first["energy"] == second["energy"]
    assert np.abs(one.moved - two.moved).max() > 1e-6


def test_nothing_moved_is_nothing_done_in_one_round_too() -> None:
    before = drawing(BLOB, handles=[pin(10, 80)])
    found = reshaped(before, rounds=1)
    assert [one["status"] for one in found.report["rounds"]] == ["UNMOVED"]
    assert (found.refitted.control == before.control).all()
