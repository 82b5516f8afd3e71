# SPDX-License-Identifier: GPL-2.0-or-later
"""The live window's engine: pins, frames, steps, mirrored partners, and the document that it leaves."""

from __future__ import annotations

import copy
import threading
from typing import Any, Sequence

import numpy as np
import pytest
import reruns
from builders import curve_points
from documents import get
from reruns import canonical, circle, control, pins

from alup import run
from alup.live.engine import Engine, SupersededError
from alup.messages.errors import HandleError
from alup.regular.find import KINDS
from alup.session.options import Options
from alup.svg import path_data

# A house with a door that touches nothing, in a group that is scaled, and a rectangle beside it.
HOUSE = (
    '<g transform="scale(2)"><path id="house" d="M10,40 L30,10 L50,40 V80 H10 Z"/>'
    '<path id="door" d="M25,80 V60 H35 V80"/></g><rect id="box" x="120" y="100" width="40" height="60"/>'
)
EXACT = 1e-6  # of the diagonal
NEAR = 2.0


def engine(body: str = HOUSE, selected: Sequence[str] = (), svg: Any = None, **options: Any) -> Engine:
    root = reruns.load(body) if svg is None else svg
    return Engine(root, [get(root, identity) for identity in selected], Options(**options))


def press(live: Engine, x: float, y: float) -> str:
    name = live.press(np.array([x, y], dtype=float), NEAR)
    assert name is not None
    live.drop()
    return name


def grip(live: Engine, name: str) -> dict[str, Any]:
    return next(one for one in live.state()["grips"] if one["name"] == name)


def pull(live: Engine, name: str, dx: float, dy: float, steps: int = 4) -> dict[str, Any]:
    """Drag a handle in some frames; what the last one says."""
    start = np.array(grip(live, name)["now"])
    for n in range(1, steps + 1):
        found = live.drag(name, start + np.array([dx, dy]) * n / steps)
    live.drop()
    return found


def written(live: Engine) -> Any:
    tree = live.result()
    assert tree is not None
    return tree.getroot()


def framed(rest: str, x: float) -> str:
    return f'<rect inkscape:label="alup:section" alup:rest="{rest}" x="{x}" y="95" width="50" height="70"/>'


def moved_from(rest: str, x: float, y: float) -> str:
    return f'<circle inkscape:label="alup:handle" alup:rest="{rest}" cx="{x}" cy="{y}" r="1"/>'


def distance(svg: Any, identity: str, point: Sequence[float]) -> float:
    return reruns.away(svg, identity, point)


def same_curves(one: Any, other: Any, ids: Sequence[str] = ("house", "door", "box")) -> bool:
    return all(
        np.abs(control(one, identity) - control(other, identity)).max() <= EXACT * 100 for identity in ids
    )


# --- taking hold --------------------------------------------------------------------------------


def test_a_curve_is_found_under_the_pointer() -> None:
    live = engine()
    found = live.near(np.array([21.0, 120.0]), NEAR)
    assert found is not None and found["at"] == pytest.approx([20.0, 120.0])
    (house,) = [n for element, n in live.whole.keys.items() if element.get("id") == "house"]
    assert found["key"] == house
    assert live.near(np.array([21.0, 120.0]), 0.5) is None
    assert live.press(np.array([40.0, 110.0]), NEAR) is None
    assert live.state()["grips"] == []


def test_a_pin_holds_the_point_of_the_curve() -> None:
    live = engine()
    name = press(live, 20.5, 120.0)
    assert grip(live, name)["now"] == [pytest.approx([20.0, 120.0])]
    assert not grip(live, name)["moved"]


def test_a_point_that_is_held_has_its_pin_already() -> None:
    live = engine()
    first = press(live, 60, 20)
    assert press(live, 60.05, 20.1) == first
    assert press(live, 62, 23) != first


