# SPDX-License-Identifier: GPL-2.0-or-later
"""The shapes that handles may be put on, as they are now, and the size that handles have on them."""

from __future__ import annotations

import re
from typing import Sequence

import numpy as np

from ..handles import candidates
from ..messages.errors import DocumentError
from ..messages.language import N_
from ..messages.language import translate as _
from ..model import Array
from . import reading
from .handles.handle_layer import Size
from .tree.drawn_elements import walk
from .tree.elements import Element, Shape, read_shape
from .tree.own_objects import drawn_of
from .tree.styles import Styles

# Radius of handles, as a part of the diagonal of all visible shapes; a diameter of 1.5 % is easy to hit and
# hides little.  The second is its upper limit, as a part of the selection's diagonal, so that handles do not
# cover a single icon of a sheet.
RADIUS_OF_DRAWING, RADIUS_OF_SELECTION = 0.0075, 0.03

_NO_EXTENT = N_("{names}: there is no curve to put a handle on, only a point. Select other objects.")


def painted_shapes(svg: Element, chosen: list[Element]) -> list[Shape]:
    """The present shapes that a run would reshape: those of the chosen objects, or all visible ones.

    Raises DocumentError if there are none.
    """
    reading.refuse_inner_drawings(chosen)
    styles = Styles(svg)
    met = walk(svg, chosen or [svg], not chosen, styles)
    found = [read_shape(element, matrix) for element, matrix in met.drawn]
    found = [shape for shape in found if shape.subpaths]
    # Shapes without fill and stroke, such as frames in icon sets, get no handles.
    found = [shape for shape in found if _is_painted(shape.element, styles)] or found
    if not found:
        skipped = [reading.skipping(element) for element, _ in met.other]
        raise DocumentError(reading.nothing_to_reshape(not chosen, chosen, skipped))
    return found


def measure(svg: Element, selected: Sequence[Element]) -> Size:
    """The size of handles for the selected objects, or for all.  Raises DocumentError if there are none."""
    return handle_size(svg, painted_shapes(svg, drawn_of(selected)))


def handle_size(svg: Element, held: list[Shape]) -> Size:
    """The diagonal of all visible shapes, and the radius of handles on the shapes `held`, root user units."""
    own = diagonal_of(segments_of(held))
    if not own > 0.0:
        raise DocumentError(_(_NO_EXTENT).format(names=", ".join(shape.name for shape in held[:5])))
    control = [segments_of(held)]
    styles = Styles(svg)
    for element, matrix in walk(svg, [svg], True, styles).drawn:
        try:
            if _is_painted(element, styles):
                control.append(segments_of([read_shape(element, matrix)]))
        except DocumentError:
            continue  # it gets no handle, so it is not reported
    diagonal = diagonal_of(np.concatenate(control))
    return Size(diagonal, min(RADIUS_OF_DRAWING * diagonal, RADIUS_OF_SELECTION * own))


def _is_painted(element: Element, styles: Styles) -> bool:
    """Whether a shape is visible by its own opacity, fill and stroke."""

    def shows(paint: str, without: str) -> bool:
        opacity = styles.inherited(element, f"{paint}-opacity")
        return (styles.inherited(element, paint) or without) not in ("none", "transparent") and not _zero(
            opacity
        )

    return not _zero(styles.own(element, "opacity")) and (shows("fill", "black") or shows("stroke", "none"))


def _zero(opacity: str | None) -> bool:
    return opacity is not None and re.match(r"(?:0+|0*\.0+)%?$", opacity) is not None


def diagonal_of(control: Array) -> float:
    low, high = candidates.bounds(control)
    return float(np.hypot(*(high - low)))


def segments_of(held: list[Shape]) -> Array:
    """(S, 4, 2) all segments in root user units."""
    return np.concatenate([shape.control for shape in held if shape.subpaths] or [np.zeros((0, 4, 2))])


def in_root_units(shape: Shape, points: Array) -> Array:
    """Points (..., 2) of a shape's own coordinates in root user units."""
    return points @ shape.matrix[:, :2].T + shape.matrix[:, 2]
