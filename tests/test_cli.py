"""The command line as a script sees it: JSON keys, exit codes, whole output folders, errors in one sentence."""

import json
import re

import numpy as np
import pytest

from tests.conftest import SCENE
from tests.test_site import ANSWERS
from thermospindle.cli import main
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.report.folder import MARK
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.effects import CATALOGUE
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
    computed = operating_point(load(SCENE), Condition(20.0, 7200 * RPM)).modes
    assert frequency == [m.frequency for m in computed if m.frequency < load(SCENE).hammer.band[1]]
    assert frequency == pytest.approx([1002.0, 1545.0, 1760.9, 1855.6, 2010.0, 4465.0, 4532.2, 5551.5], abs=0.5)
    for mode in found["modes"]:
        assert mode["kind"] in {"axial", "rocking", "lateral"}
        assert {"base", "bearings"} <= set(mode["energy"])
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
    assert main(["simulate", str(short_scene), "--temperatures", "20", "60", "--out", str(folder)]) == 0
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
    found = answer(capsys, "run", short_scene, "--temperatures", 20, 60, "--out", out, "--json")
    assert [c["temperature_C"] for c in found["conditions"]] == [20, 60]
    names = {p.name for p in out.iterdir()}
    assert {"report.html", "run.rrd", "table.csv", "modes.csv", "campaign", "spindle_20C.xml", "spindle_60C.xml", MARK} == names
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
    (["modes", SCENE, "--speed", "nan"], "not a finite number"),
    (["impact", SCENE, "--element", "magic"], "magic"),
    (["impact", SCENE, "--hits", "0"], "count of one or more"),
    (["impact", SCENE, "--level", "-3"], "must be positive"),
    (["simulate", SCENE], "needs the campaign folder"),
    (["simulate", SCENE, "--out", SCENE], "is not empty; a campaign is written to a new or empty folder"),
    (["runout", SCENE, "--speed", "0"], "a spindle at rest has no runout"),
    (["warmup", SCENE, "--minutes", "0"], "lasts longer than nothing"),
    (["map", SCENE, "--speed", "0"], "nominal speed of a map must be positive"),
    (["report", SCENE, "--out", SCENE], "did not write"),
    (["diagnose", SCENE, SCENE], "no campaign there"),
    (["inspect", SCENE / "spindle.toml"], "spindle.toml"),
    (["run", SCENE, "--out", SCENE], "did not write"),
    (["fly", SCENE], "fly"),
    (["compare", SCENE, SCENE], "no campaign there"),
    (["effects", "magic"], "'magic' is unknown; allowed are"),
    (["add", SCENE, "ring_growth"], "needs the folder"),
    (["add", SCENE, "ring_growth", "--out", SCENE / "more"], "may neither be, hold nor lie inside"),
    (["add", SCENE, "ring_growth", "--out", SCENE.parent], "may neither be, hold nor lie inside"),
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


# ---------------------------------------------------------------- compare, effects, add


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
    assert sum(s["share"] for s in found["misfit"]["shares"]["test"]) == pytest.approx(1.0)
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


def test_effects_are_listed(capsys):
    found = answer(capsys, "effects", "--json")["effects"]
    assert [e["name"] for e in found] == [e.name for e in CATALOGUE]
    assert all(set(e) == {"name", "title", "parameter", "unit", "neutral", "typical"} for e in found)
    assert main(["effects"]) == 0
    text = capsys.readouterr().out
    assert all(e.name in text for e in CATALOGUE)


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda e: e.name)
def test_effects_are_explained(capsys, effect):
    found = answer(capsys, "effects", effect.name, "--json")
    assert {"equation", "parameters", "sees", "resembles", "valid"} < set(found)
    keys = {"name", "unit", "neutral", "typical", "prior_sd", "limits", "meaning", "source", "choices", "counts"}
    assert all(set(p) == keys for p in found["parameters"])
    assert main(["effects", effect.name]) == 0
    text = " ".join(capsys.readouterr().out.split())
    for told in (effect.equation, effect.sees, effect.valid, *(p.source for p in effect.parameters)):
        assert " ".join(told.split()) in text


def frequencies(capsys, scene):
    return [m["frequency_Hz"] for m in answer(capsys, "modes", scene, "--temperature", 60, "--json")["modes"]]


def test_add_writes_a_scene_whose_modes_move(capsys, tmp_path):
    new = tmp_path / "bonded"
    found = answer(capsys, "add", SCENE, "bond_softening", "--out", new, "--json")
    assert found["added"][0]["values"]["hot_compliance"] == 12.5
    assert {p.name for p in new.iterdir()} == {"spindle.toml", "measured", "published", MARK}
    for name in ("measured/jang_2003/modes.csv", "published/jang_2003_analysis.csv"):
        assert (new / name).read_bytes() == (SCENE / name).read_bytes()
    assert (new / "spindle.toml").read_text().startswith((SCENE / "spindle.toml").read_text().rstrip())
    assert load(new).provenance["effects.bond_softening.values.transition"].origin == "assumed"
    pair = []
    for scene in (SCENE, new):
        modes = answer(capsys, "modes", scene, "--temperature", 60, "--json")["modes"]
        pair.append(min(m["frequency_Hz"] for m in modes if m["kind"] == "lateral"))
    assert pair[0] == pytest.approx(4120.0, abs=0.5)
    assert pair[1] == pytest.approx(3859, rel=0.01)  # tests/data/foreign_bond at 60 C: another program, this bond, tolerances of 1.5 %


