#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Effect: drag points of the drawing in a window of its own, and see the curves follow.

All work is in the package `alup`; this file turns the package's errors into Inkscape's message.
"""

from alup import startup

startup.prepare(__file__)

import gc
import signal
import sys

from alup.document import effect, reading
from alup.live import window
from alup.session.options import Options

# A window lives longer than other effects, for which this is off.
gc.enable()


class AlupLive(effect.Effect):
    """Extensions > ALUP Reshape > Reshape live"""

    def change(self):
        # Inkscape ends effects so; the window is to end as well.
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
        reading.refuse_unknown(self.svg, self.options.ids)
        tree = window.reshape(self.svg, list(self.svg.selection.values()), Options())
        if tree is not None:
            self.document = tree
            self.svg = tree.getroot()


if __name__ == "__main__":
    AlupLive.main()
