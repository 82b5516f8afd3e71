# SPDX-License-Identifier: GPL-2.0-or-later
"""Gradients, clips and clones after a run, as librsvg and Inkscape draw them."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from pathlib import Path
from typing import Sequence

import numpy as np
from builders import Array
from companions import AWAY, CLIP, CLIPPED, FILLED, GRADIENT, HEAD, RECT, WIDER, Map, Run, handles, load
from lxml import etree
from PIL import Image

ROOT = Path(__file__).resolve().parents[1]


def rendered(body: str, ids: Sequence[str], move: Map, folder: Path) -> Array:
    """A picture of the drawing after a run of the whole effect."""
    before, after = folder / "before.svg", folder / "after.svg"
    before.write_text(f"{HEAD}{body}{handles(move)}</svg>")
    command = [sys.executable, str(ROOT / "alup_reshape.py"), "--keep_handles=false", f"--output={after}"]
    done = subprocess.run(
        [*command, *(f"--id={one}" for one in ids), str(before)], capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")
    png = subprocess.run(["rsvg-convert", str(after)], capture_output=True, check=True).stdout
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGBA")).astype(int)


def test_the_picture_of_a_stretched_gradient(tmp_path: Path) -> None:
    body = f"<defs>{GRADIENT}</defs>{FILLED}"
    picture = rendered(body, ["r"], WIDER, tmp_path)
    colours = [(254, 0, 1, 255), (127, 0, 128, 255), (1, 0, 254, 255)]
    np.testing.assert_allclose(picture[50, [21, 170, 318]], colours, atol=3)


def test_the_picture_of_a_stretched_clip(tmp_path: Path) -> None:
    inside = CLIP.replace('y="10"', 'y="30"').replace("80", "30")
    picture = rendered(f"<defs>{inside}</defs>{CLIPPED}", ["r"], WIDER, tmp_path)
    assert list(picture[45, [77, 83, 257, 263], 3]) == [0, 255, 255, 0]
    assert list(picture[[28, 32, 58, 62], 170, 3]) == [0, 255, 255, 0]


def test_the_picture_of_a_clone(tmp_path: Path) -> None:
    """The gradient of the original paints the clone, too, and its clip cuts it."""
    body = f'<defs>{GRADIENT}</defs>{RECT.format("")}<use id="u" xlink:href="#r" y="100"/>'
    style = "<style>rect {fill:url(#g)}</style>"
    picture = rendered(style + body, ["r", "u"], WIDER, tmp_path)
    np.testing.assert_array_equal(picture[150, 20:320], picture[50, 20:320])
    np.testing.assert_allclose(picture[150, 318], (1, 0, 254, 255), atol=3)


def test_inkscape_draws_an_arc_as_it_was_written(tmp_path: Path) -> None:
    """Inkscape must not draw it again from the attributes of the old shape."""
    arc = (
        '<path id="r" sodipodi:type="arc" sodipodi:cx="70" sodipodi:cy="50" sodipodi:rx="50" sodipodi:ry="30"'
        ' d="M 120,50 A 50,30 0 1 1 20,50 A 50,30 0 1 1 120,50 Z"/>'
    )
    done = Run(load(arc, AWAY, points=((20, 50), (70, 20), (120, 50), (70, 80))), "r")
    output = tmp_path / "after.svg"
    etree.ElementTree(done.root).write(str(output))
    environment = {"PATH": os.environ["PATH"], "HOME": str(tmp_path), "INKSCAPE_PROFILE_DIR": str(tmp_path)}
    told = subprocess.run(
        ["inkscape", "--query-all", str(output)], capture_output=True, text=True, env=environment, timeout=60
    )
    lines = [line.split(",") for line in told.stdout.splitlines()]
    box = {name: [float(value) for value in values] for name, *values in lines}
    np.testing.assert_allclose(box["r"], [170, 90, 100, 60], atol=0.1)
