# SPDX-License-Identifier: GPL-2.0-or-later
"""No fitted arm points against the way that its own curve goes, where the drawing's did not."""

from __future__ import annotations

import numpy as np
import pytest
from builders import drawing, sampled

from alup.model import Refitted
from alup.refit import refit
from alup.refit.control_arms import headings

Array = np.ndarray

# A curve with three smooth nodes, one that turns back sharply, and one whose end bulges out beyond it.
WAVE = "M0,0 C10,30 40,30 50,0 C60,-30 90,-30 100,0"
HAIRPIN = "M100,10 C10,-8 190,98 22,10"
BULGE = "M26.19,7.43 C22.76,5.92 16.73,1.95 19.41,0.82"


def moved_by(path: str, by: Array | None, peak: tuple[float, float] | None, held: bool) -> Refitted:
    """The path under a linear map, and the sample in its middle pulled out by `peak` as a spike."""
    before = drawing(path)
    net, samples = sampled(before, 2.0)
    moved = samples.points @ (np.eye(2) if by is None else by).T
    middle = len(before.control) * len(samples.points) // (2 * len(before.control))
    if peak is not None:
        away = np.linalg.norm(samples.points - samples.points[middle], axis=1)
        moved = moved + np.exp(-away / 4.0)[:, None] * np.array(peak)
    at = np.array([middle] if held else [], dtype=int)
    return refit.refit(before, net, samples, moved, at, 0.25)


def reversed_arms(found: Refitted) -> int:
    return int((headings(found.control) < -0.5).sum())


def test_a_heading_is_1_along_the_curve_and_minus_1_against_it() -> None:
    straight = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]])
    against = np.array([[0.0, 0.0], [-0.5, 0.0], [2.0, 0.0], [3.0, 0.0]])
    retracted = np.array([[0.0, 0.0], [0.0, 0.0], [2.0, 0.0], [3.0, 0.0]])
    assert headings(np.array([straight, against, retracted])) == pytest.approx(
        np.array([[1.0, 1.0], [-1.0, 1.0], [1.0, 1.0]])
    )


@pytest.mark.parametrize("path", [WAVE, HAIRPIN])
@pytest.mark.parametrize("peak", [(0.0, 15.0), (15.0, 0.0), (-10.0, -12.0), (6.0, -30.0)])
@pytest.mark.parametrize("held", [True, False])
def test_a_spike_has_no_reversed_arm(path: str, peak: tuple[float, float], held: bool) -> None:
    assert reversed_arms(moved_by(path, None, peak, held)) == 0


def test_the_tip_of_a_spike_is_a_corner_and_what_is_added_beside_it_is_smooth() -> None:
    found = moved_by(WAVE, None, (0.0, 30.0), True)
    tip = found.control[:, 0, 1].argmax()
    assert not found.smooth_start[tip]
    arriving = found.control[tip - 1, 3] - found.control[tip - 1, 2]
    leaving = found.control[tip, 1] - found.control[tip, 0]
    cosine = arriving @ leaving / np.linalg.norm(arriving) / np.linalg.norm(leaving)
    assert cosine < 0.5
    assert found.smooth_start.any()


def noisy(path: str, wide: float) -> Refitted:
    """Stretched, and bent a little, so that no cubic is met exactly."""
    before = drawing(path)
    net, samples = sampled(before, 1.0)
    p = samples.points
    moved = np.stack([wide * p[:, 0] + 0.1 * np.sin(p[:, 1]), p[:, 1]], axis=1)
    return refit.refit(before, net, samples, moved, np.zeros(0, dtype=int), 0.25)


@pytest.mark.parametrize("wide", [1.4, 2.0, 3.0])
def test_a_bulge_that_becomes_wide_is_divided_where_it_turns_back(wide: float) -> None:
    found = noisy(BULGE, wide)
    assert reversed_arms(found) == 0
    assert len(found.control) > 1


def test_the_knobs_of_the_drawing_are_kept_without_nodes() -> None:
    knob = "M0,0 C-5,1 30,20 40,20"
    assert headings(drawing(knob).control).min() < -0.5
    found = noisy(knob, 1.1)
    assert len(found.control) == 1
