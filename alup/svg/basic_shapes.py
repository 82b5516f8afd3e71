# SPDX-License-Identifier: GPL-2.0-or-later
"""Path data of SVG's basic shapes (SVG 1.1 chapter 9), node for node as Inkscape converts them.

This module follows the specification, because inkex 1.2 does not: it accepts radii of rounded rectangles
above half the side, and draws circles as arcs of three quarters and one quarter.
"""

from __future__ import annotations

import re
from typing import Callable, Optional

from ..messages.errors import DocumentError
from ..messages.language import translate as _

# length(name, reference) -> number in user units, or None where the attribute is missing
Length = Callable[[str], Optional[float]]

TAGS = ("rect", "circle", "ellipse", "line", "polyline", "polygon")

# Attributes that have no meaning any more when the shape becomes a path.
GEOMETRY = {
    "rect": ("x", "y", "width", "height", "rx", "ry"),
    "circle": ("cx", "cy", "r"),
    "ellipse": ("cx", "cy", "rx", "ry"),
    "line": ("x1", "y1", "x2", "y2"),
    "polyline": ("points",),
    "polygon": ("points",),
}

_NUMBERS = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


def path_data(tag: str, length: Length, points: str) -> str:
    """The shape as path data; "" for one that is not rendered (no width, no radius).

    tag : one of TAGS; length : reads an attribute in user units
    points : the text of the attribute of that name, for polylines and polygons
    Raises DocumentError for points that cannot be read.
    """
    if tag == "rect":
        return _rect(length)
    if tag == "circle":
        return _ellipse(length("cx"), length("cy"), length("r"), length("r"))
    if tag == "ellipse":
        rx, ry = length("rx"), length("ry")
        return _ellipse(length("cx"), length("cy"), ry if rx is None else rx, rx if ry is None else ry)
    if tag == "line":
        x1, y1, x2, y2 = (length(name) or 0.0 for name in ("x1", "y1", "x2", "y2"))
        return f"M{x1!r},{y1!r} L{x2!r},{y2!r}"
    return _poly(points, tag == "polygon")


def _rect(length: Length) -> str:
    x, y = length("x") or 0.0, length("y") or 0.0
    width, height = length("width") or 0.0, length("height") or 0.0
    if width <= 0.0 or height <= 0.0:
        return ""
    rx, ry = length("rx"), length("ry")
    rx, ry = (ry if rx is None else rx) or 0.0, (rx if ry is None else ry) or 0.0
    rx, ry = min(rx, width / 2.0), min(ry, height / 2.0)
    if rx <= 0.0 or ry <= 0.0:
        return f"M{x!r},{y!r} H{x + width!r} V{y + height!r} H{x!r} Z"
    right, bottom = x + width, y + height
    corner = f"A{rx!r},{ry!r} 0 0 1 "
    sides = [
        f"M{x + rx!r},{y!r}",
        f"H{right - rx!r}" if width > 2.0 * rx else "",
        f"{corner}{right!r},{y + ry!r}",
        f"V{bottom - ry!r}" if height > 2.0 * ry else "",
        f"{corner}{right - rx!r},{bottom!r}",
        f"H{x + rx!r}" if width > 2.0 * rx else "",
        f"{corner}{x!r},{bottom - ry!r}",
        f"V{y + ry!r}" if height > 2.0 * ry else "",
        f"{corner}{x + rx!r},{y!r} Z",
    ]
    return " ".join(side for side in sides if side)


def _ellipse(cx: float | None, cy: float | None, rx: float | None, ry: float | None) -> str:
    if not rx or not ry or rx < 0.0 or ry < 0.0:
        return ""
    x, y = cx or 0.0, cy or 0.0
    quarter = f"A{rx!r},{ry!r} 0 0 1 "
    stops = ((x, y + ry), (x - rx, y), (x, y - ry), (x + rx, y))
    return f"M{x + rx!r},{y!r} " + " ".join(f"{quarter}{px!r},{py!r}" for px, py in stops) + " Z"


def _poly(points: str, closed: bool) -> str:
    numbers = _NUMBERS.findall(points)
    if _NUMBERS.sub("", points).strip(", \t\r\n\f"):
        raise DocumentError(_("its list of points holds something that is not a number"))
    if len(numbers) % 2:
        raise DocumentError(_("its list of points ends in half a point"))
    if not numbers:
        return ""
    pairs = [f"{x},{y}" for x, y in zip(numbers[::2], numbers[1::2])]
    return "M" + " L".join(pairs) + (" Z" if closed else "")
