#!/usr/bin/env python3
"""Effect: put handles on the selected objects: at nodes, extremes, corners or guides, or around them."""

from alup import startup

startup.prepare(__file__)

import inkex

from alup import document
from alup.document import placing
from alup.errors import AlupError, HandleError
from alup.language import N_
from alup.language import translate as _

HELD = N_(
    "Nothing was added: there are handles at all {count} places already. Drag these, or remove them first."
)
ONE_HELD = N_("Nothing was added: there is a handle already. Drag it, or remove it first.")


class AlupPlaceHandles(document.Effect):
    """Extensions > ALUP Reshape > Place handles..."""

    def add_arguments(self, pars):
        pars.add_argument("--where", default="auto", choices=placing.WHERE)

    def effect(self):
        try:
            self._place()
        except AlupError as error:
            raise inkex.AbortExtension(str(error)) from error

    def _place(self):
        document.refuse_unknown(self.svg, self.options.ids)
        selected = list(self.svg.selection.values())
        placed = placing.place(self.svg, self.options.where, selected, self.options.selected_nodes)
        if not placed.added:
            raise HandleError(_(ONE_HELD if placed.kept == 1 else HELD).format(count=placed.kept))


if __name__ == "__main__":
    AlupPlaceHandles.main()
