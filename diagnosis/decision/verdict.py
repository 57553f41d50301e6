"""From the evidence of all hypotheses to a verdict: posterior probabilities, what is no answer
whatever they are, and the least expected loss."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermospindle.diagnosis.decision import reason
from thermospindle.diagnosis.decision.conditions import conditions_of
from thermospindle.diagnosis.decision.explanations import (
    Candidate,
    Names,
    discount,
    doubted,
    explanations,
    likelier_first,
    likeliest,
    named_part,
    with_unknown,
)
from thermospindle.diagnosis.decision.loss import MOSTLY, least_loss, mostly_named, smallest_set
from thermospindle.diagnosis.decision.reason import LEFT, MOVING, UNBUILT, UNTOLD, drifts, unbuilt
from thermospindle.diagnosis.inference.evidence import left_out
from thermospindle.diagnosis.inference.hypothesis import PLENTY, Hypothesis
from thermospindle.diagnosis.inference.remainder import ALIKE, Overlap, overlap
from thermospindle.diagnosis.inference.resonance import moving, travelled
from thermospindle.diagnosis.inference.search import Search

GROSS = 25.0  # chi2 a number, five times the errors, from which nothing has explained the data whatever else explains them no better
MUCH = 0.5  # squares of the errors, from which what is left and changes tells of something else
SURE = 5.0  # standard deviations of chi2 by chance, beyond which something is left


@dataclass(frozen=True, eq=False)
class Verdict:
    """`word` is none, identified, ambiguous, two effects or unexplained; `effects` what it names; `losses` the expected loss of every
    answer weighed. `candidates` of the catalogue, each also with a little free drift beside it, and `free` ones with the most probable
    first. `held_out_before` and `held_out_after` are rms residuals, in standard errors, of conditions predicted from all others,
    without effects and as `accepted`; `held_out_gain` what their ln probability density gains. `told` is what says how far drawing,
    thermometers and sensors are off: as `accepted`, or the likeliest where nothing is, for without what drifts these stand in for it."""

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
    held_out_gain: float
    accepted: Hypothesis
    told: Hypothesis

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {' '.join((self.word, *self.effects))}: {self.reason}>"


def decide(found: Search) -> Verdict:
    """The verdict with the least expected loss."""
    found = with_unknown(found)
    best = likeliest(found)
    same = overlap(found.model, best.fit)
    candidates, free, none = explanations(found, same)
    candidates, free, none = _unheld(found, best, same, candidates, free, none)
    together = smallest_set(candidates, free)
    candidates, free, untried = doubted(candidates, free, none)
    word, effects, losses = least_loss(candidates, none, free, untried, found.alike, together)
    accepted = _accepted(found, word, effects, candidates, free)
    groups = conditions_of(found.model.spindle, found.model.tests)
    (before, plain), (after, density) = (left_out(found.model, h.fit, h.evidence, groups) for h in (found.base, accepted))
    whole, rest = _with_drift_beside(candidates, free)
    weighed = (whole, rest) if word == "ambiguous" else (candidates, free)
    why = reason.of_verdict(found, word, effects, *weighed, none, before, after, density - plain)
    why += reason.of_resonances(found.model, best) + reason.of_what_is_left(best, same)
    told = best if word == "unexplained" else accepted
    why += reason.of_tolerances(found.model, told, word != "unexplained") + reason.of_motions(found.model, told)
    why += reason.of_conventions(found.model, told)
    unknown = untried + sum(c.probability for c in rest)
    return Verdict(word, effects, why, whole, rest, none, unknown, losses, before, after, density - plain, accepted, told)


def _unheld(
    found: Search, best: Hypothesis, same: Overlap, candidates: tuple[Candidate, ...], free: tuple[Candidate, ...], none: float
) -> tuple[tuple[Candidate, ...], tuple[Candidate, ...], float]:
    """What is only the best of what was tried, with its probability moved to the unknown: nothing missing, where a light
    resonance moves with temperature (and what gains little beside it), modes drift by more than two honest programs differ
    by, the data are missed grossly, something would have to be built as nothing is, or much is left that is not alike in
    all tests; effects, where they leave much of what changes, or miss it grossly; and drifts that miss the data grossly."""
    alike = overlap(found.model, found.base.fit)
    kept = changing(found.base, alike), changing(best, same)
    gross = found.base.evidence.chi2 > GROSS * found.base.fit.count
    if moving(found.model, found.base, discount(best, same)):
        little = [c for c in (*candidates, *free) if c.delta_evidence < MOSTLY * (c.delta_evidence + found.by_resonances) and not _stills(found, c)]
        moves = Candidate(found.base, (MOVING,), True, 0.0, none + sum(c.probability for c in little))
        candidates, free = (tuple(replace(c, probability=0.0) if c in little else c for c in every) for every in (candidates, free))
        free, none = (*free, moves), 0.0
    by_chance = SURE * np.sqrt(2 / found.base.fit.count)  # standard deviations of chi2 a number
    changes = len(found.model.tests) > 1 and alike.tests < ALIKE and kept[0] > max(MUCH, by_chance)
    strange = bool(unbuilt(found.model, found.base))
    if drifts(found.model, found.base) or gross or changes or strange:
        name = UNTOLD if gross else UNBUILT if strange else LEFT if changes else "every mode"
        free = (*free, Candidate(found.base, (name,), True, 0.0, none))
        none = 0.0
    if kept[1] > MUCH and (kept[1] > (1 - MOSTLY) * kept[0] or kept[1] > GROSS):
        free = (*free, Candidate(found.base, (LEFT,), True, 0.0, sum(c.probability for c in candidates)))
        candidates = tuple(replace(c, probability=0.0) for c in candidates)
    if best.mechanisms and all(m.free for m in best.mechanisms) and best.fit.chi2 > GROSS * best.fit.count:  # what drifts in it does not explain the data either
        free = (*(replace(c, probability=0.0) for c in free), Candidate(found.base, (LEFT,), True, 0.0, sum(c.probability for c in free)))
    return candidates, tuple(sorted(free, key=lambda c: -c.probability)), none


def _stills(found: Search, c: Candidate) -> bool:
    """Whether a candidate explains what a light resonance moved for without it: beside it none moves, or most of the way no more."""
    return c.delta_evidence > PLENTY and travelled(found.model, c.hypothesis) < (1 - MOSTLY) * travelled(found.model, found.base)


def changing(h: Hypothesis, same: Overlap) -> float:
    """Squares of the errors a number that an explanation leaves beyond noise, and not alike in all tests."""
    return h.excess * (1.0 - same.tests)


def _with_drift_beside(candidates: Sequence[Candidate], free: Sequence[Candidate]) -> tuple[tuple[Candidate, ...], tuple[Candidate, ...]]:
    """Probabilities as they are told: what is most of an explanation in which something drifts a
    little beside it has that explanation's, too."""
    alone = {frozenset(c.names): c.delta_evidence for c in candidates}
    beside = [c for c in free if frozenset(named_part(c)) in alone and mostly_named(c, alone)]

    def whole(c: Candidate) -> float:
        return c.probability + sum(o.probability for o in beside if set(named_part(o)) == set(c.names))

    named = (replace(c, probability=whole(c)) for c in candidates)
    left = (replace(c, probability=0.0) if c in beside else c for c in free)
    return likelier_first(named), likelier_first(left)


def _accepted(found: Search, word: str, effects: Names, candidates: Sequence[Candidate], free: Sequence[Candidate]) -> Hypothesis:
    """The hypothesis by which errors after the verdict are told: the likeliest that holds all that
    it names, or of a set the likeliest in it."""
    if word in ("none", "unexplained"):
        return found.base
    if word == "ambiguous":
        return next(c.hypothesis for c in candidates if set(c.names) <= set(effects))
    return max((c for c in (*candidates, *free) if set(named_part(c)) == set(effects)), key=lambda c: c.probability).hypothesis
