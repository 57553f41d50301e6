"""Likeness of FRFs: closed forms for a scale, a phase and a shift; standard bands; what symmetry silences."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from thermospindle.diagnosis.compare.correlation import (
    DISTINCT,
    Correlation,
    _best,
    assurance,
    bands,
    correlate,
    in_common,
    of_sensors,
    off_alone,
    scale_factor,
)
from thermospindle.diagnosis.prediction.partners import BELIEVABLE
from thermospindle.model.machine import Condition
from thermospindle.sim.campaign.beside import Beside, beside
from thermospindle.sim.campaign.campaign import Campaign, Test
from thermospindle.sim.identification.frf import Frf
from thermospindle.sim.operating import operating_point

LINES = np.arange(400.0, 6000.0, 2.0)


@pytest.fixture(scope="module")
def point(spindle):
    return operating_point(spindle, Condition(40.0, 754.0))


def measured(spindle, point, value) -> Beside:
    frf = Frf(LINES, value, tuple(p.node for p in spindle.points), spindle.hammer.hammer_nodes, "mobility")
    return Beside(Test("t", 40.0, 754.0, frf=frf), frf, point)


def test_a_scale_is_seen_by_csf_only(spindle, point):
    found = correlate(measured(spindle, point, 3.0 * point.frf(LINES)))
    assert found.csac == pytest.approx(np.ones(len(LINES)))
    assert found.csf == pytest.approx(np.full(len(LINES), 2 * 3 / (1 + 9)))
    for band in (found.whole, *found.bands):
        assert (band.csac, band.csf) == pytest.approx((1.0, 0.6))
        assert band.fdac == pytest.approx(1.0, abs=1e-4)  # lines stand up to half a step beside those of its axis
        assert [s.csf for s in band.by_frf.values()] == pytest.approx([0.6] * len(band.by_frf))
        assert min(s.frac for s in band.by_frf.values()) == pytest.approx(1.0)


def test_a_factor_that_all_frfs_share_is_told_in_dB(spindle, point):
    """Accelerations told in g for m/s^2, beside shapes and frequencies that are right: 25 dB that a
    page alone showed. One channel that is off is none."""
    value = point.frf(LINES)
    wrong = value.copy()
    wrong[2] *= 0.1
    by = [in_common([correlate(measured(spindle, point, factor * v)) for factor in (f, 1.2 * f)]) for f, v in ((1 / 9.81, value), (1.0, value), (0.1, wrong))]
    assert by == [pytest.approx(-20 * np.log10(9.81) + 20 * np.log10(1.2) / 2, abs=0.01), None, None]


@pytest.mark.parametrize("factor", [1.0, 1.04, 1.15, 0.88])
def test_a_sensor_whose_sensitivity_is_off_is_told(spindle, point, factor):
    """15 % that MAC, COMAC and FRAC are blind to, beside gains known to 1 % and noise that makes
    small FRFs larger; 4 % are within what calibrations are known to."""
    random, exact = np.random.default_rng(5), point.frf(LINES)
    gains = 1 + 0.01 * random.standard_normal(len(exact))
    gains[3] = factor
    noise = 2e-3 * np.abs(exact).max() * (random.standard_normal((2, *exact.shape, 2)) @ [1, 1j]) / np.sqrt(2)
    tests = [correlate(measured(spindle, point, gains[:, None, None] * exact + own)) for own in noise]
    node = spindle.points[3].node
    assert np.median(of_sensors(tests)[node]) == pytest.approx(np.log(factor), abs=0.01)
    found = off_alone(tests)
    assert set(found) == ({node} if abs(factor - 1) > 0.1 else set())
    if found:
        assert found[node][0] == pytest.approx(factor - 1, abs=0.02)


@pytest.mark.parametrize(("own", "told"), [((0.2, 0.2), 0.2), ((0.15, 0.25), 0.2), ((0.1, 0.3), None)])
def test_a_sensor_whose_own_frfs_differ_is_not_told(own, told):
    """FRFs of two sensors as computed, of a third exp(own) of that with either hammer: 0.2 is 4
    times 0.05 but only 2 times 0.1, where 2.5 times is asked."""
    computed = np.ones((3, 2, 4))
    gain = np.exp([[0.0, 0.0], [0.0, 0.0], own])
    frf = Frf(np.arange(1.0, 5.0), gain[:, :, None] * computed, (1, 2, 3), (1, 2), "mobility")
    found = off_alone([Correlation(SimpleNamespace(measured=frf), computed, np.ones(4), np.ones(4), None, ())])
    assert found == ({} if told is None else {3: (pytest.approx(np.expm1(told)), pytest.approx(0.0))})


def test_one_channel_off_is_seen_where_it_is(spindle, point):
    value = point.frf(LINES)
    value[2] *= -0.5
    found = correlate(measured(spindle, point, value))
    wrong = spindle.points[2].node
    for (response, _), shape in found.whole.by_frf.items():
        if shape.csf is not None:
            assert shape.csf == pytest.approx(0.8 if response == wrong else 1.0)  # 2 * 0.5 / (1 + 0.25)
            assert shape.frac == pytest.approx(1.0)
    assert found.whole.csac < 0.95


@pytest.mark.parametrize("shift", [0.03, -0.012])
def test_a_shifted_model_is_told_by_how_much(spindle, point, shift):
    """A model that resonates (1 + shift) too high: measured(f) = computed(f (1 + shift)), so FDAC is one there in every band."""
    found = correlate(measured(spindle, point, point.frf(LINES * (1 + shift))))
    told = [b for b in found.bands if b.shift is not None]
    assert len(told) >= 4
    assert [b.shift for b in told] == pytest.approx([shift] * len(told), abs=5e-4)
    assert found.whole.shift == pytest.approx(shift, abs=2e-4)
    assert found.whole.fdac > 0.999
    assert found.whole.csac < 0.995  # blind to much of it under the broad lateral pair


@pytest.mark.parametrize("vertex", [-0.0123, 0.0, 0.0031, 0.0046])
def test_the_best_shift_of_a_parabola_is_its_vertex(vertex):
    shifts = np.linspace(-0.02, 0.02, 41)
    assert _best(shifts, 1 - 400 * (shifts - vertex) ** 2) == pytest.approx(vertex, abs=1e-9)


def test_no_shift_is_told_where_nothing_resonates(spindle, point):
    """Twice the same shape at all lines of a band: any shift is as good as any other."""
    mass_line = np.ones((len(spindle.points), 2, len(LINES))) / (2j * np.pi * LINES)
    flat = correlate(replace(measured(spindle, point, mass_line), point=Rigid(point)))
    assert flat.whole.fdac == pytest.approx(1.0)
    assert all(b.shift is None for b in (flat.whole, *flat.bands))
    assert DISTINCT > 0


@dataclass(frozen=True)
class Rigid:
    """A free mass: every point answers 1 / (i omega) to every hammer."""

    of: object

    @property
    def state(self):
        return self.of.state

    def frf(self, frequency, window_decay=0.0, between=None):
        return np.ones((7, 2, 1)) / (2j * np.pi * frequency)


def test_a_shift_beyond_the_search_is_not_told(spindle, point):
    found = correlate(measured(spindle, point, point.frf(LINES * (1 + 1.3 * BELIEVABLE))))
    assert found.whole.shift is None
    assert found.whole.fdac < 0.985


def test_fdac_on_its_diagonal_is_csac(spindle, point):
    found = correlate(measured(spindle, point, point.frf(LINES * 1.02)))
    some = list(range(0, len(LINES), 100))
    assert np.diag(found.fdac(some, some)) == pytest.approx(found.csac[some])
    assert found.fdac(some[:3], some).shape == (len(some), 3)


def test_symmetry_silences_pairs_at_rest(spindle):
    point = operating_point(spindle, Condition(40.0))
    found = correlate(measured(spindle, point, point.frf(LINES)))
    silent = [p for p, s in found.whole.by_frf.items() if s.frac is None]
    assert silent == [(3, 2), (4, 1)]
    assert all(found.whole.by_frf[p].csf is None for p in silent)


def test_third_octaves():
    """IEC 61260-1: edges of the bands about 1000 Hz at 10^(k / 10 - 1 / 20), the outer ones cut."""
    found = bands(900.0, 2000.0)
    assert found[0] == (900.0, pytest.approx(1122.018, abs=1e-3))
    assert found[1] == pytest.approx((1122.018, 1412.538), abs=1e-3)
    assert found[-1] == (pytest.approx(1778.279, abs=1e-3), 2000.0)
    assert len(found) == 4
    assert bands(1000.0, 1010.0) == [(1000.0, 1010.0)]


def test_closed_forms():
    a = np.array([1.0, 2j, 0.5])
    assert assurance(a, (3 - 4j) * a) == pytest.approx(1.0)
    assert assurance(np.array([1.0, 0j]), np.array([0j, 1.0])) == 0.0
    assert assurance(a, 0 * a) is None
    assert scale_factor(a, (3 - 4j) * a) == pytest.approx(2 * 5 / (1 + 25))
    assert scale_factor(a, 1j * a) == pytest.approx(1.0)
    assert scale_factor(a, 0 * a) == 0.0


def test_lines_at_zero_and_few_lines(spindle, point):
    frequency = np.array([0.0, 500.0, 501.0])
    frf = Frf(frequency, np.ones((7, 2, 3), complex), tuple(p.node for p in spindle.points), (1, 2), "receptance")
    tests = Test("t", 40.0, 0.0, frf=frf), Test("table", 40.0, 0.0)
    campaign = Campaign("two", spindle.name, "receptance", spindle.points, tests)
    shown = beside(spindle, campaign, tests[0], Condition(40.0))
    assert shown.measured.frequency.tolist() == [500.0, 501.0]
    found = correlate(shown)
    assert found.bands == ()
    assert found.whole.shift is None
    assert beside(spindle, campaign, tests[1], Condition(40.0)) is None
