# SPDX-License-Identifier: GPL-2.0-or-later
"""The XML tree of a document: reading the file, elements and their matrices, styles, references, changes.

In: bytes or lxml elements. Out: matrices (3, 3) of element to root user units, shapes as path data in the
element's own coordinates, properties as CSS computes them. Changes are collected (`pending_changes`) and can
be taken back (`undo_log`); `fingerprints` tells whether somebody has changed what a run wrote.
"""
