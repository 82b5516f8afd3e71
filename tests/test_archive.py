# SPDX-License-Identifier: GPL-2.0-or-later
"""The release archive: what is in it, and what a person can do with nothing else.

The profile's folder has spaces, umlauts and `&` in its name.
"""

from __future__ import annotations

import csv
import re
import shutil
import subprocess
import sys
import zipfile
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import inkscape as harness
import pytest
import window as desk
from lxml import etree

from alup import __version__, startup
from alup.setup import files

# The effects' ids in 0.1.0.  Preferences and keyboard shortcuts refer to them.
IDS = {
    "org.alup.alup_check_installation",
    "org.alup.alup_place_handles",
    "org.alup.alup_remove_handles",
    "org.alup.alup_reshape",
    "org.alup.alup_restore_original",
}

# Reshape's parameters in 0.1.0; people's preferences hold their values.  The dialog of 0.1.0 also had pages,
# which are gone.
PARAMETERS = {
    *(
        "scope",
        "method",
        "hold",
        "crossings",
        "keep_handles",
        "tolerance",
        "add_nodes",
        "spacing",
        "iterations",
    ),
    *("time_limit", "max_vertices", "solver", "snap", "weight_normal", "weight_tangent", "weight_straight"),
    *("weight_handle", "weight_component", "report"),
}

PROFILE = "Gr\u00fcn & wei\u00df"
PYTHON = "/usr/bin/python3"

EXTENSION = "{http://www.inkscape.org/namespace/inkscape/extension}"


def build(folder: Path, root: Path = harness.ROOT) -> Path:
    command = [sys.executable, "-B", str(root / "release" / "archive.py"), str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    path, size, digest = done.stdout.splitlines()
    assert size == f"{Path(path).stat().st_size} bytes"
    assert re.fullmatch("sha256 [0-9a-f]{64}", digest)
    return Path(path)


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("release"))


@pytest.fixture
def extensions(archive: Path, tmp_path: Path) -> Path:
    """A fresh folder of user extensions into which the archive was unpacked."""
    folder = tmp_path / PROFILE / "extensions"
    folder.mkdir(parents=True)
    zipfile.ZipFile(archive).extractall(folder)
    return folder


