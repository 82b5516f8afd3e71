# SPDX-License-Identifier: GPL-2.0-or-later
"""The originals of what was reshaped: stored on the elements, put back, and where later runs start.

In: elements as they were before a run, and as it leaves them. Out: attributes of our namespace
(`stored_records`), originals put back into the tree (`originals`, `put_back`), and the same point before and
after a run (`correspondence`): segment and parameter.
"""
