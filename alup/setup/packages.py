# SPDX-License-Identifier: GPL-2.0-or-later
"""The packages of the environment: which they are, where they come from, and their installation by pip.

pip is not part of the environment.  It runs from a wheel: that of the Python, that of the folder of wheels,
or one from the package index.
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

# What runs need. lxml: inkex does not allow version 6.
PACKAGES = ("numpy", "scipy", "lxml<6", "cssselect", "tinycss2")

# Of lxml 5 there is no wheel for Python 3.14 and later; nothing that inkex is used for here fails with 6.
PACKAGES_SINCE_3_14 = ("numpy", "scipy", "lxml<7", "cssselect", "tinycss2")

# Faster with the first, more methods with libigl, but there is not a wheel for every machine.
OPTIONAL_PACKAGES = ("qdldl", "libigl")

PUBLIC_INDEX = "https://pypi.org/simple"

# What pip says while it works, in order of time; the shares were measured.
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
        """For pip."""
        return ["--no-index", "--find-links", self.folder] if self.folder else ["--index-url", self.index]


def source_for(machine: Machine, python: pythons.Python | None, wheels: str) -> Source:
    """The folder of wheels, or the package index that pip is configured for."""
    return Source(folder=os.path.abspath(wheels)) if wheels else Source(index=_index(machine, python))


def _index(machine: Machine, python: pythons.Python | None) -> str:
    """The package index that pip is configured for."""
    given = machine.variables.get("PIP_INDEX_URL")
    if given:
        return given
    if python is None or not python.pip:
        return PUBLIC_INDEX
    command = [python.path, "-E", "-s", os.path.join(python.pip, "pip"), "config", "get", "global.index-url"]
    return machine.ask(command).strip() or PUBLIC_INDEX


def required_packages(python: pythons.Python | None) -> tuple[str, ...]:
    """The packages that runs need, for a Python."""
    return PACKAGES_SINCE_3_14 if python is not None and python.version >= (3, 14) else PACKAGES


def fetch_optional(
    machine: Machine, venv: str, pip: str, source: Source, python: pythons.Python, progress: Progress
) -> list[str]:
    """Those that are not there yet, at once or one by one; those that are not to be had are returned."""
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
                continue  # what is not there in the end is told
    return [package for package in lacking if not _has(venv, package)]


def add_optional(
    machine: Machine, venv: str, python: pythons.Python, source: Source, progress: Progress
) -> list[str]:
    """The optional packages that an environment lacks, after an update that knows more of them."""
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
    """Install packages into an environment by pip; SetupError where they can't be had."""
    seen: list[str] = []

    def told(line: str) -> None:
        found = _COLLECTING.match(line)
        package = (found[1] or found[2]) if found else ""
        if package and package not in seen:
            seen.append(package)
            # Six or so: the packages and what they need.
            progress.step(_("Fetching {package} ...").format(package=package), 0.1 + 0.08 * min(len(seen), 6))
        elif line.startswith(_INSTALLING):
            progress.step(_("Unpacking ..."), 0.65)

    # The cache would be a write outside the folder. Wheels only: nothing is compiled here.
    options = ["--no-cache-dir", "--disable-pip-version-check", "--no-input", "--only-binary", ":all:"]
    options += ["--progress-bar", "off", "--no-warn-script-location", *source.options()]
    command = [environment_python(venv), "-E", "-s", pip, "install", *options, *packages]
    code, words = run(command, machine.environment(PYTHONIOENCODING=None), progress, told)
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
    """Pip as a program for any Python, unpacked into a folder."""
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
