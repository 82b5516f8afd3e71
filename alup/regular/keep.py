# SPDX-License-Identifier: GPL-2.0-or-later
"""Places for what is regular: the nearest regular ones to where both rounds moved it.

Every item moves by an axis map x -> S x + t, S diagonal: its lines keep their directions, and one that is
round stays round.  S and t are the least squares ones of its samples; then

* what grows alike along both axes takes the growth that is nearer to 1, or 1 if one axis grows and the other
  shrinks: a wheel of a longer truck keeps its size (Slippage-Preserving Reshaping, 2023, found that people
  expect sizes to change little);
* items of a set grow alike, as the one that changes least, unless they have grown apart along an axis or
  handles give them a size;
* centres on a line stay on one, evenly spaced places stay evenly spaced, and rings stay round, each by least
  squares.

Handles come first.  An item with one handle follows it; one with several is let go unless an axis map meets
all of them; a row does not ask a held item to stay in it.  An item that the rounds bent, or moved by
anything but an axis map, is let go too: something that is held leaves it no choice.

If all samples moved by one axis map, that is the answer: a stretch of everything is a stretch (`is_stretch`).

Tried and left: the same before the final round (what the final round would have adjusted beside a held item
stayed open: cells came apart, a guitar's head swelled).  Not tried: unknowns for items in the energy.  The
constants were chosen by looking at the cases.
"""

from __future__ import annotations

import numpy as np

from ..geometry.arrays import Array
from .find import CIRCLES, WORDS, Regular

# An item is let go if its samples are farther from its axis map than this, of its size.
BENT = 0.1

# An item grows alike along both axes unless one of them has to grow this many times as much.
OVAL = 1.25

# An item leaves its set if it has grown by this factor more, or less, along an axis.  Handles ask for that.
APART = 1.25

# A row is let go if one of it has come farther off its place than this, of its own extent: handles ask for
# that.  Two things side by side are hardly a row.
OUT_OF_LINE, OUT_OF_PAIR = 1.0, 0.3

# Handles are met by a map that misses them by no more than this, of the diagonal.
MET = 1e-6

# What is nearer to its place than REGULAR, of the diagonal, and to its size than SAME is regular enough.  A
# circle has to be off by no more than EVEN, of the diagonal of its box.  A copy may be bent a little, as its
# surroundings are.
REGULAR, SAME, EVEN = 2e-4, 0.003, 0.0015

# All is one axis map if no sample is farther from it than this, of the diagonal.
STRETCH = 1e-7


def places(regular: Regular, points: Array, moved: Array, held: Array, targets: Array) -> tuple[Array, Array]:
    """Samples (m,) of what is regular, without those that handles hold, and their places (m, 2); user units.

    points, moved : (N, 2) samples in the input and after both rounds, handles met; held : (H,) samples
    targets : (H, 2)
    """
    none = np.zeros(0, dtype=int), np.zeros((0, 2))
    if not regular.items:
        return none
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    fits = _Fits(regular, points, moved, held, targets, diagonal)
    fits.grow_alike()
    fits.put_in_line()
    return fits.places()


def is_stretch(points: Array, moved: Array) -> bool:
    """Whether samples (N, 2) were moved by one axis map to (N, 2): then there is nothing to keep."""
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    return _axis_map(points, moved)[2] <= STRETCH * diagonal


def _axis_map(p: Array, v: Array) -> tuple[Array, Array, float]:
    """Least squares of v = S p + t: S (2,), the image of p's mean (2,), and the greatest distance."""
    middle, image = p.mean(axis=0), v.mean(axis=0)
    a, b = p - middle, v - image
    square = (a**2).sum(axis=0)
    flat = square <= 1e-12 * square.sum() + 1e-300
    scale = np.where(flat, 1.0, (a * b).sum(axis=0) / np.where(flat, 1.0, square))
    return scale, image, float(np.linalg.norm(b - scale * a, axis=1).max())


