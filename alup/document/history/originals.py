# SPDX-License-Identifier: GPL-2.0-or-later
"""The originals of reshaped elements: later runs start from them, and *Restore original* restores them.

A run stores on each changed element how to restore it (`stored_records`), and a fingerprint of what it wrote
(`fingerprints`).  A later run first puts the originals back into the tree, and then works like the first one.
So small drags add up to a large one, and parts whose handles were removed return to their original.

    base      the state that runs start from, common to the whole document
    original  the first state, which *Restore original* restores; at first the same as the base

Originals are used only if everything that takes part is as the last run left it.  If something was edited,
moved or drawn since, the originals of the rest do not fit to it.  Then the present state becomes the new base
of the whole document, and the new original of edited elements.  Elements that no run has moved have no
record; the codes on the root distinguish them from elements drawn later.  A motion of everything together,
including the handles, is applied to the originals.

A gradient or clip path that a run changed in place is put back together with its elements.  If other elements
now use it as well, a restored copy is added.  Copies that runs have added (`alup:copy`) are removed when
nothing refers to them any more.
"""

from __future__ import annotations

from typing import Iterable

from ...messages.errors import DocumentError
from ...model import Array
from ...svg import basic_shapes
from ..followers import paints
from ..followers.clip_following import PROPERTIES as CLIPPING
from ..followers.filters import PROPERTY as FILTER
from ..tree import fingerprints
from ..tree.elements import (
    ALUP_NS,
    EDITED,
    ORIGINAL,
    UNMOVED,
    WHOLE,
    WRITTEN,
    Element,
    Shape,
    local_tag,
    own_matrix,
    parent_matrix,
    read_shape,
)
from ..tree.fingerprints import Digest
from ..tree.references import SERVERS, Ids, referred
from ..tree.styles import Styles
from ..tree.undo_log import State, UndoLog
from . import stored_records
from .stored_records import Record

# Properties of an element that refer to clips, masks and filters, which are put back with it.
CUTTING = (*CLIPPING, FILTER)

_UNDRAWN = ("defs", "symbol", "clipPath", "mask", "marker", "pattern")

NAMESPACES = {"alup": ALUP_NS}


