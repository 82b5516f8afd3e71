# SPDX-License-Identifier: GPL-2.0-or-later
"""A session: the same answers as a run of its own, whatever was solved before."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from builders import BLOB, drag, drawing, mapped, pin

from alup.energy import objective
from alup.messages.errors import HandleError
from alup.methods import registry
from alup.model import Drawing, Handle, Section
from alup.network import weld
from alup.session import pipeline
from alup.session.pipeline import Options
from alup.session.session import Answer, Session

INNER = "M50,60 C60,80 80,80 90,60 Z"
BESIDE = "M160,20 L200,20 L200,60 C190,80 170,80 160,60 Z"
PINS = (pin(10, 80, "left"), pin(60, 130, "bottom"))
NOSE = np.array([150.0, 75.0])
TOP = np.array([60.0, 20.0])


def blob(nose: Any = NOSE, top: Any = TOP) -> Drawing:
    return drawing(BLOB, INNER, BESIDE, handles=[*PINS, drag(NOSE, nose, "nose"), drag(TOP, top, "top")])


def same(one: Answer, other: Answer) -> bool:
    """Whether two answers are the same to the last bit."""
    return (
        np.array_equal(one.moved, other.moved)
        and np.array_equal(one.refitted.control, other.refitted.control)
        and np.array_equal(one.refitted.source, other.refitted.source)
    )


def alone(before: Drawing, **options: Any) -> Answer:
    """What a session of its own says of a drawing."""
    return Session(before, Options(**options)).solve()


# --- drags --------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_the_way_of_a_drag_does_not_matter(seed: int) -> None:
    """Far ways, past shapes in which other minima are near; then where a run of its own begins."""
    random = np.random.default_rng(seed)
    session = Session(blob())
    for _ in range(6):
        session.solve({"nose": NOSE + random.uniform(-90, 60, 2), "top": TOP + random.uniform(-40, 60, 2)})
    nose, top = NOSE + random.uniform(-30, 40, 2), TOP + random.uniform(-30, 30, 2)
    assert same(session.solve({"nose": nose, "top": top}), alone(blob(nose, top)))


def test_a_pipelines_run_is_a_session_with_one_solve() -> None:
    nose = NOSE + [25.0, -20.0]
    session = Session(blob())
    session.solve({"nose": NOSE + [-40.0, 30.0]})
    mine, result = session.solve({"nose": nose}), pipeline.reshape(blob(nose))
    assert np.array_equal(mine.moved, result.moved)
    assert np.array_equal(mine.refitted.control, result.refitted.control)


def test_dragged_back_it_is_the_drawing_again() -> None:
    before = blob()
    session = Session(before)
    away = session.solve({"nose": NOSE + [30.0, 0.0]})
    assert np.abs(away.moved - session.held.samples.points).max() > 10.0
    assert np.array_equal(session.solve({"nose": NOSE}).refitted.control, before.control)


def test_handles_that_are_not_named_stay_where_they_were_last() -> None:
    session = Session(blob())
    nose, top = NOSE + [20.0, 5.0], TOP - [0.0, 15.0]
    session.solve({"nose": nose})
    assert same(session.solve({"top": top}), alone(blob(nose, top)))
    assert same(session.solve(), alone(blob(nose, top)))


def test_a_handle_is_made_a_pin_and_dragged_again() -> None:
    session = Session(blob())
    assert same(session.solve({"nose": None, "left": np.array([5.0, 85.0])}), alone(with_left((5.0, 85.0))))


def with_left(at: Any) -> Drawing:
    left = drag(PINS[0].rest, at, "left")
    return drawing(BLOB, INNER, BESIDE, handles=[left, PINS[1], pin(*NOSE, "nose"), pin(*TOP, "top")])


def test_sections_are_dragged_too() -> None:
    def sections(matrix: Any) -> Drawing:
        box = Section("box", np.array([155.0, 10.0, 50.0, 30.0]), np.asarray(matrix, dtype=float))
        return drawing(BLOB, INNER, BESIDE, handles=PINS, sections=(box,))

    matrix = [[1.2, 0.0, -20.0], [0.0, 1.0, -5.0]]
    session = Session(sections(np.eye(2, 3)))
    session.solve({"box": np.array([[0.7, 0.0, 60.0], [0.0, 1.0, 25.0]])})
    assert same(session.solve({"box": np.array(matrix)}), alone(sections(matrix)))


@pytest.mark.parametrize(
    "options", [{"solver": "paper"}, {"rounds": 1}, {"hold": "apart"}, {"method": "poisson"}]
)
def test_every_kind_of_run(options: dict[str, Any]) -> None:
    nose = NOSE + [15.0, -20.0]
    session = Session(blob(), Options(**options))
    session.solve({"nose": NOSE + [-30.0, 40.0]})
    assert same(session.solve({"nose": nose}), alone(blob(nose), **options))
    assert options.get("method", pipeline.ALUP) in (pipeline.ALUP, *registry.METHODS)


def test_a_session_of_the_moved_drawing_moves_with_it() -> None:
    """Scaled by two and moved, drawing and drag: the same shape, to rounding."""
    nose, other = NOSE + [25.0, -20.0], NOSE + [-50.0, 10.0]
    here, there = Session(blob()), Session(mapped(blob(), 2.0 * np.eye(2), (8.0, -4.0)))
    for target in (other, nose):
        mine = here.solve({"nose": target})
        moved = there.solve({"nose": 2.0 * target + [8.0, -4.0]})
    assert moved.refitted.control == pytest.approx(2.0 * mine.refitted.control + [8.0, -4.0], abs=1e-5)


# --- handles that come and go -------------------------------------------------------------------


def test_a_handle_is_added_and_removed() -> None:
    """A fresh session with the handles that there are: as if the others had never been."""
    corner = drag((200.0, 20.0), (210.0, 10.0), "corner")
    session = Session(blob(nose=NOSE + [20.0, 0.0]))
    session.solve({"top": TOP + [10.0, -10.0]})
    now = blob(NOSE + [20.0, 0.0], TOP + [10.0, -10.0])
    session.add(corner)
    assert same(session.solve(), alone(with_handles(now, *now.handles, corner)))
    session.remove("top")
    kept = [one for one in now.handles if one.name != "top"]
    assert same(session.solve(), alone(with_handles(now, *kept, corner)))
    session.remove("corner")
    session.add(now.handles[-1])
    assert same(session.solve(), alone(now))


def with_handles(before: Drawing, *handles: Handle) -> Drawing:
    return drawing(BLOB, INNER, BESIDE, handles=handles)


def test_curves_are_welded_once(monkeypatch: pytest.MonkeyPatch) -> None:
    session = Session(blob())
    monkeypatch.setattr(weld, "build", None)
    session.add(drag((200.0, 20.0), (210.0, 10.0), "corner"))
    session.solve({"nose": NOSE + [5.0, 5.0]})
    session.remove("corner")
    session.solve()


def test_the_matrices_of_all_samples_are_analysed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    session = Session(blob())
    session.solve({"nose": NOSE + [25.0, 0.0]})
    analysed: list[int] = []
    pattern = objective.Structure._pattern
    monkeypatch.setattr(
        objective.Structure,
        "_pattern",
        staticmethod(lambda p: (analysed.append(len(p.start)), pattern(p))[1]),
    )
    session.solve({"nose": NOSE + [-15.0, 10.0]})
    # In the final round the ties of coarse levels end at places that depend on the core round's result.
    every = len(session.held.rounds.graph.points) if session.held.rounds else 0
    assert every not in analysed
    alone(blob(NOSE + [25.0, 0.0]))
    assert every in analysed


def test_a_handle_that_finds_no_curve_changes_nothing() -> None:
    session = Session(blob(nose=NOSE + [20.0, 0.0]))
    before = session.solve()
    with pytest.raises(HandleError, match="nowhere is not on a curve"):
        session.add(pin(500.0, 500.0, "nowhere"))
    assert same(session.solve(), before)


def test_the_last_handle_cannot_be_removed() -> None:
    session = Session(drawing(BLOB, handles=[pin(10, 80, "only")]))
    with pytest.raises(HandleError, match="There are no handles"):
        session.remove("only")
    session.solve()


@pytest.mark.parametrize(
    ("targets", "message"),
    [
        ({"tail": NOSE}, "There is no handle tail"),
        ({"twin": NOSE}, "several handles of the name twin"),
        ({"nose": np.array([np.nan, 0.0])}, "nose has no finite place"),
        ({"nose": np.zeros(3)}, "nose has no finite place"),
        ({"nose": np.array([1e12, 0.0])}, "nose is to go farther"),
    ],
)
def test_targets_that_are_none(targets: dict[str, Any], message: str) -> None:
    twins = [pin(60, 20, "twin"), pin(10, 80, "twin")]
    session = Session(drawing(BLOB, handles=[*twins, drag(NOSE, NOSE + [5.0, 5.0], "nose")]))
    before = session.solve()
    with pytest.raises(HandleError, match=message):
        session.solve(targets)
    assert same(session.solve(), before)
