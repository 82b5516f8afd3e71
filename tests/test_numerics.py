# SPDX-License-Identifier: GPL-2.0-or-later
"""Every numerical misfortune ends in a correct result or in a sentence that names what is wrong.

A factorisation that fails or returns what is no number, parts without a handle, handles that contradict each
other, coincide or hold everything, drawings without area, coordinates at both ends of what can be written.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from builders import BLOB, Stages, drag, drawing, mapped, pin, reshaped, stages, untied

from alup.energy import terms
from alup.messages.errors import AlupError, DocumentError, HandleError, SolveError
from alup.model import Drawing, Section
from alup.network.sampling import Graph
from alup.session.pipeline import Result
from alup.solver import minimise, paper_scheme
from alup.solver.outcome import Limits, Status
from alup.sparse.least_squares import Factor

SQUARE = "M0,0 H100 V60 H0 Z"
CORNERS = ((0.0, 0.0), (100.0, 0.0), (100.0, 60.0), (0.0, 60.0))
SOLVERS = pytest.mark.parametrize("solver", list(minimise.SOLVERS))

GOOD = ("MINIMUM", "UNMOVED")


def edited() -> Drawing:
    return drawing(BLOB, handles=[pin(10, 80), drag((150, 75), (175, 55)), pin(60, 130)])


def blob() -> Stages:
    """One level only: fewer samples than the smallest coarse level has."""
    return stages(edited(), 5.0)


def statuses(result: Result) -> list[str]:
    return [one["status"] for one in result.report["rounds"]]


def assert_sound(result: Result, before: Drawing, error: float = 1e-6) -> None:
    """Finite, every handle met, and every round of Newton's method at its minimum."""
    assert np.isfinite(result.refitted.control).all()
    assert result.report["handle_error_of_diagonal"] < error
    assert len(np.unique(result.refitted.source)) == len(before.control)


# --- factorisations -----------------------------------------------------------------------------


class Broken:
    """Spoils the n-th to last solutions or factorisations of all there are, counted from 0."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, first: int, last: int, raises: bool):
        self.count = 0
        original = Factor.update if raises else Factor.solve

        def update(factor: Factor, upper: Any) -> None:
            if self._hit(first, last):
                raise SolveError("The equations are singular.")
            original(factor, upper)

        def solution(factor: Factor, right: np.ndarray) -> np.ndarray:
            result = np.array(original(factor, right))
            if self._hit(first, last):
                result[len(result) // 2] = np.nan
            return result

        monkeypatch.setattr(Factor, *(("update", update) if raises else ("solve", solution)))

    def _hit(self, first: int, last: int) -> bool:
        self.count += 1
        return first <= self.count - 1 <= last


FAILURES = pytest.mark.parametrize("raises", [True, False], ids=["factorisation fails", "solution is NaN"])
ALWAYS = 10**9


@SOLVERS
@FAILURES
def test_without_any_solution_there_is_no_result(
    monkeypatch: pytest.MonkeyPatch, solver: str, raises: bool
) -> None:
    Broken(monkeypatch, 0, ALWAYS, raises)
    with pytest.raises(SolveError, match=r"^The equations .*\.$"):
        reshaped(edited(), solver=solver)


@FAILURES
def test_without_the_alternation_newtons_method_goes_its_way(
    monkeypatch: pytest.MonkeyPatch, raises: bool
) -> None:
    problem = blob().problem
    usual = minimise.newton(problem)
    Broken(monkeypatch, 0, 0, raises)
    found = minimise.newton(problem)
    assert found.status is usual.status is Status.MINIMUM
    assert terms.objective(problem, found.positions) == pytest.approx(
        terms.objective(problem, usual.positions), rel=1e-2
    )


@FAILURES
def test_one_failure_is_overcome_by_damping(monkeypatch: pytest.MonkeyPatch, raises: bool) -> None:
    problem = blob().problem
    usual = minimise.newton(problem)
    whole = Broken(monkeypatch, ALWAYS, ALWAYS, raises)
    minimise.newton(problem)
    monkeypatch.undo()
    Broken(monkeypatch, whole.count // 2, whole.count // 2, raises)
    found = minimise.newton(problem)
    assert found.status is Status.MINIMUM
    assert np.abs(found.positions - usual.positions).max() < 0.05  # edges


@FAILURES
def test_what_fails_for_good_says_so_and_keeps_the_best_state(
    monkeypatch: pytest.MonkeyPatch, raises: bool
) -> None:
    problem = blob().problem
    whole = Broken(monkeypatch, ALWAYS, ALWAYS, raises)
    minimise.newton(problem)
    monkeypatch.undo()
    Broken(monkeypatch, whole.count // 2, ALWAYS, raises)
    found = minimise.newton(problem)
    assert found.status is Status.SINGULAR
    assert np.isfinite(found.positions).all()
    least = min(entry["objective"] for entry in found.history)
    assert terms.objective(problem, found.positions) == pytest.approx(least, rel=1e-6)
    assert least < found.history[0]["objective"]


@FAILURES
def test_the_report_of_a_run_that_failed_in_the_end_says_so(
    monkeypatch: pytest.MonkeyPatch, raises: bool
) -> None:
    before = edited()
    whole = Broken(monkeypatch, ALWAYS, ALWAYS, raises)
    reshaped(before)
    monkeypatch.undo()
    Broken(monkeypatch, whole.count - 1, ALWAYS, raises)
    result = reshaped(before)
    assert statuses(result)[-1] == "SINGULAR"
    assert "could not be solved" in result.report["rounds"][-1]["why"]
    assert_sound(result, before, 5e-4)


def test_the_papers_scheme_keeps_its_best_state_too(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = blob().problem
    Broken(monkeypatch, 8, ALWAYS, raises=False)
    found = paper_scheme.paper(problem, Limits())
    assert found.status is Status.SINGULAR
    assert np.isfinite(found.positions).all()
    assert terms.terms(problem, found.positions)["alup"] < found.history[0]["alup"]


def test_a_failed_result_with_an_edge_folded_back_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two alternations towards a swap of both ends leave edges on the wrong side."""
    swap = stages(
        drawing("M0,0 C30,40 70,-40 100,0", handles=[drag((0, 0), (100, 0)), drag((100, 0), (0, 0))])
    )
    Broken(monkeypatch, 16, ALWAYS, raises=False)
    with pytest.raises(SolveError, match="no solution in finite numbers"):
        minimise.newton(swap.problem)


