#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Move and scale whole drawings by handles, and compare the pictures with the renderer's own transform.

    python benchmarks/moved_pictures.py --results pictures.jsonl --sample 200 FOLDER...
    python benchmarks/moved_pictures.py --results pictures.jsonl --summary

When all handles ask for the same translation or scaling, the result is known for every drawing: it is the
original under that transform.  An object that stays behind, or moves twice, is a difference between two
pictures.  Each file is reshaped three times, with handles on its own curves:

    identity   pins only             the picture of the original
    translate  one vector            its viewBox moved, or within <g transform="translate(...)">
    scale      about the middle      within <g transform="scale(...)">, its strokes as wide as before

A run ends as one of

    right      the pictures agree
    told       they differ, and the report names what was left out (`skipped`, `notes`, `ignored_handles`)
    wrong      they differ without a word
    refused    an error message, the drawing unchanged
    failed     a traceback, a hang, or words on a stream at success
    no curve   there is nothing that a handle could hold
    not comparable   the scale changes what a renderer's transform does not: filters, stroked texts, patterns

A FOLDER is searched for *.svg; it may also be the icons.json of an Iconify package.  Results are lines of
JSON, one for each run; a later call resumes from them.  `rsvg-convert` draws the pictures.  `npm pack`
fetches the three collections of the project's figures: flag-icons (flags), devicon (icons),
@iconify-json/fluent-emoji (icons.json).
"""

from __future__ import annotations

import argparse
import collections
import copy
import io
import json
import multiprocessing
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Iterator

import one_thread  # noqa: F401 - before numpy is imported

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "benchmarks")]

import numpy as np
import sweep_handles
import sweep_process
from lxml import etree
from PIL import Image
from sweep_handles import Wish
from tqdm import tqdm

import alup_reshape
from alup.document import painted_shapes
from alup.document.tree.own_objects import is_ours
from alup.geometry.bezier import evaluate
from alup.messages.errors import AlupError

Array = np.ndarray

EDITS = ("identity", "translate", "scale")
OUTCOMES = ("right", "told", "wrong", "refused", "failed", "no curve", "not comparable", "not drawn")
GOOD = ("right", "told")

MOVE = (0.07, 0.05)  # of width and height, rounded to whole pixels
SCALE = 1.3

# The longer side of a picture, pixels.
SIDE = 400

# Of 255.  Antialiasing alone differs by less from the range of the neighbours.
THRESHOLD = 12.0

# Pixels that may differ, as at a seam or a thin tip; chosen by looking at the cases.
FEW = 6

# Only parts with three handles are scaled.  So drawings with more contours, or with smaller ones (relative to
# the diagonal), are not compared.
MOST_CONTOURS, SMALLEST_CONTOUR = 12, 0.03

# Least distance between handles of a scaling, relative to the diagonal.
APART = 0.005

# Processor seconds and megabytes of a run.
LIMIT, MEGABYTES = 60.0, 4096

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_LENGTH = re.compile(rf"\s*({_NUMBER})\s*(px|pt|pc|mm|cm|in|)\s*$")
_PX = {"": 1.0, "px": 1.0, "pt": 4 / 3, "pc": 16.0, "mm": 96 / 25.4, "cm": 96 / 2.54, "in": 96.0}
_WIDTHS = r"stroke-(?:width|dasharray|dashoffset)"


@dataclass(frozen=True)
class Frame:
    """The root's window.  box : viewBox, user units; size : CSS pixels; zoom : pixels per CSS pixel"""

    box: tuple[float, float, float, float]
    size: tuple[float, float]

    @property
    def zoom(self) -> float:
        return SIDE / max(self.size)

    def whole_pixels(self) -> Array:
        """(2,) MOVE in user units, so that the pictures' grids coincide."""
        unit = np.array(self.size) * self.zoom / self.box[2:]
        return np.maximum(np.round(np.array(MOVE) * self.box[2:] * unit), 1.0) / unit


def frame_of(svg: Any) -> Frame:
    found = [float(word) for word in re.findall(_NUMBER, svg.attrib.get("viewBox") or "")]
    box = found if len(found) == 4 and min(found[2:]) > 0.0 else None
    sides = [_LENGTH.match(svg.attrib.get(name) or "") for name in ("width", "height")]
    size = [float(side[1]) * _PX[side[2]] if side else 0.0 for side in sides]
    if box and not all(size):  # a missing side follows from the other one and the viewBox
        known = [given / whole for given, whole in zip(size, box[2:]) if given]
        size = [(known[0] if known else 1.0) * whole for whole in box[2:]]
    size = [value or 100.0 for value in size]
    x, y, width, height = box or [0.0, 0.0, *size]
    return Frame((x, y, width, height), (size[0], size[1]))