def test_paths_change_from_frame_to_frame() -> None:
    live = engine()
    press(live, 20, 160)
    top = press(live, 60, 20)
    seen = [str(live.drag(top, np.array([[60.0, 20.0 - y]]))["paths"]) for y in (2.0, 4.0, 6.0)]
    assert len(set(seen)) == 3
    assert all('"d"' in frame.replace("'", '"') for frame in seen)


def test_the_first_pull_holds_the_far_side() -> None:
    """Else a pull at the only pin would shift everything, which nobody needs a tool for."""
    live = engine()
    top = press(live, 60, 20)
    pull(live, top, 0, -10)
    grips = live.state()["grips"]
    assert len(grips) == 2
    assert grips[1]["now"] == [pytest.approx([160.0, 160.0])]
    live.undo()
    assert [one["name"] for one in live.state()["grips"]] == [top]


def test_only_the_selected_objects_are_taken_hold_of() -> None:
    live = engine(selected=["box"])
    assert live.press(np.array([20.0, 120.0]), NEAR) is None
    assert live.press(np.array([120.0, 120.0]), NEAR) is not None
    assert live.drawing()["svg"].count("data-dim") == 1


# --- what is written ----------------------------------------------------------------------------


def test_done_is_a_batch_run_of_the_same_handles() -> None:
    live = engine()
    press(live, 20, 160)
    press(live, 160, 160)
    top = press(live, 60, 20)
    pull(live, top, 6, -14)
    new = written(live)
    batch = reruns.load(HOUSE + pins((20, 160), (160, 160)) + moved_from("60 20", 66, 6))
    run.reshape(batch, [], Options())
    assert same_curves(new, batch)
    assert distance(new, "house", (66.0, 6.0)) < 0.01
    # Handles are as Reshape leaves them: a further run moves nothing.
    again = copy.deepcopy(new.getroottree()).getroot()
    run.reshape(again, [], Options())
    assert same_curves(new, again)


def test_the_document_stays_where_nothing_was_done() -> None:
    live = engine()
    assert live.result() is None
    name = press(live, 20, 160)
    live.remove([name])
    assert live.result() is None
    before = canonical(live.whole._svg)
    top = press(live, 60, 20)
    pull(live, top, 6, -14)
    live.settle()
    written(live)
    assert canonical(live.whole._svg) == before


def test_what_is_seen_in_the_end_is_what_is_written() -> None:
    live = engine()
    press(live, 20, 160)
    top = press(live, 60, 20)
    pull(live, top, 6, -14)
    live.answer()
    live.settle()
    new = written(live)
    shown = {element.get("id"): element.get("d") for element in live.page.root.iter("{*}path")}
    assert shown["house"] == get(new, "house").get("d")
    assert shown["box"] == get(new, "box").get("d")


def test_handles_of_the_document_are_there_and_go_on() -> None:
    body = HOUSE + pins((20, 160)) + circle("from a", 60, 20) + circle("to a", 60, 10)
    body += framed("115 95 50 70", 115)
    live = engine(body)
    kinds = [(one["kind"], one["moved"]) for one in live.state()["grips"]]
    assert kinds == [("point", False), ("point", True), ("frame", False)]
    pin, pair, frame = (one["name"] for one in live.state()["grips"])
    pull(live, pair, 0, -5)
    pull(live, frame, 8, 0)
    pull(live, pin, -4, 0)
    new = written(live)
    batch = reruns.load(
        HOUSE
        + moved_from("20 160", 16, 160)
        + circle("from a", 60, 20)
        + circle("to a", 60, 5)
        + framed("115 95 50 70", 123)
    )
    run.reshape(batch, [], Options())
    assert same_curves(new, batch)


