"""One ball with inertia: kinematics against the long form, derivatives against differences, rows of equal balls against one."""

from dataclasses import replace

import numpy as np
import pytest

from thermospindle.model.bearing.ball_row import BallInertia, BallRow, centre_line, respond, respond_all
from thermospindle.model.bearing.centred import centred_axial_force
from thermospindle.model.bearing.heavy_ball.balance import HeavyBall, balance, settled
from thermospindle.model.bearing.heavy_ball.together import of_each, settled_together
from thermospindle.model.errors import NoEquilibrium
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point

DISK_BALL = BallInertia(1.588e-3, 9.1e-3, 7800.0, 0.0, 754.0)
BOTH_TURN = BallInertia(22.23e-3, 125.26e-3, 7800.0, 1047.0, -300.0, share=0.7)
BALL = HeavyBall(0.6e-3, 0.7e-3, 8e9, 9e9, BallInertia(22.23e-3, 125.26e-3, 7800.0, 1047.0, 0.0))
LINE = (-1.0e-3, 0.86e-3)  # 19 um pressed, at 41 deg


ANGLES = [(0.1, 0.1), (0.43, 0.43), (0.9, 0.9), (0.3, 0.5), (0.62, 0.74), (0.5, 0.1)]  # outer, inner; alike as at rest, apart as at speed


def written_out(inertia, outer, inner):
    """C and M after Harris 1991, ch. 8, from how surfaces move: unknown are the cage's speed and the ball's
    own w about an axis at beta, which is the one without spin at the outer contact. Nothing is cancelled."""
    radius, pitch = inertia.diameter / 2, inertia.pitch_diameter / 2
    beta = np.arctan2(np.sin(outer), np.cos(outer) + radius / pitch)
    # across the plane of ball and axis, seen from the cage: a race moves with (its speed - cage) at its radius, the ball with w r cos(a - beta)
    at_outer, at_inner = pitch + radius * np.cos(outer), pitch - radius * np.cos(inner)
    rolling = np.array([[at_outer, radius * np.cos(outer - beta)], [at_inner, -radius * np.cos(inner - beta)]])
    cage, spin = np.linalg.solve(rolling, [inertia.outer_speed * at_outer, inertia.inner_speed * at_inner])
    polar = inertia.mass * inertia.diameter**2 / 10
    return inertia.share * inertia.mass * pitch * cage**2, inertia.share * polar * spin * cage * np.sin(beta)


@pytest.mark.parametrize("inertia", [DISK_BALL, BOTH_TURN], ids=["outer-turns", "both-turn"])
@pytest.mark.parametrize("angles", ANGLES)
def test_loads_are_those_of_the_spin_axis_written_out(inertia, angles):
    loads = inertia.loads(*((np.cos(a), np.sin(a)) for a in angles))
    assert (loads.centrifugal, loads.moment) == pytest.approx(written_out(inertia, *angles), rel=1e-12)


def test_a_ball_with_equal_angles_turns_as_in_every_handbook():
    """Harris 1991, Eq. 8.14: the cage's speed of a ball with one contact angle."""
    a, gamma = 0.43, BOTH_TURN.diameter / BOTH_TURN.pitch_diameter
    cage = (BOTH_TURN.inner_speed * (1 - gamma * np.cos(a)) + BOTH_TURN.outer_speed * (1 + gamma * np.cos(a))) / 2
    both = np.cos(a), np.sin(a)
    assert BOTH_TURN.loads(both, both).centrifugal == pytest.approx(0.7 * BOTH_TURN.mass * BOTH_TURN.pitch_diameter / 2 * cage**2, rel=1e-12)


@pytest.mark.parametrize("inertia", [DISK_BALL, BOTH_TURN], ids=["outer-turns", "both-turn"])
@pytest.mark.parametrize("angles", ANGLES)
def test_slopes_of_the_loads(inertia, angles):
    def loads(outer, inner):
        return inertia.loads((np.cos(outer), np.sin(outer)), (np.cos(inner), np.sin(inner)))

    (outer, inner), h = angles, 1e-5
    here = loads(outer, inner)
    for above, below, centrifugal, moment in (
        (loads(outer + h, inner), loads(outer - h, inner), here.centrifugal_by_outer, here.moment_by_outer),
        (loads(outer, inner + h), loads(outer, inner - h), here.centrifugal_by_inner, here.moment_by_inner),
    ):
        assert (above.centrifugal - below.centrifugal) / (2 * h) == pytest.approx(centrifugal, rel=1e-6, abs=1e-9 * here.centrifugal)
        assert (above.moment - below.moment) / (2 * h) == pytest.approx(moment, rel=1e-6, abs=1e-9 * abs(here.moment))


