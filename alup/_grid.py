"""Cubics in bulk: cut into arcs, paired on a grid, and where two of them meet.

The geometry below `contacts`, which says what of it counts.  Points are complex numbers x + iy
here: Re(conj(v) w) is the dot product of plane vectors, Im(conj(v) w) the cross product, `x` below.

Arcs (`arcs_of`).  Each cubic is cut where x' or y' changes sign, and evenly until it is nearly
straight and short.  The tangents of such a monotone arc stay within 90 degrees, hence it does not
meet itself, its hull is thin, and the distance to a point near it has one minimum on it.

Boxes (`overlapping`).  A box is entered in every cell of a uniform grid that it covers, the entries
are sorted by (cell, left edge), and an entry is paired with those behind it in its cell whose left
edge is not beyond its right one.  The sweep matters where a cell holds many boxes far smaller than
it.  A pair meets in every cell the two boxes share; it is reported only in the cell of the lower
left corner of their intersection, so no pair has to be sorted out as a duplicate afterwards.

Feet (`foot`).  The point of an arc nearest to p solves (B(t) - p) . B'(t) = 0, which changes sign
once, from - to +, near a monotone arc: Newton's steps inside a bracket.

Meetings (`meetings`).  For two arcs A, B with control polygons P, Q one of these holds.
  1. The boxes, or strips along the chords, keep them further apart than the tolerance: done.
  2. (P_i+1 - P_i) x (Q_j+1 - Q_j) has one sign for all nine i, j.  Derivatives are convex
     combinations of these edges, so A(t) - A(t') = B(u) - B(u') would say (t - t') a = (u - u') b
     with a x b != 0: at most one crossing.  Newton from the chords; what it does not settle is
     halved until the hulls are apart.
  3. The arcs leave a common node into opposite half-planes: they meet only there.
  4. Both are straight to a fraction of the tolerance, and nearly parallel: the least distance of
     the chords over their common range says whether they touch, and where Newton may start.
  5. Otherwise the arcs are halved.

Loops (`loops`).  A cubic meets itself where B(p) = B(q), p != q.  With B = a t^3 + b t^2 + c t + d
and sigma = p + q, pi = p q, dividing by p - q leaves  a (sigma^2 - pi) + b sigma + c = 0.  Its
cross products with a and with b give  sigma = (c x a) / (a x b),  pi = sigma^2 - (b x c) / (a x b).
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

# Crossings are solved to this fraction of the drawing, and what agrees to it is equal.  Rounding of
# a few transforms is 1e-15; 1e-11 would move crossings of copies visibly apart.
EXACT = 1e-13

# "Straight" in case 4, in tolerances: what the two chords may add to a distance is twice this.
# A half makes contacts a tolerance apart uncertain, a thirtieth doubles the number of pairs.
STRAIGHT = 1.0 / 8.0

# Sine below which directions count as parallel.  Newton loses as many digits as 1/sine has: at
# 1e-6 it keeps 10 of 16; below, case 4 decides, which does not divide by the sine.
_PARALLEL = 1e-6

# Halvings of a pair: an arc as long as the drawing falls below 1e-7 of it.
_HALVINGS = 24

# Newton's steps.  From a start right to 1/8, 5 reach rounding; inside a bracket it may have to
# bisect through a cusp, where convergence is linear.
NEWTON = 9
_BRACKETED = 60

# Pairs of arcs looked at together: their temporaries stay in the cache, and memory is bounded.
_PAIRS = 1 << 14

# Cells an axis at most: keys stay far inside 63 bits and inside a double's 53 bits (key plus a
# fraction is what is sorted: 2^40 cells leave 2^-12, hence the occupied cells are renumbered).
_MOST_CELLS = 1 << 20

# Nor more than this many entries of cells for each box.
_MOST_ENTRIES = 16

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
    while True:
        first = np.floor((low - origin) / cell).astype(np.int64)
        last = np.floor((high - origin) / cell).astype(np.int64)
        count = last - first + 1
        # One box as long as the drawing among a thousand small ones would cover a million cells.
        if int((count[:, 0] * count[:, 1]).sum()) <= _MOST_ENTRIES * len(low):
            break
        cell *= 2.0
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
    """Parameter in [low, high] of the point of segment s nearest to p, where there is one minimum.

    accuracy : arc length; Newton's steps end below it
    """
    first, last = curves.point(s, low), curves.point(s, high)
    at_low, at_high = (
        # an arc may begin or end at rest, at a cusp or turning point: its chord stands in
        dot(end - p, np.where(np.abs(v) * (high - low) > _PARALLEL * np.abs(last - first), v, last - first))
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


class Meetings(NamedTuple):
    """Points that two segments have in common, a(t) = b(u) with a < b, (n,) each.

    exact : solved to rounding; touch : index of the T-junction this is, or -1; node : it is a node
    """

    a: Array
    t: Array
    b: Array
    u: Array
    exact: Array
    touch: Array
    node: Array


def ordered(a: Array, t: Array, b: Array, u: Array, exact: Array, touch: Array, node: Array) -> Meetings:
    swap = a > b
    first, second = np.where(swap, b, a), np.where(swap, a, b)
    return Meetings(first, np.where(swap, u, t), second, np.where(swap, t, u), exact, touch, node)


def meetings(curves: Curves, arcs: Arcs, pairs: Array) -> list[Meetings]:
    """Where arcs of different segments touch, apart from what common nodes explain at once."""
    found: list[Meetings] = []
    for begin in range(0, pairs.shape[1], _PAIRS):
        i, j = pairs[:, begin : begin + _PAIRS]
        found += _arcs_meet(curves, arcs.take(i), arcs.take(j))
    return found


def _arcs_meet(curves: Curves, a: Arcs, b: Arcs) -> list[Meetings]:
    """The five cases of the text above for pairs of arcs, halving them while they are undecided."""
    tolerance = curves.tolerance
    found: list[Meetings] = []
    for _ in range(_HALVINGS):
        if not len(a.s):
            break
        p, q = curves.hull(*a), curves.hull(*b)
        keep = np.flatnonzero(~_apart(p, q, tolerance))
        a, b, p, q = a.take(keep), b.take(keep), p[:, keep], q[:, keep]
        v, w = _directions(p)[:, None], _directions(q)
        sine, cosine = cross(v, w), dot(v, w)
        least, most = cosine.min(axis=(0, 1)), cosine.max(axis=(0, 1))
        steep = (sine.min(axis=(0, 1)) > _PARALLEL) | (sine.max(axis=(0, 1)) < -_PARALLEL)

        settled = np.zeros(len(a.s), dtype=bool)
        for end_a in (0, 1):
            for end_b in (0, 1):
                at_node = (a[1 + end_a] == end_a) & (b[1 + end_b] == end_b)
                gap = np.abs(p[3 * end_a] - q[3 * end_b])
                opposite = most < 0.0 if end_a == end_b else least > 0.0
                settled |= at_node & (gap <= tolerance) & opposite
                settled |= at_node & (gap <= EXACT * curves.extent) & steep

        k = np.flatnonzero(steep & ~settled)
        met = _met(curves, a.take(k), b.take(k), _chords_cross(p[:, k], q[:, k]), False)
        found.append(met[0])
        settled[k[met[1]]] = True

        bent_a, bent_b = _bend(p) > STRAIGHT * tolerance, _bend(q) > STRAIGHT * tolerance
        straight = ~(bent_a | bent_b)
        k = np.flatnonzero(straight & ~steep & ~settled)
        place, touching = _chords_near(p[:, k], q[:, k], tolerance)
        k = k[touching]
        found.append(_met(curves, a.take(k), b.take(k), place[touching], True)[0])

        k = np.flatnonzero(~settled & ~straight)
        a, b, bent_a, bent_b = a.take(k), b.take(k), bent_a[k], bent_b[k]
        a, again = _halved(a, bent_a)
        b, bent_b = b.take(again), bent_b[again]
        b, again = _halved(b, bent_b)
        a = a.take(again)
    return found


def _halved(arcs: Arcs, which: Array) -> tuple[Arcs, Array]:
    """The arcs with those of `which` in two halves, and the arc that each came from."""
    k = np.flatnonzero(which)
    middle = 0.5 * (arcs.t0 + arcs.t1)
    halves = Arcs(
        np.concatenate([arcs.s, arcs.s[k]]),
        np.concatenate([arcs.t0, middle[k]]),
        np.concatenate([np.where(which, middle, arcs.t1), arcs.t1[k]]),
    )
    return halves, np.concatenate([np.arange(len(which)), k])


def _apart(p: Array, q: Array, tolerance: float) -> Array:
    """(n,) bool: hulls p, q : (4, n) are seen to be further apart than the tolerance."""
    apart = np.zeros(p.shape[1], dtype=bool)
    for axis in (np.ones(p.shape[1], dtype=complex), unit(p[3] - p[0]), unit(q[3] - q[0])):
        x, y = np.conj(axis) * (p - p[0]), np.conj(axis) * (q - p[0])
        for v, w in ((x.real, y.real), (x.imag, y.imag)):
            apart |= (v.min(axis=0) > w.max(axis=0) + tolerance) | (w.min(axis=0) > v.max(axis=0) + tolerance)
    return apart


def _directions(hull: Array) -> Array:
    """(3, n) unit edges of the control polygons, the chord's direction for edges without length."""
    edge, chord = np.diff(hull, axis=0), hull[3] - hull[0]
    return unit(np.where(np.abs(edge) > _PARALLEL * np.abs(chord), edge, chord))


