"""Which of several turning parts an unbalance or a radial load acts on: told by the scene or by its drawing, never by the mesh.

A shaft from 0 to 400 mm, a sleeve about it from 100 to 300 mm that turns against it at half its
speed, and a disc given by its mass at 350 mm.
"""

from dataclasses import replace

import numpy as np
import pytest

from thermospindle.cli import main
from thermospindle.model.built.drawn import drawn
from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.carrier import permissible_unbalance, unbalance_carrier
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition, RadialLoad, Spindle
from thermospindle.model.rotor.loaded import motion
from thermospindle.model.scene.reading import content_hash, load
from thermospindle.model.units import RPM
from thermospindle.sim.effects import by_name
from thermospindle.sim.operating import operating_point
from thermospindle.sim.resonance.critical import criticals
from thermospindle.sim.running.excitation import harmonics, response
from thermospindle.sim.running.moving_balls import _unbalance_forces

SPEED = 6000 * RPM
TEXT = """
format = 2
title = "sleeve about a shaft"
reference_temperature_C = 20.0
nominal_speed_rpm = 6000.0
{load}
materials.steel = {{ origin = "assumed", source = "test", youngs_modulus_GPa = 208.0, poisson_ratio = 0.3, thermal_expansion_um_per_m_K = 11.5, density_kg_per_m3 = 7850.0, conductivity_W_per_m_K = 46.0, heat_capacity_J_per_kg_K = 460.0 }}
[[shafts]]
origin = "assumed"
source = "test"
name = "shaft"
material = "steel"
turns = true
outer_mm = [[30, 400]]
longest_element_mm = {element}
damping_ratio = 0.005
[[shafts]]
origin = "assumed"
source = "test"
name = "sleeve"
material = "steel"
turns = true
speed_ratio = -0.5
start_z_mm = 100.0
outer_mm = [[80, 200]]
bore_mm = [[60, 200]]
longest_element_mm = 35.0
damping_ratio = 0.005
[bearings]
front = {{ origin = "assumed", source = "test", z_mm = 0.0, numbers = {{ radial_stiffness_N_per_um = 40.0, axial_stiffness_N_per_um = 20.0, damping_ratio = 0.05 }} }}
rear = {{ origin = "assumed", source = "test", z_mm = 400.0, numbers = {{ radial_stiffness_N_per_um = 40.0, damping_ratio = 0.05 }} }}
low = {{ origin = "assumed", source = "test", z_mm = 110.0, inner_body = "sleeve", numbers = {{ radial_stiffness_N_per_um = 30.0, axial_stiffness_N_per_um = 30.0, damping_ratio = 0.05 }} }}
high = {{ origin = "assumed", source = "test", z_mm = 290.0, inner_body = "sleeve", numbers = {{ radial_stiffness_N_per_um = 30.0, damping_ratio = 0.05 }} }}
[structure]
origin = "assumed"
source = "test"
inner_body = "shaft"
outer_body = "ground"
damping_frequency_Hz = 300.0
bodies = [{{ name = "disc", mass_kg = 2.0, tilt_inertia_kg_m2 = [2e-3, 2e-3], polar_inertia_kg_m2 = 4e-3, z_mm = 350.0, moves = ["x", "y", "z", "tilt_x", "tilt_y"], turns = true }}]
joints = [{{ name = "seat", group = "disc", between = ["shaft", "disc"], z_mm = 350.0, axial_stiffness_N_per_m = 5e8, lateral_stiffness_N_per_m = [5e8, 5e8], tilt_stiffness_N_m_per_rad = [2e5, 2e5], damping_ratio = 0.01 }}]
[measuring]
origin = "assumed"
source = "test"
points = [{{ node = 1, name = "shaft", body = "shaft", position_mm = [15.0, 0.0, 0.0], direction = "+X" }}, {{ node = 2, name = "sleeve", body = "sleeve", position_mm = [40.0, 0.0, 100.0], direction = "+X" }}]
[hammer_test]
origin = "assumed"
source = "test"
sample_rate_Hz = 6000.0
band_Hz = [50.0, 2000.0]
[imperfections]
origin = "assumed"
source = "test"
unbalance_g_mm = {unbalance}
unbalance_z_mm = {z}
{part}
"""


@pytest.fixture
def made(tmp_path):
    def scene(z: float, part: str = "", element: float = 10.0, unbalance: float = 5.0, load_keys: str = "") -> Spindle:
        told = f'unbalance_body = "{part}"' if part else ""
        text = TEXT.format(z=z, part=told, element=element, unbalance=unbalance, load=load_keys)
        (tmp_path / "spindle.toml").write_text(text, encoding="utf-8")
        return load(tmp_path)

    return scene


