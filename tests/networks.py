# SPDX-License-Identifier: GPL-2.0-or-later
"""A small network with everything in it: line, curve, corner, junction, handles, a part apart."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, Iterator

import numpy as np
import slow

from alup.energy.objective import Objective
from alup.energy.problem import (
    Problem,
    Weights,
    analyse,
    core_problem,
    final_problem,
    tie_differences,
)
from alup.geometry.edges import edge_vectors
from alup.model import Ties
from alup.network.sampling import Graph

PAPER = Weights()

#  0-1-2-3-4 a straight line, 4-5-6-7 bends, 7-0 a corner at 0; 2-8-9 a branch, its junction at 2;
#  10-11-12 apart.
POINTS = np.array(
    [
        [0.0, 0.0], [2.0, 1.0], [3.0, 1.5], [5.0, 2.5], [7.0, 3.5], [8.0, 4.8], [8.2, 6.4], [4.0, 7.0],
        [2.6, 3.0], [2.4, 5.0], [11.0, 2.0], [12.0, 3.0], [12.5, 4.5],
    ]
)  # fmt: skip
EDGES = [
    (0, 1), (2, 1), (2, 3), (3, 4), (5, 4), (5, 6), (6, 7), (7, 0), (2, 8), (8, 9), (10, 11), (11, 12)
]  # fmt: skip
STRAIGHT = [(1, 0, 2), (2, 1, 3), (3, 4, 2)]
SCAFFOLD = [(4, 10), (5, 11), (6, 12), (6, 11)]
# Between a sample and a point on an edge, and between points on two edges, each with its share of it.
FACING = [((8, 8), 0.0, (4, 5), 0.3), ((5, 6), 0.25, (11, 12), 0.6), ((1, 1), 0.0, (7, 6), 0.9)]
SLIDE, HOLDS = 0.25, [0.2, np.inf, 0.05]
HELD = [0, 3, 9]

# The pair of edges <2,1>, <2,3> may be told to run on through the junction at 2.
THROUGH = [(1, 2)]


def graph(scale: float = 1.0, noise: float = 0.0, seed: int = 0, through: bool = False) -> Graph:
    """With `noise`, every sample is moved, so that lines have a little bend and nothing is special."""
    moved = POINTS + noise * np.random.default_rng(seed).standard_normal(POINTS.shape)
    pairs = np.array(THROUGH if through else []).reshape(-1, 2).astype(int)
    return Graph(scale * moved + [3.0 * scale, -1.0], np.array(EDGES), np.array(STRAIGHT), pairs)


def simple(points: np.ndarray, edges: list[list[int]], straight: list[list[int]] | None = None) -> Graph:
    """A graph without anything that runs through a junction."""
    turns = np.array(straight or []).reshape(-1, 3).astype(int)
    return Graph(points, np.array(edges), turns, np.zeros((0, 2), dtype=int))


def free(of: Graph, weights: Weights = PAPER) -> Problem:
    """The core round without handles and ties."""
    none = np.zeros(0, dtype=int)
    return core_problem(analyse(of, none, weights), np.zeros((0, 2)), Ties.none(), np.zeros(len(of.edges)))


def scaffold(points: np.ndarray, pairs: Any, weights: Weights = PAPER) -> Ties:
    """Ties of Eq. 22 between samples (T, 2)."""
    joined = np.array(pairs).reshape(-1, 2).astype(int)
    return Ties.between(points, joined, np.full(len(joined), weights.component / max(len(joined), 1)))


def ties(of: Graph, weights: Weights = PAPER) -> Ties:
    """The scaffold's, and some of points that face each other."""
    samples = np.array([[*a, *b] for a, _, b, _ in FACING])
    factor = np.array([[s - 1.0, -s, 1.0 - t, t] for _, s, _, t in FACING])
    offset = np.einsum("tk,tkd->td", factor, of.points[samples])
    count = len(FACING)
    facing = Ties(
        samples=samples,
        factor=factor,
        offset=offset,
        length=np.linalg.norm(offset, axis=1),
        weight=np.linspace(0.5, 2.0, count),
        slide=np.full(count, SLIDE),
        holds=np.array(HOLDS),
    )
    return scaffold(of.points, SCAFFOLD, weights).and_(facing)


