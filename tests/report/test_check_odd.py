"""What `spindle check` finds odd, each in a sentence, and what it leaves alone."""

from __future__ import annotations

import json
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.report.checked import SCENES, checked
from thermospindle.cli import main
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.chain import matrices, motion_rows
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.report.check.looked import looked
from thermospindle.report.check.odd import odd
from thermospindle.sim.operating import operating_point
from thermospindle.sim.resonance.critical import criticals
from thermospindle.sim.running.excitation import harmonics, response

ODD = [
    ("machine-tool", "pitch_diameter_mm = 90.0           #", "pitch_diameter_mm = 85.0           #", "pitch_diameter_mm = 85, and its rings leave the balls a circle of"),
    ("machine-tool", "preload_rate_N_per_m = 1.0e6", "preload_rate_N_per_m = 2.0", "its spring has a rate of 2 N/m, which keeps its force whatever the rings do"),
    ("five_bearing", "tip_stiffness_N_per_m = 3.0e7", "tip_stiffness_N_per_m = 3.0e6", "the hammer gives no force above 2615 Hz"),
    ("five_bearing", "hammer_mass_g = 100.0", "hammer_mass_g = 10.0", "pulse of 57.4 us is shorter than a sample of 80 us"),
    ("five_bearing", "hammer_mass_g = 100.0", "hammer_mass_g = 370.0", "less than a tenth of its force"),
    ("five_bearing", "position_mm = [66.5, 0.0, 36.0]", "position_mm = [80.5, 0.0, 36.0]", "point flange: lies 14 mm off 'spindle'"),
    ("hdd_2003", "position_mm = [12.5, 0.0, 15.0]", "position_mm = [15.5, 0.0, 15.0]", "point hub_side0: lies 3 mm off 'hub'"),
    ("mk7702", "z_mm = 101.0", "z_mm = 81.0", "bearings front1 and front2 sit at the same place, z_mm = 81, between the same parts"),
    ("mk7702", "damping_ratio = 0.015\norigins = { damping_ratio = \"assumed\", axial", "damping_ratio = 0.9\norigins = { damping_ratio = \"assumed\", axial", "of critical"),
    ("five_bearing", "temperature_range_C = [20.0, 60.0]", "temperature_range_C = [20.0, 160.0]", "160 C lies outside"),
    ("hdd_2003", "reference_temperature_C = 20.0", "reference_temperature_C = 295.0", "295 C lies outside -40 to 120 C"),
    ("five_bearing", "nominal_speed_rpm = 8000.0", "nominal_speed_rpm = 40000.0", "means a speed factor n dm of 3.8e+06"),
    ("five_bearing", "[[82, 13], [133, 23], [120, 8], [75, 100]", "[[82, 13], [133, 23], [120, 8], [90, 100]", "begins at a radius of 37.5 mm, and the shaft 'spindle' has 45 mm there"),
    ("five_bearing", "[[82, 13], [133, 23], [120, 8], [75, 100]", "[[82, 13], [133, 23], [120, 8], [50, 100]", "begins at a radius of 37.5 mm, and the shaft 'spindle' has 25 mm there; outer_mm is a diameter"),
    ("five_bearing", "band_Hz = [300.0, 4000.0]", "band_Hz = [1000.0, 4000.0]", "natural frequencies below the band"),
    ("five_bearing", "record_length_s = 0.25", "record_length_s = 0.02", "has not died out when the record of 0.02 s ends"),
    ("hdd", "nominal_speed_rpm = 7200.0", "nominal_speed_rpm = 60000.0", "bearing_pair.ball_inertia = 0: the balls of lower and upper have no centrifugal force"),
    ("grinding", "# ball_inertia = 1.0", "ball_inertia = 0.0 # ", "ball_inertia = 0: the balls of "),
    ("hdd", "thermal_expansion_um_per_m_K = 23.0", "thermal_expansion_um_per_m_K = 23.0e-6", "material aluminium: expands by 2.3e-05 um/m in a kelvin"),
    ("hdd", "density_kg_per_m3 = 7800.0", "density_kg_per_m3 = 7.8", "material steel: has 7.8 kg/m3, less than any solid part"),
    ("hdd_2003", "tilt_inertia_kg_m2 = [2.0e-5, 2.0e-5]", "tilt_inertia_kg_m2 = [2.0e-8, 2.0e-8]", "body 'seat': 0.09984 kg with moments of inertia of at most 4e-08 kg m2 would be a ball of"),
    ("rotor", "mass_kg = 3.0", "mass_kg = 3000.0", "body 'disc': 3000 kg with moments of inertia"),
    ("hdd", "# raceway_width_mm = 3.0 ", "raceway_width_mm = 30.0 ", "a raceway of 30 mm about z_mm = "),
    ("hdd", "preload_N = 16.0", "preload_N = 15.0", "at 60 C the preload is less than half that of the reference: lower 2."),
    ("hdd", "contact_angle_deg = 24.5 ", "free_contact_angle_deg = 0.43 ", "free_contact_angle_deg = 0.43, of lower, upper: angular contact bearings have 12 to 40"),
    ("hdd", "contact_angle_deg = 24.5 ", "contact_angle_deg = 80 ", "contact_angle_deg = 80, of lower, upper"),
    ("rotor", "radial_stiffness_N_per_um = 20.0", "radial_stiffness_N_per_um = 20.0e-6", "bearing left: its radial stiffness is 20 N/m at most, on which the"),
    ("free_shaft", "damping_ratio = 1.0e-4", "damping_ratio = 1.0e-9", "4 modes up to 1100 Hz are undamped"),
    ("grinding", "outer_conformity = 0.53", "outer_conformity = 0.60", "the outer groove's radius is 0.6 ball diameters"),
    ("machine-tool", "balls = 18\nball_diameter_mm = 10.32", "balls = 11\nball_diameter_mm = 10.32", "ball_rows.rear.catalogue, of rear1, rear2: preload, unloading force and axial rigidity ask for contacts 1.6 times as stiff as Hertz has them of 11 balls of 10.32 mm"),
    ("machine-tool", "axial_rigidity_N_per_um = [64.5, 111.7, 162.8]", "axial_rigidity_N_per_um = [32.25, 55.85, 81.4]", "mm and grooves of a radius of 0.559 ball diameters, and bearings have 0.52 to 0.535"),
    ("free_shaft", "[tolerances]", "[[effects]]\nname = \"preload_loss\"\n[tolerances]", "effect preload_loss: nothing to act on here"),
    ("hdd_2003", 'between = ["seat", "shaft"]', 'between = ["hub", "shaft"]', "joint flange: 'hub' turns and 'shaft' does not"),
    ("hdd", "preload_N = 16.0", "preload_N = 900.0", "under preload and the loads told; balls leave dents from 4200 MPa, the static limit of ISO 76"),
    ("machine-tool", 'sprung_bearings = ["rear1", "rear2"]', 'sprung_bearings = ["rear1"]', "rear2 is loaded the same way as rear1, and only the latter on the spring"),
    ("hdd", "reference_temperature_C = 20.0", "axial_load_N = 60.0\nreference_temperature_C = 20.0", "carries nothing at the reference temperature, at rest"),
    ("hdd", "youngs_modulus_GPa = 208.0", "youngs_modulus_GPa = 0.208", "material steel: has a Young's modulus of 0.208 GPa"),
    ("five_bearing", "axial_stiffness_N_per_m = 1.0e9", "axial_stiffness_N_per_m = 1.0e3", "Hz, with 100% of its strain in mount: a machine on soft feet has 3 to 10"),
    ("rotor", "tilt_inertia_kg_m2 = [6.0e-3, 6.0e-3]", "tilt_inertia_kg_m2 = [7300.0, 7300.0]", "kg m2 lie 49 m from its centre, and the whole machine is 0.6 m long"),
    ("rotor", "nominal_speed_rpm = 4000.0", "nominal_speed_rpm = 7200.0", "lies at the nominal speed"),
    ("rotor", "unbalance_z_mm = 225.0", "unbalance_z_mm = 925.0", "imperfections.unbalance_z_mm = 925: lies beyond 'shaft', on which it acts, which spans 0 to 600"),
    ("rotor", "unbalance_z_mm = 225.0", 'unbalance_z_mm = 385.0\nunbalance_body = "disc"', "unbalance_z_mm = 385: lies beyond 'disc', on which it acts, whose centre of mass is at 225"),
    ("mk7702", "longest_element_mm = 20.0", "longest_element_mm = 90.0", "the shaft's elements are long for the band of the hammer test: mode "),
    ("rotor", "outer_mm = [[30, 600]]", "outer_mm = [[30, 300], [150, 300]]", "its diameter jumps from 30 to 150 mm at z_mm = 300"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "right", "wrong", "sentence"), ODD, ids=[f"{o[0]} {o[3][:30]}" for o in ODD])
