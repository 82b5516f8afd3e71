# SPDX-License-Identifier: GPL-2.0-or-later
"""Path data for the frames of a drag, computed fast.

Frames between two complete solutions show the curves only.  Arcs become cubics, and coordinates are rounded
to what is visible.  Node types, markers, paints and all other followers are updated with the next solution,
which `writing` puts into the document.  The commands of the path data depend on the number of nodes only.  So
a frame needs one affine map of all points, and one formatting of numbers per shape.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..model import Array, Drawing, Refitted
from .reading import Document
from .tree.elements import Element, Shape

# Coordinates are rounded to this part of the diagonal, a hundredth of a pixel on a large screen.
ROUNDING_OF_DIAGONAL = 3e-6


def unmoved(drawing: Drawing) -> Refitted:
    """The unchanged segments of a drawing as a `Refitted`."""
    count = len(drawing.control)
    return Refitted(drawing.control, drawing.line, np.arange(count), np.zeros(count, dtype=bool), 0.0)


@dataclass(frozen=True)
class _Formats:
    """Format strings for the path data of all shapes, for one number of nodes.

    point : (P,) indices of the control points (M, 4, 2), flattened, in the order in which they are written
    linear, shift : (P, 2, 2), (P, 2) map of each from root user units to own coordinates
    begin : (shapes + 1,) index of each shape's first point; text : format of each shape
    """

    source: Array
    line: Array
    point: Array
    linear: Array
    shift: Array
    begin: Array
    text: tuple[str, ...]


class Outlines:
    """The path data of a document's shapes, from frame to frame."""

    def __init__(self, document: Document):
        self._shapes = document.shapes
        self._diagonal = document.drawing.diagonal
        rest = unmoved(document.drawing)
        self._words = self._compiled(rest)
        self._last = self._data(rest)

    def changed(self, refitted: Refitted, every: bool = False) -> dict[Element, str]:
        """New path data of elements whose outlines differ from the last frame, at first from the drawing.

        every : return all elements
        """
        words = self._words
        if not (np.array_equal(words.source, refitted.source) and np.array_equal(words.line, refitted.line)):
            self._words = self._compiled(refitted)
        data, last = self._data(refitted), self._last
        self._last = data
        return {
            shape.element: now for shape, now, was in zip(self._shapes, data, last) if every or now != was
        }

    def _data(self, refitted: Refitted) -> list[str]:
        words = self._words
        points = refitted.control.reshape(-1, 2)[words.point]
        own = np.einsum("pij,pj->pi", words.linear, points) + words.shift
        numbers, begin = own.ravel().tolist(), words.begin.tolist()
        return [
            text % tuple(numbers[start:end]) for text, start, end in zip(words.text, begin[:-1], begin[1:])
        ]

    def _compiled(self, refitted: Refitted) -> _Formats:
        start = np.searchsorted(refitted.source, np.arange(self._segments + 1))
        rounding = ROUNDING_OF_DIAGONAL * self._diagonal
        point: list[int] = []
        text, begin, linear, shift = [], [0], [], []
        for shape in self._shapes:
            before = len(point)
            text.append(_format(shape, start, refitted.line, shape.decimals(rounding), point))
            begin.append(2 * len(point))
            inverse = np.linalg.inv(shape.matrix[:, :2])
            many = len(point) - before
            linear.append(np.broadcast_to(inverse, (many, 2, 2)))
            shift.append(np.broadcast_to(-inverse @ shape.matrix[:, 2], (many, 2)))
        return _Formats(
            refitted.source,
            refitted.line,
            np.array(point, dtype=int),
            np.concatenate(linear),
            np.concatenate(shift),
            np.array(begin),
            tuple(text),
        )

    @property
    def _segments(self) -> int:
        return max(shape.segments[1] for shape in self._shapes)


def _format(shape: Shape, start: Array, line: Array, decimals: int, point: list[int]) -> str:
    """The format of a shape's path data; the indices of its control points are appended to `point`.

    start : (S + 1,) index of the first piece of each segment of the drawing; line : (M,) bool
    """
    pair = f"%.{decimals}f,%.{decimals}f"
    words: list[str] = []
    segment = shape.segments[0]
    for subpath in shape.subpaths:
        count = max(len(subpath.control), 1)
        first, last = int(start[segment]), int(start[segment + count])
        segment += count
        words.append(f"M {pair}")
        point.append(4 * first)
        for piece in range(first, last) if len(subpath.control) else ():
            if line[piece]:
                words.append(f"L {pair}")
                point.append(4 * piece + 3)
            else:
                words.append(f"C {pair} {pair} {pair}")
                point.extend(range(4 * piece + 1, 4 * piece + 4))
        if subpath.closed:
            words.append("Z")
    return " ".join(words)
