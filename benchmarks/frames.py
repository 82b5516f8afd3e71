#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Time the frames of a drag on every case, from new places of the handles to new path data.

python benchmarks/frames.py [--repeat N] [--write FILE] [NAME ...]

A drag moves all handles of a case from rest to their targets.  In a frame the handle that goes farthest moves
by 1 % of the drawing's diagonal.  A frame is `Session.solve` with a tolerance for frames, and then
`Outlines.changed`; its time is the least of N drags.  The *first* frame includes welding, sampling and
analysing; it is the least of N sessions.  The *answer* is `Session.solve` without a tolerance at the end of
the drag.  *off* is the distance of the last frame from it, relative to the diagonal, for the farthest sample
and the median.  There is no answer during the drag.

Times are processor time with one thread, which is the time on the clock of an idle machine.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import one_thread  # noqa: F401 - before numpy is imported

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

import clipart
import numpy as np
import results
from tqdm import tqdm

from alup.document import frame_outlines, reading
from alup.session.session import FRAME, Session

# Move in a frame of the handle that moves farthest, relative to the diagonal.
STEP = 0.01

TITLE = "Frames of a drag"
COLUMNS = (
    "vertices",
    "segments",
    "first ms",
    "frames",
    "median ms",
    "95 % ms",
    "answer ms",
    "off max",
    "off median",
)


@dataclass(frozen=True)
class Drag:
    """What one case's drags took.

    first, answer : seconds; frames : (K,) seconds, without the first; off : largest and median distance
    """

    vertices: int
    segments: int
    first: float
    frames: np.ndarray
    answer: float
    off: tuple[float, float]


def main() -> int:
    given = results.parser_of_cases(__doc__).parse_args()
    found = {
        entry["name"]: dragged(entry, given.repeat)
        for entry in tqdm(results.cases(given.names), desc="cases", dynamic_ncols=True, file=sys.stderr)
    }
    lines = list(table(found))
    print("\n".join(lines))
    results.write_section(given.write, TITLE, lines)
    return 0


def dragged(entry: dict[str, Any], repeat: int) -> Drag:
    """Drag the handles of a case."""
    svg, chosen = clipart.build(entry).opened()
    read = reading.read(svg, chosen, False, True)
    drawing = read.drawing
    goals = {one.name: (one.rest, one.target) for one in drawing.handles if one.target is not None}
    far = max(float(np.linalg.norm(target - rest)) for rest, target in goals.values())
    count = max(int(np.ceil(far / (STEP * drawing.diagonal))), 3)

    def at(share: float) -> dict[str, np.ndarray]:
        return {name: rest + share * (target - rest) for name, (rest, target) in goals.items()}

    first, frames, answers = np.inf, np.full(count - 1, np.inf), []
    for _ in range(repeat):
        began = time.process_time()
        session = Session(drawing)
        outlines = frame_outlines.Outlines(read)
        session.solve(at(0.0), FRAME)
        outlines.changed(session.solve(at(1.0 / count), FRAME).refitted)
        first = min(first, time.process_time() - began)
        for k in range(1, count):
            began = time.process_time()
            frame = session.solve(at((k + 1) / count), FRAME)
            outlines.changed(frame.refitted)
            frames[k - 1] = min(frames[k - 1], time.process_time() - began)
        began = time.process_time()
        answer = session.solve()
        answers.append(time.process_time() - began)
    off = np.linalg.norm(frame.moved - answer.moved, axis=1) / drawing.diagonal
    return Drag(
        len(answer.moved),
        len(drawing.control),
        first,
        frames,
        min(answers),
        (float(off.max()), float(np.median(off))),
    )


def table(found: dict[str, Drag]) -> list[str]:
    """Markdown, and the figures of all cases below it."""
    lines = [f"| {'case':<23} | " + " | ".join(COLUMNS) + " |", "| --- |" + " ---: |" * len(COLUMNS)]
    for name, one in found.items():
        low, high = 1000.0 * np.percentile(one.frames, (50, 95))
        number = len(one.frames) + 1
        lines.append(
            f"| {name:<23} | {one.vertices} | {one.segments} | {1000 * one.first:.0f} | {number} "
            f"| {low:.1f} | {high:.1f} | {1000 * one.answer:.0f} "
            f"| {100 * one.off[0]:.2f} % | {100 * one.off[1]:.3f} % |"
        )
    every = 1000.0 * np.concatenate([one.frames for one in found.values()])
    firsts = 1000.0 * np.array([one.first for one in found.values()])
    answers = 1000.0 * np.array([one.answer for one in found.values()])
    off = 100.0 * np.array([one.off[0] for one in found.values()])
    return [
        *lines,
        "",
        f"* A frame of all cases' {len(every)}: median {np.median(every):.1f} ms, "
        f"95 % {np.percentile(every, 95):.1f} ms, slowest {every.max():.0f} ms; "
        f"{np.mean(every <= 16.0):.1%} within 16 ms, {np.mean(every <= 50.0):.1%} within 50 ms.",
        f"* First frame after reading: median {np.median(firsts):.0f} ms, slowest {firsts.max():.0f} ms.",
        f"* Answer at rest: median {np.median(answers):.0f} ms, slowest {answers.max():.0f} ms.",
        f"* Last frame from the answer, farthest sample: median {np.median(off):.2f} % of the diagonal, "
        f"90 % {np.percentile(off, 90):.1f} %, worst {off.max():.1f} %.",
        "",
        results.machine(),
    ]


if __name__ == "__main__":
    sys.exit(main())
