# SPDX-License-Identifier: GPL-2.0-or-later
"""A page shows everything visible of a drawing, and nothing that runs or loads."""

from __future__ import annotations

import re
from typing import Any

import hostile
import pytest
from lxml import etree

from alup.document.tree import loading, shown
from alup.document.tree.elements import SODIPODI_NS, SVG_NS

TRAP = "http://127.0.0.1:9/"
BOX = (0.0, 0.0, 100.0, 100.0)


def parsed(data: bytes) -> Any:
    return loading.parse(data).getroot()


def svg(body: str, root: str = "") -> Any:
    return parsed((hostile.ROOT.format(root=root) + body + "</svg>").encode())


def shows(root: Any, curves: Any = (), lit: Any = None) -> shown.Shown:
    keys = {element: n for n, element in enumerate(root.iter()) if isinstance(element.tag, str)}
    return shown.show(root, keys, BOX, set(curves), lit)


@pytest.mark.parametrize("way", hostile.WAYS)
def test_nothing_hostile_reaches_the_page(way: str) -> None:
    root = parsed(hostile.drawing(way, TRAP))
    before = etree.tostring(root)
    page = shows(root)
    text = page.text()
    assert TRAP not in text and "ran" not in text.replace("transform", "")
    assert "javascript" not in text and "@" not in text and "svg+xml" not in text
    assert "\\" not in text and ":host" not in text
    for element in page.root.iter():
        assert etree.QName(element).namespace == SVG_NS
        assert etree.QName(element).localname in {*shown.ELEMENTS, "style"}
        for name, value in element.attrib.items():
            assert not name.startswith("on")
            if name.endswith("href"):
                assert re.match(r"#\S+$", value)
            assert "url(" not in value.replace("url(#", "")
    assert page.root.find(f"{{{SVG_NS}}}path") is not None
    # The document has all of it.
    assert etree.tostring(root) == before


def test_visible_elements_are_shown() -> None:
    body = (
        "<style>.a { fill: url(#g); stroke-width: 2 } path > title { fill: red }</style>"
        '<defs><linearGradient id="g"><stop offset="0" style="stop-color:#f00"/></linearGradient>'
        '<clipPath id="c"><circle r="5"/></clipPath></defs>'
        '<g id="g1" transform="translate(3)" style="opacity:.5;-inkscape-font-specification:x">'
        '<path id="p" class="a" d="M0,0 H9" clip-path="url(#c)" style="filter:blur(2px);fill:url( \'#g\' )"/>'
        '<text x="1" y="2" xml:space="preserve">one <tspan font-weight="bold">two</tspan> three</text>'
        '<image href="data:image/png;base64,AAAA" width="4" height="5"/><use xlink:href="#p" x="3"/></g>'
    )
    text = shows(svg(body)).text()
    for part in (
        ".a {fill:url(#g);stroke-width:2}",
        'stop-color:#f00"',
        'transform="translate(3)"',
        'style="opacity:.5"',
        'clip-path="url(#c)"',
        "filter:blur(2px);fill:url( '#g' )",
        'href="data:image/png;base64,AAAA"',
        'xlink:href="#p"',
    ):
        assert part in text, part
    words = re.sub(r' data-k="\d+"', "", text)
    assert '>one <tspan font-weight="bold">two</tspan> three</text>' in words


def test_shapes_that_become_paths_are_shown_as_such() -> None:
    root = svg('<style>rect { fill: red }</style><rect id="r" x="1" y="2" width="3" height="4"/>')
    (rect,) = root.iter("{*}rect")
    (path,) = shows(root, curves=[rect]).root.iter("{*}path")
    assert path.get("d") and path.get("style") == "fill:red"
    assert path.get("id") == "r"


def test_unselected_elements_are_dimmed() -> None:
    root = svg('<g id="a"><path id="b" d="M0,0 H9"/><path id="c" d="M0,0 H9"/></g><g id="d"><path/></g>')
    lit = [element for element in root.iter("{*}path") if element.get("id") == "b"]
    page = shows(root, lit=lit)
    dim = {element.get("id") for element in page.root.iter() if shown.DIM in element.attrib}
    assert dim == {"c", "d"}


def test_handles_are_not_shown() -> None:
    layer, pin = '<g inkscape:label="ALUP handles">', '<circle r="2" inkscape:label="alup:pin"/>'
    root = svg(f'{layer}{pin}</g>{layer}{pin}<rect id="mine"/></g>')
    assert [etree.QName(e).localname for e in shows(root).root.iter()] == ["svg", "g", "rect"]


def test_clones_of_clones_do_not_multiply() -> None:
    body = '<path id="c0" d="M0,0 H9"/>' + "".join(
        f'<g id="c{n}">' + f'<use href="#c{n - 1}"/>' * 10 + "</g>" for n in range(1, 9)
    )
    page = shows(svg(body))
    assert sum("href" in element.attrib for element in page.root.iter()) < 60
    few = shows(svg('<path id="c0" d="M0,0 H9"/><use href="#c0"/><use id="self" href="#self"/>'))
    assert sum("href" in element.attrib for element in few.root.iter()) == 2


def test_changes_are_attributes_or_all() -> None:
    one = svg('<path id="p" d="M0,0 H9"/><path id="q" d="M0,0 H9"/>')
    before = shows(one)
    one[1].set("d", "M0,0 H5")
    after = shows(one)
    assert shown.changes(before, after) == {2: {"d": "M0,0 H5"}}
    assert before.set(2, "d", "M0,0 H5") and not before.set(2, "d", "M0,0 H5")
    assert shown.changes(before, after) == {}
    etree.SubElement(one, f"{{{SVG_NS}}}path")
    assert shown.changes(before, shows(one)) is None


def test_the_pages_colour_is_a_colour() -> None:
    def of(colour: str) -> Any:
        return shown.page_colour(svg(f'<s:namedview xmlns:s="{SODIPODI_NS}" pagecolor="{colour}"/>'))

    assert of("#123aBC") == "#123aBC"
    assert of("url(http://x)") is None
