"""Natural frequencies that somebody else published, in a table beside the scene."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Spindle

PUBLISHED_COLUMNS = ("mode", "kind", "main_flexibility", "frequency_20C_Hz, frequency_60C_Hz, ...")


@dataclass(frozen=True)
class Published:
    """Somebody else's natural frequencies of the spindle at rest, from `published/<name>.csv` beside the scene.

    `frequency`: Hz by temperature (C), for every mode; `flexibility` is what the source names as its main flexibility, or empty.
    """

    title: str
    source: str
    kinds: tuple[str, ...]
    flexibility: tuple[str, ...]
    frequency: Mapping[float, tuple[float, ...]]


def published(spindle: Spindle) -> tuple[Published, ...]:
    """Every published table beside the scene file, by name."""
    folder = spindle.file.parent / "published" if spindle.file else Path("does not exist")
    return tuple(read_published(path) for path in sorted(folder.glob("*.csv")))


def read_published(path: Path) -> Published:
    """A table of published natural frequencies: comment lines (#) with title and source, then CSV.

    Columns: mode, kind, main_flexibility (may be left out) and a frequency_<T>C_Hz for every temperature. Raises `BadInput`.
    """
    if not path.is_file():  # a pipe would be waited for
        raise BadInput(f"{path}: no such file")
    try:
        text = path.read_text(encoding="utf-8-sig").splitlines()
        reader = csv.DictReader(line for line in text if line and not line.startswith("#"))
        names, rows = reader.fieldnames or (), list(reader)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise BadInput(f"{path}: cannot be read as a table of published frequencies: {error}") from None
    comments = [line.lstrip("# ") for line in text if line.startswith("#")]
    columns = {name: re.fullmatch(r"frequency_(-?[0-9]+(?:\.[0-9]*)?)C_Hz", name) for name in names}
    temperatures = {name: float(m.group(1)) for name, m in columns.items() if m}
    unknown = [n for n in columns if n not in (*temperatures, "mode", "kind", "main_flexibility")]
    if unknown or not temperatures or "kind" not in columns:
        raise BadInput(f"{path}: columns {list(columns)}; expected are {', '.join(PUBLISHED_COLUMNS)}")
    try:
        frequency = {t: tuple(float(row[name]) for row in rows) for name, t in temperatures.items()}
    except (TypeError, ValueError) as error:
        raise BadInput(f"{path}: a frequency is no number: {error}") from None
    if bad := [f for row in frequency.values() for f in row if not 0 < f < math.inf]:
        raise BadInput(f"{path}: a frequency of {bad[0]:g} Hz; positive numbers are allowed")
    kinds, flexibility = (tuple(row.get(key) or "" for row in rows) for key in ("kind", "main_flexibility"))
    return Published(comments[0] if comments else path.stem, " ".join(comments[1:]), kinds, flexibility, frequency)
