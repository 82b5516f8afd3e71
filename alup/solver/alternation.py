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

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix

from ..energy.problem import Problem, edge_vectors, scatter, tie_differences
from ..least_squares import BlockAssembly, Factor, upper_half
from ..model import Array

# Without E_edge nothing holds the length of a line along itself, and the equations are singular.  This much
# of the diagonal lets what nothing holds stay where it was; a part of the matrix only, not of the gradient,
# it leaves the minimisers what they are.
LOOSE = 1e-6


class Alternation:
    """Both quadratic steps of one round."""

    def __init__(self, problem: Problem):
        self.problem = problem
        self._scatter = _scatter(problem)
        self._assembly = _position_assembly(problem)
        self._positions: Factor = Factor(self._assembly.matrix(self._weights(problem.lengths)))
        self._analysed_at = problem.lengths
        self._lengths = Factor(_length_matrix(problem))

    def positions(self, v: Array, l: Array) -> Array:
        """The minimiser for fixed lengths, (N, 2), by increments from v (N, 2).  l : (E,)."""
        if l is not self._analysed_at:
            self._positions.update(self._assembly.matrix(self._weights(l)))
            self._analysed_at = l
        # The second increment, by the same factors, takes away what the condition number cost the
        # first: without it components that only the weak scaffold joins stop 1e-6 short.
        for _ in range(2):
            v = v + self._positions.solve(-self.gradient(v, l).ravel()).reshape(-1, 2)
        return v

    def lengths(self, v: Array) -> Array:
        """The minimiser for fixed positions, (E,)."""
        now = np.linalg.norm(edge_vectors(v, self.problem.edges), axis=1)
        p = self.problem
        return self._lengths.solve((now + p.size * p.rest) / p.mass)

    def gradient(self, v: Array, l: Array) -> Array:
        """Half the gradient of the quadratic of the positions step, (N, 2), summed residual by residual."""
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


def _scatter(p: Problem) -> csr_matrix:
    """Sums pulls on differences of samples into the samples, (N, E + 2 K + T + H).

    In this order: v_j - v_i of the edges, v_j - v_i and v_k - v_i of the straight turns, the ties, and the
    handles' own positions.
    """
    i, j, k = p.straight.T
    pairs = [p.edges, np.stack([i, j], axis=1), np.stack([i, k], axis=1)]
    return scatter(len(p.start), np.concatenate(pairs), p)


def _position_assembly(p: Problem) -> BlockAssembly:
    """The normal matrix of the positions step, 2N x 2N, unknowns x_i at 2i, y_i at 2i + 1."""
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


def _length_matrix(p: Problem) -> csc_matrix:
    """The normal matrix of the lengths step, E x E, upper triangle."""
    a, b, r = p.turn_ij, p.turn_ik, p.ratio
    w = p.weights.tangent * p.turn_weight
    count = len(p.edges)
    row = np.concatenate([np.arange(count), a, b, np.minimum(a, b)])
    col = np.concatenate([np.arange(count), a, b, np.maximum(a, b)])
    value = np.concatenate([(1.0 + p.size) / p.mass, w, w * r**2, -w * r])
    unique, place = np.unique(col * count + row, return_inverse=True)
    starts = np.searchsorted(unique, count * np.arange(count + 1))
    return csc_matrix(
        (np.bincount(place.ravel(), value), unique % max(count, 1), starts), shape=(count, count)
    )
