# SPDX-License-Identifier: GPL-2.0-or-later
"""Ties: what lies side by side stays together, though no curve joins it.

The paper's energy knows curves only.  A person sees things: an outline drawn as two contours has a thickness,
a highlight lies on a bottle, two faces that are 1e-3 apart share a border.  A *tie* joins a sample to the
point of another curve that faces it (`alup.ties.facing`).  Let r be the change of the offset between the two,
d the offset's direction in the input and L its length.  The energy of the tie is

    w / L^2  ( (d . r)^2 + SLIDE (d_perp . r)^2 )

so curves slide along each other more easily than they part.  All parts are solved together with their ties.

*Weights.* w is STRENGTH up to a length of REACH spacings, and falls with its fourth power beyond.

*Letting go.* A tie between points that handles pull apart would drag its surroundings along.  Therefore its
weight is divided by (1 + (e/h)^2)^2, with the strain e = |r|/L.  h is HOLDS for near ties and grows with the
length of longer ones.  This is done when the coarse levels have found the shape, and again before the final
round.

*Groups.* Parts joined by near ties, or ties not much longer, are a group.  Parts of a group without any
handle keep their size.  Their ties to what is farther than REACH have the small weight GENTLE and never let
go; they only place the group.  Their weight falls so slowly with the distance that a row of windows spreads
evenly.

*Sizes.* In a group with a handle, parts without one keep their size weakly.  So do parts that their own
handles only shift.  A curve beside another one that is fewer ties away from a handle takes the size of that
one instead: the inner contour of an outline follows the outer contour.

*Crossings.* Parts that cross (`alup.network.open_crossings`) are tied there by ties that never let go, and
are of one group.  They keep their size less firmly than others, because one may be a stick that joins two
things. Where their own handles move two of them apart, one hardly keeps its size: it has to stretch.

*Offsets without energy.* A tie holds an offset.  Where everything grows alike, offsets grow as well: see
`common_growth`.  Handles of a part may ask for a map without distortion, a uniform scaling or an axis-aligned
stretch of axis-aligned lines.  Ties between two such parts take their offsets from these maps.

*Backgrounds.* Parts that cover the page stay: see `_staying`.

The constants were chosen by looking at pictures of 127 drawings.  Tried and left: ties of the sides of the
triangulation (diagonals resist a stretch), one exponent for all (windows stay behind, or a house's walls
slant), letting go within the energy (a hundred iterations instead of ten), no sliding (more turning),
STRENGTH 3 (no more bands kept, and outlines get corners) and 0.1 (roofs part from walls), the size of an
outline's inner side kept (rings get corners), crossings that let go (limbs come off), that are one point
(wheels grow with the truck), or of which nothing is said (sticks leave their heads).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from ..geometry.arrays import Array
from ..model import Ties
from ..network.sampling import Samples
from . import scaffold
from .facing import Facing, facing

# Of a near tie; the energy of an edge turned by 90 degrees is 1.
STRENGTH = 0.5

# In spacings: where the weight begins to fall, and beyond which there are no ties.
REACH, FARTHEST = 4.0, 40.0

# Parts this much of the smaller one's size apart are near as well: a wide border is a border.
REACH_OF_SIZE = 0.1

# The most ties of neighbouring samples that one tie stands for.
MOST_THINNED = 8.0

# Weight of sliding against that of parting.
SLIDE = 0.25

# The strain at which a near tie lets go; beyond REACH it grows with the square of the length.
HOLDS = 0.35

# Ties this many times as long as near ones still make a group.  Just beyond REACH they are as strong as
# near ones.  A highlight that kept its size there, as a part without a group does, would dent a bulb.
REACH_OF_GROUP = 1.25

# Weight of the ties that place groups without a handle, in units of STRENGTH.
GENTLE = 1e-3

# Weight of E_size of parts in groups without a handle, and with one.
SIZE, SIZE_IN_GROUP = 1.0, 0.3

# Weight of a crossing, against STRENGTH; its length is REACH.
CROSSING = 8.0

# Weight of E_size of parts that cross others, at most, and where their handles take them apart.
SIZE_CROSSED, SIZE_APART = 0.1, 0.01

# A part belongs to another one's group if this share of its samples is tied to it nearly.
TIED_SHARE = 0.1

# Handles ask for an axis map if it misses none of their targets by more than this, of the diagonal.
EXACT = 1e-9

# `common_growth` is 1 where axis scalings leave at least this part of the handles' squared moves unexplained.
UNEXPLAINED = 0.05

# A part reaches the page's edge when it is this near to it, of the page's diagonal.
AT_EDGE = 0.005


@dataclass(frozen=True)
class Around:
    """What lies around each sample.  sides : (m, 2) samples; spacing : between samples, user units"""

    sides: Array
    spacing: float
    facing: Facing


@dataclass(frozen=True)
class Tied:
    """ties : of all samples; size : (E,) weight of E_size; growth : of everything

    stays : (C,) bool, parts held as they are; facing : how many of the ties join points that face each other
    """

    ties: Ties
    size: Array
    growth: float
    stays: Array
    facing: int


@dataclass(frozen=True)
class AxisMaps:
    """Of every part x -> scale x + shift, and whether it costs nothing.

    scale, shift : (C, 2); exact : (C,) bool
    """

    scale: Array
    shift: Array
    exact: Array


def around(samples: Samples) -> Around:
    """The samples around each sample, and the points that face it up to the length of the longest ties."""
    vectors = samples.points[samples.edges[:, 1]] - samples.points[samples.edges[:, 0]]
    spacing = float(np.median(np.linalg.norm(vectors, axis=1)))
    sides = scaffold.sides(samples.points)
    return Around(sides, spacing, facing(samples, sides, spacing, FARTHEST * spacing))


@dataclass(frozen=True)
class Standing:
    """The ties of samples and held points as they are in the input, for any targets of these points.

    samples, label, crossed, handles : what they were made of
    found, times : (F,) the facing points, see `_reach`
    ties : of all samples; steps : (C,) see `_steps`; held, stays : (C,) bool; facing : see `Tied`
    slanted : (C,) bool, parts with edges along neither axis
    farther : (K,) of two parts that cross the one whose handles are farther from there
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
class Wish:
    """What ties have to know of the targets: the growth of everything, and what they ask of each part.

    maps : its own; shifted : (C,) bool, it is only to be moved; firm : (C,) weight of its E_size at most
    """

    growth: float
    maps: AxisMaps
    shifted: Array
    firm: Array

    def same(self, other: Wish) -> bool:
        """Whether the ties are the same, to the last bit."""
        pairs = [
            (getattr(self.maps, name), getattr(other.maps, name)) for name in ("scale", "shift", "exact")
        ]
        pairs += [(self.shifted, other.shifted), (self.firm, other.firm)]
        return self.growth == other.growth and all(np.array_equal(mine, others) for mine, others in pairs)


