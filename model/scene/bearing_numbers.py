"""The form of a scene file: bearings given by numbers, as a diagonal, a 5x5 matrix, or a table over temperature and speed."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, Strict, model_validator

from thermospindle.model.errors import BadInput
from thermospindle.model.files import stiffness_table
from thermospindle.model.files.cells import plain_number
from thermospindle.model.scene.fields import Finite, NotNegative, Positive, Share, Table, meant, named
from thermospindle.model.units import RPM

Row = Annotated[tuple[Finite, Finite, Finite, Finite, Finite], Strict(False)]
COLUMNS = ("radial_stiffness_N_per_m", "axial_stiffness_N_per_m", "tilt_stiffness_N_m_per_rad", "coupling_stiffness_N_per_rad")
"""Of a table; those that are missing are zero, but one of the first two must be there."""
BY_DIRECTION = tuple(stiffness_table.BY_DIRECTION)
"""Of a table whose bearing is not as stiff along y as along x; those that are missing are as along x, the second zero."""
BETWEEN = stiffness_table.BETWEEN
"""Of a table whose bearing couples directions further, with their places in the matrix; those that are missing are zero."""
DIRECTIONS = ("x", "y", "z", "tilt_x", "tilt_y")
WHERE = ("temperature_C", "speed_rpm")
BESIDE = ("bearing", *(c for c in (*stiffness_table.COLUMNS, *stiffness_table.FURTHER) if c not in (*COLUMNS, *BY_DIRECTION, *BETWEEN)))
"""Columns of the verb `table` that are no stiffness."""


class Numbers(Table):
    """`radial`, `axial` and `tilt` stiffness alike in both planes; or `matrix_SI`, order x, y, z,
    tilt_x, tilt_y in N, m and rad; or the CSV file `table` with columns temperature_C, speed_rpm and
    those of `COLUMNS`, `BY_DIRECTION` and `BETWEEN`, which is also what the verb `table` writes."""

    radial_stiffness_N_per_um: Positive | None = None
    axial_stiffness_N_per_um: NotNegative = 0.0
    tilt_stiffness_N_m_per_rad: NotNegative = 0.0
    matrix_SI: Annotated[list[Row], Field(min_length=5, max_length=5)] | None = None
    table: str | None = None
    bearing: str | None = None
    damping_ratio: Share

    @model_validator(mode="after")
    def _one_form(self) -> Numbers:
        given = [key for key in ("radial_stiffness_N_per_um", "matrix_SI", "table") if getattr(self, key) is not None]
        if len(given) != 1:
            raise ValueError("a bearing given by numbers has one of radial_stiffness_N_per_um, matrix_SI and table")
        if self.matrix_SI is not None:
            k = np.array(self.matrix_SI)
            if not k.any():
                raise ValueError("matrix_SI: all entries are zero; a bearing holds something, x and y in N/m, tilts in N m/rad")
            if np.abs(k - k.T).max() > 1e-9 * np.abs(k).max():
                i, j = np.unravel_index(int(np.abs(k - k.T).argmax()), k.shape)
                raise ValueError(
                    f"matrix_SI must be symmetric, and row {DIRECTIONS[i]}, column {DIRECTIONS[j]} is {k[i, j]:g}, row {DIRECTIONS[j]}, column {DIRECTIONS[i]} "
                    f"{k[j, i]:g}; springs here, MuJoCo's too, derive from an energy, so that cross-coupled bearings (journals, seals) are out of scope"
                )
            if np.linalg.eigvalsh(k).min() < -1e-9 * np.abs(k).max():
                raise ValueError("matrix_SI has a negative eigenvalue: a bearing that pushes the shaft away")
        if self.bearing is not None and self.table is None:
            raise ValueError("bearing names the rows of a table; without table there are none")
        return self

    def grid(self, scene: Path, table_key: str) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
        """Temperatures (C), speeds (rad/s) and stiffness (temperatures, speeds, 5, 5), flat;
        `table_key` is the key of a table's file in the file of the `scene`."""
        if self.table is not None:
            return _read(named(scene, table_key, self.table, "CSV file", "scene"), self.bearing, f"{scene}: {table_key} = {self.table!r}")
        if self.matrix_SI is not None:
            k = np.array(self.matrix_SI)
        else:
            radial, axial, tilt = 1e6 * (self.radial_stiffness_N_per_um or 0.0), 1e6 * self.axial_stiffness_N_per_um, self.tilt_stiffness_N_m_per_rad
            k = np.diag([radial, radial, axial, tilt, tilt])
        return (0.0,), (0.0,), tuple(float(v) for v in k.ravel())


