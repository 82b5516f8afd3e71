# SPDX-License-Identifier: GPL-2.0-or-later
"""Where the curves of a drawing touch: the split parameters that make it a network.

Problem.  A drawing is S cubics B_s(t), t in [0, 1], each with two *nodes* B_s(0), B_s(1).  Two
curves *touch* where they are no further apart than `tolerance`.  Wanted are parameters to split
at, so that afterwards curves touch at ends of pieces only, or along whole pieces:

* T-junction: a node of one segment lies on the interior of another, or of its own;
* overlap: a T-junction from which the two curves run on together, to another common node;
* crossing: two interiors meet in one point, transversally or tangentially, or a cubic meets itself.

`monotone_arcs`, `boxes` and `curve_intersections` find the nodes near arcs, the feet of those nodes, and
where arcs meet; this module says what of it counts.

Nodes (`_touches`).  Nodes within the tolerance of each other are one point, and so are chains of
them.  A node with its foot on a segment within the tolerance of an end (along the curve) belongs to
that end.  A cubic whose control points are collinear may turn back on itself (`_nodes`); its turning
points count as nodes, so that the stretches there and back become pieces with common ends.

Stretches (`_judge`).  Near a tangential touch, and wherever curves coincide, many points of the
same two segments meet; those between which the curves stay together make a run (`overlaps`).  A run
that contains a node is what the node makes of it: no crossing, and an overlap if it contains two.  A run
without a node is one crossing.  So duplicates, curves that leave a node tangentially, and lines that
coincide but for rounding have no crossings.

Copies (`_copies`).  Segments that are the same cubic to rounding, in either direction (a fill and
its stroke), are looked at once; the splits are then copied, so that n copies cost n, not n^2.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Callable, NamedTuple

import numpy as np

from ..geometry.arrays import Floats, Ints
from ..geometry.boxes import overlapping, ranges
from ..geometry.connected_components import components
from ..model import Array
from .curve_intersections import Meetings, loops, meetings, ordered
from .monotone_arcs import EXACT, Arcs, Curves, arcs_of, collinear, cross, curves_of, foot, turning, unit
from .overlaps import middle, together

T_JUNCTION = 0
OVERLAP = 1
CROSSING = 2

# Feet of one node within this arc length, in tolerances, are one foot: points of a curve that are
# within the tolerance of the node are at most two apart, and a bend may add as much again.
_ONE_FOOT = 4.0

# Odd numbers at random, by which control points are hashed; numpy.random takes 15 ms to import.
_HASH = np.array(
    [
        [2360360630558964033, 4383240139369130521],
        [664818870401041973, 4374873391751699445],
        [1438068747342666923, 1952248665957342227],
        [3817104479337814857, 1887097935946223283],
    ],
    dtype=np.int64,
)

# Two meetings of the same segments this close in both parameters are one.  Newton agrees to 1e-13,
# to 1e-10 where it is at its worst; the two of a nearly tangential touch merge as a run anyway.
_TWICE = 1e-9


@dataclass(frozen=True)
class Contacts:
    """Where to split, and which ends of the pieces are one point.  K splits, S segments.

    segment : (K,) int, sorted; t : (K,) float in (0, 1), increasing within a segment
    kind : (K,) int, T_JUNCTION, OVERLAP or CROSSING
    group : (K,) int, the point of the network that the split lies in
    node : (K,) int, 2 * segment + end of a segment end that lies in this point; -1 at a crossing
        and where a cubic turns back on itself
    end : (2 S,) int, the point that each segment end lies in, numbered together with `group`
    complete : whether the search for crossings came to its end; else there are none
    """

    segment: Ints
    t: Floats
    kind: Ints
    group: Ints
    node: Ints
    end: Ints
    complete: bool = True


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


def contacts(
    control: Array,
    line: Array,
    tolerance: float,
    *,
    crossings: bool = True,
    stop: Callable[[int], bool] | None = None,
) -> Contacts:
    """Find where the segments have to be split.

    control : (S, 4, 2) finite control points; line : (S,) bool, straight at constant speed
    tolerance : > 0, user units; crossings : also where interiors meet, not only nodes
    stop : asked now and then during the search for them, with how many were found since it was asked last;
        where it says so, the search ends and they are left out
    """
    curves = curves_of(control, line, tolerance)
    original, flipped = _copies(control, curves.extent)
    chosen, copied = np.unique(original, return_inverse=True)
    curves = curves._replace(power=curves.power[:, chosen])

    nodes = _nodes(curves)
    arcs, pairs, near, welds = _candidates(curves, nodes)
    touch_s, touch_t, touch_node, joined = _touches(curves, nodes, arcs, near)
    label = components(np.concatenate([welds, joined], axis=1).T, len(nodes.z))[1]

    rows = [_node_rows(nodes, touch_s, touch_t, touch_node)]
    complete = True
    if crossings:
        met = meetings(curves, arcs, pairs, stop)
        rows += met or []
        complete = met is not None
        crossings = complete
    overlap, pair_s, pair_t = _judge(curves, rows, nodes, label, len(touch_s))
    if crossings:
        loop_s, loop_t = loops(curves)
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
    return replace(_copy(_merge(curves, found), copied, flipped), complete=complete)


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


def _copies(control: Array, extent: float) -> tuple[Array, Array]:
    """The first segment that is the same cubic, (S,), and whether it runs the other way, (S,) bool.

    Rounded control points are hashed, first to last and last to first; the lesser hash counts.
    A collision would only hide a copy, for the points themselves are compared.
    """
    n = len(control)
    if not n:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=bool)
    middle = 0.5 * (control.min(axis=(0, 1)) + control.max(axis=(0, 1)))
    rounded = np.rint((control - middle) / max(EXACT * extent, np.finfo(float).tiny)).astype(np.int64)
    ahead = (rounded * _HASH).sum(axis=(1, 2))
    back = (rounded[:, ::-1] * _HASH).sum(axis=(1, 2))
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

    flat, axis = collinear(curves)
    along = (curves.power[:, flat] * np.conj(axis[flat])).real
    turn = turning(along[1], 2.0 * along[2], 3.0 * along[3])
    which, root = np.nonzero(~np.isnan(turn))
    s = np.concatenate([s, np.flatnonzero(flat)[which]])
    t = np.concatenate([t, turn[which, root]])
    end = np.concatenate([end, np.full(len(which), -1)])

    z = curves.point(s, t)
    rounded = np.rint(z / max(EXACT * curves.extent, np.finfo(float).tiny))
    _, chosen, place = np.unique(rounded, return_index=True, return_inverse=True)
    order = np.lexsort((end < 0, place))
    count = np.bincount(place, minlength=len(chosen))
    return _Nodes(z[chosen], place[order], s[order], t[order], end[order], np.cumsum(count) - count, count)


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
    corner = [
        np.concatenate([c, nodes.z])
        for c in (
            hull.real.min(axis=0) + 1j * hull.imag.min(axis=0),
            hull.real.max(axis=0) + 1j * hull.imag.max(axis=0),
        )
    ]
    low, high = (np.stack([c.real, c.imag], axis=1) for c in corner)
    i, j = overlapping(low - grown, high + grown, size)
    i, j = np.minimum(i, j), np.maximum(i, j)
    pairs = np.stack([i, j])[:, j < n]
    near = np.stack([i, j - n])[:, (i < n) & (j >= n)]
    welds = np.stack([i - n, j - n])[:, i >= n]
    welds = welds[:, np.abs(nodes.z[welds[0]] - nodes.z[welds[1]]) <= curves.tolerance]

    return arcs, pairs, near, welds


def _touches(curves: Curves, nodes: _Nodes, arcs: Arcs, near: Array) -> tuple[Array, Array, Array, Array]:
    """Nodes on interiors: (n,) segment, (n,) t, (n,) node, and (2, m) nodes that are one instead.

    The feet of a node on neighbouring arcs of a segment are gathered by arc length.  Where the best
    of them is within the tolerance of an end of the segment, the node and that end are one.
    """
    arc, node = near
    p, tolerance = nodes.z[node], curves.tolerance
    hull = curves.hull(*arcs)
    axis = unit(hull[3] - hull[0])
    offset = cross(axis, hull - hull[0])
    height = cross(axis[arc], p - hull[0, arc])
    keep = (height <= offset.max(axis=0)[arc] + tolerance) & (height >= offset.min(axis=0)[arc] - tolerance)
    arc, node, p = arc[keep], node[keep], p[keep]

    s = arcs.s[arc]
    t = foot(curves, s, p, arcs.t0[arc], arcs.t1[arc], EXACT * curves.extent)
    gap = np.abs(curves.point(s, t) - p)
    order = np.flatnonzero(gap <= tolerance)
    order = order[np.lexsort((t[order], s[order], node[order]))]
    s, t, node, gap = s[order], t[order], node[order], gap[order]
    if not len(s):
        return s, t, node, np.empty((2, 0), dtype=np.int64)
    new = (np.diff(s) != 0) | (np.diff(node) != 0)
    new |= curves.length(s[:-1], t[:-1], t[1:]) > _ONE_FOOT * tolerance
    run = np.cumsum(np.append(False, new))
    best = np.lexsort((gap, run))
    best = best[np.append(True, np.diff(run[best]) != 0)]
    s, t, node = s[best], t[best], node[best]

    inside = _inside(curves, s, t)
    label = _end_labels(nodes, np.arange(len(nodes.z)), curves.power.shape[1])
    joined = np.stack([node[~inside], label[2 * s[~inside] + (t[~inside] > 0.5)]])
    return s[inside], t[inside], node[inside], joined


def _inside(curves: Curves, s: Array, t: Array) -> Array:
    """(n,) bool: further than the tolerance from both ends of the segment, along it."""
    zero, one = np.zeros(len(t)), np.ones(len(t))
    return (curves.length(s, zero, t) > curves.tolerance) & (curves.length(s, t, one) > curves.tolerance)


def _node_rows(nodes: _Nodes, s: Array, t: Array, node: Array) -> Meetings:
    """Each T-junction once for every owner of its node."""
    touch, owner = ranges(nodes.first[node], nodes.owners[node])
    true = np.ones(len(touch), dtype=bool)
    return ordered(s[touch], t[touch], nodes.s[owner], nodes.t[owner], true, touch, true)


def _judge(
    curves: Curves, rows: list[Meetings], nodes: _Nodes, label: Array, n_touch: int
) -> tuple[Array, Array, Array]:
    """Which T-junctions are overlaps, (n_touch,); crossings as (n, 2) segments and (n, 2) t."""
    n = curves.power.shape[1]
    row = Meetings(*(np.concatenate(column) for column in zip(*rows)))
    overlap = np.zeros(n_touch, dtype=bool)
    own = row.a == row.b
    turned = own & (((row.t > 0.0) & (row.t < 1.0)) & ((row.u > 0.0) & (row.u < 1.0)))
    overlap[row.touch[turned]] = True
    row = Meetings(*(column[~own] for column in row))

    # the nodes that two segments share, of all pairs that meet elsewhere too
    pair = np.unique(row.a * n + row.b)
    a, b = pair // max(n, 1), pair % max(n, 1)
    end = _end_labels(nodes, label, n).reshape(-1, 2)
    parts = [row]
    for end_a in (0, 1):
        for end_b in (0, 1):
            k = np.flatnonzero(end[a, end_a] == end[b, end_b])
            true, one = np.ones(len(k), dtype=bool), np.ones(len(k))
            parts.append(Meetings(a[k], end_a * one, b[k], end_b * one, true, np.full(len(k), -1), true))
    row = Meetings(*(np.concatenate(column) for column in zip(*parts)))
    pair = np.searchsorted(pair, row.a * n + row.b)

    # neighbouring arcs find a crossing at their common end twice
    order = np.lexsort((row.u, row.t, pair))
    twice = (np.diff(pair[order]) == 0) & (np.abs(np.diff(row.t[order])) < _TWICE)
    twice &= (np.abs(np.diff(row.u[order])) < _TWICE) & ~row.node[order][1:] & ~row.node[order][:-1]
    order = order[~np.append(False, twice)] if len(order) else order
    row, pair = Meetings(*(column[order] for column in row)), pair[order]

    edges, lengths = [], []
    for order in (np.lexsort((row.u, row.t, pair)), np.lexsort((row.t, row.u, pair))):
        i, j = order[:-1], order[1:]
        i, j = i[pair[order[:-1]] == pair[order[1:]]], j[pair[order[:-1]] == pair[order[1:]]]
        held, length = together(curves, row.a[i], row.t[i], row.t[j], row.b[i], row.u[i], row.u[j])
        edges.append(np.stack([i[held], j[held]]))
        lengths.append(length[held])
    edge, long = np.concatenate(edges, axis=1), np.concatenate(lengths) > _ONE_FOOT * curves.tolerance
    run = components(edge.T, len(row.a))[1]
    count = int(run.max()) + 1 if len(run) else 0

    with_nodes = np.bincount(run, weights=row.node, minlength=count)
    stretch = np.zeros(count, dtype=bool)
    stretch[run[edge[0, long]]] = True
    k = np.flatnonzero((row.touch >= 0) & (with_nodes[run] >= 2) & stretch[run])
    overlap[row.touch[k]] = True

    k = np.flatnonzero(with_nodes[run] == 0)
    pair_s, pair_t = middle(curves, Meetings(*(column[k] for column in row)), run[k])
    far = np.ones(len(pair_s), dtype=bool)
    for end_a in (0, 1):
        for end_b in (0, 1):
            # in reach of a common node it is a hook of that node, not a crossing
            common = end[pair_s[:, 0], end_a] == end[pair_s[:, 1], end_b]
            for side, at in ((0, end_a), (1, end_b)):
                way = curves.length(pair_s[:, side], pair_t[:, side], np.full(len(pair_t), float(at)))
                common &= np.abs(way) <= _ONE_FOOT * curves.tolerance
            far &= ~common
    return overlap, pair_s[far], pair_t[far]


def _sweep(position: Array, radius: float) -> Array:
    """(n,) index of the item that each is merged into, (n,) position being sorted.

    The first item takes in those within its radius, the next one beyond it does the same, and so on;
    all chains of items at a time, so there are as many rounds as items stay in the longest chain.
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
    step[np.diff(s) != 0] = 3.0 * curves.tolerance  # out of reach of the segment before
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
    point = components(np.stack([group, group[into]], axis=1), count)[1]
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
