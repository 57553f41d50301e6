"""Effects act on parts by their role in the scene, and say where there is none; sizes follow the machine."""

import pickle
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from tests.conftest import ROOT, SCENE
from tests.mounting import turning_inside
from thermospindle.diagnosis.add import new_scene
from thermospindle.model.bearing.row import reference_motion
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.model.material import Law
from thermospindle.model.scene.reading import build, load
from thermospindle.sim.effects import CATALOGUE, by_name, usable
from thermospindle.sim.effects.effect import called, fitted_to, refusal
from thermospindle.sim.effects.known import equipped
from thermospindle.sim.effects.structure import mount_compliance
from thermospindle.sim.effects.temperature import soak_lag

ROLES = {  # effect -> what it needs
    "mount_compliance": "no joint with role 'mount'",
    "plate_prestress": "no joint with role 'plate'",
    "flange_fit_loosening": "no joint with role 'flange'",
    "support_anisotropy": "no joint with role 'flange' or 'plate'",
    "hub_flexibility": "no turning body with role 'hub'",
    "shaft_bending": "no region with role 'shaft'",
    "expansion_mismatch": "no region with role 'hub'",
    "loose_inserts": "no region with role 'hub'",
}


@pytest.fixture
def raw():
    return tomllib.loads((SCENE / "spindle.toml").read_text(encoding="utf-8"))


def without_roles(raw):
    for entry in (*raw["structure"]["bodies"], *raw["structure"]["joints"], *raw["section"]["regions"]):
        entry.pop("role", None)
    return raw


def test_the_reference_has_something_for_every_effect_of_its_kind(spindle):
    machine_tool = {"shear", "rotary_inertia", "housing_flexibility", "seat_clearance", "tandem_sharing", "cooling_imbalance", "taper_contact", "drawbar_force"}
    assert usable(spindle) == tuple(e for e in CATALOGUE if e.name not in machine_tool)


@pytest.mark.parametrize(("name", "why"), ROLES.items())
def test_without_roles_an_effect_says_so_and_changes_nothing(raw, name, why):
    bare, effect = build(without_roles(raw), SCENE / "spindle.toml"), by_name(name)
    assert why in refusal(effect, bare)
    assert refusal(effect, bare).startswith("nothing to act on here: the scene has")
    assert effect not in usable(bare)
    if effect.spindle:
        assert effect.spindle(bare, Condition(60.0), effect.typical()) in (bare, replace(bare))


def test_a_joint_is_what_its_role_says_not_its_name(raw):
    """A joint called mount that holds the shaft is a flange if it says so; one called otherwise is a mount."""
    joints = {j["name"]: j for j in raw["structure"]["joints"]}
    joints["mount"]["role"], joints["flange"]["role"] = "flange", "mount"
    turned = build(raw, SCENE / "spindle.toml")
    soft = mount_compliance.EFFECT.spindle(turned, Condition(60.0), {"compliance": 0.1, "thermal_share": 0.0})
    stiff = {j.name: (j.stiffness, k.stiffness) for j, k in zip(turned.structure.joints, soft.structure.joints, strict=True)}
    assert [name for name, (a, b) in stiff.items() if a != b] == ["flange"]


def test_a_free_turning_shaft_is_no_cantilever(spindle):
    held = [j for j in spindle.structure.joints if "shaft" not in j.bodies]
    free = replace(spindle, structure=replace(spindle.structure, joints=tuple(held)))
    assert "turns free between its bearings" in refusal(by_name("shaft_bending"), free)


def test_a_thermometer_matters_where_a_modulus_depends_on_temperature():
    """A free shaft of a steel that softens: nothing of it was said to depend on temperature."""
    shaft, effect = load(SCENE.parent / "free_shaft"), by_name("thermometer_error")
    assert "nothing of this scene depends on temperature" in refusal(effect, shaft)
    name = shaft.structure.shafts[0].segments[0].material
    steel = shaft.materials[name]
    softening = replace(steel, youngs_modulus=Law((0.0, 100.0), (steel.youngs_modulus(20.0), 0.95 * steel.youngs_modulus(20.0))))
    assert refusal(effect, replace(shaft, materials={**shaft.materials, name: softening})) is None


def test_a_spring_leaves_nothing_to_constant_force(raw):
    raw["bearing_pair"]["preload_kind"] = "spring"
    sprung = build(raw, SCENE / "spindle.toml")
    assert refusal(by_name("constant_force_preload"), sprung) == "nothing to act on here: the scene's preload is by a spring already"


