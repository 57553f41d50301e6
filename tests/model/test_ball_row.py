"""One ball row: published cases, energy, exact derivatives, contact loss, ball inertia."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import root

from thermospindle.model.bearing.ball_row import (
    BallInertia,
    BallRow,
    by_own_orbits,
    centre_line,
    displacement_under,
    energy,
    kinematics,
    respond,
)
from thermospindle.model.bearing.heavy_ball.balance import settled
from thermospindle.model.bearing.hertz import race_contact
from thermospindle.model.errors import NoEquilibrium


def row(balls, ball, pitch, inner, outer, angle, clearance, modulus) -> BallRow:
    distance = (inner + outer - 1) * ball
    k = [race_contact(ball, f, pitch, angle, side, (modulus, 0.3), (modulus, 0.3)).stiffness for f, side in ((inner, True), (outer, False))]
    radial = distance * np.cos(angle) - clearance / 2
    return BallRow(balls, radial, distance * np.sin(angle), (inner - 0.5) * ball, (outer - 0.5) * ball, *k, pitch / 2)


def deep_groove(clearance: float) -> BallRow:
    return row(7, 11.5e-3, 43.5e-3, 0.52, 0.53, 0.0, clearance, 210e9)


ISO = [
    pytest.param(0.0, {"x": 1000.0}, {"x": 15.1101}, id="radial"),
    pytest.param(0.0, {"z": 1000.0}, {"z": 133.5381}, id="axial"),
    pytest.param(10e-6, {"x": 1000.0}, {"x": 21.223}, id="radial-with-clearance"),
    pytest.param(10e-6, {"z": 1000.0}, {"z": 149.1717}, id="axial-with-clearance"),
    pytest.param(10e-6, {"x": 1000.0, "z": 1000.0}, {"x": 19.5923, "z": 146.4603, "tilt": 2687.2}, id="combined"),
    pytest.param(0.0, {"tilt": 1.0}, {"tilt": 3695.7}, id="moment"),
]


@pytest.mark.parametrize(("clearance", "load", "expected"), ISO)
def test_iso_16281_deep_groove(clearance, load, expected):
    """ISO/TS 16281 cases of a commercial program, published with an open code's test (um, urad; first ball under the load).

    The outer ring is pulled towards -x, which presses the ball at azimuth 0. Tolerance 3e-4: the tilt arm is half the pitch here.
    """
    sign = {"x": -1.0, "z": 1.0, "tilt": 1.0}
    index = {"x": 0, "z": 2, "tilt": 4}
    force = np.zeros(5)
    for name, value in load.items():
        force[index[name]] = sign[name] * value
    found = displacement_under(deep_groove(clearance), force)
    for name, value in expected.items():
        assert abs(found[index[name]]) * 1e6 == pytest.approx(value, rel=3e-4)


def test_harris_218():
    """Harris's 218 angular contact bearing at 17.8 kN: exact Hertz with his E = 207 GPa."""
    bearing = row(16, 22.23e-3, 125.26e-3, 0.5232, 0.5232, np.radians(40), 0.0, 207e9)
    moved = displacement_under(bearing, np.array([0, 0, 17800.0, 0, 0]))
    answer = respond(bearing, moved)
    assert np.degrees(answer.inner_angle) == pytest.approx(41.50, rel=1e-3)
    assert moved[2] * 1e3 == pytest.approx(0.0360, rel=1e-3)
    assert answer.ball_force == pytest.approx(1679, rel=1e-3)


def jones_9_and_10(bearing: BallRow) -> tuple[float, float]:
    """k_RR and k_AA of the axially loaded row: Jang et al. 2003, Eqs. (9) and (10), with AB the unloaded distance."""
    ab = bearing.unloaded_distance
    d = np.hypot(bearing.radial, bearing.axial) - ab
    angle = np.arctan2(abs(bearing.axial), bearing.radial)
    common, slope = d**1.5 / (d + ab), np.sqrt(d) * (d + 3 * ab) / (2 * (d + ab))
    k = bearing.constant * bearing.balls
    return k / 2 * (common + slope * np.cos(angle) ** 2), k * (common + slope * np.sin(angle) ** 2)


