# SPDX-License-Identifier: GPL-2.0-or-later
"""The whole pipeline: known answers, equivariance, parts, convergence, errors.

Tolerances.  Where the exact answer has no energy Newton's method ends within rounding of it; the
paper's scheme is published to stop early and gets what was measured for it.  Two runs on drawings
that differ by a similarity do the same arithmetic on rounded numbers; the equations' condition of
1e9 to 1e10 leaves 1e-6 of the diagonal in the worst case.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from builders import BLOB, curve_points, drag, drawing, mapped, pin, reshaped, rotation
from scipy.spatial import cKDTree

from alup.messages.errors import DocumentError, HandleError
from alup.model import Drawing, Handle, Section
from alup.network import weld
from alup.refit.refit import FIT_TOLERANCE
from alup.session.pipeline import Result
from alup.solver import minimise, outcome

INNER = "M50,60 C60,80 80,80 90,60 Z"
AT = ((10.0, 80.0), (60.0, 20.0), (60.0, 130.0), (150.0, 75.0))
SOLVERS = pytest.mark.parametrize("solver", list(minimise.SOLVERS))


def handles(linear: Any, shift: Any = (0.0, 0.0), at: Any = AT) -> list[Handle]:
    return [drag(p, tuple(np.asarray(linear) @ p + shift)) for p in at]


def edited() -> Drawing:
    """An edit that is none of the known answers."""
    return drawing(
        BLOB,
        INNER,
        "M60,20 L60,-10",
        handles=[pin(10, 80), drag((150, 75), (175, 55)), pin(60, 130), pin(60, 20)],
    )


def error(result: Result, wanted: np.ndarray, of: Drawing) -> float:
    """Largest distance of the control points, of the input's diagonal; nodes may not be added."""
    assert result.refitted.control.shape == wanted.shape
    return float(np.abs(result.refitted.control - wanted).max()) / of.diagonal


def apart(a: np.ndarray, b: np.ndarray) -> float:
    """Hausdorff distance of two sets of cubics, whatever their segments."""
    a, b = curve_points(a, 257), curve_points(b, 257)
    return float(max(cKDTree(a).query(b)[0].max(), cKDTree(b).query(a)[0].max()))


# --- known answers ------------------------------------------------------------------------------


@SOLVERS
@pytest.mark.parametrize("spacing", [0.005, 0.037])
def test_no_handle_moved_is_the_input_to_the_last_bit(solver: str, spacing: float) -> None:
    before = drawing(BLOB, INNER, "M10,80 L60,130", handles=[pin(*p) for p in AT])
    result = reshaped(before, solver=solver, spacing=spacing)
    assert (result.refitted.control == before.control).all()
    assert (result.refitted.source == np.arange(len(before.control))).all()
    assert [r["status"] for r in result.report["rounds"]] == ["UNMOVED", "UNMOVED"]
    assert result.report["handle_error_of_diagonal"] == 0.0
    assert result.report["turning_degrees"] == {"mean": 0.0, "max": 0.0}


@SOLVERS
@pytest.mark.parametrize("shift", [(30.0, -17.0), (1e-3, 0.0), (5000.0, 3000.0)])
def test_handles_translated_together_is_a_translation(solver: str, shift: tuple[float, float]) -> None:
    # The inner part and the line apart carry no handle: they come along.
    before = drawing(BLOB, INNER, "M200,0 L200,40", handles=handles(np.eye(2), shift))
    result = reshaped(before, solver=solver)
    # Of the diagonal, or of the way where that is longer: positions are solved for as increments.
    way = max(1.0, float(np.hypot(*shift)) / before.diagonal)
    assert error(result, before.control + shift, before) < 1e-6 * way


@pytest.mark.parametrize("scale", [0.6, 1.0 / 1.7, 1.5, 2.0])
@pytest.mark.parametrize(("solver", "allowed"), [("newton", 1e-6), ("paper", 0.03)])
def test_handles_consistent_with_a_uniform_scale(solver: str, allowed: float, scale: float) -> None:
    """The paper's scheme stops 0.5 to 11 % of the diagonal away; here it is under 3 %."""
    if solver not in minimise.SOLVERS:
        pytest.skip(f"there is no solver {solver}")
    before = drawing(BLOB, handles=handles(scale * np.eye(2), (7.0, -3.0)))
    result = reshaped(before, solver=solver)
    wanted = scale * before.control + [7.0, -3.0]
    if solver == "paper":
        assert apart(result.refitted.control, wanted) / before.diagonal < allowed
    else:
        assert error(result, wanted, before) < allowed
        assert result.report["rounds"][1]["energy"]["objective"][-1] < 1e-10


