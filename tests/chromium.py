# SPDX-License-Identifier: GPL-2.0-or-later
"""The live window's page in a real Chromium without a screen, used as a person would use it.

`effect` starts the effect as a separate program.  Its browser is this file, which records the address and
waits.  Playwright then opens the address in Chromium.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Iterator, Sequence

ROOT = Path(__file__).resolve().parents[1]
PROGRAM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

# Limits of the start and the end of the effect, generous for a busy machine.
START_SECONDS, END_SECONDS = 60.0, 30.0

# The place in the window of a point of the drawing, user units.
_TO_WINDOW = """
([x, y]) => {
  const matrix = document.getElementById("now").shadowRoot.firstElementChild.getScreenCTM();
  return [matrix.a * x + matrix.e, matrix.d * y + matrix.f];
}
"""
_DATA = '(id) => document.getElementById("now").shadowRoot.getElementById(id).getAttribute("d")'


@dataclass
class Effect:
    """A run of the effect that waits for its page."""

    process: subprocess.Popen[bytes]
    address: str
    output: Path
    said: Path

    def end(self) -> int:
        """The exit code."""
        return self.process.wait(END_SECONDS)

    @property
    def words(self) -> str:
        return self.said.read_text(encoding="utf-8")


@contextmanager
def effect(drawing: Path, folder: Path, *arguments: str, **environment: str) -> Iterator[Effect]:
    """The effect with a drawing, until the context ends."""
    address, output, said = folder / "address", folder / "out.svg", folder / "stderr"
    browser = f"{sys.executable} {Path(__file__).resolve()} {address}"
    with open(said, "wb") as errors:
        process = subprocess.Popen(
            [sys.executable, str(ROOT / "alup_live.py"), f"--output={output}", *arguments, str(drawing)],
            env={**os.environ, "ALUP_BROWSER": browser, "LANGUAGE": "en", **environment},
            stdin=subprocess.DEVNULL,
            stdout=errors,
            stderr=errors,
            cwd=folder,
        )
    try:
        end = time.monotonic() + START_SECONDS
        while not address.exists() and process.poll() is None and time.monotonic() < end:
            time.sleep(0.02)
        assert address.exists(), said.read_text(encoding="utf-8")
        yield Effect(process, address.read_text(encoding="utf-8"), output, said)
    finally:
        if process.poll() is None:
            process.terminate()
        process.wait(END_SECONDS)


@contextmanager
def chromium() -> Iterator[Any]:
    """Playwright's browser."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=PROGRAM, args=["--no-sandbox"])
        yield browser
        browser.close()


@dataclass
class Window:
    """A page that shows a drawing."""

    page: Any

    def open(self, address: str) -> None:
        self.page.goto(address)
        self.page.wait_for_selector("html[data-ready]")

    def at(self, point: Sequence[float]) -> tuple[float, float]:
        """Where a point of the drawing is in the window."""
        x, y = self.page.evaluate(_TO_WINDOW, list(point))
        return x, y

    def data(self, identity: str) -> str:
        """Path data of an element as it is shown now."""
        return str(self.page.evaluate(_DATA, identity))

    def pins(self) -> list[Any]:
        return self.page.query_selector_all(".pin:not(.corner)")

    def wait_for_pins(self, count: int) -> None:
        script = "(count) => document.querySelectorAll('.pin:not(.corner)').length === count"
        self.page.wait_for_function(script, arg=count)

    def click(self, point: Sequence[float]) -> None:
        self.page.mouse.click(*self.at(point))

    def drag(self, start: Sequence[float], end: Sequence[float], steps: int = 6) -> None:
        """Press, move and release; all in units of the drawing."""
        begin, goal = self.at(start), self.at(end)
        self.page.mouse.move(*begin)
        self.page.mouse.down()
        for n in range(1, steps + 1):
            self.page.mouse.move(*(b + (g - b) * n / steps for b, g in zip(begin, goal)))
        self.page.mouse.up()

    def settled(self) -> None:
        """Wait until the whole document is shown as it will be written."""
        self.page.wait_for_function("() => document.documentElement.dataset.settled === 'true'")


if __name__ == "__main__":
    # Renamed when it is whole, so that no reader sees a part of it.
    part = Path(sys.argv[1] + ".part")
    part.write_text(sys.argv[2], encoding="utf-8")
    part.rename(sys.argv[1])
    while os.getppid() != 1:
        time.sleep(0.1)
