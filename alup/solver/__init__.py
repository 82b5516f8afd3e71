# SPDX-License-Identifier: GPL-2.0-or-later
"""Minimisers of one round: `Problem` -> `Round`.

In: a `Problem`, positions (N, 2) to begin at in its units (L_avg = 1), and `Limits`. Out: the positions with
the least energy found, a status with its sentence, iterations, and every term's history. `alternation` is the
paper's (Eq. 14-21), `newton` a Newton method on the same F, `coarse_levels` its multigrid, `straight_runs`
its retraction to straight lines, `descent` its steps; `minimise` drives them. `paper_scheme` is the published
scheme, `outcome` what all of them take and return.
"""
