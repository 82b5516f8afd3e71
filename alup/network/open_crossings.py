# SPDX-License-Identifier: GPL-2.0-or-later
"""Opens crossings: where two things only cross, each gets a sample of its own, and a tie joins the two.

In a network all curves of a vertex move as one point.  That is right where curves end on each other.  But
most crossings come from stacking: a wheel lies on a truck, a jar's body runs on beneath its foot.  With one
point for both, wheel and truck are one part, and the wheel has no size of its own and grows with the truck.
Opened, they are two parts, which a tie holds together where they cross (`alup.ties.ties`).

Some crossings stay vertices: those of a curve with itself, or with a thing to which it is joined elsewhere,
since both are one thing; those that a handle holds; and those with a clip, which has no size of its own to
keep.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..geometry.connected_components import components
from ..model import Array, Drawing
from .sampling import Samples, end_edges, straight_turns
from .weld import Network


def opened(samples: Samples, network: Network, drawing: Drawing, held: Array) -> tuple[Samples, Array]:
    """Samples with a sample for each thing that only crosses others at a vertex.

    held : (H,) int, samples that handles hold
    Returns them, the added ones last, and pairs (K, 2) of samples that were one.
    """
    edges, count = samples.edges, len(samples.points)
    at, through = _passing(samples, network, drawing.following)
    # Every edge there is one of one pair that runs on, and all of them cross.
    pairs = np.bincount(at, minlength=count)
    crossing = (np.bincount(edges.ravel(), minlength=count) == 2 * pairs) & (pairs > 1)
    both, times = np.unique(np.stack([np.tile(at, 2), through.T.ravel()], axis=1), axis=0, return_counts=True)
    crossing[both[times > 1, 0]] = False
    crossing[held] = False
    crossing[network.piece_ends[np.isin(drawing.shape[network.segment], drawing.clips)]] = False
    through, at = through[crossing[at]], at[crossing[at]]
    crossing[at[~_cross(samples, at, through)]] = False
    through, at = through[crossing[at]], at[crossing[at]]
    thing = _things(edges, ~crossing, through)
    place, which = np.unique(np.stack([at, thing[through[:, 0]]], axis=1), axis=0, return_inverse=True)
    place = place[:, 0]
    # The first thing at a crossing keeps the sample.
    added = np.zeros(len(place), dtype=bool)
    added[1:] = place[1:] == place[:-1]
    sample = place.copy()
    sample[added] = count + np.arange(added.sum())
    ends = edges.copy()
    for edge in through.T:
        end = (edges[edge, 1] == at).astype(int)
        ends[edge, end] = sample[which.ravel()]
    chain, begin = samples.chain.copy(), samples.chain_start
    first, last = end_edges(begin).T
    chain[begin[:-1]], chain[begin[1:] - 1] = ends[first, 0], ends[last, 1]
    points = np.concatenate([samples.points, samples.points[place[added]]])
    edge_straight = np.repeat(network.straight, np.diff(begin) - 1)
    straight = straight_turns(points, ends, edge_straight)
    result = replace(samples, points=points, edges=ends, chain=chain, straight_turns=straight)
    return result, np.stack([place[added], sample[added]], axis=1)


def _passing(samples: Samples, network: Network, following: Array) -> tuple[Array, Array]:
    """Where contours pass vertices: the samples (T,), and the pairs of edges (T, 2) by which they do."""
    curve, segment = network.curve, network.segment
    first = np.searchsorted(segment, np.arange(len(following)))
    last = np.searchsorted(segment, np.arange(len(following)), side="right") - 1
    after = np.arange(1, len(curve) + 1)
    after[last] = np.where(following >= 0, first[following], -1)
    before = np.flatnonzero(after >= 0)
    after = after[before]
    alive = (curve[before] >= 0) & (curve[after] >= 0)
    before, after = before[alive], after[alive]
    vertex = network.piece_ends[after, 0]
    ends = end_edges(samples.chain_start)
    # The last edge along a piece, and the first one along the next.
    leaving = ends[curve[before], np.where(network.backwards[before], 0, 1)]
    entering = ends[curve[after], np.where(network.backwards[after], 1, 0)]
    rows = np.unique(
        np.column_stack([vertex, np.sort(np.stack([leaving, entering], axis=1), axis=1)]), axis=0
    )
    return rows[:, 0], rows[:, 1:]


def _cross(samples: Samples, at: Array, pairs: Array) -> Array:
    """Which pairs of edges, (T,) bool, have another pair at the same sample with an edge on either side."""
    other = np.where(samples.edges[pairs, 0] == at[:, None], samples.edges[pairs, 1], samples.edges[pairs, 0])
    away = samples.points[other] - samples.points[at][:, None]
    angle = np.arctan2(away[..., 1], away[..., 0])
    order = np.argsort(at, kind="stable")
    count = np.bincount(at, minlength=len(samples.points))
    start = (np.cumsum(count) - count)[at[order]]
    fan = count[at[order]]
    a = np.repeat(np.arange(len(at)), fan)
    b = np.repeat(start, fan) + np.arange(len(a)) - np.repeat(np.cumsum(fan) - fan, fan)
    a, b = order[a], order[b]
    full = 2.0 * np.pi
    between = (angle[b] - angle[a, :1]) % full < (angle[a, 1:] - angle[a, :1]) % full
    crossed = (a != b) & (between[:, 0] != between[:, 1])
    return np.bincount(a[crossed], minlength=len(at)) > 0


def _things(edges: Array, joins: Array, through: Array) -> Array:
    """Which edges (E,) hang together by samples (N,) that join, and by the pairs that run on."""
    number = len(edges)
    edge, at = np.repeat(np.arange(number), 2), edges.ravel()
    at_joint = np.stack([edge, number + at], axis=1)[joins[at]]
    _, label = components(np.concatenate([at_joint, through]), number + len(joins))
    return label[:number]