@pytest.mark.parametrize("centre", [(-0.47e-3, 0.38e-3), (-0.44e-3, 0.36e-3)], ids=["both-races", "outer-race-only"])
def test_derivatives_of_the_balance(centre):
    """Central differences by the ball's centre and by the outer groove's, of the resultant and of the force on the ring."""
    here, h = balance(BALL, centre, LINE), 1e-11
    assert here.outer > 0
    assert (here.inner > 0) == (centre[0] < -0.45e-3)
    for i in range(2):
        step = h * np.eye(2)[i]
        by_centre, by_line = (
            [
                [(p - m) / (2 * h) for p, m in zip(getattr(plus, name), getattr(minus, name), strict=True)]
                for name in ("resultant", "on_outer")
            ]
            for plus, minus in (
                (balance(BALL, tuple(centre + step), LINE), balance(BALL, tuple(centre - step), LINE)),
                (balance(BALL, centre, tuple(LINE + step)), balance(BALL, centre, tuple(LINE - step))),
            )
        )
        s, j, g, passed = (np.reshape(m, (2, 2))[:, i] for m in (here.by_inner, here.by_outer, here.by_line, here.passed_on))
        size = 1e-5 * np.abs(here.by_line).max()
        assert by_centre[0] == pytest.approx(-(s + g), abs=size)
        assert by_centre[1] == pytest.approx(passed - j, abs=size)
        assert by_line[0] == pytest.approx(g, abs=size)
        assert by_line[1] == pytest.approx(j, abs=size)


def test_stiffness_is_the_derivative_of_the_force_of_a_settled_ball():
    def on_outer(line):
        return np.array(settled(BALL, tuple(line), 1e-10, 1.0).on_outer)

    stiffness, h = np.reshape(settled(BALL, LINE, 1e-10, 1.0).stiffness(), (2, 2)), 1e-9
    for i in range(2):
        step = h * np.eye(2)[i]
        slope = (on_outer(LINE + step) - on_outer(LINE - step)) / (2 * h)
        assert slope == pytest.approx(stiffness[:, i], abs=1e-5 * np.abs(stiffness).max())


def test_centred_rows_are_one_ball_many_times(monkeypatch):
    """Equal balls are settled once, answer alike, and the short way to the axial force gives that of `respond`."""
    row = BallRow(12, 1.0e-3, 0.86e-3, 0.6e-3, 0.7e-3, 8e9, 9e9, 60e-3, BALL.inertia)
    calls = []  # of one ball
    monkeypatch.setattr("thermospindle.model.bearing.ball_row.settled", lambda *given: calls.append(given) or settled(*given))
    for movement in (-5e-6, 0.0, 8e-6):
        calls.clear()
        answer = respond(replace(row, axial=row.axial + movement))
        assert len(calls) == 1
        assert np.ptp(answer.ball_force) == 0 < answer.ball_force[0]
        assert centred_axial_force(row, movement) == pytest.approx(answer.force[2], rel=1e-12)
        without = replace(row, inertia=None)
        assert centred_axial_force(without, movement) == pytest.approx(
            respond(replace(without, axial=row.axial + movement)).force[2], rel=1e-12
        )
    calls.clear()
    assert np.ptp(respond(row, np.array([1e-6, 0, 0, 0, 0])).ball_force) > 0  # no longer alike
    assert not calls


def test_a_ball_that_does_not_settle_says_so():
    with pytest.raises(NoEquilibrium, match="did not settle; the largest residual"):
        settled(BALL, LINE, 0.0, 1.0)


@pytest.mark.parametrize("rpm", [100, 3500, 30_000])
@pytest.mark.parametrize(("scene", "name"), [("tailstock", "rear1"), ("hdd_2003", "upper")])
def test_a_ball_settles_wherever_its_rings_are(scene, name, rpm):
    """Found on `tailstock`: pressed, where what rounding does to a stiff race was more than what
    was allowed; loose, where steps along a circle were too many."""
    spindle = load(scene)
    own, state = spindle.bearing(name), operating_point(spindle, Condition(20.0)).state.bearing(name)
    inertia = BallInertia(own.ball_diameter, own.pitch_diameter, spindle.materials[own.ball_material].density, rpm * RPM, 0.0)
    force = [own.sense * centred_axial_force(replace(state.row, inertia=inertia), x) for x in own.sense * np.linspace(-20e-6, 20e-6, 81)]
    assert (np.diff(force) > -1e-9 * force[-1]).all()
    assert force[-1] > 2 * abs(force[0])  # loose at one end, but for balls that are flung, pressed at the other


