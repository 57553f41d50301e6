"""The operating point with ring motions of its own, and with effects that prescribe temperatures."""

from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import ROOT
from thermospindle.model.errors import NoEquilibrium, OutsideRange
from thermospindle.model.machine import Condition
from thermospindle.model.material import Law
from thermospindle.model.scene.reading import load
from thermospindle.model.span import temperature_range
from thermospindle.model.units import RPM
from thermospindle.sim.effects.structure import modulus_softening, shear
from thermospindle.sim.effects.temperature import soak_lag, thermal_gradient
from thermospindle.sim.operating import drawing, operating_point
from thermospindle.thermal.expansion import expand


def test_given_expansion_is_that_of_the_drawing_at_another_temperature(spindle):
    """Bearings as at 60 C by motions alone; what effects do to motions comes after."""
    warm = operating_point(spindle, Condition(60.0), ())
    asked = []

    def expansion(drawn):
        asked.append(drawn)
        return expand(drawn, 60.0)

    given = operating_point(spindle, Condition(20.0), (), expansion)
    assert asked == [spindle]
    assert [b.preload for b in given.state.bearings] == [b.preload for b in warm.state.bearings]
    assert given.condition.temperature == 20.0


def test_two_that_give_region_temperatures_are_refused(spindle):
    effects = [(e, e.typical()) for e in (soak_lag.EFFECT, thermal_gradient.EFFECT)]
    with pytest.raises(ValueError, match="soak_lag, thermal_gradient would prescribe them"):
        operating_point(spindle, Condition(60.0), effects, lambda drawn: expand(drawn, 60.0))


def test_where_nothing_settles_the_condition_is_named():
    """And what of it no bearing bears: the speed, by its factor."""
    with pytest.raises(NoEquilibrium, match=r"^at 20 C and 1e\+06 rpm .*did not settle.*speed factor n dm of .* in the front1, front2 and front3 bearings"):
        operating_point(load(ROOT / "scenes" / "five_bearing"), Condition(20.0, 1e6 * RPM), ())


def test_a_shafts_modulus_follows_the_temperature():
    """Its frequencies go with the root of E(T) / E(20 C), Poisson's ratio being the same, and
    effects act on top; where E is a constant nothing is touched."""
    shaft = load(ROOT / "scenes" / "free_shaft")
    warm = Condition(120.0)
    assert operating_point(shaft, warm).spindle is shaft
    steel = shaft.materials["steel"]
    softer = replace(shaft, materials={"steel": replace(steel, youngs_modulus=Law((20.0, 120.0), (207e9, 198e9)))})
    for effects in ((), ((shear.EFFECT, {"scale": 1.0}),)):
        own, there = (operating_point(s, warm, effects).modes_below(5000.0) for s in (shaft, softer))
        assert len(own) > 3
        assert [m.frequency for m in there] == pytest.approx([np.sqrt(198 / 207) * m.frequency for m in own], rel=1e-7)
        assert [m.frequency for m in operating_point(softer, Condition(20.0), effects).modes_below(5000.0)] == [m.frequency for m in own]
    with pytest.raises(OutsideRange, match=r"from 20 to 120 C was asked at 130 C"):
        operating_point(softer, Condition(130.0))


def test_a_joints_stiffness_follows_the_modulus_of_its_material(spindle):
    """In proportion; at the reference by nothing, and a joint without a material stays. What an effect softens comes on top."""
    aluminium = spindle.materials["aluminium"]
    softer = replace(spindle, materials=spindle.materials | {"aluminium": replace(aluminium, youngs_modulus=Law((20.0, 60.0), (70e9, 63e9)))})
    drawn = {t: drawing(softer, Condition(t), ()).structure.joints for t in (20.0, 60.0)}
    assert drawn[20.0] == spindle.structure.joints
    assert [j.stiffness for j in drawn[60.0]] == [pytest.approx([0.9 * k for k in j.stiffness], rel=1e-12) for j in spindle.structure.joints]
    bare = replace(softer, structure=replace(softer.structure, joints=tuple(replace(j, material="") for j in softer.structure.joints)))
    assert drawing(bare, Condition(60.0), ()) is bare
    soft = {"scale": 1.0, "joint_share": 1.0}
    both, alone = (drawing(s, Condition(60.0), ((modulus_softening.EFFECT, soft),)).structure.joints for s in (softer, spindle))
    assert [j.stiffness for j in both] == [pytest.approx([0.9 * k for k in j.stiffness], rel=1e-12) for j in alone]
    assert temperature_range(softer, lubricant=False) == (20.0, 60.0)
