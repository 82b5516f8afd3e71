"""SVG -> Drawing: which objects are reshaped, and their segments in root user units."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Callable, Iterator

import numpy as np

from .. import pathdata, shapes
from ..errors import DocumentError
from ..model import Array, Drawing
from .marks import HandleObject, labelled, read_handle, wishes
from .tree import (
    CONTAINERS,
    LABEL,
    SODIPODI_NS,
    Element,
    Shape,
    local_tag,
    name_of,
    own_matrix,
    parent_matrix,
    read_shape,
    style_of,
)

_CARRIED = ("text", "image", "use", "flowRoot", "foreignObject", "svg")  # drawn, but not curves


@dataclass
class Document:
    """What was read, and what is needed to write it back."""

    svg: Element
    drawing: Drawing
    shapes: list[Shape]
    handles: list[HandleObject]
    skipped: list[dict[str, str]] = field(default_factory=list)


def read(svg: Element, selected: list[Element], whole: bool) -> Document:
    """Read the shapes to reshape and the handles.

    selected : elements; none, or nothing but handles, or `whole` means every visible, unlocked object.
    Raises DocumentError or HandleError that names the object and the remedy.
    """
    handles = [read_handle(element, label) for element, label in labelled(svg)]
    chosen = [element for element in selected if not (element.get(LABEL) or "").startswith("alup:")]
    everything = whole or not chosen
    skipped: list[dict[str, str]] = []
    found = [
        read_shape(element, matrix)
        for element, matrix in _walk(svg, [svg] if everything else chosen, everything, skipped)
    ]
    found = [shape for shape in found if shape.subpaths]
    if not found:
        raise DocumentError(_nothing_to_reshape(everything, chosen, skipped))
    if all(len(subpath.control) == 0 for shape in found for subpath in shape.subpaths):
        names = ", ".join(shape.name for shape in found[:5])
        raise DocumentError(
            f"{names}: a path with a single point has no curve to reshape. "
            "Select a path with two nodes or more."
        )
    drawing = _drawing(found, handles, _bystanders(svg, found) if not everything else np.zeros((0, 4, 2)))
    return Document(svg, drawing, found, handles, skipped)


def _nothing_to_reshape(everything: bool, chosen: list[Element], skipped: list[dict[str, str]]) -> str:
    if everything:
        return "No path to reshape: the drawing has no visible, unlocked path or shape. Draw or unlock one."
    names = ", ".join(name_of(element) for element in chosen[:5])
    if skipped:
        names = ", ".join(f"{entry['id']} ({entry['why']})" for entry in skipped[:5])
    return (
        f"No path is selected, only {names}. "
        "Select paths or shapes; text becomes one by Path > Object to Path."
    )


def _walk(
    svg: Element, tops: list[Element], everything: bool, skipped: list[dict[str, str]]
) -> Iterator[tuple[Element, Array]]:
    """Shapes below the given elements with their (2, 3) matrices to root units, in document order."""
    inside = set(tops)
    seen = set()
    for top in sorted(tops, key=_document_order(svg)) if len(tops) > 1 else tops:
        ancestor = top.getparent()
        while ancestor is not None and ancestor not in inside:
            ancestor = ancestor.getparent()
        if ancestor is not None or top in seen:
            continue  # it comes with its group
        seen.add(top)
        start = np.eye(3) if top is svg else parent_matrix(top)
        stack = [(top, start, "visible")]
        while stack:
            element, matrix, visibility = stack.pop()
            tag = local_tag(element)
            if (element.get(LABEL) or "").startswith("alup:"):
                continue
            visibility = style_of(element, "visibility") or visibility
            if everything:
                locked = element.get(f"{{{SODIPODI_NS}}}insensitive") == "true"
                if style_of(element, "display") == "none" or locked:
                    continue
            own = matrix @ own_matrix(element) if element is not svg else matrix
            if tag in CONTAINERS or element is svg:
                stack.extend((child, own, visibility) for child in reversed(element))
            elif tag == "path" or tag in shapes.TAGS:
                if everything and visibility in ("hidden", "collapse"):
                    continue
                if abs(np.linalg.det(own)) < 1e-12 * max(np.abs(own[:2, :2]).max(), 1e-300) ** 2:
                    skipped.append({"id": name_of(element), "why": "its transform squashes it to a line"})
                    continue
                yield element, own[:2]
            elif tag in _CARRIED and not (everything and visibility == "hidden"):
                skipped.append({"id": name_of(element), "why": _why_carried(tag)})


def _document_order(svg: Element) -> Callable[[Element], int]:
    order = {element: n for n, element in enumerate(svg.iter())}
    return lambda element: order.get(element, len(order))


def _why_carried(tag: str) -> str:
    return {
        "use": "a clone; select its original, or unlink it by Edit > Clone > Unlink Clone",
        "image": "an image",
        "svg": "a drawing inside the drawing; ungroup it",
    }.get(tag, "text")


def _drawing(found: list[Shape], handles: list[HandleObject], bystanders: Array) -> Drawing:
    """One array of segments; a subpath that is a lone point is a segment without length."""
    control, line, following, shape = [], [], [], []
    count = 0
    for n, item in enumerate(found):
        first = count
        for subpath in item.subpaths:
            own = subpath.control if len(subpath.control) else np.tile(subpath.start, (1, 4, 1))
            k = len(own)
            control.append(own @ item.matrix[:, :2].T + item.matrix[:, 2])
            is_line = np.isin(subpath.kind, (pathdata.LINE, pathdata.CLOSE))
            line.append(is_line if len(subpath.control) else np.ones(1, dtype=bool))
            after = np.arange(count + 1, count + k + 1)
            after[-1] = count if subpath.closed else -1
            following.append(after)
            shape.append(np.full(k, n))
            count += k
        item.segments = (first, count)
    drawing = Drawing(
        control=np.concatenate(control),
        line=np.concatenate(line),
        following=np.concatenate(following),
        shape=np.concatenate(shape),
        names=tuple(item.name for item in found),
        bystanders=bystanders,
    )
    points, sections = wishes(handles, drawing.diagonal)
    return Drawing(**{**drawing.__dict__, "handles": points, "sections": sections})


def _bystanders(svg: Element, found: list[Shape]) -> Array:
    """Curves of the visible shapes that were not selected, (B, 4, 2); unreadable ones don't matter."""
    mine = {shape.element for shape in found}
    control = []
    for element, matrix in _walk(svg, [svg], True, []):
        if element in mine:
            continue
        try:
            other = read_shape(element, matrix)
        except DocumentError:
            continue  # not part of this run, so not this run's to complain about
        control += [s.control @ matrix[:, :2].T + matrix[:, 2] for s in other.subpaths if len(s.control)]
    return np.concatenate(control) if control else np.zeros((0, 4, 2))
