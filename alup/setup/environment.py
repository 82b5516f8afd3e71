# SPDX-License-Identifier: GPL-2.0-or-later
"""The private environment of an installed extension: made, tried, put in place of the one before.

    <extension>/venv/               packages, for the Python that environment.json names
    <extension>/environment.json    written by alup/startup.py
    <extension>/python/             a Python that uv brought, only where none was there

The new environment is made beside the old one, which stays until the new one has been tried.  pip is not
part of it: pip runs from a wheel, that of the Python, of the folder of wheels, or of the package index.
"""

from __future__ import annotations

import glob
import itertools
import os
import re
import shutil
import tempfile
import time
import zipfile
from dataclasses import dataclass
from typing import Iterable, Iterator

from .. import startup
from ..messages.language import translate as _
from . import download, faults, files, managed, pythons, trial
from .inkscapes import FLATPAK_NAME
from .machine import WINDOWS, Machine
from .progress import Progress, Quiet, run
from .setup_errors import SetupError, UnfitPythonError

# What runs need. lxml: inkex does not allow version 6.
PACKAGES = ("numpy", "scipy", "lxml<6", "cssselect", "tinycss2")
# Of lxml 5 there is no wheel for Python 3.14 and later; nothing that inkex is used for here fails with 6.
PACKAGES_SINCE_3_14 = ("numpy", "scipy", "lxml<7", "cssselect", "tinycss2")
# Faster with the first, more methods with libigl, but there is not a wheel for every machine.
OPTIONAL_PACKAGES = ("qdldl", "libigl")

# Megabytes, measured: what is downloaded, what the environment has, what a managed Python adds to both.
DOWNLOADED, INSTALLED, MANAGED = 75, 280, (60, 150)

# Each try downloads anew.
OTHER_TRIES = 2

PUBLIC_INDEX = "https://pypi.org/simple"

# The longest path below the environment, of scipy.
_LONGEST_BELOW = 130

# A virus scanner or an indexer has a new file open for a second or two.
_PATIENCE = (0.2, 0.5, 1.0, 2.0)

_NEW, _OLD = ".venv-new", ".venv-old"

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
            "packages": ", ".join((*wanted(self.python), *OPTIONAL_PACKAGES)),
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


def wanted(python: pythons.Python | None) -> tuple[str, ...]:
    """The packages that runs need, for a Python."""
    return PACKAGES_SINCE_3_14 if python is not None and python.version >= (3, 14) else PACKAGES


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
    python = next(_candidates(machine, root, own), None)
    if python is None and wheels:
        text = _(
            "No Python here can load the wheels in {folder}. Install Python {version} for 64 bit from"
            " python.org."
        )
        raise SetupError(text.format(folder=wheels, version=managed.VERSION))
    return Plan(root, python, source_for(machine, python, wheels))


def source_for(machine: Machine, python: pythons.Python | None, wheels: str) -> Source:
    """The folder of wheels, or the package index that pip is configured for."""
    return Source(folder=os.path.abspath(wheels)) if wheels else Source(index=_index(machine, python))


def _candidates(machine: Machine, root: str, own: str) -> Iterator[pythons.Python]:
    """Pythons that can make an environment, the best first, at last one that uv has brought before."""
    yield from (python for python in pythons.candidates(machine, own) if python.venv)
    brought = managed.there(root)
    python = pythons.look(machine, brought) if brought else None
    if python is not None:
        yield python


def _index(machine: Machine, python: pythons.Python | None) -> str:
    """The package index that pip is configured for."""
    given = machine.variables.get("PIP_INDEX_URL")
    if given:
        return given
    if python is None or not python.pip:
        return PUBLIC_INDEX
    command = [python.path, "-E", "-s", os.path.join(python.pip, "pip"), "config", "get", "global.index-url"]
    return machine.ask(command).strip() or PUBLIC_INDEX


def _refuse_long_paths(machine: Machine, root: str) -> None:
    """Windows without its setting for long paths stops in the midst of scipy."""
    if machine.system != WINDOWS:
        return
    allowed = machine.registry(r"SYSTEM\CurrentControlSet\Control\FileSystem", "LongPathsEnabled")
    below = len(os.path.join(_NEW, "Lib", "site-packages")) + 2 + _LONGEST_BELOW
    if "1" not in allowed and len(root) + below > faults.LONGEST_WINDOWS_PATH:
        raise faults.path_too_long(root)


# --- doing it -----------------------------------------------------------------------------------


def set_up(machine: Machine, the_plan: Plan, inkex: str, own: str, progress: Progress) -> list[str]:
    """Make the environment that was planned, try it and put it in place.

    inkex : folder of Inkscape's inkex, or empty; own : the Python that Inkscape starts, or empty
    Returns the optional packages that could not be had.
    Raises SetupError, or Cancelled; the environment before is in place then.
    """
    root = the_plan.root
    first = the_plan.python
    recover(root)
    if first is None:
        progress.step(_("Fetching Python {version} ...").format(version=managed.VERSION), 0.02)
        try:
            brought = managed.bring(machine, root, the_plan.source.index, progress)
        except BaseException:
            remove(os.path.join(root, managed.FOLDER))
            raise
        first = pythons.look(machine, brought)
        if first is None:
            raise SetupError(_("{path} does not start. Delete it and try again.").format(path=brought))
    failed: UnfitPythonError | None = None
    others = (python for python in _candidates(machine, root, own) if python.path != first.path)
    for python in itertools.chain([first], itertools.islice(others, OTHER_TRIES)):
        try:
            return _with(machine, root, python, the_plan.source, inkex, own, progress)
        except UnfitPythonError as error:
            failed = failed or error
    assert failed is not None
    raise failed


