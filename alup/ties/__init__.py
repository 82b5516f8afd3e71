# SPDX-License-Identifier: GPL-2.0-or-later
"""Ties: what holds curves together that no curve joins.

In: `Samples` and the samples that handles hold, in user units. `facing` finds which points of the curves face
each other, `scaffold` the edges of a triangulation between parts (Eq. 22). `tie_weights` makes ties of them,
`groups` says which parts they join and how firmly sizes are kept, `axis_maps` which maps handles ask for,
`backgrounds` which parts stay; `ties` puts all of it together. Out: `Ties`, T rows of four samples with
factors, offsets (T, 2) and weights (T,).
"""
