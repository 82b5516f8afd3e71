# SPDX-License-Identifier: GPL-2.0-or-later
"""Lines that show what is regular: curves to be drawn over a drawing, as it is or as it was reshaped.

What was found is told by segments of the drawing.  So the lines follow from any two states of the curves, and
need no samples, handles or answers of a solver:

* a circle, an ellipse or most of one is its whole outline;
* items in a row or column are a line through their centres with a tick at each, a ring is the circle through
  its centres with its ticks;
* copies are their own outlines.  Those that no row or ring joins are joined from centre to centre, the
  nearest ones first;
* straight lines that belong together are drawn over themselves;
* a word is its base line, a mirrored drawing its axis.

What is no longer regular has no line, if so wanted.  Tolerances are twice what the rounds keep.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..geometry import bezier
from ..geometry.arrays import Array
from . import shapes, symmetry
from .find import CIRCLES, COPIES, LINES, ROWS, WORDS, Regular

# Of the extent of an item, of the size of a set's items, of the diagonal.
SHAPE, SIZE, PLACE = 0.01, 0.02, 2.0 * shapes.PLACE

# A line has left its set if it has turned by this more than the others, radians.
TURN = np.radians(0.3)

# Half the length of a tick: of the extent of its item, and of the diagonal at most.
TICK, LONGEST_TICK = 0.25, 0.008

# Where on a curve the points are that tell how it moved.
_AT = np.linspace(0.0, 1.0, 5)

# So many points tell whether a drawing still is symmetric.
FEW = 256

# An axis reaches beyond the drawing by this, of the diagonal.
BEYOND = 0.03

# Arms of the cubics of a circle, of the radius.
_ARM = 4.0 / 3.0 * (np.sqrt(2.0) - 1.0)


@dataclass(frozen=True)
class Outline:
    """kind : in `KINDS`; control : (k, 4, 2) cubics, user units; joins : only joins what is alike"""

    kind: str
    control: Array
    joins: bool = False


@dataclass(frozen=True)
class Seen:
    """regular : what was found

    segments : of the drawing, for each item; lines : for each line, none for those of items
    axes : of its reflections, see `symmetry.Mirror`
    """

    regular: Regular
    segments: list[Array]
    lines: list[Array]
    axes: list[int]

    @property
    def straight(self) -> int:
        """How many lines belong together and to no item."""
        together = self.regular.lines.together
        return sum(len(self.lines[n]) > 0 for n in np.unique(np.concatenate(together))) if together else 0


class Outlines:
    """The lines of what was seen in a drawing, for any state of its curves."""

    def __init__(self, seen: Seen, diagonal: float):
        self._seen, self._diagonal = seen, diagonal
        self._source: Array | None = None
        self._pieces: list[Array] = []
        self._of_lines: list[Array] = []
        regular = seen.regular
        centres = np.array([item.centre for item in regular.items]).reshape(-1, 2)
        joined = [one.items for one in regular.levels] + [one.items for one in regular.rings]
        self._bridges = [_bridges(centres, group, joined) for group in regular.sets]

    def drawn(self, was: Array, now: Array, source: Array, kept: bool) -> list[Outline]:
        """The lines for curves (P, 4, 2) as they were and as they are now, pieces of segments `source`, (P,).

        kept : of what is still regular alone; else of all that was, an axis excepted
        """
        if self._source is None or not np.array_equal(source, self._source):
            self._source = source
            self._pieces = [np.flatnonzero(np.isin(source, mine)) for mine in self._seen.segments]
            self._of_lines = [np.flatnonzero(np.isin(source, mine)) for mine in self._seen.lines]
        regular, diagonal = self._seen.regular, self._diagonal
        state = _State(regular, self._pieces, was, now, diagonal, kept)
        axes = _axes(self._seen.axes, now, diagonal)
        straight = _straight(regular.lines.together, self._of_lines, was, now, kept)
        alike, lines = state.copies(self._bridges), [*state.levels(), *state.rings()]
        return [*straight, *alike, *state.rounds(), *lines, *state.words(), *axes]


class _State:
    """Items where they are: scale and centre (I, 2) of their axis maps, good (I,) if they are to be shown."""

    def __init__(
        self, regular: Regular, pieces: list[Array], was: Array, now: Array, diagonal: float, kept: bool
    ):
        self._regular, self._pieces, self._now = regular, pieces, now
        self._diagonal, self._kept = diagonal, kept
        count = len(regular.items)
        self.scale, self.centre = np.ones((count, 2)), np.zeros((count, 2))
        size = np.array([len(one) for one in pieces], dtype=int)
        self.good = size > 0
        self.extent = np.array([item.high - item.low for item in regular.items]).reshape(-1, 2)
        if not self.good.any():
            return
        n, there = np.flatnonzero(self.good), np.concatenate(pieces)
        groups = _axis_maps(_points(was[there]), _points(now[there]), len(_AT) * size[n])
        self.scale[n], image, middle, away = groups
        rest = np.array([item.centre for item in regular.items])[n]
        self.centre[n] = image + self.scale[n] * (rest - middle)
        self.extent *= np.abs(self.scale)
        if kept:
            uniform = np.array([item.uniform for item in regular.items])
            self.good[n] = away <= SHAPE * np.linalg.norm(self.extent[n], axis=1)
            self.good &= ~uniform | (np.ptp(self.scale, axis=1) <= SIZE * self.scale.max(axis=1))

    def rounds(self) -> list[Outline]:
        """Of circles about one centre the largest."""
        return [
            Outline(CIRCLES, _ellipse(self.centre[n], self.extent[n] / 2.0)) for n in self._of_kind(CIRCLES)
        ]

    def copies(self, bridges: list[list[tuple[int, int]]]) -> list[Outline]:
        """Copies that still are of one size, and what joins all that are of one.  bridges : of each set"""
        result = []
        for group, pairs in zip(self._regular.sets, bridges):
            mine = group[self.good[group]]
            if self._kept and len(mine):
                scale = self.scale[mine]
                mine = mine[(np.abs(scale / np.median(scale, axis=0) - 1.0) <= SIZE).all(axis=1)]
            if len(mine) < 2:
                continue
            own = [n for n in mine.tolist() if self._regular.items[n].kind == COPIES]
            result += [Outline(COPIES, self._now[self._pieces[n]]) for n in own]
            there = set(mine.tolist())
            both = [pair for pair in pairs if there.issuperset(pair)]
            result += [Outline(COPIES, _polyline(self.centre[list(pair)]), joins=True) for pair in both]
        return result

    def levels(self) -> list[Outline]:
        """Lines through the centres of rows and columns."""
        result = []
        for level in self._regular.levels:
            mine = level.items[self.good[level.items]]
            place = self.centre[mine, level.axis]
            if self._kept and len(mine):
                mine = mine[np.abs(place - np.median(place)) <= PLACE * self._diagonal]
            if len(mine) < 2:
                continue
            centres = self.centre[mine[np.argsort(self.centre[mine, 1 - level.axis])]]
            across = np.eye(2)[level.axis]
            result.append(Outline(ROWS, np.concatenate([_polyline(centres), self._ticks(mine, across)])))
        return result

    def rings(self) -> list[Outline]:
        result = []
        for ring in self._regular.rings:
            mine = ring.items[self.good[ring.items]]
            while len(mine) > 2:
                middle, radius = shapes.circle(self.centre[mine])
                away = self.centre[mine] - middle
                off = np.abs(np.linalg.norm(away, axis=1) - radius)
                if not self._kept or off.max() <= PLACE * self._diagonal:
                    ticks = self._ticks(mine, away / np.linalg.norm(away, axis=1, keepdims=True))
                    around = _ellipse(middle, np.full(2, radius))
                    result.append(Outline(ROWS, np.concatenate([around, ticks])))
                    break
                mine = np.delete(mine, off.argmax())
        return result

    def words(self) -> list[Outline]:
        """Base lines."""
        half = self.extent / 2.0
        return [
            Outline(WORDS, _polyline(self.centre[n] + half[n] * np.array([[-1.0, 1.0], [1.0, 1.0]])))
            for n in self._of_kind(WORDS)
        ]

    def _of_kind(self, kind: str) -> list[int]:
        return [n for n, item in enumerate(self._regular.items) if item.kind == kind and self.good[n]]

    def _ticks(self, items: Array, across: Array) -> Array:
        """Short lines at centres, (k, 4, 2).  across : (2,) or (k, 2), their directions"""
        size = np.minimum(TICK * self.extent[items].min(axis=1), LONGEST_TICK * self._diagonal)
        half = size[:, None] * across
        return bezier.from_line(self.centre[items] - half, self.centre[items] + half)


def _straight(
    together: list[Array], pieces: list[Array], was: Array, now: Array, kept: bool
) -> list[Outline]:
    """Lines of sets, each once.  kept : only those that have turned as the others of their sets

    together : sets, numbers (k,) of lines; pieces : of each line
    """
    turn = np.full(len(pieces), np.nan)
    for n, mine in enumerate(pieces):
        if len(mine):
            before, after = (_chord(control[mine]) for control in (was, now))
            turn[n] = np.angle(after * np.conj(before))
    shown, left = np.zeros(len(pieces), dtype=bool), np.zeros(len(pieces), dtype=bool)
    for group in together:
        group = group[np.isfinite(turn[group])]
        if kept and len(group):
            off = np.abs(turn[group] - np.median(turn[group])) > TURN
            left[group] |= off
            group = group[~off]
        shown[group] |= len(group) > 1
    shown &= ~left
    return [Outline(LINES, now[pieces[n]]) for n in np.flatnonzero(shown)]


def _chord(control: Array) -> complex:
    """From the first end to the last one of consecutive cubics (k, 4, 2)."""
    x, y = control[-1, 3] - control[0, 0]
    return complex(x, y)


def _axes(axes: list[int], now: Array, diagonal: float) -> list[Outline]:
    """Lines that mirror the curves (P, 4, 2), as far as they still do."""
    if not axes:
        return []
    points = _points(now)
    low, high = points.min(axis=0), points.max(axis=0)
    tree, few = cKDTree(points), points[:: max(1, len(points) // FEW)]
    result = []
    for axis in axes:
        image = few.copy()
        image[:, axis] = low[axis] + high[axis] - few[:, axis]
        if tree.query(image)[0].max() > PLACE * diagonal:
            continue
        ends = np.array([low, high]) + BEYOND * diagonal * np.array([[-1.0], [1.0]])
        ends[:, axis] = (low[axis] + high[axis]) / 2.0
        result.append(Outline(symmetry.SYMMETRY, _polyline(ends)))
    return result


def _bridges(centres: Array, group: Array, joined: list[Array]) -> list[tuple[int, int]]:
    """Pairs of a group's items, the nearest ones first, that join what is not yet joined."""
    label = np.arange(len(centres))
    for items in joined:
        label[np.isin(label, label[items])] = label[items[0]]
    a, b = (group[k] for k in np.triu_indices(len(group), 1))
    result = []
    for n in np.argsort(np.linalg.norm(centres[a] - centres[b], axis=1), kind="stable").tolist():
        if label[a[n]] != label[b[n]]:
            label[label == label[b[n]]] = label[a[n]]
            result.append((int(a[n]), int(b[n])))
    return result


