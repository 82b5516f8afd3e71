# SPDX-License-Identifier: GPL-2.0-or-later
"""SVG <-> Drawing; the only part of the package that knows inkex.

In: an SVG document and the ids selected in it. `reading` takes every selected shape as path data, applies all
transforms, and hands on a `Drawing` in root user units. `writing` goes back: each element whose points moved
gets path data in its own coordinates; nothing else of it changes. What belongs to the shapes follows them
(`followers`), what a run changes can be taken back (`history`). Nothing is applied before nothing can fail.
"""
