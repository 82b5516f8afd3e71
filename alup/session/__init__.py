# SPDX-License-Identifier: GPL-2.0-or-later
"""A run: a drawing set up once, solved for any targets of its handles.

In: a `Drawing` and `Options`. `session` keeps what does not change while handles are dragged, `rounds` solves
the core and the final round (Sec. 3.2.1), `frames` shows a drag between two answers. Out: an `Answer`, moved
samples (N, 2) and refitted segments (S', 4, 2) in user units, with notes on what falls short.
"""
