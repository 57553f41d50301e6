"""Effects of bearings on cylindrical rollers, which they forgot: of the tailstock, whose front bearing has two rows of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import ROOT
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition, LinearBearing
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.effects.bearing import grease_damping, preload_loss, ring_growth
from thermospindle.sim.effects.effect import refusal
from thermospindle.sim.effects.structure import modulus_softening, shaft_bending
from thermospindle.sim.effects.temperature import cooling_imbalance, fixture_lag, seat_friction, soak_lag, thermal_gradient
from thermospindle.sim.operating import operating_point


@pytest.fixture(scope="module")
def tail():
    return load(ROOT / "scenes" / "tailstock")


def front(tail, temperature, rpm, *effects):
    return operating_point(tail, Condition(temperature, rpm * RPM), list(effects)).state.rollers["front1"]


def test_softer_rollers_keep_their_thermal_clearance(tail):
    """It was that of 20 C at every temperature; and the contact is as much softer as steel is, 1 % over 40 K of 11.5 um/(m K)."""
    values = modulus_softening.EFFECT.neutral() | {"scale": 1.0}
    plain, soft = front(tail, 60.0, 0.0), front(tail, 60.0, 0.0, (modulus_softening.EFFECT, values))
    assert plain.clearance < front(tail, 20.0, 0.0).clearance - 1e-6
    assert soft.clearance == pytest.approx(plain.clearance, rel=0.02)
    steel = tail.materials[tail.roller_bearings[0].roller_material]
    assert soft.row.constant / plain.row.constant == pytest.approx(modulus_softening.softening(steel, 60.0, 20.0), rel=1e-6)
    assert soft.row.constant < 0.995 * plain.row.constant


def test_a_ring_that_grows_by_its_rotation_takes_clearance_of_rollers(tail):
    """By twice the growth of the inner ring's radius, the clearance being diametral, less what pressed races give."""
    own = replace(tail, roller_bearings=tuple(replace(b, race_give=0.0) for b in tail.roller_bearings))
    roller = own.roller_bearings[0]
    speed = 4000 * RPM
    growth = speed**2 * ring_growth.unit_growth(own, roller, roller.inner_ring)
    assert growth == pytest.approx(0.186e-6, rel=0.02)
    plain, grown = front(own, 20.0, 4000.0), front(own, 20.0, 4000.0, (ring_growth.EFFECT, {"scale": 1.0}))
    assert plain.clearance - grown.clearance == pytest.approx(2 * growth, rel=1e-6)


def test_seats_that_rub_damp_rollers_as_they_do_balls(tail):
    """A third of the pressure at 60 C triples what seats lose."""
    values = seat_friction.EFFECT.neutral() | {"rubbing_share": 0.25}
    plain, loose = (operating_point(tail, Condition(60.0), effects).state for effects in ([], [(seat_friction.EFFECT, values)]))
    for old, new in ((plain.rollers["front1"], loose.rollers["front1"]), (plain.bearings[0], loose.bearings[0])):
        assert new.damping == pytest.approx((0.75 + 0.25 * 3) * old.damping)
        assert np.array_equal(new.stiffness, old.stiffness)


def test_a_roller_row_asked_for_as_a_ball_row_is_told_as_what_it_is(tail):
    with pytest.raises(BadInput, match=r"bearing 'front1' is a roller row, no ball row; any_bearing\('front1'\) has its state"):
        operating_point(tail, Condition(20.0)).state.bearing("front1")


def test_grease_damps_rollers_as_it_does_balls(tail):
    values = grease_damping.EFFECT.neutral() | {"viscous_share": 1.0}
    plain, thin = (operating_point(tail, Condition(60.0), effects).state for effects in ([], [(grease_damping.EFFECT, values)]))
    viscosity = tail.thermal.friction.viscosity
    ratio = viscosity(60.0) / viscosity(tail.reference_temperature)
    assert thin.rollers["front1"].damping == pytest.approx(ratio * plain.rollers["front1"].damping)
    assert thin.bearings[0].damping == pytest.approx(ratio * plain.bearings[0].damping)
    assert np.array_equal(thin.rollers["front1"].stiffness, plain.rollers["front1"].stiffness)


