#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Make docs/gallery: every case by every method, their figures, and the paper's studies.

    sh docs/gallery.sh [--out FOLDER] [--jobs N] [--only CASE ...]

sets up what it needs and runs this.  The drawings are those of benchmarks/drawings; rsvg-convert renders
them.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "benchmarks"), str(ROOT / "tests")]

import numpy as np
import panels
import studies
import trials
from tqdm import tqdm
from trials import Trial

from alup.session.pipeline import Options

METHODS = {
    "Poisson": "poisson",
    "AKVF": "killing",
    "Puppet warp": "puppet",
    "ARAP": "arap",
    "ALUP": "alup",
}
OTHERS = [name for name in METHODS if name != "ALUP"]

# Two figures that differ by no more than this are equal: what nobody sees.
EQUAL = {
    "bands lost": 0.005,
    "mean turning": 0.01,
    "largest turning": 0.1,
    "scale gradient": 0.01,
    "bent lines": 0.01,
    "new crossings": 0.5,
    "handle error": 1e-5,
}

# Of these the cases are named in which another method has less.
NAMED = ("bands lost", "mean turning")

# With more of its bands lost a picture was nearly always thrown away.
TOO_MUCH = 0.05


class Runner:
    """Runs trials on several processes, with one progress bar."""

    def __init__(self, pool: Any, bar: tqdm):
        self._pool, self._bar = pool, bar

    def __call__(self, jobs: list[tuple[dict[str, Any], Options]]) -> list[Trial]:
        self._bar.total += len(jobs)
        done = []
        for one in self._pool.imap(_run, jobs):
            done.append(one)
            self._bar.update()
        return done


def _run(job: tuple[dict[str, Any], Options]) -> Trial:
    return trials.run(*job)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "gallery")
    parser.add_argument("--jobs", type=int, default=multiprocessing.cpu_count())
    parser.add_argument("--only", nargs="+", help="these cases only")
    given = parser.parse_args()
    cases = trials.cases()
    if given.only:
        cases = {name: cases[name] for name in given.only}
    given.out.mkdir(parents=True, exist_ok=True)
    with multiprocessing.Pool(given.jobs) as pool, tqdm(total=0, unit="run") as bar:
        make(cases, Runner(pool, bar), given.out)
    return 0


def make(cases: dict[str, dict[str, Any]], run: Runner, folder: Path) -> None:
    """All pages and pictures."""
    names = list(cases)
    done = run([(cases[name], Options(method=m)) for name in names for m in METHODS.values()])
    by_case = {
        name: dict(zip(METHODS, done[n * len(METHODS) : (n + 1) * len(METHODS)]))
        for n, name in enumerate(names)
    }
    for name, found in by_case.items():
        row = [panels.Panel(found["ALUP"].before, "input", "", cases[name]["handles"])]
        row += [panels.Panel(one.after, method, studies.caption(one)) for method, one in found.items()]
        panels.strip(row, list(found.values()), folder / "cases" / f"{name}.png")
    (folder / "cases.md").write_text(_cases_page(cases, by_case), encoding="utf-8")
    parts = {
        "comparison": _comparison(by_case),
        "verdicts": _verdicts(by_case),
        "bar": studies.bar(run, METHODS, folder),
        "failures": _failures(cases, by_case, run, folder),
        "ablations": studies.ablations(cases, run, folder),
        "compression": studies.compression(cases, run, folder),
        "regular": studies.regular(cases, run, folder),
        "sampling": studies.sampling(cases, run, folder),
        "convergence": studies.convergence(cases, run, folder),
        "steps": studies.step_sizes(trials.cases(), folder),
    }
    page = (ROOT / "benchmarks" / "gallery.template.md").read_text(encoding="utf-8")
    for name, part in parts.items():
        page = page.replace(f"<!-- {name} -->\n", part)
    (folder / "README.md").write_text(page, encoding="utf-8")
    every = {name: {m: _plain(one) for m, one in found.items()} for name, found in by_case.items()}
    (folder / "figures.json").write_text(json.dumps(every, indent=1) + "\n", encoding="utf-8")


def _plain(trial: Trial) -> dict[str, Any]:
    if trial.error:
        return {"error": trial.error}
    found: dict[str, Any] = {key: float(f"{value:.4g}") for key, value in studies.figures(trial).items()}
    if "exact" in trial.report:
        found["from exact"] = float(f"{trial.report['exact']['max']:.3g}")
    return found


