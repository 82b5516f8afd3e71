# SPDX-License-Identifier: GPL-2.0-or-later
"""The XML tree: names, transforms, lengths, shapes as path data.

Elements are lxml's; inkex gives its own class only to those with the SVG namespace, which a fifth of the
files in the wild have not.  Attributes are read and set by `element.attrib` throughout: inkex's `get` and
`set` write transforms and styles anew, with six digits, even where they are only read.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np
from inkex import Transform
from lxml import etree

from ...messages.errors import DocumentError
from ...messages.language import translate as _
from ...model import Array
from ...svg import basic_shapes, path_data

Element = etree._Element

ALUP_NS = "https://alup-reshape.github.io/ns"
REST, AT = f"{{{ALUP_NS}}}rest", f"{{{ALUP_NS}}}at"
# What a run leaves behind: see `stored_records`, `fingerprints` and `originals`.
ORIGINAL, WRITTEN, COPY = (f"{{{ALUP_NS}}}{name}" for name in ("original", "written", "copy"))
UNMOVED = f"{{{ALUP_NS}}}unmoved"
# On what was edited between two runs: its original is of another moment than those of the others.
EDITED = f"{{{ALUP_NS}}}edited"
INKSCAPE_NS = "http://www.inkscape.org/namespaces/inkscape"
SODIPODI_NS = "http://sodipodi.sourceforge.net/DTD/sodipodi-0.dtd"
SVG_NS = "http://www.w3.org/2000/svg"
# Elements that hold others and are drawn themselves by their children only.
CONTAINERS = ("g", "a", "switch")
# Elements that are drawn and are not curves.
CARRIED = ("text", "image", "flowRoot", "foreignObject")
# Elements that are drawn and moved by their transform.
WHOLE = (*CARRIED, "use")

LABEL = f"{{{INKSCAPE_NS}}}label"

# Coordinates beyond this leave no digits for a drawing; nothing that is drawn by hand comes near.
LARGEST_COORDINATE = 1e9

# Of transforms: products of a few of them, and their squares, are still numbers.  What is smaller is a point.
LARGEST_FACTOR, SMALLEST_FACTOR = 1e30, 1e-30

# There is one way only for these to match, so that no text makes them try many.
_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
_LENGTH = re.compile(rf"({_NUMBER})\s*(px|pt|pc|mm|cm|in|%|)$")
# inkex leaves out what it doesn't know without a word.
_TRANSFORM = re.compile(
    r"(?:(?:matrix|translate|scale|rotate|skewX|skewY)\s*\([\s,]*"
    rf"(?:{_NUMBER}(?![\d.eE])[\s,]*)+\)[\s,]*)+$"
)
_PX = {"": 1.0, "px": 1.0, "pt": 4.0 / 3.0, "pc": 16.0, "mm": 96.0 / 25.4, "cm": 96.0 / 2.54, "in": 96.0}


@dataclass
class Shape:
    """An element that is reshaped.

    matrix : (2, 3) own coordinates -> root user units; subpaths in own coordinates; segments : of
    the drawing, [first, last), none for a shape that follows others; origin : the element of the document
    that `element` is a copy of, or itself
    """

    element: Element
    name: str
    matrix: Array
    subpaths: tuple[path_data.Subpath, ...]
    origin: Element
    segments: tuple[int, int] = (0, 0)

    @property
    def affine(self) -> Array:
        """(3, 3) the matrix."""
        return np.vstack([self.matrix, [0.0, 0.0, 1.0]])

    def decimals(self, rounding: float) -> int:
        """How many its own coordinates need where they are rounded to this, in root user units."""
        largest = float(np.linalg.norm(self.matrix[:, :2], 2))
        return max(0, math.ceil(-math.log10(rounding / largest)))

    @property
    def control(self) -> Array:
        """(s, 4, 2) all segments in root user units; a lone point is a segment without length."""
        own = [s.control if len(s.control) else np.tile(s.start, (1, 4, 1)) for s in self.subpaths]
        return np.concatenate(own) @ self.matrix[:, :2].T + self.matrix[:, 2]

    @property
    def line(self) -> Array:
        """(s,) bool, whether each segment is a line."""
        lines = [
            np.isin(s.kind, (path_data.LINE, path_data.CLOSE)) if len(s.control) else np.ones(1, dtype=bool)
            for s in self.subpaths
        ]
        return np.concatenate(lines)


def tag_of(element: Element) -> str:
    """The tag with its namespace, of an element that is no comment and no entity."""
    assert isinstance(element.tag, str)
    return element.tag


def parent_of(element: Element) -> Element:
    """The parent of an element that is not the root."""
    parent = element.getparent()
    assert parent is not None
    return parent


def local_tag(element: Element) -> str:
    """Tag without namespace; "" for comments, processing instructions and foreign elements."""
    return local_name(element.tag)


def local_name(tag: object) -> str:
    """The same of a tag."""
    if not isinstance(tag, str):
        return ""
    if tag.startswith("{"):
        return tag.split("}", 1)[1] if tag.startswith(f"{{{SVG_NS}}}") else ""
    return tag


def name_of(element: Element) -> str:
    """What a message calls the element."""
    label = element.attrib.get(LABEL)
    identity = element.attrib.get("id")
    if not identity:
        identity = _("a {tag} without an id").format(tag=local_tag(element) or "node")
    return f"{identity} (\u201c{label}\u201d)" if label else identity


def geometry_of(element: Element) -> tuple[str, ...]:
    """Attributes that say where the element is; in SVG 2 they are properties too."""
    tag = local_tag(element)
    if tag in ("image", "use"):
        return ("x", "y", "width", "height")
    return ("d",) if tag == "path" else basic_shapes.GEOMETRY.get(tag, ())


def own_matrix(element: Element, attribute: str = "transform", text: str | None = None) -> Array:
    """(3, 3) of the element's own transform attribute, or of a gradient's or pattern's.

    text : another value of the attribute
    """
    matrix = np.eye(3)
    text = ((element.attrib.get(attribute) if text is None else text) or "").strip()
    if text and text != "none":
        if not _TRANSFORM.match(text):
            raise _unreadable(element, attribute, text)
        try:
            matrix[:2] = Transform(text).matrix
        except (ValueError, TypeError) as error:
            raise _unreadable(element, attribute, text) from error
        if not np.abs(matrix).max() <= LARGEST_FACTOR:
            raise _unreadable(element, attribute, text)
    return matrix


def _unreadable(element: Element, attribute: str, text: str) -> DocumentError:
    message = _("The {attribute} of {name} can't be read ({text}). Correct it in the XML editor.")
    return DocumentError(message.format(attribute=attribute, name=name_of(element), text=text[:40]))


def parent_matrix(element: Element) -> Array:
    """(3, 3) from the coordinates of the element's parent to root user units."""
    matrix = np.eye(3)
    parent = element.getparent()
    while parent is not None and parent.getparent() is not None:
        matrix = own_matrix(parent) @ matrix
        parent = parent.getparent()
    return matrix


