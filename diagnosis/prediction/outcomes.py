"""What was predicted before a test was read, beside what it then showed: confirmed or refuted."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import chdtrc

from thermospindle.diagnosis.data.observe import Observation
from thermospindle.model.errors import BadInput
from thermospindle.model.files.formats import DIAGNOSIS, migrated
from thermospindle.model.units import RPM
from thermospindle.sim.identification.pairing import NEAREST, ModeSet, pairs

SAME = {"temperature": 1.0, "speed": 10 * RPM}  # K, rad/s within which a test is the one that was planned
REFUTED, DOUBTFUL = 1e-6, 1e-2  # probabilities of a misfit as large by chance


@dataclass(frozen=True)
class Outcome:
    """One prediction of one explanation for one test: rms of (measured - predicted) / sd over frequencies and damping
    of its modes, and in a word what that says."""

    test: str
    explanation: str
    rms: float
    modes: int
    verdict: str  # confirmed, doubtful or refuted


def outcomes(file: Path, observations: Sequence[Observation]) -> list[Outcome]:
    """Every prediction of an earlier diagnosis (its JSON `file`) for which a test has been made since; BadInput for another file.

    Tests with an added mass or a harder hit must say so themselves: they are matched by temperature and speed, and by level and soak
    time where planned.
    """
    if not file.is_file():
        raise BadInput(f"--predictions {file}: cannot be read: no such file")
    try:
        planned = migrated(DIAGNOSIS, json.loads(file.read_text(encoding="utf-8")), f"--predictions {file}")["next_test"]
        rows = [(dict(p["condition"]), dict(p["predicted"])) for p in planned]
        return [
            _outcome(o, name, _table(modes))
            for condition, predicted in rows
            for o in observations
            if _is(o, condition)
            for name, modes in predicted.items()
        ]
    except OSError as error:
        raise BadInput(f"--predictions {file}: cannot be read: {error.strerror}") from None
    except BadInput:
        raise
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError):
        raise BadInput(f"--predictions {file}: is not an answer of spindle diagnose --json with predictions in next_test") from None


def _table(modes: Sequence[dict[str, Any]]) -> np.ndarray:
    """Predicted modes (k, 4): frequency and its error in Hz, damping ratio and its error; ValueError for none, and for what is no number."""
    columns = {"frequency_Hz": None, "sd_Hz": None, "damping": 1.0, "damping_sd": np.inf}
    rows = [[row[key] if default is None else row.get(key, default) for key, default in columns.items()] for row in modes]
    table = np.array(rows, float)
    if not rows or not np.all(table > 0) or not np.all(np.isfinite(table[:, :3])):
        raise ValueError("modes need positive numbers")
    return table


def _is(o: Observation, condition: dict[str, Any]) -> bool:
    there = o.condition
    return bool(
        abs(there.temperature - condition["temperature_C"]) < SAME["temperature"]
        and abs(there.speed - condition["speed_rpm"] * RPM) < SAME["speed"]
        and ("level_N" not in condition or there.level == condition["level_N"])
        and ("soak_time_min" not in condition or there.soak_time == 60 * condition["soak_time_min"])
        and "added_mass_g" not in condition
    )


def _outcome(o: Observation, name: str, predicted: np.ndarray) -> Outcome:
    """Modes paired in the way that costs least in ln frequency; frequencies and, where known and predicted, ln damping ratios."""
    m, error = len(o.frequency), np.sqrt(np.diag(o.covariance))
    seen, expected = pairs(ModeSet(o.frequency), ModeSet(predicted[:, 0]), NEAREST).T
    frequency, sd, damping, damping_sd = predicted[expected].T
    off = np.log(np.concatenate([o.frequency[seen] / frequency, o.damping[seen] / damping]))
    known = np.hypot(np.concatenate([error[:m][seen], error[m:][seen]]), np.concatenate([sd / frequency, damping_sd / damping]))
    residual = (off / known)[np.isfinite(known)]
    chance = float(chdtrc(len(residual), float(residual @ residual)))
    verdict = "refuted" if chance < REFUTED else "doubtful" if chance < DOUBTFUL else "confirmed"
    return Outcome(o.test.id, name, float(np.sqrt(np.mean(residual**2))), len(seen), verdict)
