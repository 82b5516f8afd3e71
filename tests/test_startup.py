# SPDX-License-Identifier: GPL-2.0-or-later
"""Which packages a run gets, under which Python, and what it says when it cannot run.

Packages of one line stand for the environment and for Inkscape's inkex.  They show which copy was imported,
and nothing of this machine takes part.
"""

from __future__ import annotations

import ast
import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import inkscape as harness
import pytest

from alup import startup

# Pretends to be another Python as long as it is not the environment's.
EFFECT = """
import os, sys
if os.environ.get("PRETEND") and sys.prefix == sys.base_prefix:
    sys.implementation.cache_tag = os.environ["PRETEND"]
with open(os.environ["STARTS"], "a") as file:
    file.write("start\\n")
before = list(sys.path)
from alup.startup import prepare
prepare(__file__)
import json
import numpy, scipy, lxml, inkex, cssselect, triangle
packages = {m.__name__: m.WHERE for m in (numpy, scipy, lxml, inkex, cssselect, triangle)}
print(json.dumps({
    "packages": packages,
    "pid": os.getpid(),
    "executable": sys.executable,
    "arguments": sys.argv[1:],
    "input": sys.stdin.read(),
    "utf8": sys.flags.utf8_mode,
    "path": sys.path,
    "path unchanged": sys.path == before,
    "handed over": os.environ.get("ALUP_RESHAPE_INKEX"),
}))
"""

PACKAGES = ("numpy", "scipy", "lxml", "cssselect", "tinycss2", "triangle")


def make_packages(folder: Path, names: tuple[str, ...], where: str) -> None:
    for name in names:
        (folder / name).mkdir(parents=True)
        (folder / name / "__init__.py").write_text(f"WHERE = {where!r}\n")


@dataclass
class World:
    """An extensions folder with an imitated installation, an Inkscape, and a folder of drawings."""

    folder: Path

    def __post_init__(self) -> None:
        self.root = self.folder / "extensions" / "alup-reshape"
        (self.root / "alup").mkdir(parents=True)
        shutil.copy(startup.__file__, self.root / "alup")
        for name in ("scipy_imports.py", "messages/__init__.py", "messages/language.py"):
            (self.root / "alup" / name).parent.mkdir(exist_ok=True)
            shutil.copy(Path(startup.__file__).parent / name, self.root / "alup" / name)
        (self.root / "alup" / "__init__.py").touch()
        (self.root / "effect.py").write_text(EFFECT)
        self.venv = self.root / "venv"
        # -S: the site-packages of the Python that runs the tests are not there.
        base = os.path.realpath(sys.executable)
        subprocess.run([base, "-m", "venv", "--without-pip", str(self.venv)], check=True)
        self.packages = next(self.venv.glob("lib/*/site-packages"))
        make_packages(self.packages, PACKAGES, "environment")
        self.inkscape = self.folder / "share" / "inkscape" / "extensions"
        make_packages(self.inkscape, ("inkex",), "Inkscape")
        # Inkscape's folder has an effect of this name.
        (self.inkscape / "triangle.py").write_text("WHERE = 'Inkscape'\n")
        self.drawings = self.folder / "drawings"
        self.drawings.mkdir()
        self.starts = self.folder / "starts"
        self.record()

    def record(self, **changes: str) -> None:
        """What the installer records, with changes."""
        record = {
            "tag": startup.interpreter_tag(),
            "python": "Python 3.7",
            "packages": str(self.packages.relative_to(self.root)),
            "inkex": str(self.inkscape),
            **changes,
        }
        (self.root / startup.RECORD_NAME).write_text(json.dumps(record))

    def run(self, *arguments: str, **variables: object) -> subprocess.CompletedProcess[str]:
        """Start the effect as Inkscape does, but for variables and the working folder."""
        pythonpath = os.pathsep.join([str(self.root.parent), str(self.inkscape)])
        environment = harness.clean_environment(
            **{
                "PYTHONPATH": pythonpath,
                "PYTHONDONTWRITEBYTECODE": 1,
                "STARTS": self.starts,
                # An Inkscape of this machine must not be asked.
                "INKSCAPE_COMMAND": "/nowhere/inkscape",
                **variables,
            }
        )
        return subprocess.run(
            [os.path.realpath(sys.executable), "-S", str(self.root / "effect.py"), *arguments],
            env=environment,
            cwd=self.drawings,
            input="from stdin",
            capture_output=True,
            text=True,
            timeout=60,
        )

    def told(self, *arguments: str, **variables: object) -> dict[str, Any]:
        done = self.run(*arguments, **variables)
        assert (done.returncode, done.stderr) == (0, "")
        told = json.loads(done.stdout)
        assert isinstance(told, dict)
        return told

    def number_of_starts(self) -> int:
        return len(self.starts.read_text().splitlines())


@pytest.fixture
def world(tmp_path: Path) -> World:
    return World(tmp_path)


ALL_PRIVATE = {
    "numpy": "environment",
    "scipy": "environment",
    "lxml": "environment",
    "cssselect": "environment",
    "triangle": "environment",
    "inkex": "Inkscape",
}


