# SPDX-License-Identifier: GPL-2.0-or-later
"""Pictures of the live window: the real page in a real Chromium.  `screenshots.py` calls this.

The actions of a person are played.  An arrow is drawn for the pointer, because Chromium paints none by
itself.
"""

from __future__ import annotations

import io
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Iterator, Sequence

import numpy as np
from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

import chromium  # noqa: E402

from alup.document.tree import loading  # noqa: E402
from alup.live import window as live  # noqa: E402
from alup.live.engine import Engine  # noqa: E402
from alup.live.server import Server  # noqa: E402
from alup.session.options import Options  # noqa: E402

DATA = ROOT / "benchmarks" / "drawings"
TRUCK, TROPHY = DATA / "flat-in_transit.svg", DATA / "oca-trophy.svg"

# Sizes of the guide's pictures and of the animation, pixels.
SIZE, SMALL = (1000, 640), (720, 470)

# The animation: number of colours, milliseconds of a picture, and of a picture to look at.
COLOURS, PACE, PAUSE = 96, 90, 700

_POINTER = """
() => {
  const pointer = document.createElement("div");
  pointer.id = "pointer";
  pointer.style.cssText = "position:fixed;left:0;top:0;width:0;height:0;z-index:9;pointer-events:none";
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.style.cssText = "position:absolute;width:20px;height:24px;overflow:visible";
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  path.setAttribute("d", "M0,0 V17 L4,13.5 L6.8,20 L9.6,18.8 L6.9,12.4 H12.3 Z");
  path.setAttribute("fill", "#000");
  path.setAttribute("stroke", "#fff");
  path.setAttribute("stroke-width", "1.3");
  svg.append(path);
  pointer.append(svg);
  document.body.append(pointer);
  addEventListener("pointermove", (event) => {
    pointer.style.transform = `translate(${event.clientX}px,${event.clientY}px)`;
  }, true);
}
"""


class Play(chromium.Window):
    """A window with a visible pointer, whose pictures can be recorded."""

    def __init__(self, page: Any, engine: Engine):
        super().__init__(page)
        self.engine = engine
        self.film: list[tuple[bytes, int]] | None = None
        self.place = np.zeros(2)

    def near(self, point: Any) -> Any:
        """The nearest point of the curves."""
        found = self.engine.near(np.asarray(point), np.inf)
        assert found is not None
        return np.array(found["at"])

    def look(self, milliseconds: int = PACE) -> None:
        if self.film is not None:
            self.page.wait_for_timeout(30)
            self.film.append((self.page.screenshot(), milliseconds))

    def go(self, to: Sequence[float], steps: int = 5) -> None:
        """Move the pointer to a point of the drawing, over so many pictures."""
        begin, end = self.place, np.array(self.at(to))
        for n in range(1, steps + 1):
            self.place = begin + (end - begin) * n / steps
            self.page.mouse.move(*self.place)
            self.look()

    def pin(self, at: Sequence[float]) -> None:
        count = len(self.pins())
        self.go(at)
        self.page.mouse.down()
        self.page.mouse.up()
        self.wait_for_pins(count + 1)
        self.look(3 * PACE)

    def pull(self, start: Sequence[float], end: Sequence[float], steps: int = 12, hold: bool = False) -> None:
        """Drag from one point of the drawing to another.  hold : and do not let go"""
        self.go(start)
        self.page.mouse.down()
        self.page.wait_for_timeout(600)
        self.go(end, steps)
        self.page.wait_for_timeout(600)
        self.look(PAUSE)
        if not hold:
            self.page.mouse.up()
            self.settled()
            self.look(PAUSE)


@contextmanager
def shown(browser: Any, drawing: Path, size: tuple[int, int]) -> Iterator[Play]:
    engine = Engine(loading.parse(drawing.read_bytes()).getroot(), [], Options())
    server = Server(live.answers(engine))
    context = browser.new_context(viewport=dict(zip(("width", "height"), size)), color_scheme="light")
    play = Play(context.new_page(), engine)
    try:
        play.open(server.address)
        play.page.evaluate(_POINTER)
        yield play
    finally:
        context.close()
        server.close()
        engine.close()


def make(images: Path) -> dict[str, bytes]:
    """The guide's pictures as PNG, by their names; the animation is written into the folder."""
    found: dict[str, bytes] = {}
    with chromium.chromium() as browser:
        with shown(browser, TRUCK, SIZE) as play:
            play.go((30.0, 5.0), 1)
            found["live-1-open"] = play.page.screenshot()
            for at in ((8.0, 36.0), (4.0, 18.0), (30.0, 36.0)):
                play.pin(at)
            play.go((48.0, 27.0))
            play.settled()
            found["live-2-pins"] = play.page.screenshot()
            play.pull((48.0, 27.0), (57.0, 27.0), hold=True)
            found["live-3-drag"] = play.page.screenshot()
            play.page.mouse.up()
            play.settled()
        with shown(browser, TRUCK, SIZE) as play:
            play.pin((4.0, 18.0))
            play.pin((8.0, 36.0))
            # Around cab and front wheel; its middle moves both.
            play.pull((50.0, 43.0), (29.0, 8.0))
            play.pull((39.5, 25.5), (46.5, 25.5))
            found["live-4-frame"] = play.page.screenshot()
        with shown(browser, TROPHY, SIZE) as play:
            play.page.check("#symmetric")
            low, high = np.array(play.engine.drawing()["bounds"])
            play.pin(play.near(low + (high - low) * [0.5, 1.0]))
            start = play.near(low + (high - low) * [0.0, 0.2])
            play.pull(start, start + (high - low) * [-0.12, 0.0])
            found["live-5-symmetric"] = play.page.screenshot()
        animate(browser, images / "live.png")
    return found


def animate(browser: Any, file: Path) -> None:
    """A visit of ten seconds as an animated PNG."""
    with shown(browser, TRUCK, SMALL) as play:
        play.place = np.array([600.0, 80.0])
        play.film = []
        play.look(PAUSE)
        for at in ((8.0, 36.0), (4.0, 18.0)):
            play.pin(at)
        play.pull((48.0, 27.0), (56.0, 27.0), 14)
        play.pull((14.0, 9.0), (14.0, 4.0), 8)
        play.page.keyboard.down("b")
        play.look(PAUSE)
        play.page.keyboard.up("b")
        play.look(2 * PAUSE)
        film = play.film
    pictures = [Image.open(io.BytesIO(data)).convert("RGB") for data, _time in film]
    # One palette for all, of a picture that has everything in it.
    palette = pictures[len(pictures) // 2].quantize(COLOURS, dither=Image.Dither.NONE)
    reduced = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in pictures]
    reduced[0].save(
        file, save_all=True, append_images=reduced[1:], duration=[time for _data, time in film], loop=0
    )
