# SPDX-License-Identifier: GPL-2.0-or-later
"""Imitations of Windows, macOS and Linux: files, a registry, and programs that only print an answer."""

from __future__ import annotations

import fnmatch
import json
from dataclasses import dataclass, field
from typing import Any, Callable, Sequence

from alup.setup.machine import LINUX, MACOS, WINDOWS, Machine

# The answer of an imitated Python, unless it is given another one.
USUAL: dict[str, Any] = {
    "version": [3, 12, 4],
    "name": "cpython",
    "bits": 64,
    "platform": "linux-x86_64",
    "executable": "",
    "base": "",
    "venv": True,
    "pip": "/wheels/pip-24.0-py3-none-any.whl",
}

HOMES = {LINUX: "/home/jo", MACOS: "/Users/jo", WINDOWS: "C:\\Users\\J\u00f6rg & Co"}


@dataclass
class Pretended(Machine):
    """A machine with the given files, programs and registry keys only."""

    system: str = LINUX
    variables: dict[str, str] = field(default_factory=dict)
    files: dict[str, str] = field(default_factory=dict)  # texts by path
    on_path: dict[str, str] = field(default_factory=dict)  # paths by name
    keys: dict[tuple[str, str], str] = field(default_factory=dict)  # of the registry
    answers: dict[str, Callable[[Sequence[str]], str]] = field(default_factory=dict)  # by program
    asked: list[list[str]] = field(default_factory=list)

    def __post_init__(self) -> None:
        name = "USERPROFILE" if self.system == WINDOWS else "HOME"
        self.variables.setdefault(name, HOMES[self.system])

    def is_file(self, path: str) -> bool:
        return path in self.files

    is_program = is_file

    def real(self, path: str) -> str:
        return path

    def read(self, path: str) -> str:
        return self.files.get(path, "")

    def glob(self, pattern: str) -> list[str]:
        return sorted(path for path in self.files if fnmatch.fnmatchcase(path, pattern))

    def which(self, name: str, first: str = "") -> str:
        beside = self.path.join(first, name)
        if first and beside in self.files:
            return str(beside)
        return name if name in self.files else self.on_path.get(name, "")

    def registry(self, key: str, value: str = "") -> list[str]:
        return [text for (at, name), text in self.keys.items() if (at, name) == (key, value)]

    def registry_keys(self, key: str) -> list[str]:
        below = [at[len(key) + 1 :].split("\\")[0] for at, _value in self.keys if at.startswith(key + "\\")]
        return list(dict.fromkeys(below))

    def ask(self, command: Sequence[str], **_variables: str | None) -> str:
        self.asked.append(list(command))
        answer = self.answers.get(command[0])
        return answer(command[1:]) if answer else ""

    def add_inkscape(self, program: str, profile: str, data: str = "", console: str = "") -> None:
        """Add an Inkscape.  console : the program that answers, where it is another one"""
        told = {
            "--user-data-directory": profile,
            "--system-data-directory": data,
            "--version": "Inkscape 1.4 (x)",
        }
        self.files[program] = ""
        if console:
            self.files[console] = ""
        self.answers[console or program] = lambda options: "a warning\n" + told[options[0]] + "\n"
        if data:
            self.files[self.path.join(data, "extensions", "inkex", "__init__.py")] = ""

    def add_python(self, path: str, **told: Any) -> None:
        self.files[path] = ""
        answer = json.dumps({**USUAL, "executable": path, **told})
        self.answers[path] = lambda options: answer if "-c" in options else ""
