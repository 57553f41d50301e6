"""Two poles nearly at one place: whether they have one shape, and how far they can be told apart.

Within their width FRFs tell the terms of a pair badly one by one but well in its moments about a place p between them,

    R_1 / (s - p_1) + R_2 / (s - p_2)  =  S_0 / (s - p) + S_1 / (s - p)^2 + ...,   S_j = (p_1 - p)^j R_1 + (p_2 - p)^j R_2.

Forward and backward whirl have shapes that differ at the points across from the hammer alone, by however little of the
whole: S_1 is not in the direction of S_0. One mode that was not the same at all times has one shape wherever it was.
Where references excite the two differently their residues are known one by one, and the shapes themselves are asked.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.identification.poles import SMOOTH, Fit, Lines, information, inverted, of_shape, terms, varied

ROUNDS = 5
"""Steps towards the factor that makes two vectors most alike."""
COINCIDENT = 1e-6
"""Of their half-width, nearer than which two poles are one."""
PARTED = 8.0
"""Standard errors of its second moment, and of its middle, from which the poles of a pair have errors of first order."""


def near(lines: Lines, poles: ComplexArray) -> NDArray[np.bool_]:
    """(m, m), upper triangle: pairs of poles closer than their half-width or a line."""
    width = np.maximum((poles.real[:, None] + poles.real) / -2, np.diff(lines.s.imag).min())
    return np.triu(np.abs(poles[:, None] - poles) < width, 1)


def one_shape(lines: Lines, fit: Fit, pairs: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which of the pairs (a, a) of imposed poles have one shape: the information criterion has no use for a second."""
    found, n = pairs.copy(), fit.shape.shape[1]
    if n == 1 or not pairs.any():
        return found
    covariance, price = inverted(information(lines, fit)[0]) * fit.scale(), 2 * (n - 1) * np.log(lines.count) * lines.alike
    for i, j in np.argwhere(pairs):
        if abs(fit.poles[i] - fit.poles[j]) > -COINCIDENT * fit.poles[i].real:
            (u, by_u), (v, by_v) = _moments(fit, i, j) if fit.participation.shape[1] == 1 else (_shape(fit, i), _shape(fit, j))
            found[i, j] = _unlike(u, v, by_u, by_v, covariance) < price
    return found


def second_moment(lines: Lines, fit: Fit, i: int, j: int) -> tuple[complex, float]:
    """Central second moment w_1 w_2 (p_1 - p_2)^2 of two poles, w the parts of S_0 that are
    either's, and the standard error of its real and its imaginary part.

    Of equal halves it is (p_1 - p_2)^2 / 4. The error is that of S_2 in units of S_0 with S_0, S_1 and all other residues
    free, and other poles held. Under an exponential window, which the fit does not weigh, an amplitude of t^2 exp(-b t)
    has `alike` (b / (a + 2 d))^5 times the variance, as one of t exp(-b t) has it to the third power (`modal`).
    """
    total, middle = fit.residues[i] + fit.residues[j], (fit.poles[i] + fit.poles[j]) / 2
    w = np.vdot(total, fit.residues[j]) / np.vdot(total, total)
    about, others = np.array([middle]), np.delete(fit.poles, [i, j])
    smooth = fit.basis[:, 2 * len(fit.poles) :][:, : len(SMOOTH)]
    free = np.hstack([terms(lines, others, 1), smooth, terms(lines, about, 1), terms(lines, about, 2)])
    along, across = terms(lines, about, 3).T
    told = np.zeros((2, 2))
    for weight, part in zip(lines.weight.reshape(-1, len(lines.s)), total, strict=True):
        columns = weight[:, None] * np.column_stack([free, part.real * along + part.imag * across, part.real * across - part.imag * along])
        upper = np.linalg.qr(np.vstack([columns.real, columns.imag]))[1][-2:, -2:]
        told += upper.T @ upper
    decay, window = -middle.real, float(lines.s.real[0])
    louder = max(lines.alike * ((decay + window) / (decay + 2 * window)) ** 5, 1.0)
    return complex(w * (1 - w) * (fit.poles[i] - fit.poles[j]) ** 2), float(np.sqrt(louder * np.trace(inverted(told)) / 2 * fit.scale()))