def test_a_start_that_is_no_number_is_never_a_minimum() -> None:
    none = np.zeros((0, 2), dtype=int)
    points = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    graph = Graph(points, np.array([[0, 1], [1, 2]]), np.array([[1, 0, 2]]), none)
    for target in (np.nan, np.inf, 1e300):
        problem = untied(graph, np.array([0]), np.array([[target, 0.0]]))
        for solver in minimise.SOLVERS.values():
            with np.errstate(all="ignore"), pytest.raises(SolveError):
                solver(problem, Limits(), None)


# --- parts without a handle ---------------------------------------------------------------------


@SOLVERS
@pytest.mark.parametrize("tandem", [True, False])
def test_parts_without_a_handle_of_every_size(solver: str, tandem: bool) -> None:
    """A part far off, a speck, one that coincides with another, one on the line: none is singular."""
    parts = (
        "M1000,0 h30 v30 z",
        "M20,20 h0.02",
        "M40,30 h5 v5 z",
        "M40,30 h5 v5 z",
        "M0,-5 H100",
        "M300,7 V8",
    )
    before = drawing(SQUARE, *parts, handles=[pin(0, 0), drag((100, 60), (120, 60))])
    result = reshaped(before, solver=solver, hold="normally" if tandem else "apart")
    assert_sound(result, before)
    if solver == "newton":
        assert set(statuses(result)) <= set(GOOD)
    if not tandem:
        assert (result.refitted.control[4:] == before.control[4:]).all()


@SOLVERS
def test_a_single_handle_holds_a_part_that_could_still_turn(solver: str) -> None:
    """One handle leaves a rotation open, which the edges' directions settle: a translation."""
    before = drawing(BLOB, handles=[drag((150, 75), (250, 75))])
    result = reshaped(before, solver=solver)
    assert np.abs(result.refitted.control - before.control - [100.0, 0.0]).max() < 1e-6 * before.diagonal


# --- handles ------------------------------------------------------------------------------------


