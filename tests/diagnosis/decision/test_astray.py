"""What is stated where evidence leaves no doubt, and has been wrong all the same."""

from __future__ import annotations

import numpy as np
import pytest

from tests.hand_made_search import made, total
from thermospindle.diagnosis.decision import explanations
from thermospindle.diagnosis.decision.explanations import COARSE
from thermospindle.diagnosis.decision.verdict import decide

SHARE, UNTRIED = 0.2, 0.25


@pytest.fixture(autouse=True)
def astray(monkeypatch, by_evidence_alone):
    monkeypatch.setattr(explanations, "ASTRAY", SHARE)
    monkeypatch.setattr(explanations, "UNTRIED", UNTRIED)


def test_no_lead_of_one_effect_leaves_no_doubt():
    """What evidence says, or, in `SHARE` of all cases, something untried or what coarse evidence says: twelve behind are then two."""
    v = decide(made({"a": 5000.0, "b": 5000.0 - 2 * COARSE}))
    behind = np.exp(-2.0) / (1 + np.exp(-2.0))
    assert (v.word, v.effects) == ("identified", ("a",))
    assert v.probability_none == pytest.approx(0.0, abs=1e-9)
    assert v.probability_unknown == pytest.approx(SHARE * UNTRIED, rel=1e-3)
    assert v.candidates[1].probability == pytest.approx((1 - SHARE) * np.exp(-2 * COARSE) + SHARE * (1 - UNTRIED) * behind, rel=1e-3)
    assert total(v) == pytest.approx(1.0, abs=1e-9)


def test_nor_does_any_lead_of_something_unknown():
    v = decide(made({"a": 40.0, "~x": 5000.0}))
    assert v.word == "unexplained"
    assert v.free[0].names == ("~x",)
    assert v.candidates[0].probability == pytest.approx(SHARE * (1 - UNTRIED), rel=1e-3)
    alone = decide(made({"~x": 5000.0}))
    assert alone.probability_unknown == pytest.approx(1.0, abs=1e-9)
    assert [(c.names, c.probability) for c in alone.free] == [(("~x",), pytest.approx(1 - SHARE))]


def test_of_nothing_missing_it_says_nothing(monkeypatch):
    gains = {"a": 3.0, "b": -1.0, "~x": 2.0}
    told = decide(made(gains)).probability_none
    monkeypatch.setattr(explanations, "ASTRAY", 0.0)
    assert told == decide(made(gains)).probability_none


def test_a_set_is_of_what_evidence_leaves_open(monkeypatch):
    """What is six behind has a share of what goes astray, and no place in the set."""
    gains = {"a": 60.0, "b": 60.0, "c": 54.0}
    v = decide(made(gains))
    assert (v.word, set(v.effects)) == ("ambiguous", {"a", "b"})
    assert v.candidates[2].probability > 0.01