def moved(spindle: Spindle) -> tuple[float, float]:
    """Frequency (Hz) of the one line, and how far (m) the first measuring point moves in it."""
    point = operating_point(spindle, Condition(20.0, SPEED))
    forces = harmonics(point)
    assert len(forces.line) == 1
    return float(forces.frequency[0]), float(np.abs(response(point, forces)[0] @ point.measurement.response_rows[0]))


@pytest.mark.parametrize("element", [10.0, 40.0])
@pytest.mark.parametrize(("part", "frequency"), [("shaft", 100.0), ("sleeve", 50.0), ("disc", 100.0)])
def test_the_part_that_is_named_carries_the_unbalance(made, part, frequency, element):
    spindle = made(220.0, part, element)
    found = unbalance_carrier(spindle, spindle.imperfections)
    assert spindle.structure.carrier(found.name) == part
    assert moved(spindle)[0] == pytest.approx(frequency)


@pytest.mark.parametrize("part", ["shaft", "sleeve"])
def test_a_finer_mesh_moves_the_answer_by_its_error_alone(made, part):
    (_, fine), (_, coarse) = (moved(made(220.0, part, element)) for element in (10.0, 40.0))
    assert coarse == pytest.approx(fine, rel=2e-3)


@pytest.mark.parametrize("element", [10.0, 40.0])
@pytest.mark.parametrize("z", [101.0, 220.0, 299.0])
def test_where_several_turn_a_scene_must_say_which(made, z, element):
    with pytest.raises(BadInput) as refused:
        made(z, "", element)
    said = str(refused.value)
    assert f"spindle.toml: imperfections.unbalance_z_mm = {z:g}: shaft and sleeve turn there" in said
    assert said.endswith("imperfections.unbalance_body must name the one it acts on: allowed are shaft, sleeve")


@pytest.mark.parametrize("element", [10.0, 40.0, 200.0])
@pytest.mark.parametrize(
    ("z", "part"),
    [
        (50.0, "shaft"),  # 50 mm from the sleeve's first node, and with long elements further from the shaft's own
        (95.0, "shaft"),
        (310.0, "shaft"),
        (350.0, "disc"),  # whose centre is there
        (352.0, "shaft"),  # where the disc, of no length, is not
        (450.0, "shaft"),  # beyond all of them, nearest
    ],
)
def test_one_part_at_a_height_needs_no_name(made, z, part, element):
    spindle = made(z, "", element)
    assert spindle.structure.carrier(unbalance_carrier(spindle, spindle.imperfections).name) == part


@pytest.mark.parametrize(
    ("part", "z", "why"),
    [
        ("sleeves", 220.0, "imperfections.unbalance_body = 'sleeves': names nothing that turns; did you mean sleeve?"),
        ("ground", 220.0, "imperfections.unbalance_body = 'ground': names nothing that turns; allowed are disc, shaft, sleeve"),
        ("sleeve", 320.0, "imperfections.unbalance_z_mm = 320: beyond the shaft 'sleeve', which spans 100 to 300"),
    ],
)
def test_a_name_that_cannot_be_meant_is_refused(made, part, z, why):
    with pytest.raises(BadInput, match=why.replace("?", r"\?")):
        made(z, part)


def test_nothing_is_asked_where_nothing_acts(made):
    made(220.0, unbalance=0.0)
    with pytest.raises(BadInput, match=r"imperfections.unbalance_body = 'sleeves'"):
        made(220.0, "sleeves", unbalance=0.0)


LOADED = "radial_load_N = [300.0, 0.0]\nradial_load_z_mm = 220.0\n"


@pytest.mark.parametrize("element", [10.0, 40.0])
def test_a_radial_load_bends_the_part_that_is_named(made, element):
    """The other does not feel it: no bearing lies between them."""
    with pytest.raises(BadInput, match=r"toml: radial_load_z_mm = 220: shaft and sleeve turn there; radial_load_body must name .* allowed are shaft, sleeve"):
        made(0.0, element=element, load_keys=LOADED)
    for part, other in (("shaft", "sleeve"), ("sleeve", "shaft")):
        spindle = made(0.0, element=element, load_keys=f'{LOADED}radial_load_body = "{part}"\n')
        chain, u = motion(spindle, operating_point(spindle, Condition(20.0)).state)
        across = {spindle.structure.carrier(body): 0.0 for body, _ in chain.dofs}
        for (body, move), value in zip(chain.dofs, u, strict=True):
            if move == "x":
                across[spindle.structure.carrier(body)] = max(across[spindle.structure.carrier(body)], abs(value))
        assert across[part] > 1e-6
        assert across[other] < 1e-9 * across[part]


def test_a_drawn_unbalance_keeps_the_part_it_was_drawn_on(made):
    spindle = made(0.0)
    own = drawn(spindle, 3)
    assert spindle.structure.carrier(unbalance_carrier(spindle, own).name) == spindle.structure.carrier(spindle.turning.name)


