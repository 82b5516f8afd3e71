"""Edges that let separate components move in tandem (Sec. 3.5, Eq. 22).

The components of the curve network are joined by the edges of a constrained Delaunay triangulation
of all samples, with the network's edges as constraints; the edges between different components are
the scaffold T.  The paper adds the corners of the bounding box; they are left out here, because their
fans of triangles take the place of edges between parts that stand side by side, down to a single
pair, about which a part could turn.

Shewchuk's Triangle makes the triangulation.  It is a C program that ends its process on some
inputs and can run for ever on others, so it runs in a forked worker with a time limit, on points
that are finite and unique.  Where it is missing, fails or takes too long, scipy's Delaunay
triangulation of the same samples serves: samples are dense along the curves, so it contains all
but a few of the constraints anyway.
"""

from __future__ import annotations

import importlib.util
import io
import os
import select
import signal
import sys
import time
import zipfile
from dataclasses import dataclass

import numpy as np

from .components import components
from .model import Array

# Seconds for the worker; ten times what 100,000 samples take.
TRIANGLE_TIME_LIMIT = 10.0

# Points nearer than this part of the drawing's diagonal are one point of the triangulation.
UNIQUE_OF_DIAGONAL = 1e-9


@dataclass(frozen=True)
class Scaffold:
    """edges : (|T|, 2) int samples of different components; method : how they were found."""

    edges: Array
    method: str


def build(points: Array, edges: Array, label: Array, time_limit: float = TRIANGLE_TIME_LIMIT) -> Scaffold:
    """The scaffold of samples (N, 2) with network edges (E, 2) and component labels (N,)."""
    if not len(label) or label.max() == 0:
        return Scaffold(np.zeros((0, 2), dtype=int), "none")
    pairs, method = triangulation(points, edges, time_limit)
    pairs = pairs[label[pairs[:, 0]] != label[pairs[:, 1]]]
    return Scaffold(_connect(points, label, pairs), method)


def triangulation(points: Array, edges: Array, time_limit: float = TRIANGLE_TIME_LIMIT) -> tuple[Array, str]:
    """All sides (m, 2) of the constrained Delaunay triangulation of samples, and how it was found."""
    low, high = points.min(axis=0), points.max(axis=0)
    diagonal = float(np.hypot(*(high - low)))
    # The triangulation's points: the unit square makes Triangle's exact arithmetic cheap.
    scaled = (points - low) / diagonal
    _, first, inverse = np.unique(
        np.round(scaled / UNIQUE_OF_DIAGONAL), axis=0, return_index=True, return_inverse=True
    )
    inverse = inverse.ravel()
    unique = scaled[first]
    segments = np.unique(np.sort(inverse[edges], axis=1), axis=0)
    segments = segments[segments[:, 0] != segments[:, 1]]
    found, method = _triangulate(unique, segments, time_limit)
    found = found[(found < len(unique)).all(axis=1)]
    # A position can hold several samples (of overlapping components): every one of them is joined
    # to the first, so that none is left out.
    beside = np.stack([first[inverse], np.arange(len(points))], axis=1)
    return np.concatenate([first[found], beside[beside[:, 0] != beside[:, 1]]]), method


def _triangulate(points: Array, segments: Array, time_limit: float) -> tuple[Array, str]:
    """Edges of the triangulation, (m, 2), and how they were found."""
    along, flat = _on_one_line(points)
    if flat:
        return along, "along the line"
    found, method = _triangle(points, segments, time_limit)
    if found is not None:
        return found, method
    return _delaunay(points), f"scipy Delaunay ({method})"


def _on_one_line(points: Array) -> tuple[Array, bool]:
    """Edges between neighbours along the points' longest direction, and whether they have no other."""
    centred = points - points.mean(axis=0)
    _, spread, directions = np.linalg.svd(centred, full_matrices=False)
    order = np.argsort(centred @ directions[0], kind="stable")
    flat = len(points) < 3 or spread[1] <= UNIQUE_OF_DIAGONAL * spread[0]
    return np.stack([order[:-1], order[1:]], axis=1), bool(flat)


