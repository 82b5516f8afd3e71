"""Where the curves of a drawing touch: the split parameters that make it a network.

Problem.  A drawing is S cubics B_s(t), t in [0, 1], each with two *nodes* B_s(0), B_s(1).  Two
curves *touch* where they are no further apart than `tolerance`.  Wanted are parameters to split
at, so that afterwards curves touch at ends of pieces only, or along whole pieces:

* T-junction: a node of one segment lies on the interior of another, or of its own;
* overlap: a T-junction from which the two curves run on together, to another common node;
* crossing: two interiors meet in one point, transversally or tangentially, or a cubic meets itself.

Arcs and nodes that may touch come from `_grid`.  `x` is the cross product of plane vectors.

Nodes on curves (`_touches`).  The foot t of node p on an arc solves (B(t) - p) . B'(t) = 0, which
changes sign once, from - to +, near a monotone arc: Newton steps inside a bracket.

Crossings (`_meetings`).  For two arcs A, B with control polygons P, Q one of these holds.
  1. The boxes, or strips along the chords, keep them further apart than the tolerance: done.
  2. (P_i+1 - P_i) x (Q_j+1 - Q_j) has one sign for all nine i, j.  Derivatives are convex
     combinations of these edges, so A(t) - A(t') = B(u) - B(u') would say (t - t') a = (u - u') b
     with a x b != 0: at most one crossing.  Newton from the chords; what it does not settle is
     halved until the hulls are apart.
  3. The arcs leave a common node into opposite half-planes: they meet only there.
  4. Both are straight to a fraction of the tolerance, and nearly parallel: the least distance of
     the chords over their common range says whether they touch, and where Newton may start.
  5. Otherwise the arcs are halved.

A cubic meets itself (`_loops`) where B(p) = B(q), p != q.  With B = a t^3 + b t^2 + c t + d and
sigma = p + q, pi = p q, dividing by p - q leaves  a (sigma^2 - pi) + b sigma + c = 0.  Its cross
products with a and with b give  sigma = (c x a) / (a x b),  pi = sigma^2 - (b x c) / (a x b).
A cubic whose control points are collinear may instead turn back on itself (`_nodes`); its turning
points count as nodes, so that the stretches there and back become pieces with common ends.

Stretches (`_judge`).  Near a tangential touch, and wherever curves coincide, step 4 and rounding
yield many meetings of the same two segments.  Two neighbours are *connected* if the curves stay
within the tolerance of each other between them.  A connected run that contains a node is what the
node makes of it: no crossing, and an overlap if it contains two.  A run without a node is one
crossing: the middle one of an odd number; of an even number, the middle between the central two
(the touching point, when a tangential touch is a little too deep); without any, the closest
approach.  So duplicates, curves that leave a node tangentially, and lines that coincide but for
rounding have no crossings.

Copies.  Segments that are the same cubic to rounding, in either direction (a fill and its stroke),
are looked at once; the splits are then copied, so that n copies cost n, not n^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ._grid import Arcs, Curves, arcs_of, curves_of, overlapping, ranges, turning

Array = np.ndarray

T_JUNCTION = 0
OVERLAP = 1
CROSSING = 2

# Control points equal to this fraction of the drawing are copies, and crossings are solved to it.
# Rounding of a few transforms is 1e-15; 1e-11 would move crossings of copies visibly apart.
_EXACT = 1e-13

# "Straight" in step 4, in tolerances: what the two chords may add to a distance is twice this.
# A half makes contacts a tolerance apart uncertain, a thirtieth doubles the number of pairs.
_STRAIGHT = 1.0 / 8.0

# Sine below which directions count as parallel.  Newton loses as many digits as 1/sine has: at
# 1e-6 it keeps 10 of 16; below, step 4 decides, which does not divide by the sine.
_PARALLEL = 1e-6

# Pairs of arcs looked at together: their temporaries stay in the cache, and memory bounded.
_CHUNK = 1 << 14

# Halvings of a pair: an arc as long as the drawing falls below 1e-7 of it.
_HALVINGS = 24

# Feet of one node within this arc length, in tolerances, are one foot: points of a curve that are
# within the tolerance of the node are at most two apart, and a bend may add as much again.
_ONE_FOOT = 4.0

# Newton steps.  From a start right to 1/8, 5 reach rounding; inside a bracket it may have to bisect
# through a cusp, where convergence is linear.
_NEWTON = 9
_BRACKETED = 60

# Where two curves are compared between two meetings: 7 inner points.  Two cubics meet in at most
# nine, so a gap that closes at all of these and opens in between is all but excluded.
_BETWEEN = np.linspace(0.0, 1.0, 9)

# Lengths of two connected stretches differ at most by this factor (and two tolerances): curves
# 45 degrees apart do not stay together; it only saves looking closer.
_STRETCHED = 1.5


@dataclass(frozen=True)
class Contacts:
    """Where to split, and which ends of the pieces are one point.  K splits, S segments.

    segment : (K,) int, sorted; t : (K,) float in (0, 1), increasing within a segment
    kind : (K,) int, T_JUNCTION, OVERLAP or CROSSING
    group : (K,) int, the point of the network that the split lies in
    node : (K,) int, 2 * segment + end of a segment end that lies in this point, or -1
    end : (2 S,) int, the point that each segment end lies in, numbered together with `group`
    """

    segment: Array
    t: Array
    kind: Array
    group: Array
    node: Array
    end: Array


class _Nodes(NamedTuple):
    """Distinct node positions, z : (N,) complex, and who owns them, (M,) each, sorted by `place`.

    place : index into z; s, t : segment and parameter; end : 2 s + end, -1 at a turning point
    first, owners : (N,) where the owners of a position begin, and how many they are
    """

    z: Array
    place: Array
    s: Array
    t: Array
    end: Array
    first: Array
    owners: Array


class _Meetings(NamedTuple):
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


def contacts(control: Array, line: Array, tolerance: float, *, crossings: bool = True) -> Contacts:
    """Find where the segments have to be split.

    control : (S, 4, 2) finite control points; line : (S,) bool, straight at constant speed
    tolerance : > 0, user units; crossings : also where interiors meet, not only nodes
    """
    curves = curves_of(control, line, tolerance)
    original, flipped = _copies(control, curves.extent)
    chosen, copied = np.unique(original, return_inverse=True)
    curves = curves._replace(power=curves.power[:, chosen])

    nodes = _nodes(curves)
    arcs, pairs, near, welds = _candidates(curves, nodes)
    touch_s, touch_t, touch_node, joined = _touches(curves, nodes, arcs, near)
    label = _components(len(nodes.z), np.concatenate([welds, joined], axis=1))

    rows = [_node_rows(nodes, touch_s, touch_t, touch_node)]
    if crossings:
        rows += _meetings(curves, arcs, pairs)
    overlap, pair_s, pair_t = _judge(curves, rows, nodes, label, len(touch_s))
    if crossings:
        loop_s, loop_t = _loops(curves)
        pair_s, pair_t = np.concatenate([pair_s, loop_s]), np.concatenate([pair_t, loop_t])
    inside = _inside(curves, pair_s.ravel(), pair_t.ravel()).reshape(-1, 2).all(axis=1)
    pair_s, pair_t = pair_s[inside].ravel(), pair_t[inside].ravel()

    no_node = np.full(len(pair_s), -1)
    owner = nodes.end[nodes.first[touch_node]]
    found = Contacts(
        np.concatenate([touch_s, pair_s]),
        np.concatenate([touch_t, pair_t]),
        np.concatenate([np.where(overlap, OVERLAP, T_JUNCTION), np.full(len(pair_s), CROSSING)]),
        np.concatenate([label[touch_node], len(nodes.z) + np.arange(len(pair_s)) // 2]),
        np.concatenate([np.where(owner >= 0, 2 * chosen[owner // 2] + owner % 2, -1), no_node]),
        _end_labels(nodes, label, len(chosen)),
    )
    return _copy(_merge(curves, found), copied, flipped)


def split(control: Array, line: Array, found: Contacts) -> tuple[Array, Array, Array]:
    """Cut the segments: (P, 4, 2) control points, (P,) source segment, (P, 2) its range of t.

    The polar form of the cubic, b(t0, t0, t0), b(t0, t0, t1), b(t0, t1, t1), b(t1, t1, t1), by
    de Casteljau's steps with three different parameters.  Neighbouring pieces share their ends
    and outer ends are the segment's own, to the last bit.
    """
    segment = np.concatenate([np.arange(len(control)), found.segment])
    start = np.concatenate([np.zeros(len(control)), found.t])
    order = np.lexsort((start, segment))
    segment, start = segment[order], start[order]
    stop = np.ones(len(start))
    follows = np.flatnonzero(segment[1:] == segment[:-1])
    stop[follows] = start[follows + 1]

    polar = np.empty((len(segment), 4, 2))
    for k in range(4):
        points = control[segment]
        for r in range(3):
            t = np.where(r < 3 - k, start, stop)[:, None, None]
            points = (1.0 - t) * points[:, :-1] + t * points[:, 1:]
        polar[:, k] = points[:, 0]
    straight = line[segment]
    step = (polar[straight, 3] - polar[straight, 0]) / 3.0
    polar[straight, 1] = polar[straight, 0] + step
    polar[straight, 2] = polar[straight, 3] - step
    return polar, segment, np.stack([start, stop], axis=1)


def _cross(v: Array, w: Array) -> Array:
    return v.real * w.imag - v.imag * w.real


def _dot(v: Array, w: Array) -> Array:
    return v.real * w.real + v.imag * w.imag


def _unit(v: Array) -> Array:
    size = np.abs(v)
    return v / np.where(size > 0.0, size, 1.0)


def _components(n: int, edges: Array) -> Array:
    """(n,) number of the connected component; edges : (2, E) int."""
    graph = coo_matrix((np.ones(edges.shape[1]), (edges[0], edges[1])), shape=(n, n))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def _copies(control: Array, extent: float) -> tuple[Array, Array]:
    """The first segment that is the same cubic, (S,), and whether it runs the other way, (S,) bool.

    Rounded control points are hashed, first to last and last to first; the lesser hash counts.
    A collision would only hide a copy, for the points themselves are compared.
    """
    n = len(control)
    if not n:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=bool)
    middle = 0.5 * (control.min(axis=(0, 1)) + control.max(axis=(0, 1)))
    rounded = np.rint((control - middle) / max(_EXACT * extent, np.finfo(float).tiny)).astype(np.int64)
    factor = np.random.default_rng(1).integers(1, 1 << 62, size=(4, 2)) | 1
    ahead = (rounded * factor).sum(axis=(1, 2))
    back = (rounded[:, ::-1] * factor).sum(axis=(1, 2))
    way = back < ahead
    rounded[way] = rounded[way][:, ::-1]
    _, first, inverse = np.unique(np.minimum(ahead, back), return_index=True, return_inverse=True)
    original = first[inverse]
    same = (rounded == rounded[original]).all(axis=(1, 2))
    original = np.where(same, original, np.arange(n))
    return original, (way != way[original]) & same


def _nodes(curves: Curves) -> _Nodes:
    """Segment ends, and the turning points of collinear cubics, equal positions gathered."""
    n = curves.power.shape[1]
    s, end = np.repeat(np.arange(n), 2), np.arange(2 * n)
    t = (end % 2).astype(float)

    flat, axis = _collinear(curves)
    along = (curves.power[:, flat] * np.conj(axis[flat])).real
    turn = turning(along[1], 2.0 * along[2], 3.0 * along[3])
    which, root = np.nonzero(~np.isnan(turn))
    s = np.concatenate([s, np.flatnonzero(flat)[which]])
    t = np.concatenate([t, turn[which, root]])
    end = np.concatenate([end, np.full(len(which), -1)])

    z = curves.point(s, t)
    rounded = np.rint(z / max(_EXACT * curves.extent, np.finfo(float).tiny))
    _, chosen, place = np.unique(rounded, return_index=True, return_inverse=True)
    order = np.lexsort((end < 0, place))
    count = np.bincount(place, minlength=len(chosen))
    return _Nodes(z[chosen], place[order], s[order], t[order], end[order], np.cumsum(count) - count, count)


def _collinear(curves: Curves) -> tuple[Array, Array]:
    """Whether the control points are collinear to the tolerance, and their direction."""
    every = np.arange(curves.power.shape[1])
    hull = curves.hull(every, np.zeros(len(every)), np.ones(len(every)))
    edge = np.diff(hull, axis=0)
    axis = edge[np.abs(edge).argmax(axis=0), every]
    axis = _unit(axis)
    return (np.abs(_cross(axis, hull - hull[0])) <= curves.tolerance).all(axis=0), axis


def _end_labels(nodes: _Nodes, label: Array, n: int) -> Array:
    """(2 n,) the label of each segment end."""
    ends = nodes.end >= 0
    result = np.empty(2 * n, dtype=np.int64)
    result[nodes.end[ends]] = label[nodes.place[ends]]
    return result


def _candidates(curves: Curves, nodes: _Nodes) -> tuple[Arcs, Array, Array, Array]:
    """The arcs, and what may touch: (2, n) arc and arc, (2, m) arc and node, (2, w) equal nodes."""
    arcs, size = arcs_of(curves)
    n = len(arcs.s)
    hull = curves.hull(*arcs)
    grown = 0.5 * curves.tolerance + 4.0 * np.finfo(float).eps * curves.extent
    low = (
        np.concatenate(
            [
                np.stack([hull.real.min(axis=0), hull.imag.min(axis=0)], axis=1),
                np.stack([nodes.z.real, nodes.z.imag], axis=1),
            ]
        )
        - grown
    )
    high = (
        np.concatenate(
            [
                np.stack([hull.real.max(axis=0), hull.imag.max(axis=0)], axis=1),
                np.stack([nodes.z.real, nodes.z.imag], axis=1),
            ]
        )
        + grown
    )
    i, j = overlapping(low, high, size)
    i, j = np.minimum(i, j), np.maximum(i, j)
    pairs = np.stack([i, j])[:, j < n]
    near = np.stack([i, j - n])[:, (i < n) & (j >= n)]
    welds = np.stack([i - n, j - n])[:, i >= n]
    welds = welds[:, np.abs(nodes.z[welds[0]] - nodes.z[welds[1]]) <= curves.tolerance]

    a, b = arcs.s[pairs[0]], arcs.s[pairs[1]]
    every = np.arange(curves.power.shape[1])
    whole = curves.hull(every, np.zeros(len(every)), np.ones(len(every)))
    # segments whose control points agree to the tolerance coincide throughout
    differ = (np.abs(whole[:, a] - whole[:, b]) > curves.tolerance).any(axis=0)
    differ &= (np.abs(whole[:, a] - whole[::-1, b]) > curves.tolerance).any(axis=0)
    return arcs, pairs[:, differ & (a != b)], near, welds


def _foot(curves: Curves, s: Array, p: Array, low: Array, high: Array, accuracy: float) -> Array:
    """Parameter in [low, high] of the point of segment s nearest to p, where there is one minimum.

    accuracy : arc length; Newton's steps end below it
    """
    first, last = curves.point(s, low), curves.point(s, high)
    at_low, at_high = (
        # an arc may begin or end at rest, at a cusp or turning point: its chord stands in
        _dot(end - p, np.where(np.abs(v) * (high - low) > _PARALLEL * np.abs(last - first), v, last - first))
        for end, v in ((first, curves.velocity(s, low)), (last, curves.velocity(s, high)))
    )
    result = np.where(at_low >= 0.0, low, high)
    k = np.flatnonzero((at_low < 0.0) & (at_high > 0.0))
    low, high = low[k], high[k]
    t = low + (high - low) * at_low[k] / (at_low[k] - at_high[k])
    for _ in range(_BRACKETED):
        apart, v = curves.point(s[k], t) - p[k], curves.velocity(s[k], t)
        value, rate = _dot(apart, v), _dot(v, v) + _dot(apart, curves.acceleration(s[k], t))
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


def _touches(curves: Curves, nodes: _Nodes, arcs: Arcs, near: Array) -> tuple[Array, Array, Array, Array]:
    """Nodes on interiors: (n,) segment, (n,) t, (n,) node, and (2, m) nodes that are one instead.

    The feet of a node on neighbouring arcs of a segment are gathered by arc length.  Where they
    reach an end of the segment that the node coincides with, there is no T-junction; where the
    best of them is within the tolerance of an end, the node and that end are one.
    """
    arc, node = near
    p, tolerance = nodes.z[node], curves.tolerance
    hull = curves.hull(*arcs)
    axis = _unit(hull[3] - hull[0])
    offset = _cross(axis, hull - hull[0])
    height = _cross(axis[arc], p - hull[0, arc])
    keep = (height <= offset.max(axis=0)[arc] + tolerance) & (height >= offset.min(axis=0)[arc] - tolerance)
    arc, node, p = arc[keep], node[keep], p[keep]

    s = arcs.s[arc]
    t = _foot(curves, s, p, arcs.t0[arc], arcs.t1[arc], _EXACT * curves.extent)
    gap = np.abs(curves.point(s, t) - p)
    order = np.flatnonzero(gap <= tolerance)
    order = order[np.lexsort((t[order], s[order], node[order]))]
    s, t, node, gap = s[order], t[order], node[order], gap[order]
    if not len(s):
        return s, t, node, np.empty((2, 0), dtype=np.int64)
    new = (np.diff(s) != 0) | (np.diff(node) != 0)
    new |= curves.length(s[:-1], t[:-1], t[1:]) > _ONE_FOOT * tolerance
    run = np.cumsum(np.append(False, new))
    at_end = np.zeros(run[-1] + 1, dtype=bool)
    at_end[run[(t == 0.0) | (t == 1.0)]] = True
    best = np.lexsort((gap, run))
    best = best[np.append(True, np.diff(run[best]) != 0)]
    best = best[~at_end[run[best]]]
    s, t, node = s[best], t[best], node[best]

    inside = _inside(curves, s, t)
    label = _end_labels(nodes, np.arange(len(nodes.z)), curves.power.shape[1])
    joined = np.stack([node[~inside], label[2 * s[~inside] + (t[~inside] > 0.5)]])
    return s[inside], t[inside], node[inside], joined


def _inside(curves: Curves, s: Array, t: Array) -> Array:
    """(n,) bool: further than the tolerance from both ends of the segment, along it."""
    zero, one = np.zeros(len(t)), np.ones(len(t))
    return (curves.length(s, zero, t) > curves.tolerance) & (curves.length(s, t, one) > curves.tolerance)


def _node_rows(nodes: _Nodes, s: Array, t: Array, node: Array) -> _Meetings:
    """Each T-junction once for every owner of its node."""
    touch, owner = ranges(nodes.first[node], nodes.owners[node])
    true = np.ones(len(touch), dtype=bool)
    return _ordered(s[touch], t[touch], nodes.s[owner], nodes.t[owner], true, touch, true)


def _ordered(a: Array, t: Array, b: Array, u: Array, exact: Array, touch: Array, node: Array) -> _Meetings:
    swap = a > b
    first, second = np.where(swap, b, a), np.where(swap, a, b)
    return _Meetings(first, np.where(swap, u, t), second, np.where(swap, t, u), exact, touch, node)


def _apart(p: Array, q: Array, tolerance: float) -> Array:
    """(n,) bool: hulls p, q : (4, n) are seen to be further apart than the tolerance."""
    apart = np.zeros(p.shape[1], dtype=bool)
    for axis in (np.ones(p.shape[1], dtype=complex), _unit(p[3] - p[0]), _unit(q[3] - q[0])):
        x, y = np.conj(axis) * (p - p[0]), np.conj(axis) * (q - p[0])
        for v, w in ((x.real, y.real), (x.imag, y.imag)):
            apart |= (v.min(axis=0) > w.max(axis=0) + tolerance) | (w.min(axis=0) > v.max(axis=0) + tolerance)
    return apart


def _directions(hull: Array) -> Array:
    """(3, n) unit edges of the control polygons, the chord's direction for edges without length."""
    edge, chord = np.diff(hull, axis=0), hull[3] - hull[0]
    return _unit(np.where(np.abs(edge) > _PARALLEL * np.abs(chord), edge, chord))


