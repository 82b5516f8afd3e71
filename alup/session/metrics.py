# SPDX-License-Identifier: GPL-2.0-or-later
"""Measures of a reshape's quality, for every method: the criteria of the paper's Sec. 3.1.

All are functions of the samples before and after, (N, 2) each.  Angles are in degrees, distances in parts of
the input's diagonal.  Averages are weighted by lengths in the input, so that they do not depend on how the
curves were cut.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..energy.problem import SHORTEST_EDGE, network_turns
from ..geometry.connected_components import components
from ..geometry.edges import crossing_edges, edge_vectors
from ..handles.binding import Anchors
from ..model import Array
from ..network.sampling import Graph
from ..ties.facing import Facing


def report(samples: Graph, after: Array, anchors: Anchors, facing: Facing, diagonal: float) -> dict[str, Any]:
    """All measures that need no exact solution, ready for JSON.

    after : (N, 2); diagonal : of the drawing, user units
    """
    before, edges = samples.points, samples.edges
    return {
        "handle_error_of_diagonal": handle_error(after, anchors.samples, anchors.targets, diagonal),
        "turning_degrees": turning(before, after, edges),
        "scale_gradient": scale_gradient(samples, after, diagonal),
        "straightness_degrees": straightness(before, after, samples.straight_turns),
        "new_crossings": new_crossings(before, after, edges),
        "bands": bands(samples, after, facing, diagonal),
    }


# A band is at most BAND wide, in diagonals.  It is kept if its width changes by no more than the part
# BAND_CHANGE.  Both were chosen by looking at the cases.
BAND, BAND_CHANGE = 0.02, 0.5


def bands(samples: Graph, after: Array, facing: Facing, diagonal: float) -> dict[str, float]:
    """How much of the narrow bands between facing curves kept their width.

    The two contours of an outline bound a band, and so do a highlight and the edge beside it.  A curve has a
    band where another curve faces it within BAND.  The width after is the new offset's component along the
    old offset; it is negative if the sides are exchanged.  The band is kept where this width equals the old
    width, or the old width times the growth of the curve, to the part BAND_CHANGE.
    Returns kept : share of the bands' length, 1 without bands; length : the bands' share of all length.
    """
    before, edges = samples.points, samples.edges
    length = np.linalg.norm(edge_vectors(before, edges), axis=1)
    now = np.linalg.norm(edge_vectors(after, edges), axis=1)
    own, grown = np.zeros(len(before)), np.zeros(len(before))
    for end in (0, 1):
        own += np.bincount(edges[:, end], 0.5 * length, len(before))
        grown += np.bincount(edges[:, end], 0.5 * now, len(before))
    near = facing.of(facing.distance <= BAND * diagonal)
    start, end = edges[near.edge].T
    share = near.share[:, None]
    offset, moved = ((1.0 - share) * v[start] + share * v[end] - v[near.sample] for v in (before, after))
    width = np.einsum("fd,fd->f", offset, moved) / near.distance
    growth = grown[near.sample] / np.maximum(own[near.sample], 1e-300)
    change = np.minimum(np.abs(width - near.distance), np.abs(width - growth * near.distance))
    # A change is invisible in a very narrow band, so a fifth of BAND is the least width that it is compared
    # with.
    lost = change > BAND_CHANGE * np.maximum(near.distance, 0.2 * BAND * diagonal)
    weight = own[near.sample]
    # A curve with a band on both sides counts as one length for each.
    whole = float(weight.sum())
    kept = 1.0 - float(weight[lost].sum()) / whole if whole > 0.0 else 1.0
    of_all = float(own[np.unique(near.sample)].sum() / max(own.sum(), 1e-300))
    return {"kept": kept, "length": of_all}


def handle_error(after: Array, handles: Array, targets: Array, diagonal: float) -> float:
    """The greatest distance of a handle from its target, in diagonals.

    after : (N, 2); handles : (H,) int, samples; targets : (H, 2); diagonal : user units
    """
    return float(np.linalg.norm(after[handles] - targets, axis=1).max(initial=0.0)) / diagonal


def turning(before: Array, after: Array, edges: Array) -> dict[str, float]:
    """The angles by which the tangents turned, in degrees: mean weighted by the input's lengths, and largest.

    before, after : (N, 2) samples; edges : (E, 2) int
    """
    a, b = edge_vectors(before, edges), edge_vectors(after, edges)
    angle = np.abs(_angle(a, b))
    length = np.linalg.norm(a, axis=1)
    return {"mean": float(np.average(angle, weights=length)), "max": float(angle.max())}


def scale_gradient(samples: Graph, after: Array, diagonal: float) -> dict[str, float]:
    """How fast the scale s = l / l0 changes along the curves: |ds/du| times the diagonal, rms and largest.

    At every turn that is no visible corner, ds/du is the difference of the scales of its two edges over the
    distance of their midpoints.  The root mean square is taken, because the mean of |ds/du| is the total
    change of scale, whether that is abrupt or gradual, and people draw gradual changes.  Where the scale
    jumps, both measures grow with the density of the samples: compare at one spacing.
    """
    turns = network_turns(samples)
    length = np.linalg.norm(edge_vectors(samples.points, samples.edges), axis=1)
    scale = np.linalg.norm(edge_vectors(after, samples.edges), axis=1) / np.maximum(length, 1e-300)
    # An edge without length has no scale.
    known = length > SHORTEST_EDGE * length.mean()
    once = turns.smooth & (turns.ij < turns.ik) & known[turns.ij] & known[turns.ik]
    a, b = turns.ij[once], turns.ik[once]
    if not len(a):
        return {"rms": 0.0, "max": 0.0}
    apart = 0.5 * (length[a] + length[b])
    gradient = np.abs(scale[a] - scale[b]) / apart * diagonal
    return {"rms": float(np.sqrt(np.average(gradient**2, weights=apart))), "max": float(gradient.max())}


def straightness(before: Array, after: Array, straight_turns: Array) -> dict[str, float]:
    """How much straight lines bent, in degrees, relative to the input.

    straight_turns : (K, 3) int, samples i, j, k of each turn, i in the middle
    Returns mean, max : the bend of single turns, the mean weighted by lengths; line : the greatest difference
    of the angles by which two edges of one line turned.  A line deformed into an arc of 90 degrees may bend
    by one degree at each turn; as a line it bends by 90.
    """
    if not len(straight_turns):
        return {"mean": 0.0, "max": 0.0, "line": 0.0}
    i, j, k = straight_turns.T
    # The two edges of each turn, both directed along the way from j over i to k.
    old_in, old_out = before[i] - before[j], before[k] - before[i]
    new_in, new_out = after[i] - after[j], after[k] - after[i]
    bend = _wrapped(_angle(new_in, new_out) - _angle(old_in, old_out))
    length = np.linalg.norm(old_in, axis=1) + np.linalg.norm(old_out, axis=1)
    mean, most = float(np.average(np.abs(bend), weights=length)), float(np.abs(bend).max())

    count = len(before)
    ends = np.sort(np.concatenate([straight_turns[:, [0, 1]], straight_turns[:, [0, 2]]]), axis=1)
    edges, edge = np.unique(ends[:, 0] * count + ends[:, 1], return_inverse=True)
    edges = np.stack([edges // count, edges % count], axis=1)
    lines, line = components(edge.reshape(2, -1).T, len(edges))
    turned = _angle(edge_vectors(before, edges), edge_vectors(after, edges))
    # Angles are relative to the line's first edge, so that a line turned by 180 degrees has no jump.
    _, first = np.unique(line, return_index=True)
    turned = _wrapped(turned - turned[first][line])
    low, high = np.full(lines, np.inf), np.full(lines, -np.inf)
    np.minimum.at(low, line, turned)
    np.maximum.at(high, line, turned)
    return {"mean": mean, "max": most, "line": float((high - low).max())}


def new_crossings(before: Array, after: Array, edges: Array) -> int:
    """The number of pairs of edges (E, 2) that cross after the run and did not cross before.

    before, after : (N, 2).  `alup.network.open_crossings` gives two parts coincident samples where they
    cross.  After the run these parts may cross beside the samples.  So for each pair of parts as many
    crossings as there were coincident samples are not counted as new.
    """
    new = np.setdiff1d(crossing_edges(after, edges), crossing_edges(before, edges))
    parts, label = components(edges, len(before))

    def of_parts(pairs: Array) -> Array:
        """A number (m,) that identifies the two parts of each pair of samples (m, 2)."""
        return np.sort(label[pairs], axis=1) @ [parts, 1]

    _, place = np.unique(before, axis=0, return_inverse=True)
    order = np.argsort(place.ravel(), kind="stable")
    same = np.flatnonzero(np.diff(place.ravel()[order]) == 0)
    were = np.sort(of_parts(np.stack([order[same], order[same + 1]], axis=1)))
    are = of_parts(edges[np.stack(np.divmod(new, len(edges)), axis=1), 0])
    pairs, count = np.unique(are, return_counts=True)
    old = np.searchsorted(were, pairs, side="right") - np.searchsorted(were, pairs)
    return int(np.maximum(count - old, 0).sum())


def distance_to_exact(after: Array, exact: Array, edges: Array, diagonal: float) -> dict[str, float]:
    """The distance of the samples from the exact shape, in diagonals: rms and largest.

    after : (N, 2); exact : (N, 2), whose edges (E, 2) make the exact shape; diagonal : user units
    The distance is to the nearest edge, so a sample that slid along its curve is no error.  On curves the
    edges are chords, whose error is an eighth of the squared spacing over the radius.
    """
    from scipy.spatial import cKDTree

    start, vector = exact[edges[:, 0]], edge_vectors(exact, edges)
    middle, reach = start + 0.5 * vector, 0.5 * float(np.linalg.norm(vector, axis=1).max())
    # The nearest edge has its middle within half an edge of the nearest sample's distance.
    near, _ = cKDTree(exact).query(after)
    candidates = cKDTree(middle).query_ball_point(after, near + reach + 1e-12 * diagonal)
    count = np.array([len(one) for one in candidates])
    sample = np.repeat(np.arange(len(after)), count)
    edge = np.concatenate([np.asarray(one, dtype=int) for one in candidates])
    offset = after[sample] - start[edge]
    square = np.maximum(np.einsum("ed,ed->e", vector[edge], vector[edge]), 1e-300)
    along = np.clip(np.einsum("ed,ed->e", offset, vector[edge]) / square, 0.0, 1.0)
    away = np.full(len(after), np.inf)
    np.minimum.at(away, sample, np.linalg.norm(offset - along[:, None] * vector[edge], axis=1))
    away = away / diagonal
    return {"rms": float(np.sqrt(np.mean(away**2))), "max": float(away.max())}


def _angle(a: Array, b: Array) -> Array:
    """Signed angles (n,) from vectors a to b (n, 2), in degrees between -180 and 180."""
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return np.degrees(np.arctan2(cross, np.einsum("nd,nd->n", a, b)))


def _wrapped(degrees: Array) -> Array:
    """The same angles, reduced to between -180 and 180 degrees."""
    return (degrees + 180.0) % 360.0 - 180.0
