# SPDX-License-Identifier: GPL-2.0-or-later
"""The record that a run stores on an element that it changes: the steps that restore the element.

The record is the attribute `alup:original`.  It is JSON with single and double quotes exchanged, because XML
writes a double quote within an attribute as six letters.  One step leads from the element as the run left it
to its first original.  Another one leads to the base, the state that later runs start from, where that
differs:

    {'original': STEP, 'base': STEP, 'given': {...}, 'style': {...}, 'styled': HASH, 'cuts': {...}}
    STEP = {'tag': ..., 'set': {attribute: value or null}, 'style': text or null, 'order': [...]}

A step holds only what differs.  Geometry (path data, transforms, attributes that Inkscape draws shapes from)
is always put back.  Paints and other properties are put back only where they are still what the run gave them
(`given` and `style`), so that what a person has chosen since then stays.  `cuts` says where segments of the
base were divided.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from typing import Any

from lxml import etree

from ...svg import basic_shapes
from ..tree.css import parts, with_property, without_property
from ..tree.elements import INKSCAPE_NS, ORIGINAL, SODIPODI_NS, SVG_NS, WRITTEN, Element, local_name
from ..tree.references import XLINK_NS, referred
from ..tree.undo_log import State

_PREFIXES = {"inkscape": INKSCAPE_NS, "sodipodi": SODIPODI_NS, "xlink": XLINK_NS, "svg": SVG_NS}

# Geometry attributes, in addition to all attributes in Inkscape's namespaces.
_GEOMETRY = {
    "d", "transform", "gradientTransform", "patternTransform", "x", "y", "width", "height",
    *(name for names in basic_shapes.GEOMETRY.values() for name in names),
}  # fmt: skip

_PLACE = {"d", "transform", "gradientTransform", "patternTransform"}

_SWAPPED_QUOTES = str.maketrans("\"'", "'\"")


@dataclass(frozen=True)
class Step:
    """The step from an element as it was written to another state of it.

    tag : None if it is the same; attributes : the values that differ, None for a missing attribute
    style : the whole text, or None, if it differs (`restyled`)
    order : of the attributes, if it is not the natural one
    """

    tag: str | None = None
    attributes: dict[str, str | None] = field(default_factory=dict)
    restyled: bool = False
    style: str | None = None
    order: tuple[str, ...] = ()


@dataclass(frozen=True)
class Record:
    """The data stored on an element.

    base : None if it is the original
    given : properties that the run wrote as attributes, None for removed ones; and the transform of a path
        that had another one before
    style : properties that it wrote into the style attribute; styled : a hash of the whole attribute
    cuts : segment of the base -> parameters of its cuts
    """

    original: Step
    base: Step | None = None
    given: dict[str, str | None] = field(default_factory=dict)
    style: dict[str, str | None] = field(default_factory=dict)
    styled: str = ""
    cuts: dict[int, list[float]] = field(default_factory=dict)

    @property
    def moves(self) -> bool:
        """Whether the run has changed the element's geometry, not only its paint or live effect."""
        steps = [self.original] if self.base is None else [self.original, self.base]
        return any(step.tag is not None or not _PLACE.isdisjoint(step.attributes) for step in steps)

    def first(self, now: State) -> State:
        """The original, with the user's later changes."""
        return self._apply(self.original, now)

    def start(self, now: State) -> State:
        """The state that the next run starts from."""
        return self._apply(self.original if self.base is None else self.base, now)

    def _apply(self, step: Step, now: State) -> State:
        attributes = dict(plain(now).attributes)
        for name, value in step.attributes.items():
            kept = name in self.given and name != "transform"
            if kept and not _same(attributes.get(name), self.given[name]):
                continue
            if value is None:
                attributes.pop(name, None)
            else:
                attributes[name] = value
        if step.restyled:
            style = self._restyle(step.style, attributes.get("style"))
            if style is None:
                attributes.pop("style", None)
            else:
                attributes["style"] = style
        if step.order:
            known = [name for name in step.order if name in attributes]
            others = [name for name in attributes if name not in step.order]
            attributes = {name: attributes[name] for name in [*known, *others]}
        return State(step.tag or now.tag, attributes)

    def _restyle(self, old: str | None, now: str | None) -> str | None:
        """The style attribute with the run's changes of properties undone."""
        if _hash(now) == self.styled:
            return old
        before, present = properties(old), properties(now)
        for name, value in self.style.items():
            if _same(present.get(name), value):
                now = _with(now, name, before.get(name))
        return now


def plain(state: State) -> State:
    """The state without our stored attributes."""
    if ORIGINAL not in state.attributes and WRITTEN not in state.attributes:
        return state
    kept = {name: value for name, value in state.attributes.items() if name not in (ORIGINAL, WRITTEN)}
    return State(state.tag, kept)


def make(written: State, original: State, base: State, cuts: dict[int, list[float]]) -> Record | None:
    """The record of an element that was written; None if there is nothing to store."""
    written, original, base = plain(written), plain(original), plain(base)
    if written.same(original) and written.same(base):
        return None
    based = not base.same(original)
    steps = [_step(written, state) for state in ((original, base) if based else (original,))]
    changed = [name for step in steps for name in step.attributes if not _is_geometry(name)]
    given = {name: written.attributes.get(name) for name in dict.fromkeys(changed)}
    if any({"transform", "d"} <= set(step.attributes) for step in steps):
        given["transform"] = written.attributes.get("transform")
    style: dict[str, str | None] = {}
    if any(step.restyled for step in steps):
        after = properties(written.attributes.get("style"))
        for state in (original, base):
            before = properties(state.attributes.get("style"))
            for name in [*after, *before]:
                if after.get(name) != before.get(name):
                    style[name] = after.get(name)
    styled = _hash(written.attributes.get("style")) if any(step.restyled for step in steps) else ""
    return Record(steps[0], steps[1] if based else None, given, style, styled, cuts)


