"""Forces of imperfections: rigid displacements of a race, exact cancellation, balance, closed forms of unbalance, whirl senses."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from tests.sim.running.points import SPIN, at
from thermospindle.model.bearing.ball_row import BallInertia, displacement_under, kinematics, respond
from thermospindle.model.bearing.kinematics import Kinematics, lines, row_kinematics
from thermospindle.model.built.drawn import drawn
from thermospindle.model.built.imperfections import Imperfections, RowImperfections, Wave
from thermospindle.model.machine import Addition, Condition
from thermospindle.model.rotor.chain import matrices, motion_rows
from thermospindle.sim.effects import by_name
from thermospindle.sim.effects.effect import Effect
from thermospindle.sim.effects.structure.shaft_bending import moved
from thermospindle.sim.operating import OperatingPoint, operating_point
from thermospindle.sim.running.excitation import chain_response, excitation, harmonics, response
from thermospindle.sim.running.pulls import pulls_of
from thermospindle.sim.running.rows import free_displacements


def both(**own) -> Imperfections:
    return Imperfections(bearings={name: RowImperfections(**own) for name in ("lower", "upper")})


def dofs(point: OperatingPoint, body: str, moves: Sequence[str] = ("x", "y", "z", "tilt_x", "tilt_y")) -> list[int]:
    return [point.chain.dofs.index((body, move)) for move in moves]


# ---------------------------------------------------------------- rigid displacements


@pytest.mark.parametrize("temperature", [20.0, 60.0])
def test_an_eccentric_race_moves_the_hub_by_itself(spindle, temperature):
    """Order 1 of both outer races (crest at azimuth -0.6), as slow as can be: the hub's centre
    stands opposite to the eccentricity and nothing else moves."""
    point = at(spindle, both(outer_radial=(Wave(1, 1e-7, 0.6),)), temperature, speed=1e-3)
    forces = harmonics(point)
    assert [x.name for x in forces.line] == ["fo", "fo"]
    moved = response(point, forces).sum(axis=0)
    x, y, z, tilt_x, tilt_y = moved[dofs(point, "hub")]
    assert x == pytest.approx(-1e-7 * np.exp(-0.6j), rel=1e-6)
    assert y == pytest.approx(1j * 1e-7 * np.exp(-0.6j), rel=1e-6)
    assert abs(z) < 1e-20
    assert max(abs(tilt_x), abs(tilt_y)) * 0.01 < 1e-13
    assert np.abs(np.delete(moved, dofs(point, "hub"))).max() < 1e-13


RINGS = [("inner", 1.0), ("outer", -1.0)]


@pytest.mark.parametrize(("ring", "sign"), RINGS, ids=["inner", "outer"])
@pytest.mark.parametrize("inertia", [0.0, 1.0], ids=["light balls", "heavy balls"])
def test_order_one_is_a_rigid_displacement_of_the_race(spindle, ring, sign, inertia):
    """Radial: the ring stands off by the amplitude; axial: the race is tilted by amplitude over lever. Exact, not to first order in
    load / stiffness, and with heavy balls too."""
    heavy = replace(spindle, ball_inertia=inertia)
    bearing = operating_point(heavy, Condition(20.0, SPIN)).state.bearing("upper")
    kin = Kinematics(*{"inner": (SPIN, 0.0), "outer": (0.0, SPIN)}[ring], cage=0.5 * SPIN, spin=3 * SPIN, balls=10)
    across = RowImperfections(**{f"{ring}_radial": (Wave(1, 2e-8, 0.0),)})
    along = RowImperfections(**{f"{ring}_axial": (Wave(1, 2e-8, 0.0),)})
    [(line, moved)] = free_displacements(bearing, kin, across)
    assert line.frequency == pytest.approx(120.0)
    assert moved == pytest.approx(sign * 2e-8 * np.array([1, -1j, 0, 0, 0]), abs=1e-15)
    [(_, tilted)] = free_displacements(bearing, kin, along)
    # a ring tilted by tilt_y rises by -lever tilt_y where the wave has its crest
    assert tilted == pytest.approx(sign * 2e-8 / bearing.row.arm * np.array([0, 0, 0, -1j, -1]), abs=1e-12)


def heavy_row(spindle):
    bearing = spindle.bearing("upper")
    row = operating_point(spindle, Condition(40.0)).state.bearing("upper").row
    return replace(row, inertia=BallInertia(bearing.ball_diameter, bearing.pitch_diameter, 7800.0, 0.0, 4 * SPIN))


@pytest.mark.parametrize("contact", ["inner", "outer"])
@pytest.mark.parametrize("heavy", [False, True], ids=["light balls", "heavy balls"])
def test_thick_balls_move_the_ring_as_the_equilibrium_says(spindle, contact, heavy):
    """All balls too thick at one contact: the axial displacement under the same load, solved without linearising."""
    row = heavy_row(spindle) if heavy else replace(heavy_row(spindle), inertia=None)
    pull = pulls_of(row).by[0][2, {"inner": 2, "outer": 3}[contact]]
    moved = row.balls * pull.real / respond(row).tangent[2, 2]
    held = respond(row).force
    thick = 2e-9
    key = f"{contact}_length"
    ends = [displacement_under(replace(row, **{key: getattr(row, key) - by}), held)[2] for by in (thick, -thick)]
    assert (ends[0] - ends[1]) / (2 * thick) == pytest.approx(moved, rel=1e-5)
    assert abs(moved) > 1.0  # a thick ball moves the ring by more than itself: 1 / sin(angle) nearly


def test_a_thick_ball_presses(spindle):
    """Light balls: the push is the ball's stiffness along the contact line."""
    bearing = operating_point(spindle, Condition(20.0)).state.bearing("upper")
    pulls = pulls_of(bearing.row)
    inner, outer = ((-2 * pulls.by[1][0, which].real, -pulls.by[0][2, which].real) for which in (2, 3))  # r, z
    assert np.hypot(*inner) == pytest.approx(bearing.ball_stiffness, rel=1e-12)
    assert np.arctan2(abs(inner[1]), -inner[0]) == pytest.approx(bearing.contact_angle, rel=1e-12)
    assert np.array_equal(inner, outer)


