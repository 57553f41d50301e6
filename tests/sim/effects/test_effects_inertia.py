"""Effects on inertia, each against something it did not produce."""

from dataclasses import replace

import numpy as np
import pytest

from tests.effect_points import NONE, REST, RUNNING, at, frequencies, undamped
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.chain import Element, RotorBase, matrices, motion_rows
from thermospindle.model.rotor.modes import modes
from thermospindle.model.sensors import loaded
from thermospindle.model.structure import Body
from thermospindle.model.units import RPM
from thermospindle.sim.campaign.beside import measured_at
from thermospindle.sim.campaign.campaign import Campaign, Test
from thermospindle.sim.effects.structure import added_disk, hub_flexibility, sensor_mass
from thermospindle.sim.identification.frf import Frf
from thermospindle.sim.operating import operating_point


@pytest.mark.parametrize("speed", [0.0, 7200 * RPM])
@pytest.mark.parametrize("share", [0.3, 0.63])
def test_hub_flexibility_against_two_tilting_discs(spindle, share, speed):
    """With theta = theta_x + i theta_y: I_h t_h'' - i G_h t_h' + (K + k) t_h - k t_r = 0, I_r t_r'' - i G_r t_r' + k (t_r - t_h) = 0.

    Whirl frequencies are the real roots of a polynomial of fourth degree; no damping.
    """
    across, polar, support, compliance = 2.7e-6, 3.6e-6, 1500.0, 150e-6
    hub = Body("hub", 0.026, (across, across, polar), 0.0, ("tilt_x", "tilt_y"), True, ())
    spring = Element("support", "bearings", "ground", "hub", 0.0, np.diag([0, 0, 0, support, support]), NONE)
    chain = hub_flexibility.EFFECT.chain(
        spindle, REST, {"compliance": compliance * 1e6, "rim_share": share, "seat_share": 0.0}, RotorBase((hub,), (spring,), speed)
    )
    web = chain.elements[-1]
    found = undamped(replace(chain, elements=(spring, replace(web, damping=NONE))))
    k, rim = 1 / compliance, share * polar
    middle = np.poly1d([-(across - rim / 2), (polar - rim) * speed, support + k])
    outer = np.poly1d([-rim / 2, rim * speed, k])
    exact = sorted(np.abs((middle * outer - k**2).roots.real) / (2 * np.pi))
    assert found == pytest.approx(exact, rel=1e-8)


def test_hub_flexibility_in_the_seats_of_the_rings(spindle):
    """A moment of 1 N m through one bearing alone, its ring free to move sideways: its tilt is more by the compliance of the seat; so is
    the hub's web by the rest."""
    plain, point = operating_point(spindle, REST, ()), at(spindle, REST, hub_flexibility, compliance=200.0, seat_share=0.25)
    for name in ("lower", "upper"):
        old, new = (np.linalg.inv(next(e.stiffness for e in p.chain.elements if e.name == name)) for p in (plain, point))
        assert new - old == pytest.approx(np.diag([0, 0, 0, 50e-6, 50e-6]), abs=1e-12)
    assert point.chain.elements[-1].stiffness[3, 3] == pytest.approx(1 / 150e-6, rel=1e-12)
    all_in_seats = at(spindle, REST, hub_flexibility, compliance=200.0, seat_share=1.0)
    assert [b.name for b in all_in_seats.chain.bodies] == [b.name for b in plain.chain.bodies]


def test_hub_flexibility_keeps_the_hub_whole(spindle):
    """A web a million times stiffer than typical: the rigid hub's modes, mass and gyroscopic terms, to 1e-6."""
    rigid = frequencies(operating_point(spindle, RUNNING, ()))
    assert frequencies(at(spindle, RUNNING, hub_flexibility, compliance=1e-4)) == pytest.approx(rigid, rel=1e-5)


