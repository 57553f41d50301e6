"""Scene files: what is read, and what is refused in one sentence that names file, key, value and what is allowed."""

import copy
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import ROOT
from thermospindle.model.errors import BadInput, OutsideRange
from thermospindle.model.material import Law
from thermospindle.model.rotor.section import cells, mass_properties
from thermospindle.model.scene.checks import implied_clearance
from thermospindle.model.scene.reading import build, content_hash, load
from thermospindle.model.span import inside, temperature_range

FILE = Path(__file__).parents[2] / "scenes" / "hdd_2003" / "spindle.toml"


@pytest.fixture
def raw():
    return tomllib.loads(FILE.read_text(encoding="utf-8"))


def named(entries, name):
    return next(e for e in entries if e["name"] == name)


def region(raw, name):
    return named(raw["section"]["regions"], name)


def by_numbers(raw, tilt, polar):
    hub = named(raw["structure"]["bodies"], "hub")
    hub.pop("regions")
    hub.update(mass_kg=0.026, z_mm=10.0, tilt_inertia_kg_m2=[tilt, tilt], origin="assumed")
    if polar is not None:
        hub.update(polar_inertia_kg_m2=polar)


def one_tube_too_wide(raw):
    region(raw, "lower outer ring").update(z_mm=[3.5, 18.0])
    raw["section"]["regions"] = [g for g in raw["section"]["regions"] if g["name"] not in ("upper outer ring",)]
    named(raw["structure"]["bodies"], "hub")["regions"].remove("upper outer ring")
    for c in raw["thermal"]["convection"]:
        c["regions"] = [n for n in c["regions"] if n != "upper outer ring"]
    for b in raw["bearings"].values():
        b.update(outer_ring="lower outer ring", raceway_width_mm=12.0)


def one_tube_too_close(raw):
    one_tube_too_wide(raw)
    for b in raw["bearings"].values():
        b.pop("raceway_width_mm")
    for key in ("inner_ring", "outer_ring"):
        raw["bearings"]["upper"][key] = raw["bearings"]["lower"][key]
    region(raw, "lower inner ring").update(z_mm=[3.5, 6.5])
    raw["bearings"]["upper"]["z_mm"] = 6.0


def collar(raw, r_mm, z_mm=(15.0, 18.0)):
    """A region more at the upper inner ring."""
    raw["section"]["regions"].append(region(raw, "upper inner ring") | {"name": "collar", "r_mm": r_mm, "z_mm": list(z_mm)})