def _axis_maps(p: Array, v: Array, count: Array) -> tuple[Array, Array, Array, Array]:
    """Least squares of v = S p + t, S diagonal, for points (m, 2) in groups, the first ones first.

    count : of the points of each group, (I,)
    Returned are S (I, 2), the image of the mean of p and this mean, (I, 2), the greatest distance, (I,).
    """
    begin = np.append(0, np.cumsum(count)[:-1])
    middle, image = (np.add.reduceat(one, begin) / count[:, None] for one in (p, v))
    a, b = p - np.repeat(middle, count, axis=0), v - np.repeat(image, count, axis=0)
    square, product = np.add.reduceat(a * a, begin), np.add.reduceat(a * b, begin)
    flat = square <= 1e-12 * square.sum(axis=1, keepdims=True) + 1e-300
    scale = np.where(flat, 1.0, product / np.where(flat, 1.0, square))
    away = np.linalg.norm(b - np.repeat(scale, count, axis=0) * a, axis=1)
    return scale, image, middle, np.maximum.reduceat(away, begin)


def _points(control: Array) -> Array:
    """Points of cubics (k, 4, 2), some of each in a row."""
    return bezier.evaluate(control[:, None], _AT[None]).reshape(-1, 2)


def _polyline(points: Array) -> Array:
    """Cubics (k - 1, 4, 2) along points (k, 2)."""
    return bezier.from_line(points[:-1], points[1:])


def _ellipse(centre: Array, radii: Array) -> Array:
    """Four cubics (4, 4, 2)."""
    quarter = np.array([[1.0, 0.0], [1.0, _ARM], [_ARM, 1.0], [0.0, 1.0]])
    turns = [np.linalg.matrix_power(np.array([[0.0, -1.0], [1.0, 0.0]]), n) for n in range(4)]
    return np.asarray(centre + radii * np.stack([quarter @ turn.T for turn in turns]))
