# SPDX-License-Identifier: GPL-2.0-or-later
"""The demonstration: reshape an example through Inkscape's command line, without a user or a screen."""

from __future__ import annotations

import base64
import os
import shutil
import struct
import subprocess
import tempfile
from typing import Callable
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

from ..messages.language import translate as _
from . import faults, inkscapes
from .inkscapes import Inkscape
from .machine import LINUX, Machine
from .progress import Progress
from .progress import run as run_program
from .setup_errors import SetupError

_ACTION = "org.alup.alup-reshape.noprefs"

# Time limit of one run of Inkscape, which takes seconds.  An effect that opens a window would wait for ever.
_SECONDS = "180"

# Debian packages.  Inkscape's other effects need the last three as well, but Debian only recommends them.
_INKSCAPE = ["inkscape", "python3-lxml", "python3-numpy", "python3-cssselect"]

_WRAPPER = """#!/bin/sh
'{python}' "$@" 2>>'{folder}/said'
code=$?
echo $code >'{folder}/code'
exit $code
"""

_PREFERENCES = """<inkscape version="1"><group id="options"><group id="boot" enabled="0"/></group>
<group id="extensions" python-interpreter={wrapper}/></inkscape>
"""


def example(root: str) -> str:
    """Path of the example drawing.  Raises SetupError if the checkout is incomplete."""
    path = os.path.join(root, "examples", "truck.svg")
    if not os.path.isfile(path):
        text = _("{path} is missing: run the demonstration from a complete checkout")
        raise SetupError(text.format(path=path))
    return path


def install_missing_programs(machine: Machine, dry_run: bool, say: Callable[[str], None]) -> None:
    """Install Inkscape and a virtual screen by apt-get, if they are missing and the user may do so."""
    missing = [] if inkscapes.find_program(machine) else list(_INKSCAPE)
    missing += [
        package
        for program, package in (("xvfb-run", "xvfb"), ("xauth", "xauth"))
        if not machine.which(program)
    ]
    if not missing:
        return
    names = " ".join(missing)
    if dry_run:
        say(_("Would install by apt-get: {programs}").format(programs=names))
        return
    if machine.system != LINUX or not machine.which("apt-get"):
        text = _("these are missing, and this system has no apt-get: {programs}")
        raise SetupError(text.format(programs=names))
    if os.geteuid() == 0:
        as_root = ["env"]
    elif machine.which("sudo") and subprocess.call(["sudo", "-n", "true"], stderr=subprocess.DEVNULL) == 0:
        as_root = ["sudo", "-n", "env"]
    else:
        text = _("these programs are missing; install them, then try again: sudo apt-get install {programs}")
        raise SetupError(text.format(programs=names))
    say(_("Installing by apt-get: {programs} ...").format(programs=names))
    apt = [*as_root, "DEBIAN_FRONTEND=noninteractive", "apt-get", "-qq"]
    for command in (["update"], ["install", "--yes", "--no-install-recommends", *missing]):
        code, words = run_program([*apt, *command], machine.environment(), Progress())
        if code:
            text = _("apt-get could not install {programs}: {said}")
            raise SetupError(text.format(programs=names, said=faults.last_line(words)))


def run(machine: Machine, root: str, inkscape: Inkscape, say: Callable[[str], None]) -> None:
    """Write alup-demo.svg and alup-demo.png into the working folder.  Raises SetupError."""
    drawing = example(root)
    say(_("Reshaping {path} in Inkscape ...").format(path=drawing))
    with tempfile.TemporaryDirectory() as folder:
        stage = _Stage(machine, inkscape, folder)
        after = os.path.join(folder, "after.svg")
        actions = f"{_ACTION};export-filename:{after};export-do"
        command = ["xvfb-run", "-a", inkscape.program, f"--app-id-tag=alup{os.getpid()}", "--batch-process"]
        stage.run([*command, "--actions=" + actions, drawing], _("Inkscape failed"))
        stage.heard()
        if not os.path.isfile(after):
            raise stage.failed(_("Inkscape wrote nothing"))
        old, new = _paths(drawing), _paths(after)
        changed = [name for name in old if new.get(name, old[name]) != old[name]]
        if not changed:
            raise stage.failed(_("no path was changed"))
        say(_("{count} of {all} paths were reshaped.").format(count=len(changed), all=len(old)))
        both = os.path.join(folder, "both.svg")
        with open(both, "w", encoding="utf-8") as file:
            file.write(_side_by_side([stage.picture(drawing, "before"), stage.picture(after, "after")]))
        shutil.copy(stage.picture(both, "both", size=None), "alup-demo.png")
        shutil.copy(after, "alup-demo.svg")
    text = _("Look at alup-demo.png (before and after) and alup-demo.svg in {folder}")
    say(text.format(folder=os.getcwd()))