def _bend(hull: Array) -> Array:
    """(n,) greatest distance of the inner control points from the chord."""
    return np.abs(_cross(_unit(hull[3] - hull[0]), hull[1:3] - hull[0])).max(axis=0)


def _newton(curves: Curves, a: Arcs, b: Arcs, t: Array, u: Array) -> tuple[Array, Array, Array]:
    """Solve a(t) = b(u) on the two arcs: t, u, and whether that succeeded."""
    slack_a, slack_b = 0.25 * (a.t1 - a.t0), 0.25 * (b.t1 - b.t0)
    for _ in range(_NEWTON):
        gap = curves.point(a.s, t) - curves.point(b.s, u)
        v, w = curves.velocity(a.s, t), curves.velocity(b.s, u)
        with np.errstate(all="ignore"):
            dt, du = _cross(w, gap) / _cross(v, w), _cross(v, gap) / _cross(v, w)
        finite = np.isfinite(dt) & np.isfinite(du)
        t = np.clip(t + np.where(finite, dt, 0.0), a.t0 - slack_a, a.t1 + slack_a)
        u = np.clip(u + np.where(finite, du, 0.0), b.t0 - slack_b, b.t1 + slack_b)
    done = np.abs(curves.point(a.s, t) - curves.point(b.s, u)) <= _EXACT * curves.extent
    for arc, slack, x in ((a, slack_a, t), (b, slack_b, u)):
        done &= (x >= arc.t0 - _PARALLEL * slack) & (x <= arc.t1 + _PARALLEL * slack)
    return np.clip(t, 0.0, 1.0), np.clip(u, 0.0, 1.0), done


