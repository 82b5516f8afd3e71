# SPDX-License-Identifier: GPL-2.0-or-later
"""Messages in the language of the user.

A message stands in the code in English, inside `_("...")`, as a template with named fields that are filled
afterwards: `_("The handle {name} has no size.").format(name=name)`.  Where it is kept for later, `N_("...")`
only marks it, and `_(text)` translates it where it is used.  `locale/update.py` collects both.

The language is the one that gettext takes from the environment; Inkscape sets LANGUAGE to that of its menus.

In English on purpose: what programs read (reports with their notes and statuses, the options' help), what is
written into drawings (labels).
"""

from __future__ import annotations

import os
from functools import lru_cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gettext import NullTranslations

DOMAIN = "alup-reshape"
_PACKAGE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
FOLDER = os.path.join(os.path.dirname(_PACKAGE), "locale")


def translate(message: str) -> str:
    """The message in the user's language, or as it is."""
    return _catalogue().gettext(message)


def code() -> str:
    """Of the language that messages come in: en, de."""
    return str(_catalogue().info().get("language") or "en")


def N_(message: str) -> str:
    """The message as it is: marks one that is translated later."""
    return message


_ = translate


@lru_cache(maxsize=None)
def _catalogue() -> NullTranslations:
    """The translations; looked for when the first message is needed, which most runs never do."""
    import gettext
    import struct

    try:
        return gettext.translation(DOMAIN, FOLDER, fallback=True)
    except (OSError, ValueError, LookupError, struct.error):
        # What the user is to be told matters more than that a catalogue is damaged: it is said in English.
        return gettext.NullTranslations()
