# SPDX-License-Identifier: GPL-2.0-or-later
"""Pictures of trials side by side at one scale, with handles: input, then results.

Drawings are rendered by rsvg-convert, put together by matplotlib and saved with few colours.
"""

from __future__ import annotations

import io
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Sequence

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from lxml import etree
from matplotlib.figure import Figure
from PIL import Image
from trials import Trial

# Size of a panel in pixels, and pixels per inch.
SIZE, DPI = 210, 100

# Margin around the drawing for strokes and handles, relative to its longest side.
MARGIN = 0.05

# Least width of a panel relative to its height, so that the text below fits.
NARROWEST = 0.72

COLOURS = 128

STAYS, MOVES = "#c8102e", "#0057b8"

plt.rcParams.update({"font.family": "DejaVu Sans", "font.size": 7})


@dataclass(frozen=True)
class Panel:
    """svg : the drawing; title : above it; caption : below it; handles : of a case, drawn with arrows."""

    svg: bytes
    title: str
    caption: str = ""
    handles: Sequence[dict[str, Any]] = ()


def strip(panels: Sequence[Panel], trials: Sequence[Trial], file: Path) -> None:
    """One row of panels on the bounds that all trials need together."""
    rows([panels], [trials], file)


def rows(panels: Sequence[Sequence[Panel]], trials: Sequence[Sequence[Trial]], file: Path) -> None:
    """Rows of panels, each on the bounds of its own trials."""
    boxes = [_box(row) for row in trials]
    columns = max(len(row) for row in panels)
    heights = [SIZE * min(1.0, (high - low)[1] / (high - low)[0]) for low, high in boxes]
    widths = max(SIZE * min(1.0, (high - low)[0] / (high - low)[1]) for low, high in boxes)
    # A row has a title above and a caption below.
    text = 26
    figure = plt.figure(
        figsize=(columns * (widths + 6) / DPI, sum(height + text for height in heights) / DPI), dpi=DPI
    )
    total = sum(height + text for height in heights)
    top = 0.0
    for row, (low, high), height in zip(panels, boxes, heights):
        for n, panel in enumerate(row):
            axes = figure.add_axes(
                (
                    n / columns,
                    1.0 - (top + 13 + height) / total,
                    widths / (widths + 6) / columns,
                    height / total,
                )
            )
            _draw(axes, panel, low, high)
        top += height + text
    save(figure, file)


def save(figure: Figure, file: Path) -> None:
    """As a PNG of few colours; the figure is closed."""
    raw = io.BytesIO()
    figure.savefig(raw, format="png", facecolor="white")
    plt.close(figure)
    image = Image.open(raw).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    file.parent.mkdir(parents=True, exist_ok=True)
    image.save(file, optimize=True)


def _box(trials: Sequence[Trial]) -> tuple[np.ndarray, np.ndarray]:
    low = np.min([trial.low for trial in trials if not trial.error], axis=0)
    high = np.max([trial.high for trial in trials if not trial.error], axis=0)
    margin = MARGIN * (high - low).max()
    low, high = low - margin, high + margin
    # Room for the caption.
    width, least = high[0] - low[0], NARROWEST * (high[1] - low[1])
    beside = np.array([max(0.0, 0.5 * (least - width)), 0.0])
    return low - beside, high + beside


def _draw(axes: Any, panel: Panel, low: np.ndarray, high: np.ndarray) -> None:
    axes.imshow(_rendered(panel.svg, low, high), extent=(low[0], high[0], high[1], low[1]))
    axes.set_axis_off()
    axes.set_title(panel.title, pad=2, fontsize=8)
    axes.text(0.5, -0.01, panel.caption, transform=axes.transAxes, ha="center", va="top", fontsize=7)
    for handle in panel.handles:
        source, target = np.array(handle["source"]), np.array(handle["target"])
        if np.hypot(*(target - source)) < 1e-6 * np.hypot(*(high - low)):
            axes.plot(*source, "o", ms=3.5, mfc=STAYS, mec="white", mew=0.5)
            continue
        arrow = {
            "arrowstyle": "-|>",
            "color": MOVES,
            "lw": 0.9,
            "shrinkA": 0,
            "shrinkB": 0,
            "mutation_scale": 6,
        }
        axes.annotate("", target, source, arrowprops=arrow, annotation_clip=False)
        axes.plot(*source, "o", ms=3.5, mfc=MOVES, mec="white", mew=0.5)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(high[1], low[1])


def _rendered(svg: bytes, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Pixels of a part of a drawing, in root user units, without its handles."""
    root = etree.fromstring(svg)
    for group in root.xpath("//*[@id='alup-handles']"):
        group.getparent().remove(group)
    width, height = high - low
    scale = 2.0 * SIZE / max(width, height)
    root.set("viewBox", f"{low[0]} {low[1]} {width} {height}")
    root.set("width", str(max(1, round(scale * width))))
    root.set("height", str(max(1, round(scale * height))))
    root.set("preserveAspectRatio", "none")
    done = subprocess.run(
        ["rsvg-convert", "--background-color=white"],
        input=etree.tostring(root),
        capture_output=True,
        check=True,
    )
    return np.asarray(Image.open(io.BytesIO(done.stdout)).convert("RGB"))
