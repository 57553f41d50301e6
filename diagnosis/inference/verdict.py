"""From the evidence of all hypotheses to a verdict: posterior probabilities, and the answer with the least expected loss.

Loss of an answer, in units of a set that holds the truth: a wrong name costs ten times as much and a false alarm twenty times; to say
"nothing" of a spindle that lacks something five times, as much as a set without the truth in it does beyond its own cost. Prior odds are even
between nothing missing and something missing; within the catalogue every effect is as likely as another, two at once a quarter
as likely as one, and something that is in no catalogue a seventh. A mechanism of the catalogue may have a law of its own, half as likely as the
one assumed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import permutations
from math import comb

import numpy as np

from thermospindle.diagnosis.forward import nuisance as kinds_of
from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.inference.evidence import left_out
from thermospindle.diagnosis.inference.hypothesis import STRAIN, Hypothesis
from thermospindle.diagnosis.inference.remainder import ALIKE, Overlap, overlap
from thermospindle.diagnosis.inference.search import Search

GROSS = 25.0  # chi2 a number, five times the errors, from which nothing has explained the data whatever else explains them no better
PRIOR = {"none": 0.5, "one": 0.33, "two": 0.08, "free": 0.05, "two free": 0.02, "one and free": 0.02, "three": 0.01}
WRONG, FALSE_ALARM, MISSED, SET, HALF = 10.0, 20.0, 5.0, 1.0, 3.0
ENOUGH = 0.95  # posterior probability that a set holds the truth
NEGLIGIBLE = 1e-3  # probability that adds nothing to a set
LARGEST = 6  # names in a set, beyond which it says little
NUMERICS = (1e-4, 0.01)  # drift of frequencies and of damping that two honest programs may differ by
OWN_LAW = 0.5  # prior odds of a law that no formula has over the one assumed, for a mechanism of the catalogue
MOSTLY = 0.6  # of the ln evidence of an explanation with free drift in it, or of the misfit that changes, that what is named must reach to be the answer
UNTOLD = "nothing tried"  # what explains data that are missed grossly
MUCH, LEFT = 0.5, "what is left"  # squares of the errors, from which what is left and changes tells of something else
SURE = 5.0  # standard deviations of chi2 by chance, beyond which something is left
COARSE = 4.0  # chosen on blind campaigns 1 to 16, by judgement; others judge it
DEPARTS = 0.3  # of the size, from which a law does not hold
SPREAD = 3.0  # temperatures within so many tolerances of each other are one condition

Names = tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Candidate:
    """An explanation of the catalogue, or a free form: ln evidence over the model without effects and posterior probability. `own_laws` is the free
    explanation that changes the same, where the effects are likelier with laws of their own than with those assumed."""

    hypothesis: Hypothesis
    names: Names
    free: bool
    delta_evidence: float
    probability: float
    own_laws: Hypothesis | None = None


@dataclass(frozen=True, eq=False)
class Verdict:
    """`word` is none, identified, ambiguous, two effects or unexplained; `effects` what it names; `losses` the expected loss of every answer
    weighed. `candidates` of the catalogue and `free` ones with the most probable first."""

    word: str
    effects: Names
    reason: str
    candidates: tuple[Candidate, ...]
    free: tuple[Candidate, ...]
    probability_none: float
    probability_unknown: float
    losses: Mapping[str, float]
    held_out_before: float
    held_out_after: float
    accepted: Hypothesis


def decide(found: Search) -> Verdict:
    """The verdict with the least expected loss."""
    named_count = len({s.mechanism.name for s in found.screened if not s.mechanism.free and s.visibility > 0}) or 1
    free_count = len({s.mechanism.name for s in found.screened if s.mechanism.free and s.visibility > 0}) or 1
    base = found.base.evidence.ln
    same = overlap(found.model, found.hypotheses[0].fit)
    worth = same.inflation * coarsening(found.hypotheses[0])
    rows = [(h, _prior(h, named_count, free_count) + (_weighed(h, found.hypotheses) - base) / worth) for h in found.hypotheses]
    own_laws = [_own_laws(h, rows, found.alike, named_count, free_count) for h, _ in rows]
    freed = {id(h): own for (h, w), (own, of_own) in zip(rows, own_laws, strict=True) if of_own > w}
    rows = [(h, float(np.logaddexp(w, of_own))) for (h, w), (_, of_own) in zip(rows, own_laws, strict=True)]
    top = max(w for _, w in rows)
    total = np.log(sum(np.exp(w - top) for _, w in rows)) + top
    every = [
        Candidate(h, tuple(h.names), h.free, h.evidence.ln - base, float(np.exp(w - total)), freed.get(id(h))) for h, w in rows if h.mechanisms
    ]
    every.sort(key=lambda c: (-c.probability, -c.delta_evidence))
    candidates = tuple(c for c in every if not c.free)
    free = tuple(c for c in every if c.free)
    none = float(np.exp(next(w for h, w in rows if not h.mechanisms) - total))
    candidates, free, none = _unheld(found, same, candidates, free, none)
    unknown = sum(c.probability for c in free)
    word, effects, losses = _least_loss(candidates, none, free, found.alike)
    accepted = _accepted(found, word, effects, candidates, free)
    groups = conditions_of(found)
    before = left_out(found.model, found.base.fit, found.base.evidence, groups)
    after = left_out(found.model, accepted.fit, accepted.evidence, groups)
    reason = _reason(found, word, effects, candidates, free, none, before, after) + _seen(found.model) + _constant(found.hypotheses[0], same)
    return Verdict(word, effects, reason, candidates, free, none, unknown, losses, before, after, accepted)


def _unheld(
    found: Search, same: Overlap, candidates: tuple[Candidate, ...], free: tuple[Candidate, ...], none: float
) -> tuple[tuple[Candidate, ...], tuple[Candidate, ...], float]:
    """What is only the best of what was tried, with its probability moved to the unknown: nothing missing, where modes drift by more than two honest
    programs differ by, the data are missed grossly, or much is left that is not alike in all tests; effects, where they leave most of what changes."""
    alike = overlap(found.model, found.base.fit)
    kept = changing(found.base, alike), changing(found.hypotheses[0], same)
    gross = found.base.evidence.chi2 > GROSS * found.base.fit.count
    by_chance = SURE * np.sqrt(2 / found.base.fit.count)  # standard deviations of chi2 a number
    changes = len(found.model.tests) > 1 and alike.tests < ALIKE and kept[0] > max(MUCH, by_chance)
    if _adrift(found.base) or gross or changes:
        name = UNTOLD if gross else LEFT if changes else "every mode"
        free = (*free, Candidate(found.base, (name,), True, 0.0, none))
        none = 0.0
    if kept[1] > MUCH and kept[1] > (1 - MOSTLY) * kept[0]:
        free = (*free, Candidate(found.base, (LEFT,), True, 0.0, sum(c.probability for c in candidates)))
        candidates = tuple(replace(c, probability=0.0) for c in candidates)
    return candidates, tuple(sorted(free, key=lambda c: -c.probability)), none


def changing(h: Hypothesis, same: Overlap) -> float:
    """Squares of the errors a number that an explanation leaves beyond noise, and not alike in all tests."""
    return h.excess * (1.0 - same.tests)


def coarsening(best: Hypothesis) -> float:
    """What ln evidence is divided by where the best explanation itself shows the model to be a little wrong: `COARSE`, or one.

    A model that is constantly wrong somewhere is wrong, too, in what an effect does; evidence that counts lines as if it were not is too sure
    (Miller & Dunson, *J. Am. Statist. Assoc.* 114 (2019) 1113: the coarsened posterior is a power of the likelihood).
    """
    learned = best.evidence.learned
    wrong = learned.errors > STRAIN or any(learned.sizes.get(kind, 0.0) > 0.0 for kind in (kinds_of.STIFFNESS, kinds_of.DAMPING))
    return COARSE if wrong else 1.0


def _weighed(h: Hypothesis, every: Sequence[Hypothesis]) -> float:
    """ln evidence, of which what one mechanism more gains counts a `COARSE`-th where the best explanation without it departs from its law: what is wrong
    in a law looks like a little of something else, and an effect whose law is not quite its own is not quite its own in what it does either."""
    parts = [o for o in every if o.mechanisms and set(o.names) < set(h.names)]
    if not parts:
        return h.evidence.ln
    lead = max(parts, key=lambda o: o.evidence.ln)
    gain = h.evidence.ln - lead.evidence.ln
    departs = gain > 0 and max(lead.evidence.learned.departures, default=0.0) >= DEPARTS
    return _weighed(lead, every) + (gain / COARSE if departs else gain)


def _own_laws(
    h: Hypothesis, rows: Sequence[tuple[Hypothesis, float]], alike: Mapping[str, frozenset[str]], named: int, free: int
) -> tuple[Hypothesis | None, float]:
    """Effects with laws of their own: the likeliest explanation whose free forms change the same as they do, and its ln weight, less probable by
    `OWN_LAW` for each. None where that gains so much more than the effects do that they are not the cause, or where they would need a size that they
    cannot have."""
    base = next(o.evidence.ln for o, _ in rows if not o.mechanisms)
    found: tuple[Hypothesis | None, float] = (None, -np.inf)
    if h.free or not h.mechanisms or beyond_limits(h):
        return found
    for o, of_free in rows:
        if o.free and h.evidence.ln - base > MOSTLY * (o.evidence.ln - base) and _same_changes(h.names, o, alike):
            odds = sum(m.free for m in o.mechanisms) * np.log(OWN_LAW)
            found = max(found, (o, float(odds + _prior(h, named, free) + of_free - _prior(o, named, free))), key=lambda row: row[1])
    return found


def _same_changes(names: Names, o: Hypothesis, alike: Mapping[str, frozenset[str]]) -> bool:
    """Whether each of the effects is a mechanism of `o` of its own, or the law of one that is free there."""
    means = [alike.get(m.name, frozenset()) if m.free else {m.name} for m in o.mechanisms]
    return len(names) == len(means) and any(all(n in of for n, of in zip(row, means, strict=True)) for row in permutations(names))


def _adrift(h: Hypothesis) -> bool:
    """Whether the modes drift from test to test by more than the model's own numerics."""
    sizes = h.evidence.learned.sizes
    return sizes.get(kinds_of.STIFFNESS_DRIFT, 0.0) > NUMERICS[0] or sizes.get(kinds_of.DAMPING_DRIFT, 0.0) > NUMERICS[1]


