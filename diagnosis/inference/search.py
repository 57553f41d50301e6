"""Which effects explain a campaign: the evidence of every explanation, mechanisms alone and together."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from thermospindle.diagnosis.forward.model import FAILED, CampaignModel
from thermospindle.diagnosis.inference.base.drawn import hit_when_it_was, without_effects
from thermospindle.diagnosis.inference.evidence import evidence
from thermospindle.diagnosis.inference.fit import TEMPERS, fit
from thermospindle.diagnosis.inference.freeform import alike, runs_against
from thermospindle.diagnosis.inference.hypothesis import (
    LITTLE,
    PLENTY,
    STRAIN,
    Hypothesis,
    Task,
    as_built,
    as_drawn,
    fitted,
    offsets_of_drawing,
    settled,
    widened,
)
from thermospindle.diagnosis.inference.pairs import ENOUGH, exchanged, joined, joined_early, rivals_beside, without_one
from thermospindle.diagnosis.inference.prior import wider_tolerances
from thermospindle.diagnosis.inference.problem import Problem
from thermospindle.diagnosis.inference.resonance import beside, with_resonance
from thermospindle.diagnosis.inference.screening import Screened
from thermospindle.diagnosis.inference.singles import (
    BEHIND,
    FAR,
    OCCAM,
    STRAINED,
    Singles,
    better,
    by_own_laws,
    carried_over,
    farthest_tolerance,
    fit_singles,
    of_each_name,
)
from thermospindle.diagnosis.parameters.mechanism import Mechanism, with_own_laws
from thermospindle.model.parallel import in_parallel, meanwhile
from thermospindle.model.types import Array

FINALISTS = {1: 3, 2: 2, 3: 1}  # explanations of one, two and three mechanisms that are fitted anew at the end, of the catalogue and free
NEAR = 100.0  # ln evidence behind the best, so far
UNLIKELY = 5.0  # ln evidence behind the best, of a way to act that need not be told
GAINED = {1: LITTLE, 2: ENOUGH, 3: PLENTY}  # ln evidence of one effect, of a second and of a third, of which other ways are asked: an effect that is not needed has no way
RIVALS = 3  # explanations of which other ways are asked, at most: each shares its prior among all that its effects have
WAYS = 8  # in which an effect of these may act too, at most, those that screening promises most of


@dataclass(frozen=True, eq=False)
class Search:
    """Everything tried: the model without effects, all hypotheses with the best first, what screening said, and which effects of the
    catalogue are a free form's own change with a law; `by_resonances` is what light resonances gain in ln evidence without effects."""

    model: CampaignModel
    base: Hypothesis
    hypotheses: tuple[Hypothesis, ...]
    screened: tuple[Screened, ...]
    alike: Mapping[str, frozenset[str]] = field(default_factory=dict)
    by_resonances: float = 0.0

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {len(self.hypotheses)} explanations, the likeliest {self.hypotheses[0]!r}>"


def search(
    model: CampaignModel, named: Sequence[Mechanism], free: Sequence[Mechanism], progress: Callable[[str], None] = lambda done: None,
    workers: int | None = None,
) -> Search:
    """The evidence of every explanation. A light resonance becomes part of the model where the data show it without effects, or
    beside the best single one; and one that moves with temperature where no effect alone explains them, and it explains more."""
    with meanwhile(partial(with_own_laws, named, model.spindle, [d.condition for d in model.tests]), workers) as own_laws:
        model, plain = hit_when_it_was(model, workers)
        model, none = with_resonance(model, plain, workers) or (model, plain)
        none = as_built(model, none)
        every = [*named, *own_laws(), *free]
    progress("fitted without effects")
    tried = fit_singles(model, none, every, progress, workers)
    best = max(tried.singles, key=lambda h: h.evidence.ln, default=none)
    with meanwhile(partial(beside, model, best, workers), workers) as told:
        together = _together(model, none, tried, every, workers)  # as they are where the model stays as it is
        wider, ended = told()
    before = model
    if len(wider.resonances) > len(model.resonances):
        model = wider
        none = as_built(model, without_effects(model, workers))
        if best.evidence.learned.errors > STRAIN:  # nothing was explained without it
            tried = fit_singles(model, none, every, lambda done: None, workers)  # steps that were counted already
        else:
            tried = carried_over(model, none, tried, len(before.parameters), workers)
    else:
        best = ended.with_mechanisms(best.mechanisms)
        moves = with_resonance(model, none, workers, moves=True) if best.evidence.learned.errors > STRAIN else None
        if moves is not None and moves[1].evidence.ln > best.evidence.ln + PLENTY:
            model, none = moves
            tried = fit_singles(model, none, every, lambda done: None, workers)
    tried, pairs = together if model is before else _together(model, none, tried, every, workers)
    singles = better([*tried.singles, best]) if model is before and best.mechanisms else tried.singles
    pairs = better([*pairs, *joined_early(model, none, tried, pairs, every, workers)])
    found = better([*singles, *pairs, *without_one(model, [*singles, *pairs], tried.most, tried.expected, workers)])
    found = better([*found, *exchanged(model, found, tried, workers)])
    found = better([*found, *rivals_beside(model, found, tried, workers)])
    progress("pairs fitted")
    finalists = _finalists(found)
    none, *at_the_end = _ended(model, max((h.evidence.ln for h in found), default=-np.inf), [none, *finalists], workers)
    none = _without_what_does_nothing(model, none, at_the_end)
    ranked = _with_anew(found, finalists, at_the_end)
    best = max((h for h in (none, *ranked) if not offsets_of_drawing(model, h)), key=lambda h: h.evidence.ln)
    if not wider_tolerances(tried.expected) and all(wider_tolerances(h.evidence.learned) for h in (none, best)):
        tried, beside_them = _beside_wider_tolerances(model, none, every, workers)
        ranked = better([*at_the_end, *beside_them])
    ranked += _other_ways(model, [none, *ranked], every, tried, workers)
    progress("the best fitted anew")
    laws = {m.name: m for m in reversed(named)}
    ranked = [h for h in ranked if not _against_its_law(model, none.fit.nuisance, h, laws)]
    hypotheses = tuple(sorted([none, *ranked], key=lambda h: -h.evidence.ln))
    return Search(model, none, hypotheses, tried.screened, _alike(model, none.fit.nuisance, hypotheses), none.evidence.ln - plain.evidence.ln)


