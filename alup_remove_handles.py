#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Effect: remove the selected handles, or all of them."""

from alup import startup

startup.prepare(__file__)

import inkex

from alup.document import effect, handle_marks, reading, restore_original
from alup.document.tree.own_objects import drawn_of
from alup.messages.errors import HandleError
from alup.messages.language import N_
from alup.messages.language import translate as _

NONE = N_("There are no handles in the drawing: nothing to remove.")
NONE_STORED = N_("There are no handles to remove, and no shape is stored from before: nothing was changed.")


class AlupRemoveHandles(effect.Effect):
    """Extensions > ALUP Reshape > Remove handles..."""

    def add_arguments(self, pars):
        pars.add_argument("--bake", type=inkex.Boolean, default=False)

    def change(self):
        reading.refuse_unknown(self.svg, self.options.ids)
        selected = list(self.svg.selection.values())
        forgotten = restore_original.forget(self.svg, self._baked(selected)) if self.options.bake else 0
        if not handle_marks.remove(self.svg, selected) and not forgotten:
            raise HandleError(_(NONE_STORED if self.options.bake else NONE))

    def _baked(self, selected):
        """The selected objects of the drawing, or all of it."""
        return drawn_of(selected) or [self.svg]


if __name__ == "__main__":
    AlupRemoveHandles.main()
