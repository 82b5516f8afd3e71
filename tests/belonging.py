# SPDX-License-Identifier: GPL-2.0-or-later
"""A square with everything that may belong to it: paint, clips, masks, text, images, live effects."""

# XML is read more easily on one line.
# ruff: noqa: E501

from __future__ import annotations

import re
from typing import Any

import numpy as np
from documents import get
from reruns import drag, handle, load, run

from alup.document.tree import elements

GRADIENT = (
    '<linearGradient id="g" gradientUnits="userSpaceOnUse" x1="20" y1="50" x2="80" y2="50">'
    '<stop offset="0" stop-color="#f00"/><stop offset="1" stop-color="#00f"/></linearGradient>'
)
CLIP = '<clipPath id="c"><rect id="cr" x="30" y="30" width="30" height="30"/></clipPath>'
AROUND = handle(20, 20, "h0") + handle(80, 20, "h1") + handle(80, 80, "h2") + handle(20, 80, "h3")
SQUARE = '<rect id="l" x="20" y="20" width="60" height="60" {}/>'
OTHER = '<rect id="o" x="200" y="20" width="60" height="60" {}/>'
FILLED = SQUARE.format('fill="url(#g)"')
BELONGING = {
    "gradient": (f"<defs>{GRADIENT}</defs>", SQUARE.format('fill="url(#g)"')),
    "gradient in a style": (f"<defs>{GRADIENT}</defs>", SQUARE.format('style="stroke:red; fill : url(#g) red"')),
    "shared gradient": (f"<defs>{GRADIENT}</defs>\n", SQUARE.format('style="fill:url(#g)"') + OTHER.format('fill="url(#g)"')),
    "pattern": ('<defs><pattern id="g" patternUnits="userSpaceOnUse" width="9" height="9"><path d="M0,0h5"/></pattern></defs>', SQUARE.format('fill="url(#g)"')),
    "clip": (f"<defs>{CLIP}</defs>", SQUARE.format('clip-path="url(#c)"')),
    "shared clip": (f"<defs>\n  {CLIP}\n</defs>", SQUARE.format('clip-path="url(#c)"') + OTHER.format('clip-path="url(#c)"')),
    "clip of clones": ('<defs><path id="cp" d="M30,30 h30 v30 z"><title>T</title></path><clipPath id="c"><use id="cu" xlink:href="#cp"/></clipPath></defs>', SQUARE.format('clip-path="url(#c)"')),
    "mask": ('<defs><mask id="m" maskUnits="userSpaceOnUse" x="10" y="10" width="80" height="80"><rect id="mr" x="30" y="30" width="30" height="30" fill="white"/><text id="mt" x="40" y="40">M</text></mask></defs>', SQUARE.format('style="mask:url(#m)"')),
    "clip of a group": (f"<defs>{CLIP}</defs>", f'<g id="n" clip-path="url(#c)">{SQUARE.format("")}</g>'),
    "clipped clip": (f'<defs>{CLIP.replace("<clipPath", "<clipPath clip-path=" + chr(34) + "url(#d)" + chr(34))}<clipPath id="d"><circle id="dc" cx="50" cy="50" r="12"/></clipPath></defs>', SQUARE.format('clip-path="url(#c)"')),
    "shared clipped clip": (f'<defs>{CLIP.replace("<clipPath", "<clipPath clip-path=" + chr(34) + "url(#d)" + chr(34))}<clipPath id="d"><rect id="dr" x="40" y="40" width="30" height="30"/></clipPath></defs>', SQUARE.format('clip-path="url(#c)"') + OTHER.format('clip-path="url(#c)"')),
    "text": ("", SQUARE.format("") + '<text id="t" x="30" y="50" style="font-size:10px">Text</text>'),
    "image": ("", SQUARE.format("") + '<image id="i" x="30" y="30" width="20" height="20" transform="rotate(3)"/>'),
    "style sheet": ("<style>rect {fill:#0a0;opacity:0.5} .c {stroke:url(#g)}</style><defs>" + GRADIENT + "</defs>", SQUARE.format('class="c"')),
    "live effect": ("", '<g id="n" inkscape:path-effect="#e"><path id="l" inkscape:original-d="M 0,0" inkscape:path-effect="#f" d="M20,20 h60 v60 h-60 z" sodipodi:nodetypes="ccccc"/>'
                        '<path id="x" inkscape:original-d="M 1,1" style="display:none" d="M1,1 h3"/></g>'),
    "star": ("", '<path id="l" sodipodi:type="star" sodipodi:sides="5" inkscape:rounded="0" d="M20,20 h60 v60 h-60 z" style="fill:red"/>'),
}  # fmt: skip


def push(svg: Any, x: float, y: float, wider: float = 1.0) -> None:
    """Drag the four handles of the square along."""
    for n, (px, py) in enumerate(((20, 20), (80, 20), (80, 80), (20, 80))):
        drag(svg, f"h{n}", 20 + (px - 20) * wider + x, py + y)


def pushed(which: str, ids: str = "") -> Any:
    """A shape with one of BELONGING, after a run in which it was pushed by (40, 10)."""
    defs, body = BELONGING[which]
    svg = load(defs + body + AROUND)
    push(svg, 40, 10)
    run(svg, ids)
    return svg


def paint_shift(svg: Any, identity: str) -> np.ndarray:
    """How far an element's paint or clip has been moved from its first place."""
    element = get(svg, identity)
    text = " ".join(element.attrib.get(name) or "" for name in ("style", "fill", "clip-path"))
    target = get(svg, re.search(r"url\(#([^)]+)\)", text).group(1))  # type: ignore[union-attr]
    if target.tag.endswith("clipPath"):
        return clip_shift(svg, target.attrib["id"], (30, 30))
    name = "patternTransform" if "pattern" in target.tag else "gradientTransform"
    return elements.own_matrix(target, name)[:2, 2]


def clip_of(svg: Any, identity: str) -> str:
    return str(get(svg, identity).attrib["clip-path"])[5:-1]


def clip_shift(svg: Any, identity: str, corner: tuple[float, float]) -> np.ndarray:
    """How far the first shape of a clip path has been moved.  corner : its first upper left corner"""
    points = elements.read_shape(get(svg, identity)[0], np.eye(3)[:2]).control[:, [0, 3]].reshape(-1, 2)
    return points.min(axis=0) - corner
