# SPDX-License-Identifier: GPL-2.0-or-later
"""Welding: stacked shapes become one curve network."""

from __future__ import annotations

import numpy as np
import pytest
from builders import drawing, mapped, rotation

from alup.geometry.bezier import evaluate
from alup.messages.errors import DocumentError
from alup.model import Drawing
from alup.network import weld
from alup.network.weld import Network

TWO_SQUARES = ("M0,0 H10 V10 H0 Z", "M10,0 H20 V10 H10 Z")  # the border between them twice


def build(before: Drawing) -> Network:
    return weld.build(before, weld.SNAP_DISTANCE * before.diagonal)


def check(before: Drawing, net: Network, tolerance: float) -> None:
    """What holds of every network: pieces lie on their curves, ends are vertices."""
    assert (np.diff(net.segment) >= 0).all()
    assert set(net.segment) == set(range(len(before.control)))
    for piece in range(len(net.segment)):
        control = before.control[net.segment[piece]]
        for end in (0, 1):
            point = evaluate(control, net.span[piece, end])
            assert point == pytest.approx(net.vertices[net.piece_ends[piece, end]], abs=2 * tolerance)
        curve = net.curve[piece]
        if curve < 0:
            assert net.piece_ends[piece, 0] == net.piece_ends[piece, 1]
            continue
        ends = net.piece_ends[piece][::-1] if net.backwards[piece] else net.piece_ends[piece]
        assert (net.ends[curve] == ends).all()
        # A piece and its curve run through the same points, in the same order or in reverse.
        t = np.linspace(0, 1, 201)
        mine = evaluate(control, net.span[piece, 0] + t * np.ptp(net.span[piece]))
        other = evaluate(net.curves[curve], t)
        apart = np.linalg.norm(mine[:, None] - other[None], axis=2)
        step = np.linalg.norm(np.diff(other, axis=0), axis=1).max()
        assert apart.min(axis=1).max() <= step + 3 * tolerance
    assert set(net.curve[net.curve >= 0]) == set(range(len(net.curves)))


def test_a_lone_path_is_its_own_network() -> None:
    before = drawing("M0,0 L10,0 C12,5 8,8 10,10 Z")
    net = build(before)
    check(before, net, 1e-3)
    assert len(net.curves) == 3
    assert len(net.vertices) == 3
    assert net.straight.tolist() == [True, False, True]
    assert net.ends.tolist() == [[0, 1], [1, 2], [2, 0]]
    assert net.curves == pytest.approx(before.control, abs=1e-12)


def test_a_shared_border_is_one_curve_run_through_both_ways() -> None:
    before = drawing(*TWO_SQUARES)
    net = build(before)
    check(before, net, 1e-3)
    assert len(before.control) == 8
    assert len(net.curves) == 7
    assert len(net.vertices) == 6
    border = net.curve[1]
    assert net.curve[7] == border
    assert net.backwards[1] != net.backwards[7]
    assert np.count_nonzero(net.curve == border) == 2


@pytest.mark.parametrize("reverse", [False, True])
def test_a_shared_curve_in_either_direction(reverse: bool) -> None:
    second = "M10,10 C5,13 3,-6 0,0" if reverse else "M0,0 C3,-6 5,13 10,10"
    before = drawing("M0,0 C3,-6 5,13 10,10", second)
    net = build(before)
    check(before, net, 1e-3)
    assert len(net.curves) == 1
    assert net.backwards.tolist() == [False, reverse]


