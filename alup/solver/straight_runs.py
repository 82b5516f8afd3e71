# SPDX-License-Identifier: GPL-2.0-or-later
"""Straight runs: keeping lines exactly straight while they turn and stretch.

A step that turns a line and stretches it unevenly keeps it straight to first order only.  Straightness has
the weight w_s = 1e4, so the second-order bend would raise F, and the step would be refused.  The remedy is a
retraction: after a step, the inner samples of each run of straight turns are projected onto the chord of its
two ends.  This changes the step in second order, and not at all where the line is straight.

A handle inside a run keeps its position.  The ends of such a run are first shifted across the line so that
the chord passes through the handle; with two handles the chord is shifted and turned.
"""

from __future__ import annotations

import numpy as np

from ..energy.problem import Problem
from ..geometry.arrays import Array
from ..geometry.connected_components import components

# A straight turn whose input bend is less than this belongs to a run; others are left to their weight.
EXACTLY_STRAIGHT = 1e-7


class StraightRuns:
    """inner : (m,) samples inside runs; first, last : (m,) the samples at the ends of their run.

    pinned : (h,) handles on runs that have one inside, ends included; pinned_run : (h,) their numbers among
    pinned_first, pinned_last : (r,) the ends of these runs
    """

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
        held = np.zeros(count, dtype=bool)
        held[problem.handles] = True
        touched, run_of = np.unique(run[self.inner[held[self.inner]]], return_inverse=True)
        self.pinned_first, self.pinned_last = ends[touched].T
        number = np.arange(len(touched))
        on_ends = [(end[held[end]], number[held[end]]) for end in (self.pinned_first, self.pinned_last)]
        self.pinned = np.concatenate([self.inner[held[self.inner]], *(end for end, _ in on_ends)])
        self.pinned_run = np.concatenate([run_of.ravel(), *(which for _, which in on_ends)])
        self._held = held
        self.inner, self.first, self.last = (
            part[~held[self.inner]] for part in (self.inner, self.first, self.last)
        )

    def retract(self, v: Array) -> Array:
        """Positions (N, 2) with every run on its chord."""
        v = v.copy()
        if len(self.pinned):
            self._pass_through_handles(v)
        origin = v[self.first]
        chord = v[self.last] - origin
        square = np.maximum(np.einsum("md,md->m", chord, chord), 1e-300)
        share = np.einsum("md,md->m", v[self.inner] - origin, chord) / square
        v[self.inner] = origin + share[:, None] * chord
        return v

    def _pass_through_handles(self, v: Array) -> None:
        """Shift the ends of runs with handles inside, in place."""
        run, count = self.pinned_run, len(self.pinned_first)
        origin = v[self.pinned_first]
        chord = v[self.pinned_last] - origin
        chord /= np.maximum(np.einsum("rd,rd->r", chord, chord), 1e-300)[:, None]
        to_handle = v[self.pinned] - origin[run]
        s = np.einsum("hd,hd->h", to_handle, chord[run])
        across = to_handle - s[:, None] * (v[self.pinned_last] - origin)[run]
        # Least squares of across = a + b s, with b = 0 for a single handle.
        n, sum_s, sum_ss = (np.bincount(run, power, count) for power in (s**0, s, s * s))
        spread = n * sum_ss - sum_s**2
        single = spread <= 1e-9
        sums = np.stack([np.bincount(run, across[:, d], count) for d in (0, 1)], axis=1)
        products = np.stack([np.bincount(run, s * across[:, d], count) for d in (0, 1)], axis=1)
        slope = (n[:, None] * products - sum_s[:, None] * sums) / np.where(single, 1.0, spread)[:, None]
        slope[single] = 0.0
        level = (sums - sum_s[:, None] * slope) / n[:, None]
        for end, shift in ((self.pinned_first, level), (self.pinned_last, level + slope)):
            free = ~self._held[end]
            v[end[free]] += shift[free]
