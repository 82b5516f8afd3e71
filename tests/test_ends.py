# SPDX-License-Identifier: GPL-2.0-or-later
"""Control arms of fitted segments: they leave in the direction of the moved samples, whatever the move is."""

from __future__ import annotations

from typing import Callable

import numpy as np
import pytest
from builders import drawing, sampled
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from alup.model import Drawing, Refitted
from alup.network.sampling import Samples
from alup.refit import refit
from alup.refit.control_arms import SMOOTH_ANGLE, end_tangents, start_tangents

Array = np.ndarray

# What every arm keeps below, and the arms of corners with enough samples.
REVERSED, STRAYED = 90.0, 6.0


def reshaped(before: Drawing, spacing: float, move: Callable[[Array], Array], tolerance: float) -> tuple:
    """The samples along segment 0 before and after, (n, 2) each, and the new segments."""
    net, samples = sampled(before, spacing)
    moved = move(samples.points)
    found = refit.refit(before, net, samples, moved, np.zeros(0, dtype=int), tolerance)
    return *along(before, net, samples, moved), found


def along(before: Drawing, net: object, samples: Samples, moved: Array) -> tuple[Array, Array]:
    rows = refit.rows(before, net, samples)  # type: ignore[arg-type]
    mine = rows.sample[rows.segment == 0]
    return samples.points[mine], moved[mine]


def complex_(v: Array) -> Array:
    return np.asarray(v)[..., 0] + 1j * np.asarray(v)[..., 1]


def angle_to_samples(before: Array, old: Array, new: Array, control: Array) -> float:
    """Degrees between a cubic's first arm and its old tangent, carried along with its samples; 0 for no arm.

    before : (4, 2); old, new : (n, 2) samples along it, before and after; control : (4, 2)
    """
    # The samples of the first of the new segments.
    until = int(np.linalg.norm(new[1:] - control[3], axis=1).argmin()) + 1
    away = np.abs(complex_(new[: until + 1] - new[0]))
    way = np.abs(np.diff(complex_(new[: until + 1]))).sum()
    told = np.flatnonzero(away > 0.01 * way)
    arm = complex_(control[1] - control[0])
    if not len(told) or abs(arm) < 1e-5 * way:
        return 0.0
    k = int(told[0])
    carried = (
        complex_(start_tangents(before[None])[0]) * complex_(new[k] - new[0]) / complex_(old[k] - old[0])
    )
    return float(np.degrees(np.abs(np.angle(arm / carried))))


def both_angles(before: Drawing, old: Array, new: Array, found: Refitted) -> list[float]:
    mine = found.control[found.source == 0]
    was = before.control[0]
    return [
        angle_to_samples(was, old, new, mine[0]),
        angle_to_samples(was[::-1], old[::-1], new[::-1], mine[-1][::-1]),
    ]


coordinate = st.integers(-20, 20).map(lambda n: 5.0 * n)
points = st.tuples(coordinate, coordinate)


@st.composite
def corner_segments(draw: Callable) -> Drawing:
    """A curve with a line on before it and one after it, and corners between them; short and no arms, too."""
    start, end, one, two = (np.array(draw(points)) for _ in range(4))
    shorter = st.sampled_from([1.0, 1.0, 0.1, 0.01, 1e-3, 0.0])
    one, two = start + draw(shorter) * (one - start), end + draw(shorter) * (two - end)
    assume(np.linalg.norm(end - start) > 1.0)
    control = np.array([start, one, two, end])[None]
    leaving, arriving = start_tangents(control)[0], end_tangents(control)[0]
    corner = np.exp(1j * draw(st.sampled_from([0.5, 1.5, 2.5, -2.0])))
    on = complex_(arriving) / abs(complex_(arriving)) * corner
    back = -complex_(leaving) / abs(complex_(leaving)) * corner
    tail, head = end + 30.0 * np.array([on.real, on.imag]), start + 30.0 * np.array([back.real, back.imag])
    words = [f"{float(x)!r},{float(y)!r}" for x, y in (start, one, two, end, tail, head)]
    return drawing(f"M{words[0]} C{' '.join(words[1:4])} L{words[4]} L{words[5]} Z")


def smooth_field(strength: float, waves: float, phase: float) -> Callable[[Array], Array]:
    def move(p: Array) -> Array:
        x, y = p[:, 0] * waves / 50.0, p[:, 1] * waves / 50.0
        return p + strength * np.stack([np.sin(y + phase) + np.cos(x), np.sin(x - y) + 0.3 * y], axis=1)

    return move


def rough_field(strength: float, seed: int) -> Callable[[Array], Array]:
    return lambda p: p + np.random.default_rng(seed).normal(0.0, strength, p.shape)


