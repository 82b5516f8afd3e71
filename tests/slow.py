# SPDX-License-Identifier: GPL-2.0-or-later
"""The energy and both steps of the alternation once more, in plain loops and dense matrices.

It is written from the equations of the paper's Sec. 3 (numbers in brackets) and shares no code with the
package.  Lengths are in units of the round's mean edge length.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Dict, List, Sequence, Tuple

import numpy as np

W_STRAIGHT, W_HANDLE = 1e4, 1e5
SIGMA, CORNER, CORNER_WEIGHT = math.pi / 6, math.radians(95), 1e-3

# Known departures: a straight turn keeps the bend that its input has, and Eq. 22 is one case of a tie.

Vector = np.ndarray
Turn = Tuple[int, int, int]


@dataclass
class Tie:
    """Holds sum factor v of some samples at an offset, units of the round; see `alup.ties.ties`."""

    parts: Dict[int, float]
    offset: Vector
    length: float
    weight: float
    slide: float
    holds: float

    def missed(self, v: np.ndarray) -> Tuple[float, float]:
        """The difference between the tie's vector at v and its offset, along the offset and across."""
        left = sum((factor * v[i] for i, factor in self.parts.items()), -self.offset) / self.length
        along = _unit(self.offset)
        return float(along @ left), float(np.array([-along[1], along[0]]) @ left)

    def kept(self, start: np.ndarray) -> float:
        """Its weight after letting go by its strain at the round's start."""
        along, across = self.missed(start)
        return self.weight / (1.0 + (along**2 + self.slide * across**2) / self.holds**2) ** 2

    def energy(self, start: np.ndarray, v: np.ndarray) -> float:
        along, across = self.missed(v)
        return self.kept(start) * (along**2 + self.slide * across**2)


@dataclass
class Round:
    """One round.  points : input; start : v0 in the round's units; turns : straight ones, (i, j, k)."""

    points: np.ndarray
    start: np.ndarray
    edges: Sequence[Tuple[int, int]]
    straight: Sequence[Turn]
    handles: Dict[int, Vector]
    ties: Sequence[Tie]
    through: Sequence[Turn] = ()  # pairs of edges that run on through a junction, (i, j, k)

    def neighbours(self, i: int) -> List[int]:
        return [b if a == i else a for a, b in self.edges if i in (a, b)]

    def turns(self) -> List[Turn]:
        """Every ordered pair of different neighbours of every vertex."""
        return [
            (i, j, k)
            for i in range(len(self.points))
            for j in self.neighbours(i)
            for k in self.neighbours(i)
            if j != k
        ]

    def length0(self, i: int, j: int) -> float:
        return float(np.linalg.norm(self.start[j] - self.start[i]))

    def ratio(self, i: int, j: int, k: int) -> float:
        return self.length0(i, j) / self.length0(i, k)

    def normal(self, i: int, j: int) -> Vector:
        x, y = self.points[j] - self.points[i]
        return np.array([-y, x]) / math.hypot(x, y)

    def turn_weight(self, i: int, j: int, k: int) -> float:
        """Eq. 11."""
        runs_on = (i, j, k) in self.through or (i, k, j) in self.through
        if len(self.neighbours(i)) > 2 and not runs_on:
            return CORNER_WEIGHT
        a, b = self.points[j] - self.points[i], self.points[k] - self.points[i]
        cosine = a @ b / (np.linalg.norm(a) * np.linalg.norm(b))
        theta = math.acos(max(-1.0, min(1.0, float(cosine))))
        if theta <= CORNER:
            return CORNER_WEIGHT
        return math.exp(-((theta - math.pi) ** 2) / (2 * SIGMA**2))

    def straight_both_ways(self) -> List[Turn]:
        return [*self.straight, *((i, k, j) for i, j, k in self.straight)]

    def bend(self, i: int, j: int, k: int) -> Vector:
        return _unit(self.points[j] - self.points[i]) - _unit(self.points[i] - self.points[k])


def _unit(v: Vector) -> Vector:
    return v / math.hypot(*v)


