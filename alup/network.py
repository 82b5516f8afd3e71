"""Curves of the drawing -> one welded curve network.

SVG stores stacked shapes: a border between two regions is there twice, a corner of three regions
three times.  The energy is defined on a *network*, in which such a border is one curve with two
regions beside it.  Welding makes it so:

1. end points closer than the tolerance become one vertex;
2. segments shorter than the tolerance become a point of the network (their shape is carried along
   by their vertex);
3. segments with the same two vertices and the same geometry, in either direction, become one curve.

Each segment of the drawing then consists of *pieces*, each of which runs along one curve of the
network, forwards or backwards.  The drawing itself is not changed: results come back as
displacements, so what was welded keeps the little distance that it had.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from . import bezier
from .model import Array, Drawing

# Of the diagonal.  Files are written with three to six decimals, and closing segments of icons are
# rounding errors of up to 4e-5 of the diagonal; a distance that a designer meant is above 1e-3.
WELD_TOLERANCE = 5e-5

# A cubic counts as a straight line when its control points are this near to its chord: a sagitta
# below 1e-4 of the length can't be seen, and below 1e-5 of the diagonal it is rounding.
STRAIGHT_OF_CHORD = 1e-4
STRAIGHT_OF_DIAGONAL = 1e-5

# Where two curves between the same vertices are compared, in fractions of their arc length.
_PROBES = np.array([0.2, 0.4, 0.5, 0.6, 0.8])


@dataclass(frozen=True)
class Network:
    """A welded curve network and how the drawing's segments run along it.

    vertices : (n, 2) positions of the welded end points, user units
    curves : (C, 4, 2) control points of the distinct curves
    ends : (C, 2) int, the vertices of each curve's start and end
    straight : (C,) bool, lines and cubics that are lines
    segment : (P,) int, the segment of the drawing that each piece is part of, ascending
    span : (P, 2) the piece's range of that segment's parameter
    curve : (P,) int, the curve that the piece runs along; -1 for a piece that is one point
    backwards : (P,) bool
    piece_ends : (P, 2) int, vertices of the piece's own start and end
    """

    vertices: Array
    curves: Array
    ends: Array
    straight: Array
    segment: Array
    span: Array
    curve: Array
    backwards: Array
    piece_ends: Array


def build(drawing: Drawing, tolerance: float) -> Network:
    """Weld the drawing's segments into a network.  tolerance : user units."""
    control = drawing.control
    pieces = len(control)
    vertices, piece_ends = _weld_points(control, tolerance)
    collapsed = (piece_ends[:, 0] == piece_ends[:, 1]) & (bezier.polygon_lengths(control) <= 2.0 * tolerance)
    straight = drawing.line | bezier.straight(
        control, STRAIGHT_OF_CHORD, STRAIGHT_OF_DIAGONAL * drawing.diagonal
    )
    alive = np.flatnonzero(~collapsed)
    representative, backwards = _identical(control[alive], piece_ends[alive], straight[alive], tolerance)
    own, index = np.unique(representative, return_inverse=True)
    curve = np.full(pieces, -1)
    curve[alive] = index
    reverse = np.zeros(pieces, dtype=bool)
    reverse[alive] = backwards
    first = alive[own]
    return Network(
        vertices=vertices,
        curves=control[first],
        ends=piece_ends[first],
        straight=straight[first],
        segment=np.arange(pieces),
        span=np.tile([0.0, 1.0], (pieces, 1)),
        curve=curve,
        backwards=reverse,
        piece_ends=piece_ends,
    )


