# SPDX-License-Identifier: GPL-2.0-or-later
"""Small drags equal one large drag, dragging back restores the drawing, and errors change nothing."""

# XML is read more easily on one line.
# ruff: noqa: E501

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from documents import get, text_of
from reruns import (
    DIAGONAL,
    ORIGINAL,
    PAIR,
    PATH,
    PINS,
    UNMOVED,
    WRITTEN,
    add,
    away,
    bounds,
    case,
    circle,
    control,
    drag,
    drawn,
    handle,
    load,
    pins,
    reloaded,
    run,
    steps,
)

from alup.messages.errors import DocumentError, HandleError, SolveError

ONE = PATH + PINS + handle(150, 75)


# --- small drags add up -------------------------------------------------------------------------


@pytest.mark.parametrize("between", ["the same document", "a file"])
def test_ten_drags_equal_one(between: str) -> None:
    ends = np.array([(150.0, 75.0), (185.0, 50.0)])
    many, once = load(ONE), load(ONE)
    for n in range(1, 11):
        x, y = ends[0] + (ends[1] - ends[0]) * n / 10 if n < 10 else ends[1]
        drag(many, "h", x, y)
        told = run(many)
        assert told.edited == []
        assert told.from_original == (["p"] if n > 1 else [])
        if between == "a file":
            many = reloaded(many)
    drag(once, "h", *ends[1])
    run(once)
    assert get(many, "p").get("d") == get(once, "p").get("d")
    assert text_of(many) == text_of(reloaded(once) if between == "a file" else once)
    assert away(many, "p", ends[1]) < 5e-4 * DIAGONAL


def test_ten_drags_of_a_pair_equal_one() -> None:
    pair = circle("from A", 150, 75, identity="a") + circle("to A", 150, 75, identity="b")
    ends = np.array([(150.0, 75.0), (185.0, 50.0)])
    many, once = (load(PATH + PINS + pair) for _ in range(2))
    steps(many, "b", ends)
    drag(once, "b", *ends[1])
    run(once)
    assert get(many, "p").get("d") == get(once, "p").get("d")
    for identity in ("a", "b"):
        assert [float(get(many, identity).get(name)) for name in ("cx", "cy")] == [185.0, 50.0]


def test_ten_drags_of_a_section_equal_one() -> None:
    box = '<path id="p" d="M0,0 H100 V20 H0 Z"/>' + pins((0, 0), (0, 20))
    section = '<rect id="s" inkscape:label="alup:section" alup:rest="70 -10 40 40" x="70" y="-10" width="40" height="40"/>'
    many, once = (load(box + section) for _ in range(2))
    for n in range(1, 11):
        get(many, "s").attrib.update({"x": repr(70.0 + 3 * n), "transform": f"rotate({n}, 90, 10)"})
        run(many)
    get(once, "s").attrib.update({"x": "100", "transform": "rotate(10, 90, 10)"})
    run(once)
    assert get(many, "p").get("d") == get(once, "p").get("d")
    assert bounds(many, "p")[1, 0] > 125.0


@pytest.mark.parametrize("name", ["mug-taller", "truck-longer-box", "elephant-longer-legs"])
def test_ten_drags_of_real_clip_art_equal_one(name: str) -> None:
    many, ids = case(name)
    once, _ = case(name)
    goals = [e for e in many.iter() if (e.attrib.get("id") or "").startswith("handle-to")]
    starts = {}
    for goal in goals:
        origin = next(
            e for e in many.iter() if e.attrib.get("inkscape:label", "") == ""
            and any(v == next(w for k, w in goal.attrib.items() if k.endswith("label")).replace("to", "from") for v in e.attrib.values())
        )  # fmt: skip
        starts[goal] = np.array([float(origin.attrib[n]) for n in ("cx", "cy")])
    ends = {goal: np.array([float(goal.attrib[n]) for n in ("cx", "cy")]) for goal in goals}
    for share in (0.25, 0.5, 0.75, 1.0):
        for goal in goals:
            at = ends[goal] if share == 1.0 else starts[goal] + share * (ends[goal] - starts[goal])
            goal.attrib["cx"], goal.attrib["cy"] = (repr(float(x)) for x in at)
        told = run(many, ids)
        assert told.edited == []
    run(once, ids)
    assert drawn(many) == drawn(once)


def test_a_second_run_changes_nothing_to_the_letter() -> None:
    svg = load(PATH + PINS + handle(150, 75, at=(175, 55)))
    assert run(svg).changed == ["p"]
    before = text_of(svg)
    told = run(svg)
    assert (told.changed, told.from_original, told.edited) == ([], ["p"], [])
    assert text_of(svg) == before


def test_dragging_back_restores_the_drawing() -> None:
    svg = load(PAIR + pins((20, 20), (20, 80)) + handle(140, 80))
    before = drawn(svg)
    drag(svg, "h", 180, 100)
    assert run(svg).changed
    assert drawn(svg) != before
    drag(svg, "h", 140, 80)
    assert set(run(svg).changed) == {"l", "r"}
    assert drawn(svg) == before
    assert not any(ORIGINAL in e.attrib or WRITTEN in e.attrib for e in svg.iter())
    assert UNMOVED not in svg.attrib


def test_without_one_of_the_handles_the_drawing_relaxes() -> None:
    more = handle(115, 70, "g", (100, 40))
    svg, never = (
        load(PATH + PINS + handle(150, 75, at=(175, 55)) + more),
        load(PATH + PINS + handle(150, 75, at=(175, 55))),
    )
    run(svg)
    run(never)
    assert np.abs(control(svg, "p") - control(never, "p")).max() > 1.0
    svg.remove(get(svg, "g"))
    told = run(svg)
    assert told.changed == ["p"]
    assert told.edited == []
    assert get(svg, "p").get("d") == get(never, "p").get("d")


# --- errors leave everything as it was ------------------------------------------------------------


def broken(svg: Any, how: str, monkeypatch: pytest.MonkeyPatch) -> type[Exception]:
    if how == "read":
        add(svg, circle("pin", 300, 200, identity="far"))
        return HandleError
    if how == "parse":
        get(svg, "q").attrib["d"] = "M0,0 Lx"
        return DocumentError
    if how == "solve":
        from alup.network import weld

        def fail(*_: Any) -> Any:
            raise SolveError("no")

        monkeypatch.setattr(weld, "build", fail)
        return SolveError
    from alup.document import writing

    def stop(*_: Any, **__: Any) -> Any:
        raise ZeroDivisionError

    monkeypatch.setattr(writing, how, stop)
    return ZeroDivisionError


@pytest.mark.parametrize(
    "how", ["read", "parse", "solve", "_new_data", "_replace", "record_run", "note_unmoved", "settle"]
)
@pytest.mark.parametrize("which", ["first", "second"])
def test_an_error_leaves_the_document_to_the_letter(
    how: str, which: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    gradient = (
        '<defs><linearGradient id="g" gradientUnits="userSpaceOnUse" x2="50"><stop/></linearGradient></defs>'
    )
    other = '<path id="q" d="M20,200 h30" style="fill:url(#g)"/><rect id="o" width="5" height="5" fill="url(#g)"/>'
    painted = PATH.replace("red", "url(#g)")
    svg = load(gradient + painted + other + PINS + handle(150, 75, at=(175, 55)))
    if which == "second":
        run(svg, "p q")
        drag(svg, "h", 180, 50)
    kind = broken(svg, how, monkeypatch)
    before = text_of(svg)
    with pytest.raises(kind):
        run(svg, "p q")
    assert text_of(svg) == before
