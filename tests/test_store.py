"""Later runs start from what the first one found: nothing drifts, nothing is lost, edits are noticed."""

# XML is read more easily on one line.
# ruff: noqa: E501

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from builders import BLOB
from hypothesis import given, settings
from hypothesis import strategies as st
from lxml import etree
from reruns import (
    ALUP,
    AT,
    CASES,
    COPY,
    INKSCAPE,
    ORIGINAL,
    REST,
    SODIPODI,
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
    get,
    handle,
    load,
    pins,
    reloaded,
    run,
    text_of,
)

from alup import bezier, document, handles, pathdata
from alup.document import digests, records
from alup.document.journal import Journal, State
from alup.document.motion import Moved
from alup.document.places import REACH_OF_DIAGONAL, cuts_of
from alup.errors import DocumentError, HandleError, SolveError

PATH = f'<path id="p" style="fill:red" d="{BLOB}"/>'
PINS = pins((10, 80), (60, 130))
DIAGONAL = 179.0  # of BLOB
ONE = PATH + PINS + handle(150, 75)
# Two rectangles with a common side, and one apart.
LEFT = '<rect id="l" x="20" y="20" width="60" height="60"/>'
RIGHT = '<path id="r" d="M80,20 H140 V80 H80 Z"/>'
PAIR = LEFT + RIGHT


# --- small drags add up -------------------------------------------------------------------------


def steps(svg: Any, identity: str, ends: np.ndarray, ids: str = "", count: int = 10) -> None:
    """Drag a circle in equal steps from one of two points (2, 2) to the other, a run after each."""
    for n in range(1, count + 1):
        x, y = ends[0] + (ends[1] - ends[0]) * n / count if n < count else ends[1]
        drag(svg, identity, x, y)
        run(svg, ids)


@pytest.mark.parametrize("between", ["the same document", "a file"])
def test_ten_drags_are_one(between: str) -> None:
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


def test_ten_drags_of_a_pair_are_one() -> None:
    pair = circle("from A", 150, 75, "a") + circle("to A", 150, 75, "b")
    ends = np.array([(150.0, 75.0), (185.0, 50.0)])
    many, once = (load(PATH + PINS + pair) for _ in range(2))
    steps(many, "b", ends)
    drag(once, "b", *ends[1])
    run(once)
    assert get(many, "p").get("d") == get(once, "p").get("d")
    for identity in ("a", "b"):
        assert [float(get(many, identity).get(name)) for name in ("cx", "cy")] == [185.0, 50.0]


def test_ten_drags_of_a_section_are_one() -> None:
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
def test_ten_drags_of_real_clip_art_are_one(name: str) -> None:
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


def test_going_back_is_the_beginning() -> None:
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


def test_handles_remember_and_are_in_the_file_as_they_were_given() -> None:
    svg = load(PATH + PINS + circle("handle", 175, 55, "h", more='alup:rest=" 150,75.0 "'))
    run(svg)
    assert get(svg, "h").get(REST) == " 150,75.0 "
    assert [float(x) for x in get(svg, "h").get(AT).split()] == [175, 55]
    pin = get(svg, "pin10_80")
    assert [float(x) for x in pin.get(REST).split()] == [float(x) for x in pin.get(AT).split()] == [10, 80]


def test_nothing_moved_stores_nothing() -> None:
    svg = load(PATH + PINS + circle("handle", 150, 75, "h"))
    before = text_of(svg)
    assert run(svg).changed == []
    assert text_of(svg) == before


def test_the_namespace_is_declared_once() -> None:
    svg = load((PATH + PINS + circle("from a", 150, 75) + circle("to a", 170, 60)), declared=False)
    run(svg)
    assert text_of(svg).count(ALUP.encode()) == 1
    assert b'xmlns:alup="' + ALUP.encode() in text_of(svg)


def test_the_size_of_what_is_stored() -> None:
    """The old path data, a digest, and not much more."""
    for name in CASES:
        svg, ids = case(name)
        before = len(text_of(svg))
        run(svg, ids)
        grown = len(text_of(svg)) - before
        stored = sum(len(e.attrib.get(ORIGINAL, "")) for e in svg.iter())
        count = sum(ORIGINAL in e.attrib for e in svg.iter())
        assert stored < before + 150 * count
        assert grown < 3 * before + 400 * count + 600


# --- new handles on what was reshaped ------------------------------------------------------------


@pytest.fixture
def bent() -> Any:
    """BLOB, reshaped so much that segments were divided."""
    svg = load(PATH + PINS + handle(150, 75, at=(185, 40)))
    run(svg)
    return svg


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """Largest distance between curves (s, 4, 2) and other ones."""
    from builders import curve_points

    from alup.bezier import Nearest

    pairs = ((one, Nearest(other)), (other, Nearest(one)))
    return max(nearest.find(point)[3] for curves, nearest in pairs for point in curve_points(curves))


def node(svg: Any, was: tuple[float, float]) -> np.ndarray:
    """Where a node of BLOB is now."""
    number = [tuple(p) for p in pathdata.parse(BLOB)[0].control[:, 0].tolist()].index(was)
    record = records.from_text(get(svg, "p").attrib.get(ORIGINAL) or "")
    added = sum(len(cuts) for n, cuts in record.cuts.items() if n < number) if record else 0
    return control(svg, "p")[number + added, 0]


@pytest.mark.parametrize("segment", range(15))
def test_a_new_pin_holds_what_is_under_it_now(bent: Any, segment: int) -> None:
    """And all else nearly stays: a point that is held is a further sample, and solved a little otherwise."""
    before = control(bent, "p")
    point = bezier.evaluate(before[segment], np.array(0.4))
    add(bent, circle("pin", *point.tolist(), identity="new"))
    told = run(bent)
    assert told.edited == []
    assert away(bent, "p", point) < 1e-4 * DIAGONAL
    assert apart(control(bent, "p"), before) < 1e-2 * DIAGONAL


