# SPDX-License-Identifier: GPL-2.0-or-later
"""The private environment is made, repaired and rolled back; every failure has its sentence.

The packages are wheels of one line, in folders that have spaces, umlauts and `&` in their names.  Failures of
the system are simulated.
"""

from __future__ import annotations

import ast
import errno
import http.server
import os
import platform
import shutil
import subprocess
import sys
import threading
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any, Callable, Iterator

import inkscape as harness
import pytest

from alup import startup
from alup.setup import (
    download,
    environment,
    environment_plan,
    faults,
    install,
    lock,
    locked_files,
    managed,
    packages,
    pythons,
    trial,
)
from alup.setup.machine import Machine
from alup.setup.progress import Progress, run
from alup.setup.setup_errors import Cancelled, SetupError, UnfitPythonError

# Stands for Inkscape's Python: it has its own pip, like those of python.org.
PYTHON = os.path.realpath(sys.executable)

NAMES = ("numpy", "scipy", "lxml", "cssselect", "tinycss2", "qdldl")


def make_wheel(folder: Path, name: str, version: str = "5.0", files: dict[str, str] | None = None) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}-{version}-py3-none-any.whl"
    information = f"{name}-{version}.dist-info"
    with zipfile.ZipFile(path, "w") as archive:
        for file, text in (files or {f"{name}/__init__.py": f"NAME = {name!r}\n"}).items():
            archive.writestr(file, text)
        archive.writestr(
            f"{information}/METADATA", f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n"
        )
        archive.writestr(
            f"{information}/WHEEL",
            "Wheel-Version: 1.0\nGenerator: tests\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        )
        archive.writestr(f"{information}/RECORD", "")
    return path


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of wheels with all packages but one of the optional ones."""
    folder = tmp_path_factory.mktemp("R\u00e4der & so")
    for name in NAMES:
        make_wheel(folder, name)
    return folder


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch) -> Machine:
    """The machine that runs the tests, on which pip finds nothing that a test has not named."""
    for name in ("PIP_FIND_LINKS", "PIP_INDEX_URL", "PIP_EXTRA_INDEX_URL", "HTTP_PROXY", "HTTPS_PROXY"):
        monkeypatch.delenv(name, raising=False)
        monkeypatch.delenv(name.lower(), raising=False)
    monkeypatch.setenv("PIP_CONFIG_FILE", os.devnull)
    # pip reports a missing network only when it retries.
    monkeypatch.setenv("PIP_RETRIES", "1")
    # The trial would fail with packages of one line; test_install.py and test_archive.py test it.
    monkeypatch.setattr(trial, "settle", lambda *_: None)
    return Machine()


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """The folder of an extension that has been unpacked and nothing more."""
    folder = tmp_path / "Gr\u00fcn & wei\u00df" / "alup-reshape"
    (folder / "alup").mkdir(parents=True)
    for name in ("__init__.py", "startup.py"):
        shutil.copy(harness.ROOT / "alup" / name, folder / "alup")
    return folder


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory, wheels: Path) -> Path:
    """An environment as pip makes it."""
    folder = tmp_path_factory.mktemp("made") / "venv"
    patch = pytest.MonkeyPatch()
    with patch.context() as changes:
        for name in ("PIP_FIND_LINKS", "PIP_INDEX_URL"):
            changes.delenv(name, raising=False)
        changes.setenv("PIP_CONFIG_FILE", os.devnull)
        python = pythons.look(Machine(), PYTHON)
        assert python is not None
        left_out = environment.make(Machine(), str(folder), python, packages.Source(str(wheels)), Progress())
    assert left_out == ["libigl"]
    return folder


@pytest.fixture
def quick(made: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Environments are copies of one that pip has made, for tests of what happens to them afterwards."""

    def make(_machine: Machine, venv: str, *_: Any) -> list[str]:
        shutil.copytree(made, venv, symlinks=True)
        return []

    monkeypatch.setattr(environment, "make", make)


def set_up(
    machine: Machine, root: Path, wheels: Path | str = "", progress: Progress | None = None
) -> list[str]:
    plan = environment_plan.plan(machine, str(root), PYTHON, str(wheels))
    return environment.set_up(machine, plan, "/inkex", PYTHON, progress or Progress())


def package_names(root: Path) -> list[str]:
    (site,) = packages.sites(str(root / "venv"))
    return sorted(
        name for name in os.listdir(site) if not name.endswith(".dist-info") and name != "__pycache__"
    )


def names(root: Path) -> list[str]:
    return sorted(os.listdir(root))


COMPLETE = ["alup", "environment.json", "venv"]


class Listening(Progress):
    def __init__(self) -> None:
        self.steps: list[tuple[str, float]] = []

    def step(self, text: str, done: float) -> None:
        self.steps.append((text, done))


def test_an_environment_is_made_from_a_folder_of_wheels(machine: Machine, root: Path, wheels: Path) -> None:
    heard = Listening()
    assert set_up(machine, root, wheels, heard) == ["libigl"]
    shares = [share for _, share in heard.steps]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert any("scipy" in text for text, _ in heard.steps)
    assert package_names(root) == sorted(NAMES)
    assert names(root) == COMPLETE
    record = startup.read_record(str(root))
    assert record is not None
    assert record["tag"] == startup.interpreter_tag()
    assert record["inkex"] == "/inkex"
    assert os.path.isdir(root / record["packages"])


def test_downloads_and_their_target_are_told_before(machine: Machine, root: Path, wheels: Path) -> None:
    text = environment_plan.plan(machine, str(root), PYTHON, str(wheels)).text()
    for part in ("numpy, scipy, lxml<6", str(wheels), str(root / "venv"), "Nothing is downloaded", PYTHON):
        assert part in text
    assert names(root) == ["alup"]


class CancelsAt(Progress):
    """A person who cancels when a step begins."""

    def __init__(self, word: str) -> None:
        self.word, self.reached = word, False

    def step(self, text: str, _done: float) -> None:
        self.reached = self.reached or self.word in text

    def cancelled(self) -> bool:
        return self.reached


@pytest.mark.parametrize("word", ["Making", "scipy"])
def test_cancelled_nothing_is_left(machine: Machine, root: Path, wheels: Path, word: str) -> None:
    with pytest.raises(Cancelled):
        set_up(machine, root, wheels, CancelsAt(word))
    assert names(root) == ["alup"]


def test_cancel_ends_running_processes(tmp_path: Path) -> None:
    """It also ends the processes that were started: a shell and its child, which would run for a minute."""
    left = tmp_path / "left"
    program = f"sh -c 'sleep 1.5; touch {left}' & echo Making; wait"

    class Cancels(Progress):
        said = False

        def detail(self, _line: str) -> None:
            self.said = True

        def cancelled(self) -> bool:
            return self.said

    with pytest.raises(Cancelled):
        run(["sh", "-c", program], os.environ, Cancels())
    assert subprocess.run(["sh", "-c", f"sleep 2; test -e {left}"]).returncode == 1


def damaged(root: Path, damage: str) -> None:
    place, record = root / "venv", root / "environment.json"
    if damage == "a package is gone":
        shutil.rmtree(Path(packages.sites(str(place))[0]) / "scipy")
    elif damage == "its Python is gone":
        (place / "bin" / "python3").unlink()
        (place / "bin" / "python3").symlink_to("/nowhere/python3")
    elif damage == "the record is not readable":
        record.write_text("{")
    elif damage == "the record is gone":
        record.unlink()
    elif damage == "cut off while it was made":
        shutil.rmtree(place)
        record.unlink()
        (root / ".venv-new" / "lib").mkdir(parents=True)
    elif damage == "cut off between two moves":
        place.rename(root / ".venv-old")
        (root / ".venv-new").mkdir()
    elif damage == "cut off before the old one went":
        shutil.copytree(place, root / ".venv-old", symlinks=True)


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(
    "damage",
    [
        "none",
        "a package is gone",
        "its Python is gone",
        "the record is not readable",
        "the record is gone",
        "cut off while it was made",
        "cut off between two moves",
        "cut off before the old one went",
    ],
)
def test_a_broken_or_half_made_environment_is_repaired(
    machine: Machine, root: Path, wheels: Path, damage: str
) -> None:
    set_up(machine, root, wheels)
    damaged(root, damage)
    set_up(machine, root, wheels)
    assert package_names(root) == sorted(NAMES)
    assert names(root) == COMPLETE
    assert startup.environment_python_runs(str(root), startup.read_record(str(root)) or {})


def test_an_environment_that_cannot_be_renewed_is_unchanged(
    machine: Machine, root: Path, made: Path, tmp_path: Path
) -> None:
    shutil.copytree(made, root / "venv", symlinks=True)
    environment.write_record(machine, str(root), "/inkex")
    record = (root / "environment.json").read_bytes()
    some = tmp_path / "some"
    make_wheel(some, "numpy")
    with pytest.raises(SetupError, match=r"There is no scipy for Python 3\.\d+\.\d+ in .*some\."):
        set_up(machine, root, some)
    assert package_names(root) == sorted(NAMES)
    assert (root / "environment.json").read_bytes() == record


@pytest.mark.usefixtures("quick")
def test_an_environment_that_does_not_run_is_rolled_back(
    machine: Machine, root: Path, wheels: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: Any) -> None:
        raise UnfitPythonError("different Team IDs")

    set_up(machine, root, wheels)
    record, node = (root / "environment.json").read_bytes(), (root / "venv").stat().st_ino
    monkeypatch.setattr(trial, "settle", fails)
    with pytest.raises(SetupError, match="different Team IDs"):
        set_up(machine, root, wheels)
    assert (root / "environment.json").read_bytes() == record
    assert (root / "venv").stat().st_ino == node
    assert names(root) == COMPLETE


def test_another_python_is_tried_where_one_will_not_do(
    machine: Machine, root: Path, wheels: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried = []

    def makes(_machine: Machine, venv: str, python: pythons.Python, *_: Any) -> list[str]:
        tried.append(python.path)
        if len(tried) == 1:
            raise UnfitPythonError("no wheel for it")
        os.mkdir(venv)
        return []

    monkeypatch.setattr(environment, "make", makes)
    monkeypatch.setattr(environment, "write_record", lambda *_: None)
    first = pythons.look(machine, PYTHON)
    assert first is not None
    plan = environment_plan.Plan(str(root), first, packages.Source())
    monkeypatch.setattr(
        pythons, "candidates", lambda *_: iter([first, replace(first, path="/other/python3")])
    )
    assert environment.set_up(machine, plan, "", PYTHON, Progress()) == []
    assert tried == [PYTHON, "/other/python3"]


# --- what can be wrong ----------------------------------------------------------------------------


@pytest.fixture
def index(wheels: Path) -> Iterator[str]:
    """A package index on this machine: its address."""

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            parts = self.path.strip("/").split("/")
            files = {path.name: path for path in wheels.glob("*.whl")}
            if parts[0] == "simple":
                links = [
                    f'<a href="/files/{name}">{name}</a>' for name in files if name.startswith(parts[1] + "-")
                ]
                body = ("<html>" + "".join(links) + "</html>").encode()
            elif parts[-1] in files:
                body = files[parts[-1]].read_bytes()
            else:
                self.send_error(404)
                return
            self.send_response(200)
            self.send_header("Content-Type", "text/html" if parts[0] == "simple" else "application/zip")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_: object) -> None:
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_address[1]}/simple"
    server.shutdown()
    server.server_close()


