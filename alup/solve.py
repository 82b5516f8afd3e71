"""One round of a solver: status, iterations and the history of every energy term.

`newton` minimises F = E_ALUP + E_edge + E_comp to its (local) minimum; `paper` is the scheme of
Sec. 3.3.2 and 3.4 as it is published, for reference.  Another minimiser of the same terms is a
function of the same form, listed in `SOLVERS`.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, replace
from typing import Callable

import numpy as np

from . import energy
from .alternation import Alternation
from .model import Array
from .newton import Newton
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
    steps = Alternation(problem)
    for _ in range(min(ALTERNATIONS, limits.iterations)):
        v = steps.positions(v, l)
        l = steps.lengths(v)
        history.append(energy.terms(problem, v))
    models = Newton(problem)
    v, status = _minimise(problem, models, v, STAGES, history, limits, problem.weights.size)
    sizes = replace(problem, weights=replace(problem.weights, size=1.0))
    change = energy.size(sizes, v)
    factor = problem.weights.keep_size * energy.objective(problem, v) / change if change > 0.0 else 0.0
    if problem.weights.size == 0.0 and factor * change > ROUNDING and len(history) <= limits.iterations:
        problem = replace(problem, weights=replace(problem.weights, size=factor))
        models.problem = problem
        v, status = _minimise(problem, models, v, STAGES[-1:], history, limits, 0.0)
    return Round(v, status, len(history) - 1, tuple(history))


def _minimise(
    problem: Problem,
    models: Newton,
    v: Array,
    stages: tuple[tuple[float, float], ...],
    history: list[dict[str, float]],
    limits: Limits,
    shown_size: float,
) -> tuple[Array, Status]:
    """Descend from v; the state with the least energy of those seen, and why it ended there.

    history : is given every term after each step; E_size has the weight that the round began with
    """
    best, least = v, energy.objective(problem, v)
    shown = replace(problem, weights=replace(problem.weights, size=shown_size))
    v = models.runs.retract(v)
    status = Status.ITERATIONS
    for softness, tolerance in stages:
        damping = DAMPING[0]
        now = energy.objective(problem, v, softness)
        while len(history) <= limits.iterations:
            models.model(v, softness)
            trial, value, damping = _descend(problem, models, v, now, softness, damping)
            decrease, v, now = now - value, trial, value
            history.append(energy.terms(shown, v))
            sharp = energy.objective(problem, v)
            if sharp < least:
                best, least = v, sharp
            status = Status.ITERATIONS
            if decrease <= tolerance * now or now <= ROUNDING:
                status = Status.MINIMUM
                break
    return best, status


def _descend(
    problem: Problem, models: Newton, v: Array, now: float, softness: float, damping: float
) -> tuple[Array, float, float]:
    """One step that does not raise F: the new positions, F there, and the next damping."""
    while damping <= DAMPING[2]:
        trial = models.moved(v, models.step(damping))
        value = energy.objective(problem, trial, softness)
        if value <= now:
            return trial, value, max(damping / DAMPING_FALL, DAMPING[1])
        damping *= DAMPING_RISE
    return v, now, damping  # nothing lowers F: a minimum to rounding


Solver = Callable[[Problem, Limits], Round]

SOLVERS: dict[str, Solver] = {"newton": newton, "paper": paper}
