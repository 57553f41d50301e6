"""Constant errors of modes, by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from thermospindle.diagnosis.compare.constant import constant_errors


def row(temperature, *residuals):
    """Of one mode, whose frequency off by e moves each residual by -100 e."""
    r, test = np.array(residuals), SimpleNamespace(temperature=temperature, speed=0.0)
    return SimpleNamespace(test=test, residuals=r, squares=float(r @ r), count=len(r), offsets={(1, 0): np.full(len(r), -100.0)})


def test_share_and_rest_by_hand():
    """Residuals 3 and 1 about their mean 2: 1 + 1 are left for 2 - 1 degrees of freedom, of mean
    squares (9 + 1) / 2; 1 - 2 / 5 is explained."""
    found = constant_errors([row(20.0, 3.0), row(60.0, 1.0)])
    assert found.share == pytest.approx(0.6)
    assert found.without == pytest.approx(np.sqrt(2))
    assert found.frequency == pytest.approx({1: -0.02})