def _prior(h: Hypothesis, named: int, free: int) -> float:
    """ln prior probability of one hypothesis: its kind's, shared out evenly."""
    frees = sum(m.free for m in h.mechanisms)
    count = len(h.mechanisms)
    if count == 0:
        return float(np.log(PRIOR["none"]))
    if count == 1:
        return float(np.log(PRIOR["free"] / free) if frees else np.log(PRIOR["one"] / named))
    if count > 2:
        return float(np.log(PRIOR["three"] / max(comb(named + free, 3), 1)))
    if frees == 0:
        return float(np.log(PRIOR["two"] / max(comb(named, 2), 1)))
    return float(np.log(PRIOR["two free"] / max(comb(free, 2), 1)) if frees == 2 else np.log(PRIOR["one and free"] / (named * free)))


def beyond_limits(h: Hypothesis) -> bool:
    """Whether an effect would need a size that it cannot have, by more than twice its standard error."""
    for m, size, covariance in zip(h.mechanisms, h.evidence.sizes, h.evidence.size_covariance, strict=True):
        sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        if np.any((size < m.size.limits[0] - 2 * sd) | (size > m.size.limits[1] + 2 * sd)):
            return True
    return False


def named_part(c: Candidate) -> Names:
    """The effects of the catalogue in an explanation that may hold free forms too."""
    return tuple(m.name for m in c.hypothesis.mechanisms if not m.free)


