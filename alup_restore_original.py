#!/usr/bin/env python3
"""Effect: bring back what the selected objects were before they were reshaped.

All work is in the package `alup`; this file turns the package's errors into Inkscape's message.
"""

from alup import startup

startup.prepare(__file__)

import inkex

from alup import document
from alup.errors import AlupError


class AlupRestoreOriginal(document.Effect):
    """Extensions > ALUP Reshape > Restore original"""

    def effect(self):
        try:
            document.refuse_unknown(self.svg, self.options.ids)
            document.restore(self.svg, list(self.svg.selection.values()))
        except AlupError as error:
            raise inkex.AbortExtension(str(error)) from error


if __name__ == "__main__":
    AlupRestoreOriginal.main()
