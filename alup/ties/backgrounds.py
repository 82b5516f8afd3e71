# SPDX-License-Identifier: GPL-2.0-or-later
"""Backgrounds: parts that cover the page or enclose all others."""

from __future__ import annotations

import numpy as np

from ..geometry.arrays import Array

# A part reaches the page's edge if it is nearer to it than this part of the page's diagonal.
AT_EDGE = 0.005


def enclosing_parts(points: Array, label: Array, count: int, page: Array | None) -> Array:
    """Which parts enclose all others or reach two opposite edges of the page, (C,) bool.

    page : (2, 2) or None
    """
    low, high = _bounds(points, label, count)
    stays = np.zeros(count, dtype=bool)
    if count > 1:
        large = int(np.argmax((high - low).prod(axis=1)))
        others = np.arange(count) != large
        stays[large] = (low[large] < low[others]).all() and (high[large] > high[others]).all()
    if page is not None:
        near = AT_EDGE * float(np.linalg.norm(page[1] - page[0]))
        stays |= ((low <= page[0] + near) & (high >= page[1] - near)).any(axis=1)
    return stays


def page_filling_parts(points: Array, label: Array, count: int, page: Array | None) -> Array:
    """Which parts reach all four corners of the page, (C,) bool.

    They are backgrounds whatever they are near to.
    """
    fills = np.full(count, page is not None)
    if page is not None:
        near = AT_EDGE * float(np.linalg.norm(page[1] - page[0]))
        for corner in ((0, 0), (0, 1), (1, 0), (1, 1)):
            at = np.linalg.norm(points - page[corner, (0, 1)], axis=1) <= near
            fills &= np.bincount(label, at, count) > 0
    return fills


def _bounds(points: Array, label: Array, count: int) -> tuple[Array, Array]:
    """The least and the greatest x, y of every part, (C, 2) each."""
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, label, points)
    np.maximum.at(high, label, points)
    return low, high
