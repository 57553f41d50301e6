"""External radial load: balance of forces and moments, shares, symmetry, small loads, stiffness as the derivative."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import ROOT
from thermospindle.model.bearing.ball_row import respond
from thermospindle.model.bearing.pair import solve
from thermospindle.model.bearing.roller import EXPONENT, line_constant
from thermospindle.model.bearing.row import reference_motion
from thermospindle.model.carrier import load_carrier
from thermospindle.model.errors import BadInput, NoEquilibrium
from thermospindle.model.machine import Condition, RadialLoad, Spindle
from thermospindle.model.rotor.chain import matrices, motion_rows, point_row, rotor_base
from thermospindle.model.rotor.loaded import loaded, motion
from thermospindle.model.rotor.static import static
from thermospindle.model.scene.reading import build, load
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point

FILE = ROOT / "tests" / "scenes" / "symmetric" / "spindle.toml"
FIVE = ROOT / "scenes" / "five_bearing" / "spindle.toml"


def raw_of(file):
    return tomllib.loads(file.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def pair() -> Spindle:
    """A rigid hub on two opposed rows."""
    return build(raw_of(FILE), FILE)


@pytest.fixture(scope="module")
def five() -> Spindle:
    return build(raw_of(FIVE), FIVE)


def under(spindle: Spindle, force: tuple[float, float], z: float, speed: float = 0.0):
    """The state at the reference temperature under a radial load at a height."""
    pushed = replace(spindle, radial_loads=(RadialLoad(force, z),))
    still = {b.name: reference_motion(spindle.reference_temperature) for b in spindle.ringed}
    return pushed, loaded(pushed, solve(pushed, Condition(spindle.reference_temperature, speed), still))


def shares(state):
    """Radial forces on the outer rings (bearings, 2), N."""
    return np.array([b.radial_force for b in state.bearings])


def test_forces_and_moments_balance(pair: Spindle) -> None:
    """The hub carries the outer rings: what the rows put on it and the load cancel, and so do their
    moments, tilt moments of the rows included."""
    force, z = np.array([3.0, -1.0]), 0.025
    _, state = under(pair, (3.0, -1.0), z)
    assert shares(state).sum(axis=0) == pytest.approx(force, rel=1e-6)
    held = [respond(b.row, np.array(b.displacement)).force for b in state.bearings]
    about_x = sum(f[3] - b.z * f[1] for f, b in zip(held, state.bearings, strict=True))
    about_y = sum(f[4] + b.z * f[0] for f, b in zip(held, state.bearings, strict=True))
    assert about_x == pytest.approx(-z * force[1], rel=1e-6)
    assert about_y == pytest.approx(z * force[0], rel=1e-6)
    assert sum(f[2] for f in held) == pytest.approx(0.0, abs=1e-6)


def test_two_loads_are_the_one_of_their_forces_and_moments(pair: Spindle, five: Spindle) -> None:
    """On one rigid body."""
    one, two = ((RadialLoad((3.0, -1.0), 0.025),), (RadialLoad((1.0, -1.0), 0.025), RadialLoad((3.0, 0.0), 0.05), RadialLoad((-1.0, 0.0), 0.1)))
    still = {b.name: reference_motion(pair.reference_temperature) for b in pair.ringed}
    state = solve(pair, Condition(pair.reference_temperature), still)
    first, second = (loaded(replace(pair, radial_loads=loads), state) for loads in (one, two))
    assert shares(second) == pytest.approx(shares(first), rel=1e-9)


@pytest.mark.parametrize("scene", ["pair", "five"])
def test_weight_is_borne_by_the_rows_of_what_turns(scene: str, request: pytest.FixtureRequest) -> None:
    """Each mass where it is: forces on the outer rings add up to the weight of what the rows carry, and
    their moment is that of its centre of mass. It is far below the preload, so a second g adds as much."""
    spindle = request.getfixturevalue(scene)
    still = {b.name: reference_motion(spindle.reference_temperature) for b in spindle.ringed}
    state = solve(spindle, Condition(spindle.reference_temperature), still)
    outside = {b.outer_body for b in spindle.bearings}
    carried = [b for b in spindle.structure.bodies if b.turns]
    sign = 1.0 if outside <= {b.name for b in carried} else -1.0  # the force on the outer ring bears what hangs on it, or is what it bears of the inner one
    under_g, under_2g = (loaded(replace(spindle, gravity=(0.0, -g)), state) for g in (9.81, 19.62))
    weight = 9.81 * sum(b.mass for b in carried)
    assert sign * shares(under_g).sum(axis=0) == pytest.approx([0.0, -weight], rel=1e-6, abs=1e-9)
    held = [respond(b.row, np.array(b.displacement)).force for b in under_g.bearings]
    about_x = sum(f[3] - b.z * f[1] for f, b in zip(held, under_g.bearings, strict=True))
    assert sign * about_x == pytest.approx(9.81 * sum(b.mass * b.z for b in carried), rel=1e-6)
    assert shares(under_2g) == pytest.approx(2 * shares(under_g), rel=0.01, abs=1e-3 * weight)


def test_a_preload_that_a_load_turns_round_is_less_than_nothing(pair: Spindle) -> None:
    """Far beyond any use: under 8 kN across and 9.6 kN along, a row bears along z against its own
    sense; with their signs, the forces bear the load."""
    _, state = under(replace(pair, axial_load=9600.0), (8000.0, 0.0), 0.02)
    forces = [pair.bearing(b.name).sense * b.preload for b in state.bearings]
    assert min(b.preload for b in state.bearings) < -10.0
    assert sum(forces) == pytest.approx(9600.0, rel=1e-6)


def test_a_load_in_the_middle_is_shared_evenly(pair: Spindle) -> None:
    middle = sum(b.z for b in pair.bearings) / 2
    _, state = under(pair, (2.0, 0.0), middle)
    lower, upper = shares(state)
    assert lower == pytest.approx([1.0, 0.0], abs=1e-7)
    assert upper == pytest.approx([1.0, 0.0], abs=1e-7)


@pytest.mark.parametrize("turns", [1, 2, 5])  # of one ball
def test_a_turned_load_turns_the_answer(pair: Spindle, turns: int) -> None:
    """By whole steps of the balls nothing else changes."""
    angle = 2 * np.pi * turns / pair.bearings[0].balls
    c, s = np.cos(angle), np.sin(angle)
    _, straight = under(pair, (4.0, 0.0), 0.02)
    _, turned = under(pair, (4.0 * c, 4.0 * s), 0.02)
    spin = np.array([[c, -s], [s, c]])
    both = np.zeros((5, 5))
    both[:2, :2], both[2, 2], both[3:, 3:] = spin, 1.0, spin
    for a, b in zip(straight.bearings, turned.bearings, strict=True):
        assert b.stiffness == pytest.approx(both @ a.stiffness @ both.T, abs=1e-6 * np.abs(a.stiffness).max())
        assert b.contact_force == pytest.approx(a.contact_force, rel=1e-6)


def test_a_small_load_leaves_the_stiffness(pair: Spindle) -> None:
    _, state = under(pair, (1e-4, 0.0), 0.02)
    _, none = under(pair, (0.0, 0.0), 0.02)
    assert none.bearings[0].displacement == ()
    for a, b in zip(state.bearings, none.bearings, strict=True):
        assert a.stiffness == pytest.approx(b.stiffness, abs=1e-4 * np.abs(b.stiffness).max())
        assert a.damping == pytest.approx(b.damping, abs=1e-4 * np.abs(b.damping).max())


@pytest.mark.parametrize("load", [1e-2, 1e-3, 1e-4, 1e-5])
def test_a_load_that_goes_to_nothing_is_borne(five: Spindle, load: float) -> None:
    """Where rounding is more than a billionth of the motion, it was said that nothing balances."""
    _, state = under(five, (load, 0.0), 0.0)
    assert sum(b.radial_force[0] for b in state.bearings) == pytest.approx(-load, rel=1e-5)


def test_a_large_load_unloads_balls_opposite_and_presses_others(pair: Spindle) -> None:
    _, state = under(pair, (30.0, 0.0), 0.011)
    _, none = under(pair, (0.0, 0.0), 0.0)
    assert state.bearings[0].contact_force > 1.5 * none.bearings[0].contact_force
    along, across = state.bearings[0].stiffness[0, 0], state.bearings[0].stiffness[1, 1]
    assert along != pytest.approx(across, rel=0.02)


def test_where_balls_are_let_go_the_mean_over_the_places_of_the_cage_balances(pair: Spindle) -> None:
    """Of the forces of rows turned ball by ball, place by place; and so is the stiffness: no place of the cage is the row's own."""
    _, state = under(pair, (60.0, 10.0), 0.02)
    loose = 0
    for b in state.bearings:
        q, found, tangents = np.array(b.displacement), [], []
        for turn in 2 * np.pi / b.row.balls * np.arange(16) / 16:
            c, s = np.cos(turn), np.sin(turn)
            turned = np.eye(5)
            turned[:2, :2] = turned[3:, 3:] = [[c, s], [-s, c]]
            answer = respond(b.row, turned @ q)
            loose += not answer.in_contact.all()
            found.append(turned.T @ answer.force)
            tangents.append(turned.T @ answer.tangent @ turned)
        assert b.radial_force == pytest.approx(np.mean(found, axis=0)[:2], rel=1e-9)
        assert b.stiffness == pytest.approx(np.mean(tangents, axis=0), rel=1e-9, abs=1e-9 * b.stiffness[0, 0])
    assert loose
    assert shares(state).sum(axis=0) == pytest.approx([60.0, 10.0], rel=1e-6)


