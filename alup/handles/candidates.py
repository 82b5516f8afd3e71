# SPDX-License-Identifier: GPL-2.0-or-later
"""Points for handles: extreme points, corners, crossings with a line, nodes as Inkscape numbers them.

All points are exact on the cubics B(t).  The height along a direction d is extreme where d . B'(t) = 0, a
quadratic equation.  Between its roots d .  B(t) is monotone, so a line is crossed at most once there, and
bisection finds the crossing.
"""

from __future__ import annotations

import math

import numpy as np

from ..geometry.arrays import Array
from ..geometry.bezier import Nearest, evaluate, nearest_parameters
from ..svg.path_data import ARC, Subpath

# Points whose height differs from the outermost by less than this part of the diagonal lie on one flat side.
# Drawings are rounded to 1e-5 or less.  A side that is tilted by more than this is meant to be tilted.
FLAT_OF_DIAGONAL = 1e-4

# Least angle of a corner.  Smaller turns are facets of round shapes.
CORNER_DEGREES = 30.0

# A point nearer to a line than this part of the diagonal lies on it.  Without this, rounding would miss a
# curve that touches the line without crossing it.
ON_LINE_OF_DIAGONAL = 1e-9

# Halvings that determine a parameter in [0, 1] to the last bit.
_HALVINGS = 54

# Head of an arrow, in widths of its shaft.
_HEAD_LENGTH, _HEAD_WIDTH = 4.0, 3.5

# Inkscape draws an arc as cubics.  It halves the arc until the remainder of its series beyond a cubic is less
# than this, in the path's own units.  The series has six terms, of which a cubic represents three.
_ARC_REMAINDER = 0.1
_TERMS, _OF_CUBIC = 6, 3


def bounds(control: Array) -> Array:
    """Exact bounding box of cubics.  (S, 4, 2) -> (2, 2) least and greatest x, y."""
    low, high = np.zeros(2), np.zeros(2)
    for axis in (0, 1):
        values = _stops(control, np.eye(2)[axis])[1]
        low[axis], high[axis] = np.nanmin(values), np.nanmax(values)
    return np.array([low, high])


def extremes(control: Array, flat: float, apart: float) -> Array:
    """The leftmost, topmost, rightmost and lowest points of cubics, (4 to 8, 2); two ends of a flat side.

    control : (S, 4, 2); flat : user units, greatest difference of height on a flat side
    apart : user units, least length of a side with two points; a shorter side gets its middle, or one end if
        the middle is on no curve
    """
    found = []
    for direction in np.array([[-1.0, 0.0], [0.0, -1.0], [1.0, 0.0], [0.0, 1.0]]):
        t, height = _stops(control, direction)
        level = np.nanmax(height) - flat
        segment, stop = np.nonzero(height >= level)
        points = evaluate(control[segment], t[segment, stop])
        along = points @ [-direction[1], direction[0]]
        ends = points[[along.argmin(), along.argmax()]]
        if np.ptp(along) >= apart:
            found += list(ends)
        else:
            middle = nearest(control, ends.mean(axis=0)[None])[0]
            found.append(middle if middle @ direction >= level else ends[0])
    return np.array(found)


def corners(control: Array, closed: bool, degrees: float = CORNER_DEGREES) -> tuple[Array, Array]:
    """Nodes where a run of cubics turns, and the ends of an open one.

    control : (k, 4, 2), each continues the one before, and the first one the last if closed
    Returns points (n, 2) and the angles by which the curve turns there, (n,) degrees; 180 at open ends.
    """
    start, end = _end_directions(control)
    there = np.linalg.norm(start, axis=1) > 0.0  # segments without length have no direction
    control, start, end = control[there], start[there], end[there]
    if not len(control):
        return np.zeros((0, 2)), np.zeros(0)
    after = np.roll(start, -1, axis=0)
    cross = end[:, 0] * after[:, 1] - end[:, 1] * after[:, 0]
    turn = np.degrees(np.abs(np.arctan2(cross, np.einsum("kd,kd->k", end, after))))
    points = control[:, 3]
    if not closed:
        turn[-1] = 180.0
        points, turn = np.concatenate([control[:1, 0], points]), np.concatenate([[180.0], turn])
    return points[turn > degrees], turn[turn > degrees]


def crossings(control: Array, point: Array, direction: Array, tolerance: float) -> Array:
    """The points where cubics cross the infinite line through a point, (n, 2).

    control : (S, 4, 2); point, direction : (2,)
    tolerance : user units, greatest distance of points on the line
    A segment that lies on the line gives its ends.
    """
    normal = np.array([-direction[1], direction[0]]) / np.hypot(*direction)
    t, height = _stops(control, normal)
    height = height - point @ normal
    with np.errstate(invalid="ignore"):
        on_line = np.abs(height) <= tolerance
        crossed = (height[:, :-1] * height[:, 1:] < 0.0) & ~on_line[:, :-1] & ~on_line[:, 1:]
    segment, stop = np.nonzero(on_line)
    at = [evaluate(control[segment], t[segment, stop])]
    segment, stop = np.nonzero(crossed)
    if len(segment):
        low, high = t[segment, stop], t[segment, stop + 1]
        rising = height[segment, stop] < 0.0
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            beyond = ((evaluate(control[segment], middle) - point) @ normal > 0.0) == rising
            low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
        at.append(evaluate(control[segment], 0.5 * (low + high)))
    return np.concatenate(at)