def _bend(hull: Array) -> Array:
    """(n,) greatest distance of the inner control points from the chord."""
    return np.abs(cross(unit(hull[3] - hull[0]), hull[1:3] - hull[0])).max(axis=0)


def _chords_cross(p: Array, q: Array) -> Array:
    """(n,) where the chords cross, or the end of the first that is nearest to that."""
    v, w = p[3] - p[0], q[3] - q[0]
    area = cross(v, w)
    return p[0] + np.clip(cross(w, p[0] - q[0]) / np.where(area == 0.0, 1.0, area), 0.0, 1.0) * v


def _chords_near(p: Array, q: Array, tolerance: float) -> tuple[Array, Array]:
    """(n,) point of the first of two nearly parallel chords nearest to the other; is that a touch."""
    size, frame = np.abs(p[3] - p[0]), np.conj(unit(p[3] - p[0]))
    first, last = (q[0] - p[0]) * frame, (q[3] - p[0]) * frame
    low = np.maximum(np.minimum(first.real, last.real), 0.0)
    high = np.minimum(np.maximum(first.real, last.real), size)
    run = last.real - first.real
    run = np.where(run == 0.0, 1.0, run)
    at_low = first.imag + (low - first.real) / run * (last.imag - first.imag)
    at_high = first.imag + (high - first.real) / run * (last.imag - first.imag)
    change = at_low - at_high
    crossed = low + (high - low) * at_low / np.where(change == 0.0, 1.0, change)
    opposite = at_low * at_high < 0.0
    x = np.where(opposite, crossed, np.where(np.abs(at_low) <= np.abs(at_high), low, high))
    apart = np.where(opposite, 0.0, np.minimum(np.abs(at_low), np.abs(at_high)))
    touching = (apart <= (1.0 + 2.0 * STRAIGHT) * tolerance) & (high >= low - tolerance) & (size > 0.0)
    return p[0] + x * np.conj(frame), touching


