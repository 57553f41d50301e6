"""Model forms against first principles and published numbers: bearings as at the reference, held axially, in balance."""

from dataclasses import replace

import numpy as np
import pytest

from thermospindle.diagnosis.ladder.forms import FIXED_STIFFNESS, FORMS, RADIAL_EXPANSION
from thermospindle.model.bearing.pair import PairState, solve
from thermospindle.model.bearing.row import reference_motion
from thermospindle.model.machine import Condition
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point


@pytest.mark.parametrize("speed", [0.0, 7200 * RPM], ids=["at rest", "7200 rpm"])
@pytest.mark.parametrize("temperature", [-10.0, 20.0, 47.0, 60.0])
def test_fixed_stiffness_is_that_of_the_reference_temperature(spindle, temperature, speed):
    reference = operating_point(spindle, Condition(20.0, speed), ())
    point = operating_point(spindle, Condition(temperature, speed), FORMS[0].applied)
    for fixed, expected in zip(point.state.bearings, reference.state.bearings, strict=True):
        assert np.array_equal(fixed.stiffness, expected.stiffness)
        assert np.array_equal(fixed.damping, expected.damping)
        assert fixed.preload == expected.preload


OUTWARD = [(0.2, 12.06), (0.4, 8.51), (0.6, 5.39), (0.8, 2.78), (1.0, 0.82)]


@pytest.mark.parametrize(("outward_um", "preload"), OUTWARD)
def test_outer_race_moved_outward_at_fixed_axial_position(spindle, outward_um, preload):
    """Computed outside this project. Only the upper ring moves, so the balanced hub goes somewhere else, and the held one does not."""
    still = reference_motion(20.0)
    state = solve(spindle, Condition(20.0), {"lower": still, "upper": replace(still, outer_r=1e-6 * outward_um)})
    held = RADIAL_EXPANSION.pair(spindle, Condition(20.0), {"share": 1.0}, state)
    assert held.bearing("upper").preload == pytest.approx(preload, rel=2e-3, abs=5e-3)  # printed to 0.01 N
    assert held.bearing("lower").preload == pytest.approx(spindle.sets[0].preload, rel=1e-9)
    assert state.bearing("upper").preload == pytest.approx(state.bearing("lower").preload, rel=1e-9)
    assert state.bearing("upper").preload > 1.02 * preload


def test_a_form_keeps_bearings_that_it_does_not_change(spindle):
    """Those given by numbers, and rollers: a form of ball rows leaves them where they are."""
    state = PairState(Condition(20.0), (), 0.0, "in contact", linear=("a row of rollers",))  # type: ignore[arg-type]
    assert RADIAL_EXPANSION.pair(spindle, Condition(20.0), {"share": 1.0}, state).linear == state.linear


def test_radial_expansion_keeps_the_axial_distance_and_grows_radially(spindle):
    """The forces of the two rows no longer balance, and a row that lost contact has no stiffness."""
    full = operating_point(spindle, Condition(60.0), ()).state
    cold = operating_point(spindle, Condition(20.0), ()).state
    held = operating_point(spindle, Condition(60.0), FORMS[1].applied).state
    for name in ("lower", "upper"):
        assert held.bearing(name).row.axial == pytest.approx(cold.bearing(name).row.axial, rel=1e-12)
        assert held.bearing(name).row.radial == full.bearing(name).row.radial
    assert held.hub_movement == 0.0
    assert held.bearing("lower").preload > held.bearing("upper").preload + 1.0
    assert held.status == "upper bearing lost contact"
    assert not held.bearing("upper").stiffness.any()


def test_radial_expansion_at_the_reference_is_the_reference(spindle):
    one, other = (operating_point(spindle, Condition(20.0), f.applied).state for f in FORMS[1:])
    for a, b in zip(one.bearings, other.bearings, strict=True):
        assert a.stiffness == pytest.approx(b.stiffness, rel=1e-9)
        assert a.damping == pytest.approx(b.damping, rel=1e-9)
        assert a.contact_force == pytest.approx(b.contact_force, rel=1e-9)


def test_axial_equilibrium_is_the_model_itself(spindle):
    assert FORMS[2].applied == ()
    plain = operating_point(spindle, Condition(55.0), ()).state
    for effect in (FIXED_STIFFNESS, RADIAL_EXPANSION):
        neutral = operating_point(spindle, Condition(55.0), [(effect, effect.neutral())]).state
        assert all(np.array_equal(a.stiffness, b.stiffness) for a, b in zip(neutral.bearings, plain.bearings, strict=True))


@pytest.mark.parametrize("effect", [FIXED_STIFFNESS, RADIAL_EXPANSION], ids=lambda e: e.name)
def test_a_share_lies_between_the_forms(spindle, effect):
    preload = [operating_point(spindle, Condition(40.0), [(effect, {"share": s})]).state.bearing("upper").preload for s in (0, 0.5, 1)]
    assert min(preload[0], preload[2]) < preload[1] < max(preload[0], preload[2])
