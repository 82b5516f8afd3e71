# SPDX-License-Identifier: GPL-2.0-or-later
"""Cubics against closed forms, slow integration and finite differences."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from alup.geometry import bezier

# A cubic with different speed everywhere and no symmetry.
CURVE = np.array([[0.0, 0.0], [1.0, 3.0], [4.0, -1.0], [5.0, 2.0]])

coordinates = st.floats(-100.0, 100.0, allow_nan=False, width=32)
cubics = hnp.arrays(float, (4, 2), elements=coordinates)
parameters = st.floats(0.0, 1.0, allow_nan=False)


def power_form(control: np.ndarray, t: float) -> np.ndarray:
    """B(t) by its monomials, independent of the Bernstein basis."""
    p0, p1, p2, p3 = control
    a, b, c = p3 - 3 * p2 + 3 * p1 - p0, 3 * (p2 - 2 * p1 + p0), 3 * (p1 - p0)
    return ((a * t + b) * t + c) * t + p0


def de_casteljau(control: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
    """The two halves, as the textbook draws them."""
    rows = [control]
    while len(rows[-1]) > 1:
        last = rows[-1]
        rows.append((1 - t) * last[:-1] + t * last[1:])
    return np.array([row[0] for row in rows]), np.array([row[-1] for row in rows[::-1]])


@given(cubics, parameters)
def test_evaluate_agrees_with_the_power_form(control: np.ndarray, t: float) -> None:
    assert bezier.evaluate(control, np.array(t)) == pytest.approx(power_form(control, t), abs=1e-10)


def test_evaluate_broadcasts_curves_against_parameters() -> None:
    control = np.stack([CURVE, CURVE + 10.0, -CURVE])
    t = np.linspace(0, 1, 5)
    found = bezier.evaluate(control[:, None], t[None])
    assert found.shape == (3, 5, 2)
    for curve, row in zip(control, found):
        for parameter, point in zip(t, row):
            assert point == pytest.approx(power_form(curve, parameter), abs=1e-12)


def test_ends_are_met_exactly() -> None:
    odd = np.array([[0.1, 0.7], [1.3, 3.1], [4.7, -1.9], [5.3, 2.3]])
    assert (bezier.evaluate(odd, np.array([0.0, 1.0])[:, None]).reshape(2, 2) == odd[[0, 3]]).all()


@pytest.mark.parametrize("t", [0.0, 0.1, 0.5, 0.77, 1.0])
def test_derivatives_by_finite_differences(t: float) -> None:
    h = 1e-4
    forth, back, here = (power_form(CURVE, t + e) for e in (h, -h, 0.0))
    third = 6 * (CURVE[3] - 3 * CURVE[2] + 3 * CURVE[1] - CURVE[0])
    # The central difference of a cubic is off by exactly h^2/6 times the third derivative.
    assert bezier.derivative(CURVE, np.array(t)) == pytest.approx(
        (forth - back) / (2 * h) - third * h * h / 6, abs=1e-9
    )
    assert bezier.second_derivative(CURVE, np.array(t)) == pytest.approx(
        (forth - 2 * here + back) / h**2, abs=1e-5
    )


def test_a_line_runs_evenly_and_ends_exactly() -> None:
    start, end = np.array([0.1, 0.2]), np.array([1e6 + 0.3, -7.7])
    control = bezier.from_line(start, end)
    assert (control[0] == start).all()
    assert (control[3] == end).all()
    t = np.linspace(0, 1, 11)
    assert bezier.evaluate(control, t) == pytest.approx(start + t[:, None] * (end - start), rel=1e-12)


def test_lines_end_exactly_where_they_end() -> None:
    # In floating point start + (end - start) is not always end.
    start, end = np.random.default_rng(0).uniform(-100, 100, (2, 1000, 2))
    assert (start + (end - start) != end).any()
    control = bezier.from_line(start, end)
    assert (control[:, 0] == start).all()
    assert (control[:, 3] == end).all()


@given(cubics, parameters)
def test_reverse_runs_the_other_way(control: np.ndarray, t: float) -> None:
    assert bezier.evaluate(control[..., ::-1, :], np.array(t)) == pytest.approx(
        bezier.evaluate(control, np.array(1.0 - t)), abs=1e-9
    )


@given(cubics, parameters)
def test_subrange_from_the_ends_is_de_casteljau(control: np.ndarray, t: float) -> None:
    left, right = de_casteljau(control, t)
    assert bezier.subrange(control, *np.array((0.0, t))) == pytest.approx(left, abs=1e-9)
    assert bezier.subrange(control, *np.array((t, 1.0))) == pytest.approx(right, abs=1e-9)


@given(cubics, parameters, parameters, parameters)
def test_subrange_is_the_same_curve(control: np.ndarray, t0: float, t1: float, u: float) -> None:
    part = bezier.subrange(control, *np.array((t0, t1)))
    assert power_form(part, u) == pytest.approx(power_form(control, t0 + u * (t1 - t0)), abs=1e-9)


def test_arc_length_of_lines() -> None:
    control = bezier.from_line(np.array([[0.0, 0.0], [1.0, 1.0]]), np.array([[3.0, 4.0], [1.0, 1.0]]))
    assert bezier.arc_lengths(control) == pytest.approx([5.0, 0.0], abs=1e-14)
    # The same line at uneven speed, once back and forth: x = t^2 (3 - 2t), and x = 3 t (1 - t).
    ease = np.array([[[0.0, 0], [0, 0], [1, 0], [1, 0]], [[0.0, 0], [1, 0], [1, 0], [0, 0]]])
    assert bezier.arc_lengths(ease) == pytest.approx([1.0, 1.5], abs=1e-12)


def test_arc_length_of_a_semicubical_parabola() -> None:
    """The curve x = t^2, y = t^3 has length ((4 + 9)^1.5 - 8) / 27 (Neile's parabola)."""
    control = np.array([[[0.0, 0.0], [0.0, 0.0], [1 / 3, 0.0], [1.0, 1.0]]])
    assert bezier.arc_lengths(control, 8)[0] == pytest.approx((13**1.5 - 8) / 27, rel=1e-12)


def test_arc_length_of_a_parabola() -> None:
    """Y = x^2 over [0, 1]: sqrt(5)/2 + asinh(2)/4; as a cubic (0,0), (1/3,0), (2/3,1/3), (1,1)."""
    control = np.array([[[0.0, 0.0], [1 / 3, 0.0], [2 / 3, 1 / 3], [1.0, 1.0]]])
    assert bezier.arc_lengths(control, 8)[0] == pytest.approx(math.sqrt(5) / 2 + math.asinh(2) / 4, rel=1e-9)


def test_arc_length_is_additive_and_bounded_by_chord_and_polygon() -> None:
    whole = bezier.arc_lengths(CURVE[None], 64)[0]
    parts = [bezier.subrange(CURVE, a, b) for a, b in np.array(((0.0, 0.3), (0.3, 1.0)))]
    assert bezier.arc_lengths(np.array(parts), 64).sum() == pytest.approx(whole, rel=1e-10)
    assert math.hypot(5, 2) < whole < bezier.polygon_lengths(CURVE)
    assert bezier.polygon_lengths(CURVE) == pytest.approx(math.hypot(1, 3) + 5.0 + math.hypot(1, 3))


def test_arc_length_table_lists_every_curve_from_zero() -> None:
    control = np.stack([CURVE, bezier.from_line(np.zeros(2), np.array([2.0, 0.0]))])
    start, t, s = bezier.arc_length_table(control, np.array([10, 4]))
    assert start.tolist() == [0, 11, 16]
    assert t[:11] == pytest.approx(np.linspace(0, 1, 11))
    assert s[11:] == pytest.approx([0.0, 0.5, 1.0, 1.5, 2.0])
    # A slow independent integral: the chords of very many points.
    fine = np.array([power_form(CURVE, x) for x in np.linspace(0.0, 0.3, 3001)])
    slow = np.linalg.norm(np.diff(fine, axis=0), axis=1).sum()
    assert s[3] == pytest.approx(slow, rel=1e-6)
    assert len(bezier.arc_lengths(np.zeros((0, 4, 2)))) == 0


@settings(max_examples=50)
@given(cubics, st.floats(0.0, 360.0), st.floats(0.1, 10.0))
def test_arc_length_is_invariant_under_motions_and_scales(
    control: np.ndarray, degrees: float, scale: float
) -> None:
    angle = math.radians(degrees)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    both = np.stack([control, scale * control @ turn.T + [3.0, -5.0]])
    first, second = bezier.arc_lengths(both)
    assert second == pytest.approx(scale * first, rel=1e-9, abs=1e-9)


def brute_nearest(control: np.ndarray, point: np.ndarray) -> float:
    """The least distance over 20,001 parameters."""
    t = np.linspace(0, 1, 20001)
    return float(np.linalg.norm(bezier.evaluate(control, t) - point, axis=1).min())


@pytest.mark.parametrize("point", [(1.0, 1.0), (2.5, 1.0), (6.0, 3.0), (-1.0, -1.0), (4.0, 0.2)])
def test_nearest_parameter_against_brute_force(point: tuple[float, float]) -> None:
    wanted = np.array(point)
    guesses = np.linspace(0, 1, 17)
    away = np.linalg.norm(bezier.evaluate(CURVE, guesses) - wanted, axis=1)
    t = bezier.nearest_parameters(CURVE, wanted, guesses[away.argmin()])
    found = float(np.linalg.norm(power_form(CURVE, float(t)) - wanted))
    assert found <= brute_nearest(CURVE, wanted) + 1e-9
    if 0.0 < t < 1.0:  # the foot is perpendicular
        cosine = (power_form(CURVE, float(t)) - wanted) @ bezier.derivative(CURVE, np.array(t))
        assert abs(cosine) < 1e-7


@settings(max_examples=100)
@given(cubics, hnp.arrays(float, 2, elements=coordinates), parameters)
def test_nearest_parameter_is_never_worse_than_the_guess(
    control: np.ndarray, point: np.ndarray, guess: float
) -> None:
    t = float(bezier.nearest_parameters(control, point, np.array(guess)))
    assert 0.0 <= t <= 1.0
    before, after = (np.linalg.norm(bezier.evaluate(control, x) - point) for x in np.array((guess, t)))
    assert after <= before + 1e-9


def test_a_point_on_the_curve_is_found_at_its_parameter() -> None:
    t = np.array([0.05, 0.4, 0.93])
    points = bezier.evaluate(CURVE, t)
    found = bezier.nearest_parameters(np.stack([CURVE] * 3), points, t + 0.04)
    assert found == pytest.approx(t, abs=1e-9)


@pytest.mark.parametrize(
    ("control", "expected"),
    [
        ([[0, 0], [1, 0], [2, 0], [3, 0]], True),
        ([[0, 0], [0, 0], [3, 3], [3, 3]], True),  # retracted handles
        ([[0, 0], [0.1, 0.1], [0.2, 0.2], [3, 3]], True),  # uneven speed
        ([[0, 0], [1, 0.1], [2, 0], [3, 0]], False),  # off the chord
        ([[0, 0], [-1, 0], [2, 0], [3, 0]], False),  # turns back before its start
        ([[0, 0], [1, 0], [4, 0], [3, 0]], False),  # and beyond its end
        ([[0, 0], [1, 0], [1, 0], [0, 0]], False),  # no chord
        ([[0, 0], [1, 2e-5], [2, 0], [3, 0]], True),  # within the tolerance of the chord's length
        ([[0, 0], [1, 4e-5], [2, 0], [3, 0]], False),
    ],
)
def test_straightness(control: list[list[float]], expected: bool) -> None:
    assert bool(bezier.straight(np.array(control, dtype=float), 1e-5, 1.0)) is expected


def test_straightness_keeps_to_the_absolute_bound_too() -> None:
    control = np.array([[0.0, 0.0], [100.0, 0.02], [200.0, 0.0], [300.0, 0.0]])
    assert bezier.straight(control, 1e-3, 0.1)
    assert not bezier.straight(control, 1e-3, 0.01)


@settings(max_examples=50)
@given(st.floats(0.0, 360.0), st.floats(0.01, 100.0), st.booleans())
def test_straightness_is_invariant(degrees: float, scale: float, bent: bool) -> None:
    angle = math.radians(degrees)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    control = np.array([[0.0, 0.0], [1.0, 0.01 if bent else 0.0], [2.5, 0.0], [3.0, 0.0]])
    assert bool(bezier.straight(scale * control @ turn.T, 1e-3, 1e9)) is not bent


def test_the_nearest_point_beyond_a_cusp_is_found() -> None:
    """Near its cusp a curve's points at equal steps of the parameter lie close, beyond it far apart."""
    control = np.array([[[0.0, 1.0], [18.0, 0.5], [0.5, 0.5], [0.5, 0.5]]])
    point = np.array([1.0, 1.0])
    _, t, _, distance = bezier.Nearest(control).find(point)
    assert distance <= brute_nearest(control[0], point)
    assert distance == pytest.approx(0.0283, abs=1e-4)
    assert t == pytest.approx(0.0192, abs=1e-4)


# Control points that coincide, cusps, loops and lines run through twice are as frequent as general curves.
odd_cubics = hnp.arrays(float, (7, 4, 2), elements=st.sampled_from([-18.0, -1.0, 0.0, 0.5, 0.501, 1.0, 30.0]))


@settings(max_examples=100, deadline=None)
@given(
    st.one_of(hnp.arrays(float, (7, 4, 2), elements=coordinates), odd_cubics),
    hnp.arrays(float, 2, elements=st.one_of(coordinates, st.sampled_from([0.0, 0.5, 1.0]))),
)
def test_the_nearest_of_many_curves(control: np.ndarray, to: np.ndarray) -> None:
    """As near as the nearest of very many points, to what the curves run between two of these."""
    t = np.linspace(0.0, 1.0, 2001)
    points = bezier.evaluate(control[:, None], t[None])
    step = np.linalg.norm(np.diff(points, axis=1), axis=2).max()
    curve, at, found, distance = bezier.Nearest(control).find(to)
    least = np.linalg.norm(points - to, axis=2).min()
    assert distance <= least + 1e-9
    assert distance >= least - step
    assert np.allclose(found, power_form(control[curve], at), atol=1e-9)
    assert distance == pytest.approx(np.linalg.norm(found - to))


def test_ends_are_the_nearest_points_exactly() -> None:
    control = np.array([[[0.1, 0.7], [1.3, 3.1], [4.7, -1.9], [5.3, 2.3]], [[9.0, 9.0]] * 4])
    search = bezier.Nearest(control)
    for curve, end in ((0, 0), (0, 3), (1, 0)):
        found, at, point, distance = search.find(control[curve, end])
        assert (found, at, distance) == (curve, end / 3.0, 0.0)
        assert (point == control[curve, end]).all()
    assert search.find(np.array([5.5, 2.6]))[:2] == (0, 1.0)


def test_a_point_as_far_from_all_of_a_curve_ends_the_search() -> None:
    """The centre of a quarter circle: no part of the curve can be told from another by much."""
    control = np.array([[[1.0, 0.0], [1.0, 0.5523], [0.5523, 1.0], [0.0, 1.0]]])
    for centre in ([0.0, 0.0], [1e-5, 1e-5], [0.3, 0.4]):
        distance = bezier.Nearest(control).find(np.array(centre))[3]
        assert distance == pytest.approx(brute_nearest(control[0], np.array(centre)), abs=1e-8)


def test_far_curves_are_not_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """Millions of segments may lie beside the few that are reshaped."""
    start = np.stack(np.meshgrid(np.arange(100.0), np.arange(100.0)), axis=-1).reshape(-1, 2)
    control = bezier.from_line(start, start + [0.8, 0.3])
    looked = [0]
    least, evaluate = bezier._least_coefficient, bezier.evaluate

    def bounded(curves: np.ndarray) -> np.ndarray:
        looked[0] += len(curves)
        return least(curves)

    def counted(curves: np.ndarray, t: np.ndarray) -> np.ndarray:
        looked[0] += len(curves)
        return evaluate(curves, t)

    monkeypatch.setattr(bezier, "_least_coefficient", bounded)
    monkeypatch.setattr(bezier, "evaluate", counted)
    curves = bezier.Nearest(control)
    curve, at, _, distance = curves.find(np.array([42.4, 17.15]))
    assert curve == 1742
    assert (at, distance) == pytest.approx((0.5, 0.0), abs=1e-12)
    assert curves.is_inside(np.array([[42.1, 17.0], [42.5, 17.2]]))
    assert not curves.is_inside(np.array([[42.85, 17.0], [42.95, 17.9]]))
    assert 0 < looked[0] < 200


def test_newtons_method_does_not_stop_at_a_step_that_is_too_long() -> None:
    """Where the distance bends little, from a guess at which Newton's first step leads past the end."""
    control = np.array([[48.31, 280.28], [49.85, 283.91], [55.51, 297.77], [55.42, 298.75]])
    point = np.array([49.44, 282.92])
    guesses = np.linspace(0.0, 0.4, 41)
    found = bezier.nearest_parameters(np.tile(control, (41, 1, 1)), np.tile(point, (41, 1)), guesses)
    t = np.linspace(0.0, 1.0, 4001)
    best = t[np.linalg.norm(bezier.evaluate(np.tile(control, (4001, 1, 1)), t) - point, axis=1).argmin()]
    assert found == pytest.approx(np.full(41, best), abs=1e-3)
