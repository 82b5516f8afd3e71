# SPDX-License-Identifier: GPL-2.0-or-later
"""The plan of an environment: which Python, which packages, from where, before anything is done."""

from __future__ import annotations

import glob
import os
from dataclasses import dataclass
from typing import Iterator

from .. import startup
from ..messages.language import translate as _
from . import faults, managed, pythons
from .machine import WINDOWS, Machine
from .packages import OPTIONAL_PACKAGES, Source, required_packages, source_for
from .setup_errors import SetupError

# Megabytes, measured: what is downloaded, what the environment has, what a managed Python adds to both.
DOWNLOADED, INSTALLED, MANAGED = 75, 280, (60, 150)

# The longest path below the environment, of scipy.
_LONGEST_BELOW = 130

# Where the new environment is made.
NEW = ".venv-new"


@dataclass(frozen=True)
class Plan:
    """What will be done; nothing has been."""

    root: str  # of the extension
    python: pythons.Python | None  # None: uv brings one
    source: Source

    def text(self) -> str:
        """What is downloaded, from where to where, in sentences."""
        more = MANAGED if self.python is None else (0, 0)
        about = {
            "packages": ", ".join((*required_packages(self.python), *OPTIONAL_PACKAGES)),
            "source": self.source.name,
            "folder": os.path.join(self.root, startup.ENVIRONMENT_NAME),
            "size": DOWNLOADED + more[0],
            "room": INSTALLED + more[1],
        }
        if self.source.folder:
            text = _(
                "Packages: {packages}\nfrom the folder: {source}\nto: {folder}\nNothing is downloaded; they"
                " take {room} MB there."
            )
        else:
            text = _(
                "Packages: {packages}\nfrom: {source}\nto: {folder}\nThis downloads about {size} MB, which"
                " take {room} MB there."
            )
        lines = [text.format(**about)]
        if self.python is None:
            text = _(
                "Python {version}, as none that is here can load them\nfrom: {source} (by uv)\nto: {folder}"
            )
            folder = os.path.join(self.root, managed.FOLDER)
            lines.insert(0, text.format(version=managed.VERSION, source=managed.SOURCE, folder=folder))
        else:
            lines.append(_("For {python}, {path}.").format(python=self.python.called, path=self.python.path))
        return "\n".join(lines)


def plan(machine: Machine, root: str, own: str, wheels: str = "") -> Plan:
    """How the environment of an extension would be made.

    root : folder of the extension; own : Inkscape's Python; wheels : a folder of them, empty for the index.
    Raises SetupError where no Python would do, and where the folders can't.
    """
    if wheels and not glob.glob(os.path.join(glob.escape(wheels), "*.whl")):
        raise SetupError(
            _("There are no wheels (*.whl) in {folder}. Choose another folder.").format(folder=wheels)
        )
    _refuse_long_paths(machine, root)
    python = next(python_candidates(machine, root, own), None)
    if python is None and wheels:
        text = _(
            "No Python here can load the wheels in {folder}. Install Python {version} for 64 bit from"
            " python.org."
        )
        raise SetupError(text.format(folder=wheels, version=managed.VERSION))
    return Plan(root, python, source_for(machine, python, wheels))


def python_candidates(machine: Machine, root: str, own: str) -> Iterator[pythons.Python]:
    """Pythons that can make an environment, the best first, at last one that uv has brought before."""
    yield from (python for python in pythons.candidates(machine, own) if python.venv)
    brought = managed.there(root)
    python = pythons.look(machine, brought) if brought else None
    if python is not None:
        yield python


def _refuse_long_paths(machine: Machine, root: str) -> None:
    """Windows without its setting for long paths stops in the midst of scipy."""
    if machine.system != WINDOWS:
        return
    allowed = machine.registry(r"SYSTEM\CurrentControlSet\Control\FileSystem", "LongPathsEnabled")
    below = len(os.path.join(NEW, "Lib", "site-packages")) + 2 + _LONGEST_BELOW
    if "1" not in allowed and len(root) + below > faults.LONGEST_WINDOWS_PATH:
        raise faults.path_too_long(root)
