# SPDX-License-Identifier: GPL-2.0-or-later
"""Frames of a drag: near the answer, exact where the answer is a simple map, and gone without a trace."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from builders import BLOB, drag, drawing, mapped, pin
from test_session import BESIDE, INNER, NOSE, TOP, alone, blob, same

from alup.geometry import bezier
from alup.model import Drawing
from alup.refit import frozen_fit
from alup.refit.control_arms import ALONG, FIXED, FREE, Ends
from alup.refit.refit import Refit
from alup.session.pipeline import Options
from alup.session.session import FRAME, Session

AT = (
    (10.0, 80.0),
    (60.0, 20.0),
    (60.0, 130.0),
    (150.0, 75.0),
    (200.0, 20.0),
    (160.0, 60.0),
    (90.0, 60.0),
    (50.0, 60.0),
)


def held(map_: Any) -> Drawing:
    """The drawing with handles that all follow one map."""
    return drawing(BLOB, INNER, BESIDE, handles=[drag(at, map_(np.array(at)), f"{at}") for at in AT])


def way(session: Session, target: Any, count: int, start: Any = NOSE) -> Any:
    """Frames that take the nose to a target; the last one."""
    for k in range(1, count + 1):
        frame = session.solve({"nose": start + (np.asarray(target) - start) * k / count}, FRAME)
    return frame


# --- frames and answers -------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_frames_leave_no_trace(seed: int) -> None:
    """Wherever a drag passed, the answer is that of a run of its own, to the last bit."""
    random = np.random.default_rng(seed)
    session, nose = Session(blob()), NOSE
    for k in range(3):
        stop = NOSE + random.uniform(-40, 40, 2)
        way(session, stop, 6, nose)
        nose = stop
        if k == 1:
            session.solve()
    goal = NOSE + random.uniform(-20, 30, 2)
    way(session, goal, 4, nose)
    assert same(session.solve(), alone(blob(goal)))


@pytest.mark.parametrize("shift", [(24.0, -16.0), (10.0, 42.0)])
def test_frames_are_near_the_answer(shift: tuple[float, float]) -> None:
    """The second drag tears ties and lets sizes go: 4 % off by ties and sizes of the last frame's own."""
    session = Session(blob())
    goal = NOSE + shift
    frame, answer = way(session, goal, 25), alone(blob(goal))
    off = np.linalg.norm(frame.moved - answer.moved, axis=1) / session.drawing.diagonal
    assert np.median(off) < 2e-3
    assert off.max() < 2e-2
    # The handles themselves are met.
    missed = np.linalg.norm(frame.moved[frame.anchors.samples] - frame.anchors.targets, axis=1)
    assert missed.max() < 1e-4 * session.drawing.diagonal


def test_a_side_with_a_handle_inside_stays_straight_in_frames() -> None:
    """The core round bends it there; the final round does not."""

    def rectangle(up: float) -> Drawing:
        held = [
            pin(0, 0),
            pin(0, 60),
            drag((50, 0), (50, -up), "middle"),
            drag((100, 0), (100, -2 * up), "end"),
        ]
        return drawing("M0,0 H100 V60 H0 Z", handles=held)

    session = Session(rectangle(0.0))
    for k in range(1, 11):
        frame = session.solve({"middle": np.array([50.0, -k]), "end": np.array([100.0, -2.0 * k])}, FRAME)
    assert np.abs(frame.moved - alone(rectangle(10.0)).moved).max() < 0.2


def test_a_frame_where_an_answer_is_stays_there() -> None:
    """Wherever the frames before the answer were; these handles would have been too far from them."""
    session = Session(blob())
    way(session, NOSE + [-30.0, 20.0], 6)
    goal = NOSE + [24.0, -16.0]
    answer = session.solve({"nose": goal})
    frame = session.solve({"nose": goal}, FRAME)
    assert not frame.rounds
    size = session.drawing.diagonal
    assert np.abs(frame.moved - answer.moved).max() < 2e-3 * size
    assert np.array_equal(frame.refitted.source, answer.refitted.source)
    assert np.abs(frame.refitted.control - answer.refitted.control).max() < 5e-3 * size


