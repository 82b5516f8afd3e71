# SPDX-License-Identifier: GPL-2.0-or-later
"""New handles on a reshaped curve hold the point under them, and find its place in the original."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from builders import BLOB, curve_points
from documents import get, text_of
from reruns import (
    DIAGONAL,
    ORIGINAL,
    PAIR,
    PATH,
    PINS,
    REST,
    add,
    away,
    circle,
    control,
    drag,
    handle,
    load,
    pins,
    run,
)

from alup.document.history import correspondence, stored_records
from alup.document.history.correspondence import cuts_of, parts_before
from alup.geometry import bezier
from alup.messages.errors import HandleError
from alup.svg import path_data


@pytest.fixture
def bent() -> Any:
    """BLOB, reshaped so much that segments were divided."""
    svg = load(PATH + PINS + handle(150, 75, at=(185, 40)))
    run(svg)
    return svg


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """Largest distance between curves (s, 4, 2) and other ones."""
    pairs = ((one, bezier.Nearest(other)), (other, bezier.Nearest(one)))
    return max(nearest.find(point)[3] for curves, nearest in pairs for point in curve_points(curves))


def node(svg: Any, was: tuple[float, float]) -> np.ndarray:
    """Where a node of BLOB is now."""
    number = [tuple(p) for p in path_data.parse(BLOB)[0].control[:, 0].tolist()].index(was)
    record = stored_records.from_text(get(svg, "p").attrib.get(ORIGINAL) or "")
    added = sum(len(cuts) for n, cuts in record.cuts.items() if n < number) if record else 0
    return control(svg, "p")[number + added, 0]


@pytest.mark.parametrize("segment", range(15))
def test_a_new_pin_holds_the_point_under_it(bent: Any, segment: int) -> None:
    """All else nearly stays: the held point is one more sample, which changes the solution a little."""
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
    """Including where a curve was before the first run."""
    assert away(bent, "p", (150, 75)) > 2.0
    add(bent, circle("pin", 150, 75, identity="new"))
    before = text_of(bent)
    with pytest.raises(HandleError, match=r"new .*not on a curve"):
        run(bent)
    assert text_of(bent) == before


def test_a_new_handle_on_another_shape_takes_no_part() -> None:
    svg = load(PAIR + pins((20, 20), (20, 80)) + handle(80, 80, at=(95, 90)))
    run(svg, "l r")
    add(svg, circle("pin", *control(svg, "r")[1, 3].tolist(), identity="new"))
    told = run(svg, "l")
    assert [name[:3] for name in told.ignored] == ["new"]
    assert REST not in get(svg, "new").attrib


def test_a_new_section_holds_its_present_content() -> None:
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
    assert np.array_equal(correspondence.original_points(svg, points), points)
    run(svg)
    back = correspondence.original_points(svg, points + move)
    np.testing.assert_allclose(back, points, atol=1e-5)


def test_where_segments_were_divided_is_found_again() -> None:
    """The places are exact if the parts were moved by one map."""
    old = np.array(
        [[(0.0, 0.0), (30.0, 80.0), (90.0, 10.0), (50.0, -20.0)], [(0, 0), (1, 0), (2, 0), (3, 0)]]
    )
    stops = np.array([0.0, 0.1, 0.45, 0.8, 1.0])
    parts = (
        bezier.subrange(np.repeat(old[:1], 4, axis=0), stops[:-1], stops[1:]) @ [[1.5, 0.3], [-0.2, 0.7]]
        + 5.0
    )
    new = np.concatenate([parts, old[1:]])
    source = np.array([0, 0, 0, 0, 1])
    cuts = cuts_of(new, source)
    assert list(cuts) == [0]
    np.testing.assert_allclose(cuts[0], stops[1:-1], atol=1e-12)
    before = parts_before(new, source, old)
    np.testing.assert_allclose(before[:4] @ [[1.5, 0.3], [-0.2, 0.7]] + 5.0, parts, atol=1e-9)
    assert np.array_equal(before[4], old[1])


def test_points_of_the_original_where_segments_were_divided() -> None:
    svg = load('<path id="p" d="M0,0 H100"/>' + pins((0, 0), (100, 0)) + handle(50, 0, "h", (50, 30)))
    run(svg)
    assert len(control(svg, "p")) > 1
    record = stored_records.from_text(get(svg, "p").get(ORIGINAL))
    assert record is not None
    assert list(record.cuts) == [0]
    now = control(svg, "p")
    back = correspondence.original_points(svg, np.concatenate([now[:, 0], now[-1:, 3], [(50.0, 30.0)]]))
    assert np.abs(back[:, 1]).max() < 0.1
    assert np.all(np.diff(back[:-1, 0]) > 0)
    np.testing.assert_allclose(back[[0, -2, -1]], [(0, 0), (100, 0), (50, 0)], atol=0.1)
    add(svg, circle("pin", *now[0, 3].tolist(), identity="new"))
    before = control(svg, "p")
    run(svg)
    assert away(svg, "p", before[0, 3]) < 0.05
