# SPDX-License-Identifier: GPL-2.0-or-later
"""Other ways to deform the same samples by the same handles, to compare with and to repose by.

In: a `Task`, samples (N, 2) in user units and the samples that have targets. Out: `Deformed`, positions (N,
2). `registry` lists the methods; a module is imported by the run that uses it.
"""
