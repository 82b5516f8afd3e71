# SPDX-License-Identifier: GPL-2.0-or-later
"""Recognises the extension's own objects: handles, their layer, arrows, notes.  No other module decides this.

They are recognised by their labels.  *Save as plain SVG* drops labels, like everything in Inkscape's
namespace, but keeps our namespace.  Without a label these attributes count:

    alup:kind    the label of a handle after alup:, written by a run if it does not follow from the rest
    alup:rest    a section if the element is a rectangle, else a handle
    alup:arrow   an arrow of the handle with this id
    alup:group   the purpose of a group: handles, arrows, notes; in older files its id tells it

A handle that was drawn by hand and never took part in a run has none of these.  Without its label it is only
a circle.
"""

from __future__ import annotations

import re
from typing import Iterator, Sequence

from .elements import ALUP_NS, CONTAINERS, LABEL, REST, Element, local_tag

LAYER_LABEL, ARROWS_LABEL, NOTES_LABEL = "ALUP handles", "alup:arrows", "alup:notes"
ARROW, GROUP, KIND = (f"{{{ALUP_NS}}}{name}" for name in ("arrow", "group", "kind"))

# The value of alup:group for each group's label.
GROUPS = {LAYER_LABEL: "handles", ARROWS_LABEL: "arrows", NOTES_LABEL: "notes"}

_PREFIX = "alup:"
_ID = re.compile(r"alup-(handles|arrows)-\d+$")
_UNDRAWN = ("defs", "symbol", "clipPath", "mask")


def label_of(element: Element) -> str:
    """The label of an element, or the one that a program has dropped; "" if there is none."""
    attributes = element.attrib
    label = attributes.get(LABEL)
    if label is not None:
        return str(label)
    if local_tag(element) in CONTAINERS:
        match = _ID.match(attributes.get("id") or "")
        named = attributes.get(GROUP) or (match and match.group(1))
        return next((label for label, purpose in GROUPS.items() if purpose == named), "")
    if KIND in attributes:
        return _PREFIX + str(attributes[KIND])
    if REST in attributes:
        return _PREFIX + ("section" if local_tag(element) == "rect" else "handle")
    return ""


def is_ours(element: Element) -> bool:
    """Whether an element is a handle or another object of ours, which is never reshaped."""
    return label_of(element).startswith(_PREFIX) or ARROW in element.attrib


def drawn_of(selected: Sequence[Element]) -> list[Element]:
    """The selected elements that are not handles."""
    return [element for element in selected if not is_ours(element)]


def labelled(svg: Element) -> Iterator[tuple[Element, str]]:
    """Handles with their labels: our objects without groups, arrows, and anything in <defs>."""
    for element in svg.iter():
        if not isinstance(element.tag, str) or local_tag(element) in CONTAINERS or ARROW in element.attrib:
            continue
        label = label_of(element)
        if not label.startswith(_PREFIX):
            continue
        if any(local_tag(ancestor) in _UNDRAWN for ancestor in element.iterancestors()):
            continue
        yield element, label


def is_group(element: Element, label: str) -> bool:
    """Whether an element is the layer, or the group of the arrows or notes."""
    return local_tag(element) == "g" and label_of(element) == label


def groups(svg: Element, label: str) -> list[Element]:
    return [element for element in svg.iter() if is_group(element, label)]


def arrows(svg: Element) -> list[Element]:
    return [element for element in svg.iter() if isinstance(element.tag, str) and ARROW in element.attrib]
