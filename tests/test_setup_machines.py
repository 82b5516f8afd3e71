# SPDX-License-Identifier: GPL-2.0-or-later
"""Inkscape, its folders and a Python for the packages are found on imitated machines of three systems."""

from __future__ import annotations

import platform

import pytest
from machines import HOMES, Pretended

from alup.setup import environment_plan, inkscapes, managed, pythons
from alup.setup.machine import LINUX, MACOS, WINDOWS
from alup.setup.setup_errors import SetupError

WINDOWS_HOME = HOMES[WINDOWS]
PROFILE = WINDOWS_HOME + r"\AppData\Roaming\inkscape"
APP_PATHS = r"Software\Microsoft\Windows\CurrentVersion\App Paths\inkscape.exe"
MSYS = {"version": [3, 12, 7], "platform": "mingw_x86_64_ucrt", "pip": ""}


def windows(folder: str = r"D:\Programme & mehr\Inkscape", known: str = "") -> Pretended:
    """Windows with an Inkscape whose Python is MSYS2's.  known : value of the registry that tells of it."""
    machine = Pretended(WINDOWS)
    machine.add_inkscape(
        rf"{folder}\bin\inkscape.exe", PROFILE, rf"{folder}\share\inkscape", rf"{folder}\bin\inkscape.com"
    )
    machine.add_python(rf"{folder}\bin\python.exe", **MSYS)
    if known:
        machine.keys[APP_PATHS, ""] = known
    return machine


# --- Windows --------------------------------------------------------------------------------------


def test_windows_inkscape_is_found_by_the_registry() -> None:
    machine = windows(known=r"D:\Programme & mehr\Inkscape\bin\inkscape.exe")
    found = inkscapes.find(machine)
    assert found.program == r"D:\Programme & mehr\Inkscape\bin\inkscape.exe"
    assert found.profile == PROFILE
    assert found.inkex == r"D:\Programme & mehr\Inkscape\share\inkscape\extensions"
    assert found.python == r"D:\Programme & mehr\Inkscape\bin\python.exe"
    # The .exe is a program of windows, which writes to no console.
    assert machine.asked[0][0].endswith("inkscape.com")


@pytest.mark.parametrize(
    ("variable", "root", "below"),
    [
        ("ProgramW6432", r"C:\Program Files", "Inkscape"),
        ("ProgramFiles(x86)", r"C:\Program Files (x86)", "Inkscape"),
        ("LOCALAPPDATA", r"C:\Users\a b\AppData\Local", r"Programs\Inkscape"),
    ],
)
def test_windows_inkscape_is_found_in_the_usual_folders(variable: str, root: str, below: str) -> None:
    machine = windows(rf"{root}\{below}")
    machine.variables[variable] = root
    assert inkscapes.find(machine).python == rf"{root}\{below}\bin\python.exe"


def test_an_uninstall_key_tells_the_folder_too() -> None:
    machine = windows()
    key = r"Software\Microsoft\Windows\CurrentVersion\Uninstall\Inkscape"
    machine.keys[key, "InstallLocation"] = r"D:\Programme & mehr\Inkscape"
    assert inkscapes.find(machine).profile == PROFILE


def test_an_app_of_the_microsoft_store_is_known() -> None:
    machine = Pretended(WINDOWS, {"LOCALAPPDATA": r"C:\Users\jo\AppData\Local"})
    machine.add_inkscape(r"C:\Users\jo\AppData\Local\Microsoft\WindowsApps\inkscape.exe", PROFILE)
    assert inkscapes.find(machine).kind == inkscapes.STORE


def test_without_inkscape_the_remedy_is_told() -> None:
    for system, word in (
        (WINDOWS, "inkscape.org"),
        (MACOS, "inkscape.org"),
        (LINUX, "apt-get install inkscape"),
    ):
        with pytest.raises(SetupError, match=word):
            inkscapes.find(Pretended(system))


def test_msys2s_python_is_not_taken_but_python_orgs() -> None:
    machine = windows()
    own = r"D:\Programme & mehr\Inkscape\bin\python.exe"
    core = r"Software\Python\PythonCore"
    for name, path, told in (
        ("3.7", r"C:\Python37\python.exe", {"version": [3, 7, 9]}),
        ("3.12-32", r"C:\Python312-32\python.exe", {"bits": 32}),
        ("3.13", r"C:\Program Files\Python313\python.exe", {"version": [3, 13, 1]}),
        ("3.11", r"C:\Python311\python.exe", {"version": [3, 11, 9]}),
    ):
        machine.add_python(path, platform="win-amd64", **told)
        machine.keys[rf"{core}\{name}\InstallPath", "ExecutablePath"] = path
    found = list(pythons.candidates(machine, own))
    assert [python.version[:2] for python in found] == [(3, 13), (3, 11)]


