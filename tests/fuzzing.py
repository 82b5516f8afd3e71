# SPDX-License-Identifier: GPL-2.0-or-later
"""Checks that must hold for every document, and a search for documents on which one fails.

`strategies` makes documents, and `check` runs the effects on one within this process.  As a program,

    python tests/fuzzing.py --minutes 60 --found FOLDER

searches for new failures for that time, and keeps the smallest document of each kind.
"""

# This is a program, too, and imports late.
# ruff: noqa: E402

from __future__ import annotations

import argparse
import collections
import contextlib
import io
import json
import re
import signal
import sys
import tempfile
import time
import traceback
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Iterator, Sequence

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

import inkex
import numpy as np
from documents import ALUP, INKSCAPE
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from lxml import etree
from strategies import Case, Edit, cases, edited, edits, loaded
from sweep_lasting import without_handles

import alup_place_handles
import alup_remove_handles
import alup_reshape
import alup_restore_original
from alup.document import reading
from alup.document.tree.own_objects import ARROWS_LABEL, LAYER_LABEL, NOTES_LABEL, is_group, is_ours
from alup.messages.errors import AlupError
from alup.svg import path_data

LABEL = f"{{{INKSCAPE}}}label"

# Processor seconds that one run of an effect may take on a drawing of a few curves.
SECONDS = 20.0

# Relative to the diagonal: the largest miss of a handle when every round has ended at its minimum.
HANDLE_MET = 5e-4

# Options of the tests and of the search.  Coarser samples show the same faults in a tenth of the time.
QUICK = ("--spacing=2", "--time_limit=60")

# --- what must hold -----------------------------------------------------------------------------


class TooLongError(BaseException):
    """Not an Exception, so that no handler of the effect catches it."""


@contextlib.contextmanager
def bounded(seconds: float = SECONDS) -> Iterator[None]:
    """Limits processor time; the time on the clock would make a busy machine a failure."""

    def late(*_: object) -> None:
        raise TooLongError(f"more than {seconds:g} s")

    before = signal.signal(signal.SIGPROF, late)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def content(tree: Any) -> bytes:
    return bytes(etree.tostring(tree))


@dataclass
class Outcome:
    """refusal : the sentence, "" after success; report : of the run; tree : the document after it."""

    refusal: str
    report: dict[str, Any]
    tree: Any
    before: bytes = field(repr=False, default=b"")

    @property
    def after(self) -> bytes:
        return content(self.tree)

    @property
    def kind(self) -> str:
        return "refused" if self.refusal else "changed" if self.report.get("changed") else "same"


def run(effect_class: Any, tree: Any, *arguments: str) -> Outcome:
    """Run an effect on a loaded document.  Any exception but a refusal with a sentence is raised."""
    effect = effect_class()
    told: dict[str, Any] = {}
    if hasattr(effect, "_write_report"):
        effect._write_report = told.update
        arguments = (*arguments, "--report=report")
    effect.parse_arguments([*arguments])
    effect.document, effect.original_document = tree, tree
    effect.svg = tree.getroot()
    effect.svg.selection.set(*effect.options.ids)
    before = content(tree)
    complaints = io.StringIO()
    refusal = ""
    with bounded(), contextlib.redirect_stderr(complaints), contextlib.redirect_stdout(complaints):
        try:
            effect.effect()
        except inkex.AbortExtension as error:
            if not isinstance(error.__cause__, AlupError):
                raise
            refusal = str(error)
    assert not complaints.getvalue(), f"printed: {complaints.getvalue()[:300]}"
    outcome = Outcome(refusal, told, tree, before)
    if refusal:
        assert re.search(r"[.)]$", refusal), f"no sentence: {refusal}"
        assert "\n" not in refusal, f"more than a sentence: {refusal}"
        assert outcome.after == before, "a refused run has changed the document"
    return outcome


def arguments_of(text: str) -> list[str]:
    found = re.search(r"<!--arguments ([^>]*)-->", text)
    return [f"--{word}" for word in found.group(1).split()] if found else []


def check(text: str, again: bool = True) -> Outcome:
    """Run the effect on a document, and assert what must hold of every one."""
    tree = loaded(text)
    arguments = [*QUICK, *arguments_of(text)]
    handles = handles_of(tree.getroot())
    outcome = run(alup_reshape.AlupReshape, tree, *arguments)
    if outcome.refusal:
        return outcome
    json.dumps(outcome.report, allow_nan=False)
    check_output(outcome)
    if handles is not None and all(np.array_equal(start, end) for start, end in handles):
        check_identity(outcome, text)
        return outcome
    if handles is not None and outcome.report["changed"]:
        check_handles(outcome, handles)
    if again and "--keep_handles=false" not in arguments:
        check_again(outcome, arguments)
    return outcome


