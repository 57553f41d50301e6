"""Which imperfection of a running spindle is larger than its scene lets expect: unbalance, a race and its order, a ball, a cage.

Effects are compared by evidence with all tolerances free, and one of five verdicts is given. The data are the lines of
runout tests (`runout_lines`); without an effect every imperfection has an unknown amplitude of the size that the scene
gives (`runout_sources`); an effect adds one of its own size, and what cannot be continuous (order, ring, bearing) is tried
choice by choice: a *variant*. Everything falls apart into families of lines (`runout_fit`), so that an effect is fitted to
the lines it can move alone. Parameters that runout does not determine (phases at an unknown start) stay typical.

Lines in a record that theory does not know are unexplained whatever the rest says.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc, chdtri

from thermospindle.diagnosis.runout.explanation import Explanation, Variant, variants
from thermospindle.diagnosis.runout.fit import Family, FamilyFit, families, fit_family, merged
from thermospindle.diagnosis.runout.held_out import held_out
from thermospindle.diagnosis.runout.lines import Seen, UnexplainedLine, look, runout_tests
from thermospindle.diagnosis.runout.next_test import CERTAIN, NextRunout, next_runout
from thermospindle.diagnosis.runout.sources import Sources, sources
from thermospindle.model.machine import Spindle
from thermospindle.model.units import small_length
from thermospindle.sim.campaign.campaign import Campaign
from thermospindle.sim.effects import CATALOGUE, of_scene, usable
from thermospindle.sim.effects.effect import Effect

CLEAR = 12.0  # ln evidence by which an explanation must lead the model without it
AHEAD = 5.0  # ln evidence by which it must lead every rival to be identified
MISFIT = 1e-4  # probability below which a misfit is not chance
FALLS = 1 / 3  # held-out error ratio that counts as a clear fall
WORTH = 4.0  # chi2 of the sources of a variant, fitted without it, from which it is worth a fit of its own
SLACK = 1.5  # chi2 a number up to which a misfit is laid to the errors of lines, which are known but roughly


@dataclass(frozen=True, eq=False)
class RunoutDiagnosis:
    """The verdict; `base` are the fits of all families without effects; `smallest` the size of each
    effect the data could show at `CLEAR`; `rivals` what these data do not tell apart, or the
    leading explanation and the next; `next` the test that would, or `no_next` why there is none."""

    verdict: str
    effects: tuple[str, ...]
    reason: str
    explanations: tuple[Explanation, ...]
    seen: tuple[Seen, ...]
    found: Sources
    families: tuple[Family, ...]
    base: tuple[FamilyFit, ...]
    smallest: Mapping[str, float]
    unexplained: tuple[UnexplainedLine, ...]
    held_out_before: float
    held_out_after: float
    rivals: tuple[Explanation, ...] = ()
    next: tuple[NextRunout, ...] = ()
    no_next: str = ""

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {' '.join((self.verdict, *self.effects))}: {self.reason}>"

    @property
    def chi2(self) -> float:
        return sum(f.chi2 for f in self.base)

    @property
    def count(self) -> int:
        return sum(f.count for f in self.families)


def diagnose_runout(
    spindle: Spindle, campaign: Campaign, catalogue: Sequence[Effect] = CATALOGUE, progress: Callable[[str], None] = lambda done: None
) -> RunoutDiagnosis:
    """The diagnosis of the runout tests of a campaign; effects that the scene has already are left as they are."""
    seen = []
    for test in runout_tests(campaign).tests:
        seen.append(look(spindle, test))
        progress(f"{test.id}: {len(seen[-1].seen)} lines")
    found = sources(spindle, seen, campaign.points)
    parts = families(seen, found)
    base = [fit_family(f) for f in parts]
    progress("lines fitted without any effect")
    present = {effect.name for effect, _ in of_scene(spindle)}
    effects = [e for e in usable(spindle, catalogue) if e.imperfections is not None and e.name not in present]
    tried = [v for e in effects for v in variants(e, found, parts)]
    alone: Alone = {}
    fits = [_fitted((v,), parts, base, alone, worth=True) for v in tried]
    best = _best_of_each(fits)
    progress(f"{len(fits)} variants of {len(effects)} effects tried")
    pairs = _pairs(best, tried, parts, base, alone)
    d = _verdict(seen, found, parts, base, alone, effects, fits, best, pairs)
    if len(d.rivals) < 2:
        return replace(d, no_next="Nothing is left to be told apart." if d.verdict != "unexplained" else "No two explanations are left that a test could part.")
    tests, words = next_runout(spindle, seen, campaign.points, d.rivals, progress)
    return replace(d, next=tests, no_next=words)


Alone = dict[tuple[tuple[int, ...], bool], float]
"""Evidence of several families as one without an effect, by their numbers and whether another is in it: what was asked is kept."""


def _evidence_without(own: Sequence[int], parts: Sequence[Family], base: Sequence[FamilyFit], alone: Alone, beside: Explanation | None) -> float:
    """The most evidence found of families without the effect that moves them all, or with the one
    `beside` it alone: each by itself, or as one.

    By itself each has build tolerances of its own; as one they share them, which is worth something without any effect.
    """
    apart = sum(base[i].evidence for i in own) + (beside.delta_evidence if beside else 0.0)
    if len(own) == 1:
        return apart
    key = (tuple(own), beside is not None)
    if key not in alone:
        family, chosen = merged([parts[i] for i in own]), beside.variants if beside else ()
        alone[key] = fit_family(family, [family.of_effect(v.amplitudes) for v in chosen], [v.prior for v in chosen]).evidence
    return max(apart, alone[key])


def _fitted(chosen: Sequence[Variant], parts: Sequence[Family], base: Sequence[FamilyFit], alone: Alone, worth: bool = False, beside: Explanation | None = None) -> Explanation:
    """The fit of variants to the families they move; the others stay. With `worth` one that cannot
    gain anything stays at size zero. Of two, the first is the one `beside` which the other is weighed."""
    own = sorted({i for v in chosen for i in v.parts})
    family = merged([parts[i] for i in own])
    b = [family.of_effect(v.amplitudes) for v in chosen]
    before_chi2 = sum(base[i].chi2 for i in own)
    total = sum(f.chi2 for f in base)
    amplitude = np.concatenate([base[i].amplitude for i in own])
    if worth and 2 * float(np.sum(np.abs(amplitude[b[0] != 0]) ** 2)) < WORTH and before_chi2 < chdtri(family.count, 0.01):
        size = np.linalg.norm(b[0][b[0] != 0] / family.likely[b[0] != 0]) * chosen[0].prior
        return Explanation(
            tuple(chosen), np.zeros(1), np.full(1, chosen[0].prior / np.hypot(1, size)), -float(np.log(np.hypot(1, size))), total
        )
    fit = fit_family(family, b, [v.prior for v in chosen])
    gained = fit.evidence - _evidence_without(own, parts, base, alone, beside) + (beside.delta_evidence if beside else 0.0)
    # turned by half a turn an effect is the same: nothing predicts its phase
    return Explanation(tuple(chosen), np.abs(fit.size), fit.size_sd, gained, total - before_chi2 + fit.chi2)


def _of_any_size(found: Explanation, parts: Sequence[Family], base: Sequence[FamilyFit], alone: Alone) -> Explanation:
    """The same variant where every size within its limits is believed: what the lines alone say of it."""
    v = found.variants[0]
    family = merged([parts[i] for i in v.parts])
    fit = fit_family(family, [family.of_effect(v.amplitudes)], [v.effect.parameters[0].limits[1]])
    gained = fit.evidence - _evidence_without(v.parts, parts, base, alone, None)
    return replace(found, size=np.abs(fit.size), size_sd=fit.size_sd, delta_evidence=gained)


def _best_of_each(fits: Sequence[Explanation]) -> list[Explanation]:
    best: dict[str, Explanation] = {}
    for f in fits:
        name = f.effects[0]
        if name not in best or f.delta_evidence > best[name].delta_evidence:
            best[name] = f
    return sorted(best.values(), key=lambda f: -f.delta_evidence)


def _pairs(best: Sequence[Explanation], tried: Sequence[Variant], parts: Sequence[Family], base: Sequence[FamilyFit], alone: Alone) -> list[Explanation]:
    """The best single with each other effect: its best variant alone, and those that share lines with the single."""
    if not best or best[0].delta_evidence < CLEAR:
        return []
    first = best[0].variants[0]
    found: dict[str, Explanation] = {}
    for other in tried:
        if other.effect.name == first.effect.name:
            continue
        single = next(f for f in best if f.effects[0] == other.effect.name)
        if other is single.variants[0] or set(other.parts) & set(first.parts):
            pair = _fitted((first, other), parts, base, alone, beside=best[0])
            if other.effect.name not in found or pair.delta_evidence > found[other.effect.name].delta_evidence:
                found[other.effect.name] = pair
    return sorted(found.values(), key=lambda f: -f.delta_evidence)


# ---------------------------------------------------------------- verdict


def _smallest(effects: Sequence[Effect], tried: Sequence[Explanation], found: Sources, parts: Sequence[Family]) -> dict[str, float]:
    """Size of each effect's most visible variant from which it would stand out at `CLEAR`: sqrt(2 CLEAR) standard
    deviations of what the scene may have of the same lines, with the errors of the lines. Where it shares its
    line with something larger, it adds to that as chance has their angle: square to it, it shows less."""
    smallest: dict[str, float] = {}
    for effect in effects:
        sizes = []
        for e in tried:
            v = e.variants[0]
            if v.effect is effect:
                information = 0.0
                for i in v.parts:
                    f = parts[i]
                    b = f.of_effect(v.amplitudes)
                    information += _information(f, b)
                sizes.append(np.sqrt(2 * CLEAR / information) if information > 0 else np.inf)
        smallest[effect.name] = float(min(sizes, default=np.inf))
    return smallest


def _information(f: Family, b: np.ndarray) -> float:
    """Inverse variance of an effect's size when phases are known: with what the spindle has besides of its sources, and the errors."""
    column = f.shown * f.likely
    cover = np.diag(f.sd**2).astype(complex) + column @ column.conj().T
    moved = f.shown @ b
    return float(2 * np.vdot(moved, np.linalg.solve(cover, moved)).real)


