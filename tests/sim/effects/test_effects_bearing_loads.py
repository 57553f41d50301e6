"""A magnet, an askew ring and the hammer level, each against something it did not produce."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from tests.effect_points import REST, at, with_tool
from thermospindle.model.bearing.ball_row import energy
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.chain import matrices
from thermospindle.sim.effects.bearing import bearing_misalignment, hertz_amplitude, magnetic_pull
from thermospindle.sim.operating import operating_point


@pytest.mark.parametrize(("pull", "slope", "there"), [(3.0, 0.0, 3.0), (-2.0, 0.0, -2.0), (3.0, -0.12, 3.0 * 0.952**2)])
def test_magnet_shares_its_pull_between_the_bearings(spindle, pull, slope, there):
    """Statics: what the lower bearing carries more than the upper one is the downward pull, less by its remanence 40 K above 20 C."""
    lower, upper = at(spindle, REST, magnetic_pull, pull=pull, remanence_slope=slope).state.bearings
    assert lower.preload - upper.preload == pytest.approx(there, rel=1e-9)


def test_magnets_without_iron_hold_along_the_axis_what_they_push_across(spindle):
    """Earnshaw: the stiffnesses of a magnet in another's field add up to nothing."""
    magnet = at(spindle, REST, magnetic_pull, axial_ratio=2.0).chain.elements[-1]
    assert np.trace(magnet.stiffness) == pytest.approx(0.0, abs=1e-6)
    assert magnet.stiffness[2, 2] > 0


def test_magnet_pushes_away_from_the_middle(spindle):
    """The force on a hub displaced by 1 um against the seat is 30 nN/nm outward, also when the seat tilts under it (lever 3 mm)."""
    point = at(spindle, Condition(20.0), magnetic_pull)
    dofs = list(matrices(point.chain).dofs)
    without = replace(point.chain, elements=point.chain.elements[:-1])
    change = matrices(point.chain).stiffness - matrices(without).stiffness
    hub, seat = dofs.index(("hub", "x")), dofs.index(("seat", "tilt_y"))
    assert change[hub, hub] == pytest.approx(-3e4, rel=1e-6)
    assert change[hub, seat] == pytest.approx(3e4 * 3e-3, rel=1e-6)
    assert point.linear.stiffness == pytest.approx(matrices(point.chain).stiffness, rel=1e-6, abs=1.0)  # MuJoCo carries it


@pytest.mark.parametrize(("below", "body"), [(0, "seat"), (1, "base")])
def test_stator_stands_where_it_is_told(spindle, below, body):
    assert at(spindle, REST, magnetic_pull, below=float(below)).chain.elements[-1].a == body
    assert magnetic_pull.stator_body(spindle, 5) == "base"  # not on the ground


def test_askew_ring_stiffness_is_the_curvature_of_its_energy(hot):
    """Second differences of the row's energy at the tilt (1e-4: the differences' own error)."""
    b, tilt = hot.bearings[1], 0.15e-3
    found = bearing_misalignment.tilted(b, tilt, np.radians(30), 0.0).stiffness
    place = tilt * np.array([0, 0, 0, np.cos(np.radians(30)), np.sin(np.radians(30))])
    step = np.diag(np.array([1, 1, 1, 1 / b.row.arm, 1 / b.row.arm]) * 3e-9)
    scale = np.sqrt(np.outer(np.diag(found), np.diag(found)))
    curvature = np.empty((5, 5))
    for i in range(5):
        for j in range(5):
            signs = ((1, 1), (1, -1), (-1, 1), (-1, -1))
            parts = [p * q * energy(b.row, place + p * step[i] + q * step[j]) for p, q in signs]
            curvature[i, j] = sum(parts) / (4 * step[i, i] * step[j, j])
    assert found / scale == pytest.approx(curvature / scale, abs=2e-4)
    assert abs(found[0, 0] - found[1, 1]) > 1e-3 * found[0, 0]


@pytest.mark.parametrize(("tilt", "lifted"), [(0.53, False), (0.59, True)])
def test_askew_ring_lifts_a_ball(spindle, tilt, lifted):
    """The least loaded ball leaves when arm tilt sin(alpha) = deformation: 0.559 mrad at 20 C from the published state."""
    assert 1.0542e-6 / (4.55e-3 * np.sin(np.radians(24.51))) == pytest.approx(0.559e-3, rel=1e-3)
    state = at(spindle, Condition(20.0), bearing_misalignment, tilt=tilt, direction=90.0).state
    assert state.bearings[1].in_contact is not lifted
    assert state.bearings[0].in_contact
    assert ("upper bearing lost contact" in state.status) is lifted


@pytest.mark.parametrize("relative", [1e-3, 0.05, 0.3, 0.9, 1.0, 2.5])
def test_describing_function_by_quadrature(relative):
    """First harmonic of (1 + a cos t)^1.5 over a, 1.5: adaptive quadrature, split where balls lift off."""
    lift = float(np.arccos(np.clip(-1 / relative, -1, 1)))
    integral = quad(lambda t: max(1 + relative * np.cos(t), 0.0) ** 1.5 * np.cos(t), 0, lift, epsabs=1e-11, epsrel=1e-11)[0]
    assert hertz_amplitude.describing_function(relative) == pytest.approx(2 / (1.5 * np.pi * relative) * integral, rel=2e-6)


