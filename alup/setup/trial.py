# SPDX-License-Identifier: GPL-2.0-or-later
"""Tests of an installed extension: importing all modules of a run, and starting each effect as Inkscape does.

Any output on the standard error is a failure, because Inkscape would show it in a window.
"""

from __future__ import annotations

import json
import os
import subprocess

from .. import startup
from ..messages.language import translate as _
from . import faults, files
from .machine import Machine, without_window
from .progress import Progress, run
from .setup_errors import SetupError, UnfitPythonError

# Time limit of a start.  An effect starts in half a second, with a cold disk and a virus scanner in ten.
_PATIENCE_SECONDS = 120

# Suffix of the tag of the environment's Python.  With it Inkscape's Python hands over even if it has the same
# version.
APART = "-apart"

_IMPORTS = """
import importlib, os, sys
root, inkex, *modules = sys.argv[1:]
sys.path.insert(0, root)
names = ["numpy", "scipy.sparse.linalg", "lxml.etree", "cssselect", "tinycss2"]
if inkex:
    from alup import startup
    os.environ[startup.HANDED_OVER] = inkex
    startup.prepare(os.path.join(root, "alup_reshape.py"))
    names += ["inkex", *modules]
for name in names:
    if name.endswith("__main__"):
        continue
    try:
        importlib.import_module(name)
    except ModuleNotFoundError as error:
        # GTK is Inkscape's or the system's; what has a window does without one where it is missing.
        if error.name != "gi":
            raise
"""


def settle(machine: Machine, root: str, inkex: str, own: str, progress: Progress) -> None:
    """Test the environment.

    If Inkscape's Python can't load its packages, make it hand over to the environment's.
    On macOS a signed Python loads no library that was signed by somebody else, even if the versions agree.
    Raises SetupError if the extension does not start in either way.
    """
    said = imports(machine, root, inkex, progress)
    if said:
        raise _failed(said)
    progress.check()
    said = starts(machine, root, inkex, own)
    record = startup.read_record(root)
    if said and record is not None and not record["tag"].endswith(APART):
        _keep_apart(root, record)
        if starts(machine, root, inkex, own):
            raise _failed(said)


def check(machine: Machine, root: str, inkex: str, own: str) -> str:
    """The failure of an installed extension; empty if there is none."""
    if startup.read_record(root) is None:
        return _("{folder} has no environment").format(folder=root)
    return imports(machine, root, inkex, Progress()) or starts(machine, root, inkex, own)


def imports(machine: Machine, root: str, inkex: str, progress: Progress) -> str:
    """The output of the environment's Python when it imports the modules of a run; empty on success."""
    # -B: modules compiled before the folder is moved would contain its temporary path.
    command = [startup.environment_python(root), "-E", "-s", "-B", "-c", _IMPORTS, root, inkex]
    command += files.modules(root)
    try:
        code, words = run(command, machine.environment(), progress)
    except OSError as error:
        return str(error)
    return words or (_("it ended with the exit code {code}").format(code=code) if code else "")


def starts(machine: Machine, root: str, inkex: str, own: str) -> str:
    """The output of the effects when Inkscape's Python starts them with --help; empty on success.

    It is also empty if inkex or Inkscape's Python is unknown, because effects can't be started then.
    """
    if not inkex or not own:
        return ""
    path = os.pathsep.join((os.path.dirname(root), inkex))
    for script in (
        name for name in files.of_extension(root) if name.startswith("alup_") and name.endswith(".py")
    ):
        try:
            done = subprocess.run(
                [own, script, "--help"],
                cwd=root,
                env=machine.environment(PYTHONPATH=path, PYTHONDONTWRITEBYTECODE="1"),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                timeout=_PATIENCE_SECONDS,
                check=False,
                **without_window(),
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            return str(error)
        said = done.stderr.decode("utf-8", "replace").strip()
        if done.returncode or said:
            return said or _("it ended with the exit code {code}").format(code=done.returncode)
    return ""


def _keep_apart(root: str, record: dict[str, str]) -> None:
    record = {**record, "tag": record["tag"] + APART}
    with open(os.path.join(root, startup.RECORD_NAME), "w", encoding="utf-8") as file:
        json.dump(record, file, indent=2)
        file.write("\n")


def _failed(said: str) -> SetupError:
    return UnfitPythonError(
        _("The extension does not run on this machine: {said}").format(said=faults.last_line(said))
    )
