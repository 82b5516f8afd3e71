# SPDX-License-Identifier: GPL-2.0-or-later
"""Shapes that have a regularity of their own: circles, copies of each other, words.

All are found among the subpaths of a drawing, in the input.  Constants without another reason were chosen by
looking at the cases and at random drawings of a library.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Tuple

import numpy as np

from ..geometry import bezier
from ..geometry.arrays import Array
from ..geometry.connected_components import components, members
from ..model import Drawing

# Centres and edges nearer than this, of the diagonal, are at one place.
PLACE = 1e-3

# Sizes and gaps that differ by no more than this part are equal.
EQUAL = 0.02

# Two points may differ by this, of the diagonal, where each coordinate has a noise of 1e-4.  Small shapes may
# differ by no more than ROUGH of their size.
NOISE, ROUGH = 3e-4, 0.05

# An arc drawn by cubics is this near to its circle, of the radius.
ROUND = 5e-3

# An arc is kept round from this angle on, radians.  Less is a stroke's end or a corner, whose sides decide.
LEAST_ARC = 4.0

# A circle is whole if no more than this of its angle is missing, radians.
WHOLE = 0.05

# A subpath is a copy of another one if it differs by no more than this, of its size.
COPY = 5e-3

# A straight side is longer than this, of the shape's extent: where a circle is closed by a stub it has none.
SIDE = 0.1

# A shape this many times as long as wide is slender.  It may be stretched along, as strings and legs are.
SLENDER = 3.0

# Items smaller than this, of the diagonal, have no shape that an eye could compare.
SMALLEST = 2e-3

# A word has LETTERS at least.  The gap between two letters is at most GAP, the height of a letter at least
# LOW, of the height of the highest one.
LETTERS, GAP, LOW = 3, 0.7, 0.4


@dataclass(frozen=True)
class Paths:
    """The subpaths of a drawing: segments (k,) of each in order; low, high : (P, 2) boxes."""

    segments: list[Array]
    low: Array
    high: Array
    closed: Array


def subpaths(drawing: Drawing) -> Paths:
    """The subpaths that are more than a point, segments in their order."""
    count = len(drawing.control)
    joined = np.flatnonzero(drawing.following >= 0)
    _, label = components(np.stack([joined, drawing.following[joined]], axis=1), count)
    groups = members(label)
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
        last = group[drawing.following[group] < 0]
        first = np.setdiff1d(group, drawing.following[group])
        # Without a command that closes it a subpath can end where it began.
        gap = np.abs(drawing.control[last, 3] - drawing.control[first, 0]).max(initial=0.0)
        closed.append(bool(gap <= NOISE * drawing.diagonal))
    return Paths(
        segments, np.array(lows).reshape(-1, 2), np.array(highs).reshape(-1, 2), np.array(closed, dtype=bool)
    )


# Segments, centre (2,), radii (2,).
Arc = Tuple[Array, Array, Array]


def arcs(drawing: Drawing, paths: Paths, diagonal: float, free: Array) -> list[Arc]:
    """Circles, and arcs that are more than half of one."""
    control = drawing.control
    points = bezier.evaluate(control[:, None], np.linspace(0.0, 1.0, 5)[None, :])
    a, m, b = points[:, 0], points[:, 2], points[:, 4]
    p, q = m - a, b - a
    cross = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
    usable = free & ~drawing.line & (np.abs(cross) > 1e-12 * diagonal**2)
    safe = np.where(usable, cross, 1.0)
    pp, qq = (p**2).sum(axis=1), (q**2).sum(axis=1)
    offset = np.stack([q[:, 1] * pp - p[:, 1] * qq, p[:, 0] * qq - q[:, 0] * pp], axis=1) / (
        2.0 * safe[:, None]
    )
    centre, radius = a + offset, np.linalg.norm(offset, axis=1)
    tolerance = np.maximum(ROUND * radius, np.minimum(NOISE * diagonal, ROUGH * radius))
    off = np.abs(np.linalg.norm(points - centre[:, None], axis=2) - radius[:, None]).max(axis=1)
    usable &= (off <= tolerance) & (radius <= diagonal) & (radius >= SMALLEST * diagonal)
    relative = points - centre[:, None]
    turn = np.arctan2(
        relative[:, :-1, 0] * relative[:, 1:, 1] - relative[:, :-1, 1] * relative[:, 1:, 0],
        (relative[:, :-1] * relative[:, 1:]).sum(axis=2),
    ).sum(axis=1)
    runs: list[Arc] = []
    for segments in paths.segments:
        good = segments[usable[segments]]
        while len(good):
            first = good[0]
            near = np.linalg.norm(centre[good] - centre[first], axis=1) <= 4.0 * tolerance[first]
            near &= np.abs(radius[good] - radius[first]) <= 4.0 * tolerance[first]
            run, good = good[near], good[~near]
            if abs(turn[run].sum()) >= LEAST_ARC:
                middle, long = circle(points[run].reshape(-1, 2))
                whole = (
                    abs(turn[run].sum()) > 2.0 * np.pi - WHOLE
                    and drawing.line[np.setdiff1d(segments, run)].all()
                )
                runs.append((np.sort(segments) if whole else run, middle, np.full(2, long)))
    return runs


def ellipses(drawing: Drawing, paths: Paths, diagonal: float, free: Array) -> list[Arc]:
    """Closed subpaths that are ellipses along the axes, not circles: as `arcs`."""
    result = []
    for n in np.flatnonzero(paths.closed).tolist():
        segments = np.sort(paths.segments[n])
        radii = (paths.high[n] - paths.low[n]) / 2.0
        curved = segments[~drawing.line[segments]]
        if len(curved) < 2 or not free[segments].all() or not radii.min() > 0:
            continue
        centre = paths.low[n] + radii
        points = bezier.evaluate(drawing.control[curved][:, None], np.linspace(0.0, 1.0, 6)[None, :])
        unit = (points - centre) / radii
        away = np.linalg.norm(unit, axis=2) - 1.0
        z = unit[..., 0] + 1j * unit[..., 1]
        # Two lines to the centre and back may close it: so Inkscape once wrote ellipses.
        turn = np.angle(z[:, 1:] * z[:, :-1].conj()).sum()
        whole = abs(turn) > 2.0 * np.pi - WHOLE
        if whole and np.abs(away).max() <= max(2.0 * ROUND, min(NOISE * diagonal / radii.min(), ROUGH)):
            result.append((segments, centre, radii))
    return result


def equal(values: Array, tolerance: Array) -> list[Array]:
    """Groups of equal values, as their numbers, ascending by value; a group may have a single member.

    values : (k,); tolerance : (k,) by how much others may be greater than each, where it is the least
    """
    order = np.argsort(values, kind="stable")
    groups, begin = [], 0
    for end in range(1, len(order) + 1):
        if end == len(order) or values[order[end]] - values[order[begin]] > tolerance[order[begin]]:
            groups.append(order[begin:end])
            begin = end
    return groups


def circle(points: Array) -> tuple[Array, float]:
    """Centre and radius of the least squares circle of points (n, 2)."""
    mean = points.mean(axis=0)
    p = points - mean
    matrix = np.column_stack([2.0 * p, np.ones(len(p))])
    x, y, c = np.linalg.lstsq(matrix, (p**2).sum(axis=1), rcond=None)[0]
    return mean + (x, y), float(np.sqrt(max(c + x * x + y * y, 0.0)))


def about_one_centre(rounds: list[Arc], diagonal: float) -> list[Arc]:
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


def copies(drawing: Drawing, paths: Paths, diagonal: float, free: Array) -> list[tuple[list[int], bool]]:
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
                segments = paths.segments[alike[first]]
                extent = paths.high[alike[first]] - paths.low[alike[first]]
                curved = bool(paths.closed[alike[first]]) and extent.max() < SLENDER * extent.min()
                lines = drawing.control[segments[drawing.line[segments]]]
                side = np.linalg.norm(lines[:, 3] - lines[:, 0], axis=1).max(initial=0.0)
                curved &= bool(side <= SIDE * extent.max())
                group = [alike[first], *(alike[n] for n in rest[found])]
                result.append((group, curved or bool(turned[found].any())))
            left = rest[~found].tolist()
    return result


def words(paths: Paths, diagonal: float, free: Array) -> list[list[int]]:
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
    inside &= (high[letters, 1] <= box_high[1] + 0.3 * height) & (
        low[letters, 1] >= box_low[1] - 0.4 * height
    )
    return sorted({*run, *letters[inside].tolist()})
