"""Crossings interpolated between grid points, beside those found exactly."""

import numpy as np
import pytest

from tests.conftest import ROOT
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.sim.resonance import grid as searched
from thermospindle.sim.resonance.between import between
from thermospindle.sim.resonance.map import resonance_map


def test_a_cubic_difference_is_met_where_it_is_zero():
    places = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    zero = 1.7
    mode = 900.0 + 3.0 * places - 0.2 * places**2
    inverse = zero + 0.01 * (gap := np.array([-40.0, -17.0, 6.0, 30.0, 55.0])) + 1e-5 * gap**2
    found = between(inverse, gap, mode, 1)
    assert inverse[1] + found.share * (inverse[2] - inverse[1]) == pytest.approx(zero, abs=1e-9)
    straight = between(places, 5.0 * (places - zero), mode, 1)
    assert straight.share == pytest.approx(0.7)
    assert straight.frequency == pytest.approx(900.0 + 3.0 * zero - 0.2 * zero**2, rel=1e-12)


@pytest.mark.slow
def test_crossings_of_a_flexible_spindle(monkeypatch):
    """With few found exactly the others stand as interpolated; both ways agree, on a grid of 700 rpm and 10 K."""
    spindle = load(ROOT / "scenes" / "five_bearing")
    nominal = Condition(25.0, spindle.nominal_speed)
    grid = np.array([20.0, 30.0]), spindle.nominal_speed * np.linspace(0.8, 1.2, 5)
    monkeypatch.setattr(searched, "EXACT", 12)
    told: list[str] = []
    found = resonance_map(spindle, *grid, nominal, multiples=1, progress=told.append)
    assert found.interpolated is not None
    assert found.interpolated.checked >= 8
    assert found.interpolated.crossings == sum(c.interpolated for c in found.coincidences) > 0
    assert found.interpolated.frequency_error < 1e-3
    assert found.interpolated.strength_error < 0.02
    assert found.interpolated.largest_strength_error < 0.1
    assert len(told) > searched.PARTS
    monkeypatch.setattr(searched, "EXACT", 10**6)
    exact = resonance_map(spindle, *grid, nominal, multiples=1)
    assert exact.interpolated is None
    want = {(c.line.bearing, c.line.name, c.line.direction, c.line.whirl, c.mode.number, c.at_nominal_speed): c for c in exact.coincidences}
    have = {(c.line.bearing, c.line.name, c.line.direction, c.line.whirl, c.mode.number, c.at_nominal_speed): c for c in found.coincidences}
    assert len(set(want) ^ set(have)) <= 0.05 * len(want)
    apart = [abs(have[k].nrro / want[k].nrro - 1) for k in have if k in want and want[k].nrro > 0]
    assert np.median(apart) < 0.05


def test_a_spindle_of_rigid_bodies_is_found_exactly(spindle):
    found = resonance_map(spindle, [20.0, 60.0], [600.0, 900.0], Condition(20.0, 754.0), multiples=1)
    assert found.interpolated is None
    assert not any(c.interpolated for c in found.coincidences)
