# SPDX-License-Identifier: GPL-2.0-or-later
"""Finds the clip paths and masks of what is reshaped, and their shapes.

`clip_following` reshapes them.
"""

from __future__ import annotations

import copy
from typing import Any

import numpy as np

from ...geometry.bezier import evaluate, polygon_lengths
from ...model import Array
from ...svg import basic_shapes
from ..tree.drawn_elements import Found
from ..tree.elements import (
    CARRIED,
    CONTAINERS,
    SODIPODI_NS,
    Element,
    Shape,
    length_reader,
    local_tag,
    name_of,
    own_matrix,
    parent_matrix,
    parent_of,
    read_shape,
    transform_text,
)
from ..tree.references import Ids, referred
from ..tree.styles import Styles
from .clip_following import PROPERTIES, Companion, Subject
from .texts_and_images import read_carried

# A clip that enlarges the drawing by more than this factor does not join it.  Otherwise a tenth of the
# samples would be spent on an edge that mostly lies where nothing is drawn.
LARGEST_GROWTH = 1.5

# Curves and handles nearer to a clip than this part of the diagonal touch it.  It is the reach of a handle.
TOUCH = 0.01

# Attributes that make a clip, mask or filter relative to the element's box, and their default values.
_UNITS = {
    "clip-path": ("clipPathUnits",),
    "mask": ("maskUnits", "maskContentUnits"),
    "filter": ("filterUnits", "primitiveUnits"),
}
_DEFAULTS = {
    "clip-path": ("userSpaceOnUse",),
    "mask": ("objectBoundingBox", "userSpaceOnUse"),
    "filter": ("objectBoundingBox", "userSpaceOnUse"),
}

_LOCKED = f"{{{SODIPODI_NS}}}insensitive"

_DRAWN = ("path", "use", "svg", *CARRIED, *basic_shapes.TAGS)
_UNDRAWN = ("defs", "symbol", "clipPath", "mask", "marker", "pattern")


def find(
    reshaped: list[Shape], carried: set[Element], held: Array, styles: Styles, ids: Ids, tandem: bool
) -> list[Companion]:
    """The clip paths and masks of shapes, and of groups whose drawn contents are all reshaped or carried.

    held : (k, 2) points that handles hold, root user units; tandem : whether parts without a handle move
        along
    """
    subjects = _subjects(reshaped, carried, styles)
    users: dict[Element, set[Element]] | None = None
    mine = {shape.element: shape for shape in reshaped}
    found: list[Companion] = []
    done: set[Element] = set()
    surroundings = _Surroundings(reshaped, held)
    while subjects:
        requests: dict[Element, list[tuple[str, Subject]]] = {}
        for subject in subjects:
            for name in PROPERTIES:
                target = ids.get(referred(styles.own(subject.origin, name)))
                if target is not None and _cuts_in_user_space(target, name) and target not in done:
                    requests.setdefault(target, []).append((name, subject))
        if requests and users is None:
            users = users_of(styles, ids)
        subjects = []
        for target, wanted in requests.items():
            done.add(target)
            if any(target in element.iterancestors() for element in mine):
                continue  # it was selected as a shape
            groups = _by_matrix([subject for _, subject in wanted])
            stand = {subject.origin for subject in groups[0] if subject.stands_for_origin}
            in_place = len(groups) == 1 and (users or {}).get(target, set()) <= stand
            for group in groups:
                companion = _companion(target, group, wanted[0][0], in_place, styles, ids, mine)
                if companion.shapes or companion.carried:
                    companion.joins = tandem and surroundings.take_in(companion.shapes)
                    found.append(companion)
                    subjects += _nested(companion)
    return found


def _subjects(reshaped: list[Shape], carried: set[Element], styles: Styles) -> list[Subject]:
    result = [Subject(shape.element, shape.element, shape.affine, [shape]) for shape in reshaped]
    groups: dict[Element, list[Shape]] = {}
    for shape in reshaped:
        for group in shape.element.iterancestors():
            if group.getparent() is not None:
                groups.setdefault(group, []).append(shape)
    come_along = carried | {shape.element for shape in reshaped}
    wholes: dict[Element, list[Element]] = {}
    for element in carried:
        for group in element.iterancestors():
            if group.getparent() is not None:
                wholes.setdefault(group, []).append(element)
    for group in dict.fromkeys([*groups, *wholes]):
        parts = groups.get(group, [])
        cut = any(referred(styles.own(group, name)) for name in PROPERTIES)
        if cut and all(element in come_along for element in drawn_in(group, styles)):
            matrix = parent_matrix(group) @ own_matrix(group)
            result.append(Subject(group, group, matrix, parts, wholes.get(group, [])))
    return result


