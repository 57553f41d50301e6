"""Static answers along the axis and the other way across it, against springs in series and in parallel and balls worked out by hand."""

from __future__ import annotations

import json
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.sim.running.test_two_rotors import TEXT as TWO_ROTORS
from thermospindle.cli import main
from thermospindle.model.bearing.pair import solve
from thermospindle.model.bearing.row import reference_motion
from thermospindle.model.machine import Condition, RadialLoad
from thermospindle.model.rotor.chain import motion_rows, rotor_base
from thermospindle.model.rotor.loaded import loaded, motion
from thermospindle.model.rotor.static import around
from thermospindle.model.scene.reading import build

FILE = ROOT / "tests" / "scenes" / "symmetric" / "spindle.toml"


def of_a_row(spindle, b) -> float:
    """Axial stiffness (N/m) of a preloaded row: dF/dz of F = Z Q(s) sin(angle) with s the distance
    of the groove centres, Z (Q' sin^2 + Q cos^2 / s)."""
    row = spindle.bearing(b.name)
    force = row.preload / (row.balls * np.sin(row.contact_angle))
    slope = 1.5 * force / b.deformation  # Q is as deformation^1.5
    distance = (row.inner_conformity + row.outer_conformity - 1) * row.ball_diameter + b.deformation
    return row.balls * (slope * np.sin(row.contact_angle) ** 2 + force * np.cos(row.contact_angle) ** 2 / distance)


def test_along_the_axis_bearings_are_in_parallel_and_what_holds_them_in_series(capsys: pytest.CaptureFixture[str]) -> None:
    """The hub on two rows, flange, plate and mount."""
    assert main(["static", str(FILE.parent), "--json"]) == 0
    points = json.loads(capsys.readouterr().out)["points"]
    spindle = build(tomllib.loads(FILE.read_text(encoding="utf-8")), FILE)
    still = {b.name: reference_motion(20.0) for b in spindle.bearings}
    rows = sum(of_a_row(spindle, b) for b in solve(spindle, Condition(20.0), still).bearings)
    base = 1 / 6.7484e7 + 1 / 7.1734e6
    for name, compliance in (("hub_side0", base + 1 / 3.3750e6 + 1 / rows), ("hub_top0", base + 1 / 3.3750e6 + 1 / rows), ("seat0", base), ("base", 1 / 6.7484e7)):
        assert points[name]["axial"]["direction"] == "+Z"
        assert points[name]["axial"]["stiffness_N_per_m"] == pytest.approx(1 / compliance, rel=1e-6), name
    assert list(points["hub_side0"]["axial"]["reactions_N"].values()) == pytest.approx([-0.5, -0.5], rel=1e-6)
    assert points["hub_top0"]["stiffness_N_per_m"] < 0.8 * points["hub_top0"]["axial"]["stiffness_N_per_m"]  # the point itself lies off the axis, and tilts
    assert points["hub_top0"]["across"] is None
    assert (points["hub_side0"]["across"]["direction"], points["hub_side90"]["across"]["direction"]) == ("+Y", "+X")


