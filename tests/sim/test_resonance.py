"""The resonance map: crossings against a closed form, exactness, direction and sense of whirl, strength, and what it tells."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from model.kinematics import lines, row_kinematics
from model.machine import Body, Condition
from model.modes import modes
from model.scene import BadInput
from sim.excitation import harmonics, response
from sim.log_map import write_map_log
from sim.log_map_read import describe_map, is_map, map_contents, map_contents_json
from sim.log_read import open_log
from sim.operating import operating_point
from sim.resonance import resonance_map, strongest
from sim.resonance_output import map_json, map_section, sentences
from sim.resonance_point import Exact, key, nrro_rms
from sim.runout import hub_probes, runout
from spindle import main

RPM = 2 * np.pi / 60
SCENE = Path(__file__).parents[2] / "scenes" / "hdd_2003"
NOMINAL = Condition(20.0, 7200 * RPM)


@pytest.fixture(scope="module")
def found(spindle):
    return resonance_map(spindle, np.linspace(20, 60, 9), np.linspace(0, 14400, 17) * RPM, NOMINAL)


@pytest.fixture(scope="module")
def rigid(spindle):
    """A hub that only tilts, on its two bearings and a shaft that does not move: one isotropic rotor, without damping."""
    hub = spindle.structure.body("hub")
    tilting = Body("hub", 0.05, (1e-5, 1e-5, 1.6e-5), 0.012, ("tilt_x", "tilt_y"), True, hub.regions)
    held = replace(spindle.structure.body("shaft"), moves=())
    bearings = tuple(replace(b, damping_ratio=0.0) for b in spindle.bearings)
    return replace(spindle, bearings=bearings, structure=replace(spindle.structure, bodies=(held, tilting), joints=()))


def tilt_stiffness(point):
    """Of both bearings about the hub's centre, N m/rad: with lever a = z_bearing - z, k_t + 2 a k_x,ty + a^2 k_x (about y)."""
    total = 0.0
    for b in point.state.bearings:
        lever = b.z - 0.012
        total += b.stiffness[4, 4] + 2 * lever * b.stiffness[0, 4] + lever**2 * b.stiffness[0, 0]
    return total


def crossing_speed(k, c, whirl, transverse=1e-5, polar=1.6e-5):
    """Speed (rad/s) at which c times it meets a tilting mode: It (c n)^2 - whirl Ip n (c n) = k (Genta 2005, Eq. 2.23)."""
    return np.sqrt(k / (transverse * c**2 - whirl * polar * c))


@pytest.mark.parametrize(("hertz", "whirl"), [(1842.096, 1), (1650.096, -1)])
def test_closed_form_meets_the_published_rotor(hertz, whirl):
    """The formula these tests use gives 7200 rpm for the lines that pass 1842.096 and 1650.096 Hz there, k 1200 N m/rad."""
    assert crossing_speed(1200.0, hertz / 120.0, whirl) / RPM == pytest.approx(7200.0, rel=1e-6)


def test_crossings_of_a_rigid_rotor(rigid):
    """Every coincidence of the isotropic rotor is where the closed form puts it, and the senses do not mix."""
    own = resonance_map(rigid, [20.0, 40.0, 60.0], np.linspace(0, 30000, 31) * RPM, Condition(20.0, 9000 * RPM), highest=1e4)
    radial = [c for c in own.coincidences if c.line.direction == "radial"]
    assert len(radial) >= 20
    assert {c.mode.whirl for c in radial} == {"forward", "backward"}
    for c in radial:
        assert c.line.whirl == {"forward": 1, "backward": -1}[c.mode.whirl]
        assert c.sense == pytest.approx(1.0, abs=1e-9)
        point = operating_point(rigid, c.condition)
        multiple = c.frequency * 2 * np.pi / c.condition.speed
        assert c.condition.speed == pytest.approx(crossing_speed(tilt_stiffness(point), multiple, c.line.whirl), rel=1e-5)
    forward = [t for t in own.lines if t.line.whirl > 0 and t.line.frequency > 500]
    met = {key(c.line) for c in radial}
    k = tilt_stiffness(operating_point(rigid, Condition(20.0, 9000 * RPM)))
    for t in forward:  # none that should cross inside the grid is missing
        c = t.line.frequency * 2 * np.pi / (9000 * RPM)
        inside = 1e-5 * c**2 > 1.6e-5 * c and crossing_speed(k, c, 1) < 30000 * RPM
        assert (key(t.line) in met) == inside


def test_every_coincidence_is_exact(spindle, found):
    """At the listed condition the line and a mode of that kind are within 0.1 Hz, seen by operating points of their own."""
    assert len(found.coincidences) > 80
    for c in found.coincidences[::3]:
        point = operating_point(spindle, c.condition)
        line = next(x for x in lines(point.spindle, row_kinematics(point.spindle, point.state)) if key(x) == key(c.line))
        near = min(modes(point.chain), key=lambda m: abs(m.frequency - line.frequency))
        assert line.frequency == pytest.approx(c.frequency, abs=1e-6)
        assert near.frequency == pytest.approx(line.frequency, abs=0.1)
        assert (near.kind == "axial") == (line.direction == "axial")


