"""Noise under an exponential window: its correlation over lines, how it is recognised, and errors of compressed lines that come true."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.blind.study import draw
from tests.diagnosis.inference.test_lines import modal_frf
from thermospindle.diagnosis.data.lines import line_data
from thermospindle.diagnosis.data.window import NONE, Window, correlation, left_by, neighbours, windowed
from thermospindle.diagnosis.inference.fit import fit
from thermospindle.diagnosis.verdict import campaign_data
from thermospindle.model.machine import Condition
from thermospindle.sim.campaign.campaign import Noise, Test
from thermospindle.sim.identification.frf import Frf

SAMPLES, RATE = 6000, 20000.0  # 0.3 s: lines 3.33 Hz apart
DURATION = SAMPLES / RATE
DAMPED = 3.0  # d T: a window that ends at 5 %
WINDOW = Window(DAMPED / DURATION, DURATION)
LINES = np.fft.rfftfreq(SAMPLES, 1 / RATE)
USE = (LINES >= 400) & (LINES <= 6000)


def noise_of(shape: tuple[int, ...], damped: float, seed: int) -> np.ndarray:
    """Transforms at the lines of white noise under a window, of unit variance a line."""
    window = np.exp(-damped * np.arange(SAMPLES) / SAMPLES)
    white = np.random.default_rng(seed).standard_normal((*shape, SAMPLES))
    return np.fft.rfft(white * window, axis=-1)[..., USE] / np.sqrt(np.sum(window**2))


def along(left, changed):
    """How far what is left (..., L) goes along a change (..., L), both in standard errors, in standard errors of its amount."""
    return np.sum((changed.conj() * left).real, axis=-1) / np.linalg.norm(changed, axis=-1)


def test_correlation_over_lines():
    found = noise_of((60,), DAMPED, 1)
    for apart in (1, 2, 5):
        seen = np.mean(found[:, apart:] * found[:, :-apart].conj())
        assert seen == pytest.approx(complex(correlation(6, WINDOW)[apart, 0]), abs=0.02)


def test_what_polynomials_leave_of_it():
    """Variances of coefficients, and of the rest, against draws; of white noise all are one."""
    k = 24
    basis = np.linalg.qr(np.polynomial.legendre.legvander(np.linspace(-1, 1, k), 4))[0]
    found = noise_of((80,), DAMPED, 2)
    pieces = found[:, : found.shape[1] // k * k].reshape(-1, k)
    own, rest, _ = left_by(basis, WINDOW)
    coefficients = pieces @ basis
    assert np.mean(np.abs(coefficients) ** 2, axis=0) == pytest.approx(own, rel=0.06)
    assert np.mean(np.sum(np.abs(pieces - coefficients @ basis.T) ** 2, axis=1)) == pytest.approx(rest, rel=0.03)
    assert left_by(basis, NONE)[0] == pytest.approx(np.ones(5))
    assert np.mean(np.abs(found[:, 1:-1] - (found[:, :-2] + found[:, 2:]) / 2) ** 2) / 1.5 == pytest.approx(neighbours(WINDOW), rel=0.03)


@pytest.mark.parametrize("hidden", [0.0, DAMPED])
def test_recognised(hidden):
    """Windowed noise by the correlation it has; FRFs whose noise is new in every line are not taken for windowed."""
    exact = modal_frf(LINES[USE])
    seen = exact + 1e-3 * np.abs(exact).max() * noise_of(exact.shape[:2], hidden, 3)
    assert windowed(seen, WINDOW) == (WINDOW if hidden else NONE)


@pytest.mark.parametrize("hidden", [0.0, DAMPED])
def test_errors_of_compressed_lines_come_true(hidden):
    """chi2 of the compressed values about the exact ones, the noise being told by the lines alone: within a tenth, windowed or not."""
    decay = DAMPED / DURATION
    smooth = modal_frf(LINES[USE])
    total, count = 0.0, 0
    for seed in range(4):
        value = smooth + 5e-4 * np.abs(smooth).max() * noise_of(smooth.shape[:2], hidden, 10 + seed)
        test = Test("t", 20.0, 0.0, frf=Frf(LINES[USE], value, (1, 2, 3), (1, 2), "mobility"), window_decay=decay)
        data = line_data(test, Condition(20.0), None, Noise(0.004, 0.0002))
        left = (data.value - modal_frf(data.frequency)) / data.sd
        total, count = total + float(np.sum(np.abs(left) ** 2)), count + left.size
    assert total / count == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize(
    ("hidden", "before", "told", "without"),
    [
        pytest.param(0.0, 0.0, None, 0.9, id="new in every line"),
        pytest.param(DAMPED, 0.0, None, 1.5, id="hit at the start, untold", marks=pytest.mark.slow),
        pytest.param(DAMPED, 0.0, 0.0, 1.5, id="hit at the start"),
        pytest.param(DAMPED, 0.02, None, 1.5, id="hit a little later, untold", marks=pytest.mark.slow),
        pytest.param(DAMPED, 0.04, None, 1.0, id="hit later, untold", marks=pytest.mark.slow),
        pytest.param(DAMPED, 0.04, 0.04, 1.0, id="hit later", marks=pytest.mark.slow),
        pytest.param(DAMPED, 0.0425, 0.04, 1.0, id="hit a little later than told"),
    ],
)
def test_errors_of_what_is_smooth_over_lines_come_true(hidden, before, told, without):
    """A gain, a delay and a mode's frequency fitted to windowed noise are off by their stated errors, within a fifth, where
    lines taken for independent would say half as much. Hit late in a record the noise of an FRF turns from line to line; a
    little later than is told does no harm, and much later lines say by themselves. Where the time is told, chi2 is right too."""
    frequency, off, alone, chi2 = LINES[USE], [], [], []
    smooth = modal_frf(frequency)
    for seed in range(10):
        noise = noise_of(smooth.shape[:2], hidden, 100 + seed) * np.exp(2j * np.pi * frequency * before)
        value = smooth + 5e-4 * np.abs(smooth).max() * noise
        test = Test("t", 20.0, 0.0, frf=Frf(frequency, value, (1, 2, 3), (1, 2), "mobility"), window_decay=DAMPED / DURATION, pretrigger=told)
        data = line_data(test, Condition(20.0), None, Noise(0.004, 0.0002))
        exact = modal_frf(data.frequency)
        changes = exact, 2j * np.pi * data.frequency * exact, modal_frf(data.frequency + 0.5) - modal_frf(data.frequency - 0.5)
        left = data.value - exact
        off.append([along(data.in_errors(left), data.in_errors(changed)) for changed in changes])
        alone.append([along(left / data.sd, changed / data.sd) * np.sqrt(2) for changed in changes])
        chi2.append(np.mean(np.abs(data.in_errors(left)) ** 2) / 2)
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(1.0, abs=0.2)
    assert np.sqrt(np.mean(np.square(alone))) > without
    assert (0.5 if told is None and hidden else 0.81) < np.mean(chi2) < 1.1


def test_lines_by_themselves():
    """Independent numbers as lines taken for themselves, and back; with errors of what is smooth over lines."""
    smooth = modal_frf(LINES[USE])
    value = smooth + 5e-4 * np.abs(smooth).max() * noise_of(smooth.shape[:2], DAMPED, 7)
    test = Test("t", 20.0, 0.0, frf=Frf(LINES[USE], value, (1, 2, 3), (1, 2), "mobility"), window_decay=DAMPED / DURATION)
    data = line_data(test, Condition(20.0), None, Noise(0.004, 0.0002))
    scaled = (data.value - modal_frf(data.frequency)) / data.sd * np.sqrt(2)
    white = data.independent(scaled)
    rows = white.ravel().view(float)[None]
    assert data.smooth == pytest.approx(2 * DAMPED / (1 - np.exp(-2 * DAMPED)))
    assert data.alone(rows)[0] * np.sqrt(data.smooth) == pytest.approx(scaled.ravel().view(float), abs=1e-9)
    assert np.stack([data.independent(scaled), data.independent(2 * scaled)]) == pytest.approx(data.independent(np.stack([scaled, 2 * scaled])))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "told"),
    [(113, None), (165, 0.0), pytest.param(165, None, marks=pytest.mark.xfail(strict=True, reason="where it is not told how long before the hit records begin, errors cover a later one: rms 0.75 to 0.78 of them"))],
)
def test_noise_under_a_window_is_that_of_all_tests(seed, told):
    """Blind campaigns 113 and 165, as they are or told that records begin with the hit: the same noise in every test. A fit of
    it that let one block rule the next told a tenth of it in one test, and that was missed by six standard errors and more."""
    drawn = draw(seed)
    made = drawn.made().campaign
    model = campaign_data(drawn.spindle, replace(made, tests=tuple(replace(t, pretrigger=told) for t in made.tests)))
    assert {data.noise_from for data in model.tests} == {"scatter of neighbouring lines"}
    lines = [data.value.shape[-1] for data in model.tests]
    assert max(lines) < 2 * min(lines)  # noise told too small divides the band to single lines
    if seed == 165:  # nothing hidden
        left = [np.sqrt(chi2 / data.count) for (chi2, _, _), data in zip(fit(model).by_test, model.tests, strict=True)]
        assert max(left) < 1.2
        assert min(left) > 0.8