def test_the_launcher_and_the_path_are_asked_but_not_the_store() -> None:
    machine = windows()
    store = r"C:\Users\jo\AppData\Local\Microsoft\WindowsApps\python.exe"
    listed = r"C:\Users\a b\Python310\python.exe"
    machine.on_path["python"] = store
    machine.add_python(store, platform="win-amd64")
    machine.add_python(listed, platform="win-amd64", version=[3, 10, 2])
    machine.files[r"C:\Windows\py.exe"] = ""
    machine.answers[r"C:\Windows\py.exe"] = lambda _: (
        f" -V:3.12 *        {store}\r\n -V:3.10          {listed}\r\n"
    )
    assert [python.path for python in pythons.candidates(machine, "")] == [listed]


def test_without_a_python_uv_brings_one_into_the_folder_of_the_extension() -> None:
    machine = windows()
    root = PROFILE + r"\extensions\alup-reshape"
    plan = environment_plan.plan(machine, root, r"D:\Programme & mehr\Inkscape\bin\python.exe")
    assert plan.python is None
    text = plan.text()
    assert "python-build-standalone (by uv)" in text
    assert "https://pypi.org/simple" in text
    assert root in text


def test_a_folder_of_wheels_brings_no_python(tmp_path: pytest.TempPathFactory) -> None:
    (tmp_path / "numpy-2.0-cp312-cp312-win_amd64.whl").touch()  # type: ignore[operator]
    with pytest.raises(SetupError, match=r"Install Python 3\.12 for 64 bit from python\.org"):
        environment_plan.plan(windows(), r"C:\a", "", str(tmp_path))


def test_a_path_that_is_too_long_for_windows_is_refused_at_once() -> None:
    machine = windows()
    machine.add_python(r"C:\Python312\python.exe", platform="win-amd64")
    machine.on_path["python"] = r"C:\Python312\python.exe"
    root = "C:\\" + "a" * 120
    with pytest.raises(SetupError, match="too long for this system"):
        environment_plan.plan(machine, root, "")
    machine.keys[r"SYSTEM\CurrentControlSet\Control\FileSystem", "LongPathsEnabled"] = "1"
    assert environment_plan.plan(machine, root, "").python is not None


@pytest.mark.parametrize(
    ("system", "processor", "fits"),
    [
        (WINDOWS, "AMD64", "uv-0.9.1-py3-none-win_amd64.whl"),
        (WINDOWS, "ARM64", "uv-0.9.1-py3-none-win_arm64.whl"),
        (MACOS, "arm64", "uv-0.9.1-py3-none-macosx_11_0_arm64.whl"),
        (MACOS, "x86_64", "uv-0.9.1-py3-none-macosx_10_12_x86_64.whl"),
        (LINUX, "x86_64", "uv-0.9.1-py3-none-manylinux_2_17_x86_64.manylinux2014_x86_64.whl"),
        (LINUX, "aarch64", "uv-0.9.1-py3-none-manylinux_2_28_aarch64.whl"),
    ],
)
def test_uv_is_that_of_the_machine(
    monkeypatch: pytest.MonkeyPatch, system: str, processor: str, fits: str
) -> None:
    every = [
        "uv-0.9.1-py3-none-win32.whl",
        "uv-0.9.1-py3-none-win_amd64.whl",
        "uv-0.9.1-py3-none-win_arm64.whl",
        "uv-0.9.1-py3-none-macosx_11_0_arm64.whl",
        "uv-0.9.1-py3-none-macosx_10_12_x86_64.whl",
        "uv-0.9.1-py3-none-manylinux_2_17_x86_64.manylinux2014_x86_64.whl",
        "uv-0.9.1-py3-none-manylinux_2_28_aarch64.whl",
        "uv-0.9.1-py3-none-musllinux_1_1_x86_64.whl",
    ]
    monkeypatch.setattr(platform, "machine", lambda: processor)
    assert [name for name in every if managed._suits(Pretended(system), name)] == [fits]


