# SPDX-License-Identifier: GPL-2.0-or-later
"""Drawing -> welded curve network -> samples.

In: a `Drawing`, its S segments as control points (S, 4, 2) in root user units. Segments are cut where they
touch (`contacts`; `nodes`, `curve_intersections`, `overlaps`, `classification`, `splits`), equal pieces and
ends are welded (`weld`), curves are sampled at an even spacing (`sampling`), and things that only cross are
parted (`open_crossings`). Out: a `Network` of C curves and `Samples`: points (N, 2) in user units, edges (E,
2), turns.
"""
