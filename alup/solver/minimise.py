# SPDX-License-Identifier: GPL-2.0-or-later
"""The solvers of a round.

`newton` minimises F = E_ALUP + E_edge + E_ties + E_size to a local minimum, from coarse to fine.  `paper`
(`paper_scheme.py`) is the scheme of Sec. 3.3.2 and 3.4 as it is published, for reference.  Another minimiser
of the same terms is a function of the same form, listed in `SOLVERS`.
"""

from __future__ import annotations

from typing import Callable, Optional

import numpy as np

from ..energy import terms as energy
from ..energy.objective import State, Structure
from ..energy.problem import Problem, let_go
from ..geometry.arrays import Array
from ..geometry.connected_components import components
from ..messages.errors import SolveError
from . import descent
from .alternation import Alternation, affordable
from .coarse_levels import coarsen
from .descent import Stage
from .newton import Newton
from .outcome import DEFAULT_LIMITS, Limits, Round, Status, finite, rounding, start_terms
from .paper_scheme import paper

# Alternations before Newton's method if handles are far from their targets.  After one alternation an edge in
# thirty still points backwards; after five none does in any case tried.  More would only cost time.
ALTERNATIONS = 5

# A level with at most this number of samples is not coarsened further.  Chosen by looking at the cases.
SMALLEST = 200


def newton(problem: Problem, limits: Limits = DEFAULT_LIMITS, before: Optional[Round] = None) -> Round:
    """Newton's method on F, from the minimum of a coarser level (see `newton.py`, `coarse_levels.py`).

    F is nearly blind to size, so its minimum may inflate a part that is far from all handles.  (The paper's
    scheme stops before it gets there.)  Therefore a second descent minimises F + w S, S = sum (l - l0)^2,
    with w = keep_size F0 / S0, where F0 and S0 are the values at F's minimum.  Its minimum has an F of at
    most (1 + keep_size) F0.  Where the handles allow a shape without distortion, F0 is 0 and nothing changes.

    before : a round of the same graph, whose matrix patterns are used again.  If it began at the same start,
        its result is tried as a start of this one
    Raises SolveError where the equations have no solution from the very start.
    """
    start = start_terms(problem)
    known = before.structures if before is not None else ()
    if start["objective"] <= rounding(problem):
        return Round(problem.start, Status.UNMOVED, 0, (start,), structures=known)
    along = _along(problem)
    terms = energy.terms(problem, along) if along is not None else start
    if along is not None and terms["objective"] <= rounding(problem):
        return Round(along, Status.MINIMUM, 0, (start, terms), start=problem.start, structures=known)
    levels = _Levels(limits, known)
    if before is not None and np.array_equal(before.start, problem.start):
        levels.guess = before.positions
    state, status, keep = levels.minimum(problem, 0)
    # A state is no answer if no step led to it, or if an edge of it is folded back.
    if levels.failure is not None and status is Status.SINGULAR and (not levels.steps[0] or state.folds):
        raise levels.failure
    history = (start, *levels.history)
    coarse = sum(levels.steps[1:])
    structures = tuple(levels.structures)
    return Round(state.v, status, len(levels.history), history, coarse, keep, problem.start, structures)


def _along(problem: Problem) -> Array | None:
    """Positions with every part shifted like its handles; None if handles of one part move differently."""
    p = problem
    joined = np.concatenate([p.edges, *(p.tie_samples[:, [n, n + 1]] for n in range(3))])
    count, label = components(joined, len(p.start))
    at = label[p.handles]
    handles = np.maximum(np.bincount(at, minlength=count), 1)
    moves = p.targets - p.start[p.handles]
    mean = np.stack([np.bincount(at, move, minlength=count) / handles for move in moves.T], axis=1)
    # The handles' energy alone tells; the other terms are evaluated only where they move alike.
    if p.weights.handle * float(((moves - mean[at]) ** 2).sum()) > rounding(p):
        return None
    return np.asarray(p.start + mean[label])


