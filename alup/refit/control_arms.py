# SPDX-License-Identifier: GPL-2.0-or-later
"""Limits of control arms in a fit (see `cubic_fit.py`): their directions and lengths.

A *control arm* leads from an end of a span to the control point beside it.  Least squares choose any arm that
brings the curve near the samples.  Where samples are few or stretched unevenly, or the arm is short, they
hardly determine it, and it may point against the direction of its curve.  So every arm is held near the
original tangent T, carried along by the move.  With samples x_k, moved samples X_k, and k the first sample
that is distinct from the end,

    u = T (X_k - X_0) / (x_k - x_0)     (complex numbers, normalised)

is the carried tangent.  Under affine maps its error is the angle by which the curve turns until x_k.  The arm
of a corner may differ from u by STRAY.  An arm that differs more is turned to that limit, and its length is
fitted along it.  The two arms of a smooth node take a common direction.  An arm that is held to a direction
may not point backwards, nor be longer than its curve allows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry import bezier
from ..model import Array

# Nodes whose two tangents differ by less than this are smooth, and stay so.
SMOOTH_ANGLE = np.radians(3.0)

# A control arm shorter than this part of its segment counts as retracted.
RETRACTED = 1e-6

# Length of a retracted arm that has to show a direction, of its segment's chord.
RETRACTED_OUT = 0.01

# Reject a control arm that is longer than the polyline of its span's samples, and longer than LONG times its
# original length scaled by the growth of that polyline.  (A cubic is at least half as long as its arms.  But
# a sample of large weight beside the arm's direction can ask for an arm of any length.)
LONG = 2.0

# Reject an arm held to a direction that is shorter than this part of its original length, scaled as above.
SHORT = 0.1

# How far the arm of a corner may differ from the carried tangent.  With 30 degrees more nodes are added, not
# fewer: an arm that was turned far to fit one span is kept by both parts when the span is divided.
STRAY = np.radians(5.0)

# The direction of the samples at an end leads to the first sample that is this part of the moved polyline's
# length away, because nearly coincident samples have no direction.  For a span that has nearly vanished it
# leads across half of it.
REACH, REACH_VANISHED = 0.01, 0.5

# A fit that meets more samples than it has unknowns, to this part of the tolerance, is the samples' own
# curve.
PROVEN = 1e-3

# So few samples prove nothing, because some fit meets them wherever they are; and the first one may be far
# along the curve.  Then an arm may differ by twice the angle by which the curve turns until there (the error
# of the carried tangent of a mirrored curve), up to MOST_STRAY.
FEW, MOST_STRAY = 2, np.radians(80.0)

# An arm is reversed if the cosine between it and the direction of its own curve is below REVERSED: the curve
# then has a knob at its end.  A reversed arm of the original may stay, so the cosine has to be lower than the
# original's by REVERSED_MORE.
REVERSED, REVERSED_MORE = -0.49, 1e-3

# The direction of a curve at its end leads to the first of _WAY_POINTS, parameters, that is at least
# _WAY_OF_ARM lengths of the arm and _WAY_OF_CURVE lengths of the curve away.  Arms shorter than _UNSEEN of
# the curve can't be seen, and are left alone.
_WAY_POINTS, _WAY_OF_ARM, _WAY_OF_CURVE, _UNSEEN = np.linspace(0.0, 1.0, 33), 3.0, 0.1, 1e-4

# Where the polyline of the samples turns by more than this beyond the original's turn, there is a cusp, and a
# node that is added there is a corner.  (A common direction would miss both sides by more than half of this
# angle.)
CUSP = np.radians(60.0)

FREE, ALONG, FIXED = range(3)

# The control point of each arm and its node.
_ARMS = ((1, 0), (2, 3))


@dataclass(frozen=True)
class Ends:
    """What both ends' control points of m spans may do.

    mode : (m, 2) int, FREE, ALONG a direction from the node, or FIXED
    along : (m, 2, 2) unit directions; of a FIXED control point, its offset from the node
    """

    mode: Array
    along: Array

    def put(self, which: Array, mode: int, along: Array) -> Ends:
        """With another mode for some, (m, 2) bool."""
        return Ends(np.where(which, mode, self.mode), np.where(which[..., None], along, self.along))


class Guard:
    """Keeps control arms of m spans to sane directions and lengths."""

    def __init__(
        self, original: Array, line: Array, owner: Array, t: Array, target: Array,
        d0: Array,
        d3: Array,
        tolerance: float,
    ):  # fmt: skip
        """The original curves (m, 4, 2), of which some (m,) bool are lines, and their samples.

        owner, t, target : (r,), (r,), (r, 2) span, parameter and moved position of each inner sample
        d0, d3 : (m, 2) displacements of the ends; tolerance : user units
        """
        self._original, self._line, self._owner, self._target = original, line, owner, target
        self._lengths = np.linalg.norm(_arms(original), axis=2)
        self._size = bezier.polygon_lengths(original)
        m = len(line)
        span = np.concatenate([np.arange(m), owner, np.arange(m)])
        order = np.argsort(span, kind="stable")  # as they are given: start, samples, end
        span = span[order]
        inner = bezier.evaluate(original[owner], t)
        before = np.concatenate([original[:, 0], inner, original[:, 3]])[order]
        after = np.concatenate([original[:, 0] + d0, target, original[:, 3] + d3])[order]
        self.way = _ways(span, after, m)
        way_before = _ways(span, before, m)
        self.growth = self.way / np.where(way_before > 0.0, way_before, 1.0)
        self._chord = np.linalg.norm(original[:, 3] + d3 - original[:, 0] - d0, axis=1)
        self._samples = np.bincount(owner, minlength=m)
        self.vanished = (self.way < tolerance) & (self._samples > 0)
        self._carried, self._allowed = self._carry(span, before, after, way_before)
        self.cusp = _cusps(before, after, span)[np.argsort(order)[m : m + len(owner)]]

    def _carry(self, span: Array, before: Array, after: Array, way_before: Array) -> tuple[Array, Array]:
        """The original tangents carried along, (m, 2) complex units, and how far arms may stray from them."""
        m = len(self._line)
        number = np.arange(len(span))
        first = np.searchsorted(span, np.arange(m))
        last = np.append(first[1:], len(span)) - 1
        result, allowed = np.ones((m, 2), dtype=complex), np.full((m, 2), STRAY)
        least = np.where(self.vanished, REACH_VANISHED, REACH) * self.way
        tangents = (start_tangents(self._original), -end_tangents(self._original))
        for end, (node, tangent) in enumerate(zip((first, last), tangents)):
            old, new = as_complex(before - before[node[span]]), as_complex(after - after[node[span]])
            apart = (np.abs(new) > least[span]) & (np.abs(old) > RETRACTED * way_before[span])
            # The first such sample of each span, from its start or from its end.
            k = np.full(m, len(span))
            np.minimum.at(k, span[apart], number[apart] if end == 0 else -number[apart])
            found = k < len(span)
            k = np.abs(np.where(found, k, 0))
            turn = np.divide(new[k], old[k], out=np.ones(m, dtype=complex), where=found)
            result[:, end] = _unit(turn) * _unit(as_complex(tangent))
            lead = np.abs(np.angle(old[k] * np.conj(as_complex(tangent))))
            allowed[:, end] += np.where(found & (self._samples <= FEW), 2.0 * lead, 0.0)
        return result, np.minimum(allowed, MOST_STRAY)

    def free(self) -> Ends:
        """All control points free, but retracted ones at their nodes."""
        retracted = self._lengths <= RETRACTED * self._size[:, None]
        return Ends(np.where(retracted, FIXED, FREE), np.zeros((len(self._line), 2, 2)))

    def proven(self, distance: Array, tolerance: float) -> Array:
        """Which fits, (m,) bool, meet more samples than any fit does, so well that they need no guard.

        distance : (m,) largest one of a sample
        """
        return (self._samples > FEW) & (distance < PROVEN * tolerance)

    def _grown(self) -> Array:
        """Original lengths of the arms under the growth of their spans, (m, 2)."""
        return self.growth[:, None] * self._lengths

    def turned_back(self, ends: Ends, control: Array, which: Array) -> Ends:
        """Free arms of some spans (m,) bool that have strayed are put along the nearest direction allowed."""
        strayed = self._strayed(ends, control) & which[:, None]
        turn = _unit(as_complex(_arms(control))) * np.conj(self._carried)
        angle = np.clip(np.angle(turn), -self._allowed, self._allowed)
        return ends.put(strayed, ALONG, as_vector(self._carried * np.exp(1j * angle)))

    def _strayed(self, ends: Ends, control: Array) -> Array:
        """Which free control arms, (m, 2) bool, leave too far from where the samples do, or are too long."""
        arm = as_complex(_arms(control))
        off = np.abs(np.angle(arm * np.conj(self._carried))) > self._allowed + 1e-9
        return (ends.mode == FREE) & (off | (np.abs(arm) > self._longest())) & ~self._line[:, None]

    def _longest(self) -> Array:
        return np.maximum(LONG * self._grown(), self.way[:, None])

    def reversed(self, control: Array, whole: Array) -> Array:
        """Which arms, (m, 2) bool, of fitted spans are reversed, and more so than the original's were.

        whole : (m, 2) headings of the drawing's own arms, 1 at the ends that lie inside a segment
        """
        heading = headings(control)
        fault = (heading < REVERSED) & (whole >= -0.5) & (heading < whole - REVERSED_MORE)
        return fault & ~self._line[:, None]

    def behind(self, control: Array) -> Array:
        """How far each sample, (r,), lies behind the more reversed end of its span."""
        way, heading = _ways_of_ends(control), headings(control)
        end = np.argmin(heading, axis=1)
        span = np.arange(len(control))
        node = np.where(end[:, None] == 0, control[:, 0], control[:, 3])
        away = self._target - node[self._owner]
        return -np.einsum("rd,rd->r", away, way[span, end][self._owner])

    def unreversed(self, control: Array, fault: Array) -> Array:
        """The spans with some arms, (m, 2) bool, laid along their chord."""
        chord = control[:, 3] - control[:, 0]
        length = np.minimum(
            np.linalg.norm(_arms(control), axis=2), np.linalg.norm(chord, axis=1)[:, None] / 3.0
        )
        along = as_vector(_unit(as_complex(chord)))
        result = control.copy()
        for end, (inner, node) in enumerate(_ARMS):
            laid = control[:, node] + (1.0 - 2.0 * end) * length[:, end, None] * along
            result[:, inner] = np.where(fault[:, end, None], laid, control[:, inner])
        return result

    def cornered(self, before: Array, after: Array) -> Array:
        """At which nodes, each between two spans, the samples make a cusp, (k,) bool."""
        return np.abs(np.angle(-self._carried[after, 0] * np.conj(self._carried[before, 1]))) > CUSP

    def smooth(self, ends: Ends, control: Array, following: Array, corner: Array, trust: Array) -> Ends:
        """The arms of smooth nodes along the directions that the fits of both sides agree on.

        control : (m, 4, 2) of the separate fits; following : (m,) the next span or -1; corner : (m,) bool,
        ends where no direction is shared; trust : (m,)
        """
        o = self._original
        before = np.flatnonzero(following >= 0)
        after = following[before]
        t_in, t_out = end_tangents(o[before]), start_tangents(o[after])
        turn = np.angle(as_complex(t_out) * np.conj(as_complex(t_in)))
        usable = (np.linalg.norm(t_in, axis=1) > 0) & (np.linalg.norm(t_out, axis=1) > 0)
        smooth = usable & (np.abs(turn) < SMOOTH_ANGLE) & ~(self._line[before] & self._line[after])
        smooth &= ~corner[before]
        before, after, turn = before[smooth], after[smooth], turn[smooth]

        arriving = as_complex(end_tangents(control[before]))
        leaving = as_complex(start_tangents(control[after]))
        # Each side's estimate of the direction that a perfectly smooth node would have.
        u_in = arriving * np.exp(0.5j * turn)
        u_out = leaving * np.exp(-0.5j * turn)
        mean = trust[before] * u_in + trust[after] * u_out
        mean = mean / (trust[before] + trust[after])
        both = np.where(self._line[before], u_in, np.where(self._line[after], u_out, mean))
        usable = np.abs(both) > 1e-12 * self._size[before]
        before, after, turn, both = before[usable], after[usable], turn[usable], both[usable]
        unit = _unit(both)
        which, along = np.zeros(ends.mode.shape, dtype=bool), np.zeros(ends.along.shape)
        which[before, 1], which[after, 0] = True, True
        along[before, 1] = -as_vector(unit * np.exp(-0.5j * turn))
        along[after, 0] = as_vector(unit * np.exp(0.5j * turn))
        return ends.put(which, ALONG, along)

    def limited(self, ends: Ends, control: Array, which: Array) -> Ends:
        """Arms along a direction that are too short, or backwards, or too long get a fixed length."""
        grown = self._grown()
        reach = self._along(ends, control)
        short, long = reach < SHORT * grown, reach > self._longest()
        # A retracted arm that would point backwards comes out a little instead: at its node the direction
        # would be left to the other arm.
        length = np.maximum(np.where(long, 1.0, SHORT) * grown, RETRACTED_OUT * self._chord[:, None])
        wrong = (ends.mode == ALONG) & (short | long) & which[:, None]
        return ends.put(wrong, FIXED, ends.along * length[..., None])

    def refused(self, ends: Ends, control: Array) -> Array:
        """Which spans, (m,) bool, have a control arm that is not to be."""
        reach = self._along(ends, control)
        wrong = (ends.mode == ALONG) & ((reach < 0.0) | (reach > self._longest()))
        return (wrong | self._strayed(ends, control)).any(axis=1)

    def _along(self, ends: Ends, control: Array) -> Array:
        """How far the arms reach along their directions, (m, 2)."""
        return np.einsum("med,med->me", _arms(control), ends.along)


def headings(control: Array) -> Array:
    """Cosines (m, 2) between the arms of cubics and where the curves go from their ends; 1 without an arm."""
    arms, way = _arms(control), _ways_of_ends(control)
    size = np.linalg.norm(arms, axis=2)
    seen = size >= _UNSEEN * bezier.polygon_lengths(control)[:, None]
    product = size * np.linalg.norm(way, axis=2)
    dot = np.einsum("med,med->me", arms, way)
    return np.divide(dot, product, out=np.ones_like(dot), where=seen & (product > 0.0))


def _ways_of_ends(control: Array) -> Array:
    """Where cubics go from their ends, (m, 2, 2)."""
    points = bezier.evaluate(control[:, None], _WAY_POINTS)
    length = np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1)
    size = np.linalg.norm(_arms(control), axis=2)
    ways = []
    for end, way in enumerate((points - points[:, :1], (points - points[:, -1:])[:, ::-1])):
        far = (
            np.linalg.norm(way, axis=2)
            > np.maximum(_WAY_OF_ARM * size[:, end], _WAY_OF_CURVE * length)[:, None]
        )
        k = np.where(far.any(axis=1), np.argmax(far, axis=1), len(_WAY_POINTS) - 1)
        ways.append(way[np.arange(len(way)), k])
    return np.stack(ways, axis=1)


def _cusps(before: Array, after: Array, span: Array) -> Array:
    """At which of the points along spans the way turns further than it did, (p,) bool; at no end."""
    old, new = (as_complex(np.diff(points, axis=0)) for points in (before, after))
    turn = new[1:] * np.conj(new[:-1]) * np.conj(old[1:]) * old[:-1]
    result = np.zeros(len(span), dtype=bool)
    result[1:-1] = (np.abs(np.angle(turn)) > CUSP) & (span[2:] == span[:-2])
    return result


def start_tangents(control: Array) -> Array:
    """Directions (m, 2) in which cubics leave their start, past control points that lie on it."""
    return _first_long(control[:, 1:] - control[:, :1], bezier.polygon_lengths(control))


def end_tangents(control: Array) -> Array:
    """Directions (m, 2) in which cubics arrive at their end."""
    return _first_long((control[:, 3:] - control[:, :3])[:, ::-1], bezier.polygon_lengths(control))


def _first_long(vectors: Array, size: Array) -> Array:
    """The first of (m, 3, 2) vectors that is longer than a retracted arm."""
    long = np.linalg.norm(vectors, axis=2) > RETRACTED * size[:, None]
    pick = np.argmax(long, axis=1)
    return vectors[np.arange(len(vectors)), pick]


def _arms(control: Array) -> Array:
    """Both control arms of cubics, (m, 4, 2) -> (m, 2, 2)."""
    return np.stack([control[:, inner] - control[:, node] for inner, node in _ARMS], axis=1)


def _ways(span: Array, points: Array, count: int) -> Array:
    """Lengths (count,) of the ways through the points of each span, which are in order."""
    step = np.linalg.norm(np.diff(points, axis=0), axis=1)
    within = span[1:] == span[:-1]
    return np.bincount(span[1:][within], step[within], minlength=count)


def _unit(z: Array) -> Array:
    """Complex numbers on the unit circle; 1 for 0."""
    size = np.abs(z)
    return np.where(size > 0.0, z, 1.0) / np.where(size > 0.0, size, 1.0)


def as_complex(vectors: Array) -> Array:
    return vectors[..., 0] + 1j * vectors[..., 1]


def as_vector(z: Array) -> Array:
    return np.stack([z.real, z.imag], axis=-1)
