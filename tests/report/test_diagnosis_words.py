"""What a diagnosis says in words: on the terminal, in few lines, and beside a name."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from tests.conftest import SCENE
from thermospindle.cli import main
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.diagnosis.parameters.nuisance import Nuisance
from thermospindle.diagnosis.verdict import Drift
from thermospindle.model.built.tolerance import toleranced
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import content_hash, load
from thermospindle.report.page.diagnosis import sections
from thermospindle.report.text.diagnosis.answer import diagnosis_json, in_scene
from thermospindle.report.text.diagnosis.doubts import doubt_words
from thermospindle.report.text.diagnosis.granted import granted_words
from thermospindle.report.text.diagnosis.words import _drift_words, show_diagnosis, value_words, would_change
from thermospindle.sim.effects import of_scene


def test_what_speaks_against_a_name_is_said_beside_it(told, capsys):
    """A bond was identified of which left-out tests were missed by 50.6 standard errors instead of
    39.4, at -32 nm/N in one test, and no word told the reader to doubt."""
    found, answer = told
    v = found.verdict
    [best] = v.candidates
    limits = best.hypothesis.mechanisms[0].size.limits
    own = best.hypothesis.evidence
    tests = [t.test.id for t in found.search.model.tests]

    def seen(after, sizes):
        evidence = replace(own, sizes=(np.array(sizes),), size_covariance=(0.01 * np.eye(len(sizes)),))
        verdict = replace(v, candidates=(replace(best, hypothesis=replace(best.hypothesis, evidence=evidence)),), held_out_before=39.4, held_out_after=after)
        return doubt_words(replace(found, verdict=verdict))

    inside = [0.0, 0.1, limits[0] - 0.15]
    assert seen(38.0, inside) == seen(39.5, inside) == seen(np.nan, inside) == []
    [against] = seen(50.6, inside)
    assert against == "Tests that are left out speak against soak_lag: predicted from all others they are missed by 50.6 standard errors with it, by 39.4 without."
    [beyond] = seen(38.0, [0.0, limits[0] - 0.5, 0.1])
    assert beyond == f"Of soak_lag the data ask for a hub_share that is not physical: {limits[0] - 0.5:.2f} +- 0.10 in {tests[1]}; possible is {limits[0]:g} to {limits[1]:g}."
    assert doubt_words(replace(found, verdict=replace(v, word="none", effects=(), held_out_before=1.0, held_out_after=2.0))) == []
    doubted = answer | {"doubts": [against, beyond]}
    show_diagnosis(Console(width=2000), doubted)
    printed = capsys.readouterr().out
    assert against in printed
    assert beyond in printed
    assert "speak against soak_lag" in dict(sections(found, doubted))["Verdict"]


def test_none_says_what_moved(nothing_missing, capsys):
    """A table of four modes was "none, chi2 0.00 a number" where `compare` said "does not agree,
    70.6 standard errors": errors of 0.3 % had been granted to every mode."""
    answer = diagnosis_json(nothing_missing)
    assert answer["verdict"] == "none"
    model, base = nothing_missing.search.model, nothing_missing.search.base
    sentence = answer["granted"]
    assert sentence.startswith(f"As drawn the scene misses these data by {answer['error']['drawn']:.1f} of their own standard errors")
    build = [(abs(x), f"{p.name} {100 * p.at(x):+.2g} % ({x:+.1f} s.d.)") for x, p in zip(base.evidence.mean, model.parameters, strict=False) if p.kind == "build"]
    assert max(build)[1] in sentence
    assert ("a constant error of computed frequencies" in sentence) == (answer["learned"]["frequency_discrepancy"] > 0)
    show_diagnosis(Console(width=2000), answer, verbose=False)
    assert sentence in capsys.readouterr().out
    assert granted_words(nothing_missing, 2.9) == ""
    assert granted_words(replace(nothing_missing, verdict=replace(nothing_missing.verdict, word="unexplained")), 70.0) == ""
    quiet = replace(base, evidence=replace(base.evidence, mean=0.01 * base.evidence.mean, learned=replace(base.evidence.learned, sizes={"stiffness discrepancy": 0.003})))
    words = granted_words(replace(nothing_missing, search=replace(nothing_missing.search, base=quiet)), 70.6)
    assert re.search(r"by 70\.6 of .* is a constant error of computed frequencies, granted to every model, most to the mode near [\d.]+ Hz, [+-][\d.e-]+ %; no tolerance moved by more", words)


