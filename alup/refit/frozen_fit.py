# SPDX-License-Identifier: GPL-2.0-or-later
"""A fit whose structure is kept while its samples move: for frames of a drag, in a fiftieth of a fit's time.

The spans, the parameters of their samples, and which control arms are free, held to a direction or fixed, are
taken from a fit (`alup.refit.cubic_fit`).  Then

    min  sum_i w_i |b1 D1 + b2 D2 - (d_i - b0 D0 - b3 D3)|^2  +  PRIOR (|D1 - D1*|^2 + |D2 - D2*|^2)

is linear in the samples' displacements d: the sums over samples are sparse matrices, and the normal matrix

    ( a11 a12 )
    ( a12 a22 )

of each span is the same for both coordinates, so that D1, D2 are complex numbers (x + i y).  As in a fit, a
first solution gives the directions that the arms of smooth nodes share.  Other directions turn with the chord
of their span.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import csr_matrix

from ..geometry import bezier
from ..model import Array, Refitted
from .control_arms import ALONG, FIXED, FREE, Ends, as_complex, as_vector
from .cubic_fit import PRIOR
from .refit import Fitted, Refit

# A kept fit serves until it misses its samples by more than this, in tolerances of the refit, and by more
# than GROWN times what it missed them by at first.  A frame may be off by more than what is written to a
# file; what is still hard to see is a thousandth of the drawing or two.
ALLOWED, GROWN = 4.0, 2.0


class FrozenFit:
    """allowed : the error, user units, up to which it serves"""

    def __init__(self, of: Fitted, refit: Refit, moved: Array):
        """Keep the fit of samples that had moved to (N, 2)."""
        self._of, self._points = of, refit.samples.points
        self._refit = refit
        self._moving = refit.in_moved_subpaths(moved - self._points)
        self.allowed = max(ALLOWED * refit.tolerance, GROWN * of.refitted.error)
        fit = of.fit
        m, count, owner = len(fit.line), len(self._points), fit.owner
        self._o = as_complex(fit.original)
        self._basis = bezier.basis(fit.t)
        foot = np.einsum("rk,rk->r", self._basis, self._o[owner])
        # Of the samples at rest; parameters may have been corrected, so they are not at the foot.
        self._rest = as_complex(fit.target - fit.d)
        weighted = fit.weight[:, None] * self._basis
        self._sums = [
            csr_matrix((weighted[:, k], (owner, fit.sample)), shape=(m, count)).astype(complex)
            for k in (1, 2)
        ]
        off = self._rest - foot
        self._constant = [
            np.bincount(owner, weighted[:, k] * off.real, m)
            + 1j * np.bincount(owner, weighted[:, k] * off.imag, m)
            for k in (1, 2)
        ]
        a = [[np.bincount(owner, weighted[:, k] * self._basis[:, j], m) for j in range(4)] for k in (1, 2)]
        self._by_ends = [(a[n][0], a[n][3]) for n in (0, 1)]
        self._a11, self._a12, self._a22 = a[0][1] + PRIOR, a[0][2], a[1][2] + PRIOR
        self._chord = self._o[:, 3] - self._o[:, 0]
        self._usable = np.abs(self._chord) > 0.05 * bezier.polygon_lengths(fit.original)
        self._growth = fit.guard.growth
        self._similarity_then = self._similarity(as_complex(fit.d0), as_complex(fit.d3))
        self._free = fit.guard.free()
        changed = (fit.ends.mode != fit.smooth.mode) | (fit.ends.along != fit.smooth.along).any(axis=2)
        self._changed = changed & (fit.ends.mode != FREE)

    def covers(self, moved: Array) -> bool:
        """Whether all subpaths that samples at (N, 2) move are in the fit."""
        return not (self._refit.in_moved_subpaths(moved - self._points) & ~self._moving).any()

    def refitted(self, moved: Array) -> Refitted:
        """The new segments for samples moved to (N, 2)."""
        fit, of = self._of.fit, self._of
        d = as_complex(moved - self._points)
        d0, d3 = d[fit.spans.first], d[fit.spans.last]
        z = self._similarity(d0, d3)
        o = self._o
        prior = (d0 + (z - 1.0) * (o[:, 1] - o[:, 0]), d3 + (z - 1.0) * (o[:, 2] - o[:, 3]))
        right = [
            constant + sums @ d - by0 * d0 - by3 * d3 + PRIOR * wished
            for constant, sums, (by0, by3), wished in zip(self._constant, self._sums, self._by_ends, prior)
        ]
        nodes = (o[:, 0] + d0 - o[:, 1], o[:, 3] + d3 - o[:, 2])
        turned = z / self._similarity_then
        control = self._solved(right, nodes, d0, d3, _carried(fit.free, turned))
        ends = fit.guard.smooth(self._free, as_vector(control), fit.next, fit.corner, fit.trust)
        kept = _carried(fit.ends, turned)
        ends = Ends(
            np.where(self._changed, kept.mode, ends.mode),
            np.where(self._changed[..., None], kept.along, ends.along),
        )
        control = self._solved(right, nodes, d0, d3, ends)
        result = np.empty_like(of.refitted.control)
        result[of.of_fit] = as_vector(control)
        result[of.others] = of.resting + as_vector(d[of.still])[:, None]
        return replace(of.refitted, control=result, error=self._error(control, d))

    def _similarity(self, d0: Array, d3: Array) -> Array:
        """What each span's chord is multiplied by, (m,) complex; a loop's says nothing."""
        chord = np.where(self._usable, self._chord, 1.0)
        return np.where(self._usable, (self._chord + d3 - d0) / chord, self._growth)

    def _solved(
        self, right: list[Array], nodes: tuple[Array, Array], d0: Array, d3: Array, ends: Ends
    ) -> Array:
        """Control points (m, 4) for right-hand sides; nodes : displacements that put arms on their nodes."""
        (r1, r2), (n1, n2) = right, nodes
        a11, a12, a22 = self._a11, self._a12, self._a22
        along = as_complex(ends.along)
        u1, u2 = along.T
        free1, free2 = (ends.mode == FREE).T
        fixed1, fixed2 = (ends.mode == FIXED).T
        known1, known2 = n1 + u1, n2 + u2
        # With the first arm free: the second by the Schur complement.
        second = _single(r2 - a12 * r1 / a11, a22 - a12**2 / a11, n2, u2, free2)
        first = (r1 - a12 * second) / a11
        # The first along its direction, the second free.
        swapped = ~free1 & free2
        along1 = _single(r1 - a12 * r2 / a22, a11 - a12**2 / a22, n1, u1, free1)
        first, second = (
            np.where(swapped, along1, first),
            np.where(swapped, (r2 - a12 * along1) / a22, second),
        )
        # Both along theirs.
        both = ~free1 & ~free2
        c = a12 * (u1.conj() * u2).real
        p1 = (u1.conj() * (r1 - a11 * n1 - a12 * n2)).real
        p2 = (u2.conj() * (r2 - a12 * n1 - a22 * n2)).real
        determinant = a11 * a22 - c**2
        first = np.where(both, n1 + u1 * (a22 * p1 - c * p2) / determinant, first)
        second = np.where(both, n2 + u2 * (a11 * p2 - c * p1) / determinant, second)
        # One fixed, or both.
        second = np.where(fixed1, _single(r2 - a12 * known1, a22, n2, u2, free2), second)
        first = np.where(fixed2, _single(r1 - a12 * known2, a11, n1, u1, free1), first)
        first, second = np.where(fixed1, known1, first), np.where(fixed2, known2, second)
        line = self._of.fit.line
        thirds = (d3 - d0) / 3.0
        first, second = np.where(line, d0 + thirds, first), np.where(line, d3 - thirds, second)
        return self._o + np.stack([d0, first, second, d3], axis=1)

    def _error(self, control: Array, d: Array) -> float:
        """The largest distance of a sample from its curve point; for lines, from the line."""
        fit = self._of.fit
        owner = fit.owner
        if not len(owner):
            return 0.0
        away = np.einsum("rk,rk->r", self._basis, control[owner]) - self._rest - d[fit.sample]
        chord = control[:, 3] - control[:, 0]
        length = np.abs(chord)
        straight = fit.line & (length > 0.0)
        unit = np.where(straight, chord, 1.0) / np.where(straight, length, 1.0)
        across = np.abs((away * unit[owner].conj()).imag)
        return float(np.where(straight[owner], across, np.abs(away)).max())


def _single(r: Array, a: Array, n: Array, u: Array, free: Array) -> Array:
    """The minimiser of a |D|^2 / 2 - Re(conj(r) D): free, or on the line n + s u."""
    return np.where(free, r / a, n + u * (u.conj() * (r - a * n)).real / a)


def _carried(ends: Ends, turned: Array) -> Ends:
    """Directions turned as complex numbers (m,) turn; offsets of fixed arms grow with them."""
    size = np.abs(turned)
    unit = np.where(size > 0.0, turned, 1.0) / np.where(size > 0.0, size, 1.0)
    along = as_complex(ends.along)
    by = np.where(ends.mode == FIXED, turned[:, None], unit[:, None])
    return Ends(ends.mode, as_vector(np.where(ends.mode == ALONG, along * unit[:, None], along * by)))
