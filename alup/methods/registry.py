# SPDX-License-Identifier: GPL-2.0-or-later
"""Other ways to deform the same samples by the same handles, to compare with and to repose by.

ALUP keeps orientations and lets scale change.  What artists had before does the opposite or something
between:

* `poisson` keeps the gradient of the curves themselves, rotations held to identity;
* `killing` moves the plane along vector fields that are as near to rigid as they can be;
* `puppet` blends one rigid motion per handle with bounded biharmonic weights;
* `arap` keeps every triangle of the plane as rigid as possible.

The first two need nothing but this package; the others libigl.  Each takes a `Task` and returns positions
of all samples; network, handles, samples, refit and document are ALUP's.
"""

from __future__ import annotations

import importlib
from functools import partial
from typing import Callable

from .task import Deformed, Task


def _deform(name: str, task: Task) -> Deformed:
    """By the module of this name, which only a run that uses it imports: ALUP's own start stays short."""
    return importlib.import_module(f".{name}", __package__).deform(task)


METHODS: dict[str, Callable[[Task], Deformed]] = {
    name: partial(_deform, name) for name in ("poisson", "killing", "puppet", "arap")
}
