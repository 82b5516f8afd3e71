# SPDX-License-Identifier: GPL-2.0-or-later
"""Connected components of a graph, and the members of each label."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from .arrays import Array


def components(edges: Array, count: int) -> tuple[int, Array]:
    """Components of `count` nodes joined by edges (E, 2) int.

    Returns their number and (count,) int labels from 0, in the order of each component's first node.
    """
    a, b = np.asarray(edges, dtype=np.int64).reshape(-1, 2).T
    graph = csr_matrix((np.ones(len(a), dtype=np.int8), (a, b)), shape=(count, count))
    number, label = connected_components(graph, directed=False)
    return int(number), label.astype(np.int64)


def members(label: Array) -> list[Array]:
    """The numbers that have each label, labels ascending.  label : (n,) int.  Returns (k,) int for each."""
    order = np.argsort(label, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(label[order])) + 1) if len(label) else []
