# SPDX-License-Identifier: GPL-2.0-or-later
"""What a method is given and what it returns."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ..model import Array
from ..network.sampling import Graph


@dataclass(frozen=True)
class Task:
    """graph : the N samples that move; handles : (H,) samples, each once; targets : (H, 2) user units.

    scaffold : (T, 2) samples of separate parts that belong together; every part has a handle or is joined
    by it to one that has
    """

    graph: Graph
    handles: Array
    targets: Array
    scaffold: Array


@dataclass(frozen=True)
class Deformed:
    """moved : (N, 2) user units; figures : of the method, ready for JSON."""

    moved: Array
    figures: dict[str, Any] = field(default_factory=dict)
