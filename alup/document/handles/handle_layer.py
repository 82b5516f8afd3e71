# SPDX-License-Identifier: GPL-2.0-or-later
"""The layer of the handles, and the objects in it: circles, rectangles of sections, arrows, notes.

A handle is a circle centred on a point of a curve.  Its `alup:rest` is the position of that point in the
drawing that a run starts from.  A handle that was not dragged is a pin.  Pins are red, moved handles blue; a
white rim keeps both visible on any fill.  Arrows from rest to handle are in a group of the same layer.  The
group's label begins with `alup:`, so they are never reshaped or taken for handles.
"""

from __future__ import annotations

import math
import textwrap
from dataclasses import dataclass
from typing import Sequence

import numpy as np

from ...handles import candidates
from ...model import Array
from ...svg import path_data
from ..tree.css import with_property
from ..tree.elements import (
    ALUP_NS,
    AT,
    INKSCAPE_NS,
    LABEL,
    REST,
    SODIPODI_NS,
    Element,
    local_tag,
    own_matrix,
    parent_matrix,
    tag_of,
    transform_text,
)
from ..tree.own_objects import ARROW, ARROWS_LABEL, GROUP, GROUPS, LAYER_LABEL, NOTES_LABEL, is_group
from ..tree.references import Ids
from .handle_objects import HandleObject

# Colours of Inkscape's palette.  They differ in brightness as well, for users who can't distinguish red.
STAYS, MOVED, RIM = "#d40000", "#0055d4", "#ffffff"

# A frame has no rim, so its dashes have colours that are visible on white, black, grey, red and blue.
FRAME_STAYS, FRAME_MOVED = "#ff00ff", "#00c8c8"

# Widths as parts of the radius: the rim, half of which is outside; an arrow's shaft; a section's dashes and
# gaps.
RIM_OF_RADIUS = SHAFT_OF_RADIUS = 1.0 / 3.0
DASH_OF_RADIUS, GAP_OF_RADIUS = 1.5, 0.75

# Font size of notes, in radii; line distance and mean width of a letter of a wide typeface, in font sizes.
NOTE_OF_RADIUS, LINE_OF_NOTE, WIDTH_OF_LETTER = 3.0, 1.4, 0.6

# Least number of letters in a line of a note.  Shorter lines above a narrow drawing would form a column.
FEWEST_LETTERS = 40

# Coordinates are rounded to this part of the diagonal, far less than the tolerance of comparisons of handles.
ROUNDING_OF_DIAGONAL = 1e-9

# A handle counts as moved if it is farther from its rest than this part of its radius.
MOVED_OF_RADIUS = 1e-3

_NSMAP = {"alup": ALUP_NS, "inkscape": INKSCAPE_NS, "sodipodi": SODIPODI_NS}
_CURRENT_LAYER = f"{{{INKSCAPE_NS}}}current-layer"
_GROUPMODE, _LOCKED = f"{{{INKSCAPE_NS}}}groupmode", f"{{{SODIPODI_NS}}}insensitive"

# Inherited properties that would make a handle hard to see.
_PLAIN = "fill-opacity:1;stroke-opacity:1;stroke-dasharray:none"


@dataclass(frozen=True)
class Size:
    """The size of handles, root user units.  diagonal : of all visible shapes; radius : of the handles"""

    diagonal: float
    radius: float


def is_moved(handle: HandleObject) -> bool:
    """Whether a handle is not at its rest."""
    if handle.kind in ("handle", "section") and handle.rest is not None:
        now = handle.corners if handle.kind == "section" else handle.centre
        return bool(np.abs(now - handle.rest).max() > MOVED_OF_RADIUS * handle.radius)
    return handle.kind in ("from", "to")