def test_a_copy_with_other_control_points_is_the_same_line() -> None:
    # Straight, but at uneven speed and, once, degenerate: lines are compared as point sets.
    before = drawing("M0,0 L30,0", "M0,0 C0,0 5,0 30,0", "M30,0 C1,0 1,0 0,0")
    net = build(before)
    assert len(net.curves) == 1
    assert net.backwards.tolist() == [False, False, True]


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize(("apart", "same"), [(2.9, True), (3.1, False)])
def test_copies_are_one_curve_up_to_three_tolerances(apart: float, same: bool, reverse: bool) -> None:
    """Both have the same nodes; one is bowed by this much more in the middle."""
    tolerance = weld.SNAP_DISTANCE * float(np.hypot(100.0, 30.0))
    bow = repr(30.0 + apart * tolerance / 0.75)
    copy = f"M100,0 C70,{bow} 30,{bow} 0,0" if reverse else f"M0,0 C30,{bow} 70,{bow} 100,0"
    net = build(drawing("M0,0 C30,30 70,30 100,0", copy, "M0,30 V29"))
    assert (net.curve[0] == net.curve[1]) == same
    assert net.backwards.tolist() == [False, reverse and same, False]


def test_different_curves_between_the_same_nodes_stay_apart() -> None:
    before = drawing("M0,0 C0,5 10,5 10,0", "M0,0 C0,-5 10,-5 10,0", "M0,0 L10,0", "M10,0 C10,5 0,5 0,0")
    net = build(before)
    check(before, net, 1e-3)
    assert len(net.curves) == 3
    assert net.curve.tolist() == [0, 1, 2, 0]
    assert net.backwards.tolist() == [False, False, False, True]
    assert len(net.vertices) == 2


@pytest.mark.parametrize(("offset", "joined"), [(0.0, True), (3e-5, True), (1e-3, False)])
def test_nodes_are_welded_within_the_tolerance_only(offset: float, joined: bool) -> None:
    """Offsets are parts of the diagonal."""
    diagonal = float(np.hypot(20.0, 10.0))
    gap = offset * diagonal
    before = drawing("M0,0 L10,5", f"M{10 + gap!r},5 L20,10")
    net = build(before)
    assert (len(net.vertices) == 3) is joined
    if joined:  # the vertex is between its ends
        assert np.abs(net.vertices - [10 + gap / 2, 5]).max(axis=1).min() < 1e-12


def test_closers_of_rounding_size_are_points() -> None:
    # A path that ends 2e-5 of its diagonal beside its start, then z: icons are full of them.
    before = drawing("M0,0 H100 V100 L0,0.003 Z")
    net = build(before)
    check(before, net, 0.01)
    assert net.curve.tolist()[:3] == [0, 1, 2]
    assert net.curve[3] == -1
    assert len(net.vertices) == 3


def test_short_segments_of_the_size_of_a_detail_are_not_points() -> None:
    before = drawing("M0,0 H100 V100 L0,1 Z")
    assert (build(before).curve >= 0).all()


@pytest.mark.parametrize(("length", "point"), [(1.9, True), (2.1, False)])
def test_a_loop_shorter_than_two_tolerances_is_a_point(length: float, point: bool) -> None:
    tolerance = weld.SNAP_DISTANCE * float(np.hypot(100.0, 100.0))
    height = repr(0.5 * length * tolerance)
    net = build(drawing(f"M0,0 C0,{height} 0,{height} 0,0 L100,100", "M100,0 V100"))
    assert (net.curve[0] == -1) == point
    assert (net.curve[1:] >= 0).all()
    assert net.piece_ends[0, 0] == net.piece_ends[0, 1]


def test_a_short_segment_between_two_vertices_is_no_point() -> None:
    net = weld.build(drawing("M0,0 L50,0 L50,1.5 L50,50"), 1.0)
    assert net.curve.tolist() == [0, 1, 2]
    assert len(net.vertices) == 4


def test_lines_between_two_vertices_are_one_however_wide_these_are() -> None:
    """Ends that are welded one to the next may lie further apart than copies of a curve."""
    fans = [f"M{x},{0.9 * n} L{1.4 * x - 20},{20 * n}" for n in (1, 2, 3) for x in (0, 100)]
    net = weld.build(drawing("M0,0 H100", "M0,3.6 H100", *fans), 1.0)
    assert np.array_equal(net.piece_ends[0], net.piece_ends[1])
    assert net.curve[0] == net.curve[1]