@SOLVERS
@pytest.mark.parametrize("factors", [(1.8, 1.0), (1.0, 0.4), (0.5, 3.0)])
def test_an_axis_aligned_box_is_stretched(solver: str, factors: tuple[float, float]) -> None:
    corners = ((0, 0), (100, 0), (100, 60), (0, 60))
    before = drawing("M0,0 H100 V60 H0 Z", handles=handles(np.diag(factors), at=corners))
    result = reshaped(before, solver=solver)
    assert error(result, before.control * factors, before) < 1e-3
    assert result.report["rounds"][1]["energy"]["normal"][-1] < 1e-9


@SOLVERS
@pytest.mark.parametrize("factors", [(1.8, 1.0), (0.5, 3.0)])
def test_nodes_within_the_sides_of_a_box_stay_on_them(solver: str, factors: tuple[float, float]) -> None:
    corners = ((0, 0), (100, 0), (100, 60), (0, 60))
    before = drawing("M0,0 H40 100 V60 H70 0 V20 Z", handles=handles(np.diag(factors), at=corners))
    after = reshaped(before, solver=solver).refitted.control
    assert after.shape == before.control.shape
    # Along the side they may slide a little: ratios of lengths across a corner count, too (eps_r).
    assert np.abs(after - before.control * factors).max() < 0.02 * before.diagonal
    sides = after[:, 3] - after[:, 0]
    assert np.abs(sides).min(axis=1).max() < 1e-6 * before.diagonal


@SOLVERS
def test_two_handles_on_a_line_stretch_it_evenly(solver: str) -> None:
    before = drawing("M0,0 L100,50", handles=[pin(0, 0), drag((100, 50), (160, 80))])
    assert error(reshaped(before, solver=solver), before.control * 1.6, before) < 1e-3


@SOLVERS
def test_handles_land_on_their_targets(solver: str) -> None:
    before = edited()
    result = reshaped(before, solver=solver)
    points = curve_points(result.refitted.control, 1025)
    for handle in before.handles:
        target = handle.rest if handle.target is None else handle.target
        assert np.linalg.norm(points - target, axis=1).min() < 5e-4 * before.diagonal
    assert result.report["handle_error_of_diagonal"] < 5e-4


# --- equivariance -------------------------------------------------------------------------------


@SOLVERS
@pytest.mark.parametrize(
    ("linear", "shift", "allowed"),
    [
        (np.eye(2), (1000.0, -300.0), 1e-6),
        (2.0 * np.eye(2), (0.0, 0.0), 1e-12),  # a power of two changes no digit
        (3.3e3 * np.eye(2), (5.0, 5.0), 1e-6),
        (1e-3 * np.eye(2), (0.0, 0.0), 1e-6),
        (np.diag([-1.0, 1.0]), (0.0, 0.0), 1e-6),
        (np.diag([1.0, -1.0]), (3.0, 400.0), 1e-6),
        (rotation(90.0), (0.0, 0.0), 1e-6),
        (rotation(180.0), (0.0, 0.0), 1e-6),
    ],
    ids=["translation", "double", "scale", "tiny", "mirror x", "mirror y", "quarter", "half turn"],
)
def test_the_pipeline_commutes(solver: str, linear: np.ndarray, shift: Any, allowed: float) -> None:
    before = edited()
    first = reshaped(before, solver=solver)
    second = reshaped(mapped(before, linear, shift), solver=solver)
    wanted = first.refitted.control @ linear.T + shift
    assert second.refitted.control.shape == wanted.shape
    size = np.sqrt(abs(np.linalg.det(linear)))
    assert np.abs(second.refitted.control - wanted).max() < allowed * size * before.diagonal
    assert (second.refitted.source == first.refitted.source).all()


@SOLVERS
@pytest.mark.parametrize("degrees", [30.0, 123.0, -45.0])
def test_turning_drawing_and_handles_together_turns_the_result(solver: str, degrees: float) -> None:
    """Spacing and fit tolerance are parts of the longest side, which changes when a drawing is turned."""
    before = edited()
    after = mapped(before, rotation(degrees))
    share = float(before.size.max() / after.size.max())
    first = reshaped(before, solver=solver)
    second = reshaped(after, solver=solver, spacing=0.005 * share, fit_tolerance=5e-4 * share)
    wanted = first.refitted.control @ rotation(degrees).T
    assert second.refitted.control.shape == wanted.shape
    assert np.abs(second.refitted.control - wanted).max() < 1e-6 * before.diagonal


