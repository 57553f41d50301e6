"""The smallest size of every effect that a campaign would have shown.

What an effect of some size really does to every line is worked out, and tolerances, measuring errors and what was learned that the model is wrong by are
fitted anew beside it; the size is changed until what is left is worth `ASKED` in ln evidence. First order alone, as screening has it, would be far too
small or too large for what grows otherwise than in proportion: a film that must first part the surfaces, a seat that must first lose its play.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from thermospindle.diagnosis.forward.mechanism import Mechanism
from thermospindle.diagnosis.forward.model import Applied, CampaignModel
from thermospindle.diagnosis.forward.rates import rates_of
from thermospindle.diagnosis.inference.fit import Fit
from thermospindle.diagnosis.inference.hypothesis import Hypothesis
from thermospindle.diagnosis.inference.prior import Learned, as_stated
from thermospindle.diagnosis.inference.problem import Linearisation, Point, Problem, built
from thermospindle.diagnosis.inference.screening import Screened, linearised, screen
from thermospindle.diagnosis.inference.search import Search
from thermospindle.model.parallel import in_parallel
from thermospindle.model.types import Array

ASKED = 5.0  # ln evidence
NEAR = 0.05  # relative error of a size
TRIES = 8  # sizes of an effect
SHARPER = 3.0  # times
STEPS = 40  # at most, of everything else beside it
SHOWS, HIDES = 3.0, 2.0  # standard errors of a typical size, from which an effect alone shows, and up to which it hides beside another


def smallest(
    model: CampaignModel, about: Fit, learned: Learned, screened: Sequence[Screened], workers: int | None = None
) -> dict[str, tuple[Mechanism, float]]:
    """The variant of every effect of the catalogue that shows at the smallest size, and that size less the neutral one, in its unit: none where
    it does not show within its limits. `about` is the fit without effects; discrepancies and errors are as large as `learned`."""
    best: dict[str, tuple[float, Mechanism]] = {}
    for s in screened:
        m = s.mechanism
        if m.kind == "law" and s.visibility > 0:
            size = abs(m.size.typical - m.size.neutral) * np.sqrt(2 * ASKED) / s.visibility
            best[m.name] = min(best.get(m.name, (np.inf, m)), (size, m), key=lambda row: row[0])
    tasks = list(best.values())
    sizes = in_parallel(partial(_smallest, model.thinned, about, learned), tasks, workers)
    return {m.name: (m, size) for (_, m), size in zip(tasks, sizes, strict=True) if size is not None}


def unseen_beside(found: Search, accepted: Hypothesis) -> tuple[str, ...]:
    """Of the effects that resemble those of an explanation the ones whose typical size these data would show alone, but not beside it: how much of
    what it explains is theirs, nobody can tell."""
    alike = {name for m in accepted.mechanisms for name in m.effect.resembles} - set(accepted.names)
    asked = [s.mechanism for s in found.screened if s.mechanism.name in alike and s.mechanism.kind == "law" and s.visibility > 0]
    alone, beside = (_shown(found.model, h.fit, accepted.evidence.learned, asked) for h in (found.base, accepted))
    return tuple(name for name in alone if alone[name] > SHOWS and beside[name] < HIDES)


def _shown(model: CampaignModel, about: Fit, learned: Learned, mechanisms: Sequence[Mechanism]) -> dict[str, float]:
    """Standard errors of the typical size of every effect beside what is fitted already, of the variant that shows most."""
    seen: dict[str, float] = {}
    for s in screen(model, about, 1.0, learned, mechanisms, turned=False):
        seen[s.mechanism.name] = max(s.visibility, seen.get(s.mechanism.name, 0.0))
    return seen


def _smallest(model: CampaignModel, about: Fit, learned: Learned, task: tuple[float, Mechanism]) -> float | None:
    """By the rule of three from the size of first order, then by halves between what is too small and too large, or cannot be built."""
    size, m = task
    sign = 1.0 if m.size.typical >= m.size.neutral else -1.0
    limit = abs((m.size.limits[1] if sign > 0 else m.size.limits[0]) - m.size.neutral)
    low, high = 0.0, limit
    size = min(size, limit)
    for _ in range(TRIES):
        seen = visibility(model, about, learned, m, m.size.neutral + sign * size)
        if not np.isfinite(seen):  # no spindle can be built with so much of it
            high = size
            size = (low + high) / 2
            continue
        asked = standard_errors(m, size, seen)
        if abs(seen / asked - 1) < NEAR:
            break
        if seen < asked:
            if size == limit:
                return None
            low = size
        else:
            high = size
        size = float(np.clip(size * asked / max(seen, asked / 10), low, high))
        if size in (low, high) and size != limit:
            size = (low + high) / 2
    return size if np.isfinite(seen) else None


def standard_errors(m: Mechanism, size: float, seen: float) -> float:
    """How many standard errors are worth `ASKED` in ln evidence, where a `size` shows by `seen` of them: what it explains, less what it costs to leave
    its prior open (MacKay, *Neural Computation* 4 (1992) 415, Eq. 2.6, of one parameter)."""
    return float(np.sqrt(2 * ASKED + np.log1p((m.size.prior_sd * seen / size) ** 2)))


def visibility(model: CampaignModel, about: Fit, learned: Learned, m: Mechanism, size: float) -> float:
    """Standard errors, as `learned`, that are left of an effect of `size` in all tests after all else is fitted anew beside it; infinite where no spindle
    can be built with it.

    The spindle `about` with the effect is taken for measured, without noise. Steps of Gauss and Newton move everything else until they gain little, with the
    derivatives of `about` (the chord method: Ortega & Rheinboldt, *Iterative Solution of Nonlinear Equations*, 1970, 7.1) for as long as these lead on: first with errors so large that what is left
    is no more than noise would be, and `SHARPER` from there, for peaks that moved by their widths lead nowhere by themselves.
    """
    base, shape = linearised(model, about), [q.neutral for q in m.shape]
    moved = _moved(model, about.nuisance, [(m.effect, m.values(size, shape))], base)
    if moved is None:
        return np.inf
    problem = Problem(model, (), replace(as_stated(learned.sizes), errors=learned.errors))

    def beside(step: Array, temper: float) -> Point:
        there = _moved(model, about.nuisance + step, [], base)
        if there is None:
            return Point(step, None, np.inf)
        left = [r - d for r, d in zip(there, moved, strict=True)]
        return Point(step, left, problem.cost(step, temper, left))

    here = beside(np.zeros(problem.length), 1.0)
    temper = min(1.0, float(np.sqrt(sum(d.count for d in model.tests) / max(here.cost, 1e-300))))
    here, lines, rates, current = replace(here, cost=temper**2 * here.cost), base, about.rates, True
    for _ in range(STEPS):
        there = beside(here.p + problem.step(here.p, lines.slope(problem, here, temper), problem.precision + temper**2 * lines.information), temper)
        if there.cost < (1 - NEAR) * here.cost:
            here, current = there, False
            continue
        if current and temper < 1.0:
            temper = min(SHARPER * temper, 1.0)
            here = replace(here, cost=problem.cost(here.p, temper, here.residuals))
            continue
        if current and rates is not about.rates:
            break
        if current:  # it is not the lines that are old
            rates = rates_of(model, about.nuisance + here.p, [[] for _ in model.tests], rates)
        lines, current = problem.linearisation(about.nuisance + here.p, rates), True
    return float(np.sqrt(here.cost)) / learned.errors


def _moved(model: CampaignModel, x: Array, effects: Applied, base: Linearisation) -> list[Array] | None:
    """How far all residuals move from those of `base`; None where no spindle can be built."""
    return built(lambda t: model.residual(t, x, effects) - base.residuals[t], len(base.residuals))
