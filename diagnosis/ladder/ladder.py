"""The ladder: model forms and effects taken in one after the other, and the error at every step.

The first three steps are the model forms of the literature (`diagnosis.ladder.forms`) on the spindle as drawn, nothing fitted (one without
rolling bearings has but one). Then the build
tolerances are fitted, with the measuring errors; then what the model misses at all conditions alike, its constant discrepancy, is
learned; then effects join, everything fitted anew with each. Whoever adds an effect that the data do not ask for sees that the error stays
where it was and the evidence falls. Where effects are not chosen by hand they are those that `diagnose` names.

Every fit is that of `diagnosis.inference`; the error of a temperature left out is that of a fit which never saw it
(`diagnosis.ladder.fitting`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from thermospindle.diagnosis.data.lines import LineData
from thermospindle.diagnosis.data.observe import observe
from thermospindle.diagnosis.decision.conditions import conditions_of
from thermospindle.diagnosis.decision.explanations import Candidate
from thermospindle.diagnosis.decision.verdict import Verdict
from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.ladder.fitting import CONSTANT, FREE, Settled, predicted_squares, settled, unseen, without
from thermospindle.diagnosis.ladder.forms import forms_of
from thermospindle.diagnosis.ladder.step import MeasuredModes, Step, as_drawn, fitted, measured_modes
from thermospindle.diagnosis.prediction.next_test import NextTest
from thermospindle.diagnosis.verdict import Diagnosis, campaign_data, diagnose
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Spindle
from thermospindle.model.parallel import in_parallel
from thermospindle.sim.campaign.campaign import Campaign
from thermospindle.sim.effects import CATALOGUE, of_scene
from thermospindle.sim.effects.effect import Effect

CLEAR = 12.0  # ln evidence by which a step must lead the one below it
NEAREST = 3  # explanations shown where none is accepted
TOLERANCES, DISCREPANCY = "tolerances fitted", "constant discrepancy"

Asked = tuple[str, tuple[Effect, ...], str]
"""Name of a step, the effects added to what stands, and the name of the step it is added to."""


@dataclass(frozen=True, eq=False)
class Ladder:
    """Steps in the order in which they were climbed, and the modes that were measured.

    `forms`: every model form with all tolerances and the constant discrepancy free: (name, error, held-out error, evidence), the held-out
    error NaN for the earlier forms beside FRF lines. `diagnosis` and its next `tests` where effects were not chosen by hand.
    """

    spindle: Spindle
    campaign: Campaign
    model: CampaignModel
    measured: MeasuredModes
    steps: tuple[Step, ...]
    forms: tuple[tuple[str, float, float, float], ...]
    diagnosis: Diagnosis | None
    tests: tuple[NextTest, ...]

    def step(self, name: str) -> Step:
        return next(s for s in self.steps if s.name == name)

    @property
    def drawn(self) -> Step:
        """The scene as drawn, by the model of this project, nothing fitted."""
        return [s for s in self.steps if s.fitted is None][-1]

    @property
    def top(self) -> Step:
        """Where the ladder leads: the last step, the best of alternatives, or that without effects where none is accepted."""
        word = "" if self.diagnosis is None else self.diagnosis.verdict.word
        if word in ("none", "unexplained"):
            return self.step(DISCREPANCY)
        if word == "ambiguous":
            return max((s for s in self.steps if s.fitted), key=lambda s: s.evidence)
        return self.steps[-1]


def ladder(
    spindle: Spindle,
    campaign: Campaign,
    chosen: Sequence[Effect] | None = None,
    catalogue: tuple[Effect, ...] = CATALOGUE,
    seen: Callable[[Step], None] = lambda step: None,
    progress: Callable[[str], None] = lambda done: None,
) -> Ladder:
    """Climb from fixed stiffness to `chosen` effects, one on top of the other, or to those that the diagnosis names.

    `seen` is told every step when it is done. Raises `BadInput` for an effect named twice or in the scene already.
    """
    own = [e.name for e, _ in of_scene(spindle)]
    _check(chosen or (), own, spindle)
    model = without(campaign_data(spindle, campaign, progress), FREE)
    plain = without(model, CONSTANT)
    measured = measured_modes(model, observe(campaign, spindle, progress))
    steps: list[Step] = []

    def climbed(step: Step) -> None:
        steps.append(step)
        seen(step)

    every = forms_of(spindle)
    for form in every:
        climbed(as_drawn(plain, measured, form.name, form.applied, steps[-1].name if steps else ""))
    progress("fitting the tolerances")
    climbed(fits(plain).step(measured, TOLERANCES, steps[-1].name))
    progress("fitting what the model misses at all conditions alike")
    found = {DISCREPANCY: fits(model)}
    climbed(found[DISCREPANCY].step(measured, DISCREPANCY, TOLERANCES))
    named: Diagnosis | None = None
    if chosen is None:
        progress("looking for the effects that are missing")
        named = diagnose(spindle, campaign, catalogue, progress)
        asked = named_by(named.verdict)
    else:
        names = [DISCREPANCY, *(f"+ {e.name}" for e in chosen)]
        asked = [(name, (e,), under) for name, e, under in zip(names[1:], chosen, names, strict=False)]
    for name, effects, under in asked:
        progress(f"fitting {' and '.join(e.name for e in effects)}")
        found[name] = fits(model, found[under], effects)
        climbed(found[name].step(measured, name, under))
    if len(every) > 1:
        progress("fitting the tolerances of the other model forms")
    lines = any(isinstance(d, LineData) for d in model.tests)  # each such fit takes minutes, to predict by a form that nobody defends
    free = [fits(replace(model, present=(*model.present, *form.applied)), leave_out=not lines) for form in every[:-1]]
    forms = tuple((form.name, *own.errors()) for form, own in zip(every, [*free, found[DISCREPANCY]], strict=True))
    return Ladder(spindle, campaign, model, measured, tuple(steps), forms, named, named.tests if named else ())


@dataclass(frozen=True, eq=False)
class Fits:
    """One model fitted to `whole`, all tests, and to all but each group of them: `partial`, with squares and number of the residuals that each of
    these fits predicts its group with."""

    whole: Settled
    partial: tuple[tuple[Settled, float, int], ...]

    def errors(self) -> tuple[float, float, float]:
        """Rms residual of all data, of those left out (NaN where nothing can be), and ln evidence."""
        squares, count = sum(row[1] for row in self.partial), sum(row[2] for row in self.partial)
        fit = self.whole.fit
        return float(np.sqrt(fit.chi2 / fit.count)), float(np.sqrt(squares / count)) if count else float("nan"), self.whole.evidence.ln

    def step(self, measured: MeasuredModes, name: str, above: str) -> Step:
        return fitted(self.whole, measured, name, self.errors()[1], above)


def fits(model: CampaignModel, below: Fits | None = None, effects: Sequence[Effect] = (), leave_out: bool = True) -> Fits:
    """All fits of a model with `effects` beside those of the step `below`; only that to all tests where nothing is to be left out."""
    apart = conditions_of(model.spindle, model.tests)
    groups: list[list[int]] = [[], *(apart if leave_out and len(apart) > 1 else [])]
    before = [None] * len(groups) if below is None else [below.whole, *(row[0] for row in below.partial)]
    (whole, _, _), *rest = in_parallel(partial(_fitted, model, tuple(effects)), list(zip(groups, before, strict=True)))
    return Fits(whole, tuple(rest))


def _fitted(model: CampaignModel, effects: tuple[Effect, ...], task: tuple[Sequence[int], Settled | None]) -> tuple[Settled, float, int]:
    """The model fitted without a group of tests, and squares and number of the residuals that it predicts them with."""
    group, below = task
    found = settled(unseen(model, group), below, effects)
    squares, count = predicted_squares(found, model.tests, group) if group else (0.0, 0)
    return found, squares, count


def _check(chosen: Sequence[Effect], present: Sequence[str], spindle: Spindle) -> None:
    names = [e.name for e in chosen]
    for name in names:
        if names.count(name) > 1:
            raise BadInput(f"--effects {name}: is named twice; each effect is one step")
        if name in present:
            raise BadInput(f"--effects {name}: is in scene {spindle.name} already; its own effects are on every step")


def named_by(found: Verdict) -> list[Asked]:
    """The steps that a verdict asks for: one effect or two on top of each other, or alternatives beside each other."""
    if found.word == "none" or not found.candidates:
        return []
    if found.word in ("unexplained", "ambiguous"):
        word, rivals = ("nearest:", found.candidates[:NEAREST]) if found.word == "unexplained" else ("or", _alternatives(found))
        return [(f"{word} {' + '.join(c.names)}", _effects(c), DISCREPANCY) for c in rivals]
    exact = [c for c in found.candidates if set(c.names) == set(found.effects)]
    among = exact[:1] or [*found.candidates, *found.free]  # beside something that drifts freely alone, maybe
    effects = {m.name: m.effect for c in reversed(among) for m in c.hypothesis.mechanisms if m.name in found.effects}
    alone = {c.names[0]: c.delta_evidence for c in found.candidates if len(c.names) == 1}
    steps, below = list[Asked](), DISCREPANCY
    for effect in sorted(effects.values(), key=lambda e: -alone.get(e.name, -np.inf)):
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
