# SPDX-License-Identifier: GPL-2.0-or-later
"""Both rounds of the minimisation (Sec. 3.2.1), for one sampling and set of handles, whatever their targets.

What depends only on the drawing and on the held samples is computed once: which parts go along, their ties,
turns and straight lines, and the pattern of the matrices with its symbolic factorisation.  Every solution
begins at the input, and uses no values of an earlier solution.  So it is a function of the targets, to the
last bit, whatever was solved before.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from ..energy import problem
from ..energy.objective import Structure
from ..energy.problem import Problem
from ..handles.binding import Anchors
from ..model import Alignments, Array
from ..model import Ties as TieRecord
from ..network.sampling import Samples
from ..regular import keep, keep_lines, symmetry
from ..regular.find import Regular
from ..solver import minimise, outcome
from ..ties import ties
from .options import APART, HOLD_TOGETHER, Options

NAMES = ("core", "final", "regular")


@dataclass(frozen=True)
class Solved:
    """targets : (H, 2); moved : (N, 2) all samples, user units

    rounds : as they ended, core first; growth : see `ties.RoundTies`

    core : (n, 2) the samples that go along after the core round, user units
    """

    targets: Array
    moved: Array
    rounds: tuple[outcome.Round, ...]
    growth: float
    core: Array


@dataclass(frozen=True)
class _Asked:
    """The core round, and its ties, for the last targets, and for others that ask the ties for the same."""

    maps: ties.HandleMaps
    core: Problem
    of_part: TieRecord


class Rounds:
    """Both rounds of ALUP for samples and the handles on them, for any targets.

    held : (H,) samples that handles hold
    part : (N,) bool, the samples of the parts that go along; graph : of these alone
    facing, crossings, scaffold : numbers of ties; stays : number of parts that don't go along
    """

    def __init__(
        self,
        samples: Samples,
        label: Array,
        about: ties.Surroundings,
        crossed: Array,
        held: Array,
        page: Array | None,
        options: Options,
        regular: Regular | None = None,
    ):
        """Analyse samples with component labels (N,); see `ties.rest_ties` for the arguments."""
        self._samples, self._options, self.held, self._label = samples, options, held, label
        component, strength = options.weights.component, HOLD_TOGETHER[options.hold]
        self._rest = ties.rest_ties(samples, label, about, crossed, held, page, component, strength)
        goes = self._rest.held.copy()
        if options.hold != APART:
            goes |= ~self._rest.stays
        self.stays = int((~goes).sum())
        self.facing = self._rest.facing
        self.crossings = len(crossed)
        self.scaffold = len(self._rest.ties) - self.facing - self.crossings
        self.part = goes[label]
        self.graph = samples.part(self.part)
        self._number = np.cumsum(self.part) - 1
        self._tied = self.part[self._rest.ties.samples].all(axis=1)
        self._sized = self.part[samples.edges[:, 0]]
        self._analysis = problem.analyse(self.graph, self._number[held], options.weights)
        # Of the last solution: what it knows of the matrices' patterns serves the next one.
        self._patterns: list[outcome.Round | None] = [None, None, None]
        self._last: _Asked | None = None
        self.regular = regular
        mirrored = symmetry.SYMMETRY in options.regular and len(self.graph.points)
        self._mirrors = symmetry.find(self.graph.points) if mirrored else []
        self._mirrored_parts = symmetry.parts(samples.points, label) if mirrored else []

    def core(self, targets: Array) -> tuple[Problem, TieRecord, float]:
        """The core round for targets (H, 2), its ties, and the growth of everything."""
        maps = ties.handle_maps(self._rest, targets)
        if self._last is None or not self._last.maps.same(maps):
            tied = ties.ties_for(self._rest, maps)
            of_part = tied.ties.of(self._tied)
            of_part = replace(of_part, samples=self._number[of_part.samples])
            size, growth = tied.size[self._sized], tied.growth
            core = problem.core_problem(self._analysis, targets, of_part, size, growth)
            self._last = _Asked(maps, core, of_part)
        core = self._last.core
        return replace(core, targets=core.from_user(targets)), self._last.of_part, maps.growth

    def final(self, core: Problem, result: Array, of_part: TieRecord, growth: float) -> Problem:
        """The final round that follows a core round's result (n, 2), user units."""
        return problem.final_problem(core, result, self._analysis, of_part, growth)

    def mirrored(self, result: Array, targets: Array) -> Array:
        """A result (n, 2), symmetric where the input and the handles' moves are; targets : (H, 2)."""
        points, held = self.graph.points, self._number[self.held]
        diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
        for mirror in self._mirrors:
            if mirror.suits(held, targets - points[held], diagonal):
                result = points + mirror.mean(result - points)
        return result

    def _regular_round(self, final: Problem, positions: Array) -> Problem | None:
        """The round after the final one that brings what is no longer regular to its places.

        positions : (n, 2) the final round's result, problem units
        """
        points, targets = self._samples.points, final.to_user(final.targets)
        moved = self.placed(final.to_user(positions))
        if keep.is_stretch(points, moved):
            return None
        at, where = np.zeros(0, dtype=int), np.zeros((0, 2))
        if self.regular is not None:
            at, where = keep.places(self.regular, points, moved, self.held, targets)
        goes = self.part[at]
        aligned = self._aligned(moved)
        if not goes.any() and aligned is None:
            return None
        return problem.regular_problem(final, positions, self._number[at[goes]], where[goes], aligned)

    def _aligned(self, moved: Array) -> Alignments | None:
        """What lines and mirrored parts that go along are asked for; moved : (N, 2) after the rounds."""
        points = self._samples.points
        found, upright = [], None
        if self.regular is not None and len(self.regular.lines):
            diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
            lines = self.regular.lines
            wanted = keep_lines.Wanted(lines, points, moved, self.held, self._label, diagonal)
            found, upright = [wanted.alignments()], wanted.upright
        found.append(symmetry.alignments(self._mirrored_parts, points, moved, self.held, upright))
        asked = [one.of(self.part[one.samples].all(axis=1)) for one in found if one is not None]
        if not sum(len(one.length) for one in asked):
            return None
        together = Alignments.together(asked)
        return replace(together, samples=self._number[together.samples])

    def solve(self, anchors: Anchors, deadline: float | None = None) -> Solved:
        """Move the samples to the minimum of both rounds.  Raises SolveError as the solvers do.

        deadline : on the clock of `time.monotonic`; by default the time limit counts from now
        """
        options, solver = self._options, minimise.SOLVERS[self._options.solver]
        limits = replace(options.limits, deadline=deadline or time.monotonic() + options.time_limit)
        core, of_part, growth = self.core(anchors.targets)
        done = [solver(core, limits, self._patterns[0])]
        result = core.to_user(done[0].positions)
        if options.rounds > 1:
            final = self.final(core, result, of_part, growth)
            if limits.over:
                done.append(outcome.unsolved(final))
            else:
                done.append(solver(final, limits, self._patterns[1] or done[0]))
            result = final.to_user(done[1].positions)
            regular = None if limits.over else self._regular_round(final, done[1].positions)
            if regular is not None:
                done.append(solver(regular, limits, self._patterns[2] or done[1]))
                result = regular.to_user(done[2].positions)
        for number, one in enumerate(done):
            if one.structures:
                self._patterns[number] = one.pattern_alone
        still = all(one.status is outcome.Status.UNMOVED for one in done)
        moved = self._samples.points.copy() if still else self.placed(self.mirrored(result, anchors.targets))
        return Solved(anchors.targets, moved, tuple(done), growth, core.to_user(done[0].positions))

    @property
    def number(self) -> int:
        """How many rounds there are."""
        return self._options.rounds

    @property
    def symmetries(self) -> int:
        """How many reflections lead the drawing, or a part of it, onto itself."""
        return len(self._mirrors) + len(self._mirrored_parts)

    def resting(self) -> Solved:
        """The input, which is the answer where no handle is moved."""
        points = self._samples.points
        return Solved(points[self.held], points, (), 1.0, self.graph.points)

    def placed(self, result: Array) -> Array:
        """All samples (N, 2), those that go along at a result (n, 2); user units."""
        moved = self._samples.points.copy()
        moved[self.part] = result
        return moved

    def structure(self, number: int) -> Structure | None:
        """Of the finest level of a round, core first, if one was solved."""
        pattern = self._patterns[number]
        return pattern.structures[0] if pattern is not None else None
