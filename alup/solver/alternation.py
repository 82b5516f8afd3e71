# SPDX-License-Identifier: GPL-2.0-or-later
"""The paper's alternation: positions for fixed lengths, lengths for fixed positions.

*Positions*, l fixed, minimise the quadratic E'_vertex

      sum_<ij> max(1,l_ij^2) (n_ij . (v_j-v_i)/l_ij)^2                          E'_normal
    + sum_<ij> max(1,l_ij^2) |(v_j-v_i)/l_ij - d0_ij|^2                         E'_edge
    + w_s sum_S |(v_j-v_i)/l_ij - (v_i-v_k)/l_ik - bend|^2                      E'_straight
    + w_c sum_h |v_h-p_h|^2                                                     handles
    + E_ties                                                                    E'_comp and more

*Lengths*, v fixed, minimise the quadratic

      sum_<ij> (l_ij - |v_i-v_j|)^2                                             E'_edge, linearised
    + sum_(i;j,k) w_t (l_ij - r_ijk l_ik)^2                                     E'_tangents
    + E_size

Both are solved by their normal equations.  The matrix of positions changes its values in each iteration,
never its pattern: it is analysed once a round, and factorised in each iteration.  The matrix of lengths is
constant in a round and factorised once.

The matrix of positions has a condition number of 1e9 to 1e10.  Therefore positions are solved for as
*increments* from the last ones: the error of the solution is then relative to the step, and vanishes with it.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix

from ..energy.problem import Problem, scatter, tie_differences
from ..geometry.arrays import Array
from ..geometry.edges import edge_vectors
from ..sparse import dissection
from ..sparse.least_squares import BlockAssembly, Factor, upper_half
from .outcome import Limits

# Added to the diagonal of the positions' matrix where E_edge has no weight.  Nothing then holds the length of
# a line along itself, and the equations would be singular.  The gradient does not have it, so that minimisers
# stay what they are, and samples that nothing holds stay where they were.
LOOSE = 1e-6


class Alternation:
    """Both quadratic steps of one round; nothing is factorised before the first one."""

    def __init__(self, problem: Problem):
        self.problem = problem
        self._scatter = _scatter(problem)
        self._assembly = _position_assembly(problem)
        pattern = self._assembly.matrix(self._weights(problem.lengths))
        self._plan = dissection.plan(problem.start, problem.edges, pattern.indptr, pattern.indices)
        self._of_positions: Factor | None = None
        self._factorised_at: Array | None = None

    @property
    def seconds(self) -> float:
        """What the next factorisation for positions takes: as long as the last one, or about the plan's."""
        return self._plan.seconds if self._of_positions is None else self._of_positions.seconds

    @cached_property
    def _of_lengths(self) -> Factor:
        return Factor(_length_matrix(self.problem))

    def _for_lengths(self, l: Array) -> Factor:
        """The equations of positions for fixed lengths (E,)."""
        if self._of_positions is None or l is not self._factorised_at:
            matrix = self._assembly.matrix(self._weights(l))
            if self._of_positions is None:
                self._of_positions = Factor(matrix, order=self._plan.order)
            else:
                self._of_positions.update(matrix)
            self._factorised_at = l
        return self._of_positions

    def positions(self, v: Array, l: Array) -> Array:
        """The minimiser for fixed lengths l (E,), (N, 2), by increments from v (N, 2)."""
        factor = self._for_lengths(l)
        # The second increment, by the same factors, removes the error that the condition number left in the
        # first: without it components that only the weak scaffold joins stop 1e-6 short.
        for _ in range(2):
            v = v + factor.solve(-self.gradient(v, l).ravel()).reshape(-1, 2)
        return v

    def lengths(self, v: Array) -> Array:
        """Eq. 21: the lengths that minimise E_l for fixed positions v (N, 2), (E,)."""
        now = np.linalg.norm(edge_vectors(v, self.problem.edges), axis=1)
        p = self.problem
        return self._of_lengths.solve((now + p.size * p.rest) / p.mass)

    def gradient(self, v: Array, l: Array) -> Array:
        """Eq. 19: half the gradient of E'_vertex by v, (N, 2), summed residual by residual."""
        p = self.problem
        vector = edge_vectors(v, p.edges)
        pull = (normal_pull(p, vector) + edge_pull(p, vector, l)) * _edge_weight(p, l)[:, None]
        handles = p.weights.handle * (v[p.handles] - p.targets)
        parts = [pull, *straight_pulls(p, v, l), tie_pull(p, v), handles]
        return np.asarray(self._scatter @ np.concatenate(parts))

    def _weights(self, l: Array) -> Array:
        p = self.problem
        alpha, beta = 1.0 / l[p.straight_ij], 1.0 / l[p.straight_ik]
        factor = 2.0 * p.weights.straight
        return np.concatenate(
            [_edge_weight(p, l), factor * alpha**2, factor * beta**2, factor * alpha * beta, np.ones(1)]
        )


