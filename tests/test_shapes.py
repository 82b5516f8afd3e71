# SPDX-License-Identifier: GPL-2.0-or-later
"""Basic shapes against chapter 9 of the SVG specification."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from alup.geometry.bezier import evaluate
from alup.messages.errors import DocumentError
from alup.svg import basic_shapes, path_data


def data(tag: str, points: str = "", **attributes: float) -> str:
    return basic_shapes.path_data(tag, attributes.get, points)


def outline(d: str, steps: int = 65) -> np.ndarray:
    """Points along the single subpath."""
    (subpath,) = path_data.parse(d)
    return evaluate(subpath.control[:, None], np.linspace(0, 1, steps)[None]).reshape(-1, 2)


def starts(d: str) -> list[list[float]]:
    (subpath,) = path_data.parse(d)
    return subpath.control[:, 0].round(9).tolist()


def area(points: np.ndarray) -> float:
    """Positive for the direction of SVG's shapes: right, down, left, up."""
    x, y = points.T
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def test_rect_is_right_down_left_and_closed() -> None:
    d = data("rect", x=1.0, y=2.0, width=10.0, height=5.0)
    assert starts(d) == [[1, 2], [11, 2], [11, 7], [1, 7]]
    assert path_data.parse(d)[0].closed


def test_rect_stands_at_the_origin_unless_told() -> None:
    assert starts(data("rect", width=3.0, height=2.0)) == [[0, 0], [3, 0], [3, 2], [0, 2]]


@pytest.mark.parametrize(
    ("given", "rx", "ry"),
    [
        ({"rx": 2.0, "ry": 1.0}, 2.0, 1.0),
        ({"rx": 2.0}, 2.0, 2.0),  # one given radius is both
        ({"ry": 1.5}, 1.5, 1.5),
        ({"rx": 100.0, "ry": 1.0}, 5.0, 1.0),  # at most half the side
        ({"rx": 100.0}, 5.0, 3.0),
        ({"rx": 5.0, "ry": 3.0}, 5.0, 3.0),
    ],
)
def test_rounded_rect(given: dict[str, Any], rx: float, ry: float) -> None:
    x, y, width, height = 1.0, 2.0, 10.0, 6.0
    points = outline(data("rect", x=x, y=y, width=width, height=height, **given))
    assert points.min(axis=0) == pytest.approx([x, y], abs=1e-9)
    assert points.max(axis=0) == pytest.approx([x + width, y + height], abs=1e-9)
    # Every point is on a side, or on the ellipse of its corner.
    near = np.minimum(points - [x, y], [x + width, y + height] - points)
    corner = (near < [rx, ry]).all(axis=1)
    on_side = (np.abs(near) < 1e-9).any(axis=1)
    assert (corner | on_side).all()
    inside = (near[corner] - [rx, ry]) / [rx, ry]
    assert np.hypot(*inside.T) == pytest.approx(1.0, abs=5e-4)
    assert area(points) == pytest.approx(width * height - (4 - math.pi) * rx * ry, rel=2e-3)
    # The outline begins after the top left corner.
    assert points[0] == pytest.approx([x + rx, y])


@pytest.mark.parametrize("given", [{"rx": 0.0, "ry": 3.0}, {"rx": 3.0, "ry": 0.0}, {"rx": 0.0}])
def test_a_rect_with_a_radius_of_zero_has_corners(given: dict[str, Any]) -> None:
    assert starts(data("rect", width=3.0, height=2.0, **given)) == [[0, 0], [3, 0], [3, 2], [0, 2]]


def test_sides_without_length_are_left_out() -> None:
    (pill,) = path_data.parse(data("rect", width=10.0, height=4.0, rx=2.0))
    assert np.linalg.norm(pill.control[:, 3] - pill.control[:, 0], axis=1).min() > 1.0
    (ellipse,) = path_data.parse(data("rect", width=10.0, height=4.0, rx=5.0, ry=2.0))
    assert (ellipse.kind == path_data.ARC).all()
    assert len(ellipse.arcs) == 4


@pytest.mark.parametrize(
    ("tag", "given", "rx", "ry"),
    [
        ("circle", {"cx": 3.0, "cy": 4.0, "r": 2.0}, 2.0, 2.0),
        ("circle", {"r": 2.5}, 2.5, 2.5),
        ("ellipse", {"cx": 3.0, "cy": 4.0, "rx": 2.0, "ry": 5.0}, 2.0, 5.0),
        ("ellipse", {"rx": 2.0}, 2.0, 2.0),
        ("ellipse", {"ry": 2.0}, 2.0, 2.0),
    ],
)
def test_circles_and_ellipses(tag: str, given: dict[str, Any], rx: float, ry: float) -> None:
    d = data(tag, **given)
    centre = np.array([given.get("cx", 0.0), given.get("cy", 0.0)])
    points = outline(d)
    unit = (points - centre) / [rx, ry]
    assert np.hypot(*unit.T) == pytest.approx(1.0, abs=3e-4)
    assert area(points) == pytest.approx(math.pi * rx * ry, rel=2e-3)
    (subpath,) = path_data.parse(d)
    assert subpath.closed
    # Four nodes, from three o'clock on, clockwise on the screen.
    assert subpath.control[:, 0] == pytest.approx(centre + np.array([[rx, 0], [0, ry], [-rx, 0], [0, -ry]]))


@pytest.mark.parametrize(
    ("tag", "given"),
    [
        ("rect", {"width": 0.0, "height": 5.0}),
        ("rect", {"width": 5.0}),
        ("rect", {"width": -5.0, "height": 5.0}),
        ("circle", {}),
        ("circle", {"r": 0.0}),
        ("circle", {"r": -1.0}),
        ("ellipse", {"rx": 3.0, "ry": 0.0}),
        ("ellipse", {}),
        ("polyline", {}),
    ],
)
def test_shapes_that_are_not_rendered_have_no_path(tag: str, given: dict[str, Any]) -> None:
    assert data(tag, **given) == ""


def test_line() -> None:
    (subpath,) = path_data.parse(data("line", x1=1.0, y1=2.0, x2=-3e-7, y2=1e20))
    assert subpath.control[0, 0].tolist() == [1.0, 2.0]
    assert subpath.control[0, 3].tolist() == [-3e-7, 1e20]
    assert not subpath.closed


@pytest.mark.parametrize(
    "points", ["0,0 10,0 10,5", "0 0 10 0 10 5", " 0,0,10,0,10,5 ", "0,0\n10,0\t10,5", "0-0 1e1+0 10,5.0"]
)
def test_polylines_and_polygons(points: str) -> None:
    (line,) = path_data.parse(data("polyline", points))
    assert line.control[:, [0, 3]].tolist() == [[[0, 0], [10, 0]], [[10, 0], [10, 5]]]
    assert not line.closed
    (closed,) = path_data.parse(data("polygon", points))
    assert closed.closed
    assert closed.control[-1, 3].tolist() == [0, 0]
    assert (closed.kind != path_data.CURVE).all()


@pytest.mark.parametrize("tag", ["polyline", "polygon"])
@pytest.mark.parametrize(
    ("points", "why"),
    [("0,0 10", "half a point"), ("0,0 ten,0", "not a number"), ("0,0 5px,3", "not a number")],
)
def test_unreadable_points(tag: str, points: str, why: str) -> None:
    with pytest.raises(DocumentError, match=why):
        data(tag, points)


def test_geometry_names_the_attributes_that_a_path_does_not_have() -> None:
    assert set(basic_shapes.GEOMETRY) == set(basic_shapes.TAGS)
