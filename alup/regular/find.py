"""What is regular in a drawing: circles, copies, rows and columns, rings, words.

Relations that curves don't state but that people see, and keep when they redraw (the paper's Fig. 9).  All are
found in the input, between *items*:

* a circle, or more than half of one that is cut by other shapes; circles about one centre are one item.
  Ellipses along the axes count as circles: many wheels are;
* a subpath of which there are copies: shifted, mirrored or turned.  It has to stand alone: what is welded to
  other curves has its place from them;
* a word: small shapes side by side on one base line, with gaps smaller than they are high.

Items of one size form a *set*.  Within a set, centres on a horizontal or vertical line are *levels*, which may
be evenly spaced, and four or more centres evenly around a circle are a *ring*.

Tolerances are what an eye sees: a thousandth of the drawing for places, a hundredth for sizes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Tuple

import numpy as np

from ..geometry import bezier
from ..geometry.arrays import Array
from ..geometry.connected_components import components
from ..model import Drawing

CIRCLES, COPIES, ROWS, WORDS, SYMMETRY = KINDS = ("circles", "copies", "rows", "words", "symmetry")

# Centres and edges nearer than this, of the diagonal, are at one place.
PLACE = 1e-3

# Noise of coordinates, of the diagonal; it may spoil small shapes by no more than ROUGH of their size.
NOISE, ROUGH = 2e-4, 0.05

# An arc drawn by cubics is this near to its circle, of the radius.
ROUND = 5e-3

# An arc is kept round from this angle on, radians: less is the end of a stroke or a corner, whose sides decide.
LEAST_ARC = 4.0

# A subpath is a copy of another one if it differs by no more than this, of its size.
COPY = 5e-3

# What is this many times as long as wide may be stretched along.
SLENDER = 3.0

# Copies larger than this, of the diagonal, are the drawing itself, not things in it.
LARGEST = 0.4

# Items smaller than this, of the diagonal, have no shape that an eye could compare.
SMALLEST = 2e-3

# Sizes and gaps that differ by no more than this part are equal.
EQUAL = 0.02

# Of words: letters at least, and the greatest gap and the least height of one, of the highest.
LETTERS, GAP, LOW = 3, 0.7, 0.4


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
    """items; sets : of items of one size, numbers (k,); levels, spaced, rings : of their centres."""

    items: list[Item] = field(default_factory=list)
    sets: list[Array] = field(default_factory=list)
    levels: list[Level] = field(default_factory=list)
    spaced: list[Spaced] = field(default_factory=list)
    rings: list[Ring] = field(default_factory=list)

    @property
    def figures(self) -> dict[str, int]:
        kinds = [item.kind for item in self.items]
        return {
            CIRCLES: kinds.count(CIRCLES),
            COPIES: sum(len(one) for one in self.sets),
            ROWS: len(self.levels) + len(self.rings),
            WORDS: kinds.count(WORDS),
        }


@dataclass(frozen=True)
class Along:
    """The samples along the drawing's segments, sorted by segments: segment, sample (m,) int; edges (E, 2)."""

    segment: Array
    sample: Array
    edges: Array

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


@dataclass(frozen=True)
class _Paths:
    """The subpaths of a drawing: segments (k,) of each in order; low, high : (P, 2) boxes."""

    segments: list[Array]
    low: Array
    high: Array
    closed: Array


def find(drawing: Drawing, along: Along, kinds: frozenset[str]) -> Regular:
    """What is regular in a drawing, as far as it is of the kinds."""
    paths = _subpaths(drawing)
    diagonal = drawing.diagonal
    items: list[Item] = []
    taken = np.zeros(len(drawing.control), dtype=bool)
    shown = np.ones(len(drawing.control), dtype=bool)
    for clip in drawing.clips:
        shown &= drawing.shape != clip
    if WORDS in kinds:
        for word in _words(drawing, paths, diagonal, shown):
            segments = np.sort(np.concatenate([paths.segments[n] for n in word]))
            low, high = paths.low[word].min(axis=0), paths.high[word].max(axis=0)
            taken[segments] = True
            items.append(Item(along.of(segments), float(high[1] - low[1]), True, WORDS, low, high))
    if CIRCLES in kinds:
        rounds = _round(drawing, paths, diagonal, shown & ~taken)
        for one in rounds:
            taken[one[0]] = True
        rounds += _ellipses(drawing, paths, diagonal, shown & ~taken)
        for segments, centre, radii in _about_one_centre(rounds, diagonal):
            taken[segments] = True
            reach = radii.max(axis=0)
            size = float(radii.sum())
            items.append(Item(along.of(segments), size, True, CIRCLES, centre - reach, centre + reach))
    sets: list[Array] = []
    if COPIES in kinds:
        round_ = np.array([n for n, item in enumerate(items) if item.kind == CIRCLES], dtype=int)
        sets += _equal_sizes(items, round_)
        for found, uniform in _copies(drawing, paths, diagonal, shown & ~taken):
            group = [
                n for n in found
                if np.hypot(*(paths.high[n] - paths.low[n])) <= LARGEST * diagonal
                and along.alone(np.sort(paths.segments[n]))
            ]  # fmt: skip
            if len(group) < 2:
                continue
            first = len(items)
            for n in group:
                extent = paths.high[n] - paths.low[n]
                items.append(
                    Item(
                        along.of(np.sort(paths.segments[n])), float(np.hypot(*extent)), uniform, COPIES,
                        paths.low[n], paths.high[n],
                    )
                )  # fmt: skip
            sets.append(np.arange(first, len(items)))
    levels: list[Level] = []
    spaced: list[Spaced] = []
    rings: list[Ring] = []
    if ROWS in kinds:
        for group in sets:
            centres = np.array([items[n].centre for n in group])
            ring = _ring(centres, diagonal)
            if ring is not None:
                rings.append(Ring(group, ring))
                continue
            for axis in (0, 1):
                lines, steps = _levels(centres[:, axis], diagonal)
                levels += [Level(axis, group[line]) for line in lines if len(line) > 1]
                if steps is not None:
                    spaced.append(Spaced(axis, group, steps))
    return Regular(items, sets, levels, spaced, rings)