# ---------------------------------------------------------------- what is there and what is not


@pytest.mark.parametrize("race", ["inner_radial", "inner_axial", "outer_radial", "outer_axial"])
def test_lines_are_those_of_the_rules_and_no_other(spindle, race):
    """All orders from 1 to 41 on one race: only k Z and k Z +- 1 excite."""
    own = both(**{race: tuple(Wave(n, 1e-8, 0.1 * n) for n in range(1, 42))})
    point = at(spindle, own, 40.0)
    side = race.split("_")[0]
    expected = [x for x in lines(point.spindle, row_kinematics(point.spindle, point.state), point.condition.speed, 4) if x.cause == f"{side} waviness"]
    assert sorted(map(str, harmonics(point).line)) == sorted(map(str, expected))


def test_ball_lines_are_those_of_the_rules_and_no_other(spindle):
    balls = tuple(tuple(Wave(n, 1e-8, 0.7 * j * n) for n in range(1, 7)) for j in range(10))
    point = at(spindle, both(ball_waves=balls, ball_diameter=(1e-8, *[0.0] * 9)), 40.0)
    known = lines(point.spindle, row_kinematics(point.spindle, point.state), point.condition.speed, 3)
    expected = [x for x in known if x.cause in ("ball waviness", "ball size")]
    assert sorted(map(str, harmonics(point).line)) == sorted(map(str, expected))


@pytest.mark.parametrize("order", [2, 5, 8, 12, 15, 28])
def test_other_orders_cancel_to_rounding(spindle, order):
    """Ball by ball at any instant, B^T k w summed without any of the module's sums: 1e-12 of what the balls feel."""
    row = operating_point(spindle, Condition(20.0)).state.bearing("upper").row
    one = respond(replace(row, balls=1)).tangent[np.ix_([0, 2], [0, 2])]
    for turned in (0.0, 0.123, 2.2):
        place = 2 * np.pi * np.arange(10) / 10 + turned
        b = np.array([kinematics(replace(row, balls=1))[0] @ rotation(p) for p in place])
        felt = b.transpose(0, 2, 1) @ (one @ np.stack([np.cos(order * place + 0.3), 0 * place]))[None].transpose(2, 1, 0)
        whole = np.abs(felt).sum(axis=0)[:, 0]
        assert np.abs(felt.sum(axis=0)[:, 0]).max() < 1e-12 * whole.max()


