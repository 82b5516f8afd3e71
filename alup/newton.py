"""A Newton method for the objective F = E_ALUP + E_edge + E_comp.

The alternation's slow modes are smooth: it needs hundreds of iterations where Newton's method needs ten.
Left to itself, however, Newton's method falls into minima in which edges have collapsed or folded.  Four
things make it go where the alternation goes, only further:

*Start.*  A few alternations, which pass through a collapsed edge because their residual (v_j-v_i)/l - d0 is
linear in it, put every edge on the right side.

*Model.*  Each energy of one edge, max(1,l^2) h(phi) with h = (n.u)^2 + |u-d0|^2, has its exact 2x2 Hessian
in radial and tangential direction, to which the curvature of lengths, E_tangent' (I - u u^T)/l, is added;
its negative eigenvalues are set to zero.  E_tangent and E_straight are Gauss-Newton: rows

    sqrt(w_t) (u_ij . dx_ij - r u_ik . dx_ik)         sqrt(2 w_s) m . (dx_ij/l_ij + dx_ik/l_ik)

with dx_ij the change of v_j - v_i and m the line's normal.  The pattern is fixed for a round.

*Steps.*  Damping is relative, lambda sum |dx_ij|^2 / l_ij^2: it holds back the stretching of edges and lets
whole parts travel (lambda I would do the opposite).  No edge may lose more than nine tenths of its length
along itself in one step, so none passes through zero.  Straight runs are retracted onto their chords
(`runs.py`).

*Kink.*  max(1, l^2) has a kink at l = 1, on which edges come to rest.  It is rounded by a softness s,
1 + (l^2-1 + sqrt((l^2-1)^2 + s^2))/2, that is made small in two stages.
"""

from __future__ import annotations

import numpy as np

from . import energy
from .model import Array
from .problem import Problem, difference_scatter, edge_vectors
from .quadratic import Assembly, Factor, edge_blocks
from .runs import StraightRuns

# An edge keeps at least this part of its length, along itself, in one step.
KEPT_LENGTH = 0.1

# The 21 entries of the upper triangle of a 6x6 block, unknowns x_j y_j x_k y_k x_i y_i.
_UPPER = np.triu_indices(6)


