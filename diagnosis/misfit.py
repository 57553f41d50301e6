"""Where and how the model fails, without any catalogue: shares of the misfit, what it grows with, what would have to drift, and where.

All is first order about the tolerances that fit best. Where the misfit is far beyond the errors, these are enlarged until tolerances
at their believed size leave a chi2 of one a number, as in `locate`: otherwise tolerances would be dragged far off to fit what they
cannot. Shapes are then left out, for they jump where modes cross. Residuals are measured - computed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2 as chi_squared

from diagnosis.fit import Fit
from diagnosis.locate import SMALL, Change, elements, enlarged, poles_only, width
from diagnosis.patterns import Chosen, Shape, choose, choose_for, f_test, shapes
from diagnosis.sensitivity import derivative
from diagnosis.shares import Modes, Share, modes_at, shares
from diagnosis.theory import Theory
from model.ball_row import Array
from model.machine import Condition

POLES = ("frequency", "damping")
CHANCE = 0.01  # probability of a misfit above which errors are not enlarged
ITERATIONS = 3  # of the tolerances about which all is linear
HELPS = 0.02  # share of the misfit that one more element must remove to change together with others
SAME = 0.005  # share by which elements of one kind in several places, like both bearings, may do worse together than one of them
ALONE = 0.5  # of what the best element removes, that another must remove alone to be one of them
TRIED = 3  # elements from which others are joined


@dataclass(frozen=True, eq=False)
class Frame:
    """The data made linear about tolerances `x` (p,): residual (n,) of the nominal spindle and derivative (n, p) by tolerances.

    `factor` (n, n) is the Cholesky factor of the covariance of the residual, tolerances with their priors included; `temper` the factor
    on the errors in it. `conditions` of the tests, each once.
    """

    theory: Theory
    x: Array
    residual: Array
    by_tolerance: Array
    factor: Array
    temper: float
    conditions: tuple[Condition, ...]

    def rows(self, condition: Condition) -> Array:
        """Which numbers (n,) belong to a condition."""
        return np.array([self.theory.data.observations[f.test].condition == condition for f in self.theory.data.features])

    @property
    def floor(self) -> float:
        """The smallest chi2 a number can have by chance, in terms of `factor`."""
        return 1 / self.temper**2

    def white(self, columns: Array) -> Array:
        return np.asarray(np.linalg.solve(self.factor, columns), float)


@dataclass(frozen=True)
class Growth:
    """How the misfit goes with temperature, speed or hammer level: `shape` is none, linear, curved, step; odd, even, speed; level.

    `p` is the probability of an F as large by chance, with all else in the regression; `removes` the share of the misfit about a
    constant of each mode that goes with it; `tried` the same share and the information criterion, less that of the best, of every shape
    that the conditions can tell; `changes` of ln frequency by mode, from the smallest to the largest value, of the modes most concerned.
    """

    variable: str
    shape: str
    step: tuple[float, float] | None
    f: float
    p: float
    removes: float
    tried: dict[str, tuple[float, float]]
    changes: dict[str, float]


@dataclass(frozen=True, eq=False)
class Drift:
    """What would have to change from condition to condition: a tolerance, or elements together, each by the same relative `change`.

    `change`, `sd` by condition, from the drawing and beside a common deviation within the tolerance; `removes` the share of the misfit, `criterion` by how much the information
    criterion falls, `pattern` what it goes with.
    """

    names: tuple[str, ...]
    conditions: tuple[Condition, ...]
    change: Array
    sd: Array
    covariance: Array
    removes: float
    criterion: float
    pattern: Chosen

    @property
    def needed(self) -> bool:
        """Whether it is worth its freedom."""
        return self.criterion > 0


@dataclass(frozen=True, eq=False)
class Misfit:
    """Where and how the model fails; `drift` and `places` (elements that change together) with the most telling first."""

    chi2: float
    count: int
    rejected: bool
    shares: tuple[Share, ...]
    growth: tuple[Growth, ...]
    drift: tuple[Drift, ...]
    places: tuple[Drift, ...]


def misfit(theory: Theory, base: Fit, changes: Sequence[Change] = ()) -> Misfit:
    """Everything about the misfit of a fit without effects; `changes` are the places found by `locate`, the best first."""
    about = frame(theory, base)
    modes = modes_at(theory, about.x)
    return Misfit(
        base.misfit,
        len(theory.data.value),
        bool(chi_squared.sf(base.chi2, len(theory.data.value)) < CHANCE),
        shares(theory, base, modes),
        growth(about, modes),
        drifts(about),
        places(about, changes),
    )


def frame(theory: Theory, base: Fit) -> Frame:
    """The linear frame of a theory: about the base fit where that is no worse than chance, else about tolerances at enlarged errors."""
    fits = chi_squared.sf(base.chi2, len(theory.data.value)) >= CHANCE
    if not fits:
        theory = replace(theory, data=poles_only(theory.data))
    data, x = theory.data, base.nuisance if fits else np.zeros(len(theory.sd))
    for _ in range(1 if fits else ITERATIONS):
        slope = derivative(theory, x, ())
        residual = data.value - theory.features(x) + slope @ x
        tolerances = data.whiten @ (slope * theory.sd)
        temper = enlarged(tolerances, data.whiten @ residual)
        normal = tolerances.T @ tolerances / temper**2 + np.eye(len(x))
        if not fits:
            x = theory.sd * np.linalg.solve(normal, tolerances.T @ (data.whiten @ residual)) / temper**2
    inverse = np.linalg.inv(data.whiten)
    factor: Array = np.linalg.cholesky(temper**2 * inverse @ inverse.T + (slope * theory.sd**2) @ slope.T).astype(float)
    conditions = {o.condition: None for o in data.observations}
    order = sorted(conditions, key=lambda c: (c.speed, c.temperature, c.level, c.soak_time))
    return Frame(theory, x, residual, slope, factor, temper, tuple(order))


# ---------------------------------------------------------------- what it grows with


def growth(about: Frame, modes: Modes) -> tuple[Growth, ...]:
    """Whether the residuals of frequencies and dampings go with temperature, speed and level, mode by mode and all in one regression."""
    features = about.theory.data.features
    poles = [i for i, f in enumerate(features) if f.what in POLES]
    covariance = (about.factor @ about.factor.T)[np.ix_(poles, poles)]
    factor = np.linalg.cholesky(covariance)
    white = np.linalg.solve(factor, about.residual[poles])
    series = sorted({(int(modes.number[features[i].test][features[i].mode]), features[i].what) for i in poles})
    index = [series.index((int(modes.number[features[i].test][features[i].mode]), features[i].what)) for i in poles]
    conditions = [about.theory.data.observations[features[i].test].condition for i in poles]

    def fit(shape: Shape) -> tuple[float, Array]:
        design = np.zeros((len(poles), shape.basis.shape[1], len(series)))
        design[np.arange(len(poles)), :, index] = shape.basis
        a = np.linalg.solve(factor, design.reshape(len(poles), -1))
        coefficients = np.linalg.lstsq(a, white, rcond=None)[0]
        return float(np.sum((white - a @ coefficients) ** 2)), coefficients.reshape(shape.basis.shape[1], -1)

    tried = shapes(conditions)
    best = choose(tried, fit, len(poles), len(series), about.floor)
    return tuple(
        _growth(v, tried, best, conditions, series, modes, about.floor)
        for v in ("temperature", "speed", "level")
        if len({getattr(c, v) for c in conditions}) > 1
    )


def _growth(
    variable: str,
    tried: Sequence[Shape],
    best: Chosen,
    conditions: Sequence[Condition],
    series: Sequence[tuple[int, str]],
    modes: Modes,
    floor: float,
) -> Growth:
    others = [v for v in ("temperature", "speed", "level") if v != variable]
    alike = [s for s in tried if all(s.of(v) == best.shape.of(v) for v in others) and s.name in best.chi2]
    alike = [s for s in alike if variable == "temperature" or s.step == best.shape.step]
    without = next(s for s in alike if not s.of(variable))
    base = best.chi2["constant"][0]
    f, p = f_test(best.chi2[without.name], best.chi2[best.shape.name], len(conditions), floor)
    told: dict[str, tuple[float, float]] = {}
    for s in sorted(alike, key=lambda s: -best.criterion[s.name]):  # of several steps the best one stands
        removed = (best.chi2[without.name][0] - best.chi2[s.name][0]) / base if base > 0 else 0.0
        told[s.of(variable) or "none"] = max(0.0, removed), best.criterion[s.name] - best.criterion[best.shape.name]
    values = np.array([getattr(c, variable) for c in conditions])
    ends = [best.shape.basis[values == v].mean(axis=0) for v in (values.min(), values.max())]
    change = {s: float((ends[1] - ends[0]) @ best.coefficients[:, k]) for k, s in enumerate(series) if s[1] == "frequency"}
    largest = sorted(change, key=lambda s: -abs(change[s]))[:3] if best.shape.of(variable) else []
    return Growth(
        variable,
        best.shape.of(variable) or "none",
        best.shape.step if variable == "temperature" else None,
        f,
        p,
        told[best.shape.of(variable) or "none"][0],
        told,
        {modes.name(s[0]): change[s] for s in largest},
    )


# ---------------------------------------------------------------- what would have to drift


def drifts(about: Frame) -> tuple[Drift, ...]:
    """Every tolerance free at every condition, one after the other, with all others common and at their priors; the best first."""
    found = []
    for j, name in enumerate(about.theory.names):
        if not name.startswith("temperature of") and np.any(about.by_tolerance[:, j]):
            found.append(_free(about, (name,), about.by_tolerance[:, j]))
    return tuple(sorted(found, key=lambda d: -d.removes))


def places(about: Frame, changes: Sequence[Change]) -> tuple[Drift, ...]:
    """First groups of elements that change together, by the same share, then those of `changes` alone; free at every condition.

    To each of the best `TRIED` others like it are joined (`_asked`), of those in the model that alone remove `ALONE` of what the best does.
    """
    if not changes:
        return ()
    here = about.theory.features(about.x)
    slopes = {e.name: (about.theory.features(about.x, [(e, {"change": SMALL})]) - here) / SMALL for e in elements(about.theory.spindle)}
    every = sorted((_free(about, (name,), slope) for name, slope in slopes.items()), key=lambda d: -d.removes)
    alone = [d for d in every if d.names[0] in {c.element for c in changes}]
    helpful = {d.names[0]: slopes[d.names[0]] for d in every if d.removes > ALONE * every[0].removes}
    groups: dict[frozenset[str], Drift] = {}
    for d in alone[:TRIED]:
        joined = _joined(about, helpful | {d.names[0]: slopes[d.names[0]]}, d)
        groups.setdefault(frozenset(joined.names), joined)
    first = sorted(groups.values(), key=lambda d: -d.removes - SAME * (len(d.names) - 1))
    return (*first, *(d for d in alone if frozenset(d.names) not in groups))


def _joined(about: Frame, slopes: Mapping[str, Array], best: Drift) -> Drift:
    """An element with all others that are like it and help by changing with it."""
    total = slopes[best.names[0]]
    while left := [name for name in slopes if name not in best.names and _asked((*best.names, name)) is not None]:
        tried = [_free(about, (*best.names, name), total + slopes[name]) for name in left]
        more = max(tried, key=lambda d: d.removes - (_asked(d.names) or 0.0))
        if more.removes < best.removes + (_asked(more.names) or 0.0):
            break
        best, total = more, total + slopes[more.names[-1]]
    return best


def _asked(names: Sequence[str]) -> float | None:
    """The share that the last of the elements must remove more; None for elements of different kinds in different places.

    Elements of one kind in several places, like the radial stiffness of both bearings, are taken to change together unless one alone
    does better; those of one part, like its mass and inertia, only where that helps.
    """
    if len({tuple(name.split()[-3:]) for name in names}) == 1:
        return -SAME
    return HELPS if len({name.split()[0] for name in names}) == 1 else None


def _free(about: Frame, names: tuple[str, ...], slope: Array) -> Drift:
    """A relative change along `slope` (n,) that is free at every condition, with the prior of the freest of them."""
    prior = max(width(name) for name in names)
    rest = about.white(about.residual)
    columns = about.white(np.array([np.where(about.rows(c), slope, 0.0) for c in about.conditions]).T)
    normal = columns.T @ columns + np.eye(len(about.conditions)) / prior**2
    covariance: Array = np.linalg.inv(normal).astype(float)
    change = covariance @ (columns.T @ rest)
    left = float(np.sum((rest - columns @ change) ** 2)) + float(change @ change) / prior**2
    total, n, k = float(rest @ rest), len(rest), len(about.conditions)
    excess = max(about.floor, left / max(n - k, 1))
    return Drift(
        names,
        about.conditions,
        change,
        np.sqrt(np.diag(covariance)),
        covariance,
        1 - left / total if total > 0 else 0.0,
        (total - left) / excess - k * float(np.log(n)),
        choose_for(about.conditions, change, covariance, about.floor),
    )
