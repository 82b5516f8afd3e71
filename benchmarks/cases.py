#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Run the effect on every case of a clip-art folder and print a table of results.

python benchmarks/cases.py [--out FOLDER] [NAME ...]
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

import clipart
import measure

COLUMNS = (
    "case",
    "vert",
    "comp",
    "nodes",
    "iter",
    "E core",
    "E final",
    "handle",
    "turn",
    "exact",
    "corner",
    "ms",
)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", help="keep before and after files here")
    parser.add_argument(
        "--option", action="append", default=[], help="passed to the effect, e.g. --option=--solver=paper"
    )
    parser.add_argument("names", nargs="*")
    given = parser.parse_args()
    folder = Path(given.out or tempfile.mkdtemp(prefix="alup-cases-"))
    folder.mkdir(parents=True, exist_ok=True)
    print("  ".join(f"{name:>9}" if n else f"{name:<24}" for n, name in enumerate(COLUMNS)))
    failed = 0
    kept = segments = 0
    for entry in clipart.cases():
        if given.names and entry["name"] not in given.names:
            continue
        built = clipart.build(entry)
        before, after = folder / f"{entry['name']}.before.svg", folder / f"{entry['name']}.svg"
        report = folder / f"{entry['name']}.json"
        built.tree.write(str(before))
        command = [sys.executable, str(ROOT / "alup_reshape.py"), f"--output={after}", f"--report={report}"]
        command += [f"--id={identity}" for identity in built.ids] + given.option + [str(before)]
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        if run.returncode or run.stderr:
            failed += 1
            print(f"{entry['name']:<24}  FAILED: {run.stderr.strip()[-300:]}")
            continue
        said = json.loads(report.read_text())
        found = measure.compare(before, after, built.ids, entry)
        kept += found.segments_kept
        segments += found.segments
        # Other methods have no rounds.
        energy = [one["energy"]["alup"][-1] for one in said["rounds"]] or [math.nan, math.nan]
        iterations = "+".join(str(one["iterations"]) for one in said["rounds"])
        row = (
            f"{said['vertices']}", f"{said['components']}", f"{found.nodes_after}/{found.nodes_before}",
            iterations,
            f"{energy[0]:.3g}", f"{energy[1]:.3g}", f"{found.handle_error:.1e}",
            f"{said['turning_degrees']['mean']:.2f}",
            "" if found.exact_error is None else f"{found.exact_error:.1e}", f"{found.worst_corner:.2f}",
            f"{1000 * said['seconds']['all']:.0f}",
        )  # fmt: skip
        print("  ".join([f"{entry['name']:<24}"] + [f"{value:>9}" for value in row]), flush=True)
    if segments:
        print(
            f"segments kept as one: {kept} of {segments} ({100.0 * kept / segments:.2f} %); failed: {failed}"
        )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
