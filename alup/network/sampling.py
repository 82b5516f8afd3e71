# SPDX-License-Identifier: GPL-2.0-or-later
"""Network -> evenly spaced samples and their straight turns (Sec. 3.4, "Discretization").

Every curve of the network is cut into edges of equal arc length, none longer than the spacing.  Vertices of
the network and points that handles hold are always samples.  So a curve with a handle is sampled evenly on
each side of it.  The samples along one curve, ends included, are its *chain*.

A *turn* (i; j, k) is a pair of edges that share sample i.  It is *straight* if both edges lie on straight
curves and continue each other.  There are straight turns also where a node divides a line, and where a line
continues through a junction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry import bezier
from ..geometry.arrays import Floats, Ints
from ..model import Array
from .weld import Network, parameters

# Of the longest side of the bounding box (the paper's value).
SPACING = 0.005

# Two lines that continue each other within this angle are one straight line.  Rounding to three decimals
# turns a line of a twentieth of the drawing by this much.  The solver keeps the small bend between them.
STRAIGHT_TURN = np.radians(0.2)

# A point held by a handle that is nearer than this part of the spacing to another sample is merged into it.
# Shorter edges would worsen the condition of the equations.
MERGE_OF_SPACING = 0.01

# An edge shorter than this part of its interval's mean edge joins the two sides of a fold.  Chosen by looking
# at the cases.
FOLD_OF_EDGE = 0.01

# Greatest number of doublings of an interval's edges.  A single fold needs one.
FOLD_ROUNDS = 3


@dataclass(frozen=True)
class Graph:
    """Samples and the edges between them: the domain of the energy.

    points : (N, 2) user units
    edges : (E, 2) int, along the curves
    straight_turns : (K, 3) int samples (i, j, k), each unordered pair once
    through : (T, 2) int, pairs of edges that continue each other through a vertex of other curves
    """

    points: Floats
    edges: Ints
    straight_turns: Ints
    through: Ints

    def part(self, keep: Array) -> Graph:
        """The samples of a mask (N,) that contains whole components, renumbered in their order."""
        number = np.cumsum(keep) - 1
        kept = keep[self.edges[:, 0]]
        edge_number = np.cumsum(kept) - 1
        straight = self.straight_turns[keep[self.straight_turns[:, 0]]]
        through = self.through[kept[self.through[:, 0]]]
        return Graph(self.points[keep], number[self.edges[kept]], number[straight], edge_number[through])


@dataclass(frozen=True)
class Samples(Graph):
    """The sampled network.  The network's vertices are the first samples, in the same order.

    chain_start : (C+1,) index of the first entry of each curve's chain in `chain` and `fraction`
    chain : (M,) int, samples along each curve, ends included
    fraction : (M,) their fractions of the curve's arc length
    stops : (B,) int, the samples of the points that had to be samples
    """

    chain_start: Ints
    chain: Ints
    fraction: Floats
    stops: Ints


def sample(network: Network, spacing: float, stop_curve: Array, stop_fraction: Array) -> Samples:
    """Sample the network's curves at `spacing` (user units).

    stop_curve : (B,) int, stop_fraction : (B,) points of curves that must be samples, as fractions
    of the arc length.
    """
    count = len(network.curves)
    length = bezier.arc_lengths(network.curves)
    bound_curve, bound = _bounds(length, stop_curve, stop_fraction, spacing)
    # One interval between consecutive bounds of the same curve.
    inside = np.flatnonzero(bound_curve[1:] == bound_curve[:-1])
    owner, low, high = bound_curve[inside], bound[inside], bound[inside + 1]
    edges_in = np.maximum(1, np.ceil((high - low) * length[owner] / spacing - 1e-6)).astype(int)
    edges_in = _no_doubled_edges(network.ends, owner, edges_in)
    edges_in = _no_closed_folds(network.curves, owner, low, high, edges_in)

    # Chains as fractions: the start of each interval and its inner points, then the curve's end.
    position = np.repeat(np.arange(len(owner)), edges_in)
    first = np.cumsum(edges_in) - edges_in
    step = (np.arange(len(position)) - first[position]) / edges_in[position]
    fraction = low[position] + step * (high - low)[position]
    per_curve = np.bincount(owner, edges_in, minlength=count).astype(int)
    chain_start = np.concatenate([[0], np.cumsum(per_curve + 1)])
    chain_fraction = np.ones(chain_start[-1])
    body = np.ones(chain_start[-1], dtype=bool)
    body[chain_start[1:] - 1] = False
    chain_fraction[body] = fraction

    # Number the samples: network vertices first, then the inner points of the chains in order.
    vertices = len(network.vertices)
    inner = body.copy()
    inner[chain_start[:-1]] = False
    chain = np.empty(chain_start[-1], dtype=int)
    chain[chain_start[:-1]], chain[chain_start[1:] - 1] = network.ends[:, 0], network.ends[:, 1]
    chain[inner] = vertices + np.arange(inner.sum())
    chain_curve = np.repeat(np.arange(count), per_curve + 1)
    t = parameters(network.curves, chain_curve[inner], chain_fraction[inner], 8 + per_curve)
    points = np.concatenate([network.vertices, bezier.evaluate(network.curves[chain_curve[inner]], t)])

    begin = np.flatnonzero(body)
    edges = np.stack([chain[begin], chain[begin + 1]], axis=1)
    edge_straight = network.straight[chain_curve[begin]]
    stops = _stop_samples(chain, chain_fraction, chain_curve, stop_curve, stop_fraction)
    return Samples(
        points=points,
        edges=edges,
        chain_start=chain_start,
        chain=chain,
        fraction=chain_fraction,
        straight_turns=straight_turns(points, edges, edge_straight),
        through=_through_edges(network, chain_start),
        stops=stops,
    )


def end_edges(chain_start: Array) -> Array:
    """The first and the last edge of every curve, (C, 2)."""
    # A chain of n samples has n - 1 edges.
    begin = chain_start - np.arange(len(chain_start))
    return np.stack([begin[:-1], begin[1:] - 1], axis=1)


def _through_edges(network: Network, chain_start: Array) -> Array:
    """The pairs of edges on both sides of cuts within one curve of the drawing, (T, 2)."""
    ends = end_edges(chain_start)
    vertex, *curves = network.through.T
    pairs = [ends[curve, np.where(network.ends[curve, 0] == vertex, 0, 1)] for curve in curves]
    return np.stack(pairs, axis=1)


def _bounds(length: Array, stop_curve: Array, stop_fraction: Array, spacing: float) -> tuple:
    """Ends and stops of all curves in order: (n,) curve, (n,) fraction; of near stops only one is kept."""
    count = len(length)
    curve = np.concatenate([np.arange(count), stop_curve, np.arange(count)]).astype(int)
    fraction = np.concatenate([np.zeros(count), stop_fraction, np.ones(count)])
    order = np.lexsort((fraction, curve))
    curve, fraction = curve[order], fraction[order]
    near = MERGE_OF_SPACING * spacing / np.maximum(length, 1e-300)
    is_end = (fraction == 0.0) | (fraction == 1.0)
    keep = np.ones(len(curve), dtype=bool)
    keep[1:] = (curve[1:] != curve[:-1]) | (fraction[1:] - fraction[:-1] > near[curve[1:]])
    keep &= (1.0 - fraction > near[curve]) & (fraction > near[curve])
    # The ends of curves are always kept.
    ends = np.zeros(len(curve), dtype=bool)
    ends[np.searchsorted(curve, np.arange(count), side="left")] = True
    ends[np.searchsorted(curve, np.arange(count), side="right") - 1] = True
    keep = (keep & ~is_end) | ends
    return curve[keep], fraction[keep]


def _no_doubled_edges(ends: Array, owner: Array, edges_in: Array) -> Array:
    """The numbers of edges per interval, raised where edges of different curves would coincide.

    A curve from a vertex to itself gets at least three edges, so that it encloses an area.  Two curves
    between the same vertices get at least two each.
    """
    per_curve = np.bincount(owner, edges_in, minlength=len(ends)).astype(int)
    loop = ends[:, 0] == ends[:, 1]
    wanted = np.where(loop, 3, 1)
    single = np.flatnonzero((per_curve == 1) & ~loop)
    low, high = ends[single].min(axis=1), ends[single].max(axis=1)
    _, inverse, times = np.unique(
        np.stack([low, high], axis=1), axis=0, return_inverse=True, return_counts=True
    )
    wanted[single[times[inverse.ravel()] > 1]] = 2
    missing = np.maximum(wanted - per_curve, 0)
    first = np.searchsorted(owner, np.arange(len(ends)))
    result = edges_in.copy()
    result[first] += missing
    return result


def _no_closed_folds(curves: Array, owner: Array, low: Array, high: Array, edges_in: Array) -> Array:
    """The numbers of edges per interval, doubled where an edge would join the two sides of a fold.

    Where a curve turns back on itself, samples at equal distances from the tip nearly coincide.  If they are
    neighbours, the edge between them has almost no length, and the equations are singular.  With twice as
    many edges there is a sample between them.
    """
    result = edges_in.copy()
    number = np.arange(len(owner))
    for _round in range(FOLD_ROUNDS):
        count = result[number] + 1
        position = np.repeat(np.arange(len(number)), count)
        step = np.arange(len(position)) - (np.cumsum(count) - count)[position]
        share = step / result[number][position]
        of = number[position]
        fraction = low[of] + share * (high - low)[of]
        t = parameters(curves, owner[of], fraction, np.full(len(curves), 8) + result.max(initial=1))
        points = bezier.evaluate(curves[owner[of]], t)
        inside = position[1:] == position[:-1]
        chord = np.linalg.norm(np.diff(points, axis=0), axis=1)
        length = np.zeros(len(number))
        np.add.at(length, position[1:][inside], chord[inside])
        closed = inside & (chord < FOLD_OF_EDGE * (length / result[number])[position[1:]])
        number = number[np.unique(position[1:][closed])]
        if not len(number):
            break
        result[number] *= 2
    return result


def _stop_samples(
    chain: Array, fraction: Array, curve: Array, stop_curve: Array, stop_fraction: Array
) -> Array:
    """The sample nearest to each stop along its curve."""
    key = fraction + 2.0 * curve
    wanted = stop_fraction + 2.0 * stop_curve
    right = np.clip(np.searchsorted(key, wanted), 1, max(len(key) - 1, 1))
    left = right - 1
    pick = np.where(np.abs(key[left] - wanted) <= np.abs(key[right] - wanted), left, right)
    return chain[pick].astype(int)


def turns(edges: Array, count: int) -> tuple:
    """All ordered pairs of different edges at each of `count` samples.

    Returns i, j, k (Q,) samples and ij, ik (Q,) edge numbers of the turns (i; j, k).
    """
    number = len(edges)
    at = edges.ravel(order="F")  # half-edges: first all starts, then all ends
    order = np.argsort(at, kind="stable")
    centre, edge = at[order], order % number if number else order
    other = edges[:, ::-1].ravel(order="F")[order]
    valence = np.bincount(centre, minlength=count)
    start = np.cumsum(valence) - valence
    fan = valence[centre]
    a = np.repeat(np.arange(len(centre)), fan)
    offset = np.arange(len(a)) - np.repeat(np.cumsum(fan) - fan, fan)
    b = start[centre[a]] + offset
    different = a != b
    a, b = a[different], b[different]
    return centre[a], other[a], other[b], edge[a], edge[b]


def straight_turns(points: Array, edges: Array, edge_straight: Array) -> Array:
    """The straight turns (K, 3) of edges (E, 2), each unordered pair once; edge_straight : (E,) bool"""
    i, j, k, ij, ik = turns(edges, len(points))
    once = (ij < ik) & edge_straight[ij] & edge_straight[ik]
    i, j, k = i[once], j[once], k[once]
    a, b = points[j] - points[i], points[i] - points[k]
    cross, dot = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], np.einsum("nd,nd->n", a, b)
    on = np.abs(np.arctan2(cross, dot)) <= STRAIGHT_TURN
    return np.stack([i[on], j[on], k[on]], axis=1)
