"""Assertions about a spindle for pytest: what moves with temperature and speed, by how much, and which element is behind it.

    from thermospindle.testing import assert_frequency_shift

    def test_the_rocking_mode_falls():
        assert_frequency_shift("hdd_2003", mode="rocking 1", from_C=20, to_C=60, shift_Hz=-20, within=2)

A mode is named by kind and number: "rocking 1" is the lowest rocking mode at the condition it is named at,
"axial 3" the third axial one; a whole number counts all modes. From one condition to another it is followed
by its shape. `scene` is a folder, the name of a shipped scene, or a spindle (`thermospindle.load`). A scene
and a condition are computed once a process. What fails says what moved, and where its energy is.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from functools import lru_cache
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from thermospindle.failing import at_speed, behind, called, energy, named, odd, table

if TYPE_CHECKING:
    from thermospindle.model.machine import Spindle
    from thermospindle.model.rotor.modes import Mode
    from thermospindle.sim.operating import OperatingPoint

    Scene = str | Path | Spindle

__all__ = [
    "Spindles",
    "assert_agreement",
    "assert_damping",
    "assert_frequency",
    "assert_frequency_shift",
    "assert_margin",
    "assert_peak_level",
    "assert_split",
]
KEPT = 256  # conditions
UNITS = {"receptance": "m/N", "mobility": "(m/s)/N", "accelerance": "(m/s2)/N"}


def _asked(positive: Sequence[str] = (), **numbers: float) -> None:
    """`BadInput` for a number that an assertion cannot be asked with; those named in `positive` are above nothing."""
    __tracebackhide__ = True
    from thermospindle.arguments import number

    for name, value in numbers.items():
        number(name, value, 0.0 if name in positive else -float("inf"))


class Spindles:
    """The fixture `spindle`: spindles and their operating points, each computed once;
    `spindle("hdd_2003")`, `spindle.point("hdd_2003", 60)`."""

    def __call__(self, scene: Scene) -> Spindle:
        return _loaded(scene)

    def point(self, scene: Scene, temperature_C: float, *, speed_rpm: float = 0.0) -> OperatingPoint:
        """The operating point at a temperature (C) and a speed (rpm)."""
        return _point(_loaded(scene), temperature_C, speed_rpm)

    def mode(self, scene: Scene, mode: str | int, temperature_C: float, *, speed_rpm: float = 0.0) -> Mode:
        """A mode by its kind and number there."""
        found = self.point(scene, temperature_C, speed_rpm=speed_rpm)
        return found.modes[_index(found, mode)]


def assert_frequency_shift(
    scene: Scene, *, mode: str | int, from_C: float, to_C: float, shift_Hz: float, within: float, speed_rpm: float = 0.0
) -> None:
    """The natural frequency moves by `shift_Hz` from one temperature to another, give or take `within` Hz."""
    __tracebackhide__ = True
    _asked(["within"], shift_Hz=shift_Hz, within=within)
    cold, hot = _pair(scene, from_C, to_C, speed_rpm, speed_rpm)
    index, partners = _index(cold, mode), _partners(cold, hot)
    after = _partner(cold, hot, index, partners)
    found = after.frequency - cold.modes[index].frequency
    if not abs(found - shift_Hz) <= within:
        head = f"{called(cold, mode)} moves by {found:+.2f} Hz from {from_C:g} to {to_C:g} C{at_speed(speed_rpm)}; wanted {shift_Hz:+g} +- {within:g} Hz"
        raise AssertionError("\n".join([head, *table(cold, hot, partners, f"{from_C:g} C", f"{to_C:g} C", index), *behind(cold, hot, index, after), *odd(cold, hot)]))


def assert_frequency(scene: Scene, *, mode: str | int, at_C: float, frequency_Hz: float, within: float, speed_rpm: float = 0.0) -> None:
    """The natural frequency is `frequency_Hz`, give or take `within` Hz."""
    __tracebackhide__ = True
    _asked(["within"], frequency_Hz=frequency_Hz, within=within)
    point = _of(scene, at_C, speed_rpm)
    index = _index(point, mode)
    found = point.modes[index].frequency
    if not abs(found - frequency_Hz) <= within:
        raise AssertionError("\n".join([f"{called(point, mode)} lies at {found:.2f} Hz, {at_C:g} C{at_speed(speed_rpm)}; wanted {frequency_Hz:g} +- {within:g} Hz", *energy(point, index), *odd(point)]))


def assert_damping(scene: Scene, *, mode: str | int, at_C: float, percent: float, within: float, speed_rpm: float = 0.0) -> None:
    """The damping ratio is `percent`, give or take `within` percent points."""
    __tracebackhide__ = True
    _asked(["within"], percent=percent, within=within)
    point = _of(scene, at_C, speed_rpm)
    index = _index(point, mode)
    found = 100 * point.modes[index].damping_ratio
    if not abs(found - percent) <= within:
        raise AssertionError("\n".join([f"{called(point, mode)} has {found:.3f} % damping, {at_C:g} C{at_speed(speed_rpm)}; wanted {percent:g} +- {within:g} %", *energy(point, index), *odd(point)]))


def assert_peak_level(
    scene: Scene, *, mode: str | int, at_C: float, response: str | int, reference: str | int, level: float, within: float,
    quantity: Literal["receptance", "mobility", "accelerance"] = "mobility", speed_rpm: float = 0.0,
) -> None:  # fmt: skip
    """`|H|` between two points at the mode's damped frequency is `level` (SI of `quantity`), give or take `within`."""
    __tracebackhide__ = True
    from thermospindle.front import frf

    _asked(["level", "within"], level=level, within=within)
    point = _of(scene, at_C, speed_rpm)
    index = _index(point, mode)
    frequency = point.modes[index].damped_frequency()
    found = float(abs(frf(point, [frequency], quantity=quantity)[response, reference][0]))
    if not abs(found - level) <= within:
        head = f"|{quantity}| of {response} to {reference} at {called(point, mode)}, {frequency:.1f} Hz, is {found:.4g} {UNITS[quantity]}; wanted {level:g} +- {within:g}"
        raise AssertionError("\n".join([head, *energy(point, index), *odd(point)]))


