# SPDX-License-Identifier: GPL-2.0-or-later
"""Filters in user space follow their elements.

The region of a filter, the subregions of its primitives and the positions of its lights may be in the user
space of the element.  They do not change when the element's shapes are reshaped.  Positions inside follow by
the best-fitting scale and shift of each axis.  A side of the region outside the curves keeps its distance
from them, because this margin is for a blur or a shadow, which does not grow.

A filter that other elements use as well is copied.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass

import numpy as np

from ...messages.errors import DocumentError
from ...model import Array
from ..tree.elements import Element, length_reader, local_tag, name_of, viewport_length
from ..tree.pending_changes import Changes
from ..tree.references import Ids, redirected, referred
from ..tree.styles import Styles
from .motion import Points, axis_aligned, same_map

PROPERTY = "filter"

SIDES = ("x", "y", "width", "height")

# Position attributes of light sources.
_LIGHTS = {"fePointLight": (("x", "y"),), "feSpotLight": (("x", "y"), ("pointsAtX", "pointsAtY"))}


@dataclass(frozen=True)
class Filtered:
    """An element that has a filter, and points of what is drawn in it, in its user space.

    element : in the tree or a copy; origin : the element of the document; whole : whether the points are all
        of it
    """

    element: Element
    origin: Element
    points: Points
    whole: bool = True


def follow(subjects: list[Filtered], ids: Ids, changes: Changes) -> None:
    """Plan that the filters of elements follow their moved contents."""
    wanted: dict[Element, list[Filtered]] = {}
    for subject in subjects:
        target = ids.get(referred(changes.styles.own(subject.origin, PROPERTY)))
        if target is not None and local_tag(target) == "filter" and not _still(subject.points):
            wanted.setdefault(target, []).append(subject)
    users = users_of(changes.styles, ids) if wanted else {}
    for target, mine in wanted.items():
        groups = _by_map(mine)
        shared = bool(users[target] - {subject.origin for subject in mine})
        for n, group in enumerate(groups):
            if n == 0 and not shared:
                for part, name, value in _new_values(target, target, group[0]):
                    changes.attributes.append((part, name, value))
            else:
                _copy(target, group, ids, changes)


def _still(points: Points) -> bool:
    return bool(np.abs(points.new - points.old).max() <= 1e-7 * points.extent)


def users_of(styles: Styles, ids: Ids) -> dict[Element, set[Element]]:
    """The elements of each filter."""
    found: dict[Element, set[Element]] = {}
    for element in styles.svg.iter():
        target = ids.get(referred(styles.own(element, PROPERTY))) if local_tag(element) else None
        if target is not None:
            found.setdefault(target, set()).add(element)
    return found


def _by_map(subjects: list[Filtered]) -> list[list[Filtered]]:
    groups: list[list[Filtered]] = []
    for subject in subjects:
        own = axis_aligned(subject.points)
        for group in groups:
            first = group[0].points
            if same_map(axis_aligned(first), own, first) and same_map(
                own, axis_aligned(first), subject.points
            ):
                group.append(subject)
                break
        else:
            groups.append([subject])
    return sorted(groups, key=len, reverse=True)


def _copy(target: Element, group: list[Filtered], ids: Ids, changes: Changes) -> None:
    work = copy.deepcopy(target)
    work.tail = None
    for part, name, value in _new_values(target, work, group[0]):
        part.attrib[name] = value
    work.attrib["id"] = ids.new(target.attrib["id"])
    for part in work.iter():
        if part is not work and isinstance(part.tag, str) and part.attrib.get("id"):
            part.attrib["id"] = ids.new(part.attrib["id"])
    changes.additions.append((target, work))
    for subject in group:
        value = changes.styles.own(subject.origin, PROPERTY) or ""
        changes.set_property(subject.element, PROPERTY, redirected(value, work.attrib["id"]), subject.origin)


def _new_values(target: Element, work: Element, subject: Filtered) -> list[tuple[Element, str, str]]:
    """The new attributes of a filter, or of a copy of it."""
    points = subject.points
    fit = axis_aligned(points)
    found: list[tuple[Element, str, str]] = []
    if target.attrib.get("filterUnits") == "userSpaceOnUse":
        found += [(work, name, value) for name, value in moved_region(target, points, subject.whole)]
    if target.attrib.get("primitiveUnits", "userSpaceOnUse") != "userSpaceOnUse" or not subject.whole:
        return found
    for part, origin in zip(work.iter(), target.iter()):
        tag = local_tag(origin)
        if tag in _LIGHTS:
            for names in _LIGHTS[tag]:
                found += [(part, name, value) for name, value in _moved_place(origin, names, fit)]
        elif tag.startswith("fe") and origin.getparent() is target:
            for axis, (place, size) in enumerate((("x", "width"), ("y", "height"))):
                length = _lengths(origin, (place, size))
                if length[0] is not None:
                    found.append((part, place, _text(fit[axis, axis] * length[0] + fit[axis, 2])))
                if length[1] is not None and abs(fit[axis, axis] - 1.0) > 1e-9:
                    found.append((part, size, _text(abs(fit[axis, axis]) * length[1])))
    return found


def _moved_place(origin: Element, names: tuple[str, str], fit: Array) -> list[tuple[str, str]]:
    """The new attributes of a position; missing ones are zero."""
    place = [value or 0.0 for value in _lengths(origin, names)]
    return [(name, _text(fit[n, n] * place[n] + fit[n, 2])) for n, name in enumerate(names)]


def _lengths(element: Element, names: tuple[str, ...]) -> list[float | None]:
    """Lengths in user units; None for a missing or unreadable attribute."""
    found: list[float | None] = []
    for name in names:
        try:
            found.append(length_reader(element, name_of(element))(name))
        except DocumentError:
            found.append(None)
    return found


def moved_region(target: Element, points: Points, whole: bool = True) -> list[tuple[str, str]]:
    """The new sides of a region in user units, of a filter or mask, whose contents have moved.

    whole : whether the points are all contents; else the region also keeps what it contained before
    """
    result = region_of(target)
    if result is None:
        return []
    fit, before = axis_aligned(points), result.copy()
    for axis in (0, 1):
        old, new = points.old[:, axis], points.new[:, axis]
        mapped = np.sort(fit[axis, axis] * before[:, axis] + fit[axis, 2])
        outside = before[0, axis] <= old.min(), before[1, axis] >= old.max()
        low = new.min() - (old.min() - before[0, axis]) if outside[0] else mapped[0]
        high = new.max() + (before[1, axis] - old.max()) if outside[1] else mapped[1]
        result[:, axis] = low, high
    if not whole:
        result = np.array([np.minimum(result[0], before[0]), np.maximum(result[1], before[1])])
    values = (*result[0], *(result[1] - result[0]))
    return [(side, _text(value)) for side, value in zip(SIDES, values)]


def region_of(target: Element) -> Array | None:
    """Corners (2, 2) of a region in user units; the default is -10 % and 120 % of the page."""
    sides = []
    for side, given, left_out in zip(SIDES, _lengths(target, SIDES), (-0.1, -0.1, 1.2, 1.2)):
        whole = viewport_length(target, side)
        if given is None:
            if whole is None:
                return None
            given = left_out * whole
        sides.append(given)
    x, y, width, height = sides
    return np.array([[x, y], [x + width, y + height]])


def _text(value: float) -> str:
    return f"{value + 0.0:.12g}"
