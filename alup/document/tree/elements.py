# SPDX-License-Identifier: GPL-2.0-or-later
"""The XML tree: names, transforms, lengths, shapes as path data.

Elements are lxml's.  inkex gives its own class only to elements in the SVG namespace, which is missing in a
fifth of all files.  Attributes are always read and set through `element.attrib`: inkex's `get` and `set`
rewrite transforms and styles with six digits, even if they are only read.
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
# Attributes that a run writes: see `stored_records`, `fingerprints` and `originals`.
ORIGINAL, WRITTEN, COPY = (f"{{{ALUP_NS}}}{name}" for name in ("original", "written", "copy"))
UNMOVED = f"{{{ALUP_NS}}}unmoved"
# Mark of an element that was edited between two runs: its original is younger than those of the others.
EDITED = f"{{{ALUP_NS}}}edited"
INKSCAPE_NS = "http://www.inkscape.org/namespaces/inkscape"
SODIPODI_NS = "http://sodipodi.sourceforge.net/DTD/sodipodi-0.dtd"
SVG_NS = "http://www.w3.org/2000/svg"
# Containers, which are drawn only through their children.
CONTAINERS = ("g", "a", "switch")
# Drawn elements that are not curves.
CARRIED = ("text", "image", "flowRoot", "foreignObject")
# Drawn elements that are moved by their transform.
WHOLE = (*CARRIED, "use")

LABEL = f"{{{INKSCAPE_NS}}}label"

# Greater coordinates are refused: they leave too few digits, and no drawing made by hand has them.
LARGEST_COORDINATE = 1e9

# Limits of the factors of transforms.  Products of a few factors, and their squares, do not overflow.  A
# smaller factor makes the drawing a point.
LARGEST_FACTOR, SMALLEST_FACTOR = 1e30, 1e-30

# The patterns are unambiguous, so no text causes backtracking.
_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
_LENGTH = re.compile(rf"({_NUMBER})\s*(px|pt|pc|mm|cm|in|%|)$")
# inkex silently ignores transforms that it does not know; here they are refused.
_TRANSFORM = re.compile(
    r"(?:(?:matrix|translate|scale|rotate|skewX|skewY)\s*\([\s,]*"
    rf"(?:{_NUMBER}(?![\d.eE])[\s,]*)+\)[\s,]*)+$"
)
_PX = {"": 1.0, "px": 1.0, "pt": 4.0 / 3.0, "pc": 16.0, "mm": 96.0 / 25.4, "cm": 96.0 / 2.54, "in": 96.0}


@dataclass
class Shape:
    """An element that is reshaped.

    matrix : (2, 3) own coordinates -> root user units; subpaths : in own coordinates
    segments : range [first, last) of the drawing's segments, empty for a shape that follows others
    origin : the element of the document that `element` is a copy of, or `element` itself
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
        """The decimals of own coordinates for a rounding that is given in root user units."""
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
    """The tag with its namespace; the element must not be a comment or an entity."""
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
    """The tag without its namespace."""
    if not isinstance(tag, str):
        return ""
    if tag.startswith("{"):
        return tag.split("}", 1)[1] if tag.startswith(f"{{{SVG_NS}}}") else ""
    return tag


def name_of(element: Element) -> str:
    """The element's name in messages."""
    label = element.attrib.get(LABEL)
    identity = element.attrib.get("id")
    if not identity:
        identity = _("a {tag} without an id").format(tag=local_tag(element) or "node")
    return f"{identity} (\u201c{label}\u201d)" if label else identity


def geometry_of(element: Element) -> tuple[str, ...]:
    """The geometry attributes of the element; in SVG 2 they are properties as well."""
    tag = local_tag(element)
    if tag in ("image", "use"):
        return ("x", "y", "width", "height")
    return ("d",) if tag == "path" else basic_shapes.GEOMETRY.get(tag, ())


def own_matrix(element: Element, attribute: str = "transform", text: str | None = None) -> Array:
    """The matrix (3, 3) of the element's transform attribute, also of a gradient or pattern.

    text : a value to use instead of the attribute's.  Raises DocumentError if it can't be read.
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
    """The matrix (3, 3) from the coordinates of the element's parent to root user units."""
    matrix = np.eye(3)
    parent = element.getparent()
    while parent is not None and parent.getparent() is not None:
        matrix = own_matrix(parent) @ matrix
        parent = parent.getparent()
    return matrix


def is_squashed(matrix: Array) -> bool:
    """Whether a (2, 3) or (3, 3) matrix is singular: it maps everything to a line or a point."""
    linear = matrix[:2, :2]
    largest = float(np.abs(linear).max())
    return largest < SMALLEST_FACTOR or abs(float(np.linalg.det(linear))) < 1e-12 * largest**2


def transform_text(matrix: Array) -> str:
    """A (3, 3) matrix as a transform attribute, at full precision."""
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
    """Least and greatest x, y of the page, (2, 2) root user units: viewBox, else size; None without."""
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
    """The length of 100 %: a side of the viewBox or page; for radii of circles the mean of the sides."""
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