def assert_split(scene: Scene, *, modes: tuple[str | int, str | int], at_C: float, split_Hz: float, within: float, speed_rpm: float = 0.0) -> None:
    """Two modes, as ("rocking 1", "rocking 2"), lie `split_Hz` apart, the second above the first, give or take `within` Hz."""
    __tracebackhide__ = True
    from thermospindle.model.errors import BadInput

    _asked(["within"], split_Hz=split_Hz, within=within)
    if not isinstance(modes, tuple | list) or len(modes) != 2:
        raise BadInput(f'modes = {modes!r}: must be two modes, as ("rocking 1", "rocking 2")')
    point = _of(scene, at_C, speed_rpm)
    first, second = (_index(point, m) for m in modes)
    found = point.modes[second].frequency - point.modes[first].frequency
    if not abs(found - split_Hz) <= within:
        pair = " and ".join(f"{m} at {point.modes[i].frequency:.2f} Hz ({point.modes[i].whirl} whirl)" for m, i in zip(modes, (first, second), strict=True))
        head = f"{point.spindle.name}: {pair} lie {found:.2f} Hz apart, {at_C:g} C{at_speed(speed_rpm)}; wanted {split_Hz:g} +- {within:g} Hz"
        raise AssertionError("\n".join([head, *energy(point, first), *energy(point, second), *odd(point)]))


