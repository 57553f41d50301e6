"""Shapes over conditions: each is recognised where it is, and noise is taken for none."""

import numpy as np
import pytest

from thermospindle.diagnosis.misfit.patterns import choose_for, f_test, shapes
from thermospindle.model.machine import Condition

STATIC = [Condition(t) for t in (20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0)]
BOTH_WAYS = [Condition(t, s) for t in (20.0, 40.0, 60.0) for s in (-700.0, -350.0, 0.0, 350.0, 700.0)]
LEVELS = [Condition(t, 0.0, level) for t in (20.0, 40.0, 60.0) for level in (1.0, 3.0, 9.0)]
SD = 0.01


def values(conditions, law, seed=1):
    """A law of the condition, with errors of `SD`."""
    return np.array([law(c) for c in conditions]) + SD * np.random.default_rng(seed).standard_normal(len(conditions))


LAWS = [
    pytest.param(STATIC, lambda c: 0.3, "constant", id="constant"),
    pytest.param(STATIC, lambda c: 0.01 * c.temperature, "linear in temperature", id="linear"),
    pytest.param(STATIC, lambda c: 3e-4 * (c.temperature - 20) ** 2, "curved in temperature", id="curved"),
    pytest.param(STATIC, lambda c: -0.5 * (c.temperature > 45), "step in temperature between 40 and 50 C", id="step"),
    pytest.param(BOTH_WAYS, lambda c: 1e-3 * c.speed, "odd in speed", id="odd"),
    pytest.param(BOTH_WAYS, lambda c: 2e-6 * c.speed**2, "even in speed", id="even"),
    pytest.param(BOTH_WAYS, lambda c: 0.01 * c.temperature + 1e-3 * c.speed, "linear in temperature and odd in speed", id="two"),
    pytest.param([c for c in BOTH_WAYS if c.speed >= 0], lambda c: 2e-6 * c.speed**2, "speed", id="one way only"),
    pytest.param(LEVELS, lambda c: 0.1 * c.level, "level", id="level"),
]


@pytest.mark.parametrize(("conditions", "law", "name"), LAWS)
def test_a_law_is_recognised(conditions, law, name):
    found = choose_for(conditions, values(conditions, law), SD**2 * np.eye(len(conditions)))
    assert found.shape.name == name
    if name != "constant":
        assert found.explains > 0.98
        assert found.criterion["constant"] > 10
    smooth = found.shape.basis @ found.coefficients
    assert smooth == pytest.approx([law(c) for c in conditions], abs=4 * SD)


@pytest.mark.parametrize("conditions", [STATIC, BOTH_WAYS, LEVELS], ids=["static", "both ways", "levels"])
def test_noise_is_constant(conditions):
    """At most a few of 300 by chance; the errors are as large as stated."""
    found = [choose_for(conditions, values(conditions, lambda c: 0.2, seed), SD**2 * np.eye(len(conditions))) for seed in range(300)]
    assert sum(f.shape.name != "constant" for f in found) <= 6


def test_errors_smaller_than_stated_are_used_only_where_allowed():
    """A clean line under errors ten times too large: hidden at a floor of one, seen where errors had been enlarged by ten."""
    y = values(STATIC, lambda c: 5e-3 * c.temperature)
    wide = (10 * SD) ** 2 * np.eye(len(STATIC))
    assert choose_for(STATIC, y, wide).shape.name == "constant"
    assert choose_for(STATIC, y, wide, floor=0.01).shape.name == "linear in temperature"


def test_correlated_errors_hide_a_constant_not_a_slope():
    """An error that all conditions share moves the constant; differences stay as sharp as before."""
    common = SD**2 * np.eye(len(STATIC)) + 1.0
    found = choose_for(STATIC, values(STATIC, lambda c: 5.0 + 0.005 * c.temperature), common)
    assert found.shape.name == "linear in temperature"


def test_shapes_that_cannot_be_told_are_not_offered():
    two = [Condition(20.0), Condition(60.0)]
    assert [s.name for s in shapes(two)] == ["constant", "linear in temperature"]
    assert [s.name for s in shapes([Condition(20.0)])] == ["constant"]
    hot_when_running = [Condition(20.0), Condition(60.0, 700.0)]  # temperature and speed go together
    assert [s.name for s in shapes(hot_when_running)] == ["constant", "speed", "linear in temperature"]


def test_f_of_a_straight_line():
    """Against the textbook's formula: F = (SS of regression / 1) / (SS of residuals / (n - 2))."""
    x, y = np.arange(6.0), np.array([1.1, 1.9, 3.2, 3.8, 5.1, 5.9])
    slope, intercept = np.polyfit(x, y, 1)
    left, total = np.sum((y - slope * x - intercept) ** 2), np.sum((y - y.mean()) ** 2)
    f, p = f_test((total, 1), (left, 2), 6, floor=0.0)
    r = np.corrcoef(x, y)[0, 1]
    assert f == pytest.approx(r**2 * 4 / (1 - r**2))
    assert p < 1e-4
    assert f_test((total, 1), (left, 2), 2) == (0.0, 1.0)
