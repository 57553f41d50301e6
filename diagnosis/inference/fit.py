"""Fitting nuisance parameters and the sizes of mechanisms to a campaign: Levenberg-Marquardt with priors, tempered.

Peaks that do not overlap do not pull at each other: with the data's own errors a fit stalls. Errors are therefore first
taken thousands of times too large, so that priors rule and all peaks move together, then less and less (a homotopy: Allgower
& Georg, *Numerical Continuation Methods*, 1990). What moves a peak by its width bends every valley of the cost: a step along
one is corrected with the derivatives at hand before it is judged. A step to where no spindle can be built is taken shorter.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from thermospindle.diagnosis.forward.linear import Rates
from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.forward.rates import rates_of
from thermospindle.diagnosis.inference.prior import UNMOVED, Learned
from thermospindle.diagnosis.inference.problem import LONGEST, Linearisation, Point, Problem
from thermospindle.diagnosis.parameters.mechanism import Mechanism
from thermospindle.model.types import Array

TEMPERS = (3e-4, 3e-3, 0.03, 0.3, 1.0)
MOST_STEPS = (30, 40)  # while errors are taken too large, and at the end
LEAST_DAMPING, RAISED_DAMPING = 1e-7, 1e-3  # of a parameter's own curvature, at first and after a step that was refused
SHORTENED, SHORTER = 3, 4.0  # steps refused one after the other, each so much shorter than the one before: a bent valley asks for shorter steps along it, and damping would hold all that is little known
MOST_GROWTH = 2.0**6  # of the damping, one refusal after the other
ENOUGH = 0.3  # of the cost, from which a fit goes on
ENOUGH_FAR, ENOUGH_EARLY = 5e-3, 0.02  # share of what is left beyond noise, and of all the cost while errors are taken too large, likewise
KEPT, TRUSTED, POOR = 0.75, 0.6, 0.25  # of the gain promised: below the first a step is corrected, and from there it may be longer; derivatives stay in use; below the last no step is long
CORRECTIONS = 2
NO_NEARER = 0.05  # of what the cost is above one that beats it, however far it goes on: what gains less in a step comes no nearer
AFAR = 30.0  # chi2 a number at the start, from which errors are enlarged first


@dataclass(frozen=True)
class Held:
    """A shape parameter, by its number, at a limit that it would leave: half the slope of chi2 towards the inside, and half its
    curvature with all else fitted anew, without its own prior's: what that is beside chi2 depends on how large errors are taken."""

    number: int
    slope: float
    curvature: float


