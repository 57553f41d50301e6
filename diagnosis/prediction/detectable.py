"""The smallest size of every effect that a campaign would have shown.

What an effect of some size really does to every line is worked out, and tolerances, measuring errors and what was
learned that the model is wrong by are fitted anew beside it; the size is changed until what is left is worth
`ASKED` in ln evidence. First order alone, as screening has it, would be far too small or too large for what grows
otherwise than in proportion: a film that must first part the surfaces, a seat that must first lose its play.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial

import numpy as np
from scipy.optimize import brentq

from thermospindle.diagnosis.forward.model import Applied, CampaignModel
from thermospindle.diagnosis.forward.rates import rates_of
from thermospindle.diagnosis.inference.fit import Fit, promised, rated
from thermospindle.diagnosis.inference.hypothesis import Hypothesis
from thermospindle.diagnosis.inference.prior import Learned, as_stated
from thermospindle.diagnosis.inference.problem import Linearisation, Point, Problem, built
from thermospindle.diagnosis.inference.screening import Screened, linearised, visibilities
from thermospindle.diagnosis.inference.search import Search
from thermospindle.diagnosis.parameters.mechanism import Mechanism
from thermospindle.model.parallel import in_parallel
from thermospindle.model.types import Array

ASKED = 5.0  # ln evidence
NEAR = 0.05  # relative error of a size
TRIES = 8  # sizes of an effect, until one shows and another does not
FARTHEST = float(np.log(10.0))  # that one is from the next
GROWS = 3.0  # times
STEPS = 40  # at most, of everything else beside it
KEPT = 0.75  # of what steps promised, from which derivatives of an earlier point are believed when they promise little more
SHOWS, HIDES = 3.0, 2.0  # standard errors of a typical size, from which an effect alone shows, and up to which it hides beside another


def smallest(
    model: CampaignModel, about: Fit, learned: Learned, screened: Sequence[Screened], workers: int | None = None
) -> dict[str, tuple[Mechanism, float]]:
    """The variant of every effect of the catalogue that shows at the smallest size, and that size
    less the neutral one, in its unit: none where it does not show within its limits. `about` is the
    fit without effects; discrepancies and errors are as large as `learned`."""
    best: dict[str, tuple[float, Mechanism]] = {}
    for s in screened:
        m = s.mechanism
        if m.kind == "law" and s.visibility > 0:
            size = abs(m.size.typical - m.size.neutral) * np.sqrt(2 * ASKED) / s.visibility
            best[m.name] = min(best.get(m.name, (np.inf, m)), (size, m), key=lambda row: row[0])
    tasks = list(best.values())
    sizes = in_parallel(partial(_smallest, model.thinned, rated(model, about), learned), tasks, workers)
    return {m.name: (m, size) for (_, m), size in zip(tasks, sizes, strict=True) if size is not None}


def unseen_beside(found: Search, accepted: Hypothesis) -> tuple[str, ...]:
    """Of the effects that resemble those of an explanation the ones whose typical size these data
    would show alone, but not beside it: how much of what it explains is theirs, nobody can tell."""
    alike = {name for m in accepted.mechanisms for name in m.effect.resembles} - set(accepted.names)
    asked = [s.mechanism for s in found.screened if s.mechanism.name in alike and s.mechanism.kind == "law" and s.visibility > 0]
    if not asked:
        return ()
    alone, beside = in_parallel(partial(_shown, found.model, accepted.evidence.learned, asked), [found.base.fit, accepted.fit])
    return tuple(name for name in alone if alone[name] > SHOWS and beside[name] < HIDES)


def _shown(model: CampaignModel, learned: Learned, mechanisms: Sequence[Mechanism], about: Fit) -> dict[str, float]:
    """Standard errors of the typical size of every effect beside what is fitted already, of the variant that shows most."""
    seen: dict[str, float] = {}
    for m, shows in zip(mechanisms, visibilities(model, about, learned, mechanisms), strict=True):
        seen[m.name] = max(shows, seen.get(m.name, 0.0))
    return seen


def _smallest(model: CampaignModel, about: Fit, learned: Learned, task: tuple[float, Mechanism]) -> float | None:
    size, m = task
    sign = 1.0 if m.size.typical >= m.size.neutral else -1.0
    limit = abs((m.size.limits[1] if sign > 0 else m.size.limits[0]) - m.size.neutral)
    late: list[tuple[float, Point]] = []  # the last size, and what was fitted beside it

    def shown(size: float) -> float:
        point = _fitted_beside(model, about, learned, m, sign * size, late)
        late[:] = [(sign * size, point)] if np.isfinite(point.cost) else late
        return float(np.sqrt(point.cost)) / learned.errors

    return _size_that_shows(shown, m, min(size, limit), limit)


def _size_that_shows(shown: Callable[[float], float], m: Mechanism, first: float, limit: float) -> float | None:
    """The size, up to a `limit`, that shows by as many standard errors as are asked, where `shown` tells by how many
    one does: infinitely many where no spindle can be built with it. By the rule of three from the `first` on, until one
    shows and another does not, and between them by Brent's method, in ln of both. None where the limit does not show."""

    @cache
    def above(ln_size: float) -> float:
        """ln of how many times more than asked, nought where that is near."""
        size = min(float(np.exp(ln_size)), limit)
        seen = shown(size)
        found = float(np.log(max(seen, 1e-300) / standard_errors(m, size, seen))) if np.isfinite(seen) else np.inf
        return 0.0 if abs(found) < NEAR else float(np.clip(found, -FARTHEST, FARTHEST))

    at = float(np.log(first))
    for _ in range(TRIES):
        if above(at) == 0.0:
            return float(np.exp(at))
        following = min(at - above(at), float(np.log(limit)))
        if following == at:
            return None
        if above(at) * above(following) < 0.0:
            return float(np.exp(brentq(above, at, following, xtol=NEAR)))
        at = following
    return None


