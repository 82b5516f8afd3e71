# SPDX-License-Identifier: GPL-2.0-or-later
"""The live window's engine: what a page asks, of one drawing and its handles.

While a hand moves, a `Session` follows from frame to frame, and only path data change (`moving`).  When it
rests, first the session's answer takes the place of the last frame; then a batch run is made of a copy of
the document with the same handles, and what it has changed beside the paths is shown, too (`whole`).  The
document of that run is what *Done* writes: so it equals a batch run because it is one.

A drawing of many samples is followed with fewer of them.  What takes long - an answer, a run - ends soon when
something newer is asked for.
"""

from __future__ import annotations

import threading
import time
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, Iterator, Sequence

import numpy as np

from ..document.followers.motion import Points
from ..document.grips import FRAME, POINT, Grip
from ..document.handle_targets import SAME_OF_DIAGONAL, rest_of
from ..document.tree import shown
from ..geometry.bezier import evaluate
from ..messages.errors import HandleError
from ..messages.language import translate as _
from ..model import Array
from ..regular.find import KINDS
from ..session.options import ALUP, APART, Options
from .history import Asked, History
from .moving import Moving, Paths
from .regularities import Regularities
from .whole import Settled, Whole

# Tolerance of a frame, see `Session.solve`.  The next picture goes on where this one has ended, and comes the
# sooner the less this one takes; of a steady drag most frames are one step.
FRAME_TOLERANCE = 0.05

# What a solver needs to see that nobody waits for it.
CLOSE_SECONDS = 3.0

# Points of a curve that tell whether it is in a frame.
_POINTS = 17


class SupersededError(Exception):
    """Something newer was asked for, so that this has no answer any more."""


