"""SVG -> Drawing: which objects are reshaped, and their segments in root user units."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Callable

import numpy as np

from .. import shapes
from ..errors import DocumentError
from ..model import Array, Drawing
from . import clips
from .carried import Carried, follows_by_itself, read_carried
from .companions import Companion
from .marks import HandleObject, labelled, read_handle, wishes
from .references import Ids
from .styles import Styles
from .tree import (
    CARRIED,
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
)

_WHY_SKIPPED = {
    "use": "a clone; select its original, or unlink it by Edit > Clone > Unlink Clone",
    "image": "an image",
    "svg": "a drawing inside the drawing; ungroup it",
}


@dataclass
class Document:
    """What was read, and what is needed to write it back.

    shapes : of the drawing, those of companions included; carried : what moves along as a whole
    """

    svg: Element
    drawing: Drawing
    shapes: list[Shape]
    handles: list[HandleObject]
    styles: Styles
    ids: Ids
    companions: list[Companion] = field(default_factory=list)
    carried: list[Carried] = field(default_factory=list)
    skipped: list[dict[str, str]] = field(default_factory=list)


@dataclass
class _Found:
    """What a walk met.  drawn : shapes; other : texts, images, clones, with their parents' matrices."""

    drawn: list[tuple[Element, Array]] = field(default_factory=list)
    other: list[tuple[Element, Array]] = field(default_factory=list)
    squashed: list[Element] = field(default_factory=list)


def read(svg: Element, selected: list[Element], whole: bool, tandem: bool = True) -> Document:
    """Read the shapes to reshape and the handles.

    selected : elements; none, or nothing but handles, or `whole` means every visible, unlocked object.
    tandem : what carries no handle moves along: texts and images are carried, else skipped.
    Raises DocumentError or HandleError that names the object and the remedy.
    """
    handles = [read_handle(element, label) for element, label in labelled(svg)]
    chosen = [element for element in selected if not (element.attrib.get(LABEL) or "").startswith("alup:")]
    everything = whole or not chosen
    _refuse_inner_drawings(chosen)
    styles, ids = Styles(svg), Ids(svg)
    walk = _walk(svg, [svg] if everything else chosen, everything, styles)
    found = [read_shape(element, matrix) for element, matrix in walk.drawn]
    found = [shape for shape in found if shape.subpaths]
    skipped = [_skipped(element, "its transform squashes it to a line") for element in walk.squashed]
    if not found:
        skipped += [_skipped(element) for element, _ in walk.other]
        raise DocumentError(_nothing_to_reshape(everything, chosen, skipped))
    if all(len(subpath.control) == 0 for shape in found for subpath in shape.subpaths):
        names = ", ".join(shape.name for shape in found[:5])
        raise DocumentError(
            f"{names}: a path with a single point has no curve to reshape. "
            "Select a path with two nodes or more."
        )
    reshaped = {shape.element for shape in found}
    carried: list[Carried] = []
    come_along: set[Element] = set()
    for element, outer in walk.other:
        if local_tag(element) == "use":
            comes = _original_is_among(element, ids, reshaped | come_along)
        else:
            comes = local_tag(element) in CARRIED and tandem
            if comes and not follows_by_itself(element, styles, ids, reshaped):
                carried.append(read_carried(element, outer, styles))
        if comes:
            come_along.add(element)
        else:
            skipped.append(_skipped(element))
    cutting = clips.find(found, come_along, _held(handles), styles, ids, tandem)
    bystanders = _bystanders(svg, found, styles) if not everything else np.zeros((0, 4, 2))
    found += [shape for clip in cutting if clip.joins for shape in clip.shapes]
    drawing = _drawing(found, handles, bystanders)
    return Document(svg, drawing, found, handles, styles, ids, cutting, carried, skipped)


def _held(handles: list[HandleObject]) -> Array:
    """(k, 2) where the handles lie on curves."""
    points = [
        handle.rest if handle.kind == "handle" and handle.rest is not None else handle.centre
        for handle in handles
        if handle.kind in ("pin", "from", "handle")
    ]
    return np.array(points, dtype=float).reshape(-1, 2)


