"""The stiffness table: bearing properties over temperature and speed, as a CSV with units in its header and its provenance above."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import or_
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from thermospindle.model.bearing.pair import BearingState, LinearState, PairState
from thermospindle.model.bearing.roller import RollerState
from thermospindle.model.errors import BadInput, OutsideRange
from thermospindle.model.files.cells import cell, name_of
from thermospindle.model.types import Array
from thermospindle.model.units import RPM, in_rpm

COLUMNS = {
    "contact_angle_deg": lambda b: np.degrees(b.contact_angle),
    "outer_contact_angle_deg": lambda b: np.degrees(b.outer_contact_angle),
    "deformation_um": lambda b: b.deformation * 1e6,
    "contact_force_N": lambda b: b.contact_force,
    "ball_stiffness_N_per_m": lambda b: b.ball_stiffness,
    "preload_N": lambda b: b.preload,
    "radial_stiffness_N_per_m": lambda b: b.radial_stiffness,
    "axial_stiffness_N_per_m": lambda b: b.axial_stiffness,
    "tilt_stiffness_N_m_per_rad": lambda b: b.tilt_stiffness,
    "coupling_stiffness_N_per_rad": lambda b: b.coupling_stiffness,
}
"""Property of a bearing state behind every column."""
OF_BALLS = {"outer_contact_force_N": lambda b: b.outer_contact_force}
"""Columns of a table that has ball bearings; those that were written earlier have none."""
OF_ROLLERS = {"clearance_um": lambda b: b.clearance * 1e6}
"""Columns of a table that has roller bearings."""
BY_DIRECTION = {
    "radial_stiffness_y_N_per_m": lambda b: b.radial_stiffness_y,
    "radial_stiffness_xy_N_per_m": lambda b: b.radial_stiffness_xy,
    "tilt_stiffness_y_N_m_per_rad": lambda b: b.tilt_stiffness_y,
    "coupling_stiffness_y_N_per_rad": lambda b: b.coupling_stiffness_y,
}
"""Columns of a table with a bearing that is not as stiff in every direction across the axis; those above are along x and about x then."""
BETWEEN = {
    "axial_stiffness_xz_N_per_m": (0, 2),
    "axial_stiffness_yz_N_per_m": (1, 2),
    "coupling_stiffness_x_tilt_x_N_per_rad": (0, 3),
    "coupling_stiffness_y_tilt_y_N_per_rad": (1, 4),
    "coupling_stiffness_z_tilt_x_N_per_rad": (2, 3),
    "coupling_stiffness_z_tilt_y_N_per_rad": (2, 4),
    "tilt_stiffness_xy_N_m_per_rad": (3, 4),
}
"""Entries of the stiffness (5, 5) that centred rings do not have, each a column of a table with a bearing that has it: force
or moment along the first direction of its name for a motion along the second. With those above the whole matrix is told."""
NOTHING = 1e-12
"""Of sqrt(k_ii k_jj), where an entry k_ij is what rounding leaves of nothing."""
PRESSURE = "contact_pressure_MPa"
"""Column of a table that has ball or roller bearings."""
FURTHER = (*OF_BALLS, *OF_ROLLERS, *BY_DIRECTION, PRESSURE, *BETWEEN)
GAPS = "{}: the table has gaps; every bearing needs a row for each temperature and speed, and one only"
MISSING = -1e308  # in a grid that is being read; NaN is what a bearing given by numbers does not have
STEPS = 5  # of temperature over a scene's range, where none are told


@dataclass(frozen=True, eq=False)
class StiffnessTable:
    """Bearing properties on a grid: `values[bearing][column]` has shape (temperatures, speeds), in the column's unit.

    `unloads` says at which temperature (C) a bearing loses contact on the grid at its lowest speed, None where it never
    does; `loose` on which side of that it has none.
    `provenance` is what the table was made from: scene, its hash, program versions.
    """

    temperature: Array  # (n,) C, rising
    speed: Array  # (m,) rad/s, rising
    values: Mapping[str, Mapping[str, Array]]
    unloads: Mapping[str, float | None]
    provenance: Mapping[str, str]

    def loose(self, bearing: str) -> str:
        """Where a bearing has no contact at the lowest speed: `above` the temperature at which it `unloads`, `below`
        it, or `throughout` the grid, whose lowest temperature that is then; empty where it has contact everywhere."""
        if self.unloads.get(bearing) is None:
            return ""
        contact = self.contact(bearing)
        return "above" if contact[0] else "below" if contact.any() else "throughout"

    def contact(self, bearing: str) -> NDArray[np.bool_]:
        """Whether a bearing has contact at every temperature (n,), at the lowest speed."""
        return np.asarray(self.values[bearing]["contact_force_N"][:, 0] > 0)

    def at(self, bearing: str, column: str, temperature: float, speed: float = 0.0) -> float:
        """Property at a condition, shape-preserving cubic (PCHIP) between the grid's conditions.

        Raises `OutsideRange` outside the grid: nothing is extrapolated.
        """
        over_speed = [_between(self.temperature, v, temperature, "temperature", "C") for v in self.values[bearing][column].T]
        return _between(self.speed / RPM, np.array(over_speed), speed / RPM, "speed", "rpm")


def _between(grid: Array, values: Array, where: float, name: str, unit: str) -> float:
    if not grid[0] - 1e-9 <= where <= grid[-1] + 1e-9:
        raise OutsideRange(f"the table spans {name} {grid[0]:g} to {grid[-1]:g} {unit} and was asked at {where:g} {unit}")
    if len(grid) == 1:
        return float(values[0])
    return float(scipy.interpolate.PchipInterpolator(grid, values)(np.clip(where, grid[0], grid[-1])))


def tabulate(
    temperatures: Sequence[float], speeds: Sequence[float], states: Sequence[Sequence[PairState]], unloads: Mapping[str, float | None], provenance: Mapping[str, str],
    pressures: Sequence[Sequence[Mapping[str, float]]] = (),
) -> StiffnessTable:
    """Table of pair states on a grid: `states[i][j]` at temperature i (C) and speed j (rad/s), and
    as many `pressures` (Pa, by bearing), or none."""
    bearings = states[0][0].all_bearings
    further = [of for kind, of in ((BearingState, OF_BALLS), (RollerState, OF_ROLLERS)) if any(isinstance(b, kind) for b in bearings)]
    every = [b for row in states for state in row for b in state.all_bearings]
    if not all(_alike(b.stiffness) for b in every):
        further.append(BY_DIRECTION)
    columns = reduce(or_, further, COLUMNS)

    def column(name: str, read) -> Array:
        return np.array([[_property(state.any_bearing(name), read) for state in row] for row in states])

    values = {b.name: {key: column(b.name, read) for key, read in columns.items()} for b in bearings}
    if any(own for row in pressures for own in row):
        for b in bearings:
            values[b.name][PRESSURE] = np.array([[1e-6 * own.get(b.name, np.nan) for own in row] for row in pressures])
    for key, at in BETWEEN.items():
        if any(_size(b.stiffness, at) > NOTHING for b in every):
            for b in bearings:
                values[b.name][key] = column(b.name, lambda own, at=at: own.stiffness[at])
    return StiffnessTable(
        np.array(temperatures, float),
        np.array(speeds, float),
        values,
        dict(unloads),
        dict(provenance),
    )


def _alike(k: Array) -> bool:
    """Whether a stiffness (5, 5) has the same entries along x and about x as along y and about y."""
    same = ((0, 0), (1, 1), 1.0), ((3, 3), (4, 4), 1.0), ((0, 4), (1, 3), -1.0)
    return _size(k, (0, 1)) <= NOTHING and all(abs(k[along_x] - sign * k[along_y]) <= NOTHING * _scale(k, along_x) for along_x, along_y, sign in same)


def _size(k: Array, at: tuple[int, int]) -> float:
    """An entry of a stiffness (5, 5) over its scale; nothing of a bearing that has no stiffness there."""
    return float(abs(k[at]) / (_scale(k, at) or 1.0))


def _scale(k: Array, at: tuple[int, int]) -> float:
    i, j = at
    return float(np.sqrt(abs(k[i, i] * k[j, j])))


def _property(bearing: BearingState | LinearState, read: Callable[[Any], float]) -> float:
    """A property of a bearing; NaN for what only balls have of a bearing given by numbers."""
    try:
        return float(read(bearing))
    except AttributeError:
        return float("nan")


def write_table(table: StiffnessTable, path: Path) -> None:
    """CSV: a comment line of provenance (JSON), one of unloading, a header with units, a row a bearing and condition."""
    with path.open("w", newline="", encoding="utf-8") as file:
        file.write(f"# provenance: {json.dumps(dict(table.provenance))}\n")
        file.write(f"# unloads_C: {json.dumps(dict(table.unloads))}\n")
        writer = csv.writer(file, lineterminator="\n")
        told = [*COLUMNS, *(c for c in FURTHER if any(c in columns for columns in table.values.values()))]
        writer.writerow(["bearing", "temperature_C", "speed_rpm", *told])
        for name, columns in table.values.items():
            for i, t in enumerate(table.temperature):
                for j, speed in enumerate(table.speed):
                    writer.writerow([cell(name), repr(float(t)), repr(in_rpm(speed)), *(repr(float(columns[c][i, j])) for c in told)])


def read_table(path: Path) -> StiffnessTable:
    """The table of a CSV made by `write_table`; `BadInput` where it is not one."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
        provenance = json.loads(lines[0].removeprefix("# provenance: "))
        unloads = json.loads(lines[1].removeprefix("# unloads_C: "))
        rows = list(csv.DictReader(lines[2:]))
        temperature = np.unique([float(r["temperature_C"]) for r in rows])
        rpm = np.unique([float(r["speed_rpm"]) for r in rows])
        values: dict[str, dict[str, Array]] = {}
        if len(rows) != len(temperature) * len(rpm) * len({row["bearing"] for row in rows}):
            raise BadInput(GAPS.format(path))  # before grids are made of it: of a damaged file they could be of any size
        for row in rows:
            where = np.searchsorted(temperature, float(row["temperature_C"])), np.searchsorted(rpm, float(row["speed_rpm"]))
            for column in (*COLUMNS, *(c for c in FURTHER if c in row)):
                grid = values.setdefault(name_of(row["bearing"]), {}).setdefault(column, np.full((len(temperature), len(rpm)), MISSING))
                grid[where] = float(row[column])
    except BadInput:
        raise
    except (OSError, RecursionError, IndexError, KeyError, ValueError, TypeError, AttributeError, csv.Error) as error:
        raise BadInput(f"{path}: not a stiffness table as spindle writes it: {type(error).__name__} {error}") from None
    if not values or any((grid == MISSING).any() for columns in values.values() for grid in columns.values()):
        raise BadInput(GAPS.format(path))
    if not (np.isfinite(temperature).all() and np.isfinite(rpm).all()) or any(np.isinf(g).any() for columns in values.values() for g in columns.values()):
        raise BadInput(f"{path}: holds an infinite number; only finite ones are allowed")
    if not (isinstance(provenance, dict) and isinstance(unloads, dict) and all(v is None or isinstance(v, int | float) for v in unloads.values())):
        raise BadInput(f"{path}: its first two lines say what it was made from, and where each bearing unloads: names and values; they are damaged")
    return StiffnessTable(temperature, rpm * RPM, values, unloads, provenance)
