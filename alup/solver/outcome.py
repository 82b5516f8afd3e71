# SPDX-License-Identifier: GPL-2.0-or-later
"""What every solver of a round takes and returns: `Limits` in, a `Round` with its `Status` out.

Beside them are the checks that all solvers make: whether an energy is zero to rounding, and whether results
are finite numbers.
"""

from __future__ import annotations

import enum
import math
import time
from dataclasses import dataclass, field, replace
from typing import Callable

import numpy as np

from ..energy import terms as energy
from ..energy.objective import Structure
from ..energy.problem import Problem
from ..geometry.arrays import Floats
from ..messages.errors import SolveError
from ..messages.language import N_
from ..messages.language import translate as _
from ..model import Array

NOT_FINITE = N_(
    "The equations have no solution in finite numbers. Move the handles less far, or add one to every part."
)

# Energies up to this count as zero in any units; `rounding` has what the problem's own numbers add.
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


DEFAULT_LIMITS = Limits()


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


def unsolved(problem: Problem) -> Round:
    """A round for which there was no time: its start."""
    return Round(problem.start, Status.TIME, 0, (start_terms(problem),), start=problem.start)


def start_terms(problem: Problem) -> dict[str, float]:
    """Every term at the start.  Raises SolveError where it is no number: nothing compares with that."""
    terms = energy.terms(problem, problem.start)
    if not math.isfinite(terms["objective"]):
        raise SolveError(_(NOT_FINITE))
    return terms


def rounding(problem: Problem) -> float:
    """What rounding leaves of the energy where it is zero.

    Positions are known to half an eps of the largest, and a residual is made of four, at lengths about 1.
    """
    p, w = problem, problem.weights
    largest = max(1.0, np.abs(p.start).max(initial=0.0), np.abs(p.targets).max(initial=0.0))
    terms = (
        2.0 * w.straight * len(p.straight) + w.handle * len(p.handles) + (w.normal + w.edge) * len(p.edges)
    )
    return max(ROUNDING, float(terms * (2.0 * np.finfo(float).eps * largest) ** 2))


def finite(values: Array) -> Array:
    """The values; raises SolveError if one of them is not a number."""
    if not np.isfinite(values).all():
        raise SolveError(_(NOT_FINITE))
    return values