def test_the_terminal_tells_drifts_only_where_something_is_missing(told, nothing_missing, capsys):
    console = Console(width=2000)
    show_diagnosis(console, told[1])
    text = capsys.readouterr().out
    assert text.index("Without any catalogue") < text.index(told[1]["misfit"]["words"][0])
    assert "with odds of more than a million to 1" in text
    show_diagnosis(console, diagnosis_json(nothing_missing))
    text = capsys.readouterr().out
    assert "Without any catalogue" not in text
    assert "Smallest size these data would have shown" in text


@pytest.mark.parametrize(("times", "said"), [(1.0, "none: No effect is missing."), (8.0, "none: No effect is needed, but the drawing is off by more than its tolerances")])
def test_a_drawing_that_is_far_off_is_no_confirmation(nothing_missing, capsys, times, said):
    """A table with a mode of the fixture among the spindle's was "No effect is missing", with a hub a fifth lighter than drawn."""
    answer = diagnosis_json(nothing_missing)
    show_diagnosis(Console(width=200), answer | {"learned": answer["learned"] | {"build_tolerances_times": times}}, verbose=False)
    assert capsys.readouterr().out.startswith(said)


@pytest.mark.parametrize(
    ("odds", "sentence"),
    [
        ({("a",): 0.5, ("a", "b"): 0.3, ("a", "c"): 0.2}, "Missing: a, and perhaps one more: b, c."),
        ({("a",): 0.5, ("b",): 0.3, ("a", "c"): 0.2}, "Missing is one of: a, b, c."),
    ],
)
def test_of_a_set_what_all_explanations_hold_is_missing(told, capsys, odds, sentence):
    rows = [told[1]["candidates"][0] | {"effects": list(names), "probability": p} for names, p in odds.items()]
    effects = ["a", "b", "c"]
    show_diagnosis(Console(width=200), told[1] | {"verdict": "ambiguous", "effects": effects, "candidates": rows}, verbose=False)
    assert capsys.readouterr().out.startswith(f"ambiguous: {sentence}")


def test_without_verbose_the_verdict_is_told_in_few_lines(told, nothing_missing, capsys):
    console = Console(width=80)
    for answer in (told[1], diagnosis_json(nothing_missing)):
        show_diagnosis(console, answer, verbose=False)
        text = capsys.readouterr().out
        assert text.startswith(f"{answer['verdict']}: ")
        assert len(text.splitlines()) < 20
        assert max(map(len, text.splitlines())) <= 80
        assert "--verbose" in text


def test_add_takes_what_it_fitted(told, spindle, tmp_path, capsys):
    """The answer as it is written, taken by `spindle add`: the effect's value and every build tolerance, none of tests or channels."""
    answer = told[1] | {"scene_hash": content_hash(spindle)}
    (tmp_path / "diagnosis.json").write_text(json.dumps(answer))
    arguments = ["add", str(SCENE), "soak_lag", "--from", str(tmp_path / "diagnosis.json"), "--out", str(tmp_path / "new"), "--json"]
    assert main(arguments) == 0
    capsys.readouterr()
    built = load(tmp_path / "new")
    fitted = answer["candidates"][0]["parameters"]["soak_lag.hub_share"]["value"]
    assert {e.name: v["hub_share"] for e, v in of_scene(built)} == {"soak_lag": pytest.approx(fitted, rel=1e-7)}
    names = {p.name for p in toleranced(spindle)}
    assert built.build.deviations == pytest.approx({n: answer["tolerances"][n]["in_scene"] for n in names}, rel=1e-7)
    assert set(built.build.deviations) == names
    assert built.build.tests == tuple(t.id for t in told[0].campaign.tests)