# --- handles --------------------------------------------------------------------------------------


def contours(svg: Any) -> list[Array]:
    """Points (n, 2) on each contour that a run takes, root user units; none without an extent."""
    found = []
    for shape in painted_shapes.painted_shapes(svg, []):
        for subpath in shape.subpaths:
            control = subpath.control @ shape.matrix[:, :2].T + shape.matrix[:, 2]
            if len(control) and np.ptp(control.reshape(-1, 2), axis=0).any():
                found.append(evaluate(control[:, None], np.linspace(0.0, 1.0, 5)[None]).reshape(-1, 2))
    return found


def wishes(clouds: list[Array], edit: str, frame: Frame) -> list[Wish]:
    """The handles.  clouds : points of the contours"""
    if edit != "scale":
        move = frame.whole_pixels() if edit == "translate" else np.zeros(2)
        return [Wish(point, point + move) for point in spread(np.concatenate(clouds), 3)]
    chosen: list[Array] = []
    apart = APART * float(np.hypot(*frame.box[2:]))
    for point in np.concatenate([spread(cloud, 3) for cloud in clouds]):
        if all(np.hypot(*(point - other)) > apart for other in chosen):
            chosen.append(point)
    middle = _middle(frame)
    return [Wish(point, middle + SCALE * (point - middle)) for point in chosen]


def spread(points: Array, count: int) -> Array:
    """At most `count` of the points (n, 2), far from each other."""
    chosen = [points[int(points.sum(axis=1).argmin())]]
    while len(chosen) < count:
        away = np.min([np.linalg.norm(points - one, axis=1) for one in chosen], axis=0)
        if not away.max() > 0.0:
            break
        chosen.append(points[int(away.argmax())])
    return np.array(chosen)


def _middle(frame: Frame) -> Array:
    x, y, width, height = frame.box
    return np.array([x + width / 2.0, y + height / 2.0])


# --- what is expected -----------------------------------------------------------------------------


def expected(svg: Any, edit: str, frame: Frame) -> list[bytes]:
    """Drawings; the result must look like one of them."""
    if edit == "identity":
        return [etree.tostring(svg)]
    if edit == "translate":
        move = frame.whole_pixels()
        window = copy.deepcopy(svg)
        x, y, width, height = frame.box
        window.attrib["viewBox"] = f"{x - move[0]:.12g} {y - move[1]:.12g} {width:.12g} {height:.12g}"
        wrapped = _wrapped(svg, f"translate({move[0]:.12g},{move[1]:.12g})")
        return [etree.tostring(window), etree.tostring(wrapped)]
    shift = _middle(frame) * (1.0 - SCALE)
    wrapped = _wrapped(svg, f"translate({shift[0]:.12g},{shift[1]:.12g}) scale({SCALE})")
    return [_thinned(etree.tostring(wrapped, encoding="unicode")).encode()]


def _wrapped(svg: Any, transform: str) -> Any:
    """The drawing within a group.  Its strokes are as wide as without a scale where none says how wide."""
    root = copy.deepcopy(svg)
    prefix = root.tag[: root.tag.rindex("}") + 1] if "}" in root.tag else ""
    group = root.makeelement(f"{prefix}g", {"transform": transform})
    group.text = root.text
    group.extend(list(root))
    root.text = None
    root.append(group)
    if "scale" in transform:
        group.attrib["stroke-width"] = root.attrib.pop("stroke-width", "1")
    return root


def _thinned(text: str) -> str:
    """With the widths and dashes of strokes divided by the scale."""

    def divided(found: re.Match[str]) -> str:
        return found[1] + re.sub(_NUMBER, lambda number: f"{float(number[0]) / SCALE:.9g}", found[2])

    text = re.sub(rf"""(\b{_WIDTHS}\s*=\s*["'])([^"']*)""", divided, text)
    return re.sub(rf"""(\b{_WIDTHS}\s*:\s*)([^;"'}}]*)""", divided, text)


def comparable(svg: Any, edit: str, clouds: list[Array], frame: Frame) -> bool:
    """Whether a renderer's transform equals reshaping.  Reshaping does not scale blurs and strokes."""
    if edit != "scale":
        return True
    text = etree.tostring(svg, encoding="unicode")
    shown = re.sub(r'stroke="none"|stroke:\s*none', "", text)
    stroked = "stroke" in shown and any(word in shown for word in ("<text", "<pattern", "non-scaling"))
    marked = "<marker" in shown and "userSpaceOnUse" in shown
    smallest = SMALLEST_CONTOUR * float(np.hypot(*frame.box[2:]))
    held = len(clouds) <= MOST_CONTOURS and all(np.ptp(one, axis=0).max() > smallest for one in clouds)
    return held and not (stroked or marked or "filter" in shown)


