# SPDX-License-Identifier: GPL-2.0-or-later
"""What ends a set-up before it is done."""

from __future__ import annotations

from ..messages.errors import AlupError


class SetupError(AlupError):
    """The extension can't be set up; the message says why and what to do."""


class UnfitPythonError(SetupError):
    """The environment can't be made for this Python; another one may do."""


class Cancelled(Exception):  # noqa: N818 - what the person asked for is no error
    """The person has cancelled; nothing was changed."""
