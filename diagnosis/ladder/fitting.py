"""Fits of the ladder: a model beside all tests, and beside all but a part of them
(`diagnosis.ladder.left_out`), which it then has to predict.

Both are fitted afresh, from the drawing and with errors enlarged at first, so that nothing of a test left out is in the fit that predicts
it. Unlike in `diagnose`, no mode may drift freely from test to test: what drifts is what the steps of the ladder are to explain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from thermospindle.diagnosis.forward.model import FAILED, CampaignModel
from thermospindle.diagnosis.inference.evidence import Evidence, evidence
from thermospindle.diagnosis.inference.fit import TEMPERS, Fit, fit
from thermospindle.diagnosis.inference.prior import Learned, as_stated, precision_and_variances
from thermospindle.diagnosis.inference.problem import Problem
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.diagnosis.parameters.mechanism import Mechanism, one_size, variants
from thermospindle.diagnosis.parameters.sizes import GRIDS, ODDS
from thermospindle.model.errors import NoEquilibrium
from thermospindle.model.types import Array
from thermospindle.sim.effects.effect import Effect, Values

CONSTANT = (kinds_of.STIFFNESS, kinds_of.DAMPING)
BEGINNING = 2  # of the tempers, after which one variant and start of an effect is followed
FEW = 4  # variants of an effect up to which each is also begun at its typical size
STALLED = 1.0  # of the cost above that of the step below, whose model is part of this one
HOLDS = 1.5  # times the chi2 that the quadratic promises, up to which it is believed where the fit did not stand itself


def without(model: CampaignModel, kinds: Sequence[str]) -> CampaignModel:
    """The model without nuisance parameters of some kinds."""
    return replace(model, parameters=tuple(p for p in model.parameters if p.kind not in kinds))


@dataclass(frozen=True, eq=False)
class Settled:
    """A fit with every discrepancy at the size that the data ask for, as `learned`; `first` is the
    fit at the reference sizes from which it went on."""

    model: CampaignModel
    fit: Fit
    evidence: Evidence
    first: Fit
    learned: Learned

    @property
    def mechanisms(self) -> tuple[Mechanism, ...]:
        return self.fit.mechanisms

    @property
    def nuisance(self) -> Array:
        return self.fit.nuisance

    @cached_property
    def covariance(self) -> Array:
        """Posterior covariance (n, n) of all parameters of the fit."""
        return np.asarray(np.linalg.inv(self.fit.information + self._precision), float)

    @cached_property
    def _precision(self) -> Array:
        return precision_and_variances(self.model, self.mechanisms, self.learned, self.fit.moved)[0]

    @cached_property
    def posterior(self) -> tuple[Array, Array]:
        """Mean (n,) and covariance (n, n) of all parameters, with the width and the departure from
        its law that were learned of every effect.

        These move the mean away from where the fit stands; where the quadratic of an effect does not
        hold so far, or no spindle can be built there, the fit itself is taken, with its wider priors.
        """
        there = Problem(self.model, self.mechanisms).residuals(self.evidence.mean)
        if there is None or (self.mechanisms and sum(float(r @ r) for r in there) > HOLDS * self.evidence.chi2):
            return self.fit.point, self.covariance
        return self.evidence.mean, self.evidence.covariance

    def applied(self, t: int) -> list[tuple[Effect, Values]]:
        """The effects as fitted to test `t`."""
        problem = Problem(self.model, self.mechanisms)
        _, sizes, shapes = problem.parts(self.fit.point)
        return problem.acting(problem.applied(t, sizes, shapes))

    def determined(self) -> float:
        """How many combinations of parameters the data, not the priors, decide: trace of the resolution matrix, at most the data's number."""
        return float(len(self.fit.point) - np.sum(self.covariance * self._precision))

    def values(self) -> dict[str, dict[str, tuple[float, float]]]:
        """Every effect's parameters with standard errors; its size is the mean over the tests, weighted by what they tell."""
        mean, spread = self.posterior
        _, sizes, shapes = Problem(self.model, self.mechanisms).parts(mean)
        found: dict[str, dict[str, tuple[float, float]]] = {}
        at = len(self.nuisance)
        for m, root, own, shape in zip(self.mechanisms, self.fit.roots, sizes, shapes, strict=True):
            part = slice(at, at + len(root))
            row = {m.size.name: one_size(m, root, own, root @ spread[part, part] @ root.T)}
            row |= {name: (v, 0.0) for name, v in m.choices.items()}
            at += len(root)
            errors = np.sqrt(np.maximum(np.diag(spread)[at : at + len(m.shape)], 0.0))
            row |= {p.name: (float(v), float(e * p.prior_sd)) for p, v, e in zip(m.shape, shape, errors, strict=True)}
            found[m.name] = {p.name: row[p.name] for p in m.effect.parameters if p.name in row}
            at += len(m.shape)
        return found


def settled(model: CampaignModel, below: Settled | None = None, effects: Sequence[Effect] = ()) -> Settled:
    """The model fitted with `effects` beside those of the step `below`, in the variant that suits the data best.

    Raises `NoEquilibrium` where no start has a spindle.
    """
    present = below.mechanisms if below else ()
    added = [variants(e) for e in effects]
    choices = [(*present, *row) for row in product(*added)]
    both = len(choices) <= FEW
    begun = [f for c in choices for p in _starts(model, c, len(present), both) if (f := _tried(model, c, p)) is not None]
    if not begun:
        raise NoEquilibrium(f"no spindle can be built with {' and '.join(e.name for e in effects) or 'these tolerances'}")
    best = max(begun, key=lambda f: evidence(model, f).ln) if len(begun) > 1 else begun[0]
    found = fit(model, best.mechanisms, best.point, best.rates, TEMPERS[BEGINNING:])
    if below and len(below.first.nuisance) == len(found.nuisance) and _cost(found) > _cost(below.first) + STALLED:
        more = np.zeros(len(found.point) - len(below.first.point))
        again = fit(model, found.mechanisms, np.concatenate([below.first.point, more]), below.first.rates, TEMPERS[-1:])
        found = min(found, again, key=_cost)
    return _at_learned(model, found)


def _starts(model: CampaignModel, mechanisms: Sequence[Mechanism], present: int, both: bool) -> list[Array]:
    """The drawing with new mechanisms at no size, and at their typical one in all tests."""
    problem = Problem(model, mechanisms)
    typical = problem.start({k: m.size.typical for k, m in enumerate(mechanisms) if k >= present})
    return [problem.start({}), typical] if both and typical.any() else [problem.start({})]


def _tried(model: CampaignModel, mechanisms: Sequence[Mechanism], start: Array) -> Fit | None:
    try:
        return fit(model, mechanisms, start, tempers=TEMPERS[:BEGINNING])
    except FAILED:
        return None


def _cost(found: Fit) -> float:
    return found.chi2 + float(found.point @ found.point)


def _at_learned(model: CampaignModel, first: Fit) -> Settled:
    """The fit gone on with every discrepancy at the size that makes the data likeliest, instead of
    the reference size; errors and tolerances are as stated.

    Far from the reference the quadratic about the fit is not to be trusted: a model that misses frequencies by a hundredth shifts peaks
    by more than their width.
    """
    kinds = [kind for kind in GRIDS if kind not in ODDS]
    learned = as_stated(evidence(model, first, learning=kinds).learned.sizes, first.mechanisms)
    found = fit(model, first.mechanisms, first.point, tempers=TEMPERS[-2:], learned=learned, moved=first.moved)
    return Settled(model, found, evidence(model, found, [learned]), first, learned)
