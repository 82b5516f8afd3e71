# SPDX-License-Identifier: GPL-2.0-or-later
"""Compare a reshaped drawing with its input: only what a run may change may differ.

The two files are walked side by side, element by element and attribute by attribute.  Every difference must
be on this list of what a run may change:

    shapes that were to be reshaped   their geometry; they may become paths; paints and clips that are copies
    texts, images that go along       their transform
    handles                           their place and colour
    gradients, patterns               their transform
    clip paths, masks                 what is in them
    groups with a live effect         the effect, which would be applied anew
    anything                          our own attributes

The only elements that may be new are copies of paints, clip paths and masks, which are marked as such.
Elements that were not to be reshaped must look the same, so nothing that they refer to may differ.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any, Iterator

import numpy as np
from lxml import etree

from alup.document.tree.elements import (
    ALUP_NS,
    CARRIED,
    COPY,
    INKSCAPE_NS,
    SODIPODI_NS,
    local_tag,
    read_shape,
)
from alup.document.tree.own_objects import LAYER_LABEL, NOTES_LABEL, is_group, is_ours
from alup.document.tree.references import SERVERS, XLINK_HREF
from alup.geometry import bezier
from alup.messages.errors import AlupError
from alup.svg import basic_shapes

Array = np.ndarray

# Largest distance between a curve and the target of its handle, relative to the diagonal.
HANDLES_WITHIN = 5e-4

# Relative to the coordinates: shorter segments are caused by rounding in the file.
ROUNDING = 1e-8

_CLIPS = ("clipPath", "mask")
_PAINT_NAMES = ("fill", "stroke", "clip-path", "mask")
_LIVE = {
    f"{{{INKSCAPE_NS}}}{name}" for name in ("path-effect", "original-d", "flatsided", "rounded", "randomized")
}
_NODETYPES = f"{{{SODIPODI_NS}}}nodetypes"
_NOT_A_NUMBER = re.compile(r"(?<![A-Za-z_#])[-+]?(?:nan|inf)(?![A-Za-z_])", re.IGNORECASE)
_URL = re.compile(r"""url\(\s*["']?\s*#([^"')]+?)\s*["']?\s*\)""")
_NUMERIC = ("d", "points", "transform", "gradientTransform", "patternTransform", "x", "y", "width", "height",
            "cx", "cy", "r", "rx", "ry")  # fmt: skip


@dataclass
class Found:
    """faults : each begins with its kind and a colon; none for a good output
    changed : number of elements with other coordinates; missed : of the worst handle, relative to the
    diagonal growth : how far anything reaches beyond the earlier bounds with the handles, in diagonals
    """

    faults: list[str] = field(default_factory=list)
    changed: int = 0
    missed: float = 0.0
    growth: float = 0.0


def parse(data: bytes) -> Any:
    """The root of exactly one XML document; raises etree.XMLSyntaxError otherwise.

    Namespaces may have no address or an invalid one, as in some inputs.
    """
    parser = etree.XMLParser(huge_tree=True, strip_cdata=False)
    try:
        return etree.fromstring(data, parser)
    except etree.XMLSyntaxError:
        if any(entry.domain != etree.ErrorDomains.NAMESPACE for entry in parser.error_log):
            raise
    return etree.fromstring(data, etree.XMLParser(huge_tree=True, strip_cdata=False, recover=True))


def compare(before: Any, after: Any, affected: dict[int, Array | None], wishes: list[Any]) -> Found:
    """Look for differences that a run must not make.

    before, after : roots; affected : index in `before.iter()` of what was to be reshaped -> (2, 3) matrix
    of a shape to root user units, or None for texts, images and clones; wishes : with `source`, `target`
    """
    found = Found()
    pairs = list(_pairs(before, after, found.faults))
    if found.faults:
        return found
    check = _Check(before, affected, {new.attrib["id"] for new in _copies(after)}, found)
    for old, new in pairs:
        check.element(old, new)
    check.bystanders([old for old, _ in pairs])
    _curves(pairs, affected, wishes, found)
    return found


def _copies(after: Any) -> list[Any]:
    return [e for e in after.iter(etree.Element) if COPY in e.attrib and "id" in e.attrib]


def _pairs(before: Any, after: Any, faults: list[str]) -> Iterator[tuple[Any, Any]]:
    """The elements of both in order, without copies and notes; adds a fault where they do not correspond."""
    stack = [(before, after)]
    while stack:
        old, new = stack.pop()
        yield old, new
        there = list(old)
        now = [child for child in new if not (_is_copy(child) or _is_of_notes(child))]
        if len(there) != len(now):
            faults.append(f"elements: {_name(old)} had {len(there)} children and has {len(now)}")
            return
        for one, other in zip(there, now):
            if isinstance(one.tag, str) and one.attrib.get("id") != other.attrib.get("id"):
                faults.append(f"ids: {_name(one)} became {_name(other)}")
                return
        stack += reversed(list(zip(there, now)))


def _is_copy(element: Any) -> bool:
    return (
        isinstance(element.tag, str) and COPY in element.attrib and local_tag(element) in (*SERVERS, *_CLIPS)
    )


def _is_of_notes(element: Any) -> bool:
    """Whether it is the group of notes, or a layer that was made for them."""
    made = is_group(element, LAYER_LABEL) and all(is_group(part, NOTES_LABEL) for part in element)
    return made or is_group(element, NOTES_LABEL)


def _name(element: Any) -> str:
    return str(element.attrib.get("id") or local_tag(element) or element.tag)


class _Check:
    """One comparison.  copies : ids of the copies that the run has made."""

    def __init__(self, before: Any, affected: dict[int, Array | None], copies: set[str], found: Found):
        self._affected, self._copies, self._found = affected, copies, found
        self._sheets = any(local_tag(element) == "style" for element in before.iter())
        self._different: set[Any] = set()
        self._order = {element: n for n, element in enumerate(before.iter())}
        self._live = any(name in element.attrib for element in before.iter(etree.Element) for name in _LIVE)

    def element(self, old: Any, new: Any) -> None:
        """Compare an element with what became of it."""
        n = self._order[old]
        fault = self._found.faults.append
        if not isinstance(old.tag, str):
            if old.tag is not new.tag or (old.text or "") != (new.text or ""):
                fault(f"elements: {_name(old)} is another comment or instruction")
            return
        inside_clip = any(local_tag(e) in _CLIPS for e in (old, *old.iterancestors()))
        shape = n in self._affected and self._affected[n] is not None
        role = self._role(n, old, inside_clip)
        if old.tag != new.tag:
            became_path = local_tag(new) == "path" and (shape or inside_clip)
            if not became_path:
                fault(f"elements: {_name(old)} became a {local_tag(new)}")
        if (old.text or "").strip() != (new.text or "").strip():
            fault(f"elements: the text of {_name(old)} changed")
        if (old.tail or "").strip() != (new.tail or "").strip():
            fault(f"elements: the text after {_name(old)} changed")
        changes = [
            (name, old.attrib.get(name), new.attrib.get(name))
            for name in {**old.attrib, **new.attrib}
            if old.attrib.get(name) != new.attrib.get(name) and not name.startswith(f"{{{ALUP_NS}}}")
        ]
        for name, was, now in changes:
            if name in _NUMERIC and now and _NOT_A_NUMBER.search(now):
                fault(f"not finite: {name} of {_name(old)} is {_shortened(now)}")
            if not self._may_change(role, old, name, was, now):
                kind = "styles" if name in ("style", "class", *_PAINT_NAMES) else "attributes"
                kind = kind if n in self._affected or role else "outside"
                fault(f"{kind}: {name} of {_name(old)} was {_shortened(was)} and is {_shortened(now)}")
        if changes:
            self._different.add(old)
        if role in ("shape", "carried") and changes:
            self._found.changed += 1

    def _role(self, n: int, old: Any, inside_clip: bool) -> str:
        if is_ours(old):
            return "handle"
        if n in self._affected:
            return "carried" if self._affected[n] is None else "shape"
        if inside_clip:
            return "clip"
        return "server" if local_tag(old) in SERVERS else ""

    def _may_change(self, role: str, old: Any, name: str, was: str | None, now: str | None) -> bool:
        tag = local_tag(old)
        if role == "handle":
            return name in ("cx", "cy", "style", "transform")
        if name == "style" or name in _PAINT_NAMES:
            return self._may_restyle(role, tag, name, was, now)
        if role == "carried" or (role == "clip" and tag in CARRIED):
            return name == "transform"
        if role == "server":
            return name == SERVERS[tag][1]
        if role in ("shape", "clip") and self._is_geometry(tag, name, now, role):
            return True
        # A live effect of a group is removed with the attributes that its paths were made from.
        return self._live and name in _LIVE and now is None

    def _is_geometry(self, tag: str, name: str, now: str | None, role: str) -> bool:
        if name in ("d", _NODETYPES):
            return True
        if tag == "mask":
            return name in ("x", "y", "width", "height")
        if tag == "use" and role == "clip":
            return True
        gone = (
            name in basic_shapes.GEOMETRY.get(tag, ())
            or name in _LIVE
            or name.startswith(f"{{{SODIPODI_NS}}}")
        )
        return gone and now is None

    def _may_restyle(self, role: str, tag: str, name: str, was: str | None, now: str | None) -> bool:
        """Whether the difference is only that paints and clips became copies."""
        if role not in ("shape", "clip", "carried") and tag not in ("g", "a", "switch"):
            return False
        old, new = (_properties(name, text) for text in (was, now))
        for key in {**old, **new}:
            if old.get(key) == new.get(key):
                continue
            to = _URL.search(new.get(key, ""))
            copied = key in _PAINT_NAMES and to is not None and to.group(1) in self._copies
            # Style rules for rectangles do not match a path, so a former rectangle has their values itself.
            restated = self._sheets and key not in old and tag in basic_shapes.TAGS
            if not (copied or restated):
                return False
        return True

    def bystanders(self, elements: list[Any]) -> None:
        """Nothing that the elements that were not to be reshaped refer to may differ."""
        by_id: dict[str, Any] = {}
        for element in elements:
            if isinstance(element.tag, str) and element.attrib.get("id"):
                by_id.setdefault(element.attrib["id"], element)
        if not self._different:
            return
        for element in elements:
            tag = local_tag(element)
            if (
                tag not in ("path", *basic_shapes.TAGS, "text", "image", "g")
                or self._order[element] in self._affected
            ):
                continue
            if any(
                local_tag(e) in ("defs", *_CLIPS, *SERVERS, "symbol", "marker")
                for e in element.iterancestors()
            ):
                continue
            if tag == "g" and any(self._order[part] in self._affected for part in element.iter()):
                continue
            if is_ours(element):
                continue
            for referred in _referred(element, by_id):
                if referred in self._different and self._order[referred] not in self._affected:
                    self._found.faults.append(
                        f"outside: {_name(element)} refers to {_name(referred)}, which changed"
                    )


def _properties(name: str, text: str | None) -> dict[str, str]:
    if name != "style":
        return {} if text is None else {name: text.strip()}
    items = (part.partition(":") for part in (text or "").split(";"))
    return {key.strip(): value.replace("!important", "").strip() for key, _, value in items if key.strip()}


def _referred(element: Any, by_id: dict[str, Any]) -> set[Any]:
    """The paints and clips of an element, and the elements that these refer to."""
    found: set[Any] = set()
    stack = [element]
    while stack:
        one = stack.pop()
        for part in one.iter(etree.Element) if one is not element else [one]:
            texts = [part.attrib.get(name) or "" for name in ("style", *_PAINT_NAMES)]
            names = [name for text in texts for name in _URL.findall(text)]
            if local_tag(part) in SERVERS:
                names.append((part.attrib.get(XLINK_HREF) or part.attrib.get("href") or "")[1:])
            for target in (by_id.get(name) for name in names):
                if target is not None and target not in found:
                    found.add(target)
                    stack.append(target)
    return found


def _curves(
    pairs: list[tuple[Any, Any]], affected: dict[int, Array | None], wishes: list[Any], found: Found
) -> None:
    """Check the curves: the same number, finite, and at the targets of the handles."""
    order = {element: n for n, element in enumerate(pairs[0][0].iter())}
    old_curves, new_curves = [np.zeros((0, 4, 2))], [np.zeros((0, 4, 2))]
    for old, new in pairs:
        matrix = affected.get(order[old])
        if matrix is None:
            continue
        was = read_shape(old, matrix)
        try:
            now = read_shape(new, matrix)
        except AlupError as error:
            found.faults.append(f"not finite: {error}")
            continue
        if [s.closed for s in was.subpaths] != [s.closed for s in now.subpaths]:
            found.faults.append(f"curves: {_name(old)} has other subpaths")
            continue
        for one, other in zip(was.subpaths, now.subpaths):
            # The line of `z` may be as short as the rounding of the start, and then it may be missing.
            length = bezier.polygon_lengths(one.control)
            needed = int(np.sum(length > ROUNDING * max(length.max(initial=0.0), np.abs(one.start).max())))
            if len(other.control) < needed:
                counts = f"{needed} segments and has {len(other.control)}"
                found.faults.append(f"curves: a subpath of {_name(old)} had {counts}")
        if was.subpaths:
            old_curves.append(was.control)
            new_curves.append(now.control)
    old_all, new_all = np.concatenate(old_curves), np.concatenate(new_curves)
    if not len(old_all) or found.faults:
        return
    low, high = old_all.min(axis=(0, 1)), old_all.max(axis=(0, 1))
    diagonal = float(np.hypot(*(high - low)))
    if wishes:
        curves = bezier.Nearest(new_all)
        away = [curves.find(wish.target)[3] / diagonal for wish in wishes]
        found.missed = float(max(away))
        for wish, distance in zip(wishes, away):
            if not distance <= HANDLES_WITHIN:
                kind = "pin" if np.array_equal(wish.source, wish.target) else "moved handle"
                x, y = wish.target
                found.faults.append(
                    f"handle: a {kind} for {x:.6g}, {y:.6g} is missed by {distance:.2g} of the diagonal"
                )
        targets = np.array([wish.target for wish in wishes])
        low, high = np.minimum(low, targets.min(axis=0)), np.maximum(high, targets.max(axis=0))
    beyond = np.maximum(low - new_all.min(axis=(0, 1)), new_all.max(axis=(0, 1)) - high)
    found.growth = float(max(0.0, beyond.max() / diagonal))


def _shortened(text: str | None) -> str:
    return "missing" if text is None else repr(text if len(text) <= 60 else text[:57] + "...")
