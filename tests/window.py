# SPDX-License-Identifier: GPL-2.0-or-later
"""Inkscape in a real window on a virtual screen, used by keyboard and mouse.

Xvfb keeps its picture in a file.  openbox gives windows their titles and the focus.  xdotool presses keys and
buttons.  Results are read from titles, from the picture, from the file that Inkscape saves, and from the
effects' exit codes, which a wrapper of the interpreter records.  No step waits for a fixed time: it ends when
its result is there, or fails with a picture of the screen.
"""

from __future__ import annotations

import io
import os
import signal
import struct
import subprocess
import time
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from shutil import which
from typing import Any, Callable, Iterator, Mapping, Sequence, TypeVar
from xml.sax.saxutils import quoteattr

import numpy as np
from builders import Array, Point
from inkscape import ROOT, clean_environment
from lxml import etree
from PIL import Image
from scipy import ndimage

PROGRAMS = ("Xvfb", "openbox", "xdotool")

# Start-up takes 5-10 s, an effect 1-4 s; both cores may be busy.
START_SECONDS, STEP_SECONDS, KEY_SECONDS, _END_SECONDS = 60.0, 30.0, 10.0, 5.0
_LOOK_SECONDS = 0.1

# After so many equal pictures in a row the screen is at rest.
_QUIET_LOOKS = 4

# From the corner at the lower left of an effect's dialog to its box Live preview, in pixels.
_PREVIEW_BOX = (24, -58)

# Space of toolbars, rulers and the like at the top, right, bottom and left, in pixels, with a margin.
_BARS = (160, 40, 100, 60)

# Height of what openbox adds to a window, in pixels.
_TITLE_BAR = 22

# Pixels between two positions of the mouse while it drags.
_DRAG_STEP = 8

Found = TypeVar("Found")

_WRAPPER = """#!/bin/sh
python3 "$@" 2>>'{folder}/stderr'
code=$?
echo $code >>'{folder}/codes'
exit $code
"""

# Without border and shadow of the page, which would darken objects at its edge.
_PREFERENCES = """<?xml version="1.0" encoding="UTF-8"?>
<inkscape version="1">
  <group id="options"><group id="boot" enabled="0"/></group>
  <group id="theme" defaultGtkTheme="Adwaita" gtkTheme="Adwaita" preferDarkTheme="0" darkTheme="0"/>
  <group id="template"><group id="base" pageshadow="0" borderopacity="0"/></group>
  <group id="extensions" python-interpreter={wrapper}{parameters}/>
</inkscape>
"""

# A blinking caret would keep the screen from coming to rest.
_GTK = """[Settings]
gtk-cursor-blink=0
gtk-enable-animations=0
"""


class WindowError(AssertionError):
    """A step's result did not come.  The message names a picture of the screen."""


def png(picture: Array) -> bytes:
    """A picture (h, w, 3) uint8 as the bytes of a PNG file."""
    file = io.BytesIO()
    Image.fromarray(picture).save(file, "PNG")
    return file.getvalue()


def discs(picture: Array, colour: str) -> Array:
    """Centres (n, 2) x, y of the filled circles of a colour, in pixels.  picture : (h, w, 3)."""
    wanted = np.frombuffer(bytes.fromhex(colour[1:]), np.uint8)
    areas, _ = ndimage.label((picture == wanted).all(axis=2))
    found = []
    for number, (rows, columns) in enumerate(ndimage.find_objects(areas), start=1):
        part = areas[rows, columns] == number
        height, width = part.shape
        # A disc fills pi / 4 of its box; swatches of the palette fill theirs.
        if min(part.shape) >= 3 and abs(height - width) <= 2 and 0.6 <= part.mean() <= 0.9:
            found.append([columns.start + (width - 1) / 2.0, rows.start + (height - 1) / 2.0])
    return np.array(found).reshape(-1, 2)


def inside(picture: Array, colour: str) -> Array:
    """The pixel x, y that is farthest inside the areas of exactly this colour.  picture : (h, w, 3)."""
    wanted = np.frombuffer(bytes.fromhex(colour[1:]), np.uint8)
    depth = ndimage.distance_transform_edt((picture == wanted).all(axis=2))
    return np.array(np.unravel_index(depth.argmax(), depth.shape))[::-1]


