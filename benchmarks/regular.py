# SPDX-License-Identifier: GPL-2.0-or-later
"""How well regularities of drawings are kept on a folder of cases, without and with the option.

python3 benchmarks/regular.py [--cases FOLDER] [--write FILE]

Items that no handle holds are measured.  Circles: the distance from the nearest uniform scaling of the
original, relative to the radius.  Sets: the difference between the sizes of their items.  Levels: the
distance of centres from their line, relative to the diagonal.  Evenly spaced places: the difference between
their gaps.  Lines: the greatest angle, in degrees, between how a line and the others of its set have turned.
Below the table are other measures of the same runs, which keeping regularities must not make worse, and the
time of a run, the fastest of REPEAT.
"""

from __future__ import annotations

import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

import results
import trials

from alup.document import reading
from alup.regular.find import CIRCLES, Regular
from alup.session import pipeline
from alup.session.options import Options
from alup.session.session import Session

Array = np.ndarray

TITLE = "What is regular"

KINDS = ("circles", "sizes", "rows", "gaps", "lines")
ASKED = {"circles": 0.005, "sizes": 0.01, "rows": 0.001, "gaps": 0.02, "lines": 0.2}

# A run is worse than another one if turning is greater by this, degrees, or the kept share of bands smaller.
WORSE_TURNING, WORSE_BANDS = 0.05, 0.005

REPEAT = 3


def measured(found: Regular, points: Array, moved: Array, held: Array) -> dict[str, float]:
    """The worst deviation of each kind among items that no handle holds.  points, moved : (N, 2)"""
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    free = [not np.isin(item.samples, held).any() for item in found.items]
    worst = dict.fromkeys(KINDS, 0.0)
    scales, centres = [], []
    for item, mine in zip(found.items, free):
        p, v = points[item.samples], moved[item.samples]
        a, b = p - p.mean(axis=0), v - v.mean(axis=0)
        square = (a**2).sum(axis=0)
        scale = np.where(square > 1e-12 * square.sum(), (a * b).sum(axis=0) / np.maximum(square, 1e-300), 1.0)
        scales.append(scale)
        centres.append(v.mean(axis=0) + scale * (item.centre - p.mean(axis=0)))
        if mine and item.kind == CIRCLES:
            even = (a * b).sum() / (a**2).sum()
            away = np.linalg.norm(b - even * a, axis=1).max()
            worst["circles"] = max(worst["circles"], away / (even * np.linalg.norm(a, axis=1).max()))
    size, centre = np.array(scales).reshape(-1, 2), np.array(centres).reshape(-1, 2)

    def free_of(items: Array) -> Array:
        return items[[free[n] for n in items]]

    for group in map(free_of, found.sets):
        if len(group) > 1:
            worst["sizes"] = max(
                worst["sizes"], float((size[group].max(axis=0) / size[group].min(axis=0) - 1.0).max())
            )
    for level in found.levels:
        row = free_of(level.items)
        if len(row) > 1:
            worst["rows"] = max(worst["rows"], float(np.ptp(centre[row, level.axis])) / 2.0 / diagonal)
    for spaced in found.spaced:
        kept = np.array([free[n] for n in spaced.items])
        step, place = spaced.step[kept], centre[spaced.items[kept], spaced.axis]
        middle = np.array([place[step == one].mean() for one in np.unique(step)])
        gaps = np.diff(middle) / np.diff(np.unique(step))
        if len(gaps) > 1:
            worst["gaps"] = max(worst["gaps"], float(np.ptp(gaps) / abs(gaps.mean())))
    ends = found.lines.ends
    turned = np.degrees(np.angle(_chords(moved, ends) * _chords(points, ends).conj()))
    for group in [found.lines.upright, *found.lines.parallel]:
        group = group[[not np.isin(found.lines.samples[n], held).any() for n in group]]
        if len(group) > 1:
            worst["lines"] = max(
                worst["lines"], float(np.abs(turned[group] - np.median(turned[group])).max())
            )
    return worst


