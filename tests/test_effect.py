# SPDX-License-Identifier: GPL-2.0-or-later
"""The effect script as a program: its report, the one sentence on wrong use, its exit code."""

# XML is read more easily on one line.
# ruff: noqa: E501

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any, Sequence

import numpy as np
import pytest
from builders import BLOB
from lxml import etree

from alup.svg import path_data

ROOT = Path(__file__).resolve().parents[1]
SCRIPT = ROOT / "alup_reshape.py"

HEAD = (
    '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
    'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" viewBox="0 0 200 200">'
)
PATH = f'<path id="p" d="{BLOB}"/>'


def circle(label: str, x: float, y: float) -> str:
    name = re.sub(r"\W", "", label)
    return f'<circle id="{name}{x:g}" inkscape:label="alup:{label}" cx="{x}" cy="{y}" r="0.5"/>'


HANDLES = circle("pin", 10, 80) + circle("pin", 60, 130) + circle("from A", 150, 75) + circle("to A", 175, 55)


class Run:
    """One run of the script on a drawing."""

    def __init__(self, folder: Path, body: str, *arguments: str, old_output: str | None = None):
        self._prepare(folder, body)
        if old_output is not None:
            self.output.write_text(old_output)
        environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONWARNINGS")}
        done = subprocess.run(
            [
                sys.executable, str(SCRIPT), f"--output={self.output}", f"--report={self.report}",
                *arguments, str(self.input),
            ],
            env=environment, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, timeout=120,
        )  # fmt: skip
        self.code = done.returncode
        self.stdout, self.stderr = done.stdout.decode(), done.stderr.decode()

    def _prepare(self, folder: Path, body: str) -> None:
        self.input, self.output, self.report = (folder / n for n in ("in.svg", "out.svg", "report.json"))
        text = body if body.startswith("<?xml") or "<svg" in body else HEAD + body + "</svg>"
        self.input.write_text(text, encoding="utf-8")

    def figures(self) -> dict[str, Any]:
        """The report of a run that must have succeeded without a word."""
        assert (self.code, self.stderr, self.stdout) == (0, "", "")
        told = json.loads(self.report.read_text(encoding="utf-8"))
        assert isinstance(told, dict)
        return told

    def element(self, identity: str) -> Any:
        return next(e for e in etree.parse(str(self.output)).iter() if e.get("id") == identity)

    def assert_refused(self, *words: str) -> None:
        """Exactly one message, no traceback, a failure, and no drawing."""
        lines = self.stderr.strip().split("\n")
        assert len(lines) == 1, self.stderr
        assert "Traceback" not in self.stderr
        assert "Warning" not in self.stderr
        assert re.search(r"[.)]$", lines[0]), lines[0]
        assert self.code != 0
        assert self.stdout == ""
        assert not self.output.exists()
        assert not self.report.exists()
        for word in words:
            assert re.search(word, lines[0]), (word, lines[0])


class QuickRun(Run):
    """The same within this process, which is faster.

    An exception that is not turned into a message is raised; in a process of its own it would reach stderr.
    """

    def __init__(self, folder: Path, body: str, *arguments: str, capture: pytest.CaptureFixture[str]):
        import alup_reshape

        self._prepare(folder, body)
        given = [f"--output={self.output}", f"--report={self.report}", *arguments, str(self.input)]
        capture.readouterr()
        self.code = 0
        try:
            alup_reshape.AlupReshape().run(given)
        except SystemExit as left:
            self.code = int(left.code or 0)
        self.stdout, self.stderr = capture.readouterr()


# --- success ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return Run(
        tmp_path_factory.mktemp("good"),
        PATH + '<text id="t">Hello</text>' + HANDLES,
        "--id=p",
        "--id=t",
        "--hold=apart",
    )


def test_without_added_nodes_a_path_has_the_nodes_it_had(tmp_path: Path) -> None:
    curve = '<path id="p" d="M0,0 C30,60 70,-60 100,0 V80 H0 Z"/>'
    handles = (
        '<circle id="a" inkscape:label="alup:pin" cx="0" cy="0" r="2"/>'
        '<circle id="b" inkscape:label="alup:from A" cx="50" cy="0" r="2"/>'
        '<circle id="c" inkscape:label="alup:to A" cx="60" cy="30" r="2"/>'
        '<circle id="d" inkscape:label="alup:pin" cx="100" cy="80" r="2"/>'
    )
    for folder, wanted in (("true", False), ("false", True)):
        (tmp_path / folder).mkdir()
        told = Run(tmp_path / folder, curve + handles, "--id=p", f"--add-nodes={folder}").figures()
        assert (told["segments_after"] == told["segments"] == 4) is wanted


def finite_numbers(value: Any) -> bool:
    if isinstance(value, dict):
        return all(finite_numbers(v) for v in value.values())
    if isinstance(value, list):
        return all(finite_numbers(v) for v in value)
    return not isinstance(value, float) or bool(np.isfinite(value))


