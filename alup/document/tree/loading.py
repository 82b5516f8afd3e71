# SPDX-License-Identifier: GPL-2.0-or-later
"""Bytes -> XML tree, for files by anybody: nothing is fetched, multiplied, repaired or left out.

inkex reads as much as it can of a damaged file, so that the rest would be missing in what is written; it
takes the contents of entities from other files, and lets them multiply.  Here

* a file that is not well-formed is refused, unless what is wrong with it costs nothing,
* references to entities stay references, and those to other files and addresses are never followed,
* libxml2's guard against entities that multiply in attributes stays on where there are entities; older
  versions then take no text of more than 10 MB,
* what no drawing has and what would take minutes or more memory than there is, is refused.
"""

from __future__ import annotations

import re
from typing import Any

from inkex.elements._parser import NodeBasedLookup
from lxml import etree

from ...messages.errors import DocumentError
from ...messages.language import translate as _
from .elements import local_tag, name_of

# Real drawings nest a few dozen deep; old versions of libxml2 use up the stack at some 100,000.
DEEPEST = 1000
# lxml reads an element's attributes in quadratic time: a tenth of a second for twice as many.
MOST_ATTRIBUTES = 2000

# Whether libxml2 guards against entities that multiply even where it is to take texts of more than 10 MB.
GUARDED_ANYWAY = etree.LIBXML_VERSION >= (2, 13)

# Encodings in which `<!ENTITY` is written with these bytes.  In others it might hide.
_PLAIN_ENCODING = re.compile(rb"(utf-?8|us-ascii|ascii|iso-8859-\d+|windows-125\d)$", re.IGNORECASE)
_DECLARATION = re.compile(rb"""(?:\xef\xbb\xbf)?\s*<\?xml\s[^>]*?encoding\s*=\s*["']([^"'>]*)["']""")


class _Lookup(NodeBasedLookup):
    """Inkex's own, which fails at elements that have no namespace, or a prefix without one, and no class."""

    def lookup(self, doc: Any, element: Any) -> Any:
        try:
            return super().lookup(doc, element)
        except KeyError:
            return self.default


def parse(data: bytes) -> Any:
    """The document as inkex has it.  Raises DocumentError for what is no drawing, or a hostile one."""
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
        # Where its memory runs out libxml2 has an error without a place, and lxml no word for it.
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
    """Whether there are any, or it can't be told from the bytes."""
    declared = _DECLARATION.match(data)
    hidden = b"\0" in data[:4] or data[:2] in (b"\xff\xfe", b"\xfe\xff")
    if declared and not _PLAIN_ENCODING.match(declared.group(1)):
        hidden = True
    return hidden or b"<!ENTITY" in data


def _is_harmless(log: Any) -> bool:
    """Whether nothing gets lost: prefixes without a namespace stay, a character that XML forbids is not seen.

    Inkscape writes such characters when a text has them.
    """
    return len(log) > 0 and all(
        entry.domain == etree.ErrorDomains.NAMESPACE or entry.type == etree.ErrorTypes.ERR_INVALID_CHAR
        for entry in log
    )


def _too_deep() -> str:
    return _("Objects are nested more than {number} deep. Ungroup them.").format(number=DEEPEST)


def _unreadable(error: Any) -> str:
    if "Excessive depth" in (error.msg or ""):  # newer versions of libxml2 have a limit of their own
        return _too_deep()
    line, column = error.position
    message = _(
        "The drawing can't be read: {reason} (line {line}, column {column}). "
        "Open it in Inkscape, see what is missing, and save it anew."
    )
    reason = re.sub(r", line \d+, column \d+.*", "", error.msg or "").strip(". \n")
    return message.format(reason=reason, line=line, column=column)