def _together(model: CampaignModel, none: Hypothesis, tried: Singles, every: Sequence[Mechanism], workers: int | None) -> tuple[Singles, list[Hypothesis]]:
    """Single mechanisms, with laws of the data's own too, and those that are joined to the best."""
    tried = replace(tried, singles=better([*tried.singles, *by_own_laws(model, none, tried, every, workers)]))
    return tried, joined(model, none, tried.singles, every, tried.most, tried.expected, workers)


def _beside_wider_tolerances(model: CampaignModel, none: Hypothesis, every: Sequence[Mechanism], workers: int | None) -> tuple[Singles, list[Hypothesis]]:
    """Effects sought once more, where the likeliest explanation, but for offsets of the drawing, has tolerances wider than stated,
    as `none` has: what was found beside tolerances as stated is what stands in for the drawing best, and as far behind as it does not."""
    tried, pairs = _together(model, none, fit_singles(model, none, every, lambda done: None, workers), every, workers)
    found = better([*tried.singles, *pairs])
    found = better([*found, *rivals_beside(model, found, tried, workers)])
    finalists = _finalists(found)
    return tried, _with_anew(found, finalists, _ended(model, max((h.evidence.ln for h in found), default=-np.inf), finalists, workers))


def _with_anew(found: Sequence[Hypothesis], finalists: Sequence[Hypothesis], ended: Sequence[Hypothesis]) -> list[Hypothesis]:
    """All that was found, the finalists as they `ended`."""
    anew = dict(zip(map(id, finalists), ended, strict=True))
    return [anew.get(id(h), h) for h in found]


def _without_what_does_nothing(model: CampaignModel, none: Hypothesis, ended: Sequence[Hypothesis]) -> Hypothesis:
    """The model without effects, fitted on from the best explanation that explains more with
    effects of no size in any test: then it had stalled."""
    idle = [h for h in ended if h.evidence.ln > none.evidence.ln + OCCAM and all(h.idle)]
    if not idle:
        return none
    best = max(idle, key=lambda h: h.evidence.ln)
    learned = replace(best.evidence.learned, widths=(), departures=(), offsets=())
    try:
        again = fit(model, (), best.fit.nuisance, best.fit.rates, TEMPERS[-1:], learned)
        found = settled(model, Hypothesis(again, evidence(model, again, wide=True)))
    except FAILED:
        return none
    return max(none, found, key=lambda h: h.evidence.ln)


def _ended(model: CampaignModel, best: float, found: Sequence[Hypothesis], workers: int | None) -> list[Hypothesis]:
    """Each fitted anew, with the very mechanisms that it has here, beside the `best` ln evidence so far."""
    ended = in_parallel(partial(_at_the_end, model, best), [h.light for h in found], workers)
    return [e.with_mechanisms(h.mechanisms) for e, h in zip(ended, found, strict=True)]


def _at_the_end(model: CampaignModel, best: float, h: Hypothesis) -> Hypothesis:
    return _settled_at_the_end(model, best, h).light


def _settled_at_the_end(model: CampaignModel, best: float, h: Hypothesis) -> Hypothesis:
    if h.mechanisms:  # without any it is settled
        h = settled(model, h, best)
        if not wider_tolerances(h.evidence.learned) and not h.free and any(m.shape for m in h.mechanisms) and farthest_tolerance(model, h.fit.point, {}) > STRAINED:
            h = _from_the_drawing(model, h)
    return widened(model, h, best - FAR)


def _from_the_drawing(model: CampaignModel, h: Hypothesis) -> Hypothesis:
    """Once more with no tolerance off its drawing: a shape that went where tolerances were strained may lie in a valley of
    its own, where these hold it. A disk of 3 g and 12.5 mm was found as one of 3.9 +- 0.02 g and 15 mm, 80 in chi2 behind."""
    try:
        again = fit(model, h.mechanisms, as_drawn(model, h.fit.point), h.fit.rates, TEMPERS[-1:], h.evidence.learned, h.fit.moved, beaten=h.fit.cost)
        found = Hypothesis(again, evidence(model, again))
    except FAILED:
        return h
    return settled(model, found) if found.evidence.ln > h.evidence.ln + LITTLE and not found.evidence.rounded else h


