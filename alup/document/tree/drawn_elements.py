# SPDX-License-Identifier: GPL-2.0-or-later
"""Which elements of a document are drawn, and their matrices."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Callable

import numpy as np

from ...model import Array
from ...svg import basic_shapes
from .elements import (
    CARRIED,
    CONTAINERS,
    SODIPODI_NS,
    Element,
    geometry_of,
    is_squashed,
    local_tag,
    own_matrix,
    parent_matrix,
)
from .own_objects import is_ours
from .styles import Styles


@dataclass
class Found:
    """The elements found by `walk`, by kind.

    drawn : shapes; other : texts, images, clones, with their parents' matrices
    squashed : shapes whose transform maps them to a line
    placed : shapes and images whose geometry is in CSS, with their parents' matrices
    styled : other elements with a position in CSS, with their descendants
    aside : locked or hidden elements, with their descendants
    """

    drawn: list[tuple[Element, Array]] = field(default_factory=list)
    other: list[tuple[Element, Array]] = field(default_factory=list)
    squashed: list[Element] = field(default_factory=list)
    placed: list[tuple[Element, Array]] = field(default_factory=list)
    styled: list[Element] = field(default_factory=list)
    aside: list[Element] = field(default_factory=list)


def walk(svg: Element, tops: list[Element], everything: bool, styles: Styles) -> Found:
    """The drawn elements below `tops`, in document order.  everything : whether the whole drawing is meant"""
    found = Found()
    inside = set(tops)
    seen = set()
    for top in sorted(tops, key=_document_order(svg)) if len(tops) > 1 else tops:
        ancestor = top.getparent()
        while ancestor is not None and ancestor not in inside:
            ancestor = ancestor.getparent()
        if ancestor is not None or top in seen:
            continue  # it is reached through its group
        seen.add(top)
        start = np.eye(3) if top is svg else parent_matrix(top)
        stack = [(top, start, "visible")]
        while stack:
            element, matrix, visibility = stack.pop()
            tag = local_tag(element)
            if not tag or is_ours(element):
                continue
            visibility = styles.own(element, "visibility") or visibility
            if everything:
                locked = element.attrib.get(f"{{{SODIPODI_NS}}}insensitive") == "true"
                if styles.own(element, "display") == "none" or locked:
                    found.aside.append(element)
                    continue
            if element is not svg and _placed_by_css(element, styles):
                if tag == "use" or _by_css(element, ("transform",), styles):
                    found.styled.append(element)
                else:
                    found.placed.append((element, matrix))
                continue
            own = matrix @ own_matrix(element) if element is not svg else matrix
            if tag in CONTAINERS or element is svg:
                stack.extend((child, own, visibility) for child in reversed(element))
            elif everything and visibility in ("hidden", "collapse"):
                found.aside.append(element)
            elif tag == "path" or tag in basic_shapes.TAGS:
                if is_squashed(own):
                    found.squashed.append(element)
                else:
                    found.drawn.append((element, own[:2]))
            elif tag in ("use", "svg", *CARRIED):
                found.other.append((element, matrix))
    return found


def _placed_by_css(element: Element, styles: Styles) -> bool:
    """Whether an element's geometry is in CSS, as SVG 2 allows.  Only attributes can be reshaped."""
    return _by_css(element, ("transform", *geometry_of(element)), styles)


def _by_css(element: Element, names: tuple[str, ...], styles: Styles) -> bool:
    return any(
        styles.by_css(element, name) and styles.own(element, name) not in ("none", "auto") for name in names
    )


def _document_order(svg: Element) -> Callable[[Element], int]:
    order = {element: n for n, element in enumerate(svg.iter())}
    return lambda element: order.get(element, len(order))