def test_a_scene_gets_the_tolerances_that_go_without_what_it_cannot_hold():
    """Of two that were fitted one against the other, the conditional mean where the one that no scene
    holds is nothing; a constant error of a mode, and a channel's gain, stay as they were fitted."""
    kinds = (kinds_of.BUILD, kinds_of.BALLS, kinds_of.STIFFNESS, kinds_of.GAIN)
    parameters = [Nuisance(kind, kind, 0.01) for kind in kinds]
    covariance = np.eye(5)
    covariance[0, 1] = covariance[1, 0] = -0.9
    covariance[0, 2] = covariance[2, 0] = 0.3
    evidence = SimpleNamespace(mean=np.array([1.0, -1.0, 2.0, 0.5, 3.0]), covariance=covariance)
    assert in_scene(parameters, evidence) == pytest.approx([0.1, 0.0, 2.0, 0.5])
    assert in_scene(parameters, SimpleNamespace(mean=evidence.mean, covariance=np.diag([1.0, 0.0, 1.0, 1.0, 1.0]))) == pytest.approx([1.0, -1.0, 2.0, 0.5])


def test_a_value_is_told_with_what_it_may_be_as_well():
    lower = {"value": 0.0, "sd": 0.0, "unit": "1", "called": "lower"}
    upper = {"value": 1.0, "probability": 0.28, "called": "upper"}
    assert value_words(lower) == "lower"
    assert value_words(lower | {"probability": 0.72, "others": [upper]}) == "lower (72.0%) or upper (28.0%)"
    channel = {"value": 3.0, "sd": 0.0, "unit": "1", "probability": 0.6, "others": [{"value": 4.0, "probability": 0.4}]}
    assert value_words(channel) == "3 (60.0%) or 4 (40.0%)"


def test_one_test_that_differs_from_all_others_is_told_by_itself():
    """A thermometer wrong by 8 K in one test of eight; with errors that all have in common, of which none of what tells them apart is made."""
    conditions = tuple(Condition(t) for t in (20.0, 30.0, 40.0, 50.0, 60.0))
    change, covariance = np.array([1.2, 1.35, 0.9, -6.75, 1.0]), 0.45 * np.ones((5, 5)) + 0.02 * np.eye(5)
    alone = Drift("thermometer_error", "K", conditions, change, covariance, None, 100.0, None, {})
    assert _drift_words(alone) == "thermometer_error: -6.75 +- 0.69 K at 50 C, 0 rpm alone, and +0.90 +- 0.69 to +1.35 +- 0.69 K in all other tests"
    step = replace(alone, change=np.array([1.2, 1.35, 0.9, -6.75, -6.5]))
    assert " to " in _drift_words(step)
    assert "alone" not in _drift_words(step)


@pytest.mark.parametrize(("names", "drafted"), [(("a light resonance",), False), (("preload", "flange stiffness"), True)])
def test_a_draft_is_of_what_the_verdict_says_drifts(names, drafted):
    verdict = SimpleNamespace(word="unexplained", free=[SimpleNamespace(names=names)])
    said = would_change(SimpleNamespace(verdict=verdict, drifts=[SimpleNamespace(element="preload")], tests=()))
    assert ("`spindle draft` writes one from the drift of preload" in said) == drafted


@pytest.mark.parametrize(("odds", "beyond", "words"), [(2.56, True, "odds of 2.56 to 1, beyond the temperatures that the scene states and the campaign had."), (5e3, False, "odds of 5000 to 1."), (1e6, False, "odds of more than a million to 1.")])
def test_a_test_that_hardly_decides_is_not_said_to_tell(odds, beyond, words):
    test = SimpleNamespace(condition=Condition(80.0), separates=("fixture_lag", "loose_inserts"), odds=odds, beyond=beyond)
    said = would_change(SimpleNamespace(verdict=SimpleNamespace(word="unexplained", free=()), drifts=(), tests=(test,)))
    assert f"would tell fixture_lag from loose_inserts with {words}" in said
