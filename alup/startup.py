# SPDX-License-Identifier: GPL-2.0-or-later
"""Give a run its packages, whichever Python Inkscape has started.

Inkscape's own Python has inkex, mostly numpy and lxml, never scipy. `alup/setup/` therefore puts a
private environment beside the installed extension, and records in `environment.json` which Python
it was made for:

    <extensions folder>/alup-reshape/
        alup_reshape.py   alup/   install.sh
        environment.json
        venv/

`prepare()` runs before anything else of an effect script. It

1. takes the environment's packages into this process when they were made for this very Python,
2. else starts the script again under the environment's own Python,
3. else makes do with what this Python has (a checkout in development, a broken environment),
4. else says in one sentence what is missing and what to do, and leaves.

Then it imports of scipy what runs need, and no more (`alup.scipy_imports`).

inkex is never part of the environment: it is the copy of the Inkscape that runs the effect. Its
folder holds a hundred other modules (a `triangle.py` for one, also the name of a package),
so it comes after the environment's packages on `sys.path`.

Only `os` and `sys` are imported at the top, both already loaded when Python has started: the rest of
the standard library comes after the folder the user happens to be in has been taken off `sys.path`.
Even `from __future__ import annotations` would be an import from there, so what Python 3.8 could not
evaluate of the annotations is quoted.
"""

import os
import sys

RECORD_NAME = "environment.json"
ENVIRONMENT_NAME = "venv"

# What a run can't do without; qdldl makes it faster but has a stand-in, libigl serves two of the methods.
REQUIRED_PACKAGES = ("numpy", "scipy", "lxml", "cssselect", "tinycss2", "inkex")

# Set for the second start only: the folder of Inkscape's inkex, or empty when it was not known.
# Its presence also says that there must be no third start.
HANDED_OVER = "ALUP_RESHAPE_INKEX"

# Asking a program for its name takes 0.02-0.2 s. Only one that is broken or on a dead network drive
# takes longer, and then the sentence about what is missing serves better than more patience.
ANSWER_SECONDS = 20

# The macOS application is not on PATH.
MACOS_INKSCAPE = "/Applications/Inkscape.app/Contents/MacOS/inkscape"


def prepare(script_file: str) -> None:
    """Make the required packages importable, or start the script again, or leave with a sentence.

    script_file : `__file__` of the effect script, which lies beside the folder `alup/`.
    """
    # What is solved is sparse. A thread for each core would only take 40 MB of address space, which a
    # machine of many cores with a limit on memory doesn't have.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    script = os.path.abspath(script_file)
    root = os.path.dirname(script)
    if _is_the_program(script):
        import gc

        # An effect lives for a second: looking for cycles in what it imports takes a tenth of that.
        gc.disable()
    forget_working_folder(root)
    handed_over = os.environ.pop(HANDED_OVER, None)
    record = read_record(root)
    inkex_folder, stale = "", None
    if record is not None:
        inkex_folder = handed_over or inkex_folder_of_running_inkscape(root) or _recorded_inkex(record)
        if record["tag"] == interpreter_tag():
            _use_environment(root, os.path.join(root, record["packages"]), inkex_folder)
        elif handed_over is None and environment_python_runs(root, record):
            _start_again(environment_python(root), script, inkex_folder)
        else:
            stale = record["python"]
    if not _is_importable("inkex"):
        inkex_folder = inkex_folder or ask_inkscape_for_inkex()
        if inkex_folder:
            sys.path.append(inkex_folder)
    missing = missing_packages()
    if missing:
        _leave(missing, stale)
    from . import scipy_imports

    scipy_imports.prepare()


def _is_the_program(script: str) -> bool:
    """Whether this process runs the script; a program that imports it has a life of its own."""
    main = getattr(sys.modules.get("__main__"), "__file__", None)
    return main is not None and os.path.abspath(main) == script


def missing_packages() -> "list[str]":
    """Names of the required packages that this Python cannot find; nothing is imported."""
    return [name for name in REQUIRED_PACKAGES if not _is_importable(name)]