REFUSED = [
    ("poisson", lambda r: r["materials"]["steel"].update(poisson_ratio=0.6), "materials.steel.poisson_ratio = 0.6", "less than or equal to 0.49"),
    ("misspelt", lambda r: r["materials"]["steel"].update(density=1.0), "materials.steel.density: unknown key", "density_kg_per_m3"),
    ("missing", lambda r: r["materials"]["steel"].pop("poisson_ratio"), "materials.steel.poisson_ratio: missing", "no default"),
    ("quoted", lambda r: r["bearing_pair"].update(preload_N="16"), "bearing_pair.preload_N = '16'", "valid number, without quotes"),
    ("true", lambda r: r["bearing_pair"].update(preload_N=True), "bearing_pair.preload_N = true", "valid number"),
    ("one-of-two", lambda r: named(r["structure"]["bodies"], "seat").update(tilt_inertia_kg_m2=1e-4), "tilt_inertia_kg_m2 = 0.0001", "list in brackets, as [1.0, 2.0]"),
    ("ring", lambda r: r["bearings"]["lower"].update(inner_ring="lower inner rng"), "'lower inner rng'", "did you mean lower inner ring?"),
    ("quoted-count", lambda r: r["ball_rows"]["hdd"].update(balls="10"), "ball_rows.hdd.balls = '10'", "valid integer"),
    ("quoted-law", lambda r: r["materials"]["steel"].update(youngs_modulus_GPa="208"), "steel.youngs_modulus_GPa = '208'", "valid number"),
    ("law-below-nothing", lambda r: r["materials"]["steel"].update(youngs_modulus_GPa=-208.0), "steel.youngs_modulus_GPa = -208.0", "greater than 0"),
    (
        "law-of-two",
        lambda r: r["materials"]["steel"].update(youngs_modulus_GPa={"temperature_C": [20.0, 60.0], "value": [208.0, -1.0]}),
        "steel.youngs_modulus_GPa.value.2 = -1.0",
        "greater than 0",
    ),
    ("no-polar", lambda r: by_numbers(r, 2e-6, None), "structure.bodies.hub", "needs polar_inertia_kg_m2"),
    ("impossible-polar", lambda r: by_numbers(r, 2e-6, 5e-6), "structure.bodies.hub: no body has", "at most the sum of the others"),
    ("impossible-tilt", lambda r: named(r["structure"]["bodies"], "seat").update(polar_inertia_kg_m2=1e-4), "seat", "at most the sum"),
    (
        "joint-material",
        lambda r: named(r["structure"]["joints"], "mount").update(material="brass"),
        "mount.material = 'brass'",
        "allowed are",
    ),
    ("role", lambda r: named(r["structure"]["joints"], "mount").update(role="foot"), "mount.role = 'foot'", "mount"),
    ("two-angles", lambda r: r["ball_rows"]["hdd"].update(free_contact_angle_deg=15.0), "ball_rows.hdd", "either contact_angle_deg"),
    ("no-angle", lambda r: r["ball_rows"]["hdd"].pop("contact_angle_deg"), "ball_rows.hdd", "either contact_angle_deg"),
    ("rate-of-no-spring", lambda r: r["bearing_pair"].update(preload_rate_N_per_m=1e5), "bearing_pair", "preload_rate_N_per_m is for"),
    (
        "no-such-sprung",
        lambda r: r["bearing_pair"].update(preload_kind="spring", sprung_bearing="x"),
        "sprung_bearing = 'x'",
        "lower, upper",
    ),
    ("raceways", one_tube_too_wide, "bearings.upper.raceway_width_mm = 12: the raceways of 'lower' and 'upper'", "leave them apart"),
    ("rows-too-close", one_tube_too_close, "bearings.upper.z_mm = 6: the raceways of 'lower' and 'upper' on 'lower inner ring'", "rows a ball apart"),
    ("step", lambda r: r["hammer_test"].update(sample_rate_Hz=25600.0), "step_us = ", "without it the program chooses"),
    ("type", lambda r: r["tolerances"].update(gain="big"), "tolerances.gain = 'big'", "number"),
    ("infinite", lambda r: r["tolerances"].update(gain=float("inf")), "tolerances.gain = inf", "finite"),
    ("nan", lambda r: r.update(nominal_speed_rpm=float("nan")), "nominal_speed_rpm = nan", "should be a finite number"),
    ("no-origin", lambda r: r["tolerances"].pop("origin"), "tolerances.structure = 0.015", "origin = printed, assumed or calibrated"),
    ("law", lambda r: r["materials"]["steel"].update(youngs_modulus_GPa={"temperature_C": [60, 20], "value": [1, 2]}), "GPa", "must rise"),
    ("material", lambda r: region(r, "sleeve").update(material="brass"), "section.regions.sleeve.material = 'brass'", "allowed are"),
    ("floating", lambda r: region(r, "upper inner ring").update(z_mm=[19.5, 22.0]), "upper inner ring", "floats"),
    ("ring-off-shaft", lambda r: region(r, "lower inner ring").update(r_mm=[2.6, 3.752]), "r_mm = [2.6, 3.752]", "floats"),
    ("parts-collide", lambda r: region(r, "sleeve").update(r_mm=[3.0, 7.5]), "section.regions.sleeve", "parts may not share space"),
    ("materials-collide", lambda r: region(r, "magnet ring").update(r_mm=[13, 15]), "magnet ring", "only regions of one material"),
    ("covered", lambda r: collar(r, [2.5, 3.752]), "bearings.upper.inner_ring", "covers the earlier"),
    ("half-covered", lambda r: collar(r, [2.5, 3.752], [16.5, 18.0]), "all but 1.5 mm of its raceway", "covers the earlier"),
    ("buried", lambda r: collar(r, [3.752, 3.8]), "all but 0 mm of its raceway at r_mm = 3.752", "a free face of its ring"),
    ("empty-span", lambda r: region(r, "shaft").update(z_mm=[3.0, 3.0]), "section.regions.shaft.z_mm = [3.0, 3.0]", "smaller"),
    ("bearing-outside", lambda r: r["bearings"]["upper"].update(z_mm=12.0), "bearings.upper.z_mm = 12", "outside its ring"),
    ("ring-name", lambda r: r["bearings"]["upper"].update(inner_ring="x"), "bearings.upper.inner_ring = 'x'", "no section region"),
    ("row-name", lambda r: r["bearings"]["upper"].update(row="x"), "bearings.upper.row = 'x'", "allowed are hdd"),
    ("pitch", lambda r: r["ball_rows"]["hdd"].update(pitch_diameter_mm=12.0), "pitch_diameter_mm = 12", "between the raceways"),
    ("ball-size", lambda r: r["ball_rows"]["hdd"].update(ball_diameter_mm=1.7), "ball_diameter_mm = 1.7", "-2 % to +5 %"),
    ("too-many-balls", lambda r: r["ball_rows"]["hdd"].update(balls=40), "ball_rows.hdd: balls = 40: so many of ball_diameter_mm = 1.588 do not fit", "at most 18 do"),
    ("balls-too-large", lambda r: r["ball_rows"]["hdd"].update(ball_diameter_mm=50.0), "so many of ball_diameter_mm = 50 do not fit on the pitch circle of pitch_diameter_mm = 9.1", "10 of them are 2.859 mm at most"),
    ("clearance", lambda r: r["ball_rows"]["hdd"].update(contact_angle_deg=30.0), "contact_angle_deg = 30", "contradicts"),
    ("turning-ring", lambda r: r["bearing_pair"].update(turning_ring="inner"), "turning_ring = 'inner'", "rotating part"),
    ("tandem", lambda r: r["bearing_pair"].update(arrangement="tandem"), "bearing_pair", "preload_kind must be spring"),
    ("joint-end", lambda r: named(r["structure"]["joints"], "mount").update(between=["ground", "bas"]), "'bas' is no body", "allowed are"),
    ("oil-thin", lambda r: r["thermal"]["friction"].update(kinematic_viscosity_mm2_per_s=0.2), "kinematic_viscosity_mm2_per_s: 0.2 mm2/s", "allows 0.35 and more"),
    ("joint-twice", lambda r: named(r["structure"]["joints"], "mount").update(between=["base", "base"]), "structure.joints.mount.between: 'base' stands twice", "two bodies"),
    ("body-twice", lambda r: named(r["structure"]["bodies"], "seat").update(name="base"), "'base' is taken", "must differ"),
    (
        "no-inertia",
        lambda r: named(r["structure"]["bodies"], "seat").pop("tilt_inertia_kg_m2"),
        "structure.bodies.seat",
        "needs tilt_inertia",
    ),
    ("two-turn", lambda r: named(r["structure"]["bodies"], "shaft").update(turns=True), "structure.bodies", "exactly the body 'hub'"),
    ("direction", lambda r: r["measuring"]["points"][0].update(direction="up"), "measuring.points.1.direction = 'up'", "+X -X"),
    ("long-name", lambda r: r["measuring"]["points"][0].update(name="a name too long"), "measuring.points.1.name", "at most 10"),
    ("hammer-twice", lambda r: r["hammer_test"].update(hammer_nodes=[1, 1]), "hammer_test.hammer_nodes = [1, 1]: 1 stands twice", "each may stand once"),
    ("move-twice", lambda r: named(r["structure"]["bodies"], "seat").update(moves=["x", "x"]), "moves = ['x', 'x']: 'x' stands twice", "each may stand once"),
    ("load-too-large", lambda r: r.update(axial_load_N=1e9) or r["hammer_test"].pop("step_us", None), "under axial_load_N = 1e+09", "allowed is what they bear"),
    ("node-twice", lambda r: r["measuring"]["points"][0].update(node=2), "node = 2 stands twice", "must differ"),
    ("hammer-node", lambda r: r["hammer_test"].update(hammer_nodes=[9]), "hammer_test.hammer_nodes: 9", "allowed are"),
    ("from-0-Hz", lambda r: r["hammer_test"].update(band_Hz=[0.0, 6000.0]), "hammer_test", "above 0 Hz"),
    ("sampling", lambda r: r["hammer_test"].update(sample_rate_Hz=5000.0), "hammer_test", "2.5 times"),
    ("heat", lambda r: r["thermal"]["gaps"][0].update(regions=["shaft", "hub"]), "thermal.gaps: 'hub'", "did you mean hub body?"),
    ("in-another-table", lambda r: r["materials"]["steel"].update(reference_temperature_K=293.0), "materials.steel.reference_temperature_K: unknown key", "; reference_temperature_C stands at the top of the file"),
    ("in-another-list", lambda r: r["structure"].update(direction="+X"), "structure.direction: unknown key", "; direction stands in [[measuring.points]]"),
    ("unknown-table", lambda r: r.update(extra={}), "extra: unknown key", "materials"),
]


