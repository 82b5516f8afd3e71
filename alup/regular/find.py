# SPDX-License-Identifier: GPL-2.0-or-later
"""What is regular in a drawing: circles, copies, rows and columns, rings, words, straight lines.

Relations that curves don't state but that people see, and keep when they redraw (the paper's Fig. 9).  All
are found in the input, between *items*:

* a circle, or more than half of one that is cut by other shapes; circles about one centre are one item.
  Ellipses along the axes count as circles: many wheels are;
* a subpath of which there are copies: shifted, mirrored or turned.  It has to stand alone: what is welded to
  other curves has its place from them;
* a word: small shapes side by side on one base line, with gaps smaller than they are high.

Items of one size form a *set*.  Within a set, centres on a horizontal or vertical line are *levels*, which
may be evenly spaced, and four or more centres evenly around a circle are a *ring*.

Tolerances are what an eye sees: a thousandth of the drawing for places, a hundredth for sizes.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..geometry.arrays import Array
from ..model import Drawing
from . import lines as straight
from . import shapes, symmetry

CIRCLES, COPIES, ROWS, WORDS, LINES, SYMMETRY = KINDS = (
    "circles", "copies", "rows", "words", "lines", symmetry.SYMMETRY
)  # fmt: skip

# Copies larger than this, of the diagonal, are the drawing itself, not things in it.
LARGEST = 0.4


@dataclass(frozen=True)
class Item:
    """samples : (n,) int, whatever is moved with it; weight : (n,)

    size : what sets compare, in user units; uniform : grows alike along both axes
    kind : CIRCLES, COPIES or WORDS; low, high : (2,) of its box
    """

    samples: Array
    size: float
    uniform: bool
    kind: str
    low: Array
    high: Array

    @property
    def centre(self) -> Array:
        return (self.low + self.high) / 2.0


@dataclass(frozen=True)
class Level:
    """Centres of items on one line: axis 0 for the same x, 1 for the same y."""

    axis: int
    items: Array


@dataclass(frozen=True)
class Spaced:
    """Items whose places along an axis are evenly spaced: item n of `items` is at `step[n]`."""

    axis: int
    items: Array
    step: Array


@dataclass(frozen=True)
class Ring:
    """Items evenly around a centre, (2,)."""

    items: Array
    centre: Array


@dataclass(frozen=True)
class Regular:
    """items; sets : of items of one size, numbers (k,); levels, spaced, rings : of their centres

    lines : straight lines, of copies too
    """

    items: list[Item] = field(default_factory=list)
    sets: list[Array] = field(default_factory=list)
    levels: list[Level] = field(default_factory=list)
    spaced: list[Spaced] = field(default_factory=list)
    rings: list[Ring] = field(default_factory=list)
    lines: straight.Lines = field(default_factory=straight.Lines)

    @property
    def figures(self) -> dict[str, int]:
        kinds = [item.kind for item in self.items]
        return {
            CIRCLES: kinds.count(CIRCLES),
            COPIES: sum(len(one) for one in self.sets),
            ROWS: len(self.levels) + len(self.rings),
            WORDS: kinds.count(WORDS),
            LINES: len(self.lines),
        }


@dataclass(frozen=True)
class Along:
    """The samples along the drawing's segments, sorted by segments.

    segment, sample : (m,) int; edges : (E, 2) int, of the samples; points : (N, 2) the samples, user units
    """

    segment: Array
    sample: Array
    edges: Array
    points: Array

    def alone(self, segments: Array) -> bool:
        """Whether no edge leads from some segments to others."""
        inside = np.zeros(int(self.edges.max(initial=0)) + 1, dtype=bool)
        inside[self.of(segments)] = True
        ends = inside[self.edges]
        return bool((ends[:, 0] == ends[:, 1]).all())

    def of(self, segments: Array) -> Array:
        """The samples of some segments, each once."""
        first = np.searchsorted(self.segment, segments, side="left")
        last = np.searchsorted(self.segment, segments, side="right")
        if not len(segments):
            return np.zeros(0, dtype=int)
        return np.unique(np.concatenate([self.sample[a:b] for a, b in zip(first, last)]))


def find(drawing: Drawing, along: Along, kinds: frozenset[str]) -> Regular:
    """What is regular in a drawing, as far as it is of the kinds."""
    search = _Search(drawing, along)
    if WORDS in kinds:
        search.words()
    if CIRCLES in kinds:
        search.circles()
    if COPIES in kinds:
        search.copies()
    items, sets = search.items, search.sets
    lines = search.lines() if LINES in kinds else straight.Lines()
    rows = _rows(items, sets, drawing.diagonal) if ROWS in kinds else ([], [], [])
    return Regular(items, sets, *rows, lines)


class _Search:
    """Collects items and sets.  A segment that belongs to a word or a circle belongs to nothing else."""

    def __init__(self, drawing: Drawing, along: Along):
        self.items: list[Item] = []
        self.sets: list[Array] = []
        self._drawing, self._along, self._diagonal = drawing, along, drawing.diagonal
        self._paths = shapes.subpaths(drawing)
        # Shapes that only clip others are not seen.
        self._free = ~np.isin(drawing.shape, drawing.clips)

    def words(self) -> None:
        paths = self._paths
        for word in shapes.words(paths, self._diagonal, self._free.copy()):
            segments = np.sort(np.concatenate([paths.segments[n] for n in word]))
            low, high = paths.low[word].min(axis=0), paths.high[word].max(axis=0)
            self._free[segments] = False
            self.items.append(Item(self._along.of(segments), float(high[1] - low[1]), True, WORDS, low, high))

    def circles(self) -> None:
        """Circles and ellipses; those of one size are sets."""
        drawing, paths, diagonal = self._drawing, self._paths, self._diagonal
        rounds = shapes.arcs(drawing, paths, diagonal, self._free)
        for one in rounds:
            self._free[one[0]] = False
        rounds += shapes.ellipses(drawing, paths, diagonal, self._free)
        for segments, centre, radii in shapes.about_one_centre(rounds, diagonal):
            self._free[segments] = False
            reach, size = radii.max(axis=0), float(radii.sum())
            samples = self._along.of(segments)
            self.items.append(Item(samples, size, True, CIRCLES, centre - reach, centre + reach))

    def copies(self) -> None:
        """Sets of copies, and of circles of one size."""
        paths = self._paths
        round_ = np.array([n for n, item in enumerate(self.items) if item.kind == CIRCLES], dtype=int)
        self.sets += _equal_sizes(self.items, round_)
        for found, uniform in shapes.copies(self._drawing, paths, self._diagonal, self._free):
            group = [
                n
                for n in found
                if np.hypot(*(paths.high[n] - paths.low[n])) <= LARGEST * self._diagonal
                and self._along.alone(np.sort(paths.segments[n]))
            ]
            if len(group) < 2:
                continue
            first = len(self.items)
            for n in group:
                low, high = paths.low[n], paths.high[n]
                samples = self._along.of(np.sort(paths.segments[n]))
                self.items.append(Item(samples, float(np.hypot(*(high - low))), uniform, COPIES, low, high))
            self.sets.append(np.arange(first, len(self.items)))

    def lines(self) -> straight.Lines:
        """Straight lines, those of copies too."""
        runs = straight.runs(self._drawing, self._free)
        samples = [self._along.of(np.sort(run)) for run in runs]
        return straight.find(self._along.points, runs, samples, self._diagonal)


def _rows(
    items: list[Item], sets: list[Array], diagonal: float
) -> tuple[list[Level], list[Spaced], list[Ring]]:
    """Rows, columns and rings of the items of each set."""
    levels, spaced, rings = [], [], []
    for members in sets:
        centres = np.array([items[n].centre for n in members])
        ring = _ring(centres, diagonal)
        if ring is not None:
            rings.append(Ring(members, ring))
            continue
        for axis in (0, 1):
            lines, steps = _levels(centres[:, axis], diagonal)
            levels += [Level(axis, members[line]) for line in lines if len(line) > 1]
            if steps is not None:
                spaced.append(Spaced(axis, members, steps))
    return levels, spaced, rings


def _equal_sizes(items: list[Item], which: Array) -> list[Array]:
    """Sets of two items or more of one size, as far as `shapes.EQUAL` says so."""
    size = np.array([items[n].size for n in which])
    return [np.sort(which[group]) for group in shapes.equal(size, shapes.EQUAL * size) if len(group) > 1]


def _levels(place: Array, diagonal: float) -> tuple[list[Array], Array | None]:
    """Items at one place along an axis, and, if three places or more are evenly spaced, each one's step."""
    order = np.argsort(place, kind="stable")
    far = np.diff(place[order]) > shapes.PLACE * diagonal
    level = np.empty(len(place), dtype=int)
    level[order] = np.concatenate([[0], np.cumsum(far)])
    lines = [np.flatnonzero(level == n) for n in range(level.max() + 1)]
    middle = np.array([place[line].mean() for line in lines])
    gaps = np.diff(middle)
    even = len(gaps) > 1 and np.ptp(gaps) <= max(shapes.EQUAL * gaps.mean(), shapes.PLACE * diagonal)
    return lines, (level.astype(float) if even else None)


def _ring(centre: Array, diagonal: float) -> Array | None:
    """The middle of centres (k, 2) that are evenly around it, if they are."""
    if len(centre) < 4:
        return None
    middle, radius = shapes.circle(centre)
    away = centre - middle
    if np.abs(np.hypot(*away.T) - radius).max() > shapes.PLACE * diagonal or radius > diagonal:
        return None
    angle = np.sort(np.arctan2(away[:, 1], away[:, 0]))
    gaps = np.diff(np.append(angle, angle[0] + 2.0 * np.pi))
    return (
        middle if np.ptp(gaps) <= max(shapes.EQUAL * gaps.mean(), shapes.PLACE * diagonal / radius) else None
    )
