# SPDX-License-Identifier: GPL-2.0-or-later
"""Changes of the tree that can be taken back, and made again.

A change is either the earlier `State` of an element, or an element that was added or taken out.  Elements
keep their identity, because lxml lets even a tag be changed in place.  So taking changes back and making them
again are one operation: both exchange the stored states with the present ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .elements import Element, parent_of


@dataclass(frozen=True)
class State:
    """All of an element that a run may change.  attributes : in their order

    tag : text, but what lxml has in its place for comments and the like
    """

    tag: Any
    attributes: dict[str, str]

    @classmethod
    def of(cls, element: Element) -> State:
        return cls(element.tag, dict(element.attrib))

    def same(self, other: State) -> bool:
        """Whether the two are equal to the letter, the order of attributes included."""
        return self.tag == other.tag and list(self.attributes.items()) == list(other.attributes.items())

    def put(self, element: Element) -> None:
        """Make the element this, the order of its attributes included."""
        if element.tag != self.tag:
            element.tag = self.tag
        if list(element.attrib.items()) != list(self.attributes.items()):
            element.attrib.clear()
            for name, value in self.attributes.items():
                element.attrib[name] = value


class UndoLog:
    """What elements were before somebody changed them."""

    def __init__(self) -> None:
        self._saved: dict[Element, State] = {}
        # Parent, element, index, whether it is in the tree now.
        self._moves: list[tuple[Element, Element, int, bool]] = []

    def touch(self, element: Element) -> None:
        """Call this before changing an element's tag or attributes."""
        if element not in self._saved:
            self._saved[element] = State.of(element)

    def put(self, element: Element, state: State) -> None:
        self.touch(element)
        state.put(element)

    def insert_after(self, element: Element, new: Element) -> None:
        """Add an element behind another one, with the same white space behind it."""
        parent = parent_of(element)
        index = parent.index(element) + 1
        tail = element.tail or ""
        new.tail = tail if not tail.strip() else None
        parent.insert(index, new)
        self._moves.append((parent, new, index, True))

    def remove(self, element: Element) -> None:
        """Take an element out, and the white space behind it."""
        parent = parent_of(element)
        index = parent.index(element)
        parent.remove(element)
        self._moves.append((parent, element, index, False))

    def toggle(self) -> None:
        """Take all changes back; or, the next time, make them again."""
        for element, state in list(self._saved.items()):
            self._saved[element] = State.of(element)
            state.put(element)
        moves, self._moves = self._moves, []
        for parent, element, index, inside in reversed(moves):
            if inside:
                parent.remove(element)
            else:
                parent.insert(index, element)
            self._moves.append((parent, element, index, not inside))

    @property
    def touched(self) -> list[Element]:
        return list(self._saved)

    @property
    def added(self) -> list[Element]:
        """Elements that are in the tree now and were not before."""
        return [element for _, element, _, inside in self._moves if inside]

    @property
    def removed(self) -> list[Element]:
        return [element for _, element, _, inside in self._moves if not inside]

    def before(self, element: Element) -> State:
        """What the element was before the first change in this log; the changes must not be taken back
        then.
        """
        return self._saved[element] if element in self._saved else State.of(element)

    def __bool__(self) -> bool:
        return bool(self._saved or self._moves)
