# SPDX-License-Identifier: GPL-2.0-or-later
"""Gradients and patterns in user space follow the shapes that they paint.

Their coordinates are in the shape's user space, so they do not change when the shape is reshaped.  Therefore
the shape's best-fitting scale and shift along the axes is composed with `gradientTransform` or
`patternTransform`.  A paint server that paints other shapes as well is copied.  As in Inkscape, the copy has
its own transform, and refers to the old element for its stops or content.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...model import Array
from ...svg import basic_shapes
from ..tree.elements import CARRIED, Element, Shape, local_tag, own_matrix, transform_text
from ..tree.pending_changes import Changes
from ..tree.references import SERVERS, XLINK_HREF, XLINK_NS, Ids, redirected, referred
from ..tree.styles import Styles
from .clones import Clone
from .motion import Moved, Points, axis_aligned, joined, same_map

PROPERTIES = ("fill", "stroke")

_PAINTED = ("path", "use", "tspan", "textPath", *CARRIED, *basic_shapes.TAGS)


@dataclass(frozen=True)
class _Use:
    """A property that refers to a paint server.  map : (3, 3) the shape's motion, own coordinates

    element : the shape or clone with the property; origin : the element of the document
    """

    element: Element
    origin: Element
    name: str
    value: str
    map: Array
    points: Points


def follow(
    moved: list[tuple[Shape, Moved]], copied: set[Element], clones: list[Clone], ids: Ids, changes: Changes
) -> None:
    """Plan that the paints of changed shapes follow them, including paints that shapes inherit in clones.

    copied : elements that are copies; their originals keep using the unchanged paint
    """
    uses: dict[Element, list[_Use]] = {}
    for shape, motion in moved:
        for name in PROPERTIES:
            value = changes.styles.inherited(shape.origin, name)
            server = ids.get(referred(value))
            if value is None or server is None or not _is_left_behind(server, ids):
                continue
            points = motion.points.under(np.linalg.inv(shape.affine))
            use = _Use(shape.element, shape.origin, name, value, _map(server, points, ids), points)
            uses.setdefault(server, []).append(use)
    for clone, name, value, points in _given_by_clones(moved, clones, changes.styles):
        server = ids.get(referred(value))
        if server is not None and _is_left_behind(server, ids):
            use = _Use(clone.element, clone.element, name, value, _map(server, points, ids), points)
            uses.setdefault(server, []).append(use)
    if not uses:
        return
    users = users_of(changes.styles, ids)
    for server, mine in uses.items():
        groups = _by_map(mine)
        own = {use.origin for use in mine if use.element not in copied}
        shared = bool(users[server] - own) or _lends_transform(server, ids)
        for n, group in enumerate(groups):
            if n == 0 and not shared:
                changes.attributes.append((server, _transform_name(server), _composed(server, group, ids)))
            else:
                _copy(server, group, ids, changes)


def _is_left_behind(server: Element, ids: Ids) -> bool:
    """Whether a paint server, or the transform of a pattern, is in user space and has to follow."""
    if local_tag(server) == "pattern" and not in_user_space(server, ids):
        return any(element.attrib.get("patternTransform") for element in ids.chain(server))
    return in_user_space(server, ids)


def _map(server: Element, points: Points, ids: Ids) -> Array:
    """The map (3, 3) for a paint: that of the box if the paint depends on it."""
    if in_user_space(server, ids):
        return axis_aligned(points)
    (low, high), (new_low, new_high) = ((p.min(axis=0), p.max(axis=0)) for p in (points.old, points.new))
    size = high - low
    scale = np.where(size > 0.0, (new_high - new_low) / np.where(size > 0.0, size, 1.0), 1.0)
    matrix = np.diag([*np.where(scale > 0.0, scale, 1.0), 1.0])
    matrix[:2, 2] = new_low - np.diag(matrix)[:2] * low
    return matrix


def _given_by_clones(
    moved: list[tuple[Shape, Moved]], clones: list[Clone], styles: Styles
) -> list[tuple[Clone, str, str, Points]]:
    """Paints that changed shapes inherit in clones only: property, value, points in own coordinates."""
    motions = {shape.element: (shape, motion) for shape, motion in moved}
    found = []
    for clone in clones:
        shown = [leaf for leaf in clone.leaves if leaf.element in motions]
        for name in PROPERTIES:
            value = styles.inherited(clone.element, name)
            mine = [leaf for leaf in shown if all(styles.own(e, name) is None for e in leaf.path[1:])]
            if value is not None and mine and referred(value):
                parts = [
                    motion.points.under(np.linalg.inv(shape.affine))
                    for shape, motion in (motions[leaf.element] for leaf in mine)
                ]
                found.append((clone, name, value, joined(parts)))
    return found


def in_user_space(server: Element, ids: Ids) -> bool:
    tag = local_tag(server)
    if tag not in SERVERS:
        return False
    units = SERVERS[tag][0]
    given = [element.attrib.get(units) for element in ids.chain(server) if element.attrib.get(units)]
    return tag == "meshgradient" or (bool(given) and given[0] == "userSpaceOnUse")


def _transform_name(server: Element) -> str:
    return SERVERS[local_tag(server)][1]


def _composed(server: Element, group: list[_Use], ids: Ids) -> str:
    """The text of the server's own or inherited transform, followed by the map."""
    name = _transform_name(server)
    given = [element for element in ids.chain(server) if element.attrib.get(name)]
    now = own_matrix(given[0], name) if given else np.eye(3)
    move = group[0].map
    if not in_user_space(server, ids):  # the corner of the tile moves with the box, before this transform
        return transform_text(move @ now @ np.linalg.inv(move))
    return transform_text(move @ now)


def _by_map(uses: list[_Use]) -> list[list[_Use]]:
    groups: list[list[_Use]] = []
    for use in uses:
        for group in groups:
            if same_map(group[0].map, use.map, group[0].points) and same_map(
                group[0].map, use.map, use.points
            ):
                group.append(use)
                break
        else:
            groups.append([use])
    return sorted(groups, key=len, reverse=True)


def users_of(styles: Styles, ids: Ids) -> dict[Element, set[Element]]:
    """The elements that each paint server paints."""
    found: dict[Element, set[Element]] = {}
    for element in styles.svg.iter():
        tag = local_tag(element)
        if tag in SERVERS:
            found.setdefault(element, set())
        if tag not in _PAINTED:
            continue
        for name in PROPERTIES:
            server = ids.get(referred(styles.inherited(element, name)))
            if server is not None:
                found.setdefault(server, set()).add(element)
    return found


def _lends_transform(server: Element, ids: Ids) -> bool:
    """Whether another paint server inherits its transform from this one."""
    for other in ids.elements.values():
        if other is server or local_tag(other) not in SERVERS:
            continue
        chain = ids.chain(other)
        if server in chain:
            nearer = chain[: chain.index(server)]
            if not any(element.attrib.get(_transform_name(other)) for element in nearer):
                return True
    return False


def _copy(server: Element, group: list[_Use], ids: Ids, changes: Changes) -> None:
    identity = ids.new(server.attrib["id"])
    new = server.makeelement(server.tag, nsmap={**server.nsmap, "xlink": XLINK_NS})
    for name, value in server.attrib.items():
        new.attrib[name] = value
    new.attrib["id"] = identity
    if len(server):
        new.attrib.pop("href", None)
        new.attrib[XLINK_HREF] = f"#{server.attrib.get('id')}"
    new.attrib[_transform_name(server)] = _composed(server, group, ids)
    changes.additions.append((server, new))
    for use in group:
        value = redirected(use.value, identity)
        changes.set_property(use.element, use.name, value, use.origin)
