"""Which effect is missing: screen all, refit the promising ones and pairs, compare by evidence and by held-out conditions, give a verdict."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.stats import chi2 as chi_squared

from diagnosis.fit import Fit, Linear, fit, linearise
from diagnosis.theory import Theory
from model.ball_row import Array
from model.pair import NoEquilibrium
from sim.effect import Effect

SINGLES, PAIRED = 6, 4  # effects refitted after screening, and of those combined in pairs
CLEAR = 12.0  # ln evidence by which an explanation must lead the model without it: calibrated on campaigns with none
AHEAD = 5.0  # ln evidence by which it must lead every rival to be identified
MISFIT = 1e-4  # probability below which a misfit is not chance
FALLS = 1 / 3  # held-out error ratio that counts as a clear fall


@dataclass(frozen=True, eq=False)
class Signature:
    """What an effect at its typical values does to the features, as far as tolerances cannot do the same.

    `visibility`: its size in standard errors, after projection; `expected`: multiple of the typical size that would explain the misfit
    best, with `expected_sd`; `smallest`: size of the main parameter (its unit) these data could show at `CLEAR`.
    """

    effect: Effect
    visibility: float
    expected: float
    expected_sd: float
    smallest: float
    direction: Array  # (n,) whitened, projected


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


def projector(theory: Theory, about: Linear) -> tuple[Array, Array]:
    """Whitened data derivative by nuisance in prior units, A (n, p), and the Cholesky factor of I + A A^T (n, n).

    Solving with the factor marginalises the tolerances out of a whitened residual: its squared length is the chi2 left after they
    have been fitted with their priors.
    """
    a = theory.data.whiten @ (about.by_nuisance * theory.sd)
    return a, np.linalg.cholesky(np.eye(len(a)) + a @ a.T)


def screen(theory: Theory, about: Linear, catalogue: Sequence[Effect]) -> list[Signature]:
    """Finite signature of every effect, projected off the tolerances; the most telling first."""
    _, factor = projector(theory, about)
    whiten = theory.data.whiten

    def left(vector: Array) -> Array:
        return np.linalg.solve(factor, whiten @ vector)

    rest = left(theory.data.value - about.value)
    found = []
    nothing = np.zeros(len(theory.sd))
    for effect in catalogue:
        values = effect.typical()
        try:
            moved = theory.features(nothing, [(effect, values)]) - about.value
        except NoEquilibrium:
            continue
        direction = left(moved)
        size = float(np.linalg.norm(direction))
        main = effect.parameters[0]
        reach = abs(main.typical - main.neutral)
        if size == 0.0:
            found.append(Signature(effect, 0.0, 0.0, np.inf, np.inf, direction))
            continue
        expected = float(direction @ rest) / size**2
        found.append(Signature(effect, size, expected, 1 / size, reach * float(np.sqrt(2 * CLEAR)) / size, direction))
    return sorted(found, key=lambda s: -((s.expected * s.visibility) ** 2))


def starts(effect: Effect, expected: float) -> list[list[float]]:
    """Start values of a fit: typical, and the size the linear screening expects, both inside the limits."""
    main = effect.parameters[0]
    rest = [p.typical for p in effect.parameters[1:]]
    sizes = {main.typical, main.neutral + expected * (main.typical - main.neutral)}
    sizes.add(main.neutral - (main.typical - main.neutral))
    inside = [float(np.clip(s, *main.limits)) for s in sizes]
    return [[s, *rest] for s in sorted(set(inside)) if s != main.neutral]


def held_out(theory: Theory, result: Fit) -> tuple[float, int]:
    """Sum of squares and number of whitened residuals of conditions left out one after the other, each predicted from all others.

    About the optimum the model is linear in its parameters, so leaving a condition out is algebra: minimise without its rows, then look.
    """
    data = theory.data
    conditions = [(o.condition.temperature, o.condition.speed) for o in data.observations]
    white = data.whiten @ result.jacobian
    residual = data.whiten @ result.residual
    widths = np.concatenate([theory.sd, [p.prior_sd for e in result.effects for p in e.parameters]])
    total, count = 0.0, 0
    for leave in sorted({c[0] for c in conditions}):
        out = np.array([conditions[f.test][0] == leave for f in data.features])
        a = white[~out] * widths
        offset = np.concatenate([result.nuisance / theory.sd, np.zeros(len(widths) - len(theory.sd))])
        normal = a.T @ a + np.eye(len(widths))
        step = np.linalg.solve(normal, a.T @ residual[~out] - offset)
        left = residual[out] - (white[out] * widths) @ step
        spread = np.eye(out.sum()) + (white[out] * widths) @ np.linalg.solve(normal, (white[out] * widths).T)
        total += float(left @ np.linalg.solve(spread, left))
        count += int(out.sum())
    return total, count


def explain(
    theory: Theory,
    catalogue: Sequence[Effect],
    workers: int = 2,
    progress: Callable[[str], None] = lambda done: None,
) -> Diagnosis:
    """The whole diagnosis of one campaign."""
    about = linearise(theory)
    base = fit(theory, about)
    progress(f"tolerances fitted: misfit {base.misfit:.0f} for {len(theory.data.value)} numbers")
    signatures = screen(theory, about, catalogue)
    progress(f"{len(signatures)} effects screened")
    tasks = [((s.effect,), start) for s in signatures if s.visibility > 0 for start in starts(s.effect, s.expected)]
    fits = _best(_all(theory, about, tasks, 4, workers))
    order = sorted(fits.values(), key=lambda f: -f.evidence)[:SINGLES]
    tasks = [(f.effects, [f.values[e.name][p.name] for e in f.effects for p in e.parameters]) for f in order]
    fits |= _best(_all(theory, about, tasks, 15, workers))
    progress("promising effects refitted")
    order = sorted((f for f in fits.values()), key=lambda f: -f.evidence)
    tasks = []
    for a, b in combinations(order[:PAIRED], 2):
        effects = (*a.effects, *b.effects)
        begin = [f.values[e.name][p.name] for f in (a, b) for e in f.effects for p in e.parameters]
        tasks.append((effects, begin))
    fits |= _best(_all(theory, about, tasks, 12, workers))
    progress("pairs refitted")
    return _verdict(theory, base, list(fits.values()), signatures)


def _all(theory: Theory, about: Linear, tasks: list[tuple[tuple[Effect, ...], list[float]]], steps: int, workers: int) -> list[Fit]:
    if workers < 2 or len(tasks) < 2:
        return [fit(theory, about, effects, start, steps) for effects, start in tasks]
    with ProcessPoolExecutor(workers) as pool:
        jobs = [pool.submit(fit, theory, about, effects, start, steps) for effects, start in tasks]
        return [job.result() for job in jobs]


def _best(fits: Sequence[Fit]) -> dict[tuple[str, ...], Fit]:
    best: dict[tuple[str, ...], Fit] = {}
    for f in fits:
        key = tuple(e.name for e in f.effects)
        if key not in best or f.evidence > best[key].evidence:
            best[key] = f
    return best


def _verdict(theory: Theory, base: Fit, fits: list[Fit], signatures: list[Signature]) -> Diagnosis:
    n = len(theory.data.value)
    before, count = held_out(theory, base)
    rms_before = float(np.sqrt(before / count))
    everything = [base, *fits]
    logs = np.array([f.evidence for f in everything])
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    candidates = []
    for f, w in zip(fits, weights[1:], strict=True):
        after, _ = held_out(theory, f)
        ratio = float(np.sqrt(after / before))
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
    rivals = [c for c in candidates if best.delta_evidence - c.delta_evidence < AHEAD]
    singles = [c for c in rivals if len(c.effects) == 1]
    if singles:  # a pair must beat its own members clearly to be needed
        rivals = singles
    names = sorted({name for c in rivals for name in c.effects})
    if len(rivals) == 1 and len(rivals[0].effects) == 1 and rivals[0].believable and rivals[0].held_out_ratio < FALLS:
        c = rivals[0]
        return answer("identified", c.effects, f"{c.effects[0]} leads every other explanation by more than {AHEAD:g} in ln evidence; "
                      f"the error on left-out conditions falls to {100 * c.held_out_ratio:.0f} %.")  # fmt: skip
    if len(rivals) == 1 and len(rivals[0].effects) == 2:
        c = rivals[0]
        return answer("two effects", c.effects, f"{c.effects[0]} and {c.effects[1]} are both needed: dropping either costs more than "
                      f"{AHEAD:g} in ln evidence.")  # fmt: skip
    return answer("ambiguous", names, f"{', '.join(names)} explain the data within {AHEAD:g} in ln evidence of each other.")
