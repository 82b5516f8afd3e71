# SPDX-License-Identifier: GPL-2.0-or-later
"""install.sh in a home folder of its own, and the installed copy in a real Inkscape."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import inkscape as harness
import pytest

from alup.setup import files

DRAWING = """<svg xmlns="http://www.w3.org/2000/svg" width="100" height="100" viewBox="0 0 100 100"
  xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape">
  <path id="curve" style="fill:#c80" d="M 10,10 H 60 V 60 H 10 Z"/>
  <circle id="h1" inkscape:label="alup:pin" cx="10" cy="10" r="3"/>
  <circle id="h2" inkscape:label="alup:from corner" cx="60" cy="60" r="3"/>
  <circle id="h3" inkscape:label="alup:to corner" cx="80" cy="75" r="3"/>
</svg>
"""

# pip finds nothing to install, wherever this machine has its packages.
NO_PACKAGES: dict[str, Any] = {
    "PIP_NO_INDEX": 1,
    "PIP_FIND_LINKS": "/nowhere",
    "PIP_CONFIG_FILE": "/dev/null",
}


def listing(folder: Path) -> dict[str, tuple[int, int] | str]:
    """Every file below a folder with its inode and time, every link with its target."""
    found: dict[str, tuple[int, int] | str] = {}
    for path in sorted(folder.rglob("*")):
        state = path.lstat()
        name = str(path.relative_to(folder))
        found[name] = os.readlink(path) if path.is_symlink() else (state.st_ino, state.st_mtime_ns)
        if path.is_dir() and not path.is_symlink():
            found[name] = "folder"
    return found


@pytest.fixture
def home(installed: Path, tmp_path: Path) -> Path:
    """A home folder with an installed copy to be damaged."""
    return harness.clone(installed, tmp_path)


def extension(home: Path) -> Path:
    return harness.extensions_of(home) / harness.NAME


def change_record(home: Path, **changes: str) -> None:
    """Replace the record; it is a hard link to that of the other tests."""
    file = extension(home) / "environment.json"
    record = {**json.loads(file.read_text()), **changes}
    file.unlink()
    file.write_text(json.dumps(record))


def checkout(folder: Path) -> Path:
    """A copy of what install.sh installs, to be changed."""
    copy = folder / "checkout"
    copy.mkdir()
    files.copy(str(harness.ROOT), str(copy))
    return copy


def assert_refused(done: subprocess.CompletedProcess[str], *words: str) -> None:
    assert done.returncode == 1, done.stdout + done.stderr
    for word in words:
        assert word in done.stderr
    assert "Traceback" not in done.stderr


# --- without an installation --------------------------------------------------------------------


@pytest.mark.parametrize(
    "options", [["--dry-run"], ["--dry-run", "--demo"], ["--dry-run", "--uninstall"], ["--help"]]
)
def test_a_dry_run_writes_nothing(tmp_path: Path, options: list[str]) -> None:
    done = harness.install(tmp_path / "home", *options)
    assert (done.returncode, done.stderr) == (0, "")
    assert sorted(listing(tmp_path)) == ["home", "tmp"]
    if "--help" not in options:
        assert str(extension(tmp_path / "home")) in done.stdout


def test_the_profile_folder_and_python_of_inkscape_are_respected(tmp_path: Path) -> None:
    python = tmp_path / "my python"
    python.write_text('#!/bin/sh\nexec python3 "$@"\n')
    python.chmod(0o755)
    profile = tmp_path / "my profile"
    profile.mkdir()
    (profile / "preferences.xml").write_text(
        f'<inkscape><group\n id="extensions"\n python-interpreter="{python}"\n x="1"/></inkscape>'
    )
    done = harness.install(tmp_path / "home", "--dry-run", INKSCAPE_PROFILE_DIR=profile)
    assert f"into {profile}/extensions/alup-reshape\n" in done.stdout
    assert f", {python}.\n" in done.stdout


def test_wrong_use_is_told(tmp_path: Path) -> None:
    home = tmp_path / "home"
    assert_refused(harness.install(home, "--wrong"), "unknown option --wrong", "usage:")
    assert_refused(harness.install(home, "--check"), "not installed")
    assert_refused(harness.install(home, INKSCAPE_COMMAND="/nowhere"), "Inkscape was not found")
    assert sorted(listing(tmp_path)) == ["home", "tmp"]


def test_without_packages_nothing_is_left(tmp_path: Path) -> None:
    home = tmp_path / "home"
    done = harness.install(home, **NO_PACKAGES)
    assert_refused(done, "install.sh: There is no numpy for Python 3.")
    assert list(harness.extensions_of(home).iterdir()) == []
    assert list((tmp_path / "tmp").iterdir()) == []


def test_a_link_to_a_checkout_is_not_replaced(tmp_path: Path) -> None:
    target = extension(tmp_path / "home")
    target.parent.mkdir(parents=True)
    target.symlink_to(harness.ROOT)
    assert_refused(harness.install(tmp_path / "home"), "is a link")
    assert target.readlink() == harness.ROOT


# --- where Inkscape is not the system's -----------------------------------------------------------

# Only the layouts are imitated.  The tests show that install.sh recognises them; no such Inkscape was run.

# Answers like Inkscape; its profile is in the home folder that it is given.
FAKE_INKSCAPE = """#!/bin/sh
case $1 in
--user-data-directory) echo "$HOME/{profile}" ;;
--system-data-directory) echo /nowhere/share/inkscape ;;
--version) echo "Inkscape 1.4 (fake)" ;;
*) exit 1 ;;
esac
"""


NEEDED = ("dirname", "python3", "sh", "uname")


def program(file: Path, text: str) -> Path:
    """An executable script, with its folder."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    file.chmod(0o755)
    return file