def _meetings(curves: Curves, arcs: Arcs, pairs: Array) -> list[_Meetings]:
    """Where arcs of different segments touch, apart from what common nodes explain at once."""
    found: list[_Meetings] = []
    for begin in range(0, pairs.shape[1], _CHUNK):
        i, j = pairs[:, begin : begin + _CHUNK]
        found += _arcs_meet(curves, arcs.take(i), arcs.take(j))
    return found


def _arcs_meet(curves: Curves, a: Arcs, b: Arcs) -> list[_Meetings]:
    """The five cases of the module's text for pairs of arcs, halving them while they are undecided."""
    tolerance = curves.tolerance
    found: list[_Meetings] = []
    for _ in range(_HALVINGS):
        if not len(a.s):
            break
        p, q = curves.hull(*a), curves.hull(*b)
        keep = np.flatnonzero(~_apart(p, q, tolerance))
        a, b, p, q = a.take(keep), b.take(keep), p[:, keep], q[:, keep]
        v, w = _directions(p)[:, None], _directions(q)
        sine, cosine = _cross(v, w), _dot(v, w)
        least, most = cosine.min(axis=(0, 1)), cosine.max(axis=(0, 1))
        steep = (sine.min(axis=(0, 1)) > _PARALLEL) | (sine.max(axis=(0, 1)) < -_PARALLEL)

        settled = np.zeros(len(a.s), dtype=bool)
        for end_a in (0, 1):
            for end_b in (0, 1):
                at_node = (a[1 + end_a] == end_a) & (b[1 + end_b] == end_b)
                gap = np.abs(p[3 * end_a] - q[3 * end_b])
                opposite = most < 0.0 if end_a == end_b else least > 0.0
                settled |= at_node & (gap <= tolerance) & opposite
                settled |= at_node & (gap <= _EXACT * curves.extent) & steep

        k = np.flatnonzero(steep & ~settled)
        met = _met(curves, a.take(k), b.take(k), _chords_cross(p[:, k], q[:, k]), False)
        found.append(met[0])
        settled[k[met[1]]] = True

        bent_a, bent_b = _bend(p) > _STRAIGHT * tolerance, _bend(q) > _STRAIGHT * tolerance
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


