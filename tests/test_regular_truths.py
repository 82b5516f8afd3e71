# SPDX-License-Identifier: GPL-2.0-or-later
"""Of every kind of regularity: kept under random edits, let go where handles contradict, found in spite of
noise, not found in random curves.

`SCENES` has a drawing or more for every kind.  A new kind is one more entry.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Callable, Sequence

import numpy as np
import pytest
from builders import drag, drawing, pin, sampled
from scipy.spatial import cKDTree
from test_regular import (
    ARM,
    FRAME,
    MIRRORED,
    NONE,
    WORD,
    box_of,
    circle,
    found,
    mirrored,
    noisy,
    of_shape,
    square,
)

from alup.geometry import bezier
from alup.geometry.connected_components import components
from alup.model import Drawing, Handle
from alup.regular import find, shapes, symmetry
from alup.regular.find import CIRCLES, COPIES, LINES, ROWS, WORDS, Regular
from alup.regular.symmetry import SYMMETRY
from alup.session import pipeline

Array = np.ndarray
Control = Sequence[Array]  # of each shape, (k, 4, 2)

EDITS = 10

# Handles are moved by up to this, of the diagonal.
FARTHEST = 0.2

# What is asked for.  Of the radius, of the size, of the diagonal, of the mean gap, of the diagonal.
ROUND, SIZES, LINE, GAPS, MIRROR = 5e-3, 1e-2, 1e-3, 2e-2, 1e-6

# Degrees between parallel lines, an angle that an eye does not see; of the diagonal.
PARALLEL, PART = 0.2, 1e-3

# Of the user units: handles are met this exactly.
MET = 1e-3


@dataclass(frozen=True)
class Scene:
    """parts : path data beside the frame, which is shape 0
    off : how far the control points of all shapes are from what is asked for, as a part of it, by name
    contrary : handles that contradict what is regular
    gives_in : whether the control points of all shapes show that handles came first
    figures : what is found, by the name of a field of `Regular`
    """

    kind: str
    parts: tuple[str, ...]
    off: Callable[[Control, float], dict[str, float]]
    contrary: tuple[Handle, ...]
    gives_in: Callable[[Control, float], bool]
    figures: dict[str, int]
    frame: str = FRAME

    def drawing(self, *handles: Handle) -> Drawing:
        return drawing(self.frame, *self.parts, handles=handles)


# --- measures, by other means than the code under test ------------------------------------------


def curve(control: Array) -> Array:
    return bezier.evaluate(control[:, None], np.linspace(0.0, 1.0, 9)[None, :]).reshape(-1, 2)


def centre_of(control: Array) -> Array:
    return np.mean(box_of(control), axis=0)


def size_of(control: Array) -> Array:
    low, high = box_of(control)
    return np.asarray(high - low)


def spread(values: Array) -> float:
    """The greatest difference, of the mean."""
    return float(np.ptp(values) / np.mean(values))


def roundness(control: Array, radii: tuple[float, float] = (1.0, 1.0), curved: slice = slice(None)) -> float:
    """The greatest distance from the best ellipse of these proportions, of its radius."""
    points = curve(control[curved]) / radii
    middle, radius = shapes.circle(points)
    return float(np.abs(np.linalg.norm(points - middle, axis=1) - radius).max() / radius)


def round_(
    control: Control, _: float, radii: tuple[float, float] = (1.0, 1.0), curved: slice = slice(None)
) -> dict[str, float]:
    return {"round": roundness(control[1], radii, curved) / ROUND}


def alike(control: Control, _: float, turned: Sequence[int] = ()) -> dict[str, float]:
    """Sizes of all parts; of those that are turned by a right angle, height and width change places."""
    sizes = [size_of(one)[:: -1 if n in turned else 1] for n, one in enumerate(control)][1:]
    return {"sizes": max(spread(along) for along in np.transpose(sizes)) / SIZES}


def wheels(control: Control, diagonal: float) -> dict[str, float]:
    round_ones = max(roundness(one) for one in control[1:])
    return {**alike(control, diagonal), "round": round_ones / ROUND}


def grid(control: Control, diagonal: float, columns: int, rows: int) -> dict[str, float]:
    """Parts column by column: on their lines, with equal gaps, of one size."""
    places = np.array([centre_of(one) for one in control[1:]]).reshape(columns, rows, 2)
    off = alike(control, diagonal)
    for axis in (0, 1):
        line = np.moveaxis(places[..., axis], axis, 0)  # (lines, along)
        if line.shape[1] > 1:
            middle = line.mean(axis=1, keepdims=True)
            off[f"line {axis}"] = float(np.abs(line - middle).max()) / (LINE * diagonal)
        if len(line) > 2:
            off[f"gaps {axis}"] = spread(np.diff(line.mean(axis=1))) / GAPS
    return off


def ring(control: Control, diagonal: float) -> dict[str, float]:
    centres = np.array([centre_of(one) for one in control[1:]])
    middle, radius = shapes.circle(centres)
    away = centres - middle
    angle = np.unwrap(np.arctan2(away[:, 1], away[:, 0]))
    return {
        **alike(control, diagonal),
        "circle": float(np.abs(np.linalg.norm(away, axis=1) - radius).max()) / (LINE * diagonal),
        "gaps": spread(np.diff(angle)) / GAPS,
    }


def word(control: Control, diagonal: float) -> dict[str, float]:
    boxes = [box_of(one) for one in control[1:]]
    bottoms = np.array([high[1] for _, high in boxes])
    gaps = np.array([b[0][0] - a[1][0] for a, b in zip(boxes, boxes[1:])]) / [4.0, 4.0, 4.0, 3.0]
    return {
        "line": float(np.abs(bottoms - bottoms.mean()).max()) / (LINE * diagonal),
        "gaps": spread(gaps) / GAPS,
    }


def turns(control: Control, parts: Sequence[int], of: Sequence[Array]) -> Array:
    """Angles by which the straight sides of some parts have turned, degrees."""
    after, before = (np.concatenate([one[n][:, 3] - one[n][:, 0] for n in parts]) for one in (control, of))
    return np.degrees(np.angle((after @ [1.0, 1.0j]) * np.conj(before @ [1.0, 1.0j])))


def straight(control: Control, diagonal: float, of: Sequence[Array]) -> dict[str, float]:
    """Two boxes on one level with a slanting band beside them: sides parallel, in line and of one length."""
    sides = turns(control, (1, 2), of)
    band = turns(control, (3,), of)[[0, 2]]
    low = [box_of(one)[1][1] for one in control[1:3]]
    length = np.linalg.norm(control[3][[0, 2], 3] - control[3][[0, 2], 0], axis=1)
    return {
        "parallel": float(np.ptp(sides)) / PARALLEL,
        "band": float(np.ptp(band)) / PARALLEL,
        "line": float(np.ptp(low)) / 2.0 / (LINE * diagonal),
        "length": spread(length) / SIZES,
    }


def only_first_turned(control: Control, _: float, of: Sequence[Array]) -> bool:
    """The side of the first box with handles has turned, the second box has not."""
    first, second = (turns(control, (n,), of) for n in (1, 2))
    return bool(abs(first[0]) > 5.0 and np.ptp(second) <= PARALLEL)


def mirrored_part(control: Control, diagonal: float) -> dict[str, float]:
    """The first part is symmetric about an axis of its own: the perpendicular bisector of its foot."""
    foot = min(control[1], key=lambda cubic: abs(cubic[3, 1] - cubic[0, 1]))  # nodes may have been added
    axis = (foot[3] - foot[0]) / np.linalg.norm(foot[3] - foot[0])
    points = bezier.evaluate(control[1][:, None], np.linspace(0.0, 1.0, 200)[None]).reshape(-1, 2)
    points = points - (foot[0] + foot[3]) / 2.0
    away = cKDTree(points).query(points - 2.0 * np.outer(points @ axis, axis))[0]
    return {"part": float(away.max()) / (PART * diagonal)}


def symmetric(control: Control, diagonal: float) -> dict[str, float]:
    whole = np.concatenate(list(control))
    off = {}
    for name, ends in (("nodes", (0, 3)), ("arms", (1, 2))):
        points = np.concatenate([whole[:, k] for k in ends])
        image = mirrored(points, 100.0)
        away = np.linalg.norm(points[:, None] - image[None], axis=2).min(axis=1)
        off[name] = float(away.max()) / (MIRROR * diagonal)
    return off


# --- the scenes ---------------------------------------------------------------------------------


def wide(control: Control, _: float) -> bool:
    """The first part has become wider than it is high, by a half at least."""
    width, height = size_of(control[1])
    return bool(width > 1.5 * height)


def second_left(control: Control, diagonal: float, off: Callable[[Control, float], dict[str, float]]) -> bool:
    """The second part is not as the others are, which still are alike."""
    rest = [*control[:2], *control[3:]]
    return off(control, diagonal)["sizes"] > 5.0 and off(rest, diagonal)["sizes"] <= 1.0


def second_out_of_line(control: Control, diagonal: float, axis: int = 1) -> bool:
    """The second part is off the line of the others, which still are on one."""
    others = [centre_of(one)[axis] for n, one in enumerate(control) if n not in (0, 2)]
    away = abs(centre_of(control[2])[axis] - np.mean(others))
    return bool(np.ptp(others) <= 2.0 * LINE * diagonal and away > 20.0 * LINE * diagonal)


def only_second_moved(control: Control, diagonal: float, off: Callable[..., dict[str, float]]) -> bool:
    """A ring of which one part was pulled out, and the others still are on a circle."""
    rest = [*control[:2], *control[3:]]
    return off(control, diagonal)["circle"] > 5.0 and off(rest, diagonal)["circle"] <= 1.0


def off_by(control: Control, diagonal: float, off: Callable[..., dict[str, float]], name: str) -> bool:
    return off(control, diagonal)[name] > 5.0


CORNERS = (pin(0, 0), pin(200, 0), pin(200, 120), pin(0, 120))


def sides(x: float, y: float, rx: float, ry: float) -> tuple[Handle, ...]:
    """Handles that ask an ellipse to be much wider."""
    out = [drag((x - rx, y), (x - 1.5 * rx, y)), drag((x + rx, y), (x + 2.0 * rx, y))]
    return (*out, pin(x, y - ry), pin(x, y + ry), pin(0, 0), pin(200, 0))


# Three quarters of a circle.  The frame crosses it, as it does the whole ones: else nothing would bend them.
ARC = (
    f"M85,100 C85,{100 + ARM * 25} {60 + ARM * 25},125 60,125 S35,{100 + ARM * 25} 35,100 "
    f"S{60 - ARM * 25},75 60,75 L85,100 Z"
)
FLAG = "M{0},{1} l24,0 l-8,14 l12,18 l-28,4 Z"
# Shifted, mirrored, turned; near enough to the frame to be bent by it.
FLAGS = (
    FLAG.format(6, 6),
    FLAG.format(6, 78),
    "M194,6 l-24,0 l8,14 l-12,18 l28,4 Z",
    "M194,86 l0,24 l-14,-8 l-18,12 l-4,-28 Z",
)
# The upper side of the second flag is drawn out to a slope.
FLAG_DRAWN = (drag((6, 78), (6, 66)), drag((30, 78), (50, 78)), pin(34, 110), pin(6, 114), pin(200, 0))
RING = tuple(
    square(100 + 40 * np.cos(a) - 4, 60 + 40 * np.sin(a) - 4, 8) for a in np.arange(8) * np.pi / 4 + 0.1
)
RING_AT = (100 + 40 * np.cos(np.pi / 4 + 0.1) - 4, 60 + 40 * np.sin(np.pi / 4 + 0.1) - 4)
FACE = (circle(80, 60, 8), circle(120, 60, 8), "M85,85 C90,95 110,95 115,85", "M100,65 l5,12 l-10,0 Z")
PLATE = "M24,34 H104 V66 H24 Z"
ROW = tuple(square(20 + 45 * n, 47, 25) for n in range(4))
COLUMN = tuple(square(85, 6 + 38 * n, 30) for n in range(3))
WINDOWS = tuple(square(30 + 30 * i, 25 + 25 * j) for i in range(4) for j in range(3))

BOXES = ("M36,50 H92 V90 H36 Z", "M108,60 H164 V90 H108 Z", "M168,88 L178,48 L188,48 L178,88 Z")
BOXES_BEFORE = [drawing(FRAME, *BOXES).control[4 * n : 4 * n + 4] for n in range(4)]
VASE = "M24,8 C34,28 46,38 36,60 L12,60 C2,38 14,28 24,8 Z"

SCENES = {
    "circle": Scene(
        CIRCLES, (circle(60, 100, 25),), round_, sides(60, 100, 25, 25), wide, {"items": 1},
    ),
    "ellipse": Scene(
        CIRCLES, (circle(60, 110, 36, 28),), partial(round_, radii=(36.0, 28.0)),
        sides(60, 110, 36, 28),
        lambda control, _: bool(np.divide(*size_of(control[1])) > 1.5 * 36 / 28), {"items": 1},
    ),
    "arc": Scene(
        CIRCLES, (ARC,), partial(round_, curved=slice(0, 3)),
        sides(60, 100, 25, 25), wide,
        {"items": 1},
    ),
    "wheels": Scene(
        CIRCLES, (circle(45, 112, 30), circle(155, 112, 30)), wheels, sides(45, 112, 30, 30), wide,
        {"items": 2, "sets": 1, "levels": 1},
    ),
    "copies": Scene(
        COPIES, FLAGS, partial(alike, turned=(4,)), FLAG_DRAWN,
        partial(second_left, off=lambda control, d: alike(control, d, (len(control) - 1,))),
        {"items": 4, "sets": 1, "levels": 2},
    ),
    "row": Scene(
        ROWS, ROW, partial(grid, columns=4, rows=1), (*CORNERS, drag((65, 47), (65, 20))), second_out_of_line,
        {"items": 4, "sets": 1, "levels": 1, "spaced": 1},
    ),
    "column": Scene(
        ROWS, COLUMN, partial(grid, columns=1, rows=3), (*CORNERS, drag((85, 44), (50, 44))),
        partial(second_out_of_line, axis=0), {"items": 3, "sets": 1, "levels": 1, "spaced": 1},
    ),
    "rows and columns": Scene(
        ROWS, WINDOWS, partial(grid, columns=4, rows=3), (*CORNERS, drag((30, 50), (12, 50))),
        lambda control, diagonal: second_out_of_line(control[:4], diagonal, 0),
        {"items": 12, "sets": 1, "levels": 7, "spaced": 2},
    ),
    "ring": Scene(
        ROWS, RING, ring, (*CORNERS, drag(RING_AT, (RING_AT[0] + 15, RING_AT[1] + 12))),
        partial(only_second_moved, off=ring), {"items": 8, "sets": 1, "rings": 1},
    ),
    "word": Scene(
        WORDS, tuple(WORD), word, (pin(30, 60), drag((57, 60), (57, 75)), pin(98, 60)),
        partial(off_by, off=word, name="line"), {"items": 1}, PLATE,
    ),
    "lines": Scene(
        LINES, BOXES, partial(straight, of=BOXES_BEFORE),
        (*CORNERS, pin(36, 50), drag((92, 50), (94, 42)), pin(108, 60), pin(164, 90)),
        partial(only_first_turned, of=BOXES_BEFORE), {"lines": 16},
    ),
    "mirrored part": Scene(
        SYMMETRY, (VASE, square(150, 30, 30)), mirrored_part,
        (*CORNERS, drag((36, 60), (50, 66)), pin(12, 60), pin(24, 8)),
        partial(off_by, off=mirrored_part, name="part"), {"parts": 5},
    ),
    "symmetry": Scene(
        SYMMETRY, FACE, symmetric, (pin(100, 110), drag((40, 100), (15, 90)), pin(160, 100)),
        partial(off_by, off=symmetric, name="nodes"), {"parts": 7}, MIRRORED,
    ),
}  # fmt: skip

every_scene = pytest.mark.parametrize("name", SCENES)


def test_every_kind_has_a_scene() -> None:
    assert {scene.kind for scene in SCENES.values()} == set(find.KINDS)


# --- kept ---------------------------------------------------------------------------------------


def edits(scene: Scene) -> list[list[Handle]]:
    """Handles on the frame: three or four of them, at random places, of which two or more go somewhere."""
    rng = np.random.default_rng(18)
    before = scene.drawing()
    reach = FARTHEST * before.diagonal
    result = []
    for _ in range(EDITS):
        number = int(rng.integers(3, 5))
        edge = before.control[before.shape == 0]
        # One on each of some sides: two that are near to each other would contradict.
        side = rng.choice(len(edge), size=number, replace=False)
        rest = bezier.evaluate(edge[side], rng.uniform(0.1, 0.9, number))
        angle, way = rng.uniform(0.0, 2.0 * np.pi, number), rng.uniform(0.0, reach, number)
        to = rest + way[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        moved = rng.permutation(number) >= number - 2
        handles = [
            drag(a, b, f"h{n}") if moves else pin(float(a[0]), float(a[1]), f"h{n}")
            for n, (a, b, moves) in enumerate(zip(rest, to, moved))
        ]
        if scene.kind == SYMMETRY:
            image = [
                replace(
                    one,
                    name=one.name + "'",
                    rest=mirrored(one.rest, 100.0),
                    target=None if one.target is None else mirrored(one.target, 100.0),
                )
                for one in handles[:2]
            ]
            handles = [*handles[:2], *image]
        result.append(handles)
    return result


def solved(before: Drawing, options: pipeline.Options | None = None) -> Control:
    result = pipeline.reshape(before, options or pipeline.Options())
    return [of_shape(result, before, shape) for shape in range(len(before.names))]


@every_scene
def test_it_is_kept_under_random_edits(name: str) -> None:
    """No part is so near to the frame that it bends it by more than `keep.BENT`: it would be let go."""
    scene = SCENES[name]
    comes_by_itself = True
    for number, handles in enumerate(edits(scene)):
        before = scene.drawing(*handles)
        off = scene.off(solved(before), before.diagonal)
        assert max(off.values()) <= 1.0, (number, off)
        if comes_by_itself:
            comes_by_itself = max(scene.off(solved(before, NONE), before.diagonal).values()) <= 1.0
    assert not comes_by_itself


# --- let go -------------------------------------------------------------------------------------


@every_scene
def test_handles_that_contradict_come_first(name: str) -> None:
    scene = SCENES[name]
    before = scene.drawing(*scene.contrary)
    control = solved(before)
    assert scene.gives_in(control, before.diagonal)
    points = np.concatenate([curve(one) for one in control])
    for handle in scene.contrary:
        target = handle.rest if handle.target is None else handle.target
        nodes = np.concatenate([points, *(one[:, 0] for one in control)])
        assert np.linalg.norm(nodes - target, axis=1).min() <= MET, handle.name


# --- found, or not ------------------------------------------------------------------------------


def counts(of: Regular) -> dict[str, int]:
    numbers = {one.name: len(getattr(of, one.name)) for one in fields(of)}
    return {name: number for name, number in numbers.items() if number}


def mirrored_parts(of: Drawing) -> list[symmetry.Part]:
    samples = sampled(of, 0.01 * of.diagonal)[1]
    return symmetry.parts(samples.points, components(samples.edges, len(samples.points))[1])


def mirrors(of: Drawing) -> int:
    return len(symmetry.find(sampled(of, 0.01 * of.diagonal)[1].points))


@every_scene
@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_it_is_found_in_spite_of_noise(name: str, noise: float) -> None:
    scene = SCENES[name]
    for seed in range(5 if noise else 1):
        of = noisy(scene.drawing(), noise, seed)
        if scene.kind == SYMMETRY:
            assert mirrors(of) == (name == "symmetry"), seed
            assert len(mirrored_parts(of)) == scene.figures.get("parts", 0), seed
        else:
            figures = counts(found(of))
            assert {field: figures.get(field) for field in scene.figures} == scene.figures, seed


def blob(rng: np.random.Generator, at: Array, size: float) -> str:
    """A closed curve of three to six cubics, of which every node has its own arms."""
    number = 3 * int(rng.integers(3, 7))
    angle = np.sort(rng.uniform(0, 2 * np.pi, number))
    radius = rng.uniform(0.35, 1.0, number) * size
    p = at + np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    p = np.append(p, p[:1], axis=0)
    parts = [" ".join(f"{x},{y}" for x, y in p[k : k + 3]) for k in range(1, number, 3)]
    return f"M{p[0, 0]},{p[0, 1]} " + " ".join(f"C{part}" for part in parts) + " Z"


@pytest.mark.parametrize("number", [1, 3, 9])
def test_nothing_is_found_in_random_curves(number: int) -> None:
    rng = np.random.default_rng(number)
    for drawn in range(60):
        places = rng.uniform((20.0, 20.0), (180.0, 100.0), (number, 2))
        of = drawing(*(blob(rng, at, rng.uniform(4.0, 20.0)) for at in places))
        assert counts(found(of)) == {}, drawn
        assert mirrors(of) == 0, drawn
