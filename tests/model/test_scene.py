"""Scene files: what is read, and what is refused in one sentence that names file, key, value and what is allowed."""

import copy
import tomllib
from pathlib import Path

import numpy as np
import pytest

from model.machine import Law, OutsideRange
from model.scene import BadInput, build, content_hash, load
from model.section import cells, mass_properties

FILE = Path(__file__).parents[2] / "scenes" / "hdd_2003" / "spindle.toml"


@pytest.fixture
def raw():
    return tomllib.loads(FILE.read_text(encoding="utf-8"))


def named(entries, name):
    return next(e for e in entries if e["name"] == name)


def region(raw, name):
    return named(raw["section"]["regions"], name)


REFUSED = [
    ("poisson", lambda r: r["materials"]["steel"].update(poisson_ratio=0.6), "materials.steel.poisson_ratio = 0.6", "less than 0.5"),
    ("misspelt", lambda r: r["materials"]["steel"].update(density=1.0), "materials.steel.density: unknown key", "density_kg_per_m3"),
    ("missing", lambda r: r["tolerances"].pop("gain"), "tolerances.gain: missing", "no default"),
    ("type", lambda r: r["tolerances"].update(gain="big"), "tolerances.gain = 'big'", "number"),
    ("infinite", lambda r: r["tolerances"].update(gain=float("inf")), "tolerances.gain = inf", "finite"),
    ("no-origin", lambda r: r["tolerances"].pop("origin"), "tolerances.structure = 0.015", "origin = printed, assumed or calibrated"),
    ("law", lambda r: r["materials"]["steel"].update(youngs_modulus_GPa={"temperature_C": [60, 20], "value": [1, 2]}), "GPa", "must rise"),
    ("material", lambda r: region(r, "sleeve").update(material="brass"), "section.regions.sleeve.material = 'brass'", "allowed are"),
    ("floating", lambda r: region(r, "upper inner ring").update(z_mm=[19.5, 22.0]), "upper inner ring", "floats"),
    ("ring-off-shaft", lambda r: region(r, "lower inner ring").update(r_mm=[2.6, 3.752]), "r_mm = [2.6, 3.752]", "floats"),
    ("parts-collide", lambda r: region(r, "sleeve").update(r_mm=[3.0, 7.5]), "section.regions.sleeve", "parts may not share space"),
    ("materials-collide", lambda r: region(r, "magnet ring").update(r_mm=[13, 15]), "magnet ring", "only regions of one material"),
    ("empty-span", lambda r: region(r, "shaft").update(z_mm=[3.0, 3.0]), "section.regions.shaft.z_mm = [3.0, 3.0]", "smaller"),
    ("bearing-outside", lambda r: r["bearings"]["upper"].update(z_mm=12.0), "bearings.upper.z_mm = 12", "outside its ring"),
    ("ring-name", lambda r: r["bearings"]["upper"].update(inner_ring="x"), "bearings.upper.inner_ring = 'x'", "no section region"),
    ("row-name", lambda r: r["bearings"]["upper"].update(row="x"), "bearings.upper.row = 'x'", "allowed are hdd"),
    ("pitch", lambda r: r["ball_rows"]["hdd"].update(pitch_diameter_mm=12.0), "pitch_diameter_mm = 12", "between the raceways"),
    ("ball-size", lambda r: r["ball_rows"]["hdd"].update(ball_diameter_mm=1.7), "ball_diameter_mm = 1.7", "-2 % to +5 %"),
    ("too-many-balls", lambda r: r["ball_rows"]["hdd"].update(balls=40), "ball_rows.hdd", "do not fit"),
    ("clearance", lambda r: r["ball_rows"]["hdd"].update(contact_angle_deg=30.0), "contact_angle_deg = 30", "contradicts"),
    ("turning-ring", lambda r: r["bearing_pair"].update(turning_ring="inner"), "turning_ring = 'inner'", "rotating part"),
    ("tandem", lambda r: r["bearing_pair"].update(arrangement="tandem"), "bearing_pair", "preload_kind must be spring"),
    ("joint-end", lambda r: named(r["structure"]["joints"], "mount").update(between=["ground", "bas"]), "'bas' is no body", "allowed are"),
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
    ("node-twice", lambda r: r["measuring"]["points"][0].update(node=2), "node = 2 stands twice", "must differ"),
    ("hammer-node", lambda r: r["hammer_test"].update(hammer_nodes=[9]), "hammer_test.hammer_nodes: 9", "allowed are"),
    ("sampling", lambda r: r["hammer_test"].update(sample_rate_Hz=5000.0), "hammer_test", "2.5 times"),
    ("heat", lambda r: r["thermal"]["gaps"][0].update(regions=["shaft", "hub"]), "thermal.gaps: 'hub'", "allowed are"),
    ("unknown-table", lambda r: r.update(extra={}), "extra: unknown key", "materials"),
]


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
    (tmp_path / "spindle.toml").write_text("title = ", encoding="utf-8")
    with pytest.raises(BadInput, match="not a TOML file"):
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