def standard_errors(m: Mechanism, size: float, seen: float) -> float:
    """How many standard errors are worth `ASKED` in ln evidence, where a `size` shows by `seen` of them: what it explains,
    less what it costs to leave its prior open (MacKay, *Neural Computation* 4 (1992) 415, Eq. 2.6, of one parameter)."""
    return float(np.sqrt(2 * ASKED + np.log1p((m.size.prior_sd * seen / size) ** 2)))


def _fitted_beside(model: CampaignModel, about: Fit, learned: Learned, m: Mechanism, size: float, known: Sequence[tuple[float, Point]] = ()) -> Point:
    """All else (P,), beside `about`, fitted to an effect of `size` less its neutral one, of
    infinite cost where no spindle can be built with it.

    The spindle `about` with the effect is taken for measured, without noise. First a share of its size that does no more than noise
    would, then `GROWS` times as much and so on, everything else going on from where it went (a homotopy: Allgower & Georg, *Numerical
    Continuation Methods*, 1990), or from a size that is `known` and as near: peaks that moved by their widths lead nowhere by themselves.
    """
    base, shape = linearised(model, about), [q.neutral for q in m.shape]
    problem = Problem(model, (), replace(as_stated(learned.sizes), errors=learned.errors), about.moved)

    def made(size: float) -> list[Array] | None:
        return _moved(model, about.nuisance, [(m.effect, m.values(m.size.neutral + size, shape))], base)

    nothing, whole = np.zeros(problem.length), made(size)
    if whole is None:
        return Point(nothing, None, np.inf)
    near = [(of, point) for of, point in known if 1 / GROWS <= size / of <= GROWS]
    if near:
        of, point = near[0]
        return _beside(problem, about, base, whole, point.p * size / of)
    far = problem.cost(nothing, 1.0, whole)
    share, at = min(1.0, float(np.sqrt(sum(d.count for d in model.tests) / max(far, 1e-300)))), nothing
    while share < 1.0:
        moved, following = made(share * size), min(GROWS * share, 1.0)
        at = (at if moved is None else _beside(problem, about, base, moved, at).p) * following / share
        share = following
    return _beside(problem, about, base, whole, at)


def _beside(problem: Problem, about: Fit, base: Linearisation, moved: Sequence[Array], start: Array) -> Point:
    """All else (P,), beside `about`, where it leaves least of residuals that have `moved`. Steps of
    Gauss and Newton until they gain little, with the derivatives of `about` (the chord method: Ortega
    & Rheinboldt, *Iterative Solution of Nonlinear Equations*, 1970, 7.1) for as long as these lead on."""
    model = problem.model

    def at(step: Array) -> Point:
        there = _moved(model, about.nuisance + step, [], base)
        left = None if there is None else [r - d for r, d in zip(there, moved, strict=True)]
        return Point(step, left, np.inf if left is None else problem.cost(step, 1.0, left))

    left = [-d for d in moved]
    nothing = Point(np.zeros(len(start)), left, problem.cost(np.zeros(len(start)), 1.0, left))
    here = min(nothing, at(start), key=lambda point: point.cost) if start.any() else nothing
    rates = first = rated(model, about).rates
    lines, current, holds = base, True, True
    for _ in range(STEPS):
        slope, normal = lines.slope(problem, here, 1.0), problem.precision + lines.information
        move = problem.step(here.p, slope, normal)
        there, hoped = at(here.p + move), promised(slope, normal, move)
        if there.cost < (1 - NEAR) * here.cost:
            holds = holds and here.cost - there.cost > KEPT * hoped
            here, current = there, False
            continue
        if (current or holds) and hoped < NEAR * here.cost:
            break
        if current:
            if rates is not first:
                break
            rates = rates_of(model, about.nuisance + here.p, [[] for _ in model.tests], rates)  # it is not the lines that are old
        assert rates is not None
        lines, current, holds = problem.linearisation(about.nuisance + here.p, rates), True, True
    return here


def _moved(model: CampaignModel, x: Array, effects: Applied, base: Linearisation) -> list[Array] | None:
    """How far all residuals move from those of `base`; None where no spindle can be built."""
    return built(lambda t: model.residual(t, x, effects) - base.residuals[t], len(base.residuals))
