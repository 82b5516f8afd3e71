# SPDX-License-Identifier: GPL-2.0-or-later
"""Ties: what lies side by side stays together, though no curve joins it.

The paper's energy is defined on curves only.  But an outline drawn as two contours has a thickness, a
highlight lies on a bottle, and two faces that are 1e-3 apart share a border.  A *tie* joins a sample to the
point of another curve that faces it (`alup.ties.facing`).  Let r be the change of the offset between the two,
d the offset's direction in the input and L its length.  The energy of the tie is

    w / L^2  ( (d . r)^2 + SLIDE (d_perp . r)^2 )

so curves slide along each other more easily than they part.  All parts are solved together with their ties.

*Weights* (`tie_weights`).  w is STRENGTH up to a length of REACH spacings, and falls with its fourth power
beyond.

*Letting go.* A tie between points that handles pull apart would drag its surroundings along.  Therefore its
weight is divided by (1 + (e/h)^2)^2, with the strain e = |r|/L.  h is HOLDS for near ties and grows with the
length of longer ones.  This is done when the coarse levels have found the shape, and again before the final
round.

*Groups* (`groups`).  Parts joined by near ties, or ties not much longer, are a group.  Parts of a group
without any handle keep their size.  Their ties to what is farther than REACH have the small weight GENTLE and
never let go; they only place the group.  Their weight falls so slowly with the distance that a row of windows
spreads evenly.

*Sizes.* In a group with a handle, parts without one keep their size weakly.  So do parts that their own
handles only shift.  A curve beside another one that is fewer ties away from a handle takes the size of that
one instead: the inner contour of an outline follows the outer contour.

*Crossings.* Parts that cross (`alup.network.open_crossings`) are joined there by ties that never let go, and
belong to one group.  They keep their size less firmly than others, because one may be a stick that joins two
objects.  If handles move two of them apart, one of them has to stretch, and hardly keeps its size.

*Offsets without energy* (`axis_maps`).  A tie holds an offset.  If the whole drawing grows, offsets grow as
well: see `common_growth`.  Handles of a part may ask for a map without distortion, a uniform scaling or an
axis-aligned stretch of axis-aligned lines.  Ties between two such parts take their offsets from these maps.

*Backgrounds* (`backgrounds`).  Parts that cover the page stay.

All constants of ties were chosen by looking at pictures of 127 drawings.  Tried and rejected:
* ties along all sides of the triangulation: diagonals resist a stretch;
* one exponent for all ties: windows stay behind, or a house's walls slant;
* letting go as a term of the energy: a hundred iterations instead of ten;
* no sliding: more turning;
* STRENGTH 3: outlines get corners, and no more bands are kept; 0.1: roofs part from walls;
* the inner contour of an outline keeps its size: rings get corners;
* ties at crossings that let go: limbs come off;
* crossings as one point: wheels grow with the truck; crossings without ties: sticks leave their heads.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..geometry.arrays import Array
from ..model import Ties
from ..network.sampling import Samples
from . import scaffold
from .axis_maps import EXACT, AxisMaps, common_growth, mean_moves, part_maps, slanted_parts
from .backgrounds import enclosing_parts, page_filling_parts
from .facing import Facing, facing
from .groups import (
    REACH_OF_GROUP,
    SIZE,
    SIZE_IN_GROUP,
    farther_parts,
    following,
    held_parts,
    size_limits,
    steps_to_handles,
)
from .tie_weights import (
    FARTHEST,
    crossing_ties,
    facing_ties,
    near_lengths,
    placing_ties,
    scaffold_sides,
    thinned,
)


@dataclass(frozen=True)
class Surroundings:
    """The neighbourhood of the samples.

    sides : (m, 2) samples, sides of their triangulation; spacing : the median edge, user units
    facing : the points that face each sample
    """

    sides: Array
    spacing: float
    facing: Facing


@dataclass(frozen=True)
class RoundTies:
    """The ties of a round.

    ties : of all samples; size : (E,) weight of E_size; growth : of the whole drawing, see `common_growth`
    stays : (C,) bool, parts that are not moved; facing : number of ties between facing points
    """

    ties: Ties
    size: Array
    growth: float
    stays: Array
    facing: int


@dataclass(frozen=True)
class RestTies:
    """The ties of the input, before targets are known.

    samples, label, crossed, handles : the arguments of `rest_ties`
    found, times : the facing points, and (F,) their distances relative to `near_lengths`
    ties : of all samples; steps : (C,) see `steps_to_handles`; held, stays : (C,) bool; facing : see
        `RoundTies`
    slanted : (C,) bool, see `slanted_parts`; farther : (K,) see `farther_parts`
    """

    samples: Samples
    label: Array
    crossed: Array
    handles: Array
    found: Facing
    times: Array
    ties: Ties
    steps: Array
    held: Array
    stays: Array
    facing: int
    slanted: Array
    farther: Array


@dataclass(frozen=True)
class HandleMaps:
    """What targets ask for, as far as ties depend on it: the growth of the drawing, and a map of each part.

    maps : of each part; shifted : (C,) bool, the handles only shift the part
    firm : (C,) upper bound of the part's weight of E_size, see `size_limits`
    """

    growth: float
    maps: AxisMaps
    shifted: Array
    firm: Array

    def same(self, other: HandleMaps) -> bool:
        """Whether both give the same ties, to the last bit."""
        pairs = [
            (getattr(self.maps, name), getattr(other.maps, name)) for name in ("scale", "shift", "exact")
        ]
        pairs += [(self.shifted, other.shifted), (self.firm, other.firm)]
        return self.growth == other.growth and all(np.array_equal(mine, others) for mine, others in pairs)


def surroundings(samples: Samples) -> Surroundings:
    """The triangulation of the samples, and the points that face each other up to FARTHEST spacings."""
    vectors = samples.points[samples.edges[:, 1]] - samples.points[samples.edges[:, 0]]
    spacing = float(np.median(np.linalg.norm(vectors, axis=1)))
    sides = scaffold.sides(samples.points)
    return Surroundings(sides, spacing, facing(samples, sides, spacing, FARTHEST * spacing))


def rest_ties(
    samples: Samples,
    label: Array,
    about: Surroundings,
    crossed: Array,
    handles: Array,
    page: Array | None,
    component: float,
    strength: float = 1.0,
) -> RestTies:
    """The ties of samples with component labels (N,), for any targets of the handles.

    crossed : (K, 2) pairs of samples at one point, where two parts cross
    handles : (H,) samples; page : (2, 2) or None
    component : w_comp of Eq. 22; strength : a factor of all other weights
    """
    points = samples.points
    count = int(label.max()) + 1
    held = held_parts(label, handles)
    found, spacing = about.facing, about.spacing
    times = found.distance / near_lengths(samples, label, count, found, spacing)
    near = facing_ties(samples, found, times, strength)
    touching = steps_to_handles(near.of(times <= 1.0), label, held, label[crossed])
    steps = steps_to_handles(near.of(times <= REACH_OF_GROUP), label, held, label[crossed])
    with_handle = np.isfinite(steps)
    near = placing_ties(near, ~with_handle[label], times, strength)
    near = thinned(near, samples, found.distance / spacing)
    between = scaffold_sides(scaffold.between(points, label, about.sides), near, label, points)
    weight = np.full(len(between), component / max(len(between), 1))
    ties = near.and_(crossing_ties(points, crossed, spacing, strength))
    ties = ties.and_(Ties.between(points, between, weight))
    stays = (enclosing_parts(points, label, count, page) & ~np.isfinite(touching)) | (
        page_filling_parts(points, label, count, page) & ~held
    )
    slanted = slanted_parts(samples, label, count)
    farther = farther_parts(points, label, crossed, handles)
    return RestTies(
        samples, label, crossed, handles, found, times, ties, steps, held, stays, len(near), slanted, farther
    )


def handle_maps(rest: RestTies, targets: Array) -> HandleMaps:
    """The growth and the maps that targets (H, 2), user units, ask for."""
    points, part = rest.samples.points[rest.handles], rest.label[rest.handles]
    tolerance = EXACT * float(np.linalg.norm(np.ptp(rest.samples.points, axis=0)))
    growth = common_growth(points, targets)
    maps = part_maps(points, part, targets, rest.slanted, tolerance)
    shift, alike = mean_moves(points, part, targets, rest.held, tolerance)
    shifted = alike | (maps.exact & (np.abs(maps.scale - growth).max(axis=1) <= EXACT))
    limits = size_limits(
        rest.label[rest.crossed],
        rest.farther,
        np.where(shifted[:, None], shift, np.nan),
        EXACT * np.abs(rest.samples.points).max(),
    )
    return HandleMaps(growth, maps, shifted, limits)


def ties_for(rest: RestTies, asked: HandleMaps) -> RoundTies:
    """The ties with the offsets that targets ask for, and the weights of E_size."""
    samples, label, steps, held = rest.samples, rest.label, rest.steps, rest.held
    points, edges = samples.points, samples.edges
    with_handle = np.isfinite(steps)
    growth = asked.growth
    ties = _with_offsets(rest.ties, points, label, asked.maps, growth)
    # A part with handles is free in size, unless its handles only shift it.
    size = np.where(held & ~asked.shifted, 0.0, np.where(with_handle, SIZE_IN_GROUP, SIZE))
    size = np.minimum(size, asked.firm)
    follows = following(samples, rest.found, rest.times, np.where(asked.shifted, 0.5, steps)[label])
    size = size[label[edges[:, 0]]] * (1.0 - follows[edges].mean(axis=1))
    return RoundTies(ties, size, growth, rest.stays, rest.facing)


def _with_offsets(ties: Ties, points: Array, label: Array, maps: AxisMaps, growth: float) -> Ties:
    """The ties with the offsets at which they have no energy."""
    part = label[ties.samples]
    mapped = points[ties.samples] * maps.scale[part] + maps.shift[part]
    offset = np.einsum("tk,tkd->td", ties.factor, mapped)
    a, b = part[:, 0], part[:, 2]
    # Two parts that are shifted differently keep the offset of the input: what lies between them can stretch.
    rigid = np.abs(maps.scale - 1.0).max(axis=1) <= EXACT
    apart = np.abs(maps.shift[a] - maps.shift[b]).max(axis=1) > EXACT * np.abs(points).max()
    known = maps.exact[a] & maps.exact[b] & ~(rigid[a] & rigid[b] & apart)
    offset = np.where(known[:, None], offset, growth * ties.offset)
    return replace(ties, offset=offset, length=growth * ties.length)
