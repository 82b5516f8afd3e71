# SPDX-License-Identifier: GPL-2.0-or-later
"""Put handles on curves: at selected nodes, extremes, corners, crossings with guides, or as a frame.

Positions are found on the drawing as it is now.  A run needs the same points in the drawing that it starts
from (`correspondence`).  Two handles on one point would contradict each other, so a point that is held keeps
its handle.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Sequence

import numpy as np

from ..geometry.bezier import polygon_lengths
from ..handles import candidates
from ..messages.errors import HandleError
from ..messages.language import N_
from ..messages.language import translate as _
from ..model import Array
from ..svg import path_data
from .followers.motion import Points, axis_aligned
from .handles.guides import guides
from .handles.handle_layer import Layer, Size
from .handles.handle_objects import HandleObject, read_handle
from .history.correspondence import original_points
from .painted_shapes import diagonal_of, handle_size, in_root_units, painted_shapes, segments_of
from .tree.elements import (
    CONTAINERS,
    INKSCAPE_NS,
    Element,
    Shape,
    local_tag,
    name_of,
    own_matrix,
    parent_matrix,
    read_shape,
)
from .tree.own_objects import drawn_of, labelled
from .tree.references import Ids

WHERE = ("auto", "nodes", "extremes", "corners", "guides", "section")

# Least distance of the two handles of a flat side, in radii.  Nearer ones would look like one handle, so a
# shorter side gets one handle.
APART_OF_RADIUS = 4.0

# Least distance of two handles, in radii.  For points that the effect finds it keeps circles from
# overlapping.  Nodes that the user has selected may lie closer.
GAP_OF_RADIUS, GAP_OF_NODES = 2.5, 1.0

# Segments shorter than this part of the diagonal get no handles.  A run treats them as points, so a handle
# there would hold nothing.
POINT_OF_DIAGONAL = 1e-4

# Greatest number of corners.  Pins on more would leave nothing to move.
MOST_CORNERS = 100

_EFFECT, _ORIGINAL = f"{{{INKSCAPE_NS}}}path-effect", f"{{{INKSCAPE_NS}}}original-d"

_HELD = N_(
    "Nothing was added: there are handles at all {count} places already. Drag these, or remove them first."
)

_ONE_HELD = N_("Nothing was added: there is a handle already. Drag it, or remove it first.")

_NO_NODES = N_(
    "No nodes are selected. Select some with the node tool (press N, then click or drag over nodes), or "
    "choose another place for the handles."
)
_NO_SECTION = N_("Nothing is selected. Select the objects that the frame is to hold.")
_NO_CORNERS = N_(
    "The selected objects have no corner, where a curve turns by more than {degrees:g} degrees. Choose "
    "another place for the handles."
)
_TOO_MANY_CORNERS = N_(
    "The selected objects have {count} corners; pins on all of them would leave nothing to move. Select "
    "fewer objects, or single nodes with the node tool."
)
_NO_GUIDES = N_(
    "The drawing has no guides. Drag one from a ruler over the curves, or choose another place for the "
    "handles."
)
_NO_CROSSINGS = N_(
    "None of the {count} guides crosses the selected objects. Move a guide over them, or select the objects "
    "that it crosses."
)
_NODE_NAME = N_("The selected node {node} is not named as id:subpath:position.")
_NO_NODE = N_(
    "Inkscape names a node of {name} that its path data doesn't have. Save the drawing, open it again and "
    "select the nodes anew."
)
_NO_OBJECT = N_("There is no object with the id {identity}.")
_NOT_DRAWN = N_("{name} lies in {parent}, not in the drawing itself. Select nodes of paths that are drawn.")
_NOT_A_PATH = N_("{name} is not a path. Convert it with Path > Object to Path.")


@dataclass(frozen=True)
class Placed:
    """The result of `place`.

    added : ids of the new handles; kept : number of points that had a handle already
    """

    added: tuple[str, ...]
    kept: int

    def check(self) -> None:
        """Raise HandleError if nothing was added."""
        if not self.added:
            raise HandleError(_(_ONE_HELD if self.kept == 1 else _HELD).format(count=self.kept))


def place(svg: Element, where: str, selected: Sequence[Element], nodes: Sequence[str]) -> Placed:
    """Put handles on the selected objects, or on all visible ones if nothing, or only handles, is selected.

    where : one of WHERE; auto means the nodes if any are given, else the extremes
    nodes : Inkscape's names of the nodes selected with the node tool, id:subpath:position
    Raises DocumentError or HandleError that names the object and the remedy.
    """
    if where == "auto":
        where = "nodes" if nodes else "extremes"
    chosen = drawn_of(selected)
    if where == "nodes" and not nodes:
        raise HandleError(_(_NO_NODES))
    if where == "section" and not chosen:
        raise HandleError(_(_NO_SECTION))
    handles = [read_handle(element, label) for element, label in labelled(svg)]
    if where == "nodes":
        held, points = _nodes(svg, nodes)
        size = handle_size(svg, held)
    else:
        held = painted_shapes(svg, chosen)
        size = handle_size(svg, held)
        if where == "section":
            return _place_section(svg, held, handles, size)
        points = _positions(svg, where, held, size)
    gap = GAP_OF_NODES if where == "nodes" else GAP_OF_RADIUS
    points = points[candidates.thin(points, gap * size.radius)]
    rest = original_points(svg, points)
    taken = np.array([_is_held(*pair, handles, size.radius) for pair in zip(points, rest)], dtype=bool)
    layer, ids = Layer(svg, size), Ids(svg)
    for at, origin in zip(points[~taken], rest[~taken]):
        layer.add_point(ids, at, origin)
    return Placed(tuple(layer.added), int(taken.sum()))


def _positions(svg: Element, where: str, held: list[Shape], size: Size) -> Array:
    """Points of the curves (n, 2), root user units; some may be near others."""
    if where == "corners":
        return _corners(held, size)
    control = segments_of(held)
    long = polygon_lengths(control) > POINT_OF_DIAGONAL * diagonal_of(control)
    control = control[long] if long.any() else control
    if where == "extremes":
        flat = candidates.FLAT_OF_DIAGONAL * size.diagonal
        return candidates.extremes(control, flat, APART_OF_RADIUS * size.radius)
    lines = guides(svg)
    if not lines:
        raise HandleError(_(_NO_GUIDES))
    near = candidates.ON_LINE_OF_DIAGONAL * size.diagonal
    points = np.concatenate([candidates.crossings(control, *line, near) for line in lines])
    if not len(points):
        raise HandleError(_(_NO_CROSSINGS).format(count=len(lines)))
    return points


def _corners(held: list[Shape], size: Size) -> Array:
    """Corners (n, 2), the sharpest first; of corners within GAP_OF_RADIUS only the sharpest."""
    runs = [(shape, subpath) for shape in held for subpath in shape.subpaths]
    found = [
        candidates.corners(in_root_units(shape, subpath.control), subpath.closed) for shape, subpath in runs
    ]
    points, turns = (np.concatenate(parts) for parts in zip(*found))
    if not len(points):
        raise HandleError(_(_NO_CORNERS).format(degrees=candidates.CORNER_DEGREES))
    points = points[np.argsort(-turns, kind="stable")]
    points = points[candidates.thin(points, GAP_OF_RADIUS * size.radius)]
    if len(points) > MOST_CORNERS:
        raise HandleError(_(_TOO_MANY_CORNERS).format(count=len(points)))
    return points


def _nodes(svg: Element, nodes: Sequence[str]) -> tuple[list[Shape], Array]:
    """The paths with selected nodes, and the nodes' positions (n, 2), root user units."""
    wanted: dict[str, list[tuple[int, int]]] = {}
    for node in nodes:
        try:
            identity, subpath, position = node.rsplit(":", 2)
            wanted.setdefault(identity, []).append((int(subpath), int(position)))
        except ValueError as error:
            raise HandleError(_(_NODE_NAME).format(node=node)) from error
    held: list[Shape] = []
    points: list[Array] = []
    ids = Ids(svg)
    for identity, numbers in wanted.items():
        shape = _path(svg, ids, identity)
        listed = candidates.nodes(_edited(shape))
        for first, second in sorted(numbers):
            if not (0 <= first < len(listed) and 0 <= second < len(listed[first])):
                raise HandleError(_(_NO_NODE).format(name=shape.name))
            points.append(in_root_units(shape, listed[first][second]))
        held.append(shape)
    # The curve of a live path effect may pass beside the nodes.
    return held, candidates.nearest(segments_of(held), np.array(points))


