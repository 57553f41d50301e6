"""Effects on preload and clearance, each against something it did not produce."""

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.effect_points import at
from thermospindle.model.bearing.pair import solve
from thermospindle.model.bearing.row import reference_motion
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.sim.effects.bearing import clearance_opening, constant_force_preload, preload_loss
from thermospindle.sim.operating import operating_point


@pytest.mark.parametrize(("loss", "share", "temperature", "left"), [
    (0.15, 0.0, 20.0, 0.85), (0.15, 1.0, 20.0, 1.0), (0.15, 0.5, 20.0, 0.85**0.5), (-0.2, 0.0, 20.0, 1.2),
])  # fmt: skip
def test_lost_preload_against_hertz(spindle, loss, share, temperature, left):
    """The force that is left, and n K delta^1.5 sin(alpha) with the published K (1e-3, its printed digits)."""
    state = at(spindle, Condition(temperature), preload_loss, loss=loss, thermal_share=share).state
    for b in state.bearings:
        assert b.preload == pytest.approx(16.0 * left, rel=1e-8)
        assert 10 * 3.5632e9 * b.deformation**1.5 * np.sin(b.contact_angle) == pytest.approx(16.0 * left, rel=1e-3)


@pytest.mark.parametrize(("which", "left"), [(-1.0, {"front": 0.8, "rear": 0.8}), (0.0, {"front": 0.8, "rear": 1.0}), (1.0, {"front": 1.0, "rear": 0.8})])
def test_one_set_of_several_loses_its_preload(which, left):
    """Each row of a machine tool's two sets carries what is left of its own set's force, and the rest all of theirs."""
    machine = load(ROOT / "scenes" / "five_bearing")
    cold = Condition(machine.reference_temperature)
    before, after = ({b.name: b.preload for b in operating_point(machine, cold, e).state.bearings} for e in ((), lost(which)))
    for s in machine.sets:
        for name in s.bearings:
            assert after[name] == pytest.approx(left[s.name] * before[name], rel=1e-6), name


def lost(which):
    return [(preload_loss.EFFECT, {"loss": 0.2, "thermal_share": 0.0, "set": which})]


def test_thermal_loss_is_whole_at_40_K(spindle):
    values = preload_loss.EFFECT.typical() | {"thermal_share": 0.7}
    assert preload_loss.remaining(spindle, Condition(60.0), values) == pytest.approx(1 - values["loss"], rel=1e-12)


@pytest.mark.parametrize("temperature", [30.0, 60.0])
def test_a_soft_spring_keeps_the_preload(spindle, temperature):
    for b in at(spindle, Condition(temperature), constant_force_preload, share=1.0).state.bearings:
        assert b.preload == pytest.approx(16.0, rel=3e-5)  # Hertz constants belong to the place a ring has before the pair balances


def test_a_preload_spring_in_series_with_the_pair(spindle):
    """A spring as stiff as the pair (share 1/2) halves the change of preload; 2 % for the pair's curvature over 2 K."""
    change = [at(spindle, Condition(22.0), constant_force_preload, share=s).state.bearings[0].preload - 16.0 for s in (0.0, 0.5)]
    assert change[0] < -0.3
    assert change[1] == pytest.approx(change[0] / 2, rel=0.02)


@pytest.mark.parametrize(("outward", "preload"), [(0.2, 12.06), (0.4, 8.51), (0.6, 5.39), (0.8, 2.78), (1.0, 0.82)])
def test_opened_clearance_against_published_preload(spindle, outward, preload):
    """verification.md: outer races moved outward, 2e-3 and the printed digits; the clearance opens by twice the movement."""
    values = {"opening": 2 * outward, "thermal_share": 0.0}
    still = {b.name: reference_motion(20.0) for b in spindle.bearings}
    state = solve(spindle, Condition(20.0), clearance_opening.EFFECT.motions(spindle, Condition(20.0), values, still))
    assert state.bearings[0].preload == pytest.approx(preload, abs=max(2e-3 * preload, 5e-3))


def test_opening_by_temperature_is_told_at_40_K(spindle):
    opened = [at(spindle, Condition(t), clearance_opening, thermal_share=1.0).state.bearings[0].preload for t in (20.0, 60.0)]
    worn = at(spindle, Condition(60.0), clearance_opening, thermal_share=0.0).state.bearings[0].preload
    assert opened == pytest.approx([16.0, worn], rel=1e-12)
