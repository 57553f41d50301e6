"""Derivatives by tolerances against differences of the whole model."""

import numpy as np
import pytest

from tests.diagnosis.hidden_modes import hidden, theory_of
from thermospindle.diagnosis.prediction.sensitivity import derivative
from thermospindle.sim.effects import by_name


@pytest.mark.parametrize("name", [None, "shaft_bending", "channel_delay", "window_damping", "thermal_gradient", "added_disk"])
def test_derivatives_are_those_of_the_features(spindle, name):
    """To 1e-4 of the largest change by one standard deviation, away from the nominal spindle, with effects on every step of the chain."""
    effects = [] if name is None else [(by_name(name), by_name(name).typical())]
    about = theory_of(spindle, hidden(spindle, effects, 11))
    x = 0.7 * about.sd * np.random.default_rng(3).standard_normal(len(about.sd))
    found = derivative(about, x, effects) * about.sd
    columns = []
    for i, sd in enumerate(about.sd):
        step = np.zeros(len(x))
        step[i] = 0.02 * sd
        columns.append((about.features(x + step, effects) - about.features(x - step, effects)) / 0.04)
    expected = np.array(columns).T
    assert np.abs(expected).max() > 0.01
    np.testing.assert_allclose(found, expected, atol=1e-4 * np.abs(expected).max())


def test_a_late_linear_model_is_measured_anew(spindle):
    """An effect of the measuring chain changes nothing else: the features are those of a theory that has not seen this state before."""
    observations = hidden(spindle, [], 1)
    warm, cold = theory_of(spindle, observations), theory_of(spindle, observations)
    x = 0.3 * warm.sd
    lag, late = by_name("soak_lag"), by_name("channel_delay")
    for effects in (
        [],
        [(late, late.typical())],
        [(lag, lag.typical())],
        [(lag, lag.typical()), (late, late.typical())],
        [(lag, lag.neutral())],
    ):
        warm.features(x, effects)
        assert np.array_equal(warm.features(x, effects), theory_of(spindle, observations).features(x, effects))
    assert not np.array_equal(warm.features(x), cold.features(x, [(late, late.typical())]))
