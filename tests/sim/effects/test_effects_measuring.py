"""Effects on the measuring chain, each against something it did not produce."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.effect_points import RUNNING, at
from thermospindle.model.machine import Addition, Condition
from thermospindle.model.rotor.chain import matrices
from thermospindle.model.rotor.frf import frf, point_rows
from thermospindle.model.rotor.poles import poles
from thermospindle.model.scene.reading import load
from thermospindle.report.log.content import bearing_series
from thermospindle.sim.campaign.beside import measured_at
from thermospindle.sim.campaign.campaign import Campaign, Test
from thermospindle.sim.effects import by_name
from thermospindle.sim.effects.bearing import bond_softening
from thermospindle.sim.effects.measuring import channel_delay, hammer_position, sensor_gain, thermometer_error, window_damping
from thermospindle.sim.hammer.test import impact_tests
from thermospindle.sim.identification.frf import Frf
from thermospindle.sim.operating import operating_point, stiffness_table
from thermospindle.sim.run import as_campaign
from thermospindle.thermal.expansion import field

LINES = np.linspace(500.0, 2500.0, 41)


def ideal(spindle):
    return operating_point(spindle, RUNNING, ()).frf(LINES)


def test_sensor_gain_multiplies_its_channels(spindle):
    ratio = at(spindle, RUNNING, sensor_gain, gain=0.1, rest_gain=-0.05).frf(LINES) / ideal(spindle)
    on_hub = [p.body == "hub" for p in spindle.points]
    assert ratio[on_hub] == pytest.approx(1.1, rel=1e-12)
    assert ratio[np.invert(on_hub)] == pytest.approx(0.95, rel=1e-12)


@pytest.mark.parametrize(("skew", "last"), [(0.0, 50e-6), (0.1, 80e-6)])
def test_channel_delay_turns_the_phase(spindle, skew, last):
    """A quarter of a period late is a quarter turn back: 50 us at 5 kHz; slope -2 pi tau over the band, first and seventh channel."""
    point = at(spindle, RUNNING, channel_delay, delay=50.0, skew=skew)
    quarter = np.array([5000.0])
    assert point.frf(quarter)[0] == pytest.approx(-1j * operating_point(spindle, RUNNING, ()).frf(quarter)[0], rel=1e-9)
    turn = np.unwrap(np.angle(point.frf(LINES)[[0, 6]] / ideal(spindle)[[0, 6]]))
    slope = np.polyfit(LINES, turn[:, 0].T, 1)[0]
    assert slope == pytest.approx(-2 * np.pi * np.array([50e-6, last]), rel=1e-9)


def test_a_thermometer_error_is_another_temperature(spindle):
    """Whatever depends on it: the very matrices of a spindle that is as warm as that, and those of other effects with it."""
    bond = (bond_softening.EFFECT, bond_softening.EFFECT.typical())
    error = (thermometer_error.EFFECT, {"offset": 8.0})
    for others in ([], [bond]):
        read, true = operating_point(spindle, Condition(45.0), [*others, error]), operating_point(spindle, Condition(53.0), others)
        for own, there in ((read.linear.stiffness, true.linear.stiffness), (read.linear.damping, true.linear.damping)):
            assert np.array_equal(own, there)
        assert read.state.bearings[0].preload == true.state.bearings[0].preload != operating_point(spindle, Condition(45.0), others).state.bearings[0].preload
        assert read.condition == Condition(45.0)  # as the test says
        assert read.state.condition == true.state.condition == true.condition


def test_results_of_a_wrong_thermometer_are_of_what_it_reads(spindle):
    """Tables, where a bearing unloads, and virtual tests were labelled with the temperature that it hides, or had the error twice."""
    wrong = replace(spindle, effects=(Addition("thermometer_error", {"offset": 20.0}),))
    true, read = stiffness_table(spindle, [100.0, 140.0, 180.0]), stiffness_table(wrong, [80.0, 120.0, 160.0])
    assert read.temperature.tolist() == [80.0, 120.0, 160.0]
    assert read.values["upper"]["preload_N"] == pytest.approx(true.values["upper"]["preload_N"], rel=1e-12)
    assert read.unloads["upper"] == pytest.approx(true.unloads["upper"] - 20.0, abs=2e-3)
    point = operating_point(wrong, Condition(40.0))
    step = SimpleNamespace(point=point, test=impact_tests([point])[0])
    (made,) = as_campaign(SimpleNamespace(spindle=wrong, steps=[step]), "wrong").tests
    assert (made.id, made.temperature) == ("T40_n0", 40.0)


@pytest.mark.parametrize(("effect", "gap"), [("expansion_mismatch", "ring gap r"), ("soak_lag", "ring gap z")])
def test_a_log_shows_the_rings_as_effects_move_them(spindle, effect, gap):
    """Beside the preload with effects were gaps without them."""
    gaps = []
    for present in ((), (Addition(effect, by_name(effect).typical()),)):
        with_it = replace(spindle, effects=present)
        point = operating_point(with_it, Condition(60.0, soak_time=600.0))
        gaps.append(bearing_series(SimpleNamespace(spindle=with_it, steps=[SimpleNamespace(point=point)]), "lower")[gap, "µm"][0])
        moved = [field(point.spindle, point.regions)[part].displacement for part in ("stationary", "rotating")]
        gaps.append(float(np.ptp(moved[1][:, 0])))
    assert abs(gaps[2] / gaps[0] - 1) > 0.02
    assert abs(gaps[3] / gaps[1] - 1) > 0.02


def test_one_channel_alone_is_late_or_wrong(spindle):
    for module, values, third in ((channel_delay, {"delay": 50.0}, np.exp(-2j * np.pi * LINES * 50e-6)), (sensor_gain, {"gain": 0.1}, 1.1)):
        ratio = at(spindle, RUNNING, module, **values, channel=3.0).frf(LINES) / ideal(spindle)
        assert ratio[2] == pytest.approx(np.broadcast_to(third, ratio[2].shape), rel=1e-9)
        assert np.delete(ratio, 2, axis=0) == pytest.approx(1.0, rel=1e-12)


def test_a_channel_and_a_hammer_are_the_same_in_every_test(spindle):
    """Tests that have sensors and hammer points in another order, or not all of them: the one that
    is meant is that of one node, and not of a row. The first node of each test was."""
    frfs = [Frf(LINES, np.ones((len(nodes), len(struck), len(LINES)), complex), nodes, struck, "mobility") for nodes, struck in (((1, 2, 3), (1, 2)), ((3, 2, 1), (2, 1)), ((5, 2), (6, 2)))]
    tests = tuple(Test(f"t{k}", 20.0, 0.0, frf=frf) for k, frf in enumerate(frfs))
    campaign = Campaign("three", spindle.name, "mobility", spindle.points, tests)
    assert (campaign.sensors, campaign.hammers) == ((1, 2, 3, 5), (1, 2, 6))
    for test in tests:
        own = measured_at(spindle, campaign, test)
        plain = operating_point(own, RUNNING, ()).frf(LINES)[: len(test.frf.response_nodes)]
        for module, values, size in ((sensor_gain, {"gain": 0.1}, 1.1), (channel_delay, {"delay": 50.0}, np.exp(-2j * np.pi * LINES * 50e-6))):
            ratio = at(own, RUNNING, module, **values, channel=2.0).frf(LINES)[: len(plain)] / plain
            for node, found in zip(test.frf.response_nodes, ratio, strict=True):
                assert found == pytest.approx(np.broadcast_to(size if node == 2 else 1.0, found.shape), rel=1e-9)
        missed = np.abs(at(own, RUNNING, hammer_position, offset=2.0, node=2.0).frf(LINES)[: len(plain)] / plain - 1).max(axis=(0, 2))
        assert [bool(of > 1e-3) for of in missed] == [node == 2 for node in test.frf.reference_nodes]


def test_a_window_in_some_tests_only(spindle):
    still = Condition(60.0)
    for tests, here, there in ((0.0, 8.0, 8.0), (1.0, 8.0, 0.0), (2.0, 0.0, 8.0)):
        found = [at(spindle, c, window_damping, decay=8.0, tests=tests).measurement.decay for c in (RUNNING, still)]
        assert found == [here, there]


def test_hammer_position_of_one_node(spindle):
    both, first = (at(spindle, RUNNING, hammer_position, offset=2.0, node=n).measurement.reference_rows for n in (0.0, 1.0))
    plain = operating_point(spindle, RUNNING, ()).measurement.reference_rows
    assert np.array_equal(first[0], both[0])
    assert np.array_equal(first[1], plain[1])
    assert not np.array_equal(both[1], plain[1])


def test_window_damping_against_a_windowed_impulse_response(spindle):
    """h(t) as a sum of decaying exponentials, times exp(-decay t), Fourier-integrated by quadrature: the FRF without correction."""
    decay = 8.0
    point = operating_point(spindle, RUNNING, ())
    linear = matrices(point.chain)
    p = poles(linear)
    response, force = point_rows(spindle, point.chain, (1,))[0], point_rows(spindle, point.chain, (2,))[0]
    weight = (response @ p.right) * (p.left @ force) * p.value  # of the velocity's impulse response
    slow = np.abs(p.value) < 2 * np.pi * 6000
    dt = 2e-6
    time = np.arange(0.0, 0.5, dt)
    h = np.real(np.exp(np.outer(time, p.value[slow])) @ weight[slow])
    windowed = h * np.exp(-decay * time)
    windowed[0] /= 2
    lines = np.array([1003.0, 1750.0, 1996.0])
    by_time = np.array([np.sum(windowed * np.exp(-2j * np.pi * f * time)) * dt for f in lines])
    fast = np.sum(weight[~slow] / (2j * np.pi * lines[:, None] + decay - p.value[~slow]), axis=1)
    found = at(spindle, RUNNING, window_damping, decay=decay).frf(lines)[0, 1]
    assert found == pytest.approx(by_time + fast, rel=1e-4)
    assert np.abs(found / point.frf(lines)[0, 1] - 1).min() > 1e-3


def test_hammer_position_is_a_force_and_its_moment(spindle):
    """A unit force along z at (12 + 2, 0, 20) mm on the hub: 1 N along z and r x F about the hub's centre; likewise at (0, 14, 20)."""
    point = at(spindle, RUNNING, hammer_position, offset=2.0, direction=0.0)
    rows = point.measurement.reference_rows
    for row, body, place in zip(rows, ("hub", "hub"), ([14e-3, 0, 20e-3], [0, 14e-3, 20e-3]), strict=True):
        arm = np.array(place) - [0, 0, point.chain.body(body).z]
        moment = np.cross(arm, [0, 0, 1.0])
        expected = {"z": 1.0, "tilt_x": moment[0], "tilt_y": moment[1]}
        loads = {move: row[i] for i, (name, move) in enumerate(point.chain.dofs) if name == body}
        assert {m: v for m, v in loads.items() if abs(v) > 1e-12} == pytest.approx({m: v for m, v in expected.items() if abs(v) > 1e-12})
        assert not any(row[i] for i, (name, _) in enumerate(point.chain.dofs) if name != body)


