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
    with Triangulation(points, edges, time_limit) as triangulation:
        return between(points, label, triangulation)


def between(points: Array, label: Array, triangulation: Triangulation) -> Scaffold:
    """The sides of a triangulation of samples (N, 2) that join different components, labels (N,)."""
    if not len(label) or label.max() == 0:
        return Scaffold(np.zeros((0, 2), dtype=int), "none")
    pairs, method = triangulation.sides()
    pairs = pairs[label[pairs[:, 0]] != label[pairs[:, 1]]]
    return Scaffold(_connect(points, label, pairs), method)


class Triangulation:
    """The constrained Delaunay triangulation of samples (N, 2) and edges (E, 2), made by a worker meanwhile.

    A context manager: the worker does not outlive it.  time_limit : seconds from now
    """

    def __init__(self, points: Array, edges: Array, time_limit: float = TRIANGLE_TIME_LIMIT):
        self._count = len(points)
        self._worker: _Worker | None = None
        self._why = ""
        if not self._count:
            return
        low, high = points.min(axis=0), points.max(axis=0)
        diagonal = float(np.hypot(*(high - low)))
        # The triangulation's points: the unit square makes Triangle's exact arithmetic cheap.
        scaled = (points - low) / max(diagonal, 1e-300)
        _, self._first, inverse = np.unique(
            np.round(scaled / UNIQUE_OF_DIAGONAL), axis=0, return_index=True, return_inverse=True
        )
        self._inverse = inverse.ravel()
        self._unique = scaled[self._first]
        segments = np.unique(np.sort(self._inverse[edges], axis=1), axis=0)
        segments = segments[segments[:, 0] != segments[:, 1]]
        self._along, self._flat = _on_one_line(self._unique)
        if self._flat:
            return
        if importlib.util.find_spec("triangle") is None:
            self._why = "Triangle is not installed"
        elif not hasattr(os, "fork"):
            self._why = "this system has no fork to run Triangle apart"
        else:
            try:
                self._worker = _Worker(self._unique, segments, time_limit)
            except OSError as error:  # too many processes or files, or no memory for one more
                self._why = f"no worker for Triangle: {error.strerror}"

    def __enter__(self) -> Triangulation:
        return self

    def __exit__(self, *_: object) -> None:
        if self._worker is not None:
            self._worker.end()

    def sides(self) -> tuple[Array, str]:
        """All sides (m, 2), samples, and how they were found."""
        if not self._count:
            return np.zeros((0, 2), dtype=int), "none"
        found, method = self._found()
        found = found[(found < len(self._unique)).all(axis=1)]
        # A position can hold several samples (of overlapping components): every one of them is joined
        # to the first, so that none is left out.
        beside = np.stack([self._first[self._inverse], np.arange(self._count)], axis=1)
        return np.concatenate([self._first[found], beside[beside[:, 0] != beside[:, 1]]]), method

    def _found(self) -> tuple[Array, str]:
        if self._flat:
            return self._along, "along the line"
        triangles, why = self._worker.triangles() if self._worker is not None else (None, self._why)
        if triangles is None:
            return _delaunay(self._unique), f"scipy Delaunay ({why})"
        sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
        return np.unique(np.sort(sides, axis=1), axis=0).astype(int), "Triangle, constrained Delaunay"


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


class _Worker:
    """A forked process that runs Triangle."""

    def __init__(self, points: Array, segments: Array, time_limit: float):
        self._points = len(points)
        self._deadline = time.monotonic() + time_limit
        self._reading, writing = os.pipe()
        if sys.stdout is not None:  # it may be closed
            sys.stdout.flush()  # or the child would hold a second copy of what is still buffered
        try:
            self._process = os.fork()
        except OSError:
            os.close(self._reading)
            os.close(writing)
            raise
        if self._process == 0:
            _work(points, segments, self._reading, writing, time_limit)
        os.close(writing)

    def triangles(self) -> tuple[Array | None, str]:
        """Triangles (m, 3), or None and the reason why not."""
        answer, why = _receive(self._reading, self._deadline)
        if why:
            return None, why
        triangles, vertices = answer
        if vertices < self._points:
            return None, "Triangle lost points"
        return triangles, ""

    def end(self) -> None:
        os.close(self._reading)
        try:
            if _still_running(self._process):
                os.kill(self._process, signal.SIGKILL)
                os.waitpid(self._process, 0)
        except ChildProcessError:  # whoever started us ignores SIGCHLD, then the system reaps
            self._process = 0


def _still_running(worker: int) -> bool:
    """Whether the worker has not ended yet; one that has is reaped."""
    done, _ = os.waitpid(worker, os.WNOHANG)
    return done == 0


def _work(points: Array, segments: Array, reading: int, writing: int, time_limit: float) -> None:
    """The worker: triangulate, send the triangles, end without running the parent's clean-up."""
    status = 1
    try:
        # Should the parent be ended by a signal, nobody waits for this process: it ends by itself.
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, time_limit + 1.0)
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
