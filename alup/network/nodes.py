# SPDX-License-Identifier: GPL-2.0-or-later
"""Nodes of the segments, and where they lie on other segments: T-junctions.

Nodes within the tolerance of each other are one point, and so are chains of them.  A node whose foot on a
segment is within the tolerance of an end, along the curve, belongs to that end.  A cubic with collinear
control points may turn back on itself.  Its turning points count as nodes, so that the ways there and back
become pieces with common ends.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..geometry.boxes import ranges
from ..model import Array
from .curve_intersections import CommonPoints, ordered
from .monotone_arcs import EXACT, Arcs, Curves, collinear, cross, foot, turning, unit

# Feet of a node on a segment that are within this arc length of each other, in tolerances, are one foot.
# Points of a curve within the tolerance of the node are at most two tolerances apart; a bend may add as much
# again.
ONE_FOOT = 4.0


class Nodes(NamedTuple):
    """N distinct node positions and their M owners, which are sorted by position.

    z : (N,) complex positions
    place, s, t : (M,) of an owner the index into z, the segment and the parameter
    end : (M,) 2 s + end of a segment end, -1 at a turning point
    first, owners : (N,) the first owner of a position, and how many it has
    """

    z: Array
    place: Array
    s: Array
    t: Array
    end: Array
    first: Array
    owners: Array


def find_nodes(curves: Curves) -> Nodes:
    """The ends of segments and the turning points of collinear cubics; equal positions are one node."""
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
    return Nodes(z[chosen], place[order], s[order], t[order], end[order], np.cumsum(count) - count, count)


def end_labels(nodes: Nodes, label: Array, n: int) -> Array:
    """The label of each end of n segments, (2 n,); label : (N,) of the nodes."""
    ends = nodes.end >= 0
    result = np.empty(2 * n, dtype=np.int64)
    result[nodes.end[ends]] = label[nodes.place[ends]]
    return result


def t_junctions(curves: Curves, nodes: Nodes, arcs: Arcs, near: Array) -> tuple[Array, Array, Array, Array]:
    """Nodes on interiors: (n,) segment, parameter and node; and the pairs of nodes (2, m) that are one point.

    near : (2, k) arcs and nodes that may touch
    Feet of a node on neighbouring arcs of a segment are merged by arc length, and the nearest is kept.  If it
    is within the tolerance of an end, the node and that end are one point.
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
    new |= curves.length(s[:-1], t[:-1], t[1:]) > ONE_FOOT * tolerance
    run = np.cumsum(np.append(False, new))
    best = np.lexsort((gap, run))
    best = best[np.append(True, np.diff(run[best]) != 0)]
    s, t, node = s[best], t[best], node[best]

    inside = clear_of_ends(curves, s, t)
    label = end_labels(nodes, np.arange(len(nodes.z)), curves.power.shape[1])
    joined = np.stack([node[~inside], label[2 * s[~inside] + (t[~inside] > 0.5)]])
    return s[inside], t[inside], node[inside], joined


def clear_of_ends(curves: Curves, s: Array, t: Array) -> Array:
    """Whether points are farther than the tolerance from both ends along their segments, (n,) bool."""
    zero, one = np.zeros(len(t)), np.ones(len(t))
    return (curves.length(s, zero, t) > curves.tolerance) & (curves.length(s, t, one) > curves.tolerance)


def node_points(nodes: Nodes, s: Array, t: Array, node: Array) -> CommonPoints:
    """Each T-junction once for every segment that owns its node."""
    touch, owner = ranges(nodes.first[node], nodes.owners[node])
    true = np.ones(len(touch), dtype=bool)
    return ordered(s[touch], t[touch], nodes.s[owner], nodes.t[owner], true, touch, true)