def fake_inkscape(file: Path, profile: str = ".config/inkscape") -> Path:
    return program(file, FAKE_INKSCAPE.format(profile=profile))


def system_without_inkscape(folder: Path) -> Path:
    """A folder for the PATH that has what install.sh needs for a dry run, and no Inkscape."""
    tools = folder / "tools"
    tools.mkdir()
    for name in NEEDED:
        found = shutil.which(name, path="/usr/local/bin:/usr/bin:/bin")
        assert found is not None
        (tools / name).symlink_to(found)
    return tools


def flatpak_of(home: Path, tools: Path) -> Path:
    """A Flatpak as a person installs it for herself; the command flatpak writes down what it is told."""
    exported = home / ".local/share/flatpak/exports/bin/org.inkscape.Inkscape"
    program(exported, "#!/bin/sh\nexit 1\n")
    program(tools / "flatpak", '#!/bin/sh\nfor word in "$@"; do echo "told: $word"; done\n')
    return exported


def told(done: subprocess.CompletedProcess[str]) -> list[str]:
    return re.findall("(?m)^told: (.*)$", done.stdout)


@pytest.mark.parametrize("options", [[], ["--check"], ["--uninstall"], ["--dry-run"]])
def test_in_a_flatpak_the_installer_goes_on_in_its_sandbox(tmp_path: Path, options: list[str]) -> None:
    home, tools = tmp_path / "home", system_without_inkscape(tmp_path)
    exported = flatpak_of(home, tools)
    done = harness.install(home, *options, PATH=tools)
    assert (done.returncode, done.stderr) == (0, "")
    assert f"Inkscape is a Flatpak ({exported})" in done.stdout
    assert f"{home}/.var/app/org.inkscape.Inkscape/config/inkscape/extensions/alup-reshape" in done.stdout
    run, network, folder, shell, name, *flags, program = told(done)[:9]
    assert (run, network, shell, name) == (
        "run",
        "--share=network",
        "--command=python3",
        "org.inkscape.Inkscape",
    )
    assert (folder, program) == (f"--filesystem={harness.ROOT}:ro", f"{harness.ROOT}/alup/setup")
    assert flags == ["-E", "-s", "-B"]
    assert told(done)[9:] == options
    assert list((tmp_path / "tmp").iterdir()) == []


