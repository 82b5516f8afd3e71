# SPDX-License-Identifier: GPL-2.0-or-later
"""Whether two curves stay together between two common points, and the crossing of a run of such points.

Two common points of two curves are *connected* if the curves stay within the tolerance of each other between
them (`together`).  Connected points form a run.  A run without a node is one crossing (`run_crossings`).  Of
an odd number of exact intersections it is the middle one.  Of an even number, as of a tangential touch that
is slightly too deep, it is the closest approach between the central two.  Without any it is the closest
approach.
"""

from __future__ import annotations

import numpy as np

from ..model import Array
from .curve_intersections import NEWTON, STRAIGHT, CommonPoints
from .monotone_arcs import EXACT, Curves, cross, dot, foot

# Two curves are compared at 7 points between two common points.  Two cubics meet in at most nine points, so
# a gap that is closed at all of these and open in between is very unlikely.
_COMPARED = np.linspace(0.0, 1.0, 9)

# Pairs of curves compared in one call: the temporaries fit into the cache, and memory is bounded.
_BATCH = 1 << 14

# The lengths of two curves that stay together differ by at most this factor and two tolerances.  (It is
# reached by curves at 45 degrees.)  Pairs beyond it are rejected without a comparison of points.
_LENGTH_RATIO = 1.5


def _nearest(curves: Curves, s: Array, p: Array, low: Array, high: Array) -> Array:
    """Distance of points p to segments s between the parameters low and high, (n,) user units."""
    t = low + (high - low) * _COMPARED[:, None]
    best, each = np.abs(curves.point(s, t) - p).argmin(axis=0), np.arange(len(s))
    low, high = t[np.maximum(best - 1, 0), each], t[np.minimum(best + 1, len(t) - 1), each]
    return np.abs(curves.point(s, foot(curves, s, p, low, high, STRAIGHT * curves.tolerance)) - p)


def together(
    curves: Curves, a: Array, t0: Array, t1: Array, b: Array, u0: Array, u1: Array
) -> tuple[Array, Array]:
    """Whether a on [t0, t1] and b on [u0, u1] stay within the tolerance, and the length of the longer one.

    All arguments and results are (n,); lengths are in user units.
    """
    columns = (a, t0, t1, b, u0, u1)
    parts = [
        _together(curves, *(column[n : n + _BATCH] for column in columns))
        for n in range(0, max(len(a), 1), _BATCH)
    ]
    return np.concatenate([held for held, _ in parts]), np.concatenate([length for _, length in parts])


def _together(
    curves: Curves, a: Array, t0: Array, t1: Array, b: Array, u0: Array, u1: Array
) -> tuple[Array, Array]:
    """`together` for one batch.

    Points at the same fraction of both curves are at least as far apart as each is from the other curve.
    Where they are within the tolerance, as nearly always, no nearest point has to be computed.
    """
    tolerance = curves.tolerance
    length_a, length_b = np.abs(curves.length(a, t0, t1)), np.abs(curves.length(b, u0, u1))
    length = np.maximum(length_a, length_b)
    together = length <= 2.0 * tolerance
    alike = length <= _LENGTH_RATIO * np.minimum(length_a, length_b) + 2.0 * tolerance
    k = np.flatnonzero(alike & ~together)
    inner = _COMPARED[1:-1, None]
    p = curves.point(a[k], t0[k] + inner * (t1[k] - t0[k]))
    q = curves.point(b[k], u0[k] + inner * (u1[k] - u0[k]))
    paired = (np.abs(p - q) <= tolerance).all(axis=0)
    together[k[paired]] = True
    k, p, q = k[~paired], p[:, ~paired], q[:, ~paired]
    u_low, u_high = np.minimum(u0, u1), np.maximum(u0, u1)
    t_low, t_high = np.minimum(t0, t1), np.maximum(t0, t1)
    # The middle point comes first: it rejects nearly all curves that part.
    for n in sorted(range(len(inner)), key=lambda n: abs(2 * n + 1 - len(inner))):
        gap = _nearest(curves, b[k], p[n], u_low[k], u_high[k])
        gap = np.maximum(gap, _nearest(curves, a[k], q[n], t_low[k], t_high[k]))
        near = gap <= (1.0 + 2.0 * STRAIGHT) * tolerance
        k, p, q = k[near], p[:, near], q[:, near]
    together[k] = True
    return together, length


def run_crossings(curves: Curves, row: CommonPoints, run: Array) -> tuple[Array, Array]:
    """One crossing for each run of common points: (n, 2) segments, (n, 2) parameters; see the module's head.

    row : the common points; run : (m,) the run that each belongs to
    """
    gap = np.abs(curves.point(row.a, row.t) - curves.point(row.b, row.u))
    order = np.lexsort((np.where(row.exact, row.t, gap), ~row.exact, run))
    row, run = CommonPoints(*(column[order] for column in row)), run[order]
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
        # Where the curves touch, v and w are parallel.  The second derivatives keep the matrix regular.
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
