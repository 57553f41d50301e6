"""Repeatable is what repeats every revolution of the part that a probe sees: a geared part moves as
one without gears that turns as fast, and is told the same."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.model.test_carrier import TEXT
from tests.mounting import geared
from thermospindle.cli import main
from thermospindle.model.bearing.kinematics import Line
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.report.text.runout import _write_repeatable, runout_json, runout_section
from thermospindle.sim.operating import operating_point
from thermospindle.sim.resonance.map import resonance_map
from thermospindle.sim.resonance.point import Exact, nrro_rms
from thermospindle.sim.running.lines import MOST_WHOLE, find_lines
from thermospindle.sim.running.probes import X
from thermospindle.sim.running.runout import analyse, runout, whole_turns
from thermospindle.sim.running.steady import steady_runout

SPEED = 7200 * RPM
RATIOS = [0.5, 2.0, -0.5, -1.0, 1 / 3]


def at(spindle, ratio=1.0):
    """The point at which the hub turns at `SPEED`."""
    return operating_point(geared(spindle, ratio), Condition(40.0, SPEED / ratio))


@pytest.fixture(scope="module")
def direct(imperfect):
    return runout(at(imperfect), path="linear")


@pytest.mark.parametrize("ratio", RATIOS)
def test_a_geared_hub_has_the_runout_of_one_without_gears(imperfect, direct, ratio):
    point = at(imperfect, ratio)
    assert whole_turns(point) == direct.averaged.count
    found = runout(point, path="linear")
    assert found.averaged.count == direct.averaged.count
    for averaged in (False, True):
        for name, m in found.values(averaged).items():
            for key, value in vars(direct.values(averaged)[name]).items():
                assert getattr(m, key) == pytest.approx(value, rel=1e-5, abs=1e-14), (name, key)
    assert found.leaked == pytest.approx(direct.leaked, rel=1e-4, abs=1e-15)
    assert [g.repeatable for g in found.lines] == [g.repeatable for g in direct.lines]
    assert any(g.repeatable for g in found.lines)
    assert [g.order for g in found.lines] == pytest.approx([abs(ratio) * g.order for g in direct.lines], rel=1e-9)  # of the spindle


@pytest.mark.parametrize("ratio", RATIOS)
def test_so_it_has_in_the_steady_state_and_in_the_nrro_of_a_map(imperfect, ratio):
    for name, m in steady_runout(at(imperfect, ratio)).items():
        expected = steady_runout(at(imperfect))[name]
        assert (m.repeatable, m.six_sigma) == pytest.approx((expected.repeatable, expected.six_sigma), rel=1e-9, abs=1e-15)
    assert nrro_rms(Exact(at(imperfect, ratio), {}, {}, 3)) == pytest.approx(nrro_rms(Exact(at(imperfect), {}, {}, 3)), rel=1e-9)


def test_a_simulated_record_repeats_as_the_part_turns(imperfect):
    point = at(imperfect, 0.5)
    simulated, linear = (runout(point, 0.2, path=path) for path in ("simulated", "linear"))
    assert simulated.averaged.count == linear.averaged.count == 24
    [first] = [g for g in simulated.lines if g.causes and g.causes[0].cause == "unbalance"]
    assert (first.repeatable, first.order) == (True, pytest.approx(0.5))
    assert simulated.values()[X].repeatable == pytest.approx(linear.values()[X].repeatable, rel=1e-3)


def test_a_record_of_less_than_two_revolutions_of_the_part_is_refused(imperfect):
    with pytest.raises(BadInput, match=r"--seconds 0.03: at 1800 rpm the record needs at least two revolutions of the hub, 0.0667 s"):
        runout(operating_point(geared(imperfect, 0.25), Condition(40.0, SPEED)), 0.03, path="linear")


def test_what_is_written_says_whose_revolutions_and_whose_orders(imperfect, direct):
    found = runout(at(imperfect, 0.5), path="linear")
    answer = runout_json(found, "linear", "linear", None)
    assert (answer["speed_rpm"], answer["seen_speed_rpm"]) == pytest.approx((14400, 7200))
    assert answer["seconds"] == pytest.approx(direct.averaged.count / 120)
    assert "revolutions of the hub (it turns at 7200 rpm) at" in runout_section(found, answer)[1]
    plain_answer = runout_json(direct, "linear", "linear", None)
    assert "orders are those of the spindle" not in runout_section(direct, plain_answer)[1]
    assert "of the hub (" not in runout_section(direct, plain_answer)[1]


# ---------------------------------------------------------------- two parts in one machine


@pytest.fixture
def made(tmp_path):
    """A shaft, at which the hub's probes look, a sleeve about it at -0.5 of its speed, and a
    bearing between them; an unbalance on one of them."""

    def scene(part, ratio=1.0):
        text = TEXT.format(z=220.0, part=f'unbalance_body = "{part}"', element=40.0, unbalance=5.0, load="")
        text = text.replace('z_mm = 290.0, inner_body = "sleeve"', 'z_mm = 290.0, inner_body = "sleeve", outer_body = "shaft"')
        text = text.replace('name = "shaft"\nmaterial', f'name = "shaft"\nspeed_ratio = {ratio}\nmaterial')
        text = text.replace("speed_ratio = -0.5", f"speed_ratio = {-ratio / 2}").replace("turns = true }", f"turns = true, speed_ratio = {ratio} }}")
        (tmp_path / "spindle.toml").write_text(text, encoding="utf-8")
        return load(tmp_path)

    return scene


def test_every_probe_goes_by_the_part_that_it_sees(made, tmp_path):
    """The sleeve's unbalance repeats for the sleeve at every revolution, for the shaft at every
    other one; the shaft's repeats for both, twice in one of the sleeve's."""
    point = operating_point(made("sleeve"), Condition(20.0, 6000 * RPM))
    first = runout(point, 0.5, path="linear")
    rounded = analyse(point, replace(first.signals, angle=first.signals.angle * (1 + 1e-8)))  # as a simulation holds its speed
    for found in (first, rounded):
        values = found.values()
        on_shaft, on_sleeve = values["1 shaft"], values["2 sleeve"]
        size = {name: np.ptp(found.signals.of(name)) for name in ("1 shaft", "2 sleeve")}
        assert on_sleeve.repeatable == pytest.approx(size["2 sleeve"], rel=1e-3)
        assert on_sleeve.nonrepeatable < 1e-3 * on_sleeve.repeatable
        assert on_sleeve.eccentricity == pytest.approx(on_sleeve.repeatable / 2, rel=1e-3)
        assert on_shaft.repeatable < 1e-3 * on_shaft.nonrepeatable
        assert on_shaft.nonrepeatable == pytest.approx(size["1 shaft"], rel=1e-3)
        assert found.values(averaged=True)["2 sleeve"].repeatable == pytest.approx(on_sleeve.repeatable, rel=1e-3)
        assert [found.cut_of(i).count for i in range(len(found.signals.probes))] == [50, 50, 50, 50, 25]
    _write_repeatable(found, tmp_path / "repeatable.csv")
    table = np.genfromtxt(tmp_path / "repeatable.csv", delimiter=",", names=True)
    assert np.ptp(table["2_sleeve_rro_um"]) == pytest.approx(1e6 * on_sleeve.repeatable, rel=1e-6)

    found = runout(operating_point(made("shaft"), Condition(20.0, 6000 * RPM)), 0.5, path="linear")
    shaft = found.values()["1 shaft"]
    assert shaft.nonrepeatable < 1e-6 * shaft.repeatable
    cut = found.cut_of(0)
    assert cut.count == 50
    assert [g.repeatable for g in found.lines] == [True]


def test_the_terminal_names_the_part_where_it_is_not_the_spindle(made, capsys):
    scene = made("sleeve", 0.8)
    assert main(["runout", str(scene.file), "--speed", "6000", "--path", "linear"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "revolutions of the shaft (it turns at 4800 rpm), um" in said
    assert "orders of" in said
    assert "0.400" in said  # of the spindle's 6000 rpm, not of the shaft's 4800
    assert main(["runout", str(scene.file), "--speed", "6000", "--path", "linear", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["probes"]["2 sleeve"]["seen_speed_rpm"] == pytest.approx(-2400)
    assert answer["probes"]["2 sleeve"]["rro_um"] > 0
    assert answer["rro_um"]["radial"] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("part", "repeats"), [("shaft", True), ("sleeve", False)])
@pytest.mark.parametrize("ratio", [1.0, 0.5])
def test_where_a_line_of_a_map_repeats_it_is_left_out_of_nrro(made, part, ratio, repeats):
    """Through the shaft's first critical speed."""
    speeds = np.array([0.0, 6000.0, 20000.0, 40000.0]) * RPM / ratio
    found = resonance_map(made(part, ratio), [20.0, 30.0], speeds, Condition(20.0, 6000 * RPM / ratio), highest=600.0)
    assert found.coincidences
    assert {c.repeats for c in found.coincidences} == {repeats}
    assert {c.nrro == 0.0 for c in found.coincidences} == {repeats}
    assert (found.nrro_speed[:, 1].max() == 0.0) == repeats


