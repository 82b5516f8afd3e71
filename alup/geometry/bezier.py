# SPDX-License-Identifier: GPL-2.0-or-later
"""Arithmetic of cubic Bezier curves, vectorised over arrays of curves.

    B(t) = (1-t)^3 P0 + 3 (1-t)^2 t C1 + 3 (1-t) t^2 C2 + t^3 P1

Control points are arrays (..., 4, 2), parameters arrays that broadcast against (...).  A line is a
cubic with its control points at the thirds, so that its parameter is its arc length.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from .arrays import Array

# Gauss-Legendre abscissae and weights on [0, 1].  4 points integrate the speed of an ordinary quarter turn to
# 1e-7, and callers use several intervals a curve.  They are written out, because numpy computes them as
# eigenvalues, which takes longer than the rest of this module.
_ROOTS = np.sqrt(3.0 / 7.0 + np.array([2.0, -2.0, -2.0, 2.0]) / 7.0 * np.sqrt(1.2))
_GAUSS_X = 0.5 + 0.5 * np.array([-1.0, -1.0, 1.0, 1.0]) * _ROOTS
_GAUSS_W = 0.25 + np.array([-1.0, 1.0, 1.0, -1.0]) * np.sqrt(30.0) / 72.0


def basis(t: Array) -> Array:
    """Bernstein basis.  t : (...) -> (..., 4)."""
    t = np.asarray(t, dtype=float)
    s = 1.0 - t
    return np.stack([s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t], axis=-1)


def evaluate(control: Array, t: Array) -> Array:
    """Points of cubics.  control : (..., 4, 2), t : (...) -> (..., 2)."""
    return np.einsum("...k,...kd->...d", basis(t), control)


def derivative(control: Array, t: Array) -> Array:
    """First derivatives dB/dt.  control : (..., 4, 2), t : (...) -> (..., 2)."""
    t = np.asarray(t, dtype=float)
    s = 1.0 - t
    weights = np.stack([s * s, 2.0 * s * t, t * t], axis=-1)
    return 3.0 * np.einsum("...k,...kd->...d", weights, np.diff(control, axis=-2))


def second_derivative(control: Array, t: Array) -> Array:
    """Second derivatives.  control : (..., 4, 2), t : (...) -> (..., 2)."""
    t = np.asarray(t, dtype=float)
    weights = np.stack([1.0 - t, t], axis=-1)
    return 6.0 * np.einsum("...k,...kd->...d", weights, np.diff(control, n=2, axis=-2))


def from_line(start: Array, end: Array) -> Array:
    """Lines as cubics.  start, end : (..., 2) -> (..., 4, 2)."""
    thirds = np.array([0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0])[:, None]
    control = start[..., None, :] + thirds * (end - start)[..., None, :]
    control[..., 3, :] = end  # start + 1.0 (end - start) need not be end in floating point
    return control


def subrange(control: Array, t0: Array, t1: Array) -> Array:
    """The parts of cubics between two parameters, by blossoms b(t0,t0,t0), b(t0,t0,t1), ....

    control : (..., 4, 2); t0, t1 : (...) -> (..., 4, 2)
    """

    def blossom(a: Array, b: Array, c: Array) -> Array:
        points = control
        for u in (a, b, c):
            u = np.asarray(u, dtype=float)[..., None, None]
            points = (1.0 - u) * points[..., :-1, :] + u * points[..., 1:, :]
        return points[..., 0, :]

    corners = ((t0, t0, t0), (t0, t0, t1), (t0, t1, t1), (t1, t1, t1))
    return np.stack([blossom(*corner) for corner in corners], axis=-2)


def polygon_lengths(control: Array) -> Array:
    """Lengths of the control polygons, which are upper bounds of the arc lengths.  (..., 4, 2) -> (...)."""
    return np.linalg.norm(np.diff(control, axis=-2), axis=-1).sum(axis=-1)


def arc_length_table(control: Array, intervals: Array) -> tuple[Array, Array, Array]:
    """Arc length against parameter, tabulated at equal steps of the parameter.

    control : (C, 4, 2); intervals : (C,) int >= 1, steps of each curve
    Returns start (C+1,) where each curve's entries begin, t and s (start[-1],) with intervals + 1
    entries a curve; s is 0 at each curve's beginning and its arc length at its end.
    """
    intervals = np.asarray(intervals)
    owner = np.repeat(np.arange(len(control)), intervals)
    step_start = np.concatenate([[0], np.cumsum(intervals)])
    k = np.arange(len(owner)) - step_start[owner]
    width = 1.0 / intervals[owner]
    t = (k[:, None] + _GAUSS_X) * width[:, None]
    speed = np.linalg.norm(derivative(control[owner][:, None], t), axis=-1)
    piece = (speed @ _GAUSS_W) * width
    start = np.concatenate([[0], np.cumsum(intervals + 1)])
    entries = start[-1]
    s, parameter = np.zeros(entries), np.zeros(entries)
    slot = np.arange(len(owner)) + owner + 1  # one leading entry for every curve so far
    total = np.cumsum(piece)
    before = np.concatenate([[0.0], total])[step_start[owner]]
    s[slot] = total - before
    parameter[slot] = (k + 1) * width
    return start, parameter, s


def arc_lengths(control: Array, intervals: int = 8) -> Array:
    """Arc lengths.  (C, 4, 2) -> (C,)."""
    if not len(control):
        return np.zeros(0)
    start, _, s = arc_length_table(control, np.full(len(control), intervals))
    return s[start[1:] - 1]


def straight(control: Array, relative: float, absolute: float) -> Array:
    """Which cubics are straight lines that do not turn back on themselves.

    The distance of the control points from the chord is at most `relative` times its length and at most
    `absolute` (user units).  Their projections onto the chord lie between its ends, to the same tolerance.
    (..., 4, 2) -> (...) bool
    """
    chord = control[..., 3, :] - control[..., 0, :]
    length = np.linalg.norm(chord, axis=-1)
    unit = chord / np.where(length > 0.0, length, 1.0)[..., None]
    inner = control[..., 1:3, :] - control[..., :1, :]
    along = np.einsum("...kd,...d->...k", inner, unit)
    across = np.abs(inner[..., 0] * unit[..., None, 1] - inner[..., 1] * unit[..., None, 0])
    tolerance = np.minimum(relative * length, absolute)[..., None]
    within = (across <= tolerance) & (along >= -tolerance) & (along <= length[..., None] + tolerance)
    return (length > 0.0) & within.all(axis=-1)


# The greatest number of halvings of a Newton step.  Where the second derivative is small a step may be ten
# times too long.
HALVINGS = 6


def nearest_parameters(control: Array, points: Array, t: Array, rounds: int = 8) -> Array:
    """Parameters of the curve points nearest to given points, by Newton's method from a guess.

    Minimises |B(t) - p|^2.  A step that does not reduce the distance is halved, so the result is never worse
    than the guess.  control : (..., 4, 2), points : (..., 2), t : (...) -> (...)
    """
    t = np.array(np.broadcast_to(t, points.shape[:-1]), dtype=float)
    offset = evaluate(control, t) - points
    best = np.einsum("...d,...d->...", offset, offset)
    for _ in range(rounds):
        first, second = derivative(control, t), second_derivative(control, t)
        slope = np.einsum("...d,...d->...", offset, first)
        speed = np.einsum("...d,...d->...", first, first)
        curvature = speed + np.einsum("...d,...d->...", offset, second)
        # Gauss-Newton where the second derivative is not clearly positive; a zero derivative leaves t
        # unchanged.
        curvature = np.where(curvature > 0.1 * speed, curvature, speed)
        step = np.divide(-slope, curvature, out=np.zeros_like(slope), where=curvature > 0.0)
        nearer = False
        for _ in range(HALVINGS):
            trial = np.clip(t + step, 0.0, 1.0)
            trial_offset = evaluate(control, trial) - points
            distance = np.einsum("...d,...d->...", trial_offset, trial_offset)
            better = distance < best
            nearer = nearer or bool(better.any())
            t = np.where(better, trial, t)
            offset = np.where(better[..., None], trial_offset, offset)
            best = np.where(better, distance, best)
            step = np.where(better, 0.0, 0.5 * step)
            if not np.any(step):
                break
        if not nearer:  # all further rounds would repeat this one
            break
    return t


# The number of points at which a curve is evaluated to test whether it enters a box.
_SEARCH_POINTS = 33

# The distance of the nearest point is found to this part of the farthest control point's distance.  A much
# smaller tolerance would be below the rounding errors.
_NEAREST_TOLERANCE = 1e-12

# Newton's method runs after these numbers of halvings: early, so that most parts can be dropped, and again
# for the parts that remain.
_POLISHED_AT = (4, 10, 20)

# The Bernstein coefficients, of degree 6, of a product of two cubics: products of coefficients i and j
# contribute C(3, i) C(3, j) / C(6, i + j) to coefficient i + j.
_BINOMIAL_3, _BINOMIAL_6 = np.array([1.0, 3.0, 3.0, 1.0]), np.array([1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0])
_PRODUCT = np.zeros((7, 4, 4))
for _i in range(4):
    for _j in range(4):
        _PRODUCT[_i + _j, _i, _j] = _BINOMIAL_3[_i] * _BINOMIAL_3[_j] / _BINOMIAL_6[_i + _j]


class Nearest:
    """Nearest points of many cubics (n, 4, 2), found by branch and bound.

    |B(t) - p|^2 is a polynomial of degree 6.  The least of its Bernstein coefficients is a lower bound.  The
    curves are halved repeatedly, and a part is dropped when its bound is not below the least distance found
    so far.  The error of the bound falls with the square of a part's length, so few parts remain at any time.
    Newton's method at some levels brings the least distance to full precision.  Of millions of curves only
    those are examined whose bounding boxes are nearer than the nearest end of any curve.
    """

    def __init__(self, control: Array):
        self.control = control
        self._low, self._high = control.min(axis=1), control.max(axis=1)

    def find(self, to: Array) -> tuple[int, float, Array, float]:
        """Index of the curve, parameter, point (2,) and distance of the curve point nearest to `to` (2,).

        Without curves the index is -1 and the distance infinite.
        """
        if not len(self.control):
            return -1, 0.0, to, np.inf
        outside = np.maximum(np.maximum(self._low - to, to - self._high), 0.0)
        ends = self.control[:, ::3] - to
        square = np.einsum("nkd,nkd->nk", ends, ends)
        curve, end = np.unravel_index(square.argmin(), square.shape)
        best = _Foot(int(curve), float(end), float(np.sqrt(square[curve, end])))
        near = np.flatnonzero(np.einsum("nd,nd->n", outside, outside) < square[curve, end])
        best = self._search(to, near, best)
        point = evaluate(self.control[best.curve], np.array(best.t))
        return best.curve, best.t, point, float(np.linalg.norm(point - to))

    def _search(self, to: Array, curve: Array, best: _Foot) -> _Foot:
        """The nearest point of some curves (m,) int, or the best so far if none of theirs is nearer."""
        part, t, width = self.control[curve] - to, np.zeros(len(curve)), 1.0
        allowed = _NEAREST_TOLERANCE * np.abs(part).max() if len(part) else 0.0
        for level in itertools.count():
            bound = _least_coefficient(part)
            open_ = np.flatnonzero(np.sqrt(np.maximum(bound, 0.0)) < best.distance - allowed)
            if not len(open_):
                return best
            part, t, curve = part[open_], t[open_], curve[open_]
            if level in _POLISHED_AT:
                best = self._polished(to, curve, t + 0.5 * width, best)
            left, right = _halves(part)
            width *= 0.5
            part, t = np.concatenate([left, right]), np.concatenate([t, t + width])
            middle = np.linalg.norm(left[:, 3], axis=1)
            pick = int(middle.argmin())
            if middle[pick] < best.distance:
                best = _Foot(int(curve[pick]), float(t[len(left) + pick]), float(middle[pick]))
            curve = np.tile(curve, 2)
        raise AssertionError("unreachable")

    def _polished(self, to: Array, curve: Array, guess: Array, best: _Foot) -> _Foot:
        """The best point after Newton's method from the guesses (m,) and from the best so far."""
        curve, guess = np.append(curve, best.curve), np.append(guess, best.t)
        control = self.control[curve]
        t = nearest_parameters(control, np.broadcast_to(to, (len(curve), 2)), guess)
        distance = np.linalg.norm(evaluate(control, t) - to, axis=1)
        pick = int(distance.argmin())
        if distance[pick] >= best.distance:
            return best
        return _Foot(int(curve[pick]), float(t[pick]), float(distance[pick]))

    def is_inside(self, corners: Array) -> bool:
        """Whether any sampled point of the curves is within the bounding box of corners (k, 2)."""
        low, high = corners.min(axis=0), corners.max(axis=0)
        near = np.flatnonzero(((self._low <= high) & (self._high >= low)).all(axis=1))
        points = evaluate(self.control[near, None], np.linspace(0.0, 1.0, _SEARCH_POINTS)[None, :])
        return bool(((points >= low) & (points <= high)).all(axis=2).any())


@dataclass(frozen=True)
class _Foot:
    """A candidate for the nearest point: its curve, its parameter, its distance from the given point."""

    curve: int
    t: float
    distance: float


def _least_coefficient(control: Array) -> Array:
    """Lower bounds (m,) of |B(t)|^2 over cubics (m, 4, 2)."""
    products = np.einsum("mid,mjd->mij", control, control)
    return (products.reshape(-1, 16) @ _PRODUCT.reshape(7, 16).T).min(axis=1)


def _halves(control: Array) -> tuple[Array, Array]:
    """Both halves of cubics (m, 4, 2), by de Casteljau."""
    a, b, c, d = np.moveaxis(control, 1, 0)
    ab, bc, cd = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + d)
    abc, bcd = 0.5 * (ab + bc), 0.5 * (bc + cd)
    middle = 0.5 * (abc + bcd)
    return np.stack([a, ab, abc, middle], axis=1), np.stack([middle, bcd, cd, d], axis=1)