def test_no_sign_change_is_missed_at_the_nominal_speed(spindle, found):
    """On a finer temperature axis, by modes sorted into kinds: as many radial crossings as the map lists, sense allowed."""
    listed = [c for c in found.coincidences if c.at_nominal_speed]
    assert len(listed) == 2  # 30 fc of both inner races
    assert all(c.line.name == "30 fc" and c.line.order == 31 and c.line.whirl == -1 for c in listed)
    for c in listed:
        assert 45 < c.condition.temperature < 52
        gaps = []
        for t in (c.condition.temperature - 0.2, c.condition.temperature + 0.2):
            point = operating_point(spindle, Condition(t, NOMINAL.speed))
            line = next(x for x in lines(spindle, row_kinematics(spindle, point.state)) if key(x) == key(c.line))
            backward = [m.frequency for m in modes(point.chain) if m.kind == "rocking" and m.whirl == "backward"]
            gaps.append(line.frequency - min(backward, key=lambda f: abs(f - line.frequency)))
        assert gaps[0] < 0 < gaps[1]


def test_strength_is_the_peak_of_the_response(spindle, found):
    """At a coincidence the mode's own part is most of what the exact linear model answers to that line, mode apart from others."""
    c = next(c for c in strongest(found.coincidences) if c.line.name == "2 fb" and c.mode.number == 1)
    point = operating_point(spindle, c.condition)
    forces = harmonics(point)
    n = next(n for n, line in enumerate(forces.line) if key(line) == key(c.line))
    axial = hub_probes(spindle)[2].row(point.chain)
    assert abs(response(point, forces)[n] @ axial) == pytest.approx(c.strength, rel=0.02)
    damping = min(modes(point.chain), key=lambda m: abs(m.frequency - c.frequency)).damping_ratio
    assert 0.003 < damping < 0.02
    off = operating_point(spindle, replace(c.condition, speed=c.condition.speed * 1.05))
    beside = abs(response(off, harmonics(off))[n] @ axial)
    assert beside == pytest.approx(c.strength * 2 * damping / (1.05**2 - 1), rel=0.3)


def test_growth_of_runout_through_a_crossing(spindle, found):
    """Radial NRRO rises towards 49 C at the nominal speed and falls beyond, and its peak is that of the coincidence."""
    c = next(c for c in found.coincidences if c.at_nominal_speed)
    place, radial, _ = found.nrro_temperature.T
    peak = int(np.argmax(radial))
    assert place[peak] == pytest.approx(c.condition.temperature, abs=1.5)
    assert radial[peak] == pytest.approx(c.nrro, rel=0.01)
    assert radial[peak] > 1.25 * radial[0]
    assert radial[-1] < 0.95 * radial[peak]


def test_nrro_by_the_sum_of_lines(spindle, found):
    """The same rms from phasors collected in another way: a dense record in time of one bearing's lines."""
    point = operating_point(spindle, Condition(35.0, NOMINAL.speed))
    own = point.imperfections
    only = replace(own, unbalance=0.0, couple_unbalance=0.0, bearings={"lower": own.bearings["lower"]})
    alone = replace(point, spindle=replace(spindle, imperfections=only))
    forces = harmonics(alone)
    seen = response(alone, forces) @ np.array([p.row(alone.chain) for p in hub_probes(spindle)]).T
    apart = [n for n, f in enumerate(forces.frequency) if abs(f / 120.0 - round(f / 120.0)) > 1e-6]
    time = np.arange(200_000) / 20_011.0
    x, y, z = (sum((seen[n, k] * np.exp(2j * np.pi * forces.frequency[n] * time)).real for n in apart) for k in range(3))
    radial, axial = nrro_rms(Exact(alone, {}, {}, 3))
    assert radial == pytest.approx(np.sqrt((x.var() + y.var()) / 2), rel=5e-3)
    assert axial == pytest.approx(z.std(), rel=5e-3)


def test_axial_lines_leave_rocking_modes_alone(found):
    for c in found.coincidences:
        assert (c.line.direction == "axial") == (c.mode.kind == "axial")
        assert 0.01 <= c.sense <= 1.0


def test_sense_of_a_nearly_standing_mode(spindle):
    """Slowly turning, modes 3 and 4 are split by the base and stand: lines of either sense excite both, each with about half."""
    slow = resonance_map(spindle, [20.0, 25.0], np.linspace(0, 3600, 7) * RPM, Condition(20.0, 1800 * RPM), multiples=8)
    standing = [c for c in slow.coincidences if c.mode.number == 3]
    assert {c.line.whirl for c in standing} == {1, -1}
    assert all(0.2 < c.sense < 0.8 for c in standing)