# ---------------------------------------------------------------- lines


def test_of_a_slow_part_some_multiples_are_looked_for_and_those_of_theory():
    """A part at a thousandth of the spindle's speed has no ten thousand lines; one of theory at its
    1500th multiple, but for rounding, repeats."""
    time = np.arange(40000) / 10000
    known = [Line("", "unbalance", 0, "1x", "radial", 1, f) for f in (1.0, 1500.0 * (1 + 1e-9), 1500.5)]
    size = np.array([[1.0, -1.0j, 0.0], [0.5, -0.5j, 0.0], [0.25, -0.25j, 0.0]])
    value = sum(np.real(s[:, None] * np.exp(2j * np.pi * line.frequency * time)) for line, s in zip(known, size, strict=True))
    found, best = find_lines(time, value, 1000.0, known, size, np.array([1.0]))
    assert [(round(g.frequency, 3), g.repeatable) for g in found] == [(1.0, True), (1500.0, True), (1500.5, False)]
    assert [g.order for g in found] == pytest.approx([1e-3, 1.5, 1.5005])
    assert len(best.frequency) == MOST_WHOLE + 2


def test_a_report_names_every_bearing_of_a_line(imperfect):
    """At 20 C both rows have the same cage frequency: one line of both."""
    point = operating_point(imperfect, Condition(20.0, SPEED))
    found = runout(point, path="linear")
    answer = runout_json(found, "linear", "linear", None)
    [cage] = [g for g in answer["lines"] if g["name"] == "fc"]
    names = [c["bearing"] for c in cage["causes"]]
    assert sorted(names) == ["lower", "upper"]
    assert f"{', '.join(names)} ball size" in runout_section(found, answer)[1]