def rotation(angle: float) -> np.ndarray:
    """Turns a 5-vector by minus `angle` about z: what a ball at that azimuth sees in its own plane."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, s], [-s, c]])
    out = np.eye(5)
    out[:2, :2] = out[3:, 3:] = turn
    return out


def test_odd_orders_of_heavy_balls_do_not_cancel(spindle):
    """With centrifugal force the two contacts differ: an odd order keeps their small difference, which linear theory leaves out."""
    balls = tuple((Wave(3, 1e-8, 0.7 * j),) for j in range(10))
    heavy = replace(spindle, ball_inertia=1.0)
    assert harmonics(at(spindle, both(ball_waves=balls))).line == ()
    odd = harmonics(at(heavy, both(ball_waves=balls)))
    even = harmonics(at(heavy, both(ball_waves=tuple((replace(w[0], order=2),) for w in balls))))
    assert {x.name for x in odd.line} == {"3 fb", "3 fb - fc", "3 fb + fc"}
    assert 0 < np.abs(odd.force).max() < 0.01 * np.abs(even.force).max()


def test_nothing_at_rest_and_nothing_of_a_perfect_spindle(spindle):
    resting = harmonics(at(spindle, drawn(spindle, 1), speed=0.0))
    assert resting.line == ()
    assert resting.force.shape == (0, len(at(spindle, Imperfections()).chain.dofs))
    assert harmonics(at(spindle, Imperfections())).line == ()


# ---------------------------------------------------------------- balance and closed forms


def test_bearing_forces_balance(spindle):
    """What acts on the outer body acts opposite on the inner one: forces, and moments about any one point of the axis."""
    point = at(spindle, replace(drawn(spindle, 2), unbalance=0.0, couple_unbalance=0.0), 40.0)
    forces = harmonics(point).force
    whole = np.zeros((len(forces), 5), complex)
    for body in ("shaft", "hub"):
        own = point.chain.body(body)
        five = forces[:, dofs(point, body)].copy()
        arm = own.z - 0.01  # moments about z = 10 mm
        five[:, 3] -= arm * five[:, 1]
        five[:, 4] += arm * five[:, 0]
        whole += five
    assert len(forces) > 40
    assert np.abs(whole).max() < 1e-12 * np.abs(forces).max()
    assert np.abs(forces[:, dofs(point, "seat", ("z", "tilt_x", "tilt_y")) + dofs(point, "base", ("z",))]).max() == 0


def test_unbalance_is_m_e_omega_squared(spindle):
    """Static and couple unbalance on the hub: force, its moment about the mass centre, and the couple, with their phases."""
    point = at(spindle, Imperfections(2e-8, 0.015, 0.4, 3e-11, 1.1))
    hub = point.chain.body("hub")
    [line], [force] = harmonics(point).line, harmonics(point).force
    assert (line.name, line.frequency, line.whirl) == ("1x", pytest.approx(120.0), 1)
    time = 1.7e-3
    moving = np.real(force * np.exp(2j * np.pi * line.frequency * time))[dofs(point, "hub")]
    static, couple = SPIN * time + 0.4, SPIN * time + 1.1
    size, arm = 2e-8 * SPIN**2, 0.015 - hub.z
    expected = size * np.array([np.cos(static), np.sin(static), 0, -arm * np.sin(static), arm * np.cos(static)])
    expected[3:] += 3e-11 * SPIN**2 * np.array([-np.sin(couple), np.cos(couple)])
    assert moving == pytest.approx(expected, rel=1e-12)


def test_a_couple_is_two_opposite_unbalances(spindle):
    """U at +h/2 and -U at -h/2 (opposite phase) excite as the couple U h."""
    h = 0.012
    pair = [at(spindle, Imperfections(1e-8, 0.01 + s * h / 2, 0.4 + (s < 0) * np.pi)) for s in (1, -1)]
    couple = harmonics(at(spindle, Imperfections(couple_unbalance=1e-8 * h, couple_phase=0.4)))
    total = sum(harmonics(p).force for p in pair)
    assert total == pytest.approx(couple.force, rel=1e-9, abs=1e-12 * np.abs(couple.force).max())


def test_a_free_rotor_turns_about_its_mass_centre(spindle):
    """Far above resonance the hub's mass centre stands still: the axis circles by U / m opposite to the unbalance."""
    point = at(spindle, Imperfections(2e-8, next(b.z for b in spindle.structure.bodies if b.turns), 0.0))
    free = replace(point.chain, elements=(), speed=SPIN, bodies=tuple(b for b in point.chain.bodies if b.turns))
    forces = harmonics(point)
    here = replace(forces, force=forces.force[:, dofs(point, "hub")])
    moved = chain_response(replace(free, elements=()), here)[0]
    assert moved[0] == pytest.approx(-2e-8 / free.bodies[0].mass, rel=1e-9)


def test_an_unbalanced_cage_pulls_the_outer_body_at_its_bearing(spindle):
    point = at(spindle, Imperfections(bearings={"upper": RowImperfections(cage_unbalance=1e-9, cage_phase=0.5)}))
    forces, cage = harmonics(point), row_kinematics(point.spindle, point.state)["upper"].cage
    [line] = forces.line
    assert (line.cause, line.bearing, line.frequency) == ("cage unbalance", "upper", pytest.approx(cage / (2 * np.pi)))
    across = 1e-9 * cage**2 * np.exp(0.5j) * np.array([1, -1j])
    expected = across @ motion_rows(point.chain, "hub", (0, 0, point.state.bearing("upper").z))[:2]
    assert forces.force[0] == pytest.approx(expected, rel=1e-12)


