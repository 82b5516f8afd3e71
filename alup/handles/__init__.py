# SPDX-License-Identifier: GPL-2.0-or-later
"""Handles: where they may go, and which samples they hold.

`candidates` proposes points on path data, in the element's own coordinates. `binding` takes the handles of a
`Drawing`, in root user units, to points of the network, and these to samples (H,) with targets (H, 2). A
handle that is too far from all curves, or contradicts another one, raises HandleError.
"""