@pytest.fixture(scope="module")
def alone(tail):
    """The tailstock with rollers in front, and behind a bearing given by numbers in place of its ball rows."""
    behind = LinearBearing("rear", 0.295, "spindle 16", "barrel", (20.0,), (0.0,), tuple(np.diag([3e8, 3e8, 2e8, 0.0, 0.0]).ravel()), 0.02)
    node = min((b for b in tail.structure.bodies if b.turns), key=lambda b: abs(b.z - behind.z))
    return replace(tail, bearings=(), sets=(), linear_bearings=(replace(behind, inner_body=node.name, z=node.z),))


@pytest.mark.parametrize(
    ("effect", "loads"),
    [(thermal_gradient, 1), (fixture_lag, 1), (soak_lag, -1), (cooling_imbalance, 1), (ring_growth, 1)],
    ids=["thermal_gradient", "fixture_lag", "soak_lag", "cooling_imbalance", "ring_growth"],
)
def test_what_rings_do_is_done_to_rollers_alone_too(alone, effect, loads):
    """A warmer or larger inner ring takes clearance, a colder one gives it back: no ball row is needed for that."""
    assert refusal(effect.EFFECT, alone) is None
    values = effect.EFFECT.typical()
    plain, changed = front(alone, 40.0, 4000.0), front(alone, 40.0, 4000.0, (effect.EFFECT, values))
    assert np.sign(plain.clearance - changed.clearance) == loads


def test_grease_damps_rollers_alone_too(alone):
    assert refusal(grease_damping.EFFECT, alone) is None
    assert refusal(preload_loss.EFFECT, alone) == "nothing to act on here: the scene has no ball row"


def test_rollers_have_the_temperature_of_the_standing_ring_as_balls_do(alone):
    """T_ball = T_ref + (1 - ball_share s) (T - T_ref): without a share of the lag rollers are as
    warm as the chamber, and the clearance has all of their growth."""
    values = soak_lag.EFFECT.typical() | {"ball_share": 0.0}
    same = soak_lag.EFFECT.typical() | {"ball_share": 0.5}  # the mean of both rings, as without a say of the effect
    roller, lag = alone.roller_bearings[0], 0.25 * 20.0
    grown = alone.materials[roller.roller_material].thermal_strain(40.0, 40.0 - lag / 2) * roller.roller_diameter
    cold, warm = (front(alone, 40.0, 0.0, (soak_lag.EFFECT, v)).row.clearance for v in (same, values))
    assert cold - warm == pytest.approx(2 * grown, rel=0.02)


def test_a_rigid_shaft_bends_between_bearings_of_any_kind():
    """By numbers as by ball rows: the far bearing is met through the beam. It was told that its
    bearings stand at one height, none being looked at."""
    spindle = load(ROOT / "scenes" / "hdd_2003")
    state = operating_point(spindle, Condition(20.0)).state
    numbers = tuple(
        LinearBearing(b.name, b.z, b.inner_body, b.outer_body, (20.0,), (0.0,), tuple(s.stiffness.ravel()), b.damping_ratio) for b, s in zip(spindle.bearings, state.bearings, strict=True)
    )
    given = replace(spindle, bearings=(), sets=(), linear_bearings=numbers)
    assert refusal(shaft_bending.EFFECT, given) is None
    values = {"scale": 1.0}
    for own in ([], [(shaft_bending.EFFECT, values)]):
        of = [[m.frequency for m in operating_point(s, Condition(20.0), own).modes[:8]] for s in (spindle, given)]
        assert of[1] == pytest.approx(of[0], rel=1e-6)