def _subpaths(drawing: Drawing) -> _Paths:
    """The subpaths that are more than a point, segments in their order."""
    count = len(drawing.control)
    joined = np.flatnonzero(drawing.following >= 0)
    _, label = components(np.stack([joined, drawing.following[joined]], axis=1), count)
    order = np.argsort(label, kind="stable")
    bounds = np.flatnonzero(np.diff(label[order])) + 1
    groups = np.split(order, bounds) if count else []
    points = bezier.evaluate(drawing.control[:, None], np.linspace(0.0, 1.0, 9)[None, :])
    low, high = points.min(axis=1), points.max(axis=1)
    segments, lows, highs, closed = [], [], [], []
    for group in groups:
        a, b = low[group].min(axis=0), high[group].max(axis=0)
        if not (b - a).max() > SMALLEST * drawing.diagonal:
            continue
        segments.append(group)
        lows.append(a)
        highs.append(b)
        closed.append(bool((drawing.following[group] >= 0).all()))
    return _Paths(
        segments, np.array(lows).reshape(-1, 2), np.array(highs).reshape(-1, 2), np.array(closed, dtype=bool)
    )


# Segments, centre (2,), radii (2,).
_Round = Tuple[Array, Array, Array]


def _round(drawing: Drawing, paths: _Paths, diagonal: float, free: Array) -> list[_Round]:
    """Circles, and arcs that are more than half of one."""
    control = drawing.control
    points = bezier.evaluate(control[:, None], np.linspace(0.0, 1.0, 5)[None, :])
    a, m, b = points[:, 0], points[:, 2], points[:, 4]
    p, q = m - a, b - a
    cross = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
    usable = free & ~drawing.line & (np.abs(cross) > 1e-12 * diagonal**2)
    safe = np.where(usable, cross, 1.0)
    pp, qq = (p**2).sum(axis=1), (q**2).sum(axis=1)
    offset = np.stack([q[:, 1] * pp - p[:, 1] * qq, p[:, 0] * qq - q[:, 0] * pp], axis=1) / (2.0 * safe[:, None])
    centre, radius = a + offset, np.linalg.norm(offset, axis=1)
    tolerance = np.maximum(ROUND * radius, np.minimum(NOISE * diagonal, ROUGH * radius))
    off = np.abs(np.linalg.norm(points - centre[:, None], axis=2) - radius[:, None]).max(axis=1)
    usable &= (off <= tolerance) & (radius <= diagonal) & (radius >= SMALLEST * diagonal)
    relative = points - centre[:, None]
    turn = np.arctan2(
        relative[:, :-1, 0] * relative[:, 1:, 1] - relative[:, :-1, 1] * relative[:, 1:, 0],
        (relative[:, :-1] * relative[:, 1:]).sum(axis=2),
    ).sum(axis=1)
    runs: list[_Round] = []
    for segments in paths.segments:
        good = segments[usable[segments]]
        while len(good):
            first = good[0]
            near = np.linalg.norm(centre[good] - centre[first], axis=1) <= 4.0 * tolerance[first]
            near &= np.abs(radius[good] - radius[first]) <= 4.0 * tolerance[first]
            run, good = good[near], good[~near]
            if abs(turn[run].sum()) >= LEAST_ARC:
                middle, long = _circle(points[run].reshape(-1, 2))
                runs.append((run, middle, np.full(2, long)))
    return runs


