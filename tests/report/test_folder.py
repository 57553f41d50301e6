"""Output folders are replaced only where they hold nothing but what spindle wrote."""

import json
import shutil
from pathlib import Path

import pytest

from tests.command_line import refused
from tests.conftest import DATA, SCENE
from thermospindle.model.errors import BadInput
from thermospindle.model.files.whole import whole
from thermospindle.report.folder import MARK, mark, whole_folder


def write(out, **files):
    with whole_folder(out) as folder:
        for name, text in files.items():
            (folder / name).write_text(text)
        mark(folder, {"verb": "test"}, {"answer": 1})


def test_an_own_folder_is_replaced_whole(tmp_path):
    write(tmp_path / "o", a="1", b="2")
    write(tmp_path / "o", b="3")
    assert {p.name: p.read_text() for p in (tmp_path / "o").iterdir() if p.name != MARK} == {"b": "3"}
    assert set(json.loads((tmp_path / "o" / MARK).read_text())) == {"options", "answer", "files"}


def test_files_of_others_are_never_deleted(tmp_path):
    write(tmp_path / "o", a="1")
    for place in (tmp_path / "o" / "mine.txt", tmp_path / "o" / "deep" / "mine.txt"):
        place.parent.mkdir(exist_ok=True)
        place.write_text("precious")
        with pytest.raises(BadInput, match=r"mine\.txt, which spindle did not write"):
            write(tmp_path / "o", a="2")
        assert place.read_text() == "precious"
        place.unlink()
    write(tmp_path / "o", a="2")


def test_a_file_that_was_edited_is_not_overwritten(tmp_path):
    write(tmp_path / "o", a="1")
    (tmp_path / "o" / "a").write_text("edited by hand")
    with pytest.raises(BadInput, match="a was changed since spindle wrote it"):
        write(tmp_path / "o", a="2")


def test_a_copied_mark_does_not_make_a_folder_ours(tmp_path):
    write(tmp_path / "o", a="1")
    home = tmp_path / "home"
    home.mkdir()
    (home / "thesis.tex").write_text("precious")
    shutil.copy(tmp_path / "o" / MARK, home / MARK)
    with pytest.raises(BadInput, match=r"thesis\.tex, which spindle did not write"):
        write(home, a="1")
    (home / MARK).write_text("{}")
    with pytest.raises(BadInput, match="did not write"):
        write(home, a="1")


def test_a_file_in_the_way_is_named(tmp_path):
    (tmp_path / "file").write_text("precious")
    with pytest.raises(BadInput, match=r"file: is a file; name a new"):
        write(tmp_path / "file", a="1")
    with pytest.raises(BadInput, match=r"file is a file, so no folder can be made in it"):
        write(tmp_path / "file" / "deep" / "out", a="1")
    assert (tmp_path / "file").read_text() == "precious"


@pytest.mark.parametrize("name", ["", ".", ".."])
def test_where_one_stands_is_not_replaced(tmp_path, monkeypatch, name):
    """An empty name, as of a shell's variable that is not set, is the folder one stands in:
    replaced, even an empty one leaves the shell in a folder that is gone."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    with pytest.raises(BadInput, match="is where you stand"):
        write(Path(name), a="1")
    assert list((tmp_path / "here").iterdir()) == []


def test_nor_does_a_campaign_come_there(tmp_path, monkeypatch):
    """Whatever is written whole: an import to an empty name replaced the folder."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    with pytest.raises(BadInput, match="is where you stand"), whole(Path("")) as folder:
        folder.mkdir()


@pytest.mark.parametrize("verb", ["runout", "warmup", "map", "impact", "compare", "diagnose", "ladder"])
def test_a_folder_that_cannot_be_written_is_refused_before_anything_is_worked_out(verb, tmp_path, capsys, monkeypatch):
    """A diagnosis of minutes was lost to an --out that holds something else."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("mine")
    of = {"impact": "chain", "compare": "compare", "diagnose": "diagnose", "ladder": "ladder"}.get(verb, "running")
    monkeypatch.setattr(f"thermospindle.report.verbs.{of}.with_effects", lambda *_: pytest.fail("a scene is read"))
    campaign = [DATA / "foreign_none"] if verb in ("compare", "diagnose", "ladder") else []
    assert "holds something that spindle did not write" in refused(capsys, verb, SCENE, *campaign, "--out", tmp_path / "mine")
    assert "is a file" in refused(capsys, verb, SCENE, *campaign, "--out", tmp_path / "mine" / "notes.txt")
    assert [p.name for p in tmp_path.iterdir()] == ["mine"]


def test_what_cannot_be_used_is_refused_before_anything_is_worked_out(tmp_path, capsys, monkeypatch):
    """A campaign of another machine, after its modes were found; an earlier diagnosis that is none, when the new one was there."""
    (tmp_path / "none.json").write_text("{")
    for of in ("compare", "diagnose"):
        monkeypatch.setattr(f"thermospindle.report.verbs.{of}.progress_bar", lambda *_: pytest.fail("it is worked out"))
    assert "points.1.body = 'hub': no body of scene free_shaft; allowed are shaft" in refused(capsys, "compare", "free_shaft", DATA / "foreign_none")
    assert "no body of scene free_shaft" in refused(capsys, "compare", SCENE, DATA / "foreign_none", "--before", "free_shaft")
    for file, why in ((tmp_path / "none.json", "is not an answer of spindle diagnose --json"), (tmp_path, "cannot be read: it is a folder"), (tmp_path / "no", "no such file")):
        assert why in refused(capsys, "diagnose", SCENE, DATA / "foreign_none", "--predictions", file)


def test_a_folder_in_the_place_of_a_file_is_said_to_be_one(tmp_path, capsys):
    (tmp_path / "m.toml").mkdir()
    assert refused(capsys, "import", DATA / "foreign_none" / "T20_n0.uff", "--mapping", tmp_path / "m.toml", "--out", tmp_path / "c").endswith("m.toml: it is a folder\n")
    assert refused(capsys, "add", SCENE, "bond_softening", "--from", tmp_path, "--out", tmp_path / "mine").endswith("cannot be read: it is a folder\n")
    assert [p.name for p in tmp_path.iterdir()] == ["m.toml"]
