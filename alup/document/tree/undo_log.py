# SPDX-License-Identifier: GPL-2.0-or-later
"""Changes of the tree that can be undone and redone.

A change is either the earlier `State` of an element, or an element that was added or taken out.  Elements
keep their identity, because lxml lets even a tag be changed in place.  So undo and redo are one operation,
which exchanges the stored states with the present ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .elements import Element, parent_of


@dataclass(frozen=True)
class State:
    """The part of an element that a run may change.

    attributes : in their order; tag : a text, or lxml's function for comments and processing instructions
    """

    tag: Any
    attributes: dict[str, str]

    @classmethod
    def of(cls, element: Element) -> State:
        return cls(element.tag, dict(element.attrib))

    def same(self, other: State) -> bool:
        """Whether both are identical, including the order of attributes."""
        return self.tag == other.tag and list(self.attributes.items()) == list(other.attributes.items())

    def put(self, element: Element) -> None:
        """Give the element this state, including the order of its attributes."""
        if element.tag != self.tag:
            element.tag = self.tag
        if list(element.attrib.items()) != list(self.attributes.items()):
            element.attrib.clear()
            for name, value in self.attributes.items():
                element.attrib[name] = value


class UndoLog:
    """The states of elements before they were changed."""

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
        """Add an element behind another one, and copy the white space that follows."""
        parent = parent_of(element)
        index = parent.index(element) + 1
        tail = element.tail or ""
        new.tail = tail if not tail.strip() else None
        parent.insert(index, new)
        self._moves.append((parent, new, index, True))

    def remove(self, element: Element) -> None:
        """Remove an element with the white space behind it."""
        parent = parent_of(element)
        index = parent.index(element)
        parent.remove(element)
        self._moves.append((parent, element, index, False))

    def toggle(self) -> None:
        """Undo all changes; the next call makes them again."""
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
        """The element's state before the first change in this log.  The changes must be in effect."""
        return self._saved[element] if element in self._saved else State.of(element)

    def __bool__(self) -> bool:
        return bool(self._saved or self._moves)
