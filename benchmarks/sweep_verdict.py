# SPDX-License-Identifier: GPL-2.0-or-later
"""The verdict on a run: its outcome, and its reason in the same words for all runs with that reason.

A refusal is one of ours only if its sentence was made from a message in locale/alup-reshape.pot, which has
them all.  The message with its {names} is then the reason.  The output of a successful run is compared with
its input (`sweep_check`), and other programs draw some of the outputs.
"""

from __future__ import annotations

import functools
import os
import re
import signal
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable

import numpy as np
import polib
import sweep_check
import sweep_handles
import sweep_process
from lxml import etree

ROOT = Path(__file__).resolve().parents[1]

GOOD = ("reshaped", "no geometry", "unreadable")
OUTCOMES = (
    *GOOD, "refused", "no-op", "unverified", "traceback", "foreign message", "stray output", "hang", "signal",
    "harness",
)  # fmt: skip

# Share of the outputs that librsvg draws.  It also draws those that reach this far beyond their bounds (in
# diagonals).
DRAWN_SHARE = 0.02
SUSPICIOUS_GROWTH = 1.0

# Seconds for a program that draws one file.
DRAWING_LIMIT = 60


_FIELD = re.compile(r"\{(\w+)(?:![rs])?(?::[^}]*)?\}")

# Fields that hold messages.  A message of nothing but such fields is ours if their texts are.
_INNER = ("what", "why")


@dataclass(frozen=True)
class Settings:
    """limit : seconds of the processor a run; megabytes : of its address space
    keep : folder for files of defects, or None; inkscape : the share of outputs that Inkscape draws too
    lasting : the share of outputs from which a second run and *Restore original* start
    """

    limit: float = 60.0
    megabytes: int = 6000
    keep: Path | None = None
    inkscape: float = 0.0
    lasting: float = 0.0


def judge(
    ended: sweep_process.Ended,
    case: sweep_handles.Prepared | None,
    before: Path,
    own: Path,
    rng: np.random.Generator,
    settings: Settings,
) -> dict[str, Any]:
    """How a run ended: its outcome, the reason, and details."""
    said = ended.stderr.decode("utf-8", "replace").strip()
    if ended.hung:
        return {"outcome": "hang", "reason": f"not done after {settings.limit:g} s of the processor"}
    if ended.signal:
        return {"outcome": "signal", "reason": signal.Signals(ended.signal).name, "detail": said[-2000:]}
    if "Traceback (most recent call last)" in said:
        return {"outcome": "traceback", "reason": _place(said), "detail": said[-4000:]}
    if ended.code:
        if ended.stdout:
            return {"outcome": "stray output", "reason": "a document in spite of an error", "detail": said}
        template = template_of(said)
        if template is None:
            return {"outcome": "foreign message", "reason": said[-300:] or f"exit code {ended.code} alone"}
        if case is None:
            return {"outcome": "unreadable", "reason": template, "detail": said}
        drawn = any(tag in case.content for tag in sweep_handles.SHAPES)
        return {"outcome": "refused" if drawn else "no geometry", "reason": template, "detail": said}
    if said:
        return {"outcome": "stray output", "reason": said[:300], "detail": said[-2000:]}
    if not ended.stdout:
        return {"outcome": "no-op", "reason": "no document was written"}
    if case is None:
        return {"outcome": "unverified", "reason": "elements: no SVG became one"}
    return _verify(ended.stdout, case, before, own, rng, settings)


def _verify(
    data: bytes,
    case: sweep_handles.Prepared,
    before: Path,
    own: Path,
    rng: np.random.Generator,
    settings: Settings,
) -> dict[str, Any]:
    try:
        after = sweep_check.parse(data)
    except etree.XMLSyntaxError as error:
        return {"outcome": "stray output", "reason": f"the document is no XML: {error}"[:300]}
    if not data.startswith(b"<") or data.rstrip() != data.rstrip(b"\n"):
        return {"outcome": "stray output", "reason": "something beside the document"}
    found = sweep_check.compare(sweep_check.parse(before.read_bytes()), after, case.affected, case.wishes)
    faults = found.faults
    if not found.changed and all(fault.startswith("handle") for fault in faults):
        return {"outcome": "no-op", "reason": "nothing moved"}
    (own / "out.svg").write_bytes(data)
    suspicious = bool(faults) or found.growth > SUSPICIOUS_GROWTH
    if suspicious or rng.random() < DRAWN_SHARE:
        faults += _drawing_faults(rsvg_command, before, own)
    if rng.random() < settings.inkscape:
        faults += _drawing_faults(inkscape_command, before, own)
    measured = {"missed": found.missed, "growth": round(found.growth, 3), "changed": found.changed}
    if faults:
        return {
            "outcome": "unverified",
            "reason": _without_names(faults[0]),
            "detail": faults[:20],
            **measured,
        }
    return {"outcome": "reshaped", "reason": "", **measured}


