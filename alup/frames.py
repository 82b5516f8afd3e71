"""Moving frames: what a drag shows between two answers, from the frame before it.

An answer is solved from the input, by way of coarse levels, to a minimum; a tenth of a second is long while
the hand moves.  A frame follows: its core round begins at the last frame's core, its final round at

    final + (core now - core),

the last frame's correction of the core carried along, and each takes one step of Newton's method, more where
the handles jump.  Sizes are kept as strongly as in the answer before, and ties let go by what the last frame
strains them.  So a frame is near the answer for the same handles, not equal to it, and depends on the way of
the drag; when the hand rests an answer takes its place.
"""

from __future__ import annotations

import numpy as np

from .errors import SolveError
from .keptfit import KeptFit
from .language import translate as _
from .model import Array
from .newton import Newton
from .objective import Structure
from .problem import Problem, let_go
from .refit import Fitted, Refit, Refitted
from .rounds import Rounds, Solved
from .runs import StraightRuns
from .solve import NOT_FINITE, follow

# Handles that are farther from where they were, of the diagonal, are not followed: an answer takes as long.
FARTHEST = 0.25

# Rounds of dividing when a kept fit no longer serves; each takes as long as some frames.
DIVISIONS = 1

# A fit is kept for so many frames at least, so that one frame in twenty can be slow.
PATIENCE = 20


class Frames:
    """The frames from one answer to the next, of ALUP by solver "newton"."""

    def __init__(self, rounds: Rounds, refit: Refit, begin: Solved, fitted: Fitted):
        """Begin at an answer and its fit."""
        self._rounds, self._refit = rounds, refit
        self._core, self._final = begin.core, begin.final
        self._targets = begin.targets
        self._keep = begin.rounds[0].keep if begin.rounds else 0.0
        self._structures: list[Structure | None] = [rounds.structure(0), rounds.structure(1)]
        self._runs: dict[int, tuple[Array, StraightRuns]] = {}
        self._fitted = fitted
        self._kept = KeptFit(fitted, refit, begin.moved)
        self._age = PATIENCE

    def near(self, targets: Array, diagonal: float) -> bool:
        """Whether targets (H, 2) are near enough to those of the last frame to be followed."""
        far = np.abs(targets - self._targets).max(initial=0.0)
        return bool(far <= FARTHEST * diagonal)

    def next(self, targets: Array, tolerance: float) -> tuple[Array, Refitted]:
        """The samples (N, 2) and the segments for targets (H, 2) near those of the last frame; user units.

        tolerance : see `solve.follow`
        Raises SolveError where the equations have no solution; then the frame before stands.
        """
        moved = self._followed(targets, tolerance)
        refitted = self._kept.refitted(moved)
        self._age += 1
        if not self._kept.covers(moved) or (self._age > PATIENCE and refitted.error > self._kept.allowed):
            self._age = 0
            self._fitted = self._refit.fitted(moved, self._fitted, DIVISIONS)
            self._kept = KeptFit(self._fitted, self._refit, moved)
            refitted = self._fitted.refitted
        return moved, refitted

    def _followed(self, targets: Array, tolerance: float) -> Array:
        core, of_part, growth = self._rounds.core(targets)
        models = self._models(core, 0)
        v = core.from_user(self._core)
        models.objective.keep = self._keep
        models.objective.tie_weight = let_go(core, v)
        now = core.to_user(follow(models, v, tolerance / core.scale))
        final = self._final + (now - self._core)
        if self._rounds.number > 1:
            last = self._rounds.final(core, now, of_part, growth)
            models = self._models(last, 1)
            final = last.to_user(follow(models, last.from_user(final), tolerance / last.scale))
        if not np.isfinite(final).all():
            raise SolveError(_(NOT_FINITE))
        self._core, self._final, self._targets = now, final, targets
        return self._rounds.placed(final)

    def _models(self, problem: Problem, number: int) -> Newton:
        """The local models of a round, with what is known of its structure."""
        straight, runs = self._runs.get(number, (None, None))
        if straight is None or not np.array_equal(straight, problem.straight):
            runs = None
        structure = self._structures[number] or self._structures[0]
        models = Newton(problem, structure, runs)
        self._structures[number] = models.structure
        self._runs[number] = (problem.straight, models.runs)
        return models
