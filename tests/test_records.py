# SPDX-License-Identifier: GPL-2.0-or-later
"""Records restore the original to the letter, tell rounding from editing, and can be forgotten."""

# XML is read more easily on one line.
# ruff: noqa: E501

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from belonging import AROUND, BELONGING, push
from documents import ALUP, SODIPODI, get, text_of
from hypothesis import given, settings
from hypothesis import strategies as st
from lxml import etree
from reruns import (
    AT,
    CASES,
    ORIGINAL,
    PAIR,
    PATH,
    PINS,
    REST,
    WRITTEN,
    case,
    circle,
    drag,
    drawn,
    handle,
    load,
    pins,
    run,
)

from alup.document import restore_original
from alup.document.history import stored_records
from alup.document.tree import fingerprints
from alup.document.tree.undo_log import State, UndoLog
from alup.messages.errors import DocumentError
from alup.svg import path_data

# --- in the file ---------------------------------------------------------------------------------


def test_handles_remember_and_are_in_the_file_as_they_were_given() -> None:
    svg = load(PATH + PINS + circle("handle", 175, 55, identity="h", more='alup:rest=" 150,75.0 "'))
    run(svg)
    assert get(svg, "h").get(REST) == " 150,75.0 "
    assert [float(x) for x in get(svg, "h").get(AT).split()] == [175, 55]
    pin = get(svg, "pin10_80")
    assert [float(x) for x in pin.get(REST).split()] == [float(x) for x in pin.get(AT).split()] == [10, 80]


def test_nothing_moved_stores_nothing() -> None:
    svg = load(PATH + PINS + circle("handle", 150, 75, identity="h"))
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


# --- records, digests, the journal ---------------------------------------------------------------

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
    record = stored_records.make(written, original, base, {3: [0.25, 0.5]})
    if record is None:
        assert written.same(original)
        assert written.same(base)
        return
    text = stored_records.to_text(record)
    again = stored_records.from_text(text)
    assert again is not None
    for one in (record, again):
        assert list(one.first(written).attributes.items()) == list(original.attributes.items())
        assert list(one.start(written).attributes.items()) == list(base.attributes.items())
        assert (one.first(written).tag, one.start(written).tag) == (original.tag, base.tag)
    assert again.cuts == {3: [0.25, 0.5]}


def test_a_record_keeps_later_choices_of_a_person() -> None:
    original = State("rect", {"x": "1", "fill": "url(#g)", "style": "stroke:url(#h);opacity:1"})
    written = State("path", {"fill": "url(#g-1)", "style": "stroke:url(#h-1);opacity:1", "d": "M0,0"})
    record = stored_records.make(written, original, original, {})
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


def digest_of(d: str, matrix: Any = None) -> fingerprints.Digest:
    element = etree.fromstring(f'<path d="{d}"/>')
    found = fingerprints.of_element(element, np.eye(3) if matrix is None else matrix)
    assert found is not None
    return found


def relative(d: str, digits: int) -> str:
    """The path as Inkscape may write it anew: relative, rounded."""
    words = []
    for subpath in path_data.parse(d):
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
def test_a_digest_tells_rounding_from_editing(curves: list[tuple[float, ...]], seed: int) -> None:
    d = "M1000,50 " + " ".join("C" + " ".join(repr(x) for x in curve) for curve in curves)
    stored = fingerprints.Digest.read(str(digest_of(d)))
    assert stored is not None
    assert stored.still_drawn(etree.fromstring(f'<path d="{relative(d, 10)}"/>'))
    assert stored.still_drawn(etree.fromstring(f'<path d=" {d} "/>'))
    numbers = re.findall(r"-?[\d.e+-]+", d)
    which = seed % len(numbers)
    numbers[which] = repr(float(numbers[which]) + 0.05)
    edited = "M" + ",".join(numbers[:2]) + " C" + " ".join(numbers[2:])
    assert not stored.still_drawn(etree.fromstring(f'<path d="{edited}"/>'))


@pytest.mark.parametrize("end", ["300.1,100.2 Z", "300.1,100.2 L300.1,100.2 Z", "300.100004,100.199996 Z"])
def test_a_digest_leaves_out_the_closing_line(end: str) -> None:
    """Rounding may add up to a gap of 4e-6, which z closes with a line.  A whole side may be left to z, too."""
    stored = digest_of("M300.1,100.2 C310,80 400,90 410,100 C400,130 330,140 300.1,100.2 Z")
    assert stored.still_drawn(
        etree.fromstring(f'<path d="M300.1,100.2 C310,80 400,90 410,100 C400,130 330,140 {end}"/>')
    )
    other = '<path d="M300.1,100.2 C310,80 400,90 410,100 C400,130 330,140 300.1,100.3 Z"/>'
    assert not stored.still_drawn(etree.fromstring(other))
    triangle = digest_of("M10,10 L90,10 L50,80 Z")
    assert triangle.still_drawn(etree.fromstring('<path d="M10,10 L90,10 L50,80 L10,10 Z"/>'))
    assert not triangle.still_drawn(etree.fromstring('<path d="M10,10 L90,10 L50,80"/>'))


MOVES: dict[str, list[list[float]]] = {
    "shifted": [[1, 0, 37.5], [0, 1, -20]],
    "turned": [[0.8, -0.6, 3], [0.6, 0.8, 8]],
    "halved": [[0.5, 0, 100], [0, 0.5, 3]],
    "mirrored": [[-1, 0, 300], [0, 1, 0]],
    "turned over": [[0.6, 0.8, 0], [0.8, -0.6, 40]],
}
TWO_PARTS = "M10,10 C20,0 40,5 50,30 L30,70 Z M20,20 L30,25 L22,31 Z"