def test_a_loop_is_kept() -> None:
    # It ends where it starts, but is no point; its copy is the same curve.
    before = drawing("M0,0 C20,20 -20,20 0,0", "M0,0 C20,20 -20,20 0,0")
    net = build(before)
    assert net.curve.tolist() == [0, 0]
    assert net.ends.tolist() == [[0, 0]]


def test_a_loop_run_the_other_way_is_the_same_curve() -> None:
    before = drawing("M0,0 C20,20 -20,10 0,0", "M0,0 C-20,10 20,20 0,0")
    net = build(before)
    assert net.curve.tolist() == [0, 0]
    assert net.backwards.tolist() == [False, True]


def test_a_loop_out_and_back_is_one_curve_run_twice() -> None:
    net = build(drawing("M0,0 C20,20 20,20 0,0", "M30,0 V30"))
    assert net.curve.tolist() == [0, 0, 1]
    assert net.backwards.tolist() == [False, True, False]
    assert net.vertices[net.ends[0]] == pytest.approx(np.array([[0.0, 0.0], [15.0, 15.0]]), abs=1e-6)
    assert len(net.through) == 0  # it turns back at its tip, so nothing runs on


def test_three_regions_meet_in_one_vertex() -> None:
    before = drawing("M0,0 H10 V10 Z", "M0,0 V10 H10 Z", "M0,0 L-5,-5")
    net = build(before)
    check(before, net, 1e-3)
    at_origin = np.flatnonzero(np.linalg.norm(net.vertices, axis=1) < 1e-9)
    assert len(at_origin) == 1
    assert np.count_nonzero(net.ends == at_origin[0]) == 4  # the diagonal is shared
    assert len(net.curves) == 6


def test_straight_cubics_are_straight_and_turning_back_is_not() -> None:
    before = drawing("M0,0 C1,1 2,2 30,30", "M100,0 C130,0 70,0 120,0", "M0,50 C10,51 20,50 30,50")
    net = build(before)
    straight = [net.straight[net.curve[net.segment == segment]] for segment in range(3)]
    assert [bool(s.all()) for s in straight] == [True, False, False]
    assert not straight[1].any()


@pytest.mark.parametrize(
    ("chord", "sagitta", "straight"),
    [(10.0, 9e-4, True), (10.0, 11e-4, False), (1000.0, 0.013, True), (1000.0, 0.014, False)],
)
def test_a_cubic_is_straight_to_the_limits_of_its_chord_and_of_the_drawing(
    chord: float, sagitta: float, straight: bool
) -> None:
    """1e-4 of the chord, which decides for short ones, and 1e-5 of the diagonal, 1345 here."""
    before = drawing(f"M0,0 C{chord / 3},{sagitta} {chord / 2},0 {chord},0", "M0,-900 H1000")
    assert before.diagonal == pytest.approx(1345.4, abs=0.1)
    assert build(before).straight[0] == straight


def canonical(before: Drawing, net: Network) -> tuple[list, list]:
    """The network by positions only."""
    position = [tuple(p) for p in net.vertices.round(6)]
    curves = sorted(
        tuple(sorted((position[a], position[b]))) + (bool(s),) for (a, b), s in zip(net.ends, net.straight)
    )
    return sorted(position), curves


def test_the_order_of_the_paths_only_changes_numbers() -> None:
    paths = [*TWO_SQUARES, "M20,0 C25,5 25,5 20,10 Z", "M5,5 L6,6", "M10,10 L10,0"]
    first = drawing(*paths)
    for order in ([4, 3, 2, 1, 0], [2, 0, 4, 1, 3]):
        second = drawing(*[paths[n] for n in order])
        assert canonical(second, build(second)) == canonical(first, build(first))


def test_the_network_turns_and_grows_with_the_drawing() -> None:
    before = drawing(*TWO_SQUARES, "M20,0 C25,5 25,5 20,10 Z")
    for linear in (rotation(33.0), 1e-4 * np.eye(2), 1e5 * rotation(200.0), np.diag([-1.0, 1.0])):
        after = mapped(before, linear, [7.0, -3.0])
        a, b = build(before), build(after)
        assert (a.ends == b.ends).all()
        assert (a.curve == b.curve).all()
        assert (a.backwards == b.backwards).all()
        scale = np.abs(linear).max()
        assert np.abs(a.vertices @ linear.T + [7.0, -3.0] - b.vertices).max() < 1e-9 * max(scale, 1.0) * 30