def check_placing(text: str) -> Outcome:
    """Placed handles lie on curves and move nothing; removing them restores the document."""
    placed = run(alup_place_handles.AlupPlaceHandles, loaded(text))
    if placed.refusal:
        return placed
    check_output(placed)
    before = without_handles(placed.before)
    if without_handles(placed.before) == content(etree.fromstring(placed.before)):
        outcome = run(alup_reshape.AlupReshape, loaded(placed.after.decode()), *QUICK)
        if not outcome.refusal:
            check_identity(outcome, text)
    removed = run(alup_remove_handles.AlupRemoveHandles, loaded(placed.after.decode()))
    assert not removed.refusal, f"not removed: {removed.refusal}"
    assert without_handles(removed.after) == before, "handles were placed and removed, and something is left"
    return placed


def check_edited(text: str, changes: Sequence[Edit]) -> Outcome:
    """Whatever happens to a document between two runs, every effect ends in a result or in a sentence."""
    first = run(alup_reshape.AlupReshape, loaded(text), *QUICK, *arguments_of(text))
    between = edited(first.after.decode(), changes)
    check_output(run(alup_restore_original.AlupRestoreOriginal, loaded(between)))
    check_output(run(alup_remove_handles.AlupRemoveHandles, loaded(between), "--bake=true"))
    second = run(alup_reshape.AlupReshape, loaded(between), *QUICK, *arguments_of(text))
    check_output(second)
    if not second.refusal:
        check_output(run(alup_restore_original.AlupRestoreOriginal, loaded(second.after.decode())))
    return second


def check_output(outcome: Outcome) -> None:
    """The output parses, all its numbers are finite, and the elements of the input are in their old order."""
    root, before = etree.fromstring(outcome.after), etree.fromstring(outcome.before)
    ids = [e.get("id") for e in before.iter() if e.get("id")]
    if "keep_handles" not in outcome.before.decode():
        there = {e.get("id") for e in root.iter()}
        ours = {part.get("id") for e in before.iter() if may_go(e) for part in e.iter()}
        missing = [identity for identity in ids if identity not in there | ours]
        assert not missing, f"gone: {missing}"
    # Elements without an id can't be told apart, so a value that was anywhere in the input is not ours.
    given = {item for e in before.iter() for item in e.attrib.items()}
    for element in root.iter():
        if not isinstance(element.tag, str):
            continue
        for name, value in element.attrib.items():
            if (name, value) in given:
                continue
            assert not re.search(r"\b(nan|inf|infinity)\b", value, re.IGNORECASE), f"{name}={value[:200]}"
            if name == "d":
                subpaths = path_data.parse(value)
                assert all(np.isfinite(s.control).all() for s in subpaths)


def may_go(element: Any) -> bool:
    """A handle, a copy that a run has made, or a layer of handles with nothing else in it: these may go."""
    if is_ours(element) or element.get(f"{{{ALUP}}}copy") is not None:
        return True
    return is_group(element, LAYER_LABEL) and all(
        may_go(child) or any(is_group(child, label) for label in (ARROWS_LABEL, NOTES_LABEL))
        for child in element
    )


def check_identity(outcome: Outcome, text: str) -> None:
    """No handle was moved: the drawing is the one there was."""
    changed = outcome.report["changed"]
    assert not changed, f"no handle moved, but {changed} changed"
    if "--keep_handles=false" not in arguments_of(text):
        assert outcome.after == outcome.before, "no shape changed, but the document did"


def check_handles(outcome: Outcome, handles: Sequence[tuple[Any, Any]]) -> None:
    """Each handle is met if every round ended at its minimum."""
    report = outcome.report
    statuses = {one["status"] for one in report["rounds"]}
    if not statuses <= {"MINIMUM", "UNMOVED"}:
        return
    diagonal = reading.read(loaded(outcome.before.decode()).getroot(), [], True).drawing.diagonal
    error = report["handle_error_of_diagonal"] / max(1.0, strain(handles, diagonal))
    assert error < HANDLE_MET, f"handles missed by {error:.3g}"


def strain(handles: Sequence[tuple[Any, Any]], diagonal: float) -> float:
    """The largest move of a handle, in diagonals, or of one handle against another, in their distances."""
    moves = np.array([np.subtract(end, start) for start, end in handles]).reshape(-1, 2)
    starts = np.array([start for start, _ in handles]).reshape(-1, 2)
    torn = np.linalg.norm(moves[:, None] - moves, axis=2)
    apart = np.linalg.norm(starts[:, None] - starts, axis=2)
    ratio = torn[apart > 0.0] / apart[apart > 0.0]
    return float(max(np.linalg.norm(moves, axis=1).max(initial=0.0) / diagonal, ratio.max(initial=0.0)))


def check_again(outcome: Outcome, arguments: Sequence[str]) -> None:
    """A second run changes nothing; restoring brings everything back to the letter."""
    before = without_handles(outcome.before)
    first = without_handles(outcome.after)
    second = run(alup_reshape.AlupReshape, loaded(outcome.after.decode()), *arguments)
    if not second.refusal and not timed_out(outcome) and not timed_out(second):
        assert not second.report["changed"], f"a second run changed {second.report['changed']}"
        assert without_handles(second.after) == first, "a second run changed the document"
    if outcome.report["changed"]:
        restored = run(alup_restore_original.AlupRestoreOriginal, loaded(outcome.after.decode()))
        assert not restored.refusal, f"not restored: {restored.refusal}"
        assert without_handles(restored.after) == before, "restored is not what it was"