def test_a_new_pin_holds_its_point_from_now_on(bent: Any) -> None:
    point = node(bent, (115.0, 70.0))
    assert np.abs(point - (115, 70)).max() > 5.0
    add(bent, circle("pin", *point.tolist(), identity="new"))
    run(bent)
    np.testing.assert_allclose([float(x) for x in get(bent, "new").get(REST).split()], (115, 70), atol=1e-6)
    drag(bent, "h", 150, 75)
    run(bent)
    assert np.abs(node(bent, (115.0, 70.0)) - point).max() < 1e-4 * DIAGONAL


def test_a_new_pin_beside_the_curve_moves_onto_it_and_not_the_curve(bent: Any) -> None:
    before = control(bent, "p")
    point = bezier.evaluate(before[7], np.array(0.5)) + (0.5, -0.6)
    add(bent, circle("pin", *point.tolist(), identity="new", r=2.0))
    off = away(bent, "p", point)
    assert off > 0.3
    run(bent)
    stands = [float(get(bent, "new").get(name)) for name in ("cx", "cy")]
    assert away(bent, "p", stands) < 1e-4 * DIAGONAL
    assert np.hypot(*(stands - point)) == pytest.approx(off, abs=1e-6)
    again = control(bent, "p")
    run(bent)
    assert np.abs(control(bent, "p") - again).max() < 1e-5


def test_a_new_pair_takes_the_point_under_it_along(bent: Any) -> None:
    point = node(bent, (115.0, 70.0))
    goal = point + [10.0, 10.0]
    add(bent, circle("from N", *point.tolist(), identity="f") + circle("to N", *goal.tolist(), identity="t"))
    run(bent)
    assert np.abs(node(bent, (115.0, 70.0)) - goal).max() < 1e-4 * DIAGONAL
    np.testing.assert_allclose([float(x) for x in get(bent, "f").get(REST).split()], (115, 70), atol=1e-6)


def test_a_pin_that_is_put_elsewhere_holds_another_point(bent: Any) -> None:
    point = node(bent, (115.0, 70.0))
    drag(bent, "pin60_130", *point.tolist())
    run(bent)
    assert np.abs(node(bent, (115.0, 70.0)) - point).max() < 1e-4 * DIAGONAL
    np.testing.assert_allclose(
        [float(x) for x in get(bent, "pin60_130").get(REST).split()], (115, 70), atol=1e-6
    )


def test_a_new_handle_off_the_curves_is_refused(bent: Any) -> None:
    """Also where a curve was before the first run."""
    assert away(bent, "p", (150, 75)) > 2.0
    add(bent, circle("pin", 150, 75, "new"))
    before = text_of(bent)
    with pytest.raises(HandleError, match=r"new .*not on a curve"):
        run(bent)
    assert text_of(bent) == before


def test_a_new_handle_that_lies_on_something_else_has_no_part() -> None:
    svg = load(PAIR + pins((20, 20), (20, 80)) + handle(80, 80, at=(95, 90)))
    run(svg, "l r")
    add(svg, circle("pin", *control(svg, "r")[1, 3].tolist(), identity="new"))
    told = run(svg, "l")
    assert [name[:3] for name in told.ignored] == ["new"]
    assert REST not in get(svg, "new").attrib


def test_a_new_section_holds_what_is_in_it_now() -> None:
    box = '<path id="p" d="M0,0 H100 V20 H0 Z"/>' + pins((0, 0), (0, 20))
    svg = load(box + handle(100, 0, "h", (150, 0)) + handle(100, 20, "g", (150, 20)))
    run(svg)
    before = control(svg, "p")
    add(svg, '<rect id="s" inkscape:label="alup:section" x="140" y="-10" width="30" height="40"/>')
    svg.remove(get(svg, "h"))
    svg.remove(get(svg, "g"))
    run(svg)
    assert np.abs(control(svg, "p")[[1, 2], 0] - before[[1, 2], 0]).max() < 0.05
    rest = np.array(get(svg, "s").get(REST).split(), dtype=float)
    again = text_of(svg)
    run(svg)
    assert text_of(svg) == again
    assert rest[0] > 50.0


@pytest.mark.parametrize("move", [np.array([30.0, -20.0]), np.array([0.3, 0.7])])
def test_points_of_the_original(move: np.ndarray) -> None:
    at = ((10, 80), (60, 20), (60, 130), (150, 75))
    svg = load(PATH + "".join(handle(*p, f"h{n}", (np.array(p) + move).tolist()) for n, p in enumerate(at)))
    points = control(svg, "p")[:, 1:].reshape(-1, 2)
    assert np.array_equal(document.original_points(svg, points), points)
    run(svg)
    back = document.original_points(svg, points + move)
    np.testing.assert_allclose(back, points, atol=1e-5)


def test_where_segments_were_divided_is_found_again() -> None:
    """Exactly, if nothing but a map has moved the parts."""
    old = np.array(
        [[(0.0, 0.0), (30.0, 80.0), (90.0, 10.0), (50.0, -20.0)], [(0, 0), (1, 0), (2, 0), (3, 0)]]
    )
    stops = np.array([0.0, 0.1, 0.45, 0.8, 1.0])
    parts = (
        bezier.subrange(np.repeat(old[:1], 4, axis=0), stops[:-1], stops[1:]) @ [[1.5, 0.3], [-0.2, 0.7]]
        + 5.0
    )
    new = np.concatenate([parts, old[1:]])
    source, no = np.array([0, 0, 0, 0, 1]), np.zeros(5, dtype=bool)
    cuts = cuts_of(Moved(old, new, source, no, no, True))
    assert list(cuts) == [0]
    np.testing.assert_allclose(cuts[0], stops[1:-1], atol=1e-12)