def assert_margin(
    scene: Scene, *, mode: str | int, speed_rpm: float, at_least_percent: float, temperatures_C: Sequence[float] | None = None, multiples: int = 3
) -> None:
    """No line of the bearings or the unbalance comes nearer to the mode than `at_least_percent` of its frequency.

    Lines in the mode's own direction count, of waviness up to `multiples` of the number of balls, with the
    first sidebands where a load displaces rings; at every temperature given, the ends of the scene's range by default, and between two where it is on one side of the
    mode at the one and on the other at the other. The mode is named at the first and followed by its shape.
    """
    __tracebackhide__ = True
    from thermospindle.model.bearing.kinematics import lines, row_kinematics
    from thermospindle.model.errors import BadInput

    _asked(["at_least_percent"], at_least_percent=at_least_percent)
    if speed_rpm == 0:
        raise BadInput("speed_rpm = 0: nothing turns, and no bearing has a line; must be a speed")
    if not isinstance(multiples, Integral) or multiples < 1:
        raise BadInput(f"multiples = {multiples!r}: of the number of balls, up to which waviness counts; must be a whole number of 1 or more")
    spindle = _loaded(scene)
    at = list(spindle.temperatures if temperatures_C is None else temperatures_C) if isinstance(temperatures_C, Iterable | None) else []
    if not at or isinstance(temperatures_C, str):
        raise BadInput(f"temperatures_C = {temperatures_C!r}: must be a list of temperatures in C, one at least")
    points = [_point(spindle, t, speed_rpm) for t in at]
    index = _index(points[0], mode)
    near: list[tuple[float, str]] = []
    before: dict[str, tuple[float, float]] = {}
    for point in sorted(points, key=lambda p: p.condition.temperature):
        own = _partner(points[0], point, index, _partners(points[0], point))
        found, temperature = {}, point.condition.temperature
        for line in lines(point.spindle, row_kinematics(point.spindle, point.state), point.condition.speed, multiples):
            if (line.direction == "axial") == (own.kind == "axial"):
                percent = 100 * (line.frequency - own.frequency) / own.frequency
                near.append((percent, f"{temperature:g} C: {named(line)} at {line.frequency:.1f} Hz, {percent:+.2f} % from {own.frequency:.1f} Hz"))
                found[named(line)] = temperature, percent
        for name in found.keys() & before.keys():
            (cold, below), (hot, above) = before[name], found[name]
            if below * above < 0:
                near.append((0.0, f"between {cold:g} and {hot:g} C: {name} crosses it, from {below:+.2f} to {above:+.2f} %"))
        before = found
    close = sorted({row for row in near if abs(row[0]) < at_least_percent}, key=lambda row: (abs(row[0]), row[1]))
    if close:
        head = f"{called(points[0], mode)}{at_speed(speed_rpm)}: {len(close)} lines come nearer than {at_least_percent:g} %; the nearest are"
        raise AssertionError("\n".join([head, *(f"  {text}" for _, text in close[:5]), *energy(points[0], index), *odd(*points)]))


def assert_agreement(scene: Scene, campaign: str | Path | Any, *, rms: float) -> None:
    """A campaign's frequencies and dampings agree with the scene: rms error of at most `rms` standard errors (`spindle compare`)."""
    __tracebackhide__ = True
    from thermospindle.diagnosis.prediction.partners import BELIEVABLE
    from thermospindle.front import compare

    _asked(["rms"], rms=rms)
    found = compare(_loaded(scene), campaign)
    if not found.rms_residual <= rms:
        rows = sorted(((abs(m.residual), t.test.id, m) for t in found.tests for m in t.modes), key=lambda row: -row[0])
        worst = [f"  {test}: {m.kind} mode measured at {m.measured:.2f} Hz, computed {m.computed - m.measured:+.2f} Hz, {m.residual:+.1f} s.e." for _, test, m in rows[:5]]
        lost = [f"  {t.test.id}: measured at {f:.2f} Hz, no computed mode within {BELIEVABLE:.0%}" for t in found.tests for f in t.missing]
        worst = [*lost, *worst][:5]
        raise AssertionError("\n".join([f"{found.campaign} is {found.rms_residual:.2f} standard errors (rms) from {found.spindle}; wanted at most {rms:g}; the worst are", *worst]))


# ---------------------------------------------------------------- spindles and conditions, each once


