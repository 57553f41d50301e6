"""What was predicted before a test was made, beside what it then showed."""

import json

import numpy as np
import pytest

from tests.diagnosis.hidden_modes import hidden
from thermospindle.diagnosis.data.observe import Observation
from thermospindle.diagnosis.prediction.outcomes import outcomes
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.sim.campaign.campaign import Test
from thermospindle.sim.effects import by_name
from thermospindle.sim.operating import operating_point


def told(tmp_path, predicted):
    """Verdicts by explanation, of an earlier diagnosis that `predicted` modes at 60 C and rest."""
    file = tmp_path / "diagnosis.json"
    file.write_text(json.dumps({"next_test": [{"condition": {"temperature_C": 60.0, "speed_rpm": 0.0}, "predicted": predicted}]}))
    return lambda data: {o.explanation: o.verdict for o in outcomes(file, data)}


def modes_at_60(spindle, effects=()):
    return [m for m in operating_point(spindle, Condition(60.0), effects).modes if 400 < m.frequency < 6000]


def test_predictions_are_confirmed_or_refuted(spindle, tmp_path):
    """Two explanations write down what a test will show; the one that made the data is confirmed, the other refuted. In the form that
    diagnose writes now, without errors of damping."""
    loss = by_name("preload_loss")
    effects = [(loss, {"loss": 0.4, "thermal_share": 0.0})]
    said = told(tmp_path, {
        name: [{"frequency_Hz": m.frequency, "sd_Hz": 0.01 * m.frequency} for m in modes_at_60(spindle, own)]
        for name, own in (("loss", effects), ("plain", ()))
    })  # fmt: skip
    assert said(hidden(spindle, effects, 1)) == {"loss": "confirmed", "plain": "refuted"}


def test_damping_alone_refutes(spindle, tmp_path):
    """As older diagnoses wrote predictions, with the damping ratio and its error."""
    predicted = {
        name: [
            {"frequency_Hz": m.frequency, "sd_Hz": 0.03 * m.frequency, "damping": factor * m.damping_ratio, "damping_sd": 0.5 * m.damping_ratio}
            for m in modes_at_60(spindle)
        ]
        for name, factor in (("as it is", 1.0), ("four times as damped", 4.0))
    }
    said = told(tmp_path, predicted)
    assert said(hidden(spindle, [], 21)) == {"as it is": "confirmed", "four times as damped": "refuted"}


def test_a_true_explanation_is_doubted_once_in_a_hundred(tmp_path):
    """Errors drawn as they are stated: 2 % of true explanations were refuted, which chance does once in a million, and 9 % doubtful."""
    random, at = np.random.default_rng(0), np.linspace(1000.0, 5000.0, 9)
    common = random.standard_normal((9, 2))
    rows = [{"frequency_Hz": f, "sd_Hz": float(np.sqrt(0.01 + c @ c)), "common_Hz": list(c)} for f, c in zip(at, common, strict=True)]
    said, words = told(tmp_path, {"true": rows}), []
    for _ in range(600):
        seen = at + common @ random.standard_normal(2) + 0.1 * random.standard_normal(9)
        covariance = np.diag([*np.full(9, 1e-12), *np.full(9, np.inf)])
        words.append(said([Observation(Test("t", 60.0, 0.0), Condition(60.0), seen, np.full(9, np.nan), covariance, *[None] * 5)])["true"])
    assert "refuted" not in words
    assert 0 < words.count("doubtful") < 15


@pytest.mark.parametrize(("planned", "level", "soak", "judged"), [({}, 0.0, np.inf, 1), ({}, 50.0, np.inf, 0), ({}, 0.0, 60.0, 0),
    ({"level_N": 50.0, "soak_time_min": 1.0}, 50.0, 60.0, 1), ({"level_N": 50.0, "soak_time_min": 1.0}, 50.0, 120.0, 0)])  # fmt: skip