def _mostly_named(c: Candidate, alone: Mapping[frozenset[str], float]) -> bool:
    """Whether the effects of the catalogue, by themselves or some of them, reach most of what an explanation gains with free drift beside them."""
    own = frozenset(named_part(c))
    return max((gain for names, gain in alone.items() if names <= own), default=-np.inf) > MOSTLY * c.delta_evidence


def _least_loss(
    candidates: Sequence[Candidate], none: float, free: Sequence[Candidate], alike: Mapping[str, frozenset[str]]
) -> tuple[str, Names, dict[str, float]]:
    unknown = [c for c in free if all(m.free for m in c.hypothesis.mechanisms)]  # also the model whose every mode drifts
    beside = [c for c in free if not all(m.free for m in c.hypothesis.mechanisms)]  # a named effect and something unknown
    something = 1 - none
    losses: dict[str, float] = {"none": MISSED * something}
    answers: dict[str, tuple[str, Names]] = {"none": ("none", ())}
    p_beside = sum(c.probability for c in beside)
    alone = {frozenset(c.names): c.delta_evidence for c in candidates}

    def missed(own: set[str], at_worst: float) -> float:
        """Of names where something unknown is true: half right where it changes what they change, by another law."""
        return sum(c.probability * (HALF if any(own & alike.get(n, frozenset()) for n in c.names) else at_worst) for c in unknown)

    def named_loss(own: set[str]) -> float:
        """Of naming one effect, or two: half right where one of two is named, or one beside something unknown; wrong with any name that is not true."""
        loss = FALSE_ALARM * none + missed(own, WRONG)
        for c in (*candidates, *beside):
            of_it = set(named_part(c))
            whole = 0.0 if not c.free else SET / 2 if _mostly_named(c, alone) else HALF
            loss += c.probability * (whole if own == of_it else HALF if own < of_it else WRONG)
        return loss

    for names in dict.fromkeys([c.names for c in candidates[:8]] + [named_part(c) for c in beside[:3]]):
        key = " + ".join(names)
        losses[key], answers[key] = named_loss(set(names)), ("identified" if len(names) == 1 else "two effects", names)
    explained = sorted([*candidates, *beside], key=lambda c: -c.probability)
    chosen = list[Candidate]()
    for c in explained:
        held = sum(k.probability for k in chosen)
        if held >= ENOUGH * something or c.probability < NEGLIGIBLE or len({n for k in chosen for n in named_part(k)}) >= LARGEST:
            break
        chosen.append(c)
    names = tuple(dict.fromkeys(n for c in chosen for n in named_part(c)))
    if len(names) > 1:
        share = sum(c.probability for c in chosen if not c.free)
        half = sum(c.probability for c in chosen if c.free)
        outside = sum(c.probability for c in explained) - share - half
        key = "one of " + ", ".join(names)
        losses[key] = FALSE_ALARM * none + SET * share * (1 + 0.1 * max(len(names) - 3, 0)) + HALF * half
        losses[key] += (SET + MISSED) * outside + missed(set(names), SET + MISSED)
        answers[key] = ("ambiguous", names)
    losses["unexplained"] = FALSE_ALARM * none + SET * 2 * sum(c.probability for c in candidates) + SET * p_beside
    answers["unexplained"] = ("unexplained", ())
    best = min(losses, key=lambda k: losses[k])
    return *answers[best], losses


