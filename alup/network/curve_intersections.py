# SPDX-License-Identifier: GPL-2.0-or-later
"""Intersections and touches of arcs of different cubics, and self-intersections of cubics.

Arcs (`intersections`).  For two arcs A, B with control polygons P, Q one of these cases holds.
  1. Their boxes, or strips along their chords, are further apart than the tolerance.  Then they do not touch.
  2. (P_i+1 - P_i) x (Q_j+1 - Q_j) has one sign for all nine i, j.  Derivatives are convex combinations of
     these edges, so A(t) - A(t') = B(u) - B(u') implies (t - t') a = (u - u') b with a x b != 0.  Hence there
     is at most one crossing.  Newton's method starts from the crossing of the chords.  If it fails the arcs
     are halved.
  3. The arcs leave a common node into opposite half-planes.  Then they meet only there.
  4. Both are straight to a fraction of the tolerance, and nearly parallel.  The least distance of the chords
     over their common range tells whether they touch, and is where Newton's method starts.
  5. Otherwise the arcs are halved.

Loops (`loops`).  A cubic meets itself where B(p) = B(q), p != q.  With B = a t^3 + b t^2 + c t + d
and sigma = p + q, pi = p q, dividing by p - q leaves  a (sigma^2 - pi) + b sigma + c = 0.  Its
cross products with a and with b give  sigma = (c x a) / (a x b),  pi = sigma^2 - (b x c) / (a x b).
"""

from __future__ import annotations

from typing import Callable, NamedTuple

import numpy as np

from ..model import Array
from .monotone_arcs import EXACT, PARALLEL, Arcs, Curves, collinear, cross, dot, foot, unit

# Chord error of a "straight" arc in case 4, in tolerances.  Two chords change a distance by at most twice
# this.  With 1/2 touches at a distance of a tolerance are uncertain; 1/30 doubles the number of pairs.
STRAIGHT = 1.0 / 8.0

# Greatest number of halvings of a pair: they make an arc as long as the drawing shorter than 1e-7 of it.
_HALVINGS = 24

# Steps of Newton's method.  From a start with an error of 1/8 five steps reach rounding.
NEWTON = 9

# Pairs of arcs in one batch: the temporaries fit into the cache, and memory is bounded.
_PAIRS = 1 << 14


class CommonPoints(NamedTuple):
    """Common points of two segments, a(t) = b(u) with a < b; every field is (n,).

    exact : solved to rounding, not only within the tolerance; touch : index of the T-junction that the point
        is, or -1
    node : whether it is a node of one of the two
    """

    a: Array
    t: Array
    b: Array
    u: Array
    exact: Array
    touch: Array
    node: Array


def ordered(a: Array, t: Array, b: Array, u: Array, exact: Array, touch: Array, node: Array) -> CommonPoints:
    swap = a > b
    first, second = np.where(swap, b, a), np.where(swap, a, b)
    return CommonPoints(first, np.where(swap, u, t), second, np.where(swap, t, u), exact, touch, node)


def intersections(
    curves: Curves, arcs: Arcs, pairs: Array, stop: Callable[[int], bool] | None = None
) -> list[CommonPoints] | None:
    """Common points of arcs of different segments, without those at common nodes that case 3 excludes.

    pairs : (2, n) arcs that may touch; stop : see `contacts.contacts`.  Returns None if it ended the search.
    """
    found: list[CommonPoints] = []
    every = np.arange(curves.power.shape[1])
    whole = curves.hull(every, np.zeros(len(every)), np.ones(len(every)))
    for begin in range(0, pairs.shape[1], _PAIRS):
        i, j = pairs[:, begin : begin + _PAIRS]
        a, b = arcs.s[i], arcs.s[j]
        # Segments whose control points agree to the tolerance coincide as a whole.
        differ = (np.abs(whole[:, a] - whole[:, b]) > curves.tolerance).any(axis=0)
        differ &= (np.abs(whole[:, a] - whole[::-1, b]) > curves.tolerance).any(axis=0)
        differ &= a != b
        i, j = i[differ], j[differ]
        few = _arc_intersections(curves, arcs.take(i), arcs.take(j))
        found += few
        crossed = sum(int(np.count_nonzero(one.exact)) for one in few)
        if stop is not None and begin + _PAIRS < pairs.shape[1] and stop(crossed):
            return None
    return found


