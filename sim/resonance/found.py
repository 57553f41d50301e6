"""What a resonance map holds: modes and lines over the grid, and where they meet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thermospindle.model.bearing.kinematics import Line
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.types import Array
from thermospindle.sim.resonance.point import key

STILL = 1e-12  # m of runout that is nothing
ALIKE = 0.1  # K, to which temperatures are told: what is met along both axes no further apart is one coincidence,
ALIKE_SPEED = 1e-3  # where its speeds are alike to this share too
NEARBY = 0.1  # of a speed, how far beyond those that are asked for crossings are looked for


@dataclass(frozen=True, eq=False)
class Track:
    """A mode over the grid: its number, kind, whirl and damping ratio at the nominal condition,
    `frequency` (T, S) in Hz, NaN where it was lost."""

    number: int
    kind: str
    whirl: str
    frequency: Array
    damping_ratio: float


@dataclass(frozen=True, eq=False)
class LineTrack:
    """A line over the grid, as it is at the nominal condition; `frequency` (T, S) in Hz; `amplitude` (m) of the hub in it there."""

    line: Line
    frequency: Array
    amplitude: float


@dataclass(frozen=True, eq=False)
class Coincidence:
    """A line meets a mode at a condition.

    `sense`: share of the modal force that its sense of whirl has (1: all, 1/2: a standing mode); `strength` (m, zero to peak)
    at the hub's probe under the map's imperfections, zero where they do not make this line; `unit_strength` (m) for 1 um of
    wave or ball size or 1 g mm, of varying compliance as it is; `margin`: (line - mode) / mode at the nominal condition; `nrro` (m rms) of all nonrepeatable
    lines there, in the mode's direction; `at_nominal_speed`: found along temperature at the nominal speed, else along speed.
    """

    line: Line
    mode: Track
    condition: Condition
    frequency: float  # Hz, of the line
    mode_frequency: float
    sense: float
    strength: float
    unit_strength: float
    margin: float
    nrro: float
    at_nominal_speed: bool
    interpolated: bool = False
    ratio: float = 1.0  # speed of what the hub's probes see over the spindle's

    @property
    def repeats(self) -> bool:
        """Whether the line is a whole multiple of the speed of what the hub's probes see, which NRRO leaves out."""
        order = 2 * np.pi * self.line.frequency / (self.condition.speed * self.ratio) if self.condition.speed else 0.0
        return abs(order - round(order)) < 1e-6


@dataclass(frozen=True, eq=False)
class Interpolated:
    """How many crossings stand as interpolated (`sim.resonance.between`), and what that is worth where `checked` others
    were also found exactly: largest error in frequency (relative), and of strengths the median and the largest (relative)."""

    crossings: int
    checked: int
    frequency_error: float
    strength_error: float
    largest_strength_error: float


@dataclass(frozen=True, eq=False)
class Curve:
    """All crossings of one line and one mode over the grid: speed (rad/s) by temperature (C), interpolated between grid speeds."""

    line: Line
    mode: Track
    temperature: Array
    speed: Array


@dataclass(frozen=True, eq=False)
class ResonanceMap:
    """Natural frequencies and lines on the grid `temperatures` (C) x `speeds` (rad/s), and where they meet.

    `nrro_speed`, `nrro_temperature` (n, 3): place (rad/s or C), radial and axial rms (m), along speed at the nominal
    temperature and along temperature at the nominal speed, with every coincidence there that was found exactly and denser
    about the strongest. `beyond`: what is met within `NEARBY` outside the speeds at the nominal temperature, strongest
    first, where that was asked. `drawn_from` is the seed of imperfections that the scene does not name, None if it does.
    """

    spindle: Spindle
    nominal: Condition
    temperatures: Array
    speeds: Array
    modes: tuple[Track, ...]
    lines: tuple[LineTrack, ...]
    curves: tuple[Curve, ...]
    coincidences: tuple[Coincidence, ...]
    nrro_speed: Array
    nrro_temperature: Array
    drawn_from: int | None
    interpolated: Interpolated | None = None
    beyond: tuple[Coincidence, ...] = ()

    @property
    def nominal_index(self) -> tuple[int, int]:
        """Place of the nominal condition on the grid."""
        return int(np.argmin(np.abs(self.temperatures - self.nominal.temperature))), int(
            np.argmin(np.abs(self.speeds - self.nominal.speed))
        )

    @property
    def repeats(self) -> bool:
        """Whether all runout that was computed repeats every revolution."""
        return all(float(along[:, 1:].max(initial=0.0)) < STILL for along in (self.nrro_speed, self.nrro_temperature))


def strongest(coincidences: Sequence[Coincidence]) -> list[Coincidence]:
    """Strongest first, of each cause, order, sense and mode only the bearing in which it is strongest."""
    best: dict[tuple, Coincidence] = {}
    for c in sorted(coincidences, key=lambda c: -c.strength):
        best.setdefault((*key(c.line)[1:], c.mode.number), c)
    return list(best.values())


def nearest(coincidences: Sequence[Coincidence]) -> Coincidence | None:
    """The one whose line is nearest to its mode at the nominal condition, of those that the map's
    imperfections excite if they excite any; None of none."""
    excited = [c for c in coincidences if c.strength > 0] or list(coincidences)
    return min(excited, key=lambda c: abs(c.margin), default=None)


def once(coincidences: Sequence[Coincidence]) -> list[Coincidence]:
    """Without those along speed that one at the nominal speed is already: a crossing of a line and
    a mode close to the nominal condition is met along both axes."""
    nominal: dict[tuple, list[Condition]] = {}
    for c in coincidences:
        if c.at_nominal_speed:
            nominal.setdefault((key(c.line), c.mode.number), []).append(c.condition)
    return [c for c in coincidences if c.at_nominal_speed or not any(_alike(c.condition, other) for other in nominal.get((key(c.line), c.mode.number), ()))]


def _alike(a: Condition, b: Condition) -> bool:
    return abs(a.temperature - b.temperature) < ALIKE and abs(a.speed - b.speed) < ALIKE_SPEED * b.speed
