"""Designs side by side: as each is alone, drawn apart, and how probably one is better."""

import json

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.studies import COMPARED, files, study
from thermospindle.cli import main
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point
from thermospindle.sim.study.comparison import better
from thermospindle.sim.study.form import Steps
from thermospindle.sim.study.variants import combination


def test_every_combination_comes_once():
    vary = (("a", (1, 2, 3)), ("b", ("x", "y")))
    every = [combination(vary, k) for k in range(6)]
    assert len({tuple(c.items()) for c in every}) == 6
    assert every[1] == {"a": 1, "b": "y"}
    assert Steps.model_validate({"from": 1.0, "to": 100.0, "steps": 3, "spacing": "log"}).values() == pytest.approx((1.0, 10.0, 100.0))


def test_designs_stand_side_by_side_as_each_is_alone(tmp_path, capsys):
    out, rows = study(tmp_path, COMPARED + "runout = true\n")
    told = json.loads(capsys.readouterr().out)
    figures = told["conditions"][0]["figures"]
    assert [d["design"] for d in told["designs"]] == ["hdd_2003", "mk7702"] == [r["design"] for r in rows]
    for name in ("hdd_2003", "mk7702"):
        own = operating_point(load(ROOT / "scenes" / name), Condition(20.0, 7200 * RPM))
        lowest = own.modes_below(1e5)[0]
        assert figures["lowest_Hz"]["designs"][name] == {"nominal": pytest.approx(lowest.frequency, rel=1e-12)}
        assert figures["lowest_damping_ratio"]["designs"][name]["nominal"] == pytest.approx(lowest.damping_ratio, rel=1e-9)
    assert figures["stiffness_N_per_um.x"]["designs"]["mk7702"]["nominal"] == pytest.approx(235.6035, rel=1e-6)  # the nose, with shear, as `model.rotor.static` tells it
    assert (figures["lowest_Hz"]["better"], figures["rro_um.x"]["better"]) == ("higher", "lower")
    nonrepeatable = figures["nrro_six_sigma_um.x"]["designs"]  # of bearings given by numbers 0 was told, and that they are the better ones
    assert nonrepeatable["hdd_2003"]["nominal"] > 0
    assert nonrepeatable["mk7702"]["nominal"] is None
    assert (out / "comparison.png").is_file()
    assert main(["inspect", str(out / "study.rrd"), "--json"]) == 0
    log = json.loads(capsys.readouterr().out)
    assert log["columns"]["lowest_Hz"] == [r["lowest_Hz"] for r in rows]
    assert log["scene"] == told["scene"]
    assert main(["study", str(tmp_path / "study.toml"), "--out", str(tmp_path / "again")]) == 0
    assert "7200 rpm" in capsys.readouterr().out
    assert files(out) == files(tmp_path / "again")


