"""Sparse symmetric least squares of a fixed pattern: analyse once, factorise and solve often.

A quadratic energy  sum_r w_r |J_r x - b_r|^2  has the normal matrix  sum_r w_r J_r^T J_r.  Between
iterations only the weights w change, so the upper triangle's nonzeros are a constant sparse matrix
times the weights: one matrix-vector product assembles it.  The pattern comes from the structure,
never from values that happen to be zero, because qdldl's `update` does not check it.

qdldl (OSQP's sparse LDL^T) is used where it is installed, scipy's SuperLU otherwise.
"""

from __future__ import annotations

import importlib.util
from typing import Any

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix

from .errors import SolveError
from .model import Array

HAVE_QDLDL = importlib.util.find_spec("qdldl") is not None


class Assembly:
    """The upper triangle of a symmetric matrix as a linear function of weights.

    row, col : (M,) positions of contributions, row <= col; weight : (M,) int, the weight that each is
    multiplied by; factor : (M,).  size : rows of the matrix; weights : number of weights.
    """

    def __init__(self, row: Array, col: Array, weight: Array, factor: Array, size: int, weights: int):
        key = col.astype(np.int64) * size + row
        # The diagonal is always in the pattern: the factorisation needs it there.
        diagonal = np.arange(size, dtype=np.int64) * (size + 1)
        unique, place = np.unique(np.concatenate([key, diagonal]), return_inverse=True)
        self._indices = (unique % size).astype(np.int32)
        columns = unique // size
        self._indptr = np.searchsorted(columns, np.arange(size + 1)).astype(np.int32)
        self._size = size
        place = place.ravel()[: len(key)]
        self._map = csr_matrix((factor, (place, weight)), shape=(len(unique), weights))

    def matrix(self, weights: Array) -> csc_matrix:
        """The upper triangle for these weights; the pattern is the same for all."""
        data = self._map @ weights
        return csc_matrix((data, self._indices, self._indptr), shape=(self._size, self._size), copy=False)


class Factor:
    """A factorised symmetric positive definite matrix, given by its upper triangle.

    `update` takes a matrix of the same pattern; `solve` any number of right-hand sides.
    Raises SolveError when the matrix is singular.
    """

    def __init__(self, upper: csc_matrix, use_qdldl: bool = HAVE_QDLDL):
        self._use_qdldl = use_qdldl
        self._solver: Any = None
        self.update(upper)

    def update(self, upper: csc_matrix) -> None:
        if not upper.shape[0]:  # lone samples have positions, but no edges
            self._solver = _Nothing()
            return
        if not np.isfinite(upper.data).all():
            raise SolveError("the equations are not finite; a handle may be too far away")
        try:
            if not self._use_qdldl:
                from scipy.sparse.linalg import splu

                full = upper + upper.T
                full.setdiag(upper.diagonal())
                options = {"SymmetricMode": True}
                self._solver = splu(full.tocsc(), "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
            elif self._solver is None:
                import qdldl

                self._solver = qdldl.Solver(upper, upper=True)
            else:
                self._solver.update(upper, upper=True)
        except RuntimeError as error:  # both report a zero pivot this way
            raise SolveError(
                "the equations are singular: a part that no handle holds; add a handle to every part"
            ) from error

    def solve(self, right: Array) -> Array:
        """X of A x = right.  right : (n,) -> (n,)."""
        return np.asarray(self._solver.solve(np.ascontiguousarray(right, dtype=float)))


class _Nothing:
    """The solution of no equations."""

    def solve(self, right: Array) -> Array:
        return right


def edge_blocks(edges: Array, block: Array) -> tuple[Array, Array, Array, Array]:
    """Upper-triangle contributions of  (x_j - x_i)^T M (x_j - x_i)  with 2x2 blocks M, one an edge.

    edges : (E, 2) int; block : (E, 2, 2) symmetric.  Unknowns are interleaved, x_i at 2i and 2i + 1.
    Returns row, col, edge, factor, (10 E,) each.
    """
    i, j = edges.min(axis=1), edges.max(axis=1)
    number = np.arange(len(edges))
    rows, cols, factors = [], [], []
    for a, b in ((0, 0), (0, 1), (1, 1)):
        for end in (i, j):
            rows.append(2 * end + a)
            cols.append(2 * end + b)
            factors.append(block[:, a, b])
    for a in (0, 1):
        for b in (0, 1):
            rows.append(2 * i + a)
            cols.append(2 * j + b)
            factors.append(-block[:, a, b])
    return np.concatenate(rows), np.concatenate(cols), np.tile(number, 10), np.concatenate(factors)
