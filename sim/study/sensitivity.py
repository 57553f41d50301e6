"""What a study says of its columns: their spread, which tolerance moves them, and who stands apart.

Sensitivity is by standardised regression coefficients (Saltelli et al., *Global Sensitivity Analysis: The Primer*,
2008, 1.2.5): response and inputs in their standard deviations, least squares on the draws that are there anyway. Over
tolerances of some per cent the answers of a spindle are nearly linear, so the squares of the coefficients share out
the variance, and `r2` says how much of it they explain: near 1 nothing is missing. How much they explain of draws
that they have not seen is told by leaving each out (PRESS: Allen, *Technometrics* 16 (1974) 125); where that is not
clearly above 0 the coefficients fit noise, and none is `clear`. What a linear law misses `sim.study.indices` tells.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from thermospindle.model.types import Array

QUANTILES = (0.025, 0.25, 0.5, 0.75, 0.975)
SPARE = 5  # draws beyond the unknowns of a regression, for its errors to be known at all
CLEAR = 3.0  # standard errors above 0 that a cross-validated r2 must be for coefficients to say anything
BY_CHANCE = 0.01  # probability that any coefficient of a regression of noise is called clear
MAD = 1.4826  # of a normal distribution, its standard deviation over its median absolute deviation
MEAN = 1.2533  # the same over its mean absolute deviation
APART = 3.5  # robust standard deviations (Iglewicz, Hoaglin, *How to Detect and Handle Outliers*, 1993)


@dataclass(frozen=True)
class Spread:
    """Of a number over draws: how many had it, mean, standard deviation, `QUANTILES`."""

    count: int
    mean: float
    sd: float
    quantiles: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Standardised regression coefficients and their standard errors by parameter, the share `r2`
    of the variance that they explain (adjusted for their number), the share `unseen` of that of
    draws left out one by one with its standard error, and the parameters that are `clear`."""

    coefficient: Mapping[str, float]
    sd: Mapping[str, float]
    r2: float
    unseen: float
    unseen_sd: float
    clear: frozenset[str]


def spread(values: Array) -> Spread | None:
    """The spread of the finite values (n,); None where fewer than two are."""
    own = values[np.isfinite(values)]
    if len(own) < 2:
        return None
    q = tuple(float(v) for v in np.quantile(own, QUANTILES))
    return Spread(len(own), float(own.mean()), float(own.std(ddof=1)), q)


def sensitivity(names: Sequence[str], deviations: Array, values: Array) -> Sensitivity | None:
    """Of values (n,) on deviations (n, p); None where they do not vary, or too few are finite to tell p coefficients."""
    known = np.isfinite(values)
    x, y = deviations[known], values[known]
    n, p = x.shape
    if n < p + 1 + SPARE or np.ptp(y) <= 1e-12 * np.abs(y).max() or np.any(x.std(axis=0) == 0):
        return None
    x, y = (x - x.mean(axis=0)) / x.std(axis=0, ddof=1), (y - y.mean()) / y.std(ddof=1)
    inverse = np.linalg.pinv(x.T @ x)
    b = inverse @ x.T @ y
    residual = float(np.sum((y - x @ b) ** 2)) / (n - p - 1)
    error = np.sqrt(residual * np.diag(inverse))
    unseen, unseen_sd = _unseen(y, y - x @ b, 1 / n + np.einsum("ij,jk,ik->i", x, inverse, x))
    least = float(scipy.stats.t.isf(BY_CHANCE / (2 * p), n - p - 1))  # Bonferroni
    clear = frozenset(name for name, value, sd in zip(names, b, error, strict=True) if abs(value) > least * sd and unseen > CLEAR * unseen_sd)
    return Sensitivity(dict(zip(names, b.tolist(), strict=True)), dict(zip(names, error.tolist(), strict=True)), 1 - residual, unseen, unseen_sd, clear)


def _unseen(y: Array, residual: Array, leverage: Array) -> tuple[float, float]:
    """1 - PRESS over the squares of what the mean of the others misses, and its standard error, from residuals and leverages (n,)."""
    n = len(y)
    missed = (residual / np.maximum(1 - leverage, 1e-12)) ** 2
    about = (y * n / (n - 1)) ** 2
    share = 1 - float(missed.sum() / about.sum())
    return share, float(np.sqrt(n) * np.std((1 - share) * about - missed, ddof=1) / about.sum())


def robust_z(values: Array) -> Array:
    """(values - median) / (1.4826 median absolute deviation) of (n,), NaN where not known.

    Where more than half are the same the mean absolute deviation stands for the median one (Iglewicz, Hoaglin); all 0 where none differs.
    """
    known = values[np.isfinite(values)]
    if not len(known):
        return np.full(values.shape, np.nan)
    middle = np.median(known)
    off = np.abs(known - middle)
    scale = MAD * np.median(off) or MEAN * off.mean()
    return np.asarray((values - middle) / scale if scale > 0 else 0.0 * values, float)
