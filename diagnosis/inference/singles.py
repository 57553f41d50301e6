"""Mechanisms one at a time: every one screened, the promising ones fitted.

Screening is linear: what each mechanism would do to every line in every test, beside all that nuisances can do, gives the evidence that it
would have. Where tolerances leave a misfit, it is done while errors are still taken 30 times too large, before tolerances are dragged off
to fit what they cannot; where these follow the peaks all the same, or modes that drift explain it, also with the errors as they are and as
if none did (a delay of 1 us in one channel of blind campaign 2448, beside leakage that left errors 6 % larger, promised 2700 in ln
evidence there and nothing before). What falls behind there is not fitted further (successive halving: Jamieson & Talwalkar, AISTATS 2016).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain, zip_longest

import numpy as np

from thermospindle.diagnosis.data.lines import LineData
from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.inference.evidence import evidence
from thermospindle.diagnosis.inference.fit import TEMPERS, Fit, fit
from thermospindle.diagnosis.inference.freeform import as_told_by
from thermospindle.diagnosis.inference.hypothesis import EARLY, LITTLE, PLENTY, STRAIN, Hypothesis, Task, as_drawn, fitted, scan
from thermospindle.diagnosis.inference.prior import CHANGING, Learned, nuisance_variances, steady, undrifted, wider_tolerances
from thermospindle.diagnosis.inference.problem import Problem
from thermospindle.diagnosis.inference.resonance import with_more
from thermospindle.diagnosis.inference.screening import Screened, screen
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.diagnosis.parameters.mechanism import Mechanism
from thermospindle.model.parallel import in_parallel, meanwhile
from thermospindle.model.types import Array

BEHIND, FAR = 12.0, 200.0  # tempered ln evidence behind the best from which a mechanism is not followed, and from which not even the best two of a kind
MOST = {"law": 14, "own law": 4, "free": 4}  # mechanisms fitted at most, of the catalogue with their laws and with laws of the data's own, and free forms
CLOSE = 60.0  # ln evidence behind the best, from which what nothing strained has hidden is not followed, nor what would do no better than that
OWED = {"law": 6, "own law": 2, "free": 1}  # promised by screening and not delivered, fitted once more at most
OCCAM = 20.0  # ln evidence that a second mechanism of no size may cost at most: less tells of a fit that stalled
STALLED = 0.1  # of the enlarged errors, which the model without effects must reach if fits are to start from it alone
SCANNED = {"law": 12, "free": 16}  # fitted from a scan of sizes where peaks are far off, those that it says most of
FROM_SCAN = 3  # of each kind, followed with what screening chose
HIDING = 1e-3  # relative error of frequencies, from which constant discrepancies may hide an effect that is the same in every test
STRAINED = 4.0  # standard deviations of a build tolerance, from which likewise


@dataclass(frozen=True, eq=False)
class Singles:
    """Mechanisms one at a time: those fitted, what screening said of all, what priors pairs are fitted
    with and the cost they should reach; and the fits while errors were still enlarged, where they were."""

    singles: list[Hypothesis]
    screened: tuple[Screened, ...]
    most: float
    expected: Learned
    early: tuple[Hypothesis, ...] = ()


def fit_singles(
    model: CampaignModel, none: Hypothesis, mechanisms: Sequence[Mechanism], progress: Callable[[str], None], workers: int | None
) -> Singles:
    learned = none.evidence.learned
    misfit, drawn = strained(none), not wider_tolerances(learned)
    expected = steady(learned)
    about, temper, far = none.fit, 1.0, False
    if misfit:
        temper = TEMPERS[EARLY]
        there = partial(fit, model, (), none.fit.point, none.fit.rates, (temper,), expected)
        about = fit(model, tempers=TEMPERS[: EARLY + 1], learned=expected) if drawn else there()
        if far := drawn and far_off(model, about):  # it may have stalled where the model without effects has not
            about = min(about, there(), key=lambda f: f.cost)
    with meanwhile(partial(cost_of, model, none, expected), workers) as most_of:
        looked = screen(model if temper == 1.0 else model.thinned, about, temper, learned, mechanisms, workers)
        rankings = [looked]
        if misfit and (learned.errors <= STRAIN or not far):  # peaks are followed, by drift or as far as errors are larger: what would explain what is missing there
            rankings.append(screen(model, none.fit, 1.0, undrifted(learned), mechanisms, workers))
        most = most_of()
    progress("effects screened")
    chosen = _chosen(rankings, misfit)
    if far:
        chosen += _from_scan(model, about, looked, {(s.mechanism.name, s.mechanism.kind) for s in chosen}, most, expected, workers)
    # tolerances strained to stand in for an effect must give way with it; while errors are enlarged they are not strained yet
    tasks = [task_of((), about, s, -np.inf if misfit else none.evidence.ln + s.gain - OCCAM, far=not misfit) for s in chosen]
    first = {s.mechanism.name for ranking in rankings for kind in MOST for s in promising(ranking, kind)[:1]}
    early: list[Hypothesis] = []
    if misfit:
        singles, early = fitted_in_steps(model, tasks, first, about, most, expected, workers)
        if len(rankings) > 1:
            singles = better([*singles, *_owed(model, none, rankings[1], singles, most, expected, workers)])
    else:
        singles = fitted(model, tasks, TEMPERS[-1:], about, most, expected, workers)
        singles = better([*singles, *lasting(model, none, mechanisms, most, expected, workers)])
    progress("effects fitted")
    return Singles(singles, tuple(looked), most, expected, tuple(early))


def strained(h: Hypothesis) -> bool:
    """Whether an explanation leaves more than errors, or has modes drift, or bearings change otherwise, to leave no more."""
    learned = h.evidence.learned
    return learned.errors > STRAIN or any(learned.sizes.get(kind, 0.0) > 0 for kind in CHANGING)


def far_off(model: CampaignModel, about: Fit) -> bool:
    """Whether a fit with errors still enlarged leaves peaks off by many of their widths; a table's
    frequencies follow their parameters as far as these go."""
    return any(isinstance(d, LineData) for d in model.tests) and about.temper * np.sqrt(about.chi2 / about.count) > STALLED


def _owed(
    model: CampaignModel, none: Hypothesis, looked: Sequence[Screened], singles: Sequence[Hypothesis], most: float, expected: Learned, workers
) -> list[Hypothesis]:
    """Fits of what screening beside the model whose modes drift promised, and what fits from
    enlarged errors on have not delivered: some of these ended early there, or stalled."""
    nothing = evidence(model, none.fit, [undrifted(none.evidence.learned)]).ln
    delivered: dict[str, float] = {}
    for h in singles:
        own = evidence(model, h.fit, [undrifted(h.evidence.learned)]).ln - nothing  # with nothing that drifts, as promised
        delivered[h.names[0]] = max(own, delivered.get(h.names[0], -np.inf))
    tasks = []
    for kind, count in OWED.items():
        promised = promising(looked, kind)
        least = max(PLENTY, max((s.gain for s in promised), default=0.0) - CLOSE)
        late = [s for s in promised if s.gain > least and delivered.get(s.mechanism.name, -np.inf) < s.gain - OCCAM]
        tasks += [task_of((), none.fit, s, -np.inf, far=True) for s in late[:count]]
    best = max(singles, key=lambda h: h.evidence.ln, default=none)
    return fitted(model, _keeping_up(model, tasks, best, most, expected, workers), TEMPERS[-1:], none.fit, most, expected, workers, beaten=best.fit.cost + 2 * FAR)


def _keeping_up(model: CampaignModel, tasks: Sequence[Task], beside: Hypothesis, most: float, expected: Learned, workers) -> list[Task]:
    """Of some tasks those that keep up with an explanation while errors are still enlarged, from where they are then: in evidence,
    or in what the data leave as fitted, for an effect that is a free form's own change has its sizes and shapes to pay for."""
    if not tasks:
        return []
    early = fitted(model, [Task(beside.mechanisms, (beside.fit.point,), -np.inf), *tasks], TEMPERS[-2:-1], beside.fit, most, expected, workers)
    most_ln, most_fitted = (max((getattr(h.evidence, of) for h in early), default=np.inf) for of in ("ln", "as_fitted"))
    near = [h for h in early if h.evidence.ln > most_ln - BEHIND or h.evidence.as_fitted > most_fitted - BEHIND]
    known = with_laws(beside.mechanisms)
    return [Task(h.mechanisms, (h.fit.point,), -np.inf) for h in near if with_laws(h.mechanisms) != known]