def _path(svg: Element, ids: Ids, identity: str) -> Shape:
    element = ids.get(identity)
    if element is None:
        raise HandleError(_(_NO_OBJECT).format(identity=identity))
    for ancestor in element.iterancestors():
        if ancestor is not svg and local_tag(ancestor) not in CONTAINERS:
            raise HandleError(_(_NOT_DRAWN).format(name=name_of(element), parent=name_of(ancestor)))
    if local_tag(element) != "path":
        raise HandleError(_(_NOT_A_PATH).format(name=name_of(element)))
    return read_shape(element, (parent_matrix(element) @ own_matrix(element))[:2])


def _edited(shape: Shape) -> tuple[path_data.Subpath, ...]:
    """The subpaths that the node tool shows: of a path with a live effect those that the user drew."""
    original = shape.element.attrib.get(_ORIGINAL)
    return path_data.parse(original) if original and shape.element.attrib.get(_EFFECT) else shape.subpaths


def _is_held(at: Array, rest: Array, handles: list[HandleObject], radius: float) -> bool:
    """Whether a handle holds the curve point that is now at `at` and was at `rest`, (2,) each."""
    for handle in handles:
        if handle.kind == "handle" and handle.rest is not None:
            away = np.linalg.norm(handle.rest - rest)
        elif handle.kind in ("pin", "handle", "from"):
            away = np.linalg.norm(handle.centre - at)
        else:
            continue
        if away <= max(handle.radius, radius):
            return True
    return False


def _place_section(svg: Element, held: list[Shape], handles: list[HandleObject], size: Size) -> Placed:
    """Add a section around the curves, enlarged by half a radius so that rounding excludes no point.

    After a run its rest is the image of that rectangle under the best-fitting map from the curves to their
    originals.
    """
    margin = 0.5 * size.radius * np.array([[-1.0], [1.0]])
    control = segments_of(held)
    now = candidates.bounds(control) + margin
    for handle in handles:
        if handle.kind == "section" and np.abs(handle.bounds - now).max() <= size.radius:
            return Placed((), 1)
    ends = control[:, [0, 3]].reshape(-1, 2)
    origin = original_points(svg, ends)
    rest = now
    if not np.array_equal(origin, ends):
        back = axis_aligned(Points(ends, origin, np.repeat(polygon_lengths(control), 2)))
        rest = now @ back[:2, :2].T + back[:2, 2]
    layer = Layer(svg, size)
    layer.add_section(Ids(svg), now, rest)
    return Placed(tuple(layer.added), 0)
