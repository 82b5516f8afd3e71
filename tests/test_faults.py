# SPDX-License-Identifier: GPL-2.0-or-later
"""Faults around a run: the drawing is never lost, damaged or half written, and no run hangs.

The program runs unchanged, with faults from outside: limits, signals, closed pipes, missing packages.  A run
either writes a drawing and says nothing, or says one sentence, fails, and leaves all files unchanged.
"""

from __future__ import annotations

import io
import json
import os
import resource
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Callable

import inkscape as harness
import numpy as np
import pytest
from builders import BLOB
from lxml import etree
from test_effect import HANDLES, HEAD, PATH, SCRIPT, circle

import alup_check_installation
from alup.document import effect
from alup.svg import path_data

ROOT = SCRIPT.parent
GIB = 1 << 30

# A part without a handle, tied to the other.
PART = '<rect id="part" x="40" y="60" width="20" height="30"/>'
DRAWING = HEAD + PATH + PART + HANDLES + "</svg>"

# Python's own finder, with some packages left out.
WITHOUT = """
import sys
from importlib.machinery import PathFinder

class Without(PathFinder):
    @classmethod
    def find_spec(cls, name, path=None, target=None):
        return None if name in {names!r} else super().find_spec(name, path, target)

sys.meta_path = [Without if finder is PathFinder else finder for finder in sys.meta_path]
"""


@dataclass
class Case:
    """A drawing in a folder of its own, and a program that is to be run on it."""

    folder: Path
    drawing: str = DRAWING
    variables: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.folder.mkdir(exist_ok=True)
        self.input, self.output, self.report = (
            self.folder / name for name in ("in.svg", "out.svg", "report.json")
        )
        self.input.write_text(self.drawing, encoding="utf-8")

    def at_start(self, program: str) -> None:
        """Make Python run this program before anything else."""
        injected = self.folder / "injected"
        injected.mkdir(exist_ok=True)
        (injected / "sitecustomize.py").write_text(program)
        self.variables["PYTHONPATH"] = str(injected)

    def fake(self, package: str, program: str) -> None:
        """Replace a package by this program."""
        (self.folder / "injected" / package).mkdir(parents=True)
        (self.folder / "injected" / package / "__init__.py").write_text(program)
        self.variables["PYTHONPATH"] = str(self.folder / "injected")

    def start(
        self,
        *arguments: str,
        output: Path | None = None,
        to_stdout: bool = False,
        script: Path = SCRIPT,
        prepare: Callable[[], object] | None = None,
        stdout: Any = subprocess.PIPE,
    ) -> subprocess.Popen[bytes]:
        given = [] if to_stdout else [f"--output={output or self.output}", f"--report={self.report}"]
        return subprocess.Popen(
            [sys.executable, str(script), *given, *arguments, str(self.input)],
            env=harness.clean_environment(PYTHONDONTWRITEBYTECODE=1, PYTHONUNBUFFERED="", **self.variables),
            cwd=self.folder,
            stdin=subprocess.DEVNULL,
            stdout=stdout,
            stderr=subprocess.PIPE,
            preexec_fn=prepare,  # noqa: PLW1509 - the tests have no threads
        )

    def run(self, *arguments: str, **options: Any) -> Done:
        process = self.start(*arguments, **options)
        stdout, stderr = process.communicate(timeout=120)
        return Done(process.returncode, stdout or b"", stderr.decode())

    def reshaped(self, *arguments: str, **options: Any) -> dict[str, Any]:
        """The report of a run that must succeed without a word, and leave nothing else behind."""
        before = set(os.listdir(self.folder))
        done = self.run(*arguments, **options)
        assert (done.code, done.stderr, done.stdout) == (0, "", b"")
        assert set(os.listdir(self.folder)) - before <= {"out.svg", "report.json"}
        told = json.loads(self.report.read_text())
        assert told["handle_error_of_diagonal"] < 1e-4
        return dict(told)

    def refused(self, *words: str, arguments: tuple[str, ...] = (), **options: Any) -> None:
        """A run that must fail in one sentence and touch nothing."""
        before = self._files()
        done = self.run(*arguments, **options)
        assert done.code != 0
        assert "Traceback" not in done.stderr
        lines = done.stderr.strip().split("\n")
        assert len(lines) == 1, done.stderr
        assert lines[0][-1] in ".)'", lines
        for word in words:
            assert word in lines[0]
        assert self._files() == before

    def _files(self) -> dict[str, bytes]:
        """All but the report, which may be written before the drawing turns out to be unwritable."""
        return {name: data for name, data in contents(self.folder).items() if name != self.report.name}


@dataclass
class Done:
    code: int
    stdout: bytes
    stderr: str