def test_what_is_odd_is_said(name: str, right: str, wrong: str, sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of the changed scene, and not of the one that it was."""
    text = SCENES[name].read_text(encoding="utf-8")
    assert right in text
    (tmp_path / "spindle.toml").write_text(text.replace(right, wrong), encoding="utf-8")
    assert any(sentence in words for words in checked(tmp_path, capsys)["odd"])
    assert not any(sentence in words for words in checked(SCENES[name], capsys)["odd"])


def test_an_angle_that_is_none_is_told_as_the_file_has_it(tmp_path: Path) -> None:
    """The free angle that was typed, not the loaded one that follows; and of a spindle whose file is gone."""
    text = SCENES["hdd"].read_text(encoding="utf-8")
    told = text.replace("contact_angle_deg = 24.5 ", "free_contact_angle_deg = 2.5 ")
    (tmp_path / "spindle.toml").write_text(told, encoding="utf-8")
    spindle = load(tmp_path)
    (tmp_path / "spindle.toml").unlink()
    point = operating_point(spindle, Condition(20.0))
    assert np.degrees(spindle.bearings[0].contact_angle) > 6.0
    assert any("free_contact_angle_deg = 2.5, of lower, upper: angular contact" in words for words in odd(looked(spindle, point)))


@pytest.mark.parametrize(("clearance", "told"), [(-3e-6, False), (40e-6, False), (-30e-6, True), (-0.3e-3, True), (0.4e-3, True)])
def test_a_clearance_of_another_order_is_odd(clearance: float, told: bool) -> None:
    """Rollers of a pitch diameter of 140 mm that were mounted with ten times the preload that such rows take."""
    spindle = load(ROOT / "scenes" / "tailstock")
    tight = replace(spindle, roller_bearings=tuple(replace(b, clearance=clearance, pitch_diameter=0.14) for b in spindle.roller_bearings))
    found = looked(spindle, operating_point(spindle, Condition(20.0)))
    assert any("of its pitch diameter; mounted rollers have" in words for words in odd(replace(found, spindle=tight))) == told


def test_a_spring_that_nothing_holds_is_odd(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A floating bearing behind a rigid pair: its spring presses the pair only where no outer force holds it, and `axial_load_N` says so."""
    text = SCENES["machine-tool"].read_text(encoding="utf-8").replace('z_mm = 60.0\nsense = "-z"', 'z_mm = 60.0\nsense = "+z"')
    apart = 'bearings = ["front1", "front2"]\npreload_N = 900.0\npreload_kind = "rigid"\n\n[sets.behind]\norigin = "assumed"\nsource = "a floating end"\nbearings = ["rear1", "rear2"]'
    floating = text.replace('bearings = ["front1", "front2", "rear1", "rear2"]', apart).replace("preload_N = 900.0                  #", "preload_N = 200.0 #")
    floating = floating.replace("preload_rate_N_per_m = 1.0e6 ", "# preload_rate_N_per_m = 1.0e6 ").replace("sprung_ring_mass_g", "# sprung_ring_mass_g")
    file = tmp_path / "spindle.toml"
    file.write_text(floating, encoding="utf-8")
    before = checked(file, capsys)
    assert any("set behind: the 200 N of its spring are held from outside" in words and "axial_load_N = -200" in words for words in before["odd"])
    assert before["bearings"]["front1"]["preload_N"] == pytest.approx(before["bearings"]["front2"]["preload_N"], rel=1e-9)

    file.write_text("axial_load_N = -200.0\n" + floating, encoding="utf-8")
    after = checked(file, capsys)
    assert not any("set behind" in words for words in after["odd"])
    assert after["bearings"]["front1"]["preload_N"] - after["bearings"]["front2"]["preload_N"] == pytest.approx(200.0, rel=1e-6)
    assert after["bearings"]["rear1"]["preload_N"] == pytest.approx(100.0, rel=1e-9)


def test_what_moves_freely_and_what_is_constant_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    assert any("against 2 motions" in words for words in checked(SCENES["free_shaft"], capsys)["odd"])
    assert any("constant numbers" in words for words in checked(SCENES["mk7702"], capsys)["odd"])
    assert checked(SCENES["hdd_2003"], capsys)["odd"] == []


def test_a_coarse_shaft_is_told_by_the_mode_that_modes_lists(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """By its number and frequency there; the other frequency is what short elements come to."""
    text = SCENES["mk7702"].read_text(encoding="utf-8")
    listed = []
    for element in (90.0, 10.0):
        (tmp_path / "spindle.toml").write_text(text.replace("longest_element_mm = 20.0", f"longest_element_mm = {element}"), encoding="utf-8")
        assert main(["modes", str(tmp_path), "--json"]) == 0
        listed.append([m["frequency_Hz"] for m in json.loads(capsys.readouterr().out)["modes"]])
        if element == 90.0:
            [words] = (words for words in checked(tmp_path, capsys)["odd"] if words.startswith("the shaft's elements are long"))
    found = re.search(r"mode (\d+) at ([\d.]+) Hz is ([\d.]+) % too low .* and (\d+) Hz with masses along", words)
    assert found is not None
    number, told, short = int(found[1]), float(found[2]), float(found[4])
    assert told == pytest.approx(listed[0][number - 1], abs=0.005)
    assert short == pytest.approx(listed[1][number - 1], rel=2e-3)
    assert float(found[3]) == pytest.approx(100 * (1 - told / short), abs=0.1)


def test_what_cannot_be_used_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "spindle.toml").write_text(SCENES["mk7702"].read_text(encoding="utf-8").replace("z_mm = 81.0", 'z_mm = "81"'), encoding="utf-8")
    assert main(["check", str(tmp_path)]) == 2
    assert "bearings.front1.z_mm = '81': input should be a valid number" in capsys.readouterr().err


def massless(text: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> list[str]:
    (folder / "spindle.toml").write_text(text, encoding="utf-8")
    return [words for words in checked(folder, capsys)["odd"] if words.startswith("section.regions: no body or shaft has the mass of")]


def test_a_region_whose_mass_nothing_has_is_odd(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of a part whose bodies are all made of regions; a body given by numbers, or a ground that
    holds rings, may stand for what is not named."""
    text = (ROOT / "tests" / "scenes" / "inner_turning_spring" / "spindle.toml").read_text(encoding="utf-8")
    left_out = text.replace('regions = ["shaft", "nose", "lower inner ring", "upper inner ring"]\nmoves', 'regions = ["shaft", "lower inner ring", "upper inner ring"]\nmoves')
    assert left_out != text
    assert massless(text, tmp_path, capsys) == []
    [words] = massless(left_out, tmp_path, capsys)
    spindle = load(tmp_path)
    nose = spindle.region("nose")
    mass = spindle.materials[nose.material].density * np.pi * (nose.r[1] ** 2 - nose.r[0] ** 2) * (nose.z[1] - nose.z[0])
    assert f"'nose' ({mass:.3g} kg), rotating; regions of a body, or mass_regions of a shaft, may name it" in words
    standing = text.replace('regions = ["housing", "lower outer ring", "upper outer ring"]\nmoves', 'regions = ["housing", "lower outer ring"]\nmoves')
    assert "'upper outer ring' (" in massless(standing, tmp_path, capsys)[0]
    grounded = standing.replace('outer_body = "housing"', 'outer_body = "ground"')
    assert grounded != standing != text
    assert massless(grounded, tmp_path, capsys) == []


def test_regions_that_a_shaft_is_of_or_carries_have_their_mass(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = SCENES["five_bearing"].read_text(encoding="utf-8")
    drawn = re.sub(r"^(outer_mm|bore_mm) = .*\n", "", text, count=2, flags=re.MULTILINE)
    regions = [r for r in tomllib.loads(text)["section"]["regions"] if r["part"] == "rotating"]
    bends, carried = ([r["name"] for r in regions if (r.get("role") == "shaft") == own] for own in (True, False))

    def of_regions(**keys: list[str]) -> str:
        told = "".join(f"{key} = {json.dumps(names)}\n" for key, names in keys.items())
        return drawn.replace('name = "spindle"\nmaterial = "steel"\n', f'name = "spindle"\n{told}', 1)

    assert massless(text, tmp_path, capsys) == []
    assert massless(of_regions(regions=bends, mass_regions=carried), tmp_path, capsys) == []
    [words] = massless(of_regions(regions=bends), tmp_path, capsys)
    assert re.findall(r"'([^']+)' \(", words) == carried
    [words] = massless(of_regions(regions=bends, mass_regions=carried[1:]), tmp_path, capsys)
    assert re.findall(r"'([^']+)' \(", words) == carried[:1]


def critical_words(text: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> list[str]:
    (folder / "spindle.toml").write_text(text, encoding="utf-8")
    return [words for words in checked(folder, capsys)["odd"] if words.startswith("a natural frequency of")]


def test_unbalance_is_told_to_drive_what_whirls_with_the_rotor(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """In supports that are alike in all directions it does nothing to the backward mode at that
    speed; in others to both, each by its share."""
    text = SCENES["rotor"].read_text(encoding="utf-8").replace("nominal_speed_rpm = 4000.0", "nominal_speed_rpm = 7200.0")
    (tmp_path / "spindle.toml").write_text(text, encoding="utf-8")
    point = operating_point(load(tmp_path), Condition(20.0, 7200 * RPM))
    pair = [m for m in point.modes if abs(m.frequency / 120.0 - 1) < 0.05]
    assert [m.whirl for m in pair] == ["backward", "forward"]
    [told] = critical_words(text, tmp_path, capsys)
    m, omega = matrices(point.chain), 2 * np.pi * pair[1].frequency
    force = 5e-6 * (7200 * RPM) ** 2 * motion_rows(point.chain, "disc", (0.0, 0.0, 0.225))[:2].T @ [1, -1j]  # 5 g mm, whirling forward
    moved = np.linalg.solve(m.stiffness + 1j * omega * m.damping - omega**2 * m.mass, force)
    micrometres = re.search(r"5 g mm of the scene at z = 225 mm would move that place by ([\d.]+) um in resonance", told)
    assert micrometres is not None
    assert float(micrometres[1]) == pytest.approx(1e6 * abs(motion_rows(point.chain, "disc", (0.0, 0.0, 0.225))[0] @ moved), rel=0.01)
    assert told.startswith(f"a natural frequency of {pair[1].frequency:.0f} Hz lies at the nominal speed of 7200 rpm and whirls with the rotor: unbalance drives it; 5 g mm of the scene at z = 225 mm")

    apart = text.replace("radial_stiffness_N_per_um = 20.0   # in every direction across the axis\naxial_stiffness_N_per_um = 5.0 ", "matrix_SI = [[2e7, 0, 0, 0, 0], [0, 1.2e7, 0, 0, 0], [0, 0, 5e6, 0, 0], [0, 0, 0, 0, 0], [0, 0, 0, 0, 0]] ")
    assert apart != text
    both = critical_words(apart, tmp_path, capsys)
    assert "whirls mostly against the rotor: unbalance drives it by 22 % of the modal force; 5 g mm of the scene" in both[0]
    assert "whirls mostly with the rotor: unbalance drives it by 78 % of the modal force; 5 g mm of the scene" in both[1]
    assert len(both) == 2


def test_how_far_unbalance_moves_a_mode_is_what_the_running_rotor_does_there(tmp_path: Path) -> None:
    """At the critical speed all other modes add little to the one."""
    text = SCENES["rotor"].read_text(encoding="utf-8")
    (tmp_path / "spindle.toml").write_text(text, encoding="utf-8")
    spindle = load(tmp_path)
    speed = 7200 * RPM
    for _ in range(6):  # to where the forward mode stands at the speed
        point = operating_point(spindle, Condition(20.0, speed))
        [found] = criticals(point, 0.05)
        speed = 2 * np.pi * found.mode.frequency
    row = motion_rows(point.chain, "disc", (0.0, 0.0, 0.225))[0]
    assert found.of_scene
    assert found.sense == pytest.approx(1.0, abs=1e-6)
    assert found.moved == pytest.approx(float(np.abs(response(point, harmonics(point)) @ row)[0]), rel=0.01)


def test_no_catalogue_of_the_shipped_bearings_is_odd(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert not [words for words in checked(SCENES["five_bearing"], capsys)["odd"] if "catalogue" in words]
