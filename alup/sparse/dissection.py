# SPDX-License-Identifier: GPL-2.0-or-later
"""Nested dissection: an order of elimination for points of the plane, and the cost of a factor in this order.

Problem.  The graph of a sparse symmetric matrix has the points of a drawing as vertices, and as edges the
pairs of points that an entry couples.  Wanted are an order of elimination whose factor has few entries, and
an estimate of the work before the factorisation.

Method (George 1973, with coordinates).  The points of a *cell* are halved along x or y, whichever cuts fewer
pairs.  The points of one half with a neighbour in the other half are the cell's *separator*.  It is
eliminated after both halves.  The halves are cells in turn, down to `LEAF` points.  Coupled points of a
drawing are near each other, so a line across N evenly scattered points meets about sqrt(N) of them.  The
factor then has about N log N entries and takes N^1.5 operations.

Cost.  The *border* of a cell are the later points that its own points are coupled with when they are
eliminated.  Own points and border make a dense front.  The border consists of the neighbours of the own
points and of the borders of both halves, without the cell's own points.

qdldl's own order, minimum degree, is better where few curves run side by side, which is the usual case.
Where very many curves cross it can be far worse: on 80 by 80 lines it took two hundred times as long.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.arrays import Array

# Cells with at most this many points are not halved: the order of so few points matters little.
LEAF = 16

# The greatest number of successive halvings; 2^40 leaves are more than there are points.
_DEEPEST = 40

# A network is dissected if curves meet at more samples than this.  Minimum degree begins to lose at 1,000.
JUNCTIONS = 1_000

# A matrix of fewer points is factorised within a tenth of a second, so no estimate is made.
FEW = 10_000

# Multiplications a second, for the estimate.  Measured: 0.7e9 to 6e9 with both orders, except where qdldl's
# own order fails.
RATE = 1e9


@dataclass(frozen=True)
class Dissection:
    """order : (N,) int, the points in the order of elimination

    own, border : (C,) int, the numbers of own points and of border points of each cell's front
    """

    order: Array
    own: Array
    border: Array

    @property
    def entries(self) -> float:
        """An upper bound of the entries of the factor's lower triangle, in pairs of points."""
        return float((self.own * (0.5 * (self.own + 1.0) + self.border)).sum())

    @property
    def work(self) -> float:
        """An estimate of the multiplications for the factor, in triples of points."""
        s, b = self.own.astype(float), self.border
        return float((s * (s * s / 6.0 + 0.5 * s * b + 0.5 * b * b)).sum())


@dataclass(frozen=True)
class Plan:
    """How a matrix of 2x2 blocks of points is factorised.

    order : (2 N,) int, the order of elimination of its unknowns, None for qdldl's own
    seconds : estimated duration of a factorisation; 0 where it is negligible
    """

    order: Array | None
    seconds: float


def plan(points: Array, edges: Array, indptr: Array, indices: Array) -> Plan:
    """The plan for points (N, 2) and a network's edges (E, 2).

    indptr, indices : the upper triangle of the matrix in CSC format; the unknowns of point p are 2 p and 2 p
        + 1
    """
    count = len(points)
    many = np.count_nonzero(np.bincount(edges.ravel(), minlength=count) > 2) > JUNCTIONS
    if not many and count < FEW:
        return Plan(None, 0.0)
    # All blocks are full, so the entries in even rows of even columns are the pairs of points.
    even = np.repeat(np.arange(2 * count) % 2 == 0, np.diff(indptr)) & (indices % 2 == 0)
    column = np.repeat(np.arange(2 * count), np.diff(indptr))
    found = dissect(points, np.stack([indices[even] // 2, column[even] // 2], axis=1))
    order = np.stack([2 * found.order, 2 * found.order + 1], axis=1).ravel() if many else None
    return Plan(order, 8.0 * found.work / RATE)


def dissect(points: Array, pairs: Array) -> Dissection:
    """Dissect points (N, 2).  pairs : (n, 2) int, coupled points; a pair may occur repeatedly."""
    cell = _cells(points, pairs)
    # A cell follows both of its halves.  So cells are sorted by the last leaf below them, deeper cells first.
    depth = np.frexp(cell.astype(float))[1] - 1
    end = (cell - (1 << depth) + 1) << (_DEEPEST - depth)
    order = np.lexsort((points[:, 1], points[:, 0], -depth, end))
    own, border = _fronts(cell, depth, pairs)
    return Dissection(order, own, border)


def _cells(points: Array, pairs: Array) -> Array:
    """The cell (N,) in whose separator or leaf each point is.

    Cell 1 has all points; cells 2 c and 2 c + 1 are the halves of cell c.
    """
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
    """The number of occurrences of each label (n,), and its rank among the distinct labels; (n,) each."""
    _, number, size = np.unique(names, return_inverse=True, return_counts=True)
    return size[number], number


def _upper(coordinate: Array, place: Array) -> Array:
    """Which points, (n,) bool, are in the upper half of their cell by one coordinate.

    coordinate : (n,); place : (n,) int, the rank of each point's cell
    """
    size = np.bincount(place)
    rank = np.empty(len(place), dtype=np.int64)
    rank[np.lexsort((coordinate, place))] = np.arange(len(place))
    return rank - (np.cumsum(size) - size)[place] >= size[place] // 2


def _fronts(cell: Array, depth: Array, pairs: Array) -> tuple[Array, Array]:
    """The numbers of own points and of border points of each cell's front, (C,) each, deepest cells first."""
    count = len(cell)
    a, b = pairs[cell[pairs[:, 0]] != cell[pairs[:, 1]]].T
    swap = depth[a] < depth[b]
    a, b = np.where(swap, b, a), np.where(swap, a, b)  # a is the deeper one: eliminated first
    own, border = [], []
    of, point = cell[:0], cell[:0]  # the borders, as pairs of a cell and a point
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
