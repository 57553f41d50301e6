"""Fitting nuisance parameters and the sizes of mechanisms to a campaign: Levenberg-Marquardt with priors, tempered.

Peaks that do not overlap do not pull at each other: with the data's own errors a fit stalls. Errors are therefore first taken thousands of
times too large, so that priors rule and all peaks move together, then less and less (a homotopy: Allgower & Georg, *Numerical Continuation
Methods*, 1990). What moves a peak by its width bends every valley of the cost: a step along one is corrected with the derivatives at hand before
it is judged. A step to where no spindle can be built is taken shorter.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from thermospindle.diagnosis.forward import nuisance as kinds_of
from thermospindle.diagnosis.forward.linear import Rates
from thermospindle.diagnosis.forward.mechanism import Mechanism
from thermospindle.diagnosis.forward.model import FAILED, Applied, CampaignModel
from thermospindle.diagnosis.inference.prior import UNMOVED, Learned, precision_and_variances, roots_of
from thermospindle.model.types import Array, Integers

TEMPERS = (3e-4, 3e-3, 0.03, 0.3, 1.0)
LONGEST = 3.0  # prior standard deviations in one step
MOST_STEPS = (30, 40)  # while errors are taken too large, and at the end
LEAST_DAMPING, RAISED_DAMPING = 1e-4, 1e-3  # of a parameter's own curvature, at first and after a step that was refused
MOST_GROWTH = 2.0**6  # of the damping, one refusal after the other
ENOUGH = 0.3  # of the cost, from which a fit goes on
ENOUGH_FAR, ENOUGH_EARLY = 2e-3, 0.02  # share of what is left beyond noise, and of all the cost while errors are taken too large, likewise
TRUSTED, POOR = 0.6, 0.25  # of the gain promised: from there derivatives stay in use, and below it a step is corrected
CORRECTIONS = 2
SIZE_STEP = 0.02  # of a size's or shape parameter's prior standard deviation, for differences


@dataclass(frozen=True, eq=False)
class Fit:
    """Where a model stands: nuisance values x (P,) in prior standard deviations, sizes (mechanisms, tests) and shape parameters of every mechanism
    in their units; and the quadratic of chi2 about it over all parameters p = [x, z, u]: chi2 + 2 gradient (p - point) + (p - point) information
    (p - point), with z the whitened sizes (`roots`) and u the shape parameters, mechanism by mechanism.

    `by_test` holds chi2, gradient and information of every test.
    """

    mechanisms: tuple[Mechanism, ...]
    point: Array
    sizes: Array
    shapes: tuple[tuple[float, ...], ...]
    roots: tuple[Array, ...]
    chi2: float
    gradient: Array
    information: Array
    by_test: tuple[tuple[float, Array, Array], ...]
    count: int
    rates: Rates
    temper: float
    moved: Array = field(default_factory=lambda: UNMOVED)  # (mechanisms, tests, 2, modes), of frequency and damping of every mode, relative
    cost: float = np.nan  # chi2, its errors 1 / temper times the data's, and priors: those that it was fitted with

    @property
    def nuisance(self) -> Array:
        return self.point[: len(self.point) - sum(len(r) + len(m.shape) for r, m in zip(self.roots, self.mechanisms, strict=True))]


class Problem:
    """A campaign and the mechanisms that act in it, as a least-squares problem over p = [x, z_1, u_1, z_2, u_2, ...].

    Priors have their reference widths, or those `learned`, with what may be misjudged of mechanisms that `moved` the modes.
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
        small = (kinds_of.STIFFNESS, kinds_of.DAMPING, kinds_of.STIFFNESS_DRIFT, kinds_of.DAMPING_DRIFT, kinds_of.DRIFT)
        self.reach = np.ones(self.length)  # what of a parameter's move counts towards the longest step
        self.reach[: self.nuisances] = [0.05 if q.kind in small else 1.0 for q in model.parameters]

    def parts(self, p: Array) -> tuple[Array, Array, list[Array]]:
        """Nuisance values (P,), sizes (mechanisms, tests) and shape parameters of a parameter vector, in their units."""
        at, sizes, shapes = self.nuisances, [], []
        for m, root in zip(self.mechanisms, self.roots, strict=True):
            sizes.append(m.size.neutral + root @ p[at : at + self.tests])
            at += self.tests
            shapes.append(np.array([np.clip(q.neutral + q.prior_sd * v, *q.limits) for q, v in zip(m.shape, p[at : at + len(m.shape)], strict=True)]))
            at += len(m.shape)
        return p[: self.nuisances], np.array(sizes).reshape(len(self.mechanisms), self.tests), shapes

    def start(self, sizes: Mapping[int, float]) -> Array:
        """The drawing (n,), with mechanism number k at size `sizes[k]`, in its unit and the same in all tests, and the others at none."""
        p, at = np.zeros(self.length), self.nuisances
        for k, (m, root) in enumerate(zip(self.mechanisms, self.roots, strict=True)):
            if k in sizes:
                p[at : at + self.tests] = np.linalg.solve(root, np.full(self.tests, sizes[k] - m.size.neutral))
            at += self.tests + len(m.shape)
        return p

    def applied(self, t: int, sizes: Array, shapes: Sequence[Array]) -> tuple[list, list[float]]:
        """The effects that act in test `t`, and how far each size lies beyond its limit."""
        effects, beyond = [], []
        for m, size, shape in zip(self.mechanisms, sizes[:, t], shapes, strict=True):
            within = float(np.clip(size, *m.size.limits))
            effects.append((m.effect, m.values(within, shape.tolist())))
            beyond.append(float(size) - within)
        return effects, beyond

    def acting(self, effects: Applied) -> list:
        """Without those of no size, which change nothing: what was worked out without them serves."""
        return [(e, v) for (e, v), m in zip(effects, self.mechanisms, strict=True) if v[m.size.name] != m.size.neutral]

    def residual(self, t: int, p: Array) -> Array:
        x, sizes, shapes = self.parts(p)
        effects, beyond = self.applied(t, sizes, shapes)
        r = self.model.residual(t, x, self.acting(effects))
        for k, over in enumerate(beyond):
            if over:
                r = r + over * self.by_size(t, x, effects, k)
        return r

    def by_size(self, t: int, x: Array, effects: Applied, k: int) -> Array:
        m = self.mechanisms[k]
        return self._by_value(t, x, effects, k, m.size)

    def _by_value(self, t: int, x: Array, effects: Applied, k: int, q) -> Array:
        """Derivative (N,) of the residual of test `t` by parameter `q` of mechanism `k`, from inside its limits."""
        effect, values = effects[k]
        step = SIZE_STEP * q.prior_sd
        for h in (step, -step):
            if q.limits[0] <= values[q.name] + h <= q.limits[1]:
                moved = list(effects)
                moved[k] = (effect, {**values, q.name: values[q.name] + h})
                try:
                    return self.model.column(t, x, self.acting(effects), self.acting(moved), h)
                except FAILED:
                    continue
        return np.zeros(self.model.tests[t].count)

    def linearised(self, t: int, p: Array, rates: Rates) -> tuple[Array, Array, Integers]:
        """Residual (N,), derivatives (k, N) and the numbers (k,) of the parameters of p they belong to."""
        x, sizes, shapes = self.parts(p)
        effects, beyond = self.applied(t, sizes, shapes)
        more = sum(t + 1 + len(m.shape) for m in self.mechanisms)
        r, jacobian, numbers = self.model.jacobian(t, x, self.acting(effects), rates, more)
        own: list[int] = []
        row, at = len(numbers), self.nuisances
        for k, (m, root) in enumerate(zip(self.mechanisms, self.roots, strict=True)):
            by_size = self.by_size(t, x, effects, k)
            if beyond[k]:
                r = r + beyond[k] * by_size
            np.multiply(root[t, : t + 1, None], by_size, out=jacobian[row : row + t + 1])
            own += range(at, at + t + 1)
            row, at = row + t + 1, at + self.tests
            for q in m.shape:
                jacobian[row] = q.prior_sd * self._by_value(t, x, effects, k, q)
                own.append(at)
                row, at = row + 1, at + 1
        return r, jacobian, np.concatenate([numbers, np.array(own, int)])

    def effects_of(self, p: Array) -> list[list]:
        _, sizes, shapes = self.parts(p)
        return [self.acting(self.applied(t, sizes, shapes)[0]) for t in range(self.tests)]

    def linearisation(self, p: Array, rates: Rates) -> Linearisation:
        return Linearisation(self.length, [self.linearised(t, p, rates) for t in range(self.tests)])

    def residuals(self, p: Array) -> list[Array] | None:
        """Residuals of every test; None where no spindle can be built."""
        return built(lambda t: self.residual(t, p), self.tests)

    def within_reach(self, move: Array) -> Array:
        """A step (n,), shortened to `LONGEST`."""
        return move * min(1.0, LONGEST / max(float((np.abs(move) * self.reach).max()), 1e-300))

    def at(self, p: Array, temper: float) -> Point:
        residuals = self.residuals(p)
        return Point(p, residuals, self.cost(p, temper, residuals) if residuals is not None else np.inf)

    def cost(self, p: Array, temper: float, residuals: Sequence[Array] | None = None) -> float:
        """chi2 with errors 1 / `temper` times the data's, and priors; infinite where no spindle can be built."""
        if residuals is None:
            residuals = self.residuals(p)
        return np.inf if residuals is None else temper**2 * sum(float(r @ r) for r in residuals) + float(p @ self.precision @ p)


