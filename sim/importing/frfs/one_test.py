"""From placed curves to the FRFs of one test: SI units, one quantity, common lines, a full rectangle."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermospindle.model.errors import BadInput
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.identification.frf import POWER, Frf, check_frf, even, gap
from thermospindle.sim.importing.measured import Curve, listed

FEWEST = 16  # lines of an FRF that is of use
ADVICE = {
    "conjugated": "conjugate = true in its [[files]] turns it round",
    "negative real part": "where the sensor looks the other way, say so where it is named, by the other sign of its axis, as 3:-Z for 3:+Z; the hammer's direction counts too",
    "another point than the hammer's": "tell in its [[files]] the point that the sensor was at",
    "an axis": "a column of frequencies is told as such in its [files.columns], with its unit",
    "coherence =": 'leave_out = ["H(response,reference)"] in its [[files]] does without it',
    "dead channel": 'leave_out = ["H(response,reference)"] in its [[files]] does without it',
    "zero on": "band_Hz leaves lines without values out",
    "the same value": "the export held a value: export it again, or leave it out with leave_out",
    "reciprocity": "one of the two has another unit, sign or node than it says, or the spindle changed between the hits",
}
"""What to do about what `check_frf` refuses, by a word of its sentence."""
BESIDE = {"coherence": "coherence", "sd": "standard errors"}
ONE = 1e-6
"""Coherence within which a file's single precision writes 1."""


@dataclass(frozen=True, eq=False)
class Placed:
    """A curve between two points of the campaign; `factor` takes its value to SI of `quantity`, along the points' directions."""

    curve: Curve
    response: int
    reference: int
    quantity: str
    factor: float

    @property
    def name(self) -> str:
        return f"H({self.response},{self.reference})"


def frf_of(
    test: str, placed: Sequence[Placed], quantity: str, band: Sequence[float] | None, speed: float, averages: int | None
) -> tuple[Frf, list[str]]:
    """The FRFs of one test in `quantity`, and notes. Raises `BadInput` with the user's file for what no structure can do."""
    notes: list[str] = []
    placed = _once(test, placed, notes)
    placed, left = _rectangle(placed)
    if left:
        notes.append(f"test {test}: {listed(left)} left out: every response needs an FRF from every hammer point of its test")
    frequency, columns = _common_lines(test, placed, band, notes)
    value = np.array([_value(p, c, frequency, quantity) for p, c in zip(placed, columns, strict=True)])
    kept = _with_values(value, placed, notes)
    frequency, value, columns = frequency[kept], value[:, kept], [c[kept] for c in columns]
    if len(frequency) < FEWEST:
        raise BadInput(f"{placed[0].curve.file}: test {test}: {len(frequency)} lines in common within the band; at least {FEWEST} are needed")
    responses, references = (tuple(dict.fromkeys(getattr(p, key) for p in placed)) for key in ("response", "reference"))
    order = {(p.response, p.reference): k for k, p in enumerate(placed)}
    index = np.array([[order[r, q] for q in references] for r in responses])
    notes += [f"test {test}: {n}" for n in map(lambda key: _not_all(placed, key), BESIDE) if n]
    frf = Frf(
        frequency, np.asarray(value[index], complex), responses, references, quantity,
        _beside(placed, columns, index, "coherence", frequency, quantity), _beside(placed, columns, index, "sd", frequency, quantity),
    )  # fmt: skip
    if frf.coherence is not None and np.all(np.abs(frf.coherence - 1) < ONE):
        notes.append(f"test {test}: its coherence left out: 1 on every line, as that of a single hit is whatever the noise")
        frf = replace(frf, coherence=None)
    if frf.sd is None and frf.coherence is not None and averages is not None:
        frf = replace(frf, sd=_sd(frf, averages))
    _check(frf, placed, speed)
    return frf, notes


def _sd(frf: Frf, averages: int) -> Array:
    """Standard error of H1 from coherence: |H| sqrt((1 - g2) / (g2 n)), Bendat & Piersol 2010, Table 9.6, both parts together."""
    assert frf.coherence is not None
    g = np.clip(frf.coherence, 1e-6, 1 - 1e-9)
    return np.abs(frf.value) * np.sqrt((1 - g) / (g * averages)) + 1e-30


