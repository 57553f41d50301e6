"""Line spectra over speed: what a run-up passes through, steady at every speed, with the natural frequencies it crosses.

Every speed is an operating point of its own, so that bearing stiffness, contact angles and gyroscopic
effect are right at each. Amplitudes are exact at every line, with no resolution in frequency to speak of.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.types import Array
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point
from thermospindle.sim.running.excitation import harmonics, response
from thermospindle.sim.running.lines import amplitude_of
from thermospindle.sim.running.probes import hub_probes, probe_rows

STEPS = 25
"""Speeds of a waterfall, up to 1.25 times the speed of a record, so that the record's is one of them."""


@dataclass(frozen=True, eq=False)
class LineSpectrum:
    """Lines at one speed: `frequency` (k,) Hz, and amplitudes (k,) m of the hub across the axis (largest semi-axis) and along it; lines of
    one frequency are added up. `natural`: natural frequencies (modes,) Hz."""

    speed: float  # rad/s
    frequency: Array
    radial: Array
    axial: Array
    natural: Array


def waterfall(spindle: Spindle, temperature: float, speeds: Sequence[float]) -> list[LineSpectrum]:
    """Line spectra at one temperature (C) and several speeds (rad/s), none of them zero; those beyond the tables of bearings are left out."""
    return [_spectrum(spindle, Condition(temperature, speed)) for speed in speeds if _known(spindle, speed)]


def _known(spindle: Spindle, speed: float) -> bool:
    """Whether every bearing given by a table over speed is known at a speed (rad/s)."""
    tables = (b.speed for b in spindle.linear_bearings if len(b.speed) > 1)
    return all(t[0] - 1e-9 * RPM <= abs(speed) <= t[-1] + 1e-9 * RPM for t in tables)


def run_up(speed: float) -> list[float]:
    """`STEPS` even steps up to a quarter above a speed (rad/s)."""
    return [1.25 * speed * k / STEPS for k in range(1, STEPS + 1)]


def _spectrum(spindle: Spindle, condition: Condition) -> LineSpectrum:
    point = operating_point(spindle, condition)
    excited, sense = harmonics(point), float(np.sign(condition.speed))
    phasor = response(point, excited) @ probe_rows(point, hub_probes(spindle)).T  # (lines, 3)
    frequency, which = np.unique(np.round(excited.frequency, 9), return_inverse=True)
    total = np.zeros((len(frequency), 3), complex)
    np.add.at(total, which, phasor)
    return LineSpectrum(
        condition.speed,
        frequency,
        np.array([amplitude_of(row[:2], sense)[0] for row in total]),
        np.abs(total[:, 2]),
        np.array([m.frequency for m in point.modes]),
    )


def on_grid(spectrum: LineSpectrum, grid: Array, direction: str) -> Array:
    """Largest amplitude (m) of the lines nearest to every frequency of an even `grid` (Hz), 0 where there is none; for drawing."""
    amplitude = spectrum.radial if direction == "radial" else spectrum.axial
    place = np.round((spectrum.frequency - grid[0]) / (grid[1] - grid[0])).astype(int)
    inside = (place >= 0) & (place < len(grid))
    found = np.zeros(len(grid))
    np.maximum.at(found, place[inside], amplitude[inside])
    return found
