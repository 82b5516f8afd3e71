# SPDX-License-Identifier: GPL-2.0-or-later
"""Halves that their mirrored clones complete: what lies on the axis stays on one.

A half touches its mirrored clone at the points that lie on the axis.  Usually no handle holds these points.
A run that moves one of them off the axis opens a gap, or makes an overlap, of twice that distance.  A shift
of the clone closes the gaps only if they are all equal, as when the whole drawing moves.

Let S be the mirror, q_i the positions of these points after a first run, and e_i = S q_i - q_i the gaps.  Let
e be the usual gap: the median over the points that the user's handles hold, or over all points if there are
none. A second run holds every point with another gap at q_i + (e_i - e) / 2, where its gap is e.  The points
that the user holds stay where he wants them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Iterator

import numpy as np

from ..model import Array, Drawing, Handle, Refitted
from .followers.clones import OPEN, TOUCH, Clone, matrix_of
from .reading import Document
from .tree.elements import Shape

# Greatest deviation of a matrix from a mirror.  Transforms written with six digits deviate by less.
_MIRROR = 1e-4


def held(document: Document, refitted: Refitted) -> Drawing | None:
    """The drawing with additional handles on seams that have opened, or None if none has.

    refitted : the result of a run without them
    """
    drawing = document.drawing
    start = np.searchsorted(refitted.source, np.arange(len(drawing.control) + 1))
    reach = float(drawing.size.max())
    known = [handle.rest for handle in drawing.handles]
    added: list[Handle] = []
    for parts in _mirrored(document):
        seam = [_Seam.of(shape, mirror, drawing, refitted, start, reach) for shape, mirror in parts]
        was, now, gap = (
            np.concatenate([getattr(one, name) for one in seam]) for name in ("was", "now", "gap")
        )
        names = [one.name for one in seam for _ in one.was]
        held_by_user = np.array([_is_near(point, known, reach) for point in was], dtype=bool)
        if not len(was):
            continue
        once = np.unique(np.round(was / (TOUCH * reach)), axis=0, return_index=True)[1]
        was, now, gap, held_by_user = was[once], now[once], gap[once], held_by_user[once]
        names = [names[n] for n in once]
        usual = np.median(gap[held_by_user] if held_by_user.any() else gap, axis=0)
        if not np.any(np.linalg.norm(gap - usual, axis=1) > OPEN * reach):
            continue
        for name, point, target in zip(names, was, now + (gap - usual) / 2.0):
            if not _is_near(point, known, reach):
                known.append(point)
                added.append(Handle(name, point, target, TOUCH * reach))
    return replace(drawing, handles=(*drawing.handles, *added)) if added else None


@dataclass(frozen=True)
class _Seam:
    """Nodes of a shape on a mirror axis before and after a run, and their gaps: (k, 2), root user units."""

    name: str
    was: Array
    now: Array
    gap: Array

    @classmethod
    def of(
        cls, shape: Shape, mirror: Array, drawing: Drawing, refitted: Refitted, start: Array, reach: float
    ) -> _Seam:
        first, last = shape.segments
        was = np.concatenate([drawing.control[first:last, 0], drawing.control[first:last, 3]])
        ends = start[first + 1 : last + 1] - 1
        now = np.concatenate([refitted.control[start[first:last], 0], refitted.control[ends, 3]])
        on = np.linalg.norm(_image(mirror, was) - was, axis=1) <= TOUCH * reach
        return cls(shape.name, was[on], now[on], _image(mirror, now[on]) - now[on])


def _is_near(point: Array, others: list[Array], reach: float) -> bool:
    return any(np.linalg.norm(point - other) <= TOUCH * reach for other in others)


def _mirrored(document: Document) -> Iterator[list[tuple[Shape, Array]]]:
    """For each mirrored clone its reshaped shapes, with the (3, 3) mirrors that map them to their images."""
    shapes = {shape.element: shape for shape in document.shapes if shape.origin is shape.element}
    for clone in document.clones:
        found = []
        for leaf in clone.leaves:
            shape = shapes.get(leaf.element)
            if shape is not None:
                map_ = _map_of(clone, leaf.path, shape)
                linear = map_[:2, :2]
                turned_back = np.abs(linear @ linear - np.eye(2)).max() <= _MIRROR
                if turned_back and np.linalg.det(linear) < 0.0:
                    found.append((shape, map_))
        if found:
            yield found


def _map_of(clone: Clone, path: tuple, shape: Shape) -> Array:
    return clone.outer @ matrix_of(path, {}) @ np.linalg.inv(shape.affine)


def _image(matrix: Array, points: Array) -> Array:
    return points @ matrix[:2, :2].T + matrix[:2, 2]
