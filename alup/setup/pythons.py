# SPDX-License-Identifier: GPL-2.0-or-later
"""Find a Python that loads PyPI's wheels.

Inkscape's own Python is preferred, because its runs need no second interpreter.  If it can't load wheels
(Inkscape for Windows has a Python of MSYS2), one of python.org or of the system is used.  If there is none,
uv fetches one (`managed.py`).
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import Iterator

from .machine import MACOS, WINDOWS, Machine

# Oldest versions: of Inkscape's Python, because Inkscape 1.2 may come with 3.8; and of other Pythons.
OLDEST, OLDEST_OF_OTHERS = (3, 8), (3, 9)

# Versions with wheels of scipy, the best supported first.
VERSIONS = ("3.12", "3.13", "3.11", "3.10", "3.14", "3.9")

# Program by which a Python describes itself.  Its syntax is old, so that old versions can run it.
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
    """A Python interpreter, as described by itself."""

    path: str
    version: tuple[int, int, int]
    name: str  # cpython, pypy ...
    bits: int
    platform: str  # for instance win-amd64, mingw_x86_64, linux-x86_64
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
    """The Python at a path; None if it is none, or does not start."""
    answer = machine.ask([path, "-E", "-s", "-c", _PROBE])
    try:
        described = json.loads(answer)
        version = tuple(map(int, described["version"]))
        return Python(
            path=path,
            version=(version[0], version[1], version[2]),
            name=described["name"],
            bits=described["bits"],
            platform=described["platform"],
            venv=described["venv"],
            pip=described["pip"],
        )
    except (ValueError, KeyError, TypeError, IndexError):
        return None


def candidates(machine: Machine, own: str) -> Iterator[Python]:
    """Pythons that load wheels, the best first, with one of each version besides Inkscape's.

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
        # Inkscape's own may have any version from OLDEST on.  A second one of the same version is no new try.
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
        # Without the developer tools Apple's python3 only opens a window that offers to install them.
        if not machine.ask(["/usr/bin/xcode-select", "-p"]).strip():
            found = [path for path in found if path != "/usr/bin/python3"]
    return [path for path in found if path]


def _of_windows(machine: Machine) -> list[str]:
    """Paths of Pythons on Windows, from the registry (PEP 514), the launcher and the PATH.

    Those of the Microsoft Store are left out, because Windows redirects their writes into AppData.
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
