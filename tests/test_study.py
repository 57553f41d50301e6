"""Studies: a sweep, a Monte Carlo, a fleet; killed and gone on with, on a cluster; and study files that cannot be used."""

import csv
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from importlib.util import find_spec

import numpy as np
import pyarrow.parquet as pq
import pytest

from tests.conftest import ROOT, SCENE
from thermospindle.cli import main
from thermospindle.model.built.tolerance import toleranced
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.report.verbs.study import _line
from thermospindle.sim.operating import operating_point
from thermospindle.sim.study.comparison import better
from thermospindle.sim.study.form import Steps
from thermospindle.sim.study.sensitivity import robust_z
from thermospindle.sim.study.variants import combination

DRAWN = 'title = "t"\nkind = "monte-carlo"\nscene = "hdd_2003"\ntemperatures_C = [20, 60]\n'
COMPARED = 'title = "t"\nkind = "comparison"\nscenes = ["hdd_2003", "mk7702"]\ntemperatures_C = [20]\nspeeds_rpm = [7200]\n'


@pytest.fixture
def undrawn(monkeypatch):
    """Studies without their figures, for tests of their numbers; others have them drawn."""
    for kind in ("monte_carlo", "sweep"):
        monkeypatch.setattr(f"thermospindle.report.figures.study.{kind}", lambda *_: {})


def study(folder, text, *options):
    """The answer of a study file, and its rows."""
    file = folder / "study.toml"
    file.write_text(text, encoding="utf-8")
    out = folder / "out"
    assert main(["study", str(file), "--out", str(out), "--json", *options]) == 0
    return out, pq.read_table(out / "results.parquet").to_pylist()


def files(folder):
    """All but the log, which holds when it was written."""
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file() and p.suffix != ".rrd"}


