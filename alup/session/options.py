# SPDX-License-Identifier: GPL-2.0-or-later
"""What a run can be told, and what it says besides its result."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..energy.problem import Weights
from ..messages.language import translate as _
from ..methods import registry
from ..network import sampling, weld
from ..refit import refit
from ..regular.find import KINDS
from ..solver import minimise
from ..solver.outcome import Limits

__all__ = [
    "ALUP", "APART", "DEFAULT", "HOLD_TOGETHER", "KINDS", "METHODS", "SOLVERS", "Limits", "Note", "Options",
    "Weights",
]  # fmt: skip

# The method that this package is about, and all of them.
ALUP = "alup"
METHODS = (ALUP, *sorted(registry.METHODS))

SOLVERS = tuple(sorted(minimise.SOLVERS))

# How firmly parts are held together: factors of the weights of their ties.
APART = "apart"
HOLD_TOGETHER = {APART: 0.0, "loosely": 0.1, "normally": 1.0, "firmly": 10.0}


@dataclass(frozen=True)
class Options:
    """What a run can be told.

    spacing : between samples, of the longest side of the bounding box
    snap : curves nearer than this part of the diagonal touch
    crossings : curves that cross keep crossing at the same points of theirs
    fit_tolerance : of the longest side
    add_nodes : where segments can't be fitted this closely; else they are fitted as well as they can be
    hold : how firmly parts that no curve joins are held together, a name in `HOLD_TOGETHER`;
        "apart" lets parts without a handle stay
    method : a name in `METHODS`, which share all but the solving
    solver : a name in `SOLVERS`
    rounds : 2, or 1 for the core round alone, to see what the final one adds
    time_limit : seconds from the beginning of a run to the end of solving; the best state until then is
        taken, and `report["notes"]` says so
    max_vertices : the spacing is raised, and it is said, where there would be more samples
    """

    spacing: float = sampling.SPACING
    snap: float = weld.SNAP_DISTANCE
    crossings: bool = True
    fit_tolerance: float = refit.FIT_TOLERANCE
    add_nodes: bool = True
    hold: str = "normally"
    method: str = ALUP
    solver: str = "newton"
    limits: Limits = field(default_factory=Limits)
    rounds: int = 2
    time_limit: float = 20.0
    max_vertices: int = 100_000
    regular: frozenset[str] = frozenset(KINDS)
    weights: Weights = field(default_factory=Weights)


DEFAULT = Options()


@dataclass(frozen=True)
class Note:
    """A sentence, which can be translated, with named fields, and their values."""

    text: str
    values: dict[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        return self.text.format(**self.values)

    def translated(self) -> str:
        return _(self.text).format(**self.values)
