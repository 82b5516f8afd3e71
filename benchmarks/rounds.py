"""The problems of a case, as the pipeline's first pass makes them."""

from __future__ import annotations

from typing import Any

import clipart
import inkex
import numpy as np

from alup import pipeline
from alup.document import reading
from alup.energy.problem import Problem, core_problem
from alup.geometry.connected_components import components
from alup.handles import binding
from alup.model import Ties
from alup.network import sampling, weld
from alup.network.sampling import Graph


def core_of(entry: dict[str, Any], spacing: float = sampling.SPACING) -> tuple[Graph, Problem]:
    """The part of a case's drawing that carries handles, and its core problem.

    entry : of `cases.json`; spacing : of the longest side of the bounding box
    """
    built, options = clipart.build(entry), pipeline.Options(spacing=spacing)
    svg = inkex.load_svg(clipart.etree.tostring(built.tree)).getroot()
    chosen = [svg.getElementById(identity) for identity in built.ids]
    drawing = reading.read(svg, chosen, False, True).drawing
    net = weld.build(drawing, options.snap * drawing.diagonal, options.crossings)
    grabbed = binding.grab(net, drawing)
    samples = sampling.sample(net, spacing * float(drawing.size.max()), grabbed.curve, grabbed.fraction)
    anchors = binding.anchors(drawing, grabbed, samples)
    _, label = components(samples.edges, len(samples.points))
    held = np.zeros(label.max() + 1, dtype=bool)
    held[label[anchors.samples]] = True
    part = held[label]
    number = np.cumsum(part) - 1
    graph = samples.part(part)
    size = np.zeros(len(graph.edges))
    targets, untied = anchors.targets, Ties.none()
    return graph, core_problem(graph, number[anchors.samples], targets, untied, options.weights, size)
