# SPDX-License-Identifier: GPL-2.0-or-later
"""What the benchmarks with a section in RESULTS.md share: arguments, cases, the section, the machine."""

from __future__ import annotations

import argparse
import datetime
import os
import platform
import re
from importlib import metadata
from pathlib import Path
from typing import Any

import clipart

_START = """# Results

Written by `against_paper.py` (cases, growth) and `process.py`, which say how it is measured.
"""


def parser(about: str | None) -> argparse.ArgumentParser:
    """A parser of `--write`.  about : the docstring of the benchmark, shown as it is"""
    made = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument("--write", type=Path, metavar="FILE", help="replace the section in this Markdown file")
    return made


def parser_of_cases(about: str | None) -> argparse.ArgumentParser:
    """A parser of `--write`, `--repeat` and the names of cases."""
    made = parser(about)
    made.add_argument("--repeat", type=int, default=3, metavar="N", help="times that everything is timed")
    made.add_argument("names", nargs="*", metavar="CASE", help="by default all")
    return made


def cases(names: list[str]) -> list[dict[str, Any]]:
    """The entries of `cases.json` with these names, or all.  Raises SystemExit if one is missing."""
    known = {entry["name"]: entry for entry in clipart.cases()}
    missing = [name for name in names if name not in known]
    if missing or not known:
        raise SystemExit(f"{clipart.FOLDER} has no case {', '.join(missing)}".rstrip() + "; set ALUP_CLIPART")
    return [known[name] for name in names or known]


def write_section(path: Path | None, title: str, lines: list[str]) -> None:
    """Put a section into a Markdown file, in place of an older one with this title.  None : do nothing"""
    if path is None:
        return
    text = path.read_text(encoding="utf-8") if path.exists() else _START
    parts = re.split(r"(?m)^(?=## )", text)
    kept = [part.rstrip() for part in parts if not part.startswith(f"## {title}\n")]
    path.write_text("\n\n".join([*kept, "\n".join([f"## {title}", "", *lines])]) + "\n", encoding="utf-8")


def machine(*tools: str) -> str:
    """The day, the processor, and the versions of Python, its packages, and the given tools."""
    info = Path("/proc/cpuinfo")
    models = re.findall(r"model name\s*: (.*)", info.read_text()) if info.exists() else []
    known = f"{models[0]}, {os.cpu_count()} cores" if models else platform.processor()
    versions = []
    for name in ("numpy", "scipy", "qdldl"):
        try:
            versions.append(f"{name} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            versions.append(f"no {name}")
    used = [f"{known}, one thread used", *tools]
    return (
        f"{datetime.date.today().isoformat()}; {'; '.join(used)}; "
        f"Python {platform.python_version()}, {', '.join(versions)}."
    )