def _read(file: Path, bearing: str | None, key: str) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    """The grid of a table; `BadInput` where it is none, has gaps, or a column that is not known."""
    try:
        lines = [(number, line) for number, line in enumerate(file.read_text(encoding="utf-8-sig").splitlines(), 1) if line.strip() and not line.startswith("#")]
        rows = list(zip((number for number, _ in lines[1:]), csv.DictReader(line for _, line in lines), strict=True))
    except (OSError, UnicodeDecodeError, csv.Error, ValueError) as error:
        raise BadInput(f"{key}: cannot be read as a table of bearing stiffness: {error}") from None
    if rows:
        _check_columns(file, [row for _, row in rows])
    if rows and bearing is not None:
        rows = [(number, row) for number, row in rows if row.get("bearing") == bearing]
    if not rows:
        of = f" of bearing {bearing!r}" if bearing else ""
        raise BadInput(f"{key}: {file}: has no rows{of}; allowed is a table with columns {', '.join(WHERE)} and stiffness, as `spindle table` writes it")
    known = [c for c in COLUMNS if c in rows[0][1]]
    if not set(known) & set(COLUMNS[:2]) or not set(WHERE) <= set(rows[0][1]):
        raise BadInput(f"{file}: its columns must be temperature_C, speed_rpm and {', '.join(COLUMNS)}, the last two where there are any")
    values: dict[tuple[float, float], np.ndarray] = {}
    for number, row in rows:
        where = f"{file}: line {number}"
        if None in row:  # what is left of a row that has more cells than the header
            raise BadInput(f"{where}: has more cells than the header has columns; numbers have a point, not a comma")
        told = {c: _number(where, c, row[c]) for c in (*WHERE, *COLUMNS, *BY_DIRECTION, *BETWEEN) if c in row}
        at = told["temperature_C"], abs(told["speed_rpm"]) * RPM  # a matrix that is symmetric does not know which way it turns
        k = _matrix(told)
        if at in values:
            raise BadInput(f"{where}: {at[0]:g} C and {at[1] / RPM:g} rpm stand twice{'' if bearing else '; which bearing? say bearing = ...'}")
        if (lowest := np.linalg.eigvalsh(k).min()) < -1e-9 * np.abs(k).max():
            raise BadInput(f"{where}: its stiffness has the negative eigenvalue {lowest:.3g}, as of a bearing that pushes the shaft away; all must be 0 or more")
        values[at] = k
    if not any(k.any() for k in values.values()):
        raise BadInput(f"{file}: {', '.join(known)}: all are zero{f' of bearing {bearing!r}' if bearing else ''}; a table holds some stiffness, in the units of its header")
    temperatures, speeds = (tuple(sorted({at[i] for at in values})) for i in (0, 1))
    missing = next(((t, s) for t in temperatures for s in speeds if (t, s) not in values), None)
    if missing is not None:
        raise BadInput(
            f"{file}: has no row of {missing[0]:g} C and {missing[1] / RPM:g} rpm{f' of bearing {bearing!r}' if bearing else ''}; "
            f"it needs one for each of its {len(temperatures)} temperatures at each of its {len(speeds)} speeds"
        )
    return temperatures, speeds, tuple(float(v) for t in temperatures for s in speeds for v in values[t, s].ravel())


def _number(where: str, column: str, text: str | None) -> float:
    """The finite number of a cell; None is that of a row that ends before its time."""
    try:
        value = float(plain_number(text or ""))
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise BadInput(f"{where}: {column} = {text or ''!r}: must be a finite number in digits 0 to 9")
    return value


def _matrix(told: Mapping[str, float]) -> np.ndarray:
    """The stiffness (5, 5) of a row's columns."""
    radial, axial, tilt, coupling = (told.get(c, 0.0) for c in COLUMNS)
    along_y, mixed, tilt_y, coupling_y = (told.get(c, same) for c, same in zip(BY_DIRECTION, (radial, 0.0, tilt, coupling), strict=True))
    k = np.diag([radial, along_y, axial, tilt, tilt_y])
    k[0, 1] = k[1, 0] = mixed
    k[0, 4] = k[4, 0] = coupling
    k[1, 3] = k[3, 1] = -coupling_y
    for column, (i, j) in BETWEEN.items():
        k[i, j] = k[j, i] = told.get(column, 0.0)
    return k


def _check_columns(file: Path, rows: Sequence[Mapping[str, str | None]]) -> None:
    """`BadInput` for a column that is neither stiffness nor what the verb `table` writes: a misspelt one would be a stiffness of zero."""
    allowed = (*WHERE, *COLUMNS, *BY_DIRECTION, *BETWEEN, *BESIDE)
    for column in rows[0]:
        if column is None or column in allowed or (not column and not any(row[column] for row in rows)):
            continue
        if apart := next((sign for sign in (";", "\t") if sign in column), None):
            raise BadInput(f"{file}: its columns are separated by {apart!r}; allowed are commas, and a point in numbers")
        raise BadInput(f"{file}: column {column!r}: unknown; allowed are {', '.join(allowed)}{meant(column, allowed)}")