def test_points_of_the_original_where_segments_were_divided() -> None:
    svg = load('<path id="p" d="M0,0 H100"/>' + pins((0, 0), (100, 0)) + handle(50, 0, "h", (50, 30)))
    run(svg)
    assert len(control(svg, "p")) > 1
    record = records.from_text(get(svg, "p").get(ORIGINAL))
    assert record is not None
    assert list(record.cuts) == [0]
    now = control(svg, "p")
    back = document.original_points(svg, np.concatenate([now[:, 0], now[-1:, 3], [(50.0, 30.0)]]))
    assert np.abs(back[:, 1]).max() < 0.1
    assert np.all(np.diff(back[:-1, 0]) > 0)
    np.testing.assert_allclose(back[[0, -2, -1]], [(0, 0), (100, 0), (50, 0)], atol=0.1)
    add(svg, circle("pin", *now[0, 3].tolist(), identity="new"))
    before = control(svg, "p")
    run(svg)
    assert away(svg, "p", before[0, 3]) < 0.05


def test_the_reach_of_handles_is_the_solvers() -> None:
    assert REACH_OF_DIAGONAL == handles.REACH_OF_DIAGONAL


# --- what a person does in between ---------------------------------------------------------------


RECOLOURED = {
    "style": ('style="fill:red;stroke:black"', "style", "stroke:black;fill:#00ff00"),
    "attribute": ('fill="red"', "fill", "#00ff00"),
    "opacity": ("", "opacity", "0.5"),
}


@pytest.mark.parametrize(("given_", "name", "value"), RECOLOURED.values(), ids=RECOLOURED.keys())
def test_a_new_colour_survives(given_: str, name: str, value: str) -> None:
    svg = load(LEFT.replace("/>", f" {given_}/>") + pins((20, 20), (20, 80)) + handle(80, 80, at=(100, 90)))
    run(svg)
    get(svg, "l").attrib[name] = value
    drag(svg, "h", 90, 85)
    told = run(svg)
    assert told.edited == []
    assert get(svg, "l").attrib[name] == value
    drag(svg, "h", 80, 80)
    run(svg)
    rect = get(svg, "l")
    assert rect.tag.endswith("rect")
    assert rect.attrib[name] == value


def edit_node(svg: Any, identity: str, which: int = 1) -> None:
    """Move a node of a path by (5, -12)."""
    element = get(svg, identity)
    (subpath,) = pathdata.parse(element.get("d"))
    nodes = subpath.control[:, 0].copy()
    nodes[which] += (5.0, -12.0)
    element.attrib["d"] = "M " + " L ".join(f"{x!r},{y!r}" for x, y in nodes.tolist()) + " Z"


def shared_side(svg: Any) -> float:
    """How far the sides that the two rectangles have in common are apart."""
    left, right = control(svg, "l"), control(svg, "r")
    nodes = np.concatenate([right[:, 0]])
    ends = left[:, 0][np.argsort(left[:, 0, 0])[2:]]
    return float(max(np.linalg.norm(nodes - end, axis=1).min() for end in ends))


def test_an_edited_path_is_noticed_and_nothing_tears() -> None:
    svg = load(PAIR + pins((20, 20), (20, 80)) + handle(80, 80, at=(100, 95)))
    run(svg)
    edit_node(svg, "r")
    edited = control(svg, "r")
    drag(svg, "h", 105, 100)
    told = run(svg)
    assert told.edited == ["r"]
    assert told.from_original == []
    assert shared_side(svg) < 1e-6
    assert away(svg, "l", (105, 100)) < 0.05
    # From now on it counts as edited, and later runs start from here.
    drag(svg, "h", 100, 95)
    told = run(svg)
    assert told.edited == []
    assert set(told.from_original) == {"l", "r"}
    assert np.abs(control(svg, "r") - edited).max() < 1e-6
    document.restore(svg, [])
    assert np.abs(control(svg, "r") - edited).max() < 1e-9
    assert get(svg, "l").tag.endswith("rect")
    assert get(svg, "l").get("width") == "60"


def test_ten_drags_are_one_also_after_an_edit() -> None:
    both = []
    for count in (1, 10):
        svg = load(PAIR + pins((20, 20), (20, 80)) + handle(80, 80, at=(100, 95)))
        run(svg)
        edit_node(svg, "r")
        steps(svg, "h", np.array([(100.0, 95.0), (120.0, 110.0)]), count=count)
        both.append(drawn(svg))
    assert both[0] == both[1]


def test_an_object_that_was_moved_is_noticed() -> None:
    svg = load(PAIR + pins((20, 20), (20, 80)) + handle(80, 80, at=(100, 95)))
    run(svg)
    get(svg, "r").attrib["transform"] = "translate(50,0)"
    before = control(svg, "r")
    told = run(svg)
    assert told.edited == ["r"]
    assert told.changed == []
    assert np.array_equal(control(svg, "r"), before)


def test_a_group_that_was_moved_is_noticed() -> None:
    svg = load(f'<g id="g">{RIGHT}</g>{LEFT}' + pins((20, 20), (20, 80)) + handle(80, 80, at=(100, 95)))
    run(svg)
    get(svg, "g").attrib["transform"] = "translate(50,0)"
    assert run(svg).edited == ["r"]