def _accepted(found: Search, word: str, effects: Names, candidates: Sequence[Candidate], free: Sequence[Candidate]) -> Hypothesis:
    """The hypothesis by which errors after the verdict are told: the best that it names."""
    if word in ("none", "unexplained"):
        return found.base
    there = next((c.hypothesis for c in candidates if set(c.names) <= set(effects)), None)
    return there or next(c.hypothesis for c in free if set(named_part(c)) == set(effects))


def conditions_of(found: Search) -> list[list[int]]:
    """Numbers of the tests of every temperature, those within the thermometer's own scatter together."""
    temperature = np.array([d.condition.temperature for d in found.model.tests])
    order = np.argsort(temperature, kind="stable")
    near = SPREAD * found.model.spindle.tolerances.temperature
    groups: list[list[int]] = []
    for t in order:
        if groups and temperature[t] - temperature[groups[-1][-1]] <= near:
            groups[-1].append(int(t))
        else:
            groups.append([int(t)])
    return groups


def _seen(model: CampaignModel) -> str:
    """The light resonances that the data show in every test; one beyond the band stands for what modes up there lend to it."""
    if not model.resonances:
        return ""
    highest = max(float(d.frequency.max()) for d in model.tests)
    told = ", ".join(
        f"{r.frequency:.0f} Hz ({f'damping ratio {r.damping:.2g}' if r.frequency <= highest else 'beyond the band'})" for r in model.resonances
    )
    one = "a light resonance" if len(model.resonances) == 1 else "light resonances"
    return f" Taken into account: {one} at {told} that the drawing lacks and every test shows, of a table, a fixture or a cable."


def _by_another_law(drifting: Names, alike: Mapping[str, frozenset[str]]) -> str:
    """The effects that change what drifts, where their own laws do not do."""
    same = sorted(set().union(*(alike.get(name, ()) for name in drifting)))
    return f", which {' and '.join(same)} would do with a law of its own" if same else ""


def _constant(best: Hypothesis, same: Overlap) -> str:
    """What is left where the best explanation still misses the data and misses them alike in all tests."""
    if best.evidence.learned.errors <= STRAIN or same.tests < ALIKE:
        return ""
    return (
        f" What is left even so is {best.evidence.learned.errors:.1f} times the errors, and much the same in every test (correlation {same.tests:.2f}): "
        "something constant that the model lacks, such as a resonance of the table or the fixture, not a change over the conditions."
    )


