"""The pair's axial equilibrium: invariances, arrangements, preload kinds, unloading, temperature."""

from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.mounting import sprung
from thermospindle.model.bearing.ball_row import respond
from thermospindle.model.bearing.definitions import SENSE, PreloadSpring
from thermospindle.model.bearing.pair import bearing_state, solve
from thermospindle.model.bearing.row import reference_deformation, reference_motion, row_at
from thermospindle.model.built.tolerance import scaled_preload
from thermospindle.model.errors import NoEquilibrium
from thermospindle.model.machine import Condition, RingMotion
from thermospindle.model.material import Law
from thermospindle.model.scene.reading import load
from thermospindle.model.sense import of_states
from thermospindle.thermal.expansion import expand


def motions(spindle, **moves):
    nothing = reference_motion(spindle.reference_temperature)
    return {b.name: replace(nothing, **moves.get(b.name, moves.get("both", {}))) for b in spindle.bearings}


def arranged(spindle, arrangement):
    bearings = tuple(replace(b, sense=s) for b, s in zip(spindle.bearings, SENSE[arrangement], strict=True))
    share = 2 if arrangement == "tandem" else 1  # of a tandem pair each row has the preload, and the set both
    return replace(spindle, bearings=bearings, sets=tuple(replace(s, preload=share * s.preload) for s in spindle.sets))


def test_reference_state(cold):
    """Table 1 of the paper and what follows from it (verification.md, 1e-3)."""
    for state in cold.bearings:
        assert np.degrees(state.contact_angle) == pytest.approx(24.51, rel=1e-12)
        assert state.preload == pytest.approx(16.0, rel=1e-9)
        assert state.contact_force == pytest.approx(3.857, rel=1e-3)
        assert state.deformation == pytest.approx(1.0542e-6, rel=1e-3)
        assert state.ball_stiffness == pytest.approx(5.488e6, rel=1e-3)
        assert state.radial_stiffness == pytest.approx(22.75e6, rel=1e-3)
        assert state.axial_stiffness == pytest.approx(9.755e6, rel=1e-3)
    assert cold.hub_movement == pytest.approx(0.0, abs=1e-15)
    assert cold.status == "in contact"


@pytest.mark.parametrize(("outward", "preload"), [(0.2, 12.06), (0.4, 8.51), (0.6, 5.39), (0.8, 2.78), (1.0, 0.82)])
def test_outer_races_moved_outward(spindle, outward, preload):
    """Preload against outward motion of both outer races at fixed axial position (verification.md, 2e-3)."""
    state = solve(spindle, Condition(20.0), motions(spindle, both={"outer_r": outward * 1e-6}))
    assert state.bearings[0].preload == pytest.approx(preload, abs=max(2e-3 * preload, 5e-3))


def test_uniform_strain_changes_no_angle(spindle):
    """Everything grown by one strain: same angle, deformation grown by the strain (exact with radii from the bearing data)."""
    strain = 1e-3
    moved = {}
    for b in spindle.bearings:
        loaded = b.unloaded_distance + 1.0542095183058289e-6
        inner = b.pitch_diameter / 2 + loaded * np.cos(b.contact_angle) / 2 - b.inner_conformity * b.ball_diameter
        outer = b.pitch_diameter / 2 - loaded * np.cos(b.contact_angle) / 2 + b.outer_conformity * b.ball_diameter
        moved[b.name] = RingMotion(strain * inner, strain * b.z, strain * outer, strain * b.z, strain, strain, strain, 20.0)
    state = solve(spindle, Condition(20.0), moved)
    for b in state.bearings:
        assert np.degrees(b.contact_angle) == pytest.approx(24.51, rel=1e-6)
        assert b.deformation == pytest.approx(1.0542095183e-6 * (1 + strain), rel=1e-6)


