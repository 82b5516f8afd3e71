# SPDX-License-Identifier: GPL-2.0-or-later
"""`sodipodi:nodetypes`: Inkscape's record of the type of each node.

The attribute has one letter for each node: c(orner), s(mooth), z (symmetric), a(uto-smooth).  The first node
of a closed subpath is listed twice.  Inkscape trusts the letters, so they must stay correct when nodes are
added or handles change their lengths.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.arrays import Array
from .path_data import ARC, Subpath

# The handles of a symmetric node differ by at most this part of their length.  Chosen by looking at the
# cases.
SYMMETRIC = 1e-3


@dataclass(frozen=True)
class Run:
    """A subpath before and after.

    control : (m, 4, 2) the new segments; source : (m,) int, the old segment of each
    smooth_start : (m,) bool, whether a node that was added at the segment's start is smooth
    """

    subpath: Subpath
    control: Array
    source: Array
    smooth_start: Array


def update(old: str, runs: list[Run]) -> str | None:
    """The letters of the new nodes; None where the old letters do not fit the path, or where it has arcs."""
    if len(old) != sum(_letters(run) for run in runs) or any(np.any(r.subpath.kind == ARC) for r in runs):
        return None
    letters = []
    at = 0
    for run in runs:
        length = _letters(run)
        letters.append(_run(old[at : at + length], run))
        at += length
    return "".join(letters)


def _letters(run: Run) -> int:
    """The number of letters that the subpath had before."""
    count = len(run.subpath.control)
    nodes = max(count, 1) + (1 if not run.subpath.closed and count else 0)
    return nodes + (1 if run.subpath.closed else 0)


def _run(old: str, run: Run) -> str:
    count = len(run.subpath.control)
    if not count:
        return old
    result = []
    m = len(run.control)
    for n in range(m):
        added = n > 0 and run.source[n] == run.source[n - 1]
        letter = ("s" if run.smooth_start[n] else "c") if added else old[run.source[n]]
        if letter in "za":
            before = n - 1 if n else (m - 1 if run.subpath.closed else None)
            letter = letter if before is not None and _symmetric(run.control[before], run.control[n]) else "s"
        result.append(letter)
    if run.subpath.closed:
        result.append(result[0])
    else:
        result.append(old[-1])
    return "".join(result)


def _symmetric(before: Array, after: Array) -> bool:
    arriving, leaving = before[3] - before[2], after[1] - after[0]
    return bool(np.abs(arriving - leaving).max() <= SYMMETRIC * max(np.abs(arriving).max(), 1e-300))
