# SPDX-License-Identifier: GPL-2.0-or-later
"""Edges between points of the plane: their vectors, and which of them cross each other.

A uniform grid finds the pairs of edges whose bounding boxes overlap.  Two edges cross if the ends of each lie
strictly on different sides of the other.  Edges that share a sample do not cross.
"""

from __future__ import annotations

import numpy as np

from .arrays import Array
from .boxes import overlapping


def edge_vectors(v: Array, edges: Array) -> Array:
    """v_j - v_i of every edge <i,j>.  (E, 2)."""
    return v[edges[:, 1]] - v[edges[:, 0]]


def cross(a: Array, b: Array) -> Array:
    """The signed areas (...) that vectors (..., 2) span."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def crossing_edges(points: Array, edges: Array) -> Array:
    """Pairs of crossing edges, encoded as a * E + b with a < b, in ascending order.

    points : (N, 2); edges : (E, 2) int.  Returns (m,) int.
    """
    ends = points[edges]
    low, high = ends.min(axis=1), ends.max(axis=1)
    size = high - low
    cell = float(np.maximum(np.median(size.max(axis=1)) * 2.0, size.max() / 1000.0)) or 1.0
    a, b = overlapping(low, high, cell)
    a, b = np.minimum(a, b), np.maximum(a, b)
    apart = (edges[a][:, :, None] != edges[b][:, None, :]).all(axis=(1, 2))
    a, b = a[apart], b[apart]
    cross = (_sides(ends[a], ends[b]) < 0.0) & (_sides(ends[b], ends[a]) < 0.0)
    return np.unique(a[cross].astype(np.int64) * len(edges) + b[cross])


def _sides(line: Array, other: Array) -> Array:
    """Product (m,) of the signed areas that `line` spans with the two ends of `other`; (m, 2, 2) each.

    It is negative where the ends lie strictly on different sides.
    """
    direction = line[:, 1] - line[:, 0]
    offset = other - line[:, :1]
    side = cross(direction[:, None], offset)
    return side[:, 0] * side[:, 1]