def test_handles_that_contradict_each_other_are_named() -> None:
    section = Section("part", np.array([-1.0, -1.0, 50.0, 80.0]), np.array([[1.0, 0, 9], [0, 1, 0]]))
    other = Section("other", np.array([-1.0, -1.0, 40.0, 80.0]), np.eye(2, 3))
    for wishes, sections in (
        ([drag((50, 0), (50, 9), "one"), drag((50, 0), (50, -9), "other")], ()),
        ([drag((20, 0), (20, 9), "other")], (section,)),
        ([], (section, other)),
    ):
        with pytest.raises(HandleError, match=r"hold the same point .* different places") as caught:
            reshaped(drawing(SQUARE, handles=wishes, sections=sections))
        assert all(one.name in str(caught.value) for one in (*wishes, *sections))


@SOLVERS
@pytest.mark.parametrize("apart", [0.5, 1e-2, 1e-3, 1e-5, 1e-9])
def test_handles_at_almost_the_same_point_pull_apart_or_are_named(solver: str, apart: float) -> None:
    before = drawing(SQUARE, handles=[drag((50, 0), (50, -20)), drag((50 + apart, 0), (50, 20)), pin(0, 60)])
    try:
        result = reshaped(before, solver=solver)
    except HandleError as error:
        assert apart < 0.5, "on samples of their own"
        assert "hold the same point" in str(error)
        return
    assert_sound(result, before, 5e-4)


@SOLVERS
def test_handles_at_one_point_that_agree_are_one(solver: str) -> None:
    wishes = [drag((100, 60), (120, 70)), drag((100, 60), (120, 70)), pin(0, 0), pin(0, 0)]
    one = reshaped(drawing(SQUARE, handles=wishes), solver=solver)
    two = reshaped(drawing(SQUARE, handles=wishes[::2]), solver=solver)
    assert one.report["handles"] == two.report["handles"] == 2
    assert (one.refitted.control == two.refitted.control).all()


@SOLVERS
def test_every_vertex_a_handle(solver: str) -> None:
    matrix, shift = np.array([[1.2, 0.1], [0.0, 0.9]]), np.array([5.0, 0.0])
    section = Section("all", np.array([-1.0, -1.0, 200.0, 200.0]), np.column_stack([matrix, shift]))
    before = drawing(BLOB, sections=(section,))
    result = reshaped(before, solver=solver)
    assert result.report["handles"] == result.report["vertices"]
    assert_sound(result, before)
    assert np.abs(result.refitted.control - before.control @ matrix.T - shift).max() < 1e-4 * before.diagonal


@SOLVERS
def test_every_vertex_a_handle_that_wants_something_else(solver: str) -> None:
    random = np.random.default_rng(0)
    wishes = [drag((x, 0.0), tuple(random.normal((x, 0.0), 5.0))) for x in np.linspace(0.0, 100.0, 201)]
    before = drawing("M0,0 H100", handles=wishes)
    result = reshaped(before, solver=solver)
    assert result.report["handles"] == result.report["vertices"] == 201
    assert_sound(result, before, 5e-4)


@SOLVERS
@pytest.mark.parametrize("left", [0.0, 1e-9])
def test_a_drawing_that_is_pulled_into_a_point(solver: str, left: float) -> None:
    targets = [(50.0 + left * x, 30.0 + left * y) for x, y in CORNERS]
    before = drawing(SQUARE, handles=[drag(p, q) for p, q in zip(CORNERS, targets)])
    result = reshaped(before, solver=solver)
    assert_sound(result, before)
    assert np.abs(result.refitted.control - [50.0, 30.0]).max() < 1e-6


FAR = {"far": 1e6, "farther": 1e12, "beyond squares": 1e160, "beyond": np.inf, "nowhere": np.nan}


@SOLVERS
@pytest.mark.parametrize("distance", FAR.values(), ids=FAR.keys())
def test_a_handle_that_goes_far(solver: str, distance: float) -> None:
    before = drawing(BLOB, handles=[pin(10, 80), drag((150, 75), (distance, 0.0), "the far one")])
    if distance <= 1e6:
        assert_sound(reshaped(before, solver=solver), before, 5e-4 * distance / before.diagonal)
    else:
        with pytest.raises(HandleError, match="the far one is to go farther than a million times"):
            reshaped(before, solver=solver)


