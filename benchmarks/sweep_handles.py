# SPDX-License-Identifier: GPL-2.0-or-later
"""Puts handles on any drawing, so that a sweep can reshape drawings without handles.

The places are on the curves that a run would reshape: the outermost points in a direction, and those on the
other sides.  There are three kinds of edit, all drawn from a seed:

    stretch    one side moves out by STRETCH of the extent, the opposite one is pinned
    point      one outermost point moves in any direction by POINT of the diagonal, the other sides are pinned
    compress   one side moves in until COMPRESS of the extent is left, the opposite one is pinned

The selection is drawn from the seed, too: nothing (which means the whole drawing), some shapes, or a group.
"""

from __future__ import annotations

import contextlib
import io
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import inkex
import numpy as np
from lxml import etree

from alup.document import painted_shapes
from alup.document.tree.drawn_elements import walk
from alup.document.tree.elements import CONTAINERS, LABEL, local_tag
from alup.document.tree.styles import Styles
from alup.geometry.bezier import evaluate, polygon_lengths
from alup.messages.errors import AlupError

Array = np.ndarray

KINDS = ("stretch", "point", "compress")
STRETCH, POINT, COMPRESS = 0.3, 0.15, 0.3

# Relative to the diagonal.  An outermost side longer than this is held at both ends.  Pins nearer than this
# to a moved handle are left out, because they would ask for a fold.
APART = 0.05

# Largest difference between the outermost points of one side, relative to the diagonal.
LEVEL = 1e-4

# Extents below this part of the diagonal are not stretched.
FLAT = 1e-3

# Length of the shortest segment that gets a handle, relative to the diagonal.
LONG = 1e-5

# Radius of a handle, relative to the diagonal.
RADIUS = 1e-3

SHAPES = ("path", "rect", "circle", "ellipse", "line", "polyline", "polygon")
OTHERS = ("text", "flowRoot", "image", "use", "svg", "foreignObject")
UNDRAWN = ("defs", "symbol", "clipPath", "mask", "marker", "pattern", "linearGradient", "radialGradient")


@dataclass(frozen=True)
class Wish:
    """A point of the curves and its target, which is the same for a pin.  (2,) root user units."""

    source: Array
    target: Array


@dataclass
class Prepared:
    """A drawing with handles.

    svg : its root; ids : to select; wishes : what the handles ask for
    content : how many of each tag are drawn, as this module counts
    affected : (index, matrix or None) of the elements that the run is to take, by their place in `svg.iter()`
    unreadable : what the package says if it can't read the drawing, "" if it can
    """

    svg: Any
    ids: list[str] = field(default_factory=list)
    scope: str = "drawing"
    wishes: list[Wish] = field(default_factory=list)
    content: dict[str, int] = field(default_factory=dict)
    affected: dict[int, Array | None] = field(default_factory=dict)
    unreadable: str = ""


def random_of(*words: object) -> np.random.Generator:
    """A generator that depends on the words only."""
    return np.random.default_rng(zlib.crc32(" ".join(map(str, words)).encode()))


def load(path: Path) -> Any:
    """The root of a drawing, read as tolerantly as by Inkscape; None if it is no XML at all."""
    with contextlib.redirect_stderr(io.StringIO()):
        return inkex.load_svg(path.read_bytes().lstrip()).getroot()


def prepare(svg: Any, kind: str, rng: np.random.Generator) -> Prepared:
    """Put handles into a drawing and name what is to be selected."""
    name_all(svg)
    case = Prepared(svg, content=content_of(svg))
    try:
        control = _held(svg, _choose(case, rng))
        if not len(control):  # nothing in it has a length
            case.ids, case.scope = [], "drawing"
            control = _held(svg, [])
        _measure(case)
    except AlupError as error:
        case.unreadable = str(error)
        return case
    case.wishes = wishes(control, kind, rng)
    if case.wishes:
        draw(svg, case.wishes, RADIUS * _diagonal(control))
    return case


def name_all(svg: Any) -> None:
    """Give an id to all that has none, as Inkscape does when it hands a drawing over."""
    taken = set(svg.xpath("//@id"))
    number = 0
    for element in svg.iter():
        if local_tag(element) and not element.attrib.get("id"):
            while f"sweep{number}" in taken:
                number += 1
            element.attrib["id"] = f"sweep{number}"
            number += 1


def content_of(svg: Any) -> dict[str, int]:
    """Counts of visible elements by tag, independent of the package's own walk."""
    found: dict[str, int] = {}
    stack = [(svg, "visible")]
    while stack:
        element, visibility = stack.pop()
        tag = local_tag(element)
        items = [item.partition(":") for item in (element.attrib.get("style") or "").split(";")]
        style = {name.strip(): value.strip() for name, _, value in items}
        display = style.get("display") or element.attrib.get("display")
        if not tag or tag in UNDRAWN or display == "none":
            continue
        visibility = style.get("visibility") or element.attrib.get("visibility") or visibility
        if tag in CONTAINERS or element is svg:
            stack += [(child, visibility) for child in element]
        elif visibility == "visible" and (tag in OTHERS or (tag in SHAPES and _has_size(element, tag))):
            found[tag] = found.get(tag, 0) + 1
    return found


def _has_size(element: Any, tag: str) -> bool:
    needed = {"path": "d", "polyline": "points", "polygon": "points", "rect": "width", "circle": "r"}
    return tag not in needed or any(sign in "123456789" for sign in element.attrib.get(needed[tag]) or "")


