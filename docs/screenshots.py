# SPDX-License-Identifier: GPL-2.0-or-later
"""Make the pictures of guide.md: `.venv/bin/python docs/screenshots.py`, after tests/run.sh has set that up.

The live window is photographed in a real Chromium, the four steps in a real Inkscape; the examples before and
after come from the effects themselves.  ImageMagick's `convert` joins pictures and reduces them to a palette.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
import zipfile
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from lxml import etree

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))

import inkscape as harness  # noqa: E402
import live_pictures  # noqa: E402
import window as desk  # noqa: E402

IMAGES, DATA = ROOT / "docs" / "images", ROOT / "benchmarks" / "drawings"
ALUP = "{https://alup-reshape.github.io/ns}"
STAYS = "#d40000"

# Colours of a picture; heights in pixels of the examples.
COLOURS, HEIGHT = 128, 260

# Pixels: how far the drawing is moved to make room for the dialog, how far the handle is dragged, and where
# the dialogs are put.
PAN, DRAG, SMALL, LARGE = (-190, -25), (0, 70), (570, 370), (565, 0)


@dataclass(frozen=True)
class Example:
    """A drawing, the handles that are placed on it, and those that are dragged.

    places : arguments of Place handles, one run each; drags : handle that is nearest to a point, and by how
    much it is moved; gone : handles that are deleted, by the same; view : viewBox that shows before and after
    """

    drawing: str
    view: str
    places: tuple[tuple[str, ...], ...] = (("--where=extremes",),)
    drags: tuple[tuple[Any, Any], ...] = ()
    gone: tuple[Any, ...] = ()


MUG = "oca-mug.svg"
TALLER = ((213.0, 452.0), (0.0, 90.0))
GRIP = ("--where=nodes", "--selected-nodes=path1092:0:3")
TRUCK = "flat-in_transit.svg"
FRONT, FENDER, WHEEL, REAR = (48.0, 23.7), (48.0, 32.0), (39.0, 41.0), (16.0, 41.0)
ROOF = (26.0, 9.0)
LONGER = (10.0, 0.0)

EXAMPLES = {
    "taller": Example(MUG, "40 20 460 550", drags=(TALLER,)),
    "taller-held": Example(MUG, "40 20 460 550", places=(("--where=extremes",), GRIP), drags=(TALLER,)),
    "longer": Example(TRUCK, "-1 6 62 40", drags=((FRONT, LONGER), (FENDER, LONGER), (WHEEL, LONGER))),
    "longer-framed": Example(
        TRUCK,
        "-1 6 62 40",
        places=(
            ("--where=extremes",),
            ("--where=section", "--id=cab", "--id=front"),
            ("--where=section", "--id=rear"),
        ),
        drags=(((39.0, 27.5), LONGER),),
        gone=(FRONT, FENDER, WHEEL, REAR, ROOF),
    ),
    "shorter": Example(
        "flat-full_battery.svg",
        "6 2 36 44",
        drags=tuple((at, (0.0, -22.0)) for at in ((12.0, 42.0), (36.0, 42.0), (14.0, 44.0), (34.0, 44.0))),
    ),
    "bent": Example("oca-contour_elephant.svg", "0 -10 480 360", drags=(((36.0, 245.0), (-10.0, -120.0)),)),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--home", type=Path, help="home folder for which install.sh has been run already")
    parser.add_argument("--extensions", type=Path, help="an empty folder, which the picture of Set up names")
    parser.add_argument("--only", choices=("set-up", "live", "window", "examples"), help="make only these")
    options = parser.parse_args()
    IMAGES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if options.only in (None, "set-up"):
            photograph_set_up(folder / "set-up", options.extensions or folder / "extensions")
        if options.only in (None, "live"):
            for title, data in live_pictures.make(IMAGES).items():
                reduce(["png:-"], IMAGES / f"{title}.png", data)
        if options.only in (None, "examples"):
            for title, example in EXAMPLES.items():
                show(title, example, folder)
        if options.only in (None, "window"):
            home = options.home or harness.installed_home(folder)
            photograph(harness.extensions_of(home), folder)


def photograph_set_up(folder: Path, extensions: Path) -> None:
    """The window of Set up, where only the archive has been unpacked."""
    folder.mkdir()
    extensions.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, str(ROOT / "release" / "archive.py"), str(folder)]
    archive = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split("\n")[0]
    zipfile.ZipFile(archive).extractall(extensions)
    drawing = folder / "truck.svg"
    drawing.write_bytes((ROOT / "examples" / "truck.svg").read_bytes())
    with ExitStack() as stack:
        screen = stack.enter_context(desk.screen(folder / "screen"))
        window = stack.enter_context(desk.open_window(screen, extensions, drawing, folder / "window"))
        window.choose("Set up")
        dialog = screen.wait("the dialog", lambda: screen.windows(r"^\d\. Set up$"))[0]
        screen.xdotool("windowactivate", "--sync", dialog)
        screen.xdotool("key", "alt+a")
        identity = screen.wait("its window", lambda: screen.windows("^ALUP Reshape$"))[0]
        keep(screen.rest(), "0-set-up")
        screen.xdotool("windowactivate", "--sync", identity)
        screen.xdotool("key", "Escape")
        window.finish(1)


def photograph(extensions: Path, folder: Path) -> None:
    """The four steps, on the mug."""
    drawing = folder / "mug.svg"
    # Of a file from before version 0.92 Inkscape asks how to scale it.
    drawing.write_bytes(re.sub(rb'inkscape:version="[^"]*"', b"", (DATA / MUG).read_bytes()))
    with desk.screen(folder / "screen") as screen:
        with desk.open_window(screen, extensions, drawing, folder / "window") as window:
            steps(window)
        if window.stderr():
            raise SystemExit(window.stderr())


def steps(window: desk.Window) -> None:
    """Place, drag, reshape, done."""
    screen = window.screen
    window.keys("minus")
    middle = np.array([560, 380])
    window.drag(middle, middle + PAN, button=2)
    window.keys("ctrl+a")
    with window.dialog("Place handles") as dialog:
        move(dialog, SMALL)
        dialog.preview()
        keep(screen.rest(), "1-place")
        dialog.apply(runs=0)
    window.keys("Escape")
    red = desk.discs(screen.rest(), STAYS)
    lowest = red[red[:, 1].argmax()]
    window.drag(lowest, lowest + DRAG)
    keep(screen.rest(), "2-drag")
    with window.dialog("Reshape") as dialog:
        move(dialog, LARGE)
        dialog.preview()
        keep(screen.rest(), "3-reshape")
        dialog.apply(runs=0)
    window.keys("Escape")
    keep(screen.rest(), "4-done")


def move(dialog: desk.Dialog, to: tuple[int, int]) -> None:
    dialog.window.screen.xdotool("windowmove", "--sync", dialog.identity, *to)
    dialog.window.screen.rest()


def keep(picture: Any, name: str) -> None:
    reduce(["png:-"], IMAGES / f"{name}.png", desk.png(picture))


def show(name: str, example: Example, folder: Path) -> None:
    """The drawing with its handles, and what Reshape makes of it when some are dragged."""
    before, dragged, after = (folder / f"{name}-{part}.svg" for part in ("before", "dragged", "after"))
    root = etree.parse(str(DATA / example.drawing)).getroot()
    name_parts(root)
    write(root, before)
    for arguments in example.places:
        run("alup_place_handles", *arguments, f"--output={before}", str(before))
    root = etree.parse(str(before)).getroot()
    for at in example.gone:
        handle = nearest(root, at)
        handle.getparent().remove(handle)
    write(root, before)
    found = [(nearest(root, at), by) for at, by in example.drags]
    for handle, by in found:
        shift(handle, by)
    write(root, dragged)
    run("alup_reshape", f"--output={after}", str(dragged))
    pictures = [draw(file, example.view) for file in (before, after)]
    reduce([*map(str, pictures), "+append"], IMAGES / f"{name}.png")


def name_parts(root: Any) -> None:
    """The truck's parts have no ids by which their frames could be asked for."""
    parts = {"cab": ("d", "M44,36H30"), "front": ("cx", "39"), "rear": ("cx", "16")}
    for element in root.iter():
        for name, (attribute, beginning) in parts.items():
            if element.get(attribute, "").startswith(beginning) and not root.xpath(f"//*[@id='{name}']"):
                element.set("id", name)


