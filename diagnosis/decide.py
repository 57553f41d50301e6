"""From fitted explanations to one of five verdicts: evidence, held-out conditions, and what is believable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2 as chi_squared

from diagnosis.fit import Fit, prior_widths
from diagnosis.screening import CLEAR, Signature
from diagnosis.theory import Theory
from model.ball_row import Array
from sim.effect import Effect

AHEAD = 5.0  # ln evidence by which it must lead every rival to be identified
OF_ALL = 0.01  # share of its ln evidence by which it must lead, where that is more: laws are not exact
SURE = 1.2  # ln odds that such a lead is worth: 78 blind campaigns are likeliest at 1 to 1.5
OTHER = 4.0  # such leads by which something that is not in the catalogue is believed less than its best entry, where that fits the data
PAIR_OF_ALL = 0.02  # share of its ln evidence that the second effect of a pair must bring to be needed,
MUCH_MORE = 0.5  # unless held-out errors fall to this share of those of either alone
MORE = 0.9  # held-out error ratio of a pair over that of its best member up to which it predicts more
WIDE = 3.0  # times the lead that identifies: rivals within it stay in the set, where there is one
STRAINED = 4.0  # standard deviations at which a tolerance is an explanation of its own
THERE = 3.0  # standard errors, other parameters given, by which both effects of a pair must differ from none
MISFIT = 1e-4  # probability below which a misfit is not chance
FALLS = 1 / 3  # held-out error ratio that counts as a clear fall


@dataclass(frozen=True, eq=False)
class Candidate:
    """An explanation: effects fitted with all tolerances free."""

    fit: Fit
    delta_evidence: float  # ln evidence over the model without effects, less what two effects at once are less likely
    probability: float
    margin: float  # ln evidence by which the best explanation must lead it to be alone
    held_out_ratio: float  # rms pull of left-out conditions over that of the model without effects
    believable: bool

    @property
    def effects(self) -> tuple[str, ...]:
        return tuple(e.name for e in self.fit.effects)


@dataclass(frozen=True, eq=False)
class Diagnosis:
    verdict: str
    effects: tuple[str, ...]
    reason: str
    base: Fit
    candidates: tuple[Candidate, ...]
    signatures: tuple[Signature, ...]
    held_out_before: float
    held_out_after: float

    @property
    def best(self) -> Candidate | None:
        return self.candidates[0] if self.candidates else None


def held_out(theory: Theory, result: Fit, rating: Array | None = None) -> tuple[float, int]:
    """Sum of squares and number of whitened residuals of conditions left out one after the other, each predicted from all others.

    About the optimum the model is linear in its parameters, so leaving a condition out is algebra: minimise without its rows, then look.
    The prediction is rated by the errors of its parameters and by those that `rating` (n, n) whitens, the data's own by default.
    """
    rating = theory.data.whiten if rating is None else rating
    data = theory.data
    temperatures = [o.condition.temperature for o in data.observations]
    widths = prior_widths(theory, result)
    fitted, rated = (w @ (result.jacobian * widths) for w in (result.whiten, rating))
    residual, rated_residual = result.whiten @ result.residual, rating @ result.residual
    offset = np.concatenate([result.nuisance / theory.sd, np.zeros(len(widths) - len(theory.sd))])
    total, count = 0.0, 0
    for leave in sorted(set(temperatures)):
        out = np.array([temperatures[f.test] == leave for f in data.features])
        normal = fitted[~out].T @ fitted[~out] + np.eye(len(widths))
        step = np.linalg.solve(normal, fitted[~out].T @ residual[~out] - offset)
        left = rated_residual[out] - rated[out] @ step
        spread = np.eye(out.sum()) + rated[out] @ np.linalg.solve(normal, rated[out].T)
        total += float(left @ np.linalg.solve(spread, left))
        count += int(out.sum())
    return total, count


def _there(theory: Theory, found: Fit, effect: Effect) -> bool:
    """Whether a fitted effect is clearly more than nothing, its other parameters being what they are: how a size is shared out between
    several of them may be unknown where its whole is not."""
    main = effect.parameters[0]
    before = found.effects[: found.effects.index(effect)]
    place = len(theory.sd) + sum(len(e.parameters) for e in before)
    white = found.whiten @ (found.jacobian * prior_widths(theory, found))
    white = np.delete(white, np.arange(place + 1, place + len(effect.parameters)), axis=1)
    sd = main.prior_sd * float(np.sqrt(np.linalg.inv(white.T @ white + np.eye(white.shape[1]))[place, place]))
    return abs(found.values[effect.name][main.name] - main.neutral) > THERE * sd


def decide(theory: Theory, base: Fit, fits: list[Fit], signatures: list[Signature]) -> Diagnosis:
    n = len(theory.data.value)
    before, count = held_out(theory, base)
    rms_before = float(np.sqrt(before / count))
    whole = max(f.evidence for f in fits) - base.evidence
    ahead, pair = max(AHEAD, OF_ALL * whole), max(CLEAR, PAIR_OF_ALL * whole)
    candidates = _rated(theory, base, fits, ahead, pair)
    lead = candidates[0]
    rejected = chi_squared.sf(base.chi2, n) < MISFIT

    def answer(verdict: str, effects: Sequence[str], reason: str) -> Diagnosis:
        after = lead.held_out_ratio * rms_before
        return Diagnosis(verdict, tuple(effects), reason, base, tuple(candidates), tuple(signatures), rms_before, after)

    named = " + ".join(lead.effects)
    if lead.delta_evidence < CLEAR and not rejected:
        return answer("none", (), f"The tolerances alone explain the data: misfit {base.misfit:.0f} for {n} numbers; the best effect, "
                      f"{named}, gains {lead.delta_evidence:.1f} in ln evidence where {CLEAR:g} is asked.")  # fmt: skip
    told = chi_squared.sf(base.misfit, n) > MISFIT > chi_squared.sf(lead.fit.misfit, n)  # by tolerances, better than by the effect
    if chi_squared.sf(lead.fit.chi2, n) < MISFIT or told or lead.delta_evidence < CLEAR:
        return answer("unexplained", (), f"The model is rejected (misfit {base.misfit:.0f} for {n} numbers), and even with "
                      f"{named} a misfit of {lead.fit.misfit:.0f} is left.")  # fmt: skip
    alike = [c for c in candidates if len(c.effects) == len(lead.effects)]
    if any(lead.delta_evidence - c.delta_evidence < c.margin for c in alike[1:]):
        rivals = [c for c in alike if lead.delta_evidence - c.delta_evidence < WIDE * c.margin]
        names = sorted({name for c in rivals for name in c.effects})
        apart = lead.delta_evidence - rivals[-1].delta_evidence
        each = ", ".join(" + ".join(c.effects) for c in rivals)
        return answer("ambiguous", names, f"{each} explain the data within {apart:.0f} in ln evidence of each other"
                      f"{_likeness(signatures, [c.effects for c in rivals])}.")  # fmt: skip
    gap = lead.delta_evidence - max([0.0, *(c.delta_evidence for c in alike[1:])])
    leads = f"{named} leads every other explanation by {gap:.0f} or more in ln evidence"
    more = [c for c in candidates if c.fit.evidence - lead.fit.evidence > ahead and c.held_out_ratio < MORE * lead.held_out_ratio]
    perhaps = [c for c in more if len(c.effects) > len(lead.effects)]
    if perhaps:
        names, gain = sorted({*lead.effects, *perhaps[0].effects}), perhaps[0].fit.evidence - lead.fit.evidence
        return answer("ambiguous", names, f"{named} explains most, {' + '.join(perhaps[0].effects)} {gain:.0f} in ln evidence more, where "
                      f"{pair:.0f} is asked of a second effect.")  # fmt: skip
    first, last = lead.fit.effects[0], lead.fit.effects[-1]
    if last.name in first.resembles or first.name in last.resembles:
        return answer("ambiguous", sorted(lead.effects), f"{leads}, but the two resemble each other: they may be one effect of another "
                      "law.")  # fmt: skip
    if len(lead.effects) == 2 and lead.believable:
        cost = lead.fit.evidence - max(c.fit.evidence for c in candidates if len(c.effects) == 1)
        return answer("two effects", lead.effects, f"{lead.effects[0]} and {lead.effects[1]} are both needed: dropping either costs "
                      f"{cost:.0f} in ln evidence or more.")  # fmt: skip
    if lead.believable and lead.held_out_ratio < FALLS:
        return answer("identified", lead.effects, f"{leads}; the error on left-out conditions falls to {100 * lead.held_out_ratio:.0f} %.")  # fmt: skip
    second = next((c for c in alike[1:] if c.delta_evidence > CLEAR), None)
    names = sorted({*lead.effects, *(second.effects if second else ())})
    return answer("ambiguous", names, f"{leads}, but {_doubt(theory, base, lead)}.")


def _rated(theory: Theory, base: Fit, fits: Sequence[Fit], ahead: float, pair: float) -> list[Candidate]:
    """Candidates, the best first, without pairs of which one effect is not there; two effects at once are believed less than one
    beforehand, by `pair` in ln odds or less.

    Probabilities add up to one with that of no effect and that of something else, which would leave of the data what chance does.
    """
    fits = [f for f in fits if len(f.effects) == 1 or all(_there(theory, f, e) for e in f.effects)]
    n = len(theory.data.value)
    # all rated alike, with what the effect's own law may miss
    ratios = [float(np.sqrt(held_out(theory, f, f.whiten)[0] / held_out(theory, base, f.whiten)[0])) for f in fits]
    alone = {f.effects[0].name: (f, ratio) for f, ratio in zip(fits, ratios, strict=True) if len(f.effects) == 1}

    def refuted(f: Fit) -> bool:
        """By the data, or by tolerances that nobody would believe."""
        return bool(chi_squared.sf(f.chi2, n) < MISFIT or chi_squared.sf(np.sum((f.nuisance / theory.sd) ** 2), len(theory.sd)) < MISFIT)

    def price(f: Fit, ratio: float) -> float:
        """What the second effect of a pair must bring: less where it is plain that one does not do."""
        if len(f.effects) == 1:
            return 0.0
        members = [alone[e.name] for e in f.effects if e.name in alone]
        plain = all(ratio < MUCH_MORE * r or refuted(g) for g, r in members)
        return CLEAR if plain and not refuted(f) else pair

    logs = np.array([f.evidence - base.evidence - price(f, ratio) for f, ratio in zip(fits, ratios, strict=True)])
    lead = fits[int(np.argmax(logs))]

    def margin(f: Fit) -> float:
        """Less for what shares an effect with the best: only what is not common to both is in dispute."""
        common = [alone[e.name][0].evidence for e in lead.effects if e in f.effects and e.name in alone]
        return max(AHEAD, OF_ALL * (lead.evidence - max(common))) if common else ahead

    margins = [margin(f) for f in fits]
    left = max(lead.chi2 - n, 0.0) / 2
    odds = np.array([*(logs - logs.max()), -logs.max(), left - OTHER * ahead]) * SURE / np.array([*margins, ahead, ahead])
    weights = np.exp(odds - odds.max())
    weights /= weights.sum()
    found = zip(fits, logs.tolist(), weights[:-2].tolist(), margins, ratios, strict=True)
    return sorted((Candidate(f, log, w, m, ratio, not f.at_limit) for f, log, w, m, ratio in found), key=lambda c: -c.delta_evidence)


def _likeness(signatures: Sequence[Signature], rivals: Sequence[tuple[str, ...]]) -> str:
    """How alike the effects of a set are in these data, beside what tolerances can do: the cosine of the two least alike of those that
    are not common to all."""
    disputed = set().union(*rivals) - set(rivals[0]).intersection(*rivals)
    unit = np.array([s.direction for s in signatures if s.effect.name in disputed and np.linalg.norm(s.direction) > 0])
    if len(unit) < 2:
        return ""
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    return f"; what they do to these data is {100 * float(np.min(np.abs(unit @ unit.T))):.0f} % alike"


def _doubt(theory: Theory, base: Fit, lead: Candidate) -> str:
    """Why an explanation without a rival is not taken for identified."""
    if not lead.believable:
        return "at a value that is not believable"
    pulls = base.nuisance / theory.sd
    worst = int(np.argmax(np.abs(pulls)))
    if abs(pulls[worst]) > STRAINED:
        return (
            f"a {theory.names[worst]} {abs(pulls[worst]):.0f} standard deviations from its drawing would predict left-out conditions as well "
            f"({100 * lead.held_out_ratio:.0f} % of the error stays): the scene's tolerances decide between the two"
        )
    return f"leaves {100 * lead.held_out_ratio:.0f} % of the error on left-out conditions"
