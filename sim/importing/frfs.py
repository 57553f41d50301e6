"""From placed curves to the FRFs of one test: SI units, one quantity, common lines, a full rectangle, lines of the running speed out."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermospindle.model.errors import BadInput
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.campaign.beside import POWER
from thermospindle.sim.identification.frf import Frf, check_frf
from thermospindle.sim.importing.measured import Curve, even, listed

BESIDE = 8  # lines on each side of a running-speed line, by which it is judged
ABOVE, BELOW = 3, 2  # degrees of the numerator and the denominator through them: a mode, and what is beside it
STANDS_OUT = 8.0  # of the scatter of those lines: a value that does is not the structure's
FEWEST = 16  # lines of an FRF that is of use
ADVICE = {
    "conjugated": "conjugate = true in its [[files]] turns it round",
    "negative real part": "where the sensor looks the other way, say so where it is named, as in 3:-Z; the hammer's direction counts too",
    "coherence =": 'leave_out = ["H(response,reference)"] in its [[files]] does without it',
    "zero on": "band_Hz leaves lines without values out",
    "dead channel": 'leave_out = ["H(response,reference)"] in its [[files]] does without it',
    "the same value": "the export held a value: export it again, or leave it out with leave_out",
    "reciprocity": "one of the two has another unit, sign or node than it says, or the spindle changed between the hits",
}
"""What to do about what `check_frf` refuses, by a word of its sentence."""


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
    if speed:
        value, replaced = without_running_lines(frequency, value, speed)
        if replaced:
            notes.append(f"test {test}: lines at {listed(f'{f:.4g}' for f in replaced)} Hz, multiples of the running speed, are replaced by what their neighbours give")
    responses, references = (tuple(dict.fromkeys(getattr(p, key) for p in placed)) for key in ("response", "reference"))
    order = {(p.response, p.reference): k for k, p in enumerate(placed)}
    index = np.array([[order[r, q] for q in references] for r in responses])
    frf = Frf(
        frequency, np.asarray(value[index], complex), responses, references, quantity,
        _beside(placed, columns, index, "coherence", frequency, quantity), _beside(placed, columns, index, "sd", frequency, quantity),
    )  # fmt: skip
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
    steps = []
    for p in placed:
        steps.append(even(p.curve.frequency))
        if steps[-1] == 0:
            raise BadInput(
                f"{p.curve.file}: {p.curve.where}: its frequencies do not rise in even steps, as FRFs of a campaign must; "
                "a table of modes picked from it (frequency and damping a row) can be imported"
            )
    step = steps[0]
    low = max(p.curve.frequency[0] for p in placed)
    high = min(p.curve.frequency[-1] for p in placed)
    if band is not None:
        low, high = max(low, band[0]), min(high, band[1])
    columns = []
    for p, own in zip(placed, steps, strict=True):
        offset = (placed[0].curve.frequency[0] - p.curve.frequency[0]) / step
        if abs(own - step) * len(p.curve.frequency) > 0.1 * step or abs(offset - round(offset)) > 0.05:
            raise BadInput(
                f"{p.curve.file}: {p.curve.where}: has lines every {own:g} Hz from {p.curve.frequency[0]:g} Hz, {placed[0].curve.file.name} every "
                f"{step:g} from {placed[0].curve.frequency[0]:g}; FRFs of one test ({test}) need the same, or a test = \"...\" of their own"
            )
        inside = (p.curve.frequency >= low - 1e-6 * step) & (p.curve.frequency <= high + 1e-6 * step) & (p.curve.frequency > 0.5 * step)
        columns.append(np.flatnonzero(inside))
    count = min(map(len, columns))
    if count == 0:
        raise BadInput(f"{placed[0].curve.file}: test {test}: its FRFs have no line in common{'' if band is None else f' within band_Hz = {[*band]}'}")
    first = placed[0].curve.frequency[columns[0][0]]
    return first + step * np.arange(count), [c[:count] for c in columns]


def _value(p: Placed, lines: np.ndarray, frequency: Array, quantity: str) -> ComplexArray:
    return np.asarray(p.curve.value[lines] * p.factor * (2j * np.pi * frequency) ** (POWER[quantity] - POWER[p.quantity]), complex)


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
    """The lines between the first and the last at which every FRF has a value: analysers leave zeros below a high pass and above their span."""
    first, last = 0, value.shape[1]
    for p, row in zip(placed, value, strict=True):
        there = np.flatnonzero(row)
        if len(there) and (there[0] > first or there[-1] + 1 < last):
            first, last = max(first, int(there[0])), min(last, int(there[-1]) + 1)
            notes.append(f"{p.curve.file.name}: {p.name}: lines without a value at the ends of its band are left out")
    return slice(first, max(last, first))


def without_running_lines(frequency: Array, value: ComplexArray, speed: float) -> tuple[ComplexArray, list[float]]:
    """FRFs (m, n) without what turns: values at multiples of the speed (rad/s) that stand out of their neighbours, and where they stood.

    What stands out is judged by the scatter of `BESIDE` lines on each side about the rational function (Levy 1959) through them, and is
    replaced by its value.
    """
    step, turning = float(frequency[1] - frequency[0]), abs(speed) / (2 * np.pi)
    value, found = value.copy(), []
    for k in range(int(np.ceil(frequency[0] / turning)), int(frequency[-1] / turning) + 1):
        middle = (k * turning - frequency[0]) / step
        spoiled = np.arange(int(np.ceil(middle - 1.5)), int(np.floor(middle + 1.5)) + 1)
        around = np.r_[spoiled[0] - BESIDE : spoiled[0], spoiled[-1] + 1 : spoiled[-1] + 1 + BESIDE]
        around = around[(around >= 0) & (around < len(frequency))]
        spoiled = spoiled[(spoiled >= 0) & (spoiled < len(frequency))]
        if k == 0 or len(around) < BESIDE or len(spoiled) == 0 or turning < (BESIDE + 2) * step:
            continue
        x, there = (around - middle) / BESIDE, (spoiled - middle) / BESIDE
        for row in value:
            at_lines, expected = _rational(x, row[around], there)
            scatter = np.sqrt(np.sum(np.abs(row[around] - at_lines) ** 2) / (len(around) - ABOVE - BELOW - 1))
            if np.abs(row[spoiled] - expected).max() > STANDS_OUT * scatter + 1e-12 * np.abs(row).max():
                row[spoiled] = expected
                found.append(k * turning)
    return value, sorted({*found})


def _rational(x: Array, y: ComplexArray, there: Array) -> tuple[ComplexArray, ComplexArray]:
    """Values at `x` and `there` of N(x) / (1 + b1 x + b2 x^2) through y(x), by linear least squares."""
    above, below = np.vander(x, ABOVE + 1, increasing=True), np.vander(x, BELOW + 1, increasing=True)[:, 1:]
    c = np.linalg.lstsq(np.hstack([above, -y[:, None] * below]).astype(complex), y, rcond=None)[0]

    def at(z: Array) -> ComplexArray:
        top = np.vander(z, ABOVE + 1, increasing=True) @ c[: ABOVE + 1]
        return np.asarray(top / (1 + np.vander(z, BELOW + 1, increasing=True)[:, 1:] @ c[ABOVE + 1 :]))

    return at(x), at(there)


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
        advice = next((a for word, a in ADVICE.items() if word in text), "")
        raise BadInput(f"{where}: {text}" + (f"; {advice}" if advice else "")) from None
