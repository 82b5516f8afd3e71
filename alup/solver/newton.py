# SPDX-License-Identifier: GPL-2.0-or-later
"""A Newton method for the objective F = E_ALUP + E_edge + E_ties + E_size.

The alternation converges slowly in smooth modes: it needs hundreds of iterations where Newton's method needs
ten.  Newton's method alone, however, finds minima in which edges have collapsed or folded.  Four measures
lead it to the minimum that the alternation approaches:

*Start.*  A few alternations come first.  Their residual (v_j-v_i)/l - d0 is linear in the edge, so they can
pass an edge through length zero, and leave every edge pointing forwards.

*Model.*  Each energy of one edge, max(1,l^2) h(phi) with h = (n.u)^2 + |u-d0|^2, has its exact 2x2 Hessian
in radial and tangential direction, to which the curvature of lengths, E_tangent' (I - u u^T)/l, is added;
its negative eigenvalues are set to zero.  E_tangent and E_straight are Gauss-Newton (`objective.py`).  The
pattern is fixed for a round.

*Steps.*  Damping is relative, lambda sum |dx_ij|^2 / l_ij^2.  It resists the stretching of edges and not the
translation of parts; lambda I would do the opposite.  One step shortens no edge along itself by more than
nine tenths, so none passes through zero.  After a step straight runs are retracted onto their chords
(`straight_runs.py`).  Only the last steps let them bend, by the thousandths of a degree that F's minimum has.

*Kink.*  max(1, l^2) has a kink at l = 1, and at a minimum many edges lie on it.  It is rounded to
1 + (l^2-1 + sqrt((l^2-1)^2 + s^2))/2, with a softness s that is made small in two stages.
"""

from __future__ import annotations

import time

import numpy as np

from ..energy.objective import Objective, State, Structure
from ..energy.problem import Problem
from ..geometry.arrays import Array
from ..geometry.edges import edge_vectors
from .straight_runs import StraightRuns

# An edge keeps at least this part of its length, along itself, in one step.
KEPT_LENGTH = 0.1

# Edges that a step would shorten more are damped more: up to STIFFENED times a step, by the factor STIFFER,
# to STIFF at least.  (Damping that lets them lose exactly nine tenths collapses edges that the alternation
# keeps.) The values were chosen by looking at the cases.
STIFFENED, STIFFER, STIFF = 3, 30.0, 1e-2


class Newton:
    """The local models of F around positions, for one round.

    structure, runs : of another problem of the same edges, turns, ties, handles and straight turns, if known
    """

    def __init__(
        self, problem: Problem, structure: Structure | None = None, runs: StraightRuns | None = None
    ):
        self.problem = problem
        self.runs = runs or StraightRuns(problem)
        self.objective = Objective(problem, structure)
        self.structure = self.objective.structure
        self._gradient = np.zeros_like(problem.start)
        self._values = np.zeros(0)
        self._longest = 0.0
        self._inverse_square = np.zeros(0)
        self._vector = np.zeros(0, dtype=complex)

    def model(self, state: State, softness: float) -> None:
        """Set up the quadratic model at a state."""
        self._gradient, self._values = self.objective.derivatives(state, softness)
        self._inverse_square = 1.0 / state.length**2
        self._vector = state.length * state.u

    @property
    def gradient(self) -> Array:
        """Half the gradient of F at the model's positions, (N, 2)."""
        return self._gradient

    @property
    def seconds(self) -> float:
        """What the next step may take: as long as the longest one, at first one factorisation by the plan."""
        return self._longest or self.structure.plan.seconds

    def step(self, damping: float) -> Array:
        """The model's damped minimiser, as an increment (N, 2).

        Edges that the step would shorten too much are damped more, each by itself.  Were the whole step
        scaled down instead, a single short edge could stop all progress.
        """
        begun = time.monotonic()
        each = np.full(len(self._inverse_square), damping)
        step = self._damped(each)
        for _ in range(STIFFENED):
            short = self._growth(step) < KEPT_LENGTH - 1.0
            if not short.any():
                break
            each[short] = np.maximum(STIFFER * each[short], STIFF)
            step = self._damped(each)
        self._longest = max(self._longest, time.monotonic() - begun)
        return step

    def _damped(self, damping: Array) -> Array:
        """The minimiser with a damping for each edge, (E,)."""
        values = self._values.copy()
        values[: len(damping)] += damping * self._inverse_square
        return self.structure.factorised(values).solve(-self._gradient.ravel()).reshape(-1, 2)

    def _growth(self, step: Array) -> Array:
        """By which part of its length a step lengthens each edge along itself, (E,)."""
        dx = edge_vectors(step, self.problem.edges).view(np.complex128).ravel()
        return np.asarray((self._vector.conj() * dx).real) * self._inverse_square

    def moved(self, v: Array, step: Array, retract: bool = True) -> Array:
        """Positions plus as much of the step as leaves every edge some length, straight runs retracted."""
        least = float(self._growth(step).min(initial=0.0))
        share = min(1.0, (1.0 - KEPT_LENGTH) / max(-least, 1e-300))
        v = v + share * step
        return self.runs.retract(v) if retract else v