def test_a_drawing_that_is_moved_with_its_handles_keeps_its_originals() -> None:
    body = PAIR + '<text id="t" x="30" y="50" style="font-size:10px">T</text>' + pins((20, 20), (20, 80))
    here = load(f"<g id='g'>{body}{handle(80, 80, at=(100, 95))}</g>")
    run(here)
    once = reloaded(here)
    drag(once, "h", 110, 100)
    run(once)
    get(here, "g").attrib["transform"] = "translate(31,-17) rotate(30)"
    drag(here, "h", 110, 100)
    told = run(here)
    assert told.edited == []
    assert set(told.from_original) == {"l", "r", "t"}
    get(here, "g").attrib.pop("transform")
    for identity in "lr":
        np.testing.assert_allclose(control(here, identity), control(once, identity), atol=1.0)
    # Each by its own transform, as Inkscape moves what is selected.
    alone = load(f"{body}{handle(80, 80, at=(100, 95))}")
    run(alone)
    for element in alone:
        element.attrib["transform"] = "translate(7,9) " + element.attrib.get("transform", "")
    before = control(alone, "l")
    told = run(alone)
    assert told.edited == []
    assert np.abs(control(alone, "l") - before).max() < 1e-4
    drag(alone, "h", 110, 100)
    assert run(alone).edited == []
    for identity in "lr":
        np.testing.assert_allclose(control(alone, identity), control(once, identity) + (7, 9), atol=1e-3)
    text = [
        np.array(re.findall(r"-?[\d.]+", get(s, "t").attrib["transform"]), dtype=float) for s in (alone, once)
    ]
    np.testing.assert_allclose(text[0][-2:], text[1][-2:] + (7, 9), atol=1e-3)


@pytest.mark.parametrize("off", [0.0, 0.5])
def test_handles_that_were_moved_with_an_edited_drawing_are_pins(off: float) -> None:
    section = '<rect id="s" inkscape:label="alup:section" alup:rest="130 10 20 20" x="140" y="5" width="20" height="20"/>'
    svg = load(PAIR + pins((20, 20), (20, 80)) + handle(140, 80, at=(180, 100)) + section)
    run(svg)
    for element in svg:
        element.attrib["transform"] = "translate(130,70)"
    get(svg, "r").attrib["transform"] = f"translate(130,{70 + off})"
    edit_node(svg, "r", 3)
    before = drawn(svg)
    told = run(svg)
    assert told.edited == (["l", "r"] if off else ["r"])
    assert told.changed == []
    assert drawn(svg) == before


def test_what_is_drawn_afterwards_makes_a_new_base() -> None:
    svg = load(PAIR + pins((20, 20), (20, 80)) + handle(140, 80, at=(180, 100)))
    run(svg)
    add(svg, '<path id="n" d="M150,50 h5 v5 h-5 z"/>')
    before = drawn(svg)
    told = run(svg)
    assert told.edited == ["n"]
    assert told.changed == []
    assert drawn(svg) == before
    told = run(svg)
    assert told.edited == []


def test_what_was_not_part_of_the_first_run_is_no_news() -> None:
    svg = load(PAIR + '<rect id="apart" x="300" y="200" width="20" height="20"/>'
               '<rect id="hidden" style="display:none" x="300" y="200" width="20" height="20"/>'
               + pins((20, 20), (20, 80)) + handle(80, 80, at=(100, 95)))  # fmt: skip
    run(svg, "l r")
    get(svg, "hidden").attrib.pop("style")
    drag(svg, "h", 101, 96)
    assert run(svg, "l r").edited == []  # after which the others are known as before
    assert run(svg, tandem=False).edited == []
    get(svg, "apart").attrib["x"] = "301"
    assert run(svg, tandem=False).edited == ["apart"]


def test_a_part_of_what_was_reshaped_can_be_reshaped_alone() -> None:
    """Handles of the others rest on what those were, and have no part."""
    svg = load(
        PAIR + pins((20, 20), (20, 80)) + handle(140, 80, "g", (180, 120)) + handle(80, 20, "h", (90, 10))
    )
    run(svg)
    once = text_of(svg)
    told = run(svg, "l")
    assert told.edited == []
    assert told.from_original == ["l"]
    assert [name for name in told.ignored if name.startswith("g")]
    assert get(svg, "r").get("d").encode() in once
    assert get(svg, "g").attrib == get(reloaded(etree.fromstring(once)), "g").attrib
    assert away(svg, "l", (90, 10)) < 0.05


def test_a_duplicate_is_as_good_as_what_it_was_made_from() -> None:
    svg = load(PATH + PINS + handle(150, 75, at=(175, 55)))
    run(svg)
    twin = etree.fromstring(etree.tostring(get(svg, "p")))
    twin.attrib["id"] = "q"
    svg.insert(1, twin)
    svg = reloaded(svg)
    drag(svg, "h", 185, 50)
    told = run(svg)
    assert told.edited == []
    assert sorted(told.from_original) == ["p", "q"]
    assert get(svg, "q").get("d") == get(svg, "p").get("d")


def test_what_is_pasted_into_another_drawing_starts_from_what_it_is() -> None:
    svg = load(PATH + PINS + handle(150, 75, at=(175, 55)))
    run(svg)
    other = load('<path id="o" d="M100,100 h30"/>')
    for element in list(svg):
        other.append(element)
    before = drawn(other)
    told = run(other, "p o", tandem=False)
    assert told.edited == ["o"]
    assert drawn(other) == before
    assert len(document.restore(other, [])) == 1
    assert get(other, "p").get("d") == BLOB


def test_a_new_base_is_one_of_the_whole_document() -> None:
    """Also for what had no part in the run that made it, and its handles."""
    apart = '<path id="q" d="M200,20 h60 v60 h-60 z"/>'
    svg = load(
        PAIR
        + apart
        + pins((20, 20), (20, 80), (200, 20))
        + handle(80, 80, at=(100, 95))
        + handle(260, 80, "k", (290, 110))
    )
    run(svg)
    edit_node(svg, "r")
    assert run(svg, "l r").edited == ["r"]
    before = drawn(svg)
    told = run(svg, "q")
    assert (told.edited, told.changed) == ([], [])
    assert drawn(svg) == before
    drag(svg, "k", 280, 90)
    assert run(svg).edited == []
    assert away(svg, "q", (280, 90)) < 0.05
    document.restore(svg, [get(svg, "q")])
    assert get(svg, "q").attrib["d"] == "M200,20 h60 v60 h-60 z"