@pytest.mark.parametrize(("key", "alike", "unlike"), [("lateral_stiffness_N_per_m", "[5.0e8, 5.0e8]", "[5.0e8, 1.0e7]"), ("tilt_stiffness_N_m_per_rad", "[2.0e5, 2.0e5]", "[2.0e5, 2.0e4]")])
def test_a_joint_that_turns_is_alike_in_all_directions(tmp_path, key, alike, unlike):
    """A disc on its shaft; whose seat may be what it likes where neither turns."""
    text = (ROOT / "scenes" / "templates" / "rotor.toml").read_text(encoding="utf-8")
    file = tmp_path / "spindle.toml"
    assert re.search(rf"{key} = {re.escape(alike)}", text)
    file.write_text(text.replace(f"{key} = {alike}", f"{key} = {unlike}"), encoding="utf-8")
    with pytest.raises(BadInput, match=rf"structure.joints.disc seat.{key} = .*: a joint of two turning parts .*; allowed are two values alike"):
        load(file)


@pytest.mark.parametrize(("spoil", "key", "allowed"), [r[1:] for r in REFUSED], ids=[r[0] for r in REFUSED])
def test_refused(raw, spoil, key, allowed):
    build(copy.deepcopy(raw), FILE)
    spoil(raw)
    with pytest.raises(BadInput) as error:
        build(raw, FILE)
    message = str(error.value)
    assert message.startswith(str(FILE))
    assert key in message
    assert allowed in message
    assert "\n" not in message