def test_a_section_that_goes_far() -> None:
    away = Section("away", np.array([-1.0, -1.0, 50.0, 80.0]), np.array([[1.0, 0.0, 1e12], [0.0, 1.0, 0.0]]))
    with pytest.raises(HandleError, match="The handle away is to go farther"):
        reshaped(drawing(SQUARE, sections=(away,)))


# --- drawings without area ----------------------------------------------------------------------

FLAT = {
    "a line there and back": "M0,0 L100,0 L0,0 Z",
    "a closed line": "M0,0 H100 Z",
    "two lines on one": "M0,0 H100 M100,0 H0",
    "a curve there and back": "M0,0 C0,0 100,0 100,0 C100,0 0,0 0,0 Z",
    "a curve beyond its ends": "M0,0 C-50,0 150,0 100,0",
}


@SOLVERS
@pytest.mark.parametrize("path", FLAT.values(), ids=FLAT.keys())
@pytest.mark.parametrize("to", [(130.0, 0.0), (100.0, 40.0)], ids=["along", "across"])
def test_a_drawing_without_area(solver: str, path: str, to: tuple[float, float]) -> None:
    before = drawing(path, handles=[pin(0, 0), drag((100, 0), to)])
    result = reshaped(before, solver=solver)
    assert_sound(result, before, 5e-4)
    if to[1] == 0.0:
        assert np.abs(result.refitted.control[:, :, 1]).max() < 1e-9


@pytest.mark.parametrize("path", ["M5,5 L5,5", "M5,5 C5,5 5,5 5,5", "M5,5 L5,5 M5,5 L5,5 Z"])
def test_a_drawing_that_is_a_point(path: str) -> None:
    with pytest.raises(DocumentError, match="no extent"):
        reshaped(drawing(path, handles=[pin(5, 5)]))


# --- coordinates of 1e-12 and 1e12 --------------------------------------------------------------


@pytest.mark.parametrize("exponent", [-90, -30, -12, 6, 9, 12])
def test_a_drawing_of_any_size_at_the_origin(exponent: int) -> None:
    scale = 10.0**exponent
    before = edited()
    first, second = reshaped(before), reshaped(mapped(before, scale * np.eye(2)))
    assert statuses(second) == statuses(first)
    wanted = scale * first.refitted.control
    assert np.abs(second.refitted.control - wanted).max() < 1e-6 * scale * before.diagonal


@pytest.mark.parametrize(("scale", "distance"), [(1.0, 1e9), (1e-12, 1e-4), (1e3, 1e12), (1e-7, 1e3)])
def test_a_drawing_far_from_the_origin_keeps_what_its_digits_say(scale: float, distance: float) -> None:
    before = edited()
    first, second = reshaped(before), reshaped(mapped(before, scale * np.eye(2), (distance, -distance)))
    wanted = scale * first.refitted.control + [distance, -distance]
    assert second.refitted.control.shape == wanted.shape
    assert np.abs(second.refitted.control - wanted).max() < 1e-4 * scale * before.diagonal


@pytest.mark.parametrize(("scale", "distance"), [(1e-13, 1.0), (1.0, 1e13), (1e-9, 1e4), (1e-103, 0.0)])
def test_a_drawing_that_is_a_point_to_its_digits_is_named(scale: float, distance: float) -> None:
    with pytest.raises(DocumentError, match="too small for their coordinates: they measure"):
        reshaped(mapped(edited(), scale * np.eye(2), (distance, 0.0)))


@SOLVERS
@pytest.mark.parametrize("size", [1e-12, 1e-9, 1e-7, 1e-6])
def test_segments_of_next_to_no_length(solver: str, size: float) -> None:
    """Among ordinary ones: they move along with their node."""
    path = f"M0,0 h50 h{size} v{size} l-{size},0 H100 V60 H0 Z"
    before = drawing(path, handles=[pin(0, 0), drag((100, 60), (130, 80))])
    result = reshaped(before, solver=solver)
    assert_sound(result, before, 5e-4)
    small = result.refitted.control[1:4]
    assert np.ptp(small.reshape(-1, 2), axis=0).max() < 10.0 * size + 1e-9


def test_every_refusal_is_an_error_for_the_user() -> None:
    assert issubclass(SolveError, AlupError)
    assert all(len(one.value.split()) > 4 for one in Status)
