# SPDX-License-Identifier: GPL-2.0-or-later
"""Rename and delete files that another program has open for a moment, as virus scanners do on Windows."""

from __future__ import annotations

import os
import shutil
import time

# A virus scanner or an indexer has a new file open for a second or two.
_PATIENCE = (0.2, 0.5, 1.0, 2.0)


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
