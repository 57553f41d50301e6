"""Fitting nuisance parameters and effects to the data: Gauss-Newton with priors, and its Laplace evidence.

chi2 = |W (y - m(x, theta))|^2 + |x / sd|^2 + |(theta - neutral) / prior|^2, W^T W the inverse of the covariance of the data and of the
effects' own errors of form, each a share of what the effect does to a feature: model discrepancy after Kennedy & O'Hagan (2001),
*J. R. Statist. Soc. B* 63, 425, with the scale known. Without it the smallest difference between two people's formulas for one effect would
refute both, wherever the effect is a thousand times larger than the errors of measurement.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import product

import numpy as np

from thermospindle.diagnosis.data.features import WHAT, Data, whitening
from thermospindle.diagnosis.prediction.sensitivity import derivative
from thermospindle.diagnosis.prediction.theory import Theory
from thermospindle.model.errors import NoEquilibrium
from thermospindle.model.types import Array
from thermospindle.sim.effects.effect import Effect

TRUST = 2.0  # prior standard deviations, the longest step of any parameter
TEMPERS = (300.0, 30.0, 3.0, 1.0)  # factors on the data's errors, in turn
ROUGH = 4  # steps at each temper of a fit that is not thorough
RENEWALS = 6  # of the derivative at the last temper
ENOUGH = 0.1  # fall of chi2 below which renewing derivatives has done its work
ASIDE = 0.3  # share of the error of form that falls on features which an effect does not move
SHARES = (0.0, 0.1, 0.3, 1.0)  # of the form errors an effect states, all equally likely beforehand
LOSS = 0.05  # loss factor that an effect on stiffness may bring unasked
WORST = 1e12  # chi2 of a state that has no equilibrium


@dataclass(frozen=True, eq=False)
class Fit:
    """A model fitted to the data.

    `values[effect][parameter]` and `sd` likewise; `evidence` is the log of the Laplace approximation; `misfit` the chi2 of the data alone
    by their own errors, `chi2` with errors of form and priors; `whiten` (n, n) with errors of form; `jacobian` (n, p + q) about the optimum.
    """

    effects: tuple[Effect, ...]
    values: dict[str, dict[str, float]]
    sd: dict[str, dict[str, float]]
    nuisance: Array
    nuisance_sd: Array
    residual: Array
    misfit: float
    chi2: float
    evidence: float
    whiten: Array
    jacobian: Array
    at_limit: bool


def prior_widths(theory: Theory, found: Fit) -> Array:
    """Prior standard deviations (p + q,) of the nuisance parameters and of the effects', as the columns of `found.jacobian`."""
    return np.concatenate([theory.sd, [p.prior_sd for e in found.effects for p in e.parameters]])


def linearise(theory: Theory) -> Array:
    """Derivative (n, p) of the features by the nuisance parameters at the nominal spindle without effects."""
    return derivative(theory, np.zeros(len(theory.sd)), ())


def form_variance(data: Data, effect: Effect, moved: Array) -> Array:
    """Variance (n,) by which an effect may miss what it does to the features, `moved` (n,).

    Besides its share of each movement there is one of the rms movement of all features of that kind in the test: a wrong law also moves
    what the right one leaves alone. And what changes stiffness also dissipates, more or less: a loss factor `LOSS` of that part of the
    strain energy, 2 |d ln f|, is a damping ratio of LOSS |d ln f|.
    """
    variance = np.zeros(len(moved))
    for rows in data.rows.values():
        for what in WHAT:
            own = getattr(rows, what)
            error = effect.damping_form_error if what == "damping" else effect.form_error
            if len(own):
                variance[own] = error**2 * (moved[own] ** 2 + ASIDE**2 * np.mean(moved[own] ** 2))
        frequency = dict(zip(rows.mode_of_frequency.tolist(), moved[rows.frequency].tolist(), strict=True))
        shift = np.array([frequency.get(mode, 0.0) for mode in rows.mode_of_damping.tolist()])
        variance[rows.damping] += (2 * effect.damping_form_error * LOSS * shift / np.exp(data.value[rows.damping])) ** 2
    return variance


def likeliest(data: Data, residual: Array, more: Array, enlarged: float) -> Array:
    """The whitening matrix with the shares of the form errors `more` that make the residual likeliest: a law may be better than feared.

    What is said of damping is taken to be right or as bad as it is feared to be: a law right for most tests and wrong at a peak of losses
    would otherwise be refuted by that.
    """
    if not more.any():
        return whitening(data.blocks, more, enlarged)
    damping = np.concatenate([rows.damping for rows in data.rows.values()])
    tried = []
    for own, losses in product(SHARES, (0.0, 1.0)):
        share = np.full(len(more), own)
        share[damping] = losses
        tried.append(whitening(data.blocks, share**2 * more, enlarged))
    return max(tried, key=lambda w: float(np.sum(np.log(np.diag(w))) - 0.5 * np.sum((w @ residual) ** 2)))


