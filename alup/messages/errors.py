# SPDX-License-Identifier: GPL-2.0-or-later
"""The errors a person can do something about.

Every message is one or two sentences that name the object and the remedy; the effect shows
it as it is.  Anything else that is raised is a defect of this package.
"""

from __future__ import annotations

# A message is shown in a window; a longer one, with an endless id in it, loses what is in the middle.
LONGEST_MESSAGE = 2000


class AlupError(Exception):
    """Base of all errors that are meant for the user."""

    def __str__(self) -> str:
        """One line, whatever the ids in it are: line breaks and marks of direction are shown as escapes."""
        text = super().__str__()
        if len(text) > LONGEST_MESSAGE:
            text = f"{text[: LONGEST_MESSAGE // 2]} \u2026 {text[-LONGEST_MESSAGE // 2 :]}"
        return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


class DocumentError(AlupError):
    """The selected objects can't be reshaped as they are."""


class HandleError(AlupError):
    """The handles are missing, incomplete or contradict each other."""


class SolveError(AlupError):
    """The least-squares problem could not be solved."""


class DependencyError(AlupError):
    """A package that a run needs is missing."""
