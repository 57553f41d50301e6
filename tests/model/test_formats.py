"""Formats of files: what is written says its own, older ones are read as they were meant, newer ones are refused by name."""

import json
import shutil
import tomllib

import pytest

from tests.conftest import ROOT, SCENE
from thermospindle.cli import main
from thermospindle.diagnosis.answer import read_answer
from thermospindle.model.errors import BadInput
from thermospindle.model.files.formats import CURRENT, KEY, MIGRATIONS, migrated
from thermospindle.model.scene.reading import content_hash, load
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.campaign.form import CampaignTable
from thermospindle.sim.importing.mapping import MappingForm, read_mapping
from thermospindle.sim.study.form import StudyForm, read_study

STUDY = 'title = "t"\nkind = "monte-carlo"\nscene = "hdd_2003"\ndraws = 5\n'
ANSWER = {"verdict": "none", "effects": [], "candidates": []}


def read(kind, text, folder):
    """The reader of a kind of file, on a text of it."""
    name = {"scene": "spindle.toml", "campaign": "campaign.toml", "diagnosis": "d.json"}.get(kind, "f.toml")
    (folder / name).write_text(text, encoding="utf-8")
    return {"scene": load, "campaign": lambda f: read_campaign(f.parent), "mapping": read_mapping, "study": read_study, "diagnosis": read_answer}[kind](folder / name)


def text_of(kind, folder, number):
    """A file of a kind that says a format, or none."""
    if kind == "diagnosis":
        return json.dumps(({} if number is None else {KEY: number}) | ANSWER)
    if kind == "campaign":
        shutil.copy(SCENE / "measured" / "jang_2003" / "modes.csv", folder)
    whole = {"scene": (SCENE / "spindle.toml"), "campaign": SCENE / "measured" / "jang_2003" / "campaign.toml"}
    text = whole[kind].read_text(encoding="utf-8") if kind in whole else {"mapping": 'title = "t"\n', "study": STUDY}[kind]
    text = "".join(line for line in text.splitlines(keepends=True) if not line.startswith(KEY))
    return text if number is None else f"{KEY} = {number}\n{text}"


@pytest.mark.parametrize("kind", CURRENT)
def test_every_format_up_to_todays_is_read_and_none_after(tmp_path, kind):
    for number in (None, *range(1, CURRENT[kind] + 1)):
        assert read(kind, text_of(kind, tmp_path, number), tmp_path) is not None
    with pytest.raises(BadInput, match=rf"format = {CURRENT[kind] + 1}: is newer than this program; thermospindle \S+ reads a {kind} of format 1 to {CURRENT[kind]}"):
        read(kind, text_of(kind, tmp_path, CURRENT[kind] + 1), tmp_path)


@pytest.mark.parametrize("number", ["0", "-1", "true", '"2"', "2.0", "9" * 4000, "[]"])
def test_what_is_no_format_is_refused(tmp_path, number):
    with pytest.raises(BadInput, match="format = "):
        read("study", text_of("study", tmp_path, number), tmp_path)


@pytest.mark.slow
def test_what_is_written_says_its_format(tmp_path, capsys):
    for file in ROOT.glob("scenes/*/spindle.toml"):
        assert tomllib.loads(file.read_text(encoding="utf-8"))[KEY] == CURRENT["scene"]
    for file in ROOT.glob("scenes/templates/*.toml"):
        assert tomllib.loads(file.read_text(encoding="utf-8"))[KEY] == CURRENT["scene"]
    for file in (ROOT / "scenes").rglob("campaign.toml"):
        assert tomllib.loads(file.read_text(encoding="utf-8"))[KEY] == CURRENT["campaign"]
    assert main(["simulate", str(SCENE), "--temperatures", "20", "--hits", "2", "--out", str(tmp_path / "c")]) == 0
    assert (tmp_path / "c" / "campaign.toml").read_text(encoding="utf-8").startswith(f"{KEY} = {CURRENT['campaign']}\n")
    (tmp_path / "peaks.csv").write_text("test,frequency_Hz\nT20,1002\n", encoding="utf-8")
    main(["import", str(tmp_path / "peaks.csv"), "--mapping", str(tmp_path / "m.toml"), "--scene", str(SCENE)])
    assert f"\n{KEY} = {CURRENT['mapping']}\n" in (tmp_path / "m.toml").read_text(encoding="utf-8")
    assert {form.model_fields[KEY].default for form in (CampaignTable, MappingForm, StudyForm)} == {1}


def test_there_is_a_way_from_every_format_to_todays():
    steps = {(kind, n) for kind, now in CURRENT.items() for n in range(1, now)}
    assert set(MIGRATIONS) == steps


def test_a_scene_of_the_first_format_is_the_same_spindle(tmp_path):
    """Its second arrangement, of the stiffness alone, said what the first did."""
    text = text_of("scene", tmp_path, None)
    pair = 'origins = { stiffness_arrangement = "calibrated" }\narrangement = "back-to-back"\nstiffness_arrangement = "back-to-back"\n'
    changed = text.replace('arrangement = "back-to-back"', pair.rstrip("\n"), 1)
    assert changed != text
    assert content_hash(read("scene", changed, tmp_path)) == content_hash(load(SCENE))
    with pytest.raises(BadInput, match="allowed here"):
        read("scene", f"{KEY} = 2\n{changed}", tmp_path)


def test_what_cannot_be_carried_over_is_said(tmp_path):
    text = text_of("scene", tmp_path, None).replace('arrangement = "back-to-back"', 'arrangement = "back-to-back"\nstiffness_arrangement = "face-to-face"', 1)
    with pytest.raises(BadInput, match=r"spindle\.toml: bearing_pair\.stiffness_arrangement = 'face-to-face': scenes of format 1 .* take the key out"):
        read("scene", text, tmp_path)


def test_a_migration_leaves_what_is_of_today(tmp_path):
    for (kind, number), step in MIGRATIONS.items():
        raw = tomllib.loads((SCENE / "spindle.toml").read_text(encoding="utf-8")) if kind == "scene" else {}
        assert step(raw) == raw, (kind, number)
    assert migrated("scene", ["no table"], "here") == ["no table"]


def test_migrations_follow_one_another(monkeypatch):
    monkeypatch.setitem(CURRENT, "study", 3)
    monkeypatch.setitem(MIGRATIONS, ("study", 1), lambda raw: raw | {"a": 1})
    monkeypatch.setitem(MIGRATIONS, ("study", 2), lambda raw: raw | {"b": raw.get("a", 0) + 1})
    assert migrated("study", {}, "here") == {"a": 1, "b": 2}
    assert migrated("study", {KEY: 2}, "here") == {KEY: 3, "b": 1}
    assert migrated("study", {KEY: 3}, "here") == {KEY: 3}


def test_a_newer_diagnosis_is_refused_wherever_it_is_read(tmp_path, capsys):
    (tmp_path / "d.json").write_text(json.dumps({KEY: 99, "where": [], "next_test": []} | ANSWER), encoding="utf-8")
    file = str(tmp_path / "d.json")
    for command in (
        ["add", SCENE, "bond_softening", "--from", file, "--out", tmp_path / "o"],
        ["draft", file, "--out", tmp_path / "o.py"],
        ["workbench", SCENE, SCENE / "measured" / "jang_2003", "--diagnosis", file],
    ):
        assert main([str(a) for a in command]) == 2
        assert "format = 99: is newer than this program" in capsys.readouterr().err
