"""What a quantity goes with: the simplest of a few shapes over temperature, speed and hammer level that explains it.

Shapes are compared by the Bayesian information criterion with the errors enlarged until the best of them fits (the quasi-likelihood
of Burnham, Anderson, *Model Selection and Multimodel Inference*, 2002, 2.5): chi2 / c + k ln n, where c is the smallest chi2 per degree
of freedom, at least `floor`: one where errors are as stated, less where they had been enlarged. An error of the model itself therefore
makes no shape significant.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np
from scipy.special import fdtrc

from thermospindle.model.machine import Condition
from thermospindle.model.types import Array

ALIKE = 0.01  # share of the squares, a tenth of the amplitude, that does not make a shape another
CHANCE = 0.01  # probability of a shape by chance, all that are tried together, above which it is constant


@dataclass(frozen=True, eq=False)
class Shape:
    """One shape: what it is in `temperature`, `speed` and `level` (empty: constant in it), `basis` (conditions, k) with a constant.

    `step`: temperatures (C) between which it jumps. With speeds of one sign only, odd and even cannot be told apart: "speed".
    """

    temperature: str
    speed: str
    level: str
    step: tuple[float, float] | None
    basis: Array

    @property
    def name(self) -> str:
        jump = f" between {self.step[0]:g} and {self.step[1]:g} C" if self.step else ""
        parts = [f"{self.temperature} in temperature{jump}" if self.temperature else ""]
        parts += ["speed" if self.speed == "speed" else f"{self.speed} in speed" if self.speed else "", self.level]
        return " and ".join(filter(None, parts)) or "constant"

    def of(self, variable: str) -> str:
        return str(getattr(self, variable))


@dataclass(frozen=True, eq=False)
class Chosen:
    """The best shape, its coefficients (k, ...), and how sure it is beside every other: `criterion` by name, less the best one's.

    `f` and `p` of the F test against the constant; `explains`: share of the variation about the constant.
    """

    shape: Shape
    coefficients: Array
    criterion: dict[str, float]
    explains: float
    f: float
    p: float
    chi2: dict[str, tuple[float, int]]  # by name, with the number of coefficients


def shapes(conditions: Sequence[Condition]) -> list[Shape]:
    """Every shape that the conditions could tell from the simpler ones, the constant first."""
    t, s, level = (np.array([getattr(c, key) for c in conditions]) for key in ("temperature", "speed", "level"))
    one = np.ones((len(t), 1))
    return [
        Shape(a, b, c, step, np.hstack([one, *parts]))
        for (a, step, *first), (b, _, *second), (c, _, *third) in product(_of_temperature(t), _of_speed(s), _of_level(level))
        if np.linalg.matrix_rank(np.hstack([one, *(parts := [*first, *second, *third])])) == 1 + len(parts)
    ]


def _column(values: Array) -> Array:
    return np.asarray(values, float)[:, None]


def _of_temperature(t: Array) -> Iterator[tuple]:
    every = np.unique(t)
    yield "", None
    if len(every) > 1:
        x = (t - t.mean()) / np.ptp(t)
        yield "linear", None, _column(x)
        if len(every) > 2:
            yield "curved", None, _column(x), _column(x**2)
            for low, high in pairwise(every.tolist()):
                yield "step", (low, high), _column(t > low)


def _of_speed(s: Array) -> Iterator[tuple]:
    yield "", None
    if np.ptp(s) > 0:
        x = s / np.max(np.abs(s))
        if s.min() < 0 < s.max():
            yield "odd", None, _column(x)
            yield "even", None, _column(x**2)
            yield "odd and even", None, _column(x), _column(x**2)
        else:
            yield "speed", None, _column(x**2)


def _of_level(level: Array) -> Iterator[tuple]:
    yield "", None
    if np.ptp(level) > 0:
        yield "level", None, _column((level - level.mean()) / np.ptp(level))


def choose(tried: Sequence[Shape], fit: Callable[[Shape], tuple[float, Array]], count: int, floor: float = 1.0) -> Chosen:
    """The best shape for `count` numbers; `fit` returns chi2 and coefficients.

    Shapes with as many coefficients as numbers are left out, but for the constant; it stands where an F test of the best one, with
    Bonferroni's correction, leaves it to chance. Of shapes that explain as much but for `ALIKE` of it the simplest is taken: what is
    fitted to first order is not known better.
    """
    found: dict[str, tuple[float, int]] = {}
    kept: dict[str, tuple[Shape, Array]] = {}
    for shape in tried:
        k = shape.basis.shape[1]
        if k < count or not found:
            chi2, coefficients = fit(shape)
            found[shape.name], kept[shape.name] = (chi2, k), (shape, coefficients)
    excess = max(floor, min(chi2 / max(count - k, 1) for chi2, k in found.values()))
    criterion = {name: chi2 / excess + k * float(np.log(count)) for name, (chi2, k) in found.items()}
    best = min(criterion, key=lambda name: criterion[name])
    f, p = f_test(found["constant"], found[best], count, floor)
    if p > CHANCE / len(found):
        best, f, p = "constant", 0.0, 1.0
    constant = found["constant"][0]
    alike = [name for name, (chi2, _) in found.items() if chi2 <= found[best][0] + ALIKE * (constant - found[best][0])]
    best = min(alike, key=lambda name: (found[name][1], found[name][0]))
    explains = 1 - found[best][0] / constant if constant > 0 else 0.0
    shape, coefficients = kept[best]
    return Chosen(shape, coefficients, {n: c - criterion[best] for n, c in criterion.items()}, explains, f, p, found)


def f_test(small: tuple[float, int], large: tuple[float, int], count: int, floor: float = 1.0) -> tuple[float, float]:
    """F and its probability for (chi2, coefficients) of two nested regressions; the noise is at least `floor`."""
    more, free = large[1] - small[1], count - large[1]
    if more < 1 or free < 1:
        return 0.0, 1.0
    f = max(0.0, small[0] - large[0]) / more / max(large[0] / free, floor)
    return float(f), float(fdtrc(more, free, f))


def choose_for(conditions: Sequence[Condition], values: Array, covariance: Array, floor: float = 1.0) -> Chosen:
    """The shape of values (conditions,) with their covariance."""
    factor = np.linalg.cholesky(covariance)
    white = np.linalg.solve(factor, values)

    def fit(shape: Shape) -> tuple[float, Array]:
        a = np.linalg.solve(factor, shape.basis)
        coefficients = np.linalg.lstsq(a, white, rcond=None)[0]
        return float(np.sum((white - a @ coefficients) ** 2)), coefficients

    return choose(shapes(conditions), fit, len(values), floor=floor)
