# SPDX-License-Identifier: GPL-2.0-or-later
"""What is regular is found, and kept: circles, copies, rows and columns, rings, words, mirrored halves."""

from __future__ import annotations

import numpy as np
import pytest
from builders import drag, drawing, pin, sampled

from alup.geometry import bezier
from alup.model import Drawing, Handle
from alup.network import sampling, weld
from alup.refit import refit
from alup.regular import find, keep, shapes, symmetry
from alup.regular.find import CIRCLES, COPIES, WORDS, Along, Regular
from alup.session import pipeline

Array = np.ndarray

ALL = frozenset(find.KINDS)
NONE = pipeline.Options(regular=frozenset())

# Of the control arms of a quarter of a circle.
ARM = 0.5522847498


def circle(x: float, y: float, rx: float, ry: float | None = None) -> str:
    ry = rx if ry is None else ry
    a, b = ARM * rx, ARM * ry
    return (
        f"M{x + rx},{y} C{x + rx},{y + b} {x + a},{y + ry} {x},{y + ry} S{x - rx},{y + b} {x - rx},{y} "
        f"S{x - a},{y - ry} {x},{y - ry} S{x + rx},{y - b} {x + rx},{y} Z"
    )


def square(x: float, y: float, side: float = 10.0) -> str:
    return f"M{x},{y} h{side} v{side} h{-side} Z"


def found(of: Drawing, kinds: frozenset[str] = ALL) -> Regular:
    net = weld.build(of, 1e-5 * of.diagonal)
    none = np.zeros(0)
    samples = sampling.sample(net, 0.01 * of.diagonal, none.astype(int), none)
    rows = refit.rows(of, net, samples)
    return find.find(of, Along(rows.segment, rows.sample, samples.edges, samples.points), kinds)


def kinds(of: Regular) -> list[str]:
    return sorted(item.kind for item in of.items)


def noisy(of: Drawing, size: float, seed: int = 0) -> Drawing:
    """With noise of this part of the diagonal on all coordinates; joints stay joined."""
    rng = np.random.default_rng(seed)
    _, number = np.unique(np.round(of.control.reshape(-1, 2), 6), axis=0, return_inverse=True)
    shift = rng.uniform(-1, 1, (number.max() + 1, 2)) * size * of.diagonal
    control = of.control + shift[number.ravel()].reshape(of.control.shape)
    return Drawing(control, of.line, of.following, of.shape, of.names)


def of_shape(result: pipeline.Result, before: Drawing, shape: int) -> Array:
    """The new control points of a shape, (k, 4, 2)."""
    return np.asarray(result.refitted.control[before.shape[result.refitted.source] == shape])


def out_of_round(control: Array) -> float:
    """How far a closed curve is from its best circle, of its radius."""
    points = bezier.evaluate(control[:, None], np.linspace(0.0, 1.0, 9)[None, :]).reshape(-1, 2)
    middle, radius = shapes.circle(points)
    return float(np.abs(np.linalg.norm(points - middle, axis=1) - radius).max() / radius)


def box_of(control: Array) -> tuple[Array, Array]:
    points = bezier.evaluate(control[:, None], np.linspace(0.0, 1.0, 9)[None, :]).reshape(-1, 2)
    return points.min(axis=0), points.max(axis=0)


FRAME = "M0,0 H200 V120 H0 Z"


@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_circles_are_found(noise: float) -> None:
    of = noisy(drawing(FRAME, circle(50, 60, 20), circle(140, 60, 25, 18)), noise)
    regular = found(of)
    assert kinds(regular) == [CIRCLES, CIRCLES]
    centres = sorted(tuple(np.round(item.centre)) for item in regular.items)
    assert centres == [(50.0, 60.0), (140.0, 60.0)]


def test_a_circle_that_no_command_closes_is_one() -> None:
    assert kinds(found(drawing(FRAME, circle(140, 60, 25, 18)[: -len(" Z")]))) == [CIRCLES]