def _once(test: str, placed: Sequence[Placed], notes: list[str]) -> list[Placed]:
    found: dict[tuple[int, int], Placed] = {}
    for p in placed:
        pair = p.response, p.reference
        if pair in found:
            raise BadInput(
                f"{p.curve.file}: {p.curve.where}: {p.name} of test {test} is in {found[pair].curve.file.name} ({found[pair].curve.where}) already; "
                'a test = "..." of its own, or leave_out, tells them apart'
            )
        found[pair] = p
    return list(found.values())


def _rectangle(placed: Sequence[Placed]) -> tuple[list[Placed], list[str]]:
    """The curves of the largest full rectangle of responses and references, and the names of the others."""
    pairs = {(p.response, p.reference) for p in placed}
    responses, references = {r for r, _ in pairs}, {q for _, q in pairs}
    while any((r, q) not in pairs for r in responses for q in references):
        rows = {r: sum((r, q) in pairs for q in references) / len(references) for r in responses}
        columns = {q: sum((r, q) in pairs for r in responses) / len(responses) for q in references}
        poorest_row, poorest_column = min(rows, key=lambda r: rows[r]), min(columns, key=lambda q: columns[q])
        if rows[poorest_row] <= columns[poorest_column]:
            responses.discard(poorest_row)
        else:
            references.discard(poorest_column)
    inside = [p for p in placed if p.response in responses and p.reference in references]
    return inside, [p.name for p in placed if p not in inside]


def _common_lines(test: str, placed: Sequence[Placed], band: Sequence[float] | None, notes: list[str]) -> tuple[Array, list[np.ndarray]]:
    """Frequencies (n,) above 0 Hz that all curves have, and which lines of each curve these are."""
    for p in placed:
        if len(p.curve.frequency) < 2:
            raise BadInput(f"{p.curve.file}: {p.curve.where}: {'one line' if len(p.curve.frequency) else 'no line above 0 Hz'} is no FRF; at least {FEWEST} are needed")
    low = max(p.curve.frequency[0] for p in placed)
    high = min(p.curve.frequency[-1] for p in placed)
    if band is not None:
        low, high = max(low, band[0]), min(high, band[1])
    first = placed[0].curve
    step = even(first.frequency)
    columns = []
    for p in placed:
        own = p.curve.frequency
        if not np.all(np.diff(own) > 0):
            raise BadInput(f"{p.curve.file}: {p.curve.where}: its frequencies do not rise from line to line, as FRFs of a campaign must")
        if not even(own) and (at := gap(own)) is not None:
            raise BadInput(f"{p.curve.file}: {p.curve.where}: from {own[at]:g} to {own[at + 1]:g} Hz among steps of {np.median(np.diff(own)):g} Hz; no line may be missing")
        if not _same_lines(own, first.frequency, step):
            raise BadInput(
                f"{p.curve.file}: {p.curve.where}: has {_spoken(own)}, {first.file.name} {_spoken(first.frequency)}; "
                f'FRFs of one test ({test}) need the same, or a test = "..." of their own'
            )
        least = 1e-6 * (step or np.diff(own).min())
        columns.append(np.flatnonzero((own >= low - least) & (own <= high + least) & (own > 0.5 * step)))
    count = min(map(len, columns))
    if count == 0:
        raise BadInput(f"{first.file}: test {test}: its FRFs have no line in common{'' if band is None else f' within band_Hz = {[*band]}'}")
    lines = first.frequency[columns[0][:count]]
    return lines[0] + step * np.arange(count) if step else lines, [c[:count] for c in columns]


def _same_lines(own: Array, first: Array, step: float) -> bool:
    """Whether lines are those of the first FRF: on its even grid (`step`, Hz), of which they may begin and end elsewhere, or the very same."""
    if step == 0:
        return own.shape == first.shape and bool(np.allclose(own, first, rtol=1e-5, atol=0))
    offset = (first[0] - own[0]) / step
    return even(own) > 0 and abs(even(own) - step) * len(own) <= 0.1 * step and abs(offset - round(offset)) <= 0.05