def assert_one_sentence(done: subprocess.CompletedProcess[str], world: World, *words: str) -> None:
    """Exit code 1, nothing on stdout, and one line that has the words and the remedy."""
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert "Traceback" not in done.stderr
    for word in (*words, "choose Extensions > ALUP Reshape > Set up..."):
        assert word in done.stderr


def test_environment_of_this_python_is_used_in_the_same_process(world: World) -> None:
    told = world.told()
    assert told["packages"] == ALL_PRIVATE
    assert world.number_of_starts() == 1
    assert told["path"][0] == str(world.packages)


def test_packages_come_before_what_the_python_has_itself(world: World, tmp_path: Path) -> None:
    make_packages(tmp_path / "dist-packages", PACKAGES, "system")
    pythonpath = f"{tmp_path / 'dist-packages'}:{world.root.parent}:{world.inkscape}"
    assert world.told(PYTHONPATH=pythonpath)["packages"] == ALL_PRIVATE


def test_another_python_starts_the_environments_own(world: World) -> None:
    told = world.told("--id=a", "--name=ü b", "file.svg", PRETEND="cpython-999")
    assert told["packages"] == ALL_PRIVATE
    assert told["executable"] == str(world.venv / "bin" / "python3")
    assert told["arguments"] == ["--id=a", "--name=ü b", "file.svg"]
    assert told["input"] == "from stdin"
    assert told["utf8"] == 1
    assert told["handed over"] is None
    assert world.number_of_starts() == 2


def test_inkex_is_that_of_the_inkscape_which_runs_the_effect(world: World, tmp_path: Path) -> None:
    make_packages(tmp_path / "other", ("inkex",), "another Inkscape")
    pythonpath = f"{world.root.parent}:{tmp_path / 'other'}:{world.inkscape}"
    for pretend in ("", "cpython-999"):
        told = world.told(PYTHONPATH=pythonpath, PRETEND=pretend)
        assert told["packages"] == {**ALL_PRIVATE, "inkex": "another Inkscape"}


def test_run_directly_the_recorded_inkex_serves(world: World) -> None:
    assert world.told(PYTHONPATH="")["packages"] == ALL_PRIVATE
    assert world.told(PYTHONPATH="", PRETEND="cpython-999")["packages"] == ALL_PRIVATE


def test_when_the_recorded_inkex_is_gone_inkscape_is_asked(world: World, tmp_path: Path) -> None:
    world.record(inkex="/nowhere")
    asked = tmp_path / "asked"
    asked.write_text(f"#!/bin/sh\necho a warning\necho {world.inkscape.parent}\n")
    asked.chmod(0o755)
    for pretend in ("", "cpython-999"):
        told = world.told(PYTHONPATH="", PRETEND=pretend, INKSCAPE_COMMAND=asked)
        assert told["packages"] == ALL_PRIVATE


def test_without_any_inkex_the_remedy_is_inkscape(world: World) -> None:
    world.record(inkex="/nowhere")
    done = world.run(PYTHONPATH="")
    assert done.returncode == 1
    assert "does not find inkex" in done.stderr
    assert "start it from Inkscape" in done.stderr


@pytest.mark.parametrize("pretend", ["", "cpython-999"])
def test_a_missing_package_is_named(world: World, pretend: str) -> None:
    shutil.rmtree(world.packages / "scipy")
    assert_one_sentence(world.run(PRETEND=pretend), world, "does not find scipy")


def test_a_folder_of_the_name_is_not_the_package(world: World) -> None:
    (world.packages / "scipy" / "__init__.py").unlink()
    assert_one_sentence(world.run(), world, "does not find scipy")


def test_when_the_environments_python_is_gone_its_version_is_named(world: World) -> None:
    python = world.venv / "bin" / "python3"
    python.unlink()
    python.symlink_to("/nowhere/python3.7")
    done = world.run(PRETEND="cpython-999")
    assert_one_sentence(done, world, "numpy, scipy", "installed for Python 3.7")
    assert world.number_of_starts() == 1


def test_when_the_environments_python_became_another_its_version_is_named(world: World) -> None:
    world.record(tag="cpython-37-linux-x86_64")
    done = world.run(PRETEND="cpython-999")
    assert_one_sentence(done, world, "numpy, scipy", "installed for Python 3.7")
    assert world.number_of_starts() == 1


def test_there_is_never_a_third_start(world: World) -> None:
    # The environment's Python answers as hoped, but is for another machine.
    world.record(tag=sys.implementation.cache_tag + "-elsewhere")
    shutil.rmtree(world.packages / "scipy")
    assert_one_sentence(world.run(), world, "does not find scipy", "installed for Python 3.7")
    assert world.number_of_starts() == 2


