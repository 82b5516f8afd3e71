"""One round of a solver: status, iterations and the history of every energy term.

`paper` is the scheme of Sec. 3.3.2 and 3.4 as it is published.  Another minimiser of the same
terms is a function of the same form, listed in `SOLVERS`.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Callable

import numpy as np

from . import energy
from .alternation import Alternation
from .model import Array
from .problem import Problem

# What rounding leaves of the energy where it is zero, per drawing of any size: squares of 1e-15
# times w_s times the number of turns.
ROUNDING = 1e-20


class Status(enum.Enum):
    """Why a round ended."""

    UNMOVED = "the start already meets the handles and its energy is zero"
    DECREASE = "the energy fell by less than the tolerance"
    STEP = "no vertex moved by more than the tolerance"
    RISE = "the energy rose; the best state was kept"
    ITERATIONS = "the limit of iterations was reached"


@dataclass(frozen=True)
class Limits:
    """When a round stops (Sec. 3.4): iterations, least decrease of E_ALUP, least step in L_avg."""

    iterations: int = 100
    decrease: float = 1e-4
    step: float = 1e-4


@dataclass(frozen=True)
class Round:
    """positions : (N, 2) in the problem's units; history : every term, before and after each iteration."""

    positions: Array
    status: Status
    iterations: int
    history: tuple[dict[str, float], ...]


def paper(problem: Problem, limits: Limits = Limits()) -> Round:
    """The paper's alternating least squares, stopped by its four rules, the best state kept."""
    v, l = problem.start, problem.lengths
    history = [energy.terms(problem, v)]
    # Without a moved handle the input is the answer, exactly.
    if history[0]["objective"] <= ROUNDING:
        return Round(v, Status.UNMOVED, 0, tuple(history))
    steps = Alternation(problem)
    best, least = v, history[0]["alup"]
    status = Status.ITERATIONS
    for _ in range(limits.iterations):
        moved = steps.positions(v, l)
        l = steps.lengths(moved)
        history.append(energy.terms(problem, moved))
        now, before = history[-1]["alup"], history[-2]["alup"]
        largest = float(np.abs(moved - v).max())
        v = moved
        if now < least:
            best, least = v, now
        if now > before:
            status = Status.RISE
        elif before - now < limits.decrease:
            status = Status.DECREASE
        elif largest < limits.step:
            status = Status.STEP
        else:
            continue
        break
    return Round(best, status, len(history) - 1, tuple(history))


SOLVERS: dict[str, Callable[[Problem, Limits], Round]] = {"paper": paper}
