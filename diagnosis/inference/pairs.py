"""Mechanisms that act together: second ones beside those that explain most alone, and third ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.inference.fit import TEMPERS
from thermospindle.diagnosis.inference.hypothesis import DEPARTS, LITTLE, PLENTY, Hypothesis, Task, fitted, scan
from thermospindle.diagnosis.inference.prior import Learned, undrifted
from thermospindle.diagnosis.inference.screening import Screened, screen
from thermospindle.diagnosis.inference.singles import (
    CLOSE,
    FAR,
    MOST,
    OCCAM,
    Singles,
    better,
    fitted_in_steps,
    lasting,
    of_each_name,
    promising,
    strained,
    task_of,
    with_laws,
)
from thermospindle.diagnosis.parameters.mechanism import Mechanism

LEADS = 2  # single mechanisms of the catalogue to which a second is joined, of those near the best
SECONDS = 2  # of each kind, joined to each of them
PAIRS = 8  # fitted at most
EXCHANGED = 8  # effects tried in either's place
ENOUGH = 5.0  # ln evidence that a second mechanism must promise beside one that leaves a misfit, and a third at least
ASKED = {"law": LITTLE, "own law": ENOUGH, "free": PLENTY}
"""ln evidence that a second mechanism must promise beside one that leaves none: less than its odds
is by chance, and what is wrong in a law looks like a little of what may be anything."""


def joined(
    model, none: Hypothesis, singles: Sequence[Hypothesis], mechanisms: Sequence[Mechanism], most: float, expected: Learned, workers
) -> list[Hypothesis]:
    """The best single mechanisms with every other one that promises to gain beside them, and what promises to gain beside the best two."""
    ranked = of_each_name(singles)
    gains = [h for h in ranked if h.evidence.ln > none.evidence.ln + LITTLE]
    near = CLOSE if gains and strained(gains[0]) else OCCAM  # what leaves nothing is beaten by what another leads to if at all by its own prior alone
    leads = [h for h in gains if not h.free and h.evidence.ln > gains[0].evidence.ln - near][:LEADS] or [h for h in gains if not h.free][:1]
    if leads and (leads[0] is not gains[0] or leads[0].evidence.learned.errors > 1.0):
        leads += [h for h in gains if h.free][:1]  # two things that drift, or one beside an effect: where one of the catalogue does not do
    pairs = _beside(model, leads, mechanisms, most, expected, workers)
    if leads and not leads[0].free:
        pairs = better([*pairs, *lasting(model, leads[0], mechanisms, most, expected, workers)])
    best = max([*singles, *pairs], key=lambda h: h.evidence.ln, default=none)
    if len(best.mechanisms) < 2:
        return pairs
    best_named = max((h for h in pairs if not h.free), key=lambda h: h.evidence.ln, default=best)
    return [*pairs, *_beside(model, [best] if best_named is best else [best, best_named], mechanisms, most, expected, workers)]


def joined_early(
    model: CampaignModel, none: Hypothesis, tried: Singles, pairs: Sequence[Hypothesis], mechanisms: Sequence[Mechanism], workers
) -> list[Hypothesis]:
    """Two mechanisms joined while errors are still enlarged, where the best that was tried leaves
    something: where a fit has not arrived, nothing tells what is missing beside it, and two causes
    of which neither alone moves peaks to where they are let none arrive."""
    best = max((none, *tried.singles, *pairs), key=lambda h: h.evidence.ln)
    if not tried.early or not strained(best):
        return []
    found: dict[frozenset, tuple[float, Task]] = {}
    for lead in of_each_name([h for h in tried.early if not h.free])[:LEADS]:
        others = [m for m in mechanisms if m.name not in lead.names]
        looked = screen(model.thinned, lead.fit, lead.fit.temper, none.evidence.learned, others, workers)
        for s in _seconds(looked, lambda kind: LITTLE):
            task = task_of(lead.mechanisms, lead.fit, s, -np.inf, far=True)
            found.setdefault(with_laws(task.mechanisms), (lead.evidence.ln + s.gain, task))
    chosen = [task for _, task in sorted(found.values(), key=lambda t: -t[0])[:PAIRS]]
    return fitted_in_steps(model, chosen, (), tried.early[0].fit, tried.most, tried.expected, workers)[0]


def without_one(model: CampaignModel, found: Sequence[Hypothesis], most: float, expected: Learned, workers) -> list[Hypothesis]:
    """The best explanations of several mechanisms, of all and of the catalogue, without each of them, as far as the rest was not
    fitted together, or fell behind without one that does nothing, so that it had stalled: they came to be one by one, and what came
    first may be what the others do without (backward elimination: Draper & Smith, *Applied Regression Analysis*, 3rd ed. 1998, 15.3)."""
    ranked = sorted(found, key=lambda h: h.evidence.ln)
    known = {with_laws(h.mechanisms): h.evidence.ln for h in ranked}
    leads = {id(best): best for best in (next((h for h in reversed(ranked) if not h.free or free), None) for free in (True, False)) if best is not None}
    tasks: dict[frozenset, Task] = {}
    for lead in leads.values():
        at = len(model.parameters)
        for k, (m, idle) in enumerate(zip(lead.mechanisms, lead.idle, strict=True)):
            rest, own = (*lead.mechanisms[:k], *lead.mechanisms[k + 1 :]), len(model.tests) + len(m.shape)
            if rest and (with_laws(rest) not in known or (idle and known[with_laws(rest)] < lead.evidence.ln - LITTLE)):
                tasks.setdefault(with_laws(rest), Task(rest, (np.delete(lead.fit.point, slice(at, at + own)),), -np.inf))
            at += own
    if not tasks:
        return []
    tried = fitted(model, list(tasks.values()), TEMPERS[-2:-1], ranked[-1].fit, most, expected, workers)
    near = [h for h in tried if TEMPERS[-2] ** 2 * (h.fit.chi2 - ranked[-1].fit.chi2) < 2 * FAR]  # a thinned model's lines weigh as much as all
    beaten = min(h.fit.cost for h in leads.values()) + 2 * FAR
    return fitted(model, [Task(h.mechanisms, (h.fit.point,), -np.inf) for h in near], TEMPERS[-1:], ranked[-1].fit, most, expected, workers, beaten=beaten)


def exchanged(
    model: CampaignModel, found: Sequence[Hypothesis], tried: Singles, workers
) -> list[Hypothesis]:
    """Two effects of which neither has its law, with either exchanged for each of those that promised or explained most alone:
    where peaks are far off, screening beside the first chooses badly, and what has no law of its own stands in for anything."""
    best = max((h for h in found if not h.free), key=lambda h: h.evidence.ln, default=None)
    if best is None or len(best.mechanisms) != 2 or min(best.evidence.learned.departures) < DEPARTS:
        return []
    reached = {s.mechanism.name: s.gain for s in sorted(tried.screened, key=lambda s: s.gain) if s.mechanism.kind == "law"}
    reached |= {h.names[0]: h.evidence.ln for h in sorted(tried.singles, key=lambda h: h.evidence.ln) if not h.free}
    known = {with_laws(h.mechanisms) for h in found}
    ways = {s.mechanism.name: s.mechanism for s in reversed(tried.screened) if s.mechanism.kind == "law"}  # the first of each, which has all its shape
    others = sorted((m for m in ways.values() if m.name not in best.names), key=lambda m: -reached[m.name])[:EXCHANGED]
    pairs = [(kept, m) for kept in best.mechanisms for m in others if with_laws((kept, m)) not in known]
    tasks = [Task(pair, scan(model, pair), -np.inf) for pair in pairs]
    return fitted(model, tasks, TEMPERS[1:], best.fit, tried.most, tried.expected, workers, beaten=best.fit.cost + 2 * FAR)


def rivals_beside(model: CampaignModel, found: Sequence[Hypothesis], tried: Singles, workers) -> list[Hypothesis]:
    """The best two effects of the catalogue with either exchanged for each that alone is behind it by less than the second gains, and
    than `CLOSE`: alone it may be behind by what it does not take of the second (balls that grow at speed in blind campaign 3521 were
    17 behind a warmer ring that took some of a gain by 40)."""
    best = max((h for h in found if not h.free), key=lambda h: h.evidence.ln, default=None)
    if best is None or len(best.mechanisms) != 2:
        return []
    singles = [h for h in of_each_name(tried.singles) if not h.free]
    known, n = {frozenset(h.names) for h in found}, len(model.parameters)
    second = n + len(model.tests) + len(best.mechanisms[0].shape)
    tasks: list[tuple[float, Task]] = []
    for k, own in enumerate((slice(second, None), slice(n, second))):  # of the one that is kept
        kept, exchanged_for = best.mechanisms[1 - k], best.names[k]
        alone = max((h.evidence.ln for h in singles if h.names == (exchanged_for,)), default=np.inf)
        least = alone - min(best.evidence.ln - alone, CLOSE)
        near = [h for h in singles if h.evidence.ln > least and frozenset((h.names[0], kept.name)) not in known and h.names[0] != kept.name]
        tasks += [(h.evidence.ln - alone, Task((*h.mechanisms, kept), (np.concatenate([h.fit.point, best.fit.point[own]]),), -np.inf)) for h in near]
    chosen = [task for _, task in sorted(tasks, key=lambda t: -t[0])[:EXCHANGED]]
    return fitted(model, chosen, TEMPERS[-1:], best.fit, tried.most, tried.expected, workers, beaten=best.fit.cost + 2 * FAR)


def _asked(lead: Hypothesis, kind: str) -> float:
    """ln evidence that one mechanism more must promise."""
    if lead.evidence.learned.errors > 1.0:
        return ENOUGH
    return max(ASKED[kind], ENOUGH) if len(lead.mechanisms) > 1 else ASKED[kind]


def _seconds(looked: Sequence[Screened], asked: Callable[[str], float]) -> list[Screened]:
    """Of each kind the most promising, as far as they promise more than is `asked` of the kind."""
    return [s for kind in MOST for s in promising(looked, kind)[:SECONDS] if s.gain > asked(kind)]


def _beside(model, leads: Sequence[Hypothesis], mechanisms: Sequence[Mechanism], most: float, expected: Learned, workers) -> list[Hypothesis]:
    """One mechanism more, beside each of the `leads`: of the catalogue, and free beside what is not free or free alone."""
    tasks, done = [], set()
    for lead in leads:
        drifts = all(m.free for m in lead.mechanisms)
        others = [m for m in mechanisms if m.name not in lead.names and not (m.free and lead.free and not drifts)]
        looked = screen(model, lead.fit, 1.0, undrifted(lead.evidence.learned), others, workers)
        for s in _seconds(looked, partial(_asked, lead)):
            whole = with_laws((s.mechanism, *lead.mechanisms))
            if whole not in done:
                done.add(whole)
                tasks.append((lead.evidence.ln + s.gain, task_of(lead.mechanisms, lead.fit, s, lead.evidence.ln - OCCAM, far=True)))
    chosen = [task for _, task in sorted(tasks, key=lambda t: -t[0])[:PAIRS]]
    if not chosen:
        return []
    tempers = TEMPERS[-1:] if leads[0].evidence.learned.errors == 1.0 else TEMPERS[-2:]
    return fitted(model, chosen, tempers, leads[0].fit, most, expected, workers)
