"""FRFs of records that were filled up with zeros."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnosis.inference.test_lines import modal_frf
from tests.diagnosis.test_window import LINES, SAMPLES, USE, along, noise_of
from thermospindle.diagnosis.data.lines import line_data
from thermospindle.model.machine import Condition
from thermospindle.sim.campaign.campaign import Noise, Test
from thermospindle.sim.identification.frf import Frf
from thermospindle.sim.identification.padding import own_lines, padding

FREQUENCY = LINES[USE]


def filled(share: float, noise: float, seed: int = 1, before: float = 0.0) -> Frf:
    """FRFs of records of which white noise is in so large a share, hit `before` seconds after their start."""
    exact = modal_frf(FREQUENCY)
    white = np.random.default_rng(seed).standard_normal((*exact.shape[:2], SAMPLES))
    white[..., round(share * SAMPLES) :] = 0.0
    seen = np.fft.rfft(white, axis=-1)[..., USE] / np.sqrt(share * SAMPLES) * np.exp(2j * np.pi * FREQUENCY * before)
    return Frf(FREQUENCY, exact + noise * np.abs(exact).max() * seen, (1, 2, 3), (1, 2), "mobility")


@pytest.mark.parametrize("noise", [5e-3, 5e-5])
@pytest.mark.parametrize(("share", "closer"), [(1.0, 1), (0.8, 1), (0.5, 2), (0.4, 2), (1 / 3, 3), (0.25, 4), (0.125, 8)])
def test_how_much_closer_lines_lie(share, closer, noise):
    assert padding(filled(share, noise)) == closer
    if share > 0.125:  # of which the answer takes too much then
        assert padding(filled(share, noise, before=0.03 * share)) == closer


@pytest.mark.parametrize("damped", [0.0, 1.0, 3.0, 6.0, 9.0])
def test_a_window_fills_nothing_up(damped):
    exact = modal_frf(FREQUENCY)
    assert padding(Frf(FREQUENCY, exact + 5e-4 * np.abs(exact).max() * noise_of(exact.shape[:2], damped, 3), (1, 2, 3), (1, 2), "mobility")) == 1


def test_without_noise_nothing_is_told():
    assert padding(Frf(FREQUENCY, modal_frf(FREQUENCY), (1, 2, 3), (1, 2), "mobility")) == 1


def test_lines_of_the_record_itself():
    kept, closer = own_lines(replace(filled(0.25, 1e-3), sd=np.ones((3, 2, len(FREQUENCY)))))
    assert closer == 4
    assert kept.sd.shape == kept.value.shape
    assert np.rint(kept.frequency * SAMPLES / 20000.0).astype(int) % 4 == pytest.approx(0)
    whole = filled(1.0, 1e-3)
    assert own_lines(whole)[0] is whole


@pytest.mark.parametrize("share", [0.5, 0.25])
def test_errors_come_true(share):
    """A gain, a delay and a mode's frequency are off by their stated errors: with all lines they would be by 1.3 and by 7 of them."""
    off, chi2 = [], []
    for seed in range(10):
        data = line_data(Test("t", 20.0, 0.0, frf=filled(share, 5e-4, seed)), Condition(20.0), None, Noise(0.004, 0.0002))
        exact = modal_frf(data.frequency)
        left = data.value - exact
        for changed in (exact, 2j * np.pi * data.frequency * exact, modal_frf(data.frequency + 0.5) - modal_frf(data.frequency - 0.5)):
            off.append(along(data.in_errors(left), data.in_errors(changed)))
        chi2.append(np.mean(np.abs(data.in_errors(left)) ** 2) / 2)
        assert "records are filled up with zeros" in data.noise_from
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(1.0, abs=0.2)
    assert np.mean(chi2) == pytest.approx(1.0, abs=0.15)
