"""What the blind study counts: the outcome of a verdict where the truth is known, and the table of all."""

import re

import pytest
from rich.console import Console

from tests.blind.score import (
    above_noise,
    element_found,
    halved,
    interval,
    most_probable,
    no_wrong_name,
    outcome,
    restated,
    show,
    sure,
    told_elsewhere,
    truth_probability,
    visible,
)
from tests.blind.study import SCENES
from thermospindle.diagnosis.decision.explanations import ASTRAY, UNTRIED


def row(kind, verdict, effects=(), truth=(), none=0.0, unknown=0.0, candidates=(), drifts=(), elements=()):
    names = [{"effects": list(e), "probability": p, "delta_evidence": 10 * p, "chi2_per_number": 1.0} for e, p in candidates]
    return {
        "seed": 1, "commit": "x", "kind": kind, "scene": SCENES[0], "hidden": ["h"] * len(truth), "sizes": [1.0] * len(truth),
        "units": ["%"] * len(truth), "laws": ["linear"] * len(truth), "truth": [list(t) for t in truth], "elements": list(elements),
        "visibility": [100.0] * len(truth), "leakage": 0.0, "weighed": {"astray": ASTRAY}, "learned": {"frequency_discrepancy": 0.01}, "verdict": verdict, "effects": list(effects), "probability": {"none": none, "unknown": unknown},
        "candidates": names, "drifts": [list(d) for d in drifts], "rms": [1.0, 1.0], "seconds": 1.0, "error": "E",
        "world": {"stiffness_error": 0.001, "damping_error": 0.01, "grooves_follow_faces": 0.0, "weak_mode": None}, "record": {"kind": "line", "told": "nothing"},
    }  # fmt: skip


def unseen(row, *visibility):
    return row | {"visibility": list(visibility)}


SCORED = [
    (row("nothing", "none", none=0.97), "right", 0.97),
    (row("nothing", "identified", ["a"], none=0.01, candidates=[(["a"], 0.99)]), "false alarm", 0.01),
    (row("one", "identified", ["a"], [["a", "b"]], candidates=[(["a"], 0.7), (["b"], 0.2), (["c"], 0.1)]), "right", 0.9),
    (row("one", "ambiguous", ["a", "c"], [["a"]], candidates=[(["a"], 0.5), (["c"], 0.5)]), "in the set", 0.5),
    (row("one", "identified", ["c"], [["a"]], candidates=[(["c"], 1.0)]), "wrong", 0.0),
    (row("one", "two effects", ["a", "c"], [["a"]], candidates=[(["a", "c"], 1.0)]), "wrong", 0.0),
    (row("one", "unexplained", [], [["a"]], unknown=1.0), "unexplained", 0.0),
    (row("one", "none", [], [["a"]], none=1.0), "missed", 0.0),
    (row("two", "two effects", ["a", "c"], [["a"], ["c"]], candidates=[(["a", "c"], 0.9)]), "right", 0.9),
    (row("two", "identified", ["a"], [["a"], ["c"]], candidates=[(["a"], 0.9)]), "half", 0.0),
    (row("outside", "unexplained", [], [[]], unknown=0.8, drifts=[("plate damping", 9.0)], elements=["plate damping"]), "right", 0.8),
    (row("outside", "identified", ["a"], [[]], candidates=[(["a"], 0.9)], elements=["plate"]), "wrong", 0.0),
    (row("one", "error", [], [["a"]]), "error", 0.0),
    (unseen(row("one", "none", [], [["a"]], none=0.9, candidates=[(["a"], 0.05), (["c"], 0.05)]), 2.0), "right", 0.95),
    (unseen(row("one", "identified", ["c"], [["a"]], candidates=[(["c"], 1.0)]), 2.0), "wrong", 0.0),
    (
        unseen(row("two", "identified", ["a"], [["a"], ["c"]], candidates=[(["a"], 0.7), (["a", "c"], 0.1), (["c"], 0.2)]), 90.0, 2.0),
        "right",
        0.8,
    ),
    (unseen(row("two", "identified", ["c"], [["a"], ["c"]], candidates=[(["c"], 0.9)]), 90.0, 2.0), "half", 0.0),
    (row("two", "identified", ["a"], [["a"], ["a", "c"]], candidates=[(["a"], 0.9)]), "right", 0.0),
    (row("one", "identified", ["c"], [["a"]], candidates=[(["c"], 0.9)]) | {"right": [["c"]]}, "right", 0.9),
    (row("one", "identified", ["a"], [["a"]], candidates=[(["a"], 0.9)]) | {"right": [["c"]]}, "wrong", 0.0),
    (row("one", "unexplained", [], [["a"]], unknown=0.9) | {"right": [[]]}, "right", 0.9),
    (row("outside", "identified", ["c"], [[]], candidates=[(["c"], 0.5)], unknown=0.4) | {"right": [["c"]]}, "right", 0.9),
]


