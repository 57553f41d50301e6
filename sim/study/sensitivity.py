"""What a study says of its columns: their spread, which tolerance moves them, and who stands apart.

Sensitivity is by standardised regression coefficients (Saltelli et al., *Global Sensitivity Analysis: The Primer*, 2008, 1.2.5): response and
tolerances in their standard deviations, least squares on the draws that are there anyway. Over tolerances of some per cent the answers of a
spindle are nearly linear, so the squares of the coefficients share out the variance, and `r2` says how much of it they explain: near 1 nothing
is missing. Sobol indices would tell the rest at p + 2 times the runs (20 times for the paper's spindle), and are worth it only where `r2` is low.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from thermospindle.model.types import Array

QUANTILES = (0.025, 0.25, 0.5, 0.75, 0.975)
SPARE = 5  # draws beyond the unknowns of a regression, for its errors to be known at all
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
    """Standardised regression coefficients and their standard errors by parameter, and the share `r2` of the variance they explain
    (adjusted for their number)."""

    coefficient: Mapping[str, float]
    sd: Mapping[str, float]
    r2: float


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
    return Sensitivity(dict(zip(names, b.tolist(), strict=True)), dict(zip(names, error.tolist(), strict=True)), 1 - residual)


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
