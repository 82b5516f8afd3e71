# SPDX-License-Identifier: GPL-2.0-or-later
"""One round of a solver: status, iterations and the history of every energy term.

`newton` minimises F = E_ALUP + E_edge + E_ties + E_size to a local minimum.  `paper` is the scheme of
Sec. 3.3.2 and 3.4 as it is published, for reference.  Another minimiser of the same terms is a
function of the same form, listed in `SOLVERS`.
"""

from __future__ import annotations

import enum
import math
import time
from dataclasses import dataclass, field, replace
from typing import Callable, Optional

import numpy as np

from ..energy import terms as energy
from ..energy.objective import State, Structure
from ..energy.problem import Problem, let_go
from ..geometry.arrays import Array, Floats
from ..geometry.connected_components import components
from ..messages.errors import SolveError
from ..messages.language import N_
from ..messages.language import translate as _
from .alternation import Alternation
from .coarse_levels import coarsen
from .newton import Newton

NOT_FINITE = N_(
    "The equations have no solution in finite numbers. Move the handles less far, or add one to every part."
)

# Energies up to this count as zero in any units; `_rounding` has what the problem's own numbers add.
ROUNDING = 1e-20


class Status(enum.Enum):
    """Why a round ended."""

    UNMOVED = "the start already meets the handles and its energy is zero"
    DECREASE = "the energy fell by less than the tolerance"
    STEP = "no vertex moved by more than the tolerance"
    RISE = "the energy rose; the best state was kept"
    MINIMUM = "the energy is at a minimum to the tolerance"
    ITERATIONS = "the limit of iterations was reached"
    TIME = "the time limit was reached; the best state so far was kept"
    SINGULAR = "the equations of a step could not be solved; the best state so far was kept"


@dataclass(frozen=True)
class Limits:
    """When a round stops.

    deadline : on the clock of `time.monotonic`; slack : factor of the decreases of F that end Newton's method
    decrease, step : of `paper` (Sec. 3.4): least decrease of E_ALUP, least step in L_avg
    stop : asked now and then, whether nobody waits for the result any more
    """

    iterations: int = 100
    decrease: float = 1e-4
    step: float = 1e-4
    deadline: float = math.inf
    slack: float = 1.0
    stop: Callable[[], bool] | None = None

    @property
    def over(self) -> bool:
        """Whether the time is up, or nobody waits any more."""
        return not self.leave(0.0)

    def leave(self, seconds: float) -> bool:
        """Whether there are more than so many seconds left: a factorisation can't be interrupted.

        There are none where nobody waits any more.
        """
        if self.stop is not None and self.stop():
            return False
        return time.monotonic() + seconds < self.deadline


@dataclass(frozen=True)
class Round:
    """positions : (N, 2) in the problem's units; history : every term, before and after each iteration.

    coarse : iterations on coarser levels; keep : the weight of E_size that keeps sizes, see `newton`
    start, structures : for another round of the same graph, the latter of each level
    """

    positions: Floats
    status: Status
    iterations: int
    history: tuple[dict[str, float], ...]
    coarse: int = 0
    keep: float = 0.0
    start: Floats = field(default_factory=lambda: np.zeros((0, 2)), repr=False)
    structures: tuple[Structure, ...] = field(default=(), repr=False)

    @property
    def pattern_alone(self) -> Round:
        """A round that hands on its structures, but not its result as a guess."""
        return replace(self, start=np.zeros((0, 2)))


DEFAULT_LIMITS = Limits()

# Alternations before Newton's method, where the handles have far to go.  After one alternation an edge in
# thirty still points backwards; after five none does in any case tried.  More of them only cost time.
ALTERNATIONS = 5

# A level of so few samples is not coarsened further.  Chosen by looking at the cases.
SMALLEST = 200


@dataclass(frozen=True)
class Stage:
    """A descent: its softness, its tolerance, its most steps, and whether straight runs are retracted.

    It ends at a step that lowers F by less than `tolerance` of F, if the step's model expected no more.  In a
    stiff valley models always expect more; there it ends at the second such step in a row.
    hard : a step that lowered F only with so much damping ends it as well
    """

    softness: float
    tolerance: float
    most: int
    retracted: bool = True
    hard: float = math.inf


# The kink of max(1, l^2) is rounded much at first, then little.  Coarse levels only have to find the right
# valley, so their tolerances are large.  The values were chosen by looking at the cases.
COARSE = (Stage(0.1, 1e-2, 25), Stage(0.003, 1e-3, 25))
FINE = (Stage(0.1, 1e-4, 10**6), Stage(0.003, 1e-5, 10**6))
RELEASED = Stage(0.003, 1e-5, 10**6, retracted=False)

# The descent with straight lines kept straight, before RELEASED lets them bend.  Most drawings are near F's
# minimum after ten steps of it.  Where handles bend a line, the least F among straight lines is far above the
# minimum, and steps creep towards it along a stiff valley; hence the limits.
STRAIGHT = replace(FINE[-1], most=40, hard=0.1)