def test_hub_flexibility_damping_of_the_web(spindle):
    """A rim alone on its web, tuned to the structure's damping frequency (1500 Hz), has a damping ratio of 0.2 %."""
    rim = 1e-6
    compliance = 1 / (rim * (2 * np.pi * 1500) ** 2)
    values = {"compliance": 1e6 * compliance, "rim_share": 0.5, "seat_share": 0.0}
    hub = Body("hub", 0.03, (rim, rim, 4 * rim), 0.0, ("tilt_x", "tilt_y"), True, ())
    web = hub_flexibility.EFFECT.chain(spindle, REST, values, RotorBase((hub,), (), 0.0)).elements[0]
    alone = RotorBase((Body("hub rim", 0.01, (rim, rim, 2 * rim), 0.0, ("tilt_x", "tilt_y"), True, ()),), (replace(web, a="ground"),), 0.0)
    assert [m.damping_ratio for m in modes(alone)] == pytest.approx([0.002, 0.002], rel=1e-9)
    assert [m.frequency for m in modes(alone)] == pytest.approx([1500, 1500], rel=1e-9)


def test_hub_flexibility_typical_web_against_plate_theory():
    """Both edges clamped, w = (A r + B / r + C r^3 + D r ln r) cos: k = 4 pi D_plate D. 37 urad/(N m), a half to a third of typical."""
    b, a, plate = 7.5e-3, 14.5e-3, 70e9 * 3e-3**3 / 12 / (1 - 0.33**2)
    shapes = [[r, 1 / r, r**3, r * np.log(r)] for r in (b, a)]
    slopes = [[1, -1 / r**2, 3 * r**2, np.log(r) + 1] for r in (b, a)]
    coefficient = np.linalg.solve([shapes[0], slopes[0], shapes[1], slopes[1]], [0, 0, a, 1])[3]
    compliance = 1e6 / (4 * np.pi * plate * coefficient)
    assert compliance == pytest.approx(37, abs=0.5)
    assert 2 < hub_flexibility.EFFECT.parameters[0].typical / compliance < 3


def test_hub_flexibility_rim_share_against_the_section(spindle):
    """Polar inertia of yoke, magnet and the plate beyond 12.5 mm over that of the whole hub."""
    rings = [(14.5, 16, 4, 7700), (13, 14.5, 4, 7500), (12.5, 16, 3, 2700)]
    rim = sum(np.pi / 2 * rho * h * 1e-3 * ((r1 * 1e-3) ** 4 - (r0 * 1e-3) ** 4) for r0, r1, h, rho in rings)
    share = rim / spindle.structure.body("hub").inertia[2]
    assert hub_flexibility.EFFECT.parameters[1].typical == pytest.approx(share, abs=0.02)


def test_added_disk_against_its_points(spindle):
    """Hub and disk as clouds of points: mass, centre and all three inertias by summing over the points."""
    mass, radius, height = 4e-3, 30e-3, 5e-3
    hub = spindle.structure.body("hub")
    point = at(spindle, REST, added_disk, mass=4.0, outer_radius=30.0, height=5.0)
    found = point.chain.body("hub")
    r = np.sqrt((np.arange(200) + 0.5) / 200) * radius  # equal areas
    angle = 2 * np.pi * (np.arange(12) + 0.5) / 12
    x, y = (np.outer(r, f(angle)).ravel() for f in (np.cos, np.sin))
    z = 20e-3 + height
    centre = (hub.mass * hub.z + mass * z) / (hub.mass + mass)
    assert (found.mass, found.z) == pytest.approx((hub.mass + mass, centre), rel=1e-12)
    cloud = [np.mean(y**2) + (z - centre) ** 2, np.mean(x**2) + (z - centre) ** 2, np.mean(x**2 + y**2)]
    own = np.array(hub.inertia) + hub.mass * (hub.z - centre) ** 2 * np.array([1, 1, 0])
    assert found.inertia == pytest.approx(own + mass * np.array(cloud), rel=1e-5)


def test_added_disk_at_the_axis_of_a_mass_is_that_mass(spindle):
    """A point mass at the hub's own centre adds no inertia."""
    hub = spindle.structure.body("hub")
    found = at(spindle, REST, added_disk, mass=10.0, outer_radius=0.0, height=1e3 * hub.z - 20.0).chain.body("hub")
    assert (found.mass, found.z, found.inertia) == (pytest.approx(hub.mass + 0.01), pytest.approx(hub.z), pytest.approx(hub.inertia))