def _rejected(chi2: float, count: int) -> bool:
    return bool(count > 0 and chdtrc(count, chi2 / SLACK) < MISFIT)


def _verdict(
    seen: Sequence[Seen],
    found: Sources,
    parts: Sequence[Family],
    base: Sequence[FamilyFit],
    alone: Alone,
    effects: Sequence[Effect],
    fits: Sequence[Explanation],
    best: Sequence[Explanation],
    pairs: Sequence[Explanation],
) -> RunoutDiagnosis:
    count, chi2 = sum(f.count for f in parts), sum(f.chi2 for f in base)
    unexplained = tuple(sorted((g for s in seen for g in s.unexplained), key=lambda g: -g.amplitude))
    first = best[0] if best else None
    candidates = sorted([*best, *(f for f in fits if first and f not in best and first.delta_evidence - f.delta_evidence < AHEAD), *pairs],
                        key=lambda f: -f.delta_evidence)  # fmt: skip
    # a second effect is believed in beforehand as little as the verdict asks of it
    logs = np.array([0.0, *(c.delta_evidence - CLEAR * (len(c.variants) - 1) for c in candidates)])
    weights = np.exp(logs - logs.max())
    candidates = [replace(c, probability=float(w / weights.sum())) for c, w in zip(candidates, weights[1:], strict=True)]
    candidates.sort(key=lambda c: -c.probability)
    needed = [p for p in pairs if first and p.delta_evidence - first.delta_evidence > CLEAR]
    leading = needed[:1] or ([first] if first else [])
    before, after = (np.nan, np.nan)
    if leading and leading[0].delta_evidence > CLEAR:
        before, after = held_out(leading[0], parts)
        ratio = after / before if np.isfinite(before) else 1.0
        candidates = [replace(c, held_out_ratio=ratio) if c.variants == leading[0].variants else c for c in candidates]

    def answer(verdict: str, names: Sequence[str], reason: str, rivals: Sequence[Explanation] = ()) -> RunoutDiagnosis:
        return RunoutDiagnosis(
            verdict, tuple(names), reason, tuple(candidates), tuple(seen), found, tuple(parts), tuple(base),
            _smallest(effects, fits, found, parts), unexplained, before, after, tuple(rivals),
        )  # fmt: skip

    if unexplained:
        where = ", ".join(f"{g.frequency:.1f} Hz ({g.order:.3f} orders, {small_length(g.amplitude)})" for g in unexplained[:4])
        return answer("unexplained", (), f"The records hold lines that no imperfection has: {where}.")
    rejected = _rejected(chi2, count)
    if first is None or not leading or leading[0].delta_evidence < CLEAR:
        if rejected:
            worst = max(range(len(parts)), key=lambda i: base[i].chi2 / parts[i].count)
            return answer("unexplained", (), f"The lines are not those of the scene (misfit {chi2:.0f} for {count} numbers), most at "
                          f"{parts[worst].frequency[0]:.1f} Hz, and no effect explains that.")  # fmt: skip
        gained = (
            f"the best effect, {first.effects[0]}, gains {first.delta_evidence:z.1f} in ln evidence" if first else "no effect can be tried"
        )
        return answer("none", (), f"Imperfections of the size that the scene gives explain all lines (misfit {chi2:.0f} for {count} numbers); {gained} "
                      f"where {CLEAR:g} is asked.")  # fmt: skip
    chosen = leading[0]
    if _rejected(chosen.chi2, count):
        return answer("unexplained", (), f"The lines are not those of the scene (misfit {chi2:.0f} for {count} numbers), and even with "
                      f"{' + '.join(chosen.effects)} a misfit of {chosen.chi2:.0f} is left.")  # fmt: skip
    fall = f"; on left-out conditions the error goes from {before:.2f} to {after:.2f} standard errors" if np.isfinite(before) else ""
    near = [chosen, *(c for c in candidates if c.variants != chosen.variants and len(c.variants) == len(chosen.variants)
                      and chosen.delta_evidence - c.delta_evidence < CERTAIN)]  # fmt: skip
    if needed:
        return answer("two effects", chosen.effects, f"{chosen.effects[0]} and {chosen.effects[1]} are both needed: without the second "
                      f"{chosen.delta_evidence - first.delta_evidence:.1f} in ln evidence are lost{fall}.", near)  # fmt: skip
    rivals = [c for c in best if first.delta_evidence - c.delta_evidence < AHEAD]
    unusual = [c for c in (_of_any_size(e, parts, base, alone) for e in best if e not in rivals and set(e.variants[0].parts) & set(first.variants[0].parts))
               if c.believable and first.delta_evidence - c.delta_evidence < AHEAD]  # fmt: skip
    if unusual and first.believable:
        names = sorted({n for c in [*rivals, *unusual] for n in c.effects})
        sizes = ", ".join(f"{c.effects[0]} ({c.size[0]:.3g} {c.variants[0].effect.parameters[0].unit})" for c in unusual)
        return answer("ambiguous", names, f"{first.effects[0]} leads, but by its likely size alone: of an unusual size {sizes} would explain the "
                      f"lines within {AHEAD:g} in ln evidence of it, or better{fall}.", [first, *unusual, *rivals[1:]])  # fmt: skip
    if len(rivals) > 1 or not first.believable:
        names = sorted({n for c in rivals for n in c.effects})
        return answer("ambiguous", names, f"{', '.join(names)} explain the lines within {AHEAD:g} in ln evidence of each other{fall}.", near)
    falls = (
        ""
        if not np.isfinite(before) or after < FALLS * before
        else ", less than threefold, since the size an imperfection has is known but roughly"
    )
    beside = f", and no second one beside it gains the {CLEAR:g} that are asked" if pairs else ""
    return answer(
        "identified", first.effects, f"{first.effects[0]} leads every other effect alone by more than {AHEAD:g} in ln evidence{beside}{fall}{falls}.", near
    )
