# SPDX-License-Identifier: GPL-2.0-or-later
"""The drawing of a live window: what its page shows, and what becomes of it while handles are dragged.

While a hand moves, a `Session` follows from frame to frame, and only path data change.  When it rests, first
the session's answer takes the place of the last frame; then a batch run is made of a copy of the document
with the same handles, and what it has changed beside the paths is shown, too.  The document of that run is
what *Done* writes: so it equals a batch run because it is one.

A drawing of many samples is followed with fewer of them.  What takes long - an answer, a run - ends soon when
something newer is asked for.
"""

from __future__ import annotations

import copy
import threading
import time
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, Iterator, Sequence

import numpy as np

from .. import run
from ..document import frame_outlines, notes, place_handles, reading, restore_original
from ..document import grips as gripping
from ..document.followers.motion import Points
from ..document.frame_outlines import unmoved
from ..document.grips import FRAME, POINT, Grip
from ..document.handle_targets import rest_of
from ..document.history.correspondence import parts_before
from ..document.reading import UNSEEN
from ..document.tree import shown
from ..document.tree.elements import page_of
from ..geometry.bezier import Nearest, evaluate
from ..messages.errors import HandleError
from ..messages.language import translate as _
from ..model import Array, Handle, Section
from ..session.options import APART, Options
from ..session.session import FRAME as FRAME_TOLERANCE
from ..session.session import Session
from . import mirror
from .history import Asked, History, same_held

# A drawing of more samples is followed with about this many: a frame of them takes some 25 ms.
MOVING_SAMPLES = 8000

# What a solver needs to see that nobody waits for it.
CLOSE_SECONDS = 3.0

# Of the diagonal: a handle that misses its target by more is worth a word.
MISSED_OF_DIAGONAL = 2e-3

# Of the diagonal: margin around a drawing without a page.
_MARGIN = 0.05

Paths = dict  # of path data and other attributes by the keys of elements


class SupersededError(Exception):
    """Something newer was asked for, so that this has no answer any more."""


@dataclass(frozen=True)
class Settled:
    """tree : of the document as a run has left it; said : what falls short; seconds : that it took"""

    asked: Asked
    tree: Any
    said: tuple[str, ...]
    seconds: float


@dataclass(frozen=True)
class _Curves:
    """What a pointer can take hold of: see `gripping.Standing`."""

    now: Array
    was: Array
    shape: Array
    nearest: Nearest
    nearest_was: Nearest

    @classmethod
    def of(cls, now: Array, was: Array, shape: Array, clips: Sequence[int]) -> _Curves:
        """Without the shapes that only bound what is seen of others."""
        seen = ~np.isin(shape, clips)
        now, was, shape = now[seen], was[seen], shape[seen]
        return cls(now, was, shape, Nearest(now), Nearest(was))


