"""Fitting nuisance parameters and effects to the data: Gauss-Newton with priors, Laplace evidence, held-out conditions.

chi2 = |W (y - m(x, theta))|^2 + |x / sd|^2 + |(theta - neutral) / prior|^2 ; the derivative by nuisance parameters is taken once, at the
nominal spindle, and again at the end; that by effect parameters at every step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.theory import Theory
from model.ball_row import Array
from model.pair import NoEquilibrium
from sim.effect import Effect

STEP = 0.3  # of a prior standard deviation, for derivatives by nuisance parameters
TRUST = 2.0  # prior standard deviations, the longest step of any parameter
WORST = 1e12  # chi2 of a state that has no equilibrium


@dataclass(frozen=True, eq=False)
class Linear:
    """Predictions about a point: value (n,) and derivative (n, p) by the nuisance parameters."""

    value: Array
    by_nuisance: Array


@dataclass(frozen=True, eq=False)
class Fit:
    """A model fitted to the data.

    `values[effect][parameter]` and `sd` likewise; `evidence` is the log of the Laplace approximation; `misfit` the chi2 of the data alone,
    `chi2` with priors; `pull` (n,) residuals over their standard errors; `jacobian` (n, p + q) about the optimum.
    """

    effects: tuple[Effect, ...]
    values: dict[str, dict[str, float]]
    sd: dict[str, dict[str, float]]
    nuisance: Array
    nuisance_sd: Array
    residual: Array
    pull: Array
    misfit: float
    chi2: float
    evidence: float
    jacobian: Array
    at_limit: bool


def linearise(theory: Theory) -> Linear:
    """Central differences about the nominal spindle; gains are exact."""
    x0 = np.zeros(len(theory.sd))
    value = theory.features(x0)
    columns = []
    for i, sd in enumerate(theory.sd):
        step = np.zeros(len(x0))
        step[i] = STEP * sd
        if theory.names[i].startswith("gain"):
            columns.append(theory.gains((step / step[i])[-_channels(theory) :]))
        elif theory.names[i].startswith("temperature of"):
            columns.append(_one_test(theory, x0, i, step[i]))
        else:
            columns.append((theory.features(x0 + step) - theory.features(x0 - step)) / (2 * step[i]))
    return Linear(value, np.array(columns).T)


def _channels(theory: Theory) -> int:
    return sum(name.startswith("gain") for name in theory.names)


def _one_test(theory: Theory, x0: Array, i: int, step: float) -> Array:
    """Derivative by the temperature of one test, which moves the features of that test only."""
    from diagnosis.theory import Data, features_of, predict

    data = theory.data
    first = next(k for k, name in enumerate(theory.names) if name.startswith("temperature of"))
    test = i - first
    o = data.observations[test]
    mine = [k for k, f in enumerate(data.features) if f.test == test]
    from dataclasses import replace

    only = Data((o,), tuple(replace(data.features[k], test=0) for k in mine), data.value[mine], data.whiten, data.sd[mine])
    ends = [features_of(only, [predict(theory.spindle, o, (), sign * step)]) for sign in (1, -1)]
    column = np.zeros(len(data.features))
    column[mine] = (ends[0] - ends[1]) / (2 * step)
    return column


def fit(theory: Theory, about: Linear, effects: Sequence[Effect] = (), start: Sequence[float] | None = None, steps: int = 12) -> Fit:
    """Best nuisance and effect parameters from one start (the effects' typical values by default)."""
    data = theory.data
    rows = [p for e in effects for p in e.parameters]
    low, high = (np.array([p.limits[i] for p in rows]) for i in (0, 1))
    width = np.array([p.prior_sd for p in rows])
    middle = np.array([p.neutral for p in rows])
    middle[[i for i, p in enumerate(rows) if p.neutral == p.typical]] = np.array([p.typical for p in rows if p.neutral == p.typical])
    theta = np.array([p.typical for p in rows] if start is None else start, float)
    x = np.zeros(len(theory.sd))
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
        return float(np.sum((data.whiten @ (data.value - m)) ** 2) + np.sum((x / theory.sd) ** 2) + np.sum(((t - middle) / width) ** 2))

    m = model(x, theta)
    current, damping = cost(m, x, theta), 1e-3
    by_theta = np.zeros((len(data.value), len(rows)))
    for _ in range(steps):
        for j, w in enumerate(width):
            h = 0.02 * w if theta[j] + 0.02 * w <= high[j] else -0.02 * w
            moved = theta.copy()
            moved[j] += h
            by_theta[:, j] = (model(x, moved) - m) / h
        jacobian = np.nan_to_num(np.hstack([about.by_nuisance, by_theta]))
        white = data.whiten @ jacobian * scale
        gradient = white.T @ (data.whiten @ (data.value - m)) - np.concatenate([x, theta - middle]) / scale
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
        if fell < 1e-3:
            break
    white = data.whiten @ np.nan_to_num(np.hstack([about.by_nuisance, by_theta])) * scale
    normal = white.T @ white + np.eye(len(scale))
    covariance = np.linalg.inv(normal) * np.outer(scale, scale)
    sd = np.sqrt(np.diag(covariance))
    residual = data.value - m
    numbers = iter(range(len(x), len(x) + len(rows)))
    index = {e.name: {p.name: next(numbers) for p in e.parameters} for e in effects}
    everything = np.concatenate([x, theta])
    sizes = [e.parameters[0] for e in effects]
    size_values = [everything[index[e.name][e.parameters[0].name]] for e in effects]
    at_limit = any(
        v <= p.limits[0] + 1e-6 * p.prior_sd or v >= p.limits[1] - 1e-6 * p.prior_sd for v, p in zip(size_values, sizes, strict=True)
    )
    return Fit(
        tuple(effects),
        {e: {p: float(everything[i]) for p, i in row.items()} for e, row in index.items()},
        {e: {p: float(sd[i]) for p, i in row.items()} for e, row in index.items()},
        x,
        sd[: len(x)],
        residual,
        residual / data.sd,
        float(np.sum((data.whiten @ residual) ** 2)),
        current,
        -0.5 * current - 0.5 * float(np.linalg.slogdet(normal)[1]),
        np.hstack([about.by_nuisance, by_theta]),
        at_limit,
    )
