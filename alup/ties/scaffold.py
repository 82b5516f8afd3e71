# SPDX-License-Identifier: GPL-2.0-or-later
"""Edges that let separate components move in tandem (Sec. 3.5, Eq. 22).

The components of the curve network are joined by the sides of a Delaunay triangulation of all samples;
those between different components are the scaffold T.  The paper constrains the triangulation to contain
the network's edges, by Shewchuk's Triangle.  Samples are dense along the curves, so all but a few of them
are sides anyway, and the shape must not depend on which package is installed: scipy's serves everywhere.
The paper adds the corners of the bounding box; they are left out here, because their fans of triangles take
the place of edges between parts that stand side by side, down to a single pair, about which a part could
turn.
"""

from __future__ import annotations

import numpy as np

# Here and not where they are used: a library that is loaded when memory is short may wait for it for ever.
from scipy.spatial import Delaunay, QhullError, cKDTree

from ..geometry.arrays import Array
from ..geometry.connected_components import components

# Points nearer than this part of the drawing's diagonal are one point of the triangulation.
UNIQUE_OF_DIAGONAL = 1e-9


def between(points: Array, label: Array, found: Array) -> Array:
    """The scaffold (T, 2): the sides (m, 2) of samples (N, 2) that join different components, labels (N,)."""
    if not len(label) or label.max() == 0:
        return np.zeros((0, 2), dtype=int)
    return _connect(points, label, found[label[found[:, 0]] != label[found[:, 1]]])


def sides(points: Array) -> Array:
    """All sides (m, 2) of the Delaunay triangulation of samples (N, 2)."""
    low, high = points.min(axis=0), points.max(axis=0)
    scaled = (points - low) / max(float(np.hypot(*(high - low))), 1e-300)
    _, first, inverse = np.unique(
        np.round(scaled / UNIQUE_OF_DIAGONAL), axis=0, return_index=True, return_inverse=True
    )
    unique = scaled[first]
    along, flat = _on_one_line(unique)
    found = along if flat else _delaunay(unique)
    # A position can hold several samples (of overlapping components): every one of them is joined to the
    # first, so that none is left out.
    beside = np.stack([first[inverse.ravel()], np.arange(len(points))], axis=1)
    return np.concatenate([first[found], beside[beside[:, 0] != beside[:, 1]]])


def _on_one_line(points: Array) -> tuple[Array, bool]:
    """Edges between neighbours along the points' longest direction, and whether they have no other."""
    centred = points - points.mean(axis=0)
    _, spread, directions = np.linalg.svd(centred, full_matrices=False)
    order = np.argsort(centred @ directions[0], kind="stable")
    flat = len(points) < 3 or spread[1] <= UNIQUE_OF_DIAGONAL * spread[0]
    return np.stack([order[:-1], order[1:]], axis=1), bool(flat)


def _delaunay(points: Array) -> Array:
    """Edges of the Delaunay triangulation, (m, 2)."""
    try:
        simplices = Delaunay(points).simplices
    except (QhullError, ValueError):  # all but on one line
        return _on_one_line(points)[0]
    sides = np.concatenate([simplices[:, [0, 1]], simplices[:, [1, 2]], simplices[:, [2, 0]]])
    return np.unique(np.sort(sides, axis=1), axis=0)


def _connect(points: Array, label: Array, pairs: Array) -> Array:
    """Add the shortest link of every group of components that the pairs leave apart."""
    while True:
        number, group = components(np.concatenate([pairs, _spanning(label)]), len(points))
        if number == 1:
            return pairs
        mine = np.flatnonzero(group == 0)
        rest = np.flatnonzero(group != 0)
        distance, nearest = cKDTree(points[mine]).query(points[rest])
        best = int(np.argmin(distance))
        pairs = np.concatenate([pairs, [[mine[nearest[best]], rest[best]]]])


def _spanning(label: Array) -> Array:
    """Edges that join the samples of each component, whatever its shape."""
    order = np.argsort(label, kind="stable")
    same = label[order[1:]] == label[order[:-1]]
    return np.stack([order[:-1][same], order[1:][same]], axis=1)
