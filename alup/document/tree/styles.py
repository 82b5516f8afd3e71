# SPDX-License-Identifier: GPL-2.0-or-later
"""Values of properties: attribute, style sheets, style attribute, inheritance (CSS 2.1, 6.4).

Inkscape, like a browser, applies the rules of the document's <style> elements.  A rule for `rect` no longer
matches a rectangle that has become a path.  Therefore the rules are read here.  They take part in every
look-up, and `lost_by_renaming` tells which values have to be written into style attributes.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any, Iterator

import cssselect

from ...svg import basic_shapes
from . import css
from .elements import SVG_NS, Element, local_tag, tag_of

# Origins of a declaration, from weak to strong: (important, inline, specificity, order).
_Priority = tuple

# Initial values of properties that are not inherited.  Without a declaration all others come from the parent.
_NOT_INHERITED = {
    "clip-path": "none",
    "display": "inline",
    "filter": "none",
    "mask": "none",
    "opacity": "1",
    "overflow": "visible",
    "vector-effect": "none",
    "mix-blend-mode": "normal",
}


@dataclass(frozen=True)
class _Declared:
    value: str
    important: bool
    priority: _Priority


class _Translator(cssselect.GenericTranslator):
    """Selectors -> XPath that matches elements of any namespace."""

    def xpath_element(self, selector: Any) -> Any:
        xpath = self.xpathexpr_cls()
        if selector.element:
            xpath.add_condition(f"local-name() = {self.xpath_literal(selector.element)}")
        return xpath


class Styles:
    """The properties of a document's elements."""

    def __init__(self, svg: Element):
        self.svg = svg
        sheets = [
            "".join(element.itertext())
            for element in svg.iter()
            if local_tag(element) == "style" and element.attrib.get("type", "text/css") == "text/css"
        ]
        self._rules = [rule for sheet in sheets for rule in _rules(sheet)]
        self._sheet = _matched(svg, self._rules)

    def own(self, element: Element, name: str) -> str | None:
        """The value declared for the element itself, or None."""
        inline = _inline(element, name)
        sheet = self._sheet.get(element, {}).get(name)
        if inline is not None and (inline.important or sheet is None or not sheet.important):
            return inline.value
        return sheet.value if sheet is not None else element.attrib.get(name)

    def inherited(self, element: Element | None, name: str) -> str | None:
        """The value declared for the element or its nearest ancestor with a declaration, or None."""
        while element is not None:
            value = self.own(element, name) if isinstance(element.tag, str) else None
            if value is not None and value != "inherit":
                return value
            element = element.getparent()
        return None

    def wins_over_inline(self, element: Element, name: str) -> bool:
        """Whether a rule that is declared `!important` overrides the style attribute."""
        sheet = self._sheet.get(element, {}).get(name)
        return sheet is not None and sheet.important

    def by_attribute(self, element: Element, name: str) -> bool:
        """Whether the element's own value is a presentation attribute that no rule overrides."""
        return (
            element.attrib.get(name) is not None
            and _inline(element, name) is None
            and name not in self._sheet.get(element, {})
        )

    def by_css(self, element: Element, name: str) -> bool:
        """Whether CSS declares a property for the element itself."""
        return _inline(element, name) is not None or name in self._sheet.get(element, {})

    def lost_by_renaming(self, elements: list[Element]) -> dict[Element, dict[str, str]]:
        """The properties to be added to styles when elements become a `path`, by element.

        elements : those that lose their tag and their geometry attributes
        The rules are matched in a copy of the document in which the elements are renamed.  A selector may
        then match their neighbours differently, too.
        """
        if not self._rules or not elements:
            return {}
        twin = copy.deepcopy(self.svg)
        twins = dict(zip(self.svg.iter(), twin.iter()))
        for element in elements:
            tag = tag_of(twins[element])
            twins[element].tag = f"{{{SVG_NS}}}path" if tag.startswith("{") else "path"
            for name in basic_shapes.GEOMETRY.get(local_tag(element), ()):
                twins[element].attrib.pop(name, None)
            twins[element].attrib["d"] = ""
        matched = _matched(twin, self._rules)
        lost = {}
        for element in self._sheet.keys() | {e for e, one in twins.items() if one in matched}:
            before, after = self._sheet.get(element, {}), matched.get(twins[element], {})
            additions = {}
            for name in sorted(before.keys() | after.keys()):
                was = before[name].value if name in before else None
                now = after[name].value if name in after else None
                inline = _inline(element, name)
                if was == now or (inline is not None and not _beaten(before.get(name), after.get(name))):
                    continue
                value = self.own(element, name)
                if value is None:
                    value = _NOT_INHERITED.get(name, "inherit")
                strong = any(name in found and found[name].important for found in (before, after))
                additions[name] = f"{value} !important" if strong else value
            if additions:
                lost[element] = additions
        return lost


def _inline(element: Element, name: str) -> _Declared | None:
    declared = css.declarations(element.attrib.get("style") or "").get(name)
    return _Declared(declared[0], declared[1], ()) if declared else None


def _beaten(before: _Declared | None, after: _Declared | None) -> bool:
    """Whether a rule, before or after renaming, overrides the style attribute."""
    return (before is not None and before.important) or (after is not None and after.important)


def _rules(sheet: str) -> Iterator[tuple[str, tuple[int, int, int], dict[str, tuple[str, bool]]]]:
    """XPath, specificity and declarations of each selector; at-rules, as for media, are left out."""
    translator = _Translator()
    for selectors_text, declared in css.rules(sheet):
        try:
            selectors = cssselect.parse(selectors_text)
            paths = [translator.selector_to_xpath(selector) for selector in selectors]
        # A rule that can't be parsed has to be ignored (CSS 2.1, 4.2); so is one that is nested too deeply.
        except (cssselect.SelectorError, cssselect.ExpressionError, RecursionError):
            continue
        for selector, path in zip(selectors, paths):
            yield path, selector.specificity(), declared


def _matched(svg: Element, rules: list[Any]) -> dict[Element, dict[str, _Declared]]:
    """The strongest declarations of the rules for each element."""
    result: dict[Element, dict[str, _Declared]] = {}
    for order, (path, specificity, declared) in enumerate(rules):
        for element in svg.xpath(path):
            mine = result.setdefault(element, {})
            for name, (value, important) in declared.items():
                priority = (important, specificity, order)
                if name not in mine or mine[name].priority <= priority:
                    mine[name] = _Declared(value, important, priority)
    return result
