"""The virtual impact test: pulse, time simulation against exact FRFs, estimators, standard errors, windows."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.frf import frf, point_rows
from thermospindle.sim.hammer.estimate import Windows, estimate
from thermospindle.sim.hammer.pulse import Hit, draw_hits, force, pulse_duration
from thermospindle.sim.hammer.test import acquire, estimate_of, impact_tests, sampling, simulate
from thermospindle.sim.operating import operating_point
from thermospindle.sim.run import run

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


CONDITIONS = [(20.0, 0.0, 0), (60.0, SPIN, 1)]


CLOSE = 1e-4
"""Largest error of an FRF without noise, of its rms at a line: here 6e-5, of which the images of the held force are a tenth."""

DASHPOT = """<mujoco><option gravity="0 0 0" integrator="RK4" timestep="{step}"/><worldbody><body><joint name="x" type="slide" axis="1 0 0" damping="2"/>
<geom size="0.01" mass="0.02"/></body></worldbody><tendon><fixed name="point1"><joint joint="x" coef="1"/></fixed></tendon>
<actuator><motor name="hammer1" tendon="point1"/></actuator><sensor><tendonvel tendon="point1"/></sensor><keyframe><key name="loaded"/></keyframe></mujoco>"""


def test_what_images_of_the_held_force_leave(spindle):
    """A mass (and a weak dashpot) has the mobility 1 / (m s + c). Held over a step h and with the mean velocity
    over the same its FRF is y^3 cos y / sin^3 y times that of the mass, y = pi f h: the sum of 1 / (x + k)^3 over
    the images k, whose leading term is -y^4 / 15. Velocity read once a step had + y^2 / 3, a hundred times as much."""
    for step in (20e-6, 10e-6):
        test = replace(spindle.hammer, step=step, hits=1, hammer_nodes=(1,))
        every, steps = sampling(test)
        model = mujoco.MjModel.from_xml_string(DASHPOT.format(step=step))
        [(held, velocity)] = simulate([model], test, [[draw_hits(test, np.random.default_rng(0))]], steps)
        record = acquire(test, held, velocity, every, None)
        frf = estimate(record.time, record.force, record.velocity, Windows(2e-3, 0.0), (2000.0, 6000.0), (1,), (1,)).h1
        exact, y = 1 / (2j * np.pi * frf.frequency * 0.02 + 2.0), np.pi * frf.frequency * step
        left = y**3 * np.cos(y) / np.sin(y) ** 3 - 1
        assert np.abs(frf.value[0, 0] / exact - 1 - left).max() < 0.02 * np.abs(left).max()
        assert np.abs(left).max() == pytest.approx(y[-1] ** 4 / 15, rel=0.2)


@pytest.mark.parametrize(("temperature", "speed", "hammer"), [pytest.param(*CONDITIONS[0], id="20C-rest", marks=pytest.mark.slow), pytest.param(*CONDITIONS[1], id="60C-7200rpm")])
def test_frf_against_the_linear_model(spindle, quick, temperature, speed, hammer):
    """Time simulation, filter, sampling and H1 without noise are the exact FRF over 400-6000 Hz."""
    one = replace(quick, hammer_nodes=quick.hammer_nodes[hammer:][:1])
    test = impact_tests([operating_point(spindle, Condition(temperature, speed))], one, noise=False)[0]
    assert test.estimate.h1.frequency[[0, -1]] == pytest.approx([400, 6000], abs=4)
    assert error(test, exact_frf(test)) < CLOSE


@pytest.mark.slow
def test_ball_by_ball_at_a_low_level_is_linear(spindle, quick):
    """In the limit of a light tap the ball-by-ball model has the FRF of the linear one."""
    gentle = replace(quick, level=0.02, hammer_nodes=quick.hammer_nodes[:1])
    test = impact_tests([operating_point(spindle, Condition(20.0))], gentle, element="ball-by-ball", noise=False)[0]
    assert error(test, exact_frf(test)) < 3e-3


def test_exponential_window_only_shifts_the_axis(spindle, quick):
    """Windowed force and response give the exact FRF at i omega + decay."""
    windowed = replace(quick, exponential_end=0.05, hammer_nodes=quick.hammer_nodes[:1])
    test = impact_tests([operating_point(spindle, Condition(20.0))], windowed, noise=False)[0]
    assert test.estimate.window_decay == pytest.approx(-np.log(0.05) / 0.3)
    assert error(test, exact_frf(test, test.estimate.window_decay)) < CLOSE
    assert error(test, exact_frf(test)) > 0.05


def test_double_hits_cost_no_accuracy(spindle, quick):
    """A rebound inside the record is part of the force; H1 does not mind."""
    twice = replace(quick, double_hit_probability=1.0, hammer_nodes=quick.hammer_nodes[:1])
    test = impact_tests([operating_point(spindle, Condition(20.0))], twice, noise=False)[0]
    assert np.sum(np.diff((test.record.force[0, 0] > 0.15 * twice.level).astype(int)) > 0) == 2
    assert error(test, exact_frf(test)) < 3e-3


@pytest.mark.slow
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
    test = impact_tests([operating_point(spindle, Condition(20.0))], replace(spindle.hammer, hits=2, record_length=0.05))[0]
    h1 = test.estimate.h1
    assert test.estimate.h2 * h1.coherence == pytest.approx(h1.value, rel=1e-6)
    assert test.estimate.per_hit.shape == (2, 7, 2, len(h1.frequency))


def test_one_hit_has_no_scatter(spindle, quick):
    test = impact_tests([operating_point(spindle, Condition(20.0))], replace(quick, record_length=0.05))[0]
    assert np.all(np.isinf(test.estimate.h1.sd))
    assert test.estimate.h1.coherence is None, "1 on every line whatever the noise"


def test_same_seed_same_test(spindle, quick):
    short = replace(quick, record_length=0.05, hammer_nodes=quick.hammer_nodes[:1])
    point = operating_point(spindle, Condition(20.0))
    first, again, other = (impact_tests([point], short, seed=s)[0].estimate.h1.value for s in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_step_must_divide_the_sampling_interval(spindle):
    with pytest.raises(BadInput, match="must divide"):
        sampling(replace(spindle.hammer, step=7e-6))


def test_an_unstable_step_is_refused(spindle, quick):
    """RK4's limit of the stiffest mode (31.8 kHz): 2.7 over the pole, 13.5 us."""
    point = operating_point(spindle, Condition(20.0))
    with pytest.raises(BadInput, match=r"step_us = 20: .* at most 13\.\d+ us"):
        impact_tests([point], replace(quick, step=2e-5))