class Engine:
    """svg : the root element of the document, which stays as it is; selected : elements to reshape

    Methods may be called from any thread.  Raises DocumentError or HandleError as a batch run would.
    """

    def __init__(self, svg: Any, selected: Sequence[Any], options: Options):
        self._lock = threading.RLock()
        self._latest = 0
        self._solving_for: int | None = None
        self._options = options
        self.whole = Whole(svg, selected, options)
        self.page = self.whole.page
        self.moving = Moving(self.whole.read, self.whole.keys, options, self._is_late)
        self._kinds = options.regular or frozenset(KINDS)
        self._history = History(Asked(self.whole.grips, options.hold, options.method, bool(options.regular)))
        self._regularities: Regularities | None = None
        self._lines_shown = False
        self._named = 0
        self._symmetric = False
        self._settled: Settled | None = None

    # --- what the page shows --------------------------------------------------------------------

    def drawing(self) -> dict[str, Any]:
        """The drawing to be shown, its page (x, y, width, height) and colour, and where the curves are."""
        with self._lock:
            return {
                "svg": self.page.text(),
                "box": list(self.whole.box),
                "bounds": self.whole.read.drawing.bounds.tolist(),
                "ground": self.whole.colour,
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
                "regular": now.regular,
                "keeps": now.method == ALUP,
                "symmetric": self._symmetric,
                "axis": self.moving.mirror.line.tolist() if self._symmetric else None,
            }

    def regular(self) -> str:
        """What of the drawing is regular, in words; nothing where nothing is."""
        with self._lock:
            return self._found().said()

    def show_regular(self, shown: bool) -> dict[str, Any]:
        """Have lines over what is regular with every picture, or none; see `Regularities.lines`."""
        with self._lock:
            self._lines_shown = shown
            return self._lines(True) if shown else {"lines": ("", "")}

    def _found(self) -> Regularities:
        if self._regularities is None:
            self._regularities = Regularities(self.whole.read.drawing, self._options)
        return self._regularities

    def _lines(self, kept: bool) -> dict[str, tuple[str, str]]:
        """With `kept` only over what still is regular, of which frames of a drag know nothing."""
        if not self._lines_shown:
            return {}
        found = self._found()
        return {"lines": self.moving.lines(found, kept) if kept or found.follows else ("", "")}

    def near(self, at: Array, reach: float) -> dict[str, Any] | None:
        """The curve under the pointer: the key of its element, and the point of it."""
        curves = self.moving.curves
        curve, _t, point, distance = curves.nearest.find(at)
        if curve < 0 or distance > reach:
            return None
        shape = self.whole.read.shapes[int(curves.shape[curve])]
        return {"key": self.whole.keys.get(shape.element), "at": point.tolist()}

    # --- handles --------------------------------------------------------------------------------

    def press(self, at: Array, reach: float) -> str | None:
        """Take hold of the curve at a point: the name of the handle, which is new or a frame around it."""
        with self._lock:
            curves = self.moving.curves
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
        reach = 0.5 * self._options.spacing * float(self.whole.read.drawing.size.max())
        for grip in self._history.now.grips:
            if grip.kind == POINT and np.linalg.norm(grip.rest[0] - rest) <= reach:
                return grip
        return None

    def _add(self, rest: Array, now: Array) -> Grip:
        same = np.abs(rest - now).max() <= SAME_OF_DIAGONAL * self.whole.read.drawing.diagonal
        grip = Grip(
            self._new_name(), POINT, rest[None], rest[None] if same else now[None], self.whole.size.radius
        )
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
        curves = self.moving.curves
        t = np.linspace(0.0, 1.0, _POINTS)
        old, new = (evaluate(c[:, None], t[None]).reshape(-1, 2) for c in (curves.now, curves.was))
        if not ((old >= now.min(axis=0)) & (old <= now.max(axis=0))).all(axis=1).any():
            raise HandleError(_("There is no curve in this frame. Draw it around a part of the drawing."))
        rest = now if np.array_equal(old, new) else rest_of(now, Points(old, new, np.ones(len(old))))
        same = np.abs(rest - now).max() <= SAME_OF_DIAGONAL * self.whole.read.drawing.diagonal
        return Grip(self._new_name(), FRAME, rest, rest if same else now, self.whole.size.radius)

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
            lines = self._lines(False)
            return {**self.state(), "paths": paths, **lines, "ms": 1000.0 * (time.perf_counter() - began)}

    def _moved(self, grip: Grip) -> list[Grip]:
        """A grip and its partner, where they are to be."""
        if not self._symmetric:
            return [grip]
        others = self._history.now.grips
        partner = self.moving.mirror.partner(grip, others) or self._new_partner(grip)
        if partner is None:
            return [grip]
        if partner.name == grip.name:
            return [self.moving.mirror.on_axis(grip)]
        return [grip, self.moving.mirror.followed(partner, grip)]

    def _new_partner(self, grip: Grip) -> Grip | None:
        """A grip on the other side, if there is a curve."""
        curves, image = self.moving.curves, self.moving.mirror.image(grip.rest)
        if grip.kind == FRAME:
            low, high = image.min(axis=0), image.max(axis=0)
            mine = np.array([grip.rest.min(axis=0), grip.rest.max(axis=0)])
            if (low < mine[1]).all() and (high > mine[0]).all():
                return None  # they would contradict each other
            points = evaluate(curves.was[:, None], np.linspace(0.0, 1.0, _POINTS)[None]).reshape(-1, 2)
            if not ((points >= low) & (points <= high)).all(axis=1).any():
                return None
            corners = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
            return Grip(self._new_name(), FRAME, corners, corners, grip.radius)
        curve, _t, rest, distance = curves.nearest_was.find(image[0])
        if (
            curve < 0
            or distance > self.moving.mirror.reach
            or self._history.now.frame_around(rest) is not None
        ):
            return None
        return Grip(self._new_name(), POINT, rest[None], rest[None], grip.radius)

    def _hold_far_side(self, grip: Grip) -> None:
        """A pin where the drawing is farthest from the only handle: else that would only shift everything."""
        points = self.whole.read.drawing.control[
            ~np.isin(self.whole.read.drawing.shape, self.whole.read.drawing.clips), 0
        ]
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

    def choose(self, hold: str, method: str, symmetric: bool, regular: bool = True) -> None:
        """What the bar says; `hold` and `method` as in `options.Options`, `regular` as in `Asked`."""
        self._latest += 1
        with self._lock:
            self._symmetric = symmetric
            self._history.now = replace(self._history.now, hold=hold, method=method, regular=regular)
            self._history.commit()
            self._take_options()

    def _take_options(self) -> None:
        now, before = self._history.now, self._options
        kinds = self._kinds if now.regular else frozenset()
        if (now.hold, now.method, kinds) == (before.hold, before.method, before.regular):
            return
        self._options = replace(before, hold=now.hold, method=now.method, regular=kinds)
        if (now.hold == APART) != (before.hold == APART):
            self.whole.read_for(self._options)
            self._regularities = None
        self.moving = Moving(self.whole.read, self.whole.keys, self._options, self._is_late)

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
            return {"paths": self._follow(0.0, latest), **self._lines(True)}

    def prepare(self) -> None:
        """Get ready for frames of the handles that there are, before one moves."""
        with self._lock:
            if self._history.now.grips:
                self.moving.ready(self._history.now)

    def _follow(self, tolerance: float, latest: int | None = None) -> Paths:
        """What a frame, or an answer, has changed of what is shown."""
        now = self._history.now
        if now.grips:
            self.moving.ready(now)
            self._refuse_late(latest)
        refitted = self.moving.follow(now, tolerance)
        self._refuse_late(latest)
        return self.moving.paths(refitted, self.page)

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

    # --- the whole document ---------------------------------------------------------------------

    def settle(self) -> dict[str, Any]:
        """A batch run of the handles as they are: what it has changed of what is shown.

        Raises SupersededError.
        """
        latest = self._latest
        with self._lock:
            settled = self._run(latest)
            changed = shown.changes(self.page, settled.page)
            self.page = settled.page.copy()  # frames change it
            drawn: dict[str, Any] = {"svg": self.page.text()} if changed is None else {"paths": changed}
            return {**drawn, "said": list(settled.said), "seconds": settled.seconds}

    def result(self) -> Any:
        """The tree that *Done* leaves, or None where the document is to stay as it is."""
        with self._lock:
            now = self._history.now
            if now.same(self._history.start) and not any(grip.moved for grip in now.grips):
                return None
            return self._run(None).tree

    def _run(self, latest: int | None) -> Settled:
        now = self._history.now
        if self._settled is None or not self._settled.asked.same(now):
            limits = replace(self._options.limits, stop=self._is_late)
            moving = self.moving
            with self._while_wanted(latest):
                settled = self.whole.run(
                    now, replace(self._options, limits=limits), lambda drawing: moving.known(drawing, now)
                )
            self._refuse_late(latest)
            self._settled = settled
        return self._settled
