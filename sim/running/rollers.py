"""What cylindrical rollers feel of waves and of their own sizes: free displacements of a roller
bearing, as `excitation` has them of a ball row.

Between centred rings every roller is pressed by the same d, so that each has the slope s = c (10/9) d^(1/9) (`model.bearing.roller`), and

    K u = sum over rollers of s p (cos, sin, 0, -h sin, h cos),

p what presses the roller at its azimuth beyond the others (m): its own size, both its ends of a wave of its own, the inner race's wave less
the outer one's; h the height of its row. Waves of a race run straight along it and meet all rows alike; sizes and waves of rollers stand
row by row. The rows' rollers stand at the same azimuths. Nothing acts along the axis. Loose rollers carry nothing and excite nothing.
"""

from __future__ import annotations

import cmath
from collections.abc import Callable, Iterator

import numpy as np

from thermospindle.model.bearing.kinematics import Kinematics, Line, ball_line, cage_line, race_line
from thermospindle.model.bearing.roller import EXPONENT, RollerState
from thermospindle.model.built.imperfections import RowImperfections
from thermospindle.model.types import ComplexArray
from thermospindle.sim.running.whirl import whirling

CANCELLED = 1e-11
"""Share of the largest possible sum over the rollers below which an order has cancelled."""
ACROSS = [0, 1, 3, 4]
"""Of a bearing's five motions, those that rollers resist."""

Namer = Callable[[int], Line]
"""The line of a side, +1 or -1 for the sense of the rate in which it adds to the cage's."""


def free_displacements(state: RollerState, kin: Kinematics, own: RowImperfections) -> list[tuple[Line, ComplexArray]]:
    """Free displacements (5,) m, rad of the outer ring against the inner one: phasors, with the line of each."""
    row = state.row
    if state.load == 0.0:
        return []
    slope = row.constant * EXPONENT * (-row.clearance / 2) ** (EXPONENT - 1)
    place, height = np.exp(1j * row.azimuths), np.array(row.offsets)
    compliance = np.linalg.inv(state.stiffness[np.ix_(ACROSS, ACROSS)])
    found = []
    # amplitudes (rows, rollers) m, the rate (rad/s) in the frame of the cage at which they come by
    for amplitude, rate, names in _pressing(state.name, kin, own, len(row.offsets)):
        for side, pressed in ((1, amplitude @ place / 2), (-1, amplitude.conj() @ place / 2)):  # (rows,)
            if np.abs(pressed).max() <= CANCELLED * np.abs(amplitude).sum():
                continue
            speed = kin.cage + side * rate
            force = slope * np.concatenate([whirling(pressed.sum(), speed), whirling(1j * (height @ pressed), speed)])
            free = np.zeros(5, complex)
            free[ACROSS] = compliance @ force
            found.append((names(side), free))
    return found


def _pressing(name: str, kin: Kinematics, own: RowImperfections, rows: int) -> Iterator[tuple[ComplexArray, float, Namer]]:
    roller, place = np.arange(kin.balls), np.exp(2j * np.pi * np.arange(kin.balls) / kin.balls)
    for ring, sign, waves in (("inner", 1, own.inner_radial), ("outer", -1, own.outer_radial)):
        for wave in waves:
            amplitude = sign * cmath.rect(wave.amplitude, wave.phase) * place[wave.order * roller % kin.balls]
            rate = wave.order * (kin.cage - kin.ring(ring))
            yield np.tile(amplitude, (rows, 1)), rate, _of_race(name, kin, ring, wave.order)
    if own.ball_diameter:
        size = np.array(own.ball_diameter, complex)
        yield (size - size.mean()).reshape(rows, -1), 0.0, lambda side: cage_line(name, kin, "ball size")
    for order in sorted({w.order for waves in own.ball_waves for w in waves if w.order % 2 == 0}):  # odd ones lift at one contact what they lower at the other
        amplitude = np.array([2 * sum(cmath.rect(w.amplitude, w.phase) for w in waves if w.order == order) for waves in own.ball_waves], complex)
        rate = order * kin.spin * float(np.sign(kin.turning))
        yield amplitude.reshape(rows, -1), rate, _of_roller(name, kin, order)


def _of_race(name: str, kin: Kinematics, ring: str, order: int) -> Namer:
    return lambda side: race_line(name, kin, ring, order, "radial")


def _of_roller(name: str, kin: Kinematics, order: int) -> Namer:
    return lambda side: ball_line(name, kin, order, "radial", side)
