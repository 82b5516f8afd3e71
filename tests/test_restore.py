# SPDX-License-Identifier: GPL-2.0-or-later
"""Restore original brings back to the letter whatever was reshaped."""

# XML is read more easily on one line.
# ruff: noqa: E501

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from belonging import AROUND, BELONGING, GRADIENT, SQUARE, paint_shift, push
from documents import ALUP, INKSCAPE, get, text_of
from lxml import etree
from reruns import (
    AT,
    CASES,
    COPY,
    LEFT,
    ORIGINAL,
    PAIR,
    REST,
    RIGHT,
    UNMOVED,
    WRITTEN,
    add,
    away,
    canonical,
    case,
    circle,
    control,
    drag,
    edit_node,
    handle,
    load,
    pins,
    reloaded,
    rewrite,
    run,
    without_handles,
)

from alup.document import restore_original
from alup.document.tree import elements, fingerprints, own_objects
from alup.messages.errors import DocumentError
from alup.svg import path_data

CORNERS = pins((20, 20), (20, 80))


@pytest.mark.parametrize("name", list(CASES))
@pytest.mark.parametrize("runs", [1, 2])
def test_real_clip_art_comes_back_to_the_last_byte(name: str, runs: int) -> None:
    svg, ids = case(name)
    before, whole = without_handles(svg), canonical(svg)
    for _ in range(runs):
        run(svg, ids)
        svg = reloaded(svg)
    assert without_handles(svg) != before
    names = restore_original.restore(svg, [])
    assert names
    assert without_handles(svg) == before
    # Handles stand where they began, a `to` with its `from`: now nothing is to move.
    assert run(svg, ids).changed == []
    assert without_handles(svg) == before
    assert len(canonical(svg)) == pytest.approx(len(whole), abs=600)


@pytest.mark.parametrize(("defs", "body"), BELONGING.values(), ids=BELONGING.keys())
@pytest.mark.parametrize("ids", ["", "l"])
def test_paints_clips_and_the_like_come_back(defs: str, body: str, ids: str) -> None:
    svg = load(defs + body + AROUND)
    before = without_handles(svg)
    push(svg, 40, 10, 2.0)
    assert run(svg, ids).changed
    svg = reloaded(svg)
    push(svg, 60, 20, 2.0)
    run(svg, ids)
    restore_original.restore(svg, [])
    # The declaration of our namespace goes once nothing needs it; the handles may.
    assert without_handles(svg) == before
    assert not [e for e in svg.iter() if {ORIGINAL, WRITTEN, COPY, AT, UNMOVED} & set(e.attrib)]