def _spoken(lines: Array) -> str:
    """Lines in words: how many, how far apart, from where."""
    step = even(lines)
    return f"lines every {step:g} Hz from {lines[0]:g} Hz" if step else f"{len(lines)} lines in uneven steps from {lines[0]:g} to {lines[-1]:g} Hz"


def _value(p: Placed, lines: np.ndarray, frequency: Array, quantity: str) -> ComplexArray:
    return np.asarray(p.curve.value[lines] * p.factor * (2j * np.pi * frequency) ** (POWER[quantity] - POWER[p.quantity]), complex)


def _not_all(placed: Sequence[Placed], key: str) -> str:
    """What is left out in words where some FRFs have a coherence or standard errors beside them and others none."""
    without = [p.name for p in placed if getattr(p.curve, key) is None]
    return f"its {BESIDE[key]} left out: {listed(without)} {'has' if len(without) == 1 else 'have'} none" if 0 < len(without) < len(placed) else ""


def _beside(placed: Sequence[Placed], columns: list[np.ndarray], index: np.ndarray, key: str, frequency: Array, quantity: str) -> Array | None:
    """Coherence or standard errors, where every curve has them."""
    if any(getattr(p.curve, key) is None for p in placed):
        return None
    rows = []
    for p, lines in zip(placed, columns, strict=True):
        row = np.asarray(getattr(p.curve, key)[lines], float)
        rows.append(row if key == "coherence" else np.abs(row * p.factor * (2 * np.pi * frequency) ** (POWER[quantity] - POWER[p.quantity])))
    return np.array(rows)[index]


def _with_values(value: ComplexArray, placed: Sequence[Placed], notes: list[str]) -> slice:
    """The lines between the first and the last at which every FRF has a value: analysers leave
    zeros below a high pass and above their span."""
    first, last = 0, value.shape[1]
    for p, row in zip(placed, value, strict=True):
        there = np.flatnonzero(row)
        if len(there) and (there[0] > first or there[-1] + 1 < last):
            first, last = max(first, int(there[0])), min(last, int(there[-1]) + 1)
            notes.append(f"{p.curve.file.name}: {p.name}: lines without a value at the ends of its band are left out")
    return slice(first, max(last, first))


def _check(frf: Frf, placed: Sequence[Placed], speed: float) -> None:
    """The checks of a campaign; what they refuse is told with the file that the user gave, and what to do."""
    try:
        check_frf("", frf, speed)
    except BadInput as error:
        text = str(error).removeprefix(": ")
        pair = re.search(r"H\((\d+),(\d+)\)", text)
        own = [p for p in placed if pair and (p.response, p.reference) == (int(pair[1]), int(pair[2]))]
        if not own and (row := re.match(r"response (\d+)", text)):
            own = [p for p in placed if p.response == int(row[1])]
        where = f"{own[0].curve.file} ({own[0].curve.where})" if own else listed(dict.fromkeys(p.curve.file.name for p in placed), 3)
        advice = (_meant(frf, placed, speed) if "negative real part" in text else "") or next((a for word, a in ADVICE.items() if word in text), "")
        raise BadInput(f"{where}: {text}" + (f"; {advice}" if advice else "")) from None


def _meant(frf: Frf, placed: Sequence[Placed], speed: float) -> str:
    """Whether the same numbers, taken for another quantity, are of a passive structure: then
    another unit is meant, unless the other sign would do as well."""

    def passes(value: np.ndarray) -> bool:
        try:
            check_frf("", replace(frf, value=value, coherence=None, sd=None), speed)
        except BadInput:
            return False
        return True

    told = {p.quantity for p in placed}
    for other in set(POWER) - told if len(told) == 1 else ():
        if passes(frf.value * (2j * np.pi * frf.frequency) ** (POWER[min(told)] - POWER[other])):
            if passes(-frf.value):
                return f"{ADVICE['negative real part']}; or, where the unit may be wrong, taken for {other} its numbers pass as well"
            return f"taken for {other} its numbers pass: is its unit told as that of {min(told)} by mistake?"
    return ""
