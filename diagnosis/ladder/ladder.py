"""The ladder: model forms and effects taken in one after the other, and the error at every step.

The first three steps are the model forms of the literature (`diagnosis.ladder.forms`) on the spindle as drawn, nothing fitted (one without
rolling bearings has but one). Then the build
tolerances are fitted, with the measuring errors; then what the model misses at all conditions alike, its constant discrepancy, is
learned; then effects join, everything fitted anew with each. Whoever adds an effect that the data do not ask for sees that the error stays
where it was and the evidence falls. Where effects are not chosen by hand they are those that `diagnose` names.

Of tables measured at one condition a constant discrepancy could be everything: there it is a step beside the
others, and effects stand on the fitted tolerances. Where a shaft's beam then lacks something, effects not chosen
by hand begin with what it lacks, in the order in which beams took it in, and the mass of the sensors (`BEAM`).

Every fit is that of `diagnosis.inference`; the error of a temperature left out, or of a mode, is that of a fit which never saw it
(`diagnosis.ladder.left_out`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from thermospindle.diagnosis.data.lines import LineData
from thermospindle.diagnosis.data.observe import observe
from thermospindle.diagnosis.decision.explanations import Candidate
from thermospindle.diagnosis.decision.verdict import Verdict
from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.inference.prior import CHANGING
from thermospindle.diagnosis.ladder.fitting import CONSTANT, Settled, settled, without
from thermospindle.diagnosis.ladder.forms import forms_of
from thermospindle.diagnosis.ladder.left_out import LeftOut, Missed, at_one_condition, groups_of, missed, unseen
from thermospindle.diagnosis.ladder.step import MeasuredModes, Step, as_drawn, fitted, measured_modes
from thermospindle.diagnosis.prediction.next_test import NextTest
from thermospindle.diagnosis.verdict import Diagnosis, campaign_data, diagnose
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Spindle
from thermospindle.model.parallel import in_parallel
from thermospindle.sim.campaign.campaign import Campaign
from thermospindle.sim.effects import CATALOGUE, of_scene, usable
from thermospindle.sim.effects.effect import Effect

CLEAR = 12.0  # ln evidence by which a step must lead the one below it
NEAREST = 3  # explanations shown where none is accepted
TOLERANCES, DISCREPANCY = "tolerances fitted", "constant discrepancy"
BEAM = ("rotary_inertia", "shear", "sensor_mass")  # what the plainest beam and its measurement leave out, in the order of Rayleigh 1894 and Timoshenko 1921

TEMPERATURES, MODES = "temperatures", "modes"

Asked = tuple[str, tuple[Effect, ...], str]
"""Name of a step, the effects added to what stands, and the name of the step it is added to."""


@dataclass(frozen=True, eq=False)
class Ladder:
    """Steps in the order in which they were climbed, and the modes that were measured. `left_out`
    is what fits predict unseen: temperatures, or modes.

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
    left_out: str

    def step(self, name: str) -> Step:
        return next(s for s in self.steps if s.name == name)

    @property
    def drawn(self) -> Step:
        """The scene as drawn, by the model of this project, nothing fitted."""
        return [s for s in self.steps if s.fitted is None][-1]

    @property
    def top(self) -> Step:
        """Where the ladder leads: the last step, the best of alternatives and of what a beam lacks
        that is asked for, or that without effects where none is accepted."""
        word = "" if self.diagnosis is None else self.diagnosis.verdict.word
        if word in ("none", "unexplained"):
            return self.step(DISCREPANCY)
        fitted = [s for s in self.steps if s.fitted]
        if word == "ambiguous":
            return max(fitted, key=lambda s: s.evidence)
        if self.diagnosis is not None and self.left_out == MODES:
            named = self.diagnosis.verdict.effects
            asked = [s for s in fitted if not s.effects or s.effects[-1] in named or s.evidence - self.step(s.above).evidence > CLEAR]
            return max(asked, key=lambda s: s.evidence)
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
    model = without(campaign_data(spindle, campaign, progress), CHANGING)
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
    steady = fits(plain)
    climbed(steady.step(measured, TOLERANCES, steps[-1].name))
    progress("fitting what the model misses at all conditions alike")
    found = {TOLERANCES: steady, DISCREPANCY: fits(model)}
    climbed(found[DISCREPANCY].step(measured, DISCREPANCY, TOLERANCES))
    one = at_one_condition(model)
    base, under = (plain, TOLERANCES) if one else (model, DISCREPANCY)
    named: Diagnosis | None = None
    if chosen is None:
        progress("looking for the effects that are missing")
        named = diagnose(spindle, campaign, catalogue, progress)
        asked = named_by(named.verdict, under)
        lacking = _lacking(spindle, catalogue) if one else []
        asked = [*one_by_one(lacking, under), *(a for a in asked if not {e.name for e in a[1]} <= {e.name for e in lacking})]
    else:
        asked = one_by_one(chosen, under)
    for name, effects, below in asked:
        progress(f"fitting {' and '.join(e.name for e in effects)}")
        found[name] = fits(base, found[below], effects)
        climbed(found[name].step(measured, name, below))
    if len(every) > 1:
        progress("fitting the tolerances of the other model forms")
    lines = any(isinstance(d, LineData) for d in model.tests)  # each such fit takes minutes, to predict by a form that nobody defends
    free = [fits(replace(model, present=(*model.present, *form.applied)), leave_out=not lines) for form in every[:-1]]
    forms = tuple((form.name, *own.errors()) for form, own in zip(every, [*free, found[DISCREPANCY]], strict=True))
    return Ladder(spindle, campaign, model, measured, tuple(steps), forms, named, named.tests if named else (), MODES if one else TEMPERATURES)


