# SPDX-License-Identifier: GPL-2.0-or-later
"""Compares a written SVG with the one before, by its path data alone."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import inkex
import numpy as np

from alup.document.tree import elements
from alup.geometry import bezier
from alup.refit.control_arms import end_tangents, start_tangents
from alup.svg import path_data

SMOOTH = np.radians(1.0)  # a node that is smooth to this in the input must not be a corner


@dataclass(frozen=True)
class Comparison:
    """Lengths are parts of the input's diagonal, angles degrees."""

    handle_error: float
    exact_error: float | None
    worst_corner: float
    nodes_before: int
    nodes_after: int
    segments: int
    segments_kept: int
    largest_move: float


def load(path: Path, ids: list[str]) -> list[tuple[tuple[path_data.Subpath, ...], np.ndarray]]:
    """Subpaths and matrices of elements, whatever they are."""
    svg = inkex.load_svg(str(path)).getroot()
    by_id = {element.get("id"): element for element in svg.iter() if isinstance(element.tag, str)}
    result = []
    for identity in ids:
        element = by_id[identity]
        matrix = (elements.parent_matrix(element) @ elements.own_matrix(element))[:2]
        result.append((elements.read_shape(element, matrix).subpaths, matrix))
    return result


def _to_root(control: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    return control @ matrix[:, :2].T + matrix[:, 2]


def compare(before: Path, after: Path, ids: list[str], entry: dict[str, Any]) -> Comparison:
    old, new = load(before, ids), load(after, ids)
    old_root = [(_to_root(s.control, m), s) for subpaths, m in old for s in subpaths]
    new_root = [(_to_root(s.control, m), s) for subpaths, m in new for s in subpaths]
    assert len(old_root) == len(new_root), "subpaths were lost"
    points = np.concatenate([control.reshape(-1, 2) for control, _ in old_root])
    diagonal = float(np.hypot(*(points.max(axis=0) - points.min(axis=0))))
    dense = _dense(new_root)
    assert np.isfinite(dense).all()
    errors = [np.linalg.norm(dense_distance(new_root, np.array(h["target"]))) for h in entry["handles"]]
    exact = None
    if entry.get("exact"):
        a, b, c, d, e, f = entry["exact"]["matrix"]
        exact = 0.0
        for (was, _), (now, _) in zip(old_root, new_root):
            if was.shape == now.shape and len(was):
                t = np.linspace(0, 1, 17)
                wanted = bezier.evaluate(was[:, None], t[None]) @ np.array([[a, b], [c, d]]) + [e, f]
                got = bezier.evaluate(now[:, None], t[None])
                exact = max(exact, float(np.abs(wanted - got).max()) / diagonal)
            elif len(was):
                exact = float("inf")
    corner, nodes_before, nodes_after, kept, segments, move = 0.0, 0, 0, 0, 0, 0.0
    for (was, subpath), (now, _after_subpath) in zip(old_root, new_root):
        nodes_before += len(was)
        nodes_after += len(now)
        segments += len(was)
        kept += max(0, len(was) - max(0, len(now) - len(was)))
        if was.shape == now.shape and len(was):
            corner = max(corner, _worst_corner(was, now, subpath.closed))
            move = max(move, float(np.abs(was - now).max()))
        elif was.shape != now.shape:
            move = float("inf")  # nodes were added; an unmoved drawing needs none
    return Comparison(
        handle_error=float(max(errors, default=0.0)) / diagonal,
        exact_error=exact,
        worst_corner=corner,
        nodes_before=nodes_before,
        nodes_after=nodes_after,
        segments=segments,
        segments_kept=kept,
        largest_move=move / diagonal,
    )


def _dense(root: list[tuple[np.ndarray, Any]]) -> np.ndarray:
    t = np.linspace(0.0, 1.0, 33)
    return np.concatenate([bezier.evaluate(c[:, None], t[None]).reshape(-1, 2) for c, _ in root if len(c)])


def dense_distance(root: list[tuple[np.ndarray, Any]], point: np.ndarray) -> np.ndarray:
    """Vector from a point to the nearest curve point."""
    control = np.concatenate([c for c, _ in root if len(c)])
    t = np.linspace(0.0, 1.0, 33)
    away = np.linalg.norm(bezier.evaluate(control[:, None], t[None]) - point, axis=2)
    best = np.argsort(away.min(axis=1))[:8]
    guess = t[away[best].argmin(axis=1)]
    found = bezier.nearest_parameters(control[best], np.tile(point, (len(best), 1)), guess)
    vectors = bezier.evaluate(control[best], found) - point
    return vectors[np.argmin(np.linalg.norm(vectors, axis=1))]


def _worst_corner(was: np.ndarray, now: np.ndarray, closed: bool) -> float:
    """Largest angle, in degrees, at nodes that were smooth; segments without length are left out."""
    alive = bezier.polygon_lengths(was) > 1e-9
    was, now = was[alive], now[alive]
    if len(was) < 2:
        return 0.0

    def angles(control: np.ndarray) -> np.ndarray:
        arriving, leaving = end_tangents(control), np.roll(start_tangents(control), -1, axis=0)
        z = (leaving[:, 0] + 1j * leaving[:, 1]) * np.conj(arriving[:, 0] + 1j * arriving[:, 1])
        return np.abs(np.angle(z))

    before, after = angles(was), angles(now)
    joined = np.linalg.norm(was[:, 3] - np.roll(was[:, 0], -1, axis=0), axis=1) < 1e-9
    if not closed:
        joined[-1] = False
    smooth = joined & (before < SMOOTH)
    return float(np.degrees(after[smooth].max())) if smooth.any() else 0.0
