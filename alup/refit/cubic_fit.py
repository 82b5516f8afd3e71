# SPDX-License-Identifier: GPL-2.0-or-later
"""One fit of cubic segments to their moved samples, all segments at once (see `refit.py`).

With Bernstein basis b, end displacements D0, D3 given and sample displacements d,

    min  sum_i w_i |b1 D1 + b2 D2 - (d_i - b0 D0 - b3 D3)|^2  +  PRIOR (|D1 - D1*|^2 + |D2 - D2*|^2)

first freely, then with the control arms of smooth nodes along common directions.  Arms that stray are brought
back (see `control_arms.py`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry import bezier
from ..model import Array, Drawing
from .control_arms import ALONG, FIXED, FREE, Ends, Guard, as_complex, as_vector, headings

# Weight of the prior, that of a sample being 1.  It moves well-determined control points by less than 1e-7 of
# the drawing.  With a millionth of it, undetermined control points would be noise.
PRIOR = 1e-6

# Rounds of parameter correction: 4 gain nearly all that 20 do.
CORRECTIONS = 4


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

    target: Array
    weight: Array
    strictness: Array

    def __init__(
        self, drawing: Drawing, rows: Rows, spans: Spans, following: Array,
        displacement: Array,
        weight: Array,
        strictness: Array,
        tolerance: float,
    ):  # fmt: skip
        self.spans, self.tolerance = spans, tolerance
        self.line = drawing.line[spans.segment]
        self.original = bezier.subrange(drawing.control[spans.segment], spans.low, spans.high)
        whole = (spans.low == 0.0) & (spans.high == 1.0)
        self.original[whole] = drawing.control[spans.segment[whole]]
        self.d0, self.d3 = displacement[spans.first], displacement[spans.last]
        self._assign_rows(rows, displacement, weight, strictness)
        self.next = self._next_spans(following)
        guard = Guard(self.original, self.line, self.owner, self.t, self.target, self.d0, self.d3, tolerance)
        # Of a span that has all but vanished the samples are noise: the prior decides.
        self.weight = np.where(guard.vanished[self.owner], 0.0, self.weight)
        self.prior = self._prior(guard.growth)
        self.free = self._guarded(guard, guard.free())
        control = self._solve(self.free, self.t)
        # How far each fit can be trusted, where two of them disagree on a direction.
        self.trust = 1.0 / (self._largest(self._distances(control, self.t)) ** 2 + tolerance**2)
        corner = self._added_corners(guard)
        self.smooth = guard.smooth(guard.free(), control, self.next, corner, self.trust)
        self.ends = ends = self._guarded(guard, self.smooth)
        self.control = self._solve(ends, self.t)
        distance = self._distances(self.control, self.t)
        self._correct_parameters(guard, ends, distance, tolerance)
        self.worst_distance = self._distances(self.control, self.t)
        self.error = self._largest(self.worst_distance)
        self.too_far = self._largest(self.worst_distance * self.strictness) > tolerance
        inside = np.stack([spans.low > 0.0, spans.high < 1.0], axis=1)
        whole = np.where(inside, 1.0, headings(drawing.control[spans.segment]))
        fault = guard.reversed(self.control, whole) & ~guard.proven(self.error, tolerance)[:, None]
        # A span without a sample of its own can't be divided.
        barren = np.bincount(self.owner, minlength=len(self.line)) == 0
        laid = fault & barren[:, None]
        self.control = guard.unreversed(self.control, laid)
        corner[:-1] |= laid[:-1, 1] | laid[1:, 0]
        self.guard, self.corner = guard, corner
        self.reversed = (fault & ~laid).any(axis=1)

    @property
    def smooth_start(self) -> Array:
        """Which spans, (m,) bool, start at an added node through which the curve runs smoothly."""
        segment = self.spans.segment
        result = np.zeros(len(segment), dtype=bool)
        result[1:] = (segment[1:] == segment[:-1]) & ~self.line[1:] & ~self.corner[:-1]
        return result

    @property
    def wrong(self) -> Array:
        """Which spans, (m,) bool, are to be divided and can be."""
        return self.too_far | self.reversed

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

    def _added_corners(self, guard: Guard) -> Array:
        """Which spans, (m,) bool, end at an added node where the samples make a cusp."""
        segment = self.spans.segment
        before = np.flatnonzero(segment[1:] == segment[:-1])
        result = np.zeros(len(segment), dtype=bool)
        result[before] = guard.cornered(before, before + 1)
        return result

    def _prior(self, growth: Array) -> Array:
        """Displacements (m, 2, 2) of the control points under the similarity of the chord.

        growth : (m,) of the way along each span
        """
        o = self.original
        chord, new = o[:, 3] - o[:, 0], o[:, 3] + self.d3 - o[:, 0] - self.d0
        reach = np.linalg.norm(chord, axis=1)
        usable = reach > 0.05 * bezier.polygon_lengths(o)  # a loop's chord says nothing
        a = as_complex(chord)
        z = np.divide(as_complex(new), a, out=np.ones_like(a), where=usable)
        z = np.where(usable, z, growth)
        first = (z - 1.0) * as_complex(o[:, 1] - o[:, 0])
        second = (z - 1.0) * as_complex(o[:, 2] - o[:, 3])
        return np.stack([self.d0 + as_vector(first), self.d3 + as_vector(second)], axis=1)

    def _guarded(self, guard: Guard, ends: Ends) -> Ends:
        """The ends with what a fit showed to be necessary.

        Holding one end of a span may turn the other, so there are two passes.
        """
        for _ in range(2):
            for step in (guard.turned_back, guard.limited):
                control = self._solve(ends, self.t)
                proven = guard.proven(self._largest(self._distances(control, self.t)), self.tolerance)
                ends = step(ends, control, ~proven)
        return ends

    def _solve(self, ends: Ends, t: Array) -> Array:
        """Fit all spans; at each end the control point is free, along a direction, or fixed."""
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
        to_nodes = (o[:, 0] + self.d0 - o[:, 1], o[:, 3] + self.d3 - o[:, 2])
        for end, to_node in enumerate(to_nodes):
            at, mode, along = 2 * end, ends.mode[:, end], ends.along[:, end]
            free = (mode == FREE).astype(float)
            space[:, at, at], space[:, at + 1, at + 1] = free, free
            directed = mode == ALONG
            space[directed, at : at + 2, at] = along[directed]
            fixed[:, at : at + 2] = np.where((mode == FREE)[:, None], 0.0, to_node)
            offset = mode == FIXED
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

    def _correct_parameters(self, guard: Guard, ends: Ends, distance: Array, tolerance: float) -> None:
        """Where the fit is too far, look for better parameters of the same samples."""
        for _ in range(CORRECTIONS):
            far = (self._largest(distance * self.strictness) > tolerance) & ~self.line
            rows = np.flatnonzero(far[self.owner])
            if not len(rows):
                return
            t = self.t.copy()
            t[rows] = bezier.nearest_parameters(self.control[self.owner[rows]], self.target[rows], t[rows])
            control = self._solve(ends, t)
            control = np.where(far[:, None, None], control, self.control)
            closer = self._distances(control, t)
            better = self._largest(closer * self.strictness) < self._largest(distance * self.strictness)
            better &= ~guard.refused(ends, control)
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
        # Least of all where the samples have come to lie on an end: the curve is there already.
        to_end = np.minimum(
            np.linalg.norm(self.target - self.control[self.owner, 0], axis=1),
            np.linalg.norm(self.target - self.control[self.owner, 3], axis=1),
        )
        rank = np.where(to_end * self.strictness < self.tolerance, 1e-3 * rank, rank)
        # First of all at a cusp; then where the curve turns back, if that is what is wrong.
        rank = np.where(self.guard.cusp, 1e3 * rank, rank)
        behind = self.guard.behind(self.control)
        only = (self.reversed & ~self.too_far)[self.owner]
        rank = np.where(only, behind + np.abs(behind).max(initial=0.0), rank)
        rank = np.where(self.wrong[self.owner], rank, -1.0)
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