def test_a_drawing_that_was_reshaped_is_dragged_on_from_its_original() -> None:
    body = HOUSE + pins((20, 160), (160, 160))
    first = reruns.load(body + moved_from("60 20", 60, 6))
    run.reshape(first, [], Options())
    live = engine(svg=first)
    handle = next(one for one in live.state()["grips"] if one["moved"])
    pull(live, handle["name"], 8, 4)
    # A new pin lies on the curve as it is now, and holds its point of the original there.
    corner = live.moving.curves.now[0, 0]
    assert np.abs(corner - control(first, "house")[0, 0]).max() > 0.5
    pinned = press(live, *corner)
    assert grip(live, pinned)["rest"] == [pytest.approx([20.0, 80.0], abs=1e-3)]
    live.remove([pinned])
    new = written(live)
    batch = reruns.load(body + moved_from("60 20", 68, 10))
    run.reshape(batch, [], Options())
    assert same_curves(new, batch)


def test_without_its_handles_the_drawing_is_what_it_was() -> None:
    first = reruns.load(HOUSE + pins((20, 160)))
    moved = reruns.load(HOUSE + pins((20, 160)) + circle("from a", 60, 20) + circle("to a", 60, 10))
    run.reshape(moved, [], Options())
    live = engine(svg=moved)
    live.remove([one["name"] for one in live.state()["grips"]])
    live.settle()
    assert same_curves(written(live), first)
    assert not list(written(live).iter("{*}circle"))


# --- frames -------------------------------------------------------------------------------------


def test_a_frame_moves_what_is_in_it() -> None:
    live = engine()
    inside = press(live, 120, 120)
    press(live, 20, 160)
    frame = live.add_frame(np.array([115.0, 95.0]), np.array([165.0, 165.0]))
    names = [one["name"] for one in live.state()["grips"]]
    assert frame in names and inside not in names  # it is part of the frame now
    assert live.press(np.array([120.0, 130.0]), NEAR) == frame
    pull(live, frame, 12, 5)
    moved = control(written(live), "box")
    assert moved.reshape(-1, 2).min(axis=0) == pytest.approx([132.0, 105.0], abs=1e-3)
    assert moved.reshape(-1, 2).max(axis=0) == pytest.approx([172.0, 165.0], abs=1e-3)


def test_a_frame_is_scaled_by_its_corners() -> None:
    live = engine()
    press(live, 20, 160)
    frame = live.add_frame(np.array([110.0, 90.0]), np.array([170.0, 170.0]))
    live.drag(frame, np.array([[110.0, 90.0], [140.0, 90.0], [140.0, 130.0], [110.0, 130.0]]))
    moved = control(written(live), "box")
    assert np.ptp(moved.reshape(-1, 2), axis=0) == pytest.approx([20.0, 30.0], abs=1e-3)


def test_a_frame_without_a_curve_is_refused() -> None:
    live = engine()
    with pytest.raises(HandleError, match="no curve in this frame"):
        live.add_frame(np.array([0.0, 0.0]), np.array([5.0, 5.0]))
    assert live.state()["grips"] == []


# --- steps --------------------------------------------------------------------------------------


def test_steps_are_taken_back_and_on() -> None:
    live = engine()
    press(live, 20, 160)
    top = press(live, 60, 20)
    pull(live, top, 0, -10)
    pull(live, top, 0, -4)
    live.undo()
    assert grip(live, top)["now"] == [pytest.approx([60.0, 10.0])]
    live.undo()
    assert grip(live, top)["now"] == [pytest.approx([60.0, 20.0])]
    live.answer()
    (house,) = [n for element, n in live.whole.keys.items() if element.get("id") == "house"]
    (back,) = path_data.parse(live.page.by_key[house].attrib["d"])
    assert np.abs(2.0 * back.control - control(live.whole._svg, "house")).max() < 1e-3
    live.redo()
    live.redo()
    assert not live.state()["redo"]
    assert grip(live, top)["now"] == [pytest.approx([60.0, 6.0])]
    live.undo()
    live.remove([top])
    assert not live.state()["redo"]