def _chords_cross(p: Array, q: Array) -> Array:
    """(n,) where the chords cross, or the end of the first that is nearest to that."""
    v, w = p[3] - p[0], q[3] - q[0]
    area = _cross(v, w)
    return p[0] + np.clip(_cross(w, p[0] - q[0]) / np.where(area == 0.0, 1.0, area), 0.0, 1.0) * v


def _chords_near(p: Array, q: Array, tolerance: float) -> tuple[Array, Array]:
    """(n,) point of the first of two nearly parallel chords nearest to the other; is that a touch."""
    size, frame = np.abs(p[3] - p[0]), np.conj(_unit(p[3] - p[0]))
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
    touching = (apart <= (1.0 + 2.0 * _STRAIGHT) * tolerance) & (high >= low - tolerance) & (size > 0.0)
    return p[0] + x * np.conj(frame), touching


def _met(curves: Curves, a: Arcs, b: Arcs, place: Array, touch: bool) -> tuple[_Meetings, Array]:
    """Meetings near the given points of the chords, and which pairs have one.

    Where an arc is at a point of its chord the foot says, not the fraction: an arc as straight as can
    be may still begin at rest.
    touch : where there is no crossing, points within the tolerance count too
    """
    accuracy = _STRAIGHT * curves.tolerance
    near_t = _foot(curves, a.s, place, a.t0, a.t1, accuracy)
    p = curves.point(a.s, near_t)
    near_u = _foot(curves, b.s, p, b.t0, b.t1, accuracy)
    t, u, done = _newton(curves, a, b, near_t, near_u)
    keep = done
    if touch:
        keep = done | (np.abs(curves.point(b.s, near_u) - p) <= curves.tolerance)
        t, u = np.where(done, t, near_t), np.where(done, u, near_u)
    k = np.flatnonzero(keep)
    nothing = np.full(len(k), -1)
    return _ordered(a.s[k], t[k], b.s[k], u[k], done[k], nothing, np.zeros(len(k), dtype=bool)), k


