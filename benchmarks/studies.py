# SPDX-License-Identifier: GPL-2.0-or-later
"""What the gallery shows besides the comparison: ablations, convergence, compression, sampling, step sizes.

Each study returns the Markdown of its section and writes its pictures.
"""

from __future__ import annotations

import copy
import re
from pathlib import Path
from typing import Any, Callable, Iterable

import builders
import clipart
import matplotlib.pyplot as plt
import numpy as np
import panels
import trials
from scipy.spatial import cKDTree
from trials import Trial

from alup.document import reading
from alup.energy.problem import Weights
from alup.geometry import bezier
from alup.geometry.connected_components import components
from alup.methods import killing
from alup.methods.task import Task
from alup.network import sampling as sample
from alup.network import shape_order
from alup.session.pipeline import Options
from alup.ties import scaffold

Run = Callable[[list[tuple[dict[str, Any], Options]]], list[Trial]]

# Drawings on which the studies are shown: outlines, many parts, stems, strokes, folded tips.
SHOWN = (
    "bottle-body-taller",
    "wineglass-stem-15pc",
    "truck-longer-box",
    "elephant-longer-legs",
    "bulb-wider",
    "windmill-top-blade",
)

# The paper's Figs. 10-12, and the parts of the method that it argues for.
ABLATIONS = {
    "ALUP": Options(),
    "normal 100 : 1": Options(weights=Weights(normal=100.0)),
    "normal 1 : 100": Options(weights=Weights(tangent=100.0)),
    "ω_n = 1": Options(weights=Weights(stretch=False)),
    "ω_t = 0.5": Options(weights=Weights(uniform_turns=0.5)),
    "no E_edge": Options(weights=Weights(edge=0.0)),
    "one round": Options(rounds=1),
    "no straightness": Options(weights=Weights(straight=0.0)),
}

# What is regular: cases, and a belt and a sign whose right ends are pulled (the paper's Fig. 9, drawn anew).
REGULAR = ("office-taller", "factory-taller-chimney", "train-longer-boiler", "tv-widescreen")
DRAWN_FOR_IT = [
    {
        "name": "longer-belt",
        "svg": "buckle.svg",
        "select": "all",
        "handles": [
            {"source": [0.0, 30.0], "target": [0.0, 30.0]},
            {"source": [0.0, 80.0], "target": [0.0, 80.0]},
            {"source": [60.0, 55.0], "target": [60.0, 55.0]},
            {"source": [160.0, 55.0], "target": [200.0, 55.0]},
            {"source": [320.0, 55.0], "target": [390.0, 55.0]},
        ],
    },
    {
        "name": "wider-sign",
        "svg": "sign.svg",
        "select": "all",
        "handles": [
            {"source": [86.0, 124.0], "target": [86.0, 124.0]},
            {"source": [98.0, 124.0], "target": [98.0, 124.0]},
            {"source": [10.0, 45.0], "target": [10.0, 45.0]},
            {"source": [174.0, 24.0], "target": [230.0, 24.0]},
            {"source": [174.0, 66.0], "target": [230.0, 66.0]},
        ],
    },
]

SPACINGS = (0.02, 0.01, 0.005, 0.0025)

# A bar of 200 x 40, held at its left end, by where two points of its right end go.
BARS = [
    {
        "name": name,
        "svg": "bar.svg",
        "select": "all",
        "handles": [
            {"source": source, "target": target}
            for source, target in zip(
                ([0.0, 20.0], [0.0, 60.0], [200.0, 20.0], [200.0, 60.0]), ([0.0, 20.0], [0.0, 60.0], *ends)
            )
        ],
    }
    for name, ends in {
        "bent by 90°": ([110.0, -90.0], [150.0, -90.0]),
        "lifted": ([200.0, -60.0], [200.0, -20.0]),
        "half as long again": ([300.0, 20.0], [300.0, 60.0]),
    }.items()
]

STEPS = (1, 2, 4, 8, 16, 32, 64)
FINEST_STEPS = 128