def _with(
    machine: Machine,
    root: str,
    python: pythons.Python,
    source: Source,
    inkex: str,
    own: str,
    progress: Progress,
) -> list[str]:
    """The same with one Python."""
    recover(root)
    new, old = os.path.join(root, _NEW), os.path.join(root, _OLD)
    place, record = (os.path.join(root, name) for name in (startup.ENVIRONMENT_NAME, startup.RECORD_NAME))
    recorded = machine.read(record)
    try:
        try:
            left_out = make(machine, new, python, source, progress)
            progress.step(_("Trying it ..."), 0.9)
            if os.path.lexists(place):
                move(place, old)
            move(new, place)
            write_record(machine, root, inkex)
            trial.settle(machine, root, inkex, own, progress)
        except OSError as error:
            raise faults.of_system(error, root) from error
    except BaseException:
        remove(new)
        if os.path.lexists(old):
            remove(place)
            move(old, place)
        elif not recorded:
            remove(place)
        _restore(record, recorded)
        raise
    remove(old)
    progress.step(_("Done."), 1.0)
    return left_out


def _restore(record: str, text: str) -> None:
    if text:
        with open(record, "w", encoding="utf-8") as file:
            file.write(text)
    elif os.path.exists(record):
        os.remove(record)


def recover(root: str) -> None:
    """Tidy up: a run that was cut off is taken back, files of an older version go."""
    place, old = os.path.join(root, startup.ENVIRONMENT_NAME), os.path.join(root, _OLD)
    try:
        if os.path.lexists(old) and not os.path.lexists(place):
            move(old, place)
        remove(old)
        remove(os.path.join(root, _NEW))
        files.remove_old(root)
        # Whoever may not write finds out before anything is downloaded.
        with tempfile.TemporaryFile(dir=root):
            pass
    except OSError as error:
        raise faults.of_system(error, root) from error


def make(
    machine: Machine, venv: str, python: pythons.Python, source: Source, progress: Progress
) -> list[str]:
    """An environment with all packages; the optional ones that could not be had are returned."""
    progress.step(_("Making an environment for {python} ...").format(python=python.called), 0.05)
    code, words = run(
        [python.path, "-E", "-s", "-m", "venv", "--without-pip", venv], machine.environment(), progress
    )
    if code:
        raise UnfitPythonError(str(faults.of_words(words, folder=venv, python=python.called)))
    with tempfile.TemporaryDirectory() as folder:
        pip = _pip(python, source, folder, progress)
        _fetch(machine, venv, pip, wanted(python), source, python, progress)
        return fetch_optional(machine, venv, pip, source, python, progress)


def add_optional(
    machine: Machine, venv: str, python: pythons.Python, source: Source, progress: Progress
) -> list[str]:
    """The optional packages that an environment lacks, after an update that knows more of them."""
    names = [name for name in OPTIONAL_PACKAGES if not _has(venv, name)]
    if not names:
        return []
    with tempfile.TemporaryDirectory() as folder:
        pip = _pip(python, source, folder, progress)
        return fetch_optional(machine, venv, pip, source, python, progress)


def _pip(python: pythons.Python, source: Source, folder: str, progress: Progress) -> str:
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


def _fetch(
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
                _fetch(machine, venv, pip, packages, source, python, Quiet(progress))
            except SetupError:
                continue  # what is not there in the end is told
    return [package for package in lacking if not _has(venv, package)]


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


def write_record(machine: Machine, root: str, inkex: str) -> None:
    """Have the environment's Python write which one it is."""
    program = (
        "import sys; sys.path.insert(0, sys.argv[1]); from alup import startup;"
        "startup.write_record(*sys.argv[1:])"
    )
    command = [startup.environment_python(root), "-E", "-s", "-B", "-c", program, root, inkex]
    code, words = run(command, machine.environment(), Progress())
    if code:
        raise faults.of_words(words, folder=root)


# --- files that others may have open --------------------------------------------------------------


def move(source: str, target: str) -> None:
    """Rename a file or folder, with patience for a virus scanner."""
    for seconds in (*_PATIENCE, None):
        try:
            os.rename(source, target)
        except PermissionError:
            if seconds is None or os.name != "nt":
                raise
            time.sleep(seconds)
        else:
            return


def remove(path: str) -> None:
    """Delete a file, a link or a folder with all that is in it, if it is there; with the same patience."""
    for seconds in (*_PATIENCE, None):
        try:
            if os.path.islink(path) or os.path.isfile(path):
                os.remove(path)
            elif os.path.isdir(path):
                shutil.rmtree(path)
        except PermissionError:
            if seconds is None or os.name != "nt":
                raise
            time.sleep(seconds)
        else:
            return


def move_managed(before: str, after: str) -> None:
    """Tell an environment in a folder that was moved where its managed Python is now."""
    if not os.path.isdir(os.path.join(after, managed.FOLDER)):
        return
    venv = os.path.join(after, startup.ENVIRONMENT_NAME)
    for path in glob.glob(os.path.join(glob.escape(venv), "bin", "*")):
        target = os.readlink(path) if os.path.islink(path) else ""
        if target.startswith(before + os.sep):
            os.remove(path)
            os.symlink(after + target[len(before) :], path)
    configuration = os.path.join(venv, "pyvenv.cfg")
    with open(configuration, encoding="utf-8") as file:
        text = file.read()
    with open(configuration, "w", encoding="utf-8") as file:
        file.write(text.replace(before + os.sep, after + os.sep))