def is_squashed(matrix: Array) -> bool:
    """Whether a (2, 3) or (3, 3) matrix makes a line or a point of everything."""
    linear = matrix[:2, :2]
    largest = float(np.abs(linear).max())
    return largest < SMALLEST_FACTOR or abs(float(np.linalg.det(linear))) < 1e-12 * largest**2


def transform_text(matrix: Array) -> str:
    """A (3, 3) matrix as a transform attribute, with all digits that matter."""
    a, c, e, b, d, f = (float(value) + 0.0 for value in matrix[:2].ravel())
    if (a, b, c, d) == (1.0, 0.0, 0.0, 1.0):
        return f"translate({e:.12g},{f:.12g})"
    return f"matrix({a:.12g},{b:.12g},{c:.12g},{d:.12g},{e:.12g},{f:.12g})"


def length_reader(element: Element, name: str) -> basic_shapes.Length:
    def length(attribute: str) -> float | None:
        text = (element.attrib.get(attribute) or "").strip()
        if not text or text == "auto":
            return None
        found = _LENGTH.match(text)
        unit = found.group(2) if found else ""
        if found and unit == "%":
            whole = viewport_length(element, attribute)
            if whole is not None:
                return float(found.group(1)) / 100.0 * whole
        if not found or unit == "%":
            raise DocumentError(
                _(
                    "{name}: its {attribute} is {text!r}, which is not a length that can be reshaped. "
                    "Convert it with Path > Object to Path."
                ).format(name=name, attribute=attribute, text=text[:30])
            )
        return float(found.group(1)) * _PX[unit]

    return length


def page_of(root: Element) -> Array | None:
    """(2, 2) least and greatest x, y of the page, root user units: viewBox, else size; None without."""
    box = re.findall(r"[^\s,]+", root.attrib.get("viewBox") or "")
    try:
        if len(box) == 4:
            x, y, width, height = (float(number) for number in box)
        else:
            sides = [_LENGTH.match((root.attrib.get(side) or "").strip()) for side in ("width", "height")]
            x, y = 0.0, 0.0
            width, height = (float(side.group(1)) * _PX[side.group(2)] for side in sides if side)
    except (ValueError, KeyError):
        return None
    page = np.array([[x, y], [x + width, y + height]])
    return page if np.isfinite(page).all() else None


def viewport_length(element: Element, attribute: str) -> float | None:
    """What 100 % is: a side of the drawing's viewBox or page, for radii of circles the mean of the sides."""
    page = page_of(element.getroottree().getroot())
    if page is None:
        return None
    width, height = (float(side) for side in page[1] - page[0])
    if attribute in ("x", "width", "cx", "rx", "x1", "x2"):
        return width
    if attribute in ("y", "height", "cy", "ry", "y1", "y2"):
        return height
    return float(np.hypot(width, height) / np.sqrt(2.0))


def outline_of(element: Element, name: str) -> str:
    """The path data of a path or shape."""
    tag = local_tag(element)
    if tag == "path":
        return element.attrib.get("d") or ""
    return basic_shapes.path_data(tag, length_reader(element, name), element.attrib.get("points") or "")


def read_shape(element: Element, matrix: Array) -> Shape:
    name = name_of(element)
    try:
        subpaths = path_data.parse(outline_of(element, name))
    except DocumentError as error:
        message = str(error)
        if not message.startswith(name):
            message = _("{name}: {what}. Correct it in the XML editor or delete the object.").format(
                name=name, what=message
            )
        raise DocumentError(message) from error
    for subpath in subpaths:
        points = np.concatenate([subpath.control.reshape(-1, 2), subpath.start[None]])
        with np.errstate(over="ignore", invalid="ignore"):
            points = points @ matrix[:, :2].T + matrix[:, 2]
        if not np.isfinite(points).all() or np.abs(points).max() > LARGEST_COORDINATE:
            raise DocumentError(
                _(
                    "{name}: a coordinate is not a number or beyond {largest:.0e}. "
                    "Correct it in the XML editor or delete the object."
                ).format(name=name, largest=LARGEST_COORDINATE)
            )
    return Shape(element, name, matrix, subpaths, origin=element)
