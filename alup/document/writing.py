# SPDX-License-Identifier: GPL-2.0-or-later
"""Drawing -> SVG: new path data for the elements that moved, in their own coordinates.

All changes are computed before the first one is applied: path data and node types, then the followers of the
shapes (`followers`), then the records for later runs (`history`) and the handles.  If one fails while they
are applied, the undo log reverts the others, and the document is unchanged.
"""

from __future__ import annotations

from typing import Collection

import numpy as np

from ..messages.errors import DocumentError
from ..messages.language import N_
from ..model import Array, Refitted
from ..svg import basic_shapes, node_types, path_data
from . import handle_marks
from .followers import clip_finding, clip_following, filters, kept_shapes, markers, paints
from .followers.clones import Followers
from .followers.motion import Moved, Points, joined, moved_shape, of_corners
from .followers.texts_and_images import as_the_rest, carry
from .handles.handle_objects import remove, settle
from .history.correspondence import cuts_of
from .history.originals import any_stored
from .history.record_run import declare_namespace, note_unmoved, record_run
from .history.stored_records import plain
from .reading import Document, skipping, skipping_css
from .tree.drawn_elements import walk
from .tree.elements import (
    INKSCAPE_NS,
    SODIPODI_NS,
    Element,
    Shape,
    local_tag,
    own_matrix,
    parent_matrix,
    tag_of,
)
from .tree.pending_changes import Changes, mark_copy
from .tree.references import referred
from .tree.undo_log import State, UndoLog

# Moves up to this part of the diagonal are rounding of the solver, and leave the element unchanged.
UNMOVED_OF_DIAGONAL = 1e-7

# Written coordinates are rounded to this part of the diagonal.
ROUNDING_OF_DIAGONAL = 1e-8

_WHY_SKIPPED = {
    "clone": N_(
        "a clone, which can't follow as what it touches has changed its shape; unlink it by Edit > Clone > "
        "Unlink Clone"
    ),
    "markers": N_(
        "it has a marker at each node, and nodes were added; without Add nodes where needed it keeps them"
    ),
}

# Attributes from which Inkscape computes a path anew, ignoring its `d`.
_EFFECT, _ORIGINAL = f"{{{INKSCAPE_NS}}}path-effect", f"{{{INKSCAPE_NS}}}original-d"
_NODETYPES, _LOCKED = f"{{{SODIPODI_NS}}}nodetypes", f"{{{SODIPODI_NS}}}insensitive"
_LIVE = (_EFFECT, _ORIGINAL, *(f"{{{INKSCAPE_NS}}}{name}" for name in ("flatsided", "rounded", "randomized")))


def write(
    document: Document,
    refitted: Refitted,
    keep_handles: bool,
    arc_tolerance: float,
    ignored: Collection[str] = (),
) -> list[str]:
    """Put the new segments into the document; returns the names of the elements that changed.

    arc_tolerance : user units; an elliptical arc stays one if a new arc fits to this tolerance
    ignored : names of handles that had no part in the run, and are not changed
    On any error the document is unchanged.
    """
    run_start, undo_log = document.run_start, UndoLog()
    done = False
    run_start.undo_log.toggle()  # puts the originals back
    try:
        written = _write(document, refitted, arc_tolerance, undo_log)
        names = _changed(document, written, undo_log)
        remember = any_stored(document.svg) or bool(run_start.store)
        settle(document.handles, undo_log, ignored, remember, run_start.rebased)
        done = True
    finally:
        if not done:
            undo_log.toggle()
            run_start.undo_log.toggle()
    if keep_handles:
        handle_marks.show(document.svg, document.drawing.diagonal)
    else:
        remove(document.handles, ignored)
        handle_marks.clear(document.svg)
    return names