@SOLVERS
def test_the_order_of_the_shapes_does_not_matter(solver: str) -> None:
    paths = [BLOB, "M60,20 L60,-10", "M200,0 L200,40 H230 Z"]
    wishes = [pin(10, 80), drag((150, 75), (175, 55)), pin(60, 130), pin(200, 0), drag((230, 40), (250, 50))]
    one = reshaped(drawing(*paths, handles=wishes), solver=solver, limits=outcome.Limits(iterations=20))
    two = reshaped(
        drawing(*paths[::-1], handles=wishes[::-1]), solver=solver, limits=outcome.Limits(iterations=20)
    )
    assert apart(one.refitted.control, two.refitted.control) < 1e-9


# --- parts --------------------------------------------------------------------------------------


@pytest.mark.parametrize("add_nodes", [True, False])
def test_no_node_is_added_where_none_is_wanted(add_nodes: bool) -> None:
    """What that costs is in the report."""
    before = drawing(
        "M0,0 C30,60 70,-60 100,0 V80 H0 Z", handles=[pin(0, 0), drag((50, 0), (60, 30)), pin(100, 80)]
    )
    result = reshaped(before, add_nodes=add_nodes)
    kept = result.report["segments_after"] == result.report["segments"]
    assert kept is not add_nodes
    told = any("No nodes were added" in note for note in result.report["notes"])
    assert told is not add_nodes
    within = result.report["fit_error_of_longest_side"] <= FIT_TOLERANCE
    assert within is add_nodes


def test_parts_without_a_handle_move_along_in_tandem() -> None:
    before = drawing(BLOB, INNER, handles=handles(np.eye(2), (25.0, 10.0)))
    result = reshaped(before)
    assert result.report["components"] == 2
    assert result.report["ties"]["facing"] > 10
    assert error(result, before.control + [25.0, 10.0], before) < 1e-6


def test_parts_without_a_handle_stay_when_told() -> None:
    before = drawing(BLOB, INNER, handles=handles(np.eye(2), (25.0, 10.0)))
    result = reshaped(before, hold="apart")
    outer = before.shape == 0
    assert (result.refitted.control[~outer] == before.control[~outer]).all()
    assert np.abs(result.refitted.control[outer] - before.control[outer] - [25.0, 10.0]).max() < 1e-4
    assert result.report["stays"] == 1


@SOLVERS
def test_an_inner_part_follows_a_stretch_around_it(solver: str) -> None:
    corners = ((0, 0), (100, 0), (100, 60), (0, 60))
    square = "M70,20 H90 V40 H70 Z"
    before = drawing("M0,0 H100 V60 H0 Z", square, handles=handles(np.diag([2.0, 1.0]), at=corners))
    after = reshaped(before, solver=solver).refitted.control[4:].reshape(-1, 2)
    middle, size = after.mean(axis=0), np.ptp(after, axis=0)
    assert 130.0 < middle[0] < 190.0  # its middle was at 80 of 100
    assert middle[1] == pytest.approx(30.0, abs=0.5)
    assert 0.8 < size[1] / size[0] < 1.05  # pulled along one axis, it hardly stretches
    assert after.min() > 0.0
    assert after[:, 1].max() < 60.0
    if solver == "paper":
        assert size == pytest.approx(20.0, rel=0.01)


def test_a_handle_on_each_part_moves_each() -> None:
    before = drawing(
        "M0,0 H10",
        "M0,20 H10",
        handles=[drag((0, 0), (5, 0)), drag((10, 0), (15, 0)), pin(0, 20), pin(10, 20)],
    )
    result = reshaped(before, hold="apart")
    assert error(result, before.control + np.array([[[5.0, 0.0]], [[0.0, 0.0]]]), before) < 1e-6


def test_shared_borders_move_as_one() -> None:
    paths = ("M0,0 H50 C60,20 40,40 50,60 H0 Z", "M50,0 H100 V60 H50 C40,40 60,20 50,0 Z")
    before = drawing(*paths, handles=[pin(0, 0), pin(0, 60), drag((100, 30), (130, 40))])
    after = reshaped(before).refitted
    here, there = (after.control[after.source == segment] for segment in (1, 7))
    assert apart(here, there) < 0.05
    assert here[0, 0] == pytest.approx(there[-1, 3], abs=1e-9)


def test_a_drawing_of_many_parts_is_finite() -> None:
    random = np.random.default_rng(0)
    paths = [f"M{x:.2f},{y:.2f} q5,5 10,0 t3,3 z" for x, y in random.uniform(0, 200, (60, 2))]
    start = drawing(paths[0]).control[0, 0]
    before = drawing(*paths, handles=[drag(start, start + [20.0, 5.0])])
    result = reshaped(before)
    assert np.isfinite(result.refitted.control).all()