@pytest.mark.parametrize("axial", [43e-6, 45e-6, 60e-6, 90e-6])
def test_equations_9_and_10_are_the_tangent(axial):
    bearing = replace(row(10, 1.588e-3, 9.1e-3, 0.529, 0.535, np.radians(24.51), 0.0, 208e9), axial=axial)
    tangent = respond(bearing).tangent
    radial, along = jones_9_and_10(bearing)
    assert tangent[0, 0] == pytest.approx(radial, rel=1e-12)
    assert tangent[1, 1] == pytest.approx(radial, rel=1e-12)
    assert tangent[2, 2] == pytest.approx(along, rel=1e-12)


RANDOM = [np.random.default_rng(i).uniform(-1, 1, 5) * np.array([8e-6, 8e-6, 8e-6, 1e-3, 1e-3]) for i in range(6)]


@pytest.mark.parametrize("moved", RANDOM, ids=range(6))
def test_force_is_the_derivative_of_the_energy_and_stiffness_of_the_force(moved):
    bearing = replace(deep_groove(0.0), axial=60e-6, radial=0.571e-3)
    answer = respond(bearing, moved)
    assert 0 < answer.in_contact.sum() <= 7
    h = 1e-9
    for i in range(5):
        step = np.zeros(5)
        step[i] = h * (1 if i < 3 else 30)
        plus, minus = moved + step, moved - step
        assert (energy(bearing, plus) - energy(bearing, minus)) / (2 * step[i]) == pytest.approx(answer.force[i], rel=1e-5, abs=1e-4)
        slope = (respond(bearing, plus).force - respond(bearing, minus).force) / (2 * step[i])
        assert slope == pytest.approx(answer.tangent[i], rel=1e-4, abs=1e-5 * np.abs(answer.tangent[i]).max())
    assert answer.tangent == pytest.approx(answer.tangent.T, rel=1e-12)


def test_contact_is_lost_ball_by_ball():
    """Pulled far enough to one side, the unloaded balls carry nothing and say so."""
    bearing = deep_groove(10e-6)
    answer = respond(bearing, displacement_under(bearing, np.array([-1000.0, 0, 0, 0, 0])))
    assert answer.in_contact.tolist() == [True, True, False, False, False, False, True]
    assert np.all(answer.ball_force[~answer.in_contact] == 0)
    assert np.all(answer.deformation[~answer.in_contact] < 0)


def test_the_load_it_cannot_carry_is_said():
    spinless = replace(deep_groove(0.0), balls=3)
    with pytest.raises(NoEquilibrium, match="cannot carry"):
        displacement_under(replace(spinless, inner_constant=1e-6, outer_constant=1e-6), np.array([-1e9, 0, 0, 0, 0]))


FAST = BallInertia(22.23e-3, 125.26e-3, 7800.0, 1047.0, 0.0)


def fast_218() -> BallRow:
    return replace(row(16, 22.23e-3, 125.26e-3, 0.5232, 0.5232, np.radians(40), 0.0, 207e9), inertia=FAST)


