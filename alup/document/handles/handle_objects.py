# SPDX-License-Identifier: GPL-2.0-or-later
"""Handle objects of the drawing: reading them, and updating them after a run.

The contract: an object whose `inkscape:label` is `alup:pin`, `alup:from NAME`, `alup:to NAME`,
`alup:handle` (with `alup:rest="x y"`) or `alup:section` (with `alup:rest="x y w h"`) is a handle.
Without labels `own_objects` recognises them by their attributes.

A run stores two positions on each handle.  `alup:rest` is its point in the base that later runs start from.
`alup:at` is its position after the run, by which the next run recognises that it was moved
(`handle_targets`).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Collection

import numpy as np

from ...geometry.bezier import evaluate
from ...messages.errors import HandleError
from ...messages.language import translate as _
from ...model import Array
from ...svg import basic_shapes, path_data
from ..tree.elements import (
    AT,
    LABEL,
    LARGEST_COORDINATE,
    REST,
    Element,
    is_squashed,
    length_reader,
    local_tag,
    name_of,
    own_matrix,
    parent_matrix,
    parent_of,
    read_shape,
    transform_text,
)
from ..tree.own_objects import KIND
from ..tree.undo_log import UndoLog


@dataclass
class HandleObject:
    """A handle object.  kind : pin, from, to, handle or section

    matrix : (2, 3) own coordinates -> root user units; bounds : (2, 2) root user units
    corners : (4, 2) of a section's rectangle, root user units
    rest, at : the stored positions (2,), or None; of a section its corners (4, 2)
    hold : like rest, but on the curves that the run starts from; None before `handle_targets.resolve`
    stand : (2,) the position after the run; None: it keeps its position
    no_part : whether it lies on an object that is not reshaped
    """

    element: Element
    name: str
    kind: str
    pair: str
    matrix: Array
    bounds: Array
    corners: Array
    rest: Array | None
    at: Array | None = None
    hold: Array | None = None
    stand: Array | None = None
    no_part: bool = False

    @property
    def centre(self) -> Array:
        return self.bounds.mean(axis=0)

    @property
    def radius(self) -> float:
        return float((self.bounds[1] - self.bounds[0]).max() / 2.0)


def read_handle(element: Element, label: str) -> HandleObject:
    kind, _gap, pair = label[len("alup:") :].strip().partition(" ")
    name = name_of(element)
    if kind not in ("pin", "from", "to", "handle", "section"):
        raise HandleError(
            _(
                "The label of {name} is not one of alup:pin, alup:from NAME, alup:to NAME, alup:handle "
                "and alup:section. Correct it in Object > Object Properties."
            ).format(name=name)
        )
    tag = local_tag(element)
    if kind == "section" and tag != "rect":
        message = _("The frame {name} is not a rectangle. Draw one and give it this label.")
        raise HandleError(message.format(name=name))
    if tag not in basic_shapes.TAGS and tag != "path":
        raise HandleError(
            _("The handle {name} is a {tag}, not a circle. Draw a circle and give it this label.").format(
                name=name, tag=tag
            )
        )
    matrix = (parent_matrix(element) @ own_matrix(element))[:2]
    shape = read_shape(element, matrix)
    control = [s.control @ matrix[:, :2].T + matrix[:, 2] for s in shape.subpaths if len(s.control)]
    if not any(np.ptp(part.reshape(-1, 2), axis=0).any() for part in control) or is_squashed(matrix):
        message = _("The handle {name} has no size. Delete it and draw a circle instead.")
        raise HandleError(message.format(name=name))
    points = evaluate(np.concatenate(control)[:, None], np.linspace(0.0, 1.0, 9)[None, :]).reshape(-1, 2)
    bounds = np.array([points.min(axis=0), points.max(axis=0)])
    corners = np.zeros((4, 2))
    if kind == "section":
        length = length_reader(element, name)
        x, y = length("x") or 0.0, length("y") or 0.0
        w, h = length("width") or 0.0, length("height") or 0.0
        local = np.array([[x, y], [x + w, y], [x + w, y + h], [x, y + h]])
        corners = local @ matrix[:, :2].T + matrix[:, 2]
    rest, at = (_stored(element, name, kind, attribute) for attribute in (REST, AT))
    return HandleObject(element, name, kind, pair.strip(), matrix, bounds, corners, rest, at)


def _stored(element: Element, name: str, kind: str, attribute: str) -> Array | None:
    """A stored point (2,), or a section's corners (4, 2), or None."""
    text = element.attrib.get(attribute)
    if text is None or kind == "to" or (kind in ("pin", "from") and AT not in element.attrib):
        return None
    parts = re.split(r"[\s,]+", text.strip())
    try:
        values = np.array([float(part) for part in parts])
    except ValueError:
        values = np.zeros(0)
    counts = (4, 8) if kind == "section" else (2,)
    if len(values) not in counts or not np.abs(values).max() <= LARGEST_COORDINATE:
        raise HandleError(
            _(
                "The attribute {attribute} of the handle {name} is {text!r}, not {count} numbers. "
                "Delete the attribute in the XML editor; the handle is a pin then."
            ).format(attribute=f"alup:{attribute.split('}')[1]}", name=name, text=text[:40], count=counts[0])
        )
    if len(values) == 4:
        x, y, width, height = values
        return np.array([[x, y], [x + width, y], [x + width, y + height], [x, y + height]])
    return values if len(values) == 2 else values.reshape(4, 2)


