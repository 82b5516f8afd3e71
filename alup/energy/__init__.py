# SPDX-License-Identifier: GPL-2.0-or-later
"""Samples, handles and weights -> the energy of one round: F(v) of positions v.

`problem` builds a `Problem` in units of the mean edge length (L_avg = 1). `terms` has one function for each
term (Eq. 8-13, 17, 22), (N, 2) positions -> float. `objective` evaluates the same sum with its gradient (2N,)
and its second derivatives, a sparse symmetric matrix (2N, 2N).
"""
