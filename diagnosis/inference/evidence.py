"""The evidence of a fitted model, with everything of unknown size learned: Laplace's quadratic, and priors as Gaussians over a grid.

About the fit chi2 is a quadratic in all parameters p: c - 2 b p + p A p. For priors N(0, Pi) and errors s times those stated,

    ln Z(Pi, s) = -c / 2 s^2 + b (A / s^2 + Pi^-1)^-1 b / 2 s^4 - ln det(1 + Pi A / s^2) / 2 - n ln s,

(MacKay, *Neural Computation* 4 (1992) 415, Eq. 2.6). Sizes learned so, each over a short grid: of the model's
constant and drifting discrepancies in stiffness and damping, of gain drift (these also between its places), of
build tolerances, all or one, and of the errors s (at their likeliest: empirical Bayes), and of every mechanism its width
and its departure from its law (the mean over the grid). What is quoted is the posterior at the best place.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache, partial, reduce
from itertools import zip_longest

import numpy as np
from scipy.sparse import csr_array
from scipy.special import logsumexp

from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.inference.fit import Fit
from thermospindle.diagnosis.inference.gaussian import (
    Nuisances,
    Quadratic,
    ln_integral,
    ln_within_limits,
    marginal,
    one_sided,
    posterior,
    quadratic,
    under,
)
from thermospindle.diagnosis.inference.prior import Learned, Own, counted_in, mechanism_root, nuisance_root, whitened_covariance
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.diagnosis.parameters.mechanism import Mechanism
from thermospindle.diagnosis.parameters.sizes import GRIDS, likeliest, ln_odds, with_wider_tolerances
from thermospindle.model.machine import Condition
from thermospindle.model.types import Array
from thermospindle.sim.effects.effect import Effect

WIDTHS = (0.5, 1.0, 2.0, 4.0)  # of a size, in its own prior standard deviations
DEPARTURES = (0.0, 0.1, 0.3, 1.0)  # from a law, of the size
FREE_WIDTHS = (0.1, 0.3, 1.0, 3.0, 10.0)  # of what has no law: its width is to be learned
OFFSET = -12.0
"""Prior odds (ln) that what drifts is off by as much in all tests as well: that is a drawing that
is off (`WIDER`), and not what temperature and speed do."""
FARTHEST = 3.0  # times what a shape parameter does at the fitted size of a test, of what it does at the size that all share
ROUNDED = 1.0  # of chi2, which is never negative: what rounding may take from a quadratic that stands for a fit


@dataclass(frozen=True, eq=False)
class Evidence:
    """ln evidence; what was learned; posterior mean (n,) and covariance (n, n) of all parameters, and of the sizes of
    every mechanism in every test: mean (mechanisms, tests) and covariance (mechanisms, tests, tests), in their units,
    and the covariance `as_shaped`, with shape parameters as they are. `by_departing` is what of the ln evidence the
    mechanisms with a law gain by departing from it, and `as_fitted` ln of the probability of the data with the
    mechanisms' parameters at their mean, nuisances integrated: ln evidence without the price of these parameters
    (Besag, *J. R. Statist. Soc. B* 51 (1989) 579: p(data) = p(data | theta) p(theta) / p(theta | data), at any theta)."""

    ln: float
    learned: Learned
    mean: Array
    covariance: Array
    sizes: Array
    size_covariance: Array
    as_shaped: Array
    chi2: float
    as_fitted: float
    by_departing: float = 0.0

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.ln:.1f}: chi2 {self.chi2:.6g}>"

    @property
    def rounded(self) -> bool:
        """Whether the fit stands so far from where its quadratic is least that nothing but rounding
        is left of that, and the evidence means nothing."""
        return self.chi2 < -ROUNDED


def evidence(
    model: CampaignModel, fit: Fit, near: Sequence[Learned] = (), wide: bool = False, kept: Sequence[Nuisances] = (), learning: Sequence[str] | None = None
) -> Evidence:
    """The evidence of a fit at its own temper (its errors are 1 / temper times the data's); with `near` the sizes of
    discrepancies, drift and errors are taken from the best of these, which is quick, and quicker with the nuisances `kept` of
    each (`integrated`). Build tolerances are as stated, or with `wide` as much wider as is likeliest, all of them or each by itself; with `learning` the sizes
    of these kinds alone are learned, and errors are as stated. What a fit with the data's own errors still owes is not counted."""
    turn = amplitudes_apart(fit)
    by_test, gradient, information = at_one_size(fit), fit.gradient, fit.information
    if by_test is not fit.by_test:
        gradient, information = np.sum([g for _, g, _ in by_test], axis=0), np.sum([a for *_, a in by_test], axis=0)
    whole = turned(turn, fit.chi2, gradient, information, fit.point)
    t2 = fit.temper**2
    whole = Quadratic(t2 * whole.constant, t2 * whole.b, t2 * whole.a)
    p = len(fit.nuisance)
    kinds = {q.kind for q in model.parameters}
    kinds |= {kinds_of.OF_CONDITIONS} if fit.moved.any() else set()
    kinds |= {kinds_of.ACTION} if fit.moved[1:].any() else set()
    grids = {kind: grid for kind, grid in GRIDS.items() if kind in kinds}
    grids = grids if learning is None else {kind: GRIDS[kind] for kind in learning if kind in kinds}
    own_grids = [own_grid(m) for m in fit.mechanisms]
    conditions = tuple(d.condition for d in model.tests)
    roots = [_roots(conditions, m.reference, counted_in(m), tuple(grid), len(m.shape)) for m, grid in zip(fit.mechanisms, own_grids, strict=True)]
    odds = np.asarray(reduce(np.add.outer, [np.array(list(grid.values())) for grid in own_grids], np.array(0.0))).ravel()

    @cache
    def scaled(s: float) -> Quadratic:
        return Quadratic(whole.constant / s**2, whole.b / s**2, whole.a / s**2)

    @cache
    def of_nuisances(s: float) -> Array:
        return np.ascontiguousarray(scaled(s).a[:p, :p])

    def beside(s: float, sizes: Mapping[str, float]) -> Nuisances:
        return under(nuisance_root(model, sizes, fit.moved), of_nuisances(s))

    def each(s: float, sizes: Mapping[str, float], nuisances: Nuisances | None = None) -> Array:
        """ln evidence of every combination of widths, departures and offsets of the mechanisms, by its prior odds."""
        nuisances = nuisances or beside(s, sizes)
        return marginal(scaled(s), nuisances).integrated(roots) + odds - fit.count * np.log(s) + ln_odds(sizes)

    def at_best(values: Array, sizes: Mapping[str, float], s: float) -> Learned:
        """What was learned, with mechanisms as wide as is likeliest."""
        best = np.unravel_index(int(np.argmax(values)), [len(grid) for grid in own_grids]) if own_grids else ()
        return Learned(sizes, s, *(tuple(of) for of in zip(*[tuple(grid)[k] for grid, k in zip(own_grids, best, strict=True)], strict=True)))

    def told_of(numbers: Sequence[int], s: float, sizes: Mapping[str, float]) -> tuple[Array, Array]:
        """Posterior mean and variance of some nuisances beside sizes learned."""
        nuisances = beside(s, sizes)
        mean, spread, _ = posterior(scaled(s), nuisances, mechanism_root(model, fit.mechanisms, at_best(each(s, sizes, nuisances), sizes, s)))
        return mean[numbers], np.diag(spread)[numbers]

    nuisances = None
    if near:
        every = [(each(n.errors, n.sizes, own), n.errors, dict(n.sizes), own) for n, own in zip_longest(near, kept)]
        values, s, sizes, nuisances = max(every, key=lambda row: np.logaddexp.reduce(row[0]))
    else:
        scales = [1.0] if fit.temper < 1.0 or learning is not None else [float(s) for s in _error_scales(whole, fit.count)]
        if wide:
            tolerances = model.numbers.tolerances
            values, s, sizes = with_wider_tolerances(each, grids, scales, tuple(tolerances), partial(told_of, list(tolerances.values())))
        else:
            values, s, sizes = likeliest(each, grids, scales)
    learned = at_best(values, sizes, s)
    own = learned.own
    nuisances = nuisances or beside(s, sizes)
    mean, spread, left = posterior(scaled(s), nuisances, mechanism_root(model, fit.mechanisms, learned))
    chi2 = whole.at(mean)
    held = [h.number for h in fit.held]
    own_mean = np.where(np.isin(np.arange(p, len(mean)), held), fit.point[p:], mean[p:])
    owed = fit.owed / (2 * s**2) if fit.temper == 1.0 else 0.0
    as_fitted = left.at(own_mean) - fit.count * np.log(s) + ln_odds(sizes) - owed
    mean, spread = fit.point + turn @ (mean - fit.point), turn @ spread @ turn.T
    truncation = ln_within_limits(fit, mean, spread, s)
    mean[held] = fit.point[held]
    at, means, covariances, as_shaped = p, [], [], []
    tests = len(model.tests)
    for m, root, widths in zip(fit.mechanisms, fit.roots, own, strict=True):
        part, shape = slice(at, at + tests), slice(at + tests, at + tests + len(m.shape))
        means.append(m.size.neutral + root @ mean[part])
        covariances.append(root @ spread[part, part] @ root.T)
        told = spread[part, part] - spread[part, shape] @ np.linalg.pinv(spread[shape, shape], hermitian=True) @ spread[shape, part]
        as_shaped.append(root @ told @ root.T)
        truncation += one_sided(model, m, widths, means[-1], as_shaped[-1])
        at = shape.stop
    by_law = [np.array([d == 0.0 or m.kind != "law" for _, d, _ in grid]) for m, grid in zip(fit.mechanisms, own_grids, strict=True)]
    lawful = reduce(np.multiply.outer, by_law, np.array(True)).ravel()
    by_departing = logsumexp(values) - logsumexp(values[lawful]) + logsumexp(odds[lawful])
    told = np.array(means).reshape(len(means), tests), _stacked(covariances, tests), _stacked(as_shaped, tests)
    return Evidence(float(logsumexp(values)) + truncation - owed, learned, mean, spread, *told, chi2, as_fitted, by_departing)


def _stacked(covariances: Sequence[Array], tests: int) -> Array:
    return np.array(covariances).reshape(len(covariances), tests, tests)


def integrated(model: CampaignModel, fit: Fit, errors: float, sizes: Mapping[str, float]) -> Nuisances:
    """The nuisances of a fit at its own temper, of `errors` times those stated, under priors of `sizes` learned."""
    p = len(model.parameters)
    return under(nuisance_root(model, sizes, fit.moved), (fit.temper / errors) ** 2 * fit.information[:p, :p])


def amplitudes_apart(fit: Fit) -> csr_array:
    """Coordinates (n, n) of the quadratic about a fit in which a shape parameter of a mechanism
    with a law of the data's own changes what the mechanism does and not how much of it.

    What a shape parameter moves at the fitted sizes is in proportion to these: to a quadratic it could
    stand in for them, and for their law over the tests, which of its own it has not. So with each, the
    size in every test gives way by what it would change of the amount: sizes' part of its column.
    """
    every, at = np.arange(len(fit.point)), len(fit.nuisance)
    rows, columns = [every], [every]
    values: list[Array] = [np.ones(len(every))]
    for m, root in zip(fit.mechanisms, fit.roots, strict=True):
        tests, shapes = len(root), slice(at + len(root), at + len(root) + len(m.shape))
        if m.own_law and m.shape:
            amounts = np.zeros((tests, len(m.shape)))
            for t, (_, _, information) in enumerate(fit.by_test):
                own = information[at + t, at + t]
                if own > 0:
                    amounts[t] = root[t, t] * information[at + t, shapes] / own
            rows.append(np.repeat(every[at : at + tests], len(m.shape)))
            columns.append(np.tile(every[shapes], tests))
            values.append(np.asarray(-np.linalg.solve(root, amounts).ravel(), float))
        at = shapes.stop
    return csr_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), (len(every),) * 2)


