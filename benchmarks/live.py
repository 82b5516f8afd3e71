#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Time the live window on every case, from an event of the pointer in a real Chromium to its picture.

python benchmarks/live.py [--repeat N] [--write FILE] [NAME ...]

Handles of a case that stay are pins.  The mouse drags the handle that goes farthest to its target, with 60
events a second for 1.5 s.  A person has one mouse, so the other moving handles are left out.  A *picture* is
an answer of the engine that the browser has painted.  Its time begins at the event that asked for it.  The
*first* picture includes welding, sampling and analysing if these have not ended when the drag begins; the
other figures leave it out.  The drag with the least median time of N counts.

Times are on the clock and include whatever else the machine does.  Chromium runs without a window and without
a graphics processor.
"""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import one_thread  # noqa: F401 - before numpy is imported

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

import chromium
import clipart
import numpy as np
import results
from tqdm import tqdm

from alup.live import window
from alup.live.engine import Engine
from alup.live.server import Server
from alup.session.options import Options

EVENTS = 90

TITLE = "The live window"
COLUMNS = ("samples", "elements", "first ms", "pictures", "a second", "median ms", "95 % ms", "engine ms")

# Moves the pointer from one place of the window to another, with one event per picture of the screen.
_DRAG = """
([from, to, count]) => new Promise((resolve) => {
  const stage = document.getElementById("stage");
  let n = 0;
  const step = () => {
    n += 1;
    const [x, y] = from.map((start, axis) => start + (to[axis] - start) * n / count);
    const event = {clientX: x, clientY: y, pointerId: 1, pointerType: "mouse", buttons: 1, bubbles: true};
    stage.dispatchEvent(new PointerEvent("pointermove", event));
    if (n < count) requestAnimationFrame(step);
    else setTimeout(resolve, 300);
  };
  performance.clearMeasures();
  requestAnimationFrame(step);
})
"""
_PICTURES = "() => performance.getEntriesByName('picture').map((one) => [one.startTime, one.duration])"


@dataclass(frozen=True)
class Drag:
    """Pictures of one drag.

    times : (k,) ms from the pointer's event on; rate : a second; engine : ms a frame
    """

    samples: int
    elements: int
    first: float
    times: np.ndarray
    rate: float
    engine: float


def main() -> int:
    given = results.parser_of_cases(__doc__).parse_args()
    found: dict[str, Drag] = {}
    with chromium.chromium() as browser:
        for entry in tqdm(results.cases(given.names), desc="cases", dynamic_ncols=True, file=sys.stderr):
            found[entry["name"]] = min(
                (dragged(browser, entry) for _ in range(given.repeat)),
                key=lambda drag: float(np.median(drag.times)),
            )
    lines = list(table(found))
    print("\n".join(lines))
    results.write_section(given.write, TITLE, lines)
    return 0


def dragged(browser: Any, entry: dict[str, Any]) -> Drag:
    """Drag a case's farthest handle in a page of its own."""
    far = max(entry["handles"], key=lambda one: np.hypot(*np.subtract(one["target"], one["source"])))
    pins = [one for one in entry["handles"] if one["source"] == one["target"]]
    engine = Engine(*clipart.build({**entry, "handles": [*pins, far]}, still=True).opened(), Options())
    server = Server(window.answers(engine))
    timed: list[float] = []
    ask = server.answers["drag"]

    def drag(question: dict) -> Any:
        answer = ask(question)
        timed.append(answer["ms"])
        return answer

    server.answers["drag"] = drag
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    shown = chromium.Window(context.new_page())
    try:
        shown.open(server.address)
        shown.settled()
        begin, end = shown.at(far["source"]), shown.at(far["target"])
        mouse = shown.page.mouse
        mouse.move(*begin)
        mouse.down()
        shown.page.wait_for_timeout(150)
        shown.page.evaluate(_DRAG, [begin, end, EVENTS])
        pictures = np.array(shown.page.evaluate(_PICTURES))
        mouse.up()
        samples = engine.moving.samples
    finally:
        context.close()
        server.close()
        engine.close()
    ends = pictures.sum(axis=1)
    rate = 1000.0 * (len(ends) - 2) / (ends[-1] - ends[1]) if len(ends) > 2 else 0.0
    times = pictures[1:, 1] if len(pictures) > 1 else pictures[:, 1]
    return Drag(samples, len(engine.whole.keys), pictures[0, 1], times, rate, float(np.median(timed[1:])))


def table(found: dict[str, Drag]) -> list[str]:
    """Markdown, and the figures of all cases below it."""
    lines = [f"| {'case':<23} | " + " | ".join(COLUMNS) + " |", "| --- |" + " ---: |" * len(COLUMNS)]
    for name, one in found.items():
        low, high = np.percentile(one.times, (50, 95))
        lines.append(
            f"| {name:<23} | {one.samples} | {one.elements} | {one.first:.0f} | {len(one.times) + 1} "
            f"| {one.rate:.0f} | {low:.0f} | {high:.0f} | {one.engine:.1f} |"
        )
    rates = np.array([one.rate for one in found.values()])
    medians = np.array([np.median(one.times) for one in found.values()])
    every = np.concatenate([one.times for one in found.values()])
    firsts = np.array([one.first for one in found.values()])
    return [
        *lines,
        "",
        f"* Pictures a second, of the cases: median {np.median(rates):.0f}, 5 % worst "
        f"{np.percentile(rates, 5):.0f}, least {rates.min():.0f}; the screen shows 60.",
        f"* From the pointer to the picture: median {np.median(medians):.0f} ms, the 5 % worst cases "
        f"{np.percentile(medians, 95):.0f} ms; of all {len(every)} pictures median {np.median(every):.0f} "
        f"ms, 95 % {np.percentile(every, 95):.0f} ms, slowest {every.max():.0f} ms.",
        f"* First picture of a drag: median {np.median(firsts):.0f} ms, slowest {firsts.max():.0f} ms.",
        f"* Processes that wanted a core at the end, ours among them: {os.getloadavg()[1]:.0f}.",
        "",
        results.machine(),
    ]


if __name__ == "__main__":
    sys.exit(main())
