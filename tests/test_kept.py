"""What an output folder may not take the place of."""

from __future__ import annotations

import pytest

from thermospindle.cli import main


@pytest.fixture
def scene(tmp_path, capsys):
    """A scene that `add` wrote: a folder of the program's own, which it may replace."""
    folder = tmp_path / "worn"
    assert main(["add", "hdd_2003", "preload_loss", "--set", "loss=0.3", "--out", str(folder)]) == 0
    capsys.readouterr()
    return folder


def test_no_other_verb_takes_the_place_of_a_scene(scene, capsys):
    text = (scene / "spindle.toml").read_text(encoding="utf-8")
    assert main(["modes", "hdd_2003", "--out", str(scene)]) == 2
    assert "holds a scene, spindle.toml; name a new or empty folder" in capsys.readouterr().err
    assert main(["modes", str(scene), "--out", str(scene)]) == 2
    assert f"--out {scene}: holds {scene}, which is read; name another folder" in capsys.readouterr().err
    assert (scene / "spindle.toml").read_text(encoding="utf-8") == text


def test_a_scene_is_written_anew(scene, capsys):
    assert main(["add", "hdd_2003", "preload_loss", "--set", "loss=0.2", "--out", str(scene)]) == 0
    assert "loss = 0.2" in (scene / "spindle.toml").read_text(encoding="utf-8")


def test_each_temperature_is_asked_once(capsys):
    assert main(["table", "hdd_2003", "--temperatures", "20", "20"]) == 2
    assert "--temperatures: 20 stands twice; each is allowed once" in capsys.readouterr().err
