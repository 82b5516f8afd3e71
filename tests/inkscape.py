# SPDX-License-Identifier: GPL-2.0-or-later
"""Run the installed extension in a real Inkscape, without a person or a screen.

Three habits of Inkscape could make a test pass or hang for the wrong reason.  It does not pass on the exit
code of the effect.  It writes the file unchanged when the action is unknown.  It opens a window for every
text that the effect writes to stderr.  So the effect runs under a wrapper of the interpreter that keeps exit
code and stderr in files, and a run that takes too long is ended.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Callable, Mapping, Sequence
from xml.sax.saxutils import quoteattr

ROOT = Path(__file__).resolve().parents[1]
INSTALLER = ROOT / "install.sh"
NAME = "alup-reshape"

# Start-up of Inkscape takes 3-5 s, twice that with both cores busy.
RUN_SECONDS = 90
INSTALL_SECONDS = 280

# Variables of the tests' own Python and session, which must not reach Inkscape's.
_NOT_PASSED_ON = (
    "DBUS_SESSION_BUS_ADDRESS",
    "INKSCAPE_COMMAND",
    "INKSCAPE_PROFILE_DIR",
    "PYTHONHOME",
    "PYTHONPATH",
    "VIRTUAL_ENV",
    "WAYLAND_DISPLAY",
    "XDG_CACHE_HOME",
    "XDG_CONFIG_HOME",
    "XDG_DATA_HOME",
    "XDG_RUNTIME_DIR",
)

# Inkscape has put its own folder first on the PATH by now, so this is the Python that it would have started.
_WRAPPER = """#!/bin/sh
python3 "$@" 2>>'{folder}/stderr'
code=$?
echo $code >'{folder}/code'
exit $code
"""

_PREFERENCES = """<?xml version="1.0" encoding="UTF-8"?>
<inkscape version="1">
  <group id="options"><group id="boot" enabled="0"/></group>
  <group id="extensions" python-interpreter={wrapper}{parameters}/>
