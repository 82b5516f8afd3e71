"""Drawing -> SVG: new path data for the elements that moved, in their own coordinates."""

from __future__ import annotations

import math

import numpy as np

from .. import nodetypes, pathdata, shapes
from ..refit import Refitted
from . import companions, paints
from .carried import carry
from .changes import Changes
from .marks import settle
from .motion import Moved, joined, moved_shape
from .reading import Document
from .tree import INKSCAPE_NS, SODIPODI_NS, Element, Shape, local_tag

# Moves up to this part of the diagonal are the solver's rounding: the element stays as it is.
UNMOVED_OF_DIAGONAL = 1e-7

# Written coordinates are rounded to this part of the diagonal.
ROUNDING_OF_DIAGONAL = 1e-8

# Attributes that make Inkscape draw the path anew from something else than `d`.
_EFFECT, _ORIGINAL = f"{{{INKSCAPE_NS}}}path-effect", f"{{{INKSCAPE_NS}}}original-d"
_LIVE = (_EFFECT, _ORIGINAL, *(f"{{{INKSCAPE_NS}}}{name}" for name in ("flatsided", "rounded", "randomized")))


def write(document: Document, refitted: Refitted, keep_handles: bool, arc_tolerance: float) -> list[str]:
    """Put the new segments into the document; returns the names of the elements that changed.

    arc_tolerance : user units; an elliptical arc that a new arc meets this well stays one.
    """
    drawing = document.drawing
    diagonal = drawing.diagonal
    start = np.searchsorted(refitted.source, np.arange(len(drawing.control) + 1))
    unmoved = UNMOVED_OF_DIAGONAL * diagonal
    moved = {
        id(shape): moved_shape(shape, drawing.control, refitted, start, unmoved) for shape in document.shapes
    }
    changes = Changes(document.styles)
    changed = []
    gone: list[Shape] = []  # shapes of clip paths that stay as they are
    drawn = [shape for shape in document.shapes if shape.origin is shape.element]
    if document.carried and any(moved[id(shape)].changed for shape in drawn):
        points = joined([moved[id(shape)].points for shape in drawn])
        changed += [item.name for item in document.carried if carry(item, points, changes)]
    copied: set[Element] = set()
    loose: list[Shape] = []
    for companion in document.companions:
        if not companions.follow(companion, moved, document.ids, changes):
            gone += companion.shapes
        elif not companion.joins:
            loose += companion.shapes
        copied |= companion.copied
    left = {id(shape) for shape in gone}
    new = [
        (shape, moved[id(shape)])
        for shape in [*document.shapes, *loose]
        if moved[id(shape)].changed and id(shape) not in left
    ]
    paints.follow(new, copied, document.ids, changes)
    lost = document.styles.lost_by_renaming([s.origin for s, _ in new if local_tag(s.element) != "path"])
    for shape, _ in new:
        for name, value in lost.get(shape.origin, {}).items():
            changes.set_property(shape.element, name, value, shape.origin)
    data = [_new_data(shape, motion, diagonal, arc_tolerance) for shape, motion in new]
    # Only now, when nothing can fail any more, the document changes.
    changes.apply()
    for (shape, _), (d, types) in zip(new, data):
        _replace(shape, d, types)
        _flatten_groups(shape.element)
    settle(document.handles, keep_handles)
    return [shape.name for shape, _ in new] + changed


def _new_data(shape: Shape, moved: Moved, diagonal: float, arc_tolerance: float) -> tuple[str, str | None]:
    """Path data and node types of a changed shape."""
    linear = shape.matrix[:, :2]
    inverse = np.linalg.inv(linear)
    largest = float(np.linalg.norm(linear, 2))
    decimals = max(0, math.ceil(-math.log10(ROUNDING_OF_DIAGONAL * diagonal / largest)))
    smallest = float(np.linalg.norm(inverse, 2))
    words: list[str] = []
    types: list[nodetypes.Run] = []
    segment = 0
    for subpath in shape.subpaths:
        count = max(len(subpath.control), 1)
        part = slice(*np.searchsorted(moved.source, (segment, segment + count)))
        control = (moved.control[part] - shape.matrix[:, 2]) @ inverse.T
        source = moved.source[part] - segment
        segment += count
        if not len(subpath.control):
            words.append(pathdata.point_data(control[0, 0], subpath.closed, decimals))
        else:
            pieces = pathdata.Pieces(control, source, moved.line[part])
            words.append(pathdata.subpath_data(subpath, pieces, decimals, arc_tolerance * smallest))
        types.append(nodetypes.Run(subpath, control, source, moved.smooth_start[part]))
    old = shape.element.attrib.get(f"{{{SODIPODI_NS}}}nodetypes")
    return " ".join(words), nodetypes.update(old, types) if old is not None else None


def _flatten_groups(element: Element) -> None:
    """Live effects of groups, which Inkscape would apply anew: their results, the `d`s, stay."""
    for group in list(element.iterancestors()):
        if group.attrib.pop(_EFFECT, None) is not None:
            for part in group.iter("{*}path"):
                if part.attrib.get(_EFFECT) is None:
                    part.attrib.pop(_ORIGINAL, None)


def _replace(shape: Shape, data: str, types: str | None) -> None:
    element = shape.element
    tag = local_tag(element)
    if tag != "path":
        element = _as_path(element, tag)
        shape.element = element
    element.attrib["d"] = data
    key = f"{{{SODIPODI_NS}}}nodetypes"
    if types:
        element.attrib[key] = types
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
            path.attrib[attribute] = value
    path.text, path.tail = element.text, element.tail
    path.extend(list(element))
    parent = element.getparent()
    parent.replace(element, path)
    return path
