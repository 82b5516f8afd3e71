# SPDX-License-Identifier: GPL-2.0-or-later
"""What the stages hand to each other: frozen records of arrays.

Lengths are in the document's user units (the root viewBox, after every transform below the
root) unless a field says otherwise.  Arrays are never changed after they are put in a record.
S counts the segments of the drawing, C the curves of the welded network, N the samples, E the
edges between samples.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Sequence

import numpy as np

from .geometry.arrays import Array, Bools, Floats, Ints
from .geometry.bezier import evaluate

__all__ = ["REACH_OF_DIAGONAL", "Alignments", "Array", "Drawing", "Handle", "Refitted", "Section", "Ties"]


# How far from a handle its curve may be, of the drawing's diagonal (the document contract).
REACH_OF_DIAGONAL = 0.01


@dataclass(frozen=True)
class Handle:
    """One wish of the user: this point of the curves goes there.

    name : what a message calls it, the object's id or label
    rest : (2,) point near the curve that is grabbed
    target : (2,) where the grabbed curve point goes; None leaves it where it is (a pin)
    reach : how far from `rest` the curve may be, user units, where that is more than REACH_OF_DIAGONAL
    """

    name: str
    rest: Floats
    target: Floats | None
    reach: float


@dataclass(frozen=True)
class Section:
    """All samples inside a rectangle follow one affine map.

    rest : (4,) x, y, width, height of the rectangle
    matrix : (2, 3) the affine map [A | b], x -> A x + b
    """

    name: str
    rest: Floats
    matrix: Floats


@dataclass(frozen=True)
class Drawing:
    """The curves to reshape, every segment a cubic, and the handles.

    control : (S, 4, 2) control points
    line : (S,) bool, drawn by a line command (its control points are at the thirds)
    following : (S,) index of the segment that goes on from this one's end in the same subpath
        (the first one after the last of a closed subpath), or -1
    shape : (S,) index into `names`
    names : the id of each shape, for messages
    bystanders : (B, 4, 2) curves of the document that are not to be reshaped; a handle on one of
        them, and on none of the drawing, is not for this run
    page : (2, 2) least and greatest x, y of the page; None where the document has none
    clips : the shapes, by their index, that only bound what is seen of others
    """

    control: Floats
    line: Bools
    following: Ints
    shape: Ints
    names: tuple[str, ...]
    handles: tuple[Handle, ...] = ()
    sections: tuple[Section, ...] = ()
    bystanders: Floats = field(default_factory=lambda: np.zeros((0, 4, 2)))
    page: Floats | None = None
    clips: tuple[int, ...] = ()

    @property
    def size(self) -> Array:
        """(2,) width and height of the bounding box of the curves."""
        return self.bounds[1] - self.bounds[0]

    @cached_property
    def bounds(self) -> Array:
        """(2, 2) least and greatest x, y over the curves (four points of each)."""
        t = np.linspace(0.0, 1.0, 9)
        points = evaluate(self.control[:, None], t[None, :])
        return np.array([points.min(axis=(0, 1)), points.max(axis=(0, 1))])

    @property
    def diagonal(self) -> float:
        return float(np.hypot(*self.size))


@dataclass(frozen=True)
class Ties:
    """What holds points of the curves together that no curve joins.  T ties.

    A tie holds sum_k factor_k v_k, the second of its two points minus the first, at an offset.

    samples : (T, 4) int, two for each of the two points; factor : (T, 4), of each adding up to -1 and 1
    offset : (T, 2) user units; length : (T,) user units, what a change of the offset is measured against
    weight : (T,) of the square of that; slide : (T,) part of it for changes across the offset
    holds : (T,) the strain at which it lets go, infinite if never
    """

    samples: Ints
    factor: Floats
    offset: Floats
    length: Floats
    weight: Floats
    slide: Floats
    holds: Floats

    def __len__(self) -> int:
        return len(self.weight)

    @staticmethod
    def none() -> Ties:
        """No ties."""
        return Ties.between(np.zeros((0, 2)), np.zeros((0, 2), dtype=int), np.zeros(0))

    @staticmethod
    def between(points: Array, pair: Array, weight: Array) -> Ties:
        """Ties of samples (T, 2) of points (N, 2) that hold offsets alike along and across, and for good."""
        offset = points[pair[:, 1]] - points[pair[:, 0]]
        count = len(pair)
        return Ties(
            samples=np.repeat(pair, 2, axis=1),
            factor=np.tile([-1.0, 0.0, 1.0, 0.0], (count, 1)),
            offset=offset,
            length=np.linalg.norm(offset, axis=1),
            weight=weight,
            slide=np.ones(count),
            holds=np.full(count, np.inf),
        )

    def of(self, which: Array) -> Ties:
        """Some of them, by a mask or numbers."""
        return Ties(*(getattr(self, one.name)[which] for one in fields(self)))

    def and_(self, others: Ties) -> Ties:
        """These and others."""
        return Ties(
            *(np.concatenate([getattr(self, one.name), getattr(others, one.name)]) for one in fields(self))
        )


@dataclass(frozen=True)
class Alignments:
    """T linear conditions along one axis each:  axis_t . sum_k factor_tk v_k = 0.

    samples : (T, 4) int; factor : (T, 4), in pairs as those of ties; axis : (T, 2) unit vectors
    length : (T,) user units, what a miss is measured against
    """

    samples: Ints
    factor: Floats
    axis: Floats
    length: Floats

    def of(self, which: Array) -> Alignments:
        """Some of them, by a mask or numbers."""
        return Alignments(self.samples[which], self.factor[which], self.axis[which], self.length[which])

    @staticmethod
    def together(several: Sequence[Alignments]) -> Alignments:
        """All of one or more."""
        names = (one.name for one in fields(Alignments))
        return Alignments(*(np.concatenate([getattr(one, name) for one in several]) for name in names))


@dataclass(frozen=True)
class Refitted:
    """The new segments, in the order of the drawing's.

    control : (M, 4, 2); line : (M,) bool; source : (M,) int, segment of the drawing, ascending
    smooth_start : (M,) bool, starts at an added node through which the curve runs smoothly
    error : largest distance between a moved sample and its curve, user units
    """

    control: Floats
    line: Bools
    source: Ints
    smooth_start: Bools
    error: float

    def of(self, before: Array) -> Refitted:
        """As segments of a drawing in which segment s of this one was before[s], (S,)."""
        source = before[self.source]
        order = np.argsort(source, kind="stable")
        return Refitted(
            self.control[order], self.line[order], source[order], self.smooth_start[order], self.error
        )
