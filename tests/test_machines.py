"""Verbs on the machines that are no disk drive: each answers, or says in one sentence why it cannot."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import ROOT, coarse_warmups
from thermospindle.cli import main
from thermospindle.model.errors import BadInput
from thermospindle.sim.running.run import tilted_inertia

FIVE, MK, FREE = (str(ROOT / "scenes" / name) for name in ("five_bearing", "mk7702", "free_shaft"))
ANSWERS = [
    f"table {FIVE} --temperatures 20 40 --speeds 0 12000",
    f"modes {FIVE} --speed 8000",
    f"runout {FIVE} --speed 8000 --path linear --seconds 0.3",
    f"table {MK} --temperatures 20 40",
    f"modes {MK} --beam euler-bernoulli",
    f"map {MK} --temperatures 20 30 --speeds 1000 2000",
    f"modes {FREE}",
    f"static {FREE}",
]


@pytest.mark.parametrize("words", ANSWERS, ids=lambda w: " ".join(x.rsplit("/", 1)[-1] for x in w.split()[:2]))
def test_answers(words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*words.split(), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)


def test_every_bearing_has_an_entry(capsys: pytest.CaptureFixture[str]) -> None:
    for scene, names in ((FIVE, ["front1", "front2", "front3", "rear1", "rear2"]), (MK, ["front1", "front2", "front3", "rear1"])):
        assert main(["table", scene, "--temperatures", "20", "--json"]) == 0
        bearings = json.loads(capsys.readouterr().out)["bearings"]
        assert list(bearings) == names
        assert all(b["radial_stiffness_N_per_m"][0] > 1e8 for b in bearings.values())


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (f"warmup {MK}", "section: there are none"),
        (f"warmup {FREE}", "section: there are none"),
        (f"runout {FREE} --speed 100", "nothing turns"),
        (f"map {FREE}", "nothing turns"),
        (f"impact {FREE} --element linear", "steps of"),
        (f"static {ROOT / 'scenes' / 'hdd_2003'} --beam timoshenko", "shafts: there are none"),
        (f"static {ROOT / 'scenes' / 'hdd_2003'} --bearings rated", "has no rated_radial_stiffness_N_per_um"),
    ],
    ids=lambda w: " ".join(x.rsplit("/", 1)[-1] for x in w.split()[:2]),
)
def test_refusals_are_one_sentence(words: str, why: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words.split()) == 2
    said = capsys.readouterr().err
    assert why in said
    assert "Traceback" not in said


BROKEN = [
    ('["front1", "front2", "front3"]', '["front1", "front1", "front3"]', "sets.front.bearings = ['front1', 'front1', 'front3']: 'front1' stands twice; each may stand once"),
    ('["rear1", "rear2"]', '["rear1", "rear2", "front3"]', "bearings.front3: is in 2 sets (front, rear)"),
    ('["front1", "front2", "front3"]', '["front1", "front3"]', "bearings.front2: is in no set"),
    ('name = "nose_y"', 'name = "nose"', "measuring.points: name = 'nose' stands twice"),
    ("preload_N = 382.0", 'preload_N = "16"', "sets.front.preload_N = '16'"),
    ("[133, 23]", "[133, 0]", "shafts.spindle.outer_mm.2"),
    ("z_mm = 330.5", "z_mm = 630.5", "beyond the shaft 'spindle', which spans 0 to 440"),
]


@pytest.mark.parametrize(("right", "wrong", "why"), BROKEN, ids=[b[1] for b in BROKEN])
def test_a_wrong_entry_is_named(right: str, wrong: str, why: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (Path(FIVE) / "spindle.toml").read_text(encoding="utf-8")
    assert right in text
    (tmp_path / "spindle.toml").write_text(text.replace(right, wrong, 1), encoding="utf-8")
    assert main(["modes", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert why in said
    assert said.count("\n") == 1


def test_a_joint_beyond_its_shaft_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """As bearings and points are: a disc's seat typed 300 mm beyond the end was computed with, on the last node and an arm."""
    text = (ROOT / "scenes" / "templates" / "rotor.toml").read_text(encoding="utf-8").replace("z_mm = 225.0                       # where", "z_mm = 925.0  # where", 1)
    (tmp_path / "spindle.toml").write_text(text, encoding="utf-8")
    assert main(["modes", str(tmp_path)]) == 2
    assert "structure.joints.disc seat: at z_mm = 925 beyond the shaft 'shaft', which spans 0 to 600" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "right", "wrong", "why"),
    [
        ("rotor", 'between = ["shaft", "disc"]', 'between = ["shaft", "shaft"]', "structure.joints.disc seat.between: 'shaft' stands twice"),
        ("grinding", "turns = true", "turns = false", "its rings, on 'spindle' and 'housing', turn alike"),
    ],
)
def test_a_shaft_is_told_by_its_name(name: str, right: str, wrong: str, why: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Not by that of its node there, which the scene does not have."""
    text = (ROOT / "scenes" / "templates" / f"{name}.toml").read_text(encoding="utf-8")
    (tmp_path / "spindle.toml").write_text(text.replace(right, wrong), encoding="utf-8")
    assert main(["modes", str(tmp_path)]) == 2
    assert why in capsys.readouterr().err


@pytest.mark.parametrize("words", [f"static {MK}", f"static {FIVE}", f"table {FIVE} --temperatures 20", "effects"], ids=["mk", "five", "table", "effects"])
def test_tables_are_whole_at_80_columns(words: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert main(words.split()) == 0
    said = capsys.readouterr().out
    assert "…" not in said
    assert max(map(len, said.splitlines())) <= 80


@pytest.mark.slow
def test_unbalance_of_a_shaft_of_thin_segments_runs_as_in_the_frequency_domain(capsys: pytest.CaptureFixture[str]) -> None:
    """Static and couple unbalance on a segment whose polar moment is the sum of the others."""
    once = []
    for path in ("simulated", "linear"):
        assert main(["runout", FIVE, "--speed", "8000", "--seconds", "0.05", "--path", path, "--json"]) == 0
        once.append(json.loads(capsys.readouterr().out)["once_per_revolution_um"]["radial"])
    assert once[1] > 0.01
    assert once[0] == pytest.approx(once[1], rel=1e-3)


def test_an_inertia_is_tilted_no_further_than_a_body_can_be() -> None:
    xx, yy, zz, _, xz, _ = tilted_inertia(np.array([1.0, 1.0, 2.0]), 0.01, "disc")
    principal = np.linalg.eigvalsh([[xx, 0, xz], [0, yy, 0], [xz, 0, zz]])
    assert principal[0] + principal[1] >= principal[2]
    assert zz == pytest.approx(2.0, rel=2e-4)
    assert tilted_inertia(np.array([1.0, 1.0, 1.5]), 0.01, "drum")[2] == 1.5
    with pytest.raises(BadInput, match=r"tilts the inertia of disc"):
        tilted_inertia(np.array([1.0, 1.0, 2.0]), 0.5, "disc")


@pytest.mark.slow
def test_warm_up_tells_whose_preload_and_watts(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["warmup", FIVE, "--minutes", "1"]) == 0
    said = capsys.readouterr().out
    assert re.search(r"the preload of (front|rear)\d goes from [\d.]+ to [\d.]+ N", " ".join(said.split()))
    heads = [line.split()[-1:] for line in said.splitlines()]
    assert heads[heads.index(["front1"]) + 1] == ["preload"]
    assert " mW" not in said


@pytest.mark.parametrize("rpm", [pytest.param(8000, marks=pytest.mark.slow), 12000])
def test_five_bearings_warm_up_to_a_steady_state(rpm: int, capsys: pytest.CaptureFixture[str]) -> None:
    """Since friction goes by Harris' load, rigid preloads ran away at the scene's own speed, and only a slow test would have told."""
    with coarse_warmups():
        assert main(["warmup", FIVE, "--speed", str(rpm), "--minutes", "0.05", "--json"]) == 0
    steady = json.loads(capsys.readouterr().out)["steady"]
    assert steady["load_feedback"] < 0.8
    ring = steady["temperature_C"]
    for name in ("front1", "front2", "front3", "rear1", "rear2"):
        assert -2.0 < ring[f"{name} inner ring"] - ring[f"{name} outer ring"] < 10.0


def test_a_spindle_on_one_bearing_is_free_to_tilt(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (Path(MK) / "spindle.toml").read_text(encoding="utf-8")
    tables = re.sub(r"^\[bearings\.(front2|front3|rear1)(\.numbers)?\].*?(?=^\[|^# -)", "", text, flags=re.DOTALL | re.MULTILINE)
    (tmp_path / "spindle.toml").write_text(tables, encoding="utf-8")
    assert main(["static", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "free to move" in said
    assert "Share of the compliance" in said


def test_a_section_without_ball_rows_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (Path(FIVE) / "spindle.toml").read_text(encoding="utf-8")
    text = re.sub(r"^\[(bearings|sets)\.\w+\].*?(?=^\[|^# -)", "", text, flags=re.DOTALL | re.MULTILINE)
    (tmp_path / "spindle.toml").write_text(text, encoding="utf-8")
    assert main(["modes", str(tmp_path)]) == 2
    assert "section: no bearing is a ball row" in capsys.readouterr().err


def test_a_shaft_that_hangs_free_has_no_table_and_no_runout(capsys):
    assert main(["table", FREE, "--temperatures", "20"]) == 0
    assert "The scene has no bearings." in capsys.readouterr().out
    assert main(["runout", FREE]) == 2
    assert "free_shaft/spindle.toml: structure: nothing turns" in capsys.readouterr().err
