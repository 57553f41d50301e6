"""Runout of a spindle whose rings a radial load or its weight displaces, against balls that move in time without small
amplitudes, forces of the whole row at every place of its cage, and rings moved as a whole."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import ROOT
from thermospindle.cli import main
from thermospindle.model.bearing import ball_row, roller
from thermospindle.model.bearing.ball_row import BallInertia, BallRow
from thermospindle.model.bearing.kinematics import VARYING, Kinematics, ball_line, lines, race_line, row_kinematics
from thermospindle.model.bearing.roller import RollerRow, line_constant
from thermospindle.model.built.drawn import drawn
from thermospindle.model.built.imperfections import Imperfections, RowImperfections, Wave
from thermospindle.model.machine import Condition, RadialLoad, Spindle
from thermospindle.model.scene.reading import load
from thermospindle.model.types import Array
from thermospindle.model.units import RPM
from thermospindle.sim.operating import OperatingPoint, operating_point
from thermospindle.sim.resonance.map import resonance_map
from thermospindle.sim.running.excitation import excitation
from thermospindle.sim.running.moving_balls import linear_motion, run_moving_balls
from thermospindle.sim.running.pulls import pulls_of
from thermospindle.sim.running.rows import cage_spread, free_displacements
from thermospindle.sim.running.runout import runout
from thermospindle.testing import assert_margin

SPIN = 7200 * RPM
ASIDE = np.array([2.5e-7, -1e-7, 0.5e-7, 2e-5, 1e-5])  # m, rad
LIGHT = BallRow(10, 4e-5, 4e-5, 3e-5, 2.55e-5, 1.1e10, 1.2e10, 3e-3)
HEAVY = replace(LIGHT, inertia=BallInertia(1e-3, 6e-3, 7800.0, 0.0, 20 * SPIN))
ROLLERS = RollerRow(16, 9e-3, line_constant(9e-3), -2e-6, (-7e-3, 7e-3))
ROWS = pytest.mark.parametrize("row", [LIGHT, HEAVY, ROLLERS], ids=["balls", "heavy balls", "rollers"])


def pushed(spindle: Spindle, newton: float) -> OperatingPoint:
    aside = replace(spindle, radial_loads=(RadialLoad((newton, 0.3 * newton), 0.008, ""),), imperfections=Imperfections())
    return operating_point(aside, Condition(20.0, SPIN))


def hub(point: OperatingPoint, moved: Array) -> Array:
    """Motion (n, 3) of the turning body about its mean: the load's own place is that with a ball at azimuth 0."""
    turning = next(b.name for b in point.chain.bodies if b.turns)
    own = moved[:, [point.chain.dofs.index((turning, move)) for move in "xyz"]]
    return np.asarray(own - own.mean(axis=0))


# ---------------------------------------------------------------- balls that move


@pytest.mark.parametrize(("newton", "within"), [(10.0, 3e-3), (30.0, 0.01)])
def test_moving_balls_do_what_the_lines_say(spindle, newton, within):
    """A tenth of drawn imperfections: under 10 N, which presses balls with 2.5 to 5.4 N, and 30 N, which nearly lets one go."""
    point, own = pushed(spindle, newton), drawn(spindle, 1)
    time, moved = run_moving_balls(point, own, 0.03, (0.0, 0.1))
    late = time > 0.02
    perfect, made = (linear_motion(point, which, time[late]) for which in (Imperfections(), own))
    linear = hub(point, 0.1 * (made - perfect))
    real = hub(point, (moved[1] - moved[0])[late])
    assert real == pytest.approx(linear, abs=within * np.abs(linear).max())
    centred = replace(point, state=replace(point.state, bearings=tuple(replace(b, displacement=()) for b in point.state.bearings)))
    without = hub(point, 0.1 * linear_motion(centred, own, time[late]))
    assert np.abs(without - linear).max() > 3 * within * np.abs(linear).max()  # and not what they say of centred rings


