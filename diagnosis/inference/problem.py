"""A campaign and the mechanisms that act in it as a least-squares problem: its parameters, cost and derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import lsq_linear

from thermospindle.diagnosis.forward.derivatives import Derivatives, column, nuisance_jacobian
from thermospindle.diagnosis.forward.linear import Rates
from thermospindle.diagnosis.forward.model import FAILED, SIZE_STEP, Applied, CampaignModel
from thermospindle.diagnosis.forward.rates import rates_of
from thermospindle.diagnosis.inference.prior import UNMOVED, Learned, precision_and_variances, roots_of
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.diagnosis.parameters.mechanism import Mechanism
from thermospindle.model.types import Array, Integers

NONE: Integers = np.zeros(0, int)
LONGEST = 3.0  # prior standard deviations in one step, until steps as long as that do what they promise
NARROW = 1e4  # precision in reference widths, between those of what may be and of next to nothing


@dataclass(frozen=True, eq=False)
class Point:
    """Parameters (n,), the residuals of every test there (None where no spindle can be built) and their cost."""

    p: Array
    residuals: Sequence[Array] | None
    cost: float


class Problem:
    """A campaign and the mechanisms that act in it, as a least-squares problem over p = [x, z_1, u_1, z_2, u_2, ...].

    Priors have their reference widths, or those `learned`, with what may be misjudged of conditions and mechanisms that `moved` the modes.
    """

    def __init__(
        self, model: CampaignModel, mechanisms: Sequence[Mechanism], learned: Learned | None = None, moved: Array = UNMOVED
    ) -> None:
        self.model, self.mechanisms = model, tuple(mechanisms)
        self.roots = roots_of(model, self.mechanisms)
        scale = 1.0 if learned is None else learned.errors**2
        whole, variances = precision_and_variances(model, self.mechanisms, learned, moved)
        self.precision = scale * whole
        self.least_stiff = scale / variances  # of each parameter, all others free
        self.tests = len(model.tests)
        self.nuisances = len(model.parameters)
        self.length = self.nuisances + sum(self.tests + len(m.shape) for m in self.mechanisms)
        self.low, self.high = np.full(self.length, -np.inf), np.full(self.length, np.inf)  # of shape parameters; sizes go on beyond theirs
        at = self.nuisances
        for m in self.mechanisms:
            at += self.tests
            for q in m.shape:
                self.low[at], self.high[at] = ((limit - q.neutral) / q.prior_sd for limit in q.limits)
                at += 1
        small = (*kinds_of.DISCREPANCIES, kinds_of.DRIFT, kinds_of.HAMMER_DRIFT, kinds_of.MISS_DRIFT)
        self.reach = np.ones(self.length)  # what of a parameter's move counts towards the longest step
        self.reach[: self.nuisances] = [0.05 if q.kind in small else 1.0 for q in model.parameters]

    def within_limits(self, p: Array) -> Array:
        return np.clip(p, self.low, self.high)

    def held(self, p: Array, slope: Array) -> Integers:
        """Numbers of the shape parameters that stand at a limit beyond which alone the cost, of half gradient `slope` (n,), would fall."""
        return np.flatnonzero(((p <= self.low) & (slope > 0)) | ((p >= self.high) & (slope < 0)))

    def step(self, p: Array, slope: Array, normal: Array, longest: float = LONGEST) -> Array:
        """The move (n,) from `p` to the least of a quadratic of the cost within the limits, shortened to the
        `longest` one: the quadratic of what is limited alone, all else following it, is solved between bounds."""
        limited = np.isfinite(self.low) | np.isfinite(self.high)
        free, move = ~limited, np.zeros(self.length)
        follows = _solved(normal[np.ix_(free, free)], np.column_stack([slope[free], normal[np.ix_(free, limited)]]))
        if limited.any():
            left = np.column_stack([slope[limited], normal[np.ix_(limited, limited)]]) - normal[np.ix_(limited, free)] @ follows
            factor = np.linalg.cholesky(left[:, 1:])
            bounds = self.low[limited] - p[limited], self.high[limited] - p[limited]
            move[limited] = lsq_linear(factor.T, -np.linalg.solve(factor, left[:, 0]), bounds, method="bvls").x
        move[free] = -follows[:, 0] - follows[:, 1:] @ move[limited]
        return move * min(1.0, longest / max(self.length_of(move), 1e-300))

    def length_of(self, move: Array) -> float:
        """Of a move (n,), in prior standard deviations of what moves most."""
        return float((np.abs(move) * self.reach).max())

    def parts(self, p: Array) -> tuple[Array, Array, list[Array]]:
        """Nuisance values (P,), sizes (mechanisms, tests) and shape parameters of a parameter vector, in their units."""
        at, sizes, shapes = self.nuisances, [], []
        for m, root in zip(self.mechanisms, self.roots, strict=True):
            sizes.append(m.size.neutral + root @ p[at : at + self.tests])
            at += self.tests
            shapes.append(np.array([np.clip(q.neutral + q.prior_sd * v, *q.limits) for q, v in zip(m.shape, p[at : at + len(m.shape)], strict=True)]))
            at += len(m.shape)
        return p[: self.nuisances], np.array(sizes).reshape(len(self.mechanisms), self.tests), shapes

    def start(self, sizes: Mapping[int, float | Array]) -> Array:
        """The drawing (n,), with mechanism number k at size `sizes[k]` in its unit, one for all tests or (tests,), and the others at none."""
        p, at = np.zeros(self.length), self.nuisances
        for k, (m, root) in enumerate(zip(self.mechanisms, self.roots, strict=True)):
            if k in sizes:
                p[at : at + self.tests] = np.linalg.solve(root, np.broadcast_to(sizes[k] - m.size.neutral, self.tests))
            at += self.tests + len(m.shape)
        return p

    def within_prior(self, p: Array) -> Array:
        """Where the prior allows next to nothing that is taken from a parameter vector (n,), and the rest
        of it left: what was fitted with wide priors does not start a fit with narrow ones from a wall."""
        return np.asarray(np.linalg.solve(self.precision + NARROW * np.eye(self.length), NARROW * p))

    def applied(self, t: int, sizes: Array, shapes: Sequence[Array]) -> list:
        """The effects that act in test `t`; of sizes beyond their limits `CampaignModel.linear` makes what it can."""
        return [(m.effect, m.values(float(size), shape.tolist())) for m, size, shape in zip(self.mechanisms, sizes[:, t], shapes, strict=True)]

    def acting(self, effects: Applied) -> list:
        """Without those of no size, which change nothing: what was worked out without them serves."""
        return [(e, v) for (e, v), m in zip(effects, self.mechanisms, strict=True) if v[m.size.name] != m.size.neutral]

    def residual(self, t: int, p: Array) -> Array:
        x, sizes, shapes = self.parts(p)
        return self.model.residual(t, x, self.acting(self.applied(t, sizes, shapes)))

    def by_size(self, t: int, x: Array, effects: Applied, k: int) -> Array:
        m = self.mechanisms[k]
        return self._by_value(t, x, effects, k, m.size)

    def _by_value(self, t: int, x: Array, effects: Applied, k: int, q) -> Array:
        """Derivative (N,) of the residual of test `t` by parameter `q` of mechanism `k`, from inside its limits, or beyond those of a size."""
        effect, values = effects[k]
        step = SIZE_STEP * q.prior_sd
        low, high = q.limits
        for h in (step, -step):
            beyond = not low <= values[q.name] <= high
            if beyond or low <= values[q.name] + h <= high:
                moved = list(effects)
                moved[k] = (effect, {**values, q.name: values[q.name] + h})
                try:
                    return column(self.model, t, x, self.acting(effects), self.acting(moved), h)
                except FAILED:
                    continue
        return np.zeros(self.model.tests[t].count)

    def linearised(self, t: int, p: Array, rates: Rates) -> tuple[Array, Derivatives]:
        """Residual (N,) of test `t` and its derivatives by the parameters of p that move it."""
        x, sizes, shapes = self.parts(p)
        effects = self.applied(t, sizes, shapes)
        more = sum(1 + len(m.shape) for m in self.mechanisms)
        r, found = nuisance_jacobian(self.model, t, x, self.acting(effects), rates, more)
        numbers, of, times = [], [], []
        row, at = len(found.rows) - more, self.nuisances
        for k, (m, root) in enumerate(zip(self.mechanisms, self.roots, strict=True)):
            found.rows[row] = self.by_size(t, x, effects, k)
            numbers += [*range(at, at + t + 1), *range(at + self.tests, at + self.tests + len(m.shape))]
            of += [*[row] * (t + 1), *range(row + 1, row + 1 + len(m.shape))]
            times += [*root[t, : t + 1], *(q.prior_sd for q in m.shape)]
            for n, q in enumerate(m.shape, row + 1):
                found.rows[n] = self._by_value(t, x, effects, k, q)
            row, at = row + 1 + len(m.shape), at + self.tests + len(m.shape)
        return r, found.further(np.array(numbers, int), np.array(of, int), np.array(times, float))

    def effects_of(self, p: Array) -> list[list]:
        _, sizes, shapes = self.parts(p)
        return [self.acting(self.applied(t, sizes, shapes)) for t in range(self.tests)]

    def linearisation(self, p: Array, rates: Rates, held: Integers = NONE) -> Linearisation:
        """Of all tests, without the parameters that are `held` where they are; with rates of its
        own where a mechanism that has gone, or come, took degrees of freedom with it."""
        x, effects_of = self.parts(p)[0], self.effects_of(p)
        if any(self.model.standing(t, x, own)[0].matrices.dofs != dofs for t, (own, dofs) in enumerate(zip(effects_of, rates.dofs, strict=True))):
            rates = rates_of(self.model, x, effects_of, rates)
        return Linearisation(self.length, [self.linearised(t, p, rates) for t in range(self.tests)]).without(held)

    def residuals(self, p: Array) -> list[Array] | None:
        """Residuals of every test; None where no spindle can be built."""
        return built(lambda t: self.residual(t, p), self.tests)

    def at(self, p: Array, temper: float) -> Point:
        residuals = self.residuals(p)
        return Point(p, residuals, self.cost(p, temper, residuals) if residuals is not None else np.inf)

    def cost(self, p: Array, temper: float, residuals: Sequence[Array] | None = None) -> float:
        """chi2 with errors 1 / `temper` times the data's, and priors; infinite where no spindle can be built."""
        if residuals is None:
            residuals = self.residuals(p)
        return np.inf if residuals is None else temper**2 * sum(float(r @ r) for r in residuals) + float(p @ self.precision @ p)


