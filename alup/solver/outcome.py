# SPDX-License-Identifier: GPL-2.0-or-later
"""The types that every solver of a round takes and returns: `Limits`, and a `Round` with its `Status`.

This module also has the checks that all solvers make: whether an energy is zero to rounding, and whether
results are finite.
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
from ..geometry.arrays import Array, Floats
from ..messages.errors import SolveError
from ..messages.language import N_
from ..messages.language import translate as _

NOT_FINITE = N_(
    "The equations have no solution in finite numbers. Move the handles less far, or add one to every part."
)

# Energies up to this count as zero.  `rounding` adds the rounding of the problem's own numbers.
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
    stop : called repeatedly; it returns true if the result is no longer needed
    """

    iterations: int = 100
    decrease: float = 1e-4
    step: float = 1e-4
    deadline: float = math.inf
    slack: float = 1.0
    stop: Callable[[], bool] | None = None

    @property
    def over(self) -> bool:
        """Whether the time is up, or the result is no longer needed."""
        return not self.leave(0.0)

    def leave(self, seconds: float) -> bool:
        """Whether more than `seconds` are left, as a factorisation that can't be interrupted needs them.

        False if the result is no longer needed.
        """
        if self.stop is not None and self.stop():
            return False
        return time.monotonic() + seconds < self.deadline


DEFAULT_LIMITS = Limits()


@dataclass(frozen=True)
class Round:
    """The result of a round.

    positions : (N, 2) in the problem's units; history : every term before and after each iteration
    coarse : iterations on coarser levels; keep : the weight of E_size that keeps sizes, see `newton`
    start, structures : start positions, and matrix patterns of each level, for another round of the same
        graph
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
        """The round with its structures, but without its result as a guess of the next one."""
        return replace(self, start=np.zeros((0, 2)))


def unsolved(problem: Problem) -> Round:
    """The result of a round for which there was no time: its start."""
    return Round(problem.start, Status.TIME, 0, (start_terms(problem),), start=problem.start)


def start_terms(problem: Problem) -> dict[str, float]:
    """Every term at the start.  Raises SolveError if the energy is not finite."""
    terms = energy.terms(problem, problem.start)
    if not math.isfinite(terms["objective"]):
        raise SolveError(_(NOT_FINITE))
    return terms


def rounding(problem: Problem) -> float:
    """The energy that rounding leaves where the exact energy is zero.

    Positions have an error of half an eps of the largest coordinate.  A residual depends on four of them, at
    lengths of about 1.
    """
    p, w = problem, problem.weights
    largest = max(1.0, np.abs(p.start).max(initial=0.0), np.abs(p.targets).max(initial=0.0))
    terms = (
        2.0 * w.straight * len(p.straight) + w.handle * len(p.handles) + (w.normal + w.edge) * len(p.edges)
    )
    return max(ROUNDING, float(terms * (2.0 * np.finfo(float).eps * largest) ** 2))


def finite(values: Array) -> Array:
    """The values.  Raises SolveError if one of them is not finite."""
    if not np.isfinite(values).all():
        raise SolveError(_(NOT_FINITE))
    return values