# --- convergence --------------------------------------------------------------------------------


def test_the_shape_converges_as_the_spacing_halves() -> None:
    before = drawing("M0,0 C20,40 60,-40 100,20", handles=[pin(0, 0), drag((100, 20), (120, 40))])
    shapes = [
        reshaped(
            before, spacing=s, fit_tolerance=1e-5, limits=outcome.Limits(iterations=3000)
        ).refitted.control
        for s in (0.08, 0.04, 0.02, 0.01, 0.005)
    ]
    change = np.array([apart(a, b) for a, b in zip(shapes, shapes[1:])]) / before.diagonal
    # Less each time, and by a factor in the end; the sampled distance itself is good to 5e-4.
    assert (np.diff(change) < 5e-4).all(), change
    assert change[-1] < 0.2 * change[0], change
    assert change[-1] < 2e-3, change


def test_the_fit_converges_as_its_tolerance_halves() -> None:
    before = edited()
    counts, errors = [], []
    for tolerance in (4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4):
        result = reshaped(before, fit_tolerance=tolerance)
        counts.append(result.report["segments_after"])
        errors.append(result.report["fit_error_of_longest_side"])
        assert errors[-1] <= tolerance
    assert counts == sorted(counts)
    assert errors[-1] < 0.2 * errors[0]
    assert counts[0] < counts[-1]


def test_nobody_sees_the_fit() -> None:
    """By default it is within a quarter of a pixel where the drawing is 500 pixels long."""
    before = edited()
    result = reshaped(before)
    curves = cKDTree(curve_points(result.refitted.control, 1025))
    assert curves.query(result.moved)[0].max() < 0.25 / 500.0 * before.size.max()


# --- report and errors --------------------------------------------------------------------------


def test_the_report_counts_what_there_is() -> None:
    before = drawing("M0,0 H100 V50", "M0,80 H100", handles=[pin(0, 0), drag((100, 50), (110, 60))])
    report = reshaped(before, spacing=0.1).report
    assert report["vertices"] == 16 + 11
    assert report["edges"] == 15 + 10
    assert report["components"] == 2
    assert report["straight_turns"] == 9 + 4 + 9
    assert report["handles"] == 2
    assert report["segments"] == 3
    assert [r["round"] for r in report["rounds"]] == ["core", "final"]
    for one in report["rounds"]:
        assert {len(values) for values in one["energy"].values()} == {one["iterations"] + 1}
        assert set(one["energy"]) >= {
            "normal", "tangent", "straight", "handle", "edge", "ties", "alup", "objective"
        }  # fmt: skip


def test_the_turning_of_tangents() -> None:
    before = drawing("M0,0 H100", handles=[pin(0, 0), drag((100, 0), tuple(100 * rotation(20.0)[:, 0]))])
    turning = reshaped(before).report["turning_degrees"]
    assert turning["mean"] == pytest.approx(20.0, abs=1e-3)
    assert turning["max"] == pytest.approx(20.0, abs=1e-3)


def test_sections_carry_what_they_hold() -> None:
    matrix = np.array([[1.0, 0.0, 40.0], [0.0, 1.0, 0.0]])
    before = drawing(
        "M0,0 H100 V20 H0 Z",
        sections=(
            Section("left", np.array([-1.0, -1.0, 21.0, 22.0]), np.eye(2, 3)),
            Section("right", np.array([80.0, -1.0, 21.0, 22.0]), matrix),
        ),
    )
    after = reshaped(before).refitted.control
    assert after[0] == pytest.approx(np.array([[0, 0], [140 / 3, 0], [280 / 3, 0], [140, 0]]), abs=1e-3)
    assert after[1, 3] == pytest.approx([140, 20], abs=1e-3)


@pytest.mark.parametrize(
    ("wishes", "message"),
    [
        ([], "no handles"),
        ([pin(300.0, 0.0, "far off")], "far off is not on a curve"),
        (
            [drag((60, 20), (60, 10), "one"), drag((60, 20), (70, 20), "other")],
            "one and other hold the same point",
        ),
        ([drag((60, 20), (60, 10), "one"), pin(60, 20, "other")], "one and other hold the same point"),
    ],
)
def test_handle_errors(wishes: list[Handle], message: str) -> None:
    with pytest.raises(HandleError, match=message):
        reshaped(drawing(BLOB, handles=wishes))