@pytest.mark.parametrize("shift", [np.array([0.6, -0.4]), np.array([-30.0, 12.0])])
def test_moved_together_a_frame_is_the_translation(shift: Any) -> None:
    session = Session(held(lambda at: at))
    before = session.drawing.control
    for k in range(1, 6):
        targets = {f"{at}": np.array(at) + shift * k / 5 for at in AT}
        frame = session.solve(targets, FRAME)
    order = np.argsort(session.before)
    assert frame.refitted.control == pytest.approx(before[order] + shift, abs=1e-6)


def test_scaled_together_frames_become_the_scaling() -> None:
    """F = 0 there: a frame that takes the steps it needs is exact, and so is its fit."""
    session = Session(held(lambda at: at))
    order = np.argsort(session.before)
    before = session.drawing.control[order]
    for k in range(1, 11):
        scale = 1.0 + 0.03 * k
        frame = session.solve({f"{at}": scale * np.array(at) for at in AT}, 1e-9)
        assert frame.refitted.control == pytest.approx(scale * before, abs=2e-5)


def test_frames_move_with_the_drawing() -> None:
    here, there = Session(blob()), Session(mapped(blob(), 2.0 * np.eye(2), (8.0, -4.0)))
    for k in range(1, 6):
        target = NOSE + [4.0 * k, -3.0 * k]
        mine = here.solve({"nose": target}, FRAME)
        moved = there.solve({"nose": 2.0 * target + [8.0, -4.0]}, FRAME)
        assert moved.refitted.control == pytest.approx(2.0 * mine.refitted.control + [8.0, -4.0], abs=1e-4)


def test_handles_that_jump_get_an_answer() -> None:
    goal = NOSE + [70.0, -40.0]
    session = Session(blob())
    session.solve({"nose": NOSE + [1.0, 0.0]}, FRAME)
    frame = session.solve({"nose": goal}, FRAME)
    assert frame.rounds
    assert same(frame, alone(blob(goal)))


@pytest.mark.parametrize("options", [{"solver": "paper"}, {"method": "poisson"}])
def test_what_cannot_be_followed_is_answered(options: dict[str, Any]) -> None:
    goal = NOSE + [3.0, 2.0]
    session = Session(blob(), Options(**options))
    assert same(session.solve({"nose": goal}, FRAME), alone(blob(goal), **options))


def test_handles_come_and_go_between_frames() -> None:
    session = Session(blob())
    way(session, NOSE + [8.0, 0.0], 3)
    session.add(drag((200.0, 20.0), (205.0, 15.0), "corner"))
    session.solve({"nose": NOSE + [9.0, 0.0]}, FRAME)
    session.remove("corner")
    goal = NOSE + [10.0, 0.0]
    session.solve({"nose": goal}, FRAME)
    assert same(session.solve(), alone(blob(goal)))


def test_one_round_is_followed_alone() -> None:
    goal = NOSE + [10.0, -8.0]
    session = Session(blob(), Options(rounds=1))
    frame, answer = way(session, goal, 6), alone(blob(goal), rounds=1)
    assert np.abs(frame.moved - answer.moved).max() < 0.02 * session.drawing.diagonal


# --- the kept fit -------------------------------------------------------------------------------


def kept(goal: Any) -> tuple[Session, Refit, frozen_fit.FrozenFit, Any]:
    session = Session(blob())
    moved = session.solve({"nose": goal}).moved
    fitted = session.held.refit.fitted(moved)
    return session, session.held.refit, frozen_fit.FrozenFit(fitted, session.held.refit, moved), fitted


def test_a_kept_fit_is_the_fit_where_its_samples_have_not_moved() -> None:
    session, _, again, fitted = kept(NOSE + [4.0, -3.0])
    assert (fitted.fit.t == session_parameters(fitted)).all(), "no parameter was corrected"
    moved = session.solve().moved
    found = again.refitted(moved)
    assert found.control == pytest.approx(fitted.refitted.control, abs=1e-8)
    assert found.error == pytest.approx(fitted.refitted.error, abs=1e-8)


