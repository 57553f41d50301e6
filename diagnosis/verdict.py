"""`spindle diagnose`: the whole diagnosis of a campaign of hammer tests."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import partial

import numpy as np

from thermospindle.diagnosis.data.lines import line_data
from thermospindle.diagnosis.data.mode_table import TestData, mode_data
from thermospindle.diagnosis.decision.verdict import Verdict, decide
from thermospindle.diagnosis.forward.making import campaign_model, check_tables, expected_noise
from thermospindle.diagnosis.forward.model import FAILED, SIZE_STEP, CampaignModel
from thermospindle.diagnosis.inference.freeform import free_forms
from thermospindle.diagnosis.inference.hypothesis import DEPARTS, Hypothesis
from thermospindle.diagnosis.inference.search import Search, search
from thermospindle.diagnosis.misfit.patterns import Chosen, choose_for
from thermospindle.diagnosis.parameters.mechanism import Mechanism, shared, strongest, unmoved, variants
from thermospindle.diagnosis.prediction.detectable import smallest, unseen_beside
from thermospindle.diagnosis.prediction.next_test import NextTest, next_tests
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.parallel import in_parallel, packed, unpacked
from thermospindle.model.types import Array
from thermospindle.sim.campaign.beside import check_points
from thermospindle.sim.campaign.campaign import Campaign, Noise, Test, condition_of
from thermospindle.sim.effects import CATALOGUE, of_scene, usable
from thermospindle.sim.effects.effect import Effect

STEPS = (4.0, 7.0, 18.0, 15.0, 6.0, 0.1, 2.0, 8.0)  # of progress, beside one a test: about how long each takes, in what reading a test takes


@dataclass(frozen=True, eq=False)
class Drift:
    """What would have to change from test to test: without any catalogue an element, or an effect of it whose
    size in every test is the data's own: its `values` but the size (None of an element), and the condition `at`
    which its formula is asked in every test (None: at the test's own). `change` (tests,) with `covariance`
    (tests, tests) in `unit`, what they go with, and the ln evidence over the model without effects."""

    element: str
    unit: str
    conditions: tuple[Condition, ...]
    change: Array
    covariance: Array
    pattern: Chosen | None
    gain: float
    at: Condition | None = None
    values: Mapping[str, float] | None = None

    @property
    def relative(self) -> bool:
        """Whether it is told as a share of what was: what free forms count in per cent of a logarithm."""
        return self.unit == "%" and self.values is None

    @property
    def sd(self) -> Array:
        """Standard error of every change."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def told(self) -> list[tuple[float, float]]:
        """Change and standard error of every test, as a share (%) of what was where it is `relative`."""
        if not self.relative:
            return [(float(a), float(s)) for a, s in zip(self.change, self.sd, strict=True)]
        factor = np.exp(self.change / 100)
        return [(float(100 * (f - 1)), float(f * s)) for f, s in zip(factor, self.sd, strict=True)]

    @property
    def told_covariance(self) -> Array:
        """Covariance (tests, tests) of the changes that are `told`."""
        if not self.relative:
            return self.covariance
        factor = np.exp(self.change / 100)
        return np.asarray(factor[:, None] * self.covariance * factor)


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """All that `spindle diagnose` tells; `own_laws` how much of the effects that the verdict names the data have
    in every test, where that is not by their law; `detectable`: of every effect the variant and size (from
    neutral, in its unit) that would have shown; `may_hide` what could act beside what the verdict names, unseen;
    `unable` the effects that were no explanation of some test because they cannot be worked out there, and why."""

    spindle: Spindle
    campaign: Campaign
    search: Search
    verdict: Verdict
    drifts: tuple[Drift, ...]
    own_laws: tuple[Drift, ...]
    tests: tuple[NextTest, ...]
    detectable: Mapping[str, tuple[Mechanism, float]]
    may_hide: tuple[str, ...] = ()
    unable: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.campaign.title!r} beside {self.spindle.name}: {self.verdict.reason}>"

    def __reduce__(self) -> tuple[Callable, tuple[bytes]]:
        """For `pickle`, which refuses what free forms and tolerances do, functions made where they are asked."""
        return _again, (packed({f.name: getattr(self, f.name) for f in fields(self)}),)


def _again(kept: bytes) -> Diagnosis:
    return Diagnosis(**unpacked(kept))