def _other_ways(model: CampaignModel, ranked: Sequence[Hypothesis], every: Sequence[Mechanism], tried: Singles, workers: int | None) -> list[Hypothesis]:
    """The best explanation of the catalogue, and those that do nearly as well, with each of their effects acting in every other way
    that it has (the other bearing, the other ideal case of its law; by each law of its own where it has the data's): screening chose
    one, and what the data do not tell of that is not to be told as if they did. Not where one effect less, or none, does as well."""
    named = of_each_name([h for h in ranked if h.mechanisms and not h.free])
    best = max((h.evidence.ln for h in ranked), default=-np.inf)
    less = [*named, *(h for h in ranked if not h.mechanisms)]
    needed = [h for h in named if not any(set(o.names) < set(h.names) and o.evidence.ln > h.evidence.ln - GAINED[len(h.mechanisms)] for o in less)]
    rivals = [h for h in needed[:RIVALS] if h.evidence.ln > max(needed[0].evidence.ln - UNLIKELY, best - NEAR)]
    return [way for h in rivals for way in _ways_of(model, h, every, tried, workers)]


def _ways_of(model: CampaignModel, best: Hypothesis, every: Sequence[Mechanism], tried: Singles, workers: int | None) -> list[Hypothesis]:
    promised = {s.mechanism.variant: s.gain for s in sorted(tried.screened, key=lambda s: s.gain)}
    beside = len(best.mechanisms) > 1
    behind = np.inf if beside else BEHIND if tried.early else FAR  # screening says what an effect does by itself
    tasks, at = [], len(model.parameters)
    for k, (m, idle) in enumerate(zip(best.mechanisms, best.idle, strict=True)):
        sizes, after = at + len(model.tests), at + len(model.tests) + len(m.shape)
        least = promised.get(m.variant, -np.inf) - behind
        others = [o for o in every if o.name == m.name and o.kind in (m.kind, "law") and o.variant != m.variant and promised.get(o.variant, np.inf) > least]
        acts = best.evidence.sizes[k][np.abs(best.evidence.sizes[k] - m.size.neutral).argmax()]
        for o in [] if idle and beside else sorted(others, key=lambda o: -promised.get(o.variant, -np.inf))[:WAYS]:
            own = np.append(best.fit.point[at:sizes], np.zeros(len(o.shape))) if o.kind == m.kind else Problem(model, (o,)).start({0: acts})[len(model.parameters) :]
            start = np.concatenate([best.fit.point[:at], own, best.fit.point[after:]])
            tasks.append(Task((*best.mechanisms[:k], o, *best.mechanisms[k + 1 :]), (start,), -np.inf))
        at = after
    found = fitted(model, tasks, TEMPERS[-1:], best.fit, tried.most, tried.expected, workers, beaten=best.fit.cost + 2 * PLENTY)
    near = [h for h in found if h.evidence.ln > best.evidence.ln - UNLIKELY]
    return _ended(model, -np.inf, near, workers)


def _against_its_law(model: CampaignModel, x: Array, h: Hypothesis, laws: Mapping[str, Mechanism]) -> bool:
    """Whether an effect in an explanation has a law of the data's own that runs against its own: what it stands for is another's."""
    rows = zip(h.mechanisms, h.evidence.sizes, h.evidence.size_covariance, strict=True)
    return any(m.own_law and runs_against(model, x, laws[m.name], m, *told) for m, *told in rows)


def _finalists(found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The best of the catalogue and of the free forms, alone and in pairs, as far as they are near the best of all."""
    best = max((h.evidence.ln for h in found), default=0.0)
    chosen: list[Hypothesis] = []
    for free in (False, True):
        for count, most in FINALISTS.items():
            own = of_each_name([h for h in found if h.free == free and len(h.mechanisms) == count])
            chosen += [h for k, h in enumerate(own[:most]) if h.evidence.ln > best - NEAR or (count == 1 and k == 0)]
    return chosen


def _alike(model: CampaignModel, x: Array, hypotheses: Sequence[Hypothesis]) -> dict[str, frozenset[str]]:
    """Of every free form in a hypothesis the effects in others that change the same, with shapes
    that are those which they were fitted, as far as data tell, and could by another law."""
    every: dict[str, tuple[Mechanism, tuple[float, ...], Array]] = {}
    for h in reversed(hypotheses):  # the best one's last
        every |= {m.name: (m, shape, errors) for m, shape, errors in zip(h.mechanisms, h.fit.shapes, h.shape_errors, strict=True)}
    free, named = ([row for row in every.values() if row[0].free == kind] for kind in (True, False))

    def same(form: Mechanism) -> frozenset[str]:
        return frozenset(m.name for m, shape, errors in named if not m.effect.lasting and alike(model, x, form, m, shape, errors))

    return {form.name: same(form) for form, *_ in free}