def _reason(found: Search, word: str, effects: Names, candidates, free, none: float, before: float, after: float) -> str:
    n, chi2 = found.base.fit.count, found.base.evidence.chi2
    if word == "none":
        best = f"; the best effect, {' + '.join(candidates[0].names)}, has a probability of {candidates[0].probability:.1%}" if candidates else ""
        wrong = found.base.evidence.learned.sizes.get(kinds_of.STIFFNESS, 0.0)
        which = "; one condition cannot tell that from a missing effect" if len(conditions_of(found)) == 1 else ""
        constant = f", the model's frequencies being constantly wrong by about {wrong:.1g} of each{which}" if wrong > NUMERICS[0] else ""
        return f"Tolerances and measuring errors explain the data: chi2 is {chi2 / n:.2f} a number for {n} numbers{constant}{best}."
    lead = candidates[0] if candidates else None
    if word == "unexplained":
        place = "nothing tried explains them, nor do tolerances and measuring errors: units, points, and noise that the files do not tell come first"
        if free and free[0].names == (LEFT,):
            left = found.hypotheses[0].fit
            of = f" of {np.sqrt(chi2 / n):.1f}" if left.mechanisms else ""
            place = f"the best leaves {np.sqrt(left.chi2 / left.count):.1f} standard errors{of}, and not the same in every test"
        elif free and free[0].hypothesis.mechanisms:
            place = f"{' and '.join(free[0].names)} would have to drift ({free[0].delta_evidence:.0f} in ln evidence)"
            place += _by_another_law(free[0].names, found.alike)
        elif free and free[0].names != (UNTOLD,):
            drift = found.base.evidence.learned.sizes[kinds_of.STIFFNESS_DRIFT]
            place = f"every mode drifts from test to test, by {drift:.1g} of its frequency, more than two honest programs differ by"
        if not free or free[0].names == (UNTOLD,):
            return f"No effect of the catalogue explains the data: {place} (chi2 without effects: {chi2 / n:.2f} a number)."
        rival = f"; the best of the catalogue, {' + '.join(lead.names)}, reaches {lead.delta_evidence:.0f}" if lead else ""
        return f"No effect of the catalogue explains the data as well as free drift does: {place}{rival} (chi2 without effects: {chi2 / n:.2f} a number)."
    named = " + ".join(effects)
    checked = f"; conditions left out are predicted with {after:.2f} instead of {before:.2f} standard errors" if np.isfinite(after) else ""
    if word == "ambiguous":
        rows = [c for c in candidates if set(c.names) <= set(effects)]
        share = sum(c.probability for c in rows)
        several = ", or several of them together," if any(len(c.names) > 1 and c.probability > NEGLIGIBLE for c in rows) else ""
        return f"One of {', '.join(effects)}{several} explains the data (together {share:.0%} probable); no one of them is probable enough to be named{checked}."
    disagreement = ", which does not confirm it" if after > 0.9 * before else ""
    told = [c for c in (*candidates, *free) if set(named_part(c)) == set(effects)]
    chosen = max(told, key=lambda c: c.probability)
    without, within = (h.evidence.learned.sizes.get(kinds_of.STIFFNESS, 0.0) for h in (found.base, chosen.hypothesis))
    instead = f"; without, the model's frequencies would have to be constantly wrong by about {without:.1g} of each" if without > 10 * within else ""
    rest = 1 - sum(c.probability for c in told)
    odds = "all else together is less probable than 1 in 1000" if rest < 1e-3 else f"all else together has a probability of {rest:.1%}"
    word_of = "is the explanation" if len(effects) == 1 else "are both needed" if len(effects) == 2 else "are all needed"
    drifting = [m.name for m in chosen.hypothesis.mechanisms if m.free]
    beside = f"; beside {'it' if len(effects) == 1 else 'them'} {' and '.join(drifting)} drifts a little" if drifting else ""
    own = chosen.own_laws
    law = f", and {own.evidence.ln - found.base.evidence.ln:.0f} with a law of the data's own ({' and '.join(own.names)} drift)" if own else ""
    return f"{named} {word_of}: {chosen.delta_evidence:.0f} in ln evidence over the model without effects{law}, {odds}{beside}{instead}{checked}{disagreement}."
