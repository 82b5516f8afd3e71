# SPDX-License-Identifier: GPL-2.0-or-later
"""How well regularities of drawings are kept on a folder of cases, without and with the option.

python3 benchmarks/regular.py [--cases FOLDER] [--write FILE]

Items that no handle holds are measured.  Circles: the distance from the nearest uniform scaling of the
original, relative to the radius.  Sets: the difference between the sizes of their items.  Levels: the
distance of centres from their line, relative to the diagonal.  Evenly spaced places: the difference between
their gaps.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

import results
import trials

from alup.document import reading
from alup.regular.find import CIRCLES, Regular
from alup.session.options import Options
from alup.session.session import Session

Array = np.ndarray

TITLE = "What is regular"

KINDS = ("circles", "sizes", "rows", "gaps")
ASKED = {"circles": 0.005, "sizes": 0.01, "rows": 0.001, "gaps": 0.02}


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
    return worst


def one(entry: dict[str, Any], folder: Path) -> tuple[Regular, dict[str, float], dict[str, float]]:
    """The regularities of a case, and its figures without and with keeping them."""
    figures = []
    found = Regular()
    for kinds in (Options().regular, frozenset()):
        _, root, chosen = trials.load(entry, folder)
        read = reading.read(root, chosen, False, True)
        session = Session(read.drawing, Options(regular=kinds))
        answer = session.solve()
        rounds = session.held.rounds
        if kinds and rounds is not None and rounds.regular is not None:
            found = rounds.regular
        figures.append(measured(found, session.held.samples.points, answer.moved, answer.anchors.samples))
    return found, figures[1], figures[0]


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
    for name, entry in trials.cases(given.cases).items():
        found, without, kept = one(entry, given.cases)
        if not found.items:
            continue
        say(f"| {name} | " + " | ".join(f"{without[k]:.4f} | {kept[k]:.4f}" for k in KINDS) + " |")
        for kind in KINDS:
            over[kind][0] += without[kind] > ASKED[kind]
            over[kind][1] += kept[kind] > ASKED[kind]
    say("| more than asked | " + " | ".join(f"{a} | {b}" for a, b in over.values()) + " |")
    results.write_section(given.write, TITLE, lines)
    return 0


if __name__ == "__main__":
    sys.exit(main())