def canvas(picture: Array) -> Array:
    """The part of a picture that shows the drawing, without toolbars, rulers and the status bar."""
    top, right, bottom, left = _BARS
    return picture[top:-bottom, left:-right]


@dataclass(frozen=True)
class Screen:
    """A screen with a window manager."""

    display: str
    folder: Path  # of the picture's file, and of pictures of failures

    def picture(self) -> Array:
        """What is to be seen now: (h, w, 3) uint8, red, green, blue."""
        data = (self.folder / "Xvfb_screen0").read_bytes()  # an xwd file: numbers, colours, pixels
        header = struct.unpack(">25I", data[:100])
        offset, width, height, line, colours = header[0], header[4], header[5], header[12], header[19]
        rows = np.frombuffer(data, np.uint8, height * line, offset + 12 * colours)
        return rows.reshape(height, line // 4, 4)[:, :width, 2::-1].copy()

    def xdotool(self, *arguments: object) -> str:
        done = subprocess.run(
            ["xdotool", *map(str, arguments)],
            env=clean_environment(DISPLAY=self.display),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=KEY_SECONDS,
        )
        return done.stdout.strip()

    def windows(self, title: str) -> list[str]:
        """Visible windows by a regular expression for their title."""
        return self.xdotool("search", "--onlyvisible", "--name", title).split()

    def wait(self, what: str, there: Callable[[], Found], seconds: float = STEP_SECONDS) -> Found:
        """The first answer that is not false."""
        end = time.monotonic() + seconds
        while True:
            found = there()
            if found:
                return found
            if time.monotonic() > end:
                file = self.folder / "failure.png"
                file.write_bytes(png(self.picture()))
                raise WindowError(f"{what}: not within {seconds:g} s; the screen is in {file}")
            time.sleep(_LOOK_SECONDS)

    def rest(self, seconds: float = STEP_SECONDS) -> Array:
        """The picture once it no longer changes, with the mouse out of the way."""
        looks: list[Array] = []
        height, width = self.picture().shape[:2]
        self.xdotool("mousemove", width, height)

        def quiet() -> bool:
            looks.append(self.picture())
            return len(looks) >= _QUIET_LOOKS and all(
                np.array_equal(look, looks[-1]) for look in looks[-_QUIET_LOOKS:]
            )

        self.wait("a screen at rest", quiet, seconds)
        return looks[-1]


@dataclass(frozen=True)
class Window:
    """Inkscape's window with one drawing."""

    screen: Screen
    drawing: Path  # is written by `save`
    folder: Path  # of the effects' exit codes and words
    identity: str  # of the window

    @property
    def title(self) -> str:
        return self.screen.xdotool("getwindowname", self.identity)

    def keys(self, *names: str) -> None:
        """Press keys one after another, in xdotool's words ("ctrl+a"), with the drawing in focus."""
        self.screen.xdotool("windowactivate", "--sync", self.identity)
        self.screen.xdotool("key", "--clearmodifiers", "--delay", 30, *names)

    def runs(self) -> list[int]:
        """Exit codes of the effects so far."""
        file = self.folder / "codes"
        return [int(code) for code in file.read_text().split()] if file.exists() else []

    def stderr(self) -> str:
        """All that the effects have said: on success nothing, for Inkscape shows it in a window."""
        file = self.folder / "stderr"
        return file.read_text(encoding="utf-8", errors="replace") if file.exists() else ""

    def choose(self, item: str) -> None:
        """Take an effect from the menu Extensions > ALUP Reshape, by its name without the number."""
        position = _menu().index(item)
        before = self.screen.rest()
        self.keys("alt+n")
        self.screen.wait("the menu", lambda: not np.array_equal(self.screen.picture(), before))
        # Two items for the previous extension come first.  The submenu opens with its first item selected.
        self.screen.xdotool("key", "--delay", 30, "Down", "Down", "Right", *["Down"] * position, "Return")

    def run(self, item: str) -> None:
        """An effect without a dialog, to its end."""
        count = len(self.runs())
        self.choose(item)
        self.finish(count + 1)

    def finish(self, count: int) -> Array:
        """Wait until that many effects have come to their end and the drawing shows it."""
        self.screen.wait("the effect's end", lambda: len(self.runs()) >= count)
        return self.screen.rest()

    @contextmanager
    def dialog(self, item: str) -> Iterator[Dialog]:
        """The dialog of an effect, closed in the end."""
        self.choose(item)
        identity = self.screen.wait(f"the dialog {item}", lambda: self.screen.windows(rf"^[0-9]. {item}$"))[0]
        self.screen.rest()
        yield Dialog(self, identity)
        self.screen.xdotool("windowactivate", "--sync", identity)
        self.screen.xdotool("key", "alt+c")
        self.screen.wait("the dialog's end", lambda: not self.screen.windows(rf"^[0-9]. {item}$"))
        self.screen.rest()

    def click(self, at: Point) -> None:
        self.screen.xdotool("mousemove", *_pixel(np.asarray(at)), "click", 1)
        self.screen.rest()

    def drag(self, start: Point, end: Point, button: int = 1) -> None:
        """Take what is at one place of the screen to another, in pixels; the button 2 moves the canvas."""
        begin, way = np.asarray(start, dtype=float), np.subtract(end, start)
        count = int(np.ceil(np.hypot(*way) / _DRAG_STEP))
        places = [begin + way * n / count for n in range(count + 1)]
        self.screen.xdotool("windowactivate", "--sync", self.identity)
        arguments: list[object] = ["mousemove", *_pixel(places[0]), "sleep", 0.1, "mousedown", button]
        for place in places[1:]:
            arguments += ["sleep", 0.02, "mousemove", *_pixel(place)]
        self.screen.xdotool(*arguments, "sleep", 0.1, "mouseup", button)
        self.screen.rest()

    def undo(self) -> None:
        self._changed("ctrl+z")

    def redo(self) -> None:
        self._changed("ctrl+shift+z")

    def save(self) -> Any:
        """Save the drawing and read it: its root element.  Fails where Inkscape knows of no change."""
        before = self.drawing.stat().st_mtime_ns
        self.keys("ctrl+s")
        self.screen.wait(
            "a saved file",
            lambda: self.drawing.stat().st_mtime_ns != before and not self.title.startswith("*"),
        )
        return self._read()

    def document(self) -> Any:
        """The drawing's root element as Inkscape has it now, saved where it knows of changes."""
        return self.save() if self.title.startswith("*") else self._read()

    def _read(self) -> Any:
        return etree.parse(str(self.drawing)).getroot()

    def _changed(self, key: str) -> None:
        """Undo or redo by a key, and wait until the title says that the drawing is not saved."""
        self.keys(key)
        self.screen.wait(f"a change by {key}", lambda: self.title.startswith("*"))
        self.screen.rest()


@dataclass(frozen=True)
class Dialog:
    """The dialog of an effect."""

    window: Window
    identity: str

    def preview(self) -> Array:
        """Switch Live preview on or off, wait for its run, and show the screen."""
        screen = self.window.screen
        height = int(
            screen.xdotool("getwindowgeometry", "--shell", self.identity).split("HEIGHT=")[1].split()[0]
        )
        count = len(self.window.runs())
        x, y = _PREVIEW_BOX
        screen.xdotool("mousemove", "--window", self.identity, x, height + y, "click", 1)
        return self.window.finish(count + 1)

    def apply(self, runs: int = 1) -> None:
        """Press Apply; runs : how many the effect makes then, none if it was previewed."""
        count = len(self.window.runs())
        self.window.screen.xdotool("windowactivate", "--sync", self.identity)
        self.window.screen.xdotool("key", "alt+a")
        self.window.finish(count + runs)


@contextmanager
def screen(folder: Path, width: int = 1100, height: int = 700) -> Iterator[Screen]:
    """A screen of its own, with a window manager, for as long as the context lasts."""
    missing = [program for program in PROGRAMS if which(program) is None]
    if missing:
        raise WindowError("not installed: " + ", ".join(missing))
    folder.mkdir(parents=True)
    read, write = os.pipe()
    with ExitStack() as stack:
        # Without -noreset the server would reset when the first xdotool exits, while openbox starts.
        command = f"Xvfb -displayfd {write} -screen 0 {width}x{height}x24 -noreset -nolisten tcp".split()
        _start(stack, [*command, "-fbdir", str(folder)], clean_environment(), folder / "xvfb.log", (write,))
        os.close(write)
        with os.fdopen(read) as answer:
            number = answer.readline().strip()  # comes when the display is ready, or empty at its end
        if not number:
            raise WindowError("Xvfb did not start: " + (folder / "xvfb.log").read_text())
        shown = Screen(":" + number, folder)
        environment = clean_environment(DISPLAY=shown.display, HOME=folder)
        _start(stack, ["openbox"], environment, folder / "openbox.log")
        shown.wait("openbox", lambda: shown.xdotool("get_num_desktops") not in ("", "0"))
        yield shown


@contextmanager
def open_window(
    shown: Screen,
    extensions: Path,
    drawing: Path,
    folder: Path,
    parameters: Mapping[str, object] | None = None,
) -> Iterator[Window]:
    """Inkscape with a drawing that fills its window, which fills the screen; ended with the context.

    extensions : the folder of a profile with the installed extension; drawing : a file of the caller's own;
    parameters : of effects, as the person chose them before, by `identity.name`
    """
    folder.mkdir(parents=True)
    environment = clean_environment(**_profile(folder, extensions, parameters or {}), DISPLAY=shown.display)
    with ExitStack() as stack:
        command = ["inkscape", "--app-id-tag=" + f"window{os.getpid()}", str(drawing)]
        _start(stack, command, environment, folder / "inkscape.log")
        title = drawing.name.replace(".", r"\.") + " - Inkscape$"
        identity = shown.wait("Inkscape's window", lambda: shown.windows(title), START_SECONDS)[0]
        shown.rest(START_SECONDS)
        height, width = shown.picture().shape[:2]
        shown.xdotool("windowsize", identity, width, height - _TITLE_BAR, "windowmove", identity, 0, 0)
        shown.rest()
        window = Window(shown, drawing, folder, identity)
        window.keys("4")  # zoom to the drawing
        shown.rest()
        yield window


def _profile(folder: Path, extensions: Path, parameters: Mapping[str, object]) -> dict[str, object]:
    """Write a profile, and tell the environment that Inkscape finds it by."""
    for name in ("home/.config/gtk-3.0", "tmp", "profile"):
        (folder / name).mkdir(parents=True)
    (folder / "home/.config/gtk-3.0/settings.ini").write_text(_GTK)
    (folder / "profile" / "extensions").symlink_to(extensions)
    wrapper = folder / "python"
    wrapper.write_text(_WRAPPER.format(folder=folder))
    wrapper.chmod(0o755)
    chosen = "".join(f" {name}={quoteattr(str(value))}" for name, value in parameters.items())
    preferences = _PREFERENCES.format(wrapper=quoteattr(str(wrapper)), parameters=chosen)
    (folder / "profile" / "preferences.xml").write_text(preferences, encoding="utf-8")
    return {
        "HOME": folder / "home",
        "TMPDIR": folder / "tmp",
        "INKSCAPE_PROFILE_DIR": folder / "profile",
        "GDK_BACKEND": "x11",
        "NO_AT_BRIDGE": "1",
        "GTK_USE_PORTAL": "0",
        "DBUS_SESSION_BUS_ADDRESS": "disabled:",
        "LANGUAGE": "en",
    }


def _start(
    stack: ExitStack, command: list[str], environment: dict[str, str], log: Path, fds: Sequence[int] = ()
) -> None:
    """A program in a session of its own, which ends with all that it started when the stack does."""
    with open(log, "wb") as file:
        process = subprocess.Popen(
            command,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=file,
            stderr=subprocess.STDOUT,
            pass_fds=fds,
            start_new_session=True,
        )

    def end() -> None:
        process.terminate()  # Xvfb removes its lock then
        with suppress(subprocess.TimeoutExpired):
            process.wait(_END_SECONDS)
        with suppress(ProcessLookupError):  # an effect may still run
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()

    stack.callback(end)


def _menu() -> list[str]:
    """The effects' names in the order of the menu, without the numbers that make it."""
    name = "{http://www.inkscape.org/namespace/inkscape/extension}name"
    numbered = sorted(str(etree.parse(str(file)).getroot().findtext(name)) for file in ROOT.glob("*.inx"))
    return [each.partition(". ")[2] for each in numbered]


def _pixel(at: Array) -> list[int]:
    return [round(float(value)) for value in at]
