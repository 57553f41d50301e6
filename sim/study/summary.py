"""What a sweep or a Monte Carlo study says as a whole, from its rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import pyarrow as pa

from thermospindle.model.types import Array
from thermospindle.model.units import RPM, TO_UM
from thermospindle.sim.operating import OperatingPoint
from thermospindle.sim.running.steady import steady_runout
from thermospindle.sim.study.rows import OF_RUNOUT, Cases
from thermospindle.sim.study.sensitivity import sensitivity, spread

Told = dict[str, Any]


def frequencies(table: pa.Table) -> dict[int, Array]:
    """Frequency (rows,) Hz of every numbered mode of the scene as it stands, NaN where a row has none."""
    found: dict[int, Array] = {}
    for i, (numbers, values) in enumerate(zip(table["mode"].to_pylist(), table["frequency_Hz"].to_pylist(), strict=True)):
        for number, value in zip(numbers or (), values or (), strict=True):
            if number:
                found.setdefault(number, np.full(len(table), np.nan))[i] = value
    return dict(sorted(found.items()))


def numbers(table: pa.Table, column: str) -> Array:
    """A column of numbers (rows,), NaN where a row has none."""
    return np.array(table[column].to_pylist(), float)


def at_conditions(of: Cases, table: pa.Table) -> list[tuple[Told, pa.Table]]:
    """The rows of each condition, and what they are at."""
    found = []
    temperature, speed = numbers(table, "temperature_C"), numbers(table, "speed_rpm")
    for c in of.conditions:
        rpm = float(f"{c.speed / RPM:.12g}")
        use = (temperature == c.temperature) & (speed == rpm)
        found.append(({"temperature_C": c.temperature, "speed_rpm": rpm}, table.filter(pa.array(use))))
    return found


def summary(of: Cases, table: pa.Table) -> Told:
    """Counts, and by condition the modes and preloads: their nominal value, spread over all rows, and of drawn ones sensitivities."""
    bearings = [b.name for b in of.spindle.bearings]
    errors = [e for e in table["error"].to_pylist() if e]
    told: Told = {"rows": len(table), "errors": len(errors), "first_error": errors[0] if errors else None}
    told["conditions"] = []
    drawn = [name for name in table.column_names if name.startswith("deviation.")]
    for condition, (here, rows) in zip(of.conditions, at_conditions(of, table), strict=True):
        deviations = np.stack([numbers(rows, name) for name in drawn], axis=1) if drawn else np.zeros((len(rows), 0))
        names = [name.removeprefix("deviation.") for name in drawn]
        point, own = of.own[condition]
        by_number = frequencies(rows)


        def told_of(values: Array, names: list[str] = names, deviations: Array = deviations) -> Told:
            return {**_spread(values), **_sensitivity(names, deviations, values)} if names else _range(values)

        modes = []
        for k, mode in enumerate(own, 1):
            values = by_number.get(k, np.full(len(rows), np.nan))
            modes.append({"mode": k, "kind": mode.kind, "nominal_Hz": mode.frequency, **told_of(values)})
        told["conditions"].append(
            here
            | {
                "modes": modes,
                "preload_N": {
                    b: {"nominal": point.state.bearing(b).preload, **told_of(numbers(rows, f"preload_N.{b}"))}
                    for b in bearings
                },
                **_runout(of, rows, point, told_of),
                "in_contact": {b: _share(rows[f"in_contact.{b}"].to_pylist()) for b in bearings},
            }
        )
    if drawn:
        once = table.filter(pa.array(np.diff(numbers(table, "case"), prepend=-1) != 0))
        told["unloads_C"] = {b: _spread(v := numbers(once, f"unloads_C.{b}")) | {"share": float(np.isfinite(v).mean())} for b in bearings}
    return told


def _runout(of: Cases, rows: pa.Table, point: OperatingPoint, told_of: Callable[[Array], Told]) -> Told:
    """By value and probe, where the study asks for it and the spindle turns; `nominal` is that of the scene's own imperfections."""
    if not of.study.runout or not point.condition.speed:
        return {}
    seen = steady_runout(point)
    nominal = {"rro_um": lambda r: r.repeatable, "nrro_six_sigma_um": lambda r: r.six_sigma}
    return {
        key: {
            (probe := name.removeprefix("hub ")): {"nominal": TO_UM * nominal[key](r), **told_of(numbers(rows, f"{key}.{probe}"))}
            for name, r in seen.items()
        }
        for key in OF_RUNOUT
    }


def _spread(values: Array) -> Told:
    found = spread(values)
    return {"spread": asdict(found) if found else None}


def _range(values: Array) -> Told:
    known = values[np.isfinite(values)]
    return {"least": float(known.min()), "most": float(known.max())} if len(known) else {"least": None, "most": None}


def _sensitivity(names: Sequence[str], deviations: Array, values: Array) -> Told:
    found = sensitivity(names, deviations, values)
    if found is None:
        return {"sensitivity": None}
    order = sorted(names, key=lambda n: -abs(found.coefficient[n]))
    return {"sensitivity": {"r2": found.r2, "coefficients": {n: {"value": found.coefficient[n], "sd": found.sd[n]} for n in order}}}


def _share(values: Sequence[bool | None]) -> float | None:
    known = [v for v in values if v is not None]
    return sum(known) / len(known) if known else None
