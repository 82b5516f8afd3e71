# SPDX-License-Identifier: GPL-2.0-or-later
"""A lock that keeps two installers from working on the same extension.

The operating system releases the lock when the process ends, even if it is killed.
"""

from __future__ import annotations

import os
from contextlib import contextmanager
from typing import IO, Iterator

from ..messages.language import translate as _
from . import faults
from .setup_errors import SetupError


@contextmanager
def held(target: str) -> Iterator[None]:
    """Hold the lock of an extension's folder, which need not exist.

    Raises SetupError if another process holds it.
    """
    path = os.path.join(os.path.dirname(target), f".{os.path.basename(target)}.lock")
    file = _opened(path)
    try:
        yield
    finally:
        _leave(file, path)


def _opened(path: str) -> IO[bytes]:
    while True:
        try:
            file = open(path, "ab")  # noqa: SIM115 - stays open as long as the lock is held
        except OSError as error:
            raise faults.of_system(error, os.path.dirname(path)) from error
        try:
            _lock(file)
        except OSError:
            file.close()
            text = _("Another window or terminal is setting up {folder} just now. Wait until it is done.")
            raise SetupError(text.format(folder=os.path.dirname(path))) from None
        # The former holder may have deleted the file between our opening and locking it.
        if os.name == "nt" or _is_there(file, path):
            return file
        file.close()


def _is_there(file: IO[bytes], path: str) -> bool:
    try:
        return os.path.samestat(os.fstat(file.fileno()), os.stat(path))
    except FileNotFoundError:
        return False


def _lock(file: IO[bytes]) -> None:
    if os.name == "nt":
        import msvcrt

        file.seek(0)
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined,unused-ignore]
    else:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _leave(file: IO[bytes], path: str) -> None:
    """Release the lock and delete its file: while it is locked, except on Windows, which forbids that."""
    if os.name == "nt":
        file.close()
        try:
            os.remove(path)
        except OSError:
            return  # another process has opened it meanwhile, and will delete it
    else:
        os.remove(path)
        file.close()
