# SPDX-License-Identifier: GPL-2.0-or-later
"""The installer's access to the system: files, variables, the registry, outputs of programs.

Tests replace it by simulated machines, for instance with paths and a registry of Windows.
"""

from __future__ import annotations

import glob
import ntpath
import os
import posixpath
import shutil
import subprocess
import sys
from typing import Any, Iterable, Mapping, Optional, Sequence

LINUX, MACOS, WINDOWS = "linux", "macos", "windows"

# Time limit of a program's answer.  Inkscape answers within 5 s on a cold disk; a program on a dead network
# drive never does.
ANSWER_SECONDS = 60

# Variables of the caller's Python, pip or virtual environment, which must not affect programs started here.
_NOT_PASSED_ON = (
    "PYTHONPATH",
    "PYTHONHOME",
    "PYTHONSTARTUP",
    "VIRTUAL_ENV",
    "PIP_TARGET",
    "PIP_PREFIX",
    "PIP_USER",
    "PIP_ROOT",
    "PIP_REQUIREMENT",
    "PIP_REQUIRE_VIRTUALENV",
    "__PYVENV_LAUNCHER__",
)


class Machine:
    """The machine on which this program runs."""

    system: str = {"win32": WINDOWS, "cygwin": WINDOWS, "msys": WINDOWS, "darwin": MACOS}.get(
        sys.platform, LINUX
    )
    variables: Mapping[str, str] = os.environ

    @property
    def path(self) -> Any:
        """The module that handles this system's paths."""
        return ntpath if self.system == WINDOWS else posixpath

    @property
    def home(self) -> str:
        """The user's home folder."""
        return self.variables.get("USERPROFILE" if self.system == WINDOWS else "HOME") or os.path.expanduser(
            "~"
        )

    def is_file(self, path: str) -> bool:
        return os.path.isfile(path)

    def is_program(self, path: str) -> bool:
        return os.path.isfile(path) and os.access(path, os.X_OK)

    def real(self, path: str) -> str:
        return os.path.realpath(path)

    def read(self, path: str) -> str:
        """The text of a file; empty if there is none."""
        try:
            with open(path, encoding="utf-8", errors="replace") as file:
                return file.read()
        except OSError:
            return ""

    def glob(self, pattern: str) -> list[str]:
        return sorted(glob.glob(pattern))

    def which(self, name: str, first: str = "") -> str:
        """The path of a program, searched in the folder `first`, then on the PATH; empty if it is not found.

        A relative result is rejected, because programs in the working folder can't be trusted.
        """
        search = os.pathsep.join(part for part in (first, self.variables.get("PATH", os.defpath)) if part)
        found = shutil.which(name, path=search)
        return found if found and os.path.isabs(found) else ""

    def registry(self, key: str, value: str = "") -> list[str]:
        """Texts of a value of Windows' registry, the user's before the machine's."""
        return [
            text
            for root in ("HKEY_CURRENT_USER", "HKEY_LOCAL_MACHINE")
            for text in self._text(root, key, value)
        ]

    def registry_keys(self, key: str) -> list[str]:
        """Names of the keys below a key of Windows' registry, the user's before the machine's."""
        if self.system != WINDOWS:
            return []
        import winreg as registry

        names: list[str] = []
        for root in (registry.HKEY_CURRENT_USER, registry.HKEY_LOCAL_MACHINE):  # type: ignore[attr-defined,unused-ignore]
            try:
                with registry.OpenKey(root, key) as opened:  # type: ignore[attr-defined,unused-ignore]
                    count = registry.QueryInfoKey(opened)[0]  # type: ignore[attr-defined,unused-ignore]
                    names += [registry.EnumKey(opened, n) for n in range(count)]  # type: ignore[attr-defined,unused-ignore]
            except OSError:
                continue  # no such key
        return names

    def _text(self, root: str, key: str, value: str) -> Iterable[str]:
        if self.system != WINDOWS:
            return
        import winreg as registry

        try:
            with registry.OpenKey(getattr(registry, root), key) as opened:  # type: ignore[attr-defined,unused-ignore]
                yield str(registry.QueryValueEx(opened, value)[0])  # type: ignore[attr-defined,unused-ignore]
        except OSError:
            return  # no such key

    def environment(self, **changes: Optional[str]) -> dict[str, str]:
        """The variables for a started program, without those of the caller's Python or pip.

        changes : values by name; None removes the variable
        """
        kept = {name: text for name, text in self.variables.items() if name not in _NOT_PASSED_ON}
        return {name: text for name, text in {**kept, **changes}.items() if text is not None}

    def ask(self, command: Sequence[str], **variables: Optional[str]) -> str:
        """A program's standard output; empty if it fails or exceeds ANSWER_SECONDS."""
        try:
            done = subprocess.run(
                list(command),
                env=self.environment(**variables),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                timeout=ANSWER_SECONDS,
                check=False,
                **without_window(),
            )
        except (OSError, ValueError, subprocess.TimeoutExpired):
            return ""
        return done.stdout.decode("utf-8", "replace") if done.returncode == 0 else ""


def without_window() -> dict[str, Any]:
    """Arguments of subprocess that keep Windows from opening a console window."""
    return {"creationflags": getattr(subprocess, "CREATE_NO_WINDOW", 0)} if os.name == "nt" else {}
