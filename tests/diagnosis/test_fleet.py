"""Rows of a fleet, by hand."""

from types import SimpleNamespace

import pytest

from thermospindle.diagnosis.compare.compare import PairedMode
from thermospindle.diagnosis.fleet import _compared


def mode(number, measured, computed, damping=None):
    return PairedMode(number, "axial", measured, computed, 2.0, damping, 0.02, None, 1.0, False)


def test_errors_of_a_mode_are_means_of_its_tests_in_per_cent():
    """10 Hz of 1000 and -100 of 2000 are 1 and -5 %; a damping ratio of 0.02 computed is as large
    as one measured, and a quarter larger than another."""
    first = SimpleNamespace(modes=(mode(1, 1000.0, 1010.0, 0.02), mode(3, 400.0, 402.0)), missing=(5.0,), extra=())
    second = SimpleNamespace(modes=(mode(1, 2000.0, 1900.0, 0.016),), missing=(), extra=(6.0, 7.0))
    row = _compared(SimpleNamespace(tests=(first, second), rms_residual=float("inf")))
    assert row["mode"] == [1, 3]
    assert row["frequency_error_percent"] == pytest.approx([-2.0, 0.5])
    assert row["damping_error_percent"] == [pytest.approx(12.5), None]
    assert row["worst_residual"] == 50.0
    assert [row[k] for k in ("rms_residual", "tests", "modes", "missing", "extra")] == [None, 2, 3, 1, 2]
