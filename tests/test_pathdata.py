# SPDX-License-Identifier: GPL-2.0-or-later
"""Reading and writing path data, against the grammar and the ellipse's equation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from alup.geometry.bezier import evaluate
from alup.messages.errors import DocumentError
from alup.svg import path_data
from alup.svg.path_data import ARC, CLOSE, CURVE, LINE, Pieces, Subpath, parse

KINDS = {LINE: "L", CURVE: "C", ARC: "A", CLOSE: "z"}


def kinds(subpath: Subpath) -> str:
    return "".join(KINDS[k] for k in subpath.kind)


def nodes(subpath: Subpath) -> list[list[float]]:
    """Start of every segment, then the last end."""
    if not len(subpath.control):
        return [subpath.start.tolist()]
    return [*subpath.control[:, 0].tolist(), subpath.control[-1, 3].tolist()]


def one(d: str) -> Subpath:
    (subpath,) = parse(d)
    return subpath


def written(
    subpath: Subpath, control: np.ndarray | None = None, decimals: int = 9, tolerance: float = 1e-6
) -> str:
    """The subpath as it is, or with other control points."""
    control = subpath.control if control is None else control
    line = np.isin(subpath.kind, (LINE, CLOSE))
    return path_data.subpath_data(
        subpath, Pieces(control, np.arange(len(control)), line), decimals, tolerance
    )


# --- grammar ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("d", "kind", "points"),
    [
        ("M1,2L3,4", "L", [[1, 2], [3, 4]]),
        ("m1,2 3,4", "L", [[1, 2], [4, 6]]),  # further pairs are lines, relative as the m
        ("M1 2 3 4 5 6", "LL", [[1, 2], [3, 4], [5, 6]]),
        ("M0,0 m5,5 l1,0", "L", [[5, 5], [6, 5]]),  # of the second subpath
        ("M1-2L.5.5", "L", [[1, -2], [0.5, 0.5]]),  # signs and points separate
        ("M1e1,2E-1 L+3,-4.", "L", [[10, 0.2], [3, -4]]),
        ("\n M 1 , 2\tL\r3\f4 ", "L", [[1, 2], [3, 4]]),
        ("M1,2H5V7h-1v-2", "LLLL", [[1, 2], [5, 2], [5, 7], [4, 7], [4, 5]]),
        ("M1,2H3 4", "LL", [[1, 2], [3, 2], [4, 2]]),
        ("M1,2 l1,1 2,2", "LL", [[1, 2], [2, 3], [4, 5]]),
        ("M1,2 3,4 Z", "Lz", [[1, 2], [3, 4], [1, 2]]),
        ("M1,2 3,4 1,2 Z", "LL", [[1, 2], [3, 4], [1, 2]]),  # z closes without a line
        ("M1,2 3,4 z", "Lz", [[1, 2], [3, 4], [1, 2]]),
    ],
)
def test_lines(d: str, kind: str, points: list[list[float]]) -> None:
    subpath = parse(d)[-1]
    assert kinds(subpath) == kind
    assert np.array(nodes(subpath)) == pytest.approx(np.array(points))
    assert subpath.closed is (d.strip()[-1] in "zZ")


def test_lines_have_their_control_points_at_the_thirds() -> None:
    assert one("M0,0 3,6").control[0] == pytest.approx(np.array([[0, 0], [1, 2], [2, 4], [3, 6]]))


@pytest.mark.parametrize(
    ("d", "control"),
    [
        ("M0,0C1,1,2,1,3,0", [[[0, 0], [1, 1], [2, 1], [3, 0]]]),
        ("M1,1c1,1,2,1,3,0", [[[1, 1], [2, 2], [3, 2], [4, 1]]]),
        # A repeated segment begins where the last one ended.
        (
            "M1,1c1,1,2,1,3,0 0,1 1,2 0,3",
            [[[1, 1], [2, 2], [3, 2], [4, 1]], [[4, 1], [4, 2], [5, 3], [4, 4]]],
        ),
        # S mirrors the last control point of a C or S.
        ("M0,0C1,1,2,1,3,0S5,4,6,0", [[[0, 0], [1, 1], [2, 1], [3, 0]], [[3, 0], [4, -1], [5, 4], [6, 0]]]),
        ("M0,0C1,1,2,1,3,0s2,4,3,0", [[[0, 0], [1, 1], [2, 1], [3, 0]], [[3, 0], [4, -1], [5, 4], [6, 0]]]),
        # After any other command the control point is the node.
        ("M0,0S1,4,3,0", [[[0, 0], [0, 0], [1, 4], [3, 0]]]),
        ("M3,0Q5,5 6,0S7,4,9,0", [None, [[6, 0], [6, 0], [7, 4], [9, 0]]]),
        ("M0,0C1,1,2,1,3,0L6,0S7,4,9,0", [None, None, [[6, 0], [6, 0], [7, 4], [9, 0]]]),
        # A quadratic is elevated to a cubic.
        ("M0,0Q3,6 6,0", [[[0, 0], [2, 4], [4, 4], [6, 0]]]),
        ("M1,0q3,6 6,0", [[[1, 0], [3, 4], [5, 4], [7, 0]]]),
        # T mirrors the control point of the Q or T before it.
        ("M0,0Q3,6 6,0T12,0", [[[0, 0], [2, 4], [4, 4], [6, 0]], [[6, 0], [8, -4], [10, -4], [12, 0]]]),
        ("M0,0Q3,6 6,0t6,0 6,0", [None, None, [[12, 0], [14, 4], [16, 4], [18, 0]]]),
        # After any other command T's control point is the node.
        ("M0,0C1,1,2,1,3,0T6,0", [None, [[3, 0], [3, 0], [4, 0], [6, 0]]]),
        ("M0,0T3,0", [[[0, 0], [0, 0], [1, 0], [3, 0]]]),
        # z is such a command, too.
        ("M0,0C1,1,2,1,3,0ZS5,4,6,0", [[[0, 0], [0, 0], [5, 4], [6, 0]]]),
    ],
)
def test_curves(d: str, control: list[list[list[float]] | None]) -> None:
    subpath = parse(d)[-1]
    assert kinds(subpath) == "C" * len(control) or "L" in d
    assert len(subpath.control) == len(control)
    for found, wanted in zip(subpath.control, control):
        if wanted is not None:
            assert found == pytest.approx(np.array(wanted), abs=1e-12)


def test_subpaths_and_what_they_start_from() -> None:
    first, second, third = parse("M10,10 h5 v5 z l1,1 m2,2 l3,0")
    assert (kinds(first), first.closed) == ("LLz", True)
    # After z without M a new subpath begins where the last one did.
    assert (kinds(second), second.closed, nodes(second)) == ("L", False, [[10, 10], [11, 11]])
    # A relative m counts from the current point.
    assert nodes(third) == [[13, 13], [16, 13]]
    # After z the current point is the subpath's start.
    assert nodes(parse("M10,10 h5 v5 z m1,0 h1")[1]) == [[11, 10], [12, 10]]


def test_single_node_subpaths_are_kept() -> None:
    lone, dot, last = parse("M1,1 M2,2z M3,3")
    assert [len(s.control) for s in (lone, dot, last)] == [0, 0, 0]
    assert [s.closed for s in (lone, dot, last)] == [False, True, False]
    assert [s.start.tolist() for s in (lone, dot, last)] == [[1, 1], [2, 2], [3, 3]]
    assert path_data.point_data(dot.start, dot.closed, 3) == "M 2,2 Z"
    assert path_data.point_data(lone.start, lone.closed, 3) == "M 1,1"


@pytest.mark.parametrize("d", ["", "  \n", "\t"])
def test_nothing_is_no_subpath(d: str) -> None:
    assert parse(d) == ()


@pytest.mark.parametrize(
    ("d", "position"),
    [
        ("L1,1", 1),
        ("1,1", 1),
        ("M", 2),
        ("M1", 3),
        ("M1,x", 3),
        ("M1,1 L2", 8),
        ("M1,1 L2,2 3", 12),
        ("M1,1 X2,2", 5),
        ("M1,1 z 2,2", 7),
        ("M1,1 C1,1 2,2", 14),
        ("M1,1 A1,1 0 2 0 5,5", 12),
        ("M1,1 Lnan,1", 7),
        ("M1,1 L1,inf", 8),
        ("M1,1 L1,#", 8),
    ],
)
def test_unreadable_path_data_is_named_with_the_position(d: str, position: int) -> None:
    with pytest.raises(DocumentError, match=rf"can't be read at character {position} ") as caught:
        parse(d)
    rest = d[position - 1 : position + 11].strip()
    assert f"\u201c{rest}\u201d" in str(caught.value)


# --- arcs ---------------------------------------------------------------------------------------


def circle_coordinates(points: np.ndarray, rx: float, ry: float, degrees: float) -> np.ndarray:
    """Points (n, 2) turned back by the rotation and divided by the radii."""
    angle = math.radians(degrees)
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    return points @ turn.T / [rx, ry]


def arc_points(d: str) -> np.ndarray:
    subpath = one(d)
    return evaluate(subpath.control[:, None], np.linspace(0, 1, 33)[None]).reshape(-1, 2)


def centre_and_swept(unit: np.ndarray) -> tuple[np.ndarray, float]:
    """Centre of the circle through many points, and the signed angle from the first to the last."""
    lifted = np.column_stack([2 * unit, np.ones(len(unit))])
    centre = np.linalg.lstsq(lifted, (unit**2).sum(axis=1), rcond=None)[0][:2]
    around = unit - centre
    angle = np.unwrap(np.arctan2(around[:, 1], around[:, 0]))
    return centre, float(angle[-1] - angle[0])


@settings(max_examples=150, deadline=None)
@given(
    st.floats(-100, 100), st.floats(-100, 100), st.floats(-100, 100), st.floats(-100, 100),
    st.floats(1, 300), st.floats(0.02, 1), st.floats(-360, 360), st.booleans(), st.booleans(),
)  # fmt: skip
def test_an_arc_is_on_its_ellipse(
    x0: float, y0: float, x1: float, y1: float,
    rx: float, ratio: float, degrees: float, large: bool, sweep: bool,
) -> None:  # fmt: skip
    ry = ratio * rx
    assume(math.hypot(x1 - x0, y1 - y0) > 1.0)
    d = f"M{x0!r},{y0!r} A{rx!r},{ry!r},{degrees!r},{int(large)},{int(sweep)},{x1!r},{y1!r}"
    points = arc_points(d)
    assert (points[0] == [x0, y0]).all()
    assert (points[-1] == [x1, y1]).all()
    unit = circle_coordinates(points, rx, ry, degrees)
    half = float(np.linalg.norm(unit[-1] - unit[0])) / 2.0
    assume(not 0.98 < half < 1.0)  # centre and length of all but half circles are ill-conditioned
    radius = max(1.0, half)  # radii that are too small to reach grow until they do
    centre, swept = centre_and_swept(unit)
    # A quarter turn as a cubic is off by 2.7e-4 of the radius.
    assert np.linalg.norm(unit - centre, axis=1) == pytest.approx(radius, abs=4e-4 * radius)
    assert (swept > 0) == sweep
    if half < 1.0:
        assert (abs(swept) > math.pi) == large
        wanted = 2 * math.asin(half)
        assert abs(swept) == pytest.approx(2 * math.pi - wanted if large else wanted, abs=2e-2)
    else:
        assert abs(swept) == pytest.approx(math.pi, abs=2e-3)


def test_an_arc_that_does_not_reach_is_a_half_ellipse_of_the_same_shape() -> None:
    points = arc_points("M0,0 A1,0.5 0 0 1 10,0")  # 10 apart: radii 5 and 2.5
    assert points[:, 1].min() == pytest.approx(-2.5, abs=1e-3)
    assert points[:, 0].min() >= -1e-9
    assert points[:, 0].max() <= 10 + 1e-9


@pytest.mark.parametrize(
    ("compact", "spaced"),
    [
        ("M0,0a1 1 0 01.5.5", "M0,0 a 1 1 0 0 1 0.5 0.5"),
        ("M0,0a1 1 0 10-.5.5", "M0,0 a 1 1 0 1 0 -0.5 0.5"),
        ("M0,0a1,1,0,0,1,.5.5", "M0,0 a 1 1 0 0 1 0.5 0.5"),
        ("M0,0a1 1 0 01.5.5 1 1 0 001,0", "M0,0 a1,1,0,0,1,0.5,0.5 a1,1,0,0,0,1,0"),
        ("M0,0a1 1 0 00011 1", "M0,0 a1 1 0 0 0 011 1"),
    ],
)
def test_compact_flags(compact: str, spaced: str) -> None:
    assert one(compact).control == pytest.approx(one(spaced).control)


def test_degenerate_arcs() -> None:
    assert kinds(one("M0,0 A0,5 0 0 1 3,3")) == "L"
    assert kinds(one("M0,0 A5,0 0 0 1 3,3")) == "L"
    assert kinds(one("M0,0 A5,5 0 0 1 0,0")) == ""  # an arc to where it is: nothing
    assert one("M0,0 A-5,-3 20 0 1 3,3").control == pytest.approx(one("M0,0 A5,3 20 0 1 3,3").control)
    subpath = one("M0,0 A5,5 0 0 1 10,0 A5,5 0 0 1 0,0 Z")
    assert (kinds(subpath), subpath.arc.tolist(), subpath.closed) == ("AAAA", [0, 0, 1, 1], True)


# --- writing ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "decimals", "text"),
    [
        (1.0, 3, "1"), (1.25, 3, "1.25"), (-0.0001, 3, "0"), (0.0, 0, "0"), (1e-9, 9, "0.000000001"),
        (123456789.125, 2, "123456789.12"), (-1.5, 1, "-1.5"), (100.0, 0, "100"), (2.5e6, 3, "2500000"),
        (7.6, -2, "8"),
    ],
)  # fmt: skip
def test_numbers(value: float, decimals: int, text: str) -> None:
    assert path_data.number(value, decimals) == text


MIXED = "M1.23456789,2 L3,4.5 H7 V-3 C1,1 2,2.25 3,3 S5,5 6,1 Q7,7 8,1 T9,2 A5,3 30 0 1 12,9 L20,3"


@pytest.mark.parametrize("end", ["", " Z"])
@pytest.mark.parametrize("decimals", [0, 2, 6])
def test_round_trip_to_the_rounding(decimals: int, end: str) -> None:
    before = one(MIXED + end)
    # An arc is drawn again through rounded numbers.  Far from a half ellipse, as here, that moves it by a few
    # roundings at most.
    text = written(before, decimals=decimals, tolerance=1e-6 if decimals == 6 else 10.0)
    after = one(text)
    assert kinds(after) == kinds(before)
    assert after.closed == before.closed
    curved = before.kind == ARC
    rounding = 0.5 * 10.0**-decimals * (1 + 1e-9)
    # The thirds of lines are computed from their ends, so they are no further off.
    assert np.abs(after.control - before.control)[~curved].max() <= rounding
    assert np.abs(after.control - before.control)[curved].max() <= 20 * rounding
    assert written(after, decimals=decimals, tolerance=10.0) == text


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(*[st.floats(-1e4, 1e4)] * 6), min_size=1, max_size=6), st.booleans())
def test_round_trip_of_random_curves(curves: list[tuple[float, ...]], closed: bool) -> None:
    d = "M1,1 " + " ".join("C" + " ".join(repr(x) for x in numbers) for numbers in curves)
    before = one(d + (" Z" if closed else ""))
    after = one(written(before, decimals=4))
    # A closing line whose length is rounded to zero is not written.
    k = len(curves)
    assert len(after.control) in (len(before.control), k)
    assert np.abs(after.control[:k] - before.control[:k]).max() <= 0.5001e-4
    assert after.closed == closed


def test_added_nodes_are_written_and_the_closing_line_is_left_to_z() -> None:
    before = one("M0,0 H10 V10 Z")
    last = before.control[2]
    middle = np.array([6.0, 4.0])
    parts = np.array(
        [
            before.control[0],
            before.control[1],
            np.linspace(last[0], middle, 4),
            np.linspace(middle, last[3], 4),
        ]
    )
    text = path_data.subpath_data(before, Pieces(parts, np.array([0, 1, 2, 2]), np.ones(4, bool)), 3, 0.0)
    assert text == "M 0,0 L 10,0 L 10,10 L 6,4 Z"


# An arc of each kind: small, large, either direction, turned, half, radii too small.
ARCS = [
    "M0,0 A10,6 0 0 1 8,5",
    "M0,0 A10,6 0 1 0 8,5",
    "M3,-2 A10,4 30 1 1 8,5",
    "M0,0 A7,7 0 0 0 9,3",
    "M0,0 A10,10 0 0 1 20,0",
    "M0,0 A2,1 25 0 1 20,3",
]
MAPS = {
    "turn": [[0.6, -0.8], [0.8, 0.6]],
    "mirror": [[-1.0, 0.0], [0.0, 1.0]],
    "scale": [[2.0, 0.0], [0.0, 2.0]],
    "stretch": [[3.0, 0.0], [0.0, 0.5]],
    "skew": [[1.0, 0.7], [0.0, 1.0]],
    "skewed mirror": [[0.4, 1.1], [0.9, -0.2]],
}


@pytest.mark.parametrize("linear", MAPS.values(), ids=MAPS.keys())
@pytest.mark.parametrize("d", ARCS)
def test_arcs_stay_arcs_under_affine_maps(d: str, linear: list[list[float]]) -> None:
    before = one(d)
    control = before.control @ np.array(linear).T + [5.0, -7.0]
    text = written(before, control, decimals=9, tolerance=1e-5)
    assert text.split()[2] == "A"
    assert "C" not in text
    after = one(text)
    assert np.abs(after.control - control).max() <= 1e-5
    # The same ellipse: both drawn anew and compared as points.
    t = np.linspace(0, 1, 33)[None]
    assert np.abs(evaluate(after.control[:, None], t) - evaluate(control[:, None], t)).max() <= 1e-5


@pytest.mark.parametrize("d", ARCS)
def test_arcs_that_are_no_ellipse_any_more_become_curves(d: str) -> None:
    before = one(d)
    control = before.control.copy()
    control[0, 2] += [0.5, 0.5]
    text = written(before, control, decimals=9, tolerance=1e-2)
    assert "A" not in text
    assert one(text).control == pytest.approx(control)
    # Within the tolerance it may stay one.
    control = before.control + 1e-4 * np.sin(np.arange(before.control.size)).reshape(before.control.shape)
    assert "A" in written(before, control, tolerance=0.05)
    assert "A" not in written(before, control, tolerance=1e-6)


@pytest.mark.parametrize("tolerance", [1e-3, 5.0])
def test_an_arc_that_would_leave_in_another_direction_becomes_a_curve(tolerance: float) -> None:
    # Whatever the tolerance: a smooth node beside it would get a corner.
    before = one("M0,0 A10,6 0 0 1 8,5")
    control = before.control.copy()
    control[0, 1] = control[0, 0] + [[0.999, -0.04], [0.04, 0.999]] @ (control[0, 1] - control[0, 0])
    assert "A" not in written(before, control, tolerance=tolerance)


def test_arcs_with_an_added_node_become_curves() -> None:
    before = one("M0,0 A10,6 0 0 1 8,5")
    from alup.geometry.bezier import subrange

    whole = before.control[0]
    parts = np.stack([subrange(whole, a, b) for a, b in np.array(((0.0, 0.5), (0.5, 1.0)))])
    text = path_data.subpath_data(before, Pieces(parts, np.array([0, 0]), np.zeros(2, bool)), 6, 1.0)
    assert text.count("C") == 2
    assert "A" not in text


def test_an_arc_squashed_flat_becomes_a_curve() -> None:
    before = one("M0,0 A10,6 0 0 1 8,5")
    flat = before.control * [1.0, 0.0]
    text = written(before, flat, tolerance=1e-3)
    assert "A" not in text
    assert one(text).control == pytest.approx(flat)


def test_one_arc_of_two_may_stay() -> None:
    before = one("M0,0 A10,6 0 0 1 8,5 A3,3 0 0 1 12,5")
    control = before.control.copy()
    control[-1, 1] += 1.0
    text = written(before, control, decimals=6, tolerance=1e-3)
    assert [word for word in text.split() if word.isalpha()][:2] == ["M", "A"]
    assert "C" in text
