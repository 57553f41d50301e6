"""Runout of a turning spindle: what probes at points in space see, what of it repeats, which lines it holds and why.

Signals of `probes` come from a running simulation (`measured`) or, for the steady state of the same condition, from the exact
harmonic answer of the linear model (`linear`). Both paths show the same; the first also shows what a ball-by-ball bearing adds.

What repeats does so every revolution of the part that a probe sees, which need not turn as the spindle does
(`speed_ratio`): its revolutions are counted, and the RRO holds the lines at whole multiples of its turning
frequency. A probe at what stands goes by the hub. Orders are told in turning frequencies of the spindle always.

Quoted as RRO and NRRO are peak to valley values of the record: the more revolutions, the larger the NRRO's, since its lines
come into step sooner or later, so a value goes with its number of revolutions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from thermospindle.model.bearing.kinematics import Line, lines, row_kinematics
from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Spindle
from thermospindle.model.types import Array, ComplexArray
from thermospindle.model.units import RPM
from thermospindle.sim.operating import OperatingPoint
from thermospindle.sim.running.excitation import Harmonics, harmonics, response
from thermospindle.sim.running.lines import HIGHEST, Fit, FoundLine, find_lines, slices
from thermospindle.sim.running.probes import Probe, all_probes, hub_probes, looked_at, probe_rows, speed_ratio
from thermospindle.sim.running.revolutions import (
    ErrorMotion,
    Revolutions,
    error_motion,
    from_orders,
    leakage,
    revolutions,
    turning_frequency,
)
from thermospindle.sim.running.run import MOST_STEPS, RunningRecord, pieces, record_steps, run_spindle

SHORTEST, REVOLUTIONS = 0.5, 12
"""A record lasts at least half a second and so many revolutions, unless asked for otherwise."""
SAMPLE_RATE = 20000.0  # Hz, ten samples a period of the highest lines of a small spindle


@dataclass(frozen=True, eq=False)
class Signals:
    """What the probes see: `value` (probes, n) m at `time` (n,) s, when the spindle stands at `angle` (n,) rad,
    of which parts turn by their ratio, and the whole motion (n, dofs) of the chain from which they see it."""

    probes: tuple[Probe, ...]
    time: Array
    angle: Array
    value: Array
    motion: Array

    def of(self, name: str) -> Array:
        """The signal (n,) of a probe."""
        return np.asarray(self.value[[p.name for p in self.probes].index(name)])


@dataclass(frozen=True, eq=False)
class Runout:
    """One record of whole revolutions analysed. `lines`: of the hub's three probes, strongest first; `fit`: of all.

    `averaged` and `by_lines` cut the record of every probe into revolutions of what the hub's
    probes see; `cut_of` into those of what a probe sees itself.
    """

    point: OperatingPoint
    signals: Signals
    turning: float  # Hz, signed, of the spindle
    averaged: Revolutions  # RRO by averaging over the revolutions
    lines: tuple[FoundLine, ...]
    fit: Fit

    @cached_property
    def ratios(self) -> tuple[float, ...]:
        """Speed of what every probe sees over the spindle's; of what stands that of the hub."""
        return tuple(speed_ratio(self.point.spindle, p) for p in self.signals.probes)

    @property
    def revolving(self) -> float:
        """Turning frequency (Hz, signed) of what the hub's probes see, whose revolutions are counted."""
        return self.turning * self.ratios[0]

    def values(self, averaged: bool = False) -> dict[str, ErrorMotion]:
        """What is quoted of every probe, by name; of the RRO by lines, or by averaging over the revolutions."""
        return {p.name: error_motion(self.cut_of(i, averaged), i, p.radial) for i, p in enumerate(self.signals.probes)}

    def cut_of(self, probe: int, averaged: bool = False) -> Revolutions:
        """The record in revolutions of what a probe, by its number, sees, with the RRO by lines or by averaging."""
        ratio = abs(self.ratios[probe])
        if ratio == abs(self.ratios[0]):
            return self.averaged if averaged else self.by_lines
        return self._others[ratio][not averaged]

    @cached_property
    def by_lines(self) -> Revolutions:
        """The same revolutions with the RRO made of the lines at whole orders of what is seen
        alone, which the other lines do not leak into."""
        return self._from_lines(self.averaged, self.ratios[0])

    @cached_property
    def _others(self) -> dict[float, tuple[Revolutions, Revolutions]]:
        """Averaged and by lines, by the size of the ratio, for what probes see beside the hub that
        turns at another speed; samples as many as in the hub's."""
        found = {}
        for ratio in {abs(r) for r in self.ratios} - {abs(self.ratios[0])}:
            cut = revolutions(self.signals.time, ratio * self.signals.angle, self.signals.value, len(self.averaged.angle))
            found[ratio] = cut, self._from_lines(cut, ratio)
        return found

    def _from_lines(self, cut: Revolutions, ratio: float) -> Revolutions:
        turning = self.turning * ratio
        rate = abs(turning)
        orders = np.round(self.fit.frequency / rate).astype(int)
        whole = np.abs(self.fit.frequency - orders * rate) < 1e-9 * rate
        start = np.sign(turning) * (ratio * self.signals.angle[0] - 2 * np.pi * turning * self.signals.time[0])
        at_zero = self.fit.phasor[:, whole] * np.exp(-1j * orders[whole] * start)
        mean = self.fit.mean[:, None] + from_orders(cut.angle, at_zero, orders[whole].tolist())
        return replace(cut, repeatable=mean)

    @cached_property
    def leaked(self) -> Array:
        """Largest (probes,) m by which lines between the whole orders can have changed the averaged RRO: the sum of what each leaves in it."""
        found = []
        for i, ratio in enumerate(self.ratios):
            orders = self.fit.frequency / abs(self.turning * ratio)
            gain = np.where(np.abs(orders - np.round(orders)) < 1e-9, 0.0, np.abs(leakage(orders, self.cut_of(i, True).count)))
            found.append(float((np.abs(self.fit.phasor) @ gain)[i]))
        return np.array(found)


