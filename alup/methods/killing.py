# SPDX-License-Identifier: GPL-2.0-or-later
"""As-Killing-as-possible vector fields (Solomon, Ben-Chen, Butscher, Guibas, 2011).

A vector field whose flow is a rigid motion is a Killing field; its Jacobian J is antisymmetric.  The
field that meets the handles' velocities and is nearest to Killing minimises

    int |J + J^T|^2 dA,

a linear system on a mesh of the plane.  Points do not move straight along the field.  Near each vertex z0 the
field is approximated by the linear holomorphic field v + a (z - z0).  The complex number a is the part of J
that turns and scales.  The trajectories of this field are logarithmic spirals; in unit time

    z0  ->  z0 + v (e^a - 1) / a.

One step of any size therefore reproduces a rigid rotation exactly.  Every other motion changes the field
along the way.  The field is therefore solved anew after each of many small steps, on the mesh as deformed so
far.  The distance by which a step misses the handles is added to the next step.  Further steps at the end
bring the handles to their targets.

The handles' path is the rigid motion that fits all of them best.  The remaining displacement is a straight
line in the moving frame of that motion.  A handle prescribes the mean of the field over a disc around it, not
the value at a point: a field of bounded Killing energy may have a spike at a point, and under refinement of
the mesh it would have one.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import bmat, coo_matrix, csc_matrix, csr_matrix, diags, triu

from ..geometry.arrays import Array
from ..sparse.least_squares import Factor
from . import lattice
from . import triangles as elements
from .task import Deformed, Task
from .triangles import as_complex

# Wished number of vertices of the mesh.  Finer meshes change no figure of a comparison by more than a few
# percent.
VERTICES = 3000

# Steps along the handles' path.  The gallery shows results with fewer steps.
STEPS = 32

# The final steps stop when every handle is within MET of its target, in diagonals, or after LAST_STEPS.
MET, LAST_STEPS = 1e-6, 40

# A handle prescribes the mean over the vertices within this many lattice spacings.  Chosen by looking at the
# cases; the disc has to hold several vertices.
HELD = 2.0

# Added to the diagonal of the stiffness, whose entries are of order 1 in the plane.  It fixes the motions
# that no handle determines, and with the opposite sign it makes the system quasi-definite, as its
# factorisation requires.
RESTING = 1e-9


def deform(task: Task, steps: int = STEPS, home: bool = True) -> Deformed:
    """Flow along fields that are as Killing as possible.

    steps : number of steps along the handles' path, at least 1
    home : whether further steps bring the handles to their targets
    """
    graph = task.graph
    mesh = lattice.cover(graph.points, graph.edges, task.scaffold, task.handles, VERTICES)
    near = _near(mesh)
    diagonal = float(np.hypot(*(graph.points.max(axis=0) - graph.points.min(axis=0))))
    path = Path(as_complex(graph.points[task.handles]), as_complex(task.targets))
    v = mesh.vertices
    taken = 0
    for step in range(steps + (LAST_STEPS if home else 0)):
        wanted = path.at(min(step / steps, 1.0)) - as_complex(v[mesh.handles])
        if step < steps:
            wanted += path.velocity(step / steps) / steps
        elif np.abs(wanted).max() <= MET * diagonal:
            break
        held = holding(v, mesh.handles, near)
        v = advance(v, mesh.triangles, field(v, mesh.triangles, held, wanted))
        taken += 1
    missed = float(np.abs(path.at(1.0) - as_complex(v[mesh.handles])).max()) / diagonal
    area = elements.signed_areas(v, mesh.triangles)
    figures = {
        "vertices": len(v),
        "steps": taken,
        "missed_of_diagonal": missed,
        "turned_over": int((area <= 0.0).sum()),
    }
    return Deformed(mesh.carry @ v, figures)


class Path:
    """The handles' positions at times in [0, 1]: a rigid motion and, in its frame, a straight line.

    rest, targets : (H,) complex, user units
    """

    def __init__(self, rest: Array, targets: Array):
        middle, there = rest.mean(), targets.mean()
        self._angle = float(np.angle(np.vdot(rest - middle, targets - there)))
        if abs(self._angle) >= 1e-9:
            turn = np.exp(1j * self._angle)
            # The rigid motion's fixed point:  there = c + turn (middle - c).
            self._centre = (there - turn * middle) / (1.0 - turn)
            self._rest = rest - self._centre
            self._left = (targets - self._centre) / turn - self._rest
        else:
            self._angle = self._centre = 0.0
            self._rest, self._left = rest, targets - rest

    def at(self, time: float) -> Array:
        """Positions, (H,) complex."""
        return self._centre + np.exp(1j * self._angle * time) * (self._rest + time * self._left)

    def velocity(self, time: float) -> Array:
        """The derivative of the positions by time, (H,) complex."""
        turn = np.exp(1j * self._angle * time)
        return turn * (1j * self._angle * (self._rest + time * self._left) + self._left)


def killing_energy(vertices: Array, triangles: Array) -> csc_matrix:
    """The integral of |J + J^T|^2 as a quadratic form on vector fields.

    vertices : (V, 2); triangles : (F, 3) int -> (2 V, 2 V), the components x_i, y_i at 2 i and 2 i + 1
    """
    gradient, area = elements.hat_gradients(vertices, triangles)
    gx, gy = gradient[..., 0], gradient[..., 1]
    zero = np.zeros_like(gx)
    # |J + J^T|^2 = (2 u_x)^2 + (2 v_y)^2 + 2 (u_y + v_x)^2
    rows = np.stack(
        [
            np.stack([2.0 * gx, zero], axis=2).reshape(-1, 6),
            np.stack([zero, 2.0 * gy], axis=2).reshape(-1, 6),
            np.sqrt(2.0) * np.stack([gy, gx], axis=2).reshape(-1, 6),
        ],
        axis=1,
    )
    local = np.einsum("f,frs,frt->fst", area, rows, rows)
    unknown = (2 * triangles[:, :, None] + np.arange(2)).reshape(-1, 6)
    row, col = np.repeat(unknown, 6, axis=1), np.tile(unknown, 6)
    size = 2 * len(vertices)
    return csc_matrix((local.ravel(), (row.ravel(), col.ravel())), shape=(size, size))


def field(vertices: Array, triangles: Array, held: csr_matrix, wanted: Array) -> Array:
    """The field (V, 2) of least Killing energy whose means `held` (H, V) equal `wanted` (H,), complex."""
    energy = killing_energy(vertices, triangles)
    count = len(wanted)
    means = coo_matrix(held)
    row = np.concatenate([2 * means.row, 2 * means.row + 1])
    col = np.concatenate([2 * means.col, 2 * means.col + 1])
    conditions = csc_matrix((np.tile(means.data, 2), (row, col)), shape=(2 * count, energy.shape[0]))
    system = bmat(
        [
            [energy + RESTING * diags(np.ones(energy.shape[0])), conditions.T],
            [conditions, -RESTING * diags(np.ones(2 * count))],
        ]
    )
    right = np.concatenate([np.zeros(energy.shape[0]), np.stack([wanted.real, wanted.imag], axis=1).ravel()])
    return Factor(csc_matrix(triu(system))).solve(right)[: energy.shape[0]].reshape(-1, 2)


def advance(vertices: Array, triangles: Array, velocity: Array) -> Array:
    """The vertices (V, 2) after one unit of time along the spirals of a field (V, 2)."""
    gradient, area = elements.hat_gradients(vertices, triangles)
    jacobian = elements.jacobians(gradient, triangles, velocity)
    holomorphic = 0.5 * (jacobian[:, 0, 0] + jacobian[:, 1, 1] + 1j * (jacobian[:, 1, 0] - jacobian[:, 0, 1]))
    a = elements.at_vertices(holomorphic, area, triangles, len(vertices))
    z = as_complex(vertices) + as_complex(velocity) * _spiral(a)
    return np.stack([z.real, z.imag], axis=1)


def _spiral(a: Array) -> Array:
    """(e^a - 1) / a, 1 at 0."""
    small = np.abs(a) < 1e-5
    safe = np.where(small, 1.0, a)
    return np.where(small, 1.0 + 0.5 * a, np.expm1(safe) / safe)


def _near(mesh: lattice.Lattice) -> list[Array]:
    """The vertices within HELD spacings of each handle, as indices."""
    from scipy.spatial import cKDTree

    near = cKDTree(mesh.vertices).query_ball_point(mesh.vertices[mesh.handles], HELD * mesh.spacing)
    return [np.asarray(one, dtype=int) for one in near]


def holding(vertices: Array, handles: Array, near: list[Array]) -> csr_matrix:
    """Weighted means over the vertices around each handle, (H, V).

    The weights sum to 1 and their centre of mass is the handle, so the mean of a linear field is its value at
    the handle.  Of all such weights they have the least sum of squares.
    handles : (H,) int vertices; near : indices of the vertices around each handle
    """
    weights = []
    for handle, around in zip(handles, near):
        offset = vertices[around] - vertices[handle]
        middle = offset.mean(axis=0)
        spread = offset - middle
        weights.append(1.0 / len(around) - spread @ (np.linalg.pinv(spread.T @ spread) @ middle))
    row = np.repeat(np.arange(len(near)), [len(one) for one in near])
    shape = (len(near), len(vertices))
    return csr_matrix((np.concatenate(weights), (row, np.concatenate(near))), shape=shape)