# --- pictures -------------------------------------------------------------------------------------


def picture(drawing: bytes, frame: Frame, folder: Path) -> Array | None:
    """(height, width, 4) premultiplied, 0..255; None where the renderer gives up."""
    path = folder / "picture.svg"
    path.write_bytes(drawing)
    command = ["rsvg-convert", "-z", f"{frame.zoom:.12g}", str(path)]
    try:
        done = subprocess.run(command, capture_output=True, timeout=30, check=False)
    except subprocess.TimeoutExpired:
        return None
    if done.returncode or not done.stdout:
        return None
    image = np.asarray(Image.open(io.BytesIO(done.stdout)).convert("RGBA")).astype(float)
    image[..., :3] *= image[..., 3:] / 255.0
    return image


def differing(a: Array, b: Array) -> int:
    """Pixels of one picture that are outside the range of the nine around them in the other, by THRESHOLD."""
    if a.shape != b.shape:
        return a.shape[0] * a.shape[1]
    off = np.zeros(a.shape[:2])
    for one, other in ((a, b), (b, a)):
        nine = np.lib.stride_tricks.sliding_window_view(
            np.pad(other, ((1, 1), (1, 1), (0, 0)), mode="edge"), (3, 3), axis=(0, 1)
        )
        beyond = np.maximum(one - nine.max(axis=(3, 4)), nine.min(axis=(3, 4)) - one)
        off = np.maximum(off, beyond.max(axis=2))
    return int((off > THRESHOLD).sum())


# --- runs -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Job:
    """name : of the file in results, with its collection's; keep : folder for files of wrong runs, or None"""

    path: Path
    name: str
    edit: str
    keep: Path | None = None


def run(job: Job) -> dict[str, Any]:
    """One file, one edit -> what the results say of it."""
    with tempfile.TemporaryDirectory(prefix="alup-pictures-") as name:
        folder = Path(name)
        found = _run(job, folder)
        if job.keep is not None and found["outcome"] not in (*GOOD, "no curve", "not comparable"):
            job.keep.mkdir(parents=True, exist_ok=True)
            for kind in ("before", "after"):
                if (folder / f"{kind}.svg").exists():
                    slug = re.sub(r"[^\w.]+", "_", f"{job.edit}__{job.name}")
                    shutil.copy(folder / f"{kind}.svg", job.keep / f"{slug}.{kind}.svg")
    return {"file": job.name, "edit": job.edit, **found}


def _run(job: Job, folder: Path) -> dict[str, Any]:
    svg = sweep_handles.load(job.path)
    frame = frame_of(svg)
    for element in [element for element in svg.iter() if is_ours(element)]:
        element.getparent().remove(element)
    try:
        clouds = contours(svg)
    except AlupError as error:
        return {"outcome": "refused", "words": str(error)}
    if not clouds:
        return {"outcome": "no curve"}
    if not comparable(svg, job.edit, clouds, frame):
        return {"outcome": "not comparable"}
    asked = wishes(clouds, job.edit, frame)
    references = [picture(drawing, frame, folder) for drawing in expected(svg, job.edit, frame)]
    sweep_handles.draw(svg, asked, 0.002 * float(np.hypot(*frame.box[2:])))
    before, after, report = (folder / name for name in ("before.svg", "after.svg", "report.json"))
    before.write_bytes(etree.tostring(svg))
    arguments = ["--keep_handles=false", f"--output={after}", f"--report={report}", str(before)]
    ended = sweep_process.run(lambda: alup_reshape.AlupReshape().run(arguments), folder, LIMIT, MEGABYTES)
    words = ended.stderr.decode("utf-8", "replace")
    if ended.code != 0:
        silent = ended.hung or ended.signal or "Traceback" in words or not words.strip()
        return {"outcome": "failed" if silent else "refused", "words": words.strip()[-300:]}
    if words or ended.stdout:
        return {"outcome": "failed", "words": words.strip()[-300:]}
    said = json.loads(report.read_text(encoding="utf-8"))
    left = [str(entry["id"]) for entry in said["skipped"]] + said["notes"] + said["ignored_handles"]
    result = _without_handles(after.read_bytes())
    got = picture(result, frame, folder)
    counts = [differing(got, other) for other in references if other is not None and got is not None]
    if not counts:
        return {"outcome": "not drawn", "left": left}
    outcome = "right" if min(counts) <= FEW else "told" if left else "wrong"
    return {"outcome": outcome, "pixels": min(counts), "left": left, "cpu": round(ended.cpu, 2)}


