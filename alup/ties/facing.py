# SPDX-License-Identifier: GPL-2.0-or-later
"""Which points of the curves face each other: the geometry below `alup.ties.ties`.

From every sample a perpendicular is dropped onto the curves around it, and the nearest foot on each of its
two sides is kept.  The sides of a Delaunay triangulation tell where to look: they join every sample to those
around it, whatever the distance.  The feet themselves do not depend on which diagonals the triangulation has.

Two points that are near each other along their curves, also through junctions, do not face each other: the
curves hold them together.  So a foot counts only if the path along the curves is several times longer than
the distance across.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ..geometry.arrays import Array, Floats, Ints
from ..geometry.connected_components import components
from ..geometry.edges import edge_vectors
from ..network.sampling import Samples

# The path along the curves has to be longer than AROUND distances and AROUND_SPACINGS spacings together.  At
# a corner of 30 degrees it is four times the opening.  Beside a crossing, the crossing alone has to hold.
AROUND, AROUND_SPACINGS = 4.0, 4.0

# A foot lies straight ahead if the sine of its angle to the curve is at most this: its side would be
# rounding.
AHEAD = 1e-6

# How often a foot at the end of an edge walks on to the next edge.
WALKS = 2

# How many edges of one sample are searched for a foot.  Centres of stars have more edges, with much the same
# feet.
_MOST_EDGES = 7

# With more vertices, paths along the curves are measured between cells of half a spacing.
_MOST_VERTICES = 5000

# Most entries of a table of paths along the curves; it bounds the memory.
_TABLE = 1_000_000


@dataclass(frozen=True)
class Facing:
    """F pairs of a sample and the foot of its perpendicular on an edge.

    sample, edge : (F,) int; share : (F,) where on the edge, from 0 to 1; distance : (F,) user units
    """

    sample: Ints
    edge: Ints
    share: Floats
    distance: Floats

    def of(self, which: Array) -> Facing:
        return Facing(self.sample[which], self.edge[which], self.share[which], self.distance[which])


def facing(samples: Samples, sides: Array, spacing: float, farthest: float) -> Facing:
    """The nearest facing point on each side of every sample, and the nearest straight ahead.

    sides : (m, 2) samples, of a triangulation; spacing, farthest : user units
    """
    at = _Incidence(samples.edges, len(samples.points))
    both_ways = np.concatenate([sides, sides[:, ::-1]])
    distance = np.linalg.norm(edge_vectors(samples.points, both_ways), axis=1)
    sample, near = both_ways[distance <= farthest].T
    found = _foot(samples, at, sample, near)
    # Where all edges at the other sample are the first one's own there is no foot to walk on from.
    found = found.of(np.isfinite(found.distance))
    sample = found.sample
    for _ in range(WALKS):
        start, end = samples.edges[found.edge].T
        further = _foot(samples, at, sample, np.where(found.share < 0.5, start, end))
        closer = further.distance < found.distance
        found = Facing(
            sample, *(np.where(closer, getattr(further, name), getattr(found, name)) for name in _FOOT)
        )
    found = found.of((found.distance <= farthest) & (found.distance > 1e-9 * spacing))
    enough = AROUND * found.distance + AROUND_SPACINGS * spacing
    found = found.of(_ways(samples, found, spacing, enough) > enough)
    side = _side(samples, at, found)
    order = np.lexsort((found.distance, 3 * found.sample + side))
    _, first = np.unique((3 * found.sample + side)[order], return_index=True)
    return found.of(order[first])


_FOOT = ("edge", "share", "distance")


class _Incidence:
    """The edges at every sample: edge[first[i] : first[i] + valence[i]]."""

    def __init__(self, edges: Array, count: int):
        self.ends = edges.ravel(order="F")
        order = np.argsort(self.ends, kind="stable")
        self.edge = order % max(len(edges), 1)
        self.valence = np.bincount(self.ends, minlength=count)
        self.first = np.cumsum(self.valence) - self.valence


def _foot(samples: Samples, at: _Incidence, sample: Array, near: Array) -> Facing:
    """The nearest point to each sample on the edges at another one; infinitely far where there is none."""
    edge, share = np.zeros(len(sample), dtype=int), np.zeros(len(sample))
    distance = np.full(len(sample), np.inf)
    for k in range(min(int(at.valence.max(initial=0)), _MOST_EDGES)):
        some = np.flatnonzero(at.valence[near] > k)
        trial = at.edge[at.first[near[some]] + k]
        start, vector = (
            samples.points[samples.edges[trial, 0]],
            edge_vectors(samples.points, samples.edges[trial]),
        )
        offset = samples.points[sample[some]] - start
        square = np.maximum(np.einsum("nd,nd->n", vector, vector), 1e-300)
        t = np.clip(np.einsum("nd,nd->n", offset, vector) / square, 0.0, 1.0)
        away = np.linalg.norm(offset - t[:, None] * vector, axis=1)
        own = (samples.edges[trial] == sample[some, None]).any(axis=1)
        closer = (away < distance[some]) & ~own
        which = some[closer]
        edge[which], share[which], distance[which] = trial[closer], t[closer], away[closer]
    return Facing(sample, edge, share, distance)


def _side(samples: Samples, at: _Incidence, found: Facing) -> Array:
    """On which side of its curve each sample sees its foot, (F,) 0 or 1, and 2 straight ahead."""
    vector = edge_vectors(samples.points, samples.edges).view(np.complex128).ravel()
    unit = vector / np.maximum(np.abs(vector), 1e-300)
    # Squares of directions forget which way an edge runs, so those of a sample's edges can be added.
    square = np.zeros(len(samples.points), dtype=complex)
    np.add.at(square, at.ends, np.tile(unit**2, 2))
    tangent = np.sqrt(square)
    # At a right angle they cancel: any of the edges tells the sides apart.
    any_edge = unit[at.edge[np.minimum(at.first, len(at.edge) - 1)]]
    tangent = np.where(np.abs(square) > 1e-6, tangent, any_edge)
    a, b = samples.edges[found.edge].T
    foot = samples.points[a] + found.share[:, None] * (samples.points[b] - samples.points[a])
    offset = (foot - samples.points[found.sample]).view(np.complex128).ravel()
    seen = tangent[found.sample].conj() * offset
    return np.where(np.abs(seen.imag) <= AHEAD * np.abs(seen), 2, (seen.imag > 0.0).astype(int))


def _ways(samples: Samples, found: Facing, spacing: float, enough: Array) -> Array:
    """How far it is along the curves from each sample to its foot, (F,) user units.

    enough : (F,) what is longer than this may be given as any longer way, and as inf
    """
    edges, begin = samples.edges, samples.chain_start
    curves = len(begin) - 1
    owner = np.repeat(np.arange(curves), np.diff(begin) - 1)
    length = np.linalg.norm(edge_vectors(samples.points, edges), axis=1)
    total = np.bincount(owner, length, curves)
    # Along its curve, of the start of each edge.
    before = np.cumsum(length) - length
    before = before - before[begin[:-1] - np.arange(curves)][owner]
    ends = np.stack([samples.chain[begin[:-1]], samples.chain[begin[1:] - 1]], axis=1)
    curve_of, place_of = np.zeros(len(samples.points), dtype=int), np.zeros(len(samples.points))
    for end, place in ((0, before), (1, before + length)):
        curve_of[edges[:, end]], place_of[edges[:, end]] = owner, place
    from_curve, from_place = curve_of[found.sample], place_of[found.sample]
    to_curve, to_place = owner[found.edge], before[found.edge] + found.share * length[found.edge]
    way = np.where(from_curve == to_curve, np.abs(from_place - to_place), np.inf)

    _, part = components(ends, int(ends.max()) + 1)
    joined = np.flatnonzero(part[ends[from_curve, 0]] == part[ends[to_curve, 0]])
    # From vertex to vertex by the shortest curve between them.
    vertices, ends = _merged(samples.points, ends, part, spacing)
    count = len(vertices)
    low, high = ends.min(axis=1), ends.max(axis=1)
    order = np.lexsort((total, low * count + high))
    _, first = np.unique((low * count + high)[order], return_index=True)
    short = order[first]
    weights, at = np.maximum(total[short], 1e-300), (low[short], high[short])
    graph = csr_matrix((np.tile(weights, 2), (np.concatenate(at), np.concatenate(at[::-1]))), (count, count))
    # Most pairs are near, and need no long ways: those of about the same need at a time.
    need = np.ceil(np.log2(enough))
    row = np.full(count, -1)
    for some in (joined[need[joined] == size] for size in np.unique(need[joined])):
        limit = float(enough[some].max())
        for end in (0, 1):
            leaving = from_place if end == 0 else total[from_curve] - from_place
            begins = ends[from_curve[some], end]
            order = np.argsort(begins, kind="stable")
            by_begin = some[order]
            source, first = np.unique(begins[order], return_index=True)
            many = np.diff(first, append=len(some))
            for mine, inside in _neighbourhoods(vertices, source, limit):
                row[inside] = np.arange(len(inside))
                table = dijkstra(graph[inside][:, inside], indices=row[source[mine]], limit=limit)
                here = np.concatenate([by_begin[first[k] : first[k] + many[k]] for k in mine])
                number = np.repeat(np.arange(len(mine)), many[mine])
                for other in (0, 1):
                    arriving = (to_place if other == 0 else total[to_curve] - to_place)[here]
                    column = row[ends[to_curve[here], other]]
                    between = np.where(column < 0, np.inf, table[number, column])
                    way[here] = np.minimum(way[here], leaving[here] + between + arriving)
                row[inside] = -1
    return way


def _merged(points: Array, ends: Array, part: Array, spacing: float) -> tuple[Array, Array]:
    """The vertices (n, 2) and the curves' ends (C, 2); where very many, those of a part in a cell are one.

    part : (V,) the part of each vertex

    In a dense hatching all vertices are near all others, and every way would visit thousands of them.
    """
    count = len(part)
    if count <= _MOST_VERTICES:
        return points[:count], ends
    cell = np.floor(points[:count] / (0.5 * spacing))
    _, first, place = np.unique(np.column_stack([part, cell]), axis=0, return_index=True, return_inverse=True)
    return points[first], place.ravel()[ends]


def _neighbourhoods(points: Array, source: Array, limit: float) -> Iterator[tuple[Array, Array]]:
    """Which of the sources (S,), and the vertices that ways from them of no more than `limit` can pass.

    No way is shorter than the straight line.  Tables of sources and vertices are of a bounded size.
    """
    waiting = [(np.arange(len(source)), np.arange(len(points)))]
    while waiting:
        mine, inside = waiting.pop()
        if not len(mine):
            continue
        low, high = points[source[mine]].min(axis=0), points[source[mine]].max(axis=0)
        if len(mine) * len(inside) > _TABLE:
            near = (points[inside] >= low - limit) & (points[inside] <= high + limit)
            inside = inside[near.all(axis=1)]
        if len(mine) == 1 or len(mine) * len(inside) <= _TABLE:
            yield mine, inside
            continue
        along = points[source[mine], int(np.argmax(high - low))]
        half = np.argsort(along, kind="stable")
        waiting += [(mine[part], inside) for part in np.array_split(half, 2)]
