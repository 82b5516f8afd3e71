# SPDX-License-Identifier: GPL-2.0-or-later
"""Install, check and remove the extension for the Inkscape that was found.

Everything is made in a folder beside the installed one, and replaces it only after it has been tried.  So a
failed installation leaves the working one unchanged.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys

from .. import startup
from ..messages.language import translate as _
from . import (
    environment,
    environment_plan,
    faults,
    files,
    inkscapes,
    lock,
    locked_files,
    managed,
    packages,
    pythons,
    trial,
)
from .inkscapes import Inkscape
from .machine import Machine
from .progress import Progress, run
from .setup_errors import SetupError

_DESCRIBE = """
import sys
root, inkex, python, inkscape, names = sys.argv[1:]
sys.path.insert(0, root)
from importlib.metadata import PackageNotFoundError, version
import alup
def known(name):
    try:
        return name + " " + version(name)
    except PackageNotFoundError:
        return name + " (left out)"
print("ALUP Reshape", alup.__version__, "for", inkscape)
print("  extension  ", root)
print("  environment", "Python {}.{}.{}:".format(*sys.version_info[:3]), ", ".join(map(known, names.split())))
print("  Inkscape's ", python + ", inkex:", inkex)
"""


def install(machine: Machine, here: str, inkscape: Inkscape, wheels: str, progress: Progress) -> list[str]:
    """Install the extension from the folder `here` into the profile, with an environment.

    wheels : a folder of wheels, empty for the package index.  Returns the optional packages that were left
        out.
    Raises SetupError or Cancelled; then the former installation is in place.
    """
    target = inkscape.target
    if os.path.islink(target):
        text = _("{folder} is a link, perhaps to a checkout; remove it first: rm '{folder}'")
        raise SetupError(text.format(folder=target))
    lacking = files.missing(here)
    if lacking:
        text = _("{path} is missing: unpack the archive anew, or get a complete checkout")
        raise SetupError(text.format(path=os.path.join(here, lacking[0])))
    try:
        os.makedirs(inkscape.extensions, exist_ok=True)
    except OSError as error:
        raise faults.of_system(error, inkscape.extensions) from error
    with lock.held(target):
        try:
            return _install(machine, here, inkscape, wheels, progress)
        except OSError as error:
            raise faults.of_system(error, target) from error


def _install(machine: Machine, here: str, inkscape: Inkscape, wheels: str, progress: Progress) -> list[str]:
    target, stage, old = inkscape.target, *_beside(inkscape)
    _recover(target, stage, old)
    os.mkdir(stage)
    borrowed = False
    try:
        files.copy(here, stage)
        borrowed = _borrow(target, stage) if _fits(machine, target, inkscape.python) else False
        left_out = None
        if borrowed:
            left_out = _update(machine, stage, inkscape, wheels, progress)
            if left_out is None:
                _give_back(target, stage)
                borrowed = False
            else:
                progress.step(_("Using the environment that is there."), 0.8)
        if left_out is None:
            plan = environment_plan.plan(machine, stage, inkscape.python, wheels)
            progress.step(plan.text().replace(stage, target), 0.0)
            left_out = environment.set_up(machine, plan, inkscape.inkex, inkscape.python, progress)
        if os.path.isdir(target):
            locked_files.move(target, old)
        locked_files.move(stage, target)
    except BaseException:
        if os.path.isdir(old) and not os.path.lexists(target):
            locked_files.move(old, target)
        if borrowed:
            _give_back(target, stage)
        locked_files.remove(stage)
        raise
    managed.follow_move(stage, target)
    _compile(machine, target)
    locked_files.remove(old)
    return left_out


def _beside(inkscape: Inkscape) -> tuple[str, str]:
    """The folder in which the new copy is made, and the one in which the old copy is kept meanwhile."""
    return tuple(os.path.join(inkscape.extensions, f".{inkscapes.NAME}-{name}") for name in ("new", "old"))  # type: ignore[return-value]


def _recover(target: str, stage: str, old: str) -> None:
    """Undo an interrupted installation; the working copy may have the name of the old one."""
    if os.path.isdir(old) and not os.path.lexists(target):
        locked_files.move(old, target)
    if os.path.isdir(target):
        _give_back(target, stage)
    locked_files.remove(stage)
    locked_files.remove(old)


# Folders of an installed extension that are not among its files.
_KEPT = (startup.ENVIRONMENT_NAME, managed.FOLDER)


def _fits(machine: Machine, target: str, own: str) -> bool:
    """Whether the installed environment fits to Inkscape's Python, or to another one that still runs."""
    record = startup.read_record(target)
    if record is None or not os.path.isdir(os.path.join(target, startup.ENVIRONMENT_NAME)):
        return False
    program = (
        "import sys; sys.path.insert(0, sys.argv[1]); from alup import startup;"
        "sys.stdout.write(startup.interpreter_tag())"
    )
    here = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    python = pythons.look(machine, own) if own else None
    if python is None or not python.loads_wheels or record["tag"].endswith(trial.APART):
        return startup.environment_python_runs(target, record)
    return machine.ask([own, "-E", "-s", "-B", "-c", program, here]) == record["tag"]