def test_a_shaft_shares_an_axial_force_as_its_bearings_and_pieces_are_stiff(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Bearings to the ground of 2e7 and 6e7 N/m along the axis, each behind a piece of a bar, E A /
    l, in parallel; the disc's seat in series."""
    assert main(["new", "rotor", "--like", "rotor", "--out", str(tmp_path / "rotor")]) == 0
    file = tmp_path / "rotor" / "spindle.toml"
    along = iter((2e7, 6e7))
    numbers = re.sub(
        r"^radial_stiffness_N_per_um = 20.*\n(axial_stiffness.*\n)?",
        lambda _: f"matrix_SI = [[1e8, 0, 0, 0, 0], [0, 4e7, 0, 0, 0], [0, 0, {next(along):g}, 0, 0], [0, 0, 0, 0, 0], [0, 0, 0, 0, 0]]\n",
        file.read_text(encoding="utf-8"),
        flags=re.MULTILINE,
    )
    file.write_text(numbers, encoding="utf-8")
    capsys.readouterr()
    assert main(["static", str(file.parent), "--bearings", "computed", "--json"]) == 0
    points = json.loads(capsys.readouterr().out)["points"]
    bar = 208e9 * np.pi * 0.015**2
    left, right = 1 / (1 / 2e7 + 0.195 / bar), 1 / (1 / 6e7 + 0.345 / bar)
    axial = points["disc"]["axial"]
    assert axial["stiffness_N_per_m"] == pytest.approx(1 / (1 / (left + right) + 1 / 5e8), rel=1e-9)
    assert axial["reactions_N"] == pytest.approx({"left": -left / (left + right), "right": -right / (left + right)}, rel=1e-9)
    assert sum(axial["compliance_shares"].values()) == pytest.approx(1.0, rel=1e-12)
    assert points["disc"]["across"]["stiffness_N_per_m"] == pytest.approx(points["disc_y"]["stiffness_N_per_m"], rel=1e-12)
    assert points["disc"]["across"]["stiffness_N_per_m"] < 0.99 * points["disc"]["stiffness_N_per_m"]
    assert main(["static", str(file.parent), "--bearings", "computed"]) == 0
    rows = [line.split()[:2] for line in capsys.readouterr().out.split("Share")[0].splitlines() if re.match(r"(disc|middle|end)", line)]
    assert rows == [["disc", "+X"], ["disc", "axis"], ["disc_y", "+Y"], ["middle", "+X"], ["middle", "+Y"], ["middle", "axis"], ["end", "+X"], ["end", "+Y"], ["end", "axis"]]


def test_bearings_given_by_numbers_lie_between_what_they_connect(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An intershaft bearing of 5 N/um to a drum on 10 N/um: at the drum the two rotors' springs
    share the force, however bearings are taken; the drum is no ground."""
    (tmp_path / "spindle.toml").write_text(TWO_ROTORS.replace('table = "rear.csv"', "radial_stiffness_N_per_um = 30.0"), encoding="utf-8")
    answers = {}
    for words in ([], ["--bearings", "computed"], ["--bearings", "rated"]):
        assert main(["static", str(tmp_path), "--json", *words]) == 0
        answers[" ".join(words)] = json.loads(capsys.readouterr().out)
    assert answers[""]["bearings"] == "computed"
    for point in ("tip", "drum"):
        own = answers[""]["points"][point]
        assert abs(own["reactions_N"]["between"]) > 1e-3
        assert own["stiffness_N_per_m"] == answers["--bearings computed"]["points"][point]["stiffness_N_per_m"]
    # of standing bearings given by numbers, to ground as they are here, nothing else is rated
    assert answers["--bearings rated"]["points"]["tip"]["stiffness_N_per_m"] == pytest.approx(answers[""]["points"]["tip"]["stiffness_N_per_m"], rel=1e-9)


def test_across_a_radial_load_a_little_more_load_moves_the_nose_by_the_compliance_told() -> None:
    """The bearings are as stiff in no two directions then."""
    file = ROOT / "scenes" / "five_bearing" / "spindle.toml"
    spindle = build(tomllib.loads(file.read_text(encoding="utf-8")), file)
    nose = next(p for p in spindle.points if p.name == "nose")
    pushed = replace(spindle, radial_loads=(RadialLoad((2000.0, 0.0), nose.position[2]),))
    still = {b.name: reference_motion(spindle.reference_temperature) for b in spindle.ringed}
    state = solve(pushed, Condition(spindle.reference_temperature), still)
    found = around(pushed, rotor_base(pushed, loaded(pushed, state)), nose)
    assert found.across is not None
    moved = [motion(replace(pushed, radial_loads=(RadialLoad((2000.0, y), nose.position[2]),)), state) for y in (-1.0, 1.0)]
    chain = moved[0][0]
    y = motion_rows(chain, nose.body, nose.position)[1]
    assert float(y @ (moved[1][1] - moved[0][1]) / 2) == pytest.approx(1 / found.across.stiffness, rel=1e-5)
    level = around(spindle, rotor_base(spindle, state), nose)  # the mount alone tells x from y
    assert level.across is not None
    ratio = (found.own.stiffness / found.across.stiffness) / (level.own.stiffness / level.across.stiffness)
    assert abs(ratio - 1) > 1e-3


def test_a_static_answer_asks_for_no_mass(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of a shaft without mass, as in textbooks, on a stiff seat; by hand 1 / (a^2 b^2 / (3 E I L) +
    bearings, left b / L and right a / L of the force on 2e7 N/m each + seat)."""
    text = (ROOT / "scenes" / "templates" / "rotor.toml").read_text(encoding="utf-8")
    changes = ("density_kg_per_m3 = 7850.0", "density_kg_per_m3 = 1.0"), ("longest_element_mm", 'beam = "euler-bernoulli"\nlongest_element_mm')
    stiff = (("lateral_stiffness_N_per_m = [5.0e8, 5.0e8]", "lateral_stiffness_N_per_m = [1e10, 1e10]"), ("[2.0e5, 2.0e5]", "[1e8, 1e8]"))
    for old, new in (*changes, *stiff):
        text = text.replace(old, new, 1)
    (tmp_path / "spindle.toml").write_text(text, encoding="utf-8")
    assert main(["static", str(tmp_path), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)["points"]["disc"]
    a, b = 0.195, 0.345
    bent = a**2 * b**2 / (3 * 208e9 * np.pi * 0.03**4 / 64 * (a + b))
    compliance = bent + ((b / (a + b)) ** 2 + (a / (a + b)) ** 2) / 2e7 + 1e-10
    assert answer["stiffness_N_per_m"] == pytest.approx(1 / compliance, rel=1e-6)
    assert answer["reactions_N"] == pytest.approx({"left": -b / (a + b), "right": -a / (a + b)}, rel=1e-6)
    assert main(["check", str(tmp_path), "--json"]) == 0
    assert not any("nothing holds" in words for words in json.loads(capsys.readouterr().out)["odd"])


def test_a_preload_spring_is_told_by_its_name_where_it_gives(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Beside the bearings stood a column "bearings" of zeros: the share of a spring that acts along
    the axis alone. A point along it has some."""
    scene = (ROOT / "scenes" / "templates" / "grinding.toml").read_text(encoding="utf-8").replace("# preload_rate", "preload_rate").replace("# sprung_ring", "sprung_ring")
    file = tmp_path / "spindle.toml"
    for text, named in ((scene, False), (scene.replace('direction = "+Y"', 'direction = "+Z"', 1), True)):
        file.write_text(text, encoding="utf-8")
        assert main(["static", str(tmp_path)]) == 0
        said = capsys.readouterr().out.split("Share")[1]
        assert ("preload springs" in said, "bearings" in said) == (named, False)
        assert main(["static", str(tmp_path), "--json"]) == 0
        points = json.loads(capsys.readouterr().out)["points"]
        assert any(row["compliance_shares"]["bearings"] > 5e-4 for row in points.values()) is named