def settle(
    handles: list[HandleObject],
    undo_log: UndoLog,
    ignored: Collection[str],
    remember: bool,
    new_base: bool = False,
) -> None:
    """Move handles to their targets and, if there are originals, store their rests.

    new_base : whether later runs start from the state before this run; then all other handles get rests in
        it, too
    """
    goals = {handle.pair: handle for handle in handles if handle.kind == "to"}
    for handle in handles:
        if handle.kind == "to":
            continue
        if handle.no_part or handle.name in ignored:
            stood = _stored(handle.element, handle.name, handle.kind, AT)
            if new_base and stood is not None:
                undo_log.touch(handle.element)
                _remember(handle, REST, stood)
            continue
        goal = goals[handle.pair].centre if handle.kind == "from" else handle.stand
        undo_log.touch(handle.element)
        if goal is not None:
            move_to(handle, goal)
        if remember and handle.hold is not None:
            now = handle.corners if handle.kind == "section" else handle.centre if goal is None else goal
            _remember(handle, REST, handle.hold)
            _remember(handle, AT, now)
            _keep_kind(handle, undo_log)
            if handle.kind == "from":
                _keep_kind(goals[handle.pair], undo_log)


def _keep_kind(handle: HandleObject, undo_log: UndoLog) -> None:
    """Store the kind of a handle, so that it is known after a program has dropped the label."""
    if handle.kind not in ("handle", "section"):
        undo_log.touch(handle.element)
        handle.element.attrib[KIND] = f"{handle.kind} {handle.pair}".strip()


def unsettle(handle: HandleObject) -> None:
    """Remove the attributes that a run has stored on a handle.

    Its kind is kept if a program has dropped the label, because only the kind still marks it as a handle.
    """
    names = [AT] if handle.kind in ("handle", "section") else [AT, REST]
    if LABEL in handle.element.attrib:
        names.append(KIND)
    for name in names:
        handle.element.attrib.pop(name, None)


def _remember(handle: HandleObject, attribute: str, value: Array) -> None:
    """Write a position into an attribute, unless it already has this value in any notation."""
    stored = _stored(handle.element, handle.name, handle.kind, attribute)
    if stored is None or not np.array_equal(value, stored):
        handle.element.attrib[attribute] = place_text(value)


def place_text(value: Array) -> str:
    """The text of a point or of a rectangle's corners; an upright rectangle as x, y, width and height."""
    if value.ndim == 2:
        low, size = value.min(axis=0), np.ptp(value, axis=0)
        upright = np.array([low, low + size * [1, 0], low + size, low + size * [0, 1]])
        value = np.concatenate([low, size]) if np.array_equal(upright, value) else value.ravel()
    return " ".join(repr(float(number) + 0.0) for number in value)


def remove(handles: list[HandleObject], ignored: Collection[str]) -> None:
    """Delete the handles that took part in the run."""
    for handle in handles:
        if not handle.no_part and handle.name not in ignored:
            take_out(handle.element)


def take_out(element: Element) -> None:
    parent, tail = parent_of(element), element.tail
    if tail and tail.strip():  # text between elements belongs to the document
        before = element.getprevious()
        if before is not None:
            before.tail = (before.tail or "") + tail
        else:
            parent.text = (parent.text or "") + tail
    parent.remove(element)


def move_to(handle: HandleObject, centre: Array) -> None:
    """Shift a handle object so that its centre (2,) is at a point in root user units."""
    shift = np.linalg.inv(handle.matrix[:, :2]) @ (centre - handle.centre)
    if not shift.any():
        return
    element, decimals = handle.element, _decimals(handle)
    if local_tag(element) in ("circle", "ellipse"):
        length = length_reader(element, handle.name)
        for attribute, by in zip(("cx", "cy"), shift):
            element.attrib[attribute] = path_data.number((length(attribute) or 0.0) + by, decimals)
        return
    by = f"translate({path_data.number(shift[0], decimals)},{path_data.number(shift[1], decimals)})"
    element.attrib["transform"] = f"{element.attrib.get('transform') or ''} {by}".strip()


def _decimals(handle: HandleObject) -> int:
    """Decimals of the handle's position, own coordinates: nine, or more for a millionth of its size."""
    own = handle.radius / float(np.linalg.norm(handle.matrix[:, :2], 2))
    return max(9, math.ceil(6.0 - math.log10(own)))


def lay_section(handle: HandleObject, corners: Array) -> None:
    """Give a section's rectangle these corners (4, 2), root user units."""
    own = (corners - handle.matrix[:, 2]) @ np.linalg.inv(handle.matrix[:, :2]).T
    low, size = own.min(axis=0), np.ptp(own, axis=0)
    upright = np.array([low, low + size * [1, 0], low + size, low + size * [0, 1]])
    element = handle.element
    if np.abs(own - upright).max() <= 1e-9 * float(size.max()):
        for attribute, value in zip(("x", "y", "width", "height"), (*low, *size)):
            element.attrib[attribute] = path_data.number(float(value), _decimals(handle))
        return
    now = np.column_stack([handle.corners[[0, 1, 3]], np.ones(3)])
    move = np.eye(3)
    move[:2] = np.linalg.solve(now, corners[[0, 1, 3]]).T
    outer = parent_matrix(element)
    element.attrib["transform"] = transform_text(np.linalg.solve(outer, move @ outer) @ own_matrix(element))
