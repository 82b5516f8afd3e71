# SPDX-License-Identifier: GPL-2.0-or-later
"""Which of many boxes overlap: a sweep within the cells of a uniform grid.

A box has an entry in every cell that it covers.  The entries are sorted by (cell, left edge).  An entry is
paired with the later entries of its cell whose left edge is not beyond its right edge.  This sweep matters
where a cell has many boxes far smaller than it.  A pair is found in every cell that both boxes cover.  It is
reported only in the cell of the lower left corner of their intersection, so there are no duplicates to
remove.
"""

from __future__ import annotations

import numpy as np

from .arrays import Array

# The greatest number of cells along an axis.  Cell keys then fit into 63 bits.  The sort key is a cell's
# number plus a fraction in a double of 53 bits.  2^40 cells would leave 2^-12 for the fraction, so occupied
# cells are renumbered.
_MOST_CELLS = 1 << 20

# The greatest mean number of cells that a box may cover; else the cells are enlarged.
_MOST_ENTRIES = 16

# Pairs that are tested together; this bounds the memory for a crowded cell to some 100 MB.
_CHUNK = 1 << 21


def ranges(first: Array, count: Array) -> tuple[Array, Array]:
    """Concatenated integer ranges: (owner, value), the values of each owner counting up from first[owner].

    first, count : (n,) int
    """
    owner = np.repeat(np.arange(len(count)), count)
    start = np.cumsum(count) - count
    return owner, np.arange(len(owner)) - np.repeat(start - first, count)


def overlapping(low: Array, high: Array, cell: float) -> tuple[Array, Array]:
    """All pairs i, j of closed boxes that overlap, each once, in no particular order.

    low, high : (n, 2) float, opposite corners; cell : wished edge of a cell, about the size of a box
    Returns int arrays (m,), (m,).
    """
    empty = np.empty(0, dtype=np.int64)
    if len(low) < 2:
        return empty, empty
    origin = low.min(axis=0)
    extent = float((high.max(axis=0) - origin).max())
    if not extent > 0.0:
        return np.triu_indices(len(low), 1)
    cell = max(cell, extent / _MOST_CELLS)
    while True:
        first = np.floor((low - origin) / cell).astype(np.int64)
        last = np.floor((high - origin) / cell).astype(np.int64)
        count = last - first + 1
        # One box as long as the drawing among a thousand small ones would cover a million cells.
        if int((count[:, 0] * count[:, 1]).sum()) <= _MOST_ENTRIES * len(low):
            break
        cell *= 2.0
    box, step = ranges(np.zeros(len(low), dtype=np.int64), count[:, 0] * count[:, 1])
    column = first[box, 0] + step // count[box, 1]
    row = first[box, 1] + step % count[box, 1]
    _, place = np.unique(column * (2 * _MOST_CELLS) + row, return_inverse=True)

    left = (low[:, 0] - origin[0]) / (2.0 * extent)
    right = (high[:, 0] - origin[0]) / (2.0 * extent)
    key = place + left[box]
    order = np.argsort(key, kind="stable")
    box, column, row, place, key = box[order], column[order], row[order], place[order], key[order]
    # The margin covers the rounding of `place + fraction`.  The exact test below removes surplus pairs.
    end = np.searchsorted(key, place + right[box] + 1e-9, side="right")
    partners = end - np.arange(len(box)) - 1

    found: list[tuple[Array, Array]] = [(empty, empty)]
    total = np.cumsum(partners)
    cuts = np.append(np.searchsorted(total, np.arange(0, int(total[-1]), _CHUNK)), len(box))
    for begin, stop in zip(cuts[:-1], cuts[1:]):
        entry, other = ranges(np.arange(begin, stop) + 1, partners[begin:stop])
        entry = entry + begin
        i, j = box[entry], box[other]
        meet = (low[i, 1] <= high[j, 1]) & (low[j, 1] <= high[i, 1])
        entry, other, i, j = entry[meet], other[meet], i[meet], j[meet]
        meet = (
            (low[i, 0] <= high[j, 0])
            & (low[j, 0] <= high[i, 0])
            & (place[entry] == place[other])
            & (column[entry] == np.maximum(first[i, 0], first[j, 0]))
            & (row[entry] == np.maximum(first[i, 1], first[j, 1]))
        )
        found.append((i[meet], j[meet]))
    return np.concatenate([i for i, _ in found]), np.concatenate([j for _, j in found])
