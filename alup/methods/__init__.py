# SPDX-License-Identifier: GPL-2.0-or-later
"""Alternative deformation methods on the same samples and handles, for comparison and for reposing.

In: a `Task`, samples (N, 2) in user units and the samples that have targets. Out: `Deformed`, positions (N,
2). `registry` lists the methods; a run imports only the module of the method that it uses.
"""
