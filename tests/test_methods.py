# SPDX-License-Identifier: GPL-2.0-or-later
"""The other methods give the answers that they are known for."""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path
from xml.etree import ElementTree

import clipart
import measure
import numpy as np
import pytest
from builders import BLOB, drag, drawing, pin, sampled

import alup_reshape
from alup.geometry.connected_components import components
from alup.messages.errors import DependencyError
from alup.methods import arap, killing, lattice, poisson, puppet
from alup.methods import triangles as elements
from alup.methods.registry import METHODS
from alup.methods.task import Task
from alup.network.sampling import Graph
from alup.session import pipeline
from alup.ties import scaffold

ROOT = Path(__file__).resolve().parents[1]
DATA = clipart.DRAWINGS
INX = "{http://www.inkscape.org/namespace/inkscape/extension}"

HAVE_LIBIGL = importlib.util.find_spec("igl") is not None
needs_libigl = pytest.mark.skipif(not HAVE_LIBIGL, reason="libigl is not installed here")
EVERY = [
    pytest.param(name, marks=needs_libigl if name in ("puppet", "arap") else ()) for name in sorted(METHODS)
]
PLANAR = [pytest.param("arap", marks=needs_libigl), "killing", pytest.param("puppet", marks=needs_libigl)]

# An outline with a hole, an open stroke that crosses it, and a part of its own beside it.
PATHS = (BLOB, "M50,60 h30 v30 h-30 z", "M40,10 L70,125", "M170,50 h20 v40 h-20 z")


@pytest.fixture(autouse=True)
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """A mesh on which nothing takes long."""
    for module in (killing, puppet, arap):
        monkeypatch.setattr(module, "VERTICES", 500)


def task(count: int = 4, seed: int = 0, scale: float = 1.0) -> Task:
    """Samples of PATHS with handles spread over the outline, which stay."""
    _, graph = sampled(drawing(*PATHS))
    label = components(graph.edges, len(graph.points))[1]
    own = np.flatnonzero(label == label[0])
    chosen = np.random.default_rng(seed).permutation(own)[:count]
    joined = scaffold.between(graph.points, label, scaffold.sides(graph.points))
    graph = Graph(scale * graph.points, graph.edges, graph.straight_turns, graph.through)
    return Task(graph, chosen, graph.points[chosen], joined)


def moved_by(of: Task, targets: np.ndarray) -> Task:
    return Task(of.graph, of.handles, targets, of.scaffold)


