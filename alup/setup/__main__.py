# SPDX-License-Identifier: GPL-2.0-or-later
"""The installer's command line, which install.sh and install.cmd start: `python3 alup/setup --help`."""

from __future__ import annotations

import os
import sys

if not __package__:
    # Started as a folder, Python puts it on the path.  Its modules must not hide others of the same names.
    here = os.path.dirname(os.path.abspath(__file__))
    sys.path[:] = [entry for entry in sys.path if os.path.realpath(entry or ".") != os.path.realpath(here)]
    sys.path.insert(0, os.path.dirname(os.path.dirname(here)))

import argparse
import signal
import tempfile

from alup import startup
from alup.messages.language import translate as _
from alup.setup import demo, environment_plan, inkscapes, install, managed
from alup.setup.inkscapes import APPIMAGE, BUNDLE, FLATPAK, SNAP, STORE, Inkscape
from alup.setup.machine import WINDOWS, Machine
from alup.setup.progress import Progress
from alup.setup.setup_errors import Cancelled, SetupError

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

DESCRIPTION = """\
Without an option: install the extension into Inkscape's extensions folder of this user.

INKSCAPE_COMMAND names the inkscape to use when it is not the one that is found;
INKSCAPE_PROFILE_DIR is respected as Inkscape does. Nothing is written outside the extensions
folder. docs/platforms.md says what is different with a Flatpak, a Snap, an AppImage, and with an
Inkscape of macOS or Windows."""


_MODES = {
    "demo": "install, then reshape examples/truck.svg through Inkscape's command line; leaves alup-demo.svg"
    " and alup-demo.png in the current folder (Linux; Inkscape and Xvfb come by apt-get when permitted)",
    "check": "only tell whether the installed extension can run",
    "uninstall": "remove the extension with its environment",
}


class Terminal(Progress):
    """Prints each step once, as a line."""

    def __init__(self) -> None:
        self._last = ""

    def step(self, text: str, _done: float) -> None:
        if text != self._last:
            say(text)
        self._last = text


