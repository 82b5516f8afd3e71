"""The paper's alternation: positions for fixed lengths, lengths for fixed positions (Eq. 14-21).

*Positions*, l fixed, minimise the quadratic

      sum_<ij> max(1,l_ij^2) (n_ij . (v_j-v_i)/l_ij)^2                          E'_normal  (Eq. 14)
    + sum_<ij> max(1,l_ij^2) |(v_j-v_i)/l_ij - d0_ij|^2                         E'_edge    (Eq. 17)
    + w_s sum_S |(v_j-v_i)/l_ij - (v_i-v_k)/l_ik - bend|^2                      E'_straight (Eq. 16)
    + w_c sum_h |v_h-p_h|^2  +  w_comp sum_T |(v_j-v_i) - (v0_j-v0_i)|^2/l0^2   E'_comp    (Eq. 22)

*Lengths*, v fixed, minimise

      sum_<ij> (l_ij - |v_i-v_j|)^2 + sum_(i;j,k) w_t (l_ij - r_ijk l_ik)^2                (Eq. 21)

The matrix of positions changes its values only, that of lengths not at all, so the first is
analysed and the second factorised once a round.  Its condition number is 1e9 to 1e10, therefore
positions are solved for as *increments* from the last ones: the error of the solution is then
relative to the step, and vanishes with it.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.sparse import csc_matrix

from . import dissection
from .model import Array
from .problem import Problem, difference_scatter, edge_vectors, tie_differences
from .quadratic import Assembly, Factor, edge_blocks

# Without E_edge nothing holds the length of a line along itself, and the equations are singular.  This much
# of the diagonal lets what nothing holds stay where it was; a part of the matrix only, not of the gradient,
# it leaves the minimisers what they are.
LOOSE = 1e-6


class Alternation:
    """Both quadratic steps of one round; nothing is factorised before the first one."""

    def __init__(self, problem: Problem):
        self.problem = problem
        self._scatter = difference_scatter(problem)
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
        """The minimiser for fixed lengths, (N, 2), by increments from v (N, 2).  l : (E,)."""
        factor = self._for_lengths(l)
        # The second increment, by the same factors, takes away what the condition number cost the
        # first: without it components that only the weak scaffold joins stop 1e-6 short.
        for _ in range(2):
            v = v + factor.solve(-self.gradient(v, l).ravel()).reshape(-1, 2)
        return v

    def lengths(self, v: Array) -> Array:
        """The minimiser for fixed positions, (E,)."""
        now = np.linalg.norm(edge_vectors(v, self.problem.edges), axis=1)
        p = self.problem
        return self._of_lengths.solve((now + p.size * p.rest) / p.mass)

    def energy(self, v: Array, l: Array) -> float:
        """The quadratic of the positions step."""
        p, w = self.problem, self.problem.weights
        vector = edge_vectors(v, p.edges)
        a = _edge_weight(p, l)
        across = np.einsum("ed,ed->e", p.normals, vector)
        along = np.sum((vector - l[:, None] * p.directions) ** 2, axis=1)
        value = np.sum(a * (w.normal * across**2 + w.edge * along))
        value += 2.0 * w.straight * np.sum(self._straight_residual(v, l) ** 2)
        value += w.handle * np.sum((v[p.handles] - p.targets) ** 2)
        missed = tie_differences(p, v)
        return float(value + np.sum(p.tie_weight * (missed.real**2 + p.tie_slide * missed.imag**2)))

    def gradient(self, v: Array, l: Array) -> Array:
        """Half the gradient of `energy` with respect to v, (N, 2), summed residual by residual."""
        p, w = self.problem, self.problem.weights
        vector = edge_vectors(v, p.edges)
        across = np.einsum("ed,ed->e", p.normals, vector)
        pull = w.normal * across[:, None] * p.normals + w.edge * (vector - l[:, None] * p.directions)
        pull *= _edge_weight(p, l)[:, None]
        alpha, beta = 1.0 / l[p.straight_ij], 1.0 / l[p.straight_ik]
        residual = 2.0 * w.straight * self._straight_residual(v, l)
        missed = tie_differences(p, v)
        tied = p.tie_weight * p.tie_axis * (missed.real + 1j * p.tie_slide * missed.imag)
        parts = [
            pull,
            alpha[:, None] * residual,
            beta[:, None] * residual,
            np.stack([tied.real, tied.imag], axis=1),
            w.handle * (v[p.handles] - p.targets),
        ]
        return np.asarray(self._scatter @ np.concatenate(parts))

    def _straight_residual(self, v: Array, l: Array) -> Array:
        p = self.problem
        i, j, k = p.straight.T
        a = (v[j] - v[i]) / l[p.straight_ij][:, None]
        b = (v[i] - v[k]) / l[p.straight_ik][:, None]
        return a - b - p.bend

    def _weights(self, l: Array) -> Array:
        p = self.problem
        alpha, beta = 1.0 / l[p.straight_ij], 1.0 / l[p.straight_ik]
        factor = 2.0 * p.weights.straight
        return np.concatenate(
            [_edge_weight(p, l), factor * alpha**2, factor * beta**2, factor * alpha * beta, np.ones(1)]
        )


def _edge_weight(p: Problem, l: Array) -> Array:
    """max(1, l^2) / l^2, at a mass m other than 1 m max(1, (l/m)^2) / l^2; where omega_n is 1, m / l^2."""
    bare = p.mass / l**2
    return np.maximum(1.0 / p.mass, bare) if p.weights.stretch else bare


def _position_assembly(p: Problem) -> Assembly:
    """The normal matrix of the positions step, 2N x 2N, unknowns x_i at 2i, y_i at 2i + 1."""
    edge_count, straight_count = len(p.edges), len(p.straight)
    constant = edge_count + 3 * straight_count
    outer = np.einsum("ea,eb->eab", p.normals, p.normals)
    row, col, weight, factor = [], [], [], []

    def add(r: Array, c: Array, w: Array, f: Array) -> None:
        row.append(np.minimum(r, c))
        col.append(np.maximum(r, c))
        weight.append(w)
        factor.append(f)

    add(*edge_blocks(p.edges, p.weights.normal * outer + p.weights.edge * np.eye(2)))

    # Straight turns: alpha x_j - (alpha + beta) x_i + beta x_k, expanded in alpha^2, beta^2, alpha beta.
    i, j, k = p.straight.T
    squares = [edge_count + m * straight_count + np.arange(straight_count) for m in range(3)]
    products = [
        (j, j, (1, 0, 0)), (k, k, (0, 1, 0)), (i, i, (1, 1, 2)),
        (j, k, (0, 0, 1)), (i, j, (-1, 0, -1)), (i, k, (0, -1, -1)),
    ]  # fmt: skip
    for a, b, multiples in products:
        for which, value in zip(squares, multiples):
            for d in (0, 1) if value else ():
                add(2 * a + d, 2 * b + d, which, np.full(straight_count, float(value)))

    square = p.tie_axis**2
    even, odd = 0.5 * p.tie_weight * (1.0 + p.tie_slide), 0.5 * p.tie_weight * (1.0 - p.tie_slide)
    xx, yy, xy = even + odd * square.real, even - odd * square.real, odd * square.imag
    for m in range(4):
        for n in range(4):
            times = p.tie_factor[:, m] * p.tie_factor[:, n]
            used = np.flatnonzero(times)
            a, b = p.tie_samples[used, m], p.tie_samples[used, n]
            for c, d, value in ((0, 0, xx), (1, 1, yy), (0, 1, xy), (1, 0, xy)):
                upper = 2 * a + c <= 2 * b + d
                row_t, col_t = (2 * a + c)[upper], (2 * b + d)[upper]
                add(row_t, col_t, np.full(len(row_t), constant), (times * value)[used][upper])
    for d in (0, 1):
        held = 2 * p.handles + d
        add(held, held, np.full(len(held), constant), np.full(len(held), p.weights.handle))
    if p.weights.edge == 0.0:
        every = np.arange(2 * len(p.start))
        add(every, every, np.full(len(every), constant), np.full(len(every), LOOSE))
    rows, cols, weights, factors = (np.concatenate(x) for x in (row, col, weight, factor))
    return Assembly(rows, cols, weights, factors, 2 * len(p.start), constant + 1, paired=True)


def _length_matrix(p: Problem) -> csc_matrix:
    """The normal matrix of the lengths step, E x E, upper triangle."""
    a, b, r = p.turn_ij, p.turn_ik, p.ratio
    w = p.weights.tangent * p.turn_weight
    count = len(p.edges)
    row = np.concatenate([np.arange(count), a, b, np.minimum(a, b)])
    col = np.concatenate([np.arange(count), a, b, np.maximum(a, b)])
    factor = np.concatenate([(1.0 + p.size) / p.mass, w, w * r**2, -w * r])
    return Assembly(row, col, np.zeros(len(row), dtype=int), factor, count, 1).matrix(np.ones(1))