def at_one_size(fit: Fit) -> Sequence[tuple[float, Array, Array]]:
    """chi2, gradient (n,) and information (n, n) of every test about a fit, in which a shape parameter of
    a mechanism that has a law does in every test what it does at one size, the likeliest that all share.

    At the fitted sizes it moves each test in proportion to its own. Where these depart from the law, so that one test has
    nearly all of it, a shape parameter would move that test alone, and to a quadratic a law that holds could explain it.
    """
    if not fit.by_test or not any(m.kind == "law" and m.shape for m in fit.mechanisms):
        return fit.by_test
    scales, at = np.ones((len(fit.by_test), len(fit.point))), len(fit.nuisance)
    for m, root, sizes in zip(fit.mechanisms, fit.roots, fit.sizes, strict=True):
        tests, amounts = len(root), sizes - m.size.neutral
        if m.shape and m.kind == "law":
            own = np.array([b[2][at + t, at + t] / root[t, t] ** 2 for t, b in enumerate(fit.by_test)])
            shared = float(own @ amounts / own.sum()) if own.sum() > 0 else 0.0
            known = np.where(amounts == 0.0, 1.0, amounts)
            scales[:, at + tests : at + tests + len(m.shape)] = np.clip(np.where(amounts == 0.0, 1.0, shared / known), -FARTHEST, FARTHEST)[:, None]
        at += tests + len(m.shape)
    return [(chi2, s * g, s[:, None] * a * s) for s, (chi2, g, a) in zip(scales, fit.by_test, strict=True)]


