# SPDX-License-Identifier: GPL-2.0-or-later
"""Samples + handles + weights -> one round's minimisation problem.

A `Problem` holds everything that stays the same during a round (Sec. 3.2.1): the start v0, the
lengths l0 and directions d0 of its edges, the turns with their weights and ratios, the straight
turns that this round keeps, the handles and the ties.

Units: the round's mean edge length L_avg is 1, so (l / L_avg)^2 and l^2 / L_avg are the same and
the result does not depend on the document's units.  `scale` and `origin` lead back.

A straight turn keeps the bend that rounded coordinates gave it in the input.  The paper forces it to zero,
and an edit without a moved handle would then move the drawing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix

from ..geometry.arrays import Array, Bools, Complexes, Floats, Ints
from ..geometry.edges import edge_vectors
from ..model import Alignments, Ties
from ..network.sampling import Graph, turns


@dataclass(frozen=True)
class Weights:
    """Weights of the energy's terms.

    From the paper, with its values:
    straight : w_s; handle : w_c; component : w_comp before the division by |T|
    sigma : of Eq. 11, radians; corner : eps_r of Eq. 11

    Factors that the paper does not have, and that leave its energy as it is at 1:
    normal, tangent, edge : of E_normal, E_tangent and E_edge

    Not from the paper:
    keep_size : the part of itself by which F may rise so that sizes are kept (see `minimise.newton`); 0 finds
        the minimum of F.  0.3 was chosen by looking at the cases.
    The weights of ties are constants of `alup.ties.tie_weights`, those of E_size of `alup.ties.groups`.

    For the paper's ablations, not for use:
    stretch : whether omega_n is Eq. 6's max(1, l^2), else 1
    uniform_turns : w_t of all turns, corners and junctions too, instead of Eq. 11's
    With `edge` 0 nothing but the handles keeps folds out.  With `straight` 0 lines are curves like others.
    """

    normal: float = 1.0
    tangent: float = 1.0
    edge: float = 1.0
    keep_size: float = 0.3
    straight: float = 1e4
    handle: float = 1e5
    component: float = 0.01
    sigma: float = np.pi / 6.0
    corner: float = 1e-3
    stretch: bool = True
    uniform_turns: float | None = None


# Eq. 11: below this angle between its edges a turn is a visible corner.
CORNER_ANGLE = np.radians(95.0)

# A straight turn at a junction or a handle comes back in the final round if the core result bends
# there by less than this (Sec. 3.2.1, "if they remain approximately straight").  The paper gives no value;
# this one was chosen by looking at the cases.
STILL_STRAIGHT = np.radians(5.0)

# Ties shorter than this (in mean edge lengths) count as this long.  Their weight 1/l0^2 would spoil the
# condition of the equations where points almost coincide.  The value was chosen by looking at the cases.
SHORTEST_TIE = 0.1

# No edge starts a round shorter than this (in mean edge lengths): an edge without length has no direction,
# and no ratio to its neighbour.  Any value far below the spacing and far above rounding serves.
SHORTEST_EDGE = 1e-6


@dataclass(frozen=True)
class Problem:
    """One round.  N samples, E edges, Q ordered turns, K straight turns, H handles, T scaffold edges.

    start : (N, 2) v0;  edges : (E, 2) int;  normals : (E, 2) n_ij of the input
    lengths : (E,) l0_ij;  directions : (E, 2) d0_ij
    turn_ij, turn_ik : (Q,) int edges of the ordered turns;  ratio : (Q,) r_ijk;  turn_weight : (Q,) w_t
    straight : (K, 3) int samples i, j, k;  straight_ij, straight_ik : (K,) int edges
    bend : (K, 2) what the input has of Eq. 12's difference of unit vectors
    handles : (H,) int;  targets : (H, 2) p_h
    tie_samples : (T, 4) int, tie_factor : (T, 4), tie_vector : (T, 2): what sum_k factor_k v_k is to be
    tie_axis : (T,) complex, the unit vector along which it is held fully; tie_weight : (T,), with 1/l0^2
    tie_slide : (T,) weight across the axis; tie_softness : (T,) 1/(c l0)^2, 0 where it never lets go
    size : (E,) weight of (l - rest)^2 / mass; rest : (E,) the lengths that edges keep
    mass : (E,) how many edges of the sampling each stands for, 1 but on coarse levels
    scale, origin : user units = scale * problem units + origin
    """

    start: Floats
    edges: Ints
    normals: Floats
    lengths: Floats
    directions: Floats
    turn_ij: Ints
    turn_ik: Ints
    ratio: Floats
    turn_weight: Floats
    straight: Ints
    straight_ij: Ints
    straight_ik: Ints
    bend: Floats
    handles: Ints
    targets: Floats
    tie_samples: Ints
    tie_factor: Floats
    tie_vector: Floats
    tie_axis: Complexes
    tie_weight: Floats
    tie_slide: Floats
    tie_softness: Floats
    size: Floats
    rest: Floats
    mass: Floats
    scale: float
    origin: Floats
    weights: Weights

    def to_user(self, v: Array) -> Array:
        """Positions (N, 2) in user units."""
        return v * self.scale + self.origin

    def from_user(self, points: Array) -> Array:
        return (points - self.origin) / self.scale


@dataclass(frozen=True)
class Turns:
    """All Q ordered turns (i; j, k) of a network.

    i, j, k : (Q,) int samples;  ij, ik : (Q,) int their edges;  theta : (Q,) angle between these, radians
    continues : (Q,) bool, one curve runs through the sample: not an end of curves that meet there
    """

    i: Ints
    j: Ints
    k: Ints
    ij: Ints
    ik: Ints
    theta: Floats
    continues: Bools

    @property
    def smooth(self) -> Array:
        """Which of the turns are no visible corner, (Q,) bool."""
        return (self.theta > CORNER_ANGLE) & self.continues


def network_turns(graph: Graph) -> Turns:
    """The turns of the input network."""
    edges, points = graph.edges, graph.points
    direction = _input_directions(graph)
    i, j, k, ij, ik = turns(edges, len(points))
    valence = np.bincount(edges.ravel(), minlength=len(points))
    cosine = np.einsum("qd,qd->q", _outward(direction, edges, ij, i), _outward(direction, edges, ik, i))
    theta = np.arccos(np.clip(cosine, -1.0, 1.0))
    continues = (valence[i] == 2) | _among(graph.through, ij, ik, len(edges))
    return Turns(i, j, k, ij, ik, theta, continues)


def _input_directions(graph: Graph) -> Array:
    """Unit vectors along the edges of the input, (E, 2)."""
    vector = edge_vectors(graph.points, graph.edges)
    return vector / np.maximum(np.linalg.norm(vector, axis=1), 1e-300)[:, None]


def scatter(count: int, pairs: Array, problem: Problem) -> csr_matrix:
    """Sums pulls on differences of pairs (P, 2), ties and handles into the samples, (count, P + T + H)."""
    number, ties, handles = len(pairs), len(problem.tie_samples), len(problem.handles)
    rows = [pairs[:, 1], pairs[:, 0], problem.tie_samples.ravel(), problem.handles]
    columns = [
        np.arange(number),
        np.arange(number),
        number + np.repeat(np.arange(ties), 4),
        number + ties + np.arange(handles),
    ]
    values = [np.ones(number), -np.ones(number), problem.tie_factor.ravel(), np.ones(handles)]
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return csr_matrix(entries, shape=(count, number + ties + handles))


def let_go(problem: Problem, v: Array) -> Array:
    """The weights of the ties, (T,), those that v strains less: w / (1 + (e / holds)^2)^2."""
    missed = tie_differences(problem, v)
    strain = missed.real**2 + problem.tie_slide * missed.imag**2
    return problem.tie_weight / (1.0 + problem.tie_softness * strain) ** 2


def tie_differences(problem: Problem, v: Array) -> Array:
    """What each tie misses, (T,) complex in the frame of its axis: real along it."""
    held = np.einsum("tk,tkd->td", problem.tie_factor, v[problem.tie_samples]) - problem.tie_vector
    return (held[:, 0] + 1j * held[:, 1]) * problem.tie_axis.conj()


@dataclass(frozen=True)
class Analysis:
    """What a graph, its handles and the weights say of both rounds, whatever the targets.

    handles : (H,) int samples
    normals : (E, 2); turn, turn_weight : (Q,); straight : (K, 3) with bend (K, 2), see `Problem`
    straight_turn : (K,) int among the turns; in_core : (K,) bool, straight turns that the core round keeps
    """

    graph: Graph
    handles: Ints
    weights: Weights
    normals: Floats
    turn: Turns
    turn_weight: Floats
    straight: Ints
    straight_turn: Ints
    in_core: Bools
    bend: Floats


def analyse(graph: Graph, handles: Array, weights: Weights) -> Analysis:
    """Analyse a graph with handles at some of its samples, (H,) int."""
    direction = _input_directions(graph)
    turn = network_turns(graph)
    # Without their weight lines are not straightened by any other means either (`alup.solver.straight_runs`).
    straight = graph.straight_turns if weights.straight > 0.0 else graph.straight_turns[:0]
    place = _turns_of(graph, turn, straight)
    grabbed = np.zeros(len(graph.points), dtype=bool)
    grabbed[handles] = True
    return Analysis(
        graph=graph,
        handles=handles,
        weights=weights,
        normals=np.stack([-direction[:, 1], direction[:, 0]], axis=1),
        turn=turn,
        turn_weight=turn_weight(turn, weights),
        straight=straight,
        straight_turn=place,
        in_core=turn.continues[place] & ~grabbed[straight[:, 0]],
        bend=straight_difference(graph.points, straight),
    )


def core_problem(of: Analysis, targets: Array, ties: Ties, size: Array, growth: float = 1.0) -> Problem:
    """The core round: v0 is the input; straight turns at junctions and handles are left out.

    targets : (H, 2) user units; size : (E,) weights of E_size; growth : of the lengths that E_size keeps
    """
    return _round(of, of.graph.points, targets, ties, size, growth, of.in_core)


def final_problem(core: Problem, result: Array, of: Analysis, ties: Ties, growth: float = 1.0) -> Problem:
    """The final round: v0 is the core's `result` (N, 2), user units; normals and w_t stay the input's.

    Sizes are not kept a second time: this round's E_tangent holds on to those that the core round found.
    Straight turns that the core round left out come back where its result is still straight.
    """
    difference = np.linalg.norm(straight_difference(result, of.straight), axis=1)
    keep = of.in_core | (2.0 * np.arcsin(np.clip(difference / 2.0, 0.0, 1.0)) < STILL_STRAIGHT)
    final = _round(of, result, core.to_user(core.targets), ties, core.size, growth, keep)
    weights = replace(of.weights, keep_size=0.0)
    tie_weight = let_go(final, final.start)
    return replace(final, weights=weights, tie_weight=tie_weight, tie_softness=np.zeros(len(ties)))


# Weight of alignments: of the square of the angle by which a line is off, once for each of its edges.  Chosen
# by looking at the cases.
ALIGNED = 1e3


def regular_problem(
    final: Problem, start: Array, samples: Array, places: Array, aligned: Alignments | None
) -> Problem:
    """A round after the final one, from its result `start` (N, 2), problem units, that keeps what is regular.

    samples : (m,), held as handles are; places : (m, 2) where, user units
    aligned : become ties without a slide, which hold along their axis alone
    """
    targets = np.concatenate([final.targets, final.from_user(places)])
    held = replace(final, start=start, handles=np.concatenate([final.handles, samples]), targets=targets)
    if aligned is None:
        return held
    count = len(aligned.length)
    length = np.maximum(aligned.length / final.scale, 1.0)
    return replace(
        held,
        tie_samples=np.concatenate([final.tie_samples, aligned.samples]),
        tie_factor=np.concatenate([final.tie_factor, aligned.factor]),
        tie_vector=np.concatenate([final.tie_vector, np.zeros((count, 2))]),
        tie_axis=np.concatenate([final.tie_axis, aligned.axis[:, 0] + 1j * aligned.axis[:, 1]]),
        tie_weight=np.concatenate([final.tie_weight, ALIGNED / length]),
        tie_slide=np.concatenate([final.tie_slide, np.zeros(count)]),
        tie_softness=np.concatenate([final.tie_softness, np.zeros(count)]),
    )


def _round(
    of: Analysis, start: Array, targets: Array, ties: Ties, size: Array, growth: float, keep: Array
) -> Problem:
    """A round that starts at (N, 2), user units, and keeps some, (K,) bool, of the straight turns."""
    edges = of.graph.edges
    vector = edge_vectors(start, edges)
    # Lone samples have no edges, and then nothing that a unit of length would matter to.
    scale = float(np.linalg.norm(vector, axis=1).mean()) if len(edges) else 1.0
    origin = start.mean(axis=0)
    v0 = (start - origin) / scale
    vector = vector / scale
    lengths = np.maximum(np.linalg.norm(vector, axis=1), SHORTEST_EDGE)
    directions = vector / lengths[:, None]
    rest = np.linalg.norm(edge_vectors(of.graph.points, edges), axis=1) * growth / scale
    turn, place = of.turn, of.straight_turn[keep]

    vector = ties.offset / scale
    far = np.hypot(*vector.T)
    axis = np.where(far > 1e-300, (vector[:, 0] + 1j * vector[:, 1]) / np.maximum(far, 1e-300), 1.0)
    length = np.maximum(ties.length / scale, SHORTEST_TIE)
    return Problem(
        start=v0,
        edges=edges,
        normals=of.normals,
        lengths=lengths,
        directions=directions,
        turn_ij=turn.ij,
        turn_ik=turn.ik,
        ratio=length_ratio(lengths, turn.ij, turn.ik),
        turn_weight=of.turn_weight,
        straight=of.straight[keep],
        straight_ij=turn.ij[place],
        straight_ik=turn.ik[place],
        bend=of.bend[keep],
        handles=of.handles,
        targets=(targets - origin) / scale,
        tie_samples=ties.samples,
        tie_factor=ties.factor,
        tie_vector=vector,
        tie_axis=axis,
        tie_weight=ties.weight / length**2,
        tie_slide=ties.slide,
        tie_softness=1.0 / (ties.holds * length) ** 2,
        size=size,
        rest=np.maximum(rest, SHORTEST_EDGE),
        mass=np.ones(len(edges)),
        scale=scale,
        origin=origin,
        weights=of.weights,
    )


def length_ratio(lengths: Array, ij: Array, ik: Array) -> Array:
    """Eq. 10: r_ijk = l0_ij / l0_ik of turns between edges ij and ik, (Q,)."""
    return np.asarray(lengths[ij] / lengths[ik])


def turn_weight(turn: Turns, weights: Weights) -> Array:
    """Eq. 11: w_t of every turn, (Q,)."""
    if weights.uniform_turns is not None:
        return np.full(len(turn.i), weights.uniform_turns)
    smooth = np.exp(-((turn.theta - np.pi) ** 2) / (2.0 * weights.sigma**2))
    return np.where(turn.smooth, smooth, weights.corner)


def _outward(direction: Array, edges: Array, edge: Array, at: Array) -> Array:
    """Unit vectors of edges, pointing away from one of their ends."""
    sign = np.where(edges[edge, 0] == at, 1.0, -1.0)
    return sign[:, None] * direction[edge]


def straight_difference(v: Array, straight: Array) -> Array:
    """(v_j-v_i)/|v_j-v_i| - (v_i-v_k)/|v_i-v_k| of straight turns (K, 3).  (K, 2)."""
    i, j, k = straight.T
    a, b = v[j] - v[i], v[i] - v[k]
    length_a, length_b = np.linalg.norm(a, axis=1), np.linalg.norm(b, axis=1)
    # An edge of no length has no direction; it adds nothing rather than NaN.
    return a / np.maximum(length_a, 1e-300)[:, None] - b / np.maximum(length_b, 1e-300)[:, None]


def _among(pairs: Array, a: Array, b: Array, count: int) -> Array:
    """Which of the pairs (a, b) of edges are, in either order, among (T, 2) given ones."""
    key = np.minimum(a, b) * count + np.maximum(a, b)
    return np.isin(key, pairs.min(axis=1, initial=count) * count + pairs.max(axis=1, initial=-1))


def _turns_of(graph: Graph, turn: Turns, straight: Array) -> Array:
    """The number among the turns of every straight one, (K, 3) -> (K,) int."""
    count = len(graph.points)
    assert count < 2_000_000, "sample numbers no longer fit a 64-bit key"
    if not len(straight):
        return np.zeros(0, dtype=int)
    key = (turn.i * count + turn.j) * count + turn.k
    order = np.argsort(key)
    wanted = (straight[:, 0] * count + straight[:, 1]) * count + straight[:, 2]
    return order[np.searchsorted(key, wanted, sorter=order)]