def _ellipses(drawing: Drawing, paths: _Paths, diagonal: float, free: Array) -> list[_Round]:
    """Closed subpaths that are ellipses along the axes, not circles: as `_round`."""
    result = []
    for n in np.flatnonzero(paths.closed).tolist():
        segments = np.sort(paths.segments[n])
        radii = (paths.high[n] - paths.low[n]) / 2.0
        if len(segments) < 2 or not free[segments].all() or drawing.line[segments].any() or not radii.min() > 0:
            continue
        centre = paths.low[n] + radii
        points = bezier.evaluate(drawing.control[segments][:, None], np.linspace(0.0, 0.9, 6)[None, :])
        away = np.linalg.norm((points.reshape(-1, 2) - centre) / radii, axis=1) - 1.0
        if np.abs(away).max() <= max(2.0 * ROUND, min(NOISE * diagonal / radii.min(), ROUGH)):
            result.append((segments, centre, radii))
    return result


def _circle(points: Array) -> tuple[Array, float]:
    """Centre and radius of the least squares circle of points (n, 2)."""
    mean = points.mean(axis=0)
    p = points - mean
    matrix = np.column_stack([2.0 * p, np.ones(len(p))])
    x, y, c = np.linalg.lstsq(matrix, (p**2).sum(axis=1), rcond=None)[0]
    return mean + (x, y), float(np.sqrt(max(c + x * x + y * y, 0.0)))


def _about_one_centre(rounds: list[_Round], diagonal: float) -> list[_Round]:
    """Circles and ellipses brought together where they have one centre: their radii are (k, 2)."""
    if not rounds:
        return []
    centre, radii = np.array([one[1] for one in rounds]), np.array([one[2] for one in rounds])
    smaller = radii.min(axis=1)
    apart = np.linalg.norm(centre[:, None] - centre[None, :], axis=2)
    allowed = np.minimum(PLACE * diagonal, ROUGH * np.minimum(smaller[:, None], smaller[None, :]))
    number, label = components(np.argwhere(np.triu(apart <= allowed, 1)), len(rounds))
    result = []
    for n in range(number):
        mine = np.flatnonzero(label == n)
        segments = np.sort(np.concatenate([rounds[k][0] for k in mine]))
        result.append((segments, centre[mine].mean(axis=0), radii[mine]))
    return result


def _equal_sizes(items: list[Item], which: Array) -> list[Array]:
    """Sets of items whose sizes differ by no more than a part of EQUAL."""
    size = np.array([items[n].size for n in which])
    order = np.argsort(size, kind="stable")
    sets = []
    begin = 0
    for end in range(1, len(order) + 1):
        if end == len(order) or size[order[end]] > (1.0 + EQUAL) * size[order[begin]]:
            if end - begin > 1:
                sets.append(np.sort(which[order[begin:end]]))
            begin = end
    return sets


def _copies(drawing: Drawing, paths: _Paths, diagonal: float, free: Array) -> list[tuple[list[int], bool]]:
    """Sets of subpaths that are copies of each other, and whether they can only grow alike along both axes.

    So do closed ones without a straight side that are not slender, and copies that are turned.
    """
    by_form: dict[bytes, list[int]] = {}
    for n, segments in enumerate(paths.segments):
        # A single line or curve says too little: any line is a copy of any other one.
        if free[segments].all() and (len(segments) > 2 or (paths.closed[n] and len(segments) > 1)):
            form = np.sort(drawing.line[segments]).tobytes() + bytes([bool(paths.closed[n])])
            by_form.setdefault(form, []).append(n)
    result = []
    for alike in by_form.values():
        if len(alike) < 2:
            continue
        shapes = np.stack([drawing.control[paths.segments[n]][:, :3].reshape(-1, 2) for n in alike])
        z = shapes[..., 0] + 1j * shapes[..., 1]
        z = z - z.mean(axis=1, keepdims=True)
        size = np.abs(z).max(axis=1)
        left = list(range(len(alike)))
        while len(left) > 1:
            first, rest = left[0], np.array(left[1:])
            tolerance = np.maximum(COPY * size[rest], np.minimum(NOISE * diagonal, ROUGH * size[rest]))
            best, turned = np.full(len(rest), np.inf), np.zeros(len(rest), dtype=bool)
            for shape in (z[first], z[first].conj()):
                factor = (z[rest] @ shape.conj()) / (np.abs(shape) ** 2).sum()
                away = np.abs(z[rest] - factor[:, None] * shape).max(axis=1)
                # A shift or a mirror image has a factor on one of the axes.
                oblique = np.minimum(np.abs(factor.real), np.abs(factor.imag)) > 0.01 * np.abs(factor)
                turned = np.where(away < best, oblique, turned)
                same = np.abs(np.abs(factor) - 1.0) <= EQUAL
                best = np.minimum(best, np.where(same, away, np.inf))
            found = best <= tolerance
            if found.any():
                extent = paths.high[alike[first]] - paths.low[alike[first]]
                curved = not drawing.line[paths.segments[alike[first]]].any() and paths.closed[alike[first]]
                curved &= extent.max() < SLENDER * extent.min()
                group = [alike[first], *(alike[n] for n in rest[found])]
                result.append((group, bool(curved) or bool(turned[found].any())))
            left = rest[~found].tolist()
    return result


