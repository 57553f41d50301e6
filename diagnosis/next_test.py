"""Which test would decide between explanations that survive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from diagnosis.explain import Candidate
from diagnosis.theory import Predicted, Theory, predict
from model.machine import OutsideRange
from model.pair import NoEquilibrium
from model.tolerance import toleranced

TEMPERATURES = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0)  # C, a chamber's reach
SPEEDS = (0.0, 3600.0, 7200.0, 12000.0)  # rpm
MODEL_SD = 2e-3  # relative: what fitted parameters leave open of a frequency at a condition not measured yet


@dataclass(frozen=True)
class NextTest:
    """A test not made yet: how far apart it puts two explanations, as odds if either is true, and what each predicts (Hz)."""

    temperature: float
    speed_rpm: float
    separates: tuple[str, str]
    odds: float
    repeats: int
    predictions: tuple[tuple[float, ...], tuple[float, ...]]


def next_tests(theory: Theory, candidates: Sequence[Candidate], most: int = 3) -> list[NextTest]:
    """For every two of the candidates the feasible test (temperature, speed) that separates them best, the strongest first."""
    spindle = theory.spindle
    found = []
    for a, b in combinations(candidates, 2):
        best: NextTest | None = None
        for temperature in TEMPERATURES:
            for rpm in SPEEDS:
                try:
                    ends = [_frequencies(theory, c, temperature, rpm * np.pi / 30) for c in (a, b)]
                except (NoEquilibrium, OutsideRange, ValueError):
                    continue
                band = spindle.hammer.band
                first, second = (np.array([f for f in e.frequency if band[0] < f < band[1]]) for e in ends)
                count = min(len(first), len(second))
                distance = float(np.sum((np.log(first[:count] / second[:count]) / MODEL_SD) ** 2))
                odds = float(np.exp(min(distance / 2, 50.0)))
                if best is None or odds > best.odds:
                    repeats = int(np.ceil(min(np.log(100.0) / max(distance / 2, 1e-6), 99)))
                    predictions = (tuple(map(float, first)), tuple(map(float, second)))
                    best = NextTest(temperature, rpm, (" + ".join(a.effects), " + ".join(b.effects)), odds, max(repeats, 1), predictions)
        if best is not None:
            found.append(best)
    return sorted(found, key=lambda n: -n.odds)[:most]


def _frequencies(theory: Theory, candidate: Candidate, temperature: float, speed: float) -> Predicted:
    """Modes of a fitted candidate at a condition nobody has measured."""
    spindle = theory.spindle
    for parameter, value in zip(toleranced(spindle), candidate.fit.nuisance, strict=False):
        spindle = parameter.apply(spindle, float(value))
    like = theory.data.observations[0]
    there = replace(like, condition=replace(like.condition, temperature=temperature, speed=speed))
    effects = [(e, candidate.fit.values[e.name]) for e in candidate.fit.effects]
    return predict(spindle, there, effects)