def _chords(points: Array, ends: Array) -> Array:
    """From end to end of lines (L, 2), complex."""
    return np.asarray((points[ends[:, 1]] - points[ends[:, 0]]) @ np.array([1.0, 1.0j]))


@dataclass(frozen=True)
class Compared:
    """found : the regularities of a case; off, turning, bands, seconds : without and with keeping them"""

    found: Regular
    off: tuple[dict[str, float], dict[str, float]]
    turning: tuple[float, float]
    bands: tuple[float, float]
    seconds: tuple[float, float]


def compare(entry: dict[str, Any], folder: Path) -> Compared:
    """A case without and with keeping what is regular."""
    _, root, chosen = trials.load(entry, folder)
    drawing = reading.read(root, chosen, False, True).drawing
    sessions, answers, seconds = [], [], []
    for kinds in (frozenset[str](), Options().regular):
        times = []
        for _number in range(REPEAT):
            begun = time.perf_counter()
            session = Session(drawing, Options(regular=kinds))
            answer = session.solve()
            times.append(time.perf_counter() - begun)
        sessions.append(session)
        answers.append(answer)
        seconds.append(min(times))
    rounds = sessions[1].held.rounds
    found = rounds.regular if rounds is not None and rounds.regular is not None else Regular()
    off, turning, bands = [], [], []
    for session, answer in zip(sessions, answers):
        off.append(measured(found, session.held.samples.points, answer.moved, answer.anchors.samples))
        report = pipeline.result_of(session, answer).report
        turning.append(float(report["turning_degrees"]["mean"]))
        bands.append(float(report["bands"]["kept"]))
    return Compared(found, *(tuple(two) for two in (off, turning, bands, seconds)))  # type: ignore[arg-type]


def summary(every: list[Compared]) -> list[str]:
    """What keeping regularities does to other measures and to time."""
    turning, bands = (np.array([getattr(case, name) for case in every]) for name in ("turning", "bands"))
    times = np.array([case.seconds[1] / case.seconds[0] for case in every])
    greater, less = ((sign * np.diff(turning)[:, 0] > WORSE_TURNING).sum() for sign in (1.0, -1.0))
    lost, more = 1.0 - bands.mean(axis=0), (np.diff(bands)[:, 0] < -WORSE_BANDS).sum()
    return [
        f"* Turning: {turning[:, 0].mean():.3f} degrees without, {turning[:, 1].mean():.3f} with; more by "
        f"{WORSE_TURNING:g} in {greater} of {len(every)} cases, less in {less}.",
        f"* Bands lost: {lost[0]:.4f} without, {lost[1]:.4f} with; more by {WORSE_BANDS:g} in {more} cases.",
        f"* A run takes {np.median(times):.2f} times as long in the median, more than "
        f"{np.quantile(times, 0.95):.2f} times in 5 % of the cases, {times.max():.2f} times at most.",
    ]


def main() -> int:
    parser = results.parser(__doc__)
    parser.add_argument("--cases", type=Path, default=Path(os.environ.get("ALUP_CLIPART", trials.DRAWINGS)))
    given = parser.parse_args()
    lines = []

    def say(line: str) -> None:
        print(line, flush=True)
        lines.append(line)

    say("| case | " + " | ".join(f"{kind}, without | with" for kind in KINDS) + " |")
    say("| --- |" + " ---: | ---: |" * len(KINDS))
    over = {kind: [0, 0] for kind in KINDS}
    every = []
    for name, entry in trials.cases(given.cases).items():
        case = compare(entry, given.cases)
        every.append(case)
        if not case.found.items and not len(case.found.lines):
            continue
        without, kept = case.off
        say(f"| {name} | " + " | ".join(f"{without[k]:.4f} | {kept[k]:.4f}" for k in KINDS) + " |")
        for kind in KINDS:
            over[kind][0] += without[kind] > ASKED[kind]
            over[kind][1] += kept[kind] > ASKED[kind]
    say("| more than asked | " + " | ".join(f"{a} | {b}" for a, b in over.values()) + " |")
    say("")
    for line in summary(every):
        say(line)
    results.write_section(given.write, TITLE, lines)
    return 0


if __name__ == "__main__":
    sys.exit(main())