class Layer:
    """The layer of the handles; it is made if it is missing, else shown and unlocked."""

    def __init__(self, svg: Element, size: Size):
        self.added: list[str] = []
        self._svg, self._size = svg, size
        self._decimals = max(0, math.ceil(-math.log10(ROUNDING_OF_DIAGONAL * size.diagonal)))
        self._element: Element | None = None
        self._inverse: Array = np.eye(3)
        self._find()

    def _find(self) -> None:
        for element in self._svg.iter():
            if not is_group(element, LAYER_LABEL):
                continue
            matrix = parent_matrix(element) @ own_matrix(element)
            if np.linalg.det(matrix) == 0.0:
                continue  # singular transform: nothing in it is visible
            element.attrib.pop(_LOCKED, None)
            element.attrib.pop("display", None)
            style = element.attrib.get("style")
            if style and "display" in style:
                element.attrib["style"] = with_property(style, "display", "inline")
            self._element, self._inverse = element, np.linalg.inv(matrix)
            _leave_layer(self._svg)
            return

    def _layer(self, ids: Ids) -> Element:
        if self._element is None:
            self._element = self._made(self._svg, "g", ids.new("alup-handles"))
            self._element.attrib.update({LABEL: LAYER_LABEL, GROUP: GROUPS[LAYER_LABEL]})
            self._element.attrib[_GROUPMODE] = "layer"
            self._element.text = self._element.tail = "\n"
            self._svg.append(self._element)
            _leave_layer(self._svg)
        return self._element

    def add_point(self, ids: Ids, at: Array, rest: Array) -> None:
        x, y = self._text(at)
        circle = self._handle(ids, "circle", "alup:handle", rest)
        circle.attrib.update({AT: f"{x} {y}", "cx": x, "cy": y, "r": self._number(self._size.radius)})
        rim = self._number(RIM_OF_RADIUS * self._size.radius)
        colour = STAYS if np.linalg.norm(at - rest) <= MOVED_OF_RADIUS * self._size.radius else MOVED
        circle.attrib["style"] = f"fill:{colour};stroke:{RIM};stroke-width:{rim};{_PLAIN}"

    def add_section(self, ids: Ids, now: Array, rest: Array) -> None:
        """now, rest : (2, 2) least and greatest x, y"""
        rect = self._handle(ids, "rect", "alup:section", np.concatenate([rest[0], rest[1] - rest[0]]))
        values = self._text(np.concatenate([now[0], now[1] - now[0]]))
        rect.attrib.update({AT: " ".join(values), **dict(zip(("x", "y", "width", "height"), values))})
        parts = (RIM_OF_RADIUS, DASH_OF_RADIUS, GAP_OF_RADIUS)
        line, dash, gap = (self._number(part * self._size.radius) for part in parts)
        colour = FRAME_STAYS if np.array_equal(now, rest) else FRAME_MOVED
        rect.attrib["style"] = (
            f"fill:none;stroke:{colour};stroke-width:{line};stroke-opacity:1;stroke-dasharray:{dash},{gap}"
        )

    def add_arrow(self, ids: Ids, handle: HandleObject) -> None:
        rest, radius = handle.rest, handle.radius
        assert rest is not None
        if handle.kind == "section":
            rest, radius = rest.mean(axis=0), 0.0
        outline = candidates.arrow(rest, handle.centre, radius, SHAFT_OF_RADIUS * self._size.radius)
        if outline is None:
            return
        layer = self._layer(ids)
        group = next((part for part in layer if is_group(part, ARROWS_LABEL)), None)
        if group is None:
            group = self._group(layer, ids, ARROWS_LABEL)
        path = self._made(group, "path", ids.new("alup-arrow"))
        path.attrib[LABEL] = f"arrow of {handle.element.attrib.get('id') or handle.name}"
        path.attrib[ARROW] = handle.element.attrib.get("id") or ""
        path.attrib["d"] = "M " + " L ".join(",".join(self._text(point)) for point in outline) + " Z"
        rim = self._number(0.5 * RIM_OF_RADIUS * self._size.radius)
        path.attrib["style"] = f"fill:{MOVED};stroke:{RIM};stroke-width:{rim};paint-order:stroke;{_PLAIN}"
        path.tail = "\n"
        group.append(path)

    def wrapped(self, note: str, width: float) -> list[str]:
        """The note divided into lines that fit a width, root user units."""
        letters = max(int(width / (WIDTH_OF_LETTER * self._note_size)), FEWEST_LETTERS)
        return textwrap.wrap(note, letters, break_on_hyphens=False)

    def height_of(self, count: int) -> float:
        """The height of some lines with the margin around them, root user units."""
        return (count + 1) * LINE_OF_NOTE * self._note_size

    @property
    def _note_size(self) -> float:
        return NOTE_OF_RADIUS * self._size.radius

    def add_notes(self, ids: Ids, notes: Sequence[Sequence[str]], corner: Array) -> None:
        """Write notes, each a list of lines, below and to the right of a point (2,)."""
        layer = self._layer(ids)
        group = self._group(layer, ids, NOTES_LABEL)
        size = self._note_size
        down = 1
        for lines in notes:
            text = self._made(group, "text", ids.new("alup-note"))
            text.attrib["style"] = (
                f"font-size:{self._number(size)}px;font-family:sans-serif;fill:{STAYS};stroke:none;"
                f"text-anchor:start;{_PLAIN}"
            )
            for line in lines:
                part = self._made(text, "tspan", ids.new("alup-line"))
                part.attrib["x"], part.attrib["y"] = self._text(corner + [0.0, down * LINE_OF_NOTE * size])
                part.text, part.tail = line, " "
                text.append(part)
                down += 1
            text[-1].tail = None
            text.tail = "\n"
            group.append(text)

    def _group(self, layer: Element, ids: Ids, label: str) -> Element:
        """A locked group at the bottom of the layer, with root user units as its coordinates."""
        group = self._made(layer, "g", ids.new(f"alup-{GROUPS[label]}"))
        group.attrib.update({LABEL: label, GROUP: GROUPS[label], _LOCKED: "true"})
        self._compensate(group)
        group.text = group.tail = "\n"
        layer.insert(0, group)
        return group

    def _handle(self, ids: Ids, tag: str, label: str, rest: Array) -> Element:
        layer = self._layer(ids)
        element = self._made(layer, tag, ids.new(label.replace(":", "-")))
        element.attrib[LABEL] = label
        element.attrib[REST] = " ".join(self._text(rest))
        self._compensate(element)
        element.tail = "\n"
        # A frame goes below the circles, which it would cover.
        above = (
            [other for other in layer if other.attrib.get(LABEL) == "alup:handle"] if tag == "rect" else []
        )
        layer.insert(layer.index(above[0]) if above else len(layer), element)
        self.added.append(element.attrib["id"])
        return element

    def _made(self, parent: Element, tag: str, identity: str) -> Element:
        """A new element in the namespace of the root; the root of old files has none."""
        root = tag_of(self._svg)
        element = parent.makeelement(root[: root.rindex("}") + 1 if "}" in root else 0] + tag, nsmap=_NSMAP)
        element.attrib["id"] = identity
        return element

    def _compensate(self, element: Element) -> None:
        """Cancel the layer's transforms, so that the element has root user units."""
        if not np.allclose(self._inverse, np.eye(3), rtol=0.0, atol=1e-12):
            element.attrib["transform"] = transform_text(self._inverse)

    def _number(self, value: float) -> str:
        return path_data.number(float(value), self._decimals)

    def _text(self, values: Array) -> list[str]:
        return [self._number(value) for value in values]


