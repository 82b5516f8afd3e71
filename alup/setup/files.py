# SPDX-License-Identifier: GPL-2.0-or-later
"""Which files make the extension: a rule, so that an effect or a module that is added is installed, too."""

from __future__ import annotations

import os
import shutil
from typing import Iterator

# Beside the effects: what installs, and the licence that every copy has to carry.
_BESIDE = ("install.sh", "install.cmd", "LICENSE")

# What a complete copy has at least.
_NEEDED = (
    "alup_reshape.inx",
    "alup_reshape.py",
    "alup_set_up.py",
    "alup/startup.py",
    "alup/setup/__main__.py",
)


def of_extension(root: str) -> list[str]:
    """Paths of the extension's files below its folder, with slashes, sorted.

    Effects are alup_*.inx and alup_*.py, modules alup/**/*.py, translations locale/**/*.mo.
    """
    found = [name for name in os.listdir(root) if _is_effect(name) or name in _BESIDE]
    for folder, ending in (("alup", ".py"), ("locale", ".mo")):
        found += [path for path in _below(root, folder) if path.endswith(ending)]
    return sorted(found)


def missing(root: str) -> list[str]:
    """What a copy lacks that every one has."""
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
    for place, folders, names in os.walk(os.path.join(root, folder)):
        folders[:] = [name for name in folders if name != "__pycache__"]
        for name in names:
            yield os.path.relpath(os.path.join(place, name), root).replace(os.sep, "/")
