# SPDX-License-Identifier: GPL-2.0-or-later
"""Find a Python that loads the wheels of PyPI.

Inkscape's own comes first: packages made for it are used without starting a second one.  Where that can't
load them (Windows' Inkscape has a Python of MSYS2) it is one of python.org or of the system, and where there
is none, one that uv brings (`managed.py`).
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import Iterator

from .machine import MACOS, WINDOWS, Machine

# Inkscape 1.2 may come with 3.8; of other Pythons there are newer ones everywhere.
OLDEST, OLDEST_OF_OTHERS = (3, 8), (3, 9)

# The versions for which scipy has wheels, the best supported first.
VERSIONS = ("3.12", "3.13", "3.11", "3.10", "3.14", "3.9")

# What a Python says about itself.  Old ones have to get as far as the answer, so it is old Python.
_PROBE = """
import glob, json, os, sys, sysconfig
folders = [sysconfig.get_config_var("WHEEL_PKG_DIR") or ""]
try:
    import ensurepip
    folders.append(os.path.join(os.path.dirname(ensurepip.__file__), "_bundled"))
except ImportError:
    pass
folders.append("/usr/share/python-wheels")
wheels = [found for folder in folders if folder for found in glob.glob(os.path.join(folder, "pip-*.whl"))]
try:
    import venv
except ImportError:
    venv = None
sys.stdout.write(json.dumps({
    "version": list(sys.version_info[:3]), "name": sys.implementation.name, "bits": 64 if sys.maxsize > 2**32
    else 32, "platform": sysconfig.get_platform(), "executable": sys.executable, "base": sys.base_prefix,
    "venv": bool(venv), "pip": (wheels + [""])[0]}))
"""


@dataclass(frozen=True)
class Python:
    """An interpreter, as it describes itself."""

    path: str
    version: tuple[int, int, int]
    name: str  # cpython, pypy ...
    bits: int
    platform: str  # as win-amd64, mingw_x86_64, linux-x86_64
    venv: bool  # whether it can make environments
    pip: str  # a wheel of pip that came with it, or empty

    @property
    def loads_wheels(self) -> bool:
        """Whether PyPI has compiled packages for it."""
        foreign = self.platform.startswith(("mingw", "msys", "cygwin"))
        return self.name == "cpython" and self.bits == 64 and not foreign

    @property
    def called(self) -> str:
        return "Python {}.{}.{}".format(*self.version)


def look(machine: Machine, path: str) -> Python | None:
    """What the Python at a path says, None where it is none, or does not start."""
    answer = machine.ask([path, "-E", "-s", "-c", _PROBE])
    try:
        told = json.loads(answer)
        version = tuple(map(int, told["version"]))
        return Python(
            path=path,
            version=(version[0], version[1], version[2]),
            name=told["name"],
            bits=told["bits"],
            platform=told["platform"],
            venv=told["venv"],
            pip=told["pip"],
        )
    except (ValueError, KeyError, TypeError, IndexError):
        return None


def candidates(machine: Machine, own: str) -> Iterator[Python]:
    """Pythons that load wheels, the best first, each version of the others once.

    own : Inkscape's Python, or empty
    """
    seen = set()
    for path in [own, *others(machine)]:
        real = machine.real(path) if path else ""
        if not path or real in seen:
            continue
        seen.add(real)
        python = look(machine, path)
        if python is None or not python.loads_wheels:
            continue
        # Only Inkscape's own is started whatever its version; a second of one version would be no other try.
        if (path == own and python.version >= OLDEST) or (
            python.version >= OLDEST_OF_OTHERS and str(python.version[:2]) not in seen
        ):
            seen.add(str(python.version[:2]))
            yield python


def others(machine: Machine) -> list[str]:
    """Paths of Pythons that are not Inkscape's: python.org's, Homebrew's, the system's."""
    if machine.system == WINDOWS:
        return _of_windows(machine)
    names = ["python3", *(f"python{version}" for version in VERSIONS)]
    found = [machine.which(name) for name in names]
    if machine.system == MACOS:
        framework = "/Library/Frameworks/Python.framework/Versions"
        found = [f"{framework}/{version}/bin/python3" for version in VERSIONS]
        found += [
            "/opt/homebrew/bin/python3",
            "/usr/local/bin/python3",
            *(machine.which(name) for name in names),
        ]
        found = [path for path in found if path and machine.is_program(path)]
        # Apple's starts nothing but a window that offers developer tools, as long as these are not installed.
        if not machine.ask(["/usr/bin/xcode-select", "-p"]).strip():
            found = [path for path in found if path != "/usr/bin/python3"]
    return [path for path in found if path]


def _of_windows(machine: Machine) -> list[str]:
    """From the registry (PEP 514), the launcher and the PATH.

    Those of the Microsoft Store are left out: what they write into AppData lands elsewhere.
    """
    join = machine.path.join
    installed = machine.registry_keys(r"Software\Python\PythonCore")
    wanted = [
        name
        for version in VERSIONS
        for name in installed
        if re.fullmatch(rf"{re.escape(version)}(-64)?", name)
    ]
    found = []
    for name in dict.fromkeys(wanted):
        key = rf"Software\Python\PythonCore\{name}\InstallPath"
        found += machine.registry(key, "ExecutablePath")
        found += [join(folder, "python.exe") for folder in machine.registry(key)]
    launcher = machine.which("py") or join(machine.variables.get("SystemRoot", r"C:\Windows"), "py.exe")
    listed = machine.ask([launcher, "-0p"]) if machine.is_file(launcher) else ""
    found += re.findall(r"(\S:\\[^\r\n]*?python[\w.]*\.exe)", listed, re.IGNORECASE)
    found += [machine.which("python"), machine.which("python3")]
    kept = [path for path in found if path and "\\windowsapps\\" not in path.lower()]
    return list(dict.fromkeys(path for path in kept if machine.is_file(path)))
