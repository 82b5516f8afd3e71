# SPDX-License-Identifier: GPL-2.0-or-later
"""Where two curves stay together, and the one point that stands for a stretch on which they do.

Two points that two curves have in common are *connected* if the curves stay within the tolerance of each
other between them (`together`).  A connected run of such points that no node explains is one crossing
(`middle`): the middle one of an odd number; of an even number, the touching point between the central
two, when a tangential touch is a little too deep; without any, the closest approach.
"""

from __future__ import annotations

import numpy as np

from ..model import Array
from .curve_intersections import NEWTON, STRAIGHT, Meetings
from .monotone_arcs import EXACT, Curves, cross, dot, foot

# Where two curves are compared between two meetings: 7 inner points.  Two cubics meet in at most
# nine, so a gap that closes at all of these and opens in between is all but excluded.
_BETWEEN = np.linspace(0.0, 1.0, 9)

# Stretches compared together: their temporaries stay in the cache, and memory is bounded.
_AT_A_TIME = 1 << 14

# Lengths of two connected stretches differ at most by this factor (and two tolerances): curves
# 45 degrees apart do not stay together; it only saves looking closer.
_STRETCHED = 1.5


def _nearest(curves: Curves, s: Array, p: Array, low: Array, high: Array) -> Array:
    """Distance of p to segment s between low and high."""
    t = low + (high - low) * _BETWEEN[:, None]
    best, each = np.abs(curves.point(s, t) - p).argmin(axis=0), np.arange(len(s))
    low, high = t[np.maximum(best - 1, 0), each], t[np.minimum(best + 1, len(t) - 1), each]
    return np.abs(curves.point(s, foot(curves, s, p, low, high, STRAIGHT * curves.tolerance)) - p)


def together(
    curves: Curves, a: Array, t0: Array, t1: Array, b: Array, u0: Array, u1: Array
) -> tuple[Array, Array]:
    """Whether a on [t0, t1] and b on [u0, u1] stay within the tolerance; and the stretch's length."""
    columns = (a, t0, t1, b, u0, u1)
    parts = [
        _stretches(curves, *(column[n : n + _AT_A_TIME] for column in columns))
        for n in range(0, max(len(a), 1), _AT_A_TIME)
    ]
    return np.concatenate([held for held, _ in parts]), np.concatenate([length for _, length in parts])


def _stretches(
    curves: Curves, a: Array, t0: Array, t1: Array, b: Array, u0: Array, u1: Array
) -> tuple[Array, Array]:
    """`together` of a few.

    Points at the same share of both stretches are no nearer to each other than to the other curve: where they
    are within the tolerance, as nearly always, no foot has to be looked for.
    """
    tolerance = curves.tolerance
    length_a, length_b = np.abs(curves.length(a, t0, t1)), np.abs(curves.length(b, u0, u1))
    length = np.maximum(length_a, length_b)
    together = length <= 2.0 * tolerance
    alike = length <= _STRETCHED * np.minimum(length_a, length_b) + 2.0 * tolerance
    k = np.flatnonzero(alike & ~together)
    inner = _BETWEEN[1:-1, None]
    p = curves.point(a[k], t0[k] + inner * (t1[k] - t0[k]))
    q = curves.point(b[k], u0[k] + inner * (u1[k] - u0[k]))
    paired = (np.abs(p - q) <= tolerance).all(axis=0)
    together[k[paired]] = True
    k, p, q = k[~paired], p[:, ~paired], q[:, ~paired]
    u_low, u_high = np.minimum(u0, u1), np.maximum(u0, u1)
    t_low, t_high = np.minimum(t0, t1), np.maximum(t0, t1)
    # the middle first: it rules out nearly all that part
    for n in sorted(range(len(inner)), key=lambda n: abs(2 * n + 1 - len(inner))):
        gap = _nearest(curves, b[k], p[n], u_low[k], u_high[k])
        gap = np.maximum(gap, _nearest(curves, a[k], q[n], t_low[k], t_high[k]))
        near = gap <= (1.0 + 2.0 * STRAIGHT) * tolerance
        k, p, q = k[near], p[:, near], q[:, near]
    together[k] = True
    return together, length


def middle(curves: Curves, row: Meetings, run: Array) -> tuple[Array, Array]:
    """One crossing for each run of meetings: (n, 2) segments, (n, 2) parameters."""
    gap = np.abs(curves.point(row.a, row.t) - curves.point(row.b, row.u))
    order = np.lexsort((np.where(row.exact, row.t, gap), ~row.exact, run))
    row, run = Meetings(*(column[order] for column in row)), run[order]
    first = np.flatnonzero(np.append(True, np.diff(run) != 0)) if len(run) else np.empty(0, dtype=np.int64)
    exact = np.add.reduceat(row.exact.astype(np.int64), first) if len(first) else first
    before = first + np.maximum(exact - 1, 0) // 2
    after = first + np.where(exact > 0, exact // 2, 0)
    a, b = row.a[first], row.b[first]
    t, u = 0.5 * (row.t[before] + row.t[after]), 0.5 * (row.u[before] + row.u[after])

    k = np.flatnonzero(exact % 2 == 0)
    ends = np.sort(np.stack([row.u[before[k]], row.u[after[k]]]), axis=0)
    u[k] = foot(curves, b[k], curves.point(a[k], t[k]), ends[0], ends[1], EXACT * curves.extent)
    t[k], u[k] = _closest(curves, a[k], t[k], b[k], u[k])
    return np.stack([a, b], axis=1), np.stack([t, u], axis=1)


def _closest(curves: Curves, a: Array, t: Array, b: Array, u: Array) -> tuple[Array, Array]:
    """The common normal (b(u) - a(t)) . a' = (b(u) - a(t)) . b' = 0 near a touch, by Newton's method."""
    start = t, u
    for _ in range(NEWTON):
        gap = curves.point(b, u) - curves.point(a, t)
        v, w = curves.velocity(a, t), curves.velocity(b, u)
        # where the curves touch v and w are parallel: the sums below keep the matrix regular
        f, g = dot(gap, v), cross(v, w)
        f_t = dot(gap, curves.acceleration(a, t)) - dot(v, v)
        f_u = dot(v, w)
        g_t, g_u = cross(curves.acceleration(a, t), w), cross(v, curves.acceleration(b, u))
        with np.errstate(all="ignore"):
            area = f_t * g_u - f_u * g_t
            dt, du = (f_u * g - g_u * f) / area, (g_t * f - f_t * g) / area
        finite = np.isfinite(dt) & np.isfinite(du)
        t, u = t + np.where(finite, dt, 0.0), u + np.where(finite, du, 0.0)
        t, u = np.clip(t, 0.0, 1.0), np.clip(u, 0.0, 1.0)
    near = np.abs(curves.point(b, u) - curves.point(a, t)) <= (1.0 + 2.0 * STRAIGHT) * curves.tolerance
    near &= together(curves, a, start[0], t, b, start[1], u)[0]
    return np.where(near, t, start[0]), np.where(near, u, start[1])
