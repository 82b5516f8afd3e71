# SPDX-License-Identifier: GPL-2.0-or-later
"""Which points the handles hold in the drawing that a run starts from, and where these are to go.

*A drawing that was never reshaped.*  A handle holds the point that the document contract says.

*The run starts from stored originals* (`originals`).  A handle that took part in an earlier run holds the
same point as then (`alup:rest`), if it still stands where that run left it (`alup:at`), or if it is of a kind
that is dragged.  Other handles lie on the curves as they are now: new ones, and pins and `from` handles that
were put elsewhere.  The point under such a handle is looked up in the original (`correspondence`); a pin
keeps it where it is now.  A new section holds what lies in it now.  Its rest is the rectangle under the
axis-aligned map that fits best from the curves in it to their originals.

*The run starts from the present state, although there are originals*, because something was edited.  A handle
holds the point where the last run left it.  If no curve is there any more, but one is under the handle, the
handle was moved together with the drawing, and is a pin.
"""

from __future__ import annotations

from functools import cached_property
from typing import Callable

import numpy as np

from ..geometry.bezier import Nearest
from ..messages.errors import HandleError
from ..messages.language import translate as _
from ..model import REACH_OF_DIAGONAL, Array, Handle, Section
from .followers.motion import Points, axis_aligned
from .handles.handle_objects import HandleObject
from .history.correspondence import Correspondence

# A handle whose position changed by less than this part of the diagonal was not moved, only rounded on
# saving.
SAME_OF_DIAGONAL = 1e-6


class Ground:
    """The curves that handles lie on.

    again : whether the run starts from originals; diagonal : of the drawing that the run starts from
    pairs : for each shape its curves now and in the drawing that the run starts from, (n, 4, 2) each
    correspondence : of these curves of all shapes; bystanders : all other curves, now
    The last two are computed only if a handle has to be looked up.
    """

    def __init__(
        self, again: bool, diagonal: float, pairs: Callable[[], list[tuple[Array, Array]]], bystanders: Array
    ):
        self.again, self.diagonal = again, diagonal
        self.pairs, self._bystanders = pairs, bystanders

    @cached_property
    def correspondence(self) -> Correspondence:
        return Correspondence(self.pairs())

    @cached_property
    def bystanders(self) -> Nearest:
        return Nearest(self._bystanders)

    def same(self, one: Array, other: Array) -> bool:
        return bool(np.abs(one - other).max() <= SAME_OF_DIAGONAL * self.diagonal)

    def reach(self, handle: HandleObject) -> float:
        return max(handle.radius, REACH_OF_DIAGONAL * self.diagonal)

    def is_on(self, point: Array, handle: HandleObject) -> bool:
        """Whether a point lies on the present curves of any object."""
        reach = self.reach(handle)
        return self.correspondence.locate(point).distance <= reach or self.bystanders.find(point)[3] <= reach


def followed(handles: list[HandleObject], motion: Array) -> bool:
    """Whether more handles took part in a (3, 3) motion than stayed."""
    scale = float(np.abs(motion[:2, 2]).max() + np.abs(motion[:2, :2] - np.eye(2)).max()) * 1e-3
    along = stayed = 0
    for handle in handles:
        if handle.at is None:
            continue
        now = handle.corners if handle.kind == "section" else handle.centre
        along += bool(np.abs(_under(motion, handle.at) - now).max() <= scale)
        stayed += bool(np.abs(handle.at - now).max() <= scale)
    return along > stayed


def move_along(handles: list[HandleObject], motion: Array) -> None:
    """Apply a (3, 3) motion of the drawing to the positions that handles have stored."""
    for handle in handles:
        if handle.at is not None and handle.rest is not None:
            handle.rest, handle.at = _under(motion, handle.rest), _under(motion, handle.at)


def _under(motion: Array, points: Array) -> Array:
    return points @ motion[:2, :2].T + motion[:2, 2]


def resolve(handles: list[HandleObject], ground: Ground | None) -> None:
    """Set `hold` and `stand` of all handles.

    ground : None for a drawing that was never reshaped.  Raises HandleError for a handle that lies on no
        curve.
    """
    for handle in handles:
        if handle.kind == "section":
            handle.hold = _section_hold(handle, ground)
        elif handle.kind == "to":
            continue
        elif ground is None:
            handle.hold = handle.centre if handle.rest is None or handle.kind != "handle" else handle.rest
        elif ground.again:
            _resolve_again(handle, ground)
        else:
            handle.hold = _base_hold(handle, ground)


def _resolve_again(handle: HandleObject, ground: Ground) -> None:
    """Set `hold` and `stand` of a handle for a run that starts from originals."""
    put = handle.at is not None and not ground.same(handle.at, handle.centre)
    if handle.rest is not None and (handle.kind == "handle" or not put):
        handle.hold = handle.rest
        return
    place, reach = ground.correspondence.locate(handle.centre), ground.reach(handle)
    if place.distance > reach:
        if ground.bystanders.find(handle.centre)[3] <= reach:
            handle.no_part = True
            return
        raise HandleError(
            _(
                "The handle {name} is not on a curve: the nearest one that is reshaped is {distance:.4g} "
                "away, at most {allowed:.4g} is allowed (user units). Move it onto a curve or delete it."
            ).format(name=handle.name, distance=place.distance, allowed=reach)
        )
    if ground.same(place.was, place.now):
        handle.hold = handle.centre
        return
    handle.hold = place.was
    if handle.kind != "from":
        handle.stand = place.now


