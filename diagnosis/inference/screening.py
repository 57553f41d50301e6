"""What a mechanism promises beside a model that is fitted already: linear, from the derivative by its sizes alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from thermospindle.diagnosis.forward.model import FAILED, CampaignModel
from thermospindle.diagnosis.inference.evidence import evidence, integrated
from thermospindle.diagnosis.inference.fit import Fit, rated
from thermospindle.diagnosis.inference.gaussian import Nuisances, impossible
from thermospindle.diagnosis.inference.prior import Learned, as_stated
from thermospindle.diagnosis.inference.problem import Linearisation, Problem
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.diagnosis.parameters.mechanism import Mechanism
from thermospindle.diagnosis.parameters.sizes import GRIDS
from thermospindle.model.parallel import in_parallel
from thermospindle.model.types import Array, Integers
from thermospindle.sim.effects.effect import HOOKS

SEEN = tuple(hook for hook in HOOKS if hook != "imperfections")
"""What of an effect a hammer test can see: imperfections show in the runout alone."""
SMALLER = 2  # steps by which constant discrepancies may be smaller with a mechanism
TURN = 2.0  # prior standard deviations, by which each shape parameter is moved in turn


@dataclass(frozen=True)
class Screened:
    """What screening promises of a mechanism: ln evidence it would gain, and where a fit should start (all parameters, as a fit has them)."""

    mechanism: Mechanism
    gain: float
    start: Array
    visibility: float  # standard errors by which its typical size shows, beside what nuisances can do
    possible: bool = True  # whether it would have sizes that it can have


@dataclass(frozen=True, eq=False)
class _Beside:
    """What is fitted already, its discrepancies and errors of the sizes learned: its information and the prior's
    precision (n, n) as factors, and the ln evidence; and its nuisances at these sizes and at others `near` them."""

    model: CampaignModel
    about: Fit
    sizes: Learned
    factors: tuple[Array, bool]
    ln: float
    near: tuple[Learned, ...]
    kept: tuple[Nuisances, ...]


def screen(
    model: CampaignModel, about: Fit, temper: float, learned: Learned, mechanisms: Sequence[Mechanism], workers: int | None = None
) -> list[Screened]:
    """Every one of `mechanisms` beside the model `about`, its errors 1 / `temper` times the data's and sizes of
    discrepancies as `learned`, or smaller; and the best of each name, and kind of law, once more with its shape `turned`."""
    about = replace(rated(model, about), temper=temper)
    sizes = Learned(learned.sizes, learned.errors if temper == 1.0 else 1.0)
    prior = Problem(model, about.mechanisms, replace(as_stated(learned.sizes, about.mechanisms), errors=sizes.errors), about.moved)
    at = linearised(model, about)  # where a fit has not arrived its own derivatives are of an earlier point
    here, near = replace(about, chi2=at.chi2, gradient=at.gradient, information=at.information, by_test=()), (sizes, *smaller(sizes))
    kept = tuple(integrated(model, here, n.errors, n.sizes) for n in near)
    beside = _Beside(model, about, sizes, cho_factor(at.information + prior.precision), evidence(model, here, near, kept=kept).ln, near, kept)
    found = in_parallel(partial(_screened, beside), list(mechanisms), workers)
    found = [replace(s, mechanism=m) for s, m in zip(found, mechanisms, strict=True)]
    best = {(s.mechanism.name, s.mechanism.kind): s for s in sorted(found, key=lambda s: s.gain) if s.visibility > 0 and s.mechanism.shape}
    others = in_parallel(partial(_turned, beside), list(best.values()), workers)
    return found + [replace(s, mechanism=drawn.mechanism) for s, drawn in zip(others, best.values(), strict=True)]


def linearised(model: CampaignModel, about: Fit) -> Linearisation:
    """The model `about`, taken anew at its own lines; the last one asked for is kept with the model."""
    key = about.point.tobytes(), tuple(m.variant for m in about.mechanisms), about.held
    if key not in model.kept:
        model.kept.clear()
        rates = rated(model, about).rates
        assert rates is not None
        model.kept[key] = Problem(model, about.mechanisms).linearisation(about.point, rates, np.array([h.number for h in about.held], int))
    return model.kept[key]


def _screened(beside: _Beside, mechanism: Mechanism) -> Screened:
    problem, fitted = Problem(beside.model, [*beside.about.mechanisms, mechanism]), beside.about.point
    if any(getattr(mechanism.effect, hook) for hook in SEEN):
        return _promised(problem, beside, np.zeros(len(mechanism.shape)))
    return Screened(mechanism, -np.inf, np.concatenate([fitted, np.zeros(problem.length - len(fitted))]), 0.0)


def _turned(beside: _Beside, drawn: Screened) -> Screened:
    """The best that a mechanism promises with its shape parameters moved in turn: what a disk on
    the hub would not do, one within the hub may."""
    mechanism = drawn.mechanism
    problem, shape, best = Problem(beside.model, [*beside.about.mechanisms, mechanism]), np.zeros(len(mechanism.shape)), drawn
    for k, q in enumerate(mechanism.shape):
        ends = np.clip(q.neutral + TURN * q.prior_sd * np.array([-1.0, 1.0]), *q.limits)
        for turn in (ends - q.neutral) / q.prior_sd:
            if turn:
                tried = _promised(problem, beside, np.where(np.arange(len(shape)) == k, turn, shape))
                best = tried if tried.gain > best.gain else best
        shape = best.start[problem.length - len(shape) :]
    return replace(best, visibility=drawn.visibility)


def visibilities(model: CampaignModel, about: Fit, learned: Learned, mechanisms: Sequence[Mechanism]) -> list[float]:
    """Standard errors by which the typical size of each of `mechanisms` shows beside the model
    `about`, its discrepancies and errors of the sizes `learned`."""
    prior = Problem(model, about.mechanisms, replace(as_stated(learned.sizes, about.mechanisms), errors=learned.errors), about.moved)
    factors = cho_factor(linearised(model, about).information + prior.precision)
    return [_visibility(_by_size(Problem(model, [*about.mechanisms, m]), about, np.zeros(len(m.shape)))[1], m, factors, learned.errors) for m in mechanisms]


def _by_size(problem: Problem, about: Fit, shape: Array) -> tuple[Array, list[tuple[Array, Integers, float, float]]]:
    """The parameters (n,) of the fitted model with the last mechanism at no size beside, its `shape`
    parameters so many prior standard deviations from neutral; and of every test what that mechanism's size
    does there: its derivatives' products with all others' (first,), with themselves and with the residuals."""
    at, k, first = linearised(problem.model, about), len(about.mechanisms), len(about.point)
    p = np.concatenate([about.point, np.zeros(problem.length - first)])
    p[problem.length - len(shape) :] = shape
    x, own_sizes, shapes = problem.parts(p)
    rows = []
    for t, (residual, derivatives) in enumerate(at.rows):
        try:
            column = problem.by_size(t, x, problem.applied(t, own_sizes, shapes), k)
        except FAILED:
            column = np.zeros(len(residual))
        rows.append((derivatives.products(column), derivatives.numbers, float(column @ column), float(column @ residual)))
    return p, rows


def _visibility(rows: Sequence[tuple[Array, Integers, float, float]], mechanism: Mechanism, factors: tuple[Array, bool], errors: float) -> float:
    """Standard errors by which the typical size of a mechanism, one in all tests, shows beside all
    else, of which the information with the prior's has these `factors`."""
    typical, square = np.zeros(len(factors[0])), 0.0
    for cross, numbers, of_test, _ in rows:
        typical[numbers] += cross
        square += of_test
    left = square - float(typical @ cho_solve(factors, typical))
    return float(abs(mechanism.size.typical - mechanism.size.neutral) * np.sqrt(max(left, 0.0))) / errors


