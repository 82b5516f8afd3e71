# SPDX-License-Identifier: GPL-2.0-or-later
"""The files of the extension.

They follow from a rule, so new effects and modules are installed without a list.
"""

from __future__ import annotations

import os
import shutil
from typing import Iterator

# Files beside the effects: the installers, and the licence, which every copy must contain.
_BESIDE = ("install.sh", "install.cmd", "LICENSE")

# Name of the archive's list of its files.
LIST = "FILES"

# Files without which a copy is incomplete.
_NEEDED = (
    "alup_reshape.inx",
    "alup_reshape.py",
    "alup_set_up.py",
    "alup/startup.py",
    "alup/setup/__main__.py",
)


def of_extension(root: str) -> list[str]:
    """Paths of the extension's files below its folder, with slashes, sorted.

    Effects are alup_*.inx and alup_*.py, translations locale/**/*.mo, and the package is everything below
    alup/. If an archive was unpacked over an older version, files that are not in its list belong to the
    older one.
    """
    listed = _listed(root)
    return [name for name in _by_rule(root) if not listed or name in listed]


def remove_old(root: str) -> None:
    """Delete files of an older version that are not in the list of the archive unpacked over it."""
    for name in set(_by_rule(root)) - set(of_extension(root)):
        os.remove(os.path.join(root, *name.split("/")))


def modules(root: str) -> list[str]:
    """Names of the extension's modules."""
    names = (name for name in of_extension(root) if name.startswith("alup/") and name.endswith(".py"))
    found = [name[: -len(".py")].split("/") for name in names]
    return [".".join(parts[:-1] if parts[-1] == "__init__" else parts) for parts in found]


def _by_rule(root: str) -> list[str]:
    found = [name for name in os.listdir(root) if _is_effect(name) or name in _BESIDE]
    found += _below(root, "alup")
    found += [path for path in _below(root, "locale") if path.endswith(".mo")]
    return sorted(found)


def _listed(root: str) -> list[str]:
    """The files in the archive's list; none in a checkout, which has no list."""
    path = os.path.join(root, LIST)
    if not os.path.isfile(path):
        return []
    with open(path, encoding="utf-8") as file:
        return file.read().split("\n")


def missing(root: str) -> list[str]:
    """The necessary files that a copy lacks."""
    return [name for name in _NEEDED if not os.path.isfile(os.path.join(root, *name.split("/")))]


def copy(root: str, target: str) -> None:
    """Copy the extension's files into an empty folder."""
    for name in of_extension(root):
        path = os.path.join(target, *name.split("/"))
        os.makedirs(os.path.dirname(path), exist_ok=True)
        shutil.copy(os.path.join(root, *name.split("/")), path)


def _is_effect(name: str) -> bool:
    return name.startswith("alup_") and name.endswith((".inx", ".py"))


def _below(root: str, folder: str) -> Iterator[str]:
    """Files below a folder, without compiled Python, hidden files and backups of editors."""
    for place, folders, names in os.walk(os.path.join(root, folder)):
        folders[:] = [name for name in folders if name != "__pycache__"]
        for name in names:
            if name.startswith(".") or name.endswith((".pyc", "~")):
                continue
            yield os.path.relpath(os.path.join(place, name), root).replace(os.sep, "/")
