# SPDX-License-Identifier: GPL-2.0-or-later
"""Place handles and Remove handles as programs and in Inkscape, and what Reshape makes of the handles."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import inkscape as harness
import numpy as np
import pytest
from documents import ALUP, LABEL
from lxml import etree
from placed import BOX, HEAD, arrows, assert_placed, handles, layer_of, load
from reruns import control

from alup.document import handle_marks
from alup.document.handles import handle_objects
from alup.document.handles.handle_layer import MOVED, is_moved
from alup.document.tree.own_objects import LAYER_LABEL
from alup.handles import candidates

ROOT = Path(__file__).resolve().parents[1]
DRAWING = f"""{HEAD}width="100mm" height="100mm" viewBox="0 0 100 100">
  <g id="group" transform="translate(2,3) scale(0.5)" style="fill:#ffcc00">
    <path id="bottle" d="M 40,160 V 80 C 40,60 70,60 70,40 V 10 H 90 V 40 C 90,60 120,60 120,80 V 160 Z" />
    <rect id="label" x="50" y="90" width="60" height="40" rx="5" style="fill:#fff"/>
  </g>
  <!-- a note --> <text id="t" x="3" y="9">Hi</text>
</svg>
"""


@pytest.fixture
def drawing(tmp_path: Path) -> Path:
    file = tmp_path / "drawing.svg"
    file.write_text(DRAWING, encoding="utf-8")
    return file


def run(effect: str, folder: Path, drawing: Path, *arguments: str) -> tuple[int, str, Path]:
    """Exit code, standard error, output of an effect."""
    output = folder / f"{len(list(folder.iterdir()))}.svg"
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONWARNINGS")}
    done = subprocess.run(
        [sys.executable, str(ROOT / f"{effect}.py"), f"--output={output}", *arguments, str(drawing)],
        env=environment, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    return done.returncode, done.stderr, output


def succeed(effect: str, folder: Path, drawing: Path, *arguments: str) -> Path:
    code, stderr, output = run(effect, folder, drawing, *arguments)
    assert (code, stderr) == (0, "")
    return output


def text_of(svg: Any) -> bytes:
    """The drawing to the letter, without declarations of unused namespaces."""
    return bytes(etree.tostring(svg, method="c14n", exclusive=True))


def without_layer(file: Path) -> bytes:
    root = etree.parse(str(file)).getroot()
    handle_marks.remove(root, [])
    return text_of(root)


def nearest_to(svg: Any, point: tuple[float, float]) -> Any:
    return min(handles(svg), key=lambda handle: float(np.linalg.norm(handle.centre - point)))


def dragged_mouth(placed: Path) -> None:
    """The bottle's mouth goes up by 6."""
    tree = etree.parse(str(placed))
    for corner in ((37.0, 8.0), (47.0, 8.0)):
        circle = nearest_to(tree.getroot(), corner).element
        circle.attrib["cy"] = str(float(circle.attrib["cy"]) - 6.0)
    tree.write(str(placed))


def curve_of(file: Path, identity: str) -> np.ndarray:
    return control(etree.parse(str(file)).getroot(), identity)


def style_of(handle: handle_objects.HandleObject) -> str:
    return str(handle.element.attrib.get("style"))


# --- what a run makes of the handles ------------------------------------------------------------


def test_reshape_leaves_the_drawing_if_no_handle_was_dragged(drawing: Path, tmp_path: Path) -> None:
    placed = succeed("alup_place_handles", tmp_path, drawing, "--where=extremes")
    section = succeed("alup_place_handles", tmp_path, placed, "--where=section", "--id=label")
    reshaped = succeed("alup_reshape", tmp_path, section)
    before = text_of(etree.parse(str(drawing)).getroot())
    assert without_layer(placed) == without_layer(section) == without_layer(reshaped) == before
    assert len(handles(etree.parse(str(reshaped)).getroot())) == 7
    removed = succeed("alup_remove_handles", tmp_path, reshaped)
    assert etree.tostring(etree.parse(str(removed))) == etree.tostring(etree.parse(str(drawing)))


