"""Noise under an exponential window: neighbouring lines are correlated, so that their scatter says less than all of it.

Noise that is white in time and then multiplied by e^(-d t) has, between lines of the transform m apart, the
correlation 2 d T / (2 d T + 2 pi i m) with T the record's length (the transform of the squared window: Harris,
*Proc. IEEE* 66 (1978) 51). What is smooth over lines is early in time, where the window has taken nothing: there the
noise is up to 2 d T / (1 - e^(-2 d T)) times the lines' own variance, and what differs from line to line has less.
FRFs of records that were hit t0 after their start have their noise turned by e^(i omega t0), with the response.

Lines whose errors go together are brought into independent ones, W W^H being the inverse of their correlation
(Aitken, *Proc. R. Soc. Edinb.* 55 (1935) 42): taken for independent, they would say 2 d T times as much of
all that is smooth over lines, and standard errors of a gain or a delay would be half of what they are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.linalg import solve_triangular
from scipy.sparse import csr_array

from thermospindle.model.types import Array, ComplexArray, Integers

LEAST = 0.2  # d T, from which a window is worth a question
FRESH = 0.003  # of the noise's variance, at least, that is new in every line: that of the force channel, which no window takes away late in a record, of a file's digits, and what polynomials leave
TOLD, FOUND, UNTOLD = 0.01, 0.03, 0.12  # of a record, by which it may begin earlier than is told; than its lines say; and where neither does: so late a hit does not show in what polynomials leave
REACH, FINE, TELLS = 0.25, 100, 0.03  # of a record, up to which the hit is sought, times in it, and by how much nearer a correlation must be to tell one: three standard errors of a median over some hundred pieces
PIECE, DEGREES = 24, 9  # lines and polynomials of the pieces whose scatter tells whether noise is windowed


@dataclass(frozen=True)
class Window:
    """An exponential window e^(-`decay` t) (1/s) on records of a `length` (s) that were hit so long after their start."""

    decay: float = 0.0
    length: float = 1.0
    pretrigger: float = 0.0
    early: float = UNTOLD  # share of a record by which it may begin earlier

    @property
    def damped(self) -> float:
        """d T."""
        return self.decay * self.length

    @property
    def turn(self) -> float:
        """By how much (rad) the noise of an FRF turns from line to line."""
        return 2 * np.pi * self.pretrigger / self.length

    @property
    def smooth(self) -> float:
        """Variance of noise that is smooth over lines, early in a record, over that of single lines."""
        return float(2 * self.damped / -np.expm1(-2 * self.damped)) if self.damped else 1.0


NONE = Window()


def apart(lines: Integers, window: Window, early: float = 0.0) -> ComplexArray:
    """Correlation (n,) of the noise of two so many `lines` (n,) apart; with the last share `early` of the record
    as loud as its start, which may be there: where records begin before the time that is told, their noise is."""
    if window.damped == 0.0:
        return (lines == 0).astype(complex)
    falls, turns = 2 * window.damped + 2j * np.pi * lines, 2j * np.pi * np.where(lines, lines, 1)
    found = -np.expm1(-falls * (1 - early)) / falls + np.where(lines, np.expm1(-turns * (1 - early)) / turns, early)
    return np.asarray(found * window.smooth * np.exp(1j * window.turn * lines), complex)


def between(number: Integers, window: Window, early: float = 0.0) -> ComplexArray:
    """The same (n, n) of lines by `number` (n,)."""
    farthest = int(np.ptp(number))
    return apart(np.arange(-farthest, farthest + 1), window, early)[np.subtract.outer(number, number) + farthest]


@lru_cache(maxsize=512)
def correlation(lines: int, window: Window) -> ComplexArray:
    """Correlation (lines, lines) of the noise of lines one after the other. Read only."""
    found = between(np.arange(lines), window)
    found.flags.writeable = False
    return found


def covariance(mixing: csr_array, number: Integers, window: Window, early: float = 0.0) -> ComplexArray:
    """Covariance (L, L) of values that are each a `mixing` (L, n) of lines by `number` (n,), of unit variance each under the window."""
    return np.asarray(mixing @ (mixing @ between(number, window, early)).conj().T, complex)


@dataclass(frozen=True, eq=False)
class Alike:
    """Values (L,) of FRFs (n_resp, n_ref) that are each a `mixing` (L, n) of lines by `number` (n,), of
    whose variance a window makes the `share` (n_resp, n_ref, L) alike; the rest is new in every line."""

    mixing: csr_array
    number: Integers
    window: Window
    share: Array

    def only(self, which: slice) -> Alike:
        return replace(self, mixing=self.mixing[which], share=self.share[..., which])

    def hit(self, pretrigger: float) -> Alike:
        """The same of records that were hit at a time that is told."""
        return replace(self, window=replace(self.window, pretrigger=pretrigger, early=TOLD))

    def whitening(self) -> ComplexArray:
        """W (n_resp, n_ref, L, L), by which rows of values, each in its own standard errors, become
        independent ones of unit variance: W^T R W^* = 1 with R their correlation."""
        of = self.mixing, self.number, self.window
        size, one = np.sqrt(np.diag(covariance(*of)).real), np.eye(self.mixing.shape[0])
        alike, found = covariance(*of, self.window.early) / np.outer(size, size), np.empty((*self.share.shape, len(one)), complex)
        for at in np.ndindex(*self.share.shape[:2]):
            own = np.minimum(self.share[at], 1 - FRESH)
            lower = np.linalg.cholesky(np.sqrt(np.outer(own, own)) * alike + np.diag(1 - own))
            found[at] = solve_triangular(lower, one, lower=True).T
        return found


def left_by(basis: Array, window: Window) -> tuple[Array, float, float]:
    """For noise of unit variance a line and orthonormal polynomials `basis` (k, p): variances (p,) of
    its coefficients, and the mean and the variance of the sum of squares that the polynomials leave."""
    k, p = basis.shape
    if window.damped == 0.0:
        return np.ones(p), float(k - p), float(k - p)
    c = correlation(k, window)
    rest = c - basis @ (basis.T @ c)
    return np.einsum("ip,ij,jp->p", basis, c, basis).real, float(np.trace(rest).real), float(np.einsum("ij,ji->", rest, rest).real)


def neighbours(window: Window) -> float:
    """Variance of a line less the mean of its neighbours, over that of white noise."""
    weights = np.array([-0.5, 1.0, -0.5])
    return float((weights @ correlation(3, window) @ weights).real / 1.5)


def windowed(value: ComplexArray, window: Window) -> Window:
    """The window that the scatter of FRFs (..., n) shows: none where noise is new in every line,
    and one of records that were hit later where that is not told.

    From the correlation of neighbouring lines in what polynomials over short pieces leave, the
    median over pieces; its phase tells when records begin.
    """
    if window.damped < LEAST or value.shape[-1] < PIECE:
        return NONE
    x = np.linspace(-1, 1, PIECE)
    basis = np.linalg.qr(np.polynomial.legendre.legvander(x, DEGREES - 1))[0]
    pieces = value[..., : value.shape[-1] // PIECE * PIECE].reshape(-1, PIECE)
    left = pieces - (pieces @ basis) @ basis.T
    square = np.sum(np.abs(left) ** 2, axis=1)
    seen = np.sum(left[:, 1:] * left[:, :-1].conj(), axis=1)[square > 0] / square[square > 0]
    if not len(seen):
        return NONE
    middle, across = complex(np.median(seen.real), np.median(seen.imag)), np.eye(PIECE) - basis @ basis.T

    def off(of: Window) -> float:
        c = across @ correlation(PIECE, of) @ across
        return abs(middle - complex(np.trace(c, offset=-1) / np.trace(c)))

    late = [] if window.early < UNTOLD else [replace(window, pretrigger=share * window.length, early=FOUND) for share in np.linspace(0.0, REACH, FINE + 1)[1:]]
    best = min([NONE, window, *late], key=off)
    return best if best is NONE or off(best) < off(window) - TELLS else window