@pytest.mark.parametrize(("at", "size"), [(1e6, 1e-4), (0.0, 1e-100)])
def test_a_drawing_below_the_digits_of_its_coordinates_is_refused(at: float, size: float) -> None:
    """Its size is below 1e-10 of its coordinates, or the squares of its lengths underflow or overflow."""
    # In absolute coordinates: a relative path that ends this near to its start is closed already.
    ends = [at + part * size for part in (0.9, 1.2)]
    small, enough = (drawing(f"M{at!r},{at!r} H{end!r} V{end!r} z") for end in ends)
    with pytest.raises(DocumentError, match="too small for their coordinates"):
        build(small)
    assert len(build(enough).curves) == 3


# --- contacts -----------------------------------------------------------------------------------


def test_a_stripe_that_ends_on_a_border_is_joined_to_it() -> None:
    before = drawing("M0,0 H100 V60 H0 Z", "M40,0 L60,60")
    net = build(before)
    check(before, net, 1e-2)
    assert net.contacts == {"t_junctions": 2, "overlaps": 0, "crossings": 0}
    assert len(net.vertices) == 6
    assert len(net.curves) == 7
    # The border runs on through both junctions.
    assert len(net.through) == 2
    for vertex, one, two in net.through.tolist():
        assert net.vertices[vertex].round(9).tolist() in ([40.0, 0.0], [60.0, 60.0])
        assert vertex in net.ends[one]
        assert vertex in net.ends[two]
        directions = net.curves[[one, two], 3] - net.curves[[one, two], 0]
        assert np.abs(directions[:, 1]).max() < 1e-9  # along the border, not the stripe


def test_crossings_are_vertices_if_wished() -> None:
    before = drawing("M0,0 L100,60", "M0,60 L100,0")
    net = build(before)
    check(before, net, 1e-2)
    assert net.contacts == {"t_junctions": 0, "overlaps": 0, "crossings": 2}
    assert len(net.curves) == 4
    assert [50.0, 30.0] in net.vertices.round(9).tolist()
    assert len(net.through) == 2
    apart = weld.build(before, weld.SNAP_DISTANCE * before.diagonal, crossings=False)
    assert len(apart.curves) == 2
    assert len(apart.through) == 0


def test_a_border_of_which_only_a_part_is_shared() -> None:
    # The right box stands on the middle of the left one's side.
    before = drawing("M0,0 H50 V60 H0 Z", "M50,20 H100 V40 H50 Z")
    net = build(before)
    check(before, net, 1e-2)
    assert net.contacts["overlaps"] > 0
    common = set(net.curve[net.segment == 1]) & set(net.curve[net.segment == 7])
    assert len(common) == 1
    ends = net.vertices[net.ends[common.pop()]]
    assert sorted(ends.round(9).tolist()) == [[50.0, 20.0], [50.0, 40.0]]


def test_parameters_at_fractions_of_the_arc_length() -> None:
    control = drawing("M0,0 C1,30 4,-10 50,20", "M0,0 C0,0 0,0 9,9").control
    fraction = np.array([[0.0, 0.25, 0.7, 1.0]] * 2)
    t = weld.parameters_at(control, fraction)
    fine = evaluate(control[:, None], np.linspace(0, 1, 100_001)[None])
    s = np.concatenate(
        [np.zeros((2, 1)), np.cumsum(np.linalg.norm(np.diff(fine, axis=1), axis=2), axis=1)], 1
    )
    for curve in (0, 1):
        slow = np.interp(fraction[curve] * s[curve, -1], s[curve], np.linspace(0, 1, 100_001))
        assert t[curve] == pytest.approx(slow, abs=1e-3)
        gone = np.interp(t[curve], np.linspace(0, 1, 100_001), s[curve]) / s[curve, -1]
        assert gone == pytest.approx(fraction[curve], abs=1e-5)
    assert t[:, [0, 3]].tolist() == [[0.0, 1.0]] * 2