def rigid(points: np.ndarray, degrees: float, by: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    """Points turned about (30, 20) and translated."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return (points - [30.0, 20.0]) @ np.array([[c, s], [-s, c]]) + [30.0, 20.0] + by


def dragged(of: Task) -> np.ndarray:
    """Targets that no rigid motion meets."""
    targets = of.graph.points[of.handles].copy()
    targets[0] += [25.0, -12.0]
    targets[1] += [-5.0, 9.0]
    return targets


@pytest.mark.parametrize("method", EVERY)
def test_translation(method: str) -> None:
    start = task()
    by = np.array([31.0, -17.0])
    found = METHODS[method](moved_by(start, start.graph.points[start.handles] + by)).moved
    np.testing.assert_allclose(found, start.graph.points + by, atol=1e-4)


@pytest.mark.parametrize("method", EVERY)
def test_handles_are_met(method: str) -> None:
    start = task()
    targets = dragged(start)
    found = METHODS[method](moved_by(start, targets)).moved
    np.testing.assert_allclose(found[start.handles], targets, atol=1e-6 * 250.0)


@pytest.mark.parametrize("method", EVERY)
def test_unmoved_handles_leave_the_drawing_as_it_is(method: str) -> None:
    handles = [pin(10, 80), pin(120, 100)]
    result = pipeline.reshape(drawing(*PATHS, handles=handles), pipeline.Options(method=method))
    still = drawing(*PATHS)
    np.testing.assert_array_equal(result.refitted.control, still.control)
    assert result.report["method"] == method


@pytest.mark.parametrize("method", EVERY)
def test_the_way_from_drawing_to_segments(method: str) -> None:
    """Handles reach their targets in the written curves; the parts apart can stay."""
    handles = [pin(10, 80), pin(60, 130), drag((140, 60), (160, 50))]
    options = pipeline.Options(method=method, hold="apart")
    result = pipeline.reshape(drawing(*PATHS, handles=handles), options)
    assert result.report["handle_error_of_diagonal"] < 1e-6
    alone = result.refitted.source >= len(drawing(*PATHS[:3]).control)
    np.testing.assert_allclose(result.refitted.control[alone], drawing(PATHS[3]).control, atol=1e-9)
    ends = result.refitted.control[:, 0]
    assert np.hypot(*(ends - [160, 50]).T).min() < 0.05


@pytest.mark.parametrize("method", EVERY)
def test_the_unit_of_length_does_not_matter(method: str) -> None:
    small, large = task(), task(scale=1024.0)
    once = METHODS[method](moved_by(small, dragged(small))).moved
    again = METHODS[method](moved_by(large, 1024.0 * dragged(small))).moved
    np.testing.assert_allclose(again / 1024.0, once, atol=1e-6)


@pytest.mark.parametrize("method", PLANAR)
@pytest.mark.parametrize("degrees", [20.0, -130.0])
def test_methods_of_the_plane_reproduce_a_rotation(method: str, degrees: float) -> None:
    start = task()
    targets = rigid(start.graph.points[start.handles], degrees, (12.0, 7.0))
    found = METHODS[method](moved_by(start, targets)).moved
    wanted = rigid(start.graph.points, degrees, (12.0, 7.0))
    assert np.abs(found - wanted).max() < 1e-3 * 250.0


@pytest.mark.parametrize("method", EVERY)
def test_the_effect_takes_the_method(method: str, tmp_path: Path) -> None:
    """As an option of the command line, and as the dialog says it; the report names it."""
    names = {
        option.get("value") for option in ElementTree.parse(ROOT / "alup_reshape.inx").iter(f"{INX}option")
    }
    assert method in names
    entry = next(e for e in clipart.cases(DATA) if e["name"] == "battery-translate")
    built = clipart.build(entry, folder=DATA)
    before, after, report = (tmp_path / name for name in ("before.svg", "after.svg", "report.json"))
    built.tree.write(str(before))
    arguments = [f"--id={name}" for name in built.ids] + [f"--method={method}", f"--report={report}"]
    alup_reshape.AlupReshape().run([*arguments, f"--output={after}", str(before)])
    said = json.loads(report.read_text())
    assert said["method"] == method
    assert said["turning_degrees"]["max"] < 1e-3
    assert measure.compare(before, after, built.ids, entry).exact_error < 1e-5


# --- Poisson ------------------------------------------------------------------------------------------


def test_displacement_is_linear_in_arc_length_between_handles() -> None:
    """The closed form on a chain; u'' = 0 whatever the chain's own shape."""
    length = np.array([1.0, 0.5, 2.0, 0.25, 1.25])
    angle = np.array([0.3, -0.8, 1.9, 0.1, 2.5])
    steps = length[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = np.concatenate([[[0.0, 0.0]], np.cumsum(steps, axis=0)])
    none = np.zeros((0, 2), dtype=int)
    edges = np.stack([np.arange(5), np.arange(1, 6)], axis=1)
    graph = Graph(points, edges, np.zeros((0, 3), dtype=int), none)
    by = np.array([3.0, -2.0])
    found = poisson.deform(
        Task(graph, np.array([0, 5]), points[[0, 5]] + np.outer([0.0, 1.0], by), none)
    ).moved
    along = np.concatenate([[0.0], np.cumsum(length)]) / length.sum()
    np.testing.assert_allclose(found, points + along[:, None] * by, atol=1e-12)


def test_at_a_junction_the_derivatives_balance() -> None:
    """Kirchhoff's condition on a star of three arms, of which one end moves: its share is 1/l of the sum."""
    points = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 2.0], [-4.0, 0.0]])
    none = np.zeros((0, 2), dtype=int)
    graph = Graph(points, np.array([[0, 1], [0, 2], [0, 3]]), np.zeros((0, 3), dtype=int), none)
    targets = points[1:].copy()
    targets[0] += [0.0, 1.0]
    found = poisson.deform(Task(graph, np.array([1, 2, 3]), targets, none)).moved
    np.testing.assert_allclose(found[0], [0.0, 1.0 / (1.0 + 0.5 + 0.25)], atol=1e-12)


