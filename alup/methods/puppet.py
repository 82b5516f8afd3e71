# SPDX-License-Identifier: GPL-2.0-or-later
"""Puppet warp: one rigid motion per handle, blended by bounded biharmonic weights.

The weight w_h of a handle minimises the Laplacian energy  1/2 int (lap w_h)^2 dA  subject to 0 <= w_h <= 1.
It is 1 at its own handle and 0 at the others (Jacobson, Baran, Popovic, Sorkine, 2011).  libigl solves this
on a mesh of the plane.  The weights are then divided by their sum, and points move by linear blend skinning,

    x -> sum_h w_h(x) (R_h (x - r_h) + p_h).

Every handle therefore reaches its target p_h whatever its rotation R_h.  A drag does not determine the
rotations.  They minimise the as-rigid-as-possible energy

    min_R  sum_f A_f  dist(J_f, SO(2))^2,

with J_f the map's Jacobian in triangle f.  This is the choice of Jacobson et al. (2012), "Fast Automatic
Skinning Transformations", restricted to rigid motions.

Skinning Bezier curves themselves means fitting cubics to the skinned curve (Liu, Jacobson, Gingold,
2014).  Here the samples are skinned, and ALUP's own refit makes the cubics.
"""

from __future__ import annotations

import numpy as np

from ..geometry.arrays import Array
from . import lattice, libigl
from . import triangles as elements
from .task import Deformed, Task
from .triangles import as_complex

# Wished number of vertices of the mesh.  It is coarser than that of `killing`, because an active-set problem
# is solved for each handle.
VERTICES = 2500

# Iterations of the active set, chosen by looking at the cases.
ITERATIONS = 20


def deform(task: Task) -> Deformed:
    """Move the samples by the blended rigid motions of the handles.

    Raises DependencyError where libigl is not installed.
    """
    graph = task.graph
    mesh = lattice.cover(graph.points, graph.edges, task.scaffold, task.handles, VERTICES)
    handles, which = np.unique(mesh.handles, return_index=True)
    rest, targets = mesh.vertices[handles], task.targets[which]
    weights = biharmonic_weights(mesh.vertices, mesh.triangles, handles)
    angles = rotations(mesh, weights, rest, targets)
    moved = skinned(graph.points, mesh.carry @ weights, rest, targets, angles)
    figures = {"vertices": len(mesh.vertices), "rotations_degrees": np.degrees(angles).round(3).tolist()}
    return Deformed(moved, figures)


def biharmonic_weights(vertices: Array, triangles: Array, handles: Array) -> Array:
    """Weights (V, H) in [0, 1], 1 at their own handle, of sum 1.  handles : (H,) vertices, each once."""
    if len(handles) == 1:
        return np.ones((len(vertices), 1))
    weights = libigl.load().bbw(
        np.ascontiguousarray(vertices),
        np.ascontiguousarray(triangles, dtype=np.int64),
        np.ascontiguousarray(handles, dtype=np.int64),
        np.eye(len(handles)),
        max_iter=ITERATIONS,
    )
    weights = np.clip(weights, 0.0, 1.0)
    total = weights.sum(axis=1, keepdims=True)
    return np.asarray(weights / total)


def skinned(points: Array, weights: Array, rest: Array, targets: Array, angles: Array) -> Array:
    """Linear blend skinning.  points (N, 2), weights (N, H), rest, targets (H, 2), angles (H,) -> (N, 2)."""
    z, r, p = map(as_complex, (points, rest, targets))
    turn = np.exp(1j * angles)
    moved = (weights @ turn) * z + weights @ (p - turn * r)
    return np.stack([moved.real, moved.imag], axis=1)


def rotations(mesh: lattice.Lattice, weights: Array, rest: Array, targets: Array) -> Array:
    """The handles' rotations (H,), radians, of least as-rigid-as-possible energy.

    weights : (V, H); rest, targets : (H, 2).  L-BFGS starts from no rotation and from the rotation that fits
    all handles best; the better result is returned.
    """
    from scipy.optimize import minimize

    gradient, area = elements.hat_gradients(mesh.vertices, mesh.triangles)
    z, r, p = map(as_complex, (mesh.vertices, rest, targets))
    # The deformed vertices are  sum_h e^(i angle_h) basis_h + still.
    basis = weights * (z[:, None] - r[None, :])
    still = weights @ p
    # Wirtinger derivatives of a complex function in each triangle: d/dz turns and scales, d/dconj(z) shears.
    corner = gradient[..., 0] - 1j * gradient[..., 1]

    def wirtinger(values: Array) -> tuple[Array, Array]:
        at = values[mesh.triangles]
        if values.ndim == 1:
            return 0.5 * np.einsum("fk,fk->f", corner, at), 0.5 * np.einsum("fk,fk->f", corner.conj(), at)
        return 0.5 * np.einsum("fk,fkh->fh", corner, at), 0.5 * np.einsum("fk,fkh->fh", corner.conj(), at)

    (turn_h, shear_h), (turn_0, shear_0) = wirtinger(basis), wirtinger(still)
    total = float(area.sum())

    def energy(angles: Array) -> tuple[float, Array]:
        """dist(J, SO(2))^2 = 2 (|J_turn| - 1)^2 + 2 |J_shear|^2, and its gradient."""
        e = np.exp(1j * angles)
        turn, shear = turn_0 + turn_h @ e, shear_0 + shear_h @ e
        size = np.abs(turn)
        value = 2.0 * float(area @ ((size - 1.0) ** 2 + np.abs(shear) ** 2)) / total
        pull_turn = area * (size - 1.0) * turn.conj() / np.maximum(size, 1e-12)
        slope = 4.0 * ((pull_turn @ turn_h + (area * shear.conj()) @ shear_h) * 1j * e).real / total
        return value, slope

    middle, there = r.mean(), p.mean()
    overall = float(np.angle(np.vdot(r - middle, p - there))) if len(r) > 1 else 0.0
    starts = [np.zeros(len(r)), np.full(len(r), overall)]
    found = [minimize(energy, start, jac=True, method="L-BFGS-B") for start in starts]
    return np.asarray(min(found, key=lambda one: one.fun).x)