def test_a_path_that_lost_its_record_starts_from_what_it_is() -> None:
    svg = load(PATH + PINS + handle(150, 75, at=(175, 55)))
    run(svg)
    for name in (ORIGINAL, WRITTEN):
        del get(svg, "p").attrib[name]
    before = drawn(svg)
    run(svg)
    assert drawn(svg) == before


DAMAGED = ["", "{", "{}", "[]", "12", "{'original':5}", "{'original':{'tag':'svg:re ct'}}",
           "{'original':{'set':{'d':7}}}", "{'original':{'set':{'a b':'c'}}}", "{'original':{},'cuts':{'x':1}}",
           "{'original':{'set':{'nope:d':'c'}}}"]  # fmt: skip


@pytest.mark.parametrize("text", DAMAGED)
def test_a_damaged_record_is_none_and_told(text: str) -> None:
    svg = load(PATH + PINS + handle(150, 75, at=(175, 55)))
    run(svg)
    get(svg, "p").attrib[ORIGINAL] = text
    before = drawn(svg)
    told = run(svg)
    assert told.edited == ["p"]
    assert drawn(svg) == before
    assert ORIGINAL not in get(svg, "p").attrib


def test_a_damaged_digest_is_an_edit() -> None:
    svg = load(PATH + PINS + handle(150, 75, at=(175, 55)))
    run(svg)
    get(svg, "p").attrib[WRITTEN] = "x y z"
    assert run(svg).edited == ["p"]


# --- errors leave everything as it was ------------------------------------------------------------


def broken(svg: Any, how: str, monkeypatch: pytest.MonkeyPatch) -> type[Exception]:
    if how == "read":
        add(svg, circle("pin", 300, 200, "far"))
        return HandleError
    if how == "parse":
        get(svg, "q").attrib["d"] = "M0,0 Lx"
        return DocumentError
    if how == "solve":
        from alup import pipeline

        def fail(*_: Any) -> Any:
            raise SolveError("no")

        monkeypatch.setattr(pipeline.network, "build", fail)
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


# --- what belongs to the shapes -------------------------------------------------------------------

GRADIENT = (
    '<linearGradient id="g" gradientUnits="userSpaceOnUse" x1="20" y1="50" x2="80" y2="50">'
    '<stop offset="0" stop-color="#f00"/><stop offset="1" stop-color="#00f"/></linearGradient>'
)
CLIP = '<clipPath id="c"><rect id="cr" x="30" y="30" width="30" height="30"/></clipPath>'
AROUND = handle(20, 20, "h0") + handle(80, 20, "h1") + handle(80, 80, "h2") + handle(20, 80, "h3")
SQUARE = '<rect id="l" x="20" y="20" width="60" height="60" {}/>'
OTHER = '<rect id="o" x="200" y="20" width="60" height="60" {}/>'
FILLED = SQUARE.format('fill="url(#g)"')
BELONGING = {
    "gradient": (f"<defs>{GRADIENT}</defs>", SQUARE.format('fill="url(#g)"')),
    "gradient in a style": (f"<defs>{GRADIENT}</defs>", SQUARE.format('style="stroke:red; fill : url(#g) red"')),
    "shared gradient": (f"<defs>{GRADIENT}</defs>\n", SQUARE.format('style="fill:url(#g)"') + OTHER.format('fill="url(#g)"')),
    "pattern": ('<defs><pattern id="g" patternUnits="userSpaceOnUse" width="9" height="9"><path d="M0,0h5"/></pattern></defs>', SQUARE.format('fill="url(#g)"')),
    "clip": (f"<defs>{CLIP}</defs>", SQUARE.format('clip-path="url(#c)"')),
    "shared clip": (f"<defs>\n  {CLIP}\n</defs>", SQUARE.format('clip-path="url(#c)"') + OTHER.format('clip-path="url(#c)"')),
    "clip of clones": ('<defs><path id="cp" d="M30,30 h30 v30 z"><title>T</title></path><clipPath id="c"><use id="cu" xlink:href="#cp"/></clipPath></defs>', SQUARE.format('clip-path="url(#c)"')),
    "mask": ('<defs><mask id="m" maskUnits="userSpaceOnUse" x="10" y="10" width="80" height="80"><rect id="mr" x="30" y="30" width="30" height="30" fill="white"/><text id="mt" x="40" y="40">M</text></mask></defs>', SQUARE.format('style="mask:url(#m)"')),
    "clip of a group": (f"<defs>{CLIP}</defs>", f'<g id="n" clip-path="url(#c)">{SQUARE.format("")}</g>'),
    "clipped clip": (f'<defs>{CLIP.replace("<clipPath", "<clipPath clip-path=" + chr(34) + "url(#d)" + chr(34))}<clipPath id="d"><circle id="dc" cx="50" cy="50" r="12"/></clipPath></defs>', SQUARE.format('clip-path="url(#c)"')),
    "shared clipped clip": (f'<defs>{CLIP.replace("<clipPath", "<clipPath clip-path=" + chr(34) + "url(#d)" + chr(34))}<clipPath id="d"><rect id="dr" x="40" y="40" width="30" height="30"/></clipPath></defs>', SQUARE.format('clip-path="url(#c)"') + OTHER.format('clip-path="url(#c)"')),
    "text": ("", SQUARE.format("") + '<text id="t" x="30" y="50" style="font-size:10px">Text</text>'),
    "image": ("", SQUARE.format("") + '<image id="i" x="30" y="30" width="20" height="20" transform="rotate(3)"/>'),
    "style sheet": ("<style>rect {fill:#0a0;opacity:0.5} .c {stroke:url(#g)}</style><defs>" + GRADIENT + "</defs>", SQUARE.format('class="c"')),
    "live effect": ("", '<g id="n" inkscape:path-effect="#e"><path id="l" inkscape:original-d="M 0,0" inkscape:path-effect="#f" d="M20,20 h60 v60 h-60 z" sodipodi:nodetypes="ccccc"/>'
                        '<path id="x" inkscape:original-d="M 1,1" style="display:none" d="M1,1 h3"/></g>'),
    "star": ("", '<path id="l" sodipodi:type="star" sodipodi:sides="5" inkscape:rounded="0" d="M20,20 h60 v60 h-60 z" style="fill:red"/>'),
}  # fmt: skip


