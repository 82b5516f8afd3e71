# SPDX-License-Identifier: GPL-2.0-or-later
"""Real clip-art that nobody drew for this project, with handles somebody would set.

The whole way from file to file, within this process; the drawings in `benchmarks/drawings` always, those of
the larger folder where it is there.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import clipart
import inkex
import measure
import numpy as np
import pytest
from lxml import etree
from scipy.spatial import cKDTree

from alup.document import reading, writing
from alup.model import Drawing, Refitted
from alup.session import pipeline
from alup.svg import path_data

DATA = clipart.DRAWINGS
SMOOTH = 1.0  # degrees: nodes that turn by less are smooth
HANDLES_WITHIN, TRANSLATIONS_WITHIN, STILL_WITHIN = 5e-4, 1e-6, 1e-6  # of the diagonal
KEPT = 0.9  # of all segments

ELSEWHERE = clipart.cases()
FOLDERS = {entry["name"]: (entry, clipart.FOLDER) for entry in ELSEWHERE}
FOLDERS.update({entry["name"]: (entry, DATA) for entry in clipart.cases(DATA)})
CASES = pytest.mark.parametrize("name", list(FOLDERS))


def test_the_folder_of_clip_art() -> None:
    if not ELSEWHERE:
        pytest.skip(f"the folder of clip-art {clipart.FOLDER} is not there, only the project's own")
    assert len(ELSEWHERE) == 68


@dataclass(frozen=True)
class Outcome:
    """One case from file to file.  before, after : the files; ids : the elements that were selected."""

    entry: dict[str, Any]
    before: Path
    after: Path
    ids: list[str]
    drawing: Drawing
    refitted: Refitted
    changed: list[str]
    report: dict[str, Any]


def run(name: str, folder: Path, still: bool = False) -> Outcome:
    entry, source = FOLDERS[name]
    built = clipart.build(entry, still=still, folder=source)
    before, after = folder / f"{name}.before.svg", folder / f"{name}.svg"
    built.tree.write(str(before))
    loaded = inkex.load_svg(str(before))
    by_id = {e.attrib.get("id"): e for e in loaded.getroot().iter() if isinstance(e.tag, str)}
    read = reading.read(loaded.getroot(), [by_id[identity] for identity in built.ids], False)
    result = pipeline.reshape(read.drawing)
    tolerance = pipeline.Options().fit_tolerance * float(read.drawing.size.max())
    changed = writing.write(read, result.refitted, True, tolerance)
    loaded.write(str(after))
    return Outcome(entry, before, after, built.ids, read.drawing, result.refitted, changed, result.report)


SEGMENTS: dict[str, tuple[int, int]] = {}  # of each case that was run: all, and those that are still one


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Outcome]:
    """Filled by the cases as they run, so that each is run once."""
    return {}


def outcome(name: str, outcomes: dict[str, Outcome], folder: Path) -> Outcome:
    if name not in outcomes:
        outcomes[name] = run(name, folder)
    return outcomes[name]


def corners(drawing: Drawing, refitted: Refitted) -> np.ndarray:
    """Degrees that the new curves turn by at nodes where the drawing's turn by less than SMOOTH.

    Written apart from the package's own measure: directions of the curves a thousandth of the way
    from their ends would be blind to small handles, so these are the first that are not zero.
    """
    first = np.searchsorted(refitted.source, np.arange(len(drawing.control)))
    last = np.searchsorted(refitted.source, np.arange(len(drawing.control)), side="right") - 1
    found = [0.0]
    tiny = 1e-6 * drawing.diagonal
    for segment, following in enumerate(drawing.following):
        if following < 0:
            continue
        was = turn(drawing.control[segment], drawing.control[following], tiny)
        new = refitted.control[last[segment]], refitted.control[first[following]]
        # A curve that was squashed to a ten-thousandth of the drawing has no direction to be seen.
        if min(np.ptp(control, axis=0).max() for control in new) < 1e-4 * drawing.diagonal:
            continue
        now = turn(*new, tiny)
        both_lines = refitted.line[last[segment]] and refitted.line[first[following]]
        if was is not None and now is not None and was < SMOOTH and not both_lines:
            found.append(now)
    return np.array(found)


def turn(one: np.ndarray, other: np.ndarray, tiny: float) -> float | None:
    """Angle in degrees between where one cubic arrives and the other leaves; None for points."""
    arriving = next((v for v in one[3] - one[2::-1] if np.hypot(*v) > tiny), None)
    leaving = next((v for v in other[1:] - other[0] if np.hypot(*v) > tiny), None)
    if arriving is None or leaving is None:
        return None
    cross = arriving[0] * leaving[1] - arriving[1] * leaving[0]
    return float(np.degrees(abs(np.arctan2(cross, arriving @ leaving))))


@CASES
def test_case(
    name: str, outcomes: dict[str, Outcome], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    done = outcome(name, outcomes, tmp_path)
    assert capfd.readouterr() == ("", "")
    assert np.isfinite(done.refitted.control).all()
    assert done.changed
    found = measure.compare(done.before, done.after, done.ids, done.entry)
    assert found.handle_error < HANDLES_WITHIN
    worst = corners(done.drawing, done.refitted)
    assert worst.max() < SMOOTH, np.sort(worst)[-5:]
    assert found.worst_corner < SMOOTH  # also as it was written, arcs as arcs
    assert done.refitted.error <= pipeline.Options().fit_tolerance * float(done.drawing.size.max())
    if found.exact_error is not None and "translation" in done.entry["kind"]:
        assert found.exact_error < TRANSLATIONS_WITHIN
    counts = np.bincount(done.refitted.source, minlength=len(done.drawing.control))
    SEGMENTS[name] = (len(counts), int(np.sum(counts == 1)))
    # The nodes in the file are those that were computed: to the rounding, but those within arcs.
    written = [
        np.concatenate([subpath.control[:, [0, 3]].reshape(-1, 2), subpath.start[None]]) @ matrix[:, :2].T
        + matrix[:, 2]
        for subpaths, matrix in measure.load(done.after, done.ids)
        for subpath in subpaths
    ]
    away, _ = cKDTree(np.concatenate(written)).query(done.refitted.control[:, [0, 3]].reshape(-1, 2))
    assert away.max() < HANDLES_WITHIN * done.drawing.diagonal
    assert np.median(away) < 1e-7 * done.drawing.diagonal


@CASES
def test_identity_edit(name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    done = run(name, tmp_path, still=True)
    assert capfd.readouterr() == ("", "")
    moved = np.abs(done.refitted.control - done.drawing.control).max()
    assert moved <= STILL_WITHIN * done.drawing.diagonal
    assert done.changed == []
    before, after = (
        etree.tostring(etree.parse(str(file)), method="c14n") for file in (done.before, done.after)
    )
    assert before == after


@pytest.mark.parametrize("group", ["all"])
def test_nine_segments_of_ten_keep_their_number_of_nodes(
    group: str, outcomes: dict[str, Outcome], tmp_path: Path
) -> None:
    for name in FOLDERS:
        if name not in SEGMENTS:  # this test alone, or the cases in another process
            done = outcome(name, outcomes, tmp_path)
            counts = np.bincount(done.refitted.source, minlength=len(done.drawing.control))
            SEGMENTS[name] = (len(counts), int(np.sum(counts == 1)))
    total, kept = np.sum(list(SEGMENTS.values()), axis=0)
    assert kept >= KEPT * total, f"{kept} of {total}"


def test_the_measure_sees_a_corner() -> None:
    """What finds nothing anywhere would prove nothing."""
    smooth = path_data.parse("M0,0 C0,10 10,20 20,20 C30,20 40,10 40,0")[0].control
    bent = smooth.copy()
    bent[1, 1] += [0.0, 0.5]
    drawing = Drawing(smooth, np.zeros(2, bool), np.array([1, -1]), np.zeros(2, int), ("p",))

    def refitted(control: np.ndarray) -> Refitted:
        return Refitted(control, np.zeros(2, bool), np.arange(2), np.zeros(2, bool), 0.0)

    assert corners(drawing, refitted(smooth)).max() == 0.0
    assert corners(drawing, refitted(bent)).max() == pytest.approx(np.degrees(np.arctan(0.05)))