def test_axial_forces_balance_and_the_hub_moves_to_the_softer_side(spindle):
    """Eq. (8): with unlike radial motion the forces stay equal, and the hub moves towards the bearing that lost more."""
    state = solve(spindle, Condition(20.0), motions(spindle, upper={"outer_r": 0.4e-6}, lower={"outer_r": 0.1e-6}))
    lower, upper = state.bearings
    assert lower.preload == pytest.approx(upper.preload, rel=1e-9)
    assert state.hub_movement > 1e-9
    assert upper.contact_angle > lower.contact_angle


def test_unloading_is_a_state(spindle):
    """Races far enough apart: no contact, no force, no stiffness, and the state says so."""
    state = solve(spindle, Condition(20.0), motions(spindle, both={"outer_r": 3e-6}))
    for b in state.bearings:
        assert not b.in_contact
        assert b.contact_force == 0
        assert np.all(b.stiffness == 0)
        assert b.deformation < 0
    assert state.status == "lower and upper bearing lost contact"


@pytest.mark.parametrize(("share", "touching"), [(1e-3, True), (1e-12, False), (1e-16, False)])
def test_a_rounding_error_of_load_is_no_contact(spindle, share, touching):
    """Where a rigid pair has play, its equilibrium may be found at an end of it, with 1e-16 of the preload on one side: both are loose."""
    b = spindle.bearings[0]
    row = row_at(spindle, b, b.sense, reference_motion(20.0), 0.0)
    length = row.unloaded_distance + reference_deformation(spindle, b) * share ** (2 / 3)
    state = bearing_state(spindle, b, replace(row, axial=b.sense * np.sqrt(length**2 - row.radial**2)))
    assert 0 < state.preload < 1.1 * share * b.preload
    assert state.in_contact is touching


def test_spring_preload_stays_constant(spindle):
    spring = sprung(spindle)
    state = solve(spring, Condition(20.0), motions(spindle, upper={"outer_r": 0.8e-6}, lower={"outer_z": 2e-6}))
    assert [b.preload for b in state.bearings] == pytest.approx([16.0, 16.0], rel=1e-9)
    assert state.bearings[1].contact_angle > state.bearings[0].contact_angle


def test_a_preload_spring_gives_way_as_its_ring_slides(spindle):
    """Force balances at the ring and at the hub; a rate from nothing to rigid goes from constant force to fixed positions."""
    moved = motions(spindle, upper={"outer_r": 0.3e-6}, lower={"outer_z": 0.2e-6})
    for bias in (0.0, 3.0):
        base = replace(spindle, axial_load=bias)
        soft, fixed = solve(sprung(base), Condition(20.0), moved), solve(base, Condition(20.0), moved)
        for rate, expected in ((1.0, soft), (1e13, fixed)):
            state = solve(sprung(base, rate=rate), Condition(20.0), moved)
            assert [b.preload for b in state.bearings] == pytest.approx([b.preload for b in expected.bearings], rel=1e-5)
            assert state.hub_movement == pytest.approx(expected.hub_movement, rel=1e-5, abs=1e-14)
        state = solve(sprung(base, rate=2e6), Condition(20.0), moved)
        lower, upper = state.bearings
        assert upper.preload == pytest.approx(16.0 - 2e6 * (upper.movement - state.hub_movement), rel=1e-9)
        assert -lower.preload + upper.preload == pytest.approx(bias, abs=1e-8)
        assert lower.movement == state.hub_movement != upper.movement


@pytest.mark.parametrize("ring_of", ["lower", "upper"])
def test_the_locating_bearing_takes_the_axial_load(spindle, ring_of):
    spring = sprung(replace(spindle, axial_load=2.0), ring_of)
    load = {b.name: b.preload for b in solve(spring, Condition(20.0), motions(spindle)).bearings}
    assert load[ring_of] == pytest.approx(16.0, rel=1e-9)
    assert load["lower" if ring_of == "upper" else "upper"] == pytest.approx(14.0 if ring_of == "upper" else 18.0, rel=1e-9)