def built(residual: Callable[[int], Array], tests: int) -> list[Array] | None:
    """`residual` of every test; None where no spindle can be built."""
    try:
        found = [residual(t) for t in range(tests)]
    except FAILED:
        return None
    return found if all(np.all(np.isfinite(r)) for r in found) else None


class Linearisation:
    """Derivatives of all tests at one point: information J^T J, and gradients J^T r of residuals there or near."""

    def __init__(self, length: int, rows: Sequence[tuple[Array, Array, Integers]]) -> None:
        self.length, self.rows = length, rows
        self.residuals = [r for r, _, _ in rows]
        self.by_test = []
        for _, jacobian, numbers in rows:
            information = np.zeros((length, length))
            information[np.ix_(numbers, numbers)] = jacobian @ jacobian.T
            self.by_test.append(information)
        self.information: Array = np.sum(self.by_test, axis=0)

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
        found = []
        for r, (_, jacobian, numbers) in zip(residuals, self.rows, strict=True):
            gradient = np.zeros(self.length)
            gradient[numbers] = jacobian @ r
            found.append(gradient)
        return found


def fit(
    model: CampaignModel, mechanisms: Sequence[Mechanism] = (), start: Array | Sequence[Array] | None = None, rates: Rates | None = None,
    tempers: Sequence[float] = TEMPERS, learned: Learned | None = None, moved: Array = UNMOVED,
) -> Fit:
    """The fit with the reference widths of all priors, or those `learned`, with what may be misjudged of mechanisms that `moved` the modes; of several
    starts from the one of least cost. While errors are taken too large, the thinned model serves.

    Raises what the model raises where even the start cannot be built.
    """
    problem = Problem(model, mechanisms, learned, moved)
    if start is None:
        p = np.zeros(problem.length)
    elif isinstance(start, np.ndarray):
        p = start.copy()
    else:
        p = min(start, key=lambda at: problem.cost(at, tempers[0])).copy()
    for temper in tempers:
        problem = Problem(model if temper == 1.0 else model.thinned, mechanisms, learned, moved)
        rates = problem.model.rates(problem.parts(p)[0], problem.effects_of(p), rates)
        p, lines, residuals = _settled(problem, p, rates, temper)
        done = problem, p, rates, temper, lines, residuals
    return _finished(*done)


