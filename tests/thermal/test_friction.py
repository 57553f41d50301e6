"""Palmgren's torque by hand."""

from dataclasses import replace

import numpy as np
import pytest

from thermospindle.model.bearing.row import reference_motion, relative_speed
from thermospindle.model.drawing.heating import Friction
from thermospindle.model.errors import OutsideRange
from thermospindle.model.machine import Condition, RadialLoad
from thermospindle.model.material import Law, Viscosity
from thermospindle.model.units import RPM
from thermospindle.sim.effects.bearing import lubricant_film, ring_growth
from thermospindle.sim.effects.temperature import thermal_gradient
from thermospindle.sim.operating import operating_point
from thermospindle.thermal import conduction
from thermospindle.thermal import heat as warmed
from thermospindle.thermal.friction import heat, load, loads, torque, viscous_torque
from thermospindle.thermal.influence import influence


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


def test_load_of_a_row(spindle):
    """P1 = max(0.9 F_a cot(alpha) - 0.1 F_r, F_r): near the catalogues' 3.3 F_a - 0.1 F_r at 15
    degrees and F_a - 0.1 F_r at 40; a radial load alone counts whole."""
    b = spindle.bearings[0]
    assert load(b, -16.0) == pytest.approx(0.9 * 16 / np.tan(np.radians(24.51)))
    assert load(replace(b, contact_angle=np.radians(15)), 100.0, 50.0) == pytest.approx(3.3 * 100 - 5, rel=0.03)
    assert load(replace(b, contact_angle=np.radians(40)), 100.0, 50.0) == pytest.approx(100 - 5, rel=0.1)
    assert load(b, 0.0, 50.0) == 50.0
    rest = loads(spindle)
    assert rest == pytest.approx({name: load(b, 16.0) for name in ("lower", "upper")})
    state = operating_point(replace(spindle, radial_loads=(RadialLoad((30.0, 40.0), 0.0),)), Condition(20.0)).state
    borne = loads(spindle, state)
    for row in state.bearings:
        assert borne[row.name] == pytest.approx(load(b, row.preload, np.hypot(*row.radial_force)))
        assert borne[row.name] > rest[row.name]


def test_rings_know_their_own_speed_alone(spindle):
    """Half the ratio at twice the speed turns the rings alike: what they make, and what films and rings grow by, is alike."""
    bodies = tuple(replace(b, speed_ratio=0.5) if b.turns else b for b in spindle.structure.bodies)
    geared = replace(spindle, structure=replace(spindle.structure, bodies=bodies))
    model = conduction.model(spindle, influence(spindle).sections)
    warm = np.full(model.film.size, 30.0)
    own, other = ((s, Condition(30.0, w)) for s, w in ((spindle, 700.0), (geared, 1400.0)))
    made = [warmed.friction_heat(replace(model, spindle=s), warm, warmed.running(s, 30.0, c.speed)) for s, c in (own, other)]
    assert made[0] == pytest.approx(made[1], rel=1e-12)
    assert made[0].min() > 0
    unit = thermal_gradient.unit_rise(spindle)
    assert thermal_gradient.heat(*own, unit) == pytest.approx(thermal_gradient.heat(*other, unit), rel=1e-12)
    still = {b.name: reference_motion(20.0) for b in spindle.bearings}
    for effect, values in ((lubricant_film, {"scale": 1.0, "wedge": 1.0}), (ring_growth, {"scale": 1.0})):
        grown = [effect.motions(*of, values, still) for of in (own, other)]
        assert grown[0] == grown[1]
        assert grown[0] != still


def test_between_counter_rotating_rings_both_grow(spindle):
    bodies = tuple(replace(b, turns=True, speed_ratio=1.0 if b.turns else -0.5) for b in spindle.structure.bodies)
    both, still = replace(spindle, structure=replace(spindle.structure, bodies=bodies)), {b.name: reference_motion(20.0) for b in spindle.bearings}
    grown = ring_growth.motions(both, Condition(20.0, 1000.0), {"scale": 1.0}, still)["upper"]
    b = spindle.bearing("upper")
    assert grown.outer_r == pytest.approx(1e6 * ring_growth.unit_growth(both, b, b.outer_ring))
    assert grown.inner_r == pytest.approx(0.25e6 * ring_growth.unit_growth(both, b, b.inner_ring))
    assert relative_speed(both, b, 1000.0) == 1500.0


def test_viscosity_between_its_entries(spindle):
    """Of an oil of 26 mm2/s at 40 C and 5.1 at 100 C told at both alone, every entry of the table
    that the standard gives; of a straight line they would be a third off."""
    table = spindle.thermal.friction.viscosity
    oil = Viscosity((40.0, 100.0), (26e-6, 5.1e-6))
    for t, v in zip(table.temperature, table.value, strict=True):
        if 40 <= t <= 100:
            assert oil(t) == pytest.approx(v, rel=5e-3)
    assert Law(oil.temperature, oil.value)(70.0) > 1.3 * oil(70.0)
    with pytest.raises(OutsideRange):
        oil(101.0)


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