def test_a_failure_in_the_sandbox_of_a_flatpak_is_passed_on(tmp_path: Path) -> None:
    home, tools = tmp_path / "home", system_without_inkscape(tmp_path)
    flatpak_of(home, tools)
    program(tools / "flatpak", "#!/bin/sh\nexit 7\n")
    assert harness.install(home, PATH=tools).returncode == 7


def test_within_the_sandbox_of_a_flatpak_all_is_as_usual(tmp_path: Path) -> None:
    home, app = tmp_path / "home", ".var/app/org.inkscape.Inkscape/config"
    inkscape = fake_inkscape(tmp_path / "app" / "bin" / "inkscape", f"{app}/inkscape")
    sandbox: dict[str, Any] = {"FLATPAK_ID": "org.inkscape.Inkscape", "XDG_CONFIG_HOME": home / app}
    done = harness.install(home, "--dry-run", INKSCAPE_COMMAND=inkscape, **sandbox)
    assert (done.returncode, done.stderr) == (0, "")
    assert f"Would install into {home}/{app}/inkscape/extensions/alup-reshape\n" in done.stdout
    assert "Flatpak" not in done.stdout


def test_from_outside_into_the_sandbox_of_a_flatpak(tmp_path: Path) -> None:
    """A full installation; the stand-in for flatpak changes the same variables as a sandbox."""
    home, tools, app = tmp_path / "home", system_without_inkscape(tmp_path), ".var/app/org.inkscape.Inkscape"
    flatpak_of(home, tools)
    fake_inkscape(tmp_path / "app" / "inkscape", f"{app}/config/inkscape")
    program(
        tools / "flatpak",
        f"""#!/bin/sh
while [ "$1" != org.inkscape.Inkscape ]; do shift; done
shift
export FLATPAK_ID=org.inkscape.Inkscape XDG_CONFIG_HOME='{home}/{app}/config' PATH='{tmp_path}/app:{tools}'
exec python3 "$@"
""",
    )
    done = harness.install(home, "--dry-run", PATH=tools)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.count("Inkscape is a Flatpak") == 1
    assert f"Would install into {home}/{app}/config/inkscape/extensions/alup-reshape\n" in done.stdout


def test_a_script_that_starts_a_flatpak_is_recognised_by_its_profile(tmp_path: Path) -> None:
    home, tools = tmp_path / "home", system_without_inkscape(tmp_path)
    flatpak_of(home, tools)
    script = fake_inkscape(tools / "inkscape", ".var/app/org.inkscape.Inkscape/config/inkscape")
    done = harness.install(home, "--dry-run", PATH=tools)
    assert f"Inkscape is a Flatpak ({script})" in done.stdout
    assert told(done)[-1] == "--dry-run"


def test_the_demonstration_is_not_begun_in_a_flatpak(tmp_path: Path) -> None:
    home, tools = tmp_path / "home", system_without_inkscape(tmp_path)
    flatpak_of(home, tools)
    done = harness.install(home, "--demo", PATH=tools)
    assert_refused(done, "needs a display of its own", "examples/truck.svg")
    assert told(done) == []


@pytest.mark.parametrize("options", [[], ["--dry-run"], ["--demo"]])
def test_a_snap_is_named_and_its_shell_is_the_remedy(tmp_path: Path, options: list[str]) -> None:
    home = tmp_path / "home"
    inkscape = fake_inkscape(tmp_path / "snap" / "bin" / "inkscape")
    done = harness.install(home, *options, INKSCAPE_COMMAND=inkscape)
    assert_refused(done, "snap run --shell inkscape", str(harness.INSTALLER), "Set up...")
    assert f"Inkscape is a Snap ({inkscape})" in done.stdout
    assert f"{home}/snap/inkscape/current/.config/inkscape" in done.stdout
    assert sorted(listing(tmp_path)) == ["home", "snap", "snap/bin", "snap/bin/inkscape", "tmp"]


def test_a_script_that_starts_a_snap_is_recognised_by_its_profile(tmp_path: Path) -> None:
    inkscape = fake_inkscape(tmp_path / "bin" / "inkscape", "snap/inkscape/current/.config/inkscape")
    done = harness.install(tmp_path / "home", INKSCAPE_COMMAND=inkscape)
    assert_refused(done, "snap run --shell inkscape")


