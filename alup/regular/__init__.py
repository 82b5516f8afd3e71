# SPDX-License-Identifier: GPL-2.0-or-later
"""What is regular in a drawing, and how it stays regular.

In go the drawing, the samples (N, 2) along each of its segments and, later, where both rounds moved them, all
in user units.  Out come the relations that were found, and places for the samples of what is no longer
regular.  One more round holds them there.
"""
