"""Which effects explain a campaign: every mechanism screened, the promising ones fitted, pairs of them, and the evidence of each.

Screening is linear: what each mechanism would do to every line in every test, beside all that nuisances can do, gives the evidence that it
would have. Where tolerances leave a misfit, it is done while errors are still taken 30 times too large, before tolerances are dragged off
to fit what they cannot; where modes that drift explain it, also as if none did. What falls behind there is not fitted further (successive
halving: Jamieson & Talwalkar, AISTATS 2016).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain, zip_longest

import numpy as np

from thermospindle.diagnosis.data.lines import LineData
from thermospindle.diagnosis.forward import nuisance as kinds_of
from thermospindle.diagnosis.forward.mechanism import Mechanism, strongest, with_own_laws
from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.inference.evidence import evidence
from thermospindle.diagnosis.inference.fit import TEMPERS, Fit, fit
from thermospindle.diagnosis.inference.freeform import alike, as_told_by
from thermospindle.diagnosis.inference.hypothesis import EARLY, LITTLE, PLENTY, STRAIN, Hypothesis, Task, fitted, scan, settled
from thermospindle.diagnosis.inference.prior import DRIFTING, Learned, steady, undrifted
from thermospindle.diagnosis.inference.problem import Problem
from thermospindle.diagnosis.inference.resonance import with_more, with_resonance
from thermospindle.diagnosis.inference.screening import Screened, screen
from thermospindle.model.parallel import in_parallel
from thermospindle.model.types import Array

BEHIND = 12.0  # tempered ln evidence behind the best from which a mechanism is not followed
MOST = {"law": 14, "own law": 4, "free": 4}  # mechanisms fitted at most, of the catalogue with their laws and with laws of the data's own, and free forms
LEADS, CLOSE = 2, 60.0  # single mechanisms of the catalogue to which a second is joined: so many, so near the best in ln evidence
OWED = {"law": 6, "own law": 2, "free": 1}  # promised by screening and not delivered, fitted once more at most
SECONDS = 2  # of each kind, joined to each of them
PAIRS = 6  # fitted at most
ENOUGH = 5.0  # ln evidence that a second mechanism must promise beside one that leaves a misfit
OCCAM = 20.0  # ln evidence that a second mechanism of no size may cost at most: less tells of a fit that stalled
STALLED = 0.1  # of the enlarged errors, which the model without effects must reach if fits are to start from it alone
FINALISTS = {1: 3, 2: 2, 3: 1}  # explanations of one, two and three mechanisms that are fitted anew at the end, of the catalogue and free
NEAR = 100.0  # ln evidence behind the best, so far
HIDING = 1e-3  # relative error of frequencies, from which constant discrepancies may hide an effect that is the same in every test
STRAINED = 4.0  # standard deviations of a build tolerance, from which likewise


@dataclass(frozen=True, eq=False)
class Search:
    """Everything tried: the model without effects, all hypotheses with the best first, what screening said, and which effects of the catalogue
    are a free form's own change with a law."""

    model: CampaignModel
    base: Hypothesis
    hypotheses: tuple[Hypothesis, ...]
    screened: tuple[Screened, ...]
    alike: Mapping[str, frozenset[str]] = field(default_factory=dict)