def one_by_one(effects: Sequence[Effect], below: str) -> list[Asked]:
    """Each effect a step on top of the one before it, the first on `below`."""
    names = [below, *(f"+ {e.name}" for e in effects)]
    return [(name, (e,), under) for name, e, under in zip(names[1:], effects, names, strict=False)]


def _lacking(spindle: Spindle, catalogue: tuple[Effect, ...]) -> list[Effect]:
    """What the beam of a spindle's shafts lacks, and the mass of the sensors; nothing where it lacks nothing."""
    own = [e.name for e, _ in of_scene(spindle)]
    found = {e.name: e for e in usable(spindle, catalogue) if e.name in BEAM and e.name not in own}
    return [found[name] for name in BEAM if name in found] if set(BEAM[:2]) & set(found) else []


@dataclass(frozen=True, eq=False)
class Fits:
    """One model fitted to `whole`, all tests, and to all but each group of them: `partial`, with
    how far each of these fits is from its group."""

    whole: Settled
    partial: tuple[tuple[Settled, Missed], ...]

    def errors(self) -> tuple[float, float, float]:
        """Rms residual of all data, of those left out (NaN where nothing can be), and ln evidence."""
        fit = self.whole.fit
        return float(np.sqrt(fit.chi2 / fit.count)), self.held_out[0], self.whole.evidence.ln

    @property
    def held_out(self) -> tuple[float, float]:
        """Rms of what is left out: in standard errors of its prediction, and of frequencies of tables in per cent; NaN where nothing is."""
        every = [m for _, m in self.partial]
        return _root(sum(m.squares for m in every), sum(m.count for m in every)), 100 * _root(sum(m.relative for m in every), sum(m.frequencies for m in every))

    def step(self, measured: MeasuredModes, name: str, above: str) -> Step:
        return fitted(self.whole, measured, name, self.held_out, above)


def _root(squares: float, count: int) -> float:
    return float(np.sqrt(squares / count)) if count else float("nan")


def fits(model: CampaignModel, below: Fits | None = None, effects: Sequence[Effect] = (), leave_out: bool = True) -> Fits:
    """All fits of a model with `effects` beside those of the step `below`; only that to all tests where nothing is to be left out."""
    groups = [LeftOut(), *(groups_of(model) if leave_out else [])]
    before = [None] * len(groups) if below is None else [below.whole, *(row[0] for row in below.partial)]
    (whole, _), *rest = in_parallel(partial(_fitted, model, tuple(effects)), list(zip(groups, before, strict=True)))
    return Fits(whole, tuple(rest))


def _fitted(model: CampaignModel, effects: tuple[Effect, ...], task: tuple[LeftOut, Settled | None]) -> tuple[Settled, Missed]:
    """The model fitted without a group, and how far it is from that."""
    group, below = task
    found = settled(unseen(model, group), below, effects)
    return found, missed(found, model.tests, group) if group.tests else Missed()


def _check(chosen: Sequence[Effect], present: Sequence[str], spindle: Spindle) -> None:
    names = [e.name for e in chosen]
    for name in names:
        if names.count(name) > 1:
            raise BadInput(f"--effects {name}: is named twice; each effect is one step")
        if name in present:
            raise BadInput(f"--effects {name}: is in scene {spindle.name} already; its own effects are on every step")


def named_by(found: Verdict, under: str = DISCREPANCY) -> list[Asked]:
    """The steps that a verdict asks for, on the step `under`: one effect or two on top of each other, or alternatives beside each other."""
    if found.word == "none" or not found.candidates:
        return []
    if found.word in ("unexplained", "ambiguous"):
        word, rivals = ("nearest:", found.candidates[:NEAREST]) if found.word == "unexplained" else ("or", _alternatives(found))
        return [(f"{word} {' + '.join(c.names)}", _effects(c), under) for c in rivals]
    exact = [c for c in found.candidates if set(c.names) == set(found.effects)]
    among = exact[:1] or [*found.candidates, *found.free]  # beside something that drifts freely alone, maybe
    effects = {m.name: m.effect for c in reversed(among) for m in c.hypothesis.mechanisms if m.name in found.effects}
    alone = {c.names[0]: c.delta_evidence for c in found.candidates if len(c.names) == 1}
    steps, below = list[Asked](), under
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
