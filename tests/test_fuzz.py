# SPDX-License-Identifier: GPL-2.0-or-later
"""Whatever is in a file, a run ends soon, with a result or a sentence, and damages nothing.

`strategies` makes the documents, and `fuzzing` checks what must hold.  The tests run a few documents, all
those that once failed (tests/data/fuzz), and runs on which the checks must fail.  To look for new documents:

    python tests/fuzzing.py --minutes 60 --found FOLDER
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import fuzzing
import inkex
import numpy as np
import pytest
import strategies
from builders import curve_points, drag, drawing, pin, reshaped
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from lxml import etree

import alup_reshape
from alup.geometry import bezier
from alup.messages.errors import AlupError, DocumentError
from alup.model import Drawing
from alup.network import sampling, weld
from alup.svg import path_data

SEEDS = sorted((Path(__file__).parent / "data" / "fuzz").glob("*.svg"))

HEAD = strategies.HEAD + 'viewBox="0 0 200 200">'
GOOD = f"{HEAD}<path id='s0' d='M0,0 H100 V60 H0 Z'/>{{}}</svg>"
PIN = "<circle id='w0' inkscape:label='alup:pin' cx='0' cy='0' r='1'/>"
MOVED = (
    "<circle id='w1' inkscape:label='alup:from 1' cx='100' cy='60' r='1'/>"
    "<circle id='v1' inkscape:label='alup:to 1' cx='130' cy='70' r='1'/>"
)


def few(count: int) -> settings:
    """Settings with the same examples where the same modules are loaded, and without a time limit."""
    return settings(
        max_examples=count,
        derandomize=True,
        deadline=None,
        database=None,
        suppress_health_check=list(HealthCheck),
    )


@pytest.mark.parametrize("profile", ["same", "free"])
def test_examples_are_the_same_in_every_run_unless_one_asks_for_new_ones(profile: str) -> None:
    """Two processes stand for two machines."""
    program = (
        "import conftest\nfrom hypothesis import given, settings, strategies as st\ndrawn = []\n"
        "@given(st.integers(0, 10**9))\ndef look(n):\n    drawn.append(n)\nlook()\nprint(drawn)"
    )
    told = {**os.environ, "ALUP_EXAMPLES": profile, "PYTHONPATH": str(Path(__file__).parent)}
    if profile == "same":
        del told["ALUP_EXAMPLES"]
    one, two = (
        subprocess.run([sys.executable, "-c", program], env=told, capture_output=True, text=True, check=True)
        for _ in range(2)
    )
    assert len(one.stdout) > 500
    assert (one.stdout == two.stdout) == (profile == "same")


# --- documents ----------------------------------------------------------------------------------


@pytest.mark.parametrize("file", SEEDS, ids=lambda file: file.stem)
def test_documents_that_once_failed(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    fuzzing.check(text)
    fuzzing.check_placing(text)


def test_any_document() -> None:
    """The examples are varied: many are refused, for different reasons, many are unchanged, many change.

    The numbers depend on the modules that are loaded, because hypothesis takes constants from them.
    """
    outcomes: list[fuzzing.Outcome] = []

    @few(140)
    @given(strategies.cases(), st.integers(0, 3))
    def look(case: strategies.Case, again: int) -> None:
        outcomes.append(fuzzing.check(case.text(), again == 2))

    look()
    kinds = [outcome.kind for outcome in outcomes]
    assert min(kinds.count(kind) for kind in ("refused", "same", "changed")) >= 5, kinds
    reasons = {re.sub(r"\S*[\d“]\S*", "", outcome.refusal)[-40:] for outcome in outcomes if outcome.refusal}
    assert len(reasons) >= 3


@few(30)
@given(strategies.cases())
def test_handles_on_any_document(case: strategies.Case) -> None:
    fuzzing.check_placing(case.text())


@few(25)
@given(strategies.cases(), strategies.edits())
def test_any_edit_between_two_runs(case: strategies.Case, changes: tuple[strategies.Edit, ...]) -> None:
    fuzzing.check_edited(case.text(), changes)


def test_edits_that_every_effect_has_to_refuse_or_survive() -> None:
    """A damaged record, a damaged label of a handle, a deleted shape, and no edit."""
    text = GOOD.format(PIN + MOVED)
    spoils = [
        ("attribute", 0, 2, "{"), ("attribute", 0, 3, "0 0"), ("drop attribute", 0, 2, ""),
        ("drop attribute", 0, 3, ""), ("attribute", 1, 5, "alup:pinn"), ("attribute", 1, 3, "alup:"),
        ("delete", 0, 0, ""), ("delete", 1, 0, ""),
    ]  # fmt: skip
    for what, element, which, value in spoils:
        fuzzing.check_edited(text, [strategies.Edit(element, what, which, value)])
    fuzzing.check_edited(GOOD.format(""), [])


# --- path data ----------------------------------------------------------------------------------


@few(300)
@given(st.one_of(strategies.path_data(), st.text("MLHVCSQTAZmaz019-+.eE, \n#", max_size=30)))
def test_any_path_data(text: str) -> None:
    """It is read or refused at once, all numbers are finite, and its written form is read as the same."""
    try:
        subpaths = path_data.parse(text)
    except DocumentError as error:
        assert "character" in str(error)
        return
    for subpath in subpaths:
        assert np.isfinite(subpath.control).all()
        k = len(subpath.control)
        assert (subpath.control[1:, 0] == subpath.control[:-1, 3]).all()
        if not k or np.abs(subpath.control).max() > 1e9:
            continue
        pieces = path_data.Pieces(
            subpath.control, np.arange(k), np.isin(subpath.kind, (path_data.LINE, path_data.CLOSE))
        )
        (back,) = path_data.parse(path_data.subpath_data(subpath, pieces, 12, 1e-9))
        assert len(back.control) == k
        assert np.abs(back.control - subpath.control).max() < 1e-6 * max(1.0, np.abs(subpath.control).max())


# --- networks -----------------------------------------------------------------------------------


def with_handles(paths: list[str], wishes: list[strategies.Wish], shift: np.ndarray) -> Drawing:
    """The drawing with its handles, all moved alike."""
    bare = drawing(*paths)
    places = [
        bezier.evaluate(bare.control[wish.curve % len(bare.control)], np.array(wish.t)) for wish in wishes
    ]
    marks = [
        drag(p, p + shift * bare.diagonal, f"h{n}") if shift.any() else pin(*p) for n, p in enumerate(places)
    ]
    return drawing(*paths, handles=marks)


@few(40)
@given(strategies.drawings(), st.sampled_from([0.02, 0.6]))
def test_any_network(made: tuple[list[str], list[strategies.Wish]], spacing: float) -> None:
    """Every piece lies on its curve, samples are finite, and no edge is a loop or occurs twice."""
    before = drawing(*made[0])
    assume(before.diagonal > 0.0)
    with fuzzing.bounded(5.0):
        net = weld.build(before, weld.SNAP_DISTANCE * before.diagonal)
        none = np.zeros(0)
        samples = sampling.sample(net, spacing * float(before.size.max()), none.astype(int), none)
    assert set(net.segment) == set(range(len(before.control)))
    own = bezier.subrange(before.control[net.segment], *net.span.T)
    alive = np.flatnonzero(net.curve >= 0)
    for piece in alive:
        found = bezier.Nearest(net.curves[[net.curve[piece]]])
        points = bezier.evaluate(own[piece], np.array([0.3, 0.8]))
        away = max(found.find(point)[3] for point in points)
        assert away < 10.0 * weld.SNAP_DISTANCE * before.diagonal
    assert np.isfinite(samples.points).all()
    edges = np.sort(samples.edges, axis=1)
    assert (edges[:, 0] != edges[:, 1]).all()
    assert len(np.unique(edges, axis=0)) == len(edges)


@few(40)
@given(strategies.drawings(), st.sampled_from([(0.0, 0.0), (0.25, -0.1), (30.0, 7.0)]))
def test_handles_that_all_move_alike_move_any_drawing(
    made: tuple[list[str], list[strategies.Wish]], shift: tuple[float, float]
) -> None:
    """All parts move by exactly as much, and the drawing is unchanged if the handles stay."""
    assume(drawing(*made[0]).diagonal > 0.0)
    way = np.array(shift)
    before = with_handles(*made, way)
    try:
        with fuzzing.bounded():
            result = reshaped(before, spacing=0.02)
    except AlupError:
        assume(False)
    after = result.refitted.control
    if not way.any():
        assert (after == before.control).all()
        return
    wanted = before.control + way * before.diagonal
    assert len(after) == len(wanted)
    assert np.abs(after - wanted).max() < 2e-6 * before.diagonal * max(1.0, np.hypot(*way))


# --- the checks themselves ----------------------------------------------------------------------


def broken(monkeypatch: pytest.MonkeyPatch, spoil: Any) -> None:
    """Make the effect do something else at its end, or instead."""
    original = alup_reshape.AlupReshape._reshape

    def reshape(self: Any) -> Any:
        return spoil(self, original)

    monkeypatch.setattr(alup_reshape.AlupReshape, "_reshape", reshape)


def test_correct_runs_pass_the_checks() -> None:
    assert fuzzing.check(GOOD.format(PIN + MOVED)).kind == "changed"
    assert fuzzing.check(GOOD.format(PIN)).kind == "same"
    assert fuzzing.check(GOOD.format("")).kind == "refused"
    assert not fuzzing.check_placing(GOOD.format("")).refusal


def spoilt(what: str) -> Any:
    def spoil(self: Any, original: Any) -> Any:
        path = self.svg.getElementById("s0")
        if what == "traceback":
            raise inkex.AbortExtension("Something went wrong.") from ValueError("within")
        if what == "changed":
            path.attrib["d"] = "M0,0 H9"
        if what in ("changed", "phrase"):
            raise AlupError("no" if what == "phrase" else "No.")
        report = original(self)
        if what == "lost":
            path.getparent().remove(path)
        elif what == "not a number":
            path.attrib["d"] = "M0,0 L nan,5"
        elif what == "unreadable":
            path.attrib["d"] = "M0,0 L 5"
        elif what == "prints":
            print("hello")
        elif what == "misses":
            report["handle_error_of_diagonal"] = 0.01
        elif what == "drifts":
            path.attrib["d"] = path.attrib["d"] + " M0,0 H1"
        elif what == "hangs":
            begun = time.process_time()
            while time.process_time() < begun + 60.0:
                pass
        return report

    return spoil


@pytest.mark.parametrize(
    ("what", "message"),
    [
        ("traceback", "Something went wrong"),
        ("changed", "a refused run has changed"),
        ("phrase", "no sentence"),
        ("lost", "gone: .*s0"),
        ("not a number", "d=M0,0 L nan"),
        ("unreadable", "can't be read"),
        ("prints", "printed: hello"),
        ("misses", "handles missed"),
        ("drifts", "a second run changed"),
        ("hangs", "more than 0.5 s"),
    ],
)
def test_the_checks_see_every_kind_of_fault(monkeypatch: pytest.MonkeyPatch, what: str, message: str) -> None:
    broken(monkeypatch, spoilt(what))
    if what == "hangs":
        monkeypatch.setattr(fuzzing, "bounded", lambda limit=fuzzing.bounded: limit(0.5))
    with pytest.raises(
        (AssertionError, AlupError, inkex.AbortExtension, fuzzing.TooLongError), match=message
    ):
        fuzzing.check(GOOD.format(PIN + MOVED))


def test_a_change_without_a_moved_handle_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    def spoil(self: Any, original: Any) -> Any:
        report = original(self)
        self.svg.getElementById("s0").attrib["d"] += " "
        return report

    broken(monkeypatch, spoil)
    with pytest.raises(AssertionError, match="no shape changed, but the document did"):
        fuzzing.check(GOOD.format(PIN))


def test_the_seeds_say_why_they_are_there() -> None:
    assert SEEDS
    for file in SEEDS:
        root = etree.parse(str(file)).getroot()
        assert any(isinstance(child, etree._Comment) and len(child.text.split()) > 4 for child in root), (
            file.name
        )
        assert np.isfinite(curve_points(np.zeros((1, 4, 2)))).all()