def test_a_broken_environment_is_ignored_by_a_python_that_has_all(world: World, tmp_path: Path) -> None:
    world.record(tag="cpython-37-linux-x86_64")
    make_packages(tmp_path / "own", PACKAGES, "own")
    told = world.told(PYTHONPATH=f"{world.root.parent}:{world.inkscape}:{tmp_path / 'own'}")
    assert told["packages"] == {
        **dict.fromkeys(ALL_PRIVATE, "own"),
        "inkex": "Inkscape",
        "triangle": "Inkscape",
    }


@pytest.mark.parametrize("record", [None, "", "{", "[]", '{"tag": 1}', '{"tag": "cpython"}'])
def test_without_a_readable_record_nothing_is_changed(
    world: World, tmp_path: Path, record: str | None
) -> None:
    (world.root / startup.RECORD_NAME).unlink()
    if record is not None:
        (world.root / startup.RECORD_NAME).write_text(record)
    make_packages(tmp_path / "own", PACKAGES, "own")
    told = world.told(PYTHONPATH=f"{world.inkscape}:{tmp_path / 'own'}")
    assert told["path unchanged"] is True
    assert world.number_of_starts() == 1


@pytest.mark.parametrize("pretend", ["", "cpython-999"])
@pytest.mark.parametrize(
    "form", [":", "{here}", ".:{inkscape}:", "{extensions}:{inkscape}:{here}", "{here}:{inkscape}"]
)
def test_modules_beside_the_drawing_are_never_imported(world: World, form: str, pretend: str) -> None:
    for name in ("numpy", "inkex", "scipy", "lxml", "json", "subprocess", "importlib"):
        (world.drawings / f"{name}.py").write_text("raise SystemExit('hijacked')\n")
    pythonpath = form.format(here=world.drawings, inkscape=world.inkscape, extensions=world.root.parent)
    told = world.told(PYTHONPATH=pythonpath, PRETEND=pretend)
    assert told["packages"] == ALL_PRIVATE
    assert str(world.drawings) not in told["path"]


@pytest.mark.parametrize("pretend", ["", "cpython-999"])
def test_what_pythonpath_held_before_does_not_count(world: World, tmp_path: Path, pretend: str) -> None:
    make_packages(tmp_path / "projects", ("inkex", *PACKAGES), "somebody's")
    assert world.told(PYTHONPATH=tmp_path / "projects", PRETEND=pretend)["packages"] == ALL_PRIVATE


def test_a_relative_folder_is_not_searched_without_a_record_either(world: World, tmp_path: Path) -> None:
    (world.root / startup.RECORD_NAME).unlink()
    make_packages(tmp_path / "own", PACKAGES, "own")
    make_packages(world.drawings / "beside", PACKAGES, "hijacked")
    told = world.told(PYTHONPATH=f"beside:{world.inkscape}:{tmp_path / 'own'}")
    assert told["packages"]["numpy"] == "own"


def test_a_deleted_working_folder_is_no_obstacle(world: World) -> None:
    here = world.drawings
    command = f"cd '{here}' && rmdir '{here}' && exec '{sys.executable}' '{world.root}/effect.py'"
    environment = harness.clean_environment(STARTS=world.starts)
    done = subprocess.run(
        ["sh", "-c", command], env=environment, capture_output=True, text=True, input="", timeout=60
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_import_of_startup_loads_nothing_else() -> None:
    program = (
        "import sys; sys.path.insert(0, sys.argv[1]); before = set(sys.modules); import alup.startup;"
        "print(sorted(set(sys.modules) - before))"
    )
    done = subprocess.run(
        [sys.executable, "-I", "-c", program, str(harness.ROOT)], capture_output=True, text=True, check=True
    )
    assert ast.literal_eval(done.stdout) == ["alup", "alup.startup"]


def test_the_oldest_python_can_read_it() -> None:
    """An older Python must be able to read it, to say its sentence."""
    for file in (
        Path(startup.__file__),
        harness.ROOT / "alup_reshape.py",
        harness.ROOT / "alup" / "__init__.py",
    ):
        ast.parse(file.read_text(encoding="utf-8"), feature_version=(3, 8))


def test_packages_of_this_python_are_found() -> None:
    assert startup.missing_packages() == []


def test_a_record_is_written_as_it_is_read(world: World) -> None:
    program = "import sys; from alup import startup; startup.write_record(sys.argv[1], sys.argv[2])"
    subprocess.run(
        [str(world.venv / "bin" / "python3"), "-c", program, str(world.root), "/inkex"],
        cwd=world.root,
        check=True,
    )
    record = startup.read_record(str(world.root))
    assert record == {
        "tag": startup.interpreter_tag(),
        "python": "Python {}.{}".format(*sys.version_info[:2]),
        "packages": str(world.packages.relative_to(world.root)),
        "inkex": "/inkex",
    }


def test_importing_an_effect_leaves_the_collector_on() -> None:
    """Only the process that runs an effect may switch it off; a program that imports one goes on."""
    program = "import gc, sys; sys.path.insert(0, sys.argv[1]); import alup_reshape; print(gc.isenabled())"
    root = str(Path(startup.__file__).parents[1])
    done = subprocess.run([sys.executable, "-c", program, root], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("True\n", "")
