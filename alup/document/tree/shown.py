# SPDX-License-Identifier: GPL-2.0-or-later
"""An untrusted drawing -> a harmless copy that looks the same, for a web page.

The drawing itself is never shown.  The copy is built from lists of allowed elements, attributes and
properties.  Everything else is left out: scripts, event attributes, foreign objects, animations, links,
at-rules, and every address except `#id` and raster images that are embedded in the file.  A list of what is
allowed can't miss an attack that nobody thought of.  The page's content security policy is a second barrier.
The document is not changed.
"""

from __future__ import annotations

import copy
import re
from dataclasses import dataclass, field
from typing import Collection, Iterator, Mapping

from lxml import etree

from . import css, styles
from .elements import SODIPODI_NS, SVG_NS, Element, local_tag, outline_of
from .own_objects import LAYER_LABEL, is_group, is_ours

XLINK_HREF = "{http://www.w3.org/1999/xlink}href"
_XML_SPACE = "{http://www.w3.org/XML/1998/namespace}space"

# Attributes of the copy: the element's number in the document, and whether it is dimmed.
KEY, DIM = "data-k", "data-dim"

# Greatest number of elements that clones, and clones of clones, may draw.  More keep a browser busy for
# minutes.
MOST_COPIES = 100_000

_FILTERS = (
    "feBlend feColorMatrix feComponentTransfer feComposite feConvolveMatrix feDiffuseLighting "
    "feDisplacementMap feDistantLight feDropShadow feFlood feFuncA feFuncB feFuncG feFuncR feGaussianBlur "
    "feMerge feMergeNode feMorphology feOffset fePointLight feSpecularLighting feSpotLight feTile "
    "feTurbulence"
)
_DRAWN = (
    "svg g switch defs symbol use path rect circle ellipse line polyline polygon text tspan textPath image "
    "clipPath mask pattern marker linearGradient radialGradient stop filter"
)
ELEMENTS = frozenset((*_DRAWN.split(), *_FILTERS.split()))

_OF_PROPERTIES = (
    "alignment-baseline baseline-shift clip clip-path clip-rule color color-interpolation "
    "color-interpolation-filters color-rendering direction display dominant-baseline fill fill-opacity "
    "fill-rule filter flood-color flood-opacity font font-family font-feature-settings font-kerning "
    "font-size font-size-adjust font-stretch font-style font-variant font-variation-settings font-weight "
    "image-rendering isolation letter-spacing lighting-color line-height marker marker-end marker-mid "
    "marker-start mask mask-type mix-blend-mode opacity overflow paint-order shape-rendering stop-color "
    "stop-opacity stroke stroke-dasharray stroke-dashoffset stroke-linecap stroke-linejoin "
    "stroke-miterlimit stroke-opacity stroke-width text-align text-anchor text-decoration "
    "text-decoration-color text-decoration-line text-decoration-style text-indent text-orientation "
    "text-rendering text-transform transform transform-box transform-origin unicode-bidi vector-effect "
    "visibility white-space word-spacing writing-mode x y cx cy r rx ry width height"
)
PROPERTIES = frozenset(_OF_PROPERTIES.split())

_OF_ATTRIBUTES = (
    "id class d points pathLength x1 y1 x2 y2 fx fy fr dx dy rotate textLength lengthAdjust startOffset "
    "viewBox preserveAspectRatio refX refY markerWidth markerHeight markerUnits orient clipPathUnits "
    "maskUnits maskContentUnits patternUnits patternContentUnits patternTransform gradientUnits "
    "gradientTransform spreadMethod offset filterUnits primitiveUnits in in2 result mode type values "
    "tableValues slope intercept amplitude exponent operator k1 k2 k3 k4 order kernelMatrix divisor bias "
    "targetX targetY edgeMode preserveAlpha surfaceScale diffuseConstant specularConstant "
    "specularExponent kernelUnitLength azimuth elevation z pointsAtX pointsAtY pointsAtZ "
    "limitingConeAngle scale xChannelSelector yChannelSelector stdDeviation radius baseFrequency "
    "numOctaves seed stitchTiles requiredFeatures systemLanguage"
)
ATTRIBUTES = PROPERTIES | frozenset(_OF_ATTRIBUTES.split())

# Functions that a value may contain; `url` is checked separately.
_OF_FUNCTIONS = (
    "rgb rgba hsl hsla matrix translate scale rotate skewx skewy rect calc blur brightness contrast "
    "drop-shadow grayscale hue-rotate invert opacity saturate sepia icc-color"
)
_FUNCTIONS = frozenset(_OF_FUNCTIONS.split())
_CALL = re.compile(r"([-\w]*)\s*\(")
_LOCAL_URL = re.compile(r"""url\(\s*(["']?)#[^"'()\s\\]+\1\s*\)""", re.IGNORECASE)
_LOCAL = re.compile(r"#[^\s\"'()\\]+$")
_RASTER = re.compile(
    r"data:image/(?:png|jpe?g|gif|webp|bmp)\s*;\s*base64\s*,[A-Za-z0-9+/=\s%]*$", re.IGNORECASE
)
# Allowed characters of selectors.  Escapes are excluded, because they could hide anything.
_SELECTORS = re.compile(r"[-\w\s.#,>+~*:()\[\]=\"'|^$]*$")
_OUTSIDE = re.compile(r":+\s*(?:host|slotted|part|root)", re.IGNORECASE)
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff\\]")


