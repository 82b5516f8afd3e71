# SPDX-License-Identifier: GPL-2.0-or-later
"""Find the user's Inkscape, the folder of its extensions, its inkex and its Python.

The way in which Inkscape was installed (its kind) determines which Python runs the extension.
"""

from __future__ import annotations

import os
import re
import tempfile
from dataclasses import dataclass
from xml.sax.saxutils import unescape

from ..messages.language import translate as _
from .machine import LINUX, MACOS, WINDOWS, Machine
from .setup_errors import SetupError

NAME = "alup-reshape"
FLATPAK_NAME = "org.inkscape.Inkscape"

SYSTEM, FLATPAK, SNAP, APPIMAGE, BUNDLE, STORE = "system", "flatpak", "snap", "appimage", "bundle", "store"

# The first key is written by Inkscape's .msi and .exe; the folder is "" or InstallLocation of one of the
# others.
_APP_PATHS = r"Software\Microsoft\Windows\CurrentVersion\App Paths\inkscape.exe"
_FOLDER_KEYS = (
    (r"Software\Inkscape\Inkscape", ""),
    (r"Software\Inkscape\Inkscape", "InstallLocation"),
    (r"Software\Microsoft\Windows\CurrentVersion\Uninstall\Inkscape", "InstallLocation"),
)

# Paths of the Python in the application of macOS, which its launcher puts on the PATH.
_BUNDLED_PYTHONS = (
    "../Resources/bin/python3",
    "../Frameworks/Python.framework/Versions/Current/bin/python3",
    "python3",
)


@dataclass(frozen=True)
class Inkscape:
    """An Inkscape on this machine."""

    program: str
    kind: str
    profile: str  # its user data directory; empty if only its sandbox knows it
    inkex: str  # folder of its inkex; empty if it exists only while Inkscape runs
    python: str  # the Python that it starts for effects; empty if it can't be found from outside

    @property
    def extensions(self) -> str:
        return os.path.join(self.profile, "extensions")

    @property
    def target(self) -> str:
        """The folder of the installed extension."""
        return os.path.join(self.extensions, NAME)


def find(machine: Machine) -> Inkscape:
    """The Inkscape that INKSCAPE_COMMAND names, or the first one found.

    Raises SetupError if there is none, or if it does not tell its folder.
    """
    program = find_program(machine)
    if not program:
        raise SetupError(_not_found(machine))
    kind = _kind(machine, program)
    if kind in (FLATPAK, SNAP):
        return Inkscape(program, kind, "", "", "")
    profile = _profile(machine, program)
    kind = _kind_by_profile(machine, profile, kind)
    if kind in (FLATPAK, SNAP):
        return Inkscape(program, kind, profile, "", "")
    data = _ask(machine, program, "--system-data-directory")[0]
    inkex = machine.path.join(data, "extensions") if data else ""
    if not inkex or not machine.is_file(machine.path.join(inkex, "inkex", "__init__.py")):
        inkex = ""  # the inkex of an AppImage exists only while it runs
    return Inkscape(program, kind, profile, inkex, own_python(machine, program, kind, profile))


def find_program(machine: Machine) -> str:
    """Path of Inkscape's program; empty if there is none."""
    named = machine.variables.get("INKSCAPE_COMMAND")
    if named:
        return machine.which(named) or (os.path.abspath(named) if machine.is_program(named) else "")
    return machine.which("inkscape") or next(filter(machine.is_program, _usual_paths(machine)), "")


def _usual_paths(machine: Machine) -> list[str]:
    join, variables, home = machine.path.join, machine.variables, machine.home
    if machine.system == MACOS:
        roots = ("/Applications", join(home, "Applications"))
        return [join(root, "Inkscape.app", "Contents", "MacOS", "inkscape") for root in roots]
    if machine.system == WINDOWS:
        paths = list(machine.registry(_APP_PATHS))
        folders = [text for key, value in _FOLDER_KEYS for text in machine.registry(key, value)]
        names = ("ProgramW6432", "ProgramFiles", "ProgramFiles(x86)")
        folders += [join(variables[name], "Inkscape") for name in names if variables.get(name)]
        if variables.get("LOCALAPPDATA"):
            folders.append(join(variables["LOCALAPPDATA"], "Programs", "Inkscape"))
        for folder in folders:
            paths += [join(folder, "bin", "inkscape.exe"), join(folder, "inkscape.exe")]
        if variables.get("LOCALAPPDATA"):
            paths.append(join(variables["LOCALAPPDATA"], "Microsoft", "WindowsApps", "inkscape.exe"))
        return paths
    data = variables.get("XDG_DATA_HOME") or join(home, ".local", "share")
    exported = [join(place, "flatpak", "exports", "bin", FLATPAK_NAME) for place in (data, "/var/lib")]
    return [*exported, "/snap/bin/inkscape"]


def appimages(machine: Machine) -> list[str]:
    """Paths of AppImages of Inkscape in the folders where they are usually kept."""
    folders = ("Applications", "bin", ".local/bin", "Downloads", "Desktop")
    patterns = [machine.path.join(machine.home, folder, "*nkscape*.[Aa]pp[Ii]mage") for folder in folders]
    return (
        [found for pattern in patterns for found in machine.glob(pattern)] if machine.system == LINUX else []
    )


