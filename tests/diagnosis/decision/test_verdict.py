"""Verdicts from hand-made searches: what follows from probabilities and the stated loss."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.hand_made_search import made, total
from thermospindle.diagnosis.decision import reason, verdict
from thermospindle.diagnosis.decision.conditions import conditions_of
from thermospindle.diagnosis.decision.loss import FALSE_ALARM, HALF, MISSED, SET, WRONG
from thermospindle.diagnosis.decision.verdict import decide
from thermospindle.diagnosis.parameters.nuisance import (
    BUILD,
    DAMPING_DRIFT,
    EXPANSION,
    EXPANSION_SD,
    LAW,
    ORBITS,
    STIFFNESS_DRIFT,
    Nuisance,
)
from thermospindle.model.machine import Condition

CASES = {
    "nothing tried": ({}, "none", ()),
    "nothing gained": ({"a": -1.0, "b": 0.5, "~x": 1.0}, "none", ()),
    "one leads": ({"a": 40.0, "b": 20.0, "~x": 10.0}, "identified", ("a",)),
    "two alike": ({"a": 40.0, "b": 40.0, "c": 5.0}, "ambiguous", {"a", "b"}),
    "three alike": ({"a": 40.0, "b": 40.0, "c": 39.5}, "ambiguous", {"a", "b", "c"}),
    "two at once": ({"a": 40.0, "b": 20.0, ("a", "b"): 90.0}, "two effects", {"a", "b"}),
    "a second of no use": ({"a": 40.0, ("a", "b"): 41.0}, "identified", ("a",)),
    "free drift leads": ({"a": 40.0, "~x": 70.0}, "unexplained", ()),
    "free drift alone": ({"~x": 70.0, "~y": 60.0}, "unexplained", ()),
    "two drift": ({"a": 10.0, ("~x", "~y"): 70.0}, "unexplained", ()),
    "free drift near behind": ({"a": 40.0, "~x": 30.0}, "identified", ("a",)),
    "a little drift beside one": ({"a": 40.0, "~x": 20.0, ("a", "~x"): 60.0}, "identified", ("a",)),
    "mostly drift, with a name beside": ({"a": 20.0, "~x": 40.0, ("a", "~x"): 80.0}, "unexplained", ()),
    "two, and a little drift": ({"a": 40.0, ("a", "b"): 80.0, ("a", "~x"): 90.0, ("a", "~x", "b"): 120.0}, "two effects", {"a", "b"}),
    "three": ({"a": 40.0, ("a", "b"): 80.0, ("a", "b", "c"): 140.0}, "two effects", {"a", "b", "c"}),
}


@pytest.mark.parametrize("case", CASES)
def test_words(case):
    gains, word, effects = CASES[case]
    v = decide(made(gains))
    assert v.word == word
    assert (set(v.effects) if isinstance(effects, set) else v.effects) == effects
    assert total(v) == pytest.approx(1.0, abs=1e-9)
    assert v.losses[min(v.losses, key=lambda k: v.losses[k])] == min(v.losses.values())
    assert v.reason
    likeliest = max(gains, key=lambda names: gains[names], default=None)
    likeliest = (likeliest,) if isinstance(likeliest, str) else likeliest
    assert v.told.names == (likeliest if word == "unexplained" else v.accepted.names)  # without what drifts the drawing would be said to be off


def test_a_name_beside_which_something_drifts_is_as_probable_as_it_is_told():
    """Most of what is gained is the name's own: what it and a little drift have together is told as its
    probability, and errors are told with both. Where drift is most of it, that is something unknown."""
    little, mostly = (decide(made(CASES[case][0])) for case in ("a little drift beside one", "mostly drift, with a name beside"))
    assert little.candidates[0].names == ("a",)
    assert little.candidates[0].probability > 0.95
    assert little.probability_unknown < 0.01
    assert little.accepted.names == ("a", "~x")
    assert "all else together has a probability of 0.0%; beside it ~x drifts a little" in little.reason
    assert mostly.probability_unknown > 0.95
    assert max(c.probability for c in mostly.candidates) < 0.01


@pytest.mark.parametrize(("gain", "beside", "word"), [(100.0, 0.1, "unexplained"), (100.0, 0.05, "unexplained"), (100.0, 0.01, "identified"), (8.0, 0.01, "unexplained")])
def test_a_resonance_that_moves_without_effects_alone_stands_in_for_one(gain, beside, word, monkeypatch):
    """A light resonance gained 300 without effects, and moved there by a tenth with temperature. Where it moves most of the way beside an effect that gains
    100 more, that is what is unknown; where it does not, the effect is what moved (blind campaign 3344). Not one that gains next to nothing."""
    found = replace(made({"a": gain}), by_resonances=300.0)
    resonance = SimpleNamespace(frequency=500.0, drift=(0.1, 0.0), frequency_at=lambda far: 500.0 + 10 * far)
    monkeypatch.setattr(verdict, "moving", lambda model, h, discount: [resonance])
    monkeypatch.setattr(verdict, "travelled", lambda model, h: beside if h.mechanisms else 0.1)
    monkeypatch.setattr(reason, "moving", lambda model, h, *discount: [])
    assert decide(found).word == word


def test_a_false_alarm_costs_what_is_stated():
    """One effect against nothing: named from where MISSED P(something) exceeds FALSE_ALARM P(nothing), found by bisection."""
    low, high = 0.0, 30.0
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (low, middle) if decide(made({"a": middle})).word == "identified" else (middle, high)
    at = decide(made({"a": high}))
    assert (1 - at.probability_none) / at.probability_none == pytest.approx(FALSE_ALARM / MISSED, rel=1e-3)
    assert decide(made({"a": low - 0.01})).word == "none"


def test_a_wrong_name_costs_ten_times_a_set():
    """Two effects, nothing else possible: the first is named alone from where WRONG P(second) is less than the set's own cost, one."""
    words = {lead: decide(made({"a": 60.0 + lead, "b": 60.0})) for lead in np.arange(0.0, 5.0, 0.05)}
    for lead, v in words.items():
        rest = 1 / (1 + np.exp(lead))
        if abs(WRONG * rest - 1) > 0.05:
            assert v.word == ("ambiguous" if WRONG * rest > 1 else "identified"), lead
    assert {v.word for v in words.values()} == {"ambiguous", "identified"}


