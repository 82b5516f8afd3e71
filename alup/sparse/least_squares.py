# SPDX-License-Identifier: GPL-2.0-or-later
"""Sparse symmetric least squares of a fixed pattern: analyse once, factorise and solve often.

A quadratic energy  sum_r w_r |J_r x - b_r|^2  has the normal matrix  sum_r w_r J_r^T J_r.  Between
iterations only the weights w change, so the upper triangle's nonzeros are a constant sparse matrix
times the weights: one matrix-vector product assembles it.  The pattern comes from the structure,
never from values that happen to be zero, because qdldl's `update` does not check it.

qdldl (OSQP's sparse LDL^T) is used where it is installed, scipy's SuperLU otherwise.
"""

from __future__ import annotations

import importlib.util
import time
from typing import Any, Sequence

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix

from ..geometry.arrays import Array
from ..messages.errors import SolveError
from ..messages.language import translate as _

HAVE_QDLDL = importlib.util.find_spec("qdldl") is not None


class BlockAssembly:
    """The upper triangle of a symmetric matrix as a linear function of weights, in 2x2 blocks of points.

    count : points; the unknowns x_p, y_p of point p are at 2p, 2p + 1.  weights : number of weights.

    All blocks are stored in full.  A minimum-degree ordering merges unknowns with the same neighbours, and so
    orders points instead of coordinates.  It cannot do so where blocks have structural zeros: on a net of
    straight lines that cross, factors had seven times the entries and took eighty times as long.

    Only the pairs of points are sorted.  The positions of the blocks' entries follow by arithmetic, which
    takes an eighth of the time of sorting entries.
    """

    def __init__(self, count: int, weights: int):
        self._count, self._weights = count, weights
        self._p: list[Array] = []
        self._q: list[Array] = []
        # Contributions to entries: the block's number, row and column in it, the weight's index, the factor.
        self._parts: list[tuple[Array, Array, Array, Array, Array]] = []
        self._given = 0

    def add(
        self,
        p: Array,
        q: Array,
        which: Sequence[Array],
        matrices: Sequence[Array],
        times: Array | float = 1.0,
    ) -> None:
        """Add blocks sum_k w[which_k] M_k at (p, q), and their transposes at (q, p).

        p, q : (n,) int, points; which : for each k (n,) int, indices of weights; matrices : for each k (2, 2)
        times : (n,) factor of each block, or one for all
        """
        block = self._given + np.arange(len(p))
        self._p.append(np.minimum(p, q))
        self._q.append(np.maximum(p, q))
        self._given += len(p)
        turned, alone = p > q, p == q
        for number, matrix in zip(which, matrices):
            for r in (0, 1):
                for c in (0, 1):
                    if matrix[r, c] == 0.0:
                        continue
                    # On the diagonal a block and its transpose coincide: r = c counts twice, r != c once.
                    factor = times * np.where(alone & (r == c), 2.0, 1.0) * matrix[r, c]
                    row = np.where(turned | (alone & (r > c)), c, r)
                    self._parts.append((block, row, np.where(row == r, c, r), number, factor))

    def add_edges(self, edges: Array, which: Sequence[Array], matrices: Sequence[Array]) -> None:
        """Add  D^T (sum_k w[which_k] M_k) D  for the differences D along edges (n, 2); M_k symmetric."""
        i, j = edges.T
        for point in (i, j):
            self.add(point, point, which, [0.5 * matrix for matrix in matrices])
        self.add(i, j, which, [-matrix for matrix in matrices])

    def add_diagonal(self, points: Array, weight: int) -> None:
        """Add one weight times the identity at each of the points.  points : (n,) int; weight : its index."""
        self.add(points, points, (np.full(len(points), weight),), (0.5 * np.eye(2),))

    def finish(self) -> BlockAssembly:
        """Fix the pattern; no block can be added afterwards.  Returns the assembly itself."""
        count = self._count
        key = np.concatenate(self._q) * count + np.concatenate(self._p)
        diagonal = np.arange(count) * (count + 1)
        unique, place = np.unique(np.concatenate([key, diagonal]), return_inverse=True)
        place = place.ravel()
        p, q = unique % count, unique // count
        # The number of blocks above the diagonal in each block column.  The diagonal block is the last one.
        per_column = np.bincount(q, minlength=count) - 1
        begin = np.cumsum(4 * per_column + 3) - (4 * per_column + 3)
        first = np.cumsum(per_column + 1) - (per_column + 1)
        rank = np.arange(len(unique)) - first[q]
        # Entry (r, c) of a block is stored at  begin + 2 rank + c (2 per_column + 1) + r.
        start, step = begin[q] + 2 * rank, 2 * per_column[q] + 1

        def at(block: Array, row: Array | int, col: Array | int) -> Array:
            return start[block] + col * step[block] + row

        above = p < q
        indices = np.empty(int((4 * per_column + 3).sum()), dtype=np.int32)
        for r, c in ((0, 0), (1, 0), (0, 1), (1, 1)):
            used = np.flatnonzero(above) if (r, c) == (1, 0) else np.arange(len(unique))
            indices[at(used, r, c)] = 2 * p[used] + r
        indptr = np.empty(2 * count + 1, dtype=np.int32)
        indptr[0:-1:2], indptr[1::2] = begin, begin + 2 * per_column + 1
        indptr[-1] = len(indices)
        block, row, col, weight, factor = (np.concatenate(part) for part in zip(*self._parts))
        to = at(place[block], row, col)
        self._map = csr_matrix((factor, (to, weight)), shape=(len(indices), self._weights))
        self._matrix = csc_matrix(
            (np.zeros(len(indices)), indices, indptr), shape=(2 * count, 2 * count), copy=False
        )
        self._parts = []
        return self

    @property
    def pattern(self) -> tuple[Array, Array]:
        """The upper triangle's indptr (2 count + 1,) and indices, as scipy's CSC format has them."""
        return self._matrix.indptr, self._matrix.indices

    def matrix(self, weights: Array) -> csc_matrix:
        """The upper triangle for weights (W,).  Every call returns the same object with new values."""
        self._matrix.data = self._map @ weights
        return self._matrix


