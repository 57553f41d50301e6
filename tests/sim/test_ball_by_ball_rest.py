"""Ball-by-ball models rest where they are loaded, whatever effect bears on them."""

import mujoco
import numpy as np
import pytest

from thermospindle.model.machine import Condition
from thermospindle.model.rotor import mjcf
from thermospindle.sim.effects import CATALOGUE
from thermospindle.sim.operating import operating_point


@pytest.mark.parametrize("effect", [e for e in CATALOGUE if e.spindle or e.motions or e.temperatures or e.pair], ids=lambda e: e.name)
def test_the_loaded_state_is_one_of_rest(spindle, effect):
    """No acceleration beyond rounding of forces of some newtons on grams, and the same linear stiffness as the linear elements."""
    point = operating_point(spindle, Condition(40.0, 700.0, 1.0), [(effect, effect.typical())])
    model = point.spec("ball-by-ball").compile()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("loaded").id)
    mujoco.mj_forward(model, data)
    assert np.abs(data.qacc).max() < 1e-6
    linear = mjcf.linearise(model).stiffness
    np.testing.assert_allclose(linear, point.linear.stiffness, atol=5e-7 * np.abs(linear).max())


def test_a_magnet_pulls_with_its_dead_load(spindle):
    """The bias of the pair appears as a constant force on hub and shaft, equal and opposite."""
    magnet = next(e for e in CATALOGUE if e.name == "magnetic_pull")
    point = operating_point(spindle, Condition(20.0), [(magnet, magnet.typical())])
    model = point.spec("ball-by-ball").compile()
    loads = {model.actuator(i).name: model.actuator_biasprm[i, 0] for i in range(model.nu) if "dead load" in model.actuator(i).name}
    assert set(loads) == {"dead load shaft.z", "dead load hub.z"}
    assert loads["dead load hub.z"] == pytest.approx(-loads["dead load shaft.z"])
    assert abs(loads["dead load hub.z"]) == pytest.approx(abs(point.spindle.axial_load), rel=1e-9)
