# SPDX-License-Identifier: GPL-2.0-or-later
"""As-Killing-as-possible vector fields (Solomon, Ben-Chen, Butscher, Guibas, 2011).

A vector field whose flow is a rigid motion is a Killing field; its Jacobian J is antisymmetric.  The
field that meets the handles' velocities and is nearest to Killing minimises

    int |J + J^T|^2 dA,

a linear system on a mesh of the plane.  Points do not go straight along the field: near each vertex it is
approximated by the linear holomorphic field v + a (z - z0), a complex, the part of J that turns and
scales, whose trajectories are logarithmic spirals; in unit time

    z0  ->  z0 + v (e^a - 1) / a.

A rigid rotation is so met exactly by a single step of any size.  Every other motion changes the field
while it goes on, so it is solved for anew after each of many small steps, on the mesh as it is then; what
the handles' own spirals miss is added to the next step, and some last steps bring them home.

The handles travel along the path of the rigid motion that fits all of them best, and along what that
leaves, in its moving frame, straight.  A handle holds the mean over a disc around it, not a point: a
field of bounded Killing energy may have a spike at a point, and on finer and finer meshes would.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import bmat, coo_matrix, csc_matrix, csr_matrix, diags, triu

from ..least_squares import Factor
from ..model import Array
from . import lattice
from . import triangles as elements
from .task import Deformed, Task
from .triangles import as_complex

# Finer ones change no figure of a comparison by more than a few percent.
VERTICES = 3000

# Steps of the way; the gallery has what fewer do.
STEPS = 32

# Handles are brought home to this part of the diagonal, in at most so many further steps.
MET, LAST_STEPS = 1e-6, 40

# A handle holds the mean over the vertices within this many spacings of it.
HELD = 2.0

# Of the stiffness, whose entries are of order 1 in the plane: holds motions that no handle tells.
RESTING = 1e-9


def deform(task: Task, steps: int = STEPS, home: bool = True) -> Deformed:
    """Flow along fields that are as Killing as possible.

    steps : of the way; home : whether further steps bring the handles to their targets
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
    """Where handles are at a time between 0 and 1: a rigid motion and, in its frame, a straight line.

    rest, targets : (H,) complex
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
        """Their derivative by time."""
        turn = np.exp(1j * self._angle * time)
        return turn * (1j * self._angle * (self._rest + time * self._left) + self._left)


def killing_energy(vertices: Array, triangles: Array) -> csc_matrix:
    """The integral of |J + J^T|^2 as a matrix on fields, unknowns x_i, y_i at 2i, 2i + 1."""
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
    """The field (V, 2) nearest to Killing whose means `held` (H, V) are `wanted` (H,), complex."""
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
    """Vertices (V, 2) a unit of time along the spirals of a field (V, 2)."""
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
    """The vertices around each handle."""
    from scipy.spatial import cKDTree

    near = cKDTree(mesh.vertices).query_ball_point(mesh.vertices[mesh.handles], HELD * mesh.spacing)
    return [np.asarray(one, dtype=int) for one in near]


def holding(vertices: Array, handles: Array, near: list[Array]) -> csr_matrix:
    """Weighted means over the vertices around each handle, (H, V).

    Of all weights with sum 1 whose centre of mass is the handle they are the most even, so a linear field
    has at the handle what the mean says.
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