def test_what_does_not_repeat_is_unknown_without_balls(tmp_path, capsys):
    """Of bearings given by numbers: a study and a runout told it as 0, where maps and comparisons leave it out."""
    text = COMPARED.replace("comparison", "monte-carlo").replace('scenes = ["hdd_2003", "mk7702"]', 'scene = "mk7702"')
    out, rows = study(tmp_path, text + "draws = 3\nrunout = true\n")
    condition = json.loads(capsys.readouterr().out)["conditions"][0]
    assert "rro_um" in condition
    assert condition["nrro_six_sigma_um"] == {}
    assert not any("nrro" in key for key in rows[0])
    assert (out / "spread.png").is_file()
    assert main(["runout", str(ROOT / "scenes" / "templates" / "rotor.toml"), "--path", "linear"]) == 0
    said = capsys.readouterr()
    assert "roll no balls: what does not repeat every revolution (NRRO, asynchronous error motion) is unknown" in " ".join(said.err.split())
    told = {" ".join(line.split()[:6]): line.split()[-3:] for line in said.out.splitlines() if line.strip()}
    assert told["root mean square of the nonrepeatable"] == told["six standard deviations of the nonrepeatable"] == ["-", "-", "-"]
    assert main(["runout", "mk7702", "--path", "linear", "--seconds", "0.1", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["nrro_um"] == answer["averaged"]["nrro_um"] == answer["asynchronous_error_um"] == {"radial": None, "radial_y": None, "axial": None}
    assert answer["imperfections"] == "drawn from seed 0"  # as map and report have them: the scene names none
    assert answer["rro_um"]["radial"] > 1e-5


def test_drawn_designs_are_drawn_apart_and_gone_on_with(tmp_path, capsys):
    out, rows = study(tmp_path, COMPARED + "draws = 10\nchunk = 4\n")
    told = json.loads(capsys.readouterr().out)
    own = told["conditions"][0]["figures"]["lowest_Hz"]
    of = {name: [r["lowest_Hz"] for r in rows if r["design"] == name] for name in ("hdd_2003", "mk7702")}
    assert [len(v) for v in of.values()] == [10, 10]
    assert own["pairs"] == [{"design": "hdd_2003", "than": "mk7702", "probability": 1.0, "sd": pytest.approx(np.sqrt(21 / 1200))}]  # as of two alike
    relative = [np.array(v) / np.mean(v) - 1 for v in of.values()]
    assert abs(np.corrcoef(relative)[0, 1]) < 0.8
    before = files(out)
    (out / "parts" / "part-000002.parquet").unlink()
    (out / "results.parquet").unlink()
    assert main(["study", str(tmp_path / "study.toml"), "--out", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["parts_found"] == 4
    assert files(out) == before


def test_probability_of_being_better_is_that_of_normal_ones_and_its_error_comes_true():
    """Closed form: P(A > B) of means 1 and 0, standard deviations 1 and 2, is Phi(1 / sqrt(5)) = 0.6726."""
    off = []
    for seed in range(300):
        rng = np.random.default_rng(seed)
        found = better(rng.normal(1, 1, 40), rng.normal(0, 2, 60), higher=True)
        off.append((found.probability - 0.672640) / found.sd)
    assert np.std(off) == pytest.approx(1.0, abs=0.15)
    assert abs(np.mean(off)) < 0.2
    one, other = np.array([1.0, 2.0, np.nan, 2.0]), np.array([2.0, 3.0])
    assert better(one, other, higher=False).probability == pytest.approx(1 - 1 / 6)  # of six pairs two are equal
    assert better(one, other, higher=True).probability == pytest.approx(1 / 6)
    assert better(one, np.array([1.0]), higher=True) is None


@pytest.mark.parametrize("draws", [2, 3, 5, 8, 15, 40])
def test_of_two_alike_none_is_better_by_three_errors(draws):
    """Of few draws that happen to lie apart the error by DeLong is nothing: one of two alike was
    named better in a third of all comparisons of two draws."""
    rng = np.random.default_rng(draws)
    named = 0
    for _ in range(4000):
        found = better(rng.standard_normal(draws), rng.standard_normal(draws), higher=True)
        named += abs(found.probability - 0.5) > 3 * found.sd
    assert named < 4000 * 0.0027 + 3 * np.sqrt(4000 * 0.0027)
    apart = better(np.arange(draws) + 100.0, np.arange(draws) * 1.0, higher=True)
    assert apart.probability == 1.0
    assert (3 * apart.sd < 0.5) == (draws > 6)


def test_a_speed_that_one_design_alone_does_not_bear_is_told_with_its_name(tmp_path, capsys):
    study(tmp_path, COMPARED.replace("mk7702", "five_bearing").replace("7200", "60000"))
    (warning, *others) = json.loads(capsys.readouterr().out)["warnings"]
    assert warning.startswith("five_bearing: 60000 rpm means a speed factor n dm of ")
    assert all(w.startswith("five_bearing: 60000 rpm means ") for w in others)


def test_a_temperature_that_no_design_bears_is_told_once(tmp_path, capsys):
    study(tmp_path, COMPARED.replace("temperatures_C = [20]", "temperatures_C = [130]"))
    assert [w.split(" lies ")[0] for w in json.loads(capsys.readouterr().out)["warnings"]] == ["130 C"]
