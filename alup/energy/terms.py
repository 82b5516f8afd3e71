# SPDX-License-Identifier: GPL-2.0-or-later
"""The terms of the energy, one function each.

All take a `Problem` and positions v : (N, 2) in its units (L_avg = 1) and return a float.
What is minimised is

    E_ALUP = E_normal + E_tangent + w_s E_straight + w_c E_handle
    F      = E_ALUP + E_edge + E_ties + E_size

E_ALUP alone does not see an edge turned by 180 degrees, so its lower minima fold curves back.  F without
E_size is the energy of the paper's alternation at l_ij = |v_j - v_i|.  Solvers are compared by F.

docs/method.md lists all equations with their functions, and every departure from the paper.
"""

from __future__ import annotations

import numpy as np

from ..geometry.arrays import Array
from ..geometry.edges import edge_vectors
from .problem import Problem, straight_difference, tie_differences


def _lengths_and_directions(problem: Problem, v: Array) -> tuple:
    vector = edge_vectors(v, problem.edges)
    length = np.linalg.norm(vector, axis=1)
    return length, vector / np.maximum(length, 1e-300)[:, None]


def stretch_weight(length: Array, softness: float = 0.0) -> Array:
    """Eq. 6: omega_n = max(1, l^2), its kink rounded over a width of `softness`."""
    if softness == 0.0:
        return np.maximum(1.0, length**2)
    return stretch_weight_derivatives(length, softness)[0]


def stretch_weight_derivatives(length: Array, softness: float) -> tuple[Array, Array, Array]:
    """The rounded weight 1 + (t + sqrt(t^2 + s^2))/2, t = l^2 - 1, and its derivatives by l."""
    square = length**2
    t = square - 1.0
    root = np.sqrt(t**2 + softness**2)
    first, second = 0.5 * (1.0 + t / root), 0.5 * softness**2 / root**3
    return 1.0 + 0.5 * (t + root), 2.0 * length * first, 4.0 * square * second + 2.0 * first


def _omega(problem: Problem, length: Array, softness: float) -> Array:
    """omega_n, of lengths (E,); of an edge that stands for m of the sampling, m times that of l / m."""
    if not problem.weights.stretch:
        return problem.mass * np.ones_like(length)
    return problem.mass * stretch_weight(length / problem.mass, softness)


def normal(problem: Problem, v: Array, softness: float = 0.0) -> float:
    """Eq. 8: E_normal, turning of the edges against the input's normals, weighted by omega_n."""
    length, direction = _lengths_and_directions(problem, v)
    turned = np.einsum("ed,ed->e", problem.normals, direction)
    return problem.weights.normal * float(np.sum(_omega(problem, length, softness) * turned**2))


def tangent(problem: Problem, v: Array) -> float:
    """Eq. 9: E_tangent, change of the ratios between lengths of consecutive edges."""
    length, _ = _lengths_and_directions(problem, v)
    difference = length[problem.turn_ij] - problem.ratio * length[problem.turn_ik]
    return problem.weights.tangent * float(np.sum(problem.turn_weight * difference**2))


def straight(problem: Problem, v: Array) -> float:
    """Eq. 12: w_s E_straight, each pair of edges counted in both orders; the input's bend is kept."""
    difference = straight_difference(v, problem.straight) - problem.bend
    return problem.weights.straight * 2.0 * float(np.sum(difference**2))


def handle(problem: Problem, v: Array) -> float:
    """E_handle = w_c sum_h |v_h - p_h|^2, the last term of E_ALUP."""
    return problem.weights.handle * float(np.sum((v[problem.handles] - problem.targets) ** 2))


def edge(problem: Problem, v: Array, softness: float = 0.0) -> float:
    """E_edge, turning of the edges against the round's start: `alternation.edge_pull` at l_ij = |v_j -
    v_i|.
    """
    length, direction = _lengths_and_directions(problem, v)
    difference = np.sum((direction - problem.directions) ** 2, axis=1)
    return problem.weights.edge * float(np.sum(_omega(problem, length, softness) * difference))


def size(problem: Problem, v: Array) -> float:
    """E_size, sum w_size (l_ij - rest_ij)^2 / m_ij: change of lengths of parts that carry no handle."""
    length, _ = _lengths_and_directions(problem, v)
    return float(np.sum(problem.size * (length - problem.rest) ** 2 / problem.mass))


def ties(problem: Problem, v: Array) -> float:
    """Eq. 22: E_comp, generalised to the ties of `alup.ties.ties`; the scaffold's are some of them."""
    missed = tie_differences(problem, v)
    change = missed.real**2 + problem.tie_slide * missed.imag**2
    return float(np.sum(problem.tie_weight * change))


TERMS = {
    "normal": normal,
    "tangent": tangent,
    "straight": straight,
    "handle": handle,
    "edge": edge,
    "size": size,
    "ties": ties,
}


def terms(problem: Problem, v: Array) -> dict[str, float]:
    """Every term, and `alup` (E_ALUP) and `objective` (F) as their sums."""
    values = {name: term(problem, v) for name, term in TERMS.items()}
    alup = values["normal"] + values["tangent"] + values["straight"] + values["handle"]
    return {**values, "alup": alup, "objective": alup + values["edge"] + values["ties"] + values["size"]}


def alup(problem: Problem, v: Array, softness: float = 0.0) -> float:
    """Eq. 13: E_ALUP, the sum of the paper's terms."""
    return normal(problem, v, softness) + tangent(problem, v) + straight(problem, v) + handle(problem, v)


def objective(problem: Problem, v: Array, softness: float = 0.0) -> float:
    """F = E_ALUP + E_edge + E_ties + E_size."""
    return alup(problem, v, softness) + edge(problem, v, softness) + ties(problem, v) + size(problem, v)
