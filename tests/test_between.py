# SPDX-License-Identifier: GPL-2.0-or-later
"""Edits between two runs are kept.  The next run starts from an outline that was edited."""

# XML is read more easily on one line.
# ruff: noqa: E501

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from builders import BLOB
from documents import get, text_of
from lxml import etree
from reruns import (
    LEFT,
    PAIR,
    PATH,
    PINS,
    RIGHT,
    add,
    away,
    control,
    drag,
    drawn,
    edit_node,
    handle,
    load,
    pins,
    reloaded,
    run,
    steps,
)

from alup.document import restore_original
from alup.messages.errors import DocumentError

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
    # The path counts as edited from now on, and later runs start from its present state.
    drag(svg, "h", 100, 95)
    told = run(svg)
    assert told.edited == []
    assert set(told.from_original) == {"l", "r"}
    assert np.abs(control(svg, "r") - edited).max() < 1e-6
    # The state of r before the edit is not stored.  So restoring everything is refused, but l alone can be restored.
    before = text_of(svg)
    with pytest.raises(DocumentError, match=r"^r: edited between two runs"):
        restore_original.restore(svg, [])
    assert text_of(svg) == before
    assert restore_original.restore(svg, [get(svg, "l")]) == ["l"]
    assert np.abs(control(svg, "r") - edited).max() < 1e-9
    assert get(svg, "l").tag.endswith("rect")
    assert get(svg, "l").get("width") == "60"


def test_ten_drags_equal_one_drag_after_an_edit_too() -> None:
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


def test_a_shape_drawn_afterwards_makes_a_new_base() -> None:
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


def test_a_shape_outside_the_first_run_does_not_count_as_drawn_since() -> None:
    svg = load(PAIR + '<rect id="apart" x="300" y="200" width="20" height="20"/>'
               '<rect id="hidden" style="display:none" x="300" y="200" width="20" height="20"/>'
               + pins((20, 20), (20, 80)) + handle(80, 80, at=(100, 95)))  # fmt: skip
    run(svg, "l r")
    get(svg, "hidden").attrib.pop("style")
    drag(svg, "h", 101, 96)
    assert run(svg, "l r").edited == []  # and the shapes outside it are still known
    assert run(svg, tandem=False).edited == []
    get(svg, "apart").attrib["x"] = "301"
    assert run(svg, tandem=False).edited == ["apart"]


def test_one_of_several_reshaped_shapes_can_be_reshaped_alone() -> None:
    """The handles of the other shapes rest on the originals of these.  They take no part."""
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


def test_a_duplicate_has_the_original_of_its_source() -> None:
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


def test_a_path_pasted_into_another_drawing_starts_from_its_present_state() -> None:
    svg = load(PATH + PINS + handle(150, 75, at=(175, 55)))
    run(svg)
    other = load('<path id="o" d="M100,100 h30"/>')
    for element in list(svg):
        other.append(element)
    before = drawn(other)
    told = run(other, "p o", tandem=False)
    assert told.edited == ["o"]
    assert drawn(other) == before
    assert len(restore_original.restore(other, [])) == 1
    assert get(other, "p").get("d") == BLOB


def test_a_new_base_is_made_of_the_whole_document() -> None:
    """It includes shapes that took no part in the run that made it, and their handles."""
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
    restore_original.restore(svg, [get(svg, "q")])
    assert get(svg, "q").attrib["d"] == "M200,20 h60 v60 h-60 z"