def test_a_file_that_is_not_there_or_not_toml(tmp_path):
    with pytest.raises(BadInput, match="no scene there"):
        load(tmp_path)
    (tmp_path / "spindle.toml").mkdir()
    for text in ("", "# all of it is comment\n"):
        (tmp_path / "empty.toml").write_text(text, encoding="utf-8")
        with pytest.raises(BadInput, match=r"empty\.toml: has no keys: it is empty, or all of it is comment"):
            load(tmp_path / "empty.toml")
    with pytest.raises(BadInput, match=r"spindle\.toml: is a folder; a scene's file is expected there$"):  # it was asked whether the same folder was meant
        load(tmp_path)
    (tmp_path / "spindle.toml").rmdir()
    (tmp_path / "spindle.toml").write_text("title = ", encoding="utf-8")
    with pytest.raises(BadInput, match="not a TOML file"):
        load(tmp_path)


def test_encodings_of_other_editors(tmp_path):
    """A byte order mark is read; a letter in Latin-1 is named by its line."""
    text = FILE.read_bytes()
    (tmp_path / "spindle.toml").write_bytes(b"\xef\xbb\xbf" + text)
    load(tmp_path)
    first, rest = text.split(b"\n", maxsplit=1)
    (tmp_path / "spindle.toml").write_bytes(first + b"\n# Pr\xfcfstand\n" + rest)
    with pytest.raises(BadInput, match=r"line 2 has a byte that is no UTF-8 \(0xfc\).*save the file as UTF-8"):
        load(tmp_path)


def test_folder_and_file_are_the_same_scene():
    assert content_hash(load(FILE)) == content_hash(load(FILE.parent))


def test_the_hash_sees_every_number_and_no_words(raw):
    first = content_hash(build(copy.deepcopy(raw), FILE))
    reworded = copy.deepcopy(raw) | {"title": "another"}
    assert content_hash(build(reworded, FILE)) == first
    raw["tolerances"]["gain"] *= 1 + 1e-12
    assert content_hash(build(raw, FILE)) != first


def test_every_number_says_where_it_comes_from(spindle):
    origins = {p.origin for p in spindle.provenance.values()}
    assert origins == {"printed", "assumed", "calibrated"}
    assert spindle.provenance["ball_rows.hdd.balls"].origin == "printed"
    assert spindle.provenance["ball_rows.hdd.damping_ratio"].origin == "assumed"
    assert spindle.provenance["structure.joints.mount.axial_stiffness_N_per_m"].origin == "calibrated"
    assert spindle.provenance["structure.joints.mount.damping_ratio"].origin == "assumed"
    assert all(p.source for p in spindle.provenance.values())


