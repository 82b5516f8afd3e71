"""Parts without a handle follow the parts that have one (Sec. 3.5).

The paper adds Eq. 22 to the energy of the whole network, so that a label also pulls at its bottle, with a
weight so small that the label hardly does.  Here the coupling goes one way: first the parts that carry
handles are reshaped as if they were alone, then the others settle between them,

    F + w_comp sum_T |(v_i-v_j) - (v0_i-v0_j)|^2 / l0^2 + w_size sum (l - l0)^2,

with the samples of the first ones fixed.  What handles say exactly is met exactly, and the coupling may be
as strong as one likes without spoiling an outline.  E_size makes a follower keep its size at the
paper's weight; at 100 times the weight both pull equally and it half follows its surroundings' scale.

A follower that comes to overlap what it did not overlap before has the weight of its own scaffold edges
raised, until that is gone or a limit reached; the state with the fewest overlaps is kept.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from . import solve
from .errors import SolveError
from .intersections import crossing_edges
from .model import Array
from .problem import Weights, core_problem
from .sample import Graph

# Of E_size over all edges of all followers together, against w_comp = 0.01 of the scaffold's.
FOLLOWER_SIZE = 1.0

# Where followers overlap anew their weights rise by this factor, this often at most.
RAISE, RAISES = 10.0, 4

# A follower's shape hardly changes, and where it stands is judged by eye: solved less closely.
SLACK = 100.0


@dataclass(frozen=True)
class Followed:
    """moved : (N, 2) all samples; rounds : one a solve; overlaps : (before, left) pairs of edges."""

    moved: Array
    rounds: tuple[solve.Round, ...]
    raised: int
    overlaps: tuple[int, int]


def follow(
    graph: Graph,
    label: Array,
    leads: Array,
    moved: Array,
    scaffold: Array,
    weights: Weights,
    solver: solve.Solver,
    limits: solve.Limits,
    avoid_overlaps: bool,
) -> Followed:
    """Move the components that are not `leads`.

    label : (N,) components; leads : (C,) bool; moved : (N, 2) positions, final where they lead, user units
    scaffold : (T, 2) samples
    """
    follows = ~leads[label]
    joined = scaffold[follows[scaffold].any(axis=1)]
    # The followers, and the samples of the others that the scaffold ties them to, held in place.
    part = follows.copy()
    part[joined] = True
    number = np.cumsum(part) - 1
    held = np.flatnonzero(part & ~follows)
    inner = follows[graph.edges[:, 0]]
    straight = graph.straight_turns[follows[graph.straight_turns[:, 0]]]
    through = graph.through[inner[graph.through[:, 0]]]
    edge_number = np.cumsum(inner) - 1
    own = Graph(graph.points[part], number[graph.edges[inner]], number[straight], edge_number[through])
    weights = replace(weights, size=FOLLOWER_SIZE / max(int(inner.sum()), 1), keep_size=0.0)
    limits = replace(limits, slack=SLACK)
    strength = np.ones(len(joined))
    usual = crossing_edges(graph.points, graph.edges)
    rounds: list[solve.Round] = []
    best: tuple[int, Array] | None = None
    before = 0
    while True:
        problem = core_problem(own, number[held], moved[held], number[joined], weights, strength)
        try:
            rounds.append(solver(problem, limits, rounds[-1] if rounds else None))
        except SolveError:
            if best is None:
                raise
            return Followed(best[1], tuple(rounds), len(rounds) - 1, (before, best[0]))
        result = moved.copy()
        result[follows] = problem.to_user(rounds[-1].positions)[number[follows]]
        new = np.setdiff1d(crossing_edges(result, graph.edges), usual)
        pairs = np.stack([new // len(graph.edges), new % len(graph.edges)], axis=1)
        parts = label[graph.edges[pairs][:, :, 0]]
        if best is None:
            before = len(new)
        if best is None or len(new) < best[0]:  # of equals the least raised
            best = (len(new), result)
        overlapping = np.unique(parts[parts[:, 0] != parts[:, 1]])
        raised = np.isin(label[joined], overlapping[~leads[overlapping]]).any(axis=1)
        if not avoid_overlaps or not raised.any() or len(rounds) > RAISES or limits.over:
            return Followed(best[1], tuple(rounds), len(rounds) - 1, (before, best[0]))
        strength = np.where(raised, RAISE * strength, strength)
