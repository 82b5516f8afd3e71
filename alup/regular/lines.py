# SPDX-License-Identifier: GPL-2.0-or-later
"""Straight lines: which are parallel, which lie on one horizontal or vertical line, which have one length.

A *line* is a maximal straight run of segments, with a corner or a curve at either end.  In the input are
found

* *upright* lines, along the axes: one set, because a turn of one of them is seen at once;
* other *parallel* lines, which are a set where they face each other;
* *levels*: lines along an axis that have the same coordinate across it, in whatever shapes they are;
* *lengths*: lines of one direction that are equally long, if they face each other or are many.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..geometry.arrays import Array
from ..geometry.connected_components import components, members
from ..geometry.edges import cross
from ..model import Drawing
from .shapes import NOISE, PLACE, equal

# Shorter lines, of the diagonal, have no direction that an eye could compare.  Of more than MOST lines the
# longest are taken: what fills a surface with hatches is not looked at line by line.
LEAST, MOST = 0.02, 300

# Angles within this, radians, are equal; for short lines the noise of coordinates decides.
SAME_ANGLE = np.radians(0.1)

# Lengths that differ by no more than this part are equal.  Chosen by looking at the cases.
SAME_LENGTH = 5e-3

# So many lines of one direction and length are no coincidence, wherever they are.
MANY = 4

# Lines face each other if each is seen from the other over this part of the shorter one, and they are no
# farther apart than the longer one is long.
FACING = 0.5


@dataclass(frozen=True)
class Lines:
    """L lines.

    samples : of each, (n,) int, those of both ends among them; ends : (L, 2) int, samples
    segments : of each, numbers of the drawing's segments
    direction : (L, 2) unit vectors from the first to the second end; length : (L,) user units
    upright : those along the axes, numbers (k,) of lines; parallel, levels, lengths : sets of such numbers
    """

    samples: list[Array] = field(default_factory=list)
    segments: list[Array] = field(default_factory=list)
    ends: Array = field(default_factory=lambda: np.zeros((0, 2), dtype=int))
    direction: Array = field(default_factory=lambda: np.zeros((0, 2)))
    length: Array = field(default_factory=lambda: np.zeros(0))
    upright: Array = field(default_factory=lambda: np.zeros(0, dtype=int))
    parallel: list[Array] = field(default_factory=list)
    levels: list[Array] = field(default_factory=list)
    lengths: list[Array] = field(default_factory=list)

    @property
    def together(self) -> list[Array]:
        """All sets of two lines or more."""
        upright = [self.upright] if len(self.upright) > 1 else []
        return [*upright, *self.parallel, *self.levels, *self.lengths]

    def __len__(self) -> int:
        """How many lines are in a set with others."""
        return len(np.unique(np.concatenate(self.together))) if self.together else 0


def runs(drawing: Drawing, free: Array) -> list[Array]:
    """Maximal straight runs among some segments, (S,) bool: the segments of each."""
    control, diagonal = drawing.control, drawing.diagonal
    chord = control[:, 3] - control[:, 0]
    length = np.linalg.norm(chord, axis=1)
    straight = free & (length > NOISE * diagonal)
    unit = chord / np.where(straight, length, 1.0)[:, None]
    arms = control[:, 1:3] - control[:, :1]
    across = np.abs(cross(unit[:, None], arms)).max(axis=1)
    along = (unit[:, None] * arms).sum(axis=2)
    straight &= (
        (across <= NOISE * diagonal) & (along >= 0.0).all(axis=1) & (along <= length[:, None]).all(axis=1)
    )
    first = np.flatnonzero(straight & (drawing.following >= 0))
    then = drawing.following[first]
    on = straight[then] & ((unit[first] * unit[then]).sum(axis=1) > 0.0)
    shorter = np.minimum(length[first], length[then])
    on &= np.abs(cross(unit[first], unit[then])) <= _angle_tolerance(shorter, diagonal)
    which = np.flatnonzero(straight)
    place = np.full(len(control), -1)
    place[which] = np.arange(len(which))
    _, label = components(np.stack([place[first[on]], place[then[on]]], axis=1), len(which))
    return [which[group] for group in members(label)]


def find(points: Array, segments: list[Array], of_runs: list[Array], diagonal: float) -> Lines:
    """Lines among straight runs, and the sets that they form.

    points : (N, 2); segments, of_runs : the segments and the samples of each run
    """
    ends, samples, drawn, known = [], [], [], set()
    for run, mine in zip(segments, of_runs):
        p = points[mine]
        far = np.argmax(((p - p[0]) ** 2).sum(axis=1))
        along = (p - p[0]) @ (p[far] - p[0])
        pair = int(mine[np.argmin(along)]), int(mine[np.argmax(along)])
        long = float(np.linalg.norm(points[pair[1]] - points[pair[0]]))
        if long >= LEAST * diagonal and frozenset(pair) not in known:
            known.add(frozenset(pair))
            ends.append((long, *pair))
            samples.append(mine)
            drawn.append(run)
    order = sorted(range(len(ends)), key=lambda n: (-ends[n][0], n))[:MOST]
    if len(order) < 2:
        return Lines()
    pairs = np.array([ends[n][1:] for n in order])
    vector = points[pairs[:, 1]] - points[pairs[:, 0]]
    # All directions in one half of the plane, so that parallel lines have equal ones.
    upright = np.abs(vector) <= np.maximum(
        NOISE * diagonal, SAME_ANGLE * np.linalg.norm(vector, axis=1, keepdims=True)
    )
    back = (vector[:, 0] < 0.0) & ~upright[:, 0] | upright[:, 0] & (vector[:, 1] < 0.0)
    pairs[back] = pairs[back, ::-1]
    vector[back] *= -1.0
    length = np.linalg.norm(vector, axis=1)
    direction = vector / length[:, None]
    middle = (points[pairs[:, 0]] + points[pairs[:, 1]]) / 2.0
    facing = _facing(middle, direction, length, diagonal)
    on_axis = upright.any(axis=1)
    parallel = _sets(facing[~on_axis[facing].any(axis=1)], len(order))
    levels = []
    for axis in (0, 1):
        mine = np.flatnonzero(upright[:, axis])
        place = middle[mine, axis]
        by_place = np.argsort(place, kind="stable")
        cuts = np.flatnonzero(np.diff(place[by_place]) > PLACE * diagonal) + 1
        levels += [mine[group] for group in np.split(by_place, cuts) if len(group) > 1]
    a, b = length[facing].T
    tolerance = _length_tolerance(length, diagonal)
    lengths = _sets(facing[np.abs(a - b) <= tolerance[facing[:, 0]]], len(order))
    for group in [*(np.flatnonzero(along) for along in upright.T), *parallel]:
        lengths += [group[mine] for mine in equal(length[group], tolerance[group]) if len(mine) >= MANY]
    return Lines(
        samples=[samples[n] for n in order],
        segments=[drawn[n] for n in order],
        ends=pairs,
        direction=direction,
        length=length,
        upright=np.flatnonzero(on_axis),
        parallel=parallel,
        levels=levels,
        lengths=lengths,
    )


def _sets(pairs: Array, count: int) -> list[Array]:
    """Numbers below `count` that pairs (m, 2) join, two or more in each."""
    _, label = components(pairs, count)
    return [group for group in members(label) if len(group) > 1]


def _length_tolerance(length: Array, diagonal: float) -> Array:
    return np.maximum(SAME_LENGTH * length, NOISE * diagonal)


def _angle_tolerance(length: Array, diagonal: float) -> Array:
    """By how much directions of lines of these lengths may differ, radians."""
    return np.maximum(SAME_ANGLE, NOISE * diagonal / np.maximum(length, 1e-300))


def _facing(middle: Array, direction: Array, length: Array, diagonal: float) -> Array:
    """Pairs (m, 2) of parallel lines beside each other."""
    i, j = np.triu_indices(len(length), 1)
    turn = np.abs(cross(direction[i], direction[j]))
    near = turn <= _angle_tolerance(np.minimum(length[i], length[j]), diagonal)
    i, j = i[near], j[near]
    away = middle[j] - middle[i]
    along, across = np.abs((away * direction[i]).sum(axis=1)), np.abs(cross(direction[i], away))
    shorter, longer = np.minimum(length[i], length[j]), np.maximum(length[i], length[j])
    seen = (shorter + longer) / 2.0 - along >= FACING * shorter
    beside = seen & (across <= longer) & (across > PLACE * diagonal)
    return np.stack([i[beside], j[beside]], axis=1)
