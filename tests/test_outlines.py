# SPDX-License-Identifier: GPL-2.0-or-later
"""Path data of frames draws the refit, in each element's own coordinates."""

from __future__ import annotations

from typing import Any

import inkex
import numpy as np
import pytest
from lxml import etree

from alup.document import frame_outlines, reading
from alup.document.frame_outlines import ROUNDING_OF_DIAGONAL
from alup.session.session import FRAME, Session
from alup.svg import path_data

NS = "http://www.w3.org/2000/svg"
INK = "http://www.inkscape.org/namespaces/inkscape"
SVG = f"""<svg xmlns="{NS}" xmlns:inkscape="{INK}" viewBox="0 0 300 200" width="300" height="200">
  <g transform="translate(20 10) rotate(5)"><path id="blob" transform="scale(2 -2)"
    d="M5,-40 C5,-20 15,-10 30,-10 S55,-22 57,-35 L70,-30 75,-37 60,-50 C55,-62 40,-65 30,-65 S5,-57 5,-40 Z
       M25,-30 A10 6 0 0 1 45,-30 A10 6 0 0 1 25,-30 Z"/></g>
  <path id="open" d="M230,20 H280 V60 C260,80 240,70 230,50"/>
  <path id="point" d="M240,100 L260,100 M250,90 Z"/>
  <circle inkscape:label="alup:pin" cx="230" cy="20" r="2"/>
  <circle inkscape:label="alup:from a" cx="280" cy="60" r="2"/>
  <circle inkscape:label="alup:to a" cx="290" cy="65" r="2"/>
  <circle inkscape:label="alup:pin" cx="240" cy="100" r="2"/>
</svg>"""


def opened() -> tuple[Any, Session]:
    svg = inkex.load_svg(SVG.encode()).getroot()
    read = reading.read(svg, [], True, True)
    return read, Session(read.drawing)


def test_the_frame_before_the_first_is_the_drawing() -> None:
    read, session = opened()
    rest = {one.name: None for one in session.drawing.handles if one.target is not None}
    assert not frame_outlines.Outlines(read).changed(session.solve(rest, FRAME).refitted)


def test_path_data_draws_the_refit() -> None:
    """One frame adds nodes, and a later one has the old number again."""
    read, session = opened()
    outlines = frame_outlines.Outlines(read)
    seen: dict[str, str] = {}
    (name,) = (one.name for one in session.drawing.handles if one.target is not None)
    diagonal = session.drawing.diagonal
    for target, tolerance in (((283.0, 61.0), FRAME), ((250.0, 110.0), 0.0), ((281.0, 60.0), 0.0)):
        refitted = session.solve({name: np.array(target)}, tolerance).refitted
        seen.update({element.attrib["id"]: d for element, d in outlines.changed(refitted).items()})
        start = np.searchsorted(refitted.source, np.arange(len(read.drawing.control) + 1))
        for shape in read.shapes:
            if shape.name not in seen:
                continue
            first, last = shape.segments
            wanted = refitted.control[start[first] : start[last]]
            drawn = [
                part.control @ shape.matrix[:, :2].T + shape.matrix[:, 2]
                for part in path_data.parse(seen[shape.name])
                if len(part.control)
            ]
            # Points without a curve draw none.
            long = np.ptp(wanted, axis=1).max(axis=1) > 0.0
            assert np.concatenate(drawn) == pytest.approx(wanted[long], abs=ROUNDING_OF_DIAGONAL * diagonal)
    assert "open" in seen


def test_only_what_changed_is_written() -> None:
    read, session = opened()
    outlines = frame_outlines.Outlines(read)
    (name,) = (one.name for one in session.drawing.handles if one.target is not None)
    goal = {name: np.array([284.0, 62.0])}
    frame = session.solve(goal, FRAME)
    assert {element.get("id") for element in outlines.changed(frame.refitted)} >= {"open"}
    assert not outlines.changed(frame.refitted)
    back = session.solve({name: np.array([280.0, 60.0])}).refitted
    assert "open" in {element.get("id") for element in outlines.changed(back)}


def test_the_document_is_left_alone() -> None:
    read, session = opened()
    before = etree.tostring(read.svg)
    frame_outlines.Outlines(read).changed(session.solve().refitted)
    assert etree.tostring(read.svg) == before