def test_hammer_position_sideways_on_a_side_face(spindle):
    """Hits along x at (12.5, 0, 15) mm: 0 deg is up, 90 deg tangential along y."""
    aimed = spindle.point(3)
    assert hammer_position.off(aimed, 1e-3, 0.0).position == pytest.approx((12.5e-3, 0.0, 16e-3))
    assert hammer_position.off(aimed, 1e-3, np.pi / 2).position == pytest.approx((12.5e-3, 1e-3, 15e-3))


def test_hammer_position_breaks_reciprocity(spindle):
    """At rest H(1, 2) = H(2, 1) for true hits; hits beside their nodes, round the axis, break it; poles stay."""
    still = operating_point(spindle, Condition(20.0), ())
    missed = at(spindle, Condition(20.0), hammer_position, offset=4.0, direction=90.0)
    first, second = (0, 1), (1, 0)  # (point 1, hammer 2) and (point 2, hammer 1)
    a, b = (point.frf(LINES) for point in (still, missed))
    assert a[first] == pytest.approx(a[second], rel=1e-8)  # rounding, at antiresonances
    assert np.abs(b[first] - b[second]).max() > 0.01 * np.abs(b[first]).max()
    rows = (missed.measurement.response_rows, missed.measurement.reference_rows)
    assert b == pytest.approx(frf(matrices(still.chain), *rows, LINES, "mobility"), rel=1e-6)


def test_a_gain_is_that_of_all_channels_where_nothing_turns():
    """Typical gain on a shaft that hangs free was added and changed nothing: no channel is on a turning part."""
    shaft = load(ROOT / "scenes" / "free_shaft")
    frequency = np.array([200.0])
    read = operating_point(shaft, Condition(20.0), [(sensor_gain.EFFECT, sensor_gain.EFFECT.typical())]).frf(frequency)
    assert read == pytest.approx(1.05 * operating_point(shaft, Condition(20.0), ()).frf(frequency), rel=1e-12)
