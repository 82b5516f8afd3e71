# SPDX-License-Identifier: GPL-2.0-or-later
"""What follows the shapes: texts, images, clones, clips and masks, gradients and patterns, filters, markers.

In: how points of shapes moved (`motion`: old and new points (n, 2) with weights), and the elements that refer
to or lie on them. Out: changes of their attributes, collected in `Changes`.
"""
