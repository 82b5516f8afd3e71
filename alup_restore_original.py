#!/usr/bin/env python3
"""Effect: bring back what the selected objects were before they were reshaped.

All work is in the package `alup`; this file turns the package's errors into Inkscape's message.
"""

from alup import startup

startup.prepare(__file__)

import inkex

from alup import document
from alup.errors import AlupError
from alup.language import translate as _


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
            message = _("There is no object with the id {ids}. Check --id.")
            raise AlupError(message.format(ids=", ".join(missing)))


if __name__ == "__main__":
    AlupRestoreOriginal().run()
