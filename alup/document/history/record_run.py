# SPDX-License-Identifier: GPL-2.0-or-later
"""Stores the former states of changed elements on them after a run, and codes of unmoved ones on the root."""

from __future__ import annotations

import re
from typing import Iterable

from lxml import etree

from ...model import Array
from ..tree import fingerprints
from ..tree.elements import ALUP_NS, COPY, EDITED, ORIGINAL, UNMOVED, Element, parent_matrix
from ..tree.undo_log import State, UndoLog
from . import stored_records
from .originals import NAMESPACES, any_stored, is_drawn
from .starting_state import StartingState

# The prefix with which lxml declares our namespace.
etree.register_namespace("alup", ALUP_NS)


def record_run(
    run_start: StartingState, undo_log: UndoLog, cuts: dict[Element, dict[int, list[float]]]
) -> None:
    """Store the former states of the elements that a run has changed.

    undo_log : of the changes of the run; cuts : of the written shapes, see `Record`
    """
    store = run_start.store
    new = {part for element in undo_log.added for part in element.iter()}
    touched = [e for e in undo_log.touched if e not in new and _is_in(e, store.svg)]
    older = list(store.records) if run_start.rebased else [e for e in run_start.back if _is_in(e, store.svg)]
    for element in dict.fromkeys([*older, *touched]):
        now, base = State.of(element), undo_log.before(element)
        record = store.records.get(element)
        if record is not None:
            found = run_start.undo_log.before(element) if element in run_start.back else base
            original = run_start.original(element, record, found)
        elif element in touched:
            original = base
        else:
            continue  # part of a restored copy that is unchanged
        made = stored_records.make(now, original, base, cuts.get(element, {}))
        undo_log.touch(element)
        stored_records.store(element, made, _digest(element) if made is not None and made.moves else None)
        if element in run_start.redrawn and is_drawn(element):
            element.attrib[EDITED] = "1"
    for element in run_start.redrawn.intersection(store.damaged).difference(touched):
        undo_log.touch(element)
        stored_records.store(element, None, None)


def _is_in(element: Element, svg: Element) -> bool:
    return element is svg or svg in element.iterancestors()


def _digest(element: Element) -> str | None:
    digest = fingerprints.of_element(element, parent_matrix(element))
    return None if digest is None else str(digest)


def note_unmoved(
    run_start: StartingState,
    undo_log: UndoLog,
    elements: list[tuple[Element, Array]],
    cutting: Iterable[Element],
) -> None:
    """Store on the root the codes of elements without a record.

    elements : shapes, texts and images with their matrices to root user units; cutting : clip paths and masks
    In a first run, or with a new base, they are all of the document, else those that took part.
    """
    svg = run_start.store.svg
    if not any_stored(svg):
        write_codes(svg, set(), undo_log)
        return
    known = set() if run_start.is_new_base else set(run_start.store.codes)
    known |= {
        fingerprints.code(element, matrix) for element, matrix in elements if ORIGINAL not in element.attrib
    }
    for clip in cutting:
        if COPY not in clip.attrib and not any(ORIGINAL in part.attrib for part in clip.iter()):
            known.add(fingerprints.clip_code(clip))
    write_codes(svg, known, undo_log)


def write_codes(svg: Element, known: set[str], undo_log: UndoLog) -> None:
    undo_log.touch(svg)
    if known:
        svg.attrib[UNMOVED] = fingerprints.codes_text(known)
    else:
        svg.attrib.pop(UNMOVED, None)


def declare_namespace(svg: Element) -> None:
    """Declare our namespace on the root before its first use, so that not every element declares it."""
    if ALUP_NS not in svg.nsmap.values():
        svg.attrib[UNMOVED] = ""  # setting an attribute makes lxml declare the namespace
        del svg.attrib[UNMOVED]


def tidy_namespace(svg: Element) -> None:
    """Remove the declaration of our namespace if nothing uses it any more."""
    if ALUP_NS not in svg.nsmap.values() or svg.xpath("boolean(//@alup:*)", namespaces=NAMESPACES):
        return
    prefixes = {prefix.decode() for prefix in re.findall(rb"\sxmlns:([^\s=]+)\s*=", etree.tostring(svg))}
    ours = {prefix for prefix, namespace in svg.nsmap.items() if namespace == ALUP_NS}
    etree.cleanup_namespaces(svg, keep_ns_prefixes=sorted(prefixes - ours))
