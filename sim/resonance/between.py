"""Crossings of a line and a mode between two neighbours of the grid, interpolated: for spindles
with more of them than can be found one by one.

Place and frequency come from the polynomial through the four nearest points of the grid. Strengths are those of the line
on the mode at both neighbours, each at its own resonance, interpolated linearly. Runout is that of all lines at the
nearer neighbour, line by line with their frequencies and the pole of the mode moved to the crossing; a map computes it
where its curves of runout pass. What this is worth is seen where crossings are also found exactly (`found.Interpolated`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermospindle.model.types import Array
from thermospindle.sim.resonance.point import Exact, Key, key, rms_of_lines
from thermospindle.sim.running.probes import speed_ratio

POINTS = 4


def passes_zero(gap: Array) -> NDArray[np.bool_]:
    """Whether a gap (..., n) passes zero from each place to the next, (..., n - 1); one that stands
    on zero at a place does so on the way to it, once."""
    before, after = gap[..., :-1], gap[..., 1:]
    return (before * after < 0) | ((after == 0) & (np.abs(before) > 0))


@dataclass(frozen=True)
class Between:
    """A crossing at `share` of the way from one neighbour to the other, and the frequency (Hz) there."""

    share: float
    frequency: float


def between(places: Array, gap: Array, mode: Array, first: int) -> Between:
    """Where `gap` (n,) Hz passes zero between `places` (n,) number `first` and the next, and the frequency of the `mode` (n,) Hz there."""
    own = np.arange(max(first - 1, 0), min(first - 1 + POINTS, len(places)))
    own = own[np.isfinite(gap[own]) & np.isfinite(mode[own])]
    a, b = places[first], places[first + 1]
    slopes = np.diff(gap[own])
    if len(own) > 2 and (np.all(slopes > 0) or np.all(slopes < 0)):
        place = _through(gap[own], places[own], 0.0)
    else:
        place = a + (b - a) * gap[first] / (gap[first] - gap[first + 1])
    place = float(np.clip(place, min(a, b), max(a, b)))
    return Between(float((place - a) / (b - a)), _through(places[own], mode[own], place))


def _through(x: Array, y: Array, at: float) -> float:
    """Lagrange's polynomial through (x, y) at a place."""
    total = 0.0
    for i in range(len(x)):
        others = np.delete(x, i)
        total += float(y[i] * np.prod((at - others) / (x[i] - others)))
    return total


def strengths(ends: tuple[Exact, Exact], share: float, number: int, which: Key) -> tuple[float, float, float] | None:
    """Sense, strength and unit strength (m) of a line on a mode between two conditions; None where neither has both."""
    found = [
        (weight, e.amplitudes(number, which, resonant=True))
        for weight, e in zip((1 - share, share), ends, strict=True)
        if number in e.modes and which in e.lines and e.point.condition.speed
    ]
    total = sum(w for w, _ in found)
    if total <= 0.0:
        return found[0][1] if found else None
    return tuple(sum(w * v[k] for w, v in found) / total for k in range(3))  # type: ignore[return-value]


def runout(ends: tuple[Exact, Exact], share: float, number: int, which: Key, frequency: float) -> tuple[float, float]:
    """Radial and axial runout (m rms) at a crossing between two conditions."""
    near, far = (ends[0], ends[1]) if share < 0.5 and ends[0].point.condition.speed else (ends[1], ends[0])
    forward = share if near is ends[0] else 1 - share
    lines, away = near.forces.line, far.lines
    if not lines:
        return 0.0, 0.0
    at = np.array([f + forward * (away[k].frequency - f) if (k := key(line)) in away else f for line, f in zip(lines, near.forces.frequency, strict=True)])
    at[[key(line) == which for line in lines]] = frequency
    p = near.point.poles
    value = p.value.copy()
    own = int(np.argmin(np.abs(value - near.modes[number].pole)))
    moved = 2 * np.pi * frequency / abs(value[own]) * value[own]
    value[np.argmin(np.abs(value - value[own].conjugate()))], value[own] = moved.conjugate(), moved
    answers = (near.modal_forces / (2j * np.pi * at[:, None] - value)) @ (near.probes @ p.right).T
    speed = near.point.condition.speed + forward * (far.point.condition.speed - near.point.condition.speed)
    return rms_of_lines(lines, at, abs(speed * speed_ratio(near.point.spindle)) / (2 * np.pi), answers)
