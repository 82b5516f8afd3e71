# SPDX-License-Identifier: GPL-2.0-or-later
"""Markers are drawn at the nodes of paths, lines and polygons, but not of other shapes (SVG 1.1, 11.6.2).

A rectangle or ellipse that becomes a path would get inherited markers.  In SVG 2, Inkscape and resvg it has
them anyway.  So no markup is right in all programs, unless the shape keeps its kind (`kept_shapes`).
"""

from __future__ import annotations

from ..tree.elements import Element, local_tag
from ..tree.styles import Styles

PROPERTIES = ("marker-start", "marker-mid", "marker-end")

_WITHOUT = ("rect", "circle", "ellipse")


def unwanted(element: Element, styles: Styles) -> dict[str, str]:
    """The declarations that suppress markers of an element that becomes a path."""
    if local_tag(element) not in _WITHOUT:
        return {}
    return {name: "none" for name in PROPERTIES if _declared(element, name, styles)}


def at_nodes(element: Element, styles: Styles) -> bool:
    """Whether each inner node has a marker."""
    return local_tag(element) not in _WITHOUT and _declared(element, "marker-mid", styles)


def _declared(element: Element, name: str, styles: Styles) -> bool:
    values = (styles.inherited(element, name), styles.inherited(element, "marker"))
    return any(value not in (None, "none") for value in values)
