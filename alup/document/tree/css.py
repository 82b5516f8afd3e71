# SPDX-License-Identifier: GPL-2.0-or-later
"""The syntax of CSS: declarations of a style attribute and rules of a sheet, as tinycss2 reads them.

A declaration ends at a semicolon that is in no string, function or block.  So
`url(data:image/png;base64,...)` is one value, and `content: "}"` ends no rule.
"""

from __future__ import annotations

import re
from functools import lru_cache
from itertools import accumulate
from typing import Any, Iterator

import tinycss2

# A style attribute without any of these characters has no string, function, block, escape or comment.  Then
# every semicolon ends a declaration.  This holds for most, and splitting takes a hundredth of the time of
# tokenising.
_SPECIAL = re.compile(r"[\"'()\[\]{}\\/<]")

# What follows a value; only "important" has a meaning (CSS 2.1, 6.4.2).
_MARK = re.compile(r"!\s*(\w*)\s*$")


@lru_cache(maxsize=4096)
def parts(style: str) -> tuple[str, ...]:
    """The declarations of a style attribute, unchanged; joined by semicolons they are the attribute."""
    if not _SPECIAL.search(style):
        return tuple(style.split(";"))
    text = _newlines(style)
    ends = [at for token, at in _tokens(text) if token.type == "literal" and token.value == ";"]
    starts = [0, *(end + 1 for end in ends)]
    return tuple(text[begin:end] for begin, end in zip(starts, [*ends, len(text)]))


@lru_cache(maxsize=4096)
def declarations(style: str) -> dict[str, tuple[str, bool]]:
    """Property -> value and whether it is important; the last declaration of a property counts."""
    found = {}
    for part in parts(style):
        name, _, value = uncommented(part).partition(":")
        mark = _MARK.search(value)
        important = mark is not None and mark.group(1).lower() == "important"
        value = _MARK.sub("", value).strip()
        if name.strip() and value:
            found[name.strip().lower()] = (value, important)
    return found


def rules(sheet: str) -> Iterator[tuple[str, dict[str, tuple[str, bool]]]]:
    """Selectors and declarations of a sheet's rules, without at-rules and their contents."""
    for rule in tinycss2.parse_stylesheet(sheet, skip_comments=True, skip_whitespace=True):
        if rule.type != "qualified-rule":
            continue
        try:
            selectors, body = tinycss2.serialize(rule.prelude), tinycss2.serialize(rule.content)
        except RecursionError:  # thousands of nested blocks, which no real declaration has
            continue
        yield selectors.strip(), declarations(body)


def with_property(style: str | None, name: str, value: str) -> str:
    """The text of a style attribute with a property set; the rest is unchanged."""
    style = style or ""
    if any(_is_of(part, name) for part in parts(style)):
        return ";".join(_set(part, value) if _is_of(part, name) else part for part in parts(style))
    separator = "" if not style.strip() or style.rstrip().endswith(";") else ";"
    return f"{style}{separator}{name}:{value}"


def without_property(style: str | None, name: str) -> str | None:
    """The text of a style attribute without a property; None if nothing is left."""
    left = ";".join(part for part in parts(style or "") if not _is_of(part, name)).lstrip(";")
    return left or None


def _set(part: str, value: str) -> str:
    """A declaration with another value; the text before the value is unchanged."""
    before, colon, old = part.partition(":")
    return before + colon + old[: len(old) - len(old.lstrip())] + value


def _is_of(part: str, name: str) -> bool:
    """Whether a declaration declares this property."""
    before, colon, _ = part.partition(":")
    return bool(colon) and before.strip() == name


def uncommented(text: str) -> str:
    """The text without comments; an unclosed comment extends to the end."""
    if "/*" not in text:
        return text
    tokens = _tokens(_newlines(text))
    ends = [*(at for _, at in tokens[1:]), len(text)]
    return "".join(text[at:end] for (token, at), end in zip(tokens, ends) if token.type != "comment")


def _tokens(text: str) -> list[tuple[Any, int]]:
    """The component values of a text, each with its position."""
    lines = [0, *accumulate(len(line) + 1 for line in text.split("\n"))]
    return [
        (token, lines[token.source_line - 1] + token.source_column - 1)
        for token in tinycss2.parse_component_value_list(text)
    ]


def _newlines(text: str) -> str:
    """The text with line ends as tinycss2 counts them (CSS Syntax 3, 3.3)."""
    return text.replace("\r\n", "\n").replace("\r", "\n").replace("\f", "\n")