class _Levels:
    """One solve through all levels.  Level 0 is the finest.

    history : every term after each step on the finest level; steps, structures : of each level
    failure : of the last equations that could not be solved
    """

    def __init__(self, limits: Limits, known: tuple[Structure, ...]):
        self.limits = limits
        self.history: list[dict[str, float]] = []
        self.steps: list[int] = []
        self.structures: list[Structure] = []
        self._known = known
        self.guess: Optional[Array] = None
        self.failure: Optional[SolveError] = None

    def minimum(self, problem: Problem, number: int) -> tuple[State, Status, float]:
        """The minimum on a level by way of the coarser ones, and the weight of E_size that keeps sizes."""
        known = self._known[number] if number < len(self._known) else None
        models = Newton(problem, known if known is not None and known.serves(problem) else None)
        self.steps.append(0)
        self.structures.append(models.structure)
        level = coarsen(problem) if len(problem.start) > SMALLEST else None
        stages = descent.COARSE if number else descent.FINE
        last = stages[-1:] if number or not len(models.runs.inner) else (descent.STRAIGHT, descent.RELEASED)
        if level is not None:
            below, _status, keep = self.minimum(level.problem, number + 1)
            models.objective.hold(keep, problem.tie_weight)
            start = self._best(models, [problem.start, *level.prolongations(below.v)], number)
            if number == 0:
                models.objective.hold(keep, let_go(problem, start))
            return (*self._descent(models, start, last, number), keep)
        best, status = self._descent(models, self._alternated(models, number), stages, number)
        keep = keeping(problem, best)
        if (keep > 0.0 or len(problem.tie_weight)) and status not in (Status.TIME, Status.SINGULAR):
            models.objective.hold(keep, let_go(problem, best.v) if number == 0 else problem.tie_weight)
            best, status = self._descent(models, best.v, last, number)
        return best, status, keep

    def _best(self, models: Newton, starts: list[Array], number: int) -> Array:
        """The start with the least energy, the guess included."""
        if number == 0 and self.guess is not None:
            starts = [*starts, self.guess]
        if len(starts) == 1:
            return starts[0]
        return min(starts, key=lambda v: models.objective.state(v, 0.0).sharp)

    def _alternated(self, models: Newton, number: int) -> Array:
        """The start after some alternations; as it is where the handles are met, as in a final round."""
        problem = models.problem
        v, l = problem.start, problem.lengths
        first = models.objective.state(v, 0.0).terms
        if first["handle"] < 0.5 * first["objective"]:
            return self._best(models, [v], number)
        try:
            steps = Alternation(problem)
            if not affordable(steps, self.limits):
                return self._best(models, [v], number)
            for step in range(min(ALTERNATIONS, self.limits.iterations)):
                if step and not self.limits.leave(steps.seconds):
                    return self._best(models, [problem.start, v], number)
                moved = steps.positions(v, l)
                l = finite(steps.lengths(finite(moved)))
                v = moved
                self._record(models.objective.state(v, 0.0), number)
        except SolveError as error:  # Newton's damping may do without
            self.failure = error
        return v

    def _descent(
        self, models: Newton, v: Array, stages: tuple[Stage, ...], number: int
    ) -> tuple[State, Status]:
        """Descend from v; the state with the least energy of those seen, and why it ended there."""
        best = models.objective.state(v, 0.0)
        v = models.runs.retract(v)
        status, zero = Status.ITERATIONS, rounding(models.problem)
        for stage in stages:
            damping, calm = descent.DAMPING[0], 0
            now = models.objective.state(v, stage.softness)
            for _number in range(stage.most):
                if not self.limits.leave(models.seconds):
                    return best, Status.TIME
                if self.steps[number] >= self.limits.iterations:
                    status = Status.ITERATIONS
                    break
                models.model(now, stage.softness)
                try:
                    after, expected, damping = descent.damped_step(models, now, stage, damping, self.limits)
                except SolveError as error:
                    self.failure = error
                    return best, Status.SINGULAR
                # The time was up before all dampings were tried; the check above ends the descent.
                if after is now and damping <= descent.DAMPING[2]:
                    continue
                decrease, now = now.value - after.value, after
                self._record(now, number)
                if (now.folds, now.sharp) < (best.folds, best.sharp):
                    best = now
                small = self.limits.slack * stage.tolerance * now.value
                calm = calm + 1 if decrease <= small else 0
                if damping >= stage.hard:
                    break
                if calm == 2 or (calm and expected <= small) or now.value <= zero:
                    status = Status.MINIMUM
                    break
            v = now.v
        return best, status

    def _record(self, state: State, number: int) -> None:
        self.steps[number] += 1
        if number == 0:
            self.history.append(state.terms)


def keeping(problem: Problem, least: State) -> float:
    """The weight of E_size of the second descent; 0 where it would change nothing."""
    change = float(((least.length - problem.rest) ** 2 / problem.mass).sum())
    wanted = problem.weights.keep_size * least.terms["objective"]
    return wanted / change if wanted > rounding(problem) and change > 0.0 else 0.0


Solver = Callable[[Problem, Limits, Optional[Round]], Round]

SOLVERS: dict[str, Solver] = {"newton": newton, "paper": paper}
