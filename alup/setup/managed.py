# SPDX-License-Identifier: GPL-2.0-or-later
"""A Python fetched by uv, for machines without one that loads PyPI's wheels: most machines with Windows.

uv itself is a wheel of the package index.  The Python that it fetches is one of the project
python-build-standalone on GitHub.  It is put into the folder of the extension, and is not registered
anywhere.
"""

from __future__ import annotations

import glob
import os
import platform
import stat
import sys
import tempfile
import zipfile

from .. import startup
from ..messages.language import translate as _
from . import download, faults
from .machine import MACOS, WINDOWS, Machine
from .progress import Progress, run
from .setup_errors import SetupError

VERSION = "3.12"
FOLDER = "python"
SOURCE = "github.com/astral-sh/python-build-standalone"


def bring(machine: Machine, root: str, index: str, progress: Progress) -> str:
    """Path of the managed Python below `root`; it is fetched if it is missing.

    Raises SetupError if uv or its Python can't be fetched.
    """
    found = there(root)
    if found:
        return found
    with tempfile.TemporaryDirectory() as folder:
        wheel = download.newest(index, "uv", sys.version_info[:3], lambda name: _suits(machine, name))
        program = _unpack(download.fetch(wheel, folder, index, progress), folder)
        command = [
            program,
            "python",
            "install",
            VERSION,
            "--no-bin",
            "--install-dir",
            os.path.join(root, FOLDER),
        ]
        environment = machine.environment(
            UV_CACHE_DIR=os.path.join(folder, "cache"), UV_NO_CONFIG="1", UV_PYTHON_INSTALL_REGISTRY="0"
        )
        code, words = run(command, environment, progress)
    found = there(root)
    if code or not found:
        raise faults.of_words(
            words, index=SOURCE, folder=root, proxy=download.proxy(), python=f"Python {VERSION}"
        )
    return found


def there(root: str) -> str:
    """Path of the managed Python below `root`; empty if there is none."""
    patterns = ("cpython-3.*/bin/python3", "cpython-3.*/python.exe")
    found = [
        path for pattern in patterns for path in glob.glob(os.path.join(glob.escape(root), FOLDER, pattern))
    ]
    if not found:
        return ""
    # uv makes a link from the folder's name without the last number of the version to the folder.  The link
    # is not used.
    place = os.path.join(root, FOLDER)
    links = {
        os.path.join(place, name) for name in os.listdir(place) if os.path.islink(os.path.join(place, name))
    }
    kept = (path for path in sorted(found) if not any(path.startswith(link + os.sep) for link in links))
    return next(kept, "")


def follow_move(before: str, after: str) -> None:
    """Correct the paths of the managed Python in an environment whose folder was moved."""
    if not os.path.isdir(os.path.join(after, FOLDER)):
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


def _suits(machine: Machine, name: str) -> bool:
    """Whether a wheel of uv is for this system and processor."""
    processor = platform.machine().lower()
    arm = processor in ("arm64", "aarch64")
    if machine.system == WINDOWS:
        return name.endswith("win_arm64.whl" if arm else "win_amd64.whl")
    if machine.system == MACOS:
        return "-macosx_" in name and name.endswith("_arm64.whl" if arm else "_x86_64.whl")
    return "manylinux" in name and name.endswith("_aarch64.whl" if arm else "_x86_64.whl")


def _unpack(wheel: str, folder: str) -> str:
    """Extract the program uv from its wheel; returns its path.  Raises SetupError."""
    with zipfile.ZipFile(wheel) as archive:
        wanted = [name for name in archive.namelist() if name.rsplit("/", 1)[-1] in ("uv", "uv.exe")]
        if not wanted:
            raise SetupError(
                _("{name} has no program uv in it. Try again.").format(name=os.path.basename(wheel))
            )
        path = archive.extract(wanted[0], folder)
    os.chmod(path, os.stat(path).st_mode | stat.S_IXUSR)
    return path