</inkscape>
"""


class InkscapeTimeout(AssertionError):
    """Inkscape did not end; usually it shows a window that nobody closes."""


@dataclass(frozen=True)
class Run:
    """The result of one run of an effect in Inkscape."""

    output: Path  # the drawing Inkscape wrote; check `output.exists()` where it may not have
    stderr: str  # of the effect
    code: int | None  # exit code of the effect, None when Inkscape never started it
    log: str  # what Inkscape itself said
    seconds: float


@dataclass(frozen=True)
class Inkscape:
    """Inkscape with the extensions of one folder, each run in a profile of its own."""

    extensions: Path
    folder: Path  # profiles and outputs go here
    display: str

    def reshape(
        self,
        svg: Path | str,
        select: Sequence[str] = (),
        params: Mapping[str, object] | None = None,
        effect: str = "alup_reshape",
        cwd: Path | None = None,
        timeout: float = RUN_SECONDS,
    ) -> Run:
        """Run one of our effects on a file, or on the text of one.

        select : ids, none for an empty selection
        params : parameters of the .inx by name, as preferences.xml would have them
        effect : name of the effect's files
        cwd    : where the person is who starts Inkscape, by default an empty folder
        """
        folder = self._new_folder()
        if isinstance(svg, str):
            text, svg = svg, folder / "in.svg"
            svg.write_text(text, encoding="utf-8")
        output = folder / "out.svg"
        identity = f"org.alup.{effect}"
        self._write_profile(folder, identity, params or {})
        actions = [f"select-by-id:{','.join(select)}"] if select else []
        actions += [identity.replace("_", "-") + ".noprefs", f"export-filename:{output}", "export-do"]
        command = ["inkscape", f"--app-id-tag={folder.name}", "--batch-process"]
        command += ["--actions=" + ";".join(actions), str(svg.resolve())]
        began = time.monotonic()
        log, ended = self._run(command, folder, cwd or folder / "cwd", timeout)
        stderr = _text(folder / "stderr")
        if not ended:
            raise InkscapeTimeout(f"no end after {timeout} s\neffect: {stderr}\nInkscape: {log}")
        code = _text(folder / "code").strip()
        return Run(output, stderr, int(code) if code else None, log, time.monotonic() - began)

    def _new_folder(self) -> Path:
        number = sum(1 for _ in self.folder.iterdir())
        # The name is also the tag of Inkscape on the session bus, which allows letters and digits only.
        folder = self.folder / f"p{os.getpid()}n{number}"
        for name in ("profile", "tmp", "cwd"):
            (folder / name).mkdir(parents=True)
        return folder

    def _write_profile(self, folder: Path, identity: str, params: Mapping[str, object]) -> None:
        (folder / "profile" / "extensions").symlink_to(self.extensions)
        wrapper = folder / "python"
        wrapper.write_text(_WRAPPER.format(folder=folder))
        wrapper.chmod(0o755)
        parameters = "".join(
            f" {identity}.{name}={quoteattr(str(int(value) if isinstance(value, bool) else value))}"
            for name, value in params.items()
        )
        text = _PREFERENCES.format(wrapper=quoteattr(str(wrapper)), parameters=parameters)
        (folder / "profile" / "preferences.xml").write_text(text, encoding="utf-8")

    def _run(self, command: list[str], folder: Path, cwd: Path, timeout: float) -> tuple[str, bool]:
        """Inkscape's words, and whether it came to an end by itself."""
        environment = clean_environment(
            HOME=folder.parent,  # shared: the font cache takes seconds to make
            TMPDIR=folder / "tmp",
            INKSCAPE_PROFILE_DIR=folder / "profile",
            DISPLAY=self.display,
            GDK_BACKEND="x11",
            NO_AT_BRIDGE="1",
            GTK_USE_PORTAL="0",
            DBUS_SESSION_BUS_ADDRESS="disabled:",
        )
        with open(folder / "log", "wb") as log:
            # A session of its own, so that the effect's Python ends with Inkscape.
            process = subprocess.Popen(
                command,
                env=environment,
                cwd=cwd,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
            try:
                process.wait(timeout)
                ended = True
            except subprocess.TimeoutExpired:
                ended = False
            finally:
                if process.poll() is None:
                    os.killpg(process.pid, signal.SIGKILL)
                    process.wait()
        return _text(folder / "log"), ended


def start_display() -> tuple[subprocess.Popen[bytes], str]:
    """A virtual screen and its name; the caller ends the process."""
    read, write = os.pipe()
    command = ["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x1024x24", "-nolisten", "tcp"]
    process = subprocess.Popen(
        command, pass_fds=[write], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    os.close(write)
    with os.fdopen(read) as answer:
        number = answer.readline().strip()  # comes when the display is ready, or empty at its end
    if not number:
        process.wait()
        raise RuntimeError("Xvfb did not start")
    return process, ":" + number


def install(
    home: Path, *options: str, installer: Path = INSTALLER, **variables: object
) -> subprocess.CompletedProcess[str]:
    """Run install.sh for the Inkscape of a person whose home folder this is."""
    for name in ("home", "tmp"):
        (home.parent / name).mkdir(exist_ok=True)
    return subprocess.run(
        ["sh", str(installer), *options],
        # pip asks every compiler for its version, and some compilers then write into the home folder.
        env=clean_environment(
            **{
                "HOME": home,
                "TMPDIR": home.parent / "tmp",
                "PATH": "/usr/local/bin:/usr/bin:/bin",
                **variables,
            }
        ),
        cwd=home.parent,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=INSTALL_SECONDS,
    )


def installed_home(folder: Path) -> Path:
    """A new home folder for which install.sh has been run.  Raises SystemExit if that failed."""
    home = folder / "person" / "home"
    home.mkdir(parents=True)
    done = install(home)
    if done.returncode != 0:
        raise SystemExit(done.stdout + done.stderr)
    return home


def extensions_of(home: Path) -> Path:
    """Where Inkscape looks for the extensions of a person, on Linux."""
    return home / ".config" / "inkscape" / "extensions"


def clone(home: Path, folder: Path) -> Path:
    """A copy of a home folder that may be damaged; its files are hard links, so replace, don't edit."""
    copy = folder / "home"
    shutil.copytree(home, copy, symlinks=True, copy_function=os.link)
    return copy


def clean_environment(**changes: object) -> dict[str, str]:
    """The tests' environment without what concerns their own Python and desktop, and with changes."""
    environment = {name: value for name, value in os.environ.items() if name not in _NOT_PASSED_ON}
    environment["LANG"] = "C.UTF-8"
    environment.update((name, str(value)) for name, value in changes.items())
    return environment


def under_permissions() -> Callable[[], None] | None:
    """A `preexec_fn` by which permissions of files hold for the administrator, too.

    None where the tests are not run by the administrator.
    """
    if os.geteuid() != 0:
        return None
    library = ctypes.CDLL(None)
    drop, override, search = 24, 1, 2  # PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH

    def prepare() -> None:
        for capability in (override, search):
            library.prctl(drop, capability, 0, 0, 0)

    return prepare


def _text(file: Path) -> str:
    return file.read_text(encoding="utf-8", errors="replace") if file.exists() else ""