def _borrow(target: str, stage: str) -> bool:
    """Move the installed environment into the new folder."""
    for name in _KEPT:
        if os.path.isdir(os.path.join(target, name)):
            locked_files.move(os.path.join(target, name), os.path.join(stage, name))
    return True


def _give_back(target: str, stage: str) -> None:
    for name in _KEPT:
        if os.path.isdir(os.path.join(stage, name)) and not os.path.lexists(os.path.join(target, name)):
            locked_files.move(os.path.join(stage, name), os.path.join(target, name))


def _update(
    machine: Machine, stage: str, inkscape: Inkscape, wheels: str, progress: Progress
) -> list[str] | None:
    """Update a borrowed environment; returns the packages left out, or None if it does not run."""
    venv = os.path.join(stage, startup.ENVIRONMENT_NAME)
    python = pythons.look(machine, startup.environment_python(stage))
    if python is None:
        return None
    source = packages.source_for(machine, python, wheels)
    try:
        left_out = packages.add_optional(machine, venv, python, source, progress)
        environment.write_record(machine, stage, inkscape.inkex)
        trial.settle(machine, stage, inkscape.inkex, inkscape.python, progress)
    except SetupError:
        return None
    return left_out


def _compile(machine: Machine, target: str) -> None:
    """Compile all modules, for speed only; failures do not matter."""
    python = startup.environment_python(target)
    effects = [
        name for name in files.of_extension(target) if name.startswith("alup_") and name.endswith(".py")
    ]
    paths = [os.path.join(target, name) for name in ("alup", *effects)]
    command = [python, "-E", "-s", "-m", "compileall", "-q", *paths]
    run(command, machine.environment(), Progress())


def uninstall(target: str) -> bool:
    """Remove the extension with its environment; returns False if it was not installed."""
    if not os.path.lexists(target):
        return False
    extensions = os.path.dirname(target)
    try:
        with lock.held(target):
            for name in (
                target,
                *(os.path.join(extensions, f".{inkscapes.NAME}-{n}") for n in ("new", "old")),
            ):
                locked_files.remove(name)
    except OSError as error:
        raise faults.of_system(error, target) from error
    # Empty folders were made by the installer, or Inkscape will make them again.
    for folder in (extensions, os.path.dirname(extensions)):
        if os.path.isdir(folder) and not os.listdir(folder):
            os.rmdir(folder)
    return True


def check(machine: Machine, inkscape: Inkscape) -> None:
    """Raise SetupError if the installed extension is missing or can't run."""
    target = inkscape.target
    if not os.path.isdir(target):
        raise SetupError(_("not installed ({folder} is not there)").format(folder=target))
    said = trial.check(machine, target, inkscape.inkex, inkscape.python)
    if said:
        text = _("the extension in {folder} cannot run: {said}. Install it once more, or choose {set_up}")
        about = {"folder": target, "said": faults.last_line(said), "set_up": startup.set_up_in_menu()}
        raise SetupError(text.format(**about))


def describe(machine: Machine, inkscape: Inkscape) -> str:
    """A description of the installation, in lines."""
    names = [re.split("[<>=]", name)[0] for name in (*packages.PACKAGES, *packages.OPTIONAL_PACKAGES)]
    python = startup.environment_python(inkscape.target)
    inkex = inkscape.inkex or "known to Inkscape only"
    version = inkscapes.version(machine, inkscape.program)
    about = [inkscape.target, inkex, inkscape.python or "in it", version, " ".join(names)]
    return machine.ask([python, "-E", "-s", "-B", "-c", _DESCRIBE, *about]).rstrip()


def go_on_in_flatpak(machine: Machine, here: str, options: list[str]) -> int:
    """Continue the installer in a Flatpak's sandbox, which has Python and inkex; returns the exit code."""
    flatpak = machine.which("flatpak")
    if not flatpak:
        raise SetupError(_("the command flatpak was not found; nothing was changed"))
    # The sandbox has no network by default, which the download needs.
    command = [flatpak, "run", "--share=network", f"--filesystem={here}:ro", "--command=python3"]
    command += [inkscapes.FLATPAK_NAME, "-E", "-s", "-B", os.path.join(here, "alup", "setup"), *options]
    sys.stdout.flush()
    return subprocess.call(command)
