"""One fit of cubic segments to their moved samples, all segments at once (see `refit.py`).

With Bernstein basis b, end displacements D0, D3 given and sample displacements d,

    min  sum_i w_i |b1 D1 + b2 D2 - (d_i - b0 D0 - b3 D3)|^2  +  PRIOR (|D1 - D1*|^2 + |D2 - D2*|^2)

first freely, then with the handles of smooth nodes along common directions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import bezier
from .model import Array, Drawing

# Weight of the prior against one sample.  It biases what is well determined by less than 1e-7 of the
# drawing; a millionth of that and undetermined handles would be noise.
PRIOR = 1e-6

# Nodes whose two tangents differ by less than this are smooth, and stay so.
SMOOTH_ANGLE = np.radians(3.0)

# 4 rounds of parameter correction gain nearly all that 20 do.
CORRECTIONS = 4

# A handle (of a node) shorter than this part of its segment counts as retracted.
RETRACTED = 1e-6

# How far one that has to show a direction comes out, of its segment's chord.
RETRACTED_OUT = 0.01

# A handle this many times as long as what it was under the growth of its segment's chord, and as the way
# along the segment's samples, is no handle of the curve that they lie on: a cubic is at least half as long as
# its handles.  (One sample that weighs much can ask for any length, where it is beside the common direction.)
LONG = 4.0

_FREE, _ALONG, _FIXED = range(3)

# The control point of each handle and its node.
_HANDLES = ((1, 0), (2, 3))


@dataclass(frozen=True)
class Rows:
    """Samples along the drawing's segments: segment, its parameter, sample; sorted, ends included."""

    segment: Array
    t: Array
    sample: Array

    def of(self, which: Array) -> Rows:
        """Some of them, by a mask."""
        return Rows(self.segment[which], self.t[which], self.sample[which])


@dataclass(frozen=True)
class Spans:
    """Parts of segments that become one cubic each, sorted by segment and parameter."""

    segment: Array
    low: Array
    high: Array
    first: Array
    last: Array


