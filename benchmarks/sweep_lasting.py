# SPDX-License-Identifier: GPL-2.0-or-later
"""Is the output of a run stable?  A second run changes nothing, and *Restore original* restores the input.

Both start from the output, as Inkscape would start them, and the documents are compared without the handles,
which change their colours.
"""

from __future__ import annotations

from pathlib import Path
from typing import Callable

import sweep_check
import sweep_process
from lxml import etree

import alup_reshape
import alup_restore_original
from alup.document.tree.own_objects import is_ours

# The names of both checks in faults.
AGAIN, RESTORED = "a second run", "the restored drawing"


def faults(folder: Path, words: list[str], limit: float, megabytes: int) -> list[str]:
    """Faults of the run whose folder has in.svg and out.svg.  words : options that select ids"""
    before, after = folder / "in.svg", folder / "out.svg"
    found = []
    for effect, wanted, name in (
        (lambda: alup_reshape.AlupReshape().run([*words, str(after)]), after, AGAIN),
        (lambda: alup_restore_original.AlupRestoreOriginal().run([*words, str(after)]), before, RESTORED),
    ):
        fault = _fault(effect, after, wanted, folder, limit, megabytes)
        if fault:
            found.append(f"lasting: {name} {fault}")
    return found


def _fault(
    effect: Callable[[], None], after: Path, wanted: Path, folder: Path, limit: float, megabytes: int
) -> str:
    """The fault of a run that should turn `after` into `wanted`, or ""."""
    ended = sweep_process.run(effect, folder, limit, megabytes)
    if ended.hung or ended.signal or ended.code or ended.stderr:
        return f"did not end well: {ended.stderr.decode('utf-8', 'replace').strip()[-300:]}"
    # Without a change the effect writes nothing.
    if without_handles(ended.stdout or after.read_bytes()) != without_handles(wanted.read_bytes()):
        return "is another document"
    return ""


def without_handles(data: bytes) -> bytes:
    """A document without its handles."""
    root = sweep_check.parse(data)
    for element in list(root.iter(etree.Element)):
        if is_ours(element):
            element.getparent().remove(element)
    etree.cleanup_namespaces(root)
    return bytes(etree.tostring(root))
