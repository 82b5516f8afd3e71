# SPDX-License-Identifier: GPL-2.0-or-later
"""Markers stand at the nodes of paths, lines and polygons, and at none of other shapes.

A rectangle or ellipse that becomes a path would get those that it inherits (SVG 1.1, 11.6.2).  SVG 2 lets it
have them, and so do Inkscape and resvg: none is right in all programs unless it stays what it is
(`kept_shapes`).
"""

from __future__ import annotations

from ..tree.elements import Element, local_tag
from ..tree.styles import Styles

PROPERTIES = ("marker-start", "marker-mid", "marker-end")

_WITHOUT = ("rect", "circle", "ellipse")


def unwanted(element: Element, styles: Styles) -> dict[str, str]:
    """What has to be declared for an element that becomes a path."""
    if local_tag(element) not in _WITHOUT:
        return {}
    return {name: "none" for name in PROPERTIES if _declared(element, name, styles)}


def at_nodes(element: Element, styles: Styles) -> bool:
    """Whether each inner node has a marker."""
    return local_tag(element) not in _WITHOUT and _declared(element, "marker-mid", styles)


def _declared(element: Element, name: str, styles: Styles) -> bool:
    values = (styles.inherited(element, name), styles.inherited(element, "marker"))
    return any(value not in (None, "none") for value in values)
