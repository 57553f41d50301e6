"""Modes of magnitudes without phase: what an instrument's line spacing and noise may not change."""

from pathlib import Path

import numpy as np
import pytest

import thermospindle as ts
from thermospindle.sim.importing.frfs.peaks import from_peaks
from thermospindle.sim.importing.measured import Curve, End
from thermospindle.sim.operating import OperatingPoint

CLEAR = (1002.0, 1545.0, 1821.0, 2010.0)  # Hz, of hdd_2003 at 20 C; 1795 Hz stands within the half-power width of 1821 Hz


@pytest.fixture(scope="module")
def cold() -> OperatingPoint:
    return ts.point("hdd_2003", 20.0)


def magnitudes(point: OperatingPoint, step: float, channels: int, seed: int = 0, noise: float = 0.003) -> list[Curve]:
    """|H| of the first `channels` responses to the first hammer point, 400 to 3000 Hz, noise a share of the largest of each."""
    lines = np.arange(400.0, 3000.0 + step / 2, step)
    value = ts.frf(point, lines).value[:channels, 0]
    error = np.random.default_rng(seed).standard_normal((2, *value.shape)) / np.sqrt(2)
    size = np.abs(value + noise * np.abs(value).max(axis=-1, keepdims=True) * (error[0] + 1j * error[1]))
    return [Curve(Path("T20.csv"), "", End(k), End(1), lines, row) for k, row in enumerate(size, 1)]


@pytest.mark.parametrize("channels", [1, 7])
@pytest.mark.parametrize("step", [8.0, 4.0, 2.0, 1.0, 0.5, 0.25])
def test_finer_lines_lose_no_mode(cold: OperatingPoint, step: float, channels: int) -> None:
    """Four peaks at 4 to 96 times their valleys are four modes, whatever the lines' spacing: at 1 Hz one of them was left."""
    modes, _ = from_peaks(magnitudes(cold, step, channels), 0.0)
    assert [m.frequency for m in modes] == pytest.approx(CLEAR, abs=5.0)
    assert all(m.damping_ratio for m in modes)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("step", [4.0, 1.0, 0.25])
def test_standard_errors_hold_what_neighbours_do_to_a_peak(cold: OperatingPoint, step: float, seed: int) -> None:
    """One FRF's peak is moved by the flanks of other modes, which its own residual does not tell:
    within three standard errors of the model."""
    modes, _ = from_peaks(magnitudes(cold, step, 1, seed), 0.0)
    assert len(modes) == len(CLEAR)
    for mode, true in zip(modes, CLEAR, strict=True):
        assert mode.frequency_sd is not None
        assert abs(mode.frequency - true) < 3 * mode.frequency_sd


@pytest.mark.parametrize("step", [4.0, 1.0, 0.25])
def test_noise_makes_no_modes_on_fine_lines(cold: OperatingPoint, step: float) -> None:
    """At ten times the noise what is found is among the modes of the model, the highest peak always."""
    modes, _ = from_peaks(magnitudes(cold, step, 7, noise=0.03), 0.0)
    assert modes[0].frequency == pytest.approx(CLEAR[0], abs=1.0)
    assert all(min(abs(m.frequency - f) for f in CLEAR) < 10.0 for m in modes)


def test_a_peak_that_one_FRF_alone_shows_is_a_mode_where_no_other_is_near(cold: OperatingPoint) -> None:
    """More FRFs show no fewer modes: one mode in all of three, another in the first alone; and one
    beside the first mode in one alone is left out, and named."""
    lines = np.arange(400.0, 3000.0, 1.0)

    def single(f0: float, damping: float = 0.01) -> np.ndarray:
        return 1 / (1 - (lines / f0) ** 2 + 2j * damping * lines / f0)

    with_another = single(800.0) + 0.5 * single(2000.0)
    beside = 0.05 * single(800.0) + single(815.0)
    curves = [Curve(Path("T20.csv"), "", End(k), End(1), lines, np.abs(v)) for k, v in enumerate((with_another, single(800.0), single(800.0), beside), 1)]
    modes, notes = from_peaks(curves[:3], 0.0)
    assert [m.frequency for m in modes] == pytest.approx([800.0, 2000.0], abs=1.0)
    assert not notes
    modes, notes = from_peaks(curves, 0.0)
    assert [m.frequency for m in modes] == pytest.approx([800.0, 2000.0], abs=1.0)
    assert notes == ["T20.csv: the peak at 815.27 Hz is left out: too few of its FRFs show it, or not clearly enough beside other modes"]


def test_peaks_that_several_FRFs_show_have_the_errors_of_a_median() -> None:
    """1.25 sd / sqrt(n): four FRFs of a mode at 799 to 801.1 Hz with 0.94 to 1.06 % damping, of one resonance each, without noise."""
    lines = np.arange(600.0, 1000.0, 0.5)
    frequency, damping = np.array([799.0, 799.8, 800.3, 801.1]), np.array([0.0106, 0.0094, 0.0099, 0.0101])
    values = [1 / (1 - (lines / f0) ** 2 + 2j * z * lines / f0) for f0, z in zip(frequency, damping, strict=True)]
    [mode], _ = from_peaks([Curve(Path("T20.csv"), "", End(k), End(1), lines, np.abs(v)) for k, v in enumerate(values, 1)], 0.0)
    assert (mode.frequency, mode.damping_ratio) == pytest.approx((800.05, 0.0100), rel=1e-4)
    assert mode.frequency_sd == pytest.approx(1.25 * np.std(frequency, ddof=1) / 2, rel=1e-3)
    assert mode.damping_ratio_sd == pytest.approx(1.25 * np.std(damping, ddof=1) / 2, rel=1e-3)
