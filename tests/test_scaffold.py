"""The scaffold joins all components, whatever becomes of Triangle."""

from __future__ import annotations

import importlib.util
import os
import signal
import sys
import time
import types
from typing import Any, Callable

import numpy as np
import pytest
from builders import BLOB, drawing, sampled

from alup import scaffold
from alup.scaffold import Scaffold

needs_triangle = pytest.mark.skipif(
    importlib.util.find_spec("triangle") is None, reason="Triangle is not installed here"
)


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


def build(points: np.ndarray, edges: np.ndarray, **options: float) -> tuple[Scaffold, np.ndarray]:
    _, label = scaffold.components(edges, len(points))
    return scaffold.build(points, edges, label, **options), label


def check(found: Scaffold, edges: np.ndarray, label: np.ndarray) -> None:
    """Edges lie between different components and leave none apart."""
    assert (label[found.edges[:, 0]] != label[found.edges[:, 1]]).all()
    leader = list(range(label.max() + 1))

    def find(n: int) -> int:
        while leader[n] != n:
            n = leader[n]
        return n

    for a, b in found.edges:
        leader[find(label[a])] = find(label[b])
    assert len({find(n) for n in leader}) == 1


def test_components() -> None:
    number, label = scaffold.components(np.array([[0, 1], [3, 2], [2, 4]]), 6)
    assert number == 3
    assert len({label[0], label[2], label[5]}) == 3
    assert label[0] == label[1]
    assert label[2] == label[3] == label[4]
    number, label = scaffold.components(np.zeros((0, 2), dtype=int), 2)
    assert (number, len(set(label))) == (2, 2)


def test_one_component_has_no_scaffold() -> None:
    points, edges = rings(1)
    found, _ = build(points, edges)
    assert found.edges.shape == (0, 2)
    assert found.method == "none"
    assert (
        scaffold.build(np.zeros((0, 2)), np.zeros((0, 2), dtype=int), np.zeros(0, dtype=int)).method == "none"
    )


@pytest.mark.parametrize("count", [2, 7, 30])
def test_edges_lie_between_components_and_join_them_all(count: int) -> None:
    points, edges = rings(count)
    found, label = build(points, edges)
    check(found, edges, label)
    assert len({frozenset(edge) for edge in found.edges.tolist()}) == len(found.edges)


@needs_triangle
def test_triangle_is_used_and_respects_the_curves() -> None:
    # Two long lines with few samples, so that an unconstrained triangulation would cross them.
    points = np.array([[0.0, 0], [10, 0], [0, 1], [10, 1], [5, -0.2], [5, 1.2], [5, 0.5], [5.1, 0.5]])
    edges = np.array([[0, 1], [2, 3], [6, 7]])
    found, label = build(points, edges)
    assert found.method.startswith("Triangle")
    check(found, edges, label)

    def side(a: int, b: int, p: int) -> float:
        (ax, ay), (bx, by), (px, py) = points[a], points[b], points[p]
        return float((bx - ax) * (py - ay) - (by - ay) * (px - ax))

    for a, b in found.edges.tolist():
        for c, d in ((0, 1), (2, 3)):
            if {a, b} & {c, d}:
                continue
            crosses = side(c, d, a) * side(c, d, b) < 0 and side(a, b, c) * side(a, b, d) < 0
            assert not crosses


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


@needs_triangle
@pytest.mark.parametrize("seed", range(4))
def test_the_scaffold_is_the_triangulation_of_the_samples(seed: int) -> None:
    """With curves along its sides, the constrained triangulation is Delaunay's."""
    points = np.random.default_rng(seed).uniform(0, 10, (14, 2))
    sides = delaunay_by_definition(points)
    edges: list[list[int]] = []
    for a, b in sorted(sorted(s) for s in sides):
        if not {a, b} & {i for edge in edges for i in edge}:
            edges.append([a, b])
    found, label = build(points, np.array(edges[:4]))
    assert found.method == "Triangle, constrained Delaunay"
    assert {frozenset(edge) for edge in found.edges.tolist()} == {
        s for s in sides if len({label[i] for i in s}) == 2
    }


@pytest.mark.parametrize("count", [2, 7])
def test_parts_side_by_side_are_joined_by_many_edges(count: int) -> None:
    # One edge between two parts would let one turn about it.
    points, edges = rings(count, seed=1)
    found, _ = build(points, edges)
    assert len(found.edges) > 5 * (count - 1)


def test_without_triangle_scipys_triangulation_serves(monkeypatch: pytest.MonkeyPatch) -> None:
    find_spec = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util,
        "find_spec",
        lambda name, *rest: None if name == "triangle" else find_spec(name, *rest),
    )
    random = np.random.default_rng(3)
    points = random.uniform(0, 10, (16, 2))
    edges = np.stack([np.arange(0, 16, 2), np.arange(1, 16, 2)], axis=1)
    found, label = build(points, edges)
    check(found, edges, label)
    assert found.method == "scipy Delaunay (Triangle is not installed)"
    sides = {frozenset(edge) for edge in found.edges.tolist()}
    assert sides == {s for s in delaunay_by_definition(points) if len({label[i] for i in s}) == 2}


