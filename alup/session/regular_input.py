# SPDX-License-Identifier: GPL-2.0-or-later
"""What a run would find regular in a drawing, for a window that shows it before there are handles."""

from __future__ import annotations

import time

import numpy as np

from ..model import Drawing
from ..network import sampling, shape_order
from ..refit import refit
from ..regular import find, symmetry
from ..regular.outline import Seen
from .options import Options
from .session import affordable, network


def look(drawing: Drawing, options: Options) -> Seen:
    """What is regular in a drawing, of all kinds.  Raises DocumentError as a run does."""
    longest = float(drawing.size.max())
    if not longest > 0.0:
        return Seen(find.Regular(), [], [], [])
    ordered, before = shape_order.canonical(drawing)
    net, _notes = network(ordered, options, time.monotonic() + options.time_limit)
    spacing, _notes = affordable(net, options, longest)
    none = np.zeros(0)
    samples = sampling.sample(net, spacing, none.astype(int), none)
    rows = refit.rows(ordered, net, samples)
    along = find.Along(rows.segment, rows.sample, samples.edges, samples.points)
    regular = find.find(ordered, along, frozenset(find.KINDS))
    segments, count = [], len(ordered.control)
    for item in regular.items:
        inside = np.isin(rows.sample, item.samples)
        whole = np.bincount(rows.segment, ~inside, count) == 0
        touched = np.bincount(rows.segment, inside, count) > 0
        segments.append(np.sort(before[np.flatnonzero(whole & touched)]))
    # Copies are shown as such: their sides are not told once more.
    of_items = np.unique(np.concatenate(segments)) if segments else np.zeros(0, dtype=int)
    lines = [np.setdiff1d(before[mine], of_items) for mine in regular.lines.segments]
    return Seen(regular, segments, lines, [mirror.axis for mirror in symmetry.find(samples.points)])
