# SPDX-License-Identifier: GPL-2.0-or-later
"""Fingerprints of what a run wrote, which tell whether it was edited since.

A hash of the text is compared first.  But it also differs if a program writes the same numbers in another
way: relative, with eight digits, with fewer spaces.  A hash of rounded numbers has the same weakness, for
numbers next to a rounding limit.  Therefore `alup:written` also has sums of the numbers x_i

    sum_i w_ki x_i,   w_ki = 2 frac(i sqrt(p_k)) - 1,   k = 1, 2, 3,   p = 2, 3, 5

An edit of one number changes a sum by about as much as the number.  The rounding of many numbers changes it
by little more than that of one.  For path data the x_i are the first point and the vectors from the start of
each segment to its other control points.  (Programs that write relative commands round these vectors; in
absolute points the roundings would add up.)  The closing line of `z` is left out, because programs may write
it, omit it, or open it by rounding.  The matrix to root user units is stored as numbers, so that moves of an
object or its group are recognised.

Inkscape writes the move of a path into its data.  Therefore x and y of path data also have separate sums.
Let P_k, Q_k be the sums of the present data and X_k, Y_k those of the written data.  The equations

    X_k = a P_k + c Q_k + w_k1 e,   Y_k = b P_k + d Q_k + w_k1 f

hold for all k if the affine map (a b c d e f) takes the path back.  Here i counts vectors, x and y have the
same weight, and only the first vector, from the origin to the start, is shifted.  Only shifts and
similarities are tried, because they have fewer unknowns than there are equations.  A scale along one axis
can't be distinguished from an edit such as the dragged tip of a gable, and counts as an edit.

Elements that a run did not move have nothing stored.  One attribute of the root has short codes of them
(`unmoved_codes`), by which elements that were drawn or edited later are recognised.
"""

from __future__ import annotations

import base64
import hashlib
import re
from dataclasses import dataclass, replace

import numpy as np

from ...messages.errors import DocumentError
from ...model import Array
from ...svg import basic_shapes, path_data
from .elements import WHOLE, Element, is_squashed, local_tag, name_of, outline_of, own_matrix
from .references import SERVERS

# Numbers that differ by less than this part of the largest are equal.  Programs that rewrite coordinates keep
# eight digits, sometimes seven.
SAME_OF_LARGEST = 1e-6

# Part of the largest coordinate by which a subpath may miss its start.  Roundings of relative commands add up
# along the subpath; two hundred segments with eight digits give 7e-7.
CLOSED_OF_LARGEST = 1e-6

# The weights of the sums are fractional parts of multiples of these.
_PRIMES = np.sqrt([2.0, 3.0, 5.0, 7.0])
_SUMS = 3  # sums over all numbers that are stored; of x and y there is one for each prime

# A path whose width is below this part of its length is nearly a line.  A similarity maps any line to any
# other, so it tells nothing there.
_SLIM = 1e-2

_CODE_LETTERS = 4  # 24 bits: with a thousand codes a false match has a probability of 6e-5
# Decimals of matrix entries in codes.  Chosen by looking at the cases.
_MATRIX_DECIMALS = 5

_SERVER_NUMBERS = ("x1", "y1", "x2", "y2", "cx", "cy", "r", "fx", "fy", "x", "y", "width", "height")
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


