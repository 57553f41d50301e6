"""What a map says: what was mapped and crossed, lines that repeat every revolution, one line in
several bearings, and places of its grid that are one."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from tests.sim.resonance.conftest import NOMINAL
from thermospindle.cli import main
from thermospindle.model.bearing.kinematics import Line
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.sense import of_conditions
from thermospindle.model.units import RPM
from thermospindle.report.log.turning.map import summary
from thermospindle.report.text.resonance import SAID, map_json, map_section, mapped, nearby, sentences, show_map, told
from thermospindle.sim.resonance.found import Coincidence, Interpolated, ResonanceMap, Track
from thermospindle.sim.resonance.map import _with, resonance_map


@pytest.fixture
def crossed(met: ResonanceMap) -> Coincidence:
    return next(c for c in met.coincidences if c.at_nominal_speed)


def of_order_one(c: Coincidence, cause: str, bearing: str, strength: float) -> Coincidence:
    line = replace(c.line, cause=cause, bearing=bearing, order=1, frequency=c.condition.speed / (2 * np.pi), direction="radial")
    return replace(c, line=line, strength=strength)


def test_unbalance_is_told_by_its_own_amplitude(met, crossed):
    """NRRO leaves out whole multiples of the speed, so it says nothing of them."""
    (said,) = sentences(replace(met, coincidences=(of_order_one(crossed, "unbalance", "", 1.2241e-6),)))
    assert "it repeats every revolution (RRO), and the runout in it is 1224.1 nm zero to peak there" in said
    assert "NRRO" not in said
    (said,) = sentences(replace(met, coincidences=(crossed,)))
    assert not crossed.repeats
    assert "NRRO (nonrepeatable runout) is" in said


def test_one_wave_of_all_bearings_that_repeats_is_one_line(met, crossed):
    both = tuple(of_order_one(crossed, "inner waviness", name, 1e-9) for name in ("lower", "upper"))
    (said,) = sentences(replace(met, coincidences=both))
    assert "(inner waviness of order 1 of the lower and upper bearings)" in said
    assert "at most 2.0 nm zero to peak there" in said
    (said,) = sentences(replace(met, coincidences=tuple(replace(c, strength=0.0) for c in both)))
    assert "no imperfection here makes it" in said


def test_the_nominal_speed_is_one_place_of_the_grid():
    """120000 rpm in 40 steps meets 60000 rpm but for rounding; between two such places interpolated frequencies were off by 69 %."""
    speeds = np.linspace(0, 2 * 60000 * RPM, 41)
    nominal = np.nextafter(speeds[20], np.inf)
    assert len(_with(nominal, speeds)) == 41
    assert nominal in _with(nominal, speeds)
    assert len(_with(nominal, [0.0, 10.0])) == 3


def test_what_interpolation_is_worth_is_told_of_those_that_are_exact(met):
    console = Console(record=True, width=400, file=io.StringIO())
    show_map(console, replace(met, interpolated=Interpolated(634, 60, 3.5e-4, 0.01, 0.033)))
    text = console.export_text()
    assert "the 60 strongest tell, which are exact and were interpolated too: frequencies are off by 0.035 % at most, strengths by 3.3 %" in text


def test_a_warning_of_every_bearing_is_one(spindle):
    """Of bearings of one pitch diameter; one of another has a sentence of its own."""
    named = replace(spindle, bearings=tuple(replace(spindle.bearings[0], name=name) for name in ("front", "rear", "third")))
    other = replace(spindle.bearings[0], name="large", pitch_diameter=0.036)
    [merged] = of_conditions(named, [Condition(20.0, 400_000 * RPM)])
    assert "in the front, rear and third bearings; rolling" in merged
    merged, alone = of_conditions(replace(named, bearings=(*named.bearings, other)), [Condition(20.0, 400_000 * RPM)])
    assert "in the front, rear and third bearings; rolling" in merged
    assert "n dm of 1.44e+07 mm rev/min in the large bearing; rolling bearings end at about 2.5e+06" in alone


def test_a_shaft_that_its_own_rotation_tears_is_doubted():
    """Steel of 7800 kg/m3 bears 1 GPa as a ring at 358 m/s."""
    spindle = load("mk7702")
    radius = max(max(s.outer) for s in spindle.structure.shafts[0].segments)
    assert not of_conditions(spindle, [Condition(20.0, 300.0 / radius)])
    [said] = of_conditions(spindle, [Condition(20.0, 400.0 / radius)])
    assert "400 m/s at the largest diameter of shaft 'spindle'" in said


def test_what_is_met_just_beyond_the_speeds_asked_for_is_told(spindle):
    """20 (fo-fc) meets the axial mode at 7147 rpm: beyond 6900 rpm it is told as within a tenth,
    beyond 6000 it is not, and within them it is a coincidence."""
    nominal = Condition(20.0, 6000 * RPM)

    def found(highest: float) -> ResonanceMap:
        return resonance_map(spindle, [20.0, 25.0], np.array([5500.0, highest]) * RPM, nominal, nearby=True)

    near = found(6900.0)
    [met] = [c for c in near.beyond if c.line.name == "20 (fo-fc)" and c.mode.kind == "axial" and c.line.bearing == "upper"]
    assert met.condition.speed / RPM == pytest.approx(7147, abs=1)
    assert met.condition.temperature == 20.0
    [said] = nearby(near)
    assert said.startswith("Just beyond the mapped speeds, less than 10% away, at 20 C: ")
    assert "20 (fo-fc) (outer waviness of order 20 of the upper bearing) meets mode 1 (axial) at 7147 rpm and 1002.0 Hz" in said
    assert said in map_json(near)["sentences"]
    assert all(c.condition.speed / RPM < 1.1 * 6900 for c in near.beyond)
    assert not any(5500 <= c.condition.speed / RPM <= 6900 for c in near.beyond)
    assert "20 (fo-fc)" not in " ".join(nearby(found(6000.0)))
    assert nearby(resonance_map(spindle, [20.0, 25.0], np.array([5500.0, 6900.0]) * RPM, nominal)) == []


def test_answer_as_json(met):
    answer = map_json(met)
    assert answer["grid"]["speed_rpm"] == [6000.0, 7200.0, 8400.0]  # as they were given: the first was 6000.000000000001
    assert set(answer["grid"]["speed_rpm"]) <= set(answer["nrro_um"]["over_speed"]["speed_rpm"])
    first = answer["coincidences"][0]
    for name in ("line", "mode", "temperature_C", "speed_rpm", "frequency_Hz", "bearing", "cause", "strength_um", "margin_percent"):
        assert name in first
    assert first["speed_rpm"] == pytest.approx(7200.0)
    assert np.shape(answer["modes"][0]["frequency_Hz"]) == (len(answer["grid"]["temperature_C"]), len(answer["grid"]["speed_rpm"]))
    said = sentences(met)
    assert said[0].startswith("This spindle at 7200 rpm crosses 30 (fo-fc) + fo (outer waviness of order 31 of the upper bearing)")
    assert f"{first['temperature_C']:.1f} C" in said[0]
    title, html = map_section(met)
    assert title == "Resonance map"
    assert html.count("<svg") == 4


def test_a_sentence_tells_what_was_mapped(spindle, found):
    """One number for --speeds is one speed, beside the nominal one, and no end of a range."""
    assert mapped(found) == "Mapped at 9 temperatures from 20 to 60 C, and at 17 speeds from 0 to 14400 rpm; the nominal 20 C and 7200 rpm are always among them."
    one = resonance_map(spindle, [22.0], [3000 * RPM], NOMINAL)
    assert mapped(one) == "Mapped at 2 temperatures, 20 and 22 C, and at 2 speeds, 3000 and 7200 rpm; the nominal 20 C and 7200 rpm are always among them."
    assert map_json(one)["mapped"] == mapped(one)
    console = Console(record=True, width=300, file=io.StringIO())
    show_map(console, one)
    assert mapped(one) in console.export_text()
    assert "at 2 speeds, 3000 and 7200" in map_section(one)[1]
    none, console = replace(one, coincidences=()), Console(record=True, width=3000, file=io.StringIO())
    show_map(console, none)
    assert "Lines on the map: " in (text := console.export_text())
    assert one.lines[0].line.name in text
    assert "of the scene's imperfections" in text if one.drawn_from is None else f"(seed {one.drawn_from}; the scene names none)" in text
    for shown in (map_section(none)[1], summary(none)):  # the head of a table stood over no row, in the report and in the log
        assert "Lines on the map: " in shown
        assert "margin" not in shown
    assert "Lines on the map" not in map_section(one)[1]


def test_help_says_which_speeds_are_mapped(capsys):
    with pytest.raises(SystemExit, match="0"):
        main(["map", "--help"])
    assert "every speed to map, the nominal one added: one number is one speed and no end of a range" in " ".join(capsys.readouterr().out.split())


def test_sentence_without_a_crossing(spindle):
    near = resonance_map(spindle, [20.0, 22.0], [7000 * RPM, 7300 * RPM], NOMINAL)
    assert "crosses no line between 20 and 22 C; nearest is 20 (fo-fc)" in sentences(near)[0]
    assert "half-power" not in sentences(near)[0]
    damped = [replace(c, margin=-0.00049, mode=replace(c.mode, damping_ratio=0.003)) for c in near.coincidences]
    told = sentences(replace(near, coincidences=tuple(damped)))[0]  # it was nearest by +0.0 %
    assert ", -0.05 % from mode" in told
    assert told.endswith(", within its half-power width of +-0.3 %, where it is excited nearly as at a crossing.")


def test_many_crossings_are_told_by_the_strongest_and_a_number(met):
    """A machine tool crosses a score of lines at its speed: in words come the first, the answer has all."""
    [crossed] = [c for c in met.coincidences if c.at_nominal_speed][:1]
    many = replace(met, coincidences=(crossed,) * (SAID + 3))
    assert len(sentences(many)) == SAID + 3
    assert told(many)[:-1] == sentences(many)[:SAID]
    assert told(many)[-1] == "So do 3 weaker lines between 20 and 58.5 C; all are in coincidences.csv of spindle map --out, and in its --json."
    few = replace(met, coincidences=(crossed,) * (SAID + 1))
    assert told(few) == sentences(few)


@pytest.mark.parametrize(("cause", "unit"), [("inner waviness", "um"), ("unbalance", "g mm"), ("cage unbalance", "g mm")])
def test_numbers_of_a_coincidence_have_the_units_of_their_keys(cause, unit):
    """Metres, rad/s and shares told in um, rpm and per cent."""
    line = Line("front", cause, 3, "3x", "radial", -1, 360.0)
    track = Track(4, "rocking", "forward", np.full((1, 1), 350.0), 0.01)
    c = Coincidence(line, track, Condition(33.0, 240 * np.pi), 360.0, 361.0, 0.5, 2.5e-7, 3e-9, -0.0275, 4e-8, True)
    found = ResonanceMap(load("mk7702"), c.condition, np.array([33.0]), np.array([240 * np.pi]), (track,), (), (), (c,), *np.zeros((2, 1, 3)), None)
    [told] = map_json(found)["coincidences"]
    numbers = {"speed_rpm": 7200.0, "frequency_Hz": 360.0, "mode_frequency_Hz": 361.0, "margin_percent": -2.75}
    numbers |= {"strength_um": 0.25, "strength_um_per_unit": 0.003, "nrro_um": 0.04}
    assert {key: told[key] for key in numbers} == pytest.approx(numbers)
    assert (told["unit"], told["line_whirl"], told["temperature_C"]) == (unit, "backward", 33.0)
