# SPDX-License-Identifier: GPL-2.0-or-later
"""Documents that are reshaped more than once, for the tests of what is stored in between."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import Any, Sequence

import clipart
import inkex
import numpy as np
from builders import BLOB
from lxml import etree

from alup.document import reading, writing
from alup.document.tree import elements
from alup.document.tree.own_objects import is_ours
from alup.session import pipeline
from alup.svg import path_data

SVG = "http://www.w3.org/2000/svg"
INKSCAPE = "http://www.inkscape.org/namespaces/inkscape"
SODIPODI = "http://sodipodi.sourceforge.net/DTD/sodipodi-0.dtd"
XLINK = "http://www.w3.org/1999/xlink"
ALUP = "https://alup-reshape.github.io/ns"
REST, AT, ORIGINAL, WRITTEN, COPY, UNMOVED = (
    f"{{{ALUP}}}{name}" for name in ("rest", "at", "original", "written", "copy", "unmoved")
)
DATA = clipart.DRAWINGS
# A few of its cases, of every kind of edit.
NAMES = (
    "mug-taller",
    "elephant-longer-legs",
    "table-longer-legs",
    "truck-longer-box",
    "battery-20pc",
    "battery-translate",
)
CASES = {entry["name"]: entry for entry in clipart.cases(DATA) if entry["name"] in NAMES}
Array = np.ndarray


def load(body: str, declared: bool = True) -> Any:
    """A document; `declared` : with our namespace on its root."""
    ours = f' xmlns:alup="{ALUP}"' if declared else ""
    text = (
        f'<svg xmlns="{SVG}" xmlns:inkscape="{INKSCAPE}" xmlns:sodipodi="{SODIPODI}" '
        f'xmlns:xlink="{XLINK}"{ours} viewBox="0 0 400 300">{body}</svg>'
    )
    return inkex.load_svg(io.BytesIO(text.encode())).getroot()


def reloaded(svg: Any) -> Any:
    """The document written to a file and read again: nothing is kept but what is in it."""
    return inkex.load_svg(io.BytesIO(etree.tostring(svg))).getroot()


def text_of(svg: Any) -> bytes:
    return bytes(etree.tostring(svg))


def canonical(svg: Any) -> bytes:
    return bytes(etree.tostring(svg, method="c14n"))


def get(svg: Any, identity: str) -> Any:
    found = [e for e in svg.iter() if isinstance(e.tag, str) and e.attrib.get("id") == identity]
    assert len(found) == 1, f"{len(found)} elements {identity}"
    return found[0]


def circle(label: str, x: float, y: float, identity: str = "", r: float = 0.5, more: str = "") -> str:
    identity = identity or label.replace(" ", "") + f"{x:g}_{y:g}"
    return f'<circle id="{identity}" inkscape:label="alup:{label}" cx="{x!r}" cy="{y!r}" r="{r}" {more}/>'


def pins(*points: Sequence[float]) -> str:
    return "".join(circle("pin", *point) for point in points)


def handle(x: float, y: float, identity: str = "h", at: Sequence[float] | None = None) -> str:
    """An alup:handle that rests at a point, dragged to another one."""
    cx, cy = at or (x, y)
    return circle("handle", cx, cy, identity, more=f'alup:rest="{x!r} {y!r}"')


# What most of the tests reshape.
PATH = f'<path id="p" style="fill:red" d="{BLOB}"/>'
PINS = pins((10, 80), (60, 130))
DIAGONAL = 179.0  # of BLOB

# Two rectangles with a common side.
LEFT = '<rect id="l" x="20" y="20" width="60" height="60"/>'
RIGHT = '<path id="r" d="M80,20 H140 V80 H80 Z"/>'
PAIR = LEFT + RIGHT


def add(svg: Any, body: str) -> None:
    """Draw something more, by hand."""
    for element in load(body):
        svg.append(element)


def drag(svg: Any, identity: str, x: float, y: float) -> None:
    """Put a circle somewhere; its group has no transform."""
    element = get(svg, identity)
    element.attrib["cx"], element.attrib["cy"] = repr(float(x)), repr(float(y))


def edit_node(svg: Any, identity: str, which: int = 1) -> None:
    """Move a node of a path by (5, -12)."""
    element = get(svg, identity)
    (subpath,) = path_data.parse(element.get("d"))
    nodes = subpath.control[:, 0].copy()
    nodes[which] += (5.0, -12.0)
    element.attrib["d"] = "M " + " L ".join(f"{x!r},{y!r}" for x, y in nodes.tolist()) + " Z"


def rewrite(svg: Any, *ids: str) -> None:
    """Write path data anew as Inkscape does in duplicates and pastes: relative, with the eight digits of the
    points, the line that closes left to z.
    """
    for identity in ids:
        element = get(svg, identity)
        subpaths = path_data.parse(element.attrib["d"])
        reach = max(float(np.abs(s.control).max()) for s in subpaths)
        digits = 7 - int(np.floor(np.log10(reach)))
        words = []
        at = np.zeros(2)
        for subpath in subpaths:
            at = np.round(subpath.start, digits)
            words.append("M " + ",".join(f"{x:.{digits}f}" for x in at))
            segments = subpath.control
            if subpath.closed and subpath.kind[-1] in (path_data.LINE, path_data.CLOSE):
                segments = segments[:-1]
            for segment in segments:
                steps = np.round(segment[1:] - segment[0], digits)
                words.append("c " + " ".join(",".join(f"{x:.{digits}f}" for x in step) for step in steps))
            words.append("z" if subpath.closed else "")
        element.attrib["d"] = " ".join(words)


@dataclass
class Run:
    """What a run said.  changed, edited, from_original, ignored : names"""

    changed: list[str]
    edited: list[str]
    from_original: list[str]
    ignored: list[str]


def run(svg: Any, ids: str = "", keep: bool = True, tandem: bool = True, **options: Any) -> Run:
    """One run.  ids : to select, with spaces between them"""
    read = reading.read(svg, [get(svg, identity) for identity in ids.split()], False, tandem)
    hold = "normally" if tandem else pipeline.APART
    result = pipeline.reshape(read.drawing, pipeline.Options(hold=hold, **options))
    ignored = [*result.report["ignored_handles"], *read.ignored]
    tolerance = pipeline.Options().fit_tolerance * float(read.drawing.size.max())
    changed = writing.write(read, result.refitted, keep, tolerance, ignored)
    return Run(changed, read.edited, read.from_original, ignored)


def steps(svg: Any, identity: str, ends: Array, ids: str = "", count: int = 10) -> None:
    """Drag a circle in equal steps from one of two points (2, 2) to the other, a run after each."""
    for n in range(1, count + 1):
        x, y = ends[0] + (ends[1] - ends[0]) * n / count if n < count else ends[1]
        drag(svg, identity, x, y)
        run(svg, ids)


def control(svg: Any, identity: str) -> Array:
    """Control points (s, 4, 2) in root user units."""
    element = get(svg, identity)
    matrix = (elements.parent_matrix(element) @ elements.own_matrix(element))[:2]
    return elements.read_shape(element, matrix).control


def away(svg: Any, identity: str, point: Sequence[float]) -> float:
    """Distance of a point from a shape."""
    from alup.geometry.bezier import Nearest

    return Nearest(control(svg, identity)).find(np.array(point, dtype=float))[3]


def bounds(svg: Any, identity: str) -> Array:
    points = np.concatenate([s.control.reshape(-1, 2) for s in path_data.parse(get(svg, identity).get("d"))])
    return np.array([points.min(axis=0), points.max(axis=0)])


def drawn(svg: Any) -> bytes:
    """The document but for handles, and for what is stored: what a person sees of it."""
    twin = reloaded(svg)
    for element in list(twin.iter()):
        if not isinstance(element.tag, str):
            continue
        if is_ours(element):
            element.getparent().remove(element)
            continue
        for name in list(element.attrib):
            if name.startswith(f"{{{ALUP}}}"):
                del element.attrib[name]
    return canonical(twin)


def without_handles(svg: Any) -> bytes:
    """The whole document to the letter, but for handles."""
    twin = reloaded(svg)
    for element in list(twin.iter()):
        if is_ours(element):
            element.getparent().remove(element)
    return text_of(twin)


def case(name: str) -> tuple[Any, str]:
    """A drawing of benchmarks/drawings with its handles, and the ids to select."""
    built = clipart.build(CASES[name], folder=DATA)
    return inkex.load_svg(io.BytesIO(etree.tostring(built.tree))).getroot(), " ".join(built.ids)