# Most steps of `follow`: handles that jump by the size of the drawing need so many.
MOST_FOLLOWING = 10

# Dampings that `follow` tries for one step.  At a minimum none lowers F, and a frame has no time for more.
TRIES = 3

# Relative damping: first, least and greatest.  It is divided by DAMPING_FALL after a step that is taken, and
# multiplied by DAMPING_RISE after one that is refused.  Chosen by looking at the cases.
DAMPING = (1e-3, 1e-12, 1e8)
DAMPING_FALL, DAMPING_RISE = 4.0, 8.0


def paper(problem: Problem, limits: Limits = DEFAULT_LIMITS, _before: Optional[Round] = None) -> Round:
    """Eq. 18: E'_ALUP by alternating least squares, stopped by the paper's four rules, the best state kept.

    Raises SolveError where the equations have no solution.
    """
    v, l = problem.start, problem.lengths
    history = [_start_terms(problem)]
    # Without a moved handle the input is the answer, exactly.
    if history[0]["objective"] <= _rounding(problem):
        return Round(v, Status.UNMOVED, 0, tuple(history))
    steps = Alternation(problem)
    best, least = v, history[0]["alup"]
    if not _affordable(steps, limits):
        return Round(best, Status.TIME, 0, tuple(history))
    status = Status.ITERATIONS
    for _iteration in range(limits.iterations):
        moved = steps.positions(v, l)
        l = steps.lengths(moved)
        if not (np.isfinite(moved).all() and np.isfinite(l).all()):
            if best is problem.start:
                raise SolveError(_(NOT_FINITE))
            status = Status.SINGULAR
            break
        history.append(energy.terms(problem, moved))
        now, before = history[-1]["alup"], history[-2]["alup"]
        largest = float(np.linalg.norm(moved - v, axis=1).max())
        v = moved
        if now < least:
            best, least = v, now
        if now > before:
            status = Status.RISE
        elif before - now < limits.decrease:
            status = Status.DECREASE
        elif largest < limits.step:
            status = Status.STEP
        elif not limits.leave(steps.seconds):
            status = Status.TIME
        else:
            continue
        break
    return Round(best, status, len(history) - 1, tuple(history))


def newton(problem: Problem, limits: Limits = DEFAULT_LIMITS, before: Optional[Round] = None) -> Round:
    """Newton's method on F, from the minimum of a coarser level (see `alup.solver.newton`,
    `alup.solver.coarse_levels`).

    F is nearly blind to size, so its minimum may inflate a part that is far from all handles.  (The paper's
    scheme stops before it gets there.)  Therefore a second descent minimises F + w S, S = sum (l - l0)^2,
    with w = keep_size F0 / S0, where F0 and S0 are the values at F's minimum.  Its minimum has an F of at
    most (1 + keep_size) F0.  Where the handles allow a shape without distortion, F0 is 0 and nothing changes.

    before : a round of the same graph, whose matrix patterns are used again.  If it began at the same start,
        its result is tried as a start of this one
    Raises SolveError where the equations have no solution from the very start.
    """
    start = _start_terms(problem)
    known = before.structures if before is not None else ()
    if start["objective"] <= _rounding(problem):
        return Round(problem.start, Status.UNMOVED, 0, (start,), structures=known)
    along = _along(problem)
    terms = energy.terms(problem, along) if along is not None else start
    if along is not None and terms["objective"] <= _rounding(problem):
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


def unsolved(problem: Problem) -> Round:
    """A round for which there was no time: its start."""
    return Round(problem.start, Status.TIME, 0, (_start_terms(problem),), start=problem.start)


def follow(models: Newton, v: Array, tolerance: float) -> Array:
    """Positions (N, 2) near the minimum, by Newton steps from v, the minimum for slightly different targets.

    tolerance : L_avg; a step that moves no sample further is the last one.  Each step of Newton's method is
    of
        the order of the square of the one before it, so the distance that is left is much less.
    Raises SolveError where the equations have no solution.
    """
    softness = FINE[-1].softness
    now, damping = models.objective.state(v, softness), DAMPING[0]
    for _number in range(MOST_FOLLOWING):
        models.model(now, softness)
        for _try in range(TRIES):
            step = _finite(models.step(damping))
            # With lines retracted and without, whichever is lower: lines that turn stay straight, lines that
            # handles bend may bend.
            ways = (False, True) if len(models.runs.inner) else (False,)
            trials = [models.objective.state(models.moved(now.v, step, way), softness) for way in ways]
            after = min(trials, key=lambda state: (state.folds, state.value))
            if after.value <= now.value and after.folds <= now.folds:
                break
            damping *= DAMPING_RISE
        else:
            return now.v
        largest = np.abs(after.v - now.v).max(initial=0.0)
        now, damping = after, max(damping / DAMPING_FALL, DAMPING[1])
        if largest <= tolerance:
            break
    return now.v


