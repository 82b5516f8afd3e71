# SPDX-License-Identifier: GPL-2.0-or-later
"""A whole session of a person: place handles, drag one, reshape with a preview, undo, redo, restore."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any, Iterator

import inkscape as harness
import numpy as np
import pytest
import window as desk
from lxml import etree

from alup.document.handles.handle_layer import MOVED, STAYS
from alup.handles import candidates
from alup.svg import path_data

DRAWING = harness.ROOT / "benchmarks" / "drawings" / "flat-in_transit.svg"
SVG = "{http://www.w3.org/2000/svg}"
SODIPODI = "{http://sodipodi.sourceforge.net/DTD/sodipodi-0.dtd}"
CURRENT_LAYER = "{http://www.inkscape.org/namespaces/inkscape}current-layer"
REST = "{https://alup-reshape.github.io/ns}rest"

# The truck's cab: its colour; the middle of its front on the drawing's own scale, of 48 units.
CAB, FRONT = "#FFC107", np.array([48.0, 23.7])

# Inkscape ignores the first few pixels of a drag, in case a click was meant.
DRAG_PIXELS, LOST_PIXELS = 60, 12

# In units of the drawing: Inkscape writes 8 digits; handles are met to a part of the fit's tolerance.
EXACT, NEAR = 1e-5, 5e-3

# Share of the canvas that changes beside the dialog.
SEEN = 0.005

pytestmark = [
    pytest.mark.skipif(shutil.which("inkscape") is None, reason="Inkscape is not installed"),
    pytest.mark.timeout(280),
]


def shapes(svg: Any) -> dict[str, dict[str, str]]:
    """Attributes of all that is drawn but the handles, by id."""
    drawn = [e for e in svg.iter(f"{SVG}path", f"{SVG}rect", f"{SVG}circle") if not is_ours(e)]
    return {element.get("id"): dict(element.attrib) for element in drawn}


def is_ours(element: Any) -> bool:
    return any(part.get("id", "").startswith("alup-") for part in (element, *element.iterancestors()))


def current_layer(svg: Any) -> Any:
    identity = svg.find(f"{SODIPODI}namedview").get(CURRENT_LAYER)
    return next(element for element in svg.iter() if element.get("id") == identity)


def circles(svg: Any) -> dict[str, Any]:
    return {e.get("id"): e for e in svg.iter(f"{SVG}circle") if e.get(REST)}


def centres(svg: Any) -> dict[str, np.ndarray]:
    return {name: np.array([float(e.get("cx")), float(e.get("cy"))]) for name, e in circles(svg).items()}


def content(svg: Any) -> bytes:
    """The document without what belongs to the window: zoom, place, size."""
    copy = etree.fromstring(etree.tostring(svg))
    for view in copy.findall(f"{SODIPODI}namedview"):
        copy.remove(view)
    return bytes(etree.tostring(copy, method="c14n"))


def cab(svg: Any) -> Any:
    """(S, 4, 2) cubics of the cab, which has no transform."""
    (path,) = (e for e in svg.iter(f"{SVG}path") if e.get("fill") == CAB)
    return np.concatenate([subpath.control for subpath in path_data.parse(path.get("d"))])


def from_curve(control: np.ndarray, point: np.ndarray) -> float:
    return float(np.linalg.norm(candidates.nearest(control, point[None])[0] - point))


@pytest.fixture
def window(installed: Path, tmp_path: Path) -> Iterator[desk.Window]:
    """Inkscape with a copy of the drawing."""
    drawing = tmp_path / "truck.svg"
    shutil.copyfile(DRAWING, drawing)
    with desk.screen(tmp_path / "screen") as screen:
        extensions = harness.extensions_of(installed)
        with desk.open_window(screen, extensions, drawing, tmp_path / "window") as window:
            yield window


def test_place_drag_reshape_undo_and_restore(window: desk.Window) -> None:
    screen = window.screen
    original = window.document()

    # 1. Handles at the outermost points of the cab.
    window.click(desk.inside(screen.picture(), CAB))
    with window.dialog("Place handles") as dialog:
        dialog.apply()
    window.keys("Escape")
    placed = window.save()
    assert not is_ours(current_layer(placed))  # where what is drawn next goes
    assert np.array_equal(cab(placed), cab(original))
    before = centres(placed)
    assert len(before) >= 4
    assert all(from_curve(cab(placed), centre) < EXACT for centre in before.values())
    red = desk.discs(screen.rest(), STAYS)
    assert len(red) == len(before)

    # 2. The upper one of the front is dragged to the right.
    name = min(before, key=lambda name: float(np.linalg.norm(before[name] - FRONT)))
    scale = np.ptp(red, axis=0) / np.ptp(list(before.values()), axis=0)
    start = red.min(axis=0) + scale * (before[name] - np.min(list(before.values()), axis=0))
    window.drag(start, start + [DRAG_PIXELS, 0])
    dragged = window.save()
    goal = centres(dragged)[name]
    assert scale * (goal - before[name]) == pytest.approx([DRAG_PIXELS, 0], abs=LOST_PIXELS)
    assert shapes(dragged) == shapes(placed)
    assert from_curve(cab(dragged), goal) > 1.0

    # 3. A preview is seen; closed without Apply, it leaves nothing behind.
    window.keys("Escape")
    bare = desk.canvas(screen.rest())
    with window.dialog("Reshape") as dialog:
        without = desk.canvas(screen.picture())
        shown = desk.canvas(dialog.preview())
        assert np.mean(shown != without) > SEEN
    assert np.array_equal(desk.canvas(screen.rest()), bare)
    assert content(window.document()) == content(dragged)

    # Applied, the curve goes through all handles.
    with window.dialog("Reshape") as dialog:
        dialog.preview()
        dialog.apply(runs=0)
    reshaped = window.save()
    goals = {**before, name: goal}
    assert from_curve(cab(reshaped), goal) < NEAR
    assert is_ours(current_layer(dragged))  # by the click on a handle
    assert not is_ours(current_layer(reshaped))
    for other, centre in centres(reshaped).items():
        assert centre == pytest.approx(goals[other], abs=EXACT)
        assert from_curve(cab(reshaped), centre) < NEAR
    assert len(desk.discs(screen.rest(), MOVED)) == 1

    # One step back, one step on.
    window.undo()
    assert content(window.save()) == content(dragged)
    window.redo()
    assert content(window.save()) == content(reshaped)

    # 4. The original comes back, and the handles to where they began.
    window.run("Restore original")
    restored = window.save()
    assert shapes(restored) == shapes(dragged)
    assert centres(restored).keys() == before.keys()
    for other, centre in centres(restored).items():
        assert centre == pytest.approx(before[other], abs=EXACT)

    # Without handles the drawing is as before.
    with window.dialog("Remove handles") as dialog:
        dialog.apply()
    removed = window.save()
    assert not circles(removed)
    assert shapes(removed) == shapes(placed)

    assert set(window.runs()) == {0}
    assert window.stderr() == ""
