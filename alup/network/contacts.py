# SPDX-License-Identifier: GPL-2.0-or-later
"""Where the curves of a drawing touch: the split parameters that make it a network.

Problem.  A drawing is S cubics B_s(t), t in [0, 1], each with two *nodes* B_s(0), B_s(1).  Two
curves *touch* where they are no further apart than `tolerance`.  Wanted are parameters to split
at, so that afterwards curves touch at ends of pieces only, or along whole pieces:

* T-junction: a node of one segment lies on the interior of another, or of its own;
* overlap: a T-junction from which the two curves run on together, to another common node;
* crossing: two interiors meet in one point, transversally or tangentially, or a cubic meets itself.

Method.  Segments that are the same cubic are analysed once (`copies`).  Boxes around monotone arcs tell which
arcs and nodes may touch (`monotone_arcs`, `boxes`).  Nodes are gathered, and their feet on arcs are
T-junctions (`nodes`).  Arcs are intersected (`curve_intersections`).  Common points of two segments between
which the curves stay together (`overlaps`) count as one overlap or one crossing (`classification`).  Splits
that are nearer to each other than the tolerance are merged (`splits`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Callable

import numpy as np

from ..geometry.boxes import overlapping
from ..geometry.connected_components import components
from ..model import Array
from .classification import overlaps_and_crossings
from .copies import find_copies, for_copies
from .curve_intersections import intersections, loops
from .monotone_arcs import Arcs, Curves, arcs_of, curves_of
from .nodes import Nodes, clear_of_ends, end_labels, find_nodes, node_points, t_junctions
from .splits import CROSSING, OVERLAP, T_JUNCTION, Contacts, merged


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
    stop : is called during the search for crossings with the number found since its last call; if it returns
        true, the search ends and crossings are left out
    """
    curves = curves_of(control, line, tolerance)
    original, flipped = find_copies(control, curves.extent)
    chosen, copied = np.unique(original, return_inverse=True)
    curves = curves._replace(power=curves.power[:, chosen])

    nodes = find_nodes(curves)
    arcs, pairs, near, welds = _candidates(curves, nodes)
    touch_s, touch_t, touch_node, joined = t_junctions(curves, nodes, arcs, near)
    label = components(np.concatenate([welds, joined], axis=1).T, len(nodes.z))[1]

    rows = [node_points(nodes, touch_s, touch_t, touch_node)]
    complete = True
    if crossings:
        met = intersections(curves, arcs, pairs, stop)
        rows += met or []
        complete = met is not None
        crossings = complete
    overlap, pair_s, pair_t = overlaps_and_crossings(curves, rows, nodes, label, len(touch_s))
    if crossings:
        loop_s, loop_t = loops(curves)
        pair_s, pair_t = np.concatenate([pair_s, loop_s]), np.concatenate([pair_t, loop_t])
    inside = clear_of_ends(curves, pair_s.ravel(), pair_t.ravel()).reshape(-1, 2).all(axis=1)
    pair_s, pair_t = pair_s[inside].ravel(), pair_t[inside].ravel()

    no_node = np.full(len(pair_s), -1)
    owner = nodes.end[nodes.first[touch_node]]
    found = Contacts(
        np.concatenate([touch_s, pair_s]),
        np.concatenate([touch_t, pair_t]),
        np.concatenate([np.where(overlap, OVERLAP, T_JUNCTION), np.full(len(pair_s), CROSSING)]),
        np.concatenate([label[touch_node], len(nodes.z) + np.arange(len(pair_s)) // 2]),
        np.concatenate([np.where(owner >= 0, 2 * chosen[owner // 2] + owner % 2, -1), no_node]),
        end_labels(nodes, label, len(chosen)),
    )
    return replace(for_copies(merged(curves, found), copied, flipped), complete=complete)


def _candidates(curves: Curves, nodes: Nodes) -> tuple[Arcs, Array, Array, Array]:
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
