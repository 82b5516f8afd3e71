# SPDX-License-Identifier: GPL-2.0-or-later
"""Motions of shapes: old and new curve points, and the simple map that fits them best.

Attachments of a shape, such as a gradient or a text inside, can't follow every bend.  They follow by a
least-squares map over curve points, with p old, q new, weights w:

    axis-aligned   min  sum w |diag(s) p + t - q|^2      a scale and a shift for each axis
    similarity     min  sum w |s p + t - q|^2            one scale, no rotation
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.bezier import evaluate, polygon_lengths
from ...model import Array, Refitted
from ..tree.elements import Shape

# Number of points per segment.
POINTS = 9

# If the extent along one axis is smaller than this part of the other one, its scale is not fitted.  At this
# limit the solver's accuracy of 1e-7 of the diagonal still determines the scale to 1e-4.
THIN = 1e-3

# Least scale of a fitted map.  With a scale of zero nothing would be drawn.
SMALLEST_SCALE = 1e-2

# Maps are equal if they differ by less than this, in scale or as a part of the extent.  Maps of shapes that
# move together differ by rounding of the solver.  A change of a gradient by 1e-4 is invisible.
SAME = 1e-4


@dataclass(frozen=True)
class Points:
    """Corresponding curve points.

    old, new : (n, 2)
    weight : (n,) the length of curve that each represents
    """

    old: Array
    new: Array
    weight: Array

    def under(self, matrix: Array) -> Points:
        """The points in other coordinates.  matrix : (3, 3)"""
        linear, shift = matrix[:2, :2], matrix[:2, 2]
        return Points(self.old @ linear.T + shift, self.new @ linear.T + shift, self.weight)

    @property
    def extent(self) -> float:
        return float(np.ptp(self.old, axis=0).max())


@dataclass(frozen=True)
class Moved:
    """A shape's segments before and after, root user units.

    old : (s, 4, 2); control : (m, 4, 2); source : (m,) index into old; line, smooth_start : (m,) bool
    changed : whether any point moved by more than rounding
    """

    old: Array
    control: Array
    source: Array
    line: Array
    smooth_start: Array
    changed: bool

    @property
    def points(self) -> Points:
        t = np.linspace(0.0, 1.0, POINTS)
        old = evaluate(self.old[:, None], t[None, :])
        count = np.bincount(self.source, minlength=len(self.old))
        first = np.searchsorted(self.source, np.arange(len(self.old)))
        new = evaluate(self.control[first][:, None], t[None, :])
        # In a divided segment, points at equal fractions of the length correspond.
        for n in np.flatnonzero(count > 1):
            pieces = self.control[first[n] : first[n] + count[n]]
            dense = evaluate(pieces[:, None], np.linspace(0.0, 1.0, 4 * POINTS)[None, :]).reshape(-1, 2)
            before = evaluate(self.old[n][None], np.linspace(0.0, 1.0, 4 * POINTS))
            at = np.interp(t, np.linspace(0.0, 1.0, 4 * POINTS), _fraction(before))
            along = _fraction(dense)
            new[n] = np.stack([np.interp(at, along, dense[:, axis]) for axis in (0, 1)], axis=1)
        weight = np.repeat(polygon_lengths(self.old) / POINTS, POINTS)
        return Points(old.reshape(-1, 2), new.reshape(-1, 2), weight)


def _fraction(points: Array) -> Array:
    """The fraction of a polyline's length up to each of its points, (k, 2) -> (k,)."""
    length = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    return length / length[-1] if length[-1] > 0 else np.linspace(0.0, 1.0, len(points))


def moved_shape(shape: Shape, control: Array, refitted: Refitted, start: Array, unmoved: float) -> Moved:
    """The motion of a shape.

    control : (S, 4, 2) of the drawing; start : (S + 1,) index of each segment's first piece in `refitted`
    unmoved : user units, moves up to this are rounding
    """
    first, last = shape.segments
    part = slice(start[first], start[last])
    old, new = control[first:last], refitted.control[part]
    changed = len(new) != len(old) or bool(np.abs(new - old).max(initial=0.0) > unmoved)
    source = refitted.source[part] - first
    return Moved(old, new, source, refitted.line[part], refitted.smooth_start[part], changed)


def joined(points: list[Points]) -> Points:
    return Points(
        np.concatenate([p.old for p in points]),
        np.concatenate([p.new for p in points]),
        np.concatenate([p.weight for p in points]),
    )


def of_corners(corners: Array, move: Array) -> Points:
    """Points of an object that moved as a whole.  corners : (k, 2); move : (3, 3)"""
    return Points(corners, corners @ move[:2, :2].T + move[:2, 2], np.full(len(corners), 1.0 / len(corners)))


def axis_aligned(points: Points) -> Array:
    """The best-fitting scale and shift along each axis, (3, 3)."""
    p, q, mean_p, mean_q, w = _centred(points)
    variance = w @ p**2
    wide = variance > THIN**2 * variance.max()
    scale = _not_flat(np.where(wide, (w @ (p * q)) / np.where(wide, variance, 1.0), 1.0))
    matrix = np.diag([scale[0], scale[1], 1.0])
    matrix[:2, 2] = mean_q - scale * mean_p
    return matrix


def similarity(points: Points) -> Array:
    """The best-fitting uniform scale and shift, (3, 3)."""
    p, q, mean_p, mean_q, w = _centred(points)
    variance = float(w @ (p**2).sum(axis=1))
    scale = float(w @ (p * q).sum(axis=1)) / variance if variance > 0.0 else 1.0
    scale = max(scale, SMALLEST_SCALE)
    matrix = np.diag([scale, scale, 1.0])
    matrix[:2, 2] = mean_q - scale * mean_p
    return matrix


def near(points: Points, centre: Array, radius: float) -> Points:
    """The points with weights that decrease with the distance from a centre, to a quarter at `radius`."""
    away = np.linalg.norm(points.old - centre, axis=1) / radius
    return Points(points.old, points.new, points.weight / (1.0 + away**2) ** 2)


def _centred(points: Points) -> tuple[Array, Array, Array, Array, Array]:
    weight = points.weight if points.weight.any() else np.ones(len(points.weight))
    weight = weight / weight.sum()
    mean_p, mean_q = weight @ points.old, weight @ points.new
    return points.old - mean_p, points.new - mean_q, mean_p, mean_q, weight


def _not_flat(scale: Array) -> Array:
    return np.where(np.abs(scale) < SMALLEST_SCALE, np.copysign(SMALLEST_SCALE, scale), scale)


def same_map(a: Array, b: Array, points: Points) -> bool:
    """Whether two (3, 3) maps move the points equally, to SAME of their extent."""
    low, high = points.old.min(axis=0), points.old.max(axis=0)
    corners = np.array([[low[0], low[1], 1.0], [high[0], high[1], 1.0]])
    size = max(float((high - low).max()), 1e-300)
    linear = np.abs(a[:2, :2] - b[:2, :2]).max() <= SAME
    return bool(linear and np.abs(corners @ (a - b).T).max() <= SAME * size)
