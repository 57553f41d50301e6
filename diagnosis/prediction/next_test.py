"""Which test would decide between the explanations that survive, and what each of them predicts of it.

Two explanations differ at a condition by D in the frequencies of their modes; with the covariance S of the errors of a test
there and of what each leaves open, the expected ln odds if either is true are D S^-1 D / 2 (Box & Hill, *Technometrics* 9
(1967) 57). That they leave different things open would add to that; it is not counted, for these are known to first order
alone. In S is also what two honest programs differ by: a test by which it is decided has to show more than that.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import numpy as np

from thermospindle.diagnosis.decision.explanations import Candidate, beyond_limits
from thermospindle.diagnosis.decision.reason import NUMERICS
from thermospindle.diagnosis.decision.verdict import Verdict
from thermospindle.diagnosis.forward.model import FAILED, CampaignModel
from thermospindle.diagnosis.inference.search import NEAR, Search
from thermospindle.diagnosis.prediction.forecast import ModePrediction, Standing, by_all, covariance, forecast, standing
from thermospindle.diagnosis.prediction.outcomes import same
from thermospindle.model.machine import Condition
from thermospindle.model.parallel import in_parallel
from thermospindle.model.types import Array
from thermospindle.model.units import RPM

TEMPERATURES = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0)  # C, a chamber's reach
SPEEDS = (0.0, 0.5, 1.0)  # of the nominal speed, or the highest that was tested: what a spindle is not built for is not proposed
CERTAIN = np.log(1e6)  # ln odds beyond which nothing is gained, and models are not to be trusted
ALIVE = 0.01  # posterior probability from which an explanation is to be told from the best
TELLS = 2.0  # odds from which a test is worth naming
DECIDED = np.log(100.0)
MOST = 3


@dataclass(frozen=True)
class NextTest:
    """How far apart a test at `condition` puts two explanations, as odds if either is true (no more than a
    million); how many repeats make them 100 to 1; what they differ in most, in words; what each predicts
    of every mode in the band; and whether it is `beyond` the temperatures that the spindle is meant for."""

    condition: Condition
    separates: tuple[str, str]
    odds: float
    repeats: int
    tells: str
    predictions: tuple[tuple[ModePrediction, ...], tuple[ModePrediction, ...]]
    beyond: bool = False


def next_tests(found: Search, verdict: Verdict) -> list[NextTest]:
    """The best test for each pair of the leading explanation and its nearest rivals; of what
    nothing explains but drift, of that and the best of the catalogue. One beyond the temperatures
    that the spindle is meant for only where none within decides; none faster than it is."""
    possible = [c for c in verdict.candidates if c.names == verdict.effects or not beyond_limits(c.hypothesis)]
    alive = [c for c in possible if set(c.names) <= set(verdict.effects) or c.probability > ALIVE][: MOST + 1]
    if len(alive) < 2:
        near = max((c.hypothesis.evidence.ln for c in alive or possible), default=0.0) - NEAR  # what is farther behind needs no test
        alive += [c for c in possible if c not in alive and c.hypothesis.evidence.ln > near][: 2 - len(alive)]
    drifting = [c for c in verdict.free if c.hypothesis.mechanisms][:1]  # what is only left predicts nothing
    if verdict.word == "unexplained":
        alive = [*drifting, *alive[:1]]
    elif verdict.word != "identified":
        alive += drifting
    alive = alive[: MOST + 1]
    if len(alive) < 2:
        return []
    lead, rivals = alive[0], alive[1:]
    least = lead.hypothesis.evidence.ln - NEAR  # what is as far behind as that was not fitted anew in the search either
    first, *others = in_parallel(partial(standing, found.model, least=least), [c.hypothesis for c in alive])
    plans = planned(found.model)
    predicted = in_parallel(partial(_predicted, found.model, first, others), plans)
    tests, meant = [], partial(is_meant, found.model)
    for k, rival in enumerate(rivals):
        weighed = []
        for plan, own in zip(plans, predicted, strict=True):
            if own and (a := own[0]) and (b := own[1 + k]):
                weighed.append(replace(_weighed(plan, lead, rival, a, b), beyond=not meant(plan)))
        weighed = [t for t in weighed if t.odds > TELLS]
        decide = [t for t in weighed if not t.beyond and t.odds >= np.exp(DECIDED)]
        if weighed:
            tests.append(max(decide or weighed, key=lambda t: (min(t.odds, np.exp(CERTAIN)), -abs(t.condition.temperature - 20), -abs(t.condition.speed))))
    return tests


def _predicted(model: CampaignModel, first: Standing, others: Sequence[Standing], plan: Condition) -> list[list[ModePrediction] | None]:
    """Of every explanation its modes at a condition, None where it has no spindle there; nothing at all where the first has none."""
    try:
        rates = by_all(model, first, plan)  # which of the explanations is true makes no difference to these
    except FAILED:
        return []
    a = forecast(model, first, plan, rates)
    return [a, *(forecast(model, there, plan, rates) for there in others)] if a else []


def planned(model: CampaignModel) -> list[Condition]:
    """Conditions that were not tested, hit and soaked as most tests of the campaign were, and turning the way that these did."""
    tested = [d.condition for d in model.tests]
    (how, _), = Counter((c.level, c.soak_time) for c in tested).most_common(1)
    way = np.copysign(1.0, sum(c.speed for c in tested))
    highest = way * max(abs(model.spindle.nominal_speed), *(abs(c.speed) for c in tested))
    turns = any(b.turns for b in model.spindle.structure.bodies)
    plans = [Condition(t, s and s * highest, *how) for t, s in product(TEMPERATURES, SPEEDS if turns else SPEEDS[:1])]
    return [plan for plan in plans if not any(same(plan, c) for c in tested)]


def is_meant(model: CampaignModel, plan: Condition) -> bool:
    """Whether a temperature lies within what the scene states, or tests of the campaign went to."""
    temperatures = [*model.spindle.temperatures, *(d.condition.temperature for d in model.tests)]
    return min(temperatures) <= plan.temperature <= max(temperatures)


def _weighed(plan: Condition, lead: Candidate, rival: Candidate, a: Sequence[ModePrediction], b: Sequence[ModePrediction]) -> NextTest:
    difference, errors = np.array([x.frequency - y.frequency for x, y in zip(a, b, strict=True)]), of_both(a, b)
    ln_odds = min(float(difference @ np.linalg.solve(errors, difference)) / 2, CERTAIN)
    most = int(np.argmax(difference**2 / np.diag(errors)))
    tells = f"the mode near {a[most].frequency:.0f} Hz, which differs by {abs(difference[most]):.1f} Hz"
    repeats = max(1, int(np.ceil(DECIDED / max(ln_odds, 1e-3))))
    return NextTest(
        plan, (" + ".join(lead.names), " + ".join(rival.names)), float(np.exp(ln_odds)), min(repeats, 1000), tells, (tuple(a), tuple(b))
    )


def of_both(a: Sequence[ModePrediction], b: Sequence[ModePrediction]) -> Array:
    """Covariance (k, k) of what a test may show of the difference of two predictions, Hz^2: its own
    errors, of reading and of its thermometer, once, and what each of the two leaves open."""
    first, second = covariance(a), covariance([replace(m, sd=float(np.sqrt(max(m.sd**2 - m.common[0] ** 2, 0.0))), common=m.common[1:]) for m in b])
    one, other = (np.array([m.sd**2 - sum(v**2 for v in m.common) for m in of]) for of in (a, b))
    programs = np.array([NUMERICS[0] * m.frequency for m in a])
    return first + second - np.diag(np.minimum(one, other) - programs**2)


def in_words(c: Condition) -> str:
    words = f"at {c.temperature:g} C, {c.speed / RPM:.0f} rpm" + (f", hit with {c.level:g} N" if c.level else "")
    return words + (f", after {c.soak_time / 60:g} min in the chamber" if np.isfinite(c.soak_time) else "")
