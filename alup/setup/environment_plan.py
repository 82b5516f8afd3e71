# SPDX-License-Identifier: GPL-2.0-or-later
"""The plan of an environment: which Python and which packages, and from where.  Nothing is changed here."""

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

# Megabytes, measured: the download, the environment, and the additions of a managed Python to both.
DOWNLOADED, INSTALLED, MANAGED = 75, 280, (60, 150)

# Length of the longest path below the environment; it is one of scipy.
_LONGEST_BELOW = 130

# Name of the folder in which the new environment is made.
NEW = ".venv-new"


@dataclass(frozen=True)
class Plan:
    """What a set-up will do."""

    root: str  # of the extension
    python: pythons.Python | None  # None: uv brings one
    source: Source

    def text(self) -> str:
        """The plan for the user: what is downloaded, from where, and to which folder."""
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
    """The plan of an extension's environment.

    root : folder of the extension; own : Inkscape's Python; wheels : a folder of wheels, empty for the index
    Raises SetupError if no Python is suitable, if the folder has no wheels, or if paths would be too long.
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
    """Pythons that can make an environment, the best first, the one that uv has fetched before last."""
    yield from (python for python in pythons.candidates(machine, own) if python.venv)
    brought = managed.there(root)
    python = pythons.look(machine, brought) if brought else None
    if python is not None:
        yield python


def _refuse_long_paths(machine: Machine, root: str) -> None:
    """Raise SetupError if paths would be too long for Windows, where unpacking scipy would fail."""
    if machine.system != WINDOWS:
        return
    allowed = machine.registry(r"SYSTEM\CurrentControlSet\Control\FileSystem", "LongPathsEnabled")
    below = len(os.path.join(NEW, "Lib", "site-packages")) + 2 + _LONGEST_BELOW
    if "1" not in allowed and len(root) + below > faults.LONGEST_WINDOWS_PATH:
        raise faults.path_too_long(root)
