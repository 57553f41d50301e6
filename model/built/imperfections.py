"""What a built spindle is not: unbalance, waviness of races and balls, balls of different size, a cage off balance.

Conventions. A race wave of order n displaces the race's surface by amplitude cos(n azimuth + phase) in a frame fixed to its ring, with the
ring's azimuth 0 along x at time zero; radial waves are positive outward, axial ones positive along +z, on both races, so that order 1
of a radial wave is an eccentric race, displaced towards azimuth -phase. A ball wave raises the ball's surface by amplitude
cos(n angle + phase) along the circle on which it rolls, positive outward; the inner race meets angle spin t, the outer race the
opposite side. Ball j stands at azimuth 2 pi j / Z at time zero. Unbalances point to their phase as azimuth at time zero.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from thermospindle.model.types import Array


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

    `unbalance` (kg m) sits at height `unbalance_z` (m) on the turning body or shaft `unbalance_body`, empty where the height tells which
    (`model.carrier`); `couple_unbalance` (kg m2) is a pair of opposite unbalances times their distance, its phase that of the upper one.
    """

    unbalance: float = 0.0
    unbalance_z: float = 0.0
    unbalance_phase: float = 0.0
    couple_unbalance: float = 0.0
    couple_phase: float = 0.0
    bearings: Mapping[str, RowImperfections] = field(default_factory=dict)
    unbalance_body: str = ""

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
