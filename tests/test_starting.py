"""`spindle new`: scenes to start from, explained and running."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import ROOT
from thermospindle.cli import main

KINDS = ("hdd", "machine-tool", "grinding", "rotor")
TEMPLATES = {kind: (ROOT / "scenes" / "templates" / f"{kind}.toml").read_text(encoding="utf-8") for kind in KINDS}

PLAIN = {
    "origin", "origins", "source", "name", "part", "material", "ball_material", "ring_material", "outer_conformity", "outer_ring", "density_kg_per_m3", "damping_ratio",
    "speed_rpm", "temperature_C", "value", "body", "position_mm", "axial_stiffness_N_per_m", "mass_kg", "hammer_mass_g", "tip_stiffness_N_per_m",
    "roller_diameter_mm", "roller_material", "inner_conformity", "axial_rigidity_N_per_um", "preload_N", "turns", "role", "group", "z_mm", "conductivity_W_per_m_K", "regions",
    "outer_body", "heat_capacity_J_per_kg_K", "tilt_stiffness_N_m_per_rad", "lateral_stiffness_N_per_m", "moves",
}  # fmt: skip
"""Keys that say it all by their name, or stand beside the one that explains them."""


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scenes")
    for kind in KINDS:
        assert main(["new", f"my {kind}", "--like", kind, "--out", str(folder / kind)]) == 0
    return folder


def test_every_template_is_offered():
    assert {f.stem for f in (ROOT / "scenes" / "templates").iterdir()} == set(KINDS)


@pytest.mark.parametrize("kind", KINDS)
def test_a_new_scene_has_its_name(scenes: Path, kind: str) -> None:
    assert f'title = "my {kind}"' in (scenes / kind / "spindle.toml").read_text(encoding="utf-8")


def test_a_name_with_a_blank_is_quoted_where_it_is_to_be_typed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "a b", "--like", "rotor"]) == 0
    said = capsys.readouterr().out
    assert "spindle check 'a b' " in said
    assert "spindle modes 'a b'\n" in said


def _runs(kind: str, verb: str) -> Any:
    return pytest.param(kind, verb, marks=[pytest.mark.slow] if verb in ("map", "runout") else [])


@pytest.mark.parametrize(("kind", "verb"), [_runs(kind, verb) for kind in KINDS for verb in ("modes", "static", "table", "map", "runout")])
def test_a_new_scene_runs(scenes: Path, kind: str, verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    more = {
        "table": ["--temperatures", "20", "30"],
        "map": ["--temperatures", "20", "30", "--speeds", "1000", "2000"],
        "runout": ["--speed", "3000", "--path", "linear", "--seconds", "0.3"],
    }.get(verb, [])
    assert main([verb, str(scenes / kind), *more, "--json", "--out", str(tmp_path / verb)]) == 0
    said = capsys.readouterr()
    assert json.loads(said.out)["warnings"] == []
    assert list((tmp_path / verb).iterdir())


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_new_scene_is_hit(scenes: Path, kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The virtual hammer test finds modes where the model has some, and its log is written."""
    assert main(["impact", str(scenes / kind), "--json", "--out", str(tmp_path / "hit")]) == 0
    assert (tmp_path / "hit" / "impact.rrd").stat().st_size > 1e5
    answer = json.loads(capsys.readouterr().out)
    assert len(answer["modes"]) >= 3


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["hdd", "machine-tool", "grinding"])
def test_a_new_scene_warms_up(scenes: Path, kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["warmup", str(scenes / kind), "--minutes", "20", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("kind", KINDS)
def test_every_key_is_explained_where_it_first_stands(kind: str) -> None:
    seen: set[str] = set()
    for line in TEMPLATES[kind].splitlines():
        if found := re.match(r"(?:# )?(\w+) = (.+)", line):
            key = found[1]
            if key not in seen and key not in PLAIN:
                assert " # " in found[2], f"{kind}: {key}"
            seen.add(key)


def test_every_key_of_a_scene_is_in_some_template() -> None:
    """But for single waves, what a diagnosis writes, and what only effects add."""
    from thermospindle.model.scene.form import Scene

    schema = Scene.model_json_schema()
    left_out = {"Waves", "BallWave", "RowImperfections", "Build", "Effect", "Imperfections", "LawTable"}
    told = "\n".join(TEMPLATES.values())
    keys = {key for name, table in schema["$defs"].items() if name not in left_out for key in table.get("properties", {})}
    missing = [k for k in sorted(keys - {"origin", "origins", "source"}) if not re.search(rf"\b{k}\b", told)]
    assert missing == []


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["new", "a/b", "--like", "hdd"], "is no name of a folder"),
        (["new", "a\nb", "--like", "hdd"], "is no name of a folder"),
        (["new", "x", "--like", "lamp"], "argument --like: 'lamp' is unknown; allowed are hdd, machine-tool, grinding, rotor"),
        (["new", "x", "--like", "rottor"], "argument --like: 'rottor' is unknown; did you mean rotor?"),
        (["new", "x"], "--like"),
    ],
)
def test_what_cannot_be_made_is_said(words: list[str], why: str, capsys: pytest.CaptureFixture[str]) -> None:
    try:
        code = main(words)
    except SystemExit as end:
        code = int(end.code or 0)
    assert code == 2
    assert why in capsys.readouterr().err


def test_nothing_is_overwritten(scenes: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine").mkdir()
    assert main(["new", "mine", "--like", "hdd", "--out", str(tmp_path / "mine")]) == 2
    assert "is there already" in capsys.readouterr().err
    assert list((tmp_path / "mine").iterdir()) == []