def standing(
    samples: Samples,
    label: Array,
    about: Around,
    crossed: Array,
    handles: Array,
    page: Array | None,
    component: float,
    strength: float = 1.0,
) -> Standing:
    """The ties of samples with component labels (N,), for any targets of the handles.

    crossed : (K, 2) samples of parts that cross there, each pair at one point
    handles : (H,) samples; page : (2, 2) or None
    component : w_comp of Eq. 22; strength : a factor of all other weights
    """
    points = samples.points
    count = int(label.max()) + 1
    held = held_parts(label, handles)
    found, spacing = about.facing, about.spacing
    times = found.distance / _reach(samples, label, count, found, spacing)
    near = _facing_ties(samples, found, times, strength)
    touching = _steps(near.of(times <= 1.0), label, held, label[crossed])
    steps = _steps(near.of(times <= REACH_OF_GROUP), label, held, label[crossed])
    with_handle = np.isfinite(steps)
    near = _placing(near, ~with_handle[label], times, strength)
    near = _thinned(near, samples, found.distance / spacing)
    between = _links(scaffold.between(points, label, about.sides), near, label, points)
    weight = np.full(len(between), component / max(len(between), 1))
    ties = near.and_(_at_crossings(points, crossed, spacing, strength))
    ties = ties.and_(Ties.between(points, between, weight))
    stays = (_staying(points, label, count, page) & ~np.isfinite(touching)) | (
        _filling(points, label, count, page) & ~held
    )
    slanted = _slanted(samples, label, count)
    farther = _farther(points, label, crossed, handles)
    return Standing(
        samples, label, crossed, handles, found, times, ties, steps, held, stays, len(near), slanted, farther
    )


