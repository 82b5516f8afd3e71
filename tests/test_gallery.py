# SPDX-License-Identifier: GPL-2.0-or-later
"""The comparison counts what it says, and its pictures show the whole of what moved."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import gallery
import numpy as np
import panels
import pytest
import studies
import trials
from PIL import Image
from trials import Trial

from alup.session.pipeline import Options

ROOT = Path(__file__).resolve().parents[1]

SVG = (
    b'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 5 5">'
    b'<rect x="0" y="0" width="40" height="20" fill="#008000"/></svg>'
)


def made_up(
    turning: float, gradient: float = 1.0, handle: float = 0.0, kept: float = 1.0, **others: Any
) -> Trial:
    report = {
        "turning_degrees": {"mean": turning, "max": 2.0 * turning},
        "scale_gradient": {"rms": gradient, "max": gradient},
        "straightness_degrees": {"mean": 0.0, "max": 0.0, "line": 0.0},
        "new_crossings": 0,
        "bands": {"kept": kept, "length": 1.0},
        "handle_error_of_diagonal": handle,
    }
    return Trial("x", SVG, SVG, report, **others)


def test_wins_are_counted() -> None:
    """Of four cases one is turned less by Poisson, one equally but for rounding."""
    turning = {"a": (1.0, 0.1), "b": (2.0, 0.2), "c": (0.105, 0.1), "d": (0.1, 3.0)}
    by_case = {
        name: {method: made_up(ours if method == "ALUP" else theirs) for method in gallery.METHODS}
        for name, (theirs, ours) in turning.items()
    }
    text = gallery._comparison(by_case)
    wins = "| Poisson | 0 / 100 / 0 % | 50 / 25 / 25 %"
    row = next(line for line in text.split("\n") if line.startswith(wins))
    assert row.count("0 / 100 / 0 %") == 4
    assert "* mean turning: d (Poisson 0.1, ALUP 3)" in text
    assert "* bands lost: nowhere." in text


def test_a_refusal_is_no_win_and_is_told() -> None:
    found = {method: made_up(1.0) for method in gallery.METHODS}
    refused = {**found, "AKVF": Trial("b", SVG, SVG, error="No way.")}
    text = gallery._comparison({"a": found, "b": refused})
    assert "* b by AKVF was refused: No way." in text
    assert "| AKVF | 0 / 100 / 0 %" in text


def test_bands_lost_are_a_mean_and_a_count() -> None:
    """One of two cases lost a tenth of its bands: 5 % on average, and one case with too much."""
    found = {method: made_up(1.0) for method in gallery.METHODS}
    text = gallery._comparison({"a": found, "b": {**found, "ALUP": made_up(1.0, kept=0.9)}})
    assert "| ALUP | 5 % | 1 |" in text
    assert "| Poisson | 0 % | 0 |" in text
    assert "* bands lost: b (Poisson 0, ALUP 0.1)" in text


def test_every_case_was_looked_at() -> None:
    found = gallery._looked_at()
    assert set(found) == set(trials.cases())
    for verdict, why in found.values():
        assert verdict in ("kept", "flawed", "thrown away")
        assert why or verdict == "kept"


def test_a_trial_is_the_reshape_that_the_effect_makes() -> None:
    """An exact case by its own matrix, and what its handles say."""
    entry = trials.cases()["battery-translate"]
    found = trials.run(entry, Options())
    assert not found.error
    assert found.report["exact"]["max"] < 1e-6
    assert found.before != found.after
    low = np.min([h["target"] for h in entry["handles"]], axis=0)
    assert (np.array(found.low) <= low).all()


def test_an_error_for_the_user_becomes_the_trial() -> None:
    entry = trials.cases()["battery-translate"]
    assert "handle" in trials.run({**entry, "handles": []}, Options()).error


def test_a_panel_shows_what_lies_outside_the_page(tmp_path: Path) -> None:
    """The drawing is 40 x 20 on a page of 5 x 5: all of it is there, and margins are white."""
    file = tmp_path / "strip.png"
    trial = made_up(1.0, low=(0.0, 0.0), high=(40.0, 20.0))
    panels.strip([panels.Panel(SVG, ""), panels.Panel(SVG, "")], [trial], file)
    pixels = np.asarray(Image.open(file).convert("RGB")).astype(int)
    green = (np.abs(pixels - [0, 128, 0]) < 8).all(axis=2)
    width = np.ptp(np.flatnonzero(green[:, : pixels.shape[1] // 2].any(axis=0)))
    height = np.ptp(np.flatnonzero(green.any(axis=1)))
    assert width / height == pytest.approx(2.0, abs=0.1)
    assert width == pytest.approx(panels.SIZE / (1.0 + 2.0 * panels.MARGIN), rel=0.05)


def test_every_part_of_the_page_is_made() -> None:
    template = (ROOT / "benchmarks" / "gallery.template.md").read_text(encoding="utf-8")
    source = (ROOT / "benchmarks" / "gallery.py").read_text(encoding="utf-8")
    wanted = re.findall(r"^<!-- (\w+) -->$", template, re.MULTILINE)
    assert wanted
    for name in wanted:
        assert f'"{name}": ' in source


def test_every_method_and_every_known_failure_is_of_this_package() -> None:
    import json

    from alup.methods.registry import METHODS

    assert {*gallery.METHODS.values()} == {"alup", *METHODS}
    known = json.loads((trials.DRAWINGS / "failures.json").read_text(encoding="utf-8"))
    assert {one["case"] for one in known} <= set(trials.cases())
    assert {one["better"] for one in known} <= set(gallery.OTHERS)


def test_compression_goes_further_by_what_was_left() -> None:
    entry = {"handles": [{"source": [0.0, 0.0], "target": [0.0, -85.0]}]}
    assert studies._further(entry, 0.95 / 0.85)["handles"][0]["target"] == pytest.approx([0.0, -95.0])


def test_the_committed_page_has_its_pictures() -> None:
    folder = ROOT / "docs" / "gallery"
    for page in folder.glob("*.md"):
        for name in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", page.read_text(encoding="utf-8")):
            assert (folder / name).is_file(), name
    assert sum(file.stat().st_size for file in folder.rglob("*.png")) < 5_000_000
