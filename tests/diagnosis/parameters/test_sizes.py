"""The likeliest sizes of discrepancies, of ln evidence made by hand."""

from __future__ import annotations

import numpy as np
import pytest

from thermospindle.diagnosis.parameters.nuisance import DRIFT, STIFFNESS, STIFFNESS_DRIFT
from thermospindle.diagnosis.parameters.sizes import GRIDS, likeliest

KINDS = (STIFFNESS, STIFFNESS_DRIFT, DRIFT)


def hill(size: float, top: float) -> float:
    """One at the `top`, nothing three times off."""
    return float(np.exp(-2 * np.log(max(size, 1e-9) / top) ** 2))


@pytest.mark.parametrize("constant", [True, False])
def test_errors_that_could_be_constant_or_drift_are_the_likelier(constant):
    """Either alone is likely, one much more, and what is found on the way to the other leads
    nowhere by a step of one size: 38 in ln evidence below, of a stranger's grinding spindle."""
    lower, higher = 10.0, 48.0

    def each(s: float, sizes) -> np.ndarray:
        c, d = sizes[STIFFNESS], sizes[STIFFNESS_DRIFT]
        by_constant, by_drift = hill(c, 1e-4) * (d <= 3e-5), hill(d, 3e-4) * (c == 0.0)
        told = (higher, lower) if constant else (lower, higher)
        return np.array([told[0] * by_constant + told[1] * by_drift + hill(sizes[DRIFT], 1e-3) - abs(np.log(s))])

    values, errors, sizes = likeliest(each, {kind: GRIDS[kind] for kind in KINDS}, [0.5, 1.0, 2.0])
    assert values[0] == pytest.approx(higher + 1.0, abs=0.1)
    assert errors == 1.0
    assert (sizes[STIFFNESS] > 0, sizes[STIFFNESS_DRIFT] > 3e-5) == (constant, not constant)
    assert sizes[DRIFT] == pytest.approx(1e-3)