def push(svg: Any, x: float, y: float, wider: float = 1.0) -> None:
    """Drag the four handles of the square along."""
    for n, (px, py) in enumerate(((20, 20), (80, 20), (80, 80), (20, 80))):
        drag(svg, f"h{n}", 20 + (px - 20) * wider + x, py + y)


@pytest.mark.parametrize(("defs", "body"), BELONGING.values(), ids=BELONGING.keys())
def test_what_belongs_to_shapes_starts_from_its_original(defs: str, body: str) -> None:
    many, once = (load(defs + body + AROUND) for _ in range(2))
    untouched = drawn(many)
    for share in (0.5, 0.75, 1.0):
        push(many, 40 * share, 10 * share, 1.0 + share)
        told = run(many, tandem=True)
        assert told.edited == [], share
        many = reloaded(many)
    push(once, 40, 10, 2.0)
    told = run(once)
    assert drawn(many) == drawn(once)
    again = text_of(many)
    assert run(many).changed == []
    assert text_of(many) == again
    push(many, 0, 0)
    run(many)
    assert drawn(many) == untouched


SELECTED = {
    name: BELONGING[name]
    for name in (
        "gradient",
        "shared gradient",
        "clip",
        "shared clip",
        "clipped clip",
        "shared clipped clip",
        "pattern",
    )
}


@pytest.mark.parametrize(("defs", "body"), SELECTED.values(), ids=SELECTED.keys())
def test_one_of_two_that_were_reshaped_together(defs: str, body: str) -> None:
    """What they share was changed in place; the one that is reshaped alone gets a copy of the original."""
    other = body if 'id="o"' in body else body + OTHER.format(re.search(r'60" (.*)/>', body).group(1))  # type: ignore[union-attr]
    more = "".join(
        handle(x, y, f"k{n}", (x + 40, y + 10))
        for n, (x, y) in enumerate(((200, 20), (260, 20), (260, 80), (200, 80)))
    )
    svg = load(defs + other + AROUND + more)
    push(svg, 40, 10)
    run(svg)
    neighbour = text_of(get(svg, "o"))
    before = bounds(svg, "l")
    push(svg, 0, 60)
    told = run(svg, "l")
    assert told.edited == []
    assert text_of(get(svg, "o")) == neighbour
    np.testing.assert_allclose(bounds(svg, "l"), before + (-40, 50), atol=1e-3)
    for identity, shift in (("l", (0, 60)), ("o", (40, 10))):
        np.testing.assert_allclose(paint_shift(svg, identity), shift, atol=2e-3)
        inner = get(svg, clip_of(svg, identity)).attrib.get("clip-path") if "clip" in body else None
        if inner:
            np.testing.assert_allclose(
                clip_shift(svg, inner[5:-1], (38, 38) if "dc" in defs else (40, 40)), shift, atol=0.02
            )
    document.restore(svg, [])
    assert not [e for e in svg.iter() if e.attrib.get(COPY)]
    for identity in "lo":
        np.testing.assert_allclose(paint_shift(svg, identity), (0, 0), atol=1e-9)


def paint_shift(svg: Any, identity: str) -> np.ndarray:
    """How far what paints or clips an element has been moved from where it was drawn."""
    from alup.document import tree

    element = get(svg, identity)
    text = " ".join(element.attrib.get(name) or "" for name in ("style", "fill", "clip-path"))
    target = get(svg, re.search(r"url\(#([^)]+)\)", text).group(1))  # type: ignore[union-attr]
    if target.tag.endswith("clipPath"):
        return clip_shift(svg, target.attrib["id"], (30, 30))
    name = "patternTransform" if "pattern" in target.tag else "gradientTransform"
    return tree.own_matrix(target, name)[:2, 2]


def clip_of(svg: Any, identity: str) -> str:
    return str(get(svg, identity).attrib["clip-path"])[5:-1]


def clip_shift(svg: Any, identity: str, corner: tuple[float, float]) -> np.ndarray:
    """How far the first shape of a clip path has been moved from where its upper left corner was."""
    from alup.document import tree

    points = tree.read_shape(get(svg, identity)[0], np.eye(3)[:2]).control[:, [0, 3]].reshape(-1, 2)
    return points.min(axis=0) - corner


def test_a_live_effect_of_a_group_comes_back_when_all_in_it_is_back() -> None:
    effect = f"{{{INKSCAPE}}}path-effect"
    body = f'<g id="n" inkscape:path-effect="#e">{SQUARE.format("")}<path id="r" inkscape:original-d="M 0,0" d="M100,20 h30 v20 z"/></g>'
    svg = load(body + AROUND + pins((100, 20)) + handle(130, 40, "k", (140, 50)))
    push(svg, 10, 10)
    run(svg)
    assert effect not in get(svg, "n").attrib
    document.restore(svg, [get(svg, "l")])
    assert effect not in get(svg, "n").attrib
    document.restore(svg, [get(svg, "r")])
    assert get(svg, "n").attrib[effect] == "#e"


def test_a_gradient_given_in_between_makes_a_new_base() -> None:
    new = GRADIENT.replace('"g"', '"new"')
    svg = load(f"<defs>{GRADIENT}</defs>{FILLED}{AROUND}")
    push(svg, 40, 10)
    run(svg)
    add(svg, f"<defs>{new}</defs>")
    get(svg, "l").attrib["fill"] = "url(#new)"
    told = run(svg)
    assert told.edited == ["l"]
    assert told.changed == []
    assert paint_shift(svg, "l").tolist() == [0.0, 0.0]
    push(svg, 50, 20)
    run(svg)
    np.testing.assert_allclose(paint_shift(svg, "l"), (10, 10), atol=1e-4)


