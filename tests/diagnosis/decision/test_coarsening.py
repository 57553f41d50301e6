"""What evidence is worth where residuals tell that the model is wrong, or say the same twice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.hand_made_search import made
from thermospindle.diagnosis.decision.explanations import COARSE, TOO_SURE, coarsening, discount
from thermospindle.diagnosis.decision.verdict import decide
from thermospindle.diagnosis.inference.remainder import SMALL, Overlap, between_tests
from thermospindle.diagnosis.parameters.nuisance import BUILD, DAMPING, STIFFNESS

WRONG = [({}, 1.0, 1.0), ({STIFFNESS: 1e-3, DAMPING: 0.01}, 1.0, 1.0), ({BUILD: 1.0}, 1.0, 1.0), ({BUILD: 4.0}, 1.0, 1.0), ({}, 1.1, COARSE)]


@pytest.mark.parametrize(("sizes", "errors", "worth"), WRONG)
def test_evidence_is_worth_less_where_the_model_is_seen_to_be_wrong(sizes, errors, worth):
    """A lead of six is a lead of six where constant errors of modes or the drawing are all that is wrong, and of a
    quarter of it where errors are too small."""
    found = made({"a": 30.0, "b": 24.0})
    wrong = [replace(h, evidence=replace(h.evidence, learned=replace(h.evidence.learned, sizes=sizes, errors=errors))) for h in found.hypotheses]
    v = decide(replace(found, hypotheses=tuple(wrong), base=wrong[-1]))
    first, second = (next(c.probability for c in v.candidates if c.names == (k,)) for k in "ab")
    assert np.log(first / second) == pytest.approx(6.0 / worth)
    assert coarsening(wrong[0], Overlap(1.0, 0.0, 1.0)) == worth
    assert coarsening(wrong[0], Overlap(1.0, 0.1, 1.3)) == COARSE
    assert coarsening(wrong[0], Overlap(1.0, 0.01, 1.03)) == worth  # what one of many pairs of tests has by chance


def test_noise_that_a_window_spreads_over_lines_counts_as_often_as_it_says_something():
    """A second effect of 23 in ln evidence, of a third fewer numbers for a window's noise: blind
    campaign 2000 named one of two, for that counted a quarter on top of it."""
    best = made({"a": 30.0}).hypotheses[0]
    assert discount(best, Overlap(1.5, 0.0, 1.5)) == 1.5 * TOO_SURE
    assert discount(best, Overlap(1.5, 0.1, 1.9)) == 1.9 * COARSE * TOO_SURE


@pytest.mark.parametrize("share", [0.0, 0.6, 0.95])
def test_what_is_missed_in_every_test_is_one_finding(share):
    """Noise beside a misfit that is the same in four tests at lines of their own: their correlation is its share of the squares."""
    random = np.random.default_rng(7)
    left = []
    for k in range(4):
        lines = np.linspace(400.0, 6000.0, 300 + 10 * k)
        same = np.array([np.sin(lines / 500 + channel) for channel in range(14)]) * np.sqrt(2)
        left.append((lines, np.sqrt(share) * same + np.sqrt(1 - share) * random.standard_normal(same.shape)))
    assert between_tests(left) == pytest.approx(share, abs=0.02)


def test_noise_of_few_numbers_says_nothing_twice():
    """One FRF of 140 lines in four tests: correlations of a twentieth are chance there, and evidence is worth what it
    says. A spindle's weaker preload, seen from its nose alone, was no effect for that: its 8.0 in ln evidence counted 2."""
    random = np.random.default_rng(11)
    found = [between_tests([(np.arange(140.0), random.standard_normal((2, 140))) for _ in range(4)]) for _ in range(100)]
    assert np.mean(np.array(found) > 0) < 0.05  # six pairs, of which each is beyond three standard deviations once in 700


def test_noise_that_a_window_spreads_says_nothing_twice_between_tests():
    """Autoregressive over lines, 0.7 from one to the next: of 800 numbers a sixth are of their own,
    and of 36 pairs of tests some correlate by chance."""
    random = np.random.default_rng(3)

    def noise() -> tuple[np.ndarray, np.ndarray]:
        return np.arange(400.0), lfilter([np.sqrt(1 - 0.49)], [1.0, -0.7], random.standard_normal((2, 500)))[:, 100:]

    found = np.array([between_tests([noise() for _ in range(9)], 1.7 / 0.3) for _ in range(40)])
    assert found.max() < SMALL
    assert np.mean(found > 0) < 0.15