def squash(strength: float, x: float, y: float) -> Callable[[Array], Array]:
    """All that is near a point goes there, or is driven away from it, as by a lens."""

    def move(p: Array) -> Array:
        away = p - [x, y]
        return p + (strength * np.exp(-((away / 30.0) ** 2).sum(axis=1)))[:, None] * away

    return move


fields = st.one_of(
    st.builds(smooth_field, st.sampled_from([0.1, 3.0, 20.0]), st.floats(0.1, 5.0), st.floats(0.0, 6.0)),
    st.builds(rough_field, st.sampled_from([1e-3, 0.1, 3.0]), st.integers(0, 99)),
    st.builds(squash, st.sampled_from([-1.0, -0.99, -0.5, 1.0, 5.0]), coordinate, coordinate),
)


# What is reshaped, the move, the spacing and the tolerance.
any_move = given(
    corner_segments(), fields, st.sampled_from([0.5, 2.0, 10.0, 60.0]), st.sampled_from([0.02, 0.1, 1.0])
)


@settings(max_examples=80, deadline=None)
@any_move
def test_no_arm_of_a_corner_is_reversed(
    before: Drawing, move: Callable[[Array], Array], spacing: float, tolerance: float
) -> None:
    old, new, found = reshaped(before, spacing, move, tolerance)
    assume(np.linalg.norm(np.diff(new, axis=0), axis=1).sum() > 2.0 * tolerance)
    for angle in both_angles(before, old, new, found):
        assert angle < REVERSED


@settings(max_examples=60, deadline=None)
@any_move
def test_no_arm_is_longer_than_its_curve_can_have_it(
    before: Drawing, move: Callable[[Array], Array], spacing: float, tolerance: float
) -> None:
    old, new, found = reshaped(before, spacing, move, tolerance)
    ways = [np.linalg.norm(np.diff(p, axis=0), axis=1).sum() for p in (old, new)]
    assume(ways[1] > 2.0 * tolerance)
    was = np.linalg.norm(before.control[0, [1, 2]] - before.control[0, [0, 3]], axis=1).max()
    mine = found.control[found.source == 0]
    arms = np.linalg.norm(mine[:, [1, 2]] - mine[:, [0, 3]], axis=2)
    # A few samples tell the way a little too short.
    assert arms.max() <= max(2.2 * was * ways[1] / ways[0], 1.1 * ways[1]) + 1e-9


@pytest.mark.parametrize("lift", [-0.8, -0.3, 0.3, 0.8, 3.0])
def test_a_short_arm_of_a_corner_that_moves_leaves_as_before(lift: float) -> None:
    """By about its arm's length: what vanishes is the outline around a reversed one."""
    before = drawing("M0,0 C0.01,0.8 0.2,168 0.2,168 L40,190 L40,20 Z")

    def move(p: Array) -> Array:
        return p + np.stack([0.0 * p[:, 0], lift * np.clip(1.0 - p[:, 1] / 84.0, 0.0, 1.0) ** 2], axis=1)

    old, new, found = reshaped(before, 1.0, move, 0.1)
    assert (found.source == 0).sum() == 1
    arm = found.control[0, 1] - found.control[0, 0]
    assert arm[1] > 0.0
    assert max(both_angles(before, old, new, found)) < STRAYED


@pytest.mark.parametrize("spacing", [1.0, 3.0])
@pytest.mark.parametrize("strength", [1.0, 8.0])
def test_the_arms_of_corners_go_where_the_samples_go(spacing: float, strength: float) -> None:
    before = drawing("M0,0 C20,50 60,40 100,0 L110,60 L-20,60 Z")
    old, new, found = reshaped(before, spacing, smooth_field(strength, 1.0, 0.4), 0.05)
    assert max(both_angles(before, old, new, found)) < STRAYED


def test_a_curve_squashed_to_less_than_the_tolerance_keeps_its_shape() -> None:
    """Its samples say nothing about it, but how large it is."""
    before = drawing("M0,0 C2,8 6,8 8,0 L40,-20 L-40,-20 Z")
    dirt = np.random.default_rng(3)

    def move(p: Array) -> Array:
        on = p[:, 1] >= 0.0
        return np.where(on[:, None], 1e-4 * (p + dirt.normal(0.0, 1.0, p.shape) * (p[:, 1:] > 0.0)), p)

    _, _, found = reshaped(before, 1.0, move, 0.1)
    (control,) = found.control[found.source == 0]
    scale = (control[3] - control[0])[0] / 8.0
    assert control - control[0] == pytest.approx(scale * (before.control[0] - before.control[0, 0]), abs=1e-4)


def test_corners_are_corners() -> None:
    """The curves above are not smoothed at their ends."""
    before = drawing("M0,0 C20,50 60,40 100,0 L110,60 L-20,60 Z")
    turn = complex_(start_tangents(before.control[1:2])[0]) / complex_(end_tangents(before.control[:1])[0])
    assert np.abs(np.angle(turn)) > SMOOTH_ANGLE