def _base_hold(handle: HandleObject, ground: Ground) -> Array:
    """The point (2,) that a handle holds if the run starts from the present state."""
    if handle.kind != "handle" or handle.rest is None:
        return handle.centre
    if handle.at is None:
        return handle.rest
    only_itself = ground.is_on(handle.centre, handle) and not ground.is_on(handle.at, handle)
    return handle.centre if only_itself else handle.at


def _section_hold(handle: HandleObject, ground: Ground | None) -> Array:
    """Corners (4, 2) of a section's rectangle in the drawing that the run starts from."""
    if ground is None or (ground.again and handle.rest is not None):
        return handle.corners if handle.rest is None else handle.rest
    points = ground.correspondence.points()
    if not ground.again:
        before = handle.at if handle.at is not None else handle.rest
        if before is None or (not _inside(before, points).any() and _inside(handle.corners, points).any()):
            return handle.corners
        return before
    rest = rest_of(handle.corners, points)
    return handle.corners if ground.same(rest, handle.corners) else rest


def rest_of(corners: Array, points: Points) -> Array:
    """The rest of a new section: the image of its corners (4, 2) under the axis-aligned map of its content.

    points : curve points now (old) and in the drawing that the run starts from (new)
    """
    inside = _inside(corners, points)
    if not inside.any():
        return corners
    held = Points(points.old[inside], points.new[inside], points.weight[inside])
    return _under(axis_aligned(held), corners)


def _inside(corners: Array, points: Points) -> Array:
    """Which points, in their present positions, lie in a rectangle's bounds, (n,) bool."""
    return np.all((points.old >= corners.min(axis=0)) & (points.old <= corners.max(axis=0)), axis=1)


def wishes(handles: list[HandleObject], diagonal: float) -> tuple[tuple[Handle, ...], tuple[Section, ...]]:
    """The handles and sections for the solver.  Raises HandleError for incomplete or ambiguous pairs."""
    points: list[Handle] = []
    sections: list[Section] = []
    goals = goals_of(handles)
    for handle in handles:
        if handle.no_part or handle.kind == "to" or handle.hold is None:
            continue
        if handle.kind == "section":
            sections.append(section_of(handle.name, handle.hold, handle.corners))
            continue
        goal = goal_of(handle, goals)
        points.append(point_of(handle.name, handle.hold, goal, handle.radius, diagonal))
    return tuple(points), tuple(sections)


def goal_of(handle: HandleObject, goals: dict[str, HandleObject]) -> Array:
    """The target (2,) of the point that a handle holds.  goals : see `goals_of`"""
    goal = goals[handle.pair].centre if handle.kind == "from" else handle.stand
    return handle.centre if goal is None else goal


def goals_of(handles: list[HandleObject]) -> dict[str, HandleObject]:
    """The `to` of each pair.  Raises HandleError if one of a pair is missing or occurs twice."""
    origins, goals = _by_pair(handles, "from"), _by_pair(handles, "to")
    for pair in origins.keys() ^ goals.keys():
        there, missing = ("from", "to") if pair in origins else ("to", "from")
        lonely = (origins if pair in origins else goals)[pair]
        raise HandleError(
            _(
                "The handle {name} has no partner: add a circle labelled \u201calup:{missing} {pair}\u201d, "
                "or delete the one labelled \u201calup:{there} {pair}\u201d."
            ).format(name=lonely.name, missing=missing, there=there, pair=pair)
        )
    return goals


def _by_pair(handles: list[HandleObject], kind: str) -> dict[str, HandleObject]:
    result: dict[str, HandleObject] = {}
    for handle in handles:
        if handle.kind != kind:
            continue
        if handle.pair in result:
            raise HandleError(
                _(
                    "The handles {first} and {second} have the same label. "
                    "Give each pair of from and to a name of its own."
                ).format(first=result[handle.pair].name, second=handle.name)
            )
        result[handle.pair] = handle
    return result


def point_of(name: str, hold: Array, goal: Array, radius: float, diagonal: float) -> Handle:
    """The handle that moves the curve point `hold` (2,) to `goal` (2,), or pins it."""
    # A handle that was not dragged is a pin, even if its centre was rounded on saving.
    still = np.linalg.norm(goal - hold) <= SAME_OF_DIAGONAL * diagonal
    return Handle(name, hold, None if still else goal, radius)


def section_of(name: str, rest: Array, now: Array) -> Section:
    """The section that maps the rectangle with corners `rest` (4, 2) affinely to the corners `now` (4, 2).

    Raises HandleError for a rectangle without size.
    """
    linear_rest = np.stack([rest[1] - rest[0], rest[3] - rest[0]], axis=1)
    if not abs(np.linalg.det(linear_rest)) > 0.0:
        raise HandleError(
            _("The frame {name} has no size. Draw a rectangle around the part it holds.").format(name=name)
        )
    low = rest.min(axis=0)
    box = np.concatenate([low, rest.max(axis=0) - low])
    if np.array_equal(rest, now):
        return Section(name, box, np.eye(2, 3))
    linear = np.linalg.solve(linear_rest.T, np.stack([now[1] - now[0], now[3] - now[0]])).T
    return Section(name, box, np.column_stack([linear, now[0] - linear @ rest[0]]))