def test_an_effect_that_leads_is_not_something_else():
    """A name that is 83 % probable beside 17 % of something unknown: wrong in one case of six, at
    ten, against an answer that is wrong in five of six."""
    v = decide(made({"a": 40.1, "~x": 40.0}))
    assert 0.8 < v.candidates[0].probability < 0.9
    assert v.losses["unexplained"] == pytest.approx(6 * v.candidates[0].probability)
    assert (v.word, v.effects) == ("identified", ("a",))


@pytest.mark.parametrize("count", [2, 7, 10])
def test_a_set_is_as_large_as_its_probability_asks(count):
    v = decide(made({f"e{k}": 40.0 for k in range(count)}))
    assert v.word == "ambiguous"
    assert sum(c.probability for c in v.candidates if set(c.names) <= set(v.effects)) > 0.95


def test_a_set_has_what_its_names_have_with_a_little_drift_beside_them():
    """Two names that do as well, the likelier with a little drift beside it: the sentence tells of both what is told of each."""
    v = decide(made({"a": 58.0, "b": 58.5, "~x": 20.0, ("a", "~x"): 64.0, ("b", "~x"): 63.0}))
    assert (v.word, set(v.effects)) == ("ambiguous", {"a", "b"})
    share = sum(c.probability for c in v.candidates if set(c.names) <= {"a", "b"})
    assert share > 0.95
    assert f"(together {share:.0%} probable)" in v.reason


def test_an_answer_costs_by_the_part_that_it_leaves_unsaid():
    """Two names that do as well, each with a little drift beside it and hardly without: to say that
    something unknown drifts leaves the larger part unsaid, a set of the names the smaller."""
    v = decide(made({"a": 90.0, "b": 90.0, "~x": 20.0, ("a", "~x"): 110.0, ("b", "~x"): 110.0}))
    assert (v.word, set(v.effects)) == ("ambiguous", {"a", "b"})
    assert v.losses["unexplained"] == pytest.approx(HALF, rel=1e-3)
    assert v.losses["one of a, b"] == pytest.approx(SET + SET / 2, rel=1e-3)
    mostly = decide(made(CASES["mostly drift, with a name beside"][0]))
    assert mostly.losses["unexplained"] == pytest.approx(SET, rel=1e-3)
    assert mostly.losses["a"] == pytest.approx(HALF, rel=1e-3)


