# SPDX-License-Identifier: GPL-2.0-or-later
"""A coarser level of a round's problem: the smooth part of the solution at a quarter of the unknowns.

Some samples are kept: junctions, handles, corners, ends of straight runs.  Between them consecutive edges are
merged as long as they turn little.  Ties then end on the merged edges.  A merged edge stands for m edges of
the sampling (its *mass*, in units of L_avg).  Its energy is that of these edges when they are stretched
evenly,

    m max(1, (l/m)^2) h(phi),    (l - l0)^2 / m,

and a turn between edges of masses m, m' has the energy of (m + m')/2 turns that share its change of scale,
w_t -> 2 w_t / (mbar (m^2 + m'^2)), mbar the mean of m and m'.  Handles, straightness and ties keep their
weights.

The finer level starts at its own start plus the coarse displacements, interpolated along the curves by
cubics (Catmull-Rom), linearly where a curve has a corner or an end.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..energy.problem import Problem, length_ratio
from ..geometry.arrays import Array
from ..geometry.edges import edge_vectors

# How many edges are merged at most, and how far they may turn together.  Chosen by looking at the cases.
MERGED = 4
MERGED_TURN = np.radians(20.0)

# A coarse edge that keeps less of its length is shrunk; 0.3 and 0.8 do as well.
SHRUNK = 0.5

# Edges of no more, in L_avg, have no direction by which to turn.
NO_LENGTH = 1e-6

# A level that keeps more of the samples than this is not worth its set-up.
WORTH = 0.6


@dataclass(frozen=True)
class Level:
    """problem : the coarse problem, in the units of the fine one; kept : (n,) its samples' fine numbers."""

    problem: Problem
    kept: Array
    fine: Problem
    _group: Array  # (E,) the coarse edge of every fine one
    _edge: Array  # (N,) coarse edge on which each dropped sample lies
    _share: Array  # (N,) where on it, of its length
    _before: Array  # (e,) the coarse edge that runs into each one smoothly, or -1
    _after: Array

    def prolongations(self, v: Array) -> list[Array]:
        """Positions (N, 2) of the fine level from those (n, 2) of this one: one or three to choose from.

        Displacements are a cubic along each coarse edge, smooth through samples where the curve is.
        Beside an edge of nearly no length the cubic may overshoot and fold.  Then there are two more choices:
        linear along the edges that fold in the first one, or along these scaled as edges that shrank are.
        A curve of which only the chord shrinks would stand across it, and take hundreds of steps to turn.
        """
        coarse, fine = self.problem, self.fine
        u = v - coarse.start
        i, j = coarse.edges.T
        slope = (u[j] - u[i]) / coarse.lengths[:, None]
        at_i, at_j = slope.copy(), slope.copy()
        for end, other in ((at_i, self._before), (at_j, self._after)):
            smooth = other >= 0
            a, b = coarse.lengths[smooth, None], coarse.lengths[other[smooth], None]
            end[smooth] = (b * slope[smooth] + a * slope[other[smooth]]) / (a + b)
        result = self._interpolated(v, at_i, at_j)
        vector = edge_vectors(v, coarse.edges)[self._group]
        folded = self._group[np.einsum("ed,ed->e", edge_vectors(result, fine.edges), vector) < 0.0]
        if not len(folded):
            return [result]
        at_i[folded] = at_j[folded] = slope[folded]
        linear = self._interpolated(v, at_i, at_j)
        which = np.linalg.norm(edge_vectors(v, coarse.edges), axis=1) < SHRUNK * coarse.lengths
        which[folded] = True
        return [result, linear, self._scaled(linear, v, which & (coarse.lengths > NO_LENGTH))]

    def _scaled(self, result: Array, v: Array, which: Array) -> Array:
        """Positions (N, 2), the samples on some coarse edges, (e,) bool, turned and scaled as the edge is."""
        dropped = np.ones(len(result), dtype=bool)
        dropped[self.kept] = False
        inner = np.flatnonzero(dropped & which[self._edge])
        i, j = self.problem.edges[self._edge[inner]].T
        before, after, at = (
            np.ascontiguousarray(points).view(np.complex128).ravel()
            for points in (self.problem.start, v, self.fine.start[inner])
        )
        placed = after[i] + (after[j] - after[i]) / (before[j] - before[i]) * (at - before[i])
        result = result.copy()
        result[inner] = np.stack([placed.real, placed.imag], axis=1)
        return result

    def _interpolated(self, v: Array, at_i: Array, at_j: Array) -> Array:
        """Positions (N, 2), the displacements' slopes at the ends of the coarse edges being (e, 2)."""
        coarse, fine = self.problem, self.fine
        u = v - coarse.start
        i, j = coarse.edges.T
        dropped = np.ones(len(fine.start), dtype=bool)
        dropped[self.kept] = False
        e, t = self._edge[dropped], self._share[dropped, None]
        s = 1.0 - t
        length = coarse.lengths[e, None]
        result = fine.start.copy()
        result[self.kept] = v
        result[dropped] += (
            s * s * (1.0 + 2.0 * t) * u[i[e]]
            + t * t * (3.0 - 2.0 * t) * u[j[e]]
            + length * s * t * (s * at_i[e] - t * at_j[e])
        )
        return result


