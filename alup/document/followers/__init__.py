# SPDX-License-Identifier: GPL-2.0-or-later
"""Followers of the shapes: texts, images, clones, clips, masks, gradients, patterns, filters, markers.

In: motions of shapes (`motion`: old and new points (n, 2) with weights), and the elements that refer to the
shapes or lie on them. Out: changes of their attributes, collected in `Changes`.
"""
