# SPDX-License-Identifier: GPL-2.0-or-later
"""A window for the page: a browser of the Chromium family without its bars, else the default browser.

The first kind gets a profile of its own in a temporary folder: it shares nothing with the person's browsing,
its process ends with the window, and it can be ended with the effect.
"""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import webbrowser
from pathlib import Path
from typing import Iterator

# Names a command, with arguments, that is started instead with the address behind it.
COMMAND_VARIABLE = "ALUP_BROWSER"

_NAMES = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "microsoft-edge",
    "microsoft-edge-stable",
    "msedge",
    "brave-browser",
    "vivaldi",
)
_OF_MACOS = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    "/Applications/Brave Browser.app/Contents/MacOS/Brave Browser",
)
_OF_WINDOWS = (
    r"Google\Chrome\Application\chrome.exe",
    r"Microsoft\Edge\Application\msedge.exe",
    r"Chromium\Application\chrome.exe",
    r"BraveSoftware\Brave-Browser\Application\brave.exe",
)

# A window, and nothing that asks, tells or fetches.
_ARGUMENTS = (
    "--no-first-run",
    "--no-default-browser-check",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-default-apps",
    "--disable-extensions",
    "--disable-sync",
    "--disable-features=Translate,OptimizationHints,MediaRouter",
    "--password-store=basic",
    "--use-mock-keychain",
    "--window-size=1200,820",
)

# See `server.is_ours`.
TELLS_WHOSE = os.path.exists("/proc/net/tcp")

# Of Python's own: they are meant for the effect, not for what it starts.
_NOT_HANDED_ON = ("PYTHONPATH", "PYTHONHOME", "PYTHONIOENCODING")

_END_SECONDS = 2.0


class Browser:
    """A window that shows an address; a context, which ends with the window."""

    def __init__(self, address: str):
        self._address = address
        self._process: subprocess.Popen[bytes] | None = None
        self._folder: str | None = None
        self._ways = self._opened()
        self._asked_default = False

    def __enter__(self) -> Browser:
        next(self._ways, None)
        return self

    def __exit__(self, *_error: object) -> None:
        self._end()

    def may_come(self) -> bool:
        """Whether the page may still come.  Where a browser has ended without it the next one is started."""
        running = self._process is not None and self._process.poll() is None
        return running or self._asked_default or next(self._ways, False)

    def _opened(self) -> Iterator[bool]:
        """One way after the other, as long as one is asked for."""
        given = os.environ.get(COMMAND_VARIABLE)
        if given:
            if self._start([*shlex.split(given), self._address]):
                yield True
            return
        if not _has_screen():
            return
        for program in found():
            self._end()
            self._folder = tempfile.mkdtemp(prefix="alup-live-")
            profile = f"--user-data-dir={self._folder}"
            if self._start([program, f"--app={self._shown_address()}", profile, *_ARGUMENTS]):
                yield True
        self._end()
        self._folder = tempfile.mkdtemp(prefix="alup-live-")
        self._asked_default = _open_default(self._shown_address())
        if self._asked_default:
            yield True

    def _shown_address(self) -> str:
        """The address, or that of a file which leads there and which nobody else can read.

        Other users of a Unix system see what is on command lines.  Linux tells the server whose a connection
        is, so that the address is of no use to them; elsewhere it is kept from them.
        """
        if os.name == "nt" or TELLS_WHOSE:
            return self._address
        assert self._folder is not None
        path = Path(self._folder, "open.html")
        with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="ascii") as file:
            file.write(f'<!DOCTYPE html><meta http-equiv="refresh" content="0;url={self._address}">')
        return path.as_uri()

    def _start(self, command: list[str]) -> bool:
        environment = {name: value for name, value in os.environ.items() if name not in _NOT_HANDED_ON}
        try:
            self._process = subprocess.Popen(
                command,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                cwd=tempfile.gettempdir(),
            )
        except OSError:
            return False
        return True

    def _end(self) -> None:
        process, self._process = self._process, None
        if process is not None and process.poll() is None:
            process.terminate()
            try:
                process.wait(_END_SECONDS)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
            self._folder = None


def _open_default(address: str) -> bool:
    """Have the default browser show an address; what it writes goes nowhere, as Inkscape reads our output."""
    kept = [os.dup(number) for number in (1, 2)]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for number in (1, 2):
            os.dup2(nowhere, number)
        return webbrowser.open(address)
    except webbrowser.Error:
        return False
    finally:
        for number, before in zip((1, 2), kept):
            os.dup2(before, number)
            os.close(before)
        os.close(nowhere)


def found() -> Iterator[str]:
    """Programs of the Chromium family, the likeliest first."""
    if sys.platform == "darwin":
        yield from (path for path in _OF_MACOS if os.path.exists(path))
    elif os.name == "nt":
        for variable in ("ProgramFiles", "ProgramFiles(x86)", "LocalAppData"):
            folder = os.environ.get(variable)
            if folder:
                yield from (str(Path(folder, path)) for path in _OF_WINDOWS if Path(folder, path).exists())
    else:
        for name in _NAMES:
            path = shutil.which(name)
            # A program beside the drawing is none to trust.
            if path is not None and os.path.isabs(path):
                yield path


def _has_screen() -> bool:
    if os.name == "nt" or sys.platform == "darwin":
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