@pytest.mark.parametrize("speed", [0.0, 800.0])
def test_stiffness_is_the_derivative_of_the_motion(five: Spindle, speed: float) -> None:
    """A little more load moves the nose by the static compliance of the chain in the loaded state, with balls' inertia too."""
    nose = next(p for p in five.points if p.name == "nose")
    force, step = 2000.0, 1.0
    found = []
    for more in (-step, step):
        pushed, state = under(five, (force + more, 0.0), 0.0, speed)
        found.append(sum(b.radial_force[0] for b in state.bearings))
    assert found[1] - found[0] == pytest.approx(-2 * step, rel=1e-5)  # the shaft carries the inner rings
    pushed, state = under(five, (force, 0.0), 0.0, speed)
    compliance = 1 / static(pushed, rotor_base(pushed, state), nose).stiffness
    ahead, behind = (_nose(five, force + more, speed) for more in (step, -step))
    assert (ahead - behind) / (2 * step) == pytest.approx(compliance, rel=2e-3)


def _nose(five: Spindle, force: float, speed: float) -> float:
    """Motion (m) of the nose."""
    pushed = replace(five, radial_loads=(RadialLoad((force, 0.0), 0.0),))
    still = {b.name: reference_motion(20.0) for b in five.ringed}
    chain, moved = motion(pushed, solve(pushed, Condition(20.0, speed), still))
    return float(point_row(chain, next(p for p in five.points if p.name == "nose")) @ moved)


