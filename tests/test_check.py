# SPDX-License-Identifier: GPL-2.0-or-later
"""Check installation: what it says when all is well, and above all when it isn't."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import Any

import inkscape as harness
import pytest
from lxml import etree

import alup_check_installation as effect
from alup import __version__, startup

ROOT = Path(__file__).resolve().parents[1]
SCRIPT = "alup_check_installation.py"


def check(root: Path, python: Path | str = sys.executable) -> subprocess.CompletedProcess[str]:
    """Run the check of a copy as Inkscape does, with nothing of this process's environment."""
    done = subprocess.run(
        [str(python), str(root / SCRIPT)],
        env=harness.clean_environment(INKSCAPE_COMMAND="/nowhere/inkscape"),
        cwd=root,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.stdout == ""  # Inkscape would take it for the drawing
    assert "Traceback" not in done.stderr
    return done


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """An extension folder without an environment."""
    root = tmp_path / "alup-reshape"
    root.mkdir()
    for file in ROOT.glob("alup_*.py"):
        shutil.copy(file, root)
    shutil.copytree(ROOT / "alup", root / "alup", ignore=shutil.ignore_patterns("__pycache__"))
    return root


@pytest.fixture
def bare(tmp_path: Path) -> Path:
    """A Python without any package."""
    base = os.path.realpath(sys.executable)
    subprocess.run([base, "-m", "venv", "--without-pip", str(tmp_path / "bare")], check=True)
    return tmp_path / "bare" / "bin" / "python3"


def record(root: Path, **changes: str) -> None:
    """What the installer leaves: an environment for this Python, with changes."""
    packages = sysconfig.get_path("purelib")
    text: dict[str, Any] = {
        "tag": startup.interpreter_tag(),
        "python": "Python {}.{}".format(*sys.version_info[:2]),
        "packages": packages,
        "inkex": packages,
        **changes,
    }
    (root / startup.RECORD_NAME).write_text(json.dumps(text))


def test_all_is_well(copy: Path) -> None:
    done = check(copy)
    assert done.returncode == 0
    lines = done.stderr.split("\n")
    assert lines[0] == f"ALUP Reshape {__version__} can run."
    assert "Environment: none; the packages of this Python are used" in lines
    for name in ("inkex", "numpy", "scipy", "lxml", "cssselect", "qdldl", "libigl"):
        assert re.search(rf"^{name}:? (\d+\.?\d*|not installed)", done.stderr, re.MULTILINE), name
    assert re.search(r"^Trial: a drawing was reshaped in \d+\.\d s$", lines[-2])
    assert "Set up" not in done.stderr


def test_what_is_missing_is_named_with_the_remedy(copy: Path, bare: Path) -> None:
    done = check(copy, bare)
    assert done.returncode == 1
    lines = done.stderr.split("\n")
    assert lines[0] == f"ALUP Reshape {__version__} can't run."
    assert "does not find numpy, scipy, lxml, cssselect, tinycss2, inkex" in lines[1]
    assert done.stderr.count("choose Extensions > ALUP Reshape > Set up...") == 1
    assert f"Extension: {copy}" in lines
    assert any(line.startswith(f"Python: 3.{sys.version_info[1]}.") and str(bare) in line for line in lines)


def test_an_environment_that_fits_is_used_at_once(copy: Path, bare: Path) -> None:
    record(copy)
    done = check(copy, bare)
    assert done.returncode == 0
    assert f"Environment: {copy / 'venv'}, made for this Python" in done.stderr


def test_an_environment_of_another_python_is_started(copy: Path, bare: Path) -> None:
    record(copy, tag=f"{sys.implementation.cache_tag}-elsewhere", python="Python 3.9")
    (copy / "venv").symlink_to(sys.prefix)
    done = check(copy, bare)
    assert done.returncode == 0
    assert "made for Python 3.9; effects are started once more under that" in done.stderr


def test_an_environment_whose_python_is_gone(copy: Path, bare: Path) -> None:
    record(copy, tag="cpython-37-linux", python="Python 3.7", inkex="/nowhere")
    done = check(copy, bare)
    assert done.returncode == 1
    assert "made for Python 3.7, which does not run any more" in done.stderr
    assert "its packages were installed for Python 3.7" in done.stderr


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        ("raise RuntimeError('boom')", "Trial: RuntimeError: boom"),
        ("import os; os.kill(os.getpid(), 11)", "Trial: it ended with the exit code -11 and said nothing"),
        ("import sys; sys.stderr.write('a warning')", "Trial: a warning"),
    ],
)
def test_a_reshape_that_fails_is_told(copy: Path, damage: str, said: str) -> None:
    with open(copy / "alup" / "session" / "pipeline.py", "a") as file:
        file.write(f"\n{damage}\n")
    done = check(copy)
    assert done.returncode == 1
    assert done.stderr.startswith(f"ALUP Reshape {__version__} can't run.\n")
    assert said in done.stderr
    assert "To repair it, choose Extensions > ALUP Reshape > Set up..." in done.stderr
    assert "\nnumpy " in done.stderr  # what is there is told all the same


def test_a_package_that_breaks_on_import_is_told(copy: Path) -> None:
    (copy / "inkex.py").write_text("raise ImportError('libxml2.so.2 is missing')\n")
    done = check(copy)
    assert done.returncode == 1
    assert "libxml2.so.2 is missing" in done.stderr
    assert "Set up" in done.stderr


def test_handles_that_are_missed_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(effect, "ERROR_OF_DIAGONAL", -1.0)
    text, well = effect.check()
    assert not well
    assert re.search(r"handles were missed by \d\.\de-\d\d of its size", text)


def test_patience_has_an_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(effect, "PATIENCE_SECONDS", 0.01)
    text, well = effect.check()
    assert not well
    assert "there was no answer after 0.01 s" in text


def test_stand_ins_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    found = {"inkex": ["1.4", "/inkex"], "numpy": "2.0", "qdldl": None, "libigl": None}
    monkeypatch.setattr(effect, "_run", lambda _: (json.dumps(found), ""))
    lines, trouble = effect._packages()
    assert trouble == []
    assert lines[:2] == ["inkex 1.4, /inkex", "numpy 2.0"]
    assert "SuperLU stands in" in lines[2]
    assert "methods for posing need it" in lines[3]


def test_as_a_class_it_says_the_same(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    drawing, output = tmp_path / "drawing.svg", tmp_path / "output.svg"
    drawing.write_text(effect.DRAWING)
    effect.AlupCheckInstallation().run([f"--output={output}", str(drawing)])
    stdout, stderr = capfd.readouterr()
    assert stdout == ""
    assert stderr.startswith(f"ALUP Reshape {__version__} can run.")
    assert not output.exists()


def test_help_is_help(copy: Path) -> None:
    done = subprocess.run([sys.executable, str(copy / SCRIPT), "--help"], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert "tell whether Reshape can run" in done.stdout


def test_inkscape_shows_it_and_leaves_the_drawing(inkscape: harness.Inkscape, tmp_path: Path) -> None:
    drawing = effect.DRAWING.replace("<svg ", '<svg inkscape:version="1.2" ', 1)
    run = inkscape.reshape(drawing, effect="alup_check_installation")
    assert run.code == 0
    assert run.stderr.startswith(f"ALUP Reshape {__version__} can run.")
    assert "made for this Python" in run.stderr
    assert re.search(r"^inkex 1\.\d", run.stderr, re.MULTILINE)
    paths = {e.get("id"): e.get("d") for e in etree.parse(str(run.output)).iter("{*}path")}
    assert paths["outline"].startswith("M 10,10 H 90 V 60")