def test_a_copy_of_what_has_a_record_has_none() -> None:
    svg = load(f"<defs>{GRADIENT}</defs>{FILLED}{AROUND}")
    push(svg, 40, 10)
    run(svg)
    assert ORIGINAL in get(svg, "g").attrib
    add(svg, '<rect id="n" x="200" width="9" height="9" fill="url(#g)"/>')
    push(svg, 50, 20)
    assert run(svg, "l n", tandem=False).edited == ["n"]
    assert get(svg, "l").attrib["fill"] == "url(#g-1)"
    np.testing.assert_allclose(paint_shift(svg, "l"), (50, 20), atol=1e-4)
    np.testing.assert_allclose(paint_shift(svg, "n"), (40, 10), atol=1e-4)
    assert ORIGINAL not in get(svg, "g-1").attrib
    push(svg, 60, 30)
    assert run(svg, "l n", tandem=False).edited == []
    np.testing.assert_allclose(paint_shift(svg, "l"), (60, 30), atol=1e-4)


def test_a_clip_given_in_between_makes_a_new_base() -> None:
    svg = load(SQUARE.format("") + AROUND)
    push(svg, 40, 10)
    run(svg)
    add(svg, f"<defs>{CLIP}</defs>")
    get(svg, "l").attrib["clip-path"] = "url(#c)"
    told = run(svg)
    assert told.edited == ["l"]
    assert paint_shift(svg, "l").tolist() == [0.0, 0.0]


@pytest.mark.parametrize("which", ["clip", "shared clip"])
def test_an_edited_clip_is_noticed(which: str) -> None:
    defs, body = BELONGING[which]
    svg = load(defs + body + AROUND)
    push(svg, 40, 10)
    run(svg, "l")
    target = get(svg, re.search(r"#([^)]+)", get(svg, "l").attrib["clip-path"]).group(1))  # type: ignore[union-attr]
    target[0].attrib["d"] = "M40,40 h50 v20 z"
    told = run(svg, "l")
    assert len(told.edited) == 1
    assert target[0].attrib["d"] == "M40,40 h50 v20 z"


def test_an_edited_copy_of_a_gradient_is_noticed() -> None:
    defs, body = BELONGING["shared gradient"]
    svg = load(defs + body + AROUND)
    push(svg, 40, 10)
    run(svg, "l")
    target = get(svg, "g-1")
    target.attrib["x1"] = "30"
    told = run(svg, "l")
    assert told.edited == ["l"]
    assert get(svg, "g-1").attrib["x1"] == "30"


def test_the_ends_of_a_gradient_may_be_moved() -> None:
    defs, body = BELONGING["gradient"]
    svg = load(defs + body + AROUND)
    push(svg, 40, 10)
    run(svg)
    get(svg, "g").attrib["x1"] = "30"
    told = run(svg)
    assert told.edited == []
    assert get(svg, "g").attrib["x1"] == "30"
    np.testing.assert_allclose(paint_shift(svg, "l"), (40, 10), atol=1e-4)


def test_a_text_that_was_moved_is_noticed() -> None:
    defs, body = BELONGING["text"]
    svg = load(defs + body + AROUND)
    push(svg, 40, 10)
    run(svg)
    get(svg, "t").attrib["transform"] = "translate(3,4)"
    told = run(svg)
    assert told.edited == ["t"]
    assert get(svg, "t").attrib["transform"] == "translate(3,4)"


def test_a_copy_that_something_else_uses_stays() -> None:
    defs, body = BELONGING["shared gradient"]
    svg = load(defs + body + AROUND)
    push(svg, 40, 10)
    run(svg, "l")
    add(svg, '<rect id="n" x="300" width="5" height="5" fill="url(#g-1)"/>')
    push(svg, 0, 0)
    run(svg, "l")
    assert get(svg, "g-1").attrib["gradientTransform"]
    assert "url(#g)" in get(svg, "l").attrib["style"]


# --- what is stored, and how --------------------------------------------------------------------

NAMES = ["id", "d", "x", "transform", "fill", "clip-path", "opacity", f"{{{SODIPODI}}}type", "{urn:x}y"]
STYLES = [
    "fill:red",
    "fill:url(#g-1);stroke:#000",
    " stroke : #000 ;; fill:url( '#g' ) red",
    "",
    "a:b;c:d;fill:blue",
]
VALUES = st.sampled_from(["1", "2", "a \"b\" 'c'", "url(#g)", "url(#g-1)", "é\n\t", "M0,0"])


@st.composite
def states(draw: Any) -> State:
    names = draw(st.permutations(NAMES))[: draw(st.integers(0, len(NAMES)))]
    attributes = {name: draw(VALUES) for name in names}
    if draw(st.booleans()):
        place = draw(st.integers(0, len(names)))
        items = list(attributes.items())
        items.insert(place, ("style", draw(st.sampled_from(STYLES))))
        attributes = dict(items)
    return State(draw(st.sampled_from(["{http://www.w3.org/2000/svg}rect", "path"])), attributes)


@given(states(), states(), states())
@settings(deadline=None, max_examples=300)
def test_a_record_leads_back_to_the_letter(written: State, original: State, base: State) -> None:
    record = records.make(written, original, base, {3: [0.25, 0.5]})
    if record is None:
        assert written.same(original)
        assert written.same(base)
        return
    text = records.to_text(record)
    again = records.from_text(text)
    assert again is not None
    for one in (record, again):
        assert list(one.first(written).attributes.items()) == list(original.attributes.items())
        assert list(one.start(written).attributes.items()) == list(base.attributes.items())
        assert (one.first(written).tag, one.start(written).tag) == (original.tag, base.tag)
    assert again.cuts == {3: [0.25, 0.5]}


