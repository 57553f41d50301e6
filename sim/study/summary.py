"""What a sweep or a Monte Carlo study says as a whole, from its rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import pyarrow as pa

from thermospindle.model.types import Array
from thermospindle.model.units import TO_UM, in_rpm
from thermospindle.sim.operating import OperatingPoint
from thermospindle.sim.running.steady import steady_runout
from thermospindle.sim.study.draws import FIRST_SET, SECOND_SET, imperfection_columns, inputs
from thermospindle.sim.study.indices import indices
from thermospindle.sim.study.rows import OF_RUNOUT, Cases, of_runout
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
        rpm = in_rpm(c.speed)
        use = (temperature == c.temperature) & (speed == rpm)
        found.append(({"temperature_C": c.temperature, "speed_rpm": rpm}, table.filter(pa.array(use))))
    return found


Tell = Callable[[str | int], Told]
"""What is to be told of a column of numbers, or of a mode by its number."""


def first_set(of: Cases, table: pa.Table) -> pa.Table:
    """The rows of the first set of draws, of which spreads are told; all rows where there is no second."""
    return table.filter(pa.array([t == FIRST_SET for t in table["taken"].to_pylist()])) if of.study.sobol else table


def summary(of: Cases, table: pa.Table) -> Told:
    """Counts, and by condition the modes and preloads: their nominal value, spread over all rows, and of drawn ones sensitivities."""
    bearings = [b.name for b in of.spindle.bearings]
    errors = [e for e in table["error"].to_pylist() if e]
    told: Told = {"rows": len(table), "errors": len(errors), "first_error": errors[0] if errors else None}
    told["conditions"] = []
    for condition, (here, rows) in zip(of.conditions, at_conditions(of, table), strict=True):
        point, own = of.own[condition]
        tell = _tell(of, rows)
        told["conditions"].append(
            here
            | {
                "modes": [{"mode": k, "kind": mode.kind, "nominal_Hz": mode.frequency, **tell(k)} for k, mode in enumerate(own, 1)],
                "preload_N": {b: {"nominal": point.state.bearing(b).preload, **tell(f"preload_N.{b}")} for b in bearings},
                **_runout(of, point, tell),
                "in_contact": {b: _share(first_set(of, rows)[f"in_contact.{b}"].to_pylist()) for b in bearings},
            }
        )
    if of.study.draws:
        drawn = first_set(of, table)
        once = drawn.filter(pa.array(np.diff(numbers(drawn, "case"), prepend=-1) != 0))
        told["unloads_C"] = {b: _spread(v := numbers(once, f"unloads_C.{b}")) | {"share": float(np.isfinite(v).mean())} for b in bearings}
    return told


def _tell(of: Cases, rows: pa.Table) -> Tell:
    """Of the rows of one condition: the range over a sweep; spread, regression and, where the study has a second set, indices over draws.

    Imperfections move the runout alone, and are inputs of its regressions alone.
    """
    missing = np.full(len(rows), np.nan)
    by_number = frequencies(rows)

    def values_of(column: str | int) -> Array:
        return by_number.get(column, missing) if isinstance(column, int) else numbers(rows, column)

    if not of.study.draws:
        return lambda column: _range(values_of(column))
    columns = {name: name.removeprefix("deviation.") for name in rows.column_names if name.startswith("deviation.")}
    built = imperfection_columns(of.spindle) if of.study.grade is not None else {}
    first = np.array([t == FIRST_SET for t in rows["taken"].to_pylist()]) if of.study.sobol else np.full(len(rows), True)

    def told_of(column: str | int) -> Told:
        values = values_of(column)
        own = columns | built if isinstance(column, str) and column.startswith(OF_RUNOUT) else columns
        drawn = np.stack([numbers(rows, name) for name in own], axis=1)[first] if own else np.zeros((int(first.sum()), 0))
        told = {**_spread(values[first]), **_sensitivity(list(own.values()), drawn, values[first])}
        return told | (_indices(of, rows, values) if of.study.sobol else {})

    return told_of


def _indices(of: Cases, rows: pa.Table, values: Array) -> Told:
    names = inputs(of.study, of.spindle)
    place = {taken: i for i, taken in enumerate((FIRST_SET, SECOND_SET, *names))}
    every = np.full((len(place), of.study.draws), np.nan)
    every[[place[t] for t in rows["taken"].to_pylist()], rows["draw"].to_pylist()] = values
    found = indices(names, every[0], every[1], every[2:])
    if found is None:
        return {"indices": None}
    order = sorted(names, key=lambda n: -found.of[n].total)
    return {"indices": {"draws": found.draws, "of": {n: asdict(found.of[n]) | {"clear": found.of[n].clear} for n in order}}}


def _runout(of: Cases, point: OperatingPoint, tell: Tell) -> Told:
    """By value and probe, where the study asks for it and the spindle turns; `nominal` is that of the scene's own imperfections."""
    if not of.study.runout or not point.condition.speed:
        return {}
    seen = steady_runout(point)
    nominal = {"rro_um": lambda r: r.repeatable, "nrro_six_sigma_um": lambda r: r.six_sigma}
    return {
        key: {
            (probe := name.removeprefix("hub ")): {"nominal": TO_UM * nominal[key](r), **tell(f"{key}.{probe}")}
            for name, r in seen.items()
            if key in of_runout(of.spindle)
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
    of = {n: {"value": found.coefficient[n], "sd": found.sd[n], "clear": n in found.clear} for n in order}
    return {"sensitivity": {"r2": found.r2, "cross_validated": {"r2": found.unseen, "sd": found.unseen_sd}, "coefficients": of}}


def _share(values: Sequence[bool | None]) -> float | None:
    known = [v for v in values if v is not None]
    return sum(known) / len(known) if known else None