def test_the_effect_adds_to_what_turns_as_the_scenes_unbalance_does(made):
    """On the sleeve, at half the speed, it makes that line twice as large, and none of the shaft's."""
    effect = by_name("unbalance")
    spindle = made(220.0, "sleeve")
    point = operating_point(spindle, Condition(20.0, SPEED), [(effect, effect.neutral() | {"amount": 5.0})])
    [line] = harmonics(point).line
    assert line.frequency == pytest.approx(50.0)
    assert point.imperfections.unbalance == pytest.approx(1e-5)


def test_balls_that_move_feel_an_unbalance_at_its_own_speed(made):
    spindle = made(220.0, "sleeve")
    point = operating_point(spindle, Condition(20.0, SPEED))
    time = np.linspace(0.0, 0.1, 7)
    [force] = harmonics(point).force
    exact = (force * np.exp(2j * np.pi * 50.0 * time)[:, None]).real
    assert _unbalance_forces(point, spindle.imperfections, {}, time) == pytest.approx(exact, abs=1e-9 * np.abs(force).max())


def test_a_name_counts_in_a_scenes_hash_and_none_does_not(made):
    plain = made(50.0)
    own = plain.imperfections
    assert content_hash(replace(plain, imperfections=replace(own, unbalance_body="shaft"))) != content_hash(plain)
    load = RadialLoad((1.0, 0.0), 0.05)
    by_height, by_name = (replace(plain, radial_loads=(replace(load, body=body),)) for body in ("", "shaft"))
    assert len({content_hash(s) for s in (plain, by_height, by_name, replace(plain, gravity=(0.0, -9.81)))}) == 4


def test_check_tells_which_part_it_took(made, capsys):
    spindle = made(350.0, load_keys=f'{LOADED}radial_load_body = "sleeve"\n')
    assert main(["check", str(spindle.file)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "The unbalance is on disc." in said
    # the sleeve's own bearings at 110 and 290 mm bear 300 N by the lever rule, those of the shaft nothing
    assert "at z = 220 mm on sleeve, borne by front +0, +0; low +117, +0; high +183, +0; rear +0, +0 N; front, low, high and rear, given by numbers, are as stiff under any load." in said


def test_without_a_scene_the_sentence_is_the_same(made):
    spindle = replace(made(0.0), imperfections=Imperfections(unbalance=1e-6, unbalance_z=0.22))
    with pytest.raises(BadInput, match="unbalance_body must name the one it acts on: allowed are shaft, sleeve"):
        harmonics(operating_point(spindle, Condition(20.0, SPEED)))


def test_each_part_drives_the_modes_at_its_own_speed_that_whirl_with_it(made):
    """The sleeve turns backwards at half the speed: of a pair of its modes it drives the one that goes backward with the spindle."""
    spindle = made(50.0)
    turning = operating_point(spindle, Condition(20.0, SPEED))
    assert criticals(operating_point(spindle, Condition(20.0)), 0.5) == []
    pair = [m for m in turning.modes if m.kind != "axial" and m.energy["low"] + m.energy["high"] > 0.9][:2]
    assert {m.whirl for m in pair} == {"forward", "backward"}
    backward = next(m for m in pair if m.whirl == "backward")
    at = Condition(20.0, 4 * np.pi * backward.frequency)
    point = operating_point(spindle, at)
    found = [c for c in criticals(point, 0.1) if c.parts == ("sleeve",)]
    assert found
    assert {c.mode.whirl for c in found} == {"backward"}
    assert all(c.sense > 0.99 and not c.of_scene and c.speed == pytest.approx(-at.speed / 2) for c in found)


def test_a_balance_grade_goes_by_a_parts_own_speed(made):
    """Of a shaft and disc geared to twice the spindle's speed, beside a sleeve at half of it: e = G / (2 speed), m what turns with them."""
    spindle = made(0.0)
    structure = spindle.structure
    fast = replace(structure, bodies=tuple(replace(b, speed_ratio=2.0) if b.speed_ratio == 1.0 else b for b in structure.bodies))
    geared = replace(spindle, structure=fast)
    body = geared.turning
    assert body.speed_ratio == 2.0
    mass = sum(b.mass for b in geared.structure.bodies if b.speed_ratio == 2.0)
    assert mass < 0.9 * geared.turning_mass
    assert permissible_unbalance(geared, body, 2.5e-3) == pytest.approx(mass * 2.5e-3 / (2 * SPEED), rel=1e-12)
    sleeve = next(b for b in structure.bodies if b.speed_ratio == -0.5)
    assert permissible_unbalance(geared, sleeve, 2.5e-3) == pytest.approx((geared.turning_mass - mass) * 2.5e-3 / (0.5 * SPEED), rel=1e-12)
    assert drawn(geared, 3).unbalance == pytest.approx(drawn(spindle, 3).unbalance / 2, rel=1e-12)
    sizes = [by_name("unbalance").sized(s)["amount"] for s in (spindle, geared)]
    assert sizes[1] == pytest.approx(sizes[0] / 2, rel=1e-12)