def test_a_record_keeps_what_a_person_chose_since() -> None:
    original = State("rect", {"x": "1", "fill": "url(#g)", "style": "stroke:url(#h);opacity:1"})
    written = State("path", {"fill": "url(#g-1)", "style": "stroke:url(#h-1);opacity:1", "d": "M0,0"})
    record = records.make(written, original, original, {})
    assert record is not None
    now = State(
        "path", {"style": 'opacity:0.5;stroke:url( "#h-1" )', "d": "M1,1", "fill": "blue", "new": "1"}
    )
    assert record.first(now).attributes == {
        "x": "1",
        "fill": "blue",
        "style": "opacity:0.5;stroke:url(#h)",
        "new": "1",
    }
    now = State("path", {"style": "opacity:0.5;stroke:green", "d": "M1,1", "fill": "url('#g-1')"})
    assert record.first(now).attributes == {"x": "1", "fill": "url(#g)", "style": "opacity:0.5;stroke:green"}


def digest_of(d: str, matrix: Any = None) -> digests.Digest:
    element = etree.fromstring(f'<path d="{d}"/>')
    found = digests.of_element(element, np.eye(3) if matrix is None else matrix)
    assert found is not None
    return found


def relative(d: str, digits: int) -> str:
    """The path as Inkscape may write it anew: relative, rounded."""
    words = []
    for subpath in pathdata.parse(d):
        at = subpath.start
        words.append("m " + ",".join(f"{x:.{digits}g}" for x in at))
        for segment in subpath.control:
            words.append(
                "c " + " ".join(",".join(f"{x:.{digits}g}" for x in p - segment[0]) for p in segment[1:])
            )
        words.append("z" if subpath.closed else "")
    return " ".join(words)


@given(
    st.lists(st.tuples(*[st.floats(-500, 500, width=32)] * 6), min_size=1, max_size=40), st.integers(0, 10**6)
)
@settings(deadline=None, max_examples=100)
def test_a_digest_knows_rounding_from_editing(curves: list[tuple[float, ...]], seed: int) -> None:
    d = "M1000,50 " + " ".join("C" + " ".join(repr(x) for x in curve) for curve in curves)
    stored = digests.Digest.read(str(digest_of(d)))
    assert stored is not None
    assert stored.still_drawn(etree.fromstring(f'<path d="{relative(d, 10)}"/>'))
    assert stored.still_drawn(etree.fromstring(f'<path d=" {d} "/>'))
    numbers = re.findall(r"-?[\d.e+-]+", d)
    which = seed % len(numbers)
    numbers[which] = repr(float(numbers[which]) + 0.05)
    edited = "M" + ",".join(numbers[:2]) + " C" + " ".join(numbers[2:])
    assert not stored.still_drawn(etree.fromstring(f'<path d="{edited}"/>'))


def test_a_digest_knows_where_it_was() -> None:
    d = "M10,10 h30 v20 z"
    stored = digests.Digest.read(str(digest_of(d, np.array([[2.0, 0, 5], [0.3, 1, -7], [0, 0, 1]]))))
    assert stored is not None
    matrix = np.array([[2.0, 0, 5], [0.3, 1, -7]])
    assert stored.still_there(matrix)
    assert stored.still_there(matrix + 1e-8)
    assert not stored.still_there(matrix + [[0, 0, 1e-2], [0, 0, 0]])
    assert not stored.still_there(matrix + [[1e-3, 0, 0], [0, 0, 0]])
    motion = np.array([[0, -1, 3], [1, 0, 8], [0, 0, 1.0]])
    assert stored.still_there((motion @ np.vstack([matrix, [0, 0, 1]]))[:2], motion)


def test_a_journal_goes_there_and_back() -> None:
    svg = load('<defs>\n  <a id="a" x="1" y="2"/>\n  <b id="b"/>\n</defs><g id="g"/>')
    before = text_of(svg)
    journal = Journal()
    first, second = get(svg, "a"), get(svg, "b")
    journal.put(first, State("{http://www.w3.org/2000/svg}path", {"y": "3", "id": "a"}))
    journal.insert_after(first, etree.fromstring('<c id="c"/>'))
    journal.remove(second)
    journal.insert_after(get(svg, "c"), etree.fromstring('<d id="d"/>'))
    journal.remove(get(svg, "c"))
    after = text_of(svg)
    assert after != before
    for _ in range(2):
        journal.toggle()
        assert text_of(svg) == before
        journal.toggle()
        assert text_of(svg) == after


# --- forgetting ------------------------------------------------------------------------------------


def test_forgetting_makes_what_is_there_the_original() -> None:
    defs, body = BELONGING["shared gradient"]
    svg = load(
        defs + body + AROUND + circle("from A", 50, 20, "f") + circle("to A", 50, 20, "t"), declared=True
    )
    push(svg, 40, 10)
    drag(svg, "t", 90, 30)
    run(svg, "l")
    before = drawn(svg)
    assert document.forget(svg, [svg]) == 1
    assert drawn(svg) == before
    assert not [
        name for e in svg.iter() for name in e.attrib if name.startswith(f"{{{ALUP}}}") and name != REST
    ]
    assert [float(x) for x in get(svg, "h0").get(REST).split()] == [60, 30]
    told = run(svg, "l")
    assert (told.changed, told.edited, told.from_original) == ([], [], [])
    with pytest.raises(DocumentError, match="stored original"):
        document.restore(svg, [])


def test_forgetting_one_of_two() -> None:
    svg = load(PAIR + pins((20, 20), (20, 80)) + handle(140, 80, at=(180, 100)))
    run(svg)
    before = drawn(svg)
    assert document.forget(svg, [get(svg, "l")]) == 1
    told = run(svg)
    assert told.edited == ["l"]
    assert told.changed == []
    assert drawn(svg) == before
