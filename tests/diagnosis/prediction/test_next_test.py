"""What is predicted of a test that has not been made, and which test is proposed."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.virtual_campaign import drawn, effect, mode_campaign, model_of, virtual_campaign
from thermospindle.diagnosis.decision.explanations import Candidate
from thermospindle.diagnosis.inference.evidence import evidence
from thermospindle.diagnosis.inference.fit import fit
from thermospindle.diagnosis.inference.hypothesis import Hypothesis
from thermospindle.diagnosis.inference.problem import Problem
from thermospindle.diagnosis.parameters.mechanism import variants
from thermospindle.diagnosis.prediction import next_test
from thermospindle.diagnosis.prediction.forecast import ModePrediction, Standing, covariance, forecast, standing
from thermospindle.diagnosis.prediction.next_test import _weighed, next_tests, of_both, planned
from thermospindle.diagnosis.prediction.outcomes import same
from thermospindle.model.machine import Condition

TESTED = Condition(20.0)


def test_no_test_is_proposed_where_bearings_have_lost_contact(spindle):
    """A router spindle was to be tested 7 K above where its front pair unloads, with modes at 8.7 Hz."""
    tests = (Condition(20.0), Condition(50.0))
    model = model_of(spindle, virtual_campaign(spindle, tests, 5, [], drawn(spindle, 2, 5), responses=(1, 6), frequency=np.arange(400.0, 6000.1, 80.0)))
    first = fit(model)
    none = Standing(Hypothesis(first, evidence(model, first)), first.point)
    modes = forecast(model, none, Condition(60.0))
    assert modes is not None
    assert modes[0].frequency > 300
    assert forecast(model, none, Condition(150.0)) is None


@pytest.fixture(scope="module")
def one_test(spindle):
    """A campaign of one test with a lost preload, its model, and the fits of what was lost and of a
    rival, as a search has them before the best are settled."""
    loss = effect("preload_loss")
    campaign = mode_campaign(spindle, [TESTED], 1, [(loss, {**loss.neutral(), "loss": 0.4})], errors=drawn(spindle, 1, 1))
    model = model_of(spindle, campaign)
    found = []
    for name in ("preload_loss", "clearance_opening"):
        mechanisms = variants(effect(name))[:1]
        start = Problem(model, mechanisms).start({0: mechanisms[0].size.typical})
        done = fit(model, mechanisms, start)
        found.append(Hypothesis(done, evidence(model, done)))
    return model, found


def test_what_was_measured_is_predicted_where_it_was(one_test):
    """Predictions were 3 to 4 Hz off what the very test had shown that they were fitted to, with a stated standard error of 0.45 Hz."""
    model, found = one_test
    promised = found[0].evidence
    away = promised.mean + 0.3 * (np.arange(len(promised.mean)) == len(model.parameters))  # where the least of a quadratic lies that does not hold there
    found = [*found, replace(found[0], evidence=replace(promised, mean=away))]
    there = Problem(model, found[-1].mechanisms).residuals(away)
    assert there is None or sum(float(r @ r) for r in there) > promised.chi2 + 100
    measured = model.tests[0]
    for h in found:
        predicted = forecast(model, standing(model, h), TESTED)[: len(measured.frequency)]
        off = np.array([m.frequency for m in predicted]) - measured.frequency
        errors = covariance(predicted) + np.diag((measured.frequency * measured.frequency_sd) ** 2)
        assert off @ np.linalg.solve(errors, off) < len(off)


def test_no_test_that_was_made_is_proposed(one_test):
    model, found = one_test
    candidates = tuple(Candidate(h, h.names, False, 10.0, 0.5) for h in found)
    verdict = SimpleNamespace(word="ambiguous", effects=tuple(n for h in found for n in h.names), candidates=candidates, free=())
    proposed = next_tests(SimpleNamespace(model=model), verdict)
    assert proposed
    assert not any(same(t.condition, TESTED) for t in proposed)


@pytest.mark.slow
def test_a_test_beyond_what_the_spindle_is_meant_for_only_where_none_within_decides(one_test, monkeypatch):
    """A rig that is meant for 20 to 60 C and 7200 rpm was sent to 80 C and 10,800 rpm where 60 C at rest told as surely."""
    model, found = one_test
    verdict = SimpleNamespace(word="ambiguous", effects=tuple(n for h in found for n in h.names), candidates=tuple(Candidate(h, h.names, False, 10.0, 0.5) for h in found), free=())
    odds = {30.0: 200.0, 0.0: 1e5}
    weigh = next_test._weighed
    monkeypatch.setattr(next_test, "_weighed", lambda plan, *of: replace(weigh(plan, *of), odds=odds.get(plan.temperature, 3.0)))
    [t] = next_tests(SimpleNamespace(model=model), verdict)
    assert (t.condition.temperature, t.beyond) == (30.0, False)
    odds[30.0] = 20.0
    [t] = next_tests(SimpleNamespace(model=model), verdict)
    assert (t.condition.temperature, t.beyond) == (0.0, True)


def test_of_what_nothing_explains_the_test_parts_drift_from_the_catalogue(one_test):
    """Not two effects that were both turned down from each other."""
    model, found = one_test
    free = Candidate(found[0], ("preload",), True, 20.0, 1.0)
    known = tuple(Candidate(h, h.names, False, 10.0, 0.0) for h in reversed(found))
    told = next_tests(SimpleNamespace(model=model), SimpleNamespace(word="unexplained", effects=(), candidates=known, free=(free,)))
    assert {t.separates for t in told} <= {("preload", "clearance_opening")}
    assert told


def test_what_is_only_left_predicts_nothing(one_test):
    model, found = one_test
    done = fit(model)
    left = Candidate(Hypothesis(done, evidence(model, done)), ("what is left",), True, 0.0, 0.9)
    known = Candidate(found[0], found[0].names, False, 10.0, 0.1)
    verdict = SimpleNamespace(word="unexplained", effects=(), candidates=(known,), free=(left,))
    assert next_tests(SimpleNamespace(model=model), verdict) == []


def replace_speeds(model, speed):
    """The model with a test that turns beside those at rest."""
    own = SimpleNamespace(condition=Condition(40.0, speed, 50.0, 60.0))
    return SimpleNamespace(tests=[*model.tests, own], spindle=model.spindle)


def test_tests_are_planned_as_the_campaign_was_made():
    """Hit and soaked as most tests were: predictions at no force for ever in the chamber were judged by tests at 50 N after a minute."""
    tests = [SimpleNamespace(condition=Condition(t, 0.0, *how)) for t, how in ((20.0, (50.0, 60.0)), (40.0, (50.0, 60.0)), (60.0, ()))]
    turning, standing = (
        SimpleNamespace(tests=tests, spindle=SimpleNamespace(nominal_speed=700.0, structure=SimpleNamespace(bodies=[SimpleNamespace(turns=turns)]))) for turns in (True, False)
    )
    assert {plan.speed for plan in planned(standing)} == {0.0}
    plans = planned(turning)
    back = replace_speeds(turning, -300.0)
    assert {p.speed for p in planned(back)} == {-p.speed for p in plans}  # the other way, as its tests
    assert Condition(40.0, -700.0, 50.0, 60.0) not in planned(replace_speeds(turning, -700.0))
    assert {(p.level, p.soak_time) for p in plans} == {(50.0, 60.0)}
    assert Condition(20.0, 0.0, 50.0, 60.0) not in plans
    assert Condition(60.0, 0.0, 50.0, 60.0) in plans


def predicted(shift, common):
    """Nine modes, `shift` (9,) Hz above others, with errors that are `common` (9, c) and 0.1 Hz of their own."""
    at = np.linspace(1000.0, 5000.0, 9)
    return tuple(ModePrediction(f, float(np.sqrt(0.01 + c @ c)), 0.01, tuple(c)) for f, c in zip(at + shift, common, strict=True))


def test_odds_come_true():
    """Of frequencies drawn as one of two explanations has them, with the errors that are stated:
    the mean of ln odds. What one thermometer and one size do to nine modes is no nine times known."""
    random = np.random.default_rng(0)
    thermometer, size = random.standard_normal((2, 9))
    shift = 3 * size + 0.05 * random.standard_normal(9)
    a, b = predicted(shift, np.column_stack([thermometer, size])), predicted(0.0, np.column_stack([thermometer, size]))
    errors = of_both(a, b)
    programs = np.diag([(1e-4 * m.frequency) ** 2 for m in a])
    assert errors == pytest.approx(0.01 * np.eye(9) + programs + np.outer(thermometer, thermometer) + 2 * np.outer(size, size))
    off = random.multivariate_normal(np.zeros(9), errors, 20_000)
    inverse = np.linalg.inv(errors)
    ln_odds = (np.einsum("ni,ij,nj->n", off + shift, inverse, off + shift) - np.einsum("ni,ij,nj->n", off, inverse, off)) / 2
    told = _weighed(Condition(60.0), SimpleNamespace(names=("one",)), SimpleNamespace(names=("other",)), a, b)
    stated = np.log(told.odds)
    assert np.mean(ln_odds) == pytest.approx(stated, abs=5 * np.std(ln_odds) / np.sqrt(len(off)))
    counted_apart = sum(d**2 / (x.sd**2 + y.sd**2) for d, x, y in zip(shift, a, b, strict=True)) / 2
    assert counted_apart > 3 * stated
