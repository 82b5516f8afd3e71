# SPDX-License-Identifier: GPL-2.0-or-later
"""The private environment of an installed extension: it is made, tried, and put in place of the former one.

    <extension>/venv/               packages, for the Python that environment.json names
    <extension>/environment.json    written by alup/startup.py
    <extension>/python/             a Python fetched by uv, only if no other was suitable

The new environment is made beside the old one, which stays until the new one has been tried.
"""

from __future__ import annotations

import itertools
import os
import tempfile

from .. import startup
from ..messages.language import translate as _
from . import faults, files, managed, packages, pythons, trial
from .environment_plan import NEW, Plan, python_candidates
from .locked_files import move, remove
from .machine import Machine
from .packages import Source
from .progress import Progress, run
from .setup_errors import SetupError, UnfitPythonError

_OLD = ".venv-old"

# Number of other Pythons to try after the first one failed.  Each try downloads anew.
OTHER_TRIES = 2


def set_up(machine: Machine, the_plan: Plan, inkex: str, own: str, progress: Progress) -> list[str]:
    """Make the planned environment, try it and put it in place.

    inkex : folder of Inkscape's inkex, or empty; own : the Python that Inkscape starts, or empty
    Returns the optional packages that are not available.
    Raises SetupError or Cancelled; then the former environment is in place.
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
    others = (python for python in python_candidates(machine, root, own) if python.path != first.path)
    for python in itertools.chain([first], itertools.islice(others, OTHER_TRIES)):
        try:
            return _set_up_with(machine, root, python, the_plan.source, inkex, own, progress)
        except UnfitPythonError as error:
            failed = failed or error
    assert failed is not None
    raise failed


def _set_up_with(
    machine: Machine,
    root: str,
    python: pythons.Python,
    source: Source,
    inkex: str,
    own: str,
    progress: Progress,
) -> list[str]:
    """Make, try and place the environment with one Python; see `set_up`."""
    recover(root)
    new, old = os.path.join(root, NEW), os.path.join(root, _OLD)
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
    """Undo an interrupted set-up, and delete files of older versions.  Raises SetupError."""
    place, old = os.path.join(root, startup.ENVIRONMENT_NAME), os.path.join(root, _OLD)
    try:
        if os.path.lexists(old) and not os.path.lexists(place):
            move(old, place)
        remove(old)
        remove(os.path.join(root, NEW))
        files.remove_old(root)
        # A missing permission to write is detected before anything is downloaded.
        with tempfile.TemporaryFile(dir=root):
            pass
    except OSError as error:
        raise faults.of_system(error, root) from error


def make(
    machine: Machine, venv: str, python: pythons.Python, source: Source, progress: Progress
) -> list[str]:
    """Make an environment with all packages; returns the optional ones that are not available."""
    progress.step(_("Making an environment for {python} ...").format(python=python.called), 0.05)
    code, words = run(
        [python.path, "-E", "-s", "-m", "venv", "--without-pip", venv], machine.environment(), progress
    )
    if code:
        raise UnfitPythonError(str(faults.of_words(words, folder=venv, python=python.called)))
    with tempfile.TemporaryDirectory() as folder:
        pip = packages.unpacked_pip(python, source, folder, progress)
        packages.install(machine, venv, pip, packages.required_packages(python), source, python, progress)
        return packages.fetch_optional(machine, venv, pip, source, python, progress)


def write_record(machine: Machine, root: str, inkex: str) -> None:
    """Write environment.json, by the environment's own Python, which knows its tag.  Raises SetupError."""
    program = (
        "import sys; sys.path.insert(0, sys.argv[1]); from alup import startup;"
        "startup.write_record(*sys.argv[1:])"
    )
    command = [startup.environment_python(root), "-E", "-s", "-B", "-c", program, root, inkex]
    code, words = run(command, machine.environment(), Progress())
    if code:
        raise faults.of_words(words, folder=root)