def _solved(normal: Array, sides: Array) -> Array:
    """normal^-1 sides (n, k), of a symmetric matrix (n, n) that is positive, but for rounding."""
    try:
        return np.asarray(cho_solve(cho_factor(normal, overwrite_a=True, check_finite=False), sides, check_finite=False))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.solve(normal, sides))


def built(residual: Callable[[int], Array], tests: int) -> list[Array] | None:
    """`residual` of every test; None where no spindle can be built."""
    try:
        found = [residual(t) for t in range(tests)]
    except FAILED:
        return None
    return found if all(np.all(np.isfinite(r)) for r in found) else None


class Linearisation:
    """Derivatives of all tests at one point: information J^T J, and gradients J^T r of residuals there or near."""

    def __init__(self, length: int, rows: Sequence[tuple[Array, Derivatives]], own: Sequence[Array] | None = None) -> None:
        """Of a parameter vector of some `length` and the residuals and derivatives of every test, whose products are their `own` if known."""
        self.length, self.rows = length, rows
        self.residuals = [r for r, _ in rows]
        self.information: Array = np.zeros((length, length))
        self._own = [found.information for _, found in rows] if own is None else own
        for of_test, (_, found) in zip(self._own, rows, strict=True):
            self.information[np.ix_(found.numbers, found.numbers)] += of_test

    @property
    def by_test(self) -> list[Array]:
        """The information (n, n) of each test."""
        every = [np.zeros_like(self.information) for _ in self.rows]
        for information, own, (_, found) in zip(every, self._own, self.rows, strict=True):
            information[np.ix_(found.numbers, found.numbers)] = own
        return every

    def without(self, held: Integers) -> Linearisation:
        """The same with some parameters held where they are."""
        if not len(held):
            return self
        kept = [~np.isin(found.numbers, held) for _, found in self.rows]
        rows = [(r, found.by(k)) for k, (r, found) in zip(kept, self.rows, strict=True)]
        return Linearisation(self.length, rows, [own[np.ix_(k, k)] for k, own in zip(kept, self._own, strict=True)])

    @cached_property
    def chi2(self) -> float:
        return sum(float(r @ r) for r in self.residuals)

    @cached_property
    def gradient(self) -> Array:
        """J^T r (n,) of all tests at the point itself."""
        return np.asarray(np.sum(self.gradients(self.residuals), axis=0))

    def slope(self, problem: Problem, at: Point, temper: float) -> Array:
        """Half the gradient (n,) of the cost at a point near."""
        assert at.residuals is not None
        return np.asarray(temper**2 * np.sum(self.gradients(at.residuals), axis=0) + problem.precision @ at.p)

    def gradients(self, residuals: Sequence[Array]) -> list[Array]:
        """J^T r (n,) of every test, of residuals there or near."""
        return self._gradients if residuals is self.residuals else self._gradients_of(residuals)

    @cached_property
    def _gradients(self) -> list[Array]:
        return self._gradients_of(self.residuals)

    def _gradients_of(self, residuals: Sequence[Array]) -> list[Array]:
        gradients = [np.zeros(self.length) for _ in self.rows]
        for gradient, r, (_, found) in zip(gradients, residuals, self.rows, strict=True):
            gradient[found.numbers] = found.products(r)
        return gradients