def diagnose(
    spindle: Spindle, campaign: Campaign, catalogue: tuple[Effect, ...] = CATALOGUE, progress: Callable[[str], None] = lambda done: None
) -> Diagnosis:
    """Which effect of the catalogue explains a campaign's FRFs or mode tables, or what would have to drift where none does."""
    model = campaign_data(spindle, campaign, progress)
    present = {e.name for e, _ in of_scene(spindle)}
    named = [v for e in usable(spindle, catalogue) if e.name not in present for v in variants(e)]
    found = search(model, named, free_forms(spindle, unmoved(spindle, [d.condition for d in model.tests])), progress)
    verdict = decide(found)
    progress(": ".join(filter(None, (verdict.word, ", ".join(verdict.effects)))))  # who stops what follows has this
    drifting = (c for c in verdict.free if len(c.hypothesis.mechanisms) == 1 and not c.hypothesis.mechanisms[0].beyond and c.delta_evidence > 0)
    alone = sorted(drifting, key=lambda c: -c.delta_evidence)
    drifts = tuple(_drift(found, c.hypothesis, 0) for c in alone)
    own_laws = _own_laws(found, verdict)
    tests = tuple(next_tests(found, verdict)) if verdict.word != "none" else ()
    progress("next tests weighed")
    seen = smallest(found.model, found.base.fit, verdict.accepted.evidence.learned, found.screened)
    progress("smallest sizes found")
    beside, why = unseen_beside(found, verdict.accepted), unable(found.model, [s.mechanism for s in found.screened])
    return Diagnosis(spindle, campaign, found, verdict, drifts, own_laws, tests, seen, beside, why)


def unable(model: CampaignModel, mechanisms: Sequence[Mechanism]) -> dict[str, str]:
    """Of effects of the catalogue those that cannot be worked out at the conditions of some test,
    however small, and why: screening takes them for nothing there."""
    found, nothing = dict[str, str](), np.zeros(len(model.parameters))
    for m in {m.name: m for m in reversed(mechanisms) if m.kind == "law"}.values():
        step = SIZE_STEP * m.size.prior_sd
        least = m.size.neutral + (step if m.size.neutral + step <= m.size.limits[1] else -step)
        for t, data in enumerate(model.tests):
            try:
                model.operating(t, nothing, [(m.effect, m.values(least, [q.neutral for q in m.shape]))])
            except FAILED as error:
                found.setdefault(m.name, f"{data.test.id}: {error}")
    return found


def campaign_data(spindle: Spindle, campaign: Campaign, progress: Callable[[str], None] = lambda done: None) -> CampaignModel:
    """The model of a campaign beside the data of all its tests; BadInput for points on bodies that
    the scene has not, and for tables of more modes than it may have there."""
    check_points(spindle, campaign)
    noise = expected_noise(spindle)
    data = in_parallel(partial(_data, campaign.noise, noise, spindle.tolerances.gain), campaign.tests, done=lambda d: progress(f"{d.test.id} read"))
    model = campaign_model(spindle, campaign, data)
    check_tables(model, str(campaign.folder or campaign.title))
    return model


def _data(stated: Noise | None, expected: Noise, gain: float, test: Test) -> TestData:
    condition = condition_of(test)
    return line_data(test, condition, stated, expected) if test.frf is not None else mode_data(test, condition, gain)


def _own_laws(found: Search, verdict: Verdict) -> tuple[Drift, ...]:
    """Every effect that the verdict names and that is likelier with a law of the data's own, or
    departs from the one assumed, once: from the most probable explanation that has it."""
    drifts: dict[str, Drift] = {}
    conditions = [d.condition for d in found.model.tests]
    for c in verdict.candidates:
        if set(c.names) <= set(verdict.effects):
            for k, m in enumerate(c.hypothesis.mechanisms):
                if m.own_law or departs(c.hypothesis, k, conditions):
                    drifts.setdefault(m.name, _drift(found, c.hypothesis, k))
    return tuple(drifts.values())


def departs(h: Hypothesis, k: int, conditions: Sequence[Condition]) -> bool:
    """Whether the data have mechanism `k` of an explanation otherwise than by its law: by much of
    its usual size, or by more than all that they have of it by its law, however little that is."""
    m, departure = h.mechanisms[k], h.evidence.learned.departures[k]
    change, law = h.evidence.sizes[k] - m.size.neutral, shared(m, conditions)
    by_law = law * (law @ change) / max(float(law @ law), 1e-300)
    return bool(departure >= DEPARTS or (departure > 0 and np.linalg.norm(change - by_law) > np.linalg.norm(by_law)))


def _drift(found: Search, h: Hypothesis, k: int) -> Drift:
    """Of mechanism `k` of an explanation."""
    conditions = tuple(d.condition for d in found.model.tests)
    m, covariance = h.mechanisms[k], h.evidence.size_covariance[k]
    change = h.evidence.sizes[k] - m.size.neutral
    gain = h.evidence.ln - found.base.evidence.ln
    regular = covariance + 1e-6 * np.trace(covariance) / len(change) * np.eye(len(change))
    pattern = choose_for(conditions, change, regular) if len(change) > 2 else None
    values = None if m.free else {name: v for name, v in m.values(0.0, h.fit.shapes[k]).items() if name != m.size.name}
    at = strongest(found.model.spindle, conditions) if m.own_law else None
    return Drift(m.name, m.size.unit, conditions, change, covariance, pattern, gain, at, values)
