# SPDX-License-Identifier: GPL-2.0-or-later
"""Style attributes and sheets: where a declaration ends; what is not changed keeps every letter."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from alup.document.history.stored_records import properties
from alup.document.tree import css

IMAGE = "url(data:image/png;base64,iVBORw0KGgo=)"
SPACED = IMAGE.replace("(", "( ")


@pytest.mark.parametrize(
    ("style", "wanted"),
    [
        ("fill:red;stroke:blue", {"fill": "red", "stroke": "blue"}),
        (f"fill:{IMAGE};stroke:blue", {"fill": IMAGE, "stroke": "blue"}),
        (
            f"fill:{IMAGE.replace('(', '( ')} ; stroke : blue ;",
            {"fill": IMAGE.replace("(", "( "), "stroke": "blue"},
        ),
        (
            "font:'A; B';fill:red",
            {"font": "'A; B'", "fill": "red"},
        ),
        ('font-family:"a\\";b";fill:red', {"font-family": '"a\\";b"', "fill": "red"}),
        ("fill:red/*;stroke:x*/;stroke:blue", {"fill": "red", "stroke": "blue"}),
        ("/* fill:x; */fill:red", {"fill": "red"}),
        ("--a:{b:c;d:e};fill:red", {"--a": "{b:c;d:e}", "fill": "red"}),
        ("fill:red;fill:blue", {"fill": "blue"}),
        ("FILL:red ! important;stroke:blue!x", {"fill": "red", "stroke": "blue"}),
        ("fill:;:red;;stroke", {}),
        ("fill:'red;stroke:blue", {"fill": "'red;stroke:blue"}),
        ("marker:url(#a;b;fill:red", {"marker": "url(#a;b;fill:red"}),
        ("", {}),
    ],
)
def test_declarations(style: str, wanted: dict[str, str]) -> None:
    assert {name: value for name, (value, _) in css.declarations(style).items()} == wanted


def test_important() -> None:
    assert css.declarations("fill:red ! IMPORTANT;content:'!important'") == {
        "fill": ("red", True),
        "content": ("'!important'", False),
    }


def test_a_brace_in_a_string_ends_no_rule() -> None:
    sheet = 'text { content: "}"; fill: red } rect { fill: blue; filter: url(a;b) } @media x { a { b: c } }'
    assert [(selectors, list(of)) for selectors, of in css.rules(sheet)] == [
        ("text", ["content", "fill"]),
        ("rect", ["fill", "filter"]),
    ]


def test_a_property_is_set_and_taken_out_in_its_place() -> None:
    style = f" fill : {IMAGE} ;stroke:blue;"
    assert css.with_property(style, "fill", "red") == " fill : red;stroke:blue;"
    assert css.with_property(style, "stroke", "red") == f" fill : {IMAGE} ;stroke:red;"
    assert css.with_property(style, "opacity", "1") == f"{style}opacity:1"
    assert css.with_property("fill:red", "opacity", "1") == "fill:red;opacity:1"
    assert css.with_property(None, "opacity", "1") == "opacity:1"
    assert css.without_property(style, "stroke") == f" fill : {IMAGE} ;"
    assert css.without_property(style, "fill") == "stroke:blue;"
    assert css.without_property("fill:red", "fill") is None


def test_stored_declarations_are_to_the_letter() -> None:
    assert properties(f"fill:{IMAGE};stroke: Blue") == {"fill": IMAGE, "stroke": "Blue"}


@given(st.text(st.sampled_from("ab:; \"'()[]{}/*!\\\n<->#"), max_size=40))
def test_parts_are_the_text(style: str) -> None:
    assert ";".join(css.parts(style)) == style


@given(
    st.lists(
        st.tuples(st.from_regex("[a-z]+", fullmatch=True), st.from_regex("[a-z0-9.# ,]+", fullmatch=True))
    )
)
def test_plain_styles_are_split_at_semicolons(pairs: list[tuple[str, str]]) -> None:
    """Splitting at semicolons and the tokeniser give the same."""
    style = ";".join(f"{name}:{value}" for name, value in pairs)
    assert css.parts(style + "/**/") == tuple((style + "/**/").split(";"))
    assert css.parts(style) == tuple(style.split(";"))
