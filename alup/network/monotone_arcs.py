# SPDX-License-Identifier: GPL-2.0-or-later
"""Arrays of cubics, their division into monotone arcs, and nearest points on arcs.

Points are complex numbers x + iy: Re(conj(v) w) is the dot product of plane vectors, Im(conj(v) w) their
cross product.

Arcs (`arcs_of`).  Each cubic is cut where x' or y' changes sign, and evenly until it is nearly
straight and short.  The tangents of such a monotone arc stay within 90 degrees, hence it does not
meet itself, its hull is thin, and the distance to a point near it has one minimum on it.

Feet (`foot`).  The point of an arc nearest to p solves (B(t) - p) . B'(t) = 0.  For p near a monotone arc the
left side changes its sign once, from - to +.  It is solved by Newton's method inside a bracket.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..geometry.boxes import ranges
from ..model import Array

# Chord error of an arc, at most about this fraction of its chord.  Newton's method then converges from the
# chord.  Finer arcs would only add boxes.
_COARSE = 1.0 / 8.0

# Mean number of arcs per segment for segments of average length, so that boxes are small against the drawing.
# With 1 there are more pairs to intersect, with 4 more boxes.
_FINENESS = 2.0

# Cuts whose parameters are this close to an end or to another cut are dropped: the arc between would be
# empty.
_SLIVER = 1e-9

# Gauss-Legendre quadrature on [0, 1].  Lengths matter only where they are about a tolerance; the speed of a
# cubic is nearly linear there.  8 points are accurate to 1e-6 for an ordinary whole segment.
_GAUSS_T, _GAUSS_W = np.polynomial.legendre.leggauss(8)
_GAUSS_T, _GAUSS_W = 0.5 + 0.5 * _GAUSS_T, 0.5 * _GAUSS_W

# Accuracy of crossings, and the tolerance of equal points, as a fraction of the drawing.  The rounding of a
# few transforms is 1e-15.  With 1e-11 the crossings of copies would be visibly apart.
EXACT = 1e-13

# Sine below which directions count as parallel.  Newton's method loses as many digits as 1/sine has: at 1e-6
# it keeps 10 of 16.  Below, case 4 of `intersections` applies, which does not divide by the sine.
PARALLEL = 1e-6

# Greatest number of steps of `foot`.  At a cusp it bisects, and converges linearly.
_BRACKETED = 60


class Curves(NamedTuple):
    """Cubics in power form about the middle of the drawing, power : (4, S) complex.

    tolerance : user units; extent : greatest coordinate from the middle, the scale of rounding
    """

    power: Array
    tolerance: float
    extent: float

    def point(self, s: Array, t: Array) -> Array:
        p = self.power
        return ((p[3, s] * t + p[2, s]) * t + p[1, s]) * t + p[0, s]

    def velocity(self, s: Array, t: Array) -> Array:
        p = self.power
        return (3.0 * p[3, s] * t + 2.0 * p[2, s]) * t + p[1, s]

    def acceleration(self, s: Array, t: Array) -> Array:
        return 6.0 * self.power[3, s] * t + 2.0 * self.power[2, s]

    def length(self, s: Array, t0: Array, t1: Array) -> Array:
        """Arc length from t0 to t1, negative when t1 < t0."""
        t = t0[:, None] + (t1 - t0)[:, None] * _GAUSS_T
        return (t1 - t0) * (np.abs(self.velocity(s[:, None], t)) @ _GAUSS_W)

    def hull(self, s: Array, t0: Array, t1: Array) -> Array:
        """(4, n) control points of the arcs from t0 to t1."""
        third = (t1 - t0) / 3.0
        first, last = self.point(s, t0), self.point(s, t1)
        return np.stack(
            [first, first + third * self.velocity(s, t0), last - third * self.velocity(s, t1), last]
        )


def curves_of(control: Array, line: Array, tolerance: float) -> Curves:
    """The power form of cubics.  control : (S, 4, 2); line : (S,) bool, straight at constant speed."""
    z = control[..., 0] + 1j * control[..., 1]
    middle = 0.5 * (
        complex(z.real.min(), z.imag.min()) + complex(z.real.max(), z.imag.max()) if z.size else 0.0
    )
    far = float(np.abs(z).max()) if z.size else 0.0
    z = z - middle
    power = np.stack(
        [
            z[:, 0],
            3.0 * (z[:, 1] - z[:, 0]),
            3.0 * (z[:, 0] - 2.0 * z[:, 1] + z[:, 2]),
            z[:, 3] - z[:, 0] + 3.0 * (z[:, 1] - z[:, 2]),
        ]
    )
    power[1:, line] = 0.0
    power[1, line] = z[line, 3] - z[line, 0]
    # The tolerance is at least the rounding of the coordinates.
    least = 8.0 * np.finfo(float).eps * far
    return Curves(power, max(tolerance, least), float(np.abs(z).max()) if z.size else 0.0)


def turning(first: Array, second: Array, third: Array) -> Array:
    """The roots in (0, 1) of first + second t + third t^2 = 0, (n, 2), NaN where there is none."""
    with np.errstate(all="ignore"):
        half = -0.5 * (second + np.copysign(np.sqrt(second * second - 4.0 * third * first), second))
        roots = np.stack([half / third, first / half], axis=1)
    roots[~((roots > _SLIVER) & (roots < 1.0 - _SLIVER))] = np.nan
    return roots


class Arcs(NamedTuple):
    """Arcs of cubics: s, t0, t1 : (n,)."""

    s: Array
    t0: Array
    t1: Array

    def take(self, index: Array) -> Arcs:
        return Arcs(self.s[index], self.t0[index], self.t1[index])


def arcs_of(curves: Curves) -> tuple[Arcs, float]:
    """Monotone, nearly straight arcs of all segments longer than the tolerance, and their typical length."""
    p = curves.power
    everything = np.arange(p.shape[1])
    zero, one = np.zeros(len(everything)), np.ones(len(everything))
    hull = curves.hull(everything, zero, one)
    length = np.abs(np.diff(hull, axis=0)).sum(axis=0)
    s = np.flatnonzero(length > curves.tolerance)
    if not len(s):
        return Arcs(s, zero[:0], zero[:0]), curves.tolerance
    length = length[s]
    typical = max(float(length.mean()) / _FINENESS, curves.tolerance)
    bend = np.maximum(np.abs(curves.acceleration(s, zero[s])), np.abs(curves.acceleration(s, one[s])))
    # With n arcs the chord error is bend / 8 n^2, and the chord is length / n.
    parts = np.ceil(np.maximum(length / typical, bend / (8.0 * _COARSE * length))).astype(np.int64)
    owner, k = ranges(np.zeros(len(s), dtype=np.int64), parts + 1)
    slow = [turning(c[1, s], 2.0 * c[2, s], 3.0 * c[3, s]) for c in (p.real, p.imag)]
    cut_s = np.concatenate([s[owner], np.repeat(s, 4)])
    cut_t = np.concatenate([k / parts[owner], np.concatenate(slow, axis=1).ravel()])
    order = np.lexsort((cut_t, cut_s))
    order = order[~np.isnan(cut_t[order])]
    cut_s, cut_t = cut_s[order], cut_t[order]
    distinct = np.append(True, (np.diff(cut_t) > _SLIVER) | (np.diff(cut_s) != 0))
    cut_s, cut_t = cut_s[distinct], cut_t[distinct]
    inner = np.flatnonzero(cut_s[1:] == cut_s[:-1])
    return Arcs(cut_s[inner], cut_t[inner], cut_t[inner + 1]), typical


def cross(v: Array, w: Array) -> Array:
    return v.real * w.imag - v.imag * w.real


def dot(v: Array, w: Array) -> Array:
    return v.real * w.real + v.imag * w.imag


def unit(v: Array) -> Array:
    size = np.abs(v)
    return v / np.where(size > 0.0, size, 1.0)


def collinear(curves: Curves) -> tuple[Array, Array]:
    """Whether the control points are collinear to the tolerance, and their direction."""
    every = np.arange(curves.power.shape[1])
    hull = curves.hull(every, np.zeros(len(every)), np.ones(len(every)))
    edge = np.diff(hull, axis=0)
    axis = edge[np.abs(edge).argmax(axis=0), every]
    axis = unit(axis)
    return (np.abs(cross(axis, hull - hull[0])) <= curves.tolerance).all(axis=0), axis


def foot(curves: Curves, s: Array, p: Array, low: Array, high: Array, accuracy: float) -> Array:
    """The parameter in [low, high] of the point of segment s nearest to p, (n,).

    There may be only one minimum.
    s, p, low, high : (n,); accuracy : user units of arc length, the last step of Newton's method is below it
    """
    first, last = curves.point(s, low), curves.point(s, high)
    at_low, at_high = (
        # The speed is zero at a cusp or turning point.  There the chord is used as the direction.
        dot(end - p, np.where(np.abs(v) * (high - low) > PARALLEL * np.abs(last - first), v, last - first))
        for end, v in ((first, curves.velocity(s, low)), (last, curves.velocity(s, high)))
    )
    result = np.where(at_low >= 0.0, low, high)
    k = np.flatnonzero((at_low < 0.0) & (at_high > 0.0))
    low, high = low[k], high[k]
    t = low + (high - low) * at_low[k] / (at_low[k] - at_high[k])
    for _ in range(_BRACKETED):
        apart, v = curves.point(s[k], t) - p[k], curves.velocity(s[k], t)
        value, rate = dot(apart, v), dot(v, v) + dot(apart, curves.acceleration(s[k], t))
        low, high = np.where(value <= 0.0, t, low), np.where(value >= 0.0, t, high)
        with np.errstate(all="ignore"):
            new = t - value / rate
        new = np.where((new >= low) & (new <= high), new, 0.5 * (low + high))
        result[k] = new
        going = np.abs((new - t) * v) > accuracy
        if not going.any():
            break
        k, low, high, t = k[going], low[going], high[going], new[going]
    return result
