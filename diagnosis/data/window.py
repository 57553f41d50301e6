"""Noise under an exponential window: neighbouring lines are correlated, so that their scatter says less than all of it.

Noise that is white in time and then multiplied by e^(-d t) has, between lines of the transform m apart, the correlation
2 d T / (2 d T + 2 pi i m) with T the record's length (the transform of the squared window: Harris, *Proc. IEEE* 66 (1978) 51). What is smooth over
lines is early in time, where the window has taken nothing: there the noise is up to 2 d T / (1 - e^(-2 d T)) times the lines' own variance, and
what differs from line to line has less.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from thermospindle.model.types import Array, ComplexArray

LEAST = 0.2  # d T, from which a window is worth a question
PIECE, DEGREES = 24, 9  # lines and polynomials of the pieces whose scatter tells whether noise is windowed


@lru_cache(maxsize=512)
def correlation(lines: int, damped: float) -> ComplexArray:
    """Correlation (lines, lines) of noise under a window with d T = `damped`; the identity for 0. Read only."""
    apart = np.subtract.outer(np.arange(lines), np.arange(lines))
    found = np.eye(lines).astype(complex) if damped == 0.0 else 2 * damped / (2 * damped + 2j * np.pi * apart)
    found.flags.writeable = False
    return found


def left_by(basis: Array, damped: float) -> tuple[Array, float, float]:
    """For noise of unit variance a line and orthonormal polynomials `basis` (k, p): variances (p,) of its coefficients, and the mean and the
    variance of the sum of squares that the polynomials leave."""
    k, p = basis.shape
    if damped == 0.0:
        return np.ones(p), float(k - p), float(k - p)
    c = correlation(k, damped)
    rest = c - basis @ (basis.T @ c)
    return np.einsum("ip,ij,jp->p", basis, c, basis).real, float(np.trace(rest).real), float(np.einsum("ij,ji->", rest, rest).real)


def neighbours(damped: float) -> float:
    """Variance of a line less the mean of its neighbours, over that of white noise."""
    weights = np.array([-0.5, 1.0, -0.5])
    return float((weights @ correlation(3, damped) @ weights).real / 1.5)


def windowed(value: ComplexArray, damped: float) -> bool:
    """Whether the scatter of FRFs (..., n) is that of windowed noise rather than of noise that is new in every line.

    From the correlation of neighbouring lines in what polynomials over short pieces leave, the median over pieces.
    """
    if damped < LEAST or value.shape[-1] < PIECE:
        return False
    x = np.linspace(-1, 1, PIECE)
    basis = np.linalg.qr(np.polynomial.legendre.legvander(x, DEGREES - 1))[0]
    pieces = value[..., : value.shape[-1] // PIECE * PIECE].reshape(-1, PIECE)
    left = pieces - (pieces @ basis) @ basis.T
    square = np.sum(np.abs(left) ** 2, axis=1)
    seen = np.sum(left[:, 1:] * left[:, :-1].conj(), axis=1)[square > 0] / square[square > 0]
    if not len(seen):
        return False
    middle = complex(np.median(seen.real), np.median(seen.imag))

    def expected(d: float) -> complex:
        across = np.eye(PIECE) - basis @ basis.T
        c = across @ correlation(PIECE, d) @ across
        return complex(np.trace(c, offset=-1) / np.trace(c))

    return abs(middle - expected(damped)) < abs(middle - expected(0.0))
