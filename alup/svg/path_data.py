# SPDX-License-Identifier: GPL-2.0-or-later
"""SVG path data <-> cubic segments, strictly and at full precision.

inkex silently drops what follows a bad token, cannot read the compact arc flags that optimisers write
(`a1 1 0 01.5.5`), and prints six digits.  This reader follows the grammar of SVG 1.1 section 8.3.9 and
reports what it cannot read.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Iterator, Tuple

import numpy as np

from ..geometry.arrays import Array
from ..messages.errors import DocumentError
from ..messages.language import translate as _

LINE, CURVE, ARC, CLOSE = range(4)

Point = Tuple[float, float]

# An arc's tangents at its ends may differ by this angle, in radians, from those of the cubics that it
# replaces.  Smooth nodes beside it then stay smooth.
ARC_ANGLE = math.radians(0.1)

# Decimals of an arc's rotation in degrees; a change by 1e-9 degrees moves an ellipse by 1e-11 of its size.
ROTATION_DECIMALS = 9

# Greater coordinates are refused.  An arc with smaller radii, or with ends nearer to each other, is read as a
# line.  Between these limits the squares and quotients of an arc neither overflow nor underflow.
LARGEST_NUMBER, SMALLEST_ARC = 1e30, 1e-100

# An arc may exceed whole quarter turns by this part of a quarter before one more cubic is used: coordinates
# are rounded.
ROUNDED_QUARTERS = 1e-4

# If relative commands end a subpath this near to its start, in the path's own units, Inkscape (lib2geom)
# moves the end to the start, so that `z` draws no line.
CLOSED_BY = 1e-6

_NUMBER = re.compile(r"[\s,]*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)")
_FLAG = re.compile(r"[\s,]*([01])")
_COMMAND = re.compile(r"[\s,]*([MmLlHhVvCcSsQqTtAaZz])")
_REST = re.compile(r"[\s,]*$")
_ARGUMENTS = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}


@dataclass(frozen=True)
class Subpath:
    """One subpath: the connected segments after an `M`.

    control : (k, 4, 2) control points, in the path's own coordinates
    kind : (k,) LINE, CURVE, ARC or CLOSE (the line that `z` draws)
    arc : (k,) index into `arcs` of the arc command that the segment is part of, or -1
    arcs : (a, 5) rx, ry, rotation in degrees, large-arc flag, sweep flag
    closed : ends in `z`
    start : (2,) the point of `M`
    """

    control: Array
    kind: Array
    arc: Array
    arcs: Array
    closed: bool
    start: Array


def parse(d: str) -> tuple[Subpath, ...]:
    """Read path data.  Raises DocumentError with the position of what cannot be read."""
    subpaths: list[Subpath] = []
    run = _Run((0.0, 0.0))
    begun_relative = drawn_relative = False
    for letter, relative, numbers in _commands(d):
        x, y = run.point
        ox, oy = (x, y) if relative else (0.0, 0.0)
        if letter == "M":
            if run.begun:
                subpaths.append(run.finish(False))
            run = _Run((ox + numbers[0], oy + numbers[1]))
            run.begun = True
            begun_relative = relative
            continue
        if not run.begun:  # after z without M a new subpath begins where the last one did
            run.begun = True
        if letter == "Z":
            if drawn_relative or begun_relative:
                run.snap()
            subpaths.append(run.finish(True))
            run = _Run(run.start)
        elif letter == "L":
            run.line((ox + numbers[0], oy + numbers[1]))
        elif letter == "H":
            run.line((ox + numbers[0], y))
        elif letter == "V":
            run.line((x, oy + numbers[0]))
        elif letter == "A":
            run.arc_to(numbers[:5], (ox + numbers[5], oy + numbers[6]))
        else:
            points = [(ox + px, oy + py) for px, py in zip(numbers[::2], numbers[1::2])]
            run.smooth_curve(letter, points)
        drawn_relative = relative
    if run.begun:
        subpaths.append(run.finish(False))
    return tuple(subpaths)


def _commands(d: str) -> Iterator[tuple[str, bool, list[float]]]:
    """Capital letter, whether relative, and numbers of every command, implicit repetitions made explicit."""
    at = 0
    letter, first = "", True
    while True:
        if _REST.match(d, at):
            return
        found = _COMMAND.match(d, at)
        if found:
            letter, at = found.group(1), found.end()
            if first and letter not in "Mm":
                raise DocumentError(_unreadable(d, found.start(1), _("path data begins with M")))
            first = False
        elif not letter or letter in "Zz":
            raise DocumentError(_unreadable(d, at, _("a command letter is expected")))
        numbers: list[float] = []
        upper = letter.upper()
        for n in range(_ARGUMENTS[upper]):
            pattern = _FLAG if upper == "A" and n in (3, 4) else _NUMBER
            found = pattern.match(d, at)
            if not found:
                why = _("{command} takes {count} numbers").format(command=upper, count=_ARGUMENTS[upper])
                raise DocumentError(_unreadable(d, at, why))
            numbers.append(float(found.group(1)))
            if abs(numbers[-1]) > LARGEST_NUMBER:
                raise DocumentError(_unreadable(d, found.start(1), _("the number is too large")))
            at = found.end()
        yield upper, letter.islower(), numbers
        if upper == "M":  # further pairs are lines
            letter = "l" if letter == "m" else "L"


def _unreadable(d: str, at: int, why: str) -> str:
    return _("its path data can't be read at character {position} (\u201c{text}\u201d): {why}").format(
        position=at + 1, text=d[at : at + 12].strip(), why=why
    )


class _Run:
    """A subpath that is being read."""

    def __init__(self, start: Point):
        self.start = self.point = start
        self.begun = False
        self.control: list[float] = []  # flat: one small array for each segment took most of the time
        self.kind: list[int] = []
        self.arc: list[int] = []
        self.arcs: list[tuple[float, ...]] = []
        self.handle = ""  # the letter whose last control point a smooth command mirrors
        self.last = start

    def _add(self, a: Point, b: Point, end: Point, kind: int, arc: int = -1) -> None:
        """Append a segment from the current point; a, b, end are its other control points."""
        self.control += (*self.point, *a, *b, *end)
        self.kind.append(kind)
        self.arc.append(arc)
        self.point = end
        self.handle = ""

    def line(self, end: Point, kind: int = LINE) -> None:
        (x, y), (dx, dy) = self.point, (end[0] - self.point[0], end[1] - self.point[1])
        third, two = 1.0 / 3.0, 2.0 / 3.0
        self._add((x + third * dx, y + third * dy), (x + two * dx, y + two * dy), end, kind)

    def smooth_curve(self, letter: str, points: list[Point]) -> None:
        """Append C, S, Q or T with absolute points; S and T mirror the last control point before."""
        x, y = self.point
        family = "C" if letter in "CS" else "Q"
        if letter in "ST":
            mirrored = (2 * x - self.last[0], 2 * y - self.last[1]) if self.handle == family else (x, y)
            points = [mirrored, *points]
        end, last = points[-1], points[-2]
        if family == "C":
            a, b = points[0], last
        else:  # degree elevation
            a = (x + 2 * last[0]) / 3, (y + 2 * last[1]) / 3
            b = (end[0] + 2 * last[0]) / 3, (end[1] + 2 * last[1]) / 3
        self._add(a, b, end, CURVE)
        self.handle, self.last = family, last

    def arc_to(self, shape: list[float], end: Point) -> None:
        """Append an arc; by SVG 1.1 F.6.2 a zero radius gives a line, and an arc to its start nothing."""
        rx, ry, rotation, large, sweep = abs(shape[0]), abs(shape[1]), shape[2], shape[3] != 0, shape[4] != 0
        if end == self.point:
            return
        if min(rx, ry, math.dist(end, self.point)) <= SMALLEST_ARC:
            self.line(end)
            return
        pieces = arc_to_cubics(np.array(self.point), rx, ry, rotation, large, sweep, np.array(end))
        self.arcs.append((rx, ry, rotation, float(large), float(sweep)))
        for _start, a, b, to in pieces.tolist():
            self._add(a, b, to, ARC, len(self.arcs) - 1)
        self.point = end

    def snap(self) -> None:
        """Move the end to the start if it is within CLOSED_BY: relative commands add up rounding errors."""
        if self.control and self.point != self.start and math.dist(self.point, self.start) <= CLOSED_BY:
            self.control[-2:] = self.start
            self.point = self.start

    def finish(self, closed: bool) -> Subpath:
        if closed and self.point != self.start:
            self.line(self.start, CLOSE)
        return Subpath(
            control=np.array(self.control, dtype=float).reshape(-1, 4, 2),
            kind=np.array(self.kind, dtype=int),
            arc=np.array(self.arc, dtype=int),
            arcs=np.array(self.arcs, dtype=float).reshape(-1, 5),
            closed=closed,
            start=np.array(self.start),
        )


def arc_to_cubics(
    start: Array, rx: float, ry: float, rotation: float, large: bool, sweep: bool, end: Array
) -> Array:
    """An elliptical arc as cubics of at most a quarter turn (SVG 1.1 F.6.5; error 2.7e-4 of the radius).

    start, end : (2,); rx, ry > 0; rotation in degrees -> (k, 4, 2)
    """
    phi = math.radians(rotation)
    turn = np.array([[math.cos(phi), -math.sin(phi)], [math.sin(phi), math.cos(phi)]])
    half = turn.T @ (start - end) / 2.0
    squeeze = (half[0] / rx) ** 2 + (half[1] / ry) ** 2
    if squeeze > 1.0:  # the radii are too small for both ends: the specification scales the ellipse up
        rx, ry = rx * math.sqrt(squeeze), ry * math.sqrt(squeeze)
        squeeze = 1.0
    unit = np.array([half[0] / rx, half[1] / ry])
    offset = math.sqrt(max(0.0, 1.0 / squeeze - 1.0)) * (1.0 if large == sweep else -1.0)
    centre = offset * np.array([-unit[1], unit[0]])  # on the unit circle's plane
    theta = math.atan2(*(unit - centre)[::-1])
    swept = math.atan2(*(-unit - centre)[::-1]) - theta
    if sweep and swept < 0.0:
        swept += 2.0 * math.pi
    elif not sweep and swept > 0.0:
        swept -= 2.0 * math.pi
    count = max(1, math.ceil(abs(swept) / (math.pi / 2.0) - ROUNDED_QUARTERS))
    angle = theta + swept * np.arange(count + 1) / count
    k = 4.0 / 3.0 * math.tan(swept / count / 4.0)
    point = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    tangent = k * np.stack([-np.sin(angle), np.cos(angle)], axis=1)
    circle = np.stack([point[:-1], point[:-1] + tangent[:-1], point[1:] - tangent[1:], point[1:]], axis=1)
    middle = (start + end) / 2.0 + turn @ (centre * [rx, ry])
    control = (circle * [rx, ry]) @ turn.T + middle
    control[0, 0], control[-1, 3] = start, end
    return control


def number(value: float, decimals: int) -> str:
    """A decimal without needless zeros, never in exponent form."""
    text = f"{value:.{max(decimals, 0)}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


@dataclass(frozen=True)
class Pieces:
    """New segments of a subpath.  control : (m, 4, 2); source : (m,) its old segment; line : (m,)."""

    control: Array
    source: Array
    line: Array


def point_data(point: Array, closed: bool, decimals: int) -> str:
    """A subpath that is a lone point."""
    return f"M {_pair(point, decimals)}" + (" Z" if closed else "")


def subpath_data(subpath: Subpath, pieces: Pieces, decimals: int, arc_tolerance: float) -> str:
    """Path data of a subpath with new segments.

    An arc command stays an arc where an ellipse approximates its new segments to `arc_tolerance`.
    decimals : of coordinates; arc_tolerance : in the path's own units
    """
    words = [f"M {_pair(pieces.control[0, 0], decimals)}"]
    kept_arcs = _arcs(subpath, pieces, decimals, arc_tolerance)
    kind, arc = subpath.kind[pieces.source], subpath.arc[pieces.source]
    last = len(kind) - 1
    for n, control in enumerate(pieces.control):
        if kind[n] == ARC and arc[n] in kept_arcs:
            if n == last or arc[n + 1] != arc[n]:
                rx, ry, rotation, large, sweep = kept_arcs[int(arc[n])]
                radii = f"{number(rx, decimals + 2)},{number(ry, decimals + 2)}"
                turned = number(rotation, ROTATION_DECIMALS)
                words.append(f"A {radii} {turned} {int(large)} {int(sweep)} {_pair(control[3], decimals)}")
        elif kind[n] == CLOSE and n == last:
            break
        elif pieces.line[n]:
            words.append(f"L {_pair(control[3], decimals)}")
        else:
            words.append("C " + " ".join(_pair(point, decimals) for point in control[1:]))
    if subpath.closed:
        words.append("Z")
    return " ".join(words)


def _pair(point: Array, decimals: int) -> str:
    return f"{number(float(point[0]), decimals)},{number(float(point[1]), decimals)}"


def _arcs(subpath: Subpath, pieces: Pieces, decimals: int, tolerance: float) -> dict[int, tuple[float, ...]]:
    """Arc parameters for the arc commands that can stay arcs.

    The new ellipse is the image of the old one under an affine map: the least-squares map of the old control
    points to the new ones.
    """
    kept: dict[int, tuple[float, ...]] = {}
    for index, (rx, ry, rotation, large, sweep) in enumerate(subpath.arcs):
        old = np.flatnonzero(subpath.arc == index)
        new = np.flatnonzero(np.isin(pieces.source, old))
        if len(new) != len(old):
            continue
        before, after = subpath.control[old], pieces.control[new]
        points = before.reshape(-1, 2)
        lifted = np.column_stack([points, np.ones(len(points))])
        affine = np.linalg.lstsq(lifted, after.reshape(-1, 2), rcond=None)[0][:2].T
        phi = math.radians(rotation)
        squeeze = _radii_scale(before[0, 0], before[-1, 3], rx, ry, phi)
        axes = np.array([[math.cos(phi), -math.sin(phi)], [math.sin(phi), math.cos(phi)]]) * [
            rx * squeeze,
            ry * squeeze,
        ]
        left, radii, _ = np.linalg.svd(affine @ axes)
        if radii[1] <= 1e-9 * radii[0]:
            continue
        turned = math.degrees(math.atan2(left[1, 0], left[0, 0]))
        if np.linalg.det(affine) < 0.0:
            sweep = 1.0 - sweep
        arc = _written_arc(after, radii, turned, bool(large), bool(sweep), decimals, tolerance)
        if arc is not None:
            kept[index] = arc
    return kept


def _written_arc(
    wanted: Array, radii: Array, rotation: float, large: bool, sweep: bool, decimals: int, tolerance: float
) -> tuple[float, ...] | None:
    """The rounded rx, ry, rotation, large, sweep, if they draw the wanted cubics (k, 4, 2); else None.

    Path data does not have an arc's centre; it follows from the end points and the radii.  For half an
    ellipse it depends on the square root of the radii's excess over half the distance of the ends.  So if
    rounding makes the radii slightly too large, the centre moves by far more than the rounding.  If they are
    slightly too small, a renderer enlarges them to fit.  Both the rounded and slightly reduced radii are
    tried, and the better is taken.
    """
    fine = 10.0 ** (decimals + 2)
    start, end = np.round(wanted[0, 0], decimals), np.round(wanted[-1, 3], decimals)
    if np.array_equal(start, end):  # nearly a whole ellipse; an arc to its own start would not be drawn
        return None
    rotation = round(rotation, ROTATION_DECIMALS)
    best, least = None, tolerance
    shrunk = radii * (1.0 - 2.0 * 10.0**-decimals / radii[1] - 1e-8)
    for candidate in (radii, shrunk):
        rx, ry = (float(r) for r in np.round(candidate * fine) / fine)
        if not min(rx, ry) > 0.0:
            continue
        drawn = arc_to_cubics(start, rx, ry, rotation, large, sweep, end)
        if len(drawn) == len(wanted) and _same_ends(drawn, wanted):
            error = float(np.abs(drawn - wanted).max())
            if error <= least:
                best, least = (rx, ry, rotation, float(large), float(sweep)), error
    return best


def _same_ends(drawn: Array, wanted: Array) -> bool:
    """Whether two chains of cubics (k, 4, 2) have the same end tangents, to ARC_ANGLE."""
    ends = (
        (drawn[0, 1] - drawn[0, 0], wanted[0, 1] - wanted[0, 0]),
        (drawn[-1, 3] - drawn[-1, 2], wanted[-1, 3] - wanted[-1, 2]),
    )
    angles = [abs(math.atan2(a[0] * b[1] - a[1] * b[0], float(a @ b))) for a, b in ends]
    return max(angles) <= ARC_ANGLE


def _radii_scale(start: Array, end: Array, rx: float, ry: float, phi: float) -> float:
    """The factor, at least 1, by which radii too small for both ends are enlarged (SVG 1.1 F.6.6)."""
    x, y = (start - end) / 2.0
    u = (math.cos(phi) * x + math.sin(phi) * y) / rx
    v = (-math.sin(phi) * x + math.cos(phi) * y) / ry
    return max(1.0, math.hypot(u, v))
