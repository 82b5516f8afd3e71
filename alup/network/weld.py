# SPDX-License-Identifier: GPL-2.0-or-later
"""Curves of the drawing -> one welded curve network.

An SVG file stores stacked shapes.  The border between two regions is stored twice, a corner of three regions
three times, and a stripe ends on an edge that has no node there.  The energy is defined on a *network*, in
which such a border is one curve.  Welding makes the network:

1. segments are cut where they touch (`contacts.py`): at nodes of others, at the ends of overlaps, and
   optionally at crossings;
2. end points of pieces that touch become one vertex;
3. pieces shorter than the snap distance collapse to a vertex, which moves them as a whole;
4. pieces with the same two vertices and the same geometry, in either direction, become one curve.

Each segment of the drawing then consists of *pieces*, each of which lies on one curve of the network,
forwards or backwards.  The drawing itself is not changed.  Results are displacements, so welded points keep
the small distances that they had.

A curve that was cut continues *through* the cut, where it is as smooth or as straight as before.  The paper
makes every vertex of valence above two a corner, where scale may change abruptly.  In stacked shapes most of
these vertices are invisible, such as a crossing under a filled shape, or a stripe that ends on a border.  A
border whose scale jumps there looks broken.  So only curves that end at a vertex have a corner there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable

import numpy as np

from ..geometry import bezier
from ..geometry.arrays import Bools, Floats, Ints
from ..messages.errors import DocumentError
from ..messages.language import translate as _
from ..model import Array, Drawing
from . import contacts, splits

# Of the diagonal.  Files are written with three to six decimals, and rounding leaves gaps and closing
# segments of up to 4e-5 of the diagonal.  Intended distances are above 1e-3.
SNAP_DISTANCE = 5e-5

# A cubic counts as a straight line if its control points are this near to its chord.  A sagitta below 1e-4 of
# the length is invisible; below 1e-5 of the diagonal it is rounding.
STRAIGHT_OF_CHORD = 1e-4
STRAIGHT_OF_DIAGONAL = 1e-5

# A drawing smaller than this part of its coordinates has too few digits.  At a tenth of it results have
# errors of 1e-2 of the diagonal, at a hundredth samples coincide.  Below SMALLEST the squares of lengths
# underflow.
SMALLEST_OF_COORDINATES, SMALLEST = 1e-10, 1e-100

KINDS = {"t_junctions": splits.T_JUNCTION, "overlaps": splits.OVERLAP, "crossings": splits.CROSSING}

# Points at which two curves between the same vertices are compared, in fractions of their arc length.
_PROBES = np.array([0.2, 0.4, 0.5, 0.6, 0.8])

# Curves in one batch of `_probes`: the temporaries fit into the cache, and memory is bounded.
_BATCH = 1 << 12


@dataclass(frozen=True)
class Network:
    """A welded curve network and how the drawing's segments run along it.

    vertices : (n, 2) positions of the welded end points, user units
    curves : (C, 4, 2) control points of the distinct curves
    ends : (C, 2) int, the vertices of each curve's start and end
    straight : (C,) bool, lines and cubics that are lines
    segment : (P,) int, the segment of the drawing that each piece is part of, ascending
    span : (P, 2) the piece's range of that segment's parameter
    curve : (P,) int, the curve that the piece runs along; -1 for a piece that is one point
    backwards : (P,) bool
    piece_ends : (P, 2) int, vertices of the piece's own start and end
    through : (T, 3) int, a vertex and two curves that were one curve of the drawing before it was cut there
    contacts : number of cuts of each kind; complete : False if the search for crossings was ended early
    """

    vertices: Floats
    curves: Floats
    ends: Ints
    straight: Bools
    segment: Ints
    span: Floats
    curve: Ints
    backwards: Bools
    piece_ends: Ints
    through: Ints
    contacts: dict[str, int]
    complete: bool = True


def build(
    drawing: Drawing,
    tolerance: float,
    crossings: bool = True,
    stop: Callable[[int], bool] | None = None,
) -> Network:
    """Weld the drawing's segments into a network.

    tolerance : the snap distance, user units; crossings : whether they become vertices
    stop : see `contacts.contacts`; if it ends the search, the network has no crossings
    Raises DocumentError for a drawing that is too small for the digits of its coordinates.
    """
    largest, longest = float(np.abs(drawing.bounds).max()), float(drawing.size.max())
    if longest < max(SMALLEST, SMALLEST_OF_COORDINATES * largest):
        raise DocumentError(
            _(
                "The selected paths are too small for their coordinates: they measure {size:.1g} and lie at "
                "{place:.1g} (user units). Enlarge them, or move them to the corner of the page."
            ).format(size=longest, place=largest)
        )
    found = contacts.contacts(drawing.control, drawing.line, tolerance, crossings=crossings, stop=stop)
    control, segment, span = splits.split(drawing.control, drawing.line, found)
    pieces = len(control)
    vertices, piece_ends = _vertices(control, _points(found, segment))
    collapsed = (piece_ends[:, 0] == piece_ends[:, 1]) & (bezier.polygon_lengths(control) <= 2.0 * tolerance)
    whole = bezier.straight(drawing.control, STRAIGHT_OF_CHORD, STRAIGHT_OF_DIAGONAL * drawing.diagonal)
    straight = (drawing.line | whole)[segment]
    alive = np.flatnonzero(~collapsed)
    representative, backwards = _identical(control[alive], piece_ends[alive], straight[alive], tolerance)
    own, index = np.unique(representative, return_inverse=True)
    curve = np.full(pieces, -1)
    curve[alive] = index
    reverse = np.zeros(pieces, dtype=bool)
    reverse[alive] = backwards
    first = alive[own]
    return Network(
        vertices=vertices,
        curves=control[first],
        ends=piece_ends[first],
        straight=straight[first],
        segment=segment,
        span=span,
        curve=curve,
        backwards=reverse,
        piece_ends=piece_ends,
        through=_through(segment, curve, piece_ends),
        contacts={name: int(np.sum(found.kind == kind)) for name, kind in KINDS.items()},
        complete=found.complete,
    )


def _points(found: splits.Contacts, segment: Array) -> Array:
    """The number of the point, as in the contacts, at each piece's two ends, (P, 2)."""
    pieces = len(segment)
    first = np.ones(pieces, dtype=bool)
    first[1:] = segment[1:] != segment[:-1]
    last = np.append(first[1:], True)
    result = np.empty((pieces, 2), dtype=int)
    result[first, 0], result[last, 1] = found.end[0::2], found.end[1::2]
    # The cuts are sorted as the pieces are, and each is the start of one and the end of another.
    result[~first, 0] = result[~last, 1] = found.group
    return result


