# SPDX-License-Identifier: GPL-2.0-or-later
"""As-rigid-as-possible deformation of a mesh of the plane (Sorkine, Alexa 2007; Igarashi et al. 2005).

    min  sum_f A_f |J_f - R_f|^2,   R_f the rotation nearest to J_f,

The minimiser alternates between rotations and positions; libigl implements it for triangles of the plane.
The vertices of handles are fixed.  Bending and posing tools minimise this energy, and it suits edits that
turn a part.
"""

from __future__ import annotations

import numpy as np

from . import lattice, libigl
from .task import Deformed, Task

# 1,000 iterations show no visible difference.
ITERATIONS = 200

# Wished number of vertices of the mesh, chosen by looking at the cases.
VERTICES = 1500


def deform(task: Task) -> Deformed:
    """Move the samples with a mesh whose triangles stay as rigid as possible.

    Raises DependencyError where libigl is not installed.
    """
    igl = libigl.load()
    graph = task.graph
    mesh = lattice.cover(graph.points, graph.edges, task.scaffold, task.handles, VERTICES)
    handles, which = np.unique(mesh.handles, return_index=True)
    targets = np.ascontiguousarray(task.targets[which])
    data = igl.ARAPData()
    data.energy = igl.ARAP_ENERGY_TYPE_ELEMENTS
    data.max_iter = ITERATIONS
    vertices, triangles = (
        np.ascontiguousarray(mesh.vertices),
        np.ascontiguousarray(mesh.triangles, dtype=np.int64),
    )
    igl.arap_precomputation(vertices, triangles, 2, np.ascontiguousarray(handles, dtype=np.int64), data)
    moved = igl.arap_solve(targets, data, vertices)
    return Deformed(mesh.carry @ np.asarray(moved), {"vertices": len(vertices), "iterations": ITERATIONS})
