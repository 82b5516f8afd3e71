#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Our solver against the paper's algorithm in C++ with Eigen (`paper.cpp`), in the same run.

python benchmarks/against_paper.py [--repeat N] [--write FILE] [CASE ...]
python benchmarks/against_paper.py --growth [--write FILE] [CASE ...]

Every case of the clip-art folder (or each named one) is one row.  Both programs solve the core round, and the
final round that follows *our* core result.  F is the objective that both decrease (`alup/energy/terms.py`);
for the C++ it is the least of all its 100 iterations.  Times are processor time for both rounds, with set-up
and without reading files.  Each is the least of N repetitions, in which the programs take turns.

The C++ runs 100 + 100 iterations, then again with the paper's stopping rules, and then as a race to quality:
from the same start until its F is within 0.1 % of ours, for at most 5,000 iterations a round.  Its checks of
F in the race are not timed.

`--growth` solves a few cases at finer and finer spacing, with our solver in a separate process, and fits
seconds ~ vertices^p.

`--write` puts the table into a Markdown file, in place of the one of the same mode that is there.
"""

from __future__ import annotations

import multiprocessing
import re
import resource
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Callable, Sequence, Tuple

import one_thread  # noqa: F401 - before numpy is imported

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

import numpy as np
import paper_cpp
import results
import rounds

from alup.energy import terms
from alup.energy.problem import Problem
from alup.solver import minimise, outcome

# F at or below this is called zero: a shape without distortion.  Chosen by looking at the cases.
ZERO = 1e-12

# A round whose F is above this multiple of the C++'s is named below the table.
WORSE = 1.001

# The race ends at this ratio to our F, or after so many iterations of a round.
NEAR, MOST = 1.001, 5000

# The race is repeated only if it takes less than this, seconds.
BRIEF = 0.3

# Parts of the longest side; the last one gives up to 100,000 vertices.
SPACINGS = (0.005, 0.001, 0.0005, 0.0002)
GROWTH_CASES = ("knife-blade-longer", "bottle-body-taller", "truck-longer-box", "elephant-longer-legs")

# With more vertices everything is timed once.
LARGE = 20_000


@dataclass(frozen=True)
class Compared:
    """One round of one case.

    cpp, ours, free : F of the C++, of ours, and of ours with `keep_size` = 0
    cpp_seconds, rules_seconds, seconds : C++ with 100 iterations, with the stopping rules, and ours
    rules_iterations, iterations : of the C++ with the rules, and of ours
    race_seconds, race_iterations, reached : of the C++ until its F is as good as ours; whether it was
    """

    vertices: int
    cpp: float
    ours: float
    free: float
    cpp_seconds: float
    rules_seconds: float
    seconds: float
    rules_iterations: int
    iterations: int
    race_seconds: float
    race_iterations: int
    reached: bool

    @property
    def zero(self) -> bool:
        return self.ours <= ZERO

    @property
    def ratio(self) -> float:
        return self.ours / self.cpp

    @property
    def free_ratio(self) -> float:
        return self.free / self.cpp


# Core and final round.
Pair = Tuple[Compared, Compared]


def main() -> int:
    parser = results.parser_of_cases(__doc__)
    parser.add_argument("--growth", action="store_true", help="finer and finer spacing")
    given = parser.parse_args()
    entries = results.cases(given.names or (list(GROWTH_CASES) if given.growth else []))
    lines: list[str] = []

    def say(*more: str) -> None:
        lines.extend(more)
        print("\n".join(more), flush=True)

    with tempfile.TemporaryDirectory(prefix="alup-paper-") as name:
        folder = Path(name)
        program = paper_cpp.build(folder)
        (growth if given.growth else every_case)(program, folder, entries, given.repeat, say)
        say("", results.machine(paper_cpp.versions()))
    results.write_section(given.write, "Growth" if given.growth else "Cases", lines)
    return 0


# Every case, both rounds


def every_case(
    program: Path, folder: Path, entries: list[dict[str, Any]], repeat: int, say: Callable[..., None]
) -> None:
    """Print the table of cases and its summary."""
    core = rounds.core_of(entries[0]).problem
    minimise.newton(core, outcome.DEFAULT_LIMITS)  # imports of the first call are not timed
    found: dict[str, Pair] = {}
    say(*header(CASE_TITLES))
    for entry in entries:
        found[entry["name"]] = compare_case(program, folder, entry, repeat)
        say(line(case_cells(entry["name"], found[entry["name"]]), CASE_TITLES))
    say("", *summary(found))


def compare_case(program: Path, folder: Path, entry: dict[str, Any], repeat: int) -> Pair:
    """Core and final round of a case; the final one starts from our core result for both."""
    core = rounds.core_of(entry)
    first, result = compare(program, folder, core.problem, repeat)
    last, _ = compare(program, folder, core.final(result.positions), repeat, result)
    return first, last


def compare(
    program: Path, folder: Path, problem: Problem, repeat: int, before: outcome.Round | None = None
) -> tuple[Compared, outcome.Round]:
    """Solve one round by both, ours after the round before.  Returns the figures and our result."""
    file = folder / "problem.bin"
    paper_cpp.write_problem(problem, file)
    fixed, rules, seconds = [], [], []
    for _ in range(repeat):
        fixed.append(paper_cpp.run(program, file))
        rules.append(paper_cpp.run(program, file, "--rules"))
        result, passed = timed(problem, before)
        seconds.append(passed)
    least = terms.objective(problem, result.positions)
    race = raced(program, file, max(NEAR * least, ZERO), repeat)
    unkept = replace(problem, weights=replace(problem.weights, keep_size=0.0))
    free = minimise.newton(unkept, outcome.DEFAULT_LIMITS)
    found = Compared(
        vertices=len(problem.start),
        cpp=fixed[0]["least_objective"],
        ours=least,
        free=terms.objective(problem, free.positions),
        cpp_seconds=min(one["seconds"] for one in fixed),
        rules_seconds=min(one["seconds"] for one in rules),
        seconds=min(seconds),
        rules_iterations=rules[0]["iterations"],
        iterations=result.iterations,
        race_seconds=race["seconds"],
        race_iterations=race["iterations"],
        reached=race["status"] == "REACHED",
    )
    return found, result


def raced(program: Path, file: Path, goal: float, repeat: int) -> dict[str, Any]:
    """The fastest of some races of the C++ to an F of `goal`, or to the limit of iterations."""
    arguments = ("--iterations", str(MOST), "--until", repr(goal))
    best = paper_cpp.run(program, file, *arguments)
    for _ in range(repeat - 1 if best["seconds"] < BRIEF else 0):
        best = min(best, paper_cpp.run(program, file, *arguments), key=lambda one: float(one["seconds"]))
    return best


def timed(problem: Problem, before: outcome.Round | None = None) -> tuple[outcome.Round, float]:
    """Our solution of a round, after another one of the same graph, and its seconds."""
    started = time.process_time()
    result = minimise.newton(problem, outcome.DEFAULT_LIMITS, before)
    return result, time.process_time() - started


CASE_TITLES = (
    "case", "vertices",
    "core F C++", "core F ours", "ratio", "keep 0",
    "final F C++", "final F ours", "ratio", "keep 0",
    "C++ ms", "rules ms", "rules it", "ours ms", "ours it", "ours/C++", "ours/rules",
    "race ms", "race it", "ours/race",
)  # fmt: skip

TIMES = ("cpp_seconds", "rules_seconds", "seconds", "race_seconds")


def case_cells(name: str, pair: Pair) -> list[str]:
    cells = [name, str(pair[0].vertices)]
    for one in pair:
        cells += [f"{one.cpp:.3e}", f"{one.ours:.3e}"]
        cells += ["zero" if one.zero else f"{ratio:.3f}" for ratio in (one.ratio, one.free_ratio)]
    cpp, rules, ours, race = (sum(getattr(one, field) for one in pair) for field in TIMES)
    return [
        *cells,
        f"{1e3 * cpp:.1f}",
        f"{1e3 * rules:.1f}",
        "+".join(str(one.rules_iterations) for one in pair),
        f"{1e3 * ours:.1f}",
        "+".join(str(one.iterations) for one in pair),
        f"{ours / cpp:.2f}",
        f"{ours / rules:.2f}",
        f"{1e3 * race:.1f}",
        "+".join(f"{one.race_iterations}" if one.reached else f">{one.race_iterations}" for one in pair),
        f"{ours / race:.2f}",
    ]


def summary(found: dict[str, Pair]) -> list[str]:
    """Medians, worst cases, and the rounds in which ours is worse.  Ratios leave out rounds with F = 0."""
    names = list(found)
    seconds = {
        field: np.array([sum(getattr(one, field) for one in pair) for pair in found.values()])
        for field in TIMES
    }
    lines = [
        '"rules": the C++ with the paper\'s stopping rules; "keep 0": the ratio with `keep_size` = 0; '
        f'"zero": our F is at most {ZERO:g}; "race": the C++ until its F is at most {NEAR:g} of ours '
        f'(or {ZERO:g}), ">" where it is not after {MOST} iterations.',
        "",
    ]
    for label, field in (
        ("100 + 100 iterations", "cpp_seconds"),
        ("the stopping rules", "rules_seconds"),
        ("as many iterations as our F takes (the race)", "race_seconds"),
    ):
        ratio = seconds["seconds"] / seconds[field]
        lines.append(
            f"* Time, ours / C++ with {label}: median {np.median(ratio):.2f}, greatest {ratio.max():.2f} "
            f"({names[int(ratio.argmax())]}); ours is faster in {int((ratio < 1.0).sum())} of {len(ratio)}; "
            f"all together {seconds['seconds'].sum():.3f} s / {seconds[field].sum():.3f} s."
        )
    there = [np.array([pair[which].reached for pair in found.values()]) for which in (0, 1)]
    both = int((there[0] & there[1]).sum())
    lines.append(
        f"* The race: the C++ gets to {NEAR:g} of our F within {MOST} iterations in {there[0].sum()} of "
        f"{len(found)} core rounds and {there[1].sum()} final ones, in both of {both}."
    )
    for which, title in enumerate(("core", "final")):
        distorted = {name: pair[which] for name, pair in found.items() if not pair[which].zero}
        for field, label in (("ratio", ""), ("free_ratio", ", `keep_size` = 0")):
            ratios = {name: getattr(one, field) for name, one in distorted.items()}
            if not ratios:
                continue
            worse = [f"{name} {ratio:.3f}" for name, ratio in ratios.items() if ratio > WORSE]
            greatest = max(ratios, key=lambda name: ratios[name])
            lines.append(
                f"* F of the {title} round, ours / C++{label}: "
                f"median {np.median(list(ratios.values())):.3f}, "
                f"greatest {ratios[greatest]:.3f} ({greatest}), zero by ours in {len(found) - len(ratios)}; "
                f"above {WORSE:g} in {len(worse)} of {len(found)}{': ' if worse else ''}{', '.join(worse)}."
            )
    return lines


# Growth with the number of vertices

GROWTH_TITLES = (
    "case", "spacing %", "vertices", "ours it", "ours s", "C++ s", "ours/C++",
    "core F ratio", "final F ratio", "ours MB", "C++ MB",
)  # fmt: skip


def growth(
    program: Path, folder: Path, entries: list[dict[str, Any]], repeat: int, say: Callable[..., None]
) -> None:
    """Print the table of growth and its exponents."""
    say(*header(GROWTH_TITLES))
    exponents = []
    for entry in entries:
        sizes, seconds = [], []
        for spacing in SPACINGS:
            one = grown(program, folder, entry, spacing, repeat)
            say(line(growth_cells(entry["name"], spacing, one), GROWTH_TITLES))
            sizes.append(one["vertices"])
            seconds.append([one["seconds"], one["cpp_seconds"]])
        ours, cpp = np.polyfit(np.log(sizes), np.log(seconds), 1)[0]
        exponents.append(f"* {entry['name']}: seconds ~ vertices^{ours:.2f} ours, vertices^{cpp:.2f} C++.")
    say(
        "",
        "Both rounds, the C++ with 100 + 100 iterations. MB: the peak of the process, for ours above what it "
        "had before it solved anything (interpreter, numpy, the problem itself).",
        "",
        *exponents,
    )


def grown(program: Path, folder: Path, entry: dict[str, Any], spacing: float, repeat: int) -> dict[str, Any]:
    """Times, iterations, energies and memory of one case at one spacing."""
    core, small = rounds.core_of(entry, spacing), rounds.core_of(entry).problem
    repeat = 1 if len(core.problem.start) > LARGE else repeat
    # A new process; a fork would begin with the memory of this one.
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        found, final = pool.apply(solve_alone, (small, core, repeat))
    ratios, cpp, memory = [], 0.0, 0
    for problem, ours in zip((core.problem, final), found["objective"]):
        file = folder / "problem.bin"
        paper_cpp.write_problem(problem, file)
        runs = [paper_cpp.run(program, file) for _ in range(repeat)]
        cpp += min(one["seconds"] for one in runs)
        memory = max([memory, *(one["peak_kilobytes"] for one in runs)])
        ratios.append(ours / runs[0]["least_objective"])
    return {**found, "cpp_seconds": cpp, "cpp_kilobytes": memory, "ratios": ratios}


def solve_alone(small: Problem, core: rounds.CoreRound, repeat: int) -> tuple[dict[str, Any], Problem]:
    """Our solution of both rounds, in a process that does nothing else.

    small : a problem to warm up with.  Returns figures and the final problem.
    """
    before = peak_kilobytes()
    timed(small)
    firsts = [timed(core.problem) for _ in range(repeat)]
    final = core.final(firsts[0][0].positions)
    lasts = [timed(final, firsts[0][0]) for _ in range(repeat)]
    solved = [(core.problem, firsts[0][0]), (final, lasts[0][0])]
    figures = {
        "vertices": len(core.problem.start),
        "iterations": [result.iterations for _, result in solved],
        "seconds": min(s for _, s in firsts) + min(s for _, s in lasts),
        "kilobytes": peak_kilobytes() - before,
        "objective": [terms.objective(problem, result.positions) for problem, result in solved],
    }
    return figures, final


def peak_kilobytes() -> int:
    """The most resident memory of this process so far.

    The figure of getrusage may include the process that started this one, so it is used only without /proc.
    """
    status = Path("/proc/self/status")
    found = re.search(r"VmHWM:\s*(\d+)", status.read_text() if status.exists() else "")
    return int(found.group(1)) if found else resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def growth_cells(name: str, spacing: float, one: dict[str, Any]) -> list[str]:
    return [
        name,
        f"{100 * spacing:g}",
        str(one["vertices"]),
        "+".join(str(n) for n in one["iterations"]),
        f"{one['seconds']:.3f}",
        f"{one['cpp_seconds']:.3f}",
        f"{one['seconds'] / one['cpp_seconds']:.2f}",
        *(f"{ratio:.3f}" for ratio in one["ratios"]),
        f"{one['kilobytes'] / 1024:.0f}",
        f"{one['cpp_kilobytes'] / 1024:.0f}",
    ]


# Tables


def header(titles: Sequence[str]) -> list[str]:
    rule = ["---" if n == 0 else "---:" for n in range(len(titles))]
    return [line(titles, titles), line(rule, titles)]


def line(cells: Sequence[str], titles: Sequence[str]) -> str:
    """A row of a Markdown table, padded so that it reads as it is."""
    widths = [max(len(title), 9 if n else 23) for n, title in enumerate(titles)]
    padded = [
        cell.rjust(width) if n else cell.ljust(width) for n, (cell, width) in enumerate(zip(cells, widths))
    ]
    return f"| {' | '.join(padded)} |"


if __name__ == "__main__":
    sys.exit(main())