def test_without_imperfections_a_plausible_set_is_drawn(spindle):
    from model.imperfections import Imperfections

    plain = resonance_map(replace(spindle, imperfections=Imperfections()), [20.0, 60.0], [0.0, 14400 * RPM], NOMINAL)
    assert plain.drawn_from == 0
    assert max(c.strength for c in plain.coincidences) > 1e-9


def test_grids_that_make_no_map(spindle):
    with pytest.raises(BadInput, match="two different"):
        resonance_map(spindle, [20.0], [0.0, 700.0], NOMINAL)
    with pytest.raises(BadInput, match="negative"):
        resonance_map(spindle, [20.0, 30.0], [-700.0, 700.0], NOMINAL)


def test_answer_as_json(found):
    answer = map_json(found)
    first = answer["coincidences"][0]
    for name in ("line", "mode", "temperature_C", "speed_rpm", "frequency_Hz", "bearing", "cause", "strength_um", "margin_percent"):
        assert name in first
    assert first["speed_rpm"] == pytest.approx(7200.0)
    assert np.shape(answer["modes"][0]["frequency_Hz"]) == (len(answer["grid"]["temperature_C"]), len(answer["grid"]["speed_rpm"]))
    said = sentences(found)
    assert said[0].startswith("This spindle at 7200 rpm crosses 30 fc")
    assert "48.8 C" in said[0]
    title, html = map_section(found)
    assert title == "Resonance map"
    assert html.count("<svg") == 4


def test_sentence_without_a_crossing(spindle):
    near = resonance_map(spindle, [20.0, 22.0], [7000 * RPM, 7300 * RPM], NOMINAL)
    assert "crosses no line between 20 and 22 C; nearest is 20 (fo-fc)" in sentences(near)[0]


# ------------------------------------------------------------------ log and command line


def test_log_gives_the_map_back(found, tmp_path):
    """Grid and natural frequencies bit for bit, coincidences as told; a timeline for each axis, and a blueprint."""
    write_map_log(found, tmp_path / "map.rrd")
    opened = open_log(tmp_path / "map.rrd")
    assert is_map(opened)
    read = map_contents(opened)
    assert np.array_equal(read.temperatures, found.temperatures)
    assert np.array_equal(read.speeds, found.speeds)
    for m, track in enumerate(found.modes):
        assert np.array_equal(read.modes[:, m], track.frequency)
    told = map_json(found)["coincidences"]
    assert [dict(c) for c in read.coincidences] == told
    assert {"temperature, 0.01 C", "speed"} <= set(read.timelines)
    assert read.blueprint
    assert f"{len(told)} coincidences" in describe_map(read)
    assert map_contents_json(read)["modes_Hz"][0][0][0] == found.modes[0].frequency[0, 0]


def test_log_without_its_numbers_is_refused(found, tmp_path):
    write_map_log(found, tmp_path / "map.rrd")
    opened = open_log(tmp_path / "map.rrd")
    less = replace(opened, columns={k: v for k, v in opened.columns.items() if k != "/numbers/modes"})
    with pytest.raises(BadInput, match=r"map.rrd: is not a whole log"):
        map_contents(less)
    with pytest.raises(BadInput, match="folder"):
        write_map_log(found, tmp_path / "none" / "map.rrd")


def test_map_from_the_command_line(tmp_path, capsys):
    scene, out = str(SCENE), tmp_path / "out"
    grid = ["--temperatures", "20", "50", "--speeds", "5000", "8000"]
    assert main(["map", scene, *grid, "--speed", "7200", "--json", "--out", str(out)]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["grid"]["speed_rpm"] == pytest.approx([5000.0, 7200.0, 8000.0])
    assert any(c["line"] == "30 fc" and c["mode"] == 6 for c in answer["coincidences"])
    assert {p.name for p in out.iterdir()} >= {"coincidences.csv", "modes.csv", "campbell.png", "temperature.png", "map.rrd"}
    assert main(["inspect", str(out / "map.rrd"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["coincidences"] == answer["coincidences"]
    assert main(["map", scene, "--speed", "0"]) == 2
    assert "--speed 0" in capsys.readouterr().err


def test_runout_grows_when_simulated(spindle, found):
    """MuJoCo's time domain at the nominal condition and at the crossing: the same radial NRRO and growth as the map tells, to 5 %: the two
    bearings' lines, nearly alike, beat for longer than the record."""
    c = next(c for c in found.coincidences if c.at_nominal_speed)
    seen = []
    for condition in (NOMINAL, c.condition):
        record = runout(operating_point(spindle, condition), 0.5)
        across = record.by_lines.nonrepeatable[:2]
        seen.append(float(np.sqrt((across**2).mean())))
    start = int(np.argmin(np.abs(found.nrro_temperature[:, 0] - NOMINAL.temperature)))
    assert seen[0] == pytest.approx(found.nrro_temperature[start, 1], rel=0.05)
    assert seen[1] == pytest.approx(c.nrro, rel=0.05)
    assert seen[1] / seen[0] > 1.2