def _nearest(curves: Curves, s: Array, p: Array, low: Array, high: Array) -> Array:
    """Distance of p to segment s between low and high."""
    t = low + (high - low) * _BETWEEN[:, None]
    best, each = np.abs(curves.point(s, t) - p).argmin(axis=0), np.arange(len(s))
    low, high = t[np.maximum(best - 1, 0), each], t[np.minimum(best + 1, len(t) - 1), each]
    return np.abs(curves.point(s, _foot(curves, s, p, low, high, _STRAIGHT * curves.tolerance)) - p)


def _together(
    curves: Curves, a: Array, t0: Array, t1: Array, b: Array, u0: Array, u1: Array
) -> tuple[Array, Array]:
    """Whether a on [t0, t1] and b on [u0, u1] stay within the tolerance; and the stretch's length."""
    tolerance = curves.tolerance
    length_a, length_b = np.abs(curves.length(a, t0, t1)), np.abs(curves.length(b, u0, u1))
    length = np.maximum(length_a, length_b)
    together = length <= 2.0 * tolerance
    alike = length <= _STRETCHED * np.minimum(length_a, length_b) + 2.0 * tolerance
    k = np.flatnonzero(alike & ~together)
    u_low, u_high = np.minimum(u0, u1), np.maximum(u0, u1)
    t_low, t_high = np.minimum(t0, t1), np.maximum(t0, t1)
    # the middle first: it rules out nearly all that part
    for share in sorted(_BETWEEN[1:-1], key=lambda x: abs(x - 0.5)):
        p = curves.point(a[k], t0[k] + share * (t1[k] - t0[k]))
        gap = _nearest(curves, b[k], p, u_low[k], u_high[k])
        p = curves.point(b[k], u0[k] + share * (u1[k] - u0[k]))
        gap = np.maximum(gap, _nearest(curves, a[k], p, t_low[k], t_high[k]))
        k = k[gap <= (1.0 + 2.0 * _STRAIGHT) * tolerance]
    together[k] = True
    return together, length