def test_contacts_on_one_side_of_a_ball_are_no_crash():
    """Found by `make torture` at 1e8 rpm, on the way to where nothing settles."""
    loads = BALL.inertia.loads((-0.6, 0.8), (0.6, -0.8))
    assert np.isfinite(loads).all()


def test_a_ball_settles_where_it_does_from_wherever_it_is_asked():
    """From near, from the other side of the race, and from where it touches nothing: a start is a start."""
    cold = settled(BALL, LINE, 1e-10, 1.0)
    r, z = cold.centre
    for start in ((r, z), (r + 1e-6, z - 1e-6), (0.5 * r, 2.0 * z), (1e-9, 1e-9)):
        assert settled(BALL, LINE, 1e-10, 1.0, start).centre == pytest.approx((r, z), rel=1e-9)


AGAINST = BallRow(16, 311.127251846117e-6, 141.92751425103216e-6, 93e-6, 248e-6, 25.21121041899814e9, 18.9557814348371e9, 18e-3, BallInertia(6.2e-3, 36e-3, 7850.0, 2094.4, -2094.4))
"""A row of steel balls, 25 degrees, 180 N, whose rings turn against each other with 20,000 rpm: a
ball's centrifugal force is 1.9 N, the friction of its moment 1.9 N too."""
ASIDE = np.array([3e-6, -2e-6, 1e-6, 1e-4, 2e-4])


@pytest.mark.parametrize("share", [0.2, 0.6, 1.0])
def test_balls_between_rings_that_turn_against_each_other(share):
    """Halved steps ended between the races, 0.7 to 1.9 N left. Here the balance of every ball is
    written out (Jones 1960) with the answer's forces and angles, at the speed of the cage that
    rolling asks for on the mean; and the contacts are where their deformations put them."""
    answer = respond(AGAINST, share * ASIDE)
    assert (answer.ball_force > 3.0).all()
    inertia, (outer, inner) = AGAINST.inertia, (answer.outer_angle, answer.inner_angle)
    gamma, polar = inertia.diameter / inertia.pitch_diameter, inertia.mass * inertia.diameter**2 / 10
    rolls = [np.sqrt(written_out(inertia, o, i)[0] / (inertia.mass * inertia.pitch_diameter / 2)) for o, i in zip(outer, inner, strict=True)]
    cage = -np.mean(rolls)  # with the outer ring: that surface is the faster one
    flung, moment = inertia.mass * inertia.pitch_diameter / 2 * cage**2, polar * cage * (inertia.outer_speed - cage) * np.sin(outer) / gamma
    friction = 2 * moment / inertia.diameter
    along_r = answer.ball_force * np.cos(inner) - answer.outer_ball_force * np.cos(outer) - friction * np.sin(outer) + flung
    along_z = answer.ball_force * np.sin(inner) - answer.outer_ball_force * np.sin(outer) + friction * np.cos(outer)
    assert np.abs([along_r, along_z]).max() < 1e-8
    reach = [length + (force / constant) ** (2 / 3) for length, force, constant in (
        (AGAINST.inner_length, answer.ball_force, AGAINST.inner_constant), (AGAINST.outer_length, answer.outer_ball_force, AGAINST.outer_constant),
    )]  # fmt: skip
    lines = sum(length[:, None] * np.stack([-np.cos(a), np.sin(a)], -1) for length, a in zip(reach, (inner, outer), strict=True))
    assert lines == pytest.approx(centre_line(AGAINST, share * ASIDE), abs=1e-14)


def test_a_solver_of_another_kind_finds_the_same_forces():
    """scipy's hybrid method on Harris's equations from many starts, written for a review."""
    assert respond(AGAINST, 0.2 * ASIDE).force == pytest.approx([49.967, -30.353, 73.392, 0.25258, 0.41646], rel=1e-4)


