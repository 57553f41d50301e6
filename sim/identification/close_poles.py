"""Two poles nearly at one place: whether they have one shape, and how far they can be told apart.

Within their width FRFs tell the terms of a pair badly one by one but well in its moments about a place p between them,

    z_1 / (s - p_1) + z_2 / (s - p_2)  =  S_0 / (s - p) + S_1 / (s - p)^2 + ...,   S_j = (p_1 - p)^j z_1 + (p_2 - p)^j z_2.

Forward and backward whirl have shapes z that differ at the points across from the hammer alone, by however little of the whole: S_1 is not in the direction of S_0. One mode that
was not the same at all times has one shape wherever it was. With references that excite the two differently the residue matrices are known one by one, and the shapes themselves are asked.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.identification.poles import SMOOTH, Fit, Lines, information, inverted, of_shape, terms, varied

ROUNDS = 5
"""Steps towards the factor that makes two vectors most alike."""
PARTED = 6.0
"""Standard errors of the second moment of a pair from which its root, half the distance of the two, is known like a Gaussian number."""


def near(lines: Lines, poles: ComplexArray) -> NDArray[np.bool_]:
    """(m, m), upper triangle: pairs of poles closer than their half-width or a line."""
    width = np.maximum((poles.real[:, None] + poles.real) / -2, np.diff(lines.s.imag).min())
    return np.triu(np.abs(poles[:, None] - poles) < width, 1)


def one_shape(lines: Lines, fit: Fit, pairs: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which of the pairs (a, a) of imposed poles have one shape: the information criterion has no use for a second."""
    found, n = pairs.copy(), fit.shape.shape[1]
    price = 2 * (n - 1) * np.log(lines.count) * lines.alike
    if n == 1 or not pairs.any():
        return found
    covariance = covariance_of(lines, fit)
    for i, j in np.argwhere(pairs):
        (u, by_u), (v, by_v) = _moments(fit, i, j) if fit.participation.shape[1] == 1 else (_shape(fit, i), _shape(fit, j))
        found[i, j] = _unlike(u, v, by_u, by_v, covariance) < price
    return found


def second_moment(lines: Lines, fit: Fit, i: int, j: int) -> tuple[complex, float]:
    """w_1 w_2 (p_1 - p_2)^2, w the parts of S_0 that are either's, of imposed poles of one reference: the square of half their distance, where they are equally strong. And the standard error of
    its real and its imaginary part where S_0 and S_1 are free and S_2 is so many times S_0: of a pair so close that nothing of higher order is seen, and up to three times too small for one that is
    as far apart as a half-width, where it is far from being needed."""
    total, middle = fit.shape[i] + fit.shape[j], (fit.poles[i] + fit.poles[j]) / 2
    w = np.vdot(total, fit.shape[j]) / np.vdot(total, total)
    about, others = np.array([middle]), np.delete(fit.poles, [i, j])
    smooth = fit.basis[:, 2 * len(fit.poles) :][:, : len(SMOOTH)]
    free = np.hstack([terms(lines, others, 1), smooth, terms(lines, about, 1), terms(lines, about, 2)])
    along, across = terms(lines, about, 3).T
    told = np.zeros((2, 2))
    for weight, part in zip(lines.weight.reshape(-1, len(lines.s)), total, strict=True):
        columns = weight[:, None] * np.column_stack([free, part.real * along + part.imag * across, part.real * across - part.imag * along])
        upper = np.linalg.qr(np.vstack([columns.real, columns.imag]))[1][-2:, -2:]
        told += upper.T @ upper
    error = np.sqrt(np.trace(inverted(told)) / 2 * fit.scale())
    return complex(w * (1 - w) * (fit.poles[i] - fit.poles[j]) ** 2), float(error)


def covariance_of(lines: Lines, fit: Fit) -> Array:
    """That of the [Re z, Im z] of `information`."""
    return inverted(information(lines, fit)[0]) * fit.scale()


def _shape(fit: Fit, r: int) -> tuple[ComplexArray, ComplexArray]:
    """The shape (n,) of an imposed pole, and its derivatives (n, z) by the complex unknowns."""
    n = fit.shape.shape[1]
    by = np.zeros((n, len(varied(fit))), complex)
    by[np.arange(n), of_shape(fit, r)[:n]] = 1
    return fit.shape[r], by


def _moments(fit: Fit, i: int, j: int) -> tuple[tuple[ComplexArray, ComplexArray], tuple[ComplexArray, ComplexArray]]:
    """S_0 and S_1 (n,) of two poles about the place between them, and their derivatives (n, z) by the complex unknowns."""
    (u, by_u), (v, by_v), middle = _shape(fit, i), _shape(fit, j), (fit.poles[i] + fit.poles[j]) / 2
    by_first = (fit.poles[i] - middle) * by_u + (fit.poles[j] - middle) * by_v
    by_first[:, i] += u
    by_first[:, j] += v
    return (u + v, by_u + by_v), ((fit.poles[i] - middle) * u + (fit.poles[j] - middle) * v, by_first)


def _unlike(u: ComplexArray, v: ComplexArray, by_u: ComplexArray, by_v: ComplexArray, covariance: Array) -> float:
    """Wald's statistic (Trans. Amer. Math. Soc. 54 (1943) 426) of v - c u at the c that makes it least, of vectors (n,) with derivatives (n, z) by the unknowns."""
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
