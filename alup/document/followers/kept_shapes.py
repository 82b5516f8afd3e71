# SPDX-License-Identifier: GPL-2.0-or-later
"""A rectangle, circle or ellipse that still is one after a run.

It becomes a path where its shape is written; see `markers` for what that would change.  A scale along the
axes and a shift, s and t, take a rectangle to a rectangle, and an ellipse to an ellipse.  They are taken from
the extents before and after, in the element's own coordinates, and have to meet all control points.
"""

from __future__ import annotations

import numpy as np

from ...svg import path_data
from ..tree.elements import Shape, length_reader, local_tag
from .motion import Moved

# Attributes of a place, of a length, for each axis.
_AXES = {
    "rect": (("x", "y"), (("width", "rx"), ("height", "ry"))),
    "circle": (("cx", "cy"), (("r",), ("r",))),
    "ellipse": (("cx", "cy"), (("rx",), ("ry",))),
}


def geometry(shape: Shape, moved: Moved, within: float, decimals: int) -> dict[str, str] | None:
    """The geometry's new attributes; None where the shape is no longer of its kind.

    within : user units, how far control points may be off
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