@dataclass(frozen=True, eq=False)
class Point:
    """Parameters (n,), the residuals of every test there (None where no spindle can be built) and their cost."""

    p: Array
    residuals: Sequence[Array] | None
    cost: float


def _settled(problem: Problem, p: Array, rates: Rates, temper: float) -> tuple[Array, Linearisation, Sequence[Array]]:
    """Levenberg-Marquardt steps at one temper until the cost stands still, damped as in Madsen, Nielsen & Tingleff, *Methods for Non-Linear Least
    Squares Problems*, 2004, algorithm 3.16. Derivatives are taken anew only where a step does not do what it promises, and at the end of the last
    temper."""
    last, count = temper == 1.0, sum(d.count for d in problem.model.tests)
    lines = problem.linearisation(p, rates)
    here = Point(p, lines.residuals, problem.cost(p, temper, lines.residuals))
    current, damping, growth = True, LEAST_DAMPING, 2.0
    for _ in range(MOST_STEPS[last]):
        gradient, normal = lines.slope(problem, here, temper), temper**2 * lines.information + problem.precision
        damped = np.diag(temper**2 * np.diag(lines.information) + problem.least_stiff)  # not what is stiff only with all others held
        move = problem.within_reach(-_solved(normal + damping * damped, gradient))
        promised = -2 * float(gradient @ move) - float(move @ normal @ move)
        if promised < ENOUGH and current:
            break
        there = problem.at(here.p + move, temper)
        corrected = False
        if current and there.residuals is not None and here.cost - there.cost < POOR * promised:
            stiff = normal + max(damping, RAISED_DAMPING) * damped
            best = _corrected(problem, lines, stiff, temper, there)
            there, corrected = best, best is not there
        gained = here.cost - there.cost
        if gained > 0:
            here, growth = there, 2.0
            damping *= max(1 / 3, 1 - (2 * min(gained / promised, 1.0) - 1) ** 3)
            enough = max(ENOUGH, ENOUGH_FAR * (here.cost - count)) if last else max(1.0, ENOUGH_EARLY * here.cost)
            if gained < enough and (current or not last):
                break
        elif current:
            damping, growth = max(2.5 * growth * damping, RAISED_DAMPING), 2 * growth
            if growth > MOST_GROWTH:
                break
        if (corrected and gained > 0) or (gained < TRUSTED * promised and (gained > 0 or not current)):
            lines, current = problem.linearisation(here.p, rates), True
            here = replace(here, residuals=lines.residuals)
        elif gained > 0:
            current = False
    if last and not current:
        lines = problem.linearisation(here.p, rates)
        here = replace(here, residuals=lines.residuals)
    assert here.residuals is not None
    return here.p, lines, here.residuals


