# SPDX-License-Identifier: GPL-2.0-or-later
"""The originals of reshaped elements: storing them, putting them back, and starting later runs from them.

In: elements before and after a run. Out: attributes of our namespace (`stored_records`), originals put back
into the tree (`originals`, `put_back`), and the correspondence of points before and after a run
(`correspondence`).
"""