def test_stiffness_of_a_row_between_rings_that_turn_against_each_other():
    scale, h = np.array([1, 1, 1, AGAINST.arm, AGAINST.arm]), 1e-9
    steps = h * np.diag(1 / scale)
    slopes = np.array([(respond(AGAINST, 0.2 * ASIDE + d).force - respond(AGAINST, 0.2 * ASIDE - d).force) / (2 * h) for d in steps]).T
    tangent = respond(AGAINST, 0.2 * ASIDE).tangent / scale
    assert slopes / scale[:, None] == pytest.approx(tangent / scale[:, None], abs=1e-5 * np.abs(tangent / scale[:, None]).max())


@pytest.mark.parametrize("cage", [None, -330.0], ids=["as-it-rolls", "with-a-cage"])
@pytest.mark.parametrize("rpm", [3000, 20_000, 60_000])
def test_a_ball_settles_however_loose_it_is_between_rings_that_turn_against_each_other(rpm, cage):
    """From 30 um of play to 10 um pressed, held by both races: where the moment outdoes the
    centrifugal force, the circles about the groove centres cross nearer the axis."""
    inertia = replace(AGAINST.inertia, inner_speed=rpm * RPM, outer_speed=-rpm * RPM, cage=None if cage is None else cage * rpm / 20_000)
    ball = HeavyBall(AGAINST.inner_length, AGAINST.outer_length, AGAINST.inner_constant, AGAINST.outer_constant, inertia)
    for stretch in np.linspace(-30e-6, 10e-6, 81):
        length = AGAINST.unloaded_distance + stretch
        line = -length * np.cos(0.43), length * np.sin(0.43)
        here = settled(ball, line, 1e-9 * (rpm / 20_000) ** 2, 1e-2)
        assert here.inner > 0
        assert np.linalg.eigvals(np.reshape(np.add(here.by_inner, here.by_line), (2, 2))).real.min() > 0  # pushed aside, it comes back


@pytest.mark.parametrize("ball", [BALL, replace(AGAINST, inertia=replace(AGAINST.inertia, cage=-330.0)).ball], ids=["one-turns", "against-each-other"])
@pytest.mark.parametrize("near", [False, True])
def test_balls_sought_together_are_those_sought_one_by_one(ball, near):
    """From play to 20 um pressed, some from where others are: also what no step from there reaches."""
    lengths = ball.inner_length + ball.outer_length + np.linspace(-25e-6, 20e-6, 31)
    line = -lengths * np.cos(0.6), lengths * np.sin(0.6)
    tolerance, least = np.full(31, 1e-9), np.full(31, 1e-2)
    alone = [settled(ball, at, 1e-9, 1e-2) for at in zip(*line, strict=True)]
    start = tuple(np.roll([b.centre[i] for b in alone], 7) for i in (0, 1)) if near else None
    together = settled_together(of_each([ball], [31]), line, tolerance, least, start)
    for name in ("centre", "on_outer", "inner", "outer", "inner_angle", "outer_angle", "deformation"):
        told = np.array([getattr(b, name) for b in alone]).T
        assert getattr(together, name) == pytest.approx(told, rel=1e-7, abs=1e-7 * np.abs(told).max()), name
    assert np.hypot(*together.resultant).max() < 1e-9


def test_rows_sought_together_are_those_sought_alone():
    """Each at the speed of its own cage: heavy balls of two kinds, a row whose cage is held, one without inertia, and centred rings."""
    row = BallRow(12, 1.0e-3, 0.86e-3, 0.6e-3, 0.7e-3, 8e9, 9e9, 60e-3, BALL.inertia)
    rows = [row, replace(row, balls=17, inertia=DISK_BALL), replace(row, inertia=replace(BALL.inertia, cage=400.0)), replace(row, inertia=None), row]
    aside = [np.array([3e-6, -2e-6, 1e-6, 2e-5, 1e-5]) * (k < 4) for k in range(5)]
    together = respond_all(rows, aside, [None, respond(rows[1]).rolled, None, None, None])
    assert together[0].rolled.cage != together[1].rolled.cage
    for found, own, q in zip(together, rows, aside, strict=True):
        alone = respond(own, q)
        assert found.force == pytest.approx(alone.force, rel=1e-9, abs=1e-9 * np.abs(alone.force).max())
        assert found.tangent == pytest.approx(alone.tangent, rel=1e-8, abs=1e-8 * np.abs(alone.tangent).max())