def energies(r: Round, v: np.ndarray) -> Dict[str, float]:
    """Each term with its weight."""
    normal = tangent = straight = handle = edge = ties = 0.0
    for i, j in r.edges:  # Eq. 8, Eq. 17
        e, e0 = v[j] - v[i], r.start[j] - r.start[i]
        length = math.hypot(*e)
        normal += max(1.0, length**2) * float(r.normal(i, j) @ e / length) ** 2
        edge += max(1.0, length**2) * float(np.sum((e / length - _unit(e0)) ** 2))
    for i, j, k in r.turns():  # Eq. 9
        ij, ik = math.hypot(*(v[j] - v[i])), math.hypot(*(v[k] - v[i]))
        tangent += r.turn_weight(i, j, k) * (ij - r.ratio(i, j, k) * ik) ** 2
    for i, j, k in r.straight_both_ways():  # Eq. 12
        difference = _unit(v[j] - v[i]) - _unit(v[i] - v[k]) - r.bend(i, j, k)
        straight += W_STRAIGHT * float(difference @ difference)
    for h, p in r.handles.items():  # Eq. 13
        handle += W_HANDLE * float((v[h] - p) @ (v[h] - p))
    for tie in r.ties:  # Eq. 22 among them
        ties += tie.energy(r.start, v)
    alup = normal + tangent + straight + handle
    return {
        "normal": normal, "tangent": tangent, "straight": straight, "handle": handle,
        "edge": edge, "ties": ties, "alup": alup, "objective": alup + edge + ties,
    }  # fmt: skip


def position_rows(r: Round, l: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Residuals J x - b of the positions step (Eq. 14, 16, 17, 13, 22), x = (x0, y0, x1, y1, ...)."""
    length = {frozenset(edge): value for edge, value in zip(r.edges, l)}
    rows, right = [], []

    def row(parts: Dict[int, Vector], weight: float, wanted: float) -> None:
        line = np.zeros(2 * len(r.points))
        for vertex, coefficients in parts.items():
            line[2 * vertex : 2 * vertex + 2] += coefficients
        rows.append(math.sqrt(weight) * line)
        right.append(math.sqrt(weight) * wanted)

    for i, j in r.edges:
        value = length[frozenset((i, j))]
        weight = max(1.0, value**2)
        n = r.normal(i, j) / value
        row({j: n, i: -n}, weight, 0.0)
        direction = _unit(r.start[j] - r.start[i])
        for d in (0, 1):
            axis = np.eye(2)[d] / value
            row({j: axis, i: -axis}, weight, direction[d])
    for i, j, k in r.straight_both_ways():
        a, b = 1.0 / length[frozenset((i, j))], 1.0 / length[frozenset((i, k))]
        for d in (0, 1):
            axis = np.eye(2)[d]
            row({j: a * axis, i: -(a + b) * axis, k: b * axis}, W_STRAIGHT, r.bend(i, j, k)[d])
    for h, p in r.handles.items():
        for d in (0, 1):
            row({h: np.eye(2)[d]}, W_HANDLE, p[d])
    for tie in r.ties:
        along = _unit(tie.offset)
        for axis, part in ((along, 1.0), (np.array([-along[1], along[0]]), tie.slide)):
            weight = tie.kept(r.start) * part / tie.length**2
            row({i: factor * axis for i, factor in tie.parts.items()}, weight, float(axis @ tie.offset))
    return np.array(rows), np.array(right)


def positions(r: Round, l: np.ndarray) -> np.ndarray:
    matrix, right = position_rows(r, l)
    return np.linalg.lstsq(matrix, right, rcond=None)[0].reshape(-1, 2)


def lengths(r: Round, v: np.ndarray) -> np.ndarray:
    """The lengths step (Eq. 21)."""
    number = {frozenset(edge): n for n, edge in enumerate(r.edges)}
    rows, right = [], []
    for n, (i, j) in enumerate(r.edges):
        line = np.zeros(len(r.edges))
        line[n] = 1.0
        rows.append(line)
        right.append(math.hypot(*(v[j] - v[i])))
    for i, j, k in r.turns():
        weight = math.sqrt(r.turn_weight(i, j, k))
        line = np.zeros(len(r.edges))
        line[number[frozenset((i, j))]] += weight
        line[number[frozenset((i, k))]] -= weight * r.ratio(i, j, k)
        rows.append(line)
        right.append(0.0)
    return np.linalg.lstsq(np.array(rows), np.array(right), rcond=None)[0]
