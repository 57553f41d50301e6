"""Cage and ball speeds, and the lines of linear theory, against closed forms and a brute-force sum over the balls."""

from dataclasses import replace

import numpy as np
import pytest

from tests.mounting import turning_inside
from thermospindle.model.bearing.kinematics import (
    Kinematics,
    ball_line,
    cage_line,
    kinematics,
    lines,
    race_line,
    row_kinematics,
)
from thermospindle.model.bearing.pair import solve
from thermospindle.model.bearing.row import reference_motion, ring_speeds
from thermospindle.model.machine import Condition
from thermospindle.model.units import RPM

HZ = 2 * np.pi


@pytest.fixture(scope="module")
def running(cold):
    return replace(cold, condition=Condition(20.0, 7200 * RPM))


@pytest.fixture(scope="module")
def paper(spindle, running):
    return row_kinematics(spindle, running)["upper"]


def test_cage_and_ball_frequencies_of_the_paper(paper):
    """Outer ring at 120 Hz: worked out by hand from d = 1.588, D = 9.1 mm, 24.51 deg; the printed digits."""
    assert paper.cage / HZ == pytest.approx(69.527, abs=5e-4)
    assert paper.over_outer / HZ == pytest.approx(504.73, abs=5e-3)
    assert paper.over_inner / HZ == pytest.approx(695.27, abs=5e-3)
    assert paper.spin / HZ == pytest.approx(335.16, abs=5e-3)


@pytest.mark.parametrize(("inner", "outer"), [(300.0, 0.0), (0.0, 300.0), (-200.0, 0.0), (120.0, -80.0)])
def test_balls_roll_without_slip(cold, inner, outer):
    """Surface speeds of ring and ball are equal at both contacts, and all ball passings add up to those of a ring over the other."""
    bearing, d, pitch = cold.bearing("upper"), 1.588e-3, 9.1e-3
    kin = kinematics(bearing, 10, d, pitch, inner, outer)
    reach = d * np.cos(bearing.contact_angle) / 2
    spin = np.sign(outer - inner) * kin.spin * d / 2
    assert (inner - kin.cage) * (pitch / 2 - reach) == pytest.approx(-spin, rel=1e-12)
    assert (outer - kin.cage) * (pitch / 2 + reach) == pytest.approx(spin, rel=1e-12)
    assert kin.over_inner + kin.over_outer == pytest.approx(10 * abs(outer - inner), rel=1e-12)


def test_the_cage_of_heavy_balls_is_that_of_their_equilibrium(spindle):
    """At 60000 rpm the contact angles are 21 degrees apart; the cage turns as that orbit does whose
    centrifugal force parts them, and slower than at their mean."""
    heavy, condition = replace(spindle, ball_inertia=1.0), Condition(20.0, 60000 * RPM)
    state = solve(heavy, condition, {b.name: reference_motion(20.0) for b in heavy.bearings})
    b, kin = state.bearing("upper"), row_kinematics(heavy, state)["upper"]
    assert abs(b.outer_contact_angle - b.contact_angle) > np.radians(1)
    outer, inner = ((float(np.cos(a)), float(np.sin(a))) for a in (b.outer_contact_angle, b.contact_angle))
    assert kin.cage == pytest.approx(b.row.inertia.orbit(outer, inner).speed, rel=1e-12)
    gamma = 1.588 / 9.1
    assert kin.spin * gamma == pytest.approx(abs(kin.outer - kin.cage) * (1 + gamma * outer[0]), rel=1e-12)  # the outer race's surface is the ball's
    middle = (1 + gamma * np.cos((b.contact_angle + b.outer_contact_angle) / 2)) / 2 * kin.outer
    assert abs(kin.cage / middle - 1) > 1e-3


def test_ring_that_turns(spindle):
    assert ring_speeds(spindle, spindle.bearings[0], 100.0) == (0.0, 100.0)
    other = turning_inside(spindle)
    assert ring_speeds(other, other.bearings[0], 100.0) == (100.0, 0.0)


def test_a_hotter_bearing_has_a_slower_cage(spindle, running, hot):
    """The contact angle rises with temperature: gamma falls, and the cage lags behind a turning outer ring."""
    warm = row_kinematics(spindle, replace(hot, condition=running.condition))
    assert warm["upper"].cage < warm["lower"].cage < row_kinematics(spindle, running)["upper"].cage


TABLE = [
    ("fc", "radial", 1, 69.527),
    ("1x", "radial", 1, 120.0),
    ("10 (fo-fc) - fo", "radial", -1, 384.73),
    ("10 (fo-fc)", "axial", 0, 504.73),
    ("2 fb - fc", "radial", -1, 600.79),
    ("10 (fo-fc) + fo", "radial", 1, 624.73),
    ("2 fb", "axial", 0, 670.32),
    ("10 fc", "axial", 0, 695.27),
    ("2 fb + fc", "radial", 1, 739.85),
    ("20 (fo-fc) + fo", "radial", 1, 1129.46),
]


