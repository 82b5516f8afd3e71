"""The XML tree: names, transforms, lengths, shapes as path data.

Elements are lxml's; inkex gives its own class only to those with the SVG namespace, which a fifth of the
files in the wild have not.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from inkex import Transform

from .. import pathdata, shapes
from ..errors import DocumentError
from ..model import Array

Element = Any  # lxml.etree._Element, which has no types

ALUP_NS = "https://alup-reshape.github.io/ns"
REST = f"{{{ALUP_NS}}}rest"
INKSCAPE_NS = "http://www.inkscape.org/namespaces/inkscape"
SODIPODI_NS = "http://sodipodi.sourceforge.net/DTD/sodipodi-0.dtd"
SVG_NS = "http://www.w3.org/2000/svg"
# Elements that hold others and are drawn themselves by their children only.
CONTAINERS = ("g", "a", "switch")

LABEL = f"{{{INKSCAPE_NS}}}label"

# Coordinates beyond this leave no digits for a drawing; nothing that is drawn by hand comes near.
LARGEST_COORDINATE = 1e9

_PX = {"": 1.0, "px": 1.0, "pt": 4.0 / 3.0, "pc": 16.0, "mm": 96.0 / 25.4, "cm": 96.0 / 2.54, "in": 96.0}


@dataclass
class Shape:
    """An element that is reshaped.

    matrix : (2, 3) own coordinates -> root user units; subpaths in own coordinates; segments : of
    the drawing, [first, last)
    """

    element: Element
    name: str
    matrix: Array
    subpaths: tuple[pathdata.Subpath, ...]
    segments: tuple[int, int] = (0, 0)


def local_tag(element: Element) -> str:
    """Tag without namespace; "" for comments, processing instructions and foreign elements."""
    tag = element.tag
    if not isinstance(tag, str):
        return ""
    if tag.startswith("{"):
        return tag.split("}", 1)[1] if tag.startswith(f"{{{SVG_NS}}}") else ""
    return tag


def name_of(element: Element) -> str:
    """What a message calls the element."""
    label = element.get(LABEL)
    identity = element.get("id") or f"a {local_tag(element) or 'node'} without an id"
    return f"{identity} (\u201c{label}\u201d)" if label else identity


def own_matrix(element: Element) -> Array:
    """(3, 3) of the element's own transform attribute."""
    matrix = np.eye(3)
    text = element.get("transform")
    if text:
        try:
            matrix[:2] = Transform(text).matrix
        except ValueError as error:
            raise DocumentError(
                f"The transform of {name_of(element)} can't be read ({text[:40]}). "
                "Correct it in the XML editor."
            ) from error
    return matrix


def parent_matrix(element: Element) -> Array:
    """(3, 3) from the coordinates of the element's parent to root user units."""
    matrix = np.eye(3)
    parent = element.getparent()
    while parent is not None and parent.getparent() is not None:
        matrix = own_matrix(parent) @ matrix
        parent = parent.getparent()
    return matrix


def style_of(element: Element, name: str) -> str | None:
    """A property from the style attribute or the presentation attribute."""
    found = re.search(rf"(?:^|;)\s*{name}\s*:\s*([^;!]+)", element.get("style") or "")
    return found.group(1).strip() if found else element.get(name)


def length_reader(element: Element, name: str) -> shapes.Length:
    def length(attribute: str) -> float | None:
        text = (element.get(attribute) or "").strip()
        if not text or text == "auto":
            return None
        found = re.match(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(px|pt|pc|mm|cm|in|)$", text)
        if not found:
            raise DocumentError(
                f"{name}: its {attribute} is {text[:30]!r}, which is not a length that can be reshaped. "
                "Convert it with Path > Object to Path."
            )
        return float(found.group(1)) * _PX[found.group(2)]

    return length


def read_shape(element: Element, matrix: Array) -> Shape:
    name = name_of(element)
    tag = local_tag(element)
    try:
        if tag == "path":
            data = element.get("d") or ""
        else:
            data = shapes.path_data(tag, length_reader(element, name), element.get("points") or "")
        subpaths = pathdata.parse(data)
    except DocumentError as error:
        message = str(error)
        if not message.startswith(name):
            message = f"{name}: {message}. Correct it in the XML editor or delete the object."
        raise DocumentError(message) from error
    for subpath in subpaths:
        points = np.concatenate([subpath.control.reshape(-1, 2), subpath.start[None]])
        with np.errstate(over="ignore", invalid="ignore"):
            points = points @ matrix[:, :2].T + matrix[:, 2]
        if not np.isfinite(points).all() or np.abs(points).max() > LARGEST_COORDINATE:
            raise DocumentError(
                f"{name}: a coordinate is not a number or beyond {LARGEST_COORDINATE:.0e}. "
                "Correct it in the XML editor or delete the object."
            )
    return Shape(element, name, matrix, subpaths)