def _vertices(control: Array, point: Array) -> tuple[Array, Array]:
    """Positions (n, 2) of the points, and the vertex of each piece's end (P, 2)."""
    ends = control[:, [0, 3]].reshape(-1, 2)
    _, first, label = np.unique(point.ravel(), return_index=True, return_inverse=True)
    # Number the vertices in the order of the drawing, so that equal drawings give equal networks.
    rank = np.empty(len(first), dtype=int)
    rank[np.argsort(first)] = np.arange(len(first))
    label = rank[label.ravel()]
    size = np.bincount(label)
    vertices = np.stack([np.bincount(label, ends[:, d]) for d in (0, 1)], axis=1) / size[:, None]
    return vertices, label.reshape(-1, 2)


def _through(segment: Array, curve: Array, piece_ends: Array) -> Array:
    """Vertices where a segment continues from one curve to the next, and the two curves, (T, 3)."""
    alive = np.flatnonzero(curve >= 0)
    before, after = alive[:-1], alive[1:]
    same = (segment[before] == segment[after]) & (piece_ends[before, 1] == piece_ends[after, 0])
    before, after = before[same], after[same]
    pairs = np.sort(np.stack([curve[before], curve[after]], axis=1), axis=1)
    # The same curve twice means that the segment turns back on itself: it does not continue.
    rows = np.column_stack([piece_ends[after, 0], pairs])[pairs[:, 0] != pairs[:, 1]]
    return np.unique(rows, axis=0)


