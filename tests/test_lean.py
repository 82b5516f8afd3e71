# SPDX-License-Identifier: GPL-2.0-or-later
"""Which modules of scipy a run imports, and that the others can still be imported."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from alup import scipy_imports

ROOT = Path(__file__).resolve().parents[1]

START = """
import json, sys
sys.path.insert(0, sys.argv[1])
"""

LEFT_OUT = (
    "scipy.linalg", "scipy.special", "scipy.sparse.linalg",
    "numpy.f2py", "numpy.testing", "numpy.ma", "pydoc",
)  # fmt: skip


def told(program: str) -> Any:
    command = [sys.executable, "-c", START + program, str(ROOT)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert not done.stderr
    return json.loads(done.stdout)


def test_the_start_does_not_import_what_no_run_uses() -> None:
    found = told("import alup_reshape; print(json.dumps(sorted(sys.modules)))")
    assert {"scipy.sparse.csgraph", "scipy.spatial"} <= set(found)
    assert not set(LEFT_OUT) & set(found)


def test_no_placeholder_stays_among_the_modules() -> None:
    program = """
from alup import scipy_imports as lean
lean.prepare()
print(json.dumps([name for name, module in sys.modules.items() if isinstance(module, lean._Later)]))
"""
    assert told(program) == []


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("csgraph.laplacian(np.array([[0.0, 1.0], [1.0, 0.0]])).tolist()", [[1.0, -1.0], [-1.0, 1.0]]),
        ("scipy.spatial.distance.euclidean([0, 0], [3, 4])", 5.0),
        ("scipy.spatial.procrustes(np.eye(3), 2.0 * np.eye(3))[2] < 1e-12", True),
        ("scipy.spatial.geometric_slerp([1, 0], [0, 1], [0.0]).tolist()", [[1.0, 0.0]]),
        ("scipy.spatial.transform.Rotation.identity().magnitude()", 0.0),
        ("scipy.linalg.norm([3.0, 4.0])", 5.0),
        ("splu_of(np.eye(2)).solve(np.ones(2)).tolist()", [1.0, 1.0]),
        ("minimize(lambda x: float(x[0] ** 2), [1.0]).success", True),
        ("len(np.random.default_rng(1).random(3))", 3),
        ("isinstance(np.random.default_rng(1), np.random.Generator)", True),
        ("np.unique(np.ma.array([1, 1, 2], mask=[0, 0, 1])).tolist()", [1, None]),
        ("np.unique([2, 1, 1]).tolist()", [1, 2]),
        ("np.ma.isMaskedArray(np.ma.array([1.0]))", True),
        ("[float(np.median([3.0, 1.0, 2.0])), 'numpy.ma' in sys.modules]", [2.0, False]),
    ],
)
def test_modules_that_were_left_out_are_imported_when_used(expression: str, value: Any) -> None:
    program = f"""
from alup import scipy_imports as lean
lean.prepare()
import numpy as np, scipy, scipy.spatial
from scipy.sparse import csc_matrix, csgraph


def splu_of(matrix):
    from scipy.sparse.linalg import splu
    return splu(csc_matrix(matrix))


def minimize(*arguments):
    from scipy.optimize import minimize
    return minimize(*arguments)


print(json.dumps(bool(found) if type(found := {expression}).__name__.startswith("bool") else found))
"""
    assert told(program) == value


def test_another_scipy_is_imported_as_it_is() -> None:
    """If a package uses at import what is left out, scipy is imported in full."""
    program = """
from alup import scipy_imports as lean
lean._HANDED_ON += ("scipy.sparse._base",)
lean.prepare()
import numpy, scipy.sparse.csgraph, scipy.spatial
matrix = scipy.sparse.csr_matrix(numpy.eye(3))
print(json.dumps([scipy.sparse.csgraph.connected_components(matrix)[0], scipy.spatial.cKDTree([[0]]).n]))
"""
    assert told(program) == [3, 1]


def test_placeholder_docstrings_work_with_scipys_decorators() -> None:
    """As in 1.17 (reads the parameters) and 1.18 (adds a note, cuts off the first line)."""
    text = scipy_imports._NoText()
    assert text["Parameters"] == []
    text["Notes"].append("a note")
    assert text["Notes"] == ["a note"]
    assert str(text).split("\n", 1)[1] == ""
