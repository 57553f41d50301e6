"""`spindle check`: what is understood of a scene, what is assumed, what is odd, and its picture."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib.patches import Rectangle

from tests.conftest import ROOT
from tests.report.checked import SCENES, checked, without
from thermospindle.cli import main
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.report.check.drawing import drawing
from thermospindle.report.check.understood import arrangement
from thermospindle.report.check.words import of_words
from thermospindle.sim.operating import operating_point


@pytest.mark.parametrize("name", SCENES)
def test_words_and_picture_name_every_part(name: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["check", str(SCENES[name]), "--out", str(tmp_path / "c")]) == 0
    said = capsys.readouterr().out
    values = json.loads((tmp_path / "c" / "check.json").read_text(encoding="utf-8"))
    page = (tmp_path / "c" / "check.html").read_text(encoding="utf-8")
    picture = (tmp_path / "c" / "section.svg").read_text(encoding="utf-8")
    for part in (*values["bearings"], *values["shafts"], *values["bodies"], *values["points"]):
        assert part in said
        assert part in page
        assert part in picture
    assert (tmp_path / "c" / "section.png").stat().st_size > 10_000
    assert "…" not in said


def test_the_set_of_five_bearings_is_understood(capsys: pytest.CaptureFixture[str]) -> None:
    found = checked(SCENES["five_bearing"], capsys)
    assert found["parts"] == {"turning": ["spindle"], "standing": ["housing"]}
    assert found["sets"]["front"]["arrangement"] == "two against one, back-to-back"
    assert found["sets"]["rear"]["arrangement"] == "back-to-back"
    front3, free = found["bearings"]["front3"], 15.0
    assert front3["free_contact_angle_deg"] == pytest.approx(free, abs=1e-6)
    assert found["shafts"]["spindle"]["mass_kg"] == pytest.approx(10.66, abs=0.005)  # machines of others: 10.66 kg
    # back-to-back load lines meet the axis outside the set, half the pitch circle times the tangent of the angle away
    for name, sense in (("front1", -1), ("front3", 1)):
        b = found["bearings"][name]
        reach = b["pitch_diameter_mm"] / 2 * np.tan(np.radians(b["contact_angle_deg"]))
        assert b["load_lines_meet_axis_at_mm"] == pytest.approx(b["z_mm"] + sense * reach, abs=1e-5)


def test_the_mass_of_a_sensor_is_told_at_its_point(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """And its body is as much heavier."""
    text = (ROOT / "scenes" / "hdd_2003" / "spindle.toml").read_text(encoding="utf-8")
    plain, heavy = tmp_path / "plain.toml", tmp_path / "heavy.toml"
    plain.write_text(text, encoding="utf-8")
    heavy.write_text(text.replace('direction = "+X"', 'direction = "+X"\nsensor_mass_g = 1.5', 1), encoding="utf-8")
    without_one, told = (checked_json(scene, capsys) for scene in (plain, heavy))
    assert sorted(p["sensor_mass_g"] for p in told["points"].values())[-2:] == [0.0, 1.5]
    assert {p["sensor_mass_g"] for p in without_one["points"].values()} == {0.0}
    assert sum(b["mass_kg"] for b in told["bodies"].values()) - sum(b["mass_kg"] for b in without_one["bodies"].values()) == pytest.approx(1.5e-3, rel=1e-6)


def checked_json(scene: Path, capsys: pytest.CaptureFixture[str]) -> dict:
    assert main(["check", str(scene), "--json"]) == 0
    return dict(json.loads(capsys.readouterr().out))


def test_gears_and_rings_that_do_not_grow_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(SCENES["five_bearing"])]) == 0
    assert "Rings do not grow by their own rotation; the effect ring_growth takes that in." in " ".join(capsys.readouterr().out.split())
    text = SCENES["rotor"].read_text(encoding="utf-8")
    assert text.count("turns = true") == 2  # the shaft, and its disc
    (tmp_path / "spindle.toml").write_text(text.replace("turns = true", "turns = true\nspeed_ratio = -1.5"), encoding="utf-8")
    assert main(["check", str(tmp_path)]) == 0
    assert "(at -1.5 times the spindle's speed)" in " ".join(capsys.readouterr().out.split())


def test_the_key_names_what_is_in_the_picture() -> None:
    """A shaft on bearings given by numbers has nothing that stands, no rigid body and no joint; a machine in its housing has them."""
    words = {}
    for name in ("mk7702", "five_bearing"):
        [key] = drawing(operating_point(load(SCENES[name]), Condition(20.0))).legends
        words[name] = {t.get_text() for t in key.get_texts()}
    assert words["five_bearing"] - words["mk7702"] == {"stands", "load line", "centre of mass", "joint"}
    assert words["mk7702"] - words["five_bearing"] == {"bearing by numbers"}


def test_a_body_that_turns_and_is_in_no_section_is_drawn_as_a_cylinder(tmp_path: Path) -> None:
    """A steel disc of 171 mm and 17 mm width: m = rho pi r^2 l, I_z = m r^2 / 2, I_x = m (3 r^2 + l^2) / 12."""
    r, length = 0.0855, 0.017
    m = 7850 * np.pi * r**2 * length
    across = m * (3 * r**2 + length**2) / 12
    text = SCENES["rotor"].read_text(encoding="utf-8")
    for key, value in (("mass_kg = 3.0 ", f"mass_kg = {m} "), ("[6.0e-3, 6.0e-3]", f"[{across}, {across}]"), ("polar_inertia_kg_m2 = 1.1e-2", f"polar_inertia_kg_m2 = {m * r**2 / 2}")):
        text = text.replace(key.rstrip(), value.rstrip(), 1)
    (tmp_path / "spindle.toml").write_text(text, encoding="utf-8")
    [axes] = drawing(operating_point(load(tmp_path), Condition(20.0))).axes
    [box] = [p for p in axes.patches if isinstance(p, Rectangle) and p.get_linestyle() != "-" and p.get_linestyle() != "solid"]
    assert (box.get_x() + box.get_width() / 2, box.get_y(), box.get_width(), box.get_height()) == pytest.approx((225.0, 0.0, 17.0, 85.5), abs=1e-6)
    assert f"disc, {m:.3g} kg" in {t.get_text() for t in axes.texts}
    assert axes.get_ylim()[1] > 85.5
    for name in ("five_bearing", "hdd_2003"):  # what turns is drawn there already, and the section shows what stands
        [axes] = drawing(operating_point(load(SCENES[name]), Condition(20.0))).axes
        assert not any(" kg" in t.get_text() for t in axes.texts)


def test_no_leader_runs_through_a_name() -> None:
    """Of every scene: each piece of a leader stays out of the boxes in which the names stand."""
    for scene in SCENES.values():
        [axes] = drawing(operating_point(load(scene), Condition(20.0))).axes
        figure = axes.figure
        figure.canvas.draw()
        boxes = np.array([t.get_window_extent().padded(-1.0).extents for t in axes.texts if t.get_text()])
        leaders = [line for line in axes.lines if line.get_linewidth() == 0.5]
        assert len(leaders) == len(boxes) > 0
        for line in leaders:
            drawn = axes.transData.transform(line.get_xydata())
            for a, b in pairwise(drawn):
                if np.isfinite([a, b]).all():
                    on_it = a + np.linspace(0, 1, 400)[:, None] * (b - a)
                    inside = (boxes[:, None, :2] <= on_it) & (on_it <= boxes[:, None, 2:])
                    assert not inside.all(axis=2).any(), scene


def test_a_load_line_passes_the_ball_and_ends_on_the_axis() -> None:
    point = operating_point(load(SCENES["five_bearing"]), Condition(20.0))
    [axes] = drawing(point).axes
    lines = [np.array(line.get_xydata()) for line in axes.lines if len(line.get_xydata()) == 2 and line.get_ydata()[0] > 0 == line.get_ydata()[1]]
    assert len(lines) == 5
    for b, line in zip(point.spindle.bearings, lines, strict=True):
        outer, end = line
        assert end[1] == 0.0
        share = (outer[1] - b.pitch_diameter * 500) / (outer[1] - end[1])
        assert outer[0] + share * (end[0] - outer[0]) == pytest.approx(b.z * 1e3, abs=1e-9)
        angle = np.arctan2(abs(end[0] - outer[0]), outer[1] - end[1])
        assert angle == pytest.approx(point.state.bearing(b.name).contact_angle, abs=1e-12)
        assert np.sign(end[0] - outer[0]) == b.sense


@pytest.mark.parametrize(
    ("senses", "words"),
    [
        ("-", "single"),
        ("-+", "back-to-back"),
        ("+-", "face-to-face"),
        ("--", "two in tandem"),
        ("--+", "two against one, back-to-back"),
        ("++--", "two against two, face-to-face"),
        ("---+", "three against one, back-to-back"),
        ("-+-", "two against one, mixed"),
    ],
)
def test_arrangements_have_their_names(senses: str, words: str) -> None:
    from dataclasses import replace

    b = load(SCENES["five_bearing"]).bearings[0]
    rows = [replace(b, z=0.01 * k, sense=1 if s == "+" else -1) for k, s in enumerate(senses)]
    assert arrangement(rows[::-1]) == words


def test_defaults_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    told = {a["key"]: a["what"] for a in checked(SCENES["five_bearing"], capsys)["assumed"]}
    assert told["hammer_test.step_us"] == "chosen by the program"
    assert "timoshenko" in told["shafts.spindle.beam"]
    assert "thermal.convection" not in told
    assert "bearing_pair.ball_inertia" not in told
    pair = {a["key"]: a["what"] for a in checked(SCENES["hdd"], capsys)["assumed"]}
    assert pair["bearing_pair.ball_inertia"] == "0, balls without inertia: no centrifugal force and no gyroscopic moment"
    assert not any(key.startswith("thermal") for key in {a["key"] for a in checked(SCENES["free_shaft"], capsys)["assumed"]})


def test_columns_with_dashes_are_of_numbers_and_an_empty_list_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = [["front", "-", "-z", ""], ["rear", "200", "+z", "-1.5e+09, 2"]]
    assert [of_words(rows, k) for k in range(4)] == [True, False, True, False]
    text = SCENES["hdd_2003"].read_text(encoding="utf-8")
    (tmp_path / "spindle.toml").write_text(text.replace("preload_N = 16.0", "preload_N = 16.0\nball_inertia = 0.0"), encoding="utf-8")
    assert main(["check", str(tmp_path)]) == 0
    assert "Assumed, where the scene says nothing:\n  - nothing" in capsys.readouterr().out


def test_several_loads_and_the_weight_of_a_spindle_that_lies(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    loads = "gravity_m_per_s2 = [0.0, -9.81]\nradial_load_N = [300.0, -100.0]\nradial_load_z_mm = 0.0\n"
    belt = "[[radial_loads]]\nforce_N = [0.0, 250.0]\nz_mm = 400.0\n\n[materials"
    text = SCENES["five_bearing"].read_text(encoding="utf-8").replace("ball_inertia = 1.0", f"ball_inertia = 1.0\n{loads}").replace("[materials", belt, 1)
    (tmp_path / "spindle.toml").write_text(text, encoding="utf-8")
    found = checked(tmp_path, capsys)
    assert [load["force_N"] for load in found["radial_loads"]] == [[300.0, -100.0], [0.0, 250.0]]
    assert (found["radial_load_N"], found["radial_load_z_mm"], found["gravity_m_per_s2"]) == ([300.0, 150.0], None, [0.0, -9.81])
    borne = np.sum([b["radial_force_N"] for b in found["bearings"].values()], axis=0)
    assert borne == pytest.approx([300.0, 150.0 - 9.81 * found["turning_mass_kg"]], rel=1e-6)
    assert main(["check", str(tmp_path)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "External radial loads 300, -100 N along x, y at z = 0 mm; 0, 250 N along x, y at z = 400 mm, and weight under 0, -9.81 m/s2 along x, y, borne by front1 " in said
    for wrong, why in (
        (text.replace("-9.81", "-9810.0"), "gravity_m_per_s2.2 = -9810.0: input should be greater than or equal to -20"),
        (text.replace("z_mm = 400.0\n\n[mat", "\n[mat"), "radial_loads.1.z_mm: missing, and has no default"),
        (text.replace("z_mm = 400.0\n\n[mat", 'z_mm = 400.0\nbody = "housing"\n\n[mat'), "radial_loads.1.body = 'housing': names nothing that turns"),
    ):
        (tmp_path / "spindle.toml").write_text(wrong, encoding="utf-8")
        assert main(["check", str(tmp_path)]) == 2
        assert f"{tmp_path / 'spindle.toml'}: {why}" in capsys.readouterr().err


def test_shares_of_a_radial_load_add_up(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = SCENES["five_bearing"].read_text(encoding="utf-8").replace("ball_inertia = 1.0", "ball_inertia = 1.0\nradial_load_N = [300.0, -100.0]\nradial_load_z_mm = 0.0")
    (tmp_path / "spindle.toml").write_text(text, encoding="utf-8")
    found = checked(tmp_path, capsys)
    assert found["radial_load_N"] == [300.0, -100.0]
    assert np.sum([b["radial_force_N"] for b in found["bearings"].values()], axis=0) == pytest.approx([300.0, -100.0], rel=1e-6)
    assert main(["check", str(tmp_path)]) == 0
    assert "External radial load 300, -100 N" in capsys.readouterr().out


def test_a_joint_that_differs_along_x_and_y_is_shown_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(SCENES["hdd"])]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any(line.startswith("mount") and "1.2e+04, 1.4e+04" in line for line in lines)
    assert any(line.startswith("flange") and line.split()[-3:] == ["5e+07", "5e+06", "800"] for line in lines)


@pytest.mark.parametrize(
    ("name", "points"),
    [
        ("hdd_2003", ["top_x", "top_y", "top_z", "low_x", "low_y"]),
        ("five_bearing", ["top_x", "top_y", "top_z", "low_x", "low_y"]),
        ("free_shaft", ["top_x", "low_x"]),  # it moves in one plane
    ],
)
def test_heat_tolerances_points_and_hammer_may_be_left_out(name: str, points: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = without(SCENES[name].read_text(encoding="utf-8"), "thermal", "tolerances", "measuring", "hammer_test")
    assert "[measuring" not in text
    (tmp_path / "spindle.toml").write_text(text, encoding="utf-8")
    found = checked(tmp_path, capsys)
    assert list(found["points"]) == points
    told = {a["key"]: a["what"] for a in found["assumed"]}
    assert points[0] in told["measuring.points"]
    assert told["tolerances.preload"] == "0.03"
    assert ("thermal.friction" in told) == bool(load(tmp_path).regions)
    ends = {p["position_mm"][2] for p in found["points"].values()}
    shaft = next(iter(found["shafts"].values()), None)
    assert ends == set(shaft["z_mm"] if shaft else (1.0, 20.0))  # the hub's magnet begins at 1 mm
    assert main(["static", str(tmp_path)]) == 0


def test_parts_of_the_friction_may_be_left_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = SCENES["five_bearing"].read_text(encoding="utf-8")
    assert "f1 = 0.0003" in text
    (tmp_path / "spindle.toml").write_text(text.replace("f1 = 0.0003\n", ""), encoding="utf-8")
    told = {a["key"]: a["what"] for a in checked(tmp_path, capsys)["assumed"]}
    assert told["thermal.friction.f1"] == "0.0003"
    assert "thermal.friction.f0" not in told
    assert load(tmp_path).thermal == load(SCENES["five_bearing"]).thermal


@pytest.mark.parametrize(("scene", "outer", "inner"), [("grinding", "housing", "spindle"), ("hdd", "hub", "shaft")])
def test_an_axial_load_is_told_with_its_sign_on_either_side(scene: str, outer: str, inner: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A force towards +z on what carries the outer rings takes load off rows of sense -z."""
    (tmp_path / "spindle.toml").write_text("axial_load_N = 5.0\n" + SCENES[scene].read_text(encoding="utf-8"), encoding="utf-8")
    assert main(["check", str(tmp_path)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert f"External axial load 5 N along z on {outer}, which carries the outer rings: for the bearings the same as -5 N on {inner}." in said
    found = checked(tmp_path, capsys)
    if scene == "grinding":  # its rear ring slides on the spring: the front one bears all
        assert found["bearings"]["front"]["preload_N"] == pytest.approx(175.0, rel=1e-9)


def test_bearings_given_by_numbers_bear_a_radial_load_by_the_lever_rule(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    loads = "axial_load_N = 5.0\nradial_load_N = [10.0, 0.0]\nradial_load_z_mm = 400.0\n"
    (tmp_path / "spindle.toml").write_text(loads + SCENES["rotor"].read_text(encoding="utf-8"), encoding="utf-8")
    assert main(["check", str(tmp_path)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "External axial load 5 N along z changes nothing" in said
    assert "External radial load 10, 0 N along x, y at z = 400 mm on shaft, borne by left +3.15, +0; right +6.85, +0 N; left and right, given by numbers, are as stiff under any load." in said
    found = {name: b["radial_force_N"] for name, b in checked(tmp_path, capsys)["bearings"].items()}
    right = 10.0 * (400.0 - 30.0) / (570.0 - 30.0)
    assert found["left"] == pytest.approx([10.0 - right, 0.0], abs=1e-5)
    assert found["right"] == pytest.approx([right, 0.0], abs=1e-5)


@pytest.mark.parametrize("element", [65.0, 20.0, 5.0])
@pytest.mark.parametrize("density", [1.0, 7850.0])
@pytest.mark.parametrize("beam", ["timoshenko", "euler-bernoulli"])
def test_a_light_shaft_keeps_its_modes_at_any_mesh(beam: str, density: float, element: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of a disc on a shaft nearly without mass the whirl is sqrt(k / m) / 2 pi at 151 Hz, and
    `check` counts what `modes` finds. Where rounding hides it, that is said."""
    text = SCENES["rotor"].read_text(encoding="utf-8").replace("density_kg_per_m3 = 7850.0", f"density_kg_per_m3 = {density}")
    (tmp_path / "spindle.toml").write_text(text.replace("longest_element_mm = 65.0", f'beam = "{beam}"\nlongest_element_mm = {element}'), encoding="utf-8")
    found = checked(tmp_path, capsys)
    hidden = [words for words in found["odd"] if "cannot be told from rounding" in words]
    if (beam, density, element) == ("euler-bernoulli", 1.0, 5.0):  # elements of a millionth of a gram
        [said] = hidden
        assert "3 natural frequencies below 3" in said
        return
    assert not hidden
    spindle = load(tmp_path)
    assert found["modes_Hz"] == pytest.approx([m.frequency for m in operating_point(spindle, Condition(20.0)).modes_below(1500.0)], rel=1e-3)
    assert found["modes_Hz"][0] == pytest.approx(151.0 if density == 1.0 else 120.6, rel=5e-3)


def test_a_rotor_that_stiffens_nothing_is_in_the_legend_and_under_no_name(tmp_path: Path) -> None:
    """Of a shaft of 30 mm with a rotor of 160 mm around it: its hatch ends above the names below the axis."""
    text = SCENES["rotor"].read_text(encoding="utf-8")
    (tmp_path / "spindle.toml").write_text(text.replace("# mass_outer_mm = [[30, 600]] ", "mass_outer_mm = [[30, 250], [160, 100], [30, 250]] "), encoding="utf-8")
    figure = drawing(operating_point(load(tmp_path), Condition(20.0)))
    [axes] = figure.axes
    figure.canvas.draw()
    [hatch] = [p for p in axes.patches if p.get_hatch() and p.get_window_extent().y1 <= axes.transData.transform((0, 0))[1] + 1]
    assert hatch.get_path().vertices[:, 1].min() == pytest.approx(-80.0)
    below = [t for t in axes.texts if t.get_position()[1] < 0]
    assert {"shaft", "disc"} <= {t.get_text() for t in below}
    assert all(t.get_window_extent().y1 < hatch.get_window_extent().y0 for t in below)
    entry = "mass that stiffens nothing"
    assert entry in {t.get_text() for t in figure.legends[0].get_texts()}
    assert entry not in {t.get_text() for t in drawing(operating_point(load(SCENES["rotor"]), Condition(20.0))).legends[0].get_texts()}


def test_modes_that_no_frf_shows_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Hammers across the axis excite nothing along it; one along it does, on the same spindle."""
    found = checked(SCENES["five_bearing"], capsys)
    assert [(m["kind"], round(m["frequency_Hz"])) for m in found["modes_unseen"]] == [("axial", 576), ("axial", 1131)]
    assert main(["check", str(SCENES["five_bearing"])]) == 0
    assert "No FRF of the hammer test shows 2 of them, axial 576 and axial 1131 Hz" in " ".join(capsys.readouterr().out.split())
    text = SCENES["five_bearing"].read_text(encoding="utf-8")
    assert text.count("hammer_nodes = [1, 2]") == 1
    (tmp_path / "spindle.toml").write_text(text.replace("hammer_nodes = [1, 2]", "hammer_nodes = [1, 2, 3]"), encoding="utf-8")
    assert checked(tmp_path / "spindle.toml", capsys)["modes_unseen"] == []
    assert checked(SCENES["hdd_2003"], capsys)["modes_unseen"] == []
