# SPDX-License-Identifier: GPL-2.0-or-later
"""Bytes -> XML tree for untrusted files: nothing is fetched, expanded, repaired or left out.

inkex reads as much of a damaged file as it can, so the rest would be missing in the result.  It also loads
entities from other files, and expands them without limit.  This module works differently:

* a file that is not well-formed is refused, unless the error loses nothing,
* references to entities are kept as references, and those to other files and addresses are never followed,
* libxml2's limit for the expansion of entities in attributes stays on if there are entities; older versions
  then accept no text of more than 10 MB,
* structures that no drawing has and that would exhaust time or memory are refused.
"""

from __future__ import annotations

import re
from typing import Any

from inkex.elements._parser import NodeBasedLookup
from lxml import etree

from ...messages.errors import DocumentError
from ...messages.language import translate as _
from .elements import local_tag, name_of

# Greatest depth of nesting.  Real drawings have a few dozen levels.  Old versions of libxml2 overflow the
# stack at about 100,000.
DEEPEST = 1000
# Greatest number of attributes.  lxml reads an element's attributes in quadratic time; twice as many take 0.1
# s.
MOST_ATTRIBUTES = 2000

# Whether libxml2 limits the expansion of entities even if it accepts texts of more than 10 MB.
GUARDED_ANYWAY = etree.LIBXML_VERSION >= (2, 13)

# Encodings in which `<!ENTITY` has its ASCII bytes.  In others it can't be found by its bytes.
_PLAIN_ENCODING = re.compile(rb"(utf-?8|us-ascii|ascii|iso-8859-\d+|windows-125\d)$", re.IGNORECASE)
_DECLARATION = re.compile(rb"""(?:\xef\xbb\xbf)?\s*<\?xml\s[^>]*?encoding\s*=\s*["']([^"'>]*)["']""")


class _Lookup(NodeBasedLookup):
    """inkex's class lookup, extended to elements without a namespace or with an undeclared prefix."""

    def lookup(self, doc: Any, element: Any) -> Any:
        try:
            return super().lookup(doc, element)
        except KeyError:
            return self.default


def parse(data: bytes) -> Any:
    """The document with inkex's classes.

    Raises DocumentError for files that are no drawing, or are hostile.
    """
    document = _tree(data)
    root = document.getroot()
    if local_tag(root) != "svg":
        message = _("The file is not an SVG drawing: its outermost element is {tag}. Save it as SVG first.")
        raise DocumentError(message.format(tag=root.tag))
    if root.xpath("boolean(" + "/".join(["*"] * DEEPEST) + ")"):
        raise DocumentError(_too_deep())
    loaded = root.xpath(f"//*[count(@*) > {MOST_ATTRIBUTES}]")
    if loaded:
        message = _("{name} has more than {number} attributes. Delete those it does not need.")
        raise DocumentError(message.format(name=name_of(loaded[0]), number=MOST_ATTRIBUTES))
    return document


def _tree(data: bytes) -> Any:
    parser = _parser(data, recover=False)
    try:
        return etree.fromstring(data, parser=parser).getroottree()
    except etree.XMLSyntaxError as error:
        # If memory is exhausted libxml2 reports an error without a position, and lxml has no message for it.
        if error.position == (0, 0):
            raise MemoryError from error
        if not _is_harmless(parser.error_log):
            raise DocumentError(_unreadable(error)) from error
    return etree.fromstring(data, parser=_parser(data, recover=True)).getroottree()


def _parser(data: bytes, recover: bool) -> Any:
    parser = etree.XMLParser(
        huge_tree=GUARDED_ANYWAY or not _may_declare_entities(data),
        strip_cdata=False,
        recover=recover,
        resolve_entities=False,
        load_dtd=False,
        no_network=True,
    )
    parser.set_element_class_lookup(_Lookup())
    return parser


def _may_declare_entities(data: bytes) -> bool:
    """Whether the file declares entities, or may do so in an encoding that hides it."""
    declared = _DECLARATION.match(data)
    hidden = b"\0" in data[:4] or data[:2] in (b"\xff\xfe", b"\xfe\xff")
    if declared and not _PLAIN_ENCODING.match(declared.group(1)):
        hidden = True
    return hidden or b"<!ENTITY" in data


def _is_harmless(log: Any) -> bool:
    """Whether the parser's errors lose nothing: undeclared prefixes, and characters that XML forbids.

    Prefixes are kept.  Such characters are invisible, and Inkscape writes them if a text has them.
    """
    return len(log) > 0 and all(
        entry.domain == etree.ErrorDomains.NAMESPACE or entry.type == etree.ErrorTypes.ERR_INVALID_CHAR
        for entry in log
    )


def _too_deep() -> str:
    return _("Objects are nested more than {number} deep. Ungroup them.").format(number=DEEPEST)


def _unreadable(error: Any) -> str:
    if "Excessive depth" in (error.msg or ""):  # the limit of newer versions of libxml2
        return _too_deep()
    line, column = error.position
    message = _(
        "The drawing can't be read: {reason} (line {line}, column {column}). "
        "Open it in Inkscape, see what is missing, and save it anew."
    )
    reason = re.sub(r", line \d+, column \d+.*", "", error.msg or "").strip(". \n")
    return message.format(reason=reason, line=line, column=column)
