# SPDX-License-Identifier: GPL-2.0-or-later
"""Linear finite elements on triangles of the plane: areas, gradients, Jacobians, vertex means."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix

from ..geometry.arrays import Array

# The area of a triangle counts as at least this part of the mean area.  The gradients of a flatter triangle
# would outweigh those of all others together.
FLATTEST = 1e-3


def as_complex(points: Array) -> Array:
    """Points of the plane (n, 2) as numbers x + iy, (n,)."""
    return np.asarray(points[:, 0] + 1j * points[:, 1])


def signed_areas(vertices: Array, triangles: Array) -> Array:
    """Signed areas (F,), positive where counter-clockwise in x, y.  vertices (V, 2), triangles (F, 3) int."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    along, across = b - a, c - a
    return 0.5 * (along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0])


def hat_gradients(vertices: Array, triangles: Array) -> tuple[Array, Array]:
    """Gradients (F, 3, 2) of the three hat functions of each triangle, and areas (F,) > 0."""
    corners = vertices[triangles]
    opposite = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
    area = signed_areas(vertices, triangles)
    least = FLATTEST * np.abs(area).mean()
    area = np.where(area < 0.0, np.minimum(area, -least), np.maximum(area, least))
    turned = np.stack([-opposite[..., 1], opposite[..., 0]], axis=2)
    return turned / (2.0 * area)[:, None, None], np.abs(area)


def jacobians(gradients: Array, triangles: Array, values: Array) -> Array:
    """Jacobians dv_r / dx_c (F, 2, 2) of values v (V, 2) at the vertices.  gradients : (F, 3, 2)."""
    return np.einsum("fkr,fkc->frc", values[triangles], gradients)


def at_vertices(per_triangle: Array, area: Array, triangles: Array, count: int) -> Array:
    """Area-weighted means (count,) of values (F,) over the triangles around each vertex."""
    owner = triangles.ravel()
    weight = np.repeat(area, 3)
    carry = csr_matrix((weight, (owner, np.arange(len(owner)))), shape=(count, len(owner)))
    return np.asarray(carry @ np.repeat(per_triangle, 3)) / np.maximum(carry @ np.ones(len(owner)), 1e-300)
