"""Plausible imperfections drawn from a seed, for a grade of precision.

`drawn` makes a plausible set from a seed:

- unbalance: the permissible eccentricity e = G / speed of ISO 21940-11:2016 (formerly ISO 1940-1), Table 1: G 2.5 for computer drives,
  G 0.4 for spindles of high-precision systems; at the own speed of the part, with the mass of what turns together with it; half of it on average, since the
  grade is a limit; the couple takes the same unbalance at half the bearing span;
- balls: ISO 3290-1:2014: variation of the lot diameter V_DwL over the set, deviation from spherical form over order 2 and up;
- races: amplitude falling with a power of the order, as measured on 17 rings of 608 bearings (*J. Manuf. Mater. Process.* 9 (2025)
  220), Rayleigh distributed with uniform phases;
- rollers are drawn as balls of the same grade are, as no standard that is open speaks of them; what a race has along the axis they do not feel;
- cages are drawn balanced: no standard speaks of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermospindle.model.built.imperfections import Imperfections, RowImperfections, Wave
from thermospindle.model.carrier import named, permissible_unbalance
from thermospindle.model.machine import Spindle
from thermospindle.model.types import Array


@dataclass(frozen=True)
class Grade:
    """How well a spindle is made.

    `balance`: G of ISO 21940-11 (m/s), at the part's own speed where the spindle turns at its
    nominal one; `ball_form`, `ball_lot`: deviation from spherical form and variation of the lot
    diameter of ISO 3290-1 (m); `race`: rms amplitude (m) of order 2, falling as order ** -`decay`.
    """

    balance: float
    ball_form: float
    ball_lot: float
    race: float
    decay: float


GRADES: Mapping[str, Grade] = {
    "high precision": Grade(0.4e-3, 0.08e-6, 0.13e-6, 20e-9, 1.0),
    "precision": Grade(1.0e-3, 0.13e-6, 0.25e-6, 50e-9, 1.0),
    "ordinary": Grade(2.5e-3, 0.25e-6, 0.5e-6, 120e-9, 1.0),
}
"""G 0.4, 1, 2.5 with ball grades G3, G5, G10; size and decay of the race spectrum are assumed, of the size of roundness limits of
instrument bearings (0.1 to 0.5 um peak to valley)."""

PLAUSIBLE = 0
"""Seed of the imperfections of a scene that names none: in runout, map and report the same."""

RACE_ORDERS = 3
"""Race waves are drawn up to this multiple of the number of balls, and one order more."""

BALL_ORDERS = 8


def drawn(spindle: Spindle, seed: int, grade: Grade = GRADES["high precision"]) -> Imperfections:
    """A plausible set of imperfections of a spindle; the same seed gives the same set."""
    random = np.random.default_rng(seed)
    body = spindle.turning
    permissible = permissible_unbalance(spindle, body, grade.balance)
    static, couple = random.uniform(0, 1, 2) * permissible
    phases = random.uniform(0, 2 * np.pi, 2)
    rows = {b.name: _drawn_row(b.balls, b.elements, grade, random) for b in spindle.rolling}
    return Imperfections(float(static), body.z, float(phases[0]), float(couple * held_over(spindle) / 2), float(phases[1]), rows, named(spindle, body))


def held_over(spindle: Spindle) -> float:
    """Distance (m) between the outermost bearings, of a machine without any between its measuring points."""
    heights = [b.z for b in spindle.all_bearings] or [p.position[2] for p in spindle.points]
    return max(heights) - min(heights)


def _drawn_row(balls: int, elements: int, grade: Grade, random: np.random.Generator) -> RowImperfections:
    orders = np.arange(2, RACE_ORDERS * balls + 2)
    races = [_drawn_waves(orders, grade.race * (orders / 2.0) ** -grade.decay, random) for _ in range(4)]
    sizes = random.uniform(-0.5, 0.5, elements) * grade.ball_lot
    sizes -= sizes.mean()  # a common deviation is a preload, not an imperfection
    ball_orders = np.arange(2, BALL_ORDERS + 1)
    # order n alone deviates from the circumscribed sphere by twice its amplitude; a fifth of the limit for order 2 leaves room for chance and the rest
    scale = 0.2 * grade.ball_form * (ball_orders / 2.0) ** -2.0
    ball_waves = tuple(_drawn_waves(ball_orders, scale, random) for _ in range(elements))
    return RowImperfections(races[0], races[1], races[2], races[3], tuple(float(s) for s in sizes), ball_waves)


def _drawn_waves(orders: NDArray[np.int_], rms: Array, random: np.random.Generator) -> tuple[Wave, ...]:
    """Waves with Rayleigh distributed amplitudes of root mean square `rms` (n,) and uniform phases."""
    amplitude = random.rayleigh(rms / np.sqrt(2))
    phase = random.uniform(0, 2 * np.pi, len(orders))
    return tuple(Wave(int(n), float(a), float(p)) for n, a, p in zip(orders, amplitude, phase, strict=True))