def test_a_test_is_judged_by_what_was_planned_like_it(planned, level, soak, judged, tmp_path):
    file = tmp_path / "diagnosis.json"
    rows = {"one": [{"frequency_Hz": 900.0, "sd_Hz": 1.0}]}
    file.write_text(json.dumps({"next_test": [{"condition": {"temperature_C": 60.0, "speed_rpm": 0.0, **planned}, "predicted": rows}]}))
    seen = Observation(Test("t", 60.0, 0.0), Condition(60.0, 0.0, level, soak), np.array([900.0]), np.full(1, 0.01), 1e-6 * np.eye(2), *[None] * 5)
    assert len(outcomes(file, [seen])) == judged


def test_a_test_in_which_no_mode_was_found_confirms_nothing(tmp_path):
    """It confirmed whatever was predicted, with an error of no number."""
    said = told(tmp_path, {"one": [{"frequency_Hz": 900.0, "sd_Hz": 1.0}]})
    assert said([Observation(Test("t", 60.0, 0.0), Condition(60.0), np.zeros(0), np.zeros(0), np.zeros((0, 0)), *[None] * 5)]) == {}


def test_another_file_is_refused(tmp_path):
    file = tmp_path / "other.json"
    file.write_text("{}")
    with pytest.raises(BadInput, match=r"--predictions .*other.json: is not an answer of spindle diagnose"):
        outcomes(file, [])
    with pytest.raises(BadInput, match="cannot be read"):
        outcomes(tmp_path / "absent.json", [])


@pytest.mark.parametrize(
    "text",
    [
        '{"next_test": [{"condition": {"temperature_C": 20, "speed_rpm": 0}, "predicted": {"a": []}}]}',
        '{"next_test": [{"condition": {"temperature_C": 20, "speed_rpm": 0}, "predicted": {"a": [[1, 2]]}}]}',
        '{"next_test": [{"condition": {"temperature_C": 1HUGE, "speed_rpm": 0}, "predicted": {"a": []}}]}',
        '{"next_test": [{"condition": {"temperature_C": 20, "speed_rpm": 0}, "predicted": {"a": [{"frequency_Hz": 1HUGE, "sd_Hz": 1}]}}]}',
        '{"next_test": [{"condition": {"temperature_C": 20, "speed_rpm": 0}, "predicted": {"a": [{"frequency_Hz": 0, "sd_Hz": 1}]}}]}',
        '{"next_test": [{"condition": {"temperature_C": 20, "speed_rpm": 0}, "predicted": {"a": [{"frequency_Hz": NaN, "sd_Hz": 1}]}}]}',
        '{"next_test": [{"condition": {"temperature_C": 20, "speed_rpm": 0}, "predicted": {"a": [{"frequency_Hz": 900, "sd_Hz": -1}]}}]}',
        '{"next_test": [{"condition": {"temperature_C": 20, "speed_rpm": 0}, "predicted": {"a": {"b": 1}}}]}',
        '{"next_test": [{"condition": {"temperature_C": 20, "speed_rpm": 0}, "predicted": {"a": [{"frequency_Hz": 9, "sd_Hz": 1, "common_Hz": [2]}]}}]}',
        '{"next_test": [{"condition": {"temperature_C": 20, "speed_rpm": 0}, "predicted": {"a": [{"frequency_Hz": 9, "sd_Hz": 1, "common_Hz": 1}]}}]}',
        '{"next_test": 3}',
        "[" * 100_000,
    ],
)
def test_predictions_that_are_no_numbers_are_refused(text, tmp_path):
    """Each was a traceback: IndexError, OverflowError, ZeroDivisionError, RecursionError."""
    file = tmp_path / "other.json"
    file.write_text(text.replace("HUGE", 400 * "0"))
    m = np.array([900.0, 1500.0])
    seen = Observation(Test("T20_n0", 20.0, 0.0), Condition(20.0), m, np.full(2, 0.01), np.diag(np.full(4, 1e-6)), *[None] * 5)
    with pytest.raises(BadInput, match="is not an answer of spindle diagnose"):
        outcomes(file, [seen])