def _write(
    document: Document, refitted: Refitted, arc_tolerance: float, undo_log: UndoLog
) -> list[tuple[Shape, Moved]]:
    """Change the tree and record its former state; returns the shapes that moved."""
    drawing = document.drawing
    diagonal = drawing.diagonal
    start = np.searchsorted(refitted.source, np.arange(len(drawing.control) + 1))
    unmoved = UNMOVED_OF_DIAGONAL * diagonal
    moved = {
        id(shape): moved_shape(shape, drawing.control, refitted, start, unmoved) for shape in document.shapes
    }
    changes = Changes(document.styles, undo_log)
    gone: list[Shape] = []  # shapes of clip paths that stay as they are
    drawn = [shape for shape in document.shapes if shape.origin is shape.element]
    planned: dict[Element, Array] = {}
    wholes: dict[Element, Points] = {}
    if (document.carried or document.clones) and any(moved[id(shape)].changed for shape in drawn):
        points = joined([moved[id(shape)].points for shape in drawn])
        for item in document.carried:
            move = carry(item, points, changes)
            if not np.array_equal(move, np.eye(3)):
                planned[item.element] = own_matrix(item.element, text=changes.attributes[-1][2])
            wholes[item.element] = of_corners(item.box, move)
            if item.in_css and not as_the_rest(item, move, points):
                document.skipped.append(skipping_css(item.element))
        followers = Followers(points, drawn, moved, planned)
        wholes.update(followers.follow(document.clones, document.styles, changes))
        document.skipped += [
            skipping(
                clone.element,
                _WHY_SKIPPED["clone"],
            )
            for clone in followers.gaping
        ]
    copied: set[Element] = set()
    loose: list[Shape] = []
    following: list[clip_following.Companion] = []
    for companion in document.companions:
        copied |= companion.copied
        if not clip_following.follow(companion, moved, wholes, document.ids, changes):
            gone += companion.shapes
            continue
        following.append(companion)
        if not companion.joins:
            loose += companion.shapes
    left = {id(shape) for shape in gone}
    new = [
        (shape, moved[id(shape)])
        for shape in [*document.shapes, *loose]
        if moved[id(shape)].changed and id(shape) not in left
    ]
    paints.follow(new, copied, document.clones, document.ids, changes)
    filters.follow(_filtered(document, moved, wholes), document.ids, changes)
    kept = {
        id(shape): geometry
        for shape, motion in new
        for geometry in [_kept(shape, motion, document, arc_tolerance)]
        if geometry is not None
    }
    renamed = [s for s, _ in new if local_tag(s.element) != "path" and id(s) not in kept]
    lost = document.styles.lost_by_renaming([shape.origin for shape in renamed])
    stands = {shape.origin: shape.element for shape, _ in new}
    for origin, properties in lost.items():
        for name, value in properties.items():
            changes.keep_property(stands.get(origin, origin), name, value)
    for shape in renamed:
        for name, value in markers.unwanted(shape.origin, document.styles).items():
            changes.keep_property(shape.element, name, value)
    document.skipped += [
        skipping(
            shape.element,
            _WHY_SKIPPED["markers"],
        )
        for shape, motion in new
        if len(motion.control) > len(motion.old) and markers.at_nodes(shape.origin, document.styles)
    ]
    data = [
        (shape, *_new_data(shape, motion, diagonal, arc_tolerance))
        for shape, motion in new
        if id(shape) not in kept
    ]
    changes.apply()
    for shape, _ in new:
        if id(shape) in kept:
            now = State.of(shape.element)
            undo_log.put(shape.element, State(now.tag, {**now.attributes, **kept[id(shape)]}))
    for shape, d, types in data:
        _replace(shape, d, types, undo_log)
    for shape, _ in new:
        _flatten_groups(shape.element, undo_log)
    for companion in following:
        if companion.in_place:
            clip_following.take_place(companion, undo_log)
    if new:
        declare_namespace(document.svg)
    for element in undo_log.added:
        mark_copy(element)
    record_run(
        document.run_start,
        undo_log,
        {shape.element: cuts_of(motion.control, motion.source) for shape, motion in new},
    )
    if document.run_start.store or new:
        note_unmoved(document.run_start, undo_log, *_unmoved(document))
    return new


def _filtered(
    document: Document, moved: dict[int, Moved], wholes: dict[Element, Points]
) -> list[filters.Filtered]:
    """The elements with a filter and the points that moved in them, in their user space.

    Texts, images and clones are left out: their user space moves with them.
    """
    drawn = [shape for shape in document.shapes if shape.origin is shape.element]
    styles, found = document.styles, []
    inside: dict[Element, list[tuple[Element, Points]]] = {}
    for shape in drawn:
        for outer in (shape.element, *shape.element.iterancestors()):
            inside.setdefault(outer, []).append((shape.element, moved[id(shape)].points))
    for element, points in wholes.items():
        for outer in element.iterancestors():
            inside.setdefault(outer, []).append((element, points))
    for element, parts in inside.items():
        if not referred(styles.own(element, filters.PROPERTY)):
            continue
        space = np.linalg.inv(parent_matrix(element) @ own_matrix(element))
        points = joined([part for _, part in parts]).under(space)
        every = {part for part, _ in parts}
        whole = element in every or every.issuperset(clip_finding.drawn_in(element, styles))
        found.append(filters.Filtered(element, element, points, whole))
    return found


def _unmoved(document: Document) -> tuple[list[tuple[Element, Array]], list[Element]]:
    """Elements with their matrices, and clip paths and masks, that may be recorded as not moved."""
    found = [*document.met.drawn, *_whole_matrices([*document.met.other, *document.met.placed])]
    cutting = [companion.original for companion in document.companions]
    if not document.run_start.is_new_base:
        return found, cutting
    aside = list(document.met.aside)
    if document.others is not None:
        mine = {element for element, _ in found}
        found += [item for item in document.others.drawn if item[0] not in mine]
        whole = [*document.others.other, *document.others.placed]
        found += [item for item in _whole_matrices(whole) if item[0] not in mine]
        aside += document.others.aside
    for element in aside:
        try:
            hidden = walk(document.svg, [element], False, document.styles)
        except DocumentError:
            continue  # it has no part in this run, so it is not reported
        found += [*hidden.drawn, *_whole_matrices([*hidden.other, *hidden.placed])]
    return found, [e for e in document.svg.iter() if local_tag(e) in ("clipPath", "mask")]