def test_forces_on_a_heavy_ball_balance():
    """Radial and axial balance of inner contact, outer contact, centrifugal force and friction of the gyroscopic moment."""
    bearing = fast_218()
    moved = displacement_under(bearing, np.array([0, 0, 17800.0, 0, 0]))
    answer = respond(bearing, moved)
    inner, outer = answer.ball_force[0], answer.outer_ball_force[0]
    ai, ao = answer.inner_angle[0], answer.outer_angle[0]
    gamma = FAST.diameter / FAST.pitch_diameter
    beta = np.arctan2(np.sin(ao), np.cos(ao) + gamma)  # Harris 1991, Eqs. 8.47-8.50 for a still outer ring
    lead, lag = (1 + gamma * np.cos(ao)) / np.cos(ao - beta), (1 - gamma * np.cos(ai)) / np.cos(ai - beta)
    spin = -FAST.inner_speed / (1 / lead + 1 / lag) / gamma
    cage = FAST.inner_speed * lag / (lag + lead)
    centrifugal = FAST.mass * FAST.pitch_diameter / 2 * cage**2
    friction = -2 / FAST.diameter * FAST.mass * FAST.diameter**2 / 10 * spin * cage * np.sin(beta)
    assert inner * np.cos(ai) - outer * np.cos(ao) + centrifugal + friction * np.sin(ao) == pytest.approx(0, abs=1e-6 * outer)
    assert inner * np.sin(ai) - outer * np.sin(ao) - friction * np.cos(ao) == pytest.approx(0, abs=1e-6 * outer)
    assert ao < np.radians(41.5) < ai
    assert outer > inner
    assert bearing.balls * inner * np.sin(ai) == pytest.approx(17800, rel=1e-9)


def on_inner(bearing: BallRow, moved: np.ndarray, cage: float | None = None) -> tuple[np.ndarray, float]:
    """Force (2,) across the axis on the inner ring, from Harris's equations ball by ball (1991, ch. 8 and 9, outer-race control, the
    outer ring still), with angles and a root finder, and the mean speed of the balls; each at its own speed or at that of a `cage`."""
    inertia = bearing.inertia
    diameter, gamma = inertia.diameter, inertia.diameter / inertia.pitch_diameter
    force, speeds = np.zeros(2), []
    for psi in bearing.azimuths:
        r = -bearing.radial + moved[0] * np.cos(psi) + moved[1] * np.sin(psi)
        z = bearing.axial + moved[2] + bearing.arm * (moved[3] * np.sin(psi) - moved[4] * np.cos(psi))

        def state(c, r=r, z=z):
            inner, outer = np.arctan2(c[1], -c[0]), np.arctan2(z - c[1], c[0] - r)
            pressed = np.hypot(*c) - bearing.inner_length, np.hypot(r - c[0], z - c[1]) - bearing.outer_length
            loads = [k * max(d, 0.0) ** 1.5 for k, d in zip((bearing.inner_constant, bearing.outer_constant), pressed, strict=True)]
            beta = np.arctan2(np.sin(outer), np.cos(outer) + gamma)
            lead, lag = (1 + gamma * np.cos(outer)) / np.cos(outer - beta), (1 - gamma * np.cos(inner)) / np.cos(inner - beta)
            own = inertia.inner_speed * lag / (lag + lead)
            speed = own if cage is None else cage
            friction = 2 / diameter * inertia.mass * diameter**2 / 10 * (speed * lead / gamma) * speed * np.sin(beta)
            return *loads, inner, outer, inertia.mass * inertia.pitch_diameter / 2 * speed**2, friction, own

        def left(c, state=state):
            qi, qo, ai, ao, centrifugal, friction, _ = state(1e-3 * c)
            return [
                qi * np.cos(ai) - qo * np.cos(ao) + centrifugal + friction * np.sin(ao),
                qi * np.sin(ai) - qo * np.sin(ao) - friction * np.cos(ao),
            ]

        qi, _, ai, _, _, _, own = state(1e-3 * root(left, 500.0 * np.array([r, z]), tol=1e-14).x)
        force += qi * np.cos(ai) * np.array([np.cos(psi), np.sin(psi)])
        speeds.append(own)
    return force, float(np.mean(speeds))


