# SPDX-License-Identifier: GPL-2.0-or-later
"""Things that only cross are parts of their own, which stay together where they cross."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import Array, curve_points, drag, drawing, mapped, pin, reshaped, rotation, sampled
from test_ties import box, circle

from alup.geometry.connected_components import components
from alup.model import Drawing
from alup.network import open_crossings
from alup.network.sampling import Samples, turns
from alup.session.pipeline import Result

NOBODY = np.zeros(0, dtype=int)


def parts(samples: Samples) -> int:
    return components(samples.edges, len(samples.points))[0]


def opened(*paths: str, spacing: float = 3.0, held: Array = NOBODY) -> tuple[Samples, Samples, Array]:
    """Samples as they are joined and opened, and the pairs."""
    before = drawing(*paths)
    net, joined = sampled(before, spacing)
    return (joined, *open_crossings.opened(joined, net, before, held))


def of_paths(before: Drawing, after: Result) -> list[Array]:
    """Points of what became of each path."""
    shape = before.shape[after.refitted.source]
    return [curve_points(after.refitted.control[shape == n], 257) for n in range(int(shape.max()) + 1)]


# --- the samples ------------------------------------------------------------------------------------


@pytest.mark.parametrize("low", [0.0, 5.0])
def test_a_wheel_on_a_truck_is_a_part_of_its_own(low: float) -> None:
    """Whether its nodes lie on the truck's edge or not."""
    joined, samples, pairs = opened(box(0, 0, 100, 50), circle(30, 50 + low, 12))
    assert parts(joined) == 1
    assert parts(samples) == 2
    assert len(pairs) == 2 == len(samples.points) - len(joined.points)
    assert (samples.points[pairs[:, 0]] == samples.points[pairs[:, 1]]).all()
    half = np.sqrt(12.0**2 - low**2)
    np.testing.assert_allclose(
        samples.points[pairs[:, 0]][np.argsort(samples.points[pairs[:, 0], 0])],
        [[30 - half, 50], [30 + half, 50]],
        atol=0.01,
    )


def test_edges_chains_and_straight_turns_say_the_same_as_before() -> None:
    joined, samples, pairs = opened("M0,0 L100,40", "M0,40 L100,0", "M50,-10 V60", "M20,-10 L30,60")
    assert parts(samples) == 4 and len(pairs) == 2 + 2
    was = np.arange(len(samples.points))
    was[pairs[:, 1]] = pairs[:, 0]
    assert (was[samples.edges] == joined.edges).all()
    assert (was[samples.chain] == joined.chain).all()
    # Chains run along the edges, from sample to sample.
    begin, ends = samples.chain_start, np.sort(samples.edges, axis=1)
    inside = np.setdiff1d(np.arange(len(samples.chain) - 1), begin[1:-1] - 1)
    along = np.sort(np.stack([samples.chain[inside], samples.chain[inside + 1]], axis=1), axis=1)
    assert (along == ends).all()
    # Every line is as straight as it was: at each of its inner samples it goes on.
    assert len(samples.straight_turns) == len(joined.straight_turns)
    i, j, k, _, _ = turns(samples.edges, len(samples.points))
    assert set(map(tuple, samples.straight_turns)) <= set(zip(i.tolist(), j.tolist(), k.tolist()))


@pytest.mark.parametrize(
    ("paths", "why"),
    [
        (("M0,0 C80,60 -40,60 40,0",), "a curve that crosses itself"),
        (("M0,0 H100 V40", "M0,20 H100"), "a curve that ends on another one"),
        (("M0,0 L100,40 V0 L0,40 V0",), "one contour"),
        ((box(0, 0, 50, 50), box(50, 10, 20, 20)), "shapes side by side"),
        (("M0,0 H100", "M20,-30 L50,0 L80,-30"), "a tip that touches"),
    ],
)
def test_what_is_one_thing_keeps_its_vertices(paths: tuple[str, ...], why: str) -> None:
    joined, samples, pairs = opened(*paths)
    assert not len(pairs), why
    assert (samples.edges == joined.edges).all() and (samples.straight_turns == joined.straight_turns).all()


def test_a_border_that_two_shapes_share_is_one_thing_whichever_way_they_run() -> None:
    round_, back = "M0,0 H50 V50 H0 Z", "M0,0 V50 H50 V0 Z"
    _, samples, pairs = opened(round_, back, "M-20,25 H70")
    assert parts(samples) == 2 and len(pairs) == 2