def search(
    model: CampaignModel, named: Sequence[Mechanism], free: Sequence[Mechanism], progress: Callable[[str], None] = lambda done: None,
    workers: int | None = None,
) -> Search:
    """The evidence of every explanation. A light resonance becomes part of the model where the data show it without effects, or beside the best single
    one."""
    every = [*named, *with_own_laws(named, model.spindle, strongest(model.spindle, [d.condition for d in model.tests])), *free]
    none = _without_effects(model)
    wider = with_resonance(model, none, workers)
    model, none = wider or (model, none)
    progress("fitted without effects")
    tried = _singles(model, none, every, progress, workers)
    best = max(tried.singles, key=lambda h: h.evidence.ln, default=none)
    wider = with_resonance(model, best, workers) if best.mechanisms else None
    if wider is not None:
        before, model = len(model.parameters), wider[0]
        none = _without_effects(model)
        if best.evidence.learned.errors > STRAIN:  # nothing was explained without it
            tried = _singles(model, none, every, lambda done: None, workers)  # steps that were counted already
        else:
            tried = _carried_over(model, none, tried, before, workers)
    tried = replace(tried, singles=_better([*tried.singles, *_by_own_laws(model, none, tried, every, workers)]))
    singles = tried.singles
    pairs = _joined(model, none, singles, every, tried.most, tried.expected, workers)
    progress("pairs fitted")
    finalists = _finalists([*singles, *pairs])
    anew = dict(zip(map(id, finalists), in_parallel(partial(settled, model), finalists, workers), strict=True))
    ranked = [replace(anew[id(h)], fit=replace(anew[id(h)].fit, mechanisms=h.mechanisms)) if id(h) in anew else h for h in [*singles, *pairs]]
    progress("the best fitted anew")
    hypotheses = tuple(sorted([none, *ranked], key=lambda h: -h.evidence.ln))
    return Search(model, none, hypotheses, tried.screened, _alike(model, none.fit.nuisance, hypotheses))


def _without_effects(model: CampaignModel) -> Hypothesis:
    first = fit(model)
    return settled(model, Hypothesis(first, evidence(model, first)))


@dataclass(frozen=True, eq=False)
class Singles:
    """Mechanisms one at a time: those fitted, what screening said of all, what priors pairs are fitted with and the cost they should reach."""

    singles: list[Hypothesis]
    screened: tuple[Screened, ...]
    most: float
    expected: Learned


def _singles(
    model: CampaignModel, none: Hypothesis, mechanisms: Sequence[Mechanism], progress: Callable[[str], None], workers: int | None
) -> Singles:
    learned = none.evidence.learned
    strained = learned.errors > STRAIN or any(learned.sizes.get(kind, 0.0) > 0 for kind in DRIFTING)
    expected = steady(learned)
    if strained:
        about, temper = fit(model, tempers=TEMPERS[: EARLY + 1], learned=expected), TEMPERS[EARLY]
    else:
        about, temper = none.fit, 1.0
    looked = screen(model if temper == 1.0 else model.thinned, about, temper, learned, mechanisms, workers)
    rankings = [looked]
    if strained and learned.errors <= STRAIN:  # drift alone explains what is missing: what would, were there none
        rankings.append(screen(model, none.fit, 1.0, undrifted(learned), mechanisms, workers))
    progress("effects screened")
    chosen = _chosen(rankings, strained)
    # tolerances strained to stand in for an effect must give way with it; while errors are enlarged they are not strained yet
    tasks = [_task((), about, s, -np.inf if strained else none.evidence.ln + s.gain - OCCAM, far=not strained) for s in chosen]
    most = _cost(model, none, expected)
    first = {s.mechanism.name for ranking in rankings for kind in MOST for s in promising(ranking, kind)[:1]}
    singles = _fitted_all(model, tasks, first, strained, about, most, expected, workers)
    if not strained:
        singles = _better([*singles, *_lasting(model, none, mechanisms, most, expected, workers)])
    elif len(rankings) > 1:
        singles = _better([*singles, *_owed(model, none, rankings[1], singles, most, expected, workers)])
    progress("effects fitted")
    return Singles(singles, tuple(looked), most, expected)


def _owed(
    model: CampaignModel, none: Hypothesis, looked: Sequence[Screened], singles: Sequence[Hypothesis], most: float, expected: Learned, workers
) -> list[Hypothesis]:
    """Fits of what screening beside the model whose modes drift promised, and what fits from enlarged errors on have not delivered: some of these ended
    early there, or stalled."""
    nothing = evidence(model, none.fit, [undrifted(none.evidence.learned)]).ln
    delivered: dict[str, float] = {}
    for h in singles:
        delivered[h.names[0]] = max(h.evidence.ln - nothing, delivered.get(h.names[0], -np.inf))
    tasks = []
    for kind, count in OWED.items():
        promised = promising(looked, kind)
        least = max(PLENTY, max((s.gain for s in promised), default=0.0) - CLOSE)
        late = [s for s in promised if s.gain > least and delivered.get(s.mechanism.name, -np.inf) < s.gain - OCCAM]
        tasks += [_task((), none.fit, s, -np.inf, far=True) for s in late[:count]]
    return fitted(model, tasks, TEMPERS[-1:], none.fit, most, expected, workers)


