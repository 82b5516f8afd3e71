"""Gradients and patterns in user space follow the shapes that they paint.

Their coordinates are the shape's own, so a shape that is reshaped leaves them behind.  The shape's
best-fitting scale and shift along the axes, composed with `gradientTransform` or `patternTransform`,
takes them along.  One that also paints something else is copied: a new element with the transform of its
own, which takes its stops or its content from the old one, as Inkscape does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import shapes
from ..model import Array
from .changes import Changes
from .motion import Moved, Points, axis_aligned, same_map
from .references import SERVERS, XLINK_HREF, XLINK_NS, Ids, redirected, referred
from .styles import Styles
from .tree import CARRIED, Element, Shape, local_tag, own_matrix, transform_text

PROPERTIES = ("fill", "stroke")

_PAINTED = ("path", "use", "tspan", "textPath", *CARRIED, *shapes.TAGS)


@dataclass(frozen=True)
class _Use:
    """A property of a shape that a paint server gives; map : (3, 3) what the shape did, own coordinates."""

    shape: Shape
    name: str
    value: str
    map: Array
    points: Points


def follow(moved: list[tuple[Shape, Moved]], copied: set[Element], ids: Ids, changes: Changes) -> None:
    """Plan that the paints of changed shapes follow them.

    copied : elements that are copies, so that their originals go on to use the paint as it is
    """
    uses: dict[Element, list[_Use]] = {}
    for shape, motion in moved:
        for name in PROPERTIES:
            value = changes.styles.inherited(shape.origin, name)
            server = ids.get(referred(value))
            if value is None or server is None or not in_user_space(server, ids):
                continue
            points = motion.points.under(np.linalg.inv(shape.affine))
            use = _Use(shape, name, value, axis_aligned(points), points)
            uses.setdefault(server, []).append(use)
    if not uses:
        return
    users = users_of(changes.styles, ids)
    for server, mine in uses.items():
        groups = _by_map(mine)
        own = {use.shape.origin for use in mine if use.shape.element not in copied}
        shared = bool(users[server] - own) or _lends_transform(server, ids)
        for n, group in enumerate(groups):
            if n == 0 and not shared:
                changes.attributes.append((server, _transform_name(server), _composed(server, group, ids)))
            else:
                _copy(server, group, ids, changes)


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
    """The transform that the server has, of its own or taken over, and the map after it."""
    name = _transform_name(server)
    given = [element for element in ids.chain(server) if element.attrib.get(name)]
    now = own_matrix(given[0], name) if given else np.eye(3)
    return transform_text(group[0].map @ now)


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
    """Which elements each paint server paints."""
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
    """Whether another paint server takes its transform from this one."""
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
    identity = ids.new(server.attrib.get("id"))
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
        changes.set_property(use.shape.element, use.name, value, use.shape.origin)
