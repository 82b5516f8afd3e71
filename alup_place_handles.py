#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Effect: put handles on the selected objects: at nodes, extremes, corners or guides, or around them."""

from alup import startup

startup.prepare(__file__)

from alup.document import effect, place_handles, reading
from alup.messages.errors import HandleError
from alup.messages.language import N_
from alup.messages.language import translate as _

HELD = N_(
    "Nothing was added: there are handles at all {count} places already. Drag these, or remove them first."
)
ONE_HELD = N_("Nothing was added: there is a handle already. Drag it, or remove it first.")


class AlupPlaceHandles(effect.Effect):
    """Extensions > ALUP Reshape > Place handles..."""

    def add_arguments(self, pars):
        pars.add_argument("--where", default="auto", choices=place_handles.WHERE)

    def change(self):
        reading.refuse_unknown(self.svg, self.options.ids)
        selected = list(self.svg.selection.values())
        placed = place_handles.place(self.svg, self.options.where, selected, self.options.selected_nodes)
        if not placed.added:
            raise HandleError(_(ONE_HELD if placed.kept == 1 else HELD).format(count=placed.kept))


if __name__ == "__main__":
    AlupPlaceHandles.main()