def test_sensor_mass_against_rayleigh(spindle):
    """A milligram at all points: d ln f = -sum mass |phi|^2 / 2 phi^T M phi with every point's motion in space, first moments included.

    The chain leaves these out; 2 % of the largest shift says how little they matter at rest. Equal masses on all parts.
    """
    point = operating_point(spindle, Condition(20.0), ())
    linear, mass = matrices(point.chain), 1e-6
    heavier = at(spindle, Condition(20.0), sensor_mass, mass=mass * 1e3, turning_share=1.0)
    shift = frequencies(heavier) / frequencies(point) - 1
    for i, mode in enumerate(modes(point.chain, linear, highest=3000)[:5]):
        phi = mode.shape
        moved = sum(np.sum(np.abs(motion_rows(point.chain, p.body, p.position)[:3] @ phi) ** 2) for p in spindle.points)
        exact = -mass * moved / (2 * np.real(phi.conj() @ linear.mass @ phi))
        assert shift[i] == pytest.approx(exact, abs=0.02 * np.abs(shift).max())


def test_sensor_mass_of_one_sensor(spindle):
    """A gram at (20, 0, 0) mm on the seat: one gram, none about x, 1e-3 x 0.02^2 about y and z."""
    seat = spindle.structure.body("seat")
    found = loaded(seat, spindle.point(5), 1e-3, 1.0)
    assert found.mass - seat.mass == pytest.approx(1e-3)
    assert np.subtract(found.inertia, seat.inertia) == pytest.approx([0, 4e-7, 4e-7], abs=1e-15)


def test_a_sensor_whose_mass_is_told_is_in_the_model(spindle):
    """Of a point of the seat: the matrices of the effect with a gram at that point alone; the
    drawing stays what it was, and what is not told weighs nothing."""
    told = replace(spindle, points=tuple(replace(p, mass=1e-3 if p.node == 5 else 0.0) for p in spindle.points))
    alone = replace(spindle, points=tuple(replace(p, listens=p.node == 5) for p in spindle.points))
    expected = at(alone, Condition(40.0), sensor_mass, mass=1.0, turning_share=1.0).chain
    for condition in (Condition(40.0), Condition(40.0, spindle.nominal_speed)):
        found = operating_point(told, condition, ())
        assert found.chain.bodies == expected.bodies
        assert found.chain.bodies != operating_point(spindle, condition, ()).chain.bodies
        assert len(found.measurement.response_rows) == len(spindle.points)
    assert told.structure is spindle.structure
    both = at(told, Condition(40.0), sensor_mass, mass=2.0, turning_share=1.0).chain
    assert both.body("seat").mass == pytest.approx(spindle.structure.body("seat").mass + 1e-3 + 2e-3 * sum(p.body == "seat" for p in spindle.points), rel=1e-12)


def test_a_point_that_is_only_struck_has_no_sensor(spindle):
    """A roving hammer: the mass of the sensors is where they are read, and not at every point of
    the hammer. Eight grams of two accelerometers were 32 on a housing."""
    frf = Frf(np.array([800.0, 1200.0]), np.ones((1, 3, 2), complex), (5,), (1, 3, 6), "mobility")
    test = Test("roving", 20.0, 0.0, frf=frf)
    own = measured_at(spindle, Campaign("roving", spindle.name, "mobility", spindle.points, (test,)), test)
    assert [p.listens for p in own.points] == [True, False, False, False]
    masses = [at(own, Condition(20.0), sensor_mass, mass=m, turning_share=1.0).chain for m in (0.0, 1.0)]
    assert sum(b.mass for b in masses[1].bodies) - sum(b.mass for b in masses[0].bodies) == pytest.approx(1e-3, rel=1e-9)


def test_balanced_sensors_leave_the_centre_of_mass(spindle):
    """Half a gram at (12, 0, 20) mm on the hub and half its mirror image in z: the inertia of both,
    spread round the axis; a quarter shifts."""
    hub, point = spindle.structure.body("hub"), spindle.point(1)
    found = loaded(hub, point, 1e-3, 0.0)
    arm = 20e-3 - hub.z
    assert (found.mass - hub.mass, found.z) == (pytest.approx(1e-3), pytest.approx(hub.z))
    across = 1e-3 * (12e-3**2 / 2 + arm**2)
    assert np.subtract(found.inertia, hub.inertia) == pytest.approx([across, across, 1e-3 * 12e-3**2], rel=1e-9)
    quarter = loaded(hub, point, 1e-3, 0.25)
    assert quarter.mass * (quarter.z - hub.z) == pytest.approx(0.25e-3 * arm, rel=1e-9)
