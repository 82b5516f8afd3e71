# SPDX-License-Identifier: GPL-2.0-or-later
"""An order of the shapes that does not depend on the order in which they are drawn.

Samples are numbered, and merged on coarse levels, in the order of the shapes.  Of two minima that lie close
together, one order may lead to the first and another order to the second.  So everything between reading and
writing works on shapes sorted by their lengths; shapes of equal length are sorted by position.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..model import Array, Drawing

# Lengths that differ by less than this part of the diagonal count as equal.  It covers the rounding of a
# rotation.
EQUAL_OF_DIAGONAL = 1e-7


def canonical(drawing: Drawing) -> tuple[Drawing, Array]:
    """The drawing with its shapes in canonical order, and the former index of each segment, (S,)."""
    count = len(drawing.names)
    polygon = np.linalg.norm(np.diff(drawing.control, axis=1), axis=2).sum(axis=1)
    unit = EQUAL_OF_DIAGONAL * max(drawing.diagonal, 1e-300)
    length = np.round(np.bincount(drawing.shape, polygon, count) / unit)
    segments = np.bincount(drawing.shape, minlength=count)
    centre = [
        np.round(np.bincount(drawing.shape, drawing.control[:, :, d].mean(axis=1), count) / unit)
        for d in (0, 1)
    ]
    shapes = np.lexsort((centre[1], centre[0], segments, length))
    rank = np.empty(count, dtype=int)
    rank[shapes] = np.arange(count)
    before = np.argsort(rank[drawing.shape], kind="stable")
    now = np.empty_like(before)
    now[before] = np.arange(len(before))
    following = drawing.following[before]
    ordered = replace(
        drawing,
        control=drawing.control[before],
        line=drawing.line[before],
        following=np.where(following >= 0, now[following], -1),
        shape=rank[drawing.shape[before]],
        names=tuple(drawing.names[n] for n in shapes),
        clips=tuple(int(n) for n in sorted(rank[list(drawing.clips)])),
    )
    return ordered, before
