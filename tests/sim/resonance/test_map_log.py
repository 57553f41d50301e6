"""Log and command line of a map."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.sim.resonance.conftest import NOMINAL
from thermospindle.cli import main
from thermospindle.model.errors import BadInput
from thermospindle.model.units import RPM
from thermospindle.report.log.read import read_log
from thermospindle.report.log.told import describe, log_json
from thermospindle.report.log.turning.map import write_map_log
from thermospindle.report.text.resonance import map_json
from thermospindle.sim.resonance.map import resonance_map

SCENE = Path(__file__).parents[3] / "scenes" / "hdd_2003"


@pytest.mark.slow
def test_one_temperature_makes_a_campbell_diagram(tmp_path, capsys):
    """With the numbers of a map over several, and without the pictures over temperature; it was refused."""
    asked = ["map", str(SCENE), "--speeds", "3600", "7200", "--json", "--temperatures", "20"]
    assert main([*asked, "--out", str(tmp_path / "one")]) == 0
    one = json.loads(capsys.readouterr().out)
    assert main([*asked, "30"]) == 0
    more = json.loads(capsys.readouterr().out)
    assert [m["frequency_Hz"] for m in one["modes"]] == [m["frequency_Hz"][:1] for m in more["modes"]]
    assert one["nrro_um"]["over_speed"]["speed_rpm"][-1] == 7200.0
    assert one["mapped"].startswith("Mapped at one temperature, 20 C, and at 2 speeds")
    assert "crosses no line at 20 C" in one["sentences"][0]
    assert {p.name for p in (tmp_path / "one").glob("*.png")} == {"campbell.png", "nrro.png"}
    assert main(["inspect", str(tmp_path / "one" / "map.rrd")]) == 0
    assert "modes at 1 temperature x 2 speeds" in capsys.readouterr().out
    assert main(["map", str(SCENE), "--speeds", "7200"]) == 2
    assert "--speeds 7200: a map needs at least two different ones, the nominal 7200 rpm included" in capsys.readouterr().err


def test_log_gives_the_map_back(light, tmp_path):
    """Grid and natural frequencies bit for bit, coincidences as told; a timeline for each axis, and a blueprint."""
    met = resonance_map(light, [20.0, 58.5], np.array([6000, 8400]) * RPM, NOMINAL)
    assert (len(met.temperatures), len(met.speeds)) == (2, 3)
    assert len(met.coincidences) > 10
    write_map_log(met, tmp_path / "map.rrd")
    read = read_log(tmp_path / "map.rrd")
    assert read.kind == "map"
    temperatures, speeds, modes = read.grid
    assert np.array_equal(temperatures, met.temperatures)
    assert np.array_equal(speeds, met.speeds)
    for m, track in enumerate(met.modes):
        assert np.array_equal(modes[:, m], track.frequency)
    told = map_json(met)["coincidences"]
    assert read.rows("/numbers/coincidences") == told
    assert {"temperature, 0.01 C", "speed"} <= set(read.timelines)
    assert read.blueprint
    assert f"{len(told)} coincidences" in describe(read)
    assert log_json(read)["modes_Hz"][0][0][0] == met.modes[0].frequency[0, 0]


@pytest.mark.slow
def test_log_without_its_numbers_is_refused(met, tmp_path):
    write_map_log(met, tmp_path / "map.rrd")
    whole = read_log(tmp_path / "map.rrd")
    for entity in ("/numbers/modes", "/numbers/speeds"):
        less = replace(whole, columns={k: v for k, v in whole.columns.items() if k != entity})
        with pytest.raises(BadInput, match=rf"map.rrd: is not a whole log of thermospindle: .*{entity}"):
            log_json(less)
    with pytest.raises(BadInput, match="folder"):
        write_map_log(met, tmp_path / "none" / "map.rrd")


@pytest.mark.slow
def test_map_from_the_command_line(tmp_path, capsys):
    scene, out = str(SCENE), tmp_path / "out"
    grid = ["--temperatures", "20", "50", "--speeds", "5000", "8000"]
    assert main(["map", scene, *grid, "--speed", "7200", "--json", "--out", str(out)]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["grid"]["speed_rpm"] == pytest.approx([5000.0, 7200.0, 8000.0])
    assert any(c["line"] == "30 fc" and c["mode"] == 5 for c in answer["coincidences"])
    assert {p.name for p in out.iterdir()} >= {"coincidences.csv", "modes.csv", "campbell.png", "campbell.svg", "temperature.png", "map.rrd"}
    assert main(["inspect", str(out / "map.rrd"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["coincidences"] == answer["coincidences"]
    assert main(["map", scene, "--speed", "0"]) == 2
    assert "--speed 0" in capsys.readouterr().err
