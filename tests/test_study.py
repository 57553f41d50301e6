"""Studies: a sweep, a Monte Carlo, sensitivities, a fleet; their rows, logs and tables."""

import csv
import json
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

from tests.conftest import ROOT, SCENE
from tests.studies import DRAWN, study
from thermospindle.cli import main
from thermospindle.model.built.tolerance import toleranced
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.report.verbs.study import _line
from thermospindle.sim.operating import operating_point
from thermospindle.sim.study.sensitivity import robust_z


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


def test_a_scene_whose_rows_are_shipped_is_swept(tmp_path, capsys):
    """Every key of it was refused, for rows that its file does not describe."""
    text = 'title = "t"\nkind = "sweep"\nscene = "five_bearing"\ntemperatures_C = [20]\nspeeds_rpm = [0]\n[vary]\n"sets.front.preload_N" = [100, 200]\n'
    rows = study(tmp_path, text)[1]
    assert json.loads(capsys.readouterr().out)["errors"] == 0
    soft, stiff = (r["frequency_Hz"][0] for r in rows)
    assert stiff > 1.02 * soft


def test_no_number_of_a_row_is_left_out_of_the_file(tmp_path, capsys):
    """Stiffnesses of roller bearings were computed, and had no column."""
    text = 'title = "t"\nkind = "sweep"\nscene = "tailstock"\ntemperatures_C = [20]\nspeeds_rpm = [0]\n'
    [row] = study(tmp_path, text)[1]
    point = operating_point(load(ROOT / "scenes" / "tailstock"), Condition(20.0))
    assert point.state.rollers
    for b in point.state.all_bearings:
        assert row[f"radial_stiffness_N_per_m.{b.name}"] == pytest.approx(b.stiffness[0, 0], rel=1e-9)


def test_modes_that_move_far_keep_their_number_by_shape(tmp_path, capsys):
    """A mount three times as stiff lifts axial modes past rocking ones, by up to 68 %: by frequency
    an axial mode passed for the rocking one that it came near."""
    text = 'title = "t"\nkind = "sweep"\nscene = "hdd_2003"\ntemperatures_C = [20]\nspeeds_rpm = [7200]\n[vary]\n'
    _, (own, stiff) = study(tmp_path, text + '"structure.joints.mount.axial_stiffness_N_per_m" = [6.7484e7, 2.02452e8]\n')
    kinds = [{n: (k, w) for n, k, w in zip(r["mode"], r["kind"], r["whirl"], strict=True) if n} for r in (own, stiff)]
    assert kinds[0] == kinds[1]
    own, stiff = (dict(zip(r["mode"], r["frequency_Hz"], strict=True)) for r in (own, stiff))
    assert len(own) == 8
    assert [n for n in own if abs(stiff[n] / own[n] - 1) > 1e-3] == [1, 2, 5]
    assert stiff[2] / own[2] > 1.6


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
    ranked = [r["campaign"] for r in answer["ranking"]]
    assert (ranked[0], ranked[-1]) == ("sn3", "sn1")
    assert (out / "fleet.png").is_file()
    (fleet / "fleet" / "sn2" / "modes.csv").write_text("nonsense", encoding="utf-8")
    assert main(["study", str(fleet / "study.toml"), "--out", str(out)]) == 2
    assert "begun with another campaigns" in capsys.readouterr().err


def test_the_command_line_alone_imports_no_parquet():
    code = "import sys, thermospindle.cli as c\ntry:\n    c.main(['--version'])\nexcept SystemExit:\n    pass\nassert not {'pyarrow', 'distributed', 'numpy'} & set(sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)}).returncode == 0


def test_numbers_of_a_row_have_the_same_decimals_and_what_is_nothing_is_not_named():
    spread = {"mean": 1000.96, "sd": 5.9619, "quantiles": [990.17, 1011.6]}
    own = {"spread": spread, "sensitivity": {"coefficients": {"preload": {"value": 0.9991, "clear": True}, "mount damping": {"value": -0.0004, "clear": True}}, "r2": 1.0}}
    assert _line("1 axial, Hz", 1002.0, own) == ["1 axial, Hz", "1002.0", "1001.0", "6.0", "990.2", "1011.6", "preload +1.00", "1.000"]
    assert _line("lower, N", 16.0, {"least": 9.99999, "most": 20.0})[1:] == ["16.000", "10.000", "20.000"]
