"""What is shown of a study over its cases, as plain numbers."""

from __future__ import annotations

import numpy as np
import pyarrow as pa

from thermospindle.model.types import Array
from thermospindle.sim.study.summary import frequencies

SHOWN = 12  # kinds of series
OTHERS = ("preload_N", "rro_um", "nrro_six_sigma_um", "rms_residual", "worst_residual", "lowest_", "stiffness_")
"""Columns, by the beginning of their names, that are shown beside frequencies."""


def series_of(table: pa.Table) -> dict[str, dict[str, tuple[Array, Array]]]:
    """Case numbers (n,) and values (n,) by what they are and at what condition; rows without a value are left out."""
    columns = {f"mode {n}, Hz": y for n, y in frequencies(table).items()} if "frequency_Hz" in table.column_names else {}
    columns |= {name: np.array(table[name].to_pylist(), float) for name in table.column_names if name.startswith(OTHERS)}
    case = np.array(table["case"].to_pylist())
    at_ = _conditions(table)
    found: dict[str, dict[str, tuple[Array, Array]]] = {}
    for name, values in list(columns.items())[:SHOWN]:
        for condition in dict.fromkeys(at_):
            use = np.array([c == condition for c in at_]) & np.isfinite(values)
            if use.any():
                found.setdefault(name, {})[condition] = case[use], values[use]
    return found


def _conditions(table: pa.Table) -> list[str]:
    """What a row is at, in words; all the same in a fleet."""
    if "temperature_C" not in table.column_names:
        return ["campaigns"] * len(table)
    rows = zip(table["temperature_C"].to_pylist(), table["speed_rpm"].to_pylist(), strict=True)
    found = [f"{t:g} C" + (f", {rpm:g} rpm" if rpm else "") for t, rpm in rows]
    return [f"{design}, {c}" for design, c in zip(table["design"].to_pylist(), found, strict=True)] if "design" in table.column_names else found