def test_within_the_shell_of_a_snap_all_is_as_usual(tmp_path: Path) -> None:
    home, profile = tmp_path / "home", "snap/inkscape/current/.config/inkscape"
    inkscape = fake_inkscape(tmp_path / "prime" / "bin" / "inkscape", profile)
    done = harness.install(home, "--dry-run", INKSCAPE_COMMAND=inkscape, SNAP_NAME="inkscape")
    assert (done.returncode, done.stderr) == (0, "")
    assert f"Would install into {home}/{profile}/extensions/alup-reshape\n" in done.stdout


@pytest.mark.parametrize("name", ["Inkscape-1.4-x86_64.AppImage", "inkscape.appimage"])
def test_an_appimage_is_named_with_the_python_that_runs_the_extension(tmp_path: Path, name: str) -> None:
    home = tmp_path / "home"
    inkscape = fake_inkscape(tmp_path / "my programs" / name)
    done = harness.install(home, "--dry-run", INKSCAPE_COMMAND=inkscape)
    assert (done.returncode, done.stderr) == (0, "")
    assert f"Inkscape is an AppImage ({inkscape})" in done.stdout
    assert "the one below, for which the environment is made, will run the extension" in done.stdout
    assert re.search(r"For Python 3\.\d+\.\d+, /.*python3\.", done.stdout)
    assert f"Would install into {extension(home)}\n" in done.stdout


def test_an_appimage_is_pointed_out_when_there_is_no_other_inkscape(tmp_path: Path) -> None:
    home, tools = tmp_path / "home", system_without_inkscape(tmp_path)
    inkscape = fake_inkscape(home / "Downloads" / "Inkscape-1.4.AppImage")
    done = harness.install(home, PATH=tools)
    assert_refused(done, "Inkscape was not found", f"INKSCAPE_COMMAND='{inkscape}' sh install.sh")


def test_without_apt_get_the_missing_programs_are_named(tmp_path: Path) -> None:
    tools = system_without_inkscape(tmp_path)
    inkscape = fake_inkscape(tmp_path / "inkscape")
    done = harness.install(tmp_path / "home", "--demo", PATH=tools, INKSCAPE_COMMAND=inkscape)
    assert_refused(done, "this system has no apt-get: xvfb xauth")


# --- with one -----------------------------------------------------------------------------------


@pytest.mark.xdist_group("installed")
def test_the_extension_is_installed_and_nothing_else(installed: Path) -> None:
    root = extension(installed)
    files = {str(path.relative_to(root)) for path in root.rglob("*") if path.is_file()}
    ours = {name for name in files if not name.startswith("venv/") and "__pycache__" not in name}
    sources = {
        str(path.relative_to(harness.ROOT))
        for path in (harness.ROOT / "alup").rglob("*.*")
        if path.suffix != ".pyc"
    }
    sources |= {path.name for path in harness.ROOT.glob("alup_*.*") if path.suffix in (".inx", ".py")}
    sources |= {str(path.relative_to(harness.ROOT)) for path in (harness.ROOT / "locale").rglob("*.mo")}
    assert ours == sources | {"install.sh", "install.cmd", "LICENSE", "environment.json"}
    outside = [
        name
        for name in listing(installed)
        if not name.startswith(".config/inkscape/extensions/alup-reshape/")
    ]
    parents = (".config", ".config/inkscape", ".config/inkscape/extensions")
    assert outside == [*parents, ".config/inkscape/extensions/alup-reshape"]
    assert list((installed.parent / "tmp").iterdir()) == []


@pytest.mark.xdist_group("installed")  # its temporary files must not be seen by the test above
def test_check_says_that_it_can_run(installed: Path) -> None:
    done = harness.install(installed, "--check")
    assert (done.returncode, done.stderr) == (0, "")
    assert "The extension can run." in done.stdout
    assert re.search(r"numpy \d.*scipy \d.*lxml \d", done.stdout)


