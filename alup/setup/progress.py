# SPDX-License-Identifier: GPL-2.0-or-later
"""What is done is told while it is done, and can be cancelled: on a terminal, in a window, or not at all."""

from __future__ import annotations

import os
import queue
import signal
import subprocess
import threading
from typing import Any, Callable, Mapping, Sequence

from .machine import without_window
from .setup_errors import Cancelled

# How long after Cancel a program that is started here goes on at most.
_LOOK_SECONDS = 0.1


class Progress:
    """Nobody looks, nobody cancels; the others derive from it."""

    def step(self, text: str, done: float) -> None:
        """A new step begins; done : share of the whole that is behind, 0 to 1."""

    def detail(self, line: str) -> None:
        """A program that works at the step has said something."""

    def cancelled(self) -> bool:
        return False

    def check(self) -> None:
        """Raise Cancelled if the person has cancelled."""
        if self.cancelled():
            raise Cancelled


class Quiet(Progress):
    """Another one without its steps."""

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
    told: Callable[[str], object] = str,
) -> tuple[int, str]:
    """Exit code and words of a program, told line by line; cancelled, it ends with all it started."""
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
                told(text)
        except BaseException:
            _end(process)
            raise
        process.wait()
    return process.returncode, "\n".join(said)


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a program with what it started, and wait for it."""
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
