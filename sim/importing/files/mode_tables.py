"""Tables of modes that somebody picked by hand: the easiest start of a campaign. A frequency a row is enough."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from pathlib import Path

from thermospindle.model.errors import BadInput
from thermospindle.model.files.cells import plain_number
from thermospindle.model.scene.fields import LARGEST
from thermospindle.sim.importing.files.text import COMMENT, text_of
from thermospindle.sim.importing.files.uff_modes import HEAVY, heavy
from thermospindle.sim.importing.mapping import FileForm
from thermospindle.sim.importing.measured import Content, ModeLine

COLUMNS = {
    "test": "test", "condition": "test", "mode": "mode", "no": "mode", "number": "mode", "kind": "kind", "type": "kind",
    "frequency": "frequency", "frequency_hz": "frequency", "f": "frequency", "f_hz": "frequency", "freq": "frequency",
    "natural_frequency": "frequency", "natural_frequency_hz": "frequency", "eigenfrequency": "frequency", "eigenfrequency_hz": "frequency", "natural_freq": "frequency", "natural_freq_hz": "frequency", "fn": "frequency", "fn_hz": "frequency",
    "freq_hz": "frequency", "hz": "frequency", "frequenz": "frequency", "frequenz_hz": "frequency", "eigenfrequenz": "frequency", "eigenfrequenz_hz": "frequency",
    "frequency_khz": "kilohertz", "f_khz": "kilohertz", "freq_khz": "kilohertz", "natural_frequency_khz": "kilohertz", "khz": "kilohertz",
    "frequency_sd_hz": "sd", "frequency_sd": "sd", "sd": "sd", "sd_hz": "sd", "damping_ratio": "damping", "damping": "damping", "zeta": "damping",
    "damping_ratio_sd": "damping_sd", "damping_sd_%": "percent_sd", "damping_%_sd": "percent_sd", "damping_%": "percent", "damping_percent": "percent", "zeta_%": "percent",
}  # fmt: skip
"""Headings in small letters, with blanks, points and brackets as _: what they are."""
FREQUENCIES = {"frequency", "kilohertz"}
WORDS = {"test", "mode", "kind"}
KNOWN = "such columns are test, mode, kind, frequency_Hz or frequency_kHz, frequency_sd_Hz, damping_ratio, damping_ratio_sd, damping_%, damping_sd_%"
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


def from_modes(file: Path, settings: FileForm) -> Content:
    """The modes of a table, whether its dampings are in per cent where that is open, and which of its
    columns are left out. Raises `BadInput` naming the line for what is no number, or no possible one."""
    found = headings(file)
    assert found is not None
    named, separator, first = found
    written = [cell.strip().strip('"') for cell in COMMENT.sub("", text_of(file).splitlines()[first]).split(separator)]
    called = dict(zip(named, written, strict=True))
    if "kilohertz" in named and {"frequency", "sd"} & {*named}:
        raise BadInput(f"{file}: line {first + 1}: has frequencies in kHz and another column of them, or of their errors, in Hz; write all in Hz")
    modes: list[ModeLine] = []
    lines: dict[tuple[str, str], int] = {}  # by test and mode
    ratios: list[tuple[float, float, str]] = []  # dampings that are told without per cent, their frequencies and where they stand
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
        value = {key: _number(where, told[key], key, called[key], separator) for key in told if key not in WORDS}
        frequency = 1e3 * value["kilohertz"] if "kilohertz" in value else value.get("frequency")
        if frequency is None:
            raise BadInput(f"{where}: frequency = '': a positive number is needed, in Hz, or in kHz under the heading frequency_kHz")
        own = told.get("test", ""), told.get("mode", f"line {number}")
        if (before := lines.setdefault(own, number)) < number:
            raise BadInput(f"{where}: {called['mode']} = {own[1]!r}: stands in line {before + 1} already{f', of test {own[0]}' if own[0] else ''}; each mode of a test may stand once")
        damping, sd = _damping(where, value, called, settings)
        if damping is not None and "percent" not in value:
            ratios.append((damping, frequency, f"line {number + 1}"))
        kind = told.get("kind", "unknown").lower()
        if kind not in KINDS:
            raise BadInput(f"{where}: kind = {told['kind']!r}: allowed are {', '.join(KINDS)}, or nothing")
        modes.append(ModeLine(told.get("test", ""), kind, frequency, value.get("sd"), damping, sd))
    if not modes:
        raise BadInput(f"{file}: has headings of a table of modes and no mode below them")
    largest = max(ratios, default=(0.0, 0.0, ""))
    questions = (heavy(file, *largest),) if settings.damping_unit is None and largest[0] >= HEAVY else ()
    left_out = [name for key, name in zip(named, written, strict=True) if name and not key]
    notes = (f"{file.name}: columns that are none of a table of modes left out: {', '.join(left_out)}; {KNOWN}",) if left_out else ()
    return Content(file, modes=tuple(modes), questions=questions, notes=notes)


def _damping(where: str, value: Mapping[str, float], called: Mapping[str, str], settings: FileForm) -> tuple[float | None, float | None]:
    """The damping ratio of a mode and its standard error, None where they are not told; per cent
    are told by the heading, or by the mapping."""
    percent = "percent" in value or settings.damping_unit == "percent"
    key = "percent" if "percent" in value else "damping"
    if key not in value:
        return None, None
    unit = 0.01 if percent else 1.0
    if not unit * value[key] < 1:
        allowed = "below 100 per cent is allowed" if percent else 'a ratio above 0 and below 1 is allowed; in percent under the heading damping_%, or with damping_unit = "percent" in its [[files]]'
        raise BadInput(f"{where}: {called[key]} = {value[key]:g}: {allowed}")
    if "percent_sd" in value:
        return unit * value[key], 0.01 * value["percent_sd"]
    return unit * value[key], value["damping_sd"] * (unit if key == "damping" else 1.0) if "damping_sd" in value else None


def _number(where: str, text: str, key: str, called: str, separator: str) -> float:
    try:
        value = float(plain_number(text.replace(",", ".") if separator != "," else text))
    except ValueError:
        raise BadInput(f"{where}: {called} = {text!r}: is no number") from None
    if not 0 < value <= LARGEST:
        raise BadInput(f"{where}: {called} = {text!r}: a positive number{' in Hz' * (key in ('frequency', 'sd'))} is needed")
    return value
