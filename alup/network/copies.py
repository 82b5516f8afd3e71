# SPDX-License-Identifier: GPL-2.0-or-later
"""Segments that are the same cubic to rounding, in either direction, as of a fill and its stroke.

They are analysed once, and the splits are then given to all copies, so that n copies cost n, not n^2.
"""

from __future__ import annotations

import numpy as np

from ..geometry.boxes import ranges
from ..model import Array
from .monotone_arcs import EXACT
from .splits import Contacts

# Random odd factors of the hash of control points.  They are literals because numpy.random takes 15 ms to
# import.
_HASH = np.array(
    [
        [2360360630558964033, 4383240139369130521],
        [664818870401041973, 4374873391751699445],
        [1438068747342666923, 1952248665957342227],
        [3817104479337814857, 1887097935946223283],
    ],
    dtype=np.int64,
)


def find_copies(control: Array, extent: float) -> tuple[Array, Array]:
    """The first segment that is the same cubic, (S,), and whether it has the opposite direction, (S,) bool.

    Rounded control points are hashed, first to last and last to first, and the lesser hash is taken.  The
    points themselves are compared as well, so a collision of hashes can only hide a copy.
    """
    n = len(control)
    if not n:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=bool)
    middle = 0.5 * (control.min(axis=(0, 1)) + control.max(axis=(0, 1)))
    rounded = np.rint((control - middle) / max(EXACT * extent, np.finfo(float).tiny)).astype(np.int64)
    ahead = (rounded * _HASH).sum(axis=(1, 2))
    back = (rounded[:, ::-1] * _HASH).sum(axis=(1, 2))
    backwards = back < ahead
    rounded[backwards] = rounded[backwards][:, ::-1]
    _, first, inverse = np.unique(np.minimum(ahead, back), return_index=True, return_inverse=True)
    original = first[inverse]
    same = (rounded == rounded[original]).all(axis=(1, 2))
    original = np.where(same, original, np.arange(n))
    return original, (backwards != backwards[original]) & same


def for_copies(found: Contacts, copied: Array, flipped: Array) -> Contacts:
    """The contacts of all segments from those of the distinct ones; the points are numbered from 0.

    copied : (S,) index of the distinct segment; flipped : (S,) bool, see `find_copies`
    """
    n = int(copied.max(initial=-1)) + 1
    count = np.bincount(found.segment, minlength=n)
    segment, k = ranges((np.cumsum(count) - count)[copied], count[copied])
    t = np.where(flipped[segment], 1.0 - found.t[k], found.t[k])
    order = np.lexsort((t, segment))
    segment, t, k = segment[order], t[order], k[order]
    end = found.end.reshape(-1, 2)[copied]
    end = np.where(flipped[:, None], end[:, ::-1], end).ravel()
    _, point = np.unique(np.concatenate([found.group[k], end]), return_inverse=True)
    return Contacts(segment, t, found.kind[k], point[: len(k)], found.node[k], point[len(k) :])
