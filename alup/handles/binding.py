# SPDX-License-Identifier: GPL-2.0-or-later
"""Handle objects of the drawing -> grabbed points of the network -> samples and their targets.

A handle grabs the point of the curves nearest to its rest point.  Grabbed points become samples, as stops of
`sampling.sample`.  A handle is then one sample with a target.  A section is all samples inside its rectangle,
with their images under its affine map as targets.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry import bezier
from ..geometry.arrays import Floats, Ints
from ..messages.errors import HandleError
from ..messages.language import translate as _
from ..model import REACH_OF_DIAGONAL, Array, Drawing, Handle
from ..network.sampling import Samples
from ..network.weld import Network

# Targets of one sample that differ by less than this part of the diagonal count as equal.
SAME_TARGET_OF_DIAGONAL = 1e-6

# A handle nearer to its curve than this part of the diagonal lies on it up to rounding of the file or of an
# arc drawn as cubics.  Then the curve's point makes exactly the handle's move, and does not go to its target.
ON_CURVE_OF_DIAGONAL = 1e-5

# Greatest distance of a target, in diagonals.  Beyond it rounding of the handles' energy hides all other
# terms.  (The message below names the value.)
FARTHEST = 1e6


@dataclass(frozen=True)
class Grabbed:
    """The points of the network that handles hold.

    handle : (B,) int, index into the drawing's handles
    ignored : names of handles that lie on a bystander's curve, and on none of the drawing
    curve : (B,) int; fraction : (B,) of the curve's arc length; point : (B, 2) user units
    distance : (B,) from the handle's rest point
    """

    handle: Ints
    curve: Ints
    fraction: Floats
    point: Floats
    distance: Floats
    ignored: tuple[str, ...]


@dataclass(frozen=True)
class Anchors:
    """The samples that handles hold.

    samples : (H,) int, each once; targets : (H, 2) user units; of_handle : (B,) index into samples of each
        handle
    """

    samples: Ints
    targets: Floats
    of_handle: Ints


def grab(network: Network, drawing: Drawing) -> Grabbed:
    """The points of curves that the drawing's handles hold.

    Raises HandleError if there are no handles, if one is too far from all curves, or if none that moves is on
    a selected curve.
    """
    reach = REACH_OF_DIAGONAL * drawing.diagonal
    if not drawing.handles and not drawing.sections:
        raise HandleError(
            _(
                "There are no handles. Put some on the drawing with Extensions > ALUP Reshape > Place "
                "handles, and move one; or draw small circles on the curves and label them alup:pin for "
                "points that stay, alup:from NAME and alup:to NAME for a point that moves."
            )
        )
    if not len(network.curves):
        raise HandleError(_("None of the selected curves is long enough to be reshaped."))
    found: list[tuple[int, int, float, Array, float]] = []
    ignored: list[str] = []
    curves, bystanders = bezier.Nearest(network.curves), bezier.Nearest(drawing.bystanders)
    for n, handle in enumerate(drawing.handles):
        allowed = max(handle.reach, reach)
        curve, t, point, distance = curves.find(handle.rest)
        if distance <= allowed:
            found.append((n, curve, _fraction(network.curves[curve], t), point, distance))
        elif len(drawing.bystanders) and bystanders.find(handle.rest)[3] <= allowed:
            ignored.append(handle.name)
        else:
            raise HandleError(
                _(
                    "The handle {name} is not on a curve: the nearest selected one is {distance:.4g} away, "
                    "at most {allowed:.4g} is allowed (user units). Move it onto a curve or delete it."
                ).format(name=handle.name, distance=distance, allowed=allowed)
            )
    if not found and not drawing.sections:
        raise HandleError(
            _(
                "None of the handles lies on a selected curve. "
                "Select the objects that carry the handles, or nothing."
            )
        )
    moving = [n for n, handle in enumerate(drawing.handles) if _moves(handle)]
    if moving and not drawing.sections and not set(moving) & {n for n, *_others in found}:
        raise HandleError(
            _(
                "None of the handles that move lies on a selected curve. "
                "Select the objects that carry them, or nothing."
            )
        )
    index, curve_, fraction, point_, distance_ = zip(*found) if found else ((), (), (), (), ())
    return Grabbed(
        handle=np.array(index, dtype=int),
        curve=np.array(curve_, dtype=int),
        fraction=np.array(fraction, dtype=float),
        point=np.array(point_, dtype=float).reshape(-1, 2),
        distance=np.array(distance_, dtype=float),
        ignored=tuple(ignored),
    )


def _moves(handle: Handle) -> bool:
    return handle.target is not None and not np.array_equal(handle.target, handle.rest)


def _fraction(control: Array, t: float) -> float:
    """The fraction of a cubic's arc length at a parameter."""
    parts = bezier.subrange(np.stack([control, control]), np.array([0.0, t]), np.array([t, 1.0]))
    before, after = bezier.arc_lengths(parts, 16)
    return float(before / (before + after)) if before + after > 0.0 else 0.0


