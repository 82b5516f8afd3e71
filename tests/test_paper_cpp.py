# SPDX-License-Identifier: GPL-2.0-or-later
"""The C++ program of the benchmark computes the same as `alup.solver.alternation` and `alup.energy.terms`."""

from __future__ import annotations

import subprocess
from pathlib import Path

import networks
import numpy as np
import paper_cpp
import pytest
from builders import BLOB, drag, drawing, pin, stages

from alup.energy import terms
from alup.energy.problem import Problem
from alup.model import Ties
from alup.solver import paper_scheme
from alup.solver.alternation import Alternation

pytestmark = pytest.mark.skipif(
    paper_cpp.compiler() is None or paper_cpp.eigen() is None, reason="needs g++ and Eigen"
)

# More optimisation doubles the time to compile Eigen.
FLAGS = ("-O1", "-DNDEBUG", "-std=c++17")


def problems() -> dict[str, Problem]:
    """Both rounds of a part of lines and curves with a corner at a handle; the core's result is made up."""
    handles = [pin(10, 80), drag((150, 75), (170, 60)), pin(60, 130)]
    made = stages(drawing(BLOB, handles=handles), tied=False)
    points = made.samples.points
    noise = np.random.default_rng(5).standard_normal(points.shape)
    result = points + 0.002 * np.ptp(points, axis=0).max() * noise
    return {"core": made.problem, "final": networks.final(made.problem, result, made.samples, Ties.none())}


def blob() -> Problem:
    return problems()["core"]


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return paper_cpp.build(tmp_path_factory.mktemp("paper"), FLAGS)


@pytest.mark.parametrize("name", problems())
def test_iterations_are_those_of_the_alternation(name: str, program: Path, tmp_path: Path) -> None:
    problem = problems()[name]
    steps = Alternation(problem)
    v, l = problem.start, problem.lengths
    seen = []
    for _ in range(5):
        v = steps.positions(v, l)
        l = steps.lengths(v)
        seen.append(terms.terms(problem, v))
    paper_cpp.write_problem(problem, tmp_path / "problem")
    output = tmp_path / "positions"
    # Two increments, as the alternation makes.
    arguments = ("--iterations", "5", "--increments", "2", "--output", str(output))
    said = paper_cpp.run(program, tmp_path / "problem", *arguments)
    assert np.abs(v - problem.start).max() > 0.1
    assert np.fromfile(output, dtype="<f8").reshape(-1, 2) == pytest.approx(v, abs=1e-7)
    assert (said["vertices"], said["iterations"]) == (len(v), 5)
    assert said["objective"] == pytest.approx(seen[-1]["objective"], rel=1e-6)
    assert said["alup"] == pytest.approx(seen[-1]["alup"], rel=1e-6)
    assert said["least_objective"] == pytest.approx(min(one["objective"] for one in seen), rel=1e-6)


@pytest.mark.parametrize("name", problems())
def test_the_stopping_rules_are_the_papers(name: str, program: Path, tmp_path: Path) -> None:
    problem = problems()[name]
    wanted = paper_scheme.paper(problem)
    paper_cpp.write_problem(problem, tmp_path / "problem")
    output = tmp_path / "positions"
    arguments = ("--rules", "--increments", "2", "--output", str(output))
    said = paper_cpp.run(program, tmp_path / "problem", *arguments)
    assert (said["status"], said["iterations"]) == (wanted.status.name, wanted.iterations)
    assert np.fromfile(output, dtype="<f8").reshape(-1, 2) == pytest.approx(wanted.positions, abs=1e-6)


def test_one_increment_gives_the_same_energy(program: Path, tmp_path: Path) -> None:
    """So the benchmark, in which the C++ makes one increment, is fair."""
    paper_cpp.write_problem(blob(), tmp_path / "problem")
    one, two = (paper_cpp.run(program, tmp_path / "problem", "--increments", n) for n in "12")
    assert one["least_objective"] == pytest.approx(two["least_objective"], rel=1e-4)


def test_the_race_ends_as_soon_as_the_objective_is_low_enough(program: Path, tmp_path: Path) -> None:
    file = tmp_path / "problem"
    paper_cpp.write_problem(blob(), file)
    seen = [paper_cpp.run(program, file, "--iterations", str(n))["objective"] for n in (6, 7)]
    assert seen[1] < seen[0]
    for goal, iterations in ((seen[0], 6), (0.5 * (seen[0] + seen[1]), 7)):
        said = paper_cpp.run(program, file, "--iterations", "50", "--until", repr(goal))
        assert (said["status"], said["iterations"]) == ("REACHED", iterations)
    said = paper_cpp.run(program, file, "--iterations", "50", "--until", repr(0.0))
    assert (said["status"], said["iterations"]) == ("ITERATIONS", 50)


def test_a_bad_file_is_refused(program: Path, tmp_path: Path) -> None:
    paper_cpp.write_problem(blob(), tmp_path / "problem")
    whole = (tmp_path / "problem").read_bytes()
    for content, why in ((whole[:-8], "too short"), (b"something else", "not a problem")):
        (tmp_path / "bad").write_bytes(content)
        done = subprocess.run([str(program), str(tmp_path / "bad")], capture_output=True, text=True)
        assert (done.returncode, done.stdout) == (1, "")
        assert why in done.stderr
