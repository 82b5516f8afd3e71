# SPDX-License-Identifier: GPL-2.0-or-later
"""Ties and their weights: between facing points, at crossings, and along sides of the scaffold.

The energy of a tie is in `alup.ties.ties`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..model import Array, Ties
from ..network.sampling import Samples
from .facing import Facing

# Of a near tie; the energy of an edge turned by 90 degrees is 1.
STRENGTH = 0.5

# In spacings: where the weight begins to fall, and beyond which there are no ties.
REACH, FARTHEST = 4.0, 40.0

# Parts this much of the smaller one's size apart are near as well: a wide border is a border.
REACH_OF_SIZE = 0.1

# The most ties of neighbouring samples that one tie stands for.
MOST_THINNED = 8.0

# Weight of sliding against that of parting.
SLIDE = 0.25

# The strain at which a near tie lets go; beyond REACH it grows with the square of the length.
HOLDS = 0.35

# Weight of the ties that place groups without a handle, in units of STRENGTH.
GENTLE = 1e-3

# Weight of a crossing, against STRENGTH; its length is REACH.
CROSSING = 8.0


def near_lengths(samples: Samples, label: Array, count: int, found: Facing, spacing: float) -> Array:
    """Up to which length each tie is near, (F,) user units."""
    total = np.stack([np.bincount(label, samples.points[:, d], count) for d in (0, 1)], axis=1)
    centre = total / np.bincount(label, minlength=count)[:, None]
    # Not the box: a drawing that is turned has the same ties.
    size = np.zeros(count)
    np.maximum.at(size, label, 2.0 * np.linalg.norm(samples.points - centre[label], axis=1))
    a, b = label[found.sample], label[samples.edges[found.edge, 0]]
    smaller = np.where(a == b, 0.0, np.minimum(size[a], size[b]))
    return np.maximum(REACH * spacing, REACH_OF_SIZE * smaller)


def nearness(times: Array) -> Array:
    """1 for near ties, falling beyond."""
    return np.asarray(np.maximum(times, 1.0) ** -4.0)


def facing_ties(samples: Samples, found: Facing, times: Array, strength: float) -> Ties:
    """Ties between facing points; times : (F,) their lengths in the lengths up to which they are near."""
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
    """The ties, those beyond REACH that have an end in a group without a handle only placing it.

    free : (N,) bool, samples of such groups
    """
    places = free[near.samples[:, [0, 2]]].any(axis=1) & (times > 1.0)
    # With t the length in REACH: the first summand falls steeply from near ties, the second as 1/t, like
    # springs in a row.
    gentle = strength * STRENGTH * (times**-10 + GENTLE / times)
    return replace(
        near, weight=np.where(places, gentle, near.weight), holds=np.where(places, np.inf, near.holds)
    )


def thinned(near: Ties, samples: Samples, lengths: Array) -> Ties:
    """As many ties along a curve as they are long, each for those beside it: more only cost time.

    lengths : (F,) in spacings
    """
    count = len(samples.points)
    start, chain = samples.chain_start, samples.chain
    long = np.diff(start)
    position, room = np.zeros(count, dtype=int), np.zeros(count, dtype=int)
    position[chain] = np.arange(len(chain)) - np.repeat(start[:-1], long)
    # A sample where curves meet is the first of all of them.
    position[chain[start[:-1]]] = 0
    room[chain] = np.repeat(long, long)
    sample = near.samples[:, 0]
    stride = np.clip(lengths, 1.0, MOST_THINNED).astype(int)
    kept = position[sample] % stride == 0
    stands_for = np.minimum(stride, room[sample])[kept]
    thin = near.of(kept)
    return replace(thin, weight=thin.weight * stands_for)


def scaffold_sides(sides: Array, near: Ties, label: Array, points: Array) -> Array:
    """The sides (m, 2) between parts; where ties join two parts the shortest alone, so that all is held."""
    count = int(label.max()) + 1
    joined, pair = ((np.sort(label[ends], axis=1) @ [count, 1]) for ends in (near.samples[:, [0, 2]], sides))
    order = np.argsort(np.linalg.norm(points[sides[:, 1]] - points[sides[:, 0]], axis=1), kind="stable")
    _, first = np.unique(pair[order], return_index=True)
    kept = ~np.isin(pair, joined)
    kept[order[first]] = True
    return sides[kept]


def crossing_ties(points: Array, crossed: Array, spacing: float, strength: float) -> Ties:
    """Ties of samples at one point, (K, 2); at least as strong as normal, however loosely parts are held."""
    ties = Ties.between(points, crossed, np.full(len(crossed), CROSSING * STRENGTH * max(strength, 1.0)))
    return replace(ties, length=np.full(len(crossed), REACH * spacing))
