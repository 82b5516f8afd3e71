# SPDX-License-Identifier: GPL-2.0-or-later
"""*Set up* from within Inkscape: in a GTK window if GTK is available, else by Inkscape's own means.

Without GTK the plan is first written to the standard error, which Inkscape shows in a window.  The user
agrees by *Begin at once* in the dialog.  The work is cancelled when the standard output is closed: when
Inkscape is ended, or by the button *Cancel* of the window that newer versions show while an effect works.
"""

from __future__ import annotations

import os
import select
import sys
from typing import Any

from .. import startup
from ..messages.language import translate as _
from .job import Job
from .machine import Machine
from .progress import Progress
from .setup_errors import Cancelled, SetupError


class StandardOutput(Progress):
    """Progress that counts as cancelled when the standard output is closed."""

    def cancelled(self) -> bool:
        if sys.stdout is None or not hasattr(select, "poll"):
            return False
        watch = select.poll()
        watch.register(sys.stdout.fileno(), 0)
        return any(event & (select.POLLERR | select.POLLNVAL) for _file, event in watch.poll(0))


def set_up(root: str, from_folder: bool, wheels: str, agreed: bool) -> int:
    """Set up the extension; returns the exit code, 0 if the environment exists in the end.

    from_folder : whether packages come from the folder `wheels`; agreed : begin without asking
    """
    job = Job(Machine(), root, wheels, _inkex(root), sys.executable)
    try:
        if from_folder:
            _refuse_no_folder(wheels)
        window = _window()
        if window is not None:
            return int(window.open_window(job, agreed))
        the_plan = job.plan()
        if not agreed:
            text = _("To do it, choose Set up... once more, with a tick at Begin at once.")
            sys.stderr.write(f"{job.state()}\n\n{the_plan.text()}\n\n{text}\n")
            return 1
        sys.stderr.write(job.do(the_plan, StandardOutput()) + "\n")
    except SetupError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    except Cancelled:
        sys.stderr.write(_("Cancelled; nothing was changed.") + "\n")
        return 1
    return 0


def _refuse_no_folder(wheels: str) -> None:
    if not os.path.isdir(wheels):
        text = _("Choose a folder of wheels first; {folder} is none.")
        raise SetupError(text.format(folder=wheels or "\u2026"))


def _window() -> Any:
    """The module of the window; None if this Python has no GTK, or if there is no screen."""
    try:
        from . import setup_window
    except (ImportError, ValueError):
        return None
    return setup_window if setup_window.can_open() else None


def _inkex(root: str) -> str:
    """The folder of inkex: that of the running Inkscape, else that of an installed one."""
    return startup.inkex_folder_of_running_inkscape(root) or startup.ask_inkscape_for_inkex()
