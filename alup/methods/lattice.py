# SPDX-License-Identifier: GPL-2.0-or-later
"""A mesh of the plane around and within the drawing, for methods that deform the plane.

A fine grid of cells marks everything that the curves touch or enclose, and the gaps across which separate
parts are joined.  A lattice of equilateral triangles covers the marked cells.  The handles are vertices of
the mesh; lattice points close to a handle are left out.  The mesh does not follow the curves.  Each sample is
carried by the triangle in which it lies, by barycentric coordinates.  A thousand overlapping outlines
therefore need no conforming mesh, and the triangles stay nearly equilateral, which these discretisations
favour.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.sparse import csr_matrix
from scipy.spatial import Delaunay

from ..geometry.arrays import Array
from .triangles import signed_areas

# Least and greatest spacing of the lattice, as parts of the longest side.  Chosen by looking at the cases.
FINEST, COARSEST = 1.0 / 400.0, 1.0 / 30.0

# Cells of the grid in one spacing of the lattice.  Chosen by looking at the cases.
CELLS = 2

# Lattice points nearer to a handle than this part of the spacing are left out: flat triangles would arise
# beside it.  Chosen by looking at the cases.
CLEARANCE = 0.6


@dataclass(frozen=True)
class Lattice:
    """vertices : (V, 2); triangles : (F, 3) int, counter-clockwise in x, y; spacing : user units

    handles : (H,) int vertices; carry : (N, V) sparse, barycentric coordinates of the samples
    """

    vertices: Array
    triangles: Array
    handles: Array
    carry: csr_matrix
    spacing: float


def cover(points: Array, edges: Array, scaffold: Array, handles: Array, vertices: int) -> Lattice:
    """Mesh what samples (N, 2) with edges (E, 2) and scaffold (T, 2) touch or enclose.

    points : user units; handles : (H,) int, samples
    vertices : the wished number of vertices, met roughly
    """
    low, high = points.min(axis=0), points.max(axis=0)
    longest = float((high - low).max())
    spacing = longest / 60.0
    for _ in range(3):
        mask = _Mask(points, edges, scaffold, spacing / CELLS)
        wanted = np.sqrt(mask.area / (0.5 * np.sqrt(3.0) * vertices))
        spacing = float(np.clip(wanted, FINEST * longest, COARSEST * longest))
    mask = _Mask(points, edges, scaffold, spacing / CELLS)
    return _mesh(points, handles, mask, spacing)


class _Mask:
    """The cells of a uniform grid that the drawing touches or encloses.  cell : their edge, user units."""

    def __init__(self, points: Array, edges: Array, scaffold: Array, cell: float):
        self.cell = cell
        margin = CELLS + 2
        self._low = points.min(axis=0) - margin * cell
        size = np.ceil((points.max(axis=0) - self._low) / cell).astype(int) + margin + 1
        self._inside = np.zeros(size, dtype=bool)
        self._mark(points, edges)
        pieces, number = ndimage.label(self._inside)
        if number > 1:
            ends = pieces[tuple(self._cells(points[scaffold]).transpose(2, 0, 1))]
            self._mark(points, scaffold[ends[:, 0] != ends[:, 1]])

    @property
    def area(self) -> float:
        return float(self._inside.sum()) * self.cell**2

    def holds(self, points: Array) -> Array:
        """Which of the points (n, 2) lie in a marked cell, (n,) bool."""
        cells = self._cells(points)
        within = ((cells >= 0) & (cells < self._inside.shape)).all(axis=1)
        result = np.zeros(len(points), dtype=bool)
        result[within] = self._inside[tuple(cells[within].T)]
        return result

    def _cells(self, points: Array) -> Array:
        return np.floor((points - self._low) / self.cell).astype(int)

    def _mark(self, points: Array, edges: Array) -> None:
        """Mark the cells that edges touch, those within one spacing of them, and those enclosed by these."""
        start, vector = points[edges[:, 0]], points[edges[:, 1]] - points[edges[:, 0]]
        steps = np.ceil(2.0 * np.linalg.norm(vector, axis=1) / self.cell).astype(int) + 1
        owner = np.repeat(np.arange(len(edges)), steps + 1)
        place = np.arange(len(owner)) - np.repeat(np.cumsum(steps + 1) - steps - 1, steps + 1)
        along = start[owner] + (place / steps[owner])[:, None] * vector[owner]
        touched = np.zeros_like(self._inside)
        touched[tuple(self._cells(np.concatenate([along, points])).T)] = True
        wide = ndimage.binary_dilation(touched, np.ones((3, 3), dtype=bool), iterations=CELLS)
        self._inside = ndimage.binary_fill_holes(self._inside | wide)


def _mesh(points: Array, handles: Array, mask: _Mask, spacing: float) -> Lattice:
    low, high = points.min(axis=0) - 2.0 * spacing, points.max(axis=0) + 2.0 * spacing
    rise = 0.5 * np.sqrt(3.0) * spacing
    rows, columns = np.ceil((high - low) / (rise, spacing)[::-1]).astype(int)[::-1] + 1
    row, column = np.indices((rows, columns + 1)).reshape(2, -1)
    grid = low + np.stack([(column - 0.5 * (row % 2)) * spacing, row * rise], axis=1)
    unique, vertex = _apart(points[handles], 1e-6 * spacing)
    away = np.ones(len(grid), dtype=bool)
    for at in unique:
        away &= np.hypot(*(grid - at).T) > CLEARANCE * spacing
    vertices = np.concatenate([unique, grid[away]])
    plane = Delaunay(vertices)
    holder = plane.find_simplex(points)
    kept = mask.holds(vertices[plane.simplices].mean(axis=1))
    kept[holder] = True
    used = np.zeros(len(vertices), dtype=bool)
    used[plane.simplices[kept]] = True
    number = np.cumsum(used) - 1
    transform = plane.transform[holder]
    first = np.einsum("nij,nj->ni", transform[:, :2], points - transform[:, 2])
    weights = np.concatenate([first, 1.0 - first.sum(axis=1, keepdims=True)], axis=1)
    corners = number[plane.simplices[holder]]
    carry = csr_matrix(
        (weights.ravel(), corners.ravel(), 3 * np.arange(len(points) + 1)), shape=(len(points), used.sum())
    )
    return Lattice(
        vertices[used], _turned(vertices, plane.simplices[kept], number), number[vertex], carry, spacing
    )


def _turned(vertices: Array, triangles: Array, number: Array) -> Array:
    """Triangles renumbered by `number`, all counter-clockwise."""
    clockwise = signed_areas(vertices, triangles) < 0.0
    return number[np.where(clockwise[:, None], triangles[:, ::-1], triangles)]


def _apart(points: Array, distance: float) -> tuple[Array, Array]:
    """Points without duplicates, rounded to a distance, and the index (n,) of each point among them."""
    _, first, which = np.unique(np.round(points / distance), axis=0, return_index=True, return_inverse=True)
    return points[first], which.ravel()