def _judge(
    curves: Curves, rows: list[_Meetings], nodes: _Nodes, label: Array, n_touch: int
) -> tuple[Array, Array, Array]:
    """Which T-junctions are overlaps, (n_touch,); crossings as (n, 2) segments and (n, 2) t."""
    n = curves.power.shape[1]
    row = _Meetings(*(np.concatenate(column) for column in zip(*rows)))
    overlap = np.zeros(n_touch, dtype=bool)
    own = row.a == row.b
    turned = own & (((row.t > 0.0) & (row.t < 1.0)) & ((row.u > 0.0) & (row.u < 1.0)))
    overlap[row.touch[turned]] = True
    row = _Meetings(*(column[~own] for column in row))

    # the nodes that two segments share, of all pairs that meet elsewhere too
    pair = np.unique(row.a * n + row.b)
    a, b = pair // max(n, 1), pair % max(n, 1)
    end = _end_labels(nodes, label, n).reshape(-1, 2)
    parts = [row]
    for end_a in (0, 1):
        for end_b in (0, 1):
            k = np.flatnonzero(end[a, end_a] == end[b, end_b])
            true, one = np.ones(len(k), dtype=bool), np.ones(len(k))
            parts.append(_Meetings(a[k], end_a * one, b[k], end_b * one, true, np.full(len(k), -1), true))
    row = _Meetings(*(np.concatenate(column) for column in zip(*parts)))
    pair = np.searchsorted(pair, row.a * n + row.b)

    # neighbouring arcs find a crossing at their common end twice
    order = np.lexsort((row.u, row.t, pair))
    twice = (np.diff(pair[order]) == 0) & (np.abs(np.diff(row.t[order])) < 1e-9)
    twice &= (np.abs(np.diff(row.u[order])) < 1e-9) & ~row.node[order][1:] & ~row.node[order][:-1]
    order = order[~np.append(False, twice)] if len(order) else order
    row, pair = _Meetings(*(column[order] for column in row)), pair[order]

    edges, lengths = [], []
    for order in (np.lexsort((row.u, row.t, pair)), np.lexsort((row.t, row.u, pair))):
        i, j = order[:-1], order[1:]
        i, j = i[pair[order[:-1]] == pair[order[1:]]], j[pair[order[:-1]] == pair[order[1:]]]
        held, length = _together(curves, row.a[i], row.t[i], row.t[j], row.b[i], row.u[i], row.u[j])
        edges.append(np.stack([i[held], j[held]]))
        lengths.append(length[held])
    edge, long = np.concatenate(edges, axis=1), np.concatenate(lengths) > _ONE_FOOT * curves.tolerance
    run = _components(len(row.a), edge)
    count = int(run.max()) + 1 if len(run) else 0

    with_nodes = np.bincount(run, weights=row.node, minlength=count)
    stretch = np.zeros(count, dtype=bool)
    stretch[run[edge[0, long]]] = True
    k = np.flatnonzero((row.touch >= 0) & (with_nodes[run] >= 2) & stretch[run])
    overlap[row.touch[k]] = True

    k = np.flatnonzero(with_nodes[run] == 0)
    t, u = _middle(curves, _Meetings(*(column[k] for column in row)), run[k])
    return overlap, t, u


