# SPDX-License-Identifier: GPL-2.0-or-later
"""The work of *Set up* within Inkscape, independent of its user interface: the plan, the work, the result."""

from __future__ import annotations

from dataclasses import dataclass

from .. import startup
from ..messages.language import translate as _
from . import environment, environment_plan, lock
from .machine import Machine
from .progress import Progress


@dataclass(frozen=True)
class Job:
    """The set-up of the extension that this program belongs to."""

    machine: Machine
    root: str
    wheels: str
    inkex: str  # folder of Inkscape's inkex, empty where it is not known
    own: str  # Inkscape's Python

    def plan(self) -> environment_plan.Plan:
        return environment_plan.plan(self.machine, self.root, self.own, self.wheels)

    def do(self, the_plan: environment_plan.Plan, progress: Progress) -> str:
        """Set up; returns a message with the result.  Raises SetupError or Cancelled."""
        with lock.held(self.root):
            left_out = environment.set_up(self.machine, the_plan, self.inkex, self.own, progress)
        lines = [_("ALUP Reshape is set up. Choose Extensions > ALUP Reshape > Place handles, then Reshape.")]
        text = _("Note: {package} is not to be had for this Python; something slower or simpler stands in.")
        return "\n".join([*lines, *(text.format(package=package) for package in left_out)])

    def state(self) -> str:
        """A sentence about the present environment."""
        record = startup.read_record(self.root)
        if record is None:
            return _("ALUP Reshape is not set up yet.")
        return _("ALUP Reshape was set up for {python}; this does it anew.").format(python=record["python"])