@pytest.mark.parametrize("how", ["cx", "transform"])
def test_reshape_moves_the_curve_to_the_dragged_handle(how: str, drawing: Path, tmp_path: Path) -> None:
    placed = succeed("alup_place_handles", tmp_path, drawing, "--where=corners", "--id=bottle")
    tree = etree.parse(str(placed))
    for corner in ((37.0, 8.0), (47.0, 8.0)):  # the mouth, which goes up by 6
        handle = nearest_to(tree.getroot(), corner)
        assert handle.centre == pytest.approx(np.array(corner))
        circle = handle.element
        if how == "cx":
            circle.attrib["cy"] = str(float(circle.attrib["cy"]) - 6.0)
        else:
            circle.attrib["transform"] = "translate(0,-6)"
    tree.write(str(placed))
    report = tmp_path / "report.json"
    reshaped = succeed("alup_reshape", tmp_path, placed, "--id=bottle", f"--report={report}")
    assert json.loads(report.read_text())["handle_error_of_diagonal"] < 5e-4
    svg = etree.parse(str(reshaped)).getroot()
    low, high = candidates.bounds(control(svg, "bottle"))
    assert low[1] == pytest.approx(2.0, abs=0.02)
    assert high == pytest.approx([62.0, 83.0], abs=0.02)


def test_a_section_carries_what_is_in_it(drawing: Path, tmp_path: Path) -> None:
    placed = succeed("alup_place_handles", tmp_path, drawing, "--where=section", "--id=label")
    placed = succeed("alup_place_handles", tmp_path, placed, "--where=extremes", "--id=bottle")
    tree = etree.parse(str(placed))
    frame = next(h for h in handles(tree.getroot()) if h.kind == "section")
    frame.element.attrib["x"] = str(float(frame.element.attrib["x"]) + 3.0)
    tree.write(str(placed))
    svg = etree.parse(str(succeed("alup_reshape", tmp_path, placed, "--id=label"))).getroot()
    assert candidates.bounds(control(svg, "label")) == pytest.approx(np.array([[30, 48], [60, 68]]), abs=0.02)


def test_handles_placed_after_a_run_hold_the_present_shape(drawing: Path, tmp_path: Path) -> None:
    """Their rest is a point of the stored original, so the next run does not take them for moved."""
    placed = succeed("alup_place_handles", tmp_path, drawing, "--where=corners", "--id=bottle")
    dragged_mouth(placed)
    reshaped = succeed("alup_reshape", tmp_path, placed)
    more = succeed("alup_place_handles", tmp_path, reshaped, "--where=extremes", "--id=label")
    framed = succeed("alup_place_handles", tmp_path, reshaped, "--where=section", "--id=label")
    for new in (more, framed):
        again = succeed("alup_reshape", tmp_path, new)
        # A part with handles of its own no longer keeps its size, and its ties yield a little.
        for identity, most in (("bottle", 0.2), ("label", 0.02)):
            assert np.abs(curve_of(again, identity) - curve_of(reshaped, identity)).max() < most
        assert all(handle.at is not None for handle in handles(etree.parse(str(new)).getroot()))
    assert [handle.kind for handle in handles(etree.parse(str(framed)).getroot())].count("section") == 1
    # A place that is held is found by the handle's rest, so none is added.
    code, stderr, _ = run("alup_place_handles", tmp_path, reshaped, "--where=corners", "--id=bottle")
    assert code != 0
    assert "all 4 places" in stderr


def test_after_a_run_arrows_lead_from_rest_to_handle_until_the_original_is_restored(
    drawing: Path, tmp_path: Path
) -> None:
    placed = succeed("alup_place_handles", tmp_path, drawing, "--where=corners", "--id=bottle")
    dragged_mouth(placed)
    reshaped = etree.parse(str(succeed("alup_reshape", tmp_path, placed))).getroot()
    moved = {handle.element.attrib["id"] for handle in handles(reshaped) if is_moved(handle)}
    assert len(moved) == 2
    assert {arrow.get(f"{{{ALUP}}}arrow") for arrow in arrows(reshaped)} == moved
    blue = {handle.element.attrib["id"] for handle in handles(reshaped) if MOVED in style_of(handle)}
    assert blue == moved
    file = tmp_path / "reshaped.svg"
    etree.ElementTree(reshaped).write(str(file))
    restored = etree.parse(str(succeed("alup_restore_original", tmp_path, file))).getroot()
    assert not arrows(restored)
    assert not any(MOVED in style_of(handle) for handle in handles(restored))
    gone = succeed("alup_reshape", tmp_path, file, "--keep_handles=false")
    assert LAYER_LABEL not in gone.read_text(encoding="utf-8")