def fake_triangle(monkeypatch: pytest.MonkeyPatch, triangulate: Callable[..., Any]) -> None:
    """A module of that name that does something else; the worker imports it after the fork."""
    module = types.ModuleType("triangle")
    module.triangulate = triangulate  # type: ignore[attr-defined]
    module.__spec__ = importlib.util.spec_from_loader("triangle", None)
    monkeypatch.setitem(sys.modules, "triangle", module)


def _killed(*_: Any) -> None:
    os.kill(os.getpid(), signal.SIGSEGV)


def _raises(*_: Any) -> None:
    raise RuntimeError("Triangle: something")


def _exits(*_: Any) -> None:
    os._exit(0)


def _hangs(*_: Any) -> None:
    while True:
        time.sleep(1.0)


def _loses_points(*_: Any) -> dict[str, np.ndarray]:
    return {"triangles": np.array([[0, 1, 2]]), "vertices": np.zeros((3, 2))}


def _talks_first(*_: Any) -> None:
    os.write(1, b"Internal error in Triangle\n")
    os.write(2, b"and on stderr\n")
    raise RuntimeError


@pytest.mark.parametrize(
    ("does", "reason"),
    [
        (_killed, "Triangle failed"),
        (_raises, "Triangle failed"),
        (_exits, "Triangle failed"),
        (_talks_first, "Triangle failed"),
        (_loses_points, "Triangle lost points"),
        (_hangs, "Triangle took too long"),
    ],
)
def test_a_worker_that_fails_is_replaced(
    does: Callable[..., Any], reason: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    fake_triangle(monkeypatch, does)
    workers: list[int] = []
    fork = os.fork

    def noted() -> int:
        process = fork()
        workers.append(process)
        return process

    monkeypatch.setattr(os, "fork", noted)
    points, edges = rings(4)
    before = time.monotonic()
    found, label = build(points, edges, time_limit=0.5)
    assert time.monotonic() - before < 5.0
    assert found.method == f"scipy Delaunay ({reason})"
    check(found, edges, label)
    assert capfd.readouterr() == ("", "")
    # No process is left over.
    assert len(workers) == 1
    with pytest.raises(ChildProcessError):
        os.waitpid(workers[0], os.WNOHANG)


def test_nothing_is_written_to_stdout_even_if_it_is_buffered(capfd: pytest.CaptureFixture[str]) -> None:
    points, edges = rings(4)
    sys.stdout.write("mine")
    build(points, edges)
    sys.stdout.flush()
    assert capfd.readouterr() == ("mine", "")


def test_coincident_points_are_all_joined() -> None:
    # Three squares on the same place: every sample is there three times.
    points, edges = rings(1)
    count = len(points)
    points = np.concatenate([points, points, points + 1e-13])
    edges = np.concatenate([edges, edges + count, edges + 2 * count])
    found, label = build(points, edges)
    check(found, edges, label)
    assert label.max() == 2
    assert len(found.edges) >= 2 * count  # not only somewhere


def test_samples_on_one_line() -> None:
    points = np.stack([np.arange(12.0), np.zeros(12)], axis=1)
    edges = np.array([[0, 1], [1, 2], [3, 4], [5, 6], [6, 7], [8, 9], [10, 11]])
    for turned in (points, points[:, ::-1], points @ [[0.6, 0.8], [-0.8, 0.6]]):
        found, label = build(turned, edges)
        check(found, edges, label)
        assert (
            np.linalg.norm(turned[found.edges[:, 0]] - turned[found.edges[:, 1]], axis=1).max() < 1.0 + 1e-9
        )


def test_two_points() -> None:
    found, _ = build(np.array([[0.0, 0.0], [3.0, 4.0]]), np.zeros((0, 2), dtype=int))
    assert [sorted(edge) for edge in found.edges.tolist()] == [[0, 1]]


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e7])
def test_the_scaffold_does_not_depend_on_the_units(size: float) -> None:
    points, edges = rings(6, seed=4)
    first, _ = build(points, edges)
    second, _ = build(points * size + [3 * size, -size], edges)
    assert {frozenset(e) for e in first.edges.tolist()} == {frozenset(e) for e in second.edges.tolist()}


def test_curves_that_cross_are_joined_near_their_crossing() -> None:
    _, samples = sampled(drawing(BLOB, "M0,60 L160,90"), 2.0, crossings=False)
    found, label = build(samples.points, samples.edges)
    check(found, samples.edges, label)
    length = np.linalg.norm(samples.points[found.edges[:, 0]] - samples.points[found.edges[:, 1]], axis=1)
    assert length.min() < 2.0