def contents(folder: Path) -> dict[str, bytes]:
    return {str(f.relative_to(folder)): f.read_bytes() for f in folder.rglob("*") if f.is_file()}


@pytest.fixture
def case(tmp_path: Path) -> Case:
    return Case(tmp_path / "case")


def outline(file: Path, identity: str = "p") -> np.ndarray:
    found = next(e for e in etree.fromstring(file.read_bytes()).iter() if e.get("id") == identity)
    return np.concatenate([subpath.control for subpath in path_data.parse(found.attrib["d"])])


def limit(which: int, size: int) -> Callable[[], None]:
    return lambda: resource.setrlimit(which, (size, size))


def wait_for(what: Callable[[], bool], seconds: float) -> bool:
    end = time.monotonic() + seconds
    while not what():
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True


# --- runs that are ended -------------------------------------------------------------------------

SLEEPS = """
import os, time
class Solver:
    def __init__(self, *_, **__):
        with open("solving.part", "w") as file:
            file.write("")
        os.rename("solving.part", "solving")
        while True:
            time.sleep(1.0)
"""


@pytest.mark.parametrize("by", [signal.SIGTERM, signal.SIGKILL])
def test_a_run_that_is_ended_leaves_all_as_it_was(by: signal.Signals, case: Case) -> None:
    case.fake("qdldl", SLEEPS)
    case.output.write_text("as it was")
    before = contents(case.folder)
    process = case.start()
    assert wait_for((case.folder / "solving").exists, 30.0)
    process.send_signal(by)
    stdout, stderr = process.communicate(timeout=10)
    assert (process.returncode, stdout, stderr) == (-by, b"", b"")
    (case.folder / "solving").unlink()
    assert contents(case.folder) == before


