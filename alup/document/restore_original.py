# SPDX-License-Identifier: GPL-2.0-or-later
"""*Restore original*, and its opposite: forgetting the originals, so that the present state is the new start.

Both change the handles.  After restoring each handle is at the rest of its point, and a `to` is at its
`from`, so the next run moves nothing.  After forgetting, the rest of each handle is its present position.
"""

from __future__ import annotations

from typing import Iterable

import numpy as np

from ..geometry.bezier import Nearest
from ..messages.errors import DocumentError
from ..messages.language import translate as _
from ..model import REACH_OF_DIAGONAL, Array
from . import handle_marks, notes
from .handles.handle_objects import HandleObject, lay_section, move_to, place_text, read_handle, unsettle
from .history.originals import Store, any_stored, is_drawn, marked
from .history.put_back import PutBack
from .history.record_run import tidy_namespace, write_codes
from .tree import fingerprints
from .tree.elements import (
    CARRIED,
    COPY,
    EDITED,
    ORIGINAL,
    REST,
    UNMOVED,
    WRITTEN,
    Element,
    local_tag,
    name_of,
    own_matrix,
    parent_matrix,
    read_shape,
)
from .tree.own_objects import drawn_of, labelled
from .tree.references import Ids
from .tree.styles import Styles
from .tree.undo_log import UndoLog

# Greatest number of names in a message.  More would fill the window.
MOST_NAMES = 8


def restore(svg: Element, selected: list[Element]) -> list[str]:
    """Restore the first originals; returns the names of the restored objects.

    selected : elements, with their descendants; none, or only handles, means the whole drawing
    Handles that rest on restored objects go back as well.  On any error the document is unchanged.
    Raises DocumentError if there is nothing to restore, or if a stored original can't be read.
    """
    handles = [read_handle(element, label) for element, label in labelled(svg)]
    chosen = drawn_of(selected)
    store = Store(svg)
    scope = {part for element in chosen or [svg] for part in element.iter()}
    _refuse(store, scope, bool(chosen))
    drawn = [part for part in svg.iter() if part in scope and local_tag(part) and is_drawn(part)]
    ids = Ids(svg)
    mine = store.concerned(drawn, Styles(svg), ids)
    undo_log = UndoLog()
    done = False
    try:
        going_back = PutBack(store, undo_log, True, ids)
        going_back.put(mine)
        _put_handles_back(handles, store, going_back.back, undo_log, everything=not chosen)
        _note(store, going_back.back, undo_log)
        done = True
    finally:
        if not done:
            undo_log.toggle()
    tidy_namespace(svg)
    handle_marks.show(svg)
    if going_back.unknown:
        control = _curves([element for element in going_back.back if element in store.records])
        notes.tell_of_restoring(svg, going_back.unknown, control)
    return [name_of(element) for element in mine if element in store.records and store.records[element].moves]


def forget(svg: Element, elements: Iterable[Element]) -> int:
    """Delete the originals of elements and their descendants; returns how many shapes and texts had one.

    elements : the root for the whole drawing
    With the last original all other stored data is deleted, and handles rest at their present positions.
    While others remain, the next run that includes one of these elements starts from the present state, and
    its handles rest at their present positions, too.
    Raises HandleError for a handle that can't be read; the document is then unchanged.
    """
    scope = [part for element in elements for part in element.iter() if local_tag(part)]
    dropped = dict.fromkeys(element for element in scope if ORIGINAL in element.attrib)
    count = sum(is_drawn(element) for element in dropped)
    if not count:
        return 0
    last = not any(is_drawn(element) for element in Store(svg).all if element not in dropped)
    handles = [read_handle(element, label) for element, label in labelled(svg)] if last else []
    for element in dropped:
        del element.attrib[ORIGINAL]
        for attribute in (WRITTEN, EDITED):
            element.attrib.pop(attribute, None)
    if last:
        for element in [svg, *marked(svg)]:
            for attribute in (ORIGINAL, WRITTEN, COPY, UNMOVED, EDITED):
                element.attrib.pop(attribute, None)
    for handle in handles:
        _rest_here(handle)
    tidy_namespace(svg)
    return count


