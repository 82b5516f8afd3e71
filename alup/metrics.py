"""Figures that say how a reshape turned out; the criteria of the paper's study (Sec. 3.1)."""

from __future__ import annotations

import numpy as np

from .model import Array
from .problem import edge_vectors


def turning(before: Array, after: Array, edges: Array) -> dict[str, float]:
    """How far the tangents turned, in degrees: mean weighted by the input's lengths, and largest.

    before, after : (N, 2) samples; edges : (E, 2) int
    """
    a, b = edge_vectors(before, edges), edge_vectors(after, edges)
    cross, dot = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], np.einsum("ed,ed->e", a, b)
    angle = np.degrees(np.abs(np.arctan2(cross, dot)))
    length = np.linalg.norm(a, axis=1)
    return {"mean": float(np.average(angle, weights=length)), "max": float(angle.max())}