def _start_terms(problem: Problem) -> dict[str, float]:
    """Every term at the start.  Raises SolveError where it is no number: nothing compares with that."""
    terms = energy.terms(problem, problem.start)
    if not math.isfinite(terms["objective"]):
        raise SolveError(_(NOT_FINITE))
    return terms


def _along(problem: Problem) -> Array | None:
    """Positions with every part shifted as its handles are; None where handles of one part move
    differently.
    """
    p = problem
    joined = np.concatenate([p.edges, *(p.tie_samples[:, [n, n + 1]] for n in range(3))])
    count, label = components(joined, len(p.start))
    at = label[p.handles]
    handles = np.maximum(np.bincount(at, minlength=count), 1)
    moves = p.targets - p.start[p.handles]
    mean = np.stack([np.bincount(at, move, minlength=count) / handles for move in moves.T], axis=1)
    # The handles' energy alone tells; the other terms are evaluated only where they move alike.
    if p.weights.handle * float(((moves - mean[at]) ** 2).sum()) > _rounding(p):
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
        stages = COARSE if number else FINE
        last = stages[-1:] if number or not len(models.runs.inner) else (STRAIGHT, RELEASED)
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
            if not _affordable(steps, self.limits):
                return self._best(models, [v], number)
            for step in range(min(ALTERNATIONS, self.limits.iterations)):
                if step and not self.limits.leave(steps.seconds):
                    return self._best(models, [problem.start, v], number)
                moved = steps.positions(v, l)
                l = _finite(steps.lengths(_finite(moved)))
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
        status, zero = Status.ITERATIONS, _rounding(models.problem)
        for stage in stages:
            damping, calm = DAMPING[0], 0
            now = models.objective.state(v, stage.softness)
            for _number in range(stage.most):
                if not self.limits.leave(models.seconds):
                    return best, Status.TIME
                if self.steps[number] >= self.limits.iterations:
                    status = Status.ITERATIONS
                    break
                models.model(now, stage.softness)
                try:
                    after, expected, damping = _step(models, now, stage, damping, self.limits)
                except SolveError as error:
                    self.failure = error
                    return best, Status.SINGULAR
                if after is now and damping <= DAMPING[2]:  # the time is up: more damping was not tried
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


def _affordable(steps: Alternation, limits: Limits) -> bool:
    """Whether there is time for the first alternation; what takes next to nothing is worth it in any case."""
    return steps.seconds == 0.0 or limits.leave(steps.seconds)


def _rounding(problem: Problem) -> float:
    """What rounding leaves of the energy where it is zero.

    Positions are known to half an eps of the largest, and a residual is made of four, at lengths about 1.
    """
    p, w = problem, problem.weights
    largest = max(1.0, np.abs(p.start).max(initial=0.0), np.abs(p.targets).max(initial=0.0))
    terms = (
        2.0 * w.straight * len(p.straight) + w.handle * len(p.handles) + (w.normal + w.edge) * len(p.edges)
    )
    return max(ROUNDING, float(terms * (2.0 * np.finfo(float).eps * largest) ** 2))


def keeping(problem: Problem, least: State) -> float:
    """The weight of E_size of the second descent; 0 where it would change nothing."""
    change = float(((least.length - problem.rest) ** 2 / problem.mass).sum())
    wanted = problem.weights.keep_size * least.terms["objective"]
    return wanted / change if wanted > _rounding(problem) and change > 0.0 else 0.0


def _step(
    models: Newton, now: State, stage: Stage, damping: float, limits: Limits = DEFAULT_LIMITS
) -> tuple[State, float, float]:
    """One step that does not raise F: the new state, the decrease its model expects, the next damping.

    Where the time is up after a refused step, or nothing lowers F, it is the state that there was.

    A step that folds an edge back is refused like one that raises F.  Equations that have no solution are
    tried again with more damping; raises SolveError when no damping gives them one.
    """
    folds = now.folds
    failure: Optional[SolveError] = None
    solved = False
    while damping <= DAMPING[2] and not (solved and not limits.leave(models.seconds)):
        try:
            step = _finite(models.step(damping))
        except SolveError as error:
            failure = error
            damping *= DAMPING_RISE
            continue
        solved = True
        trial = models.objective.state(models.moved(now.v, step, stage.retracted), stage.softness)
        if trial.value <= now.value and trial.folds <= folds:
            expected = -float(np.vdot(models.gradient, step))
            return trial, expected, max(damping / DAMPING_FALL, DAMPING[1])
        damping *= DAMPING_RISE
    if failure is not None and not solved:
        raise failure
    return now, 0.0, damping  # nothing lowers F: a minimum to rounding


def _finite(values: Array) -> Array:
    """The values; raises SolveError if one of them is not a number."""
    if not np.isfinite(values).all():
        raise SolveError(_(NOT_FINITE))
    return values


Solver = Callable[[Problem, Limits, Optional[Round]], Round]

SOLVERS: dict[str, Solver] = {"newton": newton, "paper": paper}
