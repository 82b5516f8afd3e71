"""reshape(): the stages in order.

drawing -> network -> grabbed points -> samples -> anchors -> scaffold
-> core round -> final round -> refit
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from . import (
    bezier,
    crossings,
    handles,
    methods,
    metrics,
    network,
    order,
    refit,
    sample,
    scaffold,
    solve,
    ties,
)
from .components import components
from .errors import DocumentError, SolveError
from .language import N_
from .language import translate as _
from .model import Array, Drawing
from .problem import Weights, core_problem, final_problem

# The method that this package is about, beside those in `methods.METHODS`.
ALUP = "alup"

# How firmly parts are held together: factors of the weights of their ties.
APART = "apart"
HOLD_TOGETHER = {APART: 0.0, "loosely": 0.1, "normally": 1.0, "firmly": 10.0}


@dataclass(frozen=True)
class Options:
    """What a run can be told.

    spacing : between samples, of the longest side of the bounding box
    snap : curves nearer than this part of the diagonal touch
    crossings : curves that cross keep crossing at the same points of theirs
    fit_tolerance : of the longest side
    add_nodes : where segments can't be fitted this closely; else they are fitted as well as they can be
    hold : how firmly parts that no curve joins are held together, a name in `HOLD_TOGETHER`;
        "apart" lets parts without a handle stay
    method : "alup", or a name in `methods.METHODS`, which share all but the solving
    solver : a name in `solve.SOLVERS`
    rounds : 2, or 1 for the core round alone, to see what the final one adds
    time_limit : seconds for solving; the best state until then is taken, and `report["notes"]` says so
    max_vertices : the spacing is raised, and it is said, where there would be more samples
    """

    spacing: float = sample.SPACING
    snap: float = network.SNAP_DISTANCE
    crossings: bool = True
    fit_tolerance: float = refit.FIT_TOLERANCE
    add_nodes: bool = True
    hold: str = "normally"
    method: str = ALUP
    solver: str = "newton"
    limits: solve.Limits = field(default_factory=solve.Limits)
    rounds: int = 2
    time_limit: float = 20.0
    max_vertices: int = 100_000
    weights: Weights = field(default_factory=Weights)


@dataclass(frozen=True)
class Note:
    """A sentence, which can be translated, with named fields, and their values."""

    text: str
    values: dict[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        return self.text.format(**self.values)

    def translated(self) -> str:
        return _(self.text).format(**self.values)


@dataclass(frozen=True)
class Result:
    """refitted : the new segments; report : figures of the run, ready for JSON.

    samples : of the network as it was; moved : (N, 2) where they are now, user units
    notes : what falls short of what was asked for; in the report they are in English
    """

    refitted: refit.Refitted
    report: dict[str, Any]
    samples: sample.Samples
    moved: Array
    notes: tuple[Note, ...] = ()


# Samples of a curve whatever the spacing: its ends, and half an edge more than its length asks for.
_FIXED = 1.5


@dataclass
class _Clock:
    """Seconds of each stage."""

    stages: dict[str, float] = field(default_factory=dict)
    last: float = field(default_factory=time.perf_counter)

    def stamp(self, stage: str) -> None:
        now = time.perf_counter()
        self.stages[stage] = self.stages.get(stage, 0.0) + now - self.last
        self.last = now


def reshape(drawing: Drawing, options: Options = Options()) -> Result:
    """Reshape a drawing by its handles.

    Raises DocumentError, HandleError or SolveError with a sentence for the user.
    """
    clock = _Clock()
    longest = float(drawing.size.max())
    if not longest > 0.0:
        raise DocumentError(_("The selected paths have no extent: there is nothing to reshape."))
    # Shared borders become one curve of the network, so there may be half as many; beyond that even looking
    # for contacts is in vain.
    if len(drawing.control) > 2 * options.max_vertices:
        raise _too_many(len(drawing.control), options)
    drawing, before = order.canonical(drawing)
    net, notes = _network(drawing, options)
    clock.stamp("network")
    grabbed = handles.grab(net, drawing)
    spacing, coarse = _affordable(net, options, longest)
    notes += coarse
    samples = sample.sample(net, spacing, grabbed.curve, grabbed.fraction)
    anchors = handles.anchors(drawing, grabbed, samples)
    clock.stamp("sample")
    about = ties.around(samples)
    clock.stamp("ties")
    crossed = np.zeros((0, 2), dtype=int)
    # Apart, nothing but the network holds curves together where they cross.
    if options.method == ALUP and options.hold != APART:
        samples, crossed = crossings.opened(samples, net, drawing.following, anchors.samples)
    parts, label = components(samples.edges, len(samples.points))
    if options.method == ALUP:
        strength = HOLD_TOGETHER[options.hold]
        held, targets = anchors.samples, anchors.targets
        w_comp = options.weights.component
        tied = ties.tie(samples, label, about, crossed, held, targets, drawing.page, w_comp, strength)
        moved, rounds, figures = _solve(samples, label, tied, anchors, options, clock)
    else:
        moved, rounds, figures = _deform(samples, label, anchors, options, clock)
    if not np.isfinite(moved).all():
        raise SolveError(_("The result is not finite. Move the handles less far."))
    tolerance = options.fit_tolerance * longest
    refitted = refit.refit(
        drawing, net, samples, moved, anchors.samples, tolerance, add_nodes=options.add_nodes
    )
    if not options.add_nodes and refitted.error > tolerance:
        share = 100.0 * refitted.error / longest
        text = N_("No nodes were added: curves are up to {share:.2g} % of the longest side off.")
        notes.append(Note(text, {"share": share}))
    clock.stamp("refit")
    notes += _unfinished(rounds, figures, options)
    report = {
        "method": options.method,
        "vertices": len(samples.points),
        "edges": len(samples.edges),
        "components": parts,
        "contacts": net.contacts,
        "straight_turns": len(samples.straight_turns),
        "handles": len(anchors.samples),
        "ignored_handles": list(grabbed.ignored),
        **metrics.report(samples, moved, anchors, about.facing, drawing.diagonal),
        "segments": len(drawing.control),
        "segments_after": len(refitted.control),
        "fit_error_of_longest_side": refitted.error / longest,
        "rounds": rounds,
        "notes": [str(note) for note in notes],
        "seconds": clock.stages,
        **figures,
    }
    return Result(refitted.of(before), report, samples, moved, tuple(notes))


def _solve(
    samples: sample.Samples,
    label: Array,
    tied: ties.Tied,
    anchors: handles.Anchors,
    options: Options,
    clock: _Clock,
) -> tuple[Array, list[dict[str, Any]], dict[str, Any]]:
    """Move the samples.  Returns their positions (N, 2), the rounds' reports and other figures."""
    weights, solver = options.weights, solve.SOLVERS[options.solver]
    limits = replace(options.limits, deadline=time.monotonic() + options.time_limit)
    goes = ~tied.stays | _held(label, anchors) if options.hold != APART else _held(label, anchors)
    part = goes[label]
    number = np.cumsum(part) - 1
    graph = samples.part(part)
    kept = part[tied.ties.samples].all(axis=1)
    of_part = tied.ties.of(kept)
    of_part = replace(of_part, samples=number[of_part.samples])
    clock.stamp("ties")
    size = tied.size[part[samples.edges[:, 0]]]
    core = core_problem(graph, number[anchors.samples], anchors.targets, of_part, weights, size, tied.growth)
    done = [solver(core, limits, None)]
    result = core.to_user(done[0].positions)
    if options.rounds > 1:
        final = final_problem(core, result, graph, of_part, tied.growth)
        done.append(solver(final, limits, done[0]))
        result = final.to_user(done[1].positions)
    moved = samples.points.copy()
    if any(one.status is not solve.Status.UNMOVED for one in done):
        moved[part] = result
    rounds = [_round_report(name, one) for name, one in zip(("core", "final"), done)]
    figures = {
        "ties": {"facing": tied.facing, "scaffold": len(tied.ties) - tied.facing, "growth": tied.growth},
        "stays": int((~goes).sum()),
        "in_time": not any(one["status"] == solve.Status.TIME.name for one in rounds),
    }
    clock.stamp("solve")
    return moved, rounds, figures