def _off_similarity(p: Array, v: Array) -> float:
    """The greatest distance of samples (n, 2) from the least squares similarity of (n, 2)."""
    a, b = ((q - q.mean(axis=0)) @ np.array([1.0, 1.0j]) for q in (p, v))
    return float(np.abs(b - a * (b @ a.conj()) / max(float((np.abs(a) ** 2).sum()), 1e-300)).max())


def _nearest_to_one(scale: Array) -> float:
    """Of several growths the one nearest to 1; 1 if one is more and another one less."""
    log = np.log(np.maximum(scale, 1e-9))
    return 1.0 if log.min() * log.max() <= 0.0 else float(np.exp(log[np.argmin(np.abs(log))]))


class _Fits:
    """The axis maps of all items: scale (I, 2), centre (I, 2) where their centres go, which are kept (I,)."""

    def __init__(
        self, regular: Regular, points: Array, moved: Array, held: Array, targets: Array, diagonal: float
    ):
        self._regular, self._points, self._diagonal = regular, points, diagonal
        count = len(regular.items)
        self.scale, self.centre = np.ones((count, 2)), np.zeros((count, 2))
        self.kept, self.fixed = np.ones(count, dtype=bool), np.zeros(count, dtype=bool)
        self.sized = np.zeros(count, dtype=bool)
        self._was = np.ones((count, 2)), np.zeros((count, 2)), np.zeros(count, dtype=bool)
        self.rest = np.array([item.centre for item in regular.items])
        self.extent = np.array([item.high - item.low for item in regular.items])
        self._target = dict(zip(held.tolist(), targets))
        self._held = [np.intersect1d(item.samples, held) for item in regular.items]
        for n, item in enumerate(regular.items):
            p = points[item.samples]
            scale, image, away = _axis_map(p, moved[item.samples])
            size = float(np.linalg.norm(item.high - item.low))
            if scale.min() <= 0.0 or away > BENT * size * max(1.0, scale.max()):
                self.kept[n] = False
                continue
            self._was[0][n], self._was[1][n] = scale, image + scale * (self.rest[n] - p.mean(axis=0))
            # The gaps of a word are small beside it.
            allowed = {CIRCLES: EVEN * size, WORDS: REGULAR * diagonal}.get(item.kind, np.inf)
            self._was[2][n] = away > allowed
            if item.uniform:
                # What has to become an oval becomes one.
                if scale.max() > OVAL * scale.min():
                    self.kept[n] = False
                    continue
                scale = np.full(2, _nearest_to_one(scale))
            self.scale[n] = scale
            # The centre of the samples stays where it is.
            self.centre[n] = image + scale * (self.rest[n] - p.mean(axis=0))
            if len(self._held[n]) > 1:
                # Two handles that turn an item can be met by an axis map; how the rounds moved it tells.
                if away > SAME * size and _off_similarity(p, moved[item.samples]) < 0.5 * away:
                    self.kept[n] = False
                    continue
                self._size_by_handles(n)
            self._follow(n)

    def _size_by_handles(self, n: int) -> None:
        """Take the growth of an item from its handles, along the axes along which they lie apart."""
        p, q = self._of_handles(n)
        flat = np.ptp(p, axis=0) <= 1e-6 * self._diagonal
        scale = _axis_map(p, q)[0]
        if self._regular.items[n].uniform:
            scale = np.full(2, scale[~flat].mean() if not flat.all() else 1.0)
        self.scale[n] = np.where(flat & (not self._regular.items[n].uniform), self.scale[n], scale)
        self.sized[n] = True

    def _follow(self, n: int) -> None:
        """Bring an item onto its handles, or let it go."""
        if not len(self._held[n]):
            return
        p, q = self._of_handles(n)
        self.fixed[n] = True
        move = q - self.scale[n] * (p - self.rest[n])
        self.centre[n] = move.mean(axis=0)
        self.kept[n] = self.scale[n].min() > 0.0 and np.ptp(move, axis=0).max() <= MET * self._diagonal

    def _of_handles(self, n: int) -> tuple[Array, Array]:
        """Where the handles of an item are, and where they go, (h, 2) each."""
        at = self._held[n]
        return self._points[at], np.array([self._target[k] for k in at.tolist()])

    def grow_alike(self) -> None:
        """One growth, the one nearest to 1, for the items of a set that no handles size."""
        for group in self._regular.sets:
            rest = group[self.kept[group] & ~self.sized[group]]
            if not len(rest):
                continue
            common = np.array([_nearest_to_one(along) for along in self.scale[rest].T])
            differs = np.abs(np.log(self.scale[rest] / common)).max(axis=1) > np.log(APART)
            # A single handle moves what can only grow alike along both axes.
            differs &= [not self._regular.items[n].uniform for n in rest.tolist()]
            for n in rest[~differs].tolist():
                self.scale[n] = common
                self._follow(n)

    def put_in_line(self) -> None:
        """Centres in rows, columns and rings."""
        free = self.kept & ~self.fixed
        for ring in self._regular.rings:
            mine = ring.items[free[ring.items]]
            if len(mine) > 2:
                away = self.rest[mine] - ring.centre
                scale, image, _ = _axis_map(away, self.centre[mine])
                even = np.full(2, _nearest_to_one(scale))
                middle = image - even * away.mean(axis=0)
                self.centre[mine] = middle + even * away
        for spaced in self._regular.spaced:
            kept = free[spaced.items]
            mine, step = spaced.items[kept], spaced.step[kept]
            if len(np.unique(step)) > 2:
                place = self.centre[mine, spaced.axis]
                away = step - step.mean()
                per_step = (away * place).sum() / (away**2).sum()
                self._line_up([(mine, place.mean() + per_step * away)], spaced.axis)
        # Rows of a set stay in line together: some rows alone of a bent grid would cross others.
        of_set = {int(n): number for number, members in enumerate(self._regular.sets) for n in members}
        rows: dict[tuple[int, int], list[tuple[Array, Array]]] = {}
        for level in self._regular.levels:
            mine = level.items[free[level.items]]
            if len(mine) > 1:
                place = np.full(len(mine), self.centre[mine, level.axis].mean())
                rows.setdefault((of_set[int(mine[0])], level.axis), []).append((mine, place))
        for (_set, axis), together in rows.items():
            self._line_up(together, axis)

    def _line_up(self, rows: list[tuple[Array, Array]], axis: int) -> None:
        """Put centres of items (k,) at places (k,) along an axis, unless one is too far from there."""
        for items, place in rows:
            allowed = OUT_OF_LINE if len(items) > 2 else OUT_OF_PAIR
            if (np.abs(place - self.centre[items, axis]) > allowed * self.extent[items, axis]).any():
                return
        for items, place in rows:
            self.centre[items, axis] = place

    def _irregular(self) -> Array:
        """Which items, (I,) bool, are not as they should be, or are in a set with one that is not."""
        scale, centre, bent = self._was
        wrong = bent | (np.abs(scale / self.scale - 1.0).max(axis=1) > SAME)
        wrong |= np.abs(centre - self.centre).max(axis=1) > REGULAR * self._diagonal
        wrong &= self.kept
        for group in self._regular.sets:
            wrong[group] |= wrong[group].any()
        # One more round would bend the circles that it does not hold.
        if wrong.any():
            wrong |= [item.kind == CIRCLES for item in self._regular.items]
        return wrong & self.kept

    def places(self) -> tuple[Array, Array]:
        """The samples of the items that are kept, and their places."""
        total, times = np.zeros_like(self._points), np.zeros(len(self._points))
        for n in np.flatnonzero(self._irregular()):
            at = self._regular.items[n].samples
            total[at] += self.centre[n] + self.scale[n] * (self._points[at] - self.rest[n])
            times[at] += 1.0
        times[list(self._target)] = 0.0
        at = np.flatnonzero(times)
        return at, total[at] / times[at, None]
