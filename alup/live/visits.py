# SPDX-License-Identifier: GPL-2.0-or-later
"""Whether somebody has used the live window before, so that it need not be explained again.

The browser's profile lives no longer than the window.  The installed extension has a folder of its own, and
a file there says it; a checkout explains every time.
"""

from __future__ import annotations

from pathlib import Path

from ..startup import RECORD_NAME

_ROOT = Path(__file__).resolve().parents[2]
_MARK = _ROOT / "used-live"


def is_first() -> bool:
    return not _MARK.exists()


def note() -> None:
    """Remember that the window has served; where the folder can't be written it is explained again."""
    if (_ROOT / RECORD_NAME).exists():
        try:
            _MARK.touch()
        except OSError:
            return
