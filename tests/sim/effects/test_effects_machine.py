"""Effects that machine-tool spindles need, against closed forms or a second way to the same number."""

from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.effect_points import with_tool
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.beam import shear_factor, with_theory
from thermospindle.model.rotor.chain import matrices
from thermospindle.model.rotor.static import static
from thermospindle.model.scene.reading import load
from thermospindle.sim.effects import by_name
from thermospindle.sim.effects.effect import refusal
from thermospindle.sim.operating import operating_point


@pytest.fixture(scope="module")
def machine():
    return load(ROOT / "scenes" / "five_bearing")


@pytest.fixture(scope="module")
def free_shaft():
    return load(ROOT / "scenes" / "free_shaft")


def bending(spindle, *effects):
    """First bending frequency (Hz) of a free shaft."""
    return operating_point(spindle, Condition(20.0), [(by_name(n), {"scale": s}) for n, s in effects]).modes[0].frequency


@pytest.mark.parametrize(("name", "scale"), [("shear", 0.5), ("shear", 1.0), ("rotary_inertia", 0.5), ("rotary_inertia", 1.0)])
def test_thick_beams_bend_slower(free_shaft, name, scale):
    """To first order by Rayleigh's quotient of the free beam's first mode: integrals of its shape, doubled and its slope squared."""
    shaft = free_shaft.structure.shafts[0]
    length, radius, k = shaft.nodes[-1], shaft.segments[0].outer[0], 4.730040744862704
    x = np.linspace(0, 1, 4001)
    s = (np.cosh(k) - np.cos(k)) / (np.sinh(k) - np.sin(k))
    w = np.cosh(k * x) + np.cos(k * x) - s * (np.sinh(k * x) + np.sin(k * x))
    slope = k * (np.sinh(k * x) - np.sin(k * x) - s * (np.cosh(k * x) + np.cos(k * x)))
    third = k**3 * (np.sinh(k * x) + np.sin(k * x) - s * (np.cosh(k * x) - np.cos(k * x)))
    second = k**2 * (np.cosh(k * x) - np.cos(k * x) - s * (np.sinh(k * x) - np.sin(k * x)))
    gyration = (radius / 2 / length) ** 2
    if name == "shear":
        by_stiffness = 2 * (1 + 0.3) / shear_factor(0.0, 0.3) * np.trapezoid(third**2, x) / np.trapezoid(second**2, x)
        fall = -0.5 * gyration * by_stiffness
    else:
        fall = -0.5 * gyration * np.trapezoid(slope**2, x) / np.trapezoid(w**2, x)
    found = np.log(bending(free_shaft, (name, scale)) / bending(free_shaft))
    assert found == pytest.approx(scale * fall, rel=0.02)


def test_shear_and_rotary_inertia_make_a_timoshenko_beam(free_shaft):
    whole = with_theory(free_shaft.structure, free_shaft.materials, 20.0, (1.0, 1.0))
    assert bending(free_shaft, ("shear", 1.0), ("rotary_inertia", 1.0)) == pytest.approx(bending(replace(free_shaft, structure=whole)), rel=1e-9)


def test_housing_flexibility_is_a_spring_in_series(machine):
    """Of a row without coupling 1 / k_s = 1 / k + radial, and the same in the element with it, by its compliance matrix."""
    effect, condition = by_name("housing_flexibility"), Condition(20.0)
    before = operating_point(machine, condition).chain
    after = operating_point(machine, condition, [(effect, {"radial": 2.0, "tilt": 2.5})]).chain
    for a, b in zip(before.elements, after.elements, strict=True):
        if a.group != "bearings":
            assert (a.stiffness == b.stiffness).all()
            continue
        more = np.linalg.inv(b.stiffness) - np.linalg.inv(a.stiffness)
        assert more == pytest.approx(np.diag([2e-9, 2e-9, 0, 5e-6, 5e-6]), abs=1e-12)