def _whole_matrices(others: list[tuple[Element, Array]]) -> list[tuple[Element, Array]]:
    return [(element, outer @ own_matrix(element)) for element, outer in others]


def _changed(document: Document, written: list[tuple[Shape, Moved]], undo_log: UndoLog) -> list[str]:
    """Names of the shapes, texts and images that the run has changed."""
    run_start = document.run_start
    gone = {
        part.attrib["id"]: plain(State.of(part))
        for element in run_start.undo_log.removed
        for part in element.iter()
        if local_tag(part) and part.attrib.get("id")
    }
    added = {part for element in undo_log.added for part in element.iter()}

    def differs(element: Element) -> bool:
        now = plain(State.of(element))
        if element in added:
            return gone.get(element.attrib.get("id") or "") != now
        return now != plain(
            run_start.undo_log.before(element) if element in run_start.back else undo_log.before(element)
        )

    named = [(shape.element, shape.name) for shape, _ in written]
    named += [(shape.element, shape.name) for shape in document.shapes if shape.element in run_start.back]
    named += [(item.element, item.name) for item in document.carried]
    named += [(clone.element, clone.name) for clone in document.clones]
    return [name for element, name in dict.fromkeys(named) if differs(element)]


def _kept(shape: Shape, motion: Moved, document: Document, within: float) -> dict[str, str] | None:
    """New attributes of a shape that keeps its kind, because a path would have other markers; else None."""
    if not markers.unwanted(shape.origin, document.styles):
        return None
    decimals = shape.decimals(ROUNDING_OF_DIAGONAL * document.drawing.diagonal)
    return kept_shapes.geometry(shape, motion, within, decimals)


def _new_data(shape: Shape, moved: Moved, diagonal: float, arc_tolerance: float) -> tuple[str, str | None]:
    """Path data and node types of a changed shape."""
    linear = shape.matrix[:, :2]
    inverse = np.linalg.inv(linear)
    decimals = shape.decimals(ROUNDING_OF_DIAGONAL * diagonal)
    smallest = float(np.linalg.norm(inverse, 2))
    words: list[str] = []
    types: list[node_types.Run] = []
    segment = 0
    for subpath in shape.subpaths:
        count = max(len(subpath.control), 1)
        part = slice(*np.searchsorted(moved.source, (segment, segment + count)))
        control = (moved.control[part] - shape.matrix[:, 2]) @ inverse.T
        source = moved.source[part] - segment
        segment += count
        if not len(subpath.control):
            words.append(path_data.point_data(control[0, 0], subpath.closed, decimals))
        else:
            pieces = path_data.Pieces(control, source, moved.line[part])
            words.append(path_data.subpath_data(subpath, pieces, decimals, arc_tolerance * smallest))
        types.append(node_types.Run(subpath, control, source, moved.smooth_start[part]))
    old = shape.element.attrib.get(_NODETYPES)
    return " ".join(words), node_types.update(old, types) if old is not None else None


def _flatten_groups(element: Element, undo_log: UndoLog) -> None:
    """Remove live effects of groups, which Inkscape would apply anew, and keep their results in the `d`s."""
    for group in list(element.iterancestors()):
        if group.attrib.get(_EFFECT) is None:
            continue
        undo_log.touch(group)
        del group.attrib[_EFFECT]
        for part in group.iter("{*}path"):
            if part.attrib.get(_EFFECT) is None and _ORIGINAL in part.attrib:
                undo_log.touch(part)
                del part.attrib[_ORIGINAL]


def _replace(shape: Shape, data: str, types: str | None, undo_log: UndoLog) -> None:
    """Make the element a path with the same position in the tree, id, style, transform and children."""
    element, tag = shape.element, local_tag(shape.element)
    attributes = {
        name: value
        for name, value in element.attrib.items()
        if name not in basic_shapes.GEOMETRY.get(tag, ()) and not _is_redrawn_from(name)
    }
    attributes["d"] = data
    if types:
        attributes[_NODETYPES] = types
    else:
        attributes.pop(_NODETYPES, None)
    undo_log.put(element, State(tag_of(element)[: -len(tag)] + "path", attributes))


def _is_redrawn_from(name: str) -> bool:
    """Whether Inkscape computes a path from this attribute and not from `d`."""
    of_its_own = name.startswith(f"{{{SODIPODI_NS}}}") and name not in (_NODETYPES, _LOCKED)
    return name in _LIVE or of_its_own
