# SPDX-License-Identifier: GPL-2.0-or-later
"""Inkscape's guides -> lines in root user units."""

from __future__ import annotations

import re

import numpy as np

from ...messages.errors import DocumentError
from ...messages.language import N_
from ...messages.language import translate as _
from ...model import Array
from ..tree.elements import SODIPODI_NS, Element, length_reader, name_of

_NO_SIZE = N_("The page has no size from which guides count. Set it in File > Document Properties.")

_ALIGNED = re.compile(r"\s*x(Min|Mid|Max)Y(Min|Mid|Max)(?:\s+(meet|slice))?\s*$")
_BETWEEN = re.compile(r"[\s,]+")
# Share of the free space before the drawing, for each alignment.
_SHARE = {"Min": 0.0, "Mid": 0.5, "Max": 1.0}


def guides(svg: Element) -> list[tuple[Array, Array]]:
    """Point and direction of each guide, (2,) and (2,) in root user units.

    A guide's position counts from the lower left corner of the page, upwards, in units of the viewBox
    stretched over the page; its orientation is the normal in that upright system.
    Raises DocumentError for one that can't be read.
    """
    views = [view for view in svg if view.tag == f"{{{SODIPODI_NS}}}namedview"]
    found = [guide for view in views for guide in view if guide.tag == f"{{{SODIPODI_NS}}}guide"]
    if not found:
        return []
    stretch, page, user = _systems(svg)
    lines = []
    for guide in found:
        position, normal = _line(guide)
        upright = stretch * position
        onscreen = np.array([upright[0], page - upright[1]])
        across = np.array([-normal[1], -normal[0]])  # rotated by 90 degrees; y then points downwards
        lines.append((user[:, :2] @ onscreen + user[:, 2], user[:, :2] @ across))
    return lines


def _line(guide: Element) -> tuple[Array, Array]:
    """Position and normal of a guide as they are written, each (2,)."""
    axis = {"horizontal": 1, "vertical": 0}.get(guide.attrib.get("orientation") or "")
    if axis is not None:  # the notation before Inkscape 0.46 has a single number
        normal = np.eye(2)[axis]
        return normal * _numbers(guide, "position", 1), normal
    normal = _numbers(guide, "orientation", 2)
    if not normal.any():
        raise DocumentError(_unreadable(guide, "orientation"))
    return _numbers(guide, "position", 2), normal


def _numbers(guide: Element, name: str, count: int) -> Array:
    try:
        values = np.array([float(part) for part in _BETWEEN.split((guide.attrib.get(name) or "").strip())])
    except ValueError:
        values = np.zeros(0)
    if len(values) != count or not np.isfinite(values).all():
        raise DocumentError(_unreadable(guide, name))
    return values


def _unreadable(guide: Element, name: str) -> str:
    message = _(
        "The {attribute} of the guide {name} can't be read ({text}). Delete the guide and draw it anew."
    )
    return message.format(attribute=name, name=name_of(guide), text=(guide.attrib.get(name) or "")[:40])


def _systems(svg: Element) -> tuple[Array, float, Array]:
    """Scale (2,) from guides' units to pixels, page height in pixels, matrix (2, 3) to root user units."""
    text = svg.attrib.get("viewBox")
    width, height = (_side(svg, name) for name in ("width", "height"))
    if 0.0 in (width, height):
        raise DocumentError(_(_NO_SIZE))
    if not text:
        if height is None:
            raise DocumentError(_(_NO_SIZE))
        return np.ones(2), height, np.eye(2, 3)
    try:
        x, y, *sides = (float(part) for part in _BETWEEN.split(text.strip()))
        box = np.array(sides)
    except ValueError:
        x, y, box = 0.0, 0.0, np.zeros(0)
    if len(box) != 2 or not (box > 0.0).all() or not np.isfinite([x, y, *box]).all():
        raise DocumentError(
            _("The viewBox of the drawing can't be read ({text}). Correct it in the XML editor.").format(
                text=text[:40]
            )
        )
    page = box if width is None or height is None else np.array([width, height])
    stretch = page / box
    aligned = _ALIGNED.match(svg.attrib.get("preserveAspectRatio") or "xMidYMid")
    scale, offset = stretch, np.zeros(2)
    if aligned:
        scale = np.full(2, stretch.max() if aligned.group(3) == "slice" else stretch.min())
        offset = (page - scale * box) * [_SHARE[aligned.group(1)], _SHARE[aligned.group(2)]]
    return stretch, float(page[1]), np.column_stack([np.diag(1.0 / scale), [x, y] - offset / scale])


def _side(svg: Element, name: str) -> float | None:
    """A side of the page in pixels, or None if it depends on the surroundings of the drawing."""
    text = (svg.attrib.get(name) or "").strip()
    return None if not text or text.endswith("%") else length_reader(svg, _("The page"))(name)
