# SPDX-License-Identifier: GPL-2.0-or-later
"""Moved samples -> Bezier segments of the original paths.

Each original segment is fitted to its own moved samples at its own original parameters, in terms
of displacements: with Bernstein basis b, end displacements D0, D3 given and sample displacements d,

    min  sum_i w_i |b1 D1 + b2 D2 - (d_i - b0 D0 - b3 D3)|^2  +  PRIOR (|D1 - D1*|^2 + |D2 - D2*|^2)

where D* moves the control points by the similarity that carries the segment's chord.  If the move is affine,
the moved control points fit the moved samples at the original parameters.  So translations, scalings and no
move at all come back exactly, with all nodes.  The prior decides only what the samples leave undetermined: a
segment with fewer than two inner samples keeps its shape.

A second pass makes smooth nodes smooth.  Both sides take the direction that their free fits agree on, or that
of the line beside them, turned by the small corner that the input had there.  The lengths of the control arms
are fitted along it.

Where the error stays above the tolerance, first the parameters are corrected, because a curve may be
stretched unevenly and still be one cubic.  Then the segment is divided at its worst sample.  Lines stay
lines; a line that was bent becomes several.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry import bezier
from ..geometry.connected_components import components
from ..model import Array, Drawing, Refitted
from ..network.sampling import Samples
from ..network.weld import Network, parameters
from .cubic_fit import Fit, Rows, Spans

# Of the longest side: a quarter of a pixel on a 500 pixel drawing.
FIT_TOLERANCE = 5e-4

# A grabbed point inside a segment has to reach its target, and a point where something else touches the
# segment has to stay on it: both much closer than the tolerance.  Chosen by looking at the cases.
ANCHOR_WEIGHT, HANDLE_TIGHTER, TOUCHED_TIGHTER = 1e3, 20.0, 5.0

# A segment is divided in at most this many rounds, each at one sample a part.
DIVISIONS = 10


def refit(
    drawing: Drawing, network: Network, samples: Samples, moved: Array, held: Array, tolerance: float,
    add_nodes: bool = True,
) -> Refitted:  # fmt: skip
    """New segments for all of the drawing's.

    moved : (N, 2) new positions of the samples; held : (H,) int, samples that handles hold;
    tolerance : user units; add_nodes : divide segments that miss it, else each stays one
    """
    return Refit(drawing, network, samples, held, tolerance, add_nodes).fitted(moved).refitted


@dataclass(frozen=True)
class Fitted:
    """refitted : the new segments; fit : of those that moved, whose numbers in `refitted` are of_fit (m,)

    still : (M - m,) int, the vertices that carry the other segments, in their order in `refitted`, which are
        others (M - m,); resting : (M - m, 4, 2) their control points in the drawing
    """

    refitted: Refitted
    fit: Fit
    of_fit: Array
    others: Array
    still: Array
    resting: Array


class Refit:
    """The refit of a sampled drawing, for any move of its samples; the arguments are those of `refit`."""

    def __init__(
        self, drawing: Drawing, network: Network, samples: Samples, held: Array, tolerance: float,
        add_nodes: bool = True,
    ):  # fmt: skip
        self._drawing, self._network, self.samples = drawing, network, samples
        self.tolerance, self._add_nodes = tolerance, add_nodes
        self.rows = rows(drawing, network, samples)
        self._weight, self._strictness = np.ones(len(samples.points)), np.ones(len(samples.points))
        touched = _touched(network)
        self._weight[touched], self._strictness[touched] = ANCHOR_WEIGHT, TOUCHED_TIGHTER
        self._weight[held], self._strictness[held] = ANCHOR_WEIGHT, HANDLE_TIGHTER
        joined = np.flatnonzero(drawing.following >= 0)
        pairs = np.stack([joined, drawing.following[joined]], axis=1)
        _, self._subpath = components(pairs, len(drawing.control))

    def in_moved_subpaths(self, displacement: Array) -> Array:
        """Which segments, (S,) bool, are of subpaths of which a sample moved, displacement (N, 2).

        The others stay to the last bit.
        """
        rows = self.rows
        moved = np.zeros(len(self._subpath), dtype=bool)
        moved[self._subpath[rows.segment[displacement[rows.sample].any(axis=1)]]] = True
        return moved[self._subpath]

    def fitted(self, moved: Array, before: Fitted | None = None, divisions: int = DIVISIONS) -> Fitted:
        """The new segments for samples moved to (N, 2).

        before : a fit whose spans are divided further; divisions : rounds of dividing at most
        """
        drawing = self._drawing
        displacement = moved - self.samples.points
        rows = self.rows.of(self.in_moved_subpaths(displacement)[self.rows.segment])
        alive = np.unique(rows.segment)
        begin = np.searchsorted(rows.segment, alive, side="left")
        end = np.searchsorted(rows.segment, alive, side="right") - 1
        spans = Spans(alive, rows.t[begin], rows.t[end], rows.sample[begin], rows.sample[end])
        if before is not None and np.array_equal(np.unique(before.fit.spans.segment), alive):
            spans = before.fit.spans
        following = _alive_following(drawing.following, alive, len(drawing.control))

        def fit_of(spans: Spans) -> Fit:
            of_samples = (displacement, self._weight, self._strictness)
            return Fit(drawing, rows, spans, following, *of_samples, self.tolerance)

        fit = fit_of(spans)
        for _ in range(divisions if self._add_nodes else 0):
            if not fit.wrong.any():
                break
            fit = fit_of(fit.divided())
        source, count = fit.spans.segment, len(fit.spans.segment)

        # Segments that are one point of the network are carried along by it, those that stay by nothing.
        still = np.setdiff1d(np.arange(len(drawing.control)), alive)
        vertex = self._network.piece_ends[np.searchsorted(self._network.segment, still), 0]
        resting = drawing.control[still]
        order = np.argsort(np.concatenate([source, still]), kind="stable")
        place = np.argsort(order)
        refitted = Refitted(
            control=np.concatenate([fit.control, resting + displacement[vertex][:, None]])[order],
            line=np.concatenate([drawing.line[source], drawing.line[still]])[order],
            source=np.concatenate([source, still])[order],
            smooth_start=np.concatenate([fit.smooth_start, np.zeros(len(still), dtype=bool)])[order],
            error=float(fit.error.max()) if len(fit.error) else 0.0,
        )
        return Fitted(refitted, fit, place[:count], place[count:], vertex, resting)


def _touched(network: Network) -> Array:
    """Vertices in which a segment ends; not those in which segments only cross."""
    low, high = network.span.T
    return np.unique(np.concatenate([network.piece_ends[low == 0.0, 0], network.piece_ends[high == 1.0, 1]]))


def rows(drawing: Drawing, network: Network, samples: Samples) -> Rows:
    """The samples along each segment of the drawing, at the segment's own parameters."""
    pieces = np.flatnonzero(network.curve >= 0)
    curve = network.curve[pieces]
    length = np.diff(samples.chain_start)[curve]
    piece = np.repeat(np.arange(len(pieces)), length)
    place = np.arange(len(piece)) - np.repeat(np.cumsum(length) - length, length)
    slot = samples.chain_start[curve][piece] + place
    backwards = network.backwards[pieces][piece]
    fraction = np.where(backwards, 1.0 - samples.fraction[slot], samples.fraction[slot])
    span = network.span[pieces]
    own = bezier.subrange(drawing.control[network.segment[pieces]], span[:, 0], span[:, 1])
    local = parameters(own, piece, fraction, 8 + length)
    low, high = span[piece].T
    t = np.where(local >= 1.0, high, low + local * (high - low))
    segment = network.segment[pieces][piece]
    order = np.lexsort((t, segment))
    segment, t, sample = segment[order], t[order], samples.chain[slot][order]
    # Where two pieces of a segment meet their common sample is there twice.
    keep = np.ones(len(t), dtype=bool)
    keep[1:] = (segment[1:] != segment[:-1]) | (t[1:] > t[:-1])
    return Rows(segment[keep], t[keep], sample[keep])


def _alive_following(following: Array, alive: Array, count: int) -> Array:
    """The next segment of each segment's subpath that is more than a point, or -1."""
    living = np.zeros(count + 1, dtype=bool)
    living[alive] = True
    step = np.append(following, -1)  # index -1 leads to itself
    living[-1] = True
    result = step.copy()
    # Runs of points are short; a subpath of nothing but points is not asked for.
    for _ in range(64):
        dead = ~living[result]
        if not dead.any():
            break
        result[dead] = step[result[dead]]
    result[~living[result]] = -1
    return result[:-1]