@pytest.mark.parametrize("contact", [0.25e-3, 0.6e-3], ids=["hard tip", "soft tip"])
def test_standard_errors_under_noise_in_proportion(contact):
    """White noise and noise in proportion to each line, and a force that a soft tip makes fall by ten over the band: errors come true."""
    random, n, rate, hits, tries = np.random.default_rng(3), 2000, 10000.0, 4, 60
    time = np.arange(n) / rate
    force = np.where(time < contact + 2e-3, np.maximum(np.sin(np.pi * (time - 2e-3) / contact), 0.0), 0.0) * (time >= 2e-3)
    frequency = np.fft.rfftfreq(n, 1 / rate)
    s = 2j * np.pi * frequency
    true = s / (s**2 + 2 * 0.05 * 2 * np.pi * 600 * s + (2 * np.pi * 600) ** 2)
    clean = true * np.fft.rfft(force)
    size = np.sqrt((0.03 * np.abs(clean)) ** 2 + (0.002 * np.abs(clean).max()) ** 2)
    pulls = []
    for _ in range(tries):
        noise = size * (random.standard_normal((1, hits, 1, n // 2 + 1)) + 1j * random.standard_normal((1, hits, 1, n // 2 + 1)))
        velocity = np.fft.irfft(clean + noise, n)
        found = estimate(time, np.tile(force, (1, hits, 1)), velocity, Windows(0.05, 0.0), (200.0, 1200.0), (1,), (1,)).h1
        lines = np.isin(frequency, found.frequency)
        pulls.append(np.abs(found.value[0, 0] - true[lines]) ** 2 / found.sd[0, 0] ** 2)
    true_to = np.sqrt(np.mean(pulls, axis=0))
    thirds = [float(np.sqrt(np.mean(part**2))) for part in np.array_split(true_to, 3)]
    assert thirds == pytest.approx([1.0, 1.0, 1.0], abs=0.12)


def test_a_hammer_too_soft_for_the_band_is_refused_before_anything_is_simulated(spindle, monkeypatch):
    """A half-sine of T has no force at 1.5 / T: 2 g on a tip of 0.1 N/um touch for 444 us, and reach 3376 Hz."""
    soft = replace(spindle, hammer=replace(spindle.hammer, tip_stiffness=1e5))
    monkeypatch.setattr("thermospindle.sim.hammer.test.simulate", lambda *given: pytest.fail("simulated"))
    monkeypatch.setattr("thermospindle.sim.run.operating_point", lambda *given: pytest.fail("solved"))
    said = r"hammer_test\.band_Hz: this hammer gives no force above 3376 Hz, band_Hz goes to 6000 Hz"
    with pytest.raises(BadInput, match=said):
        impact_tests([operating_point(spindle, Condition(20.0))], soft.hammer)
    with pytest.raises(BadInput, match=said):
        run(soft, [20.0])


def test_the_scenes_hammer_excites_the_band(spindle):
    """Its pulse's spectrum falls by 1 dB to 6 kHz, as the scene says."""
    test = spindle.hammer
    pulse = np.fft.rfft(force(Hit(((0.0, 1.0),), pulse_duration(test)), 1e-7, 1 << 20))
    fall = 20 * np.log10(np.abs(pulse[round(6000 * 1e-7 * (1 << 20))] / pulse[0]))
    assert fall == pytest.approx(-1.0, abs=0.1)