def _by_own_laws(model: CampaignModel, none: Hypothesis, tried: Singles, mechanisms: Sequence[Mechanism], workers) -> list[Hypothesis]:
    """Effects with laws of the data's own, fitted from what the best free form says. Where that does better than an effect which changes much the same by the
    law assumed, the effect may do as well by another; screening, which is linear, need not have seen it."""
    told = max((h for h in tried.singles if h.free), key=lambda h: h.evidence.ln, default=none)
    if not told.free or told.evidence.ln < none.evidence.ln + PLENTY:
        return []
    reached = {h.names[0]: h.evidence.ln for h in sorted(tried.singles, key=lambda h: h.evidence.ln)}
    tasks = []
    for m in mechanisms:
        if m.own_law and reached.get(m.name, -np.inf) < told.evidence.ln - LITTLE:
            sizes = as_told_by(model, none.fit.nuisance, told.mechanisms[0], m, told.evidence.sizes[0])
            if sizes is not None:
                start = Problem(model, (m,)).start({0: sizes - min(0.0, (sizes - m.size.limits[0]).min())})
                start[: len(model.parameters)] = told.fit.nuisance
                tasks.append(Task((m,), (start,), -np.inf))
    return fitted(model, tasks, TEMPERS[-1:], told.fit, tried.most, tried.expected, workers)


def _cost(model: CampaignModel, none: Hypothesis, expected: Learned) -> float:
    """The cost without effects of priors as `expected`, which no mechanism should exceed."""
    return fit(model, (), (none.evidence.mean, none.fit.point), none.fit.rates, TEMPERS[-1:], learned=expected).cost


def _carried_over(model: CampaignModel, none: Hypothesis, tried: Singles, before: int, workers: int | None) -> Singles:
    """Single mechanisms fitted on in a model with a light resonance more; `before` is the number of parameters that the model had."""
    expected = steady(none.evidence.learned)
    starts = [with_more(h.fit.point, before, len(model.parameters) - before) for h in tried.singles]
    tasks = [Task(h.mechanisms, (at,), -np.inf) for h, at in zip(tried.singles, starts, strict=True)]
    most = _cost(model, none, expected)
    return Singles(fitted(model, tasks, TEMPERS[-1:], none.fit, most, expected, workers), tried.screened, most, expected)


def _lasting(
    model: CampaignModel, lead: Hypothesis, mechanisms: Sequence[Mechanism], most: float, expected: Learned, workers
) -> list[Hypothesis]:
    """Effects that are the same in every test beside an explanation, from a scan of sizes with all else as drawn: constant discrepancies of the model
    or strained tolerances stand in for them, and beside those screening sees nothing. Followed to the end is what gains something while errors are
    still enlarged."""
    n = len(model.parameters)
    off = max((abs(float(v)) for q, v in zip(model.parameters, lead.evidence.mean, strict=False) if q.kind == kinds_of.BUILD), default=0.0)
    if lead.evidence.learned.sizes.get(kinds_of.STIFFNESS, 0.0) < HIDING and off < STRAINED:
        return []
    own = np.concatenate([np.zeros(n), lead.fit.point[n:]])
    drawn = {m.name: m for m in reversed(mechanisms) if m.effect.lasting and m.name not in lead.names}
    tasks = [
        Task((*lead.mechanisms, m), tuple(np.concatenate([own, at[n:]]) for at in scan(model, (m,))[1:]), -np.inf) for m in drawn.values()
    ]
    if not tasks:
        return []
    about = fit(model, lead.mechanisms, (own, lead.fit.point), tempers=TEMPERS[:-1], learned=steady(expected, lead.mechanisms))
    least = evidence(model, about).ln + LITTLE
    gaining = [h for h in fitted(model, tasks, TEMPERS[:-1], about, most, expected, workers) if h.evidence.ln > least]
    tasks = [Task(h.mechanisms, (h.fit.point,), -np.inf) for h in gaining]
    return fitted(model, tasks, TEMPERS[-1:], lead.fit, most, expected, workers)


