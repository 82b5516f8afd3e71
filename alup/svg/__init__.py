# SPDX-License-Identifier: GPL-2.0-or-later
"""The notations of SVG: path data, basic shapes as path data, Inkscape's node types.

In: attribute texts as they stand in the file. Out: subpaths of cubic segments, control points (n, 4, 2) in
the element's own coordinates, and these written back as text at full precision. Text that cannot be read
raises DocumentError.
"""
