# SPDX-License-Identifier: GPL-2.0-or-later
"""The table of alternative deformation methods, for comparison and for reposing.

ALUP keeps orientations and lets scale change.  The earlier methods do the opposite, or something between:

* `poisson` keeps the gradient of the curves themselves, rotations held to identity;
* `killing` moves the plane along vector fields that are as near to rigid as they can be;
* `puppet` blends one rigid motion per handle with bounded biharmonic weights;
* `arap` keeps every triangle of the plane as rigid as possible.

The first two need only this package; the others need libigl.  Each takes a `Task` and returns the positions
of all samples.  Network, handles, sampling, refit and document code are the same as for ALUP.
"""

from __future__ import annotations

import importlib
from functools import partial
from typing import Callable

from .task import Deformed, Task


def _deform(name: str, task: Task) -> Deformed:
    """Import the method's module and run it.  The late import keeps ALUP's own start short."""
    return importlib.import_module(f".{name}", __package__).deform(task)


METHODS: dict[str, Callable[[Task], Deformed]] = {
    name: partial(_deform, name) for name in ("poisson", "killing", "puppet", "arap")
}
