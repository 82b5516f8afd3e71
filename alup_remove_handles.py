#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Effect: remove the selected handles, or all of them."""

from alup import startup

startup.prepare(__file__)

import inkex

from alup.document import effect, reading, remove_handles


class AlupRemoveHandles(effect.Effect):
    """Extensions > ALUP Reshape > Remove handles..."""

    def add_arguments(self, pars):
        pars.add_argument("--bake", type=inkex.Boolean, default=False)

    def change(self):
        reading.refuse_unknown(self.svg, self.options.ids)
        remove_handles.remove(self.svg, list(self.svg.selection.values()), self.options.bake)


if __name__ == "__main__":
    AlupRemoveHandles.main()