def _identical(control: Array, ends: Array, straight: Array, tolerance: float) -> tuple[Array, Array]:
    """For each piece the first piece with the same geometry, (n,), and whether it is reversed, (n,) bool.

    control : (n, 4, 2); ends : (n, 2) vertices; straight : (n,) bool; tolerance : user units
    Pieces are compared with the first one between the same two vertices.  Those that differ are compared
    among themselves in the next pass.  There are as many passes as there are curves between any two vertices.
    """
    representative = np.arange(len(control))
    backwards = np.zeros(len(control), dtype=bool)
    low, high = ends.min(axis=1), ends.max(axis=1)
    key = low * (int(high.max(initial=0)) + 1) + high
    _, group, members = np.unique(key, return_inverse=True, return_counts=True)
    group = group.ravel()
    # Most pieces are the only ones between their vertices, and need no comparison.
    open_ = np.flatnonzero(members[group] > 1)
    probe = np.cumsum(members[group] > 1) - 1
    probes = _probes(control[open_])
    # Ends may differ by a tolerance each, and a probe may be shifted along the curve.
    limit = 3.0 * tolerance
    while len(open_):
        _, first, inverse = np.unique(group[open_], return_index=True, return_inverse=True)
        lead = open_[first][inverse.ravel()]
        a, b = probes[probe[open_]], probes[probe[lead]]
        both = straight[open_] & straight[lead] & (low[open_] != high[open_])
        same_direction = np.abs(a - b).max(axis=(1, 2)) <= limit
        reversed_direction = np.abs(a - b[:, ::-1]).max(axis=(1, 2)) <= limit
        same_direction &= (ends[open_] == ends[lead]).all(axis=1)
        reversed_direction &= (ends[open_] == ends[lead][:, ::-1]).all(axis=1) & ~same_direction
        facing = (ends[open_] == ends[lead]).all(axis=1)
        same_direction |= both & facing
        reversed_direction |= both & ~facing
        found = same_direction | reversed_direction
        representative[open_[found]] = lead[found]
        backwards[open_[found]] = reversed_direction[found]
        open_ = open_[~found]
    return representative, backwards


def _probes(control: Array) -> Array:
    """Points of curves (C, 4, 2) at the fractions _PROBES of their lengths, (C, k, 2)."""
    found = np.empty((len(control), len(_PROBES), 2))
    for n in range(0, len(control), _BATCH):
        some = control[n : n + _BATCH]
        t = parameters_at(some, np.tile(_PROBES, (len(some), 1)))
        found[n : n + _BATCH] = bezier.evaluate(some[:, None], t)
    return found


def parameters_at(control: Array, fraction: Array, intervals: int = 16) -> Array:
    """Parameters at fractions of the arc length.  control : (C, 4, 2), fraction : (C, k) -> (C, k)."""
    owner = np.repeat(np.arange(len(control)), fraction.shape[1])
    return parameters(control, owner, fraction.ravel(), np.full(len(control), intervals)).reshape(
        fraction.shape
    )


def parameters(control: Array, owner: Array, fraction: Array, intervals: Array) -> Array:
    """Parameters of points given by their fraction of the arc length.

    control : (C, 4, 2); owner : (M,) the curve of each point; fraction : (M,) in [0, 1];
    intervals : (C,) int, entries of the arc-length table.  Returns (M,); 0 and 1 stay 0 and 1.

    The table of arc lengths is inverted linearly.  Two Newton steps correct the result within its interval,
    where the speed is interpolated quadratically from both ends and the middle.
    """
    start, t, s = bezier.arc_length_table(control, intervals)
    total = s[start[1:] - 1]
    total = np.where(total > 0.0, total, 1.0)
    # One ascending array for all curves: the curve's number plus the fraction.
    table = s / total[np.repeat(np.arange(len(control)), intervals + 1)]
    ramp = table + np.repeat(2.0 * np.arange(len(control)), intervals + 1)
    slot = np.searchsorted(ramp, fraction + 2.0 * owner, side="right") - 1
    slot = np.clip(slot, start[owner], start[owner + 1] - 2)
    low, high = table[slot], table[slot + 1]
    width = high - low
    share = np.divide(fraction - low, width, out=np.zeros_like(fraction), where=width > 0.0)
    # Within the interval solve s(u) = integral of the quadratic through the three speeds.
    t0, dt = t[slot], t[slot + 1] - t[slot]
    own = control[owner]
    v0, v1, v2 = (np.linalg.norm(bezier.derivative(own, t0 + q * dt), axis=-1) for q in (0.0, 0.5, 1.0))
    b, c = -3.0 * v0 + 4.0 * v1 - v2, 2.0 * v0 - 4.0 * v1 + 2.0 * v2
    whole = v0 + b / 2.0 + c / 3.0
    u = share.copy()
    for _step in range(2):
        gone = u * (v0 + u * (b / 2.0 + u * c / 3.0)) - share * whole
        speed = v0 + u * (b + u * c)
        usable = speed > 0.05 * np.abs(whole)
        u = np.clip(u - np.divide(gone, speed, out=np.zeros_like(u), where=usable), 0.0, 1.0)
    result = t0 + u * dt
    return np.where(fraction <= 0.0, 0.0, np.where(fraction >= 1.0, 1.0, result))