def thin(points: Array, gap: float) -> Array:
    """Indices of the points to keep so that no two are nearer than `gap`; earlier points have precedence."""
    kept: list[int] = []
    for n, point in enumerate(points):
        if not kept or np.linalg.norm(points[kept] - point, axis=1).min() > gap:
            kept.append(n)
    return np.array(kept, dtype=int)


def arrow(start: Array, end: Array, radius: float, width: float) -> Array | None:
    """Outline (7, 2) of an arrow to the edge of a circle, or None where it would be hidden by the circle.

    start, end : (2,), the circle's centre is the end; width : of the shaft
    """
    away = float(np.linalg.norm(end - start))
    head, length = _HEAD_LENGTH * width, away - radius
    if length <= head:
        return None
    neck, shaft, barb = length - head, 0.5 * width, 0.5 * _HEAD_WIDTH * width
    side = [(0.0, shaft), (neck, shaft), (neck, barb)]
    outline = np.array([*side, (length, 0.0), *((x, -y) for x, y in reversed(side))])
    along = (end - start) / away
    return start + outline @ np.array([along, [-along[1], along[0]]])


def nearest(control: Array, points: Array) -> Array:
    """The points of cubics that are nearest to given ones.  (S, 4, 2), (n, 2) -> (n, 2)."""
    search = Nearest(control)
    return np.array([search.find(point)[2] for point in points]).reshape(-1, 2)


def nodes(subpaths: tuple[Subpath, ...]) -> list[Array]:
    """Nodes of a path as Inkscape's node tool counts them, in the path's own units: (k, 2) a subpath.

    Subpaths without a segment are not counted.  The first node of a closed subpath is also its last one if
    its segments end exactly there (see `path_data.CLOSED_BY`).  Where `z` draws a line, even one of 1e-14,
    there are two nodes.  Inkscape shows arcs as cubics, so an arc has several nodes.
    """
    found = []
    for subpath in subpaths:
        control, kind = subpath.control, subpath.kind
        if not len(control):
            continue
        points = [control[:1, 0]]
        for n in range(len(control)):
            if kind[n] == ARC and n and subpath.arc[n] == subpath.arc[n - 1]:
                continue  # nodes of an arc are listed with its first piece
            points.append(_arc_nodes(subpath, n) if kind[n] == ARC else control[n : n + 1, 3])
        listed = np.concatenate(points)
        found.append(listed[:-1] if subpath.closed else listed)
    return found


def _stops(control: Array, direction: Array) -> tuple[Array, Array]:
    """Parameters between which the height along a direction is monotone, and the heights there.

    (S, 4, 2) -> (S, 4), (S, 4): the ends, and in between the zeros of the quadratic d . B'(t), or NaN
    """
    p = control @ direction
    a = p[:, 3] - 3.0 * p[:, 2] + 3.0 * p[:, 1] - p[:, 0]
    b = p[:, 2] - 2.0 * p[:, 1] + p[:, 0]
    c = p[:, 1] - p[:, 0]
    with np.errstate(all="ignore"):
        # a t^2 + 2 b t + c = 0 without cancellation
        q = -(b + np.copysign(np.sqrt(b * b - a * c), b))
        roots = np.sort(np.stack([q / a, c / q], axis=1), axis=1)
    inside = np.where((roots > 0.0) & (roots < 1.0), roots, 0.0)
    t = np.sort(np.column_stack([np.zeros(len(p)), inside, np.ones(len(p))]), axis=1)
    return t, evaluate(control[:, None], t) @ direction


def _end_directions(control: Array) -> tuple[Array, Array]:
    """Directions at both ends, (S, 2) each: to the first control point that differs from the node, or 0."""
    directions = []
    for run in (control, control[:, ::-1]):
        steps = run[:, 1:] - run[:, :1]
        first = (np.abs(steps).max(axis=2) > 0.0).argmax(axis=1)
        directions.append(steps[np.arange(len(run)), first])
    return directions[0], -directions[1]