def coarsen(p: Problem) -> Level | None:
    """The next coarser level, None where it would hardly be smaller."""
    count, edges = len(p.start), p.edges
    if not len(edges):  # lone samples
        return None
    keep, runs_on, turned = _to_be_kept(p)
    first, last, group = _merge(p, keep, runs_on, turned)
    kept = np.unique(np.concatenate([np.flatnonzero(keep), edges[first, 0], edges[last, 1]]))
    if len(kept) > WORTH * count:
        return None
    number = np.full(count, -1)
    number[kept] = np.arange(len(kept))

    mass = np.asarray(np.bincount(group, p.mass), dtype=float)
    new_edges = np.stack([number[edges[first, 0]], number[edges[last, 1]]], axis=1)
    start = p.start[kept]
    vector = edge_vectors(start, new_edges)
    lengths = np.maximum(np.linalg.norm(vector, axis=1), 1e-12)
    # The input's direction of a merged edge: that of its edges, each as long as it starts.
    direction_in = np.stack([p.normals[:, 1], -p.normals[:, 0]], axis=1) * p.lengths[:, None]
    chord_in = np.stack([np.bincount(group, direction_in[:, d]) for d in (0, 1)], axis=1)
    chord_in = chord_in / np.maximum(np.linalg.norm(chord_in, axis=1), 1e-300)[:, None]

    ij, ik, weight = _turns(p, number, group, mass)
    curved = _curved(p, group, len(new_edges))
    straight, straight_ij, straight_ik = _straight(p, number, group, new_edges, curved)
    sign_a = np.where(new_edges[straight_ij, 0] == straight[:, 0], 1.0, -1.0)[:, None]
    sign_b = np.where(new_edges[straight_ik, 0] == straight[:, 0], 1.0, -1.0)[:, None]
    edge, share = _places(p, group, first)
    tie_samples, tie_factor, tie_vector = _ties(p, number, edge, share, new_edges, start)
    coarse = replace(
        p,
        start=start,
        edges=new_edges,
        normals=np.stack([-chord_in[:, 1], chord_in[:, 0]], axis=1),
        lengths=lengths,
        directions=vector / lengths[:, None],
        turn_ij=ij,
        turn_ik=ik,
        ratio=length_ratio(lengths, ij, ik),
        turn_weight=weight,
        straight=straight,
        straight_ij=straight_ij,
        straight_ik=straight_ik,
        bend=sign_a * chord_in[straight_ij] + sign_b * chord_in[straight_ik],
        handles=number[p.handles],
        tie_samples=tie_samples,
        tie_factor=tie_factor,
        tie_vector=tie_vector,
        size=np.bincount(group, p.size * p.mass) / mass,
        rest=np.asarray(np.bincount(group, p.rest), dtype=float),
        mass=mass,
    )
    before, after = _neighbours(first, last, runs_on, turned, curved)
    return Level(coarse, kept, p, group, edge, share, before, after)


