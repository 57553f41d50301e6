"""What was predicted before a test was read, beside what it then showed: confirmed or refuted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isclose
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import chdtrc

from thermospindle.diagnosis.answer import read_raw, told_by
from thermospindle.diagnosis.data.observe import Observation
from thermospindle.diagnosis.prediction.temperature import whitened
from thermospindle.model.machine import Condition
from thermospindle.model.types import Array
from thermospindle.model.units import RPM
from thermospindle.sim.identification.pairing import NEAREST, ModeSet, pairs

SAME = {"temperature": 1.0, "speed": 10 * RPM}  # K, rad/s within which a test is the one that was planned
ROUNDING = 1e-6  # relative
REFUTED, DOUBTFUL = 1e-6, 1e-2  # probabilities of a misfit as large by chance


@dataclass(frozen=True)
class Outcome:
    """One prediction of one explanation for one test: rms of (measured - predicted) / sd over frequencies and damping
    of its modes, with errors that are common to them taken together, and in a word what that says."""

    test: str
    explanation: str
    rms: float
    modes: int
    verdict: str  # confirmed, doubtful or refuted


def outcomes(file: Path, observations: Sequence[Observation]) -> list[Outcome]:
    """Every prediction of an earlier diagnosis (its JSON `file`) for which a test has been made since; BadInput for another file.

    A test is the one that was planned where temperature, speed, level and soak time are: what is
    not told of the latter is a light tap, after all the time that it takes.
    """
    where, what = f"--predictions {file}", "predictions in next_test"
    told = read_raw(file, where, what)
    with told_by(where, what):
        rows = [(dict(p["condition"]), dict(p["predicted"])) for p in told["next_test"]]
        return [
            outcome
            for condition, predicted in rows
            for o in observations
            if _is(o, condition)
            for name, modes in predicted.items()
            if (outcome := _outcome(o, name, *_table(modes))) is not None
        ]


def _table(modes: Sequence[dict[str, Any]]) -> tuple[Array, Array]:
    """Predicted modes (k, 4): frequency and its error in Hz, damping ratio and its error; and what errors common to all
    modes move each by (k, c), Hz, none where the answer has none. ValueError for no modes, and for what is no number."""
    columns = {"frequency_Hz": None, "sd_Hz": None, "damping": 1.0, "damping_sd": np.inf}
    rows = [[row[key] if default is None else row.get(key, default) for key, default in columns.items()] for row in modes]
    table = np.array(rows, float)
    if not rows or not np.all(table > 0) or not np.all(np.isfinite(table[:, :3])):
        raise ValueError("modes need positive numbers")
    common = np.array([row.get("common_Hz", []) for row in modes], float)
    if common.ndim != 2 or not np.all(np.sum(common**2, axis=1) <= (1 + ROUNDING) * table[:, 1] ** 2):
        raise ValueError("errors common to all modes are part of each mode's error")
    return table, common


def same(one: Condition, other: Condition) -> bool:
    """Whether tests at two conditions are the same test."""
    return bool(
        abs(one.temperature - other.temperature) < SAME["temperature"]
        and abs(one.speed - other.speed) < SAME["speed"]
        and isclose(one.level, other.level, rel_tol=ROUNDING)
        and isclose(one.soak_time, other.soak_time, rel_tol=ROUNDING)
    )


def _is(o: Observation, planned: dict[str, Any]) -> bool:
    level, soak = planned.get("level_N", 0.0), 60 * planned.get("soak_time_min", np.inf)
    return "added_mass_g" not in planned and same(o.condition, Condition(planned["temperature_C"], planned["speed_rpm"] * RPM, level, soak))


def _outcome(o: Observation, name: str, predicted: Array, common: Array) -> Outcome | None:
    """Modes paired in the way that costs least in ln frequency; frequencies and, where known and
    predicted, ln damping ratios. None of a test in which no mode was found: it says nothing."""
    seen, expected = pairs(ModeSet(o.frequency), ModeSet(predicted[:, 0]), NEAREST).T
    frequency, sd, damping, damping_sd = predicted[expected].T
    off = np.log(np.concatenate([o.frequency[seen] / frequency, o.damping[seen] / damping]))
    shared = common[expected] / frequency[:, None]
    own = np.maximum((sd / frequency) ** 2 - np.sum(shared**2, axis=1), 0.0)
    measured = np.concatenate([seen, len(o.frequency) + seen])
    variance = np.diag(o.covariance)[measured] + np.concatenate([own, (damping_sd / damping) ** 2])
    known = np.isfinite(variance)
    if not known.any():
        return None
    both = np.concatenate([shared, np.zeros_like(shared)])[known]
    covariance = o.covariance[np.ix_(measured[known], measured[known])] + both @ both.T
    np.fill_diagonal(covariance, variance[known] + np.sum(both**2, axis=1))
    residual = whitened(off[known], covariance)
    chance = float(chdtrc(len(residual), float(residual @ residual)))
    verdict = "refuted" if chance < REFUTED else "doubtful" if chance < DOUBTFUL else "confirmed"
    return Outcome(o.test.id, name, float(np.sqrt(np.mean(residual**2))), len(seen), verdict)
