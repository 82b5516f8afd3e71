# SPDX-License-Identifier: GPL-2.0-or-later
"""The benchmark of moved and scaled pictures: its verdicts, and a few drawings."""

from __future__ import annotations

import json
from pathlib import Path

import moved_pictures
import numpy as np
import pytest

HEAD = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 200 100">'
ICONS = {
    "plain": '<path d="M 30,20 H 90 V 60 C 60,80 50,80 30,60 Z" fill="teal"/>',
    "clones": '<path id="a" d="M 95,20 L 30,40 L 95,80 Z"/>'
    '<use href="#a" transform="matrix(-1 0 0 1 200 0)"/>',
    "shadow": '<filter id="f" x="25" y="15" width="80" height="70" filterUnits="userSpaceOnUse">'
    '<feOffset dy="4"/><feBlend in="SourceGraphic"/></filter>'
    '<g filter="url(#f)"><rect x="30" y="20" width="60" height="50" fill="gold"/></g>',
}


def outcome(tmp_path: Path, body: str, edit: str) -> str:
    file = tmp_path / "one.svg"
    file.write_text(f"{HEAD}{body}</svg>")
    return str(moved_pictures.run(moved_pictures.Job(file, "one.svg", edit))["outcome"])


@pytest.mark.parametrize("edit", moved_pictures.EDITS)
@pytest.mark.parametrize("icon", ICONS)
def test_a_small_sample_moves_as_a_whole(tmp_path: Path, icon: str, edit: str) -> None:
    wanted = "not comparable" if (icon, edit) == ("shadow", "scale") else "right"
    assert outcome(tmp_path, ICONS[icon], edit) == wanted


def test_a_drawing_of_which_a_part_stays_behind_is_told(tmp_path: Path) -> None:
    inner = '<svg x="120" y="20" width="50" height="50"><rect width="50" height="50"/></svg>'
    assert outcome(tmp_path, ICONS["plain"] + inner, "translate") == "told"


def test_a_difference_that_is_not_told_is_wrong(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    other = [f"{HEAD}{ICONS['plain']}</svg>".encode()]
    monkeypatch.setattr(moved_pictures, "expected", lambda *_: other)
    assert outcome(tmp_path, ICONS["plain"], "translate") == "wrong"


def test_pictures_differ_where_a_pixel_leaves_the_range_of_its_neighbours() -> None:
    one = np.zeros((20, 20, 4))
    one[5:10, 5:10] = 255.0
    assert moved_pictures.differing(one, np.roll(one, 1, axis=0)) == 0
    assert moved_pictures.differing(one, np.roll(one, 3, axis=0)) > 0


def test_icons_of_a_collection_become_files(tmp_path: Path) -> None:
    source = tmp_path / "icons.json"
    icons = {"a": {"body": "<path d='M0,0h9'/>"}, "b": {"body": "", "width": 5}}
    source.write_text(json.dumps({"prefix": "few", "icons": icons, "width": 32, "height": 32}))
    files = moved_pictures.files_of(source, tmp_path)
    assert [name for _, name in files] == ["few/a.svg", "few/b.svg"]
    assert 'viewBox="0 0 5 32"' in files[1][0].read_text()
    assert moved_pictures.sampled(files, 1, 3) == moved_pictures.sampled(files, 1, 3)