def test_add_refuses_what_has_nothing_to_act_on(tmp_path, raw):
    (tmp_path / "old").mkdir()
    text = (SCENE / "spindle.toml").read_text(encoding="utf-8").replace('role = "mount"\n', "")
    (tmp_path / "old" / "spindle.toml").write_text(text, encoding="utf-8")
    (tmp_path / "new").mkdir()
    with pytest.raises(BadInput, match=r"spindle.toml: effect mount_compliance: nothing to act on here: .* role 'mount'"):
        new_scene(tmp_path / "old", ["mount_compliance"], [], None, tmp_path / "new", Path("new"))


def test_sizes_follow_the_machine(spindle):
    """Half the mass of a hub of 8 times the mass is not a gram; on the reference every effect is itself."""
    for effect in CATALOGUE:
        assert fitted_to(effect, spindle) is effect
    body = spindle.turning
    heavy = replace(body, mass=8 * body.mass, inertia=tuple(32 * i for i in body.inertia))
    bodies = tuple(heavy if b is body else b for b in spindle.structure.bodies)
    large = replace(spindle, structure=replace(spindle.structure, bodies=bodies), nominal_speed=spindle.nominal_speed / 2)
    sensor, disk, unbalance = (fitted_to(by_name(n), large).parameters for n in ("sensor_mass", "added_disk", "unbalance"))
    assert (sensor[0].typical, sensor[0].prior_sd, sensor[0].limits) == (2.8, 1.7, (0.0, 280.0))  # by the root: sensors are chosen to suit
    assert (disk[0].typical, disk[0].prior_sd, disk[0].limits) == (8.0, 5.6, (0.0, 4000.0))
    assert (disk[1].neutral, disk[1].typical, disk[1].prior_sd, disk[1].limits) == (25.0, 25.0, 10.0, (0.0, 200.0))
    assert unbalance[0].typical == 8.0
    again = fitted_to(fitted_to(by_name("sensor_mass"), large), large)
    assert again.parameters == sensor
    assert pickle.loads(pickle.dumps(again)).parameters == sensor
    assert equipped(large)[1][0] is CATALOGUE[0]


def test_a_choice_for_every_bearing(spindle):
    third = replace(spindle.bearings[1], name="third", z=0.030)
    three = replace(spindle, bearings=(*spindle.bearings, third))
    rows = {p.name: p for p in fitted_to(by_name("cage_unbalance"), three).parameters}
    assert [called(rows["bearing"], k, three) for k in (-1.0, 2.0)] == ["all", three.bearings[2].name]
    assert rows["bearing"].choices == (0.0, 1.0, 2.0)
    assert rows["bearing"].limits == (0.0, 2.0)


@pytest.mark.parametrize("turning", ["inner", "outer"])
def test_the_turning_rings_groove_lags(spindle, turning):
    """T_turning groove = (T_ball + T_rotating) / 2, whichever ring turns."""
    s = turning_inside(spindle) if turning == "inner" else spindle
    still = {b.name: reference_motion(50.0) for b in s.bearings}
    values = soak_lag.EFFECT.neutral() | {"hub_share": 0.25}
    moved = soak_lag.motions(s, Condition(60.0), values, still)["lower"]
    other = "outer" if turning == "inner" else "inner"
    assert getattr(moved, f"{turning}_strain") == pytest.approx(0.5 * 0.25 * 40 * 11.5e-6)
    assert getattr(moved, f"{other}_strain") == 0.0


def test_misaligned_rings_are_told_by_the_names_of_the_scenes_bearings(spindle):
    """The highest row is tilted by `tilt`, all below it by a share of that."""
    five = load(ROOT / "scenes" / "five_bearing")
    said = {p.name: p.meaning for p in fitted_to(by_name("bearing_misalignment"), five).parameters}
    assert said["tilt"].startswith("tilt of the rear2 bearing's non-turning ring")
    assert said["lower_share"] == "tilt of the rings of the front1, front2, front3 and rear1 bearings, of all alike, about the same axis, over that of the rear2's"
    assert not any(word in text.split() for text in said.values() for word in ("lower", "upper", "upper's"))
    assert fitted_to(by_name("bearing_misalignment"), spindle).parameters == by_name("bearing_misalignment").parameters
    one = replace(spindle, bearings=spindle.bearings[1:])
    assert [p.meaning for p in fitted_to(by_name("bearing_misalignment"), one).parameters][-1] == "nothing here: the scene has one ball row alone"
