"""A mapping that was written for another scene: refused, or taken for the same machine under another name."""

from __future__ import annotations

import shutil

import pytest

from tests.conftest import SCENE
from tests.made_campaign import FREQUENCY
from tests.sim.importing.exported import HEAD, SPINDLE, columns, table
from thermospindle.model.errors import BadInput
from thermospindle.report.verbs.importing import bring
from thermospindle.sim.campaign.campaign import read_campaign


@pytest.mark.parametrize(
    ("right", "wrong", "told"),
    [
        ('body = "seat"', 'body = "table"', "has no body 'table';"),
        ('body = "hub"', 'body = "seat"', "has node 1 on hub, not seat;"),
        ('direction = "-X"', 'direction = "-Y"', r"has node 3 along \+X, not -Y;"),
        ("[12.0, 0.0, 20.0]", "[12.0, 0.0, 35.0]", "has node 1 at 12, 0, 20 mm, not 12, 0, 35;"),
        ("[[tests]]", '[[files]]\nfile = "T20.csv"\nreference = 9\n[[tests]]', "has no point 9;"),
        ("[[tests]]", '[[files]]\nfile = "T20.csv"\nresponse = "5:+Y"\n[[tests]]', r"has node 5 along \+Z, not \+Y;"),
        ("[[points]]", "[[points]]\nnode = 40\n[[points]]", "has no point of node 40;"),
    ],
)
def test_a_mapping_for_another_scene_is_refused(right, wrong, told, tmp_path):
    """It made a campaign for one scene, to be compared with another."""
    heads, found = columns("real", "(m/s)/N")
    file = table(tmp_path / "T20.csv", ["Frequency", *heads], [FREQUENCY, *found])
    (tmp_path / "m.toml").write_text('spindle = "free_shaft"\n' + HEAD.replace(right, wrong, 1))
    with pytest.raises(BadInput, match=rf"m.toml: spindle = 'free_shaft': --scene hdd_2003 is 'hdd_2003', and of what the mapping names hdd_2003 {told}"):
        bring([file], mapping=tmp_path / "m.toml", scene="hdd_2003", out=tmp_path / "c")
    assert not (tmp_path / "c").exists()


def test_a_mapping_serves_a_scene_that_was_renamed(tmp_path):
    """The same machine under another name: all that the mapping names is there. The campaign is the new scene's, and both names are said."""
    heads, found = columns("real", "(m/s)/N")
    file = table(tmp_path / "T20.csv", ["Frequency", *heads], [FREQUENCY, *found])
    (tmp_path / "m.toml").write_text(SPINDLE + HEAD)
    shutil.copytree(SCENE, tmp_path / "mine")
    said = bring([file], mapping=tmp_path / "m.toml", scene=tmp_path / "mine", out=tmp_path / "c").values["warnings"]
    assert [w for w in said if "spindle = 'hdd_2003'" in w and "is 'mine', which has nodes 1, 3, 6 on the same bodies in the same places" in w] == said
    assert read_campaign(tmp_path / "c").spindle == "mine"
    assert bring([file], mapping=tmp_path / "m.toml", scene="hdd_2003", out=tmp_path / "d").values["warnings"] == []
    assert read_campaign(tmp_path / "d").spindle == "hdd_2003"


def test_a_mapping_that_tells_no_point_is_of_no_renamed_scene(tmp_path):
    """Nodes of the same numbers are no evidence: any two scenes have a node 1."""
    heads, found = columns("real", "(m/s)/N")
    file = table(tmp_path / "T20.csv", ["Frequency", *heads], [FREQUENCY, *found])
    (tmp_path / "m.toml").write_text(SPINDLE + HEAD.split("[[points]]")[0])
    with pytest.raises(BadInput, match=r"--scene five_bearing is 'five_bearing', and no \[\[points\]\] of the mapping tells .* that they are one machine"):
        bring([file], mapping=tmp_path / "m.toml", scene="five_bearing", out=tmp_path / "c")