def _better(found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Of those with the same mechanisms and laws the one with more evidence."""
    return list({frozenset((m.name, m.kind) for m in h.mechanisms): h for h in sorted(found, key=lambda h: h.evidence.ln)}.values())


def _of_each_name(found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Of those with the same mechanisms, whatever their laws, the one with more evidence; the best first."""
    return sorted({frozenset(h.names): h for h in sorted(found, key=lambda h: h.evidence.ln)}.values(), key=lambda h: -h.evidence.ln)


def _alike(model: CampaignModel, x: Array, hypotheses: Sequence[Hypothesis]) -> dict[str, frozenset[str]]:
    """Of every free form in a hypothesis the effects in others that change the same, with the shapes that they were fitted, and could by another law."""
    fitted = [(m, shape) for h in reversed(hypotheses) for m, shape in zip(h.mechanisms, h.fit.shapes, strict=True)]  # the best one's last
    every = {m.name: (m, shape) for m, shape in fitted}
    free, named = ([row for row in every.values() if row[0].free == kind] for kind in (True, False))
    return {f.name: frozenset(m.name for m, shape in named if not m.effect.lasting and alike(model, x, f, m, shape)) for f, _ in free}


def _task(lead: tuple[Mechanism, ...], about: Fit, s: Screened, hoped: float, far: bool) -> Task:
    """A screened mechanism beside those of the fit `about`: from there with its size, and with `far` from where screening says it leads or from
    there without it."""
    own = s.start[len(about.point) :]
    starts = (s.start, np.concatenate([about.point, 0 * own])) if far else (np.concatenate([about.point, own]),)
    return Task((*lead, s.mechanism), starts, hoped)


def _finalists(found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The best of the catalogue and of the free forms, alone and in pairs, as far as they are near the best of all."""
    best = max((h.evidence.ln for h in found), default=0.0)
    chosen: list[Hypothesis] = []
    for free in (False, True):
        for count, most in FINALISTS.items():
            own = _of_each_name([h for h in found if h.free == free and len(h.mechanisms) == count])
            chosen += [h for k, h in enumerate(own[:most]) if h.evidence.ln > best - NEAR or (count == 1 and k == 0)]
    return chosen


def promising(looked: Sequence[Screened], kind: str) -> list[Screened]:
    """The best variant of every mechanism of one kind, with the most promising first; of those with laws of the data's own only what promises more than the
    law that is assumed, at sizes that can be."""
    by_law = {s.mechanism.name: s.gain for s in sorted(looked, key=lambda s: s.gain) if s.mechanism.kind == "law"}
    best: dict[str, Screened] = {}
    for s in sorted((s for s in looked if s.mechanism.kind == kind and np.isfinite(s.gain)), key=lambda s: -s.gain):
        if kind != "own law" or (s.possible and s.gain > by_law.get(s.mechanism.name, -np.inf) + LITTLE):
            best.setdefault(s.mechanism.name, s)
    return list(best.values())


def _chosen(rankings: Sequence[Sequence[Screened]], strained: bool) -> list[Screened]:
    """The most promising mechanisms of every kind, from all rankings by turns. Where nothing is strained what screening promises is nearly what a fit will
    hold, and only what is near the best is followed."""
    found: list[Screened] = []
    for kind, most in MOST.items():
        followed = []
        for looked in rankings:
            ranked = promising(looked, kind)
            rivals = [s.gain for s in (*ranked, *(promising(looked, "law") if kind == "own law" else ()))]
            least = -LITTLE if strained else max([-LITTLE, *(gain - CLOSE for gain in rivals)])
            followed.append([s for s in ranked if s.gain > least or (s is ranked[0] and kind != "own law")])
        chosen: dict[str, Screened] = {}
        for s in filter(None, chain.from_iterable(zip_longest(*followed))):
            if len(chosen) < most:
                chosen.setdefault(s.mechanism.name, s)
        found += chosen.values()
    return found


def _fitted_all(model, tasks, first: Collection[str], strained: bool, about: Fit, most: float, expected: Learned, workers) -> list[Hypothesis]:
    """All tasks fitted; where much is missing in steps of temper, after which what fell behind is left, but for those that promised most at `first`: the
    first of two causes that shows while errors are enlarged need not be the one that tells more."""
    if not tasks:
        return []
    if not strained:
        return fitted(model, tasks, TEMPERS[-1:], about, most, expected, workers)
    peaks = any(isinstance(d, LineData) for d in model.tests)  # a table's frequencies follow their parameters as far as these go
    alive, early = list(tasks), peaks and about.temper * np.sqrt(about.chi2 / about.count) > STALLED
    for temper in TEMPERS[EARLY:]:
        found = fitted(model, alive, (temper,), about, most, expected, workers, afresh=early)
        early = False
        best = max(h.evidence.ln for h in found)
        keep = {id(h) for kind in MOST for h in sorted((h for h in found if h.mechanisms[0].kind == kind), key=lambda h: -h.evidence.ln)[:2]}
        kept = [h for h in found if id(h) in keep or h.names[0] in first or h.evidence.ln > best - BEHIND]
        if temper == TEMPERS[-1]:
            return found
        alive = [Task(h.mechanisms, (h.fit.point,), -np.inf) for h in kept]
    return []


def _joined(
    model, none: Hypothesis, singles: Sequence[Hypothesis], mechanisms: Sequence[Mechanism], most: float, expected: Learned, workers
) -> list[Hypothesis]:
    """The best single mechanisms with every other one that promises to gain beside them, and what promises to gain beside the best two."""
    ranked = _of_each_name(singles)
    gains = [h for h in ranked if h.evidence.ln > none.evidence.ln + LITTLE]
    leads = [h for h in gains if not h.free and h.evidence.ln > gains[0].evidence.ln - CLOSE][:LEADS] or [h for h in gains if not h.free][:1]
    if leads and (leads[0] is not gains[0] or leads[0].evidence.learned.errors > 1.0):
        leads += [h for h in gains if h.free][:1]  # two things that drift: where one of the catalogue does not do
    pairs = _beside(model, leads, mechanisms, most, expected, workers)
    if leads and not leads[0].free:
        pairs = _better([*pairs, *_lasting(model, leads[0], mechanisms, most, expected, workers)])
    best = max([*singles, *pairs], key=lambda h: h.evidence.ln, default=none)
    if len(best.mechanisms) < 2:
        return pairs
    best_named = max((h for h in pairs if not h.free), key=lambda h: h.evidence.ln, default=best)
    return [*pairs, *_beside(model, [best] if best_named is best else [best, best_named], mechanisms, most, expected, workers)]


def _beside(model, leads: Sequence[Hypothesis], mechanisms: Sequence[Mechanism], most: float, expected: Learned, workers) -> list[Hypothesis]:
    """One mechanism more, beside each of the `leads`: of the catalogue, and free beside what is not."""
    tasks, done = [], set()
    for lead in leads:
        asked = ENOUGH if lead.evidence.learned.errors > 1.0 else PLENTY
        drifts = all(m.free for m in lead.mechanisms)
        others = [m for m in mechanisms if m.name not in lead.names and not (drifts and not m.free) and not (m.free and lead.free and not drifts)]
        looked = screen(model, lead.fit, 1.0, undrifted(lead.evidence.learned), others, workers)
        for kind in MOST:
            for s in [s for s in promising(looked, kind) if s.gain > asked][:SECONDS]:
                whole = frozenset((m.name, m.kind) for m in (s.mechanism, *lead.mechanisms))
                if whole not in done:
                    done.add(whole)
                    tasks.append((lead.evidence.ln + s.gain, _task(lead.mechanisms, lead.fit, s, lead.evidence.ln - OCCAM, far=True)))
    chosen = [task for _, task in sorted(tasks, key=lambda t: -t[0])[:PAIRS]]
    if not chosen:
        return []
    tempers = TEMPERS[-1:] if leads[0].evidence.learned.errors == 1.0 else TEMPERS[-2:]
    return fitted(model, chosen, tempers, leads[0].fit, most, expected, workers)
