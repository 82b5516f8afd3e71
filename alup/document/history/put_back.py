# SPDX-License-Identifier: GPL-2.0-or-later
"""Puts originals back into the tree, with their clip paths and gradients."""

from __future__ import annotations

import copy
import re

import numpy as np
from lxml import etree

from ...model import Array
from ...svg import basic_shapes
from ..followers import clip_finding, paints
from ..tree.css import with_property
from ..tree.elements import (
    CONTAINERS,
    WHOLE,
    WRITTEN,
    Element,
    local_name,
    local_tag,
    own_matrix,
    parent_matrix,
    transform_text,
)
from ..tree.fingerprints import Digest
from ..tree.pending_changes import Changes, mark_copy
from ..tree.references import SERVERS, Ids, redirected, referred
from ..tree.styles import Styles
from ..tree.undo_log import State, UndoLog
from . import stored_records
from .originals import CUTTING, NAMESPACES, Store, Targets
from .stored_records import Record


class PutBack:
    """Puts the base, or the first original, of elements and their clips and paints into the tree.

    back : the elements that are put back, including restored copies
    unknown : elements that keep their present clip or paint, because the original one is not in the drawing
    """

    def __init__(self, store: Store, undo_log: UndoLog, first: bool, ids: Ids):
        self.back: set[Element] = set()
        self.unknown: list[Element] = []
        self._store, self._undo_log, self._first, self._ids = store, undo_log, first, ids

    def put(self, mine: list[Element]) -> None:
        """Put these elements back, then the targets that they now refer to."""
        for element in mine:
            if element not in self.back:
                self._put(element)
        for group in dict.fromkeys(group for element in mine for group in element.iterancestors()):
            self._put_group(group)
        done: set[Element] = set()
        while self._put_targets(mine, done):
            pass
        self._put_moved_paints()
        self._remove_free_copies()

    def _put_targets(self, mine: list[Element], done: set[Element]) -> bool:
        """Put back clip paths and paint servers that are not done yet; returns whether there were any.

        A clip path that cuts another one follows it, and paints come last, because copies refer to them, too.
        """
        styles, records_ = Styles(self._store.svg), self._store.records
        targets = Targets(mine, styles, self._ids)
        cutting = [c for c in targets.clips if c not in done and any(part in records_ for part in c.iter())]
        painting = [server for server in targets.servers if server not in done and server in records_]
        if cutting:
            users = clip_finding.users_of(styles, self._ids, CUTTING)
            outer = [c for c in cutting if not any(_is_within(user, cutting) for user in users[c])]
            for clip in outer or cutting:
                self._put_target(clip, CUTTING, styles, users[clip])
            done.update(outer or cutting)
        elif painting:
            users = paints.users_of(styles, self._ids)
            for server in painting:
                self._put_target(server, paints.PROPERTIES, styles, users[server])
            done.update(painting)
        return bool(cutting or painting)

    def _state(self, element: Element) -> State:
        record, now = self._store.records[element], State.of(element)
        state = record.first(now) if self._first else record.start(now)
        return self._with_known_references(element, now, moved_along(element, now, state, record))

    def _with_known_references(self, element: Element, now: State, state: State) -> State:
        """The state with present references where the original target is missing, as after a paste."""
        attributes = dict(state.attributes)
        before, present = (stored_records.properties(one.attributes.get("style")) for one in (state, now))
        for name, value in state.attributes.items():
            if name != "style" and self._is_unknown(value) and name in now.attributes:
                attributes[name] = now.attributes[name]
        for name, value in before.items():
            if self._is_unknown(value) and name in present:
                attributes["style"] = with_property(attributes["style"], name, present[name])
        if attributes != state.attributes:
            self.unknown.append(element)
        return State(state.tag, attributes)

    def _is_unknown(self, value: str) -> bool:
        target = referred(value)
        return target is not None and self._ids.get(target) is None

    def _put(self, element: Element) -> None:
        if element in self._store.records:  # else only its clip has moved
            self._store.move(element)
            self._undo_log.put(element, self._state(element))
        self.back.add(element)

    def _put_group(self, group: Element) -> None:
        """Put back the live effect of a group, but only if all elements that it bends are put back."""
        records_ = self._store.records
        if group not in records_ or group in self.back:
            return
        parts = [part for part in group.iter() if part in records_]
        if all(part in self.back or not records_[part].moves for part in parts):
            for part in parts:
                self._put(part)

    def _put_target(
        self, target: Element, names: tuple[str, ...], styles: Styles, users: set[Element]
    ) -> None:
        """Put a target back in place if all its users are put back; else add a copy for those that are."""
        mine = [user for user in users if self._is_back(user)]
        if len(mine) == len(users):
            for part in target.iter():
                if part in self._store.records and part not in self.back:
                    self._put(part)
        elif mine:
            twin = self._twin(target)
            changes = Changes(styles, self._undo_log)
            value_of = styles.own if names == CUTTING else styles.inherited
            for user in mine:
                for name in names:
                    value = value_of(user, name)
                    if value is not None and self._ids.get(referred(value)) is target:
                        changes.set_property(user, name, redirected(value, twin.attrib["id"]), user)
            changes.apply()

    def _put_moved_paints(self) -> None:
        """Correct paints that a program has copied and moved with a path, whose transform now has the move.

        A copy of what a run has written becomes a copy of its original.  Any other copy keeps its position on
        the path.
        """
        styles, records_ = Styles(self._store.svg), self._store.records
        for server, painted in paints.users_of(styles, self._ids).items():
            strange = server not in records_ and WRITTEN not in server.attrib
            if not (strange and painted and paints.in_user_space(server, self._ids)):
                continue
            move = self._common_move(painted)
            if move is None or np.array_equal(move, np.eye(3)):
                continue
            name = SERVERS[local_tag(server)][1]
            mine = np.linalg.solve(move, own_matrix(server, name))
            self._undo_log.touch(server)
            text = self._first_transform(server, name, mine)
            if text is None:
                server.attrib.pop(name, None)
            else:
                server.attrib[name] = text

    def _common_move(self, painted: set[Element]) -> Array | None:
        """The move (3, 3) in the path data of all these elements if they are put back and agree."""
        if not painted <= (self.back & self._store.records.keys()):
            return None
        first, *others = (self._store.move(user) for user in painted)
        if first is None:
            return None
        same = (other is not None and np.allclose(other, first, rtol=0.0, atol=1e-3) for other in others)
        return first if all(same) else None

    def _first_transform(self, server: Element, name: str, mine: Array) -> str | None:
        """The transform before the runs, if the present one is one that a run wrote elsewhere."""
        for origin in self._ids.chain(server)[1:]:
            record, written = self._store.records.get(origin), self._undo_log.before(origin)
            digest = Digest.read(written.attributes.get(WRITTEN) or "")
            if record is None or digest is None:
                continue
            if np.allclose(mine, digest.matrix, rtol=1e-4, atol=1e-3):
                state = record.first(written) if self._first else record.start(written)
                return state.attributes.get(name)
        return transform_text(mine)

    def _twin(self, target: Element) -> Element:
        """A restored copy of a clip path or gradient, with new ids, behind it in the tree."""
        twin = copy.deepcopy(target)
        for part, original in zip(twin.iter(), target.iter()):
            if original in self._store.records:
                self._state(original).put(part)
            if isinstance(part.tag, str) and part.attrib.get("id"):
                part.attrib["id"] = self._ids.new(part.attrib["id"])
                self._ids.elements[part.attrib["id"]] = part
        mark_copy(twin)
        self._undo_log.insert_after(target, twin)
        self.back.update(part for part in twin.iter() if local_tag(part))
        return twin

    def _is_back(self, user: Element) -> bool:
        """Whether an element is put back, or all its descendants that have an original."""
        if user in self.back or local_tag(user) not in (*CONTAINERS, "clipPath", "mask"):
            return user in self.back
        parts = [part for part in user.iter() if part in self._store.records]
        return bool(parts) and all(part in self.back for part in parts)

    def _remove_free_copies(self) -> None:
        """Remove the copies that nothing refers to, repeatedly, because a copy may refer to another one."""
        svg = self._store.svg
        copies = svg.xpath("//*[@alup:copy]", namespaces=NAMESPACES)
        while True:
            text = etree.tostring(svg) if copies else b""
            free = next((element for element in copies if _is_free(element, text)), None)
            if free is None:
                return
            self._undo_log.remove(free)
            copies.remove(free)


