"""Which effects explain a campaign: every mechanism screened, the promising ones fitted, pairs of them, and the evidence of each.

Screening is linear: what each mechanism would do to every line in every test, beside all that nuisances can do, gives the evidence that it
would have. Where tolerances leave a misfit, it is done while errors are still taken 30 times too large, before tolerances are dragged off
to fit what they cannot. What falls behind there is not fitted further (successive halving: Jamieson & Talwalkar, AISTATS 2016).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from thermospindle.diagnosis.inference.evidence import Evidence, Learned, evidence
from thermospindle.diagnosis.inference.fit import TEMPERS, Fit, Problem, fit
from thermospindle.diagnosis.inference.mechanism import Mechanism
from thermospindle.diagnosis.inference.model import FAILED, CampaignModel
from thermospindle.model.parallel import in_parallel
from thermospindle.model.types import Array

EARLY = 2  # number in TEMPERS at which large effects are told from each other
BEHIND = 12.0  # tempered ln evidence behind the best from which a mechanism is not followed
NAMED, FREE = 7, 3  # mechanisms fitted at most, of the catalogue and free forms
LEADS, CLOSE = 2, 60.0  # single mechanisms of the catalogue to which a second is joined: so many, so near the best in ln evidence
SECONDS = 2  # of each kind, joined to each of them
PAIRS = 6  # fitted at most
ENOUGH, PLENTY = 5.0, 12.0  # ln evidence that a second mechanism must promise: beside one that leaves a misfit, and one that leaves none
OCCAM = 20.0  # ln evidence that a second mechanism of no size may cost at most: less tells of a fit that stalled
LITTLE = 2.0  # ln evidence that a screened mechanism must promise


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """Mechanisms that act together (none, one, several), fitted, with their evidence."""

    fit: Fit
    evidence: Evidence

    @property
    def mechanisms(self) -> tuple[Mechanism, ...]:
        return self.fit.mechanisms

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(m.name for m in self.mechanisms)

    @property
    def free(self) -> bool:
        return any(m.free for m in self.mechanisms)


@dataclass(frozen=True)
class Screened:
    """What screening promises of a mechanism: ln evidence it would gain, and where a fit should start (all parameters, as a fit has them)."""

    mechanism: Mechanism
    gain: float
    start: Array
    visibility: float  # standard errors by which its typical size shows, beside what nuisances can do


@dataclass(frozen=True, eq=False)
class Search:
    """Everything tried: the model without effects, all hypotheses with the best first, and what screening said."""

    model: CampaignModel
    base: Hypothesis
    hypotheses: tuple[Hypothesis, ...]
    screened: tuple[Screened, ...]


def search(
    model: CampaignModel, named: Sequence[Mechanism], free: Sequence[Mechanism], progress: Callable[[str], None] = lambda done: None,
    workers: int | None = None,
) -> Search:
    stages: list[Fit] = []
    base = fit(model, keep=stages)
    none = Hypothesis(base, evidence(model, base))
    progress("fitted without effects")
    learned = none.evidence.learned
    strained = learned.errors > 1.0 or any(size > 0 for size in learned.sizes.values())
    about = stages[EARLY - 1] if strained else base
    temper = TEMPERS[EARLY] if strained else 1.0
    looked = _screen(model, about, temper, none.evidence.learned, [*named, *free], workers)
    progress("effects screened")
    chosen = _chosen(looked)
    # tolerances strained to stand in for an effect must give way with it; while errors are enlarged they are not strained yet
    starts = [np.concatenate([about.point, s.start[len(about.point) :]]) if strained else s.start for s in chosen]
    hoped = [-np.inf if strained else none.evidence.ln + s.gain for s in chosen]
    tasks = [((s.mechanism,), start, hope) for s, start, hope in zip(chosen, starts, hoped, strict=True)]
    singles = _fitted_all(model, tasks, strained, about, _cost(base), workers)
    progress("effects fitted")
    pairs = _joined(model, none, singles, [*named, *free], workers)
    progress("pairs fitted")
    ranked = sorted([none, *singles, *pairs], key=lambda h: -h.evidence.ln)
    return Search(model, none, tuple(ranked), tuple(looked))


def _screen(model, about: Fit, temper: float, learned: Learned, mechanisms: Sequence[Mechanism], workers) -> list[Screened]:
    errors = replace(learned, widths=(), departures=(), errors=learned.errors if temper == 1.0 else 1.0)
    nothing = evidence(model, replace(about, temper=temper), errors).ln
    function = partial(_screened, model, about.point, about.rates, temper, errors, nothing)
    found = in_parallel(function, list(mechanisms), workers)
    return [replace(s, mechanism=m) for s, m in zip(found, mechanisms, strict=True)]


def _screened(
    model: CampaignModel, point: Array, rates, temper: float, learned: Learned, nothing: float, mechanism: Mechanism
) -> Screened:
    """The quadratic about the model without effects, with the mechanism's sizes beside the nuisances, at `temper`."""
    problem = Problem(model, [mechanism])
    lines = model.about(point, rates)
    p = np.concatenate([point, np.zeros(problem.length - problem.nuisances)])
    x, sizes, shapes = problem.parts(p)
    by_test, bare = [], []
    for t, (r, jacobian, numbers) in enumerate(lines):
        effects, _ = problem.applied(t, sizes, shapes)
        try:
            column = problem.by_size(t, x, effects, 0)
        except FAILED:
            column = np.zeros(len(r))
        gradient, information = np.zeros(problem.length), np.zeros((problem.length, problem.length))
        own = problem.nuisances + np.arange(t + 1)
        weights = problem.roots[0][t, : t + 1]
        cross = jacobian.T @ column
        gradient[numbers] = jacobian.T @ r
        gradient[own] = weights * (column @ r)
        information[np.ix_(numbers, numbers)] = jacobian.T @ jacobian
        information[np.ix_(numbers, own)] = np.outer(cross, weights)
        information[np.ix_(own, numbers)] = np.outer(weights, cross)
        information[np.ix_(own, own)] = np.outer(weights, weights) * (column @ column)
        by_test.append((float(r @ r), gradient, information))
        bare.append((column, cross, numbers))
    seen = _visibility(bare, by_test, problem.nuisances, mechanism)
    if seen == 0.0:
        return Screened(mechanism, -np.inf, p, 0.0)
    whole = Fit(
        (mechanism,), p, sizes, tuple(tuple(float(v) for v in s) for s in shapes), problem.roots, sum(b[0] for b in by_test),
        np.sum([b[1] for b in by_test], axis=0), np.sum([b[2] for b in by_test], axis=0), tuple(by_test),
        sum(d.count for d in model.tests), rates, temper,
    )  # fmt: skip
    found = evidence(model, whole, learned)
    return Screened(mechanism, found.ln - nothing, found.mean, seen)