def hessian(objective: Objective, at: np.ndarray, softness: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    """The model's whole matrix at positions (N, 2), and differences of the gradient in its place."""

    def gradient(v: np.ndarray) -> np.ndarray:
        return objective.derivatives(objective.state(v, softness), softness)[0].ravel()

    values = objective.derivatives(objective.state(at, softness), softness)[1]
    upper = objective.structure.assembly.matrix(values).toarray()
    moves = 1e-5 * np.eye(at.size).reshape(-1, *at.shape)
    differences = [(gradient(at + move) - gradient(at - move)) / 2e-5 for move in moves]
    return upper + np.triu(upper, 1).T, np.array(differences)


def targets(of: Graph, seed: int = 1) -> np.ndarray:
    size = float(np.ptp(of.points, axis=0).max())
    return of.points[HELD] + 0.1 * size * np.random.default_rng(seed).standard_normal((len(HELD), 2))


def core(of: Graph, weights: Weights = PAPER, tied: bool = True, size: float = 0.0) -> Problem:
    joined = ties(of, weights) if tied else Ties.none()
    sizes = np.full(len(of.edges), size)
    return core_problem(analyse(of, np.array(HELD), weights), targets(of), joined, sizes)


def final(core: Problem, result: np.ndarray, of: Graph, ties: Ties) -> Problem:
    """The final round after a core round's result (N, 2), user units."""
    return final_problem(core, result, analyse(of, core.handles, core.weights), ties)


def both_rounds(of: Graph, tied: bool = True) -> tuple[Problem, Problem, np.ndarray]:
    """Core and final problem, and the made-up core result between them (user units)."""
    first = core(of, tied=tied)
    result = (
        of.points
        + 0.02 * np.random.default_rng(5).standard_normal(of.points.shape) * np.ptp(of.points, axis=0).max()
    )
    return first, final(first, result, of, ties(of) if tied else Ties.none()), result


def slow_round(of: Graph, start: np.ndarray, straight: list[tuple[int, int, int]]) -> slow.Round:
    """The same round for the slow program; start : user units."""
    vectors = [start[b] - start[a] for a, b in EDGES]
    mean = float(np.mean([np.hypot(*v) for v in vectors]))
    middle = start.mean(axis=0)
    wanted = (targets(of) - middle) / mean
    return slow.Round(
        points=of.points,
        start=(start - middle) / mean,
        edges=EDGES,
        straight=straight,
        handles=dict(zip(HELD, wanted)),
        ties=[_slow_tie(one, mean) for one in _each(ties(of))],
        through=[(2, 1, 3)] if len(of.through) else [],
    )


def _each(of: Ties) -> Iterator[dict[str, Any]]:
    for n in range(len(of)):
        yield {one.name: getattr(of, one.name)[n] for one in fields(of)}


def _slow_tie(one: dict[str, Any], mean: float) -> slow.Tie:
    parts: dict[int, float] = {}
    for sample, factor in zip(one["samples"].tolist(), one["factor"].tolist()):
        parts[sample] = parts.get(sample, 0.0) + factor
    numbers = (float(one[name]) for name in ("weight", "slide", "holds"))
    return slow.Tie(parts, one["offset"] / mean, float(one["length"]) / mean, *numbers)


def random_positions(problem: Problem, seed: int, amount: float = 0.3) -> np.ndarray:
    return problem.start + amount * np.random.default_rng(seed).standard_normal(problem.start.shape)


def quadratic(problem: Problem, v: np.ndarray, l: np.ndarray) -> float:
    """What the alternation's positions step minimises (Eq. 14, 16, 17, 22) at positions v and lengths l."""
    w, vector = problem.weights, edge_vectors(v, problem.edges)
    weight = (np.maximum(1.0, l**2) if w.stretch else np.ones_like(l)) / l**2
    across = np.einsum("ed,ed->e", problem.normals, vector)
    along = np.sum((vector - l[:, None] * problem.directions) ** 2, axis=1)
    value = float(np.sum(weight * (w.normal * across**2 + w.edge * along)))
    i, j, k = problem.straight.T
    a, b = (v[j] - v[i]) / l[problem.straight_ij][:, None], (v[i] - v[k]) / l[problem.straight_ik][:, None]
    value += 2.0 * w.straight * float(np.sum((a - b - problem.bend) ** 2))
    value += w.handle * float(np.sum((v[problem.handles] - problem.targets) ** 2))
    missed = tie_differences(problem, v)
    return value + float(np.sum(problem.tie_weight * (missed.real**2 + problem.tie_slide * missed.imag**2)))
