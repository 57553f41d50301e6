"""Tables of modes that somebody picked by hand: the easiest start of a campaign. A frequency a row is enough."""

from __future__ import annotations

import csv
import re
from pathlib import Path

from thermospindle.model.errors import BadInput
from thermospindle.model.files.cells import plain_number
from thermospindle.model.scene.fields import LARGEST
from thermospindle.sim.importing.files.text import COMMENT, text_of
from thermospindle.sim.importing.measured import Content, ModeLine

COLUMNS = {
    "test": "test", "condition": "test", "mode": "mode", "no": "mode", "number": "mode", "kind": "kind", "type": "kind",
    "frequency": "frequency", "frequency_hz": "frequency", "f": "frequency", "f_hz": "frequency", "freq": "frequency",
    "natural_frequency": "frequency", "natural_frequency_hz": "frequency", "eigenfrequency": "frequency", "eigenfrequency_hz": "frequency", "natural_freq": "frequency", "natural_freq_hz": "frequency", "fn": "frequency", "fn_hz": "frequency",
    "freq_hz": "frequency", "hz": "frequency", "frequenz": "frequency", "frequenz_hz": "frequency", "eigenfrequenz": "frequency", "eigenfrequenz_hz": "frequency",
    "frequency_khz": "kilohertz", "f_khz": "kilohertz", "freq_khz": "kilohertz", "natural_frequency_khz": "kilohertz", "khz": "kilohertz",
    "frequency_sd_hz": "sd", "frequency_sd": "sd", "sd": "sd", "sd_hz": "sd", "damping_ratio": "damping", "damping": "damping", "zeta": "damping",
    "damping_ratio_sd": "damping_sd", "damping_%": "percent", "damping_percent": "percent", "zeta_%": "percent",
}  # fmt: skip
"""Headings in small letters, with blanks, points and brackets as _: what they are."""
FREQUENCIES = {"frequency", "kilohertz"}
KINDS = ("axial", "rocking", "lateral", "unknown")
"""What modes are paired by."""


def headings(file: Path) -> tuple[list[str], str, int] | None:
    """What each column of a table of modes is, its separator and the line of its headings; None where the file is no such table."""
    every = text_of(file).splitlines()
    for number, line in enumerate(every):
        plain = COMMENT.sub("", line)
        if not plain.strip():
            continue
        for separator in ("\t", ";", ","):
            named = _named(plain, separator)
            alone = named in (["frequency"], ["kilohertz"]) and _is_number(every[number + 1 :])
            if FREQUENCIES & {*named} and (alone or {"mode", "kind", "damping", "percent", "test", "sd"} & {*named}):
                return named, separator, number
        if not line.lstrip().startswith(("#", "%")):
            return None
    return None


def _named(line: str, separator: str) -> list[str]:
    """What each heading of a line is, "" where it is none of a table of modes."""
    return [COLUMNS.get(re.sub(r"[\s.()\[\]]+", "_", cell.strip().strip('"').lower()).strip("_"), "") for cell in line.split(separator)]


def without_frequency(file: Path) -> str:
    """Why a file that is no table of numbers is none of modes either, where its headings have something of one; else empty."""
    for line in text_of(file).splitlines():
        plain = COMMENT.sub("", line)
        for separator in ("\t", ";", ","):
            if {*_named(plain, separator)} & {"test", "mode", "kind", "damping", "percent"} and len(cells := plain.split(separator)) > 1:
                return f"{file}: a table of modes without a heading for the frequency; found are {', '.join(c.strip() for c in cells)}; allowed are frequency_Hz, natural frequency, f, frequency_kHz and the like"
        if plain.strip() and not line.lstrip().startswith(("#", "%")):
            break
    return ""


def _is_number(lines: list[str]) -> bool:
    """Whether the first line that is not empty is one number: below `frequency` alone a mode a row, not the axis of something."""
    first = next((line.strip() for line in lines if line.strip()), "")
    return re.fullmatch(r"[-+\d.eE]+", first) is not None


def from_modes(file: Path) -> Content:
    """The modes of a table. Raises `BadInput` naming the line for what is no number, or no possible one."""
    found = headings(file)
    assert found is not None
    named, separator, first = found
    if "kilohertz" in named and {"frequency", "sd"} & {*named}:
        raise BadInput(f"{file}: line {first + 1}: has frequencies in kHz and another column of them, or of their errors, in Hz; write all in Hz")
    modes = []
    try:
        rows = list(csv.reader(text_of(file).splitlines(), delimiter=separator))
    except csv.Error as error:
        raise BadInput(f"{file}: cannot be read as a table of modes: {error}") from None
    for number, cells in enumerate(rows):
        if number <= first or not any(c.strip() for c in cells) or cells[0].lstrip().startswith("#"):
            continue
        where = f"{file}: line {number + 1}"
        if len(cells) > len(named):
            raise BadInput(f"{where}: has {len(cells)} cells, the headings are {len(named)}")
        told = {name: cell.strip() for name, cell in zip(named, cells, strict=False) if name and cell.strip()}
        frequency = _number(where, told, "frequency", separator)
        if (kilohertz := _number(where, told, "kilohertz", separator)) is not None:
            frequency = 1e3 * kilohertz
        if frequency is None:
            raise BadInput(f"{where}: frequency = '': a positive number is needed, in Hz, or in kHz under the heading frequency_kHz")
        damping = _number(where, told, "damping", separator)
        if (percent := _number(where, told, "percent", separator)) is not None:
            damping = percent / 100
        if damping is not None and not 0 < damping < 1:
            raise BadInput(f"{where}: damping = {damping:g}: a ratio above 0 and below 1 is allowed; in percent under the heading damping_%")
        sd, damping_sd = (_number(where, told, key, separator) for key in ("sd", "damping_sd"))
        kind = told.get("kind", "unknown").lower()
        if kind not in KINDS:
            raise BadInput(f"{where}: kind = {told['kind']!r}: allowed are {', '.join(KINDS)}, or nothing")
        modes.append(ModeLine(told.get("test", ""), kind, frequency, sd, damping, damping_sd if damping else None))
    if not modes:
        raise BadInput(f"{file}: has headings of a table of modes and no mode below them")
    return Content(file, modes=tuple(modes))


def _number(where: str, told: dict[str, str], key: str, separator: str) -> float | None:
    if key not in told:
        return None
    try:
        value = float(plain_number(told[key].replace(",", ".") if separator != "," else told[key]))
    except ValueError:
        raise BadInput(f"{where}: {key} = {told[key]!r}: is no number") from None
    if not 0 < value <= LARGEST:
        raise BadInput(f"{where}: {key} = {told[key]!r}: a positive number{' in Hz' * (key in ('frequency', 'sd'))} is needed")
    return value
