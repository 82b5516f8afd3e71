# SPDX-License-Identifier: GPL-2.0-or-later
"""All that the page says, in the language of the user."""

from __future__ import annotations

from ..messages.language import N_, code
from ..messages.language import translate as _

_WORDS = {
    "title": N_("Reshape live"),
    "hold": N_("Hold together:"),
    "hold_tip": N_(
        "How firmly parts that lie side by side keep their distance. Apart: parts without a pin stay."
    ),
    "hold_normally": N_("normally"),
    "hold_firmly": N_("firmly"),
    "hold_loosely": N_("loosely"),
    "hold_apart": N_("apart: the others stay"),
    "method": N_("Method:"),
    "method_tip": N_(
        "Reshape changes proportions and keeps directions. The others turn parts, for an arm that is to "
        "point elsewhere."
    ),
    "method_alup": N_("reshape"),
    "method_arap": N_("pose, as stiff as can be"),
    "method_killing": N_("pose, flowing"),
    "method_puppet": N_("pose, like a puppet"),
    "method_poisson": N_("spread the move along the curves"),
    "symmetric": N_("Symmetric dragging"),
    "symmetric_tip": N_("A pin on the other side of the dashed line moves along, mirrored."),
    "regular": N_("What is regular:"),
    "keep_regular": N_("keep"),
    "keep_regular_tip": N_(
        "Wheels stay round, windows of one size in their rows, edges upright and parallel, letters on their "
        "line, mirrored halves alike, unless pins ask for something else."
    ),
    "show_regular": N_("show"),
    "show_regular_tip": N_("Thin lines over the circles, rows, equal parts, lines and words that were found"),
    "nothing_regular": N_("nothing was found"),
    "undo": N_("Undo (Ctrl+Z)"),
    "redo": N_("Redo (Ctrl+Shift+Z)"),
    "before": N_("Before"),
    "before_tip": N_("Hold to see the drawing as it was (key B)"),
    "fit": N_("Fit"),
    "fit_tip": N_("Show the whole drawing (key 0)"),
    "delete": N_("Delete"),
    "delete_tip": N_("Let go of the selected pin or frame (Delete)"),
    "cancel": N_("Cancel"),
    "cancel_tip": N_("Close; the drawing stays as it was"),
    "done": N_("Done"),
    "done_tip": N_("Put the new shape into the drawing (Ctrl+Enter)"),
    "first_1": N_("Click on a curve: a pin holds this point."),
    "first_2": N_("Drag a pin, or a curve: the drawing follows while you drag."),
    "first_3": N_("Drag a rectangle around a part: a frame holds it, or moves it as a whole."),
    "first_go": N_("Click anywhere to begin."),
    "pin": N_("Pin {number}, holds its point"),
    "pin_moved": N_("Pin {number}, moved"),
    "frame": N_("Frame {number}, holds what is in it"),
    "frame_moved": N_("Frame {number}, moved"),
    "corner": N_("Corner of frame {number}: drag to scale"),
    "canvas": N_("The drawing. Click on curves to set pins."),
    "hint": N_("Click on a curve: a pin. Drag pins and curves. Delete lets go; Shift: one axis; B: before."),
    "refining": N_("Refining\u2026"),
    "ready": N_("All handles met. {seconds} s"),
    "writing": N_("Writing the drawing\u2026"),
    "ended": N_("This window is finished. You can close it."),
    "lost": N_("The drawing is no longer connected; nothing was changed. Close this window."),
}


def words() -> dict[str, str]:
    """The texts by their names, and the language they are in, as a page declares it."""
    found = {name: _(text) for name, text in _WORDS.items()}
    return {**found, "language": code()}