@pytest.mark.slow
def test_where_balls_are_let_go_lines_are_off_by_what_the_changing_stiffness_does(spindle):
    """Under 60 N, where that of the lower row changes by 7 %: across by 9 % rms, along the axis, whose mode it drives, by a
    fifth, whatever the size of the imperfections."""
    point, own = pushed(spindle, 60.0), drawn(spindle, 1)
    assert 0.06 < cage_spread(point.state.bearing("lower")) < 0.075
    time, moved = run_moving_balls(point, own, 0.05, (0.0, 0.01, 0.1))
    late = time > 0.02
    perfect, made = (linear_motion(point, which, time[late]) for which in (Imperfections(), own))
    linear = hub(point, made - perfect)
    for k, factor in ((1, 0.01), (2, 0.1)):
        off = hub(point, (moved[k] - moved[0])[late]) / factor - linear
        assert (np.sqrt(np.mean(off**2, axis=0) / np.mean(linear**2, axis=0)) < [0.11, 0.11, 0.25]).all()


def test_a_ring_follows_an_eccentric_race_whatever_its_balls_do(spindle):
    """Of 100 nm under 60 N, where stiffness changes by a twentieth: the hub goes round with it, and what else it
    does is a hundredth of that, as the moving balls say."""
    point = pushed(spindle, 60.0)
    own = Imperfections(bearings={"lower": RowImperfections(outer_radial=(Wave(1, 1e-7, 0.3),))})
    time, moved = run_moving_balls(point, own, 0.04, (0.0, 0.2))
    late = time > 0.02
    perfect, made = (linear_motion(point, which, time[late]) for which in (Imperfections(), own))
    linear, real = hub(point, made - perfect), hub(point, (moved[1] - moved[0])[late]) / 0.2
    assert real == pytest.approx(linear, abs=0.03 * np.abs(linear).max())
    assert {x.name for x in excitation(point, own).line if x.cause == "outer waviness"} == {"fo"}


def test_a_perfect_row_moves_as_its_balls_pass(spindle):
    """Under 70 N four of ten balls carry nothing: ten times the cage and its multiples, which a constant stiffness has within a tenth."""
    point = pushed(spindle, 70.0)
    time, [moved] = run_moving_balls(point, Imperfections(), 0.04, (1.0,))
    late = time > 0.02
    linear, real = hub(point, linear_motion(point, Imperfections(), time[late])), hub(point, moved[late])
    assert np.sqrt(np.mean((real - linear) ** 2) / np.mean(real**2)) < 0.1
    cage = row_kinematics(point.spindle, point.state)["lower"].cage / (2 * np.pi)
    own = [x for x in excitation(point).line if x.bearing == "lower"]
    assert {(x.cause, x.whirl) for x in own} == {(VARYING, 0)}
    assert sorted({round(x.frequency / cage, 9) for x in own}) == [10.0, 20.0, 30.0, 40.0, 50.0, 60.0]
    assert {x.name for x in own} == {f"{10 * k} fc" for k in range(1, 7)}
    assert cage_spread(point.state.bearing("lower")) > 0.05


# ---------------------------------------------------------------- a row as a whole


def whole(row: BallRow | RollerRow, q: Array, turn: float) -> Array:
    """Force (5,) that holds the outer ring with the first element at azimuth `turn`."""
    if isinstance(row, RollerRow):
        return roller.with_cage_at(row, q, turn)[0]
    c, s = np.cos(turn), np.sin(turn)
    turned = np.eye(5)
    turned[:2, :2] = turned[3:, 3:] = [[c, s], [-s, c]]
    return np.asarray(turned.T @ ball_row.respond(row, turned @ q).force)


