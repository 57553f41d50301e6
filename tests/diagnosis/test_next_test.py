"""The test that decides: where two explanations differ, by how much, and whether what was written down comes true."""

import json
import re

import numpy as np
import pytest

from diagnosis.explain import explain
from diagnosis.locate import free_form, locate
from diagnosis.misfit import misfit
from diagnosis.next_test import Explanation, next_tests, plans
from diagnosis.prediction import outcomes
from diagnosis.verdict import diagnosis_json
from model.machine import Condition
from model.scene import BadInput
from sim.effects import by_name
from sim.operating import operating_point
from tests.diagnosis.test_explain import hidden, theory_of


def known(about, name, effects, certain=1e-6):
    """An explanation whose nuisance parameters are known."""
    return Explanation(name, effects, np.zeros(len(about.sd)), certain**2 * np.diag(about.sd**2))


@pytest.fixture(scope="module")
def about(spindle):
    return theory_of(spindle, hidden(spindle, [], 21))


def test_speed_separates_what_only_shows_when_turning(spindle, about):
    """Half the ball inertia acts at speed alone: the test proposed turns as fast as any."""
    ball = by_name("ball_inertia")
    best = next_tests(about, [known(about, "without", []), known(about, "inertia", [(ball, ball.typical())])])[0]
    assert best.plan.condition.speed == pytest.approx(12000 * np.pi / 30)
    assert set(best.separates) == {"without", "inertia"}


def test_a_long_soak_tells_a_lagging_hub_from_one_that_expands_less(spindle, about):
    """At rest and at any temperature the two do nearly the same; a hub that has had its time does not lag any more."""
    lag, less = by_name("soak_lag"), by_name("expansion_mismatch")
    of_lag = known(about, "lag", [(lag, lag.typical() | {"hub_share": 0.2})], 1.0)
    of_less = known(about, "less", [(less, less.typical() | {"hub_expansion": -0.2})], 1.0)
    best = next_tests(about, [of_lag, of_less, known(about, "free: hub mass", [])])
    assert set(best[0].separates) == {"lag", "less"}
    assert best[0].plan.condition.soak_time == 4 * 3600


def test_odds_grow_with_the_difference_and_fall_with_ignorance(spindle, about):
    loss = by_name("preload_loss")

    def odds(size, certain):
        pair = [known(about, "a", [], certain), known(about, "b", [(loss, {"loss": size, "thermal_share": 0.0})], certain)]
        return next_tests(about, pair)[0]

    small, large = odds(0.001, 1e-6), odds(0.002, 1e-6)
    assert np.log(large.odds) == pytest.approx(4 * np.log(small.odds), rel=0.1)  # a difference twice as large, squared
    assert np.log(odds(0.001, 1.0).odds) < 0.5 * np.log(small.odds)
    assert small.repeats >= large.repeats >= 1


def test_a_mass_and_a_point_are_among_the_plans(spindle):
    made = list(plans(spindle, [Condition(20.0), Condition(60.0)]))
    assert any(p.mass > 0 and p.on == "hub" for p in made)
    assert any(p.point is not None for p in made)
    assert any(p.condition.level > 0 for p in made)


def test_free_form_does_what_the_change_says(spindle):
    """The bearing's radial stiffness follows the change between the conditions it was found at."""
    loss = by_name("preload_loss")
    about = theory_of(spindle, hidden(spindle, [(loss, {"loss": 0.25, "thermal_share": 1.0})], 6))
    change = next(c for c in locate(about, most=20) if c.element == "lower bearing radial stiffness")
    at = dict(zip(change.conditions, change.change, strict=True))
    point = operating_point(spindle, Condition(40.0), free_form(spindle, change))
    plain = operating_point(spindle, Condition(40.0), [])
    resting = [at[20.0, 0.0], at[60.0, 0.0]]
    ratio = point.state.bearing("lower").radial_stiffness / plain.state.bearing("lower").radial_stiffness
    assert ratio == pytest.approx(1 + np.mean(resting), rel=1e-9)


def test_predictions_are_confirmed_or_refuted(spindle, tmp_path):
    """Two explanations write down what a test will show; the one that made the data is confirmed, the other refuted."""
    lag = by_name("soak_lag")
    data = hidden(spindle, [(lag, lag.typical() | {"hub_share": 0.2})], 1)
    about = theory_of(spindle, data)
    found = explain(about, (lag, by_name("plate_prestress")), workers=1)
    fitted = Explanation("lag", [(lag, found.best.fit.values["soak_lag"])], found.best.fit.nuisance, np.diag((0.1 * about.sd) ** 2))
    plain = Explanation("plain", [], found.best.fit.nuisance, np.diag((0.1 * about.sd) ** 2))
    test = next_tests(about, [fitted, plain])[0]
    answer = diagnosis_json(found, about, [], [test], misfit(about, found.base))
    answer["next_test"][0]["condition"] = {"temperature_C": 60.0, "speed_rpm": 0.0}
    there = about.data.observations[2].condition
    for e in (fitted, plain):  # what each would have written down for a test that was made
        f = operating_frequencies(about, e, there)
        answer["next_test"][0]["predicted"][e.name] = [{"frequency_Hz": float(v), "sd_Hz": 0.002 * float(v)} for v in f]
    file = tmp_path / "diagnosis.json"
    file.write_text(json.dumps(answer))
    said = {o.explanation: o.verdict for o in outcomes(file, data)}
    assert said == {"lag": "confirmed", "plain": "refuted"}


def test_what_only_damping_tells_is_said_and_predicted(spindle, about, tmp_path):
    """A grease that damps more moves no frequency: the test is told by a damping ratio, and a prediction is refuted by damping alone."""
    grease = by_name("grease_damping")
    best = next_tests(about, [known(about, "without", []), known(about, "grease", [(grease, {"viscous_share": 0.5})])])[0]
    assert re.fullmatch(r"the damping of mode \d+, [+-][\d.e+]+ \+- [\d.e+-]+ % by grease", best.tells)
    without, thick = best.predictions
    assert [m.frequency for m in thick] == pytest.approx([m.frequency for m in without], rel=1e-3)
    answer = {"condition": {"temperature_C": 60.0, "speed_rpm": 0.0}, "predicted": {}}
    point = operating_point(spindle, Condition(60.0), [])
    inside = [m for m in point.modes if 400 < m.frequency < 3000]
    for name, factor in (("as it is", 1.0), ("four times as damped", 4.0)):
        rows = [
            {"frequency_Hz": m.frequency, "sd_Hz": 20.0, "damping": factor * m.damping_ratio, "damping_sd": 0.3 * m.damping_ratio}
            for m in inside
        ]
        answer["predicted"][name] = rows
    file = tmp_path / "diagnosis.json"
    file.write_text(json.dumps({"next_test": [answer]}))
    said = {o.explanation: o.verdict for o in outcomes(file, about.data.observations)}
    assert said == {"as it is": "confirmed", "four times as damped": "refuted"}


def operating_frequencies(about, explanation, condition):
    point = operating_point(about.built(explanation.nuisance), condition, explanation.applied)
    return [m.frequency for m in point.modes if 400 < m.frequency < 3000]


def test_another_file_is_refused(tmp_path):
    file = tmp_path / "other.json"
    file.write_text("{}")
    with pytest.raises(BadInput, match=r"--predictions .*other.json: is not an answer of spindle diagnose"):
        outcomes(file, [])
    with pytest.raises(BadInput, match="cannot be read"):
        outcomes(tmp_path / "absent.json", [])
