# SPDX-License-Identifier: GPL-2.0-or-later
"""What a sweep over thousands of drawings has found, each as the smallest drawing that showed it."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from inkex import load_svg
from lxml import etree

import alup_reshape
from alup.document import place_handles, reading
from alup.document.handles import handle_objects
from alup.document.tree.elements import name_of
from alup.document.tree.own_objects import labelled
from alup.geometry import boxes
from alup.geometry.bezier import Nearest
from alup.session import pipeline

DATA = Path(__file__).parent / "data"

HEAD = (
    '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
    'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" viewBox="0 0 400 100">'
)
BAR = '<path id="bar" d="M320,18 L320,8 L240,8 L240,18 Z"/>'


@pytest.mark.parametrize("point", ['<path d="M5,5"/>', '<line x1="5" y1="5" x2="5" y2="5" stroke="red"/>'])
def test_no_handle_is_placed_on_a_point(point: str, tmp_path: Path) -> None:
    """Reshape refused the handles that Place handles had put on points that were left over in the drawing."""
    svg = load_svg(f"{HEAD}{point}{BAR}</svg>").getroot()
    assert len(place_handles.place(svg, "extremes", [], []).added) == 4
    centres = np.array([handle_objects.read_handle(*pair).centre for pair in labelled(svg)])
    assert centres.min() >= 8.0, [name_of(element) for element, _ in labelled(svg)]
    file, output = tmp_path / "in.svg", tmp_path / "out.svg"
    text = re.sub(r'cx="320"', 'cx="360"', etree.tostring(svg, encoding="unicode"))
    file.write_text(text, encoding="utf-8")
    alup_reshape.AlupReshape().run([f"--output={output}", str(file)])
    assert 'd="M 360,18' in output.read_text(encoding="utf-8")


def circle(label: str, x: float, y: float) -> str:
    return f'<circle inkscape:label="alup:{label}" cx="{x}" cy="{y}" r="0.1"/>'


def test_a_part_that_is_a_point_follows(tmp_path: Path) -> None:
    """A follower of lone points has no edges, and so no coarser level."""
    file, output = tmp_path / "in.svg", tmp_path / "out.svg"
    handles = circle("pin", 320, 8) + circle("from 0", 240, 8) + circle("to 0", 280, 8)
    file.write_text(f'{HEAD}<path id="dot" d="M 278,41"/>{BAR}{handles}</svg>', encoding="utf-8")
    alup_reshape.AlupReshape().run([f"--output={output}", str(file)])
    found = {e.get("id"): e.get("d") for e in etree.parse(str(output)).getroot()}
    assert found["bar"] != "M320,18 L320,8 L240,8 L240,18 Z"
    numbers = [float(n) for n in re.findall(r"-?[\d.]+", found["dot"])]
    assert np.isfinite(numbers).all()


def test_a_move_of_nothing_that_is_selected_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The pin lies on the selected bar, the handle that moves on another: nothing would happen, silently."""
    file, output = tmp_path / "in.svg", tmp_path / "out.svg"
    other = '<path id="other" d="M20,10 H60 V50 H20 Z"/>'
    handles = circle("pin", 320, 8) + circle("from 0", 60, 50) + circle("to 0", 80, 50)
    file.write_text(f"{HEAD}{other}{BAR}{handles}</svg>", encoding="utf-8")
    with pytest.raises(SystemExit):
        alup_reshape.AlupReshape().run(["--id=bar", f"--output={output}", str(file)])
    assert "None of the handles that move lies on a selected curve." in capsys.readouterr().err
    assert not output.exists()


def test_one_long_edge_among_small_ones_does_not_fill_the_memory() -> None:
    """By the number of cells that are entered, which is what takes memory and time."""
    random = np.random.default_rng(0)
    low = random.uniform(0.0, 1000.0, (2000, 2))
    high = low + 0.5
    low[0], high[0] = 0.0, 1000.0
    entered = []
    usual = boxes.ranges

    def ranges(start: np.ndarray, length: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        entered.append(int(length.sum()))
        return usual(start, length)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(boxes, "ranges", ranges)
        i, j = boxes.overlapping(low, high, 1.0)
    assert entered[0] <= 16 * len(low)
    meet = (low[i] <= high[j]).all(axis=1) & (low[j] <= high[i]).all(axis=1)
    assert meet.all()
    apart = (low[:, None] <= high[None]).all(axis=2) & (low[None] <= high[:, None]).all(axis=2)
    assert len(i) == np.triu(apart, 1).sum()


def test_a_held_point_beside_the_direction_of_its_curve_makes_no_spike() -> None:
    """Handles as long as one likes meet it, to and fro along the direction; a node there does, too."""
    drawing = reading.read(load_svg(str(DATA / "dolphin.svg")).getroot(), [], True).drawing
    found = pipeline.reshape(drawing).refitted.control
    chord = np.linalg.norm(found[:, 3] - found[:, 0], axis=1)
    longest = np.linalg.norm(found[:, [1, 2]] - found[:, [0, 3]], axis=2).max(axis=1)
    before = drawing.control
    usual = np.linalg.norm(before[:, [1, 2]] - before[:, [0, 3]], axis=2).max(axis=1)
    usual = (usual / np.linalg.norm(before[:, 3] - before[:, 0], axis=1)).max()
    assert (longest / chord).max() < 4.0
    assert usual < 4.0
    curves = Nearest(found)
    for handle in drawing.handles:
        target = handle.rest if handle.target is None else handle.target
        assert curves.find(target)[3] < 1e-5 * drawing.diagonal
