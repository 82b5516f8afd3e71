# SPDX-License-Identifier: GPL-2.0-or-later
"""As-rigid-as-possible deformation of a mesh of the plane (Sorkine, Alexa 2007; Igarashi et al. 2005).

    min  sum_f A_f |J_f - R_f|^2,   R_f the rotation nearest to J_f,

by alternating between rotations and positions, as libigl has it for elements of the plane.  Handles hold
their vertices.  It is what bending and posing tools do, and what an edit that turns a part wants.
"""

from __future__ import annotations

import numpy as np

from . import lattice, libigl
from .task import Deformed, Task

# From the first guess onward 1,000 iterations change nothing that is visible.
ITERATIONS = 200

VERTICES = 1500


def deform(task: Task) -> Deformed:
    """Keep triangles rigid."""
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