@pytest.fixture(scope="session")
def wheels(installed: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of wheels, packed from what is installed: nothing is downloaded."""
    folder = tmp_path_factory.mktemp("wheels")
    (site,) = (harness.extensions_of(installed) / harness.NAME).glob("venv/lib/python3*/site-packages")
    for information in site.glob("*.dist-info"):
        tag = re.search("(?m)^Tag: (.*)$", (information / "WHEEL").read_text())
        assert tag is not None
        name = f"{information.name[: -len('.dist-info')]}-{tag[1]}.whl"
        with zipfile.ZipFile(folder / name, "w") as wheel:
            for file, *_ in csv.reader((information / "RECORD").read_text().splitlines()):
                if not file.startswith("../") and "__pycache__" not in file:
                    wheel.write(site / file, file)
    return folder


def test_the_archive_is_the_same_wherever_it_is_built(archive: Path, tmp_path: Path) -> None:
    """It is built from a copy with other times and permissions, and with compiled modules in it."""
    copy = tmp_path / "copy"
    for name in ("alup", "locale", "release"):
        shutil.copytree(harness.ROOT / name, copy / name, copy_function=shutil.copyfile)
    for file in harness.ROOT.glob("*.*"):
        if file.is_file():
            shutil.copyfile(file, copy / file.name)
    shutil.copyfile(harness.ROOT / "LICENSE", copy / "LICENSE")
    (copy / "alup" / "__pycache__").mkdir(exist_ok=True)
    (copy / "alup" / "__pycache__" / "network.cpython-37.pyc").touch()
    assert build(tmp_path, copy).read_bytes() == archive.read_bytes()
    assert archive.name == f"alup-reshape-{__version__}.zip"


def test_the_archive_has_the_files_that_run_and_no_others(archive: Path) -> None:
    content = zipfile.ZipFile(archive)
    assert {name.split("/")[0] for name in content.namelist()} == {harness.NAME}
    names = {name.split("/", 1)[1] for name in content.namelist()}
    tops = {name for name in names if "/" not in name}
    others = {"FILES", "LICENSE", "install.sh", "install.cmd"}
    assert {name for name in tops if not name.startswith("alup_")} == others
    assert tops >= {file.name for file in harness.ROOT.glob("alup_*.*")}
    assert {name.split("/")[0] for name in names - tops} == {"alup", "locale"}
    package = {
        path for path in (harness.ROOT / "alup").rglob("*") if path.is_file() and path.suffix != ".pyc"
    }
    assert {name for name in names if name.startswith("alup/")} == {
        path.relative_to(harness.ROOT).as_posix() for path in package
    }
    assert {Path(name).suffix for name in names if name.startswith("locale/")} == {".mo"}
    assert archive.stat().st_size < 2_000_000
    assert {entry.date_time for entry in content.infolist()} == {(1980, 1, 1, 0, 0, 0)}
    assert content.getinfo(f"{harness.NAME}/install.sh").external_attr >> 16 == 0o100755


def test_the_readme_names_it(archive: Path) -> None:
    text = (harness.ROOT / "README.md").read_text(encoding="utf-8")
    assert set(re.findall(r"alup-reshape-[\d.]+\.zip", text)) == {archive.name}
    assert text.index(archive.name) < text.index("sh install.sh --demo") < text.index("sh tests/run.sh")


def drawing(file: Path) -> dict[str, dict[str, str]]:
    return {e.attrib["id"]: dict(e.attrib) for e in etree.parse(str(file)).iter("{*}path", "{*}circle")}


def test_every_effect_names_set_up_in_one_sentence(extensions: Path) -> None:
    root = extensions / harness.NAME
    menu = {file.stem for file in root.glob("*.inx")}
    assert menu == {file.stem for file in root.glob("alup_*.py")}
    sentence = "choose Extensions > ALUP Reshape > Set up..."
    for name in sorted(menu - {"alup_set_up"}):
        done = subprocess.run(
            [PYTHON, "-B", "-S", str(root / f"{name}.py"), str(harness.ROOT / "examples" / "truck.svg")],
            env=harness.clean_environment(INKSCAPE_COMMAND="/nowhere/inkscape"),
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert (done.returncode, done.stdout) == (1, ""), name
        assert sentence in done.stderr
        # The check says more than that, but names the remedy once.
        assert done.stderr.count("Set up") == 1
        assert done.stderr.count("\n") == 1 or name == "alup_check_installation"


def test_ids_and_parameters_of_the_first_version_are_kept(extensions: Path) -> None:
    root = extensions / harness.NAME
    trees = [etree.parse(str(file)) for file in root.glob("*.inx")]
    assert {tree.findtext(f"{EXTENSION}id") for tree in trees} >= IDS
    (reshape,) = (tree for tree in trees if tree.findtext(f"{EXTENSION}id") == "org.alup.alup_reshape")
    assert {param.get("name") for param in reshape.iter(f"{EXTENSION}param")} >= PARAMETERS


def run(root: Path, name: str, source: Path, target: Path) -> None:
    command = [PYTHON, str(root / name), f"--output={target}", str(source)]
    done = subprocess.run(
        command, env=harness.clean_environment(), capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_a_version_unpacked_over_an_older_one_works(installed: Path, archive: Path, tmp_path: Path) -> None:
    """The old environment is used; handles and originals of 0.1.0 in a drawing are understood."""
    home = harness.clone(installed, tmp_path)
    extensions = harness.extensions_of(home)
    root = extensions / harness.NAME
    preferences = extensions.parent / "preferences.xml"
    preferences.write_text(
        '<inkscape><group id="extensions" org.alup.alup_reshape.hold="firmly"/></inkscape>'
    )
    before = preferences.read_bytes()
    # The first version had neither of these, and fewer modules.
    shutil.rmtree(root / "alup")
    for name in ("alup_set_up.py", "alup_set_up.inx", "install.cmd", "LICENSE"):
        (root / name).unlink()
    for file in root.glob("alup_*.*"):
        file.unlink()  # a link to that of the other tests
    (root / "install.sh").unlink()
    shutil.rmtree(root / "locale")
    zipfile.ZipFile(archive).extractall(extensions)

    old = harness.ROOT / "tests" / "data" / "reshaped-by-0.1.0.svg"
    again, restored = tmp_path / "again.svg", tmp_path / "restored.svg"
    run(root, "alup_reshape.py", old, again)
    handles = {"h1", "h2", "h3"}
    assert {name: drawing(again)[name] for name in handles} == {name: drawing(old)[name] for name in handles}
    run(root, "alup_restore_original.py", again, restored)
    # Modules that the new version no longer has do no harm.  Setting up removes them.
    old_module, theirs = root / "alup" / "moved_elsewhere.py", root / "notes.txt"
    old_module.write_text("from . import what_is_gone\n")
    theirs.touch()
    assert drawing(restored)["curve"]["d"] == "M 10,10 H 60 V 60 H 10 Z"
    done = harness.install(home, "--check")
    assert (done.returncode, done.stderr) == (0, "")
    assert preferences.read_bytes() == before
    files.remove_old(str(root))
    assert not old_module.exists()
    assert theirs.exists()
    assert files.missing(str(root)) == []


# --- in a window ----------------------------------------------------------------------------------


def has_gtk() -> bool:
    program = "import gi; gi.require_version('Gtk', '3.0'); from gi.repository import Gtk"
    return subprocess.run([PYTHON, "-c", program], stderr=subprocess.DEVNULL).returncode == 0


def press(screen: desk.Screen, identity: str, *keys: str) -> None:
    screen.xdotool("windowactivate", "--sync", identity)
    screen.xdotool("key", *keys)


@pytest.mark.skipif(shutil.which("inkscape") is None, reason="Inkscape is not installed")
@pytest.mark.skipif(not has_gtk(), reason="Inkscape's Python has no GTK here")
@pytest.mark.timeout(280)
def test_from_the_archive_alone(extensions: Path, wheels: Path, tmp_path: Path) -> None:
    """Reshape names Set up, Set up sets up in its window, Reshape works."""
    root = extensions / harness.NAME
    file = tmp_path / "truck.svg"
    shutil.copy(harness.ROOT / "examples" / "truck.svg", file)
    chosen: dict[str, Any] = {"source": "folder", "wheels": wheels}
    parameters = {f"org.alup.alup_set_up.{name}": value for name, value in chosen.items()}
    with ExitStack() as stack:
        screen = stack.enter_context(desk.screen(tmp_path / "screen"))
        window = stack.enter_context(
            desk.open_window(screen, extensions, file, tmp_path / "window", parameters)
        )
        before = window.document()
        with window.dialog("Reshape") as dialog:
            dialog.apply()
        assert window.runs() == [1]
        assert "choose Extensions > ALUP Reshape > Set up..." in window.stderr()

        def begin(key: str) -> str:
            """Answer the window of Set up by a key; its identity."""
            dialog = screen.wait("the dialog", lambda: screen.windows("Set up$"))[0]
            press(screen, dialog, "alt+a")
            identity = screen.wait("its window", lambda: screen.windows("^ALUP Reshape$"))[0]
            screen.rest()
            assert not (root / "venv").exists()
            press(screen, identity, key)
            return identity

        window.choose("Set up")
        begin("Escape")
        window.finish(2)
        assert window.runs() == [1, 1]
        assert not (root / "venv").exists()

        identity = begin("alt+s")
        screen.wait(
            "the end", lambda: startup.read_record(str(root)) and not list(extensions.glob(".*lock")), 120
        )
        screen.rest()
        press(screen, identity, "Return")
        window.finish(3)
        for dialog_of_set_up in screen.windows("Set up$"):
            press(screen, dialog_of_set_up, "alt+c")
        screen.rest()
        assert window.runs() == [1, 1, 0]
        with window.dialog("Reshape") as dialog:
            dialog.apply()
        after = window.save()
    assert window.runs() == [1, 1, 0, 0]
    assert window.stderr().count("\n") == 1
    paths = [[e.get("d") for e in svg.iter("{*}path")] for svg in (before, after)]
    assert paths[0] != paths[1]
