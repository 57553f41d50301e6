"""Palmgren's torque by hand."""

from dataclasses import replace

import numpy as np
import pytest

from thermospindle.model.errors import OutsideRange
from thermospindle.model.machine import Friction, Law
from thermospindle.model.units import RPM
from thermospindle.thermal.friction import heat, torque, viscous_torque


def friction(viscosity=100e-6, f0=2.0, f1=0.0013):
    return Friction(f0, f1, Law((20.0,), (viscosity,)), 0.05)


@pytest.mark.parametrize(
    ("viscosity", "rpm", "newton_millimetres"),
    [
        pytest.param(100e-6, 7200.0, 1e-7 * 2 * 720000 ** (2 / 3) * 9.1**3 + 0.0013 * 16 * 9.1, id="running"),
        pytest.param(10e-6, 100.0, 160e-7 * 2 * 9.1**3 + 0.0013 * 16 * 9.1, id="slow"),
        pytest.param(100e-6, -7200.0, 1e-7 * 2 * 720000 ** (2 / 3) * 9.1**3 + 0.0013 * 16 * 9.1, id="backwards"),
    ],
)
def test_torque_in_palmgrens_units(spindle, viscosity, rpm, newton_millimetres):
    """d_m = 9.1 mm, P1 = 16 N, f0 = 2, f1 = 0.0013, in N mm."""
    assert torque(friction(viscosity), spindle.bearings[0], rpm * RPM, 30.0, 16.0) == pytest.approx(newton_millimetres * 1e-3)


def test_branches_meet_within_one_percent(spindle):
    """At nu n = 2000 Palmgren's two branches differ by 160 / 2000^(2/3) - 1."""
    above, below = (viscous_torque(friction(10e-6), spindle.bearings[0], rpm * RPM, 30.0) for rpm in (200.001, 199.999))
    assert below / above == pytest.approx(160 / 2000 ** (2 / 3), rel=1e-5)


def test_heat_is_torque_times_speed_and_zero_at_rest(spindle):
    b, law = spindle.bearings[0], friction()
    assert heat(law, b, -300.0, 30.0, 16.0) == pytest.approx(300 * torque(law, b, 300.0, 30.0, 16.0))
    assert heat(law, b, 0.0, 30.0, 16.0) == 0.0
    assert torque(replace(law, f0=0.0), b, 300.0, 30.0, -16.0) == pytest.approx(0.0013 * 16 * 9.1e-3)


def test_viscosity_outside_its_table_is_refused(spindle):
    with pytest.raises(OutsideRange):
        torque(spindle.thermal.friction, spindle.bearings[0], 700.0, 121.0, 16.0)


def test_grease_of_the_reference_spindle_follows_astm_d341(spindle):
    """log10 log10 (nu + 0.7) is linear in log10 (T / K) through 26 mm2/s at 40 C and 5.1 at 100 C."""
    law = spindle.thermal.friction.viscosity
    celsius, found = np.array(law.temperature), np.array(law.value) * 1e6
    ends = np.log10(np.log10(np.array([26.0, 5.1]) + 0.7))
    slope = (ends[1] - ends[0]) / np.log10(373.15 / 313.15)
    expected = 10**10 ** (ends[0] + slope * np.log10((celsius + 273.15) / 313.15)) - 0.7
    assert found == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize("temperature", [20.0, 40.0, 60.0])
def test_torque_beside_the_skf_model(spindle, temperature):
    """The manufacturer's model of 2004 (SKF Rolling bearings catalogue, angular contact, pure axial load) for the same bearing and
    grease: M = phi_ish phi_rs G_rr (nu n)^0.6 + mu_sl G_sl. Two empirical laws; Palmgren's is the larger, by less than a factor of two."""
    law, load, rpm, mean = spindle.thermal.friction, 16.0, 7200.0, 9.1
    nu = law.viscosity(temperature) * 1e6
    rolling = 5.03e-7 * mean**1.97 * (1.90e-12 * mean**4 * rpm**2 + 1.97 * load) ** 0.54 * (nu * rpm) ** 0.6
    sliding = 1.30e-2 * mean**0.26 * ((1.91e-12 * mean**4 * rpm**2) ** (4 / 3) + 0.68 * load ** (4 / 3))
    shear = 1 / (1 + 1.84e-9 * (rpm * mean) ** 1.28 * nu**0.64)
    starved = np.exp(-6e-8 * nu * rpm * (5 + 13) * np.sqrt(4.4 / (2 * (13 - 5))))
    skf = shear * starved * rolling + 0.05 * sliding
    assert 1.0 < 1e3 * torque(law, spindle.bearings[0], rpm * RPM, temperature, load) / skf < 2.0
