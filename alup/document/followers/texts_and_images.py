# SPDX-License-Identifier: GPL-2.0-or-later
"""Texts and images move as a whole with the curves around them, by their transform.

The scale is that of the best-fitting similarity, so letters are not distorted.  The centre of the text or
image moves by the best-fitting scale and shift of each axis instead.  If a label was only made wider, the
similarity would scale its height as well, and would shift a text vertically that is not at the centre of the
curves.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np
from lxml import etree

from ...messages.errors import DocumentError
from ...model import Array
from ...svg import basic_shapes
from ..tree.elements import (
    Element,
    geometry_of,
    length_reader,
    local_tag,
    name_of,
    own_matrix,
    read_shape,
    transform_text,
)
from ..tree.pending_changes import Changes
from ..tree.references import Ids, referred
from ..tree.styles import Styles
from .motion import SAME, Points, axis_aligned, near, similarity

# Typical width of a letter, and the heights above and below the baseline, in font sizes.
_LETTER, _ABOVE, _BELOW = 0.55, 0.75, 0.2

# Radius of the neighbourhood of an object without an extent, as a part of the diagonal of the curves.
_NEIGHBOURHOOD = 0.02

# Sizes of CSS keywords in px.  The default of programs is `medium`.
_NAMED_SIZES = {
    "xx-small": 9.6, "x-small": 12.0, "small": 14.2, "medium": 16.0, "large": 19.2, "x-large": 24.0,
    "xx-large": 32.0,
}  # fmt: skip

_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)")

_CSS_PATH = re.compile(r"\s*path\(\s*(['\"])(.*)\1\s*\)\s*$", re.DOTALL)


@dataclass(frozen=True)
class Carried:
    """A drawn object without curves.

    outer : (3, 3) coordinates of its parent -> root user units
    box : (k, 2) corners of its extent in root user units; one point if the extent is unknown
    in_css : whether its geometry is in CSS; such an object is carried although it has curves
    """

    element: Element
    name: str
    outer: Array
    box: Array
    in_css: bool = False


def read_carried(element: Element, outer: Array, styles: Styles, origin: Element | None = None) -> Carried:
    """A text or image with its extent; origin : the element of the document that it is a copy of."""
    matrix = outer @ own_matrix(element)
    box = extent(element if origin is None else origin, styles)
    return Carried(element, name_of(element), outer, box @ matrix[:2, :2].T + matrix[:2, 2])


def read_placed(element: Element, outer: Array, styles: Styles) -> Carried | None:
    """A shape or image whose geometry is in CSS; None if it can't be read.

    Inkscape draws such a shape by its attributes, usually not at all; browsers draw it by CSS.  A transform
    moves it in both.
    """
    root = element.getroottree().getroot()
    page = etree.Element(root.tag, dict(root.attrib))  # the reference of percentages
    twin = etree.SubElement(page, element.tag, dict(element.attrib))
    for name in geometry_of(element):
        value = styles.own(element, name) or ""
        outline = _CSS_PATH.match(value)
        if styles.by_css(element, name):
            twin.attrib[name] = outline.group(2) if outline else value
    try:
        return replace(read_carried(element, outer, styles, twin), in_css=True)
    except DocumentError:
        return None


def follows_by_itself(element: Element, styles: Styles, ids: Ids, reshaped: set[Element]) -> bool:
    """Whether a text is set along, or inside, one of the reshaped shapes."""
    if ids.get(referred(styles.own(element, "shape-inside"))) in reshaped:
        return True
    paths = (ids.href(part) for part in element.iter() if local_tag(part) == "textPath")
    return any(path in reshaped for path in paths if path is not None)


def carry(item: Carried, points: Points, changes: Changes) -> Array:
    """Plan the motion with the points around the object; returns it, (3, 3), root user units."""
    move = motion_of(item, points)
    if not np.array_equal(move, np.eye(3)):
        inner = np.linalg.solve(item.outer, move @ item.outer) @ own_matrix(item.element)
        changes.attributes.append((item.element, "transform", transform_text(inner)))
    return move


def as_the_rest(item: Carried, move: Array, points: Points) -> bool:
    """Whether the object and all curves around it were only shifted, by the same vector."""
    if np.abs(move[:2, :2] - np.eye(2)).max() > SAME:
        return False
    size = float(np.hypot(*np.ptp(item.box, axis=0)))
    near_it = np.linalg.norm(points.old - item.box.mean(axis=0), axis=1) <= 2.0 * size
    off = points.new - points.old @ move[:2, :2].T - move[:2, 2]
    return bool(np.abs(off[near_it]).max(initial=0.0) <= SAME * points.extent)


def motion_of(item: Carried, points: Points) -> Array:
    """The motion (3, 3) with the points around the object, root user units; rounding is the identity."""
    low, high = item.box.min(axis=0), item.box.max(axis=0)
    size, centre = float(np.hypot(*(high - low))), (low + high) / 2.0
    around = near(points, centre, max(size, _NEIGHBOURHOOD * points.extent, 1e-300))
    scale = similarity(around)[0, 0] if size > 0.0 else 1.0
    stretch = axis_aligned(around)
    move = np.diag([scale, scale, 1.0])
    move[:2, 2] = stretch[:2, :2] @ centre + stretch[:2, 2] - scale * centre
    corners = np.column_stack([item.box, np.ones(len(item.box))])
    if np.abs(corners @ (move - np.eye(3)).T).max() <= 1e-7 * points.extent:
        return np.eye(3)
    return move


def extent(element: Element, styles: Styles) -> Array:
    """Corners of the extent in own coordinates; only the anchor if the extent is unknown."""
    tag = local_tag(element)
    if tag == "text":
        return _text_box(element, styles)
    if tag == "flowRoot":
        frames = [part for part in element.iter() if local_tag(part) == "rect"]
        return _rectangle(frames[0]) if frames else np.zeros((1, 2))
    if tag == "path" or tag in basic_shapes.TAGS:
        control = read_shape(element, np.eye(3)[:2]).control.reshape(-1, 2)
        (x, y), (u, v) = control.min(axis=0), control.max(axis=0)
        return np.array([[x, y], [u, y], [u, v], [x, v]])
    return _rectangle(element)


def _rectangle(element: Element) -> Array:
    length = length_reader(element, name_of(element))
    try:
        x, y = length("x") or 0.0, length("y") or 0.0
        width, height = length("width") or 0.0, length("height") or 0.0
    except DocumentError:
        return np.array([[_first(element, "x") or 0.0, _first(element, "y") or 0.0]])
    return np.array([[x, y], [x + width, y], [x + width, y + height], [x, y + height]])


def _text_box(element: Element, styles: Styles) -> Array:
    """Corners of a text's extent, estimated from its lines, font size and number of letters."""
    x, y = _first(element, "x"), _first(element, "y")
    boxes = []
    for part in element.iter():
        if local_tag(part) not in ("text", "tspan"):
            continue
        x = x if _first(part, "x") is None else _first(part, "x")
        y = y if _first(part, "y") is None else _first(part, "y")
        letters = len((part.text or "").strip())
        if not letters:
            continue
        size = _font_size(styles.inherited(part, "font-size"))
        if size is None:
            return np.array([[x or 0.0, y or 0.0]])
        width = _LETTER * size * letters
        anchor = styles.inherited(part, "text-anchor")
        left = (x or 0.0) - {"middle": 0.5, "end": 1.0}.get(anchor or "", 0.0) * width
        top, bottom = (y or 0.0) - _ABOVE * size, (y or 0.0) + _BELOW * size
        boxes += [[left, top], [left + width, top], [left + width, bottom], [left, bottom]]
    return np.array(boxes) if boxes else np.array([[x or 0.0, y or 0.0]])


def _font_size(text: str | None) -> float | None:
    """A font size in user units; None if it is relative to something else."""
    text = (text or "medium").strip()
    if text in _NAMED_SIZES:
        return _NAMED_SIZES[text]
    found = re.match(r"([\d.]+)(px|pt|mm|)$", text)
    try:
        size = float(found.group(1)) if found else 0.0
    except ValueError:
        return None
    factor = {"px": 1.0, "": 1.0, "pt": 4.0 / 3.0, "mm": 96.0 / 25.4}
    return size * factor[found.group(2)] if found and size > 0.0 else None


def _first(element: Element, name: str) -> float | None:
    found = _NUMBER.match(element.attrib.get(name) or "")
    return float(found.group(1)) if found else None
