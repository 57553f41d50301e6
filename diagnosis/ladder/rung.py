"""One rung of the ladder: a model beside all data of a campaign, and the errors it leaves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from thermospindle.diagnosis.data.observe import condition_of
from thermospindle.diagnosis.fit.fit import Fit, prior_widths
from thermospindle.diagnosis.fit.held_out import held_out
from thermospindle.diagnosis.prediction.partners import numbered
from thermospindle.diagnosis.prediction.theory import Applied, Theory, pair, predict
from thermospindle.model.types import Array
from thermospindle.sim.operating import operating_point

TEMPERATURE_APART = 0.5  # K, from which two tests show a shift

Both = tuple[Fit, Fit]
"""A fit that grants every effect its error of form, and one that takes them at their word."""


@dataclass(frozen=True, eq=False)
class Rung:
    """One model beside all data; n features, residual = measured - computed (logarithms).

    `error` and `held_out` are rms pulls: of all data, and of each temperature predicted from the others (in standard errors of that
    prediction; with nothing fitted there is nothing to leave out, and the two are the same). `rms_shift_Hz` is the error of the
    shifts from the coldest test of each speed, None without a second temperature. `stretch` is the rms of the fitted tolerances in their
    own standard deviations: about one or less is believable, and a small error with a large stretch is bought, not explained.
    `evidence` is ln, on one scale for all rungs. `lost_contact` says of which tests.
    """

    name: str
    effects: tuple[str, ...]  # beside the scene's own
    values: Mapping[str, Mapping[str, tuple[float, float]]]  # effect -> parameter -> (value, sd)
    residual: Array  # (n,)
    nuisance: Array  # (p,)
    applied: Applied
    fitted: Fit | None
    error: float
    held_out: float
    rms_Hz: float
    rms_percent: float
    rms_shift_Hz: float | None
    stretch: float
    evidence: float
    lost_contact: tuple[str, ...]
    above: str  # the rung it stands on, empty for the first


def as_drawn(about: Theory, name: str, applied: Applied, above: str = "") -> Rung:
    """The spindle as drawn with effects at given values; nothing is fitted, so there is no parameter to pay for."""
    nothing = np.zeros(len(about.sd))
    residual = about.data.value - about.features(nothing, applied)
    misfit = float(np.sum((about.data.whiten @ residual) ** 2))
    return _rung(about, name, (), {}, residual, nothing, applied, None, misfit, -0.5 * misfit, above)


def fitted(about: Theory, name: str, best: Both, above: str) -> Rung:
    """A fit of tolerances and effects, beside the scene's own effects."""
    granted, exact = best
    values = {e.name: {p.name: (exact.values[e.name][p.name], exact.sd[e.name][p.name]) for p in e.parameters} for e in exact.effects}
    applied = [(e, exact.values[e.name]) for e in exact.effects]
    names = tuple(e.name for e in exact.effects)
    return _rung(about, name, names, values, exact.residual, exact.nuisance, applied, exact, exact.misfit, granted.evidence, above)


def _rung(
    about: Theory, name: str, effects: tuple[str, ...], values: dict[str, dict[str, tuple[float, float]]], residual: Array, nuisance: Array,
    applied: Applied, best: Fit | None, misfit: float, evidence: float, above: str,
) -> Rung:  # fmt: skip
    n = len(residual)
    error = float(np.sqrt(misfit / n))
    total, count = held_out(about, best) if best else (misfit, n)
    measured, computed = frequencies(about, residual)
    off = computed - measured
    shifts = shift_errors(about, off)
    return Rung(
        name, effects, values, residual, nuisance, tuple(applied), best,
        error, float(np.sqrt(total / count)),
        _rms(off), 100 * _rms(off / measured), _rms(shifts) if len(shifts) else None,
        _rms(nuisance / about.sd), evidence, tuple(_lost_contact(about, nuisance, applied)), above,
    )  # fmt: skip


def determined(about: Theory, best: Fit) -> float:
    """How many combinations of parameters the data, not the priors, decide: trace of the resolution matrix, at most the data's number."""
    widths = prior_widths(about, best)
    eigenvalues = np.linalg.svd(about.data.whiten @ (best.jacobian * widths), compute_uv=False) ** 2
    return float(np.sum(eigenvalues / (1 + eigenvalues)))


def frequencies(about: Theory, residual: Array) -> tuple[Array, Array]:
    """Measured and computed natural frequencies (Hz) of all features that are one."""
    own = [k for k, f in enumerate(about.data.features) if f.what == "frequency"]
    measured = np.exp(about.data.value[own])
    return measured, measured * np.exp(-residual[own])


def shift_errors(about: Theory, off: Array) -> Array:
    """Errors (Hz) of frequency shifts from the coldest test of each speed, of modes in order of frequency; `off` is computed - measured."""
    observations = about.data.observations
    rows = [(f.test, f.mode) for f in about.data.features if f.what == "frequency"]
    of = dict(zip(rows, off.tolist(), strict=True))
    found = []
    for speed in sorted({o.condition.speed for o in observations}):
        tests = [t for t, o in enumerate(observations) if o.condition.speed == speed]
        cold = min(tests, key=lambda t: observations[t].condition.temperature)
        for t in tests:
            warmer = observations[t].condition.temperature - observations[cold].condition.temperature
            if warmer > TEMPERATURE_APART and len(observations[t].frequency) == len(observations[cold].frequency):
                found += [of[t, m] - of[cold, m] for m in range(len(observations[t].frequency))]
    return np.array(found)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _lost_contact(about: Theory, nuisance: Array, applied: Applied) -> list[str]:
    spindle = about.built(nuisance)
    states = [(o.test, operating_point(spindle, condition_of(o.test), (*about.present, *applied)).state) for o in about.data.observations]
    return [f"{test.id}: {state.status}" for test, state in states if not all(b.in_contact for b in state.bearings)]


def mode_numbers(about: Theory) -> tuple[np.ndarray, dict[int, str]]:
    """Number (n,) of the mode of every feature, followed through all tests of the spindle as drawn, and kind by number."""
    observations = about.data.observations
    predicted = [predict(about.spindle, o, about.present) for o in observations]
    numbers = numbered(observations, predicted)
    partners = [pair(o, p) for o, p in zip(observations, predicted, strict=True)]
    of = np.array([numbers[f.test].get(int(partners[f.test][f.mode]), 0) for f in about.data.features])
    kinds = {number: predicted[t].kind[i] for t in reversed(range(len(numbers))) for i, number in numbers[t].items()}
    return of, {n: kinds[n] for n in sorted(set(of.tolist()) - {0})}