@pytest.mark.parametrize(("told", "expected", "probability"), SCORED)
def test_the_score_of_a_verdict(told, expected, probability):
    assert outcome(told) == expected
    assert truth_probability(told) == pytest.approx(probability)


def test_what_was_stated_for_sure_is_judged_by_name_and_as_a_whole():
    """One of two named for sure: no name is wrong, and one that shows is missing; nothing of what is not sure, or of none hidden."""
    half, whole, wrong = (
        row("two", "identified", names, [["a"], ["c"]], candidates=[(names, 0.999), (["b"], 0.001)]) for names in (["a"], ["a", "c"], ["b"])
    )
    assert [(sure(r), no_wrong_name(r)) for r in (half, whole, wrong)] == [(True, True), (True, True), (True, False)]
    assert not sure(row("one", "identified", ["a"], [["a"]], candidates=[(["a"], 0.94)]))
    assert not sure(row("nothing", "none", none=1.0))
    console = Console(record=True, width=160)
    with console.capture() as captured:
        show(console, [r | {"seed": i} for i, r in enumerate((half, whole, wrong))])
    assert re.search(r"names stated above 0.95, every one right: 2 of 3 .*\n  and nothing that shows left out: 1 of 3 ", captured.get())


def test_the_table_of_scores():
    rows = [r | {"seed": i} for i, (r, _, _) in enumerate(SCORED)]
    console = Console(record=True, width=160)
    with console.capture() as captured:
        show(console, rows)
    text = captured.get()
    assert "22 campaigns, seeds 0 to 21" in text
    assert "of these drawn with an effect in mind that cannot be it: 1; another effect than those in mind is right, too: 3" in text
    assert "false alarm, nothing hidden: 1 of 2" in text
    assert text.count("\n- ") == 11
    assert element_found(SCORED[10][0])
    assert not element_found(SCORED[11][0])
    assert most_probable(SCORED[0][0]) == (0.97, True)
    assert interval(0, 59)[1] == pytest.approx(1 - 0.025 ** (1 / 59))  # nothing of n: 1 - (alpha / 2)^(1 / n)


def test_what_one_temperature_alone_shows_no_law_tells():
    tests = [[20.0, 0], [40.0, 0], [60.0, 0], [60.0, 7200]]
    assert not told_elsewhere({"tests": tests, "amounts": [[0.0, 0.2, 1.0, 1.0]]})
    assert told_elsewhere({"tests": tests, "amounts": [[0.0, -0.4, 1.0, 1.0]]})
    assert halved({"drafted": [10.0, 4.9]})
    assert not halved({"drafted": [10.0, 5.1]})
    assert above_noise({"drafted": [2.1, 1.0]})
    assert not above_noise({"drafted": [1.9, 1.0]})
    assert above_noise({"drafted": [3.1, 1.6, 1.5]})
    assert not above_noise({"drafted": [3.1, 3.0, 1.6]})


def test_of_two_that_do_the_same_either_is_the_whole_answer():
    """Grooves that shrank and a weaker preload of 40 standard errors each, and 3 beside the other
    (blind campaign 2398): either name is right, and that nothing is missing is not."""
    both = row("two", "identified", ["preload_loss"], [["preload_loss"], ["clearance_opening"]])
    assert outcome(both | {"visibility_beside": [50.0, 50.0]}) == "half"
    alike = {"visibility": [50.0, 40.0], "visibility_beside": [3.0, 2.6]}
    assert outcome(both | alike) == "right"
    assert not visible(both | alike)
    assert outcome(row("two", "none", [], [["preload_loss"], ["clearance_opening"]]) | alike) == "missed"


def test_rows_from_before_evidence_was_said_to_go_astray_are_stated_anew_and_others_are_not():
    old = row("one", "identified", ["a"], [["a"]], candidates=[(["a"], 1.0), (["c"], 0.0)]) | {"weighed": {}}
    told = restated(old)
    assert told["probability"]["none"] + told["probability"]["unknown"] + sum(c["probability"] for c in told["candidates"]) == pytest.approx(1.0)
    assert 1 - ASTRAY < told["candidates"][0]["probability"] < 1 - UNTRIED * ASTRAY
    assert told["candidates"][1]["probability"] > 0.01
    assert restated(old | {"weighed": {"astray": ASTRAY}})["candidates"] == old["candidates"]