def test_a_set_holds_only_what_is_probable():
    """One effect alone, with another, or with something that drifts: the set is those two, not what
    the rest of the catalogue reaches far behind."""
    v = decide(made({("left", "right"): 58.0, "left": 53.5, ("left", "~drift"): 56.0, "behind": 5.0, "far": -40.0}))
    assert 0.5 < max(c.probability for c in v.candidates) < 0.95
    assert (v.word, set(v.effects)) == ("ambiguous", {"left", "right"})
    more = next(c.probability for c in v.candidates if c.names == ("left", "right")) / sum(c.probability for c in v.candidates[:2])
    assert v.reason.startswith("left is in all that explains the data (together ")
    assert 0.05 < more < 0.95
    assert "right acts beside it, and which, if any, cannot be told" in v.reason


@pytest.mark.parametrize(("leaves", "word"), [(46.0, "unexplained"), (21.0, "unexplained"), (4.0, "identified"), (1.0, "identified")])
def test_what_leaves_most_of_the_misfit_is_no_explanation(leaves, word):
    """Of a misfit of fifty squares of the errors a number, whatever the lead in evidence."""
    found = made({"a": 2300.0, "b": 100.0})
    left = {(): 50.0, ("a",): leaves, ("b",): 49.0}
    wrong = tuple(replace(h, fit=replace(h.fit, chi2=h.fit.count * left[h.names])) for h in found.hypotheses)
    v = decide(replace(found, hypotheses=wrong, base=wrong[-1]))
    assert v.word == word
    assert total(v) == pytest.approx(1.0)
    assert ("the best leaves" in v.reason) == (word == "unexplained")


@pytest.mark.parametrize(("leaves", "drifts"), [(45.0, False), (30.0, False), (3.0, True)])
def test_drift_that_misses_the_data_grossly_is_not_told_as_what_explains_them(leaves, drifts):
    """More than five times the errors are left with the best of all that drifts: it is not what would have to."""
    found = made({"~x": 2300.0, "a": 100.0})
    left = {(): 50.0, ("~x",): leaves, ("a",): 49.0}
    wrong = tuple(replace(h, fit=replace(h.fit, chi2=h.fit.count * left[h.names])) for h in found.hypotheses)
    v = decide(replace(found, hypotheses=wrong, base=wrong[-1]))
    assert v.word == "unexplained"
    assert total(v) == pytest.approx(1.0)
    assert ("~x would have to drift" in v.reason, "the best leaves" in v.reason) == (drifts, not drifts)


@pytest.mark.parametrize(
    ("sizes", "said"), [((2.22, 2.21), "~x would have to differ from the drawing, by as much in every test (150"), ((2.22, 2.0), "~x would have to drift (150"), ((0.01, 0.01), "~x would have to drift")]
)
def test_what_is_as_much_in_every_test_does_not_drift(sizes, said):
    """Another's dashpot beside the plate was told as damping that would have to drift, by +2.2272 in all eight tests."""
    found = made({"~x": 100.0})
    x, *rest = found.hypotheses
    x = replace(x, evidence=replace(x.evidence, sizes=np.array([sizes]), size_covariance=1e-4 * np.eye(2)[None], as_shaped=1e-4 * np.eye(2)[None]))
    v = decide(replace(found, hypotheses=(x, *rest)))
    assert v.word == "unexplained"
    assert said in v.reason


@pytest.mark.parametrize(("chi2", "word"), [(30.0, "unexplained"), (3.0, "none")])
def test_data_that_are_missed_grossly_are_not_nothing_missing(chi2, word):
    """More than five times the errors, and nothing tried gains anything: no probability is left for
    *none*, and the sentence says where to look."""
    found = made({"a": -3.0, "~x": -4.0})
    none = found.base
    grossly = replace(none, evidence=replace(none.evidence, chi2=chi2 * none.fit.count))
    v = decide(replace(found, base=grossly, hypotheses=tuple(grossly if h is none else h for h in found.hypotheses)))
    assert (v.word, v.probability_none == 0.0) == (word, word == "unexplained")
    assert total(v) == pytest.approx(1.0)
    assert ("units, points" in v.reason) == (word == "unexplained")