def test_what_is_shown_after_a_step_back_and_on_is_the_same() -> None:
    live = engine()
    press(live, 20, 160)
    top = press(live, 60, 20)
    pull(live, top, 0, -10)
    live.answer()
    live.settle()
    shown = live.page.text()
    live.drag(top, np.array([[66.0, 0.0]]))
    live.drag(top, np.array([[60.0, 10.0]]))
    assert live.page.text() != shown
    assert live.settle()["paths"]
    assert live.page.text() == shown


def test_choices_are_steps_too() -> None:
    live = engine()
    press(live, 20, 160)
    top = press(live, 60, 20)
    pull(live, top, 10, 0)
    together = control(written(live), "box")
    live.choose("apart", "alup", False)
    live.answer()
    apart = control(written(live), "box")
    assert np.abs(apart - control(live.whole._svg, "box")).max() == 0.0
    assert np.abs(together - apart).max() > 1.0
    live.choose("normally", "arap", False)
    live.drag(top, np.array([[75.0, 20.0]]))
    live.undo()
    live.undo()
    live.undo()
    assert (live.state()["hold"], live.state()["method"]) == ("normally", "alup")
    assert np.abs(control(written(live), "box") - together).max() < 1e-4


# --- what is regular ----------------------------------------------------------------------------

WALL = '<path id="wall" d="M0,0 H200 V120 H0 Z"/>'
WINDOWS = "".join(f'<rect id="w{n}" x="{20 + 45 * n}" y="30" width="20" height="16"/>' for n in range(4))
WHEELS = '<circle id="left" cx="50" cy="120" r="18"/><circle id="right" cx="150" cy="120" r="18"/>'
CART = WALL + WINDOWS + WHEELS
FREE = '<path id="free" d="M20,60 C50,0 90,30 120,50 C170,90 60,150 20,60 Z"/>'


def lines(found: dict[str, Any]) -> list[np.ndarray]:
    """The firm lines of a picture, each as the control points (k, 4, 2) of its curves."""
    return [subpath.control for subpath in path_data.parse(found["lines"][0])]


def rounds(found: dict[str, Any]) -> list[np.ndarray]:
    """The circles and ellipses among the lines of a picture: four arcs each."""
    whole = [one for one in lines(found) if len(one) == 4 and np.allclose(one[0, 0], one[-1, 3])]
    return [one for one in whole if not np.allclose(3.0 * (one[0, 1] - one[0, 0]), one[0, 3] - one[0, 0])]


def circles(found: dict[str, Any]) -> dict[tuple[float, ...], float]:
    """The circles of a picture: their radii by their centres, rounded."""
    result = {}
    for one in rounds(found):
        centre = (one[0, 0] + one[1, 3]) / 2.0
        radius = np.linalg.norm(curve_points(one) - centre, axis=1)
        if np.ptp(radius) < 5e-3 * radius.mean():
            result[tuple(np.round(centre, 2).tolist())] = float(radius.mean())
    return result


def test_what_is_regular_is_told_and_shown() -> None:
    live = engine(CART)
    assert live.regular() == "2 circles, 2 rows, 4 parts alike, 4 lines"
    found = live.show_regular(True)
    assert circles(found) == {
        (50.0, 120.0): pytest.approx(18.0, rel=1e-3),
        (150.0, 120.0): pytest.approx(18.0, rel=1e-3),
    }
    # A row is the line through its centres, with a tick at each.
    ends = [(one[0, 0].tolist(), one[-1, 3].tolist()) for one in lines(found)]
    assert ([pytest.approx(30.0), pytest.approx(38.0)], [pytest.approx(165.0), pytest.approx(38.0)]) in ends
    for x in (30.0, 75.0, 120.0, 165.0):
        ticks = [(a, b) for a, b in ends if a[0] == b[0] == pytest.approx(x) and a != b]
        assert len(ticks) == 1 and (ticks[0][0][1] + ticks[0][1][1]) / 2.0 == pytest.approx(38.0)
    # What is alike has its own outline.
    boxes = [box for one in lines(found) if (box := np.ptp(one.reshape(-1, 2), axis=0)).tolist() == [20, 16]]
    assert len(boxes) == 4
    assert live.show_regular(False) == {"lines": ("", "")}


