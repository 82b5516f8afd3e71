# SPDX-License-Identifier: GPL-2.0-or-later
"""Split parameters of segments: the record of them, the merging of near ones, and the cut itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.arrays import Floats, Ints
from ..geometry.connected_components import components
from ..model import Array
from .monotone_arcs import Curves

# Kinds of contacts.
T_JUNCTION = 0
OVERLAP = 1
CROSSING = 2


@dataclass(frozen=True)
class Contacts:
    """K splits of S segments, and which ends of the pieces are one point.

    segment : (K,) int, sorted; t : (K,) float in (0, 1), increasing within a segment
    kind : (K,) int, T_JUNCTION, OVERLAP or CROSSING
    group : (K,) int, the point of the network that the split lies in
    node : (K,) int, 2 * segment + end of a segment end that lies in this point; -1 at a crossing
        and where a cubic turns back on itself
    end : (2 S,) int, the point that each segment end lies in, numbered together with `group`
    complete : False if the search for crossings was ended early; then there are none
    """

    segment: Ints
    t: Floats
    kind: Ints
    group: Ints
    node: Ints
    end: Ints
    complete: bool = True


def merged(curves: Curves, found: Contacts) -> Contacts:
    """The contacts with splits that are within the tolerance on a segment merged; nodes absorb crossings."""
    order = np.lexsort((found.t, found.segment))
    s, t, kind = found.segment[order], found.t[order], found.kind[order]
    group, node = found.group[order], found.node[order]
    step = np.abs(curves.length(s[1:], t[:-1], t[1:]))
    step[np.diff(s) != 0] = 3.0 * curves.tolerance  # beyond the tolerance of the segment before
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


def _sweep(position: Array, radius: float) -> Array:
    """The index of the item that each item is merged into, (n,); position : (n,) sorted.

    The first item absorbs all within the radius, the first one beyond it does the same, and so on.  Chains of
    near items are processed in parallel, so the loop runs as often as the longest chain keeps items.
    """
    n = len(position)
    fresh = np.append(True, np.diff(position) > radius)[:n]
    following = np.searchsorted(position, position + radius, side="right")
    kept, current = fresh.copy(), np.flatnonzero(fresh)
    while len(current):
        current = following[current]
        current = current[current < n]
        current = current[~kept[current]]
        kept[current] = True
    return np.maximum.accumulate(np.where(kept, np.arange(n), 0))


def split(control: Array, line: Array, found: Contacts) -> tuple[Array, Array, Array]:
    """The P pieces of the segments: (P, 4, 2) control points, (P,) source segment, (P, 2) its range of t.

    control : (S, 4, 2); line : (S,) bool
    The control points of a piece on [t0, t1] are the values of the cubic's polar form, b(t0, t0, t0),
    b(t0, t0, t1), b(t0, t1, t1), b(t1, t1, t1), computed by de Casteljau's steps with three different
    parameters.  Neighbouring pieces share their ends, and outer ends are the segment's own, to the last bit.
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