@pytest.mark.parametrize(("load", "against"), [(10.0, None), (40.0, 24.0), (-40.0, None)])
def test_a_row_that_an_axial_load_turns_is_said_to_be_loaded_against_its_sense(spindle, load, against):
    """What a constant force does not hold the located row has to, backwards where the load is more."""
    spring = sprung(replace(spindle, axial_load=load), "upper")
    said = of_states(spring, [solve(spring, Condition(20.0), motions(spindle)).bearings])
    assert said == ([] if against is None else [s for s in said if s.startswith(f"the lower bearing is loaded against its sense, by {against:g} N: ")][:1])


def test_a_load_that_rows_never_bear_is_named(spindle):
    with pytest.raises(NoEquilibrium, match=r"no axial equilibrium .* under axial_load_N = 1e\+09"):
        solve(sprung(replace(spindle, axial_load=1e9), "upper"), Condition(20.0), motions(spindle))


def test_hub_movement_is_that_of_the_hub(spindle):
    """A soft spring: the hub follows the locating bearing alone, whatever the other's ring does."""
    state = solve(sprung(spindle), Condition(20.0), motions(spindle, upper={"outer_z": 1e-6}, lower={"outer_z": -0.4e-6}))
    assert state.hub_movement == pytest.approx(0.4e-6, rel=1e-4)  # the Hertz constant is that of the moved rings' angle
    assert state.bearing("upper").movement == pytest.approx(-1e-6, rel=1e-4)


def test_face_to_face_loads_the_other_way(spindle):
    """Outer rings moved apart axially load a back-to-back pair and unload a face-to-face one by as much."""
    apart = motions(spindle, upper={"outer_z": 0.3e-6}, lower={"outer_z": -0.3e-6})
    together = motions(spindle, upper={"outer_z": -0.3e-6}, lower={"outer_z": 0.3e-6})
    face = arranged(spindle, "face-to-face")
    loaded, unloaded = solve(spindle, Condition(20.0), apart), solve(face, Condition(20.0), apart)
    assert loaded.bearings[0].preload > 17
    assert unloaded.bearings[0].preload < 15
    assert solve(face, Condition(20.0), together).bearings[0].preload == pytest.approx(loaded.bearings[0].preload, rel=1e-9)


def test_tandem_shares_the_load(spindle):
    tandem = arranged(spindle, "tandem")
    state = solve(tandem, Condition(20.0), motions(spindle, upper={"outer_z": 0.1e-6}))
    lower, upper = state.bearings
    assert lower.preload + upper.preload == pytest.approx(32.0, rel=1e-9)
    assert upper.preload > lower.preload + 0.5


@pytest.mark.parametrize("arrangement", ["back-to-back", "face-to-face"])
def test_back_to_back_resists_tilting_more(spindle, arrangement):
    """Lever of the load lines about the middle: half span +- arm tan(angle) (Harris 1991, ch. 7), in the limit of stiff balls."""
    state = solve(arranged(spindle, arrangement), Condition(20.0), motions(spindle))
    middle = sum(b.z for b in state.bearings) / 2
    tilt = 0.0
    for b in state.bearings:
        lever = np.array([b.z - middle, 0, 0, 0, 1])  # x and tilt_y of the ring centre for a unit tilt about the middle
        tilt += float(lever @ b.stiffness @ lever)
    sign = 1 if arrangement == "back-to-back" else -1
    b = state.bearings[0]
    lever = (16.5e-3 - 5e-3) / 2 + sign * 4.55e-3 * np.tan(b.contact_angle)
    expected = 2 * 10 / 2 * b.ball_stiffness * (np.cos(b.contact_angle) * lever) ** 2
    geometric = 2 * 10 / 2 * b.contact_force / 102.7e-6 * (lever**2 + 0.02**2)  # bound of the F/A terms left out
    assert tilt == pytest.approx(expected, abs=geometric)


