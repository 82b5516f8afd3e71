# SPDX-License-Identifier: GPL-2.0-or-later
"""What touches stays together: small drawings whose contacts are known, under several edits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from builders import drag, drawing, pin
from joined import largest_opening

from alup.model import Refitted
from alup.session import pipeline

DRAWINGS: dict[str, list[str]] = {
    "two squares with a border": ["M0,0 H100 V100 H0 Z", "M100,0 H200 V100 H100 Z"],
    "half a border": ["M0,0 H100 V100 H0 Z", "M100,30 H200 V70 H100 Z"],
    "three regions at a point": ["M0,0 H100 V60 H0 Z", "M100,0 H200 V60 H100 Z", "M0,60 H200 V120 H0 Z"],
    "a curve there and back": [
        "M0,0 H100 C130,40 70,60 100,100 H0 Z",
        "M200,0 H100 C130,40 70,60 100,100 H200 Z",
    ],
    "a border that is reversed": [
        "M0,0 H100 C130,40 70,60 100,100 H0 Z",
        "M200,0 V100 H100 C70,60 130,40 100,0 Z",
    ],
    "a cross": ["M0,50 C60,20 140,80 200,50", "M100,0 C80,30 120,70 100,100"],
    "a comb": ["M0,0 H200", "M0,0 V80", "M50,0 V80", "M100,0 V80", "M150,0 V80", "M200,0 V80"],
    "a stem on a curve": ["M0,60 C50,0 150,0 200,60", "M100,15 V100"],
}
# The first point stays, the last moves; one that is on a curve of every drawing is looked for.
EDITS = {
    "wider": np.array([[1.4, 0.0], [0.0, 1.0]]),
    "smaller": np.array([[0.5, 0.0], [0.0, 0.5]]),
    "flatter": np.array([[1.0, 0.0], [0.0, 0.4]]),
    "sheared": np.array([[1.0, 0.3], [0.0, 1.0]]),
}


def edited(shapes: list[str], matrix: np.ndarray) -> tuple[Any, Refitted]:
    """The drawing, with the ends of all its segments that are outermost as handles, and its new curves."""
    plain = drawing(*shapes)
    ends = plain.control[:, [0, 3]].reshape(-1, 2)
    handles = [pin(*ends[0])]
    seen = {tuple(ends[0])}
    for k in (ends[:, 0].argmax(), ends[:, 1].argmax(), (ends @ [1.0, 1.0]).argmax()):
        if tuple(ends[k]) not in seen:
            seen.add(tuple(ends[k]))
            handles.append(drag(tuple(ends[k]), tuple(ends[0] + matrix @ (ends[k] - ends[0]))))
    before = drawing(*shapes, handles=handles)
    return before, pipeline.reshape(before).refitted


@pytest.mark.parametrize("edit", EDITS)
@pytest.mark.parametrize("name", DRAWINGS)
def test_nothing_opens(name: str, edit: str) -> None:
    before, after = edited(DRAWINGS[name], EDITS[edit])
    assert np.abs(after.control).max() > 0.0
    assert largest_opening(before, after, 1e-5 * before.diagonal) <= 1e-4 * before.diagonal


@pytest.mark.parametrize("edit", ["wider", "smaller", "flatter"])  # a shear bends the lines a little
@pytest.mark.parametrize("name", ["two squares with a border", "half a border", "three regions at a point"])
def test_lines_between_nodes_stay_exactly_joined(name: str, edit: str) -> None:
    before, after = edited(DRAWINGS[name], EDITS[edit])
    assert after.line.all()
    assert largest_opening(before, after, 1e-5 * before.diagonal) <= 1e-6 * before.diagonal


def test_a_crossing_stays_where_it_was_on_both_curves() -> None:
    shapes = DRAWINGS["a cross"]
    handles = [pin(0, 50), pin(200, 50), drag((100, 0), (100, -40)), pin(100, 100)]
    before = drawing(*shapes, handles=handles)
    kept = pipeline.reshape(before, pipeline.Options(crossings=True))
    free = pipeline.reshape(before, pipeline.Options(crossings=False))
    assert (kept.report["ties"]["crossings"], free.report["ties"]["crossings"]) == (1, 0)
    # Two things, each with a sample of its own there.
    points, first = np.unique(kept.samples.points, axis=0, return_index=True)
    added = np.setdiff1d(np.arange(len(kept.samples.points)), first)
    twin = first[(points == kept.samples.points[added]).all(axis=1)]
    assert len(added) == len(twin) == 1
    assert np.linalg.norm(kept.moved[added] - kept.moved[twin]) <= 2e-3 * before.diagonal


def test_the_measure_sees_an_opening() -> None:
    before, after = edited(DRAWINGS["half a border"], EDITS["wider"])
    moved = after.control.copy()
    moved[after.source >= 4] += [0.5, 0.0]
    torn = Refitted(moved, after.line, after.source, after.smooth_start, after.error)
    assert largest_opening(before, torn, 1e-5 * before.diagonal) == pytest.approx(0.5, abs=1e-3)