def _arc_nodes(subpath: Subpath, first: int) -> Array:
    """Nodes that Inkscape's node tool shows after the beginning of an arc.

    first : index of the arc's first cubic -> (k, 2)
    """
    number = subpath.arc[first]
    pieces = subpath.control[subpath.arc == number]
    rx, ry, rotation, _, sweep = subpath.arcs[number]
    phi = math.radians(rotation)
    axes = np.array([[math.cos(phi), -math.sin(phi)], [math.sin(phi), math.cos(phi)]]) * [rx, ry]
    # On the unit circle a cubic has a handle of 4/3 tan(s/4) and a chord of 2 sin(s/2), whose ratio is
    # 3 cos(s/4)^2: so the pieces tell the angle s, and how much too small radii were enlarged.
    chord, handle = np.linalg.solve(axes, (pieces[0, [3, 1]] - pieces[0, 0]).T).T
    share = np.clip(np.hypot(*chord) / (3.0 * max(np.hypot(*handle), np.finfo(float).tiny)), 0.0, 1.0)
    turn = 4.0 * math.acos(math.sqrt(share)) * (1.0 if sweep else -1.0)
    if turn == 0.0:
        return pieces[-1:, 3]
    enlarged = np.hypot(*chord) / abs(2.0 * math.sin(turn / 2.0))
    x, y = handle / (4.0 / 3.0 * math.tan(turn / 4.0) * enlarged)  # the unit tangent: (-sin, cos)
    begin, swept = math.atan2(-x, y), turn * len(pieces)
    circle = [_sine(begin + math.pi / 2.0, begin + swept + math.pi / 2.0), _sine(begin, begin + swept)]
    cuts = np.array(_cuts(np.einsum("xf,fke->xke", axes * enlarged, circle)))
    place, angle = cuts * len(pieces), begin + swept * cuts
    piece = np.clip(place.astype(int), 0, len(pieces) - 1)
    centre = pieces[0, 0] - axes @ [math.cos(begin), math.sin(begin)] * enlarged
    exact = np.stack([np.cos(angle), np.sin(angle)], axis=1) @ (axes * enlarged).T + centre
    t = nearest_parameters(pieces[piece], exact, place - piece)
    return np.concatenate([evaluate(pieces[piece], t), pieces[-1:, 3]])


def _cuts(series: Array, low: float = 0.0, high: float = 1.0) -> list[float]:
    """The parameters between low and high at which an arc is cut into cubics; series : (2, 6, 2)."""
    if _remainder(_part(series, low, high)) < _ARC_REMAINDER:
        return []
    middle = (low + high) / 2.0
    return [*_cuts(series, low, middle), middle, *_cuts(series, middle, high)]


def _sine(begin: float, end: float) -> Array:
    """Series of the sine from one angle to another: (6, 2) a_k, b_k of

        sum ((1-t) a_k + t b_k) (t (1-t))^k

    which meets the sine and its derivatives at both ends; the recurrence follows from f'' = -w^2 f.
    """
    width = end - begin
    s = np.zeros((_TERMS, 2))
    s[0] = math.sin(begin), math.sin(end)
    rise = s[0, 1] - s[0, 0]
    s[1] = math.cos(begin) * width - rise, rise - math.cos(end) * width
    for k in range(_TERMS - 2):
        s[k + 2] = 4.0 * (k + 1) * s[k + 1] - 2.0 * s[k + 1, ::-1] - s[k] * width**2 / (k + 1)
        s[k + 2] /= k + 2
    return s


def _terms(t: Array) -> Array:
    """The basis functions of a series at parameters, (m,) -> (m, 12)."""
    powers = (t * (1.0 - t))[:, None] ** np.arange(_TERMS)
    return np.stack([(1.0 - t)[:, None] * powers, t[:, None] * powers], axis=2).reshape(len(t), -1)


def _part(series: Array, low: float, high: float) -> Array:
    """The series of the same polynomial on a part of [0, 1]."""
    t = 0.5 - 0.5 * np.cos(np.pi * (np.arange(2 * _TERMS) + 0.5) / (2 * _TERMS))
    values = series.reshape(len(series), -1) @ _terms(low + (high - low) * t).T
    return np.linalg.solve(_terms(t), values.T).T.reshape(series.shape)


def _remainder(series: Array) -> float:
    """Upper bound of the difference between a series (2, 6, 2) and its cubic part."""
    low, high = np.zeros(len(series)), np.zeros(len(series))
    for k in range(_TERMS - 1, _OF_CUBIC - 1, -1):
        a, b = series[:, k].T
        # Each new bound is combined with the previous other one into an interval, as lib2geom does.
        low, high = np.sort([-_bound(-a, -b, -low), high], axis=0)
        low, high = np.sort([low, _bound(a, b, high)], axis=0)
    return float(np.maximum(-low, high).max()) * 0.25**_OF_CUBIC


def _bound(a: Array, b: Array, v: Array) -> Array:
    """Greatest value of (1-t) a + t b + v t (1-t) for 0 <= t <= 1 and v >= 0."""
    with np.errstate(all="ignore"):
        t = np.where(v > 0.0, ((b - a) / v + 1.0) / 2.0, -1.0)
        return np.where((t < 0.0) | (t > 1.0), np.maximum(a, b), (1.0 - t) * (a + v * t) + t * b)
