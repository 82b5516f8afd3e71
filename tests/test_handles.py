# SPDX-License-Identifier: GPL-2.0-or-later
"""Which curve points handles hold, and their targets."""

from __future__ import annotations

from typing import Sequence

import numpy as np
import pytest
from builders import BLOB, curve_points, drag, drawing, pin

from alup.handles import binding
from alup.handles.binding import Anchors, Grabbed
from alup.messages.errors import HandleError
from alup.model import Drawing, Handle, Section
from alup.network import sampling, weld
from alup.network.sampling import Samples


def grab(before: Drawing) -> Grabbed:
    return binding.grab(weld.build(before, weld.SNAP_DISTANCE * before.diagonal), before)


def anchored(before: Drawing, spacing: float = 1.0) -> tuple[Samples, Anchors]:
    net = weld.build(before, weld.SNAP_DISTANCE * before.diagonal)
    grabbed = binding.grab(net, before)
    samples = sampling.sample(net, spacing, grabbed.curve, grabbed.fraction)
    return samples, binding.anchors(before, grabbed, samples)


def circle(x: float, y: float, radius: float) -> Handle:
    return Handle("circle", np.array([x, y]), None, radius)


# --- the nearest point --------------------------------------------------------------------------


@pytest.mark.parametrize(
    "at",
    [(10.5, 80.2), (61.0, 19.5), (128.0, 66.0), (149.0, 75.5), (100.0, 120.0), (14.0, 100.0), (115.0, 70.5)],
)
def test_a_handle_holds_the_nearest_curve_point(at: tuple[float, float]) -> None:
    before = drawing(BLOB, "M50,60 C60,80 80,80 90,60", handles=[circle(*at, 15.0)])
    found = grab(before)
    fine = curve_points(before.control, 20_001)
    wanted = np.linalg.norm(fine - at, axis=1).min()
    assert found.distance[0] == pytest.approx(wanted, abs=1e-4)
    assert found.distance[0] <= wanted + 1e-9
    assert np.linalg.norm(found.point[0] - at) == pytest.approx(found.distance[0], abs=1e-12)
    assert np.linalg.norm(fine - found.point[0], axis=1).min() < 1e-2


def test_the_nearest_of_many_curves_is_found() -> None:
    random = np.random.default_rng(1)
    # Long curves that cross often; the search has few points to begin from.
    paths = [
        "M{:.3f},{:.3f} C{:.3f},{:.3f} {:.3f},{:.3f} {:.3f},{:.3f}".format(*random.uniform(0, 100, 8))
        for _ in range(25)
    ]
    at = random.uniform(20, 80, (20, 2))
    before = drawing(*paths, handles=[circle(x, y, 100.0) for x, y in at])
    fine = curve_points(before.control, 5001)
    for place, distance in zip(at, grab(before).distance):
        assert distance <= np.linalg.norm(fine - place, axis=1).min() + 1e-9


def test_a_long_curve_is_found_between_the_points_that_the_search_begins_with() -> None:
    before = drawing("M-1000,0 L1000,0", "M30,3 L32,3", handles=[pin(31.25, 0.1)])
    found = grab(before)
    assert found.distance[0] == pytest.approx(0.1)
    assert found.point[0] == pytest.approx([31.25, 0.0])


def test_the_fraction_is_that_of_the_arc_length() -> None:
    before = drawing("M0,0 C0,0 20,0 100,0", handles=[pin(25, 0), pin(0, 0), pin(100, 0)])
    found = grab(before)
    assert found.fraction == pytest.approx([0.25, 0.0, 1.0], abs=1e-6)


def test_a_node_is_held_as_that_vertex() -> None:
    before = drawing("M0,0 H100 V50", "M100,0 L140,-20", handles=[pin(100, 0)])
    samples, anchors = anchored(before)
    valence = np.bincount(samples.edges.ravel())
    assert valence[anchors.samples[0]] == 3
    assert samples.points[anchors.samples[0]].tolist() == [100, 0]


# --- reach --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("away", "radius", "held"),
    [
        (0.9, 0.0, True),
        (1.1, 0.0, False),
        (1.1, 1.2, True),
        (4.9, 5.0, True),
        (5.1, 5.0, False),
        (0.5, 0.1, True),
    ],
)
def test_the_reach_is_the_radius_or_a_hundredth_of_the_diagonal(
    away: float, radius: float, held: bool
) -> None:
    before = drawing("M0,0 H60 V80", handles=[circle(30.0, -away, radius)])
    assert before.diagonal == pytest.approx(100.0)
    if held:
        assert grab(before).distance[0] == pytest.approx(away)
    else:
        with pytest.raises(HandleError, match=f"circle is not on a curve: .* is {away:g} away"):
            grab(before)


def test_handles_on_curves_that_are_not_reshaped_are_ignored() -> None:
    other = drawing("M0,200 H100").control
    before = drawing("M0,0 H100 V20", handles=[pin(0, 0), pin(50, 200, "elsewhere")], bystanders=other)
    found = grab(before)
    assert found.handle.tolist() == [0]
    assert found.ignored == ("elsewhere",)
    with pytest.raises(HandleError, match="off is not on a curve"):
        grab(drawing("M0,0 H100 V20", handles=[pin(0, 0), pin(50, 100, "off")], bystanders=other))
    with pytest.raises(HandleError, match="None of the handles lies on a selected curve"):
        grab(drawing("M0,0 H100 V20", handles=[pin(50, 200, "elsewhere")], bystanders=other))


def test_no_handles_say_how_to_make_one() -> None:
    with pytest.raises(HandleError, match=r"no handles.*alup:pin"):
        grab(drawing("M0,0 H100"))