@pytest.mark.parametrize("arrangement", ["back-to-back", "face-to-face", "tandem"])
def test_the_state_holds_the_row_at_its_loaded_position(spindle, arrangement):
    """Its axial force on the outer ring has the sense in which that ring is loaded, and its stiffness is the force's derivative."""
    state = solve(arranged(spindle, arrangement), Condition(20.0), motions(spindle))
    for b, sense in zip(state.bearings, SENSE[arrangement], strict=True):
        assert respond(b.row).force[2] == pytest.approx(sense * 16.0, rel=1e-9)
        near = [respond(replace(b.row, axial=b.row.axial + d)).force[2] for d in (-1e-9, 1e-9)]
        assert b.axial_stiffness == pytest.approx((near[1] - near[0]) / 2e-9, rel=1e-5)
        assert np.sign(b.coupling_stiffness) == np.sign(respond(b.row).tangent[0, 4])


def test_the_preload_can_be_mounted_otherwise(spindle):
    """Another preload keeps the radial distance of the groove centres; the angle rises with the load."""
    more = scaled_preload(spindle, 20.0 / 16.0)
    state = solve(more, Condition(20.0), motions(spindle))
    row, old = state.bearings[0].row, solve(spindle, Condition(20.0), motions(spindle)).bearings[0].row
    assert state.bearings[0].preload == pytest.approx(20.0, rel=1e-9)
    assert row.radial == pytest.approx(old.radial, rel=1e-7)  # K is taken at the drawing's angle
    assert more.bearings[0].contact_angle > spindle.bearings[0].contact_angle


def test_soft_hot_steel_softens_the_contact(spindle):
    """K is proportional to E: with E(T) falling by 10 % at equal deformation the force falls by 10 %."""
    steel = replace(spindle.materials["steel"], youngs_modulus=Law((20.0, 60.0), (208e9, 187.2e9)))
    soft = replace(spindle, materials={**spindle.materials, "steel": steel})
    hot = motions(spindle, both={"temperature": 60.0})
    ratio = solve(soft, Condition(60.0), hot).bearings[0].preload / solve(spindle, Condition(60.0), hot).bearings[0].preload
    assert ratio == pytest.approx(0.9, rel=1e-9)


def test_ball_inertia_at_speed(spindle):
    """Balls with inertia press the outer race by their centrifugal force: closed form of the cage, at most percents here."""
    heavy = replace(spindle, ball_inertia=1.0)
    speed = 20000 * np.pi / 30
    state = solve(heavy, Condition(20.0, speed), motions(spindle))
    light = solve(spindle, Condition(20.0, speed), motions(spindle))
    b = state.bearings[0]
    assert b.outer_contact_angle < light.bearings[0].contact_angle < b.contact_angle
    assert state.bearings[0].preload == pytest.approx(state.bearings[1].preload, rel=1e-6)
    assert abs(b.radial_stiffness / light.bearings[0].radial_stiffness - 1) < 0.05
    assert solve(heavy, Condition(20.0, 0.0), motions(spindle)).bearings[0].stiffness == pytest.approx(light.bearings[0].stiffness)


@pytest.mark.parametrize("temperature", [20.0, 45.0])
def test_a_spring_behind_one_of_two_rows_is_in_balance_with_the_others(temperature):
    """Of rows that are loaded one way one alone on the spring: the shaft is in balance all the
    same, and not held by what the rows were drawn with."""
    whole = load(ROOT / "scenes" / "five_bearing")
    half = replace(whole, sets=tuple(replace(s, spring=PreloadSpring(("front1",))) if s.name == "front" else s for s in whole.sets))
    state = solve(half, Condition(temperature), expand(half, temperature))
    assert state.bearing("front1").preload == pytest.approx(half.set_of("front1").preload, rel=1e-9)
    assert sum(half.bearing(b.name).sense * b.preload for b in state.bearings) == pytest.approx(0.0, abs=1e-6)
