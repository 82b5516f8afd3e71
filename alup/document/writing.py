"""Drawing -> SVG: new path data for the elements that moved, in their own coordinates."""

from __future__ import annotations

import math

import numpy as np

from .. import nodetypes, pathdata, shapes
from ..model import Array
from ..refit import Refitted
from .marks import settle
from .reading import Document
from .tree import INKSCAPE_NS, SODIPODI_NS, Element, Shape, local_tag

# Moves up to this part of the diagonal are the solver's rounding: the element stays as it is.
UNMOVED_OF_DIAGONAL = 1e-7

# Written coordinates are rounded to this part of the diagonal.
ROUNDING_OF_DIAGONAL = 1e-8

# Attributes that make Inkscape draw the path anew from something else than `d`.
_LIVE = tuple(
    f"{{{INKSCAPE_NS}}}{name}" for name in ("path-effect", "original-d", "flatsided", "rounded", "randomized")
)


def write(document: Document, refitted: Refitted, keep_handles: bool, arc_tolerance: float) -> list[str]:
    """Put the new segments into the document; returns the names of the elements that changed.

    arc_tolerance : user units; an elliptical arc that a new arc meets this well stays one.
    """
    drawing = document.drawing
    diagonal = drawing.diagonal
    start = np.searchsorted(refitted.source, np.arange(len(drawing.control) + 1))
    changed = []
    new: list[tuple[Shape, str, str | None]] = []
    for shape in document.shapes:
        first, last = shape.segments
        part = slice(start[first], start[last])
        same = start[last] - start[first] == last - first
        if (
            same
            and np.abs(refitted.control[part] - drawing.control[first:last]).max()
            <= UNMOVED_OF_DIAGONAL * diagonal
        ):
            continue
        new.append((shape, *_new_data(shape, refitted, start, diagonal, arc_tolerance)))
        changed.append(shape.name)
    # Only now, when nothing can fail any more, the document changes.
    for shape, data, types in new:
        _replace(shape, data, types)
    settle(document.handles, keep_handles)
    return changed


def _new_data(
    shape: Shape, refitted: Refitted, start: Array, diagonal: float, arc_tolerance: float
) -> tuple[str, str | None]:
    """Path data and node types of a changed shape."""
    linear = shape.matrix[:, :2]
    inverse = np.linalg.inv(linear)
    largest = float(np.linalg.norm(linear, 2))
    decimals = max(0, math.ceil(-math.log10(ROUNDING_OF_DIAGONAL * diagonal / largest)))
    smallest = float(np.linalg.norm(inverse, 2))
    words: list[str] = []
    types: list[nodetypes.Run] = []
    segment = shape.segments[0]
    for subpath in shape.subpaths:
        count = max(len(subpath.control), 1)
        part = slice(start[segment], start[segment + count])
        control = (refitted.control[part] - shape.matrix[:, 2]) @ inverse.T
        source = refitted.source[part] - segment
        segment += count
        if not len(subpath.control):
            words.append(pathdata.point_data(control[0, 0], subpath.closed, decimals))
        else:
            pieces = pathdata.Pieces(control, source, refitted.line[part])
            words.append(pathdata.subpath_data(subpath, pieces, decimals, arc_tolerance * smallest))
        types.append(nodetypes.Run(subpath, control, source, refitted.smooth_start[part]))
    old = shape.element.get(f"{{{SODIPODI_NS}}}nodetypes")
    return " ".join(words), nodetypes.update(old, types) if old is not None else None


def _replace(shape: Shape, data: str, types: str | None) -> None:
    element = shape.element
    tag = local_tag(element)
    if tag != "path":
        element = _as_path(element, tag)
        shape.element = element
    element.set("d", data)
    key = f"{{{SODIPODI_NS}}}nodetypes"
    if types:
        element.set(key, types)
    elif key in element.attrib:
        del element.attrib[key]
    for attribute in list(element.attrib):
        shape_of_its_own = attribute.startswith(f"{{{SODIPODI_NS}}}") and attribute != key
        if attribute in _LIVE or (shape_of_its_own and attribute != f"{{{SODIPODI_NS}}}insensitive"):
            del element.attrib[attribute]


def _as_path(element: Element, tag: str) -> Element:
    """The element as a path: same place, id, style, transform, children and tail."""
    path = element.makeelement(element.tag[: -len(tag)] + "path", nsmap=element.nsmap)
    for attribute, value in element.attrib.items():
        if attribute not in shapes.GEOMETRY[tag]:
            path.set(attribute, value)
    path.text, path.tail = element.text, element.tail
    path.extend(list(element))
    parent = element.getparent()
    parent.replace(element, path)
    return path
