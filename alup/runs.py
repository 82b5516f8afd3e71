"""Straight runs: keeping lines exactly straight while they turn and stretch.

Straightness has the weight w_s = 1e4, so a step that turns a line and stretches it unevenly, and that is
straight to first order only, is refused for its second order.  The remedy is a retraction: after a step, the
inner samples of each run of straight turns are moved onto the chord of its two ends, at their
projections.  It changes the step by its second order, and nothing at all where the line is straight.
"""

from __future__ import annotations

import numpy as np

from .components import components
from .model import Array
from .problem import Problem

# A straight turn whose input bend is less than this belongs to a run; others are left to their weight.
EXACTLY_STRAIGHT = 1e-7


class StraightRuns:
    """inner : (m,) samples inside runs; first, last : (m,) the samples at the ends of their run."""

    def __init__(self, problem: Problem):
        count = len(problem.start)
        exact = np.linalg.norm(problem.bend, axis=1) < EXACTLY_STRAIGHT
        inside = np.zeros(count, dtype=bool)
        inside[problem.straight[exact, 0]] = True
        line = np.zeros(len(problem.edges), dtype=bool)
        line[problem.straight_ij[exact]] = line[problem.straight_ik[exact]] = True
        start, end = problem.edges[line].T
        _, run = components(problem.edges[line][inside[start] & inside[end]], count)
        # Edges that lead out of a run, seen from inside; a run has two of them.
        leaving = inside[start] != inside[end]
        inner = np.where(inside[start], start, end)[leaving]
        outer = np.where(inside[start], end, start)[leaving]
        order = np.argsort(run[inner], kind="stable")
        inner, outer = inner[order], outer[order]
        label, at, times = np.unique(run[inner], return_index=True, return_counts=True)
        whole = times == 2
        ends = np.full((count, 2), -1)
        ends[label[whole], 0], ends[label[whole], 1] = outer[at[whole]], outer[at[whole] + 1]
        self.inner = np.flatnonzero(inside & (ends[run, 0] >= 0))
        self.first, self.last = ends[run[self.inner]].T

    def retract(self, v: Array) -> Array:
        """Positions (N, 2) with every run on its chord."""
        v = v.copy()
        origin = v[self.first]
        chord = v[self.last] - origin
        square = np.maximum(np.einsum("md,md->m", chord, chord), 1e-300)
        share = np.einsum("md,md->m", v[self.inner] - origin, chord) / square
        v[self.inner] = origin + share[:, None] * chord
        return v
