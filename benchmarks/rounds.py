# SPDX-License-Identifier: GPL-2.0-or-later
"""The problems of a case, as the pipeline's first pass makes them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import builders
import clipart
import numpy as np

from alup.document import reading
from alup.energy.problem import Problem, analyse, final_problem
from alup.geometry.connected_components import components
from alup.model import Ties
from alup.network import sampling
from alup.network.sampling import Graph
from alup.ties.groups import held_parts


@dataclass(frozen=True)
class CoreRound:
    """graph : the part of a case's drawing that carries handles; problem : its core round"""

    graph: Graph
    problem: Problem

    def final(self, positions: np.ndarray) -> Problem:
        """The final round after the core round's positions (N, 2), without ties."""
        of = analyse(self.graph, self.problem.handles, self.problem.weights)
        return final_problem(self.problem, self.problem.to_user(positions), of, Ties.none())


def core_of(entry: dict[str, Any], spacing: float = sampling.SPACING) -> CoreRound:
    """The core round of a case.

    entry : of `cases.json`; spacing : of the longest side of the bounding box
    """
    svg, chosen = clipart.build(entry).opened()
    drawing = reading.read(svg, chosen, False, True).drawing
    made = builders.stages(drawing, spacing * float(drawing.size.max()), tied=False)
    _, label = components(made.samples.edges, len(made.samples.points))
    part = held_parts(label, made.held)[label]
    graph, number = made.samples.part(part), np.cumsum(part) - 1
    return CoreRound(graph, builders.untied(graph, number[made.held], made.targets))
