# SPDX-License-Identifier: GPL-2.0-or-later
"""Small drawings and their stages, made in one line each for the tests."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Sequence

import numpy as np

from alup.energy.problem import Problem, Weights, analyse, core_problem
from alup.geometry import bezier
from alup.handles import binding
from alup.model import Drawing, Handle, Ties
from alup.network import sampling, weld
from alup.network.sampling import Graph, Samples
from alup.network.weld import Network
from alup.session import pipeline
from alup.session.session import Session
from alup.svg import path_data

Array = np.ndarray
Point = Sequence[float]

# The published weights.
PAPER = Weights()

# A teapot-like outline: lines, smooth curves, corners, near-symmetric nowhere.
BLOB = (
    "M10,80 C10,40 30,20 60,20 S110,45 115,70 L140,60 L150,75 L120,100 C110,125 80,130 60,130 S10,115 10,80 Z"
)


def pin(x: float, y: float, name: str = "") -> Handle:
    return Handle(name or f"pin {x:g},{y:g}", np.array([x, y], dtype=float), None, 0.0)


def drag(start: Point, end: Point, name: str = "", reach: float = 0.0) -> Handle:
    return Handle(
        name or f"drag {start[0]:g},{start[1]:g}",
        np.array(start, dtype=float),
        np.array(end, dtype=float),
        reach,
    )


def drawing(*paths: str, handles: Sequence[Handle] = (), **others: Any) -> Drawing:
    """A drawing of path data, one shape each."""
    control, line, following, shape = [], [], [], []
    count = 0
    for n, d in enumerate(paths):
        for subpath in path_data.parse(d):
            k = len(subpath.control)
            if not k:
                continue
            control.append(subpath.control)
            line.append(np.isin(subpath.kind, (path_data.LINE, path_data.CLOSE)))
            after = np.arange(count + 1, count + k + 1)
            after[-1] = count if subpath.closed else -1
            following.append(after)
            shape.append(np.full(k, n))
            count += k
    return Drawing(
        control=np.concatenate(control),
        line=np.concatenate(line),
        following=np.concatenate(following),
        shape=np.concatenate(shape),
        names=tuple(f"path{n}" for n in range(len(paths))),
        handles=tuple(handles),
        **others,
    )


def mapped(before: Drawing, matrix: Any, shift: Any = (0.0, 0.0)) -> Drawing:
    """The drawing and its handles under the affine map x -> matrix x + shift."""
    linear, offset = np.asarray(matrix, dtype=float), np.asarray(shift, dtype=float)
    size = float(np.sqrt(abs(np.linalg.det(linear))))
    moved = tuple(
        Handle(
            h.name,
            linear @ h.rest + offset,
            None if h.target is None else linear @ h.target + offset,
            h.reach * size,
        )
        for h in before.handles
    )
    control = before.control @ linear.T + offset
    return Drawing(control, before.line, before.following, before.shape, before.names, moved, before.sections)


@dataclass(frozen=True)
class Stages:
    """What the stages before the solver make of a drawing."""

    drawing: Drawing
    network: Network
    samples: Samples
    held: Array
    targets: Array
    ties: Ties
    problem: Problem


def stages(before: Drawing, spacing: float = 5.0, tied: bool = True, weights: Weights = PAPER) -> Stages:
    """All stages up to the core round's problem; spacing in user units."""
    hold = pipeline.Options().hold if tied else pipeline.APART
    options = pipeline.Options(spacing=spacing / float(before.size.max()), hold=hold, weights=weights)
    session = Session(before, options)
    held, rounds = session.held, session.held.rounds
    assert rounds is not None
    assert rounds.part.all() or not tied, "a part that stays is no part of the problem"
    anchors = binding.anchors(session.drawing, held.grabbed, held.samples)
    of, problem = Ties.none(), untied(held.samples, anchors.samples, anchors.targets, weights)
    if tied:
        problem, of, _growth = rounds.core(anchors.targets)
    return Stages(session.drawing, session.net, held.samples, anchors.samples, anchors.targets, of, problem)


def untied(graph: Graph, held: Array, targets: Array, weights: Weights = PAPER) -> Problem:
    """The core round without ties."""
    analysis = analyse(graph, held, weights)
    return core_problem(analysis, targets, Ties.none(), np.zeros(len(graph.edges)))


def sampled(before: Drawing, spacing: float = 5.0, crossings: bool = True) -> tuple[Network, Samples]:
    """Network and samples of a drawing without regard to handles."""
    net = weld.build(before, weld.SNAP_DISTANCE * before.diagonal, crossings)
    none = np.zeros(0)
    return net, sampling.sample(net, spacing, none.astype(int), none)


def reshaped(before: Drawing, **options: Any) -> pipeline.Result:
    return pipeline.reshape(before, pipeline.Options(**options))


def curve_points(control: Array, steps: int = 17) -> Array:
    """Points of cubics (S, 4, 2) at equal steps of their parameter, (S * steps, 2)."""
    return bezier.evaluate(control[:, None], np.linspace(0.0, 1.0, steps)[None, :]).reshape(-1, 2)


def rotation(degrees: float) -> Array:
    angle = np.radians(degrees)
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
