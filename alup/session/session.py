# SPDX-License-Identifier: GPL-2.0-or-later
"""A drawing that is reshaped again and again while its handles are dragged, added and removed.

Curves are welded once, when the session begins.  They are sampled, tied and analysed once for each set of
handles. `solve` does the rest, for given targets of the handles: both rounds, and the refit.  The pipeline is
a session with one solve.

Every answer is solved from the input (see `alup.session.rounds`).  F has local minima, and a solution that
began at the last one would depend on the way by which the handles came; so a drag ends with the shape that a
run on the same handles gives, and dragging back gives back the shape that there was.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field, replace
from typing import Any, Mapping, Sequence

import numpy as np

from ..geometry import bezier
from ..geometry.connected_components import components
from ..handles import binding
from ..messages.errors import DocumentError, HandleError, SolveError
from ..messages.language import N_
from ..messages.language import translate as _
from ..methods import registry
from ..methods import task as method_task
from ..model import Array, Drawing, Handle, Refitted, Section
from ..network import open_crossings, sampling, shape_order, weld
from ..refit import refit
from ..regular import find as regular
from ..solver import outcome
from ..ties import groups, scaffold, ties
from .frames import Frames
from .options import ALUP, APART, DEFAULT, Note, Options
from .rounds import Rounds, Solved

# The usual tolerance of frames: twice the step of a quick drag at 60 frames a second.
FRAME = 0.02

# Samples that every curve has whatever the spacing: its ends, and half an edge from rounding up its length.
_FIXED = 1.5


@dataclass
class Clock:
    """Seconds of each stage, since the last stamp or the start."""

    stages: dict[str, float] = field(default_factory=dict)
    last: float = field(default_factory=time.perf_counter)

    def stamp(self, stage: str) -> None:
        now = time.perf_counter()
        self.stages[stage] = self.stages.get(stage, 0.0) + now - self.last
        self.last = now


@dataclass(frozen=True)
class Held:
    """The network sampled for a set of handles, and all that is known before their targets.

    label : (N,) component of each sample, of `parts`; rounds : None for other methods than ALUP
    refit : of these samples; notes : what of the options could not be kept
    """

    grabbed: binding.Grabbed
    samples: sampling.Samples
    about: ties.Surroundings
    parts: int
    label: Array
    rounds: Rounds | None
    refit: refit.Refit
    notes: tuple[Note, ...]


@dataclass(frozen=True)
class Answer:
    """The drawing with its handles where they were asked to be.

    refitted : the new segments, of the drawing as it was given; moved : (N, 2) the samples, user units
    anchors : samples that are held, and where; rounds : of ALUP's solver, core first
    figures : of the method, ready for JSON; notes : what falls short of what was asked for
    seconds : of each stage
    """

    refitted: Refitted
    moved: Array
    anchors: binding.Anchors
    rounds: tuple[outcome.Round, ...]
    figures: dict[str, Any]
    notes: tuple[Note, ...]
    seconds: dict[str, float]


class Session:
    """drawing : in canonical order, with its handles as they were asked for last

    before : (S,) see `shape_order.canonical`; net : the welded curves
    held : what was made of the handles; seconds : of each stage of setting up
    """

    def __init__(self, drawing: Drawing, options: Options = DEFAULT, deadline: float = math.inf):
        """Weld a drawing, and sample it for its handles.

        deadline : on the clock of `time.monotonic`, for the search for crossings
        Raises DocumentError or HandleError with a sentence for the user.
        """
        clock = Clock()
        self._longest = float(drawing.size.max())
        if not self._longest > 0.0:
            raise DocumentError(_("The selected paths have no extent: there is nothing to reshape."))
        # Shared borders become one curve of the network, so there may be half as many; beyond that even
        # looking for contacts is in vain.
        if len(drawing.control) > 2 * options.max_vertices:
            raise _too_many(len(drawing.control), options)
        self.options = options
        self.drawing, self.before = shape_order.canonical(drawing)
        self.net, self._notes = network(self.drawing, options, deadline)
        clock.stamp("network")
        self.held = self._hold(self.drawing, clock)
        self._frames: Frames | None = None
        self._last: tuple[Solved | None, refit.Fitted | None] = (None, None)
        self.seconds = clock.stages

    def solve(
        self,
        targets: Mapping[str, Array | None] | None = None,
        tolerance: float = 0.0,
        deadline: float | None = None,
    ) -> Answer:
        """The drawing with the handles at their targets; those that are not named stay where they were last.

        targets : by the names of handles, user units: (2,) where a handle goes, None for a pin, of a section
            its affine map (2, 3)
        tolerance : 0 for the answer.  Else a frame on the way to it will do, of the drag's last position (see
            `alup.session.frames`): steps of Newton's method follow the handles until one moves no sample by
            more than this, of the diagonal, and `FRAME` makes that a single one in a usual drag
        deadline : see `Rounds.solve`
        Raises HandleError or SolveError with a sentence for the user; then the handles stay as they were.
        """
        clock = Clock()
        drawing = _with_targets(self.drawing, targets or {})
        anchors = binding.anchors(drawing, self.held.grabbed, self.held.samples)
        clock.stamp("sample")
        if tolerance > 0.0:
            frame = self._frame(anchors, tolerance, clock)
            if frame is not None:
                self.drawing = drawing
                return frame
        solved = None
        if self.held.rounds is not None:
            solved = self.held.rounds.solve(anchors, deadline)
            moved, rounds, figures = solved.moved, solved.rounds, _figures(self.held.rounds, solved.growth)
            clock.stamp("solve")
        else:
            moved, figures = self._deformed(anchors, clock)
            rounds = ()
        if not np.isfinite(moved).all():
            raise SolveError(_("The result is not finite. Move the handles less far."))
        fitted = self.held.refit.fitted(moved)
        refitted, allowed = fitted.refitted, self.held.refit.tolerance
        notes = list(self.held.notes)
        if not self.options.add_nodes and refitted.error > allowed:
            share = 100.0 * refitted.error / self._longest
            text = N_("No nodes were added: curves are up to {share:.2g} % of the longest side off.")
            notes.append(Note(text, {"share": share}))
        clock.stamp("refit")
        self.drawing = drawing
        self._frames, self._last = None, (solved, fitted)
        return Answer(refitted.of(self.before), moved, anchors, rounds, figures, tuple(notes), clock.stages)

    def add(self, handle: Handle | Section) -> None:
        """Hold the drawing by one more handle.

        Raises HandleError, and leaves the session as it was, where there is no curve for it.
        """
        if isinstance(handle, Handle):
            self._change(replace(self.drawing, handles=(*self.drawing.handles, handle)))
        else:
            self._change(replace(self.drawing, sections=(*self.drawing.sections, handle)))

    def remove(self, name: str) -> None:
        """Let go of a handle.  Raises HandleError for one that is not there, and for the last one."""
        gone = _named(self.drawing, name)
        self._change(
            replace(
                self.drawing,
                handles=tuple(one for one in self.drawing.handles if one is not gone),
                sections=tuple(one for one in self.drawing.sections if one is not gone),
            )
        )

    def hold(self, handles: Sequence[Handle], sections: Sequence[Section]) -> None:
        """Hold the drawing by these handles, instead of those that there were.

        Raises HandleError, and leaves the session as it was, where there is no curve for one.
        """
        self._change(replace(self.drawing, handles=tuple(handles), sections=tuple(sections)))

    def _change(self, drawing: Drawing) -> None:
        self.held = self._hold(drawing, Clock())
        self._frames, self._last = None, (None, None)
        self.drawing = drawing

    def _frame(self, anchors: binding.Anchors, tolerance: float, clock: Clock) -> Answer | None:
        """A frame near the last one, or None where only an answer will do."""
        held = self.held
        if held.rounds is None or self.options.solver != "newton":
            return None
        if self._frames is None:
            solved, fitted = self._last
            solved = solved or held.rounds.resting()
            fitted = fitted or held.refit.fitted(solved.moved)
            self._frames = Frames(held.rounds, held.refit, solved, fitted)
        diagonal = self.drawing.diagonal
        if not self._frames.near(anchors.targets, diagonal):
            return None
        try:
            moved, refitted = self._frames.next(anchors.targets, tolerance * diagonal)
        except SolveError:
            return None
        clock.stamp("frame")
        return Answer(refitted.of(self.before), moved, anchors, (), {}, held.notes, clock.stages)

    def _hold(self, drawing: Drawing, clock: Clock) -> Held:
        """Sample the network for the handles of a drawing, and analyse it."""
        grabbed = binding.grab(self.net, drawing)
        spacing, coarse = affordable(self.net, self.options, self._longest)
        samples = sampling.sample(self.net, spacing, grabbed.curve, grabbed.fraction)
        held = binding.anchors(drawing, grabbed, samples).samples
        clock.stamp("sample")
        about = ties.surroundings(samples)
        crossed = np.zeros((0, 2), dtype=int)
        # Apart, nothing but the network holds curves together where they cross.
        if self.options.method == ALUP and self.options.hold != APART:
            samples, crossed = open_crossings.opened(samples, self.net, drawing, held)
        parts, label = components(samples.edges, len(samples.points))
        clock.stamp("ties")
        tolerance, add_nodes = self.options.fit_tolerance * self._longest, self.options.add_nodes
        refits = refit.Refit(drawing, self.net, samples, held, tolerance, add_nodes)
        clock.stamp("refit")
        rounds = None
        if self.options.method == ALUP:
            found = None
            if self.options.regular:
                rows = refits.rows
                along = regular.Along(rows.segment, rows.sample, samples.edges, samples.points)
                found = regular.find(drawing, along, self.options.regular)
            clock.stamp("regular")
            rounds = Rounds(samples, label, about, crossed, held, drawing.page, self.options, found)
        clock.stamp("ties")
        return Held(grabbed, samples, about, parts, label, rounds, refits, (*self._notes, *coarse))

    def _deformed(self, anchors: binding.Anchors, clock: Clock) -> tuple[Array, dict[str, Any]]:
        """Samples (N, 2) moved by another method than ALUP, and its figures."""
        samples, label = self.held.samples, self.held.label
        moved = samples.points.copy()
        # Without a moved handle the input is the answer, exactly.
        if np.array_equal(anchors.targets, samples.points[anchors.samples]):
            return moved, {}
        part = (groups.held_parts(label, anchors.samples) | (self.options.hold != APART))[label]
        graph, number = samples.part(part), np.cumsum(part) - 1
        joined = scaffold.between(graph.points, label[part], scaffold.sides(graph.points))
        clock.stamp("ties")
        task = method_task.Task(graph, number[anchors.samples], anchors.targets, joined)
        deformed = registry.METHODS[self.options.method](task)
        moved[part] = deformed.moved
        clock.stamp("solve")
        return moved, {"deformation": deformed.figures, "ties": {"scaffold": len(joined)}}


def _figures(rounds: Rounds, growth: float) -> dict[str, Any]:
    return {
        "ties": {
            "facing": rounds.facing,
            "crossings": rounds.crossings,
            "scaffold": rounds.scaffold,
            "growth": growth,
        },
        "stays": rounds.stays,
        "regular": {**rounds.regular.figures, "symmetry": rounds.symmetries} if rounds.regular else {},
    }


def _named(drawing: Drawing, name: str) -> Handle | Section:
    """The handle of a name.  Raises HandleError unless there is one."""
    every: list[Handle | Section] = [*drawing.handles, *drawing.sections]
    found = [one for one in every if one.name == name]
    if len(found) != 1:
        raise HandleError(
            _("There is no handle {name}.").format(name=name)
            if not found
            else _("There are several handles of the name {name}.").format(name=name)
        )
    return found[0]


def _with_targets(drawing: Drawing, targets: Mapping[str, Array | None]) -> Drawing:
    """The drawing with some of its handles asked for elsewhere; see `Session.solve`."""
    if not targets:
        return drawing
    moved: dict[int, Handle] = {}
    mapped: dict[int, Section] = {}
    for name, target in targets.items():
        one = _named(drawing, name)
        if isinstance(one, Handle):
            moved[id(one)] = replace(one, target=None if target is None else _finite(target, (2,), name))
        else:
            matrix = np.eye(2, 3) if target is None else target
            mapped[id(one)] = replace(one, matrix=_finite(matrix, (2, 3), name))
    return replace(
        drawing,
        handles=tuple(moved.get(id(one), one) for one in drawing.handles),
        sections=tuple(mapped.get(id(one), one) for one in drawing.sections),
    )


def _finite(target: Array, shape: tuple[int, ...], name: str) -> Array:
    """The target as an array of its own.  Raises HandleError for one that is no place."""
    result = np.array(target, dtype=float)
    if result.shape != shape or not np.isfinite(result).all():
        raise HandleError(_("The handle {name} has no finite place to go to.").format(name=name))
    return result


def network(drawing: Drawing, options: Options, deadline: float) -> tuple[weld.Network, list[Note]]:
    """The drawing's network, and a note where its crossings had to be left out: they can be any number."""
    crossed = 0

    def stop(more: int) -> bool:
        # An arc's end on a crossing finds it four times; each makes two pieces at least.
        nonlocal crossed
        crossed += more
        return crossed > 2 * options.max_vertices or time.monotonic() >= deadline

    net = weld.build(drawing, options.snap * drawing.diagonal, options.crossings, stop)
    if not net.complete:
        text = N_(
            "The curves cross so often that the search for crossings ended after {crossings}: where they "
            "cross they are not held together."
        )
        return net, [Note(text, {"crossings": crossed})]
    if not options.crossings or _FIXED * len(net.curves) < options.max_vertices:
        return net, []
    text = N_(
        "The curves cross so often that their {pieces} pieces are too many for {samples} samples: where they "
        "cross they are not held together."
    )
    note = Note(text, {"pieces": len(net.curves), "samples": options.max_vertices})
    return weld.build(drawing, options.snap * drawing.diagonal, False), [note]


def affordable(net: weld.Network, options: Options, longest: float) -> tuple[float, list[Note]]:
    """The spacing of samples, user units, and a note where it had to be raised for the limit of vertices.

    Raises DocumentError where even the ends of the curves are too many.
    """
    spacing = options.spacing * longest
    length = float(bezier.arc_lengths(net.curves).sum())
    fixed = _FIXED * len(net.curves)
    if fixed + length / spacing <= options.max_vertices:
        return spacing, []
    if fixed >= options.max_vertices:
        raise _too_many(len(net.curves), options)
    spacing = length / (options.max_vertices - fixed)
    text = N_(
        "The samples are {share:.3g} % of the longest side apart instead of {wanted:.3g} %, so that there "
        "are no more than {samples}."
    )
    share, wanted = 100.0 * spacing / longest, 100.0 * options.spacing
    return spacing, [Note(text, {"share": share, "wanted": wanted, "samples": options.max_vertices})]


def _too_many(pieces: int, options: Options) -> DocumentError:
    return DocumentError(
        _(
            "The selected paths have {pieces} pieces, too many for {samples} samples. "
            "Select fewer paths, or allow more samples."
        ).format(pieces=pieces, samples=options.max_vertices)
    )