def by_own_laws(model: CampaignModel, none: Hypothesis, tried: Singles, mechanisms: Sequence[Mechanism], workers) -> list[Hypothesis]:
    """Effects with laws of the data's own, fitted from what the best free form says. Where that does better than an effect
    which changes much the same by the law assumed, the effect may do as well by another; screening, which is linear, need
    not have seen it. Not where that is far behind the best; and to the end what keeps up while errors are still enlarged."""
    told = max((h for h in tried.singles if h.free), key=lambda h: h.evidence.ln, default=none)
    best = max(tried.singles, key=lambda h: h.evidence.ln, default=none)
    if not told.free or told.evidence.ln < max(none.evidence.ln + PLENTY, best.evidence.ln - CLOSE):
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
    tasks = _keeping_up(model, tasks, told, tried.most, tried.expected, workers)
    return fitted(model, tasks, TEMPERS[-1:], told.fit, tried.most, tried.expected, workers, beaten=best.fit.cost + 2 * FAR)


def cost_of(model: CampaignModel, none: Hypothesis, expected: Learned) -> float:
    """The cost without effects of priors as `expected`, which no mechanism should exceed."""
    return fit(model, (), (none.evidence.mean, none.fit.point), none.fit.rates, TEMPERS[-1:], learned=expected).cost


