#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Effect: bring back what the selected objects were before they were reshaped.

All work is in the package `alup`.
"""

from alup import startup

startup.prepare(__file__)

from alup.document import effect, reading, restore_original


class AlupRestoreOriginal(effect.Effect):
    """Extensions > ALUP Reshape > Restore original"""

    def change(self):
        reading.refuse_unknown(self.svg, self.options.ids)
        restore_original.restore(self.svg, list(self.svg.selection.values()))


if __name__ == "__main__":
    AlupRestoreOriginal.main()
