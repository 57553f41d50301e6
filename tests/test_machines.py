"""Verbs on the machines that are no disk drive: each answers, or says in one sentence why it cannot."""

from __future__ import annotations

import json

import pytest

from tests.conftest import ROOT
from thermospindle.cli import main

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
        (f"impact {FREE}", "steps of"),
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