class Engine:
    """svg : the root element of the document, which stays as it is; selected : elements to reshape

    Methods may be called from any thread.  Raises DocumentError or HandleError as a batch run would.
    """

    def __init__(self, svg: Any, selected: Sequence[Any], options: Options):
        self._svg, self._selected = svg, list(selected)
        self._lock = threading.RLock()
        self._latest = 0
        self._solving_for: int | None = None
        self._options = options
        self._keys = {element: n for n, element in enumerate(svg.iter()) if isinstance(element.tag, str)}
        self._read = reading.read(svg, self._selected, False, options.hold != APART)
        self._origins = gripping.grips_of(self._read)
        self._before = {grip.name: grip for grip in self._origins.values()}
        self._history = History(Asked(tuple(self._before.values()), options.hold, options.method))
        self._size = place_handles.measure(svg, self._selected)
        self._shown = self._first_shown()
        self._named = 0
        self._symmetric = False
        self._settled: Settled | None = None
        self._begin()

    def _begin(self) -> None:
        """Take what was read as what frames start from."""
        self._session: Session | None = None
        self._held: tuple[Grip, ...] = ()
        self._outlines, self._followed = frame_outlines.Outlines(self._read), False
        standing = gripping.standing(self._read)
        self._transforms = standing.transforms
        self._curves: _Curves | None = None
        self._stands = (standing.now, standing.was, standing.shape)
        self._mirror = mirror.of(self._read.drawing)

    # --- what the page shows --------------------------------------------------------------------

    def drawing(self) -> dict[str, Any]:
        """The drawing to be shown, its page (x, y, width, height) and colour, and where the curves are."""
        with self._lock:
            return {
                "svg": self._shown.text(),
                "box": list(self._box()),
                "bounds": self._read.drawing.bounds.tolist(),
                "ground": shown.page_colour(self._svg),
            }

    def state(self) -> dict[str, Any]:
        """Where the handles are, and what can be done."""
        with self._lock:
            now = self._history.now
            return {
                "grips": [
                    {
                        "name": grip.name,
                        "kind": grip.kind,
                        "now": grip.now.tolist(),
                        "rest": grip.rest.tolist(),
                        "moved": grip.moved,
                    }
                    for grip in now.grips
                ],
                "undo": self._history.can_undo,
                "redo": self._history.can_redo,
                "hold": now.hold,
                "method": now.method,
                "symmetric": self._symmetric,
                "axis": self._mirror.line.tolist() if self._symmetric else None,
            }

    def near(self, at: Array, reach: float) -> dict[str, Any] | None:
        """The curve under the pointer: the key of its element, and the point of it."""
        curves = self._standing()
        curve, _t, point, distance = curves.nearest.find(at)
        if curve < 0 or distance > reach:
            return None
        shape = self._read.shapes[int(curves.shape[curve])]
        return {"key": self._keys.get(shape.element), "at": point.tolist()}

    # --- handles --------------------------------------------------------------------------------

    def press(self, at: Array, reach: float) -> str | None:
        """Take hold of the curve at a point: the name of the handle, which is new or a frame around it."""
        with self._lock:
            curves = self._standing()
            curve, t, point, distance = curves.nearest.find(at)
            if curve < 0 or distance > reach:
                return None
            rest = evaluate(curves.was[curve], np.array(t))
            around = self._history.now.frame_around(rest) or self._pin_near(rest)
            if around is not None:
                return around.name
            return self._add(rest, point).name

    def _pin_near(self, rest: Array) -> Grip | None:
        """The pin that holds this point (2,), or one so near that a second would contradict it."""
        reach = 0.5 * self._options.spacing * float(self._read.drawing.size.max())
        for grip in self._history.now.grips:
            if grip.kind == POINT and np.linalg.norm(grip.rest[0] - rest) <= reach:
                return grip
        return None

    def _add(self, rest: Array, now: Array) -> Grip:
        same = np.abs(rest - now).max() <= 1e-6 * self._read.drawing.diagonal
        grip = Grip(self._new_name(), POINT, rest[None], rest[None] if same else now[None], self._size.radius)
        self._history.now = self._history.now.with_(grip)
        return grip

    def add_frame(self, low: Array, high: Array) -> str:
        """A frame around the curves between two corners (2,); pins in it become part of it."""
        with self._lock:
            now = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
            grip = self._frame(now)
            inside = [
                one.name
                for one in self._history.now.grips
                if one.kind == POINT and Asked((grip,), "", "").frame_around(one.rest[0]) is not None
            ]
            self._history.now = self._history.now.without(*inside).with_(grip)
            self._history.commit()
            return grip.name

    def _frame(self, now: Array) -> Grip:
        """Raises HandleError where there is no curve in it."""
        curves = self._standing()
        t = np.linspace(0.0, 1.0, 17)
        old, new = (evaluate(c[:, None], t[None]).reshape(-1, 2) for c in (curves.now, curves.was))
        if not ((old >= now.min(axis=0)) & (old <= now.max(axis=0))).all(axis=1).any():
            raise HandleError(_("There is no curve in this frame. Draw it around a part of the drawing."))
        rest = now if np.array_equal(old, new) else rest_of(now, Points(old, new, np.ones(len(old))))
        same = np.abs(rest - now).max() <= 1e-6 * self._read.drawing.diagonal
        return Grip(self._new_name(), FRAME, rest, rest if same else now, self._size.radius)

    def _new_name(self) -> str:
        self._named += 1
        return f"new{self._named}"

    def drag(self, name: str, to: Array) -> dict[str, Any]:
        """A frame of a drag: the handle is to be there.  to : (1, 2), or the corners (4, 2) of a frame"""
        self._latest += 1
        with self._lock:
            grip = self._history.now.grip(name)
            if grip is None or to.shape != grip.now.shape or not np.isfinite(to).all():
                raise HandleError(_("There is no handle {name}.").format(name=name))
            moved = self._moved(replace(grip, now=to))
            if not grip.moved and len(self._history.now.grips) == len(moved) == 1:
                self._hold_far_side(grip)
            self._history.now = self._history.now.with_(*moved)
            began = time.perf_counter()
            paths = self._follow(FRAME_TOLERANCE)
            return {**self.state(), "paths": paths, "ms": 1000.0 * (time.perf_counter() - began)}

    def _moved(self, grip: Grip) -> list[Grip]:
        """A grip and its partner, where they are to be."""
        if not self._symmetric:
            return [grip]
        others = self._history.now.grips
        partner = self._mirror.partner(grip, others) or self._new_partner(grip)
        if partner is None:
            return [grip]
        if partner.name == grip.name:
            return [self._mirror.on_axis(grip)]
        return [grip, self._mirror.followed(partner, grip)]

    def _new_partner(self, grip: Grip) -> Grip | None:
        """A grip on the other side, if there is a curve."""
        curves, image = self._standing(), self._mirror.image(grip.rest)
        if grip.kind == FRAME:
            low, high = image.min(axis=0), image.max(axis=0)
            mine = np.array([grip.rest.min(axis=0), grip.rest.max(axis=0)])
            if (low < mine[1]).all() and (high > mine[0]).all():
                return None  # they would contradict each other
            points = evaluate(curves.was[:, None], np.linspace(0.0, 1.0, 17)[None]).reshape(-1, 2)
            if not ((points >= low) & (points <= high)).all(axis=1).any():
                return None
            corners = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
            return Grip(self._new_name(), FRAME, corners, corners, grip.radius)
        curve, _t, rest, distance = curves.nearest_was.find(image[0])
        if curve < 0 or distance > self._mirror.reach or self._history.now.frame_around(rest) is not None:
            return None
        return Grip(self._new_name(), POINT, rest[None], rest[None], grip.radius)

    def _hold_far_side(self, grip: Grip) -> None:
        """A pin where the drawing is farthest from the only handle: else that would only shift everything."""
        points = self._read.drawing.control[~np.isin(self._read.drawing.shape, self._read.drawing.clips), 0]
        away = np.linalg.norm(points - grip.rest.mean(axis=0), axis=1)
        far = points[int(away.argmax())]
        if self._history.now.frame_around(far) is None:
            self._add(far, far)

    def drop(self) -> dict[str, Any]:
        """The end of a drag, or of whatever is one step."""
        with self._lock:
            self._history.commit()
            return self.state()

    def remove(self, names: Sequence[str]) -> None:
        self._latest += 1
        with self._lock:
            self._history.now = self._history.now.without(*names)
            self._history.commit()

    def undo(self) -> None:
        self._latest += 1
        with self._lock:
            self._history.undo()
            self._take_options()

    def redo(self) -> None:
        self._latest += 1
        with self._lock:
            self._history.redo()
            self._take_options()

    def choose(self, hold: str, method: str, symmetric: bool) -> None:
        """What the bar says; `hold` and `method` as in `options.Options`."""
        self._latest += 1
        with self._lock:
            self._symmetric = symmetric
            self._history.now = replace(self._history.now, hold=hold, method=method)
            self._history.commit()
            self._take_options()

    def _take_options(self) -> None:
        now, before = self._history.now, self._options
        if (now.hold, now.method) == (before.hold, before.method):
            return
        self._options = replace(before, hold=now.hold, method=now.method)
        if (now.hold == APART) != (before.hold == APART):
            self._read = reading.read(self._svg, self._selected, False, now.hold != APART)
        self._begin()

    def close(self) -> None:
        """Answer nothing any more.

        A thread that is in a solver's own code when Python ends would end it with an error.
        """
        self._latest += 1
        self._lock.acquire(timeout=CLOSE_SECONDS)

    # --- frames and answers ---------------------------------------------------------------------

    def answer(self) -> dict[str, Any]:
        """The session's answer for the handles as they are.  Raises SupersededError."""
        latest = self._latest
        with self._lock, self._while_wanted(latest):
            return {"paths": self._follow(0.0, latest)}

    def prepare(self) -> None:
        """Get ready for frames of the handles that there are, before one moves."""
        with self._lock:
            if self._history.now.grips:
                self._ready(self._latest)

    def _follow(self, tolerance: float, latest: int | None = None) -> Paths:
        """Path data that a frame, or an answer, has changed; of handles at rest the drawing's own."""
        now = self._history.now
        if not now.grips:
            return self._standing_as(unmoved(self._read.drawing))
        session = self._ready(latest)
        targets = {grip.name: _target(grip.wish(session.drawing.diagonal)) for grip in now.grips}
        answer = session.solve(targets, tolerance)
        self._refuse_late(latest)
        return self._standing_as(answer.refitted)

    def _standing_as(self, refitted: Any) -> Paths:
        self._curves = None
        before, shape = self._read.drawing.control, self._read.drawing.shape
        was = before[refitted.source]
        if len(refitted.source) != len(before):
            was = parts_before(refitted.control, refitted.source, before)
        self._stands = (refitted.control, was, shape[refitted.source])
        paths: Paths = {}
        # What is shown first need not be what frames start from.
        changed = self._outlines.changed(refitted, every=not self._followed)
        self._followed = True
        for element, data in changed.items():
            key = self._keys.get(element)
            if key is not None and self._shown.set(key, "d", data):
                paths[key] = {"d": data}
        if self._read.past.again:
            for one, transform in zip(self._read.shapes, self._transforms):
                key = self._keys.get(one.element)
                if key is not None and self._shown.set(key, "transform", transform):
                    paths.setdefault(key, {})["transform"] = transform
        return paths

    def _ready(self, latest: int | None) -> Session:
        """The session with the handles that there are now."""
        now = self._history.now
        if self._session is not None and same_held(self._held, now.grips):
            return self._session
        diagonal = self._read.drawing.diagonal
        wishes = [grip.wish(diagonal) for grip in now.grips]
        points = tuple(one for one in wishes if isinstance(one, Handle))
        sections = tuple(one for one in wishes if isinstance(one, Section))
        if self._session is None:
            drawing = replace(self._read.drawing, handles=points, sections=sections)
            options = replace(self._options, limits=replace(self._options.limits, stop=self._is_late))
            self._session = Session(drawing, options)
            count = len(self._session.held.samples.points)
            if count > MOVING_SAMPLES:
                spacing = options.spacing * count / MOVING_SAMPLES
                self._session = Session(drawing, replace(options, spacing=spacing))
        else:
            self._session.hold(points, sections)
        self._held = now.grips
        self._refuse_late(latest)
        return self._session

    @contextmanager
    def _while_wanted(self, latest: int | None) -> Iterator[None]:
        """Have solvers end when something newer is asked for."""
        self._refuse_late(latest)
        self._solving_for = latest
        try:
            yield
        finally:
            self._solving_for = None

    def _is_late(self) -> bool:
        return self._solving_for is not None and self._solving_for != self._latest

    def _refuse_late(self, latest: int | None) -> None:
        if latest is not None and latest != self._latest:
            raise SupersededError

    def _standing(self) -> _Curves:
        """The curves as they are now, to take hold of."""
        curves = self._curves
        if curves is None:
            curves = _Curves.of(*self._stands, self._read.drawing.clips)
            self._curves = curves
        return curves

    # --- the whole document ---------------------------------------------------------------------

    def settle(self) -> dict[str, Any]:
        """A batch run of the handles as they are: what it has changed of what is shown.

        Raises SupersededError.
        """
        latest = self._latest
        with self._lock:
            self._refuse_late(latest)
            settled, now_shown = self._run(latest)
            changed = shown.changes(self._shown, now_shown)
            self._shown, self._settled = now_shown, settled
            drawn: dict[str, Any] = {"svg": now_shown.text()} if changed is None else {"paths": changed}
            return {**drawn, "said": list(settled.said), "seconds": settled.seconds}

    def result(self) -> Any:
        """The tree that *Done* leaves, or None where the document is to stay as it is."""
        with self._lock:
            now = self._history.now
            if now.same(self._history.start) and not any(grip.moved for grip in now.grips):
                return None
            if self._settled is None or not self._settled.asked.same(now):
                self._settled = self._run(None)[0]
            return self._settled.tree

    def _run(self, latest: int | None) -> tuple[Settled, shown.Shown]:
        began = time.perf_counter()
        now = self._history.now
        tree = copy.deepcopy(self._svg.getroottree())
        svg = tree.getroot()
        twins = dict(zip(self._svg.iter(), svg.iter()))
        keys = {twins[element]: key for element, key in self._keys.items()}
        selected = [twins[element] for element in self._selected]
        known = {grip.name: twins[element] for element, grip in self._origins.items()}
        gripping.put(svg, now.grips, known, self._before, self._size)
        said: list[str] = []
        notes.clear(svg)
        if now.grips:
            limits = replace(self._options.limits, stop=None if latest is None else self._is_late)
            with self._while_wanted(latest):
                done = run.reshape(svg, selected, replace(self._options, limits=limits))
            self._refuse_late(latest)
            read, said = done.read, _said(done)
        else:
            if self._read.past.again:
                restore_original.restore(svg, selected)
            read = reading.read(svg, selected, False, now.hold != APART)
        page = shown.show(svg, keys, self._box(), *_lit(read))
        settled = Settled(now, tree, tuple(said), time.perf_counter() - began)
        return settled, page

    def _first_shown(self) -> shown.Shown:
        return shown.show(self._svg, self._keys, self._box(), *_lit(self._read))

    def _box(self) -> tuple[float, float, float, float]:
        """x, y, width and height of the page, or of the drawing with a margin."""
        page = page_of(self._svg)
        if page is None or not (page[1] > page[0]).all():
            page = self._read.drawing.bounds
            margin = _MARGIN * self._read.drawing.diagonal
            page = np.array([page[0] - margin, page[1] + margin])
        x, y = page[0].tolist()
        width, height = (page[1] - page[0]).tolist()
        return x, y, width, height


