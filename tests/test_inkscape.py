# SPDX-License-Identifier: GPL-2.0-or-later
"""The installed effect in a real Inkscape, through its command line."""

from __future__ import annotations

from pathlib import Path

import clipart
import inkscape as harness
import measure
import pytest
from lxml import etree

DATA = clipart.DRAWINGS
CASES = {entry["name"]: entry for entry in clipart.cases(DATA)}


def built(name: str, folder: Path, still: bool = False) -> tuple[Path, list[str]]:
    case = clipart.build(CASES[name], still=still, folder=DATA)
    path = folder / f"{name}.svg"
    # Of a file of Inkscape 0.91 or older, Inkscape would ask in a window how to scale it.
    case.tree.getroot().set(f"{{{clipart.INKSCAPE}}}version", "1.2")
    case.tree.write(str(path))
    return path, case.ids


@pytest.mark.parametrize("name", ["table-longer-legs", "truck-longer-box", "battery-translate", "mug-taller"])
def test_a_drawing_is_reshaped(inkscape: harness.Inkscape, tmp_path: Path, name: str) -> None:
    before, ids = built(name, tmp_path)
    run = inkscape.reshape(before, select=ids)
    assert (run.code, run.stderr) == (0, "")
    found = measure.compare(before, run.output, ids, CASES[name])
    assert found.handle_error < 5e-4
    assert found.worst_corner < 1.0
    assert found.largest_move > 0.01
    if found.exact_error is not None:
        assert found.exact_error < 1e-6


def test_nothing_selected_is_everything(inkscape: harness.Inkscape, tmp_path: Path) -> None:
    before, ids = built("battery-translate", tmp_path)
    run = inkscape.reshape(before)
    assert (run.code, run.stderr) == (0, "")
    found = measure.compare(before, run.output, ids, CASES["battery-translate"])
    assert found.exact_error is not None
    assert found.exact_error < 1e-6


def test_only_what_is_selected_changes(inkscape: harness.Inkscape, tmp_path: Path) -> None:
    before, ids = built("truck-longer-box", tmp_path)
    chosen, rest = ids[:2], ids[2:]
    run = inkscape.reshape(before, select=chosen)
    # Handles of other objects are on curves that were not chosen, and not for this run.
    assert run.stderr == "" or "selected" in run.stderr
    old, new = (
        {e.get("id"): shape_of(etree.tostring(e)) for e in etree.parse(str(f)).iter() if e.get("id") in rest}
        for f in (before, run.output)
    )
    assert old == new


def shape_of(text: bytes) -> dict[str, str]:
    """The attributes that say where an element is."""
    element = etree.fromstring(text)
    names = ("d", "x", "y", "width", "height", "cx", "cy", "r", "points", "transform")
    return {name: element.attrib[name] for name in names if element.get(name)}


def test_without_a_moved_handle_nothing_moves(inkscape: harness.Inkscape, tmp_path: Path) -> None:
    before, ids = built("mug-taller", tmp_path, still=True)
    run = inkscape.reshape(before, select=ids)
    assert (run.code, run.stderr) == (0, "")
    found = measure.compare(before, run.output, ids, {**CASES["mug-taller"], "handles": [], "exact": None})
    assert found.largest_move == 0.0


def test_parameters_reach_the_effect(inkscape: harness.Inkscape, tmp_path: Path) -> None:
    before, ids = built("mug-taller", tmp_path)
    kept = inkscape.reshape(before, select=ids, params={"keep_handles": True})
    gone = inkscape.reshape(before, select=ids, params={"keep_handles": False})
    assert (kept.stderr, gone.stderr) == ("", "")

    def handles(run: harness.Run) -> list[etree._Element]:
        return [e for e in etree.parse(str(run.output)).iter() if (e.get("id") or "").startswith("handle-")]

    assert len(handles(kept)) == 7  # three pins and two pairs
    assert handles(gone) == []


def test_an_error_is_a_sentence_and_changes_nothing(inkscape: harness.Inkscape, tmp_path: Path) -> None:
    before, ids = built("mug-taller", tmp_path)
    tree = etree.parse(str(before))
    for element in list(tree.iter()):
        if (element.get("id") or "").startswith("handle-to"):
            parent = element.getparent()
            assert parent is not None
            parent.remove(element)
    tree.write(str(before))
    run = inkscape.reshape(before, select=ids)
    assert run.code not in (0, None)
    assert "alup:to" in run.stderr
    assert "Traceback" not in run.stderr
    found = measure.compare(before, run.output, ids, {**CASES["mug-taller"], "handles": [], "exact": None})
    assert found.largest_move == 0.0