# --- the mesh of the plane ----------------------------------------------------------------------------


def mesh_of(of: Task) -> lattice.Lattice:
    return lattice.cover(of.graph.points, of.graph.edges, of.scaffold, of.handles, 1500)


def test_the_mesh_carries_every_sample() -> None:
    start = task()
    mesh = mesh_of(start)
    assert mesh.carry.min() > -1e-9
    np.testing.assert_allclose(mesh.carry.sum(axis=1), 1.0)
    np.testing.assert_allclose(mesh.carry @ mesh.vertices, start.graph.points, atol=1e-9)
    np.testing.assert_allclose(mesh.vertices[mesh.handles], start.graph.points[start.handles], atol=1e-4)


def test_the_mesh_is_one_piece_of_well_shaped_triangles() -> None:
    mesh = mesh_of(task())
    sides = np.concatenate([mesh.triangles[:, [0, 1]], mesh.triangles[:, [1, 2]], mesh.triangles[:, [2, 0]]])
    assert components(sides, len(mesh.vertices))[0] == 1
    area = elements.signed_areas(mesh.vertices, mesh.triangles)
    assert area.min() > 0.05 * area.mean()
    assert 800 < len(mesh.vertices) < 3000


def test_the_mesh_covers_what_is_enclosed_and_no_more_than_a_margin() -> None:
    _, graph = sampled(drawing("M0,0 h100 v60 h-100 z", "M80,0 v-40"))
    none = np.zeros((0, 2), dtype=int)
    mesh = lattice.cover(graph.points, graph.edges, none, np.array([0]), 1500)
    area = elements.signed_areas(mesh.vertices, mesh.triangles).sum()
    rim = 2.0 * (320.0 + 80.0) * 2.0 * mesh.spacing
    assert 6000.0 < area < 6000.0 + rim


def test_finite_elements_are_exact_for_linear_fields() -> None:
    mesh = mesh_of(task())
    matrix = np.array([[0.3, -1.2], [2.0, 0.7]])
    gradient, area = elements.hat_gradients(mesh.vertices, mesh.triangles)
    found = elements.jacobians(gradient, mesh.triangles, mesh.vertices @ matrix.T)
    np.testing.assert_allclose(found, np.broadcast_to(matrix, found.shape), atol=1e-9)
    constant = elements.at_vertices(np.full(len(area), 2.5), area, mesh.triangles, len(mesh.vertices))
    np.testing.assert_allclose(constant, 2.5)


# --- as Killing as possible ---------------------------------------------------------------------------


def test_killing_energy_of_known_fields() -> None:
    """Of the field M x it is |M + M^T|^2 times the area: 0 for a rotation, 8 for a scaling."""
    mesh = mesh_of(task())
    energy = killing.killing_energy(mesh.vertices, mesh.triangles)
    area = elements.signed_areas(mesh.vertices, mesh.triangles).sum()
    cases = (
        ([[0, -1], [1, 0]], 0.0),
        ([[1, 0], [0, 1]], 8.0),
        ([[1, 0], [0, -1]], 8.0),
        ([[0, 1], [0, 0]], 2.0),
    )
    for matrix, wanted in cases:
        field = (mesh.vertices @ np.array(matrix, dtype=float).T).ravel()
        assert field @ (energy @ field) / area == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize("a", [0.7j, -0.4 + 0.0j, 0.3 + 1.1j, 1e-9j])
def test_points_go_along_logarithmic_spirals(a: complex) -> None:
    """The flow of a z for a unit of time is e^a z."""
    mesh = mesh_of(task())
    z = mesh.vertices @ [1.0, 1.0j]
    velocity = np.stack([(a * z).real, (a * z).imag], axis=1)
    found = killing.advance(mesh.vertices, mesh.triangles, velocity) @ [1.0, 1.0j]
    np.testing.assert_allclose(found, np.exp(a) * z, atol=1e-7)


