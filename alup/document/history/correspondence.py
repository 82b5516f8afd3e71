# SPDX-License-Identifier: GPL-2.0-or-later
"""Correspondence of points before and after a run: present curves, and the curves that they came from.

The refit keeps the parameter of each segment, so a segment and a parameter identify the same point before and
after.  If a segment was divided (`Record.cuts`), each part has a range of the old parameter.  The ranges
follow from the control arms at the cut.  Both parts have the same speed there with respect to the old
parameter, so the ratio of the arms' lengths is the ratio of the ranges.  The error is about 0.005; that of
the ratio of the parts' lengths would be 0.1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry import bezier
from ...messages.errors import DocumentError
from ...model import Array
from ...svg import path_data
from ..followers.motion import Points
from ..tree.drawn_elements import walk
from ..tree.elements import Element, Shape, read_shape
from ..tree.styles import Styles
from .originals import Store


@dataclass(frozen=True)
class PointPair:
    """A point of the curves.

    now, was : (2,) root user units
    distance : from the point that was searched for
    """

    now: Array
    was: Array
    distance: float


class Correspondence:
    """Present and former curves.  now, was : (n, 4, 2); equal parameters are corresponding points"""

    def __init__(self, pairs: list[tuple[Array, Array]]):
        none = np.zeros((0, 4, 2))
        self.now = np.concatenate([none, *(now for now, _ in pairs)])
        self.was = np.concatenate([none, *(was for _, was in pairs)])
        self._nearest: bezier.Nearest | None = None

    def locate(self, point: Array) -> PointPair:
        """The nearest point of the present curves, with its former position."""
        if self._nearest is None:
            self._nearest = bezier.Nearest(self.now)
        curve, t, found, distance = self._nearest.find(point)
        if curve < 0:
            return PointPair(point, point, distance)
        return PointPair(found, bezier.evaluate(self.was[curve], np.array(t)), distance)

    def points(self) -> Points:
        """Points along the curves; old : their present positions, new : their former ones."""
        t = np.linspace(0.0, 1.0, 9)
        now, was = (bezier.evaluate(c[:, None], t[None]).reshape(-1, 2) for c in (self.now, self.was))
        return Points(now, was, np.repeat(bezier.polygon_lengths(self.was), len(t)))


def pair(now: Shape, was: Shape, cuts: dict[int, list[float]]) -> tuple[Array, Array]:
    """A shape's present segments and the parts that they came from, (n, 4, 2) each, root user units."""
    found: list[tuple[Array, Array]] = []
    first = 0
    for new, old in zip(now.subpaths, was.subpaths):
        rows = _ranges(old, cuts, first)
        first += max(len(old.control), 1)
        count = len(new.control)
        if not rows or not count:
            continue
        if old.closed and count == len(rows) + 1:  # rounding has made the line of z longer than zero
            rows.append((rows[-1][0], 1.0, 1.0))
        elif count != len(rows):  # rounding has made a closing line or an arc a point
            rows = [rows[n * len(rows) // count] for n in range(count)]
        source, low, high = (np.array(column) for column in zip(*rows))
        found.append((new.control, bezier.subrange(old.control[source.astype(int)], low, high)))
    if not found:
        return np.zeros((0, 4, 2)), np.zeros((0, 4, 2))
    new_all, old_all = (np.concatenate(part) for part in zip(*found))
    return tuple(
        control @ shape.matrix[:, :2].T + shape.matrix[:, 2]
        for control, shape in ((new_all, now), (old_all, was))
    )


def _ranges(
    old: path_data.Subpath, cuts: dict[int, list[float]], first: int
) -> list[tuple[int, float, float]]:
    """For each part of a subpath, in order, the segment and the range of its parameter."""
    rows = []
    for n in range(len(old.control)):
        stops = [0.0, *cuts.get(first + n, []), 1.0]
        rows += [(n, low, high) for low, high in zip(stops, stops[1:])]
    return rows


def cuts_of(control: Array, source: Array) -> dict[int, list[float]]:
    """The parameters at which segments were divided, from the speeds of their parts at the cuts.

    control : (m, 4, 2) the parts; source : (m,) int, the segment of each, ascending
    """
    count = np.bincount(source)
    found: dict[int, list[float]] = {}
    for n in np.flatnonzero(count > 1).tolist():
        parts = control[source == n]
        leaving, arriving = (np.linalg.norm(parts[:, k + 1] - parts[:, k], axis=1) for k in (0, 2))
        # The range of a part is the ratio of its speeds with respect to its own and to the segment's
        # parameter.
        usable = (leaving[1:] > 0.0) & (arriving[:-1] > 0.0)
        lengths = np.maximum(bezier.polygon_lengths(parts), 1e-300)
        ratio = np.where(usable, leaving[1:], lengths[1:]) / np.where(usable, arriving[:-1], lengths[:-1])
        width = np.cumprod(np.append(1.0, ratio))
        found[n] = (np.cumsum(width)[:-1] / width.sum()).tolist()
    return found


def parts_before(control: Array, source: Array, old: Array) -> Array:
    """The parts (m, 4, 2) of the segments `old` (s, 4, 2) that the parts `control` (m, 4, 2) came from."""
    low, high = np.zeros(len(source)), np.ones(len(source))
    for n, stops in cuts_of(control, source).items():
        first = int(np.searchsorted(source, n))
        low[first + 1 : first + 1 + len(stops)] = high[first : first + len(stops)] = stops
    whole = (low == 0.0) & (high == 1.0)
    before = old[source]
    before[~whole] = bezier.subrange(before[~whole], low[~whole], high[~whole])
    return before


def original_points(svg: Element, points: Array) -> Array:
    """Points on the present curves -> the corresponding points of the stored originals.

    svg : the root element; points : (n, 2) root user units -> (n, 2) root user units.
    A point moves with its nearest curve, and keeps its offset from it.  It is returned unchanged if the
    nearest curve belongs to an object without a stored original (nothing was reshaped yet, or it did not
    move), or to one that was edited since.  A handle that is now placed at `point` has to get `alup:rest` =
    original_points(svg, [point])[0] and `alup:at` = point.
    """
    points = np.array(points, dtype=float).reshape(-1, 2)
    store = Store(svg)
    if not store.records:
        return points
    correspondence = Correspondence(drawn_pairs(store, walk(svg, [svg], True, Styles(svg)).drawn))
    found = [correspondence.locate(point) for point in points]
    moved = [place.was - place.now if np.isfinite(place.distance) else np.zeros(2) for place in found]
    return points + np.array(moved).reshape(-1, 2)


def drawn_pairs(store: Store, drawn: list[tuple[Element, Array]]) -> list[tuple[Array, Array]]:
    """The present and former curves of elements with matrices; unreadable elements are left out."""
    pairs = []
    for element, matrix in drawn:
        try:
            now = read_shape(element, matrix)
        except DocumentError:
            continue  # a run reports it, if the element is to be reshaped
        if not now.subpaths:
            continue
        record = store.records.get(element)
        if record is None or not store.is_settled(element, matrix):
            pairs.append((now.control, now.control))
        else:
            pairs.append(pair(now, store.base_shape(element, matrix), record.cuts))
    return pairs