def anchors(drawing: Drawing, grabbed: Grabbed, samples: Samples) -> Anchors:
    """The samples that handles hold, and their targets.

    Raises HandleError for a target farther than FARTHEST, and for two different targets of one sample.
    """
    chosen: list[int] = []
    targets: list[Array] = []
    owners: list[str] = []
    for n, index in enumerate(grabbed.handle.tolist()):
        handle = drawing.handles[index]
        sample = int(samples.stops[n])
        at = samples.points[sample]
        # The grabbed point may have been merged into a sample beside it, so the move is prescribed, not the
        # target.
        on_curve = grabbed.distance[n] <= ON_CURVE_OF_DIAGONAL * drawing.diagonal
        origin = handle.rest if on_curve else grabbed.point[n]
        move = np.zeros(2) if handle.target is None else handle.target - origin
        chosen.append(sample)
        targets.append(at + move)
        owners.append(handle.name)
    for section in drawing.sections:
        x, y, width, height = section.rest
        inside = np.all((samples.points >= [x, y]) & (samples.points <= [x + width, y + height]), axis=1)
        if not inside.any():
            raise HandleError(
                _(
                    "The frame {name} holds no curve. "
                    "Put it around a part of the selected curves or delete it."
                ).format(name=section.name)
            )
        for sample in np.flatnonzero(inside).tolist():
            at = samples.points[sample]
            chosen.append(sample)
            targets.append(section.matrix[:, :2] @ at + section.matrix[:, 2])
            owners.append(section.name)
    at, wanted = np.array(chosen), np.array(targets)
    _refuse_far(samples.points[at], wanted, owners, drawing.diagonal)
    return _merged(at, wanted, owners, len(grabbed.handle), drawing.diagonal)


def _refuse_far(points: Array, targets: Array, owners: list[str], diagonal: float) -> None:
    for owner, near in zip(owners, (np.abs(targets - points) <= FARTHEST * diagonal).all(axis=1)):
        if not near:
            raise HandleError(
                _(
                    "The handle {name} is to go farther than a million times the size of the selected paths. "
                    "Move it nearer."
                ).format(name=owner)
            )


def _merged(chosen: Array, targets: Array, owners: list[str], handles: int, diagonal: float) -> Anchors:
    unique, first, inverse = np.unique(chosen, return_index=True, return_inverse=True)
    inverse = inverse.ravel()
    apart = np.linalg.norm(targets - targets[first][inverse], axis=1)
    worst = int(np.argmax(apart))
    if apart[worst] > SAME_TARGET_OF_DIAGONAL * diagonal:
        raise HandleError(
            _(
                "The handles {first} and {second} hold the same point of the curves but want it in different "
                "places. Delete one of them or move it along the curve."
            ).format(first=owners[first[inverse[worst]]], second=owners[worst])
        )
    return Anchors(unique, targets[first], inverse[:handles])