def _to_be_kept(p: Problem) -> tuple[Array, Array, Array]:
    """Samples that stay, (N,); whether edge e runs on into e + 1, and how far it turns, (E - 1,)."""
    count, edges = len(p.start), p.edges
    keep = np.bincount(edges.ravel(), minlength=count) != 2
    keep[p.handles] = True
    inside = np.zeros(count, dtype=bool)
    inside[p.straight[:, 0]] = True
    border = inside[edges[:, 0]] != inside[edges[:, 1]]
    keep[edges[border].ravel()] |= ~inside[edges[border].ravel()]
    joint = edges[:-1, 1]
    runs_on = joint == edges[1:, 0]
    before, after = p.normals[:-1], p.normals[1:]
    sine = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    turned = np.abs(np.arctan2(sine, np.einsum("ed,ed->e", before, after)))
    keep[joint[runs_on & (turned > MERGED_TURN)]] = True
    # What the order of the edges does not continue is an end of its run as well.
    start, end = np.ones(len(edges), dtype=bool), np.ones(len(edges), dtype=bool)
    start[1:], end[:-1] = ~runs_on, ~runs_on
    keep[edges[start, 0]] = keep[edges[end, 1]] = True
    return keep, runs_on, turned


def _merge(p: Problem, keep: Array, runs_on: Array, turned: Array) -> tuple[Array, Array, Array]:
    """First and last edge of every merged one, (e,), and the merged edge of each edge, (E,)."""
    count = len(p.edges)
    goes_on = runs_on & ~keep[p.edges[:-1, 1]]
    run = np.concatenate([[0], np.cumsum(~goes_on)])
    begin = np.searchsorted(run, np.arange(run[-1] + 1))
    size = np.bincount(run)
    # Every edge costs a share of a merged one, and so does turning; each run is cut into equal parts.
    turning = np.concatenate([[0.0], np.where(goes_on, turned, 0.0)])
    cost = np.cumsum(1.0 / MERGED + turning / MERGED_TURN)
    spent = cost - (cost[begin] - 1.0 / MERGED - turning[begin])[run]
    total = np.maximum.reduceat(spent, begin)
    # At least two where there are two: a closed run needs three, and has three at MERGED_TURN.
    parts = np.clip(np.ceil(total - 1e-9), np.minimum(2, size), size)
    middle = spent - 0.5 / MERGED
    # An edge in the very middle of its run goes with the later half, whatever rounding says.
    part = np.minimum(np.floor(middle / total[run] * parts[run] + 1e-9), parts[run] - 1)
    new = np.ones(count, dtype=bool)
    new[1:] = (run[1:] != run[:-1]) | (part[1:] != part[:-1])
    first = np.flatnonzero(new)
    last = np.append(first[1:], count) - 1
    return first, last, np.cumsum(new) - 1


def _turns(p: Problem, number: Array, group: Array, mass: Array) -> tuple[Array, Array, Array]:
    """Turns at the samples that stay, and their weights."""
    a, b = p.edges[p.turn_ij], p.edges[p.turn_ik]
    centre = np.where((a[:, 0] == b[:, 0]) | (a[:, 0] == b[:, 1]), a[:, 0], a[:, 1])
    stays = (number[centre] >= 0) & (group[p.turn_ij] != group[p.turn_ik])
    ij, ik = group[p.turn_ij[stays]], group[p.turn_ik[stays]]
    mean = 0.5 * (mass[ij] + mass[ik])
    fine = 0.5 * (p.mass[p.turn_ij] + p.mass[p.turn_ik])
    fine = (fine * (p.mass[p.turn_ij] ** 2 + p.mass[p.turn_ik] ** 2))[stays]
    return ij, ik, p.turn_weight[stays] * fine / (mean * (mass[ij] ** 2 + mass[ik] ** 2))


