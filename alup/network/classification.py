# SPDX-License-Identifier: GPL-2.0-or-later
"""Which points that two segments have in common are overlaps, and which are crossings.

Near a tangential touch, and wherever curves coincide, two segments have many points in common.  Those between
which the curves stay together form a *run* (`overlaps.py`).  A run without a node is one crossing.  A run
with a node is none, and a run with two nodes is an overlap.  So duplicates, curves that leave a node
tangentially, and lines that coincide to rounding have no crossings.
"""

from __future__ import annotations

import numpy as np

from ..geometry.connected_components import components
from ..model import Array
from .curve_intersections import CommonPoints
from .monotone_arcs import Curves
from .nodes import ONE_FOOT, Nodes, end_labels
from .overlaps import run_crossings, together

# Intersections of the same two segments that agree in both parameters to this much are one.  Newton's results
# agree to 1e-13, in the worst case to 1e-10.  The two of a nearly tangential touch form a run anyway.
_TWICE = 1e-9


def overlaps_and_crossings(
    curves: Curves, rows: list[CommonPoints], nodes: Nodes, label: Array, n_touch: int
) -> tuple[Array, Array, Array]:
    """Which T-junctions are overlaps, (n_touch,) bool, and the crossings: (n, 2) segments, (n, 2) parameters.

    rows : the common points found: T-junctions first, then intersections
    label : (N,) the point of the network that each node lies in; n_touch : number of T-junctions
    """
    n = curves.power.shape[1]
    row = CommonPoints(*(np.concatenate(column) for column in zip(*rows)))
    overlap = np.zeros(n_touch, dtype=bool)
    own = row.a == row.b
    turned = own & (((row.t > 0.0) & (row.t < 1.0)) & ((row.u > 0.0) & (row.u < 1.0)))
    overlap[row.touch[turned]] = True
    row = CommonPoints(*(column[~own] for column in row))

    # Segments that have other points in common may share nodes as well: these are common points, too.
    pair = np.unique(row.a * n + row.b)
    a, b = pair // max(n, 1), pair % max(n, 1)
    end = end_labels(nodes, label, n).reshape(-1, 2)
    parts = [row]
    for end_a in (0, 1):
        for end_b in (0, 1):
            k = np.flatnonzero(end[a, end_a] == end[b, end_b])
            true, one = np.ones(len(k), dtype=bool), np.ones(len(k))
            parts.append(CommonPoints(a[k], end_a * one, b[k], end_b * one, true, np.full(len(k), -1), true))
    row = CommonPoints(*(np.concatenate(column) for column in zip(*parts)))
    pair = np.searchsorted(pair, row.a * n + row.b)

    # A crossing at the common end of two neighbouring arcs is found twice.
    order = np.lexsort((row.u, row.t, pair))
    twice = (np.diff(pair[order]) == 0) & (np.abs(np.diff(row.t[order])) < _TWICE)
    twice &= (np.abs(np.diff(row.u[order])) < _TWICE) & ~row.node[order][1:] & ~row.node[order][:-1]
    order = order[~np.append(False, twice)] if len(order) else order
    row, pair = CommonPoints(*(column[order] for column in row)), pair[order]

    edges, lengths = [], []
    for order in (np.lexsort((row.u, row.t, pair)), np.lexsort((row.t, row.u, pair))):
        i, j = order[:-1], order[1:]
        i, j = i[pair[order[:-1]] == pair[order[1:]]], j[pair[order[:-1]] == pair[order[1:]]]
        held, length = together(curves, row.a[i], row.t[i], row.t[j], row.b[i], row.u[i], row.u[j])
        edges.append(np.stack([i[held], j[held]]))
        lengths.append(length[held])
    edge, long = np.concatenate(edges, axis=1), np.concatenate(lengths) > ONE_FOOT * curves.tolerance
    run = components(edge.T, len(row.a))[1]
    count = int(run.max()) + 1 if len(run) else 0

    with_nodes = np.bincount(run, weights=row.node, minlength=count)
    is_long = np.zeros(count, dtype=bool)
    is_long[run[edge[0, long]]] = True
    k = np.flatnonzero((row.touch >= 0) & (with_nodes[run] >= 2) & is_long[run])
    overlap[row.touch[k]] = True

    k = np.flatnonzero(with_nodes[run] == 0)
    pair_s, pair_t = run_crossings(curves, CommonPoints(*(column[k] for column in row)), run[k])
    far = np.ones(len(pair_s), dtype=bool)
    for end_a in (0, 1):
        for end_b in (0, 1):
            # A crossing this near to a common node is a bend of the curves at that node, and does not count.
            common = end[pair_s[:, 0], end_a] == end[pair_s[:, 1], end_b]
            for side, at in ((0, end_a), (1, end_b)):
                length = curves.length(pair_s[:, side], pair_t[:, side], np.full(len(pair_t), float(at)))
                common &= np.abs(length) <= ONE_FOOT * curves.tolerance
            far &= ~common
    return overlap, pair_s[far], pair_t[far]