def _visibility(bare, by_test, n: int, mechanism: Mechanism) -> float:
    """Standard errors of the typical size, the same in all tests, after the nuisances are fitted anew."""
    typical = mechanism.size.typical - mechanism.size.neutral
    information = np.sum([a[:n, :n] for _, _, a in by_test], axis=0) + np.eye(n)
    cross, own = np.zeros(n), 0.0
    for column, c, numbers in bare:
        cross[numbers] += c
        own += float(column @ column)
    return float(abs(typical) * np.sqrt(max(own - float(cross @ np.linalg.solve(information, cross)), 0.0)))


def _chosen(looked: Sequence[Screened]) -> list[Screened]:
    """The most promising mechanisms, one variant of each effect, of the catalogue and of the free forms."""
    found: list[Screened] = []
    for free, most in ((False, NAMED), (True, FREE)):
        best: dict[str, Screened] = {}
        for s in sorted((s for s in looked if s.mechanism.free == free and np.isfinite(s.gain)), key=lambda s: -s.gain):
            best.setdefault(s.mechanism.name, s)
        found += [s for s in list(best.values())[:most] if s.gain > -LITTLE]
    return found


def _fitted_all(model, tasks, strained: bool, about: Fit, most: float, workers) -> list[Hypothesis]:
    """All tasks fitted; where much is missing in steps of temper, after which what fell behind is left."""
    if not tasks:
        return []
    if not strained:
        return _fits(model, tasks, TEMPERS[-1:], about, most, workers)
    alive = list(tasks)
    for temper in TEMPERS[EARLY:]:
        found = _fits(model, alive, (temper,), about, most, workers)
        best = max(h.evidence.ln for h in found)
        keep = {id(h) for kind in (False, True) for h in sorted((h for h in found if h.free == kind), key=lambda h: -h.evidence.ln)[:2]}
        kept = [h for h in found if id(h) in keep or h.evidence.ln > best - BEHIND]
        if temper == TEMPERS[-1]:
            return found
        alive = [(h.mechanisms, h.fit.point, -np.inf) for h in kept]
    return []


def _fits(model, tasks, tempers, about: Fit, most: float, workers) -> list[Hypothesis]:
    found = in_parallel(partial(_fit_one, model, about.rates, tuple(tempers), most), tasks, workers)
    return [
        Hypothesis(replace(h.fit, mechanisms=mechanisms), h.evidence) for h, (mechanisms, _, _) in zip(found, tasks, strict=True) if h is not None
    ]


