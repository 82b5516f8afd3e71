# SPDX-License-Identifier: GPL-2.0-or-later
"""Groups of parts that near ties join, and the weights of E_size that follow from them."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from ..geometry.arrays import Array
from ..model import Ties
from ..network.sampling import Samples
from .facing import Facing
from .tie_weights import nearness

# Ties up to this many times as long as near ones still form groups.  Just beyond REACH ties are as strong as
# near ones.  A highlight that kept its size there, as a part without a group does, would dent the bulb
# beneath it.
REACH_OF_GROUP = 1.25

# A part belongs to another one's group if near ties join at least this share of its samples to it.
TIED_SHARE = 0.1

# Weight of E_size of parts without a handle, in groups without any handle and in groups with one.
SIZE, SIZE_IN_GROUP = 1.0, 0.3

# Greatest weight of E_size of parts that cross others, and of the part that has to stretch where handles move
# two of them apart.
SIZE_CROSSED, SIZE_APART = 0.1, 0.01


def held_parts(label: Array, handles: Array) -> Array:
    """Which components, (C,) bool, carry a handle; handles : (H,) samples."""
    result = np.zeros(int(label.max()) + 1, dtype=bool)
    result[label[handles]] = True
    return result


def steps_to_handles(near: Ties, label: Array, held: Array, crossed: Array) -> Array:
    """The number of ties from each component to the nearest one with a handle, (C,); inf if there is none.

    near : the ties that count; held : (C,) bool, components with a handle; crossed : (K, 2) components that
        cross
    """
    count = len(held)
    a, b = label[near.samples[:, 0]], label[near.samples[:, 2]]
    pair, ties = np.unique(a[a != b] * count + b[a != b], return_counts=True)
    size = np.bincount(label, minlength=count)
    pair = pair[ties >= TIED_SHARE * size[pair // count]]
    pair = np.unique(np.concatenate([pair, crossed @ [count, 1]]))
    graph = csr_matrix((np.ones(len(pair)), (pair // count, pair % count)), shape=(count, count))
    return np.asarray(dijkstra(graph, False, np.flatnonzero(held), unweighted=True, min_only=True))


def following(samples: Samples, found: Facing, times: Array, step: Array) -> Array:
    """How much each sample takes the size of a curve beside it that is nearer to a handle, (N,) from 0 to 1.

    times : (F,) relative lengths of all ties; step : (N,) see `steps_to_handles`
    """
    follows = np.zeros(len(step))
    foot = samples.edges[found.edge]
    here, there = step[found.sample], step[foot[:, 0]]
    share = nearness(times)
    np.maximum.at(follows, found.sample[here > there], share[here > there])
    np.maximum.at(follows, foot[here < there].ravel(), np.repeat(share[here < there], 2))
    # Parts that no near ties join to a handle keep their own size.
    return np.where(np.isfinite(step), follows, 0.0)


def farther_parts(points: Array, label: Array, crossed: Array, handles: Array) -> Array:
    """Of two parts that cross at samples (K, 2), the one whose handles are farther from there, (K,)."""
    part, owner = label[crossed], label[handles]
    away = np.full(part.shape, np.inf)
    for one in np.intersect1d(part, owner):
        near = cKDTree(points[handles[owner == one]])
        away[part == one] = near.query(points[crossed[part == one]])[0]
    return np.where(away[:, 1] > away[:, 0], part[:, 1], part[:, 0])


def size_limits(part: Array, farther: Array, shift: Array, tolerance: float) -> Array:
    """The upper bound of each part's weight of E_size, (C,): finite for parts that cross others, else inf.

    part : (K, 2) parts that cross; farther : (K,) see `farther_parts`
    shift : (C, 2) of parts that their own handles only shift, else NaN; tolerance : of equal shifts, user
        units
    """
    firm = np.full(len(shift), np.inf)
    firm[part] = SIZE_CROSSED
    differ = np.abs(shift[part[:, 0]] - shift[part[:, 1]]).max(axis=1)
    # Where handles move two parts apart, the one with the farther handles stretches.
    firm[farther[differ > tolerance]] = SIZE_APART
    return firm