def test_seat_clearance_takes_its_share_of_one_row(machine):
    effect, condition = by_name("seat_clearance"), Condition(20.0)
    before = operating_point(machine, condition).chain
    after = operating_point(machine, condition, [(effect, {"share": 0.4, "bearing": 3.0})]).chain
    pairs = [(a, b) for a, b in zip(before.elements, after.elements, strict=True) if (a.stiffness != b.stiffness).any()]
    changed = {a.name: b.stiffness[0, 0] / a.stiffness[0, 0] for a, b in pairs}
    assert changed == {"rear1": pytest.approx(0.6, rel=1e-12)}
    assert np.linalg.eigvalsh(matrices(after).stiffness).min() > 0


def test_tandem_sharing_loads_one_row_more(machine):
    """Loads move apart by rigidity times offset, and the set stays in balance."""
    effect, condition = by_name("tandem_sharing"), Condition(20.0)
    even = operating_point(machine, condition, []).state
    state = operating_point(machine, condition, [(effect, {"offset": 0.1})]).state
    first, second, third = (state.bearing(f"front{k}").preload for k in (1, 2, 3))
    assert first - second == pytest.approx(even.bearing("front1").axial_stiffness * 0.1e-6, rel=0.01)
    rear = state.bearing("rear1").preload - state.bearing("rear2").preload
    assert first + second - third + rear == pytest.approx(0.0, abs=1e-6)


def test_cooling_imbalance_parts_shaft_and_housing(machine):
    effect = by_name("cooling_imbalance")
    same = {g.name: 30.0 for g in machine.regions}
    half = Condition(30.0, machine.nominal_speed / 2)
    found = effect.temperatures(machine, half, {"difference": 8.0, "exponent": 2.0}, same)
    assert found["front shaft"] - found["front housing"] == pytest.approx(2.0, rel=1e-12)
    assert found["front shaft"] + found["front housing"] == pytest.approx(60.0, rel=1e-12)
    still = operating_point(machine, Condition(30.0), [(effect, {"difference": 8.0, "exponent": 2.0})]).state
    assert still.bearing("front1").preload == operating_point(machine, Condition(30.0), []).state.bearing("front1").preload


@pytest.mark.parametrize("name", ["shear", "rotary_inertia", "housing_flexibility", "seat_clearance", "tandem_sharing", "cooling_imbalance"])
def test_they_have_nothing_to_act_on_in_a_disk_drive(spindle, name):
    assert str(refusal(by_name(name), spindle)).startswith("nothing to act on here: ")


# ---------------------------------------------------------------- what holds a tool


def tip_compliance(spindle, condition, name, values):
    """m/N across at the tip of the tool, at a condition, with an effect."""
    point = operating_point(spindle, condition, [(by_name(name), values)])
    return 1 / static(point.spindle, point.chain, next(p for p in spindle.points if p.name == "tip")).stiffness


def holder(spindle):
    """Lateral and tilt stiffness of the taper, and its distance from the tip: all the force on the tip goes through it."""
    taper = next(j for j in spindle.structure.joints if j.role == "holder")
    return taper.stiffness[0], taper.stiffness[4], taper.z - next(p for p in spindle.points if p.name == "tip").position[2]


@pytest.mark.parametrize("share", [0.1, 0.4])
def test_taper_contact_gives_as_an_elastic_foundation(share):
    """Force and moment in the taper follow from statics: the tip's compliance grows by what the shorter contact gives to both."""
    tooled = with_tool()
    lateral, tilt, arm = holder(tooled)
    rest = Condition(20.0)
    grown = tip_compliance(tooled, rest, "taper_contact", {"share": share, "tilt_power": 3.0}) - tip_compliance(tooled, rest, "taper_contact", {"share": 0.0, "tilt_power": 3.0})
    left = 1 - share
    assert grown == pytest.approx((1 / left - 1) / lateral + (left**-3 - 1) * arm**2 / tilt, rel=1e-6)