def test_an_interrupted_run_says_so(case: Case) -> None:
    """Ctrl-C.  Programs that a shell starts in the background ignore it, so it is enabled here."""
    case.fake("qdldl", SLEEPS)
    process = case.start(prepare=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
    assert wait_for((case.folder / "solving").exists, 30.0)
    process.send_signal(signal.SIGINT)
    _, stderr = process.communicate(timeout=10)
    assert process.returncode != 0
    assert stderr.decode() == "Interrupted: nothing was changed.\n"
    assert not case.output.exists()


def test_no_process_is_started(case: Case) -> None:
    case.at_start("import os\ndef fork():\n    raise OSError(11, 'Too many processes')\nos.fork = fork\n")
    assert case.reshaped()["ties"]["facing"] > 0


def test_whoever_starts_the_run_may_ignore_the_end_of_children(case: Case) -> None:
    told = case.reshaped(prepare=lambda: signal.signal(signal.SIGCHLD, signal.SIG_IGN))
    assert told["ties"]["facing"] > 0


# --- packages, folders --------------------------------------------------------------------------


@pytest.fixture(scope="module")
def usual(tmp_path_factory: pytest.TempPathFactory) -> Case:
    """A run in which nothing is wrong."""
    case = Case(tmp_path_factory.mktemp("usual") / "case")
    case.reshaped()
    return case


def test_without_an_optional_package_its_substitute_is_used(case: Case, usual: Case) -> None:
    case.at_start(WITHOUT.format(names=("qdldl",)))
    told = case.reshaped()
    assert "qdldl" not in told["versions"]
    np.testing.assert_allclose(outline(case.output), outline(usual.output), atol=1e-3)


@pytest.mark.parametrize("name", ["scipy", "numpy", "lxml"])
def test_without_a_required_package_the_remedy_is_told(name: str, case: Case) -> None:
    case.at_start(WITHOUT.format(names=(name,)))
    case.refused(f"does not find {name}", "Set up...")


def test_a_folder_of_the_extension_that_nobody_may_write_to(case: Case, tmp_path: Path) -> None:
    root = tmp_path / "alup-reshape"
    root.mkdir()
    for file in ROOT.glob("alup_*.py"):
        shutil.copy(file, root)
    shutil.copytree(ROOT / "alup", root / "alup", ignore=shutil.ignore_patterns("__pycache__"))
    for path in (root, *root.rglob("*")):
        path.chmod(0o555 if path.is_dir() else 0o444)
    before = contents(root)
    prepare = harness.under_permissions()
    probe = subprocess.run(["touch", str(root / "new")], preexec_fn=prepare, stderr=subprocess.DEVNULL)
    if probe.returncode == 0:
        pytest.skip("nothing keeps this system's administrator from writing")
    case.reshaped(script=root / SCRIPT.name, prepare=prepare)
    assert contents(root) == before


def test_a_run_needs_no_room_for_temporary_files(case: Case, usual: Case) -> None:
    case.variables["TMPDIR"] = "/nowhere"
    case.at_start("import tempfile\ntempfile._candidate_tempdir_list = lambda: []\n")
    case.reshaped()
    assert case.output.read_bytes() == usual.output.read_bytes()


def test_without_room_for_temporary_files_the_check_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any, **__: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(tempfile, "TemporaryDirectory", full)
    text, well = alup_check_installation.check()
    assert not well
    assert "No space left on device" in text
    assert "TMPDIR" in text


def test_without_room_for_temporary_files_nothing_is_installed(tmp_path: Path) -> None:
    done = harness.install(tmp_path / "home", TMPDIR="/nowhere")
    assert done.returncode == 1
    assert "install.sh: no temporary folder" in done.stderr
    assert contents(tmp_path) == {}


# --- where the drawing goes ---------------------------------------------------------------------


# A drawing that fits into the buffer of the standard output fails only when the buffer is flushed.
@pytest.mark.parametrize("size", [0, 100_000])
@pytest.mark.parametrize("full", [False, True])
def test_a_standard_output_that_takes_nothing(full: bool, size: int, tmp_path: Path) -> None:
    case = Case(tmp_path / "case", f"{HEAD}<desc>{'x' * size}</desc>{PATH}{HANDLES}</svg>")
    reading, writing = os.pipe()
    os.close(reading)
    with open("/dev/full", "wb") if full else os.fdopen(writing, "wb") as output:
        reason = "No space left" if full else "Broken pipe"
        case.refused("standard output", reason, to_stdout=True, stdout=output)
    if full:
        os.close(writing)


def test_a_closed_standard_output(case: Case) -> None:
    case.refused("standard output is closed", to_stdout=True, prepare=lambda: os.close(1))


def test_an_output_folder_that_does_not_exist(case: Case) -> None:
    missing = case.folder / "missing" / "out.svg"
    case.refused(str(missing), "No such file", "--output", output=missing)


def test_a_folder_in_place_of_a_file(case: Case) -> None:
    case.output.mkdir()
    case.refused(str(case.output), "Is a directory")


def test_a_disk_that_is_full_while_the_drawing_is_written_over_itself(case: Case) -> None:
    """The old file stays whole until the new one is whole."""
    small = case.input.stat().st_size // 2
    case.refused(
        str(case.input), "File too large", output=case.input, prepare=limit(resource.RLIMIT_FSIZE, small),
        arguments=("--report=",),
    )  # fmt: skip
    assert case.input.read_text() == DRAWING


def test_a_drawing_may_be_written_over_itself(case: Case, usual: Case) -> None:
    case.input.chmod(0o640)
    case.reshaped(output=case.input)
    assert case.input.read_bytes() == usual.output.read_bytes()
    assert stat.S_IMODE(case.input.stat().st_mode) == 0o640


def test_a_link_stays_a_link(case: Case, usual: Case) -> None:
    target = case.folder / "out.svg"
    target.write_text("old")
    link = case.folder / "link.svg"
    link.symlink_to(target)
    case.reshaped(output=link)
    assert link.is_symlink()
    assert target.read_bytes() == usual.output.read_bytes()


def test_a_stream_that_takes_a_little_at_a_time() -> None:
    class Slow(io.RawIOBase):
        def __init__(self, most: int) -> None:
            self.most, self.got = most, b""

        def write(self, data: Any) -> int:
            self.got += bytes(data[: self.most])
            return min(self.most, len(data))

    slow = Slow(3)
    effect._write_all(slow, b"a drawing")
    assert slow.got == b"a drawing"
    with pytest.raises(BlockingIOError):
        effect._write_all(Slow(0), b"a drawing")


@pytest.mark.parametrize("failing", ["fsync", "replace"])
def test_whatever_step_fails_no_partial_file_is_left(
    failing: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: Any) -> None:
        raise OSError(5, "Input/output error")

    file = tmp_path / "drawing.svg"
    file.write_text("old")
    monkeypatch.setattr(os, failing, fail)
    with pytest.raises(OSError, match="Input/output"):
        effect.write_whole(str(file), b"new")
    assert contents(tmp_path) == {"drawing.svg": b"old"}


def test_two_runs_at_once(case: Case, usual: Case) -> None:
    runs = [case.start() for _ in range(2)]
    for run in runs:
        _, stderr = run.communicate(timeout=120)
        assert (run.returncode, stderr) == (0, b"")
    assert case.output.read_bytes() == usual.output.read_bytes()
    assert sorted(os.listdir(case.folder)) == ["in.svg", "out.svg", "report.json"]


# --- languages ----------------------------------------------------------------------------------


def test_a_language_with_a_decimal_comma(case: Case, usual: Case, tmp_path: Path) -> None:
    """Even where something has told the C library to use it."""
    if not shutil.which("localedef") or not Path("/usr/share/i18n/locales/de_DE").exists():
        pytest.skip("no German locale can be made here")
    made = subprocess.run(
        ["localedef", "-i", "de_DE", "-f", "UTF-8", str(tmp_path / "de_DE.UTF-8")], capture_output=True
    )
    assert made.returncode == 0, made.stderr
    case.variables.update(LOCPATH=str(tmp_path), LC_ALL="de_DE.UTF-8")
    case.at_start(
        "import locale\nlocale.setlocale(locale.LC_ALL, '')\n"
        "with open('comma', 'w') as file:\n    file.write(locale.str(0.5))\n"
    )
    (case.folder / "comma").touch()
    case.reshaped()
    assert (case.folder / "comma").read_text() == "0,5"
    assert case.output.read_bytes() == usual.output.read_bytes()


@pytest.mark.parametrize(
    ("name", "language"),
    [
        ("Entwürfe für 日本 & Co", "C.UTF-8"),
        ("Entwürfe {0}", "C"),
        ("a'b\"c $(x) `y` ;z", "C"),
        ("\udcff", "C"),
    ],
)
def test_folders_and_ids_of_any_name(name: str, language: str, tmp_path: Path, usual: Case) -> None:
    case = Case(tmp_path / name, DRAWING.replace('id="p"', 'id="ü日本"').replace('"part"', '"😀"'))
    case.variables["LC_ALL"] = language
    case.reshaped("--id=ü日本", "--id=😀")
    np.testing.assert_array_equal(outline(case.output, "ü日本"), outline(usual.output))
    # The name is also in the sentence about an output that can't be written.
    case.refused("out.svg", "No such file", output=case.folder / "missing" / "out.svg")


# --- sizes --------------------------------------------------------------------------------------


def test_an_image_beyond_the_usual_limit_of_xml(tmp_path: Path) -> None:
    """libxml2 refuses a text of more than 10 MB unless told otherwise."""
    data = "data:image/png;base64," + "iVBO" * 3_000_000
    case = Case(tmp_path / "case", DRAWING.replace("</svg>", f'<image id="i" xlink:href="{data}"/></svg>'))
    case.reshaped(prepare=limit(resource.RLIMIT_AS, GIB))
    assert data in case.output.read_text()


def test_many_elements(tmp_path: Path) -> None:
    columns, side = 30, 6.0
    at = [(side * (n % columns), side * (n // columns)) for n in range(columns * columns)]
    boxes = [f'<path id="b{n}" d="M{x:g},{y:g} h4 v4 h-4 Z"/>' for n, (x, y) in enumerate(at)]
    (x0, y0), (x1, y1), (x2, y2) = at[0], at[columns - 1], at[-1]
    handles = (
        circle("pin", x0, y0) + circle("pin", x2, y2) + circle("from A", x1, y1) + circle("to A", 190, -9)
    )
    case = Case(tmp_path / "case", HEAD + "".join(boxes) + handles + "</svg>")
    told = case.reshaped("--spacing=1", prepare=limit(resource.RLIMIT_AS, GIB))
    assert told["components"] == len(boxes)
    assert told["segments_after"] == told["segments"]


def test_many_vertices_within_a_gibibyte(case: Case) -> None:
    told = case.reshaped(
        "--spacing=0.01", "--max_vertices=20000", "--time_limit=30", prepare=limit(resource.RLIMIT_AS, GIB)
    )
    assert 15_000 < told["vertices"] <= 20_000


@pytest.mark.parametrize("megabytes", [380, 500])
def test_too_little_memory_is_a_sentence(megabytes: int, tmp_path: Path) -> None:
    data = "A" * 90_000_000
    case = Case(tmp_path / "case", DRAWING.replace("</svg>", f"<desc>{data}</desc></svg>"))
    case.refused("memory", prepare=limit(resource.RLIMIT_AS, megabytes << 20))


def test_memory_that_is_used_up_while_solving(case: Case) -> None:
    case.fake("qdldl", "class Solver:\n    def __init__(self, *_, **__):\n        raise MemoryError\n")
    case.refused("not enough memory", "further apart")


def test_the_usual_run_moves_the_outline(usual: Case) -> None:
    """So the comparisons with it above compare a reshaped outline."""
    before = np.concatenate([subpath.control for subpath in path_data.parse(BLOB)])
    assert outline(usual.output)[..., 0].max() > before[..., 0].max() + 10.0