def _weld_points(control: Array, tolerance: float) -> tuple[Array, Array]:
    """Cluster end points.  Returns vertices (n, 2) and the vertex of each end (P, 2)."""
    ends = control[:, [0, 3]].reshape(-1, 2)
    pairs = cKDTree(ends).query_pairs(tolerance, output_type="ndarray")
    count = len(ends)
    graph = coo_matrix((np.ones(len(pairs), dtype=bool), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    n, label = connected_components(graph, directed=False)
    # Number the vertices in the order of the drawing, so that equal drawings give equal networks.
    _, first, label = np.unique(label, return_index=True, return_inverse=True)
    rank = np.empty(n, dtype=int)
    rank[np.argsort(first)] = np.arange(n)
    label = rank[label]
    size = np.bincount(label, minlength=n)
    vertices = np.stack([np.bincount(label, ends[:, d], minlength=n) for d in (0, 1)], axis=1) / size[:, None]
    return vertices, label.reshape(-1, 2)


def _identical(control: Array, ends: Array, straight: Array, tolerance: float) -> tuple[Array, Array]:
    """Which segments are the same curve.

    Returns, for each segment, the first segment with its geometry, and whether it runs the other
    way.  Segments are compared with the first one of their pair of vertices; those that differ
    are compared among themselves in the next round, so there are as many rounds as the most
    curves between two vertices.
    """
    count = len(control)
    representative = np.arange(count)
    backwards = np.zeros(count, dtype=bool)
    if not count:
        return representative, backwards
    low, high = ends.min(axis=1), ends.max(axis=1)
    _, group = np.unique(low * (int(high.max()) + 1) + high, return_inverse=True)
    group = group.ravel()
    probes = bezier.evaluate(control[:, None], parameters_at(control, np.tile(_PROBES, (count, 1))))
    limit = 3.0 * tolerance  # ends within one tolerance each, and a probe that slid along the curve
    open_ = np.arange(count)
    while len(open_):
        _, first, inverse = np.unique(group[open_], return_index=True, return_inverse=True)
        lead = open_[first][inverse.ravel()]
        a, b = probes[open_], probes[lead]
        both = straight[open_] & straight[lead] & (low[open_] != high[open_])
        same_way = np.abs(a - b).max(axis=(1, 2)) <= limit
        other_way = np.abs(a - b[:, ::-1]).max(axis=(1, 2)) <= limit
        same_way &= (ends[open_] == ends[lead]).all(axis=1)
        other_way &= (ends[open_] == ends[lead][:, ::-1]).all(axis=1) & ~same_way
        facing = (ends[open_] == ends[lead]).all(axis=1)
        same_way |= both & facing
        other_way |= both & ~facing
        found = same_way | other_way
        representative[open_[found]] = lead[found]
        backwards[open_[found]] = other_way[found]
        open_ = open_[~found]
    return representative, backwards


def parameters_at(control: Array, fraction: Array, intervals: int = 16) -> Array:
    """Parameters at fractions of the arc length.  control : (C, 4, 2), fraction : (C, k) -> (C, k)."""
    owner = np.repeat(np.arange(len(control)), fraction.shape[1])
    return parameters(control, owner, fraction.ravel(), np.full(len(control), intervals)).reshape(
        fraction.shape
    )


def parameters(control: Array, owner: Array, fraction: Array, intervals: Array) -> Array:
    """Parameters of points given by their fraction of the arc length.

    control : (C, 4, 2); owner : (M,) the curve of each point; fraction : (M,) in [0, 1];
    intervals : (C,) int, entries of the arc-length table.  Returns (M,); 0 and 1 stay 0 and 1.

    The table is inverted linearly and corrected by two Newton steps on the tabulated interval, in
    which the arc length is well approximated by the speed at both ends and the middle.
    """
    start, t, s = bezier.arc_length_table(control, intervals)
    total = s[start[1:] - 1]
    total = np.where(total > 0.0, total, 1.0)
    # One ascending array for all curves: the curve's number plus the fraction.
    table = s / total[np.repeat(np.arange(len(control)), intervals + 1)]
    ramp = table + np.repeat(2.0 * np.arange(len(control)), intervals + 1)
    slot = np.searchsorted(ramp, fraction + 2.0 * owner, side="right") - 1
    slot = np.clip(slot, start[owner], start[owner + 1] - 2)
    low, high = table[slot], table[slot + 1]
    width = high - low
    share = np.divide(fraction - low, width, out=np.zeros_like(fraction), where=width > 0.0)
    # Within the interval: solve s(u) = integral of the quadratic through three speeds.
    t0, dt = t[slot], t[slot + 1] - t[slot]
    own = control[owner]
    v0, v1, v2 = (np.linalg.norm(bezier.derivative(own, t0 + q * dt), axis=-1) for q in (0.0, 0.5, 1.0))
    b, c = -3.0 * v0 + 4.0 * v1 - v2, 2.0 * v0 - 4.0 * v1 + 2.0 * v2
    whole = v0 + b / 2.0 + c / 3.0
    u = share.copy()
    for _ in range(2):
        gone = u * (v0 + u * (b / 2.0 + u * c / 3.0)) - share * whole
        speed = v0 + u * (b + u * c)
        usable = speed > 0.05 * np.abs(whole)
        u = np.clip(u - np.divide(gone, speed, out=np.zeros_like(u), where=usable), 0.0, 1.0)
    result = t0 + u * dt
    return np.where(fraction <= 0.0, 0.0, np.where(fraction >= 1.0, 1.0, result))