@ROWS
def test_the_load_of_a_perfect_row_changes_with_the_place_of_its_cage(row):
    """Harmonics over the turn of the cage of the force on the whole row, one place after another."""
    elements = row.rollers if isinstance(row, RollerRow) else row.balls
    aside = 6 * ASIDE if isinstance(row, RollerRow) else 8 * ASIDE  # so far that some carry nothing
    turns = 2 * np.pi / elements * np.arange(256) / 256
    force = np.array([whole(row, aside, turn) for turn in turns])
    perfect = pulls_of(row, tuple(aside)).perfect
    for k in (1, 2):
        seen = np.fft.fft(-force, axis=0)[k] / 256
        assert elements * perfect[k * elements] == pytest.approx(seen, rel=0.05, abs=0.02 * np.abs(seen).max())


@pytest.mark.parametrize("contact", ["inner", "outer"])
@ROWS
def test_elements_all_too_thick_do_what_the_row_says(row, contact):
    """The force on the outer ring, by central differences of the whole row with every element thicker."""
    q, h = tuple(ASIDE), 1e-10

    def held(thick: float) -> Array:
        if isinstance(row, RollerRow):
            return roller.respond(replace(row, clearance=row.clearance - 2 * thick), ASIDE).force
        return ball_row.respond(replace(row, **{f"{contact}_length": getattr(row, f"{contact}_length") - thick}), ASIDE).force

    expected = -(held(h) - held(-h)) / (2 * h)
    pull = pulls_of(row, q).by[0]
    found = row.rollers * pull.sum(axis=1) if isinstance(row, RollerRow) else row.balls * pull[:, {"inner": 2, "outer": 3}[contact]]
    assert found.real == pytest.approx(expected, rel=1e-5, abs=1e-6 * np.abs(expected).max())
    assert np.abs(found.imag).max() < 1e-9 * np.abs(found).max()


@pytest.mark.parametrize("far", [1.0, 6.0], ids=["all pressed", "some loose"])
@ROWS
def test_a_race_that_is_displaced_as_a_whole_takes_its_ring_along(spindle, row, far):
    """Order 1 of the outer race, radial and axial: displaced by as much, and tilted by amplitude over lever, wherever the balls stand."""
    if isinstance(row, RollerRow):
        tail = load("tailstock")
        state, elements = replace(roller.roller_state(tail, tail.roller_bearings[0], None, 20.0), row=row, displacement=tuple(far * ASIDE), load=1.0), row.rollers
    else:
        state, elements = replace(operating_point(spindle, Condition(20.0)).state.bearing("upper"), row=row, displacement=tuple(far * ASIDE)), row.balls
    kin = Kinematics(0.0, SPIN, 0.45 * SPIN, 3 * SPIN, elements, not isinstance(row, RollerRow), displaced=True)
    found = free_displacements(state, kin, RowImperfections(outer_radial=(Wave(1, 2e-8, 0.0),)))
    assert {line.name for line, _ in found if line.cause != VARYING} == {"fo"}
    assert sum(moved for line, moved in found if line.name == "fo") == pytest.approx(-2e-8 * np.array([1, -1j, 0, 0, 0]), rel=1e-6, abs=1e-12)
    if not isinstance(row, RollerRow):
        found = free_displacements(state, kin, RowImperfections(outer_axial=(Wave(1, 2e-8, 0.0),)))
        assert sum(moved for line, moved in found if line.name == "fo") == pytest.approx(-2e-8 / row.arm * np.array([0, 0, 0, -1j, -1]), rel=1e-6, abs=1e-12)


# ---------------------------------------------------------------- lines


