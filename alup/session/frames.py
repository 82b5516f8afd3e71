# SPDX-License-Identifier: GPL-2.0-or-later
"""Moving frames: what a drag shows between two answers, from the frame before it.

An answer is a minimum, found from the input by way of coarse levels.  That takes tenths of a second, which is
long while the hand moves.  A frame begins at the frame before it: its core round at the last core round, its
final round at its own core round.  Each takes one step of Newton's method, more where the handles jump.
(Final rounds that began at the last final round were no nearer to the answer.)

An answer takes two things from its coarse levels: how strongly sizes are kept, and which ties let go.  A
frame takes them from one coarse level that follows the handles as well, with all ties and without keeping
sizes. (When ties let go by their strain in the last frame, they let go more and more, and shapes were wrong
by ten times as much.)

So a frame is near the answer for the same handles, but not equal to it, and depends on the way of the drag.
When the hand rests, an answer replaces it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..energy.objective import Structure
from ..energy.problem import Problem, let_go
from ..messages.errors import SolveError
from ..messages.language import translate as _
from ..model import Array, Refitted
from ..refit.frozen_fit import FrozenFit
from ..refit.refit import Fitted, Refit
from ..solver.coarse_levels import Level, coarsen
from ..solver.descent import follow
from ..solver.minimise import SMALLEST, keeping
from ..solver.newton import Newton
from ..solver.outcome import NOT_FINITE
from ..solver.straight_runs import StraightRuns
from .rounds import Rounds, Solved

# Handles that are farther from where they were, of the diagonal, are not followed: an answer takes as long.
FARTHEST = 0.25

# Of the tolerance, for the first frame's coarse level.
BEGINNING = 0.05

# Rounds of dividing when a kept fit no longer serves; each takes as long as some frames.
DIVISIONS = 1

# A fit is kept for so many frames at least, so that one frame in twenty can be slow.
PATIENCE = 20


class _Guide:
    """A coarse level of the core round, followed with all its ties and without keeping sizes."""

    def __init__(self, core: Array):
        """Begin where the core round (n, 2), user units, is."""
        self._core = core
        self._of: Problem | None = None
        self._level: Level | None = None
        self._models: Newton | None = None
        self._v = core

    def followed(self, core: Problem, tolerance: float) -> tuple[float, Array]:
        """The weight of E_size, and the weights of the ties, (T,), for a core round.

        tolerance : user units, see `descent.follow`
        """
        first = self._of is None
        if self._of is None or self._of.tie_vector is not core.tie_vector:
            self._level = coarsen(core) if len(core.start) > SMALLEST else None
        coarse = core if self._level is None else replace(self._level.problem, targets=core.targets)
        before = self._models
        known = (before.structure, before.runs) if before is not None else (None, None)
        self._models = models = Newton(coarse, *known)
        if first:
            v = core.from_user(self._core)
            self._v = v if self._level is None else v[self._level.kept]
        self._of = core
        # What an answer has settled it has not with all ties; the first frame may take its time.
        self._v = follow(
            models, self._v, BEGINNING * tolerance / core.scale if first else tolerance / core.scale
        )
        least = models.objective.state(self._v, 0.0)
        fine = self._v if self._level is None else self._level.prolongations(self._v)[-1]
        return keeping(coarse, least), let_go(core, fine)


class Frames:
    """The frames from one answer to the next, of ALUP by solver "newton"."""

    def __init__(self, rounds: Rounds, refit: Refit, begin: Solved, fitted: Fitted):
        """Begin at an answer and its fit."""
        self._rounds, self._refit = rounds, refit
        self._core = begin.core
        self._targets = begin.targets
        self._guide = _Guide(begin.core)
        self._structures: list[Structure | None] = [rounds.structure(0), rounds.structure(1)]
        self._runs: dict[int, tuple[Array, StraightRuns]] = {}
        self._fitted = fitted
        self._kept = FrozenFit(fitted, refit, begin.moved)
        self._age = PATIENCE

    def near(self, targets: Array, diagonal: float) -> bool:
        """Whether targets (H, 2) are near enough to those of the last frame to be followed."""
        far = np.abs(targets - self._targets).max(initial=0.0)
        return bool(far <= FARTHEST * diagonal)

    def next(self, targets: Array, tolerance: float) -> tuple[Array, Refitted]:
        """The samples (N, 2) and the segments for targets (H, 2) near those of the last frame; user units.

        tolerance : see `descent.follow`
        Raises SolveError where the equations have no solution; then the frame before stands.
        """
        moved = self._followed(targets, tolerance)
        refitted = self._kept.refitted(moved)
        self._age += 1
        if not self._kept.covers(moved) or (self._age > PATIENCE and refitted.error > self._kept.allowed):
            self._age = 0
            self._fitted = self._refit.fitted(moved, self._fitted, DIVISIONS)
            self._kept = FrozenFit(self._fitted, self._refit, moved)
            refitted = self._fitted.refitted
        return moved, refitted

    def _followed(self, targets: Array, tolerance: float) -> Array:
        core, of_part, growth = self._rounds.core(targets)
        models = self._models(core, 0)
        v = core.from_user(self._core)
        models.objective.hold(*self._guide.followed(core, tolerance))
        now = core.to_user(follow(models, v, tolerance / core.scale))
        final = now
        if self._rounds.number > 1:
            last = self._rounds.final(core, now, of_part, growth)
            models = self._models(last, 1)
            final = last.to_user(follow(models, last.from_user(final), tolerance / last.scale))
        if not np.isfinite(final).all():
            raise SolveError(_(NOT_FINITE))
        self._core, self._targets = now, targets
        return self._rounds.placed(self._rounds.mirrored(final, targets))

    def _models(self, problem: Problem, number: int) -> Newton:
        """The local models of a round, with what is known of its structure."""
        straight, runs = self._runs.get(number, (None, None))
        if straight is None or not np.array_equal(straight, problem.straight):
            runs = None
        structure = self._structures[number] or self._structures[0]
        if structure is not None and not structure.serves(problem):
            structure = None
        models = Newton(problem, structure, runs)
        self._structures[number] = models.structure
        self._runs[number] = (problem.straight, models.runs)
        return models
