# SPDX-License-Identifier: GPL-2.0-or-later
"""Clones: each keeps its position on the curves around it, as a text or an image does.

A clone shows its original in another position.  If the original has no part in the run, the clone is moved as
a whole.  Otherwise it automatically gets the new shape and size, under its old transform.  But a mirrored or
rotated clone then moves in another direction than the curves around it.  Therefore its transform gets an
additional shift

    t = sum w_i (m(p_i) - q_i) / sum w_i

p_i are points of the clone before the run, q_i the same points with the reshaped original, and m(p_i) the
images of p_i under the motion of the curves around the clone.  The weights w_i decrease with the distance
from these curves.  If the clone touches the curves, only the touching points count, and they remain in
contact.

The clone is not shifted if that gains nothing: if sum w_i |m(p_i) - q_i - t| is no smaller than with t = 0.
(The petals of a flower are all reshaped about its centre.)  It is not shifted either if it has a seam with
its own original that no shift can close.  Then the handles that hold the seam determine the clone.

If a clone of fixed size touches a side that is stretched, not all touching points can be kept, and the clone
slides along the side.  If a corner of that side is within the clone's own size, the clone moves with the
corner, as a wheel does with the front of a truck, provided that touching points still lie on curves.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ...geometry.bezier import evaluate
from ...messages.errors import DocumentError
from ...model import Array
from ...svg import basic_shapes
from ..tree.elements import (
    CARRIED,
    CONTAINERS,
    Element,
    Shape,
    length_reader,
    local_tag,
    name_of,
    own_matrix,
    read_shape,
    transform_text,
)
from ..tree.pending_changes import Changes
from ..tree.references import Ids
from ..tree.styles import Styles
from .motion import POINTS, Moved, Points, axis_aligned, joined, near
from .texts_and_images import Carried, extent, motion_of

# As parts of the extent of all curves: points nearer than TOUCH are in contact; a gap above OPEN is visible.
# Chosen by looking at the cases.
TOUCH, OPEN = 2e-3, 5e-3

# Weights fall to a quarter at this part of the clone's size beyond its nearest point.  Chosen by looking at
# the cases.
_FALL = 0.05

# Greatest number of parts into which the distance of two samples is divided; enough for one as long as the
# extent.
_MOST_SUBDIVISIONS = 500

# Cosine of the least angle of a corner.
_CORNER = np.cos(np.radians(30.0))

# Moves below this part of the extent are rounding of the solver.
_ROUNDING = 1e-7

# Parameters at which a segment of a clone is sampled.
_PARTS = np.linspace(0.0, 1.0, 9)


@dataclass(frozen=True)
class Leaf:
    """An element that a clone draws.

    path : the elements whose transforms apply in order, from the clone to the leaf itself
    """

    element: Element
    path: tuple[Element, ...]


@dataclass
class Clone:
    """A clone.

    outer : (3, 3) coordinates of its parent -> root user units
    leaves : the elements that it draws
    """

    element: Element
    name: str
    outer: Array
    leaves: list[Leaf] = field(default_factory=list)

    def shows(self, elements: set[Element]) -> bool:
        return any(not elements.isdisjoint((leaf.element, *leaf.path[1:])) for leaf in self.leaves)


def read_clone(element: Element, outer: Array, ids: Ids, styles: Styles) -> Clone | None:
    """The clone of a use element; None if it draws nothing that can be found."""
    leaves: list[Leaf] = []
    stack: list[tuple[Element, tuple[Element, ...]]] = [(element, ())]
    while stack:
        part, path = stack.pop()
        tag = local_tag(part)
        if not tag or part in path or styles.own(part, "display") == "none":
            continue
        here = (*path, part)
        if tag == "use":
            target = ids.href(part)
            if target is not None:
                stack.append((target, here))
        elif tag in CONTAINERS or (tag in ("symbol", "svg") and path and local_tag(path[-1]) == "use"):
            stack += [(child, here) for child in part]
        elif tag == "path" or tag in basic_shapes.TAGS or tag in CARRIED:
            leaves.append(Leaf(part, here))
    return Clone(element, name_of(element), outer, leaves) if leaves else None


def matrix_of(path: tuple[Element, ...], planned: dict[Element, Array]) -> Array:
    """The matrix (3, 3) from the coordinates of the last element to those of the first one's parent.

    planned : the future transforms of elements
    """
    matrix = np.eye(3)
    for element in path:
        matrix = matrix @ (planned[element] if element in planned else own_matrix(element))
        if local_tag(element) == "use":
            length = length_reader(element, name_of(element))
            shift = np.eye(3)
            shift[:2, 2] = length("x") or 0.0, length("y") or 0.0
            matrix = matrix @ shift
    return matrix


class Followers:
    """Moves clones; clones that are shown by other clones come first.

    surroundings : points of all drawn curves; moved : motions of shapes, by identity
    planned : the future transforms of texts, images and clones
    """

    def __init__(
        self, surroundings: Points, drawn: list[Shape], moved: dict[int, Moved], planned: dict[Element, Array]
    ):
        self.planned = planned
        self.gaping: list[Clone] = []
        self._surroundings = surroundings
        self._moved = {shape.element: (shape, moved[id(shape)]) for shape in drawn}

    def follow(self, clones: list[Clone], styles: Styles, changes: Changes) -> dict[Element, Points]:
        """Plan the clones' transforms.  Returns points of each before and after, root user units."""
        waiting = {clone.element: clone for clone in clones}
        found: dict[Element, Points] = {}
        while waiting:
            ready = [c for c in waiting.values() if not c.shows(waiting.keys() - {c.element})]
            for clone in ready or list(waiting.values()):
                points = self._follow(clone, styles, changes)
                if points is not None:
                    found[clone.element] = points
                del waiting[clone.element]
        return found

    def _follow(self, clone: Clone, styles: Styles, changes: Changes) -> Points | None:
        before, after = self._points(clone, styles)
        if not len(before):
            return None
        around = self._surroundings
        limit = _ROUNDING * around.extent
        reshaped = any(leaf.element in self._moved for leaf in clone.leaves)
        if np.abs(before - after).max() <= limit and not reshaped:
            whole = Carried(clone.element, clone.name, clone.outer, _corners(before))
            move = motion_of(whole, around)
        else:
            move = self._shift(clone, before, after)
        moved = after @ move[:2, :2].T + move[:2, 2]
        if np.abs(moved - after).max() > limit:
            own = np.linalg.solve(clone.outer, move @ clone.outer) @ own_matrix(clone.element)
            self.planned[clone.element] = own
            changes.attributes.append((clone.element, "transform", transform_text(own)))
        if self._gapes(before, moved):
            self.gaping.append(clone)
        return Points(before, moved, np.full(len(before), 1.0 / len(before)))

    def _points(self, clone: Clone, styles: Styles) -> tuple[Array, Array]:
        """Points of a clone before the run, and after it by its originals alone: (n, 2), root user units."""
        none = np.zeros((0, 2))
        old, new = [none], [none]
        for leaf in clone.leaves:
            if leaf.element in self._moved:
                shape, motion = self._moved[leaf.element]
                own = motion.points.under(np.linalg.inv(shape.affine))
                was, now = own.old, own.new
            else:
                was = now = _still(leaf.element, styles)
            for points, planned, found in ((was, {}, old), (now, self.planned, new)):
                matrix = clone.outer @ matrix_of(leaf.path, planned)
                found.append(points @ matrix[:2, :2].T + matrix[:2, 2])
        return np.concatenate(old), np.concatenate(new)

    @cached_property
    def _dense(self) -> tuple[Points, Any]:
        """The surroundings, so dense that a touching point is near one of them, and their search tree."""
        dense = _filled(self._surroundings, TOUCH * self._surroundings.extent)
        return dense, _tree(dense.old)

    def _nearest(self, points: Array) -> tuple[Array, Array, Array]:
        """Distances (n,) to the surroundings, and their nearest points (n, 2) before and after."""
        dense, tree = self._dense
        away, which = tree.query(points)
        return away, dense.old[which], dense.new[which]

    def _shift(self, clone: Clone, before: Array, after: Array) -> Array:
        """The shift (3, 3) that keeps a clone's position on the curves around it."""
        around = self._surroundings
        size = max(float(np.hypot(*np.ptp(before, axis=0))), 1e-300)
        away, here, gone = self._nearest(before)
        touching = away <= TOUCH * around.extent
        weight = 1.0 / (1.0 + ((away - away.min()) / (_FALL * size + away.min())) ** 2) ** 2
        if touching.any():
            weight = weight * touching
        weight = weight / weight.sum()
        fit = axis_aligned(near(around, weight @ before, size))
        goal = before @ fit[:2, :2].T + fit[:2, 2]
        there = here @ fit[:2, :2].T + fit[:2, 2]
        goal[touching] += (gone - there)[touching]
        off = goal - after
        shift = weight @ off
        move = np.eye(3)
        seam = touching & self._is_on_original(clone, before)
        torn = np.linalg.norm(off - shift, axis=1) > OPEN * around.extent
        if np.any(torn & seam):
            return move
        if np.any(torn & touching):
            by_corner = self._of_corners_near(before[touching], before)
            if by_corner is not None:
                slid = move.copy()
                slid[:2, 2] = weight @ (before + by_corner - after)
                if not self._gapes(before, after + slid[:2, 2]):
                    return slid
        if weight @ np.linalg.norm(off - shift, axis=1) < weight @ np.linalg.norm(off, axis=1):
            move[:2, 2] = shift
        return move

    def _is_on_original(self, clone: Clone, points: Array) -> Array:
        """Which of the points (n, 2) touch the clone's original, (n,) bool."""
        shown = [self._moved[leaf.element] for leaf in clone.leaves if leaf.element in self._moved]
        if not shown:
            return np.zeros(len(points), dtype=bool)
        reach = TOUCH * self._surroundings.extent
        curves = joined([motion.points for _, motion in shown])
        return _tree(_filled(curves, reach).old).query(points)[0] <= reach

    def _of_corners_near(self, touching: Array, clone: Array) -> Array | None:
        """The common move (2,) of the curves' corners near a clone; None if there is none, or if they differ.

        touching, clone : (n, 2) the touching points of the clone, and all its points
        """
        reach, near_it = float(np.ptp(clone, axis=0).max()), _tree(clone)
        found = [np.zeros((0, 2))]
        for _, motion in self._moved.values():
            if _tree(motion.points.old).query(touching)[0].min() > reach:
                continue
            was, now = _corners_of(motion)
            close = near_it.query(was)[0] <= reach if len(was) else np.zeros(0, dtype=bool)
            found.append((now - was)[close])
        moves = np.concatenate(found)
        if not len(moves) or np.ptp(moves, axis=0).max() > OPEN * self._surroundings.extent:
            return None
        return moves.mean(axis=0)

    def _gapes(self, before: Array, moved: Array) -> bool:
        """Whether points that touched curves are now off all curves; they may have slid along them."""
        around = self._surroundings
        touching = self._nearest(before)[0] <= TOUCH * around.extent
        if not touching.any():
            return False
        away = _tree(self._dense[0].new).query(moved[touching])[0]
        return bool(np.any(away > OPEN * around.extent))