SHAPES = {
    "rect": '<rect id="s" class="c" x="20" y=" 20.0 " style="fill:#abc" width="60" rx="5" height="60px" transform="translate(0)" ry="4"/>',
    "circle": '<circle r="30" id="s" cy="50" cx="50"><title>T</title></circle>',
    "polygon": '<polygon points=" 20,20 80 20,80,80 20,80 " id="s"/>',
    "line": '<line id="s" x1="20" y1="20" x2="80" opacity="0.5" y2="80"/>',
    "arc path": '<path sodipodi:type="arc" d="M20,50 A30,30 0 1 1 80,50 A30,30 0 1 1 20,50 Z" sodipodi:cx="50" id="s" inkscape:connector-curvature="0"/>',
    "nodetypes": '<path sodipodi:nodetypes="ccccc" id="s" d="m 20,20 h 60 v 60 h -60 z"/>',
    "styled by a sheet": '<style>rect {fill:red} path {fill:blue; opacity:0.5}</style><rect style=" stroke : #000 ; " id="s" x="20" y="20" width="60" height="60"/>',
    "in a group": '<g transform="matrix(2,0.1,0,0.5,-10,7)"><rect id="s" x="20" y="20" width="60" height="60"/></g>',
}  # fmt: skip


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES.keys())
def test_every_kind_of_shape_comes_back_to_the_last_byte(shape: str) -> None:
    svg = load(f"<!-- c -->{shape}\n<g/>")
    before = text_of(svg)
    curve = control(svg, "s").reshape(-1, 2)
    for n, point in enumerate((curve[0], curve[len(curve) // 2])):
        x, y = (float(v) for v in point)
        add(svg, circle(f"from {n}", x, y) + circle(f"to {n}", x + 9 + 5 * n, y - 7))
    assert run(svg, "s", keep=False).changed
    assert text_of(svg) != before
    assert get(svg, "s").tag.endswith("path")
    assert len(restore_original.restore(svg, [get(svg, "s")])) == 1
    found = text_of(svg)
    assert found.replace(b' xmlns:alup="' + ALUP.encode() + b'"', b"") == before.replace(
        b' xmlns:alup="' + ALUP.encode() + b'"', b""
    )


def test_a_file_without_our_namespace_is_the_same_byte_for_byte() -> None:
    svg = load(LEFT + RIGHT, declared=False)
    before = text_of(svg)
    add(svg, pins((20, 20), (20, 80)) + circle("from a", 140, 80) + circle("to a", 170, 90))
    run(svg, keep=False)
    assert ALUP.encode() in text_of(svg)
    restore_original.restore(svg, [])
    assert text_of(svg) == before


def test_files_without_the_svg_namespace() -> None:
    body = f'<g><rect id="l" x="20" y="20" width="60" height="60"/></g>{pins((20, 20))}{circle("from a", 80, 80)}{circle("to a", 99, 90)}'
    svg = reloaded(etree.fromstring(f'<svg xmlns:inkscape="{INKSCAPE}" viewBox="0 0 400 300">{body}</svg>'))
    before = text_of(get(svg, "l"))
    run(svg, keep=False)
    svg = reloaded(svg)
    assert get(svg, "l").tag == "path"
    restore_original.restore(svg, [])
    assert text_of(get(svg, "l")) == before


# --- what is restored ----------------------------------------------------------------------------


@pytest.fixture
def two() -> Any:
    svg = load(PAIR + CORNERS + handle(80, 80, at=(100, 95)) + handle(140, 20, "k", (170, 10)))
    run(svg)
    return svg


def test_only_selected_objects_are_restored(two: Any) -> None:
    right = text_of(get(two, "r"))
    assert [name[0] for name in restore_original.restore(two, [get(two, "l")])] == ["l"]
    assert get(two, "l").tag.endswith("rect")
    assert text_of(get(two, "r")) == right
    # The handle on the shared side goes back with the first shape; the handle of the other one stays.
    assert [get(two, "h").get(n) for n in ("cx", "cy")] == ["80", "80"]
    assert [float(get(two, "k").get(n)) for n in ("cx", "cy")] == [170.0, 10.0]
    assert AT in get(two, "k").attrib
    assert restore_original.restore(two, [get(two, "h")]) == ["r"]
    assert not [e for e in two.iter() if ORIGINAL in e.attrib]


def test_a_selected_group_is_all_that_is_in_it() -> None:
    svg = load(f'<g id="g">{LEFT}</g>{RIGHT}{CORNERS}{handle(140, 80, at=(170, 90))}')
    run(svg)
    assert restore_original.restore(svg, [get(svg, "g"), get(svg, "l")]) == ["l"]
    assert get(svg, "l").tag.endswith("rect")
    assert ORIGINAL in get(svg, "r").attrib


def test_handles_go_back_and_the_next_run_moves_nothing() -> None:
    pair = circle("from A", 140, 20, identity="a") + circle("to A", 175, 5, identity="b")
    section = '<rect id="s" inkscape:label="alup:section" alup:rest="130 70 20 20" x="160" y="80" width="20" height="20" transform="rotate(5)"/>'
    svg = load(PAIR + CORNERS + handle(80, 80, at=(90, 85)) + pair + section)
    before = without_handles(svg)
    run(svg)
    restore_original.restore(svg, [])
    assert without_handles(svg) == before
    assert [float(get(svg, "h").get(n)) for n in ("cx", "cy")] == [80.0, 80.0]
    for identity in "ab":
        assert [float(get(svg, identity).get(n)) for n in ("cx", "cy")] == [140.0, 20.0]
    assert get(svg, "h").get(REST)
    assert not [e for e in svg.iter() if AT in e.attrib]
    assert REST not in get(svg, "a").attrib
    told = run(svg)
    assert (told.changed, told.edited) == ([], [])


def test_pins_in_groups_with_transforms_go_back_too() -> None:
    turned = f'<g transform="rotate(90) scale(2,-0.5)">{circle("from a", 10, 40, identity="f", r=0.2)}</g>'
    svg = load(
        f'<path id="p" d="M20,20 H80"/>{pins((80, 20))}{turned}{circle("to a", 30, 60, identity="t")}',
        declared=False,
    )
    before = without_handles(svg)
    run(svg)
    restore_original.restore(svg, [])
    assert without_handles(svg) == before
    assert [float(get(svg, "f").get(n)) for n in ("cx", "cy")] == [10.0, 40.0]


def test_after_edits_the_rest_comes_back_and_handles_are_on_curves(two: Any) -> None:
    edit_node(two, "r", 2)
    drag(two, "h", 105, 100)
    assert run(two).edited == ["r"]
    drag(two, "h", 110, 105)
    run(two)
    refused(two, "", "^r: edited between two runs")
    refused(two, "l r", r"^r: edited between two runs.* Select only the others, or only these\.$")
    for identity in "lr":
        restore_original.restore(two, [get(two, identity)])
    assert get(two, "l").get("width") == "60"
    for identity in ("h", "k"):
        at = [float(get(two, identity).get(n)) for n in ("cx", "cy")]
        assert min(away(two, "l", at), away(two, "r", at)) < 1e-4
    assert run(two).changed == []


def test_a_handle_whose_base_was_not_the_original_goes_to_the_nearest_curve() -> None:
    svg = load(PAIR + pins((20, 80), (140, 80)) + handle(20, 20, "h", (0, 0)))
    run(svg)
    edit_node(svg, "r", 1)
    assert run(svg).edited == ["r"]
    drag(svg, "h", -5, 0)
    run(svg)
    for identity in "rl":
        restore_original.restore(svg, [get(svg, identity)])
    assert [float(get(svg, "h").get(n)) for n in ("cx", "cy")] == [20.0, 20.0]
    assert [float(x) for x in get(svg, "h").get(REST).split()] == [20.0, 20.0]
    assert run(svg).changed == []


def test_an_edit_since_the_last_run_is_taken_back(two: Any) -> None:
    edit_node(two, "r")
    restore_original.restore(two, [])
    assert get(two, "r").get("d") == "M80,20 H140 V80 H80 Z"


def test_a_colour_that_a_person_chose_stays(two: Any) -> None:
    get(two, "l").attrib["style"] = "fill:#123456"
    restore_original.restore(two, [])
    assert dict(get(two, "l").attrib) == {
        "id": "l",
        "x": "20",
        "y": "20",
        "width": "60",
        "height": "60",
        "style": "fill:#123456",
    }


def test_a_gradient_that_something_new_uses_as_it_is_stays() -> None:
    defs, body = BELONGING["gradient"]
    svg = load(defs + body + AROUND)
    push(svg, 40, 10)
    run(svg)
    add(svg, '<rect id="n" x="60" y="30" width="60" height="60" fill="url(#g)"/>')
    restore_original.restore(svg, [])
    np.testing.assert_allclose(paint_shift(svg, "n"), (40, 10), atol=1e-4)
    np.testing.assert_allclose(paint_shift(svg, "l"), (0, 0), atol=1e-9)


def test_a_text_that_was_moved_since_moves_along() -> None:
    svg = load(
        SQUARE.format("")
        + '<text id="t" x="30" y="50" transform="scale(1)" style="font-size:10px">T</text>'
        + AROUND
    )
    push(svg, 40, 10)
    run(svg)
    get(svg, "t").attrib["transform"] = "translate(5,6) " + get(svg, "t").attrib["transform"]
    restore_original.restore(svg, [])
    np.testing.assert_allclose(elements.own_matrix(get(svg, "t"))[:2, 2], (5, 6), atol=1e-6)


def test_objects_only_moved_or_painted_since_keep_their_first_outline() -> None:
    defs, body = BELONGING["gradient"]
    svg = load(defs + body + RIGHT.replace("/>", ' transform="translate(90,0)"/>') + AROUND)
    first = text_of(get(svg, "r"))
    push(svg, 40, 10)
    run(svg)
    add(svg, "<defs>" + GRADIENT.replace('"g"', '"new"') + "</defs>")
    get(svg, "l").attrib["fill"] = "url(#new)"
    get(svg, "r").attrib["transform"] = "translate(95,3)"
    told = run(svg)
    assert set(told.edited) == {"l", "r"}
    push(svg, 50, 20)
    run(svg)
    restore_original.restore(svg, [])
    assert [get(svg, "l").attrib[name] for name in ("x", "y", "fill")] == ["20", "20", "url(#new)"]
    assert text_of(get(svg, "r")) == first.replace(b"(90,0)", b"(95,3)")


def test_an_edited_path_comes_back_with_the_paint_that_it_had_then() -> None:
    defs, body = BELONGING["gradient"]
    svg = load(
        defs
        + body.replace("<rect", '<path d="M20,20 H80 V80 H20 Z"').replace(
            'x="20" y="20" width="60" height="60"', ""
        )
        + AROUND
    )
    push(svg, 40, 10)
    run(svg)
    edit_node(svg, "l", 2)
    edited, paint = get(svg, "l").attrib["d"], get(svg, "g").attrib["gradientTransform"]
    for n, (x, y) in enumerate(control(svg, "l")[:, 0].tolist()):
        drag(svg, f"h{n}", x, y)
    add(svg, pins((60, 30)))
    for n in range(4):
        svg.remove(get(svg, f"h{n}"))
    add(svg, handle(125, 78, "k", (140, 80)))
    assert [name[0] for name in run(svg).edited] == ["l"]
    assert get(svg, "l").attrib["d"] != edited
    restore_original.restore(svg, [])
    assert get(svg, "l").attrib["d"] == edited
    assert get(svg, "g").attrib["gradientTransform"] == paint


# A closed path with a hundred segments whose rounding adds up, and one that a curve closes.
_ANGLES = np.linspace(0.0, 2.0 * np.pi, 101)[:-1]
ROUND = "M" + " L".join(
    f"{200.123 + 60.3 * x:.4f},{90.7 + 50.1 * y:.4f}" for x, y in zip(np.cos(_ANGLES), np.sin(_ANGLES))
)
WRITTEN_ANEW = f'<path id="l" d="{ROUND} Z"/><path id="r" d="M180.1,80.3 C190.7,60.2 210.3,61 220.9,80.7 C210.1,99.3 190.2,98.7 180.1,80.3 Z"/>'


def test_path_data_written_anew_in_a_turned_group_keeps_its_original() -> None:
    svg = load(f'<g id="g">{WRITTEN_ANEW}</g>' + dragged())
    first = {identity: get(svg, identity).attrib["d"] for identity in "lr"}
    assert len(run(svg).changed) == 2
    for identity in "lr":
        rewrite(svg, identity)
    get(svg, "g").attrib["transform"] = "rotate(30,120,80)"
    for element in [e for e in svg if "cx" in e.attrib]:
        element.attrib["transform"] = "rotate(30,120,80)"
    drag(svg, "h", 300, 97)
    told = run(svg)
    assert (told.edited, len(told.from_original)) == ([], 2)
    restore_original.restore(svg, [])
    assert {identity: get(svg, identity).attrib["d"] for identity in "lr"} == first


def shifted(svg: Any, identity: str, x: float, y: float) -> None:
    """As Inkscape writes it when a path is dragged or pasted: relative, rounded, with the shift in the data."""
    element = get(svg, identity)
    (subpath,) = path_data.parse(element.attrib["d"])
    words = [f"M {subpath.start[0] + x:.8g},{subpath.start[1] + y:.8g}"]
    for segment in subpath.control[:-1] if subpath.kind[-1] == path_data.CLOSE else subpath.control:
        points = segment[1:] + (x, y)
        words.append("C " + " ".join(f"{u:.8g},{v:.8g}" for u, v in points))
    element.attrib["d"] = " ".join([*words, "Z"] if subpath.closed else words)
    rewrite(svg, identity)


def dragged() -> str:
    """Handles of WRITTEN_ANEW."""
    return handle(260.423, 90.7, "h", (290, 95)) + pins((139.823, 90.7)) + handle(220.9, 80.7, "k", (235, 84))


def moved_together() -> Any:
    """Reshaped, then dragged by (40, 30) with its handles."""
    svg = load(f'<rect id="s" x="130" y="110" width="20" height="9"/>{WRITTEN_ANEW}' + dragged())
    assert len(run(svg).changed) == 3
    for identity in "slr":
        shifted(svg, identity, 40, 30)
    for pin in [e for e in svg if "cx" in e.attrib]:
        drag(svg, pin.attrib["id"], float(pin.attrib["cx"]) + 40, float(pin.attrib["cy"]) + 30)
    return svg


def test_a_move_that_inkscape_writes_into_the_data_is_one_of_the_whole_drawing() -> None:
    svg = moved_together()
    before = [control(svg, identity) for identity in "slr"]
    told = run(svg)
    assert (told.edited, len(told.from_original)) == ([], 3)
    for identity, was in zip("slr", before):
        now = elements.read_shape(get(svg, identity), elements.own_matrix(get(svg, identity))[:2]).control
        np.testing.assert_allclose(now, was, atol=1e-4)
    drag(svg, "h", 322, 127)
    told = run(svg)
    assert (told.edited, len(told.from_original)) == ([], 3)
    restore_original.restore(svg, [])
    for identity in "lr":
        path = get(svg, identity)
        np.testing.assert_allclose(elements.own_matrix(path)[:2], [[1, 0, 40], [0, 1, 30]], atol=1e-4)
        assert path.attrib["d"] in WRITTEN_ANEW
    assert get(svg, "s").attrib["width"] == "20"
    np.testing.assert_allclose(elements.own_matrix(get(svg, "s"))[:2, 2], (40, 30), atol=1e-5)


@pytest.mark.parametrize("runs", [0, 1, 2])
def test_pasted_and_moved_objects_come_back_at_their_new_place(runs: int) -> None:
    """Each shape was moved by itself, so the runs since then could not start from the originals."""
    svg = moved_together()
    shifted(svg, "l", -1, 0.5)
    for n in range(runs):
        if n:
            drag(svg, "h", 325, 131)
        assert bool(run(svg).edited) == (n == 0)
    restore_original.restore(svg, [])
    assert elements.local_tag(get(svg, "s")) == "rect"
    for identity, shift in {"l": (39, 30.5), "r": (40, 30), "s": (40, 30)}.items():
        assert get(svg, identity).attrib.get("d", "") in WRITTEN_ANEW
        moved = np.array([[1, 0, shift[0]], [0, 1, shift[1]]])
        assert elements.own_matrix(get(svg, identity))[:2] == pytest.approx(moved, abs=1e-4)


@pytest.mark.parametrize("known", [True, False])
def test_a_gradient_that_was_copied_and_moved_with_a_path(known: bool) -> None:
    """Inkscape gives a duplicate its own gradient, which refers to the first one and includes the move."""
    svg = load(
        f'<defs><linearGradient id="g" gradientUnits="userSpaceOnUse" x1="140" x2="260"/></defs>'
        f'<path id="l" fill="url(#g)" d="{ROUND} Z"/>'
        + handle(260.423, 90.7, "h", (290, 95))
        + pins((139.823, 90.7))
    )
    run(svg)
    wide = elements.own_matrix(get(svg, "g"), "gradientTransform")
    assert wide[0, 0] > 1.1
    moved = np.array([[1, 0, 37.0], [0, 1, 120], [0, 0, 1]]) @ (wide if known else np.diag([2.0, 2.0, 1.0]))
    copied = etree.tostring(get(svg, "l")).decode().replace('id="l"', 'id="m"').replace("url(#g)", "url(#n)")
    add(
        svg,
        f'<defs><linearGradient id="n" xlink:href="#g" gradientUnits="userSpaceOnUse" gradientTransform="'
        f'{elements.transform_text(moved)}"/></defs>{copied}',
    )
    shifted(svg, "m", 37, 120)
    restore_original.restore(svg, [])
    np.testing.assert_allclose(elements.own_matrix(get(svg, "m"))[:2], [[1, 0, 37], [0, 1, 120]], atol=1e-4)
    left = np.eye(3) if known else np.diag([2.0, 2.0, 1.0])
    np.testing.assert_allclose(elements.own_matrix(get(svg, "n"), "gradientTransform"), left, atol=1e-3)
    assert ("gradientTransform" in get(svg, "n").attrib) != known


def test_a_later_transform_moves_the_original_too() -> None:
    svg = moved_together()
    shifted(svg, "l", -1, 0.5)
    assert run(svg).edited
    drag(svg, "h", 325, 131)
    run(svg)
    get(svg, "l").attrib["transform"] = "rotate(90)"
    restore_original.restore(svg, [])
    turned = np.array([[0, -1, -30.5], [1, 0, 39]])
    assert elements.own_matrix(get(svg, "l"))[:2] == pytest.approx(turned, abs=1e-4)


def test_a_duplicate_is_restored_in_full() -> None:
    svg = load(f'<g id="g">{WRITTEN_ANEW}</g>' + dragged())
    first = [get(svg, identity).attrib["d"] for identity in "lr"]
    run(svg)
    twin = etree.fromstring(etree.tostring(get(svg, "g")).replace(b'id="', b'id="2'))
    add(svg, etree.tostring(twin).decode())
    get(svg, "2g").attrib["transform"] = "translate(0,150)"
    for identity in ("2l", "2r"):
        rewrite(svg, identity)
    for pin in [e for e in svg if "cx" in e.attrib]:
        drag(svg, pin.attrib["id"], float(pin.attrib["cx"]), float(pin.attrib["cy"]) + 150)
    drag(svg, "h", 300, 240)
    assert run(svg, "2g").changed
    restore_original.restore(svg, [])
    for identities in ("lr", ("2l", "2r")):
        assert [get(svg, identity).attrib["d"] for identity in identities] == first


def test_a_clip_path_without_its_original_is_kept_and_told() -> None:
    """A paste into another drawing takes the clip path that a run made along, but not its original."""
    clip = '<clipPath id="k"><path d="M10,10 H90 V90 H10 Z"/></clipPath>'
    svg = load(
        f'<defs>{clip}</defs><path id="l" clip-path="url(#k)" d="M20,20 H80 V80 H20 Z"/><path id="o" clip-path="url(#k)" d="M300,20 H380 V80 H320 Z"/>{AROUND}'
    )
    push(svg, 40, 10)
    run(svg, "l")
    cut = get(svg, "l")
    made = (
        cut.attrib["style"].split("#")[1].split(")")[0]
        if "style" in cut.attrib
        else cut.attrib["clip-path"][5:-1]
    )
    assert made != "k"
    other = load(etree.tostring(get(svg, made)).decode() + etree.tostring(cut).decode())
    assert restore_original.restore(other, []) == ["l"]
    assert get(other, "l").attrib["d"] == "M20,20 H80 V80 H20 Z"
    assert made in etree.tostring(get(other, "l")).decode()
    (group,) = own_objects.groups(other, own_objects.NOTES_LABEL)
    assert "".join(group[0].itertext()).startswith(
        "l: what cut or painted it at first is not in this drawing"
    )


# --- refusals ------------------------------------------------------------------------------------


def refused(svg: Any, ids: str, words: str) -> None:
    before = text_of(svg)
    with pytest.raises(DocumentError, match=words) as caught:
        restore_original.restore(svg, [get(svg, identity) for identity in ids.split()])
    assert text_of(svg) == before
    assert "\n" not in str(caught.value)


def test_where_there_is_nothing_to_restore(two: Any) -> None:
    add(two, '<rect id="n" width="5" height="5"/>')
    refused(two, "n", "None of the selected objects has a stored original")
    restore_original.restore(two, [])
    refused(two, "", "None of the objects of this drawing has a stored original")
    refused(two, "h", "of this drawing")


def test_all_or_none_where_the_marks_of_edits_are_missing(two: Any) -> None:
    """Files of older versions have no marks of edits.  A known shape without an original was edited."""
    edit_node(two, "r", 2)
    assert run(two).edited == ["r"]
    drag(two, "h", 110, 105)
    run(two)
    for element in two.iter():
        element.attrib.pop(elements.EDITED, None)
        if WRITTEN in element.attrib:
            element.attrib[WRITTEN] = " ".join(element.attrib[WRITTEN].split()[:12])
    right = get(two, "r")
    del right.attrib[ORIGINAL], right.attrib[WRITTEN]
    two.attrib[UNMOVED] += fingerprints.code(right, np.eye(3))
    refused(two, "", r"^r: edited between two runs.* Select only the others\.$")
    refused(two, "r", "None of the selected objects has a stored original")
    assert restore_original.restore(two, [get(two, "l")]) == ["l"]


def test_nothing_of_ours_is_left_where_all_is_back(two: Any) -> None:
    edit_node(two, "r", 2)
    run(two)
    drag(two, "h", 110, 105)
    run(two)
    assert get(two, "r").attrib[elements.EDITED] == "1"
    for identity in "lr":
        restore_original.restore(two, [get(two, identity)])
    assert not any(ALUP in name for e in two.iter() if "cx" not in e.attrib for name in e.attrib)


def test_a_damaged_record_is_named(two: Any) -> None:
    get(two, "r").attrib[ORIGINAL] = "{"
    refused(two, "", "original of r can't be read.*alup:original")
    assert restore_original.restore(two, [get(two, "l")]) == ["l"]


def test_an_error_leaves_the_document_to_the_letter(two: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    from alup.document import restore_original

    def fail(*_: Any, **__: Any) -> Any:
        raise ZeroDivisionError

    for name in ("_put_handles_back", "_note", "move_to"):
        with monkeypatch.context() as patch:
            patch.setattr(restore_original, name, fail)
            before = text_of(two)
            with pytest.raises(ZeroDivisionError):
                restore_original.restore(two, [])
            assert text_of(two) == before
