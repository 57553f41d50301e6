"""Modes of UFF files (55, 2414): frequency, damping and shape of each, and whether its dampings are ratios or in per cent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from thermospindle.model.errors import BadInput
from thermospindle.sim.importing.mapping import FileForm
from thermospindle.sim.importing.measured import End, ModeLine, Question

COMPLEX = (5, 6)  # data types: in single and in double precision
HEAVY = 0.2
"""Damping from which a file is asked whether it is a ratio: machines have less, and a few tenths of a per cent are common."""


@dataclass(frozen=True)
class Found:
    """A mode of the set `where`; its damping, where a number told it and no eigenvalue, is as `told`, in a unit that is not known yet."""

    where: str
    line: ModeLine
    told: float | None = None
    second: bool = False  # whether another damping stands beside it that is not taken


def mode(where: str, record: Mapping[str, Any]) -> Found | None:
    """Frequency, damping and shape of a set of modal data; None where it is a static shape or holds none.

    Damping is the viscous one, or half the hysteretic one (loss factor) where that stands alone: they are the same at resonance.
    """
    if "eig" in record:
        pole = complex(record["eig"])
        if pole.imag > 0:
            return Found(where, ModeLine("", "unknown", abs(pole) / (2 * np.pi), None, -pole.real / abs(pole) if pole.real else None, shape=_shape(record)))
    normal = record.get("analysis_type") == 2
    frequency = float(record.get("freq", record.get("record12_field2", 0.0)) or 0.0) if normal else 0.0  # 2414: record 12 holds them
    viscous = float(record.get("modal_damp_vis", record.get("record12_field5", 0.0)) or 0.0)
    hysteretic = float(record.get("modal_damp_his", record.get("record12_field6", 0.0)) or 0.0)
    if not frequency > 0:
        return None
    second = bool(viscous and hysteretic) and not np.isclose(hysteretic, 2 * viscous, rtol=0.01)
    return Found(where, ModeLine("", "unknown", frequency, shape=_shape(record)), viscous or hysteretic / 2 or None, second)


def modes_of(file: Path, found: Sequence[Found], settings: FileForm) -> tuple[tuple[ModeLine, ...], list[Question], list[str]]:
    """The modes of a file with dampings as ratios, whether these are in per cent where that is open, and what is left out in words.

    Raises `BadInput` for a damping that is none in the unit that the mapping tells.
    """
    largest = max(found, key=lambda f: f.told or 0.0, default=None)
    open_ = settings.damping_unit is None and largest is not None and (largest.told or 0.0) >= HEAVY
    questions = []
    if largest is not None and open_:
        questions.append(heavy(file, largest.told or 0.0, largest.line.frequency, largest.where))
    lines, without = [], []
    for f in found:
        ratio = f.line.damping_ratio if f.told is None else f.told / (100 if settings.damping_unit == "percent" else 1)
        if f.told is not None and ratio is not None and not open_ and ratio >= 1:
            raise BadInput(f"{file}: {f.where}: damping of the mode of {f.line.frequency:g} Hz = {f.told:g}: with damping_unit = {settings.damping_unit!r} it must be below {100 if settings.damping_unit == 'percent' else 1}")
        if ratio is not None and not ratio > 0:
            without.append(f"{f.line.frequency:g}")
            ratio = None
        lines.append(replace(f.line, damping_ratio=ratio))
    notes = [f"{file.name}: dampings that are not positive left out, of the modes of {', '.join(without)} Hz"] if without else []
    if second := [f"{f.line.frequency:g}" for f in found if f.second]:
        notes.append(f"{file.name}: hysteretic damping beside another viscous one left out, of the modes of {', '.join(second)} Hz")
    return tuple(lines), questions, notes


def heavy(file: Path, damping: float, frequency: float, where: str) -> Question:
    """What is asked of a file whose largest damping is that of one mode, of `HEAVY` or more."""
    of = f"{damping:g}, as that of {frequency:g} Hz ({where}) is, would be {100 * damping:g} % or {damping:g} %"
    return Question(file.name, "damping_unit", f'whether its dampings are "ratio" or "percent": {of}')


def _shape(record: Mapping[str, Any]) -> tuple[tuple[End, complex], ...]:
    """What a set of modal data tells of how its nodes move, in displacement, velocity or acceleration alike."""
    nodes = np.asarray(record.get("node_nums", ()), int)
    if "data_at_node" in record:  # 2414: real and imaginary parts beside each other where values are complex
        values = np.asarray(record["data_at_node"], float)
        if values.ndim != 2 or len(values) != len(nodes) or (record.get("data_type") in COMPLEX and values.shape[1] % 2):
            return ()
        columns = list((values[:, ::2] + 1j * values[:, 1::2] if record.get("data_type") in COMPLEX else values + 0j).T)
    else:
        columns = [np.asarray(record[name], complex) for name in ("r1", "r2", "r3") if name in record]
    if len(columns) < 3 or any(len(column) != len(nodes) for column in columns):
        return ()
    return tuple((End(int(node), f"+{axis}"), complex(v)) for axis, column in zip("XYZ", columns, strict=False) for node, v in zip(nodes, column, strict=True))