@pytest.mark.parametrize("radii", [(25, 18), (20, 20)])
def test_a_circle_with_lines_to_its_centre_and_back_is_one_item(radii: tuple[float, float]) -> None:
    """So old files of Inkscape have their ellipses."""
    before = drawing(FRAME, circle(140, 60, *radii).replace(" Z", " L140,60 Z"))
    (item,) = found(before).items
    assert item.kind == CIRCLES and item.high - item.low == pytest.approx([2 * r for r in radii], rel=1e-3)


def test_circles_about_one_centre_are_one_item() -> None:
    regular = found(drawing(FRAME, circle(50, 60, 20), circle(50, 60, 12), circle(50, 60, 5)))
    assert len(regular.items) == 1 and regular.items[0].size == pytest.approx(2.0 * (20 + 12 + 5), rel=1e-3)


def test_most_of_a_circle_is_one_and_an_end_of_a_stroke_is_none() -> None:
    quarter = f"M70,60 C70,{60 + ARM * 20} {50 + ARM * 20},80 50,80 S30,{60 + ARM * 20} 30,60"
    three = quarter + f" S{50 - ARM * 20},40 50,40 L70,60 Z"
    assert kinds(found(drawing(FRAME, three))) == [CIRCLES]
    assert kinds(found(drawing(FRAME, quarter + " Z"))) == []


def test_random_curves_are_not_regular() -> None:
    rng = np.random.default_rng(7)
    for _ in range(60):
        angle = np.sort(rng.uniform(0, 2 * np.pi, 12))
        radius = rng.uniform(20, 55, 12)
        p = np.stack([100 + radius * np.cos(angle), 60 + radius * np.sin(angle)], axis=1)
        parts = [
            f"C{p[k, 0]},{p[k, 1]} {p[k + 1, 0]},{p[k + 1, 1]} {p[k + 2, 0]},{p[k + 2, 1]}" for k in (1, 4, 7)
        ]
        regular = found(drawing(FRAME, f"M{p[0, 0]},{p[0, 1]} {' '.join(parts)} Z"))
        assert kinds(regular) == []


FLAG = "M{0},{1} l12,0 l-4,7 l6,9 l-14,2 Z"


def test_copies_are_found_shifted_mirrored_and_turned() -> None:
    mirrored, turned = "M80,20 l-12,0 l4,7 l-6,9 l14,2 Z", "M140,30 l0,12 l-7,-4 l-9,6 l-2,-14 Z"
    other = "M100,80 l12,0 l-4,7 l6,14 l-14,2 Z"
    regular = found(drawing(FRAME, FLAG.format(20, 20), FLAG.format(40, 70), mirrored, turned, other))
    assert [len(one) for one in regular.sets] == [4]
    assert kinds(regular) == [COPIES] * 4


def test_what_is_larger_or_welded_is_no_copy() -> None:
    large = "M60,20 l24,0 l-8,14 l12,18 l-28,4 Z"
    assert found(drawing(FRAME, FLAG.format(20, 20), large)).sets == []
    # A pair of which one is welded to a wall.
    assert found(drawing(FRAME, FLAG.format(20, 20), FLAG.format(60, 120 - 18) + " M60,120 h14")).sets == []


def test_rows_and_columns_are_found() -> None:
    grid = [square(20 + 30 * i, 20 + 25 * j) for i in range(4) for j in range(3)]
    regular = found(drawing(FRAME, *grid))
    assert sorted(len(level.items) for level in regular.levels) == [3, 3, 3, 3, 4, 4, 4]
    assert sorted(spaced.axis for spaced in regular.spaced) == [0, 1]
    uneven = found(drawing(FRAME, square(20, 20), square(50, 20), square(90, 20)))
    assert [spaced.axis for spaced in uneven.spaced] == [] and len(uneven.levels) == 1