@dataclass(frozen=True, eq=False)
class Fit:
    """Where a model stands: nuisance values x (P,) in prior standard deviations, sizes (mechanisms, tests) and shape parameters of
    every mechanism in their units; and the quadratic of chi2 about it over all parameters p = [x, z, u]: chi2 + 2 gradient (p - point)
    + (p - point) information (p - point), with z the whitened sizes (`roots`) and u the shape parameters, mechanism by mechanism.

    `by_test` holds chi2, gradient and information of every test. What is `held` at a limit
    (`Problem.held`) is no parameter of the quadratic.
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
    rates: Rates | None  # None of one that has travelled: those of a flexible shaft are a hundred times as large as all else (`rated`)
    temper: float
    moved: Array = field(default_factory=lambda: UNMOVED)  # (1 + mechanisms, tests, 2, modes), of frequency and damping of every mode, relative
    held: tuple[Held, ...] = ()
    cost: float = np.nan  # chi2, its errors 1 / temper times the data's, and priors: those that it was fitted with
    owed: float = 0.0  # by how much less the quadratic promises, which no step has found

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {' + '.join(m.name for m in self.mechanisms) or 'none'}: chi2 {self.chi2:.6g} of {self.count} numbers>"

    @property
    def nuisance(self) -> Array:
        return self.point[: len(self.point) - sum(len(r) + len(m.shape) for r, m in zip(self.roots, self.mechanisms, strict=True))]


def rated(model: CampaignModel, fit: Fit) -> Fit:
    """A fit with the rates at its point."""
    return fit if fit.rates is not None else replace(fit, rates=rates_of(model, fit.nuisance, Problem(model, fit.mechanisms).effects_of(fit.point)))


def fit(
    model: CampaignModel, mechanisms: Sequence[Mechanism] = (), start: Array | Sequence[Array] | None = None, rates: Rates | None = None,
    tempers: Sequence[float] = TEMPERS, learned: Learned | None = None, moved: Array = UNMOVED, beaten: float = np.inf,
    done: Callable[[int, int], object] = lambda count, of: None,
) -> Fit:
    """The fit with the reference widths of all priors, or those `learned`, with what may be misjudged of conditions
    and mechanisms that `moved` the modes; of several starts from the one of least cost, and from there with errors as
    much larger at first as it is `AFAR`. While they are taken too large, the thinned model serves. What ends above
    the cost `beaten` need not end exactly. `done` is told how many of the steps in temper are, and of how many.

    Raises what the model raises where even the start cannot be built.
    """
    def at(temper: float) -> Problem:
        return Problem(model if temper == 1.0 else model.thinned, mechanisms, learned, moved)

    problem = at(tempers[0])
    if start is None:
        p = np.zeros(problem.length)
    elif isinstance(start, np.ndarray):
        p = start.copy()
    else:
        p = min(start, key=lambda start: problem.cost(start, tempers[0])).copy()
    p = problem.within_limits(p)
    if rates is None:
        rates = rates_of(problem.model, problem.parts(p)[0], problem.effects_of(p))
    every = (*_from_afar(problem, p, tempers[0]), *tempers)
    for count, temper in enumerate(every, 1):
        problem = at(temper)
        p, lines, residuals, rates = _settled(problem, p, rates, temper, beaten)
        found = problem, p, rates, temper, lines, residuals
        done(count, len(every))
    return _finished(*found)


def _from_afar(problem: Problem, p: Array, first: float) -> Sequence[float]:
    """Tempers before the `first` one, of which the earliest takes errors so large that the start is near."""
    far = problem.cost(p, first) / (AFAR * sum(d.count for d in problem.model.tests))
    before = [t for t in TEMPERS if t < first]
    near = [k for k, t in enumerate(before) if far * (t / first) ** 2 <= 1.0]
    return before[near[-1] :] if far > 1.0 and near else ()


@dataclass(frozen=True)
class _Pace:
    """How the next step is taken: how stiff, how much stiffer after a refusal, how far derivatives
    are believed, and how short it is after steps that were `refused` one after the other."""

    damping: float = LEAST_DAMPING
    growth: float = 2.0
    longest: float = LONGEST
    refused: int = 0
    trusted: float = np.inf

    def unshortened(self) -> _Pace:
        """Where shorter steps lead nowhere."""
        return replace(self, refused=SHORTENED, trusted=np.inf)

    def shorter(self, length: float) -> _Pace:
        return replace(self, refused=self.refused + 1, trusted=length / SHORTER)

    def longer(self) -> _Pace:
        return replace(self, refused=0, trusted=2 * self.trusted)

    def looser(self, kept: float) -> _Pace:
        """After a step that kept so much of what it promised (Madsen et al., algorithm 3.16)."""
        return replace(self, damping=self.damping * max(1 / 3, 1 - (2 * min(kept, 1.0) - 1) ** 3), growth=2.0)

    def stiffer(self) -> _Pace:
        return replace(self, damping=max(2.5 * self.growth * self.damping, RAISED_DAMPING), growth=2 * self.growth, trusted=np.inf)


def _settled(problem: Problem, p: Array, rates: Rates, temper: float, beaten: float) -> tuple[Array, Linearisation, Sequence[Array], Rates]:
    """Levenberg-Marquardt steps at one temper until the cost stands still, damped as in Madsen, Nielsen &
    Tingleff, *Methods for Non-Linear Least Squares Problems*, 2004, algorithm 3.16. Derivatives are taken anew
    only where a step does not do what it promises, or gains little; at the last temper the rates too, for the cost
    stands still where the gradient is right. There a step that is refused is shortened before it is made stiffer."""
    last, count = temper == 1.0, sum(d.count for d in problem.model.tests)
    lines = problem.linearisation(p, rates)
    here, pace = Point(p, lines.residuals, problem.cost(p, temper, lines.residuals)), _Pace()
    current, rated = True, not last  # lines, and rates, of this very point
    for _ in range(MOST_STEPS[last]):
        gradient, normal = lines.slope(problem, here, temper), temper**2 * lines.information + problem.precision
        damped = np.diag(temper**2 * np.diag(lines.information) + problem.least_stiff)  # not what is stiff only with all others held
        move = problem.step(here.p, gradient, normal + pace.damping * damped, min(pace.longest, pace.trusted))
        length, hoped = problem.length_of(move), promised(gradient, normal, move)
        exact, limited = current and rated, length > 0.99 * pace.trusted
        if hoped < ENOUGH and exact:
            if not limited:
                break
            pace = pace.unshortened()
            continue
        there, corrected = problem.at(here.p + move, temper), False
        if current and there.residuals is not None and here.cost - there.cost < KEPT * hoped:
            stiff = normal + max(pace.damping, RAISED_DAMPING) * damped
            best = _corrected(problem, lines, stiff, temper, there)
            there, corrected = best, best is not there
        gained = here.cost - there.cost
        if gained < POOR * hoped:
            pace = replace(pace, longest=LONGEST)
        elif gained > KEPT * hoped and not corrected and length > 0.99 * pace.longest:
            pace = replace(pace, longest=2 * pace.longest)
        enough = max(ENOUGH, ENOUGH_FAR * (here.cost - count)) if last else max(1.0, ENOUGH_EARLY * here.cost)
        no_nearer = last and gained < NO_NEARER * (here.cost - beaten)
        shortens = last and exact and pace.refused < SHORTENED
        if gained > 0:
            here = there
            bent = shortens and gained < min(POOR * hoped, enough)  # it may go on in shorter steps
            rests = gained < enough and (exact and not bent and not limited if last else True)
            if rests or (no_nearer and current):
                break
            pace = pace.looser(gained / hoped)
            pace = pace.shorter(length) if bent else pace.longer()
        elif shortens:
            pace = pace.shorter(length)
        elif exact:
            pace = pace.stiffer()
            if pace.growth > MOST_GROWTH:
                break
        poor = (corrected and gained > 0) or gained < max(TRUSTED * hoped, enough) or no_nearer
        if poor and (gained > 0 or not exact):
            if last and (current or gained < enough):  # it is not the lines that are old
                rates, rated = rates_of(problem.model, problem.parts(here.p)[0], problem.effects_of(here.p), rates), True
            lines, current = problem.linearisation(here.p, rates), True
            here = replace(here, residuals=lines.residuals)
        elif gained > 0:
            current, rated = False, not last
    if last and not current:
        lines = problem.linearisation(here.p, rates)
        here = replace(here, residuals=lines.residuals)
    assert here.residuals is not None
    return here.p, lines, here.residuals, rates


def promised(slope: Array, normal: Array, move: Array) -> float:
    """By how much less a quadratic of half slope (n,) and half curvature (n, n) is after a move (n,)."""
    return -2 * float(slope @ move) - float(move @ normal @ move)


def _corrected(problem: Problem, lines: Linearisation, normal: Array, temper: float, there: Point) -> Point:
    """The best of a few steps on from a point with the derivatives of the one before: peaks
    narrower than they move bend every valley, and a step along it is back on its floor after them."""
    best = there
    for _ in range(CORRECTIONS):
        there = problem.at(there.p + problem.step(there.p, lines.slope(problem, there, temper), normal), temper)
        if there.residuals is None:
            break
        if there.cost < best.cost:
            best = there
    return best


def _finished(problem: Problem, p: Array, rates: Rates, temper: float, lines: Linearisation, residuals: Sequence[Array]) -> Fit:
    _, sizes, shapes = problem.parts(p)
    slope, normal = lines.slope(problem, Point(p, residuals, np.nan), temper), temper**2 * lines.information + problem.precision
    held = _held(problem, p, slope, normal)
    rest = problem.step(p, slope, normal, np.inf)
    lines = lines.without(np.array([h.number for h in held], int))
    by_test = tuple((float(r @ r), g, a) for r, g, a in zip(residuals, lines.gradients(residuals), lines.by_test, strict=True))
    return Fit(
        problem.mechanisms,
        p,
        sizes,
        tuple(tuple(float(v) for v in s) for s in shapes),
        problem.roots,
        sum(b[0] for b in by_test),
        np.sum([b[1] for b in by_test], axis=0),
        lines.information,
        by_test,
        sum(d.count for d in problem.model.tests),
        rates,
        temper,
        _moved(problem, p) if temper == 1.0 else UNMOVED,
        held,
        problem.cost(p, temper, residuals),
        max(promised(slope, normal, rest), 0.0),
    )


def _held(problem: Problem, p: Array, slope: Array, normal: Array) -> tuple[Held, ...]:
    numbers = problem.held(p, slope)
    if not len(numbers):
        return ()
    free = np.setdiff1d(np.arange(problem.length), numbers)
    inner = np.linalg.solve(normal[np.ix_(free, free)], normal[np.ix_(free, numbers)])
    curvature = np.diag(normal - problem.precision)[numbers] - np.einsum("ij,ij->j", normal[np.ix_(free, numbers)], inner)
    by_data = np.abs(slope - problem.precision @ p)[numbers]
    return tuple(Held(int(n), float(s), float(c)) for n, s, c in zip(numbers, by_data, curvature, strict=True))


def _moved(problem: Problem, p: Array) -> Array:
    """Relative changes (1 + mechanisms, tests, 2, modes) that the conditions, and each mechanism,
    make in the frequency and the damping of the reference modes, to first order."""
    model, (x, sizes, shapes) = problem.model, problem.parts(p)
    own = model.reference
    found = np.zeros((1 + len(problem.mechanisms), *model.by_condition.shape))
    found[0] = model.by_condition
    for t in range(problem.tests):
        plain = model.linear(t, x, []).matrices
        for k, (mechanism, (effect, values)) in enumerate(zip(problem.mechanisms, problem.applied(t, sizes, shapes), strict=True), 1):
            if values[mechanism.size.name] == mechanism.size.neutral:
                continue
            acting = model.linear(t, x, [(effect, values)]).matrices
            if acting.dofs == plain.dofs:
                found[k, t] = own.moved(plain, acting)
    return found
