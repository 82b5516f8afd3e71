# SPDX-License-Identifier: GPL-2.0-or-later
"""The packages of the environment: their names, their source, and their installation by pip.

pip is not part of the environment.  It runs from a wheel: one that came with the Python, one in the folder of
wheels, or one from the package index.
"""

from __future__ import annotations

import glob
import os
import re
import tempfile
import zipfile
from dataclasses import dataclass
from typing import Iterable

from .. import startup
from ..messages.language import translate as _
from . import download, faults, pythons
from .inkscapes import FLATPAK_NAME
from .machine import Machine
from .progress import Progress, Quiet, run
from .setup_errors import SetupError, UnfitPythonError

# The packages that runs need.  inkex does not allow version 6 of lxml.
PACKAGES = ("numpy", "scipy", "lxml<6", "cssselect", "tinycss2")

# For Python 3.14 and later there is no wheel of lxml 5.  The parts of inkex that are used here work with
# version 6.
PACKAGES_SINCE_3_14 = ("numpy", "scipy", "lxml<7", "cssselect", "tinycss2")

# qdldl makes runs faster, and libigl enables more methods.  Not every machine has wheels of them.
OPTIONAL_PACKAGES = ("qdldl", "libigl")

PUBLIC_INDEX = "https://pypi.org/simple"

# Lines of pip's output, in the order in which they appear.
_COLLECTING = re.compile(r"^Collecting ([\w.-]+)|^Processing .*?([\w.]+)-[^/\\]+\.whl$")
_INSTALLING = "Installing collected packages"


@dataclass(frozen=True)
class Source:
    """Where packages come from: a folder of wheels, or a package index."""

    folder: str = ""
    index: str = PUBLIC_INDEX

    @property
    def name(self) -> str:
        return self.folder or self.index

    def options(self) -> list[str]:
        """The options of pip for this source."""
        return ["--no-index", "--find-links", self.folder] if self.folder else ["--index-url", self.index]


def source_for(machine: Machine, python: pythons.Python | None, wheels: str) -> Source:
    """The source of packages: the folder of wheels if there is one, else pip's configured package index."""
    return Source(folder=os.path.abspath(wheels)) if wheels else Source(index=_index(machine, python))


def _index(machine: Machine, python: pythons.Python | None) -> str:
    """The URL of the package index that pip is configured for."""
    given = machine.variables.get("PIP_INDEX_URL")
    if given:
        return given
    if python is None or not python.pip:
        return PUBLIC_INDEX
    command = [python.path, "-E", "-s", os.path.join(python.pip, "pip"), "config", "get", "global.index-url"]
    return machine.ask(command).strip() or PUBLIC_INDEX


def required_packages(python: pythons.Python | None) -> tuple[str, ...]:
    """The packages that runs need under a Python, None for a managed one."""
    return PACKAGES_SINCE_3_14 if python is not None and python.version >= (3, 14) else PACKAGES


def fetch_optional(
    machine: Machine, venv: str, pip: str, source: Source, python: pythons.Python, progress: Progress
) -> list[str]:
    """Install missing optional packages, together or else one by one; returns those not available."""
    lacking = [package for package in OPTIONAL_PACKAGES if not _has(venv, package)]
    for number, packages in enumerate([lacking, *([package] for package in lacking)]):
        packages = [package for package in packages if not _has(venv, package)]
        if packages:
            progress.step(
                _("Fetching {package} ...").format(package=", ".join(packages)), 0.75 + 0.04 * number
            )
            try:
                install(machine, venv, pip, packages, source, python, Quiet(progress))
            except SetupError:
                continue  # missing packages are returned in the end
    return [package for package in lacking if not _has(venv, package)]


def add_optional(
    machine: Machine, venv: str, python: pythons.Python, source: Source, progress: Progress
) -> list[str]:
    """Install optional packages that an existing environment lacks; returns those that are not available."""
    names = [name for name in OPTIONAL_PACKAGES if not _has(venv, name)]
    if not names:
        return []
    with tempfile.TemporaryDirectory() as folder:
        pip = unpacked_pip(python, source, folder, progress)
        return fetch_optional(machine, venv, pip, source, python, progress)


def install(
    machine: Machine,
    venv: str,
    pip: str,
    packages: Iterable[str],
    source: Source,
    python: pythons.Python,
    progress: Progress,
) -> None:
    """Install packages into an environment by pip.

    Raises UnfitPythonError if there is no wheel for this Python, and SetupError for any other failure.
    """
    seen: list[str] = []

    def on_line(line: str) -> None:
        found = _COLLECTING.match(line)
        package = (found[1] or found[2]) if found else ""
        if package and package not in seen:
            seen.append(package)
            # There are about six packages, including dependencies.  The shares of the time were measured.
            progress.step(_("Fetching {package} ...").format(package=package), 0.1 + 0.08 * min(len(seen), 6))
        elif line.startswith(_INSTALLING):
            progress.step(_("Unpacking ..."), 0.65)

    # No cache, because it is outside the folder.  Only wheels, because nothing is compiled here.
    options = ["--no-cache-dir", "--disable-pip-version-check", "--no-input", "--only-binary", ":all:"]
    options += ["--progress-bar", "off", "--no-warn-script-location", *source.options()]
    command = [environment_python(venv), "-E", "-s", pip, "install", *options, *packages]
    code, words = run(command, machine.environment(PYTHONIOENCODING=None), progress, on_line)
    if code:
        error = faults.of_words(
            words,
            folder=venv,
            index=source.name,
            python=python.called,
            proxy=download.proxy(),
            flatpak=machine.variables.get("FLATPAK_ID") == FLATPAK_NAME,
        )
        raise UnfitPythonError(str(error)) if "No matching distribution" in words else error


def unpacked_pip(python: pythons.Python, source: Source, folder: str, progress: Progress) -> str:
    """Path of pip, unpacked into a folder as a program for any Python.  Raises SetupError."""
    given = sorted(glob.glob(os.path.join(glob.escape(source.folder), "pip-*.whl"))) if source.folder else []
    wheel = python.pip or (given[-1] if given else "")
    if not wheel and source.folder:
        text = _("{python} has no pip. Put a wheel of pip (pip-*.whl) into {folder} as well.")
        raise UnfitPythonError(text.format(python=python.called, folder=source.folder))
    if not wheel:
        progress.step(_("Fetching pip ..."), 0.08)
        found = download.newest(
            source.index, "pip", python.version, lambda name: name.endswith("-none-any.whl")
        )
        wheel = download.fetch(found, folder, source.index, progress)
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(os.path.join(folder, "pip"))
    return os.path.join(folder, "pip", "pip")


def _has(venv: str, package: str) -> bool:
    return any(glob.glob(os.path.join(glob.escape(site), f"{package}-*.dist-info")) for site in sites(venv))


def sites(venv: str) -> list[str]:
    """The folders of an environment's packages."""
    return [
        found
        for pattern in ("lib/python3*/site-packages", "Lib/site-packages")
        for found in glob.glob(os.path.join(glob.escape(venv), pattern))
    ]


def environment_python(venv: str) -> str:
    return startup.environment_python(os.path.dirname(venv), os.path.basename(venv))