def _middle(curves: Curves, row: _Meetings, run: Array) -> tuple[Array, Array]:
    """One crossing for each run of meetings: (n, 2) segments, (n, 2) parameters."""
    gap = np.abs(curves.point(row.a, row.t) - curves.point(row.b, row.u))
    order = np.lexsort((np.where(row.exact, row.t, gap), ~row.exact, run))
    row, run = _Meetings(*(column[order] for column in row)), run[order]
    first = np.flatnonzero(np.append(True, np.diff(run) != 0)) if len(run) else np.empty(0, dtype=np.int64)
    exact = np.add.reduceat(row.exact.astype(np.int64), first) if len(first) else first
    before = first + np.maximum(exact - 1, 0) // 2
    after = first + np.where(exact > 0, exact // 2, 0)
    a, b = row.a[first], row.b[first]
    t, u = 0.5 * (row.t[before] + row.t[after]), 0.5 * (row.u[before] + row.u[after])

    k = np.flatnonzero(exact % 2 == 0)
    ends = np.sort(np.stack([row.u[before[k]], row.u[after[k]]]), axis=0)
    u[k] = _foot(curves, b[k], curves.point(a[k], t[k]), ends[0], ends[1], _EXACT * curves.extent)
    t[k], u[k] = _closest(curves, a[k], t[k], b[k], u[k])
    return np.stack([a, b], axis=1), np.stack([t, u], axis=1)


def _closest(curves: Curves, a: Array, t: Array, b: Array, u: Array) -> tuple[Array, Array]:
    """The common normal (b(u) - a(t)) . a' = (b(u) - a(t)) . b' = 0 near a touch, by Newton's method."""
    start = t, u
    for _ in range(_NEWTON):
        gap = curves.point(b, u) - curves.point(a, t)
        v, w = curves.velocity(a, t), curves.velocity(b, u)
        # where the curves touch v and w are parallel: the sums below keep the matrix regular
        f, g = _dot(gap, v), _cross(v, w)
        f_t = _dot(gap, curves.acceleration(a, t)) - _dot(v, v)
        f_u = _dot(v, w)
        g_t, g_u = _cross(curves.acceleration(a, t), w), _cross(v, curves.acceleration(b, u))
        with np.errstate(all="ignore"):
            area = f_t * g_u - f_u * g_t
            dt, du = (f_u * g - g_u * f) / area, (g_t * f - f_t * g) / area
        finite = np.isfinite(dt) & np.isfinite(du)
        t, u = t + np.where(finite, dt, 0.0), u + np.where(finite, du, 0.0)
        t, u = np.clip(t, 0.0, 1.0), np.clip(u, 0.0, 1.0)
    near = np.abs(curves.point(b, u) - curves.point(a, t)) <= (1.0 + 2.0 * _STRAIGHT) * curves.tolerance
    near &= _together(curves, a, start[0], t, b, start[1], u)[0]
    return np.where(near, t, start[0]), np.where(near, u, start[1])


def _loops(curves: Curves) -> tuple[Array, Array]:
    """Cubics that meet themselves: (n, 2) the segment twice, (n, 2) the two parameters."""
    _, c, b, a = curves.power
    with np.errstate(all="ignore"):
        area = _cross(a, b)
        total = _cross(c, a) / area
        product = total * total - _cross(b, c) / area
        apart = np.sqrt(total * total - 4.0 * product)
    low, high = 0.5 * (total - apart), 0.5 * (total + apart)
    s = np.flatnonzero((low > 0.0) & (high < 1.0) & ~_collinear(curves)[0])
    s = s[curves.length(s, low[s], high[s]) > 2.0 * curves.tolerance]
    low, high = low[s], high[s]
    for _ in range(2):
        gap = curves.point(s, low) - curves.point(s, high)
        v, w = curves.velocity(s, low), curves.velocity(s, high)
        with np.errstate(all="ignore"):
            low, high = low + _cross(w, gap) / _cross(v, w), high + _cross(v, gap) / _cross(v, w)
    with np.errstate(all="ignore"):
        gap = np.abs(curves.point(s, low) - curves.point(s, high))
    k = np.flatnonzero((gap <= _EXACT * curves.extent) & (low > 0.0) & (high < 1.0))
    return np.stack([s[k], s[k]], axis=1), np.stack([low[k], high[k]], axis=1)


def _sweep(position: Array, radius: float) -> Array:
    """(n,) index of the item each one is merged with: the first of all, then the first beyond its radius...

    position : (n,) sorted.  One round for each item that stays in the most crowded neighbourhood.
    """
    n = len(position)
    fresh = np.append(True, np.diff(position) > radius)[:n]
    following = np.searchsorted(position, position + radius, side="right")
    stays, current = fresh.copy(), np.flatnonzero(fresh)
    while len(current):
        current = following[current]
        current = current[current < n]
        current = current[~stays[current]]
        stays[current] = True
    return np.maximum.accumulate(np.where(stays, np.arange(n), 0))


def _merge(curves: Curves, found: Contacts) -> Contacts:
    """One split where several lie within the tolerance on a segment; nodes come before crossings."""
    order = np.lexsort((found.t, found.segment))
    s, t, kind = found.segment[order], found.t[order], found.kind[order]
    group, node = found.group[order], found.node[order]
    step = np.abs(curves.length(s[1:], t[:-1], t[1:]))
    step[np.diff(s) != 0] = 3.0 * curves.tolerance
    position = np.append(0.0, np.cumsum(step))[: len(s)]

    nodes, others = np.flatnonzero(kind != CROSSING), np.flatnonzero(kind == CROSSING)
    into = np.arange(len(s))
    into[nodes] = nodes[_sweep(position[nodes], curves.tolerance)]
    fixed = np.flatnonzero((into == np.arange(len(s))) & (kind != CROSSING))
    if len(fixed):
        after = np.searchsorted(position[fixed], position[others])
        for nearby in (np.maximum(after - 1, 0), np.minimum(after, len(fixed) - 1)):
            close = np.abs(position[fixed[nearby]] - position[others]) <= curves.tolerance
            into[others[close]] = fixed[nearby[close]]
    others = others[into[others] == others]
    into[others] = others[_sweep(position[others], curves.tolerance)]

    kind = kind.copy()
    absorbed = np.flatnonzero((kind == OVERLAP) & (kind[into] != CROSSING))
    kind[into[absorbed]] = OVERLAP
    count = int(max(group.max(initial=-1), found.end.max(initial=-1))) + 1
    point = _components(count, np.stack([group, group[into]]))
    k = np.flatnonzero(into == np.arange(len(s)))
    return Contacts(s[k], t[k], kind[k], point[group[k]], node[k], point[found.end])


def _copy(found: Contacts, copied: Array, flipped: Array) -> Contacts:
    """Contacts of the chosen segments given to all segments; points numbered from 0."""
    n = int(copied.max(initial=-1)) + 1
    count = np.bincount(found.segment, minlength=n)
    segment, k = ranges((np.cumsum(count) - count)[copied], count[copied])
    t = np.where(flipped[segment], 1.0 - found.t[k], found.t[k])
    order = np.lexsort((t, segment))
    segment, t, k = segment[order], t[order], k[order]
    end = found.end.reshape(-1, 2)[copied]
    end = np.where(flipped[:, None], end[:, ::-1], end).ravel()
    _, point = np.unique(np.concatenate([found.group[k], end]), return_inverse=True)
    return Contacts(segment, t, found.kind[k], point[: len(k)], found.node[k], point[len(k) :])