@pytest.mark.parametrize("share_of_speed", [0.0, 1.0, 0.5])
def test_drawbar_force_goes_with_the_root_of_the_force(share_of_speed):
    tooled = with_tool()
    lateral, tilt, arm = holder(tooled)
    condition = Condition(20.0, share_of_speed * tooled.nominal_speed)
    loss, growth = 0.3, 0.5
    force = 1 - loss * (1 + growth * share_of_speed**2)
    grown = tip_compliance(tooled, condition, "drawbar_force", {"loss": loss, "growth": growth}) - tip_compliance(tooled, condition, "drawbar_force", {"loss": 0.0, "growth": growth})
    assert grown == pytest.approx((force**-0.5 - 1) * (1 / lateral + arm**2 / tilt), rel=1e-6)


@pytest.mark.parametrize("name", ["taper_contact", "drawbar_force"])
def test_without_a_holder_there_is_nothing_to_act_on(machine, name):
    assert refusal(by_name(name), machine) == "nothing to act on here: the scene has no joint with role 'holder'"
    assert refusal(by_name(name), with_tool()) is None


def test_a_disk_sits_once_on_the_end_that_is_hammered(machine):
    """On a shaft of many nodes it is one disk: the spindle is heavier by its mass, about the nose; the other end has none."""
    values = by_name("added_disk").neutral() | {"mass": 400.0, "height": 20.0}
    with_disk = operating_point(machine, Condition(20.0), [(by_name("added_disk"), values)]).spindle
    assert with_disk.turning_mass - machine.turning_mass == pytest.approx(0.4)
    nose = machine.structure.shafts[0].bodies[0]
    before, after = machine.structure.body(nose), with_disk.structure.body(nose)
    assert after.z == pytest.approx((before.mass * before.z - 0.4 * 0.020) / after.mass)
    assert [b for b in with_disk.structure.bodies if b.name != nose] == [b for b in machine.structure.bodies if b.name != nose]


def test_a_spindle_without_hub_expands_in_its_housing(machine):
    effect = by_name("expansion_mismatch")
    assert refusal(effect, machine) is None
    own = operating_point(machine, Condition(40.0), [(effect, effect.neutral() | {"hub_expansion": 0.1})]).spindle.materials
    assert own["cast iron"].thermal_expansion.value[0] == pytest.approx(1.1 * machine.materials["cast iron"].thermal_expansion.value[0])
    assert own["steel"] == machine.materials["steel"]


@pytest.mark.parametrize(
    ("name", "scene", "words"),
    [
        ("magnetic_pull", "five_bearing", "nothing to act on here: the scene has no motor"),
        ("added_disk", "free_shaft", "nothing to act on here: the scene has no turning body"),
        ("housing_flexibility", "free_shaft", "nothing to act on here: the scene has no body with role 'housing'"),
        ("housing_flexibility", "mk7702", None),  # a rigid housing, which the ground stands for
        ("seat_clearance", "mk7702", None),
        ("shear", "mk7702", "nothing to act on here: its flexible shafts shear already"),
        ("ball_inertia", "five_bearing", "nothing to act on here: its balls have all of their inertia already"),
        ("ball_inertia", "hdd_2003", None),
        ("ball_material", "five_bearing", None),
        ("ball_material", "templates/grinding", "nothing to act on here: its balls are ceramic already"),
        ("taper_contact", "five_bearing", "nothing to act on here: the scene has no joint with role 'holder'"),
        ("shaft_bending", "five_bearing", "nothing to act on here: its flexible shafts bend already"),
        ("shaft_bending", "mk7702", "nothing to act on here: its flexible shafts bend already"),
        ("thermometer_error", "mk7702", "nothing to act on here: nothing of this scene depends on temperature"),
        ("thermometer_error", "free_shaft", "nothing to act on here: nothing of this scene depends on temperature"),
        ("thermometer_error", "tailstock", None),
        ("sensor_gain", "free_shaft", None),
    ],
)
def test_an_effect_says_where_it_has_nothing_to_act_on(name, scene, words):
    file = ROOT / "scenes" / scene
    found = refusal(by_name(name), load(file if file.is_dir() else file.with_suffix(".toml")))
    assert found is None if words is None else words in found