def _target(wish: Handle | Section) -> Array | None:
    return wish.target if isinstance(wish, Handle) else wish.matrix


def _lit(read: reading.Document) -> tuple[set, set]:
    """The shapes that are reshaped, and all that goes along."""
    curves = {shape.element for shape in read.shapes if shape.origin is shape.element}
    along = {item.element for item in read.carried} | {clone.element for clone in read.clones}
    return curves, curves | along | {element for element, _ in read.met.other}


def _said(done: run.Run) -> list[str]:
    """What a run has not done as asked, a sentence each; nothing where all is well."""
    report, lines = done.result.report, []
    missed, crossed = report["handle_error_of_diagonal"], report["new_crossings"]
    if missed > MISSED_OF_DIAGONAL:
        lines.append(
            _("A handle is off its place by {percent:.1f} % of the drawing.").format(percent=100.0 * missed)
        )
    if crossed:
        lines.append(_("{count} new crossings.").format(count=crossed))
    lines += [note.translated() for note in done.result.notes]
    seen = [entry for entry in done.read.skipped if entry["why"] not in UNSEEN]
    lines += [_("{name}: {why}.").format(name=entry["id"], why=_(entry["why"])) for entry in seen]
    lines += [
        _("The handle {name} lies on nothing that was reshaped.").format(name=one) for one in done.ignored
    ]
    return lines
