# SPDX-License-Identifier: GPL-2.0-or-later
"""Nested dissection: an order of elimination for points of the plane, and what a factor in it costs.

Problem.  The graph of a sparse symmetric matrix, its vertices the points of a drawing, its edges the pairs
that an entry couples.  Wanted are an order of elimination whose factor has few entries, and, before anything
is factorised, a bound for the work.

Method (George 1973, with coordinates).  The points of a *cell* are halved across the side that cuts fewer
pairs.  Those of one half with a neighbour in the other are the cell's *separator*, which is eliminated after
both halves; these are cells in turn, down to `LEAF` points.  What is coupled is near in a drawing, so a line
across N evenly scattered points meets about sqrt(N) of them: the factor has about N log N entries and takes
N^1.5 operations.

Cost.  A cell's own points and its *border*, the later points that they are coupled with when their turn
comes, make a dense front.  The border is what the own points couple, and what is left of the halves' borders.

qdldl's own order, minimum degree, is better where few curves run side by side, which is nearly everywhere.
Where very many cross it can miss every bound: on 80 by 80 lines it took two hundred times as long.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .geometry.arrays import Array

# Cells of no more points are not halved: their order matters little.
LEAF = 16

# Cells are halved so often at most; 2^40 leaves are more than there are points.
_DEEPEST = 40

# A network with more samples at which curves meet is dissected.  At 1,000 minimum degree begins to lose.
JUNCTIONS = 1_000

# Fewer points are factorised in a tenth of a second, so that nothing need be known before.
FEW = 10_000

# Multiplications a second, for the estimate.  Measured: 0.7e9 to 6e9 in both orders, but where qdldl's fails.
RATE = 1e9


@dataclass(frozen=True)
class Dissection:
    """order : (N,) the points as they are eliminated; own, border : (C,) points of each cell's front"""

    order: Array
    own: Array
    border: Array

    @property
    def entries(self) -> float:
        """At most so many entries of the factor's lower triangle, one for each pair of points."""
        return float((self.own * (0.5 * (self.own + 1.0) + self.border)).sum())

    @property
    def work(self) -> float:
        """About so many multiplications for the factor, one for each three points."""
        s, b = self.own.astype(float), self.border
        return float((s * (s * s / 6.0 + 0.5 * s * b + 0.5 * b * b)).sum())


@dataclass(frozen=True)
class Plan:
    """How a matrix of points' 2x2 blocks is factorised.

    order : (2 N,) of its unknowns, None for qdldl's own; seconds : about what a factorisation takes, 0 for
    next to nothing
    """

    order: Array | None
    seconds: float


def plan(points: Array, edges: Array, indptr: Array, indices: Array) -> Plan:
    """The plan for points (N, 2) and a network's edges (E, 2).

    indptr, indices : columns of the matrix, upper triangle, unknowns of point p at 2 p and 2 p + 1
    """
    count = len(points)
    many = np.count_nonzero(np.bincount(edges.ravel(), minlength=count) > 2) > JUNCTIONS
    if not many and count < FEW:
        return Plan(None, 0.0)
    # All blocks are full, so that the even columns' even rows are the pairs of points.
    even = np.repeat(np.arange(2 * count) % 2 == 0, np.diff(indptr)) & (indices % 2 == 0)
    column = np.repeat(np.arange(2 * count), np.diff(indptr))
    found = dissect(points, np.stack([indices[even] // 2, column[even] // 2], axis=1))
    order = np.stack([2 * found.order, 2 * found.order + 1], axis=1).ravel() if many else None
    return Plan(order, 8.0 * found.work / RATE)


def dissect(points: Array, pairs: Array) -> Dissection:
    """Dissect points (N, 2).  pairs : (n, 2) int, what is coupled, each pair once or more."""
    cell = _cells(points, pairs)
    # A cell comes when both halves are over: where its stretch of the leaves ends, the deeper first.
    depth = np.frexp(cell.astype(float))[1] - 1
    end = (cell - (1 << depth) + 1) << (_DEEPEST - depth)
    order = np.lexsort((points[:, 1], points[:, 0], -depth, end))
    own, border = _fronts(cell, depth, pairs)
    return Dissection(order, own, border)


def _cells(points: Array, pairs: Array) -> Array:
    """The cell of which each point is in the separator, or in the leaf: 1 is all, 2 c and 2 c + 1 halve c."""
    count = len(points)
    cell = np.ones(count, dtype=np.int64)
    place, high = np.empty(count, dtype=np.int64), np.zeros((2, count), dtype=bool)
    active = np.arange(count)
    a, b = pairs[pairs[:, 0] != pairs[:, 1]].T
    for _depth in range(_DEEPEST):
        active = active[_counts(cell[active])[0] > LEAF]
        if not len(active):
            break
        own = _counts(cell[active])[1]
        place[active] = own
        inside = np.zeros(count, dtype=bool)
        inside[active] = True
        stays = inside[a] & inside[b] & (cell[a] == cell[b])
        a, b = a[stays], b[stays]
        high[:, active] = [_upper(points[active, axis], own) for axis in (0, 1)]
        across = [way[a] != way[b] for way in high]
        cells = int(own.max()) + 1
        cut = [np.bincount(place[a[one]], minlength=cells) for one in across]
        way = (cut[0] > cut[1]).astype(int)  # of each cell: the axis along which it is halved
        upper = high[way[place[active]], active]
        one = np.where(way[place[a]] == 0, *across)
        touching = np.unique(np.concatenate([a[one], b[one]]))
        above = high[way[place[touching]], touching]
        more = np.bincount(place[touching], np.where(above, 1.0, -1.0), cells) > 0.0
        inside[touching[above != more[place[touching]]]] = False
        stays = inside[active]
        active = active[stays]
        cell[active] = 2 * cell[active] + upper[stays]
    return cell


def _counts(names: Array) -> tuple[Array, Array]:
    """How many have the name of each, (n,), and the number of each one's name in their order, (n,)."""
    _, number, size = np.unique(names, return_inverse=True, return_counts=True)
    return size[number], number


def _upper(coordinate: Array, place: Array) -> Array:
    """Which points, (n,) bool, are in the upper half of their cell, (n,), by a coordinate (n,)."""
    size = np.bincount(place)
    rank = np.empty(len(place), dtype=np.int64)
    rank[np.lexsort((coordinate, place))] = np.arange(len(place))
    return rank - (np.cumsum(size) - size)[place] >= size[place] // 2


def _fronts(cell: Array, depth: Array, pairs: Array) -> tuple[Array, Array]:
    """Points and border of each cell's front, (C,) each, deepest cells first."""
    count = len(cell)
    a, b = pairs[cell[pairs[:, 0]] != cell[pairs[:, 1]]].T
    swap = depth[a] < depth[b]
    a, b = np.where(swap, b, a), np.where(swap, a, b)  # a is the deeper one: eliminated first
    own, border = [], []
    of, point = cell[:0], cell[:0]  # borders: cell and point
    for level in range(int(depth.max(initial=0)), -1, -1):
        here = depth[a] == level
        key = np.unique(np.concatenate([of, cell[a[here]]]) * count + np.concatenate([point, b[here]]))
        of, point = key // count, key % count
        names, size = np.unique(np.concatenate([cell[depth == level], of]), return_counts=True)
        beyond = np.bincount(np.searchsorted(names, of), minlength=len(names))
        own.append(size - beyond)
        border.append(beyond)
        of = of >> 1
        left = cell[point] != of
        of, point = of[left], point[left]
    return np.concatenate(own), np.concatenate(border)