def test_a_run_makes_no_layer_for_handles_drawn_by_hand(tmp_path: Path) -> None:
    file = tmp_path / "hand.svg"
    pins = "".join(f'<circle inkscape:label="alup:pin" cx="{x}" cy="30" r="1"/>' for x in (20, 80))
    drag = '<circle inkscape:label="alup:handle" alup:rest="50 70" cx="50" cy="80" r="1" xmlns:alup="{}"/>'
    etree.ElementTree(load(BOX + pins + drag.format(ALUP))).write(str(file))
    after = succeed("alup_reshape", tmp_path, file).read_text(encoding="utf-8")
    assert LAYER_LABEL not in after


def test_baking_leaves_nothing_but_the_drawing(drawing: Path, tmp_path: Path) -> None:
    placed = succeed("alup_place_handles", tmp_path, drawing, "--where=corners", "--id=bottle")
    dragged_mouth(placed)
    reshaped = succeed("alup_reshape", tmp_path, placed)
    kept = succeed("alup_remove_handles", tmp_path, reshaped)
    baked = succeed("alup_remove_handles", tmp_path, reshaped, "--bake=true")
    assert b"alup:original" in kept.read_bytes()
    assert b"alup" not in baked.read_bytes()
    assert np.array_equal(curve_of(baked, "bottle"), curve_of(reshaped, "bottle"))
    later = succeed("alup_remove_handles", tmp_path, kept, "--bake=true")
    assert later.read_bytes() == baked.read_bytes()
    code, stderr, _ = run("alup_remove_handles", tmp_path, baked, "--bake=true")
    assert code != 0
    assert "nothing was changed" in stderr


# --- use and wrong use --------------------------------------------------------------------------


def test_selected_nodes_reach_the_effect(drawing: Path, tmp_path: Path) -> None:
    nodes = [f"--selected-nodes=bottle:0:{n}" for n in (3, 4)]
    svg = etree.parse(str(succeed("alup_place_handles", tmp_path, drawing, "--id=bottle", *nodes))).getroot()
    assert_placed(svg, [[37, 8], [47, 8]])


@pytest.mark.parametrize(
    ("effect", "arguments", "words"),
    [
        ("alup_place_handles", ("--where=nodes",), "node tool"),
        ("alup_place_handles", ("--id=nobody",), "nobody"),
        ("alup_place_handles", ("--id=t",), "Object to Path"),
        ("alup_remove_handles", (), "no handles"),
    ],
)
def test_wrong_use_is_one_sentence(
    effect: str, arguments: tuple[str, ...], words: str, drawing: Path, tmp_path: Path
) -> None:
    code, stderr, output = run(effect, tmp_path, drawing, *arguments)
    assert code != 0
    assert not output.exists()
    assert stderr.strip().count("\n") == 0
    assert re.search(words, stderr)


def test_placing_twice_says_that_nothing_was_added(drawing: Path, tmp_path: Path) -> None:
    placed = succeed("alup_place_handles", tmp_path, drawing, "--id=bottle")
    code, stderr, output = run("alup_place_handles", tmp_path, placed, "--id=bottle")
    assert code != 0
    assert not output.exists()
    assert "at all 6 places already" in stderr


# --- in Inkscape --------------------------------------------------------------------------------


def test_inkscape_places_and_removes(inkscape: harness.Inkscape, drawing: Path, tmp_path: Path) -> None:
    drawing.write_text(DRAWING.replace("<svg ", '<svg inkscape:version="1.2" ', 1), encoding="utf-8")
    done = inkscape.reshape(
        drawing, select=["bottle"], effect="alup_place_handles", params={"where": "extremes"}
    )
    assert (done.code, done.stderr) == (0, "")
    svg = etree.parse(str(done.output)).getroot()
    assert_placed(svg, [[22, 83], [62, 83], [37, 8], [47, 8], [22, 43], [62, 43]], 1e-4)
    assert len(layer_of(svg)) == 6
    gone = inkscape.reshape(done.output, effect="alup_remove_handles")
    assert (gone.code, gone.stderr) == (0, "")
    svg = etree.parse(str(gone.output)).getroot()
    assert handles(svg) == []
    assert LAYER_LABEL not in [e.get(LABEL) for e in svg.iter()]
