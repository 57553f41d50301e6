"""The diagnosis of a measured free shaft whose scene has the plainest beam: one condition, four frequencies and shapes of a table."""

from dataclasses import replace

import numpy as np
import pytest

import thermospindle as ts
from tests.conftest import ROOT
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.diagnosis.verdict import diagnose
from thermospindle.report.text.diagnosis.answer import diagnosis_json
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.effects import by_name

SCENE = ROOT / "scenes" / "free_shaft"
CATALOGUE = tuple(by_name(name) for name in ("shear", "rotary_inertia", "sensor_mass", "window_damping"))


@pytest.fixture(scope="module")
def campaign():
    return read_campaign(SCENE / "measured" / "modelab")


@pytest.fixture(scope="module")
def measured(coarse, campaign):
    return diagnose(coarse, campaign, CATALOGUE)


def test_the_missing_shear_is_named(measured):
    """Against a free constant error of every frequency, the only other thing that one condition could show."""
    verdict = measured.verdict
    assert (verdict.word, verdict.effects) == ("identified", ("shear",))
    base, own = (h.evidence.learned.sizes for h in (measured.search.base, verdict.accepted))
    assert base[kinds_of.STIFFNESS] == 1e-2
    assert own[kinds_of.STIFFNESS] < 1e-3
    assert "constantly wrong by about 1 % of each" in verdict.reason


def test_what_is_shown_of_a_diagnosis_is_a_line(measured):
    """Every number that a search went through was, before."""
    assert repr(measured) == f"<Diagnosis of {measured.campaign.title!r} beside {measured.spindle.name}: {measured.verdict.reason}>"
    assert repr(measured.verdict) == f"<Verdict identified shear: {measured.verdict.reason}>"
    assert repr(measured.verdict.candidates[0]).startswith("<Candidate shear: ln evidence +")
    assert max(len(repr(x)) for x in (measured.search, measured.search.model, measured.verdict.accepted, measured.verdict.accepted.fit)) < 200


def test_one_condition_shows_no_drift(measured):
    assert not {kinds_of.STIFFNESS_DRIFT, kinds_of.DAMPING_DRIFT} & {p.kind for p in measured.search.model.parameters}
    assert np.isnan(measured.verdict.held_out_after)  # nothing can be left out of one condition


def test_what_cannot_be_told_apart_is_said(measured):
    assert measured.may_hide == ("rotary_inertia",)
    answer = ts.answer(measured)
    assert answer == diagnosis_json(measured)
    assert answer["may_hide"] == ["rotary_inertia"]
    assert answer["error"]["held_out_after"] is None
    for test in answer["next_test"]:  # no other temperature tells them apart, either; turning, hardly: of a rotary inertia 3.6 times too large the gyroscopic moment is so, too
        assert test["condition"]["speed_rpm"] > 0
        assert test["odds"] < 5


@pytest.mark.slow
def test_a_beam_that_shears_lacks_nothing(coarse, campaign):
    """With shear and rotary inertia in the scene and frequencies of that very beam, nothing is named."""
    from thermospindle.model.machine import Condition
    from thermospindle.model.rotor.beam import with_theory
    from thermospindle.sim.operating import operating_point

    whole = replace(coarse, structure=with_theory(coarse.structure, coarse.materials, 20.0, (1.0, 1.0)))
    frequency = [m.frequency for m in operating_point(whole, Condition(20.0)).modes_below(1100.0)]
    (test,) = campaign.tests
    random = np.random.default_rng(3)
    rows = tuple(replace(row, frequency=f + 0.05 * random.standard_normal()) for row, f in zip(test.modes, frequency, strict=True))
    found = diagnose(whole, replace(campaign, tests=(replace(test, modes=rows),)), CATALOGUE)
    assert found.verdict.word == "none"
    assert found.may_hide == ()