@pytest.mark.parametrize(("mass", "word"), [(-45.0, "unexplained"), (-10.0, "none")])
def test_what_nothing_is_built_as_is_not_nothing_missing(mass, word, monkeypatch):
    """A rotor that turned the other way was *none*: its tolerances had gone to a tenth of the mass
    and the stiffness of the shaft, with chi2 of 1.01 a number and 39 standard errors left out."""
    found = made({"a": -3.0, "~x": -4.0})
    model = SimpleNamespace(parameters=(Nuisance(BUILD, "spindle mass", 0.02), Nuisance(BUILD, "preload", 0.05)))
    off = reason.unbuilt(model, SimpleNamespace(evidence=SimpleNamespace(mean=np.array([mass, 1.0]))))
    assert off == ([("spindle mass", -0.9)] if word == "unexplained" else [])
    for module in (reason, verdict):
        monkeypatch.setattr(module, "unbuilt", lambda *_: off)
    v = decide(found)
    assert (v.word, v.probability_none == 0.0) == (word, word == "unexplained")
    assert ("with spindle mass by -90%, but nothing is built so: the sense of rotation, units" in v.reason) == (word == "unexplained")


@pytest.mark.parametrize(("pair", "word"), [(26.0, "ambiguous"), (34.0, "two effects")])
def test_a_second_name_must_be_as_sure_as_a_first(pair, word):
    """Four to one for two effects over one of them: the second would be a wrong name once in five, and both are told as a set."""
    v = decide(made({("a", "b"): pair, "a": 20.5}))
    assert (v.word, set(v.effects)) == (word, {"a", "b"})
    assert (v.candidates[0].probability < 0.9) == (word == "ambiguous")


@pytest.mark.parametrize(("leaves", "tests", "word"), [(5.0, 2, "unexplained"), (5.0, 1, "none"), (1.6, 2, "none"), (1.0, 2, "none")])
def test_what_changes_beyond_noise_is_not_nothing_missing(leaves, tests, word):
    """And not the same in every test: in one test alone it may be constant, and a little of it may be chance."""
    found = made({"a": -3.0, "~x": -4.0})
    model = SimpleNamespace(**vars(found.model) | {"tests": found.model.tests[:tests]})
    wrong = tuple(replace(h, fit=replace(h.fit, chi2=leaves * h.fit.count, by_test=h.fit.by_test[:tests])) for h in found.hypotheses)
    v = decide(replace(found, model=model, hypotheses=wrong, base=next(h for h in wrong if not h.mechanisms)))
    assert (v.word, v.probability_none == 0.0) == (word, word == "unexplained")
    assert ("the best leaves" in v.reason) == (word == "unexplained")


def test_a_drawing_that_is_off_is_said():
    """With the tolerances that are off by more than twice what is stated, the largest first;
    nothing is told as less than a tenth of itself, as nothing is built so."""
    found = made({"a": 60.0})
    parameters = tuple(Nuisance(BUILD, name, 0.02) for name in ("mass", "preload", "mount", "hub"))
    lead = found.hypotheses[0]
    mean = np.array([0.5, -6.0, 2.5, -52.5, *lead.evidence.mean])

    def told(times: float, **parts: float) -> str:
        learned = replace(lead.evidence.learned, sizes={BUILD: times, **parts})
        h = replace(lead, evidence=replace(lead.evidence, learned=learned, mean=mean))
        model = SimpleNamespace(**vars(found.model) | {"parameters": parameters})
        return reason.of_tolerances(model, h)

    assert told(1.0) == ""
    assert told(4.0) == " The drawing is off by more than its tolerances, which are taken 4 times as wide as stated: hub by -90%, preload by -12%, mount by +5%."
    assert told(1.0, preload=16.0, mount=1.0) == " The drawing is off by more than its tolerances: preload by -12%."


def test_thermal_motions_that_are_off_are_said():
    """Of those that are known less well than two programs differ by, what is off by more than these and more than its error."""
    lead, parameters = made({"a": 60.0}).hypotheses[0], tuple(Nuisance(EXPANSION, name, sd) for name, sd in EXPANSION_SD.items())

    def told(times: float, mean: tuple[float, ...]) -> str:
        evidence = replace(lead.evidence, learned=replace(lead.evidence.learned, sizes={EXPANSION: times}), mean=np.array(mean), covariance=np.diag([0.01, 9.0, 0.01]))
        return reason.of_motions(SimpleNamespace(parameters=parameters), replace(lead, evidence=evidence))

    assert told(1.0, (6.0, 0.0, 0.0)) == told(3.0, (1.0, 2.9, 0.0)) == ""
    assert told(3.0, (6.0, -4.0, 1.0)) == (
        " Thermal motions differ from what temperature and the scene's coefficients of expansion give: radial motion of the rings +1.8 +- 0.03 %, axial motion of the rings -1.2 +- 0.9 %."
    )


