# SPDX-License-Identifier: GPL-2.0-or-later
"""Rectangles, circles and ellipses that are still of their kind after a run.

As a path such a shape might get markers (`markers`).  A scale s along the axes and a shift t map a rectangle
to a rectangle, and an ellipse to an ellipse.  s and t are computed from the extents before and after, in the
element's own coordinates.  The map has to fit all control points.
"""

from __future__ import annotations

import numpy as np

from ...svg import path_data
from ..tree.elements import Shape, length_reader, local_tag
from .motion import Moved

# For each axis the attributes of a position and of a length.
_AXES = {
    "rect": (("x", "y"), (("width", "rx"), ("height", "ry"))),
    "circle": (("cx", "cy"), (("r",), ("r",))),
    "ellipse": (("cx", "cy"), (("rx",), ("ry",))),
}


def geometry(shape: Shape, moved: Moved, within: float, decimals: int) -> dict[str, str] | None:
    """The new geometry attributes; None if the shape is no longer of its kind.

    within : user units, tolerance of the control points
    """
    tag = local_tag(shape.element)
    if tag not in _AXES or len(moved.control) != len(moved.old):
        return None
    linear = shape.matrix[:, :2]
    back = np.linalg.inv(linear).T
    old, new = ((c.reshape(-1, 2) - shape.matrix[:, 2]) @ back for c in (moved.old, moved.control))
    size = np.ptp(old, axis=0)
    if not (size > 0.0).all():
        return None
    scale = np.ptp(new, axis=0) / size
    shift = new.min(axis=0) - scale * old.min(axis=0)
    off = np.abs((old * scale + shift - new) @ linear.T).max()
    round_still = tag != "circle" or abs(scale[0] - scale[1]) * size.max() * np.abs(linear).max() <= within
    if not (off <= within and round_still and (scale > 0.0).all()):
        return None
    length = length_reader(shape.element, shape.name)
    found = {}
    for axis, (place, lengths) in enumerate(zip(*_AXES[tag])):
        at = scale[axis] * (length(place) or 0.0) + shift[axis]
        found[place] = path_data.number(float(at), decimals)
        for name in lengths:
            value = length(name)
            if value is None and name in ("rx", "ry"):
                value = length("ry" if name == "rx" else "rx")
            if value is not None:
                found[name] = path_data.number(float(scale[axis]) * value, decimals)
    return found