def held_parts(label: Array, handles: Array) -> Array:
    """Which components, (C,) bool, carry a handle; handles : (H,) samples."""
    result = np.zeros(int(label.max()) + 1, dtype=bool)
    result[label[handles]] = True
    return result


def wish(of: Standing, targets: Array) -> Wish:
    """The growth and the maps that targets (H, 2) ask for."""
    growth = common_growth(of.samples.points[of.handles], targets)
    maps = _own_maps(of, targets)
    shift, alike = _shifts(of, targets)
    shifted = alike | (maps.exact & (np.abs(maps.scale - growth).max(axis=1) <= EXACT))
    return Wish(growth, maps, shifted, _firm(of, np.where(shifted[:, None], shift, np.nan)))


def aimed(of: Standing, asked: Wish) -> Tied:
    """The ties with the offsets, and the edges with the sizes, that targets ask for."""
    samples, label, steps, held = of.samples, of.label, of.steps, of.held
    points, edges = samples.points, samples.edges
    with_handle = np.isfinite(steps)
    growth, maps = asked.growth, asked.maps
    ties = _as_wished(of.ties, points, label, maps, growth)
    # Parts that their own handles only shift keep their size as well.
    size = np.where(held & ~asked.shifted, 0.0, np.where(with_handle, SIZE_IN_GROUP, SIZE))
    size = np.minimum(size, asked.firm)
    follows = _following(samples, of.found, of.times, np.where(asked.shifted, 0.5, steps)[label])
    size = size[label[edges[:, 0]]] * (1.0 - follows[edges].mean(axis=1))
    return Tied(ties, size, growth, of.stays, of.facing)


def _reach(samples: Samples, label: Array, count: int, found: Facing, spacing: float) -> Array:
    """Up to which length each tie is near, (F,) user units."""
    total = np.stack([np.bincount(label, samples.points[:, d], count) for d in (0, 1)], axis=1)
    centre = total / np.bincount(label, minlength=count)[:, None]
    # Not the box: a drawing that is turned has the same ties.
    size = np.zeros(count)
    np.maximum.at(size, label, 2.0 * np.linalg.norm(samples.points - centre[label], axis=1))
    a, b = label[found.sample], label[samples.edges[found.edge, 0]]
    smaller = np.where(a == b, 0.0, np.minimum(size[a], size[b]))
    return np.maximum(REACH * spacing, REACH_OF_SIZE * smaller)


def _nearness(times: Array) -> Array:
    """1 for near ties, falling beyond."""
    return np.asarray(np.maximum(times, 1.0) ** -4.0)


def _facing_ties(samples: Samples, found: Facing, times: Array, strength: float) -> Ties:
    """Ties between facing points; times : (F,) their lengths in the lengths up to which they are near."""
    edge = samples.edges[found.edge]
    count = len(found.sample)
    share = found.share
    factor = np.stack([-np.ones(count), np.zeros(count), 1.0 - share, share], axis=1)
    numbers = np.concatenate([found.sample[:, None], found.sample[:, None], edge], axis=1)
    return Ties(
        samples=numbers,
        factor=factor,
        offset=np.einsum("tk,tkd->td", factor, samples.points[numbers]),
        length=found.distance,
        weight=strength * STRENGTH * _nearness(times),
        slide=np.full(count, SLIDE),
        holds=HOLDS * np.maximum(times, 1.0) ** 2,
    )


