"""Effects of bearings on cylindrical rollers, which they forgot: of the tailstock, whose front bearing has two rows of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import ROOT
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.effects.bearing import grease_damping, ring_growth
from thermospindle.sim.effects.structure import modulus_softening
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


def test_grease_damps_rollers_as_it_does_balls(tail):
    values = grease_damping.EFFECT.neutral() | {"viscous_share": 1.0}
    plain, thin = (operating_point(tail, Condition(60.0), effects).state for effects in ([], [(grease_damping.EFFECT, values)]))
    viscosity = tail.thermal.friction.viscosity
    ratio = viscosity(60.0) / viscosity(tail.reference_temperature)
    assert thin.rollers["front1"].damping == pytest.approx(ratio * plain.rollers["front1"].damping)
    assert thin.bearings[0].damping == pytest.approx(ratio * plain.bearings[0].damping)
    assert np.array_equal(thin.rollers["front1"].stiffness, plain.rollers["front1"].stiffness)
