#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Actions and seconds from an opened file to the first visible result, in a real Inkscape and browser.

python benchmarks/live_menu.py [--home FOLDER] [--write FILE]

There are two actions: *Reshape live* is chosen from the menu, and the front of a truck is pulled.  The time
is from the key that opens the menu until the window shows a changed shape.  The mouse moves at once, faster
than a person.  The browser's first start with a new profile is included.  FOLDER is a home folder for which
install.sh has been run.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

import one_thread  # noqa: F401 - for the processes that are started, too

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

import chromium
import inkscape as harness
import numpy as np
import results
import window as desk

DRAWING = ROOT / "benchmarks" / "drawings" / "flat-in_transit.svg"
CAB = "#FFC107"
TITLE = "From an opened file to the first result"

# Share of the picture that changes when the front follows; a new pin changes less.
CHANGED = 0.004


def main() -> int:
    parser = results.parser(__doc__)
    parser.add_argument("--home", type=Path)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        home = given.home or harness.installed_home(folder)
        opened, result = measured(harness.extensions_of(home), folder)
    lines = [
        f"* 2 actions: the menu, and one pull; {opened:.1f} s until the window shows the drawing, "
        f"{result:.1f} s until it shows a result.",
        "",
        results.machine(),
    ]
    print("\n".join(lines))
    results.write_section(given.write, TITLE, lines)
    return 0


def measured(extensions: Path, folder: Path) -> tuple[float, float]:
    """Seconds from the menu to the window with the drawing, and to the first result."""
    sandbox = "--no-sandbox" if os.getuid() == 0 else ""
    command = f'{chromium.PROGRAM} {sandbox} --user-data-dir={folder}/profile --no-first-run --app="$1"'
    browser = folder / "browser"
    browser.write_text(f"#!/bin/sh\nTMPDIR=/tmp exec {command} >/dev/null 2>&1\n")
    browser.chmod(0o755)
    os.environ["ALUP_BROWSER"] = str(browser)
    drawing = folder / "truck.svg"
    drawing.write_bytes(DRAWING.read_bytes())
    with ExitStack() as stack:
        screen = stack.enter_context(desk.screen(folder / "screen"))
        window = stack.enter_context(desk.open_window(screen, extensions, drawing, folder / "window"))
        before = screen.picture()
        began = time.monotonic()
        window.choose("Reshape live")

        def shown() -> bool:
            picture = screen.picture()
            there = screen.windows("^Reshape live$") and not np.array_equal(picture, before)
            return bool(there) and len(_cab(picture)[0]) > 1000

        screen.wait("the drawing", shown, desk.START_SECONDS)
        identity = screen.windows("^Reshape live$")[0]
        box = screen.xdotool("getwindowgeometry", "--shell", identity)
        left, top, width, height = (
            int(box.split(f"{name}=")[1].split()[0]) for name in ("X", "Y", "WIDTH", "HEIGHT")
        )

        def cab() -> np.ndarray:
            rows, columns = _cab(screen.picture()[top : top + height, left : left + width])
            return np.array([[columns.min(), rows.min()], [columns.max(), rows.max()]])

        # Wait until the cab is drawn in the window itself.
        screen.wait("the cab", lambda: len(_cab(screen.picture()[top : top + height])[0]) > 1000)
        opened = time.monotonic() - began
        low, high = cab()
        start = np.array([left + high[0], top + low[1] + 0.75 * (high[1] - low[1])])
        picture = screen.picture()
        arguments: list[object] = ["mousemove", *start.astype(int), "mousedown", 1]
        for n in range(1, 13):
            arguments += ["sleep", 0.03, "mousemove", *(start + [5 * n, 0]).astype(int)]
        screen.xdotool(*arguments)
        screen.wait("a result", lambda: np.mean(screen.picture() != picture) > CHANGED)
        result = time.monotonic() - began
        screen.xdotool("mouseup", 1)
        return opened, result


def _cab(picture: np.ndarray) -> tuple[np.ndarray, ...]:
    return np.nonzero((picture == np.frombuffer(bytes.fromhex(CAB[1:]), np.uint8)).all(axis=2))


if __name__ == "__main__":
    sys.exit(main())
