"""A warm-up in JSON, rows, words and figures, and from the command line."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import pytest

from tests.sim.conftest import SPEED
from thermospindle.cli import main
from thermospindle.model.machine import Condition
from thermospindle.report.figures.warmup import figure
from thermospindle.report.text import warmup as text
from thermospindle.report.text.warmup import rows, warmup_json, warmup_section
from thermospindle.sim.operating import operating_point
from thermospindle.sim.warmup import energy

SCENE = Path(__file__).parents[2] / "scenes" / "hdd_2003"


def test_answer_as_json_and_rows(warm):
    answer = warmup_json(warm)
    count = len(answer["time_s"])
    assert count == len(answer["preload_N"]) == len(answer["friction_W"]) == len(answer["frequencies_Hz"])
    assert all(len(series) == count for series in answer["temperature_C"].values())
    assert set(answer["temperature_C"]) == {g.name for g in warm.spindle.regions}
    assert answer["frequencies_Hz"][0] == pytest.approx(
        [m.frequency for m in operating_point(warm.spindle, Condition(20.0, SPEED)).modes[:8]]
    )
    assert answer["time_constant_s"] == warm.time_constant
    header, body = rows(warm)
    assert len(body) == count
    assert all(len(line) == len(header) for line in body)
    assert header[0] == "time_s"
    title, html = warmup_section(warm)
    assert title == "Warm-up"
    assert html.count("<svg") == 1
    assert "163 s" in html


def test_what_comes_back_of_a_load_is_told_as_it_is(warm):
    near = replace(warm, feedback=0.625)
    assert warmup_json(near)["steady"]["load_feedback"] == 0.625
    assert "it is near runaway, 62% of a load that is added come back as heat" in text.told(near)
    assert "it does not run away" in text.told(replace(warm, feedback=0.375))


def test_what_moves_most_is_told_of_any_time(warm):
    """A frequency that comes back and a preload that falls on the way are told with their time, not only where they end."""
    frequencies = warm.frequencies.copy()
    frequencies[3, 4] += 700.0
    told = text.told(replace(warm, frequencies=frequencies))
    shift = frequencies[3, 4] - frequencies[0, 4]
    assert f"f5 ({warm.modes[4].kind}) moves most: it is {frequencies[3, 4]:.1f} Hz at {warm.times[3] / 60:.2f} min, {shift:+.1f} Hz from" in told
    every = [load for m in (*warm.moments, warm.steady) for load in m.preload.values()]
    assert f"smallest preload of any bearing is {min(every):.2f} N (" in told
    assert f"largest {max(every):.2f} N (" in told
    assert "moves most" in warmup_section(warm)[1]


def test_units_go_with_the_size_of_the_machine(warm, monkeypatch):
    """A disk drive is told in milliwatts and joules, a machine tool in watts and kilojoules, in words and figure alike."""
    assert [axes.get_ylabel() for axes in figure(warm).axes][2] == "friction heat, mW"
    assert f"bearings {energy(warm)['friction']:.1f} J in" in warmup_section(warm)[1]
    hot = replace(warm, moments=tuple(replace(m, friction={b: 1e4 * q for b, q in m.friction.items()}) for m in warm.moments))
    axes = figure(hot).axes[2]
    assert axes.get_ylabel() == "friction heat, W"
    assert axes.lines[0].get_ydata() == pytest.approx([m.friction[warm.spindle.bearings[0].name] for m in hot.moments])
    monkeypatch.setattr(text, "energy", lambda warmup: {"motor": 0.0, "friction": 2544024.0, "convection": 2139693.0, "stored": 404331.0})
    assert "bearings 2544.0 kJ in; convection 2139.7 kJ out; stored 404.3 kJ" in warmup_section(warm)[1]
    monkeypatch.setattr(text, "energy", lambda warmup: {"motor": 0.0, "friction": 0.0, "convection": -1664.3, "stored": 1664.3})
    assert "bearings 0.0 J in; convection 1664.3 J in; stored 1664.3 J" in warmup_section(warm)[1]  # it was -1664.3 J out of a spindle in a warm chamber


@pytest.mark.slow
def test_soak_from_the_command_line(tmp_path, capsys):
    scene, out = str(SCENE), tmp_path / "out"
    assert main(["warmup", scene, "--minutes", "0.5", "--json", "--out", str(out), "--soak", "60"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["time_s"][-1] == pytest.approx(30.0)
    assert (answer["speed_rpm"], answer["air_C"]) == (0.0, 60.0)
    assert answer["steady"]["preload_N"] == pytest.approx(8.002, abs=0.01)
    assert {p.name for p in out.iterdir()} >= {"warmup.csv", "warmup.png", "warmup.svg"}
    with (out / "warmup.csv").open() as file:
        assert file.readline().startswith("# scene hdd_2003")
        table = list(csv.DictReader(file))
    assert [float(row["preload of lower bearing_N"]) for row in table] == answer["preload_N"]


def test_warmups_that_are_refused(capsys):
    assert main(["warmup", str(SCENE), "--minutes", "0"]) == 2
    assert "--minutes 0" in capsys.readouterr().err
    assert main(["warmup", str(SCENE), "--speed", "300000"]) == 2
    assert "300000 rpm" in capsys.readouterr().err
