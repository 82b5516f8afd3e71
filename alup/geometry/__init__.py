# SPDX-License-Identifier: GPL-2.0-or-later
"""Plane geometry that knows no drawing: cubic Bezier curves in bulk, boxes, crossing edges, components.

In and out: arrays. Control points (..., 4, 2), points (..., 2), parameters in [0, 1], pairs and labels of
int; lengths are in whatever unit the points are.
"""
