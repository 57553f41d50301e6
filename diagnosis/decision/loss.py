"""The answer with the least expected loss.

In units of a set that holds the truth: a wrong name costs ten times as much and a false alarm twenty times; to say "nothing" of
a spindle that lacks something five times, as much as a set without the truth in it does beyond its own cost; and as much as
such a set to say that something else is missing where it is an effect of the catalogue. Where effects act and something unknown
beside them, an answer costs more by what it leaves unsaid: half a set by the smaller of the two, three sets by the larger.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from thermospindle.diagnosis.decision.explanations import Candidate, Names, named_part

WRONG, FALSE_ALARM, MISSED, SET, HALF = 10.0, 20.0, 5.0, 1.0, 3.0
NAMING = ("identified", "two effects")  # answers that stand by their effects
ENOUGH = 0.95  # posterior probability that a set holds the truth, where that is in the catalogue
NEGLIGIBLE = 1e-3  # probability that adds nothing to a set
MOSTLY = 0.6  # of the ln evidence of an explanation with free drift in it, or of the misfit that changes, that what is named must reach to be the answer


def smallest_set(candidates: Sequence[Candidate], free: Sequence[Candidate]) -> list[Names]:
    """What the smallest set names that holds the truth with `ENOUGH`, explanation by explanation, where that is in the catalogue."""
    explained = sorted([*candidates, *(c for c in free if named_part(c))], key=lambda c: -c.probability)
    enough, held, chosen = ENOUGH * sum(c.probability for c in explained), 0.0, list[Names]()
    for c in explained:
        if held >= enough or c.probability < NEGLIGIBLE:
            break
        chosen.append(named_part(c))
        held += c.probability
    return chosen


def least_loss(
    candidates: Sequence[Candidate], none: float, free: Sequence[Candidate], untried: float, alike: Mapping[str, frozenset[str]], together: Collection[Names]
) -> tuple[str, Names, dict[str, float]]:
    """The answer in a word, what it names, and the expected loss of every answer weighed; of sets that which names explanations `together`."""
    unknown = [c for c in free if all(m.free for m in c.hypothesis.mechanisms)]  # also the model whose every mode drifts
    beside = [c for c in free if not all(m.free for m in c.hypothesis.mechanisms)]  # a named effect and something unknown
    something = 1 - none
    losses: dict[str, float] = {"none": MISSED * something}
    answers: dict[str, tuple[str, Names]] = {"none": ("none", ())}
    alone = {frozenset(c.names): c.delta_evidence for c in candidates}
    mostly = {c for c in beside if mostly_named(c, alone)}

    def missed(own: set[str], at_worst: float) -> float:
        """Of names where something unknown is true: half right where it changes what they change, by another law."""
        told = sum(c.probability * (HALF if any(own & alike.get(n, frozenset()) for n in c.names) else at_worst) for c in unknown)
        return told + untried * at_worst

    def named_loss(own: set[str]) -> float:
        """Of naming one effect, or two: half right where one of two is named, or one beside
        something unknown; wrong with any name that is not true."""
        loss = FALSE_ALARM * none + missed(own, WRONG)
        for c in (*candidates, *beside):
            of_it = set(named_part(c))
            whole = 0.0 if not c.free else SET / 2 if c in mostly else HALF
            loss += c.probability * (whole if own == of_it else HALF if own < of_it else WRONG)
        return loss

    for names in dict.fromkeys([c.names for c in candidates[:8]] + [named_part(c) for c in beside[:3]]):
        key = " + ".join(names)
        losses[key], answers[key] = named_loss(set(names)), ("identified" if len(names) == 1 else "two effects", names)
    explained = [*candidates, *beside]
    names = tuple(dict.fromkeys(n for own in together for n in own))
    chosen = [c for c in explained if named_part(c) in together]
    if len(names) > 1:
        share = sum(c.probability for c in chosen if not c.free or c in mostly)
        little = sum(c.probability for c in chosen if c in mostly)
        half = sum(c.probability for c in chosen) - share
        outside = sum(c.probability for c in explained) - share - half
        key = "one of " + ", ".join(names)
        losses[key] = FALSE_ALARM * none + SET * share * (1 + 0.1 * max(len(names) - 3, 0)) + SET / 2 * little + HALF * half
        losses[key] += (SET + MISSED) * outside + missed(set(names), SET + MISSED)
        answers[key] = ("ambiguous", names)
    losses["unexplained"] = FALSE_ALARM * none + (SET + MISSED) * sum(c.probability for c in candidates)
    losses["unexplained"] += sum(c.probability * (HALF if c in mostly else SET) for c in beside)
    answers["unexplained"] = ("unexplained", ())
    best = min(losses, key=lambda k: losses[k])
    return *answers[best], losses


def in_all(effects: Sequence[str], explanations: Sequence[tuple[Sequence[str], float]]) -> Names:
    """Those of a set of `effects`, but not all, that its explanations hold, names and probability
    of each, but for so little that a set could be told without it."""
    own = [(names, p) for names, p in explanations if set(names) <= set(effects)]
    found = tuple(e for e in effects if sum(p for names, p in own if e in names) > ENOUGH * sum(p for _, p in own))
    return found if len(found) < len(effects) else ()


def mostly_named(c: Candidate, alone: Mapping[frozenset[str], float]) -> bool:
    """Whether the effects of the catalogue, by themselves or some of them, reach most of what an
    explanation gains with free drift beside them."""
    own = frozenset(named_part(c))
    return max((gain for names, gain in alone.items() if names <= own), default=float("-inf")) > MOSTLY * c.delta_evidence