def normal_pull(p: Problem, vector: Array) -> Array:
    """Eq. 14: half the derivative of E'_normal by each edge's vector (E, 2), without `_edge_weight`."""
    across = np.einsum("ed,ed->e", p.normals, vector)
    return np.asarray(p.weights.normal * across[:, None] * p.normals)


def edge_pull(p: Problem, vector: Array, l: Array) -> Array:
    """Eq. 17: half the derivative of E'_edge by each edge's vector (E, 2), without `_edge_weight`."""
    return np.asarray(p.weights.edge * (vector - l[:, None] * p.directions))


def straight_pulls(p: Problem, v: Array, l: Array) -> tuple[Array, Array]:
    """Eq. 16: half the derivatives of w_s E'_straight by v_j - v_i and by v_k - v_i, (K, 2) each."""
    i, j, k = p.straight.T
    a = (v[j] - v[i]) / l[p.straight_ij][:, None]
    b = (v[i] - v[k]) / l[p.straight_ik][:, None]
    residual = 2.0 * p.weights.straight * (a - b - p.bend)
    alpha, beta = 1.0 / l[p.straight_ij], 1.0 / l[p.straight_ik]
    return alpha[:, None] * residual, beta[:, None] * residual


def tie_pull(p: Problem, v: Array) -> Array:
    """Half the derivative of E_ties by each tie's offset, (T, 2)."""
    missed = tie_differences(p, v)
    tied = p.tie_weight * p.tie_axis * (missed.real + 1j * p.tie_slide * missed.imag)
    return np.stack([tied.real, tied.imag], axis=1)


def _edge_weight(p: Problem, l: Array) -> Array:
    """omega_n / l^2, (E,): m max(1, (l/m)^2) / l^2 with the edge's mass m, or m / l^2 where omega_n is 1."""
    bare = p.mass / l**2
    return np.maximum(1.0 / p.mass, bare) if p.weights.stretch else bare


def _scatter(p: Problem) -> csr_matrix:
    """Sums pulls on differences of samples into the samples, (N, E + 2 K + T + H).

    In this order: v_j - v_i of the edges, v_j - v_i and v_k - v_i of the straight turns, the ties, and the
    handles' own positions.
    """
    i, j, k = p.straight.T
    pairs = [p.edges, np.stack([i, j], axis=1), np.stack([i, k], axis=1)]
    return scatter(len(p.start), np.concatenate(pairs), p)


