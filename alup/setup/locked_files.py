# SPDX-License-Identifier: GPL-2.0-or-later
"""Rename and delete files that another program has open for a moment, as virus scanners on Windows do."""

from __future__ import annotations

import os
import shutil
import time
from typing import Callable

# Seconds between tries.  A virus scanner or an indexer keeps a new file open for a second or two.
_PATIENCE = (0.2, 0.5, 1.0, 2.0)


def move(source: str, target: str) -> None:
    """Rename a file or folder.  On Windows it is tried again while access is denied."""
    _patiently(lambda: os.rename(source, target))


def remove(path: str) -> None:
    """Delete a file, a link or a folder with its contents, if it exists.  On Windows it is tried again."""

    def action() -> None:
        if os.path.islink(path) or os.path.isfile(path):
            os.remove(path)
        elif os.path.isdir(path):
            shutil.rmtree(path)

    _patiently(action)


def _patiently(action: Callable[[], None]) -> None:
    for seconds in (*_PATIENCE, None):
        try:
            action()
        except PermissionError:
            if seconds is None or os.name != "nt":
                raise
            time.sleep(seconds)
        else:
            return
