# SPDX-License-Identifier: GPL-2.0-or-later
"""The whole document of a live window: a batch run of a copy of it, and what a page shows of that."""

from __future__ import annotations

import copy
import time
from dataclasses import dataclass
from typing import Any, Callable, Sequence

import numpy as np

from .. import run
from ..document import grips as gripping
from ..document import notes, painted_shapes, reading, restore_original
from ..document.reading import UNSEEN
from ..document.tree import shown
from ..document.tree.elements import page_of
from ..messages.language import translate as _
from ..model import Drawing
from ..session import pipeline
from ..session.options import APART, Options
from .history import Asked

# Of the diagonal: a handle that misses its target by more is worth a word.
MISSED_OF_DIAGONAL = 2e-3

# Of the diagonal: margin around a drawing without a page.
_MARGIN = 0.05


@dataclass(frozen=True)
class Settled:
    """What a run has made of a copy for what was asked for.

    tree : the copy; page : what is to be shown of it; said : what falls short; seconds : that it took
    """

    asked: Asked
    tree: Any
    page: shown.Shown
    said: tuple[str, ...]
    seconds: float


class Whole:
    """svg : the root element of the document, which stays as it is; selected : elements to reshape

    read : the document as it was read; keys : numbers of its elements; size : of new handles
    grips : those that it has; page : what is shown of it at first
    """

    def __init__(self, svg: Any, selected: Sequence[Any], options: Options):
        """Raises DocumentError or HandleError as a run does."""
        self._svg, self._selected = svg, list(selected)
        self.keys = {element: n for n, element in enumerate(svg.iter()) if isinstance(element.tag, str)}
        self.read = self.read_for(options)
        self._origins = gripping.grips_of(self.read)
        self.grips = tuple(self._origins.values())
        self.size = painted_shapes.measure(svg, self._selected)
        self.page = shown.show(svg, self.keys, self.box, *_lit(self.read))

    def read_for(self, options: Options) -> reading.Document:
        """Read the document, which depends on whether parts without a handle come along."""
        self.read = reading.read(self._svg, self._selected, False, options.hold != APART)
        return self.read

    @property
    def colour(self) -> str | None:
        """Of the page, if the document says it."""
        return shown.page_colour(self._svg)

    @property
    def box(self) -> tuple[float, float, float, float]:
        """x, y, width and height of the page, or of the drawing with a margin; root user units."""
        page = page_of(self._svg)
        if page is None or not (page[1] > page[0]).all():
            page = self.read.drawing.bounds
            margin = _MARGIN * self.read.drawing.diagonal
            page = np.array([page[0] - margin, page[1] + margin])
        x, y = page[0].tolist()
        width, height = (page[1] - page[0]).tolist()
        return x, y, width, height

    def run(
        self, asked: Asked, options: Options, known: Callable[[Drawing], pipeline.Result | None]
    ) -> Settled:
        """A batch run of a copy, with the handles that are asked for.  known : see `run.reshape`"""
        began = time.perf_counter()
        tree = copy.deepcopy(self._svg.getroottree())
        svg = tree.getroot()
        twins = dict(zip(self._svg.iter(), svg.iter()))
        selected = [twins[element] for element in self._selected]
        origins = {grip.name: twins[element] for element, grip in self._origins.items()}
        before = {grip.name: grip for grip in self.grips}
        gripping.put(svg, asked.grips, origins, before, self.size)
        notes.clear(svg)  # the page says what they would
        said: list[str] = []
        if asked.grips:
            done = run.reshape(svg, selected, options, known=known)
            read, said = done.read, _said(done)
        else:
            if self.read.run_start.again:
                restore_original.restore(svg, selected)
            read = reading.read(svg, selected, False, asked.hold != APART)
        keys = {twins[element]: key for element, key in self.keys.items()}
        page = shown.show(svg, keys, self.box, *_lit(read))
        return Settled(asked, tree, page, tuple(said), time.perf_counter() - began)


def _lit(read: reading.Document) -> tuple[set, set]:
    """The shapes that are reshaped, and all that goes along."""
    curves = {shape.element for shape in read.shapes if shape.origin is shape.element}
    along = {item.element for item in read.carried} | {clone.element for clone in read.clones}
    return curves, curves | along | {element for element, _matrix in read.met.other}


def _said(done: run.Run) -> list[str]:
    """What a run has not done as asked, a sentence each; nothing where all is well."""
    report, lines = done.result.report, []
    missed, crossed = report["handle_error_of_diagonal"], report["new_crossings"]
    if missed > MISSED_OF_DIAGONAL:
        percent = 100.0 * missed
        lines.append(
            _("A handle is off its place by {percent:.1f} % of the drawing.").format(percent=percent)
        )
    if crossed:
        lines.append(_("{count} new crossings.").format(count=crossed))
    lines += [note.translated() for note in done.result.notes]
    seen = [entry for entry in done.read.skipped if entry["why"] not in UNSEEN]
    lines += [_("{name}: {why}.").format(name=entry["id"], why=_(entry["why"])) for entry in seen]
    idle = _("The handle {name} lies on nothing that was reshaped.")
    return lines + [idle.format(name=name) for name in done.ignored]
