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
from ..geometry.connected_components import members
from ..model import Alignments

# The kind of regularity that this is.
SYMMETRY = "symmetry"

# Mirrored samples lie this near to each other, of the diagonal, where each coordinate has a noise of 1e-4.
# Both samples have it, and both ends of the box whose middle is the axis.
PAIRED = 5e-4

# Moves of handles are mirrored if they differ by no more than this, of the diagonal.
ALIKE = 1e-6

# Parts smaller than this, of the diagonal, have no symmetry that an eye could compare; of more than MOST
# parts the largest are taken.
LEAST, MOST = 0.05, 60

# Parts, and lines along the axes, stay upright if they turn by no more than UPRIGHT, radians.  They turn with
# the upright lines of the drawing if they do so by no more than TURNED more.
UPRIGHT, TURNED = np.radians(0.5), np.radians(3.0)

# Factors of the samples i, j of a pair and k, l of another one: the difference of their middles.  Factors of
# the samples i, i, j, j of a pair: the difference of their places.
_MIDDLES, _LEVEL = (0.5, 0.5, -0.5, -0.5), (1.0, 0.0, -1.0, 0.0)

# A part is let go if its samples are farther from their mirrored places than LET_GO, of its size; up to SEEN
# nothing has to be done.  PAIRS of its samples are asked for symmetry.  Chosen by looking at the cases.
LET_GO, SEEN, PAIRS = 0.1, 2e-3, 24


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
    """samples : (n,) int; mirror : its partners are numbers in `samples`"""

    samples: Array
    mirror: Mirror


def parts(points: Array, label: Array) -> list[Part]:
    """The parts, by the labels (N,) of samples (N, 2), that are their own mirror images."""
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    groups = members(label)
    if len(groups) < 2:
        return []
    sizes = np.array([np.linalg.norm(np.ptp(points[group], axis=0)) for group in groups])
    large = [n for n in np.argsort(-sizes, kind="stable")[:MOST].tolist() if sizes[n] > LEAST * diagonal]
    return [Part(groups[n], mirror) for n in large for mirror in find(points[groups[n]], PAIRED * diagonal)]


def alignments(
    of: list[Part], points: Array, moved: Array, held: Array, upright: float | None
) -> Alignments | None:
    """What parts are asked for that have lost some of their symmetry.

    points, moved : (N, 2) samples in the input and after the rounds; held : (H,) samples with handles
    upright : the turn of the drawing's lines along the axes, radians, if it has some
    """
    asked = []
    for part in of:
        axis, partner = part.mirror.axis, part.mirror.partner
        v, mine = moved[part.samples], np.isin(part.samples, held)
        if (mine & ~mine[partner]).any():
            continue
        units = _turned_axes(points[part.samples], v, upright)[:, [axis, 1 - axis]]
        along, across = ((v + sign * v[partner]) / 2.0 for sign in (1.0, -1.0))
        middle, uneven = along @ units[:, 0], across @ units[:, 1]
        size = float(np.linalg.norm(np.ptp(v, axis=0)))
        # Handles that are not moved alike contradict; they are met, so their samples tell.
        if mine.any() and max(np.ptp(middle[mine]), np.abs(uneven[mine]).max()) > ALIKE * size:
            continue
        missed = max(np.ptp(middle) / 2.0, np.abs(uneven).max())
        pairs = np.flatnonzero(np.arange(len(v)) < partner)
        if len(pairs) > 1 and SEEN * size < missed <= LET_GO * size:
            asked.append(_pairs_alike(part, pairs[:: max(1, len(pairs) // PAIRS)], units, size))
    return Alignments.together(asked) if asked else None


def _turned_axes(p: Array, v: Array, upright: float | None) -> Array:
    """The unit vectors of the axes (2, 2), in columns, turned as samples (n, 2) were, now at (n, 2)."""
    a, b = p - p.mean(axis=0), v - v.mean(axis=0)
    turn = float(np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum()))
    if upright is not None and abs(turn - upright) <= TURNED:
        turn = upright
    elif abs(turn) <= UPRIGHT:
        turn = 0.0
    return np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])


def _pairs_alike(part: Part, pairs: Array, units: Array, size: float) -> Alignments:
    """Consecutive pairs have one middle along the axis, and both of each are at one place across it."""
    i, j = part.samples[pairs], part.samples[part.mirror.partner[pairs]]
    count = len(pairs)
    rows = [np.tile(row, (times, 1)) for row, times in ((_MIDDLES, count - 1), (_LEVEL, count))]
    axes = [np.tile(unit, (times, 1)) for unit, times in zip(units.T, (count - 1, count))]
    return Alignments(
        samples=np.concatenate(
            [np.stack([i[1:], j[1:], i[:-1], j[:-1]], axis=1), np.stack([i, i, j, j], axis=1)]
        ),
        factor=np.concatenate(rows),
        axis=np.concatenate(axes),
        length=np.full(2 * count - 1, size),
    )
