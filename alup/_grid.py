"""Cubics in bulk, cut into arcs and put into a grid: what `contacts` looks for pairs with.

Points are complex numbers x + iy here: Re(conj(v) w) is the dot, Im(conj(v) w) the cross product.

Arcs.  Each cubic is cut where x' or y' changes sign, and evenly until it is nearly straight and
short.  The tangents of such a monotone arc stay within 90 degrees, hence it does not meet itself,
its hull is thin, and the distance to a point near it has one minimum on it.

Boxes.  A box is entered in every cell of a uniform grid that it covers, the entries are sorted by
(cell, left edge), and an entry is paired with those behind it in its cell whose left edge is not
beyond its right one.  The sweep matters where a cell holds many boxes far smaller than it.  A pair
meets in every cell the two boxes share; it is reported only in the cell of the lower left corner
of their intersection, so that no pair has to be sorted out as a duplicate afterwards.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

Array = np.ndarray

# An arc's chord error is at most about this fraction of its chord: enough for Newton's method
# from the chord to converge; finer only makes more boxes.
_COARSE = 1.0 / 8.0

# Arcs per segment that length alone asks for, on average over the drawing: boxes are then small
# against the drawing whatever single segments do.  1 leaves more pairs to look at, 4 more boxes.
_FINENESS = 2.0

# Turning parameters this close to an end or to another cut are that cut: no arc is made of them.
_SLIVER = 1e-9

# Gauss-Legendre on [0, 1].  Lengths decide only when they are about a tolerance, where a cubic's
# speed is nearly linear; 8 points keep 1e-6 of a whole ordinary segment.
_GAUSS_T, _GAUSS_W = np.polynomial.legendre.leggauss(8)
_GAUSS_T, _GAUSS_W = 0.5 + 0.5 * _GAUSS_T, 0.5 * _GAUSS_W

# Cells an axis at most: keys stay far inside 63 bits and inside a double's 53 bits (key plus a
# fraction is what is sorted: 2^40 cells leave 2^-12, hence the occupied cells are renumbered).
_MOST_CELLS = 1 << 20

# Pairs looked at together: bounds the memory of a crowded cell to some 100 MB.
_CHUNK = 1 << 21


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
    """Control : (S, 4, 2); line : (S,) bool, taken as straight at constant speed."""
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
    # coordinates themselves are no better than their last digits
    least = 8.0 * np.finfo(float).eps * far
    return Curves(power, max(tolerance, least), float(np.abs(z).max()) if z.size else 0.0)


def turning(first: Array, second: Array, third: Array) -> Array:
    """(n, 2) roots in (0, 1) of first + second t + third t^2 = 0, nan where there is none."""
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
    """Monotone, nearly straight arcs of all segments longer than the tolerance, and their usual size."""
    p = curves.power
    everything = np.arange(p.shape[1])
    zero, one = np.zeros(len(everything)), np.ones(len(everything))
    hull = curves.hull(everything, zero, one)
    length = np.abs(np.diff(hull, axis=0)).sum(axis=0)
    s = np.flatnonzero(length > curves.tolerance)
    if not len(s):
        return Arcs(s, zero[:0], zero[:0]), curves.tolerance
    length = length[s]
    usual = max(float(length.mean()) / _FINENESS, curves.tolerance)
    bend = np.maximum(np.abs(curves.acceleration(s, zero[s])), np.abs(curves.acceleration(s, one[s])))
    # n arcs have chord error bend / 8 n^2 and chord length / n
    parts = np.ceil(np.maximum(length / usual, bend / (8.0 * _COARSE * length))).astype(np.int64)
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
    return Arcs(cut_s[inner], cut_t[inner], cut_t[inner + 1]), usual


def ranges(first: Array, count: Array) -> tuple[Array, Array]:
    """Concatenated integer ranges: (owner, value), value running from first[owner] upwards.

    first, count : (n,) int
    """
    owner = np.repeat(np.arange(len(count)), count)
    start = np.cumsum(count) - count
    return owner, np.arange(len(owner)) - np.repeat(start - first, count)


def overlapping(low: Array, high: Array, cell: float) -> tuple[Array, Array]:
    """All pairs i, j of closed boxes that overlap, each once, in no particular order.

    low, high : (n, 2) float, opposite corners; cell : wished edge of a cell, about a box's size
    """
    empty = np.empty(0, dtype=np.int64)
    if len(low) < 2:
        return empty, empty
    origin = low.min(axis=0)
    extent = float((high.max(axis=0) - origin).max())
    if not extent > 0.0:
        return np.triu_indices(len(low), 1)
    cell = max(cell, extent / _MOST_CELLS)
    first = np.floor((low - origin) / cell).astype(np.int64)
    last = np.floor((high - origin) / cell).astype(np.int64)

    count = last - first + 1
    box, step = ranges(np.zeros(len(low), dtype=np.int64), count[:, 0] * count[:, 1])
    column = first[box, 0] + step // count[box, 1]
    row = first[box, 1] + step % count[box, 1]
    _, place = np.unique(column * (2 * _MOST_CELLS) + row, return_inverse=True)

    left = (low[:, 0] - origin[0]) / (2.0 * extent)
    right = (high[:, 0] - origin[0]) / (2.0 * extent)
    key = place + left[box]
    order = np.argsort(key, kind="stable")
    box, column, row, place, key = box[order], column[order], row[order], place[order], key[order]
    # the rounding of `place + fraction` is taken out again by the exact test below
    end = np.searchsorted(key, place + right[box] + 1e-9, side="right")
    partners = end - np.arange(len(box)) - 1

    found: list[tuple[Array, Array]] = [(empty, empty)]
    total = np.cumsum(partners)
    cuts = np.append(np.searchsorted(total, np.arange(0, int(total[-1]), _CHUNK)), len(box))
    for begin, stop in zip(cuts[:-1], cuts[1:]):
        entry, other = ranges(np.arange(begin, stop) + 1, partners[begin:stop])
        entry = entry + begin
        i, j = box[entry], box[other]
        meet = (low[i, 1] <= high[j, 1]) & (low[j, 1] <= high[i, 1])
        entry, other, i, j = entry[meet], other[meet], i[meet], j[meet]
        meet = (
            (low[i, 0] <= high[j, 0])
            & (low[j, 0] <= high[i, 0])
            & (place[entry] == place[other])
            & (column[entry] == np.maximum(first[i, 0], first[j, 0]))
            & (row[entry] == np.maximum(first[i, 1], first[j, 1]))
        )
        found.append((i[meet], j[meet]))
    return np.concatenate([i for i, _ in found]), np.concatenate([j for _, j in found])