def test_rings_are_found() -> None:
    angle = np.arange(8) * np.pi / 4
    ring = [square(100 + 40 * np.cos(a) - 4, 60 + 40 * np.sin(a) - 4, 8) for a in angle]
    regular = found(drawing(FRAME, *ring))
    assert len(regular.rings) == 1 and regular.rings[0].centre == pytest.approx([100, 60], abs=1e-9)


WORD = [
    "M30,40 h4 v8 h6 v-8 h4 v20 h-4 v-8 h-6 v8 h-4 Z",
    "M48,40 h14 v4 h-5 v16 h-4 v-16 h-5 Z",
    "M66,40 h11 v4 h-7 v4 h5 v4 h-5 v4 h7 v4 h-11 Z",
    "M81,40 h4 v16 h6 v4 h-10 Z",
    "M94,40 h4 v20 h-4 Z",
]


def test_words_are_found() -> None:
    regular = found(drawing(FRAME, *WORD))
    assert kinds(regular) == [WORDS]
    assert regular.items[0].low == pytest.approx([30, 40]) and regular.items[0].high == pytest.approx(
        [98, 60]
    )
    # Equal squares in a row are windows, not letters.
    assert WORDS not in kinds(found(drawing(FRAME, *(square(30 + 14 * n, 40) for n in range(5)))))


# The right side drawn out, its upper corner farther than its lower one.
SKEWED = [
    pin(0, 0, "a"),
    pin(0, 120, "b"),
    drag((200, 0), (290, -20), "c"),
    drag((200, 120), (270, 120), "d"),
]


def test_wheels_stay_round_and_alike() -> None:
    before = drawing(FRAME, circle(50, 112, 18), circle(50, 112, 8), circle(150, 112, 18), handles=SKEWED)
    result = pipeline.reshape(before)
    radii = []
    for shape in (1, 2, 3):
        control = of_shape(result, before, shape)
        assert out_of_round(control) < 5e-3
        low, high = box_of(control)
        radii.append(float(np.ptp([low, high], axis=0).mean()))
    assert radii[0] == pytest.approx(radii[2], rel=0.01)
    # Without, they are not: the test can fail.
    without = pipeline.reshape(before, NONE)
    assert max(out_of_round(of_shape(without, before, shape)) for shape in (1, 2, 3)) > 5e-3


def test_windows_stay_in_rows_of_one_size() -> None:
    grid = [square(30 + 30 * i, 25 + 25 * j) for i in range(4) for j in range(3)]
    before = drawing(FRAME, *grid, handles=SKEWED)

    def centres(result: pipeline.Result) -> tuple[Array, Array]:
        boxes = [box_of(of_shape(result, before, 1 + n)) for n in range(12)]
        sizes = np.array([high - low for low, high in boxes])
        return np.array([(low + high) / 2.0 for low, high in boxes]).reshape(4, 3, 2), sizes

    places, sizes = centres(pipeline.reshape(before))
    assert np.ptp(places[:, :, 0], axis=1).max() < 1e-3 * before.diagonal
    assert np.ptp(places[:, :, 1], axis=0).max() < 1e-3 * before.diagonal
    gaps = np.diff(places[:, 0, 0])
    assert np.ptp(gaps) < 0.02 * gaps.mean()
    assert np.ptp(sizes, axis=0).max() < 0.01 * sizes.max()
    places, sizes = centres(pipeline.reshape(before, NONE))
    assert np.ptp(places[:, :, 1], axis=0).max() > 1e-3 * before.diagonal


def test_words_keep_their_gaps_and_their_line() -> None:
    before = drawing(FRAME, *WORD, handles=SKEWED)
    result = pipeline.reshape(before)
    boxes = [box_of(of_shape(result, before, 1 + n)) for n in range(5)]
    bottoms = np.array([high[1] for _, high in boxes])
    gaps = np.array([b[0][0] - a[1][0] for a, b in zip(boxes, boxes[1:])])
    assert np.ptp(bottoms) < 1e-3 * before.diagonal
    assert gaps / gaps[0] == pytest.approx([1.0, 1.0, 1.0, 0.75], rel=0.02)