def _deform(
    samples: sample.Samples,
    label: Array,
    anchors: handles.Anchors,
    options: Options,
    clock: _Clock,
) -> tuple[Array, list[dict[str, Any]], dict[str, Any]]:
    """As `_solve`, by another method."""
    moved = samples.points.copy()
    # Without a moved handle the input is the answer, exactly.
    if np.array_equal(anchors.targets, samples.points[anchors.samples]):
        return moved, [], {}
    held = _held(label, anchors)
    part = (held | (options.hold != APART))[label]
    graph, number = samples.part(part), np.cumsum(part) - 1
    joined = scaffold.between(graph.points, label[part], scaffold.sides(graph.points))
    clock.stamp("ties")
    task = methods.Task(graph, number[anchors.samples], anchors.targets, joined)
    deformed = methods.METHODS[options.method](task)
    moved[part] = deformed.moved
    clock.stamp("solve")
    return moved, [], {"deformation": deformed.figures, "ties": {"scaffold": len(joined)}}


def _held(label: Array, anchors: handles.Anchors) -> Array:
    """Which components, (C,) bool, carry a handle."""
    held = np.zeros(label.max() + 1, dtype=bool)
    held[label[anchors.samples]] = True
    return held


def _network(drawing: Drawing, options: Options) -> tuple[network.Network, list[Note]]:
    """The drawing's network, and a note where its crossings had to be left out: they can be any number."""
    net = network.build(drawing, options.snap * drawing.diagonal, options.crossings)
    if not options.crossings or _FIXED * len(net.curves) < options.max_vertices:
        return net, []
    text = N_(
        "The curves cross so often that their {pieces} pieces are too many for {samples} samples: where they "
        "cross they are not held together."
    )
    note = Note(text, {"pieces": len(net.curves), "samples": options.max_vertices})
    return network.build(drawing, options.snap * drawing.diagonal, False), [note]


