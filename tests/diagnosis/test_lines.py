"""Parameters fitted to the lines of one test's FRFs."""

from dataclasses import replace

import numpy as np
import pytest

from thermospindle.diagnosis.line_fit import chain_noise, fit_lines
from thermospindle.model.built.tolerance import toleranced
from thermospindle.model.machine import Condition
from thermospindle.sim.hammer.test import impact_tests
from thermospindle.sim.identification.frf import Frf
from thermospindle.sim.operating import operating_point

FREQUENCY = np.arange(400.0, 3001.0, 2.0)
NAMES = ("plate tilt x stiffness", "preload")


def parameters(spindle):
    return [next(p for p in toleranced(spindle) if p.name == name) for name in NAMES]


def test_what_was_put_in_comes_out_within_its_errors(spindle):
    """Noise of the measuring chain on exact lines, twelve draws: z-scores of both parameters and chi2 a line as they must be."""
    free = parameters(spindle)
    built = free[1].apply(free[0].apply(spindle, 0.02), -0.01)
    exact = operating_point(built, Condition(40.0)).frf(FREQUENCY)
    sd = chain_noise(spindle.hammer, exact)
    z, chi2 = [], []
    for seed in range(12):
        random = np.random.default_rng(seed)
        noise = sd / np.sqrt(2) * (random.standard_normal(sd.shape) + 1j * random.standard_normal(sd.shape))
        frf = Frf(FREQUENCY, exact + noise, tuple(p.node for p in spindle.points), spindle.hammer.hammer_nodes, "mobility", sd=sd)
        found = fit_lines(spindle, Condition(40.0), frf, free)
        z.append(np.linalg.solve(np.linalg.cholesky(found.covariance), found.value - [0.02, -0.01]))
        chi2.append(found.chi2 / found.lines)
    assert 0.6 < np.sqrt(np.mean(np.square(z))) < 1.4
    assert np.mean(chi2) == pytest.approx(1.0, abs=0.01)


def test_errors_under_a_window_come_true(spindle):
    """Noise under a window that ends at 5 %, correlated from line to line, 24 draws: scores as they
    must be, where lines taken for independent would say less."""
    free, decay, step = parameters(spindle), 20.0, 1 / 0.15
    frequency = step * np.arange(60, 451)
    exact = operating_point(spindle, Condition(40.0)).frf(frequency, decay)
    sd = np.broadcast_to(2e-3 * np.abs(exact).max(axis=(0, 2), keepdims=True), exact.shape)
    time = np.arange(2000) * 0.15 / 2000
    z, alone = [], []
    for seed in range(24):
        white = np.random.default_rng(seed).standard_normal((*exact.shape[:2], len(time)))
        noise = np.fft.rfft(white * np.exp(-decay * time), axis=-1)[..., 60:451] / np.sqrt(np.sum(np.exp(-2 * decay * time)))
        frf = Frf(frequency, exact + sd * noise, tuple(p.node for p in spindle.points), spindle.hammer.hammer_nodes, "mobility", sd=sd)
        found = fit_lines(spindle, Condition(40.0), frf, free, decay)
        z.append(np.linalg.solve(np.linalg.cholesky(found.covariance), found.value))
        sweep = replace(frf, frequency=frequency * (1 + 1e-3 * (np.arange(len(frequency)) == 5)))  # in uneven steps lines have no record
        alone.append(found.value / fit_lines(spindle, Condition(40.0), sweep, free, decay).sd)
    assert np.sqrt(np.mean(np.square(z))) == pytest.approx(1.0, abs=0.3)
    assert np.sqrt(np.mean(np.square(alone))) > 1.25 * np.sqrt(np.mean(np.square(z)))


def test_a_virtual_test_with_its_window(spindle):
    """Through MuJoCo, one hit a node: the exponential window is known and taken out, quantity and points may be others."""
    single = replace(spindle, hammer=replace(spindle.hammer, hits=1))
    free = parameters(single)[:1]
    test = impact_tests([operating_point(free[0].apply(single, 0.02), Condition(20.0))], seed=3)[0]
    h1, decay = test.estimate.h1, test.estimate.window_decay
    found = fit_lines(single, Condition(20.0), h1, free, decay)
    assert found.value[0] == pytest.approx(0.02, abs=5 * found.sd[0])
    assert found.chi2 / found.lines == pytest.approx(1.0, abs=0.1)
    assert abs(fit_lines(single, Condition(20.0), h1, free).value[0] - 0.02) > 5 * found.sd[0] or decay == 0  # the window matters
    few = replace(h1, value=h1.value[2:4, 1:] / (2j * np.pi * h1.frequency + decay), response_nodes=h1.response_nodes[2:4],
                  reference_nodes=h1.reference_nodes[1:], quantity="receptance", coherence=None, sd=None)  # fmt: skip
    part = fit_lines(single, Condition(20.0), few, free, decay)
    assert part.value[0] == pytest.approx(0.02, abs=5 * part.sd[0])
    assert part.sd[0] > found.sd[0]


def test_a_fit_that_does_not_rest_says_so(spindle, monkeypatch):
    monkeypatch.setattr("thermospindle.diagnosis.line_fit.LONGEST", 1)
    free = parameters(spindle)
    exact = operating_point(free[0].apply(spindle, 0.02), Condition(20.0)).frf(FREQUENCY)
    frf = Frf(FREQUENCY, exact, tuple(p.node for p in spindle.points), spindle.hammer.hammer_nodes, "mobility")
    with pytest.raises(ValueError, match="plate tilt x stiffness, preload has not come to rest after 1 steps"):
        fit_lines(spindle, Condition(20.0), frf, free)
