"""The parts that carry handles: both rounds, and again where their outline came to cross itself (Sec. 3.5).

Nothing in the energy keeps the two sides of a narrow stem apart.  When the result crosses itself where the
input did not, the sides of the input's Delaunay triangulation that join the crossing sections are added to
the scaffold, and both rounds are solved again.  The paper does this once, with the weight of Eq. 22;
here that weight rises until the crossings are gone or a limit is reached, and of all results the one with
the fewest is kept.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import scaffold, solve
from .components import components
from .errors import SolveError
from .intersections import crossing_edges
from .model import Array
from .problem import Weights, core_problem, final_problem
from .sample import Graph

# The joined sections reach this far from a crossing, in distances of the crossing edges in the input (more
# than half, and the two would be one section that runs around the end of the stem)
# and in spacings.
REACH_OF_WIDTH, REACH_OF_SPACING = 0.5, 4.0

# w_comp = 0.01/|S| is weak against a stem of a hundred edges: the weights tried, as factors of it.
STRENGTHS = (1e2, 1e3, 1e4)


@dataclass(frozen=True)
class Led:
    """moved : (N, 2) user units; rounds : core and final; crossings : new ones at first, and left.

    Without the final round `rounds` has the core only.
    """

    moved: Array
    rounds: tuple[solve.Round, ...]
    crossings: tuple[int, int]
    again: int


def lead(
    graph: Graph,
    handles: Array,
    targets: Array,
    joint: Array,
    weights: Weights,
    solver: solve.Solver,
    limits: solve.Limits,
    avoid_crossings: bool,
    rounds: int = 2,
) -> Led:
    """Solve the rounds.  handles : (H,); targets : (H, 2) user units; joint : (T, 2) scaffold.

    rounds : 2, or 1 for the core alone, one of the ablations (`Weights`)
    """
    moved, done = _rounds(graph, handles, targets, joint, 1.0, weights, solver, limits, None, rounds)
    if all(one.status is solve.Status.UNMOVED for one in done):
        return Led(graph.points, done, (0, 0), 0)
    usual = crossing_edges(graph.points, graph.edges)
    new = np.setdiff1d(crossing_edges(moved, graph.edges), usual)
    led = Led(moved, done, (len(new), len(new)), 0)
    if not avoid_crossings or not len(new) or limits.over:
        return led
    with scaffold.Triangulation(graph.points, graph.edges) as triangulation:
        sides, _ = triangulation.sides()
    wanted = new
    for attempt, strength in enumerate(STRENGTHS, start=1):
        added = _joining(graph, sides, wanted)
        # More sides than edges are a second network across the first: one factorisation may take a minute.
        if not len(added) or len(added) > len(graph.edges):
            break
        every = np.concatenate([joint, added])
        factor = np.concatenate([np.ones(len(joint)), np.full(len(added), strength)])
        try:
            moved, done = _rounds(
                graph, handles, targets, every, factor, weights, solver, limits, done[0], rounds
            )
        except SolveError:  # what was found without these edges is a result
            break
        new = np.setdiff1d(crossing_edges(moved, graph.edges), usual)
        if len(new) < led.crossings[1]:
            led = Led(moved, done, (led.crossings[0], len(new)), attempt)
        if not len(new) or limits.over:
            break
        wanted = np.union1d(wanted, new)
    return led


def _rounds(
    graph: Graph,
    handles: Array,
    targets: Array,
    joint: Array,
    strength: Array | float,
    weights: Weights,
    solver: solve.Solver,
    limits: solve.Limits,
    before: solve.Round | None,
    count: int,
) -> tuple[Array, tuple[solve.Round, ...]]:
    core = core_problem(graph, handles, targets, joint, weights, strength)
    first = solver(core, limits, before)
    if count == 1:
        return core.to_user(first.positions), (first,)
    final = final_problem(core, core.to_user(first.positions), graph, strength)
    last = solver(final, limits, first)
    return final.to_user(last.positions), (first, last)


def _joining(graph: Graph, sides: Array, crossing: Array) -> Array:
    """Sides that join different sections of the curves around crossing pairs of edges, (m, 2)."""
    count = len(graph.edges)
    pairs = np.stack([crossing // count, crossing % count], axis=1)[:: max(1, len(crossing) // 100)]
    middle = graph.points[graph.edges[pairs]].mean(axis=2)
    vectors = graph.points[graph.edges[:, 1]] - graph.points[graph.edges[:, 0]]
    spacing = float(np.linalg.norm(vectors, axis=1).mean())
    width = np.linalg.norm(middle[:, 0] - middle[:, 1], axis=1)
    reach = REACH_OF_WIDTH * width + REACH_OF_SPACING * spacing
    zone = np.zeros(len(graph.points), dtype=bool)
    for (a, b), radius in zip(middle, reach):
        for centre in (a, b):
            zone |= np.linalg.norm(graph.points - centre, axis=1) <= radius
    inside = zone[graph.edges].all(axis=1)
    _, section = components(graph.edges[inside], len(graph.points))
    joins = zone[sides].all(axis=1) & (section[sides[:, 0]] != section[sides[:, 1]])
    return sides[joins]