def test_small_amplitudes_soften_by_a_thirtysecond():
    """1 - k(a) = a^2 / 32 to the next order, which is of a^4."""
    for relative in (0.05, 0.1):
        assert 1 - hertz_amplitude.describing_function(relative) == pytest.approx(relative**2 / 32, rel=relative**2)


@pytest.mark.parametrize("relative", [0.2, 0.5, 0.8])
def test_softening_against_the_exact_period_of_a_pair(relative):
    """A mass between two opposed Hertz springs: period from energy, T = 4 int dx / v. Harmonic balance errs by (fall)^2."""

    def potential(x):
        return 0.4 * ((1 + x) ** 2.5 + (1 - x) ** 2.5)

    def slowness(t):  # x = a sin t
        x = relative * np.sin(t)
        return relative * np.cos(t) / np.sqrt(2 * (potential(relative) - potential(x)))

    period = 4 * quad(slowness, 0, np.pi / 2 - 1e-7, epsrel=1e-10)[0]
    stiffness = (2 * np.pi / period) ** 2 / 3  # of two springs with unit deformation and constant: 2 * 1.5
    found = hertz_amplitude.describing_function(relative)
    assert found == pytest.approx(stiffness, abs=(1 - stiffness) ** 2 + 1e-6)
    assert 1 - stiffness > relative**2 / 33


def test_hammer_level_against_statics(spindle, cold):
    """10 N on one bearing at 20 C: published axial stiffness 9.755 N/um less the balls' tension, n F / L cos^2, which is 3 % of it."""
    found = hertz_amplitude.amplitude(cold.bearings[0], 10.0)
    angle = np.radians(24.51)
    contacts = 9.755e6 - 10 * 3.857 / 102.68e-6 * np.cos(angle) ** 2
    assert found == pytest.approx(10.0 / contacts * np.sin(angle), rel=2e-3)
    soft, hard = (at(spindle, replace(REST, level=x), hertz_amplitude).state.bearings[0].stiffness for x in (0.0, 5.0))
    assert np.array_equal(soft, operating_point(spindle, REST, []).state.bearings[0].stiffness)
    assert hard[2, 2] < soft[2, 2]


def test_hammer_amplitude_that_does_not_follow_the_contacts(spindle):
    """With power 0 the amplitude is that of the mounted pair at any temperature: at 20 C both are the same, at 60 C, softer, it is smaller."""
    for condition, less in ((Condition(20.0, level=5.0), False), (replace(REST, level=5.0), True)):
        following, fixed = (at(spindle, condition, hertz_amplitude, softness_power=p).state.bearings[0].stiffness[2, 2] for p in (1.0, 0.0))
        assert fixed > following if less else fixed == pytest.approx(following, rel=1e-9)
    hot = at(spindle, replace(REST, level=5.0), hertz_amplitude, softness_power=0.0).state.bearings[0]
    b = operating_point(spindle, REST, []).state.bearings[0]
    mounted = hertz_amplitude.amplitude(operating_point(spindle, Condition(20.0), []).state.bearings[0], 2.5)
    factor = hertz_amplitude.describing_function(mounted / b.deformation)
    assert hot.stiffness == pytest.approx(factor * b.stiffness, rel=1e-6)


def test_two_rings_askew_in_directions_of_their_own(spindle):
    """The lower ring 0.1 mrad about y while the upper one is 0.2 mrad about x: each as if the other were straight."""
    both = at(spindle, REST, bearing_misalignment, tilt=0.2, direction=0.0, lower_across=0.5).state.bearings
    upper = at(spindle, REST, bearing_misalignment, tilt=0.2, direction=0.0).state.bearings[1]
    lower = operating_point(spindle, REST, []).state.bearings[0]
    assert both[1].stiffness == pytest.approx(upper.stiffness, rel=1e-12)
    turned = bearing_misalignment.tilted(lower, 0.1e-3, np.pi / 2, 0.0).stiffness
    assert both[0].stiffness == pytest.approx(turned, rel=1e-9, abs=1e-6 * turned[0, 0])


def test_a_pull_on_a_shaft_whose_inner_rings_turn_loads_the_rows_that_hold_it():
    """Towards -z it is borne by rows whose outer rings load them towards +z, the rear ones, and
    taken off the front ones: 40 N are their difference by statics."""
    mine = replace(with_tool(), sets=tuple(replace(s, spring=None) for s in with_tool().sets))
    before, after = (at(mine, REST, magnetic_pull, pull=pull, remanence_slope=0.0, radial_ratio=0.0).state for pull in (0.0, 40.0))
    carried = {sense: sum(after.bearing(b.name).preload - before.bearing(b.name).preload for b in mine.bearings if b.sense == sense) for sense in (-1, 1)}
    assert carried[-1] < 0.0 < carried[1]
    assert carried[1] - carried[-1] == pytest.approx(40.0, rel=1e-6)