# --- macOS ----------------------------------------------------------------------------------------

BUNDLE = "/Applications/Inkscape.app/Contents"


def macos() -> Pretended:
    machine = Pretended(MACOS)
    profile = "/Users/jo/Library/Application Support/org.inkscape.Inkscape/config/inkscape"
    machine.add_inkscape(f"{BUNDLE}/MacOS/inkscape", profile, f"{BUNDLE}/Resources/share/inkscape")
    machine.add_python(f"{BUNDLE}/Resources/bin/python3", platform="macosx-11.0-arm64")
    return machine


def test_macos_application_is_found_with_its_python() -> None:
    found = inkscapes.find(macos())
    assert found.kind == inkscapes.BUNDLE
    assert found.python == f"{BUNDLE}/Resources/bin/python3"
    assert found.inkex == f"{BUNDLE}/Resources/share/inkscape/extensions"
    assert found.target.endswith("/config/inkscape/extensions/alup-reshape")


def test_macos_own_python_comes_first_then_others_of_other_versions() -> None:
    machine = macos()
    machine.add_python("/opt/homebrew/bin/python3", version=[3, 13, 0], platform="macosx-14.0-arm64")
    machine.add_python(
        "/Library/Frameworks/Python.framework/Versions/3.11/bin/python3",
        version=[3, 11, 9],
        platform="macosx-10.9",
    )
    found = [python.version[:2] for python in pythons.candidates(machine, f"{BUNDLE}/Resources/bin/python3")]
    assert found == [(3, 12), (3, 11), (3, 13)]


def test_apples_stub_is_not_started_unless_it_is_a_python() -> None:
    machine = macos()
    machine.add_python("/usr/bin/python3", version=[3, 9, 6], platform="macosx-10.9")
    machine.on_path["python3"] = "/usr/bin/python3"
    assert list(pythons.candidates(machine, "")) == []
    assert ["/usr/bin/python3"] not in [command[:1] for command in machine.asked]
    machine.answers["/usr/bin/xcode-select"] = lambda _: "/Library/Developer/CommandLineTools\n"
    assert [python.version for python in pythons.candidates(machine, "")] == [(3, 9, 6)]


# --- Linux ----------------------------------------------------------------------------------------


def test_linux_inkscape_has_the_python_beside_it() -> None:
    machine = Pretended(LINUX)
    machine.add_inkscape(
        "/opt/ink scape/bin/inkscape", "/home/jo/.config/inkscape", "/opt/ink scape/share/inkscape"
    )
    machine.on_path["inkscape"] = "/opt/ink scape/bin/inkscape"
    machine.add_python("/opt/ink scape/bin/python3")
    machine.on_path["python3"] = "/usr/bin/python3"
    assert inkscapes.find(machine).python == "/opt/ink scape/bin/python3"


def test_inkscapes_python_may_be_old_others_not() -> None:
    machine = Pretended(LINUX)
    machine.add_python("/ink/python3", version=[3, 8, 10])
    machine.add_python("/usr/bin/python3", version=[3, 8, 10])
    machine.on_path["python3"] = "/usr/bin/python3"
    assert [python.path for python in pythons.candidates(machine, "/ink/python3")] == ["/ink/python3"]
    assert list(pythons.candidates(machine, "")) == []


@pytest.mark.parametrize(
    ("minor", "lxml", "told"), [(8, "lxml<6", {}), (13, "lxml<6", {}), (14, "lxml<7", {})]
)
def test_python_gets_the_lxml_that_exists_for_it(minor: int, lxml: str, told: dict[str, str]) -> None:
    machine = Pretended(LINUX)
    machine.add_python("/ink/python3", version=[3, minor, 0], **told)
    plan = environment_plan.plan(machine, "/home/jo/x", "/ink/python3")
    assert f" {lxml}, " in plan.text()


def test_pips_own_index_is_named() -> None:
    machine = Pretended(LINUX)
    machine.add_python("/ink/python3")
    probe = machine.answers["/ink/python3"]
    machine.answers["/ink/python3"] = lambda options: (
        "https://mirror/simple\n" if "config" in options else probe(options)
    )
    assert "from: https://mirror/simple\n" in environment_plan.plan(machine, "/x", "/ink/python3").text()
    machine.variables["PIP_INDEX_URL"] = "https://other/simple"
    assert "from: https://other/simple\n" in environment_plan.plan(machine, "/x", "/ink/python3").text()