class Store:
    """The data that earlier runs have stored in a document."""

    def __init__(self, svg: Element):
        self.svg = svg
        self.records: dict[Element, Record] = {}
        self.damaged: list[Element] = []
        for element in svg.xpath("//*[@alup:original]", namespaces=NAMESPACES):
            record = stored_records.from_text(element.attrib[ORIGINAL])
            if record is None:
                self.damaged.append(element)
            else:
                self.records[element] = record
        self.codes = fingerprints.read_codes(svg.attrib.get(UNMOVED) or "")
        self._moves: dict[Element, Array | None] = {}

    def __bool__(self) -> bool:
        return bool(self.records or self.damaged)

    @property
    def all(self) -> list[Element]:
        """All elements with stored data, readable or not."""
        return [*self.records, *self.damaged]

    def concerned(self, elements: Iterable[Element], styles: Styles, ids: Ids) -> list[Element]:
        """The elements that have a record, or that are cut by something that has one.

        An element may be unmoved while its clip path has moved.
        """
        clips = any(
            local_tag(part) in ("clipPath", "mask", "filter")
            for e in self.records
            for part in e.iterancestors()
        )
        return [
            element
            for element in elements
            if element in self.records or (clips and self._is_cut_by_recorded(element, styles, ids))
        ]

    def _is_cut_by_recorded(self, element: Element, styles: Styles, ids: Ids) -> bool:
        targets = Targets([element], styles, ids)
        return any(part in self.records for clip in targets.clips for part in clip.iter())

    def is_settled(self, element: Element, matrix: Array, motion: Array | None = None) -> bool:
        """Whether an element with a record is as the run wrote it.

        matrix : own coordinates -> root user units; motion : (3, 3) motion of the whole drawing since then
        """
        record = self.records[element]
        digest = Digest.read(element.attrib.get(WRITTEN) or "")
        if digest is None:
            return not record.moves
        move = self.move(element)
        return move is not None and digest.still_there(under(matrix, move), motion)

    def move(self, element: Element) -> Array | None:
        """The move (3, 3) that was written into the path data of an element since its record was stored.

        None for any other edit.  The first call has to precede the putting back of originals.
        """
        if element not in self._moves:
            digest = Digest.read(element.attrib.get(WRITTEN) or "")
            self._moves[element] = None if digest is None else digest.move_in(element)
        return self._moves[element]

    def of_other_moments(self, scope: set[Element]) -> list[Element]:
        """The elements of a scope whose originals do not fit to those of the others.

        They were edited later, so their originals are younger, or missing.
        """
        mine = [e for e, record in self.records.items() if e in scope and record.moves and is_drawn(e)]
        edited = [e for e in scope if EDITED in e.attrib and is_drawn(e)]
        if not edited and any(self._is_of_old_kind(element) for element in mine):
            edited = [e for e in scope if e not in self.records and is_drawn(e) and self._is_known(e)]
        first = [element for element in mine if element not in edited]
        order = {element: n for n, element in enumerate(self.svg.iter())}
        return sorted(edited, key=lambda element: order[element]) if first else []

    def _is_of_old_kind(self, element: Element) -> bool:
        """Whether a record was written by a version that did not mark elements without an original."""
        digest = Digest.read(element.attrib.get(WRITTEN) or "")
        record = self.records[element]
        based = record.base is not None and record.base.attributes != record.original.attributes
        return based and digest is not None and digest.axes is None and local_tag(element) == "path"

    def _is_known(self, element: Element) -> bool:
        try:
            matrix = parent_matrix(element) @ own_matrix(element)
        except DocumentError:
            return False  # it has no part in runs
        return fingerprints.code(element, matrix) in self.codes

    def base_shape(self, element: Element, matrix: Array) -> Shape:
        """The shape of an element in the base."""
        move = self.move(element)
        matrix = matrix if move is None else under(matrix, move)
        undo_log = UndoLog()
        undo_log.put(element, self.records[element].start(State.of(element)))
        try:
            return read_shape(element, matrix)
        finally:
            undo_log.toggle()


def under(matrix: Array, move: Array) -> Array:
    """The matrix (2, 3) of an element with a move that is no longer in its path data."""
    return matrix[:2] @ move


def marked(svg: Element) -> list[Element]:
    """Elements with any stored data or mark."""
    found = svg.xpath(
        "//*[@alup:original or @alup:written or @alup:copy or @alup:edited]", namespaces=NAMESPACES
    )
    return list(found)


def any_stored(svg: Element) -> bool:
    return bool(svg.xpath("boolean(//*[@alup:original])", namespaces=NAMESPACES))


def is_drawn(element: Element) -> bool:
    """Whether an element is a shape, text or image of the drawing, not part of a clip path or the like."""
    tags = {local_tag(ancestor) for ancestor in element.iterancestors()}
    return local_tag(element) in ("path", *basic_shapes.TAGS, *WHOLE) and tags.isdisjoint(_UNDRAWN)


class Targets:
    """Clip paths, masks and paint servers that elements and their groups refer to.

    clips : target -> an element that refers to it, including targets that cut other clips
    servers : target -> all elements that refer to it
    """

    def __init__(self, elements: Iterable[Element], styles: Styles, ids: Ids):
        self.clips: dict[Element, Element] = {}
        self.servers: dict[Element, list[Element]] = {}
        self._styles, self._ids = styles, ids
        seen: set[Element] = set()
        for element in elements:
            self._paints_of(element)
            for part in (element, *element.iterancestors()):
                if part in seen:
                    break
                seen.add(part)
                self._clips_of(part)

    def _clips_of(self, element: Element) -> None:
        for name in CUTTING:
            target = self._ids.get(referred(self._styles.own(element, name)))
            if target is None or target in self.clips:
                continue
            self.clips[target] = element
            for part in target.iter():
                if local_tag(part):
                    self._paints_of(part)
                    self._clips_of(part)

    def _paints_of(self, element: Element) -> None:
        for name in paints.PROPERTIES:
            target = self._ids.get(referred(self._styles.inherited(element, name)))
            if target is not None and local_tag(target) in SERVERS:
                self.servers.setdefault(target, []).append(element)
