# SPDX-License-Identifier: GPL-2.0-or-later
"""Plane geometry independent of drawings: arrays of cubic Bezier curves, boxes, crossing edges, components.

In and out: arrays. Control points (..., 4, 2), points (..., 2), parameters in [0, 1], pairs and labels of
int; lengths have the unit of the points.
"""