def test_the_same_wish_twice_is_no_error() -> None:
    wishes = handles(np.eye(2), (5.0, 5.0))
    before = drawing(BLOB, handles=[*wishes, *wishes])
    assert error(reshaped(before), before.control + [5.0, 5.0], before) < 1e-6


def test_a_drawing_without_extent_is_an_error() -> None:
    before = drawing("M5,5 L5,5", handles=[pin(5, 5)])
    with pytest.raises(DocumentError, match="no extent"):
        reshaped(before)


def test_a_section_around_nothing_is_an_error() -> None:
    nowhere = Section("nowhere", np.array([500.0, 500.0, 5.0, 5.0]), np.eye(2, 3))
    with pytest.raises(HandleError, match="nowhere holds no curve"):
        reshaped(drawing(BLOB, handles=[pin(10, 80)], sections=(nowhere,)))


def test_a_time_limit_is_kept_and_said() -> None:
    before = drawing(BLOB, INNER, handles=handles(np.eye(2) * 1.3, (0.0, 0.0)))
    result = reshaped(before, time_limit=0.0)
    assert {one["status"] for one in result.report["rounds"]} <= {"TIME", "UNMOVED"}
    assert "time limit of 0 s" in result.report["notes"][0]
    assert np.isfinite(result.refitted.control).all()
    assert reshaped(before).report["notes"] == []


def test_a_round_that_ends_at_the_limit_of_iterations_is_named() -> None:
    before = drawing(BLOB, INNER, handles=handles([[1.3, 0.2], [0.0, 0.9]]))
    result = reshaped(before, limits=outcome.Limits(iterations=2))
    ended = [one["status"] == "ITERATIONS" for one in result.report["rounds"]]
    assert any(ended)
    for name, at_limit in zip(("first", "second"), ended):
        said = [
            note for note in result.report["notes"] if f"The {name} round ended at its limit of 2" in note
        ]
        assert len(said) == at_limit
    assert [str(note) for note in result.notes] == result.report["notes"]


@pytest.mark.parametrize("up", [0.5, 1.0, 2.0])
def test_lines_that_handles_bend_are_solved_to_the_minimum(up: float) -> None:
    """A side that three handles bend: kept straight its energy stays 40 to 90 times as high."""
    sides = [drag((25, 0), (25, up)), drag((50, 0), (50, -up)), drag((75, 0), (75, up))]
    others = [pin(0, 60), pin(100, 60), drag((0, 0), (-4, 0)), drag((100, 0), (130, 8))]
    frame = "M0,0 H100 V60 H0 Z M20,10 H80 V50 H20 Z"
    result = reshaped(drawing(frame, "M0,-8 H100 V-2 H0 Z", handles=sides + others), spacing=0.01)
    for one in result.report["rounds"]:
        assert one["status"] == "MINIMUM"
        assert one["energy"]["objective"][-1] < 70.0


def test_the_spacing_is_raised_for_the_limit_of_vertices_and_that_is_said() -> None:
    before = drawing(BLOB, INNER, handles=handles(np.eye(2) * 1.3, (0.0, 0.0)))
    result = reshaped(before, max_vertices=150)
    assert 75 < result.report["vertices"] <= 150
    assert "no more than 150" in result.report["notes"][0]
    with pytest.raises(DocumentError, match="too many for 10 samples"):
        reshaped(before, max_vertices=10)


def test_crossings_without_number_are_left_out_and_that_is_said() -> None:
    """A net of 30 x 30 lines has 1,860 pieces; as 60 lines it can be reshaped."""
    net = [f"M{k},0 V29 M0,{k} H29" for k in range(30)]
    before = drawing(*net, handles=[pin(0, 0), drag((29, 29), (58, 29))])
    held = reshaped(before)
    assert held.report["contacts"]["crossings"] > 500
    assert not held.report["notes"]
    loose = reshaped(before, max_vertices=1000)
    assert loose.report["contacts"]["crossings"] == 0
    assert loose.report["vertices"] <= 1000
    assert "pieces are too many for 1000 samples" in loose.report["notes"][0]
    for result in (held, loose):
        assert result.report["handle_error_of_diagonal"] < 1e-6


def test_far_too_many_segments_are_refused_before_they_are_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*_: Any) -> None:
        raise AssertionError("contacts of far too many segments are looked for")

    monkeypatch.setattr(weld, "build", never)
    zigzag = "M0,0" + "".join(f" L{k},{k % 2}" for k in range(1, 202))
    with pytest.raises(DocumentError, match="201 pieces, too many for 100 samples"):
        reshaped(drawing(zigzag, handles=[pin(0, 0)]), max_vertices=100)
