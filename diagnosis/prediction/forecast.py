"""What an explanation predicts of a test that has not been made: its modes, and the errors that all of them share.

About a point p of an explanation's posterior, of covariance C, sizes at the new condition and shape parameters of its mechanisms are a = G
p, and have the covariance A = G C G^T + V, with V what laws leave open from one condition to another. Where a is off by d, all else that
was fitted is off with it, by C G^T A^-1 d, and about that has the covariance C - C G^T A^-1 G C (jointly Gaussian quantities: Rasmussen &
Williams, *Gaussian Processes*, 2006, Eq. A.6). With the first the modes are worked out anew; what the second does to them is linear.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermospindle.diagnosis.data.mode_table import ModeData
from thermospindle.diagnosis.forward.derivatives import nuisance_jacobian
from thermospindle.diagnosis.forward.model import FAILED, CampaignModel
from thermospindle.diagnosis.forward.rates import rates_of
from thermospindle.diagnosis.inference.hypothesis import LITTLE, Hypothesis, settled
from thermospindle.diagnosis.inference.problem import Problem
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.diagnosis.parameters.mechanism import size_covariance
from thermospindle.model.bearing.pair import IN_CONTACT
from thermospindle.model.errors import NoEquilibrium
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.modes import kinds
from thermospindle.model.rotor.poles import poles_below
from thermospindle.model.types import Array

READING = 5e-5  # relative error of a frequency read from a hammer test
LEAST = 1e-9  # of a prior variance: what is left open at least


@dataclass(frozen=True)
class ModePrediction:
    """Natural frequency (Hz) and damping ratio of a mode, with the standard deviation of the frequency;
    and what of that is `common` to all modes of the test: what one standard deviation of the thermometer,
    of the sizes, and of each independent part of all else that was fitted moves this one by (Hz)."""

    frequency: float
    sd: float
    damping: float
    common: tuple[float, ...] = ()


def covariance(predicted: Sequence[ModePrediction]) -> Array:
    """Covariance (k, k) of the frequencies of a test, Hz^2."""
    shared = np.array([m.common for m in predicted], float).reshape(len(predicted), -1)
    own = np.array([m.sd**2 for m in predicted]) - np.sum(shared**2, axis=1)
    return np.diag(own) + shared @ shared.T


@dataclass(frozen=True, eq=False)
class Standing:
    """An explanation and the parameters (n,) at which it is believed: there it costs what its evidence was told by."""

    hypothesis: Hypothesis
    point: Array


def standing(model: CampaignModel, h: Hypothesis, least: float = -np.inf) -> Standing:
    """At its posterior mean, which is the least of a quadratic; where the true chi2 there is none of that,
    fitted anew, and where it still is not, at that fit: there at once where its ln evidence is below `least`."""
    promised = _as_promised(model, h)
    if not promised and h.evidence.ln > least:
        h = settled(model, h)
        promised = _as_promised(model, h)
    return Standing(h, h.evidence.mean if promised else h.fit.point)


def _as_promised(model: CampaignModel, h: Hypothesis) -> bool:
    residuals = Problem(model, h.mechanisms).residuals(h.evidence.mean)
    return residuals is not None and sum(float(r @ r) for r in residuals) < h.evidence.chi2 + 2 * LITTLE * h.evidence.learned.errors**2


def forecast(model: CampaignModel, s: Standing, plan: Condition, rates: Array | None = None) -> list[ModePrediction] | None:
    """Modes in the band at a condition; None where no spindle can be built, or one that rattles, or
    `rates` (`by_all`) are of another number of modes.

    Errors: of each mode its own of reading, and of the drift from test to test that was learned;
    common to all, those of the thermometer, of sizes and of all else that was fitted.
    """
    h, problem = s.hypothesis, Problem(model, s.hypothesis.mechanisms)
    turn, left = _continued(model, h, problem, plan)
    amounts, limits = turn @ s.point, _limits(problem)
    half = turn @ h.evidence.covariance
    root = np.linalg.cholesky(half @ turn.T + np.diag(left))
    beside = np.linalg.solve(root, half)
    try:
        rates = by_all(model, s, plan) if rates is None else rates
        frequency, damping = _modes(model, problem, s.point, amounts, plan)
        moved = []
        for k, (with_it, own) in enumerate(zip(beside, root.T, strict=True)):
            sign = 1.0 if amounts[k] + own[k] <= limits[k] else -1.0
            moved.append(_modes(model, problem, s.point + sign * with_it, amounts + sign * own, plan)[0] - frequency)
    except FAILED:
        return None
    if any(len(m) != len(frequency) for m in (*moved, rates)):
        return None
    n = problem.nuisances
    rest = h.evidence.covariance[:n, :n] - beside[:, :n].T @ beside[:, :n]
    value, vector = np.linalg.eigh(rates[:, :-1] @ rest @ rates[:, :-1].T)
    shared = np.column_stack([rates[:, -1], *[m / frequency for m in moved], vector * np.sqrt(np.maximum(value, 0.0))])
    drift = h.evidence.learned.sizes.get(kinds_of.STIFFNESS_DRIFT, 0.0)
    sd = np.sqrt(READING**2 + drift**2 + np.sum(shared**2, axis=1))
    return [
        ModePrediction(float(f), float(f * e), float(z), tuple(float(f * v) for v in own))
        for f, e, z, own in zip(frequency, sd, damping, shared, strict=True)
    ]


def by_all(model: CampaignModel, s: Standing, plan: Condition) -> Array:
    """Derivatives (k, P + 1) of ln frequencies at a condition by all nuisance parameters, and by
    its thermometer; raises what the model raises."""
    problem = Problem(model, s.hypothesis.mechanisms)
    there = _unmade(model, plan)
    x, effects = _acting(there, problem, s.point, _continued(model, s.hypothesis, problem, plan)[0] @ s.point)
    linear = there.linear(0, x, effects)
    pole, shape = poles_below(linear.matrices, model.spindle.hammer.band[1], linear.between)
    k = len(pole)
    table = ModeData(model.tests[0].test, plan, np.abs(pole) / (2 * np.pi), np.ones(k), np.ones(k), np.full(k, np.inf), kinds(linear.matrices, shape))
    there = replace(there, tests=(table,))
    _, by = nuisance_jacobian(there, 0, x, effects, rates_of(there, x, [effects], s.hypothesis.fit.rates))
    rates = np.zeros((k, len(x) + 1))
    lasting = np.array([there.parameters[i].test is None for i in by.numbers])
    rates[:, by.numbers[lasting]] = by.whole[lasting].T
    rates[:, -1] = by.whole[by.numbers == there.numbers.temperature[0]][0]
    return rates


def _unmade(model: CampaignModel, plan: Condition) -> CampaignModel:
    """The model with the test to be made for its first and only one."""
    nothing = np.zeros(0)
    return replace(model, tests=(ModeData(model.tests[0].test, plan, nothing, nothing, nothing, nothing, ()),), scenes=model.scenes[:1])


def _acting(there: CampaignModel, problem: Problem, p: Array, amounts: Array) -> tuple[Array, list]:
    """Nuisance values (P,) of parameters `p` (n,), without those of any one test, and the effects
    in the one to be made, of `amounts` (`_continued`)."""
    x, at, effects = p[: problem.nuisances], 0, []
    for m in problem.mechanisms:
        shape = [float(np.clip(q.neutral + q.prior_sd * v, *q.limits)) for q, v in zip(m.shape, amounts[at + 1 :], strict=False)]
        effects.append((m.effect, m.values(float(m.size.neutral + m.size.prior_sd * amounts[at]), shape)))
        at += 1 + len(shape)
    return np.where([q.test is not None for q in there.parameters], 0.0, x), effects


def _continued(model: CampaignModel, h: Hypothesis, problem: Problem, plan: Condition) -> tuple[Array, Array]:
    """Of every mechanism the size at another condition, by the prior that was learned for its law, and the shape parameters, less the
    neutral ones and in prior standard deviations: derivatives (a, n) by all parameters, and the variances (a,) that laws leave open."""
    conditions, n, at, learned = [*(d.condition for d in model.tests), plan], len(model.tests), problem.nuisances, h.evidence.learned
    rows, left = [np.zeros((0, problem.length))], []
    for m, root, own in zip(h.mechanisms, problem.roots, learned.own, strict=True):
        prior = size_covariance(conditions, *own, m.reference)
        weights = np.linalg.solve(prior[:n, :n], prior[:n, n])
        row = np.zeros((1 + len(m.shape), problem.length))
        row[0, at : at + n] = weights @ root / m.size.prior_sd
        row[1:, at + n : at + n + len(m.shape)] = np.eye(len(m.shape))
        rows.append(row)
        left += [max(float(prior[n, n] - weights @ prior[:n, n]), LEAST), *[LEAST] * len(m.shape)]
        at += n + len(m.shape)
    return np.concatenate(rows), np.array(left)


def _limits(problem: Problem) -> list[float]:
    """The upper limits (a,) of what is continued."""
    return [(q.limits[1] - q.neutral) / q.prior_sd for m in problem.mechanisms for q in (m.size, *m.shape)]


def _modes(model: CampaignModel, problem: Problem, p: Array, amounts: Array, plan: Condition) -> tuple[Array, Array]:
    """Frequencies (k,) and damping ratios (k,) in the band."""
    there = _unmade(model, plan)
    x, effects = _acting(there, problem, p, amounts)
    point = there.operating(0, x, effects)
    if (status := point.state.status) != IN_CONTACT:  # a spindle that rattles has no modes to be read
        raise NoEquilibrium(status)
    linear = there.linear(0, x, effects)
    pole, _ = poles_below(linear.matrices, model.spindle.hammer.band[1], linear.between)
    return np.abs(pole) / (2 * np.pi), -pole.real / np.abs(pole)