def test_installing_twice_replaces_the_files_and_keeps_the_environment(home: Path) -> None:
    root = extension(home)
    (root / "alup_old_effect.py").touch()
    environment = listing(root / "venv")
    done = harness.install(home, **NO_PACKAGES)
    assert (done.returncode, done.stderr) == (0, "")
    assert listing(root / "venv") == environment
    assert not (root / "alup_old_effect.py").exists()
    assert os.listdir(root.parent) == [harness.NAME]
    assert harness.install(home, "--check").returncode == 0


def test_the_installed_copy_can_install_itself(home: Path) -> None:
    done = harness.install(home, installer=extension(home) / "install.sh", **NO_PACKAGES)
    assert (done.returncode, done.stderr) == (0, "")
    assert harness.install(home, "--check").returncode == 0


def test_bytecode_of_the_checkout_is_not_taken_along(home: Path, tmp_path: Path) -> None:
    source = checkout(tmp_path)
    (source / "alup" / "__pycache__").mkdir()
    (source / "alup" / "__pycache__" / "network.cpython-37.pyc").touch()
    assert harness.install(home, installer=source / "install.sh", **NO_PACKAGES).returncode == 0
    assert list((extension(home) / "alup").rglob("*-37.pyc")) == []


def test_an_interrupted_install_leaves_the_working_one(home: Path, tmp_path: Path) -> None:
    source = checkout(tmp_path)
    # The last check imports all modules, when the environment is in the new folder already.
    (source / "alup" / "slow.py").write_text(
        f"open({str(tmp_path / 'reached')!r}, 'w'); import time; time.sleep(60)"
    )
    before = listing(home)
    with subprocess.Popen(
        ["sh", str(source / "install.sh")],
        env=harness.clean_environment(HOME=home, **NO_PACKAGES),
        stdout=subprocess.DEVNULL,
        start_new_session=True,
    ) as process:
        give_up = time.monotonic() + 60
        while not (tmp_path / "reached").exists() and time.monotonic() < give_up:
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGTERM)
    assert process.returncode == 128 + signal.SIGTERM
    assert (tmp_path / "reached").exists()
    assert listing(home) == before


def test_a_failed_install_leaves_the_working_one(home: Path) -> None:
    # As after a change of Inkscape's Python: a new environment is needed but cannot be made.
    change_record(home, tag="cpython-37-linux")
    before = listing(home)
    assert_refused(harness.install(home, **NO_PACKAGES), "There is no numpy")
    assert listing(home) == before


def test_a_damaged_environment_is_not_kept(home: Path) -> None:
    shutil.rmtree(extension(home) / "venv" / "lib" / environment_python(home) / "site-packages" / "scipy")
    before = listing(home)
    done = harness.install(home, **NO_PACKAGES)
    assert_refused(done, "There is no numpy")
    assert "Making an environment" in done.stdout
    assert listing(home) == before


def test_an_interrupted_install_is_repaired(home: Path) -> None:
    root = extension(home)
    root.rename(root.parent / ".alup-reshape-old")
    (root.parent / ".alup-reshape-new").mkdir()
    done = harness.install(home, **NO_PACKAGES)
    assert (done.returncode, done.stderr) == (0, "")
    assert os.listdir(root.parent) == [harness.NAME]


def test_a_kept_environment_gets_the_optional_packages_that_it_lacks(home: Path) -> None:
    """As after an update to a version with one optional package more."""
    site = extension(home) / "venv" / "lib" / environment_python(home) / "site-packages"
    for folder in site.glob("qdldl-*.dist-info"):
        shutil.rmtree(folder)
    done = harness.install(home, **NO_PACKAGES)
    assert (done.returncode, done.stderr) == (0, "")
    assert "Fetching qdldl" in done.stdout
    assert "Using the environment that is there." in done.stdout
    assert "Note: qdldl is not to be had" in done.stdout


def test_uninstall_leaves_nothing(home: Path) -> None:
    done = harness.install(home, "--uninstall")
    assert (done.returncode, done.stderr) == (0, "")
    assert list(listing(home)) == [".config"]
    assert "Nothing to remove" in harness.install(home, "--uninstall").stdout