def turned(turn: csr_array, chi2: float, gradient: Array, information: Array, point: Array) -> Quadratic:
    """A quadratic about a point in other coordinates about it."""
    return quadratic(chi2, turn.T @ gradient, turn.T @ information @ turn, point)


def _error_scales(whole: Quadratic, count: int) -> Array:
    """1, and above it places around the root of the least chi2 a number: errors are never taken smaller than stated."""
    least = whole.constant - whole.b @ np.linalg.lstsq(whole.a + 1e-9 * np.eye(len(whole.b)), whole.b, rcond=None)[0]
    centre = np.sqrt(max(float(least) / count, 0.0))
    return np.array([1.0]) if centre < 1.02 else np.unique(np.concatenate([[1.0], np.maximum(centre * np.array([0.95, 1.0, 1.05, 1.2]), 1.0)]))


def _departures(effect: Effect) -> tuple[float, ...]:
    """From its law, of the size of an effect."""
    return DEPARTURES[:1] if effect.lasting else DEPARTURES[:2] if effect.exact else DEPARTURES


def own_grid(m: Mechanism) -> dict[Own, float]:
    """Width, departure and offset that a mechanism may have, with the ln of their prior odds, which add
    up to one. What grows from a reference has an offset there only where nothing but its element is told."""
    offsets = {1.0: 0.0} if m.reference is None else {0.0: 0.0, 1.0: OFFSET} if m.free else {0.0: 0.0}
    found = {(w, d, o): ln for w in (WIDTHS if m.kind == "law" else FREE_WIDTHS) for d in _departures(m.effect) for o, ln in offsets.items()}
    whole = float(logsumexp(list(found.values())))
    return {own: ln - whole for own, ln in found.items()}


