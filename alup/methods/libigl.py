# SPDX-License-Identifier: GPL-2.0-or-later
"""Late import of libigl, which only two of the methods need."""

from __future__ import annotations

from types import ModuleType

from ..messages.errors import DependencyError
from ..messages.language import translate as _


def load() -> ModuleType:
    """The module igl.  Raises DependencyError where it is not installed."""
    try:
        import igl
    except ImportError as error:
        message = _(
            "This method needs the package libigl, which is not installed. Choose another method, or run the "
            "installer once more."
        )
        raise DependencyError(message) from error
    return igl
