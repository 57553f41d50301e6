"""Axes and units of the functions (58) of a UFF file: lines in Hz, steps in s, and each side of an
ordinate, by label or over the factors of set 164."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from thermospindle.model.errors import BadInput
from thermospindle.model.types import Array
from thermospindle.sim.campaign.uff import FORCE, KINDS, factor
from thermospindle.sim.importing import units
from thermospindle.sim.importing.mapping import FileForm

UNKNOWN = (0, 1)
"""Types of an abscissa that say nothing: unknown and general."""
TIME, FREQUENCY = 17, 18


def frequencies(file: Path, where: str, record: Mapping[str, Any], settings: FileForm) -> Array:
    """The lines (n,) of a function in Hz; where the mapping has a step, by that. `BadInput` for an
    abscissa that is no frequency in a unit that is known."""
    if settings.step_Hz is not None:
        return (settings.start_Hz or 0.0) + settings.step_Hz * np.arange(float(len(record["data"])))
    factor = units.of_frequency(label(record, "abscissa") or "Hz") if record["abscissa_spec_data_type"] in (FREQUENCY, *UNKNOWN) else None
    if factor is None:
        raise _not_known(file, where, record, f"frequency ({FREQUENCY}) in {units.FREQUENCIES}; start_Hz and step_Hz in its [[files]] tell its lines")
    return np.asarray(record["x"], float) * factor


def time_step(file: Path, where: str, record: Mapping[str, Any], settings: FileForm) -> float:
    """The step of a record in s; where the mapping has a rate, by that. `BadInput` for an abscissa that is no time in a unit that is known."""
    if settings.sample_rate_Hz is not None:
        return 1 / settings.sample_rate_Hz
    factor = units.of_time(label(record, "abscissa") or "s") if record["abscissa_spec_data_type"] in (TIME, *UNKNOWN) else None
    if factor is None:
        raise _not_known(file, where, record, f"time ({TIME}) in {units.TIMES}; sample_rate_Hz in its [[files]] tells its step")
    x = record["x"]
    return factor * (float(record["abscissa_inc"]) if record.get("abscissa_inc") else float(x[1] - x[0]))


def nameless(record: Mapping[str, Any]) -> bool:
    """Whether a function says neither by the type of its abscissa nor by a unit what its axis is: it is taken as in SI."""
    return record["abscissa_spec_data_type"] in UNKNOWN and not label(record, "abscissa")


def _not_known(file: Path, where: str, record: Mapping[str, Any], allowed: str) -> BadInput:
    return BadInput(f"{file}: {where}: abscissa of type {record['abscissa_spec_data_type']} in {label(record, 'abscissa')!r}; allowed is {allowed}")


def label(record: Mapping[str, Any], side: str) -> str:
    """The unit that stands at a side ("abscissa", "ordinate", "orddenom"); "" where none does."""
    text = record[f"{side}_axis_units_lab"].strip()
    return "" if text == "NONE" else text


def in_unit(file: Path, record: Mapping[str, Any], side: str, kind: int, system: Mapping[str, Any] | None) -> tuple[str, float]:
    """The unit of one side, and the factor to it: that of its label, or without one that of SI,
    over the factor of the file's set 164, where its `kind` is known."""
    told = label(record, side)
    if told or system is None or kind not in KINDS:
        return told, 1.0
    return next(iter(KINDS[kind].units)), 1 / factor(file, system, "force" if kind == FORCE else "length")
