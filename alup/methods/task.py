# SPDX-License-Identifier: GPL-2.0-or-later
"""What a method is given and what it returns."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ..geometry.arrays import Array
from ..network.sampling import Graph


@dataclass(frozen=True)
class Task:
    """The input of a method.

    graph : the N samples that move; handles : (H,) int, samples that are held, each once
    targets : (H, 2) user units, where they go
    scaffold : (T, 2) int, pairs of samples of separate parts; every part has a handle, or the scaffold joins
        it to a part that has one
    """

    graph: Graph
    handles: Array
    targets: Array
    scaffold: Array


@dataclass(frozen=True)
class Deformed:
    """The output of a method.  moved : (N, 2) user units; figures : the method's own, ready for JSON."""

    moved: Array
    figures: dict[str, Any] = field(default_factory=dict)
