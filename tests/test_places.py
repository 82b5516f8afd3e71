# SPDX-License-Identifier: GPL-2.0-or-later
"""Places on curves: which segment came from which, and where a point was in the original."""

from __future__ import annotations

from typing import Any

import inkex
import numpy as np
import pytest
from companions import AWAY, RECT, run

from alup.document.history import correspondence
from alup.document.history.correspondence import Correspondence, original_points, pair
from alup.document.tree.elements import Shape
from alup.svg.path_data import parse


def shape(data: str) -> Shape:
    element = inkex.PathElement()
    element.set("d", data)
    return Shape(element, "p", np.eye(2, 3), tuple(parse(data)), element)


def test_a_place_without_curves_is_the_point_itself() -> None:
    place = Correspondence([]).locate(np.array([3.0, 4.0]))
    assert np.array_equal(place.was, [3.0, 4.0])
    assert np.array_equal(place.now, [3.0, 4.0])
    assert place.distance == np.inf


@pytest.mark.parametrize(
    ("now", "was", "wanted"),
    [
        # Rounding opened the outline.  The line that z draws then came from the end of the last segment.
        ("M0,0 L8,0 L8,8 L0,0.001 Z", "M0,0 L4,0 L4,4 L0,0 Z", [(4, 0), (4, 4), (0, 0), (0, 0)]),
        # Two of four segments are left.
        ("M0,0 L8,0 L8,8", "M0,0 L4,0 L4,2 L4,4 L0,4", [(4, 0), (4, 4)]),
        ("M5,5", "M0,0 L4,0", []),
        ("", "", []),
    ],
    ids=["opened", "fewer", "point", "nothing"],
)
def test_segments_and_what_they_came_from(now: str, was: str, wanted: list[Any]) -> None:
    new, old = pair(shape(now), shape(was), {})
    assert len(new) == len(old) == len(wanted)
    np.testing.assert_allclose(old[:, 3], np.reshape(wanted, (-1, 2)), atol=1e-12)


def test_a_point_on_an_unreadable_path_is_itself() -> None:
    done = run(RECT.format("") + '<path id="p" d="M200,200 h50"/>', move=AWAY)
    at = np.array([[170.0, 90.0], [225.0, 200.0]])
    assert np.abs(correspondence.original_points(done.root, at)[0] - (20, 20)).max() < 1e-2
    done["p"].set("d", "no path")
    np.testing.assert_allclose(original_points(done.root, at)[0], (20, 20), atol=1e-2)