def _rest_here(handle: HandleObject) -> None:
    """Make a handle hold the point under it; its position is stored, so that it can be dragged from there."""
    unsettle(handle)
    if handle.kind == "handle":
        handle.element.attrib[REST] = place_text(handle.centre)
    elif handle.kind == "section":
        handle.element.attrib[REST] = place_text(handle.corners)


def _refuse(store: Store, scope: set[Element], some_selected: bool) -> None:
    damaged = [name_of(element) for element in store.damaged if element in scope]
    if damaged:
        raise DocumentError(
            _(
                "The stored original of {name} can't be read. Select other objects, or delete its "
                "attribute alup:original in the XML editor."
            ).format(name=damaged[0])
        )
    if not any(element in scope and is_drawn(element) for element in store.records):
        if some_selected:
            message = _(
                "None of the selected objects has a stored original: they were not reshaped, or their "
                "originals were removed. Select what Reshape has changed."
            )
        else:
            message = _(
                "None of the objects of this drawing has a stored original: they were not reshaped, or their "
                "originals were removed. Select what Reshape has changed."
            )
        raise DocumentError(message)
    strange = store.of_other_moments(scope)
    if strange:
        message = _(
            "{names}: edited between two runs, so that what was there before the first one is not "
            "stored, and would not fit to the others. Select only the others."
        )
        if all(element in store.records for element in strange):
            message = _(
                "{names}: edited between two runs, so that what was there before the first one is not "
                "stored, and would not fit to the others. Select only the others, or only these."
            )
        raise DocumentError(message.format(names=_some([name_of(element) for element in strange])))


def _some(names: list[str]) -> str:
    """The first MOST_NAMES names, and the number of the others."""
    if len(names) <= MOST_NAMES:
        return ", ".join(names)
    return _("{names} and {count} more").format(
        names=", ".join(names[:MOST_NAMES]), count=len(names) - MOST_NAMES
    )


def _note(store: Store, back: set[Element], undo_log: UndoLog) -> None:
    """Record for later runs which elements are at the base again, as long as there is any original."""
    svg = store.svg
    if not any_stored(svg):
        for element in marked(svg):
            if EDITED in element.attrib:
                undo_log.touch(element)
                del element.attrib[EDITED]
    codes = set(store.codes) if any_stored(svg) else set()
    for element in back:
        record = store.records.get(element)
        if any_stored(svg) and record is not None and record.base is None and is_drawn(element):
            codes.add(fingerprints.code(element, parent_matrix(element) @ own_matrix(element)))
    write_codes(svg, codes, undo_log)


def _put_handles_back(
    handles: list[HandleObject], store: Store, back: set[Element], undo_log: UndoLog, everything: bool
) -> None:
    origins = {handle.pair: handle for handle in handles if handle.kind == "from"}
    restored = Nearest(_curves([e for e in back if e in store.records]))
    kept = Nearest(_curves([e for e in store.records if e not in back], store))
    size = np.ptp(restored.control.reshape(-1, 2), axis=0) if len(restored.control) else np.zeros(2)
    reach = REACH_OF_DIAGONAL * float(np.hypot(*size))
    for handle in handles:
        origin = origins.get(handle.pair, handle) if handle.kind == "to" else handle
        rest = origin.rest
        if rest is None or origin.at is None:
            continue
        if handle.kind == "section":
            if everything or restored.is_inside(rest):
                undo_log.touch(handle.element)
                lay_section(handle, rest)
                unsettle(handle)
            continue
        _, _, point, away = restored.find(rest)
        if not everything and away > kept.find(rest)[3]:
            continue
        undo_log.touch(handle.element)
        # If the base differs from the original, the rest may lie beside the restored curves.
        goal = rest if away <= max(handle.radius, reach) else point
        move_to(handle, goal)
        unsettle(handle)
        if handle.kind == "handle" and goal is not rest:
            handle.element.attrib[REST] = place_text(goal)


def _curves(elements: list[Element], store: Store | None = None) -> Array:
    """Curves of drawn shapes (n, 4, 2), root user units; in their present state, or in the base."""
    control = [np.zeros((0, 4, 2))]
    for element in elements:
        if not is_drawn(element) or local_tag(element) in CARRIED:
            continue
        matrix = (parent_matrix(element) @ own_matrix(element))[:2]
        shape = read_shape(element, matrix) if store is None else store.base_shape(element, matrix)
        control += [shape.control] if shape.subpaths else []
    return np.concatenate(control)
