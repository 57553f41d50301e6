"""What a built spindle is not: unbalance, waviness of races and balls, balls of different size, a cage off balance.

Conventions. A race wave of order n displaces the race's surface by amplitude cos(n azimuth + phase) in a frame fixed to its ring, with the
ring's azimuth 0 along x at time zero; radial waves are positive outward, axial ones positive along +z, on both races, so that order 1
of a radial wave is an eccentric race, displaced towards azimuth -phase. A ball wave raises the ball's surface by amplitude
cos(n angle + phase) along the circle on which it rolls, positive outward; the inner race meets angle spin t, the outer race the
opposite side. Ball j stands at azimuth 2 pi j / Z at time zero. Unbalances point to their phase as azimuth at time zero.

`drawn` makes a plausible set from a seed:

- unbalance: the permissible eccentricity e = G / speed of ISO 21940-11:2016 (formerly ISO 1940-1), Table 1: G 2.5 for computer drives,
  G 0.4 for spindles of high-precision systems; half of it on average, since the grade is a limit; the couple takes the same unbalance
  at half the bearing span;
- balls: ISO 3290-1:2014: variation of the lot diameter V_DwL over the set, deviation from spherical form over order 2 and up;
- races: amplitude falling with a power of the order, as measured on 17 rings of 608 bearings (*J. Manuf. Mater. Process.* 9 (2025)
  220), Rayleigh distributed with uniform phases;
- cages are drawn balanced: no standard speaks of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from model.machine import Spindle

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Wave:
    """amplitude cos(order angle + phase)."""

    order: int
    amplitude: float  # m, zero to peak
    phase: float  # rad


@dataclass(frozen=True)
class RowImperfections:
    """Imperfections of one bearing; empty where it has none."""

    inner_radial: tuple[Wave, ...] = ()
    inner_axial: tuple[Wave, ...] = ()
    outer_radial: tuple[Wave, ...] = ()
    outer_axial: tuple[Wave, ...] = ()
    ball_diameter: tuple[float, ...] = ()  # deviation of each ball, m; empty: all equal
    ball_waves: tuple[tuple[Wave, ...], ...] = ()  # of each ball; empty: round
    cage_unbalance: float = 0.0  # kg m
    cage_phase: float = 0.0  # rad


@dataclass(frozen=True)
class Imperfections:
    """Imperfections of a spindle; the default is a perfect one.

    `unbalance` (kg m) sits on the turning body at height `unbalance_z` (m); `couple_unbalance` (kg m2) is a pair of opposite unbalances
    times their distance, its phase that of the upper one.
    """

    unbalance: float = 0.0
    unbalance_z: float = 0.0
    unbalance_phase: float = 0.0
    couple_unbalance: float = 0.0
    couple_phase: float = 0.0
    bearings: Mapping[str, RowImperfections] = field(default_factory=dict)

    def row(self, bearing: str) -> RowImperfections:
        """The imperfections of a bearing, none where it has no entry."""
        return self.bearings.get(bearing, RowImperfections())


def waves(deviation: Array, highest: int) -> tuple[Wave, ...]:
    """Waves of order 1 to `highest` of a measured roundness profile: deviation (n,) in m at n equal steps of azimuth from 0.

    The mean is left out. Raises ValueError when the profile has too few values for `highest`.
    """
    n = len(deviation)
    if not 1 <= highest < n / 2:
        raise ValueError(f"a profile of {n} values shows orders 1 to {(n - 1) // 2}, not {highest}")
    spectrum = np.fft.rfft(deviation)[1 : highest + 1] * 2 / n
    return tuple(Wave(order, float(abs(c)), float(np.angle(c))) for order, c in enumerate(spectrum, 1))


# ---------------------------------------------------------------- drawn from a seed


@dataclass(frozen=True)
class Grade:
    """How well a spindle is made.

    `balance`: G of ISO 21940-11 (m/s); `service_speed` (rad/s) it is meant for; `ball_form`, `ball_lot`: deviation from spherical form and
    variation of the lot diameter of ISO 3290-1 (m); `race`: rms amplitude (m) of order 2, falling as order ** -`decay`.
    """

    balance: float
    service_speed: float
    ball_form: float
    ball_lot: float
    race: float
    decay: float


GRADES: Mapping[str, Grade] = {
    "high precision": Grade(0.4e-3, 7200 * np.pi / 30, 0.08e-6, 0.13e-6, 20e-9, 1.0),
    "precision": Grade(1.0e-3, 7200 * np.pi / 30, 0.13e-6, 0.25e-6, 50e-9, 1.0),
    "ordinary": Grade(2.5e-3, 7200 * np.pi / 30, 0.25e-6, 0.5e-6, 120e-9, 1.0),
}
"""G 0.4, 1, 2.5 with ball grades G3, G5, G10; size and decay of the race spectrum are assumed, of the size of roundness limits of
instrument bearings (0.1 to 0.5 um peak to valley)."""

RACE_ORDERS = 3
"""Race waves are drawn up to this multiple of the number of balls, and one order more."""

BALL_ORDERS = 8


def drawn(spindle: Spindle, seed: int, grade: Grade = GRADES["high precision"]) -> Imperfections:
    """A plausible set of imperfections of a spindle; the same seed gives the same set."""
    random = np.random.default_rng(seed)
    body = next(b for b in spindle.structure.bodies if b.turns)
    span = max(b.z for b in spindle.bearings) - min(b.z for b in spindle.bearings)
    permissible = body.mass * grade.balance / grade.service_speed
    static, couple = random.uniform(0, 1, 2) * permissible
    phases = random.uniform(0, 2 * np.pi, 2)
    rows = {b.name: _drawn_row(b.balls, grade, random) for b in spindle.bearings}
    return Imperfections(float(static), body.z, float(phases[0]), float(couple * span / 2), float(phases[1]), rows)


def _drawn_row(balls: int, grade: Grade, random: np.random.Generator) -> RowImperfections:
    orders = np.arange(2, RACE_ORDERS * balls + 2)
    races = [_drawn_waves(orders, grade.race * (orders / 2.0) ** -grade.decay, random) for _ in range(4)]
    sizes = random.uniform(-0.5, 0.5, balls) * grade.ball_lot
    sizes -= sizes.mean()  # a common deviation is a preload, not an imperfection
    ball_orders = np.arange(2, BALL_ORDERS + 1)
    # order n alone deviates from the circumscribed sphere by twice its amplitude; a fifth of the limit for order 2 leaves room for chance and the rest
    scale = 0.2 * grade.ball_form * (ball_orders / 2.0) ** -2.0
    ball_waves = tuple(_drawn_waves(ball_orders, scale, random) for _ in range(balls))
    return RowImperfections(races[0], races[1], races[2], races[3], tuple(float(s) for s in sizes), ball_waves)


def _drawn_waves(orders: NDArray[np.int_], rms: Array, random: np.random.Generator) -> tuple[Wave, ...]:
    """Waves with Rayleigh distributed amplitudes of root mean square `rms` (n,) and uniform phases."""
    amplitude = random.rayleigh(rms / np.sqrt(2))
    phase = random.uniform(0, 2 * np.pi, len(orders))
    return tuple(Wave(int(n), float(a), float(p)) for n, a, p in zip(orders, amplitude, phase, strict=True))
