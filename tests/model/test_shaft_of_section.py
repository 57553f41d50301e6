"""A flexible shaft told by regions of the section, against the same told by diameters and lengths, and against the masses of the section."""

from __future__ import annotations

import re
import tomllib

import pytest

from tests.conftest import ROOT
from thermospindle.model.errors import BadInput
from thermospindle.model.scene.reading import build
from thermospindle.model.scene.section import Section, slabs

PATH = ROOT / "scenes" / "five_bearing" / "spindle.toml"
SHAFT = ["nose", "nose flange", "front shaft", "middle shaft", "slim shaft", "rear shaft"]
RINGS = ["front1 inner ring", "front2 inner ring", "inner spacer", "front3 inner ring"]
NUMBERS = {
    "outer_mm": [[82, 13], [133, 31], [75, 147.5], [67, 90], [60, 158.5]],
    "bore_mm": [[55, 13], [45, 90], [35, 337]],
    "material": "steel",
}


def five_bearing(materials=(), **keys):
    """The shipped machine with its shaft told otherwise; `materials` are of regions by name."""
    raw = tomllib.loads(PATH.read_text(encoding="utf-8"))
    raw["materials"]["light"] = raw["materials"]["steel"] | {"density_kg_per_m3": 3925.0}
    for region in raw["section"]["regions"]:
        region["material"] = dict(materials).get(region["name"], region["material"])
    [shaft] = raw["shafts"]
    raw["shafts"] = [{k: v for k, v in shaft.items() if k not in ("outer_mm", "bore_mm", "material")} | keys]
    return build(raw, PATH)


def test_regions_are_the_shaft_that_their_diameters_and_lengths_are():
    """Node by node; the regions are told in no order."""
    told, drawn = five_bearing(**NUMBERS), five_bearing(regions=SHAFT[::-1])
    [a], [b] = told.structure.shafts, drawn.structure.shafts
    assert b.nodes == pytest.approx(a.nodes, abs=1e-12)
    for one, other in zip(told.structure.bodies, drawn.structure.bodies, strict=True):
        assert other.mass == pytest.approx(one.mass, rel=1e-9)
        assert other.inertia == pytest.approx(one.inertia, rel=1e-9)
    for one, other in zip(told.structure.joints, drawn.structure.joints, strict=True):
        assert other.stiffness == pytest.approx(one.stiffness, rel=1e-9)


@pytest.mark.parametrize("material", ["steel", "light"])
def test_what_a_shaft_carries_adds_mass_and_no_stiffness(material):
    plain, loaded = five_bearing(regions=SHAFT), five_bearing({n: material for n in RINGS}, regions=SHAFT, mass_regions=RINGS)
    density = {"steel": 7850.0, "light": 3925.0}[material]
    rings = sum(3.141592653589793 * (r.r[1] ** 2 - r.r[0] ** 2) * (r.z[1] - r.z[0]) * density for r in loaded.regions if r.name in RINGS)
    mass = [sum(b.mass for b in s.structure.bodies if b.name in s.structure.shafts[0].bodies) for s in (plain, loaded)]
    assert mass[1] - mass[0] == pytest.approx(rings, rel=1e-9)
    for one, other in zip(plain.structure.joints, loaded.structure.joints, strict=True):
        assert other.stiffness == pytest.approx(one.stiffness, rel=1e-9)


def test_a_shaft_of_two_metals_one_behind_the_other():
    drawn = five_bearing({"rear shaft": "light"}, regions=SHAFT)
    assert {s.material for s in drawn.structure.shafts[0].segments if s.z[0] >= 0.2815 - 1e-9} == {"light"}
    assert {s.material for s in drawn.structure.shafts[0].segments if s.z[1] <= 0.2815 + 1e-9} == {"steel"}


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"regions": ["noze", *SHAFT[1:]]}, "shafts.spindle.regions: 'noze' names no section region; did you mean nose?"),
        ({"regions": [*SHAFT[:2], *SHAFT[3:]]}, "shafts.spindle.regions: none between z_mm = 44 and 103; the regions of a shaft follow each other without a gap"),
        ({"regions": SHAFT, "mass_regions": [*RINGS, "nose"]}, "'nose' stands twice; its mass counts once"),
        ({"regions": SHAFT, "mass_regions": [*RINGS, RINGS[0]]}, "'front1 inner ring' stands twice; its mass counts once"),
        ({"regions": SHAFT[:3], "mass_regions": ["rear1 inner ring"]}, "mass_regions: 'rear1 inner ring' reaches beyond the shaft, which spans 0 to 103 mm"),
        ({"regions": [*SHAFT, "front1 outer ring"]}, "shafts.spindle.regions: 'front1 outer ring' is of the stationary part, and the shaft turns"),
        ({"regions": SHAFT, "mass_regions": ["housing tube"]}, "shafts.spindle.mass_regions: 'housing tube' is of the stationary part, and the shaft turns"),
        ({"regions": SHAFT, "turns": False}, "shafts.spindle.regions: 'nose' is of the rotating part, and the shaft stands"),
        ({"regions": SHAFT, "outer_mm": [[60, 440]]}, "shafts.spindle: regions and outer_mm: both told"),
        ({**NUMBERS, "mass_regions": RINGS}, "shafts.spindle.mass_regions goes with regions"),
        ({"regions": SHAFT, "moves": ["x", "tilt_y"]}, "shafts.spindle: a shaft that turns must move in x, y, z, tilt_x and tilt_y"),
        ({}, "no section told; allowed are outer_mm alone"),
    ],
)
def test_regions_that_are_no_shaft_are_refused(keys, words):
    with pytest.raises(BadInput, match=re.escape(words)):
        five_bearing(**keys)


def test_what_does_not_touch_is_refused():
    raw = tomllib.loads(PATH.read_text(encoding="utf-8"))
    [ring] = [r for r in raw["section"]["regions"] if r["name"] == "rear1 inner ring"]
    section = Section.model_validate({"regions": [r for r in raw["section"]["regions"] if r["name"] == "rear shaft"] + [ring | {"r_mm": [31.0, 33.25]}]})
    with pytest.raises(ValueError, match=re.escape("regions: nothing from r_mm = 30 to 31 between z_mm = 303.5 and 321.5")):
        slabs(section, {"steel": 7850.0}, ["rear shaft", "rear1 inner ring"], [], turns=True)


def test_one_metal_around_another_is_refused():
    with pytest.raises(BadInput, match=re.escape("shafts.spindle.regions: light and steel one around the other between z_mm = 61 and 81")):
        five_bearing({"front1 inner ring": "light"}, regions=[*SHAFT, "front1 inner ring"])
