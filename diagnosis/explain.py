"""Which effect is missing: screen all, refit the promising ones and pairs, compare by evidence and by held-out conditions, give a verdict."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2 as chi_squared

from diagnosis.fit import Fit, fit, linearise
from diagnosis.many_fits import Task, side_by_side
from diagnosis.theory import Theory
from model.ball_row import Array
from model.pair import NoEquilibrium
from sim.effect import Effect

SINGLES, PAIRED = 5, 3  # effects refitted after the rough fits, and effects tried beside the best
CLOSE = 3.0  # root of chi2 a number, priors included, up to which tolerances alone come close to the data
NEAR = 60.0  # ln evidence within which a fit is polished
CLEAR = 12.0  # ln evidence by which an explanation must lead the model without it: calibrated on campaigns with none
AHEAD = 5.0  # ln evidence by which it must lead every rival to be identified
OF_ALL = 0.01  # share of its ln evidence by which it must lead, where that is more: laws are not exact
SURE = float(np.log(20.0))  # ln odds that such a lead is worth
THERE = 3.0  # standard errors by which both effects of a pair must differ from none
MISFIT = 1e-4  # probability below which a misfit is not chance
FALLS = 1 / 3  # held-out error ratio that counts as a clear fall


@dataclass(frozen=True, eq=False)
class Signature:
    """What an effect at its typical values does to the features, as far as tolerances cannot do the same.

    `visibility`: its size in standard errors, after projection; `expected`: multiple of the typical size that would explain the misfit
    best, with `expected_sd`, where the other parameters are `others`; `smallest`: size of the main parameter (its unit) these data could
    show at `CLEAR`; `gain`: fall of chi2 that the effect promises, to first order.
    """

    effect: Effect
    others: dict[str, float]
    visibility: float
    expected: float
    expected_sd: float
    smallest: float
    direction: Array  # (n,) whitened, projected
    gain: float


@dataclass(frozen=True, eq=False)
class Candidate:
    """An explanation: effects fitted with all tolerances free."""

    fit: Fit
    delta_evidence: float  # ln evidence over the model without effects
    probability: float
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


def left_over(theory: Theory, found: Fit) -> tuple[Array, Array]:
    """What a fit leaves of the data, and the Cholesky factor that takes tolerances and fitted parameters out of any whitened vector.

    The squared length of `solve(factor, W v)` is the chi2 of v that is left after everything has been refitted with its priors, to first
    order about the fit. Returns the whitened, projected residual (n,) and the factor (n, n).
    """
    widths = np.concatenate([theory.sd, [p.prior_sd for e in found.effects for p in e.parameters]])
    a = found.whiten @ (found.jacobian * widths)
    factor = np.linalg.cholesky(np.eye(len(a)) + a @ a.T)
    prior = np.concatenate([found.nuisance / theory.sd, np.zeros(len(widths) - len(theory.sd))])
    return np.linalg.solve(factor, found.whiten @ found.residual + a @ prior), factor


def screen(theory: Theory, found: Fit, catalogue: Sequence[Effect], share: float = 1.0) -> list[Signature]:
    """Finite signature of every effect beside those of a fit, projected off the tolerances; the most telling first.

    `share` of the typical size is tried, with the other parameters at their typical values and one by one a prior width off them: that
    which explains most counts.
    """
    rest, factor = left_over(theory, found)
    present = [(e, found.values[e.name]) for e in found.effects]
    named = {e.name for e in found.effects}
    here = theory.data.value - found.residual
    signatures = []
    for effect in catalogue:
        if effect.name in named:
            continue
        main = effect.parameters[0]
        size = main.neutral + share * (main.typical - main.neutral)
        tried = []
        for others in variations(effect):
            try:
                moved = theory.features(found.nuisance, [*present, (effect, others | {main.name: size})]) - here
            except NoEquilibrium:
                continue
            direction: Array = np.asarray(np.linalg.solve(factor, found.whiten @ moved) / share, float)
            visible = float(np.linalg.norm(direction))
            if visible < 1e-6:
                tried.append(Signature(effect, others, 0.0, 0.0, np.inf, np.inf, direction, 0.0))
                continue
            smallest = abs(main.typical - main.neutral) * float(np.sqrt(2 * CLEAR)) / visible
            expected = float(direction @ rest) / visible**2
            tried.append(Signature(effect, others, visible, expected, 1 / visible, smallest, direction, (expected * visible) ** 2))
        if tried:
            best = max(tried, key=lambda s: s.gain)
            # what the data could show is said of the typical effect, whichever variation fits them
            signatures.append(replace(best, visibility=tried[0].visibility, smallest=tried[0].smallest))
    return sorted(signatures, key=lambda s: -s.gain)


def variations(effect: Effect) -> list[dict[str, float]]:
    """Typical values, and one after the other every parameter but the first a prior width up and down, inside its limits."""
    typical = effect.typical()
    found = [typical]
    for p in effect.parameters[1:]:
        ends = {float(np.clip(p.typical + sign * p.prior_sd, *p.limits)) for sign in (1, -1)} - {p.typical}
        found += [typical | {p.name: end} for end in sorted(ends)]
    return found


def starts(signature: Signature) -> list[list[float]]:
    """Start values of a fit: what the linear screening expects first, then typical values and their opposite, all inside the limits."""
    effect = signature.effect
    main = effect.parameters[0]
    reach = main.typical - main.neutral
    wanted = [(main.neutral + signature.expected * reach, signature.others)]
    wanted += [(main.typical, effect.typical()), (main.neutral - reach, effect.typical())]
    found = [(float(np.clip(size, *main.limits)), *[others[p.name] for p in effect.parameters[1:]]) for size, others in wanted]
    return [list(start) for start in dict.fromkeys(found) if start[0] != main.neutral]


def held_out(theory: Theory, result: Fit, rating: Array | None = None) -> tuple[float, int]:
    """Sum of squares and number of whitened residuals of conditions left out one after the other, each predicted from all others.

    About the optimum the model is linear in its parameters, so leaving a condition out is algebra: minimise without its rows, then look.
    The prediction is rated by the errors of its parameters and by those that `rating` (n, n) whitens, the data's own by default.
    """
    rating = theory.data.whiten if rating is None else rating
    data = theory.data
    temperatures = [o.condition.temperature for o in data.observations]
    widths = np.concatenate([theory.sd, [p.prior_sd for e in result.effects for p in e.parameters]])
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


def explain(
    theory: Theory,
    catalogue: Sequence[Effect],
    workers: int = 2,
    progress: Callable[[str], None] = lambda done: None,
) -> Diagnosis:
    """The whole diagnosis of one campaign; effects that the scene has already are left as they are."""
    catalogue = [e for e in catalogue if e.name not in {present.name for present, _ in theory.present}]
    about = linearise(theory)
    base = fit(theory, about)
    progress(f"tolerances fitted: misfit {base.misfit:.0f} for {len(theory.data.value)} numbers")
    signatures = screen(theory, base, catalogue)
    progress(f"{len(signatures)} effects screened")
    strain = base.chi2 - base.misfit  # tolerances far from their nominal values tell of something too
    strained = chi_squared.sf(strain, len(theory.sd)) < 0.01
    quiet = chi_squared.sf(base.misfit, len(theory.data.value)) > 0.01 and not strained
    if quiet and all(s.gain < CLEAR for s in signatures):
        promising: list[Task] = [((s.effect,), s.effect.typical_list()) for s in signatures[:3]]
    else:
        tasks: list[Task] = [((s.effect,), start) for s in signatures if s.visibility > 1 or s.gain > CLEAR for start in starts(s)]
        # where tolerances explain most, rough fits start from theirs; where they do not, or are strained, they have been dragged off by
        # what is missing, and rough fits start from the drawing
        comes_close = base.chi2 < CLOSE**2 * len(theory.data.value)
        ways: list[tuple[Array, Array | None]] = [(base.jacobian, base.nuisance)] if comes_close else []
        ways += [(about, None)] if not comes_close or strained else []
        promising = []
        for slopes, first in ways:
            rough = _best(side_by_side(theory, slopes, [(*task, first) for task in tasks], False, workers))
            promising += [_again(f) for f in sorted(rough.values(), key=lambda f: -f.evidence)[:SINGLES]]
        promising = promising or [((s.effect,), s.effect.typical_list()) for s in signatures[:3]]  # where nothing is visible at all
        progress(f"{len(tasks)} rough fits made")
    fits = _best(side_by_side(theory, about, [(*task, None) for task in promising], True, workers))
    progress("promising effects refitted with all tolerances free")
    best = max(fits.values(), key=lambda f: f.evidence)
    if best.evidence - base.evidence > CLEAR:
        alike = [s for s in signatures if s.effect.name in best.effects[0].resembles and (s.effect.name,) not in fits and s.visibility > 1]
        tried = [((s.effect,), start, None) for s in alike for start in starts(s)[:1]]
        fits |= _best(side_by_side(theory, about, tried, True, workers))
        best = max(fits.values(), key=lambda f: f.evidence)
        progress(f"{len(alike)} effects refitted that the best resembles")
        close = [f for f in fits.values() if best.evidence - f.evidence < NEAR]
        again = [task for f in close for task in ((*_again(f), f.nuisance), (*_exactly(f), f.nuisance))]
        fits |= _best([*close, *side_by_side(theory, about, again, True, workers)])
        best = max(fits.values(), key=lambda f: f.evidence)
        seconds = [s.effect for s in screen(theory, best, catalogue, 0.1)[:PAIRED] if s.gain > 2 * AHEAD]
        pairs = _best(side_by_side(theory, about, [(*_again(best, e), None) for e in seconds], True, workers))
        level = [f for f in pairs.values() if abs(best.evidence - f.evidence) < NEAR]
        again = [task for f in level for task in ((*_again(f), f.nuisance), (*_exactly(f), f.nuisance))]
        fits |= pairs | _best([*level, *side_by_side(theory, about, again, True, workers)])
        best = max(fits.values(), key=lambda f: f.evidence)
        if len(best.effects) == 2:  # whether one of them would do is asked from where the two came to rest
            alone = [((e,), list(best.values[e.name].values()), best.nuisance) for e in best.effects]
            fits = _best([*fits.values(), *side_by_side(theory, about, alone, True, workers)])
        progress(f"{len(pairs)} pairs fitted")
    return _verdict(theory, base, list(fits.values()), signatures)


def _again(found: Fit, more: Effect | None = None) -> Task:
    """The effects of a fit from where it came to rest, and one more at a small size."""
    values = [found.values[e.name][p.name] for e in found.effects for p in e.parameters]
    if more is None:
        return found.effects, values
    main = more.parameters[0]
    return (*found.effects, more), [*values, main.neutral + 0.2 * (main.typical - main.neutral), *more.typical_list()[1:]]


def _exactly(found: Fit) -> Task:
    """The effects of a fit from where it came to rest, with laws that are exact: errors of form keep a fit from finding that they are none."""
    effects = tuple(replace(e, form_error=0.0, damping_form_error=0.0) for e in found.effects)
    return effects, _again(found)[1]


def _best(fits: Sequence[Fit]) -> dict[tuple[str, ...], Fit]:
    best: dict[tuple[str, ...], Fit] = {}
    for f in fits:
        key = tuple(e.name for e in f.effects)
        if key not in best or f.evidence > best[key].evidence:
            best[key] = f
    return best


def _there(found: Fit, effect: Effect) -> bool:
    """Whether a fitted effect is clearly more than nothing."""
    main = effect.parameters[0]
    return abs(found.values[effect.name][main.name] - main.neutral) > THERE * found.sd[effect.name][main.name]


def _verdict(theory: Theory, base: Fit, fits: list[Fit], signatures: list[Signature]) -> Diagnosis:
    n = len(theory.data.value)
    before, count = held_out(theory, base)
    rms_before = float(np.sqrt(before / count))
    everything = [base, *fits]
    logs = np.array([f.evidence for f in everything])
    ahead = max(AHEAD, OF_ALL * float(logs.max() - base.evidence))
    weights = np.exp((logs - logs.max()) * SURE / ahead)  # a lead of `ahead` is 95 %: blind campaigns did not bear out more
    weights /= weights.sum()
    candidates = []
    for f, w in zip(fits, weights[1:], strict=True):
        # both rated alike, with what the effect's own law may miss
        ratio = float(np.sqrt(held_out(theory, f, f.whiten)[0] / held_out(theory, base, f.whiten)[0]))
        candidates.append(Candidate(f, f.evidence - base.evidence, float(w), ratio, not f.at_limit))
    candidates.sort(key=lambda c: -c.delta_evidence)
    best = candidates[0]
    rejected = chi_squared.sf(base.chi2, n) < MISFIT
    after = best.held_out_ratio * rms_before

    def answer(verdict: str, effects: Sequence[str], reason: str) -> Diagnosis:
        return Diagnosis(verdict, tuple(effects), reason, base, tuple(candidates), tuple(signatures), rms_before, after)

    if best.delta_evidence < CLEAR and not rejected:
        return answer("none", (), f"The tolerances alone explain the data: misfit {base.misfit:.0f} for {n} numbers; the best effect, "
                      f"{' + '.join(best.effects)}, gains {best.delta_evidence:.1f} in ln evidence where {CLEAR:g} is asked.")  # fmt: skip
    if chi_squared.sf(best.fit.chi2, n) < MISFIT or best.delta_evidence < CLEAR:
        return answer("unexplained", (), f"The model is rejected (misfit {base.misfit:.0f} for {n} numbers), and even with "
                      f"{' + '.join(best.effects)} a misfit of {best.fit.misfit:.0f} is left.")  # fmt: skip
    rivals = [c for c in candidates if best.delta_evidence - c.delta_evidence < ahead]
    rivals = [c for c in rivals if len(c.effects) == 1 or all(_there(c.fit, e) for e in c.fit.effects)] or rivals
    singles = [c for c in rivals if len(c.effects) == 1]
    if singles:  # a pair must beat its own members clearly to be needed
        rivals = singles
    names = sorted({name for c in rivals for name in c.effects})
    if len(rivals) == 1 and len(rivals[0].effects) == 1 and rivals[0].believable and rivals[0].held_out_ratio < FALLS:
        c = rivals[0]
        return answer("identified", c.effects, f"{c.effects[0]} leads every other explanation by more than {ahead:.0f} in ln evidence; "
                      f"the error on left-out conditions falls to {100 * c.held_out_ratio:.0f} %.")  # fmt: skip
    if len(rivals) == 1 and len(rivals[0].effects) == 2:
        c = rivals[0]
        return answer("two effects", c.effects, f"{c.effects[0]} and {c.effects[1]} are both needed: dropping either costs more than "
                      f"{ahead:.0f} in ln evidence.")  # fmt: skip
    if len(rivals) == 1:
        second = next((c for c in candidates if len(c.effects) == 1 and c is not rivals[0] and c.delta_evidence > CLEAR), None)
        names = sorted({*names, *(second.effects if second else ())})
        why = (
            "is not believable"
            if not rivals[0].believable
            else f"leaves {100 * rivals[0].held_out_ratio:.0f} % of the error on left-out conditions"
        )
        return answer("ambiguous", names, f"{' + '.join(rivals[0].effects)} leads by more than {ahead:.0f} in ln evidence but {why}.")
    return answer("ambiguous", names, f"{', '.join(names)} explain the data within {ahead:.0f} in ln evidence of each other.")