def test_the_front_rows_bear_most_of_a_load_at_the_nose(five: Spindle) -> None:
    _, state = under(five, (1000.0, 0.0), 0.0)
    along = -shares(state)[:, 0]
    assert along.sum() == pytest.approx(1000.0, rel=1e-6)
    assert along[0] > along[1] > along[2] > 0 > along[3:].sum()  # a lever: the rear set is lifted


def on_spring(rate: float | None, mass: float = 0.0) -> Spindle:
    """The small shaft whose upper row's ring slides on a spring."""
    file = ROOT / "tests" / "scenes" / "inner_turning_spring" / "spindle.toml"
    own = build(raw_of(file), file)
    [pair] = own.sets
    assert pair.spring is not None
    return replace(own, sets=(replace(pair, spring=replace(pair.spring, rate=rate, mass=mass)),))


def test_a_ring_on_a_spring_slides_under_the_load() -> None:
    """A spring without a rate keeps its force: each row has the 16 N it was set to, as with a soft
    one. One without end stiff is a fixed ring, which the rows' own axial push under a radial load
    makes 16.5 N. Between them the spring's force goes with how far the ring slid."""
    free, soft, stiff, stiffer = (under(on_spring(rate), (20.0, 5.0), 0.01)[1].bearings for rate in (None, 1.0, 1e12, 1e13))
    fixed = under(replace(on_spring(None), sets=tuple(replace(s, spring=None) for s in on_spring(None).sets)), (20.0, 5.0), 0.01)[1].bearings
    for a, b, c, d, e in zip(free, soft, stiff, stiffer, fixed, strict=True):
        assert a.preload == pytest.approx(16.0, rel=1e-6)
        assert b.preload == pytest.approx(16.0, rel=1e-6)
        assert a.stiffness == pytest.approx(b.stiffness, rel=1e-6, abs=1e-6 * np.abs(b.stiffness).max())
        assert c.preload == pytest.approx(d.preload, rel=1e-5)
        assert c.preload == pytest.approx(e.preload, rel=1e-5)
        assert c.stiffness == pytest.approx(e.stiffness, rel=1e-4, abs=1e-6 * np.abs(e.stiffness).max())
        assert e.preload > 16.4
    rate = 2e6
    pushed, state = under(on_spring(rate), (20.0, 5.0), 0.01)
    lower, upper = state.bearings
    assert shares(state).sum(axis=0) == pytest.approx([-20.0, -5.0], rel=1e-6)
    chain, moved = motion(pushed, solve(pushed, Condition(20.0), {b.name: reference_motion(20.0) for b in pushed.ringed}))
    housing = moved[chain.dofs.index(("housing", "z"))]
    ring = moved[chain.dofs.index(("upper sprung ring", "z"))]
    assert upper.preload - 16.0 == pytest.approx(abs(rate * (ring - housing)), rel=1e-4)
    assert lower.preload == pytest.approx(upper.preload, rel=1e-6)


