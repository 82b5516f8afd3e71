"""What the stages hand to each other: frozen records of arrays.

Lengths are in the document's user units (the root viewBox, after every transform below the
root) unless a field says otherwise.  Arrays are never changed after they are put in a record.
S counts the segments of the drawing, C the curves of the welded network, N the samples, E the
edges between samples.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

Array = np.ndarray


@dataclass(frozen=True)
class Handle:
    """One wish of the user: this point of the curves goes there.

    name : what a message calls it, the object's id or label
    rest : (2,) point near the curve that is grabbed
    target : (2,) where the grabbed curve point goes; None leaves it where it is (a pin)
    reach : how far from `rest` the curve may be, before the drawing's own reach is applied
    """

    name: str
    rest: Array
    target: Array | None
    reach: float


@dataclass(frozen=True)
class Section:
    """All samples inside a rectangle follow one affine map.

    rest : (4,) x, y, width, height of the rectangle
    matrix : (2, 3) the affine map [A | b], x -> A x + b
    """

    name: str
    rest: Array
    matrix: Array


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
    """

    control: Array
    line: Array
    following: Array
    shape: Array
    names: tuple[str, ...]
    handles: tuple[Handle, ...] = ()
    sections: tuple[Section, ...] = ()
    bystanders: Array = field(default_factory=lambda: np.zeros((0, 4, 2)))

    @property
    def size(self) -> Array:
        """(2,) width and height of the bounding box of the curves."""
        return self.bounds[1] - self.bounds[0]

    @cached_property
    def bounds(self) -> Array:
        """(2, 2) least and greatest x, y over the curves (four points of each)."""
        from .bezier import evaluate

        t = np.linspace(0.0, 1.0, 9)
        points = evaluate(self.control[:, None], t[None, :])
        return np.array([points.min(axis=(0, 1)), points.max(axis=(0, 1))])

    @property
    def diagonal(self) -> float:
        return float(np.hypot(*self.size))