def test_the_report_says_all_of_the_run(good: Run) -> None:
    told = good.figures()
    assert finite_numbers(told)
    assert told["vertices"] > 500
    assert told["edges"] == told["vertices"]  # one closed curve
    assert told["components"] == 1
    assert told["handles"] == 3
    assert 0.0 <= told["handle_error_of_diagonal"] < 5e-4
    assert 0.0 < told["turning_degrees"]["mean"] < told["turning_degrees"]["max"]
    assert told["segments"] == 7
    assert told["segments_after"] >= 7
    assert told["changed"] == ["p"]
    assert [entry["id"] for entry in told["skipped"]] == ["t"]
    assert [one["round"] for one in told["rounds"]] == ["core", "final"]
    for one in told["rounds"]:
        assert one["status"].isupper()
        assert len(one["why"].split()) > 3
        assert one["iterations"] >= 0
        for term in ("normal", "tangent", "straight", "handle", "edge", "ties", "alup", "objective"):
            assert len(one["energy"][term]) == one["iterations"] + 1
        parts = [one["energy"][term][-1] for term in ("normal", "tangent", "straight", "handle")]
        assert sum(parts) == pytest.approx(one["energy"]["alup"][-1])
    for stage in ("start", "read", "network", "sample", "ties", "solve", "refit", "write", "all"):
        assert told["seconds"][stage] >= 0.0
    assert told["seconds"]["all"] >= told["seconds"]["solve"]
    for name in ("alup", "python", "inkex", "numpy", "scipy", "lxml"):
        assert re.match(r"\d+\.\d+|unknown", told["versions"][name]), name


def test_the_drawing_is_written(good: Run) -> None:
    (subpath,) = path_data.parse(good.element("p").get("d"))
    nodes = subpath.control[:, 0]
    for target in ((10, 80), (60, 130), (175, 55)):
        away = np.linalg.norm(subpath.control[:, [0, 3]].reshape(-1, 2) - target, axis=1).min()
        assert away < 5e-4 * 170 or len(nodes) > 7
    circles = list(etree.parse(str(good.output)).iter("{*}circle"))
    assert len(circles) == 4


def test_options_reach_the_run(tmp_path: Path) -> None:
    run = Run(
        tmp_path, PATH + '<path id="q" d="M60,60 L80,60"/>' + HANDLES, "--scope=drawing", "--hold=apart",
        "--keep_handles=false", "--spacing=2", "--tolerance=1", "--iterations=3", "--solver=paper",
    )  # fmt: skip
    told = run.figures()
    assert told["vertices"] < 250
    assert max(one["iterations"] for one in told["rounds"]) <= 3
    assert told["changed"] == ["p"]
    assert told["stays"] == 1
    assert not list(etree.parse(str(run.output)).iter("{*}circle"))
    assert run.element("q").get("d") == "M60,60 L80,60"