def _not_found(machine: Machine) -> str:
    found = appimages(machine)
    if found:
        text = _(
            "Inkscape was not found, but there is an AppImage; for it: INKSCAPE_COMMAND='{path}' sh"
            " install.sh"
        )
        return text.format(path=found[0])
    if machine.system == LINUX:
        return _(
            "Inkscape was not found; install it (on Debian: sudo apt-get install inkscape) or set"
            " INKSCAPE_COMMAND"
        )
    return _("Inkscape was not found; install it from inkscape.org or set INKSCAPE_COMMAND")


def in_sandbox(machine: Machine) -> bool:
    """Whether this program runs within the sandbox of Inkscape's Flatpak or Snap."""
    return (
        machine.variables.get("FLATPAK_ID") == FLATPAK_NAME
        or machine.variables.get("SNAP_NAME") == "inkscape"
    )


def _kind(machine: Machine, program: str) -> str:
    if in_sandbox(machine):
        return SYSTEM
    slashed = program.replace("\\", "/")
    if machine.system == WINDOWS:
        return STORE if "/WindowsApps/" in slashed else SYSTEM
    if slashed.endswith(f"/exports/bin/{FLATPAK_NAME}"):
        return FLATPAK
    if slashed.endswith("/snap/bin/inkscape"):
        return SNAP
    if slashed.lower().endswith(".appimage"):
        return APPIMAGE
    return BUNDLE if ".app/Contents/MacOS/" in slashed else SYSTEM


def _kind_by_profile(machine: Machine, profile: str, kind: str) -> str:
    """The kind by the profile's path, because a script named inkscape may start a Flatpak or a Snap."""
    if in_sandbox(machine):
        return kind
    if f"/.var/app/{FLATPAK_NAME}/" in profile:
        return FLATPAK
    return SNAP if "/snap/inkscape/" in profile else kind


def _profile(machine: Machine, program: str) -> str:
    """The user data directory, as Inkscape itself reports it."""
    given = machine.variables.get("INKSCAPE_PROFILE_DIR")
    if given:
        return given if machine.path.isabs(given) else os.path.abspath(given)
    answer, home = _ask(machine, program, "--user-data-directory")
    if home and answer.startswith(home + "/config/"):
        config = machine.variables.get("XDG_CONFIG_HOME") or machine.path.join(machine.home, ".config")
        return config + answer[len(home + "/config") :]
    if home and answer.startswith(home + "/home/"):
        return machine.home + answer[len(home + "/home") :]
    if not machine.path.isabs(answer):
        text = _("{program} does not tell its user data directory; Inkscape 1.0 or later is needed")
        raise SetupError(text.format(program=program))
    return answer


def _ask(machine: Machine, program: str, option: str) -> tuple[str, str]:
    """The last line of Inkscape's answer, and the temporary home in which it was started.

    Inkscape makes its profile even if it is only asked for a folder.  The temporary home keeps that away from
    the user's.
    """
    if machine.system == WINDOWS:
        # inkscape.exe is a graphical program and does not write to the console; inkscape.com does.
        console = re.sub(r"\.exe$", ".com", program, flags=re.IGNORECASE)
        return _last_line(machine.ask([console if machine.is_file(console) else program, option])), ""
    with tempfile.TemporaryDirectory() as folder:
        for name in ("home", "config"):
            os.mkdir(os.path.join(folder, name))
        home, config = folder + "/home", folder + "/config"
        private = machine.ask([program, option], HOME=home, XDG_CONFIG_HOME=config, INKSCAPE_PROFILE_DIR=None)
        answer = private or machine.ask([program, option], INKSCAPE_PROFILE_DIR=None)
        return _last_line(answer), folder


def _last_line(text: str) -> str:
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else ""


def version(machine: Machine, program: str) -> str:
    """Inkscape's name and version, for instance "Inkscape 1.2.2"."""
    return " ".join(_ask(machine, program, "--version")[0].split()[:2])


def own_python(machine: Machine, program: str, kind: str, profile: str) -> str:
    """Path of Inkscape's Python, searched as Inkscape does: preferences, its own folder, the PATH."""
    preferences = machine.read(machine.path.join(profile, "preferences.xml"))
    chosen = re.search(r'\bpython-interpreter="([^"]*)"', preferences)
    found = machine.which(unescape(chosen[1], {"&quot;": '"'})) if chosen and chosen[1] else ""
    folder = machine.path.dirname(machine.real(program))
    if found or kind == APPIMAGE:
        return found or machine.which("python3") or machine.which("python")
    if kind == BUNDLE:
        paths = [machine.path.normpath(machine.path.join(folder, place)) for place in _BUNDLED_PYTHONS]
        return next(filter(machine.is_program, paths), "")
    if machine.system == WINDOWS:
        paths = [machine.path.join(folder, name) for name in ("python.exe", "python3.exe")]
        return next(filter(machine.is_program, paths), "")
    return machine.which("python3", folder) or machine.which("python", folder)