def _comparison(by_case: dict[str, dict[str, Trial]]) -> str:
    """Medians, win rates, and by name where ALUP does not win."""
    values = {
        method: [studies.figures(found[method]) for found in by_case.values() if not found[method].error]
        for method in METHODS
    }
    keys = list(EQUAL)
    rows = [
        [method]
        + [f"{100 * np.mean([one['bands lost'] for one in values[method]]):.2g} %"]
        + [str(sum(one["bands lost"] > TOO_MUCH for one in values[method]))]
        + [_short(np.median([one[key] for one in values[method]])) for key in keys[1:5]]
        + [str(sum(one["new crossings"] > 0 for one in values[method]))]
        + [_short(max(one["handle error"] for one in values[method])), _exact(by_case, method)]
        for method in METHODS
    ]
    head = ["method", "bands lost, mean", f"cases with more than {100 * TOO_MUCH:g} %"]
    head += [*(f"{key}, median" for key in keys[1:5]), "cases with new crossings"]
    text = studies.table([*head, "handle error, greatest", "from the exact shape, greatest"], rows)
    text += "\nShare of the cases in which ALUP's figure is less / equal / more than the other's:\n\n"
    rates, worse = [], []
    for method in OTHERS:
        row = [method]
        for key in keys[:6]:
            less = equal = more = 0
            for name, found in by_case.items():
                if found[method].error or found["ALUP"].error:
                    continue
                ours, theirs = studies.figures(found["ALUP"])[key], studies.figures(found[method])[key]
                if abs(ours - theirs) <= EQUAL[key]:
                    equal += 1
                elif ours < theirs:
                    less += 1
                else:
                    more += 1
                    if key in NAMED:
                        worse.append((key, method, name, ours, theirs))
            total = max(less + equal + more, 1)
            row.append(f"{100 * less / total:.0f} / {100 * equal / total:.0f} / {100 * more / total:.0f} %")
        rates.append(row)
    text += studies.table(["against", *keys[:6]], rates)
    text += "\nWhere another method has less:\n\n"
    for key in NAMED:
        listed = [
            f"{name} ({method} {_short(b)}, ALUP {_short(a)})" for k, method, name, a, b in worse if k == key
        ]
        text += f"* {key}: {'; '.join(listed) or 'nowhere'}.\n"
    refused = [
        (name, m, one.error) for name, found in by_case.items() for m, one in found.items() if one.error
    ]
    text += "".join(f"* {name} by {method} was refused: {error}\n" for name, method, error in refused)
    return text


def _verdicts(by_case: dict[str, dict[str, Trial]]) -> str:
    """What a person says who looks at ALUP's pictures."""
    rows, count = [], dict.fromkeys(("kept", "flawed", "thrown away"), 0)
    for name, (verdict, why) in _looked_at().items():
        if name in by_case:
            count[verdict] += 1
            lost = studies.figures(by_case[name]["ALUP"])["bands lost"]
            if verdict != "kept":
                rows.append([name, verdict, f"{100 * lost:.1f} %", why])
    text = ", ".join(f"{number} {verdict}" for verdict, number in count.items())
    return f"{text}.\n\n" + studies.table(["case", "verdict", "bands lost", "why"], rows)


def _looked_at() -> dict[str, list[str]]:
    """Verdict and reason by case; only who has looked at a new picture may change them."""
    found: dict[str, list[str]] = json.loads((trials.DRAWINGS / "verdicts.json").read_text(encoding="utf-8"))
    return found


def _exact(by_case: dict[str, dict[str, Trial]], method: str) -> str:
    known = [
        found[method].report["exact"]["max"] for found in by_case.values() if "exact" in found[method].report
    ]
    return _short(max(known)) if known else ""


def _short(value: float) -> str:
    return f"{value:.2g}"


def _failures(
    cases: dict[str, dict[str, Any]], by_case: dict[str, dict[str, Trial]], run: Runner, folder: Path
) -> str:
    """Cases that go wrong, with the handles that mend them."""
    known = json.loads((trials.DRAWINGS / "failures.json").read_text(encoding="utf-8"))
    known = [one for one in known if one["case"] in cases]
    mended = [
        {**cases[one["case"]], "handles": cases[one["case"]]["handles"] + one["handles"]} for one in known
    ]
    done = run([(entry, Options()) for entry in mended])
    text = ""
    for one, entry, trial in zip(known, mended, done):
        name, found = one["case"], by_case[one["case"]]
        file = folder / "failures" / f"{name}.png"
        best = found[one["better"]]
        panels.strip(
            [
                panels.Panel(found["ALUP"].before, "input", "", cases[name]["handles"]),
                panels.Panel(best.after, one["better"], studies.caption(best)),
                panels.Panel(found["ALUP"].after, "ALUP", studies.caption(found["ALUP"])),
                panels.Panel(trial.before, "more handles", "", entry["handles"]),
                panels.Panel(trial.after, "ALUP with these", studies.caption(trial)),
            ],
            [best, found["ALUP"], trial],
            file,
        )
        text += f"**{name}.** {one['say']}\n\n![{name}](failures/{name}.png)\n\n"
    return text


def _cases_page(cases: dict[str, dict[str, Any]], by_case: dict[str, dict[str, Trial]]) -> str:
    text = "# Every case by every method\n\n"
    text += (
        "Red points stay, blue ones move along the arrow. Below each result: the part of the bands that "
        "was lost, and how far tangents turned on average. "
        "[How they are measured, and their summary](README.md).\n\n"
    )
    looked_at = _looked_at()
    for name in by_case:
        verdict, why = looked_at[name]
        said = f"ALUP: {verdict}. {why}".rstrip()
        text += f"## {name}\n\n{cases[name]['intent']}\n\n![{name}](cases/{name}.png)\n\n{said}\n\n"
    return text.rstrip("\n") + "\n"


if __name__ == "__main__":
    sys.exit(main())
