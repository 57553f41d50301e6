"""A fleet: many campaigns of spindles of one drawing, each compared with it or diagnosed by it, a row each."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from thermospindle.diagnosis.compare.compare import Comparison, compare
from thermospindle.diagnosis.runout.lines import modal_tests
from thermospindle.diagnosis.verdict import Diagnosis, diagnose
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Spindle
from thermospindle.model.types import Array
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.effects.effect import Effect
from thermospindle.sim.study.rows import NAMED, Row
from thermospindle.sim.study.sensitivity import robust_z

COMPARED = {
    "rms_residual": pa.float64(),  # in standard errors
    "worst_residual": pa.float64(),
    "tests": pa.int64(),
    "modes": pa.int64(),
    "missing": pa.int64(),
    "extra": pa.int64(),
    "mode": pa.list_(pa.int64()),
    "frequency_error_percent": pa.list_(pa.float64()),  # mean of the mode's tests, computed less measured
    "damping_error_percent": pa.list_(pa.float64()),
}
DIAGNOSED = {
    "verdict": pa.string(),
    "effects": pa.list_(pa.string()),
    "probability_none": pa.float64(),
    "error_before": pa.float64(),
    "error_after": pa.float64(),
    "tolerance": pa.list_(pa.string()),
    "tolerance_value": pa.list_(pa.float64()),  # in the tolerance's own standard deviations
}


@dataclass(frozen=True, eq=False)
class Fleet:
    """One row a campaign: `rows(k)` of campaign k beside the scene; what cannot be read or compared says why in `error`."""

    spindle: Spindle
    campaigns: tuple[Path, ...]
    catalogue: tuple[Effect, ...]
    diagnosed: bool

    @property
    def count(self) -> int:
        return len(self.campaigns)

    def rows(self, k: int) -> list[Row]:
        folder = self.campaigns[k]
        known: Row = {"case": k, "campaign": folder.name, "error": None}
        try:
            campaign = modal_tests(read_campaign(folder))
            if not campaign.tests:
                raise BadInput(f"{folder}: has no hammer tests and no tables of modes to compare")
            row = known | _compared(compare(self.spindle, campaign, frfs=False))
            return [row | (_diagnosed(diagnose(self.spindle, campaign, self.catalogue)) if self.diagnosed else {})]
        except (*NAMED, OSError) as error:
            return [known | {"error": " ".join(str(error).split())}]

    def schema(self) -> pa.Schema:
        """Columns of the rows, in order."""
        fields = {"case": pa.int64(), "campaign": pa.string(), "error": pa.string(), **COMPARED}
        return pa.schema(fields | (DIAGNOSED if self.diagnosed else {}))


def _compared(c: Comparison) -> Row:
    paired = [m for t in c.tests for m in t.modes]
    numbers = sorted({m.number for m in paired})

    def mean_error(number: int, damping: bool) -> float | None:
        if damping:
            values = [e for m in paired if m.number == number and (e := m.damping_error) is not None]
        else:
            values = [m.error / m.measured for m in paired if m.number == number]
        return 100 * float(np.mean(values)) if values else None

    return {
        "rms_residual": c.rms_residual if np.isfinite(c.rms_residual) else None,
        "worst_residual": max((abs(m.residual) for m in paired), default=None),
        "tests": len(c.tests),
        "modes": len(paired),
        "missing": sum(len(t.missing) for t in c.tests),
        "extra": sum(len(t.extra) for t in c.tests),
        "mode": numbers,
        "frequency_error_percent": [mean_error(n, damping=False) for n in numbers],
        "damping_error_percent": [mean_error(n, damping=True) for n in numbers],
    }


def _diagnosed(d: Diagnosis) -> Row:
    v = d.verdict
    own = v.told.evidence
    n = d.search.base.fit.count
    before, after = (float(np.sqrt(max(h.evidence.chi2, 0.0) / n)) for h in (d.search.base, v.accepted))
    parameters = d.search.model.parameters
    return {
        "verdict": v.word,
        "effects": list(v.effects),
        "probability_none": float(v.probability_none),
        "error_before": before,
        "error_after": after,
        "tolerance": [p.name for p, _ in zip(parameters, own.mean, strict=False)],
        "tolerance_value": [float(m) for _, m in zip(parameters, own.mean, strict=False)],
    }


def apart(rows: list[dict[str, Any]]) -> dict[str, Array]:
    """Robust z (n,) of every number that the rows of a fleet share: residual, error of each mode, fitted tolerances."""
    columns: dict[str, list[float]] = {"ln rms_residual": [_log(r.get("rms_residual")) for r in rows]}
    for name, key, values in (
        ("frequency error of mode {}", "mode", "frequency_error_percent"),
        ("damping error of mode {}", "mode", "damping_error_percent"),
        ("{}", "tolerance", "tolerance_value"),
    ):
        every = [dict(zip(r.get(key) or (), r.get(values) or (), strict=False)) for r in rows]
        for k in dict.fromkeys(k for own in every for k in own):
            columns[name.format(k)] = [float(v) if (v := own.get(k)) is not None else np.nan for own in every]
    return {name: robust_z(np.array(values)) for name, values in columns.items()}


def _log(value: float | None) -> float:
    return float(np.log(value)) if value else float("nan")
