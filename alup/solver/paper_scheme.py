# SPDX-License-Identifier: GPL-2.0-or-later
"""The paper's scheme as published (Sec. 3.3.2 and 3.4): alternating least squares and four stopping rules.

It is kept for reference and for comparisons.
"""

from __future__ import annotations

from typing import Optional

import numpy as np

from ..energy import terms as energy
from ..energy.problem import Problem
from ..messages.errors import SolveError
from ..messages.language import translate as _
from .alternation import Alternation, affordable
from .outcome import DEFAULT_LIMITS, NOT_FINITE, Limits, Round, Status, rounding, start_terms


def paper(problem: Problem, limits: Limits = DEFAULT_LIMITS, _before: Optional[Round] = None) -> Round:
    """Eq. 18: E'_ALUP by alternating least squares, stopped by the paper's four rules, the best state kept.

    Raises SolveError where the equations have no solution.
    """
    v, l = problem.start, problem.lengths
    history = [start_terms(problem)]
    # Without a moved handle the input is the answer, exactly.
    if history[0]["objective"] <= rounding(problem):
        return Round(v, Status.UNMOVED, 0, tuple(history))
    steps = Alternation(problem)
    best, least = v, history[0]["alup"]
    if not affordable(steps, limits):
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