def _boxed(element: Element, styles: Styles, ids: Ids) -> bool:
    """Whether a clip, mask or filter of an element depends on its bounding box."""
    for name in (*PROPERTIES, "filter"):
        target = ids.get(referred(styles.own(element, name)))
        units = [target.attrib.get(key) for key in _UNITS[name]] if target is not None else []
        if any((given or default) == "objectBoundingBox" for given, default in zip(units, _DEFAULTS[name])):
            return True
    return False


def hidden_in_boxes(met: Found, styles: Styles, ids: Ids) -> list[tuple[Element, Array]]:
    """Invisible shapes in a bounding box on which a clip, mask or filter depends, with outer matrices.

    Elements with display: none are not part of any box.
    """
    found = []
    for element in met.aside:
        tag = local_tag(element)
        shown = styles.own(element, "display") != "none" and element.attrib.get(_LOCKED) != "true"
        if shown and (tag == "path" or tag in basic_shapes.TAGS):
            groups = [group for group in element.iterancestors() if local_tag(group) in CONTAINERS]
            if any(_boxed(group, styles, ids) for group in groups):
                found.append((element, parent_matrix(element)))
    return found


def with_doubtful_transform(reshaped: list[Shape], styles: Styles, ids: Ids) -> list[Element]:
    """Elements with a clip path in units of their box that also has a transform.

    Renderers differ: resvg applies the transform in user space, librsvg in the box.
    """
    found = []
    around = [e for shape in reshaped for e in (shape.element, *shape.element.iterancestors())]
    for element in dict.fromkeys(around):
        target = ids.get(referred(styles.own(element, "clip-path")))
        if target is None:
            continue
        attributes = target.attrib
        if attributes.get("clipPathUnits") == "objectBoundingBox" and attributes.get("transform"):
            found.append(element)
    return found


def drawn_in(group: Element, styles: Styles) -> list[Element]:
    found, stack = [], list(group)
    while stack:
        element = stack.pop()
        tag = local_tag(element)
        if tag in _UNDRAWN or not tag or styles.own(element, "display") == "none":
            continue
        if tag in CONTAINERS:
            stack.extend(element)
        elif tag in _DRAWN and not _is_empty(element) and styles.inherited(element, "visibility") != "hidden":
            found.append(element)
    return found


def _is_empty(element: Element) -> bool:
    return local_tag(element) == "path" and not (element.attrib.get("d") or "").strip()


def users_of(styles: Styles, ids: Ids, names: tuple[str, ...] = PROPERTIES) -> dict[Element, set[Element]]:
    """The elements that each clip path or mask cuts.  names : the properties that refer to it"""
    found: dict[Element, set[Element]] = {}
    for element in styles.svg.iter():
        if local_tag(element):
            for name in names:
                target = ids.get(referred(styles.own(element, name)))
                if target is not None:
                    found.setdefault(target, set()).add(element)
    return found


def _cuts_in_user_space(target: Element, name: str) -> bool:
    tag, units = ("clipPath", "clipPathUnits") if name == "clip-path" else ("mask", "maskContentUnits")
    return local_tag(target) == tag and target.attrib.get(units, "userSpaceOnUse") == "userSpaceOnUse"


def _by_matrix(subjects: list[Subject]) -> list[list[Subject]]:
    groups: list[list[Subject]] = []
    for subject in subjects:
        for group in groups:
            if np.allclose(group[0].matrix, subject.matrix, rtol=1e-9, atol=1e-9):
                group.append(subject)
                break
        else:
            groups.append([subject])
    return groups


class _Surroundings:
    """The drawing that clip paths may join."""

    def __init__(self, reshaped: list[Shape], held: Array):
        control = np.concatenate([shape.control for shape in reshaped])
        self.bounds = _bounds(control)
        self.diagonal = float(np.hypot(*(self.bounds[1] - self.bounds[0])))
        self._control, self._held = control, held
        self._tree: Any = None

    def take_in(self, shapes: list[Shape]) -> bool:
        """Whether shapes of a clip join the drawing; if so, they are added to it."""
        if not shapes or not self.diagonal > 0.0:
            return False
        control = np.concatenate([shape.control for shape in shapes])
        own = _bounds(control)
        whole = np.maximum(own[1], self.bounds[1]) - np.minimum(own[0], self.bounds[0])
        if np.hypot(*whole) > LARGEST_GROWTH * self.diagonal:
            return False
        reach = TOUCH * self.diagonal
        if self._tree is None:
            from scipy.spatial import cKDTree  # takes 0.1 s to import; most drawings have no clip path

            self._tree = cKDTree(np.concatenate([_dense(self._control, reach), self._held]))
        return bool(self._tree.query(_dense(control, reach))[0].min() <= reach)