def test_radial_stiffness_at_speed_is_that_of_harris_equations_with_one_cage():
    """218 bearing at speed, 17.8 kN: of the inner ring 184 N/um with the cage's speed, 172 with each ball at
    its own, for which what the outer ring feels is 156: one ring cannot be pushed by less than the other."""
    bearing = fast_218()
    centred = displacement_under(bearing, np.array([0, 0, 17800.0, 0, 0]))
    cage, aside = on_inner(bearing, centred)[1], 1e-7 * np.eye(5)[0]
    slope = -(on_inner(bearing, centred + aside, cage)[0] - on_inner(bearing, centred - aside, cage)[0]) / 2e-7
    assert respond(bearing, centred).tangent[0, 0] == pytest.approx(slope[0], rel=1e-5)
    own = -(on_inner(bearing, centred + aside)[0] - on_inner(bearing, centred - aside)[0]) / 2e-7
    assert own[0] == pytest.approx(172.1e6, rel=1e-3)


@pytest.mark.parametrize("aside", [0.0, 500.0])
def test_stiffness_with_each_ball_on_its_own_orbit(aside):
    """Against differences of what balls that know of no cage press on the outer ring: 156 N/um of the
    one above where rings are centred. Nothing of balls without inertia, or of a cage that is held."""
    bearing = fast_218()
    moved = displacement_under(bearing, np.array([aside, 0, 17800.0, 0, 0]))

    def on_outer(u):
        forces = [settled(bearing.ball, (r, z), 1e-9, 1.0).on_outer for r, z in centre_line(bearing, u).tolist()]
        return np.ravel(forces) @ kinematics(bearing).reshape(-1, 5)

    steps = np.diag([1e-9, 1e-9, 1e-9, 1e-8, 1e-8])
    slope = np.array([(on_outer(moved + h) - on_outer(moved - h)) / (2 * h.sum()) for h in steps]).T
    tangent = respond(bearing, moved).tangent
    own = (tangent + tangent.T) / 2 + by_own_orbits(bearing, moved)
    assert own == pytest.approx((slope + slope.T) / 2, rel=1e-5, abs=1e-6 * np.abs(slope).max())
    if not aside:
        assert own[0, 0] == pytest.approx(156e6, rel=3e-3)
    for still in (replace(bearing, inertia=None), replace(bearing, inertia=replace(FAST, share=0.0)), replace(bearing, inertia=replace(FAST, cage=1000.0))):
        assert not by_own_orbits(still, moved).any()


def test_both_rings_feel_the_same_across_the_axis():
    """Of balls with one cage, which stand evenly, centrifugal forces add up to nothing."""
    bearing = fast_218()
    moved = displacement_under(bearing, np.array([3000.0, -1000.0, 17800.0, 0, 0]))
    answer = respond(bearing, moved)
    along = np.stack([np.cos(bearing.azimuths), np.sin(bearing.azimuths)])
    assert np.ptp(answer.ball_force) > 0.5 * answer.ball_force.mean()
    assert -along @ (answer.ball_force * np.cos(answer.inner_angle)) == pytest.approx(answer.force[:2], rel=1e-6)


def test_heavy_balls_tangent_is_exact():
    bearing = fast_218()
    moved = displacement_under(bearing, np.array([500.0, 0, 17800.0, 0, 0]))
    tangent = respond(bearing, moved).tangent
    for i, h in enumerate((1e-9, 1e-9, 1e-9, 1e-8, 1e-8)):
        step = np.eye(5)[i] * h
        slope = (respond(bearing, moved + step).force - respond(bearing, moved - step).force) / (2 * h)
        assert slope == pytest.approx(tangent[:, i], rel=1e-5, abs=1e-6 * np.abs(tangent[:, i]).max())


def test_no_inertia_is_the_limit_of_little():
    bearing = fast_218()
    moved = np.array([0, 0, 30e-6, 0, 0])
    light = respond(replace(bearing, inertia=replace(FAST, share=1e-9)), moved)
    none = respond(replace(bearing, inertia=replace(FAST, share=0.0)), moved)
    assert light.force == pytest.approx(none.force, rel=1e-6, abs=1e-3)
    assert light.tangent == pytest.approx(none.tangent, rel=1e-5, abs=1e-5 * np.abs(none.tangent).max())
