# SPDX-License-Identifier: GPL-2.0-or-later
"""The pending changes of a run: all are computed first, and applied when none can fail any more."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from . import fingerprints
from .css import with_property
from .elements import COPY, ORIGINAL, WRITTEN, Element, local_tag
from .references import SERVERS
from .styles import Styles
from .undo_log import UndoLog


@dataclass
class Changes:
    """Changes of elements other than the geometry of shapes, in the order of the calls.

    additions : pairs of an element and the new element behind it
    """

    styles: Styles
    undo_log: UndoLog
    properties: list[tuple[Element, str, str]] = field(default_factory=list)
    attributes: list[tuple[Element, str, str]] = field(default_factory=list)
    additions: list[tuple[Element, Element]] = field(default_factory=list)

    def set_property(self, element: Element, name: str, value: str, origin: Element) -> None:
        """Set a property so that it takes effect.  origin : the element by which style sheets select it"""
        inline = _mentions(element.attrib.get("style") or "", name)
        if element.attrib.get(name) is not None and not inline and self.styles.by_attribute(origin, name):
            self.attributes.append((element, name, value))
            return
        strong = self.styles.wins_over_inline(origin, name) and "!" not in value
        self.properties.append((element, name, f"{value} !important" if strong else value))

    def keep_property(self, element: Element, name: str, value: str) -> None:
        """Write a property's present or planned value into the style, because a rule would change it."""
        important = "!important" in value
        for changed, other, new in [*self.attributes, *self.properties]:
            if changed is element and other == name:
                value = new if not important or "!" in new else f"{new} !important"
        self.properties.append((element, name, value))

    def apply(self) -> None:
        """Apply all changes to the tree.  Shapes become paths only afterwards."""
        for element, name, value in self.properties:
            self.undo_log.touch(element)
            element.attrib["style"] = with_property(element.attrib.get("style"), name, value)
        for element, name, value in self.attributes:
            self.undo_log.touch(element)
            element.attrib[name] = value
        for element, new in self.additions:
            self.undo_log.insert_after(element, new)


def mark_copy(new: Element) -> None:
    """Mark an element as a copy, to be removed when nothing refers to it, and fingerprint its contents."""
    new.attrib[COPY] = "1"
    for part in new.iter():
        tag = local_tag(part)
        if not tag:
            continue
        part.attrib.pop(ORIGINAL, None)
        digest = fingerprints.of_copy(part) if tag in SERVERS else fingerprints.of_element(part, np.eye(3))
        if digest is not None:
            part.attrib[WRITTEN] = str(digest)


def _mentions(style: str, name: str) -> bool:
    return any(part.partition(":")[0].strip() == name for part in style.split(";"))