@pytest.mark.parametrize(("name", "direction", "whirl", "frequency"), TABLE, ids=[row[0] for row in TABLE])
def test_lines_of_the_paper(spindle, running, name, direction, whirl, frequency):
    """Line tables of Wardle and of Jang and Jeong, with the kinematic numbers above."""
    found = [x for x in lines(spindle, row_kinematics(spindle, running), running.condition.speed) if x.name == name and x.direction == direction]
    assert found
    for line in found:
        assert (line.whirl, line.frequency) == (whirl, pytest.approx(frequency, abs=6e-3))


def test_both_senses_at_the_balls_over_the_inner_race(spindle, running):
    """Orders 9 and 11 of a ring at rest both excite at 10 fc, one forward and one backward."""
    found = {x.order: x.whirl for x in lines(spindle, row_kinematics(spindle, running), running.condition.speed) if x.name == "10 fc" and x.bearing == "upper"}
    assert found == {9: 1, 10: 0, 11: -1}


def test_nothing_at_rest(spindle, cold):
    assert lines(spindle, row_kinematics(spindle, cold), cold.condition.speed) == []


def test_turning_the_other_way_changes_nothing_but_the_sense_of_plus_z(spindle, running):
    back = replace(running, condition=Condition(20.0, -7200 * RPM))
    assert lines(spindle, row_kinematics(spindle, back), back.condition.speed) == lines(spindle, row_kinematics(spindle, running), running.condition.speed)


# Frequencies that fall on whole lines of a 1 s record; the cage's is chosen so that no two lines meet.
EXACT = Kinematics(inner=0.0, outer=12 * HZ, cage=7 * HZ, spin=33 * HZ, balls=10)
INNER = Kinematics(inner=12 * HZ, outer=0.0, cage=5 * HZ, spin=33 * HZ, balls=10)


def spectrum(kin, push):
    """Signed frequencies (Hz) at which a row sums `push(azimuth, ball, time)` across (complex) and along the axis."""
    time = np.arange(4096) / 4096
    azimuth = HZ * np.arange(kin.balls)[:, None] / kin.balls + kin.cage * time
    p = push(azimuth, np.arange(kin.balls)[:, None], time)
    radial, axial = np.fft.fft(np.sum(p * np.exp(1j * azimuth), axis=0)), np.fft.fft(np.sum(p, axis=0))
    number = np.fft.fftfreq(4096, 1 / 4096)
    return [{int(f) for f, a in zip(number, s, strict=True) if abs(a) > 1e-6 * 4096} for s in (radial, axial)]


@pytest.mark.parametrize("kin", [EXACT, INNER], ids=["outer turns", "inner turns"])
@pytest.mark.parametrize("side", ["inner", "outer"])
@pytest.mark.parametrize("order", [*range(1, 13), 15, 19, 20, 21, 29, 30, 31])
def test_race_lines_are_those_of_the_sum_over_the_balls(kin, side, order):
    """Fourier analysis of what the balls see finds the lines of the rules and no other."""
    radial, axial = spectrum(kin, lambda azimuth, ball, time: np.cos(order * (azimuth - kin.ring(side) * time) + 0.4))
    if order % 10 in (1, 9):
        line = race_line("b", kin, side, order, "radial")
        assert radial == {round(line.frequency) * line.whirl}
        assert line.frequency == pytest.approx(round(line.frequency))
    else:
        assert radial == set()
        with pytest.raises(ValueError, match="does nothing radial"):
            race_line("b", kin, side, order, "radial")
    if order % 10 == 0:
        frequency = race_line("b", kin, side, order, "axial").frequency
        assert axial == {round(frequency), -round(frequency)}
    else:
        assert axial == set()
        with pytest.raises(ValueError, match="does nothing axial"):
            race_line("b", kin, side, order, "axial")


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_ball_lines_are_those_of_the_sum_over_the_balls(order):
    """One wavy ball, raised at two opposite contacts: even orders as the rules say, odd ones nothing."""

    def push(azimuth, ball, time):
        angle = EXACT.spin * time
        return (ball == 3) * (np.cos(order * angle + 0.2) + np.cos(order * (angle + np.pi) + 0.2))

    radial, axial = spectrum(EXACT, push)
    if order % 2:
        assert radial == axial == set()
    else:
        expected = [ball_line("b", EXACT, order, "radial", side) for side in (-1, 1)]
        assert radial == {round(x.frequency) * x.whirl for x in expected}
        along = round(ball_line("b", EXACT, order, "axial").frequency)
        assert axial == {along, -along}


def test_ball_sizes_turn_with_the_cage():
    radial, axial = spectrum(EXACT, lambda azimuth, ball, time: (ball == 2) + 0 * azimuth)
    line = cage_line("b", EXACT, "ball size")
    assert radial == {round(line.frequency) * line.whirl} == {7}
    assert axial == {0}
