# SPDX-License-Identifier: GPL-2.0-or-later
"""Shapes with what belongs to them, in documents that are read, reshaped and written in one line."""

from __future__ import annotations

import io
import re
from typing import Any, Callable, Sequence

import inkex
import numpy as np
from lxml import etree

from alup.document import reading, writing
from alup.document.tree import elements
from alup.session import pipeline

Array = np.ndarray
Point = Sequence[float]
Map = Callable[[Array], Array]

SVG = "http://www.w3.org/2000/svg"
INKSCAPE = "http://www.inkscape.org/namespaces/inkscape"
SODIPODI = "http://sodipodi.sourceforge.net/DTD/sodipodi-0.dtd"
HEAD = (
    f'<svg xmlns="{SVG}" xmlns:xlink="http://www.w3.org/1999/xlink" xmlns:inkscape="{INKSCAPE}" '
    f'xmlns:sodipodi="{SODIPODI}" width="400" height="300" viewBox="0 0 400 300">'
)
CORNERS = ((20, 20), (120, 20), (120, 80), (20, 80))
RECT = '<rect id="r" x="20" y="20" width="100" height="60" {}/>'
STOPS = '<stop offset="0" stop-color="#f00"/><stop offset="1" stop-color="#00f"/>'
FILLED = RECT.format('fill="url(#g)"')
GRADIENT = (
    '<linearGradient id="g" gradientUnits="userSpaceOnUse" x1="20" y1="50" x2="120" y2="50">'
    f"{STOPS}</linearGradient>"
)
CLIP = '<clipPath id="c"><rect id="cr" x="40" y="10" width="60" height="80"/></clipPath>'
CLIPPED = RECT.format('clip-path="url(#c)"')
TEXT = '<text id="t" x="50" y="55" font-size="12" {}>Label</text>'
IMAGE = '<image id="i" x="40" y="40" width="30" height="20" transform="rotate(10)"/>'


def affine(scale: Point, shift: Point) -> Map:
    return lambda p: np.asarray(p, dtype=float) * scale + shift


WIDER = affine((3.0, 1.0), (-40.0, 0.0))  # x from 20..120 to 20..320
LARGER = affine((2.0, 2.0), (-20.0, -20.0))
AWAY = affine((1.0, 1.0), (150.0, 70.0))
STILL = affine((1.0, 1.0), (0.0, 0.0))


def handles(move: Map, points: Sequence[Point] = CORNERS) -> str:
    """Handles that carry points along a map."""
    found = []
    for n, point in enumerate(points):
        (x, y), (u, v) = point, move(np.array(point))
        labels = [("pin", x, y)] if (x, y) == (u, v) else [(f"from {n}", x, y), (f"to {n}", u, v)]
        found += [f'<circle inkscape:label="alup:{w}" cx="{a}" cy="{b}" r="2"/>' for w, a, b in labels]
    return "".join(found)


def load(body: str, move: Map = STILL, points: Sequence[Point] = CORNERS, head: str = HEAD) -> Any:
    text = f"{head}{body}{handles(move, points)}</svg>"
    return inkex.load_svg(io.BytesIO(text.encode())).getroot()


def get(root: Any, identity: str) -> Any:
    found = [element for element in root.iter() if element.get("id") == identity]
    assert len(found) == 1, f"{len(found)} elements {identity}"
    return found[0]


class Run:
    """A document through reading, reshaping and writing."""

    def __init__(self, root: Any, ids: str, tandem: bool = True):
        self.root = root
        selected = [get(root, identity) for identity in ids.split()]
        options = pipeline.Options(hold="normally" if tandem else pipeline.APART)
        self.read = reading.read(root, selected, False, tandem)
        result = pipeline.reshape(self.read.drawing, options)
        tolerance = options.fit_tolerance * float(self.read.drawing.size.max())
        self.changed = writing.write(self.read, result.refitted, True, tolerance)

    def __getitem__(self, identity: str) -> Any:
        return get(self.root, identity)

    @property
    def skipped(self) -> list[str]:
        return [entry["id"] for entry in self.read.skipped]

    def control(self, element: Any) -> Array:
        """Control points in root user units, (s, 4, 2)."""
        matrix = (elements.parent_matrix(element) @ elements.own_matrix(element))[:2]
        return elements.read_shape(element, matrix).control


def run(body: str, ids: str = "r", move: Map = STILL, tandem: bool = True, **others: Any) -> Run:
    return Run(load(body, move, **others), ids, tandem)


def paint_of(element: Any, name: str = "fill") -> str:
    """The id that a property of the element itself refers to."""
    text = f"{name}:{element.get(name)};" if element.get(name) else ""
    found = re.findall(rf"(?:^|;)\s*{name}\s*:\s*url\(#([^)]+)\)", text + (element.attrib.get("style") or ""))
    assert found, etree.tostring(element)
    return found[-1]


def mapped(gradient: Any, *points: Point) -> Array:
    """Where a gradient's transform takes points of its coordinates."""
    name = "patternTransform" if "pattern" in str(gradient.tag) else "gradientTransform"
    matrix = elements.own_matrix(gradient, name)
    return np.array(points) @ matrix[:2, :2].T + matrix[:2, 2]
