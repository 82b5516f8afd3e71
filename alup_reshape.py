#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Effect: reshape the selected clip-art by the handles that lie on it.

All work is in the package `alup`; this file reads the options.
"""

import sys
import time

STARTED = time.perf_counter()

from alup import startup

startup.prepare(__file__)

import json
import platform

import inkex

import alup
from alup import run
from alup.document import effect, reading
from alup.document import notes as document_notes
from alup.messages.errors import AlupError
from alup.messages.language import translate as _
from alup.session.options import HOLD_TOGETHER, KINDS, METHODS, SOLVERS, Limits, Options, Weights

# Modules that may take part in a run, and the packages that they are of.
PACKAGES = {name: name for name in ("inkex", "numpy", "scipy", "lxml", "qdldl")}
PACKAGES["igl"] = "libigl"


class AlupReshape(effect.Effect):
    """Extensions > ALUP Reshape > Reshape..."""

    def add_arguments(self, pars):
        weights, options = Weights(), Options()
        pars.add_argument("--scope", default="selection", choices=("selection", "drawing"))
        pars.add_argument(
            "--hold",
            default=options.hold,
            choices=tuple(HOLD_TOGETHER),
            help="how firmly parts that lie side by side are held together; apart: what has no handle stays",
        )
        pars.add_argument(
            "--regular",
            default="all",
            help="what is regular stays so: all, none, or some of "
            + ", ".join(KINDS)
            + ", with commas between",
        )
        pars.add_argument("--crossings", type=inkex.Boolean, default=options.crossings)
        pars.add_argument("--snap", type=float, default=100.0 * options.snap, help="percent of the diagonal")
        pars.add_argument("--keep_handles", type=inkex.Boolean, default=True)
        pars.add_argument(
            "--spacing", type=float, default=100.0 * options.spacing, help="percent of the longest side"
        )
        pars.add_argument(
            "--tolerance", type=float, default=100.0 * options.fit_tolerance, help="percent, as spacing"
        )
        pars.add_argument(
            "--add_nodes",
            type=inkex.Boolean,
            default=options.add_nodes,
            help="where the old ones can't follow within the tolerance",
        )
        pars.add_argument("--iterations", type=int, default=options.limits.iterations)
        pars.add_argument("--time_limit", type=float, default=options.time_limit, help="seconds")
        pars.add_argument("--max_vertices", type=int, default=options.max_vertices)
        pars.add_argument("--method", default=options.method, choices=METHODS)
        pars.add_argument("--solver", default=options.solver, choices=SOLVERS)
        pars.add_argument("--weight_normal", type=float, default=weights.normal)
        pars.add_argument("--weight_tangent", type=float, default=weights.tangent)
        pars.add_argument("--weight_straight", type=float, default=weights.straight)
        pars.add_argument("--weight_handle", type=float, default=weights.handle)
        pars.add_argument("--weight_component", type=float, default=weights.component)
        pars.add_argument("--report", default="", help="write a JSON report to this file")

    def parse_arguments(self, args):
        """Names have underscores in the .inx; by hand one expects dashes, so both are understood."""
        known = set(self.arg_parser._option_string_actions)
        given = []
        for argument in args:
            name, equals, value = argument.partition("=")
            underscored = "--" + name[2:].replace("-", "_")
            plain = name in known or underscored not in known
            given.append(argument if plain else underscored + equals + value)
        super().parse_arguments(given)

    def change(self):
        report = self._reshape()
        if self.options.report:
            self._write_report({**report, "versions": versions()})

    def has_changed(self, ret):
        """Inkscape takes no output for no change; a file that was asked for is written all the same."""
        return isinstance(self.options.output, str) or super().has_changed(ret)

    def _reshape(self):
        options, keep_handles = self.options_of_run(), self.options.keep_handles
        begun = time.perf_counter()
        selected = list(self.svg.selection.values())
        reading.refuse_unknown(self.svg, self.options.ids)
        done = run.reshape(self.svg, selected, options, self.options.scope == "drawing", keep_handles)
        read, result = done.read, done.result
        if keep_handles:
            notes = [note.translated() for note in result.notes]
            document_notes.tell(read, notes, done.ignored, bool(done.changed))
        if not self.options.report:
            return {}
        written_at = time.perf_counter()
        seconds = result.report.pop("seconds")
        return {
            **result.report,
            "ignored_handles": done.ignored,
            "changed": done.changed,
            "from_original": read.from_original,
            "edited": read.edited,
            "skipped": read.skipped,
            "seconds": {
                "start": begun - STARTED,
                "read": done.read_at - begun,
                **seconds,
                "write": written_at - done.solved_at,
                "all": written_at - STARTED,
            },
        }

    def options_of_run(self):
        """The options in the package's own terms."""
        given = self.options
        ranges = {
            "spacing": (0.01, 10.0), "tolerance": (0.0001, 10.0), "iterations": (1, 10**6),
            "time_limit": (0.0, 86400.0), "max_vertices": (100, 1_000_000),
            "weight_normal": (0.0, 1e9), "weight_tangent": (0.0, 1e9), "weight_straight": (0.0, 1e9),
            "snap": (1e-5, 1.0),
            "weight_handle": (1e-3, 1e12), "weight_component": (0.0, 1e9),
        }  # fmt: skip
        for name, (low, high) in ranges.items():
            if not low <= getattr(given, name) <= high:
                message = _("The value of {option} is outside {low:g} to {high:g}.")
                raise AlupError(message.format(option=name.replace("_", " "), low=low, high=high))
        weights = Weights(
            normal=given.weight_normal,
            tangent=given.weight_tangent,
            straight=given.weight_straight,
            handle=given.weight_handle,
            component=given.weight_component,
        )
        return Options(
            spacing=given.spacing / 100.0,
            fit_tolerance=given.tolerance / 100.0,
            add_nodes=given.add_nodes,
            snap=given.snap / 100.0,
            crossings=given.crossings,
            hold=given.hold,
            regular=_kinds(given.regular),
            method=given.method,
            solver=given.solver,
            time_limit=given.time_limit,
            max_vertices=given.max_vertices,
            limits=Limits(iterations=given.iterations),
            weights=weights,
        )

    def _write_report(self, report):
        try:
            with open(self.options.report, "w", encoding="utf-8") as file:
                json.dump(report, file, indent=1)
                file.write("\n")
        except OSError as error:
            message = _("The report can't be written to {file}: {reason}.")
            raise AlupError(message.format(file=self.options.report, reason=error.strerror)) from error


def _kinds(given):
    """The kinds of regularity that `--regular` names.  Raises AlupError for a name that is none."""
    if given in ("all", "none"):
        return frozenset(KINDS if given == "all" else ())
    kinds = frozenset(name.strip() for name in given.split(","))
    if not kinds <= frozenset(KINDS):
        message = _("The option {option} is all, none, or some of these with commas between: {kinds}.")
        raise AlupError(message.format(option="regular", kinds=", ".join(KINDS)))
    return kinds


def versions():
    """Versions of what took part in the run."""
    found = {"alup": alup.__version__, "python": platform.python_version()}
    for name, package in PACKAGES.items():
        module = sys.modules.get(name)
        if module is not None:
            found[package] = getattr(module, "__version__", None) or _version(package)
    return found


def _version(package):
    """Of modules that don't know their own."""
    from importlib import metadata

    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:  # lies on the path without having been installed
        return "unknown"


if __name__ == "__main__":
    AlupReshape.main()