def _step(written: State, goal: State) -> Step:
    names = dict.fromkeys([*goal.attributes, *written.attributes])
    differing: dict[str, str | None] = {
        name: goal.attributes.get(name)
        for name in names
        if name != "style" and goal.attributes.get(name) != written.attributes.get(name)
    }
    restyled = goal.attributes.get("style") != written.attributes.get("style")
    natural = [name for name in written.attributes if name in goal.attributes]
    natural += [name for name in goal.attributes if name not in written.attributes and name != "style"]
    natural += ["style"] if "style" in goal.attributes and "style" not in written.attributes else []
    order = () if natural == list(goal.attributes) else tuple(goal.attributes)
    shaped = not differing.keys().isdisjoint(basic_shapes.GEOMETRY.get(local_name(goal.tag), ()))
    tag = None if goal.tag == written.tag and not shaped else goal.tag
    return Step(tag, differing, restyled, goal.attributes.get("style") if restyled else None, order)


def _hash(style: str | None) -> str:
    return hashlib.blake2b((style or "").encode("utf-8", "replace"), digest_size=4).hexdigest()


def _is_geometry(name: str) -> bool:
    return name in _GEOMETRY or name.startswith((f"{{{INKSCAPE_NS}}}", f"{{{SODIPODI_NS}}}"))


def properties(style: str | None) -> dict[str, str]:
    """Property -> unparsed value of a style attribute."""
    found = {}
    for part in parts(style or ""):
        name, colon, value = part.partition(":")
        if colon:
            found[name.strip()] = value.strip()
    return found


def _same(now: str | None, written: str | None) -> bool:
    """Whether a property is what was written; quotes of references may differ between programs."""
    if now is None or written is None:
        return now is written
    same_reference = referred(now) is not None and referred(now) == referred(written)
    return same_reference or now.strip() == written.strip()


def _with(style: str | None, name: str, value: str | None) -> str | None:
    if value is not None:
        return with_property(style, name, value)
    return without_property(style, name)


# --- as text --------------------------------------------------------------------------------------


def to_text(record: Record) -> str:
    entry: dict[str, Any] = {"original": _step_entry(record.original)}
    if record.base is not None:
        entry["base"] = _step_entry(record.base)
    if record.given:
        entry["given"] = {_short(name): value for name, value in record.given.items()}
    if record.style:
        entry["style"] = record.style
    if record.styled:
        entry["styled"] = record.styled
    if record.cuts:
        entry["cuts"] = {str(n): [float(f"{t:.9g}") for t in cuts] for n, cuts in record.cuts.items()}
    return json.dumps(entry, ensure_ascii=False, separators=(",", ":")).translate(_SWAPPED_QUOTES)


def _step_entry(step: Step) -> dict[str, Any]:
    entry: dict[str, Any] = {}
    if step.tag is not None:
        entry["tag"] = _short(step.tag)
    if step.attributes:
        entry["set"] = {_short(name): value for name, value in step.attributes.items()}
    if step.restyled:
        entry["style"] = step.style
    if step.order:
        entry["order"] = [_short(name) for name in step.order]
    return entry


def from_text(text: str) -> Record | None:
    """The record from its text; None if the text is invalid, for instance after an edit in the XML editor."""
    try:
        entry = json.loads(text.translate(_SWAPPED_QUOTES))
        base = entry.get("base")
        return Record(
            _read_step(entry["original"]),
            None if base is None else _read_step(base),
            _values(entry.get("given", {})),
            _values(entry.get("style", {})),
            str(entry.get("styled", "")),
            {int(n): [float(t) for t in cuts] for n, cuts in entry.get("cuts", {}).items()},
        )
    except (ValueError, KeyError, TypeError, AttributeError):
        return None


def _read_step(entry: Any) -> Step:
    tag = None if entry.get("tag") is None else _long(entry["tag"])
    step = Step(
        tag,
        _values(entry.get("set", {})),
        "style" in entry,
        _values({"style": entry.get("style")})["style"],
        tuple(_long(name) for name in entry.get("order", ())),
    )
    # Names that XML forbids are detected here.  Otherwise they would fail while the drawing is being changed.
    trial = etree.Element(tag or "path")
    for name, value in {**step.attributes, "style": step.style}.items():
        trial.attrib[name] = value or ""
    return step


def _values(entry: Any) -> dict[str, str | None]:
    found: dict[str, str | None] = {}
    for name, value in entry.items():
        if not isinstance(value, (str, type(None))):
            raise TypeError
        found[_long(name)] = value
    return found


def _short(name: str) -> str:
    """The name with a short prefix instead of the namespace."""
    for prefix, namespace in _PREFIXES.items():
        if name.startswith(f"{{{namespace}}}"):
            return f"{prefix}:{name[len(namespace) + 2 :]}"
    return name


def _long(name: str) -> str:
    if name.startswith("{"):
        return name
    prefix, colon, local = name.partition(":")
    return f"{{{_PREFIXES[prefix]}}}{local}" if colon else name


def store(element: Element, record: Record | None, digest: str | None) -> None:
    """Store a record on an element, or remove it if it is None."""
    for name, value in ((ORIGINAL, None if record is None else to_text(record)), (WRITTEN, digest)):
        if value is not None:
            element.attrib[name] = value
        else:
            element.attrib.pop(name, None)