@pytest.mark.parametrize("mass", [0.0, 2e-3])
def test_stiffness_behind_a_spring_is_the_derivative_of_the_motion(mass: float) -> None:
    spindle, step = on_spring(2e6, mass), 0.05
    point = next(p for p in spindle.points if p.direction == (1.0, 0.0, 0.0))
    moved = []
    for more in (-step, step):
        pushed = replace(spindle, radial_loads=(RadialLoad((20.0 + more, 0.0), point.position[2]),))
        chain, u = motion(pushed, solve(pushed, Condition(20.0), {b.name: reference_motion(20.0) for b in pushed.ringed}))
        moved.append(float(point_row(chain, point) @ u))
    pushed, state = under(spindle, (20.0, 0.0), point.position[2])
    chain, z = rotor_base(pushed, state), point.position[2]
    load = motion_rows(chain, load_carrier(pushed, pushed.radial_loads[0]).name, (0.0, 0.0, z))[0]
    compliance = float(point_row(chain, point) @ np.linalg.solve(matrices(chain).stiffness, load))
    assert (moved[1] - moved[0]) / (2 * step) == pytest.approx(compliance, rel=2e-3)


def rollers() -> Spindle:
    """The small shaft on two loose roller rows and, along the axis, a bearing given by numbers."""
    raw = raw_of(ROOT / "tests" / "scenes" / "inner_turning_spring" / "spindle.toml")
    told = {"origin": "assumed", "source": "test"}
    raw["roller_rows"] = {
        "row": told
        | {"rollers": 16, "roller_diameter_mm": 1.588, "roller_length_mm": 1.6, "pitch_diameter_mm": 9.1, "mounted_clearance_um": 4.0}
        | {"roller_material": "steel", "ring_material": "steel", "damping_ratio": 0.02}
    }
    for b in raw["bearings"].values():
        b["row"] = "row"
    raw["bearings"]["thrust"] = told | {"z_mm": 10.0, "numbers": {"matrix_SI": np.diag([0, 0, 1e7, 0, 0]).tolist(), "damping_ratio": 0.01}}
    for key in ("bearing_pair", "ball_rows"):
        raw.pop(key)
    return build(raw, FILE)


