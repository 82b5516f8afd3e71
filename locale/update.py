#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Collect the messages, bring the translations up to date, compile them: python3 locale/update.py

    locale/alup-reshape.pot                     all messages, from the sources
    locale/<language>.po                        their translation, edited by people
    locale/<language>/LC_MESSAGES/alup-reshape.mo    the same as programs read it

Translations are kept.  Messages that are no longer in the sources are kept at the end, as obsolete.  The
files have no dates and no line numbers, so two runs write the same bytes.  Needs polib.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Iterator
from xml.etree import ElementTree

import polib

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "locale"
DOMAIN = "alup-reshape"

_NS = "{http://www.inkscape.org/namespace/inkscape/extension}"
_SPACE = "{http://www.w3.org/XML/1998/namespace}space"
_WIDTH = 100

# Texts that Inkscape adds to a dialog.  It looks them up in the catalogue of the effect, not in its own.
_LIVE_PREVIEW = ("Live preview", "Is the effect previewed live on canvas?")

_HEADER = {
    "Project-Id-Version": DOMAIN,
    "Language": "",
    "MIME-Version": "1.0",
    "Content-Type": "text/plain; charset=UTF-8",
    "Content-Transfer-Encoding": "8bit",
}


def of_python(source: str) -> Iterator[str]:
    """Texts within _("...") and N_("..."), from top to bottom."""
    calls = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Call)]
    for call in sorted(calls, key=lambda node: (node.lineno, node.col_offset)):
        if isinstance(call.func, ast.Name) and call.func.id in ("_", "N_"):
            (text,) = call.args
            if isinstance(text, ast.Constant) and isinstance(text.value, str):
                yield text.value


def of_inx(source: str) -> Iterator[str]:
    """The texts that Inkscape translates, in the form in which it looks them up."""
    for element in ElementTree.fromstring(source).iter():
        if element.get("translatable") == "no":
            continue
        tag = str(element.tag).replace(_NS, "")
        texts = [element.get("gui-text"), element.get("gui-description")]
        if tag == "submenu":
            texts.append(element.get("name"))
        elif tag in ("name", "menu-tip", "option"):
            texts.append(element.text)
        elif tag == "label":
            text = element.text or ""
            texts.append(text if element.get(_SPACE) == "preserve" else " ".join(text.split()))
        elif tag == "effect" and element.get("needs-live-preview") != "false":
            texts += _LIVE_PREVIEW
        yield from (text for text in texts if text)


def template() -> polib.POFile:
    """All messages, each once, with the files that they are in."""
    found: dict[str, list[tuple[str, str]]] = {}
    inx = sorted(ROOT.glob("alup_*.inx"))
    python = [*sorted(ROOT.glob("alup_*.py")), *sorted((ROOT / "alup").rglob("*.py"))]
    for files, extract in ((inx, of_inx), (python, of_python)):
        for file in files:
            for message in extract(file.read_text(encoding="utf-8")):
                places = found.setdefault(message, [])
                if (file.relative_to(ROOT).as_posix(), "") not in places:
                    places.append((file.relative_to(ROOT).as_posix(), ""))
    pot = polib.POFile(wrapwidth=_WIDTH)
    pot.header = "Messages of ALUP Reshape; locale/update.py writes this file."
    pot.metadata = dict(_HEADER)
    for message, places in found.items():
        is_template = places[0][0].endswith(".py") and bool(re.search("[{}]", message))
        flags = ["python-brace-format"] if is_template else []
        pot.append(polib.POEntry(msgid=message, occurrences=places, flags=flags))
    return pot


def updated(old: polib.POFile, pot: polib.POFile, language: str) -> polib.POFile:
    """A translation with the template's messages, in its order."""
    new = polib.POFile(wrapwidth=_WIDTH)
    new.header = old.header
    new.metadata = {**_HEADER, **old.metadata, "Language": language}
    known = {entry.msgid: entry for entry in old}
    for entry in pot:
        before = known.pop(entry.msgid, polib.POEntry())
        new.append(
            polib.POEntry(
                msgid=entry.msgid,
                msgstr=before.msgstr,
                tcomment=before.tcomment,
                occurrences=entry.occurrences,
                flags=entry.flags + (["fuzzy"] if "fuzzy" in before.flags else []),
            )
        )
    new.extend(
        polib.POEntry(msgid=entry.msgid, msgstr=entry.msgstr, tcomment=entry.tcomment, obsolete=True)
        for entry in known.values()
        if entry.msgstr
    )
    return new


def outputs() -> dict[Path, bytes]:
    """The content of each file of this folder."""
    pot = template()
    result = {FOLDER / f"{DOMAIN}.pot": _text(pot)}
    for path in sorted(FOLDER.glob("*.po")):
        po = updated(polib.pofile(str(path), encoding="utf-8"), pot, path.stem)
        result[path] = _text(po)
        result[FOLDER / path.stem / "LC_MESSAGES" / f"{DOMAIN}.mo"] = po.to_binary()
    return result


def _text(file: polib.POFile) -> bytes:
    return f"{file}\n".encode()


if __name__ == "__main__":
    for path, content in outputs().items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
