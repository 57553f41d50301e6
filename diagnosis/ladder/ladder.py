"""The ladder: model forms and effects taken in one after the other, and the error at every step.

The first three rungs are the model forms of the literature (`diagnosis.ladder.forms`) on the spindle as drawn, nothing fitted. Then the build
tolerances are fitted, then effects join, everything fitted anew with each. Whoever adds an effect that the data do not ask for sees
that the error stays where it was and the evidence falls.

Where effects are not chosen by hand they are those that `diagnose` names. The rungs have fits of their own, of modes instead of whole FRFs:
in their evidence an effect's formula may be wrong by its `form_error`; errors are those of the fit that takes the formulas at their word,
what they can do at best.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermospindle.diagnosis.data.features import data_of
from thermospindle.diagnosis.data.observe import observe
from thermospindle.diagnosis.fit.fit import Fit, fit, linearise
from thermospindle.diagnosis.fit.held_out import held_out
from thermospindle.diagnosis.inference.next_test import NextTest
from thermospindle.diagnosis.inference.verdict import Candidate, Verdict
from thermospindle.diagnosis.ladder.forms import FORMS, pinned
from thermospindle.diagnosis.ladder.rung import Both, Rung, as_drawn, fitted, mode_numbers
from thermospindle.diagnosis.prediction.theory import Theory, theory
from thermospindle.diagnosis.search.screening import screen, starts
from thermospindle.diagnosis.verdict import Diagnosis, diagnose
from thermospindle.model.errors import BadInput, NoEquilibrium
from thermospindle.model.machine import Spindle
from thermospindle.model.types import Array
from thermospindle.sim.campaign.campaign import Campaign
from thermospindle.sim.effects import CATALOGUE, of_scene
from thermospindle.sim.effects.effect import Effect

NEAREST = 3  # explanations shown where none is accepted
TOLERANCES = "tolerances fitted"
SMALL = 0.2  # of an effect's typical size: start of a fit that goes on from the rung below

Step = tuple[str, tuple[Effect, ...], str]
"""Name of a rung, the effects added to what stands, and the name of the rung it is added to."""


@dataclass(frozen=True, eq=False)
class Ladder:
    """Rungs in the order in which they were climbed.

    `mode` (n,) is the number of the mode that each feature is of, 0 without a computed partner; `kinds` by number. `forms`: every
    model form with all tolerances free: (name, error, held-out error, evidence). `diagnosis` and its next `tests` where effects were
    not chosen by hand.
    """

    spindle: Spindle
    campaign: Campaign
    theory: Theory
    rungs: tuple[Rung, ...]
    mode: np.ndarray
    kinds: Mapping[int, str]
    forms: tuple[tuple[str, float, float, float], ...]
    diagnosis: Diagnosis | None
    tests: tuple[NextTest, ...]

    def rung(self, name: str) -> Rung:
        return next(r for r in self.rungs if r.name == name)

    @property
    def top(self) -> Rung:
        """Where the ladder leads: the last rung, the best of alternatives, or fitted tolerances where no effect is accepted."""
        word = "" if self.diagnosis is None else self.diagnosis.verdict.word
        if word in ("none", "unexplained"):
            return self.rung(TOLERANCES)
        if word == "ambiguous":
            return max((r for r in self.rungs if r.fitted), key=lambda r: r.evidence)
        return self.rungs[-1]


def ladder(
    spindle: Spindle,
    campaign: Campaign,
    chosen: Sequence[Effect] | None = None,
    catalogue: tuple[Effect, ...] = CATALOGUE,
    seen: Callable[[Rung], None] = lambda rung: None,
    progress: Callable[[str], None] = lambda done: None,
) -> Ladder:
    """Climb from fixed stiffness to `chosen` effects, one on top of the other, or to those that the diagnosis names.

    `seen` is told every rung when it is done. Raises `BadInput` for an effect named twice or in the scene already.
    """
    own = [e.name for e, _ in of_scene(spindle)]
    _check(chosen or (), own, spindle)
    about = theory(spindle, data_of(observe(campaign, spindle, progress, os.cpu_count() or 1)))
    rungs: list[Rung] = []

    def climbed(rung: Rung) -> None:
        rungs.append(rung)
        seen(rung)

    for form in FORMS:
        climbed(as_drawn(about, form.name, form.applied, rungs[-1].name if rungs else ""))
    progress("fitting the tolerances")
    slopes = linearise(about)
    below = rungs[-1].name
    found = {TOLERANCES: _both(about, slopes, [fit(about, slopes)])}
    climbed(fitted(about, TOLERANCES, found[TOLERANCES], below))
    named: Diagnosis | None = None
    if chosen is None:
        progress("looking for the effects that are missing")
        named = diagnose(spindle, campaign, catalogue, progress)
        steps = named_by(named.verdict)
    else:
        names = [TOLERANCES, *(f"+ {e.name}" for e in chosen)]
        steps = [(name, (e,), under) for name, e, under in zip(names[1:], chosen, names, strict=False)]
    for name, effects, under in steps:
        best = found[under]
        for effect in effects:
            progress(f"fitting {effect.name}")
            best = added(about, slopes, best, effect)
        found[name] = best
        climbed(fitted(about, name, best, under))
    mode, kinds = mode_numbers(about)
    progress("fitting the tolerances of the other model forms")
    free = [fit(about, slopes, [pinned(e, v) for e, v in form.applied]) for form in FORMS[:-1]]
    forms = tuple(_told(about, form.name, best) for form, best in zip(FORMS, [*free, found[TOLERANCES][0]], strict=True))
    return Ladder(spindle, campaign, about, tuple(rungs), mode, kinds, forms, named, named.tests if named else ())


def _check(chosen: Sequence[Effect], present: Sequence[str], spindle: Spindle) -> None:
    names = [e.name for e in chosen]
    for name in names:
        if names.count(name) > 1:
            raise BadInput(f"--effects {name}: is named twice; each effect stands on one rung")
        if name in present:
            raise BadInput(f"--effects {name}: is in scene {spindle.name} already; its own effects are on every rung")


def named_by(found: Verdict) -> list[Step]:
    """The rungs that a verdict asks for: one effect or two on top of each other, or alternatives beside each other."""
    if found.word == "none" or not found.candidates:
        return []
    if found.word in ("unexplained", "ambiguous"):
        word, rivals = ("nearest:", found.candidates[:NEAREST]) if found.word == "unexplained" else ("or", _alternatives(found))
        return [(f"{word} {' + '.join(c.names)}", _effects(c), TOLERANCES) for c in rivals]
    best = next(c for c in found.candidates if set(c.names) == set(found.effects))
    alone = {c.names[0]: c.delta_evidence for c in found.candidates if len(c.names) == 1}
    steps, below = list[Step](), TOLERANCES
    for effect in sorted(_effects(best), key=lambda e: -alone.get(e.name, -np.inf)):
        steps.append((f"+ {effect.name}", (effect,), below))
        below = steps[-1][0]
    return steps


def _alternatives(found: Verdict) -> list[Candidate]:
    """The candidates that an ambiguous verdict names: the most probable ones, until each of its effects is in one of them."""
    rivals, missing = list[Candidate](), set(found.effects)
    for c in found.candidates:
        if missing:
            rivals.append(c)
            missing -= set(c.names)
    return rivals


def _effects(candidate: Candidate) -> tuple[Effect, ...]:
    return tuple(m.effect for m in candidate.hypothesis.mechanisms)


def added(about: Theory, slopes: Array, below: Both, effect: Effect) -> Both:
    """The fit `below` with one effect more, everything free: from the sizes that screening expects, and from a small size upwards."""
    granted = below[0]
    before = _values(granted)
    effects = (*granted.effects, effect)
    main = effect.parameters[0]
    small = [main.neutral + SMALL * (main.typical - main.neutral), *effect.typical_list()[1:]]
    fits = [fit(about, slopes, effects, [*before, *small], True, granted.nuisance)]
    rough = []
    for signature in screen(about, granted, (effect,), SMALL):
        for start in starts(signature):
            try:
                rough.append(fit(about, slopes, effects, [*before, *start], False))
            except NoEquilibrium:
                continue
    if rough:
        fits.append(fit(about, slopes, effects, _values(max(rough, key=lambda f: f.evidence)), True))
    return _both(about, slopes, fits)


def _values(found: Fit) -> list[float]:
    return [found.values[e.name][p.name] for e in found.effects for p in e.parameters]


def _both(about: Theory, slopes: Array, fits: Sequence[Fit]) -> Both:
    """The best of fits, and where it goes from there when the effects are taken at their word."""
    best = max(fits, key=lambda f: f.evidence)
    if not any(e.form_error for e in best.effects):
        return best, best
    effects = [replace(e, form_error=0.0) for e in best.effects]
    return best, fit(about, slopes, effects, _values(best), True, best.nuisance)


def _told(about: Theory, name: str, best: Fit) -> tuple[str, float, float, float]:
    total, count = held_out(about, best)
    return name, float(np.sqrt(best.misfit / len(best.residual))), float(np.sqrt(total / count)), best.evidence
