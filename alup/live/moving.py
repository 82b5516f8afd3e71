# SPDX-License-Identifier: GPL-2.0-or-later
"""What is shown while a hand moves: a session that follows the handles, its curves, and their path data."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Callable, Mapping, Sequence

import numpy as np

from ..document import frame_outlines, reading
from ..document import grips as gripping
from ..document.frame_outlines import unmoved
from ..document.grips import Grip
from ..document.history.correspondence import parts_before
from ..document.tree.shown import Shown
from ..geometry.bezier import Nearest
from ..model import Array, Drawing, Handle, Refitted, Section
from ..session import pipeline
from ..session.options import Options
from ..session.session import Answer, Session
from . import mirror
from .history import Asked, same_held

# A drawing of more samples is followed with about this many: a frame of them takes some 25 ms.
MOVING_SAMPLES = 8000

# Of the diagonal: handles are written to more digits than that, and curves move no farther than they do.
SAME_WISH = 1e-8

Paths = dict  # of attributes, path data above all, by the keys of elements


@dataclass(frozen=True)
class Curves:
    """What a pointer can take hold of: see `gripping.Standing`."""

    now: Array
    was: Array
    shape: Array

    def seen(self, clips: Sequence[int]) -> Curves:
        """Without the shapes that only bound what is seen of others."""
        kept = ~np.isin(self.shape, clips)
        return Curves(self.now[kept], self.was[kept], self.shape[kept])

    @cached_property
    def nearest(self) -> Nearest:
        return Nearest(self.now)

    @cached_property
    def nearest_was(self) -> Nearest:
        return Nearest(self.was)


class Moving:
    """read : the document; keys : of its elements in the page

    stop : asked by solvers now and then, whether nobody waits for them any more
    """

    def __init__(
        self, read: reading.Document, keys: Mapping[Any, int], options: Options, stop: Callable[[], bool]
    ):
        self._read, self._keys = read, keys
        self._options = replace(options, limits=replace(options.limits, stop=stop))
        self._outlines, self._followed = frame_outlines.Outlines(read), False
        standing = gripping.standing(read)
        self._transforms = standing.transforms
        self._curves = Curves(standing.now, standing.was, standing.shape).seen(read.drawing.clips)
        self._session: Session | None = None
        self._held: tuple[Grip, ...] = ()
        self._answered: tuple[Asked, Answer] | None = None

    @property
    def curves(self) -> Curves:
        """The curves as they are now."""
        return self._curves

    @cached_property
    def mirror(self) -> mirror.Mirror:
        """Looked for when somebody drags symmetrically."""
        return mirror.of(self._read.drawing)

    @property
    def samples(self) -> int:
        return 0 if self._session is None else len(self._session.held.samples.points)

    def follow(self, asked: Asked, tolerance: float) -> Refitted:
        """The curves for what is asked for; with handles at rest, or none, the drawing's own.

        tolerance : see `Session.solve`
        """
        if not asked.grips:
            return unmoved(self._read.drawing)
        session = self.ready(asked)
        targets = {grip.name: _target(grip.wish(session.drawing.diagonal)) for grip in asked.grips}
        answer = session.solve(targets, tolerance)
        self._answered = (asked, answer) if tolerance == 0.0 else None
        return answer.refitted

    def ready(self, asked: Asked) -> Session:
        """The session, holding the handles that are asked for."""
        if self._session is not None and same_held(self._held, asked.grips):
            return self._session
        diagonal = self._read.drawing.diagonal
        wishes = [grip.wish(diagonal) for grip in asked.grips]
        points = tuple(one for one in wishes if isinstance(one, Handle))
        sections = tuple(one for one in wishes if isinstance(one, Section))
        if self._session is None:
            drawing, options = replace(self._read.drawing, handles=points, sections=sections), self._options
            self._session = Session(drawing, options, time.monotonic() + options.time_limit)
            if self.samples > MOVING_SAMPLES:
                coarser = options.spacing * self.samples / MOVING_SAMPLES
                options = replace(options, spacing=coarser)
                self._session = Session(drawing, options, time.monotonic() + options.time_limit)
        else:
            self._session.hold(points, sections)
        self._held = asked.grips
        return self._session

    def paths(self, refitted: Refitted, page: Shown) -> Paths:
        """Make these the curves as they are now, in the page as well; the attributes that changes there."""
        drawing = self._read.drawing
        was = drawing.control[refitted.source]
        if len(refitted.source) != len(drawing.control):
            was = parts_before(refitted.control, refitted.source, drawing.control)
        self._curves = Curves(refitted.control, was, drawing.shape[refitted.source]).seen(drawing.clips)
        found: Paths = {}
        # What is shown first need not be what frames start from.
        changed = self._outlines.changed(refitted, every=not self._followed)
        self._followed = True
        for element, data in changed.items():
            key = self._keys.get(element)
            if key is not None and page.set(key, "d", data):
                found[key] = {"d": data}
        if self._read.run_start.again:
            for one, transform in zip(self._read.shapes, self._transforms):
                key = self._keys.get(one.element)
                if key is not None and page.set(key, "transform", transform):
                    found.setdefault(key, {})["transform"] = transform
        return found

    def known(self, drawing: Drawing, asked: Asked) -> pipeline.Result | None:
        """The answer that the session has just given, if it is for this drawing and as fine as a run's."""
        session, before = self._session, self._read.drawing
        if session is None or self._answered is None or not self._answered[0].same(asked):
            return None
        mine = [grip.wish(before.diagonal) for grip in asked.grips]
        if (
            session.options.spacing != self._options.spacing
            or not np.array_equal(drawing.control, before.control)
            or drawing.clips != before.clips
            or not _same_wishes([*drawing.handles, *drawing.sections], mine, before.diagonal)
        ):
            return None
        return pipeline.result_of(session, self._answered[1])


def _target(wish: Handle | Section) -> Array | None:
    return wish.target if isinstance(wish, Handle) else wish.matrix


def _same_wishes(some: Sequence[Any], others: Sequence[Any], diagonal: float) -> bool:
    """Whether handles, in whatever order, ask for the same but for the rounding of their objects."""

    def rows(wishes: Sequence[Any]) -> Array:
        found = []
        for wish in wishes:
            target = _target(wish)
            numbers = [*wish.rest, *(wish.rest if target is None else target.ravel())]
            found.append(numbers + [0.0] * (10 - len(numbers)))
        return np.array(sorted(found)).reshape(-1, 10)

    one, other = rows(some), rows(others)
    return one.shape == other.shape and bool(np.abs(one - other).max(initial=0.0) <= SAME_WISH * diagonal)