def _leave_layer(svg: Element) -> None:
    """Make a layer of the user the current one if ours is, or if ours would become it as the topmost one.

    New objects go into the current layer, and Edit > Select All selects its contents.  A click on a handle
    makes our layer the current one.  The layer chosen instead is the one with which Inkscape opens a file
    that names none: the topmost, or the drawing itself if there is no layer.  The current layer is stored in
    the named view, which Inkscape makes for every drawing that it opens.  Without it nothing is changed.
    """
    view = next((part for part in svg if part.tag == f"{{{SODIPODI_NS}}}namedview"), None)
    if view is None:
        return
    ids = Ids(svg)
    current = ids.get(view.attrib.get(_CURRENT_LAYER))
    if current is not None and (current is svg or local_tag(current) == "g"):
        ours = any(is_group(part, LAYER_LABEL) for part in (current, *current.iterancestors()))
        if not ours:
            return
    layers = [part for part in svg if local_tag(part) == "g" and part.attrib.get(_GROUPMODE) == "layer"]
    others = [part for part in layers if not is_group(part, LAYER_LABEL)]
    home = others[-1] if others else svg
    if not home.attrib.get("id"):
        home.attrib["id"] = ids.new("layer" if others else "svg")
    view.attrib[_CURRENT_LAYER] = home.attrib["id"]