def test_handles_come_first() -> None:
    """A handle on each side of a wheel makes an oval; one on a window of a row moves that window alone."""
    sides = [drag((30, 60), (20, 60)), drag((70, 60), (95, 60)), pin(50, 40), pin(50, 80)]
    before = drawing(FRAME, circle(50, 60, 20), handles=[pin(0, 60), pin(200, 60), *sides])
    control = of_shape(pipeline.reshape(before), before, 1)
    low, high = box_of(control)
    assert low[0] == pytest.approx(20, abs=1e-3) and high[0] == pytest.approx(95, abs=1e-3)
    assert out_of_round(control) > 0.1

    row = [square(30 + 30 * n, 50) for n in range(4)]
    held = [pin(0, 0), pin(200, 0), pin(0, 120), pin(200, 120), drag((60, 50), (60, 30))]
    before = drawing(FRAME, *row, handles=held)
    result = pipeline.reshape(before)
    tops = [box_of(of_shape(result, before, 1 + n))[0][1] for n in range(4)]
    assert tops[1] == pytest.approx(30, abs=1e-3)
    others = [tops[0], tops[2], tops[3]]
    assert np.ptp(others) < 1e-3 * before.diagonal and min(others) > 35


def test_a_stretch_of_everything_is_that_stretch() -> None:
    grid = [square(30 + 30 * i, 25 + 25 * j) for i in range(4) for j in range(3)]
    corners = [(0.0, 0.0), (200.0, 0.0), (0.0, 120.0), (200.0, 120.0)]
    corners += [(30.0 + 30 * i + c, 25.0 + 25 * j + c) for i in range(4) for j in range(3) for c in (0, 10)]
    held = [drag(at, (2.0 * at[0], 0.8 * at[1])) for at in corners]
    before = drawing(FRAME, *grid, handles=held)
    result = pipeline.reshape(before)
    assert result.refitted.control == pytest.approx(before.control * [2.0, 0.8], abs=1e-5 * before.diagonal)


def test_nothing_moved_is_nothing_changed() -> None:
    before = noisy(drawing(FRAME, circle(50, 60, 20), *WORD, square(120, 80), square(150, 80)), 1e-4)
    held = tuple(pin(*before.control[n, 0]) for n in (0, 1, 2))
    before = Drawing(before.control, before.line, before.following, before.shape, before.names, held)
    assert np.array_equal(pipeline.reshape(before).refitted.control, before.control)


MIRRORED = "M100,10 C130,10 150,40 150,70 L160,100 L100,110 L40,100 L50,70 C50,40 70,10 100,10 Z"


def mirrored(points: Array, axis: float) -> Array:
    return np.stack([2.0 * axis - points[..., 0], points[..., 1]], axis=-1)


@pytest.mark.parametrize("lift", [20.0, 60.0])
def test_a_symmetric_drawing_stays_symmetric(lift: float) -> None:
    eyes = [circle(80, 60, 8), circle(120, 60, 8), "M85,85 C90,95 110,95 115,85", "M100,65 l5,12 l-10,0 Z"]
    sides = [drag((40, 100), (25, 100)), drag((160, 100), (175, 100))]
    held: list[Handle] = [pin(100, 110), drag((100, 10), (100, 10 - lift)), *sides]
    before = drawing(MIRRORED, *eyes, handles=held)
    control = pipeline.reshape(before).refitted.control
    nodes = np.concatenate([control[:, 0], control[:, 3]])
    away = np.linalg.norm(nodes[:, None] - mirrored(nodes, 100.0)[None], axis=2).min(axis=1)
    assert away.max() < 1e-6 * before.diagonal
    arms = np.concatenate([control[:, 1], control[:, 2]])
    away = np.linalg.norm(arms[:, None] - mirrored(arms, 100.0)[None], axis=2).min(axis=1)
    assert away.max() < 1e-6 * before.diagonal


