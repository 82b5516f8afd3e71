# SPDX-License-Identifier: GPL-2.0-or-later
"""reshape(): one run, and the report on it.

drawing -> network -> grabbed points -> samples -> anchors -> ties
-> core round -> final round -> refit: a session (`alup.session.session`) with one solve.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Callable, Sequence

from ..messages.language import N_
from ..model import Array, Drawing, Refitted
from ..network import sampling
from ..solver import outcome
from . import metrics
from .options import (
    ALUP,
    APART,
    DEFAULT,
    HOLD_TOGETHER,
    METHODS,
    SOLVERS,
    Limits,
    Note,
    Options,
    Weights,
)
from .rounds import NAMES
from .session import Answer, Session

__all__ = [
    "ALUP", "APART", "HOLD_TOGETHER", "METHODS", "SOLVERS", "Limits", "Note", "Options", "Result", "Weights",
    "reshape",
]  # fmt: skip


@dataclass(frozen=True)
class Result:
    """refitted : the new segments; samples : of the network as it was

    moved : (N, 2) where they are now, user units; notes : what falls short of what was asked for
    ignored : names of handles that hold nothing; figures : makes the report
    """

    refitted: Refitted
    samples: sampling.Samples
    moved: Array
    notes: tuple[Note, ...]
    ignored: tuple[str, ...]
    figures: Callable[[], dict[str, Any]] = field(repr=False)

    @cached_property
    def report(self) -> dict[str, Any]:
        """Figures of the run, ready for JSON, notes in English.  Few runs are asked for them."""
        return self.figures()


def reshape(drawing: Drawing, options: Options = DEFAULT) -> Result:
    """Reshape a drawing by its handles.

    Raises DocumentError, HandleError or SolveError with a sentence for the user.
    """
    deadline = time.monotonic() + options.time_limit
    session = Session(drawing, options, deadline)
    return result_of(session, session.solve(deadline=deadline))


def result_of(session: Session, answer: Answer) -> Result:
    """The answer of a session as the result of a run."""
    drawing, options = session.drawing, session.options
    seconds = dict(session.seconds)
    for stage, duration in answer.seconds.items():
        seconds[stage] = seconds.get(stage, 0.0) + duration
    notes = (*answer.notes, *_unfinished(answer.rounds, options))
    held, net, diagonal = session.held, session.net, session.drawing.diagonal

    def figures() -> dict[str, Any]:
        samples, rounds = held.samples, [_round_report(*each) for each in zip(NAMES, answer.rounds)]
        in_time = not any(one.status is outcome.Status.TIME for one in answer.rounds)
        return {
            "method": options.method,
            "vertices": len(samples.points),
            "edges": len(samples.edges),
            "components": held.parts,
            "contacts": net.contacts,
            "straight_turns": len(samples.straight_turns),
            "handles": len(answer.anchors.samples),
            "ignored_handles": list(held.grabbed.ignored),
            **metrics.report(samples, answer.moved, answer.anchors, held.about.facing, diagonal),
            "segments": len(drawing.control),
            "segments_after": len(answer.refitted.control),
            "fit_error_of_longest_side": answer.refitted.error / float(drawing.size.max()),
            "rounds": rounds,
            "notes": [str(note) for note in notes],
            "seconds": seconds,
            **answer.figures,
            **({"in_time": in_time} if answer.rounds else {}),
        }

    return Result(answer.refitted, held.samples, answer.moved, notes, tuple(held.grabbed.ignored), figures)


# Of the core round, of the final one, and of the one for what is regular.
_AT_LIMIT = (
    N_(
        "The first round ended at its limit of {iterations} iterations, before the shape was at its best. "
        "Allow more iterations."
    ),
    N_(
        "The second round ended at its limit of {iterations} iterations, before the shape was at its best. "
        "Allow more iterations."
    ),
    N_(
        "The third round, for what is regular, ended at its limit of {iterations} iterations, before the "
        "shape was at its best. Allow more iterations."
    ),
)


def _unfinished(rounds: Sequence[outcome.Round], options: Options) -> list[Note]:
    """Notes on rounds that ended before their minimum."""
    notes = []
    ended = {one.status for one in rounds}
    if outcome.Status.TIME in ended:
        text = N_(
            "The time limit of {seconds:g} s was reached; this is the best shape found until then. Allow "
            "more time, or a larger sample spacing."
        )
        notes.append(Note(text, {"seconds": options.time_limit}))
    if outcome.Status.SINGULAR in ended:
        text = N_("The equations of a step could not be solved; this is the best shape found until then.")
        notes.append(Note(text))
    for text, one in zip(_AT_LIMIT, rounds):
        if one.status is outcome.Status.ITERATIONS:
            notes.append(Note(text, {"iterations": options.limits.iterations}))
    return notes


def _round_report(name: str, result: outcome.Round) -> dict[str, Any]:
    terms = result.history[0].keys()
    return {
        "round": name,
        "status": result.status.name,
        "why": result.status.value,
        "iterations": result.iterations,
        "coarse_iterations": result.coarse,
        "energy": {term: [entry[term] for entry in result.history] for term in terms},
    }