def test_the_log_gives_back_the_numbers(tmp_path, capsys, undrawn):
    out, rows = study(tmp_path, TURNING + "draws = 3\n")
    capsys.readouterr()
    assert main(["inspect", str(out / "study.rrd"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["kind"], told["cases"], told["rows"], told["errors"]) == ("monte-carlo", 3, 6, 0)
    numbers = [name for name, value in rows[0].items() if isinstance(value, float | int) and not isinstance(value, bool)]
    assert len(numbers) > 15
    assert set(numbers) < set(told["columns"])
    for name, column in told["columns"].items():
        assert column == [r[name] for r in rows]
    assert "/series/mode 1, Hz/20 C" in [e.replace("\\", "") for e in told["entities"]]
    assert main(["inspect", str(out / "study.rrd")]) == 0
    assert "monte-carlo of 3 cases: 6 rows" in capsys.readouterr().out


def test_a_sweep_has_the_modes_of_every_condition(tmp_path, capsys):
    text = 'title = "t"\nkind = "sweep"\nscene = "hdd_2003"\ntemperatures_C = [20, 60]\nspeeds_rpm = [0, 7200]\n[vary]\n"bearing_pair.preload_N" = [8, 16]\n'
    out, rows = study(tmp_path, text + '"effects.bond_softening.hot_compliance" = [0, 12.5]\n')
    answer = json.loads(capsys.readouterr().out)
    assert len(rows) == answer["cases"] == 16
    assert answer["errors"] == 0
    assert (out / "sweep.png").is_file()
    found = {(r["vary.bearing_pair.preload_N"], r["vary.effects.bond_softening.hot_compliance"], r["temperature_C"], r["speed_rpm"]): r for r in rows}
    assert len(found) == 16
    own = operating_point(load(SCENE), Condition(60.0, 7200 * RPM))  # the scene as it stands has 16 N and no bond that softens
    here = found[16.0, 0.0, 60.0, 7200.0]
    assert here["preload_N.upper"] == own.state.bearing("upper").preload
    assert here["frequency_Hz"] == [m.frequency for m in own.modes_below(load(SCENE).hammer.band[1])]
    assert here["mode"] == list(range(1, 9))
    softer = found[16.0, 12.5, 60.0, 0.0]["frequency_Hz"]
    assert softer[5] < found[16.0, 0.0, 60.0, 0.0]["frequency_Hz"][5] < found[16.0, 0.0, 20.0, 0.0]["frequency_Hz"][5]
    assert found[8.0, 0.0, 20.0, 0.0]["preload_N.upper"] == pytest.approx(8.0, rel=1e-9)


def test_a_case_without_an_answer_says_why_in_its_row(tmp_path, capsys, undrawn):
    text = 'title = "t"\nkind = "sweep"\nscene = "hdd_2003"\ntemperatures_C = [20]\n[vary]\n"ball_rows.hdd.ball_diameter_mm" = [1.588, 1.75]\n'
    _, rows = study(tmp_path, text)
    assert rows[0]["error"] is None
    assert "ball" in rows[1]["error"]
    assert rows[1]["frequency_Hz"] is None
    said = capsys.readouterr()
    assert json.loads(said.out)["errors"] == 1
    assert "1 of 2 rows have no result" in said.err


@pytest.mark.slow
def test_draws_scatter_as_the_tolerances_say(tmp_path, capsys):
    out, rows = study(tmp_path, DRAWN + "draws = 150\nseed = 5\nchunk = 40\n")
    answer = json.loads(capsys.readouterr().out)
    assert len(rows) == 300
    parameters = toleranced(load(SCENE))
    for p in parameters:
        x = np.array([r[f"deviation.{p.name}"] for r in rows[::2]])
        assert abs(x.mean()) < 4 * p.sd / np.sqrt(150)
        assert x.std() == pytest.approx(p.sd, rel=0.25)
    cold = answer["conditions"][0]
    preload = cold["preload_N"]["upper"]
    assert preload["spread"]["sd"] == pytest.approx(0.03 * 16, rel=0.25)
    assert next(iter(preload["sensitivity"]["coefficients"])) == "preload"
    assert all(mode["sensitivity"]["r2"] > 0.98 for mode in cold["modes"])
    lateral, by = cold["modes"][5], next(p for p in parameters if p.name == "preload")
    ends = [operating_point(by.apply(load(SCENE), x), Condition(20.0)).modes[5].frequency for x in (-by.sd, by.sd)]
    share = lateral["sensitivity"]["coefficients"]["preload"]["value"] * lateral["spread"]["sd"]
    drawn = np.std([r["deviation.preload"] for r in rows[::2]], ddof=1)
    assert share == pytest.approx((ends[1] - ends[0]) / (2 * by.sd) * drawn, rel=0.03)  # Hz a standard deviation, by differences too
    assert (out / "spread.png").is_file()
    assert (out / "sensitivity.png").is_file()


TURNING = DRAWN.replace("temperatures_C = [20, 60]", "temperatures_C = [20]\nspeeds_rpm = [0, 7200]\nrunout = true")


def test_runout_of_spindles_as_they_are_built(tmp_path, capsys, undrawn):
    """With a grade every draw has imperfections of its own; without, those of the scene, which the tolerances hardly move."""
    from thermospindle.sim.running.steady import steady_runout

    spread = {}
    for grade in ("", 'grade = "high precision"\n'):
        (tmp_path / f"of {len(grade)}").mkdir()
        out, rows = study(tmp_path / f"of {len(grade)}", TURNING + grade + "draws = 12\nseed = 2\n")
        turning = json.loads(capsys.readouterr().out)["conditions"][1]
        assert [r["rro_um.x"] is None for r in rows] == [True, False] * 12
        own = steady_runout(operating_point(load(SCENE), Condition(20.0, 7200 * np.pi / 30)))
        assert turning["rro_um"]["x"]["nominal"] == pytest.approx(1e6 * own["hub x"].repeatable)
        assert turning["nrro_six_sigma_um"]["axial"]["nominal"] == pytest.approx(1e6 * own["hub axial"].six_sigma)
        spread[grade] = turning["rro_um"]["x"]["spread"]["sd"] / turning["rro_um"]["x"]["spread"]["mean"]
        assert "rro_um" not in json.loads((out / "summary.json").read_text(encoding="utf-8"))["conditions"][0]
    few, own = spread.values()
    assert 0 < few < 0.05 < own


def test_a_mixture_has_one_input_of_the_second_set_and_all_else_of_the_first(tmp_path):
    from thermospindle.sim.study.draws import count, draw, inputs
    from thermospindle.sim.study.form import read_study

    (tmp_path / "s.toml").write_text(TURNING + 'draws = 3\nsobol = true\ngrade = "precision"\n', encoding="utf-8")
    asked, spindle = read_study(tmp_path / "s.toml"), load(SCENE)
    names = inputs(asked, spindle)
    assert count(asked, spindle) == 3 * (2 + len(names))
    assert names[-5:] == ["unbalance", "lower races", "lower balls", "upper races", "upper balls"]

    def told(own):
        """Everything that is drawn, by input."""
        i = own.imperfections
        found = dict(zip(names, own.deviations.tolist(), strict=False)) | {"unbalance": (i.unbalance, i.unbalance_phase, i.couple_unbalance, i.couple_phase)}
        for b in ("upper", "lower"):
            r = i.row(b)
            found |= {f"{b} races": (r.inner_radial, r.inner_axial, r.outer_radial, r.outer_axial), f"{b} balls": (r.ball_diameter, r.ball_waves)}
        return found

    first, second = told(draw(asked, spindle, 1)), told(draw(asked, spindle, 4))
    assert all(first[n] != second[n] for n in names)
    for block, name in enumerate(names, 2):
        own = draw(asked, spindle, 3 * block + 1)
        assert (own.k, own.taken) == (1, name)
        assert told(own) == {**first, name: second[name]}


@pytest.mark.slow
def test_runout_is_by_the_imperfections_that_were_drawn(tmp_path, capsys):
    """RRO by the unbalance, a Monte Carlo of a shaft on bearings given by numbers: before, of the spindle's stiffness, which is noise."""
    text = TURNING.replace("hdd_2003", "mk7702").replace("[0, 7200]", "[12000]") + 'grade = "precision"\ndraws = 30\n'
    study(tmp_path, text)
    rro = json.loads(capsys.readouterr().out)["conditions"][0]["rro_um"]["x"]["sensitivity"]
    assert [n for n, c in rro["coefficients"].items() if c["clear"]] == ["couple unbalance"]
    assert rro["cross_validated"]["r2"] > 3 * rro["cross_validated"]["sd"]


@pytest.mark.slow
def test_indices_of_a_study_name_what_moves_it(tmp_path, capsys):
    out, rows = study(tmp_path, TURNING.replace("[0, 7200]", "[7200]") + 'grade = "precision"\ndraws = 24\nsobol = true\n')
    told = json.loads(capsys.readouterr().out)["conditions"][0]
    assert (out / "indices.png").is_file()
    assert sum(r["taken"] == "" for r in rows) == sum(r["taken"] == "all" for r in rows) == 24
    assert told["preload_N"]["upper"]["indices"]["of"]["preload"]["total"] == pytest.approx(1.0, abs=0.5)
    assert all(i["total"] == 0 for n, i in told["preload_N"]["upper"]["indices"]["of"].items() if n != "preload")
    moved = told["rro_um"]["x"]["indices"]["of"]
    assert next(iter(moved)) == "unbalance"
    assert moved["unbalance"]["clear"]
    races = told["nrro_six_sigma_um"]["axial"]["indices"]["of"]
    assert {next(iter(races))} <= {"upper races", "lower races", "upper balls", "lower balls"}


def test_one_that_differs_stands_apart_even_where_all_others_are_equal():
    assert list(robust_z(np.array([1.0, 1, 1, 1, 1, 1, 1, 1, 1, 2]))) == pytest.approx([0.0] * 9 + [1 / (1.2533 * 0.1)])
    assert list(robust_z(np.array([1.0, 1.0, 1.0]))) == [0.0, 0.0, 0.0]


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
    assert (out / "comparison.png").is_file()
    assert main(["inspect", str(out / "study.rrd"), "--json"]) == 0
    log = json.loads(capsys.readouterr().out)
    assert log["columns"]["lowest_Hz"] == [r["lowest_Hz"] for r in rows]
    assert log["scene"] == told["scene"]
    assert main(["study", str(tmp_path / "study.toml"), "--out", str(tmp_path / "again")]) == 0
    assert "7200 rpm" in capsys.readouterr().out
    assert files(out) == files(tmp_path / "again")


def test_drawn_designs_are_drawn_apart_and_gone_on_with(tmp_path, capsys):
    out, rows = study(tmp_path, COMPARED + "draws = 10\nchunk = 4\n")
    told = json.loads(capsys.readouterr().out)
    own = told["conditions"][0]["figures"]["lowest_Hz"]
    of = {name: [r["lowest_Hz"] for r in rows if r["design"] == name] for name in ("hdd_2003", "mk7702")}
    assert [len(v) for v in of.values()] == [10, 10]
    assert own["pairs"] == [{"design": "hdd_2003", "than": "mk7702", "probability": 1.0, "sd": 0.0}]
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


@pytest.fixture
def fleet(tmp_path):
    """Six spindles that were measured, the fourth with rocking modes 3 per cent lower than the others."""
    for k in range(6):
        folder = tmp_path / "fleet" / f"sn{k}"
        shutil.copytree(SCENE / "measured" / "jang_2003", folder)
        with (folder / "modes.csv").open(encoding="utf-8") as stream:
            rows = list(csv.reader(stream))
        rng = np.random.default_rng(k)
        for row in rows[1:]:
            row[3] = repr(float(row[3]) * (1 + 1e-3 * rng.normal()) * (0.97 if k == 3 and row[2] == "rocking" else 1.0))
        with (folder / "modes.csv").open("w", newline="", encoding="utf-8") as stream:
            csv.writer(stream).writerows(rows)
    return tmp_path


FLEET = 'title = "t"\nkind = "fleet"\nscene = "hdd_2003"\ncampaigns = ["fleet/*"]\n'


def test_a_fleet_shows_who_stands_apart(fleet, capsys):
    (fleet / "fleet" / "sn1" / "modes.csv").write_text("nonsense", encoding="utf-8")
    out, rows = study(fleet, FLEET)
    answer = json.loads(capsys.readouterr().out)
    assert [r["campaign"] for r in rows] == [f"sn{k}" for k in range(6)]
    assert "sn1" in rows[1]["error"]
    assert answer["errors"] == 1
    assert {(o["campaign"], o["of"]) for o in answer["outliers"][:2]} == {("sn3", f"frequency error of mode {n}") for n in (3, 4)}
    ranked = [r["campaign"] for r in answer["ranking"] if r["error"] is None]
    assert ranked[0] == "sn3"
    assert (out / "fleet.png").is_file()
    (fleet / "fleet" / "sn2" / "modes.csv").write_text("nonsense", encoding="utf-8")
    assert main(["study", str(fleet / "study.toml"), "--out", str(out)]) == 2
    assert "begun with another campaigns" in capsys.readouterr().err


@pytest.mark.slow
def test_killed_and_gone_on_with_is_the_same_to_the_last_bit(tmp_path, capsys):
    file = tmp_path / "study.toml"
    file.write_text(DRAWN + "draws = 120\nchunk = 1\n", encoding="utf-8")
    killed, whole = tmp_path / "killed", tmp_path / "whole"
    command = [sys.executable, "-m", "thermospindle", "study", str(file), "--out", str(killed)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    running = subprocess.Popen(command, cwd=tmp_path, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    until = time.monotonic() + 100
    while len(list(killed.glob("parts/part-*.parquet"))) < 10 and running.poll() is None and time.monotonic() < until:
        time.sleep(0.002)
    running.send_signal(signal.SIGKILL)
    running.wait()
    there = {p.name: p.stat().st_mtime_ns for p in killed.glob("parts/part-*.parquet")}
    assert 10 <= len(there) < 120
    assert not (killed / "results.parquet").exists()
    assert main(["study", str(file), "--out", str(killed), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["parts_found"] == len(there)
    assert all((killed / "parts" / name).stat().st_mtime_ns == when for name, when in there.items()), "done again"
    assert main(["study", str(file), "--out", str(whole)]) == 0
    assert files(killed) == files(whole)


def test_a_folder_is_gone_on_with_only_by_its_own_study(tmp_path, capsys, undrawn):
    out, _ = study(tmp_path, DRAWN + "draws = 3\n")
    before = files(out)
    for text in (DRAWN + "draws = 4\n", DRAWN + "draws = 3\nseed = 1\n"):
        (tmp_path / "study.toml").write_text(text, encoding="utf-8")
        assert main(["study", str(tmp_path / "study.toml"), "--out", str(out)]) == 2
        assert re.search(r"out: was begun with another study \(.*\); name a new folder to begin anew\n", capsys.readouterr().err)
    assert files(out) == before
    (tmp_path / "study.toml").write_text(DRAWN + "draws = 3\n", encoding="utf-8")
    key = json.loads((out / "study.json").read_text(encoding="utf-8"))
    for name, said in (("study", "was begun with another study (None, now"), ("chunk", "is not what spindle wrote")):
        (out / "study.json").write_text(json.dumps({k: v for k, v in key.items() if k != name}), encoding="utf-8")
        assert main(["study", str(tmp_path / "study.toml"), "--out", str(out)]) == 2, "a key that lost a line is no key"
        assert said in capsys.readouterr().err
    (out / "study.json").write_text(json.dumps(key), encoding="utf-8")
    next((out / "parts").iterdir()).write_bytes(b"PAR1 no more")
    assert main(["study", str(tmp_path / "study.toml"), "--out", str(out)]) == 2
    assert "cannot be read" in capsys.readouterr().err
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear", encoding="utf-8")
    assert main(["study", str(tmp_path / "study.toml"), "--out", str(tmp_path / "mine")]) == 2
    assert "no study of spindle" in capsys.readouterr().err


@pytest.mark.skipif(os.name == "nt", reason="folders have no locks on Windows")
def test_two_runs_do_not_write_into_one_folder(tmp_path, capsys, undrawn):
    from thermospindle.model.files.whole import alone

    out, _ = study(tmp_path, DRAWN + "draws = 2\n")
    with alone(out):
        assert main(["study", str(tmp_path / "study.toml"), "--out", str(out)]) == 2
    assert "another run is writing there" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("kind = ", "not a TOML file"),
        (DRAWN, "draws: missing"),
        (DRAWN + "draws = 1\n", "draws = 1"),
        (DRAWN + "draws = 5\nrunout = true\n", "speeds_rpm needs a speed"),
        (DRAWN + 'draws = 5\ngrade = "precision"\n', "it needs runout = true"),
        (DRAWN + "draws = 1000000\nsobol = true\n", "at most 10000000 are allowed"),
        (DRAWN.replace("monte-carlo", "sweep") + "sobol = true\n", "sobol: is for kind = 'monte-carlo'"),
        (DRAWN.replace('scene = "hdd_2003"\n', "") + "draws = 5\n", "scene: missing"),
        (DRAWN + 'draws = 5\nscenes = ["hdd_2003", "mk7702"]\n', "scenes: is for kind = 'comparison'"),
        (COMPARED.replace('"mk7702"', ""), "needs at least two"),
        (COMPARED.replace('"mk7702"', '"hdd_2003"'), "scenes: a value stands twice"),
        (COMPARED.replace('"mk7702"', '"nowhere"'), "nowhere: no scene there"),
        (COMPARED.replace("temperatures_C = [20]\n", ""), "temperatures_C: missing"),
        (COMPARED + 'grade = "precision"\nrunout = true\n', "it needs draws"),
        (COMPARED + "draws = 6000000\n", "12000000 cases of 2 scenes"),
        (DRAWN + "draw = 5\n", "did you mean draws"),
        (DRAWN + "draws = 5\n[vary]\nspeed = [1]\n", "vary: is for kind = 'sweep'"),
        (DRAWN.replace("hdd_2003", "nowhere") + "draws = 5\n", "nowhere: no scene there"),
        (DRAWN.replace("20, 60", "20, 20") + "draws = 5\n", "temperatures_C: a value stands twice"),
        (DRAWN.replace("20, 60", "nan") + "draws = 5\n", "temperatures_C"),
        (DRAWN.replace("monte-carlo", "sweep") + '[vary]\n"bearing_pair.preloadN" = [1]\n', "did you mean preload_N"),
        (DRAWN.replace("monte-carlo", "sweep") + '[vary]\n"bearing_pair.preload_N" = [16, -1]\n', "preload_N = -1"),
        (DRAWN.replace("monte-carlo", "sweep") + '[vary]\n"bearing_pair.preload_N" = ["x"]\n', "preload_N = 'x'"),
        (DRAWN.replace("monte-carlo", "sweep") + '[vary]\n"structure.joints.flang.damping_ratio" = [0.1]\n', "did you mean flange"),
        (DRAWN.replace("monte-carlo", "sweep") + '[vary]\n"title.x" = [1]\n', "title.x names no single value"),
        (DRAWN.replace("monte-carlo", "sweep") + '[vary]\n"effects.bond_softenin.x" = [1]\n', "did you mean bond_softening"),
        (DRAWN.replace("monte-carlo", "sweep") + '[vary]\n"effects.bond_softening.width" = [1e9]\n', "allowed is"),
        (DRAWN.replace("monte-carlo", "sweep") + '[vary]\n"effects" = [1]\n', "is named as in effects.bond_softening"),
        (DRAWN.replace("monte-carlo", "sweep") + '[vary]\nx = {from = -1, to = 1, steps = 3, spacing = "log"}\n', "from and to above 0"),
        (DRAWN.replace("monte-carlo", "fleet").replace("temperatures_C = [20, 60]", 'campaigns = ["../*/none"]'), "no folder with campaign.toml"),
        (DRAWN.replace("monte-carlo", "fleet").replace("temperatures_C = [20, 60]", 'campaigns = ["/*"]'), "names of folders"),
    ],
)
def test_what_is_no_study_is_refused_in_one_sentence(tmp_path, capsys, text, said):
    (tmp_path / "s.toml").write_text(text, encoding="utf-8")
    assert main(["study", str(tmp_path / "s.toml"), "--out", str(tmp_path / "o")]) == 2
    error = capsys.readouterr().err
    assert error.startswith("spindle: ")
    assert error.count("\n") == 1
    assert said in error
    assert not (tmp_path / "o").exists()


@pytest.mark.skipif(find_spec("distributed") is None, reason="Dask is not installed: pip install 'thermospindle[cluster]'")
def test_a_cluster_gives_the_same_to_the_last_bit(tmp_path, capsys):
    from distributed import LocalCluster

    here, _ = study(tmp_path, DRAWN + "draws = 12\nchunk = 2\n")
    with LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None) as cluster:
        address = cluster.scheduler_address
        assert main(["study", str(tmp_path / "study.toml"), "--out", str(tmp_path / "there"), "--cluster", address]) == 0
    assert files(here) == files(tmp_path / "there")


def test_without_an_answering_cluster_it_says_so(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("thermospindle.sim.study.executors.find_spec", lambda name: None)
    (tmp_path / "s.toml").write_text(DRAWN + "draws = 2\n", encoding="utf-8")
    assert main(["study", str(tmp_path / "s.toml"), "--out", str(tmp_path / "o"), "--cluster", "tcp://127.0.0.1:1"]) == 2
    assert "pip install 'thermospindle[cluster]'" in capsys.readouterr().err


def test_the_command_line_alone_imports_no_parquet():
    code = "import sys, thermospindle.cli as c\ntry:\n    c.main(['--version'])\nexcept SystemExit:\n    pass\nassert not {'pyarrow', 'distributed', 'numpy'} & set(sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)}).returncode == 0


def test_numbers_of_a_row_have_the_same_decimals_and_what_is_nothing_is_not_named():
    spread = {"mean": 1000.96, "sd": 5.9619, "quantiles": [990.17, 1011.6]}
    own = {"spread": spread, "sensitivity": {"coefficients": {"preload": {"value": 0.9991, "clear": True}, "mount damping": {"value": -0.0004, "clear": True}}, "r2": 1.0}}
    assert _line("1 axial, Hz", 1002.0, own) == ["1 axial, Hz", "1002.0", "1001.0", "6.0", "990.2", "1011.6", "preload +1.00", "1.000"]
    assert _line("lower, N", 16.0, {"least": 9.99999, "most": 20.0})[1:] == ["16.000", "10.000", "20.000"]