def test_hub_from_the_section(spindle):
    """0.0259 kg (data sheet), and a hollow cylinder's closed form."""
    assert spindle.structure.body("hub").mass == pytest.approx(0.0259, abs=5e-5)
    shaft = [g for g in spindle.regions if g.name == "shaft"]
    found = mass_properties(cells(shaft), shaft, dict(spindle.materials))
    mass = 7800 * np.pi * 2.5e-3**2 * 22e-3
    assert found.mass == pytest.approx(mass, rel=1e-12)
    assert found.z == pytest.approx(8e-3, rel=1e-12)
    assert found.polar == pytest.approx(mass * 2.5e-3**2 / 2, rel=1e-12)
    assert found.transverse == pytest.approx(mass * (3 * 2.5e-3**2 + 22e-3**2) / 12, rel=1e-12)


def test_later_regions_cut_earlier_ones(spindle):
    rotating = [g for g in spindle.regions if g.part == "rotating"]
    tiles = cells(rotating)
    area = sum((c.r[1] - c.r[0]) * (c.z[1] - c.z[0]) for c in tiles)
    overlap = 1e-3 * 10e-3  # sleeve and hub body, 6.5-7.5 mm over z = 10-20 mm
    whole = sum((g.r[1] - g.r[0]) * (g.z[1] - g.z[0]) for g in rotating)
    assert area == pytest.approx(whole - overlap, rel=1e-12)
    assert {c.region for c in tiles if c.r[0] < 7e-3 and c.z[0] > 12e-3 and c.r[1] > 6.6e-3} == {"hub body"}


def test_laws():
    """Piecewise linear, its integral exact, nothing outside."""
    law = Law((20.0, 60.0, 100.0), (1.0, 3.0, 3.0))
    assert law(40.0) == pytest.approx(2.0)
    assert law.integral(20.0, 80.0) == pytest.approx(80.0 + 60.0)
    assert law.integral(80.0, 20.0) == pytest.approx(-140.0)
    assert Law((0.0,), (5.0,)).integral(20.0, 60.0) == pytest.approx(200.0)
    with pytest.raises(OutsideRange, match="from 20 to 100 C was asked at 120 C"):
        law(120.0)


def test_a_law_goes_on_a_little_beyond_its_ends():
    """A temperature that was computed may miss an end by its last digit: the sentence then was "given from 20 to 60 C was asked at 20 C"."""
    law = Law((20.0, 40.0, 60.0), (1.0, 2.0, 4.0))
    assert [law(t) for t in (19.999, 20.0, 40.0, 60.0, 60.001)] == pytest.approx([0.99995, 1.0, 2.0, 4.0, 4.0001], rel=1e-12)
    assert law.integral(19.999, 60.0) == pytest.approx(90.001, rel=1e-6)
    for outside, said in ((19.98, "19.98"), (60.1, "60.1")):
        with pytest.raises(OutsideRange, match=rf"^a material law given from 20 to 60 C was asked at {said} C$"):
            law(outside)


def test_a_law_that_does_not_reach_names_its_key(raw):
    """Which of the scene's laws it is; that is no number of the spindle."""
    raw["materials"]["steel"]["youngs_modulus_GPa"] = {"temperature_C": [20.0, 60.0], "value": [208.0, 205.0]}
    spindle = build(raw, FILE)
    with pytest.raises(OutsideRange, match=r"^materials.steel.youngs_modulus_GPa: a law given from 20 to 60 C was asked at 70 C$"):
        spindle.materials["steel"].youngs_modulus(70.0)
    with pytest.raises(OutsideRange, match=r"^thermal.friction.kinematic_viscosity_mm2_per_s: a law given from -20 to 120 C was asked at 130 C$"):
        spindle.thermal.friction.viscosity(130.0)
    law = spindle.materials["steel"].youngs_modulus
    unnamed = replace(spindle, materials=spindle.materials | {"steel": replace(spindle.materials["steel"], youngs_modulus=Law(law.temperature, law.value))})
    assert unnamed == spindle
    assert content_hash(unnamed) == content_hash(spindle)


def test_what_a_scene_leaves_out_is_assumed_and_said(raw):
    """Thermal data, tolerances and the hammer test have defaults, which the provenance names."""
    for table in ("thermal", "tolerances", "hammer_test"):
        raw.pop(table)
    raw.pop("nominal_speed_rpm")
    raw.pop("temperature_range_C")
    assumed = build(raw, FILE)
    assert assumed.hammer.hammer_nodes == (1,)
    assert assumed.tolerances.structure == 0.015
    assert {name for c in assumed.thermal.convections for name in c.regions} == {g.name for g in assumed.regions}
    assert assumed.thermal.friction.viscosity(40.0) == pytest.approx(26e-6)
    assert assumed.temperatures == (20.0, 60.0)
    assert assumed.nominal_speed == pytest.approx(11000 * np.pi / 30)  # 100,000 mm rpm over 9.1 mm
    for key in ("hammer_test.band_Hz", "tolerances.gain", "thermal.convection", "thermal.friction", "nominal_speed_rpm"):
        assert assumed.provenance[key].origin == "assumed"
        assert assumed.provenance[key].source.startswith("assumed default")


