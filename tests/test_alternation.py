# SPDX-License-Identifier: GPL-2.0-or-later
"""Both steps of the alternation against finite differences and a slow dense solution."""

from __future__ import annotations

import networks
import numpy as np
import pytest
import slow
from builders import BLOB, drag, drawing, pin, stages

from alup.energy.problem import Problem
from alup.messages.errors import SolveError
from alup.solver.alternation import Alternation
from alup.sparse import least_squares
from alup.sparse.least_squares import BlockAssembly, Factor


def rounds(seed: int) -> list[tuple[Problem, slow.Round]]:
    """A core and a final round, each with its slow twin."""
    of = networks.graph(scale=4.0, noise=0.01, seed=seed)
    first, second, result = networks.both_rounds(of)
    kept = [tuple(turn) for turn in second.straight.tolist()]
    return [
        (first, networks.slow_round(of, of.points, [(1, 0, 2)])),
        (second, networks.slow_round(of, result, kept)),
    ]


def some_lengths(problem: Problem, seed: int) -> np.ndarray:
    """Lengths on both sides of 1, where max(1, l^2) changes."""
    return problem.lengths * np.random.default_rng(seed).uniform(0.4, 2.5, len(problem.lengths))


def blob() -> Problem:
    return stages(
        drawing(BLOB, "M50,60 C60,80 80,80 90,60", handles=[pin(10, 80), drag((150, 75), (170, 77))])
    ).problem


@pytest.mark.parametrize("seed", range(4))
def test_the_quadratic_is_the_sum_of_the_papers_residuals(seed: int) -> None:
    for problem, twin in rounds(seed):
        l, v = some_lengths(problem, seed), networks.random_positions(problem, seed)
        matrix, right = slow.position_rows(twin, l)
        wanted = float(np.sum((matrix @ v.ravel() - right) ** 2))
        assert networks.quadratic(problem, v, l) == pytest.approx(wanted, rel=1e-10)


def test_gradient_by_finite_differences() -> None:
    problem = blob()
    steps = Alternation(problem)
    l, v = some_lengths(problem, 1), networks.random_positions(problem, 1)
    gradient = steps.gradient(v, l)
    random = np.random.default_rng(2)
    scale = np.abs(gradient).max()
    chosen = [*problem.handles.tolist(), *random.integers(0, len(v), 40).tolist()]
    for vertex in chosen:
        for d in (0, 1):
            h = 0.1  # of a quadratic, the central difference is exact for any step
            forth, back = v.copy(), v.copy()
            forth[vertex, d] += h
            back[vertex, d] -= h
            slope = (networks.quadratic(problem, forth, l) - networks.quadratic(problem, back, l)) / (2 * h)
            assert 2.0 * gradient[vertex, d] == pytest.approx(slope, abs=1e-8 * scale)


@pytest.mark.parametrize("seed", range(4))
def test_gradient_is_that_of_the_papers_residuals(seed: int) -> None:
    for problem, twin in rounds(seed):
        l, v = some_lengths(problem, seed), networks.random_positions(problem, seed)
        matrix, right = slow.position_rows(twin, l)
        wanted = (matrix.T @ (matrix @ v.ravel() - right)).reshape(-1, 2)
        found = Alternation(problem).gradient(v, l)
        assert found == pytest.approx(wanted, abs=1e-9 * np.abs(wanted).max())


@pytest.mark.parametrize("seed", range(4))
def test_positions_against_dense_least_squares(seed: int) -> None:
    for problem, twin in rounds(seed):
        steps = Alternation(problem)
        start = problem.start
        for l in (problem.lengths, some_lengths(problem, seed), some_lengths(problem, seed + 9)):
            start = steps.positions(start, l)
            assert start == pytest.approx(slow.positions(twin, l), abs=1e-8)


def test_positions_do_not_depend_on_where_they_start() -> None:
    problem = blob()
    l = some_lengths(problem, 3)
    near = Alternation(problem).positions(problem.start, l)
    far = Alternation(problem).positions(networks.random_positions(problem, 3, 50.0), l)
    assert np.abs(near - far).max() < 1e-8
    # ... and nothing is left to gain.
    least = networks.quadratic(problem, near, l)
    random = np.random.default_rng(0)
    for _ in range(10):
        assert networks.quadratic(problem, near + 1e-3 * random.standard_normal(near.shape), l) > least


@pytest.mark.parametrize("seed", range(4))
def test_lengths_against_dense_least_squares(seed: int) -> None:
    for problem, twin in rounds(seed):
        v = networks.random_positions(problem, seed)
        assert Alternation(problem).lengths(v) == pytest.approx(slow.lengths(twin, v), abs=1e-10)


def test_at_the_start_the_lengths_are_the_starts() -> None:
    problem = blob()
    assert Alternation(problem).lengths(problem.start) == pytest.approx(problem.lengths, abs=1e-12)


@pytest.mark.parametrize("seed", range(2))
def test_a_few_alternations_follow_the_slow_program(seed: int) -> None:
    for problem, twin in rounds(seed):
        steps = Alternation(problem)
        v, l = problem.start, problem.lengths
        slow_l = l
        for _ in range(5):
            v = steps.positions(v, l)
            l = steps.lengths(v)
            slow_v = slow.positions(twin, slow_l)
            slow_l = slow.lengths(twin, slow_v)
            assert np.abs(v - slow_v).max() < 1e-7
            assert np.abs(l - slow_l).max() < 1e-7


