#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Effect: make the private environment of this extension, repair it or renew it.

It runs when packages are missing, so this file imports nothing but the standard library when it runs, and
GTK where Inkscape's Python has it.  The work is in `alup/setup/`.  The drawing stays as it is; the exit code
is 0 when the environment is there in the end.
"""

import os
import sys

from alup import startup

ROOT = os.path.dirname(os.path.abspath(__file__))
startup.forget_working_folder(ROOT)

import argparse

from alup.setup import desk

HELP = "see alup_set_up.inx"


def add_arguments(parser):
    """The parameters of the .inx."""
    parser.add_argument("--source", default="internet", choices=("internet", "folder"))
    parser.add_argument("--wheels", default="", help="folder of wheels, for --source=folder")
    parser.add_argument("--agree", default="false", help="true: begin at once, without asking in a window")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0], allow_abbrev=False)
    add_arguments(parser)
    # What Inkscape says of the selection, and the drawing, are of no interest.
    options = parser.parse_known_args()[0]
    wheels = options.wheels if options.source == "folder" else ""
    return desk.set_up(ROOT, options.source == "folder", wheels, options.agree.lower() == "true")


if __name__ == "__main__":
    sys.exit(main())

import inkex


class AlupSetUp(inkex.EffectExtension):
    """Extensions > ALUP Reshape > Set up..., for programs that import effects.

    Inkscape starts the file itself, which then does the same without inkex.
    """

    def add_arguments(self, pars):
        pars.add_argument("--source", default="internet", choices=("internet", "folder"))
        pars.add_argument("--wheels", default="", help="folder of wheels, for --source=folder")
        pars.add_argument("--agree", type=inkex.Boolean, default=False)

    def effect(self):
        wheels = self.options.wheels if self.options.source == "folder" else ""
        if desk.set_up(ROOT, self.options.source == "folder", wheels, self.options.agree):
            raise inkex.AbortExtension(HELP)
