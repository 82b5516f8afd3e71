# SPDX-License-Identifier: GPL-2.0-or-later
"""Notes beside the drawing about what a run could not take along.

Inkscape shows an effect's standard error in a window that has to be closed.  In a live preview the window
opens after each run, behind the dialog.  In batch nobody closes it, and Inkscape waits for ever.  An effect
can't change its own dialog.  Therefore notes are texts in the drawing: above it, or below it if the page has
room only there.  They form a locked group in the layer of the handles.  So they appear in the preview and are
undone with the run.  The next run replaces them, and removing the handles removes them.  Notes concern
visible objects only.
"""

from __future__ import annotations

from typing import Callable, Sequence

import numpy as np

from ..messages.language import N_
from ..messages.language import translate as _
from ..model import Array
from .handles.handle_layer import MOVED_OF_RADIUS, Layer, Size, is_moved
from .handles.handle_objects import HandleObject, read_handle, take_out
from .painted_shapes import RADIUS_OF_DRAWING
from .reading import UNSEEN, Document
from .tree import own_objects
from .tree.elements import Element, name_of, page_of
from .tree.references import Ids

# Greatest number of wrapped lines.  More would be as large as a drawing and out of sight.  The report has all
# notes.
MOST_LINES = 8

_SKIPPED = N_("{name}: {why}.")
_IGNORED = N_("The handle {name} lies on nothing that was reshaped.")
_STILL = N_("Nothing has moved: every handle is where it was placed. Drag one and reshape again.")
_UNKNOWN = N_("{name}: what cut or painted it at first is not in this drawing, so it keeps what it has now.")
_MORE = N_("And {count} more of such; a report from the command line has all.")


def tell(document: Document, notes: Sequence[str], ignored: Sequence[str], changed: bool) -> list[str]:
    """Write the notes of a run beside the drawing; returns the lines.

    notes : of the solution, in the user's language; ignored : names of handles without part in the run
    changed : whether the run changed anything
    """
    svg = document.svg
    handles = [read_handle(element, label) for element, label in own_objects.labelled(svg)]
    lines: list[str] = []
    if changed or any(_is_away(handle) for handle in handles):
        seen = [entry for entry in document.skipped if entry["why"] not in UNSEEN]
        lines += [_(_SKIPPED).format(name=entry["id"], why=_(entry["why"])) for entry in seen]
        lines += [*notes, *(_(_IGNORED).format(name=name) for name in ignored)]
    elif own_objects.groups(svg, own_objects.LAYER_LABEL):  # handles without a layer were made by a program
        lines.append(_(_STILL))
    clear(svg)
    return write(svg, lines, document.drawing.control)


def _is_away(handle: HandleObject) -> bool:
    """Whether a handle is not at its rest.  After a run a `from` has a stored rest as well."""
    if handle.kind == "from":
        apart = 0.0 if handle.rest is None else float(np.abs(handle.centre - handle.rest).max())
        return apart > MOVED_OF_RADIUS * handle.radius
    return handle.kind in ("handle", "section") and is_moved(handle)


def tell_of_restoring(svg: Element, unknown: Sequence[Element], control: Array) -> None:
    """Write notes about what *Restore original* could not restore.

    control : (n, 4, 2) the restored curves
    """
    write(svg, [_(_UNKNOWN).format(name=name_of(element)) for element in unknown], control)


def write(svg: Element, notes: Sequence[str], control: Array) -> list[str]:
    """Write notes beside curves (n, 4, 2), root user units, no wider than these; returns those that fit."""
    if not notes or not len(control):
        return list(notes)
    low, high = control.reshape(-1, 2).min(axis=0), control.reshape(-1, 2).max(axis=0)
    diagonal = float(np.hypot(*(high - low)))
    layer = Layer(svg, Size(diagonal, RADIUS_OF_DRAWING * diagonal))
    few = _few(notes, lambda note: layer.wrapped(note, float(high[0] - low[0])))
    height = layer.height_of(sum(len(lines) for lines in few))
    page = page_of(svg)
    above = page is None or low[1] - height >= page[0, 1] or high[1] + height > page[1, 1]
    layer.add_notes(Ids(svg), few, np.array([low[0], low[1] - height if above else high[1]]))
    return [" ".join(lines) for lines in few]


def _few(notes: Sequence[str], wrapped: Callable[[str], list[str]]) -> list[list[str]]:
    """The lines of the first notes that fit, and the number of the others; a very long note is cut."""
    found = [wrapped(note) for note in notes]
    count = len(notes)
    while count > 1 and sum(map(len, found)) > MOST_LINES:
        count -= 1
        found = [*found[:count], wrapped(_(_MORE).format(count=len(notes) - count))]
    over = sum(map(len, found)) - MOST_LINES
    if over > 0:
        kept = found[0][: max(len(found[0]) - over, 1)]
        found[0] = [*kept[:-1], kept[-1] + "\u2026"]
    return found


def clear(svg: Element) -> int:
    """Remove all notes; returns the number of their groups."""
    found = own_objects.groups(svg, own_objects.NOTES_LABEL)
    for group in found:
        take_out(group)
    return len(found)
