"""The command line as a script sees it: JSON keys, exit codes, whole output folders, errors in one sentence."""

import json
import re
import subprocess
import sys
from xml.etree import ElementTree

import numpy as np
import pytest

from tests.command_line import answer, refused
from tests.conftest import DATA, SCENE
from tests.test_site import ANSWERS
from thermospindle.cli import main
from thermospindle.model.errors import instead
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.options import parsers
from thermospindle.report.folder import MARK
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.operating import operating_point


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
    computed = operating_point(load(SCENE), Condition(20.0, 7200 * RPM)).modes
    assert frequency == [m.frequency for m in computed if m.frequency < load(SCENE).hammer.band[1]]
    assert frequency == pytest.approx([1002.0, 1545.0, 1760.9, 1855.6, 2010.0, 4465.0, 4532.2, 5551.5], abs=0.5)
    for mode in found["modes"]:
        assert mode["kind"] in {"axial", "rocking", "lateral"}
        assert {"base", "bearings"} <= set(mode["energy"])
        shape = np.array([complex(p["real"], p["imaginary"]) for p in mode["shape"]])
        assert [p["node"] for p in mode["shape"]] == [1, 2, 3, 4, 5, 6, 7]
        assert max(shape.real) == pytest.approx(1.0, abs=1e-12)
        assert (np.abs(shape.imag).max() < 0.02) == (mode["whirl"] == "none")  # what whirls is a quarter of a turn behind along y
        assert sum(mode["energy"].values()) == pytest.approx(1.0)
        assert 0 < mode["damping_ratio"] < 0.1
    assert {p.name for p in (tmp_path / "m").iterdir()} == {"modes.csv", "spindle.xml", MARK}


def test_impact(capsys, short_scene):
    found = answer(capsys, "impact", short_scene, "--temperature", 60, "--json")
    assert {"frequency_Hz", "frequency_sd_Hz", "damping_ratio", "damping_ratio_sd"} == set(found["modes"][0])
    band = load(SCENE).hammer.band
    computed = [m for m in operating_point(load(SCENE), Condition(60.0)).modes if band[0] < m.frequency < band[1]]
    for mode in found["modes"]:  # every one is the model's, to 0.1 % in frequency and 5 % in damping, or as well as it is known
        nearest = min(computed, key=lambda m: abs(m.frequency - mode["frequency_Hz"]))
        assert mode["frequency_Hz"] == pytest.approx(nearest.frequency, rel=1e-3, abs=4 * mode["frequency_sd_Hz"])
        assert mode["damping_ratio"] == pytest.approx(nearest.damping_ratio, rel=0.05, abs=4 * mode["damping_ratio_sd"])
        assert abs(mode["frequency_Hz"] - nearest.frequency) < 6 * mode["frequency_sd_Hz"] + 0.1


@pytest.fixture(scope="module")
def simulated(short_scene, tmp_path_factory):
    """The campaign of the short scene's own tests."""
    folder = tmp_path_factory.mktemp("simulated") / "c"
    assert main(["simulate", str(short_scene), "--temperatures", "20", "60", "--element", "reduced", "--out", str(folder)]) == 0
    return folder


def test_simulate_writes_a_campaign_that_reads(capsys, simulated):
    campaign = read_campaign(simulated)
    assert [t.id for t in campaign.tests] == ["T20_n0", "T60_n0"]
    assert campaign.tests[1].frf.sd is not None


def test_the_campaign_that_ships_is_of_this_scene(capsys):
    """scenes/hdd_2003/virtual: the model's own tests, so that compare finds nothing but noise."""
    found = answer(capsys, "compare", SCENE, SCENE / "virtual" / "soak_20_60", "--json")
    assert [t["temperature_C"] for t in found["tests"]] == [20, 60]
    assert all(len(t["modes"]) == 8 and not t["missing_Hz"] for t in found["tests"])
    assert found["rms_pull"] < 1.5


