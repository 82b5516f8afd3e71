# SPDX-License-Identifier: GPL-2.0-or-later
"""What is asked for in a live window, and the way back to what was asked for before."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..document.grips import FRAME, Grip
from ..model import Array

# So many steps can be taken back; each is some hundred bytes.
MOST_STEPS = 200


@dataclass(frozen=True)
class Asked:
    """grips : in the order in which they came; hold, method : see `options.Options`

    regular : whether what is regular is to stay so
    """

    grips: tuple[Grip, ...]
    hold: str
    method: str
    regular: bool = True

    def grip(self, name: str) -> Grip | None:
        return next((grip for grip in self.grips if grip.name == name), None)

    def with_(self, *grips: Grip) -> Asked:
        """With these instead of those of the same names, or besides."""
        new = {grip.name: grip for grip in grips}
        kept = tuple(new.pop(grip.name, grip) for grip in self.grips)
        return replace(self, grips=(*kept, *new.values()))

    def without(self, *names: str) -> Asked:
        return replace(self, grips=tuple(grip for grip in self.grips if grip.name not in names))

    def frame_around(self, point: Array) -> Grip | None:
        """The frame in which a point (2,) of the drawing that a run starts from is."""
        for grip in self.grips:
            if grip.kind == FRAME and (
                (point >= grip.rest.min(axis=0)).all() and (point <= grip.rest.max(axis=0)).all()
            ):
                return grip
        return None

    def same(self, other: Asked) -> bool:
        """Whether the same is asked for, to the last bit."""
        return (
            (self.hold, self.method, self.regular) == (other.hold, other.method, other.regular)
            and same_held(self.grips, other.grips)
            and all((a.now == b.now).all() for a, b in zip(self.grips, other.grips))
        )


def same_held(some: tuple[Grip, ...], others: tuple[Grip, ...]) -> bool:
    """Whether grips hold the same, wherever they are to go."""
    return len(some) == len(others) and all(
        a.name == b.name and (a.rest == b.rest).all() for a, b in zip(some, others)
    )


class History:
    """now : what is asked for; a step is what stands between two calls of `commit`."""

    def __init__(self, start: Asked):
        self.now = start
        self._steps = [start]
        self._at = 0

    @property
    def start(self) -> Asked:
        return self._steps[0]

    @property
    def can_undo(self) -> bool:
        return self._at > 0 or not self.now.same(self._steps[self._at])

    @property
    def can_redo(self) -> bool:
        return self._at + 1 < len(self._steps)

    def commit(self) -> None:
        """Make what has changed since the last time a step; what was undone is gone then."""
        if self.now.same(self._steps[self._at]):
            return
        first = max(self._at + 2 - MOST_STEPS, 0)
        self._steps = [*self._steps[first : self._at + 1], self.now]
        self._at = len(self._steps) - 1

    def undo(self) -> None:
        self.commit()
        self._at = max(self._at - 1, 0)
        self.now = self._steps[self._at]

    def redo(self) -> None:
        self._at = min(self._at + 1, len(self._steps) - 1)
        self.now = self._steps[self._at]
