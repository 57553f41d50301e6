"""Runout: probes, two ways to part RRO and NRRO, and two paths to the record; closed forms are in `test_revolutions`."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from tests.mounting import turning_inside
from tests.report.parsed_page import Page
from thermospindle.cli import main
from thermospindle.model.bearing.kinematics import row_kinematics
from thermospindle.model.built.imperfections import Imperfections, RowImperfections, Wave
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.model.units import RPM
from thermospindle.report.figures.common import spread
from thermospindle.report.figures.runout import motion_figure, spectrum_figure
from thermospindle.report.text.runout import runout_json, runout_section, show_runout, write_runout
from thermospindle.sim.operating import operating_point
from thermospindle.sim.running import runout as running
from thermospindle.sim.running.lines import fit
from thermospindle.sim.running.probes import AXIAL, X, Y, all_probes, hub_probes
from thermospindle.sim.running.run import run_spindle
from thermospindle.sim.running.runout import linear, measured, planned, runout, whole_turns, with_imperfections

RATE = 20000.0
SCENE = Path(__file__).parents[3] / "scenes" / "hdd_2003"


# ---------------------------------------------------------------- whole records


@pytest.fixture(scope="module")
def hot_point(imperfect):
    return operating_point(imperfect, Condition(40.0, 7200 * RPM))


@pytest.fixture(scope="module")
def found(hot_point):
    return runout(hot_point, path="linear")


def test_default_record_is_the_one_with_the_least_leakage(hot_point, found):
    count = whole_turns(hot_point)
    assert 60 <= count <= 120
    assert found.averaged.count == count
    short = runout(hot_point, 60 / 120, path="linear")
    assert found.leaked[0] < 0.5 * short.leaked[0]


def test_both_ways_to_part_the_record_agree_within_the_leakage(found):
    away = found.averaged.repeatable - found.by_lines.repeatable
    assert np.all(np.abs(away).max(axis=1) <= found.leaked * (1 + 1e-6) + 1e-15)
    assert found.leaked[0] < 0.1 * np.ptp(found.by_lines.nonrepeatable[0])
    rms = [v.nonrepeatable_rms for v in (found.values()[X], found.values(averaged=True)[X])]
    assert rms[0] == pytest.approx(rms[1], rel=0.01)


def test_variance_of_the_record_is_the_sum_of_both_parts(found):
    for name, m in found.values(averaged=True).items():
        assert m.repeatable_rms**2 + m.nonrepeatable_rms**2 == pytest.approx(m.total_rms**2, rel=1e-12), name
    m = found.values()[X]  # lines between whole orders are not quite orthogonal to the whole ones in a finite record
    assert m.repeatable_rms**2 + m.nonrepeatable_rms**2 == pytest.approx(m.total_rms**2, rel=1e-3)


def test_sum_of_the_squared_lines_is_the_variance(found):
    """Parseval: half the squares of forward and backward radii, for x and y together."""
    across = sum(g.forward**2 + g.backward**2 for g in found.lines if g.direction == "radial")
    values = found.values()
    assert across == pytest.approx(values[X].total_rms ** 2 + values[Y].total_rms ** 2, rel=0.02)
    along = sum(g.amplitude**2 for g in found.lines if g.direction == "axial") / 2
    assert along == pytest.approx(values[AXIAL].total_rms ** 2, rel=0.05)  # pairs of lines that beat are told as one


def test_every_line_of_the_harmonic_answer_comes_back_with_its_cause(found):
    assert len(found.lines) > 20
    for g in found.lines:
        assert g.causes, g.frequency
        assert g.amplitude == pytest.approx(g.predicted, rel=1e-3)
        assert all(abs(c.frequency - g.frequency) < 1.0 for c in g.causes)
    assert [g.amplitude for g in found.lines] == sorted((g.amplitude for g in found.lines), reverse=True)
    assert np.abs(found.fit.residual[:3]).max() < 1e-6 * np.ptp(found.signals.value[0])


def test_the_running_simulation_and_the_harmonic_answer_show_the_same(hot_point, found):
    simulated = runout(hot_point, seconds=0.2)
    n = len(simulated.signals.time)
    own, other = simulated.signals.value, found.signals.value[:, :n]
    assert own.std() > 0
    assert np.sqrt(((own - other) ** 2).mean(axis=1)) == pytest.approx(np.zeros(len(own)), abs=1e-3 * other[0].std())
    exact = {(round(g.frequency, 6), g.direction): g for g in found.lines}
    for g in simulated.lines[:8]:
        assert g.amplitude == pytest.approx(g.predicted, rel=2e-3)
    assert any((round(g.frequency, 6), g.direction) in exact for g in simulated.lines)
    assert not [g for g in simulated.lines if not g.causes]


def test_turning_backwards_mirrors_the_whirl(imperfect):
    unbalanced = with_imperfections(imperfect, Imperfections(unbalance=1e-8, unbalance_z=0.01))
    for speed in (7200, -7200):
        point = operating_point(unbalanced, Condition(20.0, speed * RPM))
        found = runout(point, 0.25, path="linear")
        [only] = found.lines
        assert (only.frequency, only.repeatable, only.whirl) == (pytest.approx(120.0), True, "forward")
        assert only.causes[0].cause == "unbalance"
        assert only.backward < 0.05 * only.forward  # the seat's two stiffnesses make the circle an ellipse
        turns = np.unwrap(np.angle(found.signals.of(X) + 1j * found.signals.of(Y)))
        assert np.sign(turns[-1] - turns[0]) == np.sign(speed)
        assert found.values()[X].nonrepeatable < 1e-6 * found.values()[X].repeatable


@pytest.mark.parametrize("begin", [0.0, 53 / RATE], ids=["clock starts with the record", "clock starts before"])
@pytest.mark.parametrize("speed", [7200, -7200])
def test_a_record_may_begin_anywhere_in_a_turn(imperfect, speed, begin):
    """Both ways of finding the RRO stand at the angle of the turning part, wherever time and angle of the record begin."""
    unbalanced = with_imperfections(imperfect, Imperfections(unbalance=1e-8, unbalance_z=0.01))
    point = operating_point(unbalanced, Condition(20.0, speed * RPM))
    whole = linear(point, all_probes(point.spindle), np.arange(4000) / RATE)
    later = replace(
        whole, time=whole.time[53:] - 53 / RATE + begin, angle=whole.angle[53:], value=whole.value[:, 53:], motion=whole.motion[53:]
    )
    found = running.analyse(point, later)
    size = np.ptp(found.averaged.repeatable[0])
    assert found.by_lines.repeatable == pytest.approx(found.averaged.repeatable, abs=1e-6 * size)
    assert found.averaged.angle[0] == pytest.approx(2 * np.pi * 120 * 53 / RATE)  # in the sense of turning
    x = found.averaged.repeatable[0]
    heavy = found.averaged.angle[int(np.argmax(x))] % (2 * np.pi)
    response = running.analyse(point, whole).averaged
    assert heavy == pytest.approx(response.angle[int(np.argmax(response.repeatable[0]))] % (2 * np.pi), abs=0.06)  # two samples


def test_orders_that_cancel_leave_no_line(spindle):
    """All race orders but k Z and k Z +- 1, and odd ball orders: nothing; at the frequencies at which they pass, nothing either."""
    balls = spindle.bearings[0].balls
    silent = tuple(Wave(n, 1e-7, 0.3 * n) for n in range(2, 3 * balls) if n % balls not in (0, 1, balls - 1))
    odd = tuple(tuple(Wave(n, 1e-7, 0.7 * j * n) for n in (3, 5)) for j in range(balls))
    row = RowImperfections(inner_radial=silent, inner_axial=silent, outer_radial=silent, outer_axial=silent, ball_waves=odd)
    heard = replace(row, outer_radial=(*silent, Wave(balls + 1, 1e-7, 0.0)))
    point = operating_point(with_imperfections(spindle, Imperfections(bearings={"upper": heard})), Condition(40.0, 7200 * RPM))
    [record] = run_spindle([point], 0.2, RATE)
    signals = measured(record, hub_probes(spindle))
    kin = row_kinematics(spindle, point.state)["upper"]
    passing = {abs(w.order * (kin.ring(r) - kin.cage) + s * kin.cage) for w in silent for r in ("inner", "outer") for s in (-1, 0, 1)}
    spinning = {abs(n * kin.spin + s * kin.cage) for n in (3, 5) for s in (-1, 0, 1)}
    [only] = runout(point, 0.2, path="linear").lines
    forbidden = np.array(sorted(f / (2 * np.pi) for f in passing | spinning if abs(f / (2 * np.pi) - only.frequency) > 5.0))
    apart = forbidden[np.concatenate([[True], np.diff(forbidden) > 3.0])]
    best = fit(signals.time, signals.value, np.sort(np.append(apart, only.frequency)))
    strength = np.abs(best.phasor[:2]).max(axis=0)
    there = np.abs(best.frequency - only.frequency) < 1e-9
    assert strength[there][0] == pytest.approx(only.amplitude, rel=2e-2)
    assert len(apart) > 20
    assert strength[~there].max() < 1e-4 * strength[there][0]


# ---------------------------------------------------------------- figures, files, command line


def test_labels_are_apart_and_close_to_their_lines():
    wanted = np.array([10.0, 11.0, 12.0, 80.0])
    places = spread(wanted, 5.0, 0.0, 100.0)
    assert np.diff(places).min() >= 5.0 - 1e-12
    assert places == pytest.approx([6.0, 11.0, 16.0, 80.0])
    assert spread(np.array([99.0, 99.5]), 5.0, 0.0, 100.0) == pytest.approx([95.0, 100.0])
    assert np.diff(spread(np.linspace(0, 1, 40), 5.0, 0.0, 100.0)) == pytest.approx(np.full(39, 100 / 39))


def test_figures_name_the_lines(found):
    texts = [t.get_text() for axes in spectrum_figure(found).axes for t in axes.texts]
    assert any(t.startswith("2 fb + fc\nball waviness") for t in texts)
    assert any("1x" in t or "unbalance" in t for t in texts)  # the repeatable line is always named
    motion = motion_figure(found)
    assert motion.axes[0].get_title(loc="left") == f"Orbit, {found.averaged.count} revolutions"
    for axes, name, title in zip(motion.axes[1:], ("hub x", "hub y", "hub axial"), ("(hub x)", "(hub y)", "Axial"), strict=True):
        assert title in axes.get_title(loc="left")
        assert f"total {1e9 * found.values()[name].total_error:.3g} nm" in axes.texts[-1].get_text()


def test_command_line_answers_and_writes(tmp_path, capsys):
    out = tmp_path / "runout"
    call = [
        "runout",
        str(SCENE),
        "--speed",
        "7200",
        "--temperature",
        "40",
        "--seed",
        "3",
        "--path",
        "linear",
        "--seconds",
        "0.25",
        "--json",
    ]
    assert main([*call, "--out", str(out)]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["revolutions"] == 30
    assert set(answer["rro_um"]) == set(answer["nrro_um"]) == {"radial", "radial_y", "axial"}
    assert answer["nrro_um"]["radial"] > answer["nrro_rms_um"]["radial"] > 0
    amplitudes = [g["amplitude_um"] for g in answer["lines"]]
    assert amplitudes == sorted(amplitudes, reverse=True)
    assert answer["status"] == "in contact"
    assert {"frequency_Hz", "amplitude_um", "direction", "cause"} <= set(answer["lines"][0])
    assert set(answer["statistics"]) > set(answer) & set(answer["statistics"])
    with (out / "record.csv").open() as file:
        rows = list(csv.DictReader(file))
    x = np.array([float(row["hub_x_um"]) for row in rows])
    rest = np.array([float(row["hub_x_nrro_um"]) for row in rows])
    assert np.ptp(x) == pytest.approx(answer["total_um"]["radial"], rel=1e-6)
    assert rest.std() == pytest.approx(answer["nrro_rms_um"]["radial"], rel=1e-3)
    time, angle, revolution = (np.array([float(row[name]) for row in rows]) for name in ("time_s", "angle_rad", "revolution"))
    assert angle - angle[0] == pytest.approx(2 * np.pi * 120 * (time - time[0]), abs=1e-5)
    assert set(revolution) == set(range(30))
    assert {"record.csv", "repeatable.csv", "lines.csv", "motion.png", "motion.svg", "spectrum.png", "spectrum.svg"} <= {
        f.name for f in out.iterdir()
    }


@pytest.mark.parametrize(
    ("options", "words"),
    [(["--speed", "0"], "--speed 0"), (["--speed", "7200", "--seconds", "0.01"], "at least two revolutions")],
)
def test_what_cannot_be_used_is_one_sentence(options, words, capsys):
    assert main(["runout", str(SCENE), *options]) == 2
    told = capsys.readouterr().err.strip()
    assert words in told
    assert len(told.splitlines()) == 1


def test_a_spindle_without_sections_to_look_at_is_refused(spindle):
    bodies = tuple(replace(b, regions=()) if b.turns else b for b in spindle.structure.bodies)
    with pytest.raises(BadInput, match="turning body made of section regions"):
        running.hub_probes(replace(spindle, structure=replace(spindle.structure, bodies=bodies)))


def test_a_perfect_spindle_runs_true(spindle, tmp_path):
    """No lines, no runout, and files that say so."""
    perfect = with_imperfections(spindle, Imperfections())
    found = runout(operating_point(perfect, Condition(20.0, 7200 * RPM)), 0.1)
    assert found.lines == ()
    assert found.values()[X].total < 1e-15
    answer = runout_json(found, "simulated", "linear", None)
    json.dumps(answer, allow_nan=False)
    write_runout(found, perfect, answer, tmp_path, lambda done: None)
    assert (tmp_path / "runout.rrd").is_file()
    assert (tmp_path / "lines.csv").read_text() == "frequency_Hz\n"


def test_the_inner_ring_may_turn_instead(spindle):
    """A shaft that turns in standing outer rings: the cage goes slower than half speed, and lines move with it."""
    turned = turning_inside(spindle)
    row = RowImperfections(ball_diameter=tuple(1e-7 * np.cos(2 * np.pi * np.arange(10) / 10)))
    point = operating_point(with_imperfections(turned, Imperfections(bearings={"upper": row})), Condition(20.0, 7200 * RPM))
    [only] = runout(point, 0.25, path="linear").lines
    assert only.causes[0].name == "fc"
    assert only.frequency == pytest.approx(120.0 - 69.527, rel=1e-4)  # the cage seen from the other ring
    assert hub_probes(turned)[0].body == "shaft"


def test_both_radial_probes_are_quoted(found):
    """An orbit may be longer along y than along x: what is called radial is that of x, and y stands beside it."""
    answer = runout_json(found, "linear", "linear", None) | {"speed_from": "--speed"}
    for direction, probe in (("radial", X), ("radial_y", Y), ("axial", AXIAL)):
        assert answer["rro_um"][direction] == answer["probes"][probe]["rro_um"]
    console = Console(record=True, width=120, file=io.StringIO())
    show_runout(console, answer, found.point.spindle)
    text = console.export_text()
    assert "(hub x)  (hub y)" in text
    assert f"{answer['rro_um']['radial_y']:.4f}" in text
    assert "radial (hub y)" in runout_section(found, answer)[1]


def test_the_report_section_holds_figures_and_lines(found):
    title, html = runout_section(found, runout_json(found, "linear", "linear", 3))
    assert title == "Runout"
    assert html.count("<svg") == html.count("</svg>") == 2
    assert f"{found.lines[0].frequency:.2f}" in html
    assert "asynchronous" in html


def test_the_report_section_is_in_nanometres(found):
    """Peak to valley and rms of the record itself, and amplitudes of lines, to a hundredth."""
    rows = [row for table in Page(f"<div>{runout_section(found, runout_json(found, 'linear', 'linear', 3))[1]}</div>").tables.values() for row in table]
    cut = found.by_lines
    told = {row[0]: row[1:] for row in rows}
    for words, expected in (
        ("peak to valley of the record", np.ptp(cut.value[:3], axis=(1, 2))),
        ("root mean square of the nonrepeatable part", np.sqrt(np.mean(cut.nonrepeatable[:3] ** 2, axis=(1, 2)))),
    ):
        assert [float(cell) for cell in told[words]] == pytest.approx(1e9 * expected, abs=0.00501)
    lines = [(row[0], row[2], float(row[3])) for row in rows if row[2] in ("radial", "axial")]
    assert len(lines) > 5
    assert lines == [(f"{g.frequency:.2f}", g.direction, pytest.approx(1e9 * g.amplitude, abs=0.00501)) for g in found.lines[: len(lines)]]


def test_signals_of_a_given_harmonic_answer(hot_point):
    from thermospindle.sim.running.excitation import harmonics

    forces = harmonics(hot_point)
    time = np.arange(50) / RATE
    one = replace(forces, line=forces.line[:1], frequency=forces.frequency[:1], force=forces.force[:1])
    other = replace(forces, line=forces.line[1:], frequency=forces.frequency[1:], force=forces.force[1:])
    probes = hub_probes(hot_point.spindle)
    parts = linear(hot_point, probes, time, one).value + linear(hot_point, probes, time, other).value
    assert parts == pytest.approx(linear(hot_point, probes, time).value, abs=1e-15)


def test_a_record_of_too_many_steps_is_not_stepped(hot_point):
    """It had filled the memory: a stiff seat of a light part asks for steps of picoseconds."""
    stiff = replace(hot_point, spindle=replace(hot_point.spindle, hammer=replace(hot_point.spindle.hammer, step=1e-10)))
    plan = planned(stiff)
    assert (plan.path, plan.pieces) == ("linear", 0)
    assert planned(hot_point).path == planned(stiff, element="ball-by-ball").path == "simulated"
    by_itself, asked = (runout(point, 0.2, path=path) for point, path in ((stiff, None), (hot_point, "linear")))
    assert [f"{line.frequency:.3f} {line.amplitude:.3e}" for line in by_itself.lines[:5]] == [f"{line.frequency:.3f} {line.amplitude:.3e}" for line in asked.lines[:5]]
    with pytest.raises(BadInput, match=r"steps of 0\.0001 us, for the stiffest mode of the model; allowed are 5e\+06: .* --path linear needs none"):
        runout(stiff, 0.2, path="simulated")


def test_a_simulated_record_tells_of_each_piece(hot_point):
    told: list[str] = []
    runout(hot_point, 0.1, progress=told.append)
    assert len(told) == planned(hot_point, 0.1).pieces > 1
