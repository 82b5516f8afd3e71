# SPDX-License-Identifier: GPL-2.0-or-later
"""Ties and their weights: between facing points, at crossings, and along sides of the scaffold.

The energy of a tie is in `alup.ties.ties`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..geometry.arrays import Array
from ..model import Ties
from ..network.sampling import Samples
from .facing import Facing

# Weight of a near tie.  For comparison, the energy of an edge turned by 90 degrees is 1.  With 3, outlines
# get corners; with 0.1, roofs part from walls.
STRENGTH = 0.5

# In spacings: the length beyond which the weight falls, and the greatest length.  Chosen by looking at the
# cases.
REACH, FARTHEST = 4.0, 40.0

# A tie between two parts is near as well if it is shorter than this part of the smaller one's size, as across
# a wide border.
REACH_OF_SIZE = 0.1

# The greatest number of ties of neighbouring samples that one tie replaces.
MOST_THINNED = 8.0

# Weight of sliding relative to that of parting.  Without sliding there is more turning.
SLIDE = 0.25

# The strain at which a near tie lets go.  Beyond REACH it grows with the square of the length.
HOLDS = 0.35

# Weight of ties that only place groups without a handle, relative to STRENGTH.
GENTLE = 1e-3

# Weight of a tie at a crossing, relative to STRENGTH.  Its length is REACH.
CROSSING = 8.0


def near_lengths(samples: Samples, label: Array, count: int, found: Facing, spacing: float) -> Array:
    """The length up to which each tie counts as near, (F,) user units."""
    total = np.stack([np.bincount(label, samples.points[:, d], count) for d in (0, 1)], axis=1)
    centre = total / np.bincount(label, minlength=count)[:, None]
    # The size of a part is measured from its centre, not by its box, so that rotation does not change ties.
    size = np.zeros(count)
    np.maximum.at(size, label, 2.0 * np.linalg.norm(samples.points - centre[label], axis=1))
    a, b = label[found.sample], label[samples.edges[found.edge, 0]]
    smaller = np.where(a == b, 0.0, np.minimum(size[a], size[b]))
    return np.maximum(REACH * spacing, REACH_OF_SIZE * smaller)


def nearness(times: Array) -> Array:
    """The relative weight of ties: 1 for near ones, falling with the fourth power of the length beyond.

    times : (F,) lengths, relative to the length up to which a tie is near
    """
    return np.asarray(np.maximum(times, 1.0) ** -4.0)


def facing_ties(samples: Samples, found: Facing, times: Array, strength: float) -> Ties:
    """Ties between facing points; times : (F,) their lengths relative to `near_lengths`."""
    edge = samples.edges[found.edge]
    count = len(found.sample)
    share = found.share
    factor = np.stack([-np.ones(count), np.zeros(count), 1.0 - share, share], axis=1)
    numbers = np.concatenate([found.sample[:, None], found.sample[:, None], edge], axis=1)
    return Ties(
        samples=numbers,
        factor=factor,
        offset=np.einsum("tk,tkd->td", factor, samples.points[numbers]),
        length=found.distance,
        weight=strength * STRENGTH * nearness(times),
        slide=np.full(count, SLIDE),
        holds=HOLDS * np.maximum(times, 1.0) ** 2,
    )


def placing_ties(near: Ties, free: Array, times: Array, strength: float) -> Ties:
    """The ties with small weights for those that only place a group without a handle.

    These are the ties longer than REACH with an end in such a group.  free : (N,) bool, samples of such
        groups
    """
    placing = free[near.samples[:, [0, 2]]].any(axis=1) & (times > 1.0)
    # With t the length in units of REACH, the first term continues the near ties and falls steeply.  The
    # second falls as 1/t, like springs in series.
    gentle = strength * STRENGTH * (times**-10 + GENTLE / times)
    return replace(
        near, weight=np.where(placing, gentle, near.weight), holds=np.where(placing, np.inf, near.holds)
    )


def thinned(near: Ties, samples: Samples, lengths: Array) -> Ties:
    """Every n-th tie along a curve, n its length in spacings, with the weight of those that it replaces.

    More ties would only cost time.  lengths : (F,) in spacings
    """
    count = len(samples.points)
    start, chain = samples.chain_start, samples.chain
    long = np.diff(start)
    position, room = np.zeros(count, dtype=int), np.zeros(count, dtype=int)
    position[chain] = np.arange(len(chain)) - np.repeat(start[:-1], long)
    # A sample where curves meet is the first one of all of them, so that its ties are kept.
    position[chain[start[:-1]]] = 0
    room[chain] = np.repeat(long, long)
    sample = near.samples[:, 0]
    stride = np.clip(lengths, 1.0, MOST_THINNED).astype(int)
    kept = position[sample] % stride == 0
    replaced = np.minimum(stride, room[sample])[kept]
    thin = near.of(kept)
    return replace(thin, weight=thin.weight * replaced)


def scaffold_sides(sides: Array, near: Ties, label: Array, points: Array) -> Array:
    """The sides (m, 2) between different parts.  Where ties join two parts only the shortest side is kept.

    One side per pair makes sure that every part is held.
    """
    count = int(label.max()) + 1
    joined, pair = ((np.sort(label[ends], axis=1) @ [count, 1]) for ends in (near.samples[:, [0, 2]], sides))
    order = np.argsort(np.linalg.norm(points[sides[:, 1]] - points[sides[:, 0]], axis=1), kind="stable")
    _, first = np.unique(pair[order], return_index=True)
    kept = ~np.isin(pair, joined)
    kept[order[first]] = True
    return sides[kept]


def crossing_ties(points: Array, crossed: Array, spacing: float, strength: float) -> Ties:
    """Ties of pairs of samples at one point, (K, 2).

    Their weight is not below the normal one for any `strength`.
    """
    ties = Ties.between(points, crossed, np.full(len(crossed), CROSSING * STRENGTH * max(strength, 1.0)))
    return replace(ties, length=np.full(len(crossed), REACH * spacing))