def upper_half(matrix: Array) -> Array:
    """The upper triangular matrix whose sum with its transpose is a given symmetric 2x2 matrix."""
    return np.array([[0.5 * matrix[0, 0], matrix[0, 1]], [0.0, 0.5 * matrix[1, 1]]])


class Factor:
    """A factorised symmetric positive definite matrix, given by its upper triangle.

    `update` factorises a matrix of the same pattern; `solve` can be called any number of times.
    order : (n,) int, the order of elimination, see `alup.dissection`; None for the library's own order
    seconds : the duration of the last factorisation
    Raises SolveError when the matrix is singular or has entries that are not finite.
    """

    def __init__(self, upper: csc_matrix, use_qdldl: bool = HAVE_QDLDL, order: Array | None = None):
        self._ordered = _Ordered(upper, order) if order is not None else None
        self._use_qdldl = use_qdldl
        self._solver: Any = None
        self.seconds = 0.0
        self.update(upper)

    def update(self, upper: csc_matrix) -> None:
        begun = time.monotonic()
        if not upper.shape[0]:  # a drawing of lone samples has no unknowns
            self._solver = _Nothing()
            return
        if not np.isfinite(upper.data).all():
            raise SolveError(_("The equations are not finite. A handle may be too far away: move it nearer."))
        try:
            if self._ordered is not None:
                self._solver = self._ordered.factorised(upper)
            elif not self._use_qdldl:
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
        except RuntimeError as error:  # qdldl and SuperLU both report a zero pivot this way
            raise SolveError(
                _("The equations are singular: no handle holds a part of it. Add a handle to every part.")
            ) from error
        self.seconds = time.monotonic() - begun

    def solve(self, right: Array) -> Array:
        """The solution x of A x = right.  right : (n,) -> (n,)."""
        return np.asarray(self._solver.solve(np.ascontiguousarray(right, dtype=float)))


class _Ordered:
    """Factorises matrices of one pattern in a given order by SuperLU; qdldl accepts no order."""

    def __init__(self, upper: csc_matrix, order: Array):
        self.order = order
        rank = np.empty(len(order), dtype=np.int64)
        rank[order] = np.arange(len(order))
        column = rank[np.repeat(np.arange(len(order)), np.diff(upper.indptr))]
        row, entry = rank[upper.indices], np.arange(len(column))
        lower = np.flatnonzero(row != column)
        row, column = np.concatenate([row, column[lower]]), np.concatenate([column, row[lower]])
        entry = np.concatenate([entry, entry[lower]])
        key = column * len(order) + row
        by_key = np.argsort(key)
        self._entry, self._indices = entry[by_key], row[by_key].astype(np.int32)
        self._indptr = np.searchsorted(column[by_key], np.arange(len(order) + 1)).astype(np.int32)

    def factorised(self, upper: csc_matrix) -> _OrderedFactor:
        from scipy.sparse.linalg import splu

        shape = (len(self.order), len(self.order))
        full = csc_matrix((upper.data[self._entry], self._indices, self._indptr), shape=shape, copy=False)
        options = {"SymmetricMode": True}
        return _OrderedFactor(splu(full, "NATURAL", diag_pivot_thresh=0.0, options=options), self.order)


class _OrderedFactor:
    def __init__(self, factor: Any, order: Array):
        self._factor, self._order = factor, order

    def solve(self, right: Array) -> Array:
        result = np.empty_like(right)
        result[self._order] = self._factor.solve(right[self._order])
        return result


class _Nothing:
    """The factor of a matrix without rows: returns the empty right-hand side."""

    def solve(self, right: Array) -> Array:
        return right
