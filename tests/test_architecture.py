# SPDX-License-Identifier: GPL-2.0-or-later
"""For which Python the files are written, and what none of them may do (pyproject.toml has the layers)."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "alup"

MODULES = sorted(PACKAGE.rglob("*.py"))
EFFECTS = sorted(ROOT.glob("alup_*.py"))


def tree(file: Path) -> ast.Module:
    return ast.parse(file.read_text(encoding="utf-8"), filename=str(file))


def test_faces_import_nothing() -> None:
    """Importing one module of a room imports no other one: the start stays short, and no circle arises."""
    for file in PACKAGE.rglob("__init__.py"):
        body = tree(file).body
        names = [node.targets for node in body[1:] if isinstance(node, ast.Assign)]
        assert len(names) == len(body) - 1, file


def test_the_core_runs_without_inkex() -> None:
    import subprocess

    program = (
        "import sys; sys.modules['inkex'] = sys.modules['lxml'] = None; import alup.session.pipeline;"
        "import alup.svg.path_data, alup.svg.basic_shapes, alup.svg.node_types"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("file", [*EFFECTS, *MODULES], ids=lambda file: str(file.relative_to(ROOT)))
def test_the_oldest_python_can_read_it(file: Path) -> None:
    """Grammar of 3.8, and no annotation that it would have to evaluate."""
    source = file.read_text(encoding="utf-8")
    parsed = ast.parse(source, feature_version=(3, 8))
    functions = [node for node in ast.walk(parsed) if isinstance(node, (ast.FunctionDef, ast.Lambda))]
    annotated = [
        node
        for node in functions
        if isinstance(node, ast.FunctionDef) and (node.returns or _annotations(node))
    ]
    if annotated:
        assert "from __future__ import annotations" in source


def _annotations(node: ast.FunctionDef) -> list[ast.expr]:
    return [arg.annotation for arg in [*node.args.args, *node.args.kwonlyargs] if arg.annotation]


def _evaluated(parsed: ast.Module) -> list[ast.AST]:
    """All nodes that run, annotations left out."""
    skipped = set()
    for node in ast.walk(parsed):
        parts = []
        if isinstance(node, ast.FunctionDef):
            parts = [node.returns, *(arg.annotation for arg in [*node.args.args, *node.args.kwonlyargs])]
        elif isinstance(node, ast.AnnAssign):
            parts = [node.annotation]
        skipped |= {id(inner) for part in parts if part is not None for inner in ast.walk(part)}
    return [node for node in ast.walk(parsed) if id(node) not in skipped]


@pytest.mark.parametrize("file", [*EFFECTS, *MODULES], ids=lambda file: str(file.relative_to(ROOT)))
def test_no_builtin_type_is_subscripted_where_it_runs(file: Path) -> None:
    """list[int] is a TypeError in Python 3.8 anywhere but in an annotation."""
    builtins = {"list", "dict", "tuple", "set", "frozenset", "type"}
    for node in _evaluated(tree(file)):
        if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name):
            assert node.value.id not in builtins, node.lineno


@pytest.mark.parametrize("file", [*EFFECTS, *MODULES], ids=lambda file: str(file.relative_to(ROOT)))
def test_nothing_is_printed(file: Path) -> None:
    """Inkscape takes stdout for the drawing."""
    for node in ast.walk(tree(file)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            assert node.func.id != "print", node.lineno


def test_every_module_says_what_it_is_for() -> None:
    for file in [*EFFECTS, *MODULES]:
        assert ast.get_docstring(tree(file)), file


def test_every_source_names_its_licence() -> None:
    folders = ("alup", "tests", "benchmarks", "docs", "locale")
    sources = [
        file for name in folders for file in (ROOT / name).rglob("*") if file.suffix in (".py", ".sh", ".cpp")
    ]
    for file in [*sources, *EFFECTS, ROOT / "install.sh"]:
        head = file.read_text(encoding="utf-8")[:200]
        assert "SPDX-License-Identifier: GPL-2.0-or-later\n" in head, file