def _at_crossings(points: Array, crossed: Array, spacing: float, strength: float) -> Ties:
    """Ties of samples at one point, (K, 2); at least as strong as normal, however loosely parts are held."""
    ties = Ties.between(points, crossed, np.full(len(crossed), CROSSING * STRENGTH * max(strength, 1.0)))
    return replace(ties, length=np.full(len(crossed), REACH * spacing))


def _farther(points: Array, label: Array, crossed: Array, handles: Array) -> Array:
    """Of the two parts that cross at samples (K, 2) the one whose handles are farther away, (K,)."""
    part, owner = label[crossed], label[handles]
    away = np.full(part.shape, np.inf)
    for one in np.intersect1d(part, owner):
        near = cKDTree(points[handles[owner == one]])
        away[part == one] = near.query(points[crossed[part == one]])[0]
    return np.where(away[:, 1] > away[:, 0], part[:, 1], part[:, 0])


def _firm(of: Standing, shift: Array) -> Array:
    """The greatest weight of E_size that parts may have which others cross, (C,); inf for the rest.

    shift : (C, 2) of parts that their own handles only shift, else NaN
    """
    firm, part = np.full(len(shift), np.inf), of.label[of.crossed]
    firm[part] = SIZE_CROSSED
    differ = np.abs(shift[part[:, 0]] - shift[part[:, 1]]).max(axis=1)
    # Where handles take two parts away from each other, one of them has to stretch.
    firm[of.farther[differ > EXACT * np.abs(of.samples.points).max()]] = SIZE_APART
    return firm


def _shifts(of: Standing, targets: Array) -> tuple[Array, Array]:
    """The mean move of each part's handles, (C, 2), and whether there are any and they move alike, (C,)."""
    points, part, count = of.samples.points, of.label[of.handles], len(of.held)
    move = targets - points[of.handles]
    total = np.stack([np.bincount(part, move[:, d], count) for d in (0, 1)], axis=1)
    shift = total / np.maximum(np.bincount(part, minlength=count), 1)[:, None]
    alike = of.held.copy()
    tolerance = EXACT * float(np.linalg.norm(np.ptp(points, axis=0)))
    alike[part[np.abs(move - shift[part]).max(axis=1) > tolerance]] = False
    return shift, alike


