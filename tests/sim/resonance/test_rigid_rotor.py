"""The resonance map of one rigid isotropic rotor against the closed form of its critical speeds."""

from dataclasses import replace

import numpy as np
import pytest

from thermospindle.model.machine import Condition
from thermospindle.model.structure import Body
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point
from thermospindle.sim.resonance.map import resonance_map
from thermospindle.sim.resonance.point import key


@pytest.fixture(scope="module")
def rigid(spindle):
    """A hub that only tilts, on its two bearings and a shaft that does not move: one isotropic rotor, without damping."""
    hub = spindle.structure.body("hub")
    tilting = Body("hub", 0.05, (1e-5, 1e-5, 1.6e-5), 0.012, ("tilt_x", "tilt_y"), True, hub.regions)
    held = replace(spindle.structure.body("shaft"), moves=())
    bearings = tuple(replace(b, damping_ratio=0.0) for b in spindle.bearings)
    return replace(spindle, bearings=bearings, structure=replace(spindle.structure, bodies=(held, tilting), joints=()))


def tilt_stiffness(point):
    """Of both bearings about the hub's centre, N m/rad: with lever a = z_bearing - z, k_t + 2 a k_x,ty + a^2 k_x (about y)."""
    total = 0.0
    for b in point.state.bearings:
        lever = b.z - 0.012
        total += b.stiffness[4, 4] + 2 * lever * b.stiffness[0, 4] + lever**2 * b.stiffness[0, 0]
    return total


def crossing_speed(k, c, whirl, transverse=1e-5, polar=1.6e-5):
    """Speed (rad/s) at which c times it meets a tilting mode: It (c n)^2 - whirl Ip n (c n) = k (Genta 2005, Eq. 2.23)."""
    return np.sqrt(k / (transverse * c**2 - whirl * polar * c))


@pytest.mark.parametrize(("hertz", "whirl"), [(1842.096, 1), (1650.096, -1)])
def test_closed_form_meets_the_published_rotor(hertz, whirl):
    """The formula these tests use gives 7200 rpm for the lines that pass 1842.096 and 1650.096 Hz there, k 1200 N m/rad."""
    assert crossing_speed(1200.0, hertz / 120.0, whirl) / RPM == pytest.approx(7200.0, rel=1e-6)


def test_crossings_of_a_rigid_rotor(rigid):
    """Every coincidence of the isotropic rotor is where the closed form puts it, and the senses do not mix."""
    own = resonance_map(rigid, [20.0, 40.0, 60.0], np.linspace(0, 30000, 31) * RPM, Condition(20.0, 9000 * RPM), highest=1e4)
    radial = [c for c in own.coincidences if c.line.direction == "radial"]
    assert len(radial) >= 20
    assert {c.mode.whirl for c in radial} == {"forward", "backward"}
    for c in radial:
        assert c.line.whirl == {"forward": 1, "backward": -1}[c.mode.whirl]
        assert c.sense == pytest.approx(1.0, abs=1e-9)
        point = operating_point(rigid, c.condition)
        multiple = c.frequency * 2 * np.pi / c.condition.speed
        assert c.condition.speed == pytest.approx(crossing_speed(tilt_stiffness(point), multiple, c.line.whirl), rel=1e-5)
    found = {key(c.line) for c in radial}
    stiffness = [tilt_stiffness(operating_point(rigid, Condition(t, 9000 * RPM))) for t in own.temperatures]
    grid = own.nominal_index[1]
    for t in own.lines:  # none that crosses inside the grid, at whichever temperature, is missing, and no other is there
        if t.line.direction == "radial" and t.line.whirl > 0 and t.line.frequency > 500:
            multiple = t.frequency[:, grid] / (own.speeds[grid] / (2 * np.pi))
            crosses = [1e-5 * c > 1.6e-5 and crossing_speed(k, c, 1) < 30000 * RPM for k, c in zip(stiffness, multiple, strict=True)]
            assert (key(t.line) in found) == any(crosses)