def _promised(problem: Problem, beside: _Beside, shape: Array) -> Screened:
    """The quadratic of the fitted model, with the sizes of the last mechanism beside its parameters;
    its `shape` parameters stay where they are, in prior standard deviations from neutral."""
    model, about, mechanism, first = beside.model, beside.about, problem.mechanisms[-1], len(beside.about.point)
    p, rows = _by_size(problem, about, shape)
    visibility = _visibility(rows, mechanism, beside.factors, beside.sizes.errors)
    if visibility == 0.0:
        return Screened(mechanism, -np.inf, p, 0.0)
    _, own_sizes, shapes = problem.parts(p)
    at = linearised(model, about)
    gradient, information = np.zeros(problem.length), np.zeros((problem.length, problem.length))
    gradient[:first], information[:first, :first] = at.gradient, at.information
    for t, (cross, numbers, square, slope) in enumerate(rows):
        weights, own = problem.roots[-1][t, : t + 1], slice(first, first + t + 1)
        gradient[own] += weights * slope
        information[numbers, own] += np.outer(cross, weights)
        information[own, own] += np.outer(weights, weights) * square
    information[first:, :first] = information[:first, first:].T
    whole = replace(
        about, mechanisms=problem.mechanisms, point=p, sizes=own_sizes, shapes=tuple(tuple(float(v) for v in s) for s in shapes),
        roots=problem.roots, chi2=at.chi2, gradient=gradient, information=information, by_test=(),
    )  # fmt: skip
    found = evidence(model, whole, beside.near, kept=beside.kept)
    start = found.mean
    start[problem.length - len(shape) :] = shape
    possible = not impossible(mechanism, found.sizes[-1], found.size_covariance[-1])
    return Screened(mechanism, found.ln - beside.ln - float(shape @ shape) / 2, start, visibility, possible)


def smaller(learned: Learned) -> list[Learned]:
    """With smaller constant discrepancies: what is missing in every test alike has made them as large as they are."""
    grid = GRIDS[kinds_of.STIFFNESS]
    below = [size for size in grid if 0.0 < size < learned.sizes.get(kinds_of.STIFFNESS, 0.0)]
    return [replace(learned, sizes={**learned.sizes, kinds_of.STIFFNESS: size}) for size in below[-SMALLER:]]
