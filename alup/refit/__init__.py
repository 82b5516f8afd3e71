# SPDX-License-Identifier: GPL-2.0-or-later
"""Moved samples -> cubic segments.

In: the `Drawing`, its `Network` and `Samples`, and moved positions (N, 2), all in user units. Each segment is
fitted to its own samples at its own parameters (`cubic_fit`), its control arms kept along tangents and within
bounds (`control_arms`). Out: `Refitted`, control points (S', 4, 2) with the segment each one comes from.
`frozen_fit` is the same fit with its structure settled, linear in the samples, for frames of a drag.
"""