def test_run_and_inspect(capsys, short_scene, tmp_path):
    out = tmp_path / "run"
    found = answer(capsys, "run", short_scene, "--temperatures", 20, 60, "--element", "reduced", "--out", out, "--json")
    assert [c["temperature_C"] for c in found["conditions"]] == [20, 60]
    names = {p.name for p in out.iterdir()}
    assert {"report.html", "pictures", "run.rrd", "table.csv", "modes.csv", "campaign", "spindle_20C.xml", "spindle_60C.xml", MARK} == names
    drawn = [ElementTree.parse(p).getroot() for p in (out / "pictures").iterdir()]
    assert len(drawn) == (out / "report.html").read_text(encoding="utf-8").count("<svg ")
    assert all(d.tag == "{http://www.w3.org/2000/svg}svg" and d[0].text for d in drawn)
    log = answer(capsys, "inspect", out / "run.rrd", "--json")
    assert set(log) == {"warnings", *ANSWERS["inspect"]}
    campaign = read_campaign(out / "campaign")
    for test in campaign.tests:
        frf = log["frfs"][test.id]
        assert np.array_equal(np.array(frf["real"]) + 1j * np.array(frf["imag"]), test.frf.value)
        assert frf["frequency_Hz"] == test.frf.frequency.tolist()


@pytest.mark.slow
def test_a_run_takes_the_place_of_an_earlier_one(capsys, short_scene, tmp_path):
    for temperatures in ([20, 60], [20]):
        found = answer(capsys, "run", short_scene, "--temperatures", *temperatures, "--out", tmp_path / "run", "--json")
        assert len(found["conditions"]) == len(temperatures)
        assert (tmp_path / "run" / "spindle_60C.xml").exists() == (60 in temperatures)


BAD = [
    (["modes", "nowhere"], "no scene there"),
    (["modes", SCENE, "--temperature", "-300"], "below absolute zero"),
    (["modes", SCENE, "--temperature", "warm"], "'warm' is not a number"),
    (["modes", SCENE, "--temperature", "1_0"], "'1_0' is not a number"),
    (["modes", SCENE, "--highest", "\u0664"], "'\u0664' is not a number"),
    (["modes", SCENE, "--speed", "nan"], "not a finite number"),
    (["impact", SCENE, "--element", "magic"], "magic"),
    (["impact", SCENE, "--hits", "0"], "count of one or more"),
    (["impact", SCENE, "--level", "-3"], "must be positive"),
    (["impact", SCENE, "--level", "5e-324"], "must be positive, 1e-06 N or more"),
    (["simulate", SCENE], "needs the campaign folder"),
    (["simulate", SCENE, "--out", SCENE], "is not empty; a campaign is written to a new or empty folder"),
    (["runout", SCENE, "--speed", "0"], "a spindle at rest has no runout"),
    (["warmup", SCENE, "--minutes", "0"], "lasts longer than nothing"),
    (["warmup", SCENE, "--minutes", "1e-300"], "lasts longer than nothing"),
    (["map", SCENE, "--speed", "0"], "nominal speed of a map must be positive"),
    (["report", SCENE, "--out", SCENE], "did not write"),
    (["diagnose", SCENE, SCENE], "no campaign there"),
    (["inspect", SCENE / "spindle.toml"], "spindle.toml"),
    (["run", SCENE, "--out", SCENE], "did not write"),
    (["fly", SCENE], "fly"),
    (["compare", SCENE, SCENE], "no campaign there"),
    (["effects", "magic"], "'magic' is unknown; allowed are"),
    (["effects", str(SCENE)], f"of the scene in that folder: spindle effects --scene {SCENE}"),
    (["add", SCENE, "ring_growth"], "needs the folder"),
    (["add", SCENE, "ring_growth", "--out", SCENE / "more"], "may neither be, hold nor lie inside"),
    (["add", SCENE, "ring_growth", "--out", SCENE.parent], "may neither be, hold nor lie inside"),
]


@pytest.mark.parametrize(("arguments", "said"), BAD, ids=[" ".join(map(str, b[0][:1] + b[0][2:])) for b in BAD])
def test_bad_input_is_one_sentence_and_exit_code_2(capsys, arguments, said):
    before = sorted(p.name for p in SCENE.iterdir())
    assert said in refused(capsys, *arguments)
    assert sorted(p.name for p in SCENE.iterdir()) == before


def test_no_option_takes_two_dashes_for_its_value(capsys):
    """Python 3.11 makes an empty list of them, on which every verb ended with a traceback."""
    every = [(verb, action.option_strings[0]) for verb, known in parsers()[1].items() for action in known._actions if action.option_strings and action.nargs != 0]
    assert len(every) > 60
    for verb, option in every:
        with pytest.raises(SystemExit) as stop:
            main([verb, str(SCENE), f"{option}=--"])
        assert stop.value.code == 2
        assert "'--'" in capsys.readouterr().err, (verb, option)


def test_nothing_is_left_of_a_stopped_run(monkeypatch, capsys, short_scene, tmp_path):
    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("thermospindle.report.page.report.write_report", stop)
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
    assert "1002.00" in text
    assert "rocking" in text