def test_uninstall_keeps_files_that_are_not_ours(home: Path) -> None:
    other = extension(home).parent / "other.inx"
    other.touch()
    # Inkscape may be gone by then.
    assert harness.install(home, "--uninstall", INKSCAPE_COMMAND="/nowhere").returncode == 0
    assert os.listdir(other.parent) == ["other.inx"]


def environment_python(home: Path) -> str:
    """Name of the folder of the environment's Python, as python3.11."""
    return next((extension(home) / "venv" / "lib").iterdir()).name


@pytest.mark.parametrize("missing", ["scipy", "numpy"])
def test_without_a_package_the_effect_says_so_in_a_sentence(home: Path, tmp_path: Path, missing: str) -> None:
    root = extension(home)
    shutil.rmtree(root / "venv" / "lib" / environment_python(home) / "site-packages" / missing)
    drawing = tmp_path / "drawing.svg"
    drawing.write_text(DRAWING)
    done = subprocess.run(
        # -S: the system's own numpy does not count
        ["/usr/bin/python3", "-S", str(root / "alup_reshape.py"), "--id=curve", str(drawing)],
        env=harness.clean_environment(HOME=home),
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.count("\n") == 1
    assert f"does not find {missing}" in done.stderr
    assert "choose Extensions > ALUP Reshape > Set up..." in done.stderr
    assert drawing.read_text() == DRAWING


def test_check_tells_what_is_wrong(home: Path) -> None:
    shutil.rmtree(extension(home) / "venv" / "lib" / environment_python(home) / "site-packages" / "scipy")
    assert_refused(harness.install(home, "--check"), "scipy", "cannot run")


@pytest.mark.parametrize("name", ["alup_place_handles.py", "alup_reshape.py"])
def test_check_finds_an_effect_that_would_open_a_window(home: Path, name: str) -> None:
    effect = extension(home) / name
    text = effect.read_text()
    assert "prepare(__file__)\n" in text
    effect.unlink()
    effect.write_text(
        text.replace("prepare(__file__)\n", "prepare(__file__)\nsys.stderr.write('a warning')\n", 1).replace(
            "from alup", "import sys\nfrom alup", 1
        )
    )
    assert_refused(harness.install(home, "--check"), "a warning", "cannot run")


# --- in Inkscape --------------------------------------------------------------------------------


def coordinates(file: Path) -> list[float]:
    match = re.search(r'<path[^>]*?\sd="([^"]*)"', file.read_text())
    assert match is not None
    return [float(number) for number in re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", match[1])]


def test_inkscape_runs_the_installed_effect(inkscape: harness.Inkscape, tmp_path: Path) -> None:
    for name in ("numpy", "scipy", "inkex", "lxml"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('hijacked')\n")
    drawing = tmp_path / "drawing.svg"
    drawing.write_text(DRAWING)
    run = inkscape.reshape(drawing, select=["curve", "h1", "h2", "h3"], cwd=tmp_path)
    assert (run.code, run.stderr) == (0, "")
    assert coordinates(run.output) != coordinates(drawing)
    assert drawing.read_text() == DRAWING


def test_an_effect_that_complains_is_heard(inkscape: harness.Inkscape) -> None:
    """The harness itself: an error must not look like a drawing that did not change."""
    run = inkscape.reshape(DRAWING, params={"no_such_parameter": 1}, effect="no_such_effect")
    assert run.code is None
    drawing_without_handles = re.sub(r"<circle.*?/>", "", DRAWING)
    run = inkscape.reshape(drawing_without_handles, select=["curve"])
    assert run.stderr.strip() != ""


def test_the_demonstration_makes_a_picture(home: Path, tmp_path: Path) -> None:
    profile = listing(home)
    done = harness.install(home, "--demo")
    assert (done.returncode, done.stderr) == (0, "")
    assert re.search(r"[1-9]\d* of \d+ paths were reshaped", done.stdout)
    assert sorted(os.listdir(tmp_path)) == ["alup-demo.png", "alup-demo.svg", "home", "tmp"]
    assert os.listdir(tmp_path / "tmp") == []
    # A page with two titles and nothing else has 9 kB.
    assert (tmp_path / "alup-demo.png").stat().st_size > 15_000
    assert set(listing(home)) == set(profile)