@dataclass
class Shown:
    """A copy that may be shown.

    root : of the copy
    by_key : its elements by their numbers in the document
    """

    root: Element
    by_key: dict[int, Element] = field(default_factory=dict)

    def text(self) -> str:
        return str(etree.tostring(self.root, encoding="unicode"))

    def copy(self) -> Shown:
        root = copy.deepcopy(self.root)
        return Shown(root, {int(one.attrib[KEY]): one for one in root.iter() if KEY in one.attrib})

    def set(self, key: int, name: str, value: str | None) -> bool:
        """Set an attribute of an element, or remove it; returns whether that changes anything."""
        element = self.by_key.get(key)
        if element is None or element.attrib.get(name) == value:
            return False
        if value is None:
            del element.attrib[name]
        else:
            element.attrib[name] = value
        return True


def show(
    svg: Element,
    keys: Mapping[Element, int],
    box: tuple[float, float, float, float],
    curves: Collection[Element],
    lit: Collection[Element] | None = None,
) -> Shown:
    """The copy of a document that a page may show.

    keys : numbers of elements; box : x, y, width, height of the page, root user units
    curves : shapes that are shown as paths, which they will become
    lit : elements that are not dimmed, None for all
    """
    found = styles.Styles(svg)
    renamed = [element for element in curves if local_tag(element) != "path"]
    kept = found.lost_by_renaming(renamed)
    copier = _Copier(keys, frozenset(curves), kept, None if lit is None else _with_ancestors(lit))
    root = copier.copied(svg, None, False)
    for name in ("width", "height", "x", "y", "preserveAspectRatio", "transform"):
        root.attrib.pop(name, None)
    root.attrib["viewBox"] = " ".join(f"{value:.12g}" for value in box)
    _bound_copies(root)
    return Shown(root, copier.by_key)


def page_colour(svg: Element) -> str | None:
    """Inkscape's colour of the page, #rrggbb, or None if the document has none."""
    for view in svg.iter(f"{{{SODIPODI_NS}}}namedview"):
        colour = view.attrib.get("pagecolor") or ""
        if re.match(r"#[0-9a-fA-F]{6}$", colour):
            return str(colour)
    return None


def changes(before: Shown, after: Shown) -> dict[int, dict[str, str | None]] | None:
    """The attributes that differ, by the elements' keys; None if more than attributes differ."""
    found: dict[int, dict[str, str | None]] = {}
    one, other = list(before.root.iter()), list(after.root.iter())
    if len(one) != len(other):
        return None
    for old, new in zip(one, other):
        if (old.tag, old.text, old.tail, len(old)) != (new.tag, new.text, new.tail, len(new)):
            return None
        if old.attrib.get(KEY) != new.attrib.get(KEY):
            return None
        differing = {
            name: new.attrib.get(name)
            for name in {*old.attrib, *new.attrib}
            if old.attrib.get(name) != new.attrib.get(name)
        }
        if differing:
            if KEY not in new.attrib or any("{" in name for name in differing):
                return None
            found[int(new.attrib[KEY])] = differing
    return found


def _with_ancestors(lit: Collection[Element]) -> dict[Element, bool]:
    """The lit elements with False, and their ancestors with True."""
    found = dict.fromkeys(lit, False)
    for element in lit:
        for ancestor in element.iterancestors():
            found.setdefault(ancestor, True)
    return found


