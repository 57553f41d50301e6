"""The temperature error of a test among the errors of its modes."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from thermospindle.diagnosis.compare.compare import compare
from thermospindle.diagnosis.data.observe import FREQUENCY_FLOOR, Observation
from thermospindle.diagnosis.prediction.modes import predict
from thermospindle.diagnosis.prediction.temperature import temperature_slope, whitened, with_temperature
from thermospindle.model.machine import Condition
from thermospindle.sim.campaign.campaign import Campaign, Test
from thermospindle.sim.campaign.modes import ModeRow
from thermospindle.sim.operating import operating_point


def blank(spindle, temperature):
    """An observation that knows its condition only."""
    test = Test("t", temperature, 0.0)
    filled = {"test": test, "condition": Condition(temperature), "frequency": np.ones(1), "damping": np.ones(1), "covariance": np.eye(2)}
    return Observation(**{name: filled.get(name) for name in Observation.__dataclass_fields__})


@pytest.mark.parametrize("temperature", [20.0, 40.0, 60.0])
def test_slope_is_that_of_the_modes(spindle, temperature):
    """Against a wider central difference of the operating point's own modes (MuJoCo's matrices); axial modes cannot swap."""
    o = blank(spindle, temperature)
    p = predict(spindle, o, ())
    slope = temperature_slope(spindle, o, p, ())
    ends = [operating_point(spindle, Condition(temperature + dt)).modes for dt in (-1.0, 1.0)]
    axial = [[m for m in modes if m.kind == "axial"][:3] for modes in ends]
    expected = [np.log(hot.frequency / cold.frequency) / 2 for cold, hot in zip(*axial, strict=True)]
    found = [slope[i] for i, kind in enumerate(p.kind) if kind == "axial"][:3]
    assert found == pytest.approx(expected, rel=0.05)
    assert found[2] == pytest.approx(expected[2], rel=0.02)
    assert len(slope) == 2 * len(p.frequency)


def squares(difference, covariance):
    left = whitened(difference, covariance)
    return float(left @ left)


def test_squares_are_those_of_the_best_offset():
    """r^T (C + s^2 g g^T)^-1 r = min over x of |r - g x|^2_C + (x / s)^2."""
    random = np.random.default_rng(4)
    r, g, root, sd = random.standard_normal(6), random.standard_normal(6), random.standard_normal((6, 6)), 0.7
    covariance = root @ root.T + 0.1 * np.eye(6)
    wide = squares(r, covariance + sd**2 * np.outer(g, g))
    best = minimize_scalar(lambda x: squares(r - g * x, covariance) + (x / sd) ** 2)
    assert wide == pytest.approx(best.fun, rel=1e-9)
    assert wide < squares(r, covariance)


def test_what_is_not_measured_stays_unknown(spindle):
    o = replace(blank(spindle, 40.0), covariance=np.diag([1.0, np.inf]))
    assert np.array_equal(with_temperature(o, np.array([2.0, 3.0]), 0.5).covariance, np.diag([2.0, np.inf]))


def warmer(spindle, offset):
    """A table of exact modes of a spindle `offset` kelvin warmer than its thermometer says."""
    found = [m for m in operating_point(spindle, Condition(50.0 + offset)).modes if m.frequency < 6000]
    rows = tuple(ModeRow("t", i, m.kind, m.frequency, 1e-3, m.damping_ratio, 1e-6) for i, m in enumerate(found, 1))
    return Campaign("warmer", spindle.name, "mobility", spindle.points, (Test("t", 50.0, 0.0, modes=rows),))


def test_a_thermometer_off_by_its_error_is_one_error_not_eight(spindle):
    """0.2 K too warm: chi2 of the whole test is about 1, that of one standard deviation of one unknown."""
    found = compare(spindle, warmer(spindle, spindle.tolerances.temperature)).tests[0]
    assert found.count == 16
    assert found.squares == pytest.approx(1.0, abs=0.15)
    assert max(abs(m.residual) for m in found.modes) == pytest.approx(1.0, abs=0.15)
    exact = replace(spindle, tolerances=replace(spindle.tolerances, temperature=1e-9))
    alone = compare(exact, warmer(spindle, spindle.tolerances.temperature)).tests[0]
    assert alone.squares > 100
    assert alone.modes[0].sd == pytest.approx(np.hypot(1e-3, FREQUENCY_FLOOR * alone.modes[0].measured), rel=1e-6)


def test_modes_that_move_apart_are_not_excused(spindle):
    """As large an error, with a sign that no temperature gives: the upper lateral mode up, the others down."""
    campaign = warmer(spindle, spindle.tolerances.temperature)
    (test,) = campaign.tests
    first = test.modes[6]
    other = replace(first, frequency=2 * operating_point(spindle, Condition(50.0)).modes[6].frequency - first.frequency)
    modes = tuple(other if m is first else m for m in test.modes)
    assert compare(spindle, replace(campaign, tests=(replace(test, modes=modes),))).tests[0].squares > 30