def _choose(case: Prepared, rng: np.random.Generator) -> list[Any]:
    """The selection: half of the time nothing, else some consecutive shapes, or a group."""
    svg = case.svg
    shapes = [shape.element for shape in painted_shapes.painted_shapes(svg, [])]
    every = svg.xpath("//@id")
    names = {name for name, count in zip(*np.unique(every, return_counts=True)) if count == 1}
    draw_of = rng.random(3)
    if draw_of[0] < 0.5:
        return []
    within = set(shapes)
    groups = [
        element
        for element in svg.iter()
        if local_tag(element) in CONTAINERS
        and element.attrib.get("id") in names
        and within.intersection(element.iter())
    ]
    if draw_of[0] < 0.75 and groups:
        chosen = [groups[int(draw_of[1] * len(groups))]]
        case.scope = "group"
    else:
        usable = [element for element in shapes if element.attrib.get("id") in names]
        if len(usable) < 2:
            return []
        count = 1 + int(draw_of[1] * len(usable) / 2)
        first = int(draw_of[2] * (len(usable) - count + 1))
        chosen = usable[first : first + count]
        case.scope = "shapes"
    case.ids = [str(element.attrib["id"]) for element in chosen]
    return chosen


def _held(svg: Any, chosen: list[Any]) -> Array:
    """Curves (S, 4, 2) that may get handles; points and lines without length may not."""
    control = np.concatenate([shape.control for shape in painted_shapes.painted_shapes(svg, chosen)])
    return control[polygon_lengths(control) > LONG * _diagonal(control)]


def _measure(case: Prepared) -> None:
    """Find the elements that the run should reshape, and their matrices."""
    svg = case.svg
    chosen = [element for element in svg.iter() if element.attrib.get("id") in case.ids] if case.ids else []
    met = walk(svg, chosen or [svg], not chosen, Styles(svg))
    place = {element: n for n, element in enumerate(svg.iter())}
    case.affected = {place[element]: matrix for element, matrix in met.drawn}
    case.affected.update({place[element]: None for element, _ in met.other})


def wishes(control: Array, kind: str, rng: np.random.Generator) -> list[Wish]:
    """Handles for cubics (S, 4, 2); none if these have no extent."""
    if not len(control):
        return []
    points = evaluate(control[:, None], np.linspace(0.0, 1.0, 33)[None]).reshape(-1, 2)
    size, diagonal = np.ptp(points, axis=0), float(np.hypot(*np.ptp(points, axis=0)))
    if not diagonal > 0.0:
        return []
    axis, sign = int(rng.integers(2)), (-1.0, 1.0)[int(rng.integers(2))]
    if size[axis] < FLAT * diagonal:
        axis = 1 - axis
    out = np.eye(2)[axis] * sign
    if kind == "point":
        angle = rng.uniform(0.0, 2.0 * np.pi)
        move = POINT * diagonal * np.array([np.cos(angle), np.sin(angle)])
        moving = _side(points, out, diagonal)[:1]
        across = out[::-1]
        # The farther one of a side's two ends, so that no corner is held twice.
        pins = [
            max(_side(points, way, diagonal), key=lambda point: float(np.hypot(*(point - moving[0]))))
            for way in (-out, across, -across)
        ]
    else:
        move = (STRETCH if kind == "stretch" else COMPRESS - 1.0) * size[axis] * out
        moving, pins = _side(points, out, diagonal), _side(points, -out, diagonal)
    found = [Wish(point, point + move) for point in moving]
    for pin in pins:
        if all(np.hypot(*(pin - wish.source)) > APART * diagonal for wish in found):
            found.append(Wish(pin, pin))
    return found


def _side(points: Array, out: Array, diagonal: float) -> list[Array]:
    """The outermost points in a direction: one, or the two ends of a side that is long enough."""
    height = points @ out
    level = points[height >= height.max() - LEVEL * diagonal]
    along = level @ out[::-1]
    if np.ptp(along) > APART * diagonal:
        return [level[along.argmin()], level[along.argmax()]]
    return [points[height.argmax()]]


def draw(svg: Any, found: list[Wish], radius: float) -> None:
    """Draw the handles, in a group at the end of the drawing."""
    tag = svg.tag[: svg.tag.rindex("}") + 1] if "}" in svg.tag else ""
    group = etree.SubElement(svg, f"{tag}g", id=_free(svg, "sweep-handles"))

    def circle(label: str, at: Array, colour: str) -> None:
        node = etree.SubElement(group, f"{tag}circle")
        node.attrib["id"] = _free(svg, "sweep-" + label.replace(":", "-").replace(" ", "-"))
        node.attrib[LABEL] = label
        node.attrib["cx"], node.attrib["cy"] = repr(float(at[0])), repr(float(at[1]))
        node.attrib["r"], node.attrib["style"] = repr(float(radius)), f"fill:{colour}"

    for n, wish in enumerate(found):
        if np.array_equal(wish.source, wish.target):
            circle("alup:pin", wish.source, "#d00")
        else:
            circle(f"alup:from {n}", wish.source, "#06c")
            circle(f"alup:to {n}", wish.target, "#06c")


def _free(svg: Any, wanted: str) -> str:
    taken, name, n = set(svg.xpath("//@id")), wanted, 0
    while name in taken:
        n += 1
        name = f"{wanted}-{n}"
    return name


def _diagonal(control: Array) -> float:
    return float(np.hypot(*np.ptp(control.reshape(-1, 2), axis=0)))
