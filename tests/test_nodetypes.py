# SPDX-License-Identifier: GPL-2.0-or-later
"""The letters of `sodipodi:nodetypes` stay true."""

from __future__ import annotations

import numpy as np
import pytest

from alup.geometry.bezier import subrange
from alup.svg import path_data
from alup.svg.node_types import Run, update

OPEN = "M0,0 C0,5 5,10 10,10 S20,5 20,0 L30,0"
CLOSED = "M0,0 C0,5 5,10 10,10 S20,5 20,0 Z"


def unchanged(d: str) -> list[Run]:
    return [
        Run(s, s.control, np.arange(len(s.control)), np.zeros(len(s.control), dtype=bool))
        for s in path_data.parse(d)
    ]


def divided(d: str, segment: int, smooth: bool) -> Run:
    """The subpath with one segment divided in its middle."""
    (s,) = path_data.parse(d)
    halves = [subrange(s.control[segment], a, b) for a, b in np.array(((0.0, 0.5), (0.5, 1.0)))]
    control = np.concatenate([s.control[:segment], halves, s.control[segment + 1 :]])
    source = np.sort(np.append(np.arange(len(s.control)), segment))
    start = np.zeros(len(control), dtype=bool)
    start[segment + 1] = smooth
    return Run(s, control, source, start)


@pytest.mark.parametrize(
    ("d", "letters"),
    [
        (OPEN, "cscc"),
        (OPEN, "czcc"),
        (OPEN, "cacc"),
        (CLOSED, "cscc"),
        ("M0,0 L5,5", "cc"),
        ("M0,0 L5,5 M1,1 L2,2 3,0 Z", "cc" + "cccc"),
        ("M0,0 L5,5 M1,1", "cc" + "c"),
        ("M1,1 Z M0,0 L5,5", "cc" + "cc"),
    ],
)
def test_unchanged_nodes_keep_their_letters(d: str, letters: str) -> None:
    assert update(letters, unchanged(d)) == letters


@pytest.mark.parametrize(("smooth", "letter"), [(True, "s"), (False, "c")])
def test_added_nodes_get_a_letter(smooth: bool, letter: str) -> None:
    assert update("cscc", [divided(OPEN, 1, smooth)]) == "cs" + letter + "cc"
    assert update("cscc", [divided(OPEN, 2, smooth)]) == "csc" + letter + "c"
    # A closed subpath names its first node twice; its closing segment may be divided, too.
    assert update("cscc", [divided(CLOSED, 2, smooth)]) == "csc" + letter + "c"


@pytest.mark.parametrize("letter", ["z", "a"])
def test_symmetric_and_automatic_nodes_are_smooth_where_their_handles_differ(letter: str) -> None:
    (run,) = unchanged(OPEN)
    control = run.control.copy()
    control[0, 2] -= 0.5 * (control[0, 3] - control[0, 2])  # one handle longer, same direction
    changed = Run(run.subpath, control, run.source, run.smooth_start)
    assert update(f"c{letter}cc", [changed]) == "cscc"
    nearly = run.control.copy()
    nearly[0, 2] -= 1e-5 * (nearly[0, 3] - nearly[0, 2])
    assert update(f"c{letter}cc", [Run(run.subpath, nearly, run.source, run.smooth_start)]) == f"c{letter}cc"


def test_the_first_node_of_a_closed_subpath_looks_at_the_last_segment() -> None:
    circle = "M0,0 C0,5 10,5 10,0 C10,-5 0,-5 0,0 Z"
    (run,) = unchanged(circle)
    assert update("zzz", [run]) == "zzz"
    control = run.control.copy()
    control[1, 2, 1] *= 2.0
    assert update("zzz", [Run(run.subpath, control, run.source, run.smooth_start)]) == "szs"


@pytest.mark.parametrize("letters", ["", "c", "csc", "csccc"])
def test_letters_that_do_not_fit_are_dropped(letters: str) -> None:
    assert update(letters, unchanged(OPEN)) is None


def test_paths_with_arcs_have_no_letters() -> None:
    # Inkscape counts the nodes of the curves it makes of arcs, which are its own choice.
    assert update("cc", unchanged("M0,0 A5,5 0 0 1 5,5")) is None