def _position_assembly(p: Problem) -> BlockAssembly:
    """The normal matrix of E'_vertex, (2N, 2N), unknowns x_i at 2i, y_i at 2i + 1."""
    edge_count, straight_count = len(p.edges), len(p.straight)
    constant = edge_count + 3 * straight_count
    blocks = BlockAssembly(len(p.start), constant + 1)

    # Edges: w_normal n n^T + w_edge I, entry by entry.
    n, identity, of_edge = p.normals, np.eye(2), (np.arange(edge_count),)
    tail, head = p.edges.T
    for r, c in ((0, 0), (0, 1), (1, 1)):
        entry = p.weights.normal * (n[:, r] * n[:, c]) + p.weights.edge * identity[r, c]
        unit = _unit_block(r, c)
        for end in (tail, head):
            blocks.add(end, end, of_edge, (upper_half(unit),), entry)
        blocks.add(tail, head, of_edge, (-unit,), entry)

    # Straight turns: alpha x_j - (alpha + beta) x_i + beta x_k, expanded in alpha^2, beta^2, alpha beta.
    i, j, k = p.straight.T
    squares = [edge_count + m * straight_count + np.arange(straight_count) for m in range(3)]
    products = [
        (j, j, (1, 0, 0)), (k, k, (0, 1, 0)), (i, i, (1, 1, 2)),
        (j, k, (0, 0, 1)), (i, j, (-1, 0, -1)), (i, k, (0, -1, -1)),
    ]  # fmt: skip
    for a, b, multiples in products:
        part = upper_half if a is b else np.asarray
        blocks.add(a, b, squares, [part(value * identity) for value in multiples])

    square = p.tie_axis**2
    even, odd = 0.5 * p.tie_weight * (1.0 + p.tie_slide), 0.5 * p.tie_weight * (1.0 - p.tie_slide)
    entries = ((0, 0, even + odd * square.real), (1, 1, even - odd * square.real), (0, 1, odd * square.imag))
    for a in range(4):
        for b in range(4):
            first, second = p.tie_samples[:, a], p.tie_samples[:, b]
            times = p.tie_factor[:, a] * p.tie_factor[:, b]
            # Of a block on the diagonal half is to be given, of the others those above it.
            for chosen, part in ((first == second, upper_half), (first < second, np.asarray)):
                used = np.flatnonzero((times != 0.0) & chosen)
                number = np.full(len(used), constant)
                for r, c, value in entries:
                    matrix, factor = part(_unit_block(r, c)), (times * value)[used]
                    blocks.add(first[used], second[used], (number,), (matrix,), factor)
    held = (np.full(len(p.handles), constant),)
    blocks.add(p.handles, p.handles, held, (upper_half(p.weights.handle * identity),))
    if p.weights.edge == 0.0:
        every = np.arange(len(p.start))
        blocks.add(every, every, (np.full(len(every), constant),), (upper_half(LOOSE * identity),))
    return blocks.finish()


def _unit_block(r: int, c: int) -> Array:
    """The symmetric 2x2 matrix of ones at (r, c) and (c, r)."""
    block = np.zeros((2, 2))
    block[r, c] = block[c, r] = 1.0
    return block


def length_entries(p: Problem) -> tuple[Array, Array, Array]:
    """Eq. 20: rows, columns and values of the linearised E'_edge, and of E_size, in the matrix of lengths."""
    number = np.arange(len(p.edges))
    return number, number, (1.0 + p.size) / p.mass


def tangent_entries(p: Problem) -> tuple[Array, Array, Array]:
    """Eq. 15: rows, columns and values of E'_tangents, undivided, in the matrix of lengths."""
    a, b, r = p.turn_ij, p.turn_ik, p.ratio
    w = p.weights.tangent * p.turn_weight
    rows, columns = [a, b, np.minimum(a, b)], [a, b, np.maximum(a, b)]
    return np.concatenate(rows), np.concatenate(columns), np.concatenate([w, w * r**2, -w * r])


def _length_matrix(p: Problem) -> csc_matrix:
    """The normal matrix of the lengths step, (E, E), upper triangle."""
    count = len(p.edges)
    row, col, value = (np.concatenate(part) for part in zip(length_entries(p), tangent_entries(p)))
    unique, place = np.unique(col * count + row, return_inverse=True)
    starts = np.searchsorted(unique, count * np.arange(count + 1))
    return csc_matrix(
        (np.bincount(place.ravel(), value), unique % max(count, 1), starts), shape=(count, count)
    )


def affordable(steps: Alternation, limits: Limits) -> bool:
    """Whether there is time for the first alternation.  One that takes no time is always affordable."""
    return steps.seconds == 0.0 or limits.leave(steps.seconds)
