# SPDX-License-Identifier: GPL-2.0-or-later
"""Documents in which handles are placed, and the handles that are found in them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from documents import ALUP, INKSCAPE, LABEL, SODIPODI, SVG, XLINK, get, opened

from alup.document import place_handles
from alup.document.handles import handle_objects
from alup.document.tree.own_objects import LAYER_LABEL, labelled

HEAD = f'<svg xmlns="{SVG}" xmlns:xlink="{XLINK}" xmlns:inkscape="{INKSCAPE}" xmlns:sodipodi="{SODIPODI}" '
BOX = '<path id="box" d="M20,30 H80 V70 H20 Z"/>'
CORNERS = [[20, 30], [80, 30], [80, 70], [20, 70]]


def guide(position: str, orientation: str) -> str:
    return f'<sodipodi:guide id="g" position="{position}" orientation="{orientation}"/>'


def with_guides(*lines: str) -> str:
    return f"<sodipodi:namedview>{''.join(lines)}</sodipodi:namedview>{BOX}"


def load(body: str, root: str = 'viewBox="0 0 100 100"') -> Any:
    return opened(f"{HEAD}{root}>{body}</svg>")


def place(svg: Any, where: str, *selected: str, nodes: tuple[str, ...] = ()) -> place_handles.Placed:
    return place_handles.place(svg, where, [get(svg, identity) for identity in selected], nodes)


def handles(svg: Any) -> list[handle_objects.HandleObject]:
    return [handle_objects.read_handle(element, label) for element, label in labelled(svg)]


def centres(svg: Any) -> np.ndarray:
    return np.array([handle.centre for handle in handles(svg)])


def assert_placed(svg: Any, wanted: object, within: float = 1e-6) -> None:
    """The handles stand, at rest, on the wanted points, whatever their order."""
    found, points = centres(svg), np.asarray(wanted, dtype=float)
    assert len(found) == len(points), found
    away = np.linalg.norm(found[:, None] - points[None], axis=2)
    assert away.min(axis=0).max() <= within
    assert away.min(axis=1).max() <= within
    for handle in handles(svg):
        assert handle.rest == pytest.approx(handle.centre, abs=1e-9)
        assert handle.kind == "handle"


def layer_of(svg: Any) -> Any:
    return next(e for e in svg.iter() if e.get(LABEL) == LAYER_LABEL)


def arrows(svg: Any) -> list[Any]:
    return [e for e in svg.iter() if e.get(f"{{{ALUP}}}arrow") is not None]
