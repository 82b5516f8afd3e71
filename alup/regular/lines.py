# SPDX-License-Identifier: GPL-2.0-or-later
"""Straight lines: which are parallel, which lie on one horizontal or vertical line, which have one length.

A *line* is a maximal straight run of segments, with a corner or a curve at either end.  Found are, in the
input,

* *directions*: lines along the axes are one set, because a turn of one of them is seen at once; other
  parallel lines are a set where they face each other;
* *levels*: lines along an axis that have the same coordinate across it, in whatever shapes they are;
* *lengths*: parallel lines that face each other and are equally long.

After both rounds the lines of a set are asked for one turn, their weighted median, lines of a level for one
coordinate, and lines of one length for one growth.  With unit normals n and directions u after that turn, and
ends x, these are linear:

    n . (x_2 - x_1) = 0,     n . (x_1 + x_2 - y_1 - y_2) / 2 = 0,     u . (x_2 - x_1) - r u . (y_2 - y_1) = 0

for lines x and y, r the ratio of their lengths.  One more round adds their squares to the energy, as ties
that hold along one axis.  A line that the rounds turned, shifted or stretched much more than the others of
its set is let go, because handles ask for that.

Tried and left: placing the lines by least squares and holding them there like handles (crossings with other
curves could not slide, and were torn: a guitar's neck, a train's wheels).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..geometry.arrays import Array
from ..geometry.connected_components import components
from ..model import Alignments, Drawing
from .shapes import NOISE, PLACE

# Shorter lines, of the diagonal, have no direction that an eye could compare.  Of more than MOST lines the
# longest are taken: what fills a surface with hatches is not looked at line by line.
LEAST, MOST = 0.02, 300

# Angles within this, radians, are equal; for short lines the noise of coordinates decides.
SAME_ANGLE = np.radians(0.1)

# Lengths that differ by no more than this part are equal.
SAME_LENGTH = 5e-3

# Lines face each other if each is seen from the other over this part of the shorter one, and they are no
# farther apart than the longer one is long.
FACING = 0.5

# A line leaves its set if it has turned by this angle more, radians, has grown by this factor more, or has
# moved off its level by this part of the diagonal.  All three were chosen by looking at the cases.
TURNED, GROWN, SHIFTED = np.radians(3.0), 1.1, 0.01

# Lines along the axes stay upright if they turn by no more than this on the whole, radians.
UPRIGHT = np.radians(0.5)

# A line is let go if its samples are farther from its chord than this, of its length: handles bend it.
BENT = 0.02

# What is nearer to its place than these, radians, part and part of the diagonal, is regular enough.
TURN_SEEN, GROWTH_SEEN, SHIFT_SEEN = np.radians(0.1), 3e-3, 2e-4


@dataclass(frozen=True)
class Lines:
    """L lines.  samples : of each, (n,) int, those of both ends among them; ends : (L, 2) int, samples

    direction : (L, 2) unit vectors from the first to the second end; length : (L,) user units
    directions, levels, lengths : sets, numbers (k,) of lines; upright : whether directions are along the axes
    """

    samples: list[Array] = field(default_factory=list)
    ends: Array = field(default_factory=lambda: np.zeros((0, 2), dtype=int))
    direction: Array = field(default_factory=lambda: np.zeros((0, 2)))
    length: Array = field(default_factory=lambda: np.zeros(0))
    directions: list[Array] = field(default_factory=list)
    upright: list[bool] = field(default_factory=list)
    levels: list[Array] = field(default_factory=list)
    lengths: list[Array] = field(default_factory=list)

    def __len__(self) -> int:
        """How many lines are in a set with others."""
        sets = [*self.directions, *self.levels, *self.lengths]
        return len(np.unique(np.concatenate(sets))) if sets else 0


def runs(drawing: Drawing, free: Array) -> list[Array]:
    """Maximal straight runs among some segments, (S,) bool: the segments of each."""
    control, diagonal = drawing.control, drawing.diagonal
    chord = control[:, 3] - control[:, 0]
    length = np.linalg.norm(chord, axis=1)
    straight = free & (length > NOISE * diagonal)
    unit = chord / np.where(straight, length, 1.0)[:, None]
    arms = control[:, 1:3] - control[:, :1]
    across = np.abs(_cross(unit[:, None], arms)).max(axis=1)
    along = (unit[:, None] * arms).sum(axis=2)
    straight &= (
        (across <= NOISE * diagonal) & (along >= 0.0).all(axis=1) & (along <= length[:, None]).all(axis=1)
    )
    first = np.flatnonzero(straight & (drawing.following >= 0))
    then = drawing.following[first]
    on = straight[then] & ((unit[first] * unit[then]).sum(axis=1) > 0.0)
    shorter = np.minimum(length[first], length[then])
    on &= np.abs(_cross(unit[first], unit[then])) <= np.maximum(
        SAME_ANGLE, NOISE * diagonal / np.maximum(shorter, 1e-300)
    )
    which = np.flatnonzero(straight)
    place = np.full(len(control), -1)
    place[which] = np.arange(len(which))
    _, label = components(np.stack([place[first[on]], place[then[on]]], axis=1), len(which))
    order = np.argsort(label, kind="stable")
    return (
        [which[group] for group in np.split(order, np.flatnonzero(np.diff(label[order])) + 1)]
        if len(which)
        else []
    )


def find(points: Array, runs_samples: list[Array], diagonal: float) -> Lines:
    """Lines among straight runs, given by their samples, of points (N, 2), and the sets that they form."""
    ends, samples = [], []
    known = set()
    for mine in runs_samples:
        p = points[mine]
        far = np.argmax(((p - p[0]) ** 2).sum(axis=1))
        along = (p - p[0]) @ (p[far] - p[0])
        pair = int(mine[np.argmin(along)]), int(mine[np.argmax(along)])
        long = float(np.linalg.norm(points[pair[1]] - points[pair[0]]))
        if long >= LEAST * diagonal and frozenset(pair) not in known:
            known.add(frozenset(pair))
            ends.append((long, *pair))
            samples.append(mine)
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
    directions = [np.flatnonzero(on_axis)] if on_axis.sum() > 1 else []
    upright_sets = [True] * len(directions)
    directions += _sets(facing[~on_axis[facing].any(axis=1)], len(order))
    levels = []
    for axis in (0, 1):
        mine = np.flatnonzero(upright[:, axis])
        place = middle[mine, axis]
        by_place = np.argsort(place, kind="stable")
        cuts = np.flatnonzero(np.diff(place[by_place]) > PLACE * diagonal) + 1
        levels += [mine[group] for group in np.split(by_place, cuts) if len(group) > 1]
    a, b = length[facing].T
    lengths = _sets(facing[np.abs(a - b) <= np.maximum(SAME_LENGTH * a, NOISE * diagonal)], len(order))
    upright_sets += [False] * (len(directions) - len(upright_sets))
    return Lines(
        [samples[n] for n in order], pairs, direction, length, directions, upright_sets, levels, lengths
    )


def _cross(a: Array, b: Array) -> Array:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _sets(pairs: Array, count: int) -> list[Array]:
    """Numbers below `count` that pairs (m, 2) join, two or more in each."""
    _, label = components(pairs, count)
    order = np.argsort(label, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    return [group for group in groups if len(group) > 1]


def _facing(middle: Array, direction: Array, length: Array, diagonal: float) -> Array:
    """Pairs (m, 2) of parallel lines beside each other."""
    i, j = np.triu_indices(len(length), 1)
    turn = np.abs(_cross(direction[i], direction[j]))
    near = turn <= np.maximum(SAME_ANGLE, NOISE * diagonal / np.minimum(length[i], length[j]))
    i, j = i[near], j[near]
    away = middle[j] - middle[i]
    along, across = np.abs((away * direction[i]).sum(axis=1)), np.abs(_cross(direction[i], away))
    shorter, longer = np.minimum(length[i], length[j]), np.maximum(length[i], length[j])
    seen = (shorter + longer) / 2.0 - along >= FACING * shorter
    beside = seen & (across <= longer) & (across > PLACE * diagonal)
    return np.stack([i[beside], j[beside]], axis=1)


def alignments(
    lines: Lines, points: Array, moved: Array, held: Array, label: Array, diagonal: float
) -> Alignments | None:
    """What the lines of sets are asked for after the rounds; None where nothing is visibly wrong.

    points, moved : (N, 2) samples in the input and after the rounds, handles met; held : (H,) samples
    label : (N,) the parts of the network that samples belong to; diagonal : of the input
    """
    if not len(lines):
        return None
    wanted = _Wanted(lines, points, moved, held, label)
    for group, upright in zip(lines.directions, lines.upright):
        wanted.one_turn(group, upright)
    for group in lines.levels:
        wanted.one_level(group, diagonal)
    for group in lines.lengths:
        wanted.one_growth(group)
    if not wanted.wrong:
        return None
    samples, factor, axis, length = zip(*wanted.asked)
    return Alignments(np.array(samples), np.array(factor), np.array(axis), np.array(length))


class _Wanted:
    """Collects the alignments: asked, a row of `Alignments` each; wrong : whether an eye sees one missed."""

    def __init__(self, lines: Lines, points: Array, moved: Array, held: Array, label: Array):
        self.asked: list[tuple[tuple[int, ...], tuple[float, ...], Array, float]] = []
        self.wrong = False
        self._lines = lines
        start, end = moved[lines.ends[:, 0]], moved[lines.ends[:, 1]]
        turned = _complex(end - start) * _complex(lines.direction).conj()
        self._angle, self._growth = np.angle(turned), np.abs(turned) / lines.length
        self._middle = (start + end) / 2.0
        free = ~_turned_by_handles(points, moved, held, label)[lines.ends[:, 0]]
        straight = [_is_straight(moved, *one) for one in zip(lines.samples, lines.ends, lines.length)]
        self._able = free & np.array(straight)
        # Directions after the turn.
        self._u = lines.direction.copy()

    def one_turn(self, group: Array, upright: bool) -> None:
        """Ask the lines of a set for their median turn."""
        lines, group = self._lines, group[self._able[group]]
        if len(group) < 2:
            return
        common = _median(self._angle[group], lines.length[group])
        # Lines along the axes stay there unless handles turn the drawing.
        if upright and abs(common) <= UPRIGHT:
            common = 0.0
        off = np.abs(self._angle[group] - common)
        group, off = group[off <= TURNED], off[off <= TURNED]
        if len(group) < 2:
            return
        self.wrong |= bool(off.max() > TURN_SEEN)
        axis = _complex(lines.direction[group]) * np.exp(1j * common)
        self._u[group] = np.stack([axis.real, axis.imag], axis=1)
        for n in group.tolist():
            a, b = lines.ends[n].tolist()
            self._ask((a, a, b, b), (-1.0, 0.0, 1.0, 0.0), _normal(self._u[n]), lines.length[n])

    def one_level(self, group: Array, diagonal: float) -> None:
        """Ask the lines of a level for one coordinate across them."""
        group = group[self._able[group]]
        if len(group) < 2:
            return
        across = (_normal(self._u[group]) * self._middle[group]).sum(axis=1)
        near = np.abs(across - _median(across, self._lines.length[group])) <= SHIFTED * diagonal
        group, across = group[near], across[near]
        self.wrong |= len(group) > 1 and bool(np.ptp(across) > SHIFT_SEEN * diagonal)
        for n, m in zip(group.tolist(), group[1:].tolist()):
            long = max(self._lines.length[n], self._lines.length[m])
            self._ask(self._ends(n, m), (-0.5, -0.5, 0.5, 0.5), _normal(self._u[n]), long)

    def one_growth(self, group: Array) -> None:
        """Ask lines of one length for one growth, as far as they have grown nearly alike."""
        group = group[self._able[group]]
        if len(group) < 2 or self._growth[group].max() > GROWN * self._growth[group].min():
            return
        self.wrong |= bool(self._growth[group].max() > (1.0 + GROWTH_SEEN) * self._growth[group].min())
        for n, m in zip(group.tolist(), group[1:].tolist()):
            ratio = float(self._lines.length[n] / self._lines.length[m])
            self._ask(self._ends(n, m), (1.0, -1.0, -ratio, ratio), self._u[n], self._lines.length[n])

    def _ask(self, samples: tuple[int, ...], factor: tuple[float, ...], axis: Array, length: float) -> None:
        self.asked.append((samples, factor, axis, float(length)))

    def _ends(self, n: int, m: int) -> tuple[int, ...]:
        return (*self._lines.ends[n].tolist(), *self._lines.ends[m].tolist())


def _turned_by_handles(points: Array, moved: Array, held: Array, label: Array) -> Array:
    """Which samples (N,) are of a part that its own handles turn: their moves decide over its lines.

    The turn is that of the least squares similarity of the part's handles.
    """
    count = int(label.max(initial=-1)) + 1
    of, p, q = label[held], _complex(points[held]), _complex(moved[held])
    number = np.maximum(np.bincount(of, minlength=count), 1)

    def total(values: Array) -> Array:
        real = np.bincount(of, values.real, minlength=count)
        return np.asarray(real + 1j * np.bincount(of, values.imag, minlength=count))

    a, b = p - (total(p) / number)[of], q - (total(q) / number)[of]
    turned = np.abs(np.angle(total(b * a.conj()))) > TURN_SEEN
    return np.asarray(turned[label])


def _complex(vectors: Array) -> Array:
    return np.asarray(vectors[..., 0] + 1j * vectors[..., 1])


def _normal(direction: Array) -> Array:
    return np.stack([-direction[..., 1], direction[..., 0]], axis=-1)


def _is_straight(moved: Array, samples: Array, ends: Array, length: float) -> bool:
    """Whether the samples of a line lie on a chord after the rounds."""
    start = moved[ends[0]]
    vector = moved[ends[1]] - start
    reach = float(np.linalg.norm(vector))
    return reach > 0.0 and bool(np.abs(_cross(vector / reach, moved[samples] - start)).max() <= BENT * length)


def _median(values: Array, weights: Array) -> float:
    """The weighted median; of two that share the middle the mean."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weights[order]) / weights.sum()
    low = int(np.searchsorted(total, 0.5 - 1e-9))
    high = min(int(np.searchsorted(total, 0.5 + 1e-9)), len(order) - 1)
    return float((values[order[low]] + values[order[high]]) / 2.0)
