# SPDX-License-Identifier: GPL-2.0-or-later
"""What straight lines are asked for so that they stay parallel, in line and of one length (see `lines`).

After both rounds a line that was bent a little is asked to be straight, unless a handle holds a sample inside
it.  The lines of a set are asked for one turn, their weighted median, lines of a level for one coordinate,
and lines of one length for one growth.  With unit normals n and directions u after that turn, and ends x,
these are linear:

    n . (x_2 - x_1) = 0,     n . (x_1 + x_2 - y_1 - y_2) / 2 = 0,     u . (x_2 - x_1) - r u . (y_2 - y_1) = 0

for lines x and y, r the ratio of their lengths, and n . (z - (1 - t) x_1 - t x_2) = 0 for samples z inside.
One more round adds their squares to the energy, as ties that hold along one axis.  A line that the rounds
turned, shifted or stretched much more than the others of its set is let go, because handles ask for that.

Tried and left: placing the lines by least squares and holding them there like handles (crossings with other
curves could not slide, and were torn: a guitar's neck, a train's wheels).
"""

from __future__ import annotations

import numpy as np

from ..geometry.arrays import Array
from ..geometry.edges import cross
from ..model import Alignments
from .lines import Lines
from .symmetry import TURNED, UPRIGHT

# A line leaves its set if it has turned by TURNED more, has grown by this factor more, or has moved off its
# level by SHIFTED, of the diagonal, and OFF, of its length.  Chosen by looking at the cases.
GROWN, SHIFTED, OFF = 1.1, 0.01, 0.3

# A line is let go if its samples are farther from its chord than this, of its length: handles bend it.
BENT = 0.02

# A line is bent if a sample is off its chord by more than BOW, of the diagonal.  INSIDE of its samples are
# then asked to be on it.
BOW, INSIDE = 5e-4, 8

# What is nearer to its place than these, radians, part and part of the diagonal, is regular enough.
TURN_SEEN, GROWTH_SEEN, SHIFT_SEEN = np.radians(0.1), 3e-3, 2e-4


class Wanted:
    """What lines are asked for after the rounds.

    lines : L lines; points, moved : (N, 2) samples in the input and after the rounds, handles met
    held : (H,) samples; label : (N,) the parts of the network that samples belong to
    diagonal : of the input
    wrong : whether an eye sees a line that is not as it should be
    upright : the turn of lines along the axes, radians; None where there are no such lines
    """

    def __init__(self, lines: Lines, points: Array, moved: Array, held: Array, label: Array, diagonal: float):
        self.wrong = False
        self.upright: float | None = None
        self._asked: list[tuple[tuple[int, ...], tuple[float, ...], Array, float]] = []
        self._lines, self._diagonal = lines, diagonal
        start, end = moved[lines.ends[:, 0]], moved[lines.ends[:, 1]]
        turned = _complex(end - start) * _complex(lines.direction).conj()
        self._angle, self._growth = np.angle(turned), np.abs(turned) / lines.length
        self._middle = (start + end) / 2.0
        free = ~_turned_by_handles(points, moved, held, label)[lines.ends[:, 0]]
        straight = [_is_straight(moved, *one) for one in zip(lines.samples, lines.ends, lines.length)]
        self._able = free & np.array(straight, dtype=bool)
        self._held = np.array([np.isin(samples, held).any() for samples in lines.samples], dtype=bool)
        # Directions after the turn.
        self._u = lines.direction.copy()
        self._one_turn(lines.upright, upright=True)
        for group in lines.parallel:
            self._one_turn(group)
        self._straighten(points, moved, held)
        for group in lines.levels:
            self._one_level(group)
        for group in lines.lengths:
            self._one_growth(group)

    def alignments(self) -> Alignments | None:
        """All that is asked for; None where nothing is wrong."""
        if not self.wrong:
            return None
        samples, factor, axis, length = zip(*self._asked)
        return Alignments(np.array(samples), np.array(factor), np.array(axis), np.array(length))

    def _one_turn(self, group: Array, upright: bool = False) -> None:
        """Ask the lines of a set for their median turn."""
        lines, group = self._lines, group[self._able[group]]
        if len(group) < 2:
            return
        common = _median(self._angle[group], lines.length[group])
        if upright:
            # Lines along the axes stay there unless handles turn the drawing.
            common = 0.0 if abs(common) <= UPRIGHT else common
            self.upright = common
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

    def _straighten(self, points: Array, moved: Array, held: Array) -> None:
        """Ask bent lines to be straight."""
        for n in np.flatnonzero(self._able).tolist():
            a, b = self._lines.ends[n].tolist()
            inside = np.setdiff1d(self._lines.samples[n], (a, b))
            u = (moved[b] - moved[a]) / np.linalg.norm(moved[b] - moved[a])
            bow = np.abs(cross(u, moved[inside] - moved[a]))
            if not len(inside) or bow.max() <= BOW * self._diagonal or np.isin(inside, held).any():
                continue
            self.wrong = True
            chord = points[b] - points[a]
            for k in inside[:: max(1, len(inside) // INSIDE)].tolist():
                t = float((points[k] - points[a]) @ chord / (chord @ chord))
                self._ask((k, k, a, b), (1.0, 0.0, t - 1.0, -t), _normal(u), self._lines.length[n] / INSIDE)

    def _one_level(self, group: Array) -> None:
        """Ask the lines of a level for one coordinate across them."""
        group = group[self._able[group]]
        if len(group) < 2:
            return
        across = (_normal(self._u[group]) * self._middle[group]).sum(axis=1)
        length = self._lines.length[group]
        allowed = np.maximum(SHIFTED * self._diagonal, OFF * length)
        near = np.abs(across - _median(across, length)) <= allowed
        group, across = group[near], across[near]
        self.wrong |= len(group) > 1 and bool(np.ptp(across) > SHIFT_SEEN * self._diagonal)
        for n, m in zip(group.tolist(), group[1:].tolist()):
            long = max(self._lines.length[n], self._lines.length[m])
            self._ask(self._ends(n, m), (-0.5, -0.5, 0.5, 0.5), _normal(self._u[n]), long)

    def _one_growth(self, group: Array) -> None:
        """Ask lines of one length for one growth, as far as they have grown nearly alike.

        A line with a handle is as long as handles ask.
        """
        group = group[self._able[group] & ~self._held[group]]
        if len(group) > 1:
            common = _median(self._growth[group], self._lines.length[group])
            group = group[np.abs(np.log(self._growth[group] / common)) <= np.log(GROWN)]
        if len(group) < 2:
            return
        self.wrong |= bool(self._growth[group].max() > (1.0 + GROWTH_SEEN) * self._growth[group].min())
        for n, m in zip(group.tolist(), group[1:].tolist()):
            ratio = float(self._lines.length[n] / self._lines.length[m])
            self._ask(self._ends(n, m), (1.0, -1.0, -ratio, ratio), self._u[n], self._lines.length[n])

    def _ask(self, samples: tuple[int, ...], factor: tuple[float, ...], axis: Array, length: float) -> None:
        self._asked.append((samples, factor, axis, float(length)))

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
    return reach > 0.0 and bool(np.abs(cross(vector / reach, moved[samples] - start)).max() <= BENT * length)


def _median(values: Array, weights: Array) -> float:
    """The weighted median; of two that share the middle the mean."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weights[order]) / weights.sum()
    low = int(np.searchsorted(total, 0.5 - 1e-9))
    high = min(int(np.searchsorted(total, 0.5 + 1e-9)), len(order) - 1)
    return float((values[order[low]] + values[order[high]]) / 2.0)