@lru_cache(maxsize=64)
def _roots(conditions: tuple[Condition, ...], reference: Condition | None, counted: Own, grid: tuple[Own, ...], shapes: int) -> Array:
    """Roots (g, m, m) of the prior covariance of one mechanism's [z, u] at every place of its grid."""
    m = len(conditions) + shapes
    found = np.tile(np.eye(m), (len(grid), 1, 1))
    found[:, : len(conditions), : len(conditions)] = [whitened_covariance(conditions, reference, counted, own) for own in grid]
    return np.asarray(np.linalg.cholesky(found + 1e-12 * np.eye(m)), float)


def left_out(model: CampaignModel, fit: Fit, found: Evidence, groups: Sequence[Sequence[int]]) -> tuple[float, float]:
    """Of groups of tests predicted each from all others, with what was learned from all: root mean square residual,
    in standard errors of the data, and the sum of ln of their probability densities, which knows how sure a
    prediction is (Geisser & Eddy, *J. Am. Statist. Assoc.* 74 (1979) 153). Not a number where there are no others."""
    s, prior, own = found.learned.errors, nuisance_root(model, found.learned.sizes, fit.moved), mechanism_root(model, fit.mechanisms, found.learned)
    turn, p = amplitudes_apart(fit), len(model.parameters)
    by_test = [turned(turn, *b, fit.point) for b in at_one_size(fit)]
    counts = [d.count for d in model.tests]

    def together(tests: Sequence[int]) -> Quadratic:
        return Quadratic(*(sum(getattr(by_test[t], part) for t in tests) / s**2 for part in ("constant", "b", "a")))

    def ln_density(tests: Sequence[int]) -> float:
        q = together(tests)
        return ln_integral(q, under(prior, q.a[:p, :p]), own) - sum(counts[t] for t in tests) * float(np.log(s))

    every = range(len(by_test))
    whole = ln_density(every)
    total, count, density = 0.0, 0, 0.0
    for group in groups:
        rest = [t for t in every if t not in group]
        if rest:
            q = together(rest)
            mean, *_ = posterior(q, under(prior, q.a[:p, :p]), own)
            total += sum(by_test[t].at(mean) for t in group)
            count += sum(counts[t] for t in group)
            density += whole - ln_density(rest)
    return (float(np.sqrt(max(total, 0.0) / count)), density) if count else (np.nan, np.nan)
