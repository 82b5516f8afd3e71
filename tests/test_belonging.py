# SPDX-License-Identifier: GPL-2.0-or-later
"""Paints, clips and the like of a shape start from their own originals in every run; edits of them are noticed."""

# XML is read more easily on one line.
# ruff: noqa: E501

from __future__ import annotations

import re

import numpy as np
import pytest
from belonging import (
    AROUND,
    BELONGING,
    CLIP,
    FILLED,
    GRADIENT,
    OTHER,
    SQUARE,
    clip_of,
    clip_shift,
    paint_shift,
    push,
    pushed,
)
from documents import INKSCAPE, get, text_of
from reruns import COPY, ORIGINAL, add, bounds, drawn, handle, load, pins, reloaded, run

from alup.document import restore_original


@pytest.mark.parametrize(("defs", "body"), BELONGING.values(), ids=BELONGING.keys())
def test_companions_of_shapes_start_from_their_originals(defs: str, body: str) -> None:
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
def test_one_of_two_shapes_that_were_reshaped_together(defs: str, body: str) -> None:
    """Their shared paint was changed in place.  The shape that is reshaped alone gets a copy of the original paint."""
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
    restore_original.restore(svg, [])
    assert not [e for e in svg.iter() if e.attrib.get(COPY)]
    for identity in "lo":
        np.testing.assert_allclose(paint_shift(svg, identity), (0, 0), atol=1e-9)


def test_a_live_effect_of_a_group_comes_back_when_all_in_it_is_back() -> None:
    effect = f"{{{INKSCAPE}}}path-effect"
    body = f'<g id="n" inkscape:path-effect="#e">{SQUARE.format("")}<path id="r" inkscape:original-d="M 0,0" d="M100,20 h30 v20 z"/></g>'
    svg = load(body + AROUND + pins((100, 20)) + handle(130, 40, "k", (140, 50)))
    push(svg, 10, 10)
    run(svg)
    assert effect not in get(svg, "n").attrib
    restore_original.restore(svg, [get(svg, "l")])
    assert effect not in get(svg, "n").attrib
    restore_original.restore(svg, [get(svg, "r")])
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


def test_a_copy_has_no_record_of_its_own() -> None:
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
    svg = pushed(which, "l")
    target = get(svg, re.search(r"#([^)]+)", get(svg, "l").attrib["clip-path"]).group(1))  # type: ignore[union-attr]
    target[0].attrib["d"] = "M40,40 h50 v20 z"
    told = run(svg, "l")
    assert len(told.edited) == 1
    assert target[0].attrib["d"] == "M40,40 h50 v20 z"


def test_an_edited_copy_of_a_gradient_is_noticed() -> None:
    svg = pushed("shared gradient", "l")
    target = get(svg, "g-1")
    target.attrib["x1"] = "30"
    told = run(svg, "l")
    assert told.edited == ["l"]
    assert get(svg, "g-1").attrib["x1"] == "30"


def test_the_ends_of_a_gradient_may_be_moved() -> None:
    svg = pushed("gradient")
    get(svg, "g").attrib["x1"] = "30"
    told = run(svg)
    assert told.edited == []
    assert get(svg, "g").attrib["x1"] == "30"
    np.testing.assert_allclose(paint_shift(svg, "l"), (40, 10), atol=1e-4)


def test_a_text_that_was_moved_is_noticed() -> None:
    svg = pushed("text")
    get(svg, "t").attrib["transform"] = "translate(3,4)"
    told = run(svg)
    assert told.edited == ["t"]
    assert get(svg, "t").attrib["transform"] == "translate(3,4)"


def test_a_copy_that_something_else_uses_stays() -> None:
    svg = pushed("shared gradient", "l")
    add(svg, '<rect id="n" x="300" width="5" height="5" fill="url(#g-1)"/>')
    push(svg, 0, 0)
    run(svg, "l")
    assert get(svg, "g-1").attrib["gradientTransform"]
    assert "url(#g)" in get(svg, "l").attrib["style"]
