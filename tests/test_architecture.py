"""Data flows one way: who may import whom, and which Python each file is written for."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "alup"

# The stages in the order in which data passes them; what is not listed is of no stage.
STAGES = [
    "document", "network", "sample", "handles", "crossings", "scaffold", "problem", "nearness", "ties",
    "metrics", "energy", "alternation", "runs", "objective", "newton", "coarse", "solve", "methods", "ends",
    "fit", "refit", "keptfit", "options", "rounds", "frames", "session", "pipeline",
]  # fmt: skip

# Shared by all: the records, the errors, the language of messages, and arithmetic that knows no stage.
SHARED = {"model", "errors", "language", "bezier"}

# Whom a module of no stage may know, besides what is shared.
HELPERS = {
    "pathdata": set(),
    "shapes": set(),
    "nodetypes": {"pathdata"},
    "contacts": {"arcs", "boxes", "meetings", "stretches", "components"},
    "stretches": {"arcs", "meetings"},
    "meetings": {"arcs"},
    "arcs": {"boxes"},
    "boxes": set(),
    "intersections": {"boxes"},
    "spots": {"pathdata"},
    "quadratic": set(),
    "components": set(),
    "order": set(),
    "startup": {"lean"},
    "setup": {"startup"},
    "lean": set(),
}

# inkex, the user's document and what stands for them.
INKEX_MAY_BE_IMPORTED_BY = {PACKAGE / "document"}

MODULES = sorted(PACKAGE.rglob("*.py"))
EFFECTS = sorted(ROOT.glob("alup_*.py"))


def tree(file: Path) -> ast.Module:
    return ast.parse(file.read_text(encoding="utf-8"), filename=str(file))


def name_of(file: Path) -> str:
    """The module's own name, without the package's; "document" for all that is in it."""
    parts = file.relative_to(PACKAGE).with_suffix("").parts
    return parts[0] if parts != ("__init__",) else ""


def imports(file: Path) -> set[str]:
    """Absolute names of the modules that a file imports, wherever in it."""
    package = list(file.relative_to(ROOT).parent.parts)
    found = set()
    for node in ast.walk(tree(file)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*base, *(node.module or "").split(".")]).strip(".")
            found |= {f"{module}.{alias.name}" for alias in node.names} | {module}
    return found


def siblings(file: Path) -> set[str]:
    """Modules of the package that a file imports, by their own names."""
    known = {name_of(other) for other in MODULES}
    return {name.split(".")[1] for name in imports(file) if name.startswith("alup.")} & known - {
        name_of(file)
    }


def test_the_imports_are_seen() -> None:
    wanted = {"network", "refit", "sample", "scaffold", "ties", "solve", "rounds"}
    assert siblings(PACKAGE / "session.py") >= wanted
    assert "inkex" in imports(PACKAGE / "document" / "tree.py")
    assert "pathdata" in siblings(PACKAGE / "document" / "tree.py")


def test_every_module_has_its_place() -> None:
    """A new module belongs into one of the lists above; the folder is to show the flow."""
    assert {name_of(file) for file in MODULES} - {""} == {*STAGES, *SHARED, *HELPERS}


@pytest.mark.parametrize("file", MODULES, ids=lambda file: str(file.relative_to(PACKAGE)))
def test_no_module_imports_a_later_stage(file: Path) -> None:
    name = name_of(file)
    if name == "document":
        # Reading is the first stage and writing the last: only what refit hands on is of a stage.
        assert siblings(file) - SHARED - set(HELPERS) <= {"refit"}
        return
    if name in STAGES:
        later = set(STAGES[STAGES.index(name) + 1 :]) | {"document"}
        assert not siblings(file) & later
    elif name in HELPERS:
        assert siblings(file) <= HELPERS[name] | SHARED
    elif name in SHARED:
        assert siblings(file) <= SHARED


def test_imports_have_no_cycles() -> None:
    graph: dict[str, set[str]] = {}
    for file in MODULES:
        graph.setdefault(name_of(file), set()).update(siblings(file))
    # model asks bezier for the bounds of curves, within a function: the one tie that goes back.
    graph["model"].discard("bezier")
    done: set[str] = set()
    while len(done) < len(graph):
        ready = {name for name, needs in graph.items() if name not in done and needs <= done}
        assert ready, {name: needs - done for name, needs in graph.items() if name not in done}
        done |= ready


@pytest.mark.parametrize("file", MODULES, ids=lambda file: str(file.relative_to(PACKAGE)))
def test_inkex_is_known_to_the_document_only(file: Path) -> None:
    knows = any(name.split(".")[0] in ("inkex", "lxml") for name in imports(file))
    assert not knows or file.parent in INKEX_MAY_BE_IMPORTED_BY


def test_the_core_runs_without_inkex() -> None:
    import subprocess

    program = (
        "import sys; sys.modules['inkex'] = sys.modules['lxml'] = None; import alup.pipeline, alup.pathdata;"
        "import alup.shapes, alup.nodetypes"
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