def write_record(root: str, inkex_folder: str) -> None:
    """Record the environment below `root`; called by the installer under the environment's Python."""
    import json
    import sysconfig

    packages = sysconfig.get_paths()["purelib"]
    record = {
        "tag": interpreter_tag(),
        "python": _python_name(),
        "packages": os.path.relpath(os.path.realpath(packages), os.path.realpath(root)),
        "inkex": inkex_folder,
    }
    with open(os.path.join(root, RECORD_NAME), "w", encoding="utf-8") as file:
        json.dump(record, file, indent=2)
        file.write("\n")


def read_record(root: str) -> "dict[str, str] | None":
    """The record the installer left, None where there is none or it cannot be understood.

    An unreadable one counts as none: then either this Python has all packages, or the sentence
    about the missing ones names the remedy, which is the same.
    """
    import json

    try:
        with open(os.path.join(root, RECORD_NAME), encoding="utf-8") as file:
            record = json.load(file)
    except (OSError, ValueError):
        return None
    fields = ("tag", "python", "packages", "inkex")
    if not isinstance(record, dict) or not all(isinstance(record.get(field), str) for field in fields):
        return None
    return record


def interpreter_tag() -> str:
    """What compiled packages depend on: implementation, version, build flags, system, processor."""
    # sysconfig and platform would say the same, for ten times this module's time.
    machine = os.uname().machine if hasattr(os, "uname") else os.environ.get("PROCESSOR_ARCHITECTURE", "")
    flags = getattr(sys, "abiflags", "")
    # MSYS2's Python on Windows differs from python.org's only in its compiler.
    compiler = "-gcc" if os.name == "nt" and "GCC" in sys.version else ""
    return f"{sys.implementation.cache_tag}{flags}-{sys.platform}-{machine}{compiler}"


def _python_name() -> str:
    return "Python {}.{}".format(*sys.version_info[:2])


def forget_working_folder(root: str) -> None:
    """Take the working folder off sys.path: a numpy.py beside a drawing must not be our numpy.

    Python itself adds it for an empty entry of PYTHONPATH, and folders in it for relative ones. The
    extension's own folder stays: it is the working folder when Inkscape starts the script.
    """
    variable = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    try:
        unwanted = {os.path.realpath(entry) for entry in ("", *variable) if not os.path.isabs(entry)}
    except FileNotFoundError:  # the folder was deleted meanwhile; nothing can be imported from it
        unwanted = set()
    unwanted -= {os.path.realpath(entry) for entry in (root, sys.prefix, sys.base_prefix)}
    sys.path[:] = [entry for entry in sys.path if os.path.realpath(entry) not in unwanted]


def _recorded_inkex(record: "dict[str, str]") -> str:
    return record["inkex"] if _holds_inkex(record["inkex"]) else ""


def _holds_inkex(folder: str) -> bool:
    return os.path.isfile(os.path.join(folder, "inkex", "__init__.py"))


def inkex_folder_of_running_inkscape(root: str) -> str:
    """Folder of inkex in the Inkscape that started this script, empty when none did.

    Inkscape puts into PYTHONPATH the user's extensions folder, its own one, then what was there.
    What was there may be anything, so only the entry after the user's folder is believed.
    """
    extensions = os.path.realpath(os.path.dirname(root))
    entries = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    for entry, following in zip(entries, entries[1:]):
        if os.path.realpath(entry) == extensions and _holds_inkex(following):
            return following
    return ""


def _use_environment(root: str, packages: str, inkex_folder: str) -> None:
    """Put the environment's packages in front, and inkex behind them in place of PYTHONPATH.

    Without inkex_folder, PYTHONPATH is left as it is: it may be where inkex comes from.
    """
    if inkex_folder:
        variable = os.environ.get("PYTHONPATH", "").split(os.pathsep)
        unwanted = {os.path.realpath(entry) for entry in variable if entry} - {os.path.realpath(root)}
        sys.path[:] = [entry for entry in sys.path if os.path.realpath(entry) not in unwanted]
        # Before the site folders, as Inkscape has it: another inkex may have been installed there.
        first_site = next((i for i, entry in enumerate(sys.path) if _is_site_folder(entry)), len(sys.path))
        sys.path.insert(first_site, inkex_folder)
    sys.path[:] = [packages] + [entry for entry in sys.path if entry != packages]