def _levels(place: Array, diagonal: float) -> tuple[list[Array], Array | None]:
    """Items at one place along an axis, and, if three places or more are evenly spaced, each one's step."""
    order = np.argsort(place, kind="stable")
    far = np.diff(place[order]) > PLACE * diagonal
    level = np.empty(len(place), dtype=int)
    level[order] = np.concatenate([[0], np.cumsum(far)])
    lines = [np.flatnonzero(level == n) for n in range(level.max() + 1)]
    middle = np.array([place[line].mean() for line in lines])
    gaps = np.diff(middle)
    even = len(gaps) > 1 and np.ptp(gaps) <= max(EQUAL * gaps.mean(), PLACE * diagonal)
    return lines, (level.astype(float) if even else None)


def _ring(centre: Array, diagonal: float) -> Array | None:
    """The middle of centres (k, 2) that are evenly around it, if they are."""
    if len(centre) < 4:
        return None
    middle, radius = _circle(centre)
    away = centre - middle
    if np.abs(np.hypot(*away.T) - radius).max() > max(PLACE * diagonal, 0.0) or radius > diagonal:
        return None
    angle = np.sort(np.arctan2(away[:, 1], away[:, 0]))
    gaps = np.diff(np.append(angle, angle[0] + 2.0 * np.pi))
    return middle if np.ptp(gaps) <= max(EQUAL * gaps.mean(), PLACE * diagonal / radius) else None


def _words(drawing: Drawing, paths: _Paths, diagonal: float, free: Array) -> list[list[int]]:
    """Runs of subpaths that stand side by side on one base line, as letters do."""
    low, high = paths.low, paths.high
    count = len(low)
    able = np.array([free[segments].all() for segments in paths.segments], dtype=bool)
    able &= paths.closed & ((high - low).max(axis=1) < 0.25 * diagonal) if count else able
    letters = np.flatnonzero(able)
    if len(letters) < LETTERS:
        return []
    # Counters, dots and accents belong to the letter whose width they share, and lie within or just above.
    letters = letters[np.argsort(low[letters, 0], kind="stable")]
    words = []
    used = np.zeros(count, dtype=bool)
    bottom = np.round(high[letters, 1] / (2.0 * PLACE * diagonal))
    for line in np.unique(bottom):
        base = letters[np.abs(bottom - line) <= 1]
        base = base[~used[base]]
        run: list[int] = []
        for n in [*base.tolist(), -1]:
            if run and n >= 0 and _goes_on(low, high, run, n):
                run.append(n)
                continue
            if _is_word(low, high, run):
                inside = _belonging(low, high, run, letters)
                used[inside] = True
                words.append(inside)
            run = [n]
    return words


def _goes_on(low: Array, high: Array, run: list[int], n: int) -> bool:
    """Whether a letter stands beside the last one of a run, on its base line."""
    last = run[-1]
    height = max(high[k, 1] - low[k, 1] for k in (run[0], last, n))
    smaller = min(high[n, 1] - low[n, 1], high[last, 1] - low[last, 1])
    gap = low[n, 0] - high[last, 0]
    wide = max(high[n, 0] - low[n, 0], high[last, 0] - low[last, 0])
    # The next letter begins beyond the middle of the last one: what lies within it is a part of it.
    return bool(
        -0.2 * height <= gap <= GAP * height and smaller >= LOW * height and wide <= 2.0 * height
        and abs(high[n, 1] - high[run[0], 1]) <= max(0.06 * height, 1e-12)
    )  # fmt: skip


def _is_word(low: Array, high: Array, run: list[int]) -> bool:
    """Whether a run has letters enough, not all of one width: else it is a row."""
    if len(run) < LETTERS:
        return False
    width = np.array([high[n, 0] - low[n, 0] for n in run])
    return bool(np.ptp(width) > 0.1 * width.mean())


def _belonging(low: Array, high: Array, run: list[int], letters: Array) -> list[int]:
    """A run with all that lies within its box, or just above it as dots and accents do."""
    box_low, box_high = low[run].min(axis=0), high[run].max(axis=0)
    height = box_high[1] - box_low[1]
    inside = (low[letters, 0] >= box_low[0] - 1e-9) & (high[letters, 0] <= box_high[0] + 1e-9)
    inside &= (high[letters, 1] <= box_high[1] + 0.3 * height) & (low[letters, 1] >= box_low[1] - 0.4 * height)
    return sorted({*run, *letters[inside].tolist()})