def _steps(near: Ties, label: Array, held: Array, crossed: Array) -> Array:
    """How many near ties lead from each component to one with a handle, (C,); inf where none do.

    crossed : (K, 2) components that cross
    """
    count = len(held)
    a, b = label[near.samples[:, 0]], label[near.samples[:, 2]]
    pair, ties = np.unique(a[a != b] * count + b[a != b], return_counts=True)
    size = np.bincount(label, minlength=count)
    pair = pair[ties >= TIED_SHARE * size[pair // count]]
    pair = np.unique(np.concatenate([pair, crossed @ [count, 1]]))
    graph = csr_matrix((np.ones(len(pair)), (pair // count, pair % count)), shape=(count, count))
    return np.asarray(dijkstra(graph, False, np.flatnonzero(held), unweighted=True, min_only=True))


def _following(samples: Samples, found: Facing, times: Array, step: Array) -> Array:
    """How far each sample has the size of a curve beside it that is nearer to a handle, (N,) from 0 to 1.

    times : (F,) lengths of all ties; step : (N,) how many near ties lead to a handle
    """
    follows = np.zeros(len(step))
    foot = samples.edges[found.edge]
    here, there = step[found.sample], step[foot[:, 0]]
    share = _nearness(times)
    np.maximum.at(follows, found.sample[here > there], share[here > there])
    np.maximum.at(follows, foot[here < there].ravel(), np.repeat(share[here < there], 2))
    # What no near ties join to a handle has no size to follow.
    return np.where(np.isfinite(step), follows, 0.0)


def _placing(near: Ties, free: Array, times: Array, strength: float) -> Ties:
    """The ties, those beyond REACH that have an end in a group without a handle only placing it.

    free : (N,) bool, samples of such groups
    """
    places = free[near.samples[:, [0, 2]]].any(axis=1) & (times > 1.0)
    # With t the length in REACH: the first summand falls steeply from near ties, the second as 1/t, like
    # springs in a row.
    gentle = strength * STRENGTH * (times**-10 + GENTLE / times)
    return replace(
        near, weight=np.where(places, gentle, near.weight), holds=np.where(places, np.inf, near.holds)
    )


def _links(sides: Array, near: Ties, label: Array, points: Array) -> Array:
    """The sides (m, 2) between parts; where ties join two parts the shortest alone, so that all is held."""
    count = int(label.max()) + 1
    joined, pair = ((np.sort(label[ends], axis=1) @ [count, 1]) for ends in (near.samples[:, [0, 2]], sides))
    order = np.argsort(np.linalg.norm(points[sides[:, 1]] - points[sides[:, 0]], axis=1), kind="stable")
    _, first = np.unique(pair[order], return_index=True)
    kept = ~np.isin(pair, joined)
    kept[order[first]] = True
    return sides[kept]


def _thinned(near: Ties, samples: Samples, lengths: Array) -> Ties:
    """As many ties along a curve as they are long, each for those beside it: more only cost time.

    lengths : (F,) in spacings
    """
    count = len(samples.points)
    start, chain = samples.chain_start, samples.chain
    long = np.diff(start)
    position, room = np.zeros(count, dtype=int), np.zeros(count, dtype=int)
    position[chain] = np.arange(len(chain)) - np.repeat(start[:-1], long)
    # A sample where curves meet is the first of all of them.
    position[chain[start[:-1]]] = 0
    room[chain] = np.repeat(long, long)
    sample = near.samples[:, 0]
    stride = np.clip(lengths, 1.0, MOST_THINNED).astype(int)
    kept = position[sample] % stride == 0
    stands_for = np.minimum(stride, room[sample])[kept]
    thin = near.of(kept)
    return replace(thin, weight=thin.weight * stands_for)


def _as_wished(ties: Ties, points: Array, label: Array, maps: AxisMaps, growth: float) -> Ties:
    """The ties with the offsets that cost nothing."""
    part = label[ties.samples]
    mapped = points[ties.samples] * maps.scale[part] + maps.shift[part]
    offset = np.einsum("tk,tkd->td", ties.factor, mapped)
    a, b = part[:, 0], part[:, 2]
    # Two parts whose handles only shift them are no reason to part: what lies between can stretch.
    rigid = np.abs(maps.scale - 1.0).max(axis=1) <= EXACT
    apart = np.abs(maps.shift[a] - maps.shift[b]).max(axis=1) > EXACT * np.abs(points).max()
    known = maps.exact[a] & maps.exact[b] & ~(rigid[a] & rigid[b] & apart)
    offset = np.where(known[:, None], offset, growth * ties.offset)
    return replace(ties, offset=offset, length=growth * ties.length)


def _slanted(samples: Samples, label: Array, count: int) -> Array:
    """Which parts, (C,) bool, have edges along neither axis."""
    direction = np.abs(samples.points[samples.edges[:, 1]] - samples.points[samples.edges[:, 0]])
    slanted = direction.min(axis=1) > 1e-6 * direction.max(axis=1)
    return np.asarray(np.bincount(label[samples.edges[:, 0]], slanted, count) > 0)


def _own_maps(of: Standing, targets: Array) -> AxisMaps:
    """The axis map that each part's own handles ask for."""
    points, label, handles, slanted = of.samples.points, of.label, of.handles, of.slanted
    count = len(of.held)
    scale, shift, exact = np.ones((count, 2)), np.zeros((count, 2)), np.zeros(count, dtype=bool)
    tolerance = EXACT * float(np.linalg.norm(np.ptp(points, axis=0)))
    for part in np.unique(label[handles]):
        mine = label[handles] == part
        p, q = points[handles[mine]], targets[mine]
        along = _axis_scales(p, q, tolerance)
        if along is None:
            continue
        move = q.mean(axis=0) - along * p.mean(axis=0)
        fits = np.abs(along * p + move - q).max() <= tolerance and along.min() > 0.0
        if fits and (np.ptp(along) <= EXACT or not slanted[part]):
            scale[part], shift[part], exact[part] = along, move, True
    return AxisMaps(scale, shift, exact)


def _axis_scales(p: Array, q: Array, tolerance: float) -> Array | None:
    """Least squares of q = scale p + shift, (2,).

    1 for points that are one; None where points on a line parallel to an axis leave one of the two open.
    """
    p, q = p - p.mean(axis=0), q - q.mean(axis=0)
    square = np.einsum("nd,nd->d", p, p)
    if (square <= tolerance**2).all():
        return np.ones(2)
    if (square <= tolerance**2).any():
        return None
    return np.asarray(np.einsum("nd,nd->d", p, q) / square)


def common_growth(points: Array, targets: Array) -> float:
    """The growth of everything that handles at points (H, 2) ask for with their targets.

    Two scalings along the axes explain the handles' moves best.  The growth is the one nearer to 1, or 1 if
    one of them grows and the other shrinks: a stretch leaves a border as thick as it was.  Where the scalings
    leave moves unexplained it tends to 1 steadily: nothing jumps while a handle is dragged.
    """
    along = _axis_scales(points, targets, EXACT * float(np.linalg.norm(np.ptp(points, axis=0))))
    if along is None or along.min() <= 0.0:
        return 1.0
    p, q = points - points.mean(axis=0), targets - targets.mean(axis=0)
    moved = float(((q - p) ** 2).sum())
    if moved == 0.0:
        return 1.0
    log = np.log(along)
    common = 0.0 if log[0] * log[1] <= 0.0 else log[np.argmin(np.abs(log))]
    left = float(((q - along * p) ** 2).sum()) / moved
    return float(np.exp(common * max(0.0, 1.0 - left / UNEXPLAINED)))


def _bounds(points: Array, label: Array, count: int) -> tuple[Array, Array]:
    """Least and greatest x, y of every part, (C, 2) each."""
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, label, points)
    np.maximum.at(high, label, points)
    return low, high


def _staying(points: Array, label: Array, count: int, page: Array | None) -> Array:
    """Parts (C,) that enclose all others, or reach two opposite edges of the page."""
    low, high = _bounds(points, label, count)
    stays = np.zeros(count, dtype=bool)
    if count > 1:
        large = int(np.argmax((high - low).prod(axis=1)))
        others = np.arange(count) != large
        stays[large] = (low[large] < low[others]).all() and (high[large] > high[others]).all()
    if page is not None:
        near = AT_EDGE * float(np.linalg.norm(page[1] - page[0]))
        stays |= ((low <= page[0] + near) & (high >= page[1] - near)).any(axis=1)
    return stays


def _filling(points: Array, label: Array, count: int, page: Array | None) -> Array:
    """Parts (C,) that reach all four corners of the page: a background, near what is moved as well."""
    fills = np.full(count, page is not None)
    if page is not None:
        near = AT_EDGE * float(np.linalg.norm(page[1] - page[0]))
        for corner in ((0, 0), (0, 1), (1, 0), (1, 1)):
            at = np.linalg.norm(points - page[corner, (0, 1)], axis=1) <= near
            fills &= np.bincount(label, at, count) > 0
    return fills