def _is_site_folder(entry: str) -> bool:
    return os.path.basename(entry) in ("site-packages", "dist-packages")


def environment_python(root: str, name: str = ENVIRONMENT_NAME) -> str:
    """Path of the Python of the environment below `root`."""
    parts = ("Scripts", "python.exe") if os.name == "nt" else ("bin", "python3")
    return os.path.join(root, name, *parts)


def environment_python_runs(root: str, record: "dict[str, str]") -> bool:
    """Whether the environment's Python starts and still is the one the packages were made for.

    After an upgrade of the system the same link starts a newer Python, which does not see them.
    """
    program = "import sys; print(sys.implementation.cache_tag)"
    code, answer = _answer([environment_python(root), "-I", "-S", "-c", program])
    return code == 0 and bool(answer.strip()) and record["tag"].startswith(answer.strip())


def _answer(command: "list[str]") -> "tuple[int | None, str]":
    """The exit code of a program, None if it can't be run or takes too long, and what it prints."""
    import subprocess

    try:
        answer = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=ANSWER_SECONDS,
            check=False,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
    except (OSError, subprocess.TimeoutExpired):
        return None, ""
    return answer.returncode, answer.stdout.decode("utf-8", "replace")


def _start_again(python: str, script: str, inkex_folder: str) -> None:
    """Replace this process by the same script under the environment's Python; does not return.

    -E and -s keep out what was meant for the other Python; -X utf8 stands for PYTHONIOENCODING,
    which Inkscape sets and -E hides.
    """
    command = [python, "-E", "-s", "-X", "utf8", script, *sys.argv[1:]]
    environment = dict(os.environ, **{HANDED_OVER: inkex_folder})
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            stream.flush()
    if os.name == "nt":  # there exec returns to the caller at once, and Inkscape would read nothing
        import subprocess

        # Without a black window the program gets no streams by itself; what is None here it does without.
        nothing = subprocess.DEVNULL
        code = subprocess.call(
            command,
            env=environment,
            stdin=sys.stdin or nothing,
            stdout=sys.stdout or nothing,
            stderr=sys.stderr or nothing,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
        sys.exit(code)
    os.execve(python, command, environment)


def _is_importable(name: str) -> bool:
    from importlib.util import find_spec

    try:
        spec = find_spec(name)
    except ValueError:  # imported already, by something that has no spec
        return True
    # A folder that merely has the name, without __init__.py, has no origin.
    return spec is not None and spec.origin is not None


def ask_inkscape_for_inkex() -> str:
    """The extensions folder that comes with the installed Inkscape, empty when there is none."""
    import shutil

    found = shutil.which("inkscape") or ""
    # A program beside the drawing is none to trust: on Windows, or with a dot in PATH, it is found first.
    found = found if os.path.isabs(found) else ""
    inkscape = os.environ.get("INKSCAPE_COMMAND") or found or MACOS_INKSCAPE
    lines = _answer([inkscape, "--system-data-directory"])[1].split("\n")
    folders = [os.path.join(line.strip(), "extensions") for line in lines if line.strip()]
    return next((folder for folder in reversed(folders) if _holds_inkex(folder)), "")


def set_up_in_menu() -> str:
    """Where the menu has the effect that makes the environment."""
    from .messages.language import translate as _

    return _("Extensions > ALUP Reshape > Set up...")


def _leave(missing: "list[str]", stale: "str | None") -> None:
    """Say what is missing and what to do; Inkscape shows it in a window. The document stays as it is."""
    from .messages.language import translate as _

    reason = _("{python} ({path}) does not find {packages}").format(
        python=_python_name(), path=sys.executable, packages=", ".join(missing)
    )
    if stale:
        reason += _("; its packages were installed for {python}").format(python=stale)
    if missing == ["inkex"]:
        remedy = _("start it from Inkscape, or put inkscape on the PATH")
    else:
        remedy = _("choose {set_up}").format(set_up=set_up_in_menu())
    message = _("ALUP Reshape cannot start: {reason}. To repair this, {remedy}")
    sys.stderr.write(message.format(reason=reason, remedy=remedy) + "\n")
    sys.exit(1)