def _loaded(scene: Scene) -> Spindle:
    __tracebackhide__ = True
    from thermospindle.arguments import of_kind
    from thermospindle.model.machine import Spindle
    from thermospindle.model.scene.reading import scene_path

    of_kind("scene", scene, (Spindle, str, Path), "a spindle (ts.load), a scene's folder or the name of a shipped one")
    if isinstance(scene, Spindle):
        return scene

    file = scene_path(scene)
    return _read(file.resolve(), file.stat().st_mtime_ns)


@lru_cache(maxsize=32)
def _read(file: Path, changed: int) -> Spindle:
    __tracebackhide__ = True
    from thermospindle.front import load

    return load(file)


_POINTS: dict[tuple[str, float, float], OperatingPoint] = {}


def _point(spindle: Spindle, temperature: float, speed: float) -> OperatingPoint:
    __tracebackhide__ = True
    from thermospindle import front
    from thermospindle.arguments import number
    from thermospindle.front import soaked
    from thermospindle.model.scene.reading import content_hash

    key = content_hash(spindle), number("temperature_C", temperature), number("speed_rpm", speed)
    if key not in _POINTS:
        if len(_POINTS) >= KEPT:
            _POINTS.pop(next(iter(_POINTS)))
        _POINTS[key] = soaked(spindle, temperature, speed)
    for doubt in front.odd(_POINTS[key]):  # at every call, also of what is kept
        warnings.warn(f"{spindle.name}: {doubt}", stacklevel=4)
    return _POINTS[key]


def _of(scene: Scene, temperature: float, speed: float) -> OperatingPoint:
    __tracebackhide__ = True
    return _point(_loaded(scene), temperature, speed)


def _pair(scene: Scene, from_C: float, to_C: float, *speeds: float) -> tuple[OperatingPoint, OperatingPoint]:
    __tracebackhide__ = True
    spindle = _loaded(scene)
    return _point(spindle, from_C, speeds[0]), _point(spindle, to_C, speeds[1])


# ---------------------------------------------------------------- modes by name


def _index(point: OperatingPoint, mode: str | int) -> int:
    """Place of a mode among those of its condition. Raises `BadInput` with those there are."""
    __tracebackhide__ = True
    from difflib import get_close_matches

    from thermospindle.model.errors import BadInput

    found = point.modes
    kind, _, text = ("", "", str(mode)) if isinstance(mode, Integral) else str(mode).strip().rpartition(" ")
    own = [i for i, m in enumerate(found) if kind in ("", m.kind)]
    if not text.isdigit() or not 1 <= int(text) <= len(own) or (not isinstance(mode, Integral) and not kind):
        counts = {k: sum(m.kind == k for m in found) for k in dict.fromkeys(m.kind for m in found)}
        there = ", ".join(f"{k} 1 to {n}" for k, n in counts.items())
        near = "" if kind in ("", *counts) or not text.isdigit() else "".join(f"did you mean {k} {text}? " for k in get_close_matches(kind, counts, n=1))
        raise BadInput(f"mode = {mode!r}: {near}{point.spindle.name} has {there} at {point.condition.temperature:g} C, or whole numbers 1 to {len(found)}")
    return own[int(text) - 1]


def _partners(first: OperatingPoint, then: OperatingPoint) -> list[int]:
    from thermospindle.model.rotor.chain import matrices
    from thermospindle.sim.identification.pairing import follow

    return follow(matrices(first.chain).mass, first.modes, then.modes)


def _partner(first: OperatingPoint, then: OperatingPoint, index: int, partners: Sequence[int]) -> Mode:
    __tracebackhide__ = True
    if partners[index] < 0:
        t = then.condition.temperature
        head = f"{called(first, index + 1)}, {first.modes[index].frequency:.1f} Hz: no mode at {t:g} C has its shape, so it cannot be followed"
        raise AssertionError("\n".join([head, *odd(first, then)]))
    return then.modes[partners[index]]
