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

from typing import Callable

from .task import Deformed as Deformed
from .task import Task as Task


def _poisson(task: Task) -> Deformed:
    from . import poisson

    return poisson.deform(task)


def _killing(task: Task) -> Deformed:
    from . import killing

    return killing.deform(task)


def _puppet(task: Task) -> Deformed:
    from . import puppet

    return puppet.deform(task)


def _arap(task: Task) -> Deformed:
    from . import arap

    return arap.deform(task)


# Their modules are imported by the run that uses them: ALUP's own start stays short.
METHODS: dict[str, Callable[[Task], Deformed]] = {
    "poisson": _poisson,
    "killing": _killing,
    "puppet": _puppet,
    "arap": _arap,
}