def _arc_intersections(curves: Curves, a: Arcs, b: Arcs) -> list[CommonPoints]:
    """Common points of pairs of arcs by the five cases of the module's head."""
    tolerance = curves.tolerance
    found: list[CommonPoints] = []
    for _ in range(_HALVINGS):
        if not len(a.s):
            break
        p, q = curves.hull(*a), curves.hull(*b)
        keep = np.flatnonzero(~_hulls_apart(p, q, tolerance))
        a, b, p, q = a.take(keep), b.take(keep), p[:, keep], q[:, keep]
        v, w = _directions(p)[:, None], _directions(q)
        sine, cosine = cross(v, w), dot(v, w)
        least, most = cosine.min(axis=(0, 1)), cosine.max(axis=(0, 1))
        steep = (sine.min(axis=(0, 1)) > PARALLEL) | (sine.max(axis=(0, 1)) < -PARALLEL)

        settled = np.zeros(len(a.s), dtype=bool)
        for end_a in (0, 1):
            for end_b in (0, 1):
                at_node = (a[1 + end_a] == end_a) & (b[1 + end_b] == end_b)
                gap = np.abs(p[3 * end_a] - q[3 * end_b])
                opposite = most < 0.0 if end_a == end_b else least > 0.0
                settled |= at_node & (gap <= tolerance) & opposite
                settled |= at_node & (gap <= EXACT * curves.extent) & steep

        k = np.flatnonzero(steep & ~settled)
        crossing = _near_intersections(curves, a.take(k), b.take(k), _chord_crossing(p[:, k], q[:, k]), False)
        found.append(crossing[0])
        settled[k[crossing[1]]] = True

        bent_a, bent_b = _bend(p) > STRAIGHT * tolerance, _bend(q) > STRAIGHT * tolerance
        straight = ~(bent_a | bent_b)
        k = np.flatnonzero(straight & ~steep & ~settled)
        place, touching = _nearest_of_chords(p[:, k], q[:, k], tolerance)
        k = k[touching]
        found.append(_near_intersections(curves, a.take(k), b.take(k), place[touching], True)[0])

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


def _hulls_apart(p: Array, q: Array, tolerance: float) -> Array:
    """Whether hulls p, q (4, n) are certainly further apart than the tolerance, (n,) bool."""
    apart = np.zeros(p.shape[1], dtype=bool)
    for axis in (np.ones(p.shape[1], dtype=complex), unit(p[3] - p[0]), unit(q[3] - q[0])):
        x, y = np.conj(axis) * (p - p[0]), np.conj(axis) * (q - p[0])
        for v, w in ((x.real, y.real), (x.imag, y.imag)):
            apart |= (v.min(axis=0) > w.max(axis=0) + tolerance) | (w.min(axis=0) > v.max(axis=0) + tolerance)
    return apart


def _directions(hull: Array) -> Array:
    """(3, n) unit edges of the control polygons, the chord's direction for edges without length."""
    edge, chord = np.diff(hull, axis=0), hull[3] - hull[0]
    return unit(np.where(np.abs(edge) > PARALLEL * np.abs(chord), edge, chord))


def _bend(hull: Array) -> Array:
    """The greatest distance of the inner control points from the chord, (n,)."""
    return np.abs(cross(unit(hull[3] - hull[0]), hull[1:3] - hull[0])).max(axis=0)


def _chord_crossing(p: Array, q: Array) -> Array:
    """The crossing of the chords, clamped to the first one, (n,)."""
    v, w = p[3] - p[0], q[3] - q[0]
    area = cross(v, w)
    return p[0] + np.clip(cross(w, p[0] - q[0]) / np.where(area == 0.0, 1.0, area), 0.0, 1.0) * v


def _nearest_of_chords(p: Array, q: Array, tolerance: float) -> tuple[Array, Array]:
    """The points of nearly parallel chords p that are nearest to q, and whether they touch, (n,) each."""
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


def _near_intersections(
    curves: Curves, a: Arcs, b: Arcs, place: Array, touch: bool
) -> tuple[CommonPoints, Array]:
    """Common points near given points of the chords, and the pairs that have one.

    The parameter of a chord's point is found as its foot on the arc.  The fraction of the chord would not do:
    even a straight arc may start with speed zero.
    touch : whether points within the tolerance count where there is no crossing
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
    """Solve a(t) = b(u) on the two arcs by Newton's method: t, u, and whether it converged, (n,) each."""
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
        done &= (x >= arc.t0 - PARALLEL * slack) & (x <= arc.t1 + PARALLEL * slack)
    return np.clip(t, 0.0, 1.0), np.clip(u, 0.0, 1.0), done


def loops(curves: Curves) -> tuple[Array, Array]:
    """Self-intersections of cubics: (n, 2) the segment twice, (n, 2) the two parameters."""
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