# --- targets ------------------------------------------------------------------------------------


def held_at(samples: Samples, anchors: Anchors, point: Sequence[float]) -> np.ndarray:
    """The target of the sample at a point."""
    (n,) = np.flatnonzero(np.linalg.norm(samples.points[anchors.samples] - point, axis=1) < 1e-9)
    return anchors.targets[n]


def test_pins_stay_and_drags_move() -> None:
    before = drawing("M0,0 H100 V50", handles=[pin(0, 0), drag((100, 50), (120, 70)), pin(33, 0)])
    samples, anchors = anchored(before)
    assert held_at(samples, anchors, (0, 0)).tolist() == [0, 0]
    assert held_at(samples, anchors, (100, 50)) == pytest.approx([120, 70])
    assert held_at(samples, anchors, (33, 0)) == pytest.approx([33, 0])
    assert anchors.of_handle.shape == (3,)
    for n, handle in enumerate(before.handles):
        assert samples.points[anchors.samples[anchors.of_handle[n]]] == pytest.approx(handle.rest)


def test_a_handle_beside_the_curve_brings_the_curve_point_to_its_target() -> None:
    # The curve point under the first moves to the centre of the second.
    before = drawing("M0,0 H100", handles=[drag((50, 0.8), (60, 20), reach=1.0)])
    samples, anchors = anchored(before)
    assert held_at(samples, anchors, (50, 0)) == pytest.approx([60, 20])


def test_a_pin_beside_the_curve_does_not_pull_it() -> None:
    before = drawing("M0,0 H100", handles=[circle(50, 0.8, 1.0)])
    samples, anchors = anchored(before)
    assert held_at(samples, anchors, (50, 0)) == pytest.approx([50, 0], abs=1e-9)


def test_a_distance_from_the_curve_within_rounding_is_not_kept() -> None:
    # The handle is on the curve up to rounding: the curve point moves by exactly the handle's move.
    before = drawing("M0,0 H100", handles=[drag((50, 3e-4), (60, 3e-4))])
    samples, anchors = anchored(before)
    assert held_at(samples, anchors, (50, 0)) == pytest.approx([60, 0], abs=1e-12)


def test_a_handle_beside_a_node_moves_it_by_as_much() -> None:
    before = drawing("M0,0 H100 V50", handles=[drag((99.999, 0), (109.999, 5))])
    samples, anchors = anchored(before)
    assert samples.points[anchors.samples].tolist() == [[100, 0]]
    assert anchors.targets == pytest.approx(np.array([[110, 5]]), abs=1e-9)


# --- conflicts ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "wishes",
    [
        [drag((50, 0), (60, 0), "a"), drag((50, 0), (60, 1e-3), "b")],
        [drag((50, 0), (60, 0), "a"), pin(50, 0, "b")],
        [drag((0, 0), (0, 1), "a"), drag((0, 0), (0, 2), "b")],
        [pin(20, 0, "c"), drag((50, 0), (60, 0), "a"), pin(50, 0, "b")],
    ],
)
def test_different_targets_for_one_point_are_named(wishes: list[Handle]) -> None:
    with pytest.raises(HandleError, match=r"handles a and b hold the same point.*[Dd]elete one"):
        anchored(drawing("M0,0 H100", handles=wishes))


def test_equal_targets_for_one_point_are_one() -> None:
    wishes = [drag((50, 0), (60, 0)), drag((50, 0), (60, 1e-6)), pin(0, 0), pin(0, 0)]
    _, anchors = anchored(drawing("M0,0 H100", handles=wishes))
    assert len(anchors.samples) == 2
    assert len(set(anchors.samples.tolist())) == 2


def test_coincident_curves_are_one_point() -> None:
    twice = ("M0,0 H100", "M100,0 H0")
    with pytest.raises(HandleError, match="same point"):
        anchored(drawing(*twice, handles=[pin(50, 0), drag((50, 0), (50, 20))]))


# --- sections -----------------------------------------------------------------------------------


def test_a_section_holds_all_samples_inside_and_maps_them() -> None:
    matrix = np.array([[2.0, 0.5, 3.0], [-1.0, 1.0, 4.0]])
    section = Section("part", np.array([20.0, -5.0, 30.0, 10.0]), matrix)
    before = drawing("M0,0 H100 V50", sections=(section,))
    samples, anchors = anchored(before)
    x, y = samples.points.T
    inside = np.flatnonzero((x >= 20) & (x <= 50) & (np.abs(y) <= 5))
    assert set(anchors.samples) == set(inside)
    assert len(inside) > 25
    for n, target in zip(anchors.samples, anchors.targets):
        px, py = samples.points[n]
        assert target == pytest.approx([2 * px + 0.5 * py + 3, -px + py + 4])


def test_a_section_around_nothing_is_named() -> None:
    section = Section("empty", np.array([20.0, 5.0, 30.0, 10.0]), np.eye(2, 3))
    with pytest.raises(HandleError, match="frame empty holds no curve"):
        anchored(drawing("M0,0 H100", sections=(section,)))


def test_a_section_and_a_handle_may_agree_but_not_differ() -> None:
    shift = np.array([[1.0, 0.0, 5.0], [0.0, 1.0, 0.0]])
    section = Section("part", np.array([20.0, -5.0, 30.0, 10.0]), shift)
    samples, anchors = anchored(drawing("M0,0 H100", handles=[drag((30, 0), (35, 0))], sections=(section,)))
    assert held_at(samples, anchors, (30, 0)) == pytest.approx([35, 0])
    with pytest.raises(HandleError, match="pin 30,0 and part hold the same point"):
        anchored(drawing("M0,0 H100", handles=[pin(30, 0)], sections=(section,)))
