# SPDX-License-Identifier: GPL-2.0-or-later
"""Fixtures: one installed copy for all tests, a screen and an Inkscape for each worker."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Iterator

import inkscape as harness
import pytest
from hypothesis import settings

# Assertions of helpers show their values, as those of tests do.
pytest.register_assert_rewrite("companions", "placed", "reruns", "fuzzing", "joined")

# Examples of hypothesis are the same in every run, so that a failure on one machine is one on all machines.
# ALUP_EXAMPLES=free draws new examples, and prints how to repeat a failure.
settings.register_profile("same", derandomize=True, database=None)
settings.register_profile("free", derandomize=False, print_blob=True)
settings.load_profile(os.environ.get("ALUP_EXAMPLES", "same"))

# Messages are compared in English.
os.environ["LANGUAGE"] = "en"


@pytest.fixture(scope="session")
def installed(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Path:
    """Home folder of a person for whom install.sh has been run; look at it, change only a `clone`.

    The packages are downloaded once, whichever worker comes first.
    """
    import fcntl  # Windows has none, where only tests without an installed copy run

    shared = tmp_path_factory.getbasetemp()
    if worker_id != "master":
        shared = shared.parent
    home = shared / "installed" / "home"
    home.mkdir(parents=True, exist_ok=True)
    with open(shared / "installed" / "lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (harness.extensions_of(home) / harness.NAME).exists():
            done = harness.install(home)
            assert done.returncode == 0, done.stdout + done.stderr
    return home


@pytest.fixture(scope="session")
def display() -> Iterator[str]:
    """Name of a virtual screen."""
    process, name = harness.start_display()
    yield name
    process.terminate()
    process.wait()


@pytest.fixture(scope="session")
def inkscape(installed: Path, display: str, tmp_path_factory: pytest.TempPathFactory) -> harness.Inkscape:
    """Inkscape with the installed extension: `inkscape.reshape(svg, select=[...], params={...})`."""
    return harness.Inkscape(harness.extensions_of(installed), tmp_path_factory.mktemp("inkscape"), display)
