# SPDX-License-Identifier: GPL-2.0-or-later
"""Clip paths and masks are reshaped along with what they cut.

A clip path or mask joins the drawing if its edge touches the drawing's curves, or if a handle lies on it.
Its shapes are then further curves, in the user space of the element that refers to them, and the edge keeps
its place on the curves that it crosses.

Otherwise its shapes follow their element by the element's best-fitting scale and shift.  Joined as curves
that only the scaffold ties to the others, they would keep their size inside a stretched element, and show
another part of it.  They follow in this way, too, where separate parts are to stay (*Hold together*: apart),
and where a clip is so large that joining it would make the samples of all other curves coarse.

The new shapes are made on a copy outside the tree.  If nothing else refers to the original, the original
takes them over.  Otherwise the copy is added to the document under an id of its own.  Units relative to the
bounding box need no change.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...model import Array
from ..tree.elements import Element, Shape, local_tag
from ..tree.pending_changes import Changes
from ..tree.references import Ids, redirected
from ..tree.undo_log import State, UndoLog
from .filters import SIDES, region_of
from .motion import Moved, Points, axis_aligned, joined
from .texts_and_images import Carried, carry

PROPERTIES = ("clip-path", "mask")

# Moves up to this part of the extent are rounding of the solver.
ROUNDING = 1e-7


@dataclass
class Subject:
    """A reshaped element that refers to a clip path or mask.

    matrix : (3, 3) its user space -> root user units; parts : its shapes
    wholes : its texts, images and clones
    origin : the element of the document that `element` is a copy of, or `element` itself
    stands_for_origin : whether it is that element, or will replace it
    """

    element: Element
    origin: Element
    matrix: Array
    parts: list[Shape]
    wholes: list[Element] = field(default_factory=list)
    stands_for_origin: bool = True


@dataclass
class Companion:
    """A clip path or mask that is reshaped with its elements.

    work : the copy that is reshaped; in_place : whether the original takes over its contents
    origins : elements of the copy -> their originals
    shapes : of the copy, in the drawing if `joins`; carried : texts and images of the copy
    """

    original: Element
    work: Element
    subjects: list[Subject]
    name: str
    in_place: bool
    origins: dict[Element, Element]
    joins: bool = True
    shapes: list[Shape] = field(default_factory=list)
    carried: list[Carried] = field(default_factory=list)

    @property
    def copied(self) -> set[Element]:
        """Elements of the copy that do not replace elements of the document."""
        return set() if self.in_place else set(self.work.iter())


def follow(
    companion: Companion,
    moved: dict[int, Moved],
    wholes: dict[Element, Points],
    ids: Ids,
    changes: Changes,
) -> bool:
    """Plan the new state of a companion; returns whether it changes.

    moved : the motions of all shapes, by identity; those of a companion that follows are added
    wholes : points of texts, images and clones
    """
    parts = [part for subject in companion.subjects for part in subject.parts]
    whole = [wholes[e] for subject in companion.subjects for e in subject.wholes if e in wholes]
    if not parts and not whole:
        return False
    # Texts, images and clones count only if there are no shapes.
    points = joined([moved[id(part)].points for part in parts] or whole)
    user_space = companion.subjects[0].matrix
    to_user = np.linalg.inv(user_space)
    if not companion.joins:
        still = bool(np.abs(points.new - points.old).max() <= ROUNDING * points.extent)
        fit = user_space @ axis_aligned(points.under(to_user)) @ to_user
        for shape in companion.shapes:
            moved[id(shape)] = _mapped(shape, fit, not still)
    changed = any(moved[id(shape)].changed for shape in companion.shapes)
    for item in companion.carried:
        changed = not np.array_equal(carry(item, points, changes), np.eye(3)) or changed
    if not changed:
        return False
    own = [moved[id(shape)].points for shape in companion.shapes]
    _move_region(companion, (joined(own) if own else points).under(to_user), changes)
    if not companion.in_place:
        _add(companion, ids, changes)
    return True


def take_place(companion: Companion, undo_log: UndoLog) -> None:
    """Transfer the copy's contents to the original."""
    for new, old in companion.origins.items():
        state = State.of(new)
        if state != State.of(old):
            undo_log.put(old, state)
    for shape in companion.shapes:
        shape.element = companion.origins[shape.element]


def _mapped(shape: Shape, matrix: Array, changed: bool) -> Moved:
    old, count = shape.control, len(shape.control)
    new = old @ matrix[:2, :2].T + matrix[:2, 2]
    return Moved(old, new, np.arange(count), shape.line, np.zeros(count, dtype=bool), changed)


def _move_region(companion: Companion, points: Points, changes: Changes) -> None:
    """Plan that the region of a mask, if it is in user units, follows the mask's shapes."""
    work = companion.work
    if local_tag(work) != "mask" or work.attrib.get("maskUnits") != "userSpaceOnUse":
        return
    corners = region_of(companion.original)
    if corners is None:
        return
    fit = axis_aligned(points)
    corners = corners * np.diag(fit)[:2] + fit[:2, 2]
    low, high = corners.min(axis=0), corners.max(axis=0)
    for side, value in zip(SIDES, (*low, *(high - low))):
        changes.attributes.append((work, side, f"{value:.12g}"))


def _add(companion: Companion, ids: Ids, changes: Changes) -> None:
    """Plan that the copy is added behind the original with a new id, and that the elements refer to it."""
    work, original = companion.work, companion.original
    for element in work.iter():
        if isinstance(element.tag, str) and element.attrib.get("id"):
            changes.attributes.append((element, "id", ids.new(element.attrib["id"])))
    identity = next(value for element, name, value in changes.attributes if element is work and name == "id")
    changes.additions.append((original, work))
    for subject in companion.subjects:
        value = changes.styles.own(subject.origin, companion.name)
        if value is not None:
            changes.set_property(subject.element, companion.name, redirected(value, identity), subject.origin)