def test_a_crossing_that_a_handle_holds_stays_one_point() -> None:
    lines = ("M0,0 L100,40", "M0,40 L100,0")
    joined, _, pairs = opened(*lines)
    at = np.flatnonzero(np.linalg.norm(joined.points - [50, 20], axis=1) < 1e-9)
    assert len(at) == 1
    assert len(pairs) == 1
    assert not len(opened(*lines, held=at)[2])


def test_a_clip_stays_joined_to_what_it_crosses() -> None:
    before = drawing(box(0, 0, 100, 50), circle(30, 50, 12))
    net, joined = sampled(before, 3.0)
    for clips, count in (((), 2), ((0,), 0), ((1,), 0)):
        assert len(open_crossings.opened(joined, net, replace(before, clips=clips), NOBODY)[1]) == count


# --- pictures -----------------------------------------------------------------------------------------

TRUCK = (box(0, 0, 100, 50), circle(25, 50, 12), circle(80, 50, 12))


@pytest.mark.parametrize("degrees", [0.0, 90.0])
def test_wheels_keep_their_size_where_the_truck_grows(degrees: float) -> None:
    turn = rotation(degrees)
    moved = [drag((0, 0), (-40, 0)), drag((0, 40), (-40, 40))]
    before = mapped(drawing(*TRUCK, handles=[pin(100, 0), pin(100, 40), *moved]), turn)
    for wheel in of_paths(before, reshaped(before))[1:]:
        # As one network with the truck the rear one grows by a fifth.
        np.testing.assert_allclose(np.ptp(wheel @ turn, axis=0), 24.0, rtol=0.05)


def test_a_stick_stays_on_the_head_that_it_runs_into() -> None:
    """Each has handles that only shift it, and these differ: the stick has to become shorter."""
    before = drawing(
        circle(50, 40, 40), "M46,60 V300 H54 V60 Z",
        handles=[
            pin(10, 40), pin(90, 40), pin(50, 0), drag((46, 300), (46, 150)), drag((54, 300), (54, 150)),
        ],
    )  # fmt: skip
    head, stick = of_paths(before, reshaped(before))
    np.testing.assert_allclose(np.ptp(head, axis=0), 80.0, rtol=0.02)
    assert stick[:, 1].min() < head[:, 1].max() - 5.0
    assert stick[:, 1].max() == pytest.approx(150.0, abs=1.0)


@pytest.mark.parametrize("far", [20.0, 60.0, 150.0])
def test_a_limb_stays_on_what_it_joins_however_far_that_goes(far: float) -> None:
    hand, body = circle(0, 0, 10), circle(100, 0, 20)
    before = drawing(hand, body, "M5,0 H85", handles=[drag((-10, 0), (-10 - far, 0)), pin(120, 0)])
    moved_hand, moved_body, limb = of_paths(before, reshaped(before))
    # It ends within both, as it did: crossing either at one point still.
    assert limb[:, 0].min() < moved_hand[:, 0].max() - 1.0
    assert limb[:, 0].max() > moved_body[:, 0].min() + 1.0
    assert np.abs(limb[:, 1]).max() < 1.0


@pytest.mark.parametrize(
    "held",
    [
        # Their shift gives a scale of 1 up to rounding.
        ((13.7, 3.1), (91.3, 3.1), (91.3, 43.1), (13.7, 43.1)),
        # Points at one height leave open how much the part is to grow upwards.
        ((13.7, 5.0), (91.3, 5.0)),
    ],
)
def test_a_part_that_is_shifted_off_another_keeps_its_size_and_place_on_it(held: tuple) -> None:
    plate, shaft = box(13.7, 3.1, 77.6, 40.0), box(20, 35, 60, 100)
    up = [drag(p, (p[0] + 0.7, p[1] - 29.97)) for p in held]
    before = drawing(plate, shaft, handles=[*up, pin(20, 135), pin(80, 135), pin(20, 120)])
    moved_plate, moved_shaft = of_paths(before, reshaped(before))
    np.testing.assert_allclose(np.ptp(moved_plate, axis=0), [77.6, 40.0], atol=1.5)
    assert moved_shaft[:, 1].min() < moved_plate[:, 1].max() - 1.5