def say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def main() -> int:
    options = _options()
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # a Windows console may lack letters
    machine = Machine()
    # On these signals the installation is undone as well.
    for name in ("SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), _leave)
    try:
        _temporary_folder()
        return _do(machine, options)
    except SetupError as error:
        sys.stderr.write(f"{_script(machine)}: {error}\n")
        return 1
    except (Cancelled, KeyboardInterrupt):
        sys.stderr.write(_("Cancelled; nothing was changed.") + "\n")
        return 128 + signal.SIGINT


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="install.cmd" if os.name == "nt" else "install.sh",
        usage="%(prog)s [--demo | --check | --uninstall] [--wheels FOLDER] [--yes] [--dry-run]",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    mode = parser.add_mutually_exclusive_group()
    for name, text in _MODES.items():
        mode.add_argument("--" + name, dest="mode", action="store_const", const=name, help=text)
    parser.add_argument(
        "--wheels", metavar="FOLDER", default="", help="take packages from this folder, offline"
    )
    parser.add_argument(
        "--yes", action="store_true", help="agree to a Python by uv where none that is there will do"
    )
    parser.add_argument("--dry-run", action="store_true", help="only tell what would be done")
    options, unknown = parser.parse_known_args()
    if unknown:
        parser.print_usage(sys.stderr)
        sys.stderr.write(f"{parser.prog}: unknown option {unknown[0]}\n")
        sys.exit(1)
    options.mode = options.mode or "install"
    return options


def _leave(number: int, _frame: object) -> None:
    sys.exit(128 + number)


def _script(machine: Machine) -> str:
    return "install.cmd" if machine.system == WINDOWS else "install.sh"


def _temporary_folder() -> None:
    try:
        # tempfile by itself would fall back to the working folder.
        if "TMPDIR" in os.environ and not os.path.isdir(os.environ["TMPDIR"]):
            raise FileNotFoundError
        with tempfile.TemporaryFile():
            pass
    except OSError:
        raise SetupError(_("no temporary folder; make room on the disk, or correct TMPDIR")) from None


def _do(machine: Machine, options: argparse.Namespace) -> int:
    if options.mode == "uninstall" and not inkscapes.find_program(machine):
        return _uninstall(_without_inkscape(machine), options.dry_run)
    if options.mode == "demo":
        demo.example(ROOT)
        inkscape = inkscapes.find(machine) if inkscapes.find_program(machine) else None
        if inkscape is None or inkscape.kind not in (FLATPAK, SNAP):
            demo.install_missing_programs(machine, options.dry_run, say)
        if inkscape is None and options.dry_run:
            say(
                _("Would then install the extension, and reshape {example}").format(
                    example="examples/truck.svg"
                )
            )
            return 0
    inkscape = inkscapes.find(machine)
    if inkscape.kind == FLATPAK:
        return _flatpak(machine, inkscape, options)
    if inkscape.kind in (SNAP, STORE):
        _cannot(machine, inkscape)
    if options.mode == "uninstall":
        return _uninstall(inkscape.target, options.dry_run)
    _introduce(inkscape)
    if options.dry_run:
        return _tell(machine, inkscape, options)
    if options.mode == "check":
        install.check(machine, inkscape)
        say(install.describe(machine, inkscape))
        say(_("The extension can run."))
        return 0
    _install(machine, inkscape, options)
    if options.mode == "demo":
        demo.run(machine, ROOT, inkscape, say)
    return 0


def _install(machine: Machine, inkscape: Inkscape, options: argparse.Namespace) -> None:
    _agree(machine, inkscape, options)
    left_out = install.install(machine, ROOT, inkscape, options.wheels, Terminal())
    for package in left_out:
        text = _("Note: {package} is not to be had for this Python; something slower or simpler stands in.")
        say(text.format(package=package))
    say(install.describe(machine, inkscape))
    say(_("Start Inkscape anew, then: Extensions > ALUP Reshape"))


def _agree(machine: Machine, inkscape: Inkscape, options: argparse.Namespace) -> None:
    """Ask before a Python is fetched by uv.  Raises SetupError if the user does not agree."""
    if (
        options.yes
        or environment_plan.plan(machine, inkscape.target, inkscape.python, options.wheels).python is not None
    ):
        return
    text = _(
        "No Python here can load the packages. Install Python {version} from python.org, or let one be"
        " downloaded into the extension's folder."
    ).format(version=managed.VERSION)
    if not sys.stdin.isatty():
        raise SetupError(text + " " + _("To agree to that: --yes"))
    say(text)
    if input(_("Download one? [y/n] ")).strip().lower()[:1] not in ("y", "j"):
        raise Cancelled


def _tell(machine: Machine, inkscape: Inkscape, options: argparse.Namespace) -> int:
    """Print what an installation would do; returns the exit code."""
    if options.mode == "check":
        text = _("Would check {folder} with {python}")
        say(text.format(folder=inkscape.target, python=inkscape.python or "Inkscape"))
        return 0
    say(_("Would install into {folder}").format(folder=inkscape.target))
    say(environment_plan.plan(machine, inkscape.target, inkscape.python, options.wheels).text())
    if options.mode == "demo":
        say(_("Would reshape {example} and write alup-demo.svg and alup-demo.png here").format(
            example="examples/truck.svg"
        ))  # fmt: skip
    return 0


def _uninstall(target: str, dry_run: bool) -> int:
    if dry_run:
        say(_("Would remove {folder}").format(folder=target))
    elif install.uninstall(target):
        say(_("Removed {folder}").format(folder=target))
    else:
        say(_("Nothing to remove: {folder} is not there.").format(folder=target))
    return 0


def _without_inkscape(machine: Machine) -> str:
    """The extension's folder if Inkscape itself has already been removed."""
    variables, join = machine.variables, machine.path.join
    profile = variables.get("INKSCAPE_PROFILE_DIR")
    if not profile and machine.system == WINDOWS:
        profile = join(variables.get("APPDATA", machine.home), "inkscape")
    profile = profile or join(variables.get("XDG_CONFIG_HOME") or join(machine.home, ".config"), "inkscape")
    return str(join(profile, "extensions", inkscapes.NAME))


def _flatpak(machine: Machine, inkscape: Inkscape, options: argparse.Namespace) -> int:
    place = machine.path.join(
        machine.home,
        ".var",
        "app",
        inkscapes.FLATPAK_NAME,
        "config",
        "inkscape",
        "extensions",
        inkscapes.NAME,
    )
    text = _(
        "Inkscape is a Flatpak ({program}). The Python in its sandbox will run the extension, so the"
        " installer goes on there; the extension's place is {folder}"
    )
    say(text.format(program=inkscape.program, folder=place))
    if options.mode == "demo":
        text = _(
            "the demonstration needs a display of its own, which the sandbox has not; run sh install.sh, then"
            " Extensions > ALUP Reshape > Reshape on {example}"
        )
        raise SetupError(text.format(example="examples/truck.svg"))
    given = [] if options.mode == "install" else ["--" + options.mode]
    given += ["--wheels", os.path.abspath(options.wheels)] if options.wheels else []
    given += ["--dry-run"] if options.dry_run else []
    return install.go_on_in_flatpak(machine, ROOT, given)


def _cannot(machine: Machine, inkscape: Inkscape) -> None:
    """Raise SetupError for Inkscapes that no command can enter; the archive and *Set up* work there."""
    if inkscape.kind == STORE:
        text = _(
            "Inkscape is an app of the Microsoft Store ({program}), whose folder only it can write to."
            " Unpack the archive into the folder that it names under Edit > Preferences > System > User"
            " extensions, then choose {set_up}"
        )
        raise SetupError(text.format(program=inkscape.program, set_up=startup.set_up_in_menu()))
    text = _(
        "Inkscape is a Snap ({program}). The Python in it will run the extension; the extension's place is"
        " below {folder}, as the Snap decides."
    )
    folder = machine.path.join(machine.home, "snap", "inkscape", "current", ".config", "inkscape")
    say(text.format(program=inkscape.program, folder=folder))
    text = _(
        "unpack the archive into the folder that Inkscape names under Edit > Preferences > System > User"
        " extensions, then choose {set_up}; or open a shell in the Snap by 'snap run --shell inkscape', and"
        " in it run: sh '{script}'"
    )
    raise SetupError(text.format(set_up=startup.set_up_in_menu(), script=os.path.join(ROOT, "install.sh")))


def _introduce(inkscape: Inkscape) -> None:
    if inkscape.kind == APPIMAGE:
        text = _(
            "Inkscape is an AppImage ({program}). Its Python is there only while it runs; the one below,"
            " for which the environment is made, will run the extension."
        )
        say(text.format(program=inkscape.program))
    elif inkscape.kind == BUNDLE:
        text = _("Inkscape is a macOS application ({program}). Its Python starts the extension.")
        say(text.format(program=inkscape.program))


if __name__ == "__main__":
    sys.exit(main())