def _corners_of(motion: Moved) -> tuple[Array, Array]:
    """Corners of a shape before and after, (k, 2) each, root user units."""
    old = motion.old
    first = np.searchsorted(motion.source, np.arange(len(old)))
    leaving, arriving = _directions(old), -_directions(old[:, ::-1])
    away, ending = _tree(old[:, 3]).query(old[:, 0])
    joins = away <= _ROUNDING * np.ptp(old.reshape(-1, 2), axis=0).max()
    turn = joins & ((leaving * arriving[ending]).sum(axis=1) < _CORNER)
    return old[turn, 0], motion.control[first[turn], 0]


def _directions(control: Array) -> Array:
    """Unit vectors (s, 2) of the start directions of segments; zero for segments without length."""
    arms = control[:, 1:] - control[:, :1]
    length = np.linalg.norm(arms, axis=2)
    chosen = np.argmax(length > _ROUNDING * np.maximum(length.max(axis=1, keepdims=True), 1e-300), axis=1)
    rows = np.arange(len(control))
    return arms[rows, chosen] / np.maximum(length[rows, chosen], 1e-300)[:, None]


def _filled(points: Points, step: float) -> Points:
    """The points with linearly interpolated ones between neighbours, at distances of at most `step`."""
    old, new = (part.reshape(-1, POINTS, 2) for part in (points.old, points.new))
    length = np.linalg.norm(np.diff(old, axis=1), axis=2)
    pieces = np.minimum(np.ceil(length / max(step, 1e-300)), _MOST_SUBDIVISIONS).astype(int)
    segment, place = np.nonzero(pieces > 1)
    count = pieces[segment, place]
    row = np.repeat(np.arange(len(count)), count - 1)
    part = np.arange(len(row)) - np.repeat(np.cumsum(count - 1) - (count - 1), count - 1) + 1
    t = (part / count[row])[:, None]
    found = [(1.0 - t) * one[segment, place][row] + t * one[segment, place + 1][row] for one in (old, new)]
    old, new = (np.concatenate([one.reshape(-1, 2), more]) for one, more in zip((old, new), found))
    return Points(old, new, np.ones(len(old)))


def _tree(points: Array) -> Any:
    from scipy.spatial import cKDTree  # takes 0.1 s to import; most drawings have no clone

    return cKDTree(points)


def _still(element: Element, styles: Styles) -> Array:
    """Points (n, 2) of an element that is not reshaped, own coordinates; none if it can't be read."""
    if local_tag(element) in CARRIED:
        return extent(element, styles)
    try:
        shape = read_shape(element, np.eye(3)[:2])
    except DocumentError:
        return np.zeros((0, 2))  # it has no part in this run
    return (
        evaluate(shape.control[:, None], _PARTS[None]).reshape(-1, 2) if shape.subpaths else np.zeros((0, 2))
    )


def _corners(points: Array) -> Array:
    (x, y), (u, v) = points.min(axis=0), points.max(axis=0)
    return np.array([[x, y], [u, y], [u, v], [x, v]])