class _Stage:
    """A temporary home and profile for Inkscape that share only the extensions folder.

    Messages of the effect go to a file instead of a window.
    """

    def __init__(self, machine: Machine, inkscape: Inkscape, folder: str) -> None:
        self.inkscape, self.folder, self.words = inkscape, folder, ""
        for name in ("home", "profile"):
            os.mkdir(os.path.join(folder, name))
        os.symlink(inkscape.extensions, os.path.join(folder, "profile", "extensions"))
        wrapper = os.path.join(folder, "python")
        with open(wrapper, "w", encoding="utf-8") as file:
            file.write(_WRAPPER.format(python=inkscape.python, folder=folder))
        os.chmod(wrapper, 0o700)
        with open(os.path.join(folder, "profile", "preferences.xml"), "w", encoding="utf-8") as file:
            file.write(_PREFERENCES.format(wrapper=quoteattr(wrapper)))
        home = os.path.join(folder, "home")
        self.environment = machine.environment(
            HOME=home,
            INKSCAPE_PROFILE_DIR=os.path.join(folder, "profile"),
            TMPDIR=folder,
            XDG_CONFIG_HOME=home,
            XDG_CACHE_HOME=home,
            XDG_DATA_HOME=home,
            DBUS_SESSION_BUS_ADDRESS="disabled:",
        )

    def run(self, command: list[str], reason: str) -> None:
        code, self.words = run_program(
            ["timeout", "-k", "10", _SECONDS, *command], self.environment, Progress()
        )
        if code:
            raise self.failed(reason)

    def heard(self) -> None:
        """Raise SetupError unless the effect ran without messages."""
        said = self._text("said")
        if not self._text("code"):
            raise self.failed(_("Inkscape did not run the effect"))
        if self._text("code") != "0" or said:
            self.words = said
            raise self.failed(_("the effect complained"))

    def picture(self, drawing: str, name: str, size: int | None = 640) -> str:
        """Render a drawing; returns the path of the picture."""
        path = os.path.join(self.folder, name + ".png")
        options = [f"--export-width={size}", "--export-background=white"] if size else []
        command = [
            self.inkscape.program,
            "--export-area-page",
            *options,
            "--export-filename=" + path,
            drawing,
        ]
        self.run(command, _("no picture could be drawn"))
        if not os.path.isfile(path):
            raise self.failed(_("no picture could be drawn"))
        return path

    def failed(self, reason: str) -> SetupError:
        text = _("the demonstration failed: {reason} ({said})")
        return SetupError(text.format(reason=reason, said=faults.last_line(self.words)))

    def _text(self, name: str) -> str:
        path = os.path.join(self.folder, name)
        if not os.path.exists(path):
            return ""
        with open(path, encoding="utf-8", errors="replace") as file:
            return file.read().strip()


def _paths(file: str) -> dict[str, str]:
    found = ElementTree.parse(file).iter("{http://www.w3.org/2000/svg}path")
    return {element.get("id", ""): element.get("d", "") for element in found}


def _side_by_side(pictures: list[str]) -> str:
    """An SVG text with two pictures side by side under their titles."""
    parts, x, height = [], 0, 0
    for title, path in zip(("before", "after"), pictures):
        with open(path, "rb") as file:
            png = file.read()
        size = struct.unpack(">II", png[16:24])
        data = base64.b64encode(png).decode()
        parts.append(
            f'<text x="{x + 20}" y="32" font-family="sans-serif" font-size="22">{title}</text>'
            f'<image x="{x + 20}" y="48" width="{size[0]}" height="{size[1]}"'
            f' xlink:href="data:image/png;base64,{data}"/>'
        )
        x, height = x + size[0] + 40, max(height, size[1])
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
        f' width="{x}" height="{height + 68}"><rect width="{x}" height="{height + 68}" fill="white"/>'
        f"{''.join(parts)}</svg>"
    )