def _fit_one(model: CampaignModel, rates, tempers, most: float, task) -> Hypothesis | None:
    """A fit; once more with errors enlarged where it did not reach `most`, the cost of a model that it contains, or the evidence that screening
    `hoped` for: then it had stalled."""
    mechanisms, start, hoped = task
    try:
        found = fit(model, mechanisms, start, rates, tempers)
        reached = Hypothesis(found, evidence(model, found))
        if found.temper == 1.0 and (_cost(found) > most + LITTLE or reached.evidence.ln < hoped - LITTLE):
            afresh = np.concatenate([np.zeros(len(model.parameters)), start[len(model.parameters) :]])
            again = fit(model, mechanisms, afresh, rates, TEMPERS[1:])
            if _cost(again) < _cost(found):
                reached = Hypothesis(again, evidence(model, again))
        return reached
    except FAILED:
        return None


def _cost(found: Fit) -> float:
    return found.chi2 + float(found.point @ found.point)


def _joined(model, none: Hypothesis, singles: Sequence[Hypothesis], mechanisms: Sequence[Mechanism], workers) -> list[Hypothesis]:
    """The best single mechanisms with every other one that promises to gain beside them."""
    ranked = sorted(singles, key=lambda h: -h.evidence.ln)
    gains = [h for h in ranked if h.evidence.ln > none.evidence.ln + LITTLE]
    leads = [h for h in gains if not h.free and h.evidence.ln > gains[0].evidence.ln - CLOSE][:LEADS] or [h for h in gains if not h.free][:1]
    if leads and (leads[0] is not gains[0] or leads[0].evidence.learned.errors > 1.0):
        leads += [h for h in gains if h.free][:1]  # two things that drift: where one of the catalogue does not do
    tasks, done = [], set()
    for lead in leads:
        asked = ENOUGH if lead.evidence.learned.errors > 1.0 else PLENTY
        others = [m for m in mechanisms if m.name != lead.names[0] and not (lead.free and not m.free)]
        looked = in_parallel(partial(_second, model, lead.fit, lead.evidence.learned), others, workers)
        for free in (False, True):
            best: dict[str, tuple[float, Mechanism, Array]] = {}
            for (gain, start), m in sorted(zip(looked, others, strict=True), key=lambda row: -row[0][0]):
                if m.free == free and gain > asked:
                    best.setdefault(m.name, (gain, m, start))
            for gain, m, start in list(best.values())[:SECONDS]:
                names = frozenset({m.name, lead.names[0]})
                if names not in done:
                    done.add(names)
                    tasks.append((lead.evidence.ln + gain, (*lead.mechanisms, m), start, lead.evidence.ln - OCCAM))
    tasks = sorted(tasks, key=lambda t: -t[0])[:PAIRS]
    if not tasks:
        return []
    tempers = TEMPERS[-1:] if leads[0].evidence.learned.errors == 1.0 else TEMPERS[-2:]
    return _fits(model, [(mechanisms, start, hoped) for _, mechanisms, start, hoped in tasks], tempers, leads[0].fit, _cost(none.fit), workers)


def _second(model: CampaignModel, lead: Fit, learned: Learned, mechanism: Mechanism) -> tuple[float, Array]:
    """ln evidence that a mechanism beside the fitted `lead` would gain, linear; and where a fit of both should start."""
    problem = Problem(model, [*lead.mechanisms, mechanism])
    p = np.concatenate([lead.point, np.zeros(problem.length - len(lead.point))])
    x, sizes, shapes = problem.parts(p)
    first = len(lead.point)
    key = lead.point.tobytes()
    if key not in model._linearised:
        model._linearised.clear()
        alone = Problem(model, lead.mechanisms)
        model._linearised[key] = [alone.linearised(t, lead.point, lead.rates) for t in range(alone.tests)]
    by_test = []
    for t, (r, jacobian, numbers) in enumerate(model._linearised[key]):
        effects, _ = problem.applied(t, sizes, shapes)
        try:
            column = problem.by_size(t, x, effects, len(lead.mechanisms))
        except FAILED:
            column = np.zeros(len(r))
        gradient, information = np.zeros(problem.length), np.zeros((problem.length, problem.length))
        own = first + np.arange(t + 1)
        weights = problem.roots[-1][t, : t + 1]
        cross = jacobian.T @ column
        chi2, g, a = lead.by_test[t]
        gradient[:first], information[:first, :first] = g, a
        gradient[own] = weights * (column @ r)
        information[np.ix_(numbers, own)] = np.outer(cross, weights)
        information[np.ix_(own, numbers)] = np.outer(weights, cross)
        information[np.ix_(own, own)] = np.outer(weights, weights) * (column @ column)
        by_test.append((chi2, gradient, information))
    whole = replace(
        lead, mechanisms=problem.mechanisms, point=p, sizes=sizes, shapes=tuple(tuple(float(v) for v in s) for s in shapes), roots=problem.roots,
        gradient=np.sum([b[1] for b in by_test], axis=0), information=np.sum([b[2] for b in by_test], axis=0), by_test=tuple(by_test),
    )  # fmt: skip
    found, alone_evidence = evidence(model, whole, learned), evidence(model, lead, learned)
    return found.ln - alone_evidence.ln, found.mean
