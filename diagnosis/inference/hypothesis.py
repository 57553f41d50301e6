"""Explanations: mechanisms that act together, fitted to a campaign, with their evidence; many of them side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from thermospindle.diagnosis.forward.model import FAILED, CampaignModel
from thermospindle.diagnosis.inference.evidence import Evidence, evidence
from thermospindle.diagnosis.inference.fit import TEMPERS, Fit, fit, rated
from thermospindle.diagnosis.inference.gaussian import apart_by
from thermospindle.diagnosis.inference.prior import DRIFTING, Learned, steady, wider_tolerances
from thermospindle.diagnosis.inference.problem import Problem
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.diagnosis.parameters.mechanism import Mechanism, shared
from thermospindle.model.parallel import in_parallel
from thermospindle.model.types import Array

EARLY = 2  # number in TEMPERS at which large effects are told from each other
SCAN = (-10.0, -6.0, -3.0, -1.5, 1.5, 3.0, 6.0, 10.0)  # prior standard deviations of a size
STRAIN = 1.02  # times the errors, from which the model without effects leaves a misfit
REFITS = 2  # at most
PLENTY = 12.0  # ln evidence that anything more must promise where no misfit is left
DEPARTS = 0.3  # of the size from test to test, from which a law does not hold
SAME = 3.0  # errors of their difference, within which sizes are the same
LITTLE = 2.0  # ln evidence that a screened mechanism must promise


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """Mechanisms that act together (none, one, several), fitted, with their evidence."""

    fit: Fit
    evidence: Evidence

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {' + '.join(self.names) or 'none'}: ln evidence {self.evidence.ln:.1f}>"

    @property
    def light(self) -> Hypothesis:
        """Without the rates of its fit, to be sent and kept."""
        return replace(self, fit=replace(self.fit, rates=None))

    def with_mechanisms(self, mechanisms: tuple[Mechanism, ...]) -> Hypothesis:
        """With these very mechanisms: what comes back from another process has copies of them."""
        return replace(self, fit=replace(self.fit, mechanisms=mechanisms))

    @property
    def mechanisms(self) -> tuple[Mechanism, ...]:
        return self.fit.mechanisms

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(m.name for m in self.mechanisms)

    @property
    def free(self) -> bool:
        return any(m.free for m in self.mechanisms)

    @property
    def widens(self) -> bool:
        """Whether build tolerances that are wider than stated are weighed in its evidence."""
        return kinds_of.BUILD in self.evidence.learned.sizes

    @property
    def idle(self) -> tuple[bool, ...]:
        """Of every mechanism whether its sizes, in all tests, are its neutral value within three of their errors."""
        errors = np.sqrt(np.einsum("mtt->mt", self.evidence.size_covariance))
        neutral = np.array([[m.size.neutral] for m in self.mechanisms])
        return tuple((np.abs(self.evidence.sizes - neutral) <= 3 * errors).all(axis=1).tolist())

    @property
    def shape_errors(self) -> tuple[Array, ...]:
        """Standard errors of the shape parameters of every mechanism, in their units; none of those that are held at a limit."""
        errors = np.sqrt(np.maximum(np.diag(self.evidence.covariance), 0.0))
        errors[[h.number for h in self.fit.held]] = 0.0
        found, at = [], len(self.fit.nuisance)
        for m, root in zip(self.mechanisms, self.fit.roots, strict=True):
            at += len(root) + len(m.shape)
            found.append(errors[at - len(m.shape) : at] * np.array([q.prior_sd for q in m.shape]))
        return tuple(found)

    @property
    def farthest_shape(self) -> float:
        """Of all shape parameters how far the farthest is from what is known of it, in its prior's
        standard deviations; nothing where there are none."""
        rows = zip(self.mechanisms, self.fit.shapes, strict=True)
        return max((abs(u - q.neutral) / q.prior_sd for m, row in rows for q, u in zip(m.shape, row, strict=True)), default=0.0)

    @property
    def same_in_all(self) -> bool:
        """Whether what is free is as much in every test, of two or more: an offset, and no drift."""
        rows = [(a, c) for m, a, c in zip(self.mechanisms, self.evidence.sizes, self.evidence.size_covariance, strict=True) if m.free]
        return all(len(a) > 1 and np.all(np.abs(a) > SAME * np.sqrt(np.diag(c))) and apart_by(a, c).max() <= SAME for a, c in rows)

    @property
    def excess(self) -> float:
        """What is left beyond noise, in squares of the errors a number."""
        return max(self.fit.chi2 / self.fit.count - 1.0, 0.0)


@dataclass(frozen=True, eq=False)
class Task:
    """Mechanisms to be fitted: from the best of some starts; `hoped` is the ln evidence that they should reach."""

    mechanisms: tuple[Mechanism, ...]
    starts: tuple[Array, ...]
    hoped: float


def fitted(
    model, tasks, tempers, about: Fit, most: float, expected: Learned, workers, afresh: bool = False, beaten: float = np.inf
) -> list[Hypothesis]:
    """All that can be built. None should cost more than `most`, and what costs more than is `beaten` need not end exactly."""
    if not tasks:
        return []
    found = in_parallel(partial(_fit_one, model, rated(model, about).rates, tuple(tempers), most, expected, afresh, min(most, beaten)), tasks, workers)
    return [h.with_mechanisms(task.mechanisms) for h, task in zip(found, tasks, strict=True) if h is not None]


def _fit_one(model: CampaignModel, rates, tempers, most: float, expected: Learned, afresh: bool, beaten: float, task: Task) -> Hypothesis | None:
    """A fit; with `afresh` from where a `scan` leads while errors are larger still, if that costs less. Once more with errors enlarged
    where it did not reach `most`, the cost of a model that it contains, or the evidence that screening `hoped` for: then it had stalled. Not
    beside a drawing that is off, to which enlarged errors would lead back."""
    mechanisms, starts = task.mechanisms, task.starts
    prior, wide = steady(expected, mechanisms), bool(wider_tolerances(expected))
    try:
        if afresh:
            before = TEMPERS[1 : TEMPERS.index(tempers[0])]
            starts = (*starts, fit(model, mechanisms, scan(model, mechanisms), rates, before, learned=prior).point)
        found = fit(model, mechanisms, starts, rates, tempers, learned=prior, beaten=beaten)
        reached = Hypothesis(found, evidence(model, found, wide=wide))
        if found.temper == 1.0 and not wide and (found.cost > most + LITTLE or reached.evidence.ln < task.hoped - LITTLE):
            again = fit(model, mechanisms, as_drawn(model, task.starts[0]), rates, TEMPERS[1:], learned=prior, beaten=beaten)
            if again.cost < found.cost:
                reached = Hypothesis(again, evidence(model, again))
        return None if reached.evidence.rounded else reached.light
    except FAILED:
        return None


def as_drawn(model: CampaignModel, point: Array) -> Array:
    """A parameter vector (n,) with nothing off its drawing, and its mechanisms as they are."""
    return np.concatenate([np.zeros(len(model.parameters)), point[len(model.parameters) :]])


def scan(model: CampaignModel, mechanisms: Sequence[Mechanism]) -> tuple[Array, ...]:
    """Starts with no tolerance off its drawing and one mechanism of a size, by its law in all tests:
    what moves peaks by many of their widths has no slope to follow from where it does not act."""
    problem = Problem(model, mechanisms)
    conditions = [d.condition for d in model.tests]
    scanned = [(k, m.size.neutral + s * m.size.prior_sd * shared(m, conditions), m.size.limits) for k, m in enumerate(mechanisms) for s in SCAN]
    return problem.start({}), *(problem.start({k: sizes}) for k, sizes, (low, high) in scanned if low <= sizes.min() and sizes.max() <= high)


def settled(model: CampaignModel, h: Hypothesis, best: float = -np.inf) -> Hypothesis:
    """Fitted anew with priors as wide as was learned, until that moves nothing: the quadratic then stands where the answer is. What
    is more than `PLENTY` behind the `best` ln evidence, and comes no nearer, need not stand there exactly, and is fitted anew once.

    It starts from its own answer, or from the fit where the model is no quadratic as far as that,
    without what was learned to be nothing. What ends with less evidence than the quadratic promised
    may have stalled on that way, whatever it costs at first, and is fitted from the other start too.
    """
    wide = h.widens
    for _ in range(REFITS):
        refit = partial(fit, model, h.mechanisms, rates=h.fit.rates, tempers=TEMPERS[-1:], learned=h.evidence.learned, moved=h.fit.moved)
        before = h.evidence
        try:
            problem = Problem(model, h.mechanisms, before.learned, h.fit.moved)
            near, far = sorted((before.mean, problem.within_prior(h.fit.point)), key=lambda at: problem.cost(at, TEMPERS[-1]))
            behind = best - PLENTY - before.ln
            promised = before.chi2 / before.learned.errors**2 + float(before.mean @ problem.precision @ before.mean)
            refit = partial(refit, beaten=promised - 2 * behind if behind > 0.0 else np.inf)
            found = refit(start=near)
            told = evidence(model, found, wide=wide)
            if told.ln < before.ln - LITTLE:
                found = min(found, refit(start=far), key=lambda f: f.cost)
                told = evidence(model, found, wide=wide)
        except FAILED:
            return h
        if told.rounded:
            return h
        h = Hypothesis(found, told)
        if (h.evidence.learned == before.learned and abs(h.evidence.ln - before.ln) < LITTLE) or h.evidence.ln < best - PLENTY:
            break
    return h


def offsets_of_drawing(model: CampaignModel, h: Hypothesis) -> frozenset[str]:
    """Of an explanation the free forms that say no more than that the drawing is off: of what has a build tolerance, by as much in every test."""
    return frozenset(m.name for m in h.mechanisms if m.free and m.name in model.numbers.tolerances and h.same_in_all)


def widened(model: CampaignModel, h: Hypothesis, least: float = -np.inf) -> Hypothesis:
    """With build tolerances wider than stated, where that is likelier, and promises the `least` ln evidence that counts:
    a drawing that is off."""
    if h.widens:  # of an explanation that was sought with them
        return h
    wide = evidence(model, h.fit, wide=True)
    if not wider_tolerances(wide.learned) or wide.ln < least:
        return h
    return max(h, settled(model, Hypothesis(h.fit, wide)), key=lambda h: h.evidence.ln)


def as_built(model: CampaignModel, none: Hypothesis) -> Hypothesis:
    """The model without effects with the build tolerances beside which effects are sought: `widened`, where that leaves no more than errors,
    and no mode that drifts. Else as stated, for tolerances that are wider would take what is missing before anything is found."""
    wide = widened(model, none)
    sizes = wide.evidence.learned.sizes
    explained = wide.evidence.learned.errors <= STRAIN and not any(sizes.get(kind, 0.0) > 0 for kind in DRIFTING)
    return wide if explained and wide.evidence.ln > none.evidence.ln + PLENTY else none
