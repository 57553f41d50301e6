"""Runout of one test of a campaign: displacement records over time, or their amplitude spectra, as CSV or as dataset 58 of a UFF file.

CSV columns: `time_s` and one `<node>_um` (`_nm`, `_mm`, `_m`) a probe for a record; `frequency_Hz`, `<node>_um` (zero to peak)
and, if known, `<node>_deg` for a spectrum. UFF: function type 1 (time response) or 12 (spectrum, complex). A probe is a point of
the campaign and looks along its direction. The window of a spectrum must be stated: what a bin holds of a line depends on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from thermospindle.model.drawing.measuring import Point
from thermospindle.model.errors import BadInput, absent
from thermospindle.model.files.cells import plain_number
from thermospindle.sim.campaign.uff import read_motion

UNITS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9}
WINDOWS = {"none": 1.0, "hann": 1.5, "flattop": 3.7702}
"""Noise power bandwidth in bins: the squares of a line's bins add up to so many squares of its
amplitude (Harris, *Proc. IEEE* 66 (1978) 51)."""
FEWEST = 4.0  # revolutions: less cannot tell lines from each other
HELD = 8  # equal samples in a row that no probe shows: it is saturated or has lost its signal
UNEVEN = 1e-3  # of a step


@dataclass(frozen=True, eq=False)
class RunoutRecord:
    """What probes at `nodes` saw: `value` (probes, n) m at `axis` (n,), s for a time record, Hz for a spectrum.

    A spectrum has complex values, zero to peak, of a record seen through `window`; without `phased` their phases mean nothing.
    """

    nodes: tuple[int, ...]
    kind: str  # time | spectrum
    axis: np.ndarray
    value: np.ndarray
    window: str = "none"
    phased: bool = True

    @property
    def step(self) -> float:
        return float((self.axis[-1] - self.axis[0]) / (len(self.axis) - 1))

    @property
    def length(self) -> float:
        """Length (s) of the record, for a spectrum that of the one it was made from."""
        return self.step * len(self.axis) if self.kind == "time" else 1 / self.step

    @property
    def highest(self) -> float:
        """Highest frequency (Hz) it holds."""
        return 0.5 / self.step if self.kind == "time" else float(self.axis[-1])


def check_revolutions(where: str, record: RunoutRecord, rate: float, whose: str = "") -> None:
    """`BadInput` for a record that holds too few revolutions of what turns at `rate` (Hz), told by `whose` it is."""
    if record.length * rate < FEWEST:
        raise BadInput(f"{where}: {record.length * rate:.3g} revolutions{whose} at {60 * rate:.6g} rpm; at least {FEWEST:g} whole ones are needed")


def read_runout(file: Path, points: Sequence[Point], speed: float, window: str | None) -> RunoutRecord:
    """The record of a file, checked; `speed` (rad/s) of the test and `window` as its table states them.

    Raises `BadInput` naming file and column or set for wrong units, unknown nodes, gaps, NaN, dead
    or held channels, a record of few revolutions.
    """
    if not file.is_file():
        raise BadInput(f"{file}: {absent(file)}")
    record = _from_uff(file, points) if file.suffix.lower() in (".uff", ".unv") else _from_csv(file, points)
    if record.kind == "spectrum" and window is None:
        raise BadInput(f"{file}: a spectrum needs spectrum_window in its test's table; allowed are {', '.join(WINDOWS)}")
    if record.kind == "time" and window is not None:
        raise BadInput(f"{file}: spectrum_window = {window!r}: a time record has none; it is for spectra")
    record = replace(record, window=window or "none")
    check_runout(file, record, speed)
    return record


def check_runout(file: str | Path, record: RunoutRecord, speed: float) -> None:
    """Refuse (`BadInput`) a record from which no runout can be told; `file` is for the message, `speed` in rad/s."""
    if speed == 0.0:
        raise BadInput(f"{file}: speed_rpm = 0: a spindle at rest has no runout; give the speed of the test")
    if len(record.axis) < 16:
        raise BadInput(f"{file}: holds {len(record.axis)} samples; at least 16 are needed")
    name = "time_s" if record.kind == "time" else "frequency_Hz"
    steps = np.diff(record.axis)
    step = float(np.median(steps))
    if step <= 0 or np.any(np.abs(steps - step) > UNEVEN * step + 2e-6 * np.abs(record.axis[1:]) * (record.kind == "spectrum")):
        worst = int(np.argmax(np.abs(steps - step)))
        raise BadInput(
            f"{file}: {name}: from {record.axis[worst]:.9g} to {record.axis[worst + 1]:.9g} among steps of {step:.6g}; no sample may be missing"
        )
    if record.kind == "spectrum" and record.axis[0] < 0:
        raise BadInput(f"{file}: frequency_Hz = {record.axis[0]:g}: negative frequencies are not allowed")
    rate = abs(speed) / (2 * np.pi)
    check_revolutions(str(file), record, rate)
    if record.highest < 2 * rate:
        raise BadInput(f"{file}: holds nothing above {record.highest:.4g} Hz; at {60 * rate:.6g} rpm at least {2 * rate:.4g} Hz are needed")
    for node, value in zip(record.nodes, record.value, strict=True):
        if not np.ptp(value.real) > 0 and not np.ptp(value.imag) > 0:
            raise BadInput(f"{file}: node {node}: the same value throughout; a dead channel is not allowed")
        if record.kind == "time":
            held = np.convolve(np.diff(value) == 0, np.ones(HELD - 1), "valid") == HELD - 1
            if held.any():
                raise BadInput(
                    f"{file}: node {node}: {HELD} equal samples from {record.axis[np.argmax(held)]:.6g} s; held values are not allowed"
                )


# ---------------------------------------------------------------- CSV


def _from_csv(file: Path, points: Sequence[Point]) -> RunoutRecord:
    try:
        lines = file.read_text(encoding="utf-8-sig").rstrip().splitlines()
    except UnicodeDecodeError as error:
        raise BadInput(f"{file}: not a CSV file in UTF-8: {error}") from None
    names = [cell.strip() for cell in lines[0].split(",")] if lines else [""]
    if names[0] not in ("time_s", "frequency_Hz"):
        raise BadInput(f"{file}: line 1: the first column is {names[0]!r}; allowed are time_s and frequency_Hz")
    kind = "time" if names[0] == "time_s" else "spectrum"
    table = _numbers(file, lines, len(names))
    found: dict[str, dict[int, tuple[int, float]]] = {"length": {}, "deg": {}}
    for column, name in enumerate(names[1:], 1):
        node, _, unit = name.rpartition("_")
        what = "deg" if unit == "deg" and kind == "spectrum" else "length"
        if what == "length" and unit not in UNITS:
            raise BadInput(
                f"{file}: line 1: {name!r}: allowed are <node>_um, _nm, _mm or _m" + (" and <node>_deg" if kind == "spectrum" else "")
            )
        if not node.isdecimal() or int(node) not in [p.node for p in points]:
            raise BadInput(f"{file}: line 1: {name!r}: node {node!r} is no point of the campaign; allowed are {[p.node for p in points]}")
        if int(node) in found[what]:
            raise BadInput(f"{file}: line 1: {name!r}: node {node} stands twice")
        found[what][int(node)] = column, UNITS.get(unit, 1.0)
    nodes = tuple(found["length"])
    if not nodes or (found["deg"] and set(found["deg"]) != set(nodes)):
        raise BadInput(f"{file}: line 1: needs a column of displacement, and phases for all of them or none")
    value = np.array([table[:, column] * unit for column, unit in found["length"].values()])
    if kind == "time":
        return RunoutRecord(nodes, kind, table[:, 0], value)
    if np.any(value < 0):
        raise BadInput(f"{file}: an amplitude of {value.min():g} m; amplitudes are not negative")
    phase = np.array([np.radians(table[:, found["deg"][n][0]]) for n in nodes]) if found["deg"] else np.zeros_like(value)
    return RunoutRecord(nodes, kind, table[:, 0], value * np.exp(1j * phase), phased=bool(found["deg"]))


def _numbers(file: Path, lines: list[str], columns: int) -> np.ndarray:
    rows = np.empty((max(len(lines) - 1, 0), columns))
    for number, line in enumerate(lines[1:], 2):
        cells = line.split(",")
        if len(cells) != columns:
            raise BadInput(f"{file}: line {number}: has {len(cells)} cells; {columns} are needed")
        try:
            rows[number - 2] = [float(plain_number(c)) for c in cells]
        except ValueError:
            raise BadInput(f"{file}: line {number}: {line.strip()!r}: every cell must be a number") from None
    if not np.all(np.isfinite(rows)):
        bad = int(np.argmax(~np.isfinite(rows).all(axis=1)))
        raise BadInput(f"{file}: line {bad + 2}: NaN or infinite; only finite numbers are allowed")
    return rows


def write_runout(file: Path, record: RunoutRecord) -> None:
    """Write a CSV file that `read_runout` reads back to rounding."""
    values = 1e6 * (record.value if record.kind == "time" else np.abs(record.value))
    columns, names = [record.axis, *values], ["time_s" if record.kind == "time" else "frequency_Hz", *(f"{n}_um" for n in record.nodes)]
    if record.kind == "spectrum" and record.phased:
        columns += list(np.degrees(np.angle(record.value)))
        names += [f"{n}_deg" for n in record.nodes]
    np.savetxt(file, np.array(columns).T, fmt="%.12g", delimiter=",", header=",".join(names), comments="", encoding="utf-8")


def same(a: RunoutRecord | None, b: RunoutRecord | None) -> bool:
    """Whether two records are the same to the rounding of a file."""
    if a is None or b is None:
        return a is b
    alike = (a.nodes, a.kind, a.window, a.phased, a.value.shape) == (b.nodes, b.kind, b.window, b.phased, b.value.shape)
    if not alike or not np.allclose(a.axis, b.axis, rtol=1e-9, atol=1e-9):
        return False
    one, other = (a.value, b.value) if a.phased else (np.abs(a.value), np.abs(b.value))
    return bool(np.allclose(one, other, rtol=1e-9, atol=1e-17))


# ---------------------------------------------------------------- UFF


def _from_uff(file: Path, points: Sequence[Point]) -> RunoutRecord:
    kind, nodes, axis, value = read_motion(file, points)
    return RunoutRecord(nodes, kind, axis, value)
