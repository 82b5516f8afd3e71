# SPDX-License-Identifier: GPL-2.0-or-later
"""What touched before: how far it is apart afterwards."""

from __future__ import annotations

import numpy as np

from alup.geometry import bezier
from alup.model import Drawing, Refitted
from alup.network.contacts import contacts


def largest_opening(before: Drawing, after: Refitted, coincident: float) -> float:
    """The largest distance, in user units, between what was within `coincident` of each other.

    Nodes that were one point are compared with each other; nodes that lay on another segment, with
    the nearest point of what that segment became.
    """
    count = len(before.control)
    found = contacts(before.control, before.line, coincident)
    first = np.searchsorted(after.source, np.arange(count))
    last = np.searchsorted(after.source, np.arange(count), side="right") - 1
    ends = np.stack([after.control[first, 0], after.control[last, 3]], axis=1).reshape(-1, 2)
    was = before.control[:, [0, 3]].reshape(-1, 2)
    worst = 0.0
    order = np.argsort(found.end, kind="stable")
    for group in np.split(order, np.flatnonzero(np.diff(found.end[order])) + 1):
        if np.ptp(was[group], axis=0).max() <= coincident:  # not a chain of ever so near nodes
            worst = max(worst, float(np.ptp(ends[group], axis=0).max()))
    for segment, node in zip(found.segment, found.node):
        if node < 0:
            continue
        parts = after.control[first[segment] : last[segment] + 1]
        t = np.linspace(0.0, 1.0, 65)
        away = np.linalg.norm(bezier.evaluate(parts[:, None], t[None]) - ends[node], axis=2)
        wanted = np.tile(ends[node], (len(parts), 1))
        best = bezier.nearest_parameters(parts, wanted, t[away.argmin(axis=1)])
        gap = np.linalg.norm(bezier.evaluate(parts, best) - ends[node], axis=1).min()
        worst = max(worst, float(gap))
    return worst
