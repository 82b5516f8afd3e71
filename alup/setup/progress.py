# SPDX-License-Identifier: GPL-2.0-or-later
"""Progress of a set-up: reports of steps, cancelling, and programs with output reported line by line."""

from __future__ import annotations

import os
import queue
import signal
import subprocess
import threading
from typing import Any, Callable, Mapping, Sequence

from .machine import without_window
from .setup_errors import Cancelled

# Seconds between two checks for cancelling while a program runs.
_LOOK_SECONDS = 0.1


class Progress:
    """The base class: it shows nothing and is never cancelled."""

    def step(self, text: str, done: float) -> None:
        """A new step begins.  done : completed share of the whole work, 0 to 1"""

    def detail(self, line: str) -> None:
        """A program of the present step has written a line."""

    def cancelled(self) -> bool:
        return False

    def check(self) -> None:
        """Raise Cancelled if the user has cancelled."""
        if self.cancelled():
            raise Cancelled


class Quiet(Progress):
    """Progress that forwards everything except steps."""

    def __init__(self, other: Progress) -> None:
        self._other = other

    def detail(self, line: str) -> None:
        self._other.detail(line)

    def cancelled(self) -> bool:
        return self._other.cancelled()


def run(
    command: Sequence[str],
    environment: Mapping[str, str],
    progress: Progress,
    on_line: Callable[[str], object] = str,
) -> tuple[int, str]:
    """Run a program; returns its exit code and its output.

    Each line is passed to `progress` and to `on_line`.  If `progress` is cancelled, the program and its
    children are ended, and Cancelled is raised.
    """
    own_group: dict[str, Any] = {} if os.name == "nt" else {"start_new_session": True}
    with subprocess.Popen(
        list(command),
        env=dict(environment),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        **own_group,
        **without_window(),
    ) as process:
        assert process.stdout is not None
        lines: queue.Queue[bytes | None] = queue.Queue()
        stream = process.stdout

        def read() -> None:
            for line in stream:
                lines.put(line)
            lines.put(None)

        reader = threading.Thread(target=read, daemon=True)
        reader.start()
        said = []
        try:
            while True:
                progress.check()
                try:
                    line = lines.get(timeout=_LOOK_SECONDS)
                except queue.Empty:
                    continue
                if line is None:
                    break
                text = line.decode("utf-8", "replace").rstrip()
                said.append(text)
                progress.detail(text)
                on_line(text)
        except BaseException:
            _end(process)
            raise
        process.wait()
    return process.returncode, "\n".join(said)


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a program and its children, and wait for it."""
    if os.name == "nt":
        subprocess.run(
            ["taskkill", "/F", "/T", "/PID", str(process.pid)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            check=False,
            **without_window(),
        )
    else:
        try:
            os.killpg(process.pid, signal.SIGKILL)
        except ProcessLookupError:
            return
    process.wait()
