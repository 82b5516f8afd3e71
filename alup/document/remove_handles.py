# SPDX-License-Identifier: GPL-2.0-or-later
"""Remove handles, and forget the shapes from before with them if that is asked for."""

from __future__ import annotations

from typing import Sequence

from ..messages.errors import HandleError
from ..messages.language import N_
from ..messages.language import translate as _
from . import handle_marks, restore_original
from .tree.elements import Element
from .tree.own_objects import drawn_of

_NONE = N_("There are no handles in the drawing: nothing to remove.")
_NONE_STORED = N_("There are no handles to remove, and no shape is stored from before: nothing was changed.")


def remove(svg: Element, selected: Sequence[Element], bake: bool) -> None:
    """Remove the selected handles, or all if none is selected.

    bake : forget the stored shapes of the selected objects, or of all, so that what is drawn is the original
    Raises HandleError if there was nothing to remove or to forget.
    """
    forgotten = restore_original.forget(svg, drawn_of(selected) or [svg]) if bake else 0
    if not handle_marks.remove(svg, selected) and not forgotten:
        raise HandleError(_(_NONE_STORED if bake else _NONE))