NOBODY = "http://127.0.0.1:9"


def test_without_a_network(machine: Machine, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PIP_INDEX_URL", NOBODY + "/simple")
    with pytest.raises(
        SetupError, match=f"{NOBODY}/simple can't be reached. Connect to the internet, or set up from a"
    ):
        set_up(machine, root)
    assert names(root) == ["alup"]


def test_a_flatpak_without_a_network_is_given_one() -> None:
    said = str(
        faults.of_words("[Errno -3] Temporary failure in name resolution", index="https://i", flatpak=True)
    )
    assert "flatpak override --user --share=network org.inkscape.Inkscape" in said


def test_with_a_proxy_that_lets_nothing_through(
    machine: Machine, root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PIP_INDEX_URL", "https://index.invalid/simple")
    monkeypatch.setenv("HTTPS_PROXY", NOBODY)
    with pytest.raises(SetupError, match=rf"The proxy {NOBODY} let nothing through .* Correct HTTPS_PROXY"):
        set_up(machine, root)
    with pytest.raises(SetupError, match=r"can't be reached|let nothing through"):
        download.newest("https://index.invalid/simple", "uv", (3, 12), lambda _: True)


def test_a_folder_that_nobody_may_write_to(root: Path, wheels: Path) -> None:
    """By the effect itself, which says it in one sentence."""
    copy = root.parent / "copy"
    shutil.copytree(harness.ROOT / "alup", copy / "alup", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(harness.ROOT / "alup_set_up.py", copy)
    copy.chmod(0o555)
    command = [
        PYTHON,
        "-B",
        str(copy / "alup_set_up.py"),
        "--agree=true",
        "--source=folder",
        f"--wheels={wheels}",
    ]
    environment = harness.clean_environment(DISPLAY="")
    done = subprocess.run(
        command,
        env=environment,
        preexec_fn=harness.under_permissions(),
        capture_output=True,
        text=True,
        timeout=60,
    )
    copy.chmod(0o755)
    if (copy / "venv").exists():
        pytest.skip("nothing keeps this system's administrator from writing")
    assert done.returncode == 1
    assert done.stderr == (
        f"{copy} can't be written to (Permission denied). Make it writable, or install into another folder.\n"
    )
    assert names(copy) == ["alup", "alup_set_up.py"]


@pytest.mark.usefixtures("quick")
def test_a_file_that_another_program_has_open(
    machine: Machine, root: Path, wheels: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On Windows: an effect that runs, or a virus scanner."""
    set_up(machine, root, wheels)
    rename = os.rename

    def refuses(source: str, target: str) -> None:
        if source.endswith("venv"):
            error = PermissionError(errno.EACCES, "The process cannot access the file")
            error.winerror = 32  # type: ignore[attr-defined]
            raise error
        rename(source, target)

    monkeypatch.setattr(os, "rename", refuses)
    with pytest.raises(SetupError, match=r"in use by another program .* Close other windows of Inkscape"):
        set_up(machine, root, wheels)
    assert package_names(root) == sorted(NAMES)
    assert names(root) == COMPLETE


def test_a_virus_scanner_is_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    refused, rename = [1, 2], os.rename

    def refuses(source: str, target: str) -> None:
        if refused:
            refused.pop()
            raise PermissionError
        rename(source, target)

    (tmp_path / "a").touch()
    monkeypatch.setattr(locked_files, "_PATIENCE", (0.0, 0.0))
    monkeypatch.setattr(os, "rename", refuses)
    with pytest.raises(PermissionError):
        locked_files.move(str(tmp_path / "a"), str(tmp_path / "b"))
    monkeypatch.setattr(os, "name", "nt")
    locked_files.move(str(tmp_path / "a"), str(tmp_path / "b"))
    assert names(tmp_path) == ["b"]


@pytest.mark.parametrize(
    ("number", "windows", "word"),
    [
        (errno.EROFS, None, "can't be written to"),
        (errno.ENOSPC, None, "no room left"),
        (errno.ENAMETOOLONG, None, "too long"),
        (errno.ENOENT, 206, "too long"),
        (errno.EACCES, 5, "in use by another program"),
        (errno.EACCES, None, "can't be written to"),
        (errno.EIO, None, "Input/output error"),
    ],
)
def test_errors_of_the_system_are_sentences(number: int, windows: int | None, word: str) -> None:
    error = OSError(number, os.strerror(number))
    if windows:
        error.winerror = windows  # type: ignore[attr-defined]
    said = str(faults.of_system(error, "/a folder"))
    assert word in said
    assert "\n" not in said


@pytest.mark.parametrize(
    ("words", "wanted"),
    [
        ("ERROR: Could not install packages: [Errno 28] No space left on device", "no room left"),
        ("ERROR: [WinError 32] The process cannot access the file because", "in use by another program"),
        ("HINT: This error might have occurred as there is no Windows Long Path support", "too long"),
        ("ssl.SSLCertVerificationError: [SSL: CERTIFICATE_VERIFY_FAILED] certificate", "is not trusted"),
        ("WARNING: Retrying [Errno -3] Temporary failure in name resolution\n"
         "ERROR: No matching distribution found for numpy", "can't be reached"),
        ("pip._vendor.urllib3.exceptions.ReadTimeoutError: Read timed out.", "can't be reached"),
        ("ERROR: No matching distribution found for lxml<6", "There is no lxml for Python 3.15 in"),
        ("Looking\nERROR: something new\nNotice", "could not be installed: something new"),
        ("", "could not be installed: ?"),
    ],
)  # fmt: skip
def test_pips_words_are_sentences(words: str, wanted: str) -> None:
    said = str(faults.of_words(words, folder="/f", index="https://i", python="Python 3.15"))
    assert wanted in said


def test_two_at_once(machine: Machine, root: Path, wheels: Path, tmp_path: Path) -> None:
    with lock.held(str(root)):
        program = "import sys; from alup.setup import lock\nwith lock.held(sys.argv[1]): pass"
        done = subprocess.run(
            [PYTHON, "-c", program, str(root)], cwd=harness.ROOT, capture_output=True, text=True, timeout=60
        )
        assert f"Another window or terminal is setting up {root.parent} just now" in done.stderr
    assert names(root.parent) == ["alup-reshape"]
    with lock.held(str(root)):
        pass


def test_a_killed_process_leaves_no_lock(root: Path) -> None:
    program = (
        "import os, sys; from alup.setup import lock\nwith lock.held(sys.argv[1]): os.kill(os.getpid(), 9)"
    )
    subprocess.run([PYTHON, "-c", program, str(root)], cwd=harness.ROOT, timeout=60)
    with lock.held(str(root)):
        pass
    assert names(root.parent) == ["alup-reshape"]


def test_a_folder_without_wheels(machine: Machine, root: Path) -> None:
    with pytest.raises(SetupError, match=r"no wheels \(\*\.whl\) in .*alup-reshape\. Choose another folder"):
        set_up(machine, root, root)


# --- a Python without pip, and none at all --------------------------------------------------------


def without_pip(machine: Machine) -> pythons.Python:
    python = pythons.look(machine, PYTHON)
    assert python is not None
    return replace(python, pip="")


def test_pip_comes_from_the_index_where_python_has_none(
    machine: Machine, tmp_path: Path, index: str, wheels: Path
) -> None:
    python = pythons.look(machine, PYTHON)
    assert python is not None
    assert python.pip
    given = wheels / "pip-23.1-py3-none-any.whl"
    shutil.copy(python.pip, given)
    try:
        source = packages.Source(index=index)
        program = packages.unpacked_pip(without_pip(machine), source, str(tmp_path), Progress())
    finally:
        given.unlink()
    done = subprocess.run([PYTHON, "-I", program, "--version"], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("pip 2")


def test_a_folder_of_wheels_has_to_have_pip_then(machine: Machine, tmp_path: Path, wheels: Path) -> None:
    with pytest.raises(SetupError, match="Put a wheel of pip"):
        packages.unpacked_pip(
            without_pip(machine), packages.Source(folder=str(wheels)), str(tmp_path), Progress()
        )


def page(tmp_path: Path, *links: str) -> str:
    """A package index of files: its address."""
    (tmp_path / "simple" / "pip").mkdir(parents=True)
    (tmp_path / "simple" / "pip" / "index.html").write_text("".join(links))
    return (tmp_path / "simple").as_uri()


def test_the_newest_release_that_suits_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    link = '<a href="../../f/{0}#sha256=ab" {1}>{0}</a>'
    names = [
        link.format("pip-9.0.3-py3-none-any.whl", ""),
        link.format("pip-24.3.1-py3-none-any.whl", 'data-requires-python="&gt;=3.8"'),
        link.format("pip-25.0-py3-none-any.whl", 'data-requires-python="&gt;=3.9"'),
        link.format("pip-26.0b1-py3-none-any.whl", ""),
        link.format("pip-24.9-py3-none-any.whl", "data-yanked"),
        link.format("pip-24.0.tar.gz", ""),
    ]
    monkeypatch.setattr(download, "_read", lambda *_: "".join(names).encode())
    found = download.newest("https://i/simple", "pip", (3, 8, 10), lambda _: True)
    assert (found.name, found.url, found.sha256) == (
        "pip-24.3.1-py3-none-any.whl",
        "https://i/f/pip-24.3.1-py3-none-any.whl",
        "ab",
    )
    assert download.newest("https://i/simple", "pip", (3, 9), lambda _: True).name.startswith("pip-25.0-")
    with pytest.raises(SetupError, match=r"There is no pip for Python 3\.12"):
        download.newest("https://i/simple", "pip", (3, 12), lambda _: False)


def test_a_damaged_download_is_not_used(tmp_path: Path, index: str) -> None:
    url = index.replace("/simple", "/files/numpy-5.0-py3-none-any.whl")
    wheel = download.Wheel("numpy-5.0-py3-none-any.whl", url, "0" * 64)
    with pytest.raises(SetupError, match="arrived damaged"):
        download.fetch(wheel, str(tmp_path), index, Progress())


def test_an_index_has_to_be_an_address() -> None:
    with pytest.raises(SetupError, match="is no address of a package index"):
        download.newest("ftp://nowhere", "pip", (3, 12), lambda _: True)


# Stands for uv: it makes a Python where it is told to, as uv does.
UV = """#!/bin/sh
[ "$1 $2 $3" = "python install 3.12" ] || exit 3
[ "$4 $5" = "--no-bin --install-dir" ] || exit 4
mkdir -p "$6/cpython-3.12.9-linux/bin"
ln -s cpython-3.12.9-linux "$6/cpython-3.12-linux"
printf '#!/bin/sh\\nexec {python} "$@"\\n' >"$6/cpython-3.12.9-linux/bin/python3"
chmod +x "$6/cpython-3.12.9-linux/bin/python3"
"""


@pytest.fixture
def uv(wheels: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(platform, "machine", lambda: "x86_64")
    name = "uv-0.9.1-py3-none-manylinux_2_17_x86_64.whl"
    made = make_wheel(wheels, "uv", "0.9.1", {"uv-0.9.1.data/scripts/uv": UV.format(python=PYTHON)})
    made.rename(wheels / name)
    yield
    (wheels / name).unlink()


@pytest.mark.usefixtures("uv")
def test_uv_brings_a_python_into_the_folder_of_the_extension(
    machine: Machine, root: Path, index: str
) -> None:
    plan = environment_plan.Plan(str(root), None, packages.Source(index=index))
    environment.set_up(machine, plan, "", "", Progress())
    assert names(root) == ["alup", "environment.json", "python", "venv"]
    assert package_names(root) == sorted(NAMES)
    # The second time it is there.
    assert managed.there(str(root)) == str(root / "python" / "cpython-3.12.9-linux" / "bin" / "python3")


@pytest.mark.usefixtures("uv")
def test_a_python_that_uv_has_begun_is_removed(
    machine: Machine, root: Path, index: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(managed, "VERSION", "3.99")  # the stand-in makes 3.12 only
    plan = environment_plan.Plan(str(root), None, packages.Source(index=index))
    with pytest.raises(SetupError):
        environment.set_up(machine, plan, "", "", Progress())
    assert names(root) == ["alup"]


def test_an_environment_finds_its_managed_python_after_a_move(tmp_path: Path) -> None:
    before, after = tmp_path / "new", tmp_path / "at its place"
    (before / "python" / "cpython-3.12.9" / "bin").mkdir(parents=True)
    (before / "venv" / "bin").mkdir(parents=True)
    (before / "python" / "cpython-3.12.9" / "bin" / "python3").touch()
    (before / "venv" / "bin" / "python3").symlink_to(before / "python" / "cpython-3.12.9" / "bin" / "python3")
    (before / "venv" / "pyvenv.cfg").write_text(f"home = {before}/python/cpython-3.12.9/bin\n")
    before.rename(after)
    managed.follow_move(str(before), str(after))
    assert (
        after / "venv" / "bin" / "python3"
    ).resolve() == after / "python" / "cpython-3.12.9" / "bin" / "python3"
    assert (after / "venv" / "pyvenv.cfg").read_text() == f"home = {after}/python/cpython-3.12.9/bin\n"


# --- macOS and Windows, imitated -------------------------------------------------------------------


def test_a_python_that_may_not_load_foreign_signatures_hands_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """macOS: the same version, but its Python fails; with the record changed it starts the environment's."""
    root = tmp_path
    (root / "environment.json").write_text(
        '{"tag": "cpython-312-darwin", "python": "a", "packages": "b", "inkex": "c"}'
    )
    monkeypatch.setattr(trial, "imports", lambda *_: "")
    monkeypatch.setattr(
        trial,
        "starts",
        lambda *_: "" if startup.read_record(str(root))["tag"].endswith("-apart") else "Team IDs",  # type: ignore[index]
    )
    trial.settle(Machine(), str(root), "/inkex", PYTHON, Progress())
    record = startup.read_record(str(root))
    assert record is not None
    assert record["tag"] == "cpython-312-darwin-apart"


def test_windows_hands_over_without_a_black_window(monkeypatch: pytest.MonkeyPatch) -> None:
    """The streams are passed on explicitly, because a hidden console has none."""
    called: dict[str, Any] = {}

    def call(command: list[str], **options: Any) -> int:
        called.update(options, command=command)
        return 7

    monkeypatch.setattr(subprocess, "call", call)
    monkeypatch.setattr(subprocess, "CREATE_NO_WINDOW", 0x08000000, raising=False)
    monkeypatch.setattr(os, "name", "nt")
    monkeypatch.setattr(sys, "argv", ["effect.py", "--id=a", "C:\\a b\\\u00fc&.svg"])
    with pytest.raises(SystemExit) as left:
        startup._start_again("C:\\p\\venv\\Scripts\\python.exe", "C:\\p\\effect.py", "C:\\ink")
    assert left.value.code == 7
    assert called["command"][-3:] == ["C:\\p\\effect.py", "--id=a", "C:\\a b\\\u00fc&.svg"]
    assert called["env"][startup.HANDED_OVER] == "C:\\ink"
    assert called["creationflags"] == 0x08000000
    assert (called["stdin"], called["stdout"], called["stderr"]) == (sys.stdin, sys.stdout, sys.stderr)


def test_an_environment_of_windows_is_laid_out_otherwise(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "name", "nt")
    assert startup.environment_python("root").replace("\\", "/") == "root/venv/Scripts/python.exe"


def test_windows_script_is_one_of_windows() -> None:
    """Lines end as cmd.exe wants them, and every path stands in quotes."""
    text = (harness.ROOT / "install.cmd").read_bytes()
    assert text.count(b"\n") == text.count(b"\r\n") > 10
    assert text.isascii()
    assert b'"%python%" -E -s -B "%setup%" %*' in text


def test_an_environment_that_was_made_apart_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The environment has another Python than Inkscape on purpose, so an update must not make it again."""
    (tmp_path / "venv").mkdir()
    (tmp_path / "environment.json").write_text(
        '{"tag": "x-apart", "python": "a", "packages": "b", "inkex": "c"}'
    )
    monkeypatch.setattr(startup, "environment_python_runs", lambda *_: True)
    assert install._fits(Machine(), str(tmp_path), PYTHON)
    (tmp_path / "environment.json").write_text('{"tag": "x", "python": "a", "packages": "b", "inkex": "c"}')
    assert not install._fits(Machine(), str(tmp_path), PYTHON)


@pytest.mark.skipif(
    sys.version_info < (3, 10), reason="older ones do not name the standard library's modules"
)
@pytest.mark.parametrize(
    "file", sorted((harness.ROOT / "alup" / "setup").glob("*.py")), ids=lambda file: file.name
)
def test_the_installer_needs_nothing_but_the_standard_library(file: Path) -> None:
    """Only the window, which is optional, imports GTK."""
    allowed = {*sys.stdlib_module_names, "alup", *(["gi"] if file.name == "setup_window.py" else [])}
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            assert {alias.name.split(".")[0] for alias in node.names} <= allowed
        elif isinstance(node, ast.ImportFrom) and not node.level:
            assert str(node.module).split(".")[0] in allowed


# --- the effect without GTK -----------------------------------------------------------------------


def effect(
    *options: str, prepare: Callable[[], None] | None = None, **streams: Any
) -> subprocess.CompletedProcess[str]:
    """Set up as Inkscape starts it, where no window can open."""
    command = [PYTHON, "-B", "-S", str(harness.ROOT / "alup_set_up.py"), *options, "--id=a", "drawing.svg"]
    environment = harness.clean_environment(DISPLAY="", INKSCAPE_COMMAND="/nowhere/inkscape")
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60)


def test_without_a_window_the_first_run_only_tells(wheels: Path) -> None:
    done = effect("--source=folder", f"--wheels={wheels}")
    assert (done.returncode, done.stdout) == (1, "")
    for part in (str(wheels), str(harness.ROOT / "venv"), "with a tick at Begin at once"):
        assert part in done.stderr
    assert not (harness.ROOT / "venv").exists()


def test_a_folder_that_was_not_chosen_is_named() -> None:
    done = effect("--source=folder")
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == "Choose a folder of wheels first; \u2026 is none.\n"


def test_inkscapes_own_cancel_is_heard(tmp_path: Path) -> None:
    """It closes the pipe that the effect's drawing would come through."""
    program = (
        "from alup.setup.desk import StandardOutput as S; import sys; s = S(); a = s.cancelled();"
        "sys.stdin.read(); sys.stderr.write(f'{a} {s.cancelled()}')"
    )
    with subprocess.Popen(
        [PYTHON, "-c", program],
        cwd=harness.ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        assert process.stdin and process.stdout and process.stderr
        # Long enough for the first answer.
        for stream in (process.stdout, process.stdin):
            threading.Timer(1.0, stream.close).start()
        assert process.stderr.read() == b"False True"