def nearest(root: Any, at: Any) -> Any:
    """The handle whose middle is nearest to a point."""
    return min(
        (element for element in root.iter() if element.get(f"{ALUP}rest")),
        key=lambda element: float(np.hypot(*(np.array(at) - middle(element)))),
    )


def middle(handle: Any) -> Any:
    if handle.get("cx"):
        return np.array([float(handle.get("cx")), float(handle.get("cy"))])
    x, y, width, height = (float(handle.get(name)) for name in ("x", "y", "width", "height"))
    return np.array([x + width / 2.0, y + height / 2.0])


def shift(handle: Any, by: Any) -> None:
    for name, step in zip(("cx", "cy") if handle.get("cx") else ("x", "y"), by):
        handle.set(name, str(float(handle.get(name)) + step))


def write(root: Any, file: Path) -> None:
    root.getroottree().write(str(file))


def draw(file: Path, view: str) -> Path:
    root = etree.parse(str(file)).getroot()
    root.set("viewBox", view)
    width, height = map(float, view.split()[2:])
    root.set("height", str(HEIGHT))
    root.set("width", str(HEIGHT * width / height))
    write(root, file)
    picture = file.with_suffix(".png")
    subprocess.run(["rsvg-convert", "-b", "white", "-o", str(picture), str(file)], check=True)
    return picture


def run(effect: str, *arguments: str) -> None:
    done = subprocess.run(
        [sys.executable, str(ROOT / f"{effect}.py"), *arguments], capture_output=True, text=True, check=False
    )
    if done.returncode != 0 or done.stderr:
        raise SystemExit(f"{effect} {' '.join(arguments)}: {done.stderr}")


def reduce(arguments: list[str], file: Path, data: bytes | None = None) -> None:
    command = ["convert", *arguments, "-strip", "+dither", "-colors", str(COLOURS), f"png8:{file}"]
    subprocess.run(command, input=data, check=True)


if __name__ == "__main__":
    main()