@pytest.mark.parametrize("name", MOVES)
def test_a_digest_finds_the_move_that_was_written_into_the_data(name: str) -> None:
    move = np.vstack([MOVES[name], [0, 0, 1]])
    stored = fingerprints.Digest.read(str(digest_of(TWO_PARTS)))
    assert stored is not None
    words = []
    for subpath in path_data.parse(TWO_PARTS):
        points = subpath.control.reshape(-1, 2) @ move[:2, :2].T + move[:2, 2]
        points = points.reshape(-1, 4, 2)
        words.append("M" + " ".join(f"{v:.8g}" for v in points[0, 0]))
        words += ["C" + " ".join(f"{v:.8g}" for v in curve[1:].ravel()) for curve in points[:-1]] + ["Z"]
    found = stored.move_in(etree.fromstring(f'<path d="{" ".join(words)}"/>'))
    assert found is not None
    assert np.abs(found - move).max() < 1e-5


@pytest.mark.parametrize("d", [
    "M10,10 C20,0 40,5 50,30 L30,75 Z M20,20 L30,25 L22,31 Z",  # a node
    "M10,10 C20,0 40,5 50,30 L30,70 Z M21,20 L31,25 L23,31 Z",  # one part
    "M10,20 C20,0 40,10 50,60 L30,140 Z M20,40 L30,50 L22,62 Z",  # one axis
    "M10,10 C20,0 40,5 50,30 L30,70 Z M20,20 L30,25 L22,31",  # opened
    "M20,20 L30,25 L22,31 Z M10,10 C20,0 40,5 50,30 L30,70 Z",  # another order
])  # fmt: skip
def test_a_digest_takes_no_edit_for_a_move(d: str) -> None:
    assert digest_of(TWO_PARTS).move_in(etree.fromstring(f'<path d="{d}"/>')) is None


def test_a_dragged_end_of_a_line_is_no_turn() -> None:
    line = digest_of("M10,10 L90,10")
    assert line.move_in(etree.fromstring('<path d="M10,10 L90,60"/>')) is None
    found = line.move_in(etree.fromstring('<path d="M15,12 L95,12"/>'))
    assert found is not None
    assert np.abs(found - [[1, 0, 5], [0, 1, 2], [0, 0, 1]]).max() < 1e-9


def test_a_digest_knows_where_it_was() -> None:
    d = "M10,10 h30 v20 z"
    stored = fingerprints.Digest.read(str(digest_of(d, np.array([[2.0, 0, 5], [0.3, 1, -7], [0, 0, 1]]))))
    assert stored is not None
    matrix = np.array([[2.0, 0, 5], [0.3, 1, -7]])
    assert stored.still_there(matrix)
    assert stored.still_there(matrix + 1e-8)
    assert not stored.still_there(matrix + [[0, 0, 1e-2], [0, 0, 0]])
    assert not stored.still_there(matrix + [[1e-3, 0, 0], [0, 0, 0]])
    motion = np.array([[0, -1, 3], [1, 0, 8], [0, 0, 1.0]])
    assert stored.still_there((motion @ np.vstack([matrix, [0, 0, 1]]))[:2], motion)


def test_a_journal_undoes_and_redoes() -> None:
    svg = load('<defs>\n  <a id="a" x="1" y="2"/>\n  <b id="b"/>\n</defs><g id="g"/>')
    before = text_of(svg)
    undo_log = UndoLog()
    first, second = get(svg, "a"), get(svg, "b")
    undo_log.put(first, State("{http://www.w3.org/2000/svg}path", {"y": "3", "id": "a"}))
    undo_log.insert_after(first, etree.fromstring('<c id="c"/>'))
    undo_log.remove(second)
    undo_log.insert_after(get(svg, "c"), etree.fromstring('<d id="d"/>'))
    undo_log.remove(get(svg, "c"))
    after = text_of(svg)
    assert after != before
    for _ in range(2):
        undo_log.toggle()
        assert text_of(svg) == before
        undo_log.toggle()
        assert text_of(svg) == after


# --- damaged records -----------------------------------------------------------------------------


def test_a_path_that_lost_its_record_starts_from_its_present_state() -> None:
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
def test_a_damaged_record_is_ignored_and_told(text: str) -> None:
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


# --- forgetting ------------------------------------------------------------------------------------


def test_forgetting_makes_the_present_state_the_original() -> None:
    defs, body = BELONGING["shared gradient"]
    svg = load(
        defs + body + AROUND + circle("from A", 50, 20, identity="f") + circle("to A", 50, 20, identity="t"),
        declared=True,
    )
    push(svg, 40, 10)
    drag(svg, "t", 90, 30)
    run(svg, "l")
    before = drawn(svg)
    assert restore_original.forget(svg, [svg]) == 1
    assert drawn(svg) == before
    assert not [
        name for e in svg.iter() for name in e.attrib if name.startswith(f"{{{ALUP}}}") and name != REST
    ]
    assert [float(x) for x in get(svg, "h0").get(REST).split()] == [60, 30]
    told = run(svg, "l")
    assert (told.changed, told.edited, told.from_original) == ([], [], [])
    with pytest.raises(DocumentError, match="stored original"):
        restore_original.restore(svg, [])


def test_forgetting_one_of_two() -> None:
    svg = load(PAIR + pins((20, 20), (20, 80)) + handle(140, 80, at=(180, 100)))
    run(svg)
    before = drawn(svg)
    assert restore_original.forget(svg, [get(svg, "l")]) == 1
    told = run(svg)
    assert told.edited == ["l"]
    assert told.changed == []
    assert drawn(svg) == before
