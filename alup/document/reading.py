# SPDX-License-Identifier: GPL-2.0-or-later
"""SVG -> Drawing: which objects are reshaped, and their segments in root user units.

`read` finds the drawn elements (`drawn_elements`), and puts stored originals back if the run starts from them
(`starting_state`).  It reads shapes as path data, clips and handles.  The result is a `Document`: the
`Drawing`, and the data that `writing` needs.  Objects that can't be reshaped are skipped, and the reason is
recorded.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Iterator, Sequence

import numpy as np
from lxml import etree

from ..messages.errors import DocumentError
from ..messages.language import N_
from ..messages.language import translate as _
from ..model import Array, Drawing
from . import handle_targets
from .followers import clip_finding
from .followers.clip_following import Companion
from .followers.clones import Clone, read_clone
from .followers.texts_and_images import Carried, follows_by_itself, read_carried, read_placed
from .handles.handle_objects import HandleObject, read_handle
from .history.correspondence import pair
from .history.starting_state import StartingState, begin
from .tree.drawn_elements import Found, walk
from .tree.elements import (
    CARRIED,
    CONTAINERS,
    WHOLE,
    Element,
    Shape,
    is_squashed,
    local_tag,
    name_of,
    own_matrix,
    page_of,
    parent_of,
    read_shape,
)
from .tree.own_objects import drawn_of, labelled
from .tree.references import Ids
from .tree.styles import Styles

_WHY_SKIPPED = {
    "use": N_("a clone; select its original, or unlink it by Edit > Clone > Unlink Clone"),
    "image": N_("an image"),
    "svg": N_("a drawing inside the drawing; ungroup it"),
}
_TEXT, _SQUASHED = N_("text"), N_("its transform squashes it to a line")

# Reasons that are not written beside the drawing: the object is invisible, or is meant to stay.
UNSEEN = (_TEXT, _WHY_SKIPPED["image"], _SQUASHED)


@dataclass
class Document:
    """A document that was read, with the data that is needed to write results back.

    shapes : of the drawing, including those of companions; carried : elements that move as a whole
    run_start : the state that the run starts from
    met, others : the elements found in the selection and beside it
    ground : the curves that handles lie on
    """

    svg: Element
    drawing: Drawing
    shapes: list[Shape]
    handles: list[HandleObject]
    styles: Styles
    ids: Ids
    run_start: StartingState
    met: Found
    ground: handle_targets.Ground
    others: Found | None = None
    companions: list[Companion] = field(default_factory=list)
    carried: list[Carried] = field(default_factory=list)
    clones: list[Clone] = field(default_factory=list)
    skipped: list[dict[str, str]] = field(default_factory=list)

    @property
    def edited(self) -> list[str]:
        """Names of objects changed or drawn since the last run.  If there are any, no original is used."""
        return self.run_start.edited

    @property
    def from_original(self) -> list[str]:
        """Names of the objects whose stored originals this run starts from."""
        return self.run_start.from_original

    @property
    def ignored(self) -> list[str]:
        """Names of new handles that lie on nothing that is reshaped."""
        return [handle.name for handle in self.handles if handle.no_part]


def refuse_unknown(svg: Any, ids: Sequence[str]) -> None:
    """Raise DocumentError if requested ids are not in the document.  svg : an inkex root"""
    missing = [wanted for wanted in ids if svg.getElementById(wanted) is None]
    if missing:
        message = _("There is no object with the id {ids}. Check --id.")
        raise DocumentError(message.format(ids=", ".join(missing)))


def read(svg: Element, selected: list[Element], whole: bool, tandem: bool = True) -> Document:
    """Read the shapes to reshape and the handles.  The document is unchanged afterwards.

    selected : elements; none, or only handles, or `whole` means every visible, unlocked object
    tandem : whether parts without a handle move along; texts and images are then carried, else skipped
    Raises DocumentError or HandleError that names the object and the remedy.
    """
    handles = [read_handle(element, label) for element, label in labelled(svg)]
    chosen = drawn_of(selected)
    everything = whole or not chosen
    refuse_inner_drawings(chosen)
    styles, ids = Styles(svg), Ids(svg)
    met = walk(svg, [svg] if everything else chosen, everything, styles)
    hidden = clip_finding.hidden_in_boxes(met, styles, ids) if tandem else []
    carried = [(e, outer) for e, outer in met.other if tandem and local_tag(e) in WHOLE] + hidden
    carried += met.placed if tandem else []
    run_start = begin(
        svg, met.drawn, carried, styles, ids, lambda motion: handle_targets.followed(handles, motion)
    )
    try:
        if run_start.undo_log:
            styles, ids = Styles(svg), Ids(svg)
        if run_start.motion is not None:
            handle_targets.move_along(handles, run_start.motion)
        return _read(svg, chosen, everything, tandem, handles, met, hidden, run_start, styles, ids)
    finally:
        run_start.undo_log.toggle()


def _read(
    svg: Element,
    chosen: list[Element],
    everything: bool,
    tandem: bool,
    handles: list[HandleObject],
    met: Found,
    hidden: list[tuple[Element, Array]],
    run_start: StartingState,
    styles: Styles,
    ids: Ids,
) -> Document:
    present = dict(met.drawn)
    met = replace(met, drawn=run_start.placed(met.drawn))
    found = [read_shape(element, matrix) for element, matrix in met.drawn]
    found = [shape for shape in found if shape.subpaths]
    skipped = [skipping(element, _SQUASHED) for element in met.squashed]
    placed = [read_placed(element, outer, styles) for element, outer in met.placed if tandem]
    in_css = [item for item in placed if item is not None]
    followers = {item.element for item in in_css}
    left = [element for element, _ in met.placed if element not in followers]
    skipped += [skipping_css(element) for element in [*met.styled, *left]]
    entities: Iterator[Any] = svg.iter(etree.Entity)
    skipped += [
        {
            "id": f"&{entity.name};",
            "why": N_("an entity, which may stand for objects; save the file in Inkscape first"),
        }
        for entity in entities
        if parent_of(entity) is svg or local_tag(parent_of(entity)) in CONTAINERS
    ]
    if not found:
        skipped += [skipping(element) for element, _ in met.other]
        raise DocumentError(nothing_to_reshape(everything, chosen, skipped))
    if all(len(subpath.control) == 0 for shape in found for subpath in shape.subpaths):
        names = ", ".join(shape.name for shape in found[:5])
        raise DocumentError(
            _(
                "{names}: a path with a single point has no curve to reshape. "
                "Select a path with two nodes or more."
            ).format(names=names)
        )
    reshaped = {shape.element for shape in found}
    carried: list[Carried] = [*in_css]
    clones: list[Clone] = []
    come_along: set[Element] = set()
    for element, outer in met.other:
        if local_tag(element) == "use":
            clone = (
                None if is_squashed(outer @ own_matrix(element)) else read_clone(element, outer, ids, styles)
            )
            comes = clone is not None and (tandem or clone.shows(reshaped))
            if clone is not None and tandem:
                clones.append(clone)
        else:
            comes = local_tag(element) in CARRIED and tandem
            if comes and not follows_by_itself(element, styles, ids, reshaped):
                carried.append(read_carried(element, outer, styles))
        if comes:
            come_along.add(element)
        else:
            skipped.append(skipping(element))
    carried += [read_carried(element, outer, styles) for element, outer in hidden]
    skipped += [
        skipping(element, N_("its clip has a transform in units of the box, which programs draw in two ways"))
        for element in clip_finding.with_doubtful_transform(found, styles, ids)
    ]
    others = None if everything else walk(svg, [svg], True, styles)
    bystanders = np.zeros((0, 4, 2)) if others is None else _curves(others, reshaped)
    ground = _ground(found, present, bystanders, run_start)
    known = run_start.again or any(handle.at is not None for handle in handles)
    handle_targets.resolve(handles, ground if known else None)
    if others is not None and run_start.store.records:
        bystanders = np.concatenate([bystanders, _base_curves(others, reshaped, run_start)])
    cutting = clip_finding.find(found, come_along, _held(handles), styles, ids, tandem)
    drawn = len(found)
    found += [shape for clip in cutting if clip.joins for shape in clip.shapes]
    drawing = _drawing(found, handles, bystanders, page_of(svg))
    drawing = replace(drawing, clips=tuple(range(drawn, len(found))))
    return Document(
        svg,
        drawing,
        found,
        handles,
        styles,
        ids,
        run_start,
        met,
        ground,
        others,
        cutting,
        carried,
        clones,
        skipped,
    )


def _ground(
    found: list[Shape], present: dict[Element, Array], bystanders: Array, run_start: StartingState
) -> handle_targets.Ground:
    """The curves that handles lie on.  present : matrices (2, 3) of the present drawing to root user units"""

    def pairs() -> list[tuple[Array, Array]]:
        curves = []
        for shape in found:
            record = run_start.store.records.get(shape.element)
            if shape.element in run_start.back and record is not None:
                now = run_start.undo_log.before(shape.element)
                seen = shape.element.makeelement(now.tag, now.attributes)
                curves.append(pair(read_shape(seen, present[shape.element]), shape, record.cuts))
            else:
                curves.append((shape.control, shape.control))
        return curves

    points = np.concatenate([shape.control.reshape(-1, 2) for shape in found])
    return handle_targets.Ground(run_start.again, float(np.hypot(*np.ptp(points, axis=0))), pairs, bystanders)


def _held(handles: list[HandleObject]) -> Array:
    """The points of curves that the handles hold, (k, 2), root user units."""
    points = [
        handle.hold
        for handle in handles
        if handle.kind in ("pin", "from", "handle") and handle.hold is not None and not handle.no_part
    ]
    return np.array(points, dtype=float).reshape(-1, 2)


def refuse_inner_drawings(chosen: list[Element]) -> None:
    for element in chosen:
        for ancestor in element.iterancestors():
            if local_tag(ancestor) == "svg" and ancestor.getparent() is not None:
                raise DocumentError(
                    _("{name} lies in {parent}, a drawing inside the drawing. Ungroup that first.").format(
                        name=name_of(element), parent=name_of(ancestor)
                    )
                )


def nothing_to_reshape(everything: bool, chosen: list[Element], skipped: list[dict[str, str]]) -> str:
    if everything:
        return _(
            "No path to reshape: the drawing has no visible, unlocked path or shape. Draw or unlock one."
        )
    names = ", ".join(name_of(element) for element in chosen[:5])
    if skipped:
        names = ", ".join(f"{entry['id']} ({_(entry['why'])})" for entry in skipped[:5])
    return _(
        "No path is selected, only {names}. "
        "Select paths or shapes; text becomes one by Path > Object to Path."
    ).format(names=names)


def skipping(element: Element, why: str = "") -> dict[str, str]:
    """The report's entry for a skipped element, with the reason in English."""
    return {"id": name_of(element), "why": why or _WHY_SKIPPED.get(local_tag(element), _TEXT)}


