# SPDX-License-Identifier: GPL-2.0-or-later
"""Which points face each other: feet of perpendiculars, on both sides and not along the curves."""

from __future__ import annotations

import numpy as np
import pytest
from builders import Array, drawing, rotation, sampled

from alup.network.sampling import Samples
from alup.ties import facing as nearness
from alup.ties import scaffold
from alup.ties.facing import Facing, facing


def found(*paths: str, spacing: float = 1.0, farthest: float = 40.0, linear: object = None) -> tuple:
    """The samples, and which points face each other.  farthest : in spacings"""
    before = drawing(*paths)
    if linear is not None:
        before = drawing(*paths)
        before.control[:] = before.control @ np.asarray(linear).T
    _, samples = sampled(before, spacing)
    return samples, facing(samples, scaffold.sides(samples.points), spacing, farthest * spacing)


def feet(samples: Samples, of: Facing) -> tuple[Array, Array]:
    """The points that face something, (F, 2), and their feet, (F, 2)."""
    a, b = (samples.points[samples.edges[of.edge, end]] for end in (0, 1))
    return samples.points[of.sample], a + of.share[:, None] * (b - a)


def test_parallel_lines_have_their_feet_exactly_opposite() -> None:
    """The samples of the other line do not matter: it begins between two samples of the first one."""
    for paths in (("M0,0 H60", "M0,7 H60"), ("M0,0 H60", "M0.37,7 H59.1")):
        samples, of = found(*paths)
        here, there = feet(samples, of)
        inside = (here[:, 0] >= 0.37) & (here[:, 0] <= 59.1)
        assert inside.sum() > 110
        assert there[inside, 0] == pytest.approx(here[inside, 0], abs=1e-9)
        assert of.distance[inside] == pytest.approx(7.0)
        assert len(np.unique(of.sample)) == len(of.sample) == len(samples.points)
        assert np.abs(there[:, 1] - here[:, 1]) == pytest.approx(7.0)


def test_distance_is_that_of_sample_and_foot() -> None:
    samples, of = found("M0,0 C20,30 40,-30 60,0", "M0,10 C20,35 40,-15 60,12")
    here, there = feet(samples, of)
    assert len(of.sample) > 50
    assert np.linalg.norm(there - here, axis=1) == pytest.approx(of.distance)


def test_a_line_between_two_faces_both() -> None:
    samples, of = found("M0,0 H60", "M0,5 H60", "M0,12 H60")
    here, there = feet(samples, of)
    middle = here[:, 1].round(9) == 5.0
    assert sorted(set(there[middle, 1].round(9))) == [0.0, 12.0]
    assert (np.bincount(of.sample[middle])[of.sample[middle]] == 2).all()
    # The outer ones face the middle one, not each other through it.
    assert set(there[~middle, 1].round(9)) == {5.0}


@pytest.mark.parametrize(
    "corner", ["M0,0 H50 V50", "M0,0 H50 L6.7,25", "M0,0 H50 V50 H0 Z", "M0,0 C0,40 50,40 50,0"]
)
def test_points_round_a_corner_do_not_face_each_other(corner: str) -> None:
    samples, of = found(corner)
    here, there = feet(samples, of)
    near = of.distance < 12.0
    assert not near.any(), (here[near], there[near])


def test_the_legs_of_a_hairpin_face_each_other_where_the_bend_is_far() -> None:
    samples, of = found("M0,0 H100 V5 H0")
    here, there = feet(samples, of)
    # The way round is to be longer than four times the distance and four spacings: 2 (100 - x) + 5 > 24.
    assert here[:, 0].max() == pytest.approx(90.5, abs=1.0)
    assert len(np.unique(of.sample)) > 2 * 88
    assert there[:, 0] == pytest.approx(here[:, 0], abs=1e-9)


def test_curves_that_meet_do_not_face_each_other_at_their_junction() -> None:
    samples, of = found("M0,0 H60", "M30,0 V40")
    here, _ = feet(samples, of)
    away = np.linalg.norm(here - [30.0, 0.0], axis=1)
    assert not (away < 15.0).any()


def test_points_that_are_too_far_do_not_face() -> None:
    for apart, faces in ((9.9, True), (10.1, False)):
        _, of = found("M0,0 H60", f"M0,{apart} H60", farthest=10.0)
        assert bool(len(of.sample)) is faces


def test_feet_do_not_depend_on_the_diagonals_of_the_triangulation() -> None:
    """Samples at the corners of squares: with either diagonal the triangulation is Delaunay's."""
    _, samples = sampled(drawing("M0,0 H20", "M0,1 H20"), 1.0)
    points = samples.points
    n = np.lexsort((points[:, 0], points[:, 1].round(9))).reshape(2, -1)
    rungs = n.T
    one, other = np.stack([n[0][:-1], n[1][1:]], axis=1), np.stack([n[0][1:], n[1][:-1]], axis=1)
    both = [facing(samples, np.concatenate([rungs, d]), 1.0, 10.0) for d in (one, other)]
    places = [feet(samples, of) for of in both]
    assert (both[0].sample == both[1].sample).all()
    assert len(both[0].sample) == len(points)
    assert places[0][1] == pytest.approx(places[1][1], abs=1e-12)


@pytest.mark.parametrize("linear", [rotation(90.0), rotation(33.0), -np.eye(2), np.diag([1.0, -1.0])])
def test_facing_points_turn_with_the_drawing(linear: Array) -> None:
    paths = ("M0,0 C20,30 40,-30 60,0", "M2,10 C20,35 40,-15 57,12 V30 H2 Z")
    samples, of = found(*paths)
    turned, there = found(*paths, linear=linear)
    assert turned.points == pytest.approx(samples.points @ linear.T, abs=1e-9)
    order, other = (np.lexsort((one.distance.round(6), one.sample)) for one in (of, there))
    assert (of.sample[order] == there.sample[other]).all()
    assert feet(turned, there)[1][other] == pytest.approx(feet(samples, of)[1][order] @ linear.T, abs=1e-8)


def test_nothing_to_face() -> None:
    _, of = found("M0,0 H60")
    assert len(of.sample) == 0


# Teeth on a spine, every third pair joined at their tips: one part with short and long ways along it.
COMB = (
    "M0,0 V39",
    *(f"M0,{y} H40" for y in range(0, 40, 3)),
    *(f"M40,{y} V{y + 3}" for y in range(0, 37, 9)),
)


@pytest.mark.parametrize("table", [1, 50, 2000])
def test_ways_do_not_depend_on_how_many_are_looked_up_at_a_time(
    table: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Tables of sources and vertices, and one source at a time."""
    _, whole = found(*COMB)
    monkeypatch.setattr(nearness, "_TABLE", table)
    _, piecewise = found(*COMB)
    assert len(whole.sample) > 0
    for name in ("sample", "edge", "share", "distance"):
        assert (getattr(whole, name) == getattr(piecewise, name)).all()


def test_very_many_vertices_are_taken_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cells smaller than all distances between vertices change nothing."""
    _, whole = found(*COMB, "M50,0 V40", "M53,0 V40")
    monkeypatch.setattr(nearness, "_MOST_VERTICES", 10)
    _, cells = found(*COMB, "M50,0 V40", "M53,0 V40")
    assert (whole.sample == cells.sample).all()
    assert whole.distance == pytest.approx(cells.distance)
