# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs an effect in a separate process, as Inkscape does, and reports how it ended.

Starting Python and importing numpy and scipy takes longer than most runs.  So the caller imports everything,
and a run is a fork of it.  The fork sets arguments, standard streams and limits, calls the effect's `run()`,
and ends with its exit code.  The parent sees what Inkscape would see: the exit code, the signal, the bytes on
both streams, and whether the process ends at all.
"""

from __future__ import annotations

import contextlib
import io
import math
import os
import resource
import signal
import sys
import time
import traceback
from dataclasses import dataclass
from pathlib import Path
from typing import Callable, NoReturn

# Ratio of the limit on the clock to the limit of processor time: other programs use the processor, too.
PATIENCE = 4.0

# Seconds between looks at a process.
_LOOK = 0.004


@dataclass(frozen=True)
class Ended:
    """code : exit code, None where a signal ended it; signal : its number, 0 for none
    hung : it had to be killed; seconds : of the clock; cpu : seconds of the processor; megabytes : at most
    """

    code: int | None
    signal: int
    hung: bool
    stdout: bytes
    stderr: bytes
    seconds: float
    cpu: float
    megabytes: float


def run(effect: Callable[[], None], folder: Path, limit: float, megabytes: int) -> Ended:
    """Run an effect in a fork.

    folder : for its streams; limit : seconds of the processor, PATIENCE times which it may take by the clock
    megabytes : of address space
    """
    streams = folder / "stdout", folder / "stderr"
    sys.stdout.flush()
    sys.stderr.flush()
    began = time.perf_counter()
    child = os.fork()
    if child == 0:
        _be_the_effect(effect, streams, limit, megabytes)
    try:
        hung, status, usage = _await(child, PATIENCE * limit)
    except BaseException:
        os.kill(child, signal.SIGKILL)  # it may have no process group yet
        raise
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(child, signal.SIGKILL)  # and the processes that it left behind
    seconds = time.perf_counter() - began
    ended_by = os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0
    hung = hung or ended_by == signal.SIGXCPU
    return Ended(
        code=None if ended_by or hung else os.WEXITSTATUS(status),
        signal=0 if hung else ended_by,
        hung=hung,
        stdout=streams[0].read_bytes(),
        stderr=streams[1].read_bytes(),
        seconds=seconds,
        cpu=usage.ru_utime + usage.ru_stime,
        megabytes=usage.ru_maxrss / 1024.0,
    )


def _await(child: int, limit: float) -> tuple[bool, int, resource.struct_rusage]:
    """Wait for a process, and kill it after so many seconds.  Returns whether, its status and its usage."""
    began = time.perf_counter()
    while True:
        pid, status, usage = os.wait4(child, os.WNOHANG)
        if pid:
            return False, status, usage
        if time.perf_counter() - began > limit:
            os.kill(child, signal.SIGKILL)
            return True, *os.wait4(child, 0)[1:]
        time.sleep(_LOOK)


def _be_the_effect(
    effect: Callable[[], None], streams: tuple[Path, Path], limit: float, megabytes: int
) -> NoReturn:
    code = 1
    try:
        os.setsid()
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        for number, name in ((1, streams[0]), (2, streams[1])):
            file = os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
            os.dup2(file, number)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        # The streams of the caller may be other objects, or lead to other files.
        sys.stdout = io.TextIOWrapper(io.FileIO(1, "w", closefd=False), "utf-8")
        sys.stderr = io.TextIOWrapper(io.FileIO(2, "w", closefd=False), "utf-8", write_through=True)
        space = megabytes * 1024 * 1024
        resource.setrlimit(resource.RLIMIT_AS, (space, space))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(limit), math.ceil(limit) + 5))
        signal.alarm(int(PATIENCE * limit) + 5)  # in case the parent has ended
        effect()
        code = 0
    except SystemExit as left:
        # As in the interpreter: a number is the exit code, a text goes to the standard error.
        if left.code is None or isinstance(left.code, int):
            code = left.code or 0
        else:
            sys.stderr.write(f"{left.code}\n")
    except BaseException:  # noqa: BLE001 - what the interpreter would do
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
