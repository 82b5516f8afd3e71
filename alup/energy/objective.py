# SPDX-License-Identifier: GPL-2.0-or-later
"""F with its gradient and second derivatives, in one pass over the edges.

The terms are those of `alup.energy.terms`, which has one function for each; here they are evaluated together.
Positions are complex numbers z = x + i y.  The direction u of an edge, relative to its direction d in the
input, is then one product q = conj(d) u, and n . u = Im q.  The energy of an edge,

    m_e max(1, (l/m_e)^2) h,    h = w_normal (Im q)^2 + w_edge |conj(d0) u - 1|^2

is a function of its length and its angle, and is differentiated along u and along m = i u.  (The edge's mass
m_e is 1, except on coarse levels.)  The terms of lengths, E_tangent and E_size, add a pull along u.  The kink
of max(1, t) is rounded by a softness s, 1 + (t-1 + sqrt((t-1)^2 + s^2))/2.

The second derivatives of an edge are a symmetric 2x2 matrix, kept as its mean and its complex traceless part.
Its negative eigenvalues are set to zero.  E_tangent and E_straight are Gauss-Newton.  Both couple pairs of
edges a, b that share a sample by 2x2 blocks in u_a u_b^T and m_a m_b^T, so that with D the edges' differences

    Hessian of F  ~  2 D^T H D + handles + ties,    H of one block an edge and one a turn.

The map from these blocks to the upper triangle's nonzeros is constant (`BlockAssembly`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.arrays import Array
from ..sparse import dissection
from ..sparse.least_squares import BlockAssembly, Factor
from .problem import Problem, scatter
from .terms import stretch_weight_derivatives

# Added to the diagonal, so that a part that nothing holds stays where it is.  More would resist the long,
# soft modes of fine samplings.
TRACE = 1e-12

# mean I + [[Re t, Im t], [Im t, -Re t]], a symmetric matrix by its mean and its traceless part
_SYMMETRIC = (np.eye(2), np.diag([1.0, -1.0]), np.array([[0.0, 1.0], [1.0, 0.0]]))

# Shorter edges, in L_avg, have no direction to speak of.
NO_LENGTH = 1e-6


@dataclass
class State:
    """F around positions.  (E,) arrays of the edges, complex unless said otherwise.

    v : (N, 2); terms : each term; value : their sum with the kink rounded, sharp : without, both with what
    the keeping of sizes adds
    """

    v: Array
    value: float
    sharp: float
    terms: dict[str, float]
    length: Array  # float
    u: Array
    q: Array
    q0: Array
    h: Array  # float
    lengths_differ: Array  # (T,) float, l_a - r l_b of the turns
    bent: Array  # (K,) what the straight turns miss
    tied: Array  # (T,) what the ties miss, along their axes and across
    missed: Array  # (H,) handles

    @property
    def folds(self) -> int:
        """How many edges are turned by more than 90 degrees against the input."""
        return int(np.count_nonzero((self.q.real < 0.0) & (self.length > NO_LENGTH)))


class Structure:
    """What a problem's matrices have where, for all problems of the same edges, turns, ties and handles.

    gather : (N, E + T + H) sums pulls on edges, ties and handles into the samples
    assembly : from the weights that `Objective.derivatives` returns; factor : once analysed, for all
    plan : how its matrices are factorised
    """

    def __init__(self, p: Problem):
        self._of = p
        self.gather = scatter(len(p.start), p.edges, p)
        self.assembly = self._pattern(p)
        self.plan = dissection.plan(p.start, p.edges, *self.assembly.pattern)
        self.factor: Factor | None = None

    def factorised(self, values: Array) -> Factor:
        """The matrix of these weights, factorised; the same object, with new values, every time."""
        matrix = self.assembly.matrix(values)
        if self.factor is None:
            self.factor = Factor(matrix, order=self.plan.order)
        else:
            self.factor.update(matrix)
        return self.factor

    def serves(self, p: Problem) -> bool:
        """Whether a problem has the same structure."""
        mine = self._of
        names = ("edges", "turn_ij", "turn_ik", "tie_samples", "tie_factor", "handles")
        return len(mine.start) == len(p.start) and all(
            np.array_equal(getattr(mine, name), getattr(p, name)) for name in names
        )

    @staticmethod
    def _pattern(p: Problem) -> BlockAssembly:
        """Where blocks of edges and turns, ties, handles and damping go in the normal matrix."""
        count, edges = len(p.start), len(p.edges)
        once = p.turn_ij < p.turn_ik
        a, b = p.edges[p.turn_ij[once]], p.edges[p.turn_ik[once]]
        turns, ties = len(a), len(p.tie_samples)
        blocks = BlockAssembly(count, 3 * edges + 4 * turns + 3 * ties + 2)
        number = np.arange(edges)
        of_edges = (number, edges + 2 * number, edges + 2 * number + 1)
        blocks.add_edges(p.edges, of_edges, _SYMMETRIC)
        # a_x b_x = (Re P + Re Q)/2, a_y b_y = (Re P - Re Q)/2, a_x b_y = (Im Q - Im P)/2,
        # a_y b_x = (Im Q + Im P)/2 for P = a conj(b), Q = a b; both the block and its transpose count.
        first = 3 * edges + 2 * np.arange(turns)
        which = (first, first + 1, first + 2 * turns, first + 2 * turns + 1)
        matrices = (
            np.diag([0.5, 0.5]),
            np.array([[0.0, -0.5], [0.5, 0.0]]),
            np.diag([0.5, -0.5]),
            np.array([[0.0, 0.5], [0.5, 0.0]]),
        )
        for end_a in (0, 1):
            for end_b in (0, 1):
                sign = 1.0 if end_a == end_b else -1.0
                blocks.add(a[:, end_a], b[:, end_b], which, [sign * matrix for matrix in matrices])
        of_first_tie = 3 * edges + 4 * turns
        number = np.arange(ties)
        of_ties = (
            of_first_tie + number,
            of_first_tie + ties + 2 * number,
            of_first_tie + ties + 2 * number + 1,
        )
        for k in range(4):
            for m in range(k, 4):
                factor = p.tie_factor[:, k] * p.tie_factor[:, m]
                used = np.flatnonzero(factor)
                blocks.add(
                    p.tie_samples[used, k],
                    p.tie_samples[used, m],
                    [which[used] for which in of_ties],
                    [0.5 * matrix if k == m else matrix for matrix in _SYMMETRIC],
                    factor[used],
                )
        blocks.add_diagonal(p.handles, of_first_tie + 3 * ties)
        blocks.add_diagonal(np.arange(count), of_first_tie + 3 * ties + 1)
        return blocks.finish()


class Objective:
    """Evaluates one problem."""

    def __init__(self, problem: Problem, structure: Structure | None = None):
        p = self.problem = problem
        w = p.weights
        self._tail, self._head = p.edges.T.copy()
        self._against = 1j * _conjugate(p.normals)  # conj(d) of the input, for n = i d
        self._against0 = _conjugate(p.directions)
        self._mass = p.mass
        # Each pair of edges once: (l_a - r l_b)^2 + (l_b - l_a/r)^2 = (1 + 1/r^2)(l_a - r l_b)^2.
        once = p.turn_ij < p.turn_ik
        self._a, self._b, self._ratio = p.turn_ij[once], p.turn_ik[once], p.ratio[once]
        self._gradual = w.tangent * p.turn_weight[once] * (1.0 + 1.0 / self._ratio**2)
        self._both = np.concatenate([self._a, self._b])
        self._radial = np.bincount(
            self._both, np.concatenate([self._gradual, self._gradual * self._ratio**2]), len(p.edges)
        )
        self._straight_model()
        self._tie_samples = p.tie_samples.T.copy()
        self._tie_factor = p.tie_factor.T.copy()
        self._tie_vector = _complex(p.tie_vector)
        self._keep, self._tie_weight = 0.0, p.tie_weight
        self._axis = p.tie_axis
        self._axis_square = p.tie_axis**2
        self._targets = _complex(p.targets)
        self.structure = structure or Structure(p)
        self._gather = self.structure.gather
        self._constant = np.array([w.handle, TRACE])

    def hold(self, keep: float, tie_weight: Array) -> None:
        """From now on keep sizes and hold ties this firmly; at first no size is kept and no tie has let go.

        keep : added to the weight of E_size, see `minimise.newton`; tie_weight : (T,), see `problem.let_go`
        """
        self._keep, self._tie_weight = keep, tie_weight

    def _straight_model(self) -> None:
        p = self.problem
        i = p.straight[:, 0]
        self._line_a, self._line_b = p.straight_ij, p.straight_ik
        self._sign_a = np.where(p.edges[p.straight_ij, 0] == i, 1.0, -1.0)
        self._sign_b = np.where(p.edges[p.straight_ik, 0] == i, 1.0, -1.0)
        self._bend = _complex(p.bend)
        self._lines = np.concatenate([p.straight_ij, p.straight_ik])
        self._stiff = 2.0 * p.weights.straight
        self._times = np.bincount(self._lines, minlength=len(p.edges)).astype(float)
        # Which of the turns is straight.
        key = self._a * len(p.edges) + self._b
        order = np.argsort(key)
        low, high = np.minimum(p.straight_ij, p.straight_ik), np.maximum(p.straight_ij, p.straight_ik)
        self._turn_of_line = order[np.searchsorted(key, low * len(p.edges) + high, sorter=order)]

    def state(self, v: Array, softness: float) -> State:
        """F at v (N, 2)."""
        p, w = self.problem, self.problem.weights
        z = v.view(np.complex128).ravel()
        x = z[self._head] - z[self._tail]
        length = np.maximum(np.abs(x), 1e-12)
        u = x / length
        q, q0 = self._against * u, self._against0 * u
        off = q0 - 1.0
        turned = w.normal * q.imag**2
        different = w.edge * (off.real**2 + off.imag**2)
        h = turned + different
        stretch = (length / self._mass) ** 2 - 1.0 if w.stretch else np.zeros_like(length)
        sharp = self._mass * (1.0 + np.maximum(stretch, 0.0))
        lengths_differ = length[self._a] - self._ratio * length[self._b]
        bent = self._sign_a * u[self._line_a] + self._sign_b * u[self._line_b] - self._bend
        tied = -self._tie_vector
        for samples, factor in zip(self._tie_samples, self._tie_factor):
            tied = tied + factor * z[samples]
        tied = tied * self._axis.conj()
        stretched = tied.real**2 + p.tie_slide * tied.imag**2
        missed = z[p.handles] - self._targets
        change = length - p.rest
        grown = float(change @ (change / self._mass))
        terms = {
            "normal": float(sharp @ turned),
            "tangent": float(self._gradual @ lengths_differ**2),
            "straight": self._stiff * _square(bent),
            "handle": w.handle * _square(missed),
            "edge": float(sharp @ different),
            "size": float(p.size @ (change**2 / self._mass)),
            "ties": float(self._tie_weight @ stretched),
        }
        terms["alup"] = terms["normal"] + terms["tangent"] + terms["straight"] + terms["handle"]
        terms["objective"] = terms["alup"] + terms["edge"] + terms["ties"] + terms["size"]
        sharp_value = value = terms["objective"] + self._keep * grown
        if softness and w.stretch:
            excess = 0.5 * (np.sqrt(stretch**2 + softness**2) - np.abs(stretch))
            value += float((self._mass * excess) @ h)
        return State(v, value, sharp_value, terms, length, u, q, q0, h, lengths_differ, bent, tied, missed)

    def derivatives(self, s: State, softness: float) -> tuple[Array, Array]:
        """Half the gradient (N, 2), and the assembly's weights of half the Hessian."""
        p, w = self.problem, self.problem.weights
        length, u, size = s.length, s.u, (p.size + self._keep) / self._mass
        # Of l / m_e; the energy of m_e edges has it m_e times.
        if w.stretch:
            weight, weight1, weight2 = stretch_weight_derivatives(length / self._mass, softness)
        else:
            weight, weight1, weight2 = np.ones_like(length), np.zeros_like(length), np.zeros_like(length)
        weight, weight2 = weight * self._mass, weight2 / self._mass
        # Half derivatives by the angle; h is halved too.
        h1 = w.normal * s.q.imag * s.q.real + w.edge * s.q0.imag
        h2 = w.normal * (s.q.real**2 - s.q.imag**2) + w.edge * s.q0.real
        half = 0.5 * s.h

        pull = np.bincount(self._both, self._pulls(s), len(length)) + size * (length - p.rest)
        rr = weight2 * half + size
        tt = (weight * h2 / length + weight1 * half + pull) / length
        rt = (weight1 - weight / length) * h1 / length
        mean, traceless = 0.5 * (rr + tt), 0.5 * (rr - tt) + 1j * rt
        radius = np.maximum(np.abs(traceless), 1e-300)
        great, small = np.maximum(mean + radius, 0.0), np.maximum(mean - radius, 0.0)
        traceless *= 0.5 * (great - small) / radius
        mean = 0.5 * (great + small)

        straight, tangential = self._straight_parts(s)
        rigid = self._stiff * self._times / length**2
        mean += 0.5 * (self._radial + rigid)
        traceless += 0.5 * (self._radial - rigid)
        traceless *= u**2

        pair, along = u[self._a] * u[self._b].conj(), u[self._a] * u[self._b]
        coupled = -self._gradual * self._ratio
        even, odd = coupled + straight, coupled - straight
        tie = self._tie_weight
        tie_mean, tie_traceless = 0.5 * tie * (1.0 + p.tie_slide), 0.5 * tie * (1.0 - p.tie_slide)
        values = [
            mean,
            traceless.view(float),
            (even * pair).view(float),
            (odd * along).view(float),
            tie_mean,
            (tie_traceless * self._axis_square).view(float),
            self._constant,
        ]

        edge = u * ((weight1 * half + pull) + 1j * (weight * h1 / length + tangential))
        tied = tie * self._axis * (s.tied.real + 1j * p.tie_slide * s.tied.imag)
        pulls = np.concatenate([edge, tied, w.handle * s.missed])
        gradient = np.asarray(self._gather @ pulls.view(float).reshape(-1, 2))
        return gradient, np.concatenate(values)

    def _pulls(self, s: State) -> Array:
        """Half the derivatives of E_tangent by the lengths of each turn's two edges."""
        difference = self._gradual * s.lengths_differ
        return np.concatenate([difference, -self._ratio * difference])

    def _straight_parts(self, s: State) -> tuple[Array, Array]:
        """Of E_straight: the factor of m_a m_b^T for every turn, and the tangential pull on every edge."""
        u_a, u_b = self._sign_a * s.u[self._line_a], self._sign_b * s.u[self._line_b]
        l_a, l_b = s.length[self._line_a], s.length[self._line_b]
        factor = np.zeros(len(self._a))
        factor[self._turn_of_line] = self._stiff * (u_a * u_b.conj()).real / (l_a * l_b)
        pull_a = (u_a.conj() * s.bent).imag / l_a
        pull_b = (u_b.conj() * s.bent).imag / l_b
        pull = np.bincount(self._lines, np.concatenate([pull_a, pull_b]), len(s.u))
        return factor, self._stiff * pull


def _complex(vectors: Array) -> Array:
    """Vectors (n, 2) as complex numbers (n,)."""
    return np.ascontiguousarray(vectors, dtype=float).view(np.complex128).ravel()


def _conjugate(vectors: Array) -> Array:
    return _complex(vectors).conj()


def _square(values: Array) -> float:
    return float(values.real @ values.real + values.imag @ values.imag)
