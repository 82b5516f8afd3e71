# SPDX-License-Identifier: GPL-2.0-or-later
"""Handles where guides cross the curves, on pages of any size and unit; guides that cross none."""

# The table is read more easily with one guide beside the other.
# ruff: noqa: E501

from __future__ import annotations

import numpy as np
import pytest
from lxml import etree
from placed import assert_placed, guide, load, place, with_guides

from alup.document.handles.guides import guides
from alup.messages.errors import AlupError


def test_guides_count_from_the_bottom_of_the_page() -> None:
    svg = load(with_guides(guide("0,60", "0,1"), guide("50,0", "1,0")), 'width="100" height="100"')
    place(svg, "guides")
    assert_placed(svg, [[20, 40], [80, 40], [50, 30], [50, 70]])


def test_a_slanted_guide() -> None:
    # Through (20, 30), rising to the right on the page: x + y = 50 in root units.
    svg = load(with_guides(guide("20,70", "-1,1")), 'width="100" height="100"')
    place(svg, "guides")
    assert_placed(svg, [[20, 30]])
    svg = load(with_guides(guide("50,50", "1,1")), 'width="100" height="100"')
    place(svg, "guides")  # falling to the right: y = x
    assert_placed(svg, [[30, 30], [70, 70]])


@pytest.mark.parametrize(
    "root",
    [
        'width="200mm" height="100mm" viewBox="0 0 200 100"',
        'width="400" height="200" viewBox="10 -20 200 100"',
        'viewBox="10 -20 200 100"',
        'width="100%" height="100%" viewBox="10 -20 200 100"',
    ],
)
def test_guides_are_in_units_of_the_view_box(root: str) -> None:
    x, y = (10, -20) if "10 -20" in root else (0, 0)
    svg = load(with_guides(guide(f"{50 - x},0", "1,0"), guide(f"0,{100 + y - 40}", "0,200")), root)
    place(svg, "guides")
    assert_placed(svg, [[50, 30], [50, 70], [20, 40], [80, 40]])


# Sides of a rectangle from (20, 30) to (60, 80), as the action object-to-guides of Inkscape 1.2.2 wrote them.
MADE_BY_INKSCAPE = {
    'width="210mm" height="297mm" viewBox="0 0 210 297"': [
        ("20,267", "188.97638,0"), ("20,217", "0,151.1811"), ("60,217", "-188.97638,0"), ("60,267", "0,-151.1811"),
    ],
    'width="400" height="300" viewBox="-50 20 200 150"': [
        ("70,140", "100,0"), ("70,90", "0,80"), ("110,90", "-100,0"), ("110,140", "0,-80"),
    ],
    'width="400" height="300" viewBox="10 -20 100 200"': [
        ("35,150", "75,0"), ("35,100", "0,60"), ("50,100", "-75,0"), ("50,150", "0,-60"),
    ],
    'width="400" height="300" viewBox="10 -20 100 200" preserveAspectRatio="none"': [
        ("10,150", "75,0"), ("10,100", "0,160"), ("50,100", "-75,0"), ("50,150", "0,-160"),
    ],
    'width="400" height="300" viewBox="10 -20 100 200" preserveAspectRatio="xMaxYMin slice"': [
        ("10,66.666667", "200,0"), ("10,-66.666667", "0,160"), ("50,-66.666667", "-200,0"), ("50,66.666667", "0,-160"),
    ],
}  # fmt: skip


@pytest.mark.parametrize(("root", "written"), MADE_BY_INKSCAPE.items())
def test_guides_that_inkscape_has_made_of_a_rectangle(root: str, written: list[tuple[str, str]]) -> None:
    lines = "".join(guide(*line) for line in written)
    found = guides(load(f"<sodipodi:namedview>{lines}</sodipodi:namedview>", root))
    corners = np.array([[20, 30], [60, 30], [60, 80], [20, 80]])
    for start, end in zip(corners, np.roll(corners, -1, axis=0)):
        away = [
            np.abs((np.stack([start, end]) - point) @ [-direction[1], direction[0]]).max()
            / np.hypot(*direction)
            for point, direction in found
        ]
        assert min(away) < 1e-4


def test_guides_on_a_page_of_other_proportions() -> None:
    # The drawing of 100 x 200 is in the middle of 400 x 300: scale 1.5, and 125 pixels at its left.
    svg = load(
        f"<sodipodi:namedview>{guide('35,0', '1,0')}</sodipodi:namedview>",
        'width="400" height="300" viewBox="10 -20 100 200"',
    )
    ((point, direction),) = guides(svg)
    assert point[0] == pytest.approx(10 + (35 * 4 - 125) / 1.5)
    assert direction[0] == 0.0
    svg.set("preserveAspectRatio", "none")
    assert guides(svg)[0][0][0] == pytest.approx(45.0)
    svg.set("preserveAspectRatio", "xMaxYMin slice")  # scale 4, the lower 500 of 800 pixels cut off
    assert guides(svg)[0][0] == pytest.approx([10 + 35 * 4 / 4.0, -20 + 300 / 4.0])
    svg.set("preserveAspectRatio", "xMaxYMin")
    assert guides(svg)[0][0] == pytest.approx([10 + (35 * 4 - 250) / 1.5, 180])


def test_crossings_of_near_guides_don_t_overlap() -> None:
    near = 1.5 * 0.0075 * np.hypot(60, 40)
    svg = load(with_guides(guide("50,0", "1,0"), guide(f"{50 + near},0", "1,0")), 'width="100" height="100"')
    place(svg, "guides")
    assert_placed(svg, [[50, 30], [50, 70]])


def test_guides_of_older_files() -> None:
    svg = load(with_guides(guide("60", "horizontal"), guide("50", "vertical")), 'width="100" height="100"')
    place(svg, "guides")
    assert_placed(svg, [[20, 40], [80, 40], [50, 30], [50, 70]])


@pytest.mark.parametrize(
    ("root", "line", "words"),
    [
        ("", ("0,60", "0,1"), ("page has no size", "Document Properties")),
        ('width="100"', ("0,60", "0,1"), ("page has no size",)),
        ('width="0" height="9" viewBox="0 0 9 9"', ("0,60", "0,1"), ("page has no size",)),
        ('height="100" viewBox="0 0 100"', ("0,60", "0,1"), ("viewBox", "0 0 100", "XML editor")),
        ('viewBox="0 0 0 100"', ("0,60", "0,1"), ("viewBox",)),
        ('viewBox="0 0 inf 100"', ("0,60", "0,1"), ("viewBox",)),
        ('viewBox="nan 0 9 100"', ("0,60", "0,1"), ("viewBox",)),
        ('viewBox="none"', ("0,60", "0,1"), ("viewBox",)),
        ('width="9" height="9"', ("0,60", "0,0"), ("orientation of the guide g", "Delete the guide")),
        ('width="9" height="9"', ("0", "0,1"), ("position of the guide g", "(0)")),
        ('width="9" height="9"', ("inf,0", "0,1"), ("position of the guide g",)),
        ('width="9" height="9"', ("one", "vertical"), ("position of the guide g", "(one)")),
    ],
)
def test_guides_that_cross_no_curve_are_refused(root: str, line: tuple[str, str], words: tuple[str]) -> None:
    svg = load(with_guides(guide(*line)), root)
    before = etree.tostring(svg)
    with pytest.raises(AlupError) as refused:
        place(svg, "guides")
    assert all(word in str(refused.value) for word in words)
    assert etree.tostring(svg) == before
