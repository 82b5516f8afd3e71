# SPDX-License-Identifier: GPL-2.0-or-later
"""Real clip-art with handles: builds documents from a folder's `cases.json`.

The folder is `$ALUP_CLIPART`, or `shared/clipart` beside the project.  A case names a drawing, the
elements to select, and handles by source and target in root user units.
"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import inkex
from lxml import etree

SVG = "http://www.w3.org/2000/svg"
INKSCAPE = "http://www.inkscape.org/namespaces/inkscape"
# Drawings under free licences, with cases; they are part of the project.
DRAWINGS = Path(__file__).resolve().parents[1] / "benchmarks" / "drawings"
FOLDER = Path(os.environ.get("ALUP_CLIPART", Path(__file__).resolve().parents[2] / "shared" / "clipart"))
SHAPES = ("path", "rect", "circle", "ellipse", "line", "polyline", "polygon")
NOT_RENDERED = ("defs", "symbol", "clipPath", "mask", "marker", "pattern")


@dataclass(frozen=True)
class Built:
    """tree : the drawing with handles in it; ids : of the elements to select."""

    tree: Any
    ids: list[str]

    def opened(self) -> tuple[Any, list[Any]]:
        """The root as inkex reads it, and the elements to select."""
        root = inkex.load_svg(etree.tostring(self.tree)).getroot()
        return root, [root.getElementById(identity) for identity in self.ids]


def cases(folder: Path | None = None) -> list[dict[str, Any]]:
    path = (folder or FOLDER) / "cases.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else []


def case(name: str) -> dict[str, Any]:
    return next(entry for entry in cases() if entry["name"] == name)


def _local(element: Any) -> str:
    return etree.QName(element).localname if isinstance(element.tag, str) else ""


def _rendered(element: Any) -> bool:
    chain = [element, *element.iterancestors()]
    if any(_local(ancestor) in NOT_RENDERED for ancestor in chain):
        return False
    style = [(ancestor.get("style") or "").replace(" ", "") for ancestor in chain]
    hidden = any("display:none" in text or node.get("display") == "none" for text, node in zip(style, chain))
    return not hidden and "visibility:hidden" not in style[0] and element.get("visibility") != "hidden"


def build(entry: dict[str, Any], still: bool = False, folder: Path | None = None) -> Built:
    """The case's drawing with its handles as circles; `still` leaves every handle where it is."""
    tree = etree.parse(str((folder or FOLDER) / entry["svg"]))
    root = tree.getroot()
    namespace = etree.QName(root).namespace
    elements = [e for e in root.iter() if _local(e) in SHAPES]
    if entry["select"] == "all":
        chosen = [e for e in elements if _rendered(e)]
    else:
        by_id = {e.get("id"): e for e in elements}
        chosen = [elements[s["index"]] if isinstance(s, dict) else by_id[s] for s in entry["select"]]
    for n, element in enumerate(chosen):
        if not element.get("id"):
            element.set("id", f"chosen{n}")
    tag = f"{{{namespace}}}" if namespace else ""
    group = etree.SubElement(root, f"{tag}g", id="alup-handles")
    radius = 1e-3 * _extent(root)

    def circle(label: str, at: list[float]) -> None:
        node = etree.SubElement(group, f"{tag}circle", cx=repr(at[0]), cy=repr(at[1]), r=repr(radius))
        node.set(f"{{{INKSCAPE}}}label", label)
        node.set("id", "-".join(["handle", label.split(":")[1].replace(" ", "")]) + str(len(group)))
        node.set("style", "fill:#d00" if label == "alup:pin" else "fill:#06c")

    for n, handle in enumerate(entry["handles"]):
        source, target = handle["source"], handle["target"]
        if source == target or still:
            circle("alup:pin", source)
        else:
            circle(f"alup:from {n}", source)
            circle(f"alup:to {n}", target)
    return Built(tree, [element.attrib["id"] for element in chosen])


def _extent(root: Any) -> float:
    box = (root.get("viewBox") or "").replace(",", " ").split()
    return float(box[2]) if len(box) == 4 else 100.0
