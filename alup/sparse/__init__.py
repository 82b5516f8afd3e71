# SPDX-License-Identifier: GPL-2.0-or-later
"""Sparse linear algebra of the rounds: symmetric positive definite systems of a fixed pattern.

In: weights w of least squares terms, and the pattern of their normal matrix, in 2x2 blocks of N points.
`least_squares` assembles the upper triangle and factorises it as L D L^T; `dissection` gives an order of
elimination for points of the plane and an estimate of the work.  Out: solutions x (2 N,), in the units of the
right-hand side.
"""
