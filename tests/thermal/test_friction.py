"""Palmgren's torque by hand."""

from dataclasses import replace

import numpy as np
import pytest

from model.machine import Friction, Law, OutsideRange
from thermal.friction import heat, torque, viscous_torque

RPM = 2 * np.pi / 60


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
        torque(spindle.thermal.friction, spindle.bearings[0], 700.0, 120.0, 16.0)