@dataclass(frozen=True)
class Digest:
    """The fingerprint of an element.

    text : hash of the written text; count, largest : number of the numbers, and the largest; sums : (3,)
    matrix : (3, 3) to root user units; axes : (2, 4) the sums of x and y, None without path data
    closed : a sum that encodes which subpaths are closed
    slim : whether all vectors have nearly the same direction; not stored
    """

    text: str
    count: int
    largest: float
    sums: Array
    matrix: Array
    axes: Array | None = None
    closed: float = 0.0
    slim: bool = False

    def still_drawn(self, element: Element) -> bool:
        """Whether the element's own numbers are unchanged."""
        move = self.move_in(element)
        return move is not None and np.array_equal(move, np.eye(3))

    def move_in(self, element: Element) -> Array | None:
        """The move (3, 3) that was written into the path data since then; None for any other change."""
        tag = local_tag(element)
        if tag not in ("path", *basic_shapes.TAGS) or self.is_text(element.attrib.get("d") or ""):
            return np.eye(3)
        if self.axes is None and tag != "path":
            return np.eye(3)  # a hidden shape, recorded by a version that stored its transform only
        now = of_element(element, np.eye(3))
        if now is None:
            return None
        return np.eye(3) if self._same_numbers(now) else self._move_to(now)

    def _move_to(self, now: Digest) -> Array | None:
        """The move (3, 3) that maps what was written to the sums `now`, or None."""
        if self.axes is None or now.axes is None or self.count != now.count:
            return None
        if abs(self.closed - now.closed) > 1e-6:
            return None
        first = _weights(1)[0]
        (p, q), (x, y) = now.axes, self.axes
        zero = np.zeros_like(p)
        shift = [np.concatenate([first, zero]), np.concatenate([zero, first])]
        scale, turn = np.concatenate([p, q]), np.concatenate([q, -p])
        flip, flip_turn = np.concatenate([p, -q]), np.concatenate([q, p])
        known = np.concatenate([x, y])
        back = np.eye(3)
        system = np.stack(shift, axis=1)
        found = np.linalg.lstsq(system, known - scale, rcond=None)[0]
        back[:2, 2] = found
        if self._is_met(system @ found + scale - known, now, 1.0):
            return np.linalg.inv(back)
        for columns, mirrored in (((scale, turn), 1.0), ((flip, flip_turn), -1.0)):
            system = np.stack([*columns, *shift], axis=1)
            one, other, back[0, 2], back[1, 2] = found = np.linalg.lstsq(system, known, rcond=None)[0]
            back[:2, :2] = [[one, other], [-mirrored * other, mirrored * one]]
            fits = self._is_met(system @ found - known, now, float(np.hypot(one, other)))
            if fits and not now.slim and not is_squashed(back):
                return np.linalg.inv(back)
        return None

    def _is_met(self, off: Array, now: Digest, scale: float) -> bool:
        return bool(np.abs(off).max() <= self._allowed(max(self.largest, now.largest * scale)))

    def _allowed(self, reach: float) -> float:
        """The difference of sums that rounding of coordinates of size `reach` may cause."""
        # Rounding errors of n numbers add up as sqrt(n).  The standard deviation of a sum is 0.25e-7 sqrt(n),
        # so this is eight standard deviations.
        return SAME_OF_LARGEST * reach * max(1.0, float(np.sqrt(self.count)) / 5.0)

    def is_text(self, text: str) -> bool:
        """Whether the text is what was written."""
        return _hash(text) == self.text

    def _same_numbers(self, other: Digest) -> bool:
        if self.text == other.text or self.count != other.count:
            return self.text == other.text
        return bool(np.abs(self.sums - other.sums).max() <= self._allowed(self.largest))

    def still_there(self, matrix: Array, motion: Array | None = None) -> bool:
        """Whether the element has its former position, apart from a common (3, 3) motion of the drawing.

        matrix : (2 or 3, 3) own coordinates -> root user units, now
        """
        here = self.matrix if motion is None else motion @ self.matrix
        linear, shift = np.abs(here[:2, :2]).max(), np.abs(here[:2, 2]).max()
        off = np.abs(here[:2] - matrix[:2])
        reach = max(self.largest, 1e-300)
        allowed = SAME_OF_LARGEST * max(linear * reach, shift)
        return bool(off[:, :2].max() * reach + off[:, 2].max() <= allowed)

    def unchanged(self, copy: Digest | None) -> bool:
        """Whether a copy of a gradient or pattern is unchanged."""
        return copy is not None and self._same_numbers(copy) and self.still_there(copy.matrix)

    def __str__(self) -> str:
        numbers = [self.largest, *self.matrix[:2].T.ravel(), *self.sums]
        numbers += [] if self.axes is None else [*self.axes.ravel(), self.closed]
        return " ".join([self.text, str(self.count), *(f"{value:.10g}" for value in numbers)])

    @classmethod
    def read(cls, text: str) -> Digest | None:
        """The fingerprint from its attribute; None if the text is not one."""
        words = text.split()
        try:
            count, numbers = int(words[1]), np.array([float(word) for word in words[2:]])
        except (ValueError, IndexError):
            return None
        if len(numbers) not in (_PLAIN_NUMBERS, _PATH_NUMBERS) or not np.isfinite(numbers).all():
            return None
        matrix = np.eye(3)
        matrix[:2] = numbers[1:7].reshape(3, 2).T
        found = cls(words[0], count, float(numbers[0]), numbers[7:_PLAIN_NUMBERS], matrix)
        if len(numbers) == _PLAIN_NUMBERS:
            return found
        axes = numbers[_PLAIN_NUMBERS:-1].reshape(2, -1)
        return replace(found, axes=axes, closed=float(numbers[-1]))


# Numbers after the hash and the count: largest, matrix, sums.  Path data add the sums of x, y, and `closed`.
_PLAIN_NUMBERS = 7 + _SUMS
_PATH_NUMBERS = _PLAIN_NUMBERS + 2 * len(_PRIMES) + 1


def _weights(count: int) -> Array:
    """(count, 4) the w_ki of the first numbers."""
    return 2.0 * np.modf(np.arange(1, count + 1)[:, None] * _PRIMES)[0] - 1.0


def _digest(text: str, values: Array, matrix: Array, largest: float | None = None) -> Digest:
    """The fingerprint of numbers (n,).  largest : the largest coordinate, if it is not one of the values"""
    whole = np.vstack([matrix[:2], [0.0, 0.0, 1.0]])
    if largest is None:
        largest = float(np.abs(values).max(initial=0.0))
    return Digest(_hash(text), len(values), largest, values @ _weights(len(values))[:, :_SUMS], whole)