def rsvg_command(source: Path, picture: Path) -> list[str]:
    return ["rsvg-convert", "--unlimited", "--width=200", "--height=200", "--keep-aspect-ratio",
            f"--output={picture}", str(source)]  # fmt: skip


def inkscape_command(source: Path, picture: Path) -> list[str]:
    return [
        "inkscape",
        "--export-type=png",
        "--export-width=200",
        f"--export-filename={picture}",
        str(source),
    ]


def _drawing_faults(command: Callable[[Path, Path], list[str]], before: Path, own: Path) -> list[str]:
    """The faults found by a program that draws the input but not the output."""
    if _draws(command, own / "out.svg", own) or not _draws(command, before, own):
        return []
    return [f"drawing: {command(before, own)[0]} can't draw it"]


def _draws(command: Callable[[Path, Path], list[str]], source: Path, own: Path) -> bool:
    picture = own / "picture.png"
    picture.unlink(missing_ok=True)
    environment = {**os.environ, "INKSCAPE_PROFILE_DIR": str(own)}
    try:
        done = subprocess.run(
            command(source, picture), stdin=subprocess.DEVNULL, capture_output=True, env=environment,
            timeout=DRAWING_LIMIT, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0 and picture.exists() and picture.stat().st_size > 0


@functools.lru_cache(maxsize=None)
def _templates() -> tuple[tuple[str, re.Pattern[str]], ...]:
    """Every message of the project with a pattern for it, the longest texts first."""
    messages = [entry.msgid for entry in polib.pofile(str(ROOT / "locale" / "alup-reshape.pot"))]
    found = []
    for message in messages:
        pattern, at = "", 0
        for match in _FIELD.finditer(message):
            pattern += re.escape(message[at : match.start()]) + f"(?P<{match[1]}>.+?)" * (
                f"(?P<{match[1]}>" not in pattern
            )
            pattern += "" if pattern.endswith("+?)") else ".+?"
            at = match.end()
        found.append((message, re.compile(pattern + re.escape(message[at:]), re.DOTALL)))
    return tuple(sorted(found, key=lambda item: -len(_FIELD.sub("", item[0]))))


def template_of(sentence: str) -> str | None:
    """The message that a sentence was made from, with {names} in it; None if it is none of ours."""
    for message, pattern in _templates():
        match = pattern.fullmatch(sentence)
        if not match:
            continue
        parts = {name: template_of(match[name]) for name in _INNER if name in match.groupdict()}
        known = {name: inner for name, inner in parts.items() if inner is not None}
        if known or len(_FIELD.sub("", message)) > 3:
            for name, inner in known.items():
                message = message.replace(f"{{{name}}}", inner)
            return message
    return None


def _place(text: str) -> str:
    """The error of a traceback and the line of ours that it came from."""
    lines = text.strip().split("\n")
    ours = [line.strip() for line in lines if 'File "' in line and "alup" in line.rsplit("/", 2)[-2:][0]]
    ours = ours or [line.strip() for line in lines if 'File "' in line]
    where = re.sub(r'File ".*?([^/]+/[^/]+)", line (\d+), in (\w+)', r"\1:\2 \3", ours[-1]) if ours else ""
    return f"{lines[-1][:200]} ({where})"


def _without_names(fault: str) -> str:
    """The kind of a fault, so that faults of one kind are counted together."""
    kind, _, rest = fault.partition(":")
    words = {"attributes", "styles", "outside"}
    name = rest.strip().split(" ")[0] if kind in words and " of " in rest else ""
    return f"{kind}: {name} ..." if name else kind if kind != "drawing" else fault
