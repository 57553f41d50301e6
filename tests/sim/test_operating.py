"""The operating point with ring motions of its own, and with effects that prescribe temperatures."""

import pytest

from tests.conftest import ROOT
from thermospindle.model.errors import NoEquilibrium
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.effects.temperature import soak_lag, thermal_gradient
from thermospindle.sim.operating import operating_point
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