def test_one_step_is_enough_for_a_rotation_only() -> None:
    start = task()
    turned = moved_by(start, rigid(start.graph.points[start.handles], 100.0))
    once = killing.deform(turned, steps=1, home=False)
    np.testing.assert_allclose(once.moved, rigid(start.graph.points, 100.0), atol=1e-3)
    pulled = moved_by(start, dragged(start))
    missed = [killing.deform(pulled, steps=n, home=False).figures["missed_of_diagonal"] for n in (1, 8, 32)]
    assert missed[0] > 1e-2 > missed[1] > missed[2]
    assert missed[2] < 1e-3


def test_a_killing_field_does_not_scale() -> None:
    """Handles that ask for twice the size get it between them only; a scaling would double every length."""
    start = task(count=2, seed=3)
    at = start.graph.points[start.handles]
    twice = killing.deform(moved_by(start, at.mean(axis=0) + 2.0 * (at - at.mean(axis=0)))).moved
    a, b = (p[start.graph.edges[:, 1]] - p[start.graph.edges[:, 0]] for p in (start.graph.points, twice))
    growth = np.linalg.norm(b, axis=1) / np.linalg.norm(a, axis=1)
    assert np.median(growth) < 1.5
    assert growth.max() > 1.5


# --- puppet warp --------------------------------------------------------------------------------------


@needs_libigl
def test_biharmonic_weights() -> None:
    mesh = mesh_of(task(count=5))
    weights = puppet.biharmonic_weights(mesh.vertices, mesh.triangles, mesh.handles)
    assert weights.min() >= 0.0
    assert weights.max() <= 1.0
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    np.testing.assert_allclose(weights[mesh.handles], np.eye(5), atol=1e-9)
    smooth = np.abs(np.diff(weights[mesh.triangles], axis=1)).max()
    assert smooth < 0.5


@needs_libigl
def test_two_handles_share_a_strip_by_halves() -> None:
    _, graph = sampled(drawing("M0,0 h200 v20 h-200 z"))
    ends = [int(np.hypot(*(graph.points - at).T).argmin()) for at in ([0.0, 10.0], [200.0, 10.0])]
    mesh = lattice.cover(graph.points, graph.edges, np.zeros((0, 2), dtype=int), np.array(ends), 1500)
    carried = mesh.carry @ puppet.biharmonic_weights(mesh.vertices, mesh.triangles, mesh.handles)
    middle = np.abs(graph.points[:, 0] - 100.0) < 1e-6
    np.testing.assert_allclose(carried[middle], 0.5, atol=0.02)
    quarter = np.abs(graph.points[:, 0] - 50.0) < 1e-6
    assert (carried[quarter, 0] > 0.7).all()


@needs_libigl
def test_the_estimated_rotations_are_of_least_rigidity_energy() -> None:
    """Against distances to the nearest rotation by singular values, and changes of every angle."""
    start = task()
    mesh = mesh_of(start)
    weights = puppet.biharmonic_weights(mesh.vertices, mesh.triangles, mesh.handles)
    rest, targets = mesh.vertices[mesh.handles], dragged(start)
    angles = puppet.rotations(mesh, weights, rest, targets)
    gradient, area = elements.hat_gradients(mesh.vertices, mesh.triangles)

    def energy(angle: np.ndarray) -> float:
        moved = puppet.skinned(mesh.vertices, weights, rest, targets, angle)
        left, _, right = np.linalg.svd(elements.jacobians(gradient, mesh.triangles, moved))
        nearest = left @ right
        flip = np.linalg.det(nearest) < 0.0
        left[flip, :, 1] *= -1.0
        away = elements.jacobians(gradient, mesh.triangles, moved) - left @ right
        return float(area @ (away**2).sum(axis=(1, 2)))

    least = energy(angles)
    assert least < energy(np.zeros(len(angles)))
    for change in 0.05 * np.vstack([np.eye(len(angles)), -np.eye(len(angles))]):
        assert energy(angles + change) > least


@pytest.mark.parametrize("method", ["puppet", "arap"])
def test_without_libigl_a_sentence_says_so(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "igl", None)
    start = task()
    with pytest.raises(DependencyError, match="libigl"):
        METHODS[method](moved_by(start, dragged(start)))
