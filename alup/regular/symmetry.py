# SPDX-License-Identifier: GPL-2.0-or-later
"""A drawing that is its own mirror image, and is held and moved alike on both sides, stays one.

The energy is the same for a drawing and its mirror image.  The way to its minimiser is not: rounding, the
order of the curves and the cells of a triangulation are part of it.  Where the samples are mirrored in pairs,
and the handles' moves are as well, both sides take the mean of their displacements.

A *part* of a drawing, curves that are joined to each other and to no others, may be its own mirror image
where the drawing is not.  If it has lost a little of that after both rounds, one more round asks its pairs of
samples for a common middle along the axis and for one coordinate across it.  A part whose handles are not
mirrored, or not moved alike, is let go.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.arrays import Array
from ..model import Alignments

# The kind of regularity that this is.
SYMMETRY = "symmetry"

# Mirrored samples lie this near to each other, of the diagonal: twice the noise of coordinates.
PAIRED = 2e-4

# Moves of handles are mirrored if they differ by no more than this, of the diagonal.
ALIKE = 1e-6

# Parts smaller than this, of the diagonal, have no symmetry that an eye could compare; of more than MOST
# parts the largest are taken.
LEAST, MOST = 0.05, 60

# A part is let go if its samples are farther from their mirrored places than LET_GO, of its size; up to SEEN
# nothing has to be done.  PAIRS of its samples are asked for symmetry.  Chosen by looking at the cases.
LET_GO, SEEN, PAIRS = 0.03, 2e-3, 24


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


def find(points: Array, near: float | None = None) -> list[Mirror]:
    """The reflections, in a vertical or a horizontal line, that lead samples (n, 2) onto each other.

    near : how far from its mirrored partner a sample may be, user units; by default by the samples' extent
    """
    found = []
    low, high = points.min(axis=0), points.max(axis=0)
    if near is None:
        near = PAIRED * float(np.linalg.norm(high - low))
    tree = None
    for axis in (0, 1):
        image = points.copy()
        image[:, axis] = low[axis] + high[axis] - points[:, axis]
        # Most drawings are told by a few of their samples.
        few = image[:: max(1, len(image) // 64)]
        tree = tree or cKDTree(points)
        if (tree.query(few, distance_upper_bound=near)[0] > near).any():
            continue
        distance, partner = tree.query(image)
        if distance.max() <= near and np.array_equal(partner[partner], np.arange(len(points))):
            found.append(Mirror(axis, partner))
    return found


@dataclass(frozen=True)
class Part:
    """samples : (n,) int; axis : as in `Mirror`; partner : (n,) int, numbers in `samples`"""

    samples: Array
    axis: int
    partner: Array


def parts(points: Array, label: Array) -> list[Part]:
    """The parts, by the labels (N,) of samples (N, 2), that are their own mirror images."""
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    order = np.argsort(label, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    sizes = np.array([np.linalg.norm(np.ptp(points[group], axis=0)) for group in groups])
    large = [n for n in np.argsort(-sizes, kind="stable")[:MOST].tolist() if sizes[n] > LEAST * diagonal]
    return [
        Part(groups[n], mirror.axis, mirror.partner)
        for n in large
        if len(groups) > 1
        for mirror in find(points[groups[n]], PAIRED * diagonal)
    ]


def alignments(of: list[Part], moved: Array, held: Array) -> Alignments | None:
    """What parts are asked for that have lost some of their symmetry; moved : (N, 2) after the rounds.

    held : (H,) samples with handles
    """
    samples, factor, axis, length = [], [], [], []
    for part in of:
        v, mine = moved[part.samples], np.isin(part.samples, held)
        if (mine & ~mine[part.partner]).any():
            continue
        size = float(np.linalg.norm(np.ptp(v, axis=0)))
        middle = (v[:, part.axis] + v[part.partner, part.axis]) / 2.0
        across = v[:, 1 - part.axis] - v[part.partner, 1 - part.axis]
        # Handles that are not moved alike contradict; they are met, so their samples tell.
        alike = ALIKE * size
        if mine.any() and max(np.ptp(middle[mine]), np.abs(across[mine]).max()) > alike:
            continue
        missed = max(np.ptp(middle), np.abs(across).max()) / 2.0
        if not SEEN * size < missed <= LET_GO * size:
            continue
        pairs = np.flatnonzero(np.arange(len(v)) < part.partner)
        if len(pairs) < 2:
            continue
        pairs = pairs[:: max(1, len(pairs) // PAIRS)]
        i, j = part.samples[pairs], part.samples[part.partner[pairs]]
        count = len(pairs)
        samples += [np.stack([i[1:], j[1:], i[:-1], j[:-1]], axis=1), np.stack([i, i, j, j], axis=1)]
        factor += [
            np.tile([0.5, 0.5, -0.5, -0.5], (count - 1, 1)),
            np.tile([1.0, 0.0, -1.0, 0.0], (count, 1)),
        ]
        units = np.eye(2)[[part.axis, 1 - part.axis]]
        axis += [np.tile(units[0], (count - 1, 1)), np.tile(units[1], (count, 1))]
        length.append(np.full(2 * count - 1, size))
    if not samples:
        return None
    return Alignments(*(np.concatenate(one) for one in (samples, factor, axis, length)))
