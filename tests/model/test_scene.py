"""Scene files: what is read, and what is refused in one sentence that names file, key, value and what is allowed."""

import copy
import re
from dataclasses import replace

import numpy as np
import pytest

from tests.model.conftest import FILE, named
from thermospindle.model.errors import BadInput, OutsideRange
from thermospindle.model.material import Law
from thermospindle.model.rotor.section import cells, mass_properties
from thermospindle.model.scene.checks import implied_clearance
from thermospindle.model.scene.reading import build, content_hash, load
from thermospindle.model.span import inside, temperature_range


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
    for line, said in (("preload_N = 180,5", "180,5 has a decimal comma; write 180.5"), ("z_mm = [1, -2,5]\nx = -7,25 # mm", "-7,25 has a decimal comma; write -7.25")):
        (tmp_path / "spindle.toml").write_text(f"title = 'one, two'\n{line}\n", encoding="utf-8")
        with pytest.raises(BadInput, match=rf"not a TOML file: .* \(at line \d, column \d+\): {re.escape(said)}$"):
            load(tmp_path)
    for text, said in (
        ("balls = 14\nballs = 15\n", "'balls' has a value already, and was given another"),
        ("balls = 14\nballs = 15", "'balls' has a value already, and was given another"),
        ("z = [\n1,\n]\nz = [\n1,\n2,\n]\nb = 1\n", "'z' has a value already, and was given another"),
        ("[x]\na = 1\n[x]\nb = 1\n", "[x] stands already"),
    ):
        (tmp_path / "spindle.toml").write_text(text, encoding="utf-8")
        with pytest.raises(BadInput, match=rf"not a TOML file: .*: {re.escape(said)}$"):
            load(tmp_path)
    (tmp_path / "spindle.toml").write_text("a = 1,5 = 2\nb = [1,2", encoding="utf-8")
    with pytest.raises(BadInput, match=r"not a TOML file: "):
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


@pytest.mark.parametrize(("edit", "told"), [({"reference_temperature_C": 295.0}, "given from -20 to 120 C was asked at 295 C"), ({"steel": [25.0, 60.0]}, "given from 25 to 60 C was asked at 20 C")])
def test_a_reference_that_no_law_reaches_names_its_key(raw, edit, told):
    """Kelvin typed for degrees, or a table that begins above the reference: the key of the law alone was told."""
    if "steel" in edit:
        raw["materials"]["steel"]["youngs_modulus_GPa"] = {"temperature_C": edit["steel"], "value": [200.0, 190.0]}
    else:
        raw |= edit
        raw["materials"]["steel"]["youngs_modulus_GPa"] = {"temperature_C": [-20.0, 120.0], "value": [200.0, 190.0]}
    with pytest.raises(BadInput, match=rf"spindle.toml: reference_temperature_C = [\d.]+: materials.steel.youngs_modulus_GPa: a law {told}; allowed is one that every law of the scene reaches$"):
        build(raw, FILE)


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