def timed_out(outcome: Outcome) -> bool:
    return any(one["status"] == "TIME" for one in outcome.report["rounds"])


def handles_of(root: Any) -> list[tuple[Any, Any]] | None:
    """Start and end of each point handle; None if there are others than `mark` makes."""
    found: dict[str, list[Any]] = {}
    for element in root.iter():
        label = element.attrib.get(LABEL) or ""
        if not label.startswith("alup:"):
            continue
        identity = re.fullmatch(r"[wv](\d+)", element.attrib.get("id") or "")
        rest = element.attrib.get(f"{{{ALUP}}}rest")
        if not identity or not re.fullmatch(r"alup:(pin|handle|from \d+|to \d+)", label):
            return None
        try:
            places = [[float(v) for v in rest.split()]] if rest else []
            places.append([float(element.attrib[c]) for c in ("cx", "cy")])
        except ValueError:
            return None
        found.setdefault(identity[1], []).extend(places)
    return [(places[0], places[-1]) for places in found.values()]


# --- looking for cases --------------------------------------------------------------------------


# The place of a failure is the last one in the package, not in these modules.
OWN = ("fuzzing", "strategies")


def signature(error: BaseException) -> str:
    """What kind of failure: its type, where in the package, or which assertion."""
    frames = traceback.extract_tb(error.__traceback__)
    inner = [f for f in frames if "/alup" in f.filename and Path(f.filename).stem not in OWN]
    place = (
        f"{Path(inner[-1].filename).stem}-{inner[-1].name}"
        if inner and not isinstance(error, AssertionError)
        else ""
    )
    if isinstance(error, AssertionError) and not inner:
        place = re.sub(r"[^a-z]+", "-", str(error).split("\n")[0].lower())[:60]
    elif isinstance(error, AssertionError):
        place = f"{Path(inner[-1].filename).stem}-{inner[-1].name}"
    return f"{type(error).__name__}-{place}"


@dataclass
class Search:
    """Counts, and the failures known so far, which are not looked at again."""

    folder: Path
    until: float
    known: set[str] = field(default_factory=set)
    counts: Any = field(default_factory=collections.Counter)
    slowest: float = 0.0

    def one(self, case: Case, again: bool, changes: Sequence[Edit]) -> None:
        self.counts["examples"] += 1
        if time.monotonic() > self.until + 120.0:
            return
        begun = time.process_time()
        text = case.bare
        try:
            text = case.text()
            self.counts[check(text, again).kind] += 1
            if again:
                self.counts["placing refused" if check_placing(text).refusal else "placed"] += 1
            else:
                self.counts[f"edited {check_edited(text, changes).kind}"] += 1
        except (Exception, TooLongError) as error:
            found = signature(error)
            self.counts[f"failed {found}"] += 1
            if found in self.known:
                return
            (self.folder / f"{found}.svg").write_text(text, encoding="utf-8")
            (self.folder / f"{found}.txt").write_text(
                f"{changes}\n{traceback.format_exc()}", encoding="utf-8"
            )
            raise
        finally:
            taken = time.process_time() - begun
            if taken > self.slowest:
                self.slowest = taken
                (self.folder / "slowest.svg").write_text(text, encoding="utf-8")

    def batch(self, number: int, examples: int) -> None:
        @seed(number)
        @settings(
            max_examples=examples, deadline=None, database=None, report_multiple_bugs=False, print_blob=False,
            suppress_health_check=list(HealthCheck), phases=(Phase.generate, Phase.shrink),
        )  # fmt: skip
        @given(cases(), st.booleans(), edits())
        def look(case: Case, again: bool, changes: tuple[Edit, ...]) -> None:
            self.one(case, again, changes)

        try:
            look()
        except (Exception, TooLongError) as error:  # noqa: BLE001 - already kept
            found = signature(error)
            self.known.add(found)
            print(f"found {found}: {str(error)[:300]}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--found", type=Path, default=Path(tempfile.gettempdir()) / "alup-found")
    parser.add_argument("--seed", type=int, default=0)
    given_ = parser.parse_args()
    given_.found.mkdir(parents=True, exist_ok=True)
    begun = time.monotonic()
    search = Search(given_.found, begun + 60.0 * given_.minutes)
    number = given_.seed
    warnings.simplefilter("error")  # a warning would open a window in Inkscape
    while time.monotonic() < search.until:
        search.batch(number, 200)
        number += 1
        print(
            f"{(time.monotonic() - begun) / 60.0:.1f} min, seed {number}, "
            f"slowest {search.slowest:.1f} s, {dict(search.counts)}",
            flush=True,
        )


if __name__ == "__main__":
    main()