def fit(
    theory: Theory,
    about: Array,
    effects: Sequence[Effect] = (),
    start: Sequence[float] | None = None,
    thorough: bool = True,
    nuisance: Array | None = None,
    steps: int = 8,
) -> Fit:
    """Best nuisance and effect parameters from one start (the effects' typical values by default); parameters with choices stay there.

    The data are tempered: their errors are first taken much larger than they are, so that effects find their size while tolerances
    stay where they are believed, then smaller down to the truth. A thorough fit takes the derivative by nuisance parameters anew
    at every temper and goes on at the last until chi2 rests; else `about` serves, the last tempers are left out, and chi2 and evidence are
    those of the tempered data: good for ranking only. With `nuisance` values from an earlier fit only the last temper is gone through;
    a fit that is not thorough then stands on `about` being the derivative there.
    """
    data = theory.data
    rows = [p for e in effects for p in e.parameters]
    low, high = (np.array([p.limits[i] for p in rows]) for i in (0, 1))
    width = np.array([p.prior_sd for p in rows])
    sizes = {id(e.parameters[0]) for e in effects}
    theta = np.array([p.typical for p in rows] if start is None else start, float)
    chosen = np.array([bool(p.choices) for p in rows], bool)  # stay as they are; the caller tries one after the other
    middle = np.where(chosen, theta, np.array([p.neutral if id(p) in sizes else p.typical for p in rows]))
    x = np.zeros(len(theory.sd)) if nuisance is None else nuisance.copy()
    scale = np.concatenate([theory.sd, width])

    def applied(t: Array) -> list[tuple[Effect, dict[str, float]]]:
        numbers = iter(t.tolist())
        return [(e, {p.name: next(numbers) for p in e.parameters}) for e in effects]

    def model(x: Array, t: Array) -> Array:
        try:
            return theory.features(x, applied(t))
        except NoEquilibrium:
            return np.full(len(data.value), np.nan)

    def cost(m: Array, x: Array, t: Array) -> float:
        if not np.all(np.isfinite(m)):
            return WORST
        return float(np.sum((whiten @ (data.value - m)) ** 2) + np.sum((x / theory.sd) ** 2) + np.sum(((t - middle) / width) ** 2))

    def with_form_errors(m: Array, x: Array, t: Array, temper: float) -> Array:
        present = applied(t)
        more = np.zeros(len(m))
        for one in present:
            rest = theory.features(x, [other for other in present if other is not one])
            more += form_variance(data, one[0], np.nan_to_num(m - rest))
        return likeliest(data, data.value - np.nan_to_num(m), more, temper)

    m = model(x, theta)
    by_theta, by_nuisance = np.zeros((len(data.value), len(rows))), about
    first = TEMPERS if nuisance is None else (1.0,)
    tempers = (*first, *[1.0] * (RENEWALS - (nuisance is not None))) if thorough else first[:2]
    for temper in tempers:
        if thorough and (effects or temper < TEMPERS[0]):
            with suppress(NoEquilibrium):  # where a neighbour of this state cannot be mounted, the last derivative serves on
                by_nuisance = derivative(theory, x, applied(theta))
        whiten = with_form_errors(m, x, theta, temper)
        current, damping = cost(m, x, theta), 1e-3
        before = current
        for _ in range(steps if thorough else ROUGH):
            for j in np.flatnonzero(~chosen):
                w = width[j]
                h = 0.02 * w if theta[j] + 0.02 * w <= high[j] else -0.02 * w
                moved = theta.copy()
                moved[j] += h
                by_theta[:, j] = np.nan_to_num((model(x, moved) - m) / h)
            white = whiten @ np.hstack([by_nuisance, by_theta]) * scale
            gradient = white.T @ (whiten @ (data.value - np.nan_to_num(m))) - np.concatenate([x, theta - middle]) / scale
            normal = white.T @ white + np.eye(len(scale))
            for _ in range(8):
                move = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), gradient) * scale
                move /= max(1.0, float(np.max(np.abs(move / scale))) / TRUST)
                new_x, new_theta = x + move[: len(x)], np.clip(theta + move[len(x) :], low, high)
                new_m = model(new_x, new_theta)
                new = cost(new_m, new_x, new_theta)
                if new <= current:
                    break
                damping = max(damping * 6, 1e-3)
            else:
                break
            fell = current - new
            x, theta, m, current, damping = new_x, new_theta, new_m, new, damping / 5
            if fell < max(1e-3, 1e-3 * current):
                break
        if temper == 1.0 and before - current < ENOUGH:
            break
    whiten = with_form_errors(m, x, theta, 1.0 if thorough else tempers[-1])
    current = cost(m, x, theta)
    white = whiten @ np.hstack([by_nuisance, by_theta]) * scale
    normal = white.T @ white + np.eye(len(scale))
    covariance = np.linalg.inv(normal) * np.outer(scale, scale)
    sd = np.sqrt(np.diag(covariance)) * ~np.concatenate([np.zeros(len(x), bool), chosen])
    one_of = float(sum(np.log(len(p.choices)) for p in rows if p.choices))  # all equally likely beforehand
    residual = data.value - m
    numbers = iter(range(len(x), len(x) + len(rows)))
    index = {e.name: {p.name: next(numbers) for p in e.parameters} for e in effects}
    everything = np.concatenate([x, theta])
    main = [e.parameters[0] for e in effects]
    size_values = [everything[index[e.name][e.parameters[0].name]] for e in effects]
    at_limit = any(
        v <= p.limits[0] + 1e-6 * p.prior_sd or v >= p.limits[1] - 1e-6 * p.prior_sd for v, p in zip(size_values, main, strict=True)
    )
    return Fit(
        tuple(effects),
        {e: {p: float(everything[i]) for p, i in row.items()} for e, row in index.items()},
        {e: {p: float(sd[i]) for p, i in row.items()} for e, row in index.items()},
        x,
        sd[: len(x)],
        residual,
        float(np.sum((data.whiten @ residual) ** 2)),
        current,
        -0.5 * current - 0.5 * float(np.linalg.slogdet(normal)[1]) - one_of + float(np.sum(np.log(np.diag(whiten) / np.diag(data.whiten)))),
        whiten,
        np.hstack([by_nuisance, by_theta]),
        at_limit,
    )
