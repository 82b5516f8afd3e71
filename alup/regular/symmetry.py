# SPDX-License-Identifier: GPL-2.0-or-later
"""A drawing that is its own mirror image, and is held and moved alike on both sides, stays one.

The energy is the same for a drawing and its mirror image.  The way to its minimiser is not: rounding, the
order of the curves and the cells of a triangulation are part of it.  Where the samples are mirrored in pairs,
and the handles' moves are as well, both sides take the mean of their displacements.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.arrays import Array

# The kind of regularity that this is.
SYMMETRY = "symmetry"

# Mirrored samples lie this near to each other, of the diagonal, where each coordinate has a noise of 1e-4.
# Both samples have it, and both ends of the box whose middle is the axis.
PAIRED = 5e-4

# Moves of handles are mirrored if they differ by no more than this, of the diagonal.
ALIKE = 1e-6


@dataclass(frozen=True)
class Mirror:
    """axis : the coordinate that a reflection turns around, 0 for left and right; partner : (n,) int"""

    axis: int
    partner: Array

    def suits(self, held: Array, moves: Array, diagonal: float) -> bool:
        """Whether handles at samples (H,) have mirrored partners that move alike, (H, 2)."""
        place = np.full(len(self.partner), -1)
        place[held] = np.arange(len(held))
        other = place[self.partner[held]]
        if (other < 0).any():
            return False
        return bool(np.abs(moves - self._reflected(moves[other])).max(initial=0.0) <= ALIKE * diagonal)

    def mean(self, displacement: Array) -> Array:
        """The mirrored displacements (n, 2) nearest to given ones."""
        return (displacement + self._reflected(displacement[self.partner])) / 2.0

    def _reflected(self, moves: Array) -> Array:
        sign = np.ones(2)
        sign[self.axis] = -1.0
        return moves * sign


def find(points: Array) -> list[Mirror]:
    """The reflections, in a vertical or a horizontal line, that lead samples (n, 2) onto each other."""
    found = []
    low, high = points.min(axis=0), points.max(axis=0)
    diagonal = float(np.linalg.norm(high - low))
    tree = None
    for axis in (0, 1):
        image = points.copy()
        image[:, axis] = low[axis] + high[axis] - points[:, axis]
        # Most drawings are told by a few of their samples.
        few = image[:: max(1, len(image) // 64)]
        tree = tree or cKDTree(points)
        if (tree.query(few, distance_upper_bound=PAIRED * diagonal)[0] > PAIRED * diagonal).any():
            continue
        distance, partner = tree.query(image)
        if distance.max() <= PAIRED * diagonal and np.array_equal(partner[partner], np.arange(len(points))):
            found.append(Mirror(axis, partner))
    return found
