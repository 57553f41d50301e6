"""One step of the ladder: a model beside all data of a campaign, and the errors it leaves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from thermospindle.diagnosis.data.mode_table import ModeData
from thermospindle.diagnosis.data.observe import Observation
from thermospindle.diagnosis.forward.model import Applied, CampaignModel
from thermospindle.diagnosis.ladder.fitting import Settled
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.diagnosis.prediction.modes import BEYOND, Predicted, predicted
from thermospindle.diagnosis.prediction.partners import BELIEVABLE, numbered, of_partners, paired
from thermospindle.model.types import Array

TEMPERATURE_APART = 0.5  # K, from which two tests show a shift


@dataclass(frozen=True, eq=False)
class MeasuredModes:
    """All measured modes of a campaign, one row (n,) each: number of the test, number of the computed mode (0: none), natural
    frequency (Hz) and damping ratio (NaN: not measured) with standard errors. `kinds` of the computed modes by number."""

    observations: tuple[Observation, ...]
    test: Array
    number: Array
    frequency: Array
    sd: Array
    damping: Array
    damping_sd: Array
    kinds: Mapping[int, str]


@dataclass(frozen=True, eq=False)
class Step:
    """One model beside all data.

    `error` and `held_out` are rms residuals: of all data in their standard errors, and of each temperature predicted from the
    others, at one condition of each mode, in standard errors of that prediction (with nothing fitted there is nothing to leave
    out, and the two are the same); `held_out_percent` are the frequencies of tables predicted so, NaN without any. `frequency`
    and `damping` (n,) are computed for every measured mode, NaN without a partner; `rms_Hz` and `rms_percent` are of frequencies,
    `rms_shift_Hz` the error of the shifts from the coldest test of each speed, None without a second temperature. `stretch` is
    the rms of the fitted tolerances in their own standard deviations: about one or less is believable, and a small error with a
    large stretch is bought, not explained. `evidence` is ln, on one scale for all steps. `lost_contact` says of which tests.
    """

    name: str
    effects: tuple[str, ...]  # beside the scene's own
    values: Mapping[str, Mapping[str, tuple[float, float]]]  # effect -> parameter -> (value, standard error)
    model: CampaignModel
    nuisance: Array  # (p,)
    applied: tuple[Applied, ...]  # by test
    fitted: Settled | None
    frequency: Array  # (n,) Hz
    damping: Array  # (n,)
    error: float
    held_out: float
    held_out_percent: float
    rms_Hz: float
    rms_percent: float
    rms_shift_Hz: float | None
    stretch: float
    evidence: float
    lost_contact: tuple[str, ...]
    above: str  # the step it stands on, empty for the first

    def residual(self, measured: MeasuredModes) -> tuple[Array, Array]:
        """(computed - measured) / standard error (n,) of frequencies and of damping ratios, NaN where there is none, of either."""
        of_damping = np.where(np.isfinite(measured.damping_sd), (self.damping - measured.damping) / measured.damping_sd, np.nan)
        return (self.frequency - measured.frequency) / measured.sd, of_damping


def as_drawn(model: CampaignModel, measured: MeasuredModes, name: str, applied: Applied, above: str = "") -> Step:
    """The spindle as drawn with effects at given values; nothing is fitted, so there is no parameter to pay for."""
    nothing = np.zeros(len(model.parameters))
    everywhere = [applied for _ in model.tests]
    frequency, damping = _computed(model, measured, nothing, everywhere)
    squares = 0.0
    for t, data in enumerate(model.tests):
        if isinstance(data, ModeData):  # by the pairs shown, for forms may lose modes
            own = measured.test == t
            frequencies = _of_table(frequency[own], measured.frequency[own], data.frequency_sd)
            squares += frequencies + _of_table(damping[own], measured.damping[own], data.damping_sd)
        else:
            squares += float(np.sum(model.residual(t, nothing, applied) ** 2))
    error = float(np.sqrt(squares / sum(d.count for d in model.tests)))
    relative = _rms(frequency / measured.frequency - 1) if any(isinstance(d, ModeData) for d in model.tests) else float("nan")
    return _step(model, measured, name, (), {}, nothing, everywhere, None, error, (error, 100 * relative), -0.5 * squares, above)


def _of_table(computed: Array, measured: Array, sd: Array) -> float:
    """Sum of squares of ln(computed / measured) / sd; a mode without a partner is off by `BELIEVABLE`."""
    known = np.isfinite(sd)
    off = np.log(np.where(np.isnan(computed), (1 + BELIEVABLE) * measured, computed)[known] / measured[known]) / sd[known]
    return float(off @ off)


def fitted(found: Settled, measured: MeasuredModes, name: str, held_out: tuple[float, float], above: str) -> Step:
    """A fit of tolerances and effects, beside the scene's own effects, and how far what is
    `held_out` is missed: in standard errors, in per cent."""
    applied = [found.applied(t) for t in range(len(found.model.tests))]
    error = float(np.sqrt(found.fit.chi2 / found.fit.count))
    names = tuple(m.name for m in found.mechanisms)
    return _step(
        found.model, measured, name, names, found.values(), found.nuisance, applied, found, error, held_out, found.evidence.ln, above
    )  # fmt: skip


def _step(
    model: CampaignModel, measured: MeasuredModes, name: str, effects: tuple[str, ...], values: Mapping, nuisance: Array,
    applied: Sequence[Applied], best: Settled | None, error: float, held_out: tuple[float, float], evidence: float, above: str,
) -> Step:  # fmt: skip
    frequency, damping = _computed(model, measured, nuisance, applied)
    off = frequency - measured.frequency
    build = [i for i, p in enumerate(model.parameters) if p.kind == kinds_of.BUILD]
    states = [(d.test.id, model.operating(t, nuisance, applied[t]).state) for t, d in enumerate(model.tests)]
    lost = tuple(f"{test}: {state.status}" for test, state in states if not all(b.in_contact for b in state.bearings))
    shifts = shift_errors(measured, off)
    return Step(
        name, effects, values, model, nuisance, tuple(applied), best, frequency, damping, error, *held_out,
        _rms(off), 100 * _rms(off / measured.frequency), _rms(shifts) if len(shifts) else None, _rms(nuisance[build]), evidence, lost, above,
    )  # fmt: skip


def _predicted(model: CampaignModel, t: int, nuisance: Array, applied: Applied) -> Predicted:
    return predicted(model.linear(t, nuisance, applied), BEYOND * model.spindle.hammer.band[1])


def _computed(model: CampaignModel, measured: MeasuredModes, nuisance: Array, applied: Sequence[Applied]) -> tuple[Array, Array]:
    """Computed frequency and damping ratio (n,) of every measured mode."""
    frequency, damping = [], []
    for t, o in enumerate(measured.observations):
        p = _predicted(model, t, nuisance, applied[t])
        partner = paired(o, p)
        frequency.append(of_partners(p.frequency, partner))
        damping.append(of_partners(p.damping, partner))
    return np.concatenate(frequency), np.concatenate(damping)


def shift_errors(measured: MeasuredModes, off: Array) -> Array:
    """Errors (Hz) of the shifts of numbered modes from the coldest test of each speed; `off` (n,) is computed - measured."""
    of = {(int(t), int(n)): e for t, n, e in zip(measured.test, measured.number, off, strict=True) if n and np.isfinite(e)}
    conditions = [o.condition for o in measured.observations]
    found = []
    for speed in sorted({c.speed for c in conditions}):
        tests = [t for t, c in enumerate(conditions) if c.speed == speed]
        cold = min(tests, key=lambda t: conditions[t].temperature)
        warm = [t for t in tests if conditions[t].temperature - conditions[cold].temperature > TEMPERATURE_APART]
        found += [of[t, n] - of[cold, n] for t in warm for n in measured.kinds if (t, n) in of and (cold, n) in of]
    return np.array(found)


def _rms(values: Array) -> float:
    """Root mean square of the values that there are."""
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(np.square(known)))) if len(known) else float("nan")


def measured_modes(model: CampaignModel, observations: Sequence[Observation]) -> MeasuredModes:
    """The modes of all tests, numbered by the computed modes of the spindle as drawn that they are."""
    nothing = np.zeros(len(model.parameters))
    expected = [_predicted(model, t, nothing, []) for t in range(len(observations))]
    numbers = numbered(observations, expected)
    test, number, columns = [], [], []
    for t, (o, p) in enumerate(zip(observations, expected, strict=True)):
        m = len(o.frequency)
        test += [t] * m
        number += [numbers[t].get(int(j), 0) for j in paired(o, p)]
        data = model.tests[t]
        if isinstance(data, ModeData):  # in the same order, with errors as stated
            columns.append([o.frequency, o.frequency * data.frequency_sd, data.damping, data.damping * data.damping_sd])
        else:
            relative = np.sqrt(np.diag(o.covariance))
            columns.append([o.frequency, o.frequency * relative[:m], o.damping, o.damping * relative[m:]])
    kinds = {number: expected[t].kind[i] for t in reversed(range(len(numbers))) for i, number in numbers[t].items()}
    present = {n: kinds[n] for n in sorted(set(number) - {0})}
    frequency, sd, damping, damping_sd = np.concatenate(columns, axis=1)
    return MeasuredModes(tuple(observations), np.array(test), np.array(number), frequency, sd, damping, damping_sd, present)
