"""Screening: what every effect would do to these data beside what tolerances can do, and where a fit of it should start."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermospindle.diagnosis.fit.fit import Fit, prior_widths
from thermospindle.diagnosis.prediction.theory import Theory
from thermospindle.model.errors import NoEquilibrium
from thermospindle.model.types import Array
from thermospindle.sim.effects.effect import Effect

CLEAR = 12.0  # ln evidence by which an explanation must lead the model without it
LITTLE = 0.01  # of what is tried, for the direction in which an effect begins
SMALL = 0.2  # share of the typical size below which a fit that starts there may not find home


@dataclass(frozen=True, eq=False)
class Signature:
    """What an effect at its typical values does to the features, as far as tolerances cannot do the same.

    `share` of the typical size was tried. `visibility`: typical size in standard errors, after projection; `expected`: multiple of the typical size that would explain the misfit
    best, where the other parameters are `others`; `smallest`: size of the main parameter (its unit) these data could
    show at `CLEAR`; `gain`: fall of chi2 that the effect promises, to first order.
    """

    effect: Effect
    others: dict[str, float]
    share: float
    visibility: float
    expected: float
    smallest: float
    direction: Array  # (n,) whitened, projected
    gain: float


def left_over(theory: Theory, found: Fit) -> tuple[Array, Array]:
    """What a fit leaves of the data, and the Cholesky factor that takes tolerances and fitted parameters out of any whitened vector.

    The squared length of `solve(factor, W v)` is the chi2 of v that is left after everything has been refitted with its priors, to first
    order about the fit. Returns the whitened, projected residual (n,) and the factor (n, n).
    """
    widths = prior_widths(theory, found)
    a = found.whiten @ (found.jacobian * widths)
    factor = absorbing(a)
    prior = np.concatenate([found.nuisance / theory.sd, np.zeros(len(widths) - len(theory.sd))])
    return np.linalg.solve(factor, found.whiten @ found.residual + a @ prior), factor


def absorbing(a: Array) -> Array:
    """The Cholesky factor (n, n) of the covariance of data whose model has whitened derivatives `a` (n, p) by parameters of unit priors."""
    return np.asarray(np.linalg.cholesky(np.eye(len(a)) + a @ a.T))


def screen(theory: Theory, found: Fit, catalogue: Sequence[Effect], share: float = 1.0) -> list[Signature]:
    """Finite signature of every effect beside those of a fit, projected off the tolerances; the most telling first.

    `share` of the typical size is tried, or less where that would do more to the data than anything that they still hold: what an effect
    does need not grow with its size. The other parameters are at their typical values, then one by one a prior width off them, then once
    more about the best of these: what explains most counts.
    """
    rest, factor = left_over(theory, found)
    present = [(e, found.values[e.name]) for e in found.effects]
    named = {e.name for e in found.effects}
    here = theory.data.value - found.residual
    much = max(float(np.linalg.norm(rest)), float(np.sqrt(2 * CLEAR)))

    def tried(effect: Effect, others: dict[str, float], share: float) -> Signature | None:
        main = effect.parameters[0]
        size = main.neutral + share * (main.typical - main.neutral)
        try:
            moved = theory.features(found.nuisance, [*present, (effect, others | {main.name: size})]) - here
        except NoEquilibrium:
            return None
        direction: Array = np.asarray(np.linalg.solve(factor, found.whiten @ moved) / share, float)
        visible = float(np.linalg.norm(direction))
        if visible < 1e-6:
            return Signature(effect, others, share, 0.0, 0.0, np.inf, direction, 0.0)
        smallest = abs(main.typical - main.neutral) * float(np.sqrt(2 * CLEAR)) / visible
        expected = float(direction @ rest) / visible**2
        return Signature(effect, others, share, visible, expected, smallest, direction, (expected * visible) ** 2)

    signatures = []
    for effect in catalogue:
        if effect.name in named:
            continue
        typical = tried(effect, effect.typical(), share)
        if typical is not None and typical.visibility * share > much:
            smaller = tried(effect, effect.typical(), much / typical.visibility)
            typical = replace(smaller, visibility=typical.visibility) if smaller else typical
        begin = typical.share if typical else share
        possible = [s for s in (typical, *(tried(effect, others, begin) for others in variations(effect, effect.typical()))) if s]
        if possible:
            best = max(possible, key=lambda s: s.gain)
            if best is not typical:  # two parameters may have to move together
                again = [tried(effect, others, begin) for others in variations(effect, best.others)]
                best = max([best, *(s for s in again if s)], key=lambda s: s.gain)
            # what tolerances nearly absorb shows its own direction only where it is small: the rest is curvature
            little = tried(effect, best.others, LITTLE * begin)
            best = little if little and little.gain > best.gain else best
            # what the data could show is said of the typical effect, whichever variation fits them
            signatures.append(replace(best, visibility=possible[0].visibility, smallest=possible[0].smallest))
    return sorted(signatures, key=lambda s: -s.gain)


def variations(effect: Effect, others: dict[str, float]) -> list[dict[str, float]]:
    """Every parameter but the first one by one a prior width up and down, inside its limits, or at each of its other choices."""
    found = []
    for p in effect.parameters[1:]:
        value = others[p.name]
        ends = {float(np.clip(value + sign * p.prior_sd, *p.limits)) for sign in (1, -1)} if not p.choices else set(p.choices)
        found += [others | {p.name: end} for end in sorted(ends - {value})]
    return found


def starts(signature: Signature) -> list[list[float]]:
    """Start values of a fit, all inside the limits: what the linear screening expects first, then typical values and their opposite, and
    for an effect of which the data bear only a small share, that."""
    effect = signature.effect
    main = effect.parameters[0]
    reach = main.typical - main.neutral
    wanted = [(main.neutral + signature.expected * reach, signature.others)]
    wanted += [(main.typical, effect.typical()), (main.neutral - reach, effect.typical())]
    wanted += [(main.neutral + signature.share * reach, effect.typical())] if signature.share < SMALL else []
    found = [(float(np.clip(size, *main.limits)), *[others[p.name] for p in effect.parameters[1:]]) for size, others in wanted]
    return [list(start) for start in dict.fromkeys(found) if start[0] != main.neutral]
