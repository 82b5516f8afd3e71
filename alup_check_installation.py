#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Effect: tell whether Reshape can run here, with what, and what to do if it can't.

Needed most when packages are missing, so this file imports nothing but the standard library when it runs.
What has to be tried is tried in processes of their own: first which packages an effect finds (`--packages`),
then Reshape itself on a small drawing.  The answer goes to the standard error, which Inkscape shows in a
window; the exit code is 0 if all is well.
"""

import os
import sys

from alup import startup

startup.forget_working_folder(os.path.dirname(os.path.abspath(__file__)))

import importlib
import json
import platform
import subprocess
import tempfile
from importlib import metadata

import alup
from alup.messages.language import N_
from alup.messages.language import translate as _

# Starting takes a second or two, three times that with a cold disk.
PATIENCE_SECONDS = 60

OPTIONAL = ("qdldl", "libigl")

# Reshape has to put the pinned and moved corners where they are wanted to this part of the drawing.
ERROR_OF_DIAGONAL = 1e-3

# Three points, one of which moves; the small part has none, so that ties join it to the other.
DRAWING = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 120 100"
  xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape">
  <path id="outline" d="M 10,10 H 90 V 60 C 60,80 40,80 10,60 Z"/>
  <path id="part" d="M 40,30 H 60 V 40 H 40 Z"/>
  <circle id="first" inkscape:label="alup:pin" cx="10" cy="10" r="1"/>
  <circle id="second" inkscape:label="alup:pin" cx="10" cy="60" r="1"/>
  <circle id="third" inkscape:label="alup:from A" cx="90" cy="60" r="1"/>
  <circle id="goal" inkscape:label="alup:to A" cx="110" cy="60" r="1"/>
</svg>
"""

WELL = N_("ALUP Reshape {version} can run.")
FAILED = N_("ALUP Reshape {version} can't run.")
REMEDY = N_("To repair it, choose {set_up}")
PYTHON = N_("Python: {version}, {path}")
FOLDER = N_("Extension: {path}")
NO_ENVIRONMENT = N_("Environment: none; the packages of this Python are used")
FITTING = N_("Environment: {path}, made for this Python")
APART = N_("Environment: {path}, made for {python}; effects are started once more under that")
UNFIT = N_("Environment: {path}, made for {python}, which does not run any more")
FOUND = "{name} {version}"
INKEX = "inkex {version}, {path}"
STAND_INS = {
    "qdldl": N_("qdldl: not installed; scipy's SuperLU stands in, slower"),
    "libigl": N_("libigl: not installed; two of the methods for posing need it"),
}
TRIED = N_("Trial: a drawing was reshaped in {seconds:.1f} s")
INEXACT = N_("Trial: a drawing was reshaped, but its handles were missed by {error:.1e} of its size")
BROKEN = N_("Trial: {said}")
SILENT = N_("it ended with the exit code {code} and said nothing")
NO_ROOM = N_("Trial: no drawing could be written ({reason}). Make room on the disk, or correct TMPDIR.")
TOO_LONG = N_("there was no answer after {seconds} s")


def check():
    """The answer as text, and whether Reshape can run."""
    root = os.path.dirname(os.path.abspath(__file__))
    packages, trouble = _packages()
    report = None
    if not trouble:
        report, trouble = _trial(root)
    lines = [_(FAILED if trouble else WELL).format(version=alup.__version__)]
    lines += [*trouble, ""] if trouble else [""]
    lines += [
        _(PYTHON).format(version=platform.python_version(), path=sys.executable),
        _(FOLDER).format(path=root),
        _environment(root),
        *packages,
    ]
    if report:
        lines.append(_(TRIED).format(seconds=report["seconds"]["all"]))
    if trouble and not any(startup.set_up_in_menu() in line for line in trouble):
        lines += ["", _(REMEDY).format(set_up=startup.set_up_in_menu())]
    return "\n".join(lines), not trouble


def _environment(root):
    """Which packages the effects get: as alup/startup.py decides."""
    record = startup.read_record(root)
    if record is None:
        return _(NO_ENVIRONMENT)
    path = os.path.join(root, startup.ENVIRONMENT_NAME)
    if record["tag"] == startup.interpreter_tag():
        return _(FITTING).format(path=path)
    runs = startup.environment_python_runs(root, record)
    return _(APART if runs else UNFIT).format(path=path, python=record["python"])


def _packages():
    """Lines about the packages that an effect finds, and about what is wrong with them."""
    answer, trouble = _run([os.path.abspath(__file__), "--packages"])
    if trouble:
        return [], [trouble]
    found = json.loads(answer)
    inkex = found.pop("inkex")
    lines = [INKEX.format(version=inkex[0], path=inkex[1])]
    return lines + [
        FOUND.format(name=name, version=version) if version else _(STAND_INS[name])
        for name, version in found.items()
    ], []


def _trial(root):
    """Reshape's report on a small drawing, or None, and what was wrong."""
    try:
        with tempfile.TemporaryDirectory() as folder:
            return _tried(root, folder)
    except OSError as error:
        return None, [_(NO_ROOM).format(reason=error.strerror)]


def _tried(root, folder):
    """The same, with files in a folder."""
    drawing, report = os.path.join(folder, "drawing.svg"), os.path.join(folder, "report.json")
    with open(drawing, "w", encoding="utf-8") as file:
        file.write(DRAWING)
    script = os.path.join(root, "alup_reshape.py")
    output = os.path.join(folder, "reshaped.svg")
    trouble = _run([script, f"--output={output}", f"--report={report}", drawing])[1]
    if trouble:
        return None, [_(BROKEN).format(said=trouble)]
    with open(report, encoding="utf-8") as file:
        told = json.load(file)
    error = told["handle_error_of_diagonal"]
    return told, [] if error <= ERROR_OF_DIAGONAL else [_(INEXACT).format(error=error)]


def _run(arguments):
    """What a script prints, and what went wrong: its last words, or nothing."""
    try:
        done = subprocess.run(
            [sys.executable, *arguments],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=PATIENCE_SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return "", _(TOO_LONG).format(seconds=PATIENCE_SECONDS)
    said = done.stderr.decode("utf-8", "replace").strip()
    if done.returncode == 0 and not said:
        return done.stdout.decode("utf-8", "replace"), ""
    return "", said.split("\n")[-1] if said else _(SILENT).format(code=done.returncode)


def tell_packages():
    """As an effect: take the packages that it would, and write what they are to the standard output."""
    startup.prepare(__file__)
    inkex = importlib.import_module("inkex")
    found: dict[str, object] = {"inkex": (inkex.__version__, os.path.dirname(str(inkex.__file__)))}
    for name in (*(name for name in startup.REQUIRED_PACKAGES if name != "inkex"), *OPTIONAL):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = None if name in OPTIONAL else importlib.import_module(name).__version__
    json.dump(found, sys.stdout)


def main():
    if "--packages" in sys.argv:
        tell_packages()
        return 0
    if "--help" in sys.argv:
        sys.stdout.write(__doc__ + "\n")
        return 0
    text, well = check()
    sys.stderr.write(text + "\n")
    return 0 if well else 1


if __name__ == "__main__":
    sys.exit(main())

import inkex


class AlupCheckInstallation(inkex.EffectExtension):
    """Extensions > ALUP Reshape > Check installation, for programs that import effects.

    Inkscape starts the file itself, which then does the same without inkex.
    """

    def effect(self):
        text, well = check()
        if not well:
            raise inkex.AbortExtension(text)
        inkex.errormsg(text)