def test_reflections_are_found_where_all_samples_have_partners() -> None:
    points = np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 1.0], [2.0, 1.0], [1.0, 3.0]])
    (mirror,) = symmetry.find(points)
    assert mirror.axis == 0 and mirror.partner.tolist() == [1, 0, 3, 2, 4]
    held = np.array([0, 1])
    assert mirror.suits(held, np.array([[1.0, 2.0], [-1.0, 2.0]]), 1.0)
    assert not mirror.suits(held, np.array([[1.0, 2.0], [1.0, 2.0]]), 1.0)
    assert not mirror.suits(np.array([0]), np.array([[1.0, 2.0]]), 1.0)
    moves = np.arange(10.0).reshape(5, 2)
    mean = mirror.mean(moves)
    assert mean == pytest.approx(mean[mirror.partner] * [-1.0, 1.0])
    assert symmetry.find(points + np.array([[0, 0], [0, 0], [0, 0], [0, 0], [0.1, 0]])) == []


# --- lines ----------------------------------------------------------------------------------------


def test_lines_stay_straight_where_ties_pull_at_them() -> None:
    """Bars from wall to wall go up with the top of a wall, and pulled its base along."""
    wall = "M0,0 H300 V200 H0 Z"
    windows = [square(20 + 55 * i, 20 + 45 * j, 30) for i in range(5) for j in range(4)]
    bars = [f"M0,{y:g} H300" for y in np.arange(12.0, 180.0, 22.0)]
    handles = (pin(0, 200), pin(300, 200), drag((0, 0), (0, -40)), drag((300, 0), (300, -40)))
    before = drawing(wall, *windows, *bars, handles=handles)
    bow = []
    for options in (pipeline.Options(), NONE):
        control = of_shape(pipeline.reshape(before, options), before, 0)
        base = control[control[..., 1].min(axis=1) > 190.0]
        bow.append(float(np.abs(base[..., 1] - 200.0).max()))
    assert bow[0] < 5e-4 * before.diagonal < bow[1]


def test_a_window_that_two_handles_size_leaves_the_others_alone() -> None:
    windows = [square(20 + 40 * i, 40) for i in range(4)]
    handles = (pin(0, 0), pin(200, 120), pin(20, 40), drag((30, 50), (31, 51)))
    before = drawing(FRAME, *windows, handles=handles)
    result = pipeline.reshape(before, pipeline.Options())
    sizes = [np.ptp(np.array(box_of(of_shape(result, before, n))), axis=0) for n in range(1, 5)]
    assert sizes[0] == pytest.approx([11.0, 11.0], abs=1e-2)
    assert np.array(sizes[1:]) == pytest.approx(10.0, abs=0.02)


def test_rows_of_a_set_are_put_in_line_together_or_not_at_all() -> None:
    """Some rows alone of a grid that handles bend would cross the others."""
    of = drawing(FRAME, *(square(20 + 40 * i, 20 + 50 * j) for i in range(4) for j in range(2)))
    regular = found(of)
    points = sampled(of, 0.01 * of.diagonal)[1].points
    upper = [item for item in regular.items if item.centre[1] < 50.0]
    for lift, lined in ((1.0, True), (40.0, False)):
        moved = points.copy()
        for n, item in enumerate(upper):
            moved[item.samples, 1] += n % 2
        (last,) = (item for item in regular.items if np.allclose(item.centre, (145.0, 75.0)))
        moved[last.samples, 1] += lift
        nobody = np.zeros(0, dtype=int)
        at, where = keep.places(regular, points, moved, nobody, np.zeros((0, 2)))
        levels = {float(np.round(where[np.isin(at, item.samples), 1].mean(), 9)) for item in upper if len(at)}
        assert (levels == {25.5}) == lined
