# SPDX-License-Identifier: GPL-2.0-or-later
"""Colours of handles, arrows to moved ones, and the removal of handles with all that belongs to them."""

from __future__ import annotations

from typing import Iterable, Sequence

from .handles.handle_layer import FRAME_MOVED, FRAME_STAYS, MOVED, STAYS, Layer, Size, is_moved
from .handles.handle_objects import HandleObject, read_handle, take_out
from .history.record_run import tidy_namespace
from .painted_shapes import RADIUS_OF_DRAWING, diagonal_of, painted_shapes, segments_of
from .tree import own_objects
from .tree.css import with_property
from .tree.elements import Element
from .tree.own_objects import ARROW, ARROWS_LABEL, LAYER_LABEL, NOTES_LABEL, groups, labelled
from .tree.references import Ids


def show(svg: Element, diagonal: float | None = None) -> None:
    """Update colours after a run, and arrows if the layer of *Place handles* is there.

    diagonal : of what was reshaped, in user units; None: it is measured
    """
    handles = [read_handle(element, label) for element, label in labelled(svg)]
    recolour(handles)
    if groups(svg, LAYER_LABEL):
        arrows(svg, handles, diagonal)


def clear(svg: Element) -> None:
    """Remove arrows, and the layer if it is then empty."""
    arrows(svg, [])
    for layer in groups(svg, LAYER_LABEL):
        if not len(layer):
            take_out(layer)


def recolour(handles: Iterable[HandleObject]) -> None:
    """Colour handles red at rest and blue if moved.  Handles in colours that the user has chosen keep them.

    Frames are magenta and cyan, also those that an older version drew in red and blue.
    """
    for handle in handles:
        frame = handle.kind == "section"
        key = "stroke" if frame else "fill"
        style = handle.element.attrib.get("style") or ""
        parts = style.replace(" ", "").lower().split(";")
        ours = {STAYS, MOVED, FRAME_STAYS, FRAME_MOVED} if frame else {STAYS, MOVED}
        stays, moved = (FRAME_STAYS, FRAME_MOVED) if frame else (STAYS, MOVED)
        colour = moved if is_moved(handle) else stays
        if any(f"{key}:{other}" in parts for other in ours - {colour}):
            handle.element.attrib["style"] = with_property(style, key, colour)


def arrows(svg: Element, handles: Sequence[HandleObject], diagonal: float | None = None) -> None:
    """Replace all arrows by new ones from rest to each moved handle.

    diagonal : of all visible shapes, in user units; None: it is measured
    """
    moved = [handle for handle in handles if handle.kind in ("handle", "section") and is_moved(handle)]
    notes = groups(svg, NOTES_LABEL)
    for old in [*own_objects.arrows(svg), *groups(svg, ARROWS_LABEL), *notes]:
        take_out(old)
    if notes:  # the layer may have been made for notes alone
        for layer_ in groups(svg, LAYER_LABEL):
            if not len(layer_):
                take_out(layer_)
    if not moved:
        return
    if diagonal is None:
        diagonal = diagonal_of(segments_of(painted_shapes(svg, [])))
    layer, ids = Layer(svg, Size(diagonal, RADIUS_OF_DRAWING * diagonal)), Ids(svg)
    for handle in moved:
        layer.add_arrow(ids, handle)


def remove(svg: Element, selected: Sequence[Element]) -> int:
    """Remove the selected handles, or all if none is selected, with their partners, arrows and empty layers.

    The notes of a run are removed with the last handle.  Returns the number of removed handles and groups of
    notes.
    """
    found = list(labelled(svg))
    chosen = {element for element, _ in found}.intersection(selected) or {element for element, _ in found}
    pairs = {_pair(label) for element, label in found if element in chosen} - {None}
    gone = [element for element, label in found if element in chosen or _pair(label) in pairs]
    notes = groups(svg, NOTES_LABEL) if len(gone) == len(found) else []
    for group in notes:
        take_out(group)
    if not gone and not notes:
        return 0
    names = {element.attrib.get("id") for element in gone}
    for arrow in own_objects.arrows(svg):
        if arrow.attrib[ARROW] in names or len(gone) == len(found):
            take_out(arrow)
    for group in groups(svg, ARROWS_LABEL):
        if not len(group):
            take_out(group)
    for element in gone:
        take_out(element)
    for layer in groups(svg, LAYER_LABEL):
        if not len(layer):
            take_out(layer)
    tidy_namespace(svg)
    return len(gone) + len(notes)


def _pair(label: str) -> str | None:
    """The name that a label has in common with its partner's."""
    kind, _, name = label[len("alup:") :].strip().partition(" ")
    return name.strip() if kind in ("from", "to") else None
