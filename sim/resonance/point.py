"""One condition of a resonance map: its modes and lines, how strongly a line excites a mode, and the runout of all lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from thermospindle.model.bearing.kinematics import SIDEBANDS, Line
from thermospindle.model.built.imperfections import Imperfections, RowImperfections, Wave
from thermospindle.model.carrier import named, unbalanced
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.modes import Mode
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.operating import OperatingPoint
from thermospindle.sim.running.excitation import Harmonics, harmonics, response
from thermospindle.sim.running.probes import hub_probes, speed_ratio

UNIT_WAVE, UNIT_UNBALANCE = 1e-6, 1e-6  # m, kg m (1 g mm)

Key = tuple[str, str, int, str, int, str]
"""What a line is, at any condition: bearing, cause, order, direction, whirl, name."""


def key(line: Line) -> Key:
    return line.bearing, line.cause, line.order, line.direction, line.whirl, line.name


@dataclass(frozen=True, eq=False)
class Exact:
    """One condition: its modes by track number, lines by key, poles."""

    point: OperatingPoint
    modes: Mapping[int, Mode]
    lines: Mapping[Key, Line]
    multiples: int

    @cached_property
    def forces(self) -> Harmonics:
        """Of the condition's imperfections."""
        return harmonics(self.point)

    @cached_property
    def _unit_forces(self) -> dict[str, Harmonics]:
        return {}

    def unit_forces(self, bearing: str) -> Harmonics:
        """Of unit imperfections of one bearing, or of the rotor for the line of no bearing."""
        if bearing not in self._unit_forces:
            whole = unit_imperfections(self.point.spindle, self.multiples)
            own = replace(whole, bearings={name: row for name, row in whole.bearings.items() if name == bearing})
            self._unit_forces[bearing] = harmonics(with_imperfections(self.point, own))
        return self._unit_forces[bearing]

    @cached_property
    def probes(self) -> Array:
        return np.array([p.row(self.point.chain) for p in hub_probes(self.point.spindle)])

    @cached_property
    def modal_forces(self) -> ComplexArray:
        """What every line does to every mode, (lines, 2 dofs)."""
        return np.asarray(self.forces.force @ self.point.poles.left.T, complex)

    def amplitudes(self, number: int, which: Key, resonant: bool = False) -> tuple[float, float, float]:
        """Sense, strength and unit strength (m) of a line on a mode at this condition, with `resonant` as if the line stood on the mode."""
        p = self.point.poles
        at = int(np.argmin(np.abs(p.value - self.modes[number].pole)))
        axial = which[3] == "axial"
        values = []
        for found in (self.forces, self.unit_forces(which[0])):
            force = next((f for line, f in zip(found.line, found.force, strict=True) if key(line) == which), None)
            values.append(np.zeros(p.left.shape[1], complex) if force is None else force)
        frequency = self.modes[number].frequency if resonant else self.lines[which].frequency
        modal = [complex(p.left[at] @ f) / (2j * np.pi * frequency - p.value[at]) for f in values]
        sizes = [_size(self.probes @ p.right[:, at] * q, axial) for q in modal]
        own, other = abs(p.left[at] @ values[1]) ** 2, abs(p.left[at] @ values[1].conj()) ** 2
        sense = 1.0 if axial else float(own / (own + other)) if own + other else 0.0
        return sense, sizes[0], sizes[1]


def _size(phasors: ComplexArray, axial: bool) -> float:
    """Amplitude along the axis, or the long half axis of the orbit across it, from phasors of the probes x, y, z."""
    x, y, z = phasors
    return float(abs(z)) if axial else orbit(x, y)


def orbit(x: complex, y: complex) -> float:
    """Long half axis (m) of an orbit across the axis, from phasors (m)."""
    return float(np.sqrt((abs(x) ** 2 + abs(y) ** 2 + abs(x * x + y * y)) / 2))


def with_imperfections(point: OperatingPoint, imperfections: Imperfections) -> OperatingPoint:
    """The point with imperfections of another size; effects do not change them."""
    effects = tuple((replace(effect, imperfections=None), values) for effect, values in point.effects)
    return replace(point, spindle=replace(point.spindle, imperfections=imperfections), effects=effects)


def unit_imperfections(spindle: Spindle, multiples: int) -> Imperfections:
    """1 um of every radial wave that makes a line, axial where its order is a multiple of the balls, on one ball 1 um of size and of
    every even wave, 1 g mm of unbalance of hub and cages; with those of the sidebands of rings that a load displaces."""
    sides = range(1, SIDEBANDS + 1) if spindle.loaded_across else (1,)

    def waves(orders: Sequence[int]) -> tuple[Wave, ...]:
        return tuple(Wave(n, UNIT_WAVE, 0.0) for n in orders)

    rows = {}
    for b in spindle.rolling:
        axial = [b.balls * k for k in range(1, multiples + 1)]
        radial = waves([*sides, *sorted(n + by * side for n in axial for side in sides for by in (-1, 1))])
        balls = (waves(range(2, 2 * multiples + 1, 2)), *[()] * (b.elements - 1))
        sizes = (UNIT_WAVE, *[0.0] * (b.elements - 1))
        rows[b.name] = RowImperfections(radial, waves(axial), radial, waves(axial), sizes, balls, UNIT_UNBALANCE)
    body = unbalanced(spindle)
    return Imperfections(unbalance=UNIT_UNBALANCE, unbalance_z=body.z, bearings=rows, unbalance_body=named(spindle, body))


def line_amplitudes(found: Exact) -> dict[Key, float]:
    """Amplitude (m) of the hub in every line, in its own direction."""
    forces = found.forces
    if not forces.line:
        return {}
    at_probes = response(found.point, forces) @ found.probes.T
    return {key(line): _size(one, line.direction == "axial") for line, one in zip(forces.line, at_probes, strict=True)}


def nrro_rms(found: Exact) -> tuple[float, float]:
    """Radial (mean square of x and y) and axial rms (m) of all lines that are no whole multiple of
    the speed of what the probes see, from the linear response.

    Lines of one bearing at equal frequency add up as phasors, others as squares: the cages of two bearings drift against each other.
    """
    forces, turning = found.forces, abs(found.point.condition.speed * speed_ratio(found.point.spindle)) / (2 * np.pi)
    if not forces.line or turning == 0.0:
        return 0.0, 0.0
    at_probes = response(found.point, forces) @ found.probes.T
    return rms_of_lines(forces.line, forces.frequency, turning, at_probes)


def rms_of_lines(lines: Sequence[Line], frequency: Array, turning: float, at_probes: ComplexArray) -> tuple[float, float]:
    """As `nrro_rms`, of phasors (lines, 3) m at the probes of lines at `frequency` (lines,) Hz of what they see, `turning` at so many Hz."""
    sums: dict[tuple[str, float], ComplexArray] = {}
    for line, order, one in zip(lines, frequency / turning, at_probes, strict=True):
        if abs(order - round(order)) > 1e-6:
            where = (line.bearing, round(float(order), 9))
            sums[where] = sums.get(where, np.zeros(3, complex)) + one
    x, y, z = (np.abs(np.array([*sums.values(), np.zeros(3)])) ** 2 / 2).sum(axis=0)
    return float(np.sqrt((x + y) / 2)), float(np.sqrt(z))