def test_a_ring_a_word_and_an_axis_are_shown() -> None:
    angle = np.arange(6) * np.pi / 3
    ring = "".join(
        f'<path d="M{100 + 40 * c:.6f},{60 + 40 * s:.6f} m-4,-4 h8 v8 h-8 Z"/>'
        for c, s in zip(np.cos(angle), np.sin(angle))
    )
    live = engine('<path d="M0,0 H220 V130 H0 Z"/>' + ring)
    assert live.regular() == "1 ring of 6, 6 parts alike, 4 lines"
    assert circles(live.show_regular(True)) == {(100.0, 60.0): pytest.approx(40.0, rel=1e-3)}
    letters = [(30, 8), (42, 14), (60, 9)]
    word = "".join(f'<rect x="{x}" y="40" width="{w}" height="20"/>' for x, w in letters)
    live = engine(WALL + word)
    assert live.regular() == "1 word, 4 lines"
    *sides, line = lines(live.show_regular(True))
    assert sorted(np.linalg.norm(np.ptp(one.reshape(-1, 2), axis=0)) for one in sides) == [120, 120, 200, 200]
    assert [line[0, 0].tolist(), line[-1, 3].tolist()] == [[30.0, 60.0], [69.0, 60.0]]
    live = engine(SYMMETRIC)
    assert live.regular() == "3 lines, mirrored halves"
    *_, line = lines(live.show_regular(True))
    assert line[:, :, 0] == pytest.approx(60.0) and np.ptp(line[:, :, 1]) > 140.0
    live = engine(FREE)
    assert live.regular() == "" and lines(live.show_regular(True)) == []


def test_copies_that_no_row_joins_are_joined_by_faint_lines() -> None:
    flag = '<path d="M{0},{1} l12,0 l-4,7 l6,9 l-14,2 Z"/>'
    live = engine(WALL + flag.format(20, 20) + flag.format(70, 50) + flag.format(140, 90))
    faint = [one.control for one in path_data.parse(live.show_regular(True)["lines"][1])]
    ends = sorted(np.concatenate(faint)[:, [0, 3]].round(3).tolist())
    assert ends == [[[27.0, 29.0], [77.0, 59.0]], [[77.0, 59.0], [147.0, 99.0]]]


def test_lines_go_with_the_drawing_as_far_as_it_stays_regular() -> None:
    live = engine(CART)
    frame = live.add_frame(np.array([28.0, 98.0]), np.array([72.0, 142.0]))
    press(live, 200, 0)
    press(live, 0, 0)
    assert "lines" not in pull(live, frame, -3, 6)
    live.show_regular(True)
    # A frame of the drag and the answer have them where the wheel is.
    for found in (pull(live, frame, -3, 6), live.answer()):
        assert (44.0, 132.0) in circles(found)
    assert len(circles(found)) == 2
    # A wheel that its frame makes an oval has none any more; the other one has.
    corners = np.array(grip(live, frame)["now"])
    middle = corners.mean(axis=0)
    live.drag(frame, middle + (corners - middle) * [1.0, 0.6])
    live.drop()
    (other,) = rounds(live.answer())
    assert other[:, :, 0].min() > 100.0


@pytest.mark.parametrize("kept", [True, False])
def test_done_keeps_what_is_regular_or_not_as_a_batch_run_does(kept: bool) -> None:
    live = engine(CART)
    live.choose("normally", "alup", False, kept)
    assert live.state()["regular"] is kept
    *_held, above, below = [press(live, x, y) for x, y in ((0, 0), (0, 120), (200, 0), (200, 120))]
    pull(live, above, 60, -30)
    pull(live, below, 40, 0)
    live.answer()
    new = written(live)
    batch, other = (
        reruns.load(
            CART + pins((0, 0), (0, 120)) + moved_from("200 0", 260, -30) + moved_from("200 120", 240, 120)
        )
        for _ in range(2)
    )
    run.reshape(batch, [], Options(regular=frozenset(KINDS if kept else ())))
    run.reshape(other, [], Options(regular=frozenset(() if kept else KINDS)))
    ids = ("wall", "w0", "w1", "w2", "w3", "left", "right")
    assert same_curves(new, batch, ids)
    assert not same_curves(new, other, ("w0", "w1", "w2", "w3"))
    # It is a step, which can be taken back.
    live.choose("normally", "alup", False, not kept)
    live.undo()
    assert live.state()["regular"] is kept