def _delaunay(points: Array) -> Array:
    """Edges of the Delaunay triangulation, (m, 2)."""
    from scipy.spatial import Delaunay, QhullError

    try:
        simplices = Delaunay(points).simplices
    except (QhullError, ValueError):  # all but on one line
        return _on_one_line(points)[0]
    sides = np.concatenate([simplices[:, [0, 1]], simplices[:, [1, 2]], simplices[:, [2, 0]]])
    return np.unique(np.sort(sides, axis=1), axis=0)


def _connect(points: Array, label: Array, pairs: Array) -> Array:
    """Add the shortest link of every group of components that the pairs leave apart."""
    while True:
        number, group = components(np.concatenate([pairs, _spanning(label)]), len(points))
        if number == 1:
            return pairs
        mine = np.flatnonzero(group == 0)
        rest = np.flatnonzero(group != 0)
        from scipy.spatial import cKDTree

        distance, nearest = cKDTree(points[mine]).query(points[rest])
        best = int(np.argmin(distance))
        pairs = np.concatenate([pairs, [[mine[nearest[best]], rest[best]]]])


def _spanning(label: Array) -> Array:
    """Edges that join the samples of each component, whatever its shape."""
    order = np.argsort(label, kind="stable")
    same = label[order[1:]] == label[order[:-1]]
    return np.stack([order[:-1][same], order[1:][same]], axis=1)


def _triangle(points: Array, segments: Array, time_limit: float) -> tuple[Array | None, str]:
    """Edges of the constrained Delaunay triangulation, or None and the reason why not."""
    if importlib.util.find_spec("triangle") is None:
        return None, "Triangle is not installed"
    if not hasattr(os, "fork"):
        return None, "this system has no fork to run Triangle apart"
    reading, writing = os.pipe()
    sys.stdout.flush()  # or the child would hold a second copy of what is still buffered
    worker = os.fork()
    if worker == 0:
        _work(points, segments, reading, writing)
    os.close(writing)
    try:
        answer, why = _receive(reading, time.monotonic() + time_limit)
    finally:
        os.close(reading)
        if _still_running(worker):
            os.kill(worker, signal.SIGKILL)
            os.waitpid(worker, 0)
    if why:
        return None, why
    triangles, vertices = answer
    if vertices < len(points):
        return None, "Triangle lost points"
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    return np.unique(np.sort(sides, axis=1), axis=0).astype(int), "Triangle, constrained Delaunay"


def _still_running(worker: int) -> bool:
    """Whether the worker has not ended yet; one that has is reaped."""
    done, _ = os.waitpid(worker, os.WNOHANG)
    return done == 0


def _work(points: Array, segments: Array, reading: int, writing: int) -> None:
    """The worker: triangulate, send the triangles, end without running the parent's clean-up."""
    status = 1
    try:
        os.close(reading)
        silent = os.open(os.devnull, os.O_WRONLY)  # Triangle prints its errors on stdout
        os.dup2(silent, 1)
        os.dup2(silent, 2)
        import triangle

        # c: the convex hull too; without it what no curve encloses would be carved away.
        result = triangle.triangulate({"vertices": points, "segments": segments}, "pc")
        answer = io.BytesIO()
        np.savez(answer, triangles=result["triangles"], vertices=len(result["vertices"]))
        with os.fdopen(writing, "wb") as pipe:
            pipe.write(answer.getbuffer())
        status = 0
    finally:
        os._exit(status)


def _receive(reading: int, deadline: float) -> tuple[tuple, str]:
    """What the worker sends, or why nothing came."""
    chunks = []
    while True:
        left = deadline - time.monotonic()
        if left <= 0 or not select.select([reading], [], [], left)[0]:
            return (), "Triangle took too long"
        chunk = os.read(reading, 1 << 20)
        if not chunk:
            break
        chunks.append(chunk)
    if not chunks:
        return (), "Triangle failed"
    try:
        with np.load(io.BytesIO(b"".join(chunks)), allow_pickle=False) as answer:
            return (answer["triangles"], int(answer["vertices"])), ""
    except (zipfile.BadZipFile, ValueError, EOFError):  # killed half-way
        return (), "Triangle failed"
