# SPDX-License-Identifier: GPL-2.0-or-later
"""One run: the tree of a document in, the same tree reshaped.

read -> pipeline -> once more with the seams of mirrored halves held -> write.  On any error the document is
what it was.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any, Callable, Sequence

from .document import mirror_seams, reading, writing
from .model import Drawing
from .session import pipeline
from .session.options import APART, Options


@dataclass(frozen=True)
class Run:
    """What a run has made of a document.

    changed : names of the elements that did; ignored : names of handles that had no part in it
    read_at, solved_at : when that was done, on the clock of `time.perf_counter`
    """

    read: reading.Document
    result: pipeline.Result
    changed: list[str]
    ignored: list[str]
    read_at: float
    solved_at: float


def reshape(
    svg: Any,
    selected: Sequence[Any],
    options: Options,
    whole: bool = False,
    keep_handles: bool = True,
    known: Callable[[Drawing], pipeline.Result | None] = lambda _drawing: None,
) -> Run:
    """Reshape the selected elements of a document by the handles in it.

    svg : the root element, of inkex; selected : none, or only handles, means every visible, unlocked object,
        and so does `whole`
    known : the result for what was read, where it is known already
    Raises DocumentError, HandleError or SolveError with a sentence for the user.
    """
    read = reading.read(svg, list(selected), whole, options.hold != APART)
    read_at = time.perf_counter()
    result = known(read.drawing) or pipeline.reshape(read.drawing, options)
    held = mirror_seams.held(read, result.refitted)
    if held is not None:
        result = pipeline.reshape(held, options)
    solved_at = time.perf_counter()
    arc_tolerance = options.fit_tolerance * float(read.drawing.size.max())
    ignored = [*result.ignored, *read.ignored]
    changed = writing.write(read, result.refitted, keep_handles, arc_tolerance, ignored)
    return Run(read, result, changed, ignored, read_at, solved_at)
