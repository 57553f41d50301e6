"""A running record cut into whole revolutions: what repeats in every one of them, and what does not.

By averaging, the repeatable runout (RRO) is the mean over the revolutions at every angle, the nonrepeatable runout
(NRRO) what is left (Al Mamun, Guo & Bi, *Hard Disk Drive: Mechatronics and Control*, 2007, Eqs. 3.83 and 3.84). The two
are orthogonal, so that the variances add up: var(total) = var(RRO) + var(NRRO), exactly, for any record of whole
revolutions (*J. Vib. Acoust.* 113 (1991) 292 has the like in the frequency domain). A line at `orders` times the turning
frequency leaks into the mean of N revolutions with the gain sin(pi N orders) / (N sin(pi orders)), 1 for whole orders:
`leakage`. By harmonics, the RRO is the sum of the lines at whole orders (Jang, Kim & Han's frequency-domain method,
*IEEE Trans. Magn.*, takes the bins of a Fourier transform; `sim.running.lines` fits the lines, which leaves no leakage).

Values of error motion follow ISO 230-7:2015, clause 3 (the same as ASME B89.3.4-2010) for a fixed sensitive direction:
the polar plot is the displacement over the angle of the turning part. Radial plots are centred on their least-squares
circle, which takes the part once per revolution away (for a workpiece it is how it is centred); along the axis it stays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import make_interp_spline

from thermospindle.model.types import Array, ComplexArray

STRAIGHT = 0.02  # rad, by which the angle of a record at constant speed may leave a straight line


@dataclass(frozen=True, eq=False)
class Revolutions:
    """Displacements `value` (probes, revolutions, samples) m at `angle` (samples,) rad of the turning part, in the sense of turning from
    where the record starts, `time` (revolutions x samples,) s; `repeatable` (probes, samples) m is the RRO, its mean value included."""

    angle: Array
    time: Array
    value: Array
    repeatable: Array

    @cached_property
    def nonrepeatable(self) -> Array:
        """NRRO (probes, revolutions, samples) m: what the RRO leaves."""
        return np.asarray(self.value - self.repeatable[:, None])

    @property
    def count(self) -> int:
        return int(self.value.shape[1])


@dataclass(frozen=True)
class ErrorMotion:
    """What people quote of one probe's record (m).

    Peak to valley of the record, of its repeatable and of its nonrepeatable part (`total`, `repeatable`, `nonrepeatable`) with their root
    mean squares about the mean; six standard deviations of the NRRO, as drives are specified; `eccentricity`, the part once per revolution
    (zero to peak); and the error motion values of ISO 230-7, of the plot about its centre: `total_error`, `synchronous_error`,
    `asynchronous_error` (the widest band of all revolutions at one angle).
    """

    total: float
    repeatable: float
    nonrepeatable: float
    total_rms: float
    repeatable_rms: float
    nonrepeatable_rms: float
    eccentricity: float
    total_error: float
    synchronous_error: float
    asynchronous_error: float

    @property
    def six_sigma(self) -> float:
        return 6 * self.nonrepeatable_rms


def turning_frequency(time: Array, angle: Array) -> float:
    """Revolutions a second, signed, of a record at constant speed; ValueError if its angle (rad) is not a straight line over time (s)."""
    slope, start = np.polynomial.polynomial.polyfit(time - time[0], angle, 1)[::-1]
    away = float(np.abs(angle - start - slope * (time - time[0])).max())
    if away > STRAIGHT:
        raise ValueError(f"the speed of the record is not constant: its angle leaves a straight line by {away:.3g} rad")
    if abs(angle[-1] - angle[0]) < 2 * np.pi:
        raise ValueError("the record holds less than one revolution")
    return float(slope / (2 * np.pi))


def revolutions(time: Array, angle: Array, value: Array, samples: int | None = None) -> Revolutions:
    """The whole revolutions of a record (probes, n), from its first sample on, at `samples` equal steps of the angle; RRO by averaging.

    By default about as many samples as the record has. `angle` (n,) rad must rise or fall throughout; the speed may vary. Splines of degree
    5 through the samples: their error falls with the sixth power of the step, 3e-6 of a line with ten samples a period.
    """
    turned = np.abs(angle - angle[0])
    if np.any(np.diff(turned) <= 0):
        raise ValueError("the angle of the record does not go one way")
    count = int(np.floor(turned[-1] / (2 * np.pi) + 1e-9))
    if count < 1:
        raise ValueError("the record holds less than one revolution")
    samples = samples or 4 * int(np.ceil(len(time) / (turned[-1] / (2 * np.pi)) / 4))
    wanted = 2 * np.pi * np.arange(count * samples) / samples
    moments = make_interp_spline(turned, time, 3)(wanted)
    found = make_interp_spline(time, value, 5, axis=-1)(moments)
    sense = np.sign(angle[-1] - angle[0])
    start = np.mod(sense * angle[0], 2 * np.pi)
    cut = found.reshape(len(value), count, samples)
    return Revolutions(start + wanted[:samples], moments, cut, cut.mean(axis=1))


def leakage(orders: Array | float, count: int) -> Array:
    """Gain (signed) with which a line at `orders` times the turning frequency stays in the mean of `count` revolutions, about its middle.

    The value is of the sum over revolutions k of exp(2 pi i orders (k - (count - 1) / 2)) / count.
    """
    near = np.asarray(orders, float) - np.round(orders)
    small = np.abs(near) < 1e-12
    sign = np.where(np.round(orders) % 2 * ((count - 1) % 2) == 1, -1.0, 1.0)
    safe = np.where(small, 0.5, near)
    return np.asarray(sign * np.where(small, 1.0, np.sin(np.pi * count * safe) / (count * np.sin(np.pi * safe))))


def from_orders(angle: Array, phasor: ComplexArray, orders: Sequence[int]) -> Array:
    """The repeatable part (probes, len(angle)) m of phasors (probes, orders) at whole `orders`, referred to angle 0."""
    return np.asarray((phasor @ np.exp(1j * np.outer(orders, angle))).real)


def once_per_revolution(angle: Array, value: Array) -> Array:
    """Phasor (probes,) of the part once per revolution of (probes, samples): the least-squares circle's centre."""
    return np.asarray(2 * (value * np.exp(-1j * angle)).mean(axis=-1))


def error_motion(cut: Revolutions, probe: int, radial: bool) -> ErrorMotion:
    """The values of one probe; a radial one is centred on its least-squares circle."""
    value, mean, rest = cut.value[probe], cut.repeatable[probe], cut.nonrepeatable[probe]
    once = once_per_revolution(cut.angle, mean)
    centre = (once * np.exp(1j * cut.angle)).real if radial else np.zeros_like(mean)
    return ErrorMotion(
        total=float(np.ptp(value)),
        repeatable=float(np.ptp(mean)),
        nonrepeatable=float(np.ptp(rest)),
        total_rms=float(value.std()),
        repeatable_rms=float(mean.std()),
        nonrepeatable_rms=float(np.sqrt((rest**2).mean())),
        eccentricity=float(abs(once)),
        total_error=float(np.ptp(value - centre)),
        synchronous_error=float(np.ptp(mean - centre)),
        asynchronous_error=float(np.ptp(rest, axis=0).max()),
    )
