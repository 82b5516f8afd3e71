# SPDX-License-Identifier: GPL-2.0-or-later
"""Ids and the references to them: `url(#id)` in properties, `href` of gradients and clones."""

from __future__ import annotations

import re
from typing import Iterable

from .elements import Element

XLINK_NS = "http://www.w3.org/1999/xlink"
XLINK_HREF = f"{{{XLINK_NS}}}href"

# Paint servers: the attributes of their units and of their transform.
SERVERS = {
    "linearGradient": ("gradientUnits", "gradientTransform"),
    "radialGradient": ("gradientUnits", "gradientTransform"),
    "meshgradient": ("gradientUnits", "gradientTransform"),
    "pattern": ("patternUnits", "patternTransform"),
}

_URL = re.compile(r"""url\(\s*(?:(["'])\s*)?#([^"'()]+)(?(1)\1\s*)\)""")


class Ids:
    """The elements of a document by id.  Of several with one id the first counts, as in all programs."""

    def __init__(self, svg: Element):
        self.elements: dict[str, Element] = {}
        for element in svg.iter():
            identity = element.attrib.get("id") if isinstance(element.tag, str) else None
            if identity:
                self.elements.setdefault(identity, element)
        self._taken = set(self.elements)

    def get(self, identity: str | None) -> Element | None:
        return self.elements.get(identity) if identity else None

    def href(self, element: Element) -> Element | None:
        """The element that another one refers to, or None."""
        text = element.attrib.get("href") or element.attrib.get(XLINK_HREF) or ""
        return self.get(text[1:]) if text.startswith("#") else None

    def chain(self, element: Element) -> list[Element]:
        """An element and those that it inherits attributes from by `href`, in order."""
        found = [element]
        while True:
            following = self.href(found[-1])
            if following is None or following in found:
                return found
            found.append(following)

    def new(self, like: str) -> str:
        """An unused id, which is then reserved."""
        base = re.sub(r"-\d+$", "", like)
        number = 1
        while f"{base}-{number}" in self._taken:
            number += 1
        self._taken.add(f"{base}-{number}")
        return f"{base}-{number}"

    def forget(self, identities: Iterable[str]) -> None:
        """Release ids that were reserved for copies."""
        self._taken.difference_update(identities)


def referred(value: str | None) -> str | None:
    """The id in a property's `url(#id)`, or None."""
    found = _URL.search(value or "")
    return found.group(2).rstrip() if found else None


def redirected(value: str, identity: str) -> str:
    """A property's value with another id in its `url()`; a fallback colour stays."""
    return _URL.sub(f"url(#{identity})", value, count=1)