def test_names_are_sums_of_what_they_name():
    """Rings that turn the same way, the cage between them and faster than one: 10 (60 - 76.1) + 60 is 101 Hz, whichever way round it is written."""
    kin = Kinematics(2 * np.pi * 100, 2 * np.pi * 60, 2 * np.pi * 76.1, 2 * np.pi * 300, 10, displaced=True)
    told = {"fi": 100.0, "fo": 60.0, "fc": 76.1, "fb": 300.0}
    every = [race_line("b", kin, side, passes + by, "radial", passes) for side in ("inner", "outer") for passes in (0, 10, 20) for by in (-2, -1, 0, 1, 2) if passes + by > 0]
    every += [ball_line("b", kin, order, "radial", by) for order in (2, 4) for by in (-2, -1, 0, 1, 2)]
    for line in every:
        sums = re.sub(r"(\d) (\(|f)", r"\1 * \2", line.name)
        assert abs(eval(sums, {}, told)) == pytest.approx(line.frequency, rel=1e-9), line.name


def test_sidebands_stand_where_the_frames_say(spindle):
    """Race waves of any order s beside k Z turn with k Z (f_race - f_cage) + s f_race, ball waves with 2 k f_ball + s f_cage, sizes with s f_cage."""
    point = pushed(spindle, 30.0)
    kin = row_kinematics(point.spindle, point.state)["upper"]
    assert kin.displaced
    ring, cage, ball = (abs(x) / (2 * np.pi) for x in (kin.outer, kin.cage, kin.spin))
    found = {(x.name, x.direction): x.frequency for x in lines(point.spindle, {name: kin for name in ("upper", "lower")}, SPIN, 2) if x.bearing == "upper"}
    expected = {"2 fc": 2 * cage, "10 (fo-fc) + 2 fo": 10 * (ring - cage) + 2 * ring, "20 (fo-fc) - 2 fo": 20 * (ring - cage) - 2 * ring, "2 fo": 2 * ring, "2 fb - 2 fc": 2 * ball - 2 * cage, "10 fc": 10 * cage}
    for name, frequency in expected.items():
        assert found[name, "radial"] == found[name, "axial"] == pytest.approx(frequency, rel=1e-12)
    own = excitation(point, Imperfections(bearings={"upper": RowImperfections(outer_radial=(Wave(12, 1e-9, 0.0),), ball_waves=((Wave(2, 1e-9, 0.0),), *[()] * 9))}))
    made = {x.name for x in own.line if x.bearing == "upper" and x.cause != VARYING}
    assert {"10 (fo-fc) + 2 fo", "2 fb - 2 fc", "2 fb + 3 fc"} <= made


def test_what_is_weak_is_left_out_and_what_is_centred_has_no_sidebands(spindle):
    own = RowImperfections(outer_radial=tuple(Wave(n, 1e-8, 0.1 * n) for n in range(1, 42)))
    names = []
    for newton in (1e-6, 1.0, 30.0):
        point = pushed(spindle, newton)
        found = free_displacements(point.state.bearing("upper"), row_kinematics(point.spindle, point.state)["upper"], own)
        size = [np.linalg.norm(point.state.bearing("upper").stiffness @ moved) for _, moved in found]
        assert min(size) > 1e-6 * max(size)
        names.append(len(found))
    assert names[0] == len(free_displacements(operating_point(spindle, Condition(20.0, SPIN)).state.bearing("upper"), row_kinematics(point.spindle, point.state)["upper"], own))
    assert names[0] < names[1] < names[2]


# ---------------------------------------------------------------- the verbs