# --- symmetric dragging -------------------------------------------------------------------------

SYMMETRIC = '<path id="house" d="M20,80 L60,20 L100,80 V160 H20 Z"/>'


def test_a_partner_moves_along_in_the_mirror() -> None:
    live = engine(SYMMETRIC)
    live.choose("normally", "alup", True)
    assert live.state()["axis"] == [[60.0, 20.0], [60.0, 160.0]]
    press(live, 60, 160)
    left = press(live, 20, 80)
    pull(live, left, -6, -9)
    others = [one for one in live.state()["grips"] if one["name"] != left and one["moved"]]
    assert [one["now"] for one in others] == [[pytest.approx([106.0, 71.0])]]
    pull(live, left, -2, 0)
    assert len(live.state()["grips"]) == 3
    new = control(written(live), "house")
    assert new[1, 0] + new[1, 3] == pytest.approx([120.0 + new[1, 3, 0] - 60.0, new[1, 0, 1] + new[1, 3, 1]])
    assert new[0, 0, 0] + new[1, 3, 0] == pytest.approx(120.0, abs=1e-3)
    assert new[0, 0, 1] == pytest.approx(new[1, 3, 1], abs=1e-3)


def test_a_pin_on_the_axis_stays_on_it() -> None:
    live = engine(SYMMETRIC)
    live.choose("normally", "alup", True)
    press(live, 20, 160)
    top = press(live, 60, 20)
    pull(live, top, 9, -12)
    assert grip(live, top)["now"] == [pytest.approx([60.0, 8.0])]


def test_frames_have_partners_too() -> None:
    live = engine(SYMMETRIC)
    live.choose("normally", "alup", True)
    frame = live.add_frame(np.array([15.0, 70.0]), np.array([30.0, 100.0]))
    pull(live, frame, -5, 3)
    other = next(one for one in live.state()["grips"] if one["name"] != frame)
    assert np.array(other["now"]).min(axis=0) == pytest.approx([95.0, 73.0])


def test_the_axis_is_the_better_one() -> None:
    lying = '<path d="M80,20 L20,60 L80,100 H160 V20 Z"/>'
    live = engine(lying)
    live.choose("normally", "alup", True)
    assert live.state()["axis"] == [[20.0, 60.0], [160.0, 60.0]]


# --- what is newer ------------------------------------------------------------------------------


def test_what_nobody_waits_for_any_more_ends() -> None:
    live = engine()
    press(live, 20, 160)
    top = press(live, 60, 20)
    pull(live, top, 0, -10)
    with live._lock:
        asked: list[BaseException | None] = []

        def settle() -> None:
            try:
                live.settle()
                asked.append(None)
            except SupersededError as error:
                asked.append(error)

        waiting = threading.Thread(target=settle)
        waiting.start()
        while not asked and live._latest == 0:
            pass
        live._latest += 1
    waiting.join()
    # It may have been asked for only after the number was raised; then it is the newest.
    assert len(asked) == 1


def test_solvers_end_when_something_newer_is_asked_for() -> None:
    live = engine()
    press(live, 20, 160)
    top = press(live, 60, 20)
    live.drag(top, np.array([[60.0, 5.0]]))
    latest = live._latest
    with live._while_wanted(latest):
        assert not live._is_late()
        live._latest += 1
        assert live._is_late()
    assert not live._is_late()
    with pytest.raises(SupersededError), live._while_wanted(latest):
        pass
