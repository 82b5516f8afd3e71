# SPDX-License-Identifier: GPL-2.0-or-later
"""Symmetric dragging: the axis of a drawing, and the handle on its other side.

The mirror is x -> S x + s with S a reflection along an axis of the page.  A grip's partner rests where the
mirror takes its rest; it is asked to go where the mirror takes the grip.  A point on the axis is its own
partner and stays on it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Sequence

import numpy as np

from ..document.grips import FRAME, Grip
from ..geometry.bezier import Nearest, evaluate
from ..model import Array, Drawing

# Of the diagonal: handles that rest no farther from each other's mirror image are partners.  Somewhat
# arbitrary: drawings by hand are symmetric to a percent or two.
NEAR_OF_DIAGONAL = 0.03

# Points of the curves that tell which axis is the better one.
_SAMPLES = 200

# The vertical axis is preferred unless the other one is this many times as good.
_BETTER = 2.0


@dataclass(frozen=True)
class Mirror:
    """linear : (2,) of the diagonal of S, -1 along the mirrored axis; shift : (2,) s, user units

    line : (2, 2) ends of the axis within the drawing; reach : see `NEAR_OF_DIAGONAL`, user units
    """

    linear: Array
    shift: Array
    line: Array
    reach: float

    def image(self, points: Array) -> Array:
        """Points (..., 2) in the mirror."""
        return points * self.linear + self.shift

    def partner(self, grip: Grip, others: Sequence[Grip]) -> Grip | None:
        """The grip that rests where the mirror takes one's rest; it may be the grip itself."""
        wanted = self.image(grip.rest)
        found, least = None, self.reach
        for other in others:
            if other.kind != grip.kind:
                continue
            away = float(np.abs(_box(other.rest) - _box(wanted)).max())
            if away <= least:
                found, least = other, away
        return found

    def followed(self, partner: Grip, grip: Grip) -> Grip:
        """The partner where it is to be for a grip."""
        if grip.kind == FRAME:
            # The affine map of the grip, A, takes part as S A S.
            basis = np.column_stack([self.image(grip.rest[[0, 1, 3]]), np.ones(3)])
            move = np.linalg.solve(basis, self.image(grip.now[[0, 1, 3]]))
            return replace(partner, now=np.column_stack([partner.rest, np.ones(4)]) @ move)
        return replace(partner, now=partner.rest + self.linear * (grip.now - grip.rest))

    def on_axis(self, grip: Grip) -> Grip:
        """A grip that is its own partner, kept symmetric."""
        along = self.linear > 0.0
        if grip.kind == FRAME:
            middle = 0.5 * (grip.now.mean(axis=0) - grip.rest.mean(axis=0))
            return replace(grip, now=grip.now - np.where(along, 0.0, 2.0 * middle))
        return replace(grip, now=np.where(along, grip.now, grip.rest))


def _box(points: Array) -> Array:
    return np.array([points.min(axis=0), points.max(axis=0)])


def of(drawing: Drawing) -> Mirror:
    """The mirror of a drawing: about its vertical middle, or its horizontal one where that fits better."""
    bounds, middle = drawing.bounds, drawing.bounds.mean(axis=0)
    mirrors = []
    for axis in (0, 1):
        linear = np.ones(2)
        linear[axis] = -1.0
        line = bounds.copy()
        line[:, axis] = middle[axis]
        reach = NEAR_OF_DIAGONAL * drawing.diagonal
        mirrors.append(Mirror(linear, middle * (1.0 - linear), line, reach))
    upright, level = (_misfit(drawing, mirror) for mirror in mirrors)
    return mirrors[1] if level * _BETTER < upright else mirrors[0]


def _misfit(drawing: Drawing, mirror: Mirror) -> float:
    """Mean distance of mirrored points of the curves from the curves, user units."""
    step = max(len(drawing.control) // _SAMPLES, 1)
    points = evaluate(drawing.control[::step], np.full(len(drawing.control[::step]), 0.5))
    nearest = Nearest(drawing.control)
    return float(np.mean([nearest.find(point)[3] for point in mirror.image(points)]))