def _curved(p: Problem, group: Array, count: int) -> Array:
    """Which merged edges, (e,), have a sample inside at which they are not straight."""
    inside = np.zeros(len(p.start), dtype=bool)
    inside[p.straight[:, 0]] = True
    inner = np.flatnonzero(group[1:] == group[:-1])
    curved = np.zeros(count, dtype=bool)
    curved[group[inner[~inside[p.edges[inner, 1]]]]] = True
    return curved


def _straight(
    p: Problem, number: Array, group: Array, edges: Array, curved: Array
) -> tuple[Array, Array, Array]:
    """Straight turns between merged edges that are straight themselves."""
    a, b = group[p.straight_ij], group[p.straight_ik]
    centre = number[p.straight[:, 0]]
    stays = (centre >= 0) & ~curved[a] & ~curved[b] & (a != b)
    centre, a, b = centre[stays], a[stays], b[stays]
    others = [edges[e].sum(axis=1) - centre for e in (a, b)]
    return np.stack([centre, *others], axis=1), a, b


def _ties(
    p: Problem, number: Array, edge: Array, share: Array, edges: Array, start: Array
) -> tuple[Array, Array, Array]:
    """The ties between the points of the coarse edges on which their samples lie, or between coarse samples.

    Where the two samples of a point lie on different coarse edges, as those of alignments may, each becomes
    the nearer end of its edge.  Vectors change by what the chords of the coarse edges miss at the start.
    """
    samples, factor = np.empty_like(p.tie_samples), np.empty_like(p.tie_factor)
    for end in (slice(0, 2), slice(2, 4)):
        own, weight = p.tie_samples[:, end], p.tie_factor[:, end]
        dropped = number[own] < 0
        on = edge[np.where(dropped[:, 0], own[:, 0], own[:, 1])]
        ends = number[own][:, :, None] == edges[on][:, None, :]
        together = np.where(dropped, edge[own] == on[:, None], ends.any(axis=2)).all(axis=1)
        some = dropped.any(axis=1) & together
        at = np.where(dropped, share[own], np.where(ends[:, :, 1], 1.0, 0.0))
        along = np.einsum("tk,tk->t", weight, at)
        total = weight.sum(axis=1)
        nearer = np.where(share[own] > 0.5, edges[edge[own], 1], edges[edge[own], 0])
        alone = np.where(dropped, nearer, number[own])
        samples[:, end] = np.where(some[:, None], edges[on], alone)
        factor[:, end] = np.where(some[:, None], np.stack([total - along, along], axis=1), weight)
    before = np.einsum("tk,tkd->td", p.tie_factor, p.start[p.tie_samples])
    after = np.einsum("tk,tkd->td", factor, start[samples])
    return samples, factor, p.tie_vector + after - before


def _neighbours(
    first: Array, last: Array, runs_on: Array, turned: Array, curved: Array
) -> tuple[Array, Array]:
    """For every merged edge the one before and after it, where a curve runs on smoothly, else -1."""
    smooth = runs_on[last[:-1]] & (turned[last[:-1]] <= MERGED_TURN) & curved[:-1] & curved[1:]
    number = np.arange(len(first))
    before, after = np.full(len(first), -1), np.full(len(first), -1)
    before[1:][smooth] = number[:-1][smooth]
    after[:-1][smooth] = number[1:][smooth]
    return before, after


def _places(p: Problem, group: Array, first: Array) -> tuple[Array, Array]:
    """The merged edge on which each sample lies, and the share of its length before it."""
    along = np.cumsum(p.lengths)
    whole = np.add.reduceat(p.lengths, first)
    share = (along - (along[first] - p.lengths[first])[group]) / whole[group]
    edge_of, share_of = np.zeros(len(p.start), dtype=int), np.zeros(len(p.start))
    edge_of[p.edges[:, 1]], share_of[p.edges[:, 1]] = group, share
    return edge_of, share_of