def test_what_other_programs_do_otherwise_is_said():
    """Where the data have it, by more than three of its errors."""
    lead = made({"a": 60.0}).hypotheses[0]
    parameters = (Nuisance(LAW, "law of the damping of loss factors", 1.0, index=0), Nuisance(LAW, "law of the damping of dampers", 1.0, index=1), Nuisance(ORBITS, ORBITS, 1.0))

    def told(mean: tuple[float, ...]) -> str:
        evidence = replace(lead.evidence, mean=np.array(mean), covariance=np.diag([4e-4, 0.01, 0.04]))
        return reason.of_conventions(SimpleNamespace(parameters=parameters), replace(lead, evidence=evidence))

    assert told((0.05, -1.0, 0.5)) == ""
    assert told((0.98, 0.2, 1.1)) == (
        " Taken into account: loss factors act as hysteretic damping (a complex stiffness, the same loss at all frequencies), where the model has viscous dampers (0.98 +- 0.02 of the way from one to the other); "
        "every ball orbits at its own speed, where the model has one cage speed for a row (1.10 +- 0.2 of the way from one to the other)."
    )


@pytest.mark.parametrize(("misses", "confirmed"), [(30.0, True), (80.0, False)])
def test_what_conditions_left_out_do_not_confirm_is_said(misses, confirmed):
    """By their probability density: of what leaves them less than nothing does, in squares of the errors, and of what leaves more."""
    found = made({"a": 60.0})
    lead = found.hypotheses[0]
    missed = tuple((misses, *of_test[1:]) for of_test in lead.fit.by_test)
    v = decide(replace(found, hypotheses=(replace(lead, fit=replace(lead.fit, by_test=missed)), found.base)))
    assert v.word == "identified"
    assert v.held_out_gain == pytest.approx(50.0 - misses)
    assert ("which does not confirm it" in v.reason) != confirmed


def test_errors_are_told_of_all_that_is_named():
    """Of two effects that are named for what they reach beside something that drifts, and not of
    the one which alone reaches nearly as much."""
    v = decide(made({"a": 40.0, ("a", "b"): 41.0, ("a", "b", "~x"): 62.0}))
    assert (v.word, set(v.effects)) == ("two effects", {"a", "b"})
    assert set(v.accepted.names) >= {"a", "b"}


@pytest.mark.parametrize(("sizes", "by"), [
    ({STIFFNESS_DRIFT: 3e-4, DAMPING_DRIFT: 0.0}, "by 0.0003 of its frequency,"),
    ({STIFFNESS_DRIFT: 0.0, DAMPING_DRIFT: 0.03}, "by 0.03 of its damping,"),
    ({STIFFNESS_DRIFT: 1e-3, DAMPING_DRIFT: 0.03}, "by 0.001 of its frequency and by 0.03 of its damping,"),
])  # fmt: skip
def test_modes_that_drift_are_said_to_by_what_they_do(sizes, by):
    found = made({"a": -5.0})
    drifting = tuple(replace(h, evidence=replace(h.evidence, learned=replace(h.evidence.learned, sizes=sizes))) for h in found.hypotheses)
    v = decide(replace(found, hypotheses=drifting, base=drifting[0]))
    assert v.word == "unexplained"
    assert by in v.reason


def test_the_order_of_hypotheses_does_not_matter():
    search = made({"a": 12.0, "b": 11.0, "~x": 9.0, ("a", "c"): 10.0})
    turned = replace(search, hypotheses=search.hypotheses[::-1])
    first, second = decide(search), decide(turned)
    assert (first.word, first.effects) == (second.word, second.effects)
    assert first.losses == pytest.approx(second.losses)


def test_conditions_within_the_thermometers_scatter_are_one():
    search = made({})
    at = (20.0, 20.4, 60.0, 20.1, 59.5)
    tests = tuple(SimpleNamespace(condition=Condition(t), count=1) for t in at)
    assert [sorted(g) for g in conditions_of(search.model.spindle, tests)] == [[0, 1, 3], [2, 4]]
    chain = tuple(SimpleNamespace(condition=Condition(20 + 0.55 * k)) for k in range(6))  # each near the next, the last far from the first
    assert conditions_of(search.model.spindle, chain) == [[0, 1], [2, 3], [4, 5]]
    running = tuple(SimpleNamespace(condition=Condition(20.0, speed)) for speed in (0.0, 300.0, 0.0, 700.0))
    assert conditions_of(search.model.spindle, running) == [[0, 2], [1], [3]]
