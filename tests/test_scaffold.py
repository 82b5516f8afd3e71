# SPDX-License-Identifier: GPL-2.0-or-later
"""The scaffold joins all components by sides of the Delaunay triangulation."""

from __future__ import annotations

import numpy as np
import pytest
from builders import BLOB, drawing, sampled

from alup.geometry.connected_components import components
from alup.ties import scaffold


def rings(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 2) and edges of circles at random places."""
    random = np.random.default_rng(seed)
    points, edges = [], []
    angle = np.linspace(0, 2 * np.pi, 21)[:-1]
    for n in range(count):
        points.append(
            random.uniform(-50, 50, 2) + random.uniform(1, 5) * np.stack([np.cos(angle), np.sin(angle)], 1)
        )
        k = 20 * n + np.arange(20)
        edges.append(np.stack([k, 20 * n + np.arange(1, 21) % 20], axis=1))
    return np.concatenate(points), np.concatenate(edges)


def build(points: np.ndarray, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    _, label = components(edges, len(points))
    return scaffold.between(points, label, scaffold.sides(points)), label


def check(found: np.ndarray, label: np.ndarray) -> None:
    """Edges lie between different components and leave none apart."""
    assert (label[found[:, 0]] != label[found[:, 1]]).all()
    leader = list(range(label.max() + 1))

    def find(n: int) -> int:
        while leader[n] != n:
            n = leader[n]
        return n

    for a, b in found:
        leader[find(label[a])] = find(label[b])
    assert len({find(n) for n in leader}) == 1


def test_components() -> None:
    number, label = components(np.array([[0, 1], [3, 2], [2, 4]]), 6)
    assert number == 3
    assert len({label[0], label[2], label[5]}) == 3
    assert label[0] == label[1]
    assert label[2] == label[3] == label[4]
    number, label = components(np.zeros((0, 2), dtype=int), 2)
    assert (number, len(set(label))) == (2, 2)


def test_one_component_has_no_scaffold() -> None:
    points, edges = rings(1)
    found, _ = build(points, edges)
    assert found.shape == (0, 2)
    none = np.zeros((0, 2), dtype=int)
    assert scaffold.between(np.zeros((0, 2)), np.zeros(0, dtype=int), none).shape == (0, 2)


@pytest.mark.parametrize("count", [2, 7, 30])
def test_edges_lie_between_components_and_join_them_all(count: int) -> None:
    points, edges = rings(count)
    found, label = build(points, edges)
    check(found, label)
    assert len({frozenset(edge) for edge in found.tolist()}) == len(found)


def delaunay_by_definition(points: np.ndarray) -> set[frozenset[int]]:
    """Sides of all triangles whose circumscribed circle holds no other point; slow."""
    n, sides = len(points), set()
    for a in range(n):
        for b in range(a + 1, n):
            for c in range(b + 1, n):
                p, q, r = points[a], points[b], points[c]
                m = 2 * np.array([q - p, r - p])
                if abs(np.linalg.det(m)) < 1e-12:
                    continue
                centre = np.linalg.solve(m, [q @ q - p @ p, r @ r - p @ p])
                if (np.linalg.norm(points - centre, axis=1) >= np.linalg.norm(p - centre) * (1 - 1e-9)).all():
                    sides |= {frozenset((a, b)), frozenset((b, c)), frozenset((a, c))}
    return sides


@pytest.mark.parametrize("seed", range(4))
def test_the_scaffold_is_the_triangulation_of_the_samples(seed: int) -> None:
    points = np.random.default_rng(seed).uniform(0, 10, (14, 2))
    found = scaffold.sides(points)
    assert {frozenset(edge) for edge in found.tolist()} == delaunay_by_definition(points)
    sides = delaunay_by_definition(points)
    edges: list[list[int]] = []
    for a, b in sorted(sorted(s) for s in sides):
        if not {a, b} & {i for edge in edges for i in edge}:
            edges.append([a, b])
    found, label = build(points, np.array(edges[:4]))
    assert {frozenset(edge) for edge in found.tolist()} == {
        s for s in sides if len({label[i] for i in s}) == 2
    }


@pytest.mark.parametrize("count", [2, 7])
def test_parts_side_by_side_are_joined_by_many_edges(count: int) -> None:
    # A single edge would allow one part to turn about it.
    points, edges = rings(count, seed=1)
    found, _ = build(points, edges)
    assert len(found) > 5 * (count - 1)


def test_coincident_points_are_all_joined() -> None:
    # Three squares on the same place: every sample is there three times.
    points, edges = rings(1)
    count = len(points)
    points = np.concatenate([points, points, points + 1e-13])
    edges = np.concatenate([edges, edges + count, edges + 2 * count])
    found, label = build(points, edges)
    check(found, label)
    assert label.max() == 2
    assert len(found) >= 2 * count  # everywhere, not only in some places


def test_samples_on_one_line() -> None:
    points = np.stack([np.arange(12.0), np.zeros(12)], axis=1)
    edges = np.array([[0, 1], [1, 2], [3, 4], [5, 6], [6, 7], [8, 9], [10, 11]])
    for turned in (points, points[:, ::-1], points @ [[0.6, 0.8], [-0.8, 0.6]]):
        found, label = build(turned, edges)
        check(found, label)
        assert np.linalg.norm(turned[found[:, 0]] - turned[found[:, 1]], axis=1).max() < 1.0 + 1e-9


def test_two_points() -> None:
    found, _ = build(np.array([[0.0, 0.0], [3.0, 4.0]]), np.zeros((0, 2), dtype=int))
    assert [sorted(edge) for edge in found.tolist()] == [[0, 1]]


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e7])
def test_the_scaffold_does_not_depend_on_the_units(size: float) -> None:
    points, edges = rings(6, seed=4)
    first, _ = build(points, edges)
    second, _ = build(points * size + [3 * size, -size], edges)
    assert {frozenset(e) for e in first.tolist()} == {frozenset(e) for e in second.tolist()}


def test_curves_that_cross_are_joined_near_their_crossing() -> None:
    _, samples = sampled(drawing(BLOB, "M0,60 L160,90"), 2.0, crossings=False)
    found, label = build(samples.points, samples.edges)
    check(found, label)
    length = np.linalg.norm(samples.points[found[:, 0]] - samples.points[found[:, 1]], axis=1)
    assert length.min() < 2.0
