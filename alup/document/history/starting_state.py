# SPDX-License-Identifier: GPL-2.0-or-later
"""Decides whether a run starts from the stored originals, or from the drawing as it is now.

It starts from the originals if everything that takes part is still as the last run left it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Callable

import numpy as np

from ...model import Array
from ..followers import paints
from ..tree import fingerprints
from ..tree.elements import WHOLE, WRITTEN, Element, local_tag, name_of, own_matrix, parent_matrix
from ..tree.fingerprints import Digest
from ..tree.references import SERVERS, Ids
from ..tree.styles import Styles
from ..tree.undo_log import State, UndoLog
from .originals import Store, Targets, is_drawn, under
from .put_back import PutBack, moved_along
from .stored_records import Record


@dataclass
class StartingState:
    """What a run starts from.

    undo_log : puts the originals into the tree; they are there only while the drawing is read and written
    back : the elements whose originals it puts back
    edited : names of what was changed or drawn since the last run; then no original is put back
    redrawn : elements whose present state becomes their original
    motion : (3, 3) the map by which everything together was moved since the last run
    """

    store: Store
    undo_log: UndoLog = field(default_factory=UndoLog)
    back: set[Element] = field(default_factory=set)
    edited: list[str] = field(default_factory=list)
    redrawn: set[Element] = field(default_factory=set)
    motion: Array | None = None

    @property
    def again(self) -> bool:
        """Whether the run starts from originals."""
        return bool(self.back)

    @property
    def rebased(self) -> bool:
        """Whether the run can't start from originals although there are some."""
        return bool(self.edited)

    def original(self, element: Element, record: Record, found: State) -> State:
        """The original of an element that has a record.  found : its state before the run"""
        if element in self.redrawn:
            return found
        return moved_along(element, found, record.first(found), record)

    def placed(self, drawn: list[tuple[Element, Array]]) -> list[tuple[Element, Array]]:
        """Shapes with their matrices (2, 3) for the time while the originals are in the tree."""
        return _with_moves(self.store, drawn) if self.again else drawn

    @property
    def is_new_base(self) -> bool:
        """Whether later runs will start from the same state as this one."""
        return self.rebased or not self.store

    @property
    def from_original(self) -> list[str]:
        """Names of the shapes, texts and images that were put back."""
        return [name_of(e) for e in self.store.records if e in self.back and is_drawn(e)]


def begin(
    svg: Element,
    shapes: list[tuple[Element, Array]],
    carried: list[tuple[Element, Array]],
    styles: Styles,
    ids: Ids,
    followed_by_handles: Callable[[Array], bool],
) -> StartingState:
    """Put the originals of everything that takes part into the tree, if they fit to the present state.

    shapes : with their matrices to root user units; carried : texts and images with their parents' matrices
    followed_by_handles : whether the handles have taken part in a (3, 3) motion of the drawing
    """
    store = Store(svg)
    run_start = StartingState(store)
    if not store:
        return run_start
    located = [*shapes, *((element, outer @ own_matrix(element)) for element, outer in carried)]
    run_start.motion = _common_motion(store, _with_moves(store, located), followed_by_handles)
    mine = store.concerned((element for element, _ in located), styles, ids)
    changed = _changed(store, located, run_start.motion) + _changed_targets(store, mine, styles, ids)
    done = False
    try:
        if not changed:
            going_back = PutBack(store, run_start.undo_log, False, Ids(svg))
            going_back.put(mine)
            run_start.back = going_back.back
            changed = _strange_clips(run_start, [element for element, _ in located])
        done = not changed
    finally:
        if not done:
            run_start.undo_log.toggle()
    if not changed:
        return run_start
    names = [name_of(element) for element in dict.fromkeys(changed)]
    redrawn = _redrawn(store, changed, styles, ids)
    return StartingState(store, edited=names, redrawn=redrawn, motion=run_start.motion)