@dataclass
class _Copier:
    keys: Mapping[Element, int]
    curves: frozenset
    kept: Mapping[Element, Mapping[str, str]]
    lit: dict[Element, bool] | None
    by_key: dict[int, Element] = field(default_factory=dict)

    def copied(self, element: Element, parent: Element | None, decided: bool) -> Element:
        """A copy of the allowed parts of an element and its descendants.

        decided : whether an ancestor already determines if the element is lit
        """
        tag = local_tag(element)
        as_path = element in self.curves and tag != "path"
        name = f"{{{SVG_NS}}}{'path' if as_path else 'g' if tag == 'a' else tag}"
        if parent is None:
            new = etree.Element(name, nsmap={None: SVG_NS, "xlink": XLINK_HREF[1:].partition("}")[0]})
        else:
            new = etree.SubElement(parent, name)
        for attribute, value in _attributes(element, tag):
            new.attrib[attribute] = value
        if as_path:
            new.attrib["d"] = outline_of(element, "")
        for more, value in self.kept.get(element, {}).items():
            style = _style(f"{more}:{value}")
            new.attrib["style"] = ";".join(filter(None, (new.attrib.get("style"), style)))
        if element in self.keys:
            new.attrib[KEY] = str(self.keys[element])
            self.by_key[self.keys[element]] = new
        if self.lit is not None and not decided and parent is not None and tag not in ("defs", "style"):
            looked_into = self.lit.get(element)
            decided = looked_into is not True
            if looked_into is None and _is_drawn(tag):
                new.attrib[DIM] = ""
        words = tag in _WORDS or any(local_tag(ancestor) in _WORDS for ancestor in element.iterancestors())
        if words:
            new.text = _plain(element.text)
        for child in element:
            inner = local_tag(child)
            if inner == "style":
                _sheet(child, new)
            elif (inner in ELEMENTS or inner == "a") and not _is_hidden(child):
                self.copied(child, new, decided or inner in _UNDRAWN)
            if words and child.tail:
                if len(new):
                    new[-1].tail = (new[-1].tail or "") + (_plain(child.tail) or "")
                else:
                    new.text = (new.text or "") + (_plain(child.tail) or "")
        return new


_WORDS = ("text", "tspan", "textPath")
_UNDRAWN = (
    "defs",
    "symbol",
    "clipPath",
    "mask",
    "marker",
    "pattern",
    "linearGradient",
    "radialGradient",
    "filter",
)


def _is_drawn(tag: str) -> bool:
    return tag not in _UNDRAWN


def _is_hidden(element: Element) -> bool:
    """Whether an element is a handle, or a layer with only handles."""
    return is_ours(element) or (is_group(element, LAYER_LABEL) and all(is_ours(child) for child in element))


def _attributes(element: Element, tag: str) -> Iterator[tuple[str, str]]:
    for name, value in element.attrib.items():
        if name in ("href", XLINK_HREF):
            text = value.strip()
            if _LOCAL.match(text) or (tag == "image" and _RASTER.match(text)):
                yield name, text
        elif name == "style":
            style = _style(value)
            if style:
                yield name, style
        elif name == _XML_SPACE:
            yield name, "preserve" if value == "preserve" else "default"
        elif name in ATTRIBUTES and _is_safe(value):
            yield name, value


def _is_safe(value: str) -> bool:
    """Whether a value loads nothing: it has only listed functions, and no address except `#id`."""
    if _CONTROL.search(value):
        return False
    rest = _LOCAL_URL.sub("", css.uncommented(value))
    return all(not name or name.lower() in _FUNCTIONS for name in _CALL.findall(rest))


def _style(text: str) -> str:
    """Declarations of listed properties with harmless values."""
    if _CONTROL.search(text):
        text = ";".join(part for part in text.split(";") if not _CONTROL.search(part))
    return _harmless(css.declarations(text))


def _harmless(declared: dict[str, tuple[str, bool]]) -> str:
    """The text of those declarations that are listed and load nothing."""
    kept = []
    for name, (value, important) in declared.items():
        if name in PROPERTIES and _is_safe(value):
            kept.append(f"{name}:{value}{' !important' if important else ''}")
    return ";".join(kept)


def _sheet(element: Element, parent: Element) -> None:
    """Add the rules of a style element that may be shown."""
    if element.attrib.get("type", "text/css") != "text/css":
        return
    rules = []
    for selectors, body in css.rules("".join(element.itertext())):
        declared = _harmless(body)
        if declared and _SELECTORS.match(selectors) and not _OUTSIDE.search(selectors):
            rules.append(f"{selectors.strip()} {{{declared}}}")
    new = etree.SubElement(parent, f"{{{SVG_NS}}}style")
    new.text = "\n".join(rules)


def _plain(text: str | None) -> str | None:
    return _CONTROL.sub("", text) if text else None


def _bound_copies(root: Element) -> None:
    """Remove clones beyond a total of MOST_COPIES drawn elements."""
    by_id = {element.attrib["id"]: element for element in root.iter() if "id" in element.attrib}
    sizes: dict[Element, int] = {}

    def size(element: Element, within: frozenset) -> int:
        """The number of elements drawn for an element; a clone of its own ancestor draws nothing."""
        if element in sizes:
            return sizes[element]
        if element in within:
            return 1
        inner = within | {element}
        count = 1 + sum(size(child, inner) for child in element)
        if local_tag(element) == "use":
            target = by_id.get((element.attrib.get("href") or element.attrib.get(XLINK_HREF) or "")[1:])
            count += 0 if target is None else size(target, inner)
        sizes[element] = count
        return count

    total = 0
    for element in list(root.iter(f"{{{SVG_NS}}}use")):
        total += size(element, frozenset())
        if total > MOST_COPIES:
            for name in ("href", XLINK_HREF):
                element.attrib.pop(name, None)