# --- the sparse machinery -----------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(2))
def test_the_assembled_matrix_is_the_normal_matrix(seed: int) -> None:
    for problem, twin in rounds(seed):
        l = some_lengths(problem, seed)
        rows, _ = slow.position_rows(twin, l)
        wanted = rows.T @ rows
        steps = Alternation(problem)
        upper = steps._assembly.matrix(steps._weights(l)).toarray()
        assert np.abs(np.tril(upper, -1)).max() == 0.0
        found = upper + np.triu(upper, 1).T
        assert found == pytest.approx(wanted, abs=1e-10 * np.abs(wanted).max())


def test_the_pattern_never_changes() -> None:
    problem = blob()
    steps = Alternation(problem)
    first = steps._assembly.matrix(steps._weights(problem.lengths))
    # The weights 1 make entries cancel; others do not; all of zero leave nothing but the pattern.
    count = len(steps._weights(problem.lengths))
    for weights in (steps._weights(some_lengths(problem, 1)), np.ones(count), np.zeros(count)):
        other = steps._assembly.matrix(weights)
        assert (other.indices == first.indices).all()
        assert (other.indptr == first.indptr).all()
    assert first.has_sorted_indices


def springs(edges: np.ndarray, count: int) -> BlockAssembly:
    """Of  sum_e w_e (x_j - x_i)^T [[2, 0.5], [0.5, 1]] (x_j - x_i)."""
    blocks = BlockAssembly(count, len(edges))
    blocks.add_edges(edges, (np.arange(len(edges)),), (np.array([[2.0, 0.5], [0.5, 1.0]]),))
    return blocks.finish()


def test_blocks_of_edges_are_the_quadratic_form() -> None:
    random = np.random.default_rng(0)
    edges = np.array([[0, 1], [2, 1], [0, 3], [3, 2]])
    weights = random.uniform(1, 2, 4)
    upper = springs(edges, 4).matrix(weights).toarray()
    full = upper + np.triu(upper, 1).T
    x = random.standard_normal((4, 2))
    block = np.array([[2.0, 0.5], [0.5, 1.0]])
    wanted = sum(w * (x[j] - x[i]) @ block @ (x[j] - x[i]) for (i, j), w in zip(edges, weights))
    assert x.ravel() @ full @ x.ravel() == pytest.approx(wanted)
    assert np.tril(upper, -1).any() == np.False_


def test_the_diagonal_is_always_in_the_pattern() -> None:
    # The factorisation needs it there, whatever the contributions.
    entries = springs(np.array([[0, 2]]), 3).matrix(np.ones(1)).tocoo()
    assert {(n, n) for n in range(6)} <= set(zip(entries.row.tolist(), entries.col.tolist()))


def both_ways() -> list[bool]:
    return [True, False] if least_squares.HAVE_QDLDL else [False]


@pytest.mark.skipif(not least_squares.HAVE_QDLDL, reason="qdldl is not installed here; scipy serves alone")
def test_qdldl_and_superlu_agree() -> None:
    problem = blob()
    steps = Alternation(problem)
    random = np.random.default_rng(0)
    factors = {}
    for which in (True, False):
        factors[which] = Factor(steps._assembly.matrix(steps._weights(problem.lengths)), use_qdldl=which)
    for seed in range(3):
        upper = steps._assembly.matrix(steps._weights(some_lengths(problem, seed)))
        # As in a run: what is solved for lies in the range of the matrix's action on small moves.
        x = random.standard_normal(upper.shape[0])
        right = upper @ x + np.asarray(upper.T @ x) - upper.diagonal() * x
        found = {}
        for which, factor in factors.items():
            factor.update(upper)
            first = factor.solve(right)
            residual = right - (upper @ first + upper.T @ first - upper.diagonal() * first)
            found[which] = first + factor.solve(residual)
        assert np.abs(found[True] - found[False]).max() < 1e-8
        assert np.abs(found[True] - x).max() < 1e-8


@pytest.mark.parametrize("use_qdldl", both_ways())
def test_the_whole_step_is_the_same_by_either_solver(
    use_qdldl: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    of = networks.graph(noise=0.01)
    problem = networks.core(of)
    twin = networks.slow_round(of, of.points, [(1, 0, 2)])
    monkeypatch.setattr(Factor.__init__, "__defaults__", (use_qdldl, None))
    steps = Alternation(problem)
    assert steps._for_lengths(problem.lengths)._use_qdldl is use_qdldl
    for seed in (1, 2):
        l = some_lengths(problem, seed)
        assert steps.positions(problem.start, l) == pytest.approx(slow.positions(twin, l), abs=1e-8)
    v = networks.random_positions(problem, 1)
    assert steps.lengths(v) == pytest.approx(slow.lengths(twin, v), abs=1e-10)


@pytest.mark.parametrize("use_qdldl", both_ways())
def test_singular_and_unfinite_matrices_are_errors(use_qdldl: bool) -> None:
    spring = springs(np.array([[0, 1]]), 2)
    with pytest.raises(SolveError, match="singular"):
        Factor(spring.matrix(np.ones(1)), use_qdldl)
    with pytest.raises(SolveError, match="not finite"):
        Factor(spring.matrix(np.array([np.nan])), use_qdldl)
    regular = BlockAssembly(1, 2)
    for number, unit in enumerate(np.eye(2)):
        regular.add(np.zeros(1, int), np.zeros(1, int), (np.array([number]),), (0.5 * np.diag(unit),))
    regular.finish()
    factor = Factor(regular.matrix(np.array([2.0, 4.0])), use_qdldl)
    assert factor.solve(np.array([2.0, 2.0])) == pytest.approx([1.0, 0.5])
    factor.update(regular.matrix(np.array([1.0, 1.0])))
    assert factor.solve(np.array([2.0, 2.0])) == pytest.approx([2.0, 2.0])