def beyond_first_order(lines: Lines, fit: Fit, i: int, j: int) -> float:
    """Variance, of the real and of the imaginary part of either of two poles, that errors of first
    order lack; none of a pair that is `PARTED`.

    The root of a second moment of hardly more than its error is no Gaussian number. And about a middle that
    is off by e, S_2 is off by 2 e S_1, which nothing but the part q of S_1 across S_0 tells from another
    second moment: e = error |S_0| / (2 |q|), but no more than a pair of that second moment can be wide.
    """
    second, error = second_moment(lines, fit, i, j)
    total, half = fit.residues[i] + fit.residues[j], (fit.poles[i] - fit.poles[j]) / 2
    first = half * (fit.residues[i] - fit.residues[j])
    across = np.linalg.norm(first - np.vdot(total, first) / np.vdot(total, total) * total)
    widest = abs(half) + np.sqrt(abs(second) + error)
    middle = min(error * float(np.linalg.norm(total)) / max(2 * float(across), np.finfo(float).tiny), widest)
    return (error if abs(second) < PARTED * error else 0.0) + (middle**2 if abs(half) < PARTED * middle else 0.0)


def _shape(fit: Fit, r: int) -> tuple[ComplexArray, ComplexArray]:
    """The shape (n,) of an imposed pole, and its derivatives (n, z) by the complex unknowns."""
    n = fit.shape.shape[1]
    by = np.zeros((n, len(varied(fit))), complex)
    by[np.arange(n), of_shape(fit, r)[:n]] = 1
    return fit.shape[r], by


def _moments(fit: Fit, i: int, j: int) -> tuple[tuple[ComplexArray, ComplexArray], tuple[ComplexArray, ComplexArray]]:
    """S_0 and S_1 (n,) of two imposed poles of one reference about their middle, and their
    derivatives (n, z) by the complex unknowns, the middle held."""
    (u, by_u), (v, by_v), middle = _shape(fit, i), _shape(fit, j), (fit.poles[i] + fit.poles[j]) / 2
    by_first = (fit.poles[i] - middle) * by_u + (fit.poles[j] - middle) * by_v
    by_first[:, i] += u
    by_first[:, j] += v
    return (u + v, by_u + by_v), ((fit.poles[i] - middle) * u + (fit.poles[j] - middle) * v, by_first)


def _unlike(u: ComplexArray, v: ComplexArray, by_u: ComplexArray, by_v: ComplexArray, covariance: Array) -> float:
    """Wald's statistic (Trans. Amer. Math. Soc. 54 (1943) 426) of v - c u at the c that makes it
    least, of vectors (n,) with derivatives (n, z) by the unknowns."""
    ways, w = np.array([np.append(u.real, u.imag), np.append(-u.imag, u.real)]).T, np.append(v.real, v.imag)  # what Re c and Im c make of u
    c, told = np.linalg.lstsq(ways, w, rcond=None)[0], np.inf
    for _ in range(ROUNDS):
        by = _real(by_v - complex(*c) * by_u)
        weighed = np.linalg.solve(by @ covariance @ by.T, np.column_stack([ways, w]))
        told = min(told, float((w - ways @ c) @ (weighed[:, 2] - weighed[:, :2] @ c)))
        c = np.linalg.solve(ways.T @ weighed[:, :2], ways.T @ weighed[:, 2])
    return told


def _real(by: ComplexArray) -> Array:
    """Derivatives (n, z) as those of real and imaginary parts (2n, 2z)."""
    return np.block([[by.real, -by.imag], [by.imag, by.real]])
