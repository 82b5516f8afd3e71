#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Time the whole effect as a process against an effect of inkex that does nothing, on every case.

python benchmarks/process.py [--repeat N] [--write FILE] [NAME ...]

Both read the same file and write one, under this Python, in turns.  The time of each is the least processor
time of N runs.  The stages are times on the clock from the report of another run; `start` is the time of
imports.
"""

from __future__ import annotations

import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import one_thread  # noqa: F401 - for the processes that are started, too

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

import clipart
import results

NOTHING = """import inkex


class Nothing(inkex.EffectExtension):
    def effect(self):
        pass

    def has_changed(self, ret):
        return True


Nothing().run()
"""

# The goal for the median ratio.
ASKED = 2.5

STAGES = ("start", "read", "network", "sample", "ties", "solve", "refit", "write")


def main() -> int:
    given = results.parser_of_cases(__doc__).parse_args()
    lines = list(table(given.names, given.repeat))
    results.write_section(given.write, "The whole effect against one that does nothing", lines)
    return 0


def table(names: list[str], repeat: int) -> list[str]:
    """The table's lines, printed as they come."""
    lines: list[str] = []

    def say(line: str) -> None:
        print(line, flush=True)
        lines.append(line)

    say(f"| {'case':<23} | nothing ms | effect ms | ratio | " + " | ".join(STAGES) + " |")
    say("| --- |" + " ---: |" * (3 + len(STAGES)))
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for entry in results.cases(names):
            row = measure(entry, Path(folder), repeat)
            rows.append(row)
            stages = " | ".join(f"{1000.0 * row['stages'].get(name, 0.0):.0f}" for name in STAGES)
            say(
                f"| {entry['name']:<23} | {1000 * row['nothing']:.0f} | {1000 * row['effect']:.0f} "
                f"| {row['effect'] / row['nothing']:.2f} | {stages} |"
            )
    ratios = [row["effect"] / row["nothing"] for row in rows]
    say("")
    say(
        f"* Effect / do-nothing effect, processor time: median {statistics.median(ratios):.2f}, "
        f"greatest {max(ratios):.2f}; "
        f"{sum(ratio <= ASKED for ratio in ratios)} of {len(ratios)} at most {ASKED}."
    )
    for name in STAGES:
        values = [1000.0 * row["stages"].get(name, 0.0) for row in rows]
        say(f"* {name}: median {statistics.median(values):.0f} ms, all cases {sum(values):.0f} ms.")
    say("")
    say(results.machine())
    return lines


def measure(entry: dict, folder: Path, repeat: int) -> dict:
    """Least seconds of both, and the stages of the effect."""
    built = clipart.build(entry)
    before, after, report = folder / "before.svg", folder / "after.svg", folder / "report.json"
    nothing = folder / "nothing.py"
    nothing.write_text(NOTHING, encoding="utf-8")
    built.tree.write(str(before))
    ids = [f"--id={identity}" for identity in built.ids]
    effect = [sys.executable, str(ROOT / "alup_reshape.py"), *ids, f"--output={after}", str(before)]
    least = {"nothing": float("inf"), "effect": float("inf")}
    for _ in range(repeat):
        seconds = run([sys.executable, str(nothing), *ids, f"--output={after}", str(before)])
        least["nothing"] = min(least["nothing"], seconds)
        least["effect"] = min(least["effect"], run(effect))
    run([*effect, f"--report={report}"])
    return {**least, "stages": json.loads(report.read_text(encoding="utf-8"))["seconds"]}


def run(command: list[str]) -> float:
    """The processor's seconds for a command."""
    # Bytecode is kept, as in an installed extension.
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    began = children()
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    seconds = children() - began
    if done.returncode or done.stderr:
        raise SystemExit(f"{' '.join(command)} failed: {done.stderr.strip()[-500:]}")
    return seconds


def children() -> float:
    """Processor's seconds of all processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    sys.exit(main())