def _redrawn(store: Store, changed: list[Element], styles: Styles, ids: Ids) -> set[Element]:
    """Elements whose own outline was edited, and the clips and paints that only they use.

    Elements that were only moved, or painted differently, keep their originals.
    """
    found = {element for element in changed if element in store.damaged}
    for element, record in store.records.items():
        if record.moves and store.move(element) is None:
            found.add(element)
    mine, others = (
        Targets([e for e in store.records if (e in found) is redrawn and is_drawn(e)], styles, ids)
        for redrawn in (True, False)
    )
    for clip in mine.clips.keys() - others.clips.keys():
        found.update(part for part in clip.iter() if part in store.records)
    return found | set(mine.servers.keys() - others.servers.keys())


def _with_moves(store: Store, located: list[tuple[Element, Array]]) -> list[tuple[Element, Array]]:
    """The elements with the moves of their path data included in the matrices."""
    found = []
    for element, matrix in located:
        move = store.move(element) if element in store.records else None
        found.append((element, matrix if move is None else under(matrix, move)))
    return found


def _common_motion(
    store: Store, located: list[tuple[Element, Array]], followed_by_handles: Callable[[Array], bool]
) -> Array | None:
    """The common (3, 3) motion since the last run of all elements with a record and the handles, or None."""
    found: list[Array] = []
    for element, matrix in located:
        digest = Digest.read(element.attrib.get(WRITTEN) or "") if element in store.records else None
        if digest is None:
            continue
        if not found:
            if digest.still_there(matrix):
                return None
            whole = np.vstack([matrix[:2], [0.0, 0.0, 1.0]])
            found.append(whole @ np.linalg.inv(digest.matrix))
        if not digest.still_there(matrix, found[0]):
            return None
    return found[0] if found and followed_by_handles(found[0]) else None


def _changed(store: Store, located: list[tuple[Element, Array]], motion: Array | None) -> list[Element]:
    """Shapes, texts and images that are not as the last run left them."""
    found = []
    for element, matrix in located:
        if element in store.records:
            as_it_was = store.is_settled(element, matrix, motion)
        else:
            as_it_was = (
                element not in store.damaged and fingerprints.code(element, matrix, motion) in store.codes
            )
        if not as_it_was:
            found.append(element)
    return found


def _changed_targets(store: Store, mine: list[Element], styles: Styles, ids: Ids) -> list[Element]:
    """Clip paths, gradients and the like, of elements with a record, that are not as the last run left them.

    A gradient in user space that has neither a record nor a mark was assigned later.  (Paints of texts and
    images move with them, and are not changed by runs.)
    """
    found = []
    targets = Targets(mine, styles, ids)
    for clip in targets.clips:
        for part in clip.iter():
            if part in store.damaged or (part in store.records and not _settled_inside(store, part)):
                found.append(part)
            elif part not in store.records and part.attrib.get(WRITTEN):
                digest = Digest.read(part.attrib[WRITTEN])
                if digest is None or not digest.still_drawn(part):
                    found.append(part)
    for server, painted in targets.servers.items():
        mine_of_it = [e for e in painted if e in store.records and local_tag(e) not in WHOLE]
        if server in store.damaged:
            found.append(server)
        elif server in store.records:
            found += [] if _settled_inside(store, server) else painted[:1]
        elif mine_of_it and paints.in_user_space(server, ids):
            digest = Digest.read(server.attrib.get(WRITTEN) or "")
            if digest is None or not digest.unchanged(fingerprints.of_copy(server)):
                found += mine_of_it
    return found


def _settled_inside(store: Store, element: Element) -> bool:
    if local_tag(element) in SERVERS:
        name = SERVERS[local_tag(element)][1]
        digest = Digest.read(element.attrib.get(WRITTEN) or "")
        return digest is not None and digest.still_there(own_matrix(element, name))
    return store.is_settled(element, parent_matrix(element) @ own_matrix(element))


def _strange_clips(run_start: StartingState, taking_part: list[Element]) -> list[Element]:
    """Elements with clip paths or masks that are neither put back nor known from the last run."""
    styles, ids = Styles(run_start.store.svg), Ids(run_start.store.svg)
    found = []
    for clip, user in Targets(taking_part, styles, ids).clips.items():
        if local_tag(clip) == "filter":
            continue
        known = any(part in run_start.back or part.attrib.get(WRITTEN) for part in clip.iter())
        if not known and fingerprints.clip_code(clip) not in run_start.store.codes:
            found.append(user)
    return found