def _solved(matrix: Array, right: Array) -> Array:
    return np.asarray(np.linalg.solve(matrix, right), float)


def _corrected(problem: Problem, lines: Linearisation, normal: Array, temper: float, there: Point) -> Point:
    """The best of a few steps on from a point with the derivatives of the one before: peaks narrower than they move bend every valley, and a step along
    it is back on its floor after them."""
    best = there
    for _ in range(CORRECTIONS):
        there = problem.at(there.p + problem.within_reach(-_solved(normal, lines.slope(problem, there, temper))), temper)
        if there.residuals is None:
            break
        if there.cost < best.cost:
            best = there
    return best


def _finished(problem: Problem, p: Array, rates: Rates, temper: float, lines: Linearisation, residuals: Sequence[Array]) -> Fit:
    _, sizes, shapes = problem.parts(p)
    gradients = lines.gradients(residuals)
    by_test = tuple((float(r @ r), g, a) for r, g, a in zip(residuals, gradients, lines.by_test, strict=True))
    return Fit(
        problem.mechanisms,
        p,
        sizes,
        tuple(tuple(float(v) for v in s) for s in shapes),
        problem.roots,
        sum(b[0] for b in by_test),
        np.sum(gradients, axis=0),
        lines.information,
        by_test,
        sum(d.count for d in problem.model.tests),
        rates,
        temper,
        _moved(problem, p) if temper == 1.0 and problem.mechanisms else UNMOVED,
        problem.cost(p, temper, residuals),
    )


def _moved(problem: Problem, p: Array) -> Array:
    """Relative changes (mechanisms, tests, 2, modes) that each mechanism makes in the frequency and the damping of the reference modes, to first order."""
    model, (x, sizes, shapes) = problem.model, problem.parts(p)
    omega, damping = model.reference.omega[: model.reference.seen], model.reference.damping[: model.reference.seen]
    found = np.zeros((len(problem.mechanisms), problem.tests, 2, len(omega)))
    for t in range(problem.tests):
        plain = model.linear(t, x, []).matrices
        shape = np.linalg.solve(plain.mass, model.reference.over(plain.dofs)[:, : len(omega)])
        for k, (mechanism, (effect, values)) in enumerate(zip(problem.mechanisms, problem.applied(t, sizes, shapes)[0], strict=True)):
            if values[mechanism.size.name] == mechanism.size.neutral:
                continue
            acting = model.linear(t, x, [(effect, values)]).matrices
            if acting.dofs == plain.dofs:
                of_k, of_m, of_c = (
                    np.einsum("ni,nj,ji->i", shape, getattr(acting, w) - getattr(plain, w), shape) for w in ("stiffness", "mass", "damping")
                )
                found[k, t] = (of_k - omega**2 * of_m) / (2 * omega**2), of_c / (2 * damping * omega)
    return found