def test_added_at_its_neutral_value_an_effect_moves_nothing(capsys, tmp_path):
    answer(capsys, "add", SCENE, "preload_loss", "--set", "loss=0", "--out", tmp_path / "n", "--json")
    assert frequencies(capsys, tmp_path / "n") == frequencies(capsys, SCENE)


def test_effects_add_up(capsys, tmp_path):
    answer(capsys, "add", SCENE, "preload_loss", "--out", tmp_path / "one", "--json")
    answer(capsys, "add", tmp_path / "one", "added_disk", "--set", "mass=2.5", "height=1", "--out", tmp_path / "two", "--json")
    assert [e.effect for e in load(tmp_path / "two").effects] == ["preload_loss", "added_disk"]
    assert load(tmp_path / "two").effects[1].values == {"mass": 2.5, "outer_radius": 12.5, "height": 1.0}
    both = [frequencies(capsys, tmp_path / name)[5] for name in ("one", "two")]
    assert both[1] < both[0] < frequencies(capsys, SCENE)[5]


DIAGNOSIS = {
    "verdict": "two effects",
    "candidates": [
        {"effects": ["soak_lag"], "parameters": {"hub_share": {"value": 0.1, "sd": 0.01, "unit": "1"}}},
        {
            "effects": ["preload_loss", "bond_softening"],
            "parameters": {
                "preload_loss.loss": {"value": 0.2, "sd": 0.01, "unit": "1"},
                "bond_softening.hot_compliance": {"value": 11.0, "sd": 0.5, "unit": "nm/N"},
                "bond_softening.transition": {"value": 47.0, "sd": 1.0, "unit": "C"},
            },
        },
        {"effects": ["bond_softening"], "parameters": {"hot_compliance": {"value": 99.0, "sd": 0.5, "unit": "nm/N"}}},
    ],
}


@pytest.fixture
def diagnosis(tmp_path):
    file = tmp_path / "diagnosis.json"
    file.write_text(json.dumps(DIAGNOSIS))
    return file


def test_add_takes_fitted_values_from_the_first_candidate_with_the_effect(capsys, tmp_path, diagnosis):
    arguments = ("add", SCENE, "bond_softening", "--from", diagnosis, "--set", "width=3", "--out", tmp_path / "b", "--json")
    found = answer(capsys, *arguments)
    chosen = {"hot_compliance": 11.0, "transition": 47.0, "width": 3.0}  # the rest is typical
    assert found["added"][0]["values"] == {"hot_compliance": 11.0, "cold_ratio": 4.75, "loss_factor": 0.04} | chosen
    said = load(tmp_path / "b").provenance["effects.bond_softening.values.transition"]
    assert said.origin == "calibrated"
    assert "diagnosis.json: hot_compliance, transition; set by hand: width" in said.source
    assert (
        answer(capsys, "add", SCENE, "soak_lag", "--from", diagnosis, "--out", tmp_path / "s", "--json")["added"][0]["values"]["hub_share"]
        == 0.1
    )


NOT_ADDED = [
    (["magic"], "'magic' is unknown; allowed are"),
    (["bond_softening", "--set", "warmth=3"], "warmth: unknown parameter; allowed are hot_compliance"),
    (["bond_softening", "--set", "transition=500"], "transition = 500 C: allowed is -40 to 200"),
    (["bond_softening", "--set", "transition"], "not of the form name=value"),
    (["bond_softening", "--set", "transition=hot"], "'hot' is not a number"),
    (["bond_softening", "--set", "transition=nan"], "nan"),
    (["bond_softening", "--from", "nowhere.json"], "nowhere.json: cannot be read"),
    (["bond_softening", "--from", str(SCENE / "spindle.toml")], "is not an answer of spindle diagnose"),
    (
        ["ring_growth", "--from", "DIAGNOSIS"],
        "no candidate has effect ring_growth; its candidates are soak_lag, preload_loss, bond_softening",
    ),
]


@pytest.mark.parametrize(("arguments", "said"), NOT_ADDED, ids=[" ".join(a[:3])[-30:] for a, _ in NOT_ADDED])
def test_what_cannot_be_added_leaves_nothing(capsys, tmp_path, diagnosis, arguments, said):
    given = [str(diagnosis) if a == "DIAGNOSIS" else a for a in arguments]
    try:
        code = main(["add", str(SCENE), *given, "--out", str(tmp_path / "new")])
    except SystemExit as stop:
        code = stop.code
    captured = capsys.readouterr()
    assert code == 2
    assert captured.out == ""
    assert said in captured.err
    assert len(captured.err.strip().splitlines()) == 1
    assert [p.name for p in tmp_path.iterdir()] == ["diagnosis.json"]


def test_an_effect_is_added_once(capsys, tmp_path):
    answer(capsys, "add", SCENE, "ring_growth", "--out", tmp_path / "one", "--json")
    assert main(["add", str(tmp_path / "one"), "ring_growth", "--out", str(tmp_path / "two")]) == 2
    assert "effects.ring_growth: is there already" in capsys.readouterr().err
    assert not (tmp_path / "two").exists()


def test_nothing_is_left_of_a_scene_that_does_not_load(capsys, monkeypatch, tmp_path):
    """The new scene is read again before it is accepted; here something is wrong with it only then."""

    def refuse(spindle, catalogue):
        raise BadInput(f"{spindle.file}: effects.ring_growth: cannot be")

    monkeypatch.setattr("thermospindle.diagnosis.add.resolved", refuse)
    assert main(["add", str(SCENE), "ring_growth", "--out", str(tmp_path / "new")]) == 2
    assert f"{tmp_path / 'new' / 'spindle.toml'}: effects.ring_growth: cannot be" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