def test_compare(capsys, tmp_path):
    """Errors are computed - measured; without FRFs no FRAC, without shapes no MAC."""
    found = answer(capsys, "compare", SCENE, SCENE / "measured" / "jang_2003", "--json", "--out", tmp_path / "c")
    assert json.loads((tmp_path / "c" / "comparison.json").read_text()) == found
    assert {p.name for p in (tmp_path / "c").iterdir()} == {"comparison.json", "report.html", "pulls.svg", "pulls.png", MARK}
    cold, hot = found["tests"]
    assert (cold["id"], cold["temperature_C"], cold["speed_rpm"]) == ("T20", 20.0, 0.0)
    assert [round(m["error_Hz"]) for m in cold["modes"]] == [-21, -7, 57, 33, -58]
    assert [round(m["pull"]) for m in hot["modes"]] == [-26, -8, 65, 39, -53]  # 1 Hz, and 0.2 K of up to 1.3 Hz/K
    first = cold["modes"][0]
    assert first["error_percent"] == pytest.approx(100 * (first["computed_Hz"] / first["measured_Hz"] - 1))
    assert first["damping_measured"] is first["damping_pull"] is first["mac"] is None
    assert cold["frac"] == found["comac"] == {}
    assert found["rms_pull"] == pytest.approx(41.5, abs=0.1)


@pytest.mark.slow
def test_diagnose(capsys, tmp_path):
    """The paper's ten numbers, five modes at two temperatures, leave more than one answer; the folder holds the page and its pictures."""
    found = answer(capsys, "diagnose", SCENE, SCENE / "measured" / "jang_2003", "--json", "--out", tmp_path / "d")
    assert json.loads((tmp_path / "d" / "diagnosis.json").read_text()) == found
    written = {p.name for p in (tmp_path / "d").iterdir()}
    assert {"diagnosis.json", "report.html", MARK, "errors.svg", "errors.png", "explanations.svg", "explanations.png"} <= written
    assert found["verdict"] in ("ambiguous", "unexplained")
    assert found["misfit"]["count"] == 10
    by_test = found["misfit"]["shares"]["test"]  # of what exceeds its expectation, where anything does
    assert sum(s["share"] for s in by_test) == pytest.approx(1.0 if any(s["chi2"] > s["count"] for s in by_test) else 0.0)
    assert found["noise"] == {"T20": "the table of modes", "T60": "the table of modes"}
    assert isinstance(found["where"], list)


def test_people_see_a_comparison(capsys, short_scene, simulated):
    campaign = simulated
    assert main(["compare", str(short_scene), str(campaign)]) == 0
    short = capsys.readouterr().out
    assert re.match(r"short (nearly )?agrees with the tests", short)
    assert "CSAC" not in short
    assert main(["compare", str(short_scene), str(campaign), "--verbose"]) == 0
    text = capsys.readouterr().out
    assert "COMAC" in text
    assert "CSAC" in text
    assert "1002.00" in text
    assert "…" not in text


@pytest.mark.parametrize("verb", ["impact", "runout"])
def test_balls_by_themselves_are_refused_where_none_are(verb, capsys):
    """Bearings given by numbers were stepped as linear ones without a word."""
    assert main([verb, "mk7702", "--element", "ball-by-ball"]) == 2
    assert capsys.readouterr().err.strip() == "spindle: --element ball-by-ball: no bearing of mk7702 has balls; allowed is linear"


def test_the_name_that_is_meant_has_all_words_that_were_said():
    names = ["shaft", "rear housing", "rear inner rings", "front inner rings"]
    assert instead("rear ring", names) == "did you mean rear inner rings?"
    assert instead("rear hous", names) == "did you mean rear housing?"
    assert instead("x", names).startswith("allowed are shaft, rear housing")


@pytest.mark.slow
def test_what_is_asked_to_end_stops_as_by_a_key():
    """`timeout` ends a process by SIGTERM: workers were left to the system, and Python told of semaphores."""
    command = [sys.executable, "-m", "thermospindle", "diagnose", "hdd_2003", str(DATA / "foreign_bond"), "--json"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    assert "steps done" in process.stderr.readline()
    process.terminate()
    out, said = process.communicate(timeout=60)
    assert (process.returncode, out) == (130, "")
    assert said.splitlines()[-1] == "spindle: stopped; nothing was left half written"
    assert "semlock" not in said
    assert "Traceback" not in said
