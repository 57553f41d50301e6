"""Variance-based sensitivities: which share of a number's variance each input makes by itself, and which with all others (Sobol).

From two independent sets A and B of n draws, and A with input i from B. With f centred and V its
variance over A and B (Saltelli et al., "Variance based sensitivity analysis of model output",
*Computer Physics Communications* 181 (2010) 259, Table 2 (b) and (f), the second from Jansen 1999):

    first order  S_i = mean(f(B) (f(A_i) - f(A))) / V,        total  T_i = mean((f(A) - f(A_i))^2) / (2 V)

S_i is what the variance would lose on average if input i were known, T_i what would be left if all others were. The first
orders of an additive answer add up to 1 and equal the totals; a total above its first order is interaction. Errors are
standard deviations over `RESAMPLED` bootstrap samples of the draws, the same ones for all (Archer, Saltelli, Sobol 1997).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from thermospindle.model.types import Array

RESAMPLED, SEED = 400, 1
LEAST = 8
"""Draws with a finite number in every set, for errors to be known at all."""
CLEAR = 3.0
"""Standard errors that a share must be above 0 for it to be named."""


@dataclass(frozen=True)
class Index:
    """First order and total of one input, and their standard errors."""

    first: float
    first_sd: float
    total: float
    total_sd: float

    @property
    def clear(self) -> bool:
        """Whether the input is known to matter; a total is never below 0, and its error is small
        where it is, so that it has to be a share as well."""
        return self.total > max(CLEAR * self.total_sd, 0.01)


@dataclass(frozen=True, eq=False)
class Indices:
    """Of one number: by input, from `draws` draws that had it in every set."""

    draws: int
    of: Mapping[str, Index]


def indices(names: Sequence[str], a: Array, b: Array, mixed: Array) -> Indices | None:
    """Of values (n,) of the sets A and B, and (inputs, n) of A with one input from B each; None
    where they do not vary or too few are finite."""
    known = np.isfinite(a) & np.isfinite(b) & np.isfinite(mixed).all(axis=0)
    a, b, mixed = a[known], b[known], mixed[:, known]
    n = len(a)
    both = np.append(a, b)
    if n < LEAST or np.ptp(both) <= 1e-12 * np.abs(both).max():
        return None
    scale = np.std(both)
    a, b, mixed = ((v - both.mean()) / scale for v in (a, b, mixed))
    first, total = _shares(np.ones((1, n)), a, b, mixed)
    picks = np.random.default_rng(SEED).integers(n, size=(RESAMPLED, n))
    weight = np.zeros((RESAMPLED, n))
    np.add.at(weight, (np.arange(RESAMPLED)[:, None], picks), 1.0)
    firsts, totals = _shares(weight, a, b, mixed)
    columns = (first[0], firsts.std(axis=0, ddof=1), total[0], totals.std(axis=0, ddof=1))
    return Indices(n, {name: Index(*(float(c[i]) for c in columns)) for i, name in enumerate(names)})


def _shares(weight: Array, a: Array, b: Array, mixed: Array) -> tuple[Array, Array]:
    """First orders and totals (samples, inputs) of draws that count `weight` (samples, n) times."""
    n = weight.sum(axis=1, keepdims=True)
    mean = weight @ (a + b)[:, None] / (2 * n)
    variance = weight @ (a**2 + b**2)[:, None] / (2 * n) - mean**2
    step = mixed - a
    first = weight @ (b * step).T - mean * (weight @ step.T)
    return first / n / variance, weight @ (step**2).T / (2 * n) / variance
