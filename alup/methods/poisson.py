# SPDX-License-Identifier: GPL-2.0-or-later
"""Poisson deformation of the curve network: gradients kept, handles as hard constraints, no rotations.

A curve x(s), with s the arc length of the input, is determined by its derivative up to a shift.  Of all
curves that meet the handles, the deformed curve y is the one whose derivative is nearest to that of the
input:

    min  int |y'(s) - x'(s)|^2 ds,    y(s_h) = p_h.

The displacement u = y - x minimises the Dirichlet energy of the network.  Its Euler-Lagrange equation is the
Poisson (here Laplace) equation u'' = 0 along the curves, with Kirchhoff's condition at junctions.  The
discretisation by samples is exact:

    min  sum_<ij> |u_j - u_i|^2 / l0_ij  +  w / |T| sum_T |u_j - u_i|^2 / l0_ij^2,

The second sum runs over the scaffold T between separate parts, with the unit of length and the weight of Eq.
22.

This is gradient-domain deformation as in Cohen-Or et al., "A Sampler of Useful Computational Tools"
(2015), on a network of curves as in Panozzo et al. (2013).  The usual next step estimates rotations and turns
the gradients by them.  It is left out: the paper compares with a baseline that limits rotation along the
curves, and no rotation is the strictest limit.  (The paper's appendix with the details was not available;
this is the one reading of its description without a parameter of its own.)  Tangents still turn, because this
energy does not distinguish stretching from shearing.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_matrix, triu

from ..energy.problem import Weights
from ..geometry.arrays import Array
from ..geometry.edges import edge_vectors
from ..sparse.least_squares import Factor
from .task import Deformed, Task

# Scaffold edges count as at least this long, in mean edge lengths.  The weight of edges between almost
# coincident points would otherwise spoil the condition of the matrix.
SHORTEST = 0.1


def deform(task: Task) -> Deformed:
    """Positions of least change of the curves' gradients, handles met exactly."""
    graph = task.graph
    joined, weight = _springs(task)
    count = len(graph.points)
    laplacian = _laplacian(joined, weight, count)
    free = np.ones(count, dtype=bool)
    free[task.handles] = False
    displacement = np.zeros((count, 2))
    displacement[task.handles] = task.targets - graph.points[task.handles]
    right = -(laplacian[free] @ displacement)
    factor = Factor(csc_matrix(triu(laplacian[free][:, free])))
    for axis in (0, 1):
        displacement[free, axis] = factor.solve(right[:, axis])
    moved = graph.points + displacement
    moved[task.handles] = task.targets
    return Deformed(moved)


def _springs(task: Task) -> tuple[Array, Array]:
    """Pairs of joined samples (E + T, 2) and their weights (E + T,); the unit of length is the mean edge."""
    points = task.graph.points
    length = np.linalg.norm(edge_vectors(points, task.graph.edges), axis=1)
    unit = float(length.mean()) if len(length) else 1.0
    along = unit / np.maximum(length, 1e-9 * unit)
    reach = np.linalg.norm(edge_vectors(points, task.scaffold), axis=1) / unit
    across = Weights().component / max(len(task.scaffold), 1) / np.maximum(reach, SHORTEST) ** 2
    return np.concatenate([task.graph.edges, task.scaffold]), np.concatenate([along, across])


def _laplacian(edges: Array, weight: Array, count: int) -> csc_matrix:
    """sum_e w_e |u_j - u_i|^2 as a matrix (count, count)."""
    i, j = edges.T
    row, col = np.concatenate([i, j, i, j]), np.concatenate([i, j, j, i])
    return csc_matrix((np.concatenate([weight, weight, -weight, -weight]), (row, col)), shape=(count, count))