def _hash(text: str) -> str:
    return hashlib.blake2b(text.encode("utf-8", "replace"), digest_size=6).hexdigest()


def of_path(data: str, subpaths: tuple[path_data.Subpath, ...], matrix: Array) -> Digest:
    """The fingerprint of path data.  matrix : (2 or 3, 3) own coordinates -> root user units"""
    starts = np.array([subpath.start for subpath in subpaths]).reshape(-1, 2)
    steps = np.diff(starts, axis=0, prepend=np.zeros((1, 2)))
    values, vectors = [np.zeros(0)], [np.zeros((0, 2))]
    closed = np.array([float(subpath.closed) for subpath in subpaths])
    reach = float(np.abs(starts).max(initial=0.0))
    for step, subpath in zip(steps, subpaths):
        control = _without_closing(subpath)
        reach = max(reach, float(np.abs(control).max(initial=0.0)))
        arms = (control[:, 1:] - control[:, :1]).reshape(-1, 2)
        vectors += [step[None], arms]
        values += [step, arms.ravel(), np.array([float(subpath.closed)])]
    shifts = np.concatenate(vectors)
    axes = shifts.T @ _weights(len(shifts))
    spread = np.linalg.svd(shifts[1:], compute_uv=False) if len(shifts) > 2 else np.zeros(2)
    return replace(
        _digest(data, np.concatenate(values), matrix, reach),
        axes=axes,
        closed=float(closed @ _weights(len(closed))[:, 0]),
        slim=bool(spread[1] <= _SLIM * spread[0]),
    )


def _without_closing(subpath: path_data.Subpath) -> Array:
    """Control points (k, 4, 2) without the closing lines of a closed subpath."""
    control, kind = subpath.control, subpath.kind
    reach = float(np.abs(control).max(initial=0.0))
    count = len(control)
    while subpath.closed and count > 1 and kind[count - 1] in (path_data.LINE, path_data.CLOSE):
        if np.abs(control[count - 1, 3] - subpath.start).max() > CLOSED_OF_LARGEST * reach:
            break
        count -= 1
    return control[:count]


def of_element(element: Element, outer: Array) -> Digest | None:
    """The fingerprint of a path, text, image, gradient or pattern as it is now; None if there is none.

    outer : (3, 3) coordinates of its parent -> root user units
    """
    tag = local_tag(element)
    try:
        if tag == "path" or tag in basic_shapes.TAGS:
            data = outline_of(element, name_of(element))
            return of_path(data, path_data.parse(data), outer @ own_matrix(element))
        if tag in WHOLE:
            return _digest(element.attrib.get("transform") or "", np.ones(1), outer @ own_matrix(element))
        if tag in SERVERS:
            return _digest("", np.ones(1), own_matrix(element, SERVERS[tag][1]))
    except DocumentError:
        return None  # it was made unreadable by an edit
    return None


def of_copy(server: Element) -> Digest | None:
    """The fingerprint of a copied gradient or pattern, including its own numbers, which an original lacks."""
    texts = [server.attrib.get(name) or "" for name in _SERVER_NUMBERS]
    numbers = [float(number) for text in texts for number in _NUMBER.findall(text)]
    try:
        matrix = own_matrix(server, SERVERS[local_tag(server)][1])
    except DocumentError:
        return None
    return _digest(" ".join(texts), np.array([1.0, *numbers]), matrix)


# --- codes of elements that did not move -----------------------------------------------------------


def code(element: Element, matrix: Array, motion: Array | None = None) -> str:
    """A short code of an element's position and outline.

    matrix : (2 or 3, 3) own coordinates -> root user units; motion : (3, 3) to be undone first
    """
    if motion is not None:
        matrix = np.linalg.solve(motion, np.vstack([matrix[:2], [0.0, 0.0, 1.0]]))
    rounded = np.round(matrix[:2], _MATRIX_DECIMALS) + 0.0
    return _code(_outline(element) + " ".join(f"{value:g}" for value in rounded.ravel()))


def clip_code(clip: Element) -> str:
    """A short code of the contents of a clip path or mask, in its own coordinates."""
    parts = [_outline(part) + (part.attrib.get("transform") or "") for part in clip.iter() if local_tag(part)]
    return _code(" ".join(parts))


def _outline(element: Element) -> str:
    tag = local_tag(element)
    names = ("d",) if tag == "path" else basic_shapes.GEOMETRY.get(tag, ("x", "y", "width", "height"))
    return "|".join([tag, *(element.attrib.get(name) or "" for name in names), ""])


def _code(text: str) -> str:
    digest = hashlib.blake2b(text.encode("utf-8", "replace"), digest_size=3).digest()
    return base64.b64encode(digest).decode("ascii")


def codes_text(codes: set[str]) -> str:
    return "".join(sorted(codes))


def read_codes(text: str) -> set[str]:
    return {text[n : n + _CODE_LETTERS] for n in range(0, len(text), _CODE_LETTERS)}