def _is_within(element: Element, targets: list[Element]) -> bool:
    return element in targets or any(ancestor in targets for ancestor in element.iterancestors())


def _is_free(element: Element, text: bytes) -> bool:
    """Whether no other element refers to an element.  text : the whole document"""
    pattern = re.compile(rb"#" + re.escape(element.attrib.get("id", "").encode()) + rb"(?![\w.:-])")
    return len(pattern.findall(text)) == len(pattern.findall(etree.tostring(element, with_tail=False)))


def moved_along(element: Element, found: State, state: State, record: Record) -> State:
    """The original state of an element, with the moves that the user has made since the run.

    found : its present state; state : the original state by its record
    """
    digest = Digest.read(found.attributes.get(WRITTEN) or "")
    if digest is None:
        return state
    if local_name(found.tag) in ("path", *basic_shapes.TAGS):
        return _path_moved_along(element, found, state, record, digest)
    if local_name(found.tag) not in WHOLE:
        return state
    written = found.attributes.get("transform") or ""
    outer = parent_matrix(element)
    now = outer @ own_matrix(element, "transform", written)
    if digest.still_there(now) or digest.is_text(written):
        return state
    motion = now @ np.linalg.inv(digest.matrix)
    was = own_matrix(element, "transform", state.attributes.get("transform") or "")
    return _transformed(state, np.linalg.solve(outer, motion @ outer) @ was)


def _path_moved_along(element: Element, found: State, state: State, record: Record, digest: Digest) -> State:
    """`moved_along` of a path: a move in the present path data is put into the transform."""
    present = element.makeelement(found.tag, found.attributes)
    move = digest.move_in(present)
    names = ("d", *basic_shapes.GEOMETRY.get(local_name(found.tag), ()))
    if move is None or all(state.attributes.get(name) == found.attributes.get(name) for name in names):
        return state
    texts = [one.attributes.get("transform") or "" for one in (found, state)]
    is_moved = not np.array_equal(move, np.eye(3))
    if "transform" in record.given:
        texts.append(record.given["transform"] or "")
        is_moved = is_moved or texts[0] != texts[2]
    if not is_moved:
        return state
    now, was, *written = (own_matrix(element, text=text) for text in texts)
    if written:  # the transform was changed by the run as well, or before a later run
        return _transformed(state, now @ move @ np.linalg.solve(written[0], was))
    return _transformed(state, now @ move)


def _transformed(state: State, matrix: Array) -> State:
    return State(state.tag, {**state.attributes, "transform": transform_text(matrix)})