def _refuse_inner_drawings(chosen: list[Element]) -> None:
    for element in chosen:
        for ancestor in element.iterancestors():
            if local_tag(ancestor) == "svg" and ancestor.getparent() is not None:
                raise DocumentError(
                    f"{name_of(element)} lies in {name_of(ancestor)}, a drawing inside the drawing. "
                    "Ungroup that first."
                )


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


def _skipped(element: Element, why: str = "") -> dict[str, str]:
    return {"id": name_of(element), "why": why or _WHY_SKIPPED.get(local_tag(element), "text")}


def _original_is_among(clone: Element, ids: Ids, followed: set[Element]) -> bool:
    """Whether what a clone shows, or some of it, is reshaped or carried."""
    original = ids.chain(clone)[-1]
    return original is not clone and any(
        part in followed or (local_tag(part) == "use" and ids.chain(part)[-1] in followed)
        for part in original.iter()
    )


def _walk(svg: Element, tops: list[Element], everything: bool, styles: Styles) -> _Found:
    """What is drawn below the given elements, in document order."""
    found = _Found()
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
            if not tag or (element.attrib.get(LABEL) or "").startswith("alup:"):
                continue
            visibility = styles.own(element, "visibility") or visibility
            if everything:
                locked = element.attrib.get(f"{{{SODIPODI_NS}}}insensitive") == "true"
                if styles.own(element, "display") == "none" or locked:
                    continue
            own = matrix @ own_matrix(element) if element is not svg else matrix
            if tag in CONTAINERS or element is svg:
                stack.extend((child, own, visibility) for child in reversed(element))
            elif everything and visibility in ("hidden", "collapse"):
                continue
            elif tag == "path" or tag in shapes.TAGS:
                if abs(np.linalg.det(own)) < 1e-12 * max(np.abs(own[:2, :2]).max(), 1e-300) ** 2:
                    found.squashed.append(element)
                else:
                    found.drawn.append((element, own[:2]))
            elif tag in ("use", "svg", *CARRIED):
                found.other.append((element, matrix))
    return found


def _document_order(svg: Element) -> Callable[[Element], int]:
    order = {element: n for n, element in enumerate(svg.iter())}
    return lambda element: order.get(element, len(order))


def _drawing(found: list[Shape], handles: list[HandleObject], bystanders: Array) -> Drawing:
    """One array of segments; a subpath that is a lone point is a segment without length."""
    following = []
    count = 0
    for item in found:
        first = count
        for subpath in item.subpaths:
            k = max(len(subpath.control), 1)
            after = np.arange(count + 1, count + k + 1)
            after[-1] = count if subpath.closed else -1
            following.append(after)
            count += k
        item.segments = (first, count)
    drawing = Drawing(
        control=np.concatenate([item.control for item in found]),
        line=np.concatenate([item.line for item in found]),
        following=np.concatenate(following),
        shape=np.repeat(np.arange(len(found)), [item.segments[1] - item.segments[0] for item in found]),
        names=tuple(item.name for item in found),
        bystanders=bystanders,
    )
    points, sections = wishes(handles, drawing.diagonal)
    return Drawing(**{**drawing.__dict__, "handles": points, "sections": sections})


def _bystanders(svg: Element, found: list[Shape], styles: Styles) -> Array:
    """Curves of the visible shapes that were not selected, (B, 4, 2); unreadable ones don't matter."""
    mine = {shape.element for shape in found}
    control = []
    for element, matrix in _walk(svg, [svg], True, styles).drawn:
        if element in mine:
            continue
        try:
            other = read_shape(element, matrix)
        except DocumentError:
            continue  # not part of this run, so not this run's to complain about
        control += [s.control @ matrix[:, :2].T + matrix[:, 2] for s in other.subpaths if len(s.control)]
    return np.concatenate(control) if control else np.zeros((0, 4, 2))
