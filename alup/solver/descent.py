# SPDX-License-Identifier: GPL-2.0-or-later
"""Damped Newton steps: the stages of a descent, one step that does not raise F, tracking of a minimum."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Optional

import numpy as np

from ..energy.objective import State
from ..geometry.arrays import Array
from ..messages.errors import SolveError
from .newton import Newton
from .outcome import DEFAULT_LIMITS, Limits, finite


@dataclass(frozen=True)
class Stage:
    """The parameters of a descent.

    softness : of the kink of max(1, l^2); most : greatest number of steps; retracted : whether straight runs
        are
    tolerance : the descent ends at a step that lowers F by less than this part of F, if the step's model
        expected no more.  In a stiff valley models always expect more; there it ends at the second such step
        in a row.
    hard : a step that needed at least this damping ends the descent as well
    """

    softness: float
    tolerance: float
    most: int
    retracted: bool = True
    hard: float = math.inf


# The kink of max(1, l^2) is strongly rounded at first, then slightly.  Coarse levels only have to find the
# right valley, so their tolerances are large.  The values were chosen by looking at the cases.
COARSE = (Stage(0.1, 1e-2, 25), Stage(0.003, 1e-3, 25))
FINE = (Stage(0.1, 1e-4, 10**6), Stage(0.003, 1e-5, 10**6))
RELEASED = Stage(0.003, 1e-5, 10**6, retracted=False)

# The descent with straight lines kept straight, before RELEASED lets them bend.  Most drawings are near F's
# minimum after ten steps of it.  Where handles bend a line, the least F among straight lines is far above the
# minimum, and steps creep towards it along a stiff valley; hence the limits.
STRAIGHT = replace(FINE[-1], most=40, hard=0.1)

# Relative damping: first, least and greatest.  It is divided by DAMPING_FALL after a step that is taken, and
# multiplied by DAMPING_RISE after one that is refused.  Chosen by looking at the cases.
DAMPING = (1e-3, 1e-12, 1e8)
DAMPING_FALL, DAMPING_RISE = 4.0, 8.0

# Greatest number of steps of `follow`.  Handles that jump by the size of the drawing need this many.
MOST_FOLLOWING = 10

# Number of dampings that `follow` tries for a step.  At a minimum none lowers F, and a frame has no time for
# more.
TRIES = 3


def damped_step(
    models: Newton, now: State, stage: Stage, damping: float, limits: Limits = DEFAULT_LIMITS
) -> tuple[State, float, float]:
    """One step that does not raise F: the new state, the decrease that its model expects, the next damping.

    The state is returned unchanged if the time is up after a refused step, or if no damping lowers F.  A step
    that folds an edge back is refused like one that raises F.  Equations without a solution are tried again
    with more damping.  Raises SolveError if no damping gives a solution.
    """
    folds = now.folds
    failure: Optional[SolveError] = None
    solved = False
    while damping <= DAMPING[2] and not (solved and not limits.leave(models.seconds)):
        try:
            step = finite(models.step(damping))
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


def follow(models: Newton, v: Array, tolerance: float) -> Array:
    """Positions (N, 2) near the minimum, by Newton steps from v, the minimum for slightly different targets.

    tolerance : L_avg; a step that moves no sample farther is the last one.  The length of a Newton step is of
        the order of the square of the step before, so the remaining distance is much less than the tolerance.
    Raises SolveError if the equations have no solution.
    """
    softness = FINE[-1].softness
    now, damping = models.objective.state(v, softness), DAMPING[0]
    for _number in range(MOST_FOLLOWING):
        models.model(now, softness)
        for _try in range(TRIES):
            step = finite(models.step(damping))
            # The lower of two results is taken, with and without retraction.  So lines that turn stay
            # straight, and lines that handles bend may bend.
            retracted = (False, True) if len(models.runs.inner) else (False,)
            trials = [models.objective.state(models.moved(now.v, step, one), softness) for one in retracted]
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
