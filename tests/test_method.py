# SPDX-License-Identifier: GPL-2.0-or-later
"""docs/method.md is true: every equation has one function, and every place that it names exists."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Iterator

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "alup"
PAGE = (ROOT / "docs" / "method.md").read_text(encoding="utf-8")
ROWS = [line for line in PAGE.splitlines() if line.startswith("| ")]

PLACE = re.compile(r"`(\w+(?:/\w+)*\.py)` `(\w+)`")


def definitions(tree: ast.Module) -> Iterator[tuple[str, str]]:
    """Names that a module and its classes define, and their docstrings."""
    for node in ast.walk(tree):
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            yield node.name, ast.get_docstring(node) or ""
        elif isinstance(node, ast.Assign):
            yield from ((target.id, "") for target in node.targets if isinstance(target, ast.Name))


def parsed(file: Path) -> ast.Module:
    return ast.parse(file.read_text(encoding="utf-8"))


HOLDERS = [
    (text.split(":")[0], str(file.relative_to(PACKAGE)), name)
    for file in sorted(PACKAGE.rglob("*.py"))
    for name, text in definitions(parsed(file))
    if text.startswith("Eq. ")
]


@pytest.mark.parametrize("number", [6, *range(8, 23)])
def test_one_function_holds_each_equation(number: int) -> None:
    """`grep -rn '\"\"\"Eq. 8:' alup` has one answer, the one that the page gives."""
    found = [(file, name) for equation, file, name in HOLDERS if equation == f"Eq. {number}"]
    assert len(found) == 1
    row = next(line for line in ROWS if line.startswith(f"| Eq. {number} |"))
    assert PLACE.findall(row) == found


@pytest.mark.parametrize("place", sorted(set(PLACE.findall(PAGE))), ids=" ".join)
def test_every_place_that_the_page_names_exists(place: tuple[str, str]) -> None:
    file, name = place
    assert name in dict(definitions(parsed(PACKAGE / file)))


def test_every_departure_has_its_place() -> None:
    departures = [line for line in PAGE.split("## Departures")[1].splitlines() if line.startswith("| ")]
    rows = [line for line in departures if not line.startswith(("| ---", "| the paper"))]
    assert len(rows) > 30
    for row in rows:
        assert PLACE.search(row.rsplit("|", 2)[1]), row