def _affordable(net: network.Network, options: Options, longest: float) -> tuple[float, list[Note]]:
    """The spacing of samples, user units, and a note where it had to be raised for the limit of vertices."""
    spacing = options.spacing * longest
    length = float(bezier.arc_lengths(net.curves).sum())
    fixed = _FIXED * len(net.curves)
    if fixed + length / spacing <= options.max_vertices:
        return spacing, []
    if fixed >= options.max_vertices:
        raise _too_many(len(net.curves), options)
    spacing = length / (options.max_vertices - fixed)
    text = N_(
        "The samples are {share:.3g} % of the longest side apart instead of {wanted:.3g} %, so that there "
        "are no more than {samples}."
    )
    share, wanted = 100.0 * spacing / longest, 100.0 * options.spacing
    return spacing, [Note(text, {"share": share, "wanted": wanted, "samples": options.max_vertices})]


def _too_many(pieces: int, options: Options) -> DocumentError:
    return DocumentError(
        _(
            "The selected paths have {pieces} pieces, too many for {samples} samples. "
            "Select fewer paths, or allow more samples."
        ).format(pieces=pieces, samples=options.max_vertices)
    )


def _unfinished(rounds: list[dict[str, Any]], figures: dict[str, Any], options: Options) -> list[Note]:
    """Notes on rounds that ended before their minimum, and on attempts that there was no time for."""
    notes = []
    if not figures.get("in_time", True):
        text = N_(
            "The time limit of {seconds:g} s was reached; this is the best shape found until then. Allow "
            "more time, or a larger sample spacing."
        )
        notes.append(Note(text, {"seconds": options.time_limit}))
    if any(one["status"] == solve.Status.SINGULAR.name for one in rounds):
        text = N_("The equations of a step could not be solved; this is the best shape found until then.")
        notes.append(Note(text))
    return notes


def _round_report(name: str, result: solve.Round) -> dict[str, Any]:
    terms = result.history[0].keys()
    return {
        "round": name,
        "status": result.status.name,
        "why": result.status.value,
        "iterations": result.iterations,
        "coarse_iterations": result.coarse,
        "energy": {term: [entry[term] for entry in result.history] for term in terms},
    }