def carried_over(model: CampaignModel, none: Hypothesis, tried: Singles, before: int, workers: int | None) -> Singles:
    """Single mechanisms fitted on in a model with a light resonance more; `before` is the number of parameters that the model had."""
    expected = steady(none.evidence.learned)
    starts = [with_more(h.fit.point, before, len(model.parameters) - before) for h in tried.singles]
    tasks = [Task(h.mechanisms, (at,), -np.inf) for h, at in zip(tried.singles, starts, strict=True)]
    most = cost_of(model, none, expected)
    return Singles(fitted(model, tasks, TEMPERS[-1:], none.fit, most, expected, workers), tried.screened, most, expected)


def lasting(
    model: CampaignModel, lead: Hypothesis, mechanisms: Sequence[Mechanism], most: float, expected: Learned, workers
) -> list[Hypothesis]:
    """Effects that are the same in every test beside an explanation, from a scan of sizes with all else as
    drawn: constant discrepancies of the model or strained tolerances stand in for them, and beside those
    screening sees nothing; from where the model is, if its tolerances are wider than stated. Followed to
    the end is what gains something while errors are still enlarged, and keeps up with the best."""
    n = len(model.parameters)
    learned = lead.evidence.learned
    if learned.sizes.get(kinds_of.STIFFNESS, 0.0) < HIDING and farthest_tolerance(model, lead.evidence.mean, learned.sizes) < STRAINED:
        return []
    wide = bool(wider_tolerances(learned))
    own, tempers = (lead.fit.point, TEMPERS[-2:-1]) if wide else (as_drawn(model, lead.fit.point), TEMPERS[:-1])
    drawn = {m.name: m for m in reversed(mechanisms) if m.lasting and m.kind == "law" and m.name not in lead.names}
    tasks = [
        Task((*lead.mechanisms, m), tuple(np.concatenate([own, at[n:]]) for at in scan(model, (m,))[1:]), -np.inf) for m in drawn.values()
    ]
    if not tasks:
        return []
    about = fit(model, lead.mechanisms, (own, lead.fit.point), tempers=tempers, learned=steady(expected, lead.mechanisms))
    early = fitted(model, tasks, tempers, about, most, expected, workers)
    least = max([evidence(model, about, wide=wide).ln + LITTLE, *(h.evidence.ln - BEHIND for h in early)])
    tasks = [Task(h.mechanisms, (h.fit.point,), -np.inf) for h in early if h.evidence.ln > least]
    return fitted(model, tasks, TEMPERS[-1:], lead.fit, most, expected, workers, beaten=lead.fit.cost)


