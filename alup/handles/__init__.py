# SPDX-License-Identifier: GPL-2.0-or-later
"""Handles: points of curves where they may be placed, and the samples that they hold.

`candidates` proposes points on path data, in the element's own coordinates. `binding` maps the handles of a
`Drawing`, in root user units, to points of the network, and these to samples (H,) with targets (H, 2). A
handle that is too far from all curves, or contradicts another one, raises HandleError.
"""