def figures(trial: Trial) -> dict[str, float]:
    """The figures that are compared, by name; less is better."""
    report = trial.report
    return {
        "bands lost": 1.0 - report["bands"]["kept"],
        "mean turning": report["turning_degrees"]["mean"],
        "largest turning": report["turning_degrees"]["max"],
        "scale gradient": report["scale_gradient"]["rms"],
        "bent lines": report["straightness_degrees"]["line"],
        "new crossings": float(report["new_crossings"]),
        "handle error": report["handle_error_of_diagonal"],
    }


def caption(trial: Trial) -> str:
    if trial.error:
        return trial.error[:40]
    found = figures(trial)
    lost = 100.0 * found["bands lost"]
    return f"bands lost {lost:.0f} %, turn {found['mean turning']:.2f}°"


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Markdown."""
    lines = ["| " + " | ".join(head) + " |"]
    lines.append("| --- |" + " ---: |" * (lines[0].count("|") - 2))
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def bar(run: Run, methods: dict[str, str], folder: Path) -> str:
    """The picture that papers on deformation have: a bar that is bent, lifted, stretched."""
    done = run([(entry, Options(method=method)) for entry in BARS for method in methods.values()])
    by_case = [done[n * len(methods) : (n + 1) * len(methods)] for n in range(len(BARS))]
    pictures = [
        [panels.Panel(row[0].before, entry["name"], "", entry["handles"])]
        + [panels.Panel(one.after, method, caption(one)) for method, one in zip(methods, row)]
        for entry, row in zip(BARS, by_case)
    ]
    panels.rows(pictures, by_case, folder / "bar.png")
    return "![A bar](bar.png)\n"


def ablations(cases: dict[str, dict[str, Any]], run: Run, folder: Path) -> str:
    """Figs. 10-12 and what else the energy is made of."""
    names = list(cases)
    jobs = [(cases[name], options) for name in names for options in ABLATIONS.values()]
    done = run(jobs)
    by_case = {name: done[n * len(ABLATIONS) : (n + 1) * len(ABLATIONS)] for n, name in enumerate(names)}
    text = ""
    for n, kind in enumerate(ABLATIONS):
        if n:
            file = re.sub(r"\W+", "-", f"ablation {kind}".replace("ω", "omega")) + ".png"
            text += f"![{kind}]({_most_changed(cases, by_case, n, kind, folder / file)})\n"
    rows = []
    for n, kind in enumerate(ABLATIONS):
        of_kind = [by_case[name][n] for name in names if not by_case[name][n].error]
        values = [figures(one) for one in of_kind]
        rows.append(
            [kind]
            + [f"{np.median([v[key] for v in values]):.3g}" for key in ("mean turning", "scale gradient")]
            + [
                f"{np.percentile([v[key] for v in values], 90):.3g}"
                for key in ("mean turning", "scale gradient")
            ]
            + [
                f"{sum(v['bent lines'] > 0.1 for v in values)}",
                f"{sum(v['new crossings'] > 0 for v in values)}",
            ]
        )
    head = ["variant", "turning, median", "gradient, median", "turning, 90 %", "gradient, 90 %"]
    head += ["cases with bent lines", "cases with crossings"]
    return table(head, rows) + "\nThe two cases that each changes most:\n\n" + text


def _most_changed(
    cases: dict[str, dict[str, Any]], by_case: dict[str, list[Trial]], number: int, kind: str, file: Path
) -> str:
    """A picture of the two cases that a variant changes most; its name."""

    def change(name: str) -> float:
        usual, other = by_case[name][0], by_case[name][number]
        if usual.error or other.error:
            return 0.0
        size = np.hypot(*np.subtract(usual.high, usual.low))
        return float(np.linalg.norm(usual.moved - other.moved, axis=1).max() / size)

    shown = sorted(by_case, key=change)[-2:][::-1]
    row, used = [], []
    for name in shown:
        usual, other = by_case[name][0], by_case[name][number]
        row.append(
            [
                panels.Panel(usual.before, name, "", cases[name]["handles"]),
                panels.Panel(usual.after, "ALUP", caption(usual)),
                panels.Panel(other.after, kind, caption(other)),
            ]
        )
        used.append([usual, other])
    panels.rows(row, used, file)
    return file.name


def compression(cases: dict[str, dict[str, Any]], run: Run, folder: Path) -> str:
    """The cases in which 15 % of a part is left, with 5 % left."""
    squeezed = []
    for name, entry in cases.items():
        left = re.search(r"-(15)pc$", name)
        if left:
            squeezed.append(_further(entry, (1.0 - 0.05) / (1.0 - int(left[1]) / 100.0)))
    done = run([(entry, Options()) for entry in squeezed])
    row = []
    for entry, one in zip(squeezed, done):
        row.append([panels.Panel(one.before, entry["name"], "", entry["handles"])])
        row[-1].append(panels.Panel(one.after, "5 % left", caption(one)))
    panels.rows(row, [[one] for one in done], folder / "compression.png")
    head = ["case", "turning", "gradient", "new crossings", "handle error"]
    keys = ("mean turning", "scale gradient", "new crossings", "handle error")
    text = [[one.name] + [f"{figures(one)[key]:.2g}" for key in keys] for one in done]
    return "![5 % left](compression.png)\n\n" + table(head, text)


def regular(cases: dict[str, dict[str, Any]], run: Run, folder: Path) -> str:
    """What is regular, without and with keeping it."""
    entries = [*(cases[name] for name in REGULAR if name in cases), *DRAWN_FOR_IT]
    kinds = (frozenset(), Options().regular)
    done = run([(entry, Options(regular=kept)) for entry in entries for kept in kinds])
    row, pairs = [], [done[n : n + 2] for n in range(0, len(done), 2)]
    for entry, pair in zip(entries, pairs):
        row.append([panels.Panel(pair[0].before, entry["name"], "", entry["handles"])])
        row[-1] += [
            panels.Panel(one.after, title, caption(one)) for one, title in zip(pair, ("without", "with"))
        ]
    panels.rows(row, pairs, folder / "regular.png")
    return "![Without and with keeping what is regular](regular.png)\n"


def _further(entry: dict[str, Any], factor: float) -> dict[str, Any]:
    """The case with every handle moved by a factor of its move."""
    entry = copy.deepcopy(entry)
    for handle in entry["handles"]:
        source, target = np.array(handle["source"]), np.array(handle["target"])
        handle["target"] = (source + factor * (target - source)).tolist()
    return entry


def sampling(cases: dict[str, dict[str, Any]], run: Run, folder: Path) -> str:
    """How far the written curves are from those of the finest spacing."""
    shown = [name for name in SHOWN if name in cases]
    done = run([(cases[name], Options(spacing=s)) for name in shown for s in SPACINGS])
    by_case = [done[n * len(SPACINGS) : (n + 1) * len(SPACINGS)] for n in range(len(shown))]
    pictures = [
        [panels.Panel(one.after, f"{100 * s:g} %", caption(one)) for s, one in zip(SPACINGS, row)]
        for row in by_case
    ]
    panels.rows(pictures, by_case, folder / "sampling.png")
    rows = []
    for name, row in zip(shown, by_case):
        points = [_curve_points(one, cases[name]) for one in row]
        finest = cKDTree(points[-1])
        size = float(np.hypot(*np.subtract(row[0].high, row[0].low)))
        away = [float(finest.query(one)[0].max()) / size for one in points[:-1]]
        seconds = [one.report["seconds"]["solve"] for one in row]
        rows.append(
            [name] + [f"{100 * a:.2g} %" for a in away] + [f"{s / seconds[-1]:.2g}" for s in seconds[:-1]]
        )
    head = ["case"] + [f"{100 * s:g} %" for s in SPACINGS[:-1]]
    head += [f"time at {100 * s:g} %" for s in SPACINGS[:-1]]
    note = (
        f"\nLargest distance of the curves from those at {100 * SPACINGS[-1]:g} %, of the diagonal; "
        "time of solving as a part of the finest's.\n\n"
    )
    return "![Spacings](sampling.png)\n" + note + table(head, rows)


def _curve_points(trial: Trial, entry: dict[str, Any]) -> np.ndarray:
    """Points along the selected curves of the result, (n, 2) root user units, dense against any distance."""
    import tempfile

    import measure

    built = clipart.build(entry, folder=trials.DRAWINGS)
    with tempfile.NamedTemporaryFile(suffix=".svg") as file:
        file.write(trial.after)
        file.flush()
        shapes = measure.load(Path(file.name), built.ids)
    control = np.concatenate(
        [s.control @ m[:, :2].T + m[:, 2] for subpaths, m in shapes for s in subpaths if len(s.control)]
    )
    return bezier.evaluate(control[:, None], np.linspace(0.0, 1.0, 200)[None]).reshape(-1, 2)


def convergence(cases: dict[str, dict[str, Any]], run: Run, folder: Path) -> str:
    """Fig. 14: every term after each iteration of the paper's scheme, and where Newton's method ends."""
    shown = [name for name in SHOWN[:3] if name in cases]
    done = run([(cases[name], Options(solver=solver)) for name in shown for solver in ("paper", "newton")])
    figure, axes = plt.subplots(len(shown), 2, figsize=(8.4, 2.5 * len(shown)), dpi=panels.DPI, squeeze=False)
    for row, name in enumerate(shown):
        paper, newton = done[2 * row], done[2 * row + 1]
        for column, stage in enumerate(("core", "final")):
            plot = axes[row][column]
            energy = next(one["energy"] for one in paper.report["rounds"] if one["round"] == stage)
            for term in ("normal", "tangent", "straight", "handle", "edge", "objective"):
                values = np.maximum(np.array(energy[term]), 1e-12)
                style = {"color": "black", "lw": 1.5} if term == "objective" else {"lw": 0.9}
                plot.semilogy(values, label="F" if term == "objective" else term, **style)
            if stage == "core":  # final rounds start from what their core rounds found, each from another
                least = next(one["energy"]["objective"][-1] for one in newton.report["rounds"])
                plot.axhline(max(least, 1e-12), color="black", ls=":", lw=1.0, label="F, Newton's method")
            plot.set_title(f"{name}, {stage} round")
            plot.set_xlabel("iteration")
    axes[0][0].legend(fontsize=6, loc="upper right")
    figure.tight_layout()
    panels.save(figure, folder / "convergence.png")
    return "![Terms of the energy by iteration](convergence.png)\n"


def step_sizes(cases: dict[str, dict[str, Any]], folder: Path) -> str:
    """What the vector fields' steps do: handles missed by the given number, none that bring them home."""
    rows, pictures = [], []
    for name in ("mug-taller", "elephant-trunk-out"):
        task, diagonal = _task(cases[name])
        best = killing.deform(task, FINEST_STEPS).moved
        for steps in STEPS:
            alone, home = killing.deform(task, steps, home=False), killing.deform(task, steps)
            away = float(np.abs(home.moved - best).max()) / diagonal
            found = alone.figures
            rows.append(
                [name, f"{steps}", f"{found['missed_of_diagonal']:.1e}", f"{found['turned_over']}"]
                + [f"{home.figures['steps']}", f"{away:.1e}"]
            )
            if steps in (1, 2, 4, 32):
                pictures.append((name, steps, task, alone.moved))
    figure, axes = plt.subplots(2, 4, figsize=(8.4, 4.2), dpi=panels.DPI)
    for plot, (name, steps, task, moved) in zip(axes.ravel(), pictures):
        lines = moved[task.graph.edges]
        plot.plot(*np.insert(lines, 2, np.nan, axis=1).reshape(-1, 2).T, color="black", lw=0.6)
        plot.plot(*task.targets.T, "o", ms=3, color=panels.STAYS)
        plot.set_aspect("equal")
        plot.invert_yaxis()
        plot.set_axis_off()
        plot.set_title(f"{name}, {steps} step{'s' * (steps > 1)}")
    figure.tight_layout()
    panels.save(figure, folder / "steps.png")
    head = ["case", "steps", "handles missed by", "triangles turned over", "steps with those home"]
    head += [f"from {FINEST_STEPS} steps"]
    return "![Step sizes](steps.png)\n\n" + table(head, rows)


def _task(entry: dict[str, Any]) -> tuple[Task, float]:
    """What a method is given for a case, and the diagonal."""
    _, root, chosen = trials.load(entry)
    drawing, _ = shape_order.canonical(reading.read(root, chosen, False, True).drawing)
    made = builders.stages(drawing, sample.SPACING * float(drawing.size.max()), tied=False)
    points = made.samples.points
    _, label = components(made.samples.edges, len(points))
    joined = scaffold.between(points, label, scaffold.sides(points))
    return Task(made.samples, made.held, made.targets, joined), drawing.diagonal