def _bounds(control: Array) -> Array:
    points = control.reshape(-1, 2)
    return np.array([points.min(axis=0), points.max(axis=0)])


def _dense(control: Array, step: float) -> Array:
    """Points (n, 2) along cubics (s, 4, 2), at distances of at most about `step`."""
    count = np.ceil(polygon_lengths(control) / step).astype(int) + 1
    segment = np.repeat(np.arange(len(control)), count)
    place = np.arange(len(segment)) - np.repeat(np.cumsum(count) - count, count)
    return evaluate(control[segment], place / np.maximum(count[segment] - 1, 1))


def _companion(
    target: Element,
    subjects: list[Subject],
    name: str,
    in_place: bool,
    styles: Styles,
    ids: Ids,
    mine: dict[Element, Shape],
) -> Companion:
    work = copy.deepcopy(target)
    work.tail = None
    origins = dict(zip(work.iter(), target.iter()))
    companion = Companion(target, work, subjects, name, in_place, origins)
    stack = [(child, subjects[0].matrix @ own_matrix(work)) for child in reversed(work)]
    while stack:
        element, outer = stack.pop()
        origin = origins[element]
        tag = local_tag(element)
        if not tag or styles.own(origin, "display") == "none":
            continue
        if tag == "use":
            shape = _unlinked(element, origin, outer, ids, mine)
            if shape is not None:
                companion.shapes.append(shape)
                del origins[element]
                origins[shape.element] = origin
            continue
        matrix = outer @ own_matrix(element)
        if tag in CONTAINERS:
            stack.extend((child, matrix) for child in reversed(element))
        elif tag == "path" or tag in basic_shapes.TAGS:
            shape = read_shape(origin, matrix[:2])
            shape.element = element
            if shape.subpaths and abs(np.linalg.det(matrix)) > 0.0:
                companion.shapes.append(shape)
        elif tag in CARRIED:
            companion.carried.append(read_carried(element, outer, styles, origin))
    return companion


def _unlinked(
    use: Element, origin: Element, outer: Array, ids: Ids, mine: dict[Element, Shape]
) -> Shape | None:
    """The shape that replaces a clone in a clip path or mask; None if it can remain a clone.

    use : in the copy; origin : in the document
    """
    target = ids.href(use)
    if target is None or not (local_tag(target) == "path" or local_tag(target) in basic_shapes.TAGS):
        return None
    length = length_reader(origin, name_of(origin))
    shift = np.eye(3)
    shift[:2, 2] = length("x") or 0.0, length("y") or 0.0
    inner = own_matrix(use) @ shift @ own_matrix(target)
    matrix = outer @ inner
    if target in mine and np.allclose(matrix, mine[target].affine, rtol=1e-9, atol=1e-9):
        return None  # it moves with its original
    shape = read_shape(target, matrix[:2])
    if not shape.subpaths:
        return None
    shape.element = own = copy.deepcopy(target)
    own.tail = use.tail
    for part in list(own):  # titles in clips are not shown
        own.remove(part)
    own.attrib.pop("transform", None)
    if not np.array_equal(inner, np.eye(3)):
        own.attrib["transform"] = transform_text(inner)
    own.attrib.pop("id", None)
    for name in ("id", "style", "class", "clip-rule", "fill", "stroke", "opacity"):
        if use.attrib.get(name) is not None and own.attrib.get(name) is None:
            own.attrib[name] = use.attrib[name]
    parent_of(use).replace(use, own)
    return shape


def _nested(companion: Companion) -> list[Subject]:
    """The parts of a companion that other clips may cut: itself and its shapes."""
    matrix = companion.subjects[0].matrix
    stands = companion.in_place
    whole = Subject(companion.work, companion.original, matrix, companion.shapes, stands_for_origin=stands)
    return [whole] + [
        Subject(shape.element, shape.origin, shape.affine, [shape], stands_for_origin=stands)
        for shape in companion.shapes
    ]
