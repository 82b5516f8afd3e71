"""Connected components of a graph, by hooking and pointer jumping on whole arrays.

Every node points to one of its component with a smaller number.  A step hooks the root of each edge's end
onto the smallest root that an edge joins it to, then shortens all paths to their roots; a handful of steps
serve any graph.  scipy.sparse.csgraph has the same function; importing it, and scipy.linalg with it, takes
longer than the median drawing takes to solve.
"""

from __future__ import annotations

import numpy as np

from .model import Array


def components(edges: Array, count: int) -> tuple[int, Array]:
    """Components of `count` nodes joined by edges (E, 2) int.

    Returns their number and (count,) int labels from 0, in the order of each component's first node.
    """
    root = np.arange(count)
    a, b = np.asarray(edges, dtype=np.int64).reshape(-1, 2).T
    while True:
        low, high = np.minimum(root[a], root[b]), np.maximum(root[a], root[b])
        apart = low != high
        if not apart.any():
            break
        a, b = a[apart], b[apart]
        np.minimum.at(root, high[apart], low[apart])
        while True:
            shorter = root[root]
            if np.array_equal(shorter, root):
                break
            root = shorter
    first = root == np.arange(count)
    return int(first.sum()), (np.cumsum(first) - 1)[root]