def test_the_program_chooses_the_step(raw):
    """It divides a usual sampling interval, 39.0625 us, and is stable for the stiffest mode with room to spare."""
    raw["hammer_test"].pop("step_us")
    raw["hammer_test"]["sample_rate_Hz"] = 25600.0
    chosen = build(raw, FILE)
    every = 1 / (25600.0 * chosen.hammer.step)
    assert every == pytest.approx(round(every), rel=1e-12)
    assert 1e-6 < chosen.hammer.step < 15e-6
    stiff = copy.deepcopy(raw)
    named(stiff["structure"]["joints"], "flange")["axial_stiffness_N_per_m"] *= 400
    assert build(stiff, FILE).hammer.step < chosen.hammer.step


def test_a_free_contact_angle_and_no_clearance(raw, spindle):
    """As catalogues have it: the free angle that the reference's clearance means gives its loaded one back."""
    clearance = implied_clearance(spindle, spindle.bearings[0])
    free = np.arccos(1 - clearance / (2 * spindle.bearings[0].unloaded_distance))
    raw["ball_rows"]["hdd"].pop("contact_angle_deg")
    raw["ball_rows"]["hdd"].pop("diametral_clearance_mm")
    raw["ball_rows"]["hdd"]["free_contact_angle_deg"] = float(np.degrees(free))
    found = build(raw, FILE)
    assert np.degrees(found.bearings[0].contact_angle) == pytest.approx(24.51, rel=1e-9)
    assert found.bearings[0].clearance is None


def test_the_sense_of_every_bearing_follows_the_arrangement(raw):
    for arrangement, senses in (("back-to-back", [-1, 1]), ("face-to-face", [1, -1]), ("tandem", [1, 1])):
        raw["bearing_pair"].update(arrangement=arrangement, preload_kind="spring" if arrangement == "tandem" else "rigid")
        assert [b.sense for b in build(copy.deepcopy(raw), FILE).bearings] == senses
        built = build(copy.deepcopy(raw), FILE)
        assert built.one_way(built.sets[0]) is (arrangement == "tandem")


def test_a_spring_without_a_rate_says_what_is_assumed(raw):
    raw["bearing_pair"]["preload_kind"] = "spring"
    assumed = build(copy.deepcopy(raw), FILE)
    assert assumed.sets[0].spring.rings_of == ("upper",)
    assert "friction holds" in assumed.provenance["bearing_pair.preload_rate_N_per_m"].source
    assert "locates" in assumed.provenance["bearing_pair.sprung_bearing"].source
    raw["bearing_pair"].update(sprung_bearing="lower", preload_rate_N_per_m=2e5, sprung_ring_mass_g=0.4)
    spring = build(raw, FILE).sets[0].spring
    assert (spring.rings_of, spring.rate, spring.mass) == (("lower",), 2e5, 0.4e-3)


def test_where_a_spindle_can_be_computed(spindle):
    """The intersection of its laws; a finite difference turns one-sided where one ends."""
    assert temperature_range(spindle) == (-20.0, 120.0)  # its grease
    assert temperature_range(spindle, lubricant=False) == (-273.15, float("inf"))
    steel = replace(spindle.materials["steel"], youngs_modulus=Law((20.0, 60.0), (208e9, 205e9)))
    measured = replace(spindle, materials={**spindle.materials, "steel": steel})
    assert temperature_range(measured) == (20.0, 60.0)
    assert inside(20.0, 0.2, measured) == pytest.approx((20.0, 20.2))
    assert inside(60.0, 0.2, measured) == pytest.approx((59.8, 60.0))
    assert inside(40.0, 0.2, measured) == pytest.approx((39.9, 40.1))
    unused = replace(steel, name="unused", thermal_expansion=Law((30.0, 31.0), (1e-5, 1e-5)))
    assert temperature_range(replace(measured, materials={**measured.materials, "unused": unused})) == (20.0, 60.0)
