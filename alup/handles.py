"""Handle objects of the drawing -> grabbed points of the network -> samples and their targets.

A handle grabs the point of the curves nearest to its rest point.  Grabbed points become samples
(`sample.sample` takes them as stops); then every handle is a sample and a target, a section all
samples inside its rectangle and their images under its affine map.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import bezier
from .errors import HandleError
from .model import Array, Drawing, Handle
from .network import Network
from .sample import Samples

# How far from a handle its curve may be, of the drawing's diagonal (the document contract).
REACH_OF_DIAGONAL = 0.01

# Targets of one sample that differ by less than this, of the diagonal, are the same wish.
SAME_TARGET_OF_DIAGONAL = 1e-6

# Points of each curve that the search for the nearest one begins with.
_SEARCH_POINTS = 33


@dataclass(frozen=True)
class Grabbed:
    """Where the handles hold the network.

    curve : (B,) int; fraction : (B,) of the curve's arc length; point : (B, 2) user units
    distance : (B,) from the handle's rest point
    """

    curve: Array
    fraction: Array
    point: Array
    distance: Array


@dataclass(frozen=True)
class Anchors:
    """samples : (H,) int, each once; targets : (H, 2) user units; of_handle : (B,) into samples."""

    samples: Array
    targets: Array
    of_handle: Array


def grab(network: Network, drawing: Drawing) -> Grabbed:
    """The curve points that the drawing's handles hold.  Raises HandleError for one off every curve."""
    reach = REACH_OF_DIAGONAL * drawing.diagonal
    if not drawing.handles and not drawing.sections:
        raise HandleError(
            "There are no handles. Draw small circles on the curves and label them alup:pin for points "
            "that stay, alup:from NAME and alup:to NAME for a point that moves."
        )
    count = len(drawing.handles)
    curve, fraction = np.zeros(count, dtype=int), np.zeros(count)
    point, distance = np.zeros((count, 2)), np.zeros(count)
    if not len(network.curves):
        raise HandleError("None of the selected curves is long enough to be reshaped.")
    t = np.linspace(0.0, 1.0, _SEARCH_POINTS)
    net = bezier.evaluate(network.curves[:, None], t[None, :])
    slack = np.linalg.norm(np.diff(net, axis=1), axis=2).max(axis=1)
    for n, handle in enumerate(drawing.handles):
        curve[n], best, point[n], distance[n] = _nearest(network, net, slack, t, handle)
        if distance[n] > max(handle.reach, reach):
            raise HandleError(
                f"The handle {handle.name} is not on a curve: the nearest selected one is {distance[n]:.4g} "
                f"away, at most {max(handle.reach, reach):.4g} is allowed (user units). "
                "Move it onto a curve or delete it."
            )
        fraction[n] = _fraction(network.curves[curve[n]], best)
    return Grabbed(curve, fraction, point, distance)


def _nearest(
    network: Network, net: Array, slack: Array, t: Array, handle: Handle
) -> tuple[int, float, Array, float]:
    """Curve, parameter, point and distance of the curve point nearest to a handle."""
    away = np.linalg.norm(net - handle.rest, axis=2)
    nearest = away.min(axis=1)
    # Only curves that could come nearer than the best one's search point.
    candidates = np.flatnonzero(nearest - slack <= nearest.min())
    guess = t[away[candidates].argmin(axis=1)]
    points = np.broadcast_to(handle.rest, (len(candidates), 2))
    best = bezier.nearest_parameters(network.curves[candidates], points, guess)
    found = bezier.evaluate(network.curves[candidates], best)
    distance = np.linalg.norm(found - handle.rest, axis=1)
    pick = int(np.argmin(distance))
    return int(candidates[pick]), float(best[pick]), found[pick], float(distance[pick])


def _fraction(control: Array, t: float) -> float:
    """The fraction of a cubic's arc length at a parameter."""
    parts = bezier.subrange(np.stack([control, control]), np.array([0.0, t]), np.array([t, 1.0]))
    before, after = bezier.arc_lengths(parts, 16)
    return float(before / (before + after)) if before + after > 0.0 else 0.0


def anchors(drawing: Drawing, grabbed: Grabbed, samples: Samples) -> Anchors:
    """Samples that are held, and where.  Raises HandleError when two wishes for one point differ."""
    chosen: list[int] = []
    targets: list[Array] = []
    owners: list[str] = []
    for n, handle in enumerate(drawing.handles):
        sample = int(samples.stops[n])
        at = samples.points[sample]
        # The grabbed point may have merged into a sample beside it: what is wished is the move.
        move = np.zeros(2) if handle.target is None else handle.target - grabbed.point[n]
        chosen.append(sample)
        targets.append(at + move)
        owners.append(handle.name)
    for section in drawing.sections:
        x, y, width, height = section.rest
        inside = np.all((samples.points >= [x, y]) & (samples.points <= [x + width, y + height]), axis=1)
        if not inside.any():
            raise HandleError(
                f"The section handle {section.name} holds no curve. Put its rectangle around a part of the "
                "selected curves or delete it."
            )
        for sample in np.flatnonzero(inside).tolist():
            at = samples.points[sample]
            chosen.append(sample)
            targets.append(section.matrix[:, :2] @ at + section.matrix[:, 2])
            owners.append(section.name)
    return _merge(np.array(chosen), np.array(targets), owners, len(drawing.handles), drawing.diagonal)


def _merge(chosen: Array, targets: Array, owners: list[str], handles: int, diagonal: float) -> Anchors:
    unique, first, inverse = np.unique(chosen, return_index=True, return_inverse=True)
    inverse = inverse.ravel()
    apart = np.linalg.norm(targets - targets[first][inverse], axis=1)
    worst = int(np.argmax(apart))
    if apart[worst] > SAME_TARGET_OF_DIAGONAL * diagonal:
        raise HandleError(
            f"The handles {owners[first[inverse[worst]]]} and {owners[worst]} hold the same point of the "
            "curves but want it in different places. Delete one of them or move it along the curve."
        )
    return Anchors(unique, targets[first], inverse[:handles])