class Newton:
    """The local models of F around positions, for one round."""

    def __init__(self, problem: Problem):
        self.problem = problem
        self.runs = StraightRuns(problem)
        p = problem
        centre = _common(p.edges[p.turn_ij], p.edges[p.turn_ik])
        self._sign_ij = np.where(p.edges[p.turn_ij, 0] == centre, 1.0, -1.0)
        self._sign_ik = np.where(p.edges[p.turn_ik, 0] == centre, 1.0, -1.0)
        j = p.edges[p.turn_ij].sum(axis=1) - centre
        k = p.edges[p.turn_ik].sum(axis=1) - centre
        self._triples = np.concatenate([np.stack([j, k, centre], axis=1), p.straight[:, [1, 2, 0]]])
        self._assembly = self._pattern()
        self._factor: Factor | None = None
        self._scatter = difference_scatter(problem)
        self._gradient = np.zeros_like(p.start)
        self._values = np.zeros(0)
        self._square_length = np.zeros(0)

    def model(self, v: Array, softness: float) -> None:
        """Set up the quadratic model at v (N, 2)."""
        p, w = self.problem, self.problem.weights
        x = edge_vectors(v, p.edges)
        self._square_length = np.maximum(np.einsum("ed,ed->e", x, x), 1e-24)
        length = np.sqrt(self._square_length)
        u = x / length[:, None]
        m = np.stack([-u[:, 1], u[:, 0]], axis=1)

        # E_tangent: half its gradient with respect to each length.
        difference = p.turn_weight * (length[p.turn_ij] - p.ratio * length[p.turn_ik]) * w.tangent
        pull = np.bincount(p.turn_ij, difference, minlength=len(length)).astype(float)
        pull -= np.bincount(p.turn_ik, p.ratio * difference, minlength=len(length))
        pull += w.size * (length - p.lengths)

        radial, tangential, blocks = self._edge_models(u, m, length, pull, softness)
        straight_rows, straight_pull = self._straight_model(v)
        root = np.sqrt(w.tangent * p.turn_weight)[:, None]
        out_ij, out_ik = self._sign_ij[:, None] * u[p.turn_ij], self._sign_ik[:, None] * u[p.turn_ik]
        turn_rows = _rows(root * out_ij, -root * p.ratio[:, None] * out_ik)
        rows = np.concatenate([turn_rows, straight_rows])
        products = rows[:, _UPPER[0]] * rows[:, _UPPER[1]]
        self._values = np.concatenate([products.T.ravel(), blocks.ravel()])
        change = edge_vectors(v, p.scaffold) - p.scaffold_vector
        parts = [
            (radial[:, None] * u + tangential[:, None] * m),
            *straight_pull,
            p.scaffold_weight[:, None] * change,
            w.handle * (v[p.handles] - p.targets),
        ]
        self._gradient = np.asarray(self._scatter @ np.concatenate(parts))

    @property
    def gradient(self) -> Array:
        """Half the gradient of F at the model's positions, (N, 2)."""
        return self._gradient

    def step(self, damping: float) -> Array:
        """The model's damped minimiser, as an increment (N, 2)."""
        edges = len(self.problem.edges)
        values = self._values.copy()
        values[-3 * edges : -2 * edges] += damping / self._square_length
        values[-edges:] += damping / self._square_length
        matrix = self._assembly.matrix(np.append(values, 1.0))
        if self._factor is None:
            self._factor = Factor(matrix)
        else:
            self._factor.update(matrix)
        return self._factor.solve(-self._gradient.ravel()).reshape(-1, 2)

    def moved(self, v: Array, step: Array) -> Array:
        """Positions plus as much of the step as leaves every edge some length, straight runs retracted."""
        x, dx = edge_vectors(v, self.problem.edges), edge_vectors(step, self.problem.edges)
        along = np.einsum("ed,ed->e", x, dx)
        shrinking = along < 0.0
        most = (1.0 - KEPT_LENGTH) * self._square_length[shrinking] / -along[shrinking]
        share = min(1.0, float(most.min(initial=1.0)))
        return self.runs.retract(v + share * step)

    def _edge_models(
        self, u: Array, m: Array, length: Array, pull: Array, softness: float
    ) -> tuple[Array, Array, Array]:
        """Half gradients along u and m, (E,), and half Hessians xx, xy, yy made semidefinite, (3, E)."""
        p, w = self.problem, self.problem.weights
        across, across_m = np.einsum("ed,ed->e", p.normals, u), np.einsum("ed,ed->e", p.normals, m)
        along, along_m = np.einsum("ed,ed->e", p.directions, u), np.einsum("ed,ed->e", p.directions, m)
        # h and its derivatives by the angle of u, halved.
        h = 0.5 * w.normal * across**2 + w.edge * (1.0 - along)
        h1 = w.normal * across * across_m - w.edge * along_m
        h2 = w.normal * (across_m**2 - across**2) + w.edge * along
        weight, weight1, weight2 = energy.stretch_weight_derivatives(length, softness)
        rr = weight2 * h + w.size
        tt = (weight * h2 / length + weight1 * h + pull) / length
        rt = (weight1 - weight / length) * h1 / length
        # Eigenvalues and vectors of [[rr, rt], [rt, tt]]; those below zero are left out.
        mean, half = 0.5 * (rr + tt), 0.5 * (rr - tt)
        radius = np.hypot(half, rt)
        angle = 0.5 * np.arctan2(rt, half)
        cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
        great, small = cosine * u + sine * m, -sine * u + cosine * m
        value = np.maximum(mean + radius, 0.0), np.maximum(mean - radius, 0.0)
        blocks = [
            value[0] * great[:, a] * great[:, b] + value[1] * small[:, a] * small[:, b]
            for a, b in ((0, 0), (0, 1), (1, 1))
        ]
        return weight1 * h + pull, weight * h1 / length, np.stack(blocks)

    def _straight_model(self, v: Array) -> tuple[Array, list[Array]]:
        """Gauss-Newton rows (K, 6) of E_straight and the pulls on v_j - v_i and v_k - v_i, (K, 2) each."""
        p = self.problem
        i, j, k = p.straight.T
        a, b = v[j] - v[i], v[k] - v[i]
        length_a = np.maximum(np.linalg.norm(a, axis=1), 1e-12)[:, None]
        length_b = np.maximum(np.linalg.norm(b, axis=1), 1e-12)[:, None]
        a, b = a / length_a, b / length_b
        residual = a + b - p.bend
        m_a, m_b = np.stack([-a[:, 1], a[:, 0]], axis=1), np.stack([-b[:, 1], b[:, 0]], axis=1)
        aligned = np.einsum("kd,kd->k", m_a, m_b)[:, None]
        root = np.sqrt(2.0 * p.weights.straight)
        rows = _rows(root * m_a / length_a, root * aligned * m_b / length_b)
        factor = 2.0 * p.weights.straight
        pulls = [
            factor * np.einsum("kd,kd->k", m, residual)[:, None] * m / length
            for m, length in ((m_a, length_a), (m_b, length_b))
        ]
        return rows, pulls

    def _pattern(self) -> Assembly:
        """Where the rows' products, the edges' blocks and the constants go in the normal matrix."""
        p = self.problem
        count, edges = len(self._triples), len(p.edges)
        unknown = np.stack([2 * self._triples, 2 * self._triples + 1], axis=2).reshape(count, 6)
        r, c = unknown[:, _UPPER[0]].T.ravel(), unknown[:, _UPPER[1]].T.ravel()
        row, col = [np.minimum(r, c)], [np.maximum(r, c)]
        weight, factor = [np.arange(21 * count)], [np.ones(21 * count)]
        for n, block in enumerate(([[1, 0], [0, 0]], [[0, 1], [1, 0]], [[0, 0], [0, 1]])):
            entries = np.tile(np.array(block, dtype=float), (edges, 1, 1))
            r, c, edge, f = edge_blocks(p.edges, entries)
            used = f != 0.0
            row.append(r[used])
            col.append(c[used])
            weight.append(21 * count + n * edges + edge[used])
            factor.append(f[used])
        constant = 21 * count + 3 * edges
        r, c, edge, f = edge_blocks(p.scaffold, p.scaffold_weight[:, None, None] * np.eye(2))
        held = np.concatenate([2 * p.handles, 2 * p.handles + 1])
        # A trace of damping of the positions themselves: a part that nothing holds stays.
        every = np.arange(2 * len(p.start))
        row += [r, held, every]
        col += [c, held, every]
        factor += [f, np.full(len(held), p.weights.handle), np.full(len(every), 1e-9)]
        weight += [np.full(len(r) + len(held) + len(every), constant)]
        parts = (np.concatenate(part) for part in (row, col, weight, factor))
        rows, cols, weights, factors = parts
        return Assembly(rows, cols, weights, factors, 2 * len(p.start), constant + 1)


def _common(a: Array, b: Array) -> Array:
    """The sample that two edges (n, 2) share."""
    return np.where((a[:, 0] == b[:, 0]) | (a[:, 0] == b[:, 1]), a[:, 0], a[:, 1])


def _rows(at_j: Array, at_k: Array) -> Array:
    """Coefficients (n, 6) of rows  c_j . (x_j - x_i) + c_k . (x_k - x_i)."""
    return np.concatenate([at_j, at_k, -(at_j + at_k)], axis=1)
