# SPDX-License-Identifier: GPL-2.0-or-later
"""Errors of a set-up, and its cancelling."""

from __future__ import annotations

from ..messages.errors import AlupError


class SetupError(AlupError):
    """The extension can't be set up; the message has the cause and a remedy."""


class UnfitPythonError(SetupError):
    """The environment can't be made for this Python; another one may be suitable."""


class Cancelled(Exception):  # noqa: N818 - it is no error, the user asked for it
    """The user has cancelled; nothing was changed."""
