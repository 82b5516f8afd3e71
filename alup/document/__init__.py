# SPDX-License-Identifier: GPL-2.0-or-later
"""SVG <-> Drawing; the only part of the package that knows inkex.

In: an SVG document and the ids selected in it. `reading` reads every selected shape as path data, applies all
transforms, and returns a `Drawing` in root user units. `writing` does the opposite: each element whose points
moved gets path data in its own coordinates, and keeps everything else. What belongs to the shapes follows
them (`followers`). The changes of a run can be undone later (`history`). All changes are computed before the
first one is applied.
"""
