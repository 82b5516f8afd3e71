"""What a run will change in the tree: computed first, applied when nothing can fail any more."""

from __future__ import annotations

from dataclasses import dataclass, field

from .styles import Styles, with_property
from .tree import Element


@dataclass
class Changes:
    """Changes of elements other than the geometry of shapes, in the order in which they are asked for."""

    styles: Styles
    properties: list[tuple[Element, str, str]] = field(default_factory=list)
    attributes: list[tuple[Element, str, str]] = field(default_factory=list)
    additions: list[tuple[Element, Element]] = field(default_factory=list)
    replacements: list[tuple[Element, Element]] = field(default_factory=list)

    def set_property(self, element: Element, name: str, value: str, origin: Element) -> None:
        """Make a property what it shall be; origin : the element whose place in the style sheets it has."""
        plain = element.attrib.get(name)
        inline = _mentions(element.attrib.get("style") or "", name)
        if plain is not None and not inline and self.styles.own(origin, name) == plain:
            self.attributes.append((element, name, value))
            return
        strong = self.styles.wins_over_inline(origin, name) and "!" not in value
        self.properties.append((element, name, f"{value} !important" if strong else value))

    def apply(self) -> None:
        """Change the tree.  Shapes become paths after this."""
        for element, name, value in self.properties:
            element.attrib["style"] = with_property(element.attrib.get("style"), name, value)
        for element, name, value in self.attributes:
            element.attrib[name] = value
        for element, new in self.additions:
            new.tail = element.tail
            element.addnext(new)
        for element, new in self.replacements:
            new.tail = element.tail
            element.getparent().replace(element, new)


def _mentions(style: str, name: str) -> bool:
    return any(part.partition(":")[0].strip() == name for part in style.split(";"))
