"""Tables of modes and their shapes: rows, and the CSV files of a campaign that hold them."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from dataclasses import astuple, dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from thermospindle.model.errors import BadInput, absent
from thermospindle.model.files.cells import cells, name_of
from thermospindle.model.scene.fields import first_error
from thermospindle.sim.campaign.form import MODE_COLUMNS, SHAPE_COLUMNS, ModeTable, ShapeTable


@dataclass(frozen=True)
class ShapeAt:
    """What one point shows of a mode, in its direction: displacement in a unit that all points of the mode have in common."""

    node: int
    value: complex
    sd: float  # one standard deviation of either part


@dataclass(frozen=True)
class ModeRow:
    """One identified mode of one test; None where the table is empty. All modes of a test have
    shapes at the same nodes, in the same order, or none has one."""

    test: str
    mode: int
    kind: str
    frequency: float  # Hz
    frequency_sd: float  # Hz, one standard deviation
    damping_ratio: float | None = None
    damping_ratio_sd: float | None = None
    shape: tuple[ShapeAt, ...] = ()


def read_modes(file: Path, tests: list[str]) -> list[ModeRow]:
    rows: list[ModeRow] = []
    for where, told in _cells(file, MODE_COLUMNS, ModeTable):
        row = ModeRow(*told.values())
        if row.test not in tests:
            raise BadInput(f"{where}: test = {row.test!r}: no such test; allowed are {', '.join(tests)}")
        if row.damping_ratio is None and row.damping_ratio_sd is not None:
            raise BadInput(f"{where}: damping_ratio_sd = {row.damping_ratio_sd}: without a damping_ratio it must be empty")
        if (row.test, row.mode) in [(r.test, r.mode) for r in rows]:
            raise BadInput(f"{where}: mode = {row.mode}: test {row.test} has this mode already; each stands once")
        rows.append(row)
    return rows


def with_shapes(file: Path, rows: list[ModeRow], points: list[int]) -> list[ModeRow]:
    """Modes with the shapes that a file tells of them."""
    shapes: dict[tuple[str, int], list[ShapeAt]] = {(row.test, row.mode): [] for row in rows}
    for where, told in _cells(file, SHAPE_COLUMNS, ShapeTable):
        of, node = (told["test"], told["mode"]), told["node"]
        if of not in shapes:
            raise BadInput(f"{where}: test = {of[0]!r}, mode = {of[1]}: the table of modes has no such mode")
        if node not in points:
            raise BadInput(f"{where}: node = {node}: no point of the campaign; allowed are {', '.join(map(str, points)) or 'none, for it has no [[points]]'}")
        if node in [at.node for at in shapes[of]]:
            raise BadInput(f"{where}: node = {node}: mode {of[1]} of test {of[0]} has this node already; each stands once")
        shapes[of].append(ShapeAt(node, complex(told["real"], told["imaginary"]), told["sd"]))
    first: dict[str, tuple[int, list[int]]] = {}
    for (test, mode), shape in shapes.items():
        nodes = [at.node for at in shape]
        one, there = first.setdefault(test, (mode, nodes))
        if nodes != there:
            raise BadInput(f"{file}: test {test}: mode {mode} is told at nodes {_nodes(nodes)}, mode {one} at {_nodes(there)}; all modes of a test need the same, in the same order")
        if shape and not any(at.value for at in shape):
            raise BadInput(f"{file}: test {test}: mode {mode} moves at no node; a shape needs one number that is not 0")
    return [replace(row, shape=tuple(shapes[row.test, row.mode])) for row in rows]


def _nodes(nodes: list[int]) -> str:
    return ", ".join(map(str, nodes)) or "none"


def _cells(file: Path, columns: tuple[str, ...], form: type[BaseModel]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Where every row of a CSV file is, for messages, and what its cells say; an empty cell is the form's default."""
    if not file.is_file():
        raise BadInput(f"{file}: {absent(file)}")
    try:
        reader = csv.reader(file.read_text(encoding="utf-8-sig").splitlines(), strict=True)
        lines = [(reader.line_num, line) for line in reader]
    except (UnicodeDecodeError, csv.Error) as error:
        raise BadInput(f"{file}: not a CSV file in UTF-8: {error}") from None
    if not lines or tuple(lines[0][1]) != columns:
        raise BadInput(f"{file}: line 1: the columns must be {','.join(columns)}")
    for number, line in filter(lambda row: row[1], lines[1:]):  # empty lines say nothing
        where = f"{file}: line {number}"
        if len(line) != len(columns):
            raise BadInput(f"{where}: has {len(line)} cells; {len(columns)} are needed")
        raw = {key: name_of(text) if key in ("test", "kind") else text for key, text in zip(columns, line, strict=True) if text}
        try:
            yield where, dict(form.model_validate(raw))
        except ValidationError as error:
            raise BadInput(first_error(where, raw, form, error)) from None


def write_modes(file: Path, rows: Sequence[ModeRow]) -> None:
    _write(file, MODE_COLUMNS, [astuple(row)[: len(MODE_COLUMNS)] for row in rows])


def write_shapes(file: Path, rows: Sequence[ModeRow]) -> None:
    _write(file, SHAPE_COLUMNS, [(row.test, row.mode, at.node, at.value.real, at.value.imag, at.sd) for row in rows for at in row.shape])


def _write(file: Path, columns: tuple[str, ...], rows: Sequence[tuple[Any, ...]]) -> None:
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(map(cells, rows))
