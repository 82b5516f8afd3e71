"""One round of a solver: status, iterations and the history of every energy term.

`newton` minimises F = E_ALUP + E_edge + E_comp to its (local) minimum; `paper` is the scheme of
Sec. 3.3.2 and 3.4 as it is published, for reference.  Another minimiser of the same terms is a
function of the same form, listed in `SOLVERS`.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Callable

import numpy as np

from . import energy
from .alternation import Alternation
from .model import Array
from .newton import Newton
from .objective import State
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
    MINIMUM = "the energy is at a minimum to the tolerance"
    ITERATIONS = "the limit of iterations was reached"


@dataclass(frozen=True)
class Limits:
    """When a round stops.

    decrease, step : of `paper` (Sec. 3.4): least decrease of E_ALUP, least step in L_avg
    """

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


DEFAULT_LIMITS = Limits()

# Alternations before Newton's method: after one, an edge in thirty is still on the wrong side, after
# five none is on any case tried; more only cost time.
ALTERNATIONS = 5

# Softness of the kink and relative decrease of F that ends the stage.
STAGES = ((0.1, 1e-4), (0.003, 1e-6))

# Relative damping at the start, least and most; how it falls after a success and rises after a failure.
DAMPING = (1e-3, 1e-12, 1e8)
DAMPING_FALL, DAMPING_RISE = 4.0, 8.0


def paper(problem: Problem, limits: Limits = DEFAULT_LIMITS) -> Round:
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
        else:
            continue
        break
    return Round(best, status, len(history) - 1, tuple(history))


def newton(problem: Problem, limits: Limits = DEFAULT_LIMITS) -> Round:
    """Some alternations, then Newton's method on F, its kink first rounded (see `alup.newton`).

    F does not fix sizes: of all shapes that are distorted next to nothing its minimum may be one that grew a
    head, far from any handle.  (The paper's scheme stops before it gets there.)  So a second descent
    minimises F + w sum (l - l0)^2 with w = keep_size F0 / S0, F0 and S0 being F and the sum at F's minimum.
    By its own minimality it raises F to (1 + keep_size) F0 at most, and where the handles allow
    a shape without distortion, F0 = 0, it changes nothing.
    """
    v, l = problem.start, problem.lengths
    history = [energy.terms(problem, v)]
    if history[0]["objective"] <= ROUNDING:
        return Round(v, Status.UNMOVED, 0, tuple(history))
    models = Newton(problem)
    steps = Alternation(problem)
    for _ in range(min(ALTERNATIONS, limits.iterations)):
        v = steps.positions(v, l)
        l = steps.lengths(v)
        history.append(models.objective.state(v, 0.0).terms)
    best, status = _minimise(models, v, STAGES, history, limits, 0.0)
    change = float(((best.length - problem.lengths) ** 2).sum())
    weight = problem.weights.keep_size * best.terms["objective"] / change if change > 0.0 else 0.0
    if problem.weights.size == 0.0 and weight * change > ROUNDING and len(history) <= limits.iterations:
        best, status = _minimise(models, best.v, STAGES[-1:], history, limits, weight)
    return Round(best.v, status, len(history) - 1, tuple(history))


def _minimise(
    models: Newton,
    v: Array,
    stages: tuple[tuple[float, float], ...],
    history: list[dict[str, float]],
    limits: Limits,
    keep: float,
) -> tuple[State, Status]:
    """Descend from v; the state with the least energy of those seen, and why it ended there.

    keep : added to the weight of E_size; history : is given every term after each step, without it
    """
    models.objective.keep = keep
    best = models.objective.state(v, 0.0)
    v = models.runs.retract(v)
    status = Status.ITERATIONS
    for softness, tolerance in stages:
        damping = DAMPING[0]
        now = models.objective.state(v, softness)
        while len(history) <= limits.iterations:
            models.model(now, softness)
            trial, damping = _descend(models, now, softness, damping)
            decrease, now = now.value - trial.value, trial
            history.append(now.terms)
            if now.sharp < best.sharp:
                best = now
            status = Status.ITERATIONS
            if decrease <= tolerance * now.value or now.value <= ROUNDING:
                status = Status.MINIMUM
                break
        v = now.v
    return best, status


def _descend(models: Newton, now: State, softness: float, damping: float) -> tuple[State, float]:
    """One step that does not raise F: the new state and the next damping."""
    while damping <= DAMPING[2]:
        trial = models.objective.state(models.moved(now.v, models.step(damping)), softness)
        if trial.value <= now.value:
            return trial, max(damping / DAMPING_FALL, DAMPING[1])
        damping *= DAMPING_RISE
    return now, damping  # nothing lowers F: a minimum to rounding


Solver = Callable[[Problem, Limits], Round]

SOLVERS: dict[str, Solver] = {"newton": newton, "paper": paper}
