# SPDX-License-Identifier: GPL-2.0-or-later
"""The C++ program `paper.cpp`: compiling it, writing a problem's file for it, and running it."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any, Sequence

import numpy as np

from alup.energy.problem import Problem

SOURCE = Path(__file__).with_name("paper.cpp")
FLAGS = ("-O3", "-march=native", "-DNDEBUG", "-std=c++17")

# Folders that are searched for Eigen, after $EIGEN_INCLUDE.
EIGEN_FOLDERS = (
    "/usr/include/eigen3",
    "/usr/local/include/eigen3",
    "/opt/homebrew/include/eigen3",
    "/opt/local/include/eigen3",
)

# The arrays of the file in their order.  An exclamation mark ends the names of arrays of integers.
_ARRAYS = (
    "start", "edges!", "normals", "lengths", "directions", "turn_ij!", "turn_ik!", "ratio", "turn_weight",
    "straight!", "straight_ij!", "straight_ik!", "bend", "handles!", "targets",
)  # fmt: skip


def write_problem(problem: Problem, path: Path) -> None:
    """Write the file that the program reads; it knows neither E_size nor ties, and gets an empty scaffold."""
    p, w = problem, problem.weights
    assert not p.size.any(), "the paper's energy has no E_size"
    assert not len(p.tie_weight), "the paper's energy has no ties"
    counted = (p.start, p.edges, p.turn_ij, p.straight, p.handles, ())
    with path.open("wb") as file:
        file.write(b"ALUP-1\n\0")
        file.write(np.array([len(array) for array in counted], dtype="<i4").tobytes())
        file.write(np.array([w.normal, w.tangent, w.edge, w.straight, w.handle], dtype="<f8").tobytes())
        for name in _ARRAYS:
            kind = "<i4" if name.endswith("!") else "<f8"
            file.write(np.ascontiguousarray(getattr(p, name.rstrip("!")), dtype=kind).tobytes())


def compiler() -> str | None:
    """The C++ compiler, or None."""
    return shutil.which(os.environ.get("CXX", "g++"))


def eigen() -> str | None:
    """The folder that contains Eigen/Sparse, or None."""
    folders = [os.environ.get("EIGEN_INCLUDE", ""), *EIGEN_FOLDERS]
    return next((folder for folder in folders if folder and (Path(folder) / "Eigen/Sparse").exists()), None)


def versions() -> str:
    """Compiler, flags and Eigen."""
    said = subprocess.run([str(compiler()), "--version"], capture_output=True, text=True, check=True).stdout
    macros = (Path(str(eigen())) / "Eigen/src/Core/util/Macros.h").read_text(encoding="utf-8")
    numbers = re.findall(r"#define EIGEN_(?:WORLD|MAJOR|MINOR)_VERSION (\d+)", macros)
    return f"{said.splitlines()[0]} {' '.join(FLAGS)}; Eigen {'.'.join(numbers)}"


def build(folder: Path, flags: Sequence[str] = FLAGS) -> Path:
    """Compile the program into a folder.  Raises RuntimeError when that can't be done."""
    cxx, include = compiler(), eigen()
    if cxx is None or include is None:
        raise RuntimeError(
            "g++ and Eigen are needed: apt install g++ libeigen3-dev, or set CXX, EIGEN_INCLUDE"
        )
    program = folder / "paper"
    command = [cxx, *flags, f"-isystem{include}", str(SOURCE), "-o", str(program)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(done.stderr)
    return program


def run(program: Path, problem: Path, *arguments: str) -> dict[str, Any]:
    """The program's output for a problem's file."""
    command = [str(program), str(problem), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)
