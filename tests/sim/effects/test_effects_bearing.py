"""Effects on temperature, ring motion and bearings: what all of them keep to, and the modes they move."""

from dataclasses import replace

import numpy as np
import pytest

from tests.effect_points import COLD_FAST, REST, RUNNING, at
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.chain import matrices
from thermospindle.model.rotor.modes import modes
from thermospindle.model.units import RPM
from thermospindle.sim.effects.bearing import (
    ball_inertia,
    ball_material,
    bearing_misalignment,
    bond_softening,
    clearance_opening,
    constant_force_preload,
    grease_damping,
    hertz_amplitude,
    lubricant_film,
    magnetic_pull,
    preload_loss,
    ring_growth,
)
from thermospindle.sim.effects.temperature import expansion_mismatch, fixture_lag, loose_inserts, seat_friction, soak_lag, thermal_gradient
from thermospindle.sim.operating import operating_point
from thermospindle.thermal.expansion import expand

MODULES = (
    ball_inertia,
    ball_material,
    bearing_misalignment,
    bond_softening,
    clearance_opening,
    constant_force_preload,
    expansion_mismatch,
    fixture_lag,
    seat_friction,
    grease_damping,
    hertz_amplitude,
    loose_inserts,
    lubricant_film,
    magnetic_pull,
    preload_loss,
    ring_growth,
    soak_lag,
    thermal_gradient,
)


def frequencies(point, kind):
    return np.array([m.frequency for m in modes(point.chain) if m.kind == kind])


@pytest.mark.parametrize("module", MODULES, ids=lambda m: m.EFFECT.name)
def test_a_size_of_zero_returns_the_same_objects(spindle, module):
    """Whatever the shape parameters are."""
    effect = module.EFFECT
    size, *shape = effect.parameters
    values = {size.name: size.neutral} | {p.name: (p.typical + p.limits[1]) / 2 for p in shape}
    condition = replace(RUNNING, level=20.0, soak_time=600.0)
    point = operating_point(spindle, condition, [])
    states = {
        "spindle": spindle,
        "temperatures": {g.name: 60.0 for g in spindle.regions},
        "motions": expand(spindle, 60.0),
        "pair": point.state,
        "chain": point.chain,
    }
    acting = [step for step in states if getattr(effect, step)]
    assert acting
    for step in acting:
        first = () if step == "spindle" else (spindle,)
        last = () if step == "spindle" else (states[step],)
        function = getattr(effect, step)
        result = function(spindle, condition, values) if step == "spindle" else function(*first, condition, values, *last)
        assert result is states[step]


@pytest.mark.parametrize("module", [thermal_gradient, lubricant_film, ring_growth, ball_inertia], ids=lambda m: m.EFFECT.name)
def test_effects_of_speed_rest_at_rest(spindle, module):
    plain, point = operating_point(spindle, REST, []), at(spindle, REST, module)
    assert np.array_equal(matrices(point.chain).stiffness, matrices(plain.chain).stiffness)


@pytest.mark.parametrize(
    ("module", "condition", "axial", "rocking"),
    [
        (thermal_gradient, Condition(20.0, 7200 * RPM), 1, 1),
        (soak_lag, REST, 1, 1),
        (fixture_lag, REST, -1, -1),
        (expansion_mismatch, REST, -1, -1),
        (loose_inserts, REST, -1, -1),
        (preload_loss, REST, -1, -1),
        (constant_force_preload, REST, 1, 1),
        (bond_softening, REST, -1, -1),
        (ball_material, REST, -1, -1),
        (lubricant_film, RUNNING, 1, 1),
        (ball_inertia, COLD_FAST, -1, -1),
        (ring_growth, RUNNING, -1, -1),
        (magnetic_pull, REST, -1, -1),
        (hertz_amplitude, replace(REST, level=20.0), -1, -1),
        (clearance_opening, REST, -1, -1),
    ],
    ids=lambda x: x.EFFECT.name if hasattr(x, "EFFECT") else None,
)
def test_bearing_modes_move_as_declared(spindle, module, condition, axial, rocking):
    """The axial bearing mode (third axial one) and all four rocking modes below 3 kHz, by more than 5 mHz and 50 mHz."""
    plain, point = operating_point(spindle, condition, []), at(spindle, condition, module)
    assert axial * (frequencies(point, "axial") - frequencies(plain, "axial"))[2] > 0.005
    moved = (frequencies(point, "rocking") - frequencies(plain, "rocking"))[:4]
    assert rocking * moved.sum() > 0.05
    assert np.all(rocking * moved > -0.005)


def test_a_tilted_ring_moves_the_rocking_pair_apart(spindle):
    """About x the row stiffens in tilt_y as balls away from the axis load up: the pair of the hub
    on its bearings parts at rest. Either way alike, and as the square of the tilt while it is
    small; at the typical 0.2 mrad, where the least loaded balls lose more than half, faster."""
    plain = operating_point(spindle, REST, [])

    def parted(tilt):
        point = at(spindle, REST, bearing_misalignment, tilt=tilt)
        return (point.modes[6].frequency - point.modes[5].frequency) - (plain.modes[6].frequency - plain.modes[5].frequency)

    assert parted(0.2) == pytest.approx(parted(-0.2), rel=1e-6)
    assert parted(0.1) == pytest.approx(4 * parted(0.05), rel=0.1)
    assert parted(0.2) > 4 * parted(0.1) > 1.0


def test_every_module_is_named_after_its_effect():
    assert [module.__name__.rsplit(".", 1)[-1] for module in MODULES] == [module.EFFECT.name for module in MODULES]