@pytest.mark.parametrize(
    ("solver", "status"), [("newton", {"MINIMUM"}), ("paper", {"DECREASE", "STEP", "RISE", "ITERATIONS"})]
)
def test_the_solver_is_the_one_that_is_asked_for(
    solver: str, status: set[str], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    told = QuickRun(tmp_path, PATH + HANDLES, f"--solver={solver}", capture=capfd).figures()
    assert {one["status"] for one in told["rounds"]} <= status


def test_without_output_the_drawing_goes_to_stdout(tmp_path: Path) -> None:
    file = tmp_path / "in.svg"
    file.write_text(HEAD + PATH + HANDLES + "</svg>")
    done = subprocess.run(
        [sys.executable, str(SCRIPT), str(file)], capture_output=True, cwd=tmp_path, timeout=120
    )
    assert (done.returncode, done.stderr) == (0, b"")
    root = etree.fromstring(done.stdout)
    assert etree.QName(root).localname == "svg"
    assert b'<path id="p" d="M ' in done.stdout


def test_nothing_moved_changes_nothing(tmp_path: Path) -> None:
    body = PATH + circle("pin", 10, 80) + circle("pin", 60, 20)
    run = Run(tmp_path, body)
    assert run.figures()["changed"] == []
    if run.output.exists():  # inkex does not write a drawing that has not changed
        before, after = (etree.tostring(etree.parse(str(f)), method="c14n") for f in (run.input, run.output))
        assert before == after


def test_reshaping_twice_is_reshaping_once(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    first = Run(tmp_path, PATH + HANDLES)
    first.figures()
    second = QuickRun(tmp_path, first.output.read_text(), capture=capfd)
    assert second.figures()["changed"] == []


def test_text_and_images_beside_a_path_are_named_and_skipped(tmp_path: Path) -> None:
    body = f'{PATH}<g id="g"><text id="t">T</text><image id="i" width="5" height="5"/></g>{HANDLES}'
    told = Run(tmp_path, body, "--id=p", "--id=g", "--hold=apart").figures()
    assert {entry["id"]: entry["why"] for entry in told["skipped"]} == {"t": "text", "i": "an image"}


# --- wrong use ----------------------------------------------------------------------------------

WRONG: dict[str, tuple[str, Sequence[str], Sequence[str]]] = {
    "no path at all": (HANDLES, (), ("No path",)),
    "no path selected": ('<g id="g"/>' + PATH + HANDLES, ("--id=g",), ("No path is selected", "g")),
    "no handles": (PATH, ("--id=p",), ("no handles", "alup:pin")),
    "a handle off every curve": (PATH + HANDLES + circle("pin", 90, 60), ("--id=p",), ("pin90", "not on a curve")),
    "from without to": (PATH + circle("from B", 10, 80), ("--id=p",), ("fromB10", "alup:to B")),
    "to without from": (PATH + circle("to B", 10, 80), ("--id=p",), ("toB10", "alup:from B")),
    "two targets": (PATH + HANDLES + circle("from C", 150, 75) + circle("to C", 1, 1), (), ("fromA150", "fromC150")),
    "one point": ('<path id="x" d="M5,5"/>' + circle("pin", 5, 5), ("--id=x",), ("x", "single point")),
    "text": ('<text id="t">T</text>' + PATH + HANDLES, ("--id=t",), ("t ", "text", "Object to Path")),
    "an image": ('<image id="i"/>' + PATH + HANDLES, ("--id=i",), ("i ", "an image")),
    "not a number": ('<path id="x" d="M0,0 L nan,5"/>' + HANDLES, ("--id=x",), ("x:", "can't be read")),
    "infinite": ('<path id="x" d="M0,0 L1e999,5"/>' + HANDLES, ("--id=x",), ("x:", "too large|beyond")),
    "huge": ('<path id="x" d="M0,0 L1e30,5 C1e200,0 1e300,0 5,5"/>' + HANDLES, ("--id=x",), ("x:", "large")),
    "huge circle": ('<circle id="x" r="1e200"/>' + HANDLES, ("--id=x",), ("x:", "large")),
    "huge arc": ('<path id="x" d="M0,0 A1e200,1 0 0 1 5,5"/>' + HANDLES, ("--id=x",), ("x:",)),
    "unparsable": ('<path id="x" d="M0,0 L5,5 Q"/>' + HANDLES, ("--id=x",), ("x:", "can't be read at character")),
    "a transform that is none": ('<path id="x" transform="matrix(1,2)" d="M0,0 H5"/>' + HANDLES, ("--id=x",), ("x", "transform")),
    "unknown id": (PATH + HANDLES, ("--id=p", "--id=nobody"), ("nobody",)),
    "handle label": (PATH + HANDLES + circle("move", 10, 80), (), ("move10", "alup:pin")),
    "handle of no size": (PATH + HANDLES + '<circle id="z" inkscape:label="alup:pin" r="0"/>', (), ("z", "no size")),
    "huge handle": (PATH + HANDLES + circle("pin", 1e300, 5), (), ("pin",)),
    "negative weight": (PATH + HANDLES, ("--weight_normal=-1",), ("weight normal",)),
    "weight that is no number": (PATH + HANDLES, ("--weight_straight=nan",), ("weight straight",)),
    "spacing of zero": (PATH + HANDLES, ("--spacing=0",), ("spacing",)),
    "no iterations": (PATH + HANDLES, ("--iterations=0",), ("iterations",)),
    "tolerance": (PATH + HANDLES, ("--tolerance=inf",), ("tolerance",)),
}  # fmt: skip


@pytest.mark.parametrize(("body", "arguments", "words"), WRONG.values(), ids=WRONG.keys())
def test_wrong_use_is_one_sentence(
    body: str,
    arguments: Sequence[str],
    words: Sequence[str],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    QuickRun(tmp_path, body, *arguments, capture=capfd).assert_refused(*words)


@pytest.mark.parametrize("name", ["no handles", "from without to", "text", "infinite", "unknown id"])
def test_wrong_use_is_one_sentence_of_the_program(name: str, tmp_path: Path) -> None:
    body, arguments, words = WRONG[name]
    Run(tmp_path, body, *arguments).assert_refused(*words)


def test_an_output_that_is_there_already_stays(tmp_path: Path) -> None:
    run = Run(tmp_path, PATH, "--id=p", old_output="as it was")
    assert run.code != 0
    assert run.output.read_text() == "as it was"


def test_an_unwritable_report(tmp_path: Path) -> None:
    run = Run(tmp_path, PATH + HANDLES, f"--report={tmp_path / 'missing' / 'report.json'}")
    run.assert_refused("report", "missing")


@pytest.mark.parametrize(
    "argument", ["--solver=magic", "--scope=everything", "--spacing=wide", "--unknown=1"]
)
def test_invalid_arguments_are_refused(
    argument: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The answer is argparse's; what matters is that it fails and writes nothing."""
    run = QuickRun(tmp_path, PATH + HANDLES, argument, capture=capfd)
    assert run.code != 0
    assert "Traceback" not in run.stderr
    assert not run.output.exists()
