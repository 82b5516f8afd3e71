# SPDX-License-Identifier: GPL-2.0-or-later
"""What is regular in a drawing, as the page shows it: in words, and by lines over the drawing."""

from __future__ import annotations

from typing import Sequence

import numpy as np

from ..document.frame_outlines import ROUNDING_OF_DIAGONAL
from ..messages.language import N_
from ..messages.language import translate as _
from ..model import Array, Drawing
from ..regular import outline
from ..regular.find import CIRCLES, COPIES, WORDS
from ..session import regular_input
from ..session.options import Options

# Lines for as many items take some 10 ms.
MOST_MOVING = 150

# An ellipse is called a circle if its sides differ by no more than this part.
_EVEN = 0.02

# One of a kind, and several: `count` is how many, `size` how many are in each.
_CIRCLES = N_("1 circle"), N_("{count} circles")
_ELLIPSES = N_("1 ellipse"), N_("{count} ellipses")
_COPIES = (N_("{count} parts alike"),) * 2  # there are two at least
_ROWS = N_("1 row of {size}"), N_("{count} rows of {size}"), N_("{count} rows")
_COLUMNS = N_("1 column of {size}"), N_("{count} columns of {size}"), N_("{count} columns")
_RINGS = N_("1 ring of {size}"), N_("{count} rings of {size}"), N_("{count} rings")
_LINES = (N_("{count} lines"),) * 2
_WORDS = N_("1 word"), N_("{count} words")
_HALVES = N_("mirrored halves"), N_("mirrored quarters")


class Regularities:
    """drawing : as it was read"""

    def __init__(self, drawing: Drawing, options: Options):
        self._seen = regular_input.look(drawing, options)
        self._outlines = outline.Outlines(self._seen, drawing.diagonal)
        unit = max(ROUNDING_OF_DIAGONAL * drawing.diagonal, 1e-12)
        self._decimals = max(0, int(np.ceil(-np.log10(unit))))

    @property
    def follows(self) -> bool:
        """Whether there are so few that their lines may be drawn with every frame of a drag."""
        return len(self._seen.regular.items) <= MOST_MOVING

    def lines(self, was: Array, now: Array, source: Array, kept: bool) -> tuple[str, str]:
        """The lines over the curves, and those that only join what is alike: path data, root user units.

        See `outline.Outlines.drawn`.
        """
        drawn = self._outlines.drawn(was, now, source, kept)
        firm, faint = ([one.control for one in drawn if one.joins is each] for each in (False, True))
        return self._data(firm), self._data(faint)

    def _data(self, curves: list[Array]) -> str:
        """Path data of curves (k, 4, 2), which begin anew where one does not go on from the last one."""
        if not curves:
            return ""
        control = np.concatenate(curves)
        new = np.append(True, (control[1:, 0] != control[:-1, 3]).any(axis=1))
        number = f"%.{self._decimals}f"
        pair = f"{number},{number}"
        going = f"C{pair} {pair} {pair}"
        words = "".join(f"M{pair}{going}" if each else going for each in new.tolist())
        numbers = [
            n for one, each in zip(control, new.tolist()) for n in one[0 if each else 1 :].ravel().tolist()
        ]
        return words % tuple(numbers)

    def said(self) -> str:
        """How many of what were found, in words; nothing where none were."""
        regular = self._seen.regular
        size = [item.high - item.low for item in regular.items]
        even = [abs(float(s[0] / s[1]) - 1.0) <= _EVEN for s in size]
        kinds = [item.kind for item in regular.items]
        round_ = [e for e, kind in zip(even, kinds) if kind == CIRCLES]
        parts = [
            _counted(_CIRCLES, round_.count(True)),
            _counted(_ELLIPSES, round_.count(False)),
            _in_lines(_ROWS, [len(level.items) for level in regular.levels if level.axis == 1]),
            _in_lines(_COLUMNS, [len(level.items) for level in regular.levels if level.axis == 0]),
            _in_lines(_RINGS, [len(ring.items) for ring in regular.rings]),
            _counted(_COPIES, kinds.count(COPIES)),
            _counted(_WORDS, kinds.count(WORDS)),
            _counted(_LINES, self._seen.straight),
            _counted(_HALVES, len(self._seen.axes)),
        ]
        return ", ".join(part for part in parts if part)


def _counted(words: Sequence[str], count: int) -> str:
    return _(words[0 if count == 1 else 1]).format(count=count) if count else ""


def _in_lines(words: Sequence[str], sizes: list[int]) -> str:
    if not sizes:
        return ""
    one, several_alike, several = words
    alike = several_alike if len(set(sizes)) == 1 else several
    return _(one if len(sizes) == 1 else alike).format(count=len(sizes), size=sizes[0])
