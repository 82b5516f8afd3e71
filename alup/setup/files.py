# SPDX-License-Identifier: GPL-2.0-or-later
"""Which files make the extension: a rule, so that an effect or a module that is added is installed, too."""

from __future__ import annotations

import os
import shutil
from typing import Iterator

# Beside the effects: what installs, and the licence that every copy has to carry.
_BESIDE = ("install.sh", "install.cmd", "LICENSE")

# The archive's list of its files.
LIST = "FILES"

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

    Effects are alup_*.inx and alup_*.py, translations locale/**/*.mo, the package all that is below alup/.
    Where an archive was unpacked over an older version, what is not in its list belongs to that one.
    """
    listed = _listed(root)
    return [name for name in _by_rule(root) if not listed or name in listed]


def remove_old(root: str) -> None:
    """Delete what an older version had and the archive that was unpacked over it has not."""
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
    """The files that the archive's list names; a checkout has none."""
    path = os.path.join(root, LIST)
    if not os.path.isfile(path):
        return []
    with open(path, encoding="utf-8") as file:
        return file.read().split("\n")


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
    """Files of a folder, but for what Python has compiled and what editors and systems hide."""
    for place, folders, names in os.walk(os.path.join(root, folder)):
        folders[:] = [name for name in folders if name != "__pycache__"]
        for name in names:
            if name.startswith(".") or name.endswith((".pyc", "~")):
                continue
            yield os.path.relpath(os.path.join(place, name), root).replace(os.sep, "/")