def skipping_css(element: Element) -> dict[str, str]:
    return skipping(element, N_("its place is a property in CSS; write it as attributes"))


def _drawing(
    found: list[Shape], handles: list[HandleObject], bystanders: Array, page: Array | None
) -> Drawing:
    """The drawing with the segments of all shapes; a subpath of one point is a segment without length."""
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
        page=page,
    )
    points, sections = handle_targets.wishes(handles, drawing.diagonal)
    return replace(drawing, handles=points, sections=sections)


def _curves(others: Found, mine: set[Element]) -> Array:
    """Curves of the visible shapes that were not selected, (B, 4, 2); unreadable shapes are left out."""
    control = [np.zeros((0, 4, 2))]
    for element, matrix in others.drawn:
        if element in mine:
            continue
        try:
            shape = read_shape(element, matrix)
        except DocumentError:
            continue  # it has no part in this run, so it is not reported
        if shape.subpaths:
            control.append(shape.control)
    return np.concatenate(control)


def _base_curves(others: Found, mine: set[Element], run_start: StartingState) -> Array:
    """The same curves in the base, (B, 4, 2).  Handles rest there."""
    records = run_start.store.records
    shapes = [
        run_start.store.base_shape(element, matrix)
        for element, matrix in others.drawn
        if element not in mine and element in records and records[element].moves
    ]
    return np.concatenate([np.zeros((0, 4, 2)), *(shape.control for shape in shapes if shape.subpaths)])