def _without_handles(drawing: bytes) -> bytes:
    """A run takes the handles out; their group stays."""
    svg = etree.fromstring(drawing, etree.XMLParser(huge_tree=True))
    for group in svg.xpath("//*[starts-with(@id, 'sweep-handles')]"):
        group.getparent().remove(group)
    return etree.tostring(svg)


# --- folders of files, and what came of them ------------------------------------------------------


def files_of(folder: Path, unpacked: Path) -> list[tuple[Path, str]]:
    """Files and their names in results.  unpacked : where the icons of a JSON collection are written"""
    if folder.suffix != ".json":
        return [(path, f"{folder.name}/{path.relative_to(folder)}") for path in sorted(folder.rglob("*.svg"))]
    found = json.loads(folder.read_text(encoding="utf-8"))
    target = unpacked / found["prefix"]
    target.mkdir(parents=True, exist_ok=True)
    files = []
    for name, icon in sorted(found["icons"].items()):
        sides = [icon.get(side, found.get(side, 16)) for side in ("width", "height")]
        corner = [icon.get(side, found.get(side, 0)) for side in ("left", "top")]
        box = " ".join(map(str, [*corner, *sides]))
        head = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
        path = target / f"{name}.svg"
        path.write_text(f'<svg {head} viewBox="{box}">{icon["body"]}</svg>\n', encoding="utf-8")
        files.append((path, f"{found['prefix']}/{name}.svg"))
    return files


def sampled(files: list[tuple[Path, str]], count: int, seed: int) -> list[tuple[Path, str]]:
    if not count or count >= len(files):
        return files
    return sorted(random.Random(seed).sample(files, count))


def measure(jobs: list[Job], processes: int) -> Iterator[dict[str, Any]]:
    """The results as they come, with a progress bar."""
    with multiprocessing.get_context("fork").Pool(processes) as pool:
        yield from tqdm(pool.imap_unordered(run, jobs), total=len(jobs), unit="run")


def summary(results: list[dict[str, Any]]) -> list[str]:
    """A table in Markdown, with a line for each collection and edit, and the names of what is wrong."""
    lines = [f"| collection | edit | files | {' | '.join(OUTCOMES)} | right or told |", "|" + " --- |" * 12]
    keys = sorted({(one["file"].split("/")[0], EDITS.index(one["edit"])) for one in results})
    for collection, edit in keys:
        mine = [
            one for one in results if one["file"].split("/")[0] == collection and one["edit"] == EDITS[edit]
        ]
        count = collections.Counter(one["outcome"] for one in mine)
        judged = len(mine) - sum(count[name] for name in ("no curve", "not comparable", "not drawn"))
        good = sum(count[name] for name in GOOD)
        share = f"{100.0 * good / judged:.1f} %" if judged else ""
        figures = " | ".join(str(count[name] or "") for name in OUTCOMES)
        lines.append(f"| {collection} | {EDITS[edit]} | {len(mine)} | {figures} | {share} |")
    return lines


def main() -> int:
    """Returns 0 if every run was right, told its difference, or could not be compared."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folders", nargs="*", type=Path)
    parser.add_argument("--results", required=True, type=Path, help="file of JSON lines, which is continued")
    parser.add_argument("--edits", nargs="+", choices=EDITS, default=list(EDITS))
    parser.add_argument("--sample", type=int, default=0, metavar="N", help="N files of each folder")
    parser.add_argument("--seed", type=int, default=0, help="of the sample")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="runs at a time")
    parser.add_argument("--keep", type=Path, help="folder for the files of runs that are not right")
    parser.add_argument("--summary", action="store_true", help="only print what the results say")
    given = parser.parse_args()
    lines = given.results.read_text(encoding="utf-8").splitlines() if given.results.exists() else []
    results = [json.loads(line) for line in lines]
    if not given.summary:
        done = {(one["file"], one["edit"]) for one in results}
        with tempfile.TemporaryDirectory(prefix="alup-icons-") as unpacked:
            jobs = [
                Job(path, name, edit, given.keep)
                for folder in given.folders
                for path, name in sampled(files_of(folder, Path(unpacked)), given.sample, given.seed)
                for edit in given.edits
                if (name, edit) not in done
            ]
            with given.results.open("a", encoding="utf-8") as log:
                for result in measure(jobs, given.jobs):
                    results.append(result)
                    log.write(json.dumps(result) + "\n")
                    log.flush()
    print("\n".join(summary(results)))
    for one in sorted(results, key=lambda one: (one["edit"], one["file"])):
        if one["outcome"] in ("wrong", "failed", "refused"):
            print(f"{one['outcome']}: {one['edit']} {one['file']} {one.get('pixels', one.get('words', ''))}")
    return 0 if all(one["outcome"] not in ("wrong", "failed", "refused") for one in results) else 1


if __name__ == "__main__":
    sys.exit(main())
