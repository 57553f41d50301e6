"""The command line as a script sees it: JSON keys, exit codes, whole output folders, errors in one sentence."""

import json
import re

import numpy as np
import pytest

from sim.campaign import read_campaign
from sim.folder import MARK
from spindle import main
from tests.conftest import SCENE


@pytest.fixture(scope="module")
def short_scene(tmp_path_factory):
    """The paper's spindle with one short hit a point."""
    folder = tmp_path_factory.mktemp("scenes") / "short"
    folder.mkdir()
    text = (SCENE / "spindle.toml").read_text(encoding="utf-8")
    text = re.sub(r"record_length_s = .*", "record_length_s = 0.10", text)
    text = re.sub(r"hits = .*", "hits = 2", text)
    (folder / "spindle.toml").write_text(text, encoding="utf-8")
    return folder


def answer(capsys, *arguments):
    assert main([str(a) for a in arguments]) == 0
    captured = capsys.readouterr()
    return json.loads(captured.out)


def test_table(capsys, tmp_path):
    out = tmp_path / "t"
    found = answer(capsys, "table", SCENE, "--temperatures", 20, 30, 40, 50, 60, "--json", "--out", out)
    assert found["temperature_C"] == [20, 30, 40, 50, 60]
    assert set(found["bearings"]) == {"upper", "lower"}
    keys = {"contact_angle_deg", "deformation_um", "contact_force_N", "ball_stiffness_N_per_m", "preload_N"}
    keys |= {"radial_stiffness_N_per_m", "axial_stiffness_N_per_m"}
    for bearing in found["bearings"].values():
        assert keys <= set(bearing)
        assert all(len(bearing[k]) == 5 for k in keys)
    assert found["bearings"]["upper"]["preload_N"][0] == pytest.approx(16.0)
    assert {p.name for p in out.iterdir()} == {"table.csv", MARK}


def test_modes(capsys, tmp_path):
    found = answer(capsys, "modes", SCENE, "--temperature", 20, "--speed", 7200, "--json", "--out", tmp_path / "m")
    frequency = [m["frequency_Hz"] for m in found["modes"]]
    assert frequency == pytest.approx([1002.1, 1545.0, 1793.3, 1821.6, 2009.9, 2323.1, 2468.4], abs=0.5)
    for mode in found["modes"]:
        assert mode["kind"] in {"axial", "rocking", "lateral"}
        assert {"base", "bearings"} <= set(mode["energy"])
        assert sum(mode["energy"].values()) == pytest.approx(1.0)
        assert 0 < mode["damping_ratio"] < 0.1
    assert {p.name for p in (tmp_path / "m").iterdir()} == {"modes.csv", "spindle.xml", MARK}


def test_impact(capsys, short_scene):
    found = answer(capsys, "impact", short_scene, "--temperature", 60, "--json")
    assert {"frequency_Hz", "frequency_sd_Hz", "damping_ratio", "damping_ratio_sd"} == set(found["modes"][0])
    assert found["modes"][0]["frequency_Hz"] == pytest.approx(1000.3, abs=1.0)


def test_simulate_writes_a_campaign_that_reads(capsys, short_scene, tmp_path):
    found = answer(capsys, "simulate", short_scene, "--temperatures", 20, 60, "--out", tmp_path / "c", "--json")
    campaign = read_campaign(tmp_path / "c")
    assert [t.id for t in campaign.tests] == found["tests"] == ["T20_n0", "T60_n0"]
    assert campaign.tests[1].frf.sd is not None


def test_run_and_inspect(capsys, short_scene, tmp_path):
    out = tmp_path / "run"
    found = answer(capsys, "run", short_scene, "--temperatures", 20, 60, "--out", out, "--json")
    assert [c["temperature_C"] for c in found["conditions"]] == [20, 60]
    names = {p.name for p in out.iterdir()}
    assert {"report.html", "run.rrd", "table.csv", "modes.csv", "campaign", "spindle_20C.xml", "spindle_60C.xml", MARK} == names
    log = answer(capsys, "inspect", out / "run.rrd", "--json")
    campaign = read_campaign(out / "campaign")
    for test in campaign.tests:
        frf = log["frfs"][test.id]
        assert np.array_equal(np.array(frf["real"]) + 1j * np.array(frf["imag"]), test.frf.value)
        assert frf["frequency_Hz"] == test.frf.frequency.tolist()
    again = answer(capsys, "run", short_scene, "--temperatures", 20, "--out", out, "--json")
    assert len(again["conditions"]) == 1
    assert not (out / "spindle_60C.xml").exists()


BAD = [
    (["modes", "nowhere"], "no scene there"),
    (["modes", SCENE, "--temperature", "-300"], "below absolute zero"),
    (["modes", SCENE, "--temperature", "warm"], "warm"),
    (["modes", SCENE, "--speed", "nan"], "not a finite number"),
    (["impact", SCENE, "--element", "magic"], "magic"),
    (["impact", SCENE, "--hits", "0"], "count of one or more"),
    (["impact", SCENE, "--level", "-3"], "must be positive"),
    (["simulate", SCENE], "needs the campaign folder"),
    (["inspect", SCENE / "spindle.toml"], "spindle.toml"),
    (["run", SCENE, "--out", SCENE], "did not write"),
    (["fly", SCENE], "fly"),
]


@pytest.mark.parametrize(("arguments", "said"), BAD, ids=[" ".join(map(str, b[0][:1] + b[0][2:])) for b in BAD])
def test_bad_input_is_one_sentence_and_exit_code_2(capsys, arguments, said):
    before = sorted(p.name for p in SCENE.iterdir())
    try:
        code = main([str(a) for a in arguments])
    except SystemExit as stop:
        code = stop.code
    captured = capsys.readouterr()
    assert code == 2
    assert captured.out == ""
    assert said in captured.err
    assert captured.err.startswith("spindle: ")
    assert len(captured.err.strip().splitlines()) == 1
    assert sorted(p.name for p in SCENE.iterdir()) == before


def test_nothing_is_left_of_a_stopped_run(monkeypatch, capsys, short_scene, tmp_path):
    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("sim.output.write_report", stop)
    assert main(["run", str(short_scene), "--temperatures", "20", "--out", str(tmp_path / "out")]) == 130
    assert list(tmp_path.iterdir()) == []
    assert "stopped" in capsys.readouterr().err


def test_people_see_tables(capsys, short_scene):
    assert main(["table", str(SCENE), "--temperatures", "20", "60"]) == 0
    text = capsys.readouterr().out
    assert "24.51" in text
    assert "…" not in text
    assert main(["modes", str(SCENE)]) == 0
    text = capsys.readouterr().out
    assert "1002.07" in text
    assert "rocking" in text
