# SPDX-License-Identifier: GPL-2.0-or-later
"""Handles as objects of the drawing: reading and settling them, their layer and arrows, guides.

In: elements whose label or attributes say that they are ours. Out: `HandleObject` records, points (2,) in
root user units.
"""