@pytest.fixture(scope="module")
def lying(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("lying")
    text = (ROOT / "scenes" / "hdd_2003" / "spindle.toml").read_text(encoding="utf-8")
    key = "nominal_speed_rpm = 7200.0"
    assert key in text
    loads = "radial_load_N = [8.0, -2.0]\nradial_load_z_mm = 8.0\ngravity_m_per_s2 = [0.0, -9.81]"
    (folder / "spindle.toml").write_text(text.replace(key, f"{key}\n{loads}"), encoding="utf-8")
    return folder


def test_runout_of_a_spindle_that_lies_has_in_mujoco_what_the_lines_say(lying):
    spindle = load(lying)
    found = runout(operating_point(replace(spindle, imperfections=drawn(spindle, 1)), Condition(20.0, SPIN)), seconds=0.2, path="simulated")
    strong = [line for line in found.lines if line.amplitude > 0.03 * found.lines[0].amplitude]
    assert len(strong) > 8
    for line in strong:
        assert line.amplitude == pytest.approx(line.predicted, rel=2e-3)


@pytest.mark.parametrize("load_along", [False, True], ids=["lying", "pushed along its axis"])
def test_balls_that_do_not_orbit_give_the_same_lines(lying, spindle, load_along):
    """Springs that are not linear, each pressed by its own load, which dead loads hold: of nanometres within 1 %. Without
    the dead loads, taken away with the hammers, the spindle rang by ten times what its imperfections do."""
    own = replace(spindle, axial_load=6.0) if load_along else load(lying)
    waves = RowImperfections(outer_radial=tuple(Wave(n, 2e-9, 0.3 * n) for n in (1, 2, 9, 10, 11, 12)), outer_axial=(Wave(10, 2e-9, 0.0),))
    point = operating_point(replace(own, imperfections=Imperfections(bearings={"upper": waves})), Condition(20.0, SPIN))
    found = runout(point, seconds=0.1, path="simulated", element="ball-by-ball")
    strong = [line for line in found.lines if line.amplitude > 0.1 * found.lines[0].amplitude]
    assert len(strong) > 3
    for line in strong:
        assert line.amplitude == pytest.approx(line.predicted, rel=0.01)


def test_runout_tells_where_stiffness_changes(lying, tmp_path, capsys):
    """Of the row as it stands, ball by ball at places of its cage."""
    text = (lying / "spindle.toml").read_text(encoding="utf-8")
    (tmp_path / "spindle.toml").write_text(text.replace("[8.0, -2.0]", "[60.0, -15.0]"), encoding="utf-8")
    assert main(["runout", str(tmp_path), "--path", "linear", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["cage_spread"]
    b = operating_point(load(tmp_path), Condition(20.0, SPIN)).state.bearing("lower")
    h, q = 1e-10, np.array(b.displacement)
    slopes = []
    for turn in 2 * np.pi / 10 * np.arange(48) / 48:
        ends = [[whole(b.row, q + s * h * np.eye(5)[i], turn)[i] for i in (0, 1)] for s in (1, -1)]
        slopes.append((np.array(ends[0]) - np.array(ends[1])) / (2 * h))
    mean = np.mean(slopes, axis=0)
    assert told["lower"] == pytest.approx(np.abs(np.array(slopes) / mean - 1).max(), rel=0.02)
    assert told["lower"] > 0.02 > told["upper"]
    assert main(["runout", "hdd_2003", "--path", "linear", "--json"]) == 0
    assert set(json.loads(capsys.readouterr().out)["cage_spread"].values()) == {0.0}
    assert main(["runout", str(tmp_path), "--path", "linear"]) == 0
    assert "Stiffness across changes as balls pass the load: lower" in " ".join(capsys.readouterr().out.split())


@pytest.mark.slow
def test_a_map_has_the_sidebands(lying):
    spindle = load(lying)
    found = resonance_map(spindle, [20.0, 30.0], np.linspace(0, 14400 * RPM, 9).tolist(), Condition(20.0, SPIN))
    names = {c.line.name for c in found.coincidences}
    assert any("2 fo" in name or "2 fc" in name for name in names)
    assert all(np.isfinite(c.strength) and np.isfinite(c.nrro) for c in found.coincidences)
    places = [(c.line.bearing, c.line.cause, c.line.name, c.line.direction, c.line.order, c.mode.number, c.at_nominal_speed, round(c.condition.speed, 1)) for c in found.coincidences]
    assert len(set(places)) == len(places)


def test_a_margin_counts_sidebands(lying):
    with pytest.raises(AssertionError, match=r"4 fb - 2 fc"):
        assert_margin(lying, mode=1, speed_rpm=6004, at_least_percent=0.2, temperatures_C=[20.0])