# ---------------------------------------------------------------- signals


def measured(record: RunningRecord, probes: Sequence[Probe]) -> Signals:
    """What probes see in a running simulation."""
    value = probe_rows(record.point, probes) @ record.displacement.T
    return Signals(tuple(probes), record.time, record.angle, value, record.displacement)


def linear(point: OperatingPoint, probes: Sequence[Probe], time: Array, excited: Harmonics | None = None) -> Signals:
    """What probes see in the steady state of the linear model, at `time` (n,) s."""
    excited = harmonics(point) if excited is None else excited
    phasor, motion = response(point, excited), np.zeros((len(time), len(point.chain.dofs)))
    for piece in slices(len(time), len(phasor)):
        turned = 2 * np.pi * np.outer(time[piece], excited.frequency)
        motion[piece] = np.cos(turned) @ phasor.real - np.sin(turned) @ phasor.imag
    return Signals(tuple(probes), time, point.condition.speed * time, probe_rows(point, probes) @ motion.T, motion)


def whole_turns(point: OperatingPoint) -> int:
    """Default number of revolutions, of what the hub's probes see, of a record: between once and
    twice the shortest record, where the lines leak least into their mean."""
    rate = abs(point.condition.speed * speed_ratio(point.spindle)) / (2 * np.pi)
    fewest = int(np.ceil(max(SHORTEST * rate, REVOLUTIONS) - 1e-9))
    known, phasor = _known(point)
    size = np.abs(phasor @ probe_rows(point, hub_probes(point.spindle)).T).max(axis=1)
    orders = np.array([line.frequency for line in known]) / rate
    size[np.abs(orders - np.round(orders)) < 1e-9] = 0.0
    counts = range(fewest, 2 * fewest + 1)
    return min(counts, key=lambda count: float(size @ np.abs(leakage(orders, count))))


def sampling_rate(point: OperatingPoint, integrated: bool = True) -> float:
    """Lowest sample rate (Hz) of at least 20 kHz and eight samples a period of the highest line looked for;
    where motion is `integrated`, one that its step divides. BadInput where that step is too long for the line."""
    highest = max(line.frequency for line in _known(point)[0])
    wanted, step = max(SAMPLE_RATE, 8 * highest), point.spindle.hammer.step
    rate = 1 / (step * max(1, int(1 / (wanted * step) + 1e-9)))
    if highest <= HIGHEST * rate:
        return rate
    if not integrated:
        return wanted
    rpm = abs(point.condition.speed) / RPM
    raise BadInput(
        f"--speed {rpm:g}: the highest line looked for lies at {highest:.0f} Hz, and an integration step of {1e6 * step:g} us (hammer_test.step_us) shows "
        f"lines up to {HIGHEST / step:.0f} Hz; take a shorter step, or --path linear"
    )


