#!/usr/bin/env python3
"""Effect: bring back what the selected objects were before they were reshaped.

All work is in the package `alup`; this file turns the package's errors into Inkscape's message.
"""

from alup import startup

startup.prepare(__file__)

import inkex

from alup import document
from alup.errors import AlupError


class AlupRestoreOriginal(inkex.EffectExtension):
    """Extensions > ALUP Reshape > Restore original"""

    def effect(self):
        try:
            self._check_ids()
            document.restore(self.svg, list(self.svg.selection.values()))
        except AlupError as error:
            raise inkex.AbortExtension(str(error)) from error

    def _check_ids(self):
        missing = [wanted for wanted in self.options.ids if self.svg.getElementById(wanted) is None]
        if missing:
            raise AlupError("There is no object with the id {}. Check --id.".format(", ".join(missing)))


if __name__ == "__main__":
    AlupRestoreOriginal().run()
