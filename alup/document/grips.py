# SPDX-License-Identifier: GPL-2.0-or-later
"""Conversion between the handle objects of a document and the grips of the live window.

A grip has the point that it holds in the drawing that a run starts from (`rest`), and its target (`now`).
These are the data of a resolved handle, independent of its object.  Grips become objects only for a run.  The
objects are the same as if *Place handles* and a drag by hand had made them, so the run is an ordinary batch
run.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Mapping, Sequence

import numpy as np

from ..model import Array, Handle, Section
from . import handle_marks, handle_targets
from .handles.handle_layer import Layer, Size
from .handles.handle_objects import lay_section, move_to, place_text, read_handle
from .reading import Document
from .tree.elements import AT, LABEL, REST, Element
from .tree.own_objects import KIND, labelled
from .tree.references import Ids

POINT, FRAME = "point", "frame"


@dataclass(frozen=True)
class Grip:
    """A handle of the live window.

    name : unique; kind : POINT or FRAME
    rest, now : (1, 2) of a point, (4, 2) the corners of a frame, root user units
    radius : of the handle's object, root user units
    """

    name: str
    kind: str
    rest: Array
    now: Array
    radius: float

    @property
    def moved(self) -> bool:
        return not np.array_equal(self.rest, self.now)

    def wish(self, diagonal: float) -> Handle | Section:
        """The handle or section for the solver.  diagonal : of the drawing, root user units"""
        if self.kind == FRAME:
            return handle_targets.section_of(self.name, self.rest, self.now)
        return handle_targets.point_of(self.name, self.rest[0], self.now[0], self.radius, diagonal)


@dataclass(frozen=True)
class Standing:
    """The present curves, and the corresponding parts of the drawing that a run starts from.

    now, was : (m, 4, 2) root user units; shape : (m,) int, index into the document's shapes
    transforms : the transform attribute of each shape's element in the drawing that a run starts from, or
        None
    """

    now: Array
    was: Array
    shape: Array
    transforms: tuple[str | None, ...]


def grips_of(document: Document) -> dict[Element, Grip]:
    """The grips of a document that was read, by the element of each handle (the `from` of a pair)."""
    goals = handle_targets.goals_of(document.handles)
    found: dict[Element, Grip] = {}
    for handle in document.handles:
        if handle.no_part or handle.kind == "to" or handle.hold is None:
            continue
        name = f"old{len(found)}"
        if handle.kind == "section":
            found[handle.element] = Grip(name, FRAME, handle.hold, handle.corners, handle.radius)
            continue
        rest, goal = handle.hold[None], handle_targets.goal_of(handle, goals)[None]
        same = np.abs(rest - goal).max() <= handle_targets.SAME_OF_DIAGONAL * document.drawing.diagonal
        found[handle.element] = Grip(name, POINT, rest, rest if same else goal, handle.radius)
    return found


def standing(document: Document) -> Standing:
    """The present curves of a document and their origins.  The document is unchanged afterwards."""
    drawing = document.drawing
    if not document.run_start.again:
        transforms = tuple(shape.element.attrib.get("transform") for shape in document.shapes)
        return Standing(drawing.control, drawing.control, drawing.shape, transforms)
    document.run_start.undo_log.toggle()  # puts the originals back
    try:
        pairs = document.ground.pairs()
        transforms = tuple(shape.element.attrib.get("transform") for shape in document.shapes)
    finally:
        document.run_start.undo_log.toggle()
    shape = np.repeat(np.arange(len(pairs)), [len(now) for now, _ in pairs])
    now, was = (np.concatenate(part) for part in zip(*pairs))
    return Standing(now, was, shape, transforms)


def put(
    svg: Element, grips: Sequence[Grip], known: Mapping[str, Element], before: Mapping[str, Grip], size: Size
) -> None:
    """Make the handles of a document agree with these grips.

    known : the elements in `svg` of grips that the document had; before : the state of these grips, by name
    size : of new handles
    """
    wanted = {grip.name: grip for grip in grips}
    gone = [element for name, element in known.items() if name not in wanted]
    if gone:
        handle_marks.remove(svg, gone)
    handles = {element: read_handle(element, label) for element, label in labelled(svg)}
    goals = {handle.pair: handle for handle in handles.values() if handle.kind == "to"}
    for name, element in known.items():
        if name not in wanted or np.array_equal(wanted[name].now, before[name].now):
            continue
        grip, handle = wanted[name], handles[element]
        if handle.kind == "section":
            lay_section(handle, grip.now)
        elif handle.kind == "from":
            move_to(goals[handle.pair], grip.now[0])
        else:
            move_to(handle, grip.now[0])
            if handle.kind == "pin" or handle.rest is None:  # a pin is dragged for the first time
                element.attrib[LABEL] = "alup:handle"
                element.attrib[REST] = place_text(grip.rest[0])
                for attribute in (KIND, AT):
                    element.attrib.pop(attribute, None)
    layer, ids = Layer(svg, size), Ids(svg)
    for grip in grips:
        if grip.name not in known:
            _add(svg, grip, layer, ids)


def _add(svg: Element, grip: Grip, layer: Layer, ids: Ids) -> None:
    """Add a handle as if it had been placed at its rest and dragged from there."""
    if grip.kind == POINT:
        layer.add_point(ids, grip.rest[0], grip.rest[0])
    else:
        bounds = np.array([grip.rest.min(axis=0), grip.rest.max(axis=0)])
        layer.add_section(ids, bounds, bounds)
    added = Ids(svg).elements[layer.added[-1]]
    handle = read_handle(added, added.attrib[LABEL])
    if grip.kind == POINT:
        move_to(handle, grip.now[0])
    elif grip.moved:
        lay_section(handle, grip.now)