def test_whirl_senses_are_those_of_the_lines(spindle):
    """Forward: y a quarter period behind x. Holds turning either way, and lines and sizes do not change with the sense."""
    own = drawn(spindle, 3)
    ahead, back = at(spindle, own, 40.0), at(spindle, own, 40.0, -SPIN)
    for point, sense in ((ahead, 1), (back, -1)):
        found = harmonics(point)
        x, y = found.force[:, dofs(point, "hub", ("x", "y"))].T
        for n, line in enumerate(found.line):
            if line.direction == "radial":
                assert y[n] / x[n] == pytest.approx(-1j * line.whirl * sense, rel=1e-9)
            else:
                assert abs(x[n]) < 1e-15 * np.abs(found.force[n]).max()
    first, second = harmonics(ahead), harmonics(back)
    assert [x.name for x in first.line] == [x.name for x in second.line]
    assert first.frequency == pytest.approx(second.frequency, rel=1e-12)


def test_response_solves_the_equations_of_motion(spindle):
    """M q'' + C q' + K q = f at an instant, put together in time."""
    point = at(spindle, drawn(spindle, 3), 40.0)
    forces, linear, time = harmonics(point), matrices(point.chain), 0.0137
    turned = np.exp(2j * np.pi * forces.frequency * time)[:, None]
    q, omega = response(point, forces) * turned, 2j * np.pi * forces.frequency[:, None]
    position, speed, acceleration = (np.real(np.sum(v, axis=0)) for v in (q, omega * q, omega**2 * q))
    pushed = np.real(np.sum(forces.force * turned, axis=0))
    left = linear.mass @ acceleration + linear.damping @ speed + linear.stiffness @ position
    assert left == pytest.approx(pushed, abs=1e-10 * np.abs(linear.stiffness @ position).max())


def test_force_is_proportional_to_size(spindle):
    one, ten = (harmonics(at(spindle, both(outer_radial=(Wave(11, size, 0.2),)))) for size in (1e-9, 1e-8))
    assert ten.force == pytest.approx(10 * one.force, rel=1e-12)


def test_something_soft_in_series_does_not_change_what_an_eccentric_race_does(spindle):
    """An effect that softens the bearings: the hub still follows an eccentric race in full."""
    soft = replace(spindle, effects=(Addition("bond_softening", by_name("bond_softening").typical()),))
    own = both(outer_radial=(Wave(1, 1e-7, 0.0),))
    point, plain = at(soft, own, 60.0, 1e-3), at(spindle, own, 60.0, 1e-3)
    hub = dofs(point, "hub", ("x",))
    assert np.abs(harmonics(point).force).max() < 0.99 * np.abs(harmonics(plain).force).max()
    assert response(point, harmonics(point)).sum(axis=0)[hub] == pytest.approx(-1e-7, rel=1e-6)


def test_a_bearing_told_at_another_height_is_the_same_bearing(spindle):
    """An effect may tell a bearing's stiffness by the motion at another height of the axis: the forces on the bodies stay."""

    def lifted(s, c, v, chain):
        return replace(chain, elements=tuple(moved(e, e.z + 3e-3) if e.name == "upper" else e for e in chain.elements))

    made = replace(spindle, imperfections=drawn(spindle, 1))
    told = Effect("told", "", "", (), "", (), "", chain=lifted)
    plain, other = (operating_point(made, Condition(40.0, SPIN), effects) for effects in ([], [(told, {})]))
    assert {e.z for e in other.chain.elements} != {e.z for e in plain.chain.elements}
    first, second = harmonics(plain).force, harmonics(other).force
    assert second == pytest.approx(first, abs=1e-12 * np.abs(first).max())


def test_an_effect_may_change_imperfections(spindle):
    """The hook of an effect is seen by the forces, on top of the scene's imperfections."""
    hook = Effect("heavier", "", "", (), "", (), "", imperfections=lambda s, c, v, own: replace(own, unbalance=own.unbalance + v["added"]))
    plain = replace(spindle, imperfections=Imperfections(unbalance=1e-8))
    point = operating_point(plain, Condition(20.0, SPIN), [(hook, {"added": 2e-8})])
    without = operating_point(plain, Condition(20.0, SPIN))
    assert harmonics(point).force == pytest.approx(3 * harmonics(without).force, rel=1e-12)


def test_others_may_stand_in_for_the_scenes(spindle):
    point = at(spindle, Imperfections())
    assert excitation(point).line == ()
    assert [x.name for x in excitation(point, Imperfections(unbalance=1e-8)).line] == ["1x"]