def test_loose_rollers_are_pressed_by_the_load() -> None:
    """Half of a load in the middle each, on the rollers that its zone holds: at the deepest c d^n, by the balance along the load."""
    spindle = rollers()
    middle = sum(b.z for b in spindle.roller_bearings) / 2
    _, state = under(spindle, (0.0, 40.0), middle)
    assert len(state.rollers) == 2
    for b in state.rollers.values():
        assert b.radial_force == pytest.approx((0.0, -20.0), abs=1e-6)
        deepest = (b.contact_force / line_constant(1.6e-3, 208e9 / (2 * (1 - 0.3**2)))) ** (1 / EXPONENT)
        azimuth = 2 * np.pi * (np.arange(16_000) + 0.5) / 16_000  # of the rollers at all places of the cage
        pressed = np.maximum((deepest + 2e-6) * np.cos(azimuth) - 2e-6, 0.0)
        carried = line_constant(1.6e-3, 208e9 / (2 * (1 - 0.3**2))) * (pressed**EXPONENT * np.cos(azimuth)).sum() / 1000
        assert carried == pytest.approx(20.0, rel=1e-6)
        assert b.stiffness[1, 1] > b.stiffness[0, 0] > 0


def test_balls_that_a_load_brings_into_contact_are_damped_as_any() -> None:
    """Found by `make torture`: rows without contact before the load have no stiffness to take the damping's share from."""
    file = ROOT / "scenes" / "tailstock" / "spindle.toml"
    spindle = replace(build(raw_of(file), file), radial_loads=(RadialLoad((0.0, 7000.0), 0.0),))
    apart = {b.name: replace(reference_motion(spindle.reference_temperature), outer_r=40e-6 * (b.name in {r.name for r in spindle.bearings})) for b in spindle.ringed}
    before = solve(spindle, Condition(spindle.reference_temperature, 0.0), apart)
    assert any(not np.any(b.stiffness) for b in before.bearings)
    for b in loaded(spindle, before).bearings:
        assert np.all(np.isfinite(b.damping))
        own = spindle.bearing(b.name).damping_ratio / (np.pi * spindle.structure.damping_frequency)
        assert b.damping == pytest.approx(own * b.stiffness, rel=1e-12)


def test_a_load_that_nothing_bears_is_refused() -> None:
    spindle = rollers()
    free = replace(spindle, roller_bearings=(), linear_bearings=spindle.linear_bearings)
    with pytest.raises(NoEquilibrium, match="nothing bears the load across the axis"):
        under(free, (1.0, 0.0), 0.0)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"radial_load_N": [1.0, 0.0]}, "radial_load_z_mm is missing"),
        ({"radial_load_N": [1.0], "radial_load_z_mm": 0.0}, "radial_load_N"),
        ({"radial_load_N": ["1", 0.0], "radial_load_z_mm": 0.0}, "radial_load_N.1 = '1': input should be a valid number"),
    ],
)
def test_a_load_is_told_whole(change: dict, why: str) -> None:
    with pytest.raises(BadInput, match=why):
        build(raw_of(FILE) | change, FILE)


@pytest.mark.parametrize("load", [400.0, 800.0])
def test_rings_that_turn_against_each_other_bear_a_load(load: float) -> None:
    """A housing that turns as fast as the shaft the other way: balls that the load lets go had no equilibrium."""
    file = ROOT / "scenes" / "templates" / "grinding.toml"
    raw = raw_of(file) | {"ball_inertia": 1.0}
    raw["structure"]["bodies"][0] |= {"turns": True, "speed_ratio": -1.0, "polar_inertia_kg_m2": 0.02}
    _, state = under(build(raw, file), (load, 0.0), 8e-3, 2094.4)
    assert abs(shares(state).sum(axis=0)) == pytest.approx([load, 0.0], rel=1e-6, abs=1e-6 * load)
    least = [respond(b.row, np.array(b.displacement)).ball_force.min() for b in state.bearings]
    assert 0 <= min(least) < 3.0


@pytest.mark.parametrize("rpm", [0.05, 0.3])
def test_loose_balls_that_weigh_next_to_nothing_hinder_no_balance(rpm: float) -> None:
    """Their centrifugal force is less than what a settled ball may be off by: from where they stood they
    counted as settled, with nothing that holds them. They are sought from centred rings then."""
    scene = load(ROOT / "scenes" / "templates" / "grinding.toml")
    pressed = replace(scene, radial_loads=(RadialLoad((8815.241432296016, 0.0), 0.2803687682494804),))
    slow, still = (operating_point(pressed, Condition(19.78640382770534, speed * RPM)).state for speed in (rpm, 0.0))
    for a, b in zip(slow.bearings, still.bearings, strict=True):
        assert a.contact_force == pytest.approx(b.contact_force, rel=1e-5, abs=1e-3)