def _met(curves: Curves, a: Arcs, b: Arcs, place: Array, touch: bool) -> tuple[Meetings, Array]:
    """Meetings near the given points of the chords, and which pairs have one.

    Where an arc is at a point of its chord the foot says, not the fraction: an arc as straight as can
    be may still begin at rest.
    touch : where there is no crossing, points within the tolerance count too
    """
    accuracy = STRAIGHT * curves.tolerance
    near_t = foot(curves, a.s, place, a.t0, a.t1, accuracy)
    p = curves.point(a.s, near_t)
    near_u = foot(curves, b.s, p, b.t0, b.t1, accuracy)
    t, u, done = _newton(curves, a, b, near_t, near_u)
    keep = done
    if touch:
        keep = done | (np.abs(curves.point(b.s, near_u) - p) <= curves.tolerance)
        t, u = np.where(done, t, near_t), np.where(done, u, near_u)
    k = np.flatnonzero(keep)
    nothing = np.full(len(k), -1)
    return ordered(a.s[k], t[k], b.s[k], u[k], done[k], nothing, np.zeros(len(k), dtype=bool)), k


def _newton(curves: Curves, a: Arcs, b: Arcs, t: Array, u: Array) -> tuple[Array, Array, Array]:
    """Solve a(t) = b(u) on the two arcs: t, u, and whether that succeeded."""
    slack_a, slack_b = 0.25 * (a.t1 - a.t0), 0.25 * (b.t1 - b.t0)
    for _ in range(NEWTON):
        gap = curves.point(a.s, t) - curves.point(b.s, u)
        v, w = curves.velocity(a.s, t), curves.velocity(b.s, u)
        with np.errstate(all="ignore"):
            dt, du = cross(w, gap) / cross(v, w), cross(v, gap) / cross(v, w)
        finite = np.isfinite(dt) & np.isfinite(du)
        t = np.clip(t + np.where(finite, dt, 0.0), a.t0 - slack_a, a.t1 + slack_a)
        u = np.clip(u + np.where(finite, du, 0.0), b.t0 - slack_b, b.t1 + slack_b)
    done = np.abs(curves.point(a.s, t) - curves.point(b.s, u)) <= EXACT * curves.extent
    for arc, slack, x in ((a, slack_a, t), (b, slack_b, u)):
        done &= (x >= arc.t0 - _PARALLEL * slack) & (x <= arc.t1 + _PARALLEL * slack)
    return np.clip(t, 0.0, 1.0), np.clip(u, 0.0, 1.0), done


def loops(curves: Curves) -> tuple[Array, Array]:
    """Cubics that meet themselves: (n, 2) the segment twice, (n, 2) the two parameters."""
    _, c, b, a = curves.power
    with np.errstate(all="ignore"):
        area = cross(a, b)
        total = cross(c, a) / area
        product = total * total - cross(b, c) / area
        apart = np.sqrt(total * total - 4.0 * product)
    low, high = 0.5 * (total - apart), 0.5 * (total + apart)
    s = np.flatnonzero((low > 0.0) & (high < 1.0) & ~collinear(curves)[0])
    s = s[curves.length(s, low[s], high[s]) > 2.0 * curves.tolerance]
    low, high = low[s], high[s]
    for _ in range(2):
        gap = curves.point(s, low) - curves.point(s, high)
        v, w = curves.velocity(s, low), curves.velocity(s, high)
        with np.errstate(all="ignore"):
            low, high = low + cross(w, gap) / cross(v, w), high + cross(v, gap) / cross(v, w)
    with np.errstate(all="ignore"):
        gap = np.abs(curves.point(s, low) - curves.point(s, high))
    k = np.flatnonzero((gap <= EXACT * curves.extent) & (low > 0.0) & (high < 1.0))
    return np.stack([s[k], s[k]], axis=1), np.stack([low[k], high[k]], axis=1)