# ---------------------------------------------------------------- analysis


def analyse(point: OperatingPoint, signals: Signals) -> Runout:
    """Runout, lines and their causes of a record at constant speed, whose first probes are the hub's, and whose clock
    starts with the turning part at angle 0 (else the predicted sums of lines that beat are those of another moment).

    ValueError if the speed is not constant or the record is shorter than a revolution or too coarse for the lines looked for.
    """
    turning = turning_frequency(signals.time, signals.angle)
    ratios = [speed_ratio(point.spindle, p) for p in signals.probes]
    cut = revolutions(signals.time, ratios[0] * signals.angle, signals.value)
    known, phasor = _known(point)
    predicted = phasor @ probe_rows(point, signals.probes[:3]).T
    whole = slice(int(np.searchsorted(signals.time, signals.time[0] + cut.count / abs(turning * ratios[0]) * (1 - 1e-12))))
    found, fitted = find_lines(signals.time[whole], signals.value[:, whole], turning, known, predicted, turning * np.array(list(dict.fromkeys(map(abs, ratios)))))
    return Runout(point, signals, turning, cut, found, fitted)


def _known(point: OperatingPoint) -> tuple[tuple[Line, ...], ComplexArray]:
    """All lines of theory, those that the point's imperfections excite first, and their phasors (lines, dofs) m: 0 for the others."""
    excited = harmonics(point)
    theory = lines(point.spindle, row_kinematics(point.spindle, point.state), point.condition.speed)
    own = set(excited.line)
    others = [line for line in theory if line not in own]
    nothing = np.zeros((len(others), len(point.chain.dofs)))
    return (*excited.line, *others), np.vstack([response(point, excited), nothing])


@dataclass(frozen=True)
class Plan:
    """How runout is found: `path` simulated (MuJoCo) or linear (harmonic answer), `samples` at
    `rate` (Hz), in so many `pieces` of which `runout` tells; none of the linear path."""

    path: str
    samples: int
    rate: float
    pieces: int


def planned(point: OperatingPoint, seconds: float | None = None, element: str = "linear", path: str | None = None) -> Plan:
    """The plan for a record of `seconds`; without a `path` it is simulated, but linear where linear
    bearings take more steps than a record can have.

    BadInput at rest, and for a record shorter than two revolutions.
    """
    speed = point.condition.speed
    if speed == 0:
        raise BadInput("--speed 0: a spindle at rest has no runout; give a speed in rpm")
    if path == "linear" and element != "linear":
        raise BadInput(f"--path linear is the harmonic answer of linear bearings; --element {element} is simulated")
    ratio = speed_ratio(point.spindle)
    turn = 2 * np.pi / abs(speed * ratio)
    if seconds is not None and seconds < 2 * turn:
        of_what = "" if abs(ratio) == 1 else f" of the {looked_at(point.spindle)}"
        raise BadInput(f"--seconds {seconds:g}: at {60 / turn:g} rpm the record needs at least two revolutions{of_what}, {2 * turn:.3g} s")
    count = whole_turns(point) if seconds is None else int(seconds / turn + 1e-9)
    rate = sampling_rate(point, path != "linear")
    samples = int(np.ceil(count * turn * rate)) + 2  # the last revolution ends between two samples
    if path is None:
        many = record_steps(samples, round(1 / (rate * point.spindle.hammer.step))) > MOST_STEPS
        path = "linear" if many and element == "linear" else "simulated"
    return Plan(path, samples, rate, pieces(samples, rate) if path == "simulated" else 0)


def runout(
    point: OperatingPoint, seconds: float | None = None, element: str = "linear", path: str | None = None, progress: Callable[[str], None] = lambda done: None
) -> Runout:
    """Runout at an operating point, as `planned`; `progress` is told of every piece of a simulated record."""
    plan, probes = planned(point, seconds, element, path), all_probes(point.spindle)
    if plan.path == "linear":
        return analyse(point, linear(point, probes, np.arange(plan.samples) / plan.rate))
    [record] = run_spindle([point], plan.samples / plan.rate, plan.rate, element=element, progress=progress)
    return analyse(point, measured(record, probes))


def with_imperfections(spindle: Spindle, imperfections: Imperfections) -> Spindle:
    """The spindle with other imperfections than the scene's."""
    return replace(spindle, imperfections=imperfections)
