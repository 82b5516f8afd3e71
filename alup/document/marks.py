"""Handle objects of the drawing: finding, reading and, after a run, settling them.

The contract: an object whose `inkscape:label` is `alup:pin`, `alup:from NAME`, `alup:to NAME`,
`alup:handle` (with `alup:rest="x y"`) or `alup:section` (with `alup:rest="x y w h"`) is a handle.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Iterator

import numpy as np

from .. import pathdata, shapes
from ..bezier import evaluate
from ..errors import HandleError
from ..model import Array, Handle, Section
from .tree import (
    CONTAINERS,
    LABEL,
    REST,
    Element,
    length_reader,
    local_tag,
    name_of,
    own_matrix,
    parent_matrix,
    read_shape,
)


@dataclass
class HandleObject:
    """A labelled object; kind : pin, from, to, handle or section."""

    element: Element
    name: str
    kind: str
    pair: str
    matrix: Array
    bounds: Array  # (2, 2) in root user units
    corners: Array  # (4, 2) of a section's rectangle
    rest: Array | None

    @property
    def centre(self) -> Array:
        return self.bounds.mean(axis=0)

    @property
    def radius(self) -> float:
        return float((self.bounds[1] - self.bounds[0]).max() / 2.0)


def labelled(svg: Element) -> Iterator[tuple[Element, str]]:
    """Elements whose label begins with alup:, but groups, and what lies in <defs>."""
    for element in svg.iter():
        label = element.attrib.get(LABEL) if isinstance(element.tag, str) else None
        if not label or not label.startswith("alup:") or local_tag(element) in CONTAINERS:
            continue
        if any(
            local_tag(ancestor) in ("defs", "symbol", "clipPath", "mask")
            for ancestor in element.iterancestors()
        ):
            continue
        yield element, label


def read_handle(element: Element, label: str) -> HandleObject:
    kind, _, pair = label[len("alup:") :].strip().partition(" ")
    name = name_of(element)
    if kind not in ("pin", "from", "to", "handle", "section"):
        raise HandleError(
            f"The label of {name} is not one of alup:pin, alup:from NAME, alup:to NAME, alup:handle "
            "and alup:section. Correct it in Object > Object Properties."
        )
    tag = local_tag(element)
    if kind == "section" and tag != "rect":
        raise HandleError(f"The section handle {name} is not a rectangle. Draw one and give it this label.")
    if tag not in shapes.TAGS and tag != "path":
        raise HandleError(
            f"The handle {name} is a {tag}, not a circle. Draw a circle and give it this label."
        )
    matrix = (parent_matrix(element) @ own_matrix(element))[:2]
    shape = read_shape(element, matrix)
    control = [s.control @ matrix[:, :2].T + matrix[:, 2] for s in shape.subpaths if len(s.control)]
    if not control:
        raise HandleError(f"The handle {name} has no size. Delete it and draw a circle instead.")
    points = evaluate(np.concatenate(control)[:, None], np.linspace(0.0, 1.0, 9)[None, :]).reshape(-1, 2)
    bounds = np.array([points.min(axis=0), points.max(axis=0)])
    corners = np.zeros((4, 2))
    if kind == "section":
        length = length_reader(element, name)
        x, y = length("x") or 0.0, length("y") or 0.0
        w, h = length("width") or 0.0, length("height") or 0.0
        local = np.array([[x, y], [x + w, y], [x + w, y + h], [x, y + h]])
        corners = local @ matrix[:, :2].T + matrix[:, 2]
    return HandleObject(
        element, name, kind, pair.strip(), matrix, bounds, corners, _rest(element, name, kind)
    )


def _rest(element: Element, name: str, kind: str) -> Array | None:
    text = element.attrib.get(REST)
    count = {"handle": 2, "section": 4}.get(kind)
    if text is None or count is None:
        return None
    parts = re.split(r"[\s,]+", text.strip())
    try:
        values = np.array([float(part) for part in parts])
    except ValueError:
        values = np.zeros(0)
    if len(values) != count or not np.isfinite(values).all():
        raise HandleError(
            f"The attribute alup:rest of the handle {name} is {text[:40]!r}, not {count} numbers. "
            "Delete the attribute in the XML editor; the handle is a pin then."
        )
    return values


def wishes(handles: list[HandleObject], diagonal: float) -> tuple[tuple[Handle, ...], tuple[Section, ...]]:
    points: list[Handle] = []
    sections: list[Section] = []
    origins = _by_pair(handles, "from")
    goals = _by_pair(handles, "to")
    for pair in origins.keys() ^ goals.keys():
        there, missing = ("from", "to") if pair in origins else ("to", "from")
        lonely = (origins if pair in origins else goals)[pair]
        raise HandleError(
            f"The handle {lonely.name} has no partner: add a circle labelled "
            f"\u201calup:{missing} {pair}\u201d, or delete the one labelled \u201calup:{there} {pair}\u201d."
        )
    for handle in handles:
        goal: Array | None = None
        rest = handle.centre
        if handle.kind == "from":
            goal = goals[handle.pair].centre
        elif handle.kind == "handle" and handle.rest is not None:
            rest, goal = handle.rest, handle.centre
        elif handle.kind == "section":
            sections.append(_section(handle))
            continue
        elif handle.kind == "to":
            continue
        # A handle that was not dragged is a pin, also when its centre was rounded on saving.
        if goal is not None and np.linalg.norm(goal - rest) <= 1e-6 * diagonal:
            goal = None
        points.append(Handle(handle.name, rest, goal, handle.radius))
    return tuple(points), tuple(sections)


def _by_pair(handles: list[HandleObject], kind: str) -> dict[str, HandleObject]:
    result: dict[str, HandleObject] = {}
    for handle in handles:
        if handle.kind != kind:
            continue
        if handle.pair in result:
            raise HandleError(
                f"The handles {result[handle.pair].name} and {handle.name} have the same label. "
                "Give each pair of from and to a name of its own."
            )
        result[handle.pair] = handle
    return result


def _section(handle: HandleObject) -> Section:
    """The affine map from the rest rectangle to the rectangle as it is now."""
    now = handle.corners
    low = now.min(axis=0)
    rest = np.concatenate([low, now.max(axis=0) - low]) if handle.rest is None else handle.rest
    x, y, w, h = rest
    if not (w > 0.0 and h > 0.0):
        raise HandleError(
            f"The section handle {handle.name} has no size. Draw a rectangle around the part it holds."
        )
    if handle.rest is None:
        return Section(handle.name, rest, np.eye(2, 3))
    linear = np.stack([(now[1] - now[0]) / w, (now[3] - now[0]) / h], axis=1)
    return Section(handle.name, rest, np.column_stack([linear, now[0] - linear @ [x, y]]))


def settle(handles: list[HandleObject], keep: bool) -> None:
    """Handles stand on their targets with `rest` updated, or go."""
    goals = {handle.pair: handle for handle in handles if handle.kind == "to"}
    for handle in handles:
        element = handle.element
        if not keep:
            _remove(element)
        elif handle.kind == "from":
            _move_to(handle, goals[handle.pair].centre)
        elif handle.kind == "handle" and handle.rest is not None:
            element.attrib[REST] = _plain(handle.centre)
        elif handle.kind == "section" and handle.rest is not None:
            element.attrib[REST] = _plain(
                np.concatenate([handle.bounds[0], handle.bounds[1] - handle.bounds[0]])
            )


def _remove(element: Element) -> None:
    parent, tail = element.getparent(), element.tail
    if tail and tail.strip():  # stray text between elements belongs to the document
        before = element.getprevious()
        if before is not None:
            before.tail = (before.tail or "") + tail
        else:
            parent.text = (parent.text or "") + tail
    parent.remove(element)


def _move_to(handle: HandleObject, centre: Array) -> None:
    """Shift a handle object so that its centre is at a point of the root's units."""
    shift = np.linalg.inv(handle.matrix[:, :2]) @ (centre - handle.centre)
    if not shift.any():
        return
    element = handle.element
    if local_tag(element) in ("circle", "ellipse"):
        length = length_reader(element, handle.name)
        for attribute, by in zip(("cx", "cy"), shift):
            element.attrib[attribute] = pathdata.number((length(attribute) or 0.0) + by, 9)
        return
    by = f"translate({pathdata.number(shift[0], 9)},{pathdata.number(shift[1], 9)})"
    element.attrib["transform"] = f"{element.attrib.get('transform') or ''} {by}".strip()


def _plain(values: Array) -> str:
    return " ".join(pathdata.number(float(value), 9) for value in values)
