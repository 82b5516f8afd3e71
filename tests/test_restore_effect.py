# SPDX-License-Identifier: GPL-2.0-or-later
"""The effect, and Inkscape itself, bring back the file as it was; wrong use is told in one sentence."""

# XML is read more easily on one line.
# ruff: noqa: E501

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import inkscape as harness
import numpy as np
import pytest
from builders import BLOB
from documents import ALUP, INKSCAPE, SODIPODI, XLINK, get, text_of
from lxml import etree
from reruns import (
    ORIGINAL,
    UNMOVED,
    WRITTEN,
    circle,
    control,
    drag,
    drawn,
    pins,
    reloaded,
    run,
    without_handles,
)

HEAD = f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="{INKSCAPE}" xmlns:sodipodi="{SODIPODI}" xmlns:xlink="{XLINK}" viewBox="0 0 200 200">'
FILE = f'{HEAD}<path id="p" d="{BLOB}"/><rect id="q" x="20" y="160" width="30" height="20"/>{pins((10, 80), (60, 130))}{circle("from A", 150, 75)}{circle("to A", 175, 55)}</svg>'


def effect(module: str, folder: Path, text: str, *arguments: str, capture: Any) -> tuple[Path, int, str]:
    """Run an effect in this process: its output, exit code, words."""
    import importlib

    name = "".join(part.title() for part in module.split("_"))
    source, output = folder / "in.svg", folder / "out.svg"
    source.write_text(text, encoding="utf-8")
    output.unlink(missing_ok=True)
    capture.readouterr()
    code = 0
    try:
        getattr(importlib.import_module(module), name)().run([f"--output={output}", *arguments, str(source)])
    except SystemExit as left:
        code = int(left.code or 0)
    said = capture.readouterr()
    assert said.out == ""
    return output, code, said.err


def test_the_effect_gives_back_the_file(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    report = tmp_path / "report.json"
    output, code, said = effect(
        "alup_reshape", tmp_path, FILE, f"--report={report}", "--hold=apart", capture=capfd
    )
    assert (code, said) == (0, "")
    assert json.loads(report.read_text())["from_original"] == json.loads(report.read_text())["edited"] == []
    reshaped = output.read_text()
    output, code, said = effect(
        "alup_reshape", tmp_path, reshaped, f"--report={report}", "--hold=apart", capture=capfd
    )
    told = json.loads(report.read_text())
    assert (told["from_original"], told["edited"], told["changed"]) == (["p"], [], [])
    for ids in ([], ["--id=p"]):
        output, code, said = effect("alup_restore_original", tmp_path, reshaped, *ids, capture=capfd)
        assert (code, said) == (0, "")
        was, now = (etree.fromstring(text.encode()) for text in (FILE, output.read_text()))
        assert without_handles(now) == without_handles(was)


def test_wrong_use_of_the_effect_is_one_sentence(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for arguments, words in (
        ([], "stored original"),
        (["--id=q"], "selected objects"),
        (["--id=none"], "no object with the id none"),
    ):
        output, code, said = effect("alup_restore_original", tmp_path, FILE, *arguments, capture=capfd)
        assert code != 0
        assert not output.exists()
        assert words in said
        assert len(said.strip().split("\n")) == 1
        assert "Traceback" not in said


# --- in Inkscape ---------------------------------------------------------------------------------


def test_in_inkscape_nothing_that_is_stored_gets_lost(inkscape: harness.Inkscape, tmp_path: Path) -> None:
    """Reshape, drag on, reshape again, restore: each time through a file that Inkscape has written."""
    source = FILE.replace("<svg ", '<svg inkscape:version="1.2" ')
    before = reloaded(etree.fromstring(source))
    first = inkscape.reshape(source, params={"hold": "apart"})
    assert (first.code, first.stderr) == (0, "")
    once = reloaded(etree.parse(str(first.output)).getroot())
    assert get(once, "p").attrib[ORIGINAL]
    assert get(once, "p").attrib[WRITTEN]
    assert once.attrib[UNMOVED]
    assert text_of(once).count(ALUP.encode()) == 1
    drag(once, "toA175_55", 185, 50)
    report = tmp_path / "report.json"
    second = inkscape.reshape(text_of(once).decode(), params={"hold": "apart", "report": report})
    assert (second.code, second.stderr) == (0, "")
    told = json.loads(report.read_text())
    assert (told["from_original"], told["edited"], told["changed"]) == (["p"], [], ["p"])
    twice = reloaded(etree.parse(str(second.output)).getroot())
    drag(before, "toA175_55", 185, 50)
    run(before, tandem=False)
    assert np.abs(control(twice, "p") - control(before, "p")).max() < 1e-6 * 179.0
    third = inkscape.reshape(text_of(twice).decode(), effect="alup_restore_original")
    assert (third.code, third.stderr) == (0, "")
    back = reloaded(etree.parse(str(third.output)).getroot())
    assert get(back, "p").attrib["d"] == BLOB
    assert dict(get(back, "p").attrib) == {"id": "p", "d": BLOB}
    assert drawn(back).count(b"alup") <= 1