class Fit:
    """One fit of all spans."""

    def __init__(
        self, drawing: Drawing, rows: Rows, spans: Spans, following: Array,
        displacement: Array,
        weight: Array,
        strictness: Array,
        tolerance: float,
    ):  # fmt: skip
        self.spans = spans
        self.line = drawing.line[spans.segment]
        self.original = bezier.subrange(drawing.control[spans.segment], spans.low, spans.high)
        whole = (spans.low == 0.0) & (spans.high == 1.0)
        self.original[whole] = drawing.control[spans.segment[whole]]
        # The lengths of its handles.
        self.handles = [
            np.linalg.norm(self.original[:, inner] - self.original[:, node], axis=1)
            for inner, node in _HANDLES
        ]
        self.d0, self.d3 = displacement[spans.first], displacement[spans.last]
        self._assign_rows(rows, displacement, weight, strictness)
        self.next = self._next_spans(following)
        self.prior = self._prior()
        free = np.full(len(self.line), _FREE)
        along = np.zeros((len(self.line), 2))
        control = self._solve(free, free, along, along, self.t)
        # How far each free fit can be trusted, where two of them disagree on a direction.
        trust = 1.0 / (self._largest(self._distances(control, self.t)) ** 2 + tolerance**2)
        modes = self._modes(control, trust)
        self.control = self._solve(*modes, self.t)
        distance = self._distances(self.control, self.t)
        self._correct_parameters(modes, distance, tolerance)
        self.worst_distance = self._distances(self.control, self.t)
        self.error = self._largest(self.worst_distance)
        self.too_far = self._largest(self.worst_distance * self.strictness) > tolerance

    def _assign_rows(self, rows: Rows, displacement: Array, weight: Array, strictness: Array) -> None:
        """Inner samples of every span."""
        spans = self.spans
        owner = np.searchsorted(spans.low + 2.0 * spans.segment, rows.t + 2.0 * rows.segment, side="left") - 1
        owner = np.clip(owner, 0, None)
        inner = (
            (spans.segment[owner] == rows.segment)
            & (rows.t > spans.low[owner])
            & (rows.t < spans.high[owner])
        )
        self.owner, self.sample = owner[inner], rows.sample[inner]
        self.row_t = rows.t[inner]
        width = (spans.high - spans.low)[self.owner]
        self.t = (self.row_t - spans.low[self.owner]) / width
        self.d = displacement[self.sample]
        self.weight = weight[self.sample]
        self.strictness = strictness[self.sample]
        self.target = bezier.evaluate(self.original[self.owner], self.t) + self.d

    def _next_spans(self, following: Array) -> Array:
        """The span that each span's end leads into, or -1."""
        segment = self.spans.segment
        first = np.searchsorted(segment, following[segment])
        after = np.where(following[segment] >= 0, first, -1)
        same = np.zeros(len(segment), dtype=bool)
        same[:-1] = segment[1:] == segment[:-1]
        return np.where(same, np.arange(len(segment)) + 1, after)

    def _prior(self) -> Array:
        """Displacements (m, 2, 2) of the control points under the similarity of the chord."""
        o = self.original
        chord, new = o[:, 3] - o[:, 0], o[:, 3] + self.d3 - o[:, 0] - self.d0
        reach = np.linalg.norm(chord, axis=1)
        usable = reach > 0.05 * bezier.polygon_lengths(o)  # a loop's chord says nothing
        a = _complex(chord)
        z = np.divide(_complex(new), a, out=np.ones_like(a), where=usable)
        z = np.where(usable, z, 1.0)
        first = (z - 1.0) * _complex(o[:, 1] - o[:, 0])
        second = (z - 1.0) * _complex(o[:, 2] - o[:, 3])
        return np.stack([self.d0 + _vector(first), self.d3 + _vector(second)], axis=1)

    def _solve(self, mode0: Array, mode1: Array, along0: Array, along1: Array, t: Array) -> Array:
        """Fit all spans; at each end the control point is free, along a direction, or at its node."""
        m = len(self.line)
        b = bezier.basis(t)
        w, owner = self.weight, self.owner

        def total(values: Array) -> Array:
            return np.bincount(owner, w * values, minlength=m)

        # With changed parameters the original curve is no longer the samples' foot: fit to the targets.
        rest = self.target - np.einsum("rk,rkd->rd", b, self.original[owner])
        rest = rest - b[:, :1] * self.d0[owner] - b[:, 3:] * self.d3[owner]
        a11, a12, a22 = (total(b[:, p] * b[:, q]) for p, q in ((1, 1), (1, 2), (2, 2)))
        right = np.zeros((m, 4))
        for d in (0, 1):
            right[:, d] = total(b[:, 1] * rest[:, d]) + PRIOR * self.prior[:, 0, d]
            right[:, 2 + d] = total(b[:, 2] * rest[:, d]) + PRIOR * self.prior[:, 1, d]
        matrix = np.zeros((m, 4, 4))
        for d in (0, 1):
            matrix[:, d, d], matrix[:, 2 + d, 2 + d] = a11 + PRIOR, a22 + PRIOR
            matrix[:, d, 2 + d] = matrix[:, 2 + d, d] = a12
        o = self.original
        # D = fixed + basis y: what a handle along a direction starts from is its node.
        fixed, space = np.zeros((m, 4)), np.zeros((m, 4, 4))
        ends = (
            (0, mode0, along0, o[:, 0] + self.d0 - o[:, 1]),
            (2, mode1, along1, o[:, 3] + self.d3 - o[:, 2]),
        )
        for at, mode, along, to_node in ends:
            free = (mode == _FREE).astype(float)
            space[:, at, at], space[:, at + 1, at + 1] = free, free
            directed = mode == _ALONG
            space[directed, at : at + 2, at] = along[directed]
            fixed[:, at : at + 2] = np.where((mode == _FREE)[:, None], 0.0, to_node)
            offset = mode == _FIXED
            fixed[offset, at : at + 2] += along[offset]
        reduced = np.einsum("mai,mab,mbj->mij", space, matrix, space)
        unused = ~space.any(axis=1)
        reduced[:, np.arange(4), np.arange(4)] += unused
        right_reduced = np.einsum("mai,ma->mi", space, right - np.einsum("mab,mb->ma", matrix, fixed))
        y = np.linalg.solve(reduced, right_reduced[:, :, None])[:, :, 0]
        shift = fixed + np.einsum("mai,mi->ma", space, y)
        move = np.stack([self.d0, shift[:, :2], shift[:, 2:], self.d3], axis=1)
        line_move = bezier.from_line(self.d0, self.d3)
        return o + np.where(self.line[:, None, None], line_move, move)

    def _modes(self, control: Array, trust: Array) -> tuple[Array, Array, Array, Array]:
        """What the ends' control points may do, and the directions, from a free fit.

        control : (m, 4, 2) of the free fit; trust : (m,)
        """
        m, o = len(self.line), self.original
        size = bezier.polygon_lengths(o)
        mode0, mode1 = np.full(m, _FREE), np.full(m, _FREE)
        along0, along1 = np.zeros((m, 2)), np.zeros((m, 2))
        mode0[self.handles[0] <= RETRACTED * size] = _FIXED
        mode1[self.handles[1] <= RETRACTED * size] = _FIXED

        before = np.flatnonzero(self.next >= 0)
        after = self.next[before]
        t_in, t_out = end_tangents(o[before]), start_tangents(o[after])
        turn = np.angle(_complex(t_out) * np.conj(_complex(t_in)))
        usable = (np.linalg.norm(t_in, axis=1) > 0) & (np.linalg.norm(t_out, axis=1) > 0)
        smooth = usable & (np.abs(turn) < SMOOTH_ANGLE) & ~(self.line[before] & self.line[after])
        before, after, turn = before[smooth], after[smooth], turn[smooth]

        arriving, leaving = _complex(end_tangents(control[before])), _complex(start_tangents(control[after]))
        line_in, line_out = self.line[before], self.line[after]
        # Each side's estimate of the direction that a perfectly smooth node would have.
        u_in = arriving * np.exp(0.5j * turn)
        u_out = leaving * np.exp(-0.5j * turn)
        mean = trust[before] * u_in + trust[after] * u_out
        mean = mean / (trust[before] + trust[after])
        both = np.where(line_in, u_in, np.where(line_out, u_out, mean))
        usable = np.abs(both) > 1e-12 * size[before]
        before, after, turn, both = before[usable], after[usable], turn[usable], both[usable]
        unit = both / np.abs(both)
        mode1[before], mode0[after] = _ALONG, _ALONG
        along1[before] = -_vector(unit * np.exp(-0.5j * turn))
        along0[after] = _vector(unit * np.exp(0.5j * turn))
        return self._outwards(mode0, mode1, along0, along1)

    def _outwards(
        self, mode0: Array, mode1: Array, along0: Array, along1: Array
    ) -> tuple[Array, Array, Array, Array]:
        """Handles along a direction must not point backwards, nor be longer than the samples' curve can have.

        Those that would be get a fixed length.  Fixing one end of a span may turn the other, so there are two
        passes.
        """
        chord = bezier.chord_lengths(self.original)
        way = self._ways()
        for _ in range(2):
            control = self._solve(mode0, mode1, along0, along1, self.t)
            growth = np.where(chord > 0, bezier.chord_lengths(control) / np.where(chord > 0, chord, 1.0), 1.0)
            modes, alongs = (mode0, mode1), (along0, along1)
            shorts = self._too_short(control, modes, alongs, 0.1 * growth)
            longs = [
                (mode == _ALONG) & (length > LONG * np.maximum(growth * was, way))
                for mode, length, was in zip(modes, self._along(control, alongs), self.handles)
            ]
            # A retracted handle that would point backwards comes out a little instead: at its node the
            # direction would be left to the other handle.
            out = RETRACTED_OUT * bezier.chord_lengths(control)
            lengths = [
                np.maximum(np.where(long, 1.0, 0.1) * growth * was, out)
                for long, was in zip(longs, self.handles)
            ]
            fixed = [short | long for short, long in zip(shorts, longs)]
            along0, along1 = (
                np.where(which[:, None], along * length[:, None], along)
                for which, along, length in zip(fixed, alongs, lengths)
            )
            mode0, mode1 = (np.where(which, _FIXED, mode) for which, mode in zip(fixed, modes))
        return mode0, mode1, along0, along1

    def _too_short(
        self, control: Array, modes: tuple[Array, Array], alongs: tuple[Array, Array], share: Array | float
    ) -> list[Array]:
        """For both ends, which handles along a direction have less than a share of their old length."""
        return [
            (mode == _ALONG) & (length < share * was)
            for mode, length, was in zip(modes, self._along(control, alongs), self.handles)
        ]

    def _along(self, control: Array, alongs: tuple[Array, Array]) -> list[Array]:
        """How far both handles of each span reach along directions, (m,)."""
        return [
            np.einsum("md,md->m", control[:, inner] - control[:, node], along)
            for (inner, node), along in zip(_HANDLES, alongs)
        ]

    def _ways(self) -> Array:
        """Lengths (m,) of the ways from each span's moved start along its moved samples to its end."""
        m, owner = len(self.line), self.owner
        start, end = self.original[:, 0] + self.d0, self.original[:, 3] + self.d3
        points = np.concatenate([start, self.target, end])
        span = np.concatenate([np.arange(m), owner, np.arange(m)])
        order = np.argsort(span, kind="stable")  # as they are given: start, samples, end
        step = np.linalg.norm(np.diff(points[order], axis=0), axis=1)
        within = span[order][1:] == span[order][:-1]
        return np.bincount(span[order][1:][within], step[within], minlength=m)

    def _distances(self, control: Array, t: Array) -> Array:
        """Distance of each moved sample from its curve point; for lines, from the line."""
        away = bezier.evaluate(control[self.owner], t) - self.target
        chord = control[self.owner, 3] - control[self.owner, 0]
        length = np.linalg.norm(chord, axis=1)
        unit = chord / np.where(length > 0, length, 1.0)[:, None]
        across = np.abs(away[:, 0] * unit[:, 1] - away[:, 1] * unit[:, 0])
        straight = self.line[self.owner] & (length > 0)
        return np.where(straight, across, np.linalg.norm(away, axis=1))

    def _largest(self, distance: Array) -> Array:
        """The largest of the rows' values for each span."""
        result = np.zeros(len(self.line))
        np.maximum.at(result, self.owner, distance)
        return result

    def _correct_parameters(
        self, modes: tuple[Array, Array, Array, Array], distance: Array, tolerance: float
    ) -> None:
        """Where the fit is too far, look for better parameters of the same samples."""
        for _ in range(CORRECTIONS):
            far = (self._largest(distance * self.strictness) > tolerance) & ~self.line
            rows = np.flatnonzero(far[self.owner])
            if not len(rows):
                return
            t = self.t.copy()
            t[rows] = bezier.nearest_parameters(self.control[self.owner[rows]], self.target[rows], t[rows])
            control = self._solve(*modes, t)
            control = np.where(far[:, None, None], control, self.control)
            closer = self._distances(control, t)
            better = self._largest(closer * self.strictness) < self._largest(distance * self.strictness)
            better &= ~np.any(self._too_short(control, modes[:2], modes[2:], 0.0), axis=0)
            if not better.any():
                return
            self.control = np.where(better[:, None, None], control, self.control)
            self.t = np.where(better[self.owner], t, self.t)
            distance = np.where(better[self.owner], closer, distance)

    def divided(self) -> Spans:
        """The spans, those that are too far off divided at their worst sample."""
        spans = self.spans
        rank = self.worst_distance * self.strictness
        # For curves, not so near to an end that a sliver would be left.
        edge = (np.minimum(self.t, 1.0 - self.t) < 0.15) & ~self.line[self.owner] & (self.strictness == 1.0)
        rank = np.where(edge, 0.1 * rank, rank)
        rank = np.where(self.too_far[self.owner], rank, -1.0)
        order = np.lexsort((-rank, self.owner))
        _, first = np.unique(self.owner[order], return_index=True)
        cut = order[first]
        cut = cut[rank[cut] >= 0.0]
        at, sample, owner = self.row_t[cut], self.sample[cut], self.owner[cut]
        high, last = spans.high.copy(), spans.last.copy()
        high[owner], last[owner] = at, sample
        segment = np.concatenate([spans.segment, spans.segment[owner]])
        low = np.concatenate([spans.low, at])
        order = np.lexsort((low, segment))
        return Spans(
            segment[order],
            low[order],
            np.concatenate([high, spans.high[owner]])[order],
            np.concatenate([spans.first, sample])[order],
            np.concatenate([last, spans.last[owner]])[order],
        )


def start_tangents(control: Array) -> Array:
    """Directions (m, 2) in which cubics leave their start, past control points that lie on it."""
    return _first_long(control[:, 1:] - control[:, :1], bezier.polygon_lengths(control))


def end_tangents(control: Array) -> Array:
    """Directions (m, 2) in which cubics arrive at their end."""
    return _first_long((control[:, 3:] - control[:, :3])[:, ::-1], bezier.polygon_lengths(control))


def _first_long(vectors: Array, size: Array) -> Array:
    """The first of (m, 3, 2) vectors that is longer than a retracted handle."""
    long = np.linalg.norm(vectors, axis=2) > RETRACTED * size[:, None]
    pick = np.argmax(long, axis=1)
    return vectors[np.arange(len(vectors)), pick]


def _complex(vectors: Array) -> Array:
    return vectors[..., 0] + 1j * vectors[..., 1]


def _vector(z: Array) -> Array:
    return np.stack([z.real, z.imag], axis=-1)
