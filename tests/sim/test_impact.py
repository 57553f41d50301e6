"""The virtual impact test: pulse, time simulation against exact FRFs, estimators, standard errors, windows."""

from dataclasses import replace

import numpy as np
import pytest

from model.machine import Condition
from model.modes import frf, point_rows
from model.scene import BadInput
from sim.hammer import Hit, draw_hits, force, pulse_duration
from sim.impact import estimate_of, impact_tests, sampling
from sim.operating import operating_point

SPIN = 7200 * np.pi / 30


def exact_frf(test, window_decay=0.0):
    point = test.point
    rows, hammers = point_rows(point.spindle, point.chain), point_rows(point.spindle, point.chain, test.settings.hammer_nodes)
    return frf(point.linear, rows, hammers, test.estimate.h1.frequency - 1j * window_decay / (2 * np.pi), "mobility")


def error(test, against):
    """Largest over the lines of the rms error of all FRFs of a hammer, relative to their rms there."""
    difference = np.mean(np.abs(test.estimate.h1.value - against) ** 2, axis=0)
    return float(np.sqrt(difference / np.mean(np.abs(against) ** 2, axis=0)).max())


@pytest.fixture(scope="module")
def quick(spindle):
    return replace(spindle.hammer, hits=1)


def test_impulse_and_duration_of_a_pulse(spindle):
    """A half sine carries 2 F T / pi; T = pi sqrt(m / k): a mass bouncing on a spring."""
    test = spindle.hammer
    duration = pulse_duration(test)
    assert duration == pytest.approx(np.pi * np.sqrt(2e-3 / 6e6))
    held = force(Hit(((2e-3, 20.0),), duration), test.step, 1000)
    assert held.sum() * test.step == pytest.approx(2 * 20.0 * duration / np.pi, rel=1e-12)
    assert held.max() < 20.0
    assert np.count_nonzero(held) == pytest.approx(duration / test.step, abs=2)


def test_double_hits_happen_as_often_as_said(spindle):
    often = replace(spindle.hammer, hits=400, double_hit_probability=0.25)
    hits = draw_hits(often, np.random.default_rng(3))
    doubles = sum(len(h.pulses) == 2 for h in hits)
    assert doubles == pytest.approx(100, abs=4 * np.sqrt(400 * 0.25 * 0.75))
    levels = np.array([h.pulses[0][1] for h in hits])
    assert levels.std() / levels.mean() == pytest.approx(spindle.hammer.level_scatter, rel=0.15)


CONDITIONS = [(20.0, 0.0), (60.0, SPIN)]


@pytest.mark.parametrize(("temperature", "speed"), CONDITIONS, ids=["20C-rest", "60C-7200rpm"])
def test_frf_against_the_linear_model(spindle, quick, temperature, speed):
    """Time simulation, filter, sampling and H1 without noise: at most 1 % of the exact FRF over 400-3000 Hz; here 0.2 %."""
    test = impact_tests([operating_point(spindle, Condition(temperature, speed))], quick, noise=False)[0]
    assert test.estimate.h1.frequency[[0, -1]] == pytest.approx([400, 3000], abs=4)
    assert error(test, exact_frf(test)) < 2e-3


def test_ball_by_ball_at_a_low_level_is_linear(spindle, quick):
    """In the limit of a light tap the ball-by-ball model has the FRF of the linear one."""
    gentle = replace(quick, level=0.02)
    test = impact_tests([operating_point(spindle, Condition(20.0))], gentle, element="ball-by-ball", noise=False)[0]
    assert error(test, exact_frf(test)) < 3e-3


def test_exponential_window_only_shifts_the_axis(spindle, quick):
    """Windowed force and response give the exact FRF at i omega + decay."""
    windowed = replace(quick, exponential_end=0.05)
    test = impact_tests([operating_point(spindle, Condition(20.0))], windowed, noise=False)[0]
    assert test.estimate.window_decay == pytest.approx(-np.log(0.05) / 0.3)
    assert error(test, exact_frf(test, test.estimate.window_decay)) < 2e-3
    assert error(test, exact_frf(test)) > 0.05


def test_double_hits_cost_no_accuracy(spindle, quick):
    """A rebound inside the record is part of the force; H1 does not mind."""
    twice = replace(quick, double_hit_probability=1.0)
    test = impact_tests([operating_point(spindle, Condition(20.0))], twice, noise=False)[0]
    assert np.sum(np.diff((test.record.force[0, 0] > 0.05 * twice.level).astype(int)) > 0) == 2
    assert error(test, exact_frf(test)) < 3e-3


def test_standard_errors_come_true(spindle):
    """Noise added anew to one noiseless record: mean squared error over stated variance is one, FRF by FRF."""
    point = operating_point(spindle, Condition(20.0))
    clean = impact_tests([point], replace(spindle.hammer, hits=3), noise=False)[0]
    exact = clean.estimate.h1.value
    random = np.random.default_rng(5)
    ratios, coherence = [], []
    for _ in range(12):
        noisy = replace(
            clean.record,
            force=clean.record.force + 1e-3 * clean.settings.level * random.standard_normal(clean.record.force.shape),
            velocity=clean.record.velocity + 1e-6 * clean.settings.level * random.standard_normal(clean.record.velocity.shape),
        )
        estimate = estimate_of(clean.settings, point, noisy)
        ratios.append(np.mean(np.abs(estimate.h1.value - exact) ** 2 / estimate.h1.sd**2, axis=2))
        coherence.append(np.median(estimate.h1.coherence))
    assert np.mean(ratios, axis=0) == pytest.approx(1.0, abs=0.25)
    assert 0.5 < np.mean(coherence) < 1.0


def test_h2_differs_from_h1_by_the_coherence(spindle):
    test = impact_tests([operating_point(spindle, Condition(20.0))], replace(spindle.hammer, record_length=0.1))[0]
    h1 = test.estimate.h1
    assert test.estimate.h2 * h1.coherence == pytest.approx(h1.value, rel=1e-6)
    assert test.estimate.per_hit.shape == (2, 7, 2, len(h1.frequency))


def test_one_hit_has_no_scatter(spindle, quick):
    test = impact_tests([operating_point(spindle, Condition(20.0))], replace(quick, record_length=0.05))[0]
    assert np.all(np.isinf(test.estimate.h1.sd))


def test_same_seed_same_test(spindle):
    short = replace(spindle.hammer, record_length=0.05)
    point = operating_point(spindle, Condition(20.0))
    first, again, other = (impact_tests([point], short, seed=s)[0].estimate.h1.value for s in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_step_must_divide_the_sampling_interval(spindle):
    with pytest.raises(BadInput, match="must divide"):
        sampling(replace(spindle.hammer, step=7e-6))


def test_an_unstable_step_is_refused(spindle, quick):
    """RK4's limit of the stiffest mode (56 kHz): 2.7 over the pole, 7.6 us."""
    point = operating_point(spindle, Condition(20.0))
    with pytest.raises(BadInput, match=r"step_us = 20: .* at most 7\.\d+ us"):
        impact_tests([point], replace(quick, step=2e-5))
