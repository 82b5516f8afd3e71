"""Halves that their mirrored clones complete: what lies on the axis stays on it.

The points of a half that lie on the axis are where its clone touches it.  No handle of the user need hold
them, and what a run takes off the axis makes a gap, or an overlap, twice as wide, which no shift of the clone
closes.  So where a first run has done that, they are held in a second one, each at the foot of the
perpendicular from where the first one took it.  Those that the user holds stay the user's.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Iterator

import numpy as np

from ..model import Array, Drawing, Handle
from ..refit import Refitted
from .clones import OPEN, TOUCH, Clone, matrix_of
from .reading import Document
from .tree import Shape

# What matrices of six digits leave of a mirror.
_MIRROR = 1e-4


def held(document: Document, refitted: Refitted) -> Drawing | None:
    """The drawing with handles on the seams; None where none has opened.  refitted : of a run without them"""
    drawing = document.drawing
    start = np.searchsorted(refitted.source, np.arange(len(drawing.control) + 1))
    reach = float(drawing.size.max())
    known = [handle.rest for handle in drawing.handles]
    added: list[Handle] = []
    for shape, mirror in _mirrored(document):
        first, last = shape.segments
        was = np.concatenate([drawing.control[first:last, 0], drawing.control[first:last, 3]])
        now = np.concatenate(
            [refitted.control[start[first:last], 0], refitted.control[start[first + 1 : last + 1] - 1, 3]]
        )
        seam = np.linalg.norm(_image(mirror, was) - was, axis=1) <= TOUCH * reach
        if not np.any(np.linalg.norm(_image(mirror, now) - now, axis=1)[seam] > OPEN * reach):
            continue
        foot = (now + _image(mirror, now)) / 2.0
        for point, target in zip(was[seam], foot[seam]):
            if all(np.linalg.norm(point - other) > TOUCH * reach for other in known):
                known.append(point)
                added.append(Handle(shape.name, point, target, TOUCH * reach))
    return replace(drawing, handles=(*drawing.handles, *added)) if added else None


def _mirrored(document: Document) -> Iterator[tuple[Shape, Array]]:
    """Reshaped shapes, and the (3, 3) mirror that takes each to where a clone shows it, root user units."""
    shapes = {shape.element: shape for shape in document.shapes if shape.origin is shape.element}
    for clone in document.clones:
        for leaf in clone.leaves:
            shape = shapes.get(leaf.element)
            if shape is not None:
                map_ = _map_of(clone, leaf.path, shape)
                linear = map_[:2, :2]
                turned_back = np.abs(linear @ linear - np.eye(2)).max() <= _MIRROR
                if turned_back and np.linalg.det(linear) < 0.0:
                    yield shape, map_


def _map_of(clone: Clone, path: tuple, shape: Shape) -> Array:
    return clone.outer @ matrix_of(path, {}) @ np.linalg.inv(shape.affine)


def _image(matrix: Array, points: Array) -> Array:
    return points @ matrix[:2, :2].T + matrix[:2, 2]
