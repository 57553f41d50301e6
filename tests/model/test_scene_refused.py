"""What a scene may not hold, each refused in one sentence with its key and what is allowed."""

import copy
import re
import tomllib

import pytest

from tests.conftest import ROOT
from tests.model.conftest import FILE, named
from thermospindle.model.errors import BadInput
from thermospindle.model.scene.reading import build, load, shipped_rows


def region(raw, name):
    return named(raw["section"]["regions"], name)


def by_numbers(raw, tilt, polar):
    hub = named(raw["structure"]["bodies"], "hub")
    hub.pop("regions")
    hub.update(mass_kg=0.026, z_mm=10.0, tilt_inertia_kg_m2=[tilt, tilt], origin="assumed")
    if polar is not None:
        hub.update(polar_inertia_kg_m2=polar)


def of_a_hidden_region(raw):
    raw["section"]["regions"].insert(0, region(raw, "sleeve") | {"name": "hidden", "r_mm": [6.5, 7.5], "z_mm": [11.0, 19.0]})
    raw["structure"]["bodies"].append({"name": "lump", "regions": ["hidden"], "moves": ["x", "y", "z", "tilt_x", "tilt_y"], "turns": False})
    raw["structure"]["joints"].append(named(raw["structure"]["joints"], "mount") | {"name": "of lump", "between": ["ground", "lump"]})


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
    ("world", lambda r: named(r["structure"]["bodies"], "seat").update(name="world"), "structure.bodies: the name 'world' is taken", "must differ"),
    ("carrier", lambda r: named(r["structure"]["bodies"], "seat").update(name="hub carrier"), "the name 'hub carrier' is taken", "must differ"),
    ("two-joints", lambda r: named(r["structure"]["joints"], "flange").update(name="plate"), "structure.joints: the name 'plate' is taken", "must differ"),
    ("joint-like-bearing", lambda r: named(r["structure"]["joints"], "flange").update(name="upper"), "bearings: the name 'upper' is taken", "joints and bearings must differ"),
    ("body-without-section", of_a_hidden_region, "structure.bodies.lump.regions = ['hidden']", "nothing is left"),
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


def scene(name, raw):
    """A shipped scene or template built from its tables after `raw` has changed them."""
    file = ROOT / "scenes" / name
    tables = tomllib.loads(file.read_text(encoding="utf-8"))
    raw(tables)
    return build(tables, file)


def test_a_body_named_like_a_shaft_is_refused():
    """Joints and points that named the body went to the shaft, and the body floated."""

    def renamed(raw):
        raw["structure"]["bodies"][0]["name"] = "shaft"
        raw["structure"]["joints"][0]["between"] = ["ground", "shaft"]
        for p in raw["measuring"]["points"]:
            p["body"] = "shaft"

    with pytest.raises(BadInput, match=r"structure\.shafts: the name 'shaft' is taken; names of bodies and shafts must differ"):
        scene("templates/rotor.toml", renamed)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"pitch_diameter_mm": 200.0}, "bearings.front1: pitch_diameter_mm = 200: the roller centres must lie between the raceways at r_mm = 41 and 50"),
        ({"rows": 2, "row_spacing_mm": 60.0}, "bearings.front1: row_spacing_mm = 60: the middles of its 2 rows at z_mm = "),
        ({"roller_diameter_mm": 9.6}, "leave 9 mm for rollers of roller_diameter_mm = 9.6"),
    ],
)
def test_rollers_that_do_not_fit_their_rings_are_refused(change, said):
    name = "NN3014ASK"
    with pytest.raises(BadInput, match=re.escape(said)):
        scene("tailstock/spindle.toml", lambda raw: raw.update(roller_rows={name: shipped_rows()["roller_rows"][name] | change}))


@pytest.mark.parametrize(
    ("bodies", "said"),
    [
        (("barrel", "spindle"), "outer_ring = 'front outer ring': is on the stationary part, but of its bodies 'spindle' turns"),
        (("ground", "barrel"), "bearings.front1: its rings, on 'ground' and 'barrel', turn alike; one of the two must have turns = true"),
    ],
)
def test_roller_rings_on_the_wrong_bodies_are_refused(bodies, said):
    with pytest.raises(BadInput, match=re.escape(said)):
        scene("tailstock/spindle.toml", lambda raw: raw["bearings"]["front1"].update(zip(("inner_body", "outer_body"), bodies, strict=True)))


def test_a_load_on_two_shafts_is_refused():
    """Of two shafts in a housing that is the ground each had the whole load."""

    def two(raw):
        first = raw["shafts"][0]
        length = sum(piece[-1] for piece in first["outer_mm"])
        told = {k: v for k, v in first.items() if k in ("origin", "source", "name", "material", "role", "turns", "damping_ratio")}
        raw["shafts"] = [told | {"outer_mm": [[70.0, 200.0]], "start_z_mm": 0.0}, told | {"name": "second", "outer_mm": [[60.0, length - 210.0]], "start_z_mm": 210.0}, *raw["shafts"][1:]]
        sets = {k: v for k, v in raw["sets"]["spindle"].items() if k in ("origin", "source")} | {"preload_N": 450.0, "preload_kind": "rigid"}
        raw["sets"] = {end: sets | {"bearings": [f"{end}1", f"{end}2"]} for end in ("front", "rear")}
        raw["bearings"] |= {name: b | {"inner_body": "second" if name.startswith("rear") else "spindle", "outer_body": "ground", "sense": "-z" if name.endswith("1") else "+z"} for name, b in raw["bearings"].items()}
        raw["measuring"]["points"] = [p for p in raw["measuring"]["points"] if p["body"] != "spindle" or p["position_mm"][2] < 200.0]
        raw.pop("imperfections", None)

    scene("templates/machine-tool.toml", two)
    with pytest.raises(BadInput, match=r"axial_load_N = 100: there is no one part that carries all inner rings, .* rows that share no part are front1 and front2; rear1 and rear2"):
        scene("templates/machine-tool.toml", lambda raw: two(raw) or raw.update(axial_load_N=100.0))
