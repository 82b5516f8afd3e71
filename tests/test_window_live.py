# SPDX-License-Identifier: GPL-2.0-or-later
"""The live window from Inkscape's menu to one undo: a real Inkscape, a real browser, one mouse."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Iterator

import chromium
import inkscape as harness
import numpy as np
import pytest
import window as desk
from test_window import CAB, REST, SEEN, cab, from_curve

pytestmark = [
    pytest.mark.skipif(shutil.which("inkscape") is None, reason="Inkscape is not installed"),
    pytest.mark.skipif(chromium.PROGRAM is None, reason="Chromium is not installed"),
    pytest.mark.timeout(280),
]

DRAWING = harness.ROOT / "benchmarks" / "drawings" / "flat-in_transit.svg"

# In units of the drawing, for handles that are met to a part of the fit's tolerance.
NEAR = 0.02

# Pixels of the drag, to the right and down.
WAY = np.array([60, -40])


@pytest.fixture
def inkscape_window(
    installed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[desk.Window]:
    """Inkscape with a copy of the drawing, and a browser that it may start as whoever runs the tests."""
    browser = tmp_path / "browser"
    sandbox = "--no-sandbox" if os.getuid() == 0 else ""
    profile = f"--user-data-dir={tmp_path / 'profile'} --no-first-run"
    # Its socket's path may have a hundred letters.
    command = f'{chromium.PROGRAM} {sandbox} {profile} --app="$1" >{tmp_path}/log 2>&1'
    browser.write_text(f"#!/bin/sh\nTMPDIR=/tmp exec {command}\n")
    browser.chmod(0o755)
    monkeypatch.setenv("ALUP_BROWSER", str(browser))
    drawing = tmp_path / "truck.svg"
    shutil.copyfile(DRAWING, drawing)
    with desk.screen(tmp_path / "screen") as screen:
        # The window leaves a mark in the extension's folder, which other tests look at.
        extensions = harness.extensions_of(harness.clone(installed, tmp_path))
        with desk.open_window(screen, extensions, drawing, tmp_path / "window") as window:
            yield window


def test_from_the_menu_to_one_undo(inkscape_window: desk.Window) -> None:
    window, screen = inkscape_window, inkscape_window.screen
    original, bare = window.document(), desk.canvas(screen.rest())
    window.choose("Reshape live")
    identity = screen.wait("the live window", lambda: screen.windows("^Reshape live$"), desk.START_SECONDS)[0]
    screen.rest()
    screen.xdotool("windowactivate", "--sync", identity)
    height, width = screen.picture().shape[:2]
    screen.xdotool("windowsize", identity, width, height - 22, "windowmove", identity, 0, 0)
    picture = screen.rest()

    # A pin at the rear of the cab's roof by a click, then the front is pulled.
    rows, columns = np.nonzero((picture == np.frombuffer(bytes.fromhex(CAB[1:]), np.uint8)).all(axis=2))
    low, high = np.array([columns.min(), rows.min()]), np.array([columns.max(), rows.max()])
    rear, front = [low[0], (low[1] + high[1]) // 2], [high[0], int(0.6 * low[1] + 0.4 * high[1]) + 60]
    screen.xdotool("mousemove", *rear, "click", 1)
    screen.wait("a pin", lambda: not np.array_equal(screen.picture(), picture))
    screen.rest()
    places = [np.asarray(front) + WAY * n // 12 for n in range(13)]
    arguments: list[object] = ["mousemove", *places[0], "sleep", 0.3, "mousedown", 1]
    for place in places[1:]:
        arguments += ["sleep", 0.03, "mousemove", *place]
    screen.xdotool(*arguments, "sleep", 0.3, "mouseup", 1)
    dragged = screen.rest()
    assert np.mean(dragged != picture) > 0.01

    # Done: the drawing is another one, and one step back brings the old one.
    screen.xdotool("windowactivate", "--sync", identity, "key", "ctrl+Return")
    window.finish(1)
    assert window.title.startswith("*")
    assert np.mean(desk.canvas(screen.rest()) != bare) > SEEN
    window.keys("ctrl+z")
    screen.wait("the old drawing", lambda: not window.title.startswith("*"))
    assert np.array_equal(desk.canvas(screen.rest()), bare)

    # A step on again, it is as the page has shown it.
    window.redo()
    reshaped = window.save()
    scale = np.ptp(cab(original)[..., 0]) / (high[0] - low[0])
    right = cab(reshaped)[..., 0].max() - cab(original)[..., 0].max()
    assert right == pytest.approx(WAY[0] * scale, rel=0.5)
    handles = [e for e in reshaped.iter() if e.get(REST)]
    assert len(handles) == 2
    for handle in handles:
        centre = np.array([float(handle.get("cx")), float(handle.get("cy"))])
        assert from_curve(cab(reshaped), centre) < NEAR
    assert set(window.runs()) == {0}
    assert window.stderr() == ""