def farthest_tolerance(model: CampaignModel, point: Array, sizes: Mapping[str, float]) -> float:
    """How far, in its standard deviations as learned, the build tolerance is that is farthest off in a
    parameter vector (n,); nothing where there are none."""
    own = list(model.numbers.tolerances.values())
    return float(np.max(np.abs(point[own]) / np.sqrt(nuisance_variances(model, sizes)[own]), initial=0.0))


def better(found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Of those with the same mechanisms and laws the one with more evidence."""
    return list({with_laws(h.mechanisms): h for h in sorted(found, key=lambda h: h.evidence.ln)}.values())


def with_laws(mechanisms: Sequence[Mechanism]) -> frozenset[tuple[str, str]]:
    """Which mechanisms act, and whose law each has."""
    return frozenset((m.name, m.kind) for m in mechanisms)


def of_each_name(found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Of those with the same mechanisms, whatever their laws, the one with more evidence; the best first."""
    return sorted({frozenset(h.names): h for h in sorted(found, key=lambda h: h.evidence.ln)}.values(), key=lambda h: -h.evidence.ln)


def task_of(lead: tuple[Mechanism, ...], about: Fit, s: Screened, hoped: float, far: bool) -> Task:
    """A screened mechanism beside those of the fit `about`: from there with its size, and with
    `far` from where screening says it leads or from there without it."""
    own = s.start[len(about.point) :]
    starts = (s.start, np.concatenate([about.point, 0 * own])) if far else (np.concatenate([about.point, own]),)
    return Task((*lead, s.mechanism), starts, hoped)


def promising(looked: Sequence[Screened], kind: str) -> list[Screened]:
    """The best variant of every mechanism of one kind, with the most promising first; of those with
    laws of the data's own only what promises more than the law that is assumed, at sizes that can be."""
    by_law = {s.mechanism.name: s.gain for s in sorted(looked, key=lambda s: s.gain) if s.mechanism.kind == "law"}
    best: dict[str, Screened] = {}
    for s in sorted((s for s in looked if s.mechanism.kind == kind and np.isfinite(s.gain)), key=lambda s: -s.gain):
        if kind != "own law" or (s.possible and s.gain > by_law.get(s.mechanism.name, -np.inf) + LITTLE):
            best.setdefault(s.mechanism.name, s)
    return list(best.values())


def _chosen(rankings: Sequence[Sequence[Screened]], misfit: bool) -> list[Screened]:
    """The most promising mechanisms of every kind, from all rankings by turns. Where there is no misfit
    what screening promises is nearly what a fit will hold, and only what is near the best is followed."""
    found: list[Screened] = []
    for kind, most in MOST.items():
        followed = []
        for looked in rankings:
            ranked = promising(looked, kind)
            rivals = [s.gain for s in (*ranked, *(promising(looked, "law") if kind == "own law" else ()))]
            least = -LITTLE if misfit else max([-LITTLE, *(gain - CLOSE for gain in rivals)])
            followed.append([s for s in ranked if s.gain > least or (s is ranked[0] and kind != "own law")])
        chosen: dict[str, Screened] = {}
        for s in filter(None, chain.from_iterable(zip_longest(*followed))):
            if len(chosen) < most:
                chosen.setdefault(s.mechanism.name, s)
        found += chosen.values()
    return found


def _from_scan(
    model: CampaignModel, about: Fit, looked: Sequence[Screened], chosen: Collection[tuple[str, str]], most: float, expected: Learned, workers
) -> list[Screened]:
    """What is missing among those `chosen`: where peaks are off by many of their widths, what is linear
    says little of what moves them. Mechanisms that a scan of sizes says most of are fitted with errors
    enlarged most, where all peaks move together, and the best of each kind follow (a flange that softened
    by 14 % in blind campaign 2316 was not among the first ten that screening promised, and led there)."""
    found: list[Screened] = []
    for kind, count in SCANNED.items():
        ways = {s.mechanism.name: s for s in reversed(looked) if s.mechanism.kind == kind and s.visibility > 0}  # the first of each, which has all its shape
        mechanisms = [s.mechanism for s in ways.values()]
        scanned = in_parallel(partial(_scanned, model, expected), mechanisms, workers)
        ranked = sorted(zip(scanned, mechanisms, strict=True), key=lambda row: row[0][0])[:count]
        tasks = [Task((m,), (start,), -np.inf) for (_, start), m in ranked]
        led = sorted(fitted(model, tasks, TEMPERS[1:2], about, most, expected, workers), key=lambda h: -h.evidence.ln)[:FROM_SCAN]
        found += [ways[h.names[0]] for h in led if (h.names[0], kind) not in chosen]
    return found


def _scanned(model: CampaignModel, expected: Learned, m: Mechanism) -> tuple[float, Array]:
    """The least cost of sizes of a mechanism with all else as drawn, and errors enlarged most, and the parameters there."""
    problem = Problem(model.thinned, (m,), steady(expected, (m,)))
    return min(((problem.cost(start, TEMPERS[1]), start) for start in scan(model, (m,))), key=lambda row: row[0])


def fitted_in_steps(
    model, tasks: Sequence[Task], first: Collection[str], about: Fit, most: float, expected: Learned, workers
) -> tuple[list[Hypothesis], list[Hypothesis]]:
    """All tasks fitted in steps of temper, from scans too where peaks are far off, after which what fell behind is
    left, but for those that promised most at `first` as long as none explains the data: the first of two causes that
    shows while errors are enlarged need not be the one that tells more. Those that arrived, and all of the first step."""
    alive, afresh, early, found = list(tasks), far_off(model, about), list[Hypothesis](), list[Hypothesis]()
    count, beaten = sum(d.count for d in model.tests), np.inf  # a thinned model's lines weigh as much as all
    for temper in TEMPERS[EARLY:]:
        found = fitted(model, alive, (temper,), about, most, expected, workers, afresh=afresh, beaten=beaten)
        afresh, early = False, early or found
        ranked = sorted(found, key=lambda h: -h.evidence.ln)
        near = [h for h in ranked if h.evidence.ln > ranked[0].evidence.ln - FAR]
        explained = any(h.fit.chi2 < STRAIN**2 * count for h in ranked[:1])  # of two causes neither does that alone
        keep = {id(h) for kind in MOST for h in [h for h in near if h.mechanisms[0].kind == kind][:2]}
        kept = [h for h in (near if explained else found) if id(h) in keep or h.names[0] in first or h.evidence.ln > ranked[0].evidence.ln - BEHIND]
        if temper == TEMPERS[-2]:  # what the best leaves of noise it leaves at the end, or less
            beaten = min((h.fit.chi2 for h in found), default=np.inf) + 2 * FAR
        alive = [Task(h.mechanisms, (h.fit.point,), -np.inf) for h in sorted(kept, key=lambda h: -h.fit.cost)]  # what has furthest to go begins first
    return found, early
