"""What of the errors is the same at all conditions: a constant error of the frequency and of the
damping of every mode, which `diagnose` grants to any model and `compare` to none.

The residuals r of `compare` are fitted by r = -A b, b the relative errors that every mode has in all tests
alike and A what they do to r (least squares; the whitened residuals know of the temperatures' errors).
What is left is told per degree of freedom, so that offsets which take out noise alone explain nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from thermospindle.diagnosis.compare.compare import TestComparison, rms_residual


@dataclass(frozen=True)
class Constant:
    """`share` of the squares of all errors that constant ones explain, the rms error `without` them
    in standard errors, and the relative error of the frequency of each mode by its number."""

    share: float
    without: float
    frequency: Mapping[int, float]


def constant_errors(tests: Sequence[TestComparison]) -> Constant | None:
    """Constant errors of all modes; None where tests at one condition cannot tell what is constant, or are too few."""
    keys = sorted({key for t in tests for key in t.offsets})
    free = sum(t.count for t in tests) - len(keys)
    if len({(t.test.temperature, t.test.speed) for t in tests if t.count}) < 2 or free < 1 or not keys:
        return None
    residual = np.concatenate([t.residuals for t in tests])
    design = np.vstack([np.stack([t.offsets.get(key, np.zeros(len(t.residuals))) for key in keys], axis=1) for t in tests])
    errors = np.linalg.lstsq(design, residual)[0]
    left = residual - design @ errors
    without = float(np.sqrt(left @ left / free))
    of_frequency = {number: float(e) for (number, part), e in zip(keys, errors, strict=True) if part == 0}
    return Constant(max(0.0, 1 - (without / max(rms_residual(tests), 1e-300)) ** 2), without, of_frequency)