def fractions_of(control: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Fraction of the arc length before each parameter, by 200,000 chords a curve."""
    u = np.linspace(0.0, 1.0, 200_001)
    result = []
    for one, at in zip(control, t):
        steps = np.linalg.norm(np.diff(evaluate(one, u), axis=0), axis=1)
        gone = np.concatenate([[0.0], np.cumsum(steps)])
        result.append(np.interp(at, u, gone) / gone[-1])
    return np.array(result)


def test_parameters_are_of_fourth_order_in_the_intervals() -> None:
    control = drawing("M0,0 C10,10 20,10 30,0", "M0,0 C0,55 100,55 100,0").control
    fraction = np.tile(np.linspace(0.0, 1.0, 41), (2, 1))
    errors = []
    for intervals in (4, 8, 16):
        t = weld.parameters_at(control, fraction, intervals)
        errors.append(np.abs(fractions_of(control, t) - fraction).max(axis=1))
    assert (errors[2] < 3e-6).all()
    for coarse, fine in zip(errors, errors[1:]):
        assert (coarse > 10.0 * fine).all()


def test_parameters_do_not_depend_on_the_units() -> None:
    control = drawing("M0,0 C1,30 4,-10 50,20", "M0,0 C0,0 0,0 9,9").control
    fraction = np.tile(np.linspace(0.0, 1.0, 21), (2, 1))
    t = weld.parameters_at(control, fraction)
    for scale in (1e-6, 1e6):
        assert np.abs(weld.parameters_at(scale * control, fraction) - t).max() < 1e-12


@pytest.mark.parametrize("intervals", [3, 4, 16])
def test_parameters_ascend_with_the_fraction_at_cusps_too(intervals: int) -> None:
    cusps = drawing("M0,0 C90,0 -60,0 30,0", "M0,0 C40,30 0,30 40,0", "M0,0 C0,0 0,0 9,9").control
    control = np.concatenate([cusps, np.random.default_rng(0).standard_normal((300, 4, 2))])
    fraction = np.tile(np.linspace(0.0, 1.0, 501), (len(control), 1))
    assert (np.diff(weld.parameters_at(control, fraction, intervals), axis=1) > 0.0).all()


def test_curves_of_their_own_intervals_have_their_own_parameters() -> None:
    """Asking for all together, in any order, gives the same as asking one by one."""
    control = drawing("M0,0 C1,30 4,-10 50,20", "M0,0 L7,7", "M0,0 C0,55 100,55 100,0").control
    owner, intervals = np.array([2, 0, 1, 2, 0, 1, 0]), np.array([3, 9, 6])
    fraction = np.array([0.3, 1.0, 0.5, 0.0, 0.62, 0.99, 0.05])
    t = weld.parameters(control, owner, fraction, intervals)
    for n, curve in enumerate(owner):
        alone = weld.parameters_at(control[[curve]], fraction[[[n]]], int(intervals[curve]))
        assert t[n] == pytest.approx(alone[0, 0], abs=1e-14)


def test_the_ends_of_a_curve_are_exactly_its_ends() -> None:
    control = np.random.default_rng(1).standard_normal((50, 4, 2))
    fraction = np.tile([-0.0, 0.0, 1.0, 1.0], (50, 1))
    for intervals in (3, 7, 16):
        t = weld.parameters_at(control, fraction, intervals)
        assert (t == [0.0, 0.0, 1.0, 1.0]).all()


def test_a_curve_that_is_a_point_has_parameters_too() -> None:
    t = weld.parameters_at(np.full((1, 4, 2), 3.0), np.array([[0.0, 0.5, 1.0]]))
    assert t[0, [0, 2]].tolist() == [0.0, 1.0]
    assert 0.0 <= t[0, 1] <= 1.0
