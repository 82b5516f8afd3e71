#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Effect: put handles on the selected objects: at nodes, extremes, corners or guides, or around them."""

from alup import startup

startup.prepare(__file__)

from alup.document import effect, place_handles, reading


class AlupPlaceHandles(effect.Effect):
    """Extensions > ALUP Reshape > Place handles..."""

    def add_arguments(self, pars):
        pars.add_argument("--where", default="auto", choices=place_handles.WHERE)

    def change(self):
        reading.refuse_unknown(self.svg, self.options.ids)
        selected = list(self.svg.selection.values())
        place_handles.place(self.svg, self.options.where, selected, self.options.selected_nodes).check()


if __name__ == "__main__":
    AlupPlaceHandles.main()