def session_parameters(fitted: Any) -> Any:
    """The samples' own parameters."""
    spans, fit = fitted.fit.spans, fitted.fit
    return (fit.row_t - spans.low[fit.owner]) / (spans.high - spans.low)[fit.owner]


def test_a_kept_fit_is_exact_for_affine_moves() -> None:
    """From no matter which fit: the original curve solves the original parameters."""
    _, refit, again, fitted = kept(NOSE + [4.0, -3.0])
    matrix, shift = np.array([[1.3, 0.0], [0.0, 0.8]]), np.array([5.0, 7.0])
    found = again.refitted(refit.samples.points @ matrix.T + shift)
    original = np.empty_like(found.control)
    original[fitted.of_fit], original[fitted.others] = fitted.fit.original, fitted.resting
    assert found.control == pytest.approx(original @ matrix.T + shift, abs=1e-4)
    assert found.error < 1e-4


@pytest.mark.parametrize("modes", [(a, b) for a in (FREE, ALONG, FIXED) for b in (FREE, ALONG, FIXED)])
def test_arms_minimise_what_they_are_free_to(modes: tuple[int, int]) -> None:
    """Against least squares of all that the arms may do, written out."""
    _, _, again, fitted = kept(NOSE + [4.0, -3.0])
    random = np.random.default_rng(3)
    m = len(fitted.fit.line)

    def complex_(*shape: int) -> Any:
        return random.normal(size=shape) + 1j * random.normal(size=shape)

    right, nodes = list(complex_(2, m)), (complex_(m), complex_(m))
    along = complex_(m, 2)
    along = np.where(np.array(modes) == ALONG, along / np.abs(along), along)
    ends = Ends(np.tile(modes, (m, 1)), np.stack([along.real, along.imag], axis=-1))
    zero = np.zeros(m, dtype=complex)
    found = again._solved(right, nodes, zero, zero, ends) - again._o
    for n in np.flatnonzero(~fitted.fit.line):
        matrix = np.array([[again._a11[n], again._a12[n]], [again._a12[n], again._a22[n]]])
        columns, fixed = [], np.zeros(2, dtype=complex)
        for end, mode in enumerate(modes):
            unit = np.eye(2)[end]
            if mode == FREE:
                columns += [unit, 1j * unit]
            else:
                fixed[end] = nodes[end][n] + (along[n, end] if mode == FIXED else 0.0)
            if mode == ALONG:
                columns += [along[n, end] * unit]
        wanted = fixed
        if columns:
            space = np.array(columns).T
            rest = np.array([right[0][n], right[1][n]]) - matrix @ fixed
            y = np.linalg.solve((space.conj().T @ matrix @ space).real, (space.conj().T @ rest).real)
            wanted = fixed + space @ y
        assert found[n, 1:3] == pytest.approx(wanted, rel=1e-6, abs=1e-6)


def test_a_fit_is_made_anew_for_subpaths_that_begin_to_move() -> None:
    session = Session(blob(), Options(hold="apart"))
    session.solve({"nose": NOSE + [1.0, 0.0]}, FRAME)
    still = session.solve({"nose": NOSE + [2.0, 0.0]}, FRAME).refitted
    beside = np.flatnonzero(bezier.evaluate(still.control, np.array(0.5))[:, 0] > 158.0)
    before = session.drawing.control[np.argsort(session.before)]
    assert np.array_equal(still.control[beside], before[still.source[beside]])
    session.add(drag((200.0, 20.0), (200.0, 20.0), "corner"))
    frame = session.solve({"corner": np.array([203.0, 20.0]), "top": TOP}, FRAME)
    assert np.abs(frame.refitted.control[beside] - still.control[beside]).max() > 1.0


def test_no_frame_strays_far_from_its_samples() -> None:
    session = Session(drawing(BLOB, handles=[pin(10, 80), pin(60, 130), drag(NOSE, NOSE, "nose")]))
    longest = session.drawing.size.max()
    for k in range(1, 31):
        frame = session.solve({"nose": NOSE + np.array([1.5, -1.0]) * k}, FRAME)
        assert frame.refitted.error < 5e-3 * longest
