"""Pictures and tables of docs/ are of the scene as they are now. Cheap: nothing is made again."""

import re

import pytest

from tests.blind.study import KINDS
from tests.conftest import SCENE
from tests.docs_made import DOCS, HOW, digest, notes
from thermospindle.model.scene.reading import content_hash, load

MADE = sorted(f.name for f in DOCS.iterdir() if f.suffix in (".png", ".txt"))


def test_every_made_file_says_how_it_was_made():
    assert MADE == sorted(HOW) == sorted(notes())


@pytest.mark.parametrize("name", MADE)
def test_a_made_file_is_of_the_scene_as_it_is(name):
    note = notes()[name]
    again = f"docs/{name} is not of today's scene: {note['how']}; then python -m tests.docs_made {name}"
    assert note["file"] == digest(DOCS / name), f"docs/{name} has changed since it was noted: python -m tests.docs_made {name}"
    assert note["scene"] == content_hash(load(SCENE)), again


def test_the_blind_study_says_what_it_is_of():
    """Seeds, commit, and a row for each kind of campaign."""
    text = (DOCS / "blind.txt").read_text(encoding="utf-8")
    assert re.match(r"\d+ campaigns, seeds \d[\d,to\s]*,\s+commit\s+[0-9a-f]{7}", text)
    assert set(re.findall(r"^│ (\w+) ", text, flags=re.M)) >= {*KINDS, "all"}
