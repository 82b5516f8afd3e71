# SPDX-License-Identifier: GPL-2.0-or-later
"""Documents from text: the namespaces in them, their elements, and control points as they are in the file."""

from __future__ import annotations

from typing import Any

import inkex
import numpy as np
from lxml import etree

from alup.document.tree import elements

SVG = "http://www.w3.org/2000/svg"
INKSCAPE = "http://www.inkscape.org/namespaces/inkscape"
SODIPODI = "http://sodipodi.sourceforge.net/DTD/sodipodi-0.dtd"
XLINK = "http://www.w3.org/1999/xlink"
ALUP = "https://alup-reshape.github.io/ns"
LABEL = f"{{{INKSCAPE}}}label"


def opened(text: str | bytes) -> Any:
    """The root of a document, read by inkex."""
    return inkex.load_svg(text).getroot()


def text_of(svg: Any) -> bytes:
    return bytes(etree.tostring(svg))


def get(svg: Any, identity: str) -> Any:
    """The one element with this id."""
    found = [e for e in svg.iter() if isinstance(e.tag, str) and e.attrib.get("id") == identity]
    assert len(found) == 1, f"{len(found)} elements {identity}"
    return found[0]


def control_of(element: Any) -> np.ndarray:
    """Control points (s, 4, 2) of a shape, root user units."""
    matrix = (elements.parent_matrix(element) @ elements.own_matrix(element))[:2]
    return elements.read_shape(element, matrix).control
