"""Which test would decide between the explanations that survive, and what each of them predicts of it.

Two explanations differ at a condition by D in the frequencies of their modes; with the errors S of a test there and of what each leaves
open, the expected ln odds if either is true are D S^-1 D / 2 (Box & Hill, *Technometrics* 9 (1967) 57).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermospindle.diagnosis.decision.explanations import Candidate, beyond_limits
from thermospindle.diagnosis.decision.verdict import Verdict
from thermospindle.diagnosis.forward.mechanism import size_covariance
from thermospindle.diagnosis.forward.model import FAILED
from thermospindle.diagnosis.inference.hypothesis import Hypothesis
from thermospindle.diagnosis.inference.search import Search
from thermospindle.model.errors import NoEquilibrium
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.modes import modes
from thermospindle.model.types import Array
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point

TEMPERATURES = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0)  # C, a chamber's reach
SPEEDS = (0.0, 0.5, 1.0, 1.5)  # of the spindle's nominal speed
READING = 5e-5  # relative error of a frequency read from a hammer test
CERTAIN = np.log(1e6)  # ln odds beyond which nothing is gained, and models are not to be trusted
DECIDED = np.log(100.0)
ALIVE = 0.01  # posterior probability from which an explanation is to be told from the best
TELLS = 2.0  # odds from which a test is worth naming
MOST = 3


@dataclass(frozen=True)
class ModePrediction:
    """Natural frequency (Hz) and damping ratio of a mode, with the standard deviation of the frequency."""

    frequency: float
    sd: float
    damping: float


@dataclass(frozen=True)
class NextTest:
    """How far apart a test at `condition` puts two explanations, as odds if either is true (no more than a million); how many repeats make them
    100 to 1; what they differ in most, in words; and what each predicts of every mode in the band."""

    condition: Condition
    separates: tuple[str, str]
    odds: float
    repeats: int
    tells: str
    predictions: tuple[tuple[ModePrediction, ...], tuple[ModePrediction, ...]]


def next_tests(found: Search, verdict: Verdict) -> list[NextTest]:
    """The best test for each pair of the leading explanation and its nearest rivals."""
    alive = [c for c in verdict.candidates if set(c.names) <= set(verdict.effects) or c.probability > ALIVE][: MOST + 1]
    if len(alive) < 2:
        alive += [c for c in verdict.candidates if c not in alive][: 2 - len(alive)]
    alive = [c for c in alive if c.names == verdict.effects or not beyond_limits(c.hypothesis)]
    if verdict.free and verdict.word != "identified":
        alive.append(verdict.free[0])
    if not alive:
        return []
    lead, rivals = alive[0], alive[1 : MOST + 1]
    plans = [Condition(t, s * found.model.spindle.nominal_speed) for t in TEMPERATURES for s in SPEEDS]
    first = {p: _predicted(found, lead.hypothesis, p) for p in plans}
    tests = []
    for rival in rivals:
        weighed = []
        for plan in plans:
            a, b = first[plan], _predicted(found, rival.hypothesis, plan)
            if a and b and len(a) == len(b):
                weighed.append(_weighed(plan, lead, rival, a, b))
        weighed = [t for t in weighed if t.odds > TELLS]
        if weighed:
            tests.append(max(weighed, key=lambda t: (min(t.odds, np.exp(CERTAIN)), -abs(t.condition.temperature - 20), -t.condition.speed)))
    return tests


def _weighed(plan: Condition, lead: Candidate, rival: Candidate, a: Sequence[ModePrediction], b: Sequence[ModePrediction]) -> NextTest:
    difference = np.array([x.frequency - y.frequency for x, y in zip(a, b, strict=True)])
    sd = np.array([np.hypot(x.sd, y.sd) for x, y in zip(a, b, strict=True)])
    weight = (difference / sd) ** 2
    ln_odds = min(float(weight.sum() / 2), CERTAIN)
    most = int(np.argmax(weight))
    tells = f"the mode near {a[most].frequency:.0f} Hz, which differs by {abs(difference[most]):.1f} Hz"
    repeats = max(1, int(np.ceil(DECIDED / max(ln_odds, 1e-3))))
    return NextTest(
        plan, (" + ".join(lead.names), " + ".join(rival.names)), float(np.exp(ln_odds)), min(repeats, 1000), tells, (tuple(a), tuple(b))
    )


def _predicted(found: Search, h: Hypothesis, plan: Condition) -> list[ModePrediction] | None:
    """Modes in the band at a condition under one explanation: tolerances and the model's constant errors as fitted, sizes continued from the
    tests by their law.

    Errors: of reading, of the thermometer, and of the sizes.
    """
    try:
        spindle = _built(found, h)
        sizes, errors = zip(*[_continued(found, h, k, plan) for k in range(len(h.mechanisms))], strict=True) if h.mechanisms else ((), ())
        base = _frequencies(found, h, spindle, plan, sizes)
        warmer = replace(plan, temperature=plan.temperature + found.model.spindle.tolerances.temperature)
        moved = [_frequencies(found, h, spindle, warmer, sizes)[0]]
        for k, error in enumerate(errors):
            step = [s + (error if i == k else 0.0) for i, s in enumerate(sizes)]
            moved.append(_frequencies(found, h, spindle, plan, step)[0])
    except FAILED:
        return None
    frequency, damping = base
    if any(len(m) != len(frequency) for m in moved):
        return None
    variance = (READING * frequency) ** 2 + sum((m - frequency) ** 2 for m in moved)
    return [ModePrediction(float(f), float(s), float(z)) for f, s, z in zip(frequency, np.sqrt(variance), damping, strict=True)]


def _built(found: Search, h: Hypothesis) -> Spindle:
    spindle = found.model.spindle
    for parameter, value in zip(found.model.build, h.evidence.mean, strict=False):
        spindle = parameter.apply(spindle, float(value * parameter.sd))
    return spindle


def _continued(found: Search, h: Hypothesis, k: int, plan: Condition) -> tuple[float, float]:
    """Size of mechanism `k` at another condition and its standard error, by the prior that was learned for its law."""
    m, learned = h.mechanisms[k], h.evidence.learned
    conditions = [*(d.condition for d in found.model.tests), plan]
    prior = size_covariance(conditions, learned.widths[k] * m.size.prior_sd, learned.departures[k])
    n = len(conditions) - 1
    weights = np.linalg.solve(prior[:n, :n], prior[:n, n])
    covariance = h.evidence.size_covariance[k]
    variance = prior[n, n] - weights @ prior[:n, n] + weights @ covariance @ weights
    size = m.size.neutral + float(weights @ (h.evidence.sizes[k] - m.size.neutral))
    return float(np.clip(size, *m.size.limits)), float(np.sqrt(max(variance, 0.0)))


def _frequencies(found: Search, h: Hypothesis, spindle: Spindle, plan: Condition, sizes: Sequence[float]) -> tuple[Array, Array]:
    applied = [*found.model.present]
    for m, size, shape in zip(h.mechanisms, sizes, h.fit.shapes, strict=True):
        applied.append((m.effect, m.values(float(np.clip(size, *m.size.limits)), shape)))
    band = spindle.hammer.band[1]
    point = operating_point(spindle, plan, applied)
    if (status := point.state.status) != "in contact":  # a spindle that rattles has no modes to be read
        raise NoEquilibrium(status)
    found_modes = modes(point.chain, found.model.elsewhere(point.linear, h.evidence.mean), band)
    return np.array([mode.frequency for mode in found_modes]), np.array([mode.damping_ratio for mode in found_modes])


def in_words(condition: Condition) -> str:
    words = f"at {condition.temperature:g} C, {condition.speed / RPM:.0f} rpm"
    return words
