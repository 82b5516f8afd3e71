"""Curves that would come to cross: narrow stems hold their width, parts stay within what holds them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders import drag, drawing, pin

from alup import bezier, lead, pipeline, solve
from alup.errors import SolveError
from alup.intersections import crossing_edges
from alup.model import Drawing
from alup.refit import Refitted
from alup.sample import Graph

GOBLET = (
    "M0,0 H100 C100,50 54,50 54,70 V90 C54,110 90,110 90,130 H10 C10,110 46,110 46,90 V70 C46,50 0,50 0,0 Z"
)
BOX, LABEL = "M0,0 H100 V100 H0 Z", "M20,20 H80 V80 H20 Z"


def crossings(found: Refitted) -> int:
    """How often what became of different segments crosses, as polylines of 240 chords each curve."""
    points = bezier.evaluate(found.control[:, None], np.linspace(0.0, 1.0, 241)[None])
    number = np.arange(points.shape[0] * 241).reshape(-1, 241)
    edges = np.stack([number[:, :-1].ravel(), number[:, 1:].ravel()], axis=1)
    pairs = crossing_edges(points.reshape(-1, 2), edges)
    one, other = (found.source[edge // 240] for edge in (pairs // len(edges), pairs % len(edges)))
    return int(np.sum(one != other))


def goblet() -> Drawing:
    handles = [pin(0, 0), pin(100, 0), drag((10, 130), (10, 330)), drag((90, 130), (90, 330))]
    return drawing(GOBLET, handles=handles)


def squashed() -> Drawing:
    handles = [pin(0, 0), pin(100, 0), drag((0, 100), (0, 35)), drag((100, 100), (100, 35))]
    return drawing(BOX, LABEL, handles=handles)


def test_a_stem_that_would_cross_itself_is_held_apart() -> None:
    left = pipeline.reshape(goblet(), pipeline.Options(untangle=False))
    held = pipeline.reshape(goblet(), pipeline.Options(untangle=True))
    assert left.report["crossings"]["new"] > 0
    assert crossings(left.refitted) > 0
    assert held.report["crossings"]["left"] == 0
    assert crossings(held.refitted) == 0


@pytest.mark.parametrize(
    ("before", "figure", "calls"),
    [(goblet(), "crossings", 2), (squashed(), "overlaps", 3)],
    ids=["stem", "label"],
)
@pytest.mark.parametrize("untangle", [True, False])
def test_attempts_that_there_was_no_time_for_are_told(
    monkeypatch: pytest.MonkeyPatch, before: Drawing, figure: str, calls: int, untangle: bool
) -> None:
    """The rounds themselves came to their minimum; the time was up before the next attempt."""
    done = [0]
    usual = solve.newton

    def counted(*arguments: Any) -> solve.Round:
        found = usual(*arguments)
        done[0] += 1
        return found

    monkeypatch.setitem(solve.SOLVERS, "newton", counted)
    monkeypatch.setattr(solve.Limits, "over", property(lambda _: done[0] >= calls))
    report = pipeline.reshape(before, pipeline.Options(untangle=untangle)).report
    assert report[figure]["left"] > 0
    assert done[0] == calls
    assert {one["status"] for one in report["rounds"]} == {"MINIMUM"}
    assert report["in_time"] is not untangle
    assert any("time limit" in note for note in report["notes"]) is untangle


@pytest.mark.parametrize(("sides", "tried"), [(0, False), (1, True), (2, False)])
def test_a_second_network_is_not_joined_to_the_first(
    monkeypatch: pytest.MonkeyPatch, sides: int, tried: bool
) -> None:
    """Sides for each edge of the outline: its equations would fill up, beyond any limit of time."""
    usual = lead._joining

    def joining(graph: Graph, all_sides: np.ndarray, crossing: np.ndarray) -> np.ndarray:
        found = usual(graph, all_sides, crossing)
        return np.resize(found, (sides * len(graph.edges) - (sides == 1), 2) if sides else (0, 2))

    monkeypatch.setattr(lead, "_joining", joining)
    report = pipeline.reshape(goblet()).report
    assert (report["crossings"]["again"] > 0) == tried
    assert (report["crossings"]["left"] < report["crossings"]["new"]) == tried


def test_a_label_stays_in_its_squashed_box() -> None:
    left = pipeline.reshape(squashed(), pipeline.Options(untangle=False))
    held = pipeline.reshape(squashed(), pipeline.Options(untangle=True))
    assert (left.report["overlaps"]["new"] > 0, crossings(left.refitted) > 0) == (True, True)
    assert (held.report["overlaps"]["left"], crossings(held.refitted)) == (0, 0)
    # One way only: the box is the same with and without its label.
    box = pipeline.reshape(drawing(BOX, handles=squashed().handles))
    assert np.abs(held.refitted.control[:4] - box.refitted.control).max() < 1e-6


@pytest.mark.parametrize(
    ("coupling", "least", "most"), [(1.0, 55.0, 60.0), (1e2, 20.0, 50.0), (1e4, 8.0, 20.0)]
)
def test_the_coupling_says_how_far_the_size_follows(coupling: float, least: float, most: float) -> None:
    # The scaffold keeps the gaps of 20 on each side, so that at the most 10 are left of the label's 60.
    handles = [pin(0, 0), drag((100, 0), (50, 0)), drag((0, 100), (0, 50)), drag((100, 100), (50, 50))]
    plain = pipeline.Options(untangle=False, coupling=coupling)
    found = pipeline.reshape(drawing(BOX, LABEL, handles=handles), plain).refitted
    label = found.control[found.source >= 4]
    assert least < np.ptp(label[:, 0, 1]) < most


def test_crossings_that_were_there_are_left_alone() -> None:
    handles = [pin(0, 0), pin(100, 0), drag((50, 100), (50, 120))]
    eight = drawing("M0,0 L100,0 L0,60 L50,100 L100,60 Z", handles=handles)
    assert pipeline.reshape(eight).report["crossings"]["new"] == 0


@pytest.mark.parametrize(("before", "solves"), [(goblet(), 2), (squashed(), 3)], ids=["lead", "follow"])
def test_an_attempt_that_fails_leaves_the_result_that_there_was(
    before: Drawing, solves: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The rounds without untangling are solved; all further ones fail."""
    usual = pipeline.reshape(before, pipeline.Options(untangle=False))
    done = []

    def failing(*given: Any) -> solve.Round:
        done.append(given)
        if len(done) > solves:
            raise SolveError("no more")
        return solve.newton(*given)

    monkeypatch.setitem(solve.SOLVERS, "newton", failing)
    found = pipeline.reshape(before, pipeline.Options())
    assert len(done) == solves + 1
    np.testing.assert_array_equal(found.moved, usual.moved)


def test_equations_without_a_solution_are_in_the_notes(monkeypatch: pytest.MonkeyPatch) -> None:
    def singular(*given: Any) -> solve.Round:
        return replace(solve.newton(*given), status=solve.Status.SINGULAR)

    monkeypatch.setitem(solve.SOLVERS, "newton", singular)
    notes = pipeline.reshape(squashed()).report["notes"]
    assert notes == [next(note for note in notes if "could not be solved" in note)]
