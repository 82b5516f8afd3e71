# SPDX-License-Identifier: GPL-2.0-or-later
"""Opening of crossings: where two objects only cross, each gets a sample of its own, and a tie joins the two.

In a network all curves at a vertex share one point.  That is right where curves end on each other.  But most
crossings come from stacking, such as a wheel on a truck, or a jar's body that continues beneath its foot.
With a common point wheel and truck are one part, so the wheel has no size of its own and grows with the
truck.  Once the crossing is opened they are two parts, and a tie holds them together there
(`alup.ties.ties`).

Some crossings remain vertices: a self-crossing, and a crossing with an object that is also joined elsewhere,
because both belong to one object; crossings that a handle holds; and crossings with a clip, which has no size
of its own to keep.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..geometry.connected_components import components
from ..model import Array, Drawing
from .sampling import Samples, end_edges, straight_turns
from .weld import Network


def opened(samples: Samples, network: Network, drawing: Drawing, held: Array) -> tuple[Samples, Array]:
    """The samples with one sample for each object that only crosses others at a vertex.

    held : (H,) int, samples that handles hold
    Returns them, the added ones last, and pairs (K, 2) of samples that were one.
    """
    edges, count = samples.edges, len(samples.points)
    at, through = _passing(samples, network, drawing.following)
    # A vertex is a crossing if all its edges form pairs that pass it, and each pair crosses another one.
    pairs = np.bincount(at, minlength=count)
    crossing = (np.bincount(edges.ravel(), minlength=count) == 2 * pairs) & (pairs > 1)
    both, times = np.unique(np.stack([np.tile(at, 2), through.T.ravel()], axis=1), axis=0, return_counts=True)
    crossing[both[times > 1, 0]] = False
    crossing[held] = False
    crossing[network.piece_ends[np.isin(drawing.shape[network.segment], drawing.clips)]] = False
    through, at = through[crossing[at]], at[crossing[at]]
    crossing[at[~_cross(samples, at, through)]] = False
    through, at = through[crossing[at]], at[crossing[at]]
    owner = _objects(edges, ~crossing, through)
    place, which = np.unique(np.stack([at, owner[through[:, 0]]], axis=1), axis=0, return_inverse=True)
    place = place[:, 0]
    # The first object at a crossing keeps the sample; the others get new ones.
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
    """Vertices that contours pass: the samples (T,), and the edges before and behind them (T, 2)."""
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
    """Whether a pair of edges at a sample separates the two edges of another pair there, (T,) bool."""
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


def _objects(edges: Array, joins: Array, through: Array) -> Array:
    """The object that each edge belongs to, (E,): edges are joined by samples that join and by passing pairs.

    joins : (N,) bool; through : (T, 2) pairs of edges
    """
    number = len(edges)
    edge, at = np.repeat(np.arange(number), 2), edges.ravel()
    at_joint = np.stack([edge, number + at], axis=1)[joins[at]]
    _, label = components(np.concatenate([at_joint, through]), number + len(joins))
    return label[:number]
