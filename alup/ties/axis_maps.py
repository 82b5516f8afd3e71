# SPDX-License-Identifier: GPL-2.0-or-later
"""The maps that handles ask for: shifts and axis-aligned scalings of parts, and the growth of everything."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.arrays import Array
from ..network.sampling import Samples

# Handles ask for an axis map if it misses none of their targets by more than this part of the diagonal.
EXACT = 1e-9

# `common_growth` is 1 if axis scalings leave at least this part of the handles' squared moves unexplained.
# Chosen by looking at the cases.
UNEXPLAINED = 0.05


@dataclass(frozen=True)
class AxisMaps:
    """The map x -> scale x + shift of every part.

    scale, shift : (C, 2); exact : (C,) bool, the handles ask for it, and it has no distortion
    """

    scale: Array
    shift: Array
    exact: Array


def common_growth(points: Array, targets: Array) -> float:
    """The common scaling of the whole drawing that handles at points (H, 2) ask for with targets (H, 2).

    The moves are fitted by one scaling along each axis.  The growth is the scaling nearer to 1, or 1 if one
    of them enlarges and the other shrinks, because a stretch leaves the thickness of borders as it was.  It
    tends to 1 continuously as the fit gets worse, so that nothing jumps while a handle is dragged.
    """
    along = _axis_scales(points, targets, EXACT * float(np.linalg.norm(np.ptp(points, axis=0))))
    if along is None or along.min() <= 0.0:
        return 1.0
    p, q = points - points.mean(axis=0), targets - targets.mean(axis=0)
    moved = float(((q - p) ** 2).sum())
    if moved == 0.0:
        return 1.0
    log = np.log(along)
    common = 0.0 if log[0] * log[1] <= 0.0 else log[np.argmin(np.abs(log))]
    left = float(((q - along * p) ** 2).sum()) / moved
    return float(np.exp(common * max(0.0, 1.0 - left / UNEXPLAINED)))


def part_maps(points: Array, label: Array, targets: Array, slanted: Array, tolerance: float) -> AxisMaps:
    """The axis map that the handles of each part ask for; the identity where they ask for none.

    points, label, targets : (H, 2), (H,), (H, 2), of each handle its position, its part and its target
    slanted : (C,) bool, see `slanted_parts`; tolerance : of a map that misses no target, user units
    """
    count = len(slanted)
    scale, shift, exact = np.ones((count, 2)), np.zeros((count, 2)), np.zeros(count, dtype=bool)
    for part in np.unique(label):
        mine = label == part
        p, q = points[mine], targets[mine]
        along = _axis_scales(p, q, tolerance)
        if along is None:
            continue
        move = q.mean(axis=0) - along * p.mean(axis=0)
        fits = np.abs(along * p + move - q).max() <= tolerance and along.min() > 0.0
        if fits and (np.ptp(along) <= EXACT or not slanted[part]):
            scale[part], shift[part], exact[part] = along, move, True
    return AxisMaps(scale, shift, exact)


def mean_moves(
    points: Array, label: Array, targets: Array, held: Array, tolerance: float
) -> tuple[Array, Array]:
    """The mean move of each part's handles, (C, 2), and whether there are any and they move alike, (C,) bool.

    points, label, targets : of the handles, see `part_maps`; held : (C,) bool, parts with handles
    tolerance : user units
    """
    count = len(held)
    move = targets - points
    total = np.stack([np.bincount(label, move[:, d], count) for d in (0, 1)], axis=1)
    shift = total / np.maximum(np.bincount(label, minlength=count), 1)[:, None]
    alike = held.copy()
    alike[label[np.abs(move - shift[label]).max(axis=1) > tolerance]] = False
    return shift, alike


def _axis_scales(p: Array, q: Array, tolerance: float) -> Array | None:
    """The scale of the least-squares map q = scale p + shift, (2,).

    It is 1 if all points coincide.  It is None if they lie on a line parallel to an axis, which leaves one of
    the two scales undetermined.
    """
    p, q = p - p.mean(axis=0), q - q.mean(axis=0)
    square = np.einsum("nd,nd->d", p, p)
    if (square <= tolerance**2).all():
        return np.ones(2)
    if (square <= tolerance**2).any():
        return None
    return np.asarray(np.einsum("nd,nd->d", p, q) / square)


def slanted_parts(samples: Samples, label: Array, count: int) -> Array:
    """Which parts have edges that are parallel to neither axis, (C,) bool.

    An axis stretch would distort them.
    """
    direction = np.abs(samples.points[samples.edges[:, 1]] - samples.points[samples.edges[:, 0]])
    slanted = direction.min(axis=1) > 1e-6 * direction.max(axis=1)
    return np.asarray(np.bincount(label[samples.edges[:, 0]], slanted, count) > 0)
