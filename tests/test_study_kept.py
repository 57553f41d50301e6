"""What a study leaves: killed and gone on with, one folder for one study, on a cluster; and study files that cannot be used."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from importlib.util import find_spec

import pytest

from tests.conftest import ROOT
from tests.studies import COMPARED, DRAWN, files, study
from thermospindle.cli import main


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


HUGE = '"bearing_pair.preload_N" = { from = 10, to = 20, steps = 100000 }\n"section.hub_inertia" = { from = 1, to = 2, steps = 1000 }\n'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("kind = ", "not a TOML file"),
        (DRAWN, "draws: missing"),
        (DRAWN + "draws = 1\n", "draws = 1"),
        (DRAWN + "draws = 5\nrunout = true\n", "speeds_rpm needs a speed"),
        (DRAWN + 'draws = 5\ngrade = "precision"\n', "it needs runout = true"),
        (DRAWN + "draws = 1000000\nsobol = true\n", "at most 10000000 are allowed"),
        (DRAWN.replace("monte-carlo", "sweep").replace("temperatures_C = [20, 60]\n", "") + "[vary]\n" + HUGE, "vary: 100000000 cases; at most 10000000 are allowed"),
        (DRAWN.replace("monte-carlo", "sweep") + "sobol = true\n", "sobol: is for kind = 'monte-carlo'"),
        (DRAWN.replace('scene = "hdd_2003"\n', "") + "draws = 5\n", "scene: missing"),
        (DRAWN + 'draws = 5\nscenes = ["hdd_2003", "mk7702"]\n', "scenes: is for kind = 'comparison'"),
        (COMPARED.replace('"mk7702"', ""), "needs at least two"),
        (COMPARED.replace('"mk7702"', '"hdd_2003"'), "scenes: a value stands twice"),
        (COMPARED.replace('"mk7702"', '"nowhere"'), "scenes = 'nowhere': nowhere: no scene there"),
        (COMPARED.replace("temperatures_C = [20]\n", ""), "temperatures_C: missing"),
        (COMPARED + 'grade = "precision"\nrunout = true\n', "it needs draws"),
        (COMPARED + "draws = 6000000\n", "12000000 cases of 2 scenes"),
        (DRAWN + "draw = 5\n", "did you mean draws"),
        (DRAWN + "draws = 5\n[vary]\nspeed = [1]\n", "vary: is for kind = 'sweep'"),
        (DRAWN.replace("hdd_2003", "nowhere") + "draws = 5\n", "scene = 'nowhere': nowhere: no scene there"),
        (DRAWN.replace("20, 60", "20, 20") + "draws = 5\n", "temperatures_C: a value stands twice"),
        (DRAWN.replace("20, 60", "nan") + "draws = 5\n", "temperatures_C"),
        (DRAWN.replace("monte-carlo", "sweep") + '[vary]\n"bearing_pair.preloadN" = [1]\n', "did you mean preload_N"),
        (DRAWN.replace("monte-carlo", "sweep") + '[vary]\n"bearing_pair.preload_N" = [16, -1]\n', "preload_N = -1"),
        (DRAWN.replace("monte-carlo", "sweep") + '[vary]\n"bearing_pair.preload_N" = ["x"]\n', "preload_N = 'x'"),
        (DRAWN.replace("monte-carlo", "sweep") + '[vary]\n"structure.joints.flang.damping_ratio" = [0.1]\n', "did you mean flange"),
        (DRAWN.replace("monte-carlo", "sweep") + '[vary]\n"bearing_pair.preload_N" = {from = 12, to = 16, steps = 1}\n', "vary.bearing_pair.preload_N.steps = 1: input should be greater than or equal to 2"),
        (DRAWN.replace("monte-carlo", "sweep") + '[vary]\n"bearing_pair.preload_N" = [12, 16, 12.0]\n', "vary: bearing_pair.preload_N: a value stands twice"),
        (DRAWN.replace("monte-carlo", "sweep") + '[vary]\n"bearing_pair.preload_N" = []\n', "vary.bearing_pair.preload_N = []: list should have at least 1 item"),
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
