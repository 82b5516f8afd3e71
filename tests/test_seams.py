# SPDX-License-Identifier: GPL-2.0-or-later
"""What touches its own mirrored clone stays on the axis."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_effect import HEAD, circle

import alup_reshape
from alup.document import mirror_seams, reading, writing
from alup.document.tree import elements, loading
from alup.session import pipeline

VASE = "M100 20H70C70 50 60 60 50 80C40 100 45 150 60 160H100"
HALF = f'<g id="half"><path id="side" d="{VASE}"/><path id="belt" d="M100 90H56.5L56 105H100z"/></g>'
PINS = circle("pin", 100, 20) + circle("pin", 70, 20)


def pair(name: str, start: tuple[float, float], end: tuple[float, float]) -> str:
    return circle(f"from {name}", *start) + circle(f"to {name}", *end)


LONGER = PINS + pair("a", (60, 160), (60, 190)) + pair("b", (100, 160), (100, 190))
MIRRORED = '<use id="m" xlink:href="#half" transform="matrix(-1 0 0 1 200 0)"/>'


def reshaped(body: str, tmp_path: Path) -> tuple[Any, dict[str, Any]]:
    before, after, report = (tmp_path / name for name in ("in.svg", "out.svg", "report.json"))
    before.write_text(HEAD + body + "</svg>")
    alup_reshape.AlupReshape().run([f"--output={after}", f"--report={report}", str(before)])
    return loading.parse(after.read_bytes()).getroot(), json.loads(report.read_text())


def corners(svg: Any, name: str) -> Any:
    element = svg.xpath(f"//*[@id='{name}']")[0]
    return elements.read_shape(element, np.eye(3)[:2]).control[:, 0]


@pytest.mark.parametrize("turn", ["", "rotate(-35 90 80)"])
def test_the_halves_of_a_belt_meet(turn: str, tmp_path: Path) -> None:
    held = f'<g transform="{turn}">{HALF}{MIRRORED}{LONGER}</g>'
    svg, report = reshaped(held, tmp_path)
    belt = corners(svg, "belt")
    np.testing.assert_allclose(belt[[0, 3], 0], 100.0, atol=0.01)
    assert (belt[[0, 3], 1] > (95.0, 110.0)).all()  # it has gone down with the vase
    assert report["skipped"] == []


def test_without_a_clone_the_belt_is_free(tmp_path: Path) -> None:
    svg, _ = reshaped(HALF + LONGER, tmp_path)
    assert (corners(svg, "belt")[[0, 3], 0] < 99.0).all()


def test_what_the_user_takes_off_the_axis_opens_and_is_named(tmp_path: Path) -> None:
    svg, report = reshaped(HALF + MIRRORED + LONGER + pair("c", (100, 90), (90, 90)), tmp_path)
    belt = corners(svg, "belt")
    assert belt[0, 0] == pytest.approx(90.0, abs=0.01)
    assert belt[3, 0] == pytest.approx(100.0, abs=0.01)
    assert [entry["id"] for entry in report["skipped"]] == ["m"]


@pytest.mark.parametrize("count", [1, 3], ids=["one handle", "handles off the axis"])
def test_a_pair_of_halves_that_is_moved_as_a_whole_is_not_held(count: int) -> None:
    """The axis of the clone's own transform stays, and the clone is shifted."""
    at = [(70, 20), (60, 160), (56.5, 90)][:count]
    moved = "".join(pair(str(n), (x, y), (x + 14, y + 10)) for n, (x, y) in enumerate(at))
    svg = loading.parse((HEAD + HALF + MIRRORED + moved + "</svg>").encode()).getroot()
    read = reading.read(svg, [], True)
    result = pipeline.reshape(read.drawing, pipeline.Options())
    assert mirror_seams.held(read, result.refitted) is None
    writing.write(read, result.refitted, True, 1e-3)
    assert read.skipped == []
    clone = svg.xpath("//*[@id='m']")[0]
    np.testing.assert_allclose(elements.own_matrix(clone)[:2, 2], [200 + 28, 0], atol=0.05)


@pytest.mark.parametrize("transform", ["translate(0,60)", "rotate(180 100 90)", "matrix(-1 0 0 1 260 0)"])
def test_other_clones_have_no_seam(transform: str) -> None:
    body = HALF + f'<use id="m" xlink:href="#half" transform="{transform}"/>' + LONGER
    read = reading.read(loading.parse((HEAD + body + "</svg>").encode()).getroot(), [], True)
    result = pipeline.reshape(read.drawing, pipeline.Options())
    assert mirror_seams.held(read, result.refitted) is None
