# SPDX-License-Identifier: GPL-2.0-or-later
"""One case of a clip-art folder, reshaped from file to file in this process, with its figures."""

from __future__ import annotations

import io
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import inkex
import numpy as np
from lxml import etree

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

import clipart

from alup.document import reading, writing
from alup.messages.errors import AlupError
from alup.session import metrics, pipeline
from alup.session.pipeline import Options

# Drawings that may be copied, with cases: public domain and MIT.
DRAWINGS = clipart.DRAWINGS


@dataclass(frozen=True)
class Trial:
    """What became of a case.

    before, after : SVG files as bytes; report : of the run, `exact` in it where the case has a known solution
    low, high : (2,) bounds of all curves before and after, user units; seconds : with reading and writing
    error : the message for the user where the run was refused, else empty; moved : (N, 2) samples after
    """

    name: str
    before: bytes
    after: bytes
    report: dict[str, Any] = field(default_factory=dict)
    low: tuple[float, float] = (0.0, 0.0)
    high: tuple[float, float] = (1.0, 1.0)
    seconds: float = 0.0
    error: str = ""
    moved: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))


def cases(folder: Path = DRAWINGS) -> dict[str, dict[str, Any]]:
    return {entry["name"]: entry for entry in clipart.cases(folder)}


def load(entry: dict[str, Any], folder: Path = DRAWINGS) -> tuple[bytes, Any, list[Any]]:
    """A case's file with its handles, its root as inkex has it, and the elements that are selected."""
    built = clipart.build(entry, folder=folder)
    before = etree.tostring(built.tree)
    root = inkex.load_svg(io.BytesIO(before)).getroot()
    return before, root, [root.getElementById(name) for name in built.ids]


def run(entry: dict[str, Any], options: Options, folder: Path = DRAWINGS) -> Trial:
    """Reshape a case."""
    before, root, chosen = load(entry, folder)
    begun = time.perf_counter()
    try:
        read = reading.read(root, chosen, False, options.hold != pipeline.APART)
        result = pipeline.reshape(read.drawing, options)
        tolerance = options.fit_tolerance * float(read.drawing.size.max())
        ignored = result.report["ignored_handles"] + read.ignored
        writing.write(read, result.refitted, True, tolerance, ignored)
    except AlupError as error:
        return Trial(entry["name"], before, before, error=str(error))
    seconds = time.perf_counter() - begun
    report = dict(result.report)
    if "exact" in entry:
        a, b, c, d, e, f = entry["exact"]["matrix"]
        wanted = result.samples.points @ np.array([[a, b], [c, d]]) + [e, f]
        diagonal = read.drawing.diagonal
        report["exact"] = metrics.distance_to_exact(result.moved, wanted, result.samples.edges, diagonal)
    seen = [result.samples.points, result.moved, read.drawing.bystanders.reshape(-1, 2)]
    seen += [np.array([h[key] for h in entry["handles"]]) for key in ("source", "target")]
    every = np.concatenate(seen)
    low, high = every.min(axis=0), every.max(axis=0)
    after = etree.tostring(root)
    return Trial(entry["name"], before, after, report, tuple(low), tuple(high), seconds, "", result.moved)
